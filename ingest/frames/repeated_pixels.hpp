#pragma once
// Pictures that were enlarged by repeating pixels, as some programs do before they export. Their rims are staircases,
// which circles do not fit. For ingest/frames alone.

#include <opencv2/core.hpp>

namespace shakebed::ingest {

// If every pixel stands there at least twice along both sides, replaces the picture by the original pixels, drawn at
// the same size by bilinear interpolation. Returns how many times each pixel stood there along a side; 1 when none did.
double smooth_repeated_pixels(cv::Mat& picture);

}  // namespace shakebed::ingest
