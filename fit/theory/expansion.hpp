#pragma once

#include "fit/theory/equation_of_state.hpp"

// The constants of the paper: where a column of disks condenses, and how it expands below that temperature.
//
// mu is the height in diameters of the close-packed rectangle at T = 0; the sum rule is
//     integral phi dzeta = phi_0 mu = N D/W.
// Nothing here takes a bare mu without the plateau density phi_0 beside it. [QuinnHong2000]
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

// All of an equation of state's constants at one plateau density. Each is evaluated without cancellation:
//     mu_0     = phi_0 Z_0
//     Lambda_1 = (phi_0 Z_0^2 + integral_0^phi_0 Z^2 dphi)/2
//     k        = integral_0^phi_0 (Z/Z_0)^2 dphi/phi_0       (the printed 2 Lambda_1 phi_0/mu_0^2 - 1)
// Status pole or outside_range (and all numbers 0) where the equation of state has none.
struct ExpansionConstants {
  ValueStatus status = ValueStatus::ok;
  double plateau_density = 0.0;         // phi_0 [1/D^2]
  double compressibility_factor = 0.0;  // Z_0 = Z(phi_0)
  double mu_0 = 0.0;                    // integral_0^phi_0 phi f' dphi
  double lambda_1 = 0.0;                // integral_0^phi_0 [f(phi_0) - f(phi)] phi f'(phi) dphi
  double k = 0.0;                       // 2 Lambda_1 phi_0/mu_0^2 - 1
  double f_plateau = 0.0;               // f(phi_0)
  double contact_value = 0.0;           // chi(phi_0)
  [[nodiscard]] bool ok() const { return status == ValueStatus::ok; }
};
// phi_0 in (0, largest density of the equation]; Enskog to 1e-12 relative for phi_0 from 1e-300 to 2/sqrt 3.
ExpansionConstants expansion_constants(const EquationOfState& equation, double plateau_density);

// k from printed Lambda_1 and mu_0, as a reader of the paper would compute it.
double expansion_coefficient(double lambda_1, double mu_0, double plateau_density);

// A column of disks: N D/W and the density of its solid.
struct Column {
  double column_number = 0.0;                      // N D/W, disks per diameter of width
  double plateau_density = close_packing_density;  // phi_0 [1/D^2]
  // mu = (N D/W)/phi_0 [D]
  [[nodiscard]] double initial_height() const { return column_number / plateau_density; }
  // Rows of the hexagonal start: N / (W/D), with D between neighbours of a row.
  [[nodiscard]] double rows() const { return column_number; }
};
Column column_from_initial_height(double initial_height, double plateau_density);

// T_c [m g D] = mu phi_0/mu_0 = mu/Z_0.
Value critical_temperature(const EquationOfState& equation, const Column& column);
// zeta_F [D] = mu (1 - T/T_c) for T <= T_c, 0 above.
Value solid_height(const EquationOfState& equation, const Column& column, double temperature);
// Delta z [D] = (mu/2) k (T/T_c)^2, eq. (5): only for 0 <= T <= T_c (outside_range above).
Value center_of_mass_rise(const EquationOfState& equation, const Column& column, double temperature);
// The same for any T, by hydrostatics: above T_c the bottom density leaves phi_0 and follows T phi Z = N D/W. Equals
// eq. (5) below T_c. For an equation with a pole there is no rectangle and this is the only form there is (the rise is
// then above mu/2 of the column's own plateau_density).
Value hydrostatic_center_of_mass_rise(const EquationOfState& equation, const Column& column, double temperature);

}  // namespace shakebed::fit
