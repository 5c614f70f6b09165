#include "fit/theory/equation_of_state.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "tests/fit/reference_values.hpp"

namespace shakebed::fit {
namespace {

constexpr double pi = std::numbers::pi;

double nu_to_phi(double nu) { return 4.0 * nu / pi; }

// Distance of `value` from `nearest + remainder ulp`, in units of the last place of `nearest`.
double ulps_from(double value, double nearest, double remainder) {
  const double ulp = std::nextafter(nearest, std::numeric_limits<double>::infinity()) - nearest;
  return std::abs((value - nearest) / ulp - remainder);
}

TEST(Enskog, HasThePrintedConstants) {
  const EnskogConstants c = enskog_constants();  // physics.md
  EXPECT_NEAR(c.a, 0.7686707533, 5e-11);
  EXPECT_NEAR(c.a1, 0.3089803499, 5e-11);
  EXPECT_NEAR(c.a2, 0.01608498777, 5e-12);
  EXPECT_NEAR(c.c1, 0.0855243719, 5e-11);
  EXPECT_NEAR(c.c2, -0.7101662999, 5e-11);
  EXPECT_EQ(c.c3, -c.c2);
  EXPECT_NEAR(c.c4, 1.2777253094, 5e-11);
}

TEST(Enskog, MatchesNinetyDigitValuesOfFAndContactValue) {
  for (const auto& row : reference::expansion_rows) {
    const Value f = enskog().f(row.phi_0);
    ASSERT_TRUE(f.ok());
    EXPECT_NEAR(f.value, row.f, 4e-15 * std::max(1.0, std::abs(row.f))) << row.phi_0;
    EXPECT_NEAR(enskog().contact_value(row.phi_0).value / row.chi, 1.0, 2e-15) << row.phi_0;
  }
}

// Z = 1 + 2 nu chi for hard disks, whatever the formula of Z.
TEST(EquationsOfState, HaveTheContactValueOfTheirPressure) {
  for (const EquationOfState* equation : equations_of_state()) {
    if (const Value alone = equation->contact_value(0); alone.ok()) {
      EXPECT_EQ(alone.value, 1) << equation->name() << ": two disks alone do not know of others";
    }
    int asked = 0;
    for (double nu = 0.04; nu < 0.9; nu += 0.01) {
      const Value z = equation->compressibility_factor(nu_to_phi(nu)), chi = equation->contact_value(nu_to_phi(nu));
      if (!z.ok() || !chi.ok()) continue;
      EXPECT_NEAR(chi.value / ((z.value - 1) / (2 * nu)), 1, 1e-13 + 4e-16 * z.value / (z.value - 1))
          << equation->name() << " " << nu;
      ++asked;
    }
    EXPECT_GT(asked, 5) << equation->name();
  }
}

TEST(Enskog, PrintedFormOfFIsTheOneComputed) {
  const EnskogConstants c = enskog_constants();
  for (double phi = 0.01; phi < close_packing_density; phi += 0.01) {
    const double d = 1.0 - c.a * phi;
    const double printed = std::log(phi) + c.c1 * phi + c.c2 * std::log(d) + c.c3 / d + c.c4 / (d * d);
    EXPECT_NEAR(enskog().f(phi).value, printed, 1e-13 * (1.0 + std::abs(printed)));
  }
}

TEST(Enskog, InverseIsWithinFourUlpOfTheNinetyDigitInverse) {
  double worst = 0.0;
  for (const auto& row : reference::inverse_rows) {
    const Value phi = enskog().density_from_f(row.f);
    ASSERT_TRUE(phi.ok()) << row.f;
    const double off = ulps_from(phi.value, row.phi, row.remainder);
    worst = std::max(worst, off);
    EXPECT_LE(off, 4.0) << "f = " << row.f << " phi = " << row.phi;
  }
  RecordProperty("worst_ulp", std::to_string(worst));
  std::printf("[ measured ] worst distance from the 90-digit inverse: %.2f ulp over %zu points\n", worst,
              reference::inverse_rows.size());
}

TEST(EquationsOfState, InverseIsWithinFourUlpOfTheNinetyDigitInverse) {
  std::map<std::string, std::pair<double, int>> worst;
  for (const auto& row : reference::other_inverse_rows) {
    const Value phi = find_equation_of_state(row.equation)->density_from_f(row.f);
    ASSERT_TRUE(phi.ok()) << row.equation << " " << row.f;
    const double off = ulps_from(phi.value, row.phi, row.remainder);
    EXPECT_LE(off, 4.0) << row.equation << " f = " << row.f << " phi = " << row.phi;
    auto& [largest, points] = worst[row.equation];
    largest = std::max(largest, off);
    ++points;
  }
  EXPECT_GE(worst.size(), 6U);  // Enskog has its own test
  for (const auto& [name, found] : worst)
    std::printf("[ measured ] %s: worst distance from the 90-digit inverse: %.2f ulp over %d points\n", name.c_str(),
                found.first, found.second);
}

TEST(EquationsOfState, BatchInverseEqualsTheSingleOne) {
  for (const EquationOfState* equation : equations_of_state()) {
    std::vector<double> f;
    for (const auto& row : reference::inverse_rows) f.push_back(row.f);
    f.push_back(1e4);
    f.push_back(std::numeric_limits<double>::quiet_NaN());
    std::vector<double> phi(f.size());
    EXPECT_EQ(equation->densities_from_f(f, phi),
              equation->has_pole() ? ValueStatus::invalid_argument : ValueStatus::outside_range);
    for (std::size_t i = 0; i < f.size(); ++i) EXPECT_EQ(phi[i], equation->density_from_f(f[i]).value);
    EXPECT_EQ(phi[f.size() - 1], 0.0);
    if (!equation->has_pole()) {
      EXPECT_EQ(phi[f.size() - 2], 0.0);
    }
  }
}

TEST(EquationsOfState, AreFoundByName) {
  EXPECT_GE(equations_of_state().size(), 7U);
  for (const EquationOfState* equation : equations_of_state()) {
    EXPECT_EQ(find_equation_of_state(equation->name()), equation);
    EXPECT_FALSE(equation->source().empty());
    EXPECT_FALSE(equation->validity().empty());
  }
  EXPECT_EQ(find_equation_of_state("van-der-waals"), nullptr);
}

TEST(KolafaRottner, ReproducesItsSimulatedTable) {
  const EquationOfState& equation = *find_equation_of_state("kolafa-rottner");
  // physics.md: phi, Z.
  const std::vector<std::pair<double, double>> table{{0.40, 2.1514393}, {0.50, 2.7601235}, {0.60, 3.663691},
                                                     {0.70, 5.082362},  {0.80, 7.476491},  {0.85, 9.245785},
                                                     {0.90, 10.2059}};
  for (const auto& [phi, z] : table) {
    // The fit passes through the simulated points within their errors, some 1e-6 to 1e-5 relative.
    EXPECT_NEAR(equation.compressibility_factor(phi).value / z, 1.0, 1e-5) << phi;
  }
}

TEST(EquationsOfState, DepartFromKolafaRottnerAsStated) {
  const EquationOfState& best = *find_equation_of_state("kolafa-rottner");
  const auto off = [&](const char* name, double nu) {
    return find_equation_of_state(name)->compressibility_factor(nu_to_phi(nu)).value /
               best.compressibility_factor(nu_to_phi(nu)).value -
           1.0;
  };
  for (double nu = 0.01; nu <= 0.63; nu += 0.01) EXPECT_LE(std::abs(off("enskog", nu)), 0.00145) << nu;
  EXPECT_NEAR(off("henderson", 0.55), 0.007, 0.0005);
  for (double nu = 0.01; nu <= 0.66; nu += 0.01) EXPECT_LE(std::abs(off("luding", nu)), 0.003) << nu;
  for (double nu = 0.01; nu <= 0.66; nu += 0.01) EXPECT_LE(std::abs(off("santos-lopez-yuste", nu)), 0.016) << nu;
  // accurate_density: within 1 % up to there.
  for (const EquationOfState* equation : equations_of_state()) {
    const double limit = std::min(equation->accurate_density(), nu_to_phi(0.70));
    for (double phi = 0.005; phi <= limit; phi += 0.005) {
      EXPECT_LE(std::abs(equation->compressibility_factor(phi).value / best.compressibility_factor(phi).value - 1.0),
                0.0101)
          << equation->name() << " " << phi;
    }
  }
}

TEST(EquationsOfState, MatchTheirPrintedForms) {
  const double nu_max = pi / (2.0 * std::sqrt(3.0));
  for (double nu = 0.02; nu < 0.90; nu += 0.02) {
    const double phi = nu_to_phi(nu);
    EXPECT_NEAR(find_equation_of_state("henderson")->compressibility_factor(phi).value,
                (1.0 + nu * nu / 8.0) / ((1.0 - nu) * (1.0 - nu)), 1e-13 / std::pow(1.0 - nu, 3));
    EXPECT_NEAR(find_equation_of_state("percus-yevick")->compressibility_factor(phi).value,
                1.0 / ((1.0 - nu) * (1.0 - nu)), 1e-13 / std::pow(1.0 - nu, 3));
    const double santos = 1.0 / (1.0 - 2.0 * nu + (2.0 * nu_max - 1.0) * nu * nu / (nu_max * nu_max));
    EXPECT_NEAR(find_equation_of_state("santos-lopez-yuste")->compressibility_factor(phi).value / santos, 1.0, 1e-11);
    const double g4 =
        (1.0 - 7.0 * nu / 16.0) / std::pow(1.0 - nu, 2) - std::pow(nu, 3) / (128.0 * std::pow(1.0 - nu, 4));
    const double x = nu_max - nu;
    const double dense = 2.0 * nu_max / x * (1.0 - 0.04 * x + 3.25 * x * x * x);
    const double z4 = 1.0 + 2.0 * nu * g4;
    const double luding = z4 + (dense - z4) / (1.0 + std::exp(-(nu - 0.70) / 0.0111));
    EXPECT_NEAR(find_equation_of_state("luding")->compressibility_factor(phi).value / luding, 1.0, 1e-12);
    if (nu > 0.73) {
      EXPECT_NEAR(best_of().compressibility_factor(phi).value / dense, 1.0, 1e-12);
    }
    if (nu < 0.70) {
      EXPECT_EQ(best_of().compressibility_factor(phi).value,
                find_equation_of_state("kolafa-rottner")->compressibility_factor(phi).value);
    }
  }
}

// Derivatives by Richardson extrapolation of differences.
template <class Function>
double slope(Function&& function, double x, double h) {
  const auto central = [&](double step) { return (function(x + step) - function(x - step)) / (2.0 * step); };
  return (4.0 * central(0.5 * h) - central(h)) / 3.0;
}

TEST(EquationsOfState, StiffnessIsTheSlopeOfThePressureAndOfF) {
  for (const EquationOfState* equation : equations_of_state()) {
    for (double phi = 0.03; phi < std::min(equation->largest_density() - 0.01, 1.14); phi += 0.0371) {
      bool at_break = false;
      for (const double edge : equation->breaks()) at_break = at_break || std::abs(phi - edge) < 0.005;
      if (at_break) continue;
      const double h = 2e-4;
      const double stiffness = equation->stiffness(phi).value;
      const double of_pressure = slope([&](double x) { return equation->pressure(x, 1.0).value; }, phi, h);
      const double of_f = phi * slope([&](double x) { return equation->f(x).value; }, phi, h);
      const double scale = std::abs(stiffness) + 1e-3;
      EXPECT_NEAR(stiffness, of_pressure, 2e-7 * scale) << equation->name() << " " << phi;
      EXPECT_NEAR(stiffness, of_f, 2e-7 * scale) << equation->name() << " " << phi;
    }
  }
}

TEST(EquationsOfState, InverseReturnsTheDensity) {
  for (const EquationOfState* equation : equations_of_state()) {
    double worst = 0.0;
    const double top = equation->largest_invertible_density();
    for (double gap = 1e-6; gap < top; gap *= 1.07) {
      const double phi = top - gap;
      bool in_coexistence = false;
      if (const auto ends = equation->breaks(); ends.size() == 2) in_coexistence = phi > ends[0] && phi <= ends[1];
      if (in_coexistence) continue;
      const Value f = equation->f(phi);
      ASSERT_TRUE(f.ok());
      const Value back = equation->density_from_f(f.value);
      ASSERT_TRUE(back.ok()) << equation->name() << " " << phi;
      // One rounding of f moves phi by f eps/kappa.
      const double allowed = 4e-15 * (1.0 + std::abs(f.value) / equation->stiffness(phi).value);
      worst = std::max(worst, std::abs(back.value / phi - 1.0) / allowed);
    }
    EXPECT_LE(worst, 1.0) << equation->name();
    for (const double phi : {1e-3, 1e-10, 1e-100, 1e-300}) {
      const Value back = equation->density_from_f(equation->f(phi).value);
      ASSERT_TRUE(back.ok());
      EXPECT_NEAR(back.value / phi, 1.0, 3e-13) << equation->name();  // half an ulp of f = -690
    }
  }
}

TEST(EquationsOfState, FIsMonotoneAndItsInverseToo) {
  for (const EquationOfState* equation : equations_of_state()) {
    double last = 0.0;
    const double top = equation->f(std::min(1.15, equation->largest_invertible_density())).value;
    for (double f = -60.0; f < top; f += 0.01) {
      const Value phi = equation->density_from_f(f);
      ASSERT_TRUE(phi.ok()) << equation->name() << " " << f;
      ASSERT_GT(phi.value, last) << equation->name() << " " << f;
      last = phi.value;
    }
  }
}

TEST(EquationsOfState, ScaledPressureIsInverted) {
  for (const EquationOfState* equation : equations_of_state()) {
    for (double phi = 1e-6; phi < std::min(1.15, equation->largest_invertible_density()); phi *= 1.1) {
      if (const auto ends = equation->breaks(); ends.size() == 2 && phi > ends[0] && phi < ends[1]) continue;
      const Value p = equation->pressure(phi, 1.0);
      const Value back = equation->density_from_scaled_pressure(p.value);
      ASSERT_TRUE(back.ok()) << equation->name() << " " << phi;
      EXPECT_NEAR(back.value / phi, 1.0, 1e-14) << equation->name() << " " << phi;
    }
  }
  EXPECT_EQ(enskog().density_from_scaled_pressure(1e3).status, ValueStatus::outside_range);
  EXPECT_TRUE(best_of().density_from_scaled_pressure(1e30).ok());
  EXPECT_EQ(enskog().density_from_scaled_pressure(-1.0).status, ValueStatus::invalid_argument);
}

TEST(BestOf, HoldsThePressureAcrossCoexistence) {
  const double freezing = nu_to_phi(0.700);
  const double melting = nu_to_phi(0.716);
  const double p = best_of().pressure(freezing, 1.0).value;
  EXPECT_NEAR(best_of().pressure(melting, 1.0).value / p, 1.0, 1e-14);
  EXPECT_NEAR(p, 9.185, 0.02);  // the coexistence pressure of hard disks, P D^2/T [Engel2013]
  EXPECT_NEAR(best_of().f(freezing).value, best_of().f(melting).value, 1e-13);
  EXPECT_NEAR(best_of().density_from_f(best_of().f(melting).value).value, freezing, 1e-9);
}

TEST(EquationsOfState, GiveAStatusWhereThereIsNoNumber) {
  for (const EquationOfState* equation : equations_of_state()) {
    for (const double phi : {-0.1, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(equation->compressibility_factor(phi).status, ValueStatus::invalid_argument);
      EXPECT_EQ(equation->f(phi).status, ValueStatus::invalid_argument);
      EXPECT_EQ(equation->pressure(phi, 1.0).status, ValueStatus::invalid_argument);
    }
    EXPECT_EQ(equation->compressibility_factor(1.2).status, ValueStatus::outside_range);
    EXPECT_EQ(equation->compressibility_factor(1.2).value, 0.0);
    EXPECT_EQ(equation->density_from_f(std::numeric_limits<double>::quiet_NaN()).status, ValueStatus::invalid_argument);
    EXPECT_EQ(equation->compressibility_factor(0.0).value, 1.0);
    // A gas without disks: an ideal one, whose ln phi has a pole.
    EXPECT_EQ(equation->stiffness(0.0).value, 1.0);
    EXPECT_EQ(equation->f(0.0).status, ValueStatus::pole);
    EXPECT_EQ(equation->pressure(0.0, 2.0).value, 0.0);
    EXPECT_EQ(equation->density_from_scaled_pressure(0.0).value, 0.0);
    EXPECT_TRUE(equation->density_from_scaled_pressure(0.0).ok());
    for (const double number :
         {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(equation->pressure(0.5, number).status, ValueStatus::invalid_argument);
      EXPECT_EQ(equation->density_from_scaled_pressure(number).status, ValueStatus::invalid_argument);
    }
    EXPECT_EQ(equation->pressure(0.5, 0.0).value, 0.0);
    EXPECT_TRUE(equation->pressure(0.5, 0.0).ok());
    EXPECT_EQ(equation->contact_value(1.2).status, ValueStatus::outside_range);
    EXPECT_EQ(equation->stiffness(-0.1).status, ValueStatus::invalid_argument);
  }
  EXPECT_EQ(find_equation_of_state("santos-lopez-yuste")->compressibility_factor(close_packing_density).status,
            ValueStatus::pole);
  EXPECT_EQ(find_equation_of_state("luding")->compressibility_factor(close_packing_density).status, ValueStatus::pole);
  EXPECT_EQ(best_of().compressibility_factor(close_packing_density).status, ValueStatus::pole);
  EXPECT_EQ(find_equation_of_state("kolafa-rottner")->compressibility_factor(close_packing_density).status,
            ValueStatus::outside_range);
}

}  // namespace
}  // namespace shakebed::fit
