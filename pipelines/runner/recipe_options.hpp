// What a recipe says besides the options of its stages: the keys at its top, and those that every stage has.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/config.hpp"
#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

// The newest recipe format this program reads ("format" in a recipe).
inline constexpr int recipe_format = 1;

// A published number, to be compared with our number in the report.
struct PublishedNumber {
  std::string pointer;  // "/fit/temperature_over_mg": where ours is
  std::string label;
  std::string value;      // a quantity; its unit decides in which ours is shown
  std::string place;      // where it is printed
  double relative = 0.1;  // nearer than this part of it counts as agreement
  bool beside_answer = false;
};
struct AssumedInput {
  std::string pointer;  // into the recipe: "/stages/bed/floor/frequency"
  std::string why;
};
// What the recipe says about its report.
struct ReportOptions {
  std::string title;
  std::vector<std::string> text;  // paragraphs
  std::vector<PublishedNumber> published;
  std::vector<AssumedInput> assumed;
  bool audit = false;  // the table of `shakebed audit`, too
};

// Where a value of a sweep is written, for messages.
struct SweepPlace {
  Position at;
  bool from_command_line = false;
  std::string pointer;  // "/sweep/over/~1stages~1bed~1seed/2"
};
struct SweepAxis {
  std::string pointer;
  std::vector<Json> values{};
  std::vector<SweepPlace> places{};  // as many as values; of a random range one
  double low = 0, high = 0;          // of a random axis, in the unit
  std::string unit{};
  bool logarithmic = false;
};
enum class SweepKind { grid, zip, list, random };
struct SweepOptions {
  SweepKind kind = SweepKind::grid;
  std::vector<SweepAxis> axes;
  std::uint64_t count = 0;  // of random points
  std::uint64_t seed = 1;   // of random points
  std::uint64_t replicas = 1;
  std::vector<std::string> collect;  // pointers into the results
};

// The top of a recipe, without its stages.
struct RecipeTop {
  std::string schema, preset, name, description;
  int format = recipe_format;
  Json presets;
  ReportOptions report;
  std::optional<SweepOptions> sweep;
};
void describe_top(Fields& fields, RecipeTop& top);
void describe_sweep(Fields& fields, SweepOptions& sweep);

// The keys that every stage has, besides its own.
struct CommonOptions {
  std::string stage, id;
  std::vector<std::string> from;
  std::uint64_t seed = 1;
  bool reduced = false;
};
void describe_common(Fields& fields, CommonOptions& common, const StageRow& row);

}  // namespace shakebed::pipelines
