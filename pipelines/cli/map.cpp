// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <cstdio>
#include <numbers>

#include "fit/theory/equation_of_state.hpp"
#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {
namespace {

struct MapArguments {
  std::optional<double> gamma, plateau_density;
  double restitution = 0;
  std::string frequency, diameter, initial_height, equation = "enskog";
  std::optional<std::string> amplitude, gravity, temperature;
};

MapQuestion question_of(const MapArguments& given) {
  MapQuestion question;
  question.equation = given.equation;
  question.plateau_density = plateau_argument(given.plateau_density);
  question.frequency = quantity_argument("--frequency", given.frequency, dimension::frequency);
  question.diameter = diameter_argument(given.diameter);
  question.gravity = quantity_argument("--gravity", given.gravity.value_or("9.81 m/s^2"), dimension::acceleration);
  require_positive("--frequency", question.frequency), require_positive("--gravity", question.gravity);
  question.initial_height = diameters_argument("--initial-height", given.initial_height, question.diameter);
  require_positive("--initial-height", question.initial_height);
  if (given.restitution < 0 || given.restitution > 0.99)
    throw UsageError(fmt::format("--restitution: must be from 0 to 0.99, got {}", number_text(given.restitution)));
  question.restitution = given.restitution;
  if (given.gamma.has_value() == given.amplitude.has_value())
    throw UsageError(given.gamma ? "--gamma and --amplitude are equivalent: give one of them"
                                 : "neither --gamma nor --amplitude is given: give one of them");
  if (given.gamma) {
    question.gamma = *given.gamma;
  } else {
    const double omega = 2 * std::numbers::pi * question.frequency;
    question.gamma =
        quantity_argument("--amplitude", *given.amplitude, dimension::length) * omega * omega / question.gravity;
  }
  require_positive("--gamma", question.gamma);
  if (const auto odd = odd_gamma(question.gamma))
    std::fputs(fmt::format("warning: Gamma = {:.3g}. {}. Check the amplitude, the frequency and their units\n",
                           question.gamma, *odd)
                   .c_str(),
               stderr);
  if (given.temperature)
    question.measured_temperature = diameters_argument("--temperature", *given.temperature, question.diameter);
  return question;
}

}  // namespace

void add_map(Program& program) {
  const auto given = std::make_shared<MapArguments>();
  CLI::App& command =
      program.add({"map", "predict the temperature from Gamma, by every formula that Quinn and Hong (2000) allow",
                   "  shakebed map --gamma 4 --frequency \"20 Hz\" --diameter \"2.99 mm\" --initial-height 10.2 "
                   "--plateau-density 1.10",
                   false},
                  [given](const Call& call) {
                    const Json json = map_json(question_of(*given));
                    print(call.json ? dump(json) : map_text(json));
                    return exit_ok;
                  });
  command.add_option("--gamma", given->gamma, "peak acceleration of the floor over g");
  command.add_option("--amplitude", given->amplitude, "amplitude of the floor with its unit, in place of --gamma");
  command.add_option("--frequency", given->frequency, "frequency of the floor: \"20 Hz\"")->required();
  command.add_option("--diameter", given->diameter, "diameter D of a disk, with its unit: \"2.99 mm\"")->required();
  command.add_option("--initial-height", given->initial_height, initial_height_help)->required();
  command.add_option("--plateau-density", given->plateau_density, plateau_help);
  command.add_option("--gravity", given->gravity, "acceleration of gravity (default: \"9.81 m/s^2\")");
  command.add_option("--restitution", given->restitution,
                     "coefficient of restitution of the single ball (default 0: one flight without rebound)");
  command.add_option("--eos", given->equation, "equation of state: " + fit::equation_names() + " (default: enskog)");
  command.add_option("--temperature", given->temperature,
                     "measured T, for which Gamma is computed: T/(m g) as a length, or T in m g D");
}

}  // namespace shakebed::pipelines
