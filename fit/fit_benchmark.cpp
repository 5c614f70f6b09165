#include "fit/fit_benchmark.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "fit/expansion.hpp"
#include "fit/fit_profile.hpp"
#include "fit/hydrostatic_profile.hpp"

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
FitBenchmarkRow inverse_row(const EquationOfState& equation, int count, int repeats) {
  std::vector<double> density;
  std::vector<double> f;
  std::vector<double> back(static_cast<std::size_t>(count));
  const double top = std::min(1.15, equation.largest_invertible_density());
  for (int i = 0; i < count; ++i) {
    const double phi = top * std::exp(-30.0 * std::fmod(0.61803398875 * i, 1.0) * std::fmod(0.61803398875 * i, 1.0));
    if (equation.stiffness(phi).value <= 0.0) continue;
    density.push_back(phi);
    f.push_back(equation.f(phi).value);
  }
  back.resize(f.size());
  FitBenchmarkRow row{"inverse", std::string(equation.name()) + ", batch", static_cast<int>(f.size()), 0.0, 0.0};
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

}  // namespace

std::vector<FitBenchmarkRow> benchmark_fit(double effort) {
  const auto repeats = [effort](double count) { return static_cast<int>(std::max(1.0, count * effort)); };
  std::vector<FitBenchmarkRow> rows;
  for (const EquationOfState* equation : equations_of_state())
    rows.push_back(inverse_row(*equation, 20000, repeats(5)));
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
