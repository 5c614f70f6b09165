#include "pipelines/stages/figure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/process.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/stages/plot_data.hpp"

namespace shakebed::pipelines {
namespace {

// Density in 1/D^2 above which a profile is on the picture: a line thinner than that is on the axis (the y axis is
// about 1.2 high and 480 pixels long).
constexpr double drawn_density = 2e-3;
// Density in 1/D^2 from which frames are compared with the simulation: below, few disks are seen.
constexpr double compared_density = 0.1;

// Colours that stay apart for every kind of colour vision [Okabe and Ito 2008].
constexpr std::array palette = {"#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"};
enum Color { black, blue, vermilion, green, purple, orange, sky };

// gnuplot strings in single quotes: in double ones gnuplot runs what stands between backquotes. An apostrophe becomes a
// typographic one, since gnuplot versions differ about quotes within quotes.
std::string gnuplot_text(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'')
      out += "\u2019";
    else
      out += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return out + "'";
}

// Text from the user, in a terminal with enhanced markup: its special characters mean themselves.
std::string plain(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '_' || c == '^' || c == '{' || c == '}' || c == '@' || c == '&' || c == '~') out += '\\';
    out += c;
  }
  return out;
}

// Characters of UTF-8.
std::size_t letters(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

// Distance of tics, 1, 2 or 5 times a power of ten, so that at most six stand on a short axis.
double tic_distance(const std::vector<Series>& all) {
  double low = INFINITY, high = -INFINITY;
  for (const Series& series : all) {
    for (std::size_t i = 0; i < series.y.size(); ++i) {
      const double error = i < series.error.size() ? series.error[i] : 0;
      low = std::min(low, series.y[i] - error), high = std::max(high, series.y[i] + error);
    }
  }
  if (!(high > low)) return 0;
  const double least = (high - low) / 4, power = std::pow(10, std::floor(std::log10(least)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= least) return step * power;
  }
  return 10 * power;
}

// Labels at 1, 2 and 5 times the powers of ten on an axis of decades that is short: gnuplot labels whole decades alone.
constexpr double long_axis = 300;  // highest over lowest number from which decades are labels enough
std::string decade_tics(char axis, double low, double high) {
  if (!(low > 0) || !(high > low) || high / low >= long_axis) return "";
  std::string places;
  for (double power = std::pow(10, std::floor(std::log10(low)) - 1); power <= high; power *= 10) {
    for (const double digit : {1.0, 2.0, 5.0}) {
      if (digit * power < low / 2 || digit * power > high * 2) continue;
      places += fmt::format("{}{:g}", places.empty() ? "" : ", ", digit * power);
    }
  }
  return fmt::format("set {}tics ({})\n", axis, places);
}

// Both pictures from one script: it is drawn twice, and what differs (size, font, place, file) comes first. The PDF is
// as wide as one column of a journal, 86 mm, with text of 7 points that reads there (gnuplot's pdfcairo draws a font
// of 10.5 so large).
struct Sheet {
  double height;         // of the SVG in pixels, 860 wide; of the PDF in points, 243.8 wide
  std::string settings;  // gnuplot variables the body reads
};
constexpr double svg_width = 860, pdf_width = 8.6 / 2.54 * 72;
std::string twice(const std::string& name, const Sheet& svg, const Sheet& pdf, const std::string& body) {
  std::string script = "set encoding utf8\n";
  script += fmt::format(
      "set terminal svg size {:.0f},{:.0f} enhanced font 'Helvetica,16' background '#ffffff' linewidth 1.4\nset output "
      "{}\nscale = 1.0\nkeyfont = ',14'\n",
      svg_width, svg.height, gnuplot_text(name + ".svg"));
  script += svg.settings + body + "unset output\n\nreset\nset encoding utf8\n";
  script += fmt::format(
      "set terminal pdfcairo size 8.6cm,{:.2f}cm enhanced font 'Helvetica,10.5' background '#ffffff' linewidth "
      "0.6\nset output {}\nscale = 0.6\nkeyfont = ',9'\n",
      pdf.height / 72 * 2.54, gnuplot_text(name + ".pdf"));
  return script + pdf.settings + body + "unset output\n";
}

// Where a picture's key and panels are. `row`: height of a line of the key, in the sheet's unit.
Sheet picture_sheet(std::size_t entries, std::size_t columns, int key_width, double plots, double row, double left) {
  const auto rows = static_cast<double>(std::max<std::size_t>(1, (entries + columns - 1) / columns));
  const double height = plots + row * rows;
  return {height, fmt::format("key_rows = {}\nkey_width = {}\npanel_top = {:.3f}\npanel_left = {}\n", rows, key_width,
                              1 - (0.022 * plots + 1.04 * row * rows) / height, left)};
}

// Equal data give equal bytes: cairo 1.16 writes the date into the PDF whatever SOURCE_DATE_EPOCH says. Blanks of the
// same length in its place leave the table of byte offsets at the end of the file valid.
void remove_date(const std::filesystem::path& pdf) {
  std::string bytes = read_file(pdf);
  const std::size_t begin = bytes.find("/CreationDate (");
  const std::size_t end = begin == std::string::npos ? begin : bytes.find(')', begin);
  if (end == std::string::npos) return;
  std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(begin), bytes.begin() + static_cast<std::ptrdiff_t>(end) + 1,
            ' ');
  write_file(pdf, bytes);
}

}  // namespace

