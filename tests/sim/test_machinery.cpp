// The parts that the engine is built of, by themselves: random numbers, lanes, the curve of Hilbert, stretches of
// events.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <queue>
#include <utility>
#include <vector>

#include "sim/engine/event_queue.hpp"
#include "sim/engine/event_stretches.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/policies.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/space_filling_curve.hpp"

namespace shakebed::sim {
namespace {

// The published generators: splitmix64 from 0, and xoshiro256++ from the state {1, 2, 3, 4} (test vectors of
// rand_xoshiro).
TEST(RandomNumbers, AreThoseOfThePublishedGenerators) {
  EXPECT_EQ(Random(0).state(), (std::array<std::uint64_t, 4>{0xe220a8397b1dcdaf, 0x6e789e6aa1b965f4, 0x06c45d188009454f,
                                                             0xf88bb8a8724c81ec}));
  Random random;
  random.set_state({1, 2, 3, 4});
  for (const std::uint64_t bits : {41943041ULL, 58720359ULL, 3588806011781223ULL, 3591011842654386ULL,
                                   9228616714210784205ULL, 9973669472204895162ULL, 14011001112246962877ULL,
                                   12406186145184390807ULL, 15849039046786891736ULL, 10450023813501588000ULL})
    EXPECT_EQ(random.bits(), bits);
}

TEST(RandomNumbers, AreMadeOfTheirBits) {
  const auto after = [](int drawn) {
    Random random;
    random.set_state({1, 2, 3, 4});
    for (int k = 0; k < drawn; ++k) random.bits();
    return random;
  };
  EXPECT_EQ(after(0).uniform(), 20480 * 0x1p-53);  // 41943041 >> 11
  EXPECT_EQ(after(0).uniform_positive(), 20481 * 0x1p-53);
  EXPECT_EQ(after(4).below(1000), 500U);          // 0.50028 of 2^64
  EXPECT_EQ(after(8).below(1'000'000), 859178U);  // 0.859178...
  EXPECT_EQ(after(8).below(1), 0U);
  const auto [first, second] = after(4).normal_pair();
  const double radius = std::sqrt(-2 * std::log(9228616714210784205.0 / 0x1p64)),
               angle = 2 * std::numbers::pi * (9973669472204895162.0 / 0x1p64);
  EXPECT_NEAR(first, radius * std::cos(angle), 1e-14);
  EXPECT_NEAR(second, radius * std::sin(angle), 1e-14);
}

// Equal times keep their order; infinities come last.
template <std::size_t count>
void ranks_are_those_of_a_stable_sort() {
  Random random(count);
  for (int trial = 0; trial < 300; ++trial) {
    alignas(32) std::array<double, count> times;
    alignas(32) std::array<std::int64_t, count> ranks;
    for (double& time : times) time = random.below(8) == 0 ? HUGE_VAL : random.below(trial % 2 == 0 ? 6 : 10'000);
    std::vector<std::size_t> order(count);
    for (std::size_t k = 0; k < count; ++k) order[k] = k;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) { return times[l] < times[r]; });
    rank_times<count>(times.data(), ranks.data());
    for (std::size_t k = 0; k < count; ++k) ASSERT_EQ(ranks[order[k]], static_cast<std::int64_t>(k));
  }
}
TEST(Ranks, AreThoseOfAStableSort) {
  ranks_are_those_of_a_stable_sort<8>();
  ranks_are_those_of_a_stable_sort<16>();
  ranks_are_those_of_a_stable_sort<24>();
  ranks_are_those_of_a_stable_sort<40>();
}

TEST(LanesOfNumbers, DoAsOneNumberDoes) {
  const Lanes a = {1, -2, 3, -4}, b = {4, 3, 2, 1};
  const LaneMask mask = {-1, 0, 0, -1};
  const auto are = [](Lanes found, std::array<double, 4> expected) {
    for (int k = 0; k < 4; ++k) EXPECT_EQ(found[k], expected[static_cast<std::size_t>(k)]) << k;
  };
  are(select(mask, a, b), {1, 3, 2, -4});
  are(unless(mask, a), {0, -2, 3, 0});
  are(larger(a, b), {4, 3, 3, 1});
  are(sqrt_lanes(Lanes{4, 9, 16, 0}), {2, 3, 4, 0});
  are(fused(a, b, all_lanes(0.5)), {4.5, -5.5, 6.5, -3.5});
  are(joined(second_half(a), first_half(b)), {3, -4, 4, 3});
  alignas(32) const std::array<double, 4> stored = {5, 6, 7, 8};
  are(two_pairs(&stored[2], &stored[0]), {7, 8, 5, 6});
  are(four_just_written(stored.data()), {5, 6, 7, 8});
  are(in_lanes<Lanes>(3), {3, 3, 3, 3});
  EXPECT_TRUE(any_of(mask));
  EXPECT_TRUE(any_of(LaneMask{0, 0, -1, 0}));
  EXPECT_FALSE(any_of(LaneMask{}));
  const TwoLanes two = larger(TwoLanes{1, -2}, TwoLanes{0, -1}), kept = unless(TwoMasks{0, -1}, TwoLanes{5, 6});
  EXPECT_TRUE(two[0] == 1 && two[1] == -1 && kept[0] == 5 && kept[1] == 0);
  const TwoLanes negative = not_above_zero(TwoLanes{-3, 3});
  EXPECT_TRUE(negative[0] == -3 && negative[1] == 0);
  EXPECT_EQ(not_above_zero(-3.0), -3);
  EXPECT_EQ(not_above_zero(3.0), 0);
  const TwoLanes once = fused(TwoLanes{2, 3}, TwoLanes{5, 7}, TwoLanes{1, -1});
  EXPECT_TRUE(once[0] == 11 && once[1] == 20);
  EXPECT_EQ(fused(1 + 0x1p-30, 1 - 0x1p-30, -1.0), -0x1p-60) << "rounded once";
  EXPECT_EQ(choose(true, 7, -8), 7);
  EXPECT_EQ(choose(false, 7, -8), -8);
}

TEST(LanesOfWords, DoAsOneWordDoes) {
  const std::array<std::uint32_t, 8> words = {3, 1, 4, 1, 5, 9, 2, 6}, among = {9, 9, 1, 7, 7, 7, 7, 6};
  EXPECT_EQ(equal_words(words.data(), 1), 0b1010U);
  EXPECT_EQ(equal_words(words.data(), 6), 0b10000000U);
  EXPECT_EQ(equal_among_four(words.data(), 1), 0b1010U);
  EXPECT_EQ(equal_among_four(words.data(), 5), 0U);
  EXPECT_EQ(words_among(words.data(), among.data()), 0b10101010U);
  EXPECT_EQ(bits_of(WordLanes{-1, 0, 0, -1, 0, 0, -1, 0}), 0b01001001U);
  const std::array<float, 8> floats = {8, 7, 6, 5, 4, 3, 2, 1};
  std::array<std::uint32_t, 8> words_out{};
  std::array<float, 8> floats_out{};
  const WordLanes mask = {0, -1, 0, 0, -1, -1, 0, -1};
  EXPECT_EQ(compress(mask, eight_words(words.data()), eight_floats(floats.data()), words_out.data(), floats_out.data()),
            4U);
  EXPECT_TRUE((std::equal(words_out.begin(), words_out.begin() + 4, std::array<std::uint32_t, 4>{1, 5, 9, 6}.begin())));
  EXPECT_TRUE((std::equal(floats_out.begin(), floats_out.begin() + 4, std::array<float, 4>{7, 4, 3, 1}.begin())));
  const FloatLanes mixed = select(mask, all_floats(1), eight_floats(floats.data()));
  const WordLanes chosen = select(mask, all_words(0), eight_words(words.data()));
  for (int k = 0; k < 8; ++k) {
    EXPECT_EQ(mixed[k], mask[k] != 0 ? 1 : static_cast<float>(8 - k));
    EXPECT_EQ(chosen[k], mask[k] != 0 ? 0 : static_cast<std::int32_t>(words[static_cast<std::size_t>(k)]));
  }
  for (int place = 0; place < 8; ++place) {
    FloatLanes lanes = eight_floats(floats.data());
    lanes[place] = 0.5f;
    EXPECT_EQ(smallest_of(lanes), 0.5f);
  }
  EXPECT_EQ(smaller(all_floats(2), all_floats(3))[5], 2);
  EXPECT_EQ(sqrt_floats(all_floats(9))[7], 3);
  EXPECT_EQ(fused(all_floats(2), all_floats(3), all_floats(4))[3], 10);
  const std::array<std::uint16_t, 4> halves = {upper_half(1), upper_half(2), upper_half(-1), upper_half(0.75f)},
                                     others = {upper_half(4), upper_half(8), upper_half(16), upper_half(32)};
  const FloatLanes whole = four_and_four(halves.data(), others.data());
  const std::array<float, 8> expected = {1, 2, -1, 0.75f, 4, 8, 16, 32};
  for (int k = 0; k < 8; ++k) EXPECT_EQ(whole[k], expected[static_cast<std::size_t>(k)]);
  EXPECT_EQ(four_and_four(&floats[4], &floats[0])[1], 3);
  EXPECT_EQ(four_and_four(&floats[4], &floats[0])[6], 6);
  EXPECT_EQ(four_and_four(&words[4], &words[0])[0], 5);
  EXPECT_EQ(four_and_four(&words[4], &words[0])[7], 1);
}

// Of equal times the first one's id.
TEST(LanesOfTimes, KnowTheEarliest) {
  const std::array<std::uint32_t, 8> ids = {10, 11, 12, 13, 14, 15, 16, 17};
  Random random(2);
  for (int trial = 0; trial < 500; ++trial) {
    std::array<double, 8> times;
    for (double& time : times) time = random.below(5);
    const auto of = [&](std::size_t count) {
      const auto least = std::min_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(count));
      return std::pair(*least, static_cast<std::int32_t>(10 + (least - times.begin())));
    };
    const Earliest four = earliest_of_four(Lanes{times[0], times[1], times[2], times[3]}, ids.data());
    const Earliest eight = earliest_of_eight(Lanes{times[0], times[1], times[4], times[5]},
                                             Lanes{times[2], times[3], times[6], times[7]}, ids.data());
    ASSERT_EQ(std::pair(four.time, four.id), of(4));
    ASSERT_EQ(std::pair(eight.time, eight.id), of(8));
  }
}

