// The numbers and errors of the stages critical, figure, map and fit, on inputs small enough for pencil and paper or
// for a second way to the same number.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/answer.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;

// --- critical

// Between T = 1 and 2 the density falls by 0.04, so 1.13 is met three quarters of the way: T = 1.75, and of the errors
// 0.01 and 0.03 a quarter and three quarters count, over the slope 0.04.
TEST(CriticalNumbers, AreCrossingsDoneByHand) {
  LoneStage critical(*find_stage("critical"));
  critical.add_input("beds", *find_stage("study"));
  write_text(critical.file("table.csv"),
             "series,T,bottom_density,bottom_density_error,psi6,psi6_error\n"
             "a,1,1.16,0.01,0.97,0.01\na,2,1.12,0.03,0.91,0.02\na,3,1.08,0.01,0.80,0.03\n"
             "b,1,1.16,0,0.97,0\nb,3,1.08,0,0.77,0\n");
  const Json json =
      critical.run(R"({ "temperature": "T", "unit": "K", "densities": [1.13, 1.10, 1.0], "orders": [0.9] })");
  const Json& a = json["T_c"]["series"]["a"];
  const double high = std::hypot(0.25 * 0.01, 0.75 * 0.03) / 0.04, low = std::hypot(0.5 * 0.03, 0.5 * 0.01) / 0.04;
  EXPECT_EQ(a[0]["threshold"], 1.13);
  EXPECT_NEAR(value(a[0]["temperature"]), 1.75, 1e-12);
  EXPECT_NEAR(error(a[0]["temperature"]), high, 1e-12);
  EXPECT_EQ(a[0]["temperature"]["unit"], "K");
  EXPECT_NEAR(value(a[1]["temperature"]), 2.5, 1e-12);
  EXPECT_NEAR(error(a[1]["temperature"]), low, 1e-12);
  EXPECT_EQ(a[2]["status"], "outside range");
  EXPECT_TRUE(a[2]["temperature"].is_null());
  const Json& order = json["T_c_prime"]["series"]["a"][0];
  EXPECT_NEAR(value(order["temperature"]), 2 + 1.0 / 11, 1e-12);
  EXPECT_NEAR(error(order["temperature"]), std::hypot(10.0 / 11 * 0.02, 1.0 / 11 * 0.03) / 0.11, 1e-12);
  const Json& b = json["T_c"]["series"]["b"][0];
  EXPECT_NEAR(value(b["temperature"]), 1 + 2 * 0.03 / 0.08, 1e-12);
  EXPECT_FALSE(b["temperature"].contains("std_error")) << "its densities have no errors";
  EXPECT_EQ(json["T_c"]["column"], "bottom_density");
  EXPECT_EQ(json["T_c_prime"]["column"], "psi6");

  const NumberTable table(critical.output("critical.csv"));
  ASSERT_EQ(table.rows(), 8U);
  EXPECT_EQ(table.text("series", 0), "a");
  EXPECT_EQ(table.text("quantity", 0), "T_c");
  EXPECT_NEAR(table("threshold", 0), 1.13, 1e-12);
  EXPECT_NEAR(table("temperature", 0), 1.75, 1e-12);
  EXPECT_NEAR(table("std_error", 0), high, 1e-12);
  EXPECT_EQ(table.text("status", 0), "ok");
  EXPECT_TRUE(std::isnan(table("temperature", 2)));
  EXPECT_EQ(table.text("status", 2), "outside range");
  EXPECT_TRUE(std::isnan(table("std_error", 3))) << "b has no errors";
  EXPECT_EQ(table.text("quantity", 6), "T_c_prime");
  EXPECT_NEAR(table("temperature", 6), 2 + 1.0 / 11, 1e-12);
}

// --- figure

std::string profile(const std::string& rows) { return "height,number_density,std_error\n" + rows; }

