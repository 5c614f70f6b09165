// A shaker's frequency from places in frames: told within its error, and not told where there is none.
#include "ingest/profile/shaking_frequency.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "ingest/profile/floor.hpp"
#include "ingest/profile/shaking.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "sim/engine/simulation.hpp"
#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/shaken_bed.hpp"

namespace shakebed::ingest {
namespace {

std::vector<PlaceInFrame> moving(std::size_t count, double cycles_per_frame, double amplitude, double noise,
                                 std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < count; ++k)
    places.push_back(
        {k, 100 + amplitude * std::sin(2 * std::numbers::pi * (cycles_per_frame * static_cast<double>(k) + 0.3)) +
                noise * normal(random)});
  return places;
}

// Places that wander: each is a share of the one before.
std::vector<PlaceInFrame> wandering(std::size_t count, double share, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<PlaceInFrame> places;
  double at = 0;
  for (std::size_t k = 0; k < count; ++k) {
    at = share * at + std::sqrt(1 - share * share) * normal(random);
    places.push_back({k, at});
  }
  return places;
}

TEST(ShakingFrequency, IsFoundWithinItsError) {
  // White noise: over 200 films the error, in standard errors of it, is a normal deviate. Its mean square is 1 +- 0.1,
  // of which 3.5 sigma are allowed; the neighbourhood of the line adds a tenth. What is stated is that of a bed, which
  // is hypot(1.3, 12/cycles) times as large.
  std::size_t films = 0;
  double square = 0, worst = 0;
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const double frequency = 0.04 + 0.4 * static_cast<double>(seed) / 200;  // next to 1/2 it takes a clearer line
    const FoundFrequency found = find_frequency(moving(200, frequency, 1, 0.5, seed));
    ASSERT_TRUE(found.known) << frequency << ": " << found.why_not;
    const double of_noise = found.std_error / std::hypot(1.3, 12 / (200 * frequency));
    const double error = (found.cycles_per_frame - frequency) / of_noise;
    square += error * error;
    worst = std::max(worst, std::abs(error));
    EXPECT_NEAR(found.amplitude, 1, 0.25);
    ++films;
  }
  square /= static_cast<double>(films);
  EXPECT_GT(square, 0.65);
  EXPECT_LT(square, 1.5);
  EXPECT_LT(worst, 6);
}

TEST(ShakingFrequency, IsFoundWhereFramesAreMissing) {
  std::vector<PlaceInFrame> places = moving(300, 0.2113, 1, 0.3, 7);
  std::erase_if(places,
                [](const PlaceInFrame& one) { return one.frame % 7 == 3 || (one.frame > 100 && one.frame < 130); });
  const FoundFrequency found = find_frequency(places);
  ASSERT_TRUE(found.known) << found.why_not;
  EXPECT_NEAR(found.cycles_per_frame, 0.2113, 5 * found.std_error);
  EXPECT_LT(found.std_error, 1e-4);
}

TEST(ShakingFrequency, IsRefinedByALongFilm) {
  const std::vector<PlaceInFrame> places = moving(20000, 0.0712345, 1, 0.5, 3);
  const FoundFrequency first = find_frequency({places.begin(), places.begin() + 100});
  ASSERT_TRUE(first.known);
  const FoundFrequency all = refine_frequency(places, first);
  EXPECT_LT(all.std_error, 1e-3 * first.std_error);
  EXPECT_NEAR(all.cycles_per_frame, 0.0712345, 5 * all.std_error);
  EXPECT_NEAR(all.phase, 0.3, 0.01);
}

// Around 0.1 with an error of 0.1 cycles a frame: a line at 2.5 errors is found, one at 3.6 is not.
TEST(ShakingFrequency, IsRefinedWithinThreeErrors) {
  FoundFrequency rough;
  rough.known = true, rough.cycles_per_frame = 0.1, rough.std_error = 0.1;
  EXPECT_NEAR(refine_frequency(moving(48, 0.35, 1, 0.01, 3), rough).cycles_per_frame, 0.35, 1e-3);
  EXPECT_LT(refine_frequency(moving(48, 0.46, 1, 0.01, 3), rough).cycles_per_frame, 0.45);
}

