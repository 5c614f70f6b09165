#include "fit/tail.hpp"

#include <algorithm>

namespace shakebed::fit {

namespace {

bool is_point(const Kernel& kernel) { return kernel.kind == KernelKind::none || !(kernel.width > 0.0); }

// Panel edges in F: phi(F) is smooth on the scale F/4 at high density, on the scale 2 to 3 about F = 0 (its nearest
// complex singularity lies about pi away) and an exponential below.
constexpr std::array<double, 25> panel_edges{160.0, 120.0, 92.0, 70.0,  53.0,  40.0,  30.0, 22.0, 16.0,
                                             11.5,  8.0,   5.5,  3.2,   1.2,   -0.8,  -3.0, -5.5, -8.5,
                                             -12.,  -16.,  -20., -24.5, -29.5, -34.5, -39.5};

}  // namespace

void Tail::prepare(const EquationOfState& equation) {
  start = std::max(reference, base);
  edges.clear();
  jumps.clear();
  if (!(temperature > 0.0)) return;
  const double f_start = f_at(start);
  edges.push_back(start);
  double f = f_start;
  while (f > 160.0) {
    f = std::max(160.0, 0.75 * f);
    edges.push_back(height_of_f(f));
  }
  for (const double edge : panel_edges) {
    if (edge < f) edges.push_back(height_of_f(edge));
  }
  const std::vector<double> breaks = equation.breaks();
  if (breaks.size() == 2) {
    const double at = std::log(breaks[0]) + equation.excess(breaks[0]);
    if (at < f_start) {
      jumps.push_back({at, breaks[0], breaks[1]});
      const double height = height_of_f(at);
      edges.insert(std::upper_bound(edges.begin(), edges.end(), height), height);
    }
  }
}

double Tail::density(double height) const {
  if (height < base) return 0.0;
  if (height <= start && start > base) return rectangle_density;
  if (!(temperature > 0.0)) return height <= start ? rectangle_density : 0.0;
  return table->density(f_at(height));
}

double Tail::rectangle_cover(double height, const Kernel& kernel) const {
  if (!(start > base)) return 0.0;
  return kernel_cumulative(kernel, height - base) - kernel_cumulative(kernel, height - start);
}

double Tail::smoothed(double height, const Kernel& kernel) const {
  if (is_point(kernel)) return density(height);
  std::array<double, 1> sum{rectangle_density * rectangle_cover(height, kernel)};
  if (temperature > 0.0) {
    add_convolution<1>(
        kernel, height, edges, [&](double h) { return std::array<double, 1>{table->density(f_at(h))}; }, sum);
  }
  return sum[0];
}

std::array<double, 1 + Tail::max_parameters> Tail::smoothed_with_gradient(double height, const Kernel& kernel) const {
  // The tail's derivatives are slope (A_p + B_p (h - reference)) with A_p = dF_ref + d_ref/T, B_p = dT/T^2: so three
  // integrals (phi, slope, slope (h - reference)) give them all.
  std::array<double, 3> sum{};
  std::array<double, 1 + max_parameters> out{};
  if (is_point(kernel)) {
    if (height < base) return out;
    if (height <= start && start > base) {
      out[0] = rectangle_density;
      for (std::size_t p = 0; p < max_parameters; ++p) out[1 + p] = d_rectangle[p];
      return out;
    }
    if (!(temperature > 0.0)) return out;
    const InverseTable::Point point = table->point(f_at(height));
    sum = {point.density, point.slope, point.slope * (height - reference)};
  } else if (temperature > 0.0) {
    add_convolution<3>(
        kernel, height, edges,
        [&](double h) {
          const InverseTable::Point point = table->point(f_at(h));
          return std::array<double, 3>{point.density, point.slope, point.slope * (h - reference)};
        },
        sum);
  }
  const double cover = is_point(kernel) ? 0.0 : rectangle_cover(height, kernel);
  out[0] = sum[0] + rectangle_density * cover;
  for (std::size_t p = 0; p < max_parameters; ++p) {
    double derivative = cover * d_rectangle[p];
    if (temperature > 0.0) {
      derivative += sum[1] * (d_f_reference[p] + d_reference[p] / temperature) +
                    sum[2] * d_temperature[p] / (temperature * temperature);
      if (!is_point(kernel)) {
        for (const Jump& jump : jumps) {  // the height of a jump moves with the parameters
          const double moves =
              d_reference[p] + d_temperature[p] * (f_reference - jump.f) + temperature * d_f_reference[p];
          derivative += (jump.upper - jump.lower) * kernel_density(kernel, height - height_of_f(jump.f)) * moves;
        }
      }
    } else if (start > base && !is_point(kernel)) {
      derivative += rectangle_density * kernel_density(kernel, height - start) * d_reference[p];
    }
    out[1 + p] = derivative;
  }
  return out;
}

}  // namespace shakebed::fit
