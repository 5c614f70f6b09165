// The beds that an inference runs, held against beds measured by hand; an inference from beds that are a formula, by
// the stage itself; how much of a run a trial runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "pipelines/stages/infer.hpp"
#include "pipelines/stages/simulate_run.hpp"
#include "sim/measure/flow_free.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::inference_runs {
namespace {

using namespace shakebed::pipelines;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

// --- one bed

// 24 disks of 2 mm at 25 Hz, four looks a period; what it shows on average, and at the second of four moments.
class BedOfAnInference : public testing::Test {
 protected:
  BedOfAnInference() : stage_(*find_stage("infer")) {
    std::vector<Problem> problems;
    bed_.scene = *parse_json(R"({ "disks": { "count": 24, "diameter": "2 mm", "restitution": 0.9 },
        "box": { "width": "10.6 mm", "sides": "periodic" },
        "floor": { "motion": "sinusoidal", "gamma": 6, "frequency": "25 Hz", "restitution": 0.9 } })",
                             "s", problems);
    bed_.source.file = "s";
    bed_.settle = 0.2, bed_.phases = 4, bed_.heights = {0.5, 2};
    bed_.views = views_of(0, 1, 0.25);
    scene_ = bed_.read(bed_.scene, problems);
    EXPECT_TRUE(problems.empty());
  }
  LoneStage stage_;
  BedOfInference bed_;
  SceneOptions scene_;
};

// Settling is whole periods of 40 ms, upwards, and so is measuring, downwards, but for rounding; at least one.
TEST_F(BedOfAnInference, HasWholePeriods) {
  const auto schedule = [&](double settle, double duration) {
    bed_.settle = settle;
    const sim::MeasurementSchedule times = bed_.schedule(scene_, duration);
    EXPECT_NEAR(times.period * scene_.time_unit(), 0.04, 1e-12);
    return std::pair(std::lround(times.settle / times.period), times.periods);
  };
  using Periods = std::pair<long, std::uint64_t>;
  EXPECT_EQ(schedule(0.2, 0.4), Periods(5, 10));
  EXPECT_EQ(schedule(0.2001, 0.4399), Periods(6, 10));
  EXPECT_EQ(schedule(0.04 * 7, 0.04 * 23), Periods(7, 23));
  EXPECT_EQ(schedule(0, 0.01), Periods(0, 1));
  EXPECT_EQ(bed_.schedule(scene_, 0.4).phases, 4U);
  bed_.frame_rate = 500;
  EXPECT_EQ(bed_.schedule(scene_, 0.4).phases, 20U) << "as many looks as frames";
  bed_.frame_rate = 510;
  EXPECT_EQ(bed_.looks(scene_), 20U);
  bed_.frame_rate = 5;
  EXPECT_EQ(bed_.looks(scene_), 1U);
}

// Looks at one phase only.
template <class Observed>
class AtOnePhase final : public sim::RunObserver {
 public:
  AtOnePhase(sim::Observing<Observed> observing, std::uint32_t phase)
      : observing_(std::move(observing)), phase_(phase) {}
  const Observed* operator->() const { return &*observing_; }
  void prepare(sim::Simulation& simulation) override { observing_.prepare(simulation); }
  void look(sim::Simulation& simulation, const sim::Snapshot& at, std::uint64_t look, std::uint32_t phase) override {
    if (phase == phase_) observing_.look(simulation, at, look, 0);
  }
  void save(sim::ArchiveWriter&) override {}
  void load(sim::ArchiveReader&) override {}

 private:
  sim::Observing<Observed> observing_;
  std::uint32_t phase_;
};

