// What an inference writes of a posterior of five points: every number of infer.json and every cell of its tables.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "pipelines/stages/infer.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::inference_by_hand {
namespace {

using namespace shakebed::pipelines;
using testing::HasSubstr;

// A frequency of 10 to 30 Hz and hard or periodic sides; the average and two moments; densities at two heights. Beds
// are a formula of the frequency's place x: at the moments the rise is 2 more and 2 less.
class InferenceByHand : public testing::Test {
 protected:
  InferenceByHand() : stage_(*find_stage("infer")) {
    UnknownParameter frequency, sides;
    frequency.set = {"/floor/frequency"}, frequency.unit = "Hz", frequency.why = "a shaker";
    frequency.low = 10, frequency.high = 30;
    sides.set = {"/box/sides"}, sides.values = Json::parse(R"(["hard", "periodic"])");
    options_.parameters = {{"frequency", frequency}, {"sides", sides}};
    options_.bed.views = views_of(2, 0.4, {});
    options_.bed.heights = {0.5, 1.5};
    options_.profile.emplace();
    options_.targets.resize(observables().size());
    options_.targets[rise_].emplace(), options_.targets[t_].emplace();
    std::vector<Problem> problems;
    options_.bed.scene =
        *parse_json(R"({ "floor": { "frequency": "25 Hz" }, "box": { "sides": "periodic" } })", "s", problems);
    found_.targets = {{t_, std::log(0.002), 0.05, 0.05, 0},
                      {rise_, 5, 0.3, 0, 0.3},
                      {heights_, to_scale(heights_, 0.55), 0.02, 0, 0.02},
                      {heights_ + 1, to_scale(heights_, 0.24), 0.02, 0, 0.02}};
    for (std::size_t i = 0; i < 40; ++i) found_.beds.push_back(bed(i, 0));
    known_.all = known_.near = surrogate(0);
    known_.region = {{0, 0}, {1, 1}};
    // Frequencies 15.2, 20.2, 25.2 and 30 Hz, the last from beyond the end; the fifth point has no weight.
    found_.posterior.dimensions = 2;
    found_.posterior.points = {0.26, 0.25, 0.51, 0.75, 0.76, 0.75, 1.2, 0.25, 0.01, 0.25};
    found_.posterior.weight = {0.1, 0.4, 0.3, 0.2, 0};
    found_.posterior.log_likelihood = {-1, -2, -3, -4, -5};
    found_.posterior.effective = 3.25, found_.posterior.log_evidence = -7.5,
    found_.posterior.log_evidence_error = 0.125;
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t v = 0; v < 3; ++v) {
        found_.fit.log_likelihood.push_back(-1.0 - static_cast<double>(i));
        found_.fit.chi2.push_back(i == 4 ? 0.1 : 10 * static_cast<double>(v) + static_cast<double>(i) + 3);
      }
    found_.view_weight = {0.5, 0.375, 0.125};
  }
  // `more`: of the rise.
  RunBed bed(std::size_t i, double more) const {
    const double x = (static_cast<double>(i) + 0.5) / 40, scatter = i % 4 < 2 ? 0.01 : -0.01;
    RunBed out{i < 30 ? 0U : 1U, {10 + 20 * x, static_cast<double>(i % 2)}, {}};
    for (const double of_view : {0.0, 2.0, -2.0}) {
      for (std::size_t k = 0; k < observables().size(); ++k)
        out.numbers.push_back(k == rise_ ? 3 + 4 * x + scatter + of_view + more : std::exp(-6 + x + scatter));
      out.numbers.push_back(from_scale(heights_, 0.9 - 0.3 * x + scatter));
      out.numbers.push_back(from_scale(heights_, 0.4 + 0.2 * x + scatter));
    }
    return out;
  }
  std::shared_ptr<const BedSurrogate> surrogate(double more) const {
    std::vector<RunBed> beds;
    for (std::size_t i = 0; i < 40; ++i) beds.push_back(bed(i, more));
    return std::make_shared<const BedSurrogate>(options_, beds, found_.targets,
                                                BedSurrogate::Training{{{0, 0}, {1, 1}}, true, 1});
  }
  // A bed whose runs at the second moment have these temperatures and rises, and densities at the targets.
  BestBed best(const std::vector<double>& temperatures, const std::vector<double>& rises) const {
    BestBed out{{21.5, 1}, 2, {}};
    const std::size_t count = heights_ + 2;
    for (std::size_t r = 0; r < rises.size(); ++r) {
      std::vector<double>& run = out.runs.emplace_back(3 * count, 99.0);
      run[2 * count + t_] = temperatures[r], run[2 * count + rise_] = rises[r];
      run[2 * count + heights_] = 0.55, run[2 * count + heights_ + 1] = 0.24;
    }
    return out;
  }
  const Json& write() {
    class Stating : public LoneStage {
     public:
      explicit Stating(const InferOptions& options) : LoneStage(*find_stage("infer")) {
        state_inference(list_, options);
      }
      const ResultList& stated() const override { return list_; }

     private:
      ResultList list_;
    };
    written_ = std::make_unique<Stating>(options_);
    write_inference(*written_, options_, known_, found_);
    return json_ = read_json(written_->output("infer.json"));
  }
  NumberTable table(const std::string& name) const { return NumberTable(written_->output(name)); }

