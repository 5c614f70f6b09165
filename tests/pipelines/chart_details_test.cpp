// What charts and maps draw at the edges of their options: pooled errors, axes, curves, crossings, cells, limits.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::chart_details {
namespace {

using pipelines::find_stage;
using pipelines::Json;
using pipelines::number_text;
using testing::HasSubstr;
using testing::Not;

class ChartDetails : public testing::Test {
 protected:
  ChartDetails() { chart_.add_input("beds", *find_stage("study")); }
  void table(const std::string& text) { write_text(chart_.file("table.csv"), text); }
  Json draw(const std::string& points, const std::string& curves = "", const std::string& more = "") {
    return chart_.run(
        R"({ "charts": [ { "name": "c", "x_label": "x", "y_label": "y", "points": [ { "name": "p", "x": "x",
        "y": "y" )" +
        points + " } ]" + (curves.empty() ? "" : ", \"curves\": [ " + curves + " ]") + more + " } ] }")["c"]["p"];
  }
  Json map(const std::string& keys) {
    return chart_.run(R"({ "maps": [ { "name": "m", "x": "x", "y": "y", "value": "v", "x_label": "X", "y_label": "Y",
        "value_label": "V" )" +
                      keys + " } ] }")["m"];
  }
  std::string output(const std::string& name) const { return read_text(chart_.output(name)); }
  LoneStage chart_{*find_stage("chart")};
};

// The errors 1 to 5, of each point the root mean square of it and its neighbours; at the ends, of the first or last
// ones.
TEST_F(ChartDetails, PoolTheErrorsOfNeighbours) {
  table("x,y,y_error\n1,0,1\n2,0,2\n3,0,3\n4,0,4\n5,0,5\n");
  std::string sets;
  for (int pool = 2; pool <= 5; ++pool)
    sets += fmt::format(R"( }}, {{ "name": "p{0}", "label": "pool {0}", "x": "x", "y": "y", "pool": {0})", pool);
  draw(sets + R"( }, { "name": "q", "label": "pool 1000", "x": "x", "y": "y", "pool": 1000)");
  const std::string data = output("c.dat");
  const auto squares = [&](const std::string& label, int pool) {
    std::istringstream lines(data.substr(data.find("# " + label + "\n# x y std_error\n")));
    std::string all, line;
    std::getline(lines, line), std::getline(lines, line);
    double x = 0, y = 0, spread = 0;
    while (lines >> x >> y >> spread) all += std::to_string(std::lround(spread * spread * pool)) + " ";
    return all;
  };
  EXPECT_EQ(squares("", 1), "1 4 9 16 25 ");
  EXPECT_EQ(squares("pool 2", 2), "5 5 13 25 41 ");
  EXPECT_EQ(squares("pool 3", 3), "14 14 29 50 50 ");
  EXPECT_EQ(squares("pool 4", 4), "30 30 30 54 54 ");
  EXPECT_EQ(squares("pool 5", 5), "55 55 55 55 55 ");
  EXPECT_EQ(squares("pool 1000", 5), "55 55 55 55 55 ");
  EXPECT_THROW(draw(R"(, "pool": 0)"), std::runtime_error);
  EXPECT_THROW(draw(R"(, "pool": 1001)"), std::runtime_error);
}

// A curve without a label or with the look "none" is only compared with.
TEST_F(ChartDetails, DrawTheCurvesThatAreToBeSeen) {
  table("x,y\n0,1\n1,3\n");
  const auto drawn = [&](const std::string& keys) {
    draw(R"(, "against": "law", "label": "P")", R"({ "name": "law", "polynomial": [1, 2] )" + keys + " }");
    EXPECT_THAT(output("c.gp"), HasSubstr("title 'P'"));
    return output("c.gp").find("index 1 ") != std::string::npos;
  };
  EXPECT_TRUE(drawn(R"(, "label": "L")"));
  EXPECT_THAT(output("c.gp"), HasSubstr("index 1 using 1:2 with lines lw 2 lc rgb '#000000' title 'L'"));
  EXPECT_THAT(output("c.dat"), HasSubstr("# L\n# x y\n0 1\n0.005 1.01\n"));
  EXPECT_FALSE(drawn(""));
  EXPECT_FALSE(drawn(R"(, "label": "L", "look": "none")"));
  EXPECT_TRUE(drawn(R"(, "label": "L", "look": "dotted", "color": 2)"));
  EXPECT_THAT(output("c.gp"), HasSubstr("with lines lw 1.6 dashtype 3 lc rgb '#D55E00' title 'L'"));
}

