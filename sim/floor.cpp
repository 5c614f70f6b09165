#include "sim/floor.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "sim/contact_time.hpp"

namespace shakebed::sim {

namespace {

// Second derivatives of the periodic cubic spline through equally spaced values: the cyclic tridiagonal system
// m[i-1] + 4 m[i] + m[i+1] = 6 (y[i-1] - 2 y[i] + y[i+1]) / h^2, solved by Gauss-Seidel, which gains a factor of four
// a sweep on this diagonally dominant matrix and so reaches rounding within 40.
std::vector<double> periodic_spline_curvatures(const std::vector<double>& values, double spacing) {
  const std::size_t n = values.size();
  std::vector<double> curvature(n, 0.0);
  for (int sweep = 0; sweep < 60; ++sweep) {
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t before = (i + n - 1) % n, after = (i + 1) % n;
      const double second_difference = values[before] - 2 * values[i] + values[after];
      curvature[i] = (6 * second_difference / (spacing * spacing) - curvature[before] - curvature[after]) / 4;
    }
  }
  return curvature;
}

// The positive root h of gap + gap_rate h - bend h^2/2, gap >= 0, bend > 0, without cancellation.
double step_to_root(double gap, double gap_rate, double bend) {
  const double root = std::sqrt(gap_rate * gap_rate + 2 * bend * gap);
  return gap_rate < 0 ? 2 * gap / (root - gap_rate) : (gap_rate + root) / bend;
}

}  // namespace

FloorMotion::FloorMotion(const StillFloor&) {}

FloorMotion::FloorMotion(const SinusoidalFloor& floor)
    : kind_(Kind::sinusoidal),
      amplitude_(floor.amplitude),
      angular_frequency_(2 * std::numbers::pi * floor.frequency),
      period_(1 / floor.frequency),
      highest_(std::abs(floor.amplitude)),
      lowest_(-std::abs(floor.amplitude)),
      largest_acceleration_(std::abs(floor.amplitude) * angular_frequency_ * angular_frequency_) {}

FloorMotion::FloorMotion(const TabulatedFloor& floor)
    : kind_(Kind::tabulated),
      period_(floor.period),
      heights_(floor.heights),
      curvatures_(periodic_spline_curvatures(floor.heights, floor.period / static_cast<double>(floor.heights.size()))),
      spacing_(floor.period / static_cast<double>(floor.heights.size())) {
  // Within a piece the cubic leaves the span of its ends by at most h^2/8 times its largest curvature.
  const auto [low, high] = std::minmax_element(heights_.begin(), heights_.end());
  double curvature = 0;
  for (double c : curvatures_) curvature = std::max(curvature, std::abs(c));
  const double bulge = spacing_ * spacing_ / 8 * curvature;
  highest_ = *high + bulge;
  lowest_ = *low - bulge;
  largest_acceleration_ = std::max(*std::max_element(curvatures_.begin(), curvatures_.end()), 0.0);
}

FloorMotion::Motion FloorMotion::motion(double time) const {
  switch (kind_) {
    case Kind::still:
      return {0, 0, 0};
    case Kind::sinusoidal: {
      const double phase = angular_frequency_ * time;
      const double sine = std::sin(phase), cosine = std::cos(phase);
      return {amplitude_ * sine, amplitude_ * angular_frequency_ * cosine,
              -amplitude_ * angular_frequency_ * angular_frequency_ * sine};
    }
    case Kind::tabulated:
      break;
  }
  const double cycle = time / period_ - std::floor(time / period_);
  const double place = cycle * static_cast<double>(heights_.size());
  const std::size_t i = std::min(static_cast<std::size_t>(place), heights_.size() - 1);
  const std::size_t j = (i + 1) % heights_.size();
  const double b = place - static_cast<double>(i), a = 1 - b, h = spacing_;
  const double ci = curvatures_[i], cj = curvatures_[j];
  return {a * heights_[i] + b * heights_[j] + ((a * a * a - a) * ci + (b * b * b - b) * cj) * h * h / 6,
          (heights_[j] - heights_[i]) / h + (-(3 * a * a - 1) * ci + (3 * b * b - 1) * cj) * h / 6, a * ci + b * cj};
}

double FloorMotion::position(double time) const { return motion(time).position; }
double FloorMotion::velocity(double time) const { return motion(time).velocity; }
double FloorMotion::acceleration(double time) const { return motion(time).acceleration; }

double FloorMotion::time_to_contact(double bottom, double vz, double gravity, double now, double horizon) const {
  if (!moves()) {
    if (bottom <= 0 && vz < 0) return 0;
    const double t = time_to_fall(std::max(bottom, 0.0), vz, gravity);
    return t <= horizon ? t : never;
  }
  if (gravity == 0 && bottom > highest_ && vz >= 0) return never;
  double t = bottom > highest_ ? time_to_fall(bottom - highest_, vz, gravity) : 0;
  const double largest_bend = gravity + largest_acceleration_;
  while (t <= horizon) {
    const Motion floor = motion(now + t);
    const double gap = bottom + (vz - 0.5 * gravity * t) * t - floor.position;
    const double gap_rate = vz - gravity * t - floor.velocity;
    if (gap <= 0 && gap_rate < 0) return t;
    if (gravity == 0 && gap + floor.position > highest_ && vz >= 0) return never;
    const double touching = std::max(gap, 0.0);
    double step = step_to_root(touching, gap_rate, largest_bend);
    if (kind_ == Kind::sinusoidal) {
      // A closer bound, good for twice that step: the floor's acceleration -a w^2 sin(p) can grow by a w^2 (d |cos p| +
      // d^2/2) at most while its phase p advances by d.
      const double reach = 2 * step, d = angular_frequency_ * reach;
      const double peak = amplitude_ * angular_frequency_ * angular_frequency_;
      const double growth = std::max(-floor.velocity * angular_frequency_, 0.0) * d + peak * d * d / 2;
      const double bend = gravity + std::min(floor.acceleration + growth, largest_acceleration_);
      step = bend > 0 ? std::min(step_to_root(touching, gap_rate, bend), reach)
                      : (gap_rate < 0 ? std::min(touching / -gap_rate, reach) : reach);
    }
    if (!(t + step > t)) return t;
    t += step;
  }
  return never;
}

}  // namespace shakebed::sim
