// Pipelines with images: from a simulated bed to its photographs and back, and photographs without a recipe.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

// A bed of 160 disks, 64 frames.
std::string image_recipe() {
  return R"({
  "name": "camera",
  "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1,
      "disks": { "count": 160, "diameter": "3 mm", "restitution": 0.9, "friction": 0.1, "contact_duration": "20 us" },
      "gravity": "9.81 m/s^2",
      "box": { "width": "48 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "1 s", "measure": "3.2 s", "frames": { "count": 64, "phases": 32 } },
    { "stage": "render", "from": "bed", "scale": "0.15 mm/px", "noise": 5, "exposure": "0.2 ms" },
    { "stage": "extract", "from": "render", "diameter": "3 mm" },
    { "stage": "fit", "from": "extract", "plateau_density": 1.1 },
    { "stage": "map", "from": ["fit", "bed"] },
    { "stage": "figure", "from": ["extract", "bed", "fit"], "title": "<script>alert(1)</script> & co" }
  ],
  "report": { "title": "<img src=x onerror=alert(1)>", "text": "a < b & c > d" }
})";
}

class Images : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    write_text(*folder_ / "r.json", image_recipe());
    result_ = new ProgramResult(run_shakebed({"run", "r.json", "--out", "o"}, folder_->path()));
  }
  static void TearDownTestSuite() {
    delete folder_;
    delete result_;
  }
  static Json number(const Json& json, const char* pointer) {
    const Json* found = shakebed::pipelines::find_pointer(json, pointer);
    return found != nullptr ? *found : Json(nullptr);
  }
  static ScratchFolder* folder_;
  static ProgramResult* result_;
};
ScratchFolder* Images::folder_ = nullptr;
ProgramResult* Images::result_ = nullptr;

TEST_F(Images, TheProfileFromTheFramesIsThatOfTheSimulation) {
  ASSERT_EQ(result_->exit_code, 0) << result_->err;
  const Json figure = read_json(*folder_ / "o/figure/figure.json");
  const Json rms = number(figure, "/frames_against_simulation_same_moments/value");
  ASSERT_TRUE(rms.is_number()) << figure.dump();
  EXPECT_LE(rms.get<double>(), 0.01);
  EXPECT_GT(rms.get<double>(), 0) << "two different ways cannot agree to the last bit";
  const Json extract = read_json(*folder_ / "o/extract/extract.json");
  EXPECT_GE(extract["truth"]["recall"].get<double>(), 0.995);
  EXPECT_GE(extract["truth"]["precision"].get<double>(), 0.995);
  EXPECT_LE(extract["truth"]["center_rms_error"]["value"].get<double>(), 0.1);
}

TEST_F(Images, EveryDisksCsvRowIsADiskOfTheBed) {
  ASSERT_EQ(result_->exit_code, 0);
  std::ifstream stream(*folder_ / "o/extract/disks.csv");
  std::string line;
  std::size_t rows = 0;
  bool header = false;
  while (std::getline(stream, line)) {
    if (line.empty() || line[0] == '#') continue;
    if (!header) {
      EXPECT_EQ(line, "frame,x_px,y_px,radius_px,x,z,quality");
      header = true;
      continue;
    }
    const auto cells = shakebed::pipelines::split_csv_line(line);
    ASSERT_EQ(cells.size(), 7u);
    EXPECT_GT(std::stod(cells[4]), 0.0);
    EXPECT_LT(std::stod(cells[4]), 16.0);
    ++rows;
  }
  EXPECT_NEAR(static_cast<double>(rows), 64 * 160, 64);
}

TEST_F(Images, TheReportIsOneFileThatAsksForNothing) {
  ASSERT_EQ(result_->exit_code, 0);
  const std::string page = read_text(*folder_ / "o/report.html");
  for (const char* outside : {"src=\"http", "href=\"http", "src='http", "url(http", "@import", "<script src",
                              "<script>alert", "<link rel=\"stylesheet"})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, HasSubstr("<svg class=\"plot\""));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page, HasSubstr("a &lt; b &amp; c &gt; d"));
  EXPECT_THAT(page, Not(HasSubstr("<img src=x")));
  EXPECT_THAT(page, HasSubstr("prefers-color-scheme: dark"));
}

TEST_F(Images, TheFigureHasItsDataAndItsScript) {
  ASSERT_EQ(result_->exit_code, 0);
  for (const char* name : {"profile.svg", "profile.dat", "profile.gp"})
    EXPECT_GT(fs::file_size(*folder_ / "o/figure" / name), 200u) << name;
  const std::string svg = read_text(*folder_ / "o/figure/profile.svg");
  for (const char* words : {"from the frames", "the simulation itself", "our fit", "number density", "height above"})
    EXPECT_THAT(svg, HasSubstr(words));
}

