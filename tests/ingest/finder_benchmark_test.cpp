#include "tests/bench/cases/finder_benchmark.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// A lone disk's bound is known in closed form: sigma/C / sqrt(pi R/(2 sqrt(pi) b)) for R >> b.
TEST(FinderBenchmark, BoundOfALoneDiskIsTheTextbooks) {
  Camera camera;
  camera.width = camera.height = 100;
  camera.blur_px = 1;
  camera.read_noise = 5;
  const double edge = std::sqrt(1 + 1.0 / 12);
  const double expected = 5.0 / 140 / std::sqrt(std::numbers::pi * 10 / (2 * std::sqrt(std::numbers::pi) * edge));
  EXPECT_NEAR(centre_bound_px({{50, 50, 10, 0, 0}}, camera) / expected, 1, 0.02);
}

TEST(FinderBenchmark, TouchingNeighboursRaiseTheBoundWhereBlurReachesAcross) {
  Camera camera;
  camera.width = camera.height = 200;
  camera.blur_px = 2;
  camera.read_noise = 5;
  const double alone = centre_bound_px({{100, 100, 10, 0, 0}}, camera);
  std::vector<RenderedDisk> crystal;
  for (int row = -3; row <= 3; ++row)
    for (int k = -3; k <= 3; ++k)
      crystal.push_back({100 + 20.0 * k + (row % 2 ? 10 : 0), 100 + 10 * std::numbers::sqrt3 * row, 10, 0, 0});
  const double packed = centre_bound_px(crystal, camera);
  EXPECT_GT(packed, 1.1 * alone);
  EXPECT_LT(packed, 3 * alone);
}

TEST(FinderBenchmark, JointFitReachesTheBoundAndBeatsHough) {
  FinderBenchmarkOptions options;
  options.width = 360;
  options.height = 340;
  options.rows = 8;
  options.gas_count = 40;
  options.frames = 1;
  options.blurs = {1};
  options.noises = {5};
  const auto rows = benchmark_finder(options);
  std::fputs(finder_benchmark_table(rows).c_str(), stdout);
  ASSERT_EQ(rows.size(), 12U);
  for (std::size_t k = 5; k < rows.size(); k += 6) {
    const FinderBenchmarkRow &hough = rows[k - 5], &joint = rows[k];
    EXPECT_EQ(joint.method, "joint fit");
    EXPECT_EQ(joint.recall, 1.0);
    EXPECT_EQ(joint.precision, 1.0);
    EXPECT_LT(joint.rms_px, 1.3 * joint.bound_px);
    EXPECT_LT(joint.rms_px, 0.2 * hough.rms_px);
    EXPECT_LT(joint.density_error, 0.002);
    EXPECT_FALSE(joint.has_limits);  // promises are made for the usual frames
  }
}

TEST(FinderBenchmark, HardCasesAllPassAndFillTheirTable) {
  const test::ScratchFolder folder;
  const auto rows = benchmark_hard_cases(folder.path());
  EXPECT_EQ(rows.size(), 25U);
  const std::string table = hard_case_table(rows);
  for (const HardCaseRow& row : rows) {
    EXPECT_TRUE(row.status == "found" || row.status == "refused" || row.status == "nothing found") << row.name;
    // Times belong to the benchmark.
    EXPECT_TRUE(row.pass || row.cpu_ms > row.cpu_limit_ms) << row.name << ": " << row.note;
    EXPECT_EQ(row.status == "found", !row.error_unit.empty()) << row.name;
    EXPECT_NE(table.find(row.name), std::string::npos);
  }
}

}  // namespace
}  // namespace shakebed::ingest
