// What several runs of the same bed give together.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/bed_measurement.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines {

// How the replicas of a bed begin.
enum class ReplicaStarts {
  alternate,  // the first as the recipe says, the next from a random fill, and so on in turn
  same        // all as the recipe says
};

// Joins the observables.json of replicas. A quantity becomes the mean with its error (`std_error`), the spread between
// the replicas (`spread`) and the error that a single replica states (`within`). Counts become sums. Other values are
// those of the first replica. The error is that of the mean of independent beds, never below the error that the beds
// state. It is scaled by Student's t for the few replicas: 1.96 of it hold the mean of further beds in 95 % of all
// cases.
Json joined_results(const std::vector<Json>& results);
// Error of the mean of n beds over their spread over sqrt(n): the 95 % of Student's distribution over those of a normal
// one. 1 for a single bed.
double few_beds_factor(std::size_t n);
// Whether the bed, or all beds, hardly moved: what they differ by then says nothing.
bool lies_still(const Json& joined);
// The first of T_x, T_z and the rise by which n beds differ by more than each of them states.
struct NotableSpread {
  const char *key, *what;  // "temperature_x", "T_x"
  double spread, within;
};
std::optional<NotableSpread> notable_spread(const Json& joined, std::size_t n);
// The first of T_x and the rise that changed while it was measured.
struct NotableDrift {
  const char* what;
  double change, error;
  double part;  // |change| over the number itself
};
std::optional<NotableDrift> notable_drift_of(const Json& joined);
// What the replicas say of the bed's measurement, a sentence each: that they differ by more than each of them states,
// that the bed still changed while it was measured. Also for a single run.
std::vector<std::string> replica_warnings(const std::vector<Json>& results, const Json& joined, ReplicaStarts starts);
Table replicas_table(const std::vector<Json>& results);  // each replica by itself

// The mean of the replicas' densities, with errors from their spread.
sim::Profile joined_density(const std::vector<const BedMeasurement*>& measurements, bool floor_frame);
// Of the filled rows of joined_density(measurements, false).
std::vector<double> joined_covariance(const std::vector<const BedMeasurement*>& measurements,
                                      const sim::Profile& joined, std::size_t& independent_blocks);

}  // namespace shakebed::pipelines
