// Whatever is wrong with a recipe ends with exit code 3 or 4 and a message that names the file and the place.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;

struct Mistake {
  const char* name;
  const char* find;     // in the small recipe ...
  const char* replace;  // ... replaced by this; with an empty `find` the whole text
  int exit_code;
  const char* pointer;  // the message names it
  const char* says;     // and says this
  friend void PrintTo(const Mistake& m, std::ostream* out) { *out << m.name; }
};

const Mistake mistakes[] = {
    {"WrongTypeNumberForText", "\"count\": 40", "\"count\": \"forty\"", 3, "/stages/0/disks/count", "whole number"},
    {"FractionForWholeNumber", "\"count\": 40", "\"count\": 40.5", 3, "/stages/0/disks/count", "whole number"},
    {"ObjectForQuantity", "\"diameter\": \"3 mm\"", "\"diameter\": {}", 3, "/stages/0/disks/diameter", "a length"},
    {"WrongDimension", "\"diameter\": \"3 mm\"", "\"diameter\": \"3 Hz\"", 3, "/stages/0/disks/diameter",
     "a frequency"},
    {"UnknownUnit", "\"diameter\": \"3 mm\"", "\"diameter\": \"3 mn\"", 3, "/stages/0/disks/diameter", "did you mean"},
    {"NumberInTextWithoutUnit", "\"diameter\": \"3 mm\"", "\"diameter\": \"3\"", 3, "/stages/0/disks/diameter",
     "no unit"},
    {"NegativeDiameter", "\"diameter\": \"3 mm\"", "\"diameter\": \"-3 mm\"", 3, "/stages/0/disks/diameter", "above 0"},
    {"ZeroDiameter", "\"diameter\": \"3 mm\"", "\"diameter\": 0", 3, "/stages/0/disks/diameter", "above 0"},
    {"OverflowingQuantity", "\"diameter\": \"3 mm\"", "\"diameter\": \"3e999 mm\"", 3, "/stages/0/disks/diameter",
     "largest possible number"},
    {"RestitutionAboveOne", "\"restitution\": 0.9 },\n      \"gravity\"", "\"restitution\": 1.9 },\n      \"gravity\"",
     3, "/stages/0/disks/restitution", "from 0 to 1"},
    {"UnknownKey", "\"frequency\": \"20 Hz\"", "\"freqency\": \"20 Hz\"", 3, "/stages/0/floor/freqency",
     "Did you mean \"frequency\"?"},
    {"UnknownKeyAtTheTop", "\"name\": \"small\"", "\"name\": \"small\", \"stagse\": []", 3, "/stagse",
     "Did you mean \"stages\"?"},
    {"UnknownStage", "\"stage\": \"simulate\"", "\"stage\": \"simulat\"", 3, "/stages/0/stage",
     "Did you mean \"simulate\"?"},
    {"KeyOfAnotherChoice", "\"motion\": \"sinusoidal\", ", "", 3, "/stages/0/floor/frequency",
     "It belongs to \"motion\": \"sinusoidal\"."},
    {"UnknownChoice", "\"kind\": \"hard\"", "\"kind\": \"herd\"", 3, "/stages/0/box/sides/kind",
     "Did you mean \"hard\"?"},
    {"DuplicateKey", "\"count\": 40", "\"count\": 40, \"count\": 41", 3, "/stages/0/disks/count", "twice"},
    {"NotANumber", "\"count\": 40", "\"count\": NaN", 3, "/stages/0/disks/count", "not a number"},
    {"InfiniteNumber", "\"restitution\": 0.9 }", "\"restitution\": -Infinity }", 3, "/stages/0/disks/restitution",
     "finite"},
    {"NumberBeyondADouble", "\"plateau_density\": 1.1", "\"plateau_density\": 1e400", 3, "/stages/1/plateau_density",
     "largest possible number"},
    {"TrailingComma", "\"plateau_density\": 1.1", "\"plateau_density\": 1.1,", 3, "/stages/1", "comma"},
    {"UnclosedText", "\"name\": \"small\"", "\"name\": \"small", 3, "/name", "line break"},
    {"Comment", "\"name\": \"small\",", "\"name\": \"small\", // mine\n", 3, "", "a comment"},
    {"EmptyFile", "", " \n", 3, "", "empty"},
    {"ArrayAtTheTop", "", "[1, 2]", 3, "", "an object"},
    {"NotUtf8", "\"name\": \"small\"", "\"name\": \"sm\xff\xfe\"", 3, "/name", "UTF-8"},
    {"MissingRequiredKey", "\"count\": 40, ", "", 3, "/stages/0/disks/count", "missing"},
    {"MissingName", "\"name\": \"small\",", "", 3, "/name", "missing"},
    {"NoStages", "", R"({"name": "x", "stages": []})", 3, "/stages", "no stage"},
    {"FromNowhere", "\"from\": \"bed\"", "\"from\": \"bad\"", 3, "/stages/1/from", "Did you mean \"bed\"?"},
    {"FromWrongKind", "\"from\": \"bed\"", "\"from\": \"check\"", 3, "/stages/1/from", "does not read"},
    {"TwoStagesOneFolder", "\"id\": \"bed\"", "\"id\": \"fit\"", 3, "/stages/1", "two stages would write"},
    {"Circle", "\"stage\": \"fit\", \"from\": \"bed\"",
     "\"stage\": \"check\", \"id\": \"c2\", \"from\": \"check\", \"expect\": {\"/check/passed\": {\"value\": true}} }, "
     "{ \"stage\": \"fit\", \"from\": \"fit\"",
     3, "/from", ""},
    {"IdLeavesOut", "\"id\": \"bed\"", "\"id\": \"../bed\"", 3, "/stages/0/id", "folder"},
    {"NameLeavesResults", "\"name\": \"small\"", "\"name\": \"../../small\"", 3, "/name", "folder"},
    {"NewerFormat", "\"name\": \"small\"", "\"name\": \"small\", \"format\": 99", 3, "/format", "newer"},
    {"VersionOfAStage", "\"stage\": \"fit\"", "\"stage\": \"fit\", \"version\": 99", 3, "/stages/1/version",
     "unknown key"},
    {"ProfileIsMissing", "\"from\": \"bed\", \"plateau", "\"profile\": \"nowhere.csv\", \"plateau", 4,
     "/stages/1/profile", "no file"},
    {"UnitInReducedStage", "\"seed\": 7", "\"seed\": 7, \"units\": \"reduced\"", 3, "/stages/0/disks/diameter",
     "reduced"},
    {"SeedBelowZero", "\"seed\": 7", "\"seed\": -7", 3, "/stages/0/seed", "0"},
    {"BedWiderThanItsDisks", "\"width\": \"30 mm\"", "\"width\": \"2 mm\"", 3, "/stages/0/box/width", ""},
    {"MeasureTooShort", "\"measure\": \"0.5 s\"", "\"measure\": \"1 ms\"", 3, "/stages/0/measure", "period"},
    {"EmptyExpectation", "{ \"value\": 4, \"relative\": 1e-12 }", "{}", 3, "/stages/2/expect/~1bed~1column_number",
     "this expectation is empty"},
    {"ModelUnknown", "\"plateau_density\": 1.1", "\"model\": \"enskog-rectangel\"", 3, "/stages/1/model",
     "Did you mean"},
    {"SweepWithoutValues", "\"name\": \"small\"",
     "\"name\": \"small\", \"sweep\": {\"over\": {\"/stages/bed/seed\": []}}", 3, "/sweep/over/~1stages~1bed~1seed",
     "the list of values is empty"},
};

