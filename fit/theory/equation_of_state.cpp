#include "fit/theory/equation_of_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "fit/theory/inverse_table.hpp"
#include "fit/theory/quadrature.hpp"

namespace shakebed::fit {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double per_density = pi / 4.0;  // nu = (pi/4) phi
constexpr double nu_max = close_packing_area_fraction;
// The forms with a pole are tabulated up to here; beyond, the density differs from close packing by less than 1e-12.
constexpr double just_below_close_packing = close_packing_density * (1.0 - 1e-12);

// 2/sqrt 3 can be computed in ways that differ in the last digits; they all mean close packing.
bool is_at(double density, double limit) { return std::abs(density - limit) <= 4e-16 * limit; }

template <class Real>
constexpr Real square(Real x) {
  return x * x;
}

// The forms below are written once for double, in which they are evaluated, and for extended precision, in which the
// tables of their inverses are built.
using Extended = long double;
template <class Real>
constexpr Real pi_of = std::numbers::pi_v<Real>;
template <class Real>
constexpr Real area_of = pi_of<Real> / 4;  // nu = (pi/4) phi
template <class Real>
constexpr Real nu_max_of = Real(0.906899682117108925297039128820778773L);
template <class Real>
constexpr Real close_packing_of = Real(1.15470053837925152901829756100391491L);

}  // namespace

double area_fraction(double number_density) { return per_density * number_density; }
double number_density(double area_fraction) { return area_fraction / per_density; }

// --- what all rows share -----------------------------------------------------------------------------------------

Value EquationOfState::compressibility_factor(double number_density) const {
  if (!std::isfinite(number_density) || number_density < 0.0) return no_value(ValueStatus::invalid_argument);
  if (number_density == 0.0) return {1.0};
  if (has_pole() && is_at(number_density, largest_density())) return no_value(ValueStatus::pole);
  if (number_density > largest_density() && !is_at(number_density, largest_density()))
    return no_value(ValueStatus::outside_range);
  return {local(number_density).compressibility_factor};
}

Value EquationOfState::contact_value(double number_density) const {
  if (number_density == 0.0) return {1.0};
  const Value z = compressibility_factor(number_density);
  if (!z.ok()) return z;
  return {pair_function(number_density)};
}

double EquationOfState::pair_function(double number_density) const {
  return (local(number_density).compressibility_factor - 1.0) / (0.5 * pi * number_density);
}

Value EquationOfState::pressure(double number_density, double temperature) const {
  if (!std::isfinite(temperature) || temperature < 0.0) return no_value(ValueStatus::invalid_argument);
  const Value z = compressibility_factor(number_density);
  if (!z.ok()) return z;
  return {temperature * number_density * z.value};
}

Value EquationOfState::stiffness(double number_density) const {
  if (number_density == 0.0) return {1.0};
  const Value z = compressibility_factor(number_density);
  if (!z.ok()) return z;
  return {local(number_density).stiffness};
}

Value EquationOfState::f(double number_density) const {
  if (number_density == 0.0) return no_value(ValueStatus::pole);  // ln 0
  const Value z = compressibility_factor(number_density);
  if (!z.ok()) return z;
  return {reduced_f(number_density)};
}

double EquationOfState::reduced_f(double number_density) const {
  return std::log(number_density) + (f_constant() + excess(number_density));
}

const InverseTable& EquationOfState::inverse_table() const {
  std::call_once(table_->built, [this] { table_->table = InverseTable(pieces()); });
  return table_->table;
}

std::vector<InverseTable::Piece> EquationOfState::pieces() const {
  return {piece(0.0L, static_cast<long double>(largest_invertible_density()))};
}

InverseTable::Piece EquationOfState::piece(long double lowest, long double highest) const {
  return {lowest, highest, [this](long double phi) { return std::log(phi) + extended_excess(phi); },
          [this](double phi) { return local(phi).stiffness; }};
}

