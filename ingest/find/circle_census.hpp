#pragma once
// Which circles a picture is made of, if any: radii, polarities and channels compete, and so does "none".
//
// Every hypothesis is scored by the length of edges on its circles' rims, weighted by contrast. A cost is subtracted
// for each circle's three numbers. So the score is what a description by circles saves. The same search on a copy
// stretched along one axis, where no circle is left, shows what chance explains (target and decoy, as in protein
// identification [EliasGygi]). That is subtracted. "None" wins unless much more is found in the picture itself.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "ingest/find/circle_search.hpp"

namespace shakebed::ingest {

constexpr double given_radius_factor = 1.25;  // a radius that is given holds within this factor
constexpr double circle_cost_px = 8;          // px of rim at a radius of 8 px, for a circle's place and radius

struct CircleHypothesis {
  std::size_t channel = 0;  // of those given
  Polarity polarity = Polarity::automatic;
  double radius_px = 0;
  double least_support = 0;    // share of the rim from which a circle is counted
  double circles = 0;          // seen in the part of the picture searched
  double by_chance = 0;        // of these, as the stretched copies tell
  double gain_px = 0;          // length of edges explained, what chance explains subtracted
  double explained_share = 0;  // of all edges at this scale
  double scatter = 0;          // of the edges about the rims, radii
  double contrast = 0;         // median step across the rim, grey levels
  std::vector<Circle> seen;    // px of the full frame
  // Chance makes up too many of its circles: not worth a full search.
  [[nodiscard]] bool hopeless() const { return by_chance > hopeless_share * circles; }
  static constexpr double hopeless_share = 0.5;
};

struct CensusOptions {
  Polarity polarity = Polarity::automatic;
  std::optional<double> radius_px;  // then only within given_radius_factor of it
  double smallest_radius_px = 2.5;
};

struct CircleCensus {
  std::vector<CircleHypothesis> hypotheses;  // best first, each another radius, polarity or channel
  double best_by_chance_px = 0;              // the largest gain of any hypothesis in the stretched copies
};

CircleCensus take_census(const std::vector<const GrayFrame*>& channels, const CensusOptions& options = {});

// Of one channel, whose number its hypotheses get; and of this one and others together.
CircleCensus census_of(const GrayFrame& frame, std::size_t channel, const CensusOptions& options = {});
void add_census(const CircleCensus& other, CircleCensus& census);

}  // namespace shakebed::ingest
