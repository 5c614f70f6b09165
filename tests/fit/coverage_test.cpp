#include <gtest/gtest.h>

#include <cmath>

#include "fit/expansion.hpp"
#include "tests/fit/synthetic.hpp"

// How often the 95 % intervals hold the truth. Seeds are fixed, so the numbers below repeat; a change of the fitter
// that moves a coverage out of 93 to 97 % fails. Under exact 95 % coverage a row of 1,000 has a standard deviation of
// 0.69 %, so a row leaves the band by chance with probability 0.4 %.
namespace shakebed::fit {
namespace {

struct Coverage {
  int by_error = 0, by_likelihood = 0, shift = 0, trials = 0;
  double mean_pull = 0.0;
};

Coverage cover(double reduced, const Kernel& kernel, double noise, std::uint64_t seed) {
  const Column column{11.22, 1.10};
  const double t = reduced * critical_temperature(enskog(), column).value;
  const auto truth = HydrostaticProfile::of_column(enskog(), t, column);
  const double shift =
      reduced <= 1.0 ? truth.top_of_solid() : -t * (enskog().f(1.10).value - enskog().f(truth.bottom_density()).value);
  FitOptions options;
  options.plateau_density = 1.10;
  options.kernel = kernel;
  options.sweep = options.compare = false;
  options.curve_points = 0;
  Coverage coverage;
  for (int trial = 0; trial < 1000; ++trial) {
    const Profile data = synthetic::profile_of(truth, kernel, 100, synthetic::top_of(truth), noise,
                                               seed + static_cast<std::uint64_t>(trial));
    const FitResult fit = fit_profile(data, options);
    if (!fit.ok()) continue;
    ++coverage.trials;
    const double pull = (fit.temperature.value - t) / fit.temperature.std_error;
    coverage.mean_pull += pull / 1000.0;
    if (std::abs(pull) < 1.959964) ++coverage.by_error;
    if (fit.temperature_interval.low <= t && t <= fit.temperature_interval.high) ++coverage.by_likelihood;
    if (std::abs(fit.shift.value - shift) < 1.959964 * fit.shift.std_error) ++coverage.shift;
  }
  return coverage;
}

TEST(Coverage, OfAThousandSyntheticProfilesIsNinetyFivePerCent) {
  std::printf("[ coverage ] 1,000 synthetic profiles a row, 100 bins, T and shift free, nominal 95 %%\n");
  std::printf("[ coverage ] %6s %-10s %6s | %8s %10s %6s | %9s\n", "T/T_c", "kernel", "noise", "T +- s.e.",
              "likelihood", "shift", "mean pull");
  const Kernel gaussian{KernelKind::gaussian, 0.3};
  const Kernel bin{KernelKind::top_hat, 0.25};
  struct Row {
    double reduced;
    Kernel kernel;
    double noise;
    std::uint64_t seed;
  };
  for (const Row& row : {Row{0.3, bin, 0.01, 1000}, Row{0.6, {}, 0.02, 20000}, Row{0.6, gaussian, 0.02, 40000},
                         Row{0.95, bin, 0.02, 60000}, Row{3.0, bin, 0.02, 80000}, Row{20.0, {}, 0.01, 100000}}) {
    const Coverage c = cover(row.reduced, row.kernel, row.noise, row.seed);
    std::printf("[ coverage ] %6.2f %-10s %6.3f | %7.1f %% %8.1f %% %4.1f %% | %+9.3f\n", row.reduced,
                std::string(to_string(row.kernel.kind)).c_str(), row.noise, 0.1 * c.by_error, 0.1 * c.by_likelihood,
                0.1 * c.shift, c.mean_pull);
    EXPECT_EQ(c.trials, 1000) << "every fit must succeed";
    for (const int held : {c.by_error, c.by_likelihood, c.shift}) {
      EXPECT_GE(held, 930) << row.reduced;
      EXPECT_LE(held, 970) << row.reduced;
    }
    EXPECT_LE(std::abs(c.mean_pull), 4.0 / std::sqrt(1000.0)) << "bias beyond 4 standard errors of the mean";
  }
}

}  // namespace
}  // namespace shakebed::fit
