// --budget: what is asked, what is chosen from a pilot, and what the program does with it.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/runner/budget.hpp"
#include "pipelines/runner/frame_budget.hpp"
#include "pipelines/stages/effort.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

using namespace pipelines;
using testing::HasSubstr;

TEST(BudgetText, IsAnErrorInPerCentOrATime) {
  EXPECT_DOUBLE_EQ(parse_budget("1 %").error, 0.01);
  EXPECT_DOUBLE_EQ(parse_budget("0.5%").error, 0.005);
  EXPECT_EQ(parse_budget("1 %").seconds, 0);
  EXPECT_DOUBLE_EQ(parse_budget("30 s").seconds, 30);
  EXPECT_DOUBLE_EQ(parse_budget("5 min").seconds, 300);
  EXPECT_EQ(parse_budget("30 s").error, 0);
}

std::string refusal(const std::string& text) {
  try {
    parse_budget(text);
  } catch (const UsageError& error) {
    return error.what();
  }
  return "";
}

TEST(BudgetText, ThatIsNoBudgetIsRefusedWithItsReason) {
  EXPECT_THAT(refusal("0 %"), HasSubstr("from 0.01 to 50 %"));
  EXPECT_THAT(refusal("-1 %"), HasSubstr("from 0.01 to 50 %"));
  EXPECT_THAT(refusal("nan %"), HasSubstr("from 0.01 to 50 %"));
  EXPECT_THAT(refusal("50.1 %"), HasSubstr("from 0.01 to 50 %"));
  EXPECT_THAT(refusal("0.0099 %"), HasSubstr("from 0.01 to 50 %"));
  EXPECT_EQ(refusal("50 %"), "");
  EXPECT_EQ(refusal("0.01 %"), "");
  EXPECT_THAT(refusal("many %"), HasSubstr("is not a number of per cent"));
  EXPECT_THAT(refusal("1 2 %"), HasSubstr("is not a number of per cent"));
  EXPECT_THAT(refusal("3 kg"), HasSubstr("a mass"));
  EXPECT_THAT(refusal("30"), HasSubstr("no unit"));
  EXPECT_THAT(refusal("0 s"), HasSubstr("above 0"));
  EXPECT_THAT(refusal("fast"), HasSubstr("\"1 %\""));
}

// Eight beds that state 4 % each after a length of 10, and scatter by as much.
EffortReading eight_beds() {
  EffortReading pilot;
  pilot.effort = {10, 8, 0};
  pilot.settling = 10;
  pilot.within = pilot.spread = 0.04;
  pilot.settling_work = {0.4, 8e5};
  pilot.measuring_work = {1.6, 1.6e6};  // 0.02 s and 20,000 events a unit of length
  return pilot;
}
// It settles for so long that more beds never pay.
EffortLimits limits() { return {.settling = 1e4, .shortest = 1, .fewest_beds = 4}; }

Budget error_of(double error) { return {.error = error, .text = "as asked"}; }

TEST(EffortForAnError, GrowsAsItsInverseSquare) {
  const EffortChoice two = choose_effort(eight_beds(), limits(), error_of(0.02), 1),
                     one = choose_effort(eight_beds(), limits(), error_of(0.01), 1);
  EXPECT_EQ(one.effort.beds, 4U);
  EXPECT_NEAR(one.effort.length / two.effort.length, 4, 0.05) << "rounded to three digits";
}

// 0.04 at a length of 10: by hand, with Student's factor of four beds, 3.182/1.960.
// Nine tenths of the error asked for are aimed at.
TEST(EffortForAnError, IsThatOfWhichTheStatedErrorIsNineTenths) {
  const EffortChoice one = choose_effort(eight_beds(), limits(), error_of(0.01), 1);
  const double student = 3.182446 / 1.959964;
  const double length = 10 * std::pow(student * 0.04 / 0.009, 2) / 4;
  EXPECT_NEAR(one.effort.length, length, 0.008 * length) << "rounded up to three digits";
  EXPECT_NEAR(one.stated_error, 0.009, 1e-4);
  EXPECT_NEAR(one.error, 0.009 / student, 1e-4);
  EXPECT_TRUE(one.possible);
}

TEST(EffortForAnError, CostsWhatThePilotsBedsCostForAsLong) {
  const EffortChoice one = choose_effort(eight_beds(), limits(), error_of(0.01), 1);
  // Of each bed: 10 settled as the pilot did, the rest of 10,000 with the events of the measurement, each of which
  // costs what it does while nobody looks, and the measurement.
  const double cpu_of_bed = 0.05 + (1e4 - 10) * 2e4 * 5e-7 + one.effort.length * 0.02;
  EXPECT_NEAR(one.work.cpu_seconds, 4 * cpu_of_bed, 1e-6 * cpu_of_bed);
  EXPECT_NEAR(one.work.events, 4 * (1e5 + (1e4 - 10 + one.effort.length) * 2e4), 1);
  EXPECT_NEAR(choose_effort(eight_beds(), limits(), error_of(0.01), 3).wall_seconds, 2 * cpu_of_bed, 1e-6 * cpu_of_bed)
      << "four beds on three threads take two rounds";
}

TEST(EffortForAnError, TakesMoreBedsWhereSettlingIsCheap) {
  EffortLimits quick = limits();
  quick.settling = 10;
  const EffortChoice one = choose_effort(eight_beds(), quick, error_of(0.01), 1);
  EXPECT_GT(one.effort.beds, 4U) << "Student's factor falls with each bed";
  EXPECT_NEAR(one.stated_error, 0.009, 1e-3);
}

TEST(EffortForAnError, IsOfAnEvenNumberOfBedsWhereEverySecondStartsOtherwise) {
  EffortReading pilot = eight_beds();
  pilot.spread = 0.3;
  EffortLimits even = limits();
  even.even_beds = true;
  for (const double error : {0.02, 0.03, 0.04, 0.05})
    EXPECT_EQ(choose_effort(pilot, even, error_of(error), 1).effort.beds % 2, 0U);
}

// A scatter of 30 % that does not pass with time leaves 3 % after a hundred beds, however long they are measured.
TEST(EffortForAnError, TakesManyBedsWhereBedsDiffer) {
  EffortReading pilot = eight_beds();
  pilot.spread = 0.3;
  const EffortChoice choice = choose_effort(pilot, limits(), error_of(0.03), 1);
  EXPECT_GT(choice.effort.beds, 100U);
  EXPECT_LT(choice.effort.beds, 200U);
  EXPECT_LE(choice.error, 0.03);
  EXPECT_GE(choice.effort.length, 10) << "no shorter than the beds that showed the scatter";
}