void Drawings::add_script(const std::string& name, const std::string& script) {
  write_file(directory_ / (name + ".gp"), script);
  names_.push_back(name);
}

void Drawings::draw() const {
  if (names_.empty()) return;
  std::vector<std::string> command{"env", "SOURCE_DATE_EPOCH=0", "gnuplot"};
  for (const std::string& name : names_) {
    if (name != names_.front()) command.insert(command.end(), {"-e", "reset session"});
    command.push_back(name + ".gp");
  }
  ProcessResult result;
  try {
    result = run_process(command, directory_);
  } catch (const StageError& error) {
    throw StageError(fmt::format("{}; figures need gnuplot (Debian: gnuplot-nox)", error.what()));
  }
  if (result.exit_code == 127)
    throw StageError(fmt::format("{}; figures need gnuplot (Debian: gnuplot-nox)", result.output));
  for (const std::string& name : names_) {
    for (const char* kind : {".svg", ".pdf"}) {
      std::error_code error;
      const auto size = std::filesystem::file_size(directory_ / (name + kind), error);
      if (error || size == 0 || (result.exit_code != 0 && name == names_.back())) {
        throw StageError(
            fmt::format("gnuplot could not draw {}.gp (exit code {}): {}", name, result.exit_code, result.output));
      }
    }
    remove_date(directory_ / (name + ".pdf"));
  }
}

namespace {

// The series as "plot" elements, their data at `index` and after in NAME.dat.
std::string plot_elements(const std::vector<Series>& all, const std::string& name, std::size_t index, bool titles) {
  constexpr std::array points = {7, 5, 9, 13, 11, 6, 4, 8, 12, 10};  // filled circle, square, ...; then open ones
  constexpr std::size_t open = points.size() / 2;
  std::size_t point = 0;
  std::string script;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Series& series = all[i];
    const std::size_t shape = series.style != Series::Style::points ? 0
                              : series.hollow && point > 0          ? point - 1
                                                                    : point++;
    if (series.x.empty()) continue;
    script += script.empty() ? "" : ", \\\n     ";
    const char* color = palette[static_cast<std::size_t>(series.color) % palette.size()];
    // The error bars as plain strokes below the points: gnuplot's own leave gaps around them.
    if (series.style == Series::Style::points && !series.error.empty()) {
      script += fmt::format(
          "{} index {} using 1:($2-$3):(0):(2*$3) with vectors nohead lw 1.2 lc rgb '{}' notitle, \\\n     ",
          gnuplot_text(name + ".dat"), index + i, color);
    }
    script += fmt::format("{} index {} using ", gnuplot_text(name + ".dat"), index + i);
    switch (series.style) {
      case Series::Style::points:
        script += fmt::format("1:2 with points pt {} ps 0.55*scale lw 1.4 lc rgb '{}'",
                              points[(shape + (series.hollow ? open : 0)) % points.size()], color);
        break;
      case Series::Style::line:
        script += fmt::format("1:2 with lines lw 2 lc rgb '{}'", color);
        break;
      case Series::Style::dashed:
        script += fmt::format("1:2 with lines lw 2 dashtype 2 lc rgb '{}'", color);
        break;
      case Series::Style::dotted:
        script += fmt::format("1:2 with lines lw 1.6 dashtype 3 lc rgb '{}'", color);
        break;
    }
    script += titles ? fmt::format(" title {}", gnuplot_text(series.markup ? series.label : plain(series.label)))
                     : std::string(" notitle");
  }
  return script;
}

