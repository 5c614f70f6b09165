#include "ingest/profile/velocities.hpp"

#include <algorithm>
#include <array>
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
// The correction takes collisions for many and weak. Of eleven simulated beds, filmed at 200 to 3,500 pictures a second
// (D = 2 mm), it missed 0.6 of what it corrects (rms; up to 1.0 of T_z of shaken beds).
constexpr double correction_missed = 0.6;
constexpr double large_correction = 1.15;
// Pairs of steps below which there is no correlation.
constexpr double few_pairs = 30;

double with_correction(double std_error, const KineticTemperature& t) {
  return std::hypot(std_error, t.finite_time_error * t.over_mg_m);
}

double finite_time_factor(double correlation) {
  correlation = std::clamp(correlation, 0.05, 0.999);
  double low = 1e-4, high = 50;
  for (int round = 0; round < 100; ++round) {
    const double x = std::sqrt(low * high);
    (correlation_of_steps(x) > correlation ? low : high) = x;
  }
  const double x = std::sqrt(low * high);
  return x < 1e-3 ? 1 + x / 3 : x * x / (2 * (x - 1 + std::exp(-x)));
}

// Sums over steps.
struct Tally {
  std::array<double, 2> squares{};  // along x and z
  std::array<double, 2> next{};     // products of steps that follow one another
  double noise = 0;                 // what localisation errors add to the squares
  double count = 0, next_count = 0;

  Tally& operator+=(const Tally& other) {
    for (std::size_t axis = 0; axis < 2; ++axis) squares[axis] += other.squares[axis], next[axis] += other.next[axis];
    noise += other.noise, count += other.count, next_count += other.next_count;
    return *this;
  }
  double moved(std::size_t axis) const { return squares[axis] - noise; }
  // Of successive steps. The localisation error of the frame between the two enters it by minus its variance. The
  // correlation is none of motion where this does not stand out of that error.
  bool has_correlation(std::size_t axis) const { return next_count >= few_pairs && moved(axis) > 0.2 * noise; }
  double correlation(std::size_t axis) const {
    return (next[axis] / next_count + 0.5 * noise / count) / (moved(axis) / count);
  }
  double variance_of_correlation(std::size_t axis) const {
    return std::pow(squares[axis] / moved(axis), 2) / next_count;
  }
};

