// Quantities with units, at the edge of the program: "2.99 mm", "20 Hz", "9.81 m/s^2", "2700 kg/m^3", "0.15 mm/px".
// Inside they are doubles in SI (pixels and radians count as units of their own).
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace shakebed::pipelines {

// Powers of metre, kilogram, second, pixel and radian.
struct Dimension {
  int length = 0, mass = 0, time = 0, pixel = 0, angle = 0;
  friend bool operator==(const Dimension&, const Dimension&) = default;
};

namespace dimension {
inline constexpr Dimension none{};
inline constexpr Dimension length{.length = 1};
inline constexpr Dimension area{.length = 2};
inline constexpr Dimension time{.time = 1};
inline constexpr Dimension frequency{.time = -1};  // also a rate
inline constexpr Dimension velocity{.length = 1, .time = -1};
inline constexpr Dimension acceleration{.length = 1, .time = -2};
inline constexpr Dimension mass{.mass = 1};
inline constexpr Dimension density{.length = -3, .mass = 1};
inline constexpr Dimension energy{.length = 2, .mass = 1, .time = -2};
inline constexpr Dimension power{.length = 2, .mass = 1, .time = -3};
inline constexpr Dimension pixels{.pixel = 1};
inline constexpr Dimension length_per_pixel{.length = 1, .pixel = -1};
inline constexpr Dimension angle{.angle = 1};
}  // namespace dimension

// "a length", "an acceleration"; for others its SI unit.
std::string name_of(const Dimension& dimension);
// "m", "m/s^2", "m/px"; "" for a plain number.
std::string si_unit(const Dimension& dimension);
// One that people would write: "2.99 mm" for a length.
std::string example_of(const Dimension& dimension);
// A number that was written without its unit, with the unit that it is likely to have: "3 mm", "0.06 m", "20 Hz".
std::string likely_quantity(std::string_view number, double value, const Dimension& dimension);

// A number and its unit as read. Exact where the unit is a power of ten: "2.99 mm" is the double nearest 0.00299.
struct Quantity {
  double value = 0;  // in SI
  Dimension dimension;
  bool has_unit = false;
};

// Reads "number unit". Throws std::invalid_argument with a sentence: no number, unknown unit (did you mean), number
// beyond a double, NaN or infinity. A dimension that is wanted narrows the units that are suggested, nothing else.
Quantity parse_quantity(std::string_view text, const Dimension* wanted = nullptr);

// Reads a quantity of the dimension wanted; a plain number counts as SI. Throws std::invalid_argument.
double parse_quantity(std::string_view text, const Dimension& wanted);

// What is compared with a result, in the result's unit; a plain number counts as being in it. Throws
// std::invalid_argument where their kinds differ, or the unit is one that only results have ("m g D"). `called`: "the
// expected value".
double in_unit_of_result(const Quantity& quantity, const std::string& unit, std::string_view called);

// "0.00299 m": the value in the SI unit, with as many digits as give the same double back.
std::string quantity_text(double value, const Dimension& dimension);
// For people: "2.99 mm", "50 ms": six digits and a handy prefix.
std::string handy_text(double value, const Dimension& dimension);
std::string per_cent(double relative);  // two digits, or all before the point: "3.1 %", "55 %", "140 %"

// How far two words are apart: insertions, deletions, replacements and swaps of neighbours.
int edit_distance(std::string_view a, std::string_view b);
// "did you mean": the nearest of the names, or "" when none is near.
std::string nearest_name(std::string_view word, const std::vector<std::string>& names);

}  // namespace shakebed::pipelines