// F = f - K is kept in two doubles, because one rounding of F is 500 units in the last place of phi at 1e-300.
double EquationOfState::invert(const InverseTable& table, double f) const {
  const double high = f - row_.f_constant;
  const double back = high - f;
  const double low = ((f - (high - back)) - (row_.f_constant + back)) - row_.f_constant_low;
  if (high < InverseTable::lowest_f) return std::exp(high) * (1.0 + low);
  return std::min(table.density(std::min(high, table.largest_f()), low), row_.largest_invertible_density);
}

// A few roundings of f above the end are the end. A form with a pole reaches every f.
double EquationOfState::largest_f(const InverseTable& table) const {
  if (has_pole()) return std::numeric_limits<double>::max();
  const double largest = table.largest_f() + row_.f_constant;
  return largest + 4e-15 * std::abs(largest);
}

Value EquationOfState::density_from_f(double f) const {
  if (std::isnan(f)) return no_value(ValueStatus::invalid_argument);
  const InverseTable& table = inverse_table();
  if (f > largest_f(table)) return no_value(ValueStatus::outside_range);
  return {invert(table, f)};
}

ValueStatus EquationOfState::densities_from_f(std::span<const double> f, std::span<double> out) const {
  const InverseTable& table = inverse_table();
  const double largest = largest_f(table);
  ValueStatus first = ValueStatus::ok;
  const std::size_t count = std::min(f.size(), out.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (f[i] <= largest) {
      out[i] = invert(table, f[i]);
    } else {
      out[i] = 0.0;
      if (first == ValueStatus::ok) {
        first = std::isnan(f[i]) ? ValueStatus::invalid_argument : ValueStatus::outside_range;
      }
    }
  }
  return first;
}

Value EquationOfState::density_from_scaled_pressure(double scaled_pressure) const {
  if (!std::isfinite(scaled_pressure) || scaled_pressure < 0.0) return no_value(ValueStatus::invalid_argument);
  if (scaled_pressure == 0.0) return {0.0};
  const double largest = largest_invertible_density();
  const auto scaled = [&](double density) { return density * local(density).compressibility_factor; };
  if (scaled_pressure > scaled(largest)) {
    // Nothing above the last density of a form that ends; all the rest of the pressures of a form with a pole.
    return has_pole() ? Value{largest} : no_value(ValueStatus::outside_range);
  }
  // Newton in ln phi inside a bracket; phi <= p because Z >= 1.
  double low = 0.0;
  double high = std::min(scaled_pressure, largest);
  double density = std::min(high, 0.5 * largest);
  for (int iteration = 0; iteration < 400; ++iteration) {
    const Local here = local(density);
    const double ratio = density * here.compressibility_factor / scaled_pressure;
    if (ratio >= 1.0) {
      high = density;
    } else {
      low = density;
    }
    double next = density * (1.0 - std::log(ratio) * here.compressibility_factor / here.stiffness);
    if (std::abs(next - density) <= 2e-16 * density) return {density};
    if (!(next > low && next < high)) next = low > 0.0 ? 0.5 * (low + high) : std::max(0.25 * high, 1e-3 * density);
    density = next;
  }
  return {density};
}