// The frames are above the simulation by 0.1 at height 0, below it by 0.15 at 1 (between 0.9 and 1.0) and not looked at
// where they are not above 0.1. At the moments of the frames the simulation is off by 0 and 0.04.
TEST(FigureNumbers, AreDifferencesDoneByHand) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("extract", *find_stage("extract"), "e");
  figure.add_input("bed", *find_stage("simulate"), "s");
  write_text(figure.file("e/profile.csv"), profile("0,1.0,0.01\n1,0.8,0.01\n2,0.1,0.01\n"));
  write_text(figure.file("s/profile.csv"), profile("0,0.9,0.01\n2,1.0,0.01\n"));
  write_text(figure.file("s/profile_frames.csv"), profile("0,1.0,0.01\n1,0.76,0.01\n2,0.9,0.01\n"));
  write_text(figure.file("mine.csv"), profile("0,1.2,0.01\n2,0.1,0.01\n"));
  const Json json = figure.run("{}");
  EXPECT_NEAR(value(json["frames_against_simulation"]), std::hypot(0.1, 0.15) / std::sqrt(2), 1e-14);
  EXPECT_EQ(json["frames_against_simulation"]["unit"], "1/D^2");
  EXPECT_NEAR(value(json["frames_against_simulation_same_moments"]), 0.04 / std::sqrt(2), 1e-14);
  const Json& row = json["comparisons"][0];
  EXPECT_EQ(row["of"], "frames");
  EXPECT_EQ(row["with"], "simulation");
  EXPECT_EQ(row["points"], 2);
  EXPECT_NEAR(value(row["rms_difference"]), std::hypot(0.1, 0.15) / std::sqrt(2), 1e-14);
  EXPECT_NEAR(value(row["mean_difference"]), -0.025, 1e-14);
  EXPECT_NEAR(value(row["largest_difference"]), 0.15, 1e-14);
  EXPECT_EQ(json["comparisons"][1]["with"], "simulation at the moments of the frames");
  EXPECT_NEAR(value(json["comparisons"][1]["mean_difference"]), 0.02, 1e-14);
}

TEST(FigureNumbers, TheWindowOfTheFitIsMarkedInThePicture) {
  LoneStage figure(*find_stage("figure"));
  figure.add_input("fit", *find_stage("fit"));
  write_text(figure.file("fit.json"), R"({"model": "enskog", "temperature": {"value": 0.05, "unit": "m g D"},
      "window": {"low": {"value": 2.5, "unit": "D"}, "high": {"value": 7.25, "unit": "D"}}})");
  write_text(figure.file("curve.csv"), "height,number_density,smoothed_density\n0,1.1,1.1\n4,0.6,0.6\n9,0.01,0.01\n");
  write_text(figure.file("windows.csv"), "low,temperature,std_error\n2.5,0.05,0.001\n");
  figure.run("{}");
  EXPECT_NE(read_text(figure.output("profile.gp")).find("rectangle from 2.5, graph 0 to 7.25, graph 1"),
            std::string::npos);
  EXPECT_NE(read_text(figure.output("profile.gp")).find("window of the fit"), std::string::npos);
}

// --- map

