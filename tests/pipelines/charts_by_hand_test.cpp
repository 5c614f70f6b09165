// What charts, maps, snapshots and figures draw of tables made by hand, and mistakes in their options.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;
using testing::Not;

class ChartsByHand : public testing::Test {
 protected:
  ChartsByHand() {
    chart_.add_input("beds", *find_stage("study"));
    write_text(
        chart_.file("table.csv"),
        "series,x,y,y_error,dy,std_error\nb,3,9,1,0.5,2\na,1,2,1,0.5,2\na,2,5,1,,2\na,4,-1,1,0.5,2\na,5,11,1,0.5,2\n");
  }
  Json draw(const std::string& points, const std::string& curves = "", const std::string& more = "") {
    return chart_.run(R"({ "charts": [ { "name": "c", "x_label": "x", "y_label": "y", "points": [ )" + points + " ]" +
                      (curves.empty() ? "" : ", \"curves\": [ " + curves + " ]") + more + " } ] }")["c"];
  }
  std::string data() const { return read_text(chart_.output("c.dat")); }
  std::string script() const { return read_text(chart_.output("c.gp")); }
  LoneStage chart_{*find_stage("chart")};
};

// In the order of x; of the limits both ends count. Errors: y_error, else std_error, else those named, or none.
TEST_F(ChartsByHand, HaveTheirPointsAndErrors) {
  const Json found =
      draw(R"({ "name": "p", "x": "x", "y": "y", "label": "T_c", "x_least": 2, "x_most": 4, "times": 2, "plus": 1 },
                             { "name": "q", "x": "x", "y": "y", "error": "dy", "where": { "series": "a" }, "x_times": 10, "x_plus": 1 },
                             { "name": "r", "x": "x", "y": "dy", "look": "points" },
                             { "name": "s", "x": "x", "y": "y", "error": "none", "look": "dotted", "color": 5 },
                             { "name": "t", "x": "x", "y": "y", "logarithm": true, "look": "dashed" },
                             { "name": "u", "x": "x", "y": "y", "look": "none" },
                             { "name": "v", "x": "x", "y": "y" })",
           "", R"(, "caption": "why", "lead": true, "x_low": 0.5, "y_high": 30)");
  EXPECT_EQ(data(),
            "# T_c\n# x y std_error\n2 11 2\n3 19 2\n4 -1 2\n\n\n"
            "# \n# x y std_error\n11 2 0.5\n21 5 0\n41 -1 0.5\n51 11 0.5\n\n\n"
            "# \n# x y std_error\n1 0.5 2\n3 0.5 2\n4 0.5 2\n5 0.5 2\n\n\n"
            "# \n# x y\n1 2\n2 5\n3 9\n4 -1\n5 11\n\n\n"
            "# \n# x y\n1 " +
                number_text(std::log(2)) + "\n2 " + number_text(std::log(5)) + "\n3 " + number_text(std::log(9)) +
                "\n5 " + number_text(std::log(11)) +
                "\n\n\n"
                "# \n# x y std_error\n1 2 1\n2 5 1\n3 9 1\n4 -1 1\n5 11 1\n\n\n");
  EXPECT_EQ(found["p"]["points"], 3);
  EXPECT_EQ(found["u"]["points"], 5);
  EXPECT_EQ(found["caption"], "why");
  EXPECT_EQ(found["lead"], true);
  EXPECT_THAT(script(), HasSubstr("set xrange [0.5:*]\nset yrange [*:30]\n"));
  // Filled symbols and colours one after another, from colour 1 on, unless one is given; labels with subscripts.
  EXPECT_THAT(script(),
              HasSubstr("index 0 using 1:2 with points pt 7 ps 0.55*scale lw 1.4 lc rgb '#0072B2' title 'T_c'"));
  EXPECT_THAT(script(), HasSubstr("index 2 using 1:2 with points pt 9 ps 0.55*scale lw 1.4 lc rgb '#009E73'"));
  EXPECT_THAT(script(), HasSubstr("index 3 using 1:2 with lines lw 1.6 dashtype 3 lc rgb '#E69F00'"));
  EXPECT_THAT(script(), HasSubstr("index 4 using 1:2 with lines lw 2 dashtype 2 lc rgb '#CC79A7'"));
  EXPECT_THAT(script(), HasSubstr("index 5 using 1:2 with points pt 13 ps 0.55*scale lw 1.4 lc rgb '#E69F00'"));
}