class MalformedRecipe : public testing::TestWithParam<Mistake> {};

TEST_P(MalformedRecipe, IsRefusedAtItsPlace) {
  const Mistake& mistake = GetParam();
  ScratchFolder folder;
  std::string text = mistake.find[0] == '\0' ? mistake.replace : small_recipe();
  if (mistake.find[0] != '\0') {
    const std::size_t at = text.find(mistake.find);
    ASSERT_NE(at, std::string::npos) << mistake.find;
    text.replace(at, std::string(mistake.find).size(), mistake.replace);
  }
  write_text(folder / "bad-recipe.json", text);
  for (const char* command : {"validate", "run"}) {
    const ProgramResult result = run_shakebed({command, "bad-recipe.json", "--out", "o"}, folder.path());
    EXPECT_EQ(result.exit_code, mistake.exit_code) << command << ": " << result.err;
    EXPECT_NE(result.err.find("bad-recipe.json"), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(mistake.pointer), std::string::npos) << result.err;
    EXPECT_NE(result.err.find(mistake.says), std::string::npos) << result.err;
    EXPECT_TRUE(result.out.empty()) << result.out;
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "o")) << "nothing may be made of a recipe that is wrong";
}
INSTANTIATE_TEST_SUITE_P(All, MalformedRecipe, testing::ValuesIn(mistakes),
                         [](const testing::TestParamInfo<Mistake>& given) { return given.param.name; });

