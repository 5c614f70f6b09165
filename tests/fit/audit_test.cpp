#include "fit/audit/audit.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
