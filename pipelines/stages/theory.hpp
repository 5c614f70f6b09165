// The theory at the edge of the program: arguments with units in, JSON and tables out. The formulas are fit's.
#pragma once

#include <optional>
#include <string>

#include "fit/map/gamma_temperature.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// The equation of state of this name. Throws UsageError (did you mean).
const fit::EquationOfState& equation_named(const std::string& name);

struct TheoryQuestion {
  std::string equation = "enskog";
  double plateau_density = fit::close_packing_density;  // phi_0 [1/D^2]
  std::optional<double> diameter;                       // D [m]
  std::optional<double> initial_height;                 // mu [D]
  std::optional<double> temperature;                    // T [m g D]
};
// The constants, and with an initial height T_c, with a temperature T/T_c and zeta_F; equation "all": an array of
// these, one an equation of state. What has no value is null and has its reason under "status".
Json theory_json(const TheoryQuestion& question);
std::string theory_text(const TheoryQuestion& question);

struct MapQuestion {
  double gamma = 0;  // peak acceleration [g]
  std::optional<double> gamma_std_error;
  double frequency = 0;       // [Hz]
  double gravity = 9.81;      // [m/s^2]
  double diameter = 0;        // [m]
  double initial_height = 0;  // mu [D]
  double plateau_density = fit::close_packing_density;
  double restitution = 0;  // of the single ball
  std::string equation = "enskog";
  std::optional<double> measured_temperature;  // [m g D]: mapped back to Gamma
  std::optional<double> measured_std_error;
};
Json map_json(const MapQuestion& question);
std::string map_text(const Json& map);

Json audit_json();
std::string audit_text();

// fit.json. The diameter turns T in m g D into T/(m g) in metres.
Json fit_json(const fit::FitResult& result, std::optional<double> diameter);
std::string fit_text(const Json& fit);

}  // namespace shakebed::pipelines