// The curve (1 + 2 x) sqrt(x) at 201 places from 1 to 3; differences from it only there, below the points.
TEST_F(ChartsByHand, HaveCurvesAndDifferences) {
  draw(
      R"({ "name": "p", "x": "x", "y": "y", "label": "L", "against": "law", "residuals": true },
          { "name": "q", "x": "x", "y": "y", "look": "line", "against": "law", "residuals": true, "x_least": 4 })",
      R"({ "name": "law", "label": "c_1", "polynomial": [1, 2], "exponent": 0.5, "from": 1, "to": 3, "color": 3, "look": "dashed" },
          { "name": "silent", "polynomial": [1] })",
      R"(, "residual_label": "off")");
  const std::string text = data();
  const auto law = [](double x) { return (1 + 2 * x) * std::sqrt(x); };
  EXPECT_THAT(text, HasSubstr("# c_1\n# x y\n1 3\n1.01 " + number_text(law(1.01)) + "\n1.02 "));
  EXPECT_THAT(text, HasSubstr("\n3 " + number_text(law(3)) + "\n\n\n"));
  EXPECT_THAT(text, HasSubstr("# zero\n# x y\n1 0\n3 0\n\n\n# L\n# x y std_error\n1 -1 1\n2 " +
                              number_text(5 - law(2)) + " 1\n3 " + number_text(9 - law(3)) + " 1\n\n\n"));
  EXPECT_EQ(text.substr(text.find("# zero")).find("# \n"), std::string::npos) << "4 and 5 lie beyond the curve";
  EXPECT_THAT(script(), HasSubstr("set ylabel 'off'\n"));
  EXPECT_THAT(script(), HasSubstr("with lines lw 2 dashtype 2 lc rgb '#009E73' title 'c_1'"));
}

// Of one point the error of the mean difference is its own; without errors there is none.
TEST_F(ChartsByHand, AreComparedAlsoOfOnePointAndOfNone) {
  const std::string line = R"({ "name": "line", "polynomial": [0, 2] })";
  const auto against = [&](const std::string& keys) {
    return draw(R"({ "name": "p", "x": "x", "y": "y", "against": "line", )" + keys + " }", line)["p"]["against"];
  };
  const Json one = against(R"("fit_least": 3, "fit_most": 3)");
  EXPECT_EQ(one["points"], 1);
  EXPECT_EQ(value(one["mean_difference"]), 3);
  EXPECT_EQ(error(one["mean_difference"]), 1);
  EXPECT_EQ(one["dof"], 1);
  EXPECT_EQ(one["chi2"], 9);
  const Json bare = against(R"("fit_least": 3, "fit_most": 3, "error": "none")");
  EXPECT_FALSE(bare["mean_difference"].contains("std_error"));
  EXPECT_FALSE(bare["rms_difference"].contains("std_error"));
  EXPECT_FALSE(bare.contains("chi2"));
  const Json none = against(R"("fit_least": 9)");
  EXPECT_EQ(none["points"], 0);
  EXPECT_TRUE(none["mean_difference"].is_null() && none["chi2"].is_null());
  // A number below 0 has no logarithm of a ratio; one point without an error takes the weights away.
  EXPECT_FALSE(against(R"("fit_least": 3)").contains("rms_log_ratio"));
  EXPECT_TRUE(against(R"("fit_most": 3)").contains("rms_log_ratio"));
  EXPECT_FALSE(against(R"("error": "dy")").contains("chi2"));
  EXPECT_TRUE(against(R"("error": "dy", "fit_least": 3)").contains("chi2"));
}

