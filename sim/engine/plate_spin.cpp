#include "sim/engine/plate_spin.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numbers>

namespace shakebed::sim {

namespace {

// A step is this share of the time in which the accelerations could take all of the larger speed.
constexpr double spin_step_share = 0.0625;
// Below this share of what the accelerations give in the whole time the disk is at rest.
constexpr double spin_slow_share = 1e-4;
// See slide_spinning() in the header.
constexpr double small_patch = 0.2, spent_spin = 0.02;

// Complete elliptic integrals of modulus k by the arithmetic-geometric mean: K, and S = 1 - E/K as k^2/2 + rest.
struct Elliptic {
  double k_integral, rest;
};
Elliptic elliptic(double k) {
  double a = 1, g = std::sqrt((1 - k) * (1 + k)), c = k, power = 1, rest = 0;
  while (c > 1e-9 * a) {
    const double next = 0.5 * (a + g);
    g = std::sqrt(a * g);
    c = 0.25 * c * c / next;
    a = next;
    rest += power * c * c;
    power *= 2;
  }
  return {std::numbers::pi / (2 * a), rest};
}

struct PatchState {
  double x, z, vx, vz, rim;  // rim: c |w|
};
struct PatchRates {
  double vx, vz, rim;
};

class SpinPath {
 public:
  SpinPath(PatchState state, double lever, double pull, double deceleration, double duration)
      : state_(state), lever_(lever), pull_(pull), deceleration_(deceleration), left_(duration) {
    accelerations_ = deceleration + std::abs(pull);
    slow_ = spin_slow_share * accelerations_ * duration;
  }
  PatchState end() {
    while (left_ > 0) {
      const double speed = std::hypot(state_.vx, state_.vz), larger = std::max(speed, state_.rim);
      if ((speed == 0 && pull_ == 0) || is_spent(speed)) {
        spin_out();
      } else if (state_.rim == 0 || larger < slow_) {
        only_slide(larger < slow_ ? 0 : 1);
      } else {
        step(std::min(left_, spin_step_share * larger / accelerations_));
      }
    }
    return state_;
  }

 private:
  bool is_held() const { return std::abs(pull_) < (1 - 1e-6) * deceleration_; }
  bool is_spent(double speed) const {
    return lever_ < small_patch && is_held() && state_.rim > 0 && state_.rim < spent_spin * deceleration_ * left_ &&
           speed <= std::max(1.0, 2 * steady()) * state_.rim;
  }
  // epsilon at which friction holds against the pull.
  double steady() const {
    const double wanted = std::abs(pull_) / deceleration_;
    if (wanted == 0) return 0;
    double low = 0, high = 1;
    while (patch_friction(high, 1).force < wanted) low = high, high *= 2;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (patch_friction(middle, 1).force < wanted ? low : high) = middle;
    }
    return 0.5 * (low + high);
  }
  // The spin decreases evenly, until it is over. What is left of another velocity is lost at once.
  void spin_out() {
    const double ratio = steady(), sign = std::copysign(1.0, pull_), relaxation = state_.rim / deceleration_;
    const double braking = lever_ * deceleration_ * patch_friction(ratio, 1).torque;
    const double time = state_.rim < braking * left_ ? state_.rim / braking : left_;
    const double after = time < left_ ? 0 : state_.rim - braking * time;
    state_.x += state_.vx * relaxation;
    state_.z += (state_.vz - sign * ratio * state_.rim) * relaxation + sign * ratio * 0.5 * (state_.rim + after) * time;
    state_.rim = after;
    state_.vx = 0;
    state_.vz = sign * ratio * after;
    left_ = 0;
  }
  // `share` of the velocity is left.
  void only_slide(double share) {
    const Slide way = slide(share * state_.vx, share * state_.vz, pull_, deceleration_, left_);
    state_.x += way.x, state_.z += way.z;
    state_.vx = way.vx, state_.vz = way.vz;
    if (std::abs(pull_) <= deceleration_) state_.rim = 0;
    left_ = 0;
  }
  PatchRates rates(double vx, double vz, double rim) const {
    const double speed = std::hypot(vx, vz);
    if (speed == 0 && !(rim > 0)) return {0, pull_, 0};
    const PatchFriction friction = patch_friction(speed, std::max(rim, 0.0));
    const double drag = speed > 0 ? deceleration_ * friction.force / speed : 0;
    return {-drag * vx, pull_ - drag * vz, rim > 0 ? -lever_ * deceleration_ * friction.torque : 0};
  }
  // Runge and Kutta's method; the position is that of the same four slopes.
  void step(double time) {
    PatchState& s = state_;
    const auto after = [&](const PatchRates& r, double t) {
      return rates(s.vx + t * r.vx, s.vz + t * r.vz, s.rim + t * r.rim);
    };
    const PatchRates r1 = rates(s.vx, s.vz, s.rim), r2 = after(r1, time / 2), r3 = after(r2, time / 2),
                     r4 = after(r3, time);
    s.x += time * (s.vx + time / 6 * (r1.vx + r2.vx + r3.vx));
    s.z += time * (s.vz + time / 6 * (r1.vz + r2.vz + r3.vz));
    s.vx += time / 6 * (r1.vx + 2 * (r2.vx + r3.vx) + r4.vx);
    s.vz += time / 6 * (r1.vz + 2 * (r2.vz + r3.vz) + r4.vz);
    s.rim = std::max(0.0, s.rim + time / 6 * (r1.rim + 2 * (r2.rim + r3.rim) + r4.rim));
    left_ -= time;
  }

  PatchState state_;
  double lever_, pull_, deceleration_, left_, accelerations_, slow_;
};

}  // namespace

// The closed forms of [FarkasEtAl2003]; with S = k^2/2 + rest the terms that cancel are left out.
PatchFriction patch_friction(double speed, double rim) {
  assert(speed >= 0 && rim >= 0 && speed + rim > 0);
  constexpr double pi = std::numbers::pi;
  const bool spins_more = speed < rim;
  const double k = spins_more ? speed / rim : rim / speed, k2 = k * k;
  // At k = 1 K is infinite, and its factors are 0: E = 1 is left.
  if (k > 1 - 1e-12) return {8 / (3 * pi), 8 / (9 * pi)};
  const auto [integral, rest] = elliptic(k);
  const double s = 0.5 * k2 + rest;
  if (spins_more)
    return {k == 0 ? 0 : 4 / (3 * pi) * integral * (1.5 * k2 - rest - k2 * s) / k,
            4 / (9 * pi) * integral * ((4 - 2 * k2) * (1 - s) + k2 - 1)};
  if (k < 1e-100) return {1, 0};
  return {4 / (3 * pi) * integral * (1.5 - s - rest / k2),
          4 / (9 * pi) * integral * (k2 - 4 * rest + 2 * rest / k2) / k};
}

SpinningSlide slide_spinning(double vx, double vz, double rim, double lever, double pull, double deceleration,
                             double duration) {
  assert(lever >= 0 && deceleration >= 0 && duration >= 0);
  if (rim == 0 || deceleration == 0) return {slide(vx, vz, pull, deceleration, duration), rim};
  const PatchState end = SpinPath({0, 0, vx, vz, std::abs(rim)}, lever, pull, deceleration, duration).end();
  return {{end.x, end.z, end.vx, end.vz}, std::copysign(end.rim, rim)};
}

}  // namespace shakebed::sim
