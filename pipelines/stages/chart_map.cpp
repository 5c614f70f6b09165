#include "pipelines/stages/chart_map.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "pipelines/stages/figure.hpp"
#include "pipelines/stages/study_table.hpp"

namespace shakebed::pipelines {
namespace {

// A row of the table as the map draws it.
struct MapPoint {
  double x, y, value;
  std::vector<bool> marked;  // by each mark
};

void describe_mark(Fields& fields, MapMark& mark) {
  fields.text("label", mark.label, {.help = "label in the key", .required = true});
  fields.map<MapBounds>(
      "where", mark.where,
      [](Fields& f, MapBounds& bounds) {
        f.number("least", bounds.least, {.help = "smallest value that is marked"});
        f.number("most", bounds.most, {.help = "largest value that is marked"});
      },
      {.help = "ranges of columns: column → smallest and largest value; a point is marked where all hold",
       .required = true});
}

// The table and its columns must be what the stage writes.
void check_map(Fields& fields, const MapOptions& map) {
  const std::vector<StatedStage>& from = fields.from();
  const auto stage = std::find_if(from.begin(), from.end(), [&](const StatedStage& one) {
    return one.id == map.from || (map.from.empty() && from.size() == 1);
  });
  if (stage == from.end())
    return fields.problem(
        "/from", map.from.empty()
                     ? "\"from\" of the stage names several stages: give here the id of the stage whose table is drawn"
                     : fmt::format("\"{}\" is not in the \"from\" of this stage", map.from));
  if (stage->results == nullptr) return;
  if (const auto misfit = misfit_of_table(*stage, map.file))
    return fields.problem("/file", misfit->what, misfit->suggestion);
  const StatedTable& table = *stage->results->find_table(map.file);
  const auto check = [&](const std::string& where, const std::string& column) {
    const auto misfit = misfit_of_column(table, column);
    if (misfit) fields.problem(where, misfit->what, misfit->suggestion);
  };
  check("/x", map.x), check("/y", map.y), check("/value", map.value);
  for (const auto& [column, ignored] : map.where) check("/where/" + escape_pointer_token(column), column);
  for (std::size_t k = 0; k < map.marks.size(); ++k) {
    for (const auto& [column, ignored] : map.marks[k].where)
      check(fmt::format("/marks/{}/where/{}", k, escape_pointer_token(column)), column);
  }
}

bool is_marked(const MapMark& mark, const StudyTable& table, std::size_t row) {
  return std::all_of(mark.where.begin(), mark.where.end(), [&](const auto& condition) {
    const std::optional<double> value = table.number(row, table.column(condition.first));
    return value && *value >= condition.second.least.value_or(-INFINITY) &&
           *value <= condition.second.most.value_or(INFINITY);
  });
}

std::vector<MapPoint> points_of(const MapOptions& map, const StudyTable& table) {
  std::vector<MapPoint> points;
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const bool wanted = std::all_of(map.where.begin(), map.where.end(), [&](const auto& condition) {
      return table.rows[row][table.column(condition.first)] == condition.second;
    });
    const auto x = table.number(row, table.column(map.x)), y = table.number(row, table.column(map.y)),
               value = table.number(row, table.column(map.value));
    if (!wanted || !x || !y || !value) continue;
    MapPoint point{*x, *y, *value, {}};
    for (const MapMark& mark : map.marks) point.marked.push_back(is_marked(mark, table, row));
    points.push_back(std::move(point));
  }
  return points;
}

// Where the cells end: half way between neighbours (in the logarithm on an axis of decades), the outer ones as far out
// as they reach in.
std::map<double, std::pair<double, double>> cell_edges(const std::set<double>& places, bool logarithmic) {
  std::vector<double> at;
  for (const double place : places) at.push_back(logarithmic ? std::log(place) : place);
  std::map<double, std::pair<double, double>> edges;
  std::size_t k = 0;
  for (const double place : places) {
    const double lone = logarithmic ? 0.1 : 0.5;  // half the width of an only cell
    const double down = k > 0 ? (at[k] - at[k - 1]) / 2 : at.size() > 1 ? (at[1] - at[0]) / 2 : lone;
    const double up = k + 1 < at.size() ? (at[k + 1] - at[k]) / 2 : down;
    const double low = at[k] - down, high = at[k] + up;
    edges[place] = logarithmic ? std::pair(std::exp(low), std::exp(high)) : std::pair(low, high);
    ++k;
  }
  return edges;
}

// Block 0 of NAME.dat: the cells; then one block for each mark that is set somewhere.
std::string map_data(const MapOptions& map, const std::vector<MapPoint>& points) {
  std::set<double> all_x, all_y;
  for (const MapPoint& point : points) all_x.insert(point.x), all_y.insert(point.y);
  const auto x_edges = cell_edges(all_x, map.logarithmic_x), y_edges = cell_edges(all_y, map.logarithmic_y);
  std::string data = "# x y x_low x_high y_low y_high value\n";
  for (const MapPoint& point : points) {
    const auto [x_low, x_high] = x_edges.at(point.x);
    const auto [y_low, y_high] = y_edges.at(point.y);
    data += fmt::format("{} {} {} {} {} {} {}\n", point.x, point.y, x_low, x_high, y_low, y_high, point.value);
  }
  for (std::size_t k = 0; k < map.marks.size(); ++k) {
    std::string block;
    for (const MapPoint& point : points)
      if (point.marked[k]) block += fmt::format("{} {}\n", point.x, point.y);
    if (!block.empty()) data += "\n\n# " + map.marks[k].label + ": x y\n" + block;
  }
  return data;
}

}  // namespace

