#include "ingest/profile/velocities.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <unordered_map>

#include "ingest/find/nearby.hpp"
#include "statistics/correlated_series.hpp"

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

VelocityMeasurement measure_velocities(const Measurement& measurement, const VelocityOptions& options) {
  if (!(options.frame_rate_hz > 0)) throw std::invalid_argument("measure_velocities: frame_rate_hz must be positive");
  VelocityMeasurement result;
  const std::vector<MeasuredDisk>& disks = measurement.disks;
  const std::vector<Link> links = link_disks(measurement, options.largest_step);
  result.links = links.size();
  const auto ranges = ranges_of(measurement);
  std::size_t could = 0;
  for (std::size_t frame = 0; frame + 1 < ranges.size(); ++frame)
    if (ranges[frame + 1].second > 0) could += ranges[frame].second - ranges[frame].first;
  result.linked_share = could ? static_cast<double>(links.size()) / static_cast<double>(could) : 0;
  if (links.empty()) {
    result.warnings.emplace_back("No disk could be followed from one frame to the next.");
    return result;
  }
  const double scale = measurement.calibration.scale_m_per_px;
  const double diameter_px = 2 * measurement.calibration.radius_px;
  const double diameter_m = scale * diameter_px;
  const double dt = 1 / options.frame_rate_hz;

  // Steps less the flow of their height bin; the flow takes one of n degrees of freedom.
  struct Step {
    double x = 0, z = 0, weight = 0;
  };
  std::vector<Step> steps(links.size());
  std::map<std::pair<std::size_t, long>, std::vector<std::size_t>> bins;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const MeasuredDisk &from = disks[links[k].from], &to = disks[links[k].to];
    steps[k].x = to.x - from.x;
    steps[k].z = to.z - from.z;
    result.mean_step += std::hypot(steps[k].x, steps[k].z) / static_cast<double>(links.size());
    bins[{links[k].frame, std::lround(std::floor(from.z / options.flow_bin_width))}].push_back(k);
  }
  for (const auto& [bin, members] : bins) {
    const double n = static_cast<double>(members.size());
    if (members.size() < 3) continue;  // no flow to speak of can be told: these steps stay out
    double mean_x = 0, mean_z = 0;
    for (const std::size_t k : members) {
      mean_x += steps[k].x / n;
      mean_z += steps[k].z / n;
    }
    for (const std::size_t k : members) {
      steps[k].x -= mean_x;
      steps[k].z -= mean_z;
      steps[k].weight = n / (n - 1);
    }
  }

  // Correlation of successive steps of one disk, for the finite-time loss. The localisation error of the frame between
  // the two enters both with opposite signs: -sigma^2 per component.
  std::unordered_map<std::size_t, std::size_t> link_from;
  for (std::size_t k = 0; k < links.size(); ++k) link_from[links[k].from] = k;
  const std::size_t frames = ranges.size();
  std::vector<double> sum_xx(frames, 0), sum_zz(frames, 0), counted(frames, 0), noise(frames, 0);
  double next_xx = 0, next_zz = 0, next_count = 0;
  double variance = 0, variance_count = 0;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const Step& step = steps[k];
    if (step.weight == 0) continue;
    const MeasuredDisk &from = disks[links[k].from], &to = disks[links[k].to];
    const double blur =
        (from.std_error_px * from.std_error_px + to.std_error_px * to.std_error_px) / (diameter_px * diameter_px);
    sum_xx[links[k].frame] += step.weight * step.x * step.x;
    sum_zz[links[k].frame] += step.weight * step.z * step.z;
    noise[links[k].frame] += blur;
    counted[links[k].frame] += 1;
    variance += 0.5 * blur;
    variance_count += 1;
    const auto follower = link_from.find(links[k].to);
    if (follower == link_from.end() || steps[follower->second].weight == 0) continue;
    const double weight = std::sqrt(step.weight * steps[follower->second].weight);
    next_xx += weight * step.x * steps[follower->second].x;
    next_zz += weight * step.z * steps[follower->second].z;
    next_count += 1;
  }
  variance = variance_count > 0 ? variance / variance_count : 0;

  const auto temperature = [&](const std::vector<double>& sums, double next_sum) {
    KineticTemperature t;
    std::vector<double> series;
    double total = 0, total_noise = 0, total_count = 0;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      if (counted[frame] == 0) continue;
      series.push_back((sums[frame] - noise[frame]) / counted[frame]);
      total += sums[frame];
      total_noise += noise[frame];
      total_count += counted[frame];
    }
    if (total_count == 0) return t;
    const double to_temperature = diameter_m * diameter_m / (dt * dt * options.gravity_m_per_s2);
    const double mean_square = std::max(0.0, (total - total_noise) / total_count);
    // Mean steps of a velocity with memory tau: <s_k s_k+1>/<s_k^2> = (1 - e)^2/(2 (x - 1 + e)), e = exp(-x).
    double factor = 1;
    // (Only where motion stands out of the localisation error: below it the correlation says nothing.)
    if (next_count > 30 && mean_square > 0.2 * total_noise / total_count) {
      const double correlation = std::clamp((next_sum / next_count + variance) / mean_square, 0.05, 0.999);
      double low = 1e-4, high = 50;
      for (int round = 0; round < 100; ++round) {
        const double x = std::sqrt(low * high), e = std::exp(-x);
        const double expected = (1 - e) * (1 - e) / (2 * (x - 1 + e));
        (expected > correlation ? low : high) = x;
      }
      const double x = std::sqrt(low * high);
      factor = x < 1e-3 ? 1 + x / 3 : x * x / (2 * (x - 1 + std::exp(-x)));
    }
    t.finite_time_factor = factor;
    t.localisation_bias_m = total_noise / total_count * to_temperature;
    t.over_mg_m = mean_square * factor * to_temperature;
    t.std_error_m = statistics::mean_of(series).std_error * factor * to_temperature;
    return t;
  };
  result.horizontal = temperature(sum_xx, next_xx);
  result.vertical = temperature(sum_zz, next_zz);
  if (result.linked_share < 0.9)
    result.warnings.emplace_back("Only " + std::to_string(static_cast<int>(100 * result.linked_share)) +
                                 " % of the disks could be followed: the frames follow too slowly for velocities.");
  if (result.mean_step > 0.25)
    result.warnings.emplace_back("Disks move by " + std::to_string(result.mean_step) +
                                 " D between frames on average: fast ones are lost and T is too low.");
  if (result.horizontal.finite_time_factor > 1.5 || result.vertical.finite_time_factor > 1.5)
    result.warnings.emplace_back("Velocities change much between frames: T leans on the finite-time correction.");
  return result;
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
    mean.std_error_m = found.std_error;
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
