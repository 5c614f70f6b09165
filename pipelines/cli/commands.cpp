#include "pipelines/cli/commands.hpp"

#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "pipelines/formats/embedded.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/plan_graph.hpp"
#include "pipelines/runner/read_recipe.hpp"
#include "pipelines/runner/recipe_schema.hpp"
#include "pipelines/runner/run.hpp"
#include "pipelines/runner/slurm.hpp"
#include "pipelines/runner/sweep.hpp"
#include "pipelines/stages/images_module.hpp"
#include "pipelines/stages/measured_profile.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {

Console::Level level_of(const CommonArguments& common) {
  return common.quiet ? Console::Level::quiet : common.verbose ? Console::Level::verbose : Console::Level::normal;
}

void print(std::string_view text) {
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw StageError("stdout cannot be written");
}

std::vector<Setting> settings_of(const RunArguments& run) {
  std::vector<Setting> settings;
  for (const std::string& text : run.settings) settings.push_back(parse_setting(text));
  return settings;
}

RecipeChanges changes_of(const RunArguments& run) { return {run.preset, settings_of(run), run.data}; }

// Mistakes end the program before anything runs; what is odd is said by validate, explain and run alike.
void show_warnings(const Plan& plan) {
  for (const Warning& warning : plan.warnings)
    std::fputs(fmt::format("warning: {}\n", to_string(warning.problem)).c_str(), stderr);
}

fs::path out_of(const Arguments& arguments, const std::string& name) {
  return arguments.common.out ? fs::path(*arguments.common.out) : fs::path("results") / name;
}

RunOptions run_options(const Arguments& arguments, const Plan& plan) {
  RunOptions options;
  options.out = out_of(arguments, plan.name);
  options.only = arguments.run.only, options.from = arguments.run.from, options.until = arguments.run.until;
  options.force = arguments.run.force;
  options.jobs = arguments.run.jobs;
  options.command_line = arguments.command_line;
  options.settings = settings_of(arguments.run);
  return options;
}

Json outcome_json(const Plan& plan, const RunOutcome& outcome) {
  Json out;
  out["pipeline"] = plan.name;
  out["out"] = outcome.out.string();
  out["exit_code"] = static_cast<int>(outcome.code);
  if (!outcome.error.empty()) out["error"] = outcome.error;
  out["stages"] = Json::array();
  for (const StageOutcome& stage : outcome.stages) {
    Json row{{"id", stage.id}, {"stage", stage.kind}, {"state", to_string(stage.state)}};
    if (!stage.reasons.empty()) row["why"] = stage.reasons;
    if (!stage.error.empty()) row["error"] = stage.error;
    out["stages"].push_back(std::move(row));
  }
  out["failed_checks"] = outcome.failed_checks;
  out["summary"] = summary_json(plan, outcome);
  return out;
}

Json explanation_json(const Plan& plan, const std::vector<StageOutcome>& stages) {
  Json out = Json::array();
  for (const StageOutcome& stage : stages) {
    Json row{{"id", stage.id},
             {"stage", stage.kind},
             {"runs", stage.state == StageState::waiting},
             {"state", to_string(stage.state)},
             {"why", stage.reasons}};
    if (Json facts = plan.find(stage.id)->stage->facts(); !facts.empty()) row["facts"] = std::move(facts);
    out.push_back(std::move(row));
  }
  return out;
}

// "bed: gamma 4.02, column number 15, width 16 D".
std::string facts_text(const Plan& plan) {
  std::string text;
  for (const PlannedStage& stage : plan.stages) {
    std::string line;
    const Json facts = stage.stage->facts();
    for (const auto& [name, quantity] : facts.items()) {
      std::string words = name;
      std::replace(words.begin(), words.end(), '_', ' ');
      const std::string unit = quantity.value("unit", "1");
      line += fmt::format("{}{} {:.4g}{}", line.empty() ? "" : ", ", words, quantity["value"].get<double>(),
                          unit == "1" ? "" : " " + unit);
    }
    if (!line.empty()) text += fmt::format("{}: {}\n", stage.id, line);
  }
  return text;
}

