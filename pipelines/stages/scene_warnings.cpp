// What is odd about a bed, though it can be simulated: said when the recipe is read, before anything runs.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pipelines/stages/scene_options.hpp"

namespace shakebed::pipelines {
namespace {

// Below 1 the floor never leaves the bed; published shaken beds lie between 1 and some 20.
constexpr double least_gamma = 1, most_gamma = 50;
// Beads of experiments are 50 um to some cm.
constexpr double largest_bead = 0.1, smallest_bead = 1e-6;  // [m]
constexpr double largest_photographed = 1;                  // [m]
// Narrower boxes hold little but the disks next to their walls.
constexpr double least_width = 5;  // [D]
// Cells of experiments are some cm to a metre wide; in a wider one, fewer disks than one a diameter of width are no
// bed.
constexpr double widest_cell = 5;  // [m]
// Shaken beds that are studied are some ten to a hundred disks high.
constexpr double highest_bed = 300;  // [D]
// A bed forgets its start over tens of periods; fewer than ten are certainly too few.
constexpr double least_settle_periods = 10;
// A width so near n D, or (n + 1/2) D where rows alternate, lets rows of disks lock between hard sides. The second
// window is half as wide as the first, so that 30.6 D, the width of beds measured beside soft spheres, lies outside.
// Both are bounded, since in wide boxes 0.5 % of the width would be everywhere.
constexpr double whole_window = 0.005, half_window = 0.0025;           // of the width
constexpr double widest_whole_window = 0.2, widest_half_window = 0.1;  // [D]
// Places between the windows, whatever the width.
constexpr std::array safe_fractions{0.3, 0.7};            // [D]
constexpr double row_distance = std::numbers::sqrt3 / 2;  // of hexagonal packing [D]

struct Commensurate {
  double multiple = 0;  // n or n + 1/2
  bool whole = false;
};
std::optional<Commensurate> commensurate(double width) {
  const double whole = std::round(width), half = std::floor(width) + 0.5;
  if (std::abs(width - whole) <= std::min(whole_window * width, widest_whole_window)) return Commensurate{whole, true};
  if (std::abs(width - half) <= std::min(half_window * width, widest_half_window)) return Commensurate{half, false};
  return std::nullopt;
}

// The nearest safe width below and above.
std::pair<double, double> safe_widths(double width) {
  double below = 0, above = INFINITY;
  for (double n = std::max(1.0, std::floor(width) - 1); n <= width + 1; ++n) {
    for (const double fraction : safe_fractions) {
      const double safe = n + fraction;
      if (safe < width) below = std::max(below, safe);
      if (safe > width) above = std::min(above, safe);
    }
  }
  return {below, above};
}

}  // namespace

std::optional<Misfit> odd_bead(double diameter) {
  if (diameter < largest_bead && diameter >= smallest_bead) return std::nullopt;
  return Misfit{fmt::format("the bead has a diameter of {}, but beads of experiments are 50 um to a few cm",
                            handy_text(diameter, dimension::length)),
                diameter >= largest_bead
                    ? fmt::format("Did you mean \"{:g} mm\"? A plain number is in metres", diameter)
                    : "Check its unit"};
}

std::optional<std::string> odd_gamma(double gamma) {
  if (gamma >= least_gamma && gamma <= most_gamma) return std::nullopt;
  return gamma < least_gamma ? std::string("Below Gamma = 1 the floor never throws the bed, which stays at rest on it")
                             : fmt::format("Shaken beds are studied at Gamma from 1 to {:g}", most_gamma);
}

std::optional<Misfit> impossible_bead(double diameter) {
  return diameter >= largest_photographed ? odd_bead(diameter) : std::nullopt;
}

void warn_of_bead(Fields& fields, std::string_view pointer_below, double diameter) {
  if (const auto odd = odd_bead(diameter)) fields.warn("bead", pointer_below, odd->what, odd->suggestion);
}

double SceneOptions::gamma() const {
  // As written, where it was: what follows from the amplitude differs from it in the last digit.
  const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion);
  return sine != nullptr && sine->gamma ? *sine->gamma : description().gamma();
}

// Hexagonal packing in rows as long as fit.
double SceneOptions::height_at_rest() const {
  const double width = box_.width / length_unit();
  double area = disks_.count;
  if (disks_.second) area += disks_.second->count * std::pow(disks_.second->diameter / disks_.diameter, 2);
  const double rows = std::ceil(area / std::max(1.0, std::floor(width)));
  return 1 + (rows - 1) * row_distance;
}

std::string SceneOptions::length_text(double length) const {
  return reduced_ ? fmt::format("{:.6g}", length) : handy_text(length, dimension::length);
}

void SceneOptions::warn_of_shaking(Fields& fields) const {
  const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion);
  if (sine == nullptr || !gravity_) return;
  const double value = gamma();
  const auto odd = odd_gamma(value);
  if (!odd) return;
  const double omega = 2 * std::numbers::pi * sine->frequency;
  const std::string here = fmt::format(
      "Gamma = {:.3g}: the floor's amplitude is {} at {}", value, length_text(sine->amplitude),
      reduced_ ? fmt::format("{:.6g}", sine->frequency) : handy_text(sine->frequency, dimension::frequency));
  const std::string four =
      fmt::format("Gamma = 4 needs an amplitude of {}", length_text(4 * *gravity() / (omega * omega)));
  if (value < least_gamma)
    fields.warn("gamma below 1", sine->gamma ? "/floor/gamma" : "/floor/amplitude", here + ". " + *odd, four);
  else
    fields.warn("gamma above 50", sine->gamma ? "/floor/gamma" : "/floor/amplitude", here + ". " + *odd,
                sine->amplitude >= largest_bead && !reduced_
                    ? fmt::format("Did you mean \"{:g} mm\"? A plain number is in metres. {}", sine->amplitude, four)
                    : "Check the frequency and the amplitude. " + four);
}

