#pragma once
// Are the things round to which circles were fitted?
//
// Around each circle the closed path along the steepest edges is found among all star-shaped ones, by dynamic
// programming in polar coordinates [AminiSnakes]. It has no preference for a circle. The path's radius is expanded in
// harmonics of the direction. Disks have none, apart from noise and the parts hidden by touching neighbours. Ovals have
// the second harmonic, triangles the third, squares the fourth. What is no closed outline, such as the end of a rod,
// leaves a gap that no neighbour explains. Each number is a median over the disks: it holds for the kind, not for a
// single disk.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"

namespace shakebed::ingest {

constexpr int highest_harmonic = 6;  // a hexagon's: beyond it outlines are as round as pixels show

// px, radius: up to this, blur makes the outlines of touching beads look not round.
inline constexpr double coarse_px = 10;

// One side of a straight cut along a row or a column.
struct SideOfCut {
  bool left_or_right = true;  // of a column; else above or below a row
  bool beyond = false;        // right of it, or below it
  double at = 0;              // px
};

// The pixels of that side in a picture of width x height px.
PixelRectangle part_on(const SideOfCut& side, int width, int height);

struct Roundness {
  std::size_t outlines = 0;      // that were followed; 0: nothing was measured
  double on_circle = 1;          // share of a clear outline that lies within a tenth of the radius of the circle
  double gap = 0;                // longest part of the turn without an edge at the circle or a neighbour before it
  double deviation = 0;          // rms of the outline about a circle, radii, without an elongation that all share
  double common_elongation = 0;  // amplitude of the second harmonic that all share, radii
  std::array<double, highest_harmonic + 1> harmonic{};  // amplitudes, radii; from 2 on
  double rim_width = 0;  // over which the level changes, half of the steepest slope or more, radii
  double not_round = 0;  // share of the disks whose own outline is plainly not round
  // Where the outlines on one side of a cut are round and those on the other are not: the side of the round ones.
  std::optional<SideOfCut> round_side;
  [[nodiscard]] bool round() const { return why_not().empty(); }
  [[nodiscard]] std::string why_not() const;  // a sentence, empty if round or not measured
};

// Of circles in a map of edges, all of one kind.
Roundness roundness_of(const EdgeMap& edges, const std::vector<Circle>& circles, Polarity polarity);

}  // namespace shakebed::ingest
