#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"

// One answer from one profile: the temperature, its whole uncertainty, and a verdict whether there is one at all.
//
// Every thermometer of thermometers.hpp reads the profile; known biases are taken off; the one that scatters least from
// bed to bed at this temperature gives T; the others check it. On beds whose temperature is known, 95 % intervals hold
// it in 92 to 98 % (docs/thermometer.md).
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

// What speaks against reading any temperature: why, and what to do; a sentence or more each.
struct Objection {
  std::string why, advice;
};

struct AnswerInput {
  Profile profile{};
  Kernel kernel{};  // what it was measured through
  // The lower edge of the bed [D]: that of a hexagonal bed on a flat floor at 0.
  double base = 0.5 - 0.43301270189221932;
  std::optional<double> column_number{};                     // N D/W, where all disks are seen
  std::optional<Estimate> temperature_x{}, temperature_z{};  // kinetic, where velocities are known [m g D]
  // One standard error of T, relative, that the simulation's contact duration leaves; 0 where nothing is simulated.
  double contact_duration_effect = 0.0;
  // Whether the floor moves: T_x and T_z then differ, which only velocities show.
  bool shaken = false;
  // Width of the bed between hard walls [D]; 0: without walls, or with walls out of view.
  double width_between_walls = 0.0;
  // One standard error of the floor's mean position, from which heights are measured [D].
  double origin_error = 0.0;
  // One standard error of the length of D in the picture, relative. The errors of the densities contain it, and it is
  // taken off there. T is fitted again with a smaller and a larger scale. The change is a part of the statistical
  // error.
  double scale_error = 0.0;
  // [m]; with it the reasons state T/(m g) in mm, else T in m g D.
  std::optional<double> diameter{};
  double confidence = 0.95;
  // Doubts of the measurement about the profile, besides those that the profile itself shows (objections.hpp).
  std::vector<Objection> objections{};
};

enum class Verdict { one_temperature, model_does_not_fit, no_single_temperature };
std::string_view to_string(Verdict verdict);  // "one temperature", ...

// Temperature that one thermometer (a model and a window) gives.
struct ThermometerReading {
  std::string thermometer;  // "whole column, N known"
  std::string model;        // FitOptions::model
  FitStatus status = FitStatus::not_converged;
  Estimate fitted;                 // as fitted [m g D]
  double statistical_error = 0.0;  // of it, by the measured errors alone [m g D]
  double bias = 0.0;               // known, relative; taken off in `temperature`
  double bias_uncertainty = 0.0;   // relative: from bed to bed
  double temperature = 0.0;        // fitted/(1 + bias) [m g D]
  double std_error = 0.0;          // of it: statistical and of the bias [m g D]
  double chi2_per_dof = 0.0, model_error = 0.0;
  double window_low = 0.0, window_high = 0.0;  // [D]
  bool admissible = false;                     // converged, and its bias is known well enough to check the answer
};

struct Answer {
  FitStatus status = FitStatus::not_converged;  // ok: there is an answer; else `why` says what is wrong
  Verdict verdict = Verdict::no_single_temperature;
  std::string why, advice;  // a sentence each

  std::string thermometer, model;             // that gave T
  double temperature = 0.0;                   // [m g D]; with no_single_temperature the middle of the range
  double statistical_error = 0.0;             // one standard error each [m g D]: by the measured errors alone,
  double misfit_error = 0.0;                  // of what the model misses of the profile,
  double bias_uncertainty = 0.0;              // of the thermometer's known bias, which has been taken off
  double spread = 0.0;                        // of the admissible thermometers beyond what these two explain
  double contact_duration_uncertainty = 0.0;  // of the simulation that gave the profile
  double wall_uncertainty = 0.0;              // of hard side walls, near which the bed is thinner
  double std_error = 0.0;                     // all of these in quadrature
  double bias = 0.0;                          // what has been taken off, relative
  // Of T; with no_single_temperature the range of all readings and kinetic T, whose confidence is 0: it is no
  // confidence interval.
  Interval interval;
  // Of the T that this thermometer reads, by the statistical error alone: where further beds lie, on average. The other
  // parts are the same for all of them.
  Interval next_bed_interval;
  Estimate solid_height;                                 // of the Enskog tail at this T [D]
  std::optional<Estimate> temperature_x, temperature_z;  // kinetic, as given
  std::vector<ThermometerReading> readings;              // of all thermometers
  [[nodiscard]] bool ok() const { return status == FitStatus::ok; }
};

// Some ten fits: a few hundredths of a second. The same input gives the same bytes.
Answer find_answer(const AnswerInput& input);

}  // namespace shakebed::fit
