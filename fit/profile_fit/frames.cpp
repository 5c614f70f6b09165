// implements: fit/profile_fit/fit_profile.hpp
#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "fit/profile_fit/measured_profile.hpp"
#include "statistics/correlated_series.hpp"

namespace shakebed::fit {

namespace {

bool shape_is_good(const ProfileFrames& frames, std::string& message) {
  const std::size_t bins = frames.height.size();
  if (bins == 0 || frames.number_density.empty()) {
    message = "there are no frames";
    return false;
  }
  if (frames.number_density.size() % bins != 0) {
    message = std::to_string(frames.number_density.size()) + " densities were given, which is not a multiple of the " +
              std::to_string(bins) + " bins of a frame";
    return false;
  }
  for (const double value : frames.number_density) {
    if (!std::isfinite(value)) {
      message = "a density is not a finite number";
      return false;
    }
  }
  for (const double value : frames.height) {
    if (!std::isfinite(value)) {
      message = "a height is not a finite number";
      return false;
    }
  }
  return true;
}

// The frames one by one, and the windows by which they are judged.
struct Samples {
  std::vector<double> mean;
  std::vector<std::vector<double>> frames;
  statistics::Windows windows;
};
Samples samples_of(const ProfileFrames& frames) {
  const std::size_t bins = frames.height.size(), count = frames.frames();
  Samples samples;
  samples.mean.assign(bins, 0.0);
  std::vector<double> height(count, 0.0);
  for (std::size_t f = 0; f < count; ++f) {
    const double* frame = frames.number_density.data() + f * bins;
    samples.frames.emplace_back(frame, frame + bins);
    for (std::size_t i = 0; i < bins; ++i) {
      samples.mean[i] += frame[i] / static_cast<double>(count);
      height[f] += frames.height[i] * frame[i];
    }
  }
  height = statistics::from_mean(std::move(height));
  samples.windows = statistics::windows_for(statistics::memory_of(height), height);
  return samples;
}

}  // namespace

FrameAverage average_frames(const ProfileFrames& frames) {
  FrameAverage average;
  if (shape_is_good(frames, average.message) && frames.frames() < 2)
    average.message = "there is only one frame, but errors need at least two";
  if (!average.message.empty()) {
    average.status = FitStatus::bad_input;
    return average;
  }
  const Samples samples = samples_of(frames);
  const std::size_t bins = frames.height.size();
  average.window = static_cast<int>(samples.windows.length);
  Profile& profile = average.profile;
  profile.height = frames.height;
  profile.number_density = samples.mean;
  profile.covariance_samples = static_cast<int>(samples.windows.independent);
  profile.covariance = statistics::covariance_by_windows(samples.frames, 0, bins, samples.windows);
  for (std::size_t i = 0; i < bins; ++i) profile.std_error.push_back(std::sqrt(profile.covariance[i * bins + i]));
  return average;
}

namespace {

std::string why_no_bootstrap(const ProfileFrames& frames, const BootstrapOptions& bootstrap) {
  std::string why;
  if (!shape_is_good(frames, why)) return why;
  if (frames.frames() < 2) return "there is only one frame, but errors need at least two";
  if (bootstrap.resamples < 10 || !(bootstrap.confidence > 0.0 && bootstrap.confidence < 1.0))
    return "the bootstrap has " + std::to_string(bootstrap.resamples) + " resamples and the confidence " +
           number(bootstrap.confidence) + "; give at least 10 resamples and a confidence between 0 and 1";
  return "";
}

// Weighted by the scatter of single frames, which is well known. Errors from a few windows would be too small where
// these happen to scatter little, and such heights would get too much weight.
Profile weighed_profile(const ProfileFrames& frames, const Samples& samples) {
  Profile profile;
  profile.height = frames.height;
  profile.number_density = samples.mean;
  const statistics::Windows single{1, 1, frames.frames()};
  for (std::size_t i = 0; i < frames.height.size(); ++i)
    profile.std_error.push_back(std::sqrt(statistics::covariance_by_windows(samples.frames, i, i + 1, single).front()));
  return profile;
}

// Mean densities of a resample: the mean of the frames, and each window's deviation times a normal variate.
class Resampler {
 public:
  Resampler(const Samples& samples, std::uint64_t seed)
      : samples_(samples),
        generator_(seed),
        // Of the sum over a window, so that the resamples' covariance is that by windows.
        share_(std::sqrt(samples.windows.correction /
                         statistics::window_divisor(samples.frames.size(), samples.windows.length))) {}

