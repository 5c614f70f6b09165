#include "ingest/profile/bed_geometry.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "ingest/calibrate/bead_asymmetry.hpp"
#include "ingest/find/profile_samples.hpp"
#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/floor.hpp"
#include "ingest/profile/touching_distance.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// Of the diameter: a scale given may differ by this from what the frames show without a warning.
constexpr double fair_scale = 0.02;
// Of the radius of beads lit from one side: three kinds of drawn spheres were off by 0.25 to 0.5 %, of which what is
// stated besides is a half.
constexpr double one_sided_light = 0.002;
// The same where the dark side hides a part of the rim: 12 drawn gases of spheres were off by 0.8 to 2.9 %, rms 1.5 %.
constexpr double hidden_rim = 0.015;
// Errors, within which the circles seen and the distance of touching beads agree. A distance that is larger by more
// than the second factor is that of beads that do not touch (bed_doubts.hpp).
constexpr double agreeing = 2, farthest_touching = 1.08;
constexpr double worth_a_word = 0.01;  // of the diameter
// In D: beads that reach farther beyond the frame's side are cut, so the bed extends beyond it.
constexpr double clearly_cut = 0.02;

// Whether a bead is as dark as the background just within a part of its rim. `profile` has an asymmetry.
bool hides_a_part_of_its_rim(const BeadProfile& profile, double radius_px) {
  constexpr int directions = 32;
  constexpr double within = 0.93, as_dark = 0.1;  // radii; of the most
  double least = HUGE_VAL, most = 0;
  for (int k = 0; k < directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / directions, r = within * radius_px;
    const double level =
        value_at(profile.level, profile.step_px, r) + profile.asymmetry->at(r * std::cos(angle), r * std::sin(angle));
    least = std::min(least, std::abs(level)), most = std::max(most, std::abs(level));
  }
  return least < as_dark * most;
}

class GeometryFinder {
 public:
  GeometryFinder(const FilmCalibration& film, std::vector<FrameFindings>& frames, FinderCalibration& refined,
                 BedCalibration& bed)
      : film_(film), options_(film.options), frames_(frames), refined_(refined), bed_(bed) {}

  std::vector<std::string> find() {
    refine_radius();
    set_scale();
    set_floor();
    set_walls();
    return std::move(warnings_);
  }

 private:
  void refine_radius() {
    RadiusFromFrames radius;
    for (const FrameFindings& frame : frames_) radius.add(frame.rim);
    radius.refine(refined_);
    if (refined_.profile.asymmetry) {
      const bool hides = hides_a_part_of_its_rim(refined_.profile, refined_.radius_px);
      refined_.radius_std_error_px =
          std::hypot(refined_.radius_std_error_px, (hides ? hidden_rim : one_sided_light) * refined_.radius_px);
    }
    circle_px_ = 2 * refined_.radius_px;
    if (const std::optional<TouchingDistance> touching = touching_distance(frames_, refined_.radius_px))
      weigh(*touching);
    else if (half_seen() && !options_.scale_m_per_px)
      bed_.outline_in_doubt = true;
    for (FrameFindings& frame : frames_)
      for (FoundDisk& disk : frame.disks)
        if (!disk.other_size) disk.radius_px = refined_.radius_px;
  }

  bool half_seen() const { return options_.find.seen && options_.find.seen->one_sided; }

  // The circles seen beside the distance of touching beads. Of beads lit from one side a part of the outline is seen,
  // and circles through it are too small; all are shifted alike, so their distances are right.
  void weigh(const TouchingDistance& touching) {
    const double seen = 2 * refined_.radius_px, seen_error = 2 * refined_.radius_std_error_px,
                 apart = touching.px - seen;
    const bool agree = std::abs(apart) < agreeing * std::hypot(seen_error, touching.std_error_px);
    if (half_seen() || (apart > 0 && !agree && touching.px < farthest_touching * seen))
      take(touching);
    else if (agree && (apart > 0 || touching.sharp))
      average(touching);
    else if (apart < 0 && touching.sharp)
      doubt_outline(touching);
  }

