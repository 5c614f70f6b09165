#include "fit/map/jump_height.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace shakebed::fit {
namespace {

constexpr double pi = std::numbers::pi;

TEST(JumpHeight, MatchesTheTableOfPhysics) {
  struct Row {
    double gamma, relative_max, above_launch, above_mean_floor, above_highest_floor;
  };
  for (const Row& row : {Row{2, 2.53152, 1.5, 2.5, 0.5}, Row{3, 7.10875, 4, 5, 2}, Row{4, 12.36233, 7.5, 8.5, 4.5}}) {
    EXPECT_NEAR(jump_height(JumpHeight::relative_max, row.gamma).value, row.relative_max, 5.1e-6);
    EXPECT_NEAR(jump_height(JumpHeight::above_launch, row.gamma).value, row.above_launch, 1e-12);
    EXPECT_NEAR(jump_height(JumpHeight::above_mean_floor, row.gamma).value, row.above_mean_floor, 1e-12);
    EXPECT_NEAR(jump_height(JumpHeight::above_highest_floor, row.gamma).value, row.above_highest_floor, 1e-12);
  }
}

// Near Gamma = 1 the jump is far lower than the floor's stroke. In s^2 = Gamma^2 - 1 the greatest gap is
// 9/8 s^4 (1 - 9 s^2/10 + ...); a wave that is a sine to 1e-14 but goes the general way has to find the same.
TEST(JumpHeight, KeepsItsDigitsWhereTheBallHardlyLeaves) {
  for (double excess = 1e-15; excess < 2e-5; excess *= 10) {
    const double gamma = 1 + excess, s2 = (gamma - 1) * (gamma + 1);
    EXPECT_NEAR(jump_height(JumpHeight::relative_max, gamma).value / (1.125 * s2 * s2 * (1 - 0.9 * s2)), 1,
                1e-14 + s2 * s2)
        << excess;
    EXPECT_DOUBLE_EQ(jump_height(JumpHeight::above_launch, gamma).value, s2 / 2);
    EXPECT_DOUBLE_EQ(jump_height(JumpHeight::above_highest_floor, gamma).value, (gamma - 1) * (gamma - 1) / 2);
    for (const JumpHeight kind : jump_heights) {
      const double height = jump_height(kind, gamma).value;
      EXPECT_NEAR(gamma_for_jump_height(kind, height).value, gamma, 4.5e-16) << to_string(kind) << " " << excess;
    }
  }
}

// The closed form of the sine against the search that serves every wave.
TEST(JumpHeight, OfASineIsWhatEveryWaveIsSearchedFor) {
  const WaveForm nearly = WaveForm::series("nearly a sine", {{1, 1.0, 0.0}, {2, 1e-15, 0.0}});
  ASSERT_FALSE(nearly.pure_sine());
  for (double excess = 1e-6; excess < 40; excess *= 1.1) {
    for (const JumpHeight kind : jump_heights) {
      const double sine = jump_height(kind, 1 + excess).value, searched = jump_height(kind, 1 + excess, nearly).value;
      const double rounding = kind == JumpHeight::above_highest_floor ? 1e-15 / excess : 1e-15;
      EXPECT_NEAR(searched / sine, 1, 1e-9 + rounding / excess) << to_string(kind) << " " << excess;
    }
  }
}

// A harmonic alone is a sine that is k times as fast: lengths in g over the square of the frequency are k^2 times less.
TEST(JumpHeight, OfAHarmonicAloneIsThatOfAFasterSine) {
  for (const int k : {2, 3}) {
    const WaveForm harmonic = WaveForm::series("harmonic", {{k, 1.0, 0.0}});
    for (double excess = 1e-4; excess < 10; excess *= 1.7) {
      for (const JumpHeight kind : jump_heights) {
        const double sine = jump_height(kind, 1 + excess).value;
        EXPECT_NEAR(jump_height(kind, 1 + excess, harmonic).value * k * k / sine, 1, 1e-9 + 1e-15 / (excess * excess))
            << to_string(kind) << " " << excess;
      }
    }
  }
}

TEST(JumpHeight, IsNothingWhileTheFloorHoldsTheBall) {
  for (const JumpHeight kind : jump_heights) {
    EXPECT_EQ(jump_height(kind, 0.0).value, 0.0);
    EXPECT_EQ(jump_height(kind, 1.0).value, 0.0);
    EXPECT_EQ(jump_height(kind, -1.0).status, ValueStatus::invalid_argument);
  }
}

// A wave that is a sine to 1e-14 goes the general way back, by halving.
TEST(JumpHeight, IsInvertedForEveryWaveAsForASine) {
  const WaveForm nearly = WaveForm::series("nearly a sine", {{1, 1.0, 0.0}, {2, 1e-15, 0.0}});
  for (const JumpHeight kind : jump_heights)
    for (const double gamma : {1.2, 2.0, 5.0})
      EXPECT_NEAR(gamma_for_jump_height(kind, jump_height(kind, gamma).value, nearly).value / gamma, 1, 1e-9)
          << to_string(kind) << " " << gamma;
  // A ball that does not leave is on a floor of Gamma = 1, and not below the floor's mean position.
  for (const WaveForm& wave : {WaveForm::sine(), nearly}) {
    for (const JumpHeight kind :
         {JumpHeight::relative_max, JumpHeight::above_launch, JumpHeight::above_highest_floor}) {
      EXPECT_EQ(gamma_for_jump_height(kind, 0, wave).status, ValueStatus::ok) << to_string(kind);
      EXPECT_NEAR(gamma_for_jump_height(kind, 0, wave).value, 1, 1e-15) << to_string(kind);
    }
    EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_mean_floor, 0, wave).status, ValueStatus::outside_range);
  }
  EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_mean_floor, 0.5, nearly).status, ValueStatus::outside_range);
}

