// Neighbours of packed beds against all pairs, one by one.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "sim/engine/pressed_rows.hpp"
#include "sim/engine/random.hpp"

namespace shakebed::sim {
namespace {

constexpr double neighbour_reach = 1.15;

struct Packing {
  double width = 0, period = 0;
  std::vector<double> x, z;
};

Packing hexagonal(int rows, int a_row, double jitter, double period = 0) {
  Random random(7);
  Packing packing{a_row + 0.6, period, {}, {}};
  for (int r = 0; r < rows; ++r) {
    for (int i = 0; i < a_row; ++i) {
      packing.x.push_back(0.5 + i + 0.5 * (r % 2) + jitter * random.uniform());
      packing.z.push_back(0.5 + r * std::numbers::sqrt3 / 2 + jitter * random.uniform());
    }
  }
  return packing;
}

// Disks that do not overlap, in the order in which they found a place.
Packing random_packing(double width, double period) {
  Random random(11);
  Packing packing{width, period, {}, {}};
  for (int trial = 0; trial < 40'000; ++trial) {
    const double x = width * random.uniform(), z = 8 * random.uniform();
    bool free = true;
    for (std::size_t k = 0; free && k < packing.x.size(); ++k) {
      double dx = x - packing.x[k];
      if (period > 0) dx -= period * std::nearbyint(dx / period);
      free = std::hypot(dx, z - packing.z[k]) >= 1;
    }
    if (!free) continue;
    packing.x.push_back(x);
    packing.z.push_back(z);
  }
  return packing;
}

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;

Pairs all_near(const Packing& packing) {
  Pairs pairs;
  for (std::uint32_t i = 0; i < packing.x.size(); ++i) {
    for (std::uint32_t k = i + 1; k < packing.x.size(); ++k) {
      double dx = packing.x[k] - packing.x[i];
      if (packing.period > 0) dx -= packing.period * std::nearbyint(dx / packing.period);
      if (std::hypot(dx, packing.z[k] - packing.z[i]) < neighbour_reach) pairs.insert({i, k});
    }
  }
  return pairs;
}

// The pairs of disks in the lanes of the blocks; each stands there once.
Pairs pairs_of(const PressedRows& rows) {
  const auto count = static_cast<std::uint32_t>(rows.order().size());
  Pairs pairs;
  for (const PairBlock& block : rows.blocks()) {
    EXPECT_LT(block.first, block.second);
    EXPECT_LT(block.second, count);
    for (std::uint32_t q = 0; q < PressedRows::lanes; ++q) {
      if (block.second + q >= count) continue;
      const auto pair = std::minmax(rows.order()[block.first + q], rows.order()[block.second + q]);
      EXPECT_TRUE(pairs.insert(pair).second) << pair.first << " and " << pair.second << " twice";
    }
  }
  return pairs;
}

TEST(PressedRows, HaveEveryTwoThatAreNearInOneLane) {
  for (const Packing& packing :
       {hexagonal(9, 12, 0.04), hexagonal(6, 12, 0.02, 12), random_packing(10, 0), random_packing(10, 10)}) {
    PressedRows rows;
    const auto count = static_cast<std::uint32_t>(packing.x.size());
    rows.find(packing.x, packing.z, count, packing.width, packing.period, neighbour_reach);
    std::vector<std::uint32_t> order = rows.order();
    std::sort(order.begin(), order.end());
    ASSERT_EQ(order.size(), count);
    for (std::uint32_t i = 0; i < count; ++i) EXPECT_EQ(order[i], i);
    const Pairs near = all_near(packing), listed = pairs_of(rows);
    EXPECT_GT(2 * near.size(), count);
    EXPECT_TRUE(std::includes(listed.begin(), listed.end(), near.begin(), near.end()));
  }
}

// Of boxes that hold one to three columns of disks, and of fewer disks than lanes.
TEST(PressedRows, OfNarrowBoxesAndFewDisksAreComplete) {
  std::vector<Packing> packings{random_packing(1, 0), random_packing(2.2, 0)};
  for (const double width : {2.4, 3.0, 3.4, 4.7}) packings.push_back(random_packing(width, width));
  for (std::size_t few = 1; few <= 6; ++few) {
    Packing packing = hexagonal(2, 3, 0.02);
    packing.x.resize(few), packing.z.resize(few);
    packings.push_back(packing);
  }
  for (const Packing& packing : packings) {
    SCOPED_TRACE(testing::Message() << packing.width << " " << packing.x.size());
    PressedRows rows;
    const auto count = static_cast<std::uint32_t>(packing.x.size());
    rows.find(packing.x, packing.z, count, packing.width, packing.period, neighbour_reach);
    ASSERT_EQ(rows.order().size(), count);
    const Pairs near = all_near(packing), listed = pairs_of(rows);
    EXPECT_TRUE(std::includes(listed.begin(), listed.end(), near.begin(), near.end()));
  }
}

TEST(PressedRows, BeginWithThePairsSideBySide) {
  const Packing packing = hexagonal(9, 12, 0.02);
  PressedRows rows;
  rows.find(packing.x, packing.z, 108, packing.width, 0, neighbour_reach);
  for (std::size_t b = 0; b < rows.blocks().size(); ++b)
    EXPECT_EQ(rows.blocks()[b].second == rows.blocks()[b].first + 1, b < rows.in_rows()) << b;
}

// 9 rows of 12 disks have 9 x 11 pairs in rows and 8 x 23 between them. Each row is three blocks to itself; of the
// pairs between rows 12 go straight up a row's end, 11 aslant.
TEST(PressedRows, PutAPerfectPackingIntoHardlyMoreThanFullBlocks) {
  const Packing packing = hexagonal(9, 12, 0);
  PressedRows rows;
  rows.find(packing.x, packing.z, 108, packing.width, 0, neighbour_reach);
  for (std::uint32_t place = 0; place < 108; ++place) EXPECT_EQ(rows.order()[place], place);
  const std::size_t pairs = all_near(packing).size();
  EXPECT_EQ(pairs, 9U * 11 + 8 * 23);
  EXPECT_EQ(rows.in_rows(), 27U);
  EXPECT_LE(rows.blocks().size(), 27U + 8 * 6);
  EXPECT_GE(PressedRows::lanes * rows.blocks().size(), pairs);
}

// A row that closes on itself has no end at which to begin.
TEST(PressedRows, FollowARowAroundPeriodicSides) {
  Packing packing{8, 8, {}, {}};
  for (int i = 0; i < 8; ++i) {
    packing.x.push_back(0.5 + i * 3 % 8);
    packing.z.push_back(0.5);
  }
  PressedRows rows;
  rows.find(packing.x, packing.z, 8, 8, 8, neighbour_reach);
  for (std::size_t place = 0; place + 1 < 8; ++place) {
    const double step = packing.x[rows.order()[place + 1]] - packing.x[rows.order()[place]];
    EXPECT_DOUBLE_EQ(step - 8 * std::floor(step / 8), 1) << place;
  }
}

// Every second disk lies a little higher. Right of the lower row's last lie two: one 19 degrees up, one 24 degrees
// down.
TEST(PressedRows, FollowTheMostLevelNeighbour) {
  Packing packing{10, 0, {}, {}};
  for (int r = 0; r < 2; ++r)
    for (int i = 0; i < 8; ++i) {
      packing.x.push_back(0.5 + i + 0.5 * r);
      packing.z.push_back(0.5 + 0.87 * r + (i % 2 == 0 ? 0 : 0.04));
    }
  packing.x.insert(packing.x.end(), {8.5, 8.4});
  packing.z.insert(packing.z.end(), {0.88, 0.14});
  const std::vector<std::uint32_t> expected{17, 0, 1, 2, 3, 4, 5, 6, 7, 16, 8, 9, 10, 11, 12, 13, 14, 15};
  PressedRows rows;
  rows.find(packing.x, packing.z, 18, packing.width, 0, neighbour_reach);
  EXPECT_EQ(rows.order(), expected);
  // The same row from the other side: what is most level to the left.
  for (double& x : packing.x) x = 10 - x;
  rows.find(packing.x, packing.z, 18, packing.width, 0, neighbour_reach);
  const std::vector<std::uint32_t> mirrored{17, 16, 7, 6, 5, 4, 3, 2, 1, 0, 15, 14, 13, 12, 11, 10, 9, 8};
  EXPECT_EQ(rows.order(), mirrored);
}

// The same disks in another order are the same rows.
TEST(PressedRows, DoNotDependOnTheOrderOfTheDisks) {
  const Packing packing = hexagonal(7, 9, 0.05);
  Packing turned = packing;
  std::reverse(turned.x.begin(), turned.x.end());
  std::reverse(turned.z.begin(), turned.z.end());
  PressedRows rows, others;
  rows.find(packing.x, packing.z, 63, packing.width, 0, neighbour_reach);
  others.find(turned.x, turned.z, 63, packing.width, 0, neighbour_reach);
  for (std::size_t place = 0; place < 63; ++place) EXPECT_EQ(others.order()[place], 62 - rows.order()[place]);
}

}  // namespace
}  // namespace shakebed::sim
