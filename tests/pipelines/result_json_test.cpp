// What result files make of the numbers of a fit and of an answer: every number under its own name, with its error and
// unit, on inputs in which no two numbers are alike.
#include <gtest/gtest.h>

#include <string>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/theory.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;

constexpr double diameter = 0.004;  // D [m]

struct Expected {
  const char* pointer;
  double value, std_error;
  const char* unit;
};
void expect_quantities(const Json& json, std::initializer_list<Expected> all) {
  for (const Expected& one : all) {
    const Json* found = find_pointer(json, one.pointer);
    ASSERT_NE(found, nullptr) << one.pointer;
    EXPECT_DOUBLE_EQ((*found)["value"].get<double>(), one.value) << one.pointer;
    EXPECT_EQ((*found)["unit"], one.unit) << one.pointer;
    if (one.std_error >= 0)
      EXPECT_DOUBLE_EQ((*found)["std_error"].get<double>(), one.std_error) << one.pointer;
    else
      EXPECT_FALSE(found->contains("std_error")) << one.pointer;
  }
}
void expect_numbers(const Json& json, std::initializer_list<std::pair<const char*, double>> all) {
  for (const auto& [pointer, value] : all) {
    const Json* found = find_pointer(json, pointer);
    ASSERT_NE(found, nullptr) << pointer;
    EXPECT_DOUBLE_EQ(found->get<double>(), value) << pointer;
  }
}
void expect_words(const Json& json, std::initializer_list<std::pair<const char*, Json>> all) {
  for (const auto& [pointer, value] : all) {
    const Json* found = find_pointer(json, pointer);
    ASSERT_NE(found, nullptr) << pointer;
    EXPECT_EQ(*found, value) << pointer;
  }
}

fit::FitResult a_fit() {
  fit::FitResult fit;
  fit.status = fit::FitStatus::ok;
  fit.model = "enskog-rectangle";
  fit.temperature = {0.25, 0.0125};
  fit.shift = {9.5, 0.11};
  fit.solid_height = {9.4, 0.12};
  fit.plateau_density = {1.1, 0.013};
  fit.column_number = {11.5, 0.14};
  fit.critical_temperature = {0.5, 0.015};
  fit.reduced_temperature = {0.625, 0.016};
  fit.critical_status = fit::ValueStatus::ok;
  fit.solid_height_by_sum_rule = 9.3;
  fit.parameters = {"temperature", "shift"};
  fit.covariance = {1, 2, 3, 4};
  fit.errors_scaled = true;
  fit.chi2 = 31, fit.dof = 20, fit.chi2_per_dof = 1.55, fit.p_value = 0.05, fit.aic = 35, fit.bic = 37;
  fit.window_low = 2.5, fit.window_high = 14.25, fit.bins = 22, fit.window_rule = "by hand";
  fit.kernel = {KernelKind::top_hat, 0.75};
  fit.temperature_interval = {fit::FitStatus::ok, 0.22, 0.28, 0.95, true, false};
  fit.next_bed_interval = {fit::FitStatus::ok, 0.23, 0.27, 0.96, false, true};
  fit.statistical_error = 0.0075;
  fit.window_sweep = {{3, 13, 18, fit::FitStatus::ok, {0.26, 0.017}, {9.6, 0.18}, 1.4},
                      {4, 12, 15, fit::FitStatus::no_tail, {}, {}, 0}};
  fit.model_comparison = {
      {"fermi", true, fit::FitStatus::ok, {0.27, 0.019}, {9.7, 0.21}, {1.12, 0.022}, 3, 41, 2.1, 47, 49},
      {"rectangle", false, fit::FitStatus::no_signal, {}, {}, {}, 1, 0, 0, 0, 0}};
  // Off by 0.1 and 0.2 inside the window, where the greatest density is 1.25; the last one lies outside.
  fit.residuals = {{1, 1.25, 0.01, 1.15, true}, {2, 0.8, 0.01, 1.0, true}, {3, 2.0, 0.01, 0.5, false}};
  fit.area = 11.4;
  fit.warnings = {"a word"};
  return fit;
}

TEST(FitJson, HoldsEveryEstimateWithItsErrorAndUnit) {
  expect_quantities(fit_json(a_fit(), diameter), {{"/temperature", 0.25, 0.0125, "m g D"},
                                                  {"/temperature_over_mg", 0.001, 0.00005, "m"},
                                                  {"/statistical_error", 0.0075, -1, "m g D"},
                                                  {"/shift", 9.5, 0.11, "D"},
                                                  {"/solid_height", 9.4, 0.12, "D"},
                                                  {"/plateau_density", 1.1, 0.013, "1/D^2"},
                                                  {"/column_number", 11.5, 0.14, "1"},
                                                  {"/critical_temperature", 0.5, 0.015, "m g D"},
                                                  {"/critical_temperature_over_mg", 0.002, 0.00006, "m"},
                                                  {"/reduced_temperature", 0.625, 0.016, "1"},
                                                  {"/solid_height_by_sum_rule", 9.3, -1, "D"},
                                                  {"/window/low", 2.5, -1, "D"},
                                                  {"/window/high", 14.25, -1, "D"},
                                                  {"/area", 11.4, -1, "1"},
                                                  {"/models/0/temperature", 0.27, 0.019, "m g D"},
                                                  {"/models/0/shift", 9.7, 0.21, "D"},
                                                  {"/models/0/plateau_density", 1.12, 0.022, "1/D^2"}});
}