TEST(JumpHeight, IsInverted) {
  for (const JumpHeight kind : jump_heights) {
    for (const double gamma : {1.2, 2.0, 4.0, 10.0}) {
      const double height = jump_height(kind, gamma).value;
      EXPECT_NEAR(gamma_for_jump_height(kind, height).value / gamma, 1.0, 1e-9) << to_string(kind) << " " << gamma;
    }
  }
  for (const WaveForm& wave : {WaveForm::sine(), WaveForm::series("harmonic", {{2, 1.0, 0.0}})}) {
    for (const double height : {-0.1, HUGE_VAL, std::nan("")})
      EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_launch, height, wave).status, ValueStatus::invalid_argument);
  }
  EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_launch, 1e13).status, ValueStatus::outside_range);
  EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_launch, 1, WaveForm::series("flat", {})).status,
            ValueStatus::invalid_argument);
  // Above the mean floor the ball is at least Gamma = 1 high as soon as it leaves.
  EXPECT_EQ(gamma_for_jump_height(JumpHeight::above_mean_floor, 0.5).status, ValueStatus::outside_range);
}

// Floors that let a ball go two to four times a period. Each flight is followed in small steps: the highest of all
// counts, which is not the same flight for every kind of height, nor the first.
TEST(JumpHeight, IsTheHighestOfAllLaunchesOfAPeriod) {
  using Series = std::vector<WaveForm::Harmonic>;
  for (const Series& harmonics : {Series{{1, 1.0, 0.0}, {2, 0.0, 0.5}}, Series{{1, 1.0, 0.0}, {3, 0.3, 0.0}},
                                  Series{{1, 1.0, 0.0}, {4, 0.1, 0.05}}}) {
    const WaveForm wave = WaveForm::series("several", harmonics);
    for (const double gamma : {2.0, 4.0}) {
      const auto is_held = [&](double phase) { return 1 + gamma * wave.acceleration(phase) > 0; };
      std::array<double, 4> highest{};
      int launches = 0;
      constexpr int steps = 4000;
      for (int i = 0; i < steps; ++i) {
        double held = 2 * pi * i / steps, free = 2 * pi * (i + 1) / steps;
        if (!is_held(held) || is_held(free)) continue;
        for (int k = 0; k < 50; ++k) (is_held(0.5 * (held + free)) ? held : free) = 0.5 * (held + free);
        ++launches;
        const double from = gamma * wave.position(free), velocity = gamma * wave.velocity(free);
        double gap = 0, greatest = 0;
        for (double t = 1e-3; gap >= 0; t += 1e-3) {
          gap = from + velocity * t - 0.5 * t * t - gamma * wave.position(free + t);
          greatest = std::max(greatest, gap);
        }
        const double rise = velocity > 0 ? 0.5 * velocity * velocity : 0;
        const double heights[] = {greatest, rise, from + rise, from + rise - gamma * wave.highest()};
        for (std::size_t k = 0; k < 4; ++k) highest[k] = std::max(highest[k], heights[k]);
      }
      EXPECT_GT(launches, 1);
      for (std::size_t k = 0; k < 4; ++k)
        EXPECT_NEAR(jump_height(jump_heights[k], gamma, wave).value, highest[k], 2e-6)
            << to_string(jump_heights[k]) << " " << gamma << " of " << harmonics[1].order;
    }
  }
}

