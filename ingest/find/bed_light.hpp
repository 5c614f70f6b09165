#pragma once
// The light of a frame, refined once beads are known: smooth corrections to background and contrast, open background,
// and how one frame's light differs from the film's.

#include <cstddef>
#include <vector>

#include "ingest/calibrate/flatten.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/joint_fit.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// The field of a light at a pixel, bilinear between its nodes.
double field_at(const LightField& light, const std::vector<float>& field, double x, double y);

// Contrast and background at the middle of the frame, grey levels.
double mean_contrast(const LightField& light);
double mean_background(const LightField& light);

// 10 %, 20 % .. 90 % of the levels of a frame.
std::vector<float> level_deciles(const GrayFrame& frame);

// Sums over a tile of 32 x 32 px, for the regression of the flattened frame on the model: flat = beta + gamma model.
// Both beta and gamma are polynomials over the frame. The coordinates u and v run from -1 to 1 over the frame.
struct TileSums {
  double u = 0, v = 0;
  double count = 0, model = 0, model_model = 0, flat = 0, flat_model = 0;
};

// Appends the tiles of one frame. Pixels that the model leaves by more than a few `spread` (contrast units) are left
// out.
void add_tile_sums(const GrayFrame& flat, const JointFit& fit, double spread, std::vector<TileSums>& tiles);

// Corrects the light by that regression. Returns the largest change of a flattened level it makes.
double refine_light(LightField& light, const std::vector<TileSums>& tiles, int width, int height);

// Where no bead is nearer than `clear_px` there is open background: its median levels, a tile each.
constexpr std::size_t fewest_open_tiles = 6;
std::vector<TileSums> open_background(const GrayFrame& flat, const std::vector<ModelDisk>& disks, double clear_px);

// Levels below this lie beyond the background, seen from the beads (contrast units).
constexpr double well_beyond_background = -0.05;

// A packed bed shows little background, and the blurred voids between its beads can be mistaken for it. If the open
// background differs clearly from the level assumed behind the beads, the light is corrected. The beads keep their
// level. Returns whether it was corrected.
bool correct_background(LightField& light, const GrayFrame& flat, const std::vector<TileSums>& open,
                        const std::vector<ModelDisk>& disks);

// At first sight: all levels are so many times those of the film. None unless clearly so.
FrameLight light_at_first_sight(const GrayFrame& frame, const FinderCalibration& calibration);

// The light of one frame against the film's: flat = shift + gain model over what beads and background explain roughly.
// Differences below a few thousandths are none.
FrameLight light_of_frame(const GrayFrame& flat, const JointFit& fit, double noise);

// What remains of the frame, in squares of grey levels, once background and beads are taken out.
double unexplained_of(const JointFit& fit, const LightField& light);

}  // namespace shakebed::ingest
