// A fit and the audit in words for the terminal.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <string>

#include "fit/audit/audit.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::tests::fit_texts {
namespace {

using pipelines::audit_json;
using pipelines::audit_text;
using pipelines::fit_json;
using pipelines::fit_text;
using pipelines::Json;

fit::FitResult a_fit() {
  fit::FitResult fit;
  fit.status = fit::FitStatus::ok, fit.model = "enskog-rectangle";
  fit.temperature = {0.25, 0.0125, false}, fit.shift = {7.5, 0.5, false}, fit.solid_height = {7, 0.25, false};
  fit.plateau_density = {1.1, 0, true}, fit.column_number = {12, 0, true};
  fit.critical_status = fit::ValueStatus::ok;
  fit.critical_temperature = {0.5, 0, true}, fit.reduced_temperature = {0.5, 0.025, false};
  fit.chi2_per_dof = 1.25, fit.window_low = 5.125, fit.window_high = 11, fit.bins = 42;
  fit.warnings = {"first", "second"};
  fit.model_comparison.resize(4);
  for (std::size_t k = 0; k < 4; ++k) {
    fit::ModelFit& model = fit.model_comparison[k];
    model.model = "m" + std::to_string(k), model.status = fit::FitStatus::ok;
    model.temperature.value = 0.125 + static_cast<double>(k), model.plateau_density.value = 1.0625;
    model.plateau_density_free = k > 1;
  }
  fit.model_comparison[3].status = fit::FitStatus::not_converged;
  return fit;
}

// Lengths in mm, errors where there are some; of the other models those with a free density that could be fitted.
TEST(FitTexts, HaveALineANumber) {
  EXPECT_EQ(fit_text(fit_json(a_fit(), 0.004)),
            "T / (m g D)                    0.25 +- 0.013 m g D\n"
            "T / (m g)                         1 +- 0.05 mm\n"
            "solid height                      7 +- 0.25 D\n"
            "shift                           7.5 +- 0.5 D\n"
            "plateau density                 1.1  (fixed) 1/D^2\n"
            "T_c / (m g D)                   0.5  (fixed) m g D\n"
            "T / T_c                         0.5 +- 0.025 \n"
            "chi2 per dof                   1.25\n"
            "window                 5.125 to 11 D, 42 bins\n"
            "fit with phi_0 free    T = 2.125 m g D, phi_0 = 1.062 (m2)\n"
            "warning: first\nwarning: second\n");
}

TEST(FitTexts, SayWhatThereIsNot) {
  fit::FitResult fit = a_fit();
  fit.solid_height.value = 0, fit.critical_status = fit::ValueStatus::pole;
  fit.model_comparison.clear(), fit.warnings.clear();
  fit.residuals = {{1, 0.5, 0.1, 0.4, true}, {2, 0.25, 0.1, 0.25, true}};
  const std::string text = fit_text(fit_json(fit, {}));
  EXPECT_EQ(text,
            "The model enskog-rectangle does not describe this profile: inside the window, the rms difference between "
            "model and data is 14.1 % of the greatest density.\n"
            "T / (m g D)                    0.25 +- 0.013 m g D\n"
            "solid height               no solid\n"
            "shift                           7.5 +- 0.5 D\n"
            "plateau density                 1.1  (fixed) 1/D^2\n"
            "chi2 per dof                   1.25\n"
            "window                 5.125 to 11 D, 42 bins\n");
  fit.status = fit::FitStatus::too_few_bins, fit.message = "two bins";
  EXPECT_EQ(fit_text(fit_json(fit, {})),
            "The model enskog-rectangle does not describe this profile: two bins.\n"
            "window                 5.125 to 11 D, 42 bins\n");
}

// Every row: its quantity and status, what is printed and recomputed, the difference where there is one.
TEST(AuditTexts, HaveEveryRow) {
  std::string expected;
  std::size_t differ = 0, agree = 0;
  const Json json = audit_json();
  std::size_t r = 0;
  for (const fit::AuditRow& row : fit::audit()) {
    const Json& entry = json["rows"][r++];
    expected += row.quantity + " [" + std::string(fit::to_string(row.status)) + "]\n  printed:    " + row.printed_text +
                "\n  recomputed: " + row.recomputed_text + "\n";
    EXPECT_EQ(entry["quantity"], row.quantity);
    EXPECT_EQ(entry["place"], row.place);
    EXPECT_EQ(entry["printed_text"], row.printed_text);
    EXPECT_EQ(entry["recomputed_text"], row.recomputed_text);
    EXPECT_EQ(entry.contains("printed"), row.is_numeric);
    if (row.is_numeric) {
      EXPECT_EQ(entry["printed"], row.printed);
      EXPECT_EQ(entry["recomputed"], row.recomputed);
      EXPECT_EQ(entry["difference"], row.difference);
      EXPECT_EQ(entry["relative_difference"], row.relative_difference);
      (row.difference != 0 ? differ : agree) += 1;
      if (row.difference != 0)
        expected += fmt::format("  difference: {:+.7g} ({:+.3g} %)\n", row.difference, 100 * row.relative_difference);
    }
    if (!row.explanation.empty()) expected += "  " + row.explanation + "\n";
  }
  EXPECT_EQ(audit_text(), expected);
  EXPECT_EQ(json["rows"].size(), r);
  EXPECT_GT(differ, 0U);
}

}  // namespace
}  // namespace shakebed::tests::fit_texts
