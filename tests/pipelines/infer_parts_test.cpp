// The parts of an inference by themselves: priors, scales, targets; a posterior from beds that are a formula.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pipelines/stages/infer.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::ElementsAre;
using testing::HasSubstr;

UnknownParameter range(double low, double high, bool logarithmic = false) {
  UnknownParameter out;
  out.set = {"/floor/gamma"};
  out.low = low, out.high = high, out.logarithmic = logarithmic;
  return out;
}

TEST(UnknownNumbers, HaveTheirPrior) {
  const UnknownParameter linear = range(2, 6), decades = range(1, 100, true);
  EXPECT_DOUBLE_EQ(linear.value(0.25), 3);
  EXPECT_DOUBLE_EQ(linear.place(3), 0.25);
  EXPECT_DOUBLE_EQ(linear.coordinate(5), 0.75);
  EXPECT_DOUBLE_EQ(decades.value(0.5), 10);
  EXPECT_DOUBLE_EQ(decades.place(1000), 1.5);
  EXPECT_DOUBLE_EQ(decades.coordinate(10), 0.5);
  // A normal prior of mean 4 and deviation 1 between 2 and 6: its middle is its mean; one deviation above lies the
  // share (Phi(1) - Phi(-2))/(Phi(2) - Phi(-2)) = 0.818595/0.954500.
  UnknownParameter normal = range(2, 6);
  normal.mean = 4, normal.std_error = 1;
  EXPECT_NEAR(normal.value(0.5), 4, 1e-9);
  EXPECT_NEAR(normal.place(5), 0.8185946 / 0.9544997, 1e-6);
  EXPECT_NEAR(normal.value(0.8185946 / 0.9544997), 5, 1e-5);
  EXPECT_EQ(normal.value(0), 2);
  EXPECT_EQ(normal.value(1), 6);
  EXPECT_DOUBLE_EQ(normal.coordinate(5), 0.75) << "beds change evenly with the value";
  UnknownParameter choice;
  choice.set = {"/box/sides"};
  choice.values = Json::parse(R"(["hard", "periodic", 3])");
  EXPECT_EQ(choice.value(0), 0);
  EXPECT_EQ(choice.value(0.34), 1);
  EXPECT_EQ(choice.value(1), 2);
  EXPECT_DOUBLE_EQ(choice.place(1), 0.5);
  EXPECT_DOUBLE_EQ(choice.coordinate(1), 0.5);
  EXPECT_EQ(choice.written(2), 3);
  EXPECT_EQ(linear.written(2.5), 2.5);
  UnknownParameter with_unit = range(2, 6);
  with_unit.unit = "mm";
  EXPECT_EQ(with_unit.written(2.5), "2.5 mm");
}

TEST(UnknownNumbers, AreFoundInTheSceneAsWritten) {
  std::vector<Problem> problems;
  const auto scene = parse_json(
      R"({ "floor": { "gamma": 4, "amplitude": "3 mm", "other": "3 s", "low": 1, "word": "x" }, "box": { "sides": "periodic" } })",
      "s", problems);
  const auto of = [&](const std::string& pointer, const std::string& unit) {
    UnknownParameter out = range(2, 6);
    out.set = {pointer}, out.unit = unit;
    return out.in_scene(*scene).value_or(-1);
  };
  EXPECT_EQ(of("/floor/gamma", ""), 4);
  EXPECT_NEAR(of("/floor/amplitude", "mm"), 3, 1e-12);
  EXPECT_EQ(of("/floor/amplitude", ""), -1);
  EXPECT_EQ(of("/floor/gamma", "mm"), -1);
  EXPECT_EQ(of("/floor/word", "mm"), -1);
  EXPECT_EQ(of("/floor/low", ""), -1) << "below the range";
  EXPECT_EQ(of("/floor/none", ""), -1);
  UnknownParameter choice;
  choice.set = {"/box/sides"};
  choice.values = Json::parse(R"(["hard", "periodic"])");
  EXPECT_EQ(choice.in_scene(*scene), 1);
  choice.values = Json::parse(R"(["hard", "sloped"])");
  EXPECT_FALSE(choice.in_scene(*scene));
}

