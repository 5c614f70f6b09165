// Options of simulate, fit, infer, check, claims and render that cannot be together, or lie beyond a limit: what is
// said of each, and that the limit itself is good.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests::stage_mistakes {
namespace {

using namespace shakebed::pipelines;
using testing::HasSubstr;
using testing::StartsWith;

class StageMistakes : public testing::Test {
 protected:
  StageMistakes() {
    write_text(folder_ / "p.csv", "height,number_density,std_error\n1,1,0.1\n2,0.5,0.1\n3,0.2,0.1\n");
    write_text(folder_ / "q.csv", "height,number_density,std_error\n1,1,0.1\n2,0.5,0.1\n3,0.2,0.1\n");
  }
  // What is wrong with a recipe of these stages; "" where nothing is.
  std::string said_of(const std::string& stages) {
    std::vector<Problem> problems;
    auto document = parse_json(R"({ "name": "t", "stages": [ )" + stages + " ] }", "r.json", problems);
    if (!document) return "no JSON: " + problems.at(0).what;
    try {
      plan_ = make_plan(std::move(*document), "r.json", folder_.path());
    } catch (const ConfigError& error) {
      problems = error.problems();
    }
    std::string all;
    for (const Problem& one : problems)
      all += (all.empty() ? "" : " | ") + one.pointer + ": " + one.what +
             (one.suggestion.empty() ? "" : ". " + one.suggestion);
    return all;
  }
  ScratchFolder folder_;
  Plan plan_;
};

const std::string shaken =
    R"("floor": { "motion": "sinusoidal", "amplitude": 1, "frequency": 0.5, "restitution": 0.9 })";
const std::string warmed = R"("bath": { "kind": "andersen", "temperature": 1, "rate": 0.3 })";
// 20 periods of the floor.
std::string bed(const std::string& more, const std::string& id = "bed", const std::string& measure = "40",
                const std::string& box = R"("sides": "periodic")") {
  return R"({ "stage": "simulate", "id": ")" + id +
         R"(", "units": "reduced", "disks": { "count": 40, "restitution": 0.9 }, "box": { "width": 10.3, )" + box +
         R"( }, "settle": 40, "measure": )" + measure + (more.empty() ? "" : ", " + more) + " }";
}

// --- simulate

TEST_F(StageMistakes, OfWhatABedIsToObserve) {
  EXPECT_EQ(said_of(bed(shaken + R"(, "observe": ["order", "pressure"])")), "");
  EXPECT_EQ(said_of(bed(shaken + R"(, "observe": ["ordr"])")),
            "/stages/0/observe: \"ordr\" is not one of the additional measurements. Did you mean \"order\"?");
  EXPECT_EQ(said_of(bed(shaken + R"(, "observe": ["zzzzz"])")),
            "/stages/0/observe: \"zzzzz\" is not one of the additional measurements. Choose from: order, velocities, "
            "displacement, pressure, phases, species");
  EXPECT_THAT(said_of(bed(shaken + R"(, "observe": ["species"])")),
              StartsWith("/stages/0/observe: \"species\" needs two different species of disks. Give \"disks\""));
  EXPECT_THAT(said_of(bed(R"("gravity": 0, "start_temperature": 1, "observe": ["pressure"])", "bed", "40",
                          R"("sides": "periodic", "lid": { "kind": "periodic", "height": 20 })")),
              StartsWith("/stages/0/observe: \"pressure\" is the pressure as a function of height, but the box is "
                         "periodic upwards. Leave it out"));
}

TEST_F(StageMistakes, OfASchedule) {
  EXPECT_EQ(
      said_of(bed(warmed + R"(, "schedule": [ { "temperature": 2, "ramp": 1 }, { "temperature": 1, "hold": 1 } ])")),
      "");
  EXPECT_EQ(said_of(bed(warmed + R"(, "schedule": [ { "temperature": 2, "ramp": 1 }, { "temperature": 1 } ])")),
            "/stages/0/schedule/1: the step has no duration. Give \"ramp\" or \"hold\"");
  EXPECT_EQ(said_of(bed(shaken + R"(, "schedule": [ { "temperature": 2, "ramp": 1 } ])")),
            "/stages/0/schedule: \"schedule\" changes the temperature of a bath, and this bed has no bath with a "
            "temperature. Give a \"bath\": langevin, andersen or thermal_floor");
}

