// The numbers in charts, against points done by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "pipelines/formats/errors.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::find_stage;
using shakebed::pipelines::Json;

// /chart/points of one chart of table.csv.
Json numbers_of(const std::string& table, const std::string& points, const std::string& curves = "") {
  LoneStage chart(*find_stage("chart"));
  chart.add_input("beds", *find_stage("study"));
  write_text(chart.file("table.csv"), table);
  return chart.run(R"({"charts": [{"name": "c", "x_label": "x", "y_label": "y", "points": [{"name": "p", "x": "x", )" +
                   points + "}]" + (curves.empty() ? "" : R"(, "curves": [)" + curves + "]") + "}]}")["c"]["p"];
}
double value(const Json& quantity) { return quantity["value"].get<double>(); }
double error(const Json& quantity) { return quantity["std_error"].get<double>(); }

// Weights 1, 4, 1 at x = 0, 1, 2: S = 6, Sx = 6, Sxx = 8, Sy = 17, Sxy = 20.
const std::string three_points = "x,y,y_error\n2,4,1\n0,1,1\n1,3,0.5\n";

// slope = (S Sxy - Sx Sy)/(S Sxx - Sx^2) = 18/12, intercept = (Sxx Sy - Sx Sxy)/12 = 16/12, variances 6/12 and 8/12,
// covariance -6/12. One degree of freedom: p = erfc(sqrt(chi2/2)).
TEST(ChartNumbers, LineFitIsTheWeightedOneDoneByHand) {
  const Json found = numbers_of(three_points, R"("y": "y", "line_fit": true)");
  EXPECT_EQ(found["points"], 3);
  EXPECT_EQ(found["line_fit"], "ok");
  EXPECT_NEAR(value(found["slope"]), 1.5, 1e-14);
  EXPECT_NEAR(error(found["slope"]), std::sqrt(0.5), 1e-14);
  EXPECT_NEAR(value(found["intercept"]), 4.0 / 3, 1e-14);
  EXPECT_NEAR(error(found["intercept"]), std::sqrt(2.0 / 3), 1e-14);
  const double chi2 = 1.0 / 9 + 4.0 / 36 + 1.0 / 9;  // residuals -1/3, 1/6, -1/3
  EXPECT_NEAR(found["chi2"].get<double>(), chi2, 1e-14);
  EXPECT_EQ(found["dof"], 1);
  EXPECT_NEAR(found["p_value"].get<double>(), std::erfc(std::sqrt(chi2 / 2)), 1e-12);
  const double zero = -8.0 / 9;
  EXPECT_NEAR(value(found["zero"]), zero, 1e-14);
  EXPECT_NEAR(error(found["zero"]), std::sqrt(2.0 / 3 - zero + zero * zero / 2) / 1.5, 1e-14);
}

TEST(ChartNumbers, AFitNeedsErrors) {
  const Json found = numbers_of("x,y\n0,1\n1,2\n2,4\n", R"("y": "y", "line_fit": true, "power_fit": true)");
  EXPECT_EQ(found["line_fit"], "not fitted: the line needs two points with errors");
  EXPECT_FALSE(found.contains("slope"));
  EXPECT_NE(found["power"]["status"], "ok");
  EXPECT_TRUE(found["power"]["exponent"].is_null());
}

