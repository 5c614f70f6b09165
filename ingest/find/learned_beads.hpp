#pragma once
// What learning leaves behind for the radius: the frames learned from, flattened, and the beads in them. For the .cpp
// files of the finder alone.

#include <memory>
#include <vector>

#include "ingest/find/disk_map.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/joint_fit.hpp"

namespace shakebed::ingest {

struct LearnedBeads {
  std::vector<GrayFrame> seen, flats;
  std::vector<std::unique_ptr<JointFit>> fits;  // their residuals
  std::vector<std::vector<ModelDisk>> disks;
  double knot = 0.25;                              // px, of the profile
  double spread = 0.1;                             // of the residuals, contrast units
  bool hold_radius = false, learn_profile = true;  // as asked for
  bool noted = false;
  [[nodiscard]] std::size_t total() const {
    std::size_t sum = 0;
    for (const auto& one : disks) sum += one.size();
    return sum;
  }
  [[nodiscard]] std::vector<const JointFit*> fit_pointers() const {
    std::vector<const JointFit*> pointers;
    for (const auto& fit : fits) pointers.push_back(fit.get());
    return pointers;
  }
  [[nodiscard]] std::vector<const std::vector<ModelDisk>*> disk_pointers() const {
    std::vector<const std::vector<ModelDisk>*> pointers;
    for (const auto& one : disks) pointers.push_back(&one);
    return pointers;
  }
};

// How far the edge's blur reaches beyond the radius.
inline double reach_of(double radius, double edge) { return radius + 3.2 * edge + 0.4; }

// Steps use a gradient widened to about this edge while beads may still be off by half a pixel.
double softening_for(double edge);

// Distance of the knots of a profile.
double knot_for(double radius, double edge);

// The standard error of a radius that follows from the rims of `beads` beads under noise `spread` (contrast units),
// with `doubt` about the shading.
double radius_error(const FinderCalibration& calibration, double spread, double beads, double doubt);

// find_disks() that begins with beads at these places, those that are seen, in place of a search.
FindResult find_disks_from(const std::vector<DiskCandidate>& places, const GrayFrame& frame,
                           const FinderCalibration& calibration, const FindOptions& options);

// The frame with floor, walls and lid unseen, before beads of about this radius are known.
GrayFrame without_walls(const GrayFrame& frame, Polarity polarity, double radius_px);

// Throws std::invalid_argument when the frame's pixel count is not width * height.
void require_consistent(const GrayFrame& frame);

}  // namespace shakebed::ingest
