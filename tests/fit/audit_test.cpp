#include "fit/audit/audit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include "fit/theory/equation_of_state.hpp"

namespace shakebed::fit {
namespace {

AuditRow row(const std::string& quantity) {
  for (const AuditRow& r : audit()) {
    if (r.quantity == quantity) return r;
  }
  ADD_FAILURE() << "no row " << quantity;
  return {};
}

// physics.md, "The audit".
TEST(Audit, RecomputesThePaper) {
  EXPECT_NEAR(row("mu_0").recomputed, 111.311297, 5e-7);
  EXPECT_EQ(row("mu_0").printed, 111.52274);
  EXPECT_EQ(row("mu_0").status, AuditStatus::open);
  EXPECT_NE(row("mu_0").explanation.find("0.768764054"), std::string::npos) << row("mu_0").explanation;
  EXPECT_NEAR(row("Lambda_1").recomputed, 5582.604447, 5e-7);
  EXPECT_NE(row("Lambda_1").explanation.find("5603.6"), std::string::npos) << row("Lambda_1").explanation;
  EXPECT_NEAR(row("T_c/mg at phi_0 = 2/sqrt 3").recomputed, 0.3164, 5e-5);
  EXPECT_EQ(row("T_c/mg at phi_0 = 2/sqrt 3").status, AuditStatus::explained);
  EXPECT_NEAR(row("T_c/mg at phi_0 = 1.10").recomputed, 0.6073, 5e-5);
  EXPECT_EQ(row("T_c/mg at phi_0 = 1.10").status, AuditStatus::agrees);
  EXPECT_NEAR(row("T/T_c from T/mg = 0.36 mm").recomputed, 0.5928, 5e-5);
  EXPECT_EQ(row("T/T_c from T/mg = 0.36 mm").status, AuditStatus::agrees);
  EXPECT_NEAR(row("zeta_F predicted").recomputed, 4.154, 5e-4);
  EXPECT_EQ(row("zeta_F predicted").status, AuditStatus::agrees);
  EXPECT_NEAR(row("z_o").recomputed, 11.99, 5e-3);
  EXPECT_NE(row("z_o").explanation.find("it gives 1.62)"), std::string::npos) << "1.10 x 4.41/2.99";
  EXPECT_NEAR(row("area under the published fit").recomputed, 11.06, 5e-3);
  EXPECT_NE(row("area under the published fit").explanation.find("11.5"), std::string::npos);
  EXPECT_NEAR(row("T/T_c from the map").recomputed, 0.6659, 5e-5);
  EXPECT_EQ(row("T/T_c from the map").status, AuditStatus::open);
  EXPECT_NE(row("T/T_c from the map").explanation.find("0.9056"), std::string::npos);
  EXPECT_NEAR(row("k = 2 Lambda_1 phi_0/mu_0^2 - 1").recomputed, 0.0405375006220, 1e-12);
}

// The number is that of physics.md, rounded to six digits.
TEST(Audit, NamesTheThicknessOfEveryEquation) {
  const std::string text = row("condensation for any pressure").recomputed_text;
  EXPECT_NE(text.find(": mu_0 = 111.311; "), std::string::npos) << text;
}

// What the explanations state, from the printed formulas: c3/(1 - alpha) in place of c3/(1 - alpha phi_0); 0.441 more
// area with the shift that the paper multiplies by 1.10; widths of 1000 disks in 20 D or 20 rows of 50.
TEST(Audit, GivesTheNumbersOfItsExplanations) {
  const auto holds = [](const std::string& text, double value, const char* digits) {
    char number[32];
    std::snprintf(number, sizeof number, digits, value);
    EXPECT_NE(text.find(number), std::string::npos) << number << " in: " << text;
  };
  const EnskogConstants c = enskog_constants();
  const auto f_of = [&](double third) {
    const double d = 1 - c.a * 1.10;
    return std::log(1.10) + c.c1 * 1.10 + c.c2 * std::log(d) + c.c3 / third + c.c4 / (d * d);
  };
  const std::string misprint = row("f(phi_0), third term").explanation;
  holds(misprint, f_of(1 - c.a), " would be %.6g for ");
  holds(misprint, f_of(1 - c.a * 1.10), " for %.6g");
  const std::string area = row("area under the published fit").explanation;
  const double tail = 1.10 * 0.36 / 2.99 * enskog().compressibility_factor(1.10).value;
  holds(area, 4.41 + tail, "1.10 D the area is %.4g, with");
  holds(area, 1.10 * 4.41 + tail, "4.41 D %.4g; by");
  holds(area, 1.10 * 10.2, "must be %.4g");
  const std::string width = row("width of the bed").recomputed_text;
  holds(width, 1000 / (20 * 2 / std::sqrt(3)), "W = %.4g D if mu");
  holds(width, 20 * std::sqrt(3) / 2, "(mu = %.4g D)");
  holds(row("c4").recomputed_text, c.c4, "/alpha = %.10g");
  const std::string k = row("k = 2 Lambda_1 phi_0/mu_0^2 - 1").explanation;
  const double printed = 2 * 5503.531806 * 2 / std::sqrt(3) / (111.52274 * 111.52274) - 1;
  holds(k, 100 * (5582.604447 / 5503.531806 - 1), "a change of %.2g %% in");
  holds(k, 0.0405375006220 / printed, "makes it %.3g times");
  EXPECT_NEAR(row("k = 2 Lambda_1 phi_0/mu_0^2 - 1").printed, printed, 1e-12);
}

// Each row names where it stands in the paper; those beside one another are found together.
TEST(Audit, NamesThePlacesInThePaper) {
  for (const auto& [quantity, place] : {std::pair{"mu_0", "text after eq. (4)"},
                                        {"Lambda_1", "text after eq. (5)"},
                                        {"T_c/mg at phi_0 = 1.10", "comparison with the experiment"},
                                        {"power of mu", "eq. (6)"},
                                        {"reference [11]", "list of references"}})
    EXPECT_EQ(row(quantity).place, place);
}

TEST(Audit, EveryRowSpeaks) {
  const auto rows = audit();
  EXPECT_GE(rows.size(), 16U);
  for (const AuditRow& r : rows) {
    EXPECT_FALSE(r.quantity.empty());
    EXPECT_FALSE(r.place.empty());
    EXPECT_FALSE(r.explanation.empty());
    EXPECT_FALSE(r.printed_text.empty());
    EXPECT_FALSE(r.recomputed_text.empty());
    if (r.is_numeric) {
      EXPECT_TRUE(std::isfinite(r.recomputed));
      EXPECT_NEAR(r.difference, r.recomputed - r.printed, 1e-12);
      EXPECT_NEAR(r.relative_difference * r.printed, r.difference, 1e-12) << r.quantity;
    }
  }
}

}  // namespace
}  // namespace shakebed::fit
