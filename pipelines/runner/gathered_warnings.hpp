// The warnings of many runs: each kind once, with the number of runs that have it.
#pragma once

#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

class GatheredWarnings {
 public:
  // The warnings of one run, an array of texts. Warnings that differ in their numbers alone are of one kind.
  void add(const std::string& point, const Json& warnings);
  // The first of each kind in the order they came, "... (4 points: 000001, 000002, 000004, ...)".
  std::vector<std::string> lines() const;

 private:
  struct Kind {
    std::string pattern, first;
    std::vector<std::string> points{};
  };
  std::vector<Kind> kinds_;
};

}  // namespace shakebed::pipelines
