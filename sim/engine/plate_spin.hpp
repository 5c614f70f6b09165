// A disk that slides and spins on a plate at once. Reduced units.
//
// It touches the plate with a patch: a circle of radius c, evenly pressed. Each point of the patch rubs against its own
// velocity v + w x r. The mean over the patch gives a force and a torque. They depend on the ratio of sliding
// to spinning alone, epsilon = v/(c |w|) [FarkasEtAl2003]. A disk that spins fast slides almost without friction, and
// one that slides fast spins almost without friction.
#pragma once

#include "sim/engine/plate_slide.hpp"

namespace shakebed::sim {

// The force over that of a disk that only slides, mu N, and the torque over mu N c. For small epsilon they are epsilon
// and 2/3, for large epsilon 1 and 1/(4 epsilon). speed, rim: v and c |w|, not negative and not both 0.
struct PatchFriction {
  double force, torque;
};
PatchFriction patch_friction(double speed, double rim);

// The patch of one disk. lever: c^2/(q R^2), q = I/(m R^2), by which friction slows down c |w| more than v.
struct SpinningSlide {
  Slide way;
  double rim = 0;  // c w, with the sign of w
};

// As slide(), of a disk that also spins with c w = rim. A disk that does not spin slides as there. One that only spins,
// without a pull, is exact but for rounding: it stops after 3 |rim|/(2 lever deceleration). Else by steps that follow
// the larger of both speeds, to 1e-5 of duration^2 times the accelerations. The end is simpler for a small patch, lever
// below 0.2: where |rim| is below 0.02 deceleration times the time left, the pull and the friction hold each other.
SpinningSlide slide_spinning(double vx, double vz, double rim, double lever, double pull, double deceleration,
                             double duration);

}  // namespace shakebed::sim
