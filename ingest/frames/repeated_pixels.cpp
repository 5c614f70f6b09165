#include "ingest/frames/repeated_pixels.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <type_traits>
#include <vector>

#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Of the mean step between neighbouring columns that differ: below it, two columns are repeats (compression leaves
// some difference between them).
constexpr double same_share = 0.1;
// An enlargement shows at least so many steps, each where its lattice has one, none nearer than two pixels.
constexpr std::size_t fewest_steps = 30;
constexpr double least_enlargement = 2, on_lattice_px = 0.8, most_off_lattice = 0.02;
// Of the lattice's steps, so many are seen: drawings have a few lines wherever they like.
constexpr double least_seen = 0.5;
// The two sides are enlarged alike_steps.
constexpr double alike_steps = 0.05;
// So many changes of a byte are counted in 32 bits.
constexpr int most_rows_of_bytes = 16'000'000;

// Adds up the changes from column to column. `Sum` holds a whole column of them without loss.
template <class Level, class Sum>
std::vector<double> changes_of(const cv::Mat& levels) {
  std::vector<Sum> changes(static_cast<std::size_t>(levels.cols - 1), 0);
  for (int row = 0; row < levels.rows; ++row) {
    const Level* line = levels.ptr<Level>(row);
    for (std::size_t k = 0; k < changes.size(); ++k) {
      if constexpr (std::is_integral_v<Level>)
        changes[k] += static_cast<Sum>(std::abs(static_cast<int>(line[k + 1]) - static_cast<int>(line[k])));
      else
        changes[k] += static_cast<Sum>(std::abs(line[k + 1] - line[k]));
    }
  }
  return {changes.begin(), changes.end()};
}

// Columns after which the picture changes.
std::vector<double> steps_between_columns(const cv::Mat& levels) {
  const std::vector<double> changes = levels.depth() == CV_8U && levels.rows < most_rows_of_bytes
                                          ? changes_of<std::uint8_t, std::uint32_t>(levels)
                                      : levels.depth() == CV_16U ? changes_of<std::uint16_t, double>(levels)
                                                                 : changes_of<float, double>(levels);
  const double high = quantile_of(changes, 0.9);
  std::vector<double> steps;
  for (std::size_t k = 0; k < changes.size(); ++k)
    if (changes[k] > same_share * high && changes[k] > 0) steps.push_back(static_cast<double>(k) + 0.5);
  return steps;
}

// Steps at first + number * spacing.
struct Lattice {
  double first = 0, spacing = 1;
  [[nodiscard]] double off(double step) const { return std::abs(std::remainder(step - first, spacing)); }
};

std::optional<Lattice> lattice_of(const std::vector<double>& steps) {
  if (steps.size() < fewest_steps) return std::nullopt;
  std::vector<double> gaps;
  for (std::size_t k = 1; k < steps.size(); ++k) gaps.push_back(steps[k] - steps[k - 1]);
  const double smallest = *std::min_element(gaps.begin(), gaps.end());
  if (smallest < least_enlargement) return std::nullopt;
  double sum = 0, count = 0;
  for (const double gap : gaps)
    if (gap < smallest + 1.5) sum += gap, ++count;
  Lattice lattice{steps.front(), sum / count};
  constexpr int rounds = 6;  // each adds steps farther from the first
  for (int round = 0; round < rounds; ++round) {
    double n = 0, k = 0, kk = 0, s = 0, ks = 0;
    const double within = steps.front() + (steps.back() - steps.front()) * std::pow(2.0, round + 1 - rounds);
    for (const double step : steps) {
      if (step > within) break;
      const double number = std::round((step - lattice.first) / lattice.spacing);
      ++n, k += number, kk += number * number, s += step, ks += number * step;
    }
    const double determinant = n * kk - k * k;
    if (!(determinant > 0)) continue;
    lattice.spacing = (n * ks - k * s) / determinant;
    lattice.first = (s - lattice.spacing * k) / n;
  }
  const auto off = static_cast<double>(
      std::count_if(steps.begin(), steps.end(), [&](double step) { return lattice.off(step) > on_lattice_px; }));
  const double places = (steps.back() - steps.front()) / lattice.spacing + 1;
  const bool regular = off <= most_off_lattice * static_cast<double>(steps.size()) &&
                       static_cast<double>(steps.size()) >= least_seen * places;
  if (!regular || lattice.spacing < least_enlargement) return std::nullopt;
  return lattice;
}

// Places between two steps: the first that lies in the picture, and their number.
struct Originals {
  double first = 0, spacing = 1;
  int count = 0;
  Originals(const Lattice& lattice, int length) : spacing(lattice.spacing) {
    first = lattice.first + 0.5 * spacing - spacing * std::floor((lattice.first + 0.5 * spacing) / spacing);
    count = static_cast<int>((length - 1 - first) / spacing) + 1;
  }
  [[nodiscard]] int column(int k) const { return static_cast<int>(std::lround(first + k * spacing)); }
};

}  // namespace

double smooth_repeated_pixels(cv::Mat& picture) {
  if (picture.empty() || picture.cols < 2 * static_cast<int>(fewest_steps) ||
      picture.rows < 2 * static_cast<int>(fewest_steps))
    return 1;
  cv::Mat levels;
  cv::extractChannel(picture, levels, picture.channels() > 1 ? 1 : 0);
  if (levels.depth() != CV_8U && levels.depth() != CV_16U) levels.convertTo(levels, CV_32F);
  const auto across = lattice_of(steps_between_columns(levels));
  if (!across) return 1;
  const auto down = lattice_of(steps_between_columns(levels.t()));
  if (!down || std::abs(across->spacing / down->spacing - 1) > alike_steps) return 1;
  const Originals columns(*across, picture.cols), rows(*down, picture.rows);
  cv::Mat map_x(rows.count, columns.count, CV_32F), map_y(rows.count, columns.count, CV_32F), originals;
  for (int row = 0; row < rows.count; ++row)
    for (int column = 0; column < columns.count; ++column) {
      map_x.at<float>(row, column) = static_cast<float>(columns.column(column));
      map_y.at<float>(row, column) = static_cast<float>(rows.column(row));
    }
  cv::remap(picture, originals, map_x, map_y, cv::INTER_NEAREST, cv::BORDER_REPLICATE);
  map_x.create(picture.rows, picture.cols, CV_32F);
  map_y.create(picture.rows, picture.cols, CV_32F);
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column) {
      map_x.at<float>(row, column) = static_cast<float>((column - columns.first) / columns.spacing);
      map_y.at<float>(row, column) = static_cast<float>((row - rows.first) / rows.spacing);
    }
  cv::remap(originals, picture, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return std::sqrt(across->spacing * down->spacing);
}

}  // namespace shakebed::ingest
