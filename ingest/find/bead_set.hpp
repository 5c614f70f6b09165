#pragma once
// What happens to the beads of one frame while they are fitted: steps, beads taken out, put in, moved back.

#include <cstddef>
#include <vector>

#include "ingest/find/disk_map.hpp"
#include "ingest/find/joint_fit.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

// A bead explains at least this share of the contrast around its place, relative to the median bead.
constexpr double least_explained = 0.72;
// Residuals pull at a bead with at most this, in units of its contrast, or four times the noise.
constexpr double residual_bound = 0.4;
// Below this share of the contrast around it, a place holds no bead.
constexpr double faintly_explained = 0.35;
// Share of the ring around a disk that may be left unexplained.
constexpr double most_unexplained_around = 0.12;

// Beads of the model at these places, from top to bottom.
std::vector<ModelDisk> disks_at(const std::vector<DiskCandidate>& candidates);

Nearby nearby(const std::vector<ModelDisk>& disks, double distance);

// What lies near a bead that came or went has to be fitted again.
void wake(const Nearby& near, std::vector<ModelDisk>& disks, const ModelDisk& changed);

// Takes out beads that explain less than `least` and the worse of two in one place, as judged; puts their share back
// into the residual. Returns how many.
std::size_t prune(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double least);

// Beads that leave much more unexplained than the others are taken out; then all beads that show in the residual are
// put in. A bead taken out in whose place nothing better shows goes back. `disks` have been judged. Returns how many
// places were looked at again.
std::size_t repair(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double noise);

// Two disks much nearer to one another than the beads of this bed are to their neighbours, and one between them.
struct DoubledDisks {
  ModelDisk one, other, merged;
};
// Takes such pairs out of `disks`, not out of the fit. None where beads typically overlap. They have been judged.
std::vector<DoubledDisks> doubled_disks(std::vector<ModelDisk>& disks, double radius);

// After a few sweeps: beads moved by repair() that explain no more than before go back where they were.
// True if there was one.
bool settle(JointFit& fit, std::vector<ModelDisk>& disks, double radius);

// Share of the ring around a disk, as far as it lies in the frame, in which something is left that no bead explains.
double unexplained_around(const JointFit& fit, const ModelDisk& disk, double radius, double edge, double noise);

// How a bead is moved in a fit.
struct StepRules {
  double tolerance = 1e-5;        // px
  double bound = residual_bound;  // contrast units: residuals pull with at most this
  int sweeps = 0;                 // at most
};

// One Newton step of all beads that still move. Then sweeps for the few that have a longer way to go (those cut by the
// frame's edge) and for those they touch. True when nothing moves by more than the tolerance any more.
bool step_all(JointFit& fit, const GrayFrame& flat, std::vector<ModelDisk>& disks, const StepRules& rules);

}  // namespace shakebed::ingest
