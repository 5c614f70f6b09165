#pragma once
// The bead's own profile, learned from frames once its centres are roughly known.

#include <vector>

#include "ingest/calibration.hpp"
#include "ingest/joint_fit.hpp"

namespace shakebed::ingest {

// The rim of a profile: radius and edge width of the disk that, blurred by a Gaussian, draws it.
struct RimFit {
  bool good = false;
  double radius_px = 0, edge_px = 0;
  double misfit = 0;  // rms of profile minus fit, contrast units
};

// An evenly bright disk with a Gaussian edge.
BeadProfile ideal_profile(double radius_px, double edge_px, double reach_px);

// Least squares of p(r), a cubic spline with knots `knot_px` apart that vanishes from `reach_px` on, over all pixels
// within reach of any bead of any frame, overlaps taken into account. `fits` hold the residuals with `current` as the
// model of `disks`. With `fourth_harmonic` also p4(r) around the rim.
BeadProfile learn_profile(const std::vector<const JointFit*>& fits,
                          const std::vector<const std::vector<ModelDisk>*>& disks, const BeadProfile& current,
                          double reach_px, double knot_px, double radius_px, bool fourth_harmonic);

// Radius and edge of a learned profile, started from a guess. Shading is fitted along with them: a sum of a flat disk,
// a sphere's sqrt(1 - rho^2) and a parabola.
RimFit fit_rim(const BeadProfile& profile, double radius_guess_px, double edge_guess_px);

}  // namespace shakebed::ingest