// One block of NAME.dat a series.
std::string data_blocks(const std::vector<Series>& all) {
  std::string data;
  for (const Series& series : all) {
    data += fmt::format("# {}\n# x y{}\n", series.label, series.error.empty() ? "" : " std_error");
    for (std::size_t i = 0; i < series.x.size(); ++i) {
      data += number_text(series.x[i]) + ' ' + number_text(series.y[i]);
      if (!series.error.empty()) data += ' ' + number_text(std::max(0.0, series.error[i]));
      data += '\n';
    }
    data += "\n\n";
  }
  return data;
}

// The same for both panels: upper axis label, title, ranges, scales, lines.
std::string frame_script(const Picture& picture) {
  const auto bound = [](const std::optional<double>& value) { return value ? number_text(*value) : "*"; };
  std::string script = fmt::format("set ylabel {}\n", gnuplot_text(picture.y_label));
  if (!picture.title.empty()) script += fmt::format("set title {}\n", gnuplot_text(plain(picture.title)));
  script += fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\n", bound(picture.x_low), bound(picture.x_high),
                        bound(picture.y_low), bound(picture.y_high));
  for (const bool across : {true, false}) {
    if (!(across ? picture.logarithmic_x : picture.logarithmic_y)) continue;
    double low = INFINITY, high = -INFINITY;
    for (const Series& series : picture.series) {
      for (const double place : across ? series.x : series.y)
        if (place > 0) low = std::min(low, place), high = std::max(high, place);
    }
    script += fmt::format("set logscale {}\n", across ? 'x' : 'y') + decade_tics(across ? 'x' : 'y', low, high);
  }
  return script +
         "set border lc rgb '#404040'\nset tics nomirror\nset grid lc rgb '#dddddd' lt 1 lw 0.6\nset bars 0.6\nset "
         "pointintervalbox 0\n";
}

std::string bands_script(const Picture& picture) {
  std::string script;
  int object = 1;
  for (const auto& [low, high] : picture.bands) {
    script += fmt::format(
        "set object {} rectangle from {}, graph 0 to {}, graph 1 behind fillcolor rgb '#f0f0f0' fillstyle solid "
        "noborder\n",
        object++, number_text(low), number_text(high));
  }
  return script;
}

std::string upper_panel(const Picture& picture, const std::string& name) {
  std::string script;
  if (picture.lower.empty()) {
    script += fmt::format("set xlabel {}\n", gnuplot_text(picture.x_label));
  } else {
    script +=
        "set multiplot\nset lmargin at screen panel_left\nset rmargin at screen 0.97\nset tmargin at screen "
        "panel_top\nset bmargin at screen 0.38\nset format x ''\n";
  }
  script += "plot ";
  if (!picture.band_label.empty()) {
    script += fmt::format("NaN with boxes fillcolor rgb '#e4e4e4' fillstyle solid noborder title {}, \\\n     ",
                          gnuplot_text(plain(picture.band_label)));
  }
  return script + plot_elements(picture.series, name, 0, true) + "\n";
}

std::string lower_panel(const Picture& picture, const std::string& name) {
  std::string script = fmt::format(
      "set tmargin at screen 0.35\nset bmargin at screen 0.13\nunset key\nunset title\nset format x '% h'\nset "
      "xlabel {}\nset ylabel {}\nset yrange [*:*]\nunset logscale y\nset xzeroaxis lc rgb "
      "'#404040' lw 1\n",
      gnuplot_text(picture.x_label), gnuplot_text(picture.lower_label));
  if (const double distance = tic_distance(picture.lower); distance > 0)
    script += "set ytics " + number_text(distance) + "\n";
  // The two share their x: where the upper one found it by itself, the lower one takes it over.
  if (!picture.x_low || !picture.x_high) script += "set xrange [GPVAL_X_MIN:GPVAL_X_MAX]\n";
  return script + "plot " + plot_elements(picture.lower, name, picture.series.size(), false) + "\nunset multiplot\n";
}

