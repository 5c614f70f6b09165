// A bed measured in one call. It settles, is sampled at equally spaced phases of the floor's period, and the result
// holds means with their errors. Reduced units.
//
//   MeasuredBed bed = measure(scene, {.settle = 200, .duration = 800});
//   if (!bed.ok()) ... bed.message ...
//   bed.temperature_x.value
//
// Errors include the correlation in time [MeketonSchmeiser1984]. The same scene, options and seed give the same bytes.
// Nothing is printed and no global state is kept: any number of threads may measure, each its own bed. The result owns
// all of its arrays. For observers of one's own, states that are kept, and replicas: measure.hpp.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::sim {

// The recipe's stage `simulate` has the same options under the same names.
struct MeasureOptions {
  double settle = 0;          // time before the first sample; a shaken bed begins at the next start of a period
  double duration = 100;      // time over which the bed is measured; whole periods of a shaken floor
  std::uint32_t phases = 32;  // samples per period of a shaken floor; other beds: about 4 per unit of time
  double spacing = measuring_spacing;      // of the profile's heights [D]
  Kernel kernel = measuring_kernel;        // through which density is measured
  std::uint64_t frames = 0;                // snapshots that are kept, equally spaced over the samples
  std::vector<double> frame_phases{};      // phases of the shaking, 0 to 1, at which they are taken; none: at all
  std::function<bool()> stop{};            // called about every 0.1 s; true ends the run
  std::function<void(double)> progress{};  // gets the fraction of the run that is done
  std::function<void(const Snapshot&, double phase)>
      frame_sink{};  // receives the frames; MeasuredBed::frames stays empty

  // Reasons why this scene cannot be measured with these options, one sentence each; empty if it can.
  [[nodiscard]] std::vector<std::string> validate(const Scene& scene) const;

  // The same for a caller with words of its own. too_many_periods: above 1e12, a mistake in the units.
  enum class Problem {
    settle,
    duration,
    phases,
    spacing,
    kernel,
    shorter_than_a_period,
    too_many_periods,
    too_many_frames,
    frame_phases,  // twice the same, none of the samples, or the floor stands still
  };
  [[nodiscard]] std::vector<Problem> problems(double floor_period) const;
};

// When the bed is sampled, and which of the samples ("looks") are kept as frames.
struct LookPlan {
  MeasurementSchedule schedule;
  std::uint64_t frame_stride = 0;  // in looks; no factor in common with `phases`, so that frames visit every phase
  std::uint64_t frames = 0;
  bool shaken = false;
  std::vector<std::uint32_t> frame_phases{};  // in rising order; none: frames are taken at all phases

  // How many looks there are at which frames may be taken.
  std::uint64_t possible_frames() const {
    return frame_phases.empty() ? schedule.looks() : schedule.periods * frame_phases.size();
  }
  bool takes_frame(std::uint64_t look) const;
};
LookPlan plan_looks(const Scene& scene, const MeasureOptions& options);
LookPlan plan_looks(double floor_period, const MeasureOptions& options);  // 0: the floor stands still
// The period of the floor's motion; 0 when it stands still.
double floor_period(const Scene& scene);
// Heights from below the lowest place of the floor to above the most expanded bed. The highest temperature that the
// scene's bath will have is `hottest_bath`, where that is above its present one.
HeightGrid profile_heights(const Scene& scene, const MeasureOptions& options, double hottest_bath = 0);

// The heights of a profile from the lowest to the highest that holds anything: first to last - 1. Below 1e-12/D^2 there
// is only the tail of the kernel.
struct FilledHeights {
  std::size_t first = 0, last = 0;
};
FilledHeights filled_heights(const Profile& profile);

enum class MeasureStatus {
  ok,
  stopped,         // options.stop() ended it: nothing was measured
  bad_input,       // the scene or the options are invalid: see message
  precision_lost,  // overlaps, or energy that is not conserved: see message
};
std::string_view to_string(MeasureStatus status);

struct MeasuredBed {
  MeasureStatus status = MeasureStatus::bad_input;
  std::string message;  // one sentence, unless ok

  Profile profile;              // n D^2 against the height above the floor's mean position
  Profile floor_frame_profile;  // against the height above the moving floor
  // Of the mean densities of `profile`, row by row, heights covariance_first to covariance_last - 1.
  std::vector<double> covariance;
  std::size_t covariance_first = 0, covariance_last = 0;
  std::size_t covariance_samples = 0;  // estimated number of independent samples

  Measured centre_of_mass;          // height [D]
  Measured centre_of_mass_rise;     // above ideal hexagonal packing [D]
  Measured temperature_x;           // m <v_x^2> [m g D; weightless: T0]
  Measured temperature_z;           // of v_z without the bed's mean velocity at each phase
  Measured spin_temperature;        // I <w^2>; 0 for smooth disks
  Measured compressibility_factor;  // P V/(N T) by the virial theorem; of a box that is periodic both ways
  EnergyLedger energy;              // at the end
  Counters counters;                // of the whole run
  double largest_overlap = 0;       // at the end [D]
  std::uint64_t periods = 0;        // measured
  DiskProperties disks;
  std::vector<Snapshot> frames;
  std::vector<double> frame_phases;  // of the floor's cycle, 0 to 1
  Measured temperature_z_local;      // of v_z without the mean velocity of each layer of 1 D at each phase

  [[nodiscard]] bool ok() const { return status == MeasureStatus::ok; }
  [[nodiscard]] std::string brief() const;  // one line
  [[nodiscard]] std::string full() const;   // one line per number
};

// Does not throw for an invalid scene or invalid options: see the status.
MeasuredBed measure(const Scene& scene, const MeasureOptions& options);

}  // namespace shakebed::sim
