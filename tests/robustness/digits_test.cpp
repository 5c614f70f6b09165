// How many digits the kernels keep, by shadow runs in 60-digit arithmetic on the same doubles: event times, floor
// roots, f and its inverse, k, covariance. Prints the table that `shakebed bench` shows
// (tests/bench/program/digits.json), and checks that what is shown there is not better than what is found here.
//
// A number's conditioning is taken off where it is the input's and not the algorithm's: each row says what its error is
// relative to.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "fit/map/jump_height.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/expansion.hpp"
#include "sim/engine/contact_time.hpp"
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/random.hpp"
#include "sim/measure/statistics.hpp"

namespace {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<60>, boost::multiprecision::et_off>;
using namespace shakebed;

double digits_of(const Real& error) {
  if (error == 0) return 17;
  return std::min(17.0, -static_cast<double>(log10(abs(error))));
}

struct Row {
  Row(std::string of, std::string from, std::string to)
      : kernel(std::move(of)), inputs(std::move(from)), relative_to(std::move(to)) {}
  std::string kernel, inputs, relative_to, worst_case;
  double worst = 17, median = 17;
  std::vector<double> all;

  void add(const Real& error, const std::function<std::string()>& where) {
    const double digits = digits_of(error);
    all.push_back(digits);
    if (digits < worst) worst = digits, worst_case = where();
  }
  void finish() {
    std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
    median = all[all.size() / 2];
  }
};

template <class... Parts>
std::string text(const char* format, Parts... parts) {
  char out[200];
  std::snprintf(out, sizeof out, format, parts...);
  return out;
}

constexpr int count = 20'000;

// Two disks: the error of the time, of the time that a change of the positions by one rounding makes: the residual gap
// at the time returned, relative to the distance between the disks.
Row disk_contact(double farthest) {
  Row row{text("time to a disk, up to %g D away", farthest), "random pairs, grazing ones too", "the distance"};
  sim::Random random(1);
  for (int i = 0; i < count; ++i) {
    const double distance = 1 + std::pow(10, -12 + (12 + std::log10(farthest)) * random.uniform()),
                 angle = 2 * std::numbers::pi * random.uniform();
    const double dx = distance * std::cos(angle), dz = distance * std::sin(angle);
    // Aimed so that it hits at an offset up to the edge.
    const double offset = i % 2 == 0 ? 2 * random.uniform() - 1 : 1 - std::pow(10, -14 * random.uniform());
    const double sine = std::min(1.0, std::abs(offset)) / distance, speed = std::pow(10, 6 * random.uniform() - 3);
    const double aim = angle + std::numbers::pi + std::asin(sine);
    const double dvx = speed * std::cos(aim), dvz = speed * std::sin(aim);
    const double t = sim::time_to_disk(dx, dz, dvx, dvz, 1);
    if (!(t < sim::never)) continue;
    const Real x = Real(dx) + Real(dvx) * t, z = Real(dz) + Real(dvz) * t;
    const Real gap = sqrt(x * x + z * z) - 1;
    row.add(gap / distance,
            [&] { return text("distance %.3g, offset 1 - %.1e, speed %.1e", distance, 1 - offset, speed); });
  }
  row.finish();
  return row;
}

Row lid_contact() {
  Row row{"time to a lid", "gaps 1e-9 to 1e3, just reached too", "the time, conditioning taken off"};
  sim::Random random(2);
  for (int i = 0; i < count; ++i) {
    const double gap = std::pow(10, 12 * random.uniform() - 9);
    const double v = std::sqrt(2 * gap) * (1 + std::pow(10, 1 - 15 * random.uniform()));
    const double t = sim::time_to_lid(gap, v, 1);
    if (!(t < sim::never)) continue;
    const Real residual = Real(gap) - (Real(v) - Real(t) / 2) * t;
    row.add(residual / Real(gap), [&] { return text("gap %.3g, v^2/2g - gap = %.1e gap", gap, v * v / 2 / gap - 1); });
  }
  row.finish();
  row.relative_to = "the gap";
  return row;
}

Row floor_contact() {
  Row row{"time to the shaken floor", "Gamma 0.1 to 30, f 0.1 to 3, random flights", "the largest term of the gap"};
  sim::Random random(3);
  const Real two_pi = 2 * acos(Real(-1));
  for (int i = 0; i < count / 4; ++i) {
    const double f = 0.1 * std::pow(30, random.uniform()), gamma = 0.1 * std::pow(300, random.uniform()),
                 w = 2 * std::numbers::pi * f;
    const sim::SinusoidalFloor floor{gamma / (w * w), f};
    const sim::FloorMotion motion(floor);
    const double now = random.uniform() / f, bottom = motion.position(now) + 2 * floor.amplitude * random.uniform(),
                 vz = floor.amplitude * w * random.normal_pair().first;
    const double t = motion.time_to_contact(bottom, vz, 1, now, sim::never);
    const Real gap =
        Real(bottom) + (Real(vz) - Real(t) / 2) * t - Real(floor.amplitude) * sin(two_pi * f * (Real(now) + t));
    const double terms = std::max({std::abs(bottom), std::abs(vz * t), 0.5 * t * t, floor.amplitude});
    row.add(gap / terms, [&] { return text("Gamma %.3g, f %.3g", gamma, f); });
  }
  row.finish();
  return row;
}

// Enskog in the paper's own terms, from its printed rational constants.
Real enskog_f(const Real& phi) {
  const Real pi = acos(Real(-1)), a = Real("0.489351") * pi / 2, a1 = Real("0.196703") * pi / 2,
             a2 = Real("0.006519") * pi * pi / 4;
  const Real c1 = pi * a2 / (a * a), c2 = -(pi / 2) * (a1 - 2 * a2 / a) / (a * a), c3 = -c2,
             c4 = (pi / 2) * (1 - a1 / a + a2 / (a * a)) / a;
  const Real u = 1 - a * phi;
  return log(phi) + c1 * phi + c2 * log(u) + c3 / u + c4 / (u * u);
}
Real enskog_z(const Real& phi) {
  const Real pi = acos(Real(-1)), a = Real("0.489351") * pi / 2, a1 = Real("0.196703") * pi / 2,
             a2 = Real("0.006519") * pi * pi / 4;
  const Real u = 1 - a * phi;
  return 1 + pi / 2 * phi * (1 - a1 * phi + a2 * phi * phi) / (u * u);
}
double density_at(int i) {
  return fit::close_packing_density * std::pow(10, -12 * std::pow(std::fmod(0.6180339887498949 * i, 1.0), 2));
}

Row f_of_density() {
  Row row{"f of the density (Enskog)", "phi from 1e-12 to 2/sqrt 3", "the larger of |f| and 1"};
  for (int i = 0; i < count / 10; ++i) {
    const double phi = density_at(i), f = fit::enskog().f(phi).value;
    const Real truth = enskog_f(phi);
    row.add((f - truth) / std::max(1.0, std::abs(f)), [&] { return text("phi = %.6g", phi); });
  }
  row.finish();
  return row;
}

Row density_of_f() {
  Row row{"density from f (Enskog)", "f of phi from 1e-12 to 2/sqrt 3, rounded", "phi"};
  for (int i = 0; i < count / 10; ++i) {
    const double f = static_cast<double>(enskog_f(density_at(i)));
    const double phi = fit::enskog().density_from_f(f).value;
    // One step of Newton from phi in 60 digits leaves the true inverse of this f to 30 digits.
    const Real at = phi, h = Real("1e-25") * at, slope = (enskog_f(at + h) - enskog_f(at - h)) / (2 * h);
    row.add((enskog_f(at) - f) / slope / at, [&] { return text("phi = %.6g", phi); });
  }
  row.finish();
  return row;
}

// k = integral of (Z/Z_0)^2, by Gauss-Legendre of 60 points on 8 pieces (Z is smooth: far beyond 20 digits).
Row expansion_k() {
  Row row{"k (Enskog)", "phi_0 from 1e-12 to 2/sqrt 3", "k"};
  constexpr int order = 40;
  std::vector<std::pair<Real, Real>> nodes;
  for (int i = 1; i <= order; ++i) {
    Real x = cos(acos(Real(-1)) * (Real(i) - Real("0.25")) / (order + Real("0.5"))), derivative = 0;
    for (int step = 0; step < 12; ++step) {
      Real p0 = 1, p1 = x;
      for (int n = 2; n <= order; ++n) {
        const Real p2 = ((2 * n - 1) * x * p1 - (n - 1) * p0) / n;
        p0 = p1, p1 = p2;
      }
      derivative = order * (x * p1 - p0) / (x * x - 1);
      x -= p1 / derivative;
    }
    nodes.emplace_back(x, 2 / ((1 - x * x) * derivative * derivative));
  }
  for (int i = 0; i < 60; ++i) {
    const double phi = density_at(i), k = fit::expansion_constants(fit::enskog(), phi).k;
    constexpr int pieces = 8;
    Real sum = 0;
    const Real width = Real(phi) / pieces, top = enskog_z(phi);
    for (int piece = 0; piece < pieces; ++piece) {
      for (const auto& [x, weight] : nodes) {
        const Real z = enskog_z((piece + (1 + x) / 2) * width) / top;
        sum += weight / 2 * width * z * z;
      }
    }
    row.add(k / (sum / phi) - 1, [&] { return text("phi_0 = %.6g", phi); });
  }
  row.finish();
  return row;
}

// A covariance of means with a large common offset, as densities and heights have them.
Row covariance() {
  Row row{"covariance of block means", "3 quantities, 500 samples, offsets 1 to 1e6 of the scatter", "the variances"};
  sim::Random random(6);
  for (int trial = 0; trial < 60; ++trial) {
    const double offset = std::pow(10, 6 * random.uniform());
    sim::CorrelatedMeans found(3);
    std::vector<std::array<double, 3>> samples;
    for (int i = 0; i < 500; ++i) {
      const auto pair = random.normal_pair();
      samples.push_back({offset + pair.first, offset + 0.5 * pair.first + pair.second, offset - pair.second});
      found.add(samples.back());
    }
    const std::vector<double> matrix = found.covariance(0, 3, found.windows(0, 3));
    // What covariance() says it does: means over overlapping windows, larger by what the halves of the windows say of
    // the first moment.
    const std::size_t n = samples.size(), window = found.windows(0, 3).length;
    std::array<Real, 3> mean{};
    for (const auto& sample : samples) {
      for (std::size_t k = 0; k < 3; ++k) mean[k] += Real(sample[k]) / n;
    }
    const auto of_windows = [&](std::size_t length) {
      std::array<std::array<Real, 3>, 4> result{};  // the last row: of the first moment, in its first column
      for (std::size_t b = 0; b + length <= n; ++b) {
        std::array<Real, 3> sum{};
        for (std::size_t i = b; i < b + length; ++i) {
          for (std::size_t k = 0; k < 3; ++k) sum[k] += samples[i][k] - mean[k];
        }
        for (std::size_t i = 0; i < 3; ++i) {
          for (std::size_t k = 0; k < 3; ++k) result[i][k] += sum[i] * sum[k];
        }
        result[3][0] += (sum[1] + 2 * sum[2]) * (sum[1] + 2 * sum[2]);
      }
      for (auto& r : result) {
        for (Real& value : r) value /= Real(length) * (n - length) * (n - length + 1);
      }
      return result;
    };
    const auto whole = of_windows(window), halves = of_windows(window / 2);
    const Real correction = 2 - halves[3][0] / whole[3][0], factor = correction > 1 ? correction : Real(1);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t k = 0; k < 3; ++k) {
        row.add((matrix[i * 3 + k] - factor * whole[i][k]) / (factor * sqrt(whole[i][i] * whole[k][k])),
                [&] { return text("offset %.3g", offset); });
      }
    }
  }
  row.finish();
  return row;
}

