// The numbers of the simulate stage against one another: sums, units and errors that hold for every bed.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "fit/theory/equation_of_state.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::replica_seed;

// 24 disks of 4 mm in 25.2 mm: 6.3 D. With g = 10 m/s^2 the unit of time is 20 ms, a period of 50 ms is 2.5 of them.
constexpr double disks = 24, width = 6.3, period = 2.5, periods = 12, phases = 8, looks = periods * phases;
const std::string shaken_bed =
    R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 5, "replicas": 1,
    "disks": { "count": 24, "diameter": "4 mm", "restitution": 0.8, "friction": 0.2, "presses": false }, "gravity": "10 m/s^2",
    "box": { "width": "25.2 mm", "sides": { "kind": "hard", "restitution": 0.8 } },
    "floor": { "motion": "sinusoidal", "amplitude": "1 mm", "frequency": "20 Hz", "restitution": 0.8 },
    "settle": "0 s", "measure": "0.6 s", "frames": { "count": 8, "phases": 8 },
    "observe": ["order", "velocities", "displacement", "pressure", "phases"] } ] })";

class ShakenBed : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    write_text(*folder_ / "r.json", shaken_bed);
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder_->path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    json_ = new Json(Json::parse(read_text(*folder_ / "o/bed/observables.json")));
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete json_;
  }
  static NumberTable table(const std::string& name) { return NumberTable(*folder_ / ("o/bed/" + name)); }
  static double sum(const std::vector<double>& values) {
    double total = 0;
    for (const double one : values) total += one;
    return total;
  }
  static ScratchFolder* folder_;
  static Json* json_;
};
ScratchFolder* ShakenBed::folder_ = nullptr;
Json* ShakenBed::json_ = nullptr;

TEST_F(ShakenBed, HasItsTemperaturesAsLengthsToo) {
  for (const std::string name : {"temperature_x", "temperature_z", "temperature_z_local", "temperature_x_without_flow",
                                 "temperature_z_without_flow", "spin_temperature"}) {
    const Json &plain = (*json_)[name], &length = (*json_)[name + "_over_mg"];
    EXPECT_EQ(plain["unit"], "m g D");
    EXPECT_EQ(length["unit"], "m");
    EXPECT_GT(error(plain), 0) << name;
    EXPECT_DOUBLE_EQ(value(length), 0.004 * value(plain)) << name;
    EXPECT_DOUBLE_EQ(error(length), 0.004 * error(plain)) << name;
  }
}

// Measured from the start: the shares are those of the whole run. What t_c withholds is what T is raised by.
TEST_F(ShakenBed, HasTheSharesOfItsElasticContacts) {
  EXPECT_GT((*json_)["elastic_contacts"], 0);
  EXPECT_DOUBLE_EQ(value((*json_)["elastic_share"]),
                   (*json_)["elastic_contacts"].get<double>() / (*json_)["collisions"].get<double>());
  const double withheld = value((*json_)["withheld_share"]);
  EXPECT_GT(withheld, 0);
  EXPECT_LT(withheld, 1);
  EXPECT_DOUBLE_EQ(value((*json_)["contact_duration_effect"]), withheld);
}

