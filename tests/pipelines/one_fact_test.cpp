// One fact, one place: a fact of the bed, a kernel or an error bar gives the same number wherever it is read from.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

namespace fs = std::filesystem;
using namespace shakebed::tests;
using shakebed::pipelines::Json;
using testing::HasSubstr;

// A shaken bed of 40 disks of 3 mm in 48.9 mm, photographed; about 0.2 s.
std::string photographed_bed(const std::string& extract, const std::string& fit = "", const std::string& more = "",
                             const std::string& scale = "0.3 mm/px") {
  return R"({ "name": "t", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1, "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.7 },
      "box": { "width": "48.9 mm" }, "floor": { "motion": "sinusoidal", "amplitude": "2.5 mm", "frequency": "20 Hz" },
      "settle": "0.5 s", "measure": "1 s", "frames": { "count": 4, "phases": 4 } },
    { "stage": "render", "from": "bed", "scale": ")" +
         scale + R"(" },
    { "stage": "extract", "from": "render")" +
         extract + R"( },
    { "stage": "fit", "from": "extract")" +
         fit + " }" + more + " ] }";
}

class OneFact : public testing::Test {
 protected:
  ProgramResult run(const std::string& recipe, std::vector<std::string> arguments = {"run", "r.json", "--out", "o"}) {
    write_text(folder_ / "r.json", recipe);
    return run_shakebed(arguments, folder_.path());
  }
  Json result(const std::string& file) { return Json::parse(read_text(folder_ / file)); }
  ScratchFolder folder_;
};

// Other contradictions: consistency_test.cpp.
TEST_F(OneFact, AMapMayNotContradictTheBedsGammaOrGravity) {
  const auto error_of = [&](const std::string& fit, const std::string& more) {
    const ProgramResult refused = run(photographed_bed("", fit, more), {"validate", "r.json"});
    EXPECT_EQ(refused.exit_code, 3) << fit << more;
    return refused.err;
  };
  EXPECT_THAT(error_of("", R"(, { "stage": "map", "from": "fit", "gamma": 4 })"), HasSubstr("/stages/4/gamma: is 4"));
  EXPECT_THAT(error_of("", R"(, { "stage": "map", "from": "fit", "gravity": "1.62 m/s^2" })"),
              HasSubstr("but 9.81 m/s^2 in"));
}

TEST_F(OneFact, WhatTheBedKnowsNeedNotBeStatedAgain) {
  const ProgramResult said =
      run(photographed_bed(R"(, "diameter": "3 mm")", R"(, "diameter": "3 mm")"), {"run", "r.json", "--out", "said"});
  const ProgramResult unsaid =
      run(photographed_bed("", "", R"(, { "stage": "map", "from": "fit" })"), {"run", "r.json", "--out", "unsaid"});
  ASSERT_EQ(said.exit_code, 0) << said.err;
  ASSERT_EQ(unsaid.exit_code, 0) << unsaid.err;
  EXPECT_EQ(read_text(folder_ / "said/fit/fit.json"), read_text(folder_ / "unsaid/fit/fit.json"));
  const Json fit = result("unsaid/fit/fit.json"), bed = result("unsaid/fit/bed.json"),
             map = result("unsaid/map/map.json");
  EXPECT_DOUBLE_EQ(fit["temperature_over_mg"]["value"].get<double>(), 3e-3 * fit["temperature"]["value"].get<double>());
  EXPECT_DOUBLE_EQ(bed["diameter"]["value"].get<double>(), 3e-3);
  EXPECT_NEAR(map["gamma"]["value"].get<double>(), 2.5e-3 * std::pow(2 * M_PI * 20, 2) / 9.81, 1e-12);
  EXPECT_DOUBLE_EQ(map["initial_height"]["value"].get<double>(),
                   40 / 16.3 / fit["plateau_density"]["value"].get<double>())
      << "N D/W over phi_0";
}

