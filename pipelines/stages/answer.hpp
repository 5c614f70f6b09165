// The answer of a fit stage: one temperature with its whole uncertainty and a verdict [fit/profile_fit/answer.hpp], as
// JSON and as one line for people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// Kinetic temperatures that an input stage measured, in m g D: from a simulation, or from the velocities in a film,
// whose T/(m g) is a length. Nothing where it measured none.
struct KineticTemperatures {
  std::optional<fit::Estimate> x, z;
};
KineticTemperatures kinetic_temperatures(const Input& input, std::optional<double> diameter);
// Relative effect of the contact duration on T, where a simulation states one; else 0.
double contact_duration_effect(const Input& input);
// One standard error of the floor's mean position [D], where an input stage measured it in photographs; else 0.
double origin_error(const Input& input);
// Relative error of the scale of photographs; 0 for others.
double scale_error(const Input& input);
// Width between hard side walls that are in view [D]; 0 where there are none. And whether the bed is shaken.
double width_between_walls(const Input& input);
bool is_shaken(const Input& input);
// What an input stage knows against its own profile: "objections" of its result.
std::vector<fit::Objection> objections_of(const Input& input);

// Whether a verdict, as it stands in the results, says that the bed has one temperature.
bool is_one_temperature(std::string_view verdict);
// Whether an answer is its interval, and no value within it.
bool is_range(const Json& answer);

// Temperatures in m g D and, with the diameter [m], as T/(m g) in m.
Json answer_json(const fit::Answer& answer, std::optional<double> diameter);

// How people read the temperatures of an answer: T/(m g) in mm where the diameter is known, else T in m g D.
struct AnswerScale {
  const char *name, *unit;
  double factor;  // from m g D
};
AnswerScale answer_scale(const Json& answer);

// Adds to the answer's reason and advice what speaks against the numbers of the simulated bed it was read from.
void add_judgement(const Json& observables, Json& answer);

// The verdict for people, who also learn from it where the answer has no number.
std::string verdict_text(const Json& answer);
// "T/(m g) = 0.62 ± 0.05 mm (95 %: 0.52 to 0.72 mm). One temperature: why."; "No single temperature (none
// can be read): why." where there is no number. Ends without a line break.
std::string answer_text(const Json& answer);

}  // namespace shakebed::pipelines