// The drift is twice what the mean of the whole exceeds that of its first half by.
TEST_F(ShakenBed, DriftsByWhatItsFirstHalfMisses) {
  const ProgramResult ran = run_shakebed(
      {"run", "r.json", "--out", "half", "--set", "/stages/bed/measure=0.3 s", "--set", "/stages/bed/frames/count=4"},
      folder_->path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json half = Json::parse(read_text(*folder_ / "half/bed/observables.json"));
  for (const auto& [drift, mean] :
       {std::pair{"drift_temperature_x", "temperature_x"}, std::pair{"drift_center_of_mass", "center_of_mass"}}) {
    EXPECT_NEAR(value((*json_)[drift]), 2 * (value((*json_)[mean]) - value(half[mean])), 1e-9) << drift;
    EXPECT_EQ((*json_)[drift]["unit"], (*json_)[mean]["unit"]);
    EXPECT_GT(error((*json_)[drift]), 0);
  }
}

TEST_F(ShakenBed, CountsItsContacts) {
  const double pairs = (*json_)["disk_collisions"], time = periods * period;
  EXPECT_NEAR(value((*json_)["collision_rate"]), 2 * pairs / (disks * time), 1e-9) << "either disk of a pair counts";
  EXPECT_EQ((*json_)["collision_rate"]["unit"], "sqrt(g/D)");
  EXPECT_EQ((*json_)["collisions"].get<double>(),
            pairs + (*json_)["wall_collisions"].get<double>() + (*json_)["floor_collisions"].get<double>());
  EXPECT_GE((*json_)["events"], (*json_)["collisions"]);
  EXPECT_LE((*json_)["elastic_contacts"], (*json_)["collisions"]);
  EXPECT_GT((*json_)["wall_collisions"], 0);
  EXPECT_EQ((*json_)["periods"], periods);
  EXPECT_LT(std::abs(value((*json_)["max_overlap"])), 1e-9);
}

// Rows of 6, 5, 6, 5 and 2 at heights 1/2 + k sqrt(3)/2.
TEST_F(ShakenBed, RisesAboveItsRows) {
  const double ideal = 0.5 + std::numbers::sqrt3 / 2 * (5 + 12 + 15 + 8) / 24;
  EXPECT_NEAR(value((*json_)["ideal_center_of_mass"]), ideal, 1e-12);
  const Json &centre = (*json_)["center_of_mass"], &rise = (*json_)["center_of_mass_rise"];
  EXPECT_NEAR(value(rise), value(centre) - ideal, 1e-12);
  EXPECT_EQ(error(rise), error(centre));
  const Json& by_phase = (*json_)["center_of_mass_by_phase"];
  ASSERT_EQ(by_phase.size(), phases);
  double mean = 0;
  for (const Json& one : by_phase) mean += one.get<double>() / phases;
  EXPECT_NEAR(mean, value(centre), 1e-9);
  EXPECT_NEAR(value((*json_)["column_number"]), disks / width, 1e-12);
  EXPECT_NEAR(value((*json_)["gamma"]), 0.001 * std::pow(2 * std::numbers::pi * 20, 2) / 10, 1e-12);
}

TEST_F(ShakenBed, ClosesItsLedger) {
  const Json& ledger = (*json_)["energy_ledger"];
  const auto at = [&](const char* name) { return ledger[name].get<double>(); };
  EXPECT_EQ(ledger["unit"], "m g D");
  const double end = at("kinetic") + at("potential") + at("compressed"),
               made = at("initial") + at("floor_work") + at("bath_work") - at("dissipated") - at("step_error");
  EXPECT_NEAR(std::abs(end - made), std::abs(at("imbalance")), 1e-9 * end);
  EXPECT_NEAR(end, made, 1e-8 * end);
  EXPECT_GT(at("dissipated"), 0);
  EXPECT_GT(at("floor_work"), 0);
}

// The profile holds all disks, its mean height is that of the centre of mass, and each row says how it was counted.
TEST_F(ShakenBed, HasItsDisksInTheProfile) {
  const NumberTable profile = table("profile.csv");
  const double spacing = profile("height", 1) - profile("height", 0);
  double area = 0, heights = 0;
  for (std::size_t r = 0; r < profile.rows(); ++r) {
    const double density = profile("number_density", r);
    area += density * spacing, heights += density * spacing * profile("height", r);
    EXPECT_NEAR(profile("area_fraction", r), std::numbers::pi / 4 * density, 1e-12);
    EXPECT_NEAR(profile("samples", r), density * width * spacing * looks, 0.5 + 1e-6);
  }
  EXPECT_NEAR(area * width, disks, 1e-6);
  EXPECT_NEAR(heights / area, value((*json_)["center_of_mass"]), 1e-6);
  const NumberTable frames = table("profile_frames.csv"), floor = table("profile_floor_frame.csv");
  for (const NumberTable* other : {&frames, &floor})
    EXPECT_NEAR(sum(other->column("number_density")) * spacing * width, disks, 1e-6);
  // Seen from the floor the mean height is the same: over a period the floor is at 0.
  double seen = 0;
  for (std::size_t r = 0; r < floor.rows(); ++r) seen += floor("number_density", r) * spacing * floor("height", r);
  EXPECT_NEAR(seen * width / disks, value((*json_)["center_of_mass"]), 1e-6);
  EXPECT_NEAR(sum(frames.column("samples")), 8 * disks, 0.02 * 8 * disks) << "frames, not looks";
}

// covariance.csv has the squares of the profile's errors on its diagonal, where they come from the same windows.
TEST_F(ShakenBed, HasTheCovarianceOfItsProfile) {
  const NumberTable covariance = table("covariance.csv"), profile = table("profile.csv");
  std::map<double, double> diagonal;
  for (std::size_t r = 0; r < covariance.rows(); ++r) {
    EXPECT_LE(covariance("height_i", r), covariance("height_j", r));
    if (covariance("height_i", r) == covariance("height_j", r))
      diagonal[covariance("height_i", r)] = covariance("covariance", r);
  }
  double by_errors = 0, by_covariance = 0;
  for (std::size_t r = 0; r < profile.rows(); ++r) {
    if (!diagonal.contains(profile("height", r))) continue;
    by_errors += std::pow(profile("std_error", r), 2), by_covariance += diagonal[profile("height", r)];
  }
  EXPECT_GT(by_covariance, 0.4 * by_errors);
  EXPECT_LT(by_covariance, 2.5 * by_errors);
}

// Layers of 1 D with their middles at halves, the same in every table; shares of all disks.
TEST_F(ShakenBed, HasTheSameLayersInEveryTable) {
  const NumberTable layers = table("layers.csv"), order = table("order.csv"), velocities = table("velocities.csv");
  ASSERT_EQ(layers.rows(), order.rows());
  ASSERT_EQ(layers.rows(), velocities.rows());
  double mean = 0, psi6 = 0, neighbours = 0;
  for (std::size_t r = 0; r < layers.rows(); ++r) {
    EXPECT_EQ(layers("height", r), order("height", r));
    EXPECT_EQ(layers("height", r), velocities("height", r));
    EXPECT_NEAR(layers("height", r) - std::floor(layers("height", r)), 0.5, 1e-12);
    EXPECT_NEAR(layers("share", r), order("share", r), 1e-12);
    EXPECT_NEAR(velocities("samples", r), order("share", r) * disks * looks, 1e-6);
    EXPECT_NEAR(velocities("number_density", r), order("share", r) * disks / width, 1e-9) << "layers of 1 D";
    mean += order("share", r) * order("height", r);
    psi6 += order("share", r) * order("psi6", r);
    neighbours += order("share", r) * order("neighbours", r);
  }
  EXPECT_NEAR(sum(order.column("share")), 1, 1e-12);
  EXPECT_NEAR(mean, value((*json_)["center_of_mass"]), 0.25);
  EXPECT_NEAR(psi6, value((*json_)["psi6_local"]), 1e-9);
  EXPECT_NEAR(neighbours, value((*json_)["neighbours_per_disk"]), 1e-9);
  for (const int percent : {70, 80, 90}) {
    double share = 0;
    for (std::size_t r = 0; r < order.rows(); ++r)
      if (order("psi6", r) >= percent / 100.0) share += order("share", r);
    EXPECT_NEAR(value((*json_)["crystal_share_" + std::to_string(percent)]), share, 1e-12) << percent;
  }
}

TEST_F(ShakenBed, HasItsPhasesInPeriods) {
  for (const char* name : {"phases.csv", "phases_floor_frame.csv"}) {
    const NumberTable cells = table(name);
    double samples = 0;
    std::map<double, double> of_phase;
    for (std::size_t r = 0; r < cells.rows(); ++r) {
      samples += cells("samples", r);
      of_phase[cells("phase", r)] += cells("number_density", r);
    }
    EXPECT_EQ(samples, disks * looks) << name;
    ASSERT_EQ(of_phase.size(), phases) << name;
    int k = 0;
    for (const auto& [phase, density] : of_phase) {
      EXPECT_DOUBLE_EQ(phase, k++ / phases) << name;
      EXPECT_NEAR(density, disks / width, 1e-9) << name;
    }
  }
}

// The mean over phases, weighed by samples, is what the layer shows over all of them.
TEST_F(ShakenBed, HasTheMeanOfItsPhasesInItsLayers) {
  const NumberTable cells = table("phases.csv"), layers = table("velocities.csv");
  for (std::size_t l = 0; l < layers.rows(); ++l) {
    double samples = 0, x = 0, z = 0, energy = 0;
    for (std::size_t r = 0; r < cells.rows(); ++r) {
      if (cells("height", r) != layers("height", l)) continue;
      const double n = cells("samples", r);
      samples += n, x += n * cells("mean_velocity_x", r), z += n * cells("mean_velocity_z", r);
      energy += n * (cells("temperature_z", r) + std::pow(cells("mean_velocity_z", r), 2));
    }
    ASSERT_EQ(samples, layers("samples", l));
    EXPECT_NEAR(x / samples, layers("mean_velocity_x", l), 1e-9);
    EXPECT_NEAR(z / samples, layers("mean_velocity_z", l), 1e-9);
    if (samples > 50) {  // each cell takes its own mean off
      const double layer = layers("temperature_z", l) + std::pow(layers("mean_velocity_z", l), 2);
      EXPECT_NEAR(energy / samples, layer, 0.3 * layer);
    }
  }
}

TEST_F(ShakenBed, HasADistributionOfVelocitiesOfAreaOne) {
  const NumberTable bins = table("velocity_histogram.csv");
  double x = 0, z = 0, m = 0;
  for (std::size_t r = 0; r < bins.rows(); ++r) {
    const double step = bins("velocity", 1) - bins("velocity", 0), u = bins("velocity", r);
    x += step * bins("density_x", r), z += step * bins("density_z", r), m += step * bins("maxwellian", r);
    EXPECT_NEAR(bins("maxwellian", r), std::exp(-u * u / 2) / std::sqrt(2 * std::numbers::pi), 1e-9);
  }
  EXPECT_NEAR(x, 1, 1e-9);
  EXPECT_NEAR(z, 1, 1e-9);
  EXPECT_NEAR(m, 1, 1e-3);
}

TEST_F(ShakenBed, CountsLagsInUnitsOfTimeAndPairsOfLooks) {
  const NumberTable lags = table("displacement.csv");
  ASSERT_GE(lags.rows(), 3U);
  for (std::size_t r = 0; r < lags.rows(); ++r) {
    const double look = lags("lag", r) / (period / phases);
    EXPECT_NEAR(look, std::round(look), 1e-9) << "a lag is a whole number of looks";
    EXPECT_GT(lags("origins", r), 0);
    EXPECT_GE(lags("msd_x", r), 0);
  }
  EXPECT_NEAR(lags("lag", 0), period / phases, 1e-12);
  // Hardly any time for a contact: sqrt(msd) is the mean speed times the lag, within a factor of two.
  EXPECT_LT(lags("msd_x", 0), 1.5 * std::pow(lags("lag", 0), 2) * value((*json_)["temperature_x"]));
}

// Exact averages over time. The lowest layer carries all disks.
TEST_F(ShakenBed, CarriesItsWeight) {
  const NumberTable layers = table("pressure.csv");
  const double thickness = layers("height", 1) - layers("height", 0);
  EXPECT_NEAR(sum(layers.column("number_density")) * thickness * width, disks, 1e-6);
  double below = 0, middle = 0;
  for (std::size_t r = 0; r < layers.rows(); ++r) {
    // The mean over the layer of what lies above: all but what lies below, and a part of the layer itself.
    const double above = disks / width - below, layer = thickness * layers("number_density", r);
    EXPECT_LE(layers("weight_above", r), above + 1e-6);
    EXPECT_GE(layers("weight_above", r), above - layer - 1e-6);
    middle += layers("weight_above", r) - (above - 0.5 * layer);
    below += thickness * layers("number_density", r);
  }
  EXPECT_NEAR(middle, 0, 0.05 * disks / width) << "half a layer makes 0.5 N/W";
  EXPECT_EQ((*json_)["floor_pressure"]["unit"], "m g/D");
  EXPECT_NEAR(value((*json_)["floor_pressure"]), disks / width, 0.25 * disks / width);
}

// What the floor shows is what the laboratory shows less the floor's own motion, a omega cos(2 pi phase) with a = 1/4
// D.
TEST_F(ShakenBed, MovesAgainstItsFloor) {
  const NumberTable lab = table("phases.csv"), floor = table("phases_floor_frame.csv");
  const auto mean_of_phase = [](const NumberTable& cells, double phase, const char* column) {
    double sum = 0;
    for (std::size_t r = 0; r < cells.rows(); ++r)
      if (cells("phase", r) == phase) sum += cells("samples", r) * cells(column, r);
    return sum / (disks * periods);
  };
  for (int k = 0; k < phases; ++k) {
    const double phase = k / phases, omega = 2 * std::numbers::pi / period;
    EXPECT_NEAR(mean_of_phase(floor, phase, "mean_velocity_z"),
                mean_of_phase(lab, phase, "mean_velocity_z") - 0.25 * omega * std::cos(2 * std::numbers::pi * phase),
                1e-6)
        << phase;
    EXPECT_NEAR(mean_of_phase(floor, phase, "mean_velocity_x"), mean_of_phase(lab, phase, "mean_velocity_x"), 1e-9);
    const double lab_t = mean_of_phase(lab, phase, "temperature_x"), t = mean_of_phase(floor, phase, "temperature_x");
    EXPECT_NEAR(t, lab_t, 0.3 * lab_t) << "layers are cut elsewhere";
    EXPECT_GT(mean_of_phase(floor, phase, "temperature_z"), 0);
  }
}

// layers.csv counts what velocities.csv counts, with the layer's mean velocity in the temperature.
TEST_F(ShakenBed, HasTheVelocitiesOfItsLayersTwice) {
  const NumberTable layers = table("layers.csv"), velocities = table("velocities.csv");
  for (std::size_t r = 0; r < layers.rows(); ++r) {
    EXPECT_NEAR(layers("temperature_x", r),
                velocities("temperature_x", r) + std::pow(velocities("mean_velocity_x", r), 2), 1e-9);
    EXPECT_NEAR(layers("mean_velocity_z", r), velocities("mean_velocity_z", r), 1e-9);
    EXPECT_NEAR(layers("spin_temperature", r), velocities("spin_temperature", r), 1e-9);
    // The mean of the phase, and not of the layer, is taken off the vertical velocity.
    EXPECT_LT(layers("temperature_z", r), 4 * (velocities("temperature_z", r) + 0.2));
    EXPECT_GE(velocities("a2", r), -1);
  }
}

// Three disks far from one another that bounce straight up and down: nothing at all happens across, so that no number
// of one direction may stand in the place of the other.
TEST(DisksThatBounceStraightUp, HaveNothingAcross) {
  const ScratchFolder folder;
  {
    shakebed::pipelines::TrajectoryWriter start(folder / "start.extxyz");
    shakebed::pipelines::TrajectoryFrame frame;
    frame.width = 9;
    frame.x = {1.5, 4.5, 7.5}, frame.z = {1.5, 2.25, 3.5}, frame.vx = {0, 0, 0}, frame.vz = {0.3, -0.2, 0.1};
    start.write(frame);
    start.close();
  }
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 2,
      "units": "reduced", "disks": { "count": 3 }, "box": { "width": 9 }, "start": { "kind": "file", "file": "start.extxyz" },
      "settle": 0, "measure": 40, "observe": ["velocities", "displacement", "pressure", "phases"] } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = Json::parse(read_text(folder / "o/bed/observables.json"));
  EXPECT_EQ(value(json["temperature_x"]), 0);
  EXPECT_EQ(error(json["temperature_x"]), 0);
  EXPECT_GT(value(json["temperature_z"]), 0.1);
  EXPECT_GT(error(json["temperature_z"]), 0);
  const auto expect_nothing = [&](const std::string& file,
                                  const std::vector<std::pair<std::string, std::string>>& pairs) {
    const NumberTable table(folder / ("o/bed/" + file));
    for (const auto& [across, upwards] : pairs) {
      double x = 0, z = 0;
      for (std::size_t r = 0; r < table.rows(); ++r) {
        if (!std::isfinite(table(upwards, r))) continue;  // of one pair of looks there is no error
        x += std::abs(table(across, r)), z += std::abs(table(upwards, r));
      }
      EXPECT_EQ(x, 0) << file << " " << across;
      EXPECT_GT(z, 0) << file << " " << upwards;
    }
  };
  expect_nothing("layers.csv", {{"temperature_x", "temperature_z"}});
  expect_nothing("velocities.csv", {{"temperature_x", "temperature_z"}, {"mean_velocity_x", "mean_velocity_z"}});
  expect_nothing("phases.csv", {{"temperature_x", "temperature_z"}, {"mean_velocity_x", "mean_velocity_z"}});
  expect_nothing("displacement.csv", {{"msd_x", "msd_z"}, {"std_error_x", "std_error_z"}});
  expect_nothing("pressure.csv", {{"temperature_x", "temperature_z"},
                                  {"temperature_x_error", "temperature_z_error"},
                                  {"pressure_xx", "pressure_zz"},
                                  {"pressure_xx_error", "pressure_zz_error"}});
}

