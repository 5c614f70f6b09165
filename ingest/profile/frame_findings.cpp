#include "ingest/profile/frame_findings.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

namespace {

// Two beads of different size are never seen nearer than this share of the sum of their radii.
constexpr double least_distance = 0.72;

// Area under a bead's profile over the area of its disk: what turns summed contrast into covered area.
double contrast_per_area(const FinderCalibration& finder) {
  double sum = 0;
  for (std::size_t i = 0; i < finder.profile.level.size(); ++i) {
    const double r = static_cast<double>(i) * finder.profile.step_px;
    sum += 2 * std::numbers::pi * r * finder.profile.step_px * static_cast<double>(finder.profile.level[i]);
  }
  return sum / (std::numbers::pi * finder.radius_px * finder.radius_px);
}

}  // namespace

FrameExaminer::FrameExaminer(const FilmCalibration& film)
    : film_(film),
      lens_(film.lens, film.recorded_width, film.recorded_height),
      contrast_per_area_(contrast_per_area(film.finder)) {}

FrameFindings FrameExaminer::examine(FrameSource::Item& item) const {
  FrameFindings findings;
  FrameReport& report = findings.report;
  report.index = item.index;
  report.origin = item.origin;
  GrayFrame frame;
  try {
    frame = item.decode();
  } catch (const InputError& error) {
    report.status = FrameStatus::unreadable;
    report.why = error.what();
    return findings;
  }
  if (frame.width != film_.recorded_width || frame.height != film_.recorded_height) {
    report.status = FrameStatus::size_changed;
    report.why = "the frame is " + std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                 " px, but the first one is " + std::to_string(film_.recorded_width) + " x " +
                 std::to_string(film_.recorded_height);
    return findings;
  }
  find_disks_in(film_.lens.plain() ? frame : lens_.corrected(frame), findings);
  return findings;
}

void FrameExaminer::find_disks_in(const GrayFrame& frame, FrameFindings& findings) const {
  FrameReport& report = findings.report;
  FindOptions find = film_.options.find;
  find.learn_rim = report.index < rim_frames;
  FindResult found;
  if (film_.kinds_together) {
    BothKinds both = find_both_kinds(frame, film_, find);
    found = std::move(both.first);
    findings.second = std::move(both.second.disks);
  } else {
    const bool known = film_.by_rims && film_.by_rims->frame == report.index;
    found = known ? film_.by_rims->found : find_beads(frame, film_.finder, find);
    if (film_.second) findings.second = find_second(frame, found);
  }
  report.second = findings.second.size();
  findings.rim.profile = std::move(found.profile);
  findings.rim.profile_beads = found.profile_beads;
  if (!film_.lens.plain())  // what a margin repeats is no disk
    std::erase_if(found.disks, [&](const FoundDisk& disk) {
      const PixelPlace place = lens_.to_recorded({disk.x_px, disk.y_px});
      return place.x < -0.5 || place.y < -0.5 || place.x >= film_.recorded_width - 0.5 ||
             place.y >= film_.recorded_height - 0.5;
    });
  report.disks = found.disks.size();
  report.rejected = found.rejected;
  report.residual_level = found.residual_level;
  report.light = found.light;
  if (found.empty()) {
    report.status = FrameStatus::nothing_found;
    report.why = found.why_nothing;
  }
  if (film_.options.profile_from_coverage) findings.coverage_of_row = coverage_of(frame, found.light);
  findings.disks = std::move(found.disks);
}

// Disks of the second species, none where the first has one.
std::vector<FoundDisk> FrameExaminer::find_second(const GrayFrame& frame, const FindResult& found) const {
  const FinderCalibration &first = film_.finder, &second = *film_.second;
  std::vector<FoundDisk> disks = find_beads(frame, second, film_.options.find).disks;
  const double near = least_distance * (first.radius_px + second.radius_px);
  const Nearby taken(found.disks.size(), near,
                     [&](std::size_t i) { return std::pair(found.disks[i].x_px, found.disks[i].y_px); });
  std::erase_if(disks, [&](const FoundDisk& disk) { return taken.any_near(disk.x_px, disk.y_px); });
  return disks;
}

// Covered px of each row, between the walls if they are given.
std::vector<float> FrameExaminer::coverage_of(const GrayFrame& frame, const FrameLight& light) const {
  const GrayFrame flat = flatten(seen_part(frame, film_.finder), film_.finder.light, light);
  const MeasureOptions& options = film_.options;
  int left = 0, right = frame.width;
  if (options.left_wall_px && !options.periodic_sides)
    left = std::clamp(static_cast<int>(std::lround(*options.left_wall_px + 0.5)), 0, frame.width);
  if (options.right_wall_px && !options.periodic_sides)
    right = std::clamp(static_cast<int>(std::lround(*options.right_wall_px + 0.5)), left, frame.width);
  std::vector<float> covered(static_cast<std::size_t>(frame.height));
  for (int row = 0; row < frame.height; ++row) {
    double sum = 0;
    const float* line = flat.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width);
    for (int column = left; column < right; ++column)
      sum += unseen(line[column]) ? 0.0 : static_cast<double>(line[column]);
    covered[static_cast<std::size_t>(row)] = static_cast<float>(sum / contrast_per_area_);
  }
  return covered;
}

}  // namespace shakebed::ingest
