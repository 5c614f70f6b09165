#include "ingest/profile/velocities.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "ingest/synthetic/random_stream.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/measure/flow_free.hpp"
#include "tests/ingest/shaken_bed.hpp"

namespace shakebed::ingest {
namespace {

// Disks on a wide lattice whose velocities are an Ornstein-Uhlenbeck process of variance T/m per component around a
// steady shear flow, seen with a localisation error: T is known exactly.
Measurement walkers(std::size_t frames, double dt, double speed, double memory_s, double error_px, double flow,
                    std::uint64_t seed, int substeps = 10) {
  Measurement measurement;
  measurement.calibration.scale_m_per_px = 1e-4;
  measurement.calibration.radius_px = 10;  // D = 2 mm
  RandomStream random(seed);
  constexpr int across = 20, up = 15;
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
  // 0.6 of the correction, 1 - 1/1.11 for dt/tau = 1/3, and 2 % of statistics.
  EXPECT_LT(measured.horizontal.std_error_m, 0.08 * expected);
}

// Forty films of walkers: their temperatures of displacements scatter by what each states.
TEST(Velocities, OfDisplacementsHaveTheErrorOfTheirFrames) {
  constexpr int films = 40;
  double sum = 0, squares = 0, stated = 0;
  for (std::uint64_t film = 0; film < films; ++film) {
    const VelocityMeasurement found =
        measure_velocities(walkers(60, 1.0 / 500, 0.06, 0.006, 0.1, 0.03, 100 + film, 4), {.frame_rate_hz = 500});
    for (const KineticTemperature* t : {&found.horizontal, &found.vertical}) {
      sum += t->displacement_m, squares += t->displacement_m * t->displacement_m;
      stated += t->displacement_error_m * t->displacement_error_m;
    }
  }
  const double n = 2 * films, mean = sum / n, scatter = std::sqrt(squares / n - mean * mean);
  // Memory of three frames: displacements have 2 (x - 1 + exp(-x))/x^2 of the square, x = 1/3.
  EXPECT_NEAR(mean / (0.06 * 0.06 / 9.81), 18 * (1.0 / 3 - 1 + std::exp(-1.0 / 3)), 0.015);
  EXPECT_NEAR(std::sqrt(stated / n) / scatter, 1, 0.3);  // 8 % of the scatter, 10 % of what is stated
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

// A simulated bed filmed at `rate` (reduced units) with a localisation error of 0.003 D, and its temperatures from the
// velocities that the simulation knows: both less the flow of each bin of height, one D high.
struct FilmedBed {
  VelocityMeasurement found;
  double true_x = 0, true_z = 0;
  double moved_x = 0, moved_z = 0;  // of displacements from frame to frame
};

class BedFilm {
 public:
  BedFilm(double rate, const sim::Scene& scene, const sim::DiskProperties& disks)
      : meter_(1, {.frame_rate_hz = rate, .gravity_m_per_s2 = 1}), moved_(scene, disks, 1) {}

  void add(const sim::Snapshot& now) {
    std::vector<MeasuredDisk> disks;
    std::map<long, std::vector<std::size_t>> bins;
    for (std::size_t i = 0; i < now.x.size(); ++i) {
      MeasuredDisk disk;
      disk.x = now.x[i] + 0.003 * random_.normal();
      disk.z = now.z[i] + 0.003 * random_.normal();
      disk.radius_px = 10;
      disk.std_error_px = 0.06;
      disks.push_back(disk);
      bins[static_cast<long>(std::floor(now.z[i]))].push_back(i);
    }
    meter_.add(disks);
    moved_.observe(now, 0);
    for (const auto& [bin, members] : bins)
      if (members.size() >= 3) square_less_mean(now, members);
  }

  FilmedBed result() { return {meter_.result(), x_ / count_, z_ / count_, moved_.x().value, moved_.z().value}; }

 private:
  void square_less_mean(const sim::Snapshot& now, const std::vector<std::size_t>& members) {
    const double n = static_cast<double>(members.size());
    double mean_x = 0, mean_z = 0;
    for (const std::size_t i : members) mean_x += now.vx[i] / n, mean_z += now.vz[i] / n;
    for (const std::size_t i : members) {
      x_ += n / (n - 1) * std::pow(now.vx[i] - mean_x, 2);
      z_ += n / (n - 1) * std::pow(now.vz[i] - mean_z, 2);
      count_ += 1;
    }
  }

  VelocityMeter meter_;
  sim::FlowFreeDisplacement moved_;
  RandomStream random_{17};
  double x_ = 0, z_ = 0, count_ = 0;
};

// Four films of one bed at once, each with frames so many a unit of time. The bed does not depend on when one looks.
constexpr std::array<double, 4> rates{50.0, 10.0, 5.0, 2.8};  // 3,500 to 196 pictures a second of disks of 2 mm
std::array<FilmedBed, 4> filmed(const sim::Scene& scene) {
  constexpr int frames = 400;
  std::vector<std::pair<double, std::size_t>> looks;  // the time, and of which film
  for (std::size_t film = 0; film < rates.size(); ++film)
    for (int frame = 0; frame < frames; ++frame) looks.emplace_back(80 + frame / rates[film], film);
  std::sort(looks.begin(), looks.end());
  const auto bed = sim::simulate(scene);
  std::vector<BedFilm> films;
  for (const double rate : rates) films.emplace_back(rate, scene, bed->properties());
  sim::Snapshot now;
  for (const auto& [time, film] : looks) {
    bed->advance_to(time);
    bed->snapshot(now);
    films[film].add(now);
  }
  return {films[0].result(), films[1].result(), films[2].result(), films[3].result()};
}

sim::Scene bed_in_bath(double temperature) {
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{.count = 260}};
  scene.box.width = 12.4;
  scene.box.sides = sim::PeriodicSides{};
  scene.bath = sim::LangevinBath{.temperature = temperature, .rate = 0.02, .interval = 0.5};
  scene.start_temperature = temperature;
  scene.seed = 91;
  return scene;
}

// Beds that collide many times between frames and hardly at all. Where a temperature is given, its error holds what is
// wrong with it: 2.5 of them, of which the film's statistics are the smaller part. With the correction of all steps
// together T of the shaken beds was up to 35 % low with a stated error of 9 %.
TEST(Velocities, OfDenseBedsAreGivenOnlyWhereTheirErrorHoldsTheTruth) {
  const std::map<std::string, sim::Scene> beds{
      {"in equilibrium, dense", bed_in_bath(0.6)},
      {"in equilibrium", bed_in_bath(2.2)},
      {"shaken, smooth", shaken_bed({.gamma = 3.5, .restitution = 0.88})},
      {"shaken, rough", shaken_bed({.gamma = 4.2, .restitution = 0.75, .friction = 0.2})}};
  int given = 0;
  for (const auto& [name, scene] : beds) {
    const std::array<FilmedBed, 4> films = filmed(scene);
    for (std::size_t k = 0; k < rates.size(); ++k) {
      const double rate = rates[k];
      const FilmedBed& film = films[k];
      const KineticTemperature &x = film.found.horizontal, &z = film.found.vertical;
      std::printf(
          "%s, %g frames a unit of time: T_x %.3f(%.3f) of the true, T_z %.3f(%.3f), of displacements %.3f %.3f, steps "
          "of %.3f, "
          "factors %.2f %.2f%s\n",
          name.c_str(), rate, x.over_mg_m / film.true_x, x.std_error_m / film.true_x, z.over_mg_m / film.true_z,
          z.std_error_m / film.true_z, x.displacement_m / film.moved_x, z.displacement_m / film.moved_z,
          film.found.mean_step, x.finite_time_factor, z.finite_time_factor, film.found.usable() ? "" : ", not given");
      if (rate == 50) {
        EXPECT_TRUE(film.found.usable());
        EXPECT_NEAR(x.over_mg_m / film.true_x, 1, 0.1);
        EXPECT_NEAR(z.over_mg_m / film.true_z, 1, 0.1);
      }
      if (!film.found.usable()) {
        EXPECT_FALSE(film.found.warnings.empty());
        continue;
      }
      ++given;
      EXPECT_NEAR(x.over_mg_m, film.true_x, 2.5 * x.std_error_m);
      EXPECT_NEAR(z.over_mg_m, film.true_z, 2.5 * z.std_error_m);
      EXPECT_LT(x.std_error_m, 0.5 * x.over_mg_m);
      // Displacements need no correction. Where they are long, the fastest disks are lost.
      const double lost = film.found.mean_step < 0.1 ? 0.03 : 0.1;
      EXPECT_NEAR(x.displacement_m / film.moved_x, 1, lost);
      EXPECT_NEAR(z.displacement_m / film.moved_z, 1, lost);
    }
  }
  EXPECT_GE(given, 8);
  EXPECT_LE(given, 14);  // at 2.8 none of the dense ones
}

// Of a velocity that forgets within a time, steps of x such times have a share of its mean square, and two of them that
// follow one another are correlated.
double kept_of_square(double x) { return 2 * (x - 1 + std::exp(-x)) / (x * x); }
double correlation_after(double x) { return std::pow(1 - std::exp(-x), 2) / (2 * (x - 1 + std::exp(-x))); }

// Fours of disks in three frames, `fours` of them at one height. They step by a times (1, 1, -1, -1), then by c times
// that and sqrt(1 - c^2) times (1, -1, 1, -1): steps of one size, of mean 0 and of correlation c.
void add_fours(Measurement& film, std::size_t fours, double z, double a, double c_x, double c_z) {
  constexpr std::array<double, 4> first = {1, 1, -1, -1}, across = {1, -1, 1, -1};
  for (std::size_t k = 0; k < 4 * fours; ++k) {
    const double one = a * first[k % 4], other = a * across[k % 4];
    const std::array<double, 3> x = {0, one, one + c_x * one + std::sqrt(1 - c_x * c_x) * other},
                                up = {0, one, one + c_z * one + std::sqrt(1 - c_z * c_z) * other};
    for (std::size_t frame = 0; frame < 3; ++frame) {
      MeasuredDisk disk;
      disk.frame = frame, disk.x = 3.0 * static_cast<double>(k) + x[frame], disk.z = z + up[frame];
      film.disks.push_back(disk);
    }
  }
}
Measurement film_of_steps() {
  Measurement film;
  film.calibration.radius_px = 10, film.calibration.scale_m_per_px = 1e-4;  // D = 2 mm
  return film;
}
void in_order_of_frames(Measurement& film) {
  std::stable_sort(film.disks.begin(), film.disks.end(),
                   [](const MeasuredDisk& one, const MeasuredDisk& other) { return one.frame < other.frame; });
}

// Steps of 0.1 D, whose correlation says that the frames are 0.8 memories apart along x and 0.3 along z.
TEST(Velocities, AreCorrectedByTheCorrelationOfTheirSteps) {
  Measurement film = film_of_steps();
  add_fours(film, 8, 4.5, 0.1, correlation_after(0.8), correlation_after(0.3));
  in_order_of_frames(film);
  const VelocityMeasurement found = measure_velocities(film, {.frame_rate_hz = 100});
  EXPECT_EQ(found.links, 64U);
  const double square = 32.0 / 31 * 0.01 * 4e-6 * 1e4 / 9.81;  // a degree of freedom is that of the flow
  const auto expect = [&](const KineticTemperature& t, double x) {
    EXPECT_NEAR(t.displacement_m / square, 1, 1e-9);
    EXPECT_NEAR(t.finite_time_factor, 1 / kept_of_square(x), 1e-6);
    EXPECT_NEAR(t.over_mg_m / (square / kept_of_square(x)), 1, 1e-6);
    EXPECT_NEAR(t.finite_time_error, 0.6 * (1 - kept_of_square(x)), 1e-6);
    EXPECT_NEAR(t.displacement_error_m / square, 0, 1e-9) << "both pairs of frames have the same";
    EXPECT_NEAR(t.std_error_m / (t.finite_time_error * t.over_mg_m), 1, 1e-9);
  };
  expect(found.horizontal, 0.8);
  expect(found.vertical, 0.3);
  ASSERT_EQ(found.warnings.size(), 1U);
  EXPECT_NE(found.warnings[0].find("is corrected by a factor of 1.28."), std::string::npos) << found.warnings[0];
  // Errors of the centres of 0.4 px, 0.02 D: they add twice their variance to the squares, and take it from the
  // products.
  for (MeasuredDisk& disk : film.disks) disk.std_error_px = 0.4;
  const VelocityMeasurement noisy = measure_velocities(film, {.frame_rate_hz = 100});
  const double noise = 2 * 0.0004, moved = 32.0 / 31 * 0.01 - noise;
  const double correlation = (32.0 / 31 * 0.01 * correlation_after(0.8) + 0.5 * noise) / moved;
  double low = 1e-3, high = 5;
  for (int round = 0; round < 60; ++round) {
    const double x = 0.5 * (low + high);
    (correlation_after(x) > correlation ? low : high) = x;
  }
  EXPECT_NEAR(noisy.horizontal.displacement_m / (moved * 4e-6 * 1e4 / 9.81), 1, 1e-9);
  EXPECT_NEAR(noisy.horizontal.finite_time_factor, 1 / kept_of_square(low), 1e-6);
  // Of 28 steps that are followed by another nothing is said.
  Measurement few = film_of_steps();
  add_fours(few, 7, 4.5, 0.1, 0.5, 0.5);
  in_order_of_frames(few);
  EXPECT_EQ(measure_velocities(few, {.frame_rate_hz = 100}).horizontal.finite_time_factor, 1);
}

// A long film is measured in stretches, here of three frames. Two stretches of the same steps scatter by nothing: the
// error is that of the correction alone.
TEST(Velocities, OfALongFilmHaveTheErrorOfTheirCorrection) {
  Measurement film = film_of_steps();
  add_fours(film, 8, 4.5, 0.1, correlation_after(0.8), correlation_after(0.3));
  in_order_of_frames(film);
  const std::size_t count = film.disks.size() / 3;
  const auto frame = [&](std::size_t which) {
    std::vector<MeasuredDisk> disks;
    for (std::size_t k = 0; k < count; ++k) {
      MeasuredDisk disk = film.disks[which % 2 * count + k];
      const MeasuredDisk &start = film.disks[k], &end = film.disks[2 * count + k];
      const double times = static_cast<double>(which / 2);  // the same steps again, from where they ended
      disk.radius_px = 10;
      disk.x += times * (end.x - start.x), disk.z += times * (end.z - start.z);
      disks.push_back(disk);
    }
    return disks;
  };
  VelocityMeter meter(2e-3, {.frame_rate_hz = 100}, 3);
  for (std::size_t which = 0; which < 5; ++which) meter.add(frame(which));
  const VelocityMeasurement all = meter.result(), one = measure_velocities(film, {.frame_rate_hz = 100});
  EXPECT_EQ(all.links, 2 * one.links);
  for (const auto component : {&VelocityMeasurement::horizontal, &VelocityMeasurement::vertical}) {
    const KineticTemperature &whole = all.*component, &part = one.*component;
    EXPECT_NEAR(whole.over_mg_m / part.over_mg_m, 1, 1e-9);
    EXPECT_GT(part.finite_time_error, 0.05);
    EXPECT_NEAR(whole.std_error_m / (part.finite_time_error * part.over_mg_m), 1, 1e-9);
  }
}

// Two heights of different correlations: each has its own correction as far as the two differ by more than chance, and
// what that changes is a part of the error.
TEST(Velocities, OfEachHeightHaveTheirOwnCorrection) {
  Measurement film = film_of_steps();
  const std::array<double, 2> c = {correlation_after(0.2), correlation_after(1.6)}, a = {0.05, 0.1}, n = {80, 48};
  for (std::size_t k = 0; k < 2; ++k)
    add_fours(film, static_cast<std::size_t>(n[k] / 4), k == 0 ? 2.5 : 12.5, a[k], c[k], c[k]);
  in_order_of_frames(film);
  const VelocityMeasurement found = measure_velocities(film, {.frame_rate_hz = 100});
  const auto factor = [](double correlation) {
    double low = 1e-4, high = 50;
    for (int round = 0; round < 80; ++round) {
      const double x = 0.5 * (low + high);
      (correlation_after(x) > correlation ? low : high) = x;
    }
    return 1 / kept_of_square(low);
  };
  // Squares of a step, with the degree of freedom; two pairs of frames, of which the second follows the first.
  double squares = 0, products = 0, steps = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    const double square = n[k] * a[k] * a[k] * n[k] / (n[k] - 1);
    squares += 2 * square, products += square * c[k], steps += n[k];
  }
  const double of_all = products / steps / (squares / (2 * steps));
  // A correlation of n pairs is uncertain by 1/sqrt(n); each height is there in two pairs of frames.
  double excess = 0, precision = 0;
  for (std::size_t k = 0; k < 2; ++k) excess += 2 * (n[k] * std::pow(c[k] - of_all, 2) - 1), precision += 2 * n[k];
  const double scatter = excess / precision;
  ASSERT_GT(scatter, 0);
  double corrected = 0;
  for (std::size_t k = 0; k < 2; ++k)
    corrected +=
        2 * n[k] * a[k] * a[k] * n[k] / (n[k] - 1) * factor(of_all + (c[k] - of_all) * scatter / (scatter + 1 / n[k]));
  const double by_heights = corrected / squares;
  for (const KineticTemperature* t : {&found.horizontal, &found.vertical}) {
    EXPECT_NEAR(t->finite_time_factor, by_heights, 1e-6);
    EXPECT_NEAR(t->finite_time_error, std::hypot(1 - factor(of_all) / by_heights, 0.6 * (1 - 1 / by_heights)), 1e-6);
  }
}

// Pictures so far apart that the correction is above 2 give no temperature, and say so.
TEST(Velocities, AreRefusedBeyondTwiceTheirSquare) {
  for (const double x : {2.5, 2.6}) {  // factors of 1.975 and 2.019
    Measurement film = film_of_steps();
    add_fours(film, 10, 4.5, 0.1, correlation_after(x), correlation_after(0.1));
    in_order_of_frames(film);
    const VelocityMeasurement found = measure_velocities(film, {.frame_rate_hz = 100});
    EXPECT_EQ(found.usable(), x == 2.5) << found.horizontal.finite_time_factor;
    ASSERT_EQ(found.warnings.size(), 1U);
    EXPECT_NE(found.warnings[0].find(x == 2.5 ? "is corrected by a factor of 1.98."
                                              : "have to be corrected by a factor of 2."),
              std::string::npos)
        << found.warnings[0];
  }
}

}  // namespace
}  // namespace shakebed::ingest