  const std::size_t rise_ = observable_number("center_of_mass_rise"), t_ = observable_number("temperature_over_mg"),
                    heights_ = observables().size();
  LoneStage stage_;
  InferOptions options_;
  KnownParameters known_;
  Inference found_;
  std::unique_ptr<LoneStage> written_;
  Json json_;
};

// Mean 23.16, quantiles half way through the weights: 15.2 at 0.05, 20.2 at 0.3, 25.2 at 0.65, 30 at 0.9. An even prior
// of 20 Hz deviates by 20/sqrt(12), one of two values by 1/2.
TEST_F(InferenceByHand, HasTheMomentsAndQuantilesOfItsPoints) {
  write();
  const Json& frequency = json_["parameters"]["frequency"];
  const double mean = 0.1 * 15.2 + 0.4 * 20.2 + 0.3 * 25.2 + 0.2 * 30;
  const double variance = 0.1 * std::pow(15.2 - mean, 2) + 0.4 * std::pow(20.2 - mean, 2) +
                          0.3 * std::pow(25.2 - mean, 2) + 0.2 * std::pow(30 - mean, 2);
  EXPECT_NEAR(value(frequency), mean, 1e-12);
  EXPECT_NEAR(error(frequency), std::sqrt(variance), 1e-12);
  EXPECT_EQ(frequency["unit"], "Hz");
  EXPECT_NEAR(frequency["median"].get<double>(), 20.2 + 5 * 0.2 / 0.35, 1e-12);
  EXPECT_NEAR(frequency["low_68"].get<double>(), 15.2 + 5 * 0.11 / 0.25, 1e-12);
  EXPECT_NEAR(frequency["high_68"].get<double>(), 25.2 + 4.8 * 0.19 / 0.25, 1e-12);
  EXPECT_EQ(frequency["low_95"], 15.2);
  EXPECT_EQ(frequency["high_95"], 30);
  EXPECT_EQ(frequency["prior_low"], 10);
  EXPECT_EQ(frequency["prior_high"], 30);
  EXPECT_EQ(frequency["why"], "a shaker");
  EXPECT_NEAR(frequency["width_over_prior"].get<double>(), std::sqrt(variance) / (20 / std::sqrt(12)), 1e-6);
  const Json& sides = json_["parameters"]["sides"];
  EXPECT_NEAR(value(sides), 0.7, 1e-12);
  EXPECT_NEAR(error(sides), std::sqrt(0.21), 1e-12);
  EXPECT_EQ(sides["unit"], "1");
  EXPECT_EQ(sides["prior_low"], 0);
  EXPECT_EQ(sides["prior_high"], 1);
  EXPECT_NEAR(sides["width_over_prior"].get<double>(), std::sqrt(0.21) / 0.5, 1e-9);
  EXPECT_EQ(json_["beds"], 40);
  EXPECT_EQ(json_["effective_samples"], 3.25);
  EXPECT_EQ(json_["log_evidence"], Json::parse(R"({ "value": -7.5, "std_error": 0.125, "unit": "1" })"));
  EXPECT_EQ(json_["photographs"][1]["show"], "0");
  EXPECT_NEAR(json_["photographs"][0]["prior"].get<double>(), 0.4, 1e-12);
  EXPECT_NEAR(json_["photographs"][2]["prior"].get<double>(), 0.3, 1e-12);
  EXPECT_EQ(json_["photographs"][2]["posterior"], 0.125);
}

