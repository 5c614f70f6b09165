#pragma once
// The bead's own profile, learned from frames once its centres are roughly known.

#include <memory>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/find/joint_fit.hpp"

namespace shakebed::ingest {

// What the residuals of all beads have in common beyond the radial profile: the asymmetry of `current` with that added;
// none when `current` has none and there is no more than noise and small flaws of the model would give.
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

// The circle on which a bead ends, whatever its shading: edges along 32 radii, each of a blurred disk whose light is
// even, falls like a sphere's and grows with the distance, in shares of its own. `profile` has an asymmetry.
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

// Least squares of p(r), a cubic spline with knots `knot_px` apart that vanishes from `reach_px` on, over all pixels
// within reach of any bead of any frame, overlaps taken into account. `fits` hold the residuals with `current` as the
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

// The same as fit_rim, with care: the profile's own errors follow from the noise of a pixel, the number of beads and
// the knots, several shadings are tried (flat; sphere, parabola, cone, quartic and pairs of them), each as recorded and
// in light if levels were encoded for display (see below), and the radius is the mean of what explains the profile
// equally well, its error their scatter and each one's own.
struct RimChoice {
  RimFit rim;
  double exponent = 1;  // of the likeliest; radius and error go over both
};
RimChoice choose_rim(const BeadProfile& profile, const RimConditions& conditions);

// What a camera that encodes for display makes of light: recorded level = light^0.45.
constexpr double display_exponent = 0.45;

// The camera's tone curve: recorded level = light^exponent. A linear camera blurs an edge evenly on its two sides; one
// that encodes for display (exponent 0.45) draws the dark side steep and the bright side long, and puts the edge at
// another place. For rims of flat beads that neither explains down to the noise (clipped levels, glare): both readings,
// each by how well a blurred flat disk fits in it, and the radius as their mean, with an error that holds both unless
// one of them is clearly out. Levels are recorded grey levels; level 0 is taken as no light.
struct ToneFit {
  bool open = false;          // both were tried: the bead is flat, and the linear fit leaves something to explain
  RimFit linear, encoded;     // `encoded` is in light, not in recorded level
  double encoded_weight = 0;  // 0 .. 1
  double radius_px = 0, std_error_px = 0;
};
ToneFit fit_tone_exponent(const BeadProfile& profile, double background_level, double bead_level,
                          double radius_guess_px, double edge_guess_px);

// The profile averaged over the parts of rims that face open background: nothing within several edge widths, each part
// measured from its own background to its own bead.
struct FreeRim {
  std::size_t sectors = 0;  // sixteen to a bead
  double inner_px = 0;      // the profile is known from here outwards
  BeadProfile profile;
};
FreeRim learn_free_rim(const std::vector<GrayFrame>& flats, const std::vector<const std::vector<ModelDisk>*>& disks,
                       double radius_px, double edge_px);

}  // namespace shakebed::ingest
