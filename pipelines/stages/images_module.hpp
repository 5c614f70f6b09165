// The door to the images module. OpenCV costs 200 ms to load, so what touches images lives in a shared module of its
// own (libshakebed_images.so) that is loaded when a stage with images really runs. Nothing here mentions OpenCV.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/formats/frame_geometry.hpp"
#include "pipelines/stages/stage.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {

enum class Shading { flat, shaded, highlight };

// SI units and pixels; levels are grey levels of 0 to 255.
struct RenderOptions {
  double scale = 0.15e-3;    // [m/px]
  double blur = 0.8;         // sigma of the optical blur [px]
  double noise = 5;          // sigma of the read noise [grey levels]
  double exposure = 0.5e-3;  // [s]
  double background_level = 200, bead_level = 60;
  Shading shading = Shading::flat;
  double shading_depth = 0.35;
  double gradient_x = 0.1, gradient_y = -0.15;  // relative change of the light across the frame
  double vignette = 0;
  int margin = 12;               // around the box [px]
  std::optional<double> height;  // of the view above the floor's mean [m]; else up to the highest disk
  std::uint64_t frames = 0;      // at most so many; 0: all
};

enum class BeadPolarity { automatic, dark, bright };
enum class BeadShape { round, any };
enum class BeadChannel { automatic, red, green, blue, grey, saturation, background_distance, grey_distance };

// Pixels count from the centre of the top-left one, x to the right, y downwards.
struct ExtractOptions {
  double diameter = 0;                          // of a bead [m]
  double gravity = 9.81;                        // [m/s^2]
  InputFiles images;                            // photographs or films; else the frames of a render stage
  bool use_geometry = true;                     // of a render stage: take scale, floor and walls from it
  std::optional<double> scale;                  // [m/px]
  std::optional<double> floor;                  // row of the floor's mean [px]
  std::optional<double> floor_slope;            // px down per px right
  std::optional<double> floor_amplitude;        // of the shaken floor [m]
  std::optional<double> left_wall, right_wall;  // columns [px]
  std::vector<double> roi;                      // left, top, width, height [px]
  std::optional<double> second_diameter;        // of beads of another size, to be found too [m]
  std::optional<double> pixel_aspect;           // a pixel's width over its height; found if left out
  std::optional<double> lens_radial;            // how far the corners move, in half diagonals; found if left out
  BeadPolarity polarity = BeadPolarity::automatic;
  BeadChannel channel = BeadChannel::automatic;
  BeadShape shape = BeadShape::round;
  std::optional<double> radius;  // first value [px]
  bool keep_half_hidden = false;
  Kernel kernel = measuring_kernel;
  double spacing = measuring_spacing;           // of the profile's heights [D]
  std::optional<double> lowest, highest;        // of the profile [D]
  std::optional<double> frequency, frame_rate;  // [Hz]: phase-resolved profiles; the first is found
  std::optional<std::uint64_t> bead_number;     // how many beads there are in view, if known
  std::uint64_t skip = 0, stride = 1;           // frames left out at the beginning; then every so many frames
  std::optional<std::uint64_t> reduction;       // side of the squares averaged [px]; by the size of the beads
  std::uint64_t overlays = 1;                   // frames drawn with what was found
};

// fit-images --preview: files as on the command line.
struct PreviewRequest {
  std::vector<std::string> files;
  ExtractOptions options;
  std::string folder;  // for preview.html
};

struct Previewed {
  bool found = false;    // beads
  std::string sentence;  // what is seen
};

class ImagesModule {
 public:
  virtual ~ImagesModule() = default;
  virtual void render(const RenderOptions& options, RunContext& context) const = 0;
  virtual void extract(const ExtractOptions& options, RunContext& context) const = 0;
  // Of files and folders as on the command line. Films are stepped through, not decoded.
  virtual std::uint64_t count_frames(const std::vector<std::string>& files) const = 0;
  virtual Previewed preview(const PreviewRequest& request) const = 0;
};

// Loads the module once. It lies beside the program, or in the library folder it was installed to. Throws StageError
// when it is not there or is of another build.
const ImagesModule& images_module();

}  // namespace shakebed::pipelines
