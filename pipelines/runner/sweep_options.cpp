// "sweep" of a recipe: from its JSON to axes of values, each with the place where it is written.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "pipelines/runner/recipe_options.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::int64_t most_values = 10'000'000;  // of one range

class SweepReader {
 public:
  SweepReader(Fields& fields, SweepOptions& sweep) : fields_(fields), sweep_(sweep) {}

  void read() {
    if (const JsonNode* over = fields_.written("over")) read_over(*over);
    if (sweep_.kind == SweepKind::list)
      read_points();
    else
      check_axes();
    if (sweep_.kind == SweepKind::random)
      fields_.require(sweep_.count > 0, "count", "a random sweep needs \"count\", the number of points");
  }

 private:
  void bad(const std::string& pointer, const std::string& what, const std::string& suggestion = {}) {
    fields_.problem(pointer, what, suggestion);
  }

  // Only options of a stage can be swept.
  void check_pointer(const std::string& pointer, const std::string& where) {
    std::vector<std::string> tokens;
    try {
      tokens = split_pointer(pointer);
    } catch (const UsageError&) {}
    if (tokens.size() < 3 || tokens[0] != "stages")
      bad(where, fmt::format("\"{}\" is not a pointer to an option of a stage", pointer),
          "Write /stages/<id or number>/<key>, for example \"/stages/bed/floor/gamma\"");
  }

  SweepPlace place_of(const JsonNode& node, const std::string& pointer_below) const {
    return {node.at, node.from_command_line, fields_.pointer() + pointer_below};
  }

  void read_over(const JsonNode& over) {
    if (!over.is_object()) return bad("/over", "expected an object: JSON pointer → values");
    for (const JsonMember& member : over.members) {
      if (member.key != "$comment") read_axis(member);
    }
  }

  void read_axis(const JsonMember& member) {
    const std::string where = pointer_join("/over", member.key);
    SweepAxis axis{.pointer = member.key};
    check_pointer(member.key, where);
    if (member.value.is_array()) {
      for (std::size_t i = 0; i < member.value.items.size(); ++i) {
        axis.values.push_back(member.value.items[i].to_json());
        axis.places.push_back(place_of(member.value.items[i], pointer_join(where, i)));
      }
      if (axis.values.empty()) bad(where, "the list of values is empty");
    } else if (member.value.is_object()) {
      if (!read_range(member.value, where, axis)) return;
    } else {
      bad(where, "expected an array of values or a range {\"from\", \"to\", \"count\"}");
    }
    sweep_.axes.push_back(std::move(axis));
  }

  bool read_bound(const JsonNode& range, const char* key, const std::string& where, Quantity& out) {
    const JsonNode* node = range.find(key);
    const std::string at = pointer_join(where, key);
    if (node == nullptr) return bad(where, "a range needs \"from\" and \"to\""), false;
    if (node->is_number()) return out = {node->number, dimension::none, false}, true;
    if (!node->is_string()) return bad(at, "expected a number or a quantity"), false;
    try {
      out = parse_quantity(node->text);
      return true;
    } catch (const std::invalid_argument& problem) {
      return bad(at, problem.what()), false;
    }
  }

  bool read_scale(const JsonNode& range, const std::string& where, SweepAxis& axis) {
    const JsonNode* scale = range.find("scale");
    if (scale == nullptr) return true;
    axis.logarithmic = scale->is_string() && scale->text == "logarithmic";
    if (!axis.logarithmic && !(scale->is_string() && scale->text == "linear"))
      return bad(where + "/scale", "expected \"linear\" or \"logarithmic\""), false;
    if (axis.logarithmic && !(axis.low > 0 && axis.high > 0))
      return bad(where, fmt::format("both ends of a logarithmic range must be above 0, got {} and {}",
                                    number_text(axis.low), number_text(axis.high))),
             false;
    return true;
  }

  bool read_range(const JsonNode& range, const std::string& where, SweepAxis& axis) {
    static const std::vector<std::string> known{"from", "to", "count", "scale", "$comment"};
    for (const JsonMember& member : range.members) {
      if (std::find(known.begin(), known.end(), member.key) == known.end())
        bad(pointer_join(where, member.key), fmt::format("unknown key \"{}\"", member.key),
            "Choose from: from, to, count, scale");
    }
    Quantity low, high;
    if (!read_bound(range, "from", where, low) || !read_bound(range, "to", where, high)) return false;
    if (low.dimension != high.dimension || low.has_unit != high.has_unit)
      return bad(where, "\"from\" and \"to\" have different units"), false;
    axis.low = low.value, axis.high = high.value, axis.unit = low.has_unit ? si_unit(low.dimension) : "";
    if (!read_scale(range, where, axis)) return false;
    axis.places.assign(1, place_of(range, where));
    return sweep_.kind == SweepKind::random || fill(range, where, axis);
  }

