#include "ingest/find/find_disks.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_profile.hpp"
#include "ingest/find/bead_set.hpp"
#include "ingest/find/bed_light.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/joint_fit.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/find/nearby.hpp"
#include "statistics/ranks.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// Of the median bead's share of contrast: below it, a disk is not reported even if half hidden ones are wanted.
constexpr double least_reported = 0.5;
// A bead with less than this share explained in its worst quarter of rim is half hidden.
constexpr double least_rim_explained = 0.4;

// px: what the tabulated profile leaves in frames without noise, where centres were off by 0.0009 to 0.0026 px (rms,
// six looks).
constexpr double model_error_px = 0.0012;

// The disks of one frame.
class FrameFinder {
 public:
  FrameFinder(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options)
      : frame_(frame),
        calibration_(calibration),
        options_(options),
        radius_(calibration.rim_radius_px),
        edge_(calibration.edge_width_px),
        noise_(in_contrast_units(calibration.residual_level)),
        white_noise_(in_contrast_units(calibration.noise_level)),
        seen_(seen_part(frame, calibration)),
        soft_(calibration.profile, radius_, edge_, softening_for(edge_)),
        exact_(calibration.profile, radius_, edge_, 0.6 * softening_for(edge_)),
        flat_(flatten(seen_, calibration.light, result_.light = light_at_first_sight(seen_, calibration))),
        fit_(flat_) {}

  FindResult find() {
    return find_from(candidates_by({calibration_.profile, radius_, edge_}, flat_, noise_, least_candidate_score));
  }

  FindResult find_from(std::vector<DiskCandidate> places) {
    disks_ = disks_at(seen_ones(flat_, std::move(places)));
    if (disks_.empty()) {
      result_.why_nothing = "no place in the frame looks like a bead of radius " +
                            std::to_string(radius_ * calibration_.recorded_px) + " px";
      return std::move(result_);
    }
    fit_.set_table(&exact_);
    fit_.reset(flat_, disks_);
    fit_all();
    merge_doubled();
    const bool pruned = prune_fitted();
    const bool bands = take_out_bands();
    std::vector<double> explained;
    for (const ModelDisk& disk : disks_) explained.push_back(disk.explained);
    typical_ = std::max(0.3, median_of(explained));
    reconsider_doubtful(pruned || bands);
    if (options_.learn_rim) learn_rim();
    report();
    return std::move(result_);
  }

 private:
  void fit_all() {
    bool repaired = false;
    for (int sweep = 0; sweep < options_.joint_fit_sweeps; ++sweep) {
      bool converged = step(sweep);
      if (sweep == 1) take_light_of_frame();
      if (sweep == 1 || (sweep == 4 && repaired)) {
        fit_.judge(disks_, radius_ + 1);
        const std::size_t pruned = prune(fit_, disks_, radius_, faintly_explained);
        dropped_ += pruned;
        if (pruned > 0) fit_.judge(disks_, radius_ + 1);
        repaired = repair(fit_, disks_, radius_, noise_) > 0;
        converged = converged && !repaired;
      } else if (sweep == 3 && repaired) {
        converged = !settle(fit_, disks_, radius_) && converged;
      }
      if (converged) break;
    }
  }

  // Two sweeps along the widened gradient, then steps of all together. Whether nothing moves any more.
  bool step(int sweep) {
    const bool first = sweep < 2;
    fit_.set_table(first ? &soft_ : &exact_);
    if (sweep == 2)
      for (ModelDisk& disk : disks_) disk.last_step = ModelDisk().last_step;  // still by the soft table only
    if (!first) return step_all(fit_, flat_, disks_, rules(options_.joint_fit_sweeps - sweep - 1));
    const StepRules step = rules(0);
    fit_.sweep(disks_, sweep == 0 ? 0.3 * radius_ : 0.5, step.tolerance, step.bound);
    return false;
  }

  [[nodiscard]] StepRules rules(int sweeps) const {
    return {std::clamp(0.006 * noise_ / 0.1, 6e-4, 4e-3), std::max(residual_bound, 4 * noise_), sweeps};
  }

