#include "ingest/profile/bed_doubts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/find/nearby.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "ingest/profile/touching_distance.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

constexpr double near_radii = 2.2, far_radii = 4;  // between centres
constexpr std::size_t enough_frames = 20;
// Contacts are missing when so many are expected, and fewer than this share of them is seen.
constexpr double fewest_expected = 10, most_seen = 0.1;
// Diameters: beads lit from above, of which the bright core alone was seen, 1.21; pores of a shell 1.6.
constexpr double farthest_of_beads = 1.4;
// Diameters: beads that lie a little behind one another in a narrow cell 0.995, disks outlined with their shadows 0.94.
constexpr double nearest_of_beads = 0.96;
// Diameters: beads of one size in one layer are not nearer. A tenth is left to errors of centres and of the radius.
constexpr double nearest_in_layer = 0.9;
// The lowest disks lie on an arc when so many columns show them, it sags by so much, and it leaves less than this share
// of the squares that a straight line leaves. A bed at rest on a level floor sags by 0; a single photograph of a dilute
// bed, whose lowest disks lie at random heights, leaves 0.6 or more.
constexpr std::size_t fewest_points = 10;
constexpr double least_sag_diameters = 2, most_left = 0.25;

// Disks are beside the bed when they are few, and no centre lies in a column between them and the bed that would hold
// so many, were the bed everywhere as full as in its middle.
constexpr std::size_t fewest_of_bed = 30;
constexpr double most_beside = 0.06, widest_gap_diameters = 2, widest_gap_spacings = 12;

}  // namespace

bool Contacts::missing() const { return expected >= fewest_expected && seen < most_seen * expected; }

bool Contacts::overlapping(double diameter_px) const {
  return seen >= fewest_expected && nearest_px < nearest_of_beads * diameter_px;
}

bool Contacts::far_apart(double diameter_px) const { return missing() && nearest_px > farthest_of_beads * diameter_px; }

Contacts contacts_of(const std::vector<FrameFindings>& frames, double radius_px) {
  const double near = near_radii * radius_px, far = far_radii * radius_px, touching = 2 * radius_px;
  Contacts contacts;
  double farther = 0;
  std::vector<double> nearest_of_all;
  for (std::size_t k = 0; k < std::min(frames.size(), enough_frames); ++k) {
    std::vector<FoundDisk> disks;
    for (const FoundDisk& disk : frames[k].disks)
      if (!disk.other_size) disks.push_back(disk);
    std::vector<double> nearest(disks.size(), far);
    Nearby(disks.size(), far, [&](std::size_t i) {
      return std::pair(disks[i].x_px, disks[i].y_px);
    }).pairs([&](std::size_t i, std::size_t j) {
      const double away = std::hypot(disks[i].x_px - disks[j].x_px, disks[i].y_px - disks[j].y_px);
      ++(away < near ? contacts.seen : farther);
      nearest[i] = std::min(nearest[i], away), nearest[j] = std::min(nearest[j], away);
      return false;
    });
    for (const double away : nearest)
      if (away < far) nearest_of_all.push_back(away);
  }
  contacts.expected = farther * (near * near - touching * touching) / (far * far - near * near);
  contacts.nearest_px = contacts.touching_px = quantile(std::move(nearest_of_all), 0.5);
  if (const auto distance = touching_distance(frames, radius_px)) contacts.touching_px = distance->px;
  return contacts;
}

double overlapping_too_many(const std::vector<FoundDisk>& disks, double touching_px) {
  std::vector<const FoundDisk*> of_one_size;
  for (const FoundDisk& disk : disks)
    if (!disk.other_size) of_one_size.push_back(&disk);
  const double nearest = nearest_in_layer * touching_px;
  std::vector<bool> overlaps(of_one_size.size(), false);
  Nearby(of_one_size.size(), nearest, [&](std::size_t i) {
    return std::pair(of_one_size[i]->x_px, of_one_size[i]->y_px);
  }).pairs([&](std::size_t i, std::size_t j) {
    const double away =
        std::hypot(of_one_size[i]->x_px - of_one_size[j]->x_px, of_one_size[i]->y_px - of_one_size[j]->y_px);
    if (away < nearest) overlaps[i] = overlaps[j] = true;
    return false;
  });
  return 0.5 * static_cast<double>(std::count(overlaps.begin(), overlaps.end(), true));
}