// What a bed and a fit say goes into the map: Gamma = a (2 pi f)^2/g, mu = (N D/W)/phi_0.
TEST(MapNumbers, ComeFromTheBedAndTheFit) {
  LoneStage map(*find_stage("map"));
  map.add_input("fit", *find_stage("fit"));
  write_text(map.file("fit.json"), R"({"temperature": {"value": 0.05, "std_error": 0.004, "unit": "m g D"},
      "plateau_density": {"value": 1.1, "std_error": 0, "unit": "1/D^2"}})");
  BedDescription bed;
  bed.count = 330, bed.diameter = 0.003, bed.mass = 1e-4, bed.gravity = 9.5, bed.width = 0.09;
  bed.amplitude = 0.002, bed.frequency = 25;
  write_text(map.file("bed.json"), dump(bed.to_json()));
  // A lone stage knows no bed while its options are read, so these are given again; the height of the bed is not.
  const Json json = map.run(R"({ "gamma": 5, "frequency": "25 Hz", "diameter": "3 mm", "initial_height": 10 })");
  EXPECT_EQ(value(json["gamma"]), 5);
  EXPECT_EQ(value(json["gravity"]), 9.5);
  EXPECT_EQ(value(json["plateau_density"]), 1.1);
  EXPECT_EQ(value(json["frequency"]), 25);
  EXPECT_EQ(value(json["diameter"]), 0.003);
  const double critical = value(json["critical_temperature"]);
  EXPECT_EQ(value(json["measured_temperature"]), 0.05);
  EXPECT_EQ(error(json["measured_temperature"]), 0.004);
  EXPECT_DOUBLE_EQ(value(json["measured_reduced_temperature"]), 0.05 / critical);
  EXPECT_DOUBLE_EQ(error(json["measured_reduced_temperature"]), 0.004 / critical);
  const NumberTable table(map.output("map.csv"));
  ASSERT_EQ(table.rows(), json["readings"].size());
  std::size_t with_numbers = 0, differ = 0;
  for (std::size_t r = 0; r < table.rows(); ++r) {
    const Json& row = json["readings"][r];
    for (const char* key : {"name", "jump_height", "expansion", "constants"}) EXPECT_EQ(table.text(key, r), row[key]);
    EXPECT_EQ(table("in_range", r), row["in_range"].get<bool>() ? 1 : 0);
    if (row["jump"].is_null()) continue;
    ++with_numbers;
    EXPECT_DOUBLE_EQ(table("jump", r), value(row["jump"]));
    EXPECT_DOUBLE_EQ(table("rise", r), value(row["rise"]));
    differ += value(row["jump"]) != value(row["rise"]);
    EXPECT_DOUBLE_EQ(table("reduced_temperature", r), value(row["reduced_temperature"]));
    EXPECT_NEAR(value(row["temperature"]), value(row["reduced_temperature"]) * critical, 1e-9 * critical);
    EXPECT_DOUBLE_EQ(value(row["temperature_over_mg"]), value(row["temperature"]) * 0.003);
  }
  EXPECT_GT(with_numbers, 4U);
  EXPECT_GT(differ, 0U) << "else the columns could be exchanged";
  // A reading that is asked for the Gamma of a temperature gives back the temperature that it has at this Gamma.
  const Json& reading = json["readings"][0];
  write_text(map.file("fit.json"), R"({"temperature": {"value": )" + number_text(value(reading["temperature"])) +
                                       R"(}, "plateau_density": {"value": 1.1}})");
  const Json back = map.run(R"({ "gamma": 3, "frequency": "25 Hz", "diameter": "3 mm", "initial_height": 10 })");
  EXPECT_NEAR(value(back["readings"][0]["gamma_of_measured_temperature"]), 5, 1e-6);
}

// A floor that throws nothing gives T = 0 by every formula, and none of them is out of its range.
TEST(MapWarnings, CountTheFormulasThatDoNotApply) {
  LoneStage map(*find_stage("map"));
  const auto said = [&](const std::string& gamma) {
    map.warnings.clear();
    const Json json =
        map.run(R"({ "gamma": )" + gamma +
                R"(, "frequency": "25 Hz", "diameter": "3 mm", "initial_height": 10, "plateau_density": 1.1 })");
    std::size_t out = 0;
    for (const Json& row : json["readings"]) out += row["in_range"].get<bool>() ? 0 : 1;
    return std::pair(map.warnings, out);
  };
  EXPECT_THAT(said("0.9").first, testing::Not(testing::Contains(testing::HasSubstr("do not apply"))));
  EXPECT_EQ(said("0.9").second, 0U);
  const auto [words, out] = said("5");
  EXPECT_GT(out, 0U);
  EXPECT_THAT(words, testing::ElementsAre(
                         std::to_string(out) +
                         " of the 28 formulas that predict T from Gamma do not apply at this Gamma (see map.csv, "
                         "column in_range)."));
}

// Beds of a table whose series name what has no column: with blanks, commas or both between the numbers. A number with
// something behind it is none.
TEST(MapNumbers, ReadAxesFromTheNamesOfSeries) {
  LoneStage map(*find_stage("map"));
  const auto simulated = [&](const std::string& between, const std::string& behind = "") {
    std::string text = "series,gamma,T,T_error\n";
    for (const double e : {0.7, 0.8, 0.9})
      for (const double gamma : {2.0, 3.0, 4.0, 5.0})
        text += "\"wide=1" + between + "restitution=" + number_text(e) + behind + between + "n=3\"," +
                number_text(gamma) + "," + number_text(0.1 * gamma * gamma / std::sqrt(1 - e)) + ",0.01\n";
    write_text(map.file("table.csv"), text);
    return map.run(
        R"({"gamma": 3, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10, "bead_restitution": 0.8,
        "columns": {"axes": ["gamma", "restitution"]}, "table": ")" +
        map.file("table.csv").string() + R"("})")["simulated"];
  };
  const Json found = simulated(" ");
  const double truth = 0.1 * 9 / std::sqrt(0.2);
  EXPECT_NEAR(value(found["temperature"]), truth, 2 * error(found["temperature"]));
  EXPECT_LT(error(found["temperature"]), 0.2 * truth);
  EXPECT_EQ(simulated(","), found);
  EXPECT_EQ(simulated(", "), found);
  EXPECT_THROW(simulated(" ", "x"), InputError);
}