// The greatest gap of a dead ball's first jump on a sine, s^2 = Gamma^2 - 1: s (t - sin t) - (t^2/2 - 1 + cos t), below
// Gamma = 3 at its one greatest value before t = 2 pi.
Real greatest_gap(double gamma) {
  const Real s = sqrt((Real(gamma) - 1) * (Real(gamma) + 1));
  Real low = 0, high = 2 * acos(Real(-1)), t = s;
  if (3 * s < high) high = 3 * s;
  low = 2 * atan(s);
  for (int step = 0; step < 220; ++step) {
    t = (low + high) / 2;
    (s * (1 - cos(t)) > t - sin(t) ? low : high) = t;
  }
  return s * (t - sin(t)) - (t * t / 2 - 1 + cos(t));
}

Row jump_height() {
  Row row{"height of a dead ball's jump", "Gamma - 1 from 1e-12 to 2, each of the four heights", "the height"};
  for (int i = 0; i < 500; ++i) {
    const double gamma = 1 + std::pow(10, -12 + (12 + std::log10(2)) * i / 499.0);
    const Real excess = Real(gamma) - 1;
    const Real exact[] = {greatest_gap(gamma), excess * (Real(gamma) + 1) / 2, (Real(gamma) * gamma + 1) / 2,
                          excess * excess / 2};
    for (std::size_t k = 0; k < fit::jump_heights.size(); ++k) {
      const double height = fit::jump_height(fit::jump_heights[k], gamma).value;
      row.add(height / exact[k] - 1, [&] {
        return text("%s, Gamma - 1 = %.3g", std::string(to_string(fit::jump_heights[k])).c_str(), gamma - 1);
      });
    }
  }
  row.finish();
  return row;
}

