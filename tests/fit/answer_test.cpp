#include "fit/profile_fit/answer.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <tuple>

#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/thermometers.hpp"
#include "fit/theory/expansion.hpp"
#include "tests/fit/answer_column.hpp"
#include "tests/fit/simulated_bed.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

TEST(Answer, OfABedInEquilibriumIsItsTemperature) {
  // Simulated, 6 T_c and 20 T_c; a bath holds T.
  for (const double reduced : {6.0, 20.0}) {
    simulated::BedRun run;
    run.bed = {231, 20.2};
    run.temperature = reduced * run.bed.critical();
    run.spacing = 0.25, run.frames = 150, run.interval = 2, run.seed = 8;
    run.kernel = {KernelKind::gaussian, 0.5};
    AnswerInput input;
    input.kernel = usual_kernel;
    input.profile = average_frames(simulated::profiles_of(run)).profile;
    input.column_number = run.bed.column().column_number;
    const Answer answer = find_answer(input);
    ASSERT_TRUE(answer.ok()) << answer.why;
    EXPECT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
    EXPECT_LT(answer.interval.low, run.temperature);
    EXPECT_GT(answer.interval.high, run.temperature);
    EXPECT_LT(answer.std_error, 0.06 * run.temperature);
    EXPECT_EQ(answer.readings.size(), thermometers().size());
    EXPECT_THAT(answer.why, testing::EndsWith("."));
    EXPECT_FALSE(answer.advice.empty());
  }
}

// The whole uncertainty is made of its parts, and the interval of that.
TEST(Answer, SaysWhatItsUncertaintyIsMadeOf) {
  const Answer answer = find_answer(column(1.0));
  ASSERT_TRUE(answer.ok()) << answer.why;
  ASSERT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
  EXPECT_NEAR(
      answer.std_error,
      std::hypot(std::hypot(answer.statistical_error, answer.misfit_error), answer.bias_uncertainty, answer.spread),
      1e-15);
  EXPECT_NEAR(
      std::log(answer.next_bed_interval.high / answer.temperature) * answer.temperature / answer.statistical_error,
      1.959964, 1e-4);
  EXPECT_GT(answer.bias_uncertainty, 0.0);
  // Errors that are known: normal, 1.96 of them in ln T.
  EXPECT_NEAR(std::log(answer.interval.high / answer.temperature) * answer.temperature / answer.std_error, 1.959964,
              1e-4);
  EXPECT_NEAR(answer.interval.low * answer.interval.high, answer.temperature * answer.temperature, 1e-9);
}

// Also where the thermometers differ by more than their errors explain: rms of that, over those beside the chosen one.
TEST(Answer, TakesInHowFarItsThermometersDiffer) {
  double largest = 0;
  for (const auto& [depth, temperature] : {std::pair{1.5, 0.4}, {1.5, 1.0}, {20.0, 0.4}}) {
    const auto truth = HydrostaticProfile::of_column(best_of(), temperature, {depth, close_packing_density});
    const double top = synthetic::top_of(truth);
    AnswerInput input;
    input.kernel = usual_kernel;
    input.base = 0.0;
    input.profile = synthetic::profile_of(truth, usual_kernel, static_cast<int>(4 * top), top, 0.001, 11);
    input.contact_duration_effect = 0.01;
    input.width_between_walls = 30;
    const Answer answer = find_answer(input);
    ASSERT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
    const auto chosen = std::find_if(answer.readings.begin(), answer.readings.end(), [&](const auto& reading) {
      return reading.thermometer == answer.thermometer && reading.model == answer.model;
    });
    ASSERT_NE(chosen, answer.readings.end());
    double squares = 0, others = 0;
    for (const ThermometerReading& reading : answer.readings) {
      if (!reading.admissible || &reading == &*chosen) continue;
      squares += std::max(0.0, std::pow(std::log(reading.temperature / chosen->temperature), 2) -
                                   std::pow(reading.std_error / reading.temperature, 2) -
                                   std::pow(chosen->std_error / chosen->temperature, 2));
      others += 1;
    }
    ASSERT_GT(others, 0);
    EXPECT_NEAR(answer.spread, answer.temperature * std::sqrt(squares / others), 1e-12) << depth << ", " << temperature;
    EXPECT_NEAR(answer.contact_duration_uncertainty, 0.01 * answer.temperature, 1e-12);
    double parts = 0;
    for (const double part : {answer.statistical_error, answer.misfit_error, answer.bias_uncertainty, answer.spread,
                              answer.contact_duration_uncertainty, answer.wall_uncertainty})
      parts += part * part;
    EXPECT_NEAR(answer.std_error, std::sqrt(parts), 1e-12) << depth << ", " << temperature;
    largest = std::max(largest, answer.spread / answer.std_error);
  }
  EXPECT_GT(largest, 0.5);
}

