#pragma once
// Beads that lie close, found by their faces alone.
//
// Where small beads touch, their rims show only in the voids between them, and blur moves what shows inwards: circles
// through these rims are too small, or no circles. The joint fit of all faces (find_disks.hpp) describes such a picture
// to its noise. Nothing else than touching disks does both: leave no more than noise, and fit disks whose
// neighbours lie one fitted diameter away.

#include <optional>
#include <string>
#include <vector>

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
  double filled = 0;       // share of the frame
  [[nodiscard]] bool convinces() const;
};

// Of the disks found in a frame of the film that `faces` was learned from.
Packing packing_of(const GrayFrame& frame, const FindResult& found, const FinderCalibration& faces);

struct PackedBed {
  CalibrationResult faces;  // with its radius (tell_radius); found only if the packing convinces
  Packing packing;
  std::vector<FoundDisk> disks;  // of the last frame
};

// From the radius in `options`, or with nothing to start from.
PackedBed learn_packed_bed(const std::vector<const GrayFrame*>& frames, const FindOptions& options);

// What rims of such beads would be like, for those who ask how many beads are missed.
RimModel rims_of(const FinderCalibration& faces);

// Half the distance at which most of these circles have their nearest neighbour, which is the radius of beads that
// touch; nothing where the nearest neighbours lie at all distances.
std::optional<double> touching_radius(const std::vector<Circle>& circles);

// px of the frame: rims of larger disks are seen well.
inline constexpr double largest_packed_px = 14;

// Where a survey may begin.
struct PackedStart {
  Polarity polarity = Polarity::automatic;
  std::optional<double> radius_px;
};
// The first start that leads to small beads. Of a large picture a part must convince before all of it is looked at.
std::optional<PackedBed> look_for_packed_bed(const GrayFrame& frame, const std::vector<PackedStart>& starts);

}  // namespace shakebed::ingest
