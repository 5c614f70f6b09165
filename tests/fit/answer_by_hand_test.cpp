// The errors and intervals of an answer, by what they are made of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/measured_profile.hpp"
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

// Two kinetic temperatures are one up to 20 %, and up to two of their common errors: 0.47 and 0.5640 differ by 20 %.
TEST(Answer, DoesNotTellKineticTemperaturesApartWithinTwentyPercentOrTwoErrors) {
  const auto two = [](double z, double error) {
    AnswerInput input = every(2, column(0.5));
    input.temperature_x = Estimate{0.47, error, false};
    input.temperature_z = Estimate{z, error, false};
    const Answer answer = find_answer(input);
    EXPECT_EQ(answer.why.starts_with("The disks' velocities have two temperatures"),
              answer.verdict == Verdict::no_single_temperature)
        << answer.why;
    return answer.verdict == Verdict::no_single_temperature;
  };
  EXPECT_FALSE(two(0.47 * 1.199, 0.001));
  EXPECT_TRUE(two(0.47 * 1.201, 0.001));
  const double apart = 0.47 * 0.201, limit = apart / 2 / std::sqrt(2);
  EXPECT_TRUE(two(0.47 * 1.201, 0.99 * limit));
  EXPECT_FALSE(two(0.47 * 1.201, 1.01 * limit));
}

// So are the profile's and a kinetic one, up to 20 % and three errors.
TEST(Answer, DoesNotTellProfileAndVelocitiesApartWithinTwentyPercentOrThreeErrors) {
  AnswerInput input = every(2, column(0.5));
  const Answer alone = find_answer(input);
  ASSERT_EQ(alone.verdict, Verdict::one_temperature) << alone.why;
  const auto chosen = std::find_if(alone.readings.begin(), alone.readings.end(),
                                   [&](const ThermometerReading& one) { return one.thermometer == alone.thermometer; });
  const double t = chosen->temperature, own = chosen->std_error;
  const auto apart = [&](double ratio, double error) {
    input.temperature_x = input.temperature_z = Estimate{ratio * t, error, false};
    return find_answer(input).why.find("but the disks' velocities give") != std::string::npos;
  };
  EXPECT_FALSE(apart(1.199, 1e-4));
  EXPECT_TRUE(apart(1.201, 1e-4));
  ASSERT_LT(3 * own, 0.25 * t) << "else this tests nothing";
  const double limit = std::sqrt(std::pow(0.25 * t / 3, 2) - own * own);
  EXPECT_TRUE(apart(1.25, 0.99 * limit));
  EXPECT_FALSE(apart(1.25, 1.01 * limit));
}

// How far they are apart is in per cent below a factor of two.
TEST(Answer, SaysHowFarTemperaturesAreApart) {
  AnswerInput input = every(2, column(0.5));
  input.temperature_x = Estimate{0.3, 0.001, false};
  for (const auto& [z, words] :
       {std::pair{0.411, "T_z = 0.411 m g D, 37 % apart."}, {0.93, "a factor of 3.1 apart."}}) {
    input.temperature_z = Estimate{z, 0.001, false};
    const std::string why = find_answer(input).why;
    EXPECT_NE(why.find(words), std::string::npos) << why;
  }
}

// An interval is a range where its ends are a factor of two apart: at the confidence at which 2 q std_error/T is ln 2.
TEST(Answer, IsARangeWhereItsEndsAreAFactorOfTwoApart) {
  AnswerInput input = column(0.06);
  input.temperature_x = input.temperature_z = Estimate{0.06, 0.01, false};
  const Answer usual = find_answer(input);
  ASSERT_TRUE(usual.ok()) << usual.why;
  const double quantile = 0.5 * std::log(2) * usual.temperature / usual.std_error;
  for (const double part : {0.99, 1.01}) {
    input.confidence = 2 * normal_chance(part * quantile) - 1;
    const Answer answer = find_answer(input);
    EXPECT_NEAR(answer.interval.high / answer.interval.low, std::pow(2, part), 1e-6);
    EXPECT_EQ(answer.verdict, part < 1 ? Verdict::one_temperature : Verdict::no_single_temperature) << answer.why;
    EXPECT_EQ(answer.why.find("spans a factor of 2") != std::string::npos, part > 1) << answer.why;
  }
}

