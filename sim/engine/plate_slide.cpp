#include "sim/engine/plate_slide.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace shakebed::sim {

namespace {

// A step is this share of the time in which the accelerations could take all the speed: errors of Runge and Kutta's
// method are then below 1e-6 of it.
constexpr double step_share = 0.0625;
// A disk counts as one without velocity across the pull below this share of what the accelerations give in the whole
// time: the error is its square.
constexpr double slow_share = 1e-4;

struct Velocity {
  double x, z;
  double speed() const { return std::sqrt(x * x + z * z); }
};

// Along a straight line with constant acceleration.
void go_straight(Slide& slide, double ax, double az, double time) {
  slide.x += (slide.vx + 0.5 * ax * time) * time;
  slide.z += (slide.vz + 0.5 * az * time) * time;
  slide.vx += ax * time;
  slide.vz += az * time;
}

// From rest.
void set_off(Slide& slide, double pull, double deceleration, double time) {
  slide.vx = slide.vz = 0;
  if (std::abs(pull) > deceleration) go_straight(slide, 0, pull - std::copysign(deceleration, pull), time);
}

// On a straight path: until the time is over, or through rest.
void go_along_line(Slide& slide, double pull, double deceleration, double time) {
  const double speed = Velocity{slide.vx, slide.vz}.speed();
  const double nx = slide.vx / speed, nz = slide.vz / speed;
  const double slowing = deceleration - pull * nz;
  if (slowing * time < speed) {
    go_straight(slide, -slowing * nx, -slowing * nz, time);
    return;
  }
  const double stop = speed / slowing;
  slide.x += 0.5 * speed * stop * nx;
  slide.z += 0.5 * speed * stop * nz;
  set_off(slide, pull, deceleration, time - stop);
}

// One step of Runge and Kutta's method; the position is that of the same four slopes.
void go_curved(Slide& slide, double pull, double deceleration, double step) {
  const auto slope = [&](const Velocity& v) {
    const double drag = deceleration / v.speed();
    return Velocity{-drag * v.x, pull - drag * v.z};
  };
  const auto after = [&](const Velocity& a, double time) {
    return Velocity{slide.vx + a.x * time, slide.vz + a.z * time};
  };
  const Velocity a1 = slope({slide.vx, slide.vz}), a2 = slope(after(a1, step / 2)), a3 = slope(after(a2, step / 2)),
                 a4 = slope(after(a3, step));
  slide.x += step * (slide.vx + step / 6 * (a1.x + a2.x + a3.x));
  slide.z += step * (slide.vz + step / 6 * (a1.z + a2.z + a3.z));
  slide.vx += step / 6 * (a1.x + 2 * (a2.x + a3.x) + a4.x);
  slide.vz += step / 6 * (a1.z + 2 * (a2.z + a3.z) + a4.z);
}

}  // namespace

Slide slide(double vx, double vz, double pull, double deceleration, double duration) {
  assert(std::isfinite(vx) && std::isfinite(vz) && deceleration >= 0 && duration >= 0);
  Slide slide{0, 0, vx, vz};
  const double accelerations = deceleration + std::abs(pull);
  if (deceleration == 0) {
    go_straight(slide, 0, pull, duration);
    return slide;
  }
  double left = duration;
  while (left > 0) {
    const double speed = Velocity{slide.vx, slide.vz}.speed();
    if (speed == 0) {
      set_off(slide, pull, deceleration, left);
      return slide;
    }
    if (pull == 0 || slide.vx == 0) {
      go_along_line(slide, pull, deceleration, left);
      return slide;
    }
    if (speed < slow_share * accelerations * duration) {
      set_off(slide, pull, deceleration, left);
      return slide;
    }
    const double step = std::min(left, step_share * speed / accelerations);
    go_curved(slide, pull, deceleration, step);
    left -= step;
  }
  return slide;
}

}  // namespace shakebed::sim
