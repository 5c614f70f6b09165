#pragma once

#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

// The simulation as the model: a measured profile matched against simulated ones at known temperatures. Below T_c no
// equation of state describes a layered surface; simulated beds do, so this is the thermometer without a model's bias
// there.
namespace shakebed::fit {

// One simulated bed at a known temperature. Runs at the same temperature (to 1e-6 relative) are repeats. Their spread
// is the spread of preparation, and is part of the error of the model.
struct SimulatedProfile {
  double temperature = 0.0;   // [m g D]
  Profile profile;            // through the same kernel, above the same floor as the measurement
  double solid_height = 0.0;  // of that bed, where known [D]
};

struct MatchOptions {
  double low = 1.5;  // window [D]
  double high = 1e300;
  double confidence = 0.95;
  // Points in ln T of the interpolation between library temperatures (2 linear, 3, 4 cubic; fewer in a small library).
  int order = 4;
};

struct MatchResult {
  FitStatus status = FitStatus::not_converged;
  std::string message;
  Estimate temperature;   // [m g D]
  Interval interval;      // from the likelihood
  Estimate solid_height;  // interpolated in the library, with the error of the temperature [D]
  double chi2 = 0.0;
  int bins = 0, dof = 0;
  double chi2_per_dof = 0.0;
  // Of the temperature: how far it moves when the interpolation drops to one order less.
  double interpolation_error = 0.0;
  // The matched density at the bins of the window, and its error from the library (noise, spread, interpolation).
  std::vector<double> height, density, library_error;
  std::vector<std::string> warnings;
};

// Needs at least two temperatures. Heights outside a library profile count as empty. The best temperature must lie
// inside the library: at its ends the status is unresolved_temperature and the interval is open there.
MatchResult match_simulated(const Profile& measured, const std::vector<SimulatedProfile>& library,
                            const MatchOptions& options = {});

// Every run of the library in turn taken for a measurement and matched against the others: the thermometer's own bias
// and error, at known temperatures. Runs at the two ends of the library that have no repeat cannot be tested and are
// left out.
struct LibraryTest {
  double temperature = 0.0;  // the truth
  FitStatus status = FitStatus::not_converged;
  Estimate matched;
};
std::vector<LibraryTest> test_library(const std::vector<SimulatedProfile>& library, const MatchOptions& options = {});

// The error a match really has near a temperature, relative: the root mean square of ln(matched/true) over tests within
// a factor 1.5 of it; outside_range with fewer than three. Where beds differ by preparation the likelihood's own error
// is too small (a shifted crystal is no linear mixture of the repeats): quote the larger of the two.
Value library_scatter(const std::vector<LibraryTest>& tests, double temperature);

}  // namespace shakebed::fit