// Kinetic temperatures from links: steps from frame to frame, less the flow, less the localisation error, corrected for
// the time between the frames. Collisions are many where and when a bed is dense, and few elsewhere. So the correction
// is that of cells, one a bin of height and frame, each together with its neighbours. That of all steps together is
// smaller in shaken beds; the difference enters the error.
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
    sum_by_cell();
    result_.horizontal = temperature(0);
    result_.vertical = temperature(1);
    warn();
    return result_;
  }

 private:
  struct Step {
    double x = 0, z = 0, weight = 0;
  };
  using Cell = std::pair<long, std::size_t>;  // bin of height, frame

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
    std::map<Cell, std::vector<std::size_t>> bins;
    for (std::size_t k = 0; k < links_.size(); ++k) bins[cell_of(links_[k])].push_back(k);
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

  Cell cell_of(const Link& link) const {
    return {std::lround(std::floor(disks_[link.from].z / options_.flow_bin_width)), link.frame};
  }

  // Squares of the steps, and products of those of one disk that follow one another, for the finite-time loss.
  void sum_by_cell() {
    std::unordered_map<std::size_t, std::size_t> link_from;
    for (std::size_t k = 0; k < links_.size(); ++k) link_from[links_[k].from] = k;
    for (std::size_t k = 0; k < links_.size(); ++k) {
      const Step& step = steps_[k];
      if (step.weight == 0) continue;
      Tally& cell = cells_[cell_of(links_[k])];
      cell.squares[0] += step.weight * step.x * step.x;
      cell.squares[1] += step.weight * step.z * step.z;
      cell.noise += localisation_error(disks_[links_[k].from], disks_[links_[k].to]);
      cell.count += 1;
      const auto follower = link_from.find(links_[k].to);
      if (follower == link_from.end() || steps_[follower->second].weight == 0) continue;
      const Step& next = steps_[follower->second];
      const double weight = std::sqrt(step.weight * next.weight);
      cell.next[0] += weight * step.x * next.x;
      cell.next[1] += weight * step.z * next.z;
      cell.next_count += 1;
    }
    for (const auto& [place, cell] : cells_) all_ += cell;
  }

  // Of a step between the two, per component [D^2].
  double localisation_error(const MeasuredDisk& from, const MeasuredDisk& to) const {
    return (from.std_error_px * from.std_error_px + to.std_error_px * to.std_error_px) / (diameter_px_ * diameter_px_);
  }

  // A cell and those beside it: of the bins above and below and of the frames before and after.
  Tally around(const Cell& place) const {
    Tally sum;
    for (long bin = place.first - 1; bin <= place.first + 1; ++bin)
      for (std::size_t frame = place.second > 0 ? place.second - 1 : 0; frame <= place.second + 1; ++frame)
        if (const auto found = cells_.find({bin, frame}); found != cells_.end()) sum += found->second;
    return sum;
  }

  // Correlations of the cells, each together with its neighbours.
  std::map<Cell, statistics::Mean> correlations(std::size_t axis) const {
    std::map<Cell, statistics::Mean> found;
    for (const auto& [place, cell] : cells_)
      if (const Tally near = around(place); near.has_correlation(axis))
        found[place] = {near.correlation(axis), std::sqrt(near.variance_of_correlation(axis))};
    return found;
  }

  // What the squares of the steps grow by when each cell has its own correction. As far as its correlation is uncertain
  // beside the scatter of them all, a cell has that of all steps.
  double factor_by_cells(std::size_t axis) const {
    const double of_all = all_.correlation(axis);
    const auto cells = correlations(axis);
    double excess = 0, weight = 0;
    for (const auto& [place, c] : cells) {
      const double precision = 1 / (c.std_error * c.std_error);
      excess += std::pow((c.value - of_all) / c.std_error, 2) - 1;
      weight += precision;
    }
    const double scatter = weight > 0 ? std::max(0.0, excess / weight) : 0;  // variance between cells
    double corrected = 0;
    for (const auto& [place, cell] : cells_) {
      double correlation = of_all;
      if (const auto own = cells.find(place); own != cells.end()) {
        const double error = own->second.std_error;
        correlation += (own->second.value - of_all) * scatter / (scatter + error * error);
      }
      corrected += cell.moved(axis) * finite_time_factor(correlation);
    }
    return std::max(1.0, corrected / all_.moved(axis));
  }

  // Mean square of a frame's steps less the localisation error, of frames that have any.
  std::vector<double> squares_by_frame(std::size_t axis) const {
    std::map<std::size_t, Tally> frames;
    for (const auto& [place, cell] : cells_) frames[place.second] += cell;
    std::vector<double> series;
    for (const auto& [frame, sum] : frames) series.push_back(sum.moved(axis) / sum.count);
    return series;
  }

  KineticTemperature temperature(std::size_t axis) const {
    KineticTemperature t;
    if (all_.count == 0) return t;
    const double dt = 1 / options_.frame_rate_hz;
    const double to_temperature = diameter_m_ * diameter_m_ / (dt * dt * options_.gravity_m_per_s2);
    t.localisation_bias_m = all_.noise / all_.count * to_temperature;
    if (all_.has_correlation(axis)) {
      t.finite_time_factor = factor_by_cells(axis);
      t.finite_time_error = std::hypot(1 - finite_time_factor(all_.correlation(axis)) / t.finite_time_factor,
                                       correction_missed * (1 - 1 / t.finite_time_factor));
    }
    t.displacement_m = std::max(0.0, all_.moved(axis) / all_.count) * to_temperature;
    t.displacement_error_m = statistics::mean_of(squares_by_frame(axis)).std_error * to_temperature;
    t.over_mg_m = t.displacement_m * t.finite_time_factor;
    t.std_error_m = with_correction(t.displacement_error_m * t.finite_time_factor, t);
    return t;
  }

  void warn() {
    if (!result_.enough_are_followed()) {
      result_.warnings.push_back(
          formatted("Only %.0f %% of the disks could be followed from frame to frame: velocities are not reliable and "
                    "are not used in the answer. Use a higher frame rate.",
                    100 * result_.linked_share));
      return;
    }
    const double factor = std::max(result_.horizontal.finite_time_factor, result_.vertical.finite_time_factor);
    if (!result_.usable()) {
      result_.warnings.push_back(
          formatted("Disks collide between frames: the T of velocities would have to be corrected by a factor of %.2g. "
                    "Velocities are not reliable and are not used in the answer. Use a higher frame rate.",
                    factor));
      return;
    }
    if (result_.mean_step > 0.25)
      result_.warnings.push_back(
          formatted("Disks move by %.2g D between frames on average: fast disks are lost, and the T of velocities is "
                    "too low. Use a higher frame rate.",
                    result_.mean_step));
    if (factor > large_correction)
      result_.warnings.push_back(
          formatted("Disks collide between frames: the T of velocities is corrected by a factor of %.3g. Its error "
                    "includes the uncertainty of this correction. Use a higher frame rate.",
                    factor));
  }

  const std::vector<MeasuredDisk>& disks_;
  const VelocityOptions& options_;
  const std::vector<std::pair<std::size_t, std::size_t>> ranges_;
  const std::vector<Link> links_;
  const double diameter_px_, diameter_m_;
  std::vector<Step> steps_;  // a link each [D]
  std::map<Cell, Tally> cells_;
  Tally all_;
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
    nothing.warnings.emplace_back("No two successive frames contain disks, so there are no velocities.");
    return nothing;
  }
  if (measured_.size() == 1) return measured_.front();
  VelocityMeasurement all;
  const double n = static_cast<double>(measured_.size());
  const auto mean_of = [&](KineticTemperature VelocityMeasurement::*component) {
    KineticTemperature mean;
    mean.finite_time_factor = 0;
    std::vector<double> series, displacements;
    for (const VelocityMeasurement& one : measured_) {
      const KineticTemperature& t = one.*component;
      series.push_back(t.over_mg_m), displacements.push_back(t.displacement_m);
      mean.localisation_bias_m += t.localisation_bias_m / n;
      mean.finite_time_factor += t.finite_time_factor / n;
      mean.finite_time_error += t.finite_time_error / n;
    }
    const statistics::Mean found = statistics::mean_of(series), moved = statistics::mean_of(displacements);
    mean.over_mg_m = found.value;
    mean.std_error_m = with_correction(found.std_error, mean);
    mean.displacement_m = moved.value, mean.displacement_error_m = moved.std_error;
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
