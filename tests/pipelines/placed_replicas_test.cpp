// Replicas of a bed whose disks are placed: which disk has which velocity.
#include <gtest/gtest.h>

#include <string>

#include "pipelines/formats/trajectory.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::placed_replicas {
namespace {

// Far from one another in a box without gravity, the second and the fourth of twice the diameter: T is of the
// velocities they are given.
pipelines::TrajectoryFrame six_disks() {
  pipelines::TrajectoryFrame frame;
  frame.width = 60;
  for (int k = 0; k < 6; ++k) {
    frame.x.push_back(5 + 9 * k), frame.z.push_back(5 + 8 * k);
    frame.vx.push_back(0.1 * (k + 1)), frame.vz.push_back(0.05 * k * k), frame.spin.push_back(0);
    frame.radius.push_back(k == 1 || k == 3 ? 1 : 0.5);
  }
  return frame;
}

// The first begins as the frame says. In the others disks of one species have exchanged their velocities, so that the
// temperatures are the same; were those of both kinds exchanged, whose masses differ, they would not be.
TEST(PlacedReplicas, ExchangeVelocitiesWithinASpecies) {
  LoneStage bed(*pipelines::find_stage("simulate"));
  bed.reduced = true;
  pipelines::TrajectoryWriter writer(bed.file("start.extxyz"));
  writer.write(six_disks());
  writer.close();
  bed.run(R"({ "disks": { "count": 4, "restitution": 1, "second": { "count": 2, "diameter": 2 } }, "gravity": 0,
      "box": { "width": 60, "sides": "periodic", "lid": { "kind": "periodic", "height": 60 } },
      "start": { "kind": "file", "file": ")" +
          bed.file("start.extxyz").string() +
          R"(" }, "settle": 0, "measure": 2, "replicas": 5, "frames": { "count": 1 } })");
  const NumberTable replicas(bed.output("replicas.csv"));
  ASSERT_EQ(replicas.rows(), 5U);
  for (std::size_t r = 1; r < 5; ++r) {
    EXPECT_NEAR(replicas("temperature_x", r), replicas("temperature_x", 0), 1e-12) << r;
    EXPECT_NEAR(replicas("temperature_z", r), replicas("temperature_z", 0), 1e-12) << r;
  }
  pipelines::TrajectoryReader reader(bed.output("trajectory.extxyz.zst"));
  pipelines::TrajectoryFrame first;
  ASSERT_TRUE(reader.read(first));
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(first.vx[k], 0.1 * static_cast<double>(k + 1), 1e-12) << k;
}

}  // namespace
}  // namespace shakebed::tests::placed_replicas
