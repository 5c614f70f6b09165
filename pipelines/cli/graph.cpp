// implements: pipelines/cli/commands.hpp
#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/runner/plan_graph.hpp"
#include "pipelines/runner/read_recipe.hpp"

namespace shakebed::pipelines {
namespace {

struct GraphArguments {
  std::string recipe, format = "dot";
};

int graph(const Call& call, const GraphArguments& given) {
  const Plan plan = read_recipe(given.recipe);
  if (call.json) {
    Json nodes = Json::array(), edges = Json::array();
    for (const PlannedStage& stage : plan.stages) {
      nodes.push_back(Json{{"id", stage.id}, {"stage", stage.row->name}});
      for (const std::size_t k : stage.from) edges.push_back(Json::array({plan.stages[k].id, stage.id}));
    }
    print(dump(Json{{"nodes", std::move(nodes)}, {"edges", std::move(edges)}}));
  } else {
    print(given.format == "mermaid" ? graph_mermaid(plan) : graph_dot(plan));
  }
  return exit_ok;
}

}  // namespace

void add_graph(Program& program) {
  const auto given = std::make_shared<GraphArguments>();
  CLI::App& command = program.add(
      {"graph", "draw the stages of a recipe and the arrows between them",
       "  shakebed graph bed.json | dot -Tsvg > bed.svg\n  shakebed graph bed.json --format mermaid", false},
      [given](const Call& call) { return graph(call, *given); });
  command.add_option("recipe", given->recipe, "recipe whose stages are drawn")->required()->type_name("FILE.json");
  command.add_option("--format", given->format, "output format: dot (default) or mermaid")
      ->check(CLI::IsMember({"dot", "mermaid"}));
}

}  // namespace shakebed::pipelines