// T = 0.1 gamma^2/(1 - e) at four Gammas; of the table beds with a temperature above 0 count.
class MapOfBeds : public testing::Test {
 protected:
  Json simulated(const std::string& restitutions, const std::string& options) {
    std::string text = "series,gamma,T,T_error,frequency,initial_height\n";
    for (const char e : restitutions)
      for (const double gamma : {2.0, 3.0, 4.0, 5.0})
        text += std::string("restitution=0.") + e + "," + number_text(gamma) + "," +
                number_text(0.1 * gamma * gamma / (1 - 0.1 * (e - '0'))) + ",0.001,20,10\n";
    write_text(map_.file("table.csv"), text + "restitution=0.8,2,0,0.001,20,10\nrestitution=0.8,2,,0.001,20,10\n");
    map_.warnings.clear();
    return map_.run(R"({"frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10, "table": ")" +
                    map_.file("table.csv").string() + "\", " + options + "}");
  }
  std::string refusal(const std::string& options) {
    try {
      simulated("8", options);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  LoneStage map_{*find_stage("map")};
};

TEST_F(MapOfBeds, HasItsTemperatureInEveryUnit) {
  const Json map =
      simulated("789", R"("gamma": 3, "bead_restitution": 0.8, "columns": {"axes": ["gamma", "restitution"]})");
  const Json& found = map["simulated"];
  EXPECT_EQ(found["status"], "ok");
  EXPECT_EQ(found["beds"], 12);
  EXPECT_EQ(found["inside"], true);
  EXPECT_EQ(found["at"], Json::parse(R"({"gamma": 3.0, "restitution": 0.8})"));
  EXPECT_NEAR(value(found["temperature_over_mg"]), 0.003 * value(found["temperature"]), 1e-15);
  EXPECT_NEAR(error(found["temperature_over_mg"]), 0.003 * error(found["temperature"]), 1e-15);
  EXPECT_NEAR(value(found["reduced_temperature"]), value(found["temperature"]) / value(map["critical_temperature"]),
              1e-12);
  EXPECT_EQ(found["temperature_over_mg"]["unit"], "m");
  EXPECT_THAT(map_.warnings, testing::Not(testing::Contains(testing::HasSubstr("table"))));
  const Json all =
      simulated("8", R"("gamma": 4, "columns": {"axes": ["gamma", "frequency", "initial_height"]})")["simulated"];
  EXPECT_EQ(all["at"], Json::parse(R"({"gamma": 4.0, "frequency": 20.0, "initial_height": 10.0})"));
}

TEST_F(MapOfBeds, SaysWhatItsTableLacks) {
  const std::string both = R"(, "columns": {"axes": ["gamma", "restitution"]})";
  const std::string few =
      "the table has only 2 values of restitution, so the error of the interpolation does not include the curvature of "
      "T "
      "between them. Add beds at other values";
  simulated("79", R"("gamma": 3, "bead_restitution": 0.8)" + both);
  EXPECT_THAT(map_.warnings, testing::Contains(few));
  simulated("79", R"("gamma": 3, "bead_restitution": 0.9)" + both);
  EXPECT_THAT(map_.warnings, testing::Not(testing::Contains(few))) << "it lies on one of the values";
  simulated("789", R"("gamma": 3, "bead_restitution": 0.75)" + both);
  EXPECT_THAT(map_.warnings, testing::Not(testing::Contains(testing::HasSubstr("the table has only"))));
  const std::string beyond =
      "the bed lies outside the table of simulated beds: its temperature there is an extrapolation";
  EXPECT_EQ(simulated("8", R"("gamma": 5)")["simulated"]["inside"], true);
  EXPECT_THAT(map_.warnings, testing::Not(testing::Contains(beyond)));
  EXPECT_EQ(simulated("8", R"("gamma": 5.01)")["simulated"]["inside"], false);
  EXPECT_THAT(map_.warnings, testing::Contains(beyond));
  EXPECT_EQ(refusal(R"("gamma": 3)" + both),
            "the restitution of the beads is an axis of the table, but no bed in \"from\" states it: give "
            "\"bead_restitution\"");
  EXPECT_THAT(refusal(R"("gamma": 3, "bead_friction": 0.2, "columns": {"axes": ["gamma", "friction"]})"),
              testing::EndsWith("table.csv: row 1 states no friction: there is no such column, and the series "
                                "\"restitution=0.8\" does not name it"));
  const Json none = simulated("", R"("gamma": 3)")["simulated"];
  EXPECT_EQ(none["beds"], 0);
  EXPECT_FALSE(none.contains("temperature"));
  EXPECT_THAT(map_.warnings,
              testing::Contains(testing::StartsWith("the table of simulated beds gives no temperature: ")));
}

// --- fit

// The tail of the hydrostatic profile with T = 0.4 above a solid that ends at 8, as fits are to find it.
std::string tail_profile() {
  const double t = 0.4, shift = 8;
  std::string rows;
  for (int i = 0; i < 60; ++i) {
    const double z = 4 + 0.125 * i;
    // Enskog's tail is steeper than this at first; the fit only has to be the same for both sources.
    const double density = z < shift ? 1.1 : 1.1 * std::exp(-(z - shift) / (2 * t));
    rows += number_text(z) + "," + number_text(density) + ",0.01\n";
  }
  return "# kernel: gaussian:0.5\n# column_number: 12\n" + profile(rows);
}

// Frames of 12 columns of disks whose heights follow the profile, and differ from frame to frame.
std::vector<TrajectoryFrame> frames() {
  std::vector<TrajectoryFrame> all;
  for (int k = 0; k < 40; ++k) {
    TrajectoryFrame frame;
    frame.time = k, frame.width = 6.5;
    for (int i = 0; i < 78; ++i) {
      // Quantiles of the density, moved a little from frame to frame.
      const double part = (i + 0.5 + 0.4 * std::sin(1.7 * k + 2.3 * i)) / 78.0, column = 12 * part;
      const double solid = 12 - 1.1 * 0.8;
      const double z = column < solid ? column / 1.1 - 2 : 8 - 0.8 * std::log(1 - (column - solid) / 0.8801);
      frame.z.push_back(z), frame.x.push_back(0.5 + (i % 6));
      frame.vx.push_back(0), frame.vz.push_back(0);
    }
    all.push_back(std::move(frame));
  }
  return all;
}

// The same frames as a trajectory of a simulated bed and as disks found in photographs.
TEST(BootstrapOverFrames, IsTheSameFromPhotographsAsFromTheSimulation) {
  const std::string options = R"({ "bootstrap": 10, "sweep": false, "compare": false, "answer": false,
      "diameter": "4 mm", "window": { "low": 7, "high": 11 }, "plateau_density": 1.1, "column_number": 12 })";
  LoneStage simulated(*find_stage("fit")), photographed(*find_stage("fit"));
  simulated.add_input("bed", *find_stage("simulate"));
  photographed.add_input("extract", *find_stage("extract"));
  write_text(simulated.file("profile.csv"), tail_profile());
  write_text(photographed.file("profile.csv"), tail_profile());
  write_text(simulated.file("observables.json"), "{}");
  write_text(photographed.file("extract.json"), R"({"width": {"value": 6.5, "unit": "D"}})");
  std::string found = "frame,x_px,y_px,radius_px,x,z,quality\n";
  {
    TrajectoryWriter writer(simulated.file("trajectory.extxyz"));
    int number = 0;
    for (const TrajectoryFrame& frame : frames()) {
      writer.write(frame);
      for (std::size_t i = 0; i < frame.size(); ++i)
        found += std::to_string(number) + ",1,2,3," + number_text(frame.x[i]) + "," + number_text(frame.z[i]) + ",1\n";
      ++number;
    }
    writer.close();
  }
  write_text(photographed.file("disks.csv"), found);
  const Json one = simulated.run(options)["bootstrap"], other = photographed.run(options)["bootstrap"];
  EXPECT_EQ(one["status"], "ok") << one.dump();
  EXPECT_GT(error(one["temperature"]), 0);
  EXPECT_GT(error(one["shift"]), 0);
  EXPECT_EQ(one["resamples"], 10);
  EXPECT_LE(one["succeeded"], 10);
  EXPECT_GT(one["succeeded"], 7);
  EXPECT_EQ(other["window_frames"], one["window_frames"]);
  EXPECT_EQ(other["succeeded"], one["succeeded"]);
  for (const char* key : {"temperature", "shift"}) {
    EXPECT_NEAR(value(other[key]), value(one[key]), 1e-6 * value(one[key])) << key;
    EXPECT_NEAR(error(other[key]), error(one[key]), 1e-5 * error(one[key])) << key;
  }
  // T and its shift have errors of their own.
  EXPECT_GT(std::abs(error(one["temperature"]) - error(one["shift"])), 0.1 * error(one["shift"]));
  const Json& interval = one["temperature_interval"];
  EXPECT_NEAR(interval["low"].get<double>(), other["temperature_interval"]["low"].get<double>(), 1e-6);
  EXPECT_NEAR(interval["high"].get<double>(), other["temperature_interval"]["high"].get<double>(), 1e-6);
  EXPECT_EQ(interval["confidence"], 0.95);
}

