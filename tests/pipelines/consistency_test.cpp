// One fact, one place: what is wrong with a recipe is said by `validate` and `run` alike, at its place, before anything
// runs. The recipes are in consistency/.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <tuple>

#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

fs::path recipe(const std::string& name) { return fs::path(SHAKEBED_CONSISTENCY_RECIPES) / (name + ".json"); }

struct Refused {
  const char* name;     // of the recipe
  int line;             // where the mistake is
  const char* pointer;  // the message names it
  const char* says;     // and says this
  friend void PrintTo(const Refused& r, std::ostream* out) { *out << r.name; }
};

const Refused refused_recipes[] = {
    {"preset-with-a-wrong-value", 14, "/presets/full/~1stages~1bed~1measure", "is a frequency"},
    {"sweep-over-a-pointer-that-is-not-there", 12, "/sweep/over/~1stages~1bed~1floor~1amplitde",
     "Did you mean \"amplitude\"?"},
    {"sweep-with-a-wrong-value", 14, "/sweep/over/~1stages~1bed~1disks~1restitution/2", "from 0 to 1, got 1.9"},
    {"sweep-over-a-stage-that-is-not-there", 14, "/sweep/points/1/~1stages~1bad~1seed", "no element \"bad\""},
    {"collect-of-a-misspelled-number", 14, "/sweep/collect/1", "Did you mean \"/fit/temperature\"?"},
    {"expectation-of-a-misspelled-number", 12, "/stages/2/expect/~1fit~1reduced_temprature",
     "Did you mean \"/fit/reduced_temperature\"?"},
    {"expectation-in-another-unit", 13, "/stages/2/expect/~1fit~1temperature_over_mg/most", "the result is in \"m\""},
    {"number-that-is-not-measured", 11, "/stages/1/expect/~1bed~1psi6_local",
     "It is given when \"observe\" names \"order\""},
    {"published-number-misspelled", 14, "/report/published/0/number", "Did you mean \"/fit/temperature_over_mg\"?"},
    {"assumed-input-misspelled", 12, "/report/assumed/0/input", "Did you mean \"frequency\"?"},
    {"claim-about-a-misspelled-number", 11, "/stages/1/claims/0/number", "Did you mean \"/bed/center_of_mass_rise\"?"},
    {"chart-of-a-misspelled-column", 12, "/stages/1/charts/0/points/0/y", "has no column \"temperature_y\""},
    {"chart-of-a-file-that-is-not-written", 12, "/stages/1/charts/0/points/0/file",
     "It is written when \"observe\" names \"order\""},
    {"study-of-a-misspelled-number", 14, "/stages/0/collect/T/at", "Did you mean \"/bed/temperature_x\"?"},
    {"chart-of-a-series-that-is-not-there", 18, "/stages/1/charts/0/points/0/where/series", "Did you mean \"e09\"?"},
    {"gamma-and-amplitude", 8, "/stages/0/floor/gamma", "both \"amplitude\" and \"gamma\" are given"},
    {"extract-with-another-diameter", 11, "/stages/2/diameter", "is 0.0029 m here, but 0.003 m in stage \"bed\""},
    {"fit-with-another-diameter", 12, "/stages/3/diameter", "is 0.0031 m here, but 0.003 m in stage \"bed\""},
    {"map-with-another-frequency", 13, "/stages/4/frequency", "is 21 Hz here, but 20 Hz in stage \"bed\""},
    {"kernel-with-a-hyphen", 11, "/stages/2/kernel/kind", "Did you mean \"top_hat\"?"},
    {"plates-of-an-upright-cell", 6, "/stages/0/box/plates", "nothing presses the disks on the plates"},
    {"cell-that-lies-flat", 6, "/stages/0/box/tilt", "or write the bed in reduced units"},
    {"map-with-the-gravity-of-free-fall", 13, "/stages/4/gravity", "is 9.81 m/s^2 here, but 4.905"},
    {"gamma-without-frequency", 7, "/stages/0/floor/frequency", "\"frequency\" is missing"},
};

class WrongRecipe : public testing::TestWithParam<Refused> {};