void SceneOptions::warn_of_size(Fields& fields) const {
  if (!reduced_) warn_of_bead(fields, "/disks/diameter", disks_.diameter);
  const double width = box_.width / length_unit();
  if (gravity_ && width < least_width)
    fields.warn("narrow box", "/box/width",
                fmt::format("the box is {:.3g} diameters wide: nearly every disk touches a side, and what is measured "
                            "depends on the sides as much as on the disks",
                            width),
                fmt::format("Give a width of {} or more", length_text(least_width * length_unit())));
  if (gravity_ && !reduced_ && box_.width >= widest_cell && disks_.count < width)
    fields.warn("wide box", "/box/width",
                fmt::format("the box is {} ({:.4g} diameters) wide and contains {} disks, which hardly ever collide",
                            length_text(box_.width), width, disks_.count),
                fmt::format("Did you mean \"{:g} mm\"? A plain number is in metres", box_.width));
  if (gravity_ && height_at_rest() > highest_bed)
    fields.warn("high bed", "/disks/count",
                fmt::format("{} disks in a box {:.4g} diameters wide make a bed {:.0f} diameters high: shaking from "
                            "below hardly reaches its top, and the run takes a long time",
                            disks_.count, width, height_at_rest()),
                "Use fewer disks, or a wider box");
  const auto* lid = std::get_if<FixedLidOptions>(&box_.lid);
  const auto* sine = std::get_if<SinusoidalFloorOptions>(&floor_.motion);
  const double top = height_at_rest() * length_unit() + (sine != nullptr ? sine->amplitude : 0);
  if (gravity_ && lid != nullptr && lid->height < top)
    fields.warn("low lid", "/box/lid/height",
                fmt::format("the lid is {} above the floor's mean position, but the bed at rest reaches {} when the "
                            "floor is at its highest position. So the lid squeezes the bed, and the run may never end",
                            length_text(lid->height), length_text(top)),
                "Raise the lid, or use fewer disks");
}

std::optional<Misfit> SceneOptions::locking() const {
  if (!gravity_ || disks_.second || !std::holds_alternative<HardSidesOptions>(box_.sides) || slopes())
    return std::nullopt;
  const double width = box_.width / length_unit();
  const std::optional<Commensurate> near = commensurate(width);
  if (width < least_width || disks_.count < width || !near) return std::nullopt;  // no row is full
  const auto [below, above] = safe_widths(width);
  return Misfit{fmt::format("the box is {:.4g} diameters wide, {} {:g}: {} between hard sides. The temperature of a "
                            "locked bed differs from seed to seed, and such a bed makes many more collisions",
                            width, width == near->multiple ? "exactly" : "nearly", near->multiple,
                            near->whole ? "rows of disks fit exactly and can lock" : "alternate rows can lock"),
                fmt::format("Unless an experiment fixes the width, use {} ({:g} D) or {} ({:g} D)",
                            length_text(below * length_unit()), below, length_text(above * length_unit()), above)};
}

void SceneOptions::warn_of_locking(Fields& fields) const {
  if (const auto odd = locking()) fields.warn("commensurate width", "/box/width", odd->what, odd->suggestion);
}

// What is measured counts per width W of the floor, and theories are of beds with one width.
void SceneOptions::warn_of_slope(Fields& fields) const {
  if (!slopes()) return;
  const double slope = *std::get<HardSidesOptions>(box_.sides).slope, width = box_.width / length_unit();
  const double factor = 1 + 2 * height_at_rest() * std::tan(slope) / width;
  fields.warn(
      "sloped sides", "/box/sides/slope",
      fmt::format("at the surface of the bed at rest the box is {:.3g} times as wide as at the floor. Densities and N "
                  "D/W are per width W of the floor, and the theories and fits are valid for vertical sides only",
                  factor),
      "Divide a density at height z by 1 + 2 z tan(slope)/W to have it per area, and do not fit such a profile");
}

void SceneOptions::warn(Fields& fields, double settle) const {
  warn_of_slope(fields);
  warn_of_shaking(fields);
  warn_of_size(fields);
  warn_of_locking(fields);
  const double shaken = period() * time_unit();
  if (shaken <= 0 || settle >= least_settle_periods * shaken * (1 - 1e-9)) return;
  if (std::holds_alternative<FileStartOptions>(start_) || fields.has_upstream("simulate")) return;
  fields.warn("short settle", "/settle",
              fmt::format("the bed settles for {:.3g} periods of the floor before it is measured, so the results still "
                          "depend on its start",
                          settle / shaken),
              "Give a \"settle\" of " +
                  (reduced_ ? fmt::format("{:.6g}", least_settle_periods * shaken)
                            : handy_text(least_settle_periods * shaken, dimension::time)) +
                  " or longer");
}

Json SceneOptions::facts() const {
  Json out = Json::object();
  const BedDescription bed = description();
  if (gravity_ && std::holds_alternative<SinusoidalFloorOptions>(floor_.motion))
    out["gamma"] = quantity_json(gamma(), "1");
  if (gravity_) out["column_number"] = quantity_json(bed.column_number(), "1");
  out["width"] = quantity_json(box_.width / length_unit(), "D");
  return out;
}

}  // namespace shakebed::pipelines