// A period of the floor is 2. 20 periods of 32 phases are 640 moments.
TEST_F(StageMistakes, OfTheTimeAndItsFrames) {
  EXPECT_EQ(said_of(bed(shaken, "bed", "2")), "");
  EXPECT_THAT(said_of(bed(shaken, "bed", "1.99")),
              StartsWith("/stages/0/measure: the bed must be measured over at least one period of the floor. Give "));
  EXPECT_EQ(said_of(bed(shaken, "bed", "1.9e12")), "");
  EXPECT_EQ(said_of(bed(shaken, "bed", "2.1e12")),
            "/stages/0/measure: the floor would shake more than 1e12 times, which no run can reach. Give a shorter "
            "\"measure\" or \"settle\", or a lower frequency");
  const auto frames = [&](const std::string& keys) { return said_of(bed(shaken + ", \"frames\": { " + keys + " }")); };
  EXPECT_EQ(frames(R"("count": 640, "phases": 32)"), "");
  EXPECT_EQ(frames(R"("count": 641, "phases": 32)"),
            "/stages/0/frames/count: 641 frames were requested, but the bed is sampled at only 640 moments. Give a "
            "longer \"measure\", or a smaller \"count\"");
  EXPECT_EQ(frames(R"("count": 8, "phases": 4, "at": [0, 0.75])"), "");
  const std::string phases =
      "/stages/0/frames/at: the bed is not sampled at these phases, or one is named twice. Give different multiples of "
      "1/4 from 0 to below 1";
  for (const char* at : {"[0, 0.3]", "[0.5, 0.5]", "[1]", "[-0.25]"})
    EXPECT_EQ(frames(R"("count": 8, "phases": 4, "at": )" + std::string(at)), phases) << at;
  EXPECT_EQ(said_of(bed(warmed + R"(, "frames": { "count": 8, "at": [0] })")),
            "/stages/0/frames/at: the floor does not shake, so frames have no phases. Remove \"at\"");
}

// Also of a floor that shakes several times in a unit of time.
TEST_F(StageMistakes, OfPhasesAreNamedForAFastFloor) {
  const std::string fast =
      R"("floor": { "motion": "sinusoidal", "amplitude": 0.1, "frequency": 4, "restitution": 0.9 })";
  EXPECT_EQ(said_of(bed(fast + R"(, "frames": { "count": 8, "phases": 4, "at": [0.3] })")),
            "/stages/0/frames/at: the bed is not sampled at these phases, or one is named twice. Give different "
            "multiples of 1/4 from 0 to below 1");
}

// In reduced units advice is a plain number, as every time in the recipe is.
TEST_F(StageMistakes, HaveAdviceInTheUnitsOfTheRecipe) {
  EXPECT_EQ(said_of(bed(shaken, "bed", "1")),
            "/stages/0/measure: the bed must be measured over at least one period of the floor. Give 2 or more");
  EXPECT_EQ(
      said_of(R"({ "stage": "simulate", "disks": { "count": 40, "diameter": "3 mm" }, "box": { "width": "30.9 mm" },
      "settle": "1 s", "measure": "0.1 s", "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": "3 Hz" } })"),
      "/stages/0/measure: the bed must be measured over at least one period of the floor. Give 0.3334 s or more");
}

// Four beds where a shaken floor meets beads that dissipate below an open lid, else one.
TEST_F(StageMistakes, AreNoneWhereReplicasAreLeftOut) {
  const auto replicas = [&](const std::string& stages) {
    EXPECT_EQ(said_of(stages), "");
    return plan_.stages.back().options.value("replicas", 0);
  };
  EXPECT_EQ(replicas(bed(shaken)), 4);
  EXPECT_EQ(replicas(bed(shaken + R"(, "replicas": 2)")), 2);
  EXPECT_EQ(replicas(bed(warmed)), 1);
  EXPECT_EQ(replicas(bed(shaken, "bed", "40", R"("sides": "periodic", "lid": { "kind": "fixed", "height": 60 })")), 1);
  EXPECT_EQ(replicas(bed(shaken, "one") + ", " + bed(shaken + R"(, "from": "one")", "two")), 1);
  std::string elastic = bed(R"("floor": { "motion": "sinusoidal", "amplitude": 1, "frequency": 0.5 })");
  elastic.replace(elastic.find(", \"restitution\": 0.9"), 20, "");
  EXPECT_EQ(replicas(elastic), 1);
}

