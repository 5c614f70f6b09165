// What the pages show of an inference: its table of parameters, its beds, its sentences, and the script of its pairs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "pipelines/stages/infer.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace shakebed::tests::inference_pages {
namespace {

using namespace shakebed::pipelines;
using testing::HasSubstr;
using testing::Not;

// One bed run again, whose shift had no fit, and the scene as written.
FinishedStage finished_inference(const ScratchFolder& folder) {
  write_text(folder / "pairs.svg", "<svg w='1'></svg>");
  FinishedStage stage;
  stage.files = {"search", "infer", folder.path(), "infer.json"};
  stage.result = Json::parse(R"({
    "agreement": { "statement": "some <beds> agree" },
    "parameters": {
      "floor_frequency": { "unit": "Hz", "prior_low": 10, "prior_high": 30, "median": 20.25, "low_68": 18.1, "high_68": 22.2,
                           "low_95": 16.3, "high_95": 24.4, "why": "of T_c" },
      "friction": { "unit": "1", "prior_low": 0, "prior_high": 0.8, "median": 0.3, "low_68": 0.2, "high_68": 0.4,
                    "low_95": 0.1, "high_95": 0.5, "why": "" } },
    "photographs": [ { "show": "average", "prior": 0.4, "posterior": 0.625 }, { "show": "0.25", "prior": 0.6, "posterior": 0.375 },
                     { "show": "0.75", "prior": 0, "posterior": 0 } ],
    "best": [ { "photographs": "0.25", "values": { "floor_frequency": 21.25, "friction": 0.3 }, "targets": {
      "center_of_mass_rise": { "value": 4.5, "std_error": 0.25, "unit": "D", "measured": 5, "measured_error": 0.5, "difference_in_errors": -1.26 },
      "shift": { "value": 2, "std_error": 0.5, "unit": "D", "measured": 3, "measured_error": 0.25, "difference_in_errors": null },
      "profile": { "heights": 7, "largest_difference_in_errors": 2.34 } } } ],
    "assumed": { "values": { "floor_frequency": 25 }, "targets": {
      "center_of_mass_rise": { "value": 6, "std_error": 0.25, "unit": "D", "difference_in_errors": 2.5 },
      "shift": { "value": 2, "std_error": 0.5, "unit": "D", "difference_in_errors": 0.04 },
      "profile": { "heights": 7, "largest_difference_in_errors": null } } },
    "narrowing": [ { "measurement": "temperature_x", "reduction": 0.456 }, { "measurement": "shift", "reduction": 0.1 } ] })");
  return stage;
}
std::string page_of(const FinishedStage& stage) {
  int pictures = 0;
  return infer_pages().sections.at(0).html(stage, pictures);
}

TEST(InferencePage, HasItsParametersAndViews) {
  const ScratchFolder folder;
  const std::string page = page_of(finished_inference(folder));
  EXPECT_THAT(page, HasSubstr("<p>some &lt;beds&gt; agree</p>\n"));
  EXPECT_THAT(page,
              HasSubstr("<tr><td data-label=\"parameter\">floor frequency</td><td data-label=\"prior\">10 to 30 Hz"
                        "</td><td data-label=\"median\">20.2 Hz</td><td data-label=\"68 %\">18.1 to 22.2 Hz</td>"
                        "<td data-label=\"95 %\">16.3 to 24.4 Hz</td><td data-label=\"reason for this prior\">of "
                        "T<sub>c</sub></td></tr>\n"));
  EXPECT_THAT(page, HasSubstr("<td data-label=\"prior\">0 to 0.8</td><td data-label=\"median\">0.3</td>"));
  EXPECT_THAT(page,
              HasSubstr("<p>Probability that the photographs show: the average: 62 % (prior: 40 %); phase 0.25: 38 "
                        "% (prior: 60 %).</p>\n"));
  EXPECT_THAT(page, HasSubstr("that of temperature x would narrow the parameters most: it would remove 46 % of their"));
}

