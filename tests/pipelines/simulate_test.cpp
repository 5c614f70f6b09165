// The simulate stage as users meet it: what it measures on request, annealing, replicas, floors and starts from files,
// and what bad input gets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/simulate_run.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/sim/spoilt_simulation.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using testing::HasSubstr;
namespace fs = std::filesystem;

class SimulateStage : public testing::Test {
 protected:
  // A bed in reduced units; `more` goes into the stage, `after` behind it.
  ProgramResult simulate(const std::string& more, const std::string& after = "") {
    write_text(folder_ / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 1,
      "units": "reduced", "disks": { "count": 60, "restitution": 0.9 }, "box": { "width": 10, "sides": "periodic" },
      "settle": 5, "measure": 40, )" + more +
                                       " }" + after + " ] }");
    return run_shakebed({"run", "r.json", "--out", "o", "--force"}, folder_.path());
  }
  Json observables(const std::string& stage = "bed") {
    return Json::parse(read_text(folder_ / "o" / stage / "observables.json"));
  }
  std::string header(const std::string& file) {
    const std::string text = read_text(folder_ / "o/bed" / file);
    std::size_t begin = 0;
    while (begin < text.size() && text[begin] == '#') begin = text.find('\n', begin) + 1;
    return text.substr(begin, text.find('\n', begin) - begin);
  }
  ScratchFolder folder_;
};

const char* const langevin =
    R"("bath": { "kind": "langevin", "temperature": 2, "rate": 1, "interval": 0.5 }, "start_temperature": 2)";
const char* const sine =
    R"("replicas": 1, "floor": { "motion": "sinusoidal", "amplitude": 0.8, "frequency": 0.35, "restitution": 0.9 })";

TEST_F(SimulateStage, MeasuresWhatItIsAskedFor) {
  const std::string all = R"("observe": ["order", "velocities", "displacement", "pressure", "phases"], )";
  const ProgramResult result = simulate(all + sine + R"(, "frames": { "count": 0, "phases": 4 })");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json json = observables();
  for (const char* key : {"psi6_local", "psi6_global", "neighbours_per_disk", "vacancies", "a2", "floor_pressure",
                          "collision_rate", "bottom_row_density"}) {
    ASSERT_TRUE(json.contains(key)) << key;
    EXPECT_TRUE(json[key]["value"].is_number() && json[key]["std_error"].is_number()) << key;
  }
  EXPECT_EQ(header("order.csv"), "height,psi6,neighbours,share");
  EXPECT_EQ(header("rows.csv"), "row,height,disks");
  EXPECT_THAT(header("velocities.csv"), HasSubstr("a2"));
  EXPECT_EQ(header("velocity_histogram.csv"), "velocity,density_x,density_z,maxwellian");
  EXPECT_EQ(header("displacement.csv"), "lag,msd_x,std_error_x,msd_z,std_error_z,origins");
  EXPECT_THAT(header("pressure.csv"), HasSubstr("pressure_zz,pressure_zz_error,pressure_xx"));
  EXPECT_THAT(header("phases.csv"), HasSubstr("phase,height,number_density,mean_velocity_x"));
  EXPECT_EQ(header("phases_floor_frame.csv"), header("phases.csv"));

  // What is not asked for is not there, and the bed is the same.
  ASSERT_EQ(simulate(sine + std::string(R"(, "frames": { "count": 0, "phases": 4 })")).exit_code, 0);
  const Json plain = observables();
  EXPECT_FALSE(plain.contains("psi6_local"));
  EXPECT_FALSE(fs::exists(folder_ / "o/bed/order.csv"));
  EXPECT_EQ(plain["center_of_mass"], json["center_of_mass"]);
  EXPECT_EQ(plain["collisions"], json["collisions"]);
}

