#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

// Frames of a known profile whose noise is correlated in time (first order, coefficient `memory`).
ProfileFrames make_frames(int count, double memory, double noise, std::uint64_t seed) {
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.5, {11.22, 1.10});
  ProfileFrames frames;
  for (int i = 0; i < 60; ++i) frames.height.push_back(0.1 + 0.3 * i);
  synthetic::Normal normal(seed);
  std::vector<double> state(frames.height.size());
  for (double& x : state) x = normal();
  for (int f = 0; f < count; ++f) {
    for (std::size_t i = 0; i < state.size(); ++i) {
      state[i] = memory * state[i] + std::sqrt(1.0 - memory * memory) * normal();
      const double density = truth.density(frames.height[i]);
      frames.number_density.push_back(density + synthetic::bin_error(density, noise) * state[i]);
    }
  }
  return frames;
}

FitOptions plain_options() {
  FitOptions options;
  options.plateau_density = 1.10;
  options.interval = options.sweep = options.compare = false;
  return options;
}

TEST(Frames, AverageHasTheErrorOfTheMean) {
  const ProfileFrames frames = make_frames(2000, 0.0, 0.3, 3);
  const FrameAverage average = average_frames(frames);
  ASSERT_EQ(average.status, FitStatus::ok);
  EXPECT_EQ(average.window, 2);
  EXPECT_EQ(average.profile.covariance_samples, 750);
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.5, {11.22, 1.10});
  for (std::size_t i = 0; i < frames.height.size(); ++i) {
    const double expected = synthetic::bin_error(truth.density(frames.height[i]), 0.3) / std::sqrt(2000.0);
    EXPECT_NEAR(average.profile.std_error[i] / expected, 1.0, 4.5 / std::sqrt(2.0 * 750.0));
    EXPECT_NEAR(average.profile.covariance[i * frames.height.size() + i], std::pow(average.profile.std_error[i], 2),
                1e-15);
  }
}

// Of 40 films of 4,000 frames that remember 19: the variance of the mean is 19/4,000 of that of a frame, and told to
// four standard errors of the films' mean.
TEST(Frames, WindowsCureCorrelatedFrames) {
  constexpr int films = 40;
  const auto truth = HydrostaticProfile::of_column(enskog(), 0.5, {11.22, 1.10});
  double sum = 0.0, squares = 0.0, window = 0.0;
  for (int film = 0; film < films; ++film) {
    const ProfileFrames frames = make_frames(4000, 0.9, 0.3, 400 + static_cast<std::uint64_t>(film));
    const FrameAverage average = average_frames(frames);
    window += static_cast<double>(average.window) / films;
    const std::size_t bins = frames.height.size();
    double ratio = 0.0;
    for (std::size_t i = 0; i < bins; ++i) {
      const double of_frame = synthetic::bin_error(truth.density(frames.height[i]), 0.3);
      ratio += std::pow(average.profile.std_error[i] / of_frame, 2) * 4000.0 / 19.0 / static_cast<double>(bins);
    }
    sum += ratio, squares += ratio * ratio;
  }
  const double mean = sum / films, error = std::sqrt((squares / films - mean * mean) / (films - 1));
  RecordProperty("stated_over_true", std::to_string(mean));
  // Three memories; one estimate of a memory scatters by sqrt(2 (10 x 19 + 1)/4,000) = 0.31.
  EXPECT_NEAR(window / 57.0, 1.0, 4.0 * 0.31 / std::sqrt(films));
  EXPECT_LT(error, 0.025);
  EXPECT_NEAR(mean, 1.0, 4.0 * error);
}