// Runs a plan, or says what would run. With --json the result goes to stdout, or into `result` when there is one.
int run_plan_command(const Arguments& arguments, const Plan& plan, Json* result = nullptr) {
  const RunOptions options = run_options(arguments, plan);
  Console console(level_of(arguments.common));
  const auto answer = [&](Json json) {
    if (result != nullptr)
      *result = std::move(json);
    else
      print(dump(json));
  };
  if (plan.sweep) {
    if (arguments.run.dry_run) show_warnings(plan);
    SweepArguments sweep{arguments.run.shard, arguments.run.gather, arguments.run.dry_run, arguments.common.json, {}};
    const int code = run_sweep_command(plan, options, sweep, report_pages(), console);
    if (arguments.common.json) answer(std::move(sweep.result));
    return code;
  }
  if (arguments.run.gather) throw UsageError("--gather: this recipe has no \"sweep\", so there is nothing to gather");
  if (arguments.run.shard) throw UsageError("--shard: this recipe has no \"sweep\", so it has one point only");
  if (arguments.run.dry_run) {
    const auto stages = explain(plan, options);
    show_warnings(plan);
    if (arguments.common.json)
      answer(explanation_json(plan, stages));
    else
      print(explanation_text(stages) + facts_text(plan));
    return exit_ok;
  }
  install_interrupt_handler();
  const RunOutcome outcome = run_pipeline(plan, options, report_pages(), console);
  if (!outcome.error.empty()) console.error(outcome.error);
  for (const std::string& check : outcome.failed_checks) console.error("check failed: " + check);
  if (arguments.common.json) {
    answer(outcome_json(plan, outcome));
  } else {
    std::string text = terminal_text(plan, outcome);
    text += fmt::format("results: {}\nreport:  {}\n", outcome.out.string(), (outcome.out / "report.html").string());
    print(text);
  }
  return outcome.code;
}

void require_positive(const char* name, double value) {
  if (!(value > 0)) throw UsageError(fmt::format("{}: must be above 0, got {}", name, number_text(value)));
}

double quantity_argument(const std::string& name, const std::string& text, const Dimension& wanted) {
  try {
    return parse_quantity(text, wanted);
  } catch (const std::invalid_argument& problem) {
    throw UsageError(fmt::format("{}: {}", name, problem.what()));
  }
}

// A bead's diameter; one of metres is worth a word.
double diameter_argument(const std::string& text) {
  const double diameter = quantity_argument("--diameter", text, dimension::length);
  require_positive("--diameter", diameter);
  if (const auto odd = odd_bead(diameter))
    std::fputs(fmt::format("warning: --diameter: {}. {}\n", odd->what, odd->suggestion).c_str(), stderr);
  return diameter;
}

// A length with its unit, or a plain number of diameters.
double diameters_argument(const std::string& name, const std::string& text, std::optional<double> diameter) {
  try {
    const Quantity quantity = parse_quantity(text);
    if (!quantity.has_unit) return quantity.value;
    if (quantity.dimension != dimension::length) throw UsageError(fmt::format("{}: \"{}\" is no length", name, text));
    if (!diameter)
      throw UsageError(
          fmt::format("{}: a length needs --diameter beside it, or write a plain number of diameters", name));
    return quantity.value / *diameter;
  } catch (const std::invalid_argument& problem) {
    throw UsageError(fmt::format("{}: {}", name, problem.what()));
  }
}

double checked_plateau(std::optional<double> given) {
  const double density = given.value_or(fit::close_packing_density);
  if (!(density > 0) || density > fit::close_packing_density * (1 + 1e-12)) {
    throw UsageError(fmt::format("--plateau-density: must be above 0 and at most {} (close packing), got {}",
                                 number_text(fit::close_packing_density), number_text(density)));
  }
  return density;
}

}  // namespace

int command_run(const Arguments& arguments) {
  const fs::path file = arguments.recipe;
  return run_plan_command(arguments, read_recipe(file, changes_of(arguments.run)));
}

