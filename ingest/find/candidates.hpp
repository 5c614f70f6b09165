#pragma once
// Places of a flattened frame where a bead may be, and the noise that decides how they are searched for.

#include <vector>

#include "ingest/find/disk_map.hpp"
#include "ingest/find/joint_fit.hpp"

namespace shakebed::ingest {

// Two beads of one film are never seen nearer than this share of a diameter (beads a little in front of one another).
constexpr double least_separation = 0.72;

// Beyond this edge width, in radii, the images of touching beads overlap strongly. The map of the ideal disk then no
// longer separates beads from the voids between them. The map of the learned profile does.
constexpr double strong_blur = 0.14;

// What a place in the map must score to be tried: a strongly blurred bead in a crystal scores 0.7.
constexpr double least_candidate_score = 0.35;

// Those of the places that are not in an unseen part of the frame.
std::vector<DiskCandidate> seen_ones(const GrayFrame& flat, std::vector<DiskCandidate> candidates);

// Noise of a flattened frame from its second differences along rows, of which edges and beads are a minority.
double noise_of(const GrayFrame& flat);

// Typical size of the residual, robust against what is no bead at all.
double residual_spread(const JointFit& fit);

// Standard deviation of the noise in the residual. Its median size would be one of the few levels that an 8-bit frame
// has: for a noise of 5 levels it is 11 % too small. The mean of the smaller half is not.
double residual_noise(const JointFit& fit);

// Places in the map of an ideal disk with at least this score, outside the unseen parts of the frame.
std::vector<DiskCandidate> candidates_in(const GrayFrame& flat, double radius, double noise, double score);

// A bead whose profile is known.
struct KnownBead {
  const BeadProfile& profile;
  double radius_px = 0, edge_px = 0;
};

// The same once the bead's profile is known.
std::vector<DiskCandidate> candidates_by(const KnownBead& bead, const GrayFrame& flat, double noise, double score);

}  // namespace shakebed::ingest
