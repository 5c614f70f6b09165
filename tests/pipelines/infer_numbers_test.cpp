// The numbers of the infer stage, done again from its tables.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "tests/pipelines/infer_recipe.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;

struct Found {
  ScratchFolder folder;
  Json result;
  Found() {
    write_text(folder / "r.json", infer_recipe);
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    result = Json::parse(read_text(folder / "o/search/infer.json"));
  }
  NumberTable table(const std::string& name) const { return NumberTable(folder / ("o/search/" + name)); }
};
const Found& found() {
  static const Found once;
  return once;
}

// A quantity, or a plain number in reduced units.
double number(const Json& json) { return json.is_number() ? json.get<double>() : value(json); }

// The same bed by the simulate stage: what the design's first bed gives, bed by bed.
TEST(InferNumbers, BedsAreThoseOfTheSimulation) {
  const NumberTable design = found().table("beds.csv");
  ASSERT_EQ(design.rows(), 30U * 3);
  EXPECT_EQ(found().result["beds"], 30);
  const auto first = Json::parse(read_text(found().folder / "o/search/beds.json"))["beds"][0];
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_EQ(design("bed", r), 1);
    EXPECT_EQ(design("round", r), 0);
    EXPECT_EQ(design("gamma", r), first["values"][0].get<double>());
    EXPECT_EQ(design("restitution", r), first["values"][1].get<double>());
  }
  EXPECT_EQ(design("round", 89), 1);
  EXPECT_EQ(design.text("photographs", 0), "average");
  // The simulate stage with the seed of the design's first bed: the same motion, looked at 32 times a period instead
  // of 8.
  write_text(found().folder / "s.json",
             R"({ "name": "s", "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced", "seed": )" +
                 std::to_string(shakebed::pipelines::replica_seed(1, 1)) + R"(, "replicas": 1,
    "disks": { "count": 40, "inertia": "sphere", "restitution": )" +
                 first["values"][1].dump() + R"(, "friction": 0.3 },
    "box": { "width": 8.3, "sides": { "kind": "hard", "restitution": )" +
                 first["values"][1].dump() + R"( }, "lid": "open" },
    "floor": { "motion": "sinusoidal", "gamma": )" +
                 first["values"][0].dump() + R"(, "frequency": 0.35, "restitution": )" + first["values"][1].dump() +
                 R"(, "friction": 0.3 },
    "settle": 10, "measure": 30, "profile": { "spacing": 0.25, "kernel": { "kind": "gaussian", "width": 0.5 } } },
    { "stage": "fit", "from": "bed", "plateau_density": 1.10 } ] })");
  ASSERT_EQ(run_shakebed({"run", "s.json", "--out", "s", "--quiet"}, found().folder.path()).exit_code, 0);
  const Json bed = Json::parse(read_text(found().folder / "s/bed/observables.json"));
  EXPECT_NEAR(design("temperature_x_over_mg", 0) / number(bed["temperature_x_over_mg"]), 1, 0.08);
  EXPECT_NEAR(design("temperature_z_over_mg", 0) / number(bed["temperature_z_over_mg"]), 1, 0.08);
  EXPECT_NEAR(design("temperature_z_local_over_mg", 0) / number(bed["temperature_z_local_over_mg"]), 1, 0.08);
  for (const std::string name : {"temperature_x_without_flow_over_mg", "temperature_z_without_flow_over_mg"})
    EXPECT_NEAR(design(name, 0) / number(bed[name]), 1, 0.08) << name;
  EXPECT_NEAR(design("center_of_mass_rise", 0), number(bed["center_of_mass_rise"]), 0.05);
  const Json fit = Json::parse(read_text(found().folder / "s/fit/fit.json"));
  EXPECT_NEAR(design("temperature_over_mg", 0) / number(fit["temperature"]), 1, 0.1);
  // The shift moves with the temperature, and looks at other moments change both.
  EXPECT_NEAR(design("shift", 0), number(fit["shift"]), fit["shift"]["std_error"].get<double>() / 2);
  EXPECT_NEAR(design("solid_height_by_sum_rule", 0), number(fit["solid_height_by_sum_rule"]), 0.5);
  const NumberTable profile(found().folder / "s/bed/profile.csv");
  double greatest = 0;
  for (std::size_t r = 0; r < profile.rows(); ++r) greatest = std::max(greatest, profile("number_density", r));
  EXPECT_NEAR(design("density", 0), greatest, 0.05);
}

