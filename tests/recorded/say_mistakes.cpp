// What is said of a recipe after each of many changes, which `shakebed validate --set CHANGE` says of one.
// usage: say_mistakes RECIPE < CHANGES      one change a line: POINTER=VALUE
#include <cstdlib>
#include <iostream>
#include <string>

#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/presets.hpp"
#include "pipelines/runner/read_recipe.hpp"

namespace {

using namespace shakebed::pipelines;

void say_of(const std::string& recipe, const std::string& change) {
  std::cout << "# " << change << '\n';
  try {
    const Plan plan = read_recipe(recipe, {.preset = {}, .settings = {parse_setting(change)}});
    for (const Warning& warning : plan.warnings) std::cout << "> warning: " << to_string(warning.problem) << '\n';
  } catch (const ConfigError& error) {
    for (const Problem& problem : error.problems()) std::cout << "> error: " << to_string(problem) << '\n';
  } catch (const Error& error) {
    std::cout << "> error: " << error.what() << '\n';
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: say_mistakes RECIPE < CHANGES\n";
    return EXIT_FAILURE;
  }
  for (std::string change; std::getline(std::cin, change);) say_of(arguments[1], change);
}