  void take_light_of_frame() {
    const FrameLight own = light_of_frame(flat_, fit_, noise_);
    if (own.plain()) return;
    FrameLight& light = result_.light;
    light = {light.shift + light.gain * own.shift, light.gain * own.gain};
    flat_ = flatten(seen_, calibration_.light, light);
    fit_.reset(flat_, disks_);
  }

  // One bead that was taken for two: they lie much nearer to one another than beads of this bed do. One disk in their
  // place stays where it explains more than either of them did.
  void merge_doubled() {
    fit_.judge(disks_, radius_ + 1);
    std::vector<DoubledDisks> doubled = doubled_disks(disks_, radius_);
    if (doubled.empty()) return;
    std::vector<ModelDisk> touched;
    for (const DoubledDisks& pair : doubled) {
      fit_.subtract(pair.one.x, pair.one.y, -1.0F);
      fit_.subtract(pair.other.x, pair.other.y, -1.0F);
      fit_.subtract(pair.merged.x, pair.merged.y, 1.0F);
      disks_.push_back(pair.merged);
      touched.push_back(pair.merged);
    }
    wake_near(touched);
    fit_again();
    const std::size_t first = disks_.size() - doubled.size();
    for (std::size_t k = 0; k < doubled.size(); ++k) {
      ModelDisk& merged = disks_[first + k];
      if (merged.explained > std::max(doubled[k].one.explained, doubled[k].other.explained)) continue;
      fit_.subtract(merged.x, merged.y, -1.0F);
      fit_.subtract(doubled[k].one.x, doubled[k].one.y, 1.0F);
      fit_.subtract(doubled[k].other.x, doubled[k].other.y, 1.0F);
      merged = doubled[k].one;
      disks_.push_back(doubled[k].other);
    }
    wake_near(touched);
    fit_again();
  }

  bool prune_fitted() {
    fit_.judge(disks_, radius_ + 1);
    const std::size_t pruned = prune(fit_, disks_, radius_, faintly_explained);
    if (!settle(fit_, disks_, radius_) && pruned > 0) fit_.judge(disks_, radius_ + 1);
    dropped_ += pruned;
    return pruned > 0;
  }

  // A dark band at the border, a floor say, can be laid out with cut beads; but a bead has something else around it.
  bool take_out_bands() {
    std::vector<ModelDisk> bands;
    std::erase_if(disks_, [&](const ModelDisk& disk) {
      const bool cut = disk.x < radius_ || disk.y < radius_ || disk.x > frame_.width - 1 - radius_ ||
                       disk.y > frame_.height - 1 - radius_;
      if (!cut || unexplained_around(fit_, disk, radius_, edge_, noise_) <= most_unexplained_around) return false;
      bands.push_back(disk);
      return true;
    });
    for (const ModelDisk& band : bands) fit_.subtract(band.x, band.y, -1.0F);
    wake_near(bands);
    dropped_ += bands.size();
    return !bands.empty();
  }

  void wake_near(const std::vector<ModelDisk>& changed) {
    const Nearby near = nearby(disks_, 2 * fit_.reach());
    for (const ModelDisk& disk : changed) wake(near, disks_, disk);
  }

  void fit_again() {
    constexpr int most_steps = 4;
    for (int step = 0; step < std::min(most_steps, options_.joint_fit_sweeps); ++step)
      if (step_all(fit_, flat_, disks_, rules(options_.joint_fit_sweeps))) break;
    fit_.judge(disks_, radius_ + 1);
  }

  // A bead of another size, modelled as one of these, pushes its neighbours about; one half hidden holds them in place.
  // What is doubtful is taken out, and stays out where its neighbours then fit better.
  void reconsider_doubtful(bool changed) {
    std::vector<ModelDisk> taken_out;
    std::erase_if(disks_, [&](const ModelDisk& disk) {
      if (disk.explained >= least_explained * typical_) return false;
      fit_.subtract(disk.x, disk.y, -1.0F);
      taken_out.push_back(disk);
      return true;
    });
    if (taken_out.empty() && !changed) return;
    const std::vector<ModelDisk> before = disks_;
    wake_near(taken_out);
    fit_again();
    std::vector<ModelDisk> put_back;
    const Nearby near_before = nearby(before, 2.6 * radius_);
    for (const ModelDisk& disk : taken_out) {
      double gain = 0;
      near_before.any_near(disk.x, disk.y, [&](std::size_t i) {
        gain += disks_[i].explained - before[i].explained;
        return false;
      });
      const bool reported = disk.explained >= least_reported * typical_ && options_.keep_half_hidden;
      if (gain > 0 && !reported) {
        ++dropped_;
        continue;
      }
      put_back.push_back(disk);
    }
    for (const ModelDisk& disk : put_back) {
      fit_.subtract(disk.x, disk.y, 1.0F);
      disks_.push_back(disk);
    }
    wake_near(put_back);
    if (!put_back.empty()) fit_again();
  }

