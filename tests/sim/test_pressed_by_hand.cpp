// Pressed beds of one disk or two, by pencil: the energy and force of each spring, flights between steps, work of the
// floor, friction on each wall, and what becomes of stretched springs.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "sim/engine/pressed_bed.hpp"

namespace shakebed::sim {
namespace {

constexpr FloorMotion::Motion floor_at_rest{0, 0, 0};
constexpr double lasts = 0.01, inverse_ratio = 2.5;  // contact time; 1/q of spheres
constexpr double pi2 = std::numbers::pi * std::numbers::pi;

// Elastic, 10 D wide and 30 D high. Contacts with walls of mass 1 last pi sqrt(1/k), so k = pi^2/lasts^2; of two disks,
// whose reduced mass is 1/2, half of it.
PressedBed elastic_bed(const std::array<Surface, 4>& surfaces, double inverse_inertia_ratio = 0) {
  PressedBed bed;
  bed.set_up({10, 0, 30}, {surfaces[0], surfaces[1], surfaces[2], surfaces[3]}, inverse_inertia_ratio);
  return bed;
}
PressedBed smooth_bed() { return elastic_bed({Surface{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}); }

struct OnAWall {
  const char* name;
  double x, z;        // of a disk that touches it
  double in_x, in_z;  // into the box
};
constexpr OnAWall walls_of_the_box[] = {
    {"left", 0.5, 15, 1, 0}, {"right", 9.5, 15, -1, 0}, {"floor", 5, 0.5, 0, 1}, {"lid", 5, 29.5, 0, -1}};

TEST(PressedByHand, HasTheEnergyAndTheForceOfEachWall) {
  constexpr double overlap = 2e-3, stiffness = pi2 / (lasts * lasts);
  for (const OnAWall& wall : walls_of_the_box) {
    SCOPED_TRACE(wall.name);
    PressedBed bed = smooth_bed();
    bed.begin({{wall.x - overlap * wall.in_x, wall.z - overlap * wall.in_z, 0, 0}}, floor_at_rest, lasts);
    EXPECT_NEAR(bed.compressed(), 0.5 * stiffness * overlap * overlap, 1e-12);
    int contacts = 0;
    bed.each_wall_contact([&](std::uint32_t disk, bool is_floor, TwoLanes force) {
      ++contacts;
      EXPECT_EQ(disk, 0U);
      EXPECT_EQ(is_floor, wall.name == std::string("floor"));
      EXPECT_NEAR(force[0], stiffness * overlap * wall.in_x, 1e-9);
      EXPECT_NEAR(force[1], stiffness * overlap * wall.in_z, 1e-9);
    });
    EXPECT_EQ(contacts, 1);
    EXPECT_NEAR(bed.floor_force(), wall.in_z > 0 ? stiffness * overlap : 0, 1e-9);
    bed.begin({{wall.x + overlap * wall.in_x, wall.z + overlap * wall.in_z, 0, 0}}, floor_at_rest, lasts);
    EXPECT_EQ(bed.compressed(), 0) << "near it, and not in touch";
  }
}

// The potential is k/8 (1 - r^2)^2, its force k/2 (1 - r^2) r.
TEST(PressedByHand, HasTheEnergyAndTheForceOfAPair) {
  constexpr double distance = 0.99, stiffness = pi2 / (lasts * lasts) / 2, u = 1 - distance * distance;
  PressedBed bed = smooth_bed();
  bed.begin({{4, 15, 0, 0}, {4 + 0.6 * distance, 15 + 0.8 * distance, 0, 0}}, floor_at_rest, lasts);
  EXPECT_NEAR(bed.compressed(), stiffness / 8 * u * u, 1e-12);
  int contacts = 0;
  bed.each_contact([&](TwoLanes, TwoLanes to, TwoLanes force) {
    ++contacts;
    EXPECT_NEAR(force[0], 0.5 * stiffness * u * to[0], 1e-9);
    EXPECT_NEAR(force[1], 0.5 * stiffness * u * to[1], 1e-9);
  });
  EXPECT_EQ(contacts, 1);
}

// Root mean square of the normal velocities of the pairs in contact; a pair that is near does not count.
TEST(PressedByHand, ApproachesByTheMeanOfItsContacts) {
  for (const bool rough : {false, true}) {
    PressedBed bed =
        rough ? elastic_bed({Surface{1, 0.1, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, inverse_ratio) : smooth_bed();
    constexpr double distance = 0.999;
    bed.begin({{2, 15, 0.03, 0.5},
               {2 + distance, 15, 0, 0.5},
               {6, 20, 0, 0.02},
               {6, 20 + distance, 0, -0.02},
               {2, 25, 1, 0},
               {3.05, 25, 0, 0}},
              floor_at_rest, lasts);
    EXPECT_EQ(bed.touching(), 2U) << rough;
    EXPECT_NEAR(bed.approach(), distance * std::sqrt((0.03 * 0.03 + 0.04 * 0.04) / 2), 1e-12) << rough;
  }
}

// Out of each wall, wherever the floor is, by all of the overlap; two disks by 1.6 times theirs, half of it each, also
// across periodic sides. No sweep is made beyond the number asked for, nor once all overlap by no more than is allowed.
TEST(PressedByHand, MovesApartFromEachWallAndFromOneAnother) {
  constexpr double overlap = 2e-3, raised = 0.7;
  for (const OnAWall& wall : walls_of_the_box) {
    SCOPED_TRACE(wall.name);
    const double up = wall.in_z > 0 ? raised : 0;
    for (const int sweeps : {0, 1}) {
      PressedBed bed = smooth_bed();
      bed.begin({{wall.x - overlap * wall.in_x, wall.z + up - overlap * wall.in_z, 0, 0}}, {raised, 0, 0}, lasts);
      bed.separate(raised, 1e-13, sweeps);
      const double left = sweeps > 0 ? 0 : overlap;
      EXPECT_NEAR(bed.at(0, 0).x, wall.x - left * wall.in_x, 1e-14);
      EXPECT_NEAR(bed.at(0, 0).z, wall.z + up - left * wall.in_z, 1e-14);
    }
  }
  for (const double period : {0.0, 10.0}) {
    PressedBed bed;
    const Surface plain{1, 0, 0};
    bed.set_up({10, period, 30}, {plain, plain, plain, plain});
    const double x = period > 0 ? 9.8 : 4;
    bed.begin({{x, 15, 0, 0}, {x + 0.6 * (1 - overlap) - period, 15 + 0.8 * (1 - overlap), 0, 0}}, floor_at_rest,
              lasts);
    bed.separate(0, overlap, 1);
    const double by = 0.8 * overlap;
    EXPECT_NEAR(bed.at(0, 0).x, x - 0.6 * by, 1e-14) << period;
    EXPECT_NEAR(bed.at(0, 0).z, 15 - 0.8 * by, 1e-14) << period;
    EXPECT_NEAR(bed.at(1, 0).x, x - period + 0.6 * (1 - overlap + by), 1e-14) << period;
    EXPECT_NEAR(bed.at(1, 0).z, 15 + 0.8 * (1 - overlap + by), 1e-14) << period;
  }
  // A disk between a wall and another one is moved into the wall, and by the next sweep out of it.
  for (const bool again : {false, true}) {
    PressedBed bed = smooth_bed();
    bed.begin({{0.5, 15, 0, 0}, {1.5 - overlap, 15, 0, 0}}, floor_at_rest, lasts);
    bed.separate(0, (again ? 0.99 : 1.01) * overlap, 2);
    EXPECT_NEAR(bed.at(0, 0).x, 0.5 - (again ? 0.16 : 0.8) * overlap, 1e-14);
    EXPECT_NEAR(bed.at(1, 0).x, 1.5 - (again ? 0.04 : 0.2) * overlap, 1e-14);
  }
}

// One disk flies, the other is pressed on the floor, by more than its weight.
TEST(PressedByHand, FliesOnBetweenSteps) {
  PressedBed bed = smooth_bed();
  bed.begin({{3, 15, 0.2, 0.3}, {6, 0.5 - 1e-4, -0.1, 0}}, floor_at_rest, lasts, {0.4, 0.8});
  for (const double later : {0.0, 0.01, 0.3}) {
    const PressedBed::State free = bed.at(0, later), pressed = bed.at(1, later);
    EXPECT_NEAR(free.x, 3 + 0.2 * later, 1e-14);
    EXPECT_NEAR(free.z, 15 + 0.3 * later - 0.5 * later * later, 1e-14);
    EXPECT_NEAR(free.vx, 0.2, 1e-14);
    EXPECT_NEAR(free.vz, 0.3 - later, 1e-14);
    const double a = pi2 / (lasts * lasts) * 1e-4 - 1;
    EXPECT_NEAR(pressed.z, 0.5 - 1e-4 + 0.5 * a * later * later, 1e-12);
    EXPECT_NEAR(pressed.vz, a * later, 1e-12);
  }
}

// As one body: the floor lifts all of it and gives it its velocity.
TEST(PressedByHand, IsCarriedByItsFloor) {
  PressedBed bed = smooth_bed();
  bed.begin({{3, 0.5, 0.1, 0.2}, {6, 0.5, -0.1, 0}, {8, 0.5, 0, 0}}, floor_at_rest, lasts);
  bed.lie(floor_at_rest);
  bed.carry({0, 0.1, 0.2}, {0.25, 0.6, -0.4});
  EXPECT_NEAR(bed.floor_work(), 3 * (0.25 + 0.5 * (0.36 - 0.01)), 1e-14);
  EXPECT_NEAR(bed.floor_force(), 3 * (1 - 0.4), 1e-14);
  for (const std::uint32_t disk : {0U, 1U, 2U}) {
    EXPECT_NEAR(bed.at(disk, 0).z, 0.75, 1e-14);
    const PressedBed::State later = bed.at(disk, 0.5);
    EXPECT_NEAR(later.z, 0.75 + 0.6 * 0.5 - 0.5 * 0.4 * 0.25, 1e-14);
    EXPECT_NEAR(later.vz, 0.6 - 0.4 * 0.5, 1e-14);
    EXPECT_EQ(later.vx, 0);
  }
}

// The floor's work is all that an elastic disk gains, to the second order of the steps: 2 (v + u) u where it comes with
// v and the floor moves with u, and what it falls meanwhile.
TEST(PressedByHand, GainsWhatAMovingFloorGives) {
  const auto gained_and_missing = [](double step) {
    constexpr double speed = 0.3;
    const auto floor = [](double time) {
      return FloorMotion::Motion{speed * time - 0.2 * time * time, speed - 0.4 * time, -0.4};
    };
    PressedBed bed = smooth_bed();
    bed.begin({{5, 0.52, 0, -1}}, floor(0), lasts);
    const auto energy = [&bed] {
      const PressedBed::State at = bed.at(0, 0);
      return at.z + 0.5 * (at.vx * at.vx + at.vz * at.vz) + bed.compressed();
    };
    const double before = energy();
    double largest = 0;
    for (int k = 0; k < std::lround(0.04 / step); ++k) {
      bed.step(floor(k * step), floor((k + 1) * step), step);
      largest = std::max(largest, std::abs(energy() - before - bed.floor_work()));
    }
    return std::pair(energy() - before, largest);
  };
  const auto [gained, missing] = gained_and_missing(2e-4);
  EXPECT_NEAR(gained, 2 * (1 + 0.3) * 0.3, 0.02);
  EXPECT_LT(missing, 2e-3);
  EXPECT_LT(gained_and_missing(1e-4).second, 0.3 * missing) << "steps of half the length: a quarter";
}

// A rim that slides fast is braked by friction times what presses it, whichever the wall, and spun up by 1/q of that.
TEST(PressedRoughByHand, IsBrakedAndSpunUpByEachWall) {
  constexpr double friction = 0.1, speed = 0.05, slip = 1, step = lasts / PressedBed::steps_of_rough;
  for (const OnAWall& wall : walls_of_the_box) {
    for (const double side : {1.0, -1.0}) {
      SCOPED_TRACE(testing::Message() << wall.name << " " << side);
      const Surface rough{1, friction, 0}, smooth{1, 0, 0};
      std::array<Surface, 4> surfaces{smooth, smooth, smooth, smooth};
      const bool is_side = wall.in_x != 0, is_floor = wall.in_z > 0;
      surfaces[is_side ? 1 : is_floor ? 2 : 3] = rough;
      PressedBed bed = elastic_bed(surfaces, inverse_ratio);
      // The direction in which the inward normal turns clockwise: the contact of a disk that spins with w moves by w/2
      // along it.
      const double along_x = wall.in_z, along_z = -wall.in_x;
      bed.begin({{wall.x + 1e-3 * wall.in_x, wall.z + 1e-3 * wall.in_z, -speed * wall.in_x + side * slip * along_x,
                  -speed * wall.in_z + side * slip * along_z}},
                floor_at_rest, lasts);
      constexpr int count = 60;
      for (int k = 0; k < count; ++k) bed.step(floor_at_rest, floor_at_rest, step);
      const PressedBed::State after = bed.at(0, 0);
      const double fall = count * step;
      const double pushed = after.vx * wall.in_x + (after.vz + fall) * wall.in_z + speed;
      const double along = after.vx * along_x + (after.vz + fall) * along_z - side * slip;
      const double meets = std::sqrt(speed * speed + 2 * 1e-3 * wall.in_z);  // its weight helps or hinders
      EXPECT_NEAR(pushed, 2 * meets + lasts * wall.in_z, 0.05 * speed);
      EXPECT_NEAR(along, -side * friction * pushed, 1e-3 * pushed);
      EXPECT_NEAR(0.5 * bed.spin_at(0, 0), inverse_ratio * along, 1e-12);
      EXPECT_NEAR(bed.damped(), friction * pushed * slip, 0.05 * friction * pushed);
    }
  }
}

// Of five disks in flight, which fill one block of four and begin another: the root of the largest square, and means
// over all. Against a floor that moves, rims included, each eight steps.
TEST(PressedRoughByHand, KnowsHowFastItsDisksAre) {
  constexpr double step = 1e-3;
  constexpr FloorMotion::Motion floor{0, 0.25, 0};
  struct Disk {
    double vx, vz, spin;
  };
  const std::vector<Disk> disks{{0.3, 0.1, 0.2}, {-0.1, -0.2, 1.8}, {0, 0.4, 0}, {0.2, 0, -0.6}, {-0.4, 0.3, 0.4}};
  std::vector<PressedBed::State> states;
  std::vector<double> spins;
  double largest = 0, squares = 0, side_squares = 0;
  for (const Disk& disk : disks) {
    states.push_back({1.5 + 1.7 * static_cast<double>(states.size()), 15, disk.vx, disk.vz});
    spins.push_back(disk.spin);
    const double up = disk.vz - PressedBed::steps_a_check * step - floor.velocity, rim = 0.5 * disk.spin;
    const double square = disk.vx * disk.vx + up * up + rim * rim;
    largest = std::max(largest, square);
    squares += square;
    side_squares += disk.vx * disk.vx;
  }
  PressedBed bed = elastic_bed({Surface{1, 0.1, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}, inverse_ratio);
  bed.begin(states, floor, lasts, spins);
  for (std::uint32_t k = 0; k < PressedBed::steps_a_check; ++k) {
    EXPECT_GT(bed.mean_square_speed(), 1e6) << "not before the check";
    bed.step(floor, floor, step);
  }
  EXPECT_NEAR(bed.fastest(), std::sqrt(largest), 1e-12);
  EXPECT_NEAR(bed.mean_square_speed(), squares / 5, 1e-12);
  EXPECT_NEAR(bed.side_temperature(), side_squares / 5, 1e-12);
}

// Stiffness of a tangential spring: 1/(1 + 1/q) of pi^2 + ln(b)^2 over the contact time squared, b the tangential
// restitution; half of it between two disks. Its energy counts as damped when it is let go.
TEST(PressedRoughByHand, KeepsItsStretchedSpringsUntilTheyAreLetGo) {
  constexpr double overlap = 2e-3;
  const std::array<Surface, 4> surfaces{Surface{1, 0.5, 0.9}, {1, 0.5, 0.8}, {1, 0.5, 0.7}, {1, 0.5, 0.75}};
  const auto stiffness = [&](std::size_t of) {
    return (pi2 + std::pow(std::log(surfaces[of].tangential_restitution), 2)) / (1 + inverse_ratio) / (lasts * lasts);
  };
  PressedBed bed = elastic_bed(surfaces, inverse_ratio);
  const std::vector<PressedBed::State> disks{{0.5 - overlap, 10, 0, 0},
                                             {9.5 + overlap, 12, 0, 0},
                                             {4, 0.5 - overlap, 0, 0},
                                             {6, 29.5 + overlap, 0, 0},
                                             {5, 15, 0, 0},
                                             {6 - overlap, 15, 0, 0}};
  const std::vector<PressedBed::Stretch> given{{0, 6 + PressedBed::at_left, 1e-3},
                                               {1, 6 + PressedBed::at_right, -8e-4},
                                               {2, 6 + PressedBed::at_floor, 6e-4},
                                               {3, 6 + PressedBed::at_lid, 5e-4},
                                               {4, 5, -7e-4}};
  bed.begin(disks, floor_at_rest, lasts, {}, given);
  std::vector<PressedBed::Stretch> kept = bed.stretches();
  for (PressedBed::Stretch& one : kept)
    if (one.disk > one.other) std::swap(one.disk, one.other);
  std::sort(kept.begin(), kept.end(), [](const auto& a, const auto& b) { return a.disk < b.disk; });
  ASSERT_EQ(kept.size(), given.size());
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_EQ(kept[i].disk, given[i].disk);
    EXPECT_EQ(kept[i].other, given[i].other);
    EXPECT_EQ(kept[i].stretch, given[i].stretch);
  }
  const double stretched = 0.5 * (stiffness(1) * (1e-6 + 6.4e-7) + stiffness(2) * 3.6e-7 + stiffness(3) * 2.5e-7 +
                                  0.5 * stiffness(0) * 4.9e-7);
  const double compressed = bed.compressed(), damped = bed.damped();
  bed.let_go();
  EXPECT_NEAR(compressed - bed.compressed(), stretched, 1e-9 * stretched);
  EXPECT_NEAR(bed.damped() - damped, compressed - bed.compressed(), 1e-12);
  EXPECT_TRUE(bed.stretches().empty());
}

}  // namespace
}  // namespace shakebed::sim