TEST(EffortForAnError, LeavesRoomForTheSystematicPart) {
  EffortReading pilot = eight_beds();
  pilot.systematic = 0.006;
  const EffortChoice choice = choose_effort(pilot, limits(), error_of(0.01), 1);
  EXPECT_NEAR(choice.stated_error, std::sqrt(0.45) / 100, 1e-4) << "of 0.9 %";
  EXPECT_TRUE(choice.possible);
}

TEST(EffortForAnError, IsNotPossibleBelowTheSystematicPart) {
  EffortReading pilot = eight_beds();
  pilot.systematic = 0.02;
  const EffortChoice choice = choose_effort(pilot, limits(), error_of(0.01), 1);
  EXPECT_FALSE(choice.possible);
  EXPECT_NEAR(choice.stated_error, 0.009, 1e-4) << "no more is measured than for 1 % without it";
  EXPECT_TRUE(std::isfinite(choice.effort.length));
  EXPECT_GT(choice.error, 0.02);
}

TEST(EffortForATime, FitsIntoIt) {
  EffortLimits quick = limits();
  quick.settling = 10;
  const Budget budget{.seconds = 60, .text = "60 s"};
  for (const int jobs : {1, 2, 8}) {
    const EffortChoice choice = choose_effort(eight_beds(), quick, budget, jobs);
    EXPECT_TRUE(choice.possible);
    EXPECT_LE(choice.wall_seconds, 60);
    EXPECT_GT(choice.wall_seconds, 55) << jobs;
  }
  EXPECT_LT(choose_effort(eight_beds(), quick, budget, 8).error, choose_effort(eight_beds(), quick, budget, 1).error);
}

// Beds of 10 that settle and 0.016 t^2/(0.009^2 n) that are measured, each: t^2 of ten beds is 1.3321, so that ten cost
// 363.1 and nine 363.4. Of lengths three digits, upwards.
TEST(EffortForAnError, IsTheCheapestNumberOfBeds) {
  EffortLimits quick = limits();
  quick.settling = 10;
  EffortChoice one = choose_effort(eight_beds(), quick, error_of(0.01), 1);
  EXPECT_EQ(one.effort, (Effort{26.4, 10, 0}));
  EXPECT_NEAR(one.work.events, 10 * (1e5 + 26.4 * 2e4), 1);
  EXPECT_NEAR(one.error, std::sqrt(0.016 / 26.4 / 10), 1e-9);
  EXPECT_NEAR(one.stated_error, 1.1541830 * std::sqrt(0.016 / 26.4 / 10), 1e-8);
  quick.fewest_beds = 11;
  one = choose_effort(eight_beds(), quick, error_of(0.01), 1);
  EXPECT_EQ(one.effort, (Effort{23.3, 11, 0}));
  quick.shortest = 24;
  EXPECT_EQ(choose_effort(eight_beds(), quick, error_of(0.01), 1).effort.length, 24);
  quick.even_beds = true, quick.fewest_beds = 8, quick.shortest = 1, quick.settling = 13;
  EXPECT_EQ(choose_effort(eight_beds(), quick, error_of(0.01), 1).effort.beds % 2, 0U);
}

// In 60 s on one thread n beds are measured for (60/n - 0.05)/0.02: nineteen for 155.39, since from nineteen on the
// pilot's 15 degrees of freedom, 15/13, count and not Student's factor. Of eight threads each has three rounds.
TEST(EffortForATime, IsTheNumberOfBedsWithTheSmallestError) {
  EffortLimits quick = limits();
  quick.settling = 10;
  const Budget budget{.seconds = 60, .text = "60 s"};
  const EffortChoice one = choose_effort(eight_beds(), quick, budget, 1);
  EXPECT_EQ(one.effort, (Effort{155, 19, 0})) << "three digits, downwards";
  EXPECT_NEAR(one.wall_seconds, 19 * (0.05 + 155 * 0.02), 1e-9);
  EXPECT_NEAR(one.error, std::sqrt(0.016 / 155 / 19), 1e-9);
  EXPECT_EQ(choose_effort(eight_beds(), quick, budget, 8).effort, (Effort{997, 24, 0}));
  // As long as the shortest there is an effort; at least the fewest beds are named where there is none.
  const Budget tight{.seconds = 4 * (0.05 + 1.015 * 0.02), .text = "as asked"};
  EXPECT_EQ(choose_effort(eight_beds(), quick, tight, 1).effort, (Effort{1.01, 4, 0}));
  const EffortChoice none = choose_effort(eight_beds(), quick, {.seconds = 0.2, .text = "0.2 s"}, 1);
  EXPECT_FALSE(none.possible);
  EXPECT_EQ(none.effort, (Effort{1, 4, 0}));
}

TEST(EffortForATime, IsNotPossibleBelowTheTimeToSettle) {
  EXPECT_FALSE(choose_effort(eight_beds(), limits(), {.seconds = 60, .text = "60 s"}, 1).possible)
      << "200 s of settling a bed";
}

// Per bed and unit of length: 20,000 events with the coarse model.
TEST(RefinementOfAModel, IsJudgedByItsEventsAndByWhatItGains) {
  EffortReading coarse = eight_beds(), fine = eight_beds();
  coarse.systematic = 0.02, fine.systematic = 0.01;
  fine.effort.refinement = 1, fine.effort.length = 20;
  const auto with_events = [&](double times) {
    fine.measuring_work.events = 2 * times * coarse.measuring_work.events;  // it is twice as long
    return fine;
  };
  EXPECT_EQ(judged(coarse, with_events(1.9), error_of(0.5)), Refinement::cheap);
  EXPECT_EQ(judged(coarse, with_events(2.1), error_of(0.5)), Refinement::useless);
  EXPECT_EQ(judged(coarse, with_events(2.1), error_of(0.079)), Refinement::dear) << "2 % is more than a quarter of it";
  EXPECT_EQ(judged(coarse, with_events(2.1), error_of(0.081)), Refinement::useless);
  EXPECT_EQ(judged(coarse, with_events(2.1), error_of(0.009)), Refinement::useless) << "1 % is left, too much";
  EXPECT_EQ(judged(coarse, with_events(2.1), {.seconds = 60, .text = "60 s"}), Refinement::useless);
}

// Four beds: chi2 of three degrees of freedom is above 11.34 in 1 % of all cases: 1.944 times the error.
TEST(StatedError, MissesWhatWasAskedWhereMoreThanChanceIsBetween) {
  EXPECT_TRUE(misses(0.0196, 0.01, 4));
  EXPECT_FALSE(misses(0.0193, 0.01, 4));
  EXPECT_TRUE(misses(0.0125, 0.01, 100));
  EXPECT_FALSE(misses(0.0115, 0.01, 100));
  EXPECT_TRUE(misses(0.0259, 0.01, 2)) << "6.635 of one degree: 2.576 times the error";
  EXPECT_FALSE(misses(0.0256, 0.01, 2));
  EXPECT_TRUE(misses(0.0101, 0.01, 1)) << "one bed: nothing is known of its scatter";
  EXPECT_FALSE(misses(0.01, 0.01, 1));
}