TEST(PeriodOfABox, FindsTheNearestImage) {
  const Period period(7.5), none;
  for (const double d : {0.0, 3.7, 3.8, -3.7, -3.8, 7.5, 11.2, -18.0}) {
    const double nearest = std::remainder(d, 7.5);
    EXPECT_NEAR(period.nearest(d), nearest, 1e-14) << d;
    EXPECT_NEAR(period.nearest(all_lanes(d))[2], nearest, 1e-14);
    EXPECT_NEAR(period.nearest(all_floats(static_cast<float>(d)))[6], nearest, 1e-5);
    EXPECT_NEAR(Period::to_nearest(period, none, both(d))[0], nearest - d, 1e-14);
    EXPECT_EQ(Period::to_nearest(period, none, both(d))[1], 0);
    EXPECT_EQ(none.nearest(d), d);
    EXPECT_NEAR(period.wrapped(d), d - 7.5 * std::floor(d / 7.5), 1e-14);
    EXPECT_EQ(period.beyond(d), 7.5 * std::floor(d / 7.5));
  }
}

// The curve passes once through every cell of its square and goes from one to a neighbour.
TEST(HilbertCurve, GoesFromCellToNeighbour) {
  std::vector<std::pair<int, int>> cells(64 * 64, {-1, -1});
  for (int column = 0; column < 64; ++column) {
    for (int row = 0; row < 64; ++row) {
      const std::uint32_t place = hilbert_place(static_cast<std::uint32_t>(column), static_cast<std::uint32_t>(row));
      ASSERT_LT(place, cells.size());
      ASSERT_EQ(cells[place].first, -1) << "twice";
      cells[place] = {column, row};
    }
  }
  for (std::size_t k = 1; k < cells.size(); ++k)
    ASSERT_EQ(std::abs(cells[k].first - cells[k - 1].first) + std::abs(cells[k].second - cells[k - 1].second), 1) << k;
  EXPECT_EQ(hilbert_cell(0), 16U);
  EXPECT_EQ(hilbert_cell(-15.5), 0U);
  EXPECT_EQ(hilbert_cell(-100), 0U);
  EXPECT_EQ(hilbert_cell(2.9), 18U);
  EXPECT_EQ(hilbert_cell(1e9), 65535U);
  EXPECT_EQ(place_of_hilbert_cell(18), 2);
}