// Rough disks in free flight, looked at before they meet anything: each keeps its own spin and its own velocity across.
TEST(DisksInFreeFlight, KeepTheSpinsOfTheFileTheyStartFrom) {
  const ScratchFolder folder;
  shakebed::pipelines::TrajectoryFrame frame;
  frame.width = 9;
  frame.x = {1.5, 4.5, 7.5}, frame.z = {1.5, 2.25, 3.5}, frame.vx = {0.1, -0.2, 0.3}, frame.vz = {0.3, -0.2, 0.1};
  frame.spin = {0.5, -1, 2};
  {
    shakebed::pipelines::TrajectoryWriter start(folder / "start.extxyz");
    start.write(frame);
    start.close();
  }
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 2,
      "units": "reduced", "disks": { "count": 3, "inertia": "sphere", "friction": 0.3 }, "box": { "width": 9 },
      "start": { "kind": "file", "file": "start.extxyz" }, "settle": 0, "measure": 0.1, "frames": { "count": 1 },
      "compress": false, "observe": ["velocities"] } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  shakebed::pipelines::TrajectoryReader reader(folder / "o/bed/trajectory.extxyz");
  shakebed::pipelines::TrajectoryFrame seen;
  ASSERT_TRUE(reader.read(seen));
  EXPECT_EQ(seen.spin, frame.spin);
  EXPECT_EQ(seen.vx, frame.vx);
  // The histogram of velocities is in units of sqrt(T) at the first look: (0.01 + 0.04 + 0.09 across, and (49 + 64 +
  // 1)/900 about the mean upwards)/6. Places are rounded to a tenth: 0.474, -0.949 and 1.423.
  const std::filesystem::path histogram = folder / "o/bed/velocity_histogram.csv";
  EXPECT_NEAR(shakebed::pipelines::table_notes(histogram)["temperature"].get<double>(), 2.0 / 45, 1e-6);
  const NumberTable bins(histogram);
  for (std::size_t r = 0; r < bins.rows(); ++r) {
    const double u = bins("velocity", r);
    EXPECT_NEAR(bins("density_x", r), u == 0.5 || u == -0.9 || u == 1.4 ? 10.0 / 3 : 0, 1e-5) << u;
  }
}