TEST_F(ChartDetails, HaveTheirAxes) {
  table("x,y\n10,0.02\n20,0.5\n-5,3\n0,1\n");
  draw(R"(, "look": "line")", "", R"(, "x_high": 30, "y_low": 0.01)");
  EXPECT_THAT(output("c.gp"), HasSubstr("set ylabel 'y'\nset xrange [*:30]\nset yrange [0.01:*]\nset border"));
  EXPECT_THAT(output("c.gp"), HasSubstr("set xlabel 'x'\n"));
  EXPECT_THAT(output("c.gp"), HasSubstr("index 0 using 1:2 with lines lw 2 lc rgb '#0072B2'"));
  EXPECT_THAT(output("c.gp"), Not(HasSubstr("logscale")));
  draw("", "", R"(, "logarithmic_x": true)");
  EXPECT_THAT(output("c.gp"), HasSubstr("set logscale x\nset xtics (5, 10, 20)\nset border"));
  draw("", "", R"(, "logarithmic_y": true)");
  EXPECT_THAT(output("c.gp"),
              HasSubstr("set logscale y\nset ytics (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5)\nset border"));
}

// The panel of differences is called so, and begins and ends where its curve does, both ends included.
TEST_F(ChartDetails, HaveDifferencesWhereTheCurveIs) {
  table("x,y\n1,1\n2,2\n3,3\n4,4\n");
  const std::string asked = R"(, "against": "law", "residuals": true, "error": "none")";
  draw(asked, R"({ "name": "law", "polynomial": [2], "from": 2, "to": 3 })");
  EXPECT_THAT(output("c.dat"), HasSubstr("# zero\n# x y\n2 0\n3 0\n\n\n# \n# x y\n2 0\n3 1\n\n\n"));
  EXPECT_THAT(output("c.gp"), HasSubstr("set ylabel 'difference'\n"));
  EXPECT_THAT(output("c.gp"), HasSubstr("set multiplot"));
  // A curve that ends before the points has no panel; by itself it goes from 0 to 1.
  draw(asked, R"({ "name": "law", "polynomial": [2], "from": -1, "to": 0.5 })");
  EXPECT_THAT(output("c.gp"), Not(HasSubstr("multiplot")));
  draw(asked, R"({ "name": "law", "polynomial": [2] })");
  EXPECT_THAT(output("c.dat"), HasSubstr("# zero\n# x y\n0 0\n1 0\n\n\n# \n# x y\n1 -1\n\n\n"));
}

// From above, from below, on a point; y at the level itself counts as below. Of two crossings the first.
TEST_F(ChartDetails, FindTheFirstCrossing) {
  table("x,y,y_error\n0,3,0.2\n2,1,0.1\n4,5,0.4\n6,2,0.3\n");
  const Json found = draw(R"(, "levels": [2, 3, 4, 1, 5, 0.5])")["crossings"];
  EXPECT_NEAR(value(found["2"]), 1, 1e-14);
  EXPECT_NEAR(error(found["2"]), std::hypot(0.5 * 0.2, 0.5 * 0.1) / 1, 1e-14);
  EXPECT_NEAR(value(found["3"]), 3, 1e-14);
  EXPECT_NEAR(error(found["3"]), std::hypot(0.5 * 0.1, 0.5 * 0.4) / 2, 1e-14);
  EXPECT_NEAR(value(found["4"]), 3.5, 1e-14);
  EXPECT_NEAR(error(found["4"]), std::hypot(0.25 * 0.1, 0.75 * 0.4) / 2, 1e-14);
  EXPECT_NEAR(value(found["1"]), 2, 1e-14);
  EXPECT_NEAR(error(found["1"]), 0.1, 1e-14);
  EXPECT_TRUE(found["5"]["value"].is_null() && found["0.5"]["value"].is_null());
}

