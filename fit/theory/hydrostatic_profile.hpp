#pragma once

#include <span>

#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/expansion.hpp"
#include "statistics/kernel.hpp"

// Density profiles in hydrostatic balance, heights in D above the floor's mean position.
//
// Any number of threads may use one profile. It refers to its equation of state, which must outlive it.
namespace shakebed::fit {

// A hydrostatic tail phi(zeta) = f^-1(f(phi_top) - (zeta - top)/T) above a rectangle of density phi_0 (or above
// nothing). A small value type; all members are const and safe to share.
class HydrostaticProfile {
 public:
  // The paper's curve: a rectangle of density phi_0 from `base` to `shift`, the tail above it. `shift` is where the
  // tail has density phi_0 (zeta_F + base); below `base` (a shift may lie there: no solid) the density is 0.
  static HydrostaticProfile tail_over_rectangle(const EquationOfState& equation, double temperature, double shift,
                                                double plateau_density, double base = 0.0);
  // The whole column with N D/W conserved. Below T_c it is a rectangle of density phi_0 and its tail. From T_c on it
  // has no rectangle, and the bottom density solves T phi Z(phi) = N D/W. For an equation with a pole, phi_0 is never
  // reached and there is no rectangle at any T.
  static HydrostaticProfile of_column(const EquationOfState& equation, double temperature, const Column& column,
                                      double base = 0.0);

  [[nodiscard]] ValueStatus status() const { return status_; }
  [[nodiscard]] bool ok() const { return status_ == ValueStatus::ok; }
  [[nodiscard]] const EquationOfState& equation() const { return *equation_; }
  [[nodiscard]] double temperature() const { return temperature_; }  // [m g D]
  [[nodiscard]] double base() const { return base_; }                // lower edge [D]
  [[nodiscard]] double top_of_solid() const { return top_; }         // where the tail begins (>= base) [D]
  [[nodiscard]] double solid_height() const { return top_ - base_; }
  [[nodiscard]] double bottom_density() const { return bottom_density_; }  // at base + 0 [1/D^2]
  // Height where the density crosses freezing (0.700/0.716 by equation), 0 when the column is fluid throughout. [D]
  [[nodiscard]] double crystal_height() const;

  // phi(zeta) [1/D^2].
  [[nodiscard]] double density(double height) const;
  // Disks per D of width above a height: integral_zeta^inf phi.
  [[nodiscard]] double column_above(double height) const;
  // N D/W of the whole curve.
  [[nodiscard]] double column_number() const { return column_above(base_); }
  // Height of the centre of mass [D].
  [[nodiscard]] double center_of_mass() const;
  // The density through a kernel, at many heights. Accurate to 1e-9.
  void sample(std::span<const double> heights, const Kernel& kernel, std::span<double> densities) const;

 private:
  HydrostaticProfile() = default;
  const EquationOfState* equation_ = nullptr;
  ValueStatus status_ = ValueStatus::ok;
  double temperature_ = 0.0;
  double base_ = 0.0;
  double top_ = 0.0;             // the tail starts here ...
  double bottom_density_ = 0.0;  // ... at this density, which also fills base..top
  double f_top_ = 0.0;           // f(bottom_density_)
};

// The fit the paper draws through the Clement-Rajchenbach data, from its printed parameters [QuinnHong2000, Fig. 1b and
// text].
struct PublishedFit {
  double diameter_in_mm = 2.99;             // D
  double initial_height = 10.2;             // mu [D]
  double plateau_density = 1.10;            // phi_0
  double temperature_over_mg_in_mm = 0.36;  // T/(m g)
  double shift_times_plateau = 4.41;        // phi_0 zeta_0: the shift in units phi zeta
  [[nodiscard]] double temperature() const { return temperature_over_mg_in_mm / diameter_in_mm; }  // [m g D]
  [[nodiscard]] double shift() const { return shift_times_plateau / plateau_density; }             // [D]
  [[nodiscard]] Column column() const { return {initial_height * plateau_density, plateau_density}; }
};
HydrostaticProfile published_profile(const PublishedFit& published = {});

}  // namespace shakebed::fit