// The known misfit is of beds that are dense at the floor. A model of a thin gas misses its densities by as much less,
// so the statistics decide.
TEST(Answer, OfAThinGasIsAsCertainAsItsStatistics) {
  const double temperature = 0.5;
  const auto truth = HydrostaticProfile::of_column(best_of(), temperature, {0.02, close_packing_density});
  ASSERT_LT(truth.density(0.5), 0.05);
  AnswerInput input;
  input.kernel = usual_kernel;
  input.base = 0.0;
  input.column_number = 0.02;
  const double top = synthetic::top_of(truth);
  input.profile = synthetic::profile_of(truth, usual_kernel, static_cast<int>(4 * top), top, 0.001, 11);
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok()) << answer.why;
  EXPECT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
  EXPECT_LT(answer.misfit_error, answer.statistical_error);
  EXPECT_NEAR(answer.temperature, temperature, 3 * answer.std_error);
}

// What the simulation's contact duration leaves is one more part of the uncertainty, in quadrature, and nothing else.
TEST(Answer, TakesInTheContactDuration) {
  AnswerInput input = column(1.0);
  const Answer without = find_answer(input);
  EXPECT_EQ(without.contact_duration_uncertainty, 0);
  input.contact_duration_effect = 0.1;
  const Answer with = find_answer(input);
  EXPECT_EQ(with.temperature, without.temperature);
  EXPECT_NEAR(with.contact_duration_uncertainty, 0.1 * with.temperature, 1e-15);
  EXPECT_NEAR(with.std_error, std::hypot(without.std_error, 0.1 * with.temperature), 1e-15);
  EXPECT_LT(with.interval.low, without.interval.low);
  EXPECT_GT(with.interval.high, without.interval.high);
}

// A column whose densities have the error of a scale in common, as photographs give it.
AnswerInput with_scale_error(AnswerInput input, double scale_error) {
  const std::size_t n = input.profile.height.size();
  const std::vector<double>& density = input.profile.number_density;
  input.profile.covariance.assign(n * n, 0.0);
  for (std::size_t a = 0; a < n; ++a) {
    input.profile.covariance[a * n + a] = input.profile.std_error[a] * input.profile.std_error[a];
    for (std::size_t b = 0; b < n; ++b)
      input.profile.covariance[a * n + b] += 4 * scale_error * scale_error * density[a] * density[b];
    input.profile.std_error[a] = std::sqrt(input.profile.covariance[a * n + a]);
  }
  input.scale_error = scale_error;
  return input;
}

// The error of the scale is a part of that of T, by what T is with another scale: the same column whose heights and
// densities are those of a diameter 2 % larger. T itself does not depend on the error. Where it is most of the
// uncertainty, the advice says so: pictures add nothing to it.
TEST(Answer, HasTheErrorOfTheScale) {
  const AnswerInput exact = column(1.0, 0.02);
  const Answer plain = find_answer(exact);
  ASSERT_EQ(plain.verdict, Verdict::one_temperature) << plain.why;
  AnswerInput larger = exact;
  for (double& height : larger.profile.height) height /= 1.02;
  for (double& density : larger.profile.number_density) density *= 1.02 * 1.02;
  for (double& error : larger.profile.std_error) error *= 1.02 * 1.02;
  const double change = std::abs(std::log(find_answer(larger).temperature / plain.temperature));
  EXPECT_GT(change, 0.02) << "heights alone give 2 %";
  const Answer known = find_answer(with_scale_error(exact, 0.0002)),
               unsure = find_answer(with_scale_error(exact, 0.02));
  ASSERT_EQ(unsure.verdict, Verdict::one_temperature) << unsure.why;
  EXPECT_NEAR(unsure.temperature, plain.temperature, 2e-3);
  const double part = std::sqrt(std::pow(unsure.statistical_error, 2) - std::pow(known.statistical_error, 2));
  EXPECT_NEAR(part / unsure.temperature, change, 0.25 * change);
  EXPECT_NE(unsure.advice.find("the scale"), std::string::npos) << unsure.advice;
  EXPECT_EQ(known.advice.find("the scale"), std::string::npos) << known.advice;
}

// Errors that come from the scale alone, rounded in a file so that they are a little less than its part: what is left
// of the variances is no negative number.
TEST(Answer, SurvivesErrorsThatAreThoseOfTheScaleAlone) {
  AnswerInput input = with_scale_error(every(3, column(1.0, 0.02)), 0.02);
  const std::size_t n = input.profile.height.size();
  const std::vector<double>& density = input.profile.number_density;
  for (std::size_t a = 0; a < n; ++a) {
    input.profile.std_error[a] = 2 * 0.02 * std::abs(density[a]) * (1 - 1e-9);
    for (std::size_t b = 0; b < n; ++b)
      input.profile.covariance[a * n + b] = 4 * 0.02 * 0.02 * density[a] * density[b] * (1 - 1e-9);
  }
  const Answer by_covariance = find_answer(input);
  EXPECT_NE(by_covariance.status, FitStatus::bad_input) << by_covariance.why;
  input.profile.covariance.clear();
  const Answer by_errors = find_answer(input);
  EXPECT_NE(by_errors.status, FitStatus::bad_input) << by_errors.why;
}

