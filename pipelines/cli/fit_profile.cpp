// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/measured_profile.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {
namespace {

struct ProfileArguments {
  std::string file;
  std::optional<std::string> model, diameter, kernel;
  std::optional<double> plateau_density, column_number;
  bool plateau_density_free = false;
  std::vector<double> window;
};

Kernel kernel_argument(const std::string& text) {
  const auto kernel = kernel_from(text);
  if (!kernel)
    throw UsageError(fmt::format(
        "--kernel: there is no kernel \"{}\"; write none, gaussian:0.5, top_hat:1 or disk_chord:1 (widths in D)",
        text));
  return *kernel;
}

fit::FitOptions options_of(const ProfileArguments& given, const MeasuredProfile& measured) {
  fit::FitOptions options;
  if (given.model) options.model = *given.model;
  options.plateau_density = plateau_argument(given.plateau_density);
  options.plateau_density_free = given.plateau_density_free;
  options.column_number = given.column_number ? given.column_number : measured.column_number;
  if (!given.window.empty()) options.window.low = given.window[0], options.window.high = given.window[1];
  options.kernel = measured.kernel;
  return options;
}

// Whether the profile has one temperature, whatever model and window were asked for.
fit::Answer answer_of(const MeasuredProfile& measured, const fit::FitOptions& options, std::optional<double> diameter) {
  fit::AnswerInput input;
  input.diameter = diameter;
  input.profile = measured.profile, input.kernel = measured.kernel, input.column_number = options.column_number;
  return fit::find_answer(input);
}

int fit_profile(const Call& call, const ProfileArguments& given) {
  std::optional<Kernel> kernel;
  if (given.kernel) kernel = kernel_argument(*given.kernel);
  const MeasuredProfile measured = read_measured_profile(given.file, std::nullopt, kernel);
  const fit::FitOptions options = options_of(given, measured);
  std::optional<double> diameter;
  if (given.diameter) diameter = diameter_argument(*given.diameter);
  const fit::FitResult result = fit::fit_profile(measured.profile, options);
  if (result.status == fit::FitStatus::bad_input) throw InputError(fmt::format("{}: {}", given.file, result.message));
  Json json = fit_json(result, diameter);
  json["answer"] = answer_json(answer_of(measured, options, diameter), diameter);
  for (const std::string& warning : measured.warnings) json["warnings"].push_back(warning);
  if (call.out) {
    std::filesystem::create_directories(*call.out);
    write_file_atomically(std::filesystem::path(*call.out) / "fit.json", dump(json));
  }
  print(call.json ? dump(json)
                  : fmt::format("{} {}\n\nfit of the model {} alone:\n{}", answer_text(json["answer"]),
                                json["answer"].value("advice", ""), result.model, fit_text(json)));
  return result.ok() ? exit_ok : exit_stage_failed;
}

}  // namespace

void add_fit_profile(Program& program) {
  const auto given = std::make_shared<ProfileArguments>();
  CLI::App& command = program.add(
      {"fit-profile", "fit a density profile from a CSV file: temperature, critical temperature, solid height",
       "  shakebed fit-profile profile.csv --plateau-density 1.10 --diameter \"2.99 mm\"\n"
       "  shakebed fit-profile profile.csv --model hydrostatic:best-of --json"},
      [given](const Call& call) { return fit_profile(call, *given); });
  command
      .add_option("file", given->file,
                  "CSV file with the columns height [D], number_density [1/D^2] and, if known, std_error [1/D^2]")
      ->required()
      ->type_name("FILE.csv");
  command.add_option("--model", given->model,
                     "model of the fit: enskog-rectangle (default), hydrostatic:<equation of state>, fermi, rectangle");
  command.add_option("--plateau-density", given->plateau_density, plateau_help);
  command.add_flag("--plateau-density-free", given->plateau_density_free, "fit the density phi_0 of the solid as well");
  command.add_option("--diameter", given->diameter, "diameter D with its unit, for T/(m g) as a length");
  command.add_option("--column-number", given->column_number,
                     "column number N D/W, for T_c (default: as stated in the file)");
  command.add_option("--kernel", given->kernel,
                     "kernel that smoothed the profile, with its width in D: none, gaussian:0.5, top_hat:1 or "
                     "disk_chord:1 (default: as stated in the file)");
  command.add_option("--window", given->window, "heights of the fit: LOW,HIGH in D (default: found)")
      ->delimiter(',')
      ->expected(2);
}

}  // namespace shakebed::pipelines
