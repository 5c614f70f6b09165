#pragma once
// What the rim of a profile is fitted to, and what follows from fits of several shadings (bead_profile.hpp).

#include <optional>
#include <vector>

#include "ingest/find/bead_profile.hpp"

namespace shakebed::ingest {

// What is fitted: levels at distances from the centre, and the weight of each.
struct RimData {
  std::vector<double> distance, level, weight;
  double offset_weight = 0;  // of the level outside being 0
};

// The levels of a profile around its rim, each weighted by the number of pixels at its distance. `radius` and `edge`
// are first values, px.
RimData rim_data(const BeadProfile& profile, double radius, double edge);

// The weights of a profile's points: from the number of pixels at one distance and the accuracy of the learned profile.
// At a sharp edge square pixels see every direction differently.
void weigh(RimData& data, const RimConditions& conditions);

// The profile in light, for a camera that encodes for display; none when light hardly differs inside and outside.
std::optional<RimData> data_in_light(const RimData& recorded, const RimConditions& conditions);

// The fit of one shading in levels of one tone curve.
struct RimTrial {
  RimFit rim;
  double terms = 0, exponent = 1;
  bool odd = false;  // neither flat nor an evenly lit ball
};

// Shapes and tone curves that do as well each have their say; in the error, odd ones as much as any other.
// `scale` multiplies all variances, `points` is the number of independent points.
RimChoice choice_among(const std::vector<RimTrial>& trials, double scale, double points);

}  // namespace shakebed::ingest