namespace {

// --- Enskog with the Ree-Hoover pair function ----------------------------------------------------------------------

// [Hong1999], the pair function of [ReeHoover1967]: chi = (1 - a1 phi + a2 phi^2)/(1 - a phi)^2.
constexpr double enskog_a = 0.489351 * pi / 2.0;
constexpr double enskog_a1 = 0.196703 * pi / 2.0;
constexpr double enskog_a2 = 0.006519 * (pi / 2.0) * (pi / 2.0);
// f(phi) = ln phi + c1 phi + c2 ln(1 - a phi) + c3/(1 - a phi) + c4/(1 - a phi)^2. The paper prints c4 times a; it is
// divided by a.
constexpr double enskog_c1 = pi * enskog_a2 / (enskog_a * enskog_a);
constexpr double enskog_c2 = -(pi / 2.0) * (enskog_a1 - 2.0 * enskog_a2 / enskog_a) / (enskog_a * enskog_a);
constexpr double enskog_c3 = -enskog_c2;
constexpr double enskog_c4 = (pi / 2.0) * (1.0 - enskog_a1 / enskog_a + enskog_a2 / (enskog_a * enskog_a)) / enskog_a;
// K = c3 + c4 = 1.98789160931468404952788126879..., as an unevaluated sum of two doubles.
constexpr double enskog_k = 0x1.fce676e9ffd73p+0;
constexpr double enskog_k_low = -0x1.326ba350fa0a4p-54;

class Enskog final : public EquationOfState {
 public:
  Enskog()
      : EquationOfState({"enskog", "Enskog with the Ree-Hoover pair function", "Hong1999",
                         "fluid branch; within 0.15 % of Kolafa-Rottner up to area fraction 0.65, 1 % to 0.67", 0.852,
                         close_packing_density, close_packing_density, false, enskog_k, enskog_k_low}) {}

  Local local(double phi) const override {
    const double numerator = 1.0 - enskog_a1 * phi + enskog_a2 * phi * phi;
    const double denominator = 1.0 - enskog_a * phi;
    const double inverse = 1.0 / denominator;
    const double chi = numerator * inverse * inverse;
    const double chi_slope =
        ((2.0 * enskog_a2 * phi - enskog_a1) + 2.0 * enskog_a * numerator * inverse) * inverse * inverse;
    const double z = 1.0 + 0.5 * pi * phi * chi;
    return {z, z + 0.5 * pi * phi * (chi + phi * chi_slope)};
  }

  // All three terms are positive: nothing cancels.
  double excess(double phi) const override {
    const double u = enskog_a * phi / (1.0 - enskog_a * phi);
    return enskog_c1 * phi + enskog_c3 * (u + std::log1p(u)) + enskog_c4 * u * (2.0 + u);
  }

  double pair_function(double phi) const override {
    return (1.0 - enskog_a1 * phi + enskog_a2 * phi * phi) / square(1.0 - enskog_a * phi);
  }

 protected:
  long double extended_excess(long double phi) const override {
    constexpr Extended half_pi = pi_of<Extended> / 2;
    constexpr Extended a = 0.489351L * half_pi, a1 = 0.196703L * half_pi, a2 = 0.006519L * half_pi * half_pi;
    constexpr Extended c1 = 2 * half_pi * a2 / (a * a), c3 = half_pi * (a1 - 2 * a2 / a) / (a * a),
                       c4 = half_pi * (1 - a1 / a + a2 / (a * a)) / a;
    const Extended u = a * phi / (1 - a * phi);
    return c1 * phi + c3 * (u + std::log1p(u)) + c4 * u * (2 + u);
  }
};

// --- closed forms of the fluid --------------------------------------------------------------------------------------

// [Henderson1975]: Z = (1 + eta^2/8)/(1 - eta)^2.
class Henderson final : public EquationOfState {
 public:
  Henderson()
      : EquationOfState({"henderson", "Henderson", "Henderson1975",
                         "fluid branch; +0.7 % at area fraction 0.55, 1 % at 0.58", 0.738, close_packing_density,
                         close_packing_density, false, 0.0}) {}
  Local local(double phi) const override {
    const double eta = per_density * phi;
    const double inverse = 1.0 / (1.0 - eta);
    const double numerator = 1.0 + eta * eta / 8.0;
    const double z = numerator * inverse * inverse;
    const double slope = (eta / 4.0 + 2.0 * numerator * inverse) * inverse * inverse;  // dZ/deta
    return {z, z + eta * slope};
  }
  double pair_function(double phi) const override {
    const double eta = per_density * phi;
    return (1.0 - 0.4375 * eta) / square(1.0 - eta);
  }
  double excess(double phi) const override { return excess_of(phi); }

