#include "pipelines/runner/sweep_points.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipelines/stages/replica_seed.hpp"

namespace shakebed::pipelines {
namespace {

constexpr double most_points = 1e7;
// A mistake that is in every point is shown once, others up to here.
constexpr std::size_t most_problems_shown = 20;

// The points of a random sweep are the same everywhere.
double uniform(std::uint64_t seed, std::uint64_t a, std::uint64_t b) {
  return static_cast<double>(mixed(mixed(mixed(seed) ^ a) ^ b) >> 11) * 0x1.0p-53;
}

double combinations(const SweepOptions& sweep) {
  if (sweep.kind == SweepKind::random) return static_cast<double>(sweep.count);
  if (sweep.axes.empty()) return 0;
  double total = 1;
  if (sweep.kind != SweepKind::grid) return static_cast<double>(sweep.axes.front().values.size());
  for (const SweepAxis& axis : sweep.axes) total *= static_cast<double>(axis.values.size());
  return total;
}

// The values of combination i, and where they are written.
SweepPoint combination(const SweepOptions& sweep, std::uint64_t i) {
  SweepPoint point;
  point.values.resize(sweep.axes.size());
  point.places.assign(sweep.axes.size(), 0);
  std::uint64_t rest = i;
  for (std::size_t a = sweep.axes.size(); a-- > 0;) {  // the last axis runs fastest
    const SweepAxis& axis = sweep.axes[a];
    if (sweep.kind == SweepKind::random && axis.values.empty()) {
      const double u = uniform(sweep.seed, i, a);
      const double value =
          axis.logarithmic ? axis.low * std::pow(axis.high / axis.low, u) : axis.low + (axis.high - axis.low) * u;
      point.values[a] = axis.unit.empty() ? Json(value) : Json(number_text(value) + " " + axis.unit);
      continue;
    }
    std::size_t k = i;
    if (sweep.kind == SweepKind::grid) k = rest % axis.values.size(), rest /= axis.values.size();
    if (sweep.kind == SweepKind::random)
      k = static_cast<std::size_t>(uniform(sweep.seed, i, a) * static_cast<double>(axis.values.size()));
    point.values[a] = axis.values[k];
    point.places[a] = k;
  }
  return point;
}

std::string described(const Plan& plan, const SweepPoint& point) {
  std::string text;
  for (std::size_t a = 0; a < plan.sweep->axes.size(); ++a) {
    if (point.values[a].is_null()) continue;
    text +=
        fmt::format("{}{} = {}", text.empty() ? "" : ", ", plan.sweep->axes[a].pointer,
                    point.values[a].is_string() ? point.values[a].get<std::string>() : dump_canonical(point.values[a]));
  }
  return fmt::format("point {} of the sweep: {}", point.name, text);
}

// Replicas differ in the seeds of all stages that have one; the first keeps the recipe's own.
void set_replica_seeds(JsonNode& document, std::uint64_t replica) {
  JsonNode* stages = document.find("stages");
  if (stages == nullptr || replica == 0) return;
  for (JsonNode& stage : stages->items) {
    const JsonNode* kind = stage.find("stage");
    const StageRow* row = kind != nullptr ? find_stage(kind->text) : nullptr;
    if (row == nullptr || !row->uses_seed) continue;
    const JsonNode* seed = stage.find("seed");
    const auto own = seed != nullptr && seed->is_number() ? static_cast<std::uint64_t>(seed->number) : 1u;
    set_pointer(stage, "/seed", to_node(Json(replica_seed(own, replica))));
  }
}

}  // namespace

std::vector<SweepPoint> sweep_points(const Plan& plan) {
  const SweepOptions& sweep = *plan.sweep;
  const double total = combinations(sweep), all = total * static_cast<double>(sweep.replicas);
  if (all > most_points) {
    const JsonNode* node = plan.document.find("sweep");
    throw ConfigError(
        {{plan.file, node != nullptr ? node->at : Position{}, "/sweep",
          fmt::format("the sweep has {:.3g} points, but at most 10,000,000 are possible; give fewer values or replicas",
                      all),
          ""}});
  }
  std::vector<SweepPoint> points;
  points.reserve(static_cast<std::size_t>(all));
  for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(total); ++i) {
    SweepPoint point = combination(sweep, i);
    for (std::uint64_t replica = 0; replica < sweep.replicas; ++replica) {
      point.index = points.size();
      point.name = fmt::format("{:06d}", points.size());
      point.replica = replica;
      points.push_back(point);
    }
  }
  return points;
}

Plan plan_at(const Plan& plan, const SweepPoint& point) {
  JsonNode document;  // without what no point needs
  document.kind = JsonNode::Kind::object;
  document.at = plan.document.at;
  for (const JsonMember& member : plan.document.members) {
    if (member.key != "sweep" && member.key != "presets" && member.key != "report") document.members.push_back(member);
  }
  std::vector<Problem> problems;
  std::vector<Relocation> changes;
  for (std::size_t a = 0; a < plan.sweep->axes.size(); ++a) {
    if (point.values[a].is_null()) continue;
    const SweepAxis& axis = plan.sweep->axes[a];
    const SweepPlace& place = axis.places.at(point.places[a]);
    JsonNode value = to_node(point.values[a]);
    value.at = place.at;
    try {
      set_pointer(document, axis.pointer, std::move(value),
                  place.from_command_line ? ValueFrom::command_line : ValueFrom::file);
      changes.emplace_back(numbered_pointer(document, axis.pointer), place.pointer);
    } catch (const UsageError& error) {
      problems.push_back({place.from_command_line ? "--set" : plan.file, place.at, place.pointer, error.what(),
                          "Write /stages/<id or number>/<key>"});
    }
  }
  if (!problems.empty()) throw ConfigError(std::move(problems));
  set_replica_seeds(document, point.replica);
  try {
    return make_plan(std::move(document), plan.file, plan.directory);
  } catch (const ConfigError& error) {
    problems = error.problems();
    relocate(problems, changes, fmt::format(" ({})", described(plan, point)));
    throw ConfigError(std::move(problems));
  }
}

std::vector<Warning> check_points(const Plan& plan) {
  std::vector<Problem> problems;
  std::vector<Warning> warnings;
  std::vector<std::size_t> counts;
  std::size_t read = 0;
  for (const SweepPoint& point : sweep_points(plan)) {
    if (point.replica > 0) continue;
    ++read;
    try {
      for (Warning& warning : plan_at(plan, point).warnings) {
        const auto known = std::find_if(warnings.begin(), warnings.end(), [&](const Warning& w) {
          return w.kind == warning.kind && w.problem.pointer == warning.problem.pointer;
        });
        if (known != warnings.end()) {
          ++counts[static_cast<std::size_t>(known - warnings.begin())];
          continue;
        }
        warning.problem.what += fmt::format(" ({}", described(plan, point));
        warnings.push_back(std::move(warning)), counts.push_back(1);
      }
    } catch (const ConfigError& error) {
      for (const Problem& problem : error.problems()) {
        const bool known = std::any_of(problems.begin(), problems.end(), [&](const Problem& p) {
          return p.pointer == problem.pointer && p.at.line == problem.at.line && p.at.column == problem.at.column;
        });
        if (!known) problems.push_back(problem);
      }
      if (problems.size() >= most_problems_shown) break;
    }
  }
  if (!problems.empty()) throw ConfigError(std::move(problems));
  for (std::size_t k = 0; k < warnings.size(); ++k)
    warnings[k].problem.what += fmt::format("; {} of {} points)", counts[k], read);
  return warnings;
}

}  // namespace shakebed::pipelines