// With a diameter 60 % larger, disks would cover more than the plane: no fit exists, and T is uncertain by a factor of
// e.
TEST(Answer, IsUncertainByAFactorOfEWhereAFitWithAnotherScaleFails) {
  const AnswerInput exact = column(1.0, 0.02);
  AnswerInput larger = exact;
  for (double& height : larger.profile.height) height /= 1.6;
  for (double& density : larger.profile.number_density) density *= 1.6 * 1.6;
  for (double& error : larger.profile.std_error) error *= 1.6 * 1.6;
  ASSERT_FALSE(find_answer(larger).ok()) << "else this tests nothing";
  const Answer known = find_answer(with_scale_error(exact, 0.0002)), unsure = find_answer(with_scale_error(exact, 0.6));
  const double part = std::sqrt(std::pow(unsure.statistical_error, 2) - std::pow(known.statistical_error, 2));
  EXPECT_NEAR(part / unsure.temperature, 1, 0.02);
}

TEST(Answer, TakesTheKnownBiasOff) {
  const Answer answer = find_answer(column(1.0));
  ASSERT_TRUE(answer.ok());
  for (const ThermometerReading& reading : answer.readings) {
    if (reading.status != FitStatus::ok) continue;
    EXPECT_NEAR(reading.temperature * (1.0 + reading.bias), reading.fitted.value, 1e-9) << reading.thermometer;
    EXPECT_NEAR(reading.std_error / reading.temperature,
                std::hypot(reading.fitted.std_error / reading.fitted.value, reading.bias_uncertainty), 1e-9)
        << reading.thermometer << ": both relative, in quadrature";
  }
  const auto chosen = std::find_if(answer.readings.begin(), answer.readings.end(),
                                   [&](const ThermometerReading& r) { return r.thermometer == answer.thermometer; });
  ASSERT_NE(chosen, answer.readings.end());
  EXPECT_EQ(chosen->temperature, answer.temperature);
}

// Few samples behind the errors widen the interval as Student's t does.
TEST(Answer, WidensItsIntervalWhereTheErrorsComeFromFewSamples) {
  AnswerInput input = column(1.0, 0.1);
  synthetic::take_errors_for_covariance(input.profile, 5);
  const Answer few = find_answer(input);
  ASSERT_TRUE(few.ok());
  const double factor = std::log(few.interval.high / few.temperature) * few.temperature / few.std_error;
  // Student's t of 4 degrees of freedom, were all of it statistical; 1.96, were nothing.
  EXPECT_GT(factor, 2.3);
  EXPECT_LT(factor, 2.777);
  // What another bed would give scatters by the statistical part alone, whose degrees are 4.
  EXPECT_NEAR(std::log(few.next_bed_interval.high / few.temperature) * few.temperature / few.statistical_error,
              2.776445, 1e-5);
  EXPECT_NEAR(few.next_bed_interval.high * few.next_bed_interval.low, few.temperature * few.temperature, 1e-9);
  // One sample more: of 5 degrees.
  input.profile.covariance_samples = 6;
  const Answer more = find_answer(input);
  EXPECT_NEAR(std::log(more.next_bed_interval.high / more.temperature) * more.temperature / more.statistical_error,
              2.570582, 1e-5);
}

TEST(Answer, IsARangeWhereTheVelocitiesHaveTwoTemperatures) {
  AnswerInput input = column(0.5);
  input.temperature_x = Estimate{0.3, 0.01, false};
  input.temperature_z = Estimate{0.6, 0.01, false};
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature);
  EXPECT_THAT(answer.why, testing::HasSubstr("T_x = 0.3 and T_z = 0.6 m g D, a factor of 2 apart"));
  EXPECT_EQ(answer.interval.low, 0.3);
  EXPECT_EQ(answer.interval.high, 0.6);
  ASSERT_TRUE(answer.temperature_x && answer.temperature_z);
  EXPECT_EQ(answer.temperature_x->value, 0.3);
  EXPECT_EQ(answer.temperature_z->value, 0.6);
  EXPECT_FALSE(find_answer(column(0.5)).temperature_x);
  EXPECT_NEAR(answer.temperature, 0.45, 1e-12);
  // As far apart, but within their errors: no reason to say so.
  input.temperature_x = Estimate{0.42, 0.1, false};
  input.temperature_z = Estimate{0.55, 0.1, false};
  EXPECT_EQ(find_answer(input).verdict, Verdict::one_temperature);
}

TEST(Answer, IsARangeWhereProfileAndVelocitiesDisagree) {
  AnswerInput input = column(0.5);
  input.temperature_x = Estimate{0.30, 0.003, false};
  input.temperature_z = Estimate{0.31, 0.003, false};
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature);
  EXPECT_THAT(answer.why, testing::HasSubstr("but the disks' velocities give"));
  EXPECT_EQ(answer.interval.low, 0.30);
  EXPECT_GT(answer.interval.high, 0.45);
}

