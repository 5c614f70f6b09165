// The description of a bed. The stage that makes the bed (simulate) or measures it (extract, for the user's own
// photographs) states it once. It is stored in bed.json beside every trajectory, frame set and profile. Later stages
// read it there. A stage that states another value is refused (see same_as_bed).
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// SI units; with `reduced` lengths in D, masses in m, times in sqrt(D/g). Heights of its profiles are above the mean
// position of the floor. Nothing where it is not known, as the mass in photographs.
struct BedDescription {
  bool reduced = false;
  double count = 0;                       // N: disks in the box, or the mean number seen in photographs
  double diameter = 1;                    // D, of the first species
  std::optional<double> second_diameter;  // of the second species, where there is one
  std::optional<double> mass;             // m
  std::optional<double> gravity;          // g, of a tilted bed in its plane; 0 for a weightless scene
  std::optional<double> tilt = {};        // of the bed's plane from the vertical [rad], where one is named
  double width = 0;                       // W, between the sides
  bool periodic = false;                  // sides
  std::optional<double> amplitude;        // a of the floor, 0 when it stands still
  std::optional<double> frequency;        // f of the floor
  double bath_temperature = 0;            // T of the reservoir [m g D], 0 without
  std::optional<double> restitution;      // disk on disk
  std::optional<double> friction;         // disk on disk
  std::string height_origin = "the floor's mean position";  // heights are above it

  // N D/W: disks per diameter of width.
  double column_number() const { return count * diameter / width; }
  // Gamma = a (2 pi f)^2/g, 0 for a floor that stands still or where g is not known.
  double gamma() const;

  Json to_json() const;
  static BedDescription from_json(const Json& json, const std::string& file);  // throws InputError
  static BedDescription read(const std::filesystem::path& path);               // throws InputError
};

// A bed that an earlier stage of a recipe has described, and where.
struct KnownBed {
  BedDescription bed;
  std::string place;  // "stage \"bed\" (/stages/0)"
  // Whether that stage keeps frames, which can be photographed. One that measures photographs has frames.
  bool keeps_frames = true;
};

// Whether two statements of one fact agree: to 1e-9.
bool same_fact(double one, double other);

}  // namespace shakebed::pipelines