TEST_F(StageMistakes, OfScenes) {
  const auto scene = [&](const std::string& more, const std::string& box = R"("sides": "periodic")") {
    return said_of(bed(more, "bed", "40", box));
  };
  EXPECT_THAT(scene(R"("floor": { "motion": "sinusoidal", "amplitude": 1, "gamma": 4, "frequency": 0.5 })"),
              HasSubstr("both \"amplitude\" and \"gamma\" are given, but each follows from the other"));
  EXPECT_THAT(scene(R"("floor": { "motion": "sinusoidal", "frequency": 0.5 })"),
              HasSubstr("neither \"amplitude\" nor \"gamma\" is given: one of them is needed"));
  EXPECT_THAT(scene(R"("gravity": 0, "floor": { "motion": "sinusoidal", "gamma": 4, "frequency": 0.5 })"),
              HasSubstr("/stages/0/floor/gamma: a weightless scene has no Gamma. Give \"amplitude\""));
  EXPECT_THAT(scene(shaken + R"(, "gravity": 0.5)"),
              HasSubstr("/stages/0/gravity: in reduced units gravity is 1 or 0"));
  EXPECT_THAT(scene(R"("floor": { "motion": "table" })"),
              HasSubstr("/stages/0/floor/heights: the floor has neither \"heights\" nor a \"file\""));
  EXPECT_THAT(scene(R"("floor": { "motion": "table", "heights": [0, 1, 0, -1], "file": "p.csv", "period": 2 })"),
              HasSubstr("/stages/0/floor/heights: the floor has both \"heights\" and a \"file\""));
  EXPECT_THAT(scene(R"("floor": { "motion": "table", "file": ["p.csv", "q.csv"], "period": 2 })"),
              HasSubstr("/stages/0/floor/file: this names 2 files, but the floor needs one table"));
  EXPECT_THAT(scene(R"("floor": { "motion": "table", "heights": [0, 1, 0, -1] })"),
              HasSubstr("/stages/0/floor/period: the period of the floor is not known. Give \"period\""));
  EXPECT_THAT(scene(shaken + R"(, "start": { "kind": "file", "file": ["p.csv", "q.csv"] })"),
              HasSubstr("/stages/0/start/file: this names 2 files, but the start needs one trajectory"));
  EXPECT_THAT(scene(shaken, R"("sides": "periodic", "tilt": "90 deg")"), HasSubstr("/stages/0/box/tilt: "));
}

// --- fit

TEST_F(StageMistakes, OfAFit) {
  const std::string own = R"("profile": "p.csv")";
  const auto fit = [&](const std::string& keys) { return said_of(R"({ "stage": "fit", )" + keys + " }"); };
  EXPECT_EQ(fit(own), "");
  EXPECT_EQ(fit(own + R"(, "bootstrap": 10)"),
            "/stages/0/bootstrap: there are no frames to resample: no extract or simulate stage in \"from\"");
  EXPECT_EQ(fit(own + R"(, "temperature_measured": true)"),
            "/stages/0/temperature_measured: no simulate stage in \"from\" gives a measured temperature");
  EXPECT_EQ(fit(R"("robust": true)"),
            "/stages/0: there is no profile: neither \"profile\" nor a stage in \"from\". Give one of the two");
  EXPECT_EQ(fit(own + R"(, "table": "profile_phase_00.csv")"),
            "/stages/0/table: \"table\" is one of the stage in \"from\", but \"profile\" names a file. Give one of the "
            "two");
  EXPECT_EQ(fit(R"("profile": ["p.csv", "q.csv"])"),
            "/stages/0/profile: this names 2 files, but the stage fits one profile. Give the path of one CSV file");
  EXPECT_EQ(fit(own + R"(, "model": "enskog-rectangl")"),
            "/stages/0/model: there is no model \"enskog-rectangl\". Did you mean \"enskog-rectangle\"?");
  EXPECT_THAT(fit(own + R"(, "model": "zzz")"),
              StartsWith("/stages/0/model: there is no model \"zzz\". Choose from: enskog-rectangle, fermi, rectangle, "
                         "simulation, hydrostatic:enskog"));
  for (const char* model : {"fermi", "rectangle", "hydrostatic:enskog"})
    EXPECT_EQ(fit(own + ", \"model\": \"" + model + "\""), "") << model;
  EXPECT_EQ(fit(own + R"(, "window": { "low": 3, "high": 3 })"),
            "/stages/0/window/low: the highest height of the window, \"high\", must be above the lowest, \"low\"");
  EXPECT_EQ(fit(own + R"(, "window": { "low": 3, "high": 3.1 })"), "");
}