  // The values of a range: the ends as written, the others in between.
  bool fill(const JsonNode& range, const std::string& where, SweepAxis& axis) {
    const JsonNode* count = range.find("count");
    const bool counted = count != nullptr && count->is_number() && count->number == std::floor(count->number) &&
                         count->number >= 1 && count->number <= static_cast<double>(most_values);
    if (!counted) return bad(where + "/count", "a range needs \"count\", a whole number from 1 to 10,000,000"), false;
    const auto n = static_cast<std::int64_t>(count->number);
    axis.places.assign(static_cast<std::size_t>(n), axis.places.front());
    for (std::int64_t i = 0; i < n; ++i) {
      const double u = n == 1 ? 0 : static_cast<double>(i) / static_cast<double>(n - 1);
      const double exact = i == 0             ? axis.low
                           : i == n - 1       ? axis.high
                           : axis.logarithmic ? axis.low * std::pow(axis.high / axis.low, u)
                                              : axis.low + (axis.high - axis.low) * u;
      // To 15 digits: 3.28 in place of 3.2799999999999994.
      const double value = std::strtod(fmt::format("{:.15g}", exact).c_str(), nullptr);
      axis.values.push_back(axis.unit.empty() ? Json(value) : Json(number_text(value) + " " + axis.unit));
    }
    return true;
  }

  // A list: every pointer that a point names is an axis, and the axes are read side by side.
  void read_points() {
    if (!sweep_.axes.empty()) bad("/over", "a list sweep uses \"points\" and does not accept \"over\"");
    const JsonNode* points = fields_.written("points");
    if (points == nullptr || !points->is_array() || points->items.empty())
      return bad("/points", "a list sweep needs \"points\": [{pointer: value, ...}, ...]");
    for (std::size_t i = 0; i < points->items.size(); ++i) {
      const std::string where = pointer_join("/points", i);
      const JsonNode& point = points->items[i];
      if (!point.is_object() || point.members.empty()) {
        bad(where, "expected an object: pointer → value");
        continue;
      }
      for (const JsonMember& member : point.members) {
        if (member.key == "$comment") continue;
        const std::string at = pointer_join(where, member.key);
        check_pointer(member.key, at);
        SweepAxis& axis = axis_of(member.key);
        axis.values.resize(i), axis.places.resize(i);
        axis.values.push_back(member.value.to_json());
        axis.places.push_back(place_of(member.value, at));
      }
    }
    for (SweepAxis& axis : sweep_.axes)
      axis.values.resize(points->items.size()), axis.places.resize(points->items.size());
  }

  SweepAxis& axis_of(const std::string& pointer) {
    const auto found = std::find_if(sweep_.axes.begin(), sweep_.axes.end(),
                                    [&](const SweepAxis& axis) { return axis.pointer == pointer; });
    return found != sweep_.axes.end() ? *found : sweep_.axes.emplace_back(SweepAxis{.pointer = pointer});
  }

  void check_axes() {
    const JsonNode* over = fields_.written("over");
    if (over == nullptr || (over->is_object() && over->members.empty()))
      bad("/over", "a sweep needs at least one pointer in \"over\"");
    if (fields_.has("points")) bad("/points", "only a list sweep accepts \"points\"", "Write \"kind\": \"list\"");
    if (sweep_.kind != SweepKind::zip || sweep_.axes.empty()) return;
    const SweepAxis& first = sweep_.axes.front();
    for (const SweepAxis& axis : sweep_.axes) {
      if (axis.values.size() == first.values.size()) continue;
      bad(pointer_join("/over", axis.pointer),
          fmt::format("this list has {} values, but {} has {}: in a zip sweep all lists must be of the same length",
                      axis.values.size(), first.pointer, first.values.size()));
    }
  }

  Fields& fields_;
  SweepOptions& sweep_;
};

}  // namespace

void describe_sweep(Fields& fields, SweepOptions& sweep) {
  const std::vector<Choice<SweepKind>> kinds{
      {SweepKind::grid, "grid"}, {SweepKind::zip, "zip"}, {SweepKind::list, "list"}, {SweepKind::random, "random"}};
  fields.choice(
      "kind", sweep.kind, kinds,
      {.help =
           "kind of sweep. Grid: every combination of the values. Zip: the first values of all options, then the "
           "second, and so on. List: the points in \"points\". Random: uniformly distributed points in the ranges"});
  Json over = Json::object(), points = Json::array();
  fields.any("over", over,
             {.help = "varied options: JSON pointer into the recipe → list of values, or range {\"from\", \"to\", "
                      "\"count\", \"scale\"} with a linear or logarithmic scale"});
  fields.any("points", points, {.help = "points of a list sweep: objects with JSON pointer → value"});
  fields.integer("count", sweep.count, {.help = "number of points of a random sweep", .range = non_negative});
  fields.integer("seed", sweep.seed, {.help = "seed from which the points of a random sweep are drawn"});
  fields.integer("replicas", sweep.replicas,
                 {.help = "number of runs of each point, each with its own seed", .range = from_to(1, 1e6)});
  fields.texts("collect", sweep.collect, {.help = "pointers of the results that are collected in sweep.csv"});
  if (fields.decoding()) SweepReader(fields, sweep).read();
}

}  // namespace shakebed::pipelines
