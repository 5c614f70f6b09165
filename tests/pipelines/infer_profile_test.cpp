// A measured profile as the target of an inference, errors that include the scatter of beds, and beds of an earlier
// run.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"
#include "tests/pipelines/written_out.hpp"

namespace shakebed::tests::infer_profile {
namespace {

using pipelines::Json;

// The bed of infer_recipe with Gamma = 4.5 and e = 0.8, measured by the simulate stage; then an inference of the two.
Json recipe() {
  Json infer = Json::parse(infer_recipe)["stages"][0];
  const Json material{{"restitution", 0.8}};
  Json bed{{"stage", "simulate"}, {"id", "bed"},  {"units", "reduced"}, {"seed", 3},
           {"replicas", 1},       {"settle", 20}, {"measure", 200}};
  for (const char* key : {"disks", "box", "floor"}) bed[key] = infer[key];
  bed["disks"].update(material), bed["floor"].update(material), bed["box"]["sides"].update(material);
  bed["floor"]["gamma"] = 4.5;
  infer["from"] = "bed";
  infer["targets"] = Json{{"profile", {{"from", "bed"}, {"low", 0.5}, {"high", 7.5}}}};
  for (const char* key : {"moments", "average", "calibration"}) infer.erase(key);
  infer["rounds"] = 0, infer["measure"] = 30;
  return Json{{"name", "t"}, {"stages", {bed, infer}}};
}

class InferProfile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new ScratchFolder;
    const ProgramResult ran = run(recipe(), "o");
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
  }
  static void TearDownTestSuite() { delete folder_; }
  static ProgramResult run(const Json& json, const std::string& out) {
    write_text(*folder_ / (out + ".json"), json.dump());
    return run_shakebed({"run", out + ".json", "--out", out, "--quiet"}, folder_->path());
  }
  static Json result(const std::string& out) { return Json::parse(read_text(*folder_ / (out + "/search/infer.json"))); }
  // The same beds with another target.
  static Json again(const Json& targets) {
    Json json = recipe();
    json["stages"][1]["targets"] = targets;
    json["stages"][1]["beds"] = "o/search/beds.json";
    json["stages"][1]["best"] = 0;
    return json;
  }
  static ScratchFolder* folder_;
};
ScratchFolder* InferProfile::folder_ = nullptr;

TEST_F(InferProfile, IsComparedHeightByHeight) {
  const NumberTable compared(*folder_ / "o/search/profile.csv"), bed(*folder_ / "o/bed/profile.csv");
  ASSERT_EQ(compared.rows(), 8U);
  double chi2 = 0;
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_DOUBLE_EQ(compared("height", i), 0.5 + static_cast<double>(i));
    std::size_t row = 0;
    while (std::abs(bed("height", row) - compared("height", i)) > 1e-9) ++row;  // the bed's rows are 0.25 D apart
    EXPECT_NEAR(compared("measured", i), bed("number_density", row), 1e-9);
    EXPECT_NEAR(compared("measured_error", i), bed("std_error", row), 1e-9);
    EXPECT_GT(compared("predicted_error", i), 0);
    chi2 += std::pow((compared("predicted", i) - compared("measured", i)) /
                         std::max(compared("predicted_error", i), compared("measured_error", i)),
                     2);
  }
  EXPECT_LT(chi2, 30) << "eight heights, correlated";
  const Json found = result("o");
  EXPECT_EQ(found["agreement"]["numbers"], 8);
  EXPECT_EQ(found["best"][0]["targets"]["profile"]["heights"], 8);
  EXPECT_EQ(found["best"][0]["targets"]["profile"]["largest_difference_in_errors"],
            found["best"][0]["largest_difference_in_errors"]);
}

TEST_F(InferProfile, TellsTheParametersOfItsBed) {
  const Json parameters = result("o")["parameters"];
  for (const auto& [name, truth] : {std::pair{"gamma", 4.5}, {"restitution", 0.8}}) {
    EXPECT_LT(parameters[name]["low_95"], truth) << name;
    EXPECT_GT(parameters[name]["high_95"], truth) << name;
    EXPECT_LT(parameters[name]["width_over_prior"], 0.8) << name;
  }
}