TEST(InferencePage, HasItsBedsBesideTheMeasurement) {
  const ScratchFolder folder;
  FinishedStage stage = finished_inference(folder);
  const std::string page = page_of(stage);
  EXPECT_THAT(page,
              HasSubstr("<th>photographs show</th><th>center of mass rise</th><th>shift</th><th>profile</th></tr>\n"
                        "<tr><td>measured</td><td></td><td></td><td>5.00 ± 0.50 D</td><td>3.00 ± 0.25 D</td>"
                        "<td>7 heights</td></tr>\n"));
  EXPECT_THAT(page, HasSubstr("<tr><td>bed 1, run again</td><td>floor frequency 21.2, friction 0.3</td><td>phase 0.25"
                              "</td><td>4.50 ± 0.25 D (-1.3)</td><td>2.00 ± 0.50 D (no fit)</td><td>(2.3 at most)</td>"
                              "</tr>\n"));
  EXPECT_THAT(page, HasSubstr("<tr><td>scene as written in the recipe</td><td>floor frequency 25</td><td>average</td>"
                              "<td>6.00 ± 0.25 D (+2.5)</td><td>2.00 ± 0.50 D (+0.0)</td><td></td></tr>\n"));
  stage.result["assumed"] = nullptr;
  EXPECT_THAT(page_of(stage), Not(HasSubstr("scene as written in the recipe")));
  stage.result["best"] = Json::array();
  EXPECT_THAT(page_of(stage), Not(HasSubstr("In brackets")));
  stage.result.erase("agreement");
  EXPECT_EQ(page_of(stage), "");
}

TEST(InferencePage, SaysItsIntervalsInLines) {
  const ScratchFolder folder;
  FinishedStage stage = finished_inference(folder);
  EXPECT_EQ(infer_pages().terminal(stage),
            "search: floor frequency = 20.2 Hz (68 %: 18.1 to 22.2)\nsearch: friction = 0.3 (68 %: 0.2 to 0.4)\n"
            "some <beds> agree\n");
  EXPECT_EQ(
      infer_pages().markdown(stage),
      "\n## Parameters of the bed\n\n- floor frequency = 20.2 Hz (68 %: 18.1 to 22.2)\n- friction = 0.3 (68 %: 0.2 to "
      "0.4)\n\nsome <beds> agree\n");
  stage.result.erase("agreement");
  EXPECT_EQ(infer_pages().terminal(stage), "");
  EXPECT_EQ(infer_pages().markdown(stage), "");
}

// --- the script of pairs, which is there without gnuplot

class InferencePairs : public testing::Test {
 protected:
  InferencePairs() : stage_(*find_stage("infer")), path_(std::getenv("PATH")) {
    ::setenv("PATH", "", 1);
    UnknownParameter gamma, frequency, sides;
    gamma.set = {"/floor/gamma"}, gamma.low = 2, gamma.high = 6;
    frequency.set = {"/floor/frequency"}, frequency.unit = "Hz", frequency.low = 10, frequency.high = 40;
    sides.set = {"/box/sides"}, sides.values = Json::parse(R"(["hard", "periodic"])");
    options_.parameters = {{"gamma", gamma}, {"frequency", frequency}, {"box_sides", sides}};
    std::vector<Problem> problems;
    options_.bed.scene = *parse_json(R"({ "floor": { "frequency": "25 Hz", "gamma": 3 } })", "s", problems);
    found_.posterior.dimensions = 3;
    found_.posterior.points = {0.25, 0.5, 0.75, 0.5, 0.1, 0.25};
    found_.posterior.weight = {0.5, 0.5};
    found_.draws = {1, 0, 1};
    found_.best = {{{3.5, 20, 1}, 0, {}}};
  }
  ~InferencePairs() override { ::setenv("PATH", path_.c_str(), 1); }
  std::string script() {
    EXPECT_THROW(draw_pairs(stage_, options_, found_), StageError);
    return read_text(stage_.output("pairs.gp"));
  }
  LoneStage stage_;
  InferOptions options_;
  Inference found_;

 private:
  std::string path_;
};

TEST_F(InferencePairs, HoldDrawsAndBestBeds) {
  const std::string text = script();
  EXPECT_EQ(read_text(stage_.output("pairs.dat")), "4 13 0 \n3 25 1 \n4 13 0 \n\n\n3.5 20 1 \n");
  EXPECT_NE(text.find("set multiplot layout 3,3 margins"), text.rfind("set multiplot layout 3,3 margins")) << "twice";
  EXPECT_THAT(text, HasSubstr("set output 'pairs.svg'\nset multiplot"));
  EXPECT_THAT(text, HasSubstr("set output 'pairs.pdf'\nset multiplot"));
  found_.best.clear();
  script();
  EXPECT_THAT(read_text(stage_.output("pairs.dat")), testing::EndsWith("\n\n\nNaN\n"));
}

