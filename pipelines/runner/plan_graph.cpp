#include "pipelines/runner/plan_graph.hpp"

#include <fmt/format.h>

namespace shakebed::pipelines {

std::string graph_dot(const Plan& plan) {
  std::string out = fmt::format("digraph \"{}\" {{\n  rankdir=LR;\n  node [shape=box, style=rounded];\n", plan.name);
  for (const PlannedStage& stage : plan.stages) {
    const std::string kind = stage.id == stage.row->name ? "" : fmt::format("\\n({})", stage.row->name);
    out += fmt::format("  \"{}\" [label=\"{}{}\"];\n", stage.id, stage.id, kind);
  }
  for (const PlannedStage& stage : plan.stages) {
    for (const std::size_t k : stage.from) out += fmt::format("  \"{}\" -> \"{}\";\n", plan.stages[k].id, stage.id);
  }
  return out + "}\n";
}

std::string graph_mermaid(const Plan& plan) {
  std::string out = "flowchart LR\n";
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    const PlannedStage& stage = plan.stages[i];
    out += fmt::format("  s{}[\"{}{}\"]\n", i, stage.id,
                       stage.id == stage.row->name ? "" : fmt::format(" ({})", stage.row->name));
  }
  for (std::size_t i = 0; i < plan.stages.size(); ++i) {
    for (const std::size_t k : plan.stages[i].from) out += fmt::format("  s{} --> s{}\n", k, i);
  }
  return out;
}

}  // namespace shakebed::pipelines
