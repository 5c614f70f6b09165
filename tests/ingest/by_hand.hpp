#pragma once
// Frames made pixel by pixel, for tests that do the same sums a second time.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest::test {

// level_at(column, row) is the level of each pixel.
template <class LevelAt>
inline GrayFrame frame_by(int width, int height, const LevelAt& level_at) {
  GrayFrame frame;
  frame.width = width, frame.height = height;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) frame.pixels.push_back(static_cast<float>(level_at(column, row)));
  return frame;
}
inline GrayFrame even_frame(int width, int height, double level) {
  return frame_by(width, height, [&](int, int) { return level; });
}
inline void set(GrayFrame& frame, int column, int row, double level) {
  frame.pixels[static_cast<std::size_t>(row * frame.width + column)] = static_cast<float>(level);
}

// Something between 0 and 1 that repeats nowhere: the fractional part of a multiple of the golden ratio.
inline double scattered(int column, int row) {
  const double value = 0.6180339887 * column + 0.7548776662 * row + 0.11 * ((column * 7 + row * 13) % 5);
  return value - std::floor(value);
}

// A flat disk of contrast 1 blurred by `edge_px`, at `step_px` apart up to `reach_px`, where it ends at 0.
inline BeadProfile blurred_profile(double radius_px, double edge_px, double reach_px, double step_px = 0.02) {
  BeadProfile profile;
  profile.step_px = step_px;
  for (int k = 0; k * step_px < reach_px; ++k)
    profile.level.push_back(static_cast<float>(blurred_disk_contrast(
        radius_px, edge_px, [](double) { return 1.0; }, k * step_px)));
  profile.level.push_back(0);
  profile.fourth_harmonic.assign(profile.level.size(), 0.0F);
  return profile;
}

// The inverse of a matrix, row by row, by Gauss and Jordan.
inline std::vector<std::vector<double>> inverse_of(std::vector<std::vector<double>> matrix) {
  const std::size_t size = matrix.size();
  std::vector<std::vector<double>> inverse(size, std::vector<double>(size, 0.0));
  for (std::size_t k = 0; k < size; ++k) inverse[k][k] = 1;
  for (std::size_t k = 0; k < size; ++k) {
    const double pivot = matrix[k][k];
    for (std::size_t c = 0; c < size; ++c) matrix[k][c] /= pivot, inverse[k][c] /= pivot;
    for (std::size_t r = 0; r < size; ++r) {
      const double part = matrix[r][k];
      if (r == k) continue;
      for (std::size_t c = 0; c < size; ++c) matrix[r][c] -= part * matrix[k][c], inverse[r][c] -= part * inverse[k][c];
    }
  }
  return inverse;
}

// A disk found at a place.
inline FoundDisk found_at(double x, double y, double radius = 10) {
  FoundDisk disk;
  disk.x_px = x, disk.y_px = y, disk.radius_px = radius;
  return disk;
}

// Whether a text, or one of several, has this part.
inline bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }
inline bool any_holds(const std::vector<std::string>& texts, const std::string& part) {
  return std::any_of(texts.begin(), texts.end(), [&](const std::string& text) { return holds(text, part); });
}

// 150 x 122 px: beads of one level on a ground of 150, blurred by 0.8 px.
inline GrayFrame beads_of_level(const std::vector<RenderedDisk>& disks, double level, double noise = 2) {
  Camera camera;
  camera.width = 150, camera.height = 122;
  camera.background_level = 150, camera.bead_level = level;
  camera.blur_px = 0.8, camera.read_noise = noise;
  return render_frame(disks, camera);
}

}  // namespace shakebed::ingest::test