// Labels below the last row and beside the first column; steps of 1, 2 or 5 that make three to six of a range: 4, 30,
// and 2 of two values.
TEST_F(InferencePairs, HaveAxesWithRoundSteps) {
  const std::string text = script();
  const std::string plot = text.substr(0, text.find("unset multiplot"));
  EXPECT_THAT(plot,
              HasSubstr("tic_font\nunset xlabel\nset format x ''\nunset ylabel\nset format y ''\nset xrange [2:6]\n"
                        "set xtics 1\nset yrange [0:*]\nset ytics autofreq\nplot 'pairs.dat' index 0 using "
                        "(2+0.16666666666666666*(floor(($1-(2))/0.16666666666666666)+0.5)):(1) smooth frequency"));
  EXPECT_THAT(plot, HasSubstr("set multiplot next\nset multiplot next\nunset xlabel\nset format x ''\nset ylabel "
                              "'frequency (Hz)' font label_font\nset format y '%g'\nset xrange [2:6]\nset xtics 1\nset "
                              "yrange [10:40]\nset ytics 10\nplot 'pairs.dat' index 0 every 1 using 1:2 with"));
  EXPECT_THAT(plot, HasSubstr("'pairs.dat' index 1 using 1:2 with points pt 2"));
  EXPECT_THAT(plot, HasSubstr("(10+1.25*(floor(($2-(10))/1.25)+0.5)):(1)"));
  EXPECT_THAT(plot,
              HasSubstr("set xlabel 'gamma' font label_font\nset format x '%g'\nset ylabel 'box sides' font "
                        "label_font\nset format y '%g'\nset xrange [2:6]\nset xtics 1\nset yrange [-0.5:1.5]\nset "
                        "ytics 0.5\nplot 'pairs.dat' index 0 every 1 using 1:3 with"));
  EXPECT_THAT(plot, HasSubstr("set xlabel 'frequency (Hz)' font label_font\nset format x '%g'\nunset ylabel\n"));
  EXPECT_THAT(plot, HasSubstr("index 0 every 1 using 2:3 with"));
  EXPECT_THAT(plot,
              HasSubstr("set xlabel 'box sides' font label_font\nset format x '%g'\nunset ylabel\nset format y ''\n"
                        "set xrange [-0.5:1.5]\nset xtics 0.5\nset yrange [0:*]"));
  // The scene as written has a circle where both of its numbers are known.
  EXPECT_THAT(plot, HasSubstr("lc rgb '#D55E00', '+' using (3):(25) every ::0::0 with points pt 6"));
  EXPECT_EQ(plot.find("'+' using", plot.find("'+' using") + 1), std::string::npos);
}

// 400 points at most: of 801 draws each third.
TEST_F(InferencePairs, ThinOutTheirPoints) {
  for (const auto& [draws, every] : {std::pair(400, 1), {401, 2}, {800, 2}, {801, 3}}) {
    found_.draws.assign(static_cast<std::size_t>(draws), 0);
    EXPECT_THAT(script(), HasSubstr("index 0 every " + std::to_string(every) + " using 1:2")) << draws;
  }
}

// The curve is drawn where the pair is Gamma and frequency, whichever lies along x.
TEST_F(InferencePairs, HaveTheCurveOfAFormula) {
  options_.curve = MapCurve{0.5, "no formula of this name", ""};
  EXPECT_THAT(script(), HasSubstr(", 'map-curve.dat' using 2:1 with lines lw 2 lc rgb '#009E73'\n"));
  EXPECT_EQ(read_text(stage_.output("map-curve.dat")), "");
  std::swap(options_.parameters[0], options_.parameters[1]);
  const std::string text = script();
  EXPECT_THAT(text, HasSubstr(", 'map-curve.dat' using 1:2 with lines"));
  EXPECT_EQ(text.find("map-curve", text.find("map-curve") + 20), text.rfind("map-curve")) << "once in each plot";
}

}  // namespace
}  // namespace shakebed::tests::inference_pages