// All bonds of a hexagon and its middle lie at multiples of 60 degrees: |psi_6| = 1 of all seven. A lone disk has 0.
TEST_F(ChartsByHand, SnapshotsCountTheirCrystal) {
  LoneStage chart(*find_stage("chart"));
  chart.add_input("bed", *find_stage("simulate"));
  TrajectoryFrame frame;
  frame.width = 20, frame.height = 9;
  for (int k = 0; k < 6; ++k)
    frame.x.push_back(5 + std::cos(k * M_PI / 3)), frame.z.push_back(4 + std::sin(k * M_PI / 3));
  frame.x.push_back(5), frame.z.push_back(4), frame.x.push_back(12), frame.z.push_back(4);
  frame.vx.assign(8, 0), frame.vz.assign(8, 0);
  TrajectoryWriter writer(chart.file("final.extxyz"));
  writer.write(frame);
  writer.close();
  std::vector<Problem> problems;
  const Json found = [&] {
    const auto node =
        parse_json(R"({ "snapshots": [ { "name": "s", "from": "bed", "caption": "cap" } ] })", "o", problems);
    Fields fields = Fields::decode(
        *node, "", Fields::Source{.file = "o", .problems = &problems, .from = {{"bed", "simulate", nullptr}}});
    std::unique_ptr<Stage> stage = find_stage("chart")->make();
    stage->describe(fields);
    stage->run(chart);
    return read_json(chart.output("chart.json"))["s"];
  }();
  EXPECT_EQ(found["disks"], 8);
  EXPECT_EQ(found["disks_with_psi6_above_0.8"], 7);
  EXPECT_EQ(found["caption"], "cap");
  const std::string text = read_text(chart.output("s.dat"));
  EXPECT_THAT(text, HasSubstr("\n5 4 0.5 1\n12 4 0.5 0\n"));
}

// --- mistakes, with what the stages before it give

std::string told(const char* kind, const std::string& options, const std::vector<StatedStage>& from) {
  std::vector<Problem> problems;
  const auto node = parse_json(options, "o", problems);
  Fields::Source source{.file = "o", .problems = &problems, .from = from};
  for (const StatedStage& stage : from) source.upstream.emplace_back(stage.kind);
  Fields fields = Fields::decode(*node, "", source);
  find_stage(kind)->make()->describe(fields);
  fields.finish();
  std::string all;
  for (const Problem& one : problems)
    all += (all.empty() ? "" : " | ") + one.pointer + ": " + one.what +
           (one.suggestion.empty() ? "" : ". " + one.suggestion);
  return all;
}
ResultList study_results() {
  ResultList list;
  list.table({"table.csv",
              "points",
              {{"series", "", "kind", {"one", "two"}},
               {"x", "1", "x"},
               {"y", "1", "y"},
               {"y_error", "1", "error"},
               {"z", "1", "z"}}});
  return list;
}

