#include "ingest/profile/measure_bed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "ingest/profile/overlay.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// 223 beads of 20 px: touching layers, gas above, shaded, blurred, noisy, moving while the shutter is open.
struct Film {
  std::vector<std::vector<RenderedDisk>> truth;
  std::vector<GrayFrame> frames;
};
// The first `count` frames; each is drawn once for all tests.
Film film_of(std::size_t count) {
  static Film film;
  static RandomStream random(3);
  Camera camera;
  camera.width = 440;
  camera.height = 520;
  camera.shading = BeadShading::shaded;
  camera.blur_px = 0.8;
  camera.read_noise = 5;
  camera.exposure_s = 5e-4;
  camera.gradient_x = 0.1;
  const FrameRenderer renderer(camera);
  for (std::size_t k = film.frames.size(); k < count; ++k) {
    SyntheticBed bed;
    bed.left_wall_px = 20;
    bed.right_wall_px = 420;
    bed.floor_px = 500;
    bed.rows = 8;
    bed.gas_count = 67;
    bed.gas_height_px = 60;
    bed.jitter_px = 0.1;
    bed.seed = k + 1;
    auto disks = make_synthetic_bed(bed);
    for (RenderedDisk& disk : disks) {
      disk.velocity_x_px_per_s = 600 * random.normal();
      disk.velocity_y_px_per_s = 600 * random.normal();
    }
    film.frames.push_back(renderer.render(disks, k));
    film.truth.push_back(std::move(disks));
  }
  const auto end = static_cast<std::ptrdiff_t>(count);
  return {{film.truth.begin(), film.truth.begin() + end}, {film.frames.begin(), film.frames.begin() + end}};
}

MeasureOptions options_of() {
  MeasureOptions options;
  options.bead_diameter_m = 2.99e-3;
  options.kernel = {KernelKind::gaussian, 0.25};
  return options;
}

// A bed that rides the floor and, where that falls faster than it does, flies: heights above the mean, by the floor's
// turns, at 1.4 times the acceleration of gravity.
std::vector<double> ridden_heights(double amplitude_px, double phase, std::size_t count, double turns_per_frame) {
  constexpr double gamma = 1.4, turn = 2 * std::numbers::pi;
  constexpr int steps = 2000;  // a frame
  const double gravity = amplitude_px * turn * turn / gamma, dt = turns_per_frame / steps;
  const auto floor_at = [&](double t) { return amplitude_px * std::sin(turn * (t + phase)); };
  const auto floor_speed = [&](double t) { return turn * amplitude_px * std::cos(turn * (t + phase)); };
  double t = -2, z = floor_at(t), v = floor_speed(t);
  std::vector<double> heights;
  for (std::size_t k = 0; k < count; ++k) {
    for (const double frame = static_cast<double>(k) * turns_per_frame; t < frame; t += dt) {
      v -= gravity * dt;
      z += v * dt;
      if (z > floor_at(t + dt)) continue;
      z = floor_at(t + dt);
      v = floor_speed(t + dt);
    }
    heights.push_back(z);
  }
  return heights;
}

// 220 px wide, walls at 20 and 200 px.
std::vector<RenderedDisk> small_bed(double floor_px) {
  SyntheticBed bed;
  bed.left_wall_px = 20;
  bed.right_wall_px = 200;
  bed.floor_px = floor_px;
  bed.rows = 6;
  bed.gas_count = 10;
  bed.gas_height_px = 30;
  bed.seed = 1;  // a film: the same beads in every frame
  return make_synthetic_bed(bed);
}

// The first `count` frames; each is drawn once for all tests.
std::vector<GrayFrame> shaken_film(double amplitude_px, double phase, std::size_t count, double turns_per_frame) {
  static std::map<std::array<double, 3>, std::vector<GrayFrame>> films;
  std::vector<GrayFrame>& frames = films[{amplitude_px, phase, turns_per_frame}];
  Camera camera;
  camera.width = 220;
  camera.height = 300;
  camera.blur_px = 0.8;
  camera.read_noise = 4;
  const FrameRenderer renderer(camera);
  if (frames.size() < count) {
    const std::vector<double> heights = ridden_heights(amplitude_px, phase, count, turns_per_frame);
    for (std::size_t k = frames.size(); k < count; ++k)
      frames.push_back(renderer.render(small_bed(270 - heights[k]), k));
  }
  return {frames.begin(), frames.begin() + static_cast<std::ptrdiff_t>(count)};
}

