#include "ingest/find/round_aspect.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace shakebed::ingest {

namespace {

constexpr double smoothing_px = 1;
// Of the 99th percentile of the slopes: less steep ones are noise and shading.
constexpr double steep_share = 0.3;
constexpr double narrowest_tried = 0.4, widest_tried = 2.5;  // pixels
constexpr std::size_t fewest_edges = 200;                    // px
// Means of exp(2 i a) and exp(4 i a) over the directions a of all edges: 0 where they run in all directions alike.
// Drawn and photographed disks: up to 0.04 and 0.05 (fringed ones 0.09), text and plots 0.1 to 0.5.
constexpr double most_slanted = 0.06, most_angular = 0.12;

struct Slope {
  double across, down;  // grey levels per px
};

std::vector<Slope> steep_slopes(const GrayFrame& frame) {
  const cv::Mat levels(frame.height, frame.width, CV_32F, const_cast<float*>(frame.pixels.data()));
  cv::Mat smooth, across, down, steepness;
  cv::GaussianBlur(levels, smooth, {0, 0}, smoothing_px);
  cv::Scharr(smooth, across, CV_32F, 1, 0);
  cv::Scharr(smooth, down, CV_32F, 0, 1);
  cv::magnitude(across, down, steepness);
  std::vector<float> sorted(steepness.begin<float>(), steepness.end<float>());
  const auto high = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 99 / 100);
  std::nth_element(sorted.begin(), high, sorted.end());
  const double least = steep_share * static_cast<double>(*high);
  std::vector<Slope> slopes;
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      if (static_cast<double>(steepness.at<float>(row, column)) > least)
        slopes.push_back(
            {static_cast<double>(across.at<float>(row, column)), static_cast<double>(down.at<float>(row, column))});
  return slopes;
}

// The mean of exp(i order a) over the directions a of the edges, weighted by their length and height, in the picture
// with its columns `aspect` times as wide: slopes along rows are as many times less there.
std::complex<double> mean_direction(const std::vector<Slope>& slopes, double aspect, int order) {
  std::complex<double> sum = 0;
  double weight = 0;
  for (const Slope& slope : slopes) {
    const std::complex<double> one(slope.across / aspect, slope.down);
    const double steepness = std::abs(one);
    sum += steepness * std::polar(1.0, order * std::arg(one));
    weight += steepness;
  }
  return sum / weight;
}

}  // namespace

std::optional<double> aspect_for_round_outlines(const GrayFrame& frame) {
  if (frame.empty()) return std::nullopt;
  const std::vector<Slope> slopes = steep_slopes(frame);
  if (slopes.size() < fewest_edges) return std::nullopt;
  double low = narrowest_tried, high = widest_tried;
  for (int round = 0; round < 12; ++round) {  // to one part in two thousand
    const double middle = std::sqrt(low * high);
    (mean_direction(slopes, middle, 2).real() > 0 ? low : high) = middle;
  }
  const double aspect = std::sqrt(low * high);
  constexpr double at_the_end = 1.01;
  if (aspect < narrowest_tried * at_the_end || aspect > widest_tried / at_the_end) return std::nullopt;
  if (std::abs(mean_direction(slopes, aspect, 2)) > most_slanted) return std::nullopt;
  if (std::abs(mean_direction(slopes, aspect, 4)) > most_angular) return std::nullopt;
  return aspect;
}

}  // namespace shakebed::ingest