  void learn_rim() {
    std::vector<ModelDisk> clear;
    for (const ModelDisk& disk : disks_)
      if (disk.explained >= least_explained * typical_) clear.push_back(disk);
    result_.profile_beads = clear.size();
    if (clear.empty()) return;
    result_.profile = learn_profile(
        {&fit_}, {&clear}, calibration_.profile,
        {.reach_px = calibration_.profile.reach_px(), .knot_px = knot_for(radius_, edge_), .radius_px = radius_});
  }

  // Where centres are reported.
  struct Region {
    double left = 0, top = 0, right = 0, bottom = 0;
    [[nodiscard]] bool holds(double x, double y) const {
      return x >= left - 0.5 && y >= top - 0.5 && x < right - 0.5 && y < bottom - 0.5;
    }
    [[nodiscard]] bool holds_whole(const ModelDisk& disk, double radius) const {
      return disk.x - radius >= left - 0.5 && disk.y - radius >= top - 0.5 && disk.x + radius <= right - 0.5 &&
             disk.y + radius <= bottom - 0.5;
    }
  };
  [[nodiscard]] Region region() const {
    if (!options_.roi) return {0, 0, static_cast<double>(frame_.width), static_cast<double>(frame_.height)};
    const PixelRectangle& roi = *options_.roi;
    return {static_cast<double>(roi.left), static_cast<double>(roi.top), static_cast<double>(roi.left + roi.width),
            static_cast<double>(roi.top + roi.height)};
  }

  void report() {
    double residual_sum = 0;
    const Region region = this->region();
    const std::vector<CentreCovariance> covariances = fit_.covariances(disks_);
    for (std::size_t k = 0; k < disks_.size(); ++k) {
      const ModelDisk& disk = disks_[k];
      const double share = disk.explained / typical_;
      if (share < least_reported || (share < least_explained && !options_.keep_half_hidden)) {
        ++dropped_;
        continue;
      }
      if (!region.holds(disk.x, disk.y)) continue;
      result_.disks.push_back(found(disk, covariances[k], region));
      residual_sum += 1 - disk.explained;
    }
    std::vector<FoundDisk>& disks = result_.disks;
    std::sort(disks.begin(), disks.end(), [](const FoundDisk& a, const FoundDisk& b) {
      if (a.y_px != b.y_px) return a.y_px < b.y_px;
      return a.x_px < b.x_px;
    });
    result_.rejected = dropped_;
    result_.steps = fit_.steps();
    if (disks.empty()) {
      result_.why_nothing = std::to_string(dropped_) +
                            " places were examined, but none looks like a filled bead of radius " +
                            std::to_string(radius_ * calibration_.recorded_px) + " px";
      return;
    }
    result_.residual_level = std::abs(calibration_.contrast_level) * result_.light.gain *
                             std::sqrt(std::max(0.0, residual_sum / static_cast<double>(disks.size())));
  }

  [[nodiscard]] FoundDisk found(const ModelDisk& disk, const CentreCovariance& covariance, const Region& region) const {
    FoundDisk found;
    found.x_px = disk.x;
    found.y_px = disk.y;
    found.radius_px = calibration_.radius_px;
    // Noise is as wide as a pixel of the camera.
    const double noise = white_noise_ * frame_.enlargement, model = model_error_px * frame_.enlargement;
    if (covariance.xx > 0 && covariance.yy > 0) {
      found.variance_x = noise * noise * covariance.xx + model * model;
      found.variance_y = noise * noise * covariance.yy + model * model;
      found.covariance_xy = noise * noise * covariance.xy;
    }
    const double share = disk.explained / typical_;
    found.quality = std::clamp(share, 0.0, 1.0);
    found.contrast = disk.amplitude;
    found.cut = !region.holds_whole(disk, radius_);
    found.half_hidden = share < least_explained || disk.rim_explained < least_rim_explained * typical_;
    return found;
  }