TEST(InferNumbers, PosteriorsAreThatOfTheirDraws) {
  const Json& inferred = found().result;
  const NumberTable draws = found().table("posterior.csv"), marginals = found().table("marginals.csv");
  ASSERT_EQ(draws.rows(), 400U);
  EXPECT_GT(inferred["effective_samples"].get<double>(), 400);
  for (const char* name : {"gamma", "restitution"}) {
    double sum = 0, squares = 0, area = 0, mean_by_bins = 0;
    for (std::size_t r = 0; r < 400; ++r) sum += draws(name, r);
    for (std::size_t r = 0; r < 400; ++r) squares += std::pow(draws(name, r) - sum / 400, 2);
    const Json& own = inferred["parameters"][name];
    const double deviation = std::sqrt(squares / 399);
    EXPECT_NEAR(value(own), sum / 400, 4 * deviation / 20);
    EXPECT_NEAR(error(own), deviation, 0.2 * deviation);
    const double low = own["prior_low"], high = own["prior_high"], bin = (high - low) / 24;
    for (std::size_t r = 0; r < marginals.rows(); ++r) {
      if (marginals.text("parameter", r) != name) continue;
      area += marginals("density", r) * bin, mean_by_bins += marginals("density", r) * bin * marginals("value", r);
    }
    EXPECT_NEAR(area, 1, 1e-9);
    EXPECT_NEAR(mean_by_bins, value(own), bin / 2);
    EXPECT_LE(own["low_95"], own["low_68"]);
    EXPECT_LE(own["low_68"], own["median"]);
    EXPECT_LE(own["median"], own["high_68"]);
    EXPECT_LE(own["high_68"], own["high_95"]);
    EXPECT_NEAR(own["width_over_prior"].get<double>(), error(own) * std::sqrt(12) / (high - low), 0.01);
  }
  double prior = 0, posterior = 0;
  for (const Json& view : inferred["photographs"])
    prior += view["prior"].get<double>(), posterior += view["posterior"].get<double>();
  EXPECT_NEAR(prior, 1, 1e-12);
  EXPECT_NEAR(posterior, 1, 1e-9);
  EXPECT_NEAR(inferred["photographs"][0]["prior"].get<double>(), 0.8, 1e-12);
  EXPECT_GT(inferred["log_evidence"]["std_error"].get<double>(), 0);
  EXPECT_LT(inferred["log_evidence"]["std_error"].get<double>(), 0.1);
  EXPECT_TRUE(std::isfinite(value(inferred["log_evidence"])));
}

TEST(InferNumbers, AgreementIsThatOfTheNearestBed) {
  const Json& agreement = found().result["agreement"];
  const NumberTable draws = found().table("posterior.csv");
  double least = INFINITY, chances = 0;
  for (std::size_t r = 0; r < draws.rows(); ++r) {
    least = std::min(least, draws("chi2", r));
    chances += std::exp(-draws("chi2", r) / 2) / 400;  // of two degrees of freedom
  }
  EXPECT_EQ(agreement["numbers"], 2);
  EXPECT_LE(agreement["least_chi2"].get<double>(), least);
  EXPECT_NEAR(agreement["chance"].get<double>(), std::exp(-agreement["least_chi2"].get<double>() / 2), 1e-12);
  EXPECT_NEAR(agreement["predictive_p"].get<double>(), chances, 0.06);
  EXPECT_NEAR(std::erfc(agreement["deviations"].get<double>() / std::sqrt(2)), agreement["chance"].get<double>(), 1e-9);
  EXPECT_EQ(agreement["some_bed_agrees"], agreement["deviations"].get<double>() < 3);
}

TEST(InferNumbers, BestBedsAreTheMeansOfTheirRuns) {
  const Json& best = found().result["best"][0];
  const NumberTable runs = found().table("best.csv");
  ASSERT_EQ(runs.rows(), 3U);
  double logarithms = 0, rise = 0, log_squares = 0, rise_squares = 0, most = 0;
  for (std::size_t r = 0; r < 3; ++r) {
    EXPECT_EQ(runs("bed", r), 1);
    EXPECT_EQ(runs("replica", r), static_cast<double>(r));
    EXPECT_EQ(runs("gamma", r), best["values"]["gamma"].get<double>());
    logarithms += std::log(runs("temperature_over_mg", r)) / 3, rise += runs("center_of_mass_rise", r) / 3;
  }
  for (std::size_t r = 0; r < 3; ++r) {
    log_squares += std::pow(std::log(runs("temperature_over_mg", r)) - logarithms, 2);
    rise_squares += std::pow(runs("center_of_mass_rise", r) - rise, 2);
  }
  const Json &t = best["targets"]["temperature_over_mg"], &z = best["targets"]["center_of_mass_rise"];
  EXPECT_NEAR(value(t), std::exp(logarithms), 1e-9);
  EXPECT_NEAR(error(t), std::exp(logarithms) * std::sqrt(log_squares / 2), 1e-9);
  EXPECT_NEAR(value(z), rise, 1e-9);
  EXPECT_NEAR(error(z), std::sqrt(rise_squares / 2), 1e-9);
  const double off_t = (logarithms - std::log(0.35)) / std::hypot(std::sqrt(log_squares / 2), 0.01 / 0.35);
  const double off_z = (rise - 1.5) / std::hypot(std::sqrt(rise_squares / 2), 0.05);
  EXPECT_NEAR(t["difference_in_errors"].get<double>(), off_t, 1e-9);
  EXPECT_NEAR(z["difference_in_errors"].get<double>(), off_z, 1e-9);
  most = std::max(std::abs(off_t), std::abs(off_z));
  EXPECT_NEAR(best["largest_difference_in_errors"].get<double>(), most, 1e-9);
  EXPECT_EQ(found().result["agreement"]["beds_run_again_that_agree"], most < 3 ? 1 : 0) << "of one bed";
  EXPECT_NEAR(t["measured"].get<double>(), 0.35, 1e-12);
  EXPECT_NEAR(t["measured_error"].get<double>(), 0.01, 1e-12);
}

