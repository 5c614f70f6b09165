#include "tests/bench/cases/fit_benchmark.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/expansion.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "fit/theory/inverse_table.hpp"

namespace shakebed::fit {

namespace {

// The least time of `repeats` runs, in nanoseconds.
template <class Work>
double least_time(int repeats, Work&& work) {
  work();  // tables are built at the first use
  double least = 1e300;
  for (int i = 0; i < std::max(3, repeats); ++i) {
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double, std::nano> took = std::chrono::steady_clock::now() - start;
    least = std::min(least, took.count());
  }
  return least;
}

// The inverse against the density its f was computed from. One rounding of f moves phi by |f| eps/kappa; that part is
// the input's, not the inverse's, and is taken off.
FitBenchmarkRow inverse_row(const EquationOfState& equation, int count, int repeats, bool whole_range) {
  std::vector<double> density;
  std::vector<double> f;
  std::vector<double> back(static_cast<std::size_t>(count));
  const double top = std::min(1.15, equation.largest_invertible_density());
  for (int i = 0; i < count; ++i) {
    const double fraction = std::fmod(0.61803398875 * i, 1.0);
    const double phi = top * (whole_range ? std::exp(-690.0 * fraction) : std::exp(-30.0 * fraction * fraction));
    if (equation.stiffness(phi).value <= 0.0) continue;
    density.push_back(phi);
    f.push_back(equation.f(phi).value);
  }
  back.resize(f.size());
  FitBenchmarkRow row{"inverse", std::string(equation.name()) + (whole_range ? ", batch, from 1e-300" : ", batch"),
                      static_cast<int>(f.size()), 0.0, 0.0};
  row.nanoseconds = least_time(repeats, [&] { equation.densities_from_f(f, back); }) / static_cast<double>(f.size());
  for (std::size_t i = 0; i < f.size(); ++i) {
    const double input = 1.2e-16 * std::abs(f[i]) / equation.stiffness(density[i]).value;
    row.error = std::max(row.error, std::abs(back[i] / density[i] - 1.0) - input);
  }
  return row;
}

FitBenchmarkRow fit_row(const Kernel& kernel, int bins, bool covariance, int repeats) {
  const double temperature = 0.12;
  const HydrostaticProfile truth = HydrostaticProfile::of_column(enskog(), temperature, {11.22, 1.10});
  Profile data;
  for (int i = 0; i < bins; ++i) data.height.push_back(13.0 * (i + 0.5) / bins);
  data.number_density.resize(data.height.size());
  truth.sample(data.height, kernel, data.number_density);
  data.std_error.assign(data.height.size(), 1e-3);
  if (covariance) {
    const std::size_t n = data.height.size();
    data.covariance.assign(n * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        data.covariance[i * n + j] = 1e-6 * std::exp(-std::abs(static_cast<double>(i) - static_cast<double>(j)));
      }
    }
  }
  FitOptions options;
  options.plateau_density = 1.10;
  options.kernel = kernel;
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  FitBenchmarkRow row{"fit", "kernel " + std::string(to_string(kernel.kind)) + (covariance ? ", full covariance" : ""),
                      bins, 0.0, 0.0};
  FitResult fit;
  row.nanoseconds = least_time(repeats, [&] { fit = fit_profile(data, options); });
  row.error = std::abs(fit.temperature.value / temperature - 1.0);
  return row;
}

FitOptions bare_fit(const Kernel& kernel) {
  FitOptions options;
  options.plateau_density = 1.10;
  options.kernel = kernel;
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  return options;
}

// A bed at T = 0.12 m g D seen through bins of 13 D in all, each disk counted once: variances go as density over width.
Profile counted_profile(int bins, const Kernel& kernel, double disks_times_width) {
  const HydrostaticProfile truth = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
  Profile data;
  const double width = 13.0 / bins;
  for (int i = 0; i < bins; ++i) data.height.push_back(width * (i + 0.5));
  data.number_density.resize(data.height.size());
  truth.sample(data.height, kernel, data.number_density);
  for (const double density : data.number_density) {
    data.std_error.push_back(std::sqrt((density + 1e-3) / (disks_times_width * width)));
  }
  return data;
}

void add_iterations(double effort, std::vector<FitTradeOff>& rows) {
  for (const Kernel& kernel : {Kernel{KernelKind::top_hat, 0.25}, Kernel{KernelKind::gaussian, 0.3}}) {
    Profile data = counted_profile(100, kernel, 1e4);
    for (std::size_t i = 0; i < data.height.size(); ++i) {
      data.number_density[i] += data.std_error[i] * std::sin(7.0 * static_cast<double>(i * i));  // some misfit
    }
    FitOptions options = bare_fit(kernel);
    const double converged = fit_profile(data, options).temperature.value;
    const int standard = options.max_iterations;
    for (const int iterations : {1, 2, 3, 4, 5, 6, 8, 10, standard}) {
      options.max_iterations = iterations;
      FitTradeOff row{
          "iterations",          "kernel " + std::string(to_string(kernel.kind)), 1.0 * iterations, 0.0, 0.0,
          iterations == standard};
      FitResult fit;
      row.nanoseconds =
          least_time(std::max(3, static_cast<int>(10 * effort)), [&] { fit = fit_profile(data, options); });
      row.error = std::abs(fit.temperature.value / converged - 1.0);
      rows.push_back(row);
    }
  }
}

void add_tables(double effort, std::vector<FitTradeOff>& rows) {
  const EquationOfState& equation = enskog();
  const std::vector<InverseTable::Piece> pieces = equation.pieces();
  const double constant = equation.f_constant();
  const double top = equation.largest_invertible_density();
  constexpr int count = 20000;
  std::vector<double> f, exact, found(count);
  for (int i = 0; i < count; ++i) {
    exact.push_back(std::min(top, 1.15) * std::exp(-30.0 * std::pow(std::fmod(0.61803398875 * i, 1.0), 2)));
    f.push_back(static_cast<double>(pieces[0].f_of_density(exact.back())));
  }
  for (const bool newton : {false, true}) {
    for (const double widest : {32.0, 16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125}) {
      const InverseTable table(pieces, {widest, 1.0});
      FitTradeOff row{
          "table size", newton ? "with one Newton step" : "interpolation alone", static_cast<double>(table.size()), 0.0,
          0.0,          !newton && widest == InverseTable::Fineness{}.widest};
      row.nanoseconds = least_time(std::max(3, static_cast<int>(3 * effort)),
                                   [&] {
                                     for (std::size_t i = 0; i < f.size(); ++i) {
                                       double density = table.density(f[i]);
                                       if (newton) {
                                         const double big_f = equation.f(density).value - constant;
                                         density *= 1.0 - (big_f - f[i]) / equation.stiffness(density).value;
                                       }
                                       found[i] = density;
                                     }
                                   }) /
                        count;
      for (std::size_t i = 0; i < f.size(); ++i) {
        // One rounding of F moves phi by |F| eps/kappa: the input's part.
        const double input = 1.2e-16 * std::abs(f[i]) / equation.stiffness(exact[i]).value;
        row.error = std::max(row.error, std::abs(found[i] / exact[i] - 1.0) - input);
      }
      rows.push_back(row);
    }
  }
}

void add_bins(double effort, std::vector<FitTradeOff>& rows) {
  for (const int bins : {10, 13, 26, 52, 104, 208, 520, 1040, 5200}) {
    const Kernel kernel{KernelKind::top_hat, 13.0 / bins};
    const Profile data = counted_profile(bins, kernel, 1e5);
    const FitOptions options = bare_fit(kernel);
    FitTradeOff row{"bins", "top hat as wide as a bin", 1.0 * bins, 0.0, 0.0, bins == 52};
    FitResult fit;
    row.nanoseconds = least_time(std::max(3, static_cast<int>(5 * effort)), [&] { fit = fit_profile(data, options); });
    row.error = fit.ok() ? fit.temperature.std_error / fit.temperature.value : 1.0;
    rows.push_back(row);
  }
}

}  // namespace

