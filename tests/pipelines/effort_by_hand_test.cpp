// What --budget chooses from a pilot, by its formulas written once more and all numbers of beds tried one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "fit/profile_fit/chances.hpp"
#include "pipelines/runner/budget.hpp"
#include "pipelines/stages/effort.hpp"

namespace shakebed::tests {
namespace {

using namespace pipelines;

// 0 to 1, another for each pair of numbers.
double some_number(int k, int which) {
  const double value = 0.6180339887 * k + 0.7548776662 * which + 0.11 * ((k * 7 + which * 13) % 5);
  return value - std::floor(value);
}

struct PilotCase {
  EffortReading pilot;
  EffortLimits limits;
  int jobs = 1;
};
PilotCase pilot_case(int k) {
  auto some = [&, which = 0]() mutable { return some_number(k, which++); };
  PilotCase one;
  EffortReading& pilot = one.pilot;
  pilot.effort = {1 + 40 * some(), k % 7 == 0 ? 1U : 2 + static_cast<std::uint32_t>(16 * some()), k % 3};
  pilot.within = 0.01 + 0.05 * some();
  pilot.spread = pilot.within * (k % 2 == 0 ? 0.4 + some() : 1.2 + 2 * some());
  pilot.systematic = k % 4 == 0 ? 0.02 * some() : 0;
  pilot.settling = k % 5 == 0 ? 0 : 30 * some();
  const double beds = pilot.effort.beds;
  pilot.measuring_work = {beds * pilot.effort.length * (0.01 + 0.1 * some()),
                          beds * pilot.effort.length * 1e4 * (1 + some())};
  if (pilot.settling > 0)
    pilot.settling_work = {beds * pilot.settling * (0.01 + 0.1 * some()), beds * pilot.settling * 1e4 * (1 + some())};
  EffortLimits& limits = one.limits;
  limits.settling = pilot.settling + 50 * some(), limits.shortest = 0.5 + 3 * some();
  limits.fewest_beds = 1 + static_cast<std::uint32_t>(6 * some());
  limits.even_beds = k % 3 == 1, limits.most_refinement = 2, limits.telling = 20 + 100 * some();
  one.jobs = 1 + k % 4;
  return one;
}

double square_of(double value) { return value * value; }

// Beds that differ, at a significance of 0.3, do so for ever; else all of the scatter passes, and both errors of the
// pilot together say how large it is: with one degree of freedom of each bed, and one less of what is between them.
struct VarianceByHand {
  double frozen = 0, passing = 0, freedom = 0;
  explicit VarianceByHand(const EffortReading& pilot) {
    const double beds = pilot.effort.beds, within = square_of(pilot.within), spread = square_of(pilot.spread);
    passing = within * pilot.effort.length, freedom = beds;
    if (pilot.effort.beds < 2) return;
    if (fit::chance_of_chi2((beds - 1) * spread / within, static_cast<int>(pilot.effort.beds) - 1) < 0.3) {
      frozen = spread - within, freedom = beds - 1;
    } else {
      freedom = 2 * beds - 1;
      passing = std::max(within, ((beds - 1) * spread + beds * within) / freedom) * pilot.effort.length;
    }
  }
};

// Student's factor at 95 % against that of a normal law.
double student_factor(std::uint32_t beds) {
  return beds < 2 ? 1 : fit::student_quantile(0.975, static_cast<int>(beds) - 1) / fit::normal_quantile(0.975);
}
double allowance_by_hand(std::uint32_t beds, double freedom) {
  return std::max(square_of(student_factor(beds)), freedom > 3 ? freedom / (freedom - 2) : 3);
}
double three_digits(double value, bool up) {
  const double step = std::pow(10, std::floor(std::log10(value)) - 2);
  return step * (up ? std::ceil(value / step - 1e-9) : std::floor(value / step));
}

struct BedWork {
  double settling_cpu = 0, settling_events = 0, cpu = 0, events = 0;  // of one bed; the last two a unit of length
  explicit BedWork(const PilotCase& one) {
    const EffortReading& pilot = one.pilot;
    const double beds = pilot.effort.beds, measured = beds * pilot.effort.length;
    cpu = pilot.measuring_work.cpu_seconds / measured, events = pilot.measuring_work.events / measured;
    const double more = (one.limits.settling - pilot.settling) * events;
    const Work& priced = pilot.settling > 0 ? pilot.settling_work : pilot.measuring_work;
    settling_events = pilot.settling_work.events / beds + more;
    settling_cpu = pilot.settling_work.cpu_seconds / beds + more * priced.cpu_seconds / priced.events;
  }
};

void expect_stated(const PilotCase& one, const EffortChoice& choice) {
  const VarianceByHand variance(one.pilot);
  const BedWork work(one);
  const double beds = choice.effort.beds, length = choice.effort.length;
  const double squares = (variance.frozen + variance.passing / length) / beds;
  EXPECT_NEAR(choice.error, std::sqrt(squares + square_of(one.pilot.systematic)), 1e-9);
  EXPECT_NEAR(choice.stated_error, student_factor(choice.effort.beds) * std::sqrt(squares), 1e-9);
  EXPECT_EQ(choice.systematic, one.pilot.systematic);
  EXPECT_EQ(choice.effort.refinement, one.pilot.effort.refinement);
  const double cpu = work.settling_cpu + length * work.cpu;
  EXPECT_NEAR(choice.work.cpu_seconds, beds * cpu, 1e-9 * beds * cpu);
  EXPECT_NEAR(choice.work.events, beds * (work.settling_events + length * work.events), 1e-9 * choice.work.events);
  EXPECT_NEAR(choice.wall_seconds, std::ceil(beds / one.jobs) * cpu, 1e-9 * choice.wall_seconds);
}

double shortest_by_hand(const PilotCase& one) {
  return VarianceByHand(one.pilot).frozen > 0 ? std::max(one.limits.shortest, one.pilot.effort.length)
                                              : one.limits.shortest;
}

TEST(EffortByHand, IsTheCheapestThatReachesNineTenthsOfAnError) {
  int possible = 0, all = 0;
  for (int k = 0; k < 60; ++k) {
    const PilotCase one = pilot_case(k);
    const VarianceByHand variance(one.pilot);
    for (const double error : {0.3, 0.04, 0.011}) {
      const EffortChoice choice = choose_effort(one.pilot, one.limits, {.error = error, .text = ""}, one.jobs);
      // The systematic part leaves less for statistics, but a quarter of the squares at least. Where it is too large
      // alone, it counts for nothing.
      const double wanted =
          one.pilot.systematic >= error
              ? square_of(0.9 * error)
              : std::max(square_of(0.9 * error) - square_of(one.pilot.systematic), square_of(0.9 * error) / 4);
      const double shortest = shortest_by_hand(one);
      double least = std::numeric_limits<double>::infinity(), best_length = shortest;
      std::uint32_t best_beds = 10'000;
      for (std::uint32_t beds = one.limits.fewest_beds; beds <= 10'000; beds += one.limits.even_beds ? 2 : 1) {
        const double left = beds * wanted / allowance_by_hand(beds, variance.freedom) - variance.frozen;
        if (left > 0) {
          const double length = std::max(shortest, variance.passing / left),
                       cost = beds * (one.limits.settling + length);
          if (cost < least) least = cost, best_length = length, best_beds = beds;
        }
        if (beds * (one.limits.settling + shortest) > 1.1 * least) break;
      }
      EXPECT_EQ(choice.possible, std::isfinite(least) && one.pilot.systematic < error) << k << ' ' << error;
      EXPECT_EQ(choice.effort.beds, best_beds) << k << ' ' << error;
      EXPECT_NEAR(choice.effort.length / three_digits(best_length, true), 1, 1e-9) << k << ' ' << error;
      expect_stated(one, choice);
      possible += choice.possible ? 1 : 0, ++all;
    }
  }
  EXPECT_GT(possible, all / 2);
  EXPECT_LT(possible, all);
}

TEST(EffortByHand, HasTheSmallestErrorInATime) {
  int possible = 0, all = 0;
  for (int k = 0; k < 60; ++k) {
    const PilotCase one = pilot_case(k);
    const VarianceByHand variance(one.pilot);
    const BedWork work(one);
    for (const double seconds : {2.0, 15.0, 200.0}) {
      const EffortChoice choice = choose_effort(one.pilot, one.limits, {.seconds = seconds, .text = ""}, one.jobs);
      const double shortest = shortest_by_hand(one);
      double least = std::numeric_limits<double>::infinity(), best_length = 0;
      std::uint32_t best_beds = 0;
      for (std::uint32_t beds = one.limits.fewest_beds; beds <= 2'000; beds += one.limits.even_beds ? 2 : 1) {
        const double length = (seconds / std::ceil(1.0 * beds / one.jobs) - work.settling_cpu) / work.cpu;
        if (length < shortest) continue;
        const double squares =
            allowance_by_hand(beds, variance.freedom) * (variance.frozen + variance.passing / length) / beds;
        if (squares < least) least = squares, best_length = length, best_beds = beds;
      }
      EXPECT_EQ(choice.possible, std::isfinite(least)) << k << ' ' << seconds;
      EXPECT_EQ(choice.effort.beds, choice.possible ? best_beds : one.limits.fewest_beds) << k << ' ' << seconds;
      const double length =
          choice.possible ? std::max(shortest, three_digits(best_length, false)) : three_digits(shortest, true);
      EXPECT_NEAR(choice.effort.length / length, 1, 1e-9) << k << ' ' << seconds;
      expect_stated(one, choice);
      possible += choice.possible ? 1 : 0, ++all;
    }
  }
  EXPECT_GT(possible, all / 3);
  EXPECT_LT(possible, all);
}

// The next pilot in the order of the reasons for it.
std::optional<Effort> next_by_hand(const PilotCase& one, const EffortChoice& choice, double error) {
  const Effort& had = one.pilot.effort;
  const double systematic = one.pilot.systematic;
  if (systematic > 0.1 * (error > 0 ? error : choice.stated_error) && had.refinement < one.limits.most_refinement)
    return Effort{had.length, had.beds, had.refinement + 1};
  if (error == 0 || systematic >= error) return std::nullopt;
  Effort next = had;
  if (choice.effort.length > 12 * had.length) next.length = three_digits(choice.effort.length / 6, true);
  if (choice.effort.beds * choice.effort.length > 1.5 * had.beds * had.length) {
    if (next.beds < 16) next.beds = 16;
    const double telling = std::min(choice.effort.length, one.limits.telling);
    if (telling > 1.5 * next.length) next.length = three_digits(telling, true);
  }
  const bool differ = VarianceByHand(one.pilot).frozen > 0;
  const double of_choice = choice.effort.beds * (one.limits.settling + choice.effort.length);
  if (differ && had.beds * 4 * had.length < 0.5 * of_choice)
    next.length = std::max(next.length, three_digits(4 * had.length, true));
  return next.length == had.length && next.beds == had.beds ? std::nullopt : std::optional(next);
}

TEST(EffortByHand, NeedsTheNextPilotOfItsFirstReason) {
  std::array<int, 2> given{};
  for (int k = 0; k < 80; ++k)
    for (const double error : {0.3, 0.05, 0.02, 0.006, 0.0}) {
      const PilotCase one = pilot_case(k);
      const Budget budget{.error = error, .seconds = error > 0 ? 0.0 : 60.0, .text = ""};
      const EffortChoice choice = choose_effort(one.pilot, one.limits, budget, one.jobs);
      const auto next = next_pilot(one.pilot, one.limits, choice, budget), expected = next_by_hand(one, choice, error);
      ASSERT_EQ(next.has_value(), expected.has_value()) << k << ' ' << error;
      ++given[next ? 1 : 0];
      if (!next) continue;
      EXPECT_NEAR(next->length / expected->length, 1, 1e-9) << k << ' ' << error;
      EXPECT_EQ(next->beds, expected->beds) << k << ' ' << error;
      EXPECT_EQ(next->refinement, expected->refinement) << k << ' ' << error;
    }
  EXPECT_GT(given[0], 40);
  EXPECT_GT(given[1], 40);
}

}  // namespace
}  // namespace shakebed::tests