TEST(NextPilot, IsAsLongAsTheChoiceUpToWhatTells) {
  const EffortReading pilot = eight_beds();
  const auto next = [&](double choice, double telling) {
    EffortLimits given = limits();
    given.telling = telling;
    EffortChoice chosen;
    chosen.effort = {choice, 8, 0};
    return next_pilot(pilot, given, chosen, error_of(0.01));
  };
  ASSERT_TRUE(next(30, 40));
  EXPECT_EQ(next(30, 40)->length, 30);
  EXPECT_EQ(next(30, 40)->beds, 16U);
  ASSERT_TRUE(next(60, 40));
  EXPECT_EQ(next(60, 40)->length, 40);
  EXPECT_FALSE(next(14, 40)) << "hardly longer";
  ASSERT_TRUE(next(60, 10));
  EXPECT_EQ(*next(60, 10), (Effort{10, 16, 0})) << "more beds";
}

TEST(NextPilot, IsTheLastWhereItHasTheBedsAndTheLengthThatTell) {
  EffortReading pilot = eight_beds();
  EffortLimits given = limits();
  given.telling = pilot.effort.length;
  EffortChoice chosen;
  chosen.effort = {20, 20, 0};
  ASSERT_TRUE(next_pilot(pilot, given, chosen, error_of(0.01)));
  pilot.effort = *next_pilot(pilot, given, chosen, error_of(0.01));
  EXPECT_FALSE(next_pilot(pilot, given, chosen, error_of(0.01)));
}

TEST(NextPilot, IsNoneWhereTheModelAloneMissesTheError) {
  EffortReading pilot = eight_beds();
  pilot.spread = 0.3;
  EffortLimits quick = limits();
  quick.settling = 10;
  const auto next = [&] {
    return next_pilot(pilot, quick, choose_effort(pilot, quick, error_of(0.03), 1), error_of(0.03));
  };
  ASSERT_TRUE(next()) << "a longer one: beds differ";
  pilot.systematic = 0.03;
  EXPECT_FALSE(next());
  quick.most_refinement = 1;
  ASSERT_TRUE(next());
  EXPECT_EQ(next()->refinement, 1);
}

TEST(NextPilot, IsLongerWhereTheChoiceIsMuchLonger) {
  const EffortReading pilot = eight_beds();
  const EffortChoice near = choose_effort(pilot, limits(), error_of(0.03), 1),
                     far = choose_effort(pilot, limits(), error_of(0.001), 1);
  EXPECT_FALSE(next_pilot(pilot, limits(), near, error_of(0.03)));
  const auto next = next_pilot(pilot, limits(), far, error_of(0.001));
  ASSERT_TRUE(next);
  EXPECT_GT(next->length, far.effort.length / 12);
  EXPECT_LT(next->length, far.effort.length);
}

TEST(NextPilot, HasAFinerModelWhereTheSystematicPartIsLarge) {
  EffortReading pilot = eight_beds();
  pilot.systematic = 0.01;
  EffortLimits fine = limits();
  const EffortChoice choice = choose_effort(pilot, fine, error_of(0.02), 1);
  EXPECT_EQ(next_pilot(pilot, fine, choice, error_of(0.02)).value_or(pilot.effort).refinement, 0) << "there is none";
  fine.most_refinement = 2;
  const auto next = next_pilot(pilot, fine, choice, error_of(0.02));
  ASSERT_TRUE(next);
  EXPECT_EQ(next->refinement, 1);
}

// A choice of more than 12 times the pilot's length is approached by a sixth of it, one of more than 1.5 times all of
// the pilot's beds by 16 beds.
TEST(NextPilot, HasItsLimits) {
  const EffortReading pilot = eight_beds();
  const auto next = [&](const EffortReading& from, const Effort& choice, double settling = 1e4) {
    EffortLimits given = limits();
    given.settling = settling;
    EffortChoice chosen;
    chosen.effort = choice;
    return next_pilot(from, given, chosen, error_of(0.01)).value_or(Effort{});
  };
  EXPECT_EQ(next(pilot, {121, 8, 0}), (Effort{20.2, 16, 0}));
  EXPECT_EQ(next(pilot, {120, 8, 0}), (Effort{10, 16, 0}));
  EXPECT_EQ(next(pilot, {12.1, 10, 0}), (Effort{10, 16, 0}));
  EXPECT_EQ(next(pilot, {12, 10, 0}), Effort{}) << "1.5 times as much: this pilot will do";
  // Beds that differ are watched four times as long where that costs less than half of the choice: 8 x 40 of 22 x 30.
  EffortReading apart = pilot;
  apart.spread = 0.3;
  EXPECT_EQ(next(apart, {20, 22, 0}, 10), (Effort{40, 16, 0}));
  EXPECT_EQ(next(apart, {20, 21, 0}, 10), (Effort{10, 16, 0}));
}

// A tenth of the error asked for, or of the one that the time allows, may be systematic.
TEST(NextPilot, RefinesAboveATenthOfTheError) {
  EffortReading pilot = eight_beds();
  EffortLimits fine = limits();
  fine.most_refinement = 1;
  EffortChoice choice;
  choice.effort = pilot.effort, choice.stated_error = 0.02;
  const Budget time{.seconds = 60, .text = "60 s"};
  for (const auto& [systematic, refined] : {std::pair(0.00199, false), {0.00201, true}}) {
    pilot.systematic = systematic;
    EXPECT_EQ(next_pilot(pilot, fine, choice, error_of(0.02)).has_value(), refined) << systematic;
    EXPECT_EQ(next_pilot(pilot, fine, choice, time).has_value(), refined) << systematic;
  }
  pilot.effort.refinement = 1;
  EXPECT_FALSE(next_pilot(pilot, fine, choice, error_of(0.02))) << "there is no finer one";
}

// ------------------------------------------------------------------------------------------------ frames

// 16 frames leave 4 %; their own uncertainty makes 15/13 of its square. For 2 % 16 * 15/13 * 4 = 73.8 are needed.
TEST(FramesForAnError, AreAsManyAsOneOverItsSquare) {
  const FramePilot pilot{.frames = 16, .error = 0.04, .fixed_seconds = 1, .seconds_per_frame = 0.5};
  const FrameChoice choice = choose_frames(pilot, 1000, error_of(0.02));
  EXPECT_EQ(choice.stride, 13U) << "1000/74 is 13.5";
  EXPECT_EQ(choice.frames, 77U) << "0, 13, ... 988";
  EXPECT_NEAR(choice.error, 0.04 * std::sqrt(16 / 77.0), 1e-12);
  EXPECT_NEAR(choice.seconds, 1 + 77 * 0.5, 1e-12);
  EXPECT_TRUE(choice.possible);
}