TEST_F(StageMistakes, OfAFitOfBeds) {
  const std::string three = bed(shaken, "a") + ", " + bed(shaken, "b") + ", " + bed(shaken, "c") + ", ";
  const auto fit = [&](const std::string& keys) { return said_of(three + R"({ "stage": "fit", )" + keys + " }"); };
  EXPECT_EQ(fit(R"("from": ["a", "b"], "temperature_measured": true, "bootstrap": 5)"), "");
  EXPECT_EQ(fit(R"("from": ["a", "b", "c"])"), "/stages/3/from: only the model simulation reads more than two stages");
  EXPECT_EQ(fit(R"("from": ["a", "b", "c"], "model": "simulation")"), "");
  EXPECT_EQ(fit(R"("from": "a", "temperature_measured": true, "temperature": 0.5)"),
            "/stages/3/temperature_measured: T is already fixed by \"temperature\"; give one of the two");
  EXPECT_EQ(fit(R"("from": ["a", "b", "c"], "model": "simulation", "bootstrap": 1)"),
            "/stages/3/bootstrap: the error of the model simulation comes from its library, not from resampled frames. "
            "Leave \"bootstrap\" out or choose another model");
}

// --- infer

class InferMistakes : public StageMistakes {
 protected:
  std::string with(const Json& more) {
    Json stage = Json::parse(infer_recipe)["stages"][0];
    stage.update(more);
    return said_of(stage.dump());
  }
  std::string targets(const Json& more) { return with({{"targets", more}}); }
};

// A period is 1/0.35 = 2.857; 16 beds for two parameters; phases are eighths.
TEST_F(InferMistakes, OfItsSearch) {
  EXPECT_EQ(with({{"measure", 2.86}}), "");
  EXPECT_EQ(with({{"measure", 2.85}}),
            "/stages/0/measure: the floor must shake, and \"measure\" must be at least one period of the floor");
  EXPECT_EQ(with({{"first", 16}}), "");
  EXPECT_EQ(with({{"first", 15}}), "/stages/0/first: 2 unknown parameters need at least 16 beds in the first round");
  EXPECT_EQ(with({{"moments", 0}, {"phase", 0.375}}), "");
  EXPECT_EQ(with({{"moments", 0}, {"phase", 0.3}}),
            "/stages/0/phase: this phase is not one of the 8 phases at which the bed is measured; give a multiple of "
            "1/8");
  EXPECT_EQ(with({{"moments", 4}}), "");
  EXPECT_EQ(with({{"moments", 3}}), "/stages/0/moments: \"phases\" (8) must be a multiple of \"moments\" (3)");
  EXPECT_EQ(with({{"moments", 0}, {"frame_rate", 1433.6}}), "");
  EXPECT_EQ(with({{"moments", 0}, {"frame_rate", 1434}}),
            "/stages/0/frame_rate: a period of the shaking must have 1 to 4096 frames, but has 4.1e+03");
  EXPECT_EQ(with({{"moments", 0}, {"frame_rate", 0.36}}), "");
  EXPECT_EQ(with({{"moments", 2}, {"frame_rate", 7}}),
            "/stages/0/frame_rate: a film shows every phase of the shaking, so \"frame_rate\" excludes \"phase\" and "
            "\"moments\"");
  EXPECT_EQ(with({{"parts", 2}, {"first", 32}, {"rounds", 0}}), "");
  EXPECT_EQ(with({{"parts", 2}, {"first", 31}, {"rounds", 0}}),
            "/stages/0/parts: 2 unknown parameters need at least 16 beds in each part");
  EXPECT_EQ(with({{"parts", 2}, {"part", 2}, {"first", 32}, {"rounds", 0}}), "");
  EXPECT_EQ(with({{"parts", 2}, {"part", 3}, {"first", 32}, {"rounds", 0}}),
            "/stages/0/part: part 3 of 2 does not exist");
  EXPECT_EQ(with({{"parts", 2}, {"first", 32}}),
            "/stages/0/rounds: a part of the first round is followed by no further rounds. Give \"rounds\": 0");
}