TEST_P(WrongRecipe, IsRefusedBeforeAnythingRuns) {
  const Refused& wrong = GetParam();
  const std::string file = recipe(wrong.name).string();
  ScratchFolder folder;
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"validate", file}, {"run", file, "--out", "o"}, {"run", file, "--dry-run"}}) {
    const ProgramResult result = run_shakebed(command, folder.path());
    EXPECT_EQ(result.exit_code, 3) << command[0] << ": " << result.err;
    EXPECT_NE(result.err.find(file + ":" + std::to_string(wrong.line) + ":"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(wrong.pointer), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(wrong.says), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("--set"), std::string::npos) << "nobody used --set: " << result.err;
  }
  EXPECT_FALSE(fs::exists(folder / "o")) << "nothing may be made of a recipe that is wrong";
}
INSTANTIATE_TEST_SUITE_P(All, WrongRecipe, testing::ValuesIn(refused_recipes),
                         [](const testing::TestParamInfo<Refused>& given) {
                           std::string name = given.param.name;
                           std::erase(name, '-');
                           return name;
                         });

// One mistake gives one error: what only follows from it is not listed.
TEST(WrongRecipe, OneMistakeGivesOneError) {
  ScratchFolder folder;
  ASSERT_EQ(run_shakebed({"init", "bed.json"}, folder.path()).exit_code, 0);
  const std::string good = read_text(folder / "bed.json");
  const auto errors = [&](const std::string& written, const std::string& instead) {
    std::string text = good;
    const std::size_t place = text.find(written);
    EXPECT_NE(place, std::string::npos) << written;
    text.replace(place, written.size(), instead);
    write_text(folder / "wrong.json", text);
    const ProgramResult result = run_shakebed({"validate", "wrong.json"}, folder.path());
    EXPECT_EQ(result.exit_code, 3) << result.err;
    return result.err;
  };
  const auto count = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  for (const char* key :
       {"disks", "count", "diameter", "restitution", "width", "sides", "floor", "amplitude", "frequency", "settle",
        "frames", "scale", "from", "model", "plateau_density", "expect", "stages"}) {
    const std::string written = '"' + std::string(key) + '"';
    const std::string err = errors(written, '"' + std::string(key).substr(0, std::strlen(key) - 1) + "x\"");
    EXPECT_EQ(count(err), 1) << key << ":\n" << err;
    EXPECT_NE(err.find("Did you mean " + written + "?"), std::string::npos) << err;
  }
  EXPECT_EQ(count(errors("\"3 mm\"", "\"3 kg\"")), 1) << "stages after it cannot be judged";
  EXPECT_EQ(count(errors("\"stage\": \"simulate\"", "\"stage\": \"simulatr\"")), 1);
  // Mistakes that have nothing to do with one another are all listed.
  const std::string two = errors("\"blur\": 0.8, \"noise\": 5", "\"blurr\": 0.8, \"noise\": \"loud\"");
  EXPECT_EQ(count(two), 2) << two;
}

TEST(CommandLine, AMistypedOptionIsNamedBeforeOneThatIsMissing) {
  ScratchFolder folder;
  const ProgramResult result = run_shakebed({"fit-images", "photos", "--diamter", "3 mm"}, folder.path());
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("fit-images has no option --diamter; did you mean --diameter?"), std::string::npos)
      << result.err;
  EXPECT_NE(run_shakebed({"fit-images", "photos"}, folder.path()).err.find("--diameter is required"),
            std::string::npos);
}

struct Odd {
  const char* name;     // of the recipe
  const char* pointer;  // the warning names it
  const char* says;     // and says this
  friend void PrintTo(const Odd& o, std::ostream* out) { *out << o.name; }
};

const Odd odd[] = {
    {"amplitude-in-metres", "/stages/0/floor/amplitude: Gamma = 1.93e+03", "Did you mean \"1.2 mm\"?"},
    {"weak-shaking", "/stages/0/floor/amplitude: Gamma = 0.805", "stays at rest"},
    {"bead-in-metres", "/stages/0/disks/diameter: the bead has a diameter of 3 m", "Did you mean \"3 mm\"?"},
    {"short-settle", "/stages/0/settle", "4 periods of the floor"},
    {"narrow-box", "/stages/0/box/width", "3.33 diameters wide"},
    {"box-in-metres", "/stages/0/box/width: the box is 30.9 m (1.03e+04 diameters) wide", "Did you mean \"30.9 mm\"?"},
    {"low-lid", "/stages/0/box/lid/height", "the lid squeezes the bed"},
    {"commensurate-width", "/stages/0/box/width: the box is 30 diameters wide, exactly 30",
     "59.4 mm (29.7 D) or 60.6 mm (30.3 D)"},
    {"alternate-rows-lock", "/stages/0/box/width: the box is 30.5 diameters wide", "alternate rows can lock"},
    {"sloped-sides", "/stages/0/box/sides/slope: at the surface of the bed at rest the box is 1.66 times as wide",
     "do not fit such a profile"},
    {"high-bed", "/stages/0/disks/count: 12000 disks in a box 30.5 diameters wide make a bed 347 diameters high",
     "Use fewer disks"},
};