TEST(FramesForAnError, AreNoFewerThanThoseOfThePilot) {
  const FrameChoice choice = choose_frames({.frames = 16, .error = 0.04, .seconds_per_frame = 1}, 160, error_of(0.1));
  EXPECT_EQ(choice.frames, 16U);
  EXPECT_EQ(choice.stride, 10U);
  EXPECT_NEAR(choice.error, 0.04, 1e-12);
}

TEST(FramesForAnError, AreAllWhereTheyDoNotReachIt) {
  const FramePilot pilot{.frames = 16, .error = 0.04, .fixed_seconds = 1, .seconds_per_frame = 0.5};
  const FrameChoice choice = choose_frames(pilot, 64, error_of(0.002));
  EXPECT_EQ(choice.stride, 1U);
  EXPECT_EQ(choice.frames, 64U);
  EXPECT_NEAR(choice.error, 0.02, 1e-12);
  EXPECT_FALSE(choice.possible);
  EXPECT_FALSE(choose_frames({.frames = 16, .error = 0, .seconds_per_frame = 1}, 64, error_of(0.5)).possible)
      << "no error is known";
}

TEST(FramesForATime, FitIntoIt) {
  const FramePilot pilot{.frames = 16, .error = 0.04, .fixed_seconds = 2, .seconds_per_frame = 0.5};
  const auto in = [&](double seconds) { return choose_frames(pilot, 1000, {.seconds = seconds, .text = "as asked"}); };
  EXPECT_EQ(in(27).stride, 20U) << "50 frames in 25 s";
  EXPECT_EQ(in(27).frames, 50U);
  EXPECT_NEAR(in(27).seconds, 27, 1e-12);
  EXPECT_EQ(in(26).stride, 21U) << "48 frames: of every 20th there are 50";
  EXPECT_LE(in(26).seconds, 26);
  EXPECT_EQ(in(1e6).stride, 1U);
  EXPECT_FALSE(in(2.4).possible);
  EXPECT_TRUE(in(2.5).possible);
}

TEST(CostOfFrames, IsALineThroughTwoPilots) {
  FramePilot pilot;
  cost_of_frames(4, 3, 16, 9, pilot);
  EXPECT_DOUBLE_EQ(pilot.seconds_per_frame, 0.5);
  EXPECT_DOUBLE_EQ(pilot.fixed_seconds, 1);
  for (const double few : {9.5, 1.0}) {  // the few took longer, or so short that the line begins below 0
    cost_of_frames(4, few, 16, 8, pilot);
    EXPECT_DOUBLE_EQ(pilot.seconds_per_frame, 0.5);
    EXPECT_DOUBLE_EQ(pilot.fixed_seconds, 0);
  }
}

TEST(ReducedFrames, LeaveARadiusOfSixPixels) {
  EXPECT_EQ(coarsest_reduction(20, 1), 3U) << "6.67 px are left";
  EXPECT_EQ(coarsest_reduction(12, 1), 2U);
  EXPECT_EQ(coarsest_reduction(11.9, 1), 1U);
  EXPECT_EQ(coarsest_reduction(4, 1), 1U);
  EXPECT_EQ(coarsest_reduction(30, 8), 8U) << "frames that are reduced already";
}

TEST(ReducedFrames, AreTriedWhereManyFramesAreMeasuredOrNotAllFitIntoTheTime) {
  EXPECT_TRUE(coarser_may_gain({.frames = 64}, 1000, error_of(0.01)));
  EXPECT_FALSE(coarser_may_gain({.frames = 63}, 1000, error_of(0.01)));
  const Budget time{.seconds = 10, .text = "10 s"};
  EXPECT_TRUE(coarser_may_gain({.frames = 32}, 33, time));
  EXPECT_FALSE(coarser_may_gain({.frames = 33}, 33, time));
  EXPECT_FALSE(coarser_may_gain({.frames = 31}, 1000, time)) << "the pilot would take too much of it";
}

TEST(ReducedFrames, AreChosenForAnErrorWhereTheyAreCheaperAndChangeLittle) {
  const FrameChoice fine{.frames = 100, .error = 0.02, .seconds = 10};
  const auto chosen = [&](double seconds, double shift) {
    return coarser_is_better(fine, {.frames = 110, .error = 0.02, .seconds = seconds}, shift, error_of(0.02));
  };
  EXPECT_TRUE(chosen(7.9, 0.0019));
  EXPECT_FALSE(chosen(8.1, 0.0019));
  EXPECT_FALSE(chosen(7.9, 0.0021));
  EXPECT_FALSE(coarser_is_better(fine, {.error = 0, .seconds = 1}, 0, error_of(0.02))) << "their error is unknown";
  EXPECT_FALSE(coarser_is_better(fine, {.error = 0.03, .seconds = 1, .possible = false}, 0, error_of(0.02)))
      << "they do not reach it";
  EXPECT_TRUE(coarser_is_better({.error = 0.03, .seconds = 9, .possible = false},
                                {.error = 0.03, .seconds = 1, .possible = false}, 0, error_of(0.02)))
      << "neither does";
}

// 3 % of scatter and 4 % of shift are 5 % together.
TEST(ReducedFrames, AreChosenForATimeWhereErrorAndShiftTogetherAreSmaller) {
  const Budget time{.seconds = 10, .text = "10 s"};
  const FrameChoice coarse{.frames = 100, .error = 0.03, .seconds = 10};
  EXPECT_TRUE(coarser_is_better({.frames = 30, .error = 0.056}, coarse, 0.04, time));
  EXPECT_FALSE(coarser_is_better({.frames = 30, .error = 0.055}, coarse, 0.04, time));
}

// ------------------------------------------------------------------------------------------------ the program

// A hot, dilute bed: 40 disks, of which a second takes some ms.
std::string recipe() {
  return R"({"name": "hot", "stages": [
    {"stage": "simulate", "id": "bed", "units": "reduced", "disks": {"count": 40, "restitution": 0.95, "contact_duration": 1e-5},
     "box": {"width": 12.3, "sides": "periodic"},
     "floor": {"motion": "sinusoidal", "frequency": 0.45, "gamma": 5, "restitution": 0.95},
     "settle": 20, "measure": 40}]})";
}

