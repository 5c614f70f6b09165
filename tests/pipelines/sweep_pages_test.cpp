// The pages of a sweep, of points made by hand: figures, maps, tables, texts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "pipelines/report/crate.hpp"
#include "pipelines/report/report.hpp"
#include "pipelines/runner/sweep_table.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;
using testing::Not;

std::size_t count_of(const std::string& words, const std::string& text) {
  std::size_t found = 0;
  for (std::size_t at = text.find(words); at != std::string::npos; at = text.find(words, at + 1)) ++found;
  return found;
}

// A sweep of a fit of the user's own profile, with rows that the test fills in.
class SweepPages : public testing::Test {
 protected:
  void read(const std::string& sweep, const std::string& more = "") {
    write_text(folder_ / "p.csv", "height,number_density,std_error\n1,1,0.1\n2,0.5,0.1\n3,0.2,0.1\n4,0.1,0.1\n");
    std::vector<Problem> problems;
    plan_ = make_plan(*parse_json(R"({ "name": "swept_bed", )" + more + R"( "sweep": )" + sweep + R"(, "stages": [
        { "stage": "fit", "profile": "p.csv", "diameter": "3 mm" } ] })",
                                  "r.json", problems),
                      "r.json", folder_.path());
    points_ = sweep_points(plan_);
    table_.assign(1, {"point", "replica", "status"});
    const std::size_t axes = plan_.sweep->axes.size(), numbers = plan_.sweep->collect.size();
    table_[0].resize(3 + axes + 2 * numbers, "column");
    table_[0].emplace_back(verdict_column);
    for (const SweepPoint& point : points_) {
      std::vector<std::string> row{point.name, std::to_string(point.replica), "ok"};
      for (const Json& value : point.values)
        row.push_back(value.is_string() ? value.get<std::string>() : dump_canonical(value));
      row.resize(3 + axes + 2 * numbers);
      row.emplace_back("one temperature");
      table_.push_back(std::move(row));
    }
  }
  std::string& cell(std::size_t point, std::size_t k, bool error = false) {
    return table_[1 + point][3 + plan_.sweep->axes.size() + 2 * k + (error ? 1 : 0)];
  }
  SweepOutcome outcome(bool complete) const {
    return {.out = folder_.path(),
            .points = points_,
            .collected = plan_.sweep->collect,
            .table = table_,
            .problems = problems_,
            .verdicts = verdicts_,
            .warnings = warnings_,
            .complete = complete};
  }
  void write(bool complete = true) {
    report_pages().write(plan_, outcome(complete));
    if (complete) page_ = read_text(folder_ / "report.html");
    summary_ = read_text(folder_ / "summary.md");
  }
  ScratchFolder folder_;
  Plan plan_;
  std::vector<SweepPoint> points_;
  std::vector<std::vector<std::string>> table_;
  std::vector<std::string> problems_, warnings_;
  std::map<std::string, std::size_t> verdicts_;
  std::string page_, summary_;
};

// A number whose meaning is longer than an axis is called by its place; temperatures alone by their symbols.
TEST_F(SweepPages, NameNumbersByMeaningOrPlace) {
  read(R"({ "over": { "/stages/fit/diameter": ["3 mm", "4 mm"] },
            "collect": ["/fit/shift", "/fit/statistical_error", "/fit/reduced_temperature"] })");
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 3; ++k) cell(i, k) = std::to_string(i + k + 1);
  write();
  for (const char* name : {"fit shift  [D]", "fit statistical error  [m g D]", "reduced temperature T/T<sub>c</sub>"})
    EXPECT_THAT(page_, HasSubstr("data-label=\"" + std::string(name) + "\"")) << name;
}