class OddRecipe : public testing::TestWithParam<Odd> {};

TEST_P(OddRecipe, IsSaidByValidateAndExplain) {
  const std::string file = recipe(GetParam().name).string();
  ScratchFolder folder;
  for (const char* command : {"validate", "explain"}) {
    const ProgramResult result = run_shakebed({command, file}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << command << ": " << result.err;
    EXPECT_NE(result.err.find("warning: " + file + ":"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(GetParam().pointer), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(GetParam().says), std::string::npos) << result.err;
  }
}
INSTANTIATE_TEST_SUITE_P(All, OddRecipe, testing::ValuesIn(odd), [](const testing::TestParamInfo<Odd>& given) {
  std::string name = given.param.name;
  std::erase(name, '-');
  return name;
});

TEST(Warnings, AreKeptInTheReportOfARun) {
  ScratchFolder folder;
  const ProgramResult result = run_shakebed({"run", recipe("short-settle").string(), "--out", "o"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.err.find("4 periods of the floor"), std::string::npos) << result.err;
  for (const char* file : {"o/report.html", "o/summary.json", "o/summary.md"})
    EXPECT_NE(read_text(folder / file).find("4 periods of the floor"), std::string::npos) << file;
}

TEST(Warnings, SayNothingAboutAnOrdinaryBed) {
  ScratchFolder folder;
  const ProgramResult result = run_shakebed({"validate", recipe("width-between").string()}, folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(result.err, "");
  EXPECT_NE(result.out.find("valid: 1 stage"), std::string::npos) << result.out;
}

TEST(Explain, PrintsGamma) {
  ScratchFolder folder;
  const ProgramResult result = run_shakebed({"explain", recipe("width-between").string()}, folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NE(result.out.find("bed: gamma 2.415, column number 9.804, width 30.6 D"), std::string::npos) << result.out;
}

// Gamma in place of the amplitude: swept, collected, and what follows from it stated in resolved.json.
TEST(Gamma, IsSweptAndCollected) {
  ScratchFolder folder;
  const std::string file = recipe("gamma-in-place-of-the-amplitude").string();
  const ProgramResult result = run_shakebed({"run", file, "--out", "o"}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string table = read_text(folder / "o/sweep.csv");
  EXPECT_NE(table.find("point,replica,status,bed_floor_gamma,bed_gamma,"), std::string::npos) << table;
  EXPECT_NE(table.find("000000,0,ok,2,2,"), std::string::npos) << table;
  EXPECT_NE(table.find("000001,0,ok,3,3,"), std::string::npos) << table;
  EXPECT_TRUE(fs::exists(folder / "o/figures/sweep-1.svg"));
}

TEST(Gamma, IsWrittenIntoResolvedAsTheUserWroteIt) {
  ScratchFolder folder;
  for (const auto& [set, written, stated] :
       {std::tuple{"/stages/bed/seed=1", "\"amplitude\": \"0.0015 m\"", "gamma 2.41458"},
        std::tuple{"/stages/bed/floor={\"motion\": \"sinusoidal\", \"gamma\": 4, \"frequency\": \"20 Hz\"}",
                   "\"gamma\": 4", "amplitude 2.4849"}}) {
    const ProgramResult result = run_shakebed(
        {"run", recipe("width-between").string(), "--set", set, "--set", "/stages/bed/measure=0.1 s", "--out", "o"},
        folder.path());
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const std::string resolved = read_text(folder / "o/resolved.json");
    EXPECT_NE(resolved.find(written), std::string::npos) << resolved;
    EXPECT_NE(resolved.find(std::string("\"$comment\": \"") + stated), std::string::npos) << resolved;
    EXPECT_EQ(run_shakebed({"validate", "o/resolved.json"}, folder.path()).exit_code, 0);
  }
}

// --diameter 3 was answered by `Write "3 m"`.
TEST(Suggestions, OfferTheUnitThatABeadIsLikelyToHave) {
  ScratchFolder folder;
  write_text(folder / "photo.png", "");
  const ProgramResult result = run_shakebed({"fit-images", "photo.png", "--diameter", "3"}, folder.path());
  EXPECT_EQ(result.exit_code, 2) << result.err;
  EXPECT_NE(result.err.find("Write \"3 mm\""), std::string::npos) << result.err;
  const ProgramResult mapped = run_shakebed(
      {"map", "--gamma", "4", "--frequency", "20 Hz", "--diameter", "3", "--initial-height", "10"}, folder.path());
  EXPECT_NE(mapped.err.find("Did you mean \"3 mm\"?"), std::string::npos) << mapped.err;
  write_text(folder / "r.json", small_recipe());
  for (const auto& [set, says] : {std::pair{"/stages/bed/floor/frequency=\"20\"", "Write \"20 Hz\""},
                                  {"/stages/bed/box/width=\"0.06\"", "Write \"0.06 m\""},
                                  {"/stages/bed/settle=\"2\"", "Write \"2 s\""}}) {
    const ProgramResult result_of_set = run_shakebed({"validate", "r.json", "--set", set}, folder.path());
    EXPECT_EQ(result_of_set.exit_code, 3) << result_of_set.err;
    EXPECT_NE(result_of_set.err.find(says), std::string::npos) << result_of_set.err;
  }
}

// At close packing the equation of Santos, Lopez de Haro and Yuste diverges, and that of Henderson does not.
TEST(Suggestions, SayWhyAMapIsUndefinedAtAPole) {
  ScratchFolder folder;
  const auto map = [&](const char* equation) {
    return run_shakebed({"map", "--gamma", "4", "--frequency", "20 Hz", "--diameter", "3 mm", "--initial-height", "10",
                         "--eos", equation, "--plateau-density", "1.1547005383792515"},
                        folder.path());
  };
  EXPECT_NE(map("santos-lopez-yuste").out.find("diverges at the density phi_0"), std::string::npos);
  EXPECT_EQ(map("henderson").out.find("diverges"), std::string::npos);
}

// A file that cannot be written is named as it was asked for.
TEST(Suggestions, NameTheFileThatCannotBeWritten) {
  const ProgramResult result = run_shakebed({"init", "/proc/nowhere/bed.json"}, ".");
  EXPECT_NE(result.exit_code, 0);
  EXPECT_NE(result.err.find("/proc/nowhere/bed.json"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find(".part"), std::string::npos) << result.err;
}

// Lengths are checked in diameters: the error once named the width, which was right.
TEST(Suggestions, NameTheDiameterWhoseUnitWasForgotten) {
  ScratchFolder folder;
  write_text(folder / "r.json", small_recipe());
  const ProgramResult result =
      run_shakebed({"validate", "r.json", "--set", "/stages/bed/disks/diameter=3"}, folder.path());
  EXPECT_EQ(result.exit_code, 3) << result.err;
  EXPECT_NE(result.err.find("/disks/diameter: the bead has a diameter of 3 m"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("Did you mean \"3 mm\"?"), std::string::npos) << result.err;
  EXPECT_EQ(result.err.find("/box/width"), std::string::npos) << result.err;
}

// The simulation would run for its whole time before the camera finds nothing to photograph.
TEST(PhotographsOfABed, NeedFramesBeforeAnythingRuns) {
  ScratchFolder folder;
  const std::string bed = R"({"name": "b", "stages": [{"stage": "simulate", "id": "bed", "measure": "1 s",
    "disks": {"count": 20, "diameter": "3 mm"}, "box": {"width": "30 mm"}%s}, {"stage": "render", "from": "bed"}]})";
  const auto validated = [&](const std::string& frames) {
    write_text(folder / "r.json", std::string(bed).replace(bed.find("%s"), 2, frames));
    return run_shakebed({"validate", "r.json"}, folder.path());
  };
  const ProgramResult without = validated("");
  EXPECT_EQ(without.exit_code, 3) << without.err;
  EXPECT_NE(without.err.find("/stages/1/from: the simulated bed stores no frames"), std::string::npos) << without.err;
  EXPECT_EQ(validated(R"(, "frames": {"count": 10})").exit_code, 0);
}

// A preset that is not the one chosen is checked as well.
TEST(EveryPreset, IsCheckedWhicheverIsChosen) {
  ScratchFolder folder;
  const std::string file = recipe("preset-with-a-wrong-value").string();
  for (const char* command : {"validate", "run"}) {
    const ProgramResult result = run_shakebed({command, file, "--preset", "quick"}, folder.path());
    EXPECT_EQ(result.exit_code, 3) << command << ": " << result.err;
    EXPECT_NE(result.err.find("/presets/full/"), std::string::npos) << result.err;
  }
}

}  // namespace