TEST(ChartMistakes, AreNamed) {
  const ResultList results = study_results();
  const std::vector<StatedStage> one{{"beds", "study", &results}},
      two{{"beds", "study", &results}, {"more", "study", &results}};
  const auto points = [&](const std::string& keys, const std::vector<StatedStage>& from, const std::string& more = "") {
    return told(
        "chart",
        R"({ "charts": [ { "name": "c", "x_label": "x", "y_label": "y", "points": [ { "name": "p", "x": "x", "y": "y", )" +
            keys + " } ]" + more + " } ] }",
        from);
  };
  const std::string at = "/charts/0/points/0";
  EXPECT_EQ(points(R"("label": "")", one), "");
  EXPECT_EQ(
      points(R"("label": "")", two),
      at + "/from: \"from\" of the stage names several stages: give here the id of the stage whose table is drawn. "
           "Choose from: beds, more");
  EXPECT_EQ(points(R"("from": "bed")", two),
            at + "/from: \"bed\" is not in the \"from\" of this stage. Did you mean \"beds\"?");
  EXPECT_THAT(points(R"("file": "tables.csv")", one), HasSubstr(at + "/file: "));
  EXPECT_THAT(points(R"("error": "y_eror")", one),
              HasSubstr(at + "/error: table.csv has no column \"y_eror\". Did you mean \"y_error\"?"));
  EXPECT_EQ(points(R"("error": "none")", one), "");
  EXPECT_EQ(points(R"("where": { "series": "onee" })", one),
            at + "/where/series: no row of table.csv has \"onee\" in the column series. Did you mean \"one\"?");
  EXPECT_EQ(points(R"("where": { "series": "zzzzz" })", one),
            at + "/where/series: no row of table.csv has \"zzzzz\" in the column series. Choose from: one, two");
  EXPECT_EQ(points(R"("where": { "series": "two", "x": 3 })", one), "");
  EXPECT_THAT(points(R"("where": { "w": "1" })", one), HasSubstr(at + "/where/w: table.csv has no column \"w\""));
  EXPECT_EQ(points(R"("where": 3)", one), at + "/where: expected an object: column → text");
  EXPECT_THAT(points(R"("residuals": true)", one),
              HasSubstr(at + "/residuals: residuals need a curve, and \"against\" names none"));
  EXPECT_THAT(points(R"("residuals": true, "look": "none", "against": "l")", one,
                     R"(, "curves": [ { "name": "l", "polynomial": [1] } ])"),
              HasSubstr(at + "/residuals: residuals are drawn only of points that are drawn"));
  EXPECT_EQ(points(R"("against": "m")", one, R"(, "curves": [ { "name": "l", "polynomial": [1] } ])"),
            at + "/against: this chart has no curve \"m\"");
  EXPECT_EQ(told("chart", "{}", one), ": there is nothing to draw: no charts, no maps, no snapshots");
  EXPECT_EQ(
      told("chart", R"({ "charts": [ { "name": ".c", "x_label": "x", "y_label": "y", "points": [] } ] })", one),
      "/charts/0/name: \".c\" cannot be the name of a file. Use no spaces and slashes, and no dot at the beginning | "
      "/charts/0/points: \"points\" is empty: give at least one data set");
  EXPECT_EQ(told("chart", R"({ "snapshots": [ { "name": "s", "from": "beds" } ] })",
                 {{"beds", "study", &results}, {"bed", "simulate", nullptr}}),
            "/snapshots/0/from: \"beds\" is not a simulate stage in the \"from\" of this stage. Did you mean \"bed\"?");
  const auto map = [&](const std::string& keys, const std::vector<StatedStage>& from) {
    return told("chart",
                R"({ "maps": [ { "name": "m", "x_label": "x", "y_label": "y", "value_label": "v", )" + keys + " } ] }",
                from);
  };
  EXPECT_EQ(map(R"("x": "x", "y": "y", "value": "z")", one), "");
  EXPECT_THAT(map(R"("x": "x", "y": "yy", "value": "z")", one), HasSubstr("/maps/0/y: "));
  EXPECT_THAT(map(R"("x": "w", "y": "y", "value": "z")", one), HasSubstr("/maps/0/x: "));
  EXPECT_THAT(map(R"("x": "x", "y": "y", "value": "w", "where": { "q": "1" })", one), HasSubstr("/maps/0/where/q: "));
  EXPECT_THAT(map(R"("x": "x", "y": "y", "value": "z", "marks": [ { "label": "l", "where": { "q": {} } } ])", one),
              HasSubstr("/maps/0/marks/0/where/q: "));
  EXPECT_THAT(map(R"("x": "x", "y": "y", "value": "z")", two),
              HasSubstr("/maps/0/from: \"from\" of the stage names several stages"));
}

