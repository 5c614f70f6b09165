#include "pipelines/formats/bed.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

double BedDescription::gamma() const {
  if (gravity <= 0) return 0;
  const double omega = 2 * std::numbers::pi * frequency;
  return amplitude * omega * omega / gravity;
}

Json BedDescription::to_json() const {
  const auto unit = [&](const char* si, const char* own) { return reduced ? own : si; };
  Json out;
  out["units"] = reduced ? "reduced" : "SI";
  out["count"] = count;
  out["diameter"] = quantity_json(diameter, unit("m", "D"));
  out["mass"] = quantity_json(mass, unit("kg", "m"));
  out["gravity"] = quantity_json(gravity, unit("m/s^2", "g"));
  out["width"] = quantity_json(width, unit("m", "D"));
  out["periodic"] = periodic;
  out["amplitude"] = quantity_json(amplitude, unit("m", "D"));
  out["frequency"] = quantity_json(frequency, unit("Hz", "sqrt(g/D)"));
  out["bath_temperature"] = quantity_json(bath_temperature, "m g D");
  out["restitution"] = restitution;
  out["friction"] = friction;
  out["column_number"] = column_number();
  out["gamma"] = gamma();
  return out;
}

BedDescription BedDescription::from_json(const Json& json, const std::string& file) {
  const auto value = [&](const char* key) -> double {
    const Json* found = find_pointer(json, std::string("/") + key);
    if (found != nullptr && found->is_object() && found->contains("value")) found = &(*found)["value"];
    if (found == nullptr || !found->is_number())
      throw InputError(fmt::format("{}: /{}: a number is missing here", file, key));
    return found->get<double>();
  };
  BedDescription bed;
  bed.reduced = json.is_object() && json.value("units", "SI") == "reduced";
  bed.count = static_cast<std::uint64_t>(value("count"));
  bed.diameter = value("diameter"), bed.mass = value("mass"), bed.gravity = value("gravity"),
  bed.width = value("width");
  bed.periodic = json.value("periodic", false);
  bed.amplitude = value("amplitude"), bed.frequency = value("frequency");
  bed.bath_temperature = value("bath_temperature");
  bed.restitution = value("restitution"), bed.friction = value("friction");
  if (!(bed.diameter > 0) || !(bed.width > 0)) throw InputError(file + ": diameter and width must be above 0");
  return bed;
}

BedDescription BedDescription::read(const std::filesystem::path& path) {
  return from_json(read_json(path), path.string());
}

}  // namespace shakebed::pipelines
