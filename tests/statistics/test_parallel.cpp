#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "statistics/parallel.hpp"

namespace shakebed {
namespace {

TEST(ForEachIndex, CallsEveryIndexOnce) {
  for (const int threads : {0, 1, 2, 7}) {
    std::vector<std::atomic<int>> calls(100);
    for_each_index(calls.size(), threads, [&](std::size_t i) { ++calls[i]; });
    for (const auto& count : calls) EXPECT_EQ(count, 1) << threads;
  }
  for_each_index(0, 4, [](std::size_t) { FAIL(); });
}

TEST(ForEachIndex, OneThreadGoesInOrder) {
  std::vector<std::size_t> order;
  for_each_index(5, 1, [&](std::size_t i) { order.push_back(i); });
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
}

TEST(ForEachIndex, UsesNoMoreThreadsThanAsked) {
  std::mutex mutex;
  std::set<std::thread::id> seen;
  for_each_index(30, 2, [&](std::size_t) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // time for others to begin, if there are any
    const std::lock_guard lock(mutex);
    seen.insert(std::this_thread::get_id());
  });
  EXPECT_LE(seen.size(), 2u);
}

TEST(ForEachIndex, ThrowsTheFirstFailureAndBeginsNothingAfterIt) {
  std::atomic<int> begun{0};
  const auto work = [&](std::size_t i) {
    ++begun;
    if (i >= 2) throw std::runtime_error(std::to_string(i));
  };
  try {
    for_each_index(1000, 1, work);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "2");
  }
  EXPECT_EQ(begun, 3);
  begun = 0;
  // Each of four threads fails at the latest with its third call.
  EXPECT_THROW(for_each_index(1000, 4, work), std::runtime_error);
  EXPECT_LE(begun, 2 + 4);
}

}  // namespace
}  // namespace shakebed
