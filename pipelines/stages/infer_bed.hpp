// A bed of an inference: its scene at one point of the parameters, run, and the numbers that are compared with what was
// measured.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/measure.hpp"

namespace shakebed::pipelines {

// --- parameters

// A number of the scene that is not known. Its prior is even between `low` and `high`, on a linear or logarithmic
// scale, or normal and cut off there, or even over a list of values.
struct UnknownParameter {
  std::vector<std::string> set;  // pointers into the scene: /floor/gamma
  std::string unit;              // of what is written there; none: a plain number
  double low = 0, high = 0;
  bool logarithmic = false;
  std::optional<double> mean, std_error;
  Json values = Json();  // in place of a range
  std::string why;

  void describe(Fields& fields);
  bool is_choice() const { return values.is_array(); }
  // From a place between 0 and 1, over which the prior is even, to the value, and back. Of a choice: the index.
  double value(double place) const;
  double place(double value) const;
  // The same on the scale on which beds change evenly, 0 to 1: what the surrogate sees.
  double coordinate(double value) const;
  // What is written into the scene.
  Json written(double value) const;
  // The value that a scene holds at the first pointer; nothing where it is none of this parameter.
  std::optional<double> in_scene(const JsonNode& scene) const;
};
using Parameters = std::vector<std::pair<std::string, UnknownParameter>>;

// --- what is compared

struct Observable {
  std::string_view name;
  bool is_length;  // in m, reduced in D; else in `unit`
  std::string_view unit, meaning;
  bool logarithmic;  // its scatter is a part of its value
};
const std::vector<Observable>& observables();
std::size_t observable_number(std::string_view name);

// Between the rows of a table, linearly; beyond its ends, the last value.
double value_at(const std::vector<double>& places, const std::vector<double>& values, double place);

// What the photographs of a bed show: the average over the shaking, or one moment of it.
struct View {
  std::string name;   // "average", or the phase: "0.25"
  double phase = -1;  // below 0: the average
  double prior = 1;
};
std::vector<View> views_of(std::uint32_t moments, double average, std::optional<double> phase);

// --- the bed

struct BedOfInference {
  JsonNode scene;  // the keys of SceneOptions as written
  Fields::Source source;
  bool reduced = false;
  double settle = 0, measure = 0;  // as written
  std::uint32_t phases = 32;
  std::optional<double> frame_rate;  // of a film, as written: temperatures without flow are then of displacements
  double kernel_width = 0.5;         // Gaussian [D]
  double plateau_density = 1.10;     // phi_0 of the fit
  std::vector<View> views;
  std::vector<double> heights;  // at which the density is compared [D]; none: it is not

  // How many numbers a view has: those of observables(), then the densities at `heights`.
  std::size_t numbers() const { return observables().size() + heights.size(); }

  // The scene with these parameters; what is wrong with it is added to `problems`.
  SceneOptions at(const Parameters& parameters, const std::vector<double>& values,
                  std::vector<Problem>& problems) const;
  SceneOptions read(const JsonNode& node, std::vector<Problem>& problems) const;
  // A scene with every option written out: the same for all ways to write the same scene.
  Json written_out(const JsonNode& node) const;
  // Looks a period: as many as frames where the bed is filmed.
  std::uint32_t looks(const SceneOptions& bed) const;
  sim::MeasurementSchedule schedule(const SceneOptions& bed, double duration) const;
  // The numbers, view by view; not a number where a fit does not succeed, or where the bed chatters
  // and is given up. `progress` is called with the finished share of the run. Throws Interrupted.
  std::vector<double> run(const SceneOptions& bed, std::uint64_t seed, double duration, const RunContext& context,
                          const std::function<void(double)>& progress) const;
};

}  // namespace shakebed::pipelines