TEST_F(InferMistakes, OfItsParametersAndBeds) {
  const auto parameters = [](int count) {
    Json all = Json::object();
    for (int k = 0; k < count; ++k)
      all["p" + std::to_string(k)] = Json{{"set", {"/disks/restitution"}}, {"low", 0.5}, {"high", 0.9}};
    return all;
  };
  EXPECT_EQ(with({{"parameters", parameters(12)}, {"first", 1000}}), "");
  EXPECT_EQ(with({{"parameters", parameters(13)}, {"first", 1000}}),
            "/stages/0/parameters: the stage infers from 1 to 12 parameters, but the recipe names 13");
  EXPECT_THAT(with({{"parameters", parameters(0)}}),
              HasSubstr("/stages/0/parameters: the stage infers from 1 to 12 parameters, but the recipe names 0"));
  EXPECT_THAT(with({{"parameters", {{"e", {{"set", {"/measure"}}, {"low", 0.5}, {"high", 0.9}}}}}}),
              HasSubstr("/stages/0/parameters/e/set: \"/measure\" is not an option of the scene. Write for example "
                        "\"/floor/gamma\""));
  const Json table{{"motion", "table"}, {"heights", {0, 1, 0, -1}}, {"period", 2.857}, {"restitution", 0.7}};
  const auto height = [&](const char* pointer) {
    return with({{"floor", table}, {"parameters", {{"h", {{"set", {pointer}}, {"low", 0.5}, {"high", 0.9}}}}}});
  };
  EXPECT_EQ(height("/floor/heights/1"), "");
  EXPECT_EQ(height("/floor/heights/9"),
            "/stages/0/parameters: /floor/heights/9: there is no element \"9\" in /floor/heights (it has 4) (at h = "
            "0.5)");
  write_text(folder_ / "b.json", R"({ "beds": [] })");
  EXPECT_EQ(with({{"beds", "b.json"}, {"stored", "x"}}),
            "/stages/0/beds: beds are either stored or your own: give one of \"stored\" and \"beds\"");
  EXPECT_THAT(with({{"beds", "b.json"}}),
              testing::AllOf(StartsWith("/stages/0/beds: "), HasSubstr("is not a beds.json of the stage infer"),
                             testing::EndsWith("Leave \"beds\" out: the beds are then run")));
  write_text(folder_ / "b.json", R"({ "made_from": {}, "beds": [] })");
  EXPECT_THAT(with({{"beds", "b.json"}}),
              HasSubstr("were made with a different scene, different parameters or a different measurement"));
  EXPECT_THAT(with({{"stored", "nowhere"}}),
              HasSubstr("/stages/0/stored: there is no file of stored beds named \"nowhere\". Leave \"stored\" out"));
}

TEST_F(InferMistakes, OfItsTargets) {
  EXPECT_EQ(targets({{"shift", {{"value", -1}, {"std_error", 0.1}}}}), "");
  EXPECT_THAT(targets({{"density", {{"value", 0}, {"std_error", 0.1}}}}),
              HasSubstr("/stages/0/targets/density/value: the measured value must be above 0"));
  EXPECT_THAT(targets({{"density", {{"std_error", 0.1}}}}),
              HasSubstr("/stages/0/targets/density/value: a target has either \"value\" or \"at\""));
  EXPECT_THAT(targets({{"shift", {{"value", 1}, {"std_error", -0.1}}}}),
              HasSubstr("/stages/0/targets/shift/std_error: a standard error cannot be negative"));
  EXPECT_THAT(targets(Json::object()), HasSubstr("/stages/0/targets: no target has a value"));
  const auto profile = [&](const Json& more) {
    Json one{{"file", "p.csv"}, {"low", 1}, {"high", 60}};
    one.update(more);
    return targets({{"profile", one}});
  };
  EXPECT_EQ(profile(Json::object()), "") << "sixty heights";
  EXPECT_EQ(
      profile({{"high", 61}}),
      "/stages/0/targets/profile/spacing: the profile is compared at 60 heights at most, but these are 61. Give a "
      "larger \"spacing\", or a smaller range of heights");
  EXPECT_THAT(profile({{"high", 1e12}}), HasSubstr("60 heights at most, but these are 1000000000000. Give a larger"));
  EXPECT_EQ(profile({{"high", 1}}), "/stages/0/targets/profile/low: \"low\" must be below \"high\"");
  EXPECT_EQ(profile({{"file", {"p.csv", "q.csv"}}}),
            "/stages/0/targets/profile/file: one profile is compared, but several files are named");
  EXPECT_THAT(profile({{"from", "bed"}}),
              HasSubstr("/stages/0/targets/profile/from: a profile has either \"from\" or \"file\""));
}

// --- check, claims, map, render, study