TEST(WaveForm, IsScaledToItsPeakAcceleration) {
  const WaveForm sine = WaveForm::series("big", {{1, 7.0, 0.0}});
  const WaveForm cosine = WaveForm::series("turned", {{1, 0.0, 3.0}});
  for (const JumpHeight kind : jump_heights) {
    EXPECT_NEAR(jump_height(kind, 3.0, sine).value, jump_height(kind, 3.0).value, 1e-12);
    EXPECT_NEAR(jump_height(kind, 3.0, cosine).value, jump_height(kind, 3.0).value, 1e-9);
  }
  const WaveForm mixed = WaveForm::series("mixed", {{1, 1.0, 0.0}, {2, 0.2, 0.1}});
  double peak = 0.0;
  for (int i = 0; i < 100000; ++i) peak = std::max(peak, std::abs(mixed.acceleration(2.0 * pi * i / 100000)));
  EXPECT_NEAR(peak, 1.0, 1e-8);
  EXPECT_EQ(WaveForm::series("flat", {}).status(), ValueStatus::invalid_argument);
  EXPECT_EQ(WaveForm::series("flat", {{1, 0.0, 0.0}}).status(), ValueStatus::invalid_argument);
  EXPECT_EQ(jump_height(JumpHeight::relative_max, 3.0, WaveForm::series("flat", {})).status,
            ValueStatus::invalid_argument);
}

// Position, velocity, acceleration and jerk by differences of one another; the bounds hold, and the highest point is
// that of a fine scan.
TEST(WaveForm, HasTheDerivativesOfItsPosition) {
  const WaveForm wave = WaveForm::series("mixed", {{1, 1.0, 0.3}, {2, 0.2, -0.1}, {5, -0.01, 0.02}});
  EXPECT_EQ(wave.highest_order(), 5);
  EXPECT_FALSE(wave.pure_sine());
  double highest = -1e9, jerk = 0, snap = 0;
  const double h = 1e-4;
  for (double phase = 0; phase < 2 * pi; phase += 1e-3) {
    const auto slope = [&](double (WaveForm::*of)(double) const) {
      return ((wave.*of)(phase + h) - (wave.*of)(phase - h)) / (2 * h);
    };
    EXPECT_NEAR(wave.velocity(phase), slope(&WaveForm::position), 1e-6);
    EXPECT_NEAR(wave.acceleration(phase), slope(&WaveForm::velocity), 1e-6);
    EXPECT_NEAR(wave.jerk(phase), slope(&WaveForm::acceleration), 1e-5);
    highest = std::max(highest, wave.position(phase));
    jerk = std::max(jerk, std::abs(wave.jerk(phase)));
    snap = std::max(snap, std::abs(slope(&WaveForm::jerk)));
    const double t = 0.3, start = wave.position(phase), by = wave.velocity(phase), twice = wave.acceleration(phase);
    EXPECT_NEAR(wave.deviation(phase, t), wave.position(phase + t) - start - by * t - 0.5 * twice * t * t, 1e-14);
    EXPECT_NEAR(wave.deviation_rate(phase, t), wave.velocity(phase + t) - by - twice * t, 1e-14);
  }
  EXPECT_NEAR(wave.highest(), highest, 1e-6);
  EXPECT_GE(wave.largest_jerk(), jerk);
  EXPECT_LT(wave.largest_jerk(), 2 * jerk);
  EXPECT_GE(wave.largest_snap(), snap);
  EXPECT_LT(wave.largest_snap(), 2 * snap);
  EXPECT_EQ(WaveForm::series("none", {{0, 1, 0}}).status(), ValueStatus::invalid_argument);
  EXPECT_EQ(WaveForm::series("none", {{1, std::nan(""), 0}}).status(), ValueStatus::invalid_argument);
  EXPECT_EQ(WaveForm::series("none", {{1, 0, INFINITY}}).status(), ValueStatus::invalid_argument);
}

