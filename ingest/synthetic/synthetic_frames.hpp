#pragma once
// Frames drawn from disks whose centres are known: a camera's view of a bed, with every imperfection under control.
//
// The chain is that of a camera:
//   radiance of background and beads (shading)
//   -> average over the exposure (motion blur)
//   -> optical blur (Gaussian)
//   -> integral over each square pixel
//   -> illumination (gradient, vignette)
//   -> shot and read noise -> JPEG -> rounding to 8 bits.
// Pixel integrals are exact for sharp disks and by Gauss-Legendre quadrature for blurred ones. Centres drawn without
// noise are true to 1e-3 px.
//
// A value owns what it holds. Any number of threads may draw, also with one renderer.

#include <cstdint>
#include <memory>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// A disk to be drawn: centre at the middle of the exposure (pixel-centre convention), velocity over the exposure.
struct RenderedDisk {
  double x_px = 0, y_px = 0;
  double radius_px = 0;
  double velocity_x_px_per_s = 0, velocity_y_px_per_s = 0;
};

enum class BeadShading {
  flat,       // the same level everywhere
  shaded,     // a sphere: level goes from the rim's to the centre's as sqrt(1 - rho^2), rho = r/R
  highlight,  // shaded, with a small bright spot up and left of the centre
};

// The camera and the light. Levels are grey levels of 0 .. 255.
struct Camera {
  int width = 0, height = 0;      // px, required
  double background_level = 200;  // where there is no bead
  double bead_level = 60;         // dark beads by default; bright ones have bead_level > background_level
  BeadShading shading = BeadShading::flat;
  double shading_depth = 0.35;            // shaded, highlight: (centre - rim) as a fraction of (background - bead)
  double highlight_level = 0.6;           // highlight: its level, as a fraction from bead_level to background_level
  double blur_px = 0;                     // sigma of the optical blur
  double exposure_s = 0;                  // shutter time; disks are smeared along their velocity
  double gradient_x = 0, gradient_y = 0;  // relative change of the light from one side of the frame to the other
  double vignette = 0;              // relative loss of light in the corners (quadratic in the distance to the centre)
  double read_noise = 0;            // sigma, grey levels
  double shot_noise = 0;            // sigma at level 255; sigma = shot_noise sqrt(level/255)
  int jpeg_quality = 0;             // 1 .. 100 passes the frame through JPEG; 0 does not
  double dust_fraction = 0;         // area covered by specks of random size, level and place (fixed for a seed)
  double dust_size_px = 3;          // mean speck diameter
  double transparent_fraction = 0;  // part of the disks drawn as transparent beads: a dark rim, a bright middle
  double missing_fraction = 0;      // part of the disks not drawn at all
  bool round_to_8_bits = true;
  std::uint64_t seed = 1;
};

// What was drawn of each disk given.
enum class DrawnAs : std::uint8_t { opaque, transparent, missing };

// Draws frames. Construction prepares the light, dust and edge tables. render() is const and thread-safe. Its result
// depends only on camera, disks and frame_index (noise and choices are drawn from seed and frame_index).
class FrameRenderer {
 public:
  // Throws std::invalid_argument for sizes or levels out of range.
  explicit FrameRenderer(const Camera& camera);
  ~FrameRenderer();
  FrameRenderer(FrameRenderer&&) noexcept;
  FrameRenderer& operator=(FrameRenderer&&) noexcept;

  // Disks outside the frame are allowed (and cut). `drawn_as`, if given, receives one entry per disk.
  [[nodiscard]] GrayFrame render(const std::vector<RenderedDisk>& disks, std::uint64_t frame_index = 0,
                                 std::vector<DrawnAs>* drawn_as = nullptr) const;
  [[nodiscard]] const Camera& camera() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The same, for one frame.
GrayFrame render_frame(const std::vector<RenderedDisk>& disks, const Camera& camera, std::uint64_t frame_index = 0);

// A bed to test on. `rows` hexagonal rows of touching disks rest on the line y_px = floor_px. They fill the width
// between the walls x_px = left_wall_px and right_wall_px. Above them are `gas_count` disks at random that touch
// nothing. Their heights follow an exponential law of mean `gas_height_px`. Small random displacements `jitter_px`
// (without overlaps) break the lattice.
struct SyntheticBed {
  double left_wall_px = 0, right_wall_px = 0, floor_px = 0;
  double radius_px = 10;
  int rows = 10;
  int gas_count = 0;
  double gas_height_px = 100;
  double jitter_px = 0;
  std::uint64_t seed = 1;
};
std::vector<RenderedDisk> make_synthetic_bed(const SyntheticBed& bed);

}  // namespace shakebed::ingest
