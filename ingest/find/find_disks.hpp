#pragma once
// Disks in a frame, to a hundredth of a pixel, with nothing to guess.
//
// Steps: flatten -> chi-squared map of an ideal disk -> interior test -> joint least squares over touching neighbours.
// The joint fit uses the bead's own radial profile, learned from the frames, with fitted radius and edge width
// [ShattuckChiSquared].
//
// Any number of threads may call; values own what they hold.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/calibrate/flatten.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// One disk found. Centre in the pixel-centre convention.
struct FoundDisk {
  double x_px = 0, y_px = 0;
  double radius_px = 0;                   // of the species, one value a film
  double variance_x = 0, variance_y = 0;  // px^2, from the fit's curvature and the frame's noise
  double covariance_xy = 0;               // px^2
  double quality = 0;                     // 0 .. 1: 1 is a bead like all the others
  double contrast = 0;                    // its own contrast, 1 for a typical bead
  double probability = 1;                 // that it is a bead; 1 unless rims were looked at (learn_beads.hpp)
  bool cut = false;                       // cut by the border of the frame or of the region of interest
  bool other_size = false;                // radius_px is its own, not that of the most frequent beads
  bool half_hidden = false;               // part of it does not look like a bead: covered, out of focus, in shadow
};

// Their places and radii alone.
std::vector<Circle> circles_of(const std::vector<FoundDisk>& disks);

// What a survey of the film's first frame has shown (survey.hpp).
struct BeadsSeen {
  Polarity polarity = Polarity::automatic;
  double radius_px = 0;
  bool one_sided = false;  // one side of the rim is hardly seen: the radius is that of a part of the bead
  bool no_faces = false;   // they were searched for their faces in vain (SurveyCandidate::no_faces)
  bool thorough = false;   // in a part of it a thorough search by rims showed clearly more than a quick one
  bool operator==(const BeadsSeen&) const = default;
};

// Everything is found when left alone; each member overrides one finding.
struct FindOptions {
  Polarity polarity = Polarity::automatic;
  std::optional<double> radius_px{};  // a first value, refined unless hold_radius
  bool hold_radius = false;           // keep radius_px exactly
  // Beyond it none is looked for. Where radius_px is given, 0.8 to 1.25 times that is looked for instead.
  std::optional<double> largest_radius_px{};
  // Smaller beads are of no use: none are learned where all circles seen are much smaller and no radius is given.
  std::optional<double> smallest_radius_px{};
  std::optional<BeadsSeen> seen{};      // for learn_beads()
  bool one_size = false;                // learn_beads() looks for no beads of other sizes
  bool rims_of_one_size = false;        // learn_beads() searches rims at a higher resolution for one size only
  bool quick_rims = false;              // learn_beads() searches rims quickly, whatever it misses
  bool quick_rims_only = false;         // learn_beads() looks at no faces, and searches rims quickly
  bool any_shape = false;               // things that are not round may be beads
  std::optional<PixelRectangle> roi{};  // centres outside are not reported
  int joint_fit_sweeps =
      20;  // at most; few frames need more than 12; 0 stops at the peaks of the map: fast, about 0.1 px
  bool learn_profile = true;      // false keeps the ideal disk with a Gaussian-blurred edge
  bool keep_half_hidden = false;  // report beads that fail the interior test, flagged
  bool learn_rim = false;         // fill FindResult::profile
  double recorded_px = 1;         // px as recorded to one px of the frame: messages state the former
  bool distances = false;         // levels are distances from the background: 0 along a line across each lit sphere

  // Why nothing can be found with these options, one sentence each; empty when it can.
  [[nodiscard]] std::vector<std::string> validate() const;
  bool operator==(const FindOptions&) const = default;
};

