// What the program costs besides its work. Medians of several runs; the limits are those of the project's promises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "pipelines/formats/json.hpp"
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

// The points' own work is what their stages took by themselves (their cost.json); the
// rest is reading the recipe at every point, fingerprints, records, folders, locks and gathering.
TEST(Speed, TenThousandPointsCostAtMost2MillisecondsEachAnd200Megabytes) {
  ScratchFolder folder;
  constexpr int points = 10'000;
  write_text(folder / "sweep.json", R"({ "name": "tiny", "stages": [
  { "stage": "simulate", "id": "bed", "replicas": 1, "units": "reduced",
    "disks": { "count": 2, "restitution": 0.9 },
    "box": { "width": 4, "sides": { "kind": "hard", "restitution": 0.9 }, "lid": "open" },
    "floor": { "motion": "sinusoidal", "amplitude": 0.5, "frequency": 1, "restitution": 0.9 },
    "settle": 0, "measure": 2, "frames": { "count": 0, "phases": 2 } } ],
  "sweep": { "over": { "/stages/bed/floor/amplitude": { "from": 0.4, "to": 0.9, "count": 10000 } },
             "collect": ["/bed/temperature_x", "/bed/collisions"] } })");
  const ProgramResult first =
      run_shakebed({"run", "sweep.json", "--out", "o", "--jobs", "1", "--quiet"}, folder.path());
  ASSERT_EQ(first.exit_code, 0) << first.err;
  double own_wall = 0, own_cpu = 0;
  int found = 0;
  for (const auto& point : std::filesystem::directory_iterator(folder / "o/points")) {
    const auto cost = shakebed::pipelines::read_json(point.path() / "bed/cost.json");
    own_wall += cost["wall_seconds"].get<double>(), own_cpu += cost["cpu_seconds"].get<double>();
    ++found;
  }
  ASSERT_EQ(found, points);
  const double wall = (first.seconds - own_wall) / points, cpu = (first.cpu_seconds - own_cpu) / points;
  std::printf(
      "sweep of %d points: %.2f ms wall, %.2f ms CPU a point, of which its own work %.2f and %.2f: overhead "
      "%.2f ms wall, %.2f ms CPU; %.0f MB\n",
      points, 1e3 * first.seconds / points, 1e3 * first.cpu_seconds / points, 1e3 * own_wall / points,
      1e3 * own_cpu / points, 1e3 * wall, 1e3 * cpu, 1e-3 * static_cast<double>(first.peak_kilobytes));
  EXPECT_LE(wall, 0.002);
  EXPECT_LE(first.peak_kilobytes, 200'000);
  const ProgramResult again =
      run_shakebed({"run", "sweep.json", "--out", "o", "--jobs", "1", "--quiet"}, folder.path());
  std::printf("the same again, all up to date: %.2f s\n", again.seconds);
}

}  // namespace
