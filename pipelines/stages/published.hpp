// Numbers that papers print, from reference-data/<paper>/numbers.json, which are part of the program.
#pragma once

#include <optional>
#include <string>

namespace shakebed::pipelines {

// A value with a tolerance, or bounds.
struct PublishedClaim {
  std::optional<double> value, least, most;
  double tolerance = 0;
  std::string place;         // paper, and where in it the number stands or who quotes it
  bool from_memory = false;  // not read anywhere: shown, but without a verdict
};
struct PublishedLookup {
  std::optional<PublishedClaim> number;
  std::string problem, suggestion;  // where there is none
};
// "warr-1995/temperature_exponent_of_velocity". Throws InputError where the paper's file is not what it should be.
PublishedLookup find_published(const std::string& name);

}  // namespace shakebed::pipelines