TEST(ScalingMistakes, AreNamed) {
  const ResultList results = study_results();
  const std::vector<StatedStage> one{{"beds", "study", &results}},
      two{{"beds", "study", &results}, {"more", "study", &results}};
  const auto fit = [&](const std::string& keys, const std::vector<StatedStage>& from) {
    return told("scaling", R"({ "fits": [ { "name": "f", )" + keys + " } ] }", from);
  };
  EXPECT_EQ(
      fit(R"("y": "y", "powers": ["x"], "each": ["z"], "series": ["one"], "within": { "x": { "least": 1 } })", one),
      "");
  EXPECT_EQ(fit(R"("y": "y", "powers": [])", one), "/fits/0/powers: \"powers\" is empty: give at least one column");
  EXPECT_THAT(fit(R"("y": "x", "powers": ["y"])", one), HasSubstr("/fits/0/y: table.csv has no column \"x_error\""));
  EXPECT_THAT(fit(R"("y": "y", "powers": ["x", "xx"])", one), HasSubstr("/fits/0/powers/1: "));
  EXPECT_THAT(fit(R"("y": "y", "powers": ["x"], "each": ["zz"])", one), HasSubstr("/fits/0/each/0: "));
  EXPECT_THAT(fit(R"("y": "y", "powers": ["x"], "within": { "w": {} })", one), HasSubstr("/fits/0/within/w: "));
  EXPECT_EQ(fit(R"("y": "y", "powers": ["x"], "series": ["one", "twoo"])", one),
            "/fits/0/series/1: the study has no series \"twoo\". Did you mean \"two\"?");
  EXPECT_EQ(fit(R"("y": "y", "powers": ["x"], "series": ["zzzzz"])", one),
            "/fits/0/series/0: the study has no series \"zzzzz\". Choose from: one, two");
  EXPECT_THAT(fit(R"("y": "y", "powers": ["x"])", two),
              HasSubstr("/fits/0/from: \"from\" of the stage names several studies"));
  EXPECT_THAT(fit(R"("y": "y", "powers": ["x"], "from": "no")", two),
              HasSubstr("/fits/0/from: \"no\" is not in the \"from\" of this stage"));
  EXPECT_EQ(fit(R"("y": "y", "powers": ["x"], "from": "more")", two), "");
  EXPECT_EQ(
      told("scaling",
           R"({ "fits": [ { "name": "f", "y": "y", "powers": ["x"] }, { "name": "f", "y": "y", "powers": ["x"] } ] })",
           one),
      "/fits/1/name: two fits are named \"f\"");
}

TEST(CriticalMistakes, AreNamed) {
  const auto critical = [](const std::string& keys) {
    return told("critical", R"({ "temperature": "T", )" + keys + " }", {{"beds", "study", nullptr}});
  };
  EXPECT_EQ(critical(R"("densities": [0.001, 1.1547005], "orders": [0.001, 0.999])"), "");
  for (const char* density : {"0", "1.1548"})
    EXPECT_EQ(
        critical("\"densities\": [1, " + std::string(density) + "]"),
        std::string("/densities: a threshold must be above 0 and at most 1.1547 (close packing), got ") + density);
  for (const char* order : {"0", "1"})
    EXPECT_EQ(critical("\"orders\": [" + std::string(order) + "]"),
              std::string("/orders: a threshold of psi_6 must be between 0 and 1, got ") + order);
  EXPECT_EQ(critical(R"("density": "", "order": "")"),
            "/density: neither \"density\" nor \"order\" names a column: give one of them");
  EXPECT_EQ(critical(R"("density": "", "order": "x")"), "");
}