// From the profile alone a cold bed looks like one at rest with an uneven surface: an upper limit, unless velocities
// confirm it.
TEST(Answer, OfAColdSurfaceIsAnUpperLimit) {
  AnswerInput input = column(0.07);
  const Answer alone = find_answer(input);
  ASSERT_TRUE(alone.ok()) << alone.why;
  EXPECT_EQ(alone.verdict, Verdict::no_single_temperature);
  EXPECT_THAT(alone.why, testing::HasSubstr("T is below"));
  EXPECT_EQ(alone.interval.low, 0.0);
  EXPECT_GT(alone.interval.high, 0.07);
  EXPECT_LT(alone.interval.high, 0.12);
  EXPECT_EQ(alone.temperature, 0.5 * alone.interval.high);
  input.temperature_x = Estimate{0.069, 0.002, false};
  input.temperature_z = Estimate{0.071, 0.002, false};
  const Answer confirmed = find_answer(input);
  EXPECT_EQ(confirmed.verdict, Verdict::one_temperature) << confirmed.why;
  EXPECT_NEAR(confirmed.temperature, 0.07, 3 * confirmed.std_error);
  EXPECT_THAT(find_answer(column(0.3)).why,
              testing::HasSubstr("Only velocities show whether T_x (horizontal motion) differs"));
}

TEST(Answer, OfABedAtRestIsNotReadOffItsProfile) {
  AnswerInput input = column(0.12);
  input.temperature_x = Estimate{2e-6, 1e-7, false};
  input.temperature_z = Estimate{5e-6, 1e-7, false};
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature);
  EXPECT_THAT(answer.why, testing::StartsWith("The bed is at rest: T_x = 2e-06 and T_z = 5e-06 m g D."));
  EXPECT_EQ(answer.interval.low, 2e-6);
  EXPECT_EQ(answer.interval.high, 5e-6);
  input.temperature_x = input.temperature_z = Estimate{0.0, 0.0, false};
  EXPECT_EQ(find_answer(input).interval.high, 0.0);
  // A motion up and down alone.
  input.temperature_z = Estimate{0.2, 0.001, false};
  EXPECT_THAT(find_answer(input).why, testing::HasSubstr("T_x = 0 and T_z = 0.2 m g D."));
}

TEST(Answer, StatesTemperaturesAsLengthsWhereTheDiameterIsKnown) {
  AnswerInput input = column(0.5);
  input.temperature_x = Estimate{0.3, 0.01, false};
  input.temperature_z = Estimate{0.6, 0.01, false};
  input.diameter = 2e-3;
  EXPECT_THAT(find_answer(input).why, testing::HasSubstr("T_x = 0.6 and T_z = 1.2 mm, a factor of 2 apart"));
}

// Heights that are all off by some length move the top of the solid by as much.
TEST(Answer, CarriesTheErrorOfTheFloorIntoTheSolidsHeight) {
  AnswerInput input = column(0.12);
  const Answer exact = find_answer(input);
  ASSERT_GT(exact.solid_height.value, 0.0);
  input.origin_error = 0.4;
  const Answer open = find_answer(input);
  EXPECT_EQ(open.solid_height.value, exact.solid_height.value);
  EXPECT_NEAR(open.solid_height.std_error, std::hypot(exact.solid_height.std_error, 0.4), 1e-12);
  for (double& z : input.profile.height) z += 0.4;
  EXPECT_NEAR(find_answer(input).solid_height.value - exact.solid_height.value, 0.4, 0.1);
}

// Hard walls make a narrow bed look warmer: a column whose density they lower (scaled-particle theory) has the T that
// it has without them.
TEST(Answer, AllowsForHardWalls) {
  for (const double temperature : {1.0, 4.0}) {
    const AnswerInput open = column(temperature, 0.001);
    AnswerInput walled = open;
    walled.width_between_walls = 20.0;
    for (std::size_t i = 0; i < open.profile.number_density.size(); ++i) {
      const double eta = std::clamp(std::numbers::pi / 4 * open.profile.number_density[i], 0.0, 1.0);
      walled.profile.number_density[i] *= 1 - (1 - eta) / (1 + eta) / 20;
    }
    const Answer expected = find_answer(open), found = find_answer(walled);
    EXPECT_NEAR(found.temperature / expected.temperature, 1, 0.005);
    const bool crystal = temperature == 1.0;  // the plateau is close-packed, or below freezing
    EXPECT_NEAR(found.wall_uncertainty, found.temperature * (crystal ? 0.8 : 0.15) / 20, 1e-15);
    EXPECT_GT(found.std_error, found.wall_uncertainty);
    if (crystal) {
      EXPECT_GT(found.wall_uncertainty, std::max(found.statistical_error, found.spread));
      EXPECT_THAT(found.advice, testing::HasSubstr("comes from the side walls"));
    }
    walled.width_between_walls = 0;
    EXPECT_GT(find_answer(walled).temperature / found.temperature, 1.01) << "without the correction it looks warmer";
  }
}

