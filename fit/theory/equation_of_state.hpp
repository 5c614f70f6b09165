#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <string_view>
#include <vector>

#include "fit/theory/inverse_table.hpp"
#include "fit/theory/value.hpp"

// Equations of state of hard disks, one row each. Densities are number densities phi = n D^2 (not area fractions);
// temperature, pressure and f are in reduced units D = m = g = 1.
//
// With P = T phi Z(phi), hydrostatic balance dP/dzeta = -phi integrates to
//     zeta = zeta_0 + T [f(phi_0) - f(phi)],   f'(phi) = (1/phi) d(phi Z)/dphi,
// so f and its inverse turn any of these rows into a density profile. f is
//     f(phi) = ln phi + K + g(phi),   g(phi) = Z - 1 + integral_0^phi (Z - 1)/phi' dphi',
// where g is positive and vanishes with phi, and the constant K is that of the printed Enskog f (K = c3 + c4) and 0 for
// the other rows. Only differences of f mean anything. [QuinnHong2000]
//
// Any number of threads may use one row: its tables are made once, behind a lock, and do not change afterwards. The
// rows of this library live as long as the program; one of your own must outlive the profiles and fits that refer to
// it.
namespace shakebed::fit {

// 2/sqrt(3): the number density of close packing.
inline constexpr double close_packing_density = 1.1547005383792515290;
// pi/(2 sqrt 3): its area fraction.
inline constexpr double close_packing_area_fraction = 0.90689968211710892530;
// Area fractions of the coexisting phases of true hard disks [Bernard2011] [Engel2013].
inline constexpr double freezing_area_fraction = 0.700;
inline constexpr double melting_area_fraction = 0.716;

// nu = pi phi/4 and back.
double area_fraction(double number_density);
double number_density(double area_fraction);

class EquationOfState {
 public:
  virtual ~EquationOfState() = default;

  // The row.
  [[nodiscard]] std::string_view name() const { return row_.name; }      // as users write it: "kolafa-rottner"
  [[nodiscard]] std::string_view title() const { return row_.title; }    // for people
  [[nodiscard]] std::string_view source() const { return row_.source; }  // a key of REFERENCES.bib
  [[nodiscard]] std::string_view validity() const { return row_.validity; }
  // Up to here the formula is within a per cent of simulation. [1/D^2]
  [[nodiscard]] double accurate_density() const { return row_.accurate_density; }
  // The largest density with a number (status outside_range or pole beyond). [1/D^2]
  [[nodiscard]] double largest_density() const { return row_.largest_density; }
  // True where Z diverges at largest_density(): there is then no rectangle and no T_c.
  [[nodiscard]] bool has_pole() const { return row_.has_pole; }
  // The inverse is known up to here: below largest_density() only for a form whose pressure is not monotone. [1/D^2]
  [[nodiscard]] double largest_invertible_density() const { return row_.largest_invertible_density; }

  // Z = P/(n T), for 0 <= phi <= largest_density().
  [[nodiscard]] Value compressibility_factor(double number_density) const;
  // Pair function at contact, chi = (Z - 1)/(pi phi/2); 1 at phi = 0.
  [[nodiscard]] Value contact_value(double number_density) const;
  // P [m g/D], at temperature T [m g D].
  [[nodiscard]] Value pressure(double number_density, double temperature) const;
  // d(phi Z)/dphi: the inverse compressibility, 1 at phi = 0; also phi f'(phi).
  [[nodiscard]] Value stiffness(double number_density) const;
  // f(phi), for phi > 0.
  [[nodiscard]] Value f(double number_density) const;
  // The inverse: phi from f, to 4 units in the last place. Strictly increasing. Across a coexistence (best-of) the
  // density jumps; at the exact f of the jump the fluid side is returned. Status outside_range above the largest f. An
  // underflow of exp gives phi = 0, status ok.
  [[nodiscard]] Value density_from_f(double f) const;
  // phi from the scaled pressure p = P/T = phi Z (the bottom density of a column: p = (N D/W)/T).
  [[nodiscard]] Value density_from_scaled_pressure(double scaled_pressure) const;

  // The constant K above.
  [[nodiscard]] double f_constant() const { return row_.f_constant; }

  // Batch form of density_from_f: out[i] = phi(f[i]), 0 where there is none. Returns the first status that is not ok.
  ValueStatus densities_from_f(std::span<const double> f, std::span<double> out) const;

  // Fast forms for inner loops: no checks. The caller guarantees 0 < phi <= largest_density() (or < for a pole).
  // value, and d(phi Z)/dphi.
  struct Local {
    double compressibility_factor;  // Z
    double stiffness;               // d(phi Z)/dphi
  };
  [[nodiscard]] virtual Local local(double number_density) const = 0;
  // g(phi) of the comment at the top.
  [[nodiscard]] virtual double excess(double number_density) const = 0;
  // chi(phi).
  [[nodiscard]] virtual double pair_function(double number_density) const;
  // Densities where Z has a kink or a jump of slope (the ends of a coexistence).
  [[nodiscard]] virtual std::span<const double> breaks() const { return {}; }
  // Where phi(F) is steepest between fluid and solid, F = ln phi + g. `length`: of a panel of F there that 8 Gauss
  // points integrate; 0: nowhere steeper than elsewhere.
  struct Steep {
    double f = 0.0, length = 0.0;
  };
  [[nodiscard]] virtual Steep steep() const { return {}; }
  // phi against f - f_constant(): for loops that evaluate whole profiles. Built at the first call.
  [[nodiscard]] const InverseTable& inverse_table() const;
  // What it is built from, the smooth pieces of the range upwards: one, unless there is a coexistence.
  [[nodiscard]] virtual std::vector<InverseTable::Piece> pieces() const;

 protected:
  struct Row {
    std::string_view name, title, source, validity;
    double accurate_density, largest_density, largest_invertible_density;
    bool has_pole;
    double f_constant, f_constant_low = 0.0;  // K, in two doubles
  };
  explicit EquationOfState(const Row& row) : row_(row), table_(std::make_unique<Table>()) {}
  // f(phi), status ok.
  [[nodiscard]] virtual double reduced_f(double number_density) const;
  // g(phi) in extended precision, from which the table is built.
  [[nodiscard]] virtual long double extended_excess(long double number_density) const = 0;
  [[nodiscard]] InverseTable::Piece piece(long double lowest, long double highest) const;

 private:
  struct Table {
    std::once_flag built;
    InverseTable table;
  };
  [[nodiscard]] double invert(const InverseTable& table, double f) const;
  [[nodiscard]] double largest_f(const InverseTable& table) const;

  Row row_;
  std::unique_ptr<Table> table_;
};

// The table: enskog, henderson, santos-lopez-yuste, percus-yevick, kolafa-rottner, luding, best-of. The objects live
// as long as the program and are safe to share between threads.
std::span<const EquationOfState* const> equations_of_state();
// "enskog, henderson, ...", for help and messages.
std::string equation_names();
// nullptr when there is no such name.
const EquationOfState* find_equation_of_state(std::string_view name);
const EquationOfState& enskog();
const EquationOfState& best_of();

// The Enskog/Ree-Hoover row in the paper's own terms, for those who want its constants. [Hong1999] [ReeHoover1967]
struct EnskogConstants {
  double a, a1, a2;       // chi(phi) = (1 - a1 phi + a2 phi^2)/(1 - a phi)^2
  double c1, c2, c3, c4;  // f(phi) = ln phi + c1 phi + c2 ln(1 - a phi) + c3/(1 - a phi) + c4/(1 - a phi)^2
};
EnskogConstants enskog_constants();

}  // namespace shakebed::fit
