#include "ingest/profile/film_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/packed_bed.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/find/two_kinds.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "ingest/profile/photographs.hpp"

namespace shakebed::ingest {

BothKinds find_both_kinds(const GrayFrame& frame, const FilmCalibration& film, const FindOptions& options) {
  const bool first_is_large = film.finder.radius_px > film.second->radius_px;
  const TwoKinds kinds = first_is_large ? TwoKinds{film.finder, *film.second} : TwoKinds{*film.second, film.finder};
  KindsFound found = find_two_kinds(frame, kinds, options);
  return first_is_large ? BothKinds{std::move(found.large), std::move(found.small)}
                        : BothKinds{std::move(found.small), std::move(found.large)};
}

namespace {

// One full frame is enough to learn the bead from, sparse ones are taken together; so many are tried.
constexpr std::size_t enough_disks = 150, most_frames_tried = 40;
constexpr int lens_rounds = 5;
// Of aspect and radial term: below a few thousandths it may as well be streaks or shading, and does no harm; once in
// use, smaller corrections are followed, down to their standard error; no lens bends more than the last.
constexpr double worth_it = 0.004, settled = 3e-4, most_bend = 0.25;
// Standard errors by which a term must differ from none. In drawn beds without a lens those of the aspect are right,
// and those of the radial term up to 1.5 times too small.
constexpr double sigmas_of_aspect = 4, sigmas_of_radial = 5;
// Of aspect and radial term: a smaller correction needs no new search for the beads.
constexpr double small_correction = 0.01;
// Of a radius by votes, or by rims that blur has moved inwards.
constexpr double radius_off = 0.07;
constexpr double least_second_px =
    1.5;  // radius of beads of a second kind: rims of smaller ones do not differ from noise

std::vector<const GrayFrame*> pointers_to(const std::vector<GrayFrame>& frames) {
  std::vector<const GrayFrame*> pointers;
  for (const GrayFrame& frame : frames) pointers.push_back(&frame);
  return pointers;
}

// Why a frame shows no beads of this radius; empty: it may.
std::string why_not_in(const GrayFrame& frame, double radius_px) {
  if (2 * radius_px <= std::min(frame.width, frame.height)) return {};
  char text[200];
  std::snprintf(text, sizeof text,
                "by the radius or the scale given, a bead is %.4g px wide, but the frame has %d x %d px", 2 * radius_px,
                frame.width, frame.height);
  return text;
}

// Beads of the second diameter by their rims, if they are seen.
std::optional<FinderCalibration> learn_second_by_rims(const GrayFrame& frame, double expected,
                                                      const FinderCalibration& first, const MeasureOptions& options) {
  FindOptions find = options.find;
  find.seen = BeadsSeen{first.polarity, expected};
  find.radius_px.reset();
  constexpr double nearly = 0.1;
  CalibrationResult result = learn_by_rims(frame, *find.seen);
  if (!result.found || std::abs(result.calibration.radius_px / expected - 1) > nearly) return std::nullopt;
  return std::move(result.calibration);
}

class FilmLearner {
 public:
  FilmLearner(FrameSource& source, const MeasureOptions& asked)
      : source_(source),
        find_(asked.find),
        lens_{asked.pixel_aspect.value_or(asked.first_pixel_aspect), asked.lens_radial.value_or(0.0)} {
    film_.options = asked;
    if (find_.roi) find_.roi = widened(*find_.roi, lens_.pixel_aspect);
    find_.one_size = asked.second_diameter_m.has_value();
    if (asked.scale_m_per_px && !find_.radius_px)  // a good first value; refined all the same
      find_.radius_px = 0.5 * asked.bead_diameter_m / *asked.scale_m_per_px;
  }