TEST_F(OneFact, PhotographsOfTheUsersOwnNeedTheirDiameterAndCarryIt) {
  ASSERT_EQ(run(photographed_bed("", "", "", "0.15 mm/px")).exit_code, 0);
  const std::string own = R"({ "name": "t", "stages": [
    { "stage": "extract", "images": "o/render/frames/*.png"%, "scale": "0.15 mm/px", "left_wall": 11.5, "right_wall": 337.5 },
    { "stage": "fit", "from": "extract" } ] })";
  const auto with = [&](const std::string& text) { return std::string(own).replace(own.find('%'), 1, text); };
  const ProgramResult missing = run(with(""), {"validate", "r.json"});
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_THAT(missing.err, HasSubstr("/stages/0/diameter: \"diameter\" is missing"));
  const ProgramResult ran =
      run(with(R"(, "diameter": "3 mm", "gravity": "1.62 m/s^2")"), {"run", "r.json", "--out", "p"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const Json bed = result("p/fit/bed.json"), fit = result("p/fit/fit.json");
  EXPECT_DOUBLE_EQ(bed["diameter"]["value"].get<double>(), 3e-3);
  EXPECT_DOUBLE_EQ(bed["gravity"]["value"].get<double>(), 1.62);
  EXPECT_TRUE(bed["mass"].is_null());
  EXPECT_NEAR(bed["width"]["value"].get<double>(), 326 * 0.15e-3, 1e-6);
  EXPECT_NEAR(bed["column_number"].get<double>(), 40 / 16.3, 0.05);
  EXPECT_EQ(fit["temperature_over_mg"]["unit"], "m");
}

// An Enskog-like decay with 40 rows; one of them, in the middle, has an error of 0.
std::string profile_with_one_zero_error(const char* zero) {
  std::string text = "# kernel: gaussian:0.5\n# column_number: 10\nheight,number_density,std_error\n";
  for (int i = 0; i < 40; ++i) {
    const double z = 0.5 + 0.4 * i, density = 1.1 / (1 + std::exp((z - 9) / 1.2)) * (1 + 0.01 * std::sin(7 * i));
    text += std::to_string(z) + "," + std::to_string(density) + "," +
            (i == 20 ? zero : std::to_string(0.002 + 0.0005 * i)) + "\n";
  }
  return text;
}

TEST_F(OneFact, OneRowWithoutAnErrorIsTreatedAlikeByFitAndFitProfile) {
  std::string first;
  for (const char* zero : {"0", ""}) {
    write_text(folder_ / "p.csv", profile_with_one_zero_error(zero));
    const ProgramResult direct = run_shakebed({"fit-profile", "p.csv", "--json"}, folder_.path());
    ASSERT_EQ(direct.exit_code, 0) << direct.err;
    const ProgramResult staged = run(R"({ "name": "t", "stages": [ { "stage": "fit", "profile": "p.csv" } ] })");
    ASSERT_EQ(staged.exit_code, 0) << staged.err;
    const Json one = Json::parse(direct.out), other = result("o/fit/fit.json");
    for (const char* key : {"temperature", "shift", "chi2_per_dof", "reduced_temperature", "kernel", "window"})
      EXPECT_EQ(one[key].dump(), other[key].dump()) << key << " to the last digit";
    EXPECT_THAT(staged.err, HasSubstr("p.csv: 1 of 40 rows have no standard error or one of 0 (line 24)"));
    EXPECT_THAT(one["warnings"].dump(), HasSubstr("(line 24)"));
    if (first.empty()) first = one["temperature"].dump();
    EXPECT_EQ(one["temperature"].dump(), first) << "an empty cell and a 0 mean the same";
  }
  // The row takes its neighbour's error (of the two, the larger one: line 25), so writing it there changes nothing.
  write_text(folder_ / "p.csv", profile_with_one_zero_error("0.012500"));
  const Json written = Json::parse(run_shakebed({"fit-profile", "p.csv", "--json"}, folder_.path()).out);
  EXPECT_EQ(written["temperature"].dump(), first);
}

TEST_F(OneFact, AKernelThatAnOptionNamesNeedNotBeInTheFile) {
  std::string text = profile_with_one_zero_error("0.01");
  text.erase(0, text.find('\n') + 1);  // the line that names it
  write_text(folder_ / "p.csv", text);
  const std::string asks = "does not state through which kernel";
  const Json silent = Json::parse(run_shakebed({"fit-profile", "p.csv", "--json"}, folder_.path()).out);
  EXPECT_THAT(silent["warnings"].dump(), HasSubstr(asks));
  EXPECT_EQ(silent["kernel"]["kind"], "none");
  const Json named =
      Json::parse(run_shakebed({"fit-profile", "p.csv", "--kernel", "gaussian:0.5", "--json"}, folder_.path()).out);
  EXPECT_THAT(named["warnings"].dump(), testing::Not(HasSubstr(asks)));
  EXPECT_EQ(named["kernel"]["kind"], "gaussian");
  const ProgramResult staged = run(R"({ "name": "t", "stages": [
    { "stage": "fit", "profile": "p.csv", "kernel": { "kind": "gaussian", "width": 0.5 } } ] })");
  ASSERT_EQ(staged.exit_code, 0) << staged.err;
  EXPECT_THAT(staged.err, testing::Not(HasSubstr(asks)));
  EXPECT_EQ(result("o/fit/fit.json")["temperature"].dump(), named["temperature"].dump());
}

