// Beads of another shade: when they are looked for, how many it takes, and what is said of their size.
#include "ingest/find/other_shade.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// Twenty dark beads of radius 9 on 150, of which some are brighter than that instead, or of another radius, too.
struct BedOfShades {
  std::vector<RenderedDisk> dark, bright;
  GrayFrame of_dark, frame;  // the dark beads alone, and all

  explicit BedOfShades(int bright_beads, double bright_radius = 9, double bright_level = 190, double slope = 0) {
    for (int k = 0; k < 20; ++k) {
      const int column = k % 5, row = k / 5;
      const bool is_bright = k % 3 == 1 && static_cast<int>(bright.size()) < bright_beads;
      (is_bright ? bright : dark)
          .push_back({17 + 28.0 * column + 6 * test::scattered(column, row),
                      17 + 28.0 * row + 6 * test::scattered(row + 9, column), is_bright ? bright_radius : 9, 0, 0});
    }
    const GrayFrame others = test::beads_of_level(bright, bright_level, 0), none = test::beads_of_level({}, 70, 0);
    of_dark = test::beads_of_level(dark, 70, 2);
    for (std::size_t k = 0; k < of_dark.pixels.size(); ++k)
      of_dark.pixels[k] += static_cast<float>(slope * static_cast<double>(k % 150));
    frame = of_dark;
    for (std::size_t k = 0; k < frame.pixels.size(); ++k) frame.pixels[k] += others.pixels[k] - none.pixels[k];
  }
};

// What a film's first frame gives while all beads are dark.
struct ShadesFound {
  CalibrationResult learned;
  FindResult found;
};
ShadesFound first_shade(const BedOfShades& bed) {
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 9, false};
  ShadesFound shades;
  shades.learned = learn_beads({&bed.of_dark}, options);
  shades.found = find_beads(bed.of_dark, shades.learned.calibration, options);
  tell_radius(shades.learned);
  return shades;
}
std::size_t with_second_shade(const BedOfShades& bed, ShadesFound shades, const FindOptions& options = {}) {
  learn_other_shade(bed.frame, options, shades.learned.calibration, shades.found);
  return shades.found.disks.size();
}

TEST(OtherShade, IsLookedForInThePolarityAskedFor) {
  const BedOfShades bed(6);
  const ShadesFound dark = first_shade(bed);
  ASSERT_EQ(dark.found.disks.size(), 14U);
  FindOptions bright_alone, dark_alone;
  bright_alone.polarity = Polarity::bright_beads, dark_alone.polarity = Polarity::dark_beads;
  EXPECT_EQ(with_second_shade(bed, dark, bright_alone), 20U);
  EXPECT_EQ(with_second_shade(bed, dark, dark_alone), 14U);
}

// With nothing known of the picture.
TEST(OtherShade, SmallBrightBeadsAreFoundBetweenDarkOnes) {
  const BedOfShades bed(6, 7, 210);
  const DisksFound found = find_disks(ImageView{
      .width = bed.frame.width, .height = bed.frame.height, .pixels = bed.frame.pixels.data(), .type = PixelType::f32});
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_EQ(found.disks.size(), 20U);
  const auto beads_of = [&](const std::vector<RenderedDisk>& shade, double sign) {
    return std::count_if(shade.begin(), shade.end(), [&](const RenderedDisk& bead) {
      return std::any_of(found.disks.begin(), found.disks.end(), [&](const FoundDisk& disk) {
        return std::hypot(disk.x_px - bead.x_px, disk.y_px - bead.y_px) < 1 && sign * disk.contrast > 0;
      });
    });
  };
  EXPECT_EQ(beads_of(bed.dark, 1), 14);
  EXPECT_EQ(beads_of(bed.bright, -1), 6);
}

TEST(OtherShade, IsNotLookedForWithoutBeadsRimsOrPixelsOfTheirOwn) {
  const BedOfShades bed(6);
  const ShadesFound dark = first_shade(bed);
  ShadesFound without = dark;
  without.learned.calibration.rims.reset();
  EXPECT_EQ(with_second_shade(bed, without), 14U);
  without = dark;
  without.found.disks.clear();
  EXPECT_EQ(with_second_shade(bed, without), 0U);
  BedOfShades enlarged = bed;
  enlarged.frame.enlargement = 1.5;
  EXPECT_EQ(with_second_shade(enlarged, dark), 14U);
  // A frame in which no bead of the other shade was learned stays as it was found.
  FindResult again = dark.found;
  add_other_shade(bed.frame, dark.learned.calibration, {}, again);
  EXPECT_EQ(again.disks.size(), 14U);
}

TEST(OtherShade, IsNoneOfTwoBeads) {
  const BedOfShades two(2), four(4);
  EXPECT_EQ(with_second_shade(two, first_shade(two)), 18U);
  EXPECT_EQ(with_second_shade(four, first_shade(four)), 20U);
}

// Where the light falls off across the frame, what is behind a bead is that beside it. Of beads that are brighter on
// one side the mean level counts.
TEST(OtherShade, HasItsContrastOnUnevenGround) {
  BedOfShades bed(6, 9, 190, -0.1);
  for (const RenderedDisk& bright : bed.bright)
    for (int row = 0; row < bed.frame.height; ++row)
      for (int column = 0; column < bed.frame.width; ++column)
        if (std::hypot(column - bright.x_px, row - bright.y_px) < 8)
          test::set(bed.frame, column, row,
                    static_cast<double>(bed.frame.at(column, row)) - 1.4 * (column - bright.x_px) +
                        0.7 * (row - bright.y_px));
  ShadesFound shades = first_shade(bed);
  learn_other_shade(bed.frame, {}, shades.learned.calibration, shades.found);
  ASSERT_TRUE(shades.learned.calibration.other_shade);
  ASSERT_EQ(shades.found.disks.size(), 20U);
  std::size_t seen = 0;
  for (const RenderedDisk& bright : bed.bright)
    for (const FoundDisk& disk : shades.found.disks)
      if (std::hypot(disk.x_px - bright.x_px, disk.y_px - bright.y_px) < 1) {
        EXPECT_NEAR(disk.contrast, -0.5, 0.06);
        ++seen;
      }
  EXPECT_EQ(seen, 6U);
}

// Smaller beads of the other shade keep their own radius, and a warning states it.
TEST(OtherShade, OfAnotherSizeHasItsRadius) {
  const BedOfShades bed(6, 7);
  ShadesFound shades = first_shade(bed);
  shades.learned.calibration.recorded_px = 2;
  learn_other_shade(bed.frame, {}, shades.learned.calibration, shades.found);
  ASSERT_EQ(shades.found.disks.size(), 20U);
  std::size_t other = 0;
  for (const FoundDisk& disk : shades.found.disks) {
    other += disk.other_size ? 1 : 0;
    EXPECT_NEAR(disk.radius_px, disk.other_size ? 7 : 9, 0.15);
  }
  EXPECT_EQ(other, 6U);
  ASSERT_FALSE(shades.learned.calibration.warnings.empty());
  EXPECT_TRUE(test::holds(shades.learned.calibration.warnings.back(),
                          "Their radius is 14.0 px. The diameter refers to "
                          "the others, whose radius is 18.0 px."))
      << shades.learned.calibration.warnings.back();
}

}  // namespace
}  // namespace shakebed::ingest
