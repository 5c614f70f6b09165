// bed.json: what a stage that made a bed (simulate, or the user for photographs) tells those that follow. SI units with
// `reduced` false, else lengths in D, masses in m, times in sqrt(D/g).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

struct BedDescription {
  bool reduced = false;
  std::uint64_t count = 0;      // N
  double diameter = 1;          // D, of the first species
  double mass = 1;              // m
  double gravity = 1;           // g; 0 for a weightless scene
  double width = 0;             // W, between the sides
  bool periodic = false;        // sides
  double amplitude = 0;         // a of the floor, 0 when it stands still
  double frequency = 0;         // f of the floor
  double bath_temperature = 0;  // T of the reservoir [m g D], 0 without
  double restitution = 1;       // disk on disk
  double friction = 0;          // disk on disk

  // N D/W: disks per diameter of width.
  double column_number() const { return static_cast<double>(count) * diameter / width; }
  // Gamma = a (2 pi f)^2/g, 0 for a floor that stands still.
  double gamma() const;

  Json to_json() const;
  static BedDescription from_json(const Json& json, const std::string& file);  // throws InputError
  static BedDescription read(const std::filesystem::path& path);               // throws InputError
};

}  // namespace shakebed::pipelines
