#include "ingest/profile/velocities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>

#include "ingest/find/nearby.hpp"
#include "ingest/profile/frame_findings.hpp"
#include "statistics/correlated_series.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

constexpr std::size_t nobody = std::numeric_limits<std::size_t>::max();

// First and one-past-last place in Measurement::disks of each frame.
std::vector<std::pair<std::size_t, std::size_t>> ranges_of(const Measurement& measurement) {
  std::size_t frames = measurement.frames.size();
  for (const MeasuredDisk& disk : measurement.disks) frames = std::max(frames, disk.frame + 1);
  std::vector<std::pair<std::size_t, std::size_t>> ranges(frames, {0, 0});
  for (std::size_t k = 0; k < measurement.disks.size(); ++k) {
    auto& range = ranges[measurement.disks[k].frame];
    if (range.second == 0) range.first = k;
    range.second = k + 1;
  }
  return ranges;
}

// For each disk of `from`, the nearest of `to` within `reach` (D).
std::vector<std::size_t> nearest(const std::vector<MeasuredDisk>& disks, std::pair<std::size_t, std::size_t> from,
                                 std::pair<std::size_t, std::size_t> to, double reach) {
  const Nearby candidates(to.second - to.first, reach,
                          [&](std::size_t i) { return std::pair(disks[to.first + i].x, disks[to.first + i].z); });
  std::vector<std::size_t> result;
  for (std::size_t k = from.first; k < from.second; ++k) {
    double best = reach;
    std::size_t winner = nobody;
    candidates.any_near(disks[k].x, disks[k].z, [&](std::size_t i) {
      const MeasuredDisk& disk = disks[to.first + i];
      const double distance = std::hypot(disk.x - disks[k].x, disk.z - disks[k].z);
      if (distance < best) {
        best = distance;
        winner = to.first + i;
      }
      return false;
    });
    result.push_back(winner);
  }
  return result;
}

}  // namespace

std::vector<Link> link_disks(const Measurement& measurement, double largest_step) {
  std::vector<Link> links;
  const auto ranges = ranges_of(measurement);
  for (std::size_t frame = 0; frame + 1 < ranges.size(); ++frame) {
    if (ranges[frame].second == 0 || ranges[frame + 1].second == 0) continue;
    const auto forward = nearest(measurement.disks, ranges[frame], ranges[frame + 1], largest_step);
    const auto backward = nearest(measurement.disks, ranges[frame + 1], ranges[frame], largest_step);
    for (std::size_t k = 0; k < forward.size(); ++k) {
      const std::size_t partner = forward[k];
      if (partner == nobody || backward[partner - ranges[frame + 1].first] != ranges[frame].first + k) continue;
      links.push_back({frame, ranges[frame].first + k, partner});
    }
  }
  return links;
}

namespace {

// Disks with a frame after theirs.
std::size_t followable(const std::vector<std::pair<std::size_t, std::size_t>>& ranges) {
  std::size_t could = 0;
  for (std::size_t frame = 0; frame + 1 < ranges.size(); ++frame)
    if (ranges[frame + 1].second > 0) could += ranges[frame].second - ranges[frame].first;
  return could;
}

double share_of(std::size_t links, std::size_t could) {
  return could > 0 ? static_cast<double>(links) / static_cast<double>(could) : 0;
}

}  // namespace

double followed_share(const std::vector<FrameFindings>& frames, double diameter_px) {
  Measurement sequence;
  for (const FrameFindings& frame : frames)
    for (const std::vector<FoundDisk>* disks : {&frame.disks, &frame.second})
      for (const FoundDisk& disk : *disks) {
        MeasuredDisk placed;
        placed.frame = frame.report.index;
        placed.x = disk.x_px / diameter_px, placed.z = -disk.y_px / diameter_px;
        sequence.disks.push_back(placed);
      }
  return share_of(link_disks(sequence, longest_step).size(), followable(ranges_of(sequence)));
}

namespace {

// Of a velocity with memory, mean steps of a time x (in units of the memory): the correlation of two that follow one
// another over their mean square, (1 - e)^2/(2 (x - 1 + e)) with e = exp(-x), and the mean square lost.
double correlation_of_steps(double x) {
  const double e = std::exp(-x);
  return (1 - e) * (1 - e) / (2 * (x - 1 + e));
}
// The correction takes collisions for many and weak. Of a simulated bed filmed at 500 and 2,000 Hz, whose temperatures
// are known, it missed 0.4 of what it corrects.
constexpr double correction_missed = 0.4;
constexpr double large_correction = 1.15;

double with_correction(double std_error, const KineticTemperature& t) {
  return std::hypot(std_error, correction_missed * (1 - 1 / t.finite_time_factor) * t.over_mg_m);
}

double finite_time_factor(double correlation) {
  double low = 1e-4, high = 50;
  for (int round = 0; round < 100; ++round) {
    const double x = std::sqrt(low * high);
    (correlation_of_steps(x) > correlation ? low : high) = x;
  }
  const double x = std::sqrt(low * high);
  return x < 1e-3 ? 1 + x / 3 : x * x / (2 * (x - 1 + std::exp(-x)));
}

// Kinetic temperatures from links: steps from frame to frame, less the flow, less the localisation error, corrected for
// the time between the frames.
class StepStatistics {
 public:
  StepStatistics(const Measurement& measurement, const VelocityOptions& options)
      : disks_(measurement.disks),
        options_(options),
        ranges_(ranges_of(measurement)),
        links_(link_disks(measurement, options.largest_step)),
        diameter_px_(2 * measurement.calibration.radius_px),
        diameter_m_(measurement.calibration.scale_m_per_px * diameter_px_) {}