 protected:
  long double extended_excess(long double phi) const override { return excess_of(phi); }

 private:
  template <class Real>
  static Real excess_of(Real phi) {
    const Real eta = area_of<Real> * phi;
    const Real one = 1 - eta;
    const Real z_minus_one = eta * (2 - Real(0.875) * eta) / square(one);
    return z_minus_one + Real(1.125) * eta / one - Real(0.875) * std::log1p(-eta);
  }
};

// [SantosLopezYuste1995]: Z = 1/(1 - 2 eta + (2 nu_max - 1) eta^2/nu_max^2) = 1/((1 - eta/nu_max)(1 - b eta)),
// b = 2 - 1/nu_max.
class SantosLopezYuste final : public EquationOfState {
 public:
  SantosLopezYuste()
      : EquationOfState({"santos-lopez-yuste", "Santos, Lopez de Haro and Yuste", "SantosLopezYuste1995",
                         "fluid branch; within 1.6 % up to area fraction 0.66; pole at close packing", 0.407,
                         close_packing_density, just_below_close_packing, true, 0.0}) {}
  Local local(double phi) const override {
    const double eta = per_density * phi;
    const double z = 1.0 / ((1.0 - phi / close_packing_density) * (1.0 - b * eta));
    return {z, z + eta * z * z * (2.0 - 2.0 * b * eta / nu_max)};
  }
  double pair_function(double phi) const override {
    const double eta = per_density * phi;
    return (1.0 - 0.5 * b * eta / nu_max) / ((1.0 - phi / close_packing_density) * (1.0 - b * eta));
  }
  double excess(double phi) const override { return excess_of(phi); }

 protected:
  long double extended_excess(long double phi) const override { return excess_of(phi); }

 private:
  template <class Real>
  static Real excess_of(Real phi) {
    constexpr Real densest = nu_max_of<Real>, slope = 2 - 1 / densest;
    const Real eta = area_of<Real> * phi;
    const Real far = 1 - phi / close_packing_of<Real>;
    const Real z_minus_one = eta * (2 - slope * eta / densest) / (far * (1 - slope * eta));
    // (Z - 1)/eta = A/(1 - eta/nu_max) + B/(1 - b eta).
    constexpr Real a = 1 / (2 * densest * (1 - densest));
    return z_minus_one - a * densest * std::log1p(-phi / close_packing_of<Real>) -
           (2 - a) / slope * std::log1p(-slope * eta);
  }
  static constexpr double b = 2.0 - 1.0 / nu_max;
};

// [Helfand1961], scaled particle theory, the Percus-Yevick compressibility form in 2D: Z = 1/(1 - eta)^2.
class PercusYevick final : public EquationOfState {
 public:
  PercusYevick()
      : EquationOfState({"percus-yevick", "Percus-Yevick (scaled particle)", "Helfand1961",
                         "fluid branch; within 1 % up to area fraction 0.28, -3 % at 0.6", 0.357, close_packing_density,
                         close_packing_density, false, 0.0}) {}
  Local local(double phi) const override {
    const double eta = per_density * phi;
    const double inverse = 1.0 / (1.0 - eta);
    const double z = inverse * inverse;
    return {z, z * (1.0 + 2.0 * eta * inverse)};
  }
  double pair_function(double phi) const override {
    const double eta = per_density * phi;
    return (1.0 - 0.5 * eta) / square(1.0 - eta);
  }
  double excess(double phi) const override { return excess_of(phi); }

 protected:
  long double extended_excess(long double phi) const override { return excess_of(phi); }

