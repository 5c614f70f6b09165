#include "fit/profile_fit/objections.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "fit/profile_fit/fit_warnings.hpp"
#include "fit/profile_fit/measured_profile.hpp"

namespace shakebed::fit {

namespace {

// Temperature and shift follow from the shape of a fall: fewer heights with a density show none.
constexpr std::size_t least_heights = 6;
// Averaged over one diameter, the density of the bed must be known to this part of itself (median over the denser
// half).
constexpr double greatest_error = 0.5;
// From its greatest value to the highest height, the density must fall to this part, by so many standard errors.
constexpr double fallen = 0.5, fall_errors = 3.0;
// Below the densest height, this part of the bed may be missing of a bed as dense as there: floors in motion thin the
// bed above them.
constexpr double most_missing = 0.5;
// above the first gap, less dense than this part of the greatest density, there may lie so much of the bed.
constexpr double least_gap = 0.02, most_above = 0.1;
// Where a crystal's rows show, a diameter may hold two of them. Below this part of their modulation it does not matter.
constexpr double few_rows = 0.05;

class ProfileReader {
 public:
  ProfileReader(const BlurredProfile& seen, std::optional<double> column_number, bool velocities)
      : column_number_(column_number), velocities_(velocities), rows_seen_(seen.rows_seen) {
    FitResult ignored;
    readable_ = measure_profile(seen.profile, measured_, ignored) == FitStatus::ok;
  }

  std::vector<Objection> run() {
    if (!readable_) return {};
    greatest_ = *std::max_element(measured_.one_diameter_mean.begin(), measured_.one_diameter_mean.end());
    if (!(greatest_ > 0.0)) return {};  // no signal, which the fits say
    if (!(measured_.area > 0.0)) {
      object("The densities are negative, on average.", "Check the background that was subtracted from them.");
      return found_;
    }
    look_at_heights();
    look_at_units();
    if (!found_.empty()) return found_;  // what follows would be of the wrong unit
    look_at_errors();
    look_at_fall();
    look_at_order();
    look_at_gaps();
    return found_;
  }

 private:
  void object(std::string why, std::string advice) { found_.push_back({std::move(why), std::move(advice)}); }

  void look_at_heights() {
    const auto filled =
        std::count_if(measured_.density.begin(), measured_.density.end(), [](double d) { return d > 0.0; });
    if (static_cast<std::size_t>(filled) >= least_heights) return;
    object(
        "Only " + std::to_string(filled) + " heights have a density above 0.",
        "Measure the density at " + std::to_string(least_heights) + " heights or more, half a diameter apart or less.");
  }

  void look_at_units() {
    if (heights_look_like_metres(measured_))
      object("The heights span only " + number(measured_.height.back() - measured_.height.front()) +
                 " D, less than one disk.",
             "Give heights in disk diameters.");
    if (is_denser_than_close_packing(rows_seen_ < few_rows ? greatest_ : 0.5 * greatest_))
      object("The density averaged over one diameter reaches " + number(greatest_, 4) +
                 " per D^2, above close packing (1.155).",
             "Check the diameter D, and that the density is n D^2 (n: disks per area).");
    if (column_number_ && area_is_of_another_unit(measured_.area, *column_number_))
      object("The area under the profile is " + number(measured_.area, 3) + ", but N D/W is " +
                 number(*column_number_, 3) + ".",
             "Check the unit of the heights, and that the profile contains the whole bed.");
  }

  [[nodiscard]] std::size_t densest() const {
    const std::vector<double>& mean = measured_.one_diameter_mean;
    return static_cast<std::size_t>(std::max_element(mean.begin(), mean.end()) - mean.begin());
  }

  // Of the density averaged over one diameter about height i.
  [[nodiscard]] double error_of_mean(std::size_t i) const {
    std::vector<Eigen::Index> near;
    for (std::size_t k = 0; k < measured_.size(); ++k)
      if (std::abs(measured_.height[k] - measured_.height[i]) <= 0.5) near.push_back(static_cast<Eigen::Index>(k));
    double variance = 0.0;
    for (const Eigen::Index a : near) {
      for (const Eigen::Index b : near) {
        if (measured_.covariance.size() > 0)
          variance += measured_.covariance(a, b);
        else if (a == b)
          variance += std::pow(measured_.error[static_cast<std::size_t>(a)], 2);
      }
    }
    return std::sqrt(std::max(0.0, variance)) / static_cast<double>(near.size());
  }