// Rows of six that hardly move: the lowest row is 6.06 D wide and sqrt(3)/2 D high.
TEST(ColdBed, HasItsBottomRow) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 2,
      "units": "reduced", "disks": { "count": 24 }, "box": { "width": 6.06, "sides": "periodic" },
      "start_temperature": 1e-4, "settle": 0, "measure": 4 } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json row = Json::parse(read_text(folder / "o/bed/observables.json"))["bottom_row_density"];
  EXPECT_NEAR(value(row), 6 / (6.06 * std::numbers::sqrt3 / 2), 1e-9);
  EXPECT_EQ(row["unit"], "1/D^2");
}

// A fluid of elastic disks in a periodic box: its pressure is that of the best equation of state known.
TEST(PeriodicFluid, HasItsPressureInTheResult) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 2,
      "units": "reduced", "disks": { "count": 120 }, "gravity": 0,
      "box": { "width": 15, "sides": "periodic", "lid": { "kind": "periodic", "height": 16 } },
      "settle": 20, "measure": 400 } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = Json::parse(read_text(folder / "o/bed/observables.json"));
  EXPECT_DOUBLE_EQ(value(json["number_density"]), 0.5);
  const Json& z = json["compressibility_factor"];
  const double expected = shakebed::fit::find_equation_of_state("kolafa-rottner")->compressibility_factor(0.5).value;
  EXPECT_LT(error(z), 0.02);
  // Of N disks Z differs from that of infinitely many by some 1/N.
  EXPECT_NEAR(value(z), expected, 4 * error(z) + expected / 120);
}

