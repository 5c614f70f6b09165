#include "pipelines/stages/extract.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "pipelines/stages/bed_facts.hpp"
#include "pipelines/stages/extract_results.hpp"
#include "pipelines/stages/images_module.hpp"
#include "pipelines/stages/kernel_options.hpp"
#include "pipelines/stages/scene_options.hpp"

namespace shakebed::pipelines {
namespace {

// The photographs, and where in them the bed is.
void describe_geometry(Fields& fields, ExtractOptions& o) {
  fields.input_files("images", o.images,
                     {.help = "photographs or films; default: the frames of the render stage in \"from\"",
                      .example = "\"photos/*.tif\""});
  fields.boolean(
      "use_geometry", o.use_geometry,
      {.help =
           "whether scale, floor and walls of rendered frames are taken from the render stage instead of being found"});
  fields.quantity("scale", o.scale, dimension::length_per_pixel,
                  {.help = "length of a pixel; default: found from the diameter", .range = positive});
  fields.number(
      "floor", o.floor,
      {.help = "row of the floor's surface at the left edge, in pixels from the top; default: found from the beads"});
  fields.quantity(
      "floor_amplitude", o.floor_amplitude, dimension::length,
      {.help = "amplitude of the shaken floor. If no film shows the motion of the floor, its mean position is "
               "estimated as half the amplitude above the lowest position seen, with an error of the same size",
       .range = positive});
  fields.number("floor_slope", o.floor_slope,
                {.help = "slope of the floor, in pixels down per pixel to the right; default: found from the beads",
                 .range = from_to(-1, 1)});
  fields.number("left_wall", o.left_wall,
                {.help = "column of the inner face of the left wall, in pixels; default: found from the beads"});
  fields.number("right_wall", o.right_wall,
                {.help = "column of the inner face of the right wall, in pixels; default: found from the beads"});
  fields.numbers("roi", o.roi,
                 {.help = "region of interest, in pixels: left, top, width, height; empty: the whole frame"});
  fields.number("pixel_aspect", o.pixel_aspect,
                {.help = "ratio of the width of a pixel to its height; default: found from the rims of the beads, "
                         "beginning with what a film states, else with 1",
                 .range = from_to(0.5, 2)});
  fields.number("lens", o.lens_radial,
                {.help = "distortion of the lens: true outward shift of the corners of the frame, in half diagonals "
                         "(barrel: positive); default: found from the rims of the beads",
                 .range = from_to(-0.3, 0.3)});
}

// How beads look.
void describe_beads(Fields& fields, ExtractOptions& o) {
  fields.choice(
      "polarity", o.polarity,
      {{BeadPolarity::automatic, "automatic"}, {BeadPolarity::dark, "dark"}, {BeadPolarity::bright, "bright"}},
      {.help = "whether beads are darker or brighter than the background"});
  fields.choice("channel", o.channel,
                {{BeadChannel::automatic, "automatic"},
                 {BeadChannel::red, "red"},
                 {BeadChannel::green, "green"},
                 {BeadChannel::blue, "blue"},
                 {BeadChannel::grey, "grey"},
                 {BeadChannel::saturation, "saturation"},
                 {BeadChannel::background_distance, "background_distance"},
                 {BeadChannel::grey_distance, "grey_distance"}},
                {.help = "part of a picture that is used. Saturation: largest minus smallest of red, green and blue. "
                         "Background_distance: distance from the most frequent colour. Grey_distance: distance of the "
                         "grey level from that of the background, which may vary slowly. The last one serves grey "
                         "pictures, too"});
  fields.choice("shape", o.shape, {{BeadShape::round, "round"}, {BeadShape::any, "any"}},
                {.help = "outlines that are accepted as beads: round, or any. With any, oval and rough outlines are "
                         "measured too, with a warning"});
  fields.number("radius", o.radius,
                {.help = "first estimate of the radius of a bead, in pixels; default: found in the frames",
                 .range = from_to(1, 1e4)});
  fields.boolean("keep_half_hidden", o.keep_half_hidden, {.help = "whether beads that are partly covered are counted"});
}

void describe_profile(Fields& fields, ExtractOptions& o) {
  fields.object<Kernel>("kernel", o.kernel, describe_measuring_kernel,
                        {.help = "kernel through which the density is measured"});
  fields.number("spacing", o.spacing,
                {.help = "distance between the heights of the profile, in D", .range = from_to(1e-3, 10)});
  fields.number("lowest", o.lowest, {.help = "lowest height of the profile, in D; default: 0"});
  fields.number("highest", o.highest,
                {.help = "highest height of the profile, in D; default: just above the highest bead"});
  fields.quantity(
      "frequency", o.frequency, dimension::frequency,
      {.help = "frequency of the shaking, for profiles by phase (needs frame_rate); default: found in the film",
       .range = positive});
  fields.quantity(
      "frame_rate", o.frame_rate, dimension::frequency,
      {.help = "frame rate at which the film was recorded; if given, velocities are measured", .range = positive});
}

void describe_frames(Fields& fields, ExtractOptions& o) {
  fields.integer(
      "bead_number", o.bead_number,
      {.help = "number of beads in view, if known; missed and doubled beads are then reported", .range = at_least(1)});
  fields.integer("skip", o.skip,
                 {.help = "number of frames that are left out at the beginning", .range = from_to(0, 1'000'000'000)});
  fields.integer(
      "stride", o.stride,
      {.help = "step between the frames that are used: 1 for all, 2 for every second one", .range = at_least(1)});
  fields.integer("reduction", o.reduction,
                 {.help = "side of the squares of pixels over which frames are averaged before the measurement; "
                          "default: 1, and more where beads are wide and frames large",
                  .range = from_to(1, 100)});
  fields.integer(
      "overlays", o.overlays,
      {.help = "number of frames of which a picture with the disks found is written", .range = from_to(0, 1000)});
}

void check(Fields& fields, const ExtractOptions& o) {
  const bool from_render = fields.has_upstream("render");
  fields.require(from_render != fields.has("images"), from_render ? "images" : "",
                 from_render ? "two sources of frames are given: the render stage in \"from\" and \"images\""
                             : "there are no frames: neither \"images\" nor a render stage in \"from\"",
                 "Give one of the two");
  fields.require(o.roi.empty() || o.roi.size() == 4, "roi", "expected four numbers: left, top, width, height");
  if (o.roi.size() == 4)
    fields.require(o.roi[2] >= 8 && o.roi[3] >= 8, "roi", "width and height must be at least 8 pixels");
  fields.require(o.left_wall.has_value() == o.right_wall.has_value(), "left_wall",
                 "one wall is missing: give both \"left_wall\" and \"right_wall\", or neither");
  if (o.left_wall && o.right_wall)
    fields.require(*o.left_wall < *o.right_wall, "left_wall", "the left wall must lie left of the right one");
  if (o.lowest && o.highest) fields.require(*o.lowest < *o.highest, "highest", "\"highest\" must be above \"lowest\"");
  fields.require(!o.frequency || o.frame_rate, "frequency",
                 "the frequency is used for profiles by phase, which also need \"frame_rate\": give both, or leave "
                 "\"frequency\" out");
}

class Extract : public Stage {
 public:
  void describe(Fields& fields) override {
    describe_bed(fields);
    describe_geometry(fields, options_);
    describe_beads(fields, options_);
    describe_profile(fields, options_);
    describe_frames(fields, options_);
    if (!fields.decoding()) return;
    take_bed_facts(fields);
    check(fields, options_);
    if (fields.has("diameter") && options_.diameter > 0) warn_of_bead(fields, "/diameter", options_.diameter);
  }
  void results(ResultList& list) const override { state_extract_results(list, options_); }
  void run(RunContext& context) const override { images_module().extract(options_, context); }
  // Of photographs; that of a simulated bed is the simulate stage's.
  std::optional<BedDescription> bed() const override {
    if (options_.images.empty()) return std::nullopt;
    BedDescription bed;
    bed.diameter = options_.diameter, bed.second_diameter = options_.second_diameter;
    bed.gravity = options_.gravity;
    return bed;
  }

 private:
  void describe_bed(Fields& fields) {
    fields.quantity(
        "diameter", diameter_, dimension::length,
        {.help = "diameter of a bead; required for your own photographs; default for a simulated bed: its own",
         .range = positive,
         .example = "\"2.99 mm\""});
    fields.quantity(
        "second_diameter", options_.second_diameter, dimension::length,
        {.help = "diameter of a second kind of beads, larger or smaller; default: such beads count as rejected",
         .range = positive});
    fields.quantity(
        "gravity", gravity_, dimension::acceleration,
        {.help = "acceleration of gravity, for temperatures; default: that of the simulated bed, or 9.81 m/s^2",
         .range = positive});
  }

  // What the simulated bed knows need not be stated again, and may not be stated otherwise.
  void take_bed_facts(Fields& fields) {
    if (const KnownBed* known = fields.known_bed(); known != nullptr && !known->bed.reduced) {
      const BedDescription& bed = known->bed;
      require_same_as_bed(fields, "diameter", diameter_, bed.diameter, dimension::length);
      require_same_as_bed(fields, "second_diameter", options_.second_diameter, bed.second_diameter, dimension::length);
      require_same_as_bed(fields, "gravity", gravity_, bed.gravity, dimension::acceleration);
      if (!diameter_) diameter_ = bed.diameter;
      if (!options_.second_diameter) options_.second_diameter = bed.second_diameter;
      if (!gravity_) gravity_ = bed.gravity;
    }
    if (!gravity_) gravity_ = standard_gravity;
    fields.require(diameter_.has_value(), "diameter",
                   "\"diameter\" is missing: the scale follows from the diameter of a bead",
                   "Write \"diameter\": \"2.99 mm\"");
    if (diameter_ && options_.second_diameter) check_ratio(fields, *options_.second_diameter / *diameter_);
    if (const auto impossible = impossible_bead(diameter_.value_or(1e-3)))
      fields.require(false, "diameter", impossible->what, impossible->suggestion);
    options_.diameter = diameter_.value_or(1), options_.gravity = *gravity_;
  }

  static void check_ratio(Fields& fields, double ratio) {
    constexpr double most = 20, rounding = 1e-9;
    fields.require(std::max(ratio, 1 / ratio) <= most * (1 + rounding), "second_diameter",
                   fmt::format("it is {:.3g} times the diameter; two kinds of beads are searched up to a ratio of {:g}",
                               ratio, most),
                   "Check its unit");
  }

  static constexpr double standard_gravity = 9.81;  // [m/s^2]
  ExtractOptions options_;
  std::optional<double> diameter_, gravity_;
};

}  // namespace

StageRow extract_stage() {
  return {.name = "extract",
          .summary = "finds the disks in frames and measures the density profile",
          .accepts = {"render", "simulate"},
          .fewest_inputs = 0,
          .most_inputs = 2,
          .uses_images = true,
          .result = "extract.json",
          .pages = extract_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Extract>(); }};
}

}  // namespace shakebed::pipelines