TEST(MalformedRecipes, GiveAllMistakesAtOnceWithTheirLines) {
  ScratchFolder folder;
  std::string text = small_recipe();
  text.replace(text.find("\"3 mm\""), 6, "\"3 Hz\"");
  text.replace(text.find("\"from\": \"bed\""), 13, "\"from\": \"bad\"");
  text.replace(text.find("\"settle\""), 8, "\"setle\"");
  write_text(folder / "r.json", text);
  const ProgramResult result = run_shakebed({"validate", "r.json"}, folder.path());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("r.json:5:"), std::string::npos) << result.err;   // diameter
  EXPECT_NE(result.err.find("r.json:9:"), std::string::npos) << result.err;   // setle
  EXPECT_NE(result.err.find("r.json:10:"), std::string::npos) << result.err;  // from
}

TEST(MalformedRecipes, DeepNestingIsRefusedNotCrashedOn) {
  ScratchFolder folder;
  for (const char bracket : {'[', '{'}) {
    std::string text = "{\"name\": \"x\", \"stages\": ";
    for (int i = 0; i < 200000; ++i) text += bracket == '[' ? "[" : "{\"a\":";
    write_text(folder / "deep.json", text);
    const ProgramResult result = run_shakebed({"validate", "deep.json"}, folder.path());
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_NE(result.err.find("nested deeper"), std::string::npos) << result.err.substr(0, 500);
    EXPECT_NE(result.err.find("deep.json"), std::string::npos);
    EXPECT_NE(result.err.find("/stages"), std::string::npos);
  }
}

TEST(MalformedRecipes, OverlappingStartIsRefused) {
  ScratchFolder folder;
  std::string text = small_recipe();
  // Two disks a third of a diameter apart.
  write_text(folder / "start.extxyz",
             "2\nProperties=species:S:1:pos:R:2:velo:R:2:radius:R:1 Time=0\nA 2 1 0 0 0.5\nA 2.3 1 0 0 0.5\n");
  text.replace(text.find("\"count\": 40"), 11, "\"count\": 2");
  text.replace(text.find("\"settle\""), 8, "\"start\": {\"kind\": \"file\", \"file\": \"start.extxyz\"}, \"settle\"");
  write_text(folder / "overlap.json", text);
  const ProgramResult result = run_shakebed({"validate", "overlap.json"}, folder.path());
  EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.exit_code << result.err;
  EXPECT_NE(result.err.find("overlap.json"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("/stages/0/start"), std::string::npos) << result.err;
}

TEST(MalformedRecipes, MissingRecipeAndFolderAreInputErrors) {
  ScratchFolder folder;
  const ProgramResult missing = run_shakebed({"run", "nowhere.json"}, folder.path());
  EXPECT_EQ(missing.exit_code, 4);
  EXPECT_NE(missing.err.find("nowhere.json"), std::string::npos);
  std::filesystem::create_directory(folder / "folder.json");
  EXPECT_EQ(run_shakebed({"run", "folder.json"}, folder.path()).exit_code, 4);
}

TEST(MalformedRecipes, SetIsCheckedLikeTheFile) {
  ScratchFolder folder;
  write_text(folder / "r.json", small_recipe());
  const ProgramResult result =
      run_shakebed({"validate", "r.json", "--set", "/stages/bed/disks/diameter=3 Hz"}, folder.path());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("--set: /stages/0/disks/diameter"), std::string::npos) << result.err;
  EXPECT_EQ(run_shakebed({"validate", "r.json", "--set", "stages=1"}, folder.path()).exit_code, 2);
  EXPECT_EQ(run_shakebed({"validate", "r.json", "--set", "/stages/bed/disks/diameter=2 mm"}, folder.path()).exit_code,
            0);
}

}  // namespace
