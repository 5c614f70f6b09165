// The floor: a horizontal wall that stands still, shakes sinusoidally, or follows a table from a real shaker. Reduced
// units.
//
// Plain data: a value owns what it holds, and copies are independent. Any number of threads may read one.
#pragma once

#include <vector>

namespace shakebed::sim {

struct StillFloor {};
struct SinusoidalFloor {
  double amplitude = 0;  // a
  double frequency = 0;  // f; the floor stands at a sin(2 pi f t)
};
// One period of measured positions, equally spaced in time; between them a periodic cubic spline.
struct TabulatedFloor {
  double period = 0;
  std::vector<double> heights;
};

}  // namespace shakebed::sim