// The key stands above the picture, where it hides nothing, in as many columns as its labels allow.
struct Sheets {
  Sheet svg, pdf;
};
Sheets sheets_of(const Picture& picture) {
  std::size_t entries = picture.band_label.empty() ? 0 : 1, longest = letters(picture.band_label);
  for (const Series& series : picture.series) {
    entries += !series.label.empty();
    longest = std::max(longest, letters(series.label));
  }
  const bool many = entries > 4, two = !picture.lower.empty();
  // gnuplot leaves out the columns that do not fit: two of 46 letters do, two of 48 do not.
  const std::size_t svg_columns = many && longest <= 27 ? 3 : longest <= 44 ? 2 : 1;
  const std::size_t pdf_columns = many && longest <= 14 ? 3 : longest <= 26 ? 2 : 1;
  return {picture_sheet(entries, svg_columns, svg_columns == 3 && longest > 18 ? -3 : 0, two ? 640 : 480, 24, 0.14),
          picture_sheet(entries, pdf_columns, 0, two ? 200 : 150, 9.2, 0.17)};
}

}  // namespace

void Drawings::add(const Picture& picture, const std::string& name) {
  // gnuplot does not give an index to an empty block.
  Picture drawn = picture;
  const auto is_empty = [](const Series& series) { return series.x.empty(); };
  std::erase_if(drawn.series, is_empty);
  std::erase_if(drawn.lower, is_empty);
  if (drawn.series.empty()) throw StageError(fmt::format("there is nothing to draw in {}.svg", name));
  write_file(directory_ / (name + ".dat"), data_blocks(drawn.series) + data_blocks(drawn.lower));
  write_file(directory_ / (name + std::string(plot_data_suffix)), dump_canonical(plot_data(drawn)) + "\n");

  std::string body = frame_script(drawn);
  body += "set key above vertical maxrows key_rows Left reverse font keyfont spacing 1.2 samplen 1.5 width key_width\n";
  body += bands_script(drawn);
  body += upper_panel(drawn, name);
  if (!drawn.lower.empty()) body += lower_panel(drawn, name);
  const Sheets sheets = sheets_of(drawn);
  add_script(name, twice(name, sheets.svg, sheets.pdf, body));
}

namespace {
// Dark blue to yellow: rises in lightness alone [cividis; Nunez, Anderton and Renslow 2018].
constexpr const char* lightness_palette =
    "set palette defined (0 '#00224e', 0.25 '#3b496c', 0.5 '#7b7b78', 0.75 '#bcae6c', 1 '#fee838')\n";
}  // namespace

void Drawings::add(const MapPicture& picture) {
  const auto bound = [](const std::optional<double>& value) { return value ? number_text(*value) : "*"; };
  const std::string file = gnuplot_text(picture.name + ".dat");
  write_file(directory_ / (picture.name + ".dat"), picture.data);
  std::string body = fmt::format(
      "set xlabel {}\nset ylabel {}\nset cblabel {}\nset border lc rgb '#404040'\nset tics nomirror out\nset cbrange "
      "[{}:{}]\nset autoscale xfix\nset autoscale yfix\nset style fill solid 1 noborder\nset key above font keyfont\n",
      gnuplot_text(picture.x_label), gnuplot_text(picture.y_label), gnuplot_text(picture.value_label),
      bound(picture.value_low), bound(picture.value_high));
  body += lightness_palette;
  for (const auto& [axis, range] : {std::pair('x', picture.decades_x), std::pair('y', picture.decades_y)}) {
    if (range) body += fmt::format("set logscale {}\n", axis) + decade_tics(axis, range->first, range->second);
  }
  body += fmt::format("plot {} index 0 using 1:2:3:4:5:6:7 with boxxyerror lc palette notitle", file);
  constexpr std::array symbols = {7, 2, 8, 4, 12};
  for (std::size_t k = 0; k < picture.marks.size(); ++k) {
    // White below, so that a symbol is seen on dark and on light cells.
    const auto& [label, number] = picture.marks[k];
    const int symbol = symbols[number % symbols.size()];
    body += fmt::format(", {0} index {1} using 1:2 with points pt {2} ps 1.0*scale lw 4 lc rgb '#ffffff' notitle", file,
                        k + 1, symbol);
    body += fmt::format(", {0} index {1} using 1:2 with points pt {2} ps 0.7*scale lw 2 lc rgb '#D55E00' title {3}",
                        file, k + 1, symbol, gnuplot_text(plain(label)));
  }
  add_script(picture.name, twice(picture.name, {560, ""}, {170, ""}, body + "\n"));
}

