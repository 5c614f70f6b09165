#include "ingest/profile/measure_bed.hpp"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdarg>
#include <cstdio>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "ingest/frames/picture_threads.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/bed_geometry.hpp"
#include "ingest/profile/coverage.hpp"
#include "ingest/profile/film_calibration.hpp"
#include "ingest/profile/floor.hpp"
#include "ingest/profile/frame_findings.hpp"
#include "ingest/profile/frame_rows.hpp"
#include "ingest/profile/mirror_image.hpp"
#include "ingest/profile/reduced_bed.hpp"
#include "ingest/profile/shaking.hpp"
#include "statistics/parallel.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// Frames for which memory is set aside at once.
constexpr std::size_t most_expected_frames = 100000;
// What deserves a warning: rms of n D^2 between coverage and centres; relative scatter of the contrast and of the bead
// number from frame to frame; degrees of the floor's tilt.
// Beads cut by the upper border, as a share of all, up to which those above it do not count in N D/W: at 10 m g D they
// are ten times as many, half a per cent. And how far from it a Gaussian is nearly all seen [its widths].
constexpr double most_cut_above = 5e-4, gaussian_edge = 3, fewest_bins = 4;
constexpr double coverage_differs = 0.03, light_flickers = 0.02, number_varies = 0.01, floor_tilts = 0.5;
// Frames that show how far the lowest beads move.
constexpr std::size_t fewest_for_range = 5;
// Lowest beads that move farther between frames may lie on a floor that moves [D]. At rest they scatter by a hundredth.
constexpr double moving_bottom = 0.1;

// Frames are examined as threads come by them, and taken up in their order; nobody runs far ahead of the slowest.
class OrderedFrames {
 public:
  OrderedFrames(FrameSource& source, const FrameExaminer& examiner, unsigned threads)
      : source_(source), examiner_(examiner), threads_(threads), run_ahead_(2 * std::max<std::size_t>(1, threads)) {}

