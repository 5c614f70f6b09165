#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "sim/event_queue.hpp"
#include "sim/random.hpp"

namespace shakebed::sim {
namespace {

// Disks whose next events are drawn at random, most of them soon, some far off, now and then one again before its turn:
// against a heap that knows every event ever drawn. Up to 8,000, up to 200,000 disks and beyond the queue works
// differently.
class EventQueueOrder : public testing::TestWithParam<std::uint32_t> {};

TEST_P(EventQueueOrder, IsThatOfAHeap) {
  const std::uint32_t count = GetParam();
  Random random(20261122 + count);
  std::vector<Disk> disks(count + 1);
  using Event = std::pair<double, std::uint32_t>;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> heap;
  EventQueue queue;
  const auto draw = [&](std::uint32_t i, double now) {
    const double mean = random.below(100) == 0 ? 7 : 1;
    disks[i].event_time = now - mean * std::log(random.uniform_positive());
    disks[i].partner = shell_exit;
    queue.push(disks[i].event_time, i, i);
    heap.emplace(disks[i].event_time, i);
  };
  for (Disk& disk : disks) disk.event_time = never;
  queue.reset(disks.data(), count, 0, count);
  for (std::uint32_t i = 0; i < count; ++i) draw(i, 0);

  const std::uint64_t events = 4 * std::uint64_t{count} + 20'000;
  for (std::uint64_t k = 0; k < events; ++k) {
    while (heap.top().first != disks[heap.top().second].event_time) heap.pop();
    std::uint32_t disk = 0, with = 0;
    ASSERT_TRUE(queue.pop(never, disk, with));
    ASSERT_EQ(disk, heap.top().second) << "event " << k;
    ASSERT_EQ(with, disk);
    const double now = heap.top().first;
    heap.pop();
    draw(disk, now);
    if (random.below(2) == 0) draw(random.below(count), now);  // what it was to do before is forgotten
  }
  // Nothing is handed out before its time, and nothing is lost by asking.
  while (heap.top().first != disks[heap.top().second].event_time) heap.pop();
  std::uint32_t disk = 0, with = 0;
  EXPECT_FALSE(queue.pop(std::nextafter(heap.top().first, 0.0), disk, with));
  ASSERT_TRUE(queue.pop(heap.top().first, disk, with));
  EXPECT_EQ(disk, heap.top().second);
}

INSTANTIATE_TEST_SUITE_P(Disks, EventQueueOrder, testing::Values(3, 500, 20'000, 250'000));

// A pair's common event is written down once and handed out once; where both have something else by then, not at all.
TEST(EventQueue, ForgetsAPairOfWhichBothHaveSomethingElse) {
  std::vector<Disk> disks(5);
  EventQueue queue;
  queue.reset(disks.data(), 4, 0, 10);
  const auto meet = [&](std::uint32_t a, std::uint32_t b, double time) {
    disks[a].event_time = disks[b].event_time = time;
    disks[a].partner = static_cast<std::int32_t>(b);
    disks[b].partner = static_cast<std::int32_t>(a);
    queue.push(time, a, b);
  };
  meet(0, 1, 0.3);
  meet(2, 3, 0.4);
  meet(1, 2, 0.2);  // 0 and 3 do not know it yet
  std::uint32_t disk = 0, with = 0;
  ASSERT_TRUE(queue.pop(never, disk, with));
  EXPECT_EQ(disk + with, 3u);
  EXPECT_EQ(disk * with, 2u);
  disks[1].event_time = disks[2].event_time = never;
  ASSERT_TRUE(queue.pop(never, disk, with));
  EXPECT_EQ(disk, 0u);
  EXPECT_EQ(with, 1u);
  disks[0].event_time = disks[3].event_time = never;
  EXPECT_FALSE(queue.pop(100, disk, with));
}

}  // namespace
}  // namespace shakebed::sim