// A flat line crosses zero nowhere; two points make a line and leave no freedom; one makes none.
TEST_F(ChartDetails, FitLinesOfFewPoints) {
  table("x,y,y_error\n1,2,0.1\n3,2,0.1\n");
  const Json flat = draw(R"(, "line_fit": true, "power_fit": true)");
  EXPECT_EQ(flat["line_fit"], "ok");
  EXPECT_EQ(value(flat["slope"]), 0);
  EXPECT_EQ(flat["dof"], 0);
  EXPECT_FALSE(flat.contains("zero"));
  EXPECT_EQ(flat["power"]["status"],
            "not fitted: the fit needs four points with x > 0 and with errors, and an exponent between 0.1 and 6");
  EXPECT_FALSE(flat["power"].contains("law"));
  const Json one = draw(R"(, "line_fit": true, "fit_least": 3)");
  EXPECT_EQ(one["line_fit"], "not fitted: the line needs two points with errors");
  EXPECT_EQ(one["points"], 2) << "drawn are both";
  EXPECT_FALSE(one.contains("slope") || one.contains("power") || one.contains("against") || one.contains("crossings"));
}

// What has no finite factor or no logarithm is left out; a limit is one of x after its factor and sum.
TEST_F(ChartDetails, LeaveOutWhatHasNoNumber) {
  table("x,y,y_error\n0,1,1\n1,2,1\n2,-4,1\n4,8,1\n,3,1\n5,,1\n6,2,\n");
  draw(R"(, "power_of_x": -1)");
  EXPECT_THAT(output("c.dat"), HasSubstr("# x y std_error\n1 2 1\n2 -2 0.5\n4 2 0.25\n6 0.3333333333333333 0\n\n"));
  draw(R"(, "power_of_x": 1, "x_plus": -1, "x_least": 0, "x_most": 3)");
  EXPECT_THAT(output("c.dat"), HasSubstr("# x y std_error\n0 0 0\n1 -4 1\n3 24 3\n\n"));
  draw(R"(, "logarithm": true, "times": 0.5, "x_least": 1)");
  EXPECT_THAT(output("c.dat"),
              HasSubstr("# x y std_error\n1 0 0.5\n4 " + number_text(std::log(4)) + " 0.125\n6 0 0\n"));
}

// What may be null, as it is stated before a run: what a curve, a fit or a level may not give.
TEST_F(ChartDetails, StateWhatMayBeNull) {
  chart_.read(R"({ "charts": [ { "name": "c", "x_label": "x", "y_label": "y", "points": [ { "name": "p", "x": "x",
      "y": "y", "line_fit": true, "power_fit": true, "levels": [2], "against": "l" } ],
      "curves": [ { "name": "l", "polynomial": [1] } ] } ] })");
  std::string nulls, texts;
  for (const pipelines::StatedResult& one : chart_.stated().all()) {
    if (one.may_be_null) nulls += one.pointer.substr(one.pointer.find("/p/") + 2) + " ";
    if (one.kind == pipelines::ResultKind::text) texts += one.pointer.substr(one.pointer.find("/p/") + 2) + " ";
  }
  std::string laws;
  for (const std::string law : {"/power/law/", "/power/given/1/", "/power/given/2/"})
    for (const char* key : {"amplitude ", "offset ", "chi2 ", "dof ", "p_value "}) laws += law + key;
  EXPECT_EQ(nulls, "/p_value /power/exponent " + laws +
                       "/against/chi2 /against/p_value /against/mean_difference /against/rms_difference "
                       "/against/largest_difference /crossings/2 ");
  EXPECT_THAT(texts, HasSubstr("/line_fit /power/status /against/curve "));
}

// --- maps