void Drawings::add(const DiskPicture& picture, const std::string& name) {
  if (picture.x.empty()) throw StageError(fmt::format("there is nothing to draw in {}.svg", name));
  std::string data = "# disks: x y radius color\n";
  double top = 0;
  for (std::size_t i = 0; i < picture.x.size(); ++i) {
    data += fmt::format("{} {} {} {}\n", picture.x[i], picture.y[i], picture.radius[i], picture.color[i]);
    top = std::max(top, picture.y[i] + picture.radius[i]);
  }
  data += "\n\n# crosses: x y\n";
  for (std::size_t i = 0; i < picture.cross_x.size(); ++i)
    data += fmt::format("{} {}\n", picture.cross_x[i], picture.cross_y[i]);
  data += "\n\n";
  write_file(directory_ / (name + ".dat"), data);
  std::string body = fmt::format(
      "set xlabel {}\nset ylabel {}\nset cblabel {}\nset xrange [0:{}]\nset yrange [0:{}]\nset size ratio -1\nset "
      "border lc rgb '#404040'\nset tics nomirror out\nset cbrange [{}:{}]\n"
      "{}set style fill solid 1 border lc rgb '#303030'\nset key above\n",
      gnuplot_text(picture.x_label), gnuplot_text(picture.y_label), gnuplot_text(picture.color_label), picture.width,
      std::ceil(top + 0.5), picture.color_low, picture.color_high, lightness_palette);
  body +=
      fmt::format("plot {} index 0 using 1:2:3:4 with circles lc palette lw 0.5 notitle", gnuplot_text(name + ".dat"));
  if (!picture.cross_x.empty())
    body += fmt::format(", {} index 1 using 1:2 with points pt 2 ps 1.3*scale lw 3 lc rgb '#D55E00' title {}",
                        gnuplot_text(name + ".dat"), gnuplot_text(plain(picture.cross_label)));
  const double shape = std::clamp((top + 8) / (picture.width + 10), 0.3, 2.0);
  add_script(name, twice(name, {svg_width * shape, ""}, {pdf_width * shape, ""}, body + "\n"));
}

