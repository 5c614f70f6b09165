#pragma once

#include <string>
#include <vector>

#include "fit/map/jump_height.hpp"
#include "fit/theory/expansion.hpp"

// Gamma -> temperature: the single-ball jump equated to the rise of the bed's centre of mass. All interpretations that
// the paper allows are computed, and none is preferred. [QuinnHong2000]
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

enum class ExpansionReading {
  mu,          // eq. (5): rise (mu/2) k (T/T_c)^2 = H_0:            T/T_c = sqrt(2 H_0/(mu k))
  mu_squared,  // eq. (6), only the surface ball jumps: rise = H_0/mu: T/T_c = sqrt(2 H_0/k)/mu
  fermi,       // pi^2 theta^2/(6 mu) = H_0, and T = theta
};
std::string_view to_string(ExpansionReading reading);  // "mu", "mu_squared", "fermi"

enum class ExpansionConstantsSource {
  computed,      // k of the library at the plateau density of the bed
  close_packed,  // k of the library at 2/sqrt 3, whatever the bed's plateau
  printed,       // from mu_0 = 111.52274 and Lambda_1 = 5503.531806, as the paper prints them, at 2/sqrt 3
};
std::string_view to_string(ExpansionConstantsSource source);

// The shaken bed. Lengths in diameters: acceleration_length = g/(w^2 D).
struct ShakenBed {
  double gamma = 0.0;                // peak acceleration in g
  double acceleration_length = 0.0;  // g/(w^2 D), w = 2 pi f
  Column column;                     // N D/W and phi_0
  double restitution = 0.0;  // of the single ball; 0: the single dead-ball flight; above: mean over the bounce map
};
// g/(w^2 D) from SI values.
double acceleration_length(double gravity, double frequency, double diameter);

struct Reading {
  std::string
      name;  // "eq5/relative_max", "eq6/above_highest_floor/printed" or "/close_packed", "fermi/above_launch", ...
  JumpHeight jump_height;  // which H_0
  ExpansionReading expansion;
  ExpansionConstantsSource constants;
  ValueStatus status = ValueStatus::ok;
  double jump = 0.0;                 // H_0 in D
  double rise = 0.0;                 // the rise of the centre of mass this reading asks for, in D
  double temperature = 0.0;          // T [m g D]
  double reduced_temperature = 0.0;  // T/T_c
  bool in_range = false;             // T <= T_c for eq. 5 and 6; exp(-mu/theta) <= 0.01 for fermi; never when not ok
};
std::string reading_name(ExpansionReading expansion, JumpHeight jump, ExpansionConstantsSource constants);

// Every reading: (mu, mu_squared) x 4 jump heights x (computed, close_packed, printed), then fermi x 4.
std::vector<Reading> temperatures_from_gamma(const ShakenBed& bed, const EquationOfState& equation = enskog(),
                                             const WaveForm& wave = WaveForm::sine());

// Backwards: the Gamma at which a reading gives this temperature [m g D]. `bed.gamma` is not read. With a restitution
// the mean bounce is tabulated in steps of 2 % of Gamma up to 30 and interpolated (about a second).
struct GammaReading {
  std::string name;
  ValueStatus status = ValueStatus::ok;
  double gamma = 0.0;
  bool in_range = false;
};
std::vector<GammaReading> gammas_from_temperature(double temperature, const ShakenBed& bed,
                                                  const EquationOfState& equation = enskog(),
                                                  const WaveForm& wave = WaveForm::sine());

}  // namespace shakebed::fit