TEST(UnknownNumbers, AreRefusedWithTheirReason) {
  const auto told = [](const std::string& text) {
    std::vector<Problem> problems;
    const auto node = parse_json(text, "p", problems);
    Fields fields = Fields::decode(*node, "", Fields::Source{.file = "p", .problems = &problems});
    UnknownParameter parameter;
    parameter.describe(fields);
    fields.finish();
    std::string all;
    for (const Problem& one : problems) all += one.pointer + ": " + one.what + "; ";
    return all;
  };
  EXPECT_EQ(told(R"({ "set": "/a", "low": 1, "high": 2 })"), "");
  EXPECT_EQ(told(R"({ "set": [], "low": 1, "high": 2 })"), "/set: a parameter needs a pointer into the scene; ");
  const std::string low = "/low: a parameter needs \"low\" below \"high\", or \"values\"; ";
  EXPECT_EQ(told(R"({ "set": "/a", "low": 2, "high": 2 })"), low);
  EXPECT_EQ(told(R"({ "set": "/a", "low": 2 })"), low);
  EXPECT_EQ(told(R"({ "set": "/a", "high": 2 })"), low);
  EXPECT_EQ(told(R"({ "set": "/a", "low": 0, "high": 2, "scale": "logarithmic" })"),
            "/low: a logarithmic scale needs \"low\" above 0; ");
  const std::string normal = "/mean: a normal prior needs both \"mean\" and \"std_error\", and a linear scale; ";
  EXPECT_EQ(told(R"({ "set": "/a", "low": 1, "high": 2, "mean": 1 })"), normal);
  EXPECT_EQ(told(R"({ "set": "/a", "low": 1, "high": 2, "std_error": 1 })"), normal);
  EXPECT_EQ(told(R"({ "set": "/a", "low": 1, "high": 2, "mean": 1, "std_error": 1, "scale": "logarithmic" })"), normal);
  EXPECT_EQ(told(R"({ "set": "/a", "low": 1, "high": 2, "mean": 1, "std_error": 1 })"), "");
  const std::string values =
      "/values: \"values\" needs two values or more, and excludes \"low\", \"high\" and \"mean\"; ";
  EXPECT_EQ(told(R"({ "set": "/a", "values": [1] })"), values);
  EXPECT_EQ(told(R"({ "set": "/a", "values": [1, 2], "low": 1 })"), values);
  EXPECT_EQ(told(R"({ "set": "/a", "values": [1, 2] })"), "");
}

TEST(ScalesOfNumbers, AreLogarithmsRootsOrThemselves) {
  const std::size_t t = observable_number("temperature_over_mg"), rise = observable_number("center_of_mass_rise"),
                    height = observables().size();
  EXPECT_EQ(observables()[rise].name, "center_of_mass_rise");
  EXPECT_DOUBLE_EQ(to_scale(t, 2), std::log(2));
  EXPECT_TRUE(std::isnan(to_scale(t, 0)));
  EXPECT_DOUBLE_EQ(from_scale(t, std::log(2)), 2);
  EXPECT_DOUBLE_EQ(slope_of_scale(t, 4), 0.25);
  EXPECT_EQ(to_scale(rise, -2), -2);
  EXPECT_EQ(from_scale(rise, -2), -2);
  EXPECT_EQ(slope_of_scale(rise, 4), 1);
  EXPECT_DOUBLE_EQ(to_scale(height, 0.63), 0.8);  // sqrt(n + 0.01)
  EXPECT_DOUBLE_EQ(to_scale(height, -1), 0.1);
  EXPECT_NEAR(from_scale(height, 0.8), 0.63, 1e-15);
  EXPECT_DOUBLE_EQ(slope_of_scale(height, 0.63), 0.625);
}

TEST(ViewsOfPhotographs, AreTheAverageAndMoments) {
  const auto of = [](std::uint32_t moments, std::optional<double> phase) {
    std::string out;
    for (const View& view : views_of(moments, 0.4, phase))
      out += view.name + " " + number_text(view.phase) + " " + number_text(view.prior) + "; ";
    return out;
  };
  EXPECT_EQ(of(0, {}), "average -1 1; ");
  EXPECT_EQ(of(2, {}), "average -1 0.4; 0 0 0.3; 0.5 0.5 0.3; ");
  EXPECT_EQ(of(2, 0.25), "average -1 0; 0.25 0.25 1; ");
}