 private:
  template <class Real>
  static Real excess_of(Real phi) {
    const Real eta = area_of<Real> * phi;
    const Real one = 1 - eta;
    return eta * (2 - eta) / square(one) + eta / one - std::log1p(-eta);
  }
};

// --- Kolafa and Rottner
// -----------------------------------------------------------------------------------------------

// [KolafaRottner2006]: Z = sum A_i y^i, y = eta/(1 - eta).
template <class Real>
struct KolafaRottnerForm {
  static constexpr std::array<Real, 13> low{Real(1.0L),           Real(2.0L),
                                            Real(1.12801775L),    Real(0.00181895291L),
                                            Real(-0.0526134737L), Real(0.0504960168L),
                                            Real(-0.0325537792L), Real(0.0134578632L),
                                            Real(0.00140888182L), Real(-0.00834273601L),
                                            Real(0.00694127367L), Real(-0.00262254723L),
                                            Real(0.000355746352L)};
  static constexpr Real a22 = Real(-5.24672938e-9L);
  static constexpr Real a57 = Real(5.88054639e-23L);

  // (Z - 1)/y = sum_{i>=1} A_i y^(i-1) = Q(y) (1 + y) + R, for integral (Z - 1)/(y (1 + y)) dy = integral Q + R ln(1 +
  // y).
  std::array<Real, 56> quotient_integral{};  // of y^1 .. y^56
  Real remainder = 0;

  KolafaRottnerForm() {
    std::array<Extended, 57> coefficient{};
    for (std::size_t i = 1; i < low.size(); ++i) coefficient[i - 1] = KolafaRottnerForm<Extended>::low[i];
    coefficient[21] = KolafaRottnerForm<Extended>::a22;
    coefficient[56] = KolafaRottnerForm<Extended>::a57;
    Extended carry = coefficient[56];
    for (std::size_t i = 56; i-- > 0;) {
      quotient_integral[i] = static_cast<Real>(carry / static_cast<Extended>(i + 1));
      carry = coefficient[i] - carry;
    }
    remainder = static_cast<Real>(carry);
  }

  static EquationOfState::Local local(double phi) {
    const double eta = per_density * phi;
    const double inverse = 1.0 / (1.0 - eta);
    const double y = eta * inverse;
    double z = 0.0;
    double slope = 0.0;
    for (std::size_t i = low.size(); i-- > 0;) {
      slope = slope * y + z;
      z = z * y + low[i];
    }
    const double y2 = y * y;
    const double y4 = y2 * y2;
    const double y21 = y4 * y4 * y4 * y4 * y4 * y;
    const double y56 = y21 * y21 * y4 * y4 * y4 * y2;
    z += (a22 * y21 + a57 * y56) * y;
    slope += 22.0 * a22 * y21 + 57.0 * a57 * y56;
    return {z, z + y * inverse * slope};  // eta dy/deta = eta/(1 - eta)^2
  }

  static Real compressibility_factor_minus_one(Real y) {
    Real sum = 0;
    for (std::size_t i = low.size(); i-- > 1;) sum = (sum + low[i]) * y;
    const Real y2 = y * y;
    const Real y4 = y2 * y2;
    const Real y22 = y4 * y4 * y4 * y4 * y4 * y2;
    return sum + a22 * y22 + a57 * y22 * y22 * y4 * y4 * y4 * y;
  }

  Real excess(Real phi) const {
    const Real eta = area_of<Real> * phi;
    const Real y = eta / (1 - eta);
    Real integral = 0;
    for (std::size_t i = quotient_integral.size(); i-- > 0;) integral = (integral + quotient_integral[i]) * y;
    return compressibility_factor_minus_one(y) + integral + remainder * std::log1p(y);
  }
};

template <class Real>
const KolafaRottnerForm<Real>& kolafa_rottner_form() {
  static const KolafaRottnerForm<Real> form;
  return form;
}

// chi of the fluid form, without the cancellation of Z - 1 at low density.
double kolafa_rottner_pair_function(double phi) {
  const double y = per_density * phi / (1.0 - per_density * phi);
  double sum = 0.0;  // (Z - 1)/y
  using Form = KolafaRottnerForm<double>;
  for (std::size_t i = Form::low.size(); i-- > 1;) sum = sum * y + Form::low[i];
  sum += Form::a22 * std::pow(y, 21) + Form::a57 * std::pow(y, 56);
  return 0.5 * sum / (1.0 - per_density * phi);
}

class KolafaRottner final : public EquationOfState {
 public:
  KolafaRottner()
      : EquationOfState({"kolafa-rottner", "Kolafa and Rottner", "KolafaRottner2006",
                         "fluid branch to freezing (area fraction 0.70); an unphysical loop inside the transition, no "
                         "value above phi = 0.90",
                         freezing_area_fraction / per_density, 0.90, freezing_area_fraction / per_density, false,
                         0.0}) {}
  Local local(double phi) const override { return KolafaRottnerForm<double>::local(phi); }
  double pair_function(double phi) const override { return kolafa_rottner_pair_function(phi); }
  double excess(double phi) const override { return kolafa_rottner_form<double>().excess(phi); }

