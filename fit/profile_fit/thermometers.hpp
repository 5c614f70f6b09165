#pragma once

#include <array>
#include <span>
#include <string_view>

#include "fit/profile_fit/fit_profile.hpp"

// Ways to read a temperature off a density profile, and how far each is off on beds whose temperature is known. The
// table is data: docs/thermometer.md prints it, `ctest -L study -R ThermometerTable` measures it anew.
namespace shakebed::fit {

// A model on a window.
struct Thermometer {
  std::string_view name;   // of the reading: "whole column, N known"
  std::string_view model;  // FitOptions::model
  bool column_known;       // N D/W held at the given value
  double floor_exclusion;  // WindowOptions [D]
  double below_density;    // WindowOptions [1/D^2]; 0: the rule
  bool votes;              // counts for the answer; false: shown beside it
};

// Where it is off on equilibrium beds, relative to the true T: on average, and from bed to bed beyond the stated error.
struct KnownBias {
  double mean = 0.0;
  double scatter = 0.0;
};

// In the order of preference where two are equally good.
std::span<const Thermometer> thermometers();

// The known bias of a thermometer at a temperature [m g D]. Between the measured temperatures it is interpolated in ln
// T; above them it is constant. Below them the scatter grows as 1/T, because the surface is then thinner than one layer
// of disks.
KnownBias known_bias(const Thermometer& thermometer, double temperature);

// The greatest error of the model (FitResult::model_error) of a whole column on these beds at a temperature [1/D^2].
double known_misfit(double temperature);

// A row of the table, for those who print it or measure it anew.
inline constexpr std::size_t thermometer_count = 7;
struct KnownBiases {
  double temperature;  // [m g D]
  double misfit;       // [1/D^2]
  std::array<KnownBias, thermometer_count> of;
};
std::span<const KnownBiases> known_biases();

}  // namespace shakebed::fit