TEST(InferNumbers, TheSceneAsWrittenIsPredicted) {
  const Json& assumed = found().result["assumed"];
  EXPECT_EQ(assumed["values"]["gamma"], 4);
  EXPECT_EQ(assumed["values"]["restitution"], 0.7);
  EXPECT_GT(assumed["chi2"].get<double>(), 0);
  EXPECT_NEAR(std::erfc(assumed["deviations"].get<double>() / std::sqrt(2)),
              std::exp(-assumed["chi2"].get<double>() / 2), 1e-9);
}

TEST(InferNumbers, SurrogateNarrowingAndCalibrationAreShares) {
  const Json& inferred = found().result;
  double last = 2;
  for (const Json& row : inferred["narrowing"]) {
    const double reduction = row["reduction"];
    EXPECT_GE(reduction, 0);
    EXPECT_LE(reduction, last) << "the best first";
    last = reduction;
  }
  for (const auto& [name, row] : inferred["surrogate"].items()) {
    EXPECT_GE(row["beds"], 24) << name;
    EXPECT_GT(row["scatter"].get<double>(), 0) << name;
    EXPECT_NEAR(row["within_1"].get<double>(), 0.68, 0.3) << name;
    EXPECT_GT(row["within_2"].get<double>(), 0.8) << name;
  }
  const NumberTable rows = found().table("calibration.csv");
  double n = 0, in_68 = 0, in_95 = 0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    n += 1;
    in_68 += rows("low_68", r) <= rows("truth", r) && rows("truth", r) <= rows("high_68", r);
    in_95 += rows("low_95", r) <= rows("truth", r) && rows("truth", r) <= rows("high_95", r);
    EXPECT_EQ(rows("rank", r) > 0.16 && rows("rank", r) < 0.84,
              rows("low_68", r) < rows("truth", r) && rows("truth", r) < rows("high_68", r));
  }
  EXPECT_EQ(inferred["calibration"]["beds"].get<double>() * 2, n);
  EXPECT_NEAR(inferred["calibration"]["within_68"].get<double>(), in_68 / n, 1e-12);
  EXPECT_NEAR(inferred["calibration"]["within_95"].get<double>(), in_95 / n, 1e-12);
}

// Whether ranks are evenly spread: chi2 of their counts in tenths, and its chance with 9 degrees of freedom in closed
// form, erfc(sqrt(chi2/2)) and four more terms.
TEST(InferNumbers, CalibrationSaysHowEvenlyItsRanksAreSpread) {
  const NumberTable rows = found().table("calibration.csv");
  for (const auto& [name, of_parameter] : found().result["calibration"]["parameters"].items()) {
    double tenths[10] = {}, n = 0;
    for (std::size_t r = 0; r < rows.rows(); ++r) {
      if (rows.text("parameter", r) != name) continue;
      n += 1;
      tenths[std::min(9, static_cast<int>(10 * rows("rank", r)))] += 1;
    }
    ASSERT_GT(n, 0);
    double chi2 = 0, term = std::sqrt(2 / M_PI), chance = 0;
    for (const double count : tenths) chi2 += (count - n / 10) * (count - n / 10) / (n / 10);
    term *= std::exp(-chi2 / 2) * std::sqrt(chi2);
    for (int k = 1; k <= 7; k += 2) {
      chance += term;
      term *= chi2 / (k + 2);
    }
    EXPECT_NEAR(of_parameter["rank_chi2_p"].get<double>(), chance + std::erfc(std::sqrt(chi2 / 2)), 1e-9) << name;
  }
}

// Bars of a 24th of each range: 3 to 6 and 0.5 to 0.9.
TEST(InferNumbers, PairsHaveTheirBarsAndDraws) {
  const std::string script = read_text(found().folder / "o/search/pairs.gp");
  const auto numbers_behind = [&](const std::string& words, std::size_t from) {
    const std::size_t at = script.find(words, from);
    EXPECT_NE(at, std::string::npos) << words;
    return at + words.size();
  };
  std::size_t at = 0;
  for (const auto& [low, high] : {std::pair{3.0, 6.0}, {0.5, 0.9}}) {
    at = numbers_behind("index 0 using (", at);
    EXPECT_DOUBLE_EQ(std::stod(script.substr(at)), low);
    at = numbers_behind("+", at);
    EXPECT_DOUBLE_EQ(std::stod(script.substr(at)), (high - low) / 24);
  }
}

}  // namespace