// With four targets chi2 has the chance exp(-c/2) (1 + c/2). The least of the points with weight is 3, by the average.
// Views share each point by their priors, since they have the same likelihood.
TEST_F(InferenceByHand, AgreesAsItsNearestPointDoes) {
  write();
  const auto chance = [](double chi2) { return std::exp(-chi2 / 2) * (1 + chi2 / 2); };
  double predictive = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t v = 0; v < 3; ++v)
      predictive += found_.posterior.weight[i] * (v == 0 ? 0.4 : 0.3) *
                    chance(10 * static_cast<double>(v) + static_cast<double>(i) + 3);
  const Json& agreement = json_["agreement"];
  EXPECT_EQ(agreement["least_chi2"], 3);
  EXPECT_EQ(agreement["numbers"], 4);
  EXPECT_NEAR(agreement["chance"].get<double>(), chance(3), 1e-12);
  EXPECT_NEAR(agreement["predictive_p"].get<double>(), predictive, 1e-12);
  EXPECT_EQ(agreement["some_bed_agrees"], true);
  EXPECT_EQ(agreement["beds_run_again_that_agree"], 0);
  EXPECT_EQ(agreement["statement"],
            "According to the surrogate, some beds within these ranges agree with all 4 numbers: the nearest has chi2 "
            "= 3, p = 0.56 (chance of a larger chi2).");
  for (double& chi2 : found_.fit.chi2) chi2 += 37;
  write();
  const Json& apart = json_["agreement"];
  EXPECT_EQ(apart["least_chi2"], 40);
  EXPECT_EQ(apart["some_bed_agrees"], false);
  EXPECT_NEAR(std::erfc(apart["deviations"].get<double>() / std::sqrt(2)), chance(40), 1e-3 * chance(40));
  EXPECT_EQ(apart["statement"],
            "According to the surrogate, no bed within these ranges agrees with all 4 numbers: the nearest has chi2 = "
            "40, which is 5.5 standard deviations off.");
}

// Three standard deviations are the limit: 0.27 % of chance, chi2 = 16.25 with four numbers.
TEST_F(InferenceByHand, AgreesWithinThreeDeviations) {
  for (const auto& [chi2, agrees] : {std::pair(16.2, true), {16.3, false}}) {
    for (double& one : found_.fit.chi2) one = chi2;
    EXPECT_EQ(write()["agreement"]["some_bed_agrees"], agrees) << chi2;
  }
}

// Runs 4, 5, 9 of the rise: mean 6, deviation sqrt(7) of one run. Of the temperature the logarithms; equal runs have no
// scatter, and the target's own 0.05 counts. A second bed lacks a number.
TEST_F(InferenceByHand, HoldsItsBestBedsAgainstTheTargets) {
  found_.best = {best({0.002, 0.002, 0.002}, {4, 5, 9}), best({0.002, NAN, 0.002}, {5, 5, 5}),
                 best({0.002, 0.002, 0.002}, {4, 5, 9})};
  options_.best = 3;
  write();
  const Json& one = json_["best"][0];
  EXPECT_EQ(one["photographs"], "0.5");
  EXPECT_EQ(one["values"], Json::parse(R"({ "frequency": 21.5, "sides": 1.0 })"));
  const Json &rise = one["targets"]["center_of_mass_rise"], &t = one["targets"]["temperature_over_mg"];
  EXPECT_NEAR(value(rise), 6, 1e-12);
  EXPECT_NEAR(error(rise), std::sqrt(7), 1e-12);
  EXPECT_EQ(rise["unit"], "D");
  EXPECT_EQ(rise["measured"], 5);
  EXPECT_EQ(rise["measured_error"], 0.3);
  EXPECT_NEAR(rise["difference_in_errors"].get<double>(), 1 / std::sqrt(7.09), 1e-12);
  EXPECT_EQ(t["unit"], "m");
  EXPECT_NEAR(value(t), 0.002, 1e-15);
  EXPECT_NEAR(t["measured_error"].get<double>(), 0.0001, 1e-15);
  EXPECT_NEAR(t["difference_in_errors"].get<double>(), 0, 1e-9);
  EXPECT_EQ(one["targets"]["profile"]["heights"], 2);
  EXPECT_NEAR(one["targets"]["profile"]["largest_difference_in_errors"].get<double>(), 0, 1e-9);
  EXPECT_NEAR(one["largest_difference_in_errors"].get<double>(), 1 / std::sqrt(7.09), 1e-12);
  EXPECT_TRUE(json_["best"][1]["largest_difference_in_errors"].is_null());
  EXPECT_EQ(json_["agreement"]["beds_run_again_that_agree"], 2);
  EXPECT_THAT(json_["agreement"]["statement"].get<std::string>(),
              HasSubstr(" Of the 3 most probable beds, which were run again, 2 agree with every number within 3 "
                        "standard errors."));
  const NumberTable runs = table("best.csv");
  ASSERT_EQ(runs.rows(), 9U);
  EXPECT_EQ(runs("bed", 2), 1);
  EXPECT_EQ(runs("replica", 2), 2);
  EXPECT_EQ(runs("bed", 3), 2);
  EXPECT_EQ(runs.text("photographs", 2), "0.5");
  EXPECT_EQ(runs("frequency_Hz", 2), 21.5);
  EXPECT_EQ(runs("center_of_mass_rise", 2), 9);
  EXPECT_EQ(runs("temperature_over_mg_m", 0), 0.002);
  EXPECT_EQ(runs("shift", 0), 99);
}