  // `take_up` receives the frames in order, from one thread at a time, and how many wait behind it.
  using TakeUp = std::function<void(FrameFindings frame, std::size_t waiting)>;
  void run(const TakeUp& take_up) {
    const std::size_t threads = std::max<std::size_t>(1, threads_);
    const std::function<void()> question = StopQuestion::of_thread();
    for_each_index(threads, static_cast<int>(threads), [&](std::size_t) {
      const StopQuestion asked(question);
      const PictureThreads alone(1);  // of each frame
      work(take_up);
    });
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  void work(const TakeUp& take_up) {
    try {
      while (auto item = next()) {
        {
          std::unique_lock<std::mutex> lock(result_mutex_);
          taken_up_.wait(lock, [&] { return failure_ || item->index < done_ + run_ahead_; });
          if (failure_) return;
        }
        FrameFindings one = examiner_.examine(*item);
        const std::lock_guard<std::mutex> lock(result_mutex_);
        if (failure_) return;
        early_.emplace(one.report.index, std::move(one));
        for (auto ready = early_.find(done_); ready != early_.end(); ready = early_.find(done_)) {
          FrameFindings frame = std::move(ready->second);
          early_.erase(ready);
          take_up(std::move(frame), early_.size());
          ++done_;
        }
        taken_up_.notify_all();
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(result_mutex_);
      if (!failure_) failure_ = std::current_exception();
      taken_up_.notify_all();
    }
  }

  std::optional<FrameSource::Item> next() {
    const std::lock_guard<std::mutex> lock(source_mutex_);
    return source_.next_item();
  }

  FrameSource& source_;
  const FrameExaminer& examiner_;
  const unsigned threads_;
  const std::size_t run_ahead_;
  std::mutex source_mutex_, result_mutex_;
  std::condition_variable taken_up_;
  std::map<std::size_t, FrameFindings> early_;  // examined before one that precedes them
  std::size_t done_ = 0;                        // frames taken up, also the index of the next
  std::exception_ptr failure_;
};

// Each pair of heights has a covariance.
constexpr double most_heights = 5000;

class BedMeasurer {
 public:
  BedMeasurer(FrameSource& source, const MeasureOptions& asked)
      : source_(source),
        film_(calibrate_film(source, asked)),
        options_(film_.options),
        shaking_(options_),
        refined_(film_.finder),
        expected_frames_(std::min(most_expected_frames, source.count_if_known().value_or(0))) {
    result_.finder = film_.finder;
    result_.second_finder = film_.second;
    result_.warnings = film_.warnings;
    bed_.lens = film_.lens;
    bed_.lens_given = options_.pixel_aspect && options_.lens_radial;
    bed_.aspect_std_error = film_.aspect_std_error;
    bed_.lens_radial_std_error = film_.lens_radial_std_error;
    bins_.lowest = options_.lowest.value_or(0.0);
    bins_.width = options_.bin_width;
    result_.frames.reserve(expected_frames_);
  }

  Measurement measure() {
    find_all();
    place_held();
    if (std::ranges::none_of(counts_, [](double count) { return count > 0; })) refuse();
    result_.finder.radius_px = refined_.radius_px;
    result_.finder.radius_std_error_px = refined_.radius_std_error_px;
    if (options_.frame_rate_hz) {
      shaking_.finish(bed_);
      for (std::size_t k = shaking_warned_; k < shaking_.warnings().size(); ++k)
        result_.warnings.push_back(shaking_.warnings()[k]);
    }
    bins_.count = std::min(bins_.count, bins_up_to(options_.highest.value_or(highest_ + 1)));
    if (bins_.count == 0)
      throw std::invalid_argument(
          formatted("the profile holds no height: its lowest is %g D, and its highest %.3g D. The highest bead is at "
                    "%.1f D",
                    bins_.lowest, options_.highest.value_or(highest_ + 1), highest_));
    if (cut_above_ > 0) end_below_upper_border();
    average_densities();
    if (coverage_) compare_coverage();
    if (shaking_.turns_per_frame()) average_phases(*shaking_.turns_per_frame());
    look_at_light();
    count_disks();
    look_at_frames();
    return std::move(result_);
  }

 private:
  void find_all() {
    source_.rewind();
    const FrameExaminer examiner(film_);
    std::size_t done = 0;
    OrderedFrames(source_, examiner, options_.threads).run([&](FrameFindings frame, std::size_t waiting) {
      held_.push_back(std::move(frame));
      result_.most_frames_held = std::max(result_.most_frames_held, held_.size() + waiting);
      const bool enough = held_.size() >= std::max(options_.geometry_frames, rim_frames);
      if (options_.disk_sink && (geometry_known_ || enough)) place_held();
      ++done;
      if (options_.progress) options_.progress(done);
    });
  }

  [[nodiscard]] double upper_border() const { return options_.find.roi ? options_.find.roi->top : 0.0; }

  // Beads above the upper border are not seen: the profile ends where the kernel holds whole beads only. Of the beads
  // beyond, about T/(m g D) times those that are cut, nothing is known.
  void end_below_upper_border() {
    const double middle = bed_.floor_px + 0.5 * bed_.floor_slope * film_.finder.width;
    const double seen = (middle - upper_border() - refined_.radius_px) / diameter_px_;
    const double reach = options_.kernel.kind == KernelKind::gaussian ? gaussian_edge * options_.kernel.width
                                                                      : 0.5 * options_.kernel.width;
    result_.column_known = static_cast<double>(cut_above_) <= most_cut_above * static_cast<double>(result_.disk_total);
    if (options_.highest) {
      warn(
          "Beads are cut by the upper border of the frame: above %.1f D beads are missing from the profile. Show the "
          "whole bed, or lower the highest height of the profile.",
          seen - reach);
      return;
    }
    const double bins = std::floor((seen - reach - bins_.lowest) / bins_.width);
    bins_.count = std::min(bins_.count, static_cast<std::size_t>(std::max(fewest_bins, bins)));
    warn(
        "Beads are cut by the upper border of the frame: the profile ends at %.1f D, below the beads that are not "
        "visible.%s Show the whole bed.",
        bins_.lowest + static_cast<double>(bins_.count) * bins_.width,
        result_.column_known ? "" : " Their number is unknown, and so is the column number N D/W.");
  }

  void place_held() {
    if (!geometry_known_) settle_geometry();
    geometry_known_ = true;
    for (FrameFindings& frame : held_) place(frame);
    held_.clear();
  }

  // What lies beside the bed, unless walls or a region are given, is no bead.
  void leave_out_beside(FrameFindings& frame) {
    const auto beside = [&](const FoundDisk& disk) { return disk.x_px < ends_.left_px || disk.x_px > ends_.right_px; };
    const std::size_t left_out = std::erase_if(frame.disks, beside) + std::erase_if(frame.second, beside);
    result_.beside_bed += left_out;
    frame.report.rejected += left_out;
    frame.report.disks = frame.disks.size();
    frame.report.second = frame.second.size();
  }

  void settle_geometry() {
    if (!options_.find.roi && !options_.left_wall_px && !options_.right_wall_px)
      ends_ = ends_of_bed(held_, refined_.radius_px);
    result_.bed_region = region_between(ends_, film_.finder.width, film_.finder.height);
    for (FrameFindings& frame : held_) leave_out_beside(frame);
    check_floor();
    for (std::string& warning : find_geometry(film_, held_, refined_, bed_))
      result_.warnings.push_back(std::move(warning));
    diameter_px_ = options_.bead_diameter_m / bed_.scale_m_per_px;
    result_.contacts = contacts_of(held_, 0.5 * diameter_px_);
    if (const auto row = find_mirror_row(held_, diameter_px_)) leave_out_below(*row);
    if (!bed_.floor_given)
      result_.floor_sag =
          sag_of_floor(lowest_points(held_, diameter_px_, film_.finder.width), diameter_px_) / diameter_px_;
    if (options_.frame_rate_hz) {
      shaking_.begin(held_, diameter_px_, film_.finder.width, bed_);
      for (const std::string& warning : shaking_.warnings()) result_.warnings.push_back(warning);
      shaking_warned_ = shaking_.warnings().size();
    }
    if (bed_.floor_reference == FloorReference::lowest_seen) raise_floor();
    if (bed_.floor_amplitude_px > 0 && !options_.lowest)  // beads follow the floor below its mean position
      bins_.lowest = -std::ceil(bed_.floor_amplitude_px / diameter_px_ / bins_.width) * bins_.width;
    bed_.floor_tilt_degrees = std::atan(bed_.floor_slope) * 180 / std::numbers::pi;
    const double lowest_floor = bed_.floor_px + std::max(0.0, bed_.floor_slope * film_.finder.width);
    bins_.count = bins_up_to(options_.highest.value_or((lowest_floor + refined_.radius_px) / diameter_px_ + 1));
    if (!options_.profile_from_coverage || bed_.scale_of_contacts) return;  // circles are not all that beads cover
    const FrameSides sides = sides_of(film_);
    const double counted_width = options_.left_wall_px && options_.right_wall_px
                                     ? *options_.right_wall_px - *options_.left_wall_px
                                 : bed_.walls_are_frame_sides ? sides.right - sides.left
                                                              : bed_.right_wall_px - bed_.left_wall_px;
    coverage_.emplace(film_.finder, bed_, diameter_px_, counted_width, refined_.radius_px);
  }

  void leave_out_below(double row) {
    PixelRectangle above = options_.find.roi.value_or(PixelRectangle{0, 0, film_.finder.width, film_.finder.height});
    above.height = static_cast<int>(std::lround(row)) - above.top;
    result_.above_mirror_image = above;
  }

  // A floor far outside the picture is that of another.
  void check_floor() const {
    constexpr double farthest = 2;  // heights of the picture
    const double height = film_.finder.height, row = options_.floor_px.value_or(0);
    if (row >= -height && row <= farthest * height) return;
    throw std::invalid_argument(
        formatted("the floor given is at row %.6g, but the picture has %.0f rows: correct it, or leave the floor "
                  "out (--floor): it is then found",
                  row * film_.finder.recorded_px, height * film_.finder.recorded_px));
  }

  // The lowest bottoms of all frames show where the floor is lowest while it carries the bed. Its mean lies between
  // there and an amplitude higher: beds that ride on it all the time show its lowest position, beds that fly over it
  // hardly reach below the mean.
  void raise_floor() {
    const double range = bottom_range(held_, bed_.floor_slope, diameter_px_, film_.finder.width);
    if (options_.floor_amplitude_m && held_.size() >= fewest_for_range &&
        *options_.floor_amplitude_m > bed_.scale_m_per_px * std::max(range, moving_bottom * diameter_px_)) {
      result_.warnings.push_back(
          formatted("The amplitude given is %.2f D, but the lowest beads move by only %.2f D: the amplitude is not "
                    "used. Check the amplitude and the diameter.",
                    *options_.floor_amplitude_m / bed_.scale_m_per_px / diameter_px_, range / diameter_px_));
    } else if (options_.floor_amplitude_m) {
      const double half = 0.5 * *options_.floor_amplitude_m / bed_.scale_m_per_px;
      bed_.floor_px -= half;
      bed_.floor_std_error_px = std::hypot(bed_.floor_std_error_px, half);
      bed_.floor_reference = FloorReference::mean_by_amplitude;
      if (!options_.lowest) bins_.lowest = -std::ceil(half / diameter_px_ / bins_.width) * bins_.width;
      return;
    }
    if (range < moving_bottom * diameter_px_) return;
    bed_.floor_std_error_px = std::hypot(bed_.floor_std_error_px, 0.5 * range);
    result_.warnings.push_back(formatted(
        "The lowest beads move by %.2f D between the frames. If the floor moves, heights are measured from its lowest "
        "position. They may be up to %.2f D larger than heights above its mean position. Give the amplitude of the "
        "floor (--amplitude), the row of its mean position (--floor), or a film with its frame rate (--frame-rate).",
        range / diameter_px_, 0.5 * range / diameter_px_));
  }

  [[nodiscard]] std::size_t bins_up_to(double top) const {
    if (!(top > bins_.lowest)) return 0;
    const double count = std::max(1.0, std::ceil((top - bins_.lowest) / bins_.width - 1e-9));
    if (count > most_heights)
      throw std::invalid_argument(
          formatted("the profile would have %.0f heights from %g to %g D, more than %g: choose a larger "
                    "spacing, or lower its highest height",
                    count, bins_.lowest, top, most_heights));
    return static_cast<std::size_t>(count);
  }

  // A frame's disks in heights, its densities.
  void place(FrameFindings& frame) {
    leave_out_beside(frame);
    const FrameStatus status = frame.report.status;
    if (status == FrameStatus::good || status == FrameStatus::nothing_found) {
      ++good_;
      counts_.push_back(static_cast<double>(frame.disks.size()));
    }
    if (options_.frame_rate_hz) shaking_.add(frame, bed_);
    std::vector<double> heights, second_heights;
    std::vector<MeasuredDisk> disks;
    const auto add = [&](const FoundDisk& disk, int species) {
      disks.push_back(measured(disk, frame.report.index, species));
      const double z = disks.back().z;
      const bool in_width = disk.x_px >= bed_.left_wall_px && disk.x_px < bed_.right_wall_px;
      if (in_width) (species == 1 ? heights : second_heights).push_back(z);
      highest_ = std::max(highest_, z);
      cut_below_ += species == 1 && disk.cut && disk.y_px > film_.finder.height - refined_.radius_px;
      cut_above_ += species == 1 && disk.cut && disk.y_px < upper_border() + refined_.radius_px;
    };
    for (const FoundDisk& disk : frame.disks) add(disk, 1);
    for (const FoundDisk& disk : frame.second) add(disk, 2);
    if (status == FrameStatus::good || status == FrameStatus::nothing_found)
      counts_in_width_.push_back(static_cast<double>(heights.size()));
    result_.disk_total += disks.size();
    double wrong = 0;
    for (const MeasuredDisk& disk : disks) wrong += 1 - disk.probability;
    const double touching = result_.contacts.touching_px > 0 ? result_.contacts.touching_px : diameter_px_;
    wrong_ += std::max(wrong, overlapping_too_many(frame.disks, std::min(touching, diameter_px_)));
    result_.expected_wrong = result_.disk_total > 0 ? wrong_ / static_cast<double>(result_.disk_total) : 0;
    if (status != FrameStatus::unreadable && status != FrameStatus::size_changed) {
      densities_.add(density_of_frame(heights, bed_.width, bins_, options_.kernel), expected_frames_);
      if (film_.second)
        second_densities_.add(density_of_frame(second_heights, bed_.width, bins_, options_.kernel), expected_frames_);
      frame_of_.push_back(frame.report.index);
      if (coverage_) coverage_->add({frame.coverage_of_row, heights}, bins_, expected_frames_);
    }
    if (options_.disk_sink)
      options_.disk_sink(frame.report, disks);
    else
      result_.disks.insert(result_.disks.end(), disks.begin(), disks.end());
    result_.frames.push_back(std::move(frame.report));
    frame = FrameFindings();
  }

  [[nodiscard]] MeasuredDisk measured(const FoundDisk& disk, std::size_t frame, int species) const {
    MeasuredDisk measured;
    measured.species = species;
    measured.frame = frame;
    const PixelPlace seen_at =
        film_.lens.plain() ? PixelPlace{disk.x_px, disk.y_px} : lens_map_.to_recorded({disk.x_px, disk.y_px});
    measured.x_px = seen_at.x;
    measured.y_px = seen_at.y;
    measured.radius_px = species == 1 && !disk.other_size ? refined_.radius_px : disk.radius_px;
    const double cosine = std::cos(std::atan(bed_.floor_slope));
    measured.z = (bed_.floor_px + bed_.floor_slope * disk.x_px - disk.y_px) * cosine / diameter_px_;
    measured.x = ((disk.x_px - bed_.left_wall_px) * cosine +
                  (disk.y_px - bed_.floor_px - bed_.floor_slope * disk.x_px) * cosine * bed_.floor_slope) /
                 diameter_px_;
    measured.quality = disk.quality;
    measured.probability = disk.probability;
    measured.variance_x = disk.variance_x;
    measured.variance_y = disk.variance_y;
    measured.covariance_xy = disk.covariance_xy;
    measured.contrast = disk.contrast;
    measured.std_error_px = std::sqrt(std::max(0.0, 0.5 * (disk.variance_x + disk.variance_y)));
    measured.cut = disk.cut;
    measured.half_hidden = disk.half_hidden;
    return measured;
  }

  [[nodiscard]] DensityProfile average(const std::vector<std::vector<double>>& rows) const {
    return average_profile(rows, bins_, options_.kernel, bed_.scale_relative_std_error);
  }

  void average_densities() {
    if (film_.second) {
      result_.second_profile = average(second_densities_.rows(bins_.count));
      for (double& fraction : result_.second_profile->area_fraction)  // of their own size
        fraction *= std::pow(film_.second->radius_px / refined_.radius_px, 2);
    }
    result_.profile = average(densities_.rows(bins_.count));
  }

  void compare_coverage() {
    result_.coverage_profile = coverage_->profile(bins_);
    result_.coverage_disagreement = coverage_->disagreement(*result_.coverage_profile);
    if (result_.coverage_disagreement > coverage_differs)
      warn(
          "The density from covered area differs from the density from centres by %.3f in n D^2 (rms where it exceeds "
          "0.1; n: disks per area). Possible causes are beads of another kind, walls, dirt or missed beads.",
          result_.coverage_disagreement);
  }

  void average_phases(double turns_per_frame) {
    std::vector<std::vector<std::vector<double>>> by_phase(options_.phase_bins);
    for (std::size_t k = 0; k < densities_.size(); ++k) {
      const double turns = static_cast<double>(frame_of_[k]) * turns_per_frame;
      const double phase = turns - std::floor(turns);
      const auto bin = std::min(options_.phase_bins - 1,
                                static_cast<std::size_t>((phase + 1e-9) * static_cast<double>(options_.phase_bins)));
      by_phase[bin].push_back(densities_.row(k, bins_.count));
    }
    for (std::size_t bin = 0; bin < options_.phase_bins; ++bin) {
      if (by_phase[bin].empty()) continue;
      PhaseProfile phase;
      phase.phase = (static_cast<double>(bin) + 0.5) / static_cast<double>(options_.phase_bins);
      phase.profile = average(by_phase[bin]);
      result_.phases.push_back(std::move(phase));
    }
  }

  void look_at_light() {
    double gain = 0, gain_squares = 0, lit = 0;
    for (const FrameReport& report : result_.frames) {
      if (report.status != FrameStatus::good) continue;
      gain += report.light.gain, gain_squares += report.light.gain * report.light.gain, ++lit;
    }
    if (lit > 0) bed_.flicker = std::sqrt(std::max(0.0, gain_squares / lit - gain / lit * gain / lit));
    if (bed_.flicker > light_flickers)
      warn(
          "The light flickers: the standard deviation of the contrast between frames is %.1f %%. It is corrected in "
          "each frame.",
          100 * bed_.flicker);
  }

  static std::pair<double, double> mean_and_scatter(const std::vector<double>& counts) {
    double mean = 0, scatter = 0;
    for (const double count : counts) mean += count / static_cast<double>(counts.size());
    for (const double count : counts) scatter += (count - mean) * (count - mean);
    return {mean, counts.size() > 1 ? std::sqrt(scatter / static_cast<double>(counts.size() - 1)) : 0};
  }

  void count_disks() {
    std::tie(result_.disk_count_mean, result_.disk_count_std) = mean_and_scatter(counts_);
    std::tie(result_.count_in_width_mean, result_.count_in_width_std) = mean_and_scatter(counts_in_width_);
  }

  [[noreturn]] void refuse() const {
    throw NoDisksError("the frames",
                       "disks were found in none of the " + std::to_string(result_.frames.size()) + " frames",
                       result_.frames.empty() ? "the stream is empty" : result_.frames.front().why,
                       "check that sharp beads, at least 10 px wide, are visible");
  }

  // What else deserves a word.
  void look_at_frames() {
    for (const std::string& warning : film_.finder.warnings) result_.warnings.push_back(warning);
    std::size_t bad = 0, of_other_size = 0;
    std::string example;
    for (const FrameReport& report : result_.frames) {
      if (report.status == FrameStatus::good) continue;
      if (bad++ == 0) example = report.why;
      of_other_size += report.status == FrameStatus::size_changed;
    }
    if (of_other_size > 0)
      result_.warnings.push_back(std::to_string(of_other_size) + " of " + std::to_string(result_.frames.size()) +
                                 " frames differ from the first one in size, in pixels, and were left out, because "
                                 "heights and scale differ between views. Measure the frames of each size separately.");
    if (bad)
      result_.warnings.push_back(std::to_string(bad) + " of " + std::to_string(result_.frames.size()) +
                                 " frames could not be used. Reason for the first: " + example);
    if (result_.disk_count_mean > 0 && result_.disk_count_std > number_varies * result_.disk_count_mean)
      warn(
          "The number of disks found varies by %.1f (standard deviation) around its mean %.1f: beads leave the view, "
          "or are missed.",
          result_.disk_count_std, result_.disk_count_mean);
    result_.floor_out_of_view = good_ > 0 && cut_below_ > good_ && !bed_.floor_given;
    result_.surface_out_of_view = good_ > 0 && cut_above_ > good_;
    if (result_.floor_out_of_view)
      result_.warnings.emplace_back("Beads are cut by the lower border of the frame: the floor is not in view.");
    if (std::abs(bed_.floor_tilt_degrees) > floor_tilts)
      warn("The floor is tilted by %.2f +- %.2f degrees. Heights are measured perpendicular to it.",
           bed_.floor_tilt_degrees, bed_.floor_tilt_std_error_degrees);
  }

  [[gnu::format(printf, 2, 3)]] void warn(const char* format, ...) {
    char text[400];
    std::va_list values;
    va_start(values, format);
    std::vsnprintf(text, sizeof text, format, values);
    va_end(values);
    result_.warnings.emplace_back(text);
  }

  FrameSource& source_;
  const FilmCalibration film_;
  const MeasureOptions& options_;
  BedEnds ends_;
  Measurement result_;
  BedCalibration& bed_ = result_.calibration;
  const LensMap lens_map_{film_.lens, film_.recorded_width, film_.recorded_height};
  Shaking shaking_;
  std::size_t shaking_warned_ = 0;
  FinderCalibration refined_;  // the radius of all frames' rims
  double diameter_px_ = 0;
  HeightBins bins_;                  // up to the top of the frame; cut at the highest disk in the end
  std::vector<FrameFindings> held_;  // found, not yet placed: their floor and walls are not known
  bool geometry_known_ = false;
  const std::size_t expected_frames_;
  FrameRows densities_, second_densities_;
  std::optional<Coverage> coverage_;
  std::vector<std::size_t> frame_of_;
  std::vector<double> counts_, counts_in_width_;
  double highest_ = 0;  // D
  std::size_t good_ = 0, cut_below_ = 0, cut_above_ = 0;
  double wrong_ = 0;  // disks that are none, by their probabilities
};

}  // namespace

std::vector<std::string> MeasureOptions::validate() const {
  std::vector<std::string> problems = find.validate();
  const auto require = [&](bool holds, const std::string& problem) {
    if (!holds) problems.push_back(problem);
  };
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  require(positive(bead_diameter_m),
          formatted("bead_diameter_m is %g; give the diameter of a bead in m, above 0", bead_diameter_m));
  require(positive(scale_m_per_px.value_or(1)),
          formatted("scale_m_per_px is %g; it must be above 0", scale_m_per_px.value_or(1)));
  constexpr double least_bead = 1, widest_bead = 1e5;  // px
  const double bead = bead_diameter_m / scale_m_per_px.value_or(0.01 * bead_diameter_m);
  require(bead >= least_bead && bead <= widest_bead,
          formatted("with the length of a pixel given (scale), a bead is %.3g px wide: check its unit", bead));
  require(positive(second_diameter_m.value_or(1)),
          formatted("second_diameter_m is %g; it must be above 0", second_diameter_m.value_or(1)));
  require(positive(bin_width), formatted("bin_width is %g; it must be above 0", bin_width));
  require(kernel.kind != KernelKind::none && positive(kernel.width),
          "the density is measured through a kernel: give a kernel other than none, with a finite width above 0");
  for (const double aspect : {pixel_aspect.value_or(1), first_pixel_aspect})
    require(aspect >= narrowest_pixel && aspect <= widest_pixel,
            formatted("a pixel's width over its height is given as %g; it must lie in %g .. %g", aspect,
                      narrowest_pixel, widest_pixel));
  require(!left_wall_px || !right_wall_px || *left_wall_px < *right_wall_px,
          "the left wall must lie left of the right wall");
  require(!floor_amplitude_m || positive(*floor_amplitude_m),
          formatted("floor_amplitude_m is %g; it must be above 0", floor_amplitude_m.value_or(0)));
  require(!shaking_frequency_hz || frame_rate_hz,
          "profiles by phase need the shaking frequency and the frame rate: give frame_rate_hz, too");
  require(geometry_frames > 0, "geometry_frames must be above 0");
  require(phase_bins > 0, "phase_bins must be above 0");
  return problems;
}

Measurement measure_bed(FrameSource& source, const MeasureOptions& asked) {
  if (const auto problems = asked.validate(); !problems.empty())
    throw std::invalid_argument("measure_bed: " + problems.front());
  if (asked.reduction > 1) return measure_reduced_bed(source, asked);
  return BedMeasurer(source, asked).measure();
}

}  // namespace shakebed::ingest