TEST(MeasureBed, DensityOfRenderedBedWithKnownGeometryIsTheTrueOne) {
  const Film film = film_of(6);
  MeasureOptions options = options_of();
  options.floor_px = 500;
  options.left_wall_px = 20;
  options.right_wall_px = 420;
  options.scale_m_per_px = 2.99e-3 / 20;
  FrameSource source = FrameSource::from_frames(film.frames);
  const Measurement measured = measure_bed(source, options);
  std::vector<std::vector<double>> densities;
  std::size_t in_view = 0;
  for (const auto& disks : film.truth) {
    std::vector<double> heights;
    for (const RenderedDisk& disk : disks)
      if (disk.y_px >= -0.5) heights.push_back((500 - disk.y_px) / 20);
    in_view += heights.size();
    densities.push_back(density_of_frame(heights, 20, measured.profile.bins, options.kernel));
  }
  EXPECT_EQ(measured.disks.size(), in_view);
  const DensityProfile truth = average_profile(densities, measured.profile.bins, options.kernel);
  for (std::size_t bin = 0; bin < truth.bins.count; ++bin)
    EXPECT_NEAR(measured.profile.number_density[bin], truth.number_density[bin], 0.002) << truth.bins.middle(bin);
  EXPECT_LT(measured.coverage_disagreement, 0.006);
}

// A lamp that flickers by 10 % from frame to frame, and by 30 % once.
TEST(MeasureBed, FlickerIsTakenOutOfCentresAndCoveredArea) {
  const Film film = film_of(8);
  const MeasureOptions options = options_of();
  FrameSource steady_source = FrameSource::from_frames(film.frames);
  const Measurement steady = measure_bed(steady_source, options);
  std::vector<GrayFrame> frames = film.frames;
  const std::array<float, 8> brightness = {1.0F, 0.9F, 1.1F, 0.93F, 1.04F, 0.88F, 0.7F, 1.1F};
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (float& level : frames[k].pixels) level *= brightness[k];
  FrameSource source = FrameSource::from_frames(frames);
  const Measurement measured = measure_bed(source, options);
  ASSERT_EQ(measured.disks.size(), steady.disks.size());
  double square = 0;
  for (const MeasuredDisk& disk : measured.disks) {
    double nearest = 100;
    for (const MeasuredDisk& one : steady.disks)
      if (one.frame == disk.frame)
        nearest = std::min(nearest, std::pow(disk.x_px - one.x_px, 2) + std::pow(disk.y_px - one.y_px, 2));
    square += nearest;
  }
  EXPECT_LT(std::sqrt(square / 2 / static_cast<double>(measured.disks.size())), 0.002);
  EXPECT_LT(measured.coverage_disagreement, 0.006);
  ASSERT_TRUE(measured.coverage_profile && steady.coverage_profile);
  for (std::size_t bin = 0; bin < steady.profile.bins.count; ++bin)
    EXPECT_NEAR(measured.coverage_profile->number_density[bin], steady.coverage_profile->number_density[bin], 0.003);
  for (std::size_t k = 0; k < frames.size(); ++k)
    EXPECT_NEAR(measured.frames[k].light.gain / measured.frames[0].light.gain, static_cast<double>(brightness[k]),
                0.003);
  EXPECT_NEAR(measured.calibration.flicker, 0.125, 0.003);
  EXPECT_EQ(steady.calibration.flicker, 0);
}

TEST(MeasureBed, GeometryIsFoundWhenNotGiven) {
  const Film film = film_of(4);
  FrameSource source = FrameSource::from_frames(film.frames);
  const Measurement measured = measure_bed(source, options_of());
  const BedCalibration& bed = measured.calibration;
  EXPECT_NEAR(bed.scale_m_per_px, 2.99e-3 / 20, 0.002 * 2.99e-3 / 20);
  EXPECT_NEAR(bed.floor_px, 500, 0.1);
  EXPECT_NEAR(bed.floor_tilt_degrees, 0, 0.02);
  EXPECT_NEAR(bed.left_wall_px, 20, 0.2);
  EXPECT_NEAR(bed.right_wall_px, 420, 0.2);
  EXPECT_NEAR(bed.width, 20, 0.047);
  EXPECT_EQ(bed.polarity, Polarity::dark_beads);
}

TEST(MeasureBed, ThreadsChangeNothing) {
  const std::vector<GrayFrame> film = shaken_film(9, 0.3, 12, 1 / 13.7);
  FrameSource one_source = FrameSource::from_frames(film), two_source = FrameSource::from_frames(film);
  MeasureOptions options = options_of();
  const Measurement one = measure_bed(one_source, options);
  options.threads = 3;
  const Measurement two = measure_bed(two_source, options);
  ASSERT_EQ(one.disks.size(), two.disks.size());
  for (std::size_t k = 0; k < one.disks.size(); ++k) {
    EXPECT_EQ(one.disks[k].x_px, two.disks[k].x_px);
    EXPECT_EQ(one.disks[k].z, two.disks[k].z);
  }
  EXPECT_EQ(one.profile.number_density, two.profile.number_density);
  EXPECT_EQ(one.profile.covariance, two.profile.covariance);
}