// --- replicas

const std::string replicated = R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 1,
    "units": "reduced", "disks": { "count": 30, "restitution": 0.95, "friction": 0.1 },
    "box": { "width": 5.3, "sides": "periodic" },
    "bath": { "kind": "langevin", "temperature": 0.3, "rate": 0.5, "interval": 0.2 },
    "settle": 5, "measure": 30, "observe": ["order", "velocities", "pressure"] } ] })";

// 40 light and 40 heavy (three times the mass) elastic disks above a floor at rest: in equilibrium both species have
// one temperature, and their densities fall as exp(-m g z/T), so that their ratio falls as exp(-2 z/T). Limits at 4
// errors.
TEST(TwoSpecies, ShareTheirEnergyInEquilibrium) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 3,
      "units": "reduced", "disks": { "count": 40, "density": 1, "second": { "count": 40, "diameter": 1, "density": 3 } },
      "box": { "width": 60, "sides": "hard" }, "start_temperature": 10, "settle": 100, "measure": 1000,
      "observe": ["species"] }, { "stage": "fit", "id": "fit", "from": "bed" } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json numbers = Json::parse(read_text(folder / "o/bed/observables.json"));
  // The models of a profile are those of equal disks, and the answer says so.
  const Json answer = Json::parse(read_text(folder / "o/fit/fit.json"))["answer"];
  EXPECT_NE(answer["verdict"], "one temperature");
  EXPECT_NE(answer["why"].get<std::string>().find("two kinds"), std::string::npos) << answer["why"];
  const double light = value(numbers["temperature_first"]), heavy = value(numbers["temperature_second"]);
  EXPECT_EQ(numbers["temperature_first"]["unit"], "m g D");
  EXPECT_NEAR(value(numbers["temperature_ratio"]), heavy / light, 1e-12);
  EXPECT_NEAR(heavy / light, 1, 4 * error(numbers["temperature_ratio"]));
  EXPECT_LT(error(numbers["temperature_ratio"]), 0.03);
  const double all = (value(numbers["temperature_x"]) + value(numbers["temperature_z"])) / 2;
  EXPECT_NEAR(light, all, 4 * std::hypot(error(numbers["temperature_first"]), error(numbers["temperature_x"])));
  EXPECT_NEAR(heavy, all, 4 * std::hypot(error(numbers["temperature_second"]), error(numbers["temperature_x"])));

  const NumberTable layers(folder / "o/bed/species.csv");
  double disks_seen[2] = {}, all_looks = 0, slope_top = 0, slope_bottom = 0, mean_z = 0, mean_log = 0, weight = 0;
  for (const char* name : {"first", "second"}) {
    for (std::size_t r = 0; r < layers.rows(); ++r)
      disks_seen[name[0] == 's'] += layers(std::string("number_density_") + name, r) * 60;
  }
  EXPECT_NEAR(disks_seen[0], 40, 1e-9);
  EXPECT_NEAR(disks_seen[1], 40, 1e-9);
  for (std::size_t r = 0; r < layers.rows(); ++r) all_looks += layers("samples_first", r) / 40;
  for (std::size_t r = 0; r < layers.rows(); ++r) {
    for (const std::string name : {"_first", "_second"}) {
      const double samples = layers("samples" + name, r);
      EXPECT_NEAR(samples, layers("number_density" + name, r) * 60 * all_looks, 1e-6 * (1 + samples));
    }
    const double z = layers("height", r), one = layers("samples_first", r), two = layers("samples_second", r);
    if (z < 0 || z > 12 || two < 300) continue;
    const double w = 1 / (1 / one + 1 / two), log_ratio = std::log(two / one);
    weight += w, mean_z += w * z, mean_log += w * log_ratio;
  }
  mean_z /= weight, mean_log /= weight;
  for (std::size_t r = 0; r < layers.rows(); ++r) {
    const double z = layers("height", r), one = layers("samples_first", r), two = layers("samples_second", r);
    if (z < 0 || z > 12 || two < 300) continue;
    const double w = 1 / (1 / one + 1 / two);
    slope_top += w * (z - mean_z) * (std::log(two / one) - mean_log), slope_bottom += w * (z - mean_z) * (z - mean_z);
    // A layer sees disks for some looks one after the other: about 50 velocities are independent in 300 samples.
    for (const std::string name : {"_first", "_second"}) {
      EXPECT_NEAR(layers("temperature_x" + name, r) / all, 1, 0.35) << z << name;
      EXPECT_NEAR(layers("temperature_z" + name, r) / all, 1, 0.35) << z << name;
    }
    const double both = (layers("temperature_x_second", r) + layers("temperature_z_second", r)) /
                        (layers("temperature_x_first", r) + layers("temperature_z_first", r));
    EXPECT_NEAR(layers("ratio", r), both, 1e-12);
  }
  EXPECT_NEAR(slope_top / slope_bottom, -2 / all, 0.2 * 2 / all) << "barometric: the heavy ones lie below";
}