  void take(const TouchingDistance& touching) {
    const double circle_px = 2 * refined_.radius_px * refined_.recorded_px;
    const std::string why =
        half_seen() ? "The beads are lit from one side, and hardly any rim is seen on the other."
                    : "The outline seen is smaller than the beads, or they repel each other and do not touch.";
    const std::string what =
        formatted("%s The circles seen are %.4g px wide. Nearest beads are %.4g +- %.1g px apart", why.c_str(),
                  circle_px, touching.px * refined_.recorded_px, touching.std_error_px * refined_.recorded_px);
    if (options_.scale_m_per_px)
      warnings_.push_back(what + ". The scale given is used.");
    else if (half_seen())
      warnings_.push_back(what + ", and this is taken for their diameter.");
    else
      warnings_.push_back(what +
                          formatted(", and this is taken for their diameter. If they do not touch, give the scale "
                                    "of the circles: --scale \"%.4g mm/px\".",
                                    1e3 * options_.bead_diameter_m / circle_px));
    refined_.radius_px = 0.5 * touching.px;
    refined_.radius_std_error_px = 0.5 * touching.std_error_px;
  }

  // By inverse variances; an outline known exactly stays.
  void average(const TouchingDistance& touching) {
    const double outline = std::pow(2 * refined_.radius_std_error_px, 2), distance = std::pow(touching.std_error_px, 2),
                 share = outline / (outline + distance);
    refined_.radius_px += 0.5 * share * (touching.px - 2 * refined_.radius_px);
    refined_.radius_std_error_px *= std::sqrt(1 - share);
  }

  // Beads of several sizes may come nearer than those of the most frequent one touch, so the outline stands, with a
  // part of the difference as error.
  void doubt_outline(const TouchingDistance& touching) {
    const double apart = 2 * refined_.radius_px - touching.px;
    refined_.radius_std_error_px = std::hypot(refined_.radius_std_error_px, 0.25 * apart);
    if (apart < worth_a_word * touching.px) return;
    warnings_.push_back(formatted(
        "Nearest beads are %.4g px apart, but the circles seen are %.4g px wide. The outline is larger than the bead "
        "(a shadow or a halo), or beads are of several sizes. The error of the scale includes half of the difference.",
        touching.px * refined_.recorded_px, 2 * refined_.radius_px * refined_.recorded_px));
  }

  void set_scale() {
    const FinderCalibration& finder = film_.finder;
    bed_.radius_px = refined_.radius_px;
    bed_.radius_std_error_px = refined_.radius_std_error_px;
    bed_.edge_width_px = finder.edge_width_px;
    bed_.noise_level = finder.noise_level;
    bed_.contrast_level = finder.contrast_level;
    bed_.polarity = finder.polarity;
    bed_.scale_given = options_.scale_m_per_px.has_value();
    bed_.scale_m_per_px =
        bed_.scale_given ? *options_.scale_m_per_px : options_.bead_diameter_m / (2 * refined_.radius_px);
    bed_.scale_relative_std_error = bed_.scale_given ? 0 : refined_.radius_std_error_px / refined_.radius_px;
    diameter_px_ = options_.bead_diameter_m / bed_.scale_m_per_px;
    if (bed_.scale_given) compare_scale();
  }

  // The scale given is to be that of the beads, of the circles seen, or of beads that touch.
  void compare_scale() {
    const auto agrees = [&](double px) { return std::abs(px / diameter_px_ - 1) <= fair_scale; };
    if (agrees(2 * refined_.radius_px) || agrees(circle_px_)) return;
    const double contacts_px = contacts_of(frames_, 0.5 * diameter_px_).touching_px, recorded = refined_.recorded_px;
    bed_.scale_of_contacts = agrees(contacts_px);
    if (bed_.scale_of_contacts)
      warnings_.push_back(formatted(
          "The circles seen are %.4g px wide. By the scale given a bead is %.4g px wide, and nearest beads are "
          "as far apart. The circles are taken for a part of the beads, or for beads with their shadows.",
          2 * refined_.radius_px * recorded, diameter_px_ * recorded));
    else
      warnings_.push_back(
          formatted("By the scale given, a bead is %.4g px wide, but the beads found are %.4g px wide. Check the scale "
                    "and the diameter, or leave the scale out.",
                    diameter_px_ * recorded, 2 * refined_.radius_px * recorded));
  }