TEST(Frames, BootstrapAgreesWithTheFittedError) {
  const ProfileFrames frames = make_frames(400, 0.0, 0.3, 5);
  const FitOptions options = plain_options();
  const BootstrapResult bootstrap = bootstrap_fit(frames, options, {.resamples = 400, .seed = 9});
  ASSERT_EQ(bootstrap.status, FitStatus::ok) << bootstrap.message;
  EXPECT_EQ(bootstrap.succeeded, 400);
  Profile profile = average_frames(frames).profile;
  profile.covariance.clear();
  const FitResult fit = fit_profile(profile, options);
  ASSERT_TRUE(fit.ok());
  // 400 resamples: 3.5 % each, 4 sigma; and 400 frames.
  EXPECT_NEAR(bootstrap.temperature.std_error / fit.temperature.std_error, 1.0, 0.25);
  EXPECT_LT(bootstrap.temperature_interval.low, fit.temperature.value);
  EXPECT_GT(bootstrap.temperature_interval.high, fit.temperature.value);
  EXPECT_NEAR(fit.temperature.value, 0.5, 4.0 * bootstrap.temperature.std_error);
  // The same seed, the same numbers.
  const BootstrapResult again = bootstrap_fit(frames, options, {.resamples = 400, .seed = 9});
  EXPECT_EQ(again.temperatures, bootstrap.temperatures);
}

// What the resamples' T scatters by must be what the covariance by windows says, through the derivatives of T by every
// density; and their 95 % interval Student's for as few independent samples as there are, 1.96 of it for many.
TEST(Frames, BootstrapScattersByTheCovarianceOfTheWindows) {
  constexpr int resamples = 2000;
  const ProfileFrames frames = make_frames(300, 0.9, 0.05, 77);
  const FrameAverage average = average_frames(frames);
  const BootstrapResult result = bootstrap_fit(frames, plain_options(), {.resamples = resamples, .seed = 3});
  ASSERT_EQ(result.status, FitStatus::ok) << result.message;
  ASSERT_EQ(result.succeeded, resamples);

  // Weighed as the bootstrap does: by the scatter of single frames.
  const std::size_t bins = frames.height.size(), count = frames.frames();
  Profile profile;
  profile.height = frames.height;
  profile.number_density = average.profile.number_density;
  for (std::size_t i = 0; i < bins; ++i) {
    double squares = 0.0;
    for (std::size_t f = 0; f < count; ++f)
      squares += std::pow(frames.number_density[f * bins + i] - profile.number_density[i], 2);
    profile.std_error.push_back(std::sqrt(squares / static_cast<double>(count - 1) / static_cast<double>(count)));
  }
  FitOptions options = plain_options();
  const FitResult whole = fit_profile(profile, options);
  ASSERT_TRUE(whole.ok());
  EXPECT_NEAR(result.temperature.value, whole.temperature.value, 1e-9);
  options.window.low = whole.window_low, options.window.high = whole.window_high;
  std::vector<double> gradient;
  for (std::size_t i = 0; i < bins; ++i) {
    const double density = profile.number_density[i], step = 1e-3;
    profile.number_density[i] = density + step;
    const double above = fit_profile(profile, options).temperature.value;
    profile.number_density[i] = density - step;
    const double below = fit_profile(profile, options).temperature.value;
    profile.number_density[i] = density;
    gradient.push_back((above - below) / (2.0 * step));
  }
  double variance = 0.0;
  for (std::size_t i = 0; i < bins; ++i) {
    for (std::size_t j = 0; j < bins; ++j)
      variance += gradient[i] * gradient[j] * average.profile.covariance[i * bins + j];
  }
  // 2,000 resamples tell a standard error to 1.6 %: four of them. (Without the correction for what windows share .89.)
  EXPECT_NEAR(result.temperature.std_error / std::sqrt(variance), 1.0, 4.0 / std::sqrt(2.0 * resamples));

  // 300 frames in windows of 30 (as long as three times they are correlated for): (3 300 + 2 30)/(4 30) = 8 independent
  // samples, and Student's t of 7 degrees of freedom is 2.365. The percentiles of 2,000 normal numbers at 2.5 % are
  // known to 2.7 % of 1.96, the interval between two to 1.9 %.
  ASSERT_EQ(average.window, 30);
  ASSERT_EQ(average.profile.covariance_samples, 8);
  const Interval& interval = result.temperature_interval;
  EXPECT_NEAR((interval.high - interval.low) / (2.0 * 2.365 * result.temperature.std_error), 1.0, 4 * 0.019);
  // By the percentiles themselves, which are read off 2,000 numbers that lie 0.2 % of the interval apart there.
  ASSERT_EQ(result.temperatures.size(), std::size_t{resamples});
  const double between = result.temperatures[resamples - 50] - result.temperatures[49];
  EXPECT_NEAR((interval.high - interval.low) / (2.3646 / 1.95996 * between), 1.0, 0.006);
  const Interval& of_shift = result.shift_interval;
  EXPECT_EQ(of_shift.confidence, 0.95);
  EXPECT_NEAR((of_shift.high - of_shift.low) / (2.0 * 2.365 * result.shift.std_error), 1.0, 4 * 0.019);
  EXPECT_LT(of_shift.low, result.shift.value);
  EXPECT_GT(of_shift.high, result.shift.value);
}