// Two diameters, two column numbers, two replicas: of (3 mm, 10) the mean of 1 and 3, of (4 mm, 10) one alone, of
// (4 mm, 12) none.
TEST_F(SweepPages, HoldMapsFiguresAndRows) {
  read(R"({ "over": { "/stages/fit/diameter": ["3 mm", "4 mm"], "/stages/fit/column_number": [10, 12] }, "replicas": 2,
            "collect": ["/fit/temperature_over_mg", "/fit/answer/temperature", "/fit/answer/interval/low",
                        "/fit/answer/interval/high", "/fit/plateau_density"] })");
  ASSERT_EQ(points_.size(), 8U);
  const std::vector<std::string> lengths{"0.001", "0.003", "0.004", "0.004", "0.006", "", "", ""};
  for (std::size_t i = 0; i < 8; ++i) cell(i, 0) = lengths[i];
  for (std::size_t i = 0; i < 5; ++i) cell(i, 0, true) = "0.0002";
  // The answer: a range of points 1 and 4, whose half is drawn; a value with an error otherwise.
  for (std::size_t i = 0; i < 5; ++i) cell(i, 1) = std::to_string(i + 1), cell(i, 1, true) = "0.25";
  for (const std::size_t i : {1UL, 4UL}) {
    cell(i, 1, true).clear();
    cell(i, 2) = "1.5", cell(i, 3) = "4.5";
    table_[1 + i].back() = "no single temperature";
  }
  table_[8][2] = "failed";
  problems_ = {"point 000007: a_b stopped"};
  warnings_ = {"one warning", "another"};
  verdicts_ = {{"no single temperature", 2}, {"one temperature", 3}};
  std::filesystem::create_directories(folder_ / "points/000002");
  write_text(folder_ / "points/000002/report.html", "");
  write();

  // Lengths in mm, over the diameter in the unit of the recipe; replicas one beside the other.
  EXPECT_EQ(read_text(folder_ / "figures/sweep-1.dat"),
            "# column number = 10\n# x y std_error\n3 1 0.2\n3 3 0.2\n4 6 0.2\n\n\n"
            "# column number = 12\n# x y std_error\n3 4 0.2\n3 4 0.2\n\n\n");
  // Point 1 has a range, point 4 too: hollow, with half the range, 1.5.
  EXPECT_EQ(read_text(folder_ / "figures/sweep-2.dat"),
            "# column number = 10\n# x y std_error\n3 1 0.25\n\n\n"
            "# column number = 10, no single temperature\n# x y std_error\n3 2 1.5\n4 5 1.5\n\n\n"
            "# column number = 12\n# x y std_error\n3 3 0.25\n3 4 0.25\n\n\n");
  EXPECT_THAT(read_text(folder_ / "figures/sweep-1.gp"), HasSubstr("set xlabel 'diameter  [mm]'\n"));
  EXPECT_THAT(read_text(folder_ / "figures/sweep-1.gp"),
              HasSubstr("set ylabel 'fitted temperature as T/(m g)  [mm]'\n"));
  for (const char* none : {"sweep-3", "sweep-4", "sweep-5"})
    EXPECT_FALSE(std::filesystem::exists(folder_ / (std::string("figures/") + none + ".gp"))) << none;
  EXPECT_EQ(count_of("Each number against the first parameter", page_), 1U);
  EXPECT_EQ(count_of("<figure class=\"plot\"", page_), 2U);

  // Means 2, 6 in the first row, 4 and none in the second: shares 0, 1 and 1/2 of the colours.
  EXPECT_THAT(page_,
              HasSubstr("<h3>fitted temperature as T/(m g)  [mm]</h3>\n<div class=\"scroll\"><table class=\"map\">\n"
                        "<tr><th>column number ↓ diameter  [mm] →</th><th scope=\"col\">3</th>"
                        "<th scope=\"col\">4</th></tr>\n"
                        "<tr><th scope=\"row\">10</th><td style=\"background:rgb(0 34 78);color:#fff\">2</td>"
                        "<td style=\"background:rgb(254 232 56);color:#000\">6</td></tr>\n"
                        "<tr><th scope=\"row\">12</th><td style=\"background:rgb(123 123 120);color:#000\">4</td>"
                        "<td>–</td></tr>\n</table></div>\n"));
  // Of the answer 1.5, 5; 3.5: one replica of a range makes the cell hollow. 3.5 lies at 2/3.5 = 4/7 of the colours:
  // 2/7 of the way from the third to the fourth.
  EXPECT_THAT(page_, HasSubstr(">1.5 ○</td>"));
  EXPECT_THAT(page_, HasSubstr(">5 ○</td>"));
  EXPECT_THAT(page_, HasSubstr("rgb(142 138 117);color:#000\">3.5</td>"));
  EXPECT_EQ(count_of("<table class=\"map\">", page_), 3U) << "the ends of a range have none";
  EXPECT_EQ(count_of("<h2>Maps over both parameters</h2>", page_), 1U);

  EXPECT_THAT(page_, HasSubstr("<section class=\"answer bad-answer\" aria-label=\"the answer\">\n<p class=\"headline\">"
                               "7 of 8 points are done</p>\n<p><strong>Verdicts: 2 no single temperature, 3 one "
                               "temperature.</strong> Hollow symbols"));
  EXPECT_THAT(page_, HasSubstr("<summary>Points that failed: 1</summary><p>point 000007: a<sub>b</sub> stopped</p>"));
  EXPECT_THAT(page_, HasSubstr("<summary>Warnings of points: 2</summary><p>one warning</p>\n<p>another</p>"));
  EXPECT_THAT(page_, HasSubstr("<h2>8 points</h2>\n"));
  EXPECT_THAT(page_,
              HasSubstr("<tr><th scope=\"col\">point</th><th scope=\"col\">replica</th><th scope=\"col\">status</th>"
                        "<th scope=\"col\">diameter</th><th scope=\"col\">column number</th><th scope=\"col\">"
                        "fitted temperature as T/(m g)  [mm]</th>"));
  EXPECT_THAT(page_,
              HasSubstr("<td data-label=\"point\"><a href=\"points/000002/report.html\">000002</a></td>"
                        "<td data-label=\"replica\" class=\"number\">0</td>"
                        "<td data-label=\"status\" class=\"good\">ok</td>"
                        "<td data-label=\"diameter\" class=\"number\">3 mm</td>"
                        "<td data-label=\"column number\" class=\"number\">12</td>"
                        "<td data-label=\"fitted temperature as T/(m g)  [mm]\" class=\"number\">4.00 ± 0.20</td>"));
  EXPECT_THAT(page_, HasSubstr("<td data-label=\"point\">000001</td>"));
  EXPECT_THAT(page_, HasSubstr("<td data-label=\"status\" class=\"bad\">failed</td>"));
  EXPECT_THAT(page_, HasSubstr("<td data-label=\"verdict\" class=\"caution\">no single temperature</td>"));
  EXPECT_THAT(page_, HasSubstr("<td data-label=\"verdict\" class=\"good\">one temperature</td>"));
  EXPECT_THAT(page_, Not(HasSubstr("Only the first")));
}