TEST(FitJson, HoldsEveryPlainNumber) {
  const Json json = fit_json(a_fit(), diameter);
  expect_numbers(json, {{"/temperature_interval/low", 0.22},
                        {"/temperature_interval/high", 0.28},
                        {"/temperature_interval/confidence", 0.95},
                        {"/next_bed_interval/low", 0.23},
                        {"/next_bed_interval/high", 0.27},
                        {"/next_bed_interval/confidence", 0.96},
                        {"/chi2", 31},
                        {"/dof", 20},
                        {"/chi2_per_dof", 1.55},
                        {"/p_value", 0.05},
                        {"/aic", 35},
                        {"/bic", 37},
                        {"/covariance/0/0", 1},
                        {"/covariance/0/1", 2},
                        {"/covariance/1/0", 3},
                        {"/covariance/1/1", 4},
                        {"/window/bins", 22},
                        {"/kernel/width", 0.75},
                        {"/temperature_by_window/0/low", 3},
                        {"/temperature_by_window/0/high", 13},
                        {"/temperature_by_window/0/bins", 18},
                        {"/temperature_by_window/0/temperature", 0.26},
                        {"/temperature_by_window/0/temperature_std_error", 0.017},
                        {"/temperature_by_window/0/shift", 9.6},
                        {"/temperature_by_window/0/chi2_per_dof", 1.4},
                        {"/models/0/chi2_per_dof", 2.1},
                        {"/models/0/aic", 47},
                        {"/models/0/bic", 49}});
  EXPECT_DOUBLE_EQ(json["relative_misfit"].get<double>(), std::sqrt((0.01 + 0.04) / 2) / 1.25);
  expect_words(json, {{"/status", "ok"},
                      {"/model", "enskog-rectangle"},
                      {"/parameters/0", "temperature"},
                      {"/parameters/1", "shift"},
                      {"/errors_scaled", true},
                      {"/window/rule", "by hand"},
                      {"/kernel/kind", "top_hat"},
                      {"/temperature_interval/status", "ok"},
                      {"/temperature_interval/low_open", true},
                      {"/temperature_interval/high_open", false},
                      {"/next_bed_interval/status", "ok"},
                      {"/next_bed_interval/low_open", false},
                      {"/next_bed_interval/high_open", true},
                      {"/temperature_by_window/0/status", "ok"},
                      {"/models/0/model", "fermi"},
                      {"/models/0/plateau_density_free", true},
                      {"/models/1/plateau_density_free", false},
                      {"/models/0/status", "ok"},
                      {"/describes_data", false},
                      {"/warnings/0", "a word"}});
  EXPECT_FALSE(json["models"][1].contains("temperature"));
  EXPECT_FALSE(json["temperature_by_window"][1].contains("temperature"));
  EXPECT_EQ(json["why_not"],
            "inside the window, the rms difference between model and data is 12.6 % of the greatest density");
}

TEST(FitJson, SaysWhatItDoesNotKnow) {
  fit::FitResult fit = a_fit();
  fit.critical_status = fit::ValueStatus::outside_range;
  fit.temperature.fixed = true;
  const Json json = fit_json(fit, std::nullopt);
  for (const char* key : {"temperature_over_mg", "critical_temperature", "reduced_temperature",
                          "solid_height_by_sum_rule", "critical_temperature_over_mg"})
    EXPECT_FALSE(json.contains(key)) << key;
  EXPECT_EQ(json["critical_temperature_status"], "outside range");
  EXPECT_EQ(json["temperature"]["fixed"], true);
  fit.status = fit::FitStatus::no_tail, fit.message = "flat";
  const Json none = fit_json(fit, diameter);
  EXPECT_FALSE(none.contains("temperature"));
  EXPECT_EQ(none["message"], "flat");
  EXPECT_EQ(none["why_not"], "flat");
}