// T held at what the simulated bed measured: the mean of both directions.
TEST(FitNumbers, HoldTheMeasuredTemperature) {
  LoneStage fit(*find_stage("fit"));
  fit.add_input("bed", *find_stage("simulate"));
  write_text(fit.file("profile.csv"), tail_profile());
  write_text(fit.file("observables.json"), R"({"temperature_x": {"value": 0.3}, "temperature_z": {"value": 0.5}})");
  const Json json = fit.run(R"({ "temperature_measured": true, "sweep": false, "compare": false, "answer": false })");
  EXPECT_DOUBLE_EQ(value(json["temperature"]), 0.4);
  EXPECT_EQ(json["temperature"]["fixed"], true);
}

// windows.csv and the result file say the same of every window; residuals.csv holds the data as they came.
TEST(FitNumbers, StandInTheTablesAsInTheResult) {
  LoneStage fit(*find_stage("fit"));
  fit.add_input("bed", *find_stage("simulate"));
  write_text(fit.file("profile.csv"), tail_profile());
  write_text(fit.file("observables.json"), "{}");
  const Json json = fit.run(R"({ "compare": false, "answer": false, "plateau_density": 1.1 })");
  const NumberTable windows(fit.output("windows.csv")), residuals(fit.output("residuals.csv")),
      curve(fit.output("curve.csv"));
  ASSERT_EQ(windows.rows(), json["temperature_by_window"].size());
  ASSERT_GT(windows.rows(), 2U);
  for (std::size_t r = 0; r < windows.rows(); ++r) {
    const Json& row = json["temperature_by_window"][r];
    EXPECT_DOUBLE_EQ(windows("low", r), row["low"].get<double>());
    EXPECT_DOUBLE_EQ(windows("high", r), row["high"].get<double>());
    EXPECT_EQ(windows("bins", r), row["bins"].get<double>());
    EXPECT_EQ(windows.text("status", r), row["status"]);
    if (row["status"] != "ok") continue;
    EXPECT_DOUBLE_EQ(windows("temperature", r), row["temperature"].get<double>());
    EXPECT_DOUBLE_EQ(windows("std_error", r), row["temperature_std_error"].get<double>());
    EXPECT_DOUBLE_EQ(windows("shift", r), row["shift"].get<double>());
    EXPECT_DOUBLE_EQ(windows("chi2_per_dof", r), row["chi2_per_dof"].get<double>());
  }
  ASSERT_EQ(residuals.rows(), 60U);
  double chi2 = 0, used = 0;
  for (std::size_t r = 0; r < 60; ++r) {
    EXPECT_DOUBLE_EQ(residuals("height", r), 4 + 0.125 * static_cast<double>(r));
    EXPECT_EQ(residuals("std_error", r), 0.01);
    if (residuals("used", r) == 0) continue;
    ++used;
    chi2 += std::pow((residuals("number_density", r) - residuals("model", r)) / 0.01, 2);
  }
  EXPECT_EQ(used, json["window"]["bins"].get<double>());
  EXPECT_NEAR(chi2, json["chi2"].get<double>(), 1e-6 * chi2);
  EXPECT_DOUBLE_EQ(json["chi2_per_dof"].get<double>(), json["chi2"].get<double>() / json["dof"].get<double>());
  EXPECT_EQ(json["dof"].get<double>(), used - 2) << "T and the shift are free";
  EXPECT_NEAR(json["aic"].get<double>(), json["chi2"].get<double>() + 4, 1e-9);
  EXPECT_NEAR(json["bic"].get<double>(), json["chi2"].get<double>() + 2 * std::log(used), 1e-9);
  // The bare model is above the smoothed one in the solid's corner, and both are the model of the same T.
  ASSERT_GT(curve.rows(), 10U);
  EXPECT_NEAR(curve("number_density", 0), 1.1, 1e-9);
  EXPECT_LE(curve("smoothed_density", curve.rows() - 1), 0.2);
}

