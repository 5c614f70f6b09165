#include "fit/theory/hydrostatic_profile.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "fit/theory/fermi_profile.hpp"
#include "fit/theory/quadrature.hpp"
#include "fit/theory/tail.hpp"

namespace shakebed::fit {
namespace {

TEST(PublishedProfile, HasThePrintedShape) {
  const HydrostaticProfile profile = published_profile();
  ASSERT_TRUE(profile.ok());
  EXPECT_NEAR(profile.top_of_solid(), 4.41 / 1.10, 1e-14);
  EXPECT_EQ(profile.density(2.0), 1.10);
  EXPECT_NEAR(profile.density(4.41 / 1.10 + 1e-9), 1.10, 1e-6);
  EXPECT_NEAR(profile.column_number(), 11.06, 0.005);  // physics.md
  EXPECT_NEAR(HydrostaticProfile::tail_over_rectangle(enskog(), 0.36 / 2.99, 4.41, 1.10).column_number(), 11.50, 0.005);
  EXPECT_NEAR(PublishedFit{}.column().column_number, 11.22, 1e-12);
}

TEST(HydrostaticProfile, IsInHydrostaticBalance) {
  for (const EquationOfState* equation : equations_of_state()) {
    for (const double t : {0.05, 0.12, 0.5, 3.0}) {
      const auto profile = HydrostaticProfile::of_column(*equation, t, {11.22, 1.10});
      if (!profile.ok()) {
        EXPECT_EQ(equation->name(), "kolafa-rottner");  // ends at freezing
        continue;
      }
      // The weight above equals the pressure, by direct quadrature of the density.
      for (const double height : {0.0, 2.5, 8.0}) {
        const double top = profile.top_of_solid() + 160.0 * t + 60.0 * t;
        const double start = std::max(height, profile.top_of_solid());
        double weight = profile.bottom_density() * std::max(0.0, profile.top_of_solid() - height);
        const int steps = 40000;
        const double h = (top - start) / steps;
        for (int i = 0; i < steps; ++i) weight += h * profile.density(start + (i + 0.5) * h);
        EXPECT_NEAR(profile.column_above(height), weight, 2e-4) << equation->name() << " " << t << " " << height;
      }
      EXPECT_NEAR(profile.column_number(), 11.22, 1e-11) << equation->name() << " " << t;
    }
  }
}

TEST(HydrostaticProfile, HasNoRectangleFromTcOn) {
  const Column column = column_from_initial_height(20.0, close_packing_density);
  const double critical = critical_temperature(enskog(), column).value;
  for (const double t : {0.1, 0.999, 1.0, 1.001, 2.0, 100.0}) {
    const auto profile = HydrostaticProfile::of_column(enskog(), t * critical, column);
    ASSERT_TRUE(profile.ok()) << t;
    EXPECT_NEAR(profile.solid_height(), std::max(0.0, 20.0 * (1.0 - t)), 1e-12);
    EXPECT_NEAR(profile.column_number() / column.column_number, 1.0, 1e-13) << t;
    if (t > 1.0) {
      EXPECT_LT(profile.bottom_density(), close_packing_density);
    }
  }
  const auto cold = HydrostaticProfile::of_column(enskog(), 0.0, column);
  EXPECT_EQ(cold.solid_height(), 20.0);
  EXPECT_EQ(cold.density(19.9), close_packing_density);
  EXPECT_EQ(cold.density(20.1), 0.0);
  const auto cold_disks = HydrostaticProfile::of_column(best_of(), 0.0, column);
  EXPECT_NEAR(cold_disks.solid_height(), 20.0, 1e-12);
}

TEST(HydrostaticProfile, BottomDensityOfTrueDisksIsThatOfPhysics) {
  // physics.md, mu = 20: 1.131 at T_c, 1.143 at 0.5, 1.150 at 0.2 T_c.
  const Column column = column_from_initial_height(20.0, close_packing_density);
  const double critical = critical_temperature(enskog(), column).value;
  const std::pair<double, double> rows[] = {{1.0, 1.131}, {0.5, 1.143}, {0.2, 1.150}};
  for (const auto& [t, density] : rows) {
    EXPECT_NEAR(HydrostaticProfile::of_column(best_of(), t * critical, column).bottom_density(), density, 6e-4) << t;
  }
}

TEST(HydrostaticProfile, CenterOfMassFollowsTheRise) {
  const Column column = column_from_initial_height(20.0, close_packing_density);
  const double critical = critical_temperature(enskog(), column).value;
  for (const EquationOfState* equation : {&enskog(), &best_of()}) {
    for (const double t : {0.2, 0.5, 1.0, 3.0}) {
      const auto profile = HydrostaticProfile::of_column(*equation, t * critical, column);
      EXPECT_NEAR(profile.center_of_mass() - 10.0,
                  hydrostatic_center_of_mass_rise(*equation, column, t * critical).value, 1e-11);
    }
  }
}

// The kernel integral by thousands of Gauss panels between the breaks of kernel and profile.
template <class Profile>
double brute_force(const Profile& profile, const Kernel& kernel, double height, std::vector<double> breaks) {
  const double reach = kernel_reach(kernel);
  breaks.push_back(height - reach);
  breaks.push_back(height + reach);
  std::sort(breaks.begin(), breaks.end());
  const bool chord = kernel.kind == KernelKind::disk_chord;
  const auto variable = [&](double h) {
    return chord ? std::asin(std::clamp((h - height) / reach, -1.0, 1.0)) : h - height;
  };
  double sum = 0.0;
  for (std::size_t i = 1; i < breaks.size(); ++i) {
    const double from = variable(std::max(breaks[i - 1], height - reach));
    const double to = variable(std::min(breaks[i], height + reach));
    if (!(to > from)) continue;
    constexpr int panels = 2000;
    for (int panel = 0; panel < panels; ++panel) {
      sum += integrate_panel<8>(from + (to - from) * panel / panels, from + (to - from) * (panel + 1) / panels,
                                [&](double x) {
                                  if (!chord) return kernel_density(kernel, x) * profile.density(height + x);
                                  return 2.0 / 3.14159265358979324 * std::cos(x) * std::cos(x) *
                                         profile.density(height + reach * std::sin(x));
                                });
    }
  }
  return sum;
}

TEST(Kernels, SmoothTheProfileAsDirectIntegrationDoes) {
  const Kernel kernels[] = {{KernelKind::top_hat, 0.25},
                            {KernelKind::top_hat, 3.0},
                            {KernelKind::gaussian, 0.3},
                            {KernelKind::gaussian, 1.5},
                            {KernelKind::disk_chord, 1.0}};
  const HydrostaticProfile profiles[] = {
      published_profile(),
      HydrostaticProfile::of_column(enskog(), 2.0, {11.22, 1.10}),
      HydrostaticProfile::of_column(enskog(), 0.02, {11.22, 1.10}),
      HydrostaticProfile::of_column(enskog(), 1e-3, {11.22, 1.10}),
      HydrostaticProfile::of_column(best_of(), 0.2, {11.22, 1.10}),
      HydrostaticProfile::of_column(*find_equation_of_state("luding"), 0.1, {23.0, 1.10})};
  double worst = 0.0;
  for (const HydrostaticProfile& profile : profiles) {
    std::vector<double> breaks{profile.base(), profile.top_of_solid()};
    if (&profile.equation() == &best_of()) breaks.push_back(profile.crystal_height());
    for (const Kernel& kernel : kernels) {
      for (const double height : {-0.2, 0.1, 3.9, 4.3, 9.0, 10.15, 12.0, 15.0}) {
        double smooth = 0.0;
        profile.sample({&height, 1}, kernel, {&smooth, 1});
        const double direct = brute_force(profile, kernel, height, breaks);
        worst = std::max(worst, std::abs(smooth - direct));
        EXPECT_NEAR(smooth, direct, 1e-9) << profile.equation().name() << " T " << profile.temperature() << " "
                                          << to_string(kernel.kind) << " " << kernel.width << " at " << height;
      }
    }
  }
  std::printf("[ measured ] worst error of a smoothed density: %.1e\n", worst);
}

TEST(Kernels, ConserveTheColumn) {
  for (const Kernel kernel :
       {Kernel{KernelKind::top_hat, 0.7}, Kernel{KernelKind::gaussian, 0.4}, Kernel{KernelKind::disk_chord, 1.0}}) {
    const HydrostaticProfile profile = HydrostaticProfile::of_column(enskog(), 0.12, {11.22, 1.10});
    std::vector<double> heights;
    const double h = 0.01;
    for (double z = -4.0; z < 30.0; z += h) heights.push_back(z);
    std::vector<double> smooth(heights.size());
    profile.sample(heights, kernel, smooth);
    double sum = 0.0;
    for (const double phi : smooth) sum += h * phi;
    EXPECT_NEAR(sum, 11.22, kernel.kind == KernelKind::top_hat ? 1e-5 : 1e-6);
  }
}

TEST(Kernels, AreNormalisedAndNamed) {
  for (const Kernel kernel :
       {Kernel{KernelKind::top_hat, 0.7}, Kernel{KernelKind::gaussian, 0.4}, Kernel{KernelKind::disk_chord, 1.0}}) {
    for (double s = -3.0; s < 3.0; s += 0.173) {
      const int steps = 20000;
      double sum = 0.0;
      for (int i = 0; i < steps; ++i)
        sum += kernel_density(kernel, -4.0 + (i + 0.5) * (s + 4.0) / steps) * (s + 4.0) / steps;
      // a step of the sum at each edge of a top hat
      EXPECT_NEAR(kernel_cumulative(kernel, s), sum, (s + 4.0) / steps / kernel.width);
    }
    EXPECT_EQ(kernel_kind_from(to_string(kernel.kind)), kernel.kind);
  }
  EXPECT_FALSE(kernel_kind_from("boxcar"));
}

TEST(FermiProfile, CenterOfMassRisesAsTheLowTemperatureForm) {
  const double mu = 20.0;
  for (const double theta : {0.1, 0.5, 1.0}) {
    const FermiProfile profile{1.1, mu, theta};
    EXPECT_NEAR(profile.center_of_mass().value - 0.5 * mu, fermi_center_of_mass_rise(theta, mu), 1e-7);
  }
  // Exact at any theta: against direct integration.
  for (const double theta : {5.0, 20.0, 200.0}) {
    const FermiProfile profile{1.1, mu, theta};
    double mass = 0.0;
    double moment = 0.0;
    const double h = (mu + 45.0 * theta) / 400000;
    for (int i = 0; i < 400000; ++i) {
      const double z = (i + 0.5) * h;
      mass += h * profile.density(z);
      moment += h * z * profile.density(z);
    }
    EXPECT_NEAR(profile.column_number() / mass, 1.0, 1e-7);
    EXPECT_NEAR(profile.center_of_mass().value / (moment / mass), 1.0, 1e-7);
  }
}

// Without a temperature it is a rectangle: mass, middle and means over a top hat by pencil.
TEST(FermiProfile, OfNoTemperatureIsARectangle) {
  const FermiProfile profile{1.1, 8.0, 0.0};
  EXPECT_NEAR(profile.column_number(), 8.8, 1e-14);
  EXPECT_EQ(profile.center_of_mass().value, 4.0);
  const std::vector<double> heights{-0.1, 0.1, 5.0, 8.0, 8.4};
  std::vector<double> bare(5), seen(5);
  profile.sample(heights, {}, bare);
  EXPECT_EQ(bare, (std::vector<double>{0, 1.1, 1.1, 1.1, 0}));
  profile.sample(heights, {KernelKind::top_hat, 1.0}, seen);
  const double covered[] = {0.4, 0.6, 1.0, 0.5, 0.1};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(seen[i], 1.1 * covered[i], 1e-14) << heights[i];
  EXPECT_EQ((FermiProfile{1.1, -1.0, 0.0}.column_number()), 0);
  EXPECT_EQ((FermiProfile{1.1, -1.0, 0.0}.center_of_mass().status), ValueStatus::invalid_argument);
}

// On both sides of where its series ends, exp(-|edge|/theta) = 1/2, and with an edge below the floor.
TEST(FermiProfile, HasTheMomentsOfItsSums) {
  for (const double x : {-4.0, -0.70, -0.69, -0.1, 0.1, 0.69, 0.70, 4.0}) {
    const FermiProfile profile{1.1, 2.0 * x, 2.0};
    double mass = 0, moment = 0;
    constexpr double h = 1e-3;
    for (double z = h / 2; z < 100; z += h) mass += h * profile.density(z), moment += h * z * profile.density(z);
    EXPECT_NEAR(profile.column_number() / mass, 1, 1e-7) << x;
    EXPECT_NEAR(profile.center_of_mass().value * mass / moment, 1, 1e-7) << x;
  }
}

TEST(FermiProfile, KeepsTheColumnAsked) {
  for (const double theta : {0.0, 0.1, 3.0, 50.0}) {
    EXPECT_NEAR(fermi_profile_of_column(11.22, 1.1, theta).column_number(), 11.22, 1e-12) << theta;
  }
}

TEST(FermiProfile, IsSmoothedAsDirectIntegrationDoes) {
  const FermiProfile profile{1.1, 8.0, 0.4};
  for (const Kernel kernel :
       {Kernel{KernelKind::top_hat, 0.7}, Kernel{KernelKind::gaussian, 0.8}, Kernel{KernelKind::disk_chord, 1.0}}) {
    for (const double height : {0.2, 7.0, 8.3, 11.0}) {
      double smooth = 0.0;
      profile.sample({&height, 1}, kernel, {&smooth, 1});
      EXPECT_NEAR(smooth, brute_force(profile, kernel, height, {0.0}), 1e-9);
    }
  }
}

// A bed higher up has the same profile higher up, also through a kernel, and with all its derivatives.
TEST(Tails, MoveWithTheirBed) {
  const auto tail_at = [](double base) {
    Tail tail;
    tail.table = &enskog().inverse_table();
    tail.temperature = 0.06, tail.base = base, tail.reference = base + 4, tail.rectangle_density = 1.1;
    tail.f_reference = std::log(1.1) + enskog().excess(1.1);
    tail.d_temperature = {1, 0, 0}, tail.d_reference = {0, 1, 0}, tail.d_rectangle = {0, 0, 1};
    tail.prepare(enskog());
    return tail;
  };
  const Tail low = tail_at(0), high = tail_at(2.5);
  // Where it ends the rectangle is the rectangle still: its density does not depend on T.
  EXPECT_THAT(low.smoothed_with_gradient(low.start, KernelRule(Kernel{})), testing::ElementsAre(1.1, 0, 0, 1));
  for (const Kernel& kernel : {Kernel{}, Kernel{KernelKind::gaussian, 0.4}, Kernel{KernelKind::top_hat, 1},
                               Kernel{KernelKind::disk_chord, 1}}) {
    const KernelRule rule(kernel);
    double area = 0;
    for (double height = -2.995; height < 12; height += 0.01) {
      const double value = low.smoothed(height, rule);
      EXPECT_NEAR(high.smoothed(height + 2.5, rule), value, 1e-9) << to_string(kernel) << ' ' << height;
      area += 0.01 * value;
      if (rule.is_point()) continue;
      const auto here = low.smoothed_with_gradient(height, rule),
                 there = high.smoothed_with_gradient(height + 2.5, rule);
      EXPECT_NEAR(here[0], value, 1e-9);
      for (std::size_t k = 0; k < here.size(); ++k) EXPECT_NEAR(there[k], here[k], 1e-8) << k << ' ' << height;
    }
    // The rectangle, and the tail, whose weight is the pressure at its start.
    EXPECT_NEAR(area, 1.1 * 4 + enskog().pressure(1.1, 0.06).value, 2e-3) << to_string(kernel);
  }
}

// Of a bed without temperature only the rectangle is there: its share under the kernel, and nothing above it.
TEST(Tails, OfNoTemperatureAreTheirRectangle) {
  Tail tail;
  tail.table = &enskog().inverse_table();
  tail.base = 1, tail.reference = 5, tail.rectangle_density = 1.1;
  tail.f_reference = std::log(1.1) + enskog().excess(1.1);
  tail.d_rectangle = {0, 0, 1};
  tail.prepare(enskog());
  const auto share = [](const Kernel& kernel, double height) {
    if (kernel.kind == KernelKind::none) return height >= 1 && height <= 5 ? 1.0 : 0.0;
    if (kernel.kind == KernelKind::top_hat)
      return std::clamp(std::min(height + 0.5, 5.0) - std::max(height - 0.5, 1.0), 0.0, 1.0);
    const double scale = kernel.width * std::numbers::sqrt2;
    return 0.5 * (std::erf((height - 1) / scale) - std::erf((height - 5) / scale));
  };
  for (const Kernel& kernel : {Kernel{}, Kernel{KernelKind::gaussian, 0.4}, Kernel{KernelKind::top_hat, 1}}) {
    for (double height = -1.1; height < 8; height += 0.4) {
      const double expected = share(kernel, height);
      const auto found = tail.smoothed_with_gradient(height, KernelRule(kernel));
      EXPECT_NEAR(found[0], 1.1 * expected, 1e-12) << to_string(kernel) << ' ' << height;
      EXPECT_NEAR(found[3], expected, 1e-12) << to_string(kernel) << ' ' << height;
      EXPECT_NEAR(tail.smoothed(height, KernelRule(kernel)), 1.1 * expected, 1e-12) << to_string(kernel);
    }
  }
}

TEST(HydrostaticProfile, GivesAStatusForNonsense) {
  EXPECT_FALSE(HydrostaticProfile::of_column(enskog(), -1.0, {11.22, 1.10}).ok());
  EXPECT_FALSE(HydrostaticProfile::of_column(enskog(), 1.0, {-1.0, 1.10}).ok());
  EXPECT_FALSE(HydrostaticProfile::tail_over_rectangle(enskog(), 0.1, 4.0, 1.3).ok());
  EXPECT_EQ(HydrostaticProfile::tail_over_rectangle(best_of(), 0.1, 4.0, close_packing_density).status(),
            ValueStatus::pole);
  EXPECT_EQ(HydrostaticProfile::of_column(enskog(), -1.0, {11.22, 1.10}).density(1.0), 0.0);
  const auto tail = [](double temperature, double shift, double plateau, double base) {
    return HydrostaticProfile::tail_over_rectangle(enskog(), temperature, shift, plateau, base).status();
  };
  const auto column = [](double temperature, const Column& of, double base) {
    return HydrostaticProfile::of_column(enskog(), temperature, of, base).status();
  };
  using enum ValueStatus;
  EXPECT_EQ(tail(0.1, 4, 1.1, 0), ok);
  EXPECT_EQ(column(0.1, {11.22, 1.1}, 0), ok);
  for (const double wrong : {std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_EQ(tail(wrong, 4, 1.1, 0), invalid_argument);
    EXPECT_EQ(tail(0.1, wrong, 1.1, 0), invalid_argument);
    EXPECT_EQ(tail(0.1, 4, 1.1, wrong), invalid_argument);
    EXPECT_EQ(column(wrong, {11.22, 1.1}, 0), invalid_argument);
    EXPECT_EQ(column(0.1, {wrong, 1.1}, 0), invalid_argument);
    EXPECT_EQ(column(0.1, {11.22, 1.1}, wrong), invalid_argument);
  }
  for (const double wrong : {0.0, -1.0, std::nan("")}) {
    EXPECT_EQ(tail(0.1, 4, wrong, 0), invalid_argument);
    EXPECT_EQ(column(0.1, {11.22, wrong}, 0), invalid_argument);
    EXPECT_EQ(column(0.1, {wrong, 1.1}, 0), invalid_argument);
  }
  EXPECT_EQ(tail(-0.1, 4, 1.1, 0), invalid_argument);
  EXPECT_EQ(column(-0.1, {11.22, 1.1}, 0), invalid_argument);
}

}  // namespace
}  // namespace shakebed::fit