TEST(RowsOfATable, AreJoinedByLines) {
  const std::vector<double> places{1, 2, 4}, values{10, 20, 0};
  for (const auto& [place, value] : {std::pair(0.0, 10.0), {1, 10}, {1.25, 12.5}, {2, 20}, {3, 10}, {4, 0}, {9, 0}})
    EXPECT_DOUBLE_EQ(value_at(places, values, place), value) << place;
}

TEST(Regions, HoldTheirPoints) {
  const Region region{{0.2, 0.5}, {0.6, 1}};
  EXPECT_DOUBLE_EQ(region.volume(), 0.2);
  EXPECT_THAT(region.place(std::vector<double>{0, 1, 0.5, 0.5}), ElementsAre(0.2, 1, 0.4, 0.75));
  for (const auto& [x, y, inside] : {std::tuple(0.2, 0.5, true),
                                     {0.6, 1.0, true},
                                     {0.19, 0.7, false},
                                     {0.61, 0.7, false},
                                     {0.3, 0.49, false},
                                     {0.3, 1.1, false}})
    EXPECT_EQ(region.holds(std::vector<double>{x, y}), inside) << x << " " << y;
}

TEST(ProfileAsTarget, HasItsHeights) {
  ProfileTarget target;
  target.low = 0.5, target.high = 2, target.spacing = 0.5;
  EXPECT_THAT(target.heights(), ElementsAre(0.5, 1, 1.5, 2));
  target.high = 1.99;
  EXPECT_THAT(target.heights(), ElementsAre(0.5, 1, 1.5));
  target.low = 0, target.high = 0.3, target.spacing = 0.1;  // 3 x 0.1 is above 0.3 by rounding
  EXPECT_EQ(target.heights().size(), 4U);
}

TEST(PartsOfARound, AreItsBedsOnce) {
  InferOptions options;
  options.first = 10, options.parts = 3;
  EXPECT_EQ(options.begin_of(1), 0U);
  EXPECT_EQ(options.begin_of(2), 3U);
  EXPECT_EQ(options.begin_of(3), 6U);
  EXPECT_EQ(options.begin_of(4), 10U);
}

// --- targets of stages and files