TEST(ShakingFrequency, TheFirstToneIsToldFromItsOvertones) {
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < 150; ++k) {  // a parabola every 12.7 frames: what is thrown up
    const double phase = std::fmod(static_cast<double>(k) / 12.7, 1.0);
    places.push_back({k, 4 * phase * (1 - phase)});
  }
  const FoundFrequency found = find_frequency(places);
  ASSERT_TRUE(found.known) << found.why_not;
  EXPECT_NEAR(found.cycles_per_frame, 1 / 12.7, 2e-4);
}

// A slow drift has a slope near a line of the spectrum. It is not taken for a line all the same.
void expect_no_frequency(std::uint64_t series, std::size_t alarms_allowed) {
  for (const double share : {0.0, 0.6, 0.95, 0.995}) {
    std::size_t alarms = 0;
    for (std::uint64_t seed = 1; seed <= series; ++seed) alarms += find_frequency(wandering(100, share, seed)).known;
    EXPECT_LE(alarms, alarms_allowed) << "share " << share;
  }
}
// A false alarm of 1e-4 allows 0.05 of 500 series and 0.3 of 3000; more than 2 and 4 come by chance with a probability
// below 1e-4.
TEST(ShakingFrequency, NoiseHasNone) { expect_no_frequency(500, 2); }
TEST(ShakingFrequency, NoiseOfThreeThousandSeriesHasNone) { expect_no_frequency(3000, 4); }

TEST(ShakingFrequency, RestHasNone) {
  std::vector<PlaceInFrame> places;
  for (std::size_t k = 0; k < 100; ++k) places.push_back({k, 233.0});
  EXPECT_FALSE(find_frequency(places).known);
  EXPECT_EQ(find_frequency(places).why_not, "the height of the lowest beads shows no period");
  EXPECT_FALSE(find_frequency({}).known);
  EXPECT_FALSE(find_frequency(moving(10, 0.2, 1, 0, 1)).known);
}

constexpr double film_diameter_px = 20, floor_px = 2000;

// Lowest bottoms in the frames of a film of a simulated bed whose disks are located to 0.1 px, `per_cycle` a period of
// the floor. The mean of the floor is at floor_px.
std::vector<LowestBottoms> bottoms_in_film(const ShakenBed& bed, std::size_t frames, double per_cycle) {
  const auto run = sim::simulate(shaken_bed(bed));
  RandomStream random(bed.seed);
  std::vector<LowestBottoms> film;
  sim::Snapshot now;
  for (std::size_t k = 0; k < frames; ++k) {
    run->advance_to(50 + static_cast<double>(k) / (bed.frequency * per_cycle));
    run->snapshot(now);
    FrameFindings frame;
    frame.report.index = k;
    for (std::size_t i = 0; i < now.x.size(); ++i) {
      FoundDisk disk;
      disk.x_px = now.x[i] * film_diameter_px + 0.1 * random.normal();
      disk.y_px = floor_px - now.z[i] * film_diameter_px + 0.1 * random.normal();
      disk.radius_px = film_diameter_px / 2;
      frame.disks.push_back(disk);
    }
    film.push_back(lowest_bottoms(frame, 0, film_diameter_px, static_cast<int>(bed.width * film_diameter_px)));
  }
  return film;
}

struct FilmPulls {  // errors over stated errors
  double squares = 0, count = 0;
  void add(double error, double stated) { squares += error * error / (stated * stated), count += 1; }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
};