// chi2 of the scene as written is (difference)^2/variance of one target, and the variance without the target's error is
// given. An error e that includes the scatter s adds max(s^2, e^2) in place of s^2 + e^2.
TEST_F(InferProfile, CountsTheScatterOfBedsOnce) {
  const auto variance = [&](double error, bool includes) {
    const std::string out = "v" + std::to_string(error) + (includes ? "i" : "e");
    const ProgramResult ran = run(
        again({{"center_of_mass_rise", {{"value", 9}, {"std_error", error}, {"includes_scatter", includes}}}}), out);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    const Json assumed = result(out)["assumed"];
    const double off = value(assumed["targets"]["center_of_mass_rise"]) - 9;
    return off * off / assumed["chi2"].get<double>();
  };
  const double alone = variance(0, false), large = 2;
  EXPECT_NEAR(variance(0, true), alone, 1e-9 * alone);
  EXPECT_NEAR(variance(large, false), alone + large * large, 1e-9);
  const double scatter = alone + large * large - variance(large, true);  // s^2
  EXPECT_GT(scatter, 0.02 * alone);
  EXPECT_LT(scatter, alone);
}

TEST_F(InferProfile, UsesTheBedsOfAnEarlierRun) {
  Json same = recipe();
  same["stages"][1]["beds"] = "o/search/beds.json";
  const ProgramResult ran = run(same, "same");
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  for (const char* file : {"beds.csv", "posterior.csv", "profile.csv"})
    EXPECT_EQ(read_text(*folder_ / "same/search" / file), read_text(*folder_ / "o/search" / file)) << file;
  same["stages"][1]["measure"] = 31;
  const ProgramResult other = run(same, "other");
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_NE(other.err.find("a different scene, different parameters or a different measurement"), std::string::npos)
      << other.err;
}

// resolved.json is a recipe: where one key takes the place of another, it has only the one that was used.
TEST_F(InferProfile, IsTheSameRecipeWithEveryOptionWrittenOut) {
  write_text(*folder_ / "mine.csv", "height,number_density,std_error\n0,0.9,0.01\n5,0.5,0.01\n6,0.3,0.01\n");
  const Json range{{"low", 0.5}, {"high", 5.5}};
  Json from = range, file = range;
  from["from"] = "bed", file["file"] = "mine.csv";
  for (const Json& targets : {Json{{"profile", from}}, Json{{"profile", file}},
                              Json{{"center_of_mass_rise", {{"value", 9}, {"std_error", 0.1}}}},
                              Json{{"center_of_mass_rise", {{"at", "/bed/center_of_mass_rise"}}}}}) {
    Json json = again(targets);
    json["stages"][1].erase("beds");  // of another measurement
    const std::string once = written_out(json.dump(), folder_->path());
    EXPECT_EQ(written_out(once, folder_->path()), once);
  }
}

TEST_F(InferProfile, RefusesProfilesThatCannotBeCompared) {
  const auto refused = [&](const Json& profile, int code, const std::string& words) {
    const ProgramResult ran = run(again({{"profile", profile}}), "wrong");
    EXPECT_EQ(ran.exit_code, code) << ran.err;
    EXPECT_NE(ran.err.find(words), std::string::npos) << ran.err;
  };
  const auto at = [](const char* key, const Json& source, double high) {
    return Json{{key, source}, {"low", 0.5}, {"high", high}};
  };
  refused(at("from", "nobody", 7.5), 3, "there is no stage \"nobody\"");
  refused(Json{{"low", 0.5}, {"high", 7.5}}, 3, "either \"from\" or \"file\"");
  refused(at("from", "bed", 0.1), 3, "must be below");
  write_text(*folder_ / "own.csv", "height,number_density\n0,0.9\n5,0.5\n10,0.01\n");
  refused(at("file", "own.csv", 7.5), 4, "no standard errors");
  write_text(*folder_ / "own.csv",
             "# kernel: top_hat:1\nheight,number_density,std_error\n0,0.9,0.01\n5,0.5,0.01\n6,0.3,0.01\n");
  refused(at("file", "own.csv", 7.5), 4, "through the kernel top_hat:1");
  write_text(*folder_ / "own.csv",
             "# kernel: gaussian:0.5\nheight,number_density,std_error\n1,0.9,0.01\n5,0.5,0.01\n6,0.3,0.01\n");
  refused(at("file", "own.csv", 7.5), 4, "heights from 1 to 6 D, but a density at 0.5 D");
}

}  // namespace
}  // namespace shakebed::tests::infer_profile