// Six colours: a seventh series is not drawn. Points without an error have none, and then their series has none.
TEST_F(SweepPages, DrawSixSeriesAndErrorsOfAllPointsOrNone) {
  read(R"({ "over": { "/stages/fit/note": ["a", "b"], "/stages/fit/diameter": ["3000 um", "5 mm"],
                      "/stages/fit/column_number": [10, 11, 12, 13, 14, 15, 16] },
            "collect": ["/fit/answer/temperature_over_mg"] })");
  for (std::size_t i = 0; i < 7; ++i) cell(i, 0) = "0.00" + std::to_string(i + 1), cell(i, 0, true) = "0.001";
  cell(7, 0) = "0.009";
  table_[2].back() = "no single temperature";
  verdicts_ = {{"one temperature", 28}};
  write();
  EXPECT_EQ(read_text(folder_ / "figures/sweep-1.dat"),
            "# note = a, column number = 10\n# x y\n3000 1\n5000 9\n\n\n"
            "# note = a, column number = 11, no single temperature\n# x y std_error\n3000 2 1\n\n\n"
            "# note = a, column number = 12\n# x y std_error\n3000 3 1\n\n\n"
            "# note = a, column number = 13\n# x y std_error\n3000 4 1\n\n\n"
            "# note = a, column number = 14\n# x y std_error\n3000 5 1\n\n\n"
            "# note = a, column number = 15\n# x y std_error\n3000 6 1\n\n\n");
  EXPECT_THAT(read_text(folder_ / "figures/sweep-1.gp"), HasSubstr("set xlabel 'diameter  [um]'\n"));
  EXPECT_THAT(page_, Not(HasSubstr("<table class=\"map\">"))) << "three parameters";
  EXPECT_THAT(page_, Not(HasSubstr("Hollow symbols"))) << "all have one temperature";
  EXPECT_THAT(page_, HasSubstr("<section class=\"answer good-answer\""));
  EXPECT_THAT(page_, Not(HasSubstr("<th scope=\"col\">replica</th>")));
}

