// The window of a density: its shape against its definition, its names, and how centres become a density.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "statistics/kernel.hpp"

namespace shakebed {
namespace {

const Kernel windows[] = {{KernelKind::gaussian, 0.3}, {KernelKind::top_hat, 0.7}, {KernelKind::disk_chord, 1}};

// By definition: of a Gaussian, of a bin, of the chord of a disk over its area.
double by_definition(const Kernel& kernel, double s) {
  const double w = kernel.width;
  if (kernel.kind == KernelKind::gaussian)
    return std::exp(-s * s / (2 * w * w)) / (w * std::sqrt(2 * std::numbers::pi));
  if (std::abs(s) > w / 2) return 0;
  if (kernel.kind == KernelKind::top_hat) return 1 / w;
  return 2 * std::sqrt(w * w / 4 - s * s) / (std::numbers::pi * w * w / 4);
}

TEST(Kernel, HasTheShapeOfItsDefinition) {
  for (const Kernel& kernel : windows)
    for (double s = -1.2; s < 1.2; s += 0.017)
      EXPECT_NEAR(kernel_density(kernel, s), by_definition(kernel, s), 1e-14) << to_string(kernel) << " " << s;
}

// Half a width, and 6.5 standard deviations of a Gaussian: nothing lies beyond, something just before.
TEST(Kernel, ReachesAsFarAsItsWidthSays) {
  EXPECT_EQ(kernel_reach({}), 0);
  for (const auto& [kernel, reach] : {std::pair{Kernel{KernelKind::gaussian, 0.4}, 2.6},
                                      {Kernel{KernelKind::top_hat, 2.5}, 1.25},
                                      {Kernel{KernelKind::top_hat, 0.5}, 0.25},
                                      {Kernel{KernelKind::disk_chord, 2.5}, 1.25},
                                      {Kernel{KernelKind::disk_chord, 0.5}, 0.25}}) {
    EXPECT_DOUBLE_EQ(kernel_reach(kernel), reach) << to_string(kernel);
    EXPECT_LT(kernel_density(kernel, 1.001 * reach), 1e-8) << to_string(kernel);
    EXPECT_GT(kernel_density(kernel, 0.999 * reach), 0) << to_string(kernel);
  }
}

// A centre under a window wider than a diameter counts at every height that the window reaches.
TEST(AddDensity, OfAWideWindowReachesAllItsHeights) {
  const HeightGrid grid{0, 0.125, 81};
  for (const Kernel& kernel :
       {Kernel{KernelKind::top_hat, 2.25}, Kernel{KernelKind::disk_chord, 2.25}, Kernel{KernelKind::gaussian, 1.5}}) {
    std::vector<double> density(grid.points);
    add_density(grid, kernel, 4, std::vector<double>{5.03}, 0, density);
    for (std::size_t i = 0; i < grid.points; ++i)
      EXPECT_NEAR(density[i], by_definition(kernel, grid.height(i) - 5.03) / 4, 1e-12) << to_string(kernel) << " " << i;
  }
}

TEST(Kernel, CumulativeIsTheIntegralOfTheDensity) {
  for (const Kernel& kernel : windows) {
    double area = 0;
    constexpr int steps = 200'000;
    const double low = -2.2, step = 4.4 / steps;
    for (int i = 0; i < steps; ++i) {
      area += by_definition(kernel, low + (i + 0.5) * step) * step;
      if (i % 10'000 != 0) continue;
      EXPECT_NEAR(kernel_cumulative(kernel, low + (i + 1) * step), area, 2e-5) << to_string(kernel);
    }
    EXPECT_NEAR(area, 1, 2e-5);
  }
  EXPECT_EQ(kernel_cumulative({}, -1e-9), 0);
  EXPECT_EQ(kernel_cumulative({}, 1e-9), 1);
  // Without width all of it lies at 0, whatever its kind.
  for (Kernel kernel : windows) {
    kernel.width = 0;
    EXPECT_EQ(kernel_cumulative(kernel, -1e-300), 0);
    EXPECT_EQ(kernel_cumulative(kernel, 0), 1);
    EXPECT_EQ(kernel_cumulative(kernel, 1e-300), 1);
  }
}

// What has no kernel weighs nothing in a density, and a width of 0 is one that stands for none.
TEST(Kernel, MayHaveNoWidth) {
  EXPECT_TRUE(kernel_is_valid({}));
  EXPECT_EQ(kernel_density({}, 0), 0);
  EXPECT_EQ(kernel_density({}, 0.3), 0);
  for (Kernel kernel : windows) {
    EXPECT_TRUE(kernel_is_valid(kernel));
    for (const double wrong : {-1e-300, -1.0, std::nan(""), double(INFINITY)}) {
      kernel.width = wrong;
      EXPECT_FALSE(kernel_is_valid(kernel)) << wrong;
    }
    kernel.width = 0;
    EXPECT_TRUE(kernel_is_valid(kernel));
    EXPECT_EQ(kernel_reach(kernel), 0);
    EXPECT_EQ(kernel_from(to_string(kernel)), kernel);
  }
}

TEST(Kernel, EverySpellingComesBack) {
  const std::pair<KernelKind, const char*> names[] = {{KernelKind::none, "none"},
                                                      {KernelKind::gaussian, "gaussian"},
                                                      {KernelKind::top_hat, "top_hat"},
                                                      {KernelKind::disk_chord, "disk_chord"}};
  for (const auto& [kind, name] : names) {
    EXPECT_EQ(to_string(kind), name);
    EXPECT_EQ(kernel_kind_from(name), kind);
  }
  for (const char* wrong : {"top-hat", "disk-chord", "Gaussian", "", "boxcar"})
    EXPECT_FALSE(kernel_kind_from(wrong)) << wrong;
  EXPECT_EQ(kernel_from("gaussian:0.25"), (Kernel{KernelKind::gaussian, 0.25}));
  EXPECT_EQ(kernel_from("gaussian"), (Kernel{KernelKind::gaussian, 0.5}));
  EXPECT_EQ(kernel_from("disk_chord"), (Kernel{KernelKind::disk_chord, 1}));
  EXPECT_EQ(kernel_from("top_hat"), (Kernel{KernelKind::top_hat, 1}));
  EXPECT_EQ(kernel_from("none"), (Kernel{KernelKind::none, 0}));
  for (const char* wrong : {"none:1", "gaussian:", "gaussian:x", "gaussian:-1", "gaussian:0.5 D", "gaussian:nan"})
    EXPECT_FALSE(kernel_from(wrong)) << wrong;
  for (const Kernel& kernel : windows) EXPECT_EQ(kernel_from(to_string(kernel)), kernel);
}

// Each point's value from its own kernel, but for rounding of the place, which the steep edge of a chord magnifies;
// centres inside, at the edges and beyond them, grids finer and coarser than the kernel, the floor shifted.
TEST(AddDensity, IsTheSumOfTheKernels) {
  std::mt19937_64 random(44);
  std::uniform_real_distribution<double> uniform;
  for (const Kernel& kernel : windows) {
    for (const double spacing : {0.002, 0.05, 0.4, 3.0}) {
      const HeightGrid grid{-1, spacing, static_cast<std::size_t>(9 / spacing)};
      const double top = grid.lowest + spacing * static_cast<double>(grid.points);
      for (int i = 0; i < 100; ++i) {
        const double z = grid.lowest - 2 + (top - grid.lowest + 4) * uniform(random), shift = uniform(random) - 0.5;
        std::vector<double> density(grid.points);
        add_density(grid, kernel, 30, std::vector<double>{z}, shift, density);
        for (std::size_t k = 0; k < grid.points; ++k) {
          const double away = grid.height(k) + shift - z, value = by_definition(kernel, away) / 30;
          if (std::abs(std::abs(away) - kernel_reach(kernel)) < 1e-9) continue;  // on its edge
          if (std::abs(away) > kernel_reach(kernel))
            ASSERT_EQ(density[k], 0) << z << ' ' << k;
          else
            ASSERT_NEAR(density[k], value, 1e-12 * value + (kernel.kind == KernelKind::disk_chord ? 1e-13 : 1e-17))
                << to_string(kernel) << ' ' << z << ' ' << k;
        }
      }
    }
  }
}

TEST(AddDensity, HasTheDisksUnderIt) {
  const HeightGrid grid{-2, 0.05, 400};
  std::mt19937_64 random(43);
  std::uniform_real_distribution<double> uniform(3, 13);
  std::vector<double> heights(300);
  for (double& z : heights) z = uniform(random);
  for (const Kernel& kernel : windows) {
    std::vector<double> density(grid.points);
    add_density(grid, kernel, 30, heights, 0, density);
    double area = 0;
    for (const double value : density) area += value * grid.spacing;
    EXPECT_NEAR(area, 10, kernel.kind == KernelKind::gaussian ? 1e-7 : 0.05) << to_string(kernel);
  }
}

// In bins that touch one another every centre counts once, also one that lies on the edge of two.
TEST(AddDensity, ACentreOnTheEdgeOfTwoBinsCountsHalfInEach) {
  const HeightGrid grid{0.5, 1, 4};
  std::vector<double> density(4);
  add_density(grid, {KernelKind::top_hat, 1}, 1, std::vector<double>{2.0, 2.5}, 0, density);
  EXPECT_EQ(density, (std::vector<double>{0, 0.5, 1.5, 0}));
}

TEST(AddDensity, DoesNotHideAPlaceThatIsNoNumber) {
  const HeightGrid grid{-1, 0.05, 100};
  for (const Kernel& kernel : windows) {
    std::vector<double> density(grid.points);
    add_density(grid, kernel, 30, std::vector<double>{1, std::nan("")}, 0, density);
    for (const double value : density) EXPECT_TRUE(std::isnan(value));
  }
}

TEST(AddDensity, RefusesWindowsWithoutWidth) {
  std::vector<double> density(3);
  const std::vector<double> centre{1};
  EXPECT_THROW(add_density({0, 1, 3}, {}, 1, centre, 0, density), std::invalid_argument);
  EXPECT_THROW(add_density({0, 1, 3}, {KernelKind::gaussian, 0}, 1, centre, 0, density), std::invalid_argument);
  EXPECT_THROW(add_density({0, 0, 3}, {KernelKind::gaussian, 1}, 1, centre, 0, density), std::invalid_argument);
  EXPECT_THROW(add_density({0, 1, 3}, {KernelKind::gaussian, 1}, 0, centre, 0, density), std::invalid_argument);
}

}  // namespace
}  // namespace shakebed
