#include <gtest/gtest.h>

#include <string>

#include "statistics/text.hpp"

namespace shakebed {
namespace {

TEST(Text, SentencesOfAnyLengthAreWrittenWhole) {
  EXPECT_EQ(formatted("%s is %g; it must be %d or more", "settle", 0.25, 3), "settle is 0.25; it must be 3 or more");
  EXPECT_EQ(formatted("%s", ""), "");
  EXPECT_EQ(formatted("%d", 7), "7");
  const std::string long_name(1000, 'x');
  EXPECT_EQ(formatted("<%s>", long_name.c_str()), "<" + long_name + ">");
}

}  // namespace
}  // namespace shakebed
