// What the program wrote: tables by the names of their columns, quantities as numbers.
#pragma once

#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {

inline double value(const pipelines::Json& quantity) { return quantity.at("value").get<double>(); }
inline double error(const pipelines::Json& quantity) { return quantity.at("std_error").get<double>(); }

class NumberTable {
 public:
  explicit NumberTable(const std::filesystem::path& path) : name_(path.filename().string()) {
    pipelines::each_csv_line(read_text(path), [&](std::vector<std::string> cells, std::size_t) {
      if (header_.empty())
        header_ = std::move(cells);
      else
        rows_.push_back(std::move(cells));
    });
  }
  std::size_t rows() const { return rows_.size(); }
  const std::vector<std::string>& header() const { return header_; }
  const std::string& text(const std::string& column, std::size_t row) const {
    for (std::size_t i = 0; i < header_.size(); ++i)
      if (header_[i] == column) return rows_.at(row).at(i);
    throw std::runtime_error(name_ + " has no column " + column);
  }
  // NaN: an empty cell or words.
  double operator()(const std::string& column, std::size_t row) const {
    return pipelines::number_in(text(column, row)).value_or(NAN);
  }
  std::vector<double> column(const std::string& name) const {
    std::vector<double> all;
    for (std::size_t r = 0; r < rows(); ++r) all.push_back((*this)(name, r));
    return all;
  }

 private:
  std::string name_;
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace shakebed::tests
