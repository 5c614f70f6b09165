#include "fit/equation_of_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <vector>

#include "fit/inverse_table.hpp"
#include "fit/quadrature.hpp"

namespace shakebed::fit {

namespace {

constexpr double pi = std::numbers::pi;
constexpr double per_density = pi / 4.0;  // nu = (pi/4) phi
constexpr double nu_max = close_packing_area_fraction;
// The forms with a pole are tabulated up to here; beyond, the density differs from close packing by less than 1e-12.
constexpr double just_below_close_packing = close_packing_density * (1.0 - 1e-12);

// 2/sqrt 3 can be computed in ways that differ in the last digits; they all mean close packing.
bool is_at(double density, double limit) { return std::abs(density - limit) <= 4e-16 * limit; }

constexpr double square(double x) { return x * x; }

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
  return {std::log(number_density) + (f_constant() + excess(number_density))};
}

Value EquationOfState::density_from_f(double f) const {
  if (std::isnan(f)) return no_value(ValueStatus::invalid_argument);
  if (f == -std::numeric_limits<double>::infinity()) return {0.0};
  // A few roundings of f above the end are the end.
  if (f > largest_f() + 4e-15 * std::abs(f)) return no_value(ValueStatus::outside_range);
  return {std::min(invert_f(std::min(f, largest_f())), largest_invertible_density())};
}

ValueStatus EquationOfState::densities_from_f(std::span<const double> f, std::span<double> out) const {
  ValueStatus first = ValueStatus::ok;
  const std::size_t count = std::min(f.size(), out.size());
  for (std::size_t i = 0; i < count; ++i) {
    const Value density = density_from_f(f[i]);
    out[i] = density.value;
    if (!density.ok() && first == ValueStatus::ok) first = density.status;
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

// Rows that invert by table and one Newton step. The table is built at the first use of the inverse.
class TabulatedEquation : public EquationOfState {
 public:
  const InverseTable& inverse_table() const override {
    std::call_once(built_, [this] { table_ = InverseTable(pieces()); });
    return table_;
  }

 protected:
  using EquationOfState::EquationOfState;

  virtual std::vector<InverseTable::Piece> pieces() const { return {piece(0.0, largest_invertible_density())}; }
  InverseTable::Piece piece(double lowest, double highest, double spacing = 1.0 / 16.0) const {
    return {lowest,
            highest,
            has_pole() ? largest_density() : 0.0,
            spacing,
            [this](double phi) { return std::log(phi) + excess(phi); },
            [this](double phi) { return local(phi).stiffness; }};
  }
  double largest_f() const override {
    return has_pole() ? std::numeric_limits<double>::max() : inverse_table().largest_f() + f_constant();
  }
  double invert_f(double f) const override {
    const double big_f = f - f_constant();
    const InverseTable& table = inverse_table();
    if (big_f >= table.largest_f()) return largest_invertible_density();
    const double guess = table.density(big_f);
    if (big_f < InverseTable::lowest_f) return guess;
    // One Newton step takes away the table's error; more are needed only where the stiffness ends at zero.
    double density = guess;
    for (int step = 0; step < 60; ++step) {
      const double kappa = local(density).stiffness;
      if (!(kappa > 0.0)) break;  // rounded into a coexistence
      const double correction = (big_f - std::log(density) - excess(density)) / kappa;
      if (std::abs(correction) > 1e-2) break;
      density = std::min(density * (1.0 + correction), largest_invertible_density());
      if (std::abs(correction) < 1e-9) return density;
    }
    return density == guess ? guess : std::clamp(density, 0.99 * guess, 1.01 * guess);
  }

 private:
  mutable std::once_flag built_;
  mutable InverseTable table_;
};

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

class Enskog final : public TabulatedEquation {
 public:
  Enskog()
      : TabulatedEquation({"enskog", "Enskog with the Ree-Hoover pair function", "Hong1999",
                           "fluid branch; within 0.15 % of Kolafa-Rottner up to area fraction 0.65, 1 % to 0.67", 0.852,
                           close_packing_density, close_packing_density, false, enskog_k}) {}

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

  ValueStatus densities_from_f(std::span<const double> f, std::span<double> out) const override {
    const InverseTable& table = inverse_table();
    const double largest = largest_f();
    ValueStatus first = ValueStatus::ok;
    const std::size_t count = std::min(f.size(), out.size());
    for (std::size_t i = 0; i < count; ++i) {
      if (f[i] <= largest + 4e-15 * std::abs(f[i])) {
        out[i] = std::min(invert(table, std::min(f[i], largest)), close_packing_density);
      } else {
        out[i] = 0.0;
        if (first == ValueStatus::ok) {
          first = std::isnan(f[i]) ? ValueStatus::invalid_argument : ValueStatus::outside_range;
        }
      }
    }
    return first;
  }

 protected:
  double invert_f(double f) const override { return invert(inverse_table(), f); }

 private:
  // To the last digits of phi, from 1e-300 to 2/sqrt 3. F = f - K is kept in two doubles, because one rounding of F is
  // 500 units in the last place of phi at 1e-300. The last step is taken on E = exp(F - g(phi)), which equals phi at
  // the solution: its rounding errors reach phi divided by kappa >= 1 + g.
  static double invert(const InverseTable& table, double f) {
    const double high = f - enskog_k;
    const double back = high - f;
    const double low = ((f - (high - back)) - (enskog_k + back)) - enskog_k_low;
    if (high < InverseTable::lowest_f) return std::exp(high) * (1.0 + low);
    const double guess = table.density(std::min(high, table.largest_f()));
    const double inverse = 1.0 / (1.0 - enskog_a * guess);
    const double u = enskog_a * guess * inverse;
    // ln(1 + u) to an absolute error is enough here, and faster than log1p.
    const double g = enskog_c1 * guess + enskog_c3 * (u + std::log(1.0 + u)) + enskog_c4 * u * (2.0 + u);
    const double difference = high - g;
    const double carry = difference - high;
    const double difference_low = ((high - (difference - carry)) - (g + carry)) + low;
    const double e = std::exp(difference);
    const double numerator = 1.0 - enskog_a1 * guess + enskog_a2 * guess * guess;
    const double chi = numerator * inverse * inverse;
    const double chi_slope =
        ((2.0 * enskog_a2 * guess - enskog_a1) + 2.0 * enskog_a * numerator * inverse) * inverse * inverse;
    const double kappa = 1.0 + 0.5 * pi * guess * (2.0 * chi + guess * chi_slope);
    // ln(E/phi) = (E - phi)/phi: the table leaves 1e-11, whose square is nothing.
    return guess + ((e - guess) + e * difference_low) / kappa;
  }
};

// --- closed forms of the fluid --------------------------------------------------------------------------------------

// [Henderson1975]: Z = (1 + eta^2/8)/(1 - eta)^2.
class Henderson final : public TabulatedEquation {
 public:
  Henderson()
      : TabulatedEquation({"henderson", "Henderson", "Henderson1975",
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
  double excess(double phi) const override {
    const double eta = per_density * phi;
    const double one = 1.0 - eta;
    const double z_minus_one = eta * (2.0 - 0.875 * eta) / square(one);
    return z_minus_one + 1.125 * eta / one - 0.875 * std::log1p(-eta);
  }
};

// [SantosLopezYuste1995]: Z = 1/(1 - 2 eta + (2 nu_max - 1) eta^2/nu_max^2) = 1/((1 - eta/nu_max)(1 - b eta)),
// b = 2 - 1/nu_max.
class SantosLopezYuste final : public TabulatedEquation {
 public:
  SantosLopezYuste()
      : TabulatedEquation({"santos-lopez-yuste", "Santos, Lopez de Haro and Yuste", "SantosLopezYuste1995",
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
  double excess(double phi) const override {
    const double eta = per_density * phi;
    const double far = 1.0 - phi / close_packing_density;
    const double z_minus_one = eta * (2.0 - b * eta / nu_max) / (far * (1.0 - b * eta));
    // (Z - 1)/eta = A/(1 - eta/nu_max) + B/(1 - b eta).
    constexpr double a = 1.0 / (2.0 * nu_max * (1.0 - nu_max));
    return z_minus_one - a * nu_max * std::log1p(-phi / close_packing_density) - (2.0 - a) / b * std::log1p(-b * eta);
  }

 private:
  static constexpr double b = 2.0 - 1.0 / nu_max;
};

// [Helfand1961], scaled particle theory, the Percus-Yevick compressibility form in 2D: Z = 1/(1 - eta)^2.
class PercusYevick final : public TabulatedEquation {
 public:
  PercusYevick()
      : TabulatedEquation({"percus-yevick", "Percus-Yevick (scaled particle)", "Helfand1961",
                           "fluid branch; within 1 % up to area fraction 0.28, -3 % at 0.6", 0.357,
                           close_packing_density, close_packing_density, false, 0.0}) {}
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
  double excess(double phi) const override {
    const double eta = per_density * phi;
    const double one = 1.0 - eta;
    return eta * (2.0 - eta) / square(one) + eta / one - std::log1p(-eta);
  }
};

// --- Kolafa and Rottner
// -----------------------------------------------------------------------------------------------

// [KolafaRottner2006]: Z = sum A_i y^i, y = eta/(1 - eta).
struct KolafaRottnerForm {
  static constexpr std::array<double, 13> low{
      1.0,          2.0,           1.12801775,     0.00181895291, -0.0526134737,  0.0504960168,  -0.0325537792,
      0.0134578632, 0.00140888182, -0.00834273601, 0.00694127367, -0.00262254723, 0.000355746352};
  static constexpr double a22 = -5.24672938e-9;
  static constexpr double a57 = 5.88054639e-23;

  // (Z - 1)/y = sum_{i>=1} A_i y^(i-1) = Q(y) (1 + y) + R, for integral (Z - 1)/(y (1 + y)) dy = integral Q + R ln(1 +
  // y).
  std::array<double, 56> quotient_integral{};  // of y^1 .. y^56
  double remainder = 0.0;

  KolafaRottnerForm() {
    std::array<double, 57> coefficient{};
    for (std::size_t i = 1; i < low.size(); ++i) coefficient[i - 1] = low[i];
    coefficient[21] = a22;
    coefficient[56] = a57;
    double carry = coefficient[56];
    for (std::size_t i = 56; i-- > 0;) {
      quotient_integral[i] = carry / static_cast<double>(i + 1);
      carry = coefficient[i] - carry;
    }
    remainder = carry;
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

  double excess(double phi) const {
    const double eta = per_density * phi;
    const double y = eta / (1.0 - eta);
    double integral = 0.0;
    for (std::size_t i = quotient_integral.size(); i-- > 0;) integral = (integral + quotient_integral[i]) * y;
    double z_minus_one = 0.0;
    for (std::size_t i = low.size(); i-- > 1;) z_minus_one = (z_minus_one + low[i]) * y;
    const double y2 = y * y;
    const double y4 = y2 * y2;
    const double y22 = y4 * y4 * y4 * y4 * y4 * y2;
    z_minus_one += a22 * y22 + a57 * y22 * y22 * y4 * y4 * y4 * y;
    return z_minus_one + integral + remainder * std::log1p(y);
  }
};

const KolafaRottnerForm& kolafa_rottner_form() {
  static const KolafaRottnerForm form;
  return form;
}

// chi of the fluid form, without the cancellation of Z - 1 at low density.
double kolafa_rottner_pair_function(double phi) {
  const double y = per_density * phi / (1.0 - per_density * phi);
  double sum = 0.0;  // (Z - 1)/y
  for (std::size_t i = KolafaRottnerForm::low.size(); i-- > 1;) sum = sum * y + KolafaRottnerForm::low[i];
  sum += KolafaRottnerForm::a22 * std::pow(y, 21) + KolafaRottnerForm::a57 * std::pow(y, 56);
  return 0.5 * sum / (1.0 - per_density * phi);
}

// Its stiffness almost vanishes at freezing, where the density therefore follows f like a square root: nodes gather
// there.
class KolafaRottnerFluid : public TabulatedEquation {
 protected:
  using TabulatedEquation::TabulatedEquation;
  [[nodiscard]] std::vector<InverseTable::Piece> fluid_pieces() const {
    constexpr std::array<double, 5> ends{0.0, 0.66, 0.69, 0.697, freezing_area_fraction};
    constexpr std::array<double, 4> spacing{1.0 / 16.0, 1.0 / 256.0, 1.0 / 1024.0, 1.0 / 4096.0};
    std::vector<InverseTable::Piece> all;
    for (std::size_t i = 0; i < spacing.size(); ++i) {
      all.push_back(piece(ends[i] / per_density, ends[i + 1] / per_density, spacing[i]));
      all.back().pole = 0.0;
    }
    return all;
  }
};

class KolafaRottner final : public KolafaRottnerFluid {
 public:
  KolafaRottner()
      : KolafaRottnerFluid(
            {"kolafa-rottner", "Kolafa and Rottner", "KolafaRottner2006",
             "fluid branch to freezing (area fraction 0.70); a loop inside the transition, no number above "
             "phi = 0.90",
             freezing_area_fraction / per_density, 0.90, freezing_area_fraction / per_density, false, 0.0}),
        form_(kolafa_rottner_form()) {}
  Local local(double phi) const override { return KolafaRottnerForm::local(phi); }
  double pair_function(double phi) const override { return kolafa_rottner_pair_function(phi); }
  double excess(double phi) const override { return form_.excess(phi); }

 protected:
  std::vector<InverseTable::Piece> pieces() const override { return fluid_pieces(); }

 private:
  const KolafaRottnerForm& form_;
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
  // Z + integral (Z/nu) dnu, up to a constant: F along the branch.
  static double f(double phi) {
    const double x = gap(phi);
    const double log_nu = std::log(per_density * phi);
    const double z = 2.0 * nu_max * (1.0 / x - 0.04 + 3.25 * x * x);
    return z - 2.0 * std::log(x) + 2.0 * log_nu - 0.08 * nu_max * log_nu +
           6.5 * nu_max * (0.5 * x * x + nu_max * x + nu_max * nu_max * log_nu);
  }
};

// [Luding2001], global: the fluid form Z4 blended into the dense one over the transition.
class Luding final : public TabulatedEquation {
 public:
  Luding()
      : TabulatedEquation(
            {"luding", "Luding, global", "Luding2001",
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
    sums_.push_back(0.0);
    for (std::size_t i = 1; i < edges_.size(); ++i) {
      sums_.push_back(sums_.back() + integrate_panel<16>(edges_[i - 1], edges_[i], integrand));
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
  double excess(double phi) const override {
    const auto edge =
        static_cast<std::size_t>(std::upper_bound(edges_.begin(), edges_.end(), phi) - edges_.begin()) - 1;
    const double partial = integrate_panel<12>(edges_[edge], phi, integrand);
    return local(phi).compressibility_factor - 1.0 + (sums_[edge] + partial);
  }

 protected:
  // Across the transition the density changes fast with f.
  std::vector<InverseTable::Piece> pieces() const override {
    return {piece(0.0, 0.64 / per_density), piece(0.64 / per_density, 0.76 / per_density, 1.0 / 400.0),
            piece(0.76 / per_density, just_below_close_packing)};
  }

 private:
  static double integrand(double phi) {
    const double nu = per_density * phi;
    const double inverse2 = 1.0 / square(1.0 - nu);
    const double g4 = (1.0 - 7.0 * nu / 16.0) * inverse2 - nu * nu * nu / 128.0 * inverse2 * inverse2;
    if (nu < 0.2) return 0.5 * pi * g4;  // the weight of the dense form is below 3e-20
    const double weight = 1.0 / (1.0 + std::exp(-(nu - 0.70) / 0.0111));
    const double x = DenseForm::gap(phi);
    const double dense = 2.0 * nu_max * (1.0 / x - 0.04 + 3.25 * x * x);
    return (1.0 - weight) * 0.5 * pi * g4 + weight * (dense - 1.0) / phi;
  }
  std::vector<double> edges_;
  std::vector<double> sums_;
};

// Kolafa-Rottner up to freezing at nu = 0.700, its pressure there held across the transition, then the dense branch of
// Luding from where it has that pressure. True disks coexist from 0.700 to 0.716 and the hexatic above is nearly flat
// [Bernard2011] [Engel2013]; the dense branch meets the coexistence pressure at 0.7227.
class BestOf final : public KolafaRottnerFluid {
 public:
  BestOf()
      : KolafaRottnerFluid({"best-of", "Kolafa-Rottner, coexistence, Luding's dense branch", "KolafaRottner2006",
                            "fluid, coexistence and solid; pole at close packing", 1.15, close_packing_density,
                            just_below_close_packing, true, 0.0}),
        form_(kolafa_rottner_form()) {
    freezing_ = freezing_area_fraction / per_density;
    scaled_pressure_ = freezing_ * KolafaRottnerForm::local(freezing_).compressibility_factor;
    double below = melting_area_fraction / per_density;
    double above = 0.75 / per_density;
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (below + above);
      (middle * DenseForm::local(middle).compressibility_factor < scaled_pressure_ ? below : above) = middle;
    }
    melting_ = above;
    breaks_ = {freezing_, melting_};
    f_coexistence_ = std::log(freezing_) + form_.excess(freezing_);
    dense_offset_ = f_coexistence_ - DenseForm::f(melting_);
  }
  Local local(double phi) const override {
    if (phi <= freezing_) return KolafaRottnerForm::local(phi);
    if (phi < melting_) return {scaled_pressure_ / phi, 0.0};
    return DenseForm::local(phi);
  }
  double excess(double phi) const override {
    if (phi <= freezing_) return form_.excess(phi);
    if (phi < melting_) return f_coexistence_ - std::log(phi);
    return DenseForm::f(phi) + dense_offset_ - std::log(phi);
  }
  double pair_function(double phi) const override {
    return phi <= freezing_ ? kolafa_rottner_pair_function(phi) : EquationOfState::pair_function(phi);
  }
  std::span<const double> breaks() const override { return breaks_; }

 protected:
  std::vector<InverseTable::Piece> pieces() const override {
    std::vector<InverseTable::Piece> all = fluid_pieces();
    all.push_back(piece(melting_, just_below_close_packing));
    all.back().pole = close_packing_density;
    return all;
  }

 private:
  const KolafaRottnerForm& form_;
  std::array<double, 2> breaks_{};
  double freezing_ = 0.0, melting_ = 0.0, scaled_pressure_ = 0.0, f_coexistence_ = 0.0, dense_offset_ = 0.0;
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

const EquationOfState& enskog() { return *equations_of_state().front(); }
const EquationOfState& best_of() { return *equations_of_state().back(); }

EnskogConstants enskog_constants() {
  return {enskog_a, enskog_a1, enskog_a2, enskog_c1, enskog_c2, enskog_c3, enskog_c4};
}

}  // namespace shakebed::fit