class TargetsOfStages : public testing::Test {
 protected:
  TargetsOfStages() : stage_(*find_stage("infer")) {
    options_.targets.resize(observables().size());
    options_.bed.kernel_width = 0.5;
    stage_.add_input("fit", *find_stage("fit"), "fit");
    stage_.add_input("film", *find_stage("extract"), "film");
  }
  InferTarget& target(const char* name) { return options_.targets[observable_number(name)].emplace(); }
  std::string refusal() {
    try {
      scaled_targets(stage_, options_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  LoneStage stage_;
  InferOptions options_;
};

TEST_F(TargetsOfStages, AreOnTheScaleOnWhichTheyAreCompared) {
  InferTarget& t = target("temperature_over_mg");
  t.value = 0.002, t.std_error = 0.0001;
  InferTarget& rise = target("center_of_mass_rise");
  rise.at = "/fit/rise", rise.std_error = 0.3, rise.includes_scatter = true;
  write_text(
      stage_.file("fit/fit.json"),
      R"({ "rise": { "value": 2.5, "std_error": 0.4 }, "none": { "value": null }, "bare": { "value": 1, "std_error": null } })");
  const std::vector<ScaledTarget> found = scaled_targets(stage_, options_);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].number, observable_number("temperature_over_mg"));
  EXPECT_DOUBLE_EQ(found[0].value, std::log(0.002));
  EXPECT_DOUBLE_EQ(found[0].error, 0.05);
  EXPECT_DOUBLE_EQ(found[0].further_error, 0.05);
  EXPECT_EQ(found[0].least_scatter, 0);
  EXPECT_EQ(found[1].value, 2.5);
  EXPECT_DOUBLE_EQ(found[1].least_scatter, 0.5) << "both errors in quadrature";
  EXPECT_EQ(found[1].further_error, 0);
  rise.at = "/fit/none";
  EXPECT_EQ(refusal(), "/fit/none: the result at this pointer is not a number, so it cannot be a target");
  rise.at = "/fit/bare";
  EXPECT_EQ(refusal(), "/fit/bare: this number has no standard error, so it cannot be a target");
  rise.at = "/fit/rise", t.value = 0;
  EXPECT_EQ(refusal(), "temperature_over_mg: the target must be above 0, but is 0");
}

// In m: those of the program's own T in m g D, or in D of a bed in reduced units, would be read as m.
TEST_F(TargetsOfStages, HaveTheUnitInWhichTheyAreCompared) {
  target("temperature_x_over_mg").at = "/fit/t";
  const auto in_unit = [&](const char* unit) {
    write_text(stage_.file("fit/fit.json"),
               std::string(R"({ "t": { "value": 0.2, "std_error": 0.01, "unit": ")") + unit + "\" } }");
    return refusal();
  };
  EXPECT_EQ(in_unit("m"), "");
  EXPECT_EQ(in_unit("m g D"),
            "/fit/t: this number is in m g D, but temperature_x_over_mg of the inference is in m. "
            "Point to a number in m");
  EXPECT_THAT(in_unit("D"), HasSubstr("this number is in D"));
  options_.bed.reduced = true;
  EXPECT_EQ(in_unit("D"), "");
  EXPECT_THAT(in_unit("m"), HasSubstr("is in D. Point to a number in D"));
}

// Every second frame of a film of 500 Hz.
TEST_F(TargetsOfStages, AreDisplacementsBetweenFramesAtTheSameRate) {
  target("temperature_x_without_flow_over_mg").at = "/film/velocities/temperature_x_of_displacements_over_mg";
  write_text(stage_.file("film/extract.json"), R"({ "velocities": { "frame_rate": { "value": 250, "unit": "Hz" },
      "temperature_x_of_displacements_over_mg": { "value": 0.001, "std_error": 0.0001 } } })");
  options_.bed.frame_rate = 500;
  EXPECT_THAT(refusal(),
              HasSubstr("these displacements are between frames at 250 Hz, but the beds of the inference are "
                        "seen at 500 Hz. Give \"frame_rate\": \"250 Hz\""));
  options_.bed.frame_rate = 250;
  EXPECT_EQ(refusal(), "");
}