// The density of a bed far from the target is counted in its errors, whatever its sign.
TEST_F(InferenceByHand, CountsTheLargestDifferenceOfItsDensities) {
  found_.best = {best({0.002, 0.002}, {5, 5})};
  for (std::vector<double>& run : found_.best[0].runs)
    run[2 * (heights_ + 2) + heights_] = from_scale(heights_, to_scale(heights_, 0.55) - 0.05);
  write();
  const Json& one = json_["best"][0];
  EXPECT_NEAR(one["targets"]["profile"]["largest_difference_in_errors"].get<double>(), 2.5, 1e-9);
  EXPECT_NEAR(one["largest_difference_in_errors"].get<double>(), 2.5, 1e-9);
  EXPECT_FALSE(one["targets"].contains("density"));
}

// At 25 Hz, x = 0.75: the rise is 6. The surrogate near the posterior is asked where its region holds the scene.
TEST_F(InferenceByHand, PredictsTheSceneAsWritten) {
  known_.near = surrogate(1), known_.region = {{0.6, 0}, {1, 1}};
  const auto rise = [&] { return json_["assumed"]["targets"]["center_of_mass_rise"]; };
  write();
  EXPECT_EQ(json_["assumed"]["values"], Json::parse(R"({ "frequency": 25.0, "sides": 1.0 })"));
  EXPECT_NEAR(value(rise()), 7, 0.02);
  EXPECT_NEAR(rise()["difference_in_errors"].get<double>(), (value(rise()) - 5) / std::hypot(error(rise()), 0.3),
              1e-12);
  EXPECT_NEAR(json_["assumed"]["targets"]["profile"]["largest_difference_in_errors"].get<double>(),
              std::abs(0.675 - std::sqrt(0.56)) / std::hypot(0.01, 0.02), 0.6);
  const double chi2 = json_["assumed"]["chi2"], deviations = json_["assumed"]["deviations"];
  EXPECT_NEAR(std::erfc(deviations / std::sqrt(2)) / (std::exp(-chi2 / 2) * (1 + chi2 / 2)), 1, 1e-3);
  known_.region.low[0] = 0.8;
  write();
  EXPECT_NEAR(value(rise()), 6, 0.02) << "outside of the region: by the surrogate of all beds";
  options_.bed.scene.find("floor")->find("frequency")->text = "31 Hz";
  EXPECT_TRUE(write()["assumed"].is_null()) << "outside of the prior";
}