// Each stretch gives back what was put in, in its order, across pages of 256 entries, and forgets it.
TEST(StretchesOfEvents, GiveBackWhatTheyHold) {
  constexpr std::size_t count = 5;
  EventStretches stretches;
  stretches.reset(count);
  std::array<std::vector<double>, count> expected;
  Random random(9);
  double number = 0;
  const auto take = [&](std::size_t stretch) {
    std::vector<double> found;
    stretches.take(stretch, [&](const EventEntry& entry) {
      found.push_back(entry.time);
      EXPECT_EQ(entry.first(), static_cast<std::uint32_t>(entry.time));
      EXPECT_EQ(entry.second(), static_cast<std::uint32_t>(entry.time) + 7);
    });
    ASSERT_EQ(found, expected[stretch]);
    expected[stretch].clear();
  };
  for (const std::size_t size : {0UL, 1UL, 255UL, 256UL, 257UL, 512UL, 1000UL}) {
    for (std::size_t k = 0; k < size * count; ++k) {
      const std::size_t stretch = size < 2 ? k % count : random.below(count);
      number += 1;
      stretches.append(stretch,
                       {number, pair_of(static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(number) + 7)});
      expected[stretch].push_back(number);
    }
    for (std::size_t stretch = 0; stretch < count; ++stretch)
      if (random.below(3) != 0) take(stretch);
  }
  for (const std::size_t exactly : {256UL, 512UL}) {
    take(2);
    for (std::size_t k = 0; k < exactly; ++k) {
      number += 1;
      stretches.append(2,
                       {number, pair_of(static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(number) + 7)});
      expected[2].push_back(number);
    }
    take(2);
  }
  for (std::size_t stretch = 0; stretch < count; ++stretch) take(stretch);
  take(0);
}