// What shaking does to T_x and T_z is not in the profile.
TEST(Answer, OfAShakenBedWithoutVelocitiesIsARange) {
  AnswerInput input = column(1.0);
  input.shaken = true;
  const Answer shaken = find_answer(input);
  EXPECT_EQ(shaken.verdict, Verdict::no_single_temperature);
  EXPECT_THAT(shaken.why, testing::HasSubstr("T_x (horizontal) and T_z (vertical) may lie outside this range."));
  EXPECT_EQ(shaken.interval.low, find_answer(column(1.0)).interval.low);
  input.temperature_x = input.temperature_z = Estimate{1.0, 0.01, false};
  EXPECT_EQ(find_answer(input).verdict, Verdict::one_temperature);
}

// A range is no confidence interval, and holds all that is known of T.
TEST(Answer, StatesNoConfidenceForARange) {
  AnswerInput input = column(0.5);
  EXPECT_EQ(find_answer(input).interval.confidence, 0.95);
  input.temperature_x = Estimate{0.3, 0.01, false};
  input.temperature_z = Estimate{0.6, 0.01, false};
  EXPECT_EQ(find_answer(input).interval.confidence, 0.0);
}

// Two temperatures on top of one another: a dense bed at 0.4 under a tail that falls as at 1.2.
TEST(Answer, IsARangeWhereTheDepthDecides) {
  AnswerInput input = column(0.4);
  const auto hot = HydrostaticProfile::of_column(best_of(), 1.2, {20.0, close_packing_density});
  const auto cold = HydrostaticProfile::of_column(best_of(), 0.4, {20.0, close_packing_density});
  double joint = 0.0;
  while (cold.density(joint) > 0.45) joint += 0.01;
  double same = 0.0;
  while (hot.density(same) > 0.45) same += 0.01;
  input.profile = {};
  for (double z = 0.125; z < joint + 15.0; z += 0.25) {
    const double density = z < joint ? cold.density(z) : hot.density(z - joint + same);
    input.profile.height.push_back(z);
    input.profile.number_density.push_back(density);
    input.profile.std_error.push_back(synthetic::bin_error(density, 0.003));
  }
  input.kernel = {};
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature) << answer.why;
  EXPECT_THAT(answer.why, testing::HasSubstr("depends on the range of heights"));
  EXPECT_LT(answer.interval.low, 0.9);
  EXPECT_GT(answer.interval.high, 1.0);
}

TEST(Answer, SaysWhereTheModelDoesNotFit) {
  const Answer answer = find_answer(column_with_a_wave());
  ASSERT_TRUE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::model_does_not_fit) << answer.why;
  EXPECT_THAT(answer.why, testing::HasSubstr("deviates from the densities"));
  const Answer fits = find_answer(column(2.0));
  EXPECT_EQ(fits.verdict, Verdict::one_temperature);
  EXPECT_GT(answer.std_error, fits.std_error);
}

// A profile at points, with the rows of a crystal in it: no model has them, and they are not the model's failure.
TEST(Answer, IsNotMisledByTheRowsOfACrystal) {
  const auto truth = HydrostaticProfile::of_column(best_of(), 0.3, {20.0, close_packing_density});
  AnswerInput input;
  input.base = 0.0;
  for (double z = 0.05; z < synthetic::top_of(truth); z += 0.1) {
    const double density = truth.density(z);
    const double rows = density > 0.9 ? 0.6 * std::cos(2.0 * 3.14159265358979 * z / 0.8660254) : 0.0;
    input.profile.height.push_back(z);
    input.profile.number_density.push_back(density * (1.0 + rows));
    input.profile.std_error.push_back(synthetic::bin_error(density, 0.02));
  }
  const Answer answer = find_answer(input);
  ASSERT_TRUE(answer.ok()) << answer.why;
  EXPECT_EQ(answer.verdict, Verdict::one_temperature) << answer.why;
  EXPECT_NEAR(answer.temperature, 0.3, 0.01);
  EXPECT_LT(answer.std_error, 0.01);
}

TEST(Answer, FindsTheSolidOfAColdBed) {
  const double critical = critical_temperature(enskog(), {20.0, close_packing_density}).value;
  const Answer answer = find_answer(column(0.6 * critical));
  ASSERT_TRUE(answer.ok()) << answer.why;
  const double mu = 20.0 / close_packing_density;
  EXPECT_NEAR(answer.solid_height.value / mu, 0.4, 0.03);
  // By the sum rule the solid loses mu/T_c of its height for every bit of T.
  const double by_temperature = mu * answer.std_error / critical;
  EXPECT_GT(answer.solid_height.std_error, 0.3 * by_temperature);
  EXPECT_LT(answer.solid_height.std_error, 3.0 * by_temperature);
}