void describe_map(Fields& fields, MapOptions& map) {
  Json where = Json::object();
  for (const auto& [name, value] : map.where) where[name] = value;
  fields.text("name", map.name, {.help = "name of the picture and of its files", .required = true});
  fields.text("from", map.from,
              {.help = "id of the stage whose table is drawn; may be left out where \"from\" names one stage"});
  fields.text("file", map.file, {.help = "CSV file in that stage's folder"});
  fields.any("where", where, {.help = "rows that are used: column → required content of its cell"});
  fields.text("x", map.x, {.help = "column along the x axis", .required = true});
  fields.text("y", map.y, {.help = "column along the y axis", .required = true});
  fields.text("value", map.value, {.help = "column that gives the colour of a cell", .required = true});
  fields.text("caption", map.caption, {.help = "caption below the picture in the report"});
  fields.text("x_label", map.x_label, {.help = "label of the x axis, with its unit", .required = true});
  fields.text("y_label", map.y_label, {.help = "label of the y axis, with its unit", .required = true});
  fields.text("value_label", map.value_label, {.help = "label of the colour scale, with its unit", .required = true});
  fields.number("value_low", map.value_low, {.help = "lower end of the colour scale; left out, the smallest value"});
  fields.number("value_high", map.value_high, {.help = "upper end of the colour scale; left out, the largest value"});
  fields.boolean("logarithmic_x", map.logarithmic_x, {.help = "whether the x axis is logarithmic"});
  fields.boolean("logarithmic_y", map.logarithmic_y, {.help = "whether the y axis is logarithmic"});
  fields.boolean("lead", map.lead, {.help = "whether the report begins with this picture"});
  fields.array<MapMark>("marks", map.marks, describe_mark, {.help = "points that get a symbol"});
  if (!fields.decoding()) return;
  map.where.clear();
  if (where.is_object()) {
    for (const auto& [name, value] : where.items())
      map.where.emplace_back(name, value.is_string() ? value.get<std::string>() : dump_canonical(value));
  } else {
    fields.problem("/where", "expected an object: column → text");
  }
  fields.require(!map.name.empty() && map.name.find_first_of("/\\ ") == std::string::npos && map.name[0] != '.', "name",
                 fmt::format("\"{}\" cannot be the name of a file", map.name),
                 "Use no spaces and slashes, and no dot at the beginning");
  if (fields.has("x") && fields.has("y") && fields.has("value")) check_map(fields, map);
}

void state_map(ResultList& list, const MapOptions& map) {
  const std::string at = pointer_join("", map.name);
  list.text(at + "/caption", "text below the map", given_if(!map.caption.empty(), "there is a \"caption\""));
  list.truth(at + "/lead", "whether the report begins with this map", given_if(map.lead, "\"lead\" is true"));
  list.number(at + "/cells", "1", "number of drawn cells");
  for (const MapMark& mark : map.marks)
    list.number(pointer_join(at + "/marked", mark.label), "1", "number of cells with this mark");
}

Json draw_map(const RunContext& context, const MapOptions& map, Drawings& drawings) {
  const StudyTable table = read_study_table(context.input_from(map.from).file(map.file));
  const std::vector<MapPoint> points = points_of(map, table);
  if (points.empty())
    throw InputError(
        fmt::format("{}: the map \"{}\" draws no row of this table; check its \"where\"", table.file, map.name));
  Json out{{"cells", points.size()}};
  if (!map.caption.empty()) out["caption"] = map.caption;
  if (map.lead) out["lead"] = true;
  MapPicture picture{.name = map.name,
                     .data = map_data(map, points),
                     .x_label = map.x_label,
                     .y_label = map.y_label,
                     .value_label = map.value_label,
                     .value_low = map.value_low,
                     .value_high = map.value_high,
                     .decades_x = {},
                     .decades_y = {},
                     .marks = {}};
  const auto by_x = [](const MapPoint& l, const MapPoint& r) { return l.x < r.x; };
  const auto by_y = [](const MapPoint& l, const MapPoint& r) { return l.y < r.y; };
  const auto across = std::minmax_element(points.begin(), points.end(), by_x);
  const auto upwards = std::minmax_element(points.begin(), points.end(), by_y);
  if (map.logarithmic_x) picture.decades_x = {across.first->x, across.second->x};
  if (map.logarithmic_y) picture.decades_y = {upwards.first->y, upwards.second->y};
  for (std::size_t k = 0; k < map.marks.size(); ++k) {
    const auto count =
        std::count_if(points.begin(), points.end(), [&](const MapPoint& point) { return point.marked[k]; });
    out["marked"][map.marks[k].label] = count;
    if (count > 0) picture.marks.emplace_back(map.marks[k].label, k);
  }
  drawings.add(picture);
  return out;
}

}  // namespace shakebed::pipelines