  [[nodiscard]] double in_contrast_units(double level) const {
    return std::max(1e-3, level / std::max(1e-6, std::abs(calibration_.contrast_level)));
  }

  const GrayFrame& frame_;
  const FinderCalibration& calibration_;
  const FindOptions& options_;
  const double radius_, edge_;        // px
  const double noise_, white_noise_;  // contrast units: by which disks are searched for, and of which errors are made
  FindResult result_;
  const GrayFrame seen_;
  const ProfileTable soft_, exact_;
  GrayFrame flat_;
  JointFit fit_;
  std::vector<ModelDisk> disks_;
  double typical_ = 1;  // share of the contrast around it that a bead explains
  std::size_t dropped_ = 0;
};

}  // namespace

std::vector<std::string> FindOptions::validate() const {
  std::vector<std::string> problems;
  if (radius_px && !(*radius_px > 0 && std::isfinite(*radius_px)))
    problems.push_back(formatted("radius_px is %g; it must be above 0", *radius_px));
  if (hold_radius && !radius_px)
    problems.emplace_back("hold_radius fixes the radius at radius_px, which is missing: give radius_px");
  if (roi && (roi->width <= 0 || roi->height <= 0))
    problems.push_back(formatted("roi is %d px wide and %d px high; both must be above 0", roi->width, roi->height));
  if (joint_fit_sweeps < 0)
    problems.push_back(formatted("joint_fit_sweeps is %d; it must be 0 or more", joint_fit_sweeps));
  return problems;
}

std::vector<Circle> circles_of(const std::vector<FoundDisk>& disks) {
  std::vector<Circle> circles(disks.size());
  for (std::size_t k = 0; k < disks.size(); ++k)
    circles[k].x = disks[k].x_px, circles[k].y = disks[k].y_px, circles[k].radius = disks[k].radius_px;
  return circles;
}

FindResult find_disks(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options) {
  require_consistent(frame);
  if (frame.width != calibration.width || frame.height != calibration.height) {
    FindResult nothing;
    nothing.why_nothing = "the frame is " + std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                          " px, but the beads were learned in frames of " + std::to_string(calibration.width) + " x " +
                          std::to_string(calibration.height) + " px";
    return nothing;
  }
  return FrameFinder(frame, calibration, options).find();
}

FindResult find_disks_from(const std::vector<DiskCandidate>& places, const GrayFrame& frame,
                           const FinderCalibration& calibration, const FindOptions& options) {
  return FrameFinder(frame, calibration, options).find_from(places);
}

FindResult find_disks(const GrayFrame& frame, const FindOptions& options, FinderCalibration* calibration_found) {
  const CalibrationResult calibrated = calibrate_finder({&frame}, options);
  if (!calibrated.found) {
    FindResult nothing;
    nothing.why_nothing = calibrated.why_not;
    return nothing;
  }
  if (calibration_found) *calibration_found = calibrated.calibration;
  return find_disks(frame, calibrated.calibration, options);
}

GrayFrame residual_frame(const GrayFrame& frame, const FindResult& found, const FinderCalibration& calibration) {
  require_consistent(frame);
  if (frame.width != calibration.width || frame.height != calibration.height)
    throw std::invalid_argument(
        "residual_frame: the frame differs in size from the frames in which the beads were learned");
  const GrayFrame flat = flatten(seen_part(frame, calibration), calibration.light, found.light);
  const ProfileTable table(calibration.profile, calibration.rim_radius_px, calibration.edge_width_px, 0, false);
  JointFit fit(flat);
  fit.set_table(&table);
  for (const FoundDisk& disk : found.disks) fit.subtract(disk.x_px, disk.y_px, 1.0F);
  GrayFrame residual = fit.residual_image();
  for (float& level : residual.pixels)
    level = unseen(level) ? 0.0F : level * static_cast<float>(found.light.gain * calibration.contrast_level);
  return residual;
}

}  // namespace shakebed::ingest
