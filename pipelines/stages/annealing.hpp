// Annealing: the temperatures of a reservoir before the bed settles, and the means of the bed over them.
#pragma once

#include <cstdint>
#include <vector>

#include "pipelines/formats/table.hpp"
#include "sim/measure/measure.hpp"

namespace shakebed::pipelines {

// Reduced units, or those of the recipe.
struct AnnealingStep {
  double temperature = 0;  // T/(m g), a length
  double ramp = 0;         // time in which T changes linearly to it
  double hold = 0;         // time for which it stays
};

class Annealing final : public sim::RunObserver {
 public:
  // steps: in reduced units; bath_temperature: before the first of them.
  Annealing(const std::vector<AnnealingStep>& steps, double bath_temperature);
  std::vector<sim::BathStep> bath() const;
  // Rows of schedule.csv, means over the second half of each hold, into the empty table.
  Table rows(Table table) const;

  void prepare(sim::Simulation& simulation) override;
  void step(sim::Simulation& simulation, std::uint64_t step) override;
  void look(sim::Simulation&, const sim::Snapshot&, std::uint64_t, std::uint32_t) override {}
  void save(sim::ArchiveWriter& out) override { out(temperatures_, heights_); }
  void load(sim::ArchiveReader& in) override { in(temperatures_, heights_); }

 private:
  // The temperature of the bath up to a time; in the second half of a hold, with a look at the bed at its end.
  struct Piece {
    double until, temperature;
    std::uint32_t step;
    bool looks;
  };
  std::vector<AnnealingStep> steps_;
  std::vector<Piece> pieces_;
  std::vector<double> mass_;
  // Of each step, look by look: kinetic temperature, height of the centre of mass.
  std::vector<std::vector<double>> temperatures_, heights_;
};

}  // namespace shakebed::pipelines