TEST_F(StageMistakes, OfExpectations) {
  const std::string map =
      R"({ "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 }, )";
  const auto expect = [&](const std::string& keys) {
    return said_of(map + R"({ "stage": "check", "from": "map", "expect": { "/map/diameter": { )" + keys + " } } }");
  };
  EXPECT_EQ(expect(R"("value": "3 mm", "absolute": "0.1 mm")"), "");
  EXPECT_EQ(expect(R"("value": "3 mm", "absolute": 0.1)"),
            "/stages/1/expect/~1map~1diameter/absolute: the expected value has a unit, and this tolerance has none. "
            "Write it with its "
            "unit, as the value: \"0.1 mm\"");
  EXPECT_EQ(expect(R"("value": 3.5)"),
            "/stages/1/expect/~1map~1diameter/value: a number needs a tolerance. Add \"relative\", \"absolute\" or "
            "\"std_errors\"");
  EXPECT_EQ(expect(R"("value": true, "relative": 0.1)"),
            "/stages/1/expect/~1map~1diameter/value: a tolerance is given, but the expected value is not a number");
  const std::string at = "/stages/1/expect/~1map~1diameter";
  EXPECT_EQ(expect(R"("value": "3 mm", "absolute": "0.1 mmm")"),
            at + "/absolute: \"0.1 mmm\": there is no unit \"mmm\"; did you mean \"mm\"?")
      << "once";
  EXPECT_EQ(expect(R"("value": "3 mm", "absolute": "0.1")"),
            at +
                "/absolute: the expected value has a unit, and this tolerance has none. Write it with its unit, as the "
                "value: \"0.1 mm\"");
  EXPECT_EQ(expect(R"("least": "x")"), at + "/least: \"x\" does not begin with a number");
  EXPECT_EQ(expect(R"("most": "5 furlong")"), at + "/most: \"5 furlong\": there is no unit \"furlong\"");
  EXPECT_EQ(expect(R"("most": "5 s")"), at + "/most: the result is in \"m\", but the expected value is a time");
  EXPECT_EQ(expect(R"("value": "high")"), at + "/value: \"high\" does not begin with a number");
  EXPECT_THAT(expect(R"("relative": 0.1)"), HasSubstr("this expectation is empty: it has neither \"value\" nor"));
}

TEST_F(StageMistakes, OfClaims) {
  const auto claim = [&](const std::string& keys) {
    return said_of(
        R"({ "stage": "fit", "profile": "p.csv" }, { "stage": "claims", "from": "fit", "claims": [ { "claim": "c",
      "number": "/fit/temperature")" +
        keys + " } ] }");
  };
  EXPECT_EQ(claim(R"(, "least": 1, "most": 2)"), "");
  EXPECT_EQ(claim(""),
            "/stages/1/claims/0: this claim has no number: give \"published\", \"value\", \"least\" or \"most\"");
  for (const char* bound : {"least", "most"})
    EXPECT_EQ(claim(", \"value\": 1, \"" + std::string(bound) + "\": 1"),
              "/stages/1/claims/0/value: a claim has either a value or bounds, not both");
}

TEST_F(StageMistakes, OfMapsAndPictures) {
  EXPECT_EQ(said_of(R"({ "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10,
                      "table": ["p.csv", "q.csv"] })"),
            "/stages/0/table: this names 2 files, but the stage reads one table. Give the path of one CSV file");
  const auto map = [&](const std::string& keys) {
    return said_of(R"({ "stage": "map", "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10, )" + keys +
                   " }");
  };
  EXPECT_EQ(map(R"("gamma": 4, "equation": "enskgo")"),
            "/stages/0/equation: there is no equation of state \"enskgo\"; did you mean \"enskog\"?");
  const auto render = [&](const std::string& keys, const std::string& frames) {
    return said_of(bed(shaken + frames) + R"(, { "stage": "render", "from": "bed", )" + keys + " }");
  };
  const std::string some = R"(, "frames": { "count": 4 })";
  EXPECT_EQ(render(R"("background_level": 100, "bead_level": 101)", some), "");
  EXPECT_EQ(render(R"("background_level": 100, "bead_level": 100)", some),
            "/stages/1/bead_level: beads cannot be seen, because \"bead_level\" equals \"background_level\". Choose "
            "another level");
  EXPECT_EQ(render(R"("gradient_x": 0.99, "gradient_y": -0.99)", some), "");
  EXPECT_EQ(
      render(R"("gradient_x": -1)", some),
      "/stages/1/gradient_x: must be above -1 and below 1, got -1. Meaning of \"gradient_x\": relative change of the "
      "light from left to right");
  EXPECT_THAT(render(R"("gradient_y": 1)", some), StartsWith("/stages/1/gradient_y: must be above -1 and below 1"));
  EXPECT_THAT(render(R"("bead_level": 100)", ""),
              HasSubstr("/stages/1/from: the simulated bed stores no frames, so there is nothing to photograph. Add "
                        "\"frames\": {\"count\": 640} to "));
}

