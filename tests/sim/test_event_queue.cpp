#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <queue>
#include <utility>
#include <vector>

#include "sim/engine/event_queue.hpp"
#include "sim/engine/random.hpp"

namespace shakebed::sim {
namespace {

// An owner that writes every event down at once.
struct Prompt {
  void settle() {}
  bool waits_for(double, std::uint32_t, std::uint32_t) const { return false; }
};

// Disks whose next events are drawn at random, most of them soon, some far off, now and then one again before its turn.
// The latest one that was drawn is written down when the queue asks for that.
struct Drawn {
  explicit Drawn(std::uint32_t count) : random(20261122 + count), times(count), disks(count + 1) {
    for (Disk& disk : disks) disk.event_time = never;
    queue.reset(disks.data(), count, 0, count);
  }
  void draw(std::uint32_t i, double now) {
    settle();
    const double mean = random.below(100) == 0 ? 7 : 1;
    times[i] = now - mean * std::log(random.uniform_positive());
    pending = i;
  }
  void settle() {
    if (pending == nothing) return;
    disks[pending].event_time = times[pending];
    disks[pending].partner = shell_exit;
    queue.push(times[pending], pending, pending);
    pending = nothing;
  }
  bool waits_for(double time, std::uint32_t i, std::uint32_t k) const {
    return pending != nothing && (i == pending || k == pending || !(time < times[pending]));
  }

  static constexpr std::uint32_t nothing = 0xffffffff;
  Random random;
  std::vector<double> times;  // when each disk's next event is due, written down or not
  std::vector<Disk> disks;
  EventQueue queue;
  std::uint32_t pending = nothing;
};

// Against a heap that knows every event ever drawn. Up to 8,000, up to 200,000 disks and beyond the queue works
// differently.
class EventQueueOrder : public testing::TestWithParam<std::uint32_t> {};

TEST_P(EventQueueOrder, IsThatOfAHeap) {
  const std::uint32_t count = GetParam();
  Drawn drawn(count);
  using Event = std::pair<double, std::uint32_t>;
  std::priority_queue<Event, std::vector<Event>, std::greater<>> heap;
  const auto draw = [&](std::uint32_t i, double now) {
    drawn.draw(i, now);
    heap.emplace(drawn.times[i], i);
  };
  for (std::uint32_t i = 0; i < count; ++i) draw(i, 0);

  const std::uint64_t events = 4 * std::uint64_t{count} + 20'000;
  for (std::uint64_t k = 0; k < events; ++k) {
    while (heap.top().first != drawn.times[heap.top().second]) heap.pop();
    std::uint32_t disk = 0, with = 0;
    ASSERT_TRUE(drawn.queue.pop(never, disk, with, drawn));
    ASSERT_EQ(disk, heap.top().second) << "event " << k;
    ASSERT_EQ(with, disk);
    const double now = heap.top().first;
    heap.pop();
    draw(disk, now);
    if (drawn.random.below(2) == 0) draw(drawn.random.below(count), now);  // what it was to do before is forgotten
  }
  // Nothing is handed out before its time, and nothing is lost by asking.
  while (heap.top().first != drawn.times[heap.top().second]) heap.pop();
  std::uint32_t disk = 0, with = 0;
  EXPECT_FALSE(drawn.queue.pop(std::nextafter(heap.top().first, 0.0), disk, with, drawn));
  ASSERT_TRUE(drawn.queue.pop(heap.top().first, disk, with, drawn));
  EXPECT_EQ(disk, heap.top().second);
}

INSTANTIATE_TEST_SUITE_P(Disks, EventQueueOrder, testing::Values(3, 500, 20'000, 250'000));

// A pair's common event is written down once and handed out once; who has been left by the other has its turn still,
// and where both have something else by then nobody has. All in one bucket, and each in its own.
TEST(EventQueue, KnowsWhoOfAPairHasSomethingElse) {
  for (const double scale : {1.0, 40.0}) {
    std::vector<Disk> disks(7);
    EventQueue queue;
    Prompt owner;
    queue.reset(disks.data(), 6, 0, 10);
    const auto meet = [&](std::uint32_t a, std::uint32_t b, double time) {
      disks[a].event_time = disks[b].event_time = time * scale;
      disks[a].partner = static_cast<std::int32_t>(b);
      disks[b].partner = static_cast<std::int32_t>(a);
      queue.push(time * scale, a, b);
    };
    std::uint32_t disk = 0, with = 0;
    const auto next_is = [&](std::uint32_t a, std::uint32_t b, double time) {
      ASSERT_TRUE(queue.pop(never, disk, with, owner));
      EXPECT_EQ(disk, a);
      EXPECT_EQ(with, b);
      EXPECT_EQ(disks[disk].event_time, time * scale);
    };
    meet(4, 5, 0.5);
    meet(0, 1, 0.3);
    meet(2, 3, 0.4);
    meet(1, 2, 0.2);  // 0 and 3 do not know it yet
    meet(4, 0, 0.1);  // and now 0 has something else, too; 5 does not know it yet
    next_is(4, 0, 0.1);
    disks[4].event_time = disks[0].event_time = never;
    next_is(1, 2, 0.2);
    disks[1].event_time = disks[2].event_time = never;
    next_is(3, 2, 0.4);
    disks[3].event_time = never;
    next_is(5, 4, 0.5);
    disks[5].event_time = never;
    EXPECT_FALSE(queue.pop(1000, disk, with, owner));
  }
}

}  // namespace
}  // namespace shakebed::sim