// y = 3 x^2 exactly, with errors of a tenth: ratios of 1 with errors of a tenth; in two groups of "z" amplitudes 3
// and 6.
TEST(ScalingByHand, WritesItsPoints) {
  LoneStage scaling(*find_stage("scaling"));
  scaling.add_input("beds", *find_stage("study"));
  write_text(scaling.file("table.csv"),
             "series,x,z,y,y_error\na,1,5,3,0.3\na,2,5,12,1.2\nb,3,5,27,2.7\na,4,5,48,4.8\na,1,7,6,0.6\na,2,7,24,2."
             "4\na,9,7,1,1\na,3,7,,1\n");
  const Json found = scaling.run(
      R"({ "fits": [ { "name": "f", "y": "y", "powers": ["x"], "each": ["z"], "within": { "x": { "least": 1, "most": 4 } } },
                                               { "name": "g", "y": "y", "powers": ["x"], "series": ["a"], "within": { "z": { "most": 5 } }, "common_error": true } ] })");
  EXPECT_EQ(found["f"]["points"], 6);
  EXPECT_EQ(found["f"]["dof"], 3);
  EXPECT_NEAR(value(found["f"]["exponents"]["x"]), 2, 1e-9);
  EXPECT_FALSE(found["f"].contains("amplitude"));
  EXPECT_EQ(found["g"]["points"], 3);
  EXPECT_NEAR(value(found["g"]["amplitude"]), 3, 1e-9);
  const NumberTable table(scaling.output("f.csv"));
  ASSERT_EQ(table.rows(), 6U);
  EXPECT_EQ(table.text("series", 2), "b");
  EXPECT_EQ(table("z", 4), 7);
  EXPECT_NEAR(table("fitted", 5), 24, 1e-8);
  EXPECT_NEAR(table("ratio", 5), 1, 1e-9);
  EXPECT_NEAR(table("ratio_error", 5), 0.1, 1e-9);
}

// --- the figure of profiles

// Points of the user against the published fit, whose density at a height is that of theory; the axis ends half a
// diameter above the last point, rounded up.
TEST(FigureByHand, HasPublishedFitAndPoints) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("bed", *find_stage("simulate"));
  write_text(figure.file("profile.csv"), "height,number_density,std_error\n0,1,0.01\n1,0.5,0.02\n30,0.001,0.01\n");
  write_text(figure.file("mine.csv"), "height,number_density\n0,0.9\n2,0.1\n33.6,0.001\n");
  const Json json = figure.run(R"({ "reference": "clement-rajchenbach-1991", "data": ")" +
                               figure.file("mine.csv").string() + R"(", "title": "a_b" })");
  const shakebed::fit::PublishedFit published;
  const auto theory = shakebed::fit::published_profile(published);
  ASSERT_EQ(json["comparisons"].size(), 3U);
  EXPECT_EQ(json["comparisons"][0]["of"], "simulation");
  EXPECT_EQ(json["comparisons"][0]["with"], "published fit");
  EXPECT_EQ(json["comparisons"][1]["of"], "mine.csv");
  EXPECT_EQ(json["comparisons"][1]["with"], "simulation");
  EXPECT_EQ(json["comparisons"][1]["points"], 2) << "33.6 lies above the simulation";
  EXPECT_NEAR(value(json["comparisons"][1]["mean_difference"]), (-0.1 + 0.1 - (0.5 - 0.499 / 29)) / 2, 1e-12);
  EXPECT_EQ(json["comparisons"][2]["with"], "published fit");
  const std::string data = read_text(figure.output("profile.dat"));
  EXPECT_THAT(data, HasSubstr("# the simulation itself\n# x y std_error\n0 1 0.01\n1 0.5 0.02\n"));
  const std::size_t at =
      data.find("# published fit, T/mg = 0.36 mm\n# x y\n0 " + number_text(theory.density(0)) + "\n");
  ASSERT_NE(at, std::string::npos);
  EXPECT_THAT(read_text(figure.output("profile.gp")),
              HasSubstr("set title 'a\\_b'\nset xrange [0:35]\nset yrange [0:*]\n"));
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("lc rgb '#009E73' title 'mine.csv'"));
  // The axis reaches two diameters above the shift of the published fit, 4.41/1.10 diameters, and half a diameter more.
  write_text(figure.file("profile.csv"), "height,number_density,std_error\n0,1,0.01\n1,0.5,0.02\n");
  figure.run(R"({ "reference": "clement-rajchenbach-1991" })");
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("set xrange [0:7]\n"));
  const Json wide = figure.run(R"({ "highest": 12.5 })");
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("set xrange [0:12.5]\n"));
  EXPECT_THAT(read_text(figure.output("profile.gp")), Not(HasSubstr("published")));
}

