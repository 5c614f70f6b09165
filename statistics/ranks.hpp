#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

// Values by their rank, in linear time. Of no values: 0.
namespace shakebed {

// The value whose rank is part (n - 1), rounded down; part: from 0, the least, to 1, the greatest.
template <class Number>
Number quantile_of(std::vector<Number> values, double part) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

// Of an even number of values, the upper of the two in the middle.
template <class Number>
Number median_of(std::vector<Number> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace shakebed
