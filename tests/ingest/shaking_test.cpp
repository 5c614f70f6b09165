// The shaker's motion as a film's lowest beads show it, beside a frequency that is given: which is used, and what is
// said.
#include "ingest/profile/shaking.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// Eight beads of 20 px on a floor of 6 px amplitude about row 150 that begins a fifth of a turn after its middle.
struct ShakenRow {
  double cycles = 0.13, amplitude = 6, slope = 0, scatter = 0.05;
  std::size_t frames = 200, every = 1;

  [[nodiscard]] std::vector<FrameFindings> film() const {
    std::vector<FrameFindings> found;
    for (std::size_t f = 0; f < frames; f += every) {
      const double turns = cycles * static_cast<double>(f) + 0.2;
      const double floor = 150 - amplitude * std::sin(2 * std::numbers::pi * turns);
      FrameFindings frame;
      frame.report.index = f;
      for (int k = 0; k < 8; ++k) {
        const double x = 20 + 31 * k;
        frame.disks.push_back(
            test::found_at(x, floor + slope * x - 10 + scatter * test::scattered(k, static_cast<int>(f))));
      }
      found.push_back(std::move(frame));
    }
    return found;
  }
};
struct ShakingSeen {
  BedCalibration bed;
  std::vector<std::string> warnings;
  double turns = 0;
};
ShakingSeen shaking_of(const ShakenRow& row, const MeasureOptions& options, BedCalibration bed = {}) {
  const auto frames = row.film();
  Shaking shaking(options);
  bed.floor_slope = row.slope;
  shaking.begin(frames, 20, 260, bed);
  for (const FrameFindings& frame : frames) shaking.add(frame, bed);
  shaking.finish(bed);
  return {bed, shaking.warnings(), shaking.turns_per_frame().value_or(0)};
}
MeasureOptions filmed_at(double rate, double given = 0) {
  MeasureOptions options;
  options.bead_diameter_m = 2e-3, options.frame_rate_hz = rate;
  if (given > 0) options.shaking_frequency_hz = given;
  return options;
}

TEST(ShakingGiven, IsUsedAndDoubtedFromATenthOfATurnOn) {
  BedCalibration on_floor;
  on_floor.floor_given = true;
  // Over 200 frames a tenth of a turn is 0.0005 cycles a frame: 0.05 Hz at 100 frames a second.
  const ShakingSeen little = shaking_of({}, filmed_at(100, 13.04), on_floor);
  EXPECT_TRUE(little.warnings.empty()) << little.warnings.front();
  EXPECT_EQ(little.bed.shaking_frequency_hz, 13.04);
  EXPECT_NEAR(little.turns, 0.1304, 1e-12);
  EXPECT_EQ(little.bed.shaking_frequency_std_error_hz, 0);
  const ShakingSeen more = shaking_of({}, filmed_at(100, 13.06), on_floor);
  ASSERT_EQ(more.warnings.size(), 1U);
  EXPECT_TRUE(test::holds(more.warnings[0], "The lowest beads move at 13")) << more.warnings[0];
  EXPECT_TRUE(test::holds(more.warnings[0], " Hz, but 13.06 Hz was given. The given frequency is used."));
  EXPECT_EQ(more.bed.shaking_frequency_hz, 13.06);
  // At twice the rate all of it is twice as fast.
  EXPECT_TRUE(test::any_holds(shaking_of({}, filmed_at(200, 27)).warnings, "The lowest beads move at 26"));
  EXPECT_TRUE(shaking_of({}, filmed_at(200, 26)).warnings.empty());
}

// What a camera takes for the same: above half the frame rate, and above it.
TEST(ShakingGiven, MayBeAnAliasOfWhatIsSeen) {
  BedCalibration on_floor;
  on_floor.floor_given = true;
  for (const double same : {87.0, 113.0, 187.0, 26.0, 74.0, 39.0, 61.0})
    EXPECT_TRUE(shaking_of({}, filmed_at(100, same), on_floor).warnings.empty()) << same;
  for (const double other : {86.0, 112.0, 52.0, 6.5, 27.0, 40.0})
    EXPECT_EQ(shaking_of({}, filmed_at(100, other), on_floor).warnings.size(), 1U) << other;
}

