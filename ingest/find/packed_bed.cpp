#include "ingest/find/packed_bed.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/learn_from_part.hpp"
#include "ingest/find/lit_rim.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

constexpr double nearest_touch = 0.96, farthest_touch = 1.05;  // diameters between centres
constexpr double overlap_below = 0.9;                          // diameters
constexpr double beside_disk = 1.2;                            // radii: the voids between disks lie within
// A pixel is plainly not explained beyond so many times the noise and this share of the contrast.
constexpr double plainly_sigmas = 4, plainly_contrast = 0.1;
constexpr double model_contrast = 0.015;  // contrast units: what the model leaves without noise
constexpr std::size_t fewest_disks = 20;
// Drawn beds of 3.4 to 12 px: touching 0.63 (shaken) to 1, unexplained up to 0.0001. Other shapes on a lattice:
// touching up to 0.05, or unexplained from 0.009.
constexpr double least_touching = 0.5, most_overlapping = 0.02, most_unexplained = 0.003, most_misfit = 1.2;
constexpr double least_filled = 0.2;
// The line at which the dark side of a sphere begins is sharper than the model of its light: drawn layers under a lamp
// 34 to 45 degrees high 0.8 to 1.6, 30 degrees 2.2 to 2.7.
constexpr double most_misfit_of_lit = 2;
// In distances from the background the model rounds off the line at which a sphere is as bright as that. Drawn spheres
// under lamps 14 to 52 degrees high: unexplained 0.001 to 0.0092, misfit 1.1 to 1.4.
constexpr double most_unexplained_of_distances = 0.01;
// Lit disks that do not touch are beads where circles show a good part of them, where noise is so small a share of the
// contrast that other shapes would leave more than it, and where their lit rim is that circle. Drawn spheres: rms
// 0.001 to 0.005 radii, radius 0.956 to 0.994, offset up to 0.02; ellipses of 0.93 and 0.8: 0.009 to 0.011 and 0.028
// to 0.033; squares with round corners and hexagons 0.04. Neighbours that touch disturb: up to 0.008.
constexpr double least_shown = 0.3, most_noise = 0.06;
constexpr double round_lit_rim = 0.006, round_in_a_bed = 0.012, least_lit_rim = 0.93, most_lit_rim = 1.03,
                 most_lit_offset = 0.04;
constexpr double same_as_circle = 0.4;  // radii
constexpr double smallest_px = 3;       // smaller disks are specks
constexpr int part_px = 400;
// Radii: half the distance of neighbours that may be parts of disks that touch.
constexpr double nearest_apart = 1.05, farthest_apart = 1.3;
// Of largest_packed_px: a first radius is good to some 5 %. A model of larger disks would be learned in vain: of a ball
// of 100 px it took nine tenths of the time until the picture was refused.
constexpr double largest_start = 1.25;

struct Neighbours {
  double touching = 0, overlapping = 0;
};
Neighbours neighbours_of(const std::vector<FoundDisk>& disks, double diameter) {
  const Nearby near(disks.size(), farthest_touch * diameter,
                    [&](std::size_t i) { return std::pair(disks[i].x_px, disks[i].y_px); });
  double whole = 0;
  Neighbours contacts;
  for (std::size_t k = 0; k < disks.size(); ++k) {
    int touched = 0;
    bool overlaps = false;
    near.any_near(disks[k].x_px, disks[k].y_px, [&](std::size_t i) {
      if (i == k) return false;
      const double away = std::hypot(disks[i].x_px - disks[k].x_px, disks[i].y_px - disks[k].y_px) / diameter;
      touched += away >= nearest_touch && away <= farthest_touch;
      overlaps = overlaps || away < overlap_below;
      return false;
    });
    contacts.overlapping += overlaps;
    if (disks[k].cut) continue;
    ++whole;
    contacts.touching += touched >= 2;
  }
  contacts.touching /= std::max(1.0, whole);
  contacts.overlapping /= std::max(1.0, static_cast<double>(disks.size()));
  return contacts;
}

// The upright rectangle round the disks.
class Extent {
 public:
  explicit Extent(const std::vector<FoundDisk>& disks) {
    for (const FoundDisk& disk : disks) {
      left_ = std::min(left_, disk.x_px - disk.radius_px), right_ = std::max(right_, disk.x_px + disk.radius_px);
      top_ = std::min(top_, disk.y_px - disk.radius_px), bottom_ = std::max(bottom_, disk.y_px + disk.radius_px);
    }
  }
  [[nodiscard]] bool holds(double x, double y) const { return x >= left_ && x <= right_ && y >= top_ && y <= bottom_; }

 private:
  double left_ = HUGE_VAL, right_ = -HUGE_VAL, top_ = HUGE_VAL, bottom_ = -HUGE_VAL;
};