// 500 rows in the page, 50 in the summary. A shard alone has a summary only.
TEST_F(SweepPages, ShowTheFirstRowsOfMany) {
  const auto of_points = [&](std::size_t count, bool complete) {
    read(R"({ "over": { "/stages/fit/note": { "from": 1, "to": 2, "count": )" + std::to_string(count) +
         R"( } }, "collect": [] })");
    for (SweepPoint& point : points_) point.values = {Json(true)};
    write(complete);
  };
  of_points(50, false);
  EXPECT_THAT(summary_, Not(HasSubstr("Only the first")));
  EXPECT_EQ(count_of("| ok |", summary_), 50U);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "report.html"));
  of_points(51, false);
  EXPECT_THAT(summary_, HasSubstr("\nOnly the first 50 points are shown; sweep.csv has all.\n"));
  EXPECT_EQ(count_of("| ok |", summary_), 50U);
  of_points(500, true);
  EXPECT_EQ(count_of("class=\"good\">ok</td>", page_), 500U);
  EXPECT_THAT(page_, Not(HasSubstr("Only the first")));
  of_points(501, true);
  EXPECT_EQ(count_of("class=\"good\">ok</td>", page_), 500U);
  EXPECT_THAT(page_, HasSubstr("<p>Only the first 500 points are shown; sweep.csv has all.</p>\n"));
}

TEST_F(SweepPages, SummaryHoldsTheTable) {
  read(R"({ "over": { "/stages/fit/column_number": [10, 12] }, "collect": ["/fit/temperature"] })",
       R"("description": "why it was done", "report": { "title": "The | title" }, )");
  table_[0] = {"point", "replica", "status", "column", "T", "T_error", "verdict"};
  cell(0, 0) = "1.5", cell(0, 0, true) = "0.5";
  table_[2][2] = "failed", table_[2].back().clear();
  problems_ = {"p *1*"};
  warnings_ = {"w"};
  verdicts_ = {{"one temperature", 1}};
  write(false);
  EXPECT_EQ(summary_,
            "# The \\| title\n\n**1 of 2 points are done**\n\nVerdicts: 1 one temperature.\n"
            "\n## Warnings of points\n\n- w\n\n## Points that failed\n\n- p \\*1\\*\n\n## Points\n\n"
            "| point | replica | status | column | T | T\\_error | verdict |\n|---|---|---|---|---|---|---|\n"
            "| 000000 | 0 | ok | 10 | 1.5 | 0.5 | one temperature |\n| 000001 | 0 | failed | 12 |  |  |  |\n");
  points_.clear();
  table_.resize(1);
  problems_.clear(), warnings_.clear(), verdicts_.clear();
  write(false);
  EXPECT_EQ(summary_,
            "# The \\| title\n\n**0 of 0 points are done**\n\n## Points\n\n"
            "| point | replica | status | column | T | T\\_error | verdict |\n|---|---|---|---|---|---|---|\n");
}

// A text of the report is shown in place of the description.
TEST_F(SweepPages, EndWithTheirTextOrDescription) {
  const std::string sweep = R"({ "over": { "/stages/fit/column_number": [10, 12] }, "collect": [] })",
                    described = R"("description": "why <it> was done", )";
  read(sweep, described);
  write();
  EXPECT_THAT(page_, HasSubstr("<p>why &lt;it&gt; was done</p>\n"));
  read(sweep, described + R"("report": { "text": ["what was found"] }, )");
  write();
  EXPECT_THAT(page_, HasSubstr("<p>what was found</p>\n"));
  EXPECT_THAT(page_, Not(HasSubstr("why &lt;it&gt;")));
}

// Up to 40 columns. All cells alike are in the middle of the colours, a point that failed is an empty cell, and points
// at random have no map.
TEST_F(SweepPages, HoldMapsOfGridsAlone) {
  const auto cells = [&](const std::string& kind, int columns) {
    read(R"({ "kind": ")" + kind + R"(", "over": { "/stages/fit/column_number": { "from": 10, "to": 60, "count": )" +
         std::to_string(columns) + R"( }, "/stages/fit/floor_height": ["1 mm", "2 mm"] },
            "collect": ["/fit/temperature"] })");
    for (std::size_t i = 0; i < points_.size(); ++i) cell(i, 0) = i == 0 ? "" : "0.5";
    write();
    return count_of("<td style=\"background:rgb(123 123 120);color:#000\">0.5</td>", page_);
  };
  EXPECT_EQ(cells("grid", 40), 79U);
  EXPECT_EQ(count_of("<td>–</td>", page_), 1U);
  EXPECT_EQ(cells("grid", 2), 3U);
  EXPECT_EQ(cells("grid", 41), 0U);
}