TEST_F(BedOfAnInference, HasTheNumbersOfItsSimulation) {
  std::vector<double> fractions;
  const std::vector<double> found = bed_.run(scene_, 5, 0.8, stage_, [&](double f) { fractions.push_back(f); });
  const sim::Scene scene = scene_.scene(5);
  const sim::MeasurementSchedule times = bed_.schedule(scene_, 0.8);
  const HeightGrid grid{-6, 0.25, static_cast<std::size_t>((5 * 24 / 5.3 + 30) / 0.25)};
  const Kernel kernel{KernelKind::gaussian, 0.5};
  sim::Observing<sim::BedObserver> all(
      [&](const sim::DiskProperties& disks) { return sim::BedObserver(scene, disks, 4, grid, kernel); });
  sim::Observing<sim::FlowFreeTemperature> flow(
      [&](const sim::DiskProperties& disks) { return sim::FlowFreeTemperature(disks, 4); });
  AtOnePhase<sim::BedObserver> second(sim::Observing<sim::BedObserver>([&](const sim::DiskProperties& disks) {
                                        return sim::BedObserver(scene, disks, 1, grid, kernel);
                                      }),
                                      1);
  sim::measure(scene, times, {&all, &flow, &second});
  const std::size_t n = observables().size() + 2;
  ASSERT_EQ(found.size(), 2 * n);
  const auto number = [&](const char* name, std::size_t view = 0) { return found[view * n + observable_number(name)]; };
  const double ideal = sim::ideal_centre_of_mass(scene);
  EXPECT_EQ(number("temperature_x_over_mg"), all->temperature_x().value * 0.002);
  EXPECT_EQ(number("temperature_z_over_mg"), all->temperature_z().value * 0.002);
  EXPECT_EQ(number("temperature_z_local_over_mg"), all->temperature_z_local().value * 0.002);
  EXPECT_EQ(number("temperature_x_without_flow_over_mg"), flow->x().value * 0.002);
  EXPECT_EQ(number("temperature_z_without_flow_over_mg"), flow->z().value * 0.002);
  EXPECT_EQ(number("center_of_mass_rise"), all->centre_of_mass().value - ideal);
  EXPECT_EQ(number("temperature_x_over_mg", 1), second->temperature_x().value * 0.002);
  EXPECT_EQ(number("center_of_mass_rise", 1), second->centre_of_mass().value - ideal);
  EXPECT_NE(number("center_of_mass_rise", 1), number("center_of_mass_rise"));
  const sim::Profile profile = all->density(false), at_phase = second->density(false);
  double greatest = 0;
  for (const double density : profile.number_density) greatest = std::max(greatest, density);
  EXPECT_EQ(number("density"), greatest);
  EXPECT_EQ(found[n - 2], profile.number_density[26]) << "0.5 D lies 26 rows above -6 D";
  EXPECT_EQ(found[n - 1], profile.number_density[32]);
  EXPECT_EQ(found[2 * n - 2], at_phase.number_density[26]);
  fit::FitOptions options;
  options.plateau_density = 1.1, options.column_number = 24 / 5.3, options.kernel = kernel;
  options.interval = options.sweep = options.compare = false;
  const fit::FitResult fitted =
      fit::fit_profile({profile.height, profile.number_density, profile.std_error, {}, 0}, options);
  ASSERT_TRUE(fitted.ok());
  EXPECT_NEAR(number("temperature_over_mg"), fitted.temperature.value * 0.002, 1e-12);
  EXPECT_NEAR(number("shift"), fitted.shift.value, 1e-9);
  EXPECT_NEAR(number("solid_height_by_sum_rule"), fitted.solid_height_by_sum_rule, 1e-9);
  ASSERT_FALSE(fractions.empty());
  EXPECT_NEAR(fractions.back(), 0.99, 1e-9) << "at the last look, a quarter of a period before the end of 25";
}

// Filmed, its temperatures without flow are those of displacements between looks.
TEST_F(BedOfAnInference, IsFilmedWhereItsTargetsAre) {
  bed_.views = views_of(0, 1, {});
  bed_.frame_rate = 500;
  const std::vector<double> found = bed_.run(scene_, 5, 0.4, stage_, [](double) {});
  const sim::Scene scene = scene_.scene(5);
  sim::Observing<sim::FlowFreeDisplacement> film(
      [&](const sim::DiskProperties& disks) { return sim::FlowFreeDisplacement(scene, disks, 20); });
  sim::measure(scene, bed_.schedule(scene_, 0.4), {&film});
  EXPECT_EQ(found[observable_number("temperature_x_without_flow_over_mg")], film->x().value * 0.002);
  EXPECT_EQ(found[observable_number("temperature_z_without_flow_over_mg")], film->z().value * 0.002);
}

// --- trials

