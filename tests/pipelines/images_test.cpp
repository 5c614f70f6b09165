// Pipelines with images: from a simulated bed to its photographs and back, and photographs without a recipe.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;

// A bed of 100 disks, 16 frames; and one of 36, of which one frame is enough where it matters how options are judged.
std::string image_recipe() {
  return R"({
  "name": "camera",
  "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1,
      "disks": { "count": 100, "diameter": "3 mm", "restitution": 0.9, "friction": 0.1, "contact_duration": "20 us" },
      "gravity": "9.81 m/s^2",
      "box": { "width": "30 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "1 s", "measure": "0.8 s", "frames": { "count": 16, "phases": 16 } },
    { "stage": "render", "from": "bed", "scale": "0.15 mm/px", "noise": 5, "exposure": "0.2 ms" },
    { "stage": "simulate", "id": "few", "seed": 3, "replicas": 1,
      "disks": { "count": 36, "diameter": "3 mm", "restitution": 0.9, "friction": 0.1 },
      "box": { "width": "18.9 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "1 s", "measure": "0.1 s", "frames": { "count": 1 } },
    { "stage": "render", "id": "small", "from": "few", "scale": "0.15 mm/px", "noise": 5 },
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
  static std::string small_frame() { return (*folder_ / "o/small/frames/000000.png").string(); }
  static Json read_geometry() { return read_json(*folder_ / "o/render/geometry.json"); }
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
  EXPECT_NEAR(static_cast<double>(rows), 16 * 100, 16);
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
  for (int i = 0; i < 5; ++i)
    arguments.push_back((*folder_ / "o/render/frames" / ("00000" + std::to_string(i) + ".png")).string());
  for (const char* more : {"--diameter", "3 mm", "--plateau-density", "1.1", "--frequency", "20 Hz", "--amplitude",
                           "2 mm", "--out", "photos"})
    arguments.emplace_back(more);
  const ProgramResult result = run_shakebed(arguments, folder_->path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json extract = read_json(*folder_ / "photos/extract/extract.json");
  EXPECT_FALSE(extract["scale_given"].get<bool>());
  EXPECT_NEAR(extract["scale"]["value"].get<double>(), 0.15e-3, 0.01 * 0.15e-3) << "within 1 % from the diameter alone";
  EXPECT_EQ(extract["frames_used"], 5);
  // The scale is known as well as the radius of the beads.
  EXPECT_GT(error(extract["scale"]), 0);
  EXPECT_NEAR(error(extract["scale"]) / value(extract["scale"]), error(extract["radius"]) / value(extract["radius"]),
              1e-6);
  EXPECT_NEAR(value(extract["scale"]) * 2 * value(extract["radius"]), 3e-3, 1e-9) << "two radii are a diameter";
  const Json bed = read_json(*folder_ / "photos/extract/bed.json");
  EXPECT_DOUBLE_EQ(value(bed["width"]), 3e-3 * value(extract["width"]));
  EXPECT_DOUBLE_EQ(bed["count"].get<double>(), value(extract["disks_per_frame"]));
  EXPECT_TRUE(fs::is_regular_file(*folder_ / "photos/report.html"));
  // Gamma with the height of the bed at rest counted between the walls that were found.
  const Json map = read_json(*folder_ / "photos/map/map.json");
  EXPECT_GT(map["readings"].size(), 4u);
  EXPECT_NEAR(map["gamma"].is_number() ? map["gamma"].get<double>() : map["gamma"]["value"].get<double>(), 3.2194,
              1e-3);
  // Of digits 1 mm and 1 Hz apart, each rounded: 0.289 of either, and the frequency counts twice.
  EXPECT_NEAR(error(map["gamma"]), 3.2194 * std::hypot(0.28868 / 2, 2 * 0.28868 / 20), 1e-3);
  EXPECT_THAT(result.out, HasSubstr("map: Gamma = 3.2"));
  EXPECT_THAT(result.err, Not(HasSubstr("Gamma = ")));
  EXPECT_NEAR(value(map["initial_height"]), value(extract["column_number"]) / 1.1, 1e-9) << "N D/W over phi_0";
  std::size_t overlays = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(*folder_ / "photos/extract"))
    overlays += entry.path().filename().string().starts_with("overlay_");
  EXPECT_EQ(overlays, 2u);
}

// Asked for beads of two kinds where only one is seen, nothing says which kind the scale is that of.
TEST_F(Images, ASecondDiameterThatIsNotFoundLeavesNoTemperature) {
  const std::string frame = small_frame();
  const ProgramResult result = run_shakebed(
      {"fit-images", frame, "--diameter", "3 mm", "--second-diameter", "2 mm", "--until", "fit", "--out", "two"},
      folder_->path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("second diameter"));
  const Json answer = read_json(*folder_ / "two/fit/fit.json")["answer"];
  EXPECT_THAT(answer["why"].get<std::string>(), HasSubstr("every length may be wrong by up to 50 %"));
  EXPECT_FALSE(answer.contains("temperature"));
}

TEST_F(Images, FramesWithoutDisksAreRefusedAndUnreadableOnesAreAnInputError) {
  write_text(
      *folder_ / "noise.pgm", "P2\n64 64\n255\n" + [] {
        std::string pixels;
        for (int i = 0; i < 64 * 64; ++i) pixels += std::to_string(128 + (i * 7919) % 5) + (i % 64 == 63 ? "\n" : " ");
        return pixels;
      }());
  const ProgramResult result =
      run_shakebed({"fit-images", "noise.pgm", "--diameter", "3 mm", "--out", "n"}, folder_->path());
  EXPECT_EQ(result.exit_code, 5) << result.err;
  EXPECT_NE(result.err.find("n/no-beads/preview.html"), std::string::npos) << result.err;
  EXPECT_TRUE(fs::is_regular_file(*folder_ / "n/no-beads/preview.html"));
  const ProgramResult preview =
      run_shakebed({"fit-images", "noise.pgm", "--diameter", "3 mm", "--preview", "--out", "p"}, folder_->path());
  EXPECT_EQ(preview.exit_code, 5) << preview.err;
  // Where nothing was seen, nothing is proposed.
  EXPECT_THAT(result.err, HasSubstr("No option that was tried leads to beads"));
  EXPECT_THAT(result.err, HasSubstr("at least 10 pixels wide"));
  EXPECT_THAT(result.err, Not(HasSubstr("--radius ")));
  EXPECT_THAT(read_text(*folder_ / "p/preview.html"), Not(HasSubstr("--radius")));
  EXPECT_TRUE(preview.out.empty() && fs::is_regular_file(*folder_ / "p/preview.html"));
  fs::create_directory(*folder_ / "empty");
  const ProgramResult empty = run_shakebed({"fit-images", "empty", "--diameter", "3 mm"}, folder_->path());
  EXPECT_EQ(empty.exit_code, 4);
  EXPECT_NE(empty.err.find("error: the folder \""), std::string::npos) << empty.err;
  const ProgramResult scale =
      run_shakebed({"fit-images", "noise.pgm", "--diameter", "3 mm", "--scale", "0.2 mm"}, folder_->path());
  EXPECT_EQ(scale.exit_code, 2);
  EXPECT_NE(scale.err.find("error: --scale: \"0.2 mm\" is a length"), std::string::npos) << scale.err;
  write_text(*folder_ / "broken.png", "\x89PNG\r\n\x1a\nnot an image");
  EXPECT_EQ(run_shakebed({"fit-images", "broken.png", "--diameter", "3 mm", "--out", "n"}, folder_->path()).exit_code,
            4);
  fs::create_directory(*folder_ / "all-broken");
  for (const char* name : {"1.png", "2.png", "3.png"})
    write_text(*folder_ / "all-broken" / name, "\x89PNG\r\n\x1a\nnot an image");
  for (const std::vector<std::string>& more : {std::vector<std::string>{}, {"--preview"}}) {
    std::vector<std::string> arguments{"fit-images", "all-broken", "--diameter", "3 mm", "--out", "n"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(run_shakebed(arguments, folder_->path()).exit_code, 4) << more.size();
  }
  EXPECT_EQ(run_shakebed({"fit-images", "nowhere.png", "--diameter", "3 mm", "--out", "n"}, folder_->path()).exit_code,
            4);
  EXPECT_EQ(run_shakebed({"fit-images", "noise.pgm", "--diameter", "-3 mm"}, folder_->path()).exit_code, 2);
}

// A preview accepts the options that a run accepts, and no others.
TEST_F(Images, APreviewTakesTheScaleAsARunDoes) {
  ASSERT_EQ(result_->exit_code, 0);
  const std::string picture = small_frame();
  const auto ends = [&](const char* scale, bool preview) {
    std::vector<std::string> arguments{"fit-images", picture, "--diameter", "3 mm", "--scale", scale, "--out", "s"};
    if (preview) arguments.emplace_back("--preview");
    return run_shakebed(arguments, folder_->path());
  };
  for (const bool preview : {false, true}) {
    const ProgramResult without_unit = ends("3", preview);
    EXPECT_EQ(without_unit.exit_code, 2) << preview;
    EXPECT_THAT(without_unit.err, HasSubstr("--scale: \"3\" has no unit"));
    const ProgramResult another_unit = ends("3 m/px", preview);
    EXPECT_EQ(another_unit.exit_code, 5) << preview;
    EXPECT_THAT(another_unit.err, HasSubstr("with the length of a pixel given (scale), a bead of 3 mm is 0.001 px"));
    EXPECT_THAT(another_unit.err, HasSubstr("a pixel is about 0.15")) << "the true scale is 0.15 mm/px";
    EXPECT_THAT(another_unit.err, HasSubstr("leave out --scale (tried: 36 dark beads"));
  }
  EXPECT_EQ(ends("0.15 mm/px", true).exit_code, 0);
}

// Ovals on a lattice, 1.3 times as long as wide, each turned another way, drawn pixel by pixel.
std::string picture_of_ovals() {
  constexpr int columns = 7, rows = 5, step = 34, width = columns * step + 40, height = rows * step + 40;
  std::string pixels;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int column = std::clamp((x - 20) / step, 0, columns - 1), row = std::clamp((y - 20) / step, 0, rows - 1);
      const double u = x - (20 + step * (column + 0.5)), v = y - (20 + step * (row + 0.5));
      const double turn = 0.7 * column + 1.9 * row, a = 14.8, b = 11.4;
      const double along = (u * std::cos(turn) + v * std::sin(turn)) / a,
                   across = (v * std::cos(turn) - u * std::sin(turn)) / b;
      const double outside = (std::hypot(along, across) - 1) * b;
      const int noise = (x * 7919 + y * 104729) % 7 - 3;
      pixels += std::to_string(static_cast<int>(200 - 150 * std::clamp(0.5 - outside, 0.0, 1.0)) + noise) + " ";
    }
    pixels += "\n";
  }
  return "P2\n" + std::to_string(width) + " " + std::to_string(height) + "\n255\n" + pixels;
}

// The refusal names an option that, given as it stands, leads to the 35 ovals and a warning.
// Options that exclude the beads: what is seen without them is said.
TEST_F(Images, WrongPolarityIsNamedWhereBeadsAreSeenWithoutIt) {
  const std::string frame = small_frame();
  const ProgramResult result = run_shakebed(
      {"fit-images", frame, "--diameter", "3 mm", "--polarity", "bright", "--out", "p", "--preview"}, folder_->path());
  EXPECT_EQ(result.exit_code, 5) << result.out;
  EXPECT_THAT(result.err, testing::ContainsRegex("leave out --polarity .tried: 3[0-9] dark beads of (9|10)"));
}

// A scale that contradicts the diameter makes every length wrong: no temperature.
TEST_F(Images, AScaleThatContradictsTheDiameterLeavesNoTemperature) {
  const std::string frame = small_frame();
  const auto answer = [&](const char* scale) {
    const ProgramResult result = run_shakebed(
        {"fit-images", frame, "--diameter", "3 mm", "--scale", scale, "--until", "fit", "--out", "scaled", "--force"},
        folder_->path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_json(*folder_ / "scaled/fit/fit.json")["answer"].value("why", "");
  };
  const char* contradicted = "a bead is 17.14 px wide, but the beads found are 20";
  EXPECT_THAT(answer("0.175 mm/px"), HasSubstr(contradicted));
  EXPECT_THAT(answer("0.155 mm/px"), Not(HasSubstr("By the scale and the diameter")));
}

TEST_F(Images, WhatIsNotRoundIsRefusedAndMeasuredOnDemand) {
  write_text(*folder_ / "ovals.pgm", picture_of_ovals());
  const std::vector<std::string> arguments{"fit-images", "ovals.pgm", "--diameter", "3 mm", "--out", "ovals"};
  const ProgramResult refused = run_shakebed(arguments, folder_->path());
  ASSERT_EQ(refused.exit_code, 5) << refused.err;
  const std::size_t from = refused.err.find("--polarity"), to = refused.err.find("--shape any");
  ASSERT_NE(to, std::string::npos) << refused.err;
  std::vector<std::string> followed = arguments;
  std::istringstream options(refused.err.substr(from, to + 11 - from));
  for (std::string word; options >> word;) followed.push_back(word);
  const ProgramResult measured = run_shakebed(followed, folder_->path());
  EXPECT_THAT(measured.err, HasSubstr("the outlines are not those of disks"));
  const Json extract = read_json(*folder_ / "ovals/extract/extract.json");
  EXPECT_NEAR(value(extract["disks_per_frame"]), 35, 1) << measured.err;
  EXPECT_THAT(extract["objections"].dump(), HasSubstr("the theory describes disks"));
}

TEST_F(Images, SameSeedGivesTheSameFrames) {
  ASSERT_EQ(result_->exit_code, 0);
  ASSERT_EQ(
      run_shakebed({"run", "r.json", "--out", "again", "--until", "extract", "--jobs", "1"}, folder_->path()).exit_code,
      0);
  for (const char* name : {"render/frames/000000.png", "render/frames/000015.png", "render/truth.csv",
                           "extract/disks.csv", "extract/profile.csv", "extract/extract.json"}) {
    EXPECT_EQ(shakebed::pipelines::sha256_of_file(*folder_ / "o" / name),
              shakebed::pipelines::sha256_of_file(*folder_ / "again" / name))
        << name;
  }
}

// --- numbers of extract and render, against the files beside them and against the bed that was photographed

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double one : values) sum += one;
  return sum / static_cast<double>(values.size());
}
double deviation_of(const std::vector<double>& values) {
  double squares = 0;
  for (const double one : values) squares += std::pow(one - mean_of(values), 2);
  return std::sqrt(squares / static_cast<double>(values.size() - 1));
}

TEST_F(Images, NumbersOfARenderedBedAreThoseOfItsGeometry) {
  ASSERT_EQ(result_->exit_code, 0);
  const Json render = read_json(*folder_ / "o/render/render.json");
  EXPECT_EQ(render["frames"], 16);
  EXPECT_DOUBLE_EQ(value(render["scale"]), 0.15e-3);
  EXPECT_DOUBLE_EQ(value(render["radius"]), 10) << "3 mm are 20 px";
  const NumberTable truth(*folder_ / "o/render/truth.csv");
  ASSERT_EQ(truth.rows(), 16U * 100U);
  for (std::size_t r = 0; r < truth.rows(); r += 997) EXPECT_NEAR(truth("radius_px", r), 10, 1e-6);
  EXPECT_GE(value(render["width"]), 30 / 0.15);
  const Json extract = read_json(*folder_ / "o/extract/extract.json");
  EXPECT_DOUBLE_EQ(value(extract["scale"]), 0.15e-3);
  EXPECT_DOUBLE_EQ(value(extract["diameter"]), 3e-3);
  EXPECT_NEAR(value(extract["width"]), 10, 1e-9);
  EXPECT_NEAR(value(extract["right_wall"]) - value(extract["left_wall"]), 200, 1e-9);
  EXPECT_NEAR(value(extract["radius"]), 10, 0.05);
  EXPECT_NEAR(value(extract["noise"]), 5, 0.5) << "drawn with 5 grey levels";
  EXPECT_TRUE(extract["scale_given"] && extract["floor_given"] && extract["walls_given"]);
}

TEST_F(Images, CountsAreThoseOfTheTables) {
  ASSERT_EQ(result_->exit_code, 0);
  const Json extract = read_json(*folder_ / "o/extract/extract.json");
  const NumberTable frames(*folder_ / "o/extract/frames.csv"), quality(*folder_ / "o/extract/quality.csv"),
      details(*folder_ / "o/extract/disk_details.csv"), disks(*folder_ / "o/extract/disks.csv");
  const std::vector<double> counts = frames.column("disks");
  ASSERT_EQ(counts.size(), 16U);
  EXPECT_EQ(extract["frames"], 16);
  EXPECT_EQ(extract["frames_used"], 16);
  EXPECT_NEAR(value(extract["disks_per_frame"]), mean_of(counts), 1e-9);
  EXPECT_NEAR(extract["disks_per_frame_scatter"].get<double>(), deviation_of(counts), 1e-9);
  EXPECT_NEAR(value(extract["column_number"]), mean_of(counts) / 10, 1e-9);
  EXPECT_NEAR(error(extract["column_number"]), deviation_of(counts) / 10 / std::sqrt(16), 1e-12)
      << "of the mean of 16 frames";
  double all = 0, cut = 0, hidden = 0, best = 0;
  for (const double one : quality.column("disks")) all += one;
  EXPECT_EQ(all, static_cast<double>(disks.rows()));
  for (std::size_t r = 0; r < details.rows(); ++r) cut += details("cut", r), hidden += details("half_hidden", r);
  EXPECT_EQ(extract["cut_disks"], cut);
  EXPECT_EQ(extract["half_hidden_disks"], hidden);
  std::vector<double> qualities = disks.column("quality");
  std::sort(qualities.begin(), qualities.end());
  EXPECT_NEAR(extract["quality"]["median"].get<double>(), qualities[qualities.size() / 2], 0.0201) << "classes of 0.02";
  EXPECT_NEAR(extract["quality"]["lowest_percent"].get<double>(), qualities[qualities.size() / 100], 0.0201);
  const NumberTable profile(*folder_ / "o/extract/profile.csv");
  const double spacing = profile("height", 1) - profile("height", 0);
  double area = 0;
  for (std::size_t r = 0; r < profile.rows(); ++r) {
    const double density = profile("number_density", r);
    best = std::max(best, density), area += density * spacing;
    EXPECT_NEAR(profile("area_fraction", r), M_PI / 4 * density, 1e-9);
    EXPECT_NEAR(profile("samples", r), density * 10 * spacing * 16, 0.5 + 1e-6);
  }
  EXPECT_NEAR(area * 10, mean_of(counts), 0.002 * mean_of(counts));
  EXPECT_DOUBLE_EQ(value(extract["profile"]["greatest_density"]), best);
  EXPECT_EQ(extract["profile"]["frames"], 16);
}

// Each disk's own errors: 16 frames of 100 disks, centres found against the true ones, in units of the stated errors.
TEST_F(Images, CentresScatterByTheirStatedErrors) {
  ASSERT_EQ(result_->exit_code, 0);
  const Json truth = read_json(*folder_ / "o/extract/extract.json")["truth"];
  const NumberTable disks(*folder_ / "o/extract/disks.csv"), details(*folder_ / "o/extract/disk_details.csv"),
      real(*folder_ / "o/render/truth.csv");
  std::map<double, std::vector<std::pair<double, double>>> centres;
  for (std::size_t r = 0; r < real.rows(); ++r)
    centres[real("frame", r)].emplace_back(real("x_px", r), real("y_px", r));
  const double left = value(read_geometry()["left_wall"]), floor = value(read_geometry()["floor"]);
  double matched = 0, squares = 0, scaled_x = 0, scaled_y = 0;
  for (std::size_t r = 0; r < disks.rows(); ++r) {
    const double x = disks("x_px", r), y = disks("y_px", r);
    double best = 25, dx = 0, dy = 0;  // half a radius
    for (const auto& [tx, ty] : centres[disks("frame", r)]) {
      const double distance = std::pow(tx - x, 2) + std::pow(ty - y, 2);
      if (distance < best) best = distance, dx = tx - x, dy = ty - y;
    }
    if (best == 25) continue;
    ++matched, squares += best;
    scaled_x += std::pow(dx / details("std_error_x_px", r), 2),
        scaled_y += std::pow(dy / details("std_error_y_px", r), 2);
    // Pixels and D: x from the left wall, z from the floor, 20 px a diameter.
    EXPECT_NEAR(disks("x", r), (x - left) / 20, 1e-4);
    EXPECT_NEAR(disks("z", r), (floor - y) / 20, 1e-4);
  }
  EXPECT_NEAR(value(truth["center_rms_error"]), std::sqrt(squares / matched), 1e-3 * std::sqrt(squares / matched));
  EXPECT_NEAR(truth["precision"].get<double>(), matched / static_cast<double>(disks.rows()), 1e-3);
  EXPECT_NEAR(truth["recall"].get<double>(), matched / static_cast<double>(real.rows()), 1e-3);
  EXPECT_NEAR(std::sqrt(scaled_x / matched), 1, 0.35);
  EXPECT_NEAR(std::sqrt(scaled_y / matched), 1, 0.35);
}

// The pictures of a bed with periodic sides show no walls. Their files say where the sides are.
TEST(PeriodicBed, HasTheWidthOfItsBoxInItsPictures) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "periodic", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 4, "replicas": 1,
      "disks": { "count": 120, "diameter": "3 mm", "restitution": 0.9, "contact_duration": "20 us" },
      "box": { "width": "36.9 mm", "sides": "periodic" },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.3 s", "measure": "0.5 s", "frames": { "count": 4 } },
    { "stage": "render", "from": "bed", "scale": "0.2 mm/px", "noise": 3 },
    { "stage": "extract", "id": "seen", "from": "render", "use_geometry": false } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(ran.err, HasSubstr("the bed has periodic sides, so the pictures show no walls"));
  EXPECT_THAT(ran.err, HasSubstr("--left-wall 11.5 --right-wall 196"));
  EXPECT_NEAR(value(read_json(folder / "o/seen/extract.json")["width"]), 12.3, 0.05);
  fs::create_directory(folder / "copies");
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "o/render/frames"))
    fs::copy_file(entry.path(), folder / "copies" / ("a" + entry.path().filename().string()));
  const ProgramResult photographed =
      run_shakebed({"fit-images", "copies", "--diameter", "3 mm", "--until", "extract", "--out", "p"}, folder.path());
  ASSERT_EQ(photographed.exit_code, 0) << photographed.err;
  EXPECT_THAT(photographed.err, HasSubstr("a simulated bed with periodic sides"));
  const Json extract = read_json(folder / "p/extract/extract.json");
  EXPECT_NEAR(value(extract["width"]), 12.3, 0.05);
  EXPECT_NEAR(value(extract["column_number"]), 120 / 12.3, 0.01 * 120 / 12.3);
  EXPECT_TRUE(read_json(folder / "p/extract/bed.json")["periodic"].get<bool>());
}