  std::vector<double> densities() {
    const std::size_t count = samples_.frames.size(), window = samples_.windows.length;
    std::vector<double> before{0.0};  // the sum of the variates of the windows that begin before each frame
    for (std::size_t w = 0; w < count; ++w)
      before.push_back(before.back() + (w + window <= count ? share_ * normal_number(generator_) : 0.0));
    std::vector<double> density = samples_.mean;
    for (std::size_t f = 0; f < count; ++f) {
      // Of all windows that the frame is in.
      const double weight = before[f + 1] - before[f + 1 < window ? 0 : f + 1 - window];
      for (std::size_t i = 0; i < density.size(); ++i)
        density[i] += weight * (samples_.frames[f][i] - samples_.mean[i]);
    }
    return density;
  }

 private:
  const Samples& samples_;
  std::mt19937_64 generator_;
  double share_;
};

// Between the sorted values.
double quantile_of(const std::vector<double>& sorted, double fraction) {
  const double position = fraction * static_cast<double>(sorted.size() - 1);
  const auto i = static_cast<std::size_t>(position);
  const double part = position - static_cast<double>(i);
  return i + 1 < sorted.size() ? (1.0 - part) * sorted[i] + part * sorted[i + 1] : sorted.back();
}

double spread_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / static_cast<double>(values.size());
  double variance = 0.0;
  for (const double value : values) variance += (value - mean) * (value - mean);
  return std::sqrt(variance / static_cast<double>(values.size() - 1));
}

// Percentiles about the centre, moved apart as Student's are from the normal ones: the windows are few.
Interval interval_of(const std::vector<double>& sorted, double centre, double confidence, double degrees) {
  const double upper = 0.5 * (1.0 + confidence);
  const double apart = student_quantile(upper, degrees) / normal_quantile(upper);
  Interval interval;
  interval.status = FitStatus::ok;
  interval.confidence = confidence;
  interval.low = centre + apart * (quantile_of(sorted, 1.0 - upper) - centre);
  interval.high = centre + apart * (quantile_of(sorted, upper) - centre);
  return interval;
}

}  // namespace

BootstrapResult bootstrap_fit(const ProfileFrames& frames, const FitOptions& options,
                              const BootstrapOptions& bootstrap) {
  BootstrapResult result;
  const auto refused = [&](FitStatus status, std::string why) {
    result.status = status;
    result.message = std::move(why);
    return result;
  };
  if (std::string why = why_no_bootstrap(frames, bootstrap); !why.empty())
    return refused(FitStatus::bad_input, std::move(why));
  const Samples samples = samples_of(frames);
  result.window = static_cast<int>(samples.windows.length);
  Profile profile = weighed_profile(frames, samples);
  FitOptions plain = options;
  plain.interval = plain.sweep = plain.compare = false;
  plain.curve_points = 0;
  const FitResult whole = fit_profile(profile, plain);
  if (!whole.ok()) return refused(whole.status, whole.message);
  // Every resample is fitted on the window of the whole sample.
  plain.window.low = whole.window_low;
  plain.window.high = whole.window_high;
  Resampler resampler(samples, bootstrap.seed);
  std::vector<double> temperatures, shifts;
  for (int resample = 0; resample < bootstrap.resamples; ++resample) {
    profile.number_density = resampler.densities();
    const FitResult fit = fit_profile(profile, plain);
    if (!fit.ok()) continue;
    temperatures.push_back(fit.temperature.value);
    shifts.push_back(fit.shift.value);
  }
  result.succeeded = static_cast<int>(temperatures.size());
  if (result.succeeded < bootstrap.resamples / 2)
    return refused(FitStatus::not_converged, "only " + std::to_string(result.succeeded) + " of " +
                                                 std::to_string(bootstrap.resamples) + " resamples could be fitted");
  std::sort(temperatures.begin(), temperatures.end());
  std::sort(shifts.begin(), shifts.end());
  const double degrees = std::max(1.0, static_cast<double>(samples.windows.independent) - 1.0);
  result.temperature = {whole.temperature.value, spread_of(temperatures), false};
  result.temperature_interval = interval_of(temperatures, whole.temperature.value, bootstrap.confidence, degrees);
  result.shift = {whole.shift.value, spread_of(shifts), false};
  result.shift_interval = interval_of(shifts, whole.shift.value, bootstrap.confidence, degrees);
  result.temperatures = std::move(temperatures);
  return result;
}

}  // namespace shakebed::fit
