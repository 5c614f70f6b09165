// The rules that carry a kernel, and a curve with kinks and ends seen through one, against integrals done by hand.
#include "fit/theory/convolution.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace shakebed::fit {
namespace {

const Kernel kernels_with_width[] = {{KernelKind::gaussian, 0.5},
                                     {KernelKind::gaussian, 0.2},
                                     {KernelKind::top_hat, 0.8},
                                     {KernelKind::disk_chord, 1.0},
                                     {KernelKind::disk_chord, 0.7}};

// A Gaussian's moments are 1, w^2, 3 w^4; a top hat's 1, w^2/12, w^4/80; a chord's, of a half circle, 1, w^2/16,
// w^4/128. Odd ones are nothing.
TEST(KernelRule, HasTheMomentsOfItsKernel) {
  for (const Kernel& kernel : kernels_with_width) {
    const KernelRule rule(kernel);
    std::array<double, 5> moment{};
    for (std::size_t i = 0; i < rule.offsets().size(); ++i)
      for (std::size_t power = 0; power < 5; ++power)
        moment[power] += rule.weights()[i] * std::pow(rule.offsets()[i], static_cast<double>(power));
    const double w2 = kernel.width * kernel.width;
    const bool gaussian = kernel.kind == KernelKind::gaussian, hat = kernel.kind == KernelKind::top_hat;
    const double tails = gaussian ? 1e-6 : 1e-10;  // what lies beyond its reach, what sixteen nodes leave
    EXPECT_NEAR(moment[0], 1, tails);
    EXPECT_NEAR(moment[1], 0, 1e-14);
    EXPECT_NEAR(moment[2], gaussian ? w2 : hat ? w2 / 12 : w2 / 16, tails * w2);
    EXPECT_NEAR(moment[3], 0, 1e-14);
    EXPECT_NEAR(moment[4], w2 * w2 * (gaussian ? 3 : hat ? 1.0 / 80 : 1.0 / 128), 100 * tails * w2 * w2);
    EXPECT_EQ(rule.offsets().size(), gaussian ? 48U : hat ? 8U : 16U);
    EXPECT_NEAR(rule.panel_length(), 2 * kernel_reach(kernel) / (gaussian ? 6 : hat ? 1 : 2), 1e-15);
    EXPECT_EQ(rule.kernel(), kernel);
    EXPECT_FALSE(rule.is_point());
  }
  EXPECT_TRUE(KernelRule(Kernel{}).is_point());
  EXPECT_TRUE(KernelRule(Kernel{KernelKind::gaussian, 0}).is_point());
}

// A panel holds what the kernel has between its ends, and no more beyond the kernel's own.
TEST(KernelRule, HasThePartOfAPanel) {
  for (const Kernel& kernel : kernels_with_width)
    for (const auto& [from, to] : {std::pair{-0.1, 0.05}, {0.0, 0.3}, {-0.34, -0.2}, {-0.3, 0.34}}) {
      double sum = 0, mean = 0;
      KernelRule(kernel).panel(from, to, [&](double offset, double weight) {
        EXPECT_GT(offset, from);
        EXPECT_LT(offset, to);
        sum += weight, mean += weight * offset;
      });
      EXPECT_NEAR(sum, kernel_cumulative(kernel, to) - kernel_cumulative(kernel, from), 1e-7) << from;
      EXPECT_EQ(mean < 0, from + to < 0) << "more of it lies to this side";
    }
  double all = 0;
  KernelRule({KernelKind::disk_chord, 1.0}).panel(-3, 3, [&](double, double weight) { all += weight; });
  EXPECT_NEAR(all, 1, 1e-6);
}

// A curve that is 0 below 0, 2 - x up to a kink at 1, then 1 up to its end at 3. Through a top hat of width 0.8 it is
// the mean over 0.8 about each height.
double mean_of_kinked_curve(double height, double width) {
  const auto area_below = [](double x) {
    if (x <= 0) return 0.0;
    if (x <= 1) return 2 * x - 0.5 * x * x;
    return 1.5 + (std::min(x, 3.0) - 1);
  };
  return (area_below(height + 0.5 * width) - area_below(height - 0.5 * width)) / width;
}
struct SeenThrough {
  double value = 0, twice = 0;
  int nodes = 0;
};
template <class PanelAt>
SeenThrough seen_through(const KernelRule& rule, double height, const PanelAt& panel_at) {
  const std::vector<double> breaks = {1.0};
  SeenThrough seen;
  std::array<double, 2> sum{};
  add_convolution(
      rule, height, CurveShape<PanelAt>{0, 3, breaks, panel_at},
      [&](double x) {
        ++seen.nodes;
        EXPECT_TRUE(x >= 0 && x <= 3) << "asked beyond its ends";
        const double curve = x < 1 ? 2 - x : 1;
        return std::array{curve, 2 * curve};
      },
      sum);
  seen.value = sum[0], seen.twice = sum[1];
  return seen;
}

TEST(Convolution, OfACurveWithAKinkIsItsMean) {
  const KernelRule rule({KernelKind::top_hat, 0.8});
  const auto wide = [](double) { return 10.0; };
  for (const double height :
       {-0.5, -0.39, -0.1, 0.0, 0.3, 0.41, 0.5, 0.65, 1.0, 1.2, 1.39, 1.5, 2.2, 2.61, 3.0, 3.39, 3.5}) {
    const SeenThrough seen = seen_through(rule, height, wide);
    EXPECT_NEAR(seen.value, mean_of_kinked_curve(height, 0.8), 1e-14) << height;
    EXPECT_NEAR(seen.twice, 2 * seen.value, 1e-15) << "each component by itself";
  }
  // Eight nodes where it is smooth, eight more for each part beside the kink, none beyond its ends.
  EXPECT_EQ(seen_through(rule, 0.5, wide).nodes, 8);
  EXPECT_EQ(seen_through(rule, 2.0, wide).nodes, 8);
  EXPECT_EQ(seen_through(rule, 1.0, wide).nodes, 16);
  EXPECT_EQ(seen_through(rule, -0.1, wide).nodes, 8);
  EXPECT_EQ(seen_through(rule, 3.5, wide).nodes, 0);
}

// Where the curve turns within less than the kernel's panels, at its lower end, its middle or its upper one, panels are
// that short.
TEST(Convolution, TakesPanelsAsShortAsTheCurveNeeds) {
  const KernelRule rule({KernelKind::top_hat, 0.8});
  EXPECT_EQ(seen_through(rule, 2.0, [](double) { return 0.2; }).nodes, 32);
  EXPECT_EQ(seen_through(rule, 2.0, [](double) { return 0.81; }).nodes, 8);
  EXPECT_GT(seen_through(rule, 2.0, [](double x) { return x < 1.7 ? 0.2 : 9.0; }).nodes, 8);
  EXPECT_GT(seen_through(rule, 2.0, [](double x) { return x == 2.0 ? 0.2 : 9.0; }).nodes, 0);
  EXPECT_EQ(seen_through(rule, 2.0, [](double x) { return x > 2.3 ? 0.2 : 9.0; }).nodes, 8);
  for (const double panel : {0.03, 0.1, 0.27, 0.5})
    for (const double height : {0.2, 0.9, 2.0, 2.9})
      EXPECT_NEAR(seen_through(rule, height, [&](double) { return panel; }).value, mean_of_kinked_curve(height, 0.8),
                  1e-13);
}

// Through a Gaussian, a step at height 0 that ends at 3: the difference of two normal chances; x itself: x.
TEST(Convolution, ThroughAGaussianIsThatOfItsChances) {
  const KernelRule rule({KernelKind::gaussian, 0.5});
  const auto wide = [](double) { return 10.0; };
  const auto chance = [](double x) { return 0.5 * std::erfc(-x / (0.5 * std::sqrt(2.0))); };
  for (const double height : {-1.0, -0.2, 0.0, 0.7, 1.5, 2.9, 3.6}) {
    std::array<double, 2> sum{};
    add_convolution(
        rule, height, CurveShape<decltype(wide)>{0, 3, {}, wide},
        [](double x) {
          return std::array{1.0, x};
        },
        sum);
    const double share = chance(height) - chance(height - 3);
    EXPECT_NEAR(sum[0], share, 1e-6) << height;
    const auto density = [](double x) { return std::exp(-2 * x * x) / (0.5 * std::sqrt(2 * std::numbers::pi)); };
    EXPECT_NEAR(sum[1], height * share + 0.25 * (density(height) - density(height - 3)), 1e-6) << height;
  }
}

}  // namespace
}  // namespace shakebed::fit