// Densities 1, 0.6, 0 at heights 0, 1, 2. A scale that is 1 % too large changes a density by 0.01 (2 n + z dn/dz), a
// floor that is 0.05 D off by 0.05 dn/dz; at height 1 the slope from 0.9 to 1.1 is -0.5.
TEST_F(TargetsOfStages, HaveTheErrorsOfScaleAndFloor) {
  options_.bed.heights = {0.5, 1, 3};
  ProfileTarget& profile = options_.profile.emplace();
  profile.from = "film", profile.includes_scatter = false;
  write_text(stage_.file("film/profile.csv"),
             "# kernel: gaussian:0.5\nheight,number_density,std_error\n0,1,0.03\n1,0.6,0.04\n2,0,0.01\n");
  write_text(stage_.file("film/extract.json"),
             R"({ "scale": { "value": 0.0002, "std_error": 0.000002 }, "floor": { "std_error": 0.75 },
      "diameter": { "value": 0.003 } })");
  const std::vector<ScaledTarget> found = scaled_targets(stage_, options_);
  ASSERT_EQ(found.size(), 3U);
  const auto expected = [](double density, double statistical, double slope, double height) {
    const double place = std::hypot(0.01 * (2 * density + height * slope), 0.05 * slope);
    return std::hypot(statistical, place) * 0.5 / std::sqrt(density + 0.01);
  };
  EXPECT_DOUBLE_EQ(found[0].value, std::sqrt(0.81));
  EXPECT_NEAR(found[0].further_error, expected(0.8, 0.035, -0.4, 0.5), 1e-12);
  EXPECT_DOUBLE_EQ(found[1].value, std::sqrt(0.61));
  EXPECT_NEAR(found[1].further_error, expected(0.6, 0.04, -0.5, 1), 1e-12);
  EXPECT_DOUBLE_EQ(found[2].value, 0.1) << "above the table nothing was seen";
  EXPECT_NEAR(found[2].further_error, 0.01 * 5, 1e-12);
  EXPECT_EQ(found[2].number, observables().size() + 2);
  // The beds are measured as long as the film: their scatter is the film's.
  profile.includes_scatter = true, options_.bed.frame_rate = 100;
  const std::vector<ScaledTarget> filmed = scaled_targets(stage_, options_);
  EXPECT_EQ(filmed[0].least_scatter, 0);
  EXPECT_NEAR(filmed[0].further_error, std::hypot(0.01 * (1.6 - 0.2), 0.02) * 0.5 / 0.9, 1e-12);
  options_.bed.frame_rate.reset();
  EXPECT_NEAR(scaled_targets(stage_, options_)[0].least_scatter, expected(0.8, 0.035, -0.4, 0.5), 1e-12);
  options_.bed.heights = {-0.1};
  EXPECT_THAT(refusal(), HasSubstr("the profile has heights from 0 to 2 D, but a density at -0.1 D is to be compared"));
  write_text(stage_.file("film/profile.csv"), "height,number_density,std_error\n0,1,0.03\n2,0.011,0.01\n");
  options_.bed.heights = {2.1};
  EXPECT_THAT(refusal(), HasSubstr("but a density at 2.1 D is to be compared")) << "the table ends within the bed";
  write_text(stage_.file("film/profile.csv"),
             "# kernel: top_hat:0.5\nheight,number_density,std_error\n0,1,0.03\n2,0,0.01\n");
  EXPECT_THAT(refusal(), HasSubstr("measured through the kernel"));
  write_text(stage_.file("film/profile.csv"), "height,number_density\n0,1\n2,0\n");
  EXPECT_THAT(refusal(), HasSubstr("the profile has no standard errors"));
}

// --- a posterior

// Beds that are a formula: the rise is 3 + 4 x, scattered by +-0.1 in turn, x = 0.25 (value - 2). A target of 5 +- 0.3
// that is apart from the scatter tells x = 0.5 to 0.316/4.
class BedsOfAFormula : public testing::Test {
 protected:
  BedsOfAFormula() : stage_(*find_stage("infer")) {
    options_.parameters = {{"gamma", range(2, 6)}};
    options_.targets.resize(observables().size());
    options_.bed.views = views_of(0, 1, {});
    for (int i = 0; i < 60; ++i) {
      const double x = (i + 0.5) / 60, scatter = 0.1 * (i % 4 < 2 ? 1 : -1);
      RunBed bed{0, {2 + 4 * x}, std::vector<double>(observables().size(), NAN)};
      for (std::size_t k = 0; k < observables().size(); ++k)
        bed.numbers[k] = 1 + x + 0.01 * scatter * static_cast<double>(k % 3);
      bed.numbers[rise_] = 3 + 4 * x + scatter;
      beds_.push_back(std::move(bed));
    }
  }
  const std::size_t rise_ = observable_number("center_of_mass_rise");
  LoneStage stage_;
  InferOptions options_;
  std::vector<RunBed> beds_;
};

