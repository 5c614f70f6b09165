#pragma once

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "fit/fit_profile.hpp"

// Inferring what is not known of a bed (restitution, friction, Gamma) from how well its simulation agrees with a
// measurement: a search without derivatives for the least of an expensive and noisy objective over a box.
namespace shakebed::fit {

// One run of the objective.
struct CalibrationRun {
  std::vector<double> point;
  double value = 0.0;      // the misfit, in units of chi2 for the uncertainty to mean something
  double std_error = 0.0;  // of the value, 0 if not known
  double cost = 0.0;       // in whatever unit the objective counts: seconds, collisions
  bool failed = false;     // no value; the search goes on
};
using Objective = std::function<CalibrationRun(std::span<const double>)>;

struct CalibrationAxis {
  std::string name;
  double low = 0.0, high = 1.0;
  int grid = 5;  // points of the grid along it
};

struct CalibrationOptions {
  enum class Method { grid, simplex, grid_then_simplex };
  Method method = Method::grid_then_simplex;  // the simplex is that of [NelderMead1965]
  int max_runs = 200;
  double tolerance = 1e-3;  // size of the simplex at which it stops, in units of the box
};

struct CalibrationResult {
  FitStatus status = FitStatus::not_converged;  // ok: the search ended by itself, inside the budget
  std::string message;
  std::vector<double> best;          // of the quadratic where it is sound, else of the best run
  double value = 0.0;                // there
  std::vector<CalibrationRun> runs;  // all, in order
  std::size_t best_run = 0;
  double cost = 0.0;
  // From a quadratic fitted to the runs about the best, weighted by their errors: the points where the value is 1 above
  // its least. Sound only where the quadratic has a minimum inside the box; otherwise all errors are 0 and the message
  // says so.
  bool has_uncertainty = false;
  std::vector<double> std_error;
  std::vector<double> covariance;  // row-major
  std::vector<bool> at_edge;       // of the box: a better point may lie outside
  std::vector<std::string> warnings;
};

CalibrationResult calibrate(const Objective& objective, const std::vector<CalibrationAxis>& box,
                            const CalibrationOptions& options = {});

}  // namespace shakebed::fit