// What is common to all frames of a film, learned from its first frames.
struct FinderCalibration {
  Polarity polarity = Polarity::automatic;
  double radius_px = 0;
  double radius_std_error_px = 0;
  double rim_radius_px = 0;   // where the recorded profile has its edge: radius_px unless the tone curve moves it
  double edge_width_px = 0;   // sigma of the blurred edge, the pixel's own 0.29 px included
  double noise_level = 0;     // sigma of the residuals in grey levels, away from edges
  double residual_level = 0;  // median size of the residuals as a sigma, grey levels: what disks are searched with
  double contrast_level = 0;  // bead minus background, grey levels, at the middle of the frame
  bool radius_of_all_rims = false;  // from the profile below, the rims of all beads, not of open ones alone
  double tone_exponent = 1;         // recorded level = light^exponent, from the rims; 1 for a linear camera
  bool solid_borders = false;       // floor, walls or lid are in view; each frame is searched without them
  int width = 0, height = 0;        // of the frames it was learned from
  double recorded_px = 1;           // px as recorded to one px of these frames (FindOptions)
  BeadProfile profile;
  LightField light;
  std::vector<float> level_deciles;  // of the first of its frames: 10 %, 20 % .. 90 %
  std::size_t frames_used = 0;
  std::size_t disks_used = 0;
  std::vector<std::string> warnings;  // plain sentences
  // Of a film that was surveyed (learn_beads.hpp):
  std::optional<RimModel> rims;
  double expected_missed = 0;                            // share of the beads that are not reported (missed_beads.hpp)
  bool by_rims = false;                                  // beads are found by rims alone: light and profile are empty
  bool rims_to_be_checked = false;                       // faces without a rim occur, and are dropped
  std::shared_ptr<const FinderCalibration> other_shade;  // of beads brighter or darker than these (other_shade.hpp)
  // Where faces fit, but none has a rim, as in surroundings as bright as the beads: 1 for each pixel that is left out.
  std::shared_ptr<const std::vector<std::uint8_t>> left_out;
};

struct FindResult {
  std::vector<FoundDisk> disks;  // from top to bottom, then left to right
  std::size_t rejected = 0;      // disks of another size or clarity seen and not reported
  double residual_level = 0;     // rms of frame - model over the beads, grey levels
  FrameLight light;              // of this frame
  std::size_t steps = 0;         // of single beads, in fitting them
  std::string why_nothing;       // a sentence when disks is empty
  BeadProfile profile;           // learned from this frame's beads, if asked for
  std::size_t profile_beads = 0;
  [[nodiscard]] bool empty() const { return disks.empty(); }
};

// Learns from frames of one film (all of one size; two or three suffice). `found == false` with a reason when the
// frames show no disks: a blank frame, noise, something else.
struct LearnedBeads;
struct CalibrationResult {
  bool found = false;
  FinderCalibration calibration;
  std::string why_not;
  bool complete = false;  // by learn_finder() and learn_again(): beads and light explain the frame down to its noise
  std::shared_ptr<LearnedBeads> beads;  // for tell_radius()
  bool packed = false;  // a model of disks that touch describes the last frame: nothing among them is anything else
  std::optional<FindResult> in_last_frame;  // by learn_beads(), as far as it looked
};
CalibrationResult calibrate_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options = {});

// The same in two parts, for who may have to learn again from frames put right: all that finding needs, radius_px being
// that of the rims as recorded, ...
CalibrationResult learn_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options = {});
// ... the same from frames that differ by less than a hundredth in place from those of `before` ...
CalibrationResult learn_again(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                              const FinderCalibration& before);
// ... and the radius behind shading, blur and tone curve, with its error.
void tell_radius(CalibrationResult& result);

// The frame with floor, walls and lid unseen (see solid_borders.hpp).
GrayFrame seen_part(const GrayFrame& frame, const FinderCalibration& calibration);

// Finds the disks of one frame of that film. Depends on nothing but its arguments. Throws std::invalid_argument when
// the frame's pixel count is not width * height.
FindResult find_disks(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options = {});

// The radius from several frames' rims: their profiles averaged. Frames in any order; the result depends on the order
// only by rounding.
constexpr std::size_t rim_frames = 10;  // of a film are enough
class RadiusFromFrames {
 public:
  void add(const FindResult& found);  // found with learn_rim
  // Puts radius and error into the calibration the frames were searched with; leaves it alone when the frames tell
  // nothing new.
  void refine(FinderCalibration& calibration) const;

 private:
  double step_px_ = 0;
  std::vector<double> sums_;
  std::size_t beads_ = 0, frames_ = 0;
};

// Both in one call, for a single photograph.
FindResult find_disks(const GrayFrame& frame, const FindOptions& options = {},
                      FinderCalibration* calibration_found = nullptr);

// The frame minus the model of background and found disks, in grey levels: what the model does not explain.
GrayFrame residual_frame(const GrayFrame& frame, const FindResult& found, const FinderCalibration& calibration);

}  // namespace shakebed::ingest