  VelocityMeasurement operator()() {
    count_links();
    if (links_.empty()) {
      result_.warnings.emplace_back("No disk could be followed from one frame to the next.");
      return result_;
    }
    take_steps();
    subtract_flow();
    sum_by_frame();
    result_.horizontal = temperature(along_x_);
    result_.vertical = temperature(along_z_);
    warn();
    return result_;
  }

 private:
  struct Step {
    double x = 0, z = 0, weight = 0;
  };
  struct Sums {                   // of one component
    std::vector<double> squares;  // a frame
    double next = 0;              // products of steps that follow one another
  };

  void count_links() {
    result_.links = links_.size();
    result_.linked_share = share_of(links_.size(), followable(ranges_));
  }

  void take_steps() {
    for (const Link& link : links_) {
      const MeasuredDisk &from = disks_[link.from], &to = disks_[link.to];
      steps_.push_back({to.x - from.x, to.z - from.z, 0});
      result_.mean_step += std::hypot(steps_.back().x, steps_.back().z) / static_cast<double>(links_.size());
    }
  }

  // Steps less the mean of their frame and bin of height; it takes one of n degrees of freedom.
  void subtract_flow() {
    std::map<std::pair<std::size_t, long>, std::vector<std::size_t>> bins;
    for (std::size_t k = 0; k < links_.size(); ++k)
      bins[{links_[k].frame, std::lround(std::floor(disks_[links_[k].from].z / options_.flow_bin_width))}].push_back(k);
    for (const auto& [bin, members] : bins) {
      const double n = static_cast<double>(members.size());
      if (members.size() < 3) continue;  // too few for a flow: these steps stay out
      double mean_x = 0, mean_z = 0;
      for (const std::size_t k : members) {
        mean_x += steps_[k].x / n;
        mean_z += steps_[k].z / n;
      }
      for (const std::size_t k : members) {
        steps_[k].x -= mean_x;
        steps_[k].z -= mean_z;
        steps_[k].weight = n / (n - 1);
      }
    }
  }

  // Squares of the steps, and products of those of one disk that follow one another, for the finite-time loss. The
  // localisation error of the frame between the two enters both with opposite signs: -sigma^2 per component.
  void sum_by_frame() {
    std::unordered_map<std::size_t, std::size_t> link_from;
    for (std::size_t k = 0; k < links_.size(); ++k) link_from[links_[k].from] = k;
    for (std::vector<double>* sums : {&along_x_.squares, &along_z_.squares, &counted_, &noise_})
      sums->assign(ranges_.size(), 0);
    double variance_count = 0;
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const Step& step = steps_[k];
      if (step.weight == 0) continue;
      const std::size_t frame = links_[k].frame;
      const double blur = localisation_error(disks_[links_[k].from], disks_[links_[k].to]);
      along_x_.squares[frame] += step.weight * step.x * step.x;
      along_z_.squares[frame] += step.weight * step.z * step.z;
      noise_[frame] += blur;
      counted_[frame] += 1;
      variance_ += 0.5 * blur;
      variance_count += 1;
      const auto follower = link_from.find(links_[k].to);
      if (follower == link_from.end() || steps_[follower->second].weight == 0) continue;
      const double weight = std::sqrt(step.weight * steps_[follower->second].weight);
      along_x_.next += weight * step.x * steps_[follower->second].x;
      along_z_.next += weight * step.z * steps_[follower->second].z;
      next_count_ += 1;
    }
    variance_ = variance_count > 0 ? variance_ / variance_count : 0;
  }

  // Of a step between the two, per component [D^2].
  double localisation_error(const MeasuredDisk& from, const MeasuredDisk& to) const {
    return (from.std_error_px * from.std_error_px + to.std_error_px * to.std_error_px) / (diameter_px_ * diameter_px_);
  }

  KineticTemperature temperature(const Sums& sums) const {
    KineticTemperature t;
    std::vector<double> series;
    double total = 0, total_noise = 0, total_count = 0;
    for (std::size_t frame = 0; frame < ranges_.size(); ++frame) {
      if (counted_[frame] == 0) continue;
      series.push_back((sums.squares[frame] - noise_[frame]) / counted_[frame]);
      total += sums.squares[frame];
      total_noise += noise_[frame];
      total_count += counted_[frame];
    }
    if (total_count == 0) return t;
    const double dt = 1 / options_.frame_rate_hz;
    const double to_temperature = diameter_m_ * diameter_m_ / (dt * dt * options_.gravity_m_per_s2);
    const double mean_square = std::max(0.0, (total - total_noise) / total_count);
    // Only where motion stands out of the localisation error: below it the correlation says nothing.
    if (next_count_ > 30 && mean_square > 0.2 * total_noise / total_count)
      t.finite_time_factor =
          finite_time_factor(std::clamp((sums.next / next_count_ + variance_) / mean_square, 0.05, 0.999));
    else
      t.finite_time_factor = 1;
    t.localisation_bias_m = total_noise / total_count * to_temperature;
    t.over_mg_m = mean_square * t.finite_time_factor * to_temperature;
    t.std_error_m = with_correction(statistics::mean_of(series).std_error * t.finite_time_factor * to_temperature, t);
    return t;
  }