// Uneven places: edges half way, the outer cells as far out as in. One place alone: half a unit to each side.
TEST_F(ChartDetails, MapsHaveCellsHalfWayToTheirNeighbours) {
  table("x,y,v,s\n1,7,1,a\n2,7,2,a\n5,7,3,b\n");
  const Json found = map(R"(, "caption": "cap", "lead": true, "value_low": 0.5, "value_high": 4)");
  EXPECT_EQ(
      output("m.dat"),
      "# x y x_low x_high y_low y_high value\n1 7 0.5 1.5 6.5 7.5 1\n2 7 1.5 3.5 6.5 7.5 2\n5 7 3.5 6.5 6.5 7.5 3\n");
  EXPECT_EQ(found, Json::parse(R"({ "cells": 3, "caption": "cap", "lead": true })"));
  EXPECT_THAT(output("m.gp"), HasSubstr("set xlabel 'X'\nset ylabel 'Y'\nset cblabel 'V'\n"));
  EXPECT_THAT(output("m.gp"), HasSubstr("set cbrange [0.5:4]\n"));
  EXPECT_THAT(output("m.gp"), Not(HasSubstr("logscale")));
  const Json some = map(R"(, "where": { "s": "a" })");
  EXPECT_EQ(some, Json::parse(R"({ "cells": 2 })"));
  EXPECT_THAT(output("m.gp"), HasSubstr("set cbrange [*:*]\n"));
  try {
    map(R"(, "where": { "s": "c" })");
    FAIL();
  } catch (const pipelines::InputError& none) {
    EXPECT_THAT(none.what(), HasSubstr("the map \"m\" draws no row of this table; check its \"where\""));
  }
}

// On an axis of decades half way is in the logarithm, and one place alone is a tenth of it wide to each side.
TEST_F(ChartDetails, MapsOfDecadesHaveTheirCellsInTheLogarithm) {
  table("x,y,v\n3,1,1\n3,100,2\n");
  map(R"(, "logarithmic_x": true, "logarithmic_y": true)");
  std::istringstream lines(output("m.dat"));
  std::string head;
  std::getline(lines, head);
  for (const double y : {1.0, 100.0}) {
    double cell[7];
    for (double& number : cell) lines >> number;
    EXPECT_NEAR(cell[2], 3 * std::exp(-0.1), 1e-13);
    EXPECT_NEAR(cell[3], 3 * std::exp(0.1), 1e-13);
    EXPECT_NEAR(cell[4], y / 10, 1e-12);
    EXPECT_NEAR(cell[5], y * 10, 1e-10);
  }
  EXPECT_THAT(output("m.gp"), HasSubstr("set logscale y\n"));
  EXPECT_THAT(output("m.gp"), HasSubstr("set ytics (0.5, 1, 2, 5, 10, 20, 50, 100, 200)\n"));
}

// Marks: both limits count as within; a cell without a number in their column has none. The second keeps its symbol
// where the first marks nothing.
TEST_F(ChartDetails, MapsMarkWithinLimits) {
  table("x,y,v,t\n1,1,1,3\n2,1,2,4\n3,1,3,5\n4,1,4,\n");
  const Json found = map(R"(, "marks": [ { "label": "none", "where": { "t": { "least": 5.5 } } },
      { "label": "some", "where": { "t": { "least": 4, "most": 5 } } },
      { "label": "any", "where": { "t": {} } } ])");
  EXPECT_EQ(found["marked"], Json::parse(R"({ "none": 0, "some": 2, "any": 3 })"));
  EXPECT_THAT(output("m.dat"), HasSubstr("\n\n\n# some: x y\n2 1\n3 1\n\n\n# any: x y\n1 1\n2 1\n3 1\n"));
  const std::string script = output("m.gp");
  EXPECT_THAT(script, HasSubstr("index 1 using 1:2 with points pt 2 ps 0.7*scale lw 2 lc rgb '#D55E00' title 'some'"));
  EXPECT_THAT(script, HasSubstr("index 2 using 1:2 with points pt 8 ps 0.7*scale lw 2 lc rgb '#D55E00' title 'any'"));
  EXPECT_THAT(script, Not(HasSubstr("index 3 ")));
}

}  // namespace
}  // namespace shakebed::tests::chart_details
