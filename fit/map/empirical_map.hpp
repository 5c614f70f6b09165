#pragma once

#include <span>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

// The map of simulated beds: a table of T at points (Gamma, f, e, friction, ...), interpolated. It stands beside the
// maps of theory.
//
// A map owns its table; any number of threads may ask one.
namespace shakebed::fit {

struct MapPoint {
  std::vector<double> position;  // one number an axis
  double temperature = 0.0;      // any one unit for all
  double std_error = 0.0;        // 0: not known
};

struct MapAxis {
  std::string name;
  bool logarithmic = false;
};

// Interpolates by a local linear fit of ln T, weighted by distance in units of each axis' range and by the errors. The
// error of the interpolation is measured, not assumed: by predicting every point of the table from the others.
class EmpiricalMap {
 public:
  EmpiricalMap(std::vector<MapAxis> axes, std::vector<MapPoint> points);

  // bad_input: sizes differ, a number is not finite, T is not positive; too_few_bins: fewer points than axes + 2.
  [[nodiscard]] FitStatus status() const { return status_; }
  [[nodiscard]] const std::string& message() const { return message_; }
  // Root mean square of ln(predicted/given) over the points left out in turn: a relative error of T.
  [[nodiscard]] double interpolation_error() const { return interpolation_error_; }

  struct Prediction {
    FitStatus status = FitStatus::not_converged;
    Estimate temperature;  // the interpolation's error included
    bool inside = false;   // each coordinate within the table's range
  };
  [[nodiscard]] Prediction at(std::span<const double> position) const;

 private:
  [[nodiscard]] bool predict(std::span<const double> unit, std::size_t left_out, double& log_temperature,
                             double& error) const;
  [[nodiscard]] std::vector<double> to_unit(std::span<const double> position) const;

  std::vector<MapAxis> axes_;
  std::vector<MapPoint> points_;
  std::vector<std::vector<double>> unit_;
  std::vector<double> low_, high_;
  FitStatus status_ = FitStatus::ok;
  std::string message_;
  double interpolation_error_ = 0.0;
};

}  // namespace shakebed::fit
