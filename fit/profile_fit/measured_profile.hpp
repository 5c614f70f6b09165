#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

// A measured profile as the fit uses it: checked, sorted, with an error for every height. Internal to fit (compiles
// Eigen).
namespace shakebed::fit {

struct MeasuredProfile {
  std::vector<double> height, density, error;  // ascending heights; error > 0 where errors_known
  std::vector<bool> usable;                    // false: left out (an empty bin without an error)
  Eigen::MatrixXd covariance;                  // empty: diagonal
  int covariance_samples = 0;                  // independent samples of the covariance, 0 if unknown
  bool errors_known = false;
  bool robust = false;   // FitOptions::robust: the outlier of a bin must not change its neighbours
  double spacing = 0.0;  // median distance of neighbouring heights
  double area = 0.0;
  std::vector<double> one_diameter_mean;  // density averaged over one diameter about each height
  double greatest_mean = 0.0;             // of these, above the floor's layers; set by choose_window()
  [[nodiscard]] std::size_t size() const { return height.size(); }
};

// Fills `measured` from the user's profile. bad_input with a message in `result` where the profile is broken; what is
// odd but usable becomes a warning.
FitStatus measure_profile(const Profile& profile, MeasuredProfile& measured, FitResult& result);

// Sets the message of the result and returns bad_input.
FitStatus bad_input(FitResult& result, std::string message);

// A number in words: `digits` significant ones.
std::string number(double value, int digits = 3);

}  // namespace shakebed::fit
