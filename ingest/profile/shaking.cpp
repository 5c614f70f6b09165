#include "ingest/profile/shaking.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ingest/profile/velocities.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

constexpr double resting = 0.02;               // D: what touching beads scatter
constexpr double clearly_more_contacts = 1.5;  // beads that touch a floor of twice the bed's frequency
constexpr double doubted_frequency = 5;        // standard errors between a frequency given and one seen ...
constexpr double smeared = 0.1;                // ... and turns between them over the film

}  // namespace

void Shaking::begin(const std::vector<FrameFindings>& frames, double diameter_px, int width, BedCalibration& bed) {
  diameter_px_ = diameter_px;
  width_ = width;
  std::vector<PlaceInFrame> bottoms;
  for (const FrameFindings& frame : frames) {
    first_bottoms_.push_back(lowest_bottoms(frame, bed.floor_slope, diameter_px, width));
    if (const auto bottom = bottom_of(first_bottoms_.back())) bottoms.push_back(*bottom);
  }
  in_film_ = find_frequency(bottoms);
  if (in_film_.known && in_film_.amplitude < resting * diameter_px) {
    in_film_.known = false;
    in_film_.why_not = "the lowest beads move by less than 2 % of a diameter";
  }
  if (in_film_.known && !options_.shaking_frequency_hz) require_film(frames);
  bed.frequency_given = options_.shaking_frequency_hz.has_value();
  if (bed.frequency_given)
    turns_per_frame_ = *options_.shaking_frequency_hz / *options_.frame_rate_hz;
  else if (in_film_.known)
    choose_period();
  if (!bed.floor_given && turns_per_frame_) find_floor_in_motion(bed);
}

// Pictures at random times have no period, and in a sequence too slow to follow the beads it may be any.
void Shaking::require_film(const std::vector<FrameFindings>& frames) {
  const double followed = followed_share(frames, diameter_px_);
  if (followed >= enough_followed) return;
  in_film_.known = false;
  in_film_.why_not = formatted(
      "only %.0f %% of the beads are found again in the next picture, as in pictures at unrelated times or in a film "
      "with too low a frame rate. A period in them may be due to chance",
      100 * followed);
}

// A bed that is thrown up in every second period repeats at half the floor's frequency, but does not lie on a floor
// that moves so.
void Shaking::choose_period() {
  const double twice = 2 * in_film_.cycles_per_frame;
  if (twice < 0.5) {
    const FloorMotion once = find_floor_motion(first_bottoms_, diameter_px_, in_film_.cycles_per_frame);
    const FloorMotion as_twice = find_floor_motion(first_bottoms_, diameter_px_, twice);
    const bool more =
        static_cast<double>(as_twice.touching) > clearly_more_contacts * static_cast<double>(once.touching);
    bed_repeats_every_ = as_twice.known && more ? 2 : 1;
  }
  turns_per_frame_ = bed_repeats_every_ * in_film_.cycles_per_frame;
}

void Shaking::find_floor_in_motion(BedCalibration& bed) {
  const FloorMotion motion = find_floor_motion(first_bottoms_, diameter_px_, *turns_per_frame_);
  if (!motion.known) {
    warnings_.emplace_back(
        "The motion of the floor could not be determined: beads touch the floor in too small a part of its period.");
  } else if (motion.amplitude > resting * diameter_px_) {
    bed.floor_px = motion.middle;
    bed.floor_std_error_px = motion.middle_std_error;
    bed.floor_reference = FloorReference::mean_of_motion;
    bed.floor_amplitude_px = motion.amplitude;
    bed.floor_amplitude_std_error_px = motion.amplitude_std_error;
    bed.floor_phase = motion.phase;
  }
}

void Shaking::add(const FrameFindings& frame, const BedCalibration& bed) {
  if (const auto bottom = bottom_of(lowest_bottoms(frame, bed.floor_slope, diameter_px_, width_)))
    all_bottoms_.push_back(*bottom);
}

void Shaking::finish(BedCalibration& bed) {
  in_film_ = refine_frequency(all_bottoms_, in_film_);
  if (!bed.frequency_given) {
    bed.why_no_frequency = in_film_.why_not;
    if (in_film_.known) take_found(bed);
    return;
  }
  bed.shaking_frequency_hz = *options_.shaking_frequency_hz;
  if (in_film_.known && !all_bottoms_.empty()) compare_with_given();
}

void Shaking::take_found(BedCalibration& bed) {
  const double rate = *options_.frame_rate_hz, frequency = bed_repeats_every_ * in_film_.cycles_per_frame,
               std_error = bed_repeats_every_ * in_film_.std_error;
  turns_per_frame_ = frequency;
  bed.shaking_frequency_hz = frequency * rate;
  bed.shaking_frequency_std_error_hz = std_error * rate;
  bed.frequency_false_alarm = in_film_.false_alarm;
  if (bed.floor_amplitude_px > 0) {  // its phase goes with the frequency
    const FloorMotion motion = find_floor_motion(first_bottoms_, diameter_px_, frequency);
    if (motion.known)
      bed.floor_amplitude_px = motion.amplitude, bed.floor_amplitude_std_error_px = motion.amplitude_std_error,
      bed.floor_phase = motion.phase;
  }
  char text[400];
  std::snprintf(text, sizeof text,
                "The shaking frequency was not given. The lowest beads move at %.6g +- %.2g Hz, and this frequency is "
                "used. A frequency above half the frame rate appears lower: %.6g Hz would look the same.",
                bed.shaking_frequency_hz, bed.shaking_frequency_std_error_hz, rate - bed.shaking_frequency_hz);
  warnings_.emplace_back(text);
}

// As the film shows them, and a bed may need several periods.
void Shaking::compare_with_given() {
  const auto seen_as = [](double turns) { return std::abs(turns - std::round(turns)); };
  const double length = static_cast<double>(all_bottoms_.back().frame - all_bottoms_.front().frame) + 1;
  double nearest = 1;
  for (const int periods : {1, 2, 3})
    nearest = std::min(nearest,
                       std::abs(seen_as(periods * in_film_.cycles_per_frame) - seen_as(*turns_per_frame_)) / periods);
  if (nearest < doubted_frequency * in_film_.std_error || nearest * length < smeared) return;
  const double rate = *options_.frame_rate_hz;
  char text[400];
  std::snprintf(text, sizeof text,
                "The lowest beads move at %.6g +- %.2g Hz, but %.6g Hz was given. The given frequency is used. Check "
                "the frequency and the frame rate.",
                in_film_.cycles_per_frame * rate, in_film_.std_error * rate, *options_.shaking_frequency_hz);
  warnings_.emplace_back(text);
}

}  // namespace shakebed::ingest
