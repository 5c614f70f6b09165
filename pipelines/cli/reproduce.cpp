// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/results_page.hpp"
#include "pipelines/cli/run_plan.hpp"
#include "pipelines/formats/embedded.hpp"
#include "pipelines/runner/run.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

constexpr const char* first_figure = "clement-rajchenbach";

using ShippedFigure = ShippedRecipe;  // "quinn-hong-fig2" is recipes/quinn-hong-fig2/figure.json

// The main one first.
std::vector<ShippedFigure> shipped_figures() {
  std::vector<ShippedFigure> figures;
  for (const EmbeddedFile& file : embedded_files()) {
    const fs::path path(file.name);
    if (!file.name.starts_with("recipes/") || path.stem() != "figure") continue;
    figures.push_back({path.parent_path().filename().string(), &file});
  }
  std::sort(figures.begin(), figures.end(), [](const ShippedFigure& l, const ShippedFigure& r) {
    const auto order = [](const std::string& name) { return std::pair(name != first_figure, name); };
    return order(l.name) < order(r.name);
  });
  return figures;
}

// Those asked for: one, or all.
std::vector<ShippedFigure> chosen_figures(const std::string& asked) {
  std::vector<ShippedFigure> figures = shipped_figures();
  const std::string wanted = asked.empty() || asked == "quinn-hong-fig3" ? first_figure : asked;
  if (wanted == "all") return figures;
  std::vector<std::string> names{"all"};
  for (const ShippedFigure& figure : figures) {
    if (figure.name == wanted) return {figure};
    names.push_back(figure.name);
  }
  const std::string nearest = nearest_name(wanted, names);
  throw UsageError(fmt::format(
      "there is no recipe \"{}\"; {}", wanted,
      nearest.empty() ? "`shakebed reproduce --list` shows the names" : fmt::format("did you mean \"{}\"?", nearest)));
}

Plan plan_of(const ShippedFigure& figure, const RunArguments& run) {
  return read_recipe_text(std::string(figure.file->text), std::string(figure.file->name), fs::current_path(),
                          changes_of(run));
}

// One of several figures, in a folder of its own: a row of the table, and for --json.
struct FigureRun {
  int code = exit_ok;
  std::string row;
  Json json;
};
FigureRun run_figure(Call call, const RunArguments& run, const std::string& name, const Plan& plan) {
  if (call.out) call.out = (fs::path(*call.out) / name).string();
  if (!call.json && !run.dry_run) print(fmt::format("== {}\n", name));
  const auto start = std::chrono::steady_clock::now();
  FigureRun out;
  Json answer;
  try {
    out.code = run_plan_command(call, run, plan, &answer);
  } catch (const Error& error) {
    std::fputs(fmt::format("error: {}: {}\n", name, error.what()).c_str(), stderr);
    out.code = error.code();
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  out.json = Json{{"figure", name}, {"exit_code", out.code}, {"wall_seconds", seconds}, {"result", answer}};
  const std::string ended = out.code == exit_ok             ? "ok"
                            : out.code == exit_check_failed ? "check failed"
                                                            : fmt::format("exit code {}", out.code);
  out.row = fmt::format("{:<24} {:<14} {:>12}  {}\n", name, ended, duration_text(seconds),
                        (out_of(call, plan.name) / "report.html").string());
  return out;
}

// Every recipe is read before the first runs; one that fails does not keep the others from running.
int run_all(const Call& call, const RunArguments& run, const std::vector<ShippedFigure>& figures) {
  std::vector<Plan> plans;
  for (const ShippedFigure& figure : figures) plans.push_back(plan_of(figure, run));
  int code = exit_ok;
  Json answers = Json::array();
  std::string table;
  for (std::size_t i = 0; i < figures.size(); ++i) {
    FigureRun one = run_figure(call, run, figures[i].name, plans[i]);
    answers.push_back(std::move(one.json));
    table += one.row;
    if (code == exit_ok) code = one.code;
    if (one.code == exit_interrupted) break;
  }
  if (call.json)
    print(dump(Json{{"figures", std::move(answers)}}));
  else if (!run.dry_run)
    print(fmt::format("== all figures\n{}", table));
  return code;
}

struct ReproduceArguments {
  std::string figure;
  bool list = false, results = false;
  RunArguments run;
};

int show_results(const Call& call, const ReproduceArguments& given) {
  if (call.json) {
    const bool all = given.list || given.figure.empty();
    print(dump(results_json(all ? shipped_figures() : chosen_figures(given.figure), given.list)));
  } else {
    print(given.list             ? results_list(shipped_figures())
          : given.figure.empty() ? results_page(shipped_figures())
                                 : recipe_page(chosen_figures(given.figure).front()));
  }
  return exit_ok;
}

}  // namespace

void add_reproduce(Program& program) {
  const auto given = std::make_shared<ReproduceArguments>();
  CLI::App& command =
      program.add({"reproduce", "run a shipped recipe: a published result, end to end",
                   "  shakebed reproduce\n  shakebed reproduce --preset quick\n"
                   "  shakebed reproduce clement-rajchenbach --data my-digitised-points.csv\n  shakebed reproduce "
                   "--list\n  shakebed reproduce lee-1995 --results\n  shakebed reproduce all --preset quick"},
                  [given](const Call& call) {
                    if (given->list || given->results) return show_results(call, *given);
                    const std::vector<ShippedFigure> figures = chosen_figures(given->figure);
                    if (given->figure == "all") return run_all(call, given->run, figures);
                    return run_plan_command(call, given->run, plan_of(figures.front(), given->run));
                  });
  command.add_option(
      "figure", given->figure,
      "name of a recipe (--list shows them), or all (default: clement-rajchenbach, also named quinn-hong-fig3)");
  command.add_flag("--list", given->list, "list the recipes with their recorded verdicts, and run nothing");
  command
      .add_flag("--results", given->results,
                "print the recorded results of all recipes, or of one recipe, and run nothing")
      ->excludes("--list");
  add_preset(command, given->run);
  add_budget(command, given->run);
  add_run_options(command, given->run);
}

}  // namespace shakebed::pipelines