// Of three points a period's first harmonic is known, of fewer none; of 2 k + 1 points the k-th. More orders than were
// asked for are left out.
TEST(WaveForm, OfFewSamplesHasTheHarmonicsThatTheyTell) {
  const auto sampled = [](std::size_t count, int orders) {
    std::vector<double> positions;
    for (std::size_t i = 0; i < count; ++i) {
      const double phase = 2 * pi * static_cast<double>(i) / static_cast<double>(count);
      positions.push_back(std::sin(phase) + 0.1 * std::sin(2 * phase));
    }
    return WaveForm::samples("few", positions, orders);
  };
  EXPECT_EQ(sampled(2, 8).status(), ValueStatus::invalid_argument);
  EXPECT_EQ(sampled(3, 8).highest_order(), 1);
  EXPECT_EQ(sampled(4, 8).highest_order(), 1);
  EXPECT_EQ(sampled(5, 8).highest_order(), 2);
  EXPECT_EQ(sampled(9, 8).highest_order(), 4);
  EXPECT_EQ(sampled(64, 1).highest_order(), 1);
  const WaveForm same = WaveForm::series("same", {{1, 1, 0}, {2, 0.1, 0}});
  for (const double phase : {0.1, 1.0, 2.7, 5.0}) {
    EXPECT_NEAR(sampled(5, 8).position(phase), same.position(phase), 1e-12);
    EXPECT_NEAR(sampled(64, 1).position(phase), std::sin(phase), 1e-12);
  }
}

TEST(WaveForm, FromSamplesIsTheSampledMotion) {
  std::vector<double> positions;
  for (int i = 0; i < 64; ++i)
    positions.push_back(0.3 + 2.0 * std::sin(2.0 * pi * i / 64) + 0.2 * std::cos(6.0 * pi * i / 64));
  const WaveForm wave = WaveForm::samples("table", positions, 8);
  const WaveForm same = WaveForm::series("same", {{1, 2.0, 0.0}, {3, 0.0, 0.2}});
  for (double phase = 0.0; phase < 6.3; phase += 0.1) EXPECT_NEAR(wave.position(phase), same.position(phase), 1e-9);
}

// A flight computed with small steps, independently of the event finder.
double stepped_flight_time(double gamma, const WaveForm& wave, double phase) {
  const double dt = 1e-5;
  const double p0 = gamma * wave.position(phase);
  const double v0 = gamma * wave.velocity(phase);
  for (double t = 0.05;; t += dt) {
    if (p0 + v0 * t - 0.5 * t * t < gamma * wave.position(phase + t)) return t;
  }
}

TEST(Bounce, DeadBallFliesAsSteppedIntegrationSays) {
  // Up to sqrt(1 + pi^2) = 3.297 the ball lands while the floor still holds it, and waits for the next launch.
  for (const double gamma : {1.5, 2.0, 3.0, 3.29}) {
    const BounceStatistics s = bounce(gamma, {.restitution = 0.0, .transient = 20, .flights = 10});
    ASSERT_EQ(s.status, ValueStatus::ok);
    EXPECT_EQ(s.period, 1);
    EXPECT_NEAR(s.launch_phases.back(), std::asin(1.0 / gamma), 1e-9);
    EXPECT_NEAR(s.flight_times.back(), stepped_flight_time(gamma, WaveForm::sine(), std::asin(1.0 / gamma)), 2e-5);
    for (std::size_t i = 0; i < jump_heights.size(); ++i) {
      EXPECT_NEAR(s.mean_height[i], jump_height(jump_heights[i], gamma).value, 1e-8);
    }
  }
}

// A dead ball that jumps once a period flies for a part of it and rests for the remainder. All its jumps are alike.
TEST(Bounce, DeadBallRestsForTheRemainderOfThePeriod) {
  for (const double gamma : {1.05, 1.5, 2.0, 3.0}) {
    const BounceStatistics s = bounce(gamma, {.restitution = 0.0, .transient = 20, .flights = 10});
    ASSERT_EQ(s.flight_times.size(), 10U);
    ASSERT_EQ(s.launch_phases.size(), 10U);
    EXPECT_NEAR(s.mean_flight, s.flight_times.back() / (2 * pi), 1e-9);
    EXPECT_NEAR(s.resting_fraction, 1 - s.mean_flight, 1e-8) << gamma;
    for (std::size_t i = 0; i < jump_heights.size(); ++i) EXPECT_NEAR(s.greatest_height[i], s.mean_height[i], 1e-8);
  }
}

