#pragma once
// Parts and copies of a picture, for searches that need not look at all of it.

#include <optional>
#include <utility>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Half the resolution: averages of 2 x 2 pixels.
GrayFrame halved(const GrayFrame& frame);

// A part of `width` x `height` px whose first pixel is at (left, top).
struct PicturePart {
  int left = 0, top = 0, width = 0, height = 0;
  [[nodiscard]] bool holds(double x, double y) const {
    return x >= left && y >= top && x < left + width && y < top + height;
  }
};
GrayFrame cut_out(const GrayFrame& frame, const PicturePart& part);

// The frame of which all that is farther than `margin_px` from the rectangle is unseen.
GrayFrame seen_inside(GrayFrame frame, const PixelRectangle& rectangle, double margin_px = 0);

// How changes of level are looked for: in blocks of pixels, between pixels `reach` apart, at every `stride`-th column
// of every second row.
struct ChangeSampling {
  int block = 16, reach = 2, stride = 2;  // px
};
// The part of at most `side` x `side` px with the most change of level.
PicturePart busiest_part(const GrayFrame& frame, int side, const ChangeSampling& sampling);

// Size of the correlation of two pictures' levels; 1: they show the same.
double likeness(const GrayFrame& a, const GrayFrame& b);

// (x, y) in a picture, px.
using Places = std::vector<std::pair<double, double>>;
// The part of a picture of width x height px, of at most `side` x `side` px, that holds most of the places.
PicturePart part_with_most(const Places& places, int side, int width, int height);
// The part of that size whose number of places is nearest to half of the most. None where all are filled as much.
std::optional<PicturePart> part_half_filled(const Places& places, int side, int width, int height);

// The two sides of the straight cut across which the texture of a picture changes most. A cut runs along a row or a
// column. Texture is the level, and its changes over one and over four pixels. None where no cut explains much of the
// texture's variance.
std::vector<PicturePart> parts_that_differ(const GrayFrame& frame);

}  // namespace shakebed::ingest