 protected:
  long double extended_excess(long double phi) const override { return kolafa_rottner_form<Extended>().excess(phi); }
};

// --- the dense branch
// --------------------------------------------------------------------------------------------------

// [Luding2001]: Z_dense = (2 nu_max/x)(1 - 0.04 x + 3.25 x^3), x = nu_max - nu.
struct DenseForm {
  static double gap(double phi) { return per_density * (close_packing_density - phi); }
  static EquationOfState::Local local(double phi) {
    const double x = gap(phi);
    const double z = 2.0 * nu_max * (1.0 / x - 0.04 + 3.25 * x * x);
    const double slope = 2.0 * nu_max * (1.0 / (x * x) - 6.5 * x);  // dZ/dnu
    return {z, z + per_density * phi * slope};
  }
  template <class Real>
  static Real compressibility_factor(Real phi) {
    const Real x = area_of<Real> * (close_packing_of<Real> - phi);
    return 2 * nu_max_of<Real> * (1 / x - Real(0.04L) + Real(3.25L) * x * x);
  }
  // Z + integral (Z/nu) dnu, up to a constant: F along the branch.
  template <class Real>
  static Real f(Real phi) {
    constexpr Real densest = nu_max_of<Real>;
    const Real x = area_of<Real> * (close_packing_of<Real> - phi);
    const Real log_nu = std::log(area_of<Real> * phi);
    return compressibility_factor(phi) - 2 * std::log(x) + 2 * log_nu - Real(0.08L) * densest * log_nu +
           Real(6.5L) * densest * (x * x / 2 + densest * x + densest * densest * log_nu);
  }
};

// [Luding2001], global: the fluid form Z4 blended into the dense one over the transition.
class Luding final : public EquationOfState {
 public:
  Luding()
      : EquationOfState({"luding", "Luding, global", "Luding2001",
                         "fluid, transition and solid; within 0.3 % up to area fraction 0.67, 1.7 % in the transition; "
                         "pole at close packing",
                         0.866, close_packing_density, just_below_close_packing, true, 0.0}) {
    // integral (Z - 1)/phi dphi up to the edges of panels: even below the transition, fine across it (the blend has
    // poles 0.035 in nu off the axis), and halving the gap on the way to close packing.
    for (int i = 0; i <= 24; ++i) edges_.push_back(0.60 * i / 24.0 / per_density);
    for (int i = 1; i <= 32; ++i) edges_.push_back((0.60 + 0.20 * i / 32.0) / per_density);
    for (double gap = close_packing_density - edges_.back(); gap > 1e-13;) {
      gap *= 0.7;
      edges_.push_back(close_packing_density - gap);
    }
    sums_.push_back(0.0L);
    for (std::size_t i = 1; i < edges_.size(); ++i) {
      sums_.push_back(sums_.back() +
                      integrate_panel<16>(Extended(edges_[i - 1]), Extended(edges_[i]), integrand<Extended>));
    }
  }
  Local local(double phi) const override {
    const double nu = per_density * phi;
    const double inverse = 1.0 / (1.0 - nu);
    const double inverse2 = inverse * inverse;
    const double g4 = (1.0 - 7.0 * nu / 16.0) * inverse2 - nu * nu * nu / 128.0 * inverse2 * inverse2;
    const double g4_slope = -7.0 / 16.0 * inverse2 + 2.0 * (1.0 - 7.0 * nu / 16.0) * inverse2 * inverse -
                            3.0 * nu * nu / 128.0 * inverse2 * inverse2 -
                            4.0 * nu * nu * nu / 128.0 * inverse2 * inverse2 * inverse;
    const double z4 = 1.0 + 2.0 * nu * g4;
    const double z4_slope = 2.0 * (g4 + nu * g4_slope);
    const double e = std::exp(-(nu - 0.70) / 0.0111);
    const double weight = 1.0 / (1.0 + e);
    const double weight_slope = weight * weight * e / 0.0111;
    const double x = DenseForm::gap(phi);
    const double dense = 2.0 * nu_max * (1.0 / x - 0.04 + 3.25 * x * x);
    const double dense_slope = 2.0 * nu_max * (1.0 / (x * x) - 6.5 * x);
    const double z = z4 + weight * (dense - z4);
    const double slope = z4_slope + weight * (dense_slope - z4_slope) + weight_slope * (dense - z4);
    return {z, z + nu * slope};
  }
  double pair_function(double phi) const override { return integrand(phi) / (0.5 * pi); }
  double excess(double phi) const override { return excess_of(phi); }
  // In the middle of the blend the stiffness falls to a quarter: its zeros, branch points of phi(F), are 0.15 in F
  // away.
  Steep steep() const override {
    constexpr double softest = 0.704 / per_density;
    return {std::log(softest) + excess(softest), 0.1};
  }

