#include "ingest/find/learn_from_part.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace shakebed::ingest {

namespace {

constexpr double side_radii = 40;  // of the part: 460 packed beads fit in
// A large frame: px, and how many times the part.
constexpr double large_px = 1e6, much_larger = 4;
constexpr std::ptrdiff_t fewest_learned_from = 30;  // beads
constexpr double clearly_another = 0.05;            // of the radius

// One in which there is background beside the beads, if there is any.
std::optional<PicturePart> part_of(const GrayFrame& frame, double radius_px, const Places& beads) {
  const int side = static_cast<int>(side_radii * radius_px);
  if (static_cast<double>(frame.pixels.size()) < std::max(large_px, much_larger * side * side)) return std::nullopt;
  const PicturePart part = part_half_filled(beads, side, frame.width, frame.height)
                               .value_or(part_with_most(beads, side, frame.width, frame.height));
  const auto in_part =
      std::count_if(beads.begin(), beads.end(), [&](const auto& bead) { return part.holds(bead.first, bead.second); });
  return in_part < fewest_learned_from ? std::nullopt : std::optional(part);
}

}  // namespace

CalibrationResult learn_finder_from_part(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                                         const Places& beads) {
  const auto part =
      frames.size() == 1 && options.radius_px ? part_of(*frames.front(), *options.radius_px, beads) : std::nullopt;
  if (!part) return learn_finder(frames, options);
  const GrayFrame cut = cut_out(*frames.front(), *part);
  const CalibrationResult there = learn_finder({&cut}, options);
  FindOptions from_there = options;
  if (there.complete && std::abs(there.calibration.rim_radius_px / *options.radius_px - 1) > clearly_another)
    from_there.radius_px = there.calibration.rim_radius_px;
  return learn_finder(frames, from_there);
}

}  // namespace shakebed::ingest
