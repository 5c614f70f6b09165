#include "fit/theory/quadrature.hpp"

#include <cmath>
#include <numbers>

namespace shakebed::fit {

// The roots of the Legendre polynomial by Newton from the cosines they lie close to.
void fill_gauss_legendre(std::size_t points, long double* nodes, long double* weights) {
  const auto n = static_cast<long double>(points);
  for (std::size_t i = 0; i < points; ++i) {
    long double x = -std::cos(std::numbers::pi_v<long double> * (static_cast<long double>(i) + 0.75L) / (n + 0.5L));
    long double slope = 0.0L;
    for (int step = 0; step < 100; ++step) {
      long double before = 1.0L;
      long double here = x;
      for (std::size_t k = 2; k <= points; ++k) {
        const auto order = static_cast<long double>(k);
        const long double next = ((2.0L * order - 1.0L) * x * here - (order - 1.0L) * before) / order;
        before = here;
        here = next;
      }
      slope = n * (x * here - before) / (x * x - 1.0L);
      const long double change = here / slope;
      x -= change;
      if (std::abs(change) < 1e-18L) break;
    }
    nodes[i] = x;
    weights[i] = 2.0L / ((1.0L - x * x) * slope * slope);
  }
}

}  // namespace shakebed::fit
