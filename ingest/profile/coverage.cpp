#include "ingest/profile/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace shakebed::ingest {

namespace {

// n D^2: below it, a bin is left out when coverage is compared with centres.
constexpr double least_compared = 0.1;

// The bead's profile summed along rows: the share of its contrast below each height, heights row_step_px apart from
// -reach to reach, 0 at the first and 1 at the last.
constexpr double row_step_px = 0.25;
std::vector<double> contrast_by_row(const FinderCalibration& finder) {
  const double reach = finder.profile.reach_px();
  const auto half = static_cast<std::size_t>(std::ceil(reach / row_step_px));
  const auto level_at = [&](double r) {
    const auto cell = static_cast<std::size_t>(r / finder.profile.step_px);
    return cell < finder.profile.level.size() ? static_cast<double>(finder.profile.level[cell]) : 0.0;
  };
  std::vector<double> below(2 * half + 1, 0.0);
  for (std::size_t k = 1; k < below.size(); ++k) {
    const double y = (static_cast<double>(k) - 0.5 - static_cast<double>(half)) * row_step_px;
    double row = 0;
    for (double x = 0.5 * row_step_px; x < reach; x += row_step_px) {
      row += 2 * level_at(std::sqrt(x * x + y * y));
      if (finder.profile.asymmetry)  // y_px grows downwards
        row += finder.profile.asymmetry->at(x, -y) + finder.profile.asymmetry->at(-x, -y);
    }
    below[k] = below[k - 1] + row;
  }
  const double all = below.back();
  for (double& value : below) value = all > 0 ? value / all : 0;
  return below;
}

}  // namespace

Coverage::Coverage(const FinderCalibration& finder, const BedCalibration& bed, double diameter_px,
                   double counted_width_px, double bead_radius_px)
    : finder_(finder),
      bed_(bed),
      diameter_px_(diameter_px),
      counted_width_px_(counted_width_px),
      bead_radius_px_(bead_radius_px),
      rows_of_bead_(contrast_by_row(finder)),
      rows_middle_(0.5 * static_cast<double>(rows_of_bead_.size() - 1)) {}

double Coverage::part_below(double height) const {
  const double place = height * diameter_px_ / row_step_px + rows_middle_;
  if (place <= 0) return 0.0;
  if (place >= static_cast<double>(rows_of_bead_.size() - 1)) return 1.0;
  const auto cell = static_cast<std::size_t>(place);
  const double part = place - static_cast<double>(cell);
  return rows_of_bead_[cell] * (1 - part) + rows_of_bead_[cell + 1] * part;
}

void Coverage::add(const FrameCoverage& frame, const HeightBins& bins, std::size_t expected_frames) {
  const double middle_floor = bed_.floor_px + bed_.floor_slope * 0.5 * finder_.width;
  const double bead_reach = rows_middle_ * row_step_px / diameter_px_;
  std::vector<double> area(bins.count, 0.0);
  for (std::size_t row = 0; row < frame.rows.size(); ++row) {
    const double upper = (middle_floor - static_cast<double>(row) + 0.5) / diameter_px_;
    const double lower = upper - 1 / diameter_px_;
    const double first = std::floor((lower - bins.lowest) / bins.width);
    for (double bin = std::max(0.0, first); bin < static_cast<double>(bins.count); ++bin) {
      const double bin_low = bins.lowest + bin * bins.width, bin_high = bin_low + bins.width;
      if (bin_low >= upper) break;
      const double overlap = std::min(upper, bin_high) - std::max(lower, bin_low);
      if (overlap > 0)
        area[static_cast<std::size_t>(bin)] += static_cast<double>(frame.rows[row]) * overlap * diameter_px_;
    }
  }
  const double bead_area = std::pow(bead_radius_px_ / finder_.radius_px, 2);
  for (double& value : area)
    value *= bead_area * 4 / std::numbers::pi / (bins.width * diameter_px_ * counted_width_px_);
  covered_.add(area, expected_frames);
  through_chord_.resize(bins.count, 0.0);
  for (const double height : frame.heights) {
    const double from = std::floor((height - bead_reach - bins.lowest) / bins.width) - 1;
    for (auto bin = static_cast<std::size_t>(std::max(0.0, from)); bin < bins.count; ++bin) {
      const double low = bins.lowest + static_cast<double>(bin) * bins.width - height;
      if (low > bead_reach) break;
      through_chord_[bin] += (part_below(low + bins.width) - part_below(low)) / (bins.width * bed_.width);
    }
  }
}

DensityProfile Coverage::profile(const HeightBins& bins) const {
  return average_profile(covered_.rows(bins.count), bins, {KernelKind::disk_chord, 1.0}, bed_.scale_relative_std_error);
}

double Coverage::disagreement(const DensityProfile& profile) const {
  const auto frames = static_cast<double>(std::max<std::size_t>(1, covered_.size()));
  double square = 0;
  std::size_t compared = 0;
  for (std::size_t bin = 0; bin < profile.bins.count; ++bin) {
    const double by_centres = bin < through_chord_.size() ? through_chord_[bin] / frames : 0;
    if (by_centres < least_compared) continue;
    const double difference = by_centres - profile.number_density[bin];
    square += difference * difference;
    ++compared;
  }
  return compared ? std::sqrt(square / static_cast<double>(compared)) : 0;
}

}  // namespace shakebed::ingest
