// The errors and intervals of an answer, by what they are made of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/thermometers.hpp"
#include "tests/fit/answer_column.hpp"

namespace shakebed::fit {
namespace {

// What the model is known to miss beyond 0.005 per D^2 stands in every density's error, less of it where the window
// holds less than 0.5 per D^2. Hot beds' models miss no more than that.
TEST(Answer, TakesInWhatItsModelIsKnownToMiss) {
  const auto added = [](const AnswerInput& input) {
    const Answer answer = find_answer(input);
    EXPECT_TRUE(answer.ok()) << answer.why;
    return answer.readings.front().model_error;
  };
  EXPECT_NEAR(added(column(1.0, 0.001)), known_misfit(1.0) - 0.005, 1e-4);
  EXPECT_NEAR(added(column(0.5, 0.001)), known_misfit(0.5) - 0.005, 1e-4);
  EXPECT_EQ(added(column(5.0, 0.001)), 0.0);
  // A gas, in whose window 0.3 per D^2 is the most.
  const auto truth = HydrostaticProfile::of_column(best_of(), 0.6, {0.4, close_packing_density});
  AnswerInput thin;
  thin.kernel = usual_kernel;
  thin.base = 0.0;
  const double top = synthetic::top_of(truth);
  thin.profile = synthetic::profile_of(truth, usual_kernel, static_cast<int>(4 * top), top, 0.0001, 11);
  double most = 0;
  const Answer answer = find_answer(thin);
  ASSERT_TRUE(answer.ok()) << answer.why;
  for (std::size_t i = 0; i < thin.profile.height.size(); ++i)
    if (thin.profile.height[i] >= answer.readings.front().window_low)
      most = std::max(most, thin.profile.number_density[i]);
  ASSERT_LT(most, 0.4);
  EXPECT_NEAR(added(thin), std::pow(most / 0.5, 2) * (known_misfit(0.6) - 0.005), 2e-4);
}

// Welch's degrees of freedom: those of the statistical part over its fourth power.
TEST(Answer, HasStudentsIntervalOfAPartOfItsUncertainty) {
  AnswerInput input = column(1.0, 0.02);
  synthetic::take_errors_for_covariance(input.profile, 5);
  const Answer few = find_answer(input);
  ASSERT_TRUE(few.ok());
  const double part = std::hypot(few.statistical_error, few.misfit_error) / few.std_error;
  ASSERT_LT(part, 0.95);
  ASSERT_GT(part, 0.5);
  EXPECT_NEAR(std::log(few.interval.high / few.temperature) * few.temperature / few.std_error,
              student_quantile(0.975, 4 / std::pow(part, 4)), 1e-9);
}

// A kinetic temperature beyond an interval that is too wide widens it further, on its side, and there is no confidence
// then.
TEST(Answer, WidensAnOpenIntervalToItsKineticTemperatures) {
  AnswerInput input = column(0.04);
  input.temperature_x = input.temperature_z = Estimate{0.04, 0.04, false};
  const Answer inside = find_answer(input);
  ASSERT_TRUE(inside.ok()) << inside.why;
  ASSERT_GT(inside.interval.high, 2 * inside.interval.low) << "else this tests nothing";
  EXPECT_EQ(inside.interval.confidence, 0.95);
  for (const double beyond : {0.97 * inside.interval.low, 1.03 * inside.interval.high}) {
    input.temperature_x = input.temperature_z = Estimate{beyond, beyond, false};
    const Answer both = find_answer(input);
    EXPECT_EQ(both.interval.low, std::min(beyond, inside.interval.low));
    EXPECT_EQ(both.interval.high, std::max(beyond, inside.interval.high));
    EXPECT_EQ(both.interval.confidence, 0.0);
    EXPECT_EQ(both.temperature, inside.temperature);
  }
}

}  // namespace
}  // namespace shakebed::fit