// --- the table of a sweep

TEST(SweepColumns, HaveNamesOfLettersAndDigits) {
  EXPECT_EQ(column_name("/stages/bed/floor/amplitude", "m"), "bed_floor_amplitude_m");
  EXPECT_EQ(column_name("/fit/temperature", "m g D"), "fit_temperature");
  EXPECT_EQ(column_name("/stages/bed/gravity", "m/s^2"), "bed_gravity_m_s_2");
  EXPECT_EQ(column_name("/stages/bed/rate", "sqrt(g/D)"), "bed_rate");
  EXPECT_EQ(column_name("/bed/stages/x", "1"), "bed_stages_x");
  EXPECT_EQ(column_name("/bed/-x-", ""), "bed_x");
  EXPECT_EQ(column_name("/stages/bed/g", "kg"), "bed_g_kg");
  EXPECT_EQ(verdicts_text({}), "");
  EXPECT_EQ(verdicts_text({{"a", 2}}), "Verdicts: 2 a");
}

TEST_F(SweepPages, TableIsInSi) {
  read(R"({ "over": { "/stages/fit/diameter": ["3 mm", "0.4 cm"], "/stages/fit/note": ["a", "b"] },
            "collect": ["/fit/temperature_over_mg", "/fit/shift"] })");
  cell(0, 0) = "0.002", cell(0, 0, true) = "0.001";
  const std::string csv = sweep_table(plan_, plan_.sweep->collect, table_).csv();
  EXPECT_EQ(
      csv,
      "point,replica,status,fit_diameter_m,fit_note,fit_temperature_over_mg_m,fit_temperature_over_mg_std_error_m,"
      "fit_shift,fit_shift_std_error,verdict\n"
      "000000,0,ok,0.003,a,0.002,0.001,,,one temperature\n000001,0,ok,0.003,b,,,,,one temperature\n"
      "000002,0,ok,0.004,a,,,,,one temperature\n000003,0,ok,0.004,b,,,,,one temperature\n");
  EXPECT_EQ(unit_of_result(plan_, "/fit/temperature_over_mg"), "m");
  EXPECT_EQ(unit_of_result(plan_, "/fit/no_such"), "1");
  EXPECT_EQ(unit_of_result(plan_, "/nobody/temperature"), "1");
  EXPECT_EQ(unit_of_result(plan_, ""), "1");
}

// Its crate: tables and pages that are there, figures by their names, the folders of the points that have one.
TEST_F(SweepPages, HaveTheirCrate) {
  read(R"({ "over": { "/stages/fit/column_number": [10, 12, 14] }, "collect": ["/fit/temperature"] })");
  for (const char* name : {"sweep.csv", "resolved.json", "report.html"}) write_text(folder_ / name, "x");
  std::filesystem::create_directories(folder_ / "figures");
  for (const char* name : {"figures/sweep-2.svg", "figures/sweep-1.dat"}) write_text(folder_ / name, "x");
  for (const char* name : {"points/000000", "points/000002"}) std::filesystem::create_directories(folder_ / name);
  const Json crate = crate_json(plan_, outcome(true));
  std::string ids, parts;
  for (const Json& entity : crate["@graph"]) ids += entity["@id"].get<std::string>() + " ";
  for (const Json& part : crate["@graph"][1]["hasPart"]) parts += part["@id"].get<std::string>() + " ";
  const std::string there =
      "sweep.csv resolved.json report.html figures/sweep-1.dat figures/sweep-2.svg points/000000/ points/000002/ ";
  EXPECT_EQ(parts, there);
  EXPECT_EQ(ids, "ro-crate-metadata.json ./ #shakebed #licence " + there + "#run ");
  EXPECT_EQ(crate["@graph"][1]["mentions"], Json::parse(R"([{"@id": "#run"}])"));
  EXPECT_EQ(crate["@graph"][9]["name"], "point 000000");
  EXPECT_EQ(crate["@graph"][11], Json::parse(R"({"@id": "#run", "@type": "CreateAction", "name": "swept_bed",
      "instrument": {"@id": "#shakebed"}, "object": [{"@id": "resolved.json"}], "result": {"@id": "./"}})"));
}

}  // namespace
