// When a bed is looked at and at which heights: the rules that the library and the stage `simulate` share.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

#include "sim/measure/measured_bed.hpp"

namespace shakebed::sim {
namespace {

using Problem = MeasureOptions::Problem;

TEST(MeasuredBed, ADurationOfWholePeriodsHoldsThemWhateverTheDivisionRoundsTo) {
  for (int periods = 1; periods <= 500; ++periods) {
    const double period = 1.0 / 3.7;
    const LookPlan plan = plan_looks(period, {.settle = 2.5 * period, .duration = periods * period});
    ASSERT_EQ(plan.schedule.periods, static_cast<std::uint64_t>(periods));
    EXPECT_EQ(plan.schedule.looks(), static_cast<std::uint64_t>(32 * periods));
    EXPECT_DOUBLE_EQ(plan.schedule.settle, 3 * period) << "it begins at phase 0";
    EXPECT_TRUE(MeasureOptions{.duration = periods * period}.problems(period).empty());
  }
}

TEST(MeasuredBed, ABedOnAStillFloorIsLookedAtFourTimesAUnitOfTimeWithinBounds) {
  const auto looks = [](double duration, std::uint64_t frames = 0) {
    return plan_looks(0.0, {.duration = duration, .frames = frames}).schedule.looks();
  };
  EXPECT_EQ(looks(250), 1000U);
  EXPECT_EQ(looks(1), 100U);
  EXPECT_EQ(looks(1e6), 20'000U);
  EXPECT_EQ(looks(1e6, 30'000), 30'000U) << "a look for every frame";
}

TEST(MeasuredBed, FramesVisitEveryPhase) {
  for (const std::uint32_t phases : {1U, 12U, 20U, 32U})
    for (const std::uint64_t frames : {1U, 7U, 37U, 64U, 100U}) {
      const LookPlan plan = plan_looks(0.3, {.duration = 30, .phases = phases, .frames = frames});
      if (plan.frame_stride == 0) continue;
      EXPECT_EQ(std::gcd(plan.frame_stride, std::uint64_t{phases}), 1U);
      EXPECT_LE((frames - 1) * plan.frame_stride, plan.schedule.looks() - 1);
    }
}

TEST(MeasuredBed, FramesAreTakenAtTheNamedPhases) {
  const std::vector<double> named{0.75, 0.25};
  const LookPlan plan = plan_looks(0.3, {.duration = 30, .phases = 8, .frames = 50, .frame_phases = named});
  EXPECT_EQ(plan.possible_frames(), 200U);
  EXPECT_EQ(plan_looks(0.3, {.duration = 30, .phases = 8, .frames = 50}).possible_frames(), 800U) << "at all phases";
  std::array<int, 8> taken{};
  for (std::uint64_t look = 0; look < plan.schedule.looks(); ++look) taken[look % 8] += plan.takes_frame(look);
  EXPECT_EQ(taken, (std::array<int, 8>{0, 0, 25, 0, 0, 0, 25, 0}));
  for (const std::vector<double>& wrong : std::vector<std::vector<double>>{{0.3}, {0.25, 0.25}, {1}, {-0.25}})
    EXPECT_EQ((MeasureOptions{.duration = 30, .phases = 8, .frame_phases = wrong}.problems(0.3)),
              std::vector{Problem::frame_phases});
  EXPECT_EQ((MeasureOptions{.duration = 30, .frame_phases = {0}}.problems(0)), std::vector{Problem::frame_phases})
      << "the floor stands still";
  EXPECT_EQ((MeasureOptions{.duration = 30, .phases = 8, .frames = 101, .frame_phases = {0}}.problems(0.3)),
            std::vector{Problem::too_many_frames});
}

TEST(MeasuredBed, WhatCannotBeMeasuredIsNamed) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Problem> all{Problem::settle, Problem::duration, Problem::phases, Problem::spacing,
                                 Problem::kernel};
  EXPECT_EQ((MeasureOptions{.settle = -1, .duration = 0, .phases = 0, .spacing = none, .kernel = {}}.problems(0)), all);
  EXPECT_EQ((MeasureOptions{.duration = 1, .spacing = 0}.problems(0)), std::vector{Problem::spacing});
  EXPECT_EQ((MeasureOptions{.duration = 0.999}.problems(1)), std::vector{Problem::shorter_than_a_period});
  EXPECT_TRUE((MeasureOptions{.duration = 1}.problems(1).empty()));
  EXPECT_EQ((MeasureOptions{.duration = 1e13}.problems(1)), std::vector{Problem::too_many_periods});
  EXPECT_EQ((MeasureOptions{.duration = 1, .frames = 33}.problems(1)), std::vector{Problem::too_many_frames});
  Scene scene;
  scene.box.floor = SinusoidalFloor{.amplitude = 1, .frequency = 0.5};
  const std::vector<std::string> said = MeasureOptions{.duration = 1}.validate(scene);
  ASSERT_EQ(said.size(), 1U);
  EXPECT_EQ(said.front(), "duration is 1, shorter than one period of the floor, 2; measure at least one period");
}

TEST(MeasuredBed, SaysWhatCannotBeMeasuredWithItsNumbers) {
  Scene shaken, still;
  shaken.box.floor = SinusoidalFloor{.amplitude = 1, .frequency = 0.5};
  const auto said = [](const Scene& scene, const MeasureOptions& options) { return options.validate(scene); };
  using Words = std::vector<std::string>;
  EXPECT_EQ(
      said(still, {.settle = -1.5, .duration = 0, .phases = 0, .spacing = -0.25, .kernel = {}}),
      (Words{"settle is -1.5; it must be 0 or more", "duration is 0; it must be above 0",
             "phases is 0; the bed must be sampled at least once per period", "spacing is -0.25; it must be above 0",
             "the density is measured through a kernel: give a kernel other than none, with a finite width above "
             "0"}));
  EXPECT_EQ(said(shaken, {.duration = 1e13}),
            Words{"duration is 5e+12 periods of the floor; at most 1e+12 periods can be measured"});
  EXPECT_EQ(said(shaken, {.duration = 6, .phases = 4, .frames = 13}),
            Words{"13 frames are to be stored, but the bed is sampled only 12 times; measure longer or store fewer "
                  "frames"})
      << "three periods of four samples";
  EXPECT_EQ(
      said(still, {.duration = 6, .phases = 4, .frame_phases = {0.25}}),
      Words{"frames are wanted at phases at which the bed is not sampled; give different multiples of 1/4, from 0 "
            "to below 1, and a floor that shakes"});
  EXPECT_EQ(to_string(MeasureStatus::ok), "ok");
  EXPECT_EQ(to_string(MeasureStatus::stopped), "stopped");
  EXPECT_EQ(to_string(MeasureStatus::bad_input), "bad input");
  EXPECT_EQ(to_string(MeasureStatus::precision_lost), "precision lost");
}

TEST(MeasuredBed, HasThePeriodOfItsFloor) {
  Scene scene;
  EXPECT_EQ(floor_period(scene), 0);
  scene.box.floor = SinusoidalFloor{.amplitude = 1, .frequency = 0.4};
  EXPECT_EQ(floor_period(scene), 2.5);
  scene.box.floor = TabulatedFloor{.period = 1.7, .heights = {0, 1, 0.5}};
  EXPECT_EQ(floor_period(scene), 1.7);
}

TEST(MeasuredBed, HeightsReachBelowTheFloorAndAboveTheLoosestBed) {
  Scene scene;
  scene.disks.species = {{.count = 100}};
  scene.box.width = 10;
  scene.box.floor = SinusoidalFloor{.amplitude = 2, .frequency = 0.5};
  const HeightGrid still = profile_heights(scene, {});
  EXPECT_EQ(still.lowest, -6.0) << "2 D of amplitude, 6 standard deviations of the kernel, 1 D";
  EXPECT_NEAR(still.height(still.points - 1), 6 * 10 + 30, 0.5);
  scene.bath = LangevinBath{.temperature = 3, .rate = 1, .interval = 0.1};
  EXPECT_NEAR(profile_heights(scene, {}).height(profile_heights(scene, {}).points - 1), 90 + 25 * 3, 0.5);
  scene.bath = ThermalFloor{.temperature = 4};
  EXPECT_NEAR(profile_heights(scene, {}).height(profile_heights(scene, {}).points - 1), 90 + 25 * 4, 0.5);
  const HeightGrid hot = profile_heights(scene, {}, 5);
  EXPECT_NEAR(hot.height(hot.points - 1), 90 + 25 * 5, 0.5) << "the hotter of bath and annealing";
}

TEST(MeasuredBed, FilledHeightsLeaveOutTheKernelsTail) {
  const Profile profile{
      .height = {0, 1, 2, 3, 4}, .number_density = {0, 1e-13, 0.4, 0, 2e-12}, .std_error = {}, .area_fraction = {}};
  EXPECT_EQ(filled_heights(profile).first, 2U);
  EXPECT_EQ(filled_heights(profile).last, 5U);
  const Profile empty{.height = {0, 1}, .number_density = {0, 0}, .std_error = {}, .area_fraction = {}};
  EXPECT_EQ(filled_heights(empty).first, filled_heights(empty).last);
}

}  // namespace
}  // namespace shakebed::sim
