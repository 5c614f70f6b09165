// The critical stage and the map over simulated beds: what they make of a study, and of tables that are none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using testing::HasSubstr;

class StudyTables : public testing::Test {
 protected:
  ProgramResult run(const std::string& stages) {
    write_text(folder_ / "r.json", R"({ "name": "t", "stages": [ )" + stages + " ] }");
    return run_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
  }
  Json result(const std::string& stage) { return Json::parse(read_text(folder_ / "o" / stage / (stage + ".json"))); }
  ScratchFolder folder_;
};

// Beds of mu = 10 at six temperatures: the bottom loosens as T rises, below the densities that the best equation of
// state gives it (1.150 at 0.2 T_c, 1.131 at T_c) only by its preparation.
const std::string study = R"({ "stage": "study", "id": "beds", "seed": 3, "replicas": 2,
    "parameter": { "name": "bath_T", "values": [0.1, 0.4, 1, 2, 4, 8], "times": 0.10291,
                   "set": ["/stages/bed/bath/temperature", "/stages/bed/start_temperature"] },
    "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 231 },
                  "box": { "width": 20.2, "sides": "periodic" }, "observe": ["order"], "start_temperature": 1,
                  "bath": { "kind": "langevin", "temperature": 1, "rate": 0.5, "interval": 0.1 },
                  "settle": 40, "measure": 60 } ],
    "collect": { "T": { "at": "/bed/temperature_x" }, "bottom_density": { "at": "/bed/bottom_density" },
                 "psi6": { "at": "/bed/psi6_local" } } })";

TEST_F(StudyTables, TellTheTemperaturesAtWhichThresholdsAreCrossed) {
  const ProgramResult ran = run(study + R"(, { "stage": "critical", "from": "beds", "temperature": "bath_T",
      "densities": [1.13, 1.10, 0.3], "orders": [0.9] })");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = result("critical");
  const Json& density = json["T_c"]["series"]["all"];
  ASSERT_EQ(density.size(), 3u);
  const double high = density[0]["temperature"]["value"], low = density[1]["temperature"]["value"];
  EXPECT_GT(high, 0.5);
  EXPECT_LT(high, 2);
  EXPECT_GT(low, high);
  EXPECT_GT(density[0]["temperature"]["std_error"].get<double>(), 0);
  EXPECT_EQ(density[2]["status"], "outside range");
  EXPECT_TRUE(density[2]["temperature"].is_null());
  EXPECT_THAT(ran.err, HasSubstr("1 of 4 thresholds are not crossed"));
  EXPECT_EQ(json["T_c_prime"]["series"]["all"][0]["status"], "ok");
  EXPECT_THAT(read_text(folder_ / "o/critical/critical.csv"), HasSubstr("\nall,T_c,1.13,"));
  const ProgramResult refused = run(study + R"(, { "stage": "critical", "from": "beds", "density": "botom_density" })");
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.err, HasSubstr("did you mean \"bottom_density\"?"));
}

// T = 0.1 Gamma^2 (1 - e)^(-1/2) (1 + mu)^(-1), 4 x 3 x 3 beds with 1 % of noise that is told.
std::string table() {
  std::string text = "# a study\nseries,gamma,T,T_error\n";
  int k = 0;
  for (const double e : {0.7, 0.8, 0.9})
    for (const double mu : {0.0, 0.25, 0.5})
      for (const double gamma : {2.0, 3.0, 4.0, 5.0}) {
        const double t = 0.1 * gamma * gamma / std::sqrt(1 - e) / (1 + mu);
        text += "restitution=" + std::to_string(e) + " friction=" + std::to_string(mu) + "," + std::to_string(gamma) +
                "," + std::to_string(t * (1 + 0.01 * std::sin(7.0 * ++k))) + "," + std::to_string(0.01 * t) + "\n";
      }
  return text;
}
const std::string map_stage = R"({ "stage": "map", "gamma": 3.5, "frequency": "20 Hz", "diameter": "2.99 mm",
    "initial_height": 10, "table": "table.csv", "bead_restitution": 0.85, "bead_friction": 0.1,
    "columns": { "axes": ["gamma", "restitution", "friction"] } })";

