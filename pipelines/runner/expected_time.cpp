#include "pipelines/runner/expected_time.hpp"

#include <exception>

namespace shakebed::pipelines {

std::vector<double> trial_seconds(const Plan& plan) {
  std::vector<double> seconds;
  for (const PlannedStage& stage : plan.stages) {
    seconds.push_back(0);
    try {
      seconds.back() = stage.stage->trial_seconds();
    } catch (const std::exception&) {}  // the run itself will say what is wrong
  }
  return seconds;
}

double fraction_of_plan(const Plan& plan, const std::vector<double>& seconds, std::size_t stage, double fraction) {
  const auto sum_of = [&](const auto& weight) {
    double before = 0, all = 0;
    for (std::size_t i = 0; i < plan.stages.size(); ++i) {
      const double one = weight(i);
      all += one;
      before += i < stage ? one : i == stage ? fraction * one : 0;
    }
    return all > 0 ? before / all : -1;
  };
  double share = seconds.empty() ? -1 : sum_of([&](std::size_t i) { return seconds[i]; });
  if (share < 0) share = sum_of([&](std::size_t i) { return plan.stages[i].row->uses_seed ? 1.0 : 0.0; });
  if (share < 0) share = sum_of([](std::size_t) { return 1.0; });
  return share;
}

}  // namespace shakebed::pipelines
