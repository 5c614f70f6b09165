// The script that gnuplot draws, line by line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <regex>
#include <string>
#include <vector>

#include "pipelines/formats/errors.hpp"
#include "pipelines/stages/figure.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;
using testing::Not;
using Style = Series::Style;

template <typename AnyPicture>
void drawn(const AnyPicture& picture, const std::filesystem::path& folder, const std::string& name) {
  Drawings drawings(folder);
  drawings.add(picture, name);
  drawings.draw();
}

// One panel. Filled symbols go round 7, 5, 9, ...; an open one is that of the series before. Numbers above 0 from 2 to
// 500 lie 250 times apart: below 300 the axis has labels at 1, 2 and 5 times powers of ten, from half the least on.
TEST(PictureScript, NamesSeriesSymbolsColoursAndAxes) {
  const ScratchFolder folder;
  Picture picture{.x_label = "x it's", .y_label = "y", .title = "T_c"};
  picture.series = {{"first_one", Style::points, 0, {1, 2}, {2, 500}, {0.5, -1}},
                    {"open", Style::points, 1, {3}, {20}, {}, true},
                    {"second", Style::points, 8, {4}, {40}, {}},
                    {"none", Style::line, 2, {}, {}, {}},
                    {"line", Style::line, 3, {1, 4}, {0, 30}, {}},
                    {"T_c", Style::dashed, 4, {1, 4}, {3, 3}, {}, false, true},
                    {"dots", Style::dotted, 5, {1, 4}, {4, 4}, {}}};
  picture.x_low = 0, picture.y_high = 600;
  picture.bands = {{1.5, 2.5}, {3, 3.25}};
  picture.band_label = "window";
  picture.logarithmic_y = true;
  drawn(picture, folder.path(), "p");
  EXPECT_EQ(read_text(folder / "p.dat"),
            "# first_one\n# x y std_error\n1 2 0.5\n2 500 0\n\n\n# open\n# x y\n3 20\n\n\n# second\n# x y\n4 40\n\n\n"
            "# line\n# x y\n1 0\n4 30\n\n\n# T_c\n# x y\n1 3\n4 3\n\n\n# dots\n# x y\n1 4\n4 4\n\n\n");
  const std::string script = read_text(folder / "p.gp");
  const std::string body =
      "set ylabel 'y'\nset title 'T\\_c'\nset xrange [0:*]\nset yrange [*:600]\nset logscale y\n"
      "set ytics (1, 2, 5, 10, 20, 50, 100, 200, 500)\nset border lc rgb '#404040'\nset tics nomirror\n"
      "set grid lc rgb '#dddddd' lt 1 lw 0.6\nset bars 0.6\nset pointintervalbox 0\n"
      "set key above vertical maxrows key_rows Left reverse font keyfont spacing 1.2 samplen 1.5 width key_width\n"
      "set object 1 rectangle from 1.5, graph 0 to 2.5, graph 1 behind fillcolor rgb '#f0f0f0' fillstyle solid "
      "noborder\n"
      "set object 2 rectangle from 3, graph 0 to 3.25, graph 1 behind fillcolor rgb '#f0f0f0' fillstyle solid "
      "noborder\n"
      "set xlabel 'x it’s'\n"
      "plot NaN with boxes fillcolor rgb '#e4e4e4' fillstyle solid noborder title 'window', \\\n     "
      "'p.dat' index 0 using 1:($2-$3):(0):(2*$3) with vectors nohead lw 1.2 lc rgb '#000000' notitle, \\\n     "
      "'p.dat' index 0 using 1:2 with points pt 7 ps 0.55*scale lw 1.4 lc rgb '#000000' title 'first\\_one', \\\n     "
      "'p.dat' index 1 using 1:2 with points pt 6 ps 0.55*scale lw 1.4 lc rgb '#0072B2' title 'open', \\\n     "
      "'p.dat' index 2 using 1:2 with points pt 5 ps 0.55*scale lw 1.4 lc rgb '#0072B2' title 'second', \\\n     "
      "'p.dat' index 3 using 1:2 with lines lw 2 lc rgb '#009E73' title 'line', \\\n     "
      "'p.dat' index 4 using 1:2 with lines lw 2 dashtype 2 lc rgb '#CC79A7' title 'T_c', \\\n     "
      "'p.dat' index 5 using 1:2 with lines lw 1.6 dashtype 3 lc rgb '#E69F00' title 'dots'\nunset output\n";
  EXPECT_THAT(script, HasSubstr(body));
  EXPECT_NE(script.find(body), script.rfind(body)) << "once for each sheet";
  // Seven entries of at most 9 letters in three columns on both sheets: three rows. SVG 480 + 3 x 24 = 552 high, PDF
  // (150 + 3 x 9.2) points = 6.27 cm.
  EXPECT_THAT(script, HasSubstr("set terminal svg size 860,552 enhanced font 'Helvetica,16'"));
  EXPECT_THAT(script, HasSubstr("set output 'p.svg'\nscale = 1.0\nkeyfont = ',14'\nkey_rows = 3\nkey_width = 0\n"
                                "panel_top = 0.845\npanel_left = 0.14\n"));  // 1 - (10.56 + 74.88)/552
  EXPECT_THAT(script, HasSubstr("set terminal pdfcairo size 8.6cm,6.27cm enhanced font 'Helvetica,10.5'"));
  EXPECT_THAT(script, HasSubstr("set output 'p.pdf'\nscale = 0.6\nkeyfont = ',9'\nkey_rows = 3\nkey_width = 0\n"
                                "panel_top = 0.820\npanel_left = 0.17\n"));  // 1 - (3.3 + 28.704)/177.6
  EXPECT_THAT(read_text(folder / "p.pdf"), Not(HasSubstr("/CreationDate (")));
}