// A film of a shaken bed, whose temperatures and shaking the simulation knows; then every second frame of it.
TEST(Film, HasTheTemperaturesAndTheShakingOfItsBed) {
  const ScratchFolder folder;
  const std::string recipe = R"({ "name": "film", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 4, "disks": { "count": 50, "diameter": "3 mm", "restitution": 0.9 },
      "box": { "width": "18.9 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.5 s", "measure": "0.3 s", "frames": { "count": 192, "phases": 64 } },
    { "stage": "render", "from": "bed", "scale": "0.25 mm/px", "noise": 2 },
    { "stage": "render", "id": "low", "from": "bed", "scale": "0.25 mm/px", "frames": 1, "height": "30 mm" },
    { "stage": "render", "id": "high", "from": "bed", "scale": "0.25 mm/px", "frames": 1, "height": "45 mm" },
    { "stage": "extract", "id": "all", "from": "render", "diameter": "3 mm", "frame_rate": "1280 Hz" },
    { "stage": "extract", "id": "second", "from": "render", "diameter": "3 mm", "frame_rate": "1280 Hz", "stride": 2 },
    { "stage": "extract", "id": "late", "from": "render", "diameter": "3 mm", "skip": 162, "stride": 3 } ] })";
  write_text(folder / "r.json", recipe);
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json bed = read_json(folder / "o/bed/observables.json");
  for (const char* id : {"all", "second"}) {
    const Json extract = read_json(folder / (std::string("o/") + id + "/extract.json"));
    EXPECT_EQ(extract["frames"], std::string(id) == "all" ? 192 : 96);
    for (const char* axis : {"temperature_x_over_mg", "temperature_z_over_mg"}) {
      const Json& found = extract["velocities"][axis];
      ASSERT_TRUE(found.is_object()) << id << " " << extract["velocities"].dump();
      std::string same = axis;  // the same moments: what differs is the finite time between pictures
      const double truth = value(bed[same.insert(13, "_without_flow")]);
      EXPECT_EQ(found["unit"], "m");
      EXPECT_NEAR(value(found) / truth, 1, std::string(id) == "all" ? 0.1 : 0.2) << id << " " << axis;
      EXPECT_NEAR(value(found), truth, 2.5 * error(found)) << id << " " << axis;
      EXPECT_GT(error(found), 0);
      EXPECT_LT(error(found), value(found));
    }
    EXPECT_GT(extract["velocities"]["linked_share"], 0.8);
    if (!extract.contains("frequency")) continue;
    EXPECT_NEAR(value(extract["frequency"]), 20, 0.5) << id;
    EXPECT_NEAR(value(extract["floor_amplitude"]), 2e-3, 0.4e-3) << id;
    EXPECT_FALSE(extract["frequency_given"]);
  }
  const Json one = read_json(folder / "o/all/extract.json"), two = read_json(folder / "o/second/extract.json");
  const Json late = read_json(folder / "o/late/extract.json");
  EXPECT_EQ(late["frames"], 10) << "162, 165, ... 189 of 192";
  EXPECT_GT(late["truth"]["recall"], 0.99) << "beside the truth of these frames";
  EXPECT_NEAR(value(two["velocities"]["mean_step"]) / value(one["velocities"]["mean_step"]), 2, 0.4);
  EXPECT_DOUBLE_EQ(value(one["velocities"]["frame_rate"]) / value(two["velocities"]["frame_rate"]), 2);
  const auto rows = [&](const char* id) { return value(read_json(folder / "o" / id / "render.json")["height"]); };
  EXPECT_EQ(rows("high") - rows("low"), 60) << "15 mm more to see, of 0.25 mm a pixel";
}