TEST(MeasureBed, SinkReceivesEveryDiskInOrderAndTheProfileIsTheSame) {
  const std::vector<GrayFrame> film = shaken_film(9, 0.3, 12, 1 / 13.7);
  FrameSource source = FrameSource::from_frames(film), again = FrameSource::from_frames(film);
  MeasureOptions options = options_of();
  options.floor_px = 279;
  options.left_wall_px = 20;
  options.right_wall_px = 200;
  const Measurement kept = measure_bed(source, options);
  std::vector<MeasuredDisk> streamed;
  std::vector<std::size_t> order;
  options.threads = 3;
  options.geometry_frames = 2;
  options.disk_sink = [&](const FrameReport& frame, const std::vector<MeasuredDisk>& disks) {
    order.push_back(frame.index);
    EXPECT_EQ(frame.disks, disks.size());
    streamed.insert(streamed.end(), disks.begin(), disks.end());
  };
  const Measurement measured = measure_bed(again, options);
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}));
  EXPECT_TRUE(measured.disks.empty());
  EXPECT_EQ(measured.disk_total, kept.disk_total);
  ASSERT_EQ(streamed.size(), kept.disks.size());
  for (std::size_t k = 0; k < streamed.size(); ++k) {
    EXPECT_EQ(streamed[k].frame, kept.disks[k].frame);
    EXPECT_EQ(streamed[k].x_px, kept.disks[k].x_px);
    EXPECT_EQ(streamed[k].z, kept.disks[k].z);
  }
  EXPECT_EQ(measured.profile.number_density, kept.profile.number_density);
  ASSERT_TRUE(measured.coverage_profile);
  EXPECT_EQ(measured.coverage_profile->number_density, kept.coverage_profile->number_density);
}

// Ten times the film, no more frames in memory at once; without a sink all of them are.
TEST(MeasureBed, WithASinkMemoryDoesNotGrowWithTheFilm) {
  const std::vector<GrayFrame> film = shaken_film(0, 0, 3, 1);
  const auto beads = static_cast<double>(small_bed(270).size());
  const auto held = [&](std::size_t frames, bool with_sink) {
    FrameSource source = FrameSource::from_generator(frames, [&](std::size_t k) { return film[k % 3]; });
    MeasureOptions options = options_of();
    options.threads = 2;
    options.geometry_frames = 5;
    options.find.joint_fit_sweeps = 1;
    std::size_t disks = 0;
    if (with_sink)
      options.disk_sink = [&](const FrameReport&, const std::vector<MeasuredDisk>& found) { disks += found.size(); };
    const Measurement measured = measure_bed(source, options);
    EXPECT_EQ(measured.frames.size(), frames);
    EXPECT_EQ(disks, with_sink ? measured.disk_total : 0U);
    EXPECT_EQ(measured.disks.size(), with_sink ? 0U : measured.disk_total);
    EXPECT_NEAR(static_cast<double>(measured.disk_total), beads * static_cast<double>(frames),
                0.02 * beads * static_cast<double>(frames));
    return measured.most_frames_held;
  };
  const std::size_t at_most = std::max<std::size_t>(5, rim_frames) + 2 * 2;  // that tell the geometry; two a thread
  EXPECT_LE(held(12, true), at_most);
  EXPECT_LE(held(120, true), at_most);
  EXPECT_GE(held(30, false), 30U);
}

TEST(MeasureBed, AThrowingSinkEndsTheRunWithItsError) {
  const Film film = film_of(6);
  FrameSource source = FrameSource::from_frames(film.frames);
  MeasureOptions options = options_of();
  options.threads = 3;
  options.geometry_frames = 1;
  options.disk_sink = [](const FrameReport& frame, const std::vector<MeasuredDisk>&) {
    if (frame.index == 2) throw std::runtime_error("disk full");
  };
  EXPECT_THROW(measure_bed(source, options), std::runtime_error);
}

TEST(MeasureBed, BadFramesAreReportedAndTheOthersUsed) {
  Film film = film_of(4);
  GrayFrame blank = film.frames[0];
  std::fill(blank.pixels.begin(), blank.pixels.end(), 200.0F);
  film.frames[1] = blank;
  GrayFrame small;
  small.width = small.height = 50;
  small.pixels.assign(2500, 100.0F);
  film.frames.push_back(small);
  FrameSource source = FrameSource::from_frames(film.frames);
  const Measurement measured = measure_bed(source, options_of());
  ASSERT_EQ(measured.frames.size(), 5U);
  EXPECT_EQ(measured.frames[1].status, FrameStatus::nothing_found);
  EXPECT_FALSE(measured.frames[1].why.empty());
  EXPECT_EQ(measured.frames[4].status, FrameStatus::size_changed);
  EXPECT_EQ(measured.frames[2].status, FrameStatus::good);
  EXPECT_THAT(measured.warnings,
              testing::Contains(testing::HasSubstr("1 of 5 frames differ from the first one in size")));
  // Four frames count, the blank one with no bead.
  double mean = 0, squares = 0;
  for (std::size_t k = 0; k < 4; ++k) mean += static_cast<double>(measured.frames[k].disks) / 4;
  for (std::size_t k = 0; k < 4; ++k) squares += std::pow(static_cast<double>(measured.frames[k].disks) - mean, 2);
  EXPECT_EQ(measured.frames[1].disks, 0U);
  EXPECT_NEAR(measured.disk_count_mean, mean, 1e-9);
  EXPECT_NEAR(measured.disk_count_std, std::sqrt(squares / 3), 1e-9);
}