// Heights are weighed by the time of their flights, and their greatest one is that of one of the flights. In the orbit
// of two flights beyond the doubling the apex above the launch follows from each flight's own velocity.
TEST(Bounce, WeighsItsHeightsByTheTimeOfFlight) {
  const double gamma = 4.0;
  const BounceStatistics s = bounce(gamma, {.restitution = 0.0, .transient = 5000, .flights = 256});
  ASSERT_EQ(s.period, 2);
  double weighted = 0, time = 0, greatest = 0, least = 1e9;
  for (std::size_t i = 0; i < s.flight_times.size(); ++i) {
    const double velocity = gamma * std::cos(s.launch_phases[i]), rise = 0.5 * velocity * velocity;
    weighted += s.flight_times[i] * rise, time += s.flight_times[i];
    greatest = std::max(greatest, rise), least = std::min(least, rise);
  }
  EXPECT_GT(greatest, 1.1 * least);
  EXPECT_NEAR(s.mean_height[1], weighted / time, 1e-7);
  EXPECT_NEAR(s.greatest_height[1], greatest, 1e-7);
  EXPECT_NEAR(s.mean_flight, time / 256 / (2 * pi), 1e-9);
}

// The second mode flies for two periods, from twice the Gamma of the first; of a dead ball the first begins at pi and
// doubles at sqrt(4 + pi^2).
TEST(Bounce, HasModesOfSeveralPeriods) {
  EXPECT_NEAR(period_one_mode(1, 0).exists_from, pi, 1e-14);
  EXPECT_NEAR(period_one_mode(1, 0).stable_to, std::sqrt(4 + pi * pi), 1e-14);
  for (const double e : {0.0, 0.3, 0.8}) {
    const ModeRange first = period_one_mode(1, e), third = period_one_mode(3, e);
    EXPECT_NEAR(third.exists_from, 3 * first.exists_from, 1e-13);
    EXPECT_NEAR(third.stable_to * third.stable_to - first.stable_to * first.stable_to,
                8 * first.exists_from * first.exists_from, 1e-11);
  }
  const ModeRange second = period_one_mode(2, 0.5);
  const double gamma = 0.5 * (second.exists_from + second.stable_to);
  BounceOptions options{.restitution = 0.5, .transient = 2000, .flights = 64};
  options.initial_phase = std::acos(second.exists_from / gamma) + 1e-3;
  options.initial_velocity = 4 * pi * 0.5 / 1.5;
  const BounceStatistics s = bounce(gamma, options);
  EXPECT_EQ(s.period, 1);
  EXPECT_NEAR(s.mean_flight, 2, 1e-6);
  EXPECT_EQ(s.resting_fraction, 0);
}

TEST(Bounce, RefusesWhatIsNoBall) {
  const auto status = [](double gamma, const BounceOptions& options) { return bounce(gamma, options).status; };
  EXPECT_EQ(status(2, {.flights = 1}), ValueStatus::ok);
  EXPECT_EQ(status(2, {.transient = 0, .flights = 1}), ValueStatus::ok);
  EXPECT_EQ(status(2, {.flights = 0}), ValueStatus::invalid_argument);
  EXPECT_EQ(status(2, {.transient = -1}), ValueStatus::invalid_argument);
  EXPECT_EQ(status(-0.1, {}), ValueStatus::invalid_argument);
  EXPECT_EQ(status(std::nan(""), {}), ValueStatus::invalid_argument);
  EXPECT_EQ(status(2, {.initial_phase = INFINITY}), ValueStatus::invalid_argument);
  EXPECT_EQ(status(2, {.initial_velocity = -1}), ValueStatus::invalid_argument);
  EXPECT_EQ(bounce(2, {}, WaveForm::series("flat", {})).status, ValueStatus::invalid_argument);
}

TEST(Bounce, OnAHarmonicAloneFliesAsOnAFasterSine) {
  for (const int k : {2, 3}) {
    const WaveForm harmonic = WaveForm::series("harmonic", {{k, 1.0, 0.0}});
    for (const double gamma : {1.02, 1.2, 2.0, 3.0}) {
      const BounceOptions options{.restitution = 0.0, .transient = 20, .flights = 10};
      const double on_sine = bounce(gamma, options).flight_times.back();
      EXPECT_NEAR(bounce(gamma, options, harmonic).flight_times.back() * k / on_sine, 1, 1e-7) << k << ' ' << gamma;
    }
  }
}

TEST(Bounce, DeadBallBouncesOnWithoutRestUpToTheDoubling) {
  // From 3.297 on it lands where the floor falls away and leaves at once: flights of one period from cos(phase) =
  // pi/Gamma.
  for (const double gamma : {3.35, 3.5, 3.6}) {
    const BounceStatistics s = bounce(gamma, {.restitution = 0.0, .transient = 500, .flights = 200});
    EXPECT_EQ(s.period, 1);
    EXPECT_NEAR(s.launch_phases.back(), std::acos(pi / gamma), 1e-9);
    EXPECT_NEAR(s.flight_times.back(), 2.0 * pi, 1e-9);
    EXPECT_NEAR(s.resting_fraction, 0.0, 1e-9);
  }
}

