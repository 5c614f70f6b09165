#include "ingest/find/rim_trials.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ingest/find/profile_samples.hpp"

namespace shakebed::ingest {

namespace {

// Reductions of chi^2 that are required to accept a term, an unusual shape, and a tone curve.
constexpr double price_of_term = 6, price_of_oddity = 12, price_of_curve = 12;

}  // namespace

RimData rim_data(const BeadProfile& profile, double radius, double edge) {
  RimData data;
  const double reach = profile.reach_px();
  const double low = std::max(0.0, std::min(0.55 * radius, radius - 2.5 * edge));
  const double spacing = std::clamp(edge / 4, 0.08, (reach - low) / 30);
  for (double r = low + 0.5 * spacing; r < reach; r += spacing) {
    data.distance.push_back(r);
    data.level.push_back(value_at(profile.level, profile.step_px, r));
  }
  data.weight = data.distance;  // pixels at this distance
  return data;
}

void weigh(RimData& data, const RimConditions& conditions) {
  constexpr double sharp = 0.6;
  const double learning = conditions.edge_px < sharp ? 3e-3 : 3e-4;
  const double spacing = data.distance[1] - data.distance[0];
  for (std::size_t i = 0; i < data.distance.size(); ++i) {
    const double pixels =
        std::max(1.0, conditions.beads * 2 * std::numbers::pi * data.distance[i] * conditions.knot_px);
    data.weight[i] = std::min(1.0, spacing / conditions.knot_px) /
                     (conditions.noise * conditions.noise / pixels + learning * learning);
  }
  constexpr double likely_offset = 0.002;
  data.offset_weight = 1 / (likely_offset * likely_offset);
}

std::optional<RimData> data_in_light(const RimData& recorded, const RimConditions& conditions) {
  const double brightest = std::max({conditions.background_level, conditions.bead_level, 1.0});
  const auto light = [&](double level) { return std::pow(std::max(0.0, level) / brightest, 1 / display_exponent); };
  const double background = light(conditions.background_level), bead = light(conditions.bead_level);
  if (!(std::abs(bead - background) > 0.05)) return std::nullopt;
  RimData data = recorded;
  for (double& level : data.level)
    level = (light(conditions.background_level + (conditions.bead_level - conditions.background_level) * level) -
             background) /
            (bead - background);
  return data;
}

RimChoice choice_among(const std::vector<RimTrial>& trials, double scale, double points) {
  const auto cost = [&](const RimTrial& trial) {
    return trial.rim.squares / scale + price_of_term * trial.terms + (trial.odd ? price_of_oddity : 0) +
           (trial.exponent != 1 ? price_of_curve : 0);
  };
  const RimTrial least = *std::min_element(trials.begin(), trials.end(),
                                           [&](const RimTrial& a, const RimTrial& b) { return cost(a) < cost(b); });
  RimChoice choice;
  choice.rim = least.rim;
  choice.exponent = least.exponent;
  constexpr double fair = 5;  // chi^2 a point
  choice.rim.good = least.rim.squares < fair * points;
  double weights = 0, mean = 0;
  for (const RimTrial& trial : trials) {
    const double weight = std::exp(0.5 * std::max(-60.0, cost(least) - cost(trial)));
    weights += weight;
    mean += weight * trial.rim.radius_px;
  }
  mean /= weights;
  double fair_weights = 0, square = 0;
  for (const RimTrial& trial : trials) {
    const double surplus = cost(trial) - cost(least) - (trial.odd && !least.odd ? price_of_oddity : 0) -
                           (trial.exponent != 1 && least.exponent == 1 ? price_of_curve : 0);
    const double weight = std::exp(-0.5 * std::clamp(surplus, 0.0, 60.0));
    fair_weights += weight;
    square += weight * (std::pow(trial.rim.radius_px - mean, 2) + scale * std::pow(trial.rim.std_error_px, 2));
  }
  choice.rim.radius_px = mean;
  choice.rim.std_error_px = std::sqrt(square / fair_weights);
  return choice;
}

}  // namespace shakebed::ingest
