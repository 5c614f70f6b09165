// figure: profiles, fits and published curves in one picture, by gnuplot.
//
// Files: profile.svg and profile.pdf with their profile.dat, profile.gp and profile.plot.json; windows.* (temperature
// against window, where a fit is among the inputs); figure.json (how far the curves are from one another).
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages figure_pages();  // figure_report.cpp; of every stage that draws

// A column of y against x with how it is drawn.
struct Series {
  enum class Style { points, line, dashed, dotted };
  std::string label;
  Style style = Style::points;
  int color = 0;                    // of the palette below
  std::vector<double> x, y, error;  // error may be empty
  bool hollow = false;              // points: the symbol of the series before, open
  bool markup = false;              // of the label: T_c with a subscript, as on the axes; false: as it stands
};
struct Picture {
  std::string x_label{}, y_label{}, title{};
  std::vector<Series> series{};
  std::optional<double> x_low{}, x_high{}, y_low{}, y_high{};
  std::vector<std::pair<double, double>> bands{};  // shaded from x to x
  std::string band_label{};
  std::vector<Series> lower{};  // a second panel below, on the same x: residuals; none: one panel
  std::string lower_label{};
  bool logarithmic_x = false, logarithmic_y = false;
};
// Disks to scale, coloured by a number from 0 to 1, with crosses where `cross_x` and `cross_y` say.
struct DiskPicture {
  double width = 0;  // of the box
  std::vector<double> x{}, y{}, radius{}, color{}, cross_x{}, cross_y{};
  std::string x_label{}, y_label{}, color_label{}, cross_label{};
  double color_low = 0, color_high = 1;
};
// Coloured cells, with symbols on some of them. `data`: block 0 of rows "x y x_low x_high y_low y_high value", then a
// block of rows "x y" for each mark.
struct MapPicture {
  std::string name, data;
  std::string x_label{}, y_label{}, value_label{};
  std::optional<double> value_low{}, value_high{};
  std::optional<std::pair<double, double>> decades_x{}, decades_y{};  // lowest and highest place of a logarithmic axis
  std::vector<std::pair<std::string, std::size_t>> marks{};           // label, number of the symbol
};
// Pictures of one folder. Each is written as NAME.dat and its script NAME.gp, and draw() makes NAME.svg and NAME.pdf of
// them all: gnuplot takes longer to start than to draw.
class Drawings {
 public:
  explicit Drawings(std::filesystem::path directory) : directory_(std::move(directory)) {}
  // Writes NAME.plot.json, too: what the page draws again, to be asked.
  void add(const Picture& picture, const std::string& name);
  void add(const DiskPicture& picture, const std::string& name);
  void add(const MapPicture& picture);
  void add_script(const std::string& name, const std::string& script);
  // Throws StageError when gnuplot is missing or fails. Of no pictures it does nothing.
  void draw() const;

 private:
  std::filesystem::path directory_;
  std::vector<std::string> names_;
};

}  // namespace shakebed::pipelines
