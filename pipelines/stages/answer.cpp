#include "pipelines/stages/answer.hpp"

#include <fmt/format.h>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/bed_judgement.hpp"

namespace shakebed::pipelines {
namespace {

// The estimate at a pointer, its value and error multiplied by a factor.
std::optional<fit::Estimate> estimate_at(const Json& json, const std::string& pointer, double factor) {
  const Json *value = find_pointer(json, pointer + "/value"), *error = find_pointer(json, pointer + "/std_error");
  if (value == nullptr || !value->is_number() || !(value->get<double>() >= 0)) return std::nullopt;
  const double spread = error != nullptr && error->is_number() ? error->get<double>() : 0;
  return fit::Estimate{factor * value->get<double>(), factor * spread};
}

// T in m g D and as T/(m g). The middle of a range has no standard error: null.
void put_temperature(Json& out, const std::string& name, double value, std::optional<double> std_error,
                     std::optional<double> diameter) {
  const auto put = [&](const std::string& key, const char* unit, double factor) {
    out[key] = quantity_json(value * factor, unit, std_error.value_or(0) * factor);
    if (!std_error) out[key]["std_error"] = nullptr;
  };
  put(name, "m g D", 1);
  if (diameter) put(name + "_over_mg", "m", *diameter);
}

}  // namespace

KineticTemperatures kinetic_temperatures(const Input& input, std::optional<double> diameter) {
  const Json result = input.result();
  KineticTemperatures found{estimate_at(result, "/temperature_x", 1), estimate_at(result, "/temperature_z", 1)};
  const Json* usable = find_pointer(result, "/velocities/usable");
  if (!found.x && diameter && usable != nullptr && *usable == true) {
    found.x = estimate_at(result, "/velocities/temperature_x_over_mg", 1 / *diameter);
    found.z = estimate_at(result, "/velocities/temperature_z_over_mg", 1 / *diameter);
  }
  return found;
}

double contact_duration_effect(const Input& input) {
  const Json result = input.result();
  const Json* effect = find_pointer(result, "/contact_duration_effect/value");
  return effect != nullptr && effect->is_number() ? effect->get<double>() : 0;
}

double origin_error(const Input& input) {
  const Json result = input.result();
  const auto number = [&](const char* pointer) {
    const Json* found = find_pointer(result, pointer);
    return found != nullptr && found->is_number() ? found->get<double>() : 0;
  };
  const double diameter = number("/diameter/value");
  return diameter > 0 ? number("/floor/std_error") * number("/scale/value") / diameter : 0;
}

double scale_error(const Input& input) {
  const Json result = input.result();
  const Json *value = find_pointer(result, "/scale/value"), *error = find_pointer(result, "/scale/std_error");
  if (value == nullptr || error == nullptr || !value->is_number() || !error->is_number()) return 0;
  return value->get<double>() > 0 ? error->get<double>() / value->get<double>() : 0;
}

double width_between_walls(const Input& input) {
  if (!input.has("bed.json")) return 0;
  const BedDescription bed = BedDescription::read(input.file("bed.json"));
  const Json result = input.result();
  const Json* open = find_pointer(result, "/walls_are_frame_sides");
  return bed.periodic || (open != nullptr && *open == true) ? 0 : bed.width / bed.diameter;
}

bool is_shaken(const Input& input) {
  const Json result = input.result();
  const Json* shaken = find_pointer(result, "/shaken");
  if (shaken != nullptr && *shaken == true) return true;
  return input.has("bed.json") && BedDescription::read(input.file("bed.json")).amplitude.value_or(0) > 0;
}

std::vector<fit::Objection> objections_of(const Input& input) {
  std::vector<fit::Objection> found;
  const Json result = input.result();
  if (const Json* all = find_pointer(result, "/objections"); all != nullptr && all->is_array())
    for (const Json& one : *all) found.push_back({one.value("why", ""), one.value("advice", "")});
  return found;
}

void add_judgement(const Json& observables, Json& answer) {
  const Json* judgement = find_pointer(observables, "/judgement");
  if (judgement == nullptr || !speaks_against(*judgement)) return;
  for (const char* key : {"why", "advice"})
    answer[key] = fmt::format("{} The simulated bed: {}", answer.value(key, ""), judgement->value(key, ""));
}

bool is_one_temperature(std::string_view verdict) { return verdict == fit::to_string(fit::Verdict::one_temperature); }

bool is_range(const Json& answer) {
  return answer.value("verdict", "") == fit::to_string(fit::Verdict::no_single_temperature);
}

Json answer_json(const fit::Answer& answer, std::optional<double> diameter) {
  Json out;
  out["verdict"] = fit::to_string(answer.verdict);
  out["why"] = answer.why;
  out["advice"] = answer.advice;
  out["status"] = fit::to_string(answer.status);
  if (!answer.ok()) return out;
  const bool range = answer.verdict == fit::Verdict::no_single_temperature;
  put_temperature(out, "temperature", answer.temperature, range ? std::nullopt : std::optional(answer.std_error),
                  diameter);
  out["interval"] = Json{{"low", quantity_json(answer.interval.low, "m g D")},
                         {"high", quantity_json(answer.interval.high, "m g D")},
                         {"confidence", answer.interval.confidence > 0 ? Json(answer.interval.confidence) : Json()}};
  out["statistical_error"] = quantity_json(answer.statistical_error, "m g D");
  out["misfit_error"] = quantity_json(answer.misfit_error, "m g D");
  out["next_bed_interval"] = Json{{"low", quantity_json(answer.next_bed_interval.low, "m g D")},
                                  {"high", quantity_json(answer.next_bed_interval.high, "m g D")},
                                  {"confidence", answer.next_bed_interval.confidence}};
  out["bias_uncertainty"] = quantity_json(answer.bias_uncertainty, "m g D");
  out["spread"] = quantity_json(answer.spread, "m g D");
  out["contact_duration_uncertainty"] = quantity_json(answer.contact_duration_uncertainty, "m g D");
  out["wall_uncertainty"] = quantity_json(answer.wall_uncertainty, "m g D");
  out["bias"] = answer.bias;
  out["thermometer"] = answer.thermometer;
  out["model"] = answer.model;
  const bool solid = answer.solid_height.value > 0 || answer.solid_height.std_error > 0;
  out["solid_height"] = solid ? quantity_json(answer.solid_height.value, "D", answer.solid_height.std_error) : Json();
  if (answer.temperature_x)
    put_temperature(out, "temperature_x", answer.temperature_x->value, answer.temperature_x->std_error, diameter);
  if (answer.temperature_z)
    put_temperature(out, "temperature_z", answer.temperature_z->value, answer.temperature_z->std_error, diameter);
  out["readings"] = Json::array();
  for (const fit::ThermometerReading& reading : answer.readings) {
    out["readings"].push_back(Json{{"thermometer", reading.thermometer},
                                   {"model", reading.model},
                                   {"status", fit::to_string(reading.status)},
                                   {"admissible", reading.admissible},
                                   {"temperature", quantity_json(reading.temperature, "m g D", reading.std_error)},
                                   {"bias", reading.bias},
                                   {"bias_uncertainty", reading.bias_uncertainty},
                                   {"chi2_per_dof", reading.chi2_per_dof}});
  }
  return out;
}

AnswerScale answer_scale(const Json& answer) {
  const Json *length = find_pointer(answer, "/temperature_over_mg/value"),
             *plain = find_pointer(answer, "/temperature/value");
  if (length == nullptr || plain == nullptr || !(plain->get<double>() > 0)) return {"T", "m g D", 1};
  return {"T/(m g)", "mm", 1e3 * length->get<double>() / plain->get<double>()};
}

std::string verdict_text(const Json& answer) {
  const bool number = find_pointer(answer, "/temperature/value") != nullptr;
  return number ? answer.value("verdict", "") : "no temperature can be determined";
}

std::string answer_text(const Json& answer) {
  const Json* value = find_pointer(answer, "/temperature/value");
  const std::string verdict = capitalized(verdict_text(answer)) + ": " + answer.value("why", "");
  if (value == nullptr) return verdict;
  const AnswerScale scale = answer_scale(answer);
  const auto number = [&](const char* pointer) {
    const Json* found = find_pointer(answer, pointer);
    return found != nullptr && found->is_number() ? scale.factor * found->get<double>() : 0;
  };
  std::string text;
  if (is_range(answer) && number("/interval/high/value") == 0)
    text = scale.name + std::string(" = 0");
  else if (is_range(answer) && number("/interval/low/value") == 0)
    text = fmt::format("{} below {:.3g} {}", scale.name, number("/interval/high/value"), scale.unit);
  else if (is_range(answer))
    text = fmt::format("{} between {:.3g} and {:.3g} {}", scale.name, number("/interval/low/value"),
                       number("/interval/high/value"), scale.unit);
  else
    text = fmt::format("{} = {:.4g} ± {:.2g} {} (95 %: {:.3g} to {:.3g})", scale.name, number("/temperature/value"),
                       number("/temperature/std_error"), scale.unit, number("/interval/low/value"),
                       number("/interval/high/value"));
  if (find_pointer(answer, "/temperature_x/value") != nullptr)
    text += fmt::format("; kinetic T_x {:.3g}, T_z {:.3g} {}", number("/temperature_x/value"),
                        number("/temperature_z/value"), scale.unit);
  return text + ". " + verdict;
}

}  // namespace shakebed::pipelines