  FilmCalibration learn() {
    learn_from_first_frames();
    keep_to_round_side();
    if (!learn_both_kinds()) {  // else no lens is looked for: rims of two sizes would mislead it
      learn_lens();
      tell_radius(calibrated_);
      if (calibrated_.calibration.by_rims) film_.options.profile_from_coverage = false;
      calibrated_.beads.reset();
      learn_shades();
      if (film_.options.second_diameter_m) learn_second();
    }
    if (enlargement_ > 1) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "The pictures had been enlarged %.2f times by repeating pixels, so they were smoothed. The errors "
                    "of the centres are those of the smaller picture.",
                    enlargement_);
      film_.warnings.emplace_back(text);
    }
    film_.lens = lens_;
    if (!film_.options.pixel_aspect) film_.aspect_std_error = std::hypot(film_.aspect_std_error, aspect_by_blur());
    if (!lens_.plain()) use_lens();
    film_.finder = std::move(calibrated_.calibration);
    return std::move(film_);
  }

 private:
  // An error [1]. Blur is as wide along the rows of the recorded frame as along its columns, so in the true frame it is
  // not. That moves the aspect found towards 1: in 36 drawn beds of beads 16 to 30 px wide, at 0.70 and 1.33, by 0.4 to
  // 1.4 %. This is 2 to 3.5 times the square of blur over radius, times the difference of the squared aspect from 1.
  // With pixels that cover an area it was 0.8 times.
  [[nodiscard]] double aspect_by_blur() const {
    const FinderCalibration& finder = calibrated_.calibration;
    const double share = finder.edge_width_px / finder.radius_px, square = lens_.pixel_aspect * lens_.pixel_aspect;
    return lens_.pixel_aspect * 2 * share * share * std::abs(square - 1);
  }

  [[nodiscard]] GrayFrame straightened(const GrayFrame& frame) const {
    return lens_.plain() ? frame : LensMap(lens_, frame.width, frame.height).corrected(frame);
  }

  void straighten_all() {
    straight_.clear();
    for (const GrayFrame& frame : recorded_) straight_.push_back(straightened(frame));
  }

  // The bead from the first frames that show any.
  void learn_from_first_frames() {
    std::string first_reason, first_error;
    std::size_t read = 0;
    source_.rewind();
    for (std::size_t tried = 0; tried < most_frames_tried; ++tried) {
      auto item = source_.next_item();
      if (!item) break;
      GrayFrame frame;
      try {
        frame = item->decode();
      } catch (const InputError& error) {
        if (first_error.empty()) first_error = error.what();
        continue;
      }
      ++read;
      if (!learns_from(std::move(frame), first_reason)) continue;
      last_learned_from_ = item->index;
      if (calibrated_.calibration.disks_used >= enough_disks || straight_.size() >= film_.options.calibration_frames)
        break;
    }
    if (!calibrated_.found) refuse(read, first_reason, first_error);
    film_.recorded_width = recorded_.front().width;
    film_.recorded_height = recorded_.front().height;
    std::erase_if(recorded_, [&](const GrayFrame& frame) {
      return frame.width != film_.recorded_width || frame.height != film_.recorded_height;
    });
  }

  // From the frame read last, unless a survey has done so.
  CalibrationResult learned_from_one() {
    const GrayFrame& frame = straight_.back();
    std::optional<CalibrationResult> known;
    if (const auto searched = std::exchange(film_.options.searched, nullptr)) known = searched->take(frame, find_);
    return known ? std::move(*known) : learn_beads({&frame}, find_);
  }

  // With the frames before it once beads are known. Whether it shows beads.
  bool learns_from(GrayFrame frame, std::string& first_reason) {
    enlargement_ = std::max(enlargement_, frame.enlargement);
    straight_.push_back(straightened(frame));
    recorded_.push_back(std::move(frame));
    const PictureThreads threads(threads_for(recorded_.back().width, recorded_.back().height));
    CalibrationResult attempt;
    attempt.why_not = why_not_in(straight_.back(), find_.radius_px.value_or(0));
    if (attempt.why_not.empty())
      attempt = calibrated_.found ? learn_beads(pointers_to(straight_), find_) : learned_from_one();
    if (!attempt.found) {
      if (first_reason.empty()) first_reason = attempt.why_not;
      straight_.pop_back();
      recorded_.pop_back();
      return false;
    }
    calibrated_ = std::move(attempt);
    return true;
  }

