#include "fit/theory/expansion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/fit/reference_values.hpp"

namespace shakebed::fit {
namespace {

TEST(Expansion, MatchesNinetyDigitConstantsTo1e12) {
  double worst = 0.0;
  for (const auto& row : reference::expansion_rows) {
    const ExpansionConstants c = expansion_constants(enskog(), row.phi_0);
    ASSERT_TRUE(c.ok());
    for (const double off : {c.mu_0 / row.mu_0, c.lambda_1 / row.lambda_1, c.k / row.k, c.contact_value / row.chi}) {
      EXPECT_NEAR(off, 1.0, 1e-12) << row.phi_0;
      worst = std::max(worst, std::abs(off - 1.0));
    }
    EXPECT_NEAR(c.f_plateau, row.f, 1e-12 * std::max(1.0, std::abs(row.f)));
  }
  std::printf("[ measured ] worst relative error of mu_0, Lambda_1, k, chi: %.1e\n", worst);
}

TEST(Expansion, MatchesTheTableOfPhysics) {
  struct Row {
    double phi_0, f, mu_0, lambda_1, k;
  };
  for (const Row& row : {Row{2.0 / std::sqrt(3.0), 109.220001006, 111.311296763, 5582.60444713, 0.0405375006220},
                         Row{1.10, 59.6676730322, 55.2382744295, 1467.07052093, 0.0577754048718},
                         Row{0.50, 4.21850368344, 1.38013796545, 2.65398258890, 0.393327034680}}) {
    const ExpansionConstants c = expansion_constants(enskog(), row.phi_0);
    EXPECT_NEAR(c.f_plateau / row.f, 1.0, 1e-11);
    EXPECT_NEAR(c.mu_0 / row.mu_0, 1.0, 1e-11);
    EXPECT_NEAR(c.lambda_1 / row.lambda_1, 1.0, 1e-11);
    EXPECT_NEAR(c.k / row.k, 1.0, 2e-12);
  }
}

TEST(Expansion, GivesTheExperimentsNumbers) {
  const Column column = column_from_initial_height(10.2, 1.10);
  const double d = 2.99;
  EXPECT_NEAR(d * critical_temperature(enskog(), column).value, 0.6073, 5e-5);
  EXPECT_NEAR(0.36 / (d * critical_temperature(enskog(), column).value), 0.5928, 5e-5);
  EXPECT_NEAR(solid_height(enskog(), column, 0.36 / d).value, 4.154, 5e-4);
  EXPECT_NEAR(d * critical_temperature(enskog(), column_from_initial_height(10.2, close_packing_density)).value, 0.3164,
              5e-5);
  // Eq. (5) cannot exceed 0.295 D there.
  const double critical = critical_temperature(enskog(), column).value;
  EXPECT_NEAR(center_of_mass_rise(enskog(), column, critical).value, 0.295, 5e-4);
  EXPECT_NEAR(center_of_mass_rise(enskog(), column, critical).value, 0.5 * 10.2 * 0.0577754048718, 1e-11);
}

TEST(Expansion, HydrostaticRiseEqualsEquationFiveBelowTcAndContinuesAbove) {
  const Column column = column_from_initial_height(20.0, close_packing_density);
  const double critical = critical_temperature(enskog(), column).value;
  for (const double t : {0.2, 0.5, 0.8, 1.0}) {
    EXPECT_EQ(hydrostatic_center_of_mass_rise(enskog(), column, t * critical).value,
              center_of_mass_rise(enskog(), column, t * critical).value);
  }
  EXPECT_EQ(center_of_mass_rise(enskog(), column, 1.001 * critical).status, ValueStatus::outside_range);
  const double below = hydrostatic_center_of_mass_rise(enskog(), column, critical * (1.0 - 1e-9)).value;
  const double above = hydrostatic_center_of_mass_rise(enskog(), column, critical * (1.0 + 1e-9)).value;
  EXPECT_NEAR(above, below, 1e-8);
  // Far above: an ideal gas in gravity, mean height T/(m g).
  const double hot = 1e6 * critical;
  EXPECT_NEAR(hydrostatic_center_of_mass_rise(enskog(), column, hot).value / hot, 1.0, 1e-2);
}

TEST(Expansion, TrueDisksRiseByTheRatiosOfPhysics) {
  // physics.md: by local density the rise is 5.1, 2.0, 1.3, 1.02 times eq. (5) at 0.2, 0.5, 0.8, 1 T_c (mu = 20).
  const Column column = column_from_initial_height(20.0, close_packing_density);
  const double critical = critical_temperature(enskog(), column).value;
  const std::pair<double, double> rows[] = {{0.2, 5.1}, {0.5, 2.0}, {0.8, 1.3}, {1.0, 1.02}};
  for (const auto& [t, ratio] : rows) {
    const double eq5 = center_of_mass_rise(enskog(), column, t * critical).value;
    const double disks = hydrostatic_center_of_mass_rise(best_of(), column, t * critical).value;
    EXPECT_NEAR(disks / eq5 / ratio, 1.0, 0.03) << t;
  }
}

TEST(Expansion, HasAStatusAtPolesAndOutsideRanges) {
  const auto at_close_packing = [](const char* name) {
    return expansion_constants(*find_equation_of_state(name), close_packing_density);
  };
  EXPECT_NEAR(at_close_packing("percus-yevick").mu_0, 133.22, 0.005);
  EXPECT_NEAR(at_close_packing("henderson").mu_0, 146.92, 0.005);
  EXPECT_EQ(at_close_packing("santos-lopez-yuste").status, ValueStatus::pole);
  EXPECT_EQ(at_close_packing("luding").status, ValueStatus::pole);
  EXPECT_EQ(at_close_packing("best-of").status, ValueStatus::pole);
  EXPECT_EQ(at_close_packing("kolafa-rottner").status, ValueStatus::outside_range);
  for (const EquationOfState* equation : equations_of_state()) {
    const ExpansionConstants c = expansion_constants(*equation, close_packing_density);
    EXPECT_EQ(c.plateau_density, close_packing_density);
    if (c.ok()) continue;
    EXPECT_EQ(c.mu_0, 0.0);
    EXPECT_EQ(c.k, 0.0);
    EXPECT_EQ(critical_temperature(*equation, column_from_initial_height(20.0, close_packing_density)).status,
              c.status);
  }
  EXPECT_EQ(expansion_constants(enskog(), 0.0).status, ValueStatus::invalid_argument);
  EXPECT_EQ(expansion_constants(enskog(), -1.0).status, ValueStatus::invalid_argument);
  EXPECT_EQ(expansion_constants(enskog(), -1.0).plateau_density, -1.0);
  EXPECT_EQ(expansion_constants(enskog(), 1.3).status, ValueStatus::outside_range);
  const Column column{11.22, 1.1};
  for (const double wrong : {-0.1, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(hydrostatic_center_of_mass_rise(enskog(), column, wrong).status, ValueStatus::invalid_argument);
    EXPECT_EQ(hydrostatic_center_of_mass_rise(enskog(), {wrong, 1.1}, 0.1).status, ValueStatus::invalid_argument);
  }
  EXPECT_EQ(hydrostatic_center_of_mass_rise(enskog(), column, 0).value, 0) << "at rest";
}

TEST(Expansion, ConstantsNearAPoleAreStillResolved) {
  // k = (1/phi_0) integral (Z/Z_0)^2: near the pole of Santos et al. Z ~ 1/(1 - phi/phi_c) and k -> x/phi_0 + ...;
  // compared with the same integral in closed form for the pole term.
  const EquationOfState& equation = *find_equation_of_state("percus-yevick");
  // Z = (1 - eta)^-2: integral_0^phi Z^2 = (4/pi) [(1 - eta)^-3 - 1]/3.
  for (const double phi : {1e-8, 1e-3, 0.3, 0.9, 1.15}) {
    const double eta = 0.78539816339744831 * phi;
    const double closed = std::expm1(-3.0 * std::log1p(-eta)) / (3.0 * eta) * std::pow(1.0 - eta, 4);
    EXPECT_NEAR(expansion_constants(equation, phi).k / closed, 1.0, 1e-13);
  }
}

}  // namespace
}  // namespace shakebed::fit
