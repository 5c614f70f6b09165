// implements: pipelines/cli/commands.hpp
#include "pipelines/stages/theory.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {
namespace {

struct TheoryArguments {
  std::optional<double> plateau_density, column_number;
  std::string equation = "enskog";
  std::optional<std::string> diameter, initial_height, temperature;
};

TheoryQuestion question_of(const TheoryArguments& given) {
  TheoryQuestion question;
  question.equation = given.equation;
  question.plateau_density = plateau_argument(given.plateau_density);
  if (given.diameter) question.diameter = diameter_argument(*given.diameter);
  if (given.initial_height && given.column_number)
    throw UsageError("--initial-height and --column-number are equivalent: give one");
  if (given.initial_height)
    question.initial_height = diameters_argument("--initial-height", *given.initial_height, question.diameter);
  if (given.column_number) question.initial_height = *given.column_number / question.plateau_density;
  if (question.initial_height) require_positive("--initial-height", *question.initial_height);
  if (given.temperature) {
    question.temperature = diameters_argument("--temperature", *given.temperature, question.diameter);
    require_positive("--temperature", *question.temperature);
    if (!question.initial_height)
      throw UsageError(
          "--temperature: T/T_c needs the height of the bed as well; give --initial-height or --column-number");
  }
  return question;
}

}  // namespace

void add_theory(Program& program) {
  const auto given = std::make_shared<TheoryArguments>();
  CLI::App& command = program.add(
      {"theory", "compute the constants of the theory, T_c and the solid height",
       "  shakebed theory --plateau-density 1.10\n  shakebed theory --plateau-density 1.10 --diameter \"2.99 mm\" "
       "--initial-height 10.2 --temperature \"0.36 mm\" --json",
       false},
      [given](const Call& call) {
        const TheoryQuestion question = question_of(*given);
        print(call.json ? dump_17_digits(theory_json(question)) : theory_text(question));
        return exit_ok;
      });
  command.add_option("--plateau-density", given->plateau_density, plateau_help);
  command.add_option("--eos", given->equation, "equation of state: " + fit::equation_names() + ", or all");
  command.add_option("--diameter", given->diameter, "diameter D with its unit, for lengths");
  command.add_option("--initial-height", given->initial_height, initial_height_help);
  command.add_option("--column-number", given->column_number, "column number N D/W, in place of the initial height");
  command.add_option("--temperature", given->temperature, "T/(m g) as a length with its unit, or T in m g D");
}

}  // namespace shakebed::pipelines
