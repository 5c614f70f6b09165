#include "sim/engine/floor_motion.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include "sim/engine/contact_time.hpp"
#include "sim/engine/lanes.hpp"

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

// The first positive root h of gap + gap_rate h - bend h^2/2, gap >= 0, without cancellation; bend > 0 or gap_rate < 0,
// NaN where there is none.
double step_to_root(double gap, double gap_rate, double bend) {
  const double root = std::sqrt(gap_rate * gap_rate + 2 * bend * gap);
  return gap_rate < 0 ? 2 * gap / (root - gap_rate) : (gap_rate + root) / bend;
}

// Sine and cosine of 2 pi frequency (now + later), to about one unit in the last place whatever the number of turns:
// the product and the sum are carried with what their rounding leaves, and whole quarter turns are taken away exactly.
// The same bytes on every machine, which the libraries' functions do not promise.
struct SineCosine {
  double sine, cosine;
};
SineCosine sine_cosine(double frequency, double now, double later) {
  const double time = now + later, from_now = time - now;
  const double time_rest = (now - (time - from_now)) + (later - from_now);
  const double turns = frequency * time;
  const double turns_rest = fused(frequency, time, -turns) + frequency * time_rest;
  const double quarters = std::nearbyint(4 * turns);
  const double nearly = turns - 0.25 * quarters;  // exact, within 1/8
  const double part = nearly + turns_rest, part_rest = turns_rest - (part - nearly);
  constexpr double two_pi = 2 * std::numbers::pi, two_pi_rest = 2.4492935982947064e-16;
  const double x = two_pi * part;
  const double x_rest = fused(two_pi, part, -x) + (two_pi_rest * part + two_pi * part_rest);
  // The series to x^17 and x^18: their remainders are below 1e-18 at pi/4.
  const double y = x * x;
  // Taken in pairs: half as many steps wait for one another.
  const double yy = y * y, y4 = yy * yy;
  const auto pair = [y](double first, double second) { return fused(second, y, first); };
  const double s =
      fused(y4, fused(yy, pair(-1 / 1307674368000.0, 1 / 355687428096000.0), pair(-1 / 39916800.0, 1 / 6227020800.0)),
            fused(yy, pair(-1 / 5040.0, 1 / 362880.0), pair(-1 / 6.0, 1 / 120.0)));
  const double c = fused(
      y4, fused(yy, pair(1 / 20922789888000.0, -1 / 6402373705728000.0), pair(1 / 479001600.0, -1 / 87178291200.0)),
      fused(yy, pair(1 / 40320.0, -1 / 3628800.0), pair(1 / 24.0, -1 / 720.0)));
  const double half = 0.5 * y, one_less = 1 - half;
  const double cosine_of_x = one_less + (((1 - one_less) - half) + fused(yy, c, -x * x_rest));
  const double sine_of_x = x + fused(x * y, s, x_rest * one_less);
  switch (static_cast<std::int64_t>(quarters) & 3) {
    case 0:
      return {sine_of_x, cosine_of_x};
    case 1:
      return {cosine_of_x, -sine_of_x};
    case 2:
      return {-sine_of_x, -cosine_of_x};
    default:
      return {-cosine_of_x, sine_of_x};
  }
}

}  // namespace

FloorMotion::FloorMotion(const StillFloor&) {}

FloorMotion::FloorMotion(const SinusoidalFloor& floor)
    : kind_(Kind::sinusoidal),
      amplitude_(floor.amplitude),
      frequency_(floor.frequency),
      angular_frequency_(2 * std::numbers::pi * floor.frequency),
      period_(1 / floor.frequency),
      highest_(std::abs(floor.amplitude)),
      lowest_(-std::abs(floor.amplitude)),
      largest_acceleration_(std::abs(floor.amplitude) * angular_frequency_ * angular_frequency_),
      largest_jerk_(largest_acceleration_ * angular_frequency_) {
  note_bounds();
}

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
  for (std::size_t i = 0; i < curvatures_.size(); ++i) {
    const double change = curvatures_[(i + 1) % curvatures_.size()] - curvatures_[i];
    largest_jerk_ = std::max(largest_jerk_, std::abs(change) / spacing_);
  }
  note_bounds();
}

// Each parabola touches the floor at its part's beginning and has the least curvature that keeps it above the floor.
// The curvature needed at `later` is a mean of the floor's acceleration until then, weighted by 2 (1 - t/later). It
// changes with `later` by at most a third of the jerk.
void FloorMotion::note_bounds() {
  constexpr std::int64_t looks = 4;  // at the floor, in a part
  const double rounding = 1e-10 * (highest_ - lowest_);
  part_ = period_ / parts;
  parts_a_time_ = parts / period_;
  bounded_for_ = bounded_parts * part_;
  for (std::int64_t k = 0; k < parts; ++k) {
    const double begin = part_ * static_cast<double>(k);
    Motion bound = motion(begin);
    double bend = bound.acceleration;
    for (std::int64_t look = 1; look <= looks * (bounded_parts + 1); ++look) {
      const double later = part_ / looks * static_cast<double>(look);
      const double rise = motion(begin, later).position - bound.position - bound.velocity * later;
      bend = std::max(bend, 2 * rise / (later * later));
    }
    bound.acceleration = bend + largest_jerk_ * part_ / (6 * looks);  // between two looks
    bound.position += rounding;
    bounds_.push_back(bound);
  }
}

