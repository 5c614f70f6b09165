// What the contact duration withholds from dissipation, against a bed for pencil and paper and against the temperature.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/engine/simulation.hpp"
#include "sim/measure/contact_duration.hpp"
#include "tests/sim/snapshot_of.hpp"

namespace shakebed::sim {
namespace {

// A disk that falls from 2 D hits the floor with v = 2, again with e v; the second contact comes before t_c is over.
TEST(ContactDurationEffect, OfABouncingDiskIsItsSecondContactsEnergy) {
  constexpr double e = 0.8;
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.disks.contact_duration = 10;
  scene.box.width = 4;
  scene.box.floor_surface.restitution = e;
  scene.rests = false;
  scene.start = PlacedStart{{{2, 0.5 + 2, 0, 0, 0, 0}}};
  const auto simulation = simulate(scene);
  simulation->advance_to(2 + 2 * e * 2 - 0.01);  // before the second contact
  const Counters before = simulation->counters();
  EXPECT_EQ(before.elastic_contacts, 0u);
  EXPECT_EQ(before.withheld, 0);
  const double lost = 0.5 * (1 - e * e) * 4;
  EXPECT_NEAR(simulation->energy().dissipated, lost, 1e-12);
  simulation->advance_to(2 + 2 * e * 2 + 0.01);
  const Counters after = simulation->counters();
  EXPECT_EQ(after.elastic_contacts, 1u);
  EXPECT_NEAR(after.withheld, 0.5 * (1 - e * e) * e * e * 4, 1e-12);
  const ContactDurationEffect effect = contact_duration_effect({}, after, simulation->energy().dissipated);
  EXPECT_NEAR(effect.elastic_share, 0.5, 1e-15);
  EXPECT_NEAR(effect.withheld_share, e * e, 1e-12);
  EXPECT_EQ(contact_duration_effect(after, after, 0).withheld_share, 0);
  EXPECT_EQ(contact_duration_effect(before, after, 0).withheld_share, 1) << "its only contact was elastic";
  // The third contact keeps the same energy again.
  simulation->advance_to(2 + 4 * e * 2 + 0.01);
  EXPECT_EQ(simulation->counters().elastic_contacts, 2u);
  EXPECT_EQ(simulation->counters().withheld, after.withheld);
}

// Two disks meet at time 4; they part with -0.75 and -0.25. The first turns at the wall at 10 and meets the second
// again at 13, with an approach of 1, while the clocks run.
TEST(ContactDurationEffect, CountsTheReducedMassOfTwoDisks) {
  constexpr double e = 0.5;
  Scene scene;
  scene.disks.species = {{2, 1, 1}};
  scene.disks.contact.restitution = e;
  scene.disks.contact_duration = 100;
  scene.box.width = 20;
  scene.box.sides = HardSides{};
  scene.box.top = Lid{10, {}};
  scene.start = PlacedStart{{{5, 5, 0, 0, 0, 0}, {10, 5, -1, 0, 0, 0}}};
  const auto simulation = simulate(scene);
  simulation->advance_to(40);
  const Counters counters = simulation->counters();
  ASSERT_EQ(counters.disk_collisions, 2u);
  EXPECT_NEAR(counters.withheld, 0.5 * 0.5 * (1 - e * e) * 1, 1e-12);
}

// Hops of 0.1 sqrt(D/g) reach 0.1^2/8 D, however long a contact is said to last.
TEST(ContactDurationEffect, DoesNotThrowADiskThatLiesOnTheFloor) {
  Scene scene;
  scene.gravity = UniformGravity{};
  scene.disks.species = {{1, 1, 1}};
  scene.disks.contact_duration = 10;
  scene.box.width = 4;
  scene.box.floor_surface.restitution = 0.5;
  scene.rests = scene.presses = false;
  scene.start = PlacedStart{{{2, 0.5 + 1e-12, 0, 0, 0, 0}}};
  const auto simulation = simulate(scene);
  double highest = 0;
  for (int k = 1; k <= 400; ++k) {
    simulation->advance_to(0.1 * k + 0.013);
    highest = std::max(highest, snapshot_of(*simulation).z[0] - 0.5);
  }
  EXPECT_GT(highest, 0);
  EXPECT_LE(highest, 0.01 / 8 + 1e-9);
}

TEST(ContactDurationEffect, NamesADurationThatIsShortEnough) {
  EXPECT_EQ(contact_duration_for(0.01, 1e-4, 0.02), 1e-4);
  // Enough in the beds whose share grows slowest, as t_c^0.3: (1/2)^(1/0.3) = 0.09921.
  EXPECT_NEAR(contact_duration_for(0.04, 1e-4, 0.02), 0.09921e-4, 1e-9);
}

}  // namespace
}  // namespace shakebed::sim