// A simulated bed has no Gamma where its floor stands still, and no sizes in reduced units: both are known before it
// runs.
TEST_F(StageMistakes, OfMapsOfSimulatedBeds) {
  const auto map = [&](const std::string& scene, const std::string& keys) {
    return said_of(bed(scene) + R"(, { "stage": "map", "from": "bed")" + keys + " }");
  };
  const std::string sizes = R"(, "frequency": "20 Hz", "diameter": "3 mm")";
  EXPECT_EQ(map(shaken, sizes), "");
  EXPECT_EQ(
      map(shaken, R"(, "diameter": "3 mm")"),
      "/stages/1/frequency: the bed is in reduced units, so its frequency is not known in Hz. Give \"frequency\"");
  EXPECT_EQ(map(shaken, R"(, "frequency": "20 Hz")"),
            "/stages/1/diameter: the bed is in reduced units, so its diameter is not known in m. Give \"diameter\"");
  const std::string still =
      "/stages/1/gamma: the floor of this bed does not shake, so there is no Gamma. Give \"gamma\" and \"frequency\"";
  EXPECT_EQ(map(warmed, sizes), still);
  EXPECT_EQ(map(warmed, sizes + R"(, "gamma": 4)"), "");
  const auto in_si = [&](const std::string& keys) {
    return said_of(R"({ "stage": "simulate", "id": "bed", "disks": { "count": 40, "diameter": "3 mm" },
        "box": { "width": "30.9 mm" }, "settle": "1 s", "measure": "1 s" }, { "stage": "map", "from": "bed" )" +
                   keys + " }");
  };
  EXPECT_EQ(in_si(R"(, "gamma": 4)"), still) << "nor a frequency";
  EXPECT_EQ(in_si(R"(, "frequency": "20 Hz")"), still);
  EXPECT_EQ(in_si(R"(, "gamma": 4, "frequency": "20 Hz")"), "");
}

TEST_F(StageMistakes, OfMoreStagesThanAreRead) {
  const std::string both = bed(shaken + R"(, "frames": { "count": 4 })", "a") + ", " +
                           bed(shaken + R"(, "frames": { "count": 4 })", "b") + ", ";
  EXPECT_EQ(said_of(both + R"({ "stage": "render", "from": ["a", "b"] })"),
            "/stages/2/from: \"from\" names 2 stages, but render reads at most 1");
}

TEST_F(StageMistakes, OfBeadsThatAreNone) {
  const auto extract = [&](const char* diameter) {
    return said_of(R"({ "stage": "extract", "images": "p.csv", "diameter": ")" + std::string(diameter) + "\" }");
  };
  EXPECT_EQ(extract("3 mm"), "");
  EXPECT_THAT(extract("1 m"),
              StartsWith("/stages/0/diameter: the bead has a diameter of 1 m, but beads of experiments are 50 um to a "
                         "few cm. Did you mean \"1 mm\"?"));
}

TEST_F(StageMistakes, OfTwoKindsOfBeadsAndOfHeights) {
  const auto extract = [&](const char* keys) {
    return said_of(R"({ "stage": "extract", "images": "p.csv", "diameter": "3 mm", )" + std::string(keys) + " }");
  };
  EXPECT_EQ(extract(R"("second_diameter": "60 mm")"), "");
  EXPECT_EQ(extract(R"("second_diameter": "0.15 mm")"), "");
  EXPECT_EQ(
      extract(R"("second_diameter": "6.1 cm")"),
      "/stages/0/second_diameter: it is 20.3 times the diameter; two kinds of beads are searched up to a ratio of "
      "20. Check its unit");
  EXPECT_THAT(extract(R"("second_diameter": "2 um")"),
              StartsWith("/stages/0/second_diameter: it is 0.000667 times the diameter"));
  EXPECT_EQ(extract(R"("lowest": -3, "highest": -1)"), "");
  EXPECT_EQ(extract(R"("highest": -1)"), "") << "where a profile begins is not known before the floor is";
  EXPECT_EQ(extract(R"("lowest": 3, "highest": 3)"), "/stages/0/highest: \"highest\" must be above \"lowest\"");
}

// 40 disks in 10.3 D: 53.3 D, and 5 D below the floor; by a bath of T = 1 25 D more.
TEST_F(StageMistakes, OfProfilesOfTooManyHeights) {
  EXPECT_EQ(said_of(bed(warmed + R"(, "profile": { "spacing": 0.0025 })")), "");
  EXPECT_EQ(said_of(bed(warmed + R"(, "profile": { "spacing": 0.001 })")),
            "/stages/0/profile/spacing: the profile would have 82300 heights, and a covariance of each pair. Give "
            "0.002058 or more");
}