TEST_F(Images, PointsOfTheUsersAreDrawnAndCompared) {
  ASSERT_EQ(result_->exit_code, 0);
  write_text(*folder_ / "mine.csv",
             "height,number_density,std_error\n1,0.9,0.05\n2,0.95,0.05\n3,0.9,0.05\n5,0.7,0.05\n");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o", "--data", "mine.csv"}, folder_->path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("extract: up to date"));
  EXPECT_THAT(read_text(*folder_ / "o/figure/profile.svg"), HasSubstr("mine.csv"));
  const Json figure = read_json(*folder_ / "o/figure/figure.json");
  bool compared = false;
  for (const Json& row : figure["comparisons"])
    compared = compared || (row["of"] == "mine.csv" && row["points"] == 4 && row.contains("rms_difference"));
  EXPECT_TRUE(compared) << figure.dump(1);
  EXPECT_EQ(run_shakebed({"run", "r.json", "--out", "o", "--data", "nowhere.csv"}, folder_->path()).exit_code, 4);
}

TEST_F(Images, PhotographsNeedNoRecipe) {
  ASSERT_EQ(result_->exit_code, 0);
  std::vector<std::string> arguments{"fit-images"};
  for (int i = 0; i < 8; ++i)
    arguments.push_back((*folder_ / "o/render/frames" / ("00000" + std::to_string(i) + ".png")).string());
  for (const char* more : {"--diameter", "3 mm", "--plateau-density", "1.1", "--frequency", "20 Hz", "--amplitude",
                           "2 mm", "--out", "photos"})
    arguments.emplace_back(more);
  const ProgramResult result = run_shakebed(arguments, folder_->path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json extract = read_json(*folder_ / "photos/extract/extract.json");
  EXPECT_FALSE(extract["scale_given"].get<bool>());
  EXPECT_NEAR(extract["scale"]["value"].get<double>(), 0.15e-3, 0.01 * 0.15e-3) << "within 1 % from the diameter alone";
  EXPECT_EQ(extract["frames_used"], 8);
  EXPECT_TRUE(fs::is_regular_file(*folder_ / "photos/report.html"));
  // Gamma with the height of the bed at rest counted between the walls that were found.
  const Json map = read_json(*folder_ / "photos/map/map.json");
  EXPECT_GT(map["readings"].size(), 4u);
  EXPECT_NEAR(map["gamma"].is_number() ? map["gamma"].get<double>() : map["gamma"]["value"].get<double>(), 3.2194,
              1e-3);
  std::size_t overlays = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(*folder_ / "photos/extract"))
    overlays += entry.path().filename().string().starts_with("overlay_");
  EXPECT_EQ(overlays, 2u);
}

TEST_F(Images, FramesWithoutDisksAreAnInputError) {
  write_text(
      *folder_ / "noise.pgm", "P2\n64 64\n255\n" + [] {
        std::string pixels;
        for (int i = 0; i < 64 * 64; ++i) pixels += std::to_string(128 + (i * 7919) % 5) + (i % 64 == 63 ? "\n" : " ");
        return pixels;
      }());
  const ProgramResult result =
      run_shakebed({"fit-images", "noise.pgm", "--diameter", "3 mm", "--out", "n"}, folder_->path());
  EXPECT_EQ(result.exit_code, 4) << result.err;
  write_text(*folder_ / "broken.png", "\x89PNG\r\n\x1a\nnot an image");
  EXPECT_EQ(run_shakebed({"fit-images", "broken.png", "--diameter", "3 mm", "--out", "n"}, folder_->path()).exit_code,
            4);
  EXPECT_EQ(run_shakebed({"fit-images", "nowhere.png", "--diameter", "3 mm", "--out", "n"}, folder_->path()).exit_code,
            4);
  EXPECT_EQ(run_shakebed({"fit-images", "noise.pgm", "--diameter", "-3 mm"}, folder_->path()).exit_code, 2);
}

TEST_F(Images, SameSeedGivesTheSameFrames) {
  ASSERT_EQ(result_->exit_code, 0);
  ASSERT_EQ(
      run_shakebed({"run", "r.json", "--out", "again", "--until", "extract", "--jobs", "1"}, folder_->path()).exit_code,
      0);
  for (const char* name : {"render/frames/000000.png", "render/frames/000063.png", "render/truth.csv",
                           "extract/disks.csv", "extract/profile.csv", "extract/extract.json"}) {
    EXPECT_EQ(shakebed::pipelines::sha256_of_file(*folder_ / "o" / name),
              shakebed::pipelines::sha256_of_file(*folder_ / "again" / name))
        << name;
  }
}

}  // namespace