TEST(MeasureBed, AFilmWithoutBeadsIsAnErrorThatSaysWhy) {
  GrayFrame blank;
  blank.width = blank.height = 100;
  blank.pixels.assign(10000, 100.0F);
  FrameSource source = FrameSource::from_frames({blank, blank});
  try {
    measure_bed(source, options_of());
    FAIL() << "accepted";
  } catch (const NoDisksError& error) {
    EXPECT_NE(std::string(error.what()).find("no disks"), std::string::npos) << error.what();
  }
  // Where nothing could be read, nothing is known of disks.
  FrameSource none = FrameSource::from_frames({});
  try {
    measure_bed(none, options_of());
    FAIL() << "accepted";
  } catch (const InputError& error) {
    EXPECT_EQ(dynamic_cast<const NoDisksError*>(&error), nullptr) << error.what();
  }
  EXPECT_THROW(measure_bed(source, MeasureOptions{}), std::invalid_argument);
}

TEST(MeasureBed, PhasesAreSortedByTheShakersClock) {
  const Film film = film_of(4);
  FrameSource source = FrameSource::from_frames(film.frames);
  MeasureOptions options = options_of();
  options.shaking_frequency_hz = 20;
  options.frame_rate_hz = 80;
  options.phase_bins = 4;
  const Measurement measured = measure_bed(source, options);
  ASSERT_EQ(measured.phases.size(), 4U);
  for (const PhaseProfile& phase : measured.phases) EXPECT_EQ(phase.profile.samples, 1U);
}

// Says so.
bool floor_is_the_lowest(const Measurement& measured) {
  return std::any_of(measured.warnings.begin(), measured.warnings.end(), [](const std::string& warning) {
    return warning.find("from its lowest position") != std::string::npos;
  });
}

TEST(MeasureBed, FloorIsFollowedThroughTheShakersPeriod) {
  MeasureOptions options = options_of();
  options.shaking_frequency_hz = 20;
  options.frame_rate_hz = 20 * 13.7;
  FrameSource source = FrameSource::from_frames(shaken_film(9, 0.3, 41, 1 / 13.7));
  const Measurement moving = measure_bed(source, options);
  const BedCalibration& bed = moving.calibration;
  // The first bin begins at the first multiple of the bins' width below the floor's lowest place, 9 of 20 px down.
  const double lowest = moving.profile.bins.lowest, width = moving.profile.bins.width;
  EXPECT_NEAR(lowest / width, std::round(lowest / width), 1e-9);
  EXPECT_LE(lowest, -(9 - 0.4) / 20);
  EXPECT_GT(lowest, -(9 + 0.4) / 20 - width);
  // Touching beads are those within 0.02 D = 0.4 px.
  EXPECT_NEAR(bed.floor_px, 270, 0.4);
  EXPECT_NEAR(bed.floor_amplitude_px, 9, 0.4);
  EXPECT_NEAR(bed.floor_phase, 0.3, 0.4 / 9 / (2 * std::numbers::pi) * 2);

  EXPECT_EQ(bed.floor_reference, FloorReference::mean_of_motion);
  EXPECT_LT(bed.floor_std_error_px, 0.5);
  EXPECT_FALSE(floor_is_the_lowest(moving));

  FrameSource still = FrameSource::from_frames(shaken_film(0, 0, 20, 1 / 13.7));
  const BedCalibration resting = measure_bed(still, options).calibration;
  EXPECT_EQ(resting.floor_amplitude_px, 0);
  EXPECT_NEAR(resting.floor_px, 270, 0.1);
}