// Two panels on one x. Differences from -0.7 to 0.5 with their errors: at most six tics lie 0.5 apart, as a quarter of
// 1.2 is 0.3.
TEST(PictureScript, OfTwoPanelsSharesItsAxis) {
  const ScratchFolder folder;
  Picture picture{.x_label = "x", .y_label = "y", .lower_label = "difference"};
  picture.series = {{std::string(28, 'a'), Style::points, 0, {1, 1000}, {2, 3}, {}}};
  picture.lower = {{"zero", Style::line, 0, {1, 2}, {0, 0}, {}},
                   {"d", Style::points, 0, {1, 2}, {-0.5, 0.25}, {0.2, 0.25}}};
  picture.logarithmic_x = true;
  drawn(picture, folder.path(), "two");
  const std::string script = read_text(folder / "two.gp");
  EXPECT_THAT(script, HasSubstr("set xrange [*:*]\nset yrange [*:*]\nset logscale x\nset border"))
      << "1000 times apart: labels at the decades alone";
  EXPECT_THAT(script,
              HasSubstr("set multiplot\nset lmargin at screen panel_left\nset rmargin at screen 0.97\n"
                        "set tmargin at screen panel_top\nset bmargin at screen 0.38\nset format x ''\n"
                        "plot 'two.dat' index 0 using 1:2 with points pt 7 ps 0.55*scale lw 1.4 lc rgb '#000000' "
                        "title 'aaaaaaaaaaaaaaaaaaaaaaaaaaaa'\n"
                        "set tmargin at screen 0.35\nset bmargin at screen 0.13\nunset key\nunset title\n"
                        "set format x '% h'\nset xlabel 'x'\nset ylabel 'difference'\nset yrange [*:*]\n"
                        "unset logscale y\nset xzeroaxis lc rgb '#404040' lw 1\nset ytics 0.5\n"
                        "set xrange [GPVAL_X_MIN:GPVAL_X_MAX]\n"
                        "plot 'two.dat' index 1 using 1:2 with lines lw 2 lc rgb '#000000' notitle, \\\n     "
                        "'two.dat' index 2 using 1:($2-$3):(0):(2*$3) with vectors nohead lw 1.2 lc rgb '#000000' "
                        "notitle, \\\n     'two.dat' index 2 using 1:2 with points pt 7 ps 0.55*scale lw 1.4 lc rgb "
                        "'#000000' notitle\nunset multiplot\nunset output\n"));
  // One entry: one row. 640 + 24 and 200 + 9.2 points = 7.38 cm.
  EXPECT_THAT(script, HasSubstr("svg size 860,664 "));
  EXPECT_THAT(script, HasSubstr("key_rows = 1\nkey_width = 0\npanel_top = 0.941\n"));  // 1 - (14.08 + 24.96)/664
  EXPECT_THAT(script, HasSubstr("size 8.6cm,7.38cm "));
}