// Found once for all tests of a run.
const std::vector<Row>& rows_of_kernels() {
  static const std::vector<Row> rows = {disk_contact(10), disk_contact(1e6), lid_contact(),
                                        floor_contact(),  f_of_density(),    density_of_f(),
                                        expansion_k(),    covariance(),      jump_height()};
  return rows;
}

TEST(DigitsKept, AreWhatTheBenchmarkShows) {
  const std::vector<Row>& rows = rows_of_kernels();
  nlohmann::ordered_json found;
  found["note"] =
      "shadow runs in 60-digit arithmetic on the same doubles; 15.95 digits are half a unit in the last place; "
      "tests/robustness/digits_test.cpp finds them anew";
  std::printf("%-32s %8s %8s  %s\n", "kernel", "worst", "median", "worst case");
  for (const Row& row : rows) {
    std::printf("%-32s %8.2f %8.2f  %s\n", row.kernel.c_str(), row.worst, row.median, row.worst_case.c_str());
    found["rows"].push_back({{"kernel", row.kernel},
                             {"inputs", row.inputs},
                             {"relative_to", row.relative_to},
                             {"worst_digits", std::floor(100 * row.worst) / 100},
                             {"median_digits", std::floor(100 * row.median) / 100},
                             {"worst_case", row.worst_case}});
  }
  if (const char* path = std::getenv("SHAKEBED_WRITE_DIGITS"); path != nullptr)
    std::ofstream(path) << found.dump(2) << "\n";
  std::ifstream stream(SHAKEBED_SOURCE_DIR "/tests/bench/program/digits.json");
  const auto shown = nlohmann::ordered_json::parse(stream);
  ASSERT_EQ(shown["rows"].size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(shown["rows"][i]["kernel"], rows[i].kernel);
    // The libraries' sines and logarithms may differ in the last place between machines: a third of a digit.
    EXPECT_GE(rows[i].worst, shown["rows"][i]["worst_digits"].get<double>() - 0.3)
        << rows[i].kernel << " keeps fewer digits than the benchmark shows: write it anew with SHAKEBED_WRITE_DIGITS";
  }
}

// What they must keep at least, whatever is shown.
TEST(DigitsKept, AreEnough) {
  const std::vector<Row>& rows = rows_of_kernels();
  EXPECT_GE(rows.at(0).worst, 13);    // contact of disks: neighbours' shells reach no farther
  EXPECT_GE(rows.at(2).worst, 14.5);  // of a disk and the lid
  EXPECT_GE(rows.at(3).worst, 14.5);  // of a disk and the floor
  EXPECT_GE(rows.at(4).worst, 14);    // f of the density
  EXPECT_GE(rows.at(5).worst, 13);    // its inverse
  EXPECT_GE(rows.at(6).worst, 13);    // k
  EXPECT_GE(rows.at(7).worst, 8);     // covariance
  EXPECT_GE(rows.at(8).worst, 14.5);  // height of a jump
}

}  // namespace
