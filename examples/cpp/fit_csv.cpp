// T from a density profile in a CSV with the columns height (in D), number_density (n D^2) and, if known, std_error.
#include <cstdio>
#include <fstream>
#include <shakebed/fit/answer.hpp>
#include <shakebed/fit/fit_profile.hpp>
#include <sstream>
#include <string>

int main(int argc, char** argv) {
  namespace fit = shakebed::fit;
  if (argc != 2) return std::fprintf(stderr, "usage: fit_csv PROFILE.csv\n"), 2;

  fit::Profile profile;
  std::ifstream file(argv[1]);
  for (std::string line; std::getline(file, line);) {
    std::istringstream cells(line);
    double height, density, error;
    char comma;
    if (!(cells >> height >> comma >> density)) continue;  // the header
    profile.height.push_back(height);
    profile.number_density.push_back(density);
    if (cells >> comma >> error) profile.std_error.push_back(error);
  }

  const fit::FitOptions options{.kernel = {shakebed::KernelKind::gaussian, 0.5}};
  const fit::FitResult result = fit::fit_profile(profile, options);
  std::printf("%s\n", result.full().c_str());

  const fit::Answer answer = fit::find_answer({.profile = profile, .kernel = options.kernel});
  std::printf("over all thermometers: T = %.3f +- %.3f m g D; %s\n", answer.temperature, answer.std_error,
              std::string(to_string(answer.verdict)).c_str());
  return result.ok() ? 0 : 1;
}
