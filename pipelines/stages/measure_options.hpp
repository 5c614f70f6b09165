// When a simulated bed is sampled and through which kernel: the options settle, measure, frames and profile of the
// stage `simulate`. Their rules are those of the library (sim/measure/measured_bed.hpp).
#pragma once

#include "pipelines/formats/config.hpp"
#include "sim/measure/measured_bed.hpp"

namespace shakebed::pipelines {

class BedMeasureOptions {
 public:
  void describe(Fields& fields);
  // In the bed's own units: lengths in D, times in `time_unit` [s].
  sim::MeasureOptions reduced(double time_unit) const;
  // Names the options that cannot be, each at its place.
  void check(Fields& fields, double floor_period, double time_unit) const;
  double settle() const { return settle_; }      // [s]
  double duration() const { return duration_; }  // [s]
  bool keeps_frames() const { return measure_.frames > 0; }
  bool names_phases() const { return !measure_.frame_phases.empty(); }

 private:
  double settle_ = 0, duration_ = 0;  // [s]
  sim::MeasureOptions measure_;       // all but the times
};

// For advice: what is advised is accepted.
double rounded_up_to_four_digits(double value);

}  // namespace shakebed::pipelines