// Of 20 resamples the percentiles at 2.5 and 97.5 % lie 0.475 of the way from the outermost to the next; both are moved
// away from T by Student's factor, the same for both.
TEST(Frames, BootstrapReadsItsPercentilesBetweenFewResamples) {
  const BootstrapResult result =
      bootstrap_fit(make_frames(300, 0.9, 0.05, 77), plain_options(), {.resamples = 20, .seed = 3});
  ASSERT_EQ(result.status, FitStatus::ok) << result.message;
  ASSERT_EQ(result.temperatures.size(), 20U);
  const std::vector<double>& sorted = result.temperatures;
  const double centre = result.temperature.value, apart = 2.3646 / 1.95996, low = 0.525 * sorted[0] + 0.475 * sorted[1],
               high = 0.525 * sorted[19] + 0.475 * sorted[18];
  const double width = high - low;
  EXPECT_NEAR(result.temperature_interval.low, centre + apart * (low - centre), 1e-4 * width);
  EXPECT_NEAR(result.temperature_interval.high, centre + apart * (high - centre), 1e-4 * width);
}

TEST(Frames, FullCovarianceOfFramesFits) {
  const FrameAverage average = average_frames(make_frames(1000, 0.0, 0.3, 6));
  const FitResult fit = fit_profile(average.profile, plain_options());
  ASSERT_TRUE(fit.ok()) << fit.message;
  EXPECT_NEAR(fit.temperature.value, 0.5, 4.0 * fit.temperature.std_error);
}

TEST(Frames, GiveAStatusForNonsense) {
  EXPECT_EQ(average_frames({}).status, FitStatus::bad_input);
  ProfileFrames frames = make_frames(10, 0.0, 0.1, 1);
  frames.number_density.pop_back();
  EXPECT_EQ(average_frames(frames).status, FitStatus::bad_input);
  EXPECT_EQ(bootstrap_fit(frames, plain_options(), {}).status, FitStatus::bad_input);
  EXPECT_EQ(average_frames(make_frames(1, 0.0, 0.1, 1)).status, FitStatus::bad_input);
  const ProfileFrames good = make_frames(4, 0.0, 0.1, 1);
  for (const BootstrapOptions& bad : {BootstrapOptions{.resamples = 9}, BootstrapOptions{.confidence = 0},
                                      BootstrapOptions{.confidence = 1}, BootstrapOptions{.confidence = -0.5}})
    EXPECT_EQ(bootstrap_fit(good, plain_options(), bad).status, FitStatus::bad_input);
  EXPECT_EQ(bootstrap_fit(good, plain_options(), {.resamples = 10}).status, FitStatus::ok);
  ProfileFrames broken = good;
  broken.number_density[70] = std::nan("");
  EXPECT_EQ(average_frames(broken).status, FitStatus::bad_input);
  broken = good, broken.height[3] = HUGE_VAL;
  EXPECT_EQ(average_frames(broken).status, FitStatus::bad_input);
  EXPECT_EQ(bootstrap_fit(make_frames(1, 0.0, 0.1, 1), plain_options(), {}).status, FitStatus::bad_input);
}

}  // namespace
}  // namespace shakebed::fit