namespace {

enum class Reference { none, clement_rajchenbach };

struct Curve {
  std::vector<double> x, y, error;
  bool empty() const { return x.empty(); }
};

// Linear between the points; nothing outside.
std::optional<double> at(const Curve& curve, double x) {
  const auto upper = std::lower_bound(curve.x.begin(), curve.x.end(), x);
  if (upper == curve.x.end()) return std::nullopt;
  const auto i = static_cast<std::size_t>(upper - curve.x.begin());
  if (curve.x[i] == x) return curve.y[i];
  if (i == 0) return std::nullopt;
  const double u = (x - curve.x[i - 1]) / (curve.x[i] - curve.x[i - 1]);
  return curve.y[i - 1] + u * (curve.y[i] - curve.y[i - 1]);
}

Curve curve_of(const ProfileTable& table) { return {table.height, table.number_density, table.std_error}; }

// Two columns of one of our own CSV files.
Curve read_columns(const std::filesystem::path& path, const std::string& x, const std::string& y,
                   const std::string& error = "") {
  Curve curve;
  std::vector<std::string> header;
  each_csv_line(read_file(path), [&](std::vector<std::string> cells, std::size_t line) {
    if (header.empty()) {
      header = std::move(cells);
      return;
    }
    const auto number = [&](const std::string& name) {
      const std::size_t index = csv_column(header, name, path.string());
      if (index >= cells.size())
        throw InputError(fmt::format("{}:{}: this row has no cell in column \"{}\"", path.string(), line, name));
      return std::strtod(cells[index].c_str(), nullptr);
    };
    curve.x.push_back(number(x)), curve.y.push_back(number(y));
    if (!error.empty()) curve.error.push_back(number(error));
  });
  return curve;
}

// How far `a` is from `b` where both are known and a's density is above the threshold.
Json comparison(const std::string& of, const std::string& with, const Curve& a, const Curve& b, double above) {
  double squares = 0, sum = 0, largest = 0;
  std::size_t points = 0;
  for (std::size_t i = 0; i < a.x.size(); ++i) {
    if (!(a.y[i] > above)) continue;
    const auto other = at(b, a.x[i]);
    if (!other) continue;
    const double difference = a.y[i] - *other;
    squares += difference * difference, sum += difference, largest = std::max(largest, std::abs(difference));
    ++points;
  }
  Json out{{"of", of}, {"with", with}, {"points", points}};
  if (points == 0) return out;
  const auto n = static_cast<double>(points);
  out["rms_difference"] = quantity_json(std::sqrt(squares / n), "1/D^2");
  out["mean_difference"] = quantity_json(sum / n, "1/D^2");
  out["largest_difference"] = quantity_json(largest, "1/D^2");
  return out;
}

class Figure : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.choice("reference", reference_,
                  {{Reference::none, "none"}, {Reference::clement_rajchenbach, "clement-rajchenbach-1991"}},
                  {.help = "published fit that is drawn as well, from its printed parameters"});
    fields.input_files("data", data_,
                       {.help = "your own points: CSV file with the columns height [D] and number_density [1/D^2]. "
                                "They are drawn and compared with the curves"});
    fields.text("title", title_, {.help = "title above the figure"});
    fields.number("highest", highest_,
                  {.help = "upper end of the axis of heights, in D; left out, from the data", .range = positive});
  }
  void results(ResultList& list) const override {
    const Given both_drawn = both(given_if(list.from("extract") != nullptr && list.from("simulate") != nullptr,
                                           "\"from\" names an extract and a simulate stage"),
                                  given_when("the profiles overlap"));
    list.quantity("/frames_against_simulation", "1/D^2", "rms difference of the frames from the simulation",
                  both_drawn);
    list.quantity("/frames_against_simulation_same_moments", "1/D^2",
                  "rms difference of the frames from the simulation at the moments of the frames", both_drawn);
    const Given compared = given_when("two profiles are drawn"), overlap = given_when("the two profiles overlap");
    const std::string row = "/comparisons/#/";
    list.text(row + "of", "name of a profile", compared);
    list.text(row + "with", "name of the profile with which it is compared", compared);
    list.number(row + "points", "1", "number of heights at which both profiles are known", compared);
    list.quantity(row + "rms_difference", "1/D^2", "rms difference", overlap);
    list.quantity(row + "mean_difference", "1/D^2", "mean difference", overlap);
    list.quantity(row + "largest_difference", "1/D^2", "largest difference", overlap);
  }
  void run(RunContext& context) const override;

 private:
  Reference reference_ = Reference::none;
  InputFiles data_;
  std::string title_;
  std::optional<double> highest_;
};

// The picture as it grows, the curves in it and how far they are from one another.
class ProfilePicture {
 public:
  ProfilePicture(RunContext& context, const std::string& title) : context_(context) {
    picture_.x_label = "height above the floor's mean position,  z/D";
    picture_.y_label = "number density,  φ = n D^2";
    picture_.title = title;
  }

  void add_frames() {
    const Input* extract = context_.find_input("extract");
    if (extract == nullptr) return;
    frames_ = curve_of(read_profile_csv(extract->file("profile.csv")));
    picture_.series.push_back({"from the frames", Series::Style::points, black, frames_.x, frames_.y, frames_.error});
  }