// Photographs tell nothing of the time: the floor is taken where it is lowest, and the error says how far its mean may
// lie above.
TEST(MeasureBed, StatesHowFarAMovingFloorMayLieAboveWhereItIsSeen) {
  MeasureOptions options = options_of();
  FrameSource source = FrameSource::from_frames(shaken_film(9, 0.3, 10, 1 / 9.7));  // of one period
  const Measurement moving = measure_bed(source, options);
  EXPECT_EQ(moving.calibration.floor_reference, FloorReference::lowest_seen);
  EXPECT_NEAR(moving.calibration.floor_px, 279, 1);
  EXPECT_GT(moving.calibration.floor_std_error_px, 9 * 0.8)
      << "half the way of the lowest beads, which is 9 px or more";
  EXPECT_LT(moving.calibration.floor_std_error_px, 9 * 1.8);
  EXPECT_TRUE(floor_is_the_lowest(moving));

  FrameSource still = FrameSource::from_frames(shaken_film(0, 0, 10, 1 / 9.7));
  const Measurement resting = measure_bed(still, options);
  EXPECT_EQ(resting.calibration.floor_reference, FloorReference::lowest_seen);
  EXPECT_GT(resting.calibration.floor_std_error_px, 0);
  EXPECT_LT(resting.calibration.floor_std_error_px, 0.1);
  EXPECT_NEAR(resting.calibration.floor_px, 270, 4 * resting.calibration.floor_std_error_px);
  EXPECT_FALSE(floor_is_the_lowest(resting));
  EXPECT_FALSE(is_shaken(resting));
  EXPECT_TRUE(is_shaken(moving));

  options.floor_amplitude_m = 9 * resting.calibration.scale_m_per_px;
  source.rewind();
  const Measurement raised = measure_bed(source, options);
  EXPECT_EQ(raised.calibration.floor_reference, FloorReference::mean_by_amplitude);
  EXPECT_NEAR(raised.calibration.floor_px, moving.calibration.floor_px - 4.5, 0.01);
  EXPECT_NEAR(raised.calibration.floor_std_error_px, 4.5, 0.05);
  EXPECT_NEAR(raised.calibration.floor_px, 270, 1.1 * raised.calibration.floor_std_error_px) << "a bed that rides";
  EXPECT_LT(raised.profile.bins.lowest, 0);
  EXPECT_FALSE(floor_is_the_lowest(raised));
  EXPECT_TRUE(is_shaken(raised));
  options.floor_amplitude_m = 10 * *options.floor_amplitude_m;  // more than the lowest beads move
  source.rewind();
  const Measurement contradicted = measure_bed(source, options);
  EXPECT_EQ(contradicted.calibration.floor_reference, FloorReference::lowest_seen);
  EXPECT_TRUE(std::any_of(contradicted.warnings.begin(), contradicted.warnings.end(), [](const std::string& warning) {
    return warning.find("The amplitude given is") != std::string::npos;
  }));
  options.floor_amplitude_m.reset();

  options.shaking_frequency_hz = 20, options.frame_rate_hz = 20 * 13.7;
  options.floor_px = 268;
  source.rewind();
  const Measurement given = measure_bed(source, options);
  EXPECT_EQ(given.calibration.floor_reference, FloorReference::given);
  EXPECT_EQ(given.calibration.floor_std_error_px, 0);
  EXPECT_FALSE(floor_is_the_lowest(given));
  options.floor_px = 900;
  source.rewind();
  EXPECT_THROW(measure_bed(source, options), std::invalid_argument);
}

// What is above the upper border is not seen: no density is stated there, and no column number.
TEST(MeasureBed, EndsBelowAnUpperBorderThatCutsBeads) {
  std::vector<GrayFrame> frames = film_of(4).frames;
  constexpr int cut = 380;  // rows; the floor is at 500
  for (GrayFrame& frame : frames) {
    frame.pixels.erase(frame.pixels.begin(), frame.pixels.begin() + cut * frame.width);
    frame.height -= cut;
  }
  FrameSource source = FrameSource::from_frames(frames);
  const Measurement measured = measure_bed(source, options_of());
  EXPECT_FALSE(measured.column_number());
  EXPECT_THAT(measured.warnings, testing::Contains(testing::HasSubstr("cut by the upper border")));
  const double border = measured.calibration.floor_px / (2 * measured.calibration.radius_px);
  const DensityProfile& profile = measured.profile;
  ASSERT_FALSE(profile.number_density.empty());
  EXPECT_LE(profile.bins.middle(profile.number_density.size() - 1), border - 0.5 - 3 * 0.25);
  FrameSource whole = FrameSource::from_frames(shaken_film(0, 0, 6, 1));
  EXPECT_TRUE(measure_bed(whole, options_of()).column_number()) << "no bead is cut";
}

// Beads that the sides of the frame cut are not counted in the column number of the part that is seen.
TEST(MeasureBed, CountsForTheColumnNumberWhatLiesWithinTheWidth) {
  MeasureOptions options = options_of();
  FrameSource source = FrameSource::from_frames(shaken_film(0, 0, 6, 1));
  const Measurement whole = measure_bed(source, options);
  EXPECT_EQ(whole.count_in_width_mean, whole.disk_count_mean);
  options.find.roi = PixelRectangle{50, 0, 120, 300};
  source.rewind();
  const Measurement part = measure_bed(source, options);
  ASSERT_TRUE(part.calibration.walls_are_frame_sides);
  EXPECT_LT(part.count_in_width_mean, part.disk_count_mean);
  const double all = whole.count_in_width_mean / whole.calibration.width;
  EXPECT_NEAR(part.count_in_width_mean / part.calibration.width, all, 0.06 * all);
}