TEST(Answer, WithoutATemperatureSaysWhy) {
  AnswerInput input = column(1.0);
  for (double& density : input.profile.number_density) density = 0.0;
  EXPECT_EQ(find_answer(input).status, FitStatus::no_signal);
  input.profile.number_density[3] = std::nan("");
  const Answer broken = find_answer(input);
  EXPECT_EQ(broken.status, FitStatus::bad_input);
  EXPECT_FALSE(broken.why.empty());
  EXPECT_FALSE(broken.advice.empty());
  EXPECT_EQ(find_answer({}).status, FitStatus::bad_input);
}

// --- profiles from which no temperature may be read

// Heights every quarter of a diameter, up to `top`; the density and its error by height.
template <class Density, class Error>
AnswerInput made_of(double top, Density density, Error error) {
  AnswerInput input;
  input.base = 0.0;
  synthetic::Normal normal(77);
  for (double z = 0.125; z < top; z += 0.25) {
    const double sigma = error(density(z));
    input.profile.height.push_back(z);
    input.profile.number_density.push_back(std::max(0.0, density(z) + sigma * normal()));
    input.profile.std_error.push_back(sigma);
  }
  return input;
}

void expect_no_temperature(const Answer& answer, const std::string& words) {
  EXPECT_FALSE(answer.ok());
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature);
  EXPECT_EQ(answer.temperature, 0.0) << "no number that could be quoted";
  EXPECT_THAT(answer.why, testing::HasSubstr(words));
  EXPECT_FALSE(answer.advice.empty());
}

TEST(Answer, OfAFlatProfileIsNoTemperature) {
  const auto flat = [](double) { return 0.5; };
  expect_no_temperature(find_answer(made_of(20.0, flat, [](double) { return 0.01; })), "does not fall");
  const Answer uncertain = find_answer(made_of(20.0, flat, [](double d) { return d; }));
  expect_no_temperature(uncertain, "");
  AnswerInput bare = made_of(20.0, flat, [](double) { return 0.05; });
  bare.profile.std_error.clear();
  expect_no_temperature(find_answer(bare), "does not fall");
}

// A fall that the errors do not show, however steep it looks: they are as large as the density.
TEST(Answer, OfDensitiesAsUncertainAsThemselvesIsNoTemperature) {
  AnswerInput input = column(1.0);
  ASSERT_EQ(find_answer(input).verdict, Verdict::one_temperature);
  for (std::size_t i = 0; i < input.profile.height.size(); ++i)
    input.profile.std_error[i] = 2.0 * std::abs(input.profile.number_density[i]) + 1e-4;
  expect_no_temperature(find_answer(input), "relative error of the density");
}

// A cold gas over a uniform background, as false disks make: its tail looks like that of a hot gas.
TEST(Answer, OfABedWithABackgroundIsNotOneTemperature) {
  for (const double background : {0.01, 0.02, 0.05, 0.1}) {
    const Answer answer = find_answer(made_of(
        14.0, [&](double z) { return 0.5 * std::exp(-z / 2.0) + background; },
        [](double d) { return 0.03 * d + 0.002; }));
    EXPECT_NE(answer.verdict, Verdict::one_temperature) << background << ": " << answer.why;
  }
}

// A gas that is thin throughout, of two temperatures. Where it holds a tenth of the usual density, a model must miss
// its densities by a hundredth of what it misses dense beds by: with a tenth the four below passed for one temperature.
TEST(Answer, OfAThinGasOfTwoTemperaturesIsNotOneTemperature) {
  for (const double cold : {2.0, 3.0})
    for (const double ratio : {3.0, 4.0}) {
      const Answer answer = find_answer(made_of(
          12 * cold, [&](double z) { return 0.02 * std::exp(-z / cold) + 0.02 * std::exp(-z / (ratio * cold)); },
          [](double d) { return 0.005 * d + 0.00005; }));
      EXPECT_NE(answer.verdict, Verdict::one_temperature) << cold << ", " << ratio << ": " << answer.why;
    }
}

// Thermometers that fit the same model to the same heights are one fit, and count once.
TEST(Answer, CountsFitsThatDiffer) {
  std::set<std::size_t> seen;
  for (const double depth : {0.02, 1.5, 20.0})
    for (const double temperature : {0.4, 1.0, 4.0}) {
      const auto truth = HydrostaticProfile::of_column(best_of(), temperature, {depth, close_packing_density});
      AnswerInput input;
      input.kernel = usual_kernel;
      input.base = 0.0;
      const double top = synthetic::top_of(truth);
      input.profile = synthetic::profile_of(truth, usual_kernel, static_cast<int>(4 * top), top, 0.001, 11);
      const Answer answer = find_answer(input);
      if (answer.verdict != Verdict::one_temperature) continue;
      std::set<std::tuple<std::string, double, double, double>> fits;
      for (const ThermometerReading& reading : answer.readings)
        if (reading.admissible)
          fits.emplace(reading.model, reading.window_low, reading.window_high, reading.fitted.value);
      const std::string words = fits.size() == 1   ? "Only one model and window"
                                : fits.size() == 2 ? "Both fits"
                                                   : "All " + std::to_string(fits.size()) + " fits";
      EXPECT_THAT(answer.why, testing::StartsWith(words)) << depth << ", " << temperature;
      seen.insert(std::min<std::size_t>(fits.size(), 3));
    }
  EXPECT_GE(seen.size(), 2u) << "not all alike";
}