// A profile is drawn as far as it is above 0.002, and the picture ends there.
TEST(FigureByHand, EndsWhereTheProfileDoes) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("bed", *find_stage("simulate"));
  write_text(figure.file("profile.csv"),
             "height,number_density,std_error\n0,1,0.01\n7.6,0.0021,0.02\n30,0.0019,0.01\n");
  figure.run("{}");
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("set xrange [0:9]\n"));  // 7.6 + 0.5, rounded up
  write_text(figure.file("profile.csv"), "height,number_density,std_error\n0,1,0.01\n0.3,0.5,0.02\n30,0.0019,0.01\n");
  figure.run("{}");
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("set xrange [0:1]\n")) << "of a thin bed, too";
}

// Temperatures against windows: those above 0 alone, and the one that was used as a line from the first to the last.
TEST(FigureByHand, DrawsTheWindowsOfAFit) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("fit", *find_stage("fit"));
  write_text(figure.file("fit.json"), R"({"model": "enskog", "temperature": {"value": 0.0512, "unit": "m g D"}})");
  write_text(figure.file("curve.csv"), "height,number_density,smoothed_density\n0,1.1,1.1\n4,0.6,0.6\n");
  write_text(figure.file("windows.csv"), "low,temperature,std_error\n3,0.06,0.002\n2.5,0.05,0.001\n4,0,0\n");
  figure.run("{}");
  EXPECT_EQ(read_text(figure.output("windows.dat")),
            "# fitted temperature\n# x y std_error\n3 0.06 0.002\n2.5 0.05 0.001\n\n\n# in the window used\n# x y\n2.5 "
            "0.0512\n3 0.0512\n\n\n");
  EXPECT_THAT(read_text(figure.output("profile.gp")), HasSubstr("title 'our fit, enskog alone: T = 0.0512 mgD'"));
  const auto label = [&](const std::string& result) {
    write_text(figure.file("fit.json"), result);
    figure.run("{}");
    const std::string script = read_text(figure.output("profile.gp"));
    const std::size_t from = script.find("title 'our fit") + 7;
    return script.substr(from, script.find('\'', from) - from);
  };
  EXPECT_EQ(label(R"({"model": "m", "temperature": {"value": 0.05}, "temperature_over_mg": {"value": 0.000123456}})"),
            "our fit, m alone: T/mg = 0.123 mm");
  EXPECT_EQ(label(R"({"model": "m", "describes_data": false, "temperature": {"value": 0.05}})"),
            "our fit, m alone (does not describe the profile)");
  EXPECT_EQ(label(R"({"model": "m", "answer": {}, "temperature": {"value": 0.05}})"),
            "our fit, m alone (its T is not that of the bed)");
  EXPECT_EQ(label(R"({"model": "m", "answer": {"temperature": {}}, "temperature": {"value": 0.05}})"),
            "our fit, m alone: T = 0.05 mgD");
  EXPECT_EQ(label(R"({"model": "m"})"), "our fit, m alone");
}

// A row of a table that was cut off, and a trajectory without a frame.
TEST(FigureByHand, NamesWhatIsDamaged) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("fit", *find_stage("fit"));
  write_text(figure.file("fit.json"), R"({"model": "m", "temperature": {"value": 0.05}})");
  write_text(figure.file("windows.csv"), "low,temperature,std_error\n3,0.06,0.002\n");
  write_text(figure.file("curve.csv"), "height,number_density,smoothed_density\n0,1.1,1.1\n4,0.6\n");
  const auto said = [](const std::function<void()>& run) -> std::string {
    try {
      run();
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(said([&] { figure.run("{}"); }),
            figure.file("curve.csv").string() + ":3: this row has no cell in column \"smoothed_density\"");
  LoneStage chart(*find_stage("chart"));
  chart.add_input("my-bed", *find_stage("simulate"));
  write_text(chart.file("final.extxyz"), "");
  EXPECT_EQ(said([&] { chart.run(R"({ "snapshots": [ { "name": "s", "from": "my-bed" } ] })"); }),
            "my-bed/final.extxyz contains no frame; run the simulate stage again");
}

}  // namespace