TEST_F(StageMistakes, OfContactsThatLastTooLong) {
  const auto said = [&](const std::string& duration) {
    return said_of(R"({ "stage": "simulate", "disks": { "count": 40, "diameter": "9.81 mm", "contact_duration": ")" +
                   duration + R"(" }, "box": { "width": "103 mm", "sides": "periodic" }, "measure": "1 s" })");
  };
  EXPECT_EQ(said("31 ms"), "");  // sqrt(D/g) is 31.6 ms
  EXPECT_EQ(
      said("63.2455532 ms"),
      "/stages/0/disks/contact_duration: a contact would last 2 sqrt(D/g), and in 1 sqrt(D/g) a disk falls by its "
      "radius. Leave it out, which means 0.0001 sqrt(D/g), or give a much shorter one");
  EXPECT_THAT(
      said_of(R"({ "stage": "simulate", "units": "reduced", "gravity": 0, "start_temperature": 1, "measure": 40,
                           "disks": { "count": 40, "restitution": 0.9, "contact_duration": 3 },
                           "box": { "width": 10.3, "sides": "periodic", "lid": { "kind": "periodic", "height": 20 } } })"),
      StartsWith("/stages/0/disks/contact_duration: a contact would last 3 D sqrt(m/T0), and in 1 D sqrt(m/T0) a "
                 "disk moves by its diameter"));
}

TEST_F(StageMistakes, OfCountsHaveTheirOwnBounds) {
  EXPECT_THAT(said_of(R"({ "stage": "simulate", "units": "reduced", "disks": { "count": 5e9 },
                           "box": { "width": 10.3, "sides": "periodic" }, "measure": 40 })"),
              StartsWith("/stages/0/disks/count: must lie from 1 to 4294967295, got 5e9"));
}

TEST_F(StageMistakes, OfTheMapsOfAChart) {
  const auto chart = [&](const std::string& keys) {
    return said_of(
        R"({ "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 },
           { "stage": "chart", "from": "map", "maps": [ { "name": "m", "x": "jump", "y": "rise", "x_label": "X",
             "value": "reduced_temperature", "y_label": "Y", "value_label": "V", )" +
        keys + " } ] }");
  };
  EXPECT_EQ(chart(R"("file": "map.csv", "where": { "name": "a" })"), "");
  EXPECT_EQ(chart(R"("file": "mapp.csv")"),
            "/stages/1/maps/0/file: \"map\" (map) writes no table \"mapp.csv\". Did you mean \"map.csv\"?");
  EXPECT_EQ(chart(R"("file": "map.csv", "where": ["name"])"),
            "/stages/1/maps/0/where: expected an object: column → text");
}

TEST_F(StageMistakes, OfWhatAStudyMayRun) {
  const auto study = [&](const std::string& stages) {
    return said_of(
        R"({ "stage": "study", "stages": [ )" + stages +
        R"( ], "parameter": { "values": [1], "set": [] }, "collect": { "t": { "at": "/f/temperature" } } })");
  };
  EXPECT_THAT(study(R"({ "stage": "fit", "id": "f", "profile": ")" + (folder_ / "p.csv").string() + "\" }"),
              HasSubstr("the stage \"f\" reads a file, which a chain of a study cannot do. Put it after the study"));
  const std::string map =
      R"({ "stage": "map", "id": "f", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 })";
  EXPECT_THAT(
      study(map + R"(, { "stage": "chart", "from": "f", "charts": [ { "name": "c", "x_label": "x", "y_label": "y",
      "points": [ { "name": "p", "file": "map.csv", "x": "jump", "y": "rise" } ] } ] })"),
      HasSubstr("the chain of a study cannot contain a chart stage. Put it after the study"));
}

// What is set must be a place in the chain, in the series that has it, and what is tabulated a file of a stage.
TEST_F(StageMistakes, OfTheChainOfAStudy) {
  const auto study = [&](const std::string& set, const std::string& table) {
    return said_of(R"({ "stage": "study", "series": { "a": {}, "b/c": { "set": { )" + set + R"( } } },
           "stages": [ { "stage": "map", "id": "f", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm",
                         "initial_height": 10 } ],
           "parameter": { "name": "g", "values": [4], "set": ["/stages/f/gamma"] },
           "collect": { "t": { "at": "/f/initial_height" } },
           "tables": { "t": { "at": ")" +
                   table + R"(", "key": "name" } } })");
  };
  EXPECT_EQ(study("", "/f/map.csv"), "");
  EXPECT_EQ(study(R"("/stages/nobody/gamma": 3)", "/f/map.csv"),
            "/stages/0/series/b~1c: /stages/nobody/gamma: there is no element \"nobody\" in /stages (it has 1)");
  for (const char* none : {"f/map.csv", "/f", "/g/map.csv", "/f/map.csv/name", "/f~2/map.csv"})
    EXPECT_EQ(study("", none), "/stages/0/tables/t/at: \"" + std::string(none) +
                                   "\" is not a file of the study's stages. Write /<stage id>/<file>.csv");
}

}  // namespace
}  // namespace shakebed::tests::stage_mistakes