// One species, or two that are alike, have no second temperature.
TEST(TwoSpecies, MustBeKnownApart) {
  const ScratchFolder folder;
  const std::string recipe = R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced",
      "disks": { "count": 40 SECOND }, "box": { "width": 20 }, "measure": 1, "observe": ["species"] } ] })";
  for (const std::string second : {"", R"(, "second": { "count": 4, "diameter": 1 })"}) {
    std::string text = recipe;
    text.replace(text.find("SECOND"), 6, second);
    write_text(folder / "r.json", text);
    const ProgramResult ran = run_shakebed({"validate", "r.json"}, folder.path());
    EXPECT_EQ(ran.exit_code, 3);
    EXPECT_NE(ran.err.find("/stages/0/observe"), std::string::npos) << ran.err;
    EXPECT_NE(ran.err.find("another diameter or density"), std::string::npos) << ran.err;
  }
}

// Four beds together are the mean of the four one by one. Their standard deviation over two, times Student's t for
// three degrees of freedom, 3.182446, over the normal 1.959964, is the error, or what the beds state where that is
// more.
TEST(Replicas, AreTheMeanOfTheirBeds) {
  const ScratchFolder folder;
  write_text(folder / "r.json", replicated);
  const auto run = [&](const std::string& out, const std::vector<std::string>& set) {
    std::vector<std::string> arguments{"run", "r.json", "--out", out};
    arguments.insert(arguments.end(), set.begin(), set.end());
    const ProgramResult ran = run_shakebed(arguments, folder.path());
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return Json::parse(read_text(folder / (out + "/bed/observables.json")));
  };
  const Json together = run("all", {"--set", "/stages/bed/replicas=4"});
  std::vector<Json> single;
  for (std::uint64_t r = 0; r < 4; ++r)
    single.push_back(
        run("one" + std::to_string(r), {"--set", "/stages/bed/seed=" + std::to_string(replica_seed(1, r))}));
  const NumberTable table(folder / "all/bed/replicas.csv");
  ASSERT_EQ(table.rows(), 4U);
  std::size_t quantities = 0, counts = 0;
  for (const auto& [name, found] : together.items()) {
    if (found.is_object() && found.contains("value")) {
      if (name == "max_overlap") continue;
      double sum = 0, squares = 0;
      for (const Json& one : single) sum += value(one[name]);
      for (const Json& one : single) squares += std::pow(value(one[name]) - sum / 4, 2);
      EXPECT_NEAR(value(found), sum / 4, 1e-12 * (1 + std::abs(sum))) << name;
      EXPECT_EQ(found["unit"], single[0][name]["unit"]) << name;
      if (squares == 0) continue;
      ++quantities;
      double within = 0;
      for (const Json& one : single) {
        if (one[name].contains("std_error")) within += std::pow(error(one[name]), 2) / 4;
      }
      const double between = 3.182446 / 1.959964 * std::sqrt(squares / 3);
      EXPECT_NEAR(error(found), std::max(between, std::sqrt(within)) / 2, 1e-6 * between) << name;
      for (std::size_t r = 0; r < 4; ++r) EXPECT_DOUBLE_EQ(table(name, r), value(single[r][name])) << name;
    } else if (found.is_number_integer() && name != "replicas" && name != "periods") {
      double sum = 0;
      for (const Json& one : single) sum += one[name].get<double>();
      EXPECT_EQ(found.get<double>(), sum) << name;
      ++counts;
    }
  }
  EXPECT_GE(quantities, 15U);
  EXPECT_GE(counts, 4U);
  double largest = 0;
  for (const Json& one : single) largest = std::max(largest, value(one["max_overlap"]));
  EXPECT_EQ(value(together["max_overlap"]), largest);

  const NumberTable profile(folder / "all/bed/profile.csv");
  std::vector<NumberTable> profiles;
  for (int r = 0; r < 4; ++r) profiles.emplace_back(folder / ("one" + std::to_string(r) + "/bed/profile.csv"));
  double worst = 0;
  for (std::size_t i = 0; i < profile.rows(); ++i) {
    double sum = 0, squares = 0, samples = 0, within = 0;
    std::vector<double> densities;
    for (const NumberTable& one : profiles) {
      double density = 0;
      for (std::size_t k = 0; k < one.rows(); ++k) {
        if (one("height", k) != profile("height", i)) continue;
        density = one("number_density", k), samples += one("samples", k);
        within += std::pow(one("std_error", k), 2) / 4;
      }
      densities.push_back(density), sum += density;
    }
    for (const double density : densities) squares += std::pow(density - sum / 4, 2);
    EXPECT_NEAR(profile("number_density", i), sum / 4, 1e-12);
    const double between = 3.182446 / 1.959964 * std::sqrt(squares / 3);
    EXPECT_NEAR(profile("std_error", i), std::max(between, std::sqrt(within)) / 2, 1e-9 + 1e-6 * between);
    worst = std::max(worst, std::abs(profile("samples", i) - samples));
  }
  EXPECT_LE(worst, 2.5) << "each is rounded";

  // The covariance: of a mean of four what each shows of itself, over 16, and more where they differ by more than that.
  const auto variance = [](const NumberTable& covariance) {
    double sum = 0;
    for (std::size_t r = 0; r < covariance.rows(); ++r)
      if (covariance("height_i", r) == covariance("height_j", r)) sum += covariance("covariance", r);
    return sum;
  };
  double own = 0, seen = 0;
  for (int r = 0; r < 4; ++r)
    own += variance(NumberTable(folder / ("one" + std::to_string(r) + "/bed/covariance.csv"))) / 16;
  for (const double one : profile.column("std_error")) seen += one * one;
  EXPECT_NEAR(variance(NumberTable(folder / "all/bed/covariance.csv")) / std::max(own, seen), 1, 1e-6);
}

