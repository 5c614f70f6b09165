#include "pipelines/runner/gathered_warnings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <set>

namespace shakebed::pipelines {
namespace {

// The text with every number in it, its sign and exponent too, made one.
std::string pattern_of(const std::string& text) {
  std::string pattern;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto digit = [&](std::size_t k) {
      return k < text.size() && std::isdigit(static_cast<unsigned char>(text[k])) != 0;
    };
    const bool in_number = !pattern.empty() && pattern.back() == '#' &&
                           (text[i] == '.' || text[i] == 'e' || text[i] == '-' || text[i] == '+');
    if (digit(i)) {
      if (pattern.empty() || pattern.back() != '#') pattern += '#';
    } else if (!in_number || !(digit(i + 1) || (text[i] == 'e' && digit(i + 2)))) {
      pattern += text[i];
    }
  }
  return pattern;
}

}  // namespace

void GatheredWarnings::add(const std::string& point, const Json& warnings) {
  std::set<std::string> seen;
  for (const Json& warning : warnings) {
    if (!warning.is_string()) continue;
    const auto text = warning.get<std::string>();
    const std::string pattern = pattern_of(text);
    if (!seen.insert(pattern).second) continue;
    const auto known =
        std::find_if(kinds_.begin(), kinds_.end(), [&](const Kind& kind) { return kind.pattern == pattern; });
    if (known == kinds_.end())
      kinds_.push_back({pattern, text, {point}});
    else
      known->points.push_back(point);
  }
}

std::vector<std::string> GatheredWarnings::lines() const {
  constexpr std::size_t most_named = 3;
  std::vector<std::string> lines;
  for (const auto& [pattern, first, points] : kinds_) {
    const std::size_t named = std::min(most_named, points.size());
    const std::string names =
        fmt::format("{}", fmt::join(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(named), ", "));
    lines.push_back(points.size() == 1
                        ? fmt::format("{} (point {})", first, names)
                        : fmt::format("{} ({} points: {}{}; the numbers in this message are those of the first point)",
                                      first, points.size(), names, points.size() > named ? ", ..." : ""));
  }
  return lines;
}

}  // namespace shakebed::pipelines
