#pragma once
// The bead's own profile, learned from frames once its centres are roughly known.

#include <memory>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/find/joint_fit.hpp"

namespace shakebed::ingest {

// The asymmetry of a bead: what the residuals of all beads have in common beyond the radial profile, added to the
// asymmetry of `current`. None when `current` has none and the residuals are no larger than noise and small errors of
// the model.
struct AsymmetryFit {
  double radius_px = 0;
  double noise = 0;  // contrast units
  int row_step = 1;  // only every so many rows of pixels are used
};
std::shared_ptr<const BeadAsymmetry> learn_asymmetry(const std::vector<const JointFit*>& fits,
                                                     const std::vector<const std::vector<ModelDisk>*>& disks,
                                                     const BeadProfile& current, const AsymmetryFit& how);

// The same bead seen from a point (by_x, by_y) px beside its centre. `profile` has an asymmetry.
BeadProfile recentred(const BeadProfile& profile, double by_x, double by_y);

// The circle on which a bead ends, whatever its shading. Edges are fitted along 32 radii. Each edge is that of a
// blurred disk whose light is a sum of three parts: even, falling like a sphere's, growing with the distance. `profile`
// has an asymmetry.
struct Outline {
  bool good = false;
  double x_px = 0, y_px = 0;  // its middle, from the profile's centre
  double radius_px = 0;
};
Outline outline_of(const BeadProfile& profile, double radius_px, double edge_px);

// The rim of a profile: radius and edge width of the disk that, blurred by a Gaussian, draws it.
struct RimFit {
  bool good = false;
  double radius_px = 0, edge_px = 0;
  double misfit = 0;        // rms of profile minus fit over the bead's area, contrast units
  double squares = 0;       // weighted sum of squares
  double std_error_px = 0;  // of the radius, if the weights are inverse variances
};

// An evenly bright disk with a Gaussian edge.
BeadProfile ideal_profile(double radius_px, double edge_px, double reach_px);

// Least squares of p(r), a cubic spline with knots `knot_px` apart that vanishes from `reach_px` on. All pixels within
// reach of any bead of any frame are used, and overlaps are included. `fits` hold the residuals with `current` as the
// model of `disks`.
struct ProfileFit {
  double reach_px = 0, knot_px = 0, radius_px = 0;
  bool fourth_harmonic = false;  // learn p4(r) around the rim as well
  int row_step = 1;              // only every so many rows of pixels are used
};
BeadProfile learn_profile(const std::vector<const JointFit*>& fits,
                          const std::vector<const std::vector<ModelDisk>*>& disks, const BeadProfile& current,
                          const ProfileFit& how);

// Radius and edge of a learned profile, started from a guess. Shading is fitted along with them: a sum of a flat disk,
// a sphere's sqrt(1 - rho^2) and a parabola.
RimFit fit_rim(const BeadProfile& profile, double radius_guess_px, double edge_guess_px);

// What is known of a profile whose rim is looked for.
struct RimConditions {
  double radius_px = 0, edge_px = 0;            // first values
  double knot_px = 0;                           // distance of the profile's knots
  double noise = 0;                             // of a pixel, contrast units
  double beads = 0;                             // number it was learned from
  double background_level = 0, bead_level = 0;  // grey levels
  double from_px = 0;                           // the profile is known from here outwards
  bool linear_only = false;                     // levels grow as light does: do not try an encoded camera
};

// The same as fit_rim, with error estimates. The profile's errors follow from the noise of a pixel, the number of beads
// and the knots. Several shadings are tried: flat, sphere, parabola, cone, quartic, and pairs of them. Each is tried in
// recorded levels and, if levels were encoded for display, in light (see below). The radius is the mean over the models
// that explain the profile equally well. Its error combines their scatter and the error of each.
struct RimChoice {
  RimFit rim;
  double exponent = 1;  // of the likeliest; radius and error go over both
};
RimChoice choose_rim(const BeadProfile& profile, const RimConditions& conditions);

// What a camera that encodes for display makes of light: recorded level = light^0.45.
constexpr double display_exponent = 0.45;

// The camera's tone curve: recorded level = light^exponent. A linear camera blurs an edge evenly on its two sides. One
// that encodes for display (exponent 0.45) makes the dark side steep and the bright side long, and shifts the edge.
// Some rims of flat beads fit neither model down to the noise (clipped levels, glare). Both models are then fitted, and
// each is weighted by how well a blurred flat disk fits. The radius is their mean. Its error covers both, unless one of
// them is clearly excluded. Levels are recorded grey levels; level 0 means no light.
struct ToneFit {
  bool open = false;          // both were tried: the bead is flat, and the linear fit leaves something to explain
  RimFit linear, encoded;     // `encoded` is in light, not in recorded level
  double encoded_weight = 0;  // 0 .. 1
  double radius_px = 0, std_error_px = 0;
};
ToneFit fit_tone_exponent(const BeadProfile& profile, double background_level, double bead_level,
                          double radius_guess_px, double edge_guess_px);

constexpr int sectors_of_bead = 16;
// The profile averaged over the parts of rims that face open background: nothing within several edge widths, each part
// measured from its own background to its own bead.
struct FreeRim {
  std::size_t sectors = 0;  // sectors_of_bead to a bead
  double inner_px = 0;      // the profile is known from here outwards
  BeadProfile profile;
};
FreeRim learn_free_rim(const std::vector<GrayFrame>& flats, const std::vector<const std::vector<ModelDisk>*>& disks,
                       double radius_px, double edge_px);

}  // namespace shakebed::ingest
