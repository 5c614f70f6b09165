#pragma once

#include <memory>

#include "fit/profile_fit/fit_model.hpp"
#include "fit/profile_fit/least_squares.hpp"
#include "fit/profile_fit/measured_profile.hpp"

// The options of a fit turned into a curve and its free parameters. Internal to fit.
namespace shakebed::fit {

struct FitSetup {
  std::unique_ptr<FitModel> model;
  FitModel::Parameters start{};  // fixed values and first guesses
  LeastSquaresOptions least_squares;
  int parameters = 0;        // how many are free
  bool model_error = false;  // a misfit becomes an error of the model [FitOptions::model_error]
  double least_model_error = 0.0;
};

// What can be said of the options before there are data. bad_input or undefined_model, with a message in `result`.
FitStatus check_options(const FitOptions& options, FitResult& result);

// bad_input or undefined_model, with a message in `result`, where the options describe no curve.
FitStatus make_setup(const FitOptions& options, const MeasuredProfile& measured, FitSetup& setup, FitResult& result);

}  // namespace shakebed::fit