ProgramResult run_hot(const ScratchFolder& folder, const std::vector<std::string>& more) {
  write_text(folder / "hot.json", recipe());
  std::vector<std::string> arguments{"run", "hot.json", "--out", "o"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_shakebed(arguments, folder.path());
}

TEST(BudgetRun, SaysWhatItPicksAndWritesItIntoTheRecipe) {
  const ScratchFolder folder;
  const ProgramResult ran = run_hot(folder, {"--budget", "5 %"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("chooses \"measure\""));
  EXPECT_THAT(ran.err, HasSubstr("expected error of T_x: "));
  const Json manifest = Json::parse(read_text(folder / "o" / "manifest.json"));
  const Json& said = manifest["budget"]["stages"][0];
  const Json resolved = Json::parse(read_text(folder / "o" / "resolved.json"))["stages"][0];
  EXPECT_EQ(resolved["measure"], said["picked"]["/measure"]);
  EXPECT_EQ(resolved["replicas"], said["picked"]["/replicas"]);
  EXPECT_EQ(manifest["document"]["stages"][0]["measure"], said["picked"]["/measure"]);
  const Json seen = Json::parse(read_text(folder / "o" / "bed" / "observables.json"));
  EXPECT_NEAR(seen["events"].get<double>() / said["events"].get<double>(), 1, 0.3);
  EXPECT_LE(said["stated_error"].get<double>(), 0.0501);
  // The pilot: eight beds for 16 periods, which settle no longer and keep no frames.
  const Json pilot = Json::parse(read_text(folder / "o/.pilot/bed/0/bed/.record"))["options"];
  EXPECT_EQ(pilot["replicas"], 8);
  EXPECT_NEAR(pilot["measure"].get<double>(), 16 / 0.45, 1e-9);
  EXPECT_EQ(pilot["settle"], 20);
  EXPECT_EQ(pilot["frames"]["count"], 0);
  EXPECT_EQ(said["id"], "bed");
  EXPECT_EQ(said["number"], "T_x");
  EXPECT_EQ(manifest["budget"]["asked"], "5 %");
  EXPECT_EQ(said["length"], said["picked"]["/measure"]);
  EXPECT_EQ(said["beds"], said["picked"]["/replicas"]);
  EXPECT_EQ(said["possible"], true);
  EXPECT_GT(said["pilot"]["cpu_seconds"].get<double>(), 0);
  EXPECT_GE(said["pilot"]["beds"], 8);
  EXPECT_THAT(ran.err, testing::StartsWith("bed: pilot run for --budget\nbed: --budget \"5 %\" chooses \"measure\": " +
                                           said["length"].dump() + ", \"replicas\": " + said["beds"].dump()));
}

TEST(BudgetRun, IsRepeatedByRerunWithoutAPilot) {
  const ScratchFolder folder;
  ASSERT_EQ(run_hot(folder, {"--budget", "5 %"}).exit_code, 0);
  const ProgramResult again = run_shakebed({"rerun", "o", "--out", "again"}, folder.path());
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_THAT(again.out, HasSubstr("identical"));
  EXPECT_FALSE(std::filesystem::exists(folder / "again" / ".pilot"));
}

TEST(BudgetRun, PicksTheSameWithTheSameSeed) {
  const ScratchFolder first, second;
  ASSERT_EQ(run_hot(first, {"--budget", "5 %", "--dry-run", "--jobs", "1"}).exit_code, 0);
  ASSERT_EQ(run_hot(second, {"--budget", "5 %", "--dry-run", "--jobs", "2"}).exit_code, 0);
  const auto seen = [](const ScratchFolder& folder) {
    return read_text(folder / "o" / ".pilot" / "bed" / "0" / "bed" / "observables.json");
  };
  EXPECT_EQ(seen(first), seen(second));
  EXPECT_FALSE(std::filesystem::exists(first / "o" / "bed")) << "a dry run runs the pilot alone";
}

TEST(BudgetRun, KeepsToATime) {
  const ScratchFolder folder;
  const ProgramResult ran = run_hot(folder, {"--budget", "3 s"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json said = Json::parse(read_text(folder / "o" / "manifest.json"))["budget"]["stages"][0];
  EXPECT_LE(said["wall_seconds"].get<double>() + said["pilot"]["wall_seconds"].get<double>(), 3);
}

TEST(BudgetRun, RefusesWhatIsNoBudget) {
  const ScratchFolder folder;
  const ProgramResult ran = run_hot(folder, {"--budget", "3 kg"});
  EXPECT_EQ(ran.exit_code, 2);
  EXPECT_THAT(ran.err, HasSubstr("--budget: 3 kg is a mass"));
}

TEST(BudgetRun, RefusesATimeInWhichTheBedCannotSettle) {
  const ScratchFolder folder;
  const ProgramResult ran = run_hot(folder, {"--budget", "0.2 s", "--set", "/stages/bed/settle=2e5"});
  EXPECT_EQ(ran.exit_code, 5) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("Allow more time"));
}

// A file lies where the pilot's folder belongs. Nothing is chosen, and nothing is run.
TEST(BudgetRun, SaysWhyItsPilotFailed) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "o" / ".pilot" / "bed" / "0");
  write_text(folder / "o" / ".pilot" / "bed" / "0" / ".scratch", "");
  const ProgramResult ran = run_hot(folder, {"--budget", "5 %"});
  EXPECT_EQ(ran.exit_code, 5) << ran.err;
  EXPECT_THAT(ran.err,
              HasSubstr("error: the pilot run of --budget failed: bed (simulate): o/.pilot/bed/0/.scratch/bed/"));
  EXPECT_THAT(ran.err, Not(HasSubstr("chooses")));
  EXPECT_FALSE(std::filesystem::exists(folder / "o" / "bed"));
}

TEST(BudgetRun, NamesTheRecipeThatHasNothingToScale) {
  const ScratchFolder folder;
  write_text(folder / "study.json", R"({"name": "study",
 "stages": [{"stage": "study", "parameter": {"name": "gamma", "values": [3], "set": ["/stages/bed/floor/gamma"]},
   "stages": [{"stage": "simulate", "id": "bed", "units": "reduced", "disks": {"count": 10}, "box": {"width": 5},
               "floor": {"motion": "sinusoidal", "frequency": 0.5, "gamma": 3}, "measure": 10}],
   "collect": {"T_x": {"at": "/bed/temperature_x"}}}]})");
  const ProgramResult ran = run_shakebed({"run", "study.json", "--budget", "1 %"}, folder.path());
  EXPECT_EQ(ran.exit_code, 3) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("study.json:2:12: /stages: --budget: no stage of this recipe"));
}

TEST(BudgetRun, IsNotForSweeps) {
  const ScratchFolder folder;
  write_text(folder / "sweep.json", small_recipe(R"({"over": {"/stages/bed/seed": [1, 2]}})"));
  const ProgramResult ran = run_shakebed({"run", "sweep.json", "--budget", "1 %"}, folder.path());
  EXPECT_EQ(ran.exit_code, 2) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("sweep"));
}