  // Beside frames a line, alone points with errors.
  void add_simulation() {
    const Input* simulate = context_.find_input("simulate");
    if (simulate == nullptr) return;
    simulated_ = curve_of(read_profile_csv(simulate->file("profile.csv")));
    const bool alone = frames_.empty();
    picture_.series.push_back({"the simulation itself", alone ? Series::Style::points : Series::Style::line, sky,
                               simulated_.x, simulated_.y, alone ? simulated_.error : std::vector<double>{}});
    if (alone) return;
    compare_by_name("frames_against_simulation", "simulation", simulated_);
    // The same moments as the frames, where the simulation kept them apart.
    compare_by_name("frames_against_simulation_same_moments", "simulation at the moments of the frames",
                    simulate->has("profile_frames.csv")
                        ? curve_of(read_profile_csv(simulate->file("profile_frames.csv")))
                        : simulated_);
  }

  void add_fit() {
    const Input* fit = context_.find_input("fit");
    if (fit == nullptr) return;
    const Json result = fit->result();
    fitted_ = read_columns(fit->file("curve.csv"), "height", "smoothed_density");
    bare_ = read_columns(fit->file("curve.csv"), "height", "number_density");
    if (fitted_.empty()) return;
    picture_.series.push_back({label_of_fit(result), Series::Style::line, vermilion, fitted_.x, fitted_.y, {}});
    const Json *low = find_pointer(result, "/window/low/value"), *high = find_pointer(result, "/window/high/value");
    if (low == nullptr || high == nullptr) return;
    picture_.bands.emplace_back(low->get<double>(), high->get<double>());
    picture_.band_label = "window of the fit";
  }

  // To be called when all measured and fitted profiles are in: the axis ends where they do.
  void find_end() {
    for (const Series& series : picture_.series) {
      for (std::size_t i = 0; i < series.x.size(); ++i) {
        if (series.y[i] > drawn_density) end_ = std::max(end_, series.x[i]);
      }
    }
  }

  void add_published() {
    const fit::PublishedFit parameters;
    const fit::HydrostaticProfile profile = fit::published_profile(parameters);
    const double top = std::max(end_, parameters.shift() + 3);
    for (int i = 0; i <= 800; ++i) {
      const double height = top * i / 800;
      published_.x.push_back(height), published_.y.push_back(profile.density(height));
    }
    picture_.series.push_back({fmt::format("published fit, T/mg = {:g} mm", parameters.temperature_over_mg_in_mm),
                               Series::Style::dashed,
                               blue,
                               published_.x,
                               published_.y,
                               {}});
    end_ = std::max(end_, parameters.shift() + 2);
    if (!fitted_.empty()) compare("our fit", bare_.empty() ? fitted_ : bare_, "published fit", published_);
    if (!frames_.empty())
      compare("frames", frames_, "published fit", published_);
    else if (!simulated_.empty())
      compare("simulation", simulated_, "published fit", published_);
  }

  void add_points(const InputFiles& files) {
    int color = green;
    for (const std::string& path : files.paths) {
      const ProfileTable points = read_profile_csv(path);
      for (const std::string& note : points.notes) context_.warning(note);
      const Curve data = curve_of(points);
      const std::string label = std::filesystem::path(path).filename().string();
      picture_.series.push_back({label, Series::Style::points, color, data.x, data.y, data.error});
      color = color == green ? purple : color == purple ? orange : green;
      for (const double x : data.x) end_ = std::max(end_, x);
      for (const auto& [name, curve] : {std::pair<std::string, const Curve*>{"our fit", &fitted_},
                                        {"frames", &frames_},
                                        {"simulation", &simulated_},
                                        {"published fit", &published_}}) {
        if (!curve->empty()) compare(label, data, name, *curve);
      }
    }
  }

  void draw(const std::optional<double>& highest, Drawings& drawings) {
    if (picture_.series.empty())
      throw InputError(
          context_.find_input("fit") == nullptr
              ? "there is nothing to draw: \"from\" names no profile and no fit"
              : "there is nothing to draw: the fit in \"from\" has no curve (its warnings say why). Name the stage of "
                "the profile in \"from\" too: the figure then shows what was measured");
    picture_.x_low = 0;
    picture_.x_high = highest ? *highest : std::ceil(end_ + 0.5);
    picture_.y_low = 0;
    drawings.add(picture_, "profile");
  }