// fit-images of the frames that a recipe has rendered into o.
ProgramResult fit_film(const ScratchFolder& folder, const char* out, const std::vector<std::string>& more) {
  std::vector<std::string> arguments{"fit-images", "o/render/frames", "--diameter", "3 mm", "--out", out};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_shakebed(arguments, folder.path());
}

// 48 frames of a bed, of which a part is measured: for an error, and for a time.
TEST(FrameBudget, ChoosesHowManyFramesAreMeasured) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "film", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 4, "replicas": 1, "disks": { "count": 60, "diameter": "3 mm", "restitution": 0.9 },
      "box": { "width": "24.9 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "1 s", "measure": "5 s", "frames": { "count": 48 } },
    { "stage": "render", "from": "bed", "scale": "0.3 mm/px", "noise": 2 } ] })");
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "o"}, folder.path()).exit_code, 0);
  const auto fit = [&](const char* out, const std::vector<std::string>& more) { return fit_film(folder, out, more); };
  const ProgramResult some = fit("some", {"--budget", "6 %"});
  ASSERT_EQ(some.exit_code, 0) << some.err;
  const Json said = read_json(folder / "some/manifest.json")["budget"];
  EXPECT_EQ(said["asked"], "6 %");
  const Json& frames = said["frames"];
  EXPECT_EQ(frames["of"], 48);
  EXPECT_EQ(frames["pilot"]["frames"], 16);
  const auto stride = frames["stride"].get<std::uint64_t>(), measured = frames["measured"].get<std::uint64_t>();
  EXPECT_EQ(measured, (48 + stride - 1) / stride);
  EXPECT_EQ(read_json(folder / "some/extract/extract.json")["frames"], measured);
  EXPECT_THAT(some.err, HasSubstr("chooses " + std::to_string(measured) + " of 48 frames"));
  EXPECT_THAT(some.err, HasSubstr("statistical error of T: "));
  const Json result = read_json(folder / "some/fit/fit.json");
  const double reached = value(result["statistical_error"]) / value(result["temperature"]);
  EXPECT_NEAR(reached / frames["expected_error"].get<double>(), 1, 0.6) << "the pilot's error is known to a fifth";

  const ProgramResult all = fit("some", {"--budget", "0.1 %", "--dry-run"});
  ASSERT_EQ(all.exit_code, 0) << all.err;
  EXPECT_THAT(all.err, HasSubstr("all 48 frames together leave a statistical error of T of about"));
  EXPECT_EQ(read_json(folder / "some/extract/extract.json")["frames"], measured) << "nothing ran";

  EXPECT_THAT(fit("some", {"--budget", "6 %", "--skip", "40", "--dry-run"}).err,
              HasSubstr("--budget \"6 %\": all 8 frames are measured"));

  // Of no more frames than a pilot's all are measured, each.
  const std::string first = std::filesystem::directory_iterator(folder / "o/render/frames")->path().string();
  const ProgramResult one =
      run_shakebed({"fit-images", first, "--diameter", "3 mm", "--budget", "6 %", "--out", "one"}, folder.path());
  EXPECT_THAT(one.err, HasSubstr("--budget \"6 %\": all 1 frames are measured"));
  EXPECT_EQ(read_json(folder / "one/manifest.json")["budget"]["frames"],
            Json::parse(R"({ "stride": 1, "measured": 1, "of": 1 })"));

  const ProgramResult short_time = fit("some", {"--budget", "1 ms"});
  EXPECT_EQ(short_time.exit_code, 5) << short_time.err;
  EXPECT_THAT(short_time.err, HasSubstr("Allow more time"));
}

