#pragma once
// Uneven light taken out: a frame becomes 0 on the background and 1 on a bead.

#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Smooth fields of light over a frame, bilinear between nodes `spacing_px` apart (node (0, 0) at pixel (0, 0)).
struct LightField {
  double spacing_px = 0;
  int columns = 0, rows = 0;
  std::vector<float> background;  // grey level where there is no bead
  std::vector<float> contrast;    // bead level minus background level (negative for dark beads)
};

// First estimate, from the levels' envelopes over blocks of several diameters (needs the radius to a factor of 2).
LightField estimate_light(const GrayFrame& frame, double radius_px, Polarity polarity);

// How the light of one frame differs from the film's: background + contrast * shift instead of background, and
// contrast * gain. A lamp that flickers changes both, a bright door the first alone.
struct FrameLight {
  double shift = 0, gain = 1;  // contrast units
  [[nodiscard]] bool plain() const { return shift == 0 && gain == 1; }
};

// (frame - background) / contrast at every pixel: 0 background, 1 bead. Same size as the frame.
GrayFrame flatten(const GrayFrame& frame, const LightField& light, const FrameLight& own = {});

}  // namespace shakebed::ingest