 protected:
  long double extended_excess(long double phi) const override { return excess_of(phi); }

 private:
  template <class Real>
  Real excess_of(Real phi) const {
    const auto edge = static_cast<std::size_t>(
        std::max<std::ptrdiff_t>(
            std::upper_bound(edges_.begin(), edges_.end(), static_cast<double>(phi)) - edges_.begin(), 1) -
        1);
    const Real partial = integrate_panel<12>(Real(edges_[edge]), phi, integrand<Real>);
    return phi * integrand(phi) + (static_cast<Real>(sums_[edge]) + partial);
  }
  // (Z - 1)/phi
  template <class Real>
  static Real integrand(Real phi) {
    const Real nu = area_of<Real> * phi;
    const Real inverse2 = 1 / square(1 - nu);
    const Real g4 = (1 - 7 * nu / 16) * inverse2 - nu * nu * nu / 128 * inverse2 * inverse2;
    // Below, the weight of the dense form is less than 3e-20.
    if (nu < Real(0.2)) return pi_of<Real> / 2 * g4;
    const Real weight = 1 / (1 + std::exp(-(nu - Real(0.70L)) / Real(0.0111L)));
    return (1 - weight) * pi_of<Real> / 2 * g4 + weight * (DenseForm::compressibility_factor(phi) - 1) / phi;
  }
  std::vector<double> edges_;
  std::vector<Extended> sums_;
};

// Kolafa-Rottner up to freezing at nu = 0.700, its pressure there held across the transition, then the dense branch of
// Luding from where it has that pressure. True disks coexist from 0.700 to 0.716 and the hexatic above is nearly flat
// [Bernard2011] [Engel2013]; the dense branch meets the coexistence pressure at 0.7227.
class BestOf final : public EquationOfState {
 public:
  BestOf()
      : EquationOfState({"best-of", "Kolafa-Rottner, coexistence, Luding's dense branch", "KolafaRottner2006",
                         "fluid, coexistence and solid; pole at close packing", 1.15, close_packing_density,
                         just_below_close_packing, true, 0.0}) {
    const KolafaRottnerForm<Extended>& fluid = kolafa_rottner_form<Extended>();
    constexpr Extended nu = 0.700L;
    freezing_ = nu / area_of<Extended>;
    const Extended pressure = freezing_ * (1 + fluid.compressibility_factor_minus_one(nu / (1 - nu)));
    Extended below = 0.716L / area_of<Extended>;
    Extended above = 0.75L / area_of<Extended>;
    for (int i = 0; i < 100; ++i) {
      const Extended middle = (below + above) / 2;
      (middle * DenseForm::compressibility_factor(middle) < pressure ? below : above) = middle;
    }
    melting_ = above;
    scaled_pressure_ = static_cast<double>(pressure);
    breaks_ = {static_cast<double>(freezing_), static_cast<double>(melting_)};
    f_coexistence_ = std::log(freezing_) + fluid.excess(freezing_);
    dense_offset_ = f_coexistence_ - DenseForm::f(melting_);
  }
  Local local(double phi) const override {
    if (phi <= breaks_[0]) return KolafaRottnerForm<double>::local(phi);
    if (phi < breaks_[1]) return {scaled_pressure_ / phi, 0.0};
    return DenseForm::local(phi);
  }
  double excess(double phi) const override {
    if (phi <= breaks_[0]) return kolafa_rottner_form<double>().excess(phi);
    if (phi < breaks_[1]) return static_cast<double>(f_coexistence_) - std::log(phi);
    return DenseForm::f(phi) + static_cast<double>(dense_offset_) - std::log(phi);
  }
  double pair_function(double phi) const override {
    return phi <= breaks_[0] ? kolafa_rottner_pair_function(phi) : EquationOfState::pair_function(phi);
  }
  std::span<const double> breaks() const override { return breaks_; }
  std::vector<InverseTable::Piece> pieces() const override {
    return {piece(0.0L, freezing_), piece(melting_, static_cast<Extended>(largest_invertible_density()))};
  }