// Beads of 12.5 px radius: averaged over squares of 2 x 2 pixels they are left 6.25.
TEST(FrameBudget, TriesFramesOfFewerPixelsWhereManyAreMeasured) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "film", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 5, "replicas": 1, "disks": { "count": 24, "diameter": "3 mm", "restitution": 0.9 },
      "box": { "width": "15.9 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.5 s", "measure": "3.3 s", "frames": { "count": 66 } },
    { "stage": "render", "from": "bed", "scale": "0.12 mm/px", "noise": 2 } ] })");
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "o"}, folder.path()).exit_code, 0);
  const auto fit = [&](const char* out, const std::vector<std::string>& more) { return fit_film(folder, out, more); };
  const ProgramResult many = fit("many", {"--budget", "0.1 %", "--dry-run"});
  ASSERT_EQ(many.exit_code, 0) << many.err;
  const Json fine = read_json(folder / "many/.pilot/every-4/extract/extract.json"),
             coarse = read_json(folder / "many/.pilot/every-4-by-2/extract/extract.json");
  EXPECT_EQ(fine["reduction"], 1);
  EXPECT_EQ(coarse["reduction"], 2);
  for (const char* name : {"radius", "scale", "width", "column_number"})
    EXPECT_NEAR(value(coarse[name]) / value(fine[name]), 1, 0.004) << name;
  for (const char* name : {"left_wall", "right_wall", "floor"})
    EXPECT_NEAR(value(coarse[name]), value(fine[name]), 0.25) << name << ", in pixels of the frames as they are";

  const ProgramResult blind = fit("blind", {"--set", "/stages/extract/reduction=5"});
  EXPECT_EQ(blind.exit_code, 5);
  EXPECT_THAT(blind.err, HasSubstr("averaged over squares of 5 px (reduction), a bead of 12."));
  EXPECT_THAT(blind.err, HasSubstr("px radius is left with 2.48 px; 3 px are needed. Give at most 4"));
}

}  // namespace