TEST_F(SimulateStage, FollowsTheSchedule) {
  const ProgramResult result =
      simulate(langevin + std::string(R"(, "schedule": [ { "temperature": 4, "ramp": 10, "hold": 100 },
                                                { "temperature": 1, "hold": 100 } ])"));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string text = read_text(folder_ / "o/bed/schedule.csv");
  EXPECT_THAT(text, HasSubstr("\n0,4,"));
  EXPECT_THAT(text, HasSubstr("\n1,1,"));
  const Json bed = Json::parse(read_text(folder_ / "o/bed/bed.json"));
  EXPECT_EQ(bed["bath_temperature"]["value"], 1);  // that of the measured bed
  // It dissipates, so it is colder than the bath, but hotter than it would be at none.
  const double t = observables()["temperature_x"]["value"];
  EXPECT_LT(t, 1);
  EXPECT_GT(t, 0.2);
}

TEST_F(SimulateStage, ReplicasGiveMeanAndSpread) {
  ASSERT_EQ(simulate(langevin + std::string(R"(, "replicas": 5)")).exit_code, 0);
  const Json json = observables();
  EXPECT_EQ(json["replicas"], 5);
  const std::string text = read_text(folder_ / "o/bed/replicas.csv");
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 6);
  const Json& centre = json["center_of_mass"];
  EXPECT_GT(centre["spread"].get<double>(), 0);
  // Student's t for four degrees of freedom, 2.7764, over 1.95996; never below what the beds state.
  const double between = 2.776445 / 1.959964 * centre["spread"].get<double>();
  EXPECT_NEAR(centre["std_error"].get<double>() * std::sqrt(5.0), std::max(between, centre["within"].get<double>()),
              1e-6 * between);
  // The same whatever the number of threads.
  const std::string profile = read_text(folder_ / "o/bed/profile.csv");
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "one", "--jobs", "1"}, folder_.path()).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "one/bed/profile.csv"), profile);
}

TEST_F(SimulateStage, GoesOnFromAnotherOne) {
  const std::string next = R"(, { "stage": "simulate", "id": "next", "from": ["bed"], "units": "reduced",
      "disks": { "count": 60, "restitution": 0.9 }, "box": { "width": 10, "sides": "periodic" },
      "settle": 0, "measure": 0.01 })";
  const ProgramResult result = simulate(langevin, next);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  // Hardly any time has passed: the disks are where they were.
  const double before = observables("next")["energy_ledger"]["initial"];
  const Json ledger = observables()["energy_ledger"];
  EXPECT_NEAR(before, ledger["kinetic"].get<double>() + ledger["potential"].get<double>(), 1e-9 * before);
  // Another number of disks is refused.
  std::string other = next;
  other.replace(other.find("\"count\": 60"), 11, "\"count\": 61");
  const ProgramResult refused = simulate(langevin, other);
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.err, HasSubstr("the last frame has 60 disks, but the bed has 61"));
}

// The sine as a table in a file is the sine: the spline through 64 points is as good as it (5e-7 of its amplitude), but
// a bed is chaotic, so it is compared before it has forgotten its start.
TEST_F(SimulateStage, TakesTheFloorFromAFile) {
  std::string csv = "# a shaker's period\ntime,height\n";
  const double period = 1 / 0.35;
  for (int k = 0; k < 64; ++k)
    csv += std::to_string(period * k / 64) + "," + std::to_string(0.8 * std::sin(2 * std::numbers::pi * k / 64)) + "\n";
  write_text(folder_ / "shaker.csv", csv);
  const std::string table = R"("floor": { "motion": "table", "file": "shaker.csv", "restitution": 0.9 })";
  ASSERT_EQ(simulate(table).exit_code, 0);
  const Json by_file = observables();
  ASSERT_EQ(simulate(sine).exit_code, 0);
  const double rise = observables()["center_of_mass_rise"]["value"],
               error = observables()["center_of_mass_rise"]["std_error"];
  EXPECT_NEAR(by_file["center_of_mass_rise"]["value"].get<double>(), rise, 5 * error);

  const auto refused = [&](const std::string& text) {
    write_text(folder_ / "shaker.csv", text);
    const ProgramResult result = simulate(table);
    EXPECT_EQ(result.exit_code, 4) << result.err;
    return result.err;
  };
  EXPECT_THAT(refused("time,height\n0,0\n1,1\n2,x\n3,0\n"), HasSubstr("shaker.csv:4: \"x\" is not a number"));
  EXPECT_THAT(refused("time,height\n0,0\n1,1\n5,1\n6,0\n"),
              HasSubstr("shaker.csv:4: the times are not equally spaced"));
  EXPECT_THAT(refused("time,height\n0,0\n1,1\n2,1\n"), HasSubstr("at least 4 positions, found 3"));
  EXPECT_THAT(refused("when,where\n0,0\n"), HasSubstr("shaker.csv:1: expected a header"));
  write_text(folder_ / "shaker.csv", "height\n0\n1\n0\n-1\n");
  const ProgramResult no_period = simulate(table);
  EXPECT_EQ(no_period.exit_code, 3);
  EXPECT_THAT(no_period.err, HasSubstr("the period of the floor is not known"));
}