// A fiftieth of 200 periods that settle and of 150 that are measured, which is four and three and one more; of few
// periods one settles and one is measured.
TEST(TrialsOfRuns, AreAFiftiethOfThem) {
  class Counter final : public sim::RunObserver {
   public:
    void begin(sim::Simulation& simulation) override { settled = simulation.time(); }
    void look(sim::Simulation&, const sim::Snapshot&, std::uint64_t, std::uint32_t phase) override {
      ++looks, last = phase;
    }
    void save(sim::ArchiveWriter&) override {}
    void load(sim::ArchiveReader&) override {}
    double settled = -1;
    int looks = 0;
    std::uint32_t last = 0;
  };
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks = {.species = {{.count = 1}}};
  scene.box.width = 5.3;
  scene.box.floor = sim::SinusoidalFloor{.amplitude = 0.3, .frequency = 0.5};
  for (const auto& [settle, periods, settled, looks] :
       {std::tuple(200, 150U, 4.0, 16), {200, 149U, 4.0, 12}, {40, 49U, 1.0, 4}, {60, 1U, 1.2, 4}}) {
    sim::MeasurementSchedule schedule;
    schedule.period = 2, schedule.settle = 2 * settle, schedule.periods = periods, schedule.phases = 4;
    Counter counter;
    EXPECT_GT(trial_seconds(scene, schedule, {&counter}), 0);
    EXPECT_NEAR(counter.settled, 2 * settled, 1e-9) << settle;
    EXPECT_EQ(counter.looks, looks) << periods;
    EXPECT_EQ(counter.last, 3U);
  }
}

// --- the stage, from beds that are a formula

// The rise is 3 + 4 x, scattered by 0.1 in turn, x = (gamma - 3)/3; at the two moments 2 more and 2 less. The stage
// ends without gnuplot, when all but its picture is written.
class InferenceFromBeds : public testing::Test {
 protected:
  InferenceFromBeds() : stage_(*find_stage("infer")), path_(std::getenv("PATH")) {
    ::setenv("PATH", "", 1);
    stage_.reduced = true;
    recipe_ = Json::parse(infer_recipe)["stages"][0];
    Json from{{"scene", Json::object()}, {"settle", 10}, {"measure", 30}, {"phases", 8}, {"kernel_width", 0.5}};
    from["plateau_density"] = 1.1;
    for (const char* key : {"disks", "box", "floor"}) from["scene"][key] = recipe_[key];
    from["parameters"]["gamma"] = Json{{"set", {"/floor/gamma"}}, {"unit", ""}, {"values", nullptr}};
    from["views"] = {"average", "0", "0.5"};
    for (const Observable& one : observables()) from["observables"].push_back(one.name);
    stored_ = Json{{"made_from", from}, {"beds", Json::array()}};
    for (int i = 0; i < 40; ++i) {
      const double x = (i + 0.5) / 40, scatter = i % 4 < 2 ? 0.1 : -0.1;
      Json numbers = Json::array();
      for (const double more : {0.0, 2.0, -2.0})
        for (std::size_t k = 0; k < observables().size(); ++k)
          numbers.push_back(k == rise_ ? 3 + 4 * x + more + scatter : 1 + x + 0.01 * scatter);
      stored_["beds"].push_back(Json{{"round", 0}, {"values", {3 + 3 * x}}, {"numbers", numbers}});
    }
    for (const char* key : {"stage", "id", "units", "calibration"}) recipe_.erase(key);
    recipe_["parameters"].erase("restitution");
    recipe_.update(Json{{"best", 0}, {"draws", 1000}, {"beds", stage_.file("b.json").string()}});
    recipe_["targets"] = Json{{"center_of_mass_rise", {{"value", 5}, {"std_error", 0.3}}}};
  }
  ~InferenceFromBeds() override { ::setenv("PATH", path_.c_str(), 1); }
  // Why it ends.
  std::string infer() {
    write_text(stage_.file("b.json"), dump(stored_));
    try {
      stage_.run(dump(recipe_));
    } catch (const StageError& error) {
      return error.what();
    }
    ADD_FAILURE() << "it has found gnuplot";
    return "";
  }
  Json& number(std::size_t bed, std::size_t view, std::size_t k) {
    return stored_["beds"][bed]["numbers"][view * observables().size() + k];
  }
  const std::size_t rise_ = observable_number("center_of_mass_rise");
  LoneStage stage_;
  Json recipe_, stored_;

 private:
  std::string path_;
};