TEST(Answer, OfTwoLayersWithAGapIsNoTemperature) {
  const auto layers = [](double z) { return std::exp(-1.2 * z) + 0.3 * std::exp(-std::pow((z - 9.0) / 1.3, 2)); };
  expect_no_temperature(find_answer(made_of(13.0, layers, [](double) { return 0.003; })), "above a gap");
}

TEST(Answer, OfNoiseIsNoTemperature) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    synthetic::Normal normal(1000 + seed);
    AnswerInput input;
    for (double z = 0.125; z < 15.0; z += 0.25) {
      input.profile.height.push_back(z);
      input.profile.number_density.push_back(std::abs(0.4 * normal()));
      input.profile.std_error.push_back(0.4);
    }
    const Answer with_errors = find_answer(input);
    EXPECT_EQ(with_errors.verdict, Verdict::no_single_temperature) << seed << ": " << with_errors.why;
    input.profile.std_error.clear();
    const Answer bare = find_answer(input);
    EXPECT_NE(bare.verdict, Verdict::one_temperature) << seed << ": " << bare.why;
  }
}

TEST(Answer, OfABedUpsideDownIsNoTemperature) {
  const AnswerInput upright = column(1.0);
  ASSERT_EQ(find_answer(upright).verdict, Verdict::one_temperature);
  AnswerInput turned = upright;  // heights as depths below the highest
  const double top = upright.profile.height.back();
  for (double& height : turned.profile.height) height = top - height;
  expect_no_temperature(find_answer(turned), "");
  AnswerInput depths = upright;  // heights counted downwards from the floor
  for (double& height : depths.profile.height) height = -height;
  expect_no_temperature(find_answer(depths), "");
  AnswerInput below = upright;  // as depths, with empty space below the floor
  for (double& height : below.profile.height) height = top + 5.0 - height;
  for (int k = 0; k < 20; ++k) {
    below.profile.height.push_back(top + 5.0 + 0.25 * k);
    below.profile.number_density.push_back(0.0);
    below.profile.std_error.push_back(1e-3);
  }
  expect_no_temperature(find_answer(below), "density rises with height");
}

TEST(Answer, OfTooFewHeightsIsNoTemperature) {
  AnswerInput input;
  input.profile = {{1.0, 2.0}, {0.8, 0.3}, {0.01, 0.01}, {}, 0};
  EXPECT_EQ(find_answer(input).verdict, Verdict::no_single_temperature);
  input.profile = {{1.0, 2.0, 3.0, 4.0}, {0.8, 0.3, 0.1, 0.03}, {}, {}, 0};
  expect_no_temperature(find_answer(input), "4 heights");
}

TEST(Answer, OfHeightsInMetresOrDensitiesOfAnotherUnitIsNoTemperature) {
  AnswerInput metres = column(1.0);
  for (double& height : metres.profile.height) height *= 3e-3;
  metres.kernel = {};
  expect_no_temperature(find_answer(metres), "span only");
  AnswerInput dense = column(1.0);
  for (double& density : dense.profile.number_density) density *= 3.0;
  expect_no_temperature(find_answer(dense), "close packing");
  AnswerInput millimetres = column(1.0);  // of beads of 3 mm, their number known
  millimetres.column_number = 20.0;
  ASSERT_EQ(find_answer(millimetres).verdict, Verdict::one_temperature) << find_answer(millimetres).why;
  for (double& height : millimetres.profile.height) height *= 3.0;
  expect_no_temperature(find_answer(millimetres), "N D/W is 20");
}

// An objection of whoever measured the profile outweighs how well it is fitted.
TEST(Answer, TakesInWhatSpeaksAgainstTheMeasurement) {
  AnswerInput input = column(1.0);
  input.objections = {{"No floor is in view.", "Show it."}, {"Few beads.", "Show more."}};
  const Answer answer = find_answer(input);
  expect_no_temperature(answer, "No floor is in view. Few beads.");
  EXPECT_EQ(answer.advice, "Show it. Show more.");
  EXPECT_EQ(answer.status, FitStatus::unreadable);
}

// A cold bed, of which the best thermometer is known to 23 %: 95 % of what is possible spans more than a factor of two.
TEST(Answer, IsARangeWhereTheIntervalSpansAFactorOfTwo) {
  const Answer answer = find_answer(column(0.04));
  ASSERT_TRUE(answer.ok()) << answer.why;
  EXPECT_EQ(answer.verdict, Verdict::no_single_temperature) << answer.why;
  EXPECT_GT(answer.interval.high, 2.0 * answer.interval.low);
  EXPECT_LT(answer.interval.low, 0.04);
  EXPECT_GT(answer.interval.high, 0.04);
  EXPECT_THAT(answer.why, testing::HasSubstr("spans a factor of"));
}

