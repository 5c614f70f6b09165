// What several runs of the same bed give together.
#pragma once

#include <cstddef>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/bed_measurement.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines {

// Of observables.json. Quantities become means with their error and spread, counts become sums; what is neither is the
// first's.
Json joined_results(const std::vector<Json>& results);
Table replicas_table(const std::vector<Json>& results);  // each replica by itself

// The mean of the replicas' densities, with errors from their spread.
sim::Profile joined_density(const std::vector<const BedMeasurement*>& measurements, bool floor_frame);
// Of the filled rows of joined_density(measurements, false).
std::vector<double> joined_covariance(const std::vector<const BedMeasurement*>& measurements,
                                      const sim::Profile& joined, std::size_t& independent_blocks);

}  // namespace shakebed::pipelines