// A bed's bottom does not repeat exactly, and beads near the floor do not all touch it. 20 beds unlike one another,
// three films each; rms of 60 pulls is 1 +- 0.09, and films of one bed are alike in part. By the residuals alone the
// frequency was off by 1.3 to 4 stated errors, and the floor by 0.02 D where 0.001 D was stated.
TEST(ShakingFrequency, AndFloorOfSimulatedBedsAreWithinTheirErrors) {
  std::mt19937_64 random(2026);
  std::uniform_real_distribution<double> any(0, 1);
  FilmPulls frequency, floor, amplitude;
  double floor_squares = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    ShakenBed bed{.gamma = 2.5 + 4 * any(random), .restitution = 0.65 + 0.3 * any(random)};
    bed.friction = seed % 2 == 0 ? 0.4 * any(random) : 0;
    bed.frequency = 0.28 + 0.3 * any(random);
    bed.width = 14 + 12 * any(random);
    bed.count = static_cast<std::uint32_t>(bed.width * (4 + 6 * any(random)));
    bed.seed = seed;
    const double per_cycle = 8 + 9 * any(random);
    const auto longest = bottoms_in_film(bed, static_cast<std::size_t>(18 * per_cycle), per_cycle);
    for (const double cycles : {5.0, 9.0, 18.0}) {
      const std::vector<LowestBottoms> film(longest.begin(),
                                            longest.begin() + static_cast<std::ptrdiff_t>(cycles * per_cycle));
      const FloorMotion motion = find_floor_motion(film, film_diameter_px, 1 / per_cycle);
      if (motion.known && motion.amplitude > 0.02 * film_diameter_px) {
        floor.add(motion.middle - floor_px, motion.middle_std_error);
        floor_squares += std::pow((motion.middle - floor_px) / film_diameter_px, 2);
        amplitude.add(motion.amplitude - bed.amplitude() * film_diameter_px, motion.amplitude_std_error);
        EXPECT_NEAR(motion.amplitude / film_diameter_px, bed.amplitude(), 0.03) << seed;
      }
      std::vector<PlaceInFrame> bottoms;
      for (const LowestBottoms& frame : film)
        if (const auto bottom = bottom_of(frame)) bottoms.push_back(*bottom);
      const FoundFrequency found = find_frequency(bottoms);
      if (!found.known) continue;
      const double once = found.cycles_per_frame - 1 / per_cycle, twice = once + found.cycles_per_frame;
      const bool every_second = std::abs(twice) < std::abs(once);  // the bed is thrown up in every second period
      frequency.add(every_second ? twice : once, (every_second ? 2 : 1) * found.std_error);
    }
  }
  std::printf(
      "rms of error over stated error: frequency %.2f (%g films), floor %.2f (%g films; rms %.4f D), amplitude %.2f\n",
      frequency.rms(), frequency.count, floor.rms(), floor.count, std::sqrt(floor_squares / floor.count),
      amplitude.rms());
  EXPECT_GT(amplitude.rms(), 0.3);
  EXPECT_LT(amplitude.rms(), 1.2);
  EXPECT_GE(frequency.count, 40);
  EXPECT_GT(frequency.rms(), 0.6);
  EXPECT_LT(frequency.rms(), 1.5);
  EXPECT_GE(floor.count, 50);
  EXPECT_GT(floor.rms(), 0.4);
  EXPECT_LT(floor.rms(), 1.5);
  EXPECT_LT(std::sqrt(floor_squares / floor.count), 0.012);
}

// A pure tone of 20 cycles in 100 frames, of which an overtone is below half a cycle a frame: found to rounding, with
// the error that steps of a ten-thousandth of its amplitude leave, times that of a bed. The variance of the frequency
// is that of a fit of middle, drift, tone, overtone and frequency, here by the inverse of its normal matrix.
TEST(ShakingFrequency, OfAPureToneHasTheErrorOfItsFit) {
  constexpr double frequency = 0.2003, amplitude = 3, length = 100;
  const FoundFrequency found = find_frequency(moving(100, frequency, amplitude, 0, 1));
  ASSERT_TRUE(found.known) << found.why_not;
  EXPECT_NEAR(found.cycles_per_frame, frequency, 1e-7);
  EXPECT_NEAR(found.amplitude, amplitude, 1e-5);
  EXPECT_NEAR(found.phase, 0.3, 1e-5);
  EXPECT_LT(found.false_alarm, 1e-10);
  std::vector<std::vector<double>> normal(7, std::vector<double>(7, 0.0));
  for (int k = 0; k < 100; ++k) {
    const double turn = 2 * std::numbers::pi, t = k - 49.5, angle = turn * frequency * t;
    // The tone at the middle of the film: amplitude sin(angle + phase there).
    const double phase = turn * (0.3 + frequency * 49.5);
    const std::array<double, 7> row = {1,
                                       t / length,
                                       std::sin(angle),
                                       std::cos(angle),
                                       std::sin(2 * angle),
                                       std::cos(2 * angle),
                                       turn * t * amplitude * std::cos(angle + phase)};
    for (std::size_t a = 0; a < 7; ++a)
      for (std::size_t b = 0; b < 7; ++b) normal[a][b] += row[a] * row[b];
  }
  const double variance = test::inverse_of(normal)[6][6], noise = 1e-8 * amplitude * amplitude;
  EXPECT_NEAR(found.std_error / (std::sqrt(variance * noise) * std::hypot(1.3, 12 / (frequency * length))), 1, 1e-4);
  // A place that drifts besides has the same tone.
  std::vector<PlaceInFrame> drifting = moving(100, frequency, amplitude, 0, 1);
  for (PlaceInFrame& one : drifting) one.place += 0.4 * static_cast<double>(one.frame);
  EXPECT_NEAR(find_frequency(drifting).cycles_per_frame, frequency, 1e-6);
}