struct Ready {
  void settle() {}
  bool waits_for(double, std::uint32_t, std::uint32_t) const { return false; }
};

// A queue for a window of time holds what comes before its end, in order, and knows what comes up.
TEST(QueueOfAWindow, HasTheOrderOfAHeap) {
  constexpr std::uint32_t count = 400;
  std::vector<Disk> disks(count + 1);
  EventQueue queue;
  Ready owner;
  Random random(4);
  double start = 3;
  for (const double length : {0.5, 2.0, 0.01, 1.0}) {
    const double end = start + length;
    queue.begin_window(disks.data(), count, start, end, length < 0.1 ? 5000 : 40);
    using Event = std::pair<double, std::uint32_t>;
    std::priority_queue<Event, std::vector<Event>, std::greater<>> heap;
    const auto draw = [&](std::uint32_t i, double now) {
      disks[i].event_time = now + (random.below(4) == 0 ? 0.02 : 0.9) * length * random.uniform();
      disks[i].partner = shell_exit;
      if (disks[i].event_time >= end) return;  // the window's owner keeps it for later
      queue.push(disks[i].event_time, i, i);
      heap.emplace(disks[i].event_time, i);
    };
    for (std::uint32_t i = 0; i < count; ++i) disks[i].event_time = never;
    for (std::uint32_t i = 0; i < count; ++i) draw(i, start);
    std::uint32_t disk = 0, with = 0;
    std::size_t events = 0;
    for (;; ++events) {
      while (!heap.empty() && heap.top().first != disks[heap.top().second].event_time) heap.pop();
      if (heap.empty()) break;
      ASSERT_TRUE(queue.pop(end, disk, with, owner));
      ASSERT_EQ(disk, heap.top().second) << events;
      ASSERT_EQ(with, disk);
      const double now = heap.top().first;
      heap.pop();
      std::uint32_t a = 0, b = 0;
      if (!heap.empty() && heap.top().first == disks[heap.top().second].event_time && queue.upcoming(1, a, b)) {
        EXPECT_EQ(a, b);
      }
      disks[disk].event_time = never;
      draw(disk, now);
      if (random.below(2) == 0) draw(random.below(count), now);
    }
    EXPECT_GT(events, count);
    EXPECT_FALSE(queue.pop(end, disk, with, owner));
    start = end;
  }
  queue.begin_window(disks.data(), count, start, start, 0);
  std::uint32_t disk = 0, with = 0;
  EXPECT_FALSE(queue.pop(start, disk, with, owner)) << "a window without a length";
}

}  // namespace
}  // namespace shakebed::sim