  void write_comparisons() {
    Json out;
    for (const auto& [name, value] : named_.items()) out[name] = value;
    out["comparisons"] = std::move(comparisons_);
    write_file(context_.output("figure.json"), dump(out));
  }

 private:
  // With its T where that may be read from this model.
  static std::string label_of_fit(const Json& result) {
    const std::string name = "our fit, " + result.value("model", "") + " alone";
    const bool unreadable = result.contains("answer") && !result.at("answer").contains("temperature");
    if (!result.value("describes_data", true)) return name + " (does not describe the profile)";
    if (unreadable) return name + " (its T is not that of the bed)";
    const Json* t = find_pointer(result, "/temperature_over_mg/value");
    const Json* reduced = find_pointer(result, "/temperature/value");
    if (t != nullptr && t->is_number()) return fmt::format("{}: T/mg = {:.3g} mm", name, t->get<double>() * 1e3);
    if (reduced != nullptr && reduced->is_number())
      return fmt::format("{}: T = {:.3g} mgD", name, reduced->get<double>());
    return name;
  }

  void compare(const std::string& of, const Curve& a, const std::string& with, const Curve& b) {
    comparisons_.push_back(comparison(of, with, a, b, 0.0));
  }
  // The frames with a curve; the result has a name of its own, at which a check can point.
  void compare_by_name(const std::string& name, const std::string& with, const Curve& curve) {
    Json row = comparison("frames", with, frames_, curve, compared_density);
    if (row.contains("rms_difference")) named_[name] = row["rms_difference"];
    comparisons_.push_back(std::move(row));
  }

  RunContext& context_;
  Picture picture_;
  Json comparisons_ = Json::array();
  Json named_ = Json::object();
  Curve frames_, simulated_, fitted_, bare_, published_;
  double end_ = 0;
};

// Temperature against the lower edge of the window, of those windows whose fit succeeded.
void draw_windows(const Input& fit, Drawings& drawings) {
  const Curve all = read_columns(fit.file("windows.csv"), "low", "temperature", "std_error");
  Curve windows;
  for (std::size_t i = 0; i < all.x.size(); ++i) {
    if (!(all.y[i] > 0)) continue;
    windows.x.push_back(all.x[i]), windows.y.push_back(all.y[i]), windows.error.push_back(all.error[i]);
  }
  if (windows.x.size() < 2) return;
  Picture sweep{.x_label = "lower edge of the window,  z/D", .y_label = "T / (m g D)"};
  sweep.series.push_back({"fitted temperature", Series::Style::points, black, windows.x, windows.y, windows.error});
  const Json result = fit.result();
  if (const Json* t = find_pointer(result, "/temperature/value"); t != nullptr && t->is_number()) {
    const auto [low, high] = std::minmax_element(windows.x.begin(), windows.x.end());
    sweep.series.push_back({"in the window used",
                            Series::Style::line,
                            vermilion,
                            {*low, *high},
                            {t->get<double>(), t->get<double>()},
                            {}});
  }
  drawings.add(sweep, "windows");
}

void Figure::run(RunContext& context) const {
  ProfilePicture picture(context, title_);
  picture.add_frames();
  picture.add_simulation();
  picture.add_fit();
  picture.find_end();
  if (reference_ == Reference::clement_rajchenbach) picture.add_published();
  picture.add_points(data_);
  Drawings drawings(context.output_directory());
  picture.draw(highest_, drawings);
  if (const Input* fit = context.find_input("fit")) draw_windows(*fit, drawings);
  context.progress(0.3, "drawing");
  drawings.draw();
  picture.write_comparisons();
}

}  // namespace

StageRow figure_stage() {
  return {.name = "figure",
          .summary = "draws profiles, fits and published curves",
          .accepts = {"extract", "simulate", "fit"},
          .fewest_inputs = 1,
          .most_inputs = 3,
          .result = "figure.json",
          .data_option = "data",
          .pages = figure_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Figure>(); }};
}

}  // namespace shakebed::pipelines