  [[noreturn]] static void refuse(std::size_t read, const std::string& reason, const std::string& error) {
    if (read == 0)
      throw InputError("the frames", "none could be read", error.empty() ? "the stream is empty" : error,
                       "check the files");
    throw NoDisksError("the frames", "no disks in any of the first " + std::to_string(read) + " frames", reason,
                       "check that sharp beads, at least 10 px wide, are visible");
  }

  // Faces fit squares of the beads' size nearly as well as beads. Where the outlines in one part of the picture are
  // round and those in the rest are not, the beads are looked for in that part alone.
  void keep_to_round_side() {
    const FinderCalibration& calibration = calibrated_.calibration;
    if (find_.roi || find_.any_shape || calibrated_.packed) return;
    if (!calibration.rims || calibration.rims->radius_px <= coarse_px) return;
    const GrayFrame& frame = straight_.back();
    const FindResult found =
        calibrated_.in_last_frame ? *calibrated_.in_last_frame : find_beads(frame, calibration, find_);
    std::vector<RimDisk> disks;
    for (const FoundDisk& disk : found.disks) {
      Circle& circle = disks.emplace_back().circle;
      circle.x = disk.x_px, circle.y = disk.y_px;
      // Outlines run where rims are steepest, which is not where faces end.
      circle.radius = disk.radius_px * calibration.rims->radius_px / calibration.radius_px;
    }
    const std::optional<SideOfCut> side = roundness_of(frame, *calibration.rims, disks).round_side;
    if (!side) return;
    FindOptions there = find_;
    there.roi = part_on(*side, frame.width, frame.height);
    CalibrationResult again = learn_beads(pointers_to(straight_), there);
    if (!again.found) return;
    const PixelRectangle recorded = widened(*there.roi, 1 / lens_.pixel_aspect);
    find_ = there, film_.options.find.roi = recorded;
    calibrated_ = std::move(again);
    film_.warnings.push_back(why_only_a_part(recorded, find_.recorded_px));
  }

  // Pixels and lens from the rims of the beads: what is clearly there is taken out, and all is learned again.
  void learn_lens() {
    // Rims alone are too coarse for it. Where other things are mistaken for beads, the lens would be fitted to those.
    if (calibrated_.calibration.by_rims || calibrated_.calibration.rims_to_be_checked) return;
    if (film_.options.pixel_aspect && film_.options.lens_radial) return;
    for (int round = 0; round < lens_rounds; ++round) {
      const std::optional<Lens> better = better_lens();
      if (!better) return;
      const Lens before = lens_;
      lens_ = *better;
      straighten_all();
      const bool little = std::abs(lens_.pixel_aspect / before.pixel_aspect - 1) < small_correction &&
                          std::abs(lens_.radial - before.radial) < small_correction;
      if (!learn_through_lens(little)) {
        lens_ = before;
        return;
      }
      // What a small correction leaves is its square and a share of its own: less than what would be worth it.
      if (little) return;
    }
  }

