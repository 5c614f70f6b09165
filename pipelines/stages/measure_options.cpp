#include "pipelines/stages/measure_options.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "pipelines/formats/quantity.hpp"
#include "pipelines/stages/kernel_options.hpp"

namespace shakebed::pipelines {
double rounded_up_to_four_digits(double value) {
  const double step = std::pow(10, std::floor(std::log10(value)) - 3);
  return std::ceil(value / step) * step;
}

void BedMeasureOptions::describe(Fields& fields) {
  fields.quantity("settle", settle_, dimension::time,
                  {.help = "time before the measurement begins", .range = non_negative, .example = "\"10 s\""});
  fields.quantity(
      "measure", duration_, dimension::time,
      {.help = "time over which the bed is measured", .required = true, .range = positive, .example = "\"20 s\""});
  fields.object<sim::MeasureOptions>(
      "frames", measure_,
      [](Fields& f, sim::MeasureOptions& frames) {
        f.integer("count", frames.frames,
                  {.help = "number of frames of the trajectory that are stored; 0: none", .range = from_to(0, 1e7)});
        f.integer(
            "phases", frames.phases,
            {.help =
                 "number of moments in each period at which the bed is sampled; the frames use these moments in turn",
             .range = from_to(1, 4096)});
        f.numbers(
            "at", frames.frame_phases,
            {.help = "phases of the shaking, from 0 to below 1, at which the frames are taken (0: the floor rises "
                     "through its mean height); default: all phases in turn. Each has its own profile, "
                     "profile_phase_00.csv and so on",
             .example = "[0, 0.25]"});
      },
      {.help = "frames of the trajectory that are stored"});
  fields.object<sim::MeasureOptions>(
      "profile", measure_,
      [](Fields& f, sim::MeasureOptions& profile) {
        f.number("spacing", profile.spacing,
                 {.help = "distance between neighbouring heights of the profile, in D", .range = from_to(1e-3, 10)});
        f.object<Kernel>("kernel", profile.kernel, describe_measuring_kernel,
                         {.help = "kernel through which the density is measured"});
      },
      {.help = "options of the density profile"});
}

sim::MeasureOptions BedMeasureOptions::reduced(double time_unit) const {
  sim::MeasureOptions out = measure_;
  out.settle = settle_ / time_unit;
  out.duration = duration_ / time_unit;
  return out;
}

void BedMeasureOptions::check(Fields& fields, double floor_period, double time_unit) const {
  using MeasureProblem = sim::MeasureOptions::Problem;
  const sim::MeasureOptions options = reduced(time_unit);
  for (const MeasureProblem problem : options.problems(floor_period)) {
    if (problem == MeasureProblem::shorter_than_a_period) {
      const double least = rounded_up_to_four_digits(floor_period * time_unit);
      fields.require(false, "measure", "the bed must be measured over at least one period of the floor",
                     "Give " + (fields.reduced() ? fmt::format("{:.6g}", least) : handy_text(least, dimension::time)) +
                         " or more");
    }
    if (problem == MeasureProblem::too_many_periods)
      fields.require(false, "measure", "the floor would shake more than 1e12 times, which no run can reach",
                     "Give a shorter \"measure\" or \"settle\", or a lower frequency");
    if (problem == MeasureProblem::frame_phases)
      fields.require(false, "frames/at",
                     floor_period > 0 ? "the bed is not sampled at these phases, or one is named twice"
                                      : "the floor does not shake, so frames have no phases",
                     floor_period > 0
                         ? "Give different multiples of 1/" + std::to_string(options.phases) + " from 0 to below 1"
                         : "Remove \"at\"");
    if (problem == MeasureProblem::too_many_frames)
      fields.require(false, "frames/count",
                     std::to_string(options.frames) + " frames were requested, but the bed is sampled at only " +
                         std::to_string(sim::plan_looks(floor_period, options).possible_frames()) + " moments",
                     "Give a longer \"measure\", or a smaller \"count\"");
  }
}

}  // namespace shakebed::pipelines
