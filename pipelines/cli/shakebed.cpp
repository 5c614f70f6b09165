// The program: its commands and their options. What each command does is in commands.cpp.
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <functional>

#include "pipelines/cli/command_pages.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/exit_code.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/manifest.hpp"

namespace {

using namespace shakebed::pipelines;

constexpr const char* exit_codes =
    "Exit codes: 0 ok, 2 usage, 3 configuration, 4 input, 5 stage failed, 6 check failed, 130 interrupted.";

void add_common(CLI::App& command, CommonArguments& common) {
  command.add_option("--out", common.out, "folder for the results")->type_name("DIR");
  command.add_flag("--json", common.json, "machine-readable result on stdout, messages on stderr");
  command.add_flag("--quiet,-q", common.quiet, "warnings and errors only");
  command.add_flag("--verbose,-v", common.verbose, "what the stages say");
}

void add_preset(CLI::App& command, RunArguments& run) {
  command
      .add_option("--preset", run.preset,
                  "changes that the recipe carries under this name (\"quick\", say); before --set")
      ->type_name("NAME");
}

void add_run(CLI::App& command, RunArguments& run) {
  command.add_option("--set", run.settings, "change the recipe: POINTER=VALUE, as in --set /stages/bed/seed=7")
      ->type_name("POINTER=VALUE");
  command.add_option("--only", run.only, "only this stage")->type_name("STAGE");
  command.add_option("--from", run.from, "this stage and those that follow from it")->type_name("STAGE");
  command.add_option("--until", run.until, "this stage and those it needs")->type_name("STAGE");
  command.add_flag("--force", run.force, "run also what is up to date");
  command.add_flag("--dry-run", run.dry_run, "say what would run, and why, without running it");
  command.add_option("--jobs,-j", run.jobs, "threads (default: all processors)")
      ->type_name("N")
      ->check(CLI::PositiveNumber);
  command.add_option("--shard", run.shard, "of a sweep: only the points k, k + n, k + 2n, ... (k from 1 to n)")
      ->type_name("K/N");
  command.add_flag("--gather", run.gather, "of a sweep: run nothing, gather what its shards have left");
  command
      .add_option("--data", run.data,
                  "points of your own (CSV with height, number_density): drawn into the figures and compared")
      ->type_name("FILE.csv");
}

int run_program(int argc, char** argv) {
  CLI::App app{
      "shakebed: from a shaken bed (simulated, photographed or rendered) to its density profile, its temperature and "
      "its solid height."};
  app.require_subcommand(1);
  app.set_version_flag("--version",
                       fmt::format("shakebed {} ({}, {})", program_version(), source_revision(), compiler_text()));
  app.footer(std::string("Begin with `shakebed reproduce`, or `shakebed init` for a recipe of your own.\n") +
             exit_codes);
  app.get_formatter()->column_width(34);

  Arguments arguments;
  arguments.command_line.assign(argv, argv + argc);
  if (!arguments.command_line.empty()) arguments.command_line[0] = "shakebed";
  std::function<int()> chosen;
  const auto command = [&](CLI::App* parent, const char* name, const char* help, const char* examples,
                           int (*work)(const Arguments&)) {
    CLI::App* sub = parent->add_subcommand(name, help);
    sub->footer(fmt::format("Examples:\n{}", examples));
    add_common(*sub, arguments.common);
    sub->callback([&arguments, &chosen, work] { chosen = [&arguments, work] { return work(arguments); }; });
    return sub;
  };

  CLI::App* reproduce = command(&app, "reproduce", "run a shipped recipe: a published figure, end to end",
                                "  shakebed reproduce\n  shakebed reproduce --preset quick\n  shakebed reproduce "
                                "clement-rajchenbach --data my-digitised-points.csv\n  shakebed reproduce all",
                                command_reproduce);
  reproduce->add_option(
      "figure", arguments.recipe,
      "clement-rajchenbach (the default; also named quinn-hong-fig3), quinn-hong-fig1, quinn-hong-fig2, "
      "quinn-hong-eq6, quinn-hong-beyond, quinn-hong-tc, temperature-map, all");
  add_preset(*reproduce, arguments.run);
  add_run(*reproduce, arguments.run);

  CLI::App* run = command(&app, "run", "run a pipeline",
                          "  shakebed run bed.json\n  shakebed run bed.json --set /stages/bed/floor/amplitude=\"3 mm\" "
                          "--out o\n  shakebed run bed.json --dry-run\n  shakebed run "
                          "sweep.json --jobs 8 --shard 2/4",
                          command_run);
  run->add_option("recipe", arguments.recipe, "the recipe")->required()->type_name("FILE.json");
  add_preset(*run, arguments.run);
  add_run(*run, arguments.run);

  CLI::App* images =
      command(&app, "fit-images", "photographs or a film of your own → profile, temperature, report; no JSON needed",
              "  shakebed fit-images photos/*.tif --diameter \"6 mm\" --out o\n  shakebed fit-images film.mp4 "
              "--diameter \"2.99 mm\" --plateau-density 1.10",
              command_fit_images);
  ImageArguments& image = arguments.images;
  images->add_option("files", image.files, "images, films, or folders of them")->required()->type_name("FILES");
  images->add_option("--diameter", image.diameter, "diameter of a bead, with its unit: \"2.99 mm\"")->required();
  images->add_option("--plateau-density", image.plateau_density,
                     "density phi_0 of the solid in 1/D^2 (default 2/sqrt 3)");
  images->add_option("--model", image.model, "model of the fit (default enskog-rectangle)");
  images->add_option("--scale", image.scale, "length of a pixel: \"0.2 mm/px\" (default: found from the diameter)");
  images->add_option("--floor", image.floor, "row of the floor in pixels from the top (default: found)");
  images->add_option("--left-wall", image.left_wall, "column of the left wall in pixels (default: found)");
  images->add_option("--right-wall", image.right_wall, "column of the right wall in pixels (default: found)");
  images->add_option("--roi", image.roi, "region of interest in pixels: LEFT,TOP,WIDTH,HEIGHT")
      ->delimiter(',')
      ->expected(4);
  images->add_option("--polarity", image.polarity, "automatic, dark or bright beads")
      ->check(CLI::IsMember({"automatic", "dark", "bright"}));
  images->add_option("--radius", image.radius, "radius of a bead in pixels, good to a quarter (default: found)")
      ->check(CLI::PositiveNumber);
  images->add_option("--channel", image.channel, "part of a colour picture that is used (default: found)")
      ->check(CLI::IsMember({"automatic", "red", "green", "blue", "grey", "saturation", "background_distance"}));
  images->add_flag("--preview", image.preview,
                   "draw what would be found in the first frame, with the command for each alternative, and stop");
  images->add_option("--frequency", image.frequency,
                     "of the shaking: \"20 Hz\" (default: found in the film); with --amplitude also Gamma → T");
  images->add_option("--amplitude", image.amplitude, "of the shaking: \"2.5 mm\"");
  images->add_option("--frame-rate", image.frame_rate,
                     "of a film: \"500 Hz\": velocities; and profiles by phase if the bed shakes");
  images->add_option("--second-diameter", image.second_diameter, "of beads of another size, to be found too");
  images->add_option("--pixel-aspect", image.pixel_aspect, "a pixel's width over its height (default: found)");
  images->add_option("--lens", image.lens,
                     "how far the lens moves the corners, in half diagonals, a barrel positive (default: found)");
  images->add_option("--bead-number", image.bead_number, "how many beads there are in view, to be checked");
  images->add_option("--kernel", image.kernel,
                     "density is measured through: gaussian:0.5 (default), top_hat:1, disk_chord:1");
  images->add_option(
      "--initial-height", image.initial_height,
      "height mu of the bed at rest, in D or a length (default: from the beads counted between the walls)");
  images->add_option("--gravity", image.gravity, "default \"9.81 m/s^2\"");
  add_run(*images, arguments.run);

  CLI::App* profile = command(&app, "fit-profile", "a density profile from anywhere → fit",
                              "  shakebed fit-profile profile.csv --plateau-density 1.10 --diameter \"2.99 mm\"\n  "
                              "shakebed fit-profile profile.csv --model hydrostatic:best-of --json",
                              command_fit_profile);
  ProfileArguments& p = arguments.profile;
  profile->add_option("file", p.file, "CSV with height (in D) and number_density (n D^2); std_error if known")
      ->required()
      ->type_name("FILE.csv");
  profile->add_option("--model", p.model, "enskog-rectangle, hydrostatic:<equation of state>, fermi, rectangle");
  profile->add_option("--plateau-density", p.plateau_density, "density phi_0 of the solid in 1/D^2 (default 2/sqrt 3)");
  profile->add_flag("--plateau-density-free", p.plateau_density_free, "fit it too");
  profile->add_option("--diameter", p.diameter, "D, for T/(m g) as a length");
  profile->add_option("--column-number", p.column_number, "N D/W, for T_c");
  profile->add_option(
      "--kernel", p.kernel,
      "what it was measured through: none, gaussian:0.5, top_hat:1, disk_chord:1 (default: as the file says)");
  profile->add_option("--window", p.window, "LOW,HIGH in D (default: found)")->delimiter(',')->expected(2);

  CLI::App* theory = command(&app, "theory", "constants of the theory, T_c, solid height",
                             "  shakebed theory --plateau-density 1.10\n  shakebed theory --plateau-density 1.10 "
                             "--diameter \"2.99 mm\" --initial-height 10.2 --temperature \"0.36 mm\" --json",
                             command_theory);
  TheoryArguments& t = arguments.theory;
  theory->add_option("--plateau-density", t.plateau_density, "phi_0 in 1/D^2 (default 2/sqrt 3)");
  theory->add_option("--eos", t.equation,
                     "equation of state: enskog, henderson, santos-lopez-yuste, percus-yevick, kolafa-rottner, luding, "
                     "best-of, or all");
  theory->add_option("--diameter", t.diameter, "D, for lengths");
  theory->add_option("--initial-height", t.initial_height,
                     "height mu of the bed at rest: in D, or a length with its unit");
  theory->add_option("--column-number", t.column_number, "N D/W instead of the initial height");
  theory->add_option("--temperature", t.temperature, "T/(m g) as a length with its unit, or T in m g D");

  CLI::App* map = command(&app, "map", "Gamma → temperature, by every named reading",
                          "  shakebed map --gamma 4 --frequency \"20 Hz\" --diameter \"2.99 mm\" --initial-height 10.2 "
                          "--plateau-density 1.10",
                          command_map);
  MapArguments& m = arguments.map;
  map->add_option("--gamma", m.gamma, "peak acceleration in g");
  map->add_option("--amplitude", m.amplitude, "of the floor, instead of --gamma");
  map->add_option("--frequency", m.frequency, "of the floor")->required();
  map->add_option("--diameter", m.diameter, "D")->required();
  map->add_option("--initial-height", m.initial_height, "height mu of the bed at rest: in D, or a length with its unit")
      ->required();
  map->add_option("--plateau-density", m.plateau_density, "phi_0 in 1/D^2 (default 2/sqrt 3)");
  map->add_option("--gravity", m.gravity, "default \"9.81 m/s^2\"");
  map->add_option("--restitution", m.restitution, "of the single ball (default 0: one flight of a dead ball)");
  map->add_option("--eos", m.equation, "equation of state (default enskog)");
  map->add_option("--temperature", m.temperature,
                  "a measured T, mapped back to Gamma: T/(m g) as a length, or T in m g D");

  command(&app, "audit", "the paper's printed numbers against recomputed ones",
          "  shakebed audit\n  shakebed audit --json", command_audit);

  CLI::App* init = command(&app, "init", "write a commented recipe to start from",
                           "  shakebed init\n  shakebed init my-bed.json", command_init);
  init->add_option("file", arguments.recipe, "default bed.json")->type_name("FILE.json");
  CLI::App* schema = command(&app, "schema", "JSON Schema of a recipe, for editors and validators",
                             "  shakebed schema > pipeline.schema.json", command_schema);
  schema->add_option("file", arguments.recipe, "write it there instead of to stdout")->type_name("FILE.json");
  CLI::App* validate = command(&app, "validate", "check a recipe, all mistakes at once", "  shakebed validate bed.json",
                               command_validate);
  validate->add_option("recipe", arguments.recipe, "the recipe")->required()->type_name("FILE.json");
  add_preset(*validate, arguments.run);
  validate->add_option("--set", arguments.run.settings, "change the recipe first")->type_name("POINTER=VALUE");
  CLI::App* explain = command(&app, "explain", "what a run would do, a sentence a stage",
                              "  shakebed explain bed.json --out o", command_explain);
  explain->add_option("recipe", arguments.recipe, "the recipe")->required()->type_name("FILE.json");
  add_preset(*explain, arguments.run);
  add_run(*explain, arguments.run);
  CLI::App* graph = command(
      &app, "graph", "the stages and their arrows",
      "  shakebed graph bed.json | dot -Tsvg > bed.svg\n  shakebed graph bed.json --format mermaid", command_graph);
  graph->add_option("recipe", arguments.recipe, "the recipe")->required()->type_name("FILE.json");
  graph->add_option("--format", arguments.format, "dot or mermaid")->check(CLI::IsMember({"dot", "mermaid"}));
  CLI::App* status =
      command(&app, "status", "what a results folder holds", "  shakebed status results/bed", command_status);
  status->add_option("folder", arguments.recipe, "the results folder")->required()->type_name("DIR");
  CLI::App* verify = command(&app, "verify", "recompute the fingerprints of a results folder",
                             "  shakebed verify results/bed", command_verify);
  verify->add_option("folder", arguments.recipe, "the results folder")->required()->type_name("DIR");
  CLI::App* rerun = command(&app, "rerun", "run what made a results folder once more and compare",
                            "  shakebed rerun results/bed --out again", command_rerun);
  rerun->add_option("folder", arguments.recipe, "the results folder")->required()->type_name("DIR");
  rerun->add_option("--jobs,-j", arguments.run.jobs, "threads")->check(CLI::PositiveNumber);
  CLI::App* clean =
      command(&app, "clean", "remove results",
              "  shakebed clean results --older-than 30d --dry-run\n  shakebed clean results/bed", command_clean);
  clean->add_option("folder", arguments.recipe, "a results folder, or a folder of them (default results)")
      ->type_name("DIR");
  clean->add_option("--older-than", arguments.older_than, "only what is older: 30d, 12h")->type_name("AGE");
  clean->add_flag("--dry-run", arguments.run.dry_run, "say what would go");

  // Its options are those of the program that it starts.
  CLI::App* bench = app.add_subcommand("bench", "speed against error, stage by stage, on this machine");
  bench->prefix_command()->set_help_flag();
  bench->callback([&] { chosen = [&] { return command_bench(arguments); }; });

  CLI::App* submit = app.add_subcommand("submit", "hand a sweep to a cluster");
  submit->require_subcommand(1);
  CLI::App* slurm = command(submit, "slurm", "a Slurm job array over the points of a sweep, and a job that gathers",
                            "  shakebed submit slurm sweep.json --shards 100 --out o\n  shakebed submit slurm "
                            "sweep.json --shards 100 --sbatch=--partition=short --dry-run",
                            command_submit_slurm);
  slurm->add_option("recipe", arguments.recipe, "a recipe with a sweep")->required()->type_name("FILE.json");
  slurm->add_option("--shards", arguments.slurm.shards, "tasks of the array")->check(CLI::PositiveNumber);
  slurm->add_option("--sbatch", arguments.slurm.options, "more options for sbatch, one each: --sbatch=--time=1:00:00")
      ->type_name("OPTION");
  add_preset(*slurm, arguments.run);
  slurm->add_option("--set", arguments.run.settings, "change the recipe")->type_name("POINTER=VALUE");
  slurm->add_flag("--dry-run", arguments.run.dry_run, "write the scripts, submit nothing");

  // For the install rules: manual pages and completions.
  if (argc == 3 && std::string_view(argv[1]) == "--write-command-pages") {
    write_command_pages(app, argv[2]);
    return exit_ok;
  }

  // A mistyped command: say which one was meant.
  if (argc > 1 && argv[1][0] != '-') {
    std::vector<std::string> names;
    for (const CLI::App* sub : app.get_subcommands({})) names.push_back(sub->get_name());
    if (std::find(names.begin(), names.end(), argv[1]) == names.end()) {
      const std::string nearest = nearest_name(argv[1], names);
      throw UsageError(
          fmt::format("there is no command \"{}\"; {}", argv[1],
                      nearest.empty() ? "see shakebed --help" : fmt::format("did you mean \"{}\"?", nearest)));
    }
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    // --help and --version come as "errors" with code 0.
    if (error.get_exit_code() == 0) return app.exit(error) == 0 ? exit_ok : exit_usage;
    std::string message = error.what();
    throw UsageError(message + "; see --help");
  }
  return chosen();
}

}  // namespace

int main(int argc, char** argv) {
  return exit_code_of([&] { return run_program(argc, argv); });
}
