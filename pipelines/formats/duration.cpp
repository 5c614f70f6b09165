#include "pipelines/formats/duration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace shakebed::pipelines {

namespace {
constexpr double far_above_median = 10;
}  // namespace

std::string duration_text(double seconds) {
  if (seconds < 0.0995) return fmt::format("{:.0f} ms", seconds * 1e3);
  if (seconds < 9.95) return fmt::format("{:.1f} s", seconds);
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  const auto whole = static_cast<long>(std::lround(seconds));
  if (whole < 3600) return fmt::format("{} min {} s", whole / 60, whole % 60);
  return fmt::format("{} h {} min", whole / 3600, whole % 3600 / 60);
}

std::vector<LongPart> long_parts(const std::vector<double>& seconds, double least) {
  std::vector<double> known;
  for (const double one : seconds)
    if (one > 0) known.push_back(one);
  if (known.size() < 3) return {};
  const auto middle = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), middle, known.end());
  std::vector<LongPart> out;
  for (std::size_t i = 0; i < seconds.size(); ++i)
    if (seconds[i] > far_above_median * *middle && seconds[i] > least) out.push_back({i, seconds[i], *middle});
  return out;
}

std::string long_part_text(const LongPart& part) {
  return fmt::format("will take about {}, {:.0f} times the median of {}", duration_text(part.seconds),
                     part.seconds / part.median, duration_text(part.median));
}

}  // namespace shakebed::pipelines