 protected:
  // One and the same number across the coexistence: its inverse is the fluid's density.
  double reduced_f(double phi) const override {
    const auto coexistence = static_cast<double>(f_coexistence_);
    if (phi > breaks_[0] && phi < breaks_[1]) return coexistence;
    const double f = EquationOfState::reduced_f(phi);
    return phi <= breaks_[0] ? std::min(f, coexistence) : std::max(f, coexistence);
  }
  long double extended_excess(long double phi) const override {
    if (phi <= freezing_) return kolafa_rottner_form<Extended>().excess(phi);
    return DenseForm::f(phi) + dense_offset_ - std::log(phi);
  }

 private:
  std::array<double, 2> breaks_{};
  double scaled_pressure_ = 0.0;
  Extended freezing_ = 0.0L, melting_ = 0.0L, f_coexistence_ = 0.0L, dense_offset_ = 0.0L;
};

}  // namespace

std::span<const EquationOfState* const> equations_of_state() {
  static const Enskog enskog_row;
  static const Henderson henderson;
  static const SantosLopezYuste santos;
  static const PercusYevick percus_yevick;
  static const KolafaRottner kolafa_rottner;
  static const Luding luding;
  static const BestOf best_of_row;
  static const std::array<const EquationOfState*, 7> rows{&enskog_row,     &henderson, &santos,     &percus_yevick,
                                                          &kolafa_rottner, &luding,    &best_of_row};
  return rows;
}

const EquationOfState* find_equation_of_state(std::string_view name) {
  for (const EquationOfState* equation : equations_of_state()) {
    if (equation->name() == name) return equation;
  }
  return nullptr;
}

std::string equation_names() {
  std::string names;
  for (const EquationOfState* equation : equations_of_state()) {
    if (!names.empty()) names += ", ";
    names += equation->name();
  }
  return names;
}

const EquationOfState& enskog() { return *equations_of_state().front(); }
const EquationOfState& best_of() { return *equations_of_state().back(); }

EnskogConstants enskog_constants() {
  return {enskog_a, enskog_a1, enskog_a2, enskog_c1, enskog_c2, enskog_c3, enskog_c4};
}

}  // namespace shakebed::fit