// A bed between plates, tilted by 60 degrees: g in the plane is 5 m/s^2, and what presses on the plate tan(60 deg) of
// it.
TEST(TiltedCell, StatesItsGravityAndWhatItLosesOnItsPlates) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 5,
    "replicas": 1, "disks": { "count": 24, "diameter": "4 mm", "restitution": 0.8 }, "gravity": "10 m/s^2",
    "box": { "width": "25.2 mm", "tilt": "60 deg", "plates": { "friction": 0.1 } },
    "floor": { "motion": "sinusoidal", "amplitude": "1 mm", "frequency": "20 Hz", "restitution": 0.8 },
    "settle": "0 s", "measure": "0.6 s" } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = Json::parse(read_text(folder / "o/bed/observables.json"));
  EXPECT_NEAR(value(json["gravity_in_plane"]), 5, 1e-12);
  EXPECT_EQ(json["gravity_in_plane"]["unit"], "m/s^2");
  EXPECT_NEAR(value(json["gamma"]), 0.001 * std::pow(2 * std::numbers::pi * 20, 2) / 5, 1e-12);
  EXPECT_DOUBLE_EQ(value(json["temperature_x_over_mg"]), 0.004 * value(json["temperature_x"]));
  const Json bed = Json::parse(read_text(folder / "o/bed/bed.json"));
  EXPECT_NEAR(bed["gravity"]["value"].get<double>(), 5, 1e-12);
  EXPECT_NEAR(bed["tilt"]["value"].get<double>(), std::numbers::pi / 3, 1e-12);
  const auto ledger = [&](const char* name) { return json["energy_ledger"][name].get<double>(); };
  EXPECT_GT(ledger("dissipated_on_plates"), 0);
  EXPECT_LT(ledger("dissipated_on_plates"), ledger("dissipated"));
  EXPECT_LT(std::abs(ledger("imbalance")), 1e-8 * ledger("dissipated"));
  // Of 24 disks that all slide all the time at their mean speed, sqrt(pi T/2) for a Maxwellian, friction takes so much.
  const double periods_of_time = 12 * 0.05 / std::sqrt(0.004 / 5), a = 0.1 * std::sqrt(3.0);
  const double speed =
      std::sqrt(std::numbers::pi / 2 * (value(json["temperature_x"]) + value(json["temperature_z"])) / 2);
  EXPECT_NEAR(ledger("dissipated_on_plates") / (24 * a * speed * periods_of_time), 1, 0.5);
}

// The energy of an elastic bed stays. So the mean height of its lid follows from the heights and velocities of the
// disks, and from the T/2 of kinetic energy that the lid has.
TEST(TiltedCell, StatesTheHeightOfItsFreeLid) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "t", "stages": [ { "stage": "simulate", "id": "bed", "seed": 5,
    "units": "reduced", "disks": { "count": 24 }, "start_temperature": 3,
    "box": { "width": 6.3, "sides": "periodic", "lid": { "kind": "free", "height": 12, "mass": 8 } },
    "settle": 20, "measure": 1000 } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json json = Json::parse(read_text(folder / "o/bed/observables.json"));
  const double t_x = value(json["temperature_x"]), t_z = value(json["temperature_z"]), t = (t_x + t_z) / 2;
  const double energy = json["energy_ledger"]["initial"].get<double>();
  const double lid = (energy - 24 * value(json["center_of_mass"]) - 24 * t - t / 2) / 8;
  EXPECT_EQ(json["lid_height"]["unit"], "D");
  EXPECT_GT(error(json["lid_height"]), 0);
  EXPECT_NEAR(value(json["lid_height"]), lid, 0.05 * t);
}

}  // namespace