// y = 1/2 + 2 x^2 exactly. Of x^2 at 1 to 5 the best line is 6 x - 7 with residuals 2, -1, -2, -1, 2.
TEST(ChartNumbers, PowerFitFindsTheExponentAndRejectsAnother) {
  const Json found = numbers_of("x,y,std_error\n1,2.5,0.1\n2,8.5,0.1\n3,18.5,0.1\n4,32.5,0.1\n5,50.5,0.1\n",
                                R"("y": "y", "power_fit": true)")["power"];
  EXPECT_EQ(found["status"], "ok");
  EXPECT_NEAR(value(found["exponent"]), 2, 1e-6);
  EXPECT_GT(error(found["exponent"]), 0);
  EXPECT_NEAR(found["law"]["amplitude"].get<double>(), 2, 1e-5);
  EXPECT_NEAR(found["law"]["offset"].get<double>(), 0.5, 1e-4);
  EXPECT_EQ(found["law"]["dof"], 2);
  const Json& square = found["given"]["2"];
  EXPECT_NEAR(square["amplitude"].get<double>(), 2, 1e-12);
  EXPECT_NEAR(square["offset"].get<double>(), 0.5, 1e-11);
  EXPECT_NEAR(square["p_value"].get<double>(), 1, 1e-9);
  const Json& line = found["given"]["1"];
  EXPECT_NEAR(line["amplitude"].get<double>(), 12, 1e-11);
  EXPECT_NEAR(line["offset"].get<double>(), -13.5, 1e-10);
  EXPECT_NEAR(line["chi2"].get<double>(), 4 * 14 / 0.01, 1e-7);
  EXPECT_EQ(line["dof"], 3);
  EXPECT_LT(line["p_value"].get<double>(), 1e-300);
}

// Differences from 1 + x: 0, 1, 1 with errors 1, 1/2, 1. Three degrees of freedom:
// p = erfc(sqrt(chi2/2)) + sqrt(2 chi2/pi) exp(-chi2/2).
TEST(ChartNumbers, AgainstACurve) {
  const Json found = numbers_of(three_points, R"("y": "y", "against": "law", "residuals": true)",
                                R"({"name": "law", "label": "1 + x", "polynomial": [1, 1], "from": 0, "to": 2})");
  const Json& against = found["against"];
  EXPECT_EQ(against["curve"], "law");
  EXPECT_EQ(against["points"], 3);
  EXPECT_NEAR(against["chi2"].get<double>(), 5, 1e-13);
  EXPECT_EQ(against["dof"], 3);
  EXPECT_NEAR(against["chi2_per_dof"].get<double>(), 5.0 / 3, 1e-13);
  EXPECT_NEAR(against["p_value"].get<double>(),
              std::erfc(std::sqrt(2.5)) + std::sqrt(10 / std::numbers::pi) * std::exp(-2.5), 1e-12);
  EXPECT_NEAR(value(against["mean_difference"]), 2.0 / 3, 1e-14);
  EXPECT_NEAR(error(against["mean_difference"]), 1.0 / 3, 1e-14);  // a spread of sqrt(2/9), over sqrt(2)
  EXPECT_NEAR(value(against["rms_difference"]), std::sqrt(2.0 / 3), 1e-14);
  EXPECT_NEAR(error(against["rms_difference"]), std::sqrt(1.25) / (3 * std::sqrt(2.0 / 3)), 1e-14);
  EXPECT_NEAR(against["largest_difference"].get<double>(), 1, 1e-14);
  EXPECT_NEAR(against["rms_log_ratio"].get<double>(), std::hypot(std::log(1.5), std::log(4.0 / 3)) / std::sqrt(3),
              1e-14);
}

// y rises by 2 from x = 0 to 1: it is 2 in the middle, where half of each error counts. 9 is never reached.
TEST(ChartNumbers, FirstCrossingOfALevel) {
  const Json crossings = numbers_of(three_points, R"("y": "y", "levels": [2, 9])")["crossings"];
  EXPECT_NEAR(value(crossings["2"]), 0.5, 1e-14);
  EXPECT_NEAR(error(crossings["2"]), std::hypot(0.5, 0.25) / 2, 1e-14);
  EXPECT_TRUE(crossings["9"]["value"].is_null());
}

