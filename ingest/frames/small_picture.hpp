#pragma once
// Frames as small pictures to look at.

#include <string>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// At most `width` pixels wide (averaged over pixels), as WebP of a quality from 1 to 100; levels rounded and clamped to
// 0 .. 255. Throws InputError where the frame is empty.
std::string small_webp(const GrayFrame& frame, int width, int quality);

}  // namespace shakebed::ingest
