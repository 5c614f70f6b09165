#include "ingest/profile/velocities.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "ingest/synthetic/random_stream.hpp"

namespace shakebed::ingest {
namespace {

// Disks on a wide lattice whose velocities are an Ornstein-Uhlenbeck process of variance T/m per component around a
// steady shear flow, seen with a localisation error: T is known exactly.
Measurement walkers(std::size_t frames, double dt, double speed, double memory_s, double error_px, double flow,
                    std::uint64_t seed) {
  Measurement measurement;
  measurement.calibration.scale_m_per_px = 1e-4;
  measurement.calibration.radius_px = 10;  // D = 2 mm
  RandomStream random(seed);
  constexpr int across = 20, up = 15, substeps = 50;
  struct Walker {
    double x, z, vx, vz;
  };
  std::vector<Walker> walkers;
  for (int i = 0; i < across; ++i)
    for (int j = 0; j < up; ++j)
      walkers.push_back({3.0 * i, 3.0 * j + 0.5, speed * random.normal(), speed * random.normal()});
  const double h = dt / substeps, keep = std::exp(-h / memory_s), kick = speed * std::sqrt(1 - keep * keep);
  for (std::size_t frame = 0; frame < frames; ++frame) {
    measurement.frames.push_back({});
    for (Walker& walker : walkers) {
      MeasuredDisk disk;
      disk.frame = frame;
      disk.x = walker.x + error_px / 20 * random.normal();
      disk.z = walker.z + error_px / 20 * random.normal();
      disk.std_error_px = error_px;
      measurement.disks.push_back(disk);
      for (int k = 0; k < substeps; ++k) {
        walker.x += h * (walker.vx + flow) / 2e-3;
        walker.z += h * walker.vz / 2e-3;
        walker.vx = keep * walker.vx + kick * random.normal();
        walker.vz = keep * walker.vz + kick * random.normal();
      }
    }
  }
  return measurement;
}

TEST(Velocities, TemperatureOfKnownWalkersWithFlowErrorAndMemory) {
  const double speed = 0.06, dt = 1.0 / 500;
  const Measurement measurement = walkers(200, dt, speed, 0.006, 0.1, 0.03, 3);
  VelocityOptions options;
  options.frame_rate_hz = 500;
  const VelocityMeasurement measured = measure_velocities(measurement, options);
  const double expected = speed * speed / 9.81;
  EXPECT_GT(measured.linked_share, 0.98);
  // 300 disks x 60 frames with a memory of 3 frames: some 5,000 independent squares, 2 % each; limits at 5 % + bias 2
  // %.
  EXPECT_NEAR(measured.horizontal.over_mg_m / expected, 1, 0.07);
  EXPECT_NEAR(measured.vertical.over_mg_m / expected, 1, 0.07);
  EXPECT_GT(measured.horizontal.finite_time_factor, 1.05);
  EXPECT_LT(measured.horizontal.std_error_m, 0.05 * expected);
}

TEST(Velocities, RestingDisksHaveNoTemperatureBeyondTheirError) {
  const Measurement measurement = walkers(40, 1.0 / 500, 0, 1, 0.2, 0, 4);
  VelocityOptions options;
  options.frame_rate_hz = 500;
  const VelocityMeasurement measured = measure_velocities(measurement, options);
  EXPECT_GT(measured.horizontal.localisation_bias_m, 0);
  // 12,000 squared differences, neighbours in time anticorrelated: 2 % scatter, five times that allowed.
  EXPECT_LT(measured.horizontal.over_mg_m, 0.1 * measured.horizontal.localisation_bias_m);
}

TEST(Velocities, FramesTooFarApartAreToldSo) {
  const Measurement measurement = walkers(20, 1.0 / 20, 0.06, 0.05, 0.1, 0, 5);
  VelocityOptions options;
  options.frame_rate_hz = 20;
  EXPECT_FALSE(measure_velocities(measurement, options).warnings.empty());
  EXPECT_THROW(measure_velocities(measurement, {}), std::invalid_argument);
}

}  // namespace
}  // namespace shakebed::ingest