// A surface below 0.1 m g D is as uneven as that of a bed at rest.
TEST(Answer, ShowsATemperatureFromATenthOn) {
  for (const auto& [temperature, limit] : {std::pair{0.093, true}, {0.11, false}}) {
    const Answer answer = find_answer(column(temperature));
    ASSERT_TRUE(answer.ok()) << answer.why;
    EXPECT_EQ(answer.why.find("T is below") != std::string::npos, limit) << temperature << ": " << answer.why;
    EXPECT_EQ(answer.interval.low == 0, limit) << temperature;
  }
}

// The advice names the largest part of the uncertainty.
TEST(Answer, SaysWhatWouldReduceItsUncertainty) {
  const auto advice = [](double noise, double contact) {
    AnswerInput input = every(2, column(1.0, noise));
    input.contact_duration_effect = contact;
    const Answer answer = find_answer(input);
    EXPECT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
    const double model = std::hypot(answer.bias_uncertainty, answer.misfit_error, answer.spread);
    EXPECT_EQ(answer.advice.find("is statistical") != std::string::npos,
              answer.statistical_error > std::max(model, answer.contact_duration_uncertainty))
        << answer.advice;
    return answer.advice;
  };
  EXPECT_NE(advice(0.05, 0).find("is statistical: a longer measurement reduces it"), std::string::npos);
  EXPECT_NE(advice(0.0005, 0).find("comes from the model: a longer measurement does not"), std::string::npos);
  EXPECT_NE(advice(0.0005, 0.1).find("comes from the contact duration"), std::string::npos);
}

// Two reasons may have one cure, which is said once.
TEST(Answer, SaysOneCureOnce) {
  AnswerInput input = column(1.0);
  input.objections = {{"No floor.", "Look."}, {"No beads.", "Look."}, {"No light.", "Wait."}};
  const Answer answer = find_answer(input);
  EXPECT_EQ(answer.why, "No floor. No beads. No light.");
  EXPECT_EQ(answer.advice, "Look. Wait.");
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

// A gas as thin as this is ideal: by a diameter (1 - e) times as long its T is 1/(1 - e) times as much. With e = 0.3
// that is farther in ln T, 0.357, than what the longer one changes, 0.262: the larger of both counts.
TEST(Answer, HasTheLargerEffectOfBothScales) {
  const auto truth = HydrostaticProfile::of_column(best_of(), 2.0, {0.002, close_packing_density});
  ASSERT_LT(truth.density(0.1), 0.0011);
  AnswerInput input;
  input.base = 0.0;
  input.scale_error = 0.3;
  for (double z = 0.25; z < 20; z += 0.5) {
    input.profile.height.push_back(z);
    input.profile.number_density.push_back(truth.density(z));
    // What is left of the error without the scale's is one in a thousand.
    input.profile.std_error.push_back(truth.density(z) * std::hypot(2 * 0.3, 1e-3));
  }
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok()) << answer.why;
  EXPECT_NEAR(answer.statistical_error / answer.temperature, -std::log1p(-0.3), 2e-3);
}

// T is not even bounded where its interval reaches a factor of e^3 beyond it. All of the uncertainty is the contact
// duration's here, by the normal distribution: 1.96 times 1.5 and 1.56.
TEST(Answer, IsNoneWhereItsIntervalReachesAFactorOfTwenty) {
  AnswerInput input = every(2, column(1.0, 0.001));
  for (const double effect : {1.5, 1.56}) {
    input.contact_duration_effect = effect;
    const Answer answer = find_answer(input);
    const double reach = 1.959964 * answer.std_error / answer.temperature;
    EXPECT_EQ(answer.ok(), reach < 3) << answer.why;
    EXPECT_EQ(answer.status == FitStatus::unreadable, effect > 1.55);
    EXPECT_EQ(answer.verdict, Verdict::no_single_temperature);
    if (!answer.ok()) {
      EXPECT_EQ(answer.why, "The profile does not determine T within a factor of 20.");
      EXPECT_EQ(answer.advice, "Measure longer, or at more closely spaced heights where the density falls.");
      EXPECT_NEAR(std::log(answer.interval.high / answer.temperature), 3, 1e-12) << "and no farther";
    }
  }
}

