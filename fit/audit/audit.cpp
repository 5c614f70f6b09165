#include "fit/audit/audit.hpp"

#include <cmath>
#include <cstdio>
#include <numbers>

#include "fit/map/gamma_temperature.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "fit/theory/printed.hpp"
#include "fit/theory/quadrature.hpp"

namespace shakebed::fit {

namespace {

std::string text_of(double value, int digits = 10) {
  char text[48];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

AuditRow numeric(std::string quantity, std::string place, std::string unit, double printed, double recomputed,
                 AuditStatus status, std::string explanation) {
  AuditRow row;
  row.quantity = std::move(quantity);
  row.place = std::move(place);
  row.unit = std::move(unit);
  row.printed = printed;
  row.recomputed = recomputed;
  row.difference = recomputed - printed;
  row.relative_difference = printed != 0.0 ? row.difference / printed : 0.0;
  row.printed_text = text_of(printed);
  row.recomputed_text = text_of(recomputed);
  row.explanation = std::move(explanation);
  row.status = status;
  return row;
}

AuditRow statement(std::string quantity, std::string place, std::string printed, std::string recomputed,
                   AuditStatus status, std::string explanation) {
  AuditRow row;
  row.quantity = std::move(quantity);
  row.place = std::move(place);
  row.is_numeric = false;
  row.printed_text = std::move(printed);
  row.recomputed_text = std::move(recomputed);
  row.explanation = std::move(explanation);
  row.status = status;
  return row;
}

// Agrees when the recomputed number rounds to the print, `unit` being one in the last printed digit.
AuditStatus to_the_digits(double printed, double recomputed, double last_digit) {
  return std::abs(recomputed - printed) <= 0.5000001 * last_digit ? AuditStatus::agrees : AuditStatus::open;
}

// Lambda_1 at 2/sqrt 3 with another a in the pair function.
struct OtherAlpha {
  double alpha = 0.0, lambda_1 = 0.0;
};

double compressibility_with_alpha(double phi, double alpha) {
  const EnskogConstants c = enskog_constants();
  const double half_pi = std::numbers::pi / 2.0;
  const double d = 1.0 - alpha * phi;
  return 1.0 + half_pi * phi * (1.0 - c.a1 * phi + c.a2 * phi * phi) / (d * d);
}

OtherAlpha alpha_that_gives(double mu_0) {
  double low = 0.7;
  double high = 0.8;
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (low + high);
    (close_packing_density * compressibility_with_alpha(close_packing_density, middle) < mu_0 ? low : high) = middle;
  }
  OtherAlpha other;
  other.alpha = 0.5 * (low + high);
  const double z = compressibility_with_alpha(close_packing_density, other.alpha);
  double square = 0.0;
  constexpr int panels = 32;
  for (int i = 0; i < panels; ++i) {
    square +=
        integrate_panel<16>(close_packing_density * i / panels, close_packing_density * (i + 1) / panels,
                            [&](double phi) { return std::pow(compressibility_with_alpha(phi, other.alpha), 2); });
  }
  other.lambda_1 = 0.5 * (close_packing_density * z * z + square);
  return other;
}

// mu_0, Lambda_1 and k, after eqs. (4) and (5).
void audit_constants(std::vector<AuditRow>& rows) {
  const ExpansionConstants packed = expansion_constants(enskog(), close_packing_density);
  const OtherAlpha other = alpha_that_gives(printed::mu_0);

  rows.push_back(numeric("mu_0", "text after eq. (4)", "", printed::mu_0, packed.mu_0,
                         to_the_digits(printed::mu_0, packed.mu_0, 1e-5),
                         "at phi_0 = 2/sqrt 3. The printed value follows from a coarse quadrature, or from another "
                         "constant alpha of the pair function: alpha = " +
                             text_of(other.alpha, 9) + " instead of " + text_of(enskog_constants().a, 9)));
  rows.push_back(numeric(
      "Lambda_1", "text after eq. (5)", "", printed::lambda_1, packed.lambda_1,
      to_the_digits(printed::lambda_1, packed.lambda_1, 1e-6),
      "at phi_0 = 2/sqrt 3. The alpha that gives the printed mu_0 gives Lambda_1 = " + text_of(other.lambda_1, 6) +
          ". Possible causes: a wrong digit in print (5603 for 5503), or a coarse quadrature"));
  const double k_printed = expansion_coefficient(printed::lambda_1, printed::mu_0, close_packing_density);
  rows.push_back(numeric("k = 2 Lambda_1 phi_0/mu_0^2 - 1", "eq. (5), from the two printed constants", "", k_printed,
                         packed.k, AuditStatus::explained,
                         "k is a small difference of large numbers: a change of " +
                             text_of(100.0 * (packed.lambda_1 / printed::lambda_1 - 1.0), 2) +
                             " % in Lambda_1 makes it " + text_of(packed.k / k_printed, 3) + " times larger"));
}

// The bed of the experiment, with the plateau as measured.
Column measured_column() { return column_from_initial_height(printed::initial_height, printed::plateau_density); }

// T_c, T/T_c and the height of the solid in the comparison with the experiment.
void audit_temperatures(std::vector<AuditRow>& rows) {
  const EquationOfState& eos = enskog();
  const double d = printed::diameter_mm;
  const Column as_packed = column_from_initial_height(printed::initial_height, close_packing_density);
  const Column as_measured = measured_column();
  const double critical_packed = d * critical_temperature(eos, as_packed).value;
  const double critical_measured = d * critical_temperature(eos, as_measured).value;
  rows.push_back(numeric("T_c/mg at phi_0 = 2/sqrt 3", "comparison with the experiment", "mm",
                         printed::critical_temperature_mm, critical_packed, AuditStatus::explained,
                         "the paper's constants hold for phi_0 = 2/sqrt 3, but its T_c follows from the plateau "
                         "density of the experiment: see the next row"));
  rows.push_back(numeric("T_c/mg at phi_0 = 1.10", "comparison with the experiment", "mm",
                         printed::critical_temperature_mm, critical_measured,
                         to_the_digits(printed::critical_temperature_mm, critical_measured, 1e-3),
                         "the plateau density of the experiment is phi_0 = 1.10, not close packing"));
  const double reduced = printed::temperature_mm / critical_measured;
  rows.push_back(numeric("T/T_c from T/mg = 0.36 mm", "comparison with the experiment", "",
                         printed::reduced_temperature, reduced,
                         to_the_digits(printed::reduced_temperature, reduced, 1e-3), "with phi_0 = 1.10"));
  const double solid = solid_height(eos, as_measured, printed::temperature_mm / d).value;
  rows.push_back(numeric("zeta_F predicted", "comparison with the experiment", "D", printed::solid_height, solid,
                         to_the_digits(printed::solid_height, solid, 1e-2),
                         "mu (1 - T/T_c) with phi_0 = 1.10; a height in diameters, called layers in the paper"));
}

// Shift and area of the published fit.
void audit_published_profile(std::vector<AuditRow>& rows) {
  const double d = printed::diameter_mm;
  const double shift_mm = printed::shift_times_plateau / printed::plateau_density * d;
  rows.push_back(numeric("z_o", "comparison with the experiment", "mm", printed::shift_mm, shift_mm,
                         std::abs(shift_mm - printed::shift_mm) < 0.5 ? AuditStatus::explained : AuditStatus::open,
                         "zeta_0 D/phi_0; the printed formula phi_0 zeta_0/D is inverted (it gives " +
                             text_of(printed::plateau_density * printed::shift_times_plateau / d, 3) + ")"));
  const double sum_rule = measured_column().column_number;
  const HydrostaticProfile drawn = published_profile();
  const double as_product =
      HydrostaticProfile::tail_over_rectangle(enskog(), printed::temperature_mm / d, printed::shift_times_plateau,
                                              printed::plateau_density)
          .column_number();
  rows.push_back(numeric(
      "area under the published fit", "sum rule, phi_0 mu", "1/D", sum_rule, drawn.column_number(), AuditStatus::open,
      "with the shift 4.41/1.10 D the area is " + text_of(drawn.column_number(), 4) + ", with 4.41 D " +
          text_of(as_product, 4) + "; by the sum rule it must be " + text_of(sum_rule, 4)));
}

// Misprints.
void audit_formulas(std::vector<AuditRow>& rows) {
  const EnskogConstants c = enskog_constants();
  const double f_right = enskog().f(printed::plateau_density).value;
  const double f_misprint = f_right - c.c3 / (1.0 - c.a * printed::plateau_density) + c.c3 / (1.0 - c.a);
  rows.push_back(statement("f(phi_0), third term", "eq. (3b)", "c3/(1 - alpha_0)", "c3/(1 - alpha phi_0)",
                           AuditStatus::explained,
                           "a misprint: f(1.10) would be " + text_of(f_misprint, 6) + " for " + text_of(f_right, 6)));
  rows.push_back(statement("c4", "after eq. (3)", "(pi/2)(1 - alpha_1/alpha + alpha_2/alpha^2) alpha",
                           "(pi/2)(1 - alpha_1/alpha + alpha_2/alpha^2)/alpha = " + text_of(c.c4),
                           AuditStatus::explained, "a misprint: only the division gives f' = (1/phi) d(phi Z)/dphi"));
  rows.push_back(statement("power of mu", "eq. (6)", "mu^2",
                           "mu to the first power, from eq. (5) (mu: height of the bed at rest, in D); mu^2 if only "
                           "the bead at the surface jumps",
                           AuditStatus::explained,
                           "Delta z = H_0 gives mu, and Delta z = H_0/mu gives mu^2 (Delta z: rise of the centre of "
                           "mass; H_0: jump height of one ball). The map stage computes both"));
}

// T/T_c from Gamma, and the mass of a disk.
void audit_map(std::vector<AuditRow>& rows) {
  // Gamma = 4 and f = 20 Hz are not printed.
  ShakenBed bed;
  bed.gamma = 4.0;
  bed.acceleration_length = acceleration_length(9.81, 20.0, 1e-3 * printed::diameter_mm);
  bed.column = measured_column();
  double nearest = 0.0;
  double with_printed = 0.0;
  for (const Reading& reading : temperatures_from_gamma(bed)) {
    if (reading.name == "eq6/above_highest_floor/close_packed") nearest = reading.reduced_temperature;
    if (reading.name == "eq6/above_highest_floor/printed") with_printed = reading.reduced_temperature;
  }
  rows.push_back(numeric("T/T_c from the map", "eq. (6)", "", printed::map_reduced_temperature, nearest,
                         AuditStatus::open,
                         "nearest candidate: H_0 = (Gamma - 1)^2/2, mu^2, k at phi_0 = 2/sqrt 3. Gamma = 4 and f = 20 "
                         "Hz are not printed; they are assumed from the literature. The printed constants give " +
                             text_of(with_printed, 4) +
                             ". H_0, Gamma and f are not printed, so no candidate is claimed to be the paper's"));
  rows.push_back(statement("mass of a disk", "caption of Fig. 2 and text", "1.047e-6 and 2.090e-6", "either",
                           AuditStatus::explained, "T/(m g D) does not depend on m"));
}

// The equilibrium beds of Fig. 1.
void audit_equilibrium_beds(std::vector<AuditRow>& rows) {
  const EquationOfState& eos = enskog();
  const double layers =
      solid_height(eos, {20.0 * close_packing_density, close_packing_density},
                   0.15 * critical_temperature(eos, {20.0 * close_packing_density, close_packing_density}).value)
          .value;
  rows.push_back(numeric("zeta_F at T/T_c = 0.15, mu = 20", "Fig. 1a: about 17 layers", "D", 17.0, layers,
                         to_the_digits(17.0, layers, 1.0),
                         "this is the number of condensed layers at this T < T_c, not mu"));
  rows.push_back(statement("width of the bed", "Fig. 1: N = 1000, mu = 20, no W", "not printed",
                           "W = " + text_of(1000.0 / (20.0 * close_packing_density), 4) +
                               " D if mu is a height; W = 50 D if there are 20 rows of 50 disks (mu = " +
                               text_of(1000.0 / 50.0 / close_packing_density, 4) + " D)",
                           AuditStatus::open, "N D/W = phi_0 mu: the program offers both widths"));
}

// The conclusion, and the list of references.
void audit_conclusion(std::vector<AuditRow>& rows) {
  // "The breakdown should persist for any pressure."
  std::string evidence;
  for (const EquationOfState* equation : equations_of_state()) {
    const ExpansionConstants constants = expansion_constants(*equation, close_packing_density);
    if (!evidence.empty()) evidence += "; ";
    evidence += std::string(equation->name()) + ": ";
    evidence += constants.ok() ? "mu_0 = " + text_of(constants.mu_0, 6) : std::string(to_string(constants.status));
  }
  rows.push_back(statement("condensation for any pressure", "conclusion",
                           "the breakdown should persist for any pressure", evidence, AuditStatus::explained,
                           "it persists only where the pressure stays finite at phi_0. The pressure of true disks "
                           "diverges at close packing: then T_c = 0, and every T is above it"));
  rows.push_back(statement("reference [11]", "list of references", "PRE 57", "PRE 54, R9 (1996)",
                           AuditStatus::explained, "a misprint"));
}

}  // namespace

std::string_view to_string(AuditStatus status) {
  switch (status) {
    case AuditStatus::agrees:
      return "agrees";
    case AuditStatus::explained:
      return "explained";
    case AuditStatus::open:
      return "open";
  }
  return "unknown";
}

std::vector<AuditRow> audit() {
  std::vector<AuditRow> rows;
  audit_constants(rows);
  audit_temperatures(rows);
  audit_published_profile(rows);
  audit_formulas(rows);
  audit_map(rows);
  audit_equilibrium_beds(rows);
  audit_conclusion(rows);
  return rows;
}

}  // namespace shakebed::fit
