// What the program costs besides its work. Medians of several runs; the limits are those of the project's promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;

double median_seconds(const std::vector<std::string>& arguments, const std::filesystem::path& directory, int runs) {
  std::vector<double> seconds;
  for (int i = 0; i < runs; ++i) seconds.push_back(run_shakebed(arguments, directory).seconds);
  std::nth_element(seconds.begin(), seconds.begin() + runs / 2, seconds.end());
  return seconds[static_cast<std::size_t>(runs / 2)];
}

TEST(Speed, CommandsWithoutImagesStartWithin20Milliseconds) {
  ScratchFolder folder;
  write_text(folder / "r.json", small_recipe());
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"--version"},
                                                    {"theory", "--plateau-density", "1.1"},
                                                    {"validate", "r.json"},
                                                    {"schema"},
                                                    {"run", "r.json", "--dry-run"}}) {
    const double seconds = median_seconds(arguments, folder.path(), 15);
    std::printf("%-10s %.1f ms\n", arguments.front().c_str(), 1e3 * seconds);
    EXPECT_LE(seconds, 0.020) << arguments.front();
  }
}

TEST(Speed, ACachedPipelineOfSixStagesEndsWithin100Milliseconds) {
  ScratchFolder folder;
  std::string recipe = small_recipe();
  recipe.replace(recipe.find("{ \"stage\": \"check\""), 0,
                 R"({ "stage": "fit", "id": "fit-2", "from": "bed", "model": "fermi", "plateau_density": 1.1 },
    { "stage": "map", "from": ["fit", "bed"] },
    { "stage": "figure", "from": ["bed", "fit"] },
    )");
  write_text(folder / "r.json", recipe);
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "o"}, folder.path()).exit_code, 0);
  const double seconds = median_seconds({"run", "r.json", "--out", "o"}, folder.path(), 11);
  std::printf("cached pipeline of 6 stages: %.1f ms\n", 1e3 * seconds);
  EXPECT_LE(seconds, 0.100);
}

TEST(Speed, ValidatingAMegabyteTakesAtMost100Milliseconds) {
  ScratchFolder folder;
  std::string recipe = small_recipe();
  std::string padding;
  while (padding.size() < 1'000'000)
    padding += "\n    { \"stage\": \"fit\", \"id\": \"f" + std::to_string(padding.size()) +
               "\", \"from\": \"bed\", \"plateau_density\": 1.1, \"$comment\": \"" + std::string(400, 'x') + "\" },";
  recipe.replace(recipe.find("{ \"stage\": \"check\""), 0, padding);
  write_text(folder / "large.json", recipe);
  ASSERT_EQ(run_shakebed({"validate", "large.json"}, folder.path()).exit_code, 0);
  const double seconds = median_seconds({"validate", "large.json"}, folder.path(), 7);
  std::printf("validate %.2f MB: %.1f ms\n", 1e-6 * static_cast<double>(recipe.size()), 1e3 * seconds);
  EXPECT_LE(seconds, 0.100);
}

}  // namespace