TEST(Bounce, DeadBallDoublesItsPeriodAtTheKnownGamma) {
  const double doubling = std::sqrt(4.0 + pi * pi);  // 3.72419
  EXPECT_NEAR(doubling, 3.72419, 5e-6);
  EXPECT_EQ(bounce(doubling - 0.005, {.restitution = 0.0, .transient = 5000, .flights = 256}).period, 1);
  EXPECT_EQ(bounce(doubling + 0.005, {.restitution = 0.0, .transient = 5000, .flights = 256}).period, 2);
}

TEST(Bounce, InelasticBallKeepsPeriodOneInItsRange) {
  const ModeRange range = period_one_mode(1, 0.5);
  EXPECT_NEAR(range.exists_from, 1.04720, 5e-6);
  EXPECT_NEAR(range.stable_to, 1.52682, 5e-6);
  // Started on the mode, the ball stays while the mode is stable: flights of one period, launched at the phase where
  // cos(phase) = n pi (1 - e)/((1 + e) Gamma).
  const auto period_near = [&](double gamma) {
    BounceOptions options{.restitution = 0.5, .transient = 4000, .flights = 256};
    options.initial_phase = std::acos(std::min(1.0, range.exists_from / gamma)) + 1e-3;  // a nudge to grow or die
    options.initial_velocity = 2.0 * pi * 0.5 / 1.5;  // e/(1 + e) of the relative velocity 2 pi
    return bounce(gamma, options);
  };
  for (const double gamma : {1.10, 1.25, 1.40, 1.52}) {
    const BounceStatistics s = period_near(gamma);
    EXPECT_EQ(s.period, 1) << gamma;
    EXPECT_NEAR(s.mean_flight, 1.0, 1e-6) << gamma;
  }
  EXPECT_NE(period_near(1.54).period, 1);
}

TEST(Bounce, NearlyElasticBallAndQuietFloorEnd) {
  for (const double e : {0.0, 0.3, 0.9, 0.99}) {
    const BounceStatistics rest = bounce(0.9, {.restitution = e});
    EXPECT_EQ(rest.status, ValueStatus::ok);
    EXPECT_EQ(rest.resting_fraction, 1.0);
    const BounceStatistics moving = bounce(4.0, {.restitution = e, .transient = 300, .flights = 300});
    EXPECT_EQ(moving.status, ValueStatus::ok);
    EXPECT_EQ(moving.flight_times.size(), 300U);
    EXPECT_GT(moving.mean_height[0], 0.0);
    for (const double t : moving.flight_times) EXPECT_GT(t, 0.0);
  }
  EXPECT_EQ(bounce(4.0, {.restitution = 1.0}).status, ValueStatus::invalid_argument);
  EXPECT_EQ(bounce(4.0, {.restitution = -0.1}).status, ValueStatus::invalid_argument);
}

TEST(Bounce, EnergyOfEveryFlightIsKept) {
  // Consecutive launches: the landing velocity relative to the floor times e is the next launch velocity, so the flight
  // times and phases of the map fit together.
  const double gamma = 4.0;
  const double e = 0.8;
  const BounceStatistics s = bounce(gamma, {.restitution = e, .transient = 100, .flights = 200});
  for (std::size_t i = 1; i + 1 < s.flight_times.size(); ++i) {
    const double phase = s.launch_phases[i];
    const double t = s.flight_times[i];
    // From the two positions and the time, the launch velocity in the laboratory ...
    const double velocity = (gamma * std::sin(phase + t) - gamma * std::sin(phase)) / t + 0.5 * t;
    const double impact = velocity - t - gamma * std::cos(phase + t);
    const double t2 = s.flight_times[i + 1];
    const double phase2 = s.launch_phases[i + 1];
    const double velocity2 = (gamma * std::sin(phase2 + t2) - gamma * std::sin(phase2)) / t2 + 0.5 * t2;
    const bool rested = std::abs(std::remainder(phase2 - phase - t, 2.0 * pi)) > 1e-9;
    if (!rested && t2 > 1e-3 && t > 1e-3) {
      EXPECT_NEAR(velocity2 - gamma * std::cos(phase2), -e * impact, 1e-9) << i;
    }
  }
}

}  // namespace
}  // namespace shakebed::fit
