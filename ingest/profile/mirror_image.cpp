#include "ingest/profile/mirror_image.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "ingest/find/nearby.hpp"
#include "ingest/profile/floor.hpp"

namespace shakebed::ingest {

namespace {

// D: how far an image may be from the mirrored place of its bead.
constexpr double place_tolerance = 0.15;
// D: no bead's centre is nearer to the floor. Rows of a crystal mirror one another too, about a row of beads.
constexpr double free_of_centres = 0.35;
// D: from a bead near the floor to its image, at most.
constexpr double farthest_image = 3;
constexpr std::size_t fewest_images = 5;
// Share of the disks below the row that must be images. By chance a tenth is.
constexpr double most_are_images = 0.8;
// Images are dimmer than beads, by what the floor does not reflect: of the contrast of the beads at most.
constexpr double brightest_image = 0.93;
constexpr double frames_that_show_it = 0.6;
constexpr std::size_t enough_mirrored_frames = 20, most_rows_tried = 40;

// One frame's disks of the most frequent size, in units of the diameter.
class MirrorSearch {
 public:
  MirrorSearch(const FrameFindings& frame, double diameter_px) {
    for (const FoundDisk& disk : frame.disks)
      if (!disk.other_size && !disk.cut)
        disks_.push_back({disk.x_px / diameter_px, disk.y_px / diameter_px, disk.contrast});
  }

  std::optional<double> row() const {
    if (disks_.size() < 2 * fewest_images) return {};
    const Nearby places(disks_.size(), farthest_image,
                        [&](std::size_t i) { return std::pair(disks_[i].x, disks_[i].y); });
    const Nearby exact(disks_.size(), place_tolerance,
                       [&](std::size_t i) { return std::pair(disks_[i].x, disks_[i].y); });
    std::size_t tried = 0;
    for (const double row : rows_between_pairs(places)) {
      if (++tried > most_rows_tried) break;
      if (mirrors(row, exact)) return row;
    }
    return {};
  }

 private:
  struct Disk {
    double x = 0, y = 0, contrast = 1;
  };

  // Rows half way between many pairs of disks that lie above one another, the lowest first.
  std::vector<double> rows_between_pairs(const Nearby& places) const {
    constexpr double step = place_tolerance;
    std::map<long, std::pair<std::size_t, double>, std::greater<>> rows;  // pairs, and the sum of their rows
    places.pairs([&](std::size_t i, std::size_t j) {
      if (std::abs(disks_[i].x - disks_[j].x) > place_tolerance) return false;
      const double row = 0.5 * (disks_[i].y + disks_[j].y);
      auto& [count, sum] = rows[std::lround(row / step)];
      ++count, sum += row;
      return false;
    });
    std::vector<double> found;
    for (auto at = rows.begin(); at != rows.end(); ++at) {
      auto [count, sum] = at->second;
      if (const auto next = std::next(at); next != rows.end() && next->first == at->first - 1)
        count += next->second.first, sum += next->second.second;
      if (count >= fewest_images) found.push_back(sum / static_cast<double>(count));
    }
    return found;
  }

  bool mirrors(double row, const Nearby& exact) const {
    std::size_t below = 0, images = 0;
    double contrast_of_images = 0, contrast_of_beads = 0;
    for (const Disk& disk : disks_) {
      if (std::abs(disk.y - row) < free_of_centres) return false;
      if (disk.y < row) continue;
      ++below;
      exact.any_near(disk.x, 2 * row - disk.y, [&](std::size_t i) {
        ++images;
        contrast_of_images += disk.contrast, contrast_of_beads += disks_[i].contrast;
        return true;
      });
    }
    return images >= fewest_images && static_cast<double>(images) >= most_are_images * static_cast<double>(below) &&
           contrast_of_images < brightest_image * contrast_of_beads;
  }

  std::vector<Disk> disks_;
};

}  // namespace

std::optional<double> find_mirror_row(const std::vector<FrameFindings>& frames, double diameter_px) {
  const std::size_t looked_at = std::min(frames.size(), enough_mirrored_frames);
  std::vector<double> rows;
  for (std::size_t k = 0; k < looked_at; ++k)
    if (const auto row = MirrorSearch(frames[k], diameter_px).row()) rows.push_back(*row * diameter_px);
  if (rows.empty() || static_cast<double>(rows.size()) < frames_that_show_it * static_cast<double>(looked_at))
    return {};
  return quantile(std::move(rows), 0.5);
}

}  // namespace shakebed::ingest