TEST_F(SimulateStage, RefusesWhatCannotBeAsked) {
  const auto refused = [&](const std::string& more) {
    const ProgramResult result = simulate(more);
    EXPECT_EQ(result.exit_code, 3) << more << result.err;
    return result.err;
  };
  EXPECT_THAT(refused(R"("observe": ["oder"])"), HasSubstr("Did you mean \"order\"?"));
  EXPECT_THAT(refused(R"("schedule": [ { "temperature": 1, "hold": 5 } ])"),
              HasSubstr("this bed has no bath with a temperature"));
  EXPECT_THAT(refused(langevin + std::string(R"(, "schedule": [ { "temperature": 1 } ])")), HasSubstr("/schedule/0"));
  // A box without a floor has no heights.
  write_text(folder_ / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 1,
      "units": "reduced", "disks": { "count": 60 }, "gravity": 0, "measure": 40, "observe": ["pressure"],
      "box": { "width": 10, "sides": "periodic", "lid": { "kind": "periodic", "height": 10 } } } ] })");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder_.path());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("the box is periodic upwards"));
}

// A run that loses precision never goes on quietly: it stops, says what, when and after how much, and leaves its last
// sound state in the form in which a killed run finds it again.
TEST(SimulatePrecision, LostStopsTheRunWithItsLastSoundState) {
  using namespace shakebed;
  const auto make = [] {
    sim::Scene scene;
    scene.gravity = sim::UniformGravity{};
    scene.disks.species = {{50, 1, 1}};
    scene.disks.contact = {0.9, 0, 0};
    scene.box.width = 10;
    scene.box.sides = sim::PeriodicSides{};
    scene.box.floor = sim::SinusoidalFloor{0.5, 0.5};
    return sim::simulate(scene);
  };
  auto run = make();
  run->advance_to(run->next_synchronisation());
  const std::vector<std::uint8_t> sound = run->checkpoint();
  run->advance_to(20);
  ScratchFolder folder;
  const fs::path kept = folder / "checkpoint";
  sim::Spoilt spoilt(std::move(run));
  EXPECT_NO_THROW(pipelines::require_precision(spoilt, sound, kept));
  EXPECT_FALSE(fs::exists(kept));
  spoilt.overlap = 1e-3;
  try {
    pipelines::require_precision(spoilt, sound, kept);
    FAIL() << "a run with an overlap of 1e-3 D goes on";
  } catch (const pipelines::StageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("at time 20 "));
    EXPECT_THAT(error.what(), HasSubstr(std::to_string(spoilt.counters().collisions()) + " collisions"));
    EXPECT_THAT(error.what(), HasSubstr("two disks overlap by 0.001 D"));
    EXPECT_THAT(error.what(), HasSubstr("stored in " + kept.string()));
  }
  const std::string text = read_text(kept);
  ASSERT_GT(text.size(), sound.size());
  EXPECT_EQ(text.substr(text.size() - sound.size()), std::string(sound.begin(), sound.end()));
  // From that state it goes on as it had come.
  auto again = make();
  again->restore({text.end() - static_cast<std::ptrdiff_t>(sound.size()), text.end()});
  again->advance_to(20);
  EXPECT_EQ(again->counters().collisions(), spoilt.counters().collisions());
  try {
    pipelines::require_precision(spoilt, {}, folder / "none");
    FAIL();
  } catch (const pipelines::StageError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no earlier state was stored"));
  }
  EXPECT_FALSE(fs::exists(folder / "none"));
}

}  // namespace
