#include "tests/bench/program/choice.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "fit/profile_fit/chances.hpp"

namespace shakebed::pipelines::bench {

double upper_bound_of_rms(double squares, int count, double level) {
  if (count < 1 || !(squares >= 0)) return std::numeric_limits<double>::quiet_NaN();
  // The chi-square that is undercut with probability `level`, by halving: the chance of more falls from 1 to 0.
  double low = 0, high = count;
  while (1 - fit::chance_of_chi2(high, count) < level) high *= 2;
  for (int step = 0; step < 100; ++step) {
    const double middle = (low + high) / 2;
    (1 - fit::chance_of_chi2(middle, count) < level ? low : high) = middle;
  }
  return std::sqrt(squares / low);
}

Choice choose_setting(const std::vector<Measured>& known, double goal,
                      const std::function<Measured(std::size_t setting)>& measure_again, const ChoiceRules& rules) {
  const auto bound_of = [](const Measured& one, double level) {
    return one.failed > 0 ? std::numeric_limits<double>::quiet_NaN()
                          : upper_bound_of_rms(one.squares, one.count, level);
  };
  std::vector<std::size_t> order(known.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return known[a].cost < known[b].cost; });
  Choice choice;
  double spent = 0;
  for (const std::size_t setting : order) {
    if (!(bound_of(known[setting], rules.screen) <= goal)) continue;
    const int tries = static_cast<int>(choice.tried.size()) + 1;
    if (tries > rules.most_tries || spent >= rules.budget) {
      choice.out_of_budget = true;
      break;
    }
    Confirmation one;
    one.setting = setting;
    one.again = measure_again(setting);
    spent += one.again.cost * (one.again.count + one.again.failed);
    one.level = rules.chance / (tries * (tries + 1.0));
    one.bound = bound_of(one.again, one.level);
    one.holds = one.bound <= goal;
    choice.tried.push_back(one);
    if (!one.holds) continue;
    choice.setting = setting;
    break;
  }
  return choice;
}

}  // namespace shakebed::pipelines::bench
