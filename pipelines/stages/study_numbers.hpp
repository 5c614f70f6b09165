// The numbers that a study takes from one run, and their means.
#pragma once

#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

// A number of one run: missing where the chain does not give it.
struct RunNumber {
  double value = NAN, std_error = NAN;
};
// Of one run: key → cell by cell of its row.
struct RunRows {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
};
inline RunRows read_run_rows(const std::filesystem::path& path) {
  RunRows out;
  each_csv_line(read_file(path), [&](std::vector<std::string> cells, std::size_t) {
    if (out.header.empty())
      out.header = std::move(cells);
    else
      out.rows.push_back(std::move(cells));
  });
  return out;
}
// Mean and its standard error from the spread; of one value, its own error.
struct MeanOfRuns {
  double n = 0, mean = NAN, error = NAN;
  explicit MeanOfRuns(const std::vector<RunNumber>& numbers) {
    double sum = 0, squares = 0;
    for (const RunNumber& number : numbers) {
      if (!std::isfinite(number.value)) continue;
      n += 1, sum += number.value, error = number.std_error;
    }
    if (n == 0) return;
    mean = sum / n;
    if (n == 1) return;
    for (const RunNumber& number : numbers) {
      if (std::isfinite(number.value)) squares += std::pow(number.value - mean, 2);
    }
    error = std::sqrt(squares / (n - 1) / n);
  }
};

}  // namespace shakebed::pipelines
