// Values by their rank, against a sorted list.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "statistics/ranks.hpp"

namespace shakebed {
namespace {

TEST(Ranks, AreThoseOfASortedList) {
  std::vector<double> values{7, -2, 5, 5, 11, 0, 3}, sorted{-2, 0, 3, 5, 5, 7, 11};
  for (const std::size_t count : {7U, 6U, 1U}) {
    values.resize(count), sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (int part = 0; part <= 10; ++part) {
      const auto place = static_cast<std::size_t>(part * static_cast<int>(count - 1) / 10);
      EXPECT_EQ(quantile_of(values, part / 10.0), sorted[place]) << count << " " << part;
    }
    EXPECT_EQ(median_of(values), sorted[count / 2]) << "of an even number the upper one";
  }
  // Values whose middle in the list is none of those in the middle by size.
  for (const auto& list : {std::vector<double>{1, 2, 9, 3, 4}, {5, 1, 2, 9, 3, 4}, {4, 3, 0, 1, 2, 5, 6}, {8, 7}}) {
    sorted = list;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(median_of(list), sorted[list.size() / 2]);
    EXPECT_EQ(quantile_of(list, 0.5), sorted[(list.size() - 1) / 2]) << "of an even number the lower one";
  }
  EXPECT_EQ(quantile_of(std::vector<float>{}, 0.5), 0);
  EXPECT_EQ(median_of(std::vector<int>{}), 0);
}

TEST(Ranks, OfManyFloatsAreThoseOfASortedList) {
  std::mt19937 random(1);
  for (const float scale : {1e-30F, 3.0F, 1e20F}) {
    std::vector<float> values;
    for (int k = 0; k < 10'000; ++k)
      values.push_back(scale * (k % 2 != 0 ? static_cast<float>(random() % 50) - 20 : std::ldexp(1.0F, k % 20)));
    std::vector<float> sorted = values;
    std::sort(sorted.begin(), sorted.end());
    for (const std::size_t place : {0U, 1U, 4'000U, 5'000U, 7'777U, 9'999U})
      EXPECT_EQ(value_of_rank(values, place), sorted[place]) << scale << " " << place;
    EXPECT_EQ(median_of(values), sorted[5'000]);
    EXPECT_EQ(quantile_of(values, 0.3), sorted[2'999]);
  }
}

}  // namespace
}  // namespace shakebed