TEST(MeasureBed, TheShakersFrequencyIsFoundUnlessGiven) {
  const std::vector<GrayFrame> frames = shaken_film(9, 0.3, 80, 1 / 13.7);
  const auto warned = [](const Measurement& measured, const char* what) {
    return std::any_of(measured.warnings.begin(), measured.warnings.end(),
                       [&](const std::string& warning) { return warning.find(what) != std::string::npos; });
  };
  MeasureOptions options = options_of();
  options.frame_rate_hz = 20 * 13.7;
  options.profile_from_coverage = false;
  FrameSource source = FrameSource::from_frames(frames);
  const Measurement found = measure_bed(source, options);
  const BedCalibration& bed = found.calibration;
  EXPECT_FALSE(bed.frequency_given);
  ASSERT_GT(bed.shaking_frequency_hz, 0) << bed.why_no_frequency;
  EXPECT_NEAR(bed.shaking_frequency_hz, 20, 4 * bed.shaking_frequency_std_error_hz);
  EXPECT_LT(bed.shaking_frequency_std_error_hz, 0.1);
  EXPECT_LT(bed.frequency_false_alarm, 1e-4);
  EXPECT_NEAR(bed.floor_px, 270, 0.5);
  EXPECT_NEAR(bed.floor_amplitude_px, 9, 0.5);
  EXPECT_EQ(found.phases.size(), options.phase_bins);
  EXPECT_TRUE(warned(found, "was not given"));

  // With a sink the geometry comes from the film's beginning, the frequency from all of it.
  options.disk_sink = [](const FrameReport&, const std::vector<MeasuredDisk>&) {};
  options.geometry_frames = 60;
  source.rewind();
  const BedCalibration streamed = measure_bed(source, options).calibration;
  EXPECT_NEAR(streamed.shaking_frequency_hz, bed.shaking_frequency_hz, 1e-3);
  EXPECT_NEAR(streamed.floor_phase, 0.3, 0.02);
  options.disk_sink = nullptr;

  options.shaking_frequency_hz = 21;
  source.rewind();
  const Measurement given = measure_bed(source, options);
  EXPECT_TRUE(given.calibration.frequency_given);
  EXPECT_EQ(given.calibration.shaking_frequency_hz, 21);
  EXPECT_TRUE(warned(given, "but 21 Hz was given"));
  options.shaking_frequency_hz = 20;
  source.rewind();
  EXPECT_FALSE(warned(measure_bed(source, options), "Hz was given"));

  options.shaking_frequency_hz.reset();
  FrameSource still = FrameSource::from_frames(shaken_film(0, 0, 30, 1 / 13.7));
  const Measurement resting = measure_bed(still, options);
  EXPECT_EQ(resting.calibration.shaking_frequency_hz, 0);
  EXPECT_EQ(resting.calibration.why_no_frequency, "the height of the lowest beads shows no period");
  EXPECT_TRUE(resting.phases.empty());
}

// Pictures at unrelated times, put into an order in which the lowest beads rise and fall regularly.
TEST(MeasureBed, PicturesThatAreNoFilmHaveNoFrequency) {
  Camera camera;
  camera.width = 340, camera.height = 300;
  camera.blur_px = 0.8, camera.read_noise = 4;
  std::vector<GrayFrame> frames;
  for (std::uint64_t k = 0; k < 40; ++k) {
    SyntheticBed bed;
    bed.left_wall_px = 20, bed.right_wall_px = 320;
    bed.floor_px = 270 - 9 * std::sin(2 * std::numbers::pi * static_cast<double>(k) / 8);
    bed.rows = 2, bed.gas_count = 60, bed.gas_height_px = 90, bed.jitter_px = 0, bed.seed = k + 1;
    std::vector<RenderedDisk> disks = make_synthetic_bed(bed);
    const double shift = 10.0 * static_cast<double>(k * 7 % 5) / 5;  // of the rows, which else are the same
    std::erase_if(disks, [&](const RenderedDisk& disk) { return disk.y_px > 200 && disk.x_px + shift > 310; });
    for (RenderedDisk& disk : disks)
      if (disk.y_px > bed.floor_px - 35) disk.x_px += shift;
    frames.push_back(render_frame(disks, camera, k));
  }
  MeasureOptions options = options_of();
  options.frame_rate_hz = 500;
  options.profile_from_coverage = false;
  FrameSource source = FrameSource::from_frames(frames);
  const Measurement found = measure_bed(source, options);
  EXPECT_EQ(found.calibration.shaking_frequency_hz, 0);
  EXPECT_NE(found.calibration.why_no_frequency.find("found again in the next picture"), std::string::npos)
      << found.calibration.why_no_frequency;
  EXPECT_TRUE(found.phases.empty());
  EXPECT_NE(found.calibration.floor_reference, FloorReference::mean_of_motion);
}

TEST(MeasureBed, AFloorSeenAtOnePhaseOnlyIsNotSaidToMove) {
  MeasureOptions options = options_of();
  options.shaking_frequency_hz = 20;
  options.frame_rate_hz = 20;
  FrameSource source = FrameSource::from_frames(shaken_film(9, 0.05, 8, 1));
  const Measurement measured = measure_bed(source, options);
  EXPECT_EQ(measured.calibration.floor_amplitude_px, 0);
  bool told = false;
  for (const std::string& warning : measured.warnings)
    told = told || warning.find("motion of the floor") != std::string::npos;
  EXPECT_TRUE(told);
}