bool is_small(const PackedBed& bed) {
  const double radius = bed.faces.calibration.radius_px;
  return bed.faces.found && radius >= smallest_px && radius <= largest_packed_px;
}

}  // namespace

bool Packing::describes() const {
  const bool touch = touching >= least_touching && misfit <= (lit ? most_misfit_of_lit : most_misfit);
  const bool are_shown = lit && unevenness <= round_lit_rim && shown >= least_shown && noise <= most_noise &&
                         misfit <= (distances ? most_misfit_of_lit : most_misfit);
  return disks >= fewest_disks && overlapping <= most_overlapping &&
         unexplained <= (distances && lit ? most_unexplained_of_distances : most_unexplained) && (touch || are_shown);
}

bool Packing::convinces() const { return describes() && filled >= least_filled; }

Packing packing_of(const GrayFrame& frame, const FindResult& found, const FinderCalibration& faces) {
  Packing packing;
  packing.disks = found.disks.size();
  packing.lit = faces.profile.asymmetry != nullptr;
  if (found.disks.empty()) return packing;
  const double radius = faces.radius_px, contrast = std::abs(faces.contrast_level);
  const Neighbours contacts = neighbours_of(found.disks, 2 * radius);
  packing.touching = contacts.touching;
  packing.overlapping = contacts.overlapping;
  const double noise = std::hypot(faces.noise_level, model_contrast * contrast);
  packing.noise = faces.noise_level / contrast;
  const double plainly = std::max(plainly_sigmas * noise, plainly_contrast * contrast);
  const GrayFrame left = residual_frame(frame, found, faces), in_view = seen_part(frame, faces);
  const Nearby near(found.disks.size(), beside_disk * radius,
                    [&](std::size_t i) { return std::pair(found.disks[i].x_px, found.disks[i].y_px); });
  const Extent extent(found.disks);
  double looked = 0, off = 0, seen = 0, squares = 0;
  for (int row = 0; row < left.height; ++row)
    for (int column = 0; column < left.width; ++column) {
      if (unseen(in_view.at(column, row))) continue;
      seen += extent.holds(column, row);
      if (!near.any_near(column, row)) continue;
      ++looked;
      const double gap = static_cast<double>(left.at(column, row));
      off += std::abs(gap) > plainly;
      squares += gap * gap;
    }
  packing.unexplained = off / std::max(1.0, looked);
  packing.misfit = std::sqrt(squares / std::max(1.0, looked)) / noise;
  packing.filled = static_cast<double>(found.disks.size()) * std::numbers::pi * radius * radius / std::max(1.0, seen);
  return packing;
}

namespace {

// Share of the disks about whose centre a circle was seen.
double share_shown(const std::vector<FoundDisk>& disks, const Places& circles, double radius) {
  const Nearby near(circles.size(), same_as_circle * radius, [&](std::size_t i) { return circles[i]; });
  const auto shown = std::count_if(disks.begin(), disks.end(),
                                   [&](const FoundDisk& disk) { return near.any_near(disk.x_px, disk.y_px); });
  return static_cast<double>(shown) / std::max(1.0, static_cast<double>(disks.size()));
}

// How far the lit rims of these disks are from their circle: rms, radii. Infinitely far where it is another circle.
double unevenness_of_lit_rims(const GrayFrame& frame, const std::vector<FoundDisk>& disks,
                              const FinderCalibration& faces) {
  const auto rim = lit_rim_of(frame, circles_of(disks), faces.polarity);
  if (!rim) return HUGE_VAL;
  const double radius = faces.radius_px, ratio = rim->radius_px / radius;
  const bool same = ratio >= least_lit_rim && ratio <= most_lit_rim &&
                    std::hypot(rim->right_px, rim->down_px) <= most_lit_offset * radius;
  return same ? rim->rms_radii : HUGE_VAL;
}

}  // namespace

PackedBed packed_bed_of(CalibrationResult faces, const std::vector<const GrayFrame*>& frames,
                        const FindOptions& options, const Places& circles) {
  PackedBed bed;
  bed.faces = std::move(faces);
  tell_radius(bed.faces);
  FindResult found = find_disks(*frames.back(), bed.faces.calibration, options);
  bed.packing = packing_of(*frames.back(), found, bed.faces.calibration);
  bed.packing.distances = options.distances;
  bed.packing.shown = share_shown(found.disks, circles, bed.faces.calibration.radius_px);
  if (bed.packing.lit && bed.packing.shown > 0)
    bed.packing.unevenness = unevenness_of_lit_rims(*frames.back(), found.disks, bed.faces.calibration);
  bed.disks = std::move(found.disks);
  if (!bed.packing.describes()) {
    bed.faces.found = false;
    bed.faces.why_not = "a model of disks that touch does not describe the frame";
  }
  return bed;
}

