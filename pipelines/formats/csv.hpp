// CSV as text: lines, cells, numbers.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace shakebed::pipelines {

// Without blanks round it.
std::string trimmed(std::string_view text);

// One line, as text without blanks round it. Quotes are understood.
std::vector<std::string> split_csv_line(std::string_view line, char separator = ',');

// Calls visit(cells, number of the line) for every line but empty ones and # comments: the header is the first.
void each_csv_line(std::string_view text,
                   const std::function<void(std::vector<std::string> cells, std::size_t line)>& visit);

// A cell that is a finite number and nothing else.
std::optional<double> number_in(std::string_view cell);

// Where the column of this name is. Throws InputError naming the file and the nearest name.
std::size_t csv_column(const std::vector<std::string>& header, const std::string& name, const std::string& file);

}  // namespace shakebed::pipelines