// The key has three columns where there are more than four entries that are short enough for the sheet.
TEST(PictureScript, HasAsManyColumnsInItsKeyAsItsLabelsAllow) {
  const std::string path = std::getenv("PATH");
  ::setenv("PATH", "", 1);
  const auto rows = [](std::size_t entries, std::size_t letters) {
    const ScratchFolder folder;
    Picture picture{.x_label = "x", .y_label = "y", .x_low = 0.0, .x_high = 2.0};
    // A letter of two bytes counts as one.
    for (std::size_t k = 0; k < entries; ++k)
      picture.series.push_back({"φ" + std::string(letters - 1, 'a'), Style::line, 0, {0, 1}, {0, 1}, {}});
    EXPECT_THROW(drawn(picture, folder.path(), "p"), StageError) << "without gnuplot; the script is there";
    std::string found;
    const std::string script = read_text(folder / "p.gp");
    for (std::size_t at = 0; (at = script.find("key_rows = ", at)) != std::string::npos; ++at) {
      found += script.substr(at + 11, 1);
      found += script.find("key_width = -3", at) < script.find("panel_top", at) ? "n " : " ";
    }
    return found;
  };
  EXPECT_EQ(rows(4, 10), "2 2 ");
  EXPECT_EQ(rows(5, 14), "2 2 ");
  EXPECT_EQ(rows(7, 15), "3 4 ");
  EXPECT_EQ(rows(7, 18), "3 4 ");
  EXPECT_EQ(rows(7, 19), "3n 4 ");
  EXPECT_EQ(rows(7, 27), "3n 7 ");
  EXPECT_EQ(rows(7, 28), "4 7 ");
  EXPECT_EQ(rows(7, 44), "4 7 ");
  EXPECT_EQ(rows(7, 45), "7 7 ");
  ::setenv("PATH", path.c_str(), 1);
}

// gnuplot leaves out columns of the key that it finds too wide. A label stands in the file as a title and as a text.
TEST(PictureKey, HasEveryEntry) {
  const ScratchFolder folder;
  Drawings drawings(folder.path());
  const std::vector<std::size_t> lengths{27, 28, 44, 45, 60};
  const auto label = [](std::size_t letters, std::size_t k) {
    return std::to_string(k) + std::string(letters - 1, k == 2 ? 'e' : 'a');
  };
  for (const std::size_t letters : lengths) {
    Picture picture{.x_label = "x", .y_label = "y", .x_low = 0.0, .x_high = 2.0};
    for (std::size_t k = 0; k < 6; ++k)
      picture.series.push_back({label(letters, k), Style::line, 0, {0, 1}, {0, 1}, {}});
    drawings.add(picture, std::to_string(letters));
  }
  drawings.draw();
  for (const std::size_t letters : lengths) {
    const std::string svg = read_text(folder / (std::to_string(letters) + ".svg"));
    for (std::size_t k = 0; k < 6; ++k) {
      const std::size_t title = svg.find(label(letters, k));
      ASSERT_NE(title, std::string::npos);
      EXPECT_NE(svg.find(label(letters, k), title + 1), std::string::npos) << letters << " letters, entry " << k;
    }
  }
}

TEST(PictureScript, NeedsSomethingToDraw) {
  const ScratchFolder folder;
  EXPECT_THROW(drawn(Picture{.x_label = "x", .y_label = "y", .series = {{"empty", Style::line, 0, {}, {}, {}}}},
                     folder.path(), "p"),
               StageError);
  EXPECT_THROW(drawn(DiskPicture{.width = 3}, folder.path(), "d"), StageError);
}

// Those that one run of gnuplot draws are those drawn alone: the PDF to the byte, the SVG but for the colour of its
// empty groups, of which the first keeps that of the picture before. A script that cannot be drawn is named.
TEST(Drawings, AreThoseDrawnAlone) {
  const ScratchFolder folder;
  const Picture one{.x_label = "x",
                    .y_label = "y",
                    .title = "a title",
                    .series = {{"a", Style::line, 1, {1, 2}, {1, 100}, {}}},
                    .bands = {{1.2, 1.5}},
                    .logarithmic_y = true};
  const Picture two{.x_label = "u", .y_label = "v", .series = {{"b", Style::points, 2, {1, 9}, {2, 5}, {}}}};
  Drawings both(folder.path());
  both.add(one, "one");
  both.add(two, "two");
  both.draw();
  std::filesystem::create_directory(folder / "alone");
  drawn(one, folder / "alone", "one");
  drawn(two, folder / "alone", "two");
  const auto svg = [](const std::filesystem::path& file) {
    return std::regex_replace(read_text(file), std::regex("(<g [^>]*) stroke=\"[^\"]*\"([^>]*>\n</g>)"), "$1$2");
  };
  for (const std::string name : {"one", "two"}) {
    EXPECT_EQ(read_text(folder / (name + ".pdf")), read_text(folder / ("alone/" + name + ".pdf")));
    EXPECT_EQ(svg(folder / (name + ".svg")), svg(folder / ("alone/" + name + ".svg")));
    EXPECT_EQ(read_text(folder / (name + ".gp")), read_text(folder / ("alone/" + name + ".gp")));
  }
  both.add_script("bad", "no such command\n");
  both.add(one, "late");
  try {
    both.draw();
    FAIL() << "a script that is none was drawn";
  } catch (const StageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("gnuplot could not draw bad.gp (exit code "));
  }
}

