// What is written for people when a run or a sweep has ended. The command line gives it to the runner, which knows no
// page itself.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pipelines/runner/run.hpp"
#include "pipelines/runner/sweep_points.hpp"

namespace shakebed::pipelines {

// A sweep with what was gathered.
struct SweepOutcome {
  std::filesystem::path out;
  const std::vector<SweepPoint>& points;
  const std::vector<std::string>& collected;           // pointers to the numbers
  const std::vector<std::vector<std::string>>& table;  // the first row is the header
  const std::vector<std::string>& problems;            // of points that failed
  const std::map<std::string, std::size_t>& verdicts;  // points by the verdict of their answer
  std::vector<std::string> warnings;                   // of the points, each kind once
  bool complete = false;                               // every point is there
};

class Pages {
 public:
  virtual ~Pages() = default;
  // Throw Error when a file cannot be written. Of a sweep, StageError also when a figure cannot be drawn.
  virtual void write(const Plan& plan, const RunOutcome& outcome) const = 0;
  virtual void write(const Plan& plan, const SweepOutcome& outcome) const = 0;
};

}  // namespace shakebed::pipelines
