// What tiles are made of: their borders, and the log by which disks are followed back through their contacts.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <vector>

#include "sim/engine/large_vector.hpp"
#include "sim/engine/tiles.hpp"

namespace shakebed::sim {
namespace {

Disk disk_that_is_at(double x, double z) {
  Disk disk{};
  disk.x = x, disk.z = z;
  disk.shell_x = static_cast<float>(x), disk.shell_z = static_cast<float>(z);
  return disk;
}

TEST(TileParts, HoldWhatIsFarEnoughFromTheirBorder) {
  const Tile tile{0, 9, 50, 30, 20, 10};
  for (const double side : {1.0, -1.0}) {
    EXPECT_TRUE(tile.holds(disk_that_is_at(50 + side * 17.9, 30), 2));
    EXPECT_FALSE(tile.holds(disk_that_is_at(50 + side * 18.1, 30), 2));
    EXPECT_TRUE(tile.holds(disk_that_is_at(50, 30 + side * 7.9), 2));
    EXPECT_FALSE(tile.holds(disk_that_is_at(50, 30 + side * 8.1), 2));
  }
  EXPECT_TRUE(tile.holds(disk_that_is_at(69.9, 30), 0));
}

// In a box of 200 by 150 tiles of 128 that begin at -16 have their borders at 112: those of the box cut them down.
TEST(TileParts, AreThoseOfTheBox) {
  const Period x(200), z(150);
  const std::vector<Disk> disks = {disk_that_is_at(5, 7),     disk_that_is_at(111.9, 111.9), disk_that_is_at(112.1, 7),
                                   disk_that_is_at(-1, 1),    disk_that_is_at(199, 113),     disk_that_is_at(3, 112.1),
                                   disk_that_is_at(203, 149), disk_that_is_at(20, 20)};
  const std::vector<Tile> tiles = tiles_of(disks.data(), 8, x, z);
  ASSERT_EQ(tiles.size(), 5U);
  const std::array<std::array<double, 6>, 5> expected = {{{0, 2, 56, 56, 56, 56},
                                                          {2, 4, 156, 56, 44, 56},
                                                          {4, 5, 156, 131, 44, 19},
                                                          {5, 7, 56, 131, 56, 19},
                                                          {7, 8, 56, 56, 56, 56}}};
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    const Tile& tile = tiles[k];
    EXPECT_EQ((std::array<double, 6>{static_cast<double>(tile.begin), static_cast<double>(tile.end), tile.x, tile.z,
                                     tile.half_width, tile.half_height}),
              expected[k])
        << k;
  }
  EXPECT_TRUE(tiles_of(disks.data(), 0, x, z).empty());
}

// Disk 0 meets 1 at time 11 and 2 at time 12.5; each contact gives momentum to its first disk and takes it from its
// second. Followed back it is at its places before, with its velocities before.
TEST(TileParts, FollowADiskBackThroughItsContacts) {
  ContactLog log;
  log.begin(10, 3);
  EXPECT_EQ(log.start(), 10);
  EXPECT_FALSE(log.is_in_window(log.last_of(0)));
  log.add(11, 0, 1, TwoLanes{3, -1});
  const std::uint32_t first = log.last_of(0);
  log.add(12.5, 2, 0, TwoLanes{4, 2});
  const std::uint32_t second = log.last_of(0);
  EXPECT_TRUE(log.is_in_window(first) && log.is_in_window(second));
  EXPECT_EQ(second, first + 1);
  EXPECT_EQ(log.last_of(1), first);
  EXPECT_EQ(log.last_of(2), second);
  EXPECT_EQ(log[second].time, 12.5);
  EXPECT_EQ(log[second].before[1], first);
  Disk disk = disk_that_is_at(7, 9);
  disk.vx = 1, disk.vz = 2, disk.own_time = 12.5;
  ContactLog::Flight flight = log.flight_of(0, disk);
  EXPECT_EQ(flight.began, 12.5);
  EXPECT_EQ(flight.with, second);
  EXPECT_TRUE(flight.place[0] == 7 && flight.place[1] == 9 && flight.velocity[0] == 1 && flight.velocity[1] == 2);
  log.step_back(flight, 0, 2);  // 4 and 2 were taken from it: with mass 2 it had 2 and 1 more
  EXPECT_EQ(flight.velocity[0], 3);
  EXPECT_EQ(flight.velocity[1], 3);
  EXPECT_EQ(flight.began, 11);
  EXPECT_EQ(flight.place[0], 7 - 3 * 1.5);
  EXPECT_EQ(flight.place[1], 9 - 3 * 1.5);
  EXPECT_EQ(flight.with, first);
  log.step_back(flight, 0, 2);  // 3 and -1 had been given to it
  EXPECT_EQ(flight.velocity[0], 1.5);
  EXPECT_EQ(flight.velocity[1], 3.5);
  EXPECT_EQ(flight.began, 10) << "the start of the window";
  EXPECT_EQ(flight.place[0], 2.5 - 1.5);
  EXPECT_EQ(flight.place[1], 4.5 - 3.5);
  EXPECT_FALSE(log.is_in_window(flight.with));
}

// A window begins without contacts; those of the one before are older. The log grows beyond its first 1024.
TEST(TileParts, ForgetTheWindowBefore) {
  ContactLog log;
  log.begin(0, 2);
  for (int k = 0; k < 3000; ++k) log.add(k, 0, 1, TwoLanes{k * 1.0, 0});
  const std::uint32_t last = log.last_of(1);
  for (std::uint32_t k = 0; k < 3000; ++k) ASSERT_EQ(log[last - k].momentum[0], 2999.0 - k);
  log.begin(5000, 2);
  EXPECT_FALSE(log.is_in_window(last));
  EXPECT_EQ(log.last_of(1), last) << "still its last";
  log.add(5001, 0, 1, TwoLanes{1, 1});
  EXPECT_TRUE(log.is_in_window(log.last_of(0)));
  EXPECT_EQ(log[log.last_of(0)].before[0], last);
  log.set_last(0, last);
  EXPECT_EQ(log.last_of(0), last);
  log.begin(6000, 5);
  EXPECT_FALSE(log.is_in_window(log.last_of(4)));
  EXPECT_GE(log.bytes(), 3000 * sizeof(ContactLog::Contact));
}

// Two megabytes and more begin at a large page, less at a line of the cache.
TEST(LargeVectors, BeginAtPages) {
  const auto beyond = [](const auto& vector, std::uintptr_t page) {
    return reinterpret_cast<std::uintptr_t>(vector.data()) % page;
  };
  for (const std::size_t count : {1UL, 100UL, 262143UL, 262144UL, 262145UL, 1000000UL}) {
    LargeVector<double> numbers(count, 1.5);
    EXPECT_EQ(beyond(numbers, count >= 262144 ? std::uintptr_t{2} << 20 : 64), 0U) << count;
    numbers.push_back(2.5);
    EXPECT_EQ(numbers.front() + numbers.back(), 4);
  }
}

}  // namespace
}  // namespace shakebed::sim
