#pragma once
// Floor, walls and lid as the picture shows them: even areas at the border of a frame, ended by a straight line.

#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// A pixel that says nothing about beads. It keeps its place in the frame and is left out of every sum.
// An average over pixels is unseen if one of them is.
inline constexpr float unseen_level = 1e9F;
inline constexpr float brightest_seen = 1e5F;
inline constexpr bool unseen(float level) { return level > brightest_seen; }

enum class FrameSide { bottom, top, left, right };

// An even area along one side of the frame. Its inner end lies `depth_px + slope * place` px inside the outermost
// pixels of that side. `place` is x_px for bottom and top, y_px for left and right. The area reaches from place `from`
// to place `to`.
struct SolidBorder {
  FrameSide side = FrameSide::bottom;
  double depth_px = 0, slope = 0;
  int from = 0, to = 0;
  double level = 0;  // grey levels
};

// Every such area, background without beads among them; one side can have several, each reaching from the side inwards.
// Nothing uneven, no bead that is, ever lies in one. Even means within a tenth of the frame's range of levels, or
// within its noise.
std::vector<SolidBorder> find_solid_borders(const GrayFrame& frame);

// Where two sides have a border each, both reach to their common corner.
void complete_corners(std::vector<SolidBorder>& borders, const GrayFrame& frame);

// The frame with these areas unseen, and `margin_px` more (or, negative, less) of what lies inside them.
GrayFrame without_borders(const GrayFrame& frame, const std::vector<SolidBorder>& borders, double margin_px);

}  // namespace shakebed::ingest