std::vector<FitTradeOff> benchmark_fit_trade_offs(double effort) {
  std::vector<FitTradeOff> rows;
  add_iterations(effort, rows);
  add_tables(effort, rows);
  add_bins(effort, rows);
  return rows;
}

std::vector<FitBenchmarkRow> benchmark_fit(double effort) {
  const auto repeats = [effort](double count) { return static_cast<int>(std::max(1.0, count * effort)); };
  std::vector<FitBenchmarkRow> rows;
  for (const EquationOfState* equation : equations_of_state())
    rows.push_back(inverse_row(*equation, 20000, repeats(5), false));
  rows.push_back(inverse_row(enskog(), 20000, repeats(5), true));
  for (const double phi : {1e-8, 0.5, close_packing_density}) {
    FitBenchmarkRow row{"constants", "phi_0 = " + std::to_string(phi), 1, 0.0, 0.0};
    ExpansionConstants constants;
    row.nanoseconds = least_time(repeats(200), [&] { constants = expansion_constants(enskog(), phi); });
    // Against the printed definition of k, whose cancellation limits the comparison to about 1e-16 Lambda_1
    // phi_0/mu_0^2/k.
    row.error = std::abs(expansion_coefficient(constants.lambda_1, constants.mu_0, phi) / constants.k - 1.0);
    rows.push_back(row);
  }
  for (const Kernel& kernel : {Kernel{}, Kernel{KernelKind::top_hat, 0.25}, Kernel{KernelKind::gaussian, 0.3},
                               Kernel{KernelKind::disk_chord, 1.0}}) {
    for (const int bins : {30, 100, 1000, 10000})
      rows.push_back(fit_row(kernel, bins, false, repeats(bins > 1000 ? 2 : 10)));
    rows.push_back(fit_row(kernel, 100, true, repeats(10)));
  }
  return rows;
}

}  // namespace shakebed::fit
