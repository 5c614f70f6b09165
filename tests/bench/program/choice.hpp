// Which of many measured settings keeps an accuracy. The one that measured best is the luckiest as much as the best, so
// a choice is measured again, with beds that nobody has seen, and counts only if these show it.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

namespace shakebed::pipelines::bench {

// Largest rms of the errors whose sample of `count` would have a sum of squares as small as `squares` with probability
// `level`: an upper bound that holds with confidence 1 - level for normal errors about any mean [sum of squares over
// mean square: chi-square with `count` degrees of freedom; with a mean other than 0 it scatters less, and the bound is
// the safer]. Not a number for count < 1, or where one of the errors is missing.
double upper_bound_of_rms(double squares, int count, double level);

// What was measured of one setting.
struct Measured {
  double cost = 0;     // CPU s of one bed
  double squares = 0;  // sum of the squared relative errors
  int count = 0;       // beds that gave a number
  int failed = 0;      // beds that gave none: they forbid the setting
};

struct Confirmation {
  std::size_t setting = 0;
  Measured again;
  double level = 0;  // of the bound
  double bound = 0;
  bool holds = false;
};
struct Choice {
  std::optional<std::size_t> setting;
  std::vector<Confirmation> tried;  // in order of cost; the last one is the choice, if any holds
  bool out_of_budget = false;       // settings were left that had done well
};

struct ChoiceRules {
  double screen = 0.1;   // a setting is tried if the bound of this level, by what is known, keeps the goal
  double chance = 0.05;  // that a setting is named that does not keep the goal, all tries together
  int most_tries = 6;
  double budget = std::numeric_limits<double>::infinity();  // CPU s: once they are spent, nothing more is tried
};

// The cheapest setting whose rms keeps `goal`. `measure_again(setting)` measures it with fresh beds. The k-th try must
// keep the goal by a bound of level chance / (k (k + 1)); these add up to less than `chance`.
Choice choose_setting(const std::vector<Measured>& known, double goal,
                      const std::function<Measured(std::size_t setting)>& measure_again, const ChoiceRules& rules = {});

}  // namespace shakebed::pipelines::bench