TEST_F(BedsOfAFormula, HaveThePosteriorOfALine) {
  const ScaledTarget target{rise_, 5, 0.3, 0, 0.3};
  const KnownParameters known = known_parameters(stage_, options_, beds_, {target});
  double mean = 0, square = 0, all = 0;
  for (std::size_t i = 0; i < known.posterior.size(); ++i) {
    const double x = known.posterior.point(i)[0], w = known.posterior.weight[i];
    all += w, mean += w * x, square += w * x * x;
  }
  EXPECT_NEAR(all, 1, 1e-9);
  EXPECT_NEAR(mean, 0.5, 0.01);
  const double deviation = std::hypot(0.3, 0.1) / 4;
  EXPECT_NEAR(std::sqrt(square - mean * mean), deviation, 0.08 * deviation);
  // The region holds the posterior and a quarter of its width beyond.
  EXPECT_LT(known.region.low[0], 0.5 - 3 * deviation);
  EXPECT_GT(known.region.high[0], 0.5 + 3 * deviation);
  EXPECT_NEAR((known.region.low[0] + known.region.high[0]) / 2, 0.5, 0.5 * deviation) << "about the posterior";
  EXPECT_LT(known.region.high[0], 0.95);
  EXPECT_GE(known.beds_near, 40U) << "20 for the parameter and 20 more";
  const auto [predicted, error] = known.near->predicted(std::vector<double>{0.5}, 0, rise_);
  EXPECT_NEAR(predicted, 5, 0.05);
  EXPECT_NEAR(error, 0.1, 0.02);
  EXPECT_NEAR(known.near->scatter(rise_), 0.1, 0.02);
  EXPECT_EQ(known.near->beds(rise_), known.beds_near);
  const BedSurrogate::Fit fit = known.near->fit(std::vector<double>{0.5, 0.5 + 2 * deviation}, {target});
  EXPECT_NEAR(fit.chi2[0], 0, 0.05);
  EXPECT_NEAR(fit.chi2[1], 4, 0.4);
  EXPECT_GT(known.near->within(rise_)[1], 0.9);
  EXPECT_NEAR(known.near->average(rise_, std::vector<double>{0.25})[0], 4, 0.1);
  // The evidence is the mean likelihood over the whole prior, though only the region was sampled.
  ASSERT_LT(known.region.volume(), 0.8);
  std::vector<double> grid;
  for (int i = 0; i < 1000; ++i) grid.push_back((i + 0.5) / 1000);
  double likelihood = 0;
  for (const double one : known.near->fit(grid, {target}).log_likelihood) likelihood += std::exp(one) / 1000;
  EXPECT_NEAR(known.posterior.log_evidence, std::log(likelihood), 0.05);
}

// Forty-eight beds are 0.05 off, six 0.2 and six 0.35: their standard deviation is 0.135.
TEST_F(BedsOfAFormula, LieWithinOneOrTwoDeviations) {
  for (std::size_t i = 0; i < beds_.size(); ++i) {
    const double x = (beds_[i].values[0] - 2) / 4, size = i % 10 == 3 ? 0.2 : i % 10 == 8 ? 0.35 : 0.05;
    beds_[i].numbers[rise_] = 3 + 4 * x + (i / 10 % 2 == i % 2 ? size : -size);
  }
  const BedSurrogate all{options_, beds_, {{rise_, 5, 0.3, 0, 0.3}}, BedSurrogate::Training{{{0}, {1}}, false, 1}};
  EXPECT_NEAR(all.scatter(rise_), 0.135, 0.02);
  EXPECT_NEAR(all.within(rise_)[0], 0.8, 0.02);
  EXPECT_NEAR(all.within(rise_)[1], 0.9, 0.02);
}

// An error that includes the scatter counts it once.
TEST_F(BedsOfAFormula, CountTheirScatterOnce) {
  const auto chi2 = [&](double least, double further) {
    const ScaledTarget target{rise_, 5.6, 0, least, further};
    return known_parameters(stage_, options_, beds_, {target}).all->fit(std::vector<double>{0.5}, {target}).chi2[0];
  };
  const double alone = 0.36 / chi2(0, 0);  // the variance of a prediction
  EXPECT_NEAR(alone, 0.01, 0.003);
  EXPECT_NEAR(0.36 / chi2(0, 0.3), alone + 0.09, 0.004);
  EXPECT_NEAR(0.36 / chi2(0.3, 0), alone + 0.09 - 0.01, 0.004);
  EXPECT_NEAR(0.36 / chi2(0.05, 0), alone, 0.001);
}

// Beds without the number are left out; where none is near the target there is no posterior.
TEST_F(BedsOfAFormula, WithoutTheirNumberAreLeftOut) {
  for (std::size_t i = 0; i < 60; i += 6) beds_[i].numbers[rise_] = NAN;
  const ScaledTarget target{rise_, 5, 0.3, 0, 0.3};
  EXPECT_EQ(known_parameters(stage_, options_, beds_, {target}).all->beds(rise_), 50U);
}