// --- kinetic temperatures of an answer

TEST(KineticTemperatures, AreTakenFromABedOrFromAFilm) {
  LoneStage stage(*find_stage("fit"));
  stage.add_input("bed", *find_stage("simulate"), "s");
  stage.add_input("film", *find_stage("extract"), "e");
  write_text(stage.file("s/observables.json"), R"({"temperature_x": {"value": 0.3, "std_error": 0.02},
      "temperature_z": {"value": 0.5, "std_error": 0.03}})");
  // D = 4 mm: T/(m g) = 1.2 mm is 0.3 m g D.
  write_text(stage.file("e/extract.json"), R"({"velocities": {"usable": true,
      "temperature_x_over_mg": {"value": 0.0012, "std_error": 0.00008},
      "temperature_z_over_mg": {"value": 0.002, "std_error": 0.00012}}})");
  for (const Input& input : stage.inputs()) {
    const KineticTemperatures found = kinetic_temperatures(input, 0.004);
    ASSERT_TRUE(found.x && found.z) << input.id;
    EXPECT_NEAR(found.x->value, 0.3, 1e-12) << input.id;
    EXPECT_NEAR(found.x->std_error, 0.02, 1e-12) << input.id;
    EXPECT_NEAR(found.z->value, 0.5, 1e-12) << input.id;
    EXPECT_NEAR(found.z->std_error, 0.03, 1e-12) << input.id;
  }
  EXPECT_FALSE(kinetic_temperatures(stage.inputs()[1], std::nullopt).x) << "a length is none without a diameter";
  // Of disks that could not be followed: none.
  write_text(stage.file("e/extract.json"), R"({"velocities": {"usable": false,
      "temperature_x_over_mg": {"value": 0.0012, "std_error": 0.00008},
      "temperature_z_over_mg": {"value": 0.002, "std_error": 0.00012}}})");
  EXPECT_FALSE(kinetic_temperatures(stage.inputs()[1], 0.004).x);
}

