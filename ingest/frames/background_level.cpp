#include "ingest/frames/background_level.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

constexpr double most_samples = 40000;  // enough for six terms
constexpr std::size_t level_bins = 64;  // for the most frequent level
// Of the range of levels: how far from the surface samples count. At first it is as wide as light that differs by 30 %
// from one side of a picture to the other makes it. Then it shrinks to the noise of most pictures.
constexpr double first_reach = 0.15, last_reach = 0.04, reach_factor = 0.75;
constexpr int fits_per_reach = 3;
// Added to the diagonal, of the number of samples: terms that the samples do not tell stay 0.
constexpr double stiffness = 1e-3;

// -1 to 1 over `count` pixels.
double coordinate(int pixel, int count) { return (2 * pixel + 1.0) / count - 1; }

}  // namespace

std::vector<BackgroundLevel::Sample> BackgroundLevel::samples_of(const GrayFrame& frame) {
  const double pixels = static_cast<double>(frame.pixels.size());
  const int stride = std::max(1, static_cast<int>(std::sqrt(pixels / most_samples)));
  std::vector<Sample> samples;
  for (int row = 0; row < frame.height; row += stride)
    for (int column = 0; column < frame.width; column += stride)
      samples.push_back(
          {coordinate(column, frame.width), coordinate(row, frame.height), static_cast<double>(frame.at(column, row))});
  return samples;
}

BackgroundLevel::BackgroundLevel(const GrayFrame& frame) {
  const std::vector<Sample> samples = samples_of(frame);
  if (samples.empty()) return;
  const auto [least, most] = std::minmax_element(samples.begin(), samples.end(),
                                                 [](const Sample& a, const Sample& b) { return a.level < b.level; });
  const double lowest = least->level, range = std::max(1.0, most->level - lowest);
  std::array<std::size_t, level_bins> counts{};
  for (const Sample& sample : samples)
    ++counts[std::min(level_bins - 1, static_cast<std::size_t>((sample.level - lowest) / range * level_bins))];
  const auto fullest = std::max_element(counts.begin(), counts.end()) - counts.begin();
  terms_[0] = lowest + (static_cast<double>(fullest) + 0.5) * range / level_bins;
  int order = 0;
  for (double reach = first_reach; reach > last_reach * reach_factor; reach *= reach_factor) {
    for (int k = 0; k < fits_per_reach; ++k) fit(samples, order, range * std::max(reach, last_reach));
    order = std::min(2, order + 1);
  }
}

double BackgroundLevel::at(double u, double v) const {
  return terms_[0] + terms_[1] * u + terms_[2] * v + terms_[3] * (2 * u * u - 1) + terms_[4] * u * v +
         terms_[5] * (2 * v * v - 1);
}

// Least squares, weighted by how near the samples are to the surface (Tukey's weights).
void BackgroundLevel::fit(const std::vector<Sample>& samples, int order, double reach) {
  const std::size_t size = polynomial_terms(order);
  std::vector<double> normal(size * size, 0), right(size, 0);
  std::array<double, 6> values{};
  for (const Sample& sample : samples) {
    const double off = (sample.level - at(sample.u, sample.v)) / reach;
    if (!(std::abs(off) < 1)) continue;
    const double weight = (1 - off * off) * (1 - off * off);
    polynomial_values(sample.u, sample.v, order, values.data());
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j <= i; ++j) normal[i * size + j] += weight * values[i] * values[j];
      right[i] += weight * values[i] * sample.level;
    }
  }
  for (std::size_t i = 1; i < size; ++i) normal[i * size + i] += stiffness * static_cast<double>(samples.size());
  if (solve_symmetric(normal, right, size)) std::copy(right.begin(), right.end(), terms_.begin());
}

GrayFrame BackgroundLevel::distance_of(const GrayFrame& frame) const {
  GrayFrame distance{frame.width, frame.height, std::vector<float>(frame.pixels.size()), frame.enlargement};
  auto to = distance.pixels.begin();
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      *to++ = std::abs(frame.at(column, row) -
                       static_cast<float>(at(coordinate(column, frame.width), coordinate(row, frame.height))));
  return distance;
}

GrayFrame grey_distance_of(const ChannelFrames& frames) {
  const auto grey = std::find_if(frames.channels.begin(), frames.channels.end(),
                                 [](const ChannelFrames::One& one) { return one.channel == Channel::grey; });
  const GrayFrame& frame = (grey != frames.channels.end() ? *grey : frames.channels.front()).frame;
  return BackgroundLevel(frame).distance_of(frame);
}

}  // namespace shakebed::ingest