// Each pilot of a stage has a line of progress of its own. By a clock that goes on by a minute whenever it is asked, a
// line shows every call but the first of each pilot.
TEST(BudgetRun, BeginsItsProgressWithEachPilot) {
  const ScratchFolder folder;
  const std::string small = R"({"name": "hot", "stages": [
    {"stage": "simulate", "id": "bed", "units": "reduced", "disks": {"count": 6, "restitution": 0.95, "contact_duration": 1e-5},
     "box": {"width": 5.3, "sides": "periodic"},
     "floor": {"motion": "sinusoidal", "frequency": 0.45, "gamma": 5, "restitution": 0.95}, "settle": 4, "measure": 20}]})";
  std::vector<Problem> problems;
  const Plan plan = make_plan(*parse_json(small, "hot.json", problems), "hot.json", folder.path());
  RunOptions options;
  options.out = folder / "o", options.jobs = 1;
  int calls = 0;
  testing::internal::CaptureStderr();
  {
    Console console(Console::Level::normal,
                    [&] { return Console::Clock::time_point{} + std::chrono::minutes(++calls); });
    choose_by_budget(plan, parse_budget("8 %"), options, console);
  }
  const std::string said = testing::internal::GetCapturedStderr();
  int pilots = 0, lines = 0;
  while (std::filesystem::exists(folder / "o/.pilot/bed" / std::to_string(pilots))) ++pilots;
  for (std::size_t at = said.find("  bed: pilot:"); at != std::string::npos; at = said.find("  bed: pilot:", at + 1))
    ++lines;
  EXPECT_GE(pilots, 2);
  EXPECT_EQ(calls - lines, pilots) << said;
}

// A stage whose pilots are those of the test, whatever they are asked for: `pilots` by their refinement.
class GivenPilots : public Stage, public Scalable {
 public:
  GivenPilots(EffortLimits limits, std::vector<Changes> pilots, double trial)
      : limits_(limits), pilots_(std::move(pilots)), trial_(trial) {}
  void describe(Fields& /*fields*/) override {}
  void results(ResultList& /*list*/) const override {}
  void run(RunContext& /*context*/) const override {}
  double trial_seconds() const override { return trial_; }
  const Scalable* scalable() const override { return this; }
  std::string number() const override { return "T_x"; }
  std::string systematic_cause() const override { return "the weather"; }
  std::string systematic_remedy() const override { return "a roof"; }
  EffortLimits limits() const override { return limits_; }
  Changes changes(const Effort& effort) const override { return {{"/replicas", effort.beds}}; }
  Changes pilot_changes(const Effort& effort) const override {
    return pilots_.at(static_cast<std::size_t>(effort.refinement));
  }
  EffortReading read(const Effort& effort, const Json& /*result*/, const Json& /*timings*/) const override {
    EffortReading reading;
    reading.effort = effort;
    return reading;
  }

 private:
  EffortLimits limits_;
  std::vector<Changes> pilots_;
  double trial_;
};

struct ChosenByPilots {
  std::string said;
  Json record;
  Json pilot(int number) const {
    return Json::parse(read_text(folder->path() / "o/.pilot/bed" / std::to_string(number) / "bed/observables.json"));
  }
  std::unique_ptr<ScratchFolder> folder = std::make_unique<ScratchFolder>();
};
ChosenByPilots chosen_by_pilots(const std::string& scene, const std::string& budget, const EffortLimits& limits,
                                std::vector<Scalable::Changes> pilots, double trial = 0) {
  ChosenByPilots out;
  std::vector<Problem> problems;
  Plan plan =
      make_plan(*parse_json(R"({ "name": "p", "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced", )" +
                                scene + " } ] }",
                            "p.json", problems),
                "p.json", out.folder->path());
  plan.stages[0].stage = std::make_unique<GivenPilots>(limits, std::move(pilots), trial);
  RunOptions options;
  options.out = *out.folder / "o", options.jobs = 1;
  testing::internal::CaptureStderr();
  try {
    Console console(Console::Level::normal);
    out.record = choose_by_budget(plan, parse_budget(budget), options, console).record["stages"][0];
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what();
  }
  out.said = testing::internal::GetCapturedStderr();
  return out;
}
// Inelastic disks that touch for long: a few per cent of their temperature come from the contact duration.
const std::string soft_bed = R"("disks": { "count": 12, "restitution": 0.7, "contact_duration": 0.03 },
    "box": { "width": 5.3, "sides": "periodic" }, "settle": 2, "measure": 20,
    "floor": { "motion": "sinusoidal", "frequency": 0.45, "gamma": 5, "restitution": 0.7 })";
Scalable::Changes pilot_with(double contact_duration, double length = 20) {
  return {{"/replicas", 8}, {"/measure", length}, {"/disks/contact_duration", contact_duration}};
}

// Where no finer model is left, the warning names cause, size and remedy of the error.
TEST(BudgetOfPilots, WarnsOfAnErrorThatNoLongerRunReduces) {
  EffortLimits given{.settling = 2, .shortest = 8, .pilot = 20, .telling = 40, .written = 20};
  const ChosenByPilots chosen = chosen_by_pilots(soft_bed, "0.1 %", given, {pilot_with(0.03)});
  const double effect = chosen.pilot(0)["contact_duration_effect"]["value"].get<double>();
  EXPECT_GT(effect, 0.001);
  EXPECT_EQ(chosen.record["systematic_error"], effect);
  EXPECT_FALSE(chosen.record["possible"]);
  EXPECT_THAT(chosen.said, HasSubstr("warning: bed: the weather alone gives T_x an error of about " +
                                     fmt::format("{:.2g} %", 100 * effect) +
                                     ", more than the wanted 0.1 %. A longer measurement does not reduce this error; a "
                                     "roof does\n"));
  EXPECT_THAT(chosen.said, Not(HasSubstr("beds differ so much")));
}

// Three elastic disks without gravity keep the horizontal part of their energy for long, in each bed another one.
TEST(BudgetOfPilots, WarnsOfBedsThatDifferForEver) {
  const std::string gas = R"("disks": { "count": 3 }, "gravity": 0, "start_temperature": 1, "settle": 1, "measure": 10,
      "box": { "width": 30, "sides": "periodic", "lid": { "kind": "periodic", "height": 30 } })";
  EffortLimits given{.settling = 1, .shortest = 8, .pilot = 20, .telling = 20, .written = 20};
  const Scalable::Changes pilot{{"/replicas", 8}, {"/measure", 10}};
  const ChosenByPilots chosen = chosen_by_pilots(gas, "0.01 %", given, {pilot});
  EXPECT_EQ(chosen.record["beds"], 10000);
  EXPECT_FALSE(chosen.record["possible"]);
  EXPECT_THAT(chosen.said, HasSubstr("warning: bed: beds differ so much that even 10000 beds do not reach the wanted "
                                     "error of 0.01 %. The largest number of beds is used\n"));
  EXPECT_THAT(chosen.said, Not(HasSubstr("the weather")));
  EXPECT_THAT(chosen_by_pilots(gas, "50 %", given, {pilot}).said, Not(HasSubstr("warning")));
}