  // None when what rims still show is not worth a correction.
  std::optional<Lens> better_lens() {
    straighten_all();
    std::vector<FindResult> found;
    for (const GrayFrame& frame : straight_) found.push_back(find_disks(frame, calibrated_.calibration, find_));
    const LensEstimate left = estimate_lens(pointers_to(straight_), found, calibrated_.calibration);
    const MeasureOptions& options = film_.options;
    film_.aspect_std_error = options.pixel_aspect ? 0 : left.aspect_std_error;
    film_.lens_radial_std_error = options.lens_radial ? 0 : left.radial_std_error;
    if (!left.known) return std::nullopt;
    const auto clear = [](double value, double std_error, bool in_use, double sigmas) {
      return std::abs(value) > (in_use ? std::max(settled, std_error) : std::max(worth_it, sigmas * std_error));
    };
    Lens better = lens_;
    const bool bent = lens_.radial != 0, wide = lens_.pixel_aspect != 1;
    if (!options.pixel_aspect && clear(left.lens.pixel_aspect - 1, left.aspect_std_error, wide, sigmas_of_aspect))
      better.pixel_aspect = std::clamp(lens_.pixel_aspect * left.lens.pixel_aspect / options.first_pixel_aspect,
                                       1 - most_bend, 1 + most_bend) *
                            options.first_pixel_aspect;
    if (!options.lens_radial && (bent || left.by_size_and_shape()) &&
        clear(left.lens.radial, left.radial_std_error, bent, sigmas_of_radial))
      better.radial = std::clamp(lens_.radial + left.lens.radial, -most_bend, most_bend);
    if (better.pixel_aspect == lens_.pixel_aspect && better.radial == lens_.radial) return std::nullopt;
    return better;
  }

  bool learn_through_lens(bool little) {
    const FinderCalibration& before = calibrated_.calibration;
    const std::vector<const GrayFrame*> pointers = pointers_to(straight_);
    CalibrationResult again = little ? learn_again(pointers, find_, before) : learn_beads(pointers, find_);
    if (!again.found || again.calibration.by_rims) return false;
    if (little) {
      again.calibration.rims = before.rims;
      again.calibration.rims_to_be_checked = before.rims_to_be_checked;
    }
    calibrated_ = std::move(again);
    return true;
  }

  // Beads of another shade cover area as these do, but not by their contrast.
  void learn_shades() {
    FinderCalibration& calibration = calibrated_.calibration;
    if (film_.options.second_diameter_m || !calibration.rims) return;
    FindResult found = calibrated_.in_last_frame ? std::move(*calibrated_.in_last_frame)
                                                 : find_beads(straight_.back(), calibration, find_);
    if (!find_.quick_rims_only) learn_other_shade(straight_.back(), find_, calibration, found);
    if (calibration.other_shade) film_.options.profile_from_coverage = false;
    const bool all_by_rims = calibration.by_rims && (!calibration.other_shade || calibration.other_shade->by_rims);
    if (all_by_rims && lens_.plain()) film_.by_rims = FoundByRims{last_learned_from_, std::move(found)};
  }

  // What was seen first may be of either kind, or of both.
  bool learn_both_kinds() {
    MeasureOptions& options = film_.options;
    if (!options.second_diameter_m) return false;
    const double ratio = *options.second_diameter_m / options.bead_diameter_m;
    if (ratio == 1) return false;
    const bool first_is_large = ratio < 1;
    const BeadsSeen seen =
        find_.seen.value_or(BeadsSeen{calibrated_.calibration.polarity, calibrated_.calibration.rim_radius_px});
    KindsAsked asked;
    asked.ratio = first_is_large ? 1 / ratio : ratio;
    asked.polarity = seen.polarity;
    const double smallest = find_.radius_px ? *find_.radius_px * (first_is_large ? 1 : ratio) : seen.radius_px;
    asked.from_px = smallest / (1 + radius_off);
    asked.to_px = smallest * (find_.radius_px ? 1 : asked.ratio) * (1 + radius_off);
    const GrayFrame& frame = straight_.back();
    constexpr double widest = 0.45;  // of the frame's shorter side: the search goes a step beyond
    asked.from_px = std::max(asked.from_px, least_second_px * asked.ratio);
    asked.to_px = std::min(asked.to_px, widest * std::min(frame.width, frame.height));
    if (asked.from_px > asked.to_px) return false;
    LearnedKinds learned = learn_two_kinds(pointers_to(straight_), asked, find_);
    kinds_why_not_ = std::move(learned.why_not);
    if (!learned.kinds) return false;
    FinderCalibration &large = learned.kinds->large, &small = learned.kinds->small;
    calibrated_ = {};
    calibrated_.calibration = std::move(first_is_large ? large : small);
    film_.second = std::move(first_is_large ? small : large);
    film_.kinds_together = true;
    options.profile_from_coverage = false;  // both kinds cover area
    film_.finder = calibrated_.calibration;
    count_missed();
    return true;
  }

