#pragma once
// Found circles drawn on the frame they were found in.

#include <filesystem>
#include <optional>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// Pixels: a larger overlay takes longer to write than the disks to find, and pages cannot hold it. Ten million pixels
// are more than a screen shows.
inline constexpr double most_overlay_pixels = 1e7;

struct OverlayOptions {
  int magnification = 2;           // px of the overlay per px of the frame; large frames are reduced instead
  std::optional<double> floor_px;  // draw the floor: y_px at the left edge of the frame ...
  double floor_slope = 0;          // ... and its slope (px down per px right)
  std::optional<double> left_wall_px, right_wall_px;
};

// Writes a colour PNG: green circles for beads, orange for cut or half-hidden ones, blue lines for floor and walls.
// Atomic. Throws OutputError if it cannot be written.
void write_overlay(const std::filesystem::path& path, const GrayFrame& frame, const std::vector<FoundDisk>& disks,
                   const OverlayOptions& options = {});

// The learned bead as a picture, `magnification` px of it per px of the frame, in the frame's own grey levels.
GrayFrame bead_picture(const FinderCalibration& calibration, int magnification);

}  // namespace shakebed::ingest