TEST_F(StudyTables, AreAMapFromGammaToTemperature) {
  write_text(folder_ / "table.csv", table());
  const ProgramResult ran = run(map_stage);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = result("map");
  const Json& found = json["simulated"];
  EXPECT_EQ(found["status"], "ok");
  EXPECT_EQ(found["beds"], 36);
  EXPECT_EQ(found["inside"], true);
  const double truth = 0.1 * 3.5 * 3.5 / std::sqrt(0.15) / 1.1, t = found["temperature"]["value"],
               error = found["temperature"]["std_error"];
  EXPECT_NEAR(t, truth, 2 * error);
  EXPECT_LT(error, 0.2 * truth);
  EXPECT_NEAR(found["temperature_over_mg"]["value"].get<double>(), t * 2.99e-3, 1e-12);
  EXPECT_NEAR(found["temperature_over_mg"]["std_error"].get<double>(), error * 2.99e-3, 1e-12);
  const double critical = json["critical_temperature"]["value"];
  EXPECT_NEAR(found["reduced_temperature"]["value"].get<double>(), t / critical, 1e-9 * t / critical);
  EXPECT_NEAR(found["reduced_temperature"]["std_error"].get<double>(), error / critical, 1e-9 * t / critical);
  EXPECT_EQ(found["at"]["gamma"], 3.5);
  EXPECT_EQ(found["at"]["restitution"], 0.85);
  EXPECT_EQ(found["at"]["friction"], 0.1);
  EXPECT_LE(found["interpolation_error"].get<double>() * t, error) << "it is part of the error";
  EXPECT_TRUE(json["readings"].size() > 4) << "the theory stands beside it";
  EXPECT_THAT(read_text(folder_ / "o/report.html"), HasSubstr("simulated beds at"));
  std::string outside = map_stage;
  outside.replace(outside.find("3.5"), 3, "9.0");
  const ProgramResult beyond = run(outside);
  EXPECT_EQ(beyond.exit_code, 0);
  EXPECT_THAT(beyond.err, HasSubstr("extrapolation"));
  EXPECT_EQ(result("map")["simulated"]["inside"], false);
}

TEST_F(StudyTables, ThatAreNoneAreNamed) {
  const auto refused = [&](const std::string& text) {
    write_text(folder_ / "table.csv", text);
    const ProgramResult ran = run(map_stage);
    EXPECT_EQ(ran.exit_code, 4) << text;
    return ran.err;
  };
  EXPECT_THAT(refused("series,gamma,T\n"), HasSubstr("table.csv: the table has no rows"));
  EXPECT_THAT(refused("series,gamma,T\na,1\n"), HasSubstr("table.csv:2: expected 3 columns"));
  EXPECT_THAT(refused("series,gamma,T\nrestitution=0.9 friction=0,x,1\n"), HasSubstr("\"x\" in column \"gamma\""));
  EXPECT_THAT(refused("series,gamma,T\nrestitution=0.9,2,1\n"), HasSubstr("states no friction"));
  EXPECT_THAT(refused("series,gamma,temp\na,2,1\n"), HasSubstr("has no column \"T\""));
  // Too few beds: no temperature, and a word.
  write_text(folder_ / "table.csv", "series,gamma,T\nrestitution=0.9 friction=0,2,1\n");
  const ProgramResult few = run(map_stage);
  EXPECT_EQ(few.exit_code, 0);
  EXPECT_THAT(few.err, HasSubstr("gives no temperature"));
  EXPECT_THAT(read_text(folder_ / "o/report.html"), HasSubstr("simulated beds give no temperature"));
  std::string without = map_stage;
  without.replace(without.find(R"("bead_friction": 0.1,)"), 21, "");
  EXPECT_THAT(run(without).err, HasSubstr("give \"bead_friction\""));
}

}  // namespace