// What a sine and a cosine take from the sum of squares, half of it, by solving for both.
double lomb_power(const std::vector<double>& time, const std::vector<double>& place, double frequency) {
  double cc = 0, ss = 0, cs = 0, pc = 0, ps = 0;
  for (std::size_t k = 0; k < time.size(); ++k) {
    const double c = std::cos(2 * std::numbers::pi * frequency * time[k]),
                 s = std::sin(2 * std::numbers::pi * frequency * time[k]);
    cc += c * c, ss += s * s, cs += c * s, pc += place[k] * c, ps += place[k] * s;
  }
  const double b = (ps * cc - pc * cs) / (cc * ss - cs * cs), a = (pc - b * cs) / cc;
  return 0.5 * (a * pc + b * ps);
}

// The chance of noise at the strongest line: its power over the level of a power law through the neighbours 2 to 11
// lines away, of which m count, z: (1 + z/m)^-m for each of the frequencies tried.
TEST(ShakingFrequency, HasTheFalseAlarmOfItsNeighbourhood) {
  const std::vector<PlaceInFrame> places = moving(120, 0.1503, 1, 0.8, 11);
  const FoundFrequency found = find_frequency(places);
  ASSERT_TRUE(found.known) << found.why_not;
  // Without the straight line.
  std::vector<double> time, place;
  double tt = 0, tp = 0, mean = 0;
  for (const PlaceInFrame& one : places) mean += one.place / 120;
  for (const PlaceInFrame& one : places) {
    time.push_back(static_cast<double>(one.frame) - 59.5);
    tt += time.back() * time.back(), tp += time.back() * (one.place - mean);
  }
  for (std::size_t k = 0; k < 120; ++k) place.push_back(places[k].place - mean - tp / tt * time[k]);
  double strongest = 0, highest = 0, tried = 0;
  for (double frequency = 3.0 / 120; frequency < 0.5 - 1.5 / 120; frequency += 1.0 / 600, ++tried)
    if (const double power = lomb_power(time, place, frequency); power > highest)
      highest = power, strongest = frequency;
  double n = 0, x1 = 0, x2 = 0, y1 = 0, xy = 0;
  for (int k = 2; k <= 11; ++k)
    for (const int side : {-1, 1}) {
      const double beside = strongest + side * k / 120.0;
      if (beside < 0.9 / 120 || beside > 0.5 - 0.9 / 120) continue;
      const double x = std::log(beside / strongest), y = std::log(lomb_power(time, place, beside)) + 0.5772156649;
      n += 1, x1 += x, x2 += x * x, y1 += y, xy += x * y;
    }
  // Of a line through (x, y), its value at 0 and the variance of it over that of one logarithm, pi^2/6.
  const double slope = (n * xy - x1 * y1) / (n * x2 - x1 * x1), level = std::exp((y1 - slope * x1) / n);
  const double variance = 1 / n + (x1 / n) * (x1 / n) / (x2 - x1 * x1 / n);
  const double count = 1 / (variance * std::numbers::pi * std::numbers::pi / 6);
  EXPECT_NEAR(found.false_alarm / (tried * std::pow(1 + highest / level / count, -count)), 1, 1e-6);
}

