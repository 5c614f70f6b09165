#include "pipelines/stages/plot_data.hpp"

#include <array>
#include <cmath>
#include <cstdlib>

#include <fmt/format.h>

namespace shakebed::pipelines {
namespace {

// 7 digits are a ten-thousandth of a pixel.
Json rounded(double value) {
  return std::isfinite(value) ? Json(std::strtod(fmt::format("{:.7g}", value).c_str(), nullptr)) : Json();
}

Json rounded_all(const std::vector<double>& values) {
  Json out = Json::array();
  for (const double value : values) out.push_back(rounded(value));
  return out;
}

Json limits(const std::optional<double>& low, const std::optional<double>& high) {
  return Json::array({low ? rounded(*low) : Json(), high ? rounded(*high) : Json()});
}

Json series_json(const std::vector<Series>& all) {
  constexpr std::array styles = {"points", "line", "dashed", "dotted"};
  Json out = Json::array();
  for (const Series& series : all) {
    Json one{{"label", series.label},     {"style", styles[static_cast<std::size_t>(series.style)]},
             {"color", series.color},     {"hollow", series.hollow},
             {"markup", series.markup},   {"x", rounded_all(series.x)},
             {"y", rounded_all(series.y)}};
    if (!series.error.empty()) one["e"] = rounded_all(series.error);
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace

Json plot_data(const Picture& picture) {
  Json bands = Json::array();
  for (const auto& [low, high] : picture.bands) bands.push_back(Json::array({rounded(low), rounded(high)}));
  return Json{{"x", picture.x_label},
              {"y", picture.y_label},
              {"xlim", limits(picture.x_low, picture.x_high)},
              {"ylim", limits(picture.y_low, picture.y_high)},
              {"log", Json::array({picture.logarithmic_x, picture.logarithmic_y})},
              {"bands", std::move(bands)},
              {"band", picture.band_label},
              {"series", series_json(picture.series)},
              {"lower", series_json(picture.lower)},
              {"lowerLabel", picture.lower_label}};
}

}  // namespace shakebed::pipelines
