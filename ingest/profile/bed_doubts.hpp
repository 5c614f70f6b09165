#pragma once
// Whether the disks found make a bed seen from the side: some of them touch, and the lowest lie on a straight floor.

#include <cmath>
#include <string>
#include <vector>

#include "ingest/profile/floor.hpp"
#include "ingest/profile/frame_findings.hpp"

namespace shakebed::ingest {

Contacts contacts_of(const std::vector<FrameFindings>& frames, double radius_px);

// Of the disks of the most frequent size, those that are too many: half of those that overlap another one.
// `touching_px` is the distance between the centres of beads that touch.
double overlapping_too_many(const std::vector<FoundDisk>& disks, double touching_px);

// Columns between which the bed lies, from the disks of all frames: what is beyond are few disks, with nothing between
// them and the bed.
struct BedEnds {
  double left_px = -HUGE_VAL, right_px = HUGE_VAL;
};
BedEnds ends_of_bed(const std::vector<FrameFindings>& frames, double radius_px);
PixelRectangle region_between(const BedEnds& ends, int frame_width, int frame_height);

// How far the lowest disks lie off a straight line along an arc, px at its ends; 0 when they do not lie on an arc.
double sag_of_floor(const FloorPoints& lowest, double diameter_px);

// Sentences for the user, the gravest first.
std::vector<std::string> doubts_of_bed(const Measurement& found, double bead_diameter_m);

}  // namespace shakebed::ingest