  void look_at_errors() {
    if (!measured_.errors_known) return;
    std::vector<double> relative;
    for (std::size_t i = 0; i < measured_.size(); ++i) {
      const double mean = measured_.one_diameter_mean[i];
      if (mean > fallen * greatest_) relative.push_back(error_of_mean(i) / mean);
    }
    const auto middle = relative.begin() + static_cast<std::ptrdiff_t>(relative.size() / 2);
    std::nth_element(relative.begin(), middle, relative.end());
    if (*middle <= greatest_error) return;
    object("Where the bed is densest, the relative error of the density is " +
               number(100.0 * *middle, *middle < 1 ? 2 : 3) + " %.",
           "Take more photographs of the bed from the side, or measure longer.");
  }

  void look_at_fall() {
    const double top = measured_.one_diameter_mean.back();
    const double error =
        measured_.errors_known ? std::hypot(error_of_mean(densest()), error_of_mean(measured_.size() - 1)) : 0.0;
    if (top <= fallen * greatest_ && greatest_ - top >= fall_errors * error) return;
    const std::string values = number(greatest_, 2) + " per D^2 where it is greatest, and " + number(top, 2) +
                               " at the greatest height, " + number(measured_.height.back(), 3) + " D";
    if (top > fallen * greatest_)
      object("The density does not fall with height: it is " + values + ".",
             "T follows from the decrease of the density with height. Photograph the bed from the side, with floor and "
             "surface in view. Measure heights upwards.");
    else if (found_.empty())
      object("The density does not fall by more than its errors: it is " + values + ".",
             "Take more photographs of the bed from the side, or measure longer.");
  }

  // The part of the area that belongs to height i [1/D].
  [[nodiscard]] double area_at(std::size_t i) const {
    const double left = i > 0 ? measured_.height[i - 1] : measured_.height[i];
    const double right = i + 1 < measured_.size() ? measured_.height[i + 1] : measured_.height[i];
    return 0.5 * (right - left);
  }

  // In a bed at one temperature each height carries what lies above it, and is denser.
  void look_at_order() {
    if (velocities_) return;
    double missing = 0.0;
    for (std::size_t i = 0; i < densest(); ++i)
      if (measured_.height[i] > 0.0) missing += area_at(i) * std::max(0.0, greatest_ - measured_.density[i]);
    if (!(missing > most_missing * measured_.area)) return;
    object(
        "The density rises with height, up to " + number(measured_.height[densest()], 3) + " D.",
        "Check that heights are measured upwards from the floor. A dense layer that floats on a hot gas has no single "
        "temperature.");
  }

  // A bed under gravity has no gap with disks above it.
  void look_at_gaps() {
    std::size_t first = densest();
    while (first < measured_.size() && measured_.one_diameter_mean[first] >= least_gap * greatest_) ++first;
    double above = 0.0;
    for (std::size_t i = first; i < measured_.size(); ++i) above += area_at(i) * std::max(0.0, measured_.density[i]);
    if (!(above > most_above * measured_.area)) return;
    object(number(100.0 * above / measured_.area, 2) + " % of the disks lie above a gap at " +
               number(measured_.height[first], 3) + " D.",
           "Check the densities above the gap, and leave them out if they do not belong to the bed.");
  }

  MeasuredProfile measured_;
  std::optional<double> column_number_;
  bool velocities_;
  double rows_seen_;
  bool readable_ = false;
  double greatest_ = 0.0;  // density averaged over one diameter [1/D^2]
  std::vector<Objection> found_;
};

}  // namespace

std::vector<Objection> objections_to(const BlurredProfile& seen, std::optional<double> column_number, bool velocities) {
  return ProfileReader(seen, column_number, velocities).run();
}

}  // namespace shakebed::fit
