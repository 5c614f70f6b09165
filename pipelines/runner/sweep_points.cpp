#include "pipelines/runner/sweep_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipelines/stages/replica_seed.hpp"

namespace shakebed::pipelines {

namespace {

// The points of a random sweep are the same everywhere.
double uniform(std::uint64_t seed, std::uint64_t a, std::uint64_t b) {
  return static_cast<double>(mixed(mixed(mixed(seed) ^ a) ^ b) >> 11) * 0x1.0p-53;
}

}  // namespace

std::vector<SweepPoint> sweep_points(const Plan& plan) {
  const SweepOptions& sweep = *plan.sweep;
  std::vector<std::vector<Json>> values;
  std::vector<Problem> problems;
  for (const SweepAxis& axis : sweep.axes) {
    const std::string where = "/sweep/over/" + escape_pointer_token(axis.pointer);
    try {
      // The pointer must lead to a stage; what is below it is checked when the point's recipe is read.
      const auto tokens = split_pointer(axis.pointer);
      if (tokens.size() < 3 || tokens[0] != "stages" ||
          find_pointer(plan.document, "/stages/" + escape_pointer_token(tokens[1])) == nullptr) {
        problems.push_back({plan.file,
                            {},
                            where,
                            fmt::format("\"{}\" leads to no stage of this recipe", axis.pointer),
                            "Write /stages/<id or number>/<key>"});
      }
    } catch (const UsageError& error) {
      problems.push_back({plan.file, {}, where, error.what(), ""});
    }
  }
  double total = 1;
  if (sweep.kind == SweepKind::grid) {
    for (const SweepAxis& axis : sweep.axes) total *= static_cast<double>(axis.values.size());
  } else if (sweep.kind == SweepKind::random) {
    total = static_cast<double>(sweep.count);
  } else {
    total = sweep.axes.empty() ? 0 : static_cast<double>(sweep.axes.front().values.size());
  }
  if (total * static_cast<double>(sweep.replicas) > 1e7) {
    problems.push_back(
        {plan.file,
         {},
         "/sweep",
         fmt::format("{:.3g} points are too many (at most 10,000,000)", total * static_cast<double>(sweep.replicas)),
         ""});
  }
  if (!problems.empty()) throw ConfigError(std::move(problems));
  const auto count = static_cast<std::uint64_t>(total);
  for (std::uint64_t i = 0; i < count; ++i) {
    std::vector<Json> row(sweep.axes.size());
    std::uint64_t rest = i;
    for (std::size_t a = sweep.axes.size(); a-- > 0;) {  // the last axis runs fastest
      const SweepAxis& axis = sweep.axes[a];
      if (sweep.kind == SweepKind::grid) {
        row[a] = axis.values[rest % axis.values.size()];
        rest /= axis.values.size();
      } else if (sweep.kind == SweepKind::random) {
        if (!axis.values.empty()) {
          row[a] = axis.values[static_cast<std::size_t>(uniform(sweep.seed, i, a) *
                                                        static_cast<double>(axis.values.size()))];
        } else {
          const double u = uniform(sweep.seed, i, a);
          const double value =
              axis.logarithmic ? axis.low * std::pow(axis.high / axis.low, u) : axis.low + (axis.high - axis.low) * u;
          row[a] = axis.unit.empty() ? Json(value) : Json(number_text(value) + " " + axis.unit);
        }
      } else {
        row[a] = axis.values[i];
      }
    }
    values.push_back(std::move(row));
  }
  std::vector<SweepPoint> points;
  points.reserve(values.size() * sweep.replicas);
  for (const auto& row : values) {
    for (std::uint64_t replica = 0; replica < sweep.replicas; ++replica) {
      points.push_back({points.size(), fmt::format("{:06d}", points.size()), replica, row});
    }
  }
  return points;
}

Plan plan_at(const Plan& plan, const SweepPoint& point) {
  JsonNode document = plan.document;
  document.members.erase(std::remove_if(document.members.begin(), document.members.end(),
                                        [](const JsonMember& m) { return m.key == "sweep"; }),
                         document.members.end());
  for (std::size_t a = 0; a < plan.sweep->axes.size(); ++a) {
    if (!point.values[a].is_null()) set_pointer(document, plan.sweep->axes[a].pointer, to_node(point.values[a]));
  }
  if (plan.sweep->replicas > 1) {
    // Replicas differ in the seeds of all stages that have one; the first keeps the recipe's own.
    JsonNode* stages = document.find("stages");
    for (JsonNode& stage : stages->items) {
      const JsonNode* kind = stage.find("stage");
      const StageRow* row = kind != nullptr ? find_stage(kind->text) : nullptr;
      if (row == nullptr || !row->uses_seed || point.replica == 0) continue;
      const JsonNode* seed = stage.find("seed");
      const auto own = seed != nullptr && seed->is_number() ? static_cast<std::uint64_t>(seed->number) : 1u;
      set_pointer(stage, "/seed", to_node(Json(replica_seed(own, point.replica))));
    }
  }
  return make_plan(std::move(document), plan.file, plan.directory);
}

}  // namespace shakebed::pipelines