// To know the sides would take cov^2/(var var) of the frequency's variance away; the best measurement comes first.
TEST_F(InferenceByHand, SaysWhatAFurtherMeasurementWouldTell) {
  write();
  const double mean = 0.1 * 15.2 + 0.4 * 20.2 + 0.3 * 25.2 + 0.2 * 30;
  const double variance = 0.1 * std::pow(15.2 - mean, 2) + 0.4 * std::pow(20.2 - mean, 2) +
                          0.3 * std::pow(25.2 - mean, 2) + 0.2 * std::pow(30 - mean, 2);
  const double covariance = 0.4 * 20.2 + 0.3 * 25.2 - 0.7 * mean, both = covariance * covariance / (variance * 0.21);
  double last = 1;
  std::size_t rows = 0;
  std::set<std::string> measured;  // of the parameters
  for (const Json& row : json_["narrowing"]) {
    EXPECT_LE(row["reduction"].get<double>(), last);
    last = row["reduction"], ++rows;
    if (row["measurement"] == "sides" || row["measurement"] == "frequency") {
      EXPECT_NEAR(row["reduction"].get<double>(), both, 1e-12);
      EXPECT_EQ(row["parameters"].size(), 1U);
      EXPECT_TRUE(row["parameters"].contains(row["measurement"] == "sides" ? "frequency" : "sides")) << "the other";
      measured.insert(row["measurement"].get<std::string>());
      EXPECT_EQ(row["meaning"], "the parameter itself; given is its effect on the other parameters");
    }
    if (row["measurement"] == "center_of_mass_rise") {  // a line of the frequency: 0.2 a Hz, scattered by 0.01
      const double seen = variance * 0.04 / (variance * 0.04 + 1e-4);
      EXPECT_NEAR(row["parameters"]["frequency"].get<double>(), seen, 0.01);
      EXPECT_NEAR(row["parameters"]["sides"].get<double>(), both * seen, 0.01);
      EXPECT_NEAR(row["reduction"].get<double>(), (seen + both * seen) / 2, 0.01);
    }
  }
  EXPECT_EQ(rows, observables().size() + 2);
  EXPECT_EQ(measured, (std::set<std::string>{"frequency", "sides"}));
  const Json& t = json_["surrogate"]["temperature_over_mg"];
  EXPECT_EQ(t["beds"], 40);
  EXPECT_EQ(t["scatter_is"], "relative");
  EXPECT_NEAR(t["scatter"].get<double>(), 0.01, 0.003);
  EXPECT_EQ(json_["surrogate"]["shift"]["scatter_is"], "in the number's unit");
}

// Two beds: the intervals of 68 % hold one of the frequencies and both sides, those of 95 % both. Ranks 0.05 and 1 lie
// in the first and the last tenth: chi2 = 2 (1 - 0.2)^2/0.2 + 8 x 0.2 = 8; two in one tenth have 18. Nine degrees of
// freedom: p = 0.53415 and 0.03517.
TEST_F(InferenceByHand, CountsItsCalibration) {
  options_.calibration = 2;
  found_.calibration = {{0, 0, 12, 11, 13, 10.5, 14, 0.05},
                        {0, 1, 1, 0, 1, 0, 1, 0.55},
                        {1, 0, 20, 21, 22, 19, 23, 1},
                        {1, 1, 0, 0, 1, 0, 1, 0.51}};
  write();
  const Json& calibration = json_["calibration"];
  EXPECT_EQ(calibration["beds"], 2);
  EXPECT_EQ(calibration["within_68"], 0.75);
  EXPECT_EQ(calibration["within_95"], 1);
  EXPECT_EQ(calibration["parameters"]["frequency"]["within_68"], 0.5);
  EXPECT_EQ(calibration["parameters"]["frequency"]["within_95"], 1);
  EXPECT_EQ(calibration["parameters"]["sides"]["within_68"], 1);
  EXPECT_NEAR(calibration["parameters"]["frequency"]["rank_chi2_p"].get<double>(), 0.5341462, 1e-6);
  EXPECT_NEAR(calibration["parameters"]["sides"]["rank_chi2_p"].get<double>(), 0.0351735, 1e-6);
  const NumberTable rows = table("calibration.csv");
  ASSERT_EQ(rows.rows(), 4U);
  EXPECT_EQ(rows("bed", 2), 1);
  EXPECT_EQ(rows.text("parameter", 2), "frequency");
  EXPECT_EQ(rows.text("parameter", 3), "sides");
  const double expected[] = {20, 21, 22, 19, 23, 1};
  const char* names[] = {"truth", "low_68", "high_68", "low_95", "high_95", "rank"};
  for (std::size_t k = 0; k < 6; ++k) EXPECT_EQ(rows(names[k], 2), expected[k]) << names[k];
}