// The middle of a range has half of it for an error.
TEST(Answer, OfARangeIsItsMiddle) {
  AnswerInput input = every(2, column(0.5));
  input.temperature_x = Estimate{0.2, 0.001, false};
  input.temperature_z = Estimate{0.9, 0.001, false};
  const Answer answer = find_answer(input);
  EXPECT_NEAR(answer.temperature, 0.55, 1e-15);
  EXPECT_NEAR(answer.std_error, 0.35, 1e-15);
  EXPECT_EQ(answer.interval.low, 0.2);
  EXPECT_EQ(answer.interval.high, 0.9);
}

// The height of the solid is that of an Enskog tail below 0.6 per D^2 at the answer's T. Its error is that of the fit
// and what a T one error higher changes.
TEST(Answer, HasTheSolidOfItsTemperature) {
  const AnswerInput input = column(0.12);
  const Answer answer = find_answer(input);
  ASSERT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
  const auto solid_at = [&](double temperature) {
    FitOptions options;
    options.kernel = input.kernel, options.base = input.base;
    options.window.below_density = 0.6;
    options.fixed_temperature = temperature;
    return fit_profile(input.profile, options).solid_height;
  };
  const Estimate solid = solid_at(answer.temperature);
  const double moved = solid_at(answer.temperature + answer.std_error).value - solid.value;
  EXPECT_GT(std::abs(moved), 0.1 * solid.std_error) << "else this tests half of it";
  EXPECT_NEAR(answer.solid_height.value, solid.value, 1e-9);
  EXPECT_NEAR(answer.solid_height.std_error, std::hypot(solid.std_error, moved), 1e-9);
}

// Of a shaken bed whose model does not fit both are said, the model first.
TEST(Answer, OfAShakenBedSaysAlsoThatItsModelDoesNotFit) {
  AnswerInput input = column_with_a_wave();
  const Answer still = find_answer(input);
  ASSERT_EQ(still.verdict, Verdict::model_does_not_fit) << still.why;
  input.shaken = true;
  const Answer shaken = find_answer(input);
  EXPECT_EQ(shaken.verdict, Verdict::model_does_not_fit);
  EXPECT_EQ(shaken.why, still.why +
                            " The bed is shaken, and its velocities are unknown: T_x (horizontal) and T_z (vertical) "
                            "may lie outside this range.");
  EXPECT_EQ(shaken.advice, still.advice);
  // How much worse it fits than beds in equilibrium do: by the table, and by what a window of 0.5 D leaves of a
  // crystal's rows, sqrt(3)/2 D apart.
  const ThermometerReading& whole = still.readings.front();
  const double rows = std::sqrt(8.0 / 3) * std::exp(-2 * std::pow(std::numbers::pi * 0.5 / std::sqrt(0.75), 2));
  const double times = whole.model_error / (known_misfit(whole.temperature) + rows);
  EXPECT_NE(still.why.find("per D^2, " + number(times, 2) + " times as much"), std::string::npos) << still.why;
}

// Walls take more from a bed that has a crystal: one whose greatest density is above freezing, 0.7 of the area.
TEST(Answer, IsMoreUncertainByWallsFromFreezingOn) {
  AnswerInput input = every(3, column(4.0, 0.001));
  input.kernel = {};
  input.width_between_walls = 1e9;  // so wide that nothing is put back
  const double freezing = number_density(freezing_area_fraction);
  for (const double greatest : {0.999 * freezing, 1.001 * freezing}) {
    const double most = *std::max_element(input.profile.number_density.begin(), input.profile.number_density.end());
    for (double& density : input.profile.number_density) density *= greatest / most;
    const Answer answer = find_answer(input);
    ASSERT_TRUE(answer.ok()) << answer.why;
    const auto read = std::find_if(answer.readings.begin(), answer.readings.end(),
                                   [&](const auto& one) { return one.thermometer == answer.thermometer; });
    ASSERT_NE(read, answer.readings.end());
    EXPECT_NEAR(answer.wall_uncertainty * 1e9 / read->temperature, greatest < freezing ? 0.15 : 0.8, 1e-9);
  }
}

}  // namespace
}  // namespace shakebed::fit