BedEnds ends_of_bed(const std::vector<FrameFindings>& frames, double radius_px) {
  std::vector<double> centres;
  for (const FrameFindings& frame : frames)
    frame.for_each_disk([&](const FoundDisk& disk) { centres.push_back(disk.x_px); });
  BedEnds bed;
  if (centres.size() < fewest_of_bed) return bed;
  std::sort(centres.begin(), centres.end());
  const auto most = static_cast<std::size_t>(most_beside * static_cast<double>(centres.size()));
  const double middle_half = centres[centres.size() * 3 / 4] - centres[centres.size() / 4];
  // Px between neighbouring centres, were the bed everywhere as full as its middle half.
  const double spacing = std::max(middle_half / (0.5 * static_cast<double>(centres.size())), 1e-6);
  const double widest = std::max(2 * radius_px * widest_gap_diameters, widest_gap_spacings * spacing);
  for (std::size_t k = 0; k < most; ++k)
    if (centres[k + 1] - centres[k] > widest) bed.left_px = 0.5 * (centres[k] + centres[k + 1]);
  for (std::size_t k = 0; k < most; ++k) {
    const double outer = centres[centres.size() - 1 - k], inner = centres[centres.size() - 2 - k];
    if (outer - inner > widest) bed.right_px = 0.5 * (outer + inner);
  }
  return bed;
}

PixelRectangle region_between(const BedEnds& ends, int frame_width, int frame_height) {
  const int left = static_cast<int>(std::max(0.0, ends.left_px));
  const int right = static_cast<int>(std::min<double>(frame_width, ends.right_px));
  return {left, 0, right - left, frame_height};
}

double sag_of_floor(const FloorPoints& lowest, double diameter_px) {
  if (lowest.size() < fewest_points) return 0;
  const auto [first, last] = std::minmax_element(lowest.begin(), lowest.end());
  const double middle = 0.5 * (first->first + last->first), half = 0.5 * (last->first - first->first);
  // Least squares by a polynomial of this many terms: what is left, and its last coefficient.
  const auto fitted = [&](std::size_t terms) {
    std::vector<double> matrix(terms * terms, 0.0), right(terms, 0.0);
    double squares = 0;
    for (const auto& [x, y] : lowest) {
      const double u = (x - middle) / half;
      const std::array<double, 3> powers = {1, u, u * u};
      for (std::size_t a = 0; a < terms; ++a) {
        right[a] += powers[a] * y;
        for (std::size_t b = 0; b < terms; ++b) matrix[a * terms + b] += powers[a] * powers[b];
      }
    }
    if (!solve_symmetric(matrix, right, terms)) return std::pair(0.0, 0.0);
    for (const auto& [x, y] : lowest) {
      const double u = (x - middle) / half;
      double level = right[0] + right[1] * u;
      if (terms > 2) level += right[2] * u * u;
      squares += (y - level) * (y - level);
    }
    return std::pair(squares, right.back());
  };
  const auto [left_by_line, slope] = fitted(2);
  const auto [left_by_arc, bend] = fitted(3);
  const bool arc = std::abs(bend) > least_sag_diameters * diameter_px && left_by_arc < most_left * left_by_line;
  return arc ? std::abs(bend) : 0;
}

std::vector<std::string> doubts_of_bed(const Measurement& found, double bead_diameter_m) {
  std::vector<std::string> doubts;
  const Contacts& contacts = found.contacts;
  if (contacts.missing())
    doubts.push_back(
        formatted("Hardly any of the disks found touch: nearest centres are typically %.2f diameters apart. They may "
                  "not be beads, but holes or printed dots. Or the outline seen is smaller than the bead, and scale, "
                  "heights and density are wrong. If neighbouring beads touch, give --scale \"%.4g mm/px\".",
                  contacts.nearest_px * found.calibration.scale_m_per_px / bead_diameter_m,
                  1e3 * bead_diameter_m / contacts.touching_px));
  if (contacts.overlapping(bead_diameter_m / found.calibration.scale_m_per_px))
    doubts.push_back(formatted(
        "The disks found overlap: nearest centres are typically %.2f diameters apart. The outline seen is larger than "
        "the bead (a shadow or a halo), or beads lie behind one another. If neighbouring beads touch, give --scale "
        "\"%.4g mm/px\".",
        contacts.nearest_px * found.calibration.scale_m_per_px / bead_diameter_m,
        1e3 * bead_diameter_m / contacts.touching_px));
  if (found.beside_bed > 0)
    doubts.push_back(
        formatted("%zu disks beside the bed, separated from it by an empty region, were left out. To search only the "
                  "bed, give --roi "
                  "%d,%d,%d,%d.",
                  found.beside_bed, found.bed_region.left, found.bed_region.top, found.bed_region.width,
                  found.bed_region.height));
  if (found.floor_sag > 0)
    doubts.push_back(formatted(
        "No level floor is seen: the lowest disks lie on an arc that sags by %.1f diameters. A photograph from above "
        "gives neither heights nor a temperature. In a photograph from the side, give the row of the floor (--floor).",
        found.floor_sag));
  return doubts;
}

}  // namespace shakebed::ingest
