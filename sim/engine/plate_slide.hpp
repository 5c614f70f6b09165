// A disk that slides on a plate: Coulomb friction and a constant pull in one direction. Reduced units.
#pragma once

namespace shakebed::sim {

// In the frame of the plate: how far the disk goes in a time, and the velocity that it has then.
struct Slide {
  double x = 0, z = 0;
  double vx = 0, vz = 0;
};

// dv/dt = pull z - deceleration v/|v|, from the velocity (vx, vz), for `duration`. A disk that comes to rest stays
// there if |pull| <= deceleration: static friction is as large as kinetic friction. Exact but for rounding where the
// path is straight (no pull, or no velocity across it); else by steps that follow the speed, to 1e-6 of duration^2
// times the accelerations. deceleration >= 0, duration >= 0.
Slide slide(double vx, double vz, double pull, double deceleration, double duration);

}  // namespace shakebed::sim