  void set_floor() {
    bed_.floor_given = options_.floor_px.has_value();
    if (bed_.floor_given) {
      bed_.floor_reference = FloorReference::given;
      bed_.floor_px = *options_.floor_px;
      bed_.floor_slope = options_.floor_slope.value_or(0.0);
      return;
    }
    const Line floor = find_floor(frames_, diameter_px_, film_.finder.width);
    bed_.floor_px = floor.offset;
    bed_.floor_std_error_px = floor.middle_std_error;
    bed_.floor_slope = options_.floor_slope.value_or(floor.slope);
    if (!options_.floor_slope)
      bed_.floor_tilt_std_error_degrees = floor.slope_std_error * 180 / std::numbers::pi;
    else  // keep the line through the middle of the frame
      bed_.floor_px = floor.offset + (floor.slope - bed_.floor_slope) * 0.5 * film_.finder.width;
  }

  void set_walls() {
    bed_.walls_given = options_.left_wall_px && options_.right_wall_px;
    std::vector<double> leftmost, rightmost;
    for (const FrameFindings& frame : frames_) {
      double low = 1e9, high = -1e9;
      const auto reach_to = [&](const FoundDisk& disk, double radius) {
        low = std::min(low, disk.x_px - radius);
        high = std::max(high, disk.x_px + radius);
      };
      for (const FoundDisk& disk : frame.disks) reach_to(disk, refined_.radius_px);
      for (const FoundDisk& disk : frame.second) reach_to(disk, disk.radius_px);
      if (low > high) continue;
      leftmost.push_back(low);
      rightmost.push_back(high);
    }
    const FrameSides frame = sides_of(film_);
    bed_.left_wall_px = options_.left_wall_px ? *options_.left_wall_px : left_wall(leftmost, frame.left);
    bed_.right_wall_px = options_.right_wall_px ? *options_.right_wall_px : right_wall(rightmost, frame.right);
    bed_.width = (bed_.right_wall_px - bed_.left_wall_px) / diameter_px_;
    if (!(bed_.width > 0)) {
      bed_.left_wall_px = frame.left;
      bed_.right_wall_px = frame.right;
      bed_.width = (frame.right - frame.left) / diameter_px_;
      warnings_.emplace_back(
          "The side walls could not be determined from the disks: the width of the whole frame is used. Give the walls "
          "(--left-wall, --right-wall).");
    }
    if (bed_.walls_are_frame_sides)
      warnings_.emplace_back("The bed extends beyond the sides of the frame: the profile is that of the visible part.");
  }

  // Where beads go on beyond the frame, only centres a radius inside are counted, so that each of them is seen whole.
  double left_wall(const std::vector<double>& seen, double frame_side) {
    const double extreme = quantile(seen, 0.1);
    if (!(extreme < frame_side - clearly_cut * diameter_px_)) return extreme;
    bed_.walls_are_frame_sides = true;
    return frame_side + refined_.radius_px;
  }
  double right_wall(const std::vector<double>& seen, double frame_side) {
    const double extreme = quantile(seen, 0.9);
    if (!(extreme > frame_side + clearly_cut * diameter_px_)) return extreme;
    bed_.walls_are_frame_sides = true;
    return frame_side - refined_.radius_px;
  }

  const FilmCalibration& film_;
  const MeasureOptions& options_;
  std::vector<FrameFindings>& frames_;
  FinderCalibration& refined_;
  BedCalibration& bed_;
  double diameter_px_ = 0;
  double circle_px_ = 0;  // diameter of the circles seen
  std::vector<std::string> warnings_;
};

}  // namespace

FrameSides sides_of(const FilmCalibration& film) {
  if (!film.options.find.roi) return {-0.5, film.finder.width - 0.5};
  const PixelRectangle& roi = *film.options.find.roi;
  return {roi.left - 0.5, roi.left + roi.width - 0.5};
}

std::vector<std::string> find_geometry(const FilmCalibration& film, std::vector<FrameFindings>& frames,
                                       FinderCalibration& refined, BedCalibration& bed) {
  return GeometryFinder(film, frames, refined, bed).find();
}

}  // namespace shakebed::ingest
