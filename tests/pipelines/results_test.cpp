// The page of results is what the program makes of the results of record, and every recipe can be run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

namespace fs = std::filesystem;
using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
using testing::HasSubstr;

const fs::path source = SHAKEBED_SOURCE_DIR;

TEST(ResultsOfRecord, AreThePage) {
  const ProgramResult page = run_shakebed({"reproduce", "--results"}, source);
  ASSERT_EQ(page.exit_code, 0) << page.err;
  EXPECT_EQ(page.out, read_text(source / "docs/results.md"))
      << "write it again: shakebed reproduce --results > docs/results.md";
}

// One page a recipe, and no page without one.
TEST(ResultsOfRecord, HaveAPageARecipe) {
  int pages = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "docs/results")) {
    if (entry.path().extension() != ".md") continue;
    const std::string recipe = entry.path().stem();
    const ProgramResult page = run_shakebed({"reproduce", recipe, "--results"}, source);
    EXPECT_EQ(page.exit_code, 0) << page.err;
    EXPECT_EQ(page.out, read_text(entry.path()))
        << "write it again: shakebed reproduce " << recipe << " --results > docs/results/" << recipe << ".md";
    ++pages;
  }
  int recipes = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "pipelines/recipes"))
    recipes += fs::exists(entry.path() / "figure.json");
  EXPECT_EQ(pages, recipes);
}

TEST(ResultsOfRecord, AreOfTheClaimsInTheRecipes) {
  int records = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "docs/results")) {
    if (entry.path().extension() != ".json") continue;
    const Json record = Json::parse(read_text(entry.path()));
    const fs::path recipe = source / "pipelines/recipes" / entry.path().stem() / "figure.json";
    std::vector<std::string> claimed, recorded;
    const Json document = Json::parse(read_text(recipe));
    for (const Json& stage : document["stages"]) {
      if (stage["stage"] != "claims") continue;
      for (const Json& claim : stage["claims"])
        claimed.push_back(claim["claim"].get<std::string>() + claim.value("measured_as", ""));
    }
    for (const Json& claim : record["claims"])
      recorded.push_back(claim["claim"].get<std::string>() + claim.value("measured_as", ""));
    EXPECT_EQ(recorded, claimed) << entry.path() << ": run the full preset again";
    ++records;
  }
  EXPECT_GE(records, 12);
}

TEST(ResultsOfRecord, AreListedALineARecipe) {
  const ProgramResult list = run_shakebed({"reproduce", "--list"}, source);
  ASSERT_EQ(list.exit_code, 0) << list.err;
  int lines = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(source / "pipelines/recipes")) {
    if (!fs::exists(entry.path() / "figure.json")) continue;
    EXPECT_THAT(list.out, HasSubstr(entry.path().filename().string() + " "));
    ++lines;
  }
  EXPECT_EQ(std::count(list.out.begin(), list.out.end(), '\n'), lines);
  EXPECT_EQ(run_shakebed({"reproduce", "--list", "--results"}, source).exit_code, 2);
}

TEST(ResultsOfRecord, AreJsonForPrograms) {
  const Json record = read_json(source / "docs/results/lee-1995.json")["claims"];
  const auto json = [](const std::vector<std::string>& arguments) {
    const ProgramResult ran = run_shakebed(arguments, source);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return Json::parse(ran.out);
  };
  const Json one = json({"reproduce", "lee-1995", "--results", "--json"});
  ASSERT_EQ(one.size(), 1U);
  EXPECT_EQ(one[0]["name"], "lee-1995");
  EXPECT_EQ(one[0]["claims"], record) << "all of them";
  const Json listed = json({"reproduce", "--list", "--json"});
  const auto found =
      std::find_if(listed.begin(), listed.end(), [](const Json& entry) { return entry["name"] == "lee-1995"; });
  ASSERT_NE(found, listed.end());
  EXPECT_THAT((*found)["title"].get<std::string>(), HasSubstr("Lee (1995)"));
  Json main = Json::array();
  for (const Json& claim : record)
    if (claim.value("main", false)) main.push_back(claim);
  EXPECT_EQ((*found)["claims"], main);
  EXPECT_LT(main.size(), record.size());
}

}  // namespace
