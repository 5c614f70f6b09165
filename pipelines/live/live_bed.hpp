// The bed of the page that `shakebed live` writes: a shaken bed that goes on as long as one watches, with what has been
// measured so far. It is the bed that `shakebed run` makes of the page's recipe: same scene, same looks, same seed.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "sim/measure/measured_bed.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines::live {

// As the page's recipe states it; SI.
struct Settings {
  double count = 0;
  double diameter = 0;     // D [m]
  double width = 0;        // W [m]
  double gamma = 0;        // a (2 pi f)^2/g
  double frequency = 0;    // f [Hz]
  double restitution = 1;  // of disks, floor and sides
  double friction = 0;     // of disks and floor; the sides have none
  double periodic = 0;     // 1: periodic sides
  double hexagonal = 0;    // 1: rows from the floor up, with velocities at 0.01 m g D; 0: at random, at rest
  double seed = 1;
  double settle = 0;  // time before the first look [s]
};

// What the page shows beside profile and disks; reduced units. Errors are NaN where there is none yet.
struct Numbers {
  double time = 0, time_unit = 1;  // since the start; in seconds
  double period = 1, settled = 0;  // of the floor; first look
  double amplitude = 0;            // of the floor [D]
  double collisions = 0;
  double periods = 0;  // that have been measured
  double floor = 0;    // its position
  double temperature_x = 0, temperature_x_error = 0, temperature_z = 0, temperature_z_error = 0;  // [m g D]
  double rise = 0, rise_error = 0;  // of the centre of mass above ideal packing [D]
  double column_number = 0;         // N D/W
  double curve_temperature = 0;     // of the fitted curve [m g D]
  double curve_misfit = 0;          // rms of density less curve [1/D^2]
};

class LiveBed {
 public:
  // Throws std::invalid_argument or std::runtime_error with what is wrong.
  explicit LiveBed(const Settings& settings);

  // Towards this time since the start [reduced], through all looks before it; returns after about `events` events,
  // wherever it is then: whether it arrived.
  bool advance_towards(double time, std::uint64_t events);
  // Once it has arrived.
  const sim::Snapshot& snapshot();
  const Numbers& numbers();
  // Density against height, and the curve of an equilibrium fluid over a rectangle (Enskog) that has the bed's column
  // and centre of mass and fits best. Empty before the first period is over.
  const sim::Profile& profile() const { return profile_; }
  const std::vector<double>& curve() const { return curve_; }
  // Makes numbers, profile and curve anew; a fit takes some ms.
  void measure();

 private:
  void look();
  void fit_curve();
  double sample_curve(double temperature, double centre, std::vector<double>& out) const;

  sim::Scene scene_;
  sim::MeasureOptions options_;
  sim::LookPlan plan_;
  std::unique_ptr<sim::Simulation> simulation_;
  std::optional<sim::BedObserver> observer_;
  std::uint64_t next_look_ = 0;
  sim::Snapshot at_;
  sim::Profile profile_;
  std::vector<double> curve_;
  Numbers numbers_;
};

}  // namespace shakebed::pipelines::live
