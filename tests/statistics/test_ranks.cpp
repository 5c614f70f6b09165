// Values by their rank, against a sorted list.
#include <gtest/gtest.h>

#include <algorithm>
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

}  // namespace
}  // namespace shakebed
