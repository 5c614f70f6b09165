// Durations as people read them, and those that stand out.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace shakebed::pipelines {

// "3.2 s", "4 min 10 s", "120 ms".
std::string duration_text(double seconds);

// A part of some work whose expected time is above ten times the median of all known ones, and above `least` seconds.
struct LongPart {
  std::size_t part;
  double seconds, median;
};
// Those of three parts or more; 0: not known.
std::vector<LongPart> long_parts(const std::vector<double>& seconds, double least = 2);
// "will take about 3 min 2 s, 40 times the median of 4.5 s".
std::string long_part_text(const LongPart& part);

}  // namespace shakebed::pipelines
