#pragma once
// What tells a drawing from a photograph: levels without noise, and straight lines of one level along rows or columns.
//
// Round marks of a plot are as round and as much alike as beads. No camera, however, sees areas of one level that are
// not saturated, and none sees a line whose both sides keep their level exactly over a quarter of the frame.

#include <cstddef>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

struct DrawingSigns {
  double flat_share = 0;  // pixels that have the level of their eight neighbours, of all
  // Of the pixels that are neither black nor white and differ by at most 4 grey levels from their neighbours: the share
  // that differs at all. It is 1 when there are hardly any such pixels: black and white areas may be a camera's limits.
  double faint_share = 1;
  std::size_t ruled_lines = 0;  // straight edges along rows and columns, over a quarter of the frame or more
  bool looks_ruled() const;     // as plots, forms and windows of programs are
  bool looks_drawn() const;     // areas without noise
};

// The frame with its levels as recorded: not smoothed.
DrawingSigns signs_of_drawing(const GrayFrame& frame);

// Why circles that make up this share of the picture's edges are marks of a plot or a drawing; nullptr when they may
// be beads.
const char* why_drawn(const DrawingSigns& signs, double explained_share);

}  // namespace shakebed::ingest