// Disks to scale: the axis ends above the highest disk, 3.2 + 0.5 + 0.5, at 5. The sheet is (4.2... of the highest rim
// 3.7 + 8)/(width 6 + 10) = 0.73125 of its width high: 628.9 of 860 pixels, 178.3 of 243.8 points = 6.29 cm.
TEST(DiskScript, DrawsDisksAndCrosses) {
  const ScratchFolder folder;
  drawn(DiskPicture{.width = 6,
                    .x = {1, 2.5},
                    .y = {0.5, 3.2},
                    .radius = {0.5, 0.5},
                    .color = {0.25, 1},
                    .cross_x = {4},
                    .cross_y = {2},
                    .x_label = "x/D",
                    .y_label = "z/D",
                    .color_label = "order",
                    .cross_label = "empty_site"},
        folder.path(), "d");
  EXPECT_EQ(read_text(folder / "d.dat"),
            "# disks: x y radius color\n1 0.5 0.5 0.25\n2.5 3.2 0.5 1\n\n\n# crosses: x y\n4 2\n\n\n");
  const std::string script = read_text(folder / "d.gp");
  EXPECT_THAT(script, HasSubstr("set xlabel 'x/D'\nset ylabel 'z/D'\nset cblabel 'order'\nset xrange [0:6]\n"
                                "set yrange [0:5]\nset size ratio -1\n"));
  EXPECT_THAT(script,
              HasSubstr("set cbrange [0:1]\nset palette defined (0 '#00224e', 0.25 '#3b496c', 0.5 '#7b7b78', 0.75 "
                        "'#bcae6c', 1 '#fee838')\n"));
  EXPECT_THAT(script,
              HasSubstr("plot 'd.dat' index 0 using 1:2:3:4 with circles lc palette lw 0.5 notitle, 'd.dat' index 1 "
                        "using 1:2 with points pt 2 ps 1.3*scale lw 3 lc rgb '#D55E00' title 'empty\\_site'\n"));
  EXPECT_THAT(script, HasSubstr("svg size 860,629 "));
  EXPECT_THAT(script, HasSubstr("size 8.6cm,6.29cm "));
}

// Cells with two marks, on an axis of decades from 1 to 20.
TEST(CellScript, DrawsCellsAndMarks) {
  const ScratchFolder folder;
  Drawings drawings(folder.path());
  drawings.add(MapPicture{.name = "m",
                          .data = "1 1 0.5 1.5 0.5 1.5 3\n20 1 10 30 0.5 1.5 4\n\n\n1 1\n\n\n20 1\n",
                          .x_label = "x",
                          .y_label = "y",
                          .value_label = "T",
                          .value_low = 2.5,
                          .decades_x = std::pair(1.0, 20.0),
                          .marks = {{"a_b", 1}, {"c", 5}}});
  drawings.draw();
  const std::string script = read_text(folder / "m.gp");
  EXPECT_THAT(script, HasSubstr("set cblabel 'T'\n"));
  EXPECT_THAT(script, HasSubstr("set cbrange [2.5:*]\n"));
  EXPECT_THAT(script,
              HasSubstr("set logscale x\nset xtics (0.5, 1, 2, 5, 10, 20)\nplot 'm.dat' index 0 using 1:2:3:4:5:6:7 "
                        "with boxxyerror lc palette notitle, "
                        "'m.dat' index 1 using 1:2 with points pt 2 ps 1.0*scale lw 4 lc rgb '#ffffff' notitle, "
                        "'m.dat' index 1 using 1:2 with points pt 2 ps 0.7*scale lw 2 lc rgb '#D55E00' title 'a\\_b', "
                        "'m.dat' index 2 using 1:2 with points pt 7 ps 1.0*scale lw 4 lc rgb '#ffffff' notitle, "
                        "'m.dat' index 2 using 1:2 with points pt 7 ps 0.7*scale lw 2 lc rgb '#D55E00' title 'c'\n"));
  EXPECT_THAT(script, Not(HasSubstr("logscale y")));
  EXPECT_THAT(script, HasSubstr("svg size 860,560 "));
  EXPECT_THAT(script, HasSubstr("size 8.6cm,6.00cm "));  // 170 points
}

}  // namespace