// 24 bins of 20/24 Hz; of a choice one bin a value. Draws are points of the posterior, each with its view.
TEST_F(InferenceByHand, WritesMarginalsDrawsAndBeds) {
  found_.draws = {0, 3}, found_.draw_views = {1, 2};
  write();
  const NumberTable marginals = table("marginals.csv");
  ASSERT_EQ(marginals.rows(), 26U);
  for (std::size_t b = 0; b < 24; ++b) {
    EXPECT_EQ(marginals.text("parameter", b), "frequency");
    EXPECT_NEAR(marginals("value", b), 10 + (static_cast<double>(b) + 0.5) * 20 / 24, 1e-12);
    const double share = b == 6 ? 0.1 : b == 12 ? 0.4 : b == 18 ? 0.3 : b == 23 ? 0.2 : 0;
    EXPECT_NEAR(marginals("density", b), share * 1.2, 1e-12) << b;
  }
  EXPECT_EQ(marginals("value", 24), 0);
  EXPECT_NEAR(marginals("density", 24), 0.3, 1e-12);
  EXPECT_EQ(marginals("value", 25), 1);
  EXPECT_NEAR(marginals("density", 25), 0.7, 1e-12);
  const NumberTable draws = table("posterior.csv");
  ASSERT_EQ(draws.rows(), 2U);
  EXPECT_NEAR(draws("frequency_Hz", 0), 15.2, 1e-12);
  EXPECT_EQ(draws("frequency_Hz", 1), 30);
  EXPECT_EQ(draws("sides", 1), 0);
  EXPECT_EQ(draws.text("photographs", 0), "0");
  EXPECT_EQ(draws("chi2", 0), 13);
  EXPECT_EQ(draws("chi2", 1), 26);
  const NumberTable beds = table("beds.csv");
  ASSERT_EQ(beds.rows(), 120U);
  EXPECT_EQ(beds("bed", 0), 1);
  EXPECT_EQ(beds("bed", 119), 40);
  EXPECT_EQ(beds("round", 89), 0);
  EXPECT_EQ(beds("round", 90), 1);
  EXPECT_EQ(beds.text("photographs", 5), "0.5");
  EXPECT_EQ(beds("frequency_Hz", 3), 10.75);
  EXPECT_EQ(beds("sides", 3), 1);
  EXPECT_NEAR(beds("center_of_mass_rise", 4), 3 + 4 * 1.5 / 40 + 0.01 + 2, 1e-12);
  const StatedTable& stated = *written_->stated().find_table("beds.csv");
  EXPECT_EQ(stated.columns[3].unit, "Hz");
  EXPECT_EQ(stated.columns[4].meaning, "number of the value in its list, from 0");
  EXPECT_EQ(stated.columns[5].unit, "m");
}

// The draws lie at x = 0.26 and 1: roots 0.822 and 0.6, 0.452 and 0.6. Their scatter is that of one bed and of the
// draws.
TEST_F(InferenceByHand, PredictsDensitiesOfItsDraws) {
  found_.draws = {0, 3}, found_.draw_views = {1, 2};
  write();
  const NumberTable profile = table("profile.csv");
  ASSERT_EQ(profile.rows(), 2U);
  const double first[] = {0.822, 0.452}, measured[] = {0.55, 0.24};
  for (std::size_t i = 0; i < 2; ++i) {
    const double mean = (first[i] + 0.6) / 2, half = std::abs(first[i] - 0.6) / 2;
    EXPECT_EQ(profile("height", i), 0.5 + static_cast<double>(i));
    EXPECT_NEAR(profile("measured", i), measured[i], 1e-12);
    EXPECT_NEAR(profile("measured_error", i), 0.02 * 2 * std::sqrt(measured[i] + 0.01), 1e-12);
    EXPECT_NEAR(profile("predicted", i), mean * mean - 0.01, 0.006);
    EXPECT_NEAR(profile("predicted_error", i), std::hypot(half, 0.01) * 2 * mean, 0.006);
  }
  // Of one draw: the scatter of one bed alone.
  found_.draws = {3}, found_.draw_views = {2};
  write();
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(table("profile.csv")("predicted_error", i), 0.01 * 2 * 0.6, 0.004);
}

}  // namespace
}  // namespace shakebed::tests::inference_by_hand
