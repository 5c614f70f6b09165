// How much a stage works for its main number, and how well a run of it knows that number: from this `--budget` chooses,
// without knowing any stage by name.
//
// A stage that can be measured for longer or shorter derives from Scalable too, and returns itself from
// Stage::scalable(). Lengths are times of the simulated bed, in the unit of the stage's options. All errors are
// relative to the number.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

struct Effort {
  double length = 0;       // over which each bed is measured
  std::uint32_t beds = 1;  // independent repetitions
  int refinement = 0;      // of the model: 0 as in the recipe, then step by step nearer to the truth
  bool operator==(const Effort&) const = default;
};

// What a choice has to respect.
struct EffortLimits {
  double settling = 0;            // before the measurement, of each bed
  double shortest = 0;            // length below which a measurement says nothing
  double pilot = 0;               // length of a first pilot
  double telling = 0;             // length that shows how much a longer measurement scatters
  double written = 0;             // length in the recipe
  std::uint32_t fewest_beds = 1;  // as in the recipe
  bool even_beds = false;         // every second bed starts otherwise
  int most_refinement = 0;
};

struct Work {
  double cpu_seconds = 0, events = 0;
};

// What a run with some effort has shown.
struct EffortReading {
  Effort effort;
  double settling = 0;                 // before the measurement, of each bed
  double within = 0;                   // standard error that one bed states, root mean square over the beds
  double spread = 0;                   // standard deviation between the beds
  double systematic = 0;               // the part that neither length nor beds reduce
  Work settling_work, measuring_work;  // of all beds together
};

class Scalable {
 public:
  virtual ~Scalable() = default;
  // JSON pointer below the stage → value.
  using Changes = std::vector<std::pair<std::string, Json>>;

  virtual std::string number() const = 0;  // the main number, as people read it: "T_x"
  // What causes the systematic part, and what reduces it where no refinement is left.
  virtual std::string systematic_cause() const = 0;
  virtual std::string systematic_remedy() const = 0;
  virtual EffortLimits limits() const = 0;
  // The options with which the stage works so much.
  virtual Changes changes(const Effort& effort) const = 0;
  // The same for a pilot, which settles for no longer than it measures, and keeps no frames.
  virtual Changes pilot_changes(const Effort& effort) const = 0;
  // Of the result of a run, and the times that the stage gave to RunContext::timing(). Throws StageError where the
  // number is 0, so that no error is relative to it.
  virtual EffortReading read(const Effort& effort, const Json& result, const Json& timings) const = 0;
};

}  // namespace shakebed::pipelines
