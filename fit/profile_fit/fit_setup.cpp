#include "fit/profile_fit/fit_setup.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::fit {

namespace {

// A tail of 100 T much shorter than a bin is a step: T below this part of a bin is not resolved.
constexpr double lowest_temperature_in_bins = 1e-5;
// However the user rounded 2/sqrt 3.
constexpr double rounding = 1e-12;

bool positive(double value) { return std::isfinite(value) && value > 0.0; }

FitStatus check_numbers(const FitOptions& options, const FitModel& model, FitResult& result) {
  if (!positive(options.plateau_density))
    return bad_input(result,
                     "the plateau density phi_0 is " + number(options.plateau_density) + "; it must be above 0");
  if (options.column_number && !positive(*options.column_number)) {
    return bad_input(result, "the column number N D/W is " + number(*options.column_number) + "; it must be above 0");
  }
  if (options.fixed_temperature && !positive(*options.fixed_temperature)) {
    return bad_input(result, "the fixed temperature is " + number(*options.fixed_temperature) + "; it must be above 0");
  }
  if (options.fixed_shift && !std::isfinite(*options.fixed_shift)) {
    return bad_input(result, "the fixed shift is not a finite number; give a finite number or leave it out");
  }
  if (options.fixed_shift && model.place_is_column()) {
    return bad_input(result,
                     "in this model the shift follows from N D/W and cannot be fixed: give the column number instead");
  }
  if (!kernel_is_valid(options.kernel))
    return bad_input(result, "the width of the kernel must be a finite number, 0 or more");
  if (!std::isfinite(options.base))
    return bad_input(result,
                     "the base (height of the lower edge of the bed, in D) is not a finite number; give a finite "
                     "number or leave it out");
  if (!(options.confidence > 0.0 && options.confidence < 1.0)) {
    return bad_input(result, "the confidence is " + number(options.confidence) + "; it must lie between 0 and 1");
  }
  return FitStatus::ok;
}

bool is_whole_column(const FitOptions& options) { return options.model.starts_with("hydrostatic:"); }

FitStatus check_plateau(const FitOptions& options, FitResult& result) {
  if (options.plateau_density > close_packing_density * (1.0 + rounding)) {
    result.message = "the plateau density " + number(options.plateau_density, 5) +
                     " is above close packing, 2/sqrt 3 = 1.1547, which hard disks cannot exceed";
    return FitStatus::undefined_model;
  }
  return FitStatus::ok;
}

std::array<bool, 3> free_parameters(const FitOptions& options, const FitModel& model) {
  std::array<bool, 3> free{model.uses_temperature() && !options.fixed_temperature, true, options.plateau_density_free};
  if (model.place_is_column()) {
    free[FitModel::place] = !options.column_number.has_value();
    // Only a column with a rectangle knows its density.
    if (is_whole_column(options) && model.equation().has_pole()) free[FitModel::plateau] = false;
  } else if (options.fixed_shift) {
    free[FitModel::place] = false;
  }
  return free;
}

FitModel::Parameters first_guess(const FitOptions& options, const FitModel& model) {
  FitModel::Parameters start{options.fixed_temperature.value_or(1.0), 0.0,
                             std::min(options.plateau_density, close_packing_density)};
  if (model.place_is_column() && options.column_number) start[FitModel::place] = *options.column_number;
  if (options.fixed_shift) start[FitModel::place] = *options.fixed_shift;
  if (options.model == "rectangle") start[FitModel::temperature] = 1.0;
  return start;
}

}  // namespace

namespace {

// Sets the model and checks the options against it.
FitStatus make_model(const FitOptions& options, double resolution, std::unique_ptr<FitModel>& model,
                     FitResult& result) {
  if (options.constrain_column && !options.column_number) {
    return bad_input(result, "constrain_column needs the column number N D/W, which is unknown: give it too");
  }
  model = make_fit_model(options.model, options.base, options.constrain_column, resolution);
  if (!model) return bad_input(result, "there is no model named '" + options.model + "'");
  const FitStatus status = check_numbers(options, *model, result);
  return status == FitStatus::ok ? check_plateau(options, result) : status;
}

}  // namespace

FitStatus check_options(const FitOptions& options, FitResult& result) {
  std::unique_ptr<FitModel> model;
  return make_model(options, 1.0, model, result);
}

FitStatus make_setup(const FitOptions& options, const MeasuredProfile& measured, FitSetup& setup, FitResult& result) {
  const double resolution = measured.spacing > 0.0 ? measured.spacing : 1.0;
  const FitStatus status = make_model(options, resolution, setup.model, result);
  if (status != FitStatus::ok) return status;
  const FitModel& model = *setup.model;

  LeastSquaresOptions& least_squares = setup.least_squares;
  least_squares.free = free_parameters(options, model);
  least_squares.kernel = KernelRule(options.kernel);
  least_squares.robust = options.robust;
  least_squares.robust_threshold = options.robust_threshold;
  least_squares.errors_known = measured.errors_known;
  least_squares.max_iterations = options.max_iterations;
  least_squares.lowest_temperature = lowest_temperature_in_bins * resolution;
  setup.start = first_guess(options, model);
  setup.parameters = static_cast<int>(std::count(least_squares.free.begin(), least_squares.free.end(), true));
  setup.model_error = options.model_error;
  setup.least_model_error = options.least_model_error;
  return FitStatus::ok;
}

}  // namespace shakebed::fit
