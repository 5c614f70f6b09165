// The row of a mirror image, from disks placed by hand, on either side of each of its limits.
#include <gtest/gtest.h>

#include <optional>
#include <vector>

#include "ingest/profile/mirror_image.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

constexpr double mirror_diameter = 16;  // px; the floor is at row 400, which is 25 of them

// Beads far beside one another, at this height [D], each with an image this bright.
struct MirroredBeads {
  FrameFindings frame;
  double row = 400;
  int column = 0;

  FoundDisk& add(double x, double z, double contrast) {
    frame.disks.push_back(test::found_at(mirror_diameter * x, row - mirror_diameter * z, 8));
    frame.disks.back().contrast = contrast;
    return frame.disks.back();
  }
  MirroredBeads& pairs(int count, double height = 1, double bright = 0.8, double beside = 0) {
    for (int k = 0; k < count; ++k) {
      const double x = 5.0 * ++column;
      add(x, height, 1);
      add(x + beside, -height, bright);
    }
    return *this;
  }
  [[nodiscard]] std::optional<double> seen() const { return find_mirror_row({frame}, mirror_diameter); }
};

TEST(MirrorRow, IsHalfWayBetweenBeadsAndImages) {
  MirroredBeads bed;
  for (const double height : {0.5, 0.7, 0.9, 1.1, 1.3, 1.49}) bed.pairs(1, height);
  ASSERT_TRUE(bed.seen());
  EXPECT_NEAR(*bed.seen(), 400, 1e-9);
  // Half of them about a row a hundredth of a diameter lower: the mean of all, also on either side of a step of the
  // search (167.5 steps of 0.15 D are 402 px).
  MirroredBeads two;
  two.row = 401.9;
  two.pairs(3);
  two.row = 402.1;
  two.pairs(3);
  ASSERT_TRUE(two.seen());
  EXPECT_NEAR(*two.seen(), 402, 1e-9);
}

TEST(MirrorRow, NeedsFiveImagesThatAreBelowTheirBeads) {
  EXPECT_TRUE(MirroredBeads().pairs(5).seen());
  MirroredBeads four = MirroredBeads().pairs(4);
  four.add(90, 3, 1), four.add(99, 4, 1);
  EXPECT_FALSE(four.seen());
  EXPECT_TRUE(MirroredBeads().pairs(6, 1.49).seen());
  EXPECT_FALSE(MirroredBeads().pairs(6, 1.51).seen()) << "more than three diameters apart";
  EXPECT_TRUE(MirroredBeads().pairs(6, 1, 0.8, 0.14).seen());
  // A bead that was found twice has one image: of six disks below the row four are images.
  MirroredBeads doubled = MirroredBeads().pairs(4);
  for (const double x : {5.0, 10.0}) doubled.add(x + 0.02, 1, 1);
  doubled.add(90, -3, 0.8), doubled.add(99, -4, 0.8);
  EXPECT_FALSE(doubled.seen());
  EXPECT_FALSE(MirroredBeads().pairs(6, 1, 0.8, 0.16).seen()) << "beside the mirrored place";
  EXPECT_TRUE(MirroredBeads().pairs(6, 1, 0.92).seen());
  EXPECT_FALSE(MirroredBeads().pairs(6, 1, 0.94).seen()) << "as bright as beads";
  // Brighter below than above is the bed itself, seen upside down.
  MirroredBeads upside_down;
  for (int k = 1; k <= 6; ++k) upside_down.add(5 * k, 1, 0.8), upside_down.add(5 * k, -1, 1);
  EXPECT_FALSE(upside_down.seen());
}

TEST(MirrorRow, IsFreeOfBeadsAndHasHardlyAnythingElseBelow) {
  for (const double side : {1.0, -1.0}) {
    MirroredBeads near = MirroredBeads().pairs(8);
    near.add(99, 0.34 * side, 1);
    EXPECT_FALSE(near.seen());
    MirroredBeads farther = MirroredBeads().pairs(8);
    farther.add(99, 0.36 * side, 1);
    EXPECT_TRUE(farther.seen()) << "eight of nine below are images";
  }
  // Eight of ten below the row are enough, eight of eleven are not; above it any number may be without an image.
  MirroredBeads others = MirroredBeads().pairs(8);
  for (int k = 0; k < 30; ++k) others.add(100 + 5 * k, 2.2, 1);
  others.add(300, -0.8, 1), others.add(305, -0.8, 1);
  EXPECT_TRUE(others.seen());
  others.add(310, -0.8, 1);
  EXPECT_FALSE(others.seen());
  // Disks of another size, and those that a border cuts, do not count.
  others.frame.disks.back().cut = true;
  EXPECT_TRUE(others.seen());
  others.frame.disks.back().cut = false, others.frame.disks.back().other_size = true;
  EXPECT_TRUE(others.seen());
}

TEST(MirrorRow, IsTheMedianOfTheFramesThatShowIt) {
  const auto frame = [](double row) {
    MirroredBeads bed;
    bed.row = row;
    return bed.pairs(6).frame;
  };
  const FrameFindings none;
  const auto row = find_mirror_row({frame(396), frame(404), none, frame(401)}, mirror_diameter);
  ASSERT_TRUE(row);
  EXPECT_NEAR(*row, 401, 1e-9);
  EXPECT_TRUE(find_mirror_row({frame(400), none, none, frame(400), frame(400)}, mirror_diameter)) << "three of five";
  EXPECT_FALSE(find_mirror_row({frame(400), none, none, frame(400)}, mirror_diameter)) << "two of four";
  EXPECT_FALSE(find_mirror_row({}, mirror_diameter));
  // The first twenty are enough.
  std::vector<FrameFindings> long_film(20, frame(400));
  long_film.resize(60);
  EXPECT_TRUE(find_mirror_row(long_film, mirror_diameter));
}

}  // namespace
}  // namespace shakebed::ingest
