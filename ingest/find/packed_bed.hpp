#pragma once
// Beads that lie close, or are lit from one side, found by their faces.
//
// Where small beads touch, their rims show only in the voids between them, and blur moves what shows inwards: circles
// through these rims are too small, or no circles. The joint fit of all faces (find_disks.hpp) describes such a picture
// to its noise. Nothing else than touching disks does both: leave no more than noise, and fit disks whose
// neighbours lie one fitted diameter away. Spheres lit from one side need not touch: circles show a part of them, and
// their lit rims (lit_rim.hpp) whether they are round.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/rim_finder.hpp"

namespace shakebed::ingest {

// How well disks of one size that touch describe a frame.
struct Packing {
  std::size_t disks = 0;
  double touching = 0;     // share of the whole disks that have two neighbours or more one diameter away
  double overlapping = 0;  // share of the disks with a neighbour much nearer than that
  double unexplained = 0;  // share of the pixels on and beside the disks where the model is plainly off
  double misfit = 0;       // rms of these pixels' residuals over that of the noise alone
  double filled = 0;       // share of the upright rectangle round the disks, as far as it is seen
  double noise = 0;        // over the contrast
  double shown = 0;        // share of the disks that a circle shows as well, where circles are known
  bool lit = false;        // the model of a disk is brighter on one side
  bool distances = false;  // of levels that are distances from the background
  // Rms distance of the rim on that side from the circle of the disks, radii, where circles are known.
  double unevenness = HUGE_VAL;
  // Disks that touch, or lit ones that circles show, and what is beside them; and these lie close.
  [[nodiscard]] bool describes() const;
  [[nodiscard]] bool convinces() const;
};

// Of the disks found in a frame of the film that `faces` was learned from.
Packing packing_of(const GrayFrame& frame, const FindResult& found, const FinderCalibration& faces);

struct PackedBed {
  CalibrationResult faces;  // with its radius (tell_radius); found only if the packing describes the bed
  Packing packing;
  std::vector<FoundDisk> disks;  // of the last frame
  // Where larger beads were looked for in a reduced frame: this frame, whose px all lengths are, and its reduction.
  GrayFrame reduced_frame{};
  int reduction = 1;
};

// Whether faces learned from these frames are those of disks that touch. `faces`: from learn_finder(), found.
// `circles`: centres of circles that were seen in the last frame, if any.
PackedBed packed_bed_of(CalibrationResult faces, const std::vector<const GrayFrame*>& frames,
                        const FindOptions& options, const Places& circles = {});

// From the radius in `options`, or with nothing to start from. `beads`: as in learn_finder_from_part().
PackedBed learn_packed_bed(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                           const Places& beads = {});

// What rims of such beads would be like, for those who ask how many beads are missed.
RimModel rims_of(const FinderCalibration& faces);

// Half the distance at which most of these circles have their nearest neighbour, which is the radius of beads that
// touch; nothing where the nearest neighbours lie at all distances.
std::optional<double> touching_radius(const std::vector<Circle>& circles);

// The same, where it is so much more than the radius of the circles that their nearest neighbours do not touch, but may
// be parts of disks that do. If two neighbours are farther apart, they do not touch, however alike their distances.
std::optional<double> radius_beyond(const std::vector<Circle>& circles, double radius_px);

// px of the frame: rims of larger disks are seen well.
inline constexpr double largest_packed_px = 14;

// Where a survey may begin.
struct PackedStart {
  Polarity polarity = Polarity::automatic;
  std::optional<double> radius_px;
  // Centres of circles of which one side is missing: beads of any size, worth a look at all of the picture.
  Places lit{};
  bool distances = false;  // levels are distances from the background
};
// The first start that leads to small beads, or to lit ones. Of a large picture a part must convince before all of it
// is looked at. Where beads are lit all of it is looked at: a part may show no background, whose level is then not
// known.
std::optional<PackedBed> look_for_packed_bed(const GrayFrame& frame, const std::vector<PackedStart>& starts);

}  // namespace shakebed::ingest