// A finer model is taken where its error falls by more than its events rise, and where the error needs it; else it is
// left again. In both cases but the first no finer one is tried. The finer model that gains nothing is the same with
// three times the events.
TEST(BudgetOfPilots, TakeAFinerModelWhereItGains) {
  EffortLimits given{.settling = 2, .shortest = 8, .pilot = 20, .telling = 20, .written = 20};
  given.most_refinement = 2;
  const auto chosen = [&](double coarse, double fine, double length) {
    return chosen_by_pilots(soft_bed, "50 %", given,
                            {pilot_with(coarse), pilot_with(fine, length), pilot_with(0.0001)});
  };
  const auto effect = [](const ChosenByPilots& of, int pilot) {
    return of.pilot(pilot)["contact_duration_effect"]["value"].get<double>();
  };
  const auto pilots = [](const ChosenByPilots& of) {
    int count = 0;
    while (std::filesystem::exists(of.folder->path() / "o/.pilot/bed" / std::to_string(count))) ++count;
    return count;
  };
  const ChosenByPilots cheap = chosen(0.3, 0.001, 20);
  EXPECT_LT(effect(cheap, 1), effect(cheap, 0) / 10);
  EXPECT_EQ(cheap.record["refinement"], 1);
  EXPECT_EQ(cheap.record["systematic_error"], effect(cheap, 1));
  const ChosenByPilots useless = chosen(0.01, 0.01, 60);
  EXPECT_GT(effect(useless, 0), 0.05) << "a tenth of the error";
  EXPECT_LT(effect(useless, 0), 0.125) << "a quarter of it";
  EXPECT_EQ(useless.record["refinement"], 0);
  EXPECT_EQ(useless.record["systematic_error"], effect(useless, 0));
  EXPECT_EQ(pilots(useless), 2);
  const ChosenByPilots dear = chosen(0.3, 0.3, 60);
  EXPECT_GT(effect(dear, 0), 0.125);
  EXPECT_EQ(dear.record["refinement"], 1);
  EXPECT_EQ(dear.record["systematic_error"], effect(dear, 1));
  EXPECT_EQ(pilots(dear), 2);
}

// By a trial of 0.06 s for a bed that settles for 1 and is measured for 3, eight beds of 40 that settle for 1 take
// 8 x 0.015 x 41 = 4.92 s. A quarter of 10 s is left for the pilot: 40 x 2.5/4.92 = 20.3, with three digits upwards.
TEST(BudgetOfPilots, TakeAQuarterOfTheTime) {
  EffortLimits given{.settling = 1, .shortest = 8, .pilot = 16, .telling = 40, .written = 3};
  const auto length = [&](double trial) {
    return chosen_by_pilots(soft_bed, "10 s", given, {pilot_with(0.03)}, trial).record["pilot"]["length"].get<double>();
  };
  EXPECT_DOUBLE_EQ(length(0.06), 20.4);
  EXPECT_DOUBLE_EQ(length(0.03), 40) << "2.46 s are within it";
  EXPECT_DOUBLE_EQ(length(10), 4) << "half of the shortest at least";
}

// What a finished run says of its error: that of four beds has Student's factor 1.6237, and is 0.04 x 1.6237/2; within
// counts where it is larger.
TEST(BudgetReached, IsSaidBesideWhatWasExpected) {
  const ScratchFolder folder;
  std::vector<Problem> problems;
  const Plan plan = make_plan(*parse_json(recipe(), "hot.json", problems), "hot.json", folder.path());
  RunOutcome outcome;
  outcome.out = folder.path();
  outcome.stages.push_back({.id = "bed", .kind = "simulate"});
  outcome.stages[0].record.emplace(), outcome.stages[0].cost.emplace();
  outcome.stages[0].cost->timings = Json{{"simulation_cpu_seconds", 3.0}, {"measuring_cpu_seconds", 1.0}};
  std::filesystem::create_directory(folder / "bed");
  const auto said = [&](double within, double spread, const std::string& asked) {
    write_text(folder / "bed/observables.json",
               dump(Json{{"temperature_x", {{"value", 0.5}, {"within", within}, {"spread", spread}}}, {"events", 10}}));
    const Json record{
        {"asked", asked},
        {"stages",
         Json::array(
             {Json{{"id", "bed"}, {"length", 40.0}, {"beds", 4}, {"stated_error", 0.0123}, {"cpu_seconds", 90.0}}})}};
    testing::internal::CaptureStderr();
    {
      Console console(Console::Level::normal);
      say_reached(plan, record, outcome, console);
    }
    return testing::internal::GetCapturedStderr();
  };
  const std::string line = "bed: stated error of T_x: 3.2 % (expected 1.2 %). Processor time: 3.0 s (expected 90 s)\n";
  EXPECT_EQ(said(0.01, 0.02, "2 %"), line);
  EXPECT_EQ(said(0.0324738, 0.01, "5 %"), line);
  EXPECT_EQ(said(0.01, 0.02, "30 s"), line) << "a time is no error that could be missed";
  // 3.2474 times 1 %: 10.5 times as many beds, 42.2 of them.
  EXPECT_EQ(said(0.01, 0.02, "1 %"),
            line +
                "warning: bed: the stated error of T_x is 3.2 %, more than the wanted 1 %: these beds differ by more "
                "than those of the pilot. About 11 times as many beds would reach it: set \"replicas\" to 43\n");
  outcome.stages[0].record.reset();
  EXPECT_EQ(said(0.01, 0.02, "1 %"), "") << "it has not run";
}

// Of every tenth frame, (3.1/2)^2 as many reach 2 %: every fourth.
TEST(ReachedByFrames, IsSaidWithWhatWouldReachTheError) {
  const auto said = [](const std::string& asked, int stride, bool possible) {
    const ReachedByFrames reached = reached_by_frames(
        0.031, Json{{"asked", asked},
                    {"frames", {{"stride", stride}, {"measured", 40}, {"of", 400}, {"possible", possible}}}});
    EXPECT_EQ(reached.message, "statistical error of T: 3.1 %, from 40 of 400 frames");
    return reached.warning;
  };
  const std::string missed = "the statistical error of T is 3.1 %, more than the wanted 2 %: ";
  EXPECT_EQ(said("30 s", 10, true), "");
  EXPECT_EQ(said("2.6 %", 10, true), "") << "within the uncertainty of an error of 16 frames, a fifth";
  EXPECT_EQ(said("2 %", 10, true), missed +
                                       "its first estimate, from a few frames, was too small. More frames reduce it: "
                                       "--set /stages/extract/stride=4 in place of --budget");
  EXPECT_EQ(said("2 %", 1, true), missed +
                                      "successive frames are not independent, which the pilot run of frames far apart "
                                      "does not show. All frames are measured; a longer film reduces the error");
  EXPECT_EQ(said("2 %", 1, false), "") << "this was said before the run";
}

