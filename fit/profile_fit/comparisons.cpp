#include "fit/profile_fit/comparisons.hpp"

#include "fit/profile_fit/parameter_errors.hpp"

namespace shakebed::fit {

namespace {

// The sweep: lower ends in so many steps up to where this part of the greatest density is left; upper ends where these
// parts are.
constexpr int sweep_steps = 10;
constexpr double surface_fraction = 0.25;
constexpr double upper_fractions[] = {0.02, 0.05, 0.1, 0.2};

// The highest height of the window at which at least this part of the greatest density is left; `otherwise` if none.
double highest_with(double fraction, const MeasuredProfile& measured, const Window& window, double otherwise) {
  double found = otherwise;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (measured.height[i] >= window.low && measured.height[i] <= window.high &&
        measured.one_diameter_mean[i] >= fraction * measured.greatest_mean) {
      found = measured.height[i];
    }
  }
  return found;
}

std::vector<Window> windows_beside(const MeasuredProfile& measured, const Window& window) {
  std::vector<Window> windows;
  const double surface = highest_with(surface_fraction, measured, window, window.high);
  for (int i = 0; i <= sweep_steps; ++i)
    windows.push_back({window.low + (surface - window.low) * i / sweep_steps, window.high, {}});
  for (const double fraction : upper_fractions) {
    const double high = highest_with(fraction, measured, window, window.low);
    if (high < window.high) windows.push_back({window.low, high, {}});
  }
  return windows;
}

Estimate shift_of(FitSetup& setup, const FittedWindow& fitted) {
  const double shift = setup.model->shift();
  return {shift, propagated_error(setup, fitted, [&](const FitModel::Parameters&) { return setup.model->shift(); }),
          !setup.least_squares.free[FitModel::place]};
}

void fit_row(const MeasuredProfile& measured, const Window& window, FitSetup& setup, Bins bins,
             const FitModel::Parameters& start, WindowFit& row) {
  const FittedWindow fitted = fit_window(measured, window, setup, std::move(bins), {start});
  const Solution& fit = fitted.solution;
  if (!fit.has_curve) return;
  row.status = fit.converged ? FitStatus::ok : FitStatus::not_converged;
  row.temperature.value = fit.parameters[FitModel::temperature];
  row.temperature.std_error = parameter_error(setup, fitted, FitModel::temperature);
  if (!temperature_is_resolved(fit, row.temperature.std_error)) row.status = FitStatus::unresolved_temperature;
  row.shift = shift_of(setup, fitted);
  row.chi2_per_dof = fitted.good.chi2_per_dof;
}

std::vector<FitOptions> models_beside(const FitOptions& options) {
  std::vector<FitOptions> others;
  const auto add = [&](const std::string& model, bool plateau_free) {
    FitOptions other = options;
    other.model = model;
    other.plateau_density_free = plateau_free;
    other.constrain_column = false;
    if (model != "enskog-rectangle") other.fixed_shift.reset();
    if (model == "fermi" || model == "rectangle") other.fixed_temperature.reset();
    const bool same = other.model == options.model && other.plateau_density_free == options.plateau_density_free &&
                      other.constrain_column == options.constrain_column;
    if (!same) others.push_back(std::move(other));
  };
  add("enskog-rectangle", false);
  add("enskog-rectangle", true);
  add("hydrostatic:enskog", false);
  add("hydrostatic:best-of", false);
  add("fermi", false);
  add("fermi", true);
  add("rectangle", true);
  return others;
}

}  // namespace

std::vector<WindowFit> sweep_windows(const MeasuredProfile& measured, const Window& window, FitSetup& setup,
                                     const FitModel::Parameters& start) {
  std::vector<WindowFit> rows;
  for (const Window& other : windows_beside(measured, window)) {
    Bins bins = bins_of(measured, other, nullptr);
    WindowFit row;
    row.bins = static_cast<int>(bins.size());
    row.low = bins.height.empty() ? other.low : bins.height.front();
    row.high = bins.height.empty() ? other.high : bins.height.back();
    if (!rows.empty() && row.low == rows.back().low && row.high == rows.back().high) continue;
    row.temperature.fixed = !setup.least_squares.free[FitModel::temperature];
    row.shift.fixed = !setup.least_squares.free[FitModel::place];
    if (row.bins < setup.parameters + 2) {
      row.status = FitStatus::too_few_bins;
    } else {
      fit_row(measured, other, setup, std::move(bins), start, row);
    }
    rows.push_back(row);
  }
  setup.model->set(start);
  return rows;
}

ModelFit model_row(const FitOptions& options, FitSetup& setup, const FittedWindow& fitted) {
  const Solution& solution = fitted.solution;
  const std::array<bool, 3>& free = setup.least_squares.free;
  ModelFit row;
  row.model = options.model;
  row.plateau_density_free = free[FitModel::plateau];
  row.parameters = setup.parameters;
  if (!solution.has_curve) {
    row.status = FitStatus::undefined_model;
    return row;
  }
  row.status = solution.converged ? FitStatus::ok : FitStatus::not_converged;
  row.temperature = {setup.model->uses_temperature() ? solution.parameters[FitModel::temperature] : 0.0,
                     parameter_error(setup, fitted, FitModel::temperature), !free[FitModel::temperature]};
  if (free[FitModel::temperature] && !temperature_is_resolved(solution, row.temperature.std_error)) {
    row.status = FitStatus::unresolved_temperature;
  }
  row.shift = shift_of(setup, fitted);
  row.plateau_density = {solution.parameters[FitModel::plateau], parameter_error(setup, fitted, FitModel::plateau),
                         !free[FitModel::plateau]};
  row.chi2 = solution.chi2;
  row.chi2_per_dof = fitted.good.chi2_per_dof;
  row.aic = fitted.good.aic;
  row.bic = fitted.good.bic;
  return row;
}

std::vector<ModelFit> compare_models(const MeasuredProfile& measured, const Window& window, const Bins& bins,
                                     const FitOptions& options) {
  std::vector<ModelFit> rows;
  for (const FitOptions& other : models_beside(options)) {
    FitResult ignored;
    FitSetup setup;
    ModelFit row;
    row.model = other.model;
    row.plateau_density_free = other.plateau_density_free;
    row.status = make_setup(other, measured, setup, ignored);
    if (row.status == FitStatus::ok && static_cast<int>(bins.size()) < setup.parameters + 1) {
      row.status = FitStatus::too_few_bins;
    } else if (row.status == FitStatus::ok) {
      row = model_row(other, setup, fit_window(measured, window, setup, bins, find_starts(bins, setup)));
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace shakebed::fit
