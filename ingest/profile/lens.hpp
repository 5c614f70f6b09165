#pragma once
// Pixels that are not square and lenses that distort. Frames are corrected such that a bead is a circle of one size
// everywhere.
//
// Any number of threads may call; values own what they hold.

#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// The map from recorded places to true ones. First columns are stretched by `pixel_aspect`: the length a pixel spans
// across over the length it spans upwards. Then a point at distance r from the middle moves to r (1 + radial (r/h)^2),
// with h half the diagonal. Positive `radial` corrects a barrel, negative a pincushion; the corners move by h * radial.
struct Lens {
  double pixel_aspect = 1;
  double radial = 0;
  [[nodiscard]] bool plain() const { return pixel_aspect == 1 && radial == 0; }
};

struct PixelPlace {
  double x = 0, y = 0;
};

// The lens for frames of one size. True frames are as high as recorded ones and as much wider as their pixels are, with
// a margin for what a barrel's corners move out. Both in the pixel-centre convention.
class LensMap {
 public:
  // Throws std::invalid_argument for an aspect outside 0.5 .. 2 or a radial term outside -0.3 .. 0.3.
  LensMap(const Lens& lens, int recorded_width, int recorded_height);
  [[nodiscard]] const Lens& lens() const { return lens_; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] PixelPlace to_true(PixelPlace recorded) const;
  [[nodiscard]] PixelPlace to_recorded(PixelPlace seen) const;
  // The frame as a plain camera would have recorded it (cubic interpolation; beyond its border its outermost pixels).
  [[nodiscard]] GrayFrame corrected(const GrayFrame& recorded) const;

 private:
  [[nodiscard]] double shrink(double q) const;
  void correct_rows(const GrayFrame& recorded, GrayFrame& frame) const;
  void correct_all(const GrayFrame& recorded, GrayFrame& frame) const;

  Lens lens_;
  int recorded_width_, recorded_height_, width_, height_;
  double margin_x_ = 0, margin_y_ = 0;
  double middle_x_ = 0, middle_y_ = 0, half_diagonal_ = 1;  // stretched, without the margin
};

// A rectangle of a frame, in the frame whose columns are `by` times as wide.
PixelRectangle widened(const PixelRectangle& rectangle, double by);

// The remaining aspect and radial term in frames that were assumed undistorted, from the beads' own rims. Least
// squares, over all whole disks, of the residual on the shift of the rims that each term would cause. Standard errors
// follow from how much the beads differ: pixels of one bead are not independent.
struct LensEstimate {
  bool known = false;  // enough disks
  Lens lens;
  double aspect_std_error = 0, radial_std_error = 0;
  // The radial term by the beads' sizes alone and by their shapes alone, and the standard error of the difference.
  double radial_by_size = 0, radial_by_shape = 0, difference_std_error = 0;
  // Of a lens both are the same; of light, or of sides of thick disks that come into view, they are not.
  [[nodiscard]] bool by_size_and_shape() const;
};
LensEstimate estimate_lens(const std::vector<const GrayFrame*>& frames, const std::vector<FindResult>& found,
                           const FinderCalibration& calibration);

}  // namespace shakebed::ingest