TEST_F(OneFact, AKernelHasOneSpellingInOptionsAndFiles) {
  for (const std::string kind : {"gaussian", "top_hat", "disk_chord"}) {
    std::string recipe = photographed_bed(R"(, "kernel": { "kind": ")" + kind + R"(", "width": 0.8 })");
    const std::string measure = R"("measure": "1 s",)";
    recipe.replace(recipe.find(measure), measure.size(),
                   measure + R"( "profile": { "kernel": { "kind": ")" + kind + R"(", "width": 0.8 } },)");
    const ProgramResult ran = run(recipe, {"run", "r.json", "--out", kind});
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    for (const char* file : {"/bed/profile.csv-metadata.json", "/extract/profile.csv-metadata.json"}) {
      const Json kernel = result(kind + file)["notes"][0]["kernel"];
      EXPECT_EQ(kernel["kind"], kind) << file;
      EXPECT_EQ(kernel["width"], 0.8) << file;
    }
    EXPECT_EQ(result(kind + "/fit/fit.json")["kernel"]["kind"], kind);
    EXPECT_EQ(result(kind + "/extract/extract.json")["kernel"]["kind"], kind);
  }
  const ProgramResult wrong =
      run_shakebed({"fit-profile", "gaussian/bed/profile.csv", "--kernel", "top-hat:1"}, folder_.path());
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("top_hat:1"));
}

TEST_F(OneFact, EveryTableBeginsWithItsHeaderAndDescribesItsColumns) {
  std::string recipe = photographed_bed("", "", R"(, { "stage": "map", "from": "fit" })");
  const std::string measure = R"("measure": "1 s",)";
  recipe.replace(recipe.find(measure), measure.size(),
                 measure + R"( "observe": ["order", "velocities", "displacement", "pressure", "phases"],)");
  const std::string one = R"("replicas": 1,)";
  recipe.replace(recipe.find(one), one.size(), R"("replicas": 2,)");
  const ProgramResult ran = run(recipe);
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  std::size_t tables = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_ / "o")) {
    if (entry.path().extension() != ".csv") continue;
    ++tables;
    const std::string text = read_text(entry.path()), name = entry.path().filename().string();
    const auto header = shakebed::pipelines::split_csv_line(text.substr(0, text.find('\n')));
    const Json metadata = Json::parse(read_text(entry.path().string() + "-metadata.json"));
    EXPECT_EQ(metadata["url"], name);
    const Json& columns = metadata["tableSchema"]["columns"];
    ASSERT_EQ(columns.size(), header.size()) << name;
    EXPECT_EQ(text.find('#'), std::string::npos) << name << ": a table holds no comments";
    for (std::size_t i = 0; i < header.size(); ++i) {
      EXPECT_EQ(columns[i]["name"], header[i]) << name;
      EXPECT_FALSE(columns[i]["dc:description"].get<std::string>().empty()) << name << " " << header[i];
    }
    shakebed::pipelines::each_csv_line(text, [&](const std::vector<std::string>& cells, std::size_t line) {
      if (line == 1) return;
      ASSERT_EQ(cells.size(), header.size()) << name << ":" << line;
      for (std::size_t i = 0; i < cells.size(); ++i) {
        const bool number = columns[i]["datatype"] == "number" && !cells[i].empty();
        EXPECT_TRUE(!number || shakebed::pipelines::number_in(cells[i])) << name << ":" << line << ": " << cells[i];
      }
    });
  }
  EXPECT_GE(tables, 24U);
}

}  // namespace
