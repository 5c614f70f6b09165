// A polished floor shows the bed a second time, upside down.
#include "ingest/profile/mirror_image.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "ingest/profile/measure_bed.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "sim/engine/simulation.hpp"
#include "tests/ingest/shaken_bed.hpp"

namespace shakebed::ingest::mirror_image_test {
namespace {

constexpr double diameter_px = 16, floor_row = 400;

void add(FrameFindings& frame, double x, double z, double contrast, RandomStream& random) {
  FoundDisk disk;
  disk.x_px = x * diameter_px + 0.1 * random.normal();
  disk.y_px = floor_row - z * diameter_px + 0.1 * random.normal();
  disk.radius_px = diameter_px / 2;
  disk.contrast = contrast;
  frame.disks.push_back(disk);
}

// Twelve moments of a shaken bed.
std::vector<sim::Snapshot> moments(std::uint64_t seed) {
  const auto bed = sim::simulate(shaken_bed({.gamma = 2.5, .restitution = 0.8, .seed = seed}));
  std::vector<sim::Snapshot> moments(12);
  for (std::size_t k = 0; k < moments.size(); ++k) {
    bed->advance_to(50 + 3.7 * static_cast<double>(k));
    bed->snapshot(moments[k]);
  }
  return moments;
}

// Its frames on a floor that seems to rest, its images seen down to `depth` D.
std::vector<FrameFindings> film(const std::vector<sim::Snapshot>& bed, double depth, double reflected,
                                std::uint64_t seed) {
  RandomStream random(seed);
  std::vector<FrameFindings> frames(bed.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const sim::Snapshot& now = bed[k];
    for (std::size_t i = 0; i < now.x.size(); ++i) {
      const double above = now.z[i] - now.floor_position;
      add(frames[k], now.x[i], above, 1, random);
      if (above + 0.5 < depth) add(frames[k], now.x[i], -above, reflected, random);
    }
  }
  return frames;
}

TEST(MirrorImage, OfABedInItsFloorIsSeen) {
  const std::vector<sim::Snapshot> bed = moments(3);
  for (const double depth : {2.0, 5.0})
    for (const double reflected : {0.3, 0.8}) {
      const auto row = find_mirror_row(film(bed, depth, reflected, 3), diameter_px);
      ASSERT_TRUE(row) << depth << ", " << reflected;
      EXPECT_NEAR(*row, floor_row, 0.5);
    }
}

TEST(MirrorImage, IsNoneWhereNothingIsReflected) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed)
    EXPECT_FALSE(find_mirror_row(film(moments(seed), 0, 1, seed), diameter_px)) << seed;
}

// Rows of a crystal mirror one another about the row between them, also where the light fades downwards.
TEST(MirrorImage, IsNoneInACrystal) {
  RandomStream random(8);
  for (const double fading : {0.0, 0.05}) {
    std::vector<FrameFindings> frames(3);
    for (FrameFindings& frame : frames)
      for (int row = 0; row < 12; ++row)
        for (int k = 0; k < 20; ++k)
          add(frame, k + 0.5 * (row % 2), 0.5 + 0.866 * row, 1 - fading * (11 - row), random);
    EXPECT_FALSE(find_mirror_row(frames, diameter_px)) << fading;
  }
}

// The answer says so, with the region that leaves the image out.
TEST(MirrorImage, IsObjectedTo) {
  Measurement found;
  found.disk_total = 1000;
  EXPECT_TRUE(objections_to(found).empty());
  found.above_mirror_image = PixelRectangle{10, 20, 600, 246};
  const std::vector<Objection> all = objections_to(found);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_NE(all[0].why.find("row 266"), std::string::npos) << all[0].why;
  EXPECT_NE(all[0].advice.find("--roi 10,20,600,246"), std::string::npos) << all[0].advice;
}

}  // namespace
}  // namespace shakebed::ingest::mirror_image_test