// The likelihood is a normal curve of width s about x = 0.5 by the average, and by the moments about 0 and 1, of which
// a half lies in the prior: 0.8 to 0.05 and 0.05. Each draw has its view, and chi2 of
// its place there. Densities at heights that are not asked for are left out.
TEST_F(InferenceFromBeds, WeighsItsViewsAndDraws) {
  const Json asked = stored_["beds"];
  stored_["made_from"]["heights"] = {0.5, 1.5};
  for (Json& bed : stored_["beds"]) {
    Json numbers = Json::array();
    for (std::size_t v = 0; v < 3; ++v) {
      for (std::size_t k = 0; k < observables().size(); ++k)
        numbers.push_back(bed["numbers"][v * observables().size() + k]);
      numbers.push_back(0.5), numbers.push_back(0.25);
    }
    bed["numbers"] = numbers;
  }
  infer();
  const Json found = read_json(stage_.output("infer.json"));
  const double expected[] = {0.8 / 0.9, 0.05 / 0.9, 0.05 / 0.9};
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_NEAR(found["photographs"][v]["prior"].get<double>(), v == 0 ? 0.8 : 0.1, 1e-12);
    EXPECT_NEAR(found["photographs"][v]["posterior"].get<double>(), expected[v], 0.012) << v;
  }
  EXPECT_EQ(found["beds"], 40);
  EXPECT_EQ(found["best"], Json::array());
  const NumberTable draws(stage_.output("posterior.csv"));
  ASSERT_EQ(draws.rows(), 1000U);
  std::map<std::string, int> views;
  for (std::size_t r = 0; r < draws.rows(); ++r) {
    const std::string& view = draws.text("photographs", r);
    ++views[view];
    const double more = view == "average" ? 0 : view == "0" ? 2 : -2;
    const double off = 5 - (3 + 4 * (draws("gamma", r) - 3) / 3 + more);
    EXPECT_NEAR(draws("chi2", r), off * off / 0.1, 0.05 + 0.1 * off * off / 0.1) << view;
  }
  EXPECT_NEAR(views["0"], 55, 30);
  EXPECT_NEAR(views["0.5"], 55, 30);
  EXPECT_EQ(read_json(stage_.output("beds.json"))["beds"], Json::parse(dump(asked)));
  EXPECT_TRUE(stage_.warnings.empty());
}

// The most probable beds lie at x = 0.5 by the average, at least 0.3 from there by the moments, whose prior is smaller:
// the first moment fits at x = 0 and the second at x = 1. They are run again, and with them beds of a calibration.
TEST_F(InferenceFromBeds, RunsItsBestBedsAgain) {
  recipe_.update(Json{{"settle", 0}, {"measure", 3}, {"best", 4}, {"best_replicas", 2}, {"calibration", 2}});
  stored_["made_from"].update(Json{{"settle", 0}, {"measure", 3}});
  infer();
  const Json found = read_json(stage_.output("infer.json"));
  ASSERT_EQ(found["best"].size(), 3U) << "no fourth is so far from these";
  std::map<std::string, double> places;
  for (const Json& bed : found["best"])
    places[bed["photographs"].get<std::string>()] = (bed["values"]["gamma"].get<double>() - 3) / 3;
  EXPECT_EQ(found["best"][0]["photographs"], "average");
  EXPECT_NEAR(places.at("average"), 0.5, 0.02);
  EXPECT_LT(places.at("0"), 0.1);
  EXPECT_GT(places.at("0.5"), 0.9);
  const NumberTable runs(stage_.output("best.csv")), calibration(stage_.output("calibration.csv"));
  ASSERT_EQ(runs.rows(), 6U);
  EXPECT_EQ(runs("gamma", 0), runs("gamma", 1));
  EXPECT_NE(runs("temperature_x_over_mg", 0), runs("temperature_x_over_mg", 1)) << "each with its own seed";
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_TRUE(std::filesystem::exists(stage_.output("best-" + std::to_string(k) + ".json"))) << k;
  EXPECT_EQ(found["calibration"]["beds"].get<double>(), static_cast<double>(calibration.rows()));
  for (std::size_t r = 0; r < calibration.rows(); ++r) {
    EXPECT_LE(calibration("low_95", r), calibration("low_68", r));
    EXPECT_LE(calibration("high_68", r), calibration("high_95", r));
    EXPECT_GT(calibration("truth", r), 3);
    EXPECT_LT(calibration("truth", r), 6);
  }
}

