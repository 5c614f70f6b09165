// A known temperature by photographs: beds that a reservoir holds at 20 T_c are photographed, found again and fitted.
// What the photographs add to the simulated profile's own error is told apart by fitting that profile, too.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "pipelines/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;

TEST(ThermometerByFrames, FluidAt20CriticalTemperatures) {
  // 118 disks of 3 mm on 30.3 mm: N D/W = 11.683, T_c = 0.104959 m g D = 0.314877 mm. 150 frames, 2 sqrt(D/g) apart.
  constexpr double truth = 20 * 0.314877e-3;
  constexpr int beds = 6;
  std::string stages;
  for (int k = 0; k < beds; ++k) {
    const std::string id = std::to_string(k);
    stages += R"({ "stage": "simulate", "id": "bed)" + id + R"(", "seed": )" + std::to_string(k + 1) +
              R"(, "disks": { "count": 118, "diameter": "3 mm" }, "gravity": "9.81 m/s^2",
                   "box": { "width": "30.3 mm", "sides": "periodic" },
                   "bath": { "kind": "andersen", "temperature": "6.29754 mm", "rate": "17.155 Hz" },
                   "start_temperature": "6.29754 mm", "settle": "1.05 s", "measure": "5.25 s",
                   "frames": { "count": 150 } },
                 { "stage": "render", "id": "photos)" +
              id + R"(", "from": "bed)" + id +
              R"(", "scale": "0.15 mm/px", "noise": 5, "blur": 0.8 },
                 { "stage": "extract", "id": "found)" +
              id + R"(", "from": "photos)" + id +
              R"(", "diameter": "3 mm", "highest": 80 },
                 { "stage": "fit", "id": "seen)" +
              id + R"(", "from": "found)" + id +
              R"(", "window": { "low": 8 }, "sweep": false, "compare": false },
                 { "stage": "fit", "id": "simulated)" +
              id + R"(", "from": "bed)" + id + R"(", "window": { "low": 8 }, "sweep": false, "compare": false })" +
              (k + 1 < beds ? ",\n" : "");
  }
  ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "frames", "stages": [ )" + stages + " ] }");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  double sum = 0, squares = 0, seen_sum = 0, seen_squares = 0;
  for (int k = 0; k < beds; ++k) {
    const auto fit = [&](const char* name) {
      const Json json = Json::parse(read_text(folder / "o" / (name + std::to_string(k)) / "fit.json"));
      EXPECT_EQ(json["status"], "ok");
      return json["temperature_over_mg"];
    };
    const Json photographed = fit("seen"), simulated = fit("simulated");
    const double seen = photographed["value"].get<double>() / truth,
                 error = photographed["std_error"].get<double>() / truth,
                 own = simulated["value"].get<double>() / truth;
    std::printf("  T over the bath's by frames %.4f +- %.4f, by the simulated profile %.4f +- %.4f\n", seen, error, own,
                simulated["std_error"].get<double>() / truth);
    EXPECT_NEAR(seen, 1, 3.5 * error) << "bed " << k;  // of 6 beds: one false alarm in 360
    EXPECT_LT(error, 0.03);
    sum += seen - own, squares += (seen - own) * (seen - own);
    seen_sum += seen, seen_squares += seen * seen;
  }
  const auto error_of = [](double total, double total_squares) {
    return std::sqrt((total_squares - total * total / beds) / (beds * (beds - 1)));
  };
  const double difference = sum / beds, error = error_of(sum, squares);
  std::printf("  mean by frames %.4f +- %.4f; by frames less by the simulated profile %.4f +- %.4f\n", seen_sum / beds,
              error_of(seen_sum, seen_squares), difference, error);
  EXPECT_LT(error, 0.004);
  EXPECT_LT(std::abs(difference), 0.01) << "photographs add a bias of more than 1 %";
}

}  // namespace
