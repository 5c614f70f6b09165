#include "fit/profile_fit/fit_warnings.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::fit {

namespace {

// A profile of at least so many bins that spans less than this is taken to be in metres. [D]
constexpr double least_range = 1.0;
constexpr std::size_t range_bins = 5;
// Densities this much above close packing, and areas this far from N D/W, are named; an area this far off is a wrong
// unit.
constexpr double density_margin = 1.02, area_margin = 0.1, unit_ratio = 1.5;
// A bin so many standard errors off that makes more than this part of chi2 is an outlier.
constexpr double outlier_errors = 8.0, outlier_share = 0.5;
// T depends on the window when it moves by so many standard errors and by this part of itself.
constexpr double window_errors = 3.0, window_change = 0.1;
// The sum rule is broken by this part of the solid's height and by so many standard errors.
constexpr double sum_rule_change = 0.1, sum_rule_errors = 4.0;
// phi_0 with an error above this part of it is not determined.
constexpr double undetermined_plateau = 0.1;

void warn_about_misfit(FitResult& result) {
  if (!result.misfit) return;
  result.warnings.push_back(
      "The model does not fit: chi2/dof = " + number(result.chi2_per_dof) + ", p = " + number(result.p_value, 2) + "." +
      (result.model_error > 0.0
           ? " A systematic error of " + number(result.model_error) + " was added to every density."
       : result.errors_scaled ? " The errors were multiplied by " + number(std::sqrt(result.chi2_per_dof)) + "."
                              : ""));
}

void warn_about_an_outlier(const MeasuredProfile& measured, bool robust, FitResult& result) {
  double worst = 0.0;
  double worst_height = 0.0;
  double rest = 0.0;
  for (const Residual& r : result.residuals) {
    if (!r.used || !(r.std_error > 0.0)) continue;
    const double size = std::abs(r.density - r.model) / r.std_error;
    rest += size * size;
    if (size > worst) {
      worst = size;
      worst_height = r.height;
    }
  }
  if (!measured.errors_known || result.dof <= 1 || worst <= outlier_errors || worst * worst <= outlier_share * rest)
    return;
  result.warnings.push_back("One density, at the height " + number(worst_height, 4) + " D, lies " + number(worst, 2) +
                            " standard errors from the fit and contributes most of chi2." +
                            (robust ? "" : " If it is an outlier, the option \"robust\" limits its influence."));
}

void warn_about_the_window(FitResult& result) {
  if (!(result.temperature.value > 0.0) || result.temperature.fixed) return;
  double low = result.temperature.value;
  double high = low;
  double furthest = 0.0;
  for (const WindowFit& row : result.window_sweep) {
    if (row.status != FitStatus::ok) continue;
    const double off = std::abs(row.temperature.value - result.temperature.value);
    const double sigma = std::hypot(row.temperature.std_error, result.temperature.std_error);
    if (off > window_errors * sigma && off > window_change * result.temperature.value)
      furthest = std::max(furthest, off);
    low = std::min(low, row.temperature.value);
    high = std::max(high, row.temperature.value);
  }
  if (furthest > 0.0) {
    result.warnings.push_back("the temperature changes with the window, from " + number(low) + " to " + number(high) +
                              " m g D: the profile has no single temperature in this model");
  }
}

void warn_about_the_sum_rule(FitResult& result) {
  if (result.critical_status != ValueStatus::ok || result.status != FitStatus::ok) return;
  const double off = std::abs(result.solid_height_by_sum_rule - result.solid_height.value);
  if (result.solid_height.value > 0.0 &&
      off > std::max(sum_rule_change * result.solid_height.value, sum_rule_errors * result.solid_height.std_error)) {
    result.warnings.push_back("the fitted solid is " + number(result.solid_height.value) +
                              " D high, but the sum rule with this T gives " +
                              number(std::max(0.0, result.solid_height_by_sum_rule)) + " D");
  }
}

}  // namespace

bool heights_look_like_metres(const MeasuredProfile& measured) {
  const double range = measured.height.back() - measured.height.front();
  return range > 0.0 && range < least_range && measured.size() >= range_bins;
}

bool is_denser_than_close_packing(double density) { return density > density_margin * close_packing_density; }

bool area_is_of_another_unit(double area, double column_number) {
  const double ratio = area / column_number;
  return ratio > unit_ratio || ratio < 1.0 / unit_ratio;
}

void warn_about_units(const MeasuredProfile& measured, const FitOptions& options, FitResult& result) {
  if (heights_look_like_metres(measured)) {
    result.warnings.push_back("the heights span only " + number(measured.height.back() - measured.height.front()) +
                              " D. If they are in metres, give them in disk diameters");
  }
  if (is_denser_than_close_packing(measured.greatest_mean)) {
    result.warnings.push_back(
        "the density averaged over one diameter reaches " + number(measured.greatest_mean, 4) +
        ", above close packing (1.155). Check that it is n D^2 (n: disks per area) with the right D");
  }
  if (!options.column_number) return;
  const double given = *options.column_number;
  const double ratio = measured.area / given;
  if (std::abs(ratio - 1.0) <= area_margin) return;
  std::string text = "the area under the profile is " + number(measured.area, 4) + ", but N D/W is " +
                     number(given, 4) + " (ratio " + number(ratio) + ")";
  if (ratio > 0.0 && area_is_of_another_unit(measured.area, given)) {
    text += ". The heights may be in a wrong unit, or part of the bed is missing. Heights divided by " +
            number(ratio, 4) + " would agree with N D/W";
  }
  result.warnings.push_back(std::move(text));
}

void warn_about_fit(const MeasuredProfile& measured, const FitOptions& options, const FitSetup& setup,
                    FitResult& result) {
  if (setup.model->uses_temperature() && result.status == FitStatus::ok && result.solid_height.value <= 0.0) {
    result.warnings.emplace_back(
        "no solid: the fitted curve does not reach the plateau density above the floor (T > T_c)");
  }
  warn_about_misfit(result);
  warn_about_an_outlier(measured, options.robust, result);
  warn_about_the_window(result);
  if (options.column_number) warn_about_the_sum_rule(result);
  if (!setup.least_squares.free[FitModel::plateau]) return;
  // Where nothing depends on it but what also depends on the shift, it has no error, though not all agrees exactly.
  const bool without_error = !(result.plateau_density.std_error > 0.0) && result.chi2 > 0.0;
  if (without_error || result.plateau_density.std_error > undetermined_plateau * result.plateau_density.value) {
    result.warnings.emplace_back("the plateau density is not determined: no part of the window lies on the plateau");
  }
  if (result.plateau_density.value >= setup.model->largest_plateau()) {
    result.warnings.emplace_back("the fitted plateau density reached close packing, the upper limit of its range");
  }
}

}  // namespace shakebed::fit