// Two beds were given up; of two more one has no rise on average, and the other none at the second moment. At the first
// moment three have none: more than a twentieth.
TEST_F(InferenceFromBeds, SaysWhatIsMissing) {
  for (const std::size_t i : {3U, 20U})
    for (Json& one : stored_["beds"][i]["numbers"]) one = nullptr;
  number(7, 0, rise_) = nullptr;
  number(9, 1, rise_) = nullptr;
  infer();
  EXPECT_THAT(
      stage_.warnings,
      ElementsAre(HasSubstr("2 of 40 beds were stopped because they made too many contacts. The posterior does not "
                            "cover parameters like theirs"),
                  "center_of_mass_rise: the fit of 1 of 40 beds failed, and they were left out",
                  "too many fits failed at the phases 0 of the shaking: these were excluded as possible phases "
                  "of the photographs"));
  const Json found = read_json(stage_.output("infer.json"));
  EXPECT_EQ(found["photographs"][1]["prior"], 0);
  EXPECT_EQ(found["photographs"][1]["posterior"], 0);
  EXPECT_NEAR(found["photographs"][2]["prior"].get<double>(), 0.1 / 0.9, 1e-12);
}

// Beds that were given up are named once: no fit of theirs failed.
TEST_F(InferenceFromBeds, NamesBedsThatWereGivenUpOnce) {
  for (Json& one : stored_["beds"][3]["numbers"]) one = nullptr;
  infer();
  EXPECT_THAT(stage_.warnings, ElementsAre(HasSubstr("1 of 40 beds were stopped because they made too many contacts")));
}

// Moments that look like the average: each draw has one of the three by its prior, 0.8, 0.1 and 0.1.
TEST_F(InferenceFromBeds, DrawsItsViewsByTheirShares) {
  for (std::size_t i = 0; i < 40; ++i)
    for (const std::size_t view : {1U, 2U}) number(i, view, rise_) = Json(number(i, 0, rise_));
  infer();
  const NumberTable draws(stage_.output("posterior.csv"));
  std::map<std::string, int> views;
  for (std::size_t r = 0; r < draws.rows(); ++r) ++views[draws.text("photographs", r)];
  EXPECT_NEAR(views["average"], 800, 50);
  EXPECT_NEAR(views["0"], 100, 40);
  EXPECT_NEAR(views["0.5"], 100, 40);
}

// Of six beds measured for two periods one has a fit: the number of the others is said. Of five none has one.
TEST_F(InferenceFromBeds, CountsTheBedsOfItsCalibrationWithoutTargets) {
  recipe_.update(Json{{"settle", 0}, {"measure", 6}, {"calibration", 6}, {"draws", 200}});
  stored_["made_from"].update(Json{{"settle", 0}, {"measure", 6}});
  for (std::size_t k = 0; k < 20; ++k) stored_["beds"].erase(k);  // every second, so that it is quick
  recipe_["targets"] = Json{{"temperature_over_mg", {{"value", 1.5}, {"std_error", 0.1}}}};
  infer();
  const std::size_t complete = NumberTable(stage_.output("calibration.csv")).rows();
  ASSERT_GT(complete, 0U);
  EXPECT_THAT(stage_.warnings,
              Contains(std::to_string(6 - complete) +
                       " of the 6 beds of the calibration did not give all target numbers and are left out of the "
                       "calibration"));
  recipe_["calibration"] = 5;
  EXPECT_EQ(infer(),
            "no bed of the calibration gave all target numbers, so the intervals cannot be tested. Measure longer "
            "(\"measure\"), or set \"calibration\" to 0");
}

TEST_F(InferenceFromBeds, HasNoPosteriorFarFromItsTargets) {
  recipe_["targets"]["center_of_mass_rise"] = Json{{"value", 1e160}, {"std_error", 0.1}};
  EXPECT_EQ(infer(),
            "all simulated beds are too far from the targets to give a posterior. Check the targets, or give wider "
            "ranges of the parameters");
}

// Beds of another measurement are refused.
TEST_F(InferenceFromBeds, TakesBedsOfTheSameMeasurement) {
  const auto refused = [&](const char* key, const Json& value) {
    Json other = stored_;
    other["made_from"][key] = value;
    write_text(stage_.file("b.json"), dump(other));
    try {
      stage_.read(dump(recipe_));
    } catch (const std::runtime_error& error) {
      return std::string(error.what()).find("were made with a different scene") != std::string::npos;
    }
    return false;
  };
  EXPECT_TRUE(refused("settle", 11));
  EXPECT_TRUE(refused("measure", 31));
  EXPECT_TRUE(refused("phases", 16));
  EXPECT_TRUE(refused("kernel_width", 0.6));
  EXPECT_TRUE(refused("plateau_density", 1.0));
  EXPECT_TRUE(refused("views", {"average"}));
  EXPECT_TRUE(refused("frame_rate", 7));
  EXPECT_FALSE(refused("settle", 10));
}

}  // namespace
}  // namespace shakebed::tests::inference_runs
