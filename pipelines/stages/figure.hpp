// figure: profiles, fits and published curves in one picture, by gnuplot.
//
// Files: profile.svg with its profile.dat and profile.gp; windows.svg/.dat/.gp (temperature against window, where a fit
// is among the inputs); figure.json (how far the curves are from one another).
#pragma once

#include "pipelines/stages.hpp"

namespace shakebed::pipelines {

StageRow figure_stage();

// A column of y against x with how it is drawn.
struct Series {
  enum class Style { points, line, dashed, dotted };
  std::string label;
  Style style = Style::points;
  int color = 0;                    // of the palette below
  std::vector<double> x, y, error;  // error may be empty
};
struct Picture {
  std::string x_label{}, y_label{}, title{};
  std::vector<Series> series{};
  std::optional<double> x_low{}, x_high{}, y_low{}, y_high{};
  std::vector<std::pair<double, double>> bands{};  // shaded from x to x
  std::string band_label{};
};
// Writes NAME.dat, NAME.gp and NAME.svg into the folder. Throws StageError when gnuplot is missing or fails.
void draw_picture(const Picture& picture, const std::filesystem::path& directory, const std::string& name);

}  // namespace shakebed::pipelines