// Rows of a crystal seen through no window: two of them may lie within a diameter, which is no wrong unit.
TEST(Answer, DoesNotTakeRowsForTooDense) {
  const auto truth = HydrostaticProfile::of_column(best_of(), 0.3, {20.0, close_packing_density});
  AnswerInput input;
  input.base = 0.0;
  for (double z = 0.05; z < synthetic::top_of(truth); z += 0.1) {
    const double density = truth.density(z),
                 rows = density > 0.9 ? 0.9 * std::cos(2.0 * 3.14159265358979 * z / 0.8660254) : 0.0;
    input.profile.height.push_back(z);
    input.profile.number_density.push_back(density * (1.0 + rows));
  }
  const Answer answer = find_answer(input);
  EXPECT_THAT(answer.why, testing::Not(testing::HasSubstr("close packing")));
}

// Each of three shapes with each of four kernels.
TEST(Answer, OfAnyProfileIsFiniteAndInOrder) {
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    synthetic::Normal normal(17 * seed + 5);
    const auto uniform = [&] { return 0.5 * std::erfc(-normal() / std::sqrt(2.0)); };
    AnswerInput input;
    const int bins = 1 + static_cast<int>(60.0 * uniform());
    const double range = std::exp(1.5 * normal() + 2.0);
    for (int i = 0; i < bins; ++i) {
      const double x = (i + 0.5) / bins;
      const double clean = seed % 3 == 0 ? 1.0 - x : seed % 3 == 1 ? std::exp(-5.0 * x) : (x < 0.5 ? 1.1 : 0.0);
      input.profile.height.push_back(range * x);
      input.profile.number_density.push_back(clean + 0.02 * normal());
      input.profile.std_error.push_back(0.02 * std::exp(2.0 * normal()));
    }
    if (uniform() < 0.2) input.profile.std_error.clear();
    const Kernel kernels[] = {{}, {KernelKind::top_hat, 0.3}, {KernelKind::gaussian, 0.5}, {KernelKind::disk_chord, 1}};
    input.kernel = kernels[seed % 4];
    if (uniform() < 0.5) input.column_number = 0.5 * range;
    const Answer answer = find_answer(input);
    EXPECT_FALSE(answer.why.empty()) << seed;
    EXPECT_FALSE(answer.advice.empty()) << seed;
    if (!answer.ok()) continue;
    for (const double number : {answer.temperature, answer.std_error, answer.statistical_error, answer.bias_uncertainty,
                                answer.spread, answer.bias, answer.interval.low, answer.interval.high,
                                answer.solid_height.value, answer.solid_height.std_error})
      EXPECT_TRUE(std::isfinite(number)) << seed;
    EXPECT_GT(answer.temperature, 0.0) << seed;
    EXPECT_LE(answer.interval.low, answer.temperature) << seed;
    EXPECT_GE(answer.interval.high, answer.temperature) << seed;
  }
}

TEST(Answer, IsTheSameTwice) {
  const AnswerInput input = column(0.3);
  const Answer one = find_answer(input), two = find_answer(input);
  EXPECT_EQ(one.temperature, two.temperature);
  EXPECT_EQ(one.interval.low, two.interval.low);
  EXPECT_EQ(one.interval.high, two.interval.high);
}

TEST(KnownBias, IsInterpolatedBetweenTheRowsOfTheTable) {
  const auto rows = known_biases();
  ASSERT_GE(rows.size(), 3U);
  for (std::size_t t = 0; t < thermometer_count; ++t) {
    const Thermometer& thermometer = thermometers()[t];
    EXPECT_NEAR(known_bias(thermometer, rows[1].temperature).mean, rows[1].of[t].mean, 1e-12);
    const double middle = std::sqrt(rows[1].temperature * rows[2].temperature);
    EXPECT_NEAR(known_bias(thermometer, middle).mean, 0.5 * (rows[1].of[t].mean + rows[2].of[t].mean), 1e-12);
    EXPECT_NEAR(known_bias(thermometer, middle).scatter, 0.5 * (rows[1].of[t].scatter + rows[2].of[t].scatter), 1e-12);
    EXPECT_EQ(known_bias(thermometer, 1e3).mean, rows.back().of[t].mean);
    EXPECT_NEAR(known_bias(thermometer, 0.5 * rows[0].temperature).scatter, 2.0 * rows[0].of[t].scatter, 1e-12);
    EXPECT_EQ(known_bias(thermometer, 0.5 * rows[0].temperature).mean, rows[0].of[t].mean);
    EXPECT_EQ(known_bias(thermometer, 1e3).scatter, rows.back().of[t].scatter);
    EXPECT_NEAR(known_bias(thermometer, rows.back().temperature * (1 - 1e-9)).mean, rows.back().of[t].mean, 1e-9);
  }
}

}  // namespace
}  // namespace shakebed::fit
