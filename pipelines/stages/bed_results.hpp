// The numbers and tables of a simulated bed (observables.json and the CSV files beside it), stated before it runs.
#pragma once

#include <cstdint>

#include "pipelines/formats/results.hpp"
#include "pipelines/stages/bed_measurement.hpp"

namespace shakebed::pipelines {

struct BedOutput {
  bool reduced = false, weightless = false, periodic_upwards = false;
  bool judged = false;            // a shaken bed under gravity
  bool contact_duration = false;  // the TC model's
  bool material = false;          // is named
  bool shaken = false, frames = false, named_phases = false, annealed = false;
  bool tilted = false;  // and not in reduced units
  bool free_lid = false;
  bool rubs = false;  // on plates
  bool two_species = false;
  std::uint32_t replicas = 1;
  ObserveOptions observe;
};
void state_bed_results(ResultList& list, const BedOutput& bed);

}  // namespace shakebed::pipelines
