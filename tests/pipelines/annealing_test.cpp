// What schedule.csv says of one disk in free flight.
#include "pipelines/stages/annealing.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "sim/engine/simulation.hpp"
#include "statistics/correlated_series.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;

// Its kinetic temperature stays (0.3^2 + 0.4^2)/2 while it climbs by 0.4 a unit of time: the means of the 32 looks in
// the second half of the hold, and the error of each under its own name.
TEST(Annealing, HasTheTemperatureAndTheHeightOfTheSecondHalfOfEachHold) {
  sim::Scene scene;
  scene.gravity = sim::Weightless{};
  scene.disks.species = {{1, 1, 1}};
  scene.box.width = 100;
  scene.box.sides = sim::PeriodicSides{};
  scene.box.top = sim::PeriodicTop{100};
  scene.start = sim::PlacedStart{{{50, 10, 0.3, 0.4, 0, 0}}};
  const auto simulation = sim::simulate(scene);
  Annealing annealing({{2, 0, 64}}, 2);
  annealing.prepare(*simulation);
  std::vector<double> heights;
  for (std::uint64_t piece = 0; piece < 64; ++piece) {
    simulation->advance_to(static_cast<double>(piece + 1));
    annealing.step(*simulation, piece);
    if (piece >= 32) heights.push_back(10 + 0.4 * static_cast<double>(piece + 1));
  }
  std::vector<StatedColumn> columns;
  for (const char* name : {"step", "bath", "temperature", "temperature_error", "height", "height_error"})
    columns.push_back({name, "1", ""});
  const ScratchFolder folder;
  annealing.rows(Table("", columns)).write(folder / "schedule.csv");
  const NumberTable table(folder / "schedule.csv");
  ASSERT_EQ(table.rows(), 1U);
  EXPECT_EQ(table("step", 0), 0);
  EXPECT_EQ(table("bath", 0), 2);
  EXPECT_NEAR(table("temperature", 0), 0.125, 1e-9);
  EXPECT_NEAR(table("temperature_error", 0), 0, 1e-9);
  EXPECT_NEAR(table("height", 0), 10 + 0.4 * 48.5, 1e-9);
  EXPECT_NEAR(table("height_error", 0), statistics::mean_of(heights).std_error, 1e-9);
  EXPECT_GT(table("height_error", 0), 0.1);
}

}  // namespace