// --- simulate

// A contact duration that is far too long is named as it was given, in the unit of the recipe, and a shorter one with
// it: of 16 mm and 10 m/s^2 the unit of time is 40 ms.
TEST(ContactDurationWarning, StatesItInTheUnitsOfTheRecipe) {
  for (const bool reduced : {true, false}) {
    LoneStage bed(*find_stage("simulate"));
    bed.reduced = reduced;
    const std::string units = reduced ? R"("disks": {"count": 30, "restitution": 0.7, "contact_duration": 0.1},
            "box": {"width": 8}, "floor": {"motion": "sinusoidal", "gamma": 4, "frequency": 0.4, "restitution": 0.7},
            "settle": 5, "measure": 15)"
                                      : R"("disks": {"count": 30, "restitution": 0.7, "contact_duration": "4 ms",
            "diameter": "16 mm"}, "gravity": "10 m/s^2", "box": {"width": "128 mm"},
            "floor": {"motion": "sinusoidal", "gamma": 4, "frequency": "10 Hz", "restitution": 0.7},
            "settle": "0.2 s", "measure": "0.6 s")";
    bed.run("{" + units + R"(, "replicas": 1})");
    const std::string given = reduced ? "0.1" : "\"4 ms\"", key = "\"contact_duration\": ";
    const auto warning = std::find_if(bed.warnings.begin(), bed.warnings.end(), [&](const std::string& one) {
      return one.find("contact duration t_c = " + given + " makes") != std::string::npos;
    });
    ASSERT_NE(warning, bed.warnings.end()) << given;
    const std::string advice = warning->substr(warning->find(key) + key.size());
    const double shorter =
        reduced ? std::stod(advice) : 25 * parse_quantity(advice.substr(1, advice.find('"', 1) - 1)).value;
    EXPECT_GT(shorter, 0);
    EXPECT_LT(shorter, 0.1);
  }
}

}  // namespace
