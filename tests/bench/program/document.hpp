// The results of a benchmark as text, JSON and one self-contained HTML page, and set against an earlier run.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/program/results.hpp"

namespace shakebed::pipelines::bench {

struct Document {
  bool quick = false;
  std::string when;  // UTC
  Json machine;      // processor, cores, memory, system, compiler
  std::vector<StageResult> stages;
  Json digits;   // digits kept by the kernels, as the shadow runs found them; null: none in this build
  Json against;  // the earlier run; null: none
  std::string against_name;
};

// Processor, cores, memory, kernel, compiler, version.
Json machine_json();

Json document_json(const Document& document);
std::string document_text(const Document& document);
// Draws the figures into `directory` (NAME.svg, NAME.dat, NAME.gp) and makes the page of them. Throws StageError when
// gnuplot is missing or fails.
std::string document_html(const Document& document, const std::filesystem::path& directory);

// A sentence for each hard case that failed. The program then ends with exit code 6.
std::vector<std::string> failed_cases(const Document& document);

// The points of a figure that no other point beats in both cost and error, by rising cost; limits are no points.
struct FrontPoint {
  double cost = 0, error = 0;
};
std::vector<FrontPoint> pareto_front(const Figure& figure);

// The metrics of both runs by name, each with its ratio now/then. Throws InputError when `earlier` is no such run.
Table comparison(const std::vector<StageResult>& stages, const Json& earlier, const std::string& name);

}  // namespace shakebed::pipelines::bench
