#pragma once
// Profiles sampled at equal steps. For the .cpp files of the bead's profile alone.

#include <cstddef>
#include <vector>

namespace shakebed::ingest {

// Linear between samples; 0 beyond the last.
template <class Number>
double value_at(const std::vector<Number>& samples, double step, double r) {
  const double place = r / step;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= samples.size()) return 0;
  const double part = place - static_cast<double>(cell);
  return static_cast<double>(samples[cell]) * (1 - part) + static_cast<double>(samples[cell + 1]) * part;
}

// The first row from `top` on that a pass over every `step`-th row visits.
inline int first_row(int top, int step) { return (top + step - 1) / step * step; }

}  // namespace shakebed::ingest
