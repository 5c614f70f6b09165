#include "pipelines/formats/quantity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {
namespace {

struct Unit {
  std::string_view name;
  Dimension dimension;
  int exponent;       // the unit is factor * 10^exponent SI units
  double factor = 1;  // exactly 1 where a power of ten says it all
};

constexpr Dimension newton{.length = 1, .mass = 1, .time = -2};
constexpr Dimension pascal{.length = -1, .mass = 1, .time = -2};
constexpr std::array units = std::to_array<Unit>({
    {"m", dimension::length, 0},
    {"km", dimension::length, 3},
    {"dm", dimension::length, -1},
    {"cm", dimension::length, -2},
    {"mm", dimension::length, -3},
    {"um", dimension::length, -6},
    {"µm", dimension::length, -6},
    {"μm", dimension::length, -6},
    {"nm", dimension::length, -9},
    {"s", dimension::time, 0},
    {"ms", dimension::time, -3},
    {"us", dimension::time, -6},
    {"µs", dimension::time, -6},
    {"μs", dimension::time, -6},
    {"ns", dimension::time, -9},
    {"min", dimension::time, 0, 60},
    {"h", dimension::time, 0, 3600},
    {"Hz", dimension::frequency, 0},
    {"kHz", dimension::frequency, 3},
    {"mHz", dimension::frequency, -3},
    {"kg", dimension::mass, 0},
    {"g", dimension::mass, -3},
    {"mg", dimension::mass, -6},
    {"ug", dimension::mass, -9},
    {"µg", dimension::mass, -9},
    {"t", dimension::mass, 3},
    {"N", newton, 0},
    {"mN", newton, -3},
    {"Pa", pascal, 0},
    {"kPa", pascal, 3},
    {"J", dimension::energy, 0},
    {"mJ", dimension::energy, -3},
    {"uJ", dimension::energy, -6},
    {"nJ", dimension::energy, -9},
    {"W", dimension::power, 0},
    {"mW", dimension::power, -3},
    {"px", dimension::pixels, 0},
    {"pixel", dimension::pixels, 0},
    {"pixels", dimension::pixels, 0},
    {"rad", dimension::angle, 0},
    {"deg", dimension::angle, 0, std::numbers::pi / 180},
    {"degrees", dimension::angle, 0, std::numbers::pi / 180},
    {"°", dimension::angle, 0, std::numbers::pi / 180},
    {"%", dimension::none, -2},
    {"1", dimension::none, 0},
});

const Unit* find_unit(std::string_view name) {
  const auto found = std::find_if(units.begin(), units.end(), [&](const Unit& unit) { return unit.name == name; });
  return found == units.end() ? nullptr : &*found;
}

// The unit that was meant, or "". At most half of a word may differ: "rpm" is no misspelled "m". A unit that stands
// alone is of the dimension wanted.
std::string_view nearest_unit(std::string_view name, const Dimension* wanted) {
  std::string_view best;
  int best_distance = 1 + static_cast<int>(name.size()) / 2;
  for (const Unit& unit : units) {
    const int distance = edit_distance(unit.name, name);
    if ((wanted == nullptr || unit.dimension == *wanted) && distance < best_distance)
      best_distance = distance, best = unit.name;
  }
  return best;
}

struct ReadUnit {
  Dimension dimension;
  int exponent = 0;
  double factor = 1;
};

// unit = term {('*' | '·' | ' ' | '/') term}, term = name ['^' integer | ² | ³]
ReadUnit read_unit(std::string_view text, std::string_view whole, const Dimension* wanted) {
  ReadUnit result;
  std::size_t i = 0;
  int sign = 1;
  const auto starts = [&](std::string_view what) { return text.substr(i, what.size()) == what; };
  while (true) {
    while (i < text.size() && text[i] == ' ') ++i;
    const std::size_t begin = i;
    while (i < text.size() && text[i] != '/' && text[i] != '*' && text[i] != ' ' && text[i] != '^' && !starts("²") &&
           !starts("³") && !starts("·")) {
      ++i;
    }
    const std::string_view name = text.substr(begin, i - begin);
    if (name.empty()) throw std::invalid_argument(fmt::format("\"{}\": a unit is missing", whole));
    const Unit* unit = find_unit(name);
    if (unit == nullptr) {
      const std::string_view nearest = nearest_unit(name, name.size() == text.size() ? wanted : nullptr);
      throw std::invalid_argument(fmt::format("\"{}\": there is no unit \"{}\"{}", whole, name,
                                              nearest.empty() ? "" : fmt::format("; did you mean \"{}\"?", nearest)));
    }
    int power = 1;
    if (starts("²"))
      power = 2, i += std::string_view("²").size();
    else if (starts("³"))
      power = 3, i += std::string_view("³").size();
    else if (starts("^")) {
      ++i;
      const auto [end, error] = std::from_chars(text.data() + i, text.data() + text.size(), power);
      if (error != std::errc() || std::abs(power) > 9)
        throw std::invalid_argument(fmt::format("\"{}\": ^ needs a whole number after it", whole));
      i = static_cast<std::size_t>(end - text.data());
    }
    power *= sign;
    result.dimension.length += power * unit->dimension.length;
    result.dimension.mass += power * unit->dimension.mass;
    result.dimension.time += power * unit->dimension.time;
    result.dimension.pixel += power * unit->dimension.pixel;
    result.dimension.angle += power * unit->dimension.angle;
    result.exponent += power * unit->exponent;
    if (unit->factor != 1) result.factor *= std::pow(unit->factor, power);
    while (i < text.size() && text[i] == ' ') ++i;
    if (i >= text.size()) return result;
    sign = 1;
    if (text[i] == '/')
      sign = -1, ++i;
    else if (text[i] == '*')
      ++i;
    else if (starts("·"))
      i += std::string_view("·").size();
  }
}

std::string_view without_spaces(std::string_view text) {
  const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

}  // namespace

std::string name_of(const Dimension& d) {
  if (d == dimension::none) return "a plain number";
  if (d == dimension::length) return "a length";
  if (d == dimension::area) return "an area";
  if (d == dimension::time) return "a time";
  if (d == dimension::frequency) return "a frequency";
  if (d == dimension::velocity) return "a velocity";
  if (d == dimension::acceleration) return "an acceleration";
  if (d == dimension::mass) return "a mass";
  if (d == dimension::density) return "a mass density";
  if (d == dimension::energy) return "an energy";
  if (d == dimension::power) return "a power";
  if (d == dimension::pixels) return "a length in pixels";
  if (d == dimension::length_per_pixel) return "a scale (length per pixel)";
  if (d == dimension::angle) return "an angle";
  return "a quantity in " + si_unit(d);
}

std::string si_unit(const Dimension& d) {
  if (d == dimension::frequency) return "Hz";
  if (d == dimension::energy) return "J";
  if (d == dimension::power) return "W";
  if (d == newton) return "N";
  if (d == pascal) return "Pa";
  std::string top, bottom;
  const auto add = [&](std::string_view name, int power) {
    if (power == 0) return;
    std::string& side = power > 0 ? top : bottom;
    if (power > 0 && !side.empty()) side += '*';
    if (power < 0) side += '/';
    side += name;
    if (std::abs(power) > 1) side += fmt::format("^{}", std::abs(power));
  };
  add("kg", d.mass), add("m", d.length), add("rad", d.angle), add("px", d.pixel), add("s", d.time);
  if (top.empty() && !bottom.empty()) top = "1";
  return top + bottom;
}

std::string example_of(const Dimension& d) {
  if (d == dimension::length) return "2.99 mm";
  if (d == dimension::time) return "10 s";
  if (d == dimension::frequency) return "20 Hz";
  if (d == dimension::velocity) return "0.3 m/s";
  if (d == dimension::acceleration) return "9.81 m/s^2";
  if (d == dimension::mass) return "37.8 mg";
  if (d == dimension::density) return "2700 kg/m^3";
  if (d == dimension::length_per_pixel) return "0.15 mm/px";
  if (d == dimension::angle) return "1.5 deg";
  if (d == dimension::pixels) return "20 px";
  return "1 " + si_unit(d);
}

Quantity parse_quantity(std::string_view whole, const Dimension* wanted) {
  const std::string_view text = without_spaces(whole);
  if (text.empty()) throw std::invalid_argument("the string is empty");
  // The number: what from_chars takes, checked for words that it takes too.
  const std::size_t start = text.front() == '+' ? 1 : 0;
  double plain = 0;
  const auto [end, error] = std::from_chars(text.data() + start, text.data() + text.size(), plain);
  if (error == std::errc::invalid_argument) {
    throw std::invalid_argument(fmt::format("\"{}\" does not begin with a number", whole));
  }
  const std::string number(text.data() + start, end);
  if (!std::isdigit(static_cast<unsigned char>(number.back())) && number.back() != '.') {
    throw std::invalid_argument(fmt::format("\"{}\" is not finite", whole));
  }
  const std::string_view unit_text =
      without_spaces(std::string_view(end, static_cast<std::size_t>(text.data() + text.size() - end)));
  ReadUnit unit;
  if (!unit_text.empty()) unit = read_unit(unit_text, whole, wanted);
  // Shift the decimal exponent in the text, so that 2.99 mm is rounded once.
  const std::size_t e = number.find_first_of("eE");
  long exponent = unit.exponent;
  if (e != std::string::npos) {
    std::string_view digits = std::string_view(number).substr(e + 1);
    if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
    long written = 0;
    const auto [exponent_end, exponent_error] = std::from_chars(digits.data(), digits.data() + digits.size(), written);
    (void)exponent_end;
    if (exponent_error != std::errc() || std::abs(written) > 100000) {
      throw std::invalid_argument(fmt::format("\"{}\": its exponent is too large", whole));
    }
    exponent += written;
  }
  const std::string shifted = number.substr(0, e) + "e" + std::to_string(exponent);
  double value = std::strtod(shifted.c_str(), nullptr) * unit.factor;
  if (!std::isfinite(value))
    throw std::invalid_argument(fmt::format("\"{}\" is beyond the largest possible number", whole));
  return {value, unit.dimension, !unit_text.empty()};
}

double parse_quantity(std::string_view text, const Dimension& wanted) {
  const Quantity quantity = parse_quantity(text, &wanted);
  if (!quantity.has_unit) return quantity.value;
  if (quantity.dimension != wanted) {
    throw std::invalid_argument(
        fmt::format("\"{}\" is {}, but {} is needed", text, name_of(quantity.dimension), name_of(wanted)));
  }
  return quantity.value;
}

double in_unit_of_result(const Quantity& quantity, const std::string& unit, std::string_view called) {
  if (!quantity.has_unit) return quantity.value;
  Quantity one;
  try {
    one = parse_quantity("1 " + unit);
  } catch (const std::invalid_argument&) {
    throw std::invalid_argument(fmt::format("the result is in \"{}\", so {} must be a plain number", unit, called));
  }
  if (one.dimension != quantity.dimension)
    throw std::invalid_argument(
        fmt::format("the result is in \"{}\", but {} is {}", unit, called, name_of(quantity.dimension)));
  return quantity.value / one.value;
}

std::string quantity_text(double value, const Dimension& dimension) {
  const std::string unit = si_unit(dimension);
  return unit.empty() ? number_text(value) : number_text(value) + " " + unit;
}

std::string per_cent(double relative) {
  const double percent = 100 * relative;
  return std::abs(percent) < 99.5 ? fmt::format("{:.2g} %", percent) : fmt::format("{:.0f} %", percent);
}

std::string handy_text(double value, const Dimension& d) {
  struct Handy {
    Dimension dimension;
    double factor;
    std::string_view name;
  };
  static constexpr std::array table = std::to_array<Handy>({
      {dimension::length, 1, "m"},
      {dimension::length, 1e-3, "mm"},
      {dimension::length, 1e-6, "um"},
      {dimension::time, 1, "s"},
      {dimension::time, 1e-3, "ms"},
      {dimension::time, 1e-6, "us"},
      {dimension::mass, 1, "kg"},
      {dimension::mass, 1e-3, "g"},
      {dimension::mass, 1e-6, "mg"},
      {dimension::length_per_pixel, 1e-3, "mm/px"},
      {dimension::frequency, 1, "Hz"},
  });
  const Handy* best = nullptr;
  for (const Handy& row : table) {
    if (row.dimension != d) continue;
    best = &row;
    if (std::abs(value) >= row.factor * (d == dimension::length ? 0.999 : 0.0999) || value == 0) break;
  }
  if (best == nullptr) {
    const std::string unit = si_unit(d);
    return fmt::format("{:.6g}{}{}", value, unit.empty() ? "" : " ", unit);
  }
  return fmt::format("{:.6g} {}", value / best->factor, best->name);
}

std::string likely_quantity(std::string_view number, double value, const Dimension& d) {
  // Beads and boxes of 0.1 m and more are rare: such a number was meant in millimetres.
  constexpr double largest_in_metres = 0.1;
  std::string unit = si_unit(d);
  if (d == dimension::length && std::abs(value) >= largest_in_metres) unit = "mm";
  if (d == dimension::length_per_pixel && std::abs(value) >= 1e-3) unit = "mm/px";
  if (d == dimension::angle) unit = "deg";
  return fmt::format("{} {}", without_spaces(number), unit);
}

int edit_distance(std::string_view a, std::string_view b) {
  std::vector<int> before(b.size() + 1), previous(b.size() + 1), current(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) previous[j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    current[0] = static_cast<int>(i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      current[j] = std::min({previous[j] + 1, current[j - 1] + 1, previous[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        current[j] = std::min(current[j], before[j - 2] + 1);
    }
    std::swap(before, previous);
    std::swap(previous, current);
  }
  return previous[b.size()];
}

std::string nearest_name(std::string_view word, const std::vector<std::string>& names) {
  std::string best;
  int best_distance = 1 + static_cast<int>(word.size()) / 3;
  for (const std::string& name : names) {
    const int distance = edit_distance(word, name);
    // A word that continues or begins the other is near whatever its length ("freq" for "frequency").
    const bool begins = word.size() >= 3 && (name.starts_with(word) || word.starts_with(name));
    const int rank = begins ? std::min(distance, best_distance) : distance;
    if (rank <= best_distance && (best.empty() || rank < best_distance)) best = name, best_distance = rank;
  }
  return best;
}

}  // namespace shakebed::pipelines