// The model describes data that it misses by no more than 5 %, unless it finds T above T_c.
TEST(FitJson, JudgesTheModel) {
  fit::FitResult fit = a_fit();
  fit.residuals = {{1, 1.0, 0.01, 0.951, true}, {2, 0.5, 0.01, 0.549, true}};
  EXPECT_EQ(fit_json(fit, diameter)["describes_data"], true);
  fit.residuals[0].model = 0.94, fit.residuals[1].model = 0.56;
  EXPECT_EQ(fit_json(fit, diameter)["describes_data"], false);
  fit.residuals[0].model = 1, fit.residuals[1].model = 0.5;
  fit.reduced_temperature.value = 1.25;
  const Json hot = fit_json(fit, diameter);
  EXPECT_EQ(hot["describes_data"], false);
  EXPECT_EQ(hot["why_not"].get<std::string>().find("T/T_c = 1.25 is above 1"), 0U);
  fit.model = "simulation";
  EXPECT_EQ(fit_json(fit, diameter)["describes_data"], true) << "beds above T_c are matched too";
}

// Lengths for people are in mm, errors too.
TEST(FitText, ShowsValuesAndErrorsInTheSameUnit) {
  const std::string text = fit_text(fit_json(a_fit(), diameter));
  for (const char* line :
       {"T / (m g D)                    0.25 +- 0.013 m g D\n", "T / (m g)                         1 +- 0.05 mm\n",
        "solid height                    9.4 +- 0.12 D\n", "shift                           9.5 +- 0.11 D\n",
        "plateau density                 1.1 +- 0.013 1/D^2\n", "T_c / (m g D)                   0.5 +- 0.015 m g D\n",
        "T / T_c                       0.625 +- 0.016 \n", "chi2 per dof                   1.55\n",
        "window                 2.5 to 14.25 D, 22 bins\n",
        "fit with phi_0 free    T = 0.27 m g D, phi_0 = 1.12 (fermi)\n", "warning: a word\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << "in\n" << text;
}

fit::Answer an_answer() {
  fit::Answer answer;
  answer.status = fit::FitStatus::ok;
  answer.verdict = fit::Verdict::one_temperature;
  answer.why = "so it is", answer.advice = "go on";
  answer.thermometer = "whole column", answer.model = "fermi";
  answer.temperature = 0.25, answer.std_error = 0.025;
  answer.statistical_error = 0.011, answer.bias_uncertainty = 0.012, answer.spread = 0.013;
  answer.contact_duration_uncertainty = 0.014, answer.wall_uncertainty = 0.019, answer.misfit_error = 0.016;
  answer.next_bed_interval = {fit::FitStatus::ok, 0.23, 0.27, 0.85};
  answer.bias = 0.07;
  answer.interval = {fit::FitStatus::ok, 0.21, 0.31, 0.9};
  answer.solid_height = {9.5, 0.14};
  answer.temperature_x = fit::Estimate{0.2, 0.015};
  answer.temperature_z = fit::Estimate{0.3, 0.016};
  fit::ThermometerReading reading;
  reading.thermometer = "tail", reading.model = "enskog-rectangle", reading.status = fit::FitStatus::ok;
  reading.bias = 0.04, reading.bias_uncertainty = 0.05, reading.temperature = 0.26, reading.std_error = 0.017;
  reading.chi2_per_dof = 1.25, reading.admissible = true;
  answer.readings = {reading};
  return answer;
}

TEST(AnswerJson, HoldsEveryNumberWithItsErrorAndUnit) {
  const Json json = answer_json(an_answer(), diameter);
  expect_quantities(json, {{"/temperature", 0.25, 0.025, "m g D"},
                           {"/temperature_over_mg", 0.001, 0.0001, "m"},
                           {"/temperature_x", 0.2, 0.015, "m g D"},
                           {"/temperature_x_over_mg", 0.0008, 0.00006, "m"},
                           {"/temperature_z", 0.3, 0.016, "m g D"},
                           {"/temperature_z_over_mg", 0.0012, 0.000064, "m"},
                           {"/interval/low", 0.21, -1, "m g D"},
                           {"/interval/high", 0.31, -1, "m g D"},
                           {"/statistical_error", 0.011, -1, "m g D"},
                           {"/contact_duration_uncertainty", 0.014, -1, "m g D"},
                           {"/wall_uncertainty", 0.019, -1, "m g D"},
                           {"/bias_uncertainty", 0.012, -1, "m g D"},
                           {"/misfit_error", 0.016, -1, "m g D"},
                           {"/next_bed_interval/low", 0.23, -1, "m g D"},
                           {"/next_bed_interval/high", 0.27, -1, "m g D"},
                           {"/spread", 0.013, -1, "m g D"},
                           {"/solid_height", 9.5, 0.14, "D"},
                           {"/readings/0/temperature", 0.26, 0.017, "m g D"}});
  expect_numbers(json, {{"/interval/confidence", 0.9},
                        {"/next_bed_interval/confidence", 0.85},
                        {"/bias", 0.07},
                        {"/readings/0/bias", 0.04},
                        {"/readings/0/bias_uncertainty", 0.05},
                        {"/readings/0/chi2_per_dof", 1.25}});
  expect_words(json, {{"/verdict", "one temperature"},
                      {"/why", "so it is"},
                      {"/advice", "go on"},
                      {"/status", "ok"},
                      {"/thermometer", "whole column"},
                      {"/model", "fermi"},
                      {"/readings/0/thermometer", "tail"},
                      {"/readings/0/model", "enskog-rectangle"},
                      {"/readings/0/status", "ok"},
                      {"/readings/0/admissible", true}});
  const Json reduced = answer_json(an_answer(), std::nullopt);
  EXPECT_FALSE(reduced.contains("temperature_over_mg"));
  EXPECT_FALSE(reduced.contains("temperature_x_over_mg"));
  fit::Answer no_solid = an_answer();
  no_solid.solid_height = {};
  EXPECT_TRUE(answer_json(no_solid, diameter)["solid_height"].is_null());
}

TEST(AnswerText, IsInMillimetresWhereTheDiameterIsKnown) {
  EXPECT_EQ(answer_text(answer_json(an_answer(), diameter)),
            "T/(m g) = 1 ± 0.1 mm (95 %: 0.84 to 1.24); kinetic T_x 0.8, T_z 1.2 mm. One temperature: so it is");
  fit::Answer many = an_answer();
  many.verdict = fit::Verdict::no_single_temperature;
  many.temperature_x = many.temperature_z = std::nullopt;
  EXPECT_EQ(answer_text(answer_json(many, diameter)),
            "T/(m g) between 0.84 and 1.24 mm. No single temperature: so it is");
  EXPECT_EQ(answer_text(answer_json(many, std::nullopt)),
            "T between 0.21 and 0.31 m g D. No single temperature: so it is");
}

// --- theory and map: lengths are T times the diameter, T/T_c is T over T_c

TEST(TheoryJson, HoldsItsNumbersInTheirUnits) {
  TheoryQuestion question;
  question.plateau_density = 1.1, question.diameter = diameter, question.initial_height = 10,
  question.temperature = 0.05;
  const Json json = theory_json(question);
  const double critical = json["critical_temperature"];
  const double mu_0 = json["mu_0"];
  EXPECT_NEAR(critical, 10 * 1.1 / mu_0, 1e-9 * critical) << "N D/W = phi_0 mu is T_c mu_0";
  expect_numbers(json, {{"/plateau_density", 1.1},
                        {"/diameter", 0.004},
                        {"/initial_height", 10},
                        {"/column_number", 11},
                        {"/temperature", 0.05},
                        {"/temperature_over_mg", 0.0002},
                        {"/critical_temperature_over_mg", 0.004 * critical},
                        {"/reduced_temperature", 0.05 / critical}});
  EXPECT_NEAR(json["solid_height"].get<double>(), (11 - 0.05 * mu_0) / 1.1, 1e-9);
  EXPECT_GT(json["center_of_mass_rise"].get<double>(), 0);
  for (const auto& [name, unit] : {std::pair{"diameter", "m"},
                                   {"initial_height", "D"},
                                   {"temperature", "m g D"},
                                   {"temperature_over_mg", "m"},
                                   {"critical_temperature", "m g D"},
                                   {"critical_temperature_over_mg", "m"},
                                   {"solid_height", "D"},
                                   {"center_of_mass_rise", "D"},
                                   {"plateau_density", "1/D^2"},
                                   {"mu_0", "1"}})
    EXPECT_EQ(json["units"][name], unit) << name;
  const std::string text = theory_text(question);
  EXPECT_NE(text.find("temperature_over_mg                        0.0002 m\n"), std::string::npos) << text;
}

TEST(MapText, ShowsTheNumbersOfTheMap) {
  MapQuestion question;
  question.gamma = 4, question.frequency = 20, question.diameter = 0.003, question.initial_height = 10;
  question.measured_temperature = 0.05;
  const Json map = map_json(question);
  const std::string text = map_text(map);
  for (const Json& row : map["readings"]) {
    if (row["jump"].is_null()) continue;
    char line[200];
    const Json& gamma = row["gamma_of_measured_temperature"];
    char measured[40] = "none";
    if (gamma.is_object()) std::snprintf(measured, sizeof measured, "%.4f", gamma["value"].get<double>());
    std::snprintf(line, sizeof line, "%-40s %10.4f %12.4f %9s %20s\n", row["name"].get<std::string>().c_str(),
                  row["jump"]["value"].get<double>(), row["reduced_temperature"]["value"].get<double>(),
                  row["in_range"].get<bool>() ? "yes" : "no", measured);
    EXPECT_NE(text.find(line), std::string::npos) << line << "in\n" << text;
  }
  EXPECT_NE(text.find("Gamma = 4\n"), std::string::npos);
}

}  // namespace