// Too few beds with the number are no surrogate, which is said of the number, or of the profile.
TEST_F(BedsOfAFormula, AreTooFewWhereMostLackTheirNumber) {
  options_.bed.heights = {0.5};
  for (RunBed& bed : beds_) bed.numbers.push_back(NAN);
  for (std::size_t i = 2; i < 60; ++i) beds_[i].numbers[rise_] = NAN;
  const auto said = [&](std::size_t number) -> std::string {
    try {
      const BedSurrogate all{options_, beds_, {{number, 5, 0.3, 0, 0.3}}, BedSurrogate::Training{{{0}, {1}}, false, 1}};
    } catch (const StageError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(said(rise_),
            "center_of_mass_rise: a surrogate of 1 parameters needs at least 12 runs, but 2 were given (beds whose fit "
            "failed are not counted)");
  EXPECT_EQ(said(observables().size()),
            "profile: a surrogate of 1 parameters needs at least 12 runs, but 0 were given (beds whose fit failed are "
            "not counted)")
      << "a bed that was given up has no density, not a density of 0";
}

// The same beds photographed at two moments: there the rise is 2 more and 2 less than on average. The density at two
// heights goes with x, too. The prior of the average is 0.4, of each moment 0.3.
class ViewsOfAFormula : public BedsOfAFormula {
 protected:
  ViewsOfAFormula() {
    options_.bed.views = views_of(2, 0.4, {});
    options_.bed.heights = {0.5, 1.5};
    for (std::size_t i = 0; i < 30; ++i) beds_[i] = beds_[2 * i];
    beds_.resize(30);
    for (std::size_t i = 0; i < beds_.size(); ++i) {
      const double x = (beds_[i].values[0] - 2) / 4, scatter = i % 2 == 0 ? 0.01 : -0.01;
      std::vector<double> all;
      for (const double more : {0.0, 2.0, -2.0}) {
        const std::size_t first = all.size();
        all.insert(all.end(), beds_[i].numbers.begin(), beds_[i].numbers.end());
        all[first + rise_] += more;
        all.push_back(root_to_density(0.9 - 0.3 * x + 0.05 * more + scatter));
        all.push_back(root_to_density(0.4 + 0.2 * x - 0.05 * more + scatter));
      }
      beds_[i].numbers = std::move(all);
    }
  }
  static double root_to_density(double root) { return root * root - 0.01; }
  BedSurrogate surrogate(const ScaledTarget& target) {
    return {options_, beds_, {target}, BedSurrogate::Training{{{0}, {1}}, false, 1}};
  }
  const ScaledTarget target_{rise_, 5, 0.3, 0, 0.3};
};

TEST_F(ViewsOfAFormula, ArePredictedEachByItself) {
  const BedSurrogate all = surrogate(target_);
  for (const auto& [view, more] : {std::pair<std::size_t, double>(0, 0), {1, 2}, {2, -2}}) {
    EXPECT_NEAR(all.predicted(std::vector<double>{0.25}, view, rise_).value, 4 + more, 0.05) << view;
    EXPECT_NEAR(all.predicted(std::vector<double>{0.25}, view, rise_).std_error, 0.1, 0.03) << view;
    // chi2 of 5 +- 0.3 at places 0, 0.5 and 1, where the rise is 3, 5 and 7 on average.
    const BedSurrogate::Fit fit = all.fit(std::vector<double>{0, 0.5, 1}, {target_});
    ASSERT_EQ(fit.chi2.size(), 9U);
    for (std::size_t i = 0; i < 3; ++i) {
      const double off = 5 - (3 + 2 * static_cast<double>(i) + more);
      EXPECT_NEAR(fit.chi2[3 * i + view], off * off / 0.1, 0.02 + 0.1 * off * off / 0.1) << i << ' ' << view;
    }
  }
  const BedSurrogate::Fit fit = all.fit(std::vector<double>{0, 0.5, 1}, {target_});
  EXPECT_NEAR(fit.log_likelihood[3 * 0 + 1], fit.log_likelihood[3 * 1 + 0], 0.1) << "both give the target";
  EXPECT_NEAR(fit.log_likelihood[3 * 2 + 2], fit.log_likelihood[3 * 1 + 0], 0.1);
  EXPECT_LT(fit.log_likelihood[3 * 1 + 1], fit.log_likelihood[3 * 1 + 0] - 10);
  const ScaledTarget density{observables().size() + 1, 0.4, 0.05, 0, 0.05};
  const BedSurrogate of_density = surrogate(density);
  const std::vector<shakebed::sim::Measured> profile = of_density.profile(std::vector<double>{0.5}, 0);
  ASSERT_EQ(profile.size(), 2U);
  EXPECT_NEAR(profile[0].value, 0.75, 0.004);
  EXPECT_NEAR(profile[1].value, 0.5, 0.004);
  EXPECT_NEAR(profile[1].std_error, 0.01, 0.003);
  EXPECT_TRUE(std::isnan(of_density.predicted(std::vector<double>{0.5}, 1, rise_).value)) << "no target's moments";
  const std::vector<shakebed::sim::Measured> moment = of_density.profile(std::vector<double>{0.5}, 2);
  EXPECT_NEAR(moment[0].value, 0.65, 0.004);
  EXPECT_NEAR(moment[1].value, 0.6, 0.004);
  EXPECT_NEAR(of_density.predicted(std::vector<double>{0.5}, 1, density.number).value, 0.4, 0.004);
}

// The posterior is the sum over the views: a normal curve of width s about 0.5 by the average, and by the moments the
// halves of those about 0 and 1 that the prior leaves.
TEST_F(ViewsOfAFormula, AreWeighedByTheirPriors) {
  const KnownParameters known = known_parameters(stage_, options_, beds_, {target_});
  double mean = 0, square = 0, middle = 0;
  for (std::size_t i = 0; i < known.posterior.size(); ++i) {
    const double x = known.posterior.point(i)[0], w = known.posterior.weight[i];
    mean += w * x, square += w * (x - 0.5) * (x - 0.5), middle += std::abs(x - 0.5) < 0.25 ? w : 0;
  }
  const double s = std::hypot(0.3, 0.1) / 4;
  EXPECT_NEAR(middle, 0.4 / 0.7, 0.02);
  EXPECT_NEAR(mean, 0.5, 0.01);
  EXPECT_NEAR(square, (0.4 * s * s + 0.3 * (s * s - s * std::sqrt(2 / M_PI) + 0.25)) / 0.7, 0.004);
}

// A moment at which more than a twentieth of the beds lack the number is left out, and the others share its prior.
TEST_F(ViewsOfAFormula, AreLeftOutWhereBedsLackTheNumber) {
  const std::size_t numbers = observables().size() + 2;
  beds_[20].numbers[2 * numbers + rise_] = NAN;
  EXPECT_DOUBLE_EQ(surrogate(target_).view_prior(2), 0.3) << "one of 30";
  beds_[7].numbers[2 * numbers + rise_] = NAN;
  const BedSurrogate fewer = surrogate(target_);
  EXPECT_DOUBLE_EQ(fewer.view_prior(0), 0.4 / 0.7);
  EXPECT_DOUBLE_EQ(fewer.view_prior(1), 0.3 / 0.7);
  EXPECT_EQ(fewer.view_prior(2), 0);
  const BedSurrogate::Fit fit = fewer.fit(std::vector<double>{0.5}, {target_});
  EXPECT_EQ(fit.log_likelihood[2], -INFINITY);
  EXPECT_EQ(fit.chi2[2], INFINITY);
  EXPECT_NEAR(fit.chi2[0], 0, 0.05);
  EXPECT_TRUE(std::isnan(fewer.predicted(std::vector<double>{0.5}, 2, rise_).value));
  // Photographs at one phase leave nothing else.
  options_.bed.views = views_of(0, 1, 0.5);
  for (RunBed& bed : beds_) bed.numbers.resize(2 * numbers);
  EXPECT_EQ(surrogate(target_).view_prior(1), 1);
  for (std::size_t i = 0; i < 2; ++i) beds_[i].numbers[numbers + rise_] = NAN;
  EXPECT_THROW(surrogate(target_), StageError);
}

}  // namespace