  // Of both kinds together: beads of one are none that the other misses.
  void count_missed() {
    FinderCalibration& first = calibrated_.calibration;
    first.rims = rims_of(first);
    const BothKinds both = find_both_kinds(straight_.back(), film_, find_);
    std::vector<Circle> circles = circles_of(both.first.disks);
    for (const Circle& circle : circles_of(both.second.disks)) circles.push_back(circle);
    first.expected_missed =
        share_of_missed(expected_missed_beads(straight_.back(), *first.rims, circles, find_.roi), circles.size());
  }

  void learn_second() {
    const FinderCalibration& first = calibrated_.calibration;
    const double radius = first.radius_px * *film_.options.second_diameter_m / film_.options.bead_diameter_m;
    if (radius < least_second_px || !why_not_in(straight_.back(), radius).empty()) {
      char text[200];
      std::snprintf(text, sizeof text, "they would be %.3g px wide in a frame of %d x %d px.", 2 * radius, first.width,
                    first.height);
      return warn_of_no_second(text);
    }
    film_.second = learn_second_by_rims(straight_.back(), radius, first, film_.options);
    if (!film_.second) warn_of_no_second("no rims of this radius were found.");
  }

  void warn_of_no_second(const std::string& why) {
    film_.warnings.push_back(
        "No beads of the second diameter were found: " + why +
        (kinds_why_not_.empty() ? "" : " The search for both kinds together failed, too: " + kinds_why_not_ + "."));
  }

  // Places asked for become those of the true frame.
  void use_lens() {
    MeasureOptions& options = film_.options;
    if (!(options.pixel_aspect && options.lens_radial)) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "The beads do not appear as circles of one size. This is corrected: pixels are taken as %.4f times "
                    "as wide as high, and the lens shifts the corners by %+.4f half diagonals.",
                    lens_.pixel_aspect, lens_.radial);
      film_.warnings.emplace_back(text);
    }
    const LensMap map(lens_, film_.recorded_width, film_.recorded_height);
    const auto place_of = [&](double x, double y) { return map.to_true({x, y}); };
    if (options.floor_px) {
      const double slope = options.floor_slope.value_or(0.0), right = film_.recorded_width - 1;
      const PixelPlace a = place_of(0, *options.floor_px), b = place_of(right, *options.floor_px + slope * right);
      options.floor_slope = (b.y - a.y) / (b.x - a.x);
      options.floor_px = a.y - *options.floor_slope * a.x;
    }
    const double half_way = 0.5 * (film_.recorded_height - 1);
    if (options.left_wall_px) options.left_wall_px = place_of(*options.left_wall_px, half_way).x;
    if (options.right_wall_px) options.right_wall_px = place_of(*options.right_wall_px, half_way).x;
    if (options.find.roi) {
      const PixelRectangle& roi = *options.find.roi;
      const PixelPlace a = place_of(roi.left, roi.top), b = place_of(roi.left + roi.width, roi.top + roi.height);
      options.find.roi =
          PixelRectangle{static_cast<int>(std::lround(a.x)), static_cast<int>(std::lround(a.y)),
                         static_cast<int>(std::lround(b.x - a.x)), static_cast<int>(std::lround(b.y - a.y))};
    }
  }

  FrameSource& source_;
  FindOptions find_;
  Lens lens_;
  FilmCalibration film_;
  std::vector<GrayFrame> recorded_, straight_;  // frames learned from, as recorded and true
  std::size_t last_learned_from_ = 0;           // index of the last of them
  CalibrationResult calibrated_;
  double enlargement_ = 1;  // of the pictures
  std::string kinds_why_not_;
};

}  // namespace

FilmCalibration calibrate_film(FrameSource& source, const MeasureOptions& options) {
  return FilmLearner(source, options).learn();
}

}  // namespace shakebed::ingest