PackedBed learn_packed_bed(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                           const Places& beads) {
  CalibrationResult faces = learn_finder_from_part(frames, options, beads);
  if (faces.found) return packed_bed_of(std::move(faces), frames, options, beads);
  PackedBed bed;
  bed.faces = std::move(faces);
  return bed;
}

RimModel rims_of(const FinderCalibration& faces) {
  constexpr std::size_t support_steps = 20;
  RimModel rims;
  rims.polarity = faces.polarity;
  rims.radius_px = rims.open_radius_px = faces.radius_px;
  rims.radius_std_error_px = faces.radius_std_error_px;
  rims.contrast = std::abs(faces.contrast_level);
  rims.probability.assign(support_steps + 1, 1.0);
  return rims;
}

std::optional<double> touching_radius(const std::vector<Circle>& circles) {
  constexpr std::size_t fewest = 8;
  constexpr double peak = 0.05, least_in_peak = 0.4, farthest = 4;  // relative width; share of the circles; radii
  if (circles.size() < fewest) return std::nullopt;
  double largest = 1;
  for (const Circle& circle : circles) largest = std::max(largest, circle.radius);
  const Nearby near(circles.size(), farthest * largest,
                    [&](std::size_t i) { return std::pair(circles[i].x, circles[i].y); });
  std::vector<double> nearest;
  for (std::size_t k = 0; k < circles.size(); ++k) {
    double least = farthest * largest;
    near.any_near(circles[k].x, circles[k].y, [&](std::size_t i) {
      if (i != k) least = std::min(least, std::hypot(circles[i].x - circles[k].x, circles[i].y - circles[k].y));
      return false;
    });
    if (least < farthest * largest) nearest.push_back(least);
  }
  std::sort(nearest.begin(), nearest.end());
  std::size_t most = 0;
  double middle = 0;
  for (std::size_t first = 0, end = 0; first < nearest.size(); ++first) {
    while (end < nearest.size() && nearest[end] < (1 + peak) * nearest[first]) ++end;
    if (end - first <= most) continue;
    most = end - first;
    middle = nearest[first + most / 2];
  }
  if (static_cast<double>(most) < least_in_peak * static_cast<double>(circles.size())) return std::nullopt;
  return 0.5 * middle;
}

std::optional<double> radius_beyond(const std::vector<Circle>& circles, double radius_px) {
  const auto touching = touching_radius(circles);
  const double apart = touching.value_or(radius_px) / radius_px;
  return apart > nearest_apart && apart < farthest_apart ? touching : std::nullopt;
}

namespace {

// In a frame reduced so far that the beads are small.
std::optional<PackedBed> look_for_lit_bed(const GrayFrame& frame, const PackedStart& start) {
  const int reduction = std::max(1, static_cast<int>(*start.radius_px / trial_radius_px));
  FindOptions find;
  find.polarity = start.polarity;
  find.radius_px = *start.radius_px / reduction;
  find.distances = start.distances;
  GrayFrame small = reduction > 1 ? reduced(frame, reduction) : frame;
  Places places = start.lit;
  for (auto& [x, y] : places) x = (x + 0.5) / reduction - 0.5, y = (y + 0.5) / reduction - 0.5;
  PackedBed bed = learn_packed_bed({&small}, find, places);
  if (!bed.faces.found || bed.faces.calibration.radius_px < smallest_px) return std::nullopt;
  if (bed.packing.unevenness > round_in_a_bed) return std::nullopt;  // nuts and ovals touch as well
  bed.reduction = reduction;
  bed.reduced_frame = std::move(small);
  return bed;
}

}  // namespace

std::optional<PackedBed> look_for_packed_bed(const GrayFrame& frame, const std::vector<PackedStart>& starts) {
  std::optional<GrayFrame> part;
  for (const PackedStart& start : starts) {
    if (!start.lit.empty()) {
      if (auto bed = look_for_lit_bed(frame, start)) return bed;
      continue;
    }
    if (start.radius_px && (*start.radius_px < smallest_px || *start.radius_px > largest_packed_px)) continue;
    if (!part && std::max(frame.width, frame.height) > part_px)
      part = cut_out(frame, busiest_part(frame, part_px, {.block = 16, .reach = 2, .stride = 2}));
    FindOptions find;
    find.polarity = start.polarity;
    find.radius_px = start.radius_px;
    find.largest_radius_px = largest_start * largest_packed_px;
    find.smallest_radius_px = smallest_px;
    PackedBed bed = learn_packed_bed({part ? &*part : &frame}, find);
    if (!is_small(bed) || !bed.packing.convinces()) continue;
    if (!part) return bed;
    find.polarity = bed.faces.calibration.polarity;
    find.radius_px = bed.faces.calibration.rim_radius_px;
    bed = learn_packed_bed({&frame}, find);
    if (is_small(bed) && bed.packing.convinces()) return bed;
  }
  return std::nullopt;
}

}  // namespace shakebed::ingest