// y = 3 x + 1 in the rows of b alone; the point at x = 9 lies off the line and outside of the fit. Limits of x are
// those of the scaled one.
TEST(ChartNumbers, OnlyTheRowsAskedForScaledAsAsked) {
  const std::string table =
      "series,x,y,dy\na,1,100,0.1\nb,1,4,0.1\nb,2,7,0.1\na,2,50,0.1\nb,3,10,0.1\nb,9,0,0.1\nb,11,5,0.1\n";
  const std::string rows = R"("y": "y", "error": "dy", "where": {"series": "b"}, "line_fit": true, "x_most": 10, )";
  const Json plain = numbers_of(table, rows + R"("fit_most": 5)");
  EXPECT_EQ(plain["points"], 4);
  EXPECT_EQ(plain["dof"], 1);
  EXPECT_NEAR(value(plain["slope"]), 3, 1e-13);
  EXPECT_NEAR(error(plain["slope"]), 0.1 / std::sqrt(2), 1e-14);
  const Json scaled = numbers_of(table, rows + R"("fit_most": 2, "times": -10, "plus": 5, "x_times": 0.5)");
  EXPECT_NEAR(value(scaled["slope"]), -60, 1e-11);
  EXPECT_NEAR(value(scaled["intercept"]), -5, 1e-11);
  EXPECT_NEAR(error(scaled["slope"]), 2 / std::sqrt(2), 1e-12);
  EXPECT_GT(numbers_of(table, rows + R"("fit_most": 10)")["chi2"].get<double>(), 1000) << "with the outlier";
  EXPECT_THROW(numbers_of(table, R"("y": "y", "where": {"series": "c"})"), shakebed::pipelines::InputError);
}

// Errors 1, 7, 1 pooled over all three: sqrt(51/3) each, and the slope over x = 0, 1, 2 is uncertain by that over
// sqrt(2).
TEST(ChartNumbers, PooledErrorsAreTheirRootMeanSquare) {
  const Json found = numbers_of("x,y,y_error\n0,0,1\n1,1,7\n2,2,1\n", R"("y": "y", "line_fit": true, "pool": 3)");
  EXPECT_NEAR(error(found["slope"]), std::sqrt(17.0 / 2), 1e-13);
}

// y x^2 = 12, 12: a compensated plot is flat, its errors grow alike.
TEST(ChartNumbers, APowerOfXMultipliesPointsAndErrors) {
  const Json found = numbers_of("x,y,y_error\n1,12,1\n2,3,0.5\n", R"("y": "y", "power_of_x": 2, "against": "flat")",
                                R"({"name": "flat", "polynomial": [10]})")["against"];
  EXPECT_NEAR(value(found["mean_difference"]), 2, 1e-14);
  EXPECT_NEAR(found["chi2"].get<double>(), 4 + 1, 1e-14) << "errors 1 and 2";
}

// A map of 2 x 3 settings; marked where "b" is at least 4 and "a" at most 5: the settings with b = 4 and 5.
TEST(ChartMap, CountsItsCellsAndMarks) {
  LoneStage chart(*find_stage("chart"));
  chart.add_input("beds", *find_stage("study"));
  write_text(chart.file("table.csv"),
             "series,v,n,a,b\nall,1,10,1,1\nall,1,20,2,2\nall,1,30,3,3\nall,2,10,4,4\nall,2,20,"
             "5,5\nall,2,30,6,6\n");
  const Json found = chart.run(R"({"maps": [{"name": "plane", "x": "v", "y": "n", "value": "a", "x_label": "V",
      "y_label": "N", "value_label": "a", "logarithmic_x": true,
      "marks": [{"label": "floats", "where": {"b": {"least": 4}, "a": {"most": 5}}}, {"label": "never", "where": {"a":
      {"least": 7}}}]}]})")["plane"];
  EXPECT_EQ(found["cells"], 6);
  EXPECT_EQ(found["marked"]["floats"], 2);
  EXPECT_EQ(found["marked"]["never"], 0);
  const std::string data = read_text(chart.output("plane.dat"));
  // Cells end half way in the logarithm, sqrt(1 x 2), and as far out: 1/sqrt(2).
  EXPECT_NE(data.find("1 10 0.7071067811865476 1.414213562373095 5 15 1"), std::string::npos) << data;
  EXPECT_NE(data.find("# floats: x y\n2 10\n2 20\n"), std::string::npos) << data;
  EXPECT_EQ(data.find("never"), std::string::npos);
  // Only what has marks is drawn and has a place in the key.
  const std::string script = read_text(chart.output("plane.gp"));
  EXPECT_NE(script.find("floats"), std::string::npos);
  EXPECT_EQ(script.find("never"), std::string::npos);
}

}  // namespace