// For how long a point in free flight stays above the floor's bound, which lasts bounded_for_.
double FloorMotion::time_above_bound(double bottom, double vz, double gravity, double now) const {
  const double part = std::floor(now * parts_a_time_), since = now - part * part_;
  const Motion& bound = bounds_[static_cast<std::size_t>(static_cast<std::int64_t>(part) & (parts - 1))];
  const double acceleration = std::max(bound.acceleration, -gravity);
  const double gap = bottom - (bound.position + (bound.velocity + 0.5 * acceleration * since) * since);
  const double gap_rate = vz - (bound.velocity + acceleration * since);
  const double time = gap > 0 ? step_to_root(gap, gap_rate, gravity + acceleration) : 0;
  return time < bounded_for_ ? time : bounded_for_;
}

FloorMotion::Motion FloorMotion::motion(double now, double later) const {
  switch (kind_) {
    case Kind::still:
      return {0, 0, 0};
    case Kind::sinusoidal: {
      const auto [sine, cosine] = sine_cosine(frequency_, now, later);
      return {amplitude_ * sine, amplitude_ * angular_frequency_ * cosine,
              -amplitude_ * angular_frequency_ * angular_frequency_ * sine};
    }
    case Kind::tabulated:
      break;
  }
  const double turns = (now + later) / period_, cycle = turns - std::floor(turns);
  const double place = cycle * static_cast<double>(heights_.size());
  const std::size_t i = std::min(static_cast<std::size_t>(place), heights_.size() - 1);
  const std::size_t j = (i + 1) % heights_.size();
  const double b = place - static_cast<double>(i), a = 1 - b, h = spacing_;
  const double ci = curvatures_[i], cj = curvatures_[j];
  return {a * heights_[i] + b * heights_[j] + ((a * a * a - a) * ci + (b * b * b - b) * cj) * h * h / 6,
          (heights_[j] - heights_[i]) / h + (-(3 * a * a - 1) * ci + (3 * b * b - 1) * cj) * h / 6, a * ci + b * cj};
}

// By how much the floor's acceleration can grow, at most, within `later`, which is shorter than half a period.
double FloorMotion::growth(const Motion& floor, double later) const {
  if (kind_ != Kind::sinusoidal) return largest_jerk_ * later;
  // -a w^2 sin(p), while its phase p advances by d: by a w^2 (d max(-cos p, 0) + d^2/2).
  const double d = angular_frequency_ * later;
  return std::max(-floor.velocity * angular_frequency_, 0.0) * d + 0.5 * largest_acceleration_ * d * d;
}

double FloorMotion::time_to_contact(double bottom, double vz, double gravity, double now, double horizon) const {
  assert(std::isfinite(bottom) && std::isfinite(vz) && gravity >= 0 && !std::isnan(horizon));
  if (!moves()) {
    if (bottom <= 0 && vz < 0) return 0;
    const double t = time_to_fall(std::max(bottom, 0.0), vz, gravity);
    return t <= horizon ? t : never;
  }
  if (gravity == 0 && vz >= 0) horizon = std::min(horizon, period_);  // what is not met by then never is
  double t = time_above_bound(bottom, vz, gravity, now);
  if (t >= horizon) return never;
  if (t == bounded_for_) [[unlikely]] {
    if (bottom > highest_) t = std::max(t, time_to_fall(bottom - highest_, vz, gravity));
    while (t < horizon) {
      const double above = time_above_bound(bottom + (vz - 0.5 * gravity * t) * t, vz - gravity * t, gravity, now + t);
      t += above;
      if (above < bounded_for_) break;
    }
  }
  const double rounding = 1e-17 * (highest_ - lowest_);
  const double largest_bend = gravity + largest_acceleration_, longest_step = period_ / 6;
  while (t <= horizon) {
    const Motion floor = motion(now, t);
    const double gap = bottom + (vz - 0.5 * gravity * t) * t - floor.position;
    const double gap_rate = vz - gravity * t - floor.velocity;
    if (gap <= 0 && gap_rate < 0) return t;
    const double touching = std::max(gap, 0.0);
    // The bend is bound for somewhat longer than a straight line takes.
    const double far = gap_rate < 0 ? std::min(1.25 * touching / -gap_rate, longest_step) : longest_step;
    const double bend = gravity + std::min(floor.acceleration + growth(floor, far), largest_acceleration_);
    double step = bend > 0 || gap_rate < 0 ? std::min(far, step_to_root(touching, gap_rate, bend)) : far;
    if (gap <= 0) {
      // It touches and does not approach. Where the floor falls away faster than the point, the gap opens as c h^2/2, c
      // = -F'' here, and changes its bend by J h at most, so that nothing happens before h = 3 c/J. The least step is
      // for c ~ 0: what can be missed in it is below 1e-26 of the amplitude.
      const double opening = -(gravity + floor.acceleration);
      const double reach = opening / largest_jerk_ + 1e-9 * period_;
      if (reach > step) step = reach;
    }
    // Near a root that is not tangent bend and bound are as good as constant: the gap there is no more than the
    // product.
    const bool there = largest_jerk_ * step * step * step < rounding && gap_rate + 4 * largest_bend * step < 0;
    if (there || !(t + step > t)) return t + step <= horizon ? t + step : never;
    t += step;
  }
  return never;
}

}  // namespace shakebed::sim