  void warn() {
    if (!result_.usable()) {
      result_.warnings.push_back(
          formatted("Only %.0f %% of the disks could be followed from frame to frame: velocities are not reliable and "
                    "do not enter the answer. Use a higher frame rate.",
                    100 * result_.linked_share));
      return;
    }
    if (result_.mean_step > 0.25)
      result_.warnings.push_back(
          formatted("Disks move by %.2g D between frames on average: fast disks are lost, and the T of velocities is "
                    "too low. Use a higher frame rate.",
                    result_.mean_step));
    const double factor = std::max(result_.horizontal.finite_time_factor, result_.vertical.finite_time_factor);
    if (factor > large_correction)
      result_.warnings.push_back(
          formatted("Velocities change between frames: the T of velocities is corrected by a factor of %.3g, and its "
                    "error allows for 0.4 of this correction. Use a higher frame rate.",
                    factor));
  }

  const std::vector<MeasuredDisk>& disks_;
  const VelocityOptions& options_;
  const std::vector<std::pair<std::size_t, std::size_t>> ranges_;
  const std::vector<Link> links_;
  const double diameter_px_, diameter_m_;
  std::vector<Step> steps_;  // a link each [D]
  Sums along_x_, along_z_;
  std::vector<double> counted_, noise_;   // a frame: steps, and their localisation errors
  double next_count_ = 0, variance_ = 0;  // variance_: of the place in one frame [D^2]
  VelocityMeasurement result_;
};

}  // namespace

VelocityMeasurement measure_velocities(const Measurement& measurement, const VelocityOptions& options) {
  if (!(options.frame_rate_hz > 0)) throw std::invalid_argument("measure_velocities: frame_rate_hz must be positive");
  return StepStatistics(measurement, options)();
}

VelocityMeter::VelocityMeter(double bead_diameter_m, const VelocityOptions& options, std::size_t stretch_frames)
    : bead_diameter_m_(bead_diameter_m), options_(options), stretch_frames_(std::max<std::size_t>(3, stretch_frames)) {}

void VelocityMeter::add(const std::vector<MeasuredDisk>& disks_of_frame) {
  for (MeasuredDisk disk : disks_of_frame) {
    disk.frame = frames_;
    stretch_.disks.push_back(disk);
  }
  ++frames_;
  if (frames_ < stretch_frames_) return;
  measure_stretch();
  stretch_.disks.clear();
  frames_ = 0;
  add(disks_of_frame);
}

void VelocityMeter::measure_stretch() {
  if (frames_ < 2 || stretch_.disks.empty()) return;
  stretch_.calibration.radius_px = stretch_.disks.front().radius_px;
  stretch_.calibration.scale_m_per_px = bead_diameter_m_ / (2 * stretch_.calibration.radius_px);
  measured_.push_back(measure_velocities(stretch_, options_));
}

VelocityMeasurement VelocityMeter::result() {
  // A last stretch of a few frames says little: it counts only if it is the only one.
  if (measured_.empty() || 2 * frames_ > stretch_frames_) measure_stretch();
  if (measured_.empty()) {
    VelocityMeasurement nothing;
    nothing.warnings.emplace_back("No two frames with disks follow one another: there are no velocities.");
    return nothing;
  }
  if (measured_.size() == 1) return measured_.front();
  VelocityMeasurement all;
  const double n = static_cast<double>(measured_.size());
  const auto mean_of = [&](KineticTemperature VelocityMeasurement::*component) {
    KineticTemperature mean;
    mean.finite_time_factor = 0;
    std::vector<double> series;
    for (const VelocityMeasurement& one : measured_) {
      const KineticTemperature& t = one.*component;
      series.push_back(t.over_mg_m);
      mean.localisation_bias_m += t.localisation_bias_m / n;
      mean.finite_time_factor += t.finite_time_factor / n;
    }
    const statistics::Mean found = statistics::mean_of(series);
    mean.over_mg_m = found.value;
    mean.std_error_m = with_correction(found.std_error, mean);
    return mean;
  };
  all.horizontal = mean_of(&VelocityMeasurement::horizontal);
  all.vertical = mean_of(&VelocityMeasurement::vertical);
  for (const VelocityMeasurement& one : measured_) {
    all.links += one.links;
    all.linked_share += one.linked_share / n;
    all.mean_step += one.mean_step / n;
    for (const std::string& warning : one.warnings)
      if (all.warnings.size() < 3) all.warnings.push_back(warning);
  }
  return all;
}

}  // namespace shakebed::ingest