// The floor is fitted with the frequency that is used. A floor that is given, or that hardly moves, stays.
TEST(ShakingGiven, TellsTheFloorsMotion) {
  const ShakingSeen seen = shaking_of({.slope = 0.05}, filmed_at(100, 13));
  EXPECT_NEAR(seen.bed.floor_px, 150, 0.1);
  EXPECT_NEAR(seen.bed.floor_amplitude_px, 6, 0.05);
  EXPECT_NEAR(seen.bed.floor_phase, 0.2, 2e-3);
  EXPECT_EQ(seen.bed.floor_reference, FloorReference::mean_of_motion);
  EXPECT_GT(seen.bed.floor_std_error_px, 0);
  EXPECT_LT(seen.bed.floor_std_error_px, 0.1);
  BedCalibration given;
  given.floor_given = true, given.floor_px = 160, given.floor_reference = FloorReference::given;
  const ShakingSeen kept = shaking_of({}, filmed_at(100), given);
  EXPECT_EQ(kept.bed.floor_px, 160);
  EXPECT_EQ(kept.bed.floor_amplitude_px, 0);
  EXPECT_EQ(kept.bed.floor_reference, FloorReference::given);
  EXPECT_NEAR(kept.bed.shaking_frequency_hz, 13, 0.01) << "the frequency is found all the same";
  const ShakingSeen resting = shaking_of({.amplitude = 0.39, .scatter = 0.01}, filmed_at(100, 13));
  EXPECT_EQ(resting.bed.floor_amplitude_px, 0) << "less than 2 % of 20 px";
  const ShakingSeen moving = shaking_of({.amplitude = 0.41, .scatter = 0.01}, filmed_at(100, 13));
  EXPECT_NEAR(moving.bed.floor_amplitude_px, 0.41, 0.005);
  EXPECT_EQ(shaking_of({.amplitude = 0.39, .scatter = 0.01}, filmed_at(100)).bed.shaking_frequency_hz, 0);
  EXPECT_NEAR(shaking_of({.amplitude = 0.41, .scatter = 0.01}, filmed_at(100)).bed.shaking_frequency_hz, 13, 0.02);
}

// Frames at one phase of the period, or at two that are half a period apart, show where the floor is then: its motion
// is not known, and this is said once. Three phases tell it.
TEST(ShakingGiven, SaysWhereTheFloorsMotionIsNotSeen) {
  for (const double cycles : {1.0, 0.5}) {
    const ShakingSeen seen = shaking_of({.cycles = cycles}, filmed_at(100, 100 * cycles));
    EXPECT_EQ(seen.bed.floor_amplitude_px, 0) << cycles;
    ASSERT_EQ(seen.warnings.size(), 1U) << cycles;
    EXPECT_TRUE(test::holds(seen.warnings[0], "The motion of the floor could not be determined")) << seen.warnings[0];
  }
  const ShakingSeen three = shaking_of({.cycles = 1 / 3.0}, filmed_at(99, 33));
  EXPECT_NEAR(three.bed.floor_amplitude_px, 6, 0.05);
  EXPECT_NEAR(three.bed.floor_phase, 0.2, 2e-3);
  EXPECT_TRUE(three.warnings.empty());
}

// In pictures at unrelated times no bead is where it was: a period among them is none, unless the frequency is given.
TEST(ShakingGiven, IsNeededForPicturesThatAreNoFilm) {
  std::vector<FrameFindings> frames = ShakenRow{}.film();
  for (std::size_t f = 0; f < frames.size(); ++f)
    for (FoundDisk& disk : frames[f].disks) disk.x_px += f % 2 == 0 ? 0 : 13;
  const auto seen = [&](const MeasureOptions& options) {
    Shaking shaking(options);
    BedCalibration bed;
    shaking.begin(frames, 20, 290, bed);
    for (const FrameFindings& frame : frames) shaking.add(frame, bed);
    shaking.finish(bed);
    return bed;
  };
  const BedCalibration alone = seen(filmed_at(100));
  EXPECT_EQ(alone.shaking_frequency_hz, 0);
  EXPECT_TRUE(test::holds(alone.why_no_frequency, "only 0 % of the beads are found again in the next picture"))
      << alone.why_no_frequency;
  EXPECT_EQ(seen(filmed_at(100, 13)).shaking_frequency_hz, 13);
}

}  // namespace
}  // namespace shakebed::ingest