// Too few frames, and noise: why there is none, with its place and chance.
TEST(ShakingFrequency, SaysWhyThereIsNone) {
  EXPECT_EQ(find_frequency(moving(23, 0.2, 1, 0, 1)).why_not,
            "there are only 23 usable frames, but at least 24 are needed");
  EXPECT_TRUE(find_frequency(moving(24, 0.2, 1, 0, 1)).known);
  // Slow: below three cycles in the film nothing is looked for.
  EXPECT_FALSE(find_frequency(moving(100, 0.02, 1, 0.2, 3)).known);
  // A line that noise makes now and then.
  for (std::uint64_t seed = 1; seed < 40; ++seed) {
    const FoundFrequency none = find_frequency(moving(100, 0.2, 0.3, 0.5, seed));
    if (none.known || none.false_alarm > 0.3) continue;
    char text[200];
    std::snprintf(text, sizeof text, "with a probability of %.2g", none.false_alarm);
    EXPECT_NE(none.why_not.find("noise alone gives a line as strong as the strongest one, at 0.2"), std::string::npos)
        << none.why_not;
    EXPECT_NE(none.why_not.find(text), std::string::npos) << none.why_not;
    return;
  }
  ADD_FAILURE() << "no such film";
}

// A floor of 0.26 cycles a frame that carries the bed in every second period. In between the bed flies as high as
// 20 px, a quarter of a diameter. So it repeats at 0.13, but what it lies on does not move so.
TEST(ShakingFrequency, OfABedThatFliesEverySecondPeriodIsTheFloors) {
  std::vector<FrameFindings> frames(200);
  for (std::size_t f = 0; f < 200; ++f) {
    const double turns = 0.26 * static_cast<double>(f) + 0.2, period = std::floor(turns / 2), part = turns - 2 * period;
    const double flight = part > 1 ? 4 * 20 * (part - 1) * (2 - part) : 0;
    const double bottom = 150 - 6 * std::sin(2 * std::numbers::pi * turns) - flight;
    frames[f].report.index = f;
    for (int k = 0; k < 8; ++k)
      frames[f].disks.push_back(
          test::found_at(60 + 124 * k, bottom - 40 + 0.05 * test::scattered(k, static_cast<int>(f)), 40));
  }
  MeasureOptions options;
  options.bead_diameter_m = 2e-3, options.frame_rate_hz = 100;
  BedCalibration bed;
  Shaking shaking(options);
  shaking.begin(frames, 80, 1000, bed);
  EXPECT_NEAR(*shaking.turns_per_frame(), 0.26, 1e-3);
  for (const FrameFindings& frame : frames) shaking.add(frame, bed);
  shaking.finish(bed);
  EXPECT_NEAR(bed.shaking_frequency_hz, 26, 0.02);
  EXPECT_EQ(bed.floor_reference, FloorReference::mean_of_motion);
  EXPECT_NEAR(bed.floor_amplitude_px, 6, 0.1);
  EXPECT_NEAR(bed.floor_phase, 0.2, 5e-3);
  EXPECT_NEAR(bed.floor_px, 150, 0.2) << "an eighth of the distance within which a bead touches";
  // The same film seen once, by its places alone: half of the frequency, and half of its error.
  std::vector<PlaceInFrame> places;
  for (const FrameFindings& frame : frames) places.push_back(*bottom_of(lowest_bottoms(frame, 0, 80, 1000)));
  const FoundFrequency once = refine_frequency(places, find_frequency(places));
  EXPECT_NEAR(bed.shaking_frequency_hz, 200 * once.cycles_per_frame, 1e-9);
  EXPECT_NEAR(bed.shaking_frequency_std_error_hz, 200 * once.std_error, 1e-12);
  ASSERT_EQ(shaking.warnings().size(), 1U);
  char text[200];
  std::snprintf(text, sizeof text, "at %.6g +- %.2g Hz, and this frequency is used.", bed.shaking_frequency_hz,
                bed.shaking_frequency_std_error_hz);
  EXPECT_TRUE(test::holds(shaking.warnings()[0], text)) << shaking.warnings()[0];
  std::snprintf(text, sizeof text, "appears lower: %.6g Hz would look", 100 - bed.shaking_frequency_hz);
  EXPECT_TRUE(test::holds(shaking.warnings()[0], text)) << shaking.warnings()[0];
}

}  // namespace
}  // namespace shakebed::ingest