int command_reproduce(const Arguments& arguments) {
  // A figure's name → its recipe: "quinn-hong-fig2" is recipes/quinn-hong-fig2/figure.json. The first one shipped comes
  // first.
  std::vector<std::pair<std::string, const EmbeddedFile*>> figures;
  for (const EmbeddedFile& file : embedded_files()) {
    const fs::path path(file.name);
    if (!file.name.starts_with("recipes/") || path.stem() != "figure") continue;
    figures.emplace_back(path.parent_path().filename().string(), &file);
  }
  std::sort(figures.begin(), figures.end(), [](const auto& l, const auto& r) {
    const auto order = [](const std::string& name) { return std::pair(name != "clement-rajchenbach", name); };
    return order(l.first) < order(r.first);
  });
  const std::string wanted =
      arguments.recipe.empty() || arguments.recipe == "quinn-hong-fig3" ? "clement-rajchenbach" : arguments.recipe;
  std::vector<std::string> names{"all"};
  for (const auto& [name, file] : figures) names.push_back(name);
  if (std::find(names.begin(), names.end(), wanted) == names.end()) {
    const std::string nearest = nearest_name(wanted, names);
    throw UsageError(fmt::format("there is no shipped figure \"{}\"; {}", wanted,
                                 nearest.empty() ? fmt::format("there are {}", fmt::join(names, ", "))
                                                 : fmt::format("did you mean \"{}\"?", nearest)));
  }
  const auto read = [&](const EmbeddedFile& file) {
    return read_recipe_text(std::string(file.text), std::string(file.name), fs::current_path(),
                            changes_of(arguments.run));
  };
  if (wanted != "all") {
    const auto chosen =
        std::find_if(figures.begin(), figures.end(), [&](const auto& figure) { return figure.first == wanted; });
    return run_plan_command(arguments, read(*chosen->second));
  }
  // All: every recipe is read before the first runs; one that fails does not keep the others from running.
  std::vector<std::pair<std::string, Plan>> plans;
  for (const auto& [name, file] : figures) plans.emplace_back(name, read(*file));
  int code = exit_ok;
  Json answers = Json::array();
  std::string table;
  for (const auto& [name, plan] : plans) {
    Arguments one = arguments;
    if (one.common.out) one.common.out = (fs::path(*one.common.out) / name).string();
    if (!arguments.common.json && !arguments.run.dry_run) print(fmt::format("== {}\n", name));
    const auto start = std::chrono::steady_clock::now();
    Json answer;
    int result = exit_ok;
    try {
      result = run_plan_command(one, plan, &answer);
    } catch (const Error& error) {
      std::fputs(fmt::format("error: {}: {}\n", name, error.what()).c_str(), stderr);
      result = error.code();
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    answers.push_back(Json{{"figure", name}, {"exit_code", result}, {"wall_seconds", seconds}, {"result", answer}});
    table += fmt::format("{:<24} {:<14} {:>12}  {}\n", name,
                         result == exit_ok             ? "ok"
                         : result == exit_check_failed ? "check failed"
                                                       : fmt::format("exit code {}", result),
                         duration_text(seconds), (out_of(one, plan.name) / "report.html").string());
    if (code == exit_ok) code = result;
    if (result == exit_interrupted) break;
  }
  if (arguments.common.json)
    print(dump(Json{{"figures", std::move(answers)}}));
  else if (!arguments.run.dry_run)
    print(fmt::format("== all figures\n{}", table));
  return code;
}

int preview_images(const Arguments& arguments) {
  const ImageArguments& image = arguments.images;
  PreviewRequest request{.files = image.files, .diameter = image.diameter, .options = {}, .folder = {}};
  ExtractOptions& options = request.options;
  options.roi = image.roi;
  options.radius = image.radius;
  if (image.polarity == "dark") options.polarity = BeadPolarity::dark;
  if (image.polarity == "bright") options.polarity = BeadPolarity::bright;
  const std::vector<std::string> channels = {"automatic",          "red", "green", "blue", "grey", "saturation",
                                             "background_distance"};
  if (image.channel)
    options.channel =
        static_cast<BeadChannel>(std::find(channels.begin(), channels.end(), *image.channel) - channels.begin());
  const fs::path folder = arguments.common.out.value_or("shakebed-preview");
  fs::create_directories(folder);
  request.folder = folder.string();
  print(fmt::format("{}\nsee {}\n", images_module().preview(request), (folder / "preview.html").string()));
  return exit_ok;
}

int command_fit_images(const Arguments& arguments) {
  const ImageArguments& image = arguments.images;
  require_positive("--diameter", quantity_argument("--diameter", image.diameter, dimension::length));
  Json extract{{"stage", "extract"},
               {"id", "extract"},
               {"images", Json::array()},
               {"diameter", image.diameter},
               {"overlays", 2}};
  for (const std::string& file : image.files) extract["images"].push_back(fs::absolute(file).string());
  if (image.scale) extract["scale"] = *image.scale;
  if (image.floor) extract["floor"] = *image.floor;
  if (image.left_wall) extract["left_wall"] = *image.left_wall;
  if (image.right_wall) extract["right_wall"] = *image.right_wall;
  if (!image.roi.empty()) extract["roi"] = image.roi;
  if (image.polarity) extract["polarity"] = *image.polarity;
  if (image.channel) extract["channel"] = *image.channel;
  if (image.radius) extract["radius"] = *image.radius;
  if (image.preview) return preview_images(arguments);
  if (image.second_diameter) extract["second_diameter"] = *image.second_diameter;
  if (image.gravity) extract["gravity"] = *image.gravity;
  if (image.pixel_aspect) extract["pixel_aspect"] = *image.pixel_aspect;
  if (image.lens) extract["lens"] = *image.lens;
  if (image.bead_number) extract["bead_number"] = *image.bead_number;
  if (image.kernel) {
    const auto kernel = kernel_from(*image.kernel);
    if (!kernel || kernel->kind == KernelKind::none)
      throw UsageError(fmt::format(
          "--kernel: expected gaussian:WIDTH, top_hat:WIDTH or disk_chord:WIDTH (in D), got \"{}\"", *image.kernel));
    extract["kernel"] = Json{{"kind", to_string(kernel->kind)}, {"width", kernel->width}};
  }
  if (image.frame_rate) {
    extract["frame_rate"] = *image.frame_rate;
    if (image.frequency) extract["frequency"] = *image.frequency;
  }
  Json fit{{"stage", "fit"}, {"from", "extract"}, {"plateau_density", checked_plateau(image.plateau_density)}};
  if (image.model) fit["model"] = *image.model;
  Json document;
  document["name"] = "fit-images";
  document["stages"] = Json::array({extract, fit});
  document["stages"].push_back(Json{{"stage", "figure"}, {"from", Json::array({"extract", "fit"})}});
  if (image.frequency && image.amplitude) {
    const double frequency = quantity_argument("--frequency", *image.frequency, dimension::frequency);
    const double amplitude = quantity_argument("--amplitude", *image.amplitude, dimension::length);
    const double gravity =
        quantity_argument("--gravity", image.gravity.value_or("9.81 m/s^2"), dimension::acceleration);
    require_positive("--frequency", frequency), require_positive("--amplitude", amplitude),
        require_positive("--gravity", gravity);
    const double omega = 2 * std::numbers::pi * frequency;
    document["stages"].push_back(Json{{"stage", "map"},
                                      {"from", Json::array({"fit", "extract"})},
                                      {"gamma", amplitude * omega * omega / gravity},
                                      {"frequency", *image.frequency}});
    if (image.initial_height) {
      const double diameter = quantity_argument("--diameter", image.diameter, dimension::length);
      const double height = diameters_argument("--initial-height", *image.initial_height, diameter);
      require_positive("--initial-height", height);
      document["stages"].back()["initial_height"] = height;
    }
  } else if (image.amplitude) {
    throw UsageError("--amplitude: Gamma also needs --frequency");
  }
  document["report"] = Json{{"title", "A bed in photographs"},
                            {"text",
                             "Disks were found in the frames given, the scale follows from the bead's diameter, the "
                             "profile is that of the disks' centres above the floor."}};
  return run_plan_command(
      arguments, read_recipe_text(dump(document), "(command line)", fs::current_path(), changes_of(arguments.run)));
}

int command_fit_profile(const Arguments& arguments) {
  const ProfileArguments& p = arguments.profile;
  const MeasuredProfile measured = read_measured_profile(p.file);
  fit::FitOptions options;
  if (p.model) options.model = *p.model;
  options.plateau_density = checked_plateau(p.plateau_density);
  options.plateau_density_free = p.plateau_density_free;
  options.column_number = p.column_number;
  if (!p.window.empty()) options.window.low = p.window[0], options.window.high = p.window[1];
  std::optional<double> diameter;
  if (p.diameter) {
    diameter = diameter_argument(*p.diameter);
  }
  if (p.kernel) {
    const auto kernel = kernel_from(*p.kernel);
    if (!kernel)
      throw UsageError(fmt::format(
          "--kernel: there is no kernel \"{}\"; write none, gaussian:0.5, top_hat:1 or disk_chord:1 (widths "
          "in D)",
          *p.kernel));
    options.kernel = *kernel;
  } else {
    options.kernel = measured.kernel.value_or(Kernel{});
  }
  if (!options.column_number) options.column_number = measured.column_number;
  const fit::FitResult result = fit::fit_profile(measured.profile, options);
  if (result.status == fit::FitStatus::bad_input) throw InputError(fmt::format("{}: {}", p.file, result.message));
  Json json = fit_json(result, diameter);
  for (const std::string& warning : measured.warnings) json["warnings"].push_back(warning);
  if (arguments.common.out) {
    fs::create_directories(*arguments.common.out);
    write_file_atomically(fs::path(*arguments.common.out) / "fit.json", dump(json));
  }
  print(arguments.common.json ? dump(json) : fit_text(json));
  return result.ok() ? exit_ok : exit_stage_failed;
}

int command_theory(const Arguments& arguments) {
  const TheoryArguments& t = arguments.theory;
  TheoryQuestion question;
  question.equation = t.equation;
  question.plateau_density = checked_plateau(t.plateau_density);
  if (t.diameter) {
    question.diameter = diameter_argument(*t.diameter);
  }
  if (t.initial_height && t.column_number)
    throw UsageError("--initial-height and --column-number say the same thing: give one");
  if (t.initial_height)
    question.initial_height = diameters_argument("--initial-height", *t.initial_height, question.diameter);
  if (t.column_number) question.initial_height = *t.column_number / question.plateau_density;
  if (question.initial_height) require_positive("--initial-height", *question.initial_height);
  if (t.temperature) {
    question.temperature = diameters_argument("--temperature", *t.temperature, question.diameter);
    require_positive("--temperature", *question.temperature);
    if (!question.initial_height)
      throw UsageError("--temperature: T/T_c also needs --initial-height or --column-number");
  }
  print(arguments.common.json ? dump_17_digits(theory_json(question)) : theory_text(question));
  return exit_ok;
}

int command_map(const Arguments& arguments) {
  const MapArguments& m = arguments.map;
  MapQuestion question;
  question.equation = m.equation;
  question.plateau_density = checked_plateau(m.plateau_density);
  question.frequency = quantity_argument("--frequency", m.frequency, dimension::frequency);
  question.diameter = diameter_argument(m.diameter);
  question.gravity = quantity_argument("--gravity", m.gravity.value_or("9.81 m/s^2"), dimension::acceleration);
  require_positive("--frequency", question.frequency), require_positive("--gravity", question.gravity);
  question.initial_height = diameters_argument("--initial-height", m.initial_height, question.diameter);
  require_positive("--initial-height", question.initial_height);
  if (m.restitution < 0 || m.restitution > 0.99) throw UsageError("--restitution: must be from 0 to 0.99");
  question.restitution = m.restitution;
  if (m.gamma.has_value() == m.amplitude.has_value()) throw UsageError("give --gamma or --amplitude, one of the two");
  if (m.gamma) {
    question.gamma = *m.gamma;
  } else {
    const double omega = 2 * std::numbers::pi * question.frequency;
    question.gamma =
        quantity_argument("--amplitude", *m.amplitude, dimension::length) * omega * omega / question.gravity;
  }
  require_positive("--gamma", question.gamma);
  if (m.temperature)
    question.measured_temperature = diameters_argument("--temperature", *m.temperature, question.diameter);
  const Json json = map_json(question);
  print(arguments.common.json ? dump(json) : map_text(json));
  return exit_ok;
}

int command_audit(const Arguments& arguments) {
  print(arguments.common.json ? dump(audit_json()) : audit_text());
  return exit_ok;
}

int command_init(const Arguments& arguments) {
  const fs::path file = arguments.recipe.empty() ? "bed.json" : arguments.recipe;
  std::error_code error;
  if (fs::exists(file, error))
    throw UsageError(fmt::format("{} exists; remove it first, or name another file", file.string()));
  const EmbeddedFile* starter = find_embedded("recipes/starter.json");
  if (starter == nullptr) throw StageError("the starter recipe is missing from this build");
  write_file_atomically(file, starter->text);
  print(arguments.common.json
            ? dump(Json{{"file", file.string()}})
            : fmt::format("wrote {0}\nnext: shakebed validate {0}\n      shakebed run {0}\n", file.string()));
  return exit_ok;
}

int command_schema(const Arguments& arguments) {
  const std::string text = dump(recipe_schema());
  if (arguments.recipe.empty())
    print(text);
  else
    write_file_atomically(arguments.recipe, text);
  return exit_ok;
}

Json problem_json(const Problem& problem) {
  return Json{{"file", problem.file},       {"line", problem.at.line}, {"column", problem.at.column},
              {"pointer", problem.pointer}, {"problem", problem.what}, {"suggestion", problem.suggestion}};
}

int command_validate(const Arguments& arguments) {
  const fs::path file = arguments.recipe;
  try {
    const Plan plan = read_recipe(file, changes_of(arguments.run));
    if (!arguments.common.json) {
      show_warnings(plan);
      if (!arguments.common.quiet)
        print(fmt::format("{}: valid: {} {}\n", file.string(), plan.stages.size(),
                          plan.stages.size() == 1 ? "stage" : "stages"));
      return exit_ok;
    }
    Json warnings = Json::array();
    for (const Warning& warning : plan.warnings) warnings.push_back(problem_json(warning.problem));
    print(dump(
        Json{{"valid", true}, {"name", plan.name}, {"stages", plan.stages.size()}, {"warnings", std::move(warnings)}}));
    return exit_ok;
  } catch (const ConfigError& error) {
    if (!arguments.common.json) throw;
    Json problems = Json::array();
    for (const Problem& problem : error.problems()) problems.push_back(problem_json(problem));
    print(dump(Json{{"valid", false}, {"problems", std::move(problems)}}));
    return error.code();
  }
}

int command_explain(const Arguments& arguments) {
  Arguments dry = arguments;
  dry.run.dry_run = true;
  return command_run(dry);
}

int command_graph(const Arguments& arguments) {
  const Plan plan = read_recipe(arguments.recipe);
  if (arguments.common.json) {
    Json nodes = Json::array(), edges = Json::array();
    for (const PlannedStage& stage : plan.stages) {
      nodes.push_back(Json{{"id", stage.id}, {"stage", stage.row->name}});
      for (const std::size_t k : stage.from) edges.push_back(Json::array({plan.stages[k].id, stage.id}));
    }
    print(dump(Json{{"nodes", std::move(nodes)}, {"edges", std::move(edges)}}));
  } else {
    print(arguments.format == "mermaid" ? graph_mermaid(plan) : graph_dot(plan));
  }
  return exit_ok;
}

int command_status(const Arguments& arguments) {
  const fs::path out = arguments.recipe;
  std::error_code error;
  if (!fs::is_directory(out, error)) throw InputError(fmt::format("{}: there is no such folder", out.string()));
  Json json;
  json["folder"] = out.string();
  bool running = false;
  if (fs::exists(out / ".lock", error)) {
    try {
      const FolderLock lock(out);
    } catch (const StageError&) {
      running = true;
    }
  }
  json["running"] = running;
  if (fs::is_regular_file(out / "manifest.json", error)) {
    const Json manifest = read_json(out / "manifest.json");
    for (const char* key : {"pipeline", "finished", "exit_code", "error", "wall_seconds"}) {
      if (manifest.contains(key)) json[key] = manifest[key];
    }
  }
  std::vector<std::pair<std::string, StageRecord>> records;
  for (const fs::directory_entry& entry : fs::directory_iterator(out, error)) {
    if (!entry.is_directory(error) || entry.is_symlink(error)) continue;
    if (auto record = read_record(entry.path()))
      records.emplace_back(entry.path().filename().string(), std::move(*record));
  }
  std::sort(records.begin(), records.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  json["stages"] = Json::array();
  std::string text = fmt::format(
      "{}: {}\n", out.string(),
      running ? "running now"
      : json.contains("exit_code")
          ? fmt::format("finished {} with exit code {}", json.value("finished", ""), json.value("exit_code", 0))
          : "no finished run");
  for (const auto& [id, record] : records) {
    std::uint64_t bytes = 0;
    std::vector<std::string> damaged;
    const std::optional<StageCost> cost = read_cost(out / id);
    for (const Fingerprint& file : record.outputs) {
      bytes += file.bytes;
      if (fs::file_size(out / id / file.file, error) != file.bytes || error) damaged.push_back(file.file);
    }
    json["stages"].push_back(Json{{"id", id},
                                  {"stage", record.stage},
                                  {"code", record.code},
                                  {"wall_seconds", cost ? Json(cost->wall_seconds) : Json()},
                                  {"files", record.outputs.size()},
                                  {"bytes", bytes},
                                  {"damaged", damaged}});
    text += fmt::format("  {:<16} {:<10} {:>5} files {:>12} bytes  {:>10}{}\n", id, record.stage, record.outputs.size(),
                        bytes, cost ? duration_text(cost->wall_seconds) : "",
                        damaged.empty() ? "" : fmt::format("  damaged: {}", fmt::join(damaged, ", ")));
  }
  if (records.empty()) text += "  no finished stage\n";
  const Json sweep = sweep_status(out);
  if (!sweep.is_null()) {
    json["sweep"] = sweep;
    text += fmt::format("  sweep: {} of {} points done, {} failed\n", sweep["done"].get<std::uint64_t>(),
                        sweep["points"].get<std::uint64_t>(), sweep["failed"].get<std::uint64_t>());
  }
  print(arguments.common.json ? dump(json) : text);
  return exit_ok;
}

int command_verify(const Arguments& arguments) {
  const fs::path out = arguments.recipe;
  const VerifyResult result = verify_output(out);
  if (arguments.common.json) {
    print(dump(Json{{"files", result.files}, {"problems", result.problems}}));
  } else {
    for (const std::string& problem : result.problems) std::fputs(fmt::format("{}\n", problem).c_str(), stderr);
    print(result.problems.empty()
              ? fmt::format("{}: all {} files are as the manifest says\n", out.string(), result.files)
              : fmt::format("{}: {} of {} files are not as the manifest says\n", out.string(), result.problems.size(),
                            result.files));
  }
  return result.problems.empty() ? exit_ok : exit_check_failed;
}

int command_rerun(const Arguments& arguments) {
  const fs::path before = arguments.recipe;
  const Json manifest = read_json(before / "manifest.json");
  if (!manifest.contains("document") || !manifest.contains("stages"))
    throw InputError((before / "manifest.json").string() + ": is not a manifest of ours");
  const fs::path directory = manifest["recipe"].value("directory", std::string("."));
  Plan plan = make_plan(to_node(manifest["document"]), (before / "manifest.json").string() + " (document)", directory);
  RunOptions options;
  options.out = arguments.common.out ? fs::path(*arguments.common.out) : fs::path(before.string() + "-rerun");
  options.jobs = arguments.run.jobs;
  options.force = true;
  options.command_line = arguments.command_line;
  std::error_code error;
  if (fs::equivalent(options.out, before, error)) throw UsageError("--out: a rerun needs a folder of its own");
  Console console(level_of(arguments.common));
  install_interrupt_handler();
  if (plan.sweep) {
    SweepArguments whole;
    const int code = run_sweep_command(plan, options, whole, report_pages(), console);
    if (code != exit_ok && code != exit_check_failed) return code;
    const bool same = read_file(before / "sweep.csv") == read_file(options.out / "sweep.csv");
    print(same ? "the same: sweep.csv came out byte for byte\n" : "sweep.csv differs\n");
    return same ? exit_ok : exit_check_failed;
  }
  const RunOutcome outcome = run_pipeline(plan, options, report_pages(), console);
  if (!outcome.error.empty()) console.error(outcome.error);
  if (outcome.code != exit_ok && outcome.code != exit_check_failed) return outcome.code;
  // Everything the first run made, file by file.
  std::vector<std::string> different;
  std::size_t files = 0;
  for (const Json& stage : manifest["stages"]) {
    if (!stage.contains("outputs")) continue;
    for (const Json& entry : stage["outputs"]) {
      const std::string name = entry.value("file", std::string());
      ++files;
      if (!fs::is_regular_file(options.out / name, error) ||
          sha256_of_file(options.out / name) != entry.value("sha256", std::string()))
        different.push_back(name);
    }
  }
  if (arguments.common.json) {
    print(dump(Json{{"files", files}, {"different", different}, {"out", options.out.string()}}));
  } else {
    for (const std::string& name : different) std::fputs(fmt::format("differs: {}\n", name).c_str(), stderr);
    print(different.empty()
              ? fmt::format("the same: all {} files of {} came out byte for byte\n", files, before.string())
              : fmt::format("{} of {} files differ\n", different.size(), files));
  }
  return different.empty() ? exit_ok : exit_check_failed;
}

int command_clean(const Arguments& arguments) {
  const fs::path folder = arguments.recipe.empty() ? "results" : arguments.recipe;
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw InputError(fmt::format("{}: there is no such folder", folder.string()));
  double age = 0;
  if (!arguments.older_than.empty()) {
    std::string text = arguments.older_than;
    double unit = 0;
    if (text.ends_with("d"))
      unit = 86400;
    else if (text.ends_with("h"))
      unit = 3600;
    else if (text.ends_with("min"))
      unit = 60, text.resize(text.size() - 2);
    if (unit == 0) throw UsageError("--older-than: write a number of days, hours or minutes: 30d, 12h, 90min");
    text.pop_back();
    age = unit * quantity_argument("--older-than", text, dimension::none);
  }
  const auto is_ours = [&](const fs::path& path) { return fs::is_regular_file(path / "manifest.json", error); };
  std::vector<fs::path> candidates;
  if (is_ours(folder)) {
    candidates.push_back(folder);
  } else {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
      if (entry.is_directory(error) && !entry.is_symlink(error) && is_ours(entry.path()))
        candidates.push_back(entry.path());
    }
    std::sort(candidates.begin(), candidates.end());
  }
  Json removed = Json::array();
  for (const fs::path& path : candidates) {
    const auto written = fs::last_write_time(path / "manifest.json", error);
    const double seconds = std::chrono::duration<double>(fs::file_time_type::clock::now() - written).count();
    if (seconds < age) continue;
    if (!arguments.run.dry_run) {
      const FolderLock lock(path);  // nobody works in it
      fs::remove_all(path, error);
      if (error) throw StageError(fmt::format("{}: cannot be removed: {}", path.string(), error.message()));
    }
    removed.push_back(path.string());
    if (!arguments.common.json)
      print(fmt::format("{} {}\n", arguments.run.dry_run ? "would remove" : "removed", path.string()));
  }
  if (arguments.common.json)
    print(dump(Json{{"removed", removed}, {"dry_run", arguments.run.dry_run}}));
  else if (removed.empty())
    print("nothing to remove\n");
  return exit_ok;
}

int command_submit_slurm(const Arguments& arguments) {
  const Plan plan = read_recipe(arguments.recipe, changes_of(arguments.run));
  Console console(level_of(arguments.common));
  SlurmOptions options;
  options.shards = arguments.slurm.shards;
  options.sbatch = arguments.slurm.options;
  options.preset = arguments.run.preset;
  options.settings = arguments.run.settings;
  options.dry_run = arguments.run.dry_run;
  options.json = arguments.common.json;
  options.out = out_of(arguments, plan.name);
  return submit_slurm(plan, options, console);
}

}  // namespace shakebed::pipelines
