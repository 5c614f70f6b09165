// What a benchmark finds, the same for every stage: tables, figures of error against cost, hard cases, and the numbers
// that a later run is compared with. How it becomes text, JSON and HTML is in document.hpp.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/runner/console.hpp"

namespace shakebed::pipelines::bench {

struct Table {
  std::string title, note;
  std::vector<std::string> header;
  std::vector<std::vector<Json>> rows;  // texts, numbers, null for "none"
};

// One method: error against cost, point by point.
struct Curve {
  std::string label;
  std::vector<double> cost, error;
  std::optional<std::size_t> standard{};  // the point that is the program's default
  bool limit = false;                     // a theoretical limit rather than a method
  bool line = true;                       // false: points that lie on no one line
};
// A log-log figure. Points that are not positive are left out.
struct Figure {
  std::string name;  // of its files
  std::string title, cost_label, error_label;
  std::vector<Curve> curves;
  bool pareto = true;  // draw the front: the points no other one beats in both cost and error
};

struct HardCase {
  std::string name;
  std::string status;           // in a word or two: "ok", "refused", ...
  std::optional<double> error;  // none: there is no number to compare
  std::string unit;             // of error and limit
  double limit = 0;             // the error may be so large
  double seconds = 0, time_limit = 10;
  bool pass = false;
  std::string note;
};

// A number worth comparing with another run's.
struct Metric {
  std::string name, unit;
  double value = 0;
  bool more_is_better = false;
};

struct StageResult {
  std::string name, title;
  std::vector<std::string> sentences;  // what follows, in words
  std::vector<Table> tables;
  std::vector<Figure> figures;
  std::vector<HardCase> hard_cases;
  std::vector<Metric> metrics;
  double cpu_seconds = 0;
};

// What a benchmark is given.
struct Effort {
  bool quick = false;
  std::string scratch;  // a folder it may write into
  Console* console = nullptr;
  void check_interrupted() const;  // throws Interrupted after Ctrl-C
  // The same, and says what is being measured.
  void step(const std::string& what) const;
};

// CPU time of this process, all threads [s].
double cpu_seconds();
// CPU seconds that `work` takes.
template <class Work>
double cpu_seconds_of(Work&& work) {
  const double start = cpu_seconds();
  work();
  return cpu_seconds() - start;
}
// The least CPU seconds of one call: `work` is repeated until `least_total` seconds are spent.
double least_cpu_seconds(const std::function<void()>& work, double least_total = 0.05);
// Bytes by which this process's memory grew at its highest while `work` ran; nothing where the kernel does not tell.
std::optional<double> peak_memory_of(const std::function<void()>& work);

// The exponent p of y ~ x^p by least squares in the logarithms; nothing with fewer than two positive points.
std::optional<double> exponent(const std::vector<double>& x, const std::vector<double>& y);

// Runs a hard case: `work` fills status, error and note, and throws for what went wrong, which is a failure of the case
// (with the message as its note). The verdict: error within its limit, time within its limit, `pass` not withdrawn.
HardCase run_hard_case(const std::string& name, const std::string& unit, double limit, double time_limit,
                       const std::function<void(HardCase&)>& work);

// The stages, in their files of the same name.
StageResult bench_simulate(const Effort& effort);
StageResult bench_extract(const Effort& effort);
StageResult bench_fit(const Effort& effort);
StageResult bench_map(const Effort& effort);
StageResult bench_pipeline(const Effort& effort);

}  // namespace shakebed::pipelines::bench
