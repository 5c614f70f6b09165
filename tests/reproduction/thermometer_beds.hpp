#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "sim/measure/observables.hpp"
#include "tests/fit/simulated_bed.hpp"

// Beds for the study of find_answer(): those from which its table of known biases was measured, those on which the
// result is shown, and shaken ones. Numbers of disks, widths, temperatures and lengths are spread evenly by multiples
// of irrational numbers; no bed, seed or temperature of one list is in another.
namespace shakebed::fit::simulated {

inline double spread(double multiple, std::size_t k) { return std::fmod(multiple * static_cast<double>(k + 1), 1.0); }

struct EquilibriumBed {
  Bed bed;
  double reduced = 1;  // T/T_c
  int frames = 250;
  std::uint64_t seed = 1;
  [[nodiscard]] double temperature() const { return reduced * bed.critical(); }
};

// Widths as they come, or such that a whole number of disks fits in with 1 % to spare: their crystals differ.
inline double width_of(double width, bool crystal_fits) { return crystal_fits ? 1.01 * std::round(width) : width; }

inline Bed bed_of(double rows, double width) {
  return {static_cast<std::uint32_t>(std::lround(rows * close_packing_density * width)), width};
}

// 24 beds of 8 to 24 rows, 15 to 31 D wide, at 20 temperatures from 0.3 to 45 T_c each; into the last 8 a crystal fits.
inline std::vector<EquilibriumBed> calibration_beds() {
  std::vector<EquilibriumBed> beds;
  for (std::size_t b = 0; b < 24; ++b) {
    const Bed bed = bed_of(8 + 16 * spread(0.7548776662, b), width_of(15 + 16 * spread(0.6180339887, b), b >= 16));
    for (std::size_t t = 0; t < 20; ++t) {
      const double part = (static_cast<double>(t) + spread(0.5698402910, b)) / 20;
      beds.push_back({bed, 0.3 * std::pow(150.0, part), 250, 500000 + 100 * b + t});
    }
  }
  return beds;
}

// 200 beds, each of its own: 7 to 25 rows, 14 to 32 D wide, 0.4 to 40 T_c, measured for 200 to 800 sqrt(D/g). A crystal
// fits into every fourth.
inline std::vector<EquilibriumBed> verification_beds() {
  std::vector<EquilibriumBed> beds;
  for (std::size_t b = 0; b < 200; ++b) {
    const double width = width_of(14 + 18 * spread(0.8191725134, b), b % 4 == 3);
    beds.push_back({bed_of(7 + 18 * spread(0.6710436067, b), width), 0.4 * std::pow(100.0, spread(0.5497004779, b)),
                    static_cast<int>(100 + 300 * spread(0.4142135624, b)), 900000 + b});
  }
  return beds;
}

// Without the empty heights far above the bed.
inline Profile without_empty_top(const Profile& whole) {
  const std::size_t all = whole.height.size();
  std::size_t bins = all;
  while (bins > 20 && whole.number_density[bins - 1] == 0) --bins;
  bins = std::min(all, bins + 8);
  Profile profile;
  profile.covariance_samples = whole.covariance_samples;
  for (std::size_t i = 0; i < bins; ++i) {
    profile.height.push_back(whole.height[i]);
    profile.number_density.push_back(whole.number_density[i]);
    profile.std_error.push_back(whole.std_error[i]);
    for (std::size_t j = 0; j < bins; ++j) profile.covariance.push_back(whole.covariance[i * all + j]);
  }
  return profile;
}

// As the program measures it: a Gaussian of 0.5 D every 0.25 D.
struct Measured {
  AnswerInput input;  // with N D/W and the kinetic temperatures
  double truth = 0;   // T of the bath [m g D]; 0 for a shaken bed
};

inline Measured measure(const EquilibriumBed& what) {
  BedRun run;
  run.bed = what.bed;
  run.temperature = what.temperature();
  run.settle = 100, run.interval = 2, run.frames = what.frames, run.seed = what.seed;
  run.spacing = 0.25, run.kernel = {KernelKind::gaussian, 0.5};
  std::vector<double> x, z;
  const ProfileFrames frames = profiles_of(run, [&](const sim::Snapshot& at) {
    double vx2 = 0, vz2 = 0;
    for (const double v : at.vx) vx2 += v * v / static_cast<double>(at.vx.size());
    for (const double v : at.vz) vz2 += v * v / static_cast<double>(at.vz.size());
    x.push_back(vx2), z.push_back(vz2);
  });
  Measured measured;
  measured.truth = run.temperature;
  measured.input.profile = without_empty_top(average_frames(frames).profile);
  measured.input.kernel = {KernelKind::gaussian, 0.5};
  measured.input.column_number = what.bed.column().column_number;
  const statistics::Mean kinetic_x = statistics::mean_of(x), kinetic_z = statistics::mean_of(z);
  measured.input.temperature_x = Estimate{kinetic_x.value, kinetic_x.std_error, false};
  measured.input.temperature_z = Estimate{kinetic_z.value, kinetic_z.std_error, false};
  return measured;
}

struct ShakenBed {
  std::uint32_t count = 0;
  double width = 0;  // [D], hard sides
  double restitution = 1, friction = 0;
  double gamma = 0, frequency = 0;  // frequency in sqrt(g/D)
  std::uint64_t seed = 1;
};

// 108 beds of 5 to 15 rows.
inline std::vector<ShakenBed> shaken_beds() {
  std::vector<ShakenBed> beds;
  for (const double restitution : {0.7, 0.85, 0.95})
    for (const double friction : {0.0, 0.15})
      for (const double gamma : {2.5, 3.0, 3.5, 4.2, 5.0, 8.0})
        for (const std::uint32_t count : {130U, 260U, 390U})
          beds.push_back({count, 26.6, restitution, friction, gamma, 0.38, 3000 + beds.size()});
  return beds;
}

inline Measured measure(const ShakenBed& what) {
  constexpr int settle = 150, periods = 150;
  constexpr std::uint32_t phases = 16;
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{what.count, 1, 1}};
  scene.disks.contact = {what.restitution, what.friction, 0};
  scene.disks.inertia_ratio = 0.4;
  scene.disks.contact_duration = 1e-4;
  scene.box.width = what.width;
  scene.box.sides = sim::HardSides{{what.restitution, 0, 0}};
  scene.box.floor_surface = {what.restitution, what.friction, 0};
  const double omega = 2 * std::numbers::pi * what.frequency;
  scene.box.floor = sim::SinusoidalFloor{what.gamma / (omega * omega), what.frequency};
  scene.start_temperature = 0.1;
  scene.seed = what.seed;
  const auto simulation = sim::simulate(scene);
  const double column = what.count / what.width;
  const HeightGrid grid{-6, 0.25, static_cast<std::size_t>((4 * column + 66) / 0.25)};
  sim::BedObserver observer(scene, simulation->properties(), phases, grid, {KernelKind::gaussian, 0.5});
  sim::Snapshot at;
  for (int period = 0; period < periods; ++period) {
    for (std::uint32_t phase = 0; phase < phases; ++phase) {
      simulation->advance_to((settle + period + static_cast<double>(phase) / phases) / what.frequency);
      simulation->snapshot(at);
      observer.observe(at, phase);
    }
  }
  const sim::Profile density = observer.density(false);
  Profile profile{density.height, density.number_density, density.std_error,
                  observer.density_covariance(0, density.height.size()),
                  static_cast<int>(observer.covariance_blocks())};
  Measured measured;
  measured.input.profile = without_empty_top(profile);
  measured.input.kernel = {KernelKind::gaussian, 0.5};
  measured.input.column_number = column;
  const sim::Measured x = observer.temperature_x(), z = observer.temperature_z();
  measured.input.temperature_x = Estimate{x.value, x.std_error, false};
  measured.input.temperature_z = Estimate{z.value, z.std_error, false};
  return measured;
}

}  // namespace shakebed::fit::simulated