// Few beads near the floor, none of them at rest: their lowest places lie on no line, and no tilt follows.
TEST(MeasureBed, ATiltWithinItsErrorIsNone) {
  std::vector<GrayFrame> frames;
  for (std::uint64_t k = 0; k < 6; ++k) {
    SyntheticBed bed;
    bed.left_wall_px = 6, bed.right_wall_px = 250, bed.floor_px = 290;
    bed.radius_px = 8, bed.rows = 0, bed.gas_count = 60, bed.gas_height_px = 120, bed.seed = k + 1;
    Camera camera;
    camera.width = 256, camera.height = 300;
    camera.blur_px = 0.8, camera.read_noise = 3;
    frames.push_back(render_frame(make_synthetic_bed(bed), camera));
  }
  FrameSource source = FrameSource::from_frames(frames);
  MeasureOptions options;
  options.bead_diameter_m = 3e-3;
  const Measurement found = measure_bed(source, options);
  EXPECT_EQ(found.calibration.floor_tilt_degrees, 0);
  EXPECT_GT(found.calibration.floor_tilt_std_error_degrees, 0.05);
  for (const std::string& warning : found.warnings) EXPECT_EQ(warning.find("tilted"), std::string::npos) << warning;
}

TEST(MeasureBed, ASecondSpeciesIsRejectedUnlessAskedFor) {
  SyntheticBed bed;
  bed.left_wall_px = 12;
  bed.right_wall_px = 388;
  bed.floor_px = 386;
  bed.radius_px = 10;
  bed.rows = 7;
  bed.gas_count = 30;
  bed.gas_height_px = 60;
  std::vector<RenderedDisk> truth = make_synthetic_bed(bed);
  std::erase_if(truth, [](const RenderedDisk& disk) { return disk.y_px < 12; });
  std::size_t small = 0;
  for (std::size_t k = 0; k < truth.size(); k += 4, ++small) truth[k].radius_px = 7;
  Camera camera;
  camera.width = camera.height = 400;
  camera.blur_px = 0.8;
  camera.read_noise = 4;
  FrameSource source = FrameSource::from_frames({render_frame(truth, camera)});
  MeasureOptions options;
  options.bead_diameter_m = 3e-3;
  options.profile_from_coverage = false;
  const Measurement alone = measure_bed(source, options);
  EXPECT_EQ(alone.disks.size(), truth.size() - small);
  EXPECT_GT(alone.frames[0].rejected, 0U);
  options.second_diameter_m = 2.1e-3;
  const Measurement both = measure_bed(source, options);
  ASSERT_TRUE(both.second_finder && both.second_profile);
  EXPECT_NEAR(both.second_finder->radius_px, 7, 0.05);
  EXPECT_EQ(both.disks.size(), truth.size());
  EXPECT_EQ(both.frames[0].second, small);
  // The left wall is shown by small beads alone, in the places of larger ones that touched it: 22 - 7 px.
  EXPECT_NEAR(both.calibration.radius_px, 10, 0.01);
  EXPECT_NEAR(both.calibration.left_wall_px, 15, 0.05);
  EXPECT_NEAR(both.calibration.right_wall_px, alone.calibration.right_wall_px, 0.05);
  EXPECT_NEAR(both.calibration.floor_px, alone.calibration.floor_px, 0.05);
  const double wider = both.calibration.width / alone.calibration.width;
  for (std::size_t k = 0; k < alone.profile.number_density.size(); ++k)
    EXPECT_NEAR(wider * both.profile.number_density[k], alone.profile.number_density[k], 0.002) << k;
  for (const MeasuredDisk& disk : both.disks) {
    double nearest = 100;
    for (const RenderedDisk& one : truth)
      if ((one.radius_px < 10) == (disk.species == 2))
        nearest = std::min(nearest, std::hypot(one.x_px - disk.x_px, one.y_px - disk.y_px));
    EXPECT_LT(nearest, 0.15) << disk.species << " at " << disk.x_px << " " << disk.y_px;
  }
}

// A polished floor: the lowest rows upside down below it, and fainter.
TEST(MeasureBed, AMirrorImageIsLeftOut) {
  constexpr double floor = 240;
  SyntheticBed bed;
  bed.left_wall_px = 12, bed.right_wall_px = 368, bed.floor_px = floor;
  bed.radius_px = 8;
  bed.rows = 3;
  bed.gas_count = 40;
  bed.gas_height_px = 120;
  std::vector<RenderedDisk> beads = make_synthetic_bed(bed), images;
  std::mt19937 random(5);
  std::erase_if(beads, [&](const RenderedDisk& disk) { return disk.y_px < 10 || random() % 4 == 0; });
  for (const RenderedDisk& disk : beads)
    if (disk.y_px > floor - 50) images.push_back({disk.x_px, 2 * floor - disk.y_px, disk.radius_px});
  Camera camera;
  camera.width = 380, camera.height = 320;
  camera.blur_px = 0.8;
  camera.background_level = 200, camera.bead_level = 60;
  camera.read_noise = 3;
  GrayFrame frame = render_frame(beads, camera);
  camera.bead_level = 110, camera.read_noise = 0;
  const GrayFrame light = render_frame(images, camera);
  for (std::size_t k = 0; k < frame.pixels.size(); ++k) frame.pixels[k] += light.pixels[k] - 200;
  FrameSource source = FrameSource::from_frames({frame});
  MeasureOptions options;
  options.bead_diameter_m = 3e-3;
  const Measurement found = measure_bed(source, options);
  ASSERT_TRUE(found.above_mirror_image);
  EXPECT_EQ(found.above_mirror_image->top, 0);
  EXPECT_EQ(found.above_mirror_image->left, 0);
  EXPECT_EQ(found.above_mirror_image->width, 380);
  EXPECT_NEAR(found.above_mirror_image->height, floor, 1);
}

