// Maps of a chart stage: a number in the plane of two parameters of a study, as coloured cells, with marks on the
// settings where other columns lie within bounds.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/stages/figure.hpp"
#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

struct MapBounds {
  std::optional<double> least, most;
};
struct MapMark {
  std::string label;
  std::vector<std::pair<std::string, MapBounds>> where;  // column → values of the marked settings
};
struct MapOptions {
  std::string name, from, file = "table.csv", x, y, value;
  std::string caption, x_label, y_label, value_label;
  std::optional<double> value_low, value_high;
  bool logarithmic_x = false, logarithmic_y = false, lead = false;
  std::vector<std::pair<std::string, std::string>> where;  // column → text of the rows that are drawn
  std::vector<MapMark> marks;
};

void describe_map(Fields& fields, MapOptions& map);
void state_map(ResultList& list, const MapOptions& map);
// Adds the map to the drawings; what chart.json says of it.
Json draw_map(const RunContext& context, const MapOptions& map, Drawings& drawings);

}  // namespace shakebed::pipelines
