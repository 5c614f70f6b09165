// --budget: chooses how long each bed is measured, how many beds, and how fine the model. The main number of a stage
// then has the error asked for, or the run takes the time asked for.
//
// A pilot, a short run with another seed, shows the error and the cost of a stage (stages/effort.hpp). The
// statistical variance of the mean of n beds, each measured for a length t, is taken to be (b^2 + w^2 l/t)/n. Here w is
// the error that one bed of the pilot has after its length l, and b the scatter between beds that does not pass with
// time. Cost is linear in time. What was chosen becomes part of the recipe, as changes of --set do.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/console.hpp"
#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/stages/effort.hpp"

namespace shakebed::pipelines {

// One of the two is above 0.
struct Budget {
  double error = 0;    // relative standard error of the main number
  double seconds = 0;  // of wall time on this machine
  std::string text;    // as written
};
// "1 %", "30 s", "5 min". Throws UsageError.
Budget parse_budget(const std::string& text);

// What was chosen, and what is expected of it.
struct EffortChoice {
  Effort effort;
  double error = 0;         // relative: root mean square, with the systematic part
  double stated_error = 0;  // relative: that the result will state on average, without the systematic part
  double systematic = 0;
  Work work;
  double wall_seconds = 0;
  // false: no effort gives what is asked for. `effort` then has the error asked for without the systematic part, or is
  // the nearest to it.
  bool possible = true;
};
// The cheapest effort with the error asked for, or the effort with the smallest error in the time. The error that the
// result will state (with Student's factor for few beds) is the one that is kept to. It also allows for the pilot's own
// uncertainty. `jobs`: threads, which only matter for times.
EffortChoice choose_effort(const EffortReading& pilot, const EffortLimits& limits, const Budget& budget, int jobs);
// A better pilot, where this one is too short for the choice or its model too coarse; nothing where it will do.
std::optional<Effort> next_pilot(const EffortReading& pilot, const EffortLimits& limits, const EffortChoice& choice,
                                 const Budget& budget);
// What a finer model is worth. `cheap`: the systematic part falls by more than the number of events grows. `dear`: it
// does not, but without the finer model the error asked for may be missed; no finer one is then tried. `useless`:
// neither. An example is a contact duration of a tenth. In a bed that chatters (e = 0.6, friction 0.8, 11 layers) it
// took 3.0 times the events, and its estimated effect on T fell 1.9 times. In three others (e = 0.8 to 0.95) it was 1.2
// times, and 6 to 11 times.
enum class Refinement { cheap, dear, useless };
Refinement judged(const EffortReading& coarse, const EffortReading& fine, const Budget& budget);

// A plan with what was chosen in it, and the record of it for the manifest.
struct BudgetedPlan {
  Plan plan;
  Json record;
};
// Runs the pilots, below OUT/.pilot, and says on the console what is chosen and expected. What is there from an earlier
// call is not run again. Throws ConfigError where nothing in the recipe can be measured for longer or shorter,
// StageError where a pilot fails or the time is too short, Interrupted.
BudgetedPlan choose_by_budget(const Plan& plan, const Budget& budget, const RunOptions& options, Console& console);

// Says what the finished run has reached, a line a stage, beside what was expected; warns where the error is larger
// than asked by more than chance.
void say_reached(const Plan& plan, const Json& record, const RunOutcome& outcome, Console& console);
// Whether a stated error of so many beds is above the one asked for by more than it scatters (1 % significance).
bool misses(double stated, double asked, std::uint32_t beds);

}  // namespace shakebed::pipelines