TEST(MeasureBed, TablesAndOverlayAreWritten) {
  const test::ScratchFolder folder;
  const Film film = film_of(1);
  FrameSource source = FrameSource::from_frames(film.frames);
  const Measurement measured = measure_bed(source, options_of());
  write_disks_csv(folder / "disks.csv", measured);
  EXPECT_GT(std::filesystem::file_size(folder / "disks.csv"), 1000U);
  const FindResult found = find_disks(film.frames[0], measured.finder);
  write_overlay(folder / "overlay.png", film.frames[0], found.disks);
  const GrayFrame overlay = read_frame(folder / "overlay.png");
  EXPECT_EQ(overlay.width, 880);
}

// Eight frames of a flume, black beads of 6 mm, measured with nothing but the diameter. The truth says which beads rest
// (motion_state 0, told from the second frame on); they creep, and the camera shakes. Without the motion all have in
// common and a straight one of its own, a bead's places scatter by what they repeat to.
TEST(RealFrames, BeadsAtRestRepeatToAFewThousandthsOfAPixel) {
  const auto folder = test::flume_frames();
  if (folder.empty()) GTEST_SKIP() << "the real images are not here (set SHAKEBED_IMAGES to their folder)";
  MeasureOptions options;
  options.bead_diameter_m = 6e-3;
  FrameSource source = FrameSource::open({folder.string() + "/*.tif"});
  const Measurement measured = measure_bed(source, options);
  constexpr std::size_t frames = 8;
  ASSERT_EQ(measured.frames.size(), frames);
  constexpr double radius = 14.6, width = 1280, lowest_truth = 305;
  struct Track {
    std::size_t seen = 0;
    std::array<double, frames> x{}, y{};
  };
  std::map<std::string, Track> tracks;
  for (const test::FlumeBead& bead : test::flume_truth()) {
    const std::size_t frame = bead.frame;
    const double x = bead.x_px, y = bead.y_px;
    if (!bead.black || frame >= frames || (frame > 0 && !bead.at_rest)) continue;
    if (x < radius || x > width - 1 - radius || y > lowest_truth) continue;
    for (const MeasuredDisk& disk : measured.disks) {
      if (disk.frame != frame || std::hypot(disk.x_px - x, disk.y_px - y) > 4) continue;
      Track& track = tracks[bead.bead];
      track.x[frame] = disk.x_px;
      track.y[frame] = disk.y_px;
      ++track.seen;
      break;
    }
  }
  std::erase_if(tracks, [](const auto& track) { return track.second.seen != frames; });
  ASSERT_GE(tracks.size(), 150U);
  const auto median = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
  };
  for (const auto axis : {&Track::x, &Track::y}) {
    std::array<double, frames> shake{};
    for (std::size_t f = 0; f < frames; ++f) {
      std::vector<double> away;
      for (const auto& [bead, track] : tracks) {
        const auto& place = track.*axis;
        away.push_back(place[f] - std::accumulate(place.begin(), place.end(), 0.0) / frames);
      }
      shake[f] = median(away);
    }
    std::vector<double> repeats;
    for (const auto& [bead, track] : tracks) {
      std::array<double, frames> place = track.*axis;
      double mean = 0, slope = 0, square = 0;
      for (std::size_t f = 0; f < frames; ++f) mean += (place[f] -= shake[f]) / frames;
      constexpr double middle = 0.5 * (frames - 1), times_square = frames * (frames * frames - 1) / 12.0;
      for (std::size_t f = 0; f < frames; ++f)
        slope += (static_cast<double>(f) - middle) * (place[f] - mean) / times_square;
      for (std::size_t f = 0; f < frames; ++f)
        square += std::pow(place[f] - mean - slope * (static_cast<double>(f) - middle), 2);
      repeats.push_back(std::sqrt(square / (frames - 2)));
    }
    const double repeat = median(repeats);
    RecordProperty(axis == &Track::x ? "repeat_x_px" : "repeat_y_px", std::to_string(repeat));
    std::printf("%zu beads at rest repeat along %s to %.4f px (median)\n", repeats.size(),
                axis == &Track::x ? "x" : "y", repeat);
    EXPECT_LE(repeat, 0.005);
  }
}

}  // namespace
}  // namespace shakebed::ingest