// A shipped figure, of which only the pilot runs.
TEST(BudgetOfAReproduction, ChoosesForTheBedOfTheFigure) {
  const ScratchFolder folder;
  const auto reproduce = [&](const char* budget) {
    return run_shakebed({"reproduce", "brey-2001", "--preset", "quick", "--budget", budget, "--dry-run", "--out", "o"},
                        folder.path());
  };
  const ProgramResult ran = reproduce("50 %");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("bed: --budget \"50 %\" chooses \"measure\": "));
  EXPECT_THAT(ran.out, HasSubstr("bed: runs: it has not run yet"));
  EXPECT_FALSE(std::filesystem::exists(folder / "o/bed"));
  EXPECT_EQ(reproduce("3 kg").exit_code, 2);
}

// ------------------------------------------------------------------------------------------------ the bed

// 40 disks of 3 mm at 20 Hz: sqrt(D/g) is 17.487 ms.
std::unique_ptr<Stage> bed_stage(LoneStage& lone) {
  return lone.read(R"({"disks": {"count": 40, "diameter": "3 mm", "restitution": 0.9, "contact_duration": "1 us"},
    "gravity": "9.81 m/s^2", "box": {"width": "30 mm"},
    "floor": {"motion": "sinusoidal", "gamma": 4, "frequency": "20 Hz", "restitution": 0.9},
    "settle": "9 s", "measure": "2 s"})");
}

TEST(BudgetOfABed, ChangesItsTimeItsReplicasAndItsContactDuration) {
  LoneStage lone(*find_stage("simulate"));
  const std::unique_ptr<Stage> stage = bed_stage(lone);
  const Scalable& bed = *stage->scalable();
  EXPECT_EQ(bed.changes({1.5, 6, 0}), (Scalable::Changes{{"/measure", "1.5 s"}, {"/replicas", 6}}));
  EXPECT_EQ(bed.limits().fewest_beds, 4U);
  EXPECT_TRUE(bed.limits().even_beds);
  EXPECT_DOUBLE_EQ(bed.limits().settling, 9);
  EXPECT_NEAR(bed.limits().shortest, 16 / 20.0, 1e-12) << "periods";
  EXPECT_NEAR(bed.limits().pilot, 16 / 20.0, 1e-12);
  EXPECT_NEAR(bed.limits().telling, 32 / 20.0, 1e-12);
  // 1 us is 5.7e-5 sqrt(D/g); a tenth of it is allowed, and in place of the hundredth 1e-6.
  EXPECT_EQ(bed.limits().most_refinement, 2);
  const auto contact_duration = [&](int refinement) {
    return parse_quantity(bed.changes({1, 4, refinement}).at(2).second.get<std::string>()).value;
  };
  EXPECT_NEAR(contact_duration(1), 1e-7, 1e-12);
  EXPECT_NEAR(contact_duration(2), 1e-6 * std::sqrt(0.003 / 9.81), 1e-14);
}

TEST(BudgetOfABed, ReadsErrorsRelativeToTheTemperature) {
  LoneStage lone(*find_stage("simulate"));
  const std::unique_ptr<Stage> stage = bed_stage(lone);
  const Json result{{"temperature_x", {{"value", 0.5}, {"within", 0.01}, {"spread", 0.02}, {"std_error", 0.03}}},
                    {"temperature_z", {{"value", 1}}},
                    {"contact_duration_effect", {{"value", 0.004}}},
                    {"events", 5000}};
  const Json timings{{"simulation_cpu_seconds", 3.0}, {"measuring_cpu_seconds", 1.0}, {"measuring_events", 2000.0}};
  const EffortReading reading = stage->scalable()->read({2, 4, 0}, result, timings);
  EXPECT_DOUBLE_EQ(reading.within, 0.02);
  EXPECT_DOUBLE_EQ(reading.spread, 0.04);
  EXPECT_DOUBLE_EQ(reading.systematic, 0.004);
  EXPECT_DOUBLE_EQ(reading.settling, 9);
  EXPECT_DOUBLE_EQ(reading.settling_work.cpu_seconds, 2);
  EXPECT_DOUBLE_EQ(reading.measuring_work.cpu_seconds, 1);
  EXPECT_DOUBLE_EQ(reading.settling_work.events, 3000);
  EXPECT_DOUBLE_EQ(stage->scalable()->read({2, 1, 0}, result, timings).within, 0.06) << "of one bed";
}

TEST(BudgetOfABed, ThatDoesNotMoveSidewaysIsRefused) {
  LoneStage lone(*find_stage("simulate"));
  const std::unique_ptr<Stage> stage = bed_stage(lone);
  const Json still{{"temperature_x", {{"value", 1e-6}}}, {"temperature_z", {{"value", 1}}}};
  EXPECT_THROW(stage->scalable()->read({1, 4, 0}, still, Json::object()), StageError);
}

// A pilot settles no longer than it measures, and keeps no frames. Frames of a recipe must fit into the shortest
// length.
TEST(BudgetOfABed, HasPilotsWithoutFrames) {
  LoneStage lone(*find_stage("simulate"));
  const std::unique_ptr<Stage> stage = bed_stage(lone);
  const Scalable::Changes pilot = stage->scalable()->pilot_changes({1.5, 6, 0});
  ASSERT_EQ(pilot.size(), 4U);
  EXPECT_EQ(pilot[2], (std::pair<std::string, Json>("/settle", "1.5 s")));
  EXPECT_EQ(pilot[3].first, "/frames");
  EXPECT_EQ(pilot[3].second["count"], 0);
  EXPECT_EQ(stage->scalable()->pilot_changes({12, 6, 0})[2].second, "9 s");
  EXPECT_EQ(stage->scalable()->limits().written, 2);
  EXPECT_EQ(stage->scalable()->number(), "T_x");
  EXPECT_EQ(stage->scalable()->systematic_cause(), "the contact duration");
  LoneStage still(*find_stage("simulate"));
  still.reduced = true;
  const auto bath = still.read(R"({"disks": {"count": 20}, "box": {"width": 5}, "settle": 3, "measure": 500,
    "bath": {"kind": "andersen", "temperature": 0.2, "rate": 0.3}})");
  const EffortLimits without = bath->scalable()->limits();
  EXPECT_DOUBLE_EQ(without.shortest, 16 * 4) << "the floor stands still";
  EXPECT_DOUBLE_EQ(without.telling, 32 * 4);
  EXPECT_EQ(without.most_refinement, 0) << "no contact duration";
  EXPECT_FALSE(without.even_beds);
  EXPECT_EQ(without.fewest_beds, 1U);
  EXPECT_EQ(bath->scalable()->changes({70, 2, 0})[0].second, Json(70.0));
}

}  // namespace
}  // namespace shakebed::tests
