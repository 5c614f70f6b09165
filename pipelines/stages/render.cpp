#include "pipelines/stages/render.hpp"

#include <fmt/format.h>

#include "pipelines/formats/bed.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {
namespace {

// Of a change of the light: with 1, one side of the frame gets none.
constexpr Range some_light{.low = -1, .high = 1, .above_low = true, .below_high = true};

class Render : public Stage {
 public:
  void describe(Fields& fields) override {
    RenderOptions& o = options_;
    fields.quantity("scale", o.scale, dimension::length_per_pixel,
                    {.help = "length of a pixel", .range = positive, .example = "\"0.15 mm/px\""});
    fields.number("blur", o.blur,
                  {.help = "standard deviation of the optical blur, in pixels", .range = from_to(0, 50)});
    fields.number("noise", o.noise,
                  {.help = "standard deviation of the noise, in grey levels (white: 255)", .range = from_to(0, 127)});
    fields.quantity("exposure", o.exposure, dimension::time,
                    {.help = "exposure time; disks are blurred along their velocity", .range = non_negative});
    fields.number("background_level", o.background_level,
                  {.help = "grey level of the background", .range = from_to(0, 255)});
    fields.number("bead_level", o.bead_level, {.help = "grey level of a bead", .range = from_to(0, 255)});
    fields.choice(
        "shading", o.shading, {{Shading::flat, "flat"}, {Shading::shaded, "shaded"}, {Shading::highlight, "highlight"}},
        {.help = "shading of a bead. Flat: one grey level. Shaded: like a sphere. Highlight: with a bright spot"});
    fields.number("shading_depth", o.shading_depth,
                  {.help = "difference of the grey levels of centre and rim, relative to the contrast of the bead",
                   .range = from_to(-2, 2)});
    fields.number("gradient_x", o.gradient_x,
                  {.help = "relative change of the light from left to right", .range = some_light});
    fields.number("gradient_y", o.gradient_y,
                  {.help = "relative change of the light from top to bottom", .range = some_light});
    fields.number("vignette", o.vignette, {.help = "relative loss of light in the corners", .range = from_to(0, 0.9)});
    fields.integer("margin", o.margin,
                   {.help = "width of the margin around the box, in pixels", .range = from_to(0, 2000)});
    fields.quantity("height", o.height, dimension::length,
                    {.help = "height of the view above the floor's mean position; default: up to the highest disk",
                     .range = positive});
    fields.integer("frames", o.frames, {.help = "largest number of frames that are drawn; 0: all"});
    fields.require(o.bead_level != o.background_level, "bead_level",
                   "beads cannot be seen, because \"bead_level\" equals \"background_level\"", "Choose another level");
    if (const KnownBed* known = fields.known_bed(); known != nullptr && !known->keeps_frames)
      fields.problem("/from", "the simulated bed stores no frames, so there is nothing to photograph",
                     fmt::format("Add \"frames\": {{\"count\": 640}} to {}", known->place));
  }
  void results(ResultList& list) const override {
    list.number("/frames", "1", "number of frames drawn");
    list.quantity("/width", "px", "width of a frame");
    list.quantity("/height", "px", "height of a frame");
    list.quantity("/scale", "m/px", "length of a pixel");
    list.quantity("/radius", "px", "radius of a bead");
    list.table({"truth.csv",
                "true centres at the middle of the exposure",
                {{"frame", "1", "number of the frame, from 0"},
                 {"disk", "1", "number of the disk, from 0"},
                 {"x_px", "px", "position of the centre, counted from the centre of the top-left pixel to the right"},
                 {"y_px", "px", "position of the centre, counted from the centre of the top-left pixel downwards"},
                 {"radius_px", "px", "radius of the disk"}}});
  }
  void run(RunContext& context) const override { images_module().render(options_, context); }

 private:
  RenderOptions options_;
};

}  // namespace

StageRow render_stage() {
  return {.name = "render",
          .summary = "photographs a simulated bed: frames with blur, noise, uneven light, and the true centres",
          .accepts = {"simulate"},
          .fewest_inputs = 1,
          .most_inputs = 1,
          .uses_seed = true,
          .uses_images = true,
          .result = "render.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Render>(); }};
}

}  // namespace shakebed::pipelines
