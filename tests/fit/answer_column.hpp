// A bed whose answer is asked for, without layers.
#pragma once

#include <cstddef>
#include <cstdint>

#include "fit/profile_fit/answer.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {

inline const Kernel usual_kernel{KernelKind::gaussian, 0.5};

// A column of the accurate equation of state, of 20 D, with noise: what a bed would be without layers.
inline AnswerInput column(double temperature, double noise = 0.003, std::uint64_t seed = 5) {
  const auto truth = HydrostaticProfile::of_column(best_of(), temperature, {20.0, close_packing_density});
  AnswerInput input;
  input.kernel = usual_kernel;
  input.base = 0.0;
  const int bins = static_cast<int>(4.0 * synthetic::top_of(truth));
  input.profile = synthetic::profile_of(truth, usual_kernel, bins, synthetic::top_of(truth), noise, seed);
  return input;
}

// A column with a wave in the middle of its height: every reading may agree, and yet no curve of the model has it.
inline AnswerInput column_with_a_wave() {
  AnswerInput input = column(2.0);
  for (std::size_t i = 0; i < input.profile.height.size(); ++i) {
    const double z = input.profile.height[i];
    if (z > 8.0 && z < 30.0) input.profile.number_density[i] += 0.06 * std::sin(1.5 * z);
  }
  return input;
}

// A column at every `step`-th height, whose answer takes so much less time.
inline AnswerInput every(std::size_t step, AnswerInput input) {
  Profile fewer;
  for (std::size_t i = 0; i < input.profile.height.size(); i += step) {
    fewer.height.push_back(input.profile.height[i]);
    fewer.number_density.push_back(input.profile.number_density[i]);
    fewer.std_error.push_back(input.profile.std_error[i]);
  }
  input.profile = fewer;
  return input;
}

}  // namespace shakebed::fit
