#include "pipelines/stages/annealing.hpp"

#include <algorithm>
#include <cmath>

#include "statistics/correlated_series.hpp"

namespace shakebed::pipelines {

// A ramp is cut into pieces of a time unit, each at the temperature of its middle: so many at least and at most.
constexpr double fewest_ramp_pieces = 16, most_ramp_pieces = 10'000;
constexpr int hold_pieces = 64;  // with a look at the end of each in the second half

Annealing::Annealing(const std::vector<AnnealingStep>& steps, double bath_temperature) : steps_(steps) {
  double time = 0, before = bath_temperature;
  for (std::uint32_t k = 0; k < steps_.size(); ++k) {
    const auto& [to, ramp, hold] = steps_[k];
    const int pieces =
        ramp > 0 ? static_cast<int>(std::clamp(std::ceil(ramp), fewest_ramp_pieces, most_ramp_pieces)) : 0;
    for (int i = 0; i < pieces; ++i)
      pieces_.push_back({time + ramp * (i + 1) / pieces, before + (to - before) * (i + 0.5) / pieces, k, false});
    time += ramp;
    for (int i = 0; i < hold_pieces && hold > 0; ++i)
      pieces_.push_back({time + hold * (i + 1) / hold_pieces, to, k, i >= hold_pieces / 2});
    time += hold;
    before = to;
  }
}

std::vector<sim::BathStep> Annealing::bath() const {
  std::vector<sim::BathStep> bath;
  for (const Piece& piece : pieces_) bath.push_back({piece.until, piece.temperature});
  return bath;
}

void Annealing::prepare(sim::Simulation& simulation) {
  mass_ = simulation.properties().mass;
  temperatures_.assign(steps_.size(), {});
  heights_.assign(steps_.size(), {});
}

void Annealing::step(sim::Simulation& simulation, std::uint64_t step) {
  const Piece& piece = pieces_[step];
  if (!piece.looks) return;
  sim::Snapshot at;
  simulation.snapshot(at);
  double mass = 0, height = 0, kinetic = 0;
  for (std::size_t i = 0; i < at.z.size(); ++i) {
    const double m = mass_[i];
    mass += m;
    height += m * at.z[i];
    kinetic += m * (at.vx[i] * at.vx[i] + at.vz[i] * at.vz[i]) / 2;
  }
  temperatures_[piece.step].push_back(kinetic / static_cast<double>(at.z.size()));
  heights_[piece.step].push_back(height / mass);
}

Table Annealing::rows(Table table) const {
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    const bool seen = !heights_[k].empty();
    const statistics::Mean temperature = statistics::mean_of(temperatures_[k]),
                           height = statistics::mean_of(heights_[k]);
    table.add({count_cell(k), steps_[k].temperature, seen ? temperature.value : no_number,
               seen ? temperature.std_error : no_number, seen ? height.value : no_number,
               seen ? height.std_error : no_number});
  }
  return table;
}

}  // namespace shakebed::pipelines
