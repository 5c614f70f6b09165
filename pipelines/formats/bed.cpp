#include "pipelines/formats/bed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

double BedDescription::gamma() const {
  if (!(gravity.value_or(0) > 0)) return 0;
  const double omega = 2 * std::numbers::pi * frequency.value_or(0);
  return amplitude.value_or(0) * omega * omega / *gravity;
}

Json BedDescription::to_json() const {
  const auto quantity = [&](std::optional<double> value, const char* si, const char* own) {
    return value ? quantity_json(*value, reduced ? own : si) : Json();
  };
  Json out;
  out["units"] = reduced ? "reduced" : "SI";
  out["count"] = count;
  out["diameter"] = quantity(diameter, "m", "D");
  out["second_diameter"] = quantity(second_diameter, "m", "D");
  out["mass"] = quantity(mass, "kg", "m");
  out["gravity"] = quantity(gravity, "m/s^2", "g");
  if (tilt) out["tilt"] = quantity_json(*tilt, "rad");
  out["width"] = quantity(width, "m", "D");
  out["periodic"] = periodic;
  out["amplitude"] = quantity(amplitude, "m", "D");
  out["frequency"] = quantity(frequency, "Hz", "sqrt(g/D)");
  out["bath_temperature"] = quantity_json(bath_temperature, "m g D");
  out["restitution"] = restitution ? Json(*restitution) : Json();
  out["friction"] = friction ? Json(*friction) : Json();
  out["column_number"] = column_number();
  out["gamma"] = gamma();
  out["height_origin"] = height_origin;
  return out;
}

BedDescription BedDescription::from_json(const Json& json, const std::string& file) {
  const auto known = [&](const char* key) -> std::optional<double> {
    const Json* found = find_pointer(json, std::string("/") + key);
    if (found != nullptr && found->is_object() && found->contains("value")) found = &(*found)["value"];
    if (found == nullptr || found->is_null()) return std::nullopt;
    if (!found->is_number()) throw InputError(fmt::format("{}: /{}: expected a number", file, key));
    return found->get<double>();
  };
  const auto value = [&](const char* key) {
    const auto found = known(key);
    if (!found) throw InputError(fmt::format("{}: /{}: a number is missing here", file, key));
    return *found;
  };
  BedDescription bed;
  bed.reduced = json.is_object() && json.value("units", "SI") == "reduced";
  bed.count = value("count");
  bed.diameter = value("diameter"), bed.second_diameter = known("second_diameter");
  bed.mass = known("mass"), bed.gravity = known("gravity"), bed.tilt = known("tilt");
  bed.width = value("width");
  bed.periodic = json.value("periodic", false);
  bed.amplitude = known("amplitude"), bed.frequency = known("frequency");
  bed.bath_temperature = value("bath_temperature");
  bed.restitution = known("restitution"), bed.friction = known("friction");
  bed.height_origin = json.value("height_origin", bed.height_origin);
  if (!(bed.diameter > 0) || !(bed.width > 0)) throw InputError(file + ": diameter and width must be above 0");
  return bed;
}

BedDescription BedDescription::read(const std::filesystem::path& path) {
  return from_json(read_json(path), path.string());
}

bool same_fact(double one, double other) {
  return std::abs(one - other) <= 1e-9 * std::max(std::abs(one), std::abs(other));
}

}  // namespace shakebed::pipelines
