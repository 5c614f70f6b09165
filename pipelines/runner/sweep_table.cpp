#include "pipelines/runner/sweep_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {
namespace {

// Units that the names of columns leave out: D, m, g reduced, and 1.
bool goes_without_saying(const std::string& unit) {
  return unit.empty() || unit == "1" || unit.find('D') != std::string::npos || unit.find(" g") != std::string::npos ||
         unit.find("g/") != std::string::npos;
}

std::optional<Quantity> quantity_of(const std::string& text) {
  try {
    return parse_quantity(text);
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

// Of the axis values: the SI unit of the first that has one; words where one is no quantity.
struct AxisKind {
  bool words = false;
  std::string unit = "1";
};
AxisKind kind_of(const std::vector<std::vector<std::string>>& rows, std::size_t column) {
  AxisKind kind;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    const std::string& text = rows[r][column];
    if (text.empty()) continue;
    const auto quantity = quantity_of(text);
    if (!quantity) return {true, ""};
    if (quantity->has_unit) kind.unit = si_unit(quantity->dimension);
  }
  return kind;
}

}  // namespace

std::string unit_of_result(const Plan& plan, const std::string& pointer) {
  const std::vector<std::string> tokens = split_pointer(pointer);
  const PlannedStage* stage = tokens.empty() ? nullptr : plan.find(tokens.front());
  if (stage == nullptr || !stage->results) return "1";
  const StatedResult* stated =
      stage->results->find(std::string_view(pointer).substr(1 + escape_pointer_token(tokens.front()).size()));
  return stated == nullptr || stated->unit.empty() ? "1" : stated->unit;
}

std::string column_name(const std::string& pointer, const std::string& unit) {
  std::string name;
  const auto add = [&](const std::string& part) {
    for (const char c : part) {
      const bool good = std::isalnum(static_cast<unsigned char>(c)) != 0;
      if (good || (!name.empty() && name.back() != '_')) name += good ? c : '_';
    }
  };
  for (const std::string& token : split_pointer(pointer)) {
    if (token == "stages" && name.empty()) continue;
    if (!name.empty()) add("_");
    add(token);
  }
  if (!goes_without_saying(unit)) add("_" + unit);
  while (!name.empty() && name.back() == '_') name.pop_back();
  return name;
}

std::string verdicts_text(const std::map<std::string, std::size_t>& verdicts) {
  std::string text;
  for (const auto& [verdict, count] : verdicts)
    text += fmt::format("{}{} {}", text.empty() ? "Verdicts: " : ", ", count, verdict);
  return text;
}

Table sweep_table(const Plan& plan, const std::vector<std::string>& collected,
                  const std::vector<std::vector<std::string>>& rows) {
  std::vector<StatedColumn> columns{{"point", "", "folder of the point below points/"},
                                    {"replica", "1", "number of the replica, from 0"},
                                    {"status", "", "ok, check failed, failed or missing"}};
  std::vector<AxisKind> axes;
  for (const SweepAxis& axis : plan.sweep->axes) {
    axes.push_back(kind_of(rows, columns.size()));
    columns.push_back({column_name(axis.pointer, axes.back().unit), axes.back().unit, axis.pointer});
  }
  for (const std::string& collected_pointer : collected) {
    const std::string unit = unit_of_result(plan, collected_pointer);
    // A result may have the name of an option that is an axis.
    const bool named = std::any_of(columns.begin(), columns.end(), [&](const StatedColumn& column) {
      return column.name == column_name(collected_pointer, unit);
    });
    const std::string pointer = collected_pointer + (named ? "/result" : "");
    columns.push_back({column_name(pointer, unit), unit, collected_pointer});
    columns.push_back({column_name(pointer + "/std_error", unit), unit, "standard error of " + collected_pointer});
  }
  if (columns.size() < rows.front().size())
    columns.push_back({std::string(verdict_column), "",
                       "verdict of the answer: one temperature, model does not fit, no single temperature, or "
                       "temperature not determined"});
  Table table("the points of the sweep", columns);
  for (std::size_t r = 1; r < rows.size(); ++r) {
    std::vector<Cell> cells{rows[r][0], count_cell(std::atoll(rows[r][1].c_str())), rows[r][2]};
    for (std::size_t c = 3; c < rows[r].size(); ++c) {
      const bool axis = c - 3 < axes.size();
      const auto quantity = axis && !axes[c - 3].words ? quantity_of(rows[r][c]) : std::nullopt;
      if (quantity)
        cells.emplace_back(quantity->value);
      else
        cells.emplace_back(rows[r][c]);
    }
    table.add(std::move(cells));
  }
  return table;
}

}  // namespace shakebed::pipelines
