// A bed of beads that touch on a level floor gives no doubt; holes, outlines that are too small and views from above
// do.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest::bed_doubts_test {
namespace {

constexpr double radius = 10, diameter = 2 * radius;  // px

FrameFindings findings(const std::vector<std::pair<double, double>>& centres) {
  FrameFindings frame;
  for (const auto& [x, y] : centres) {
    FoundDisk disk;
    disk.x_px = x, disk.y_px = y, disk.radius_px = radius;
    frame.disks.push_back(disk);
  }
  return frame;
}

// Hard disks put down at random, none nearer to another than `apart`.
std::vector<std::pair<double, double>> strewn(std::size_t count, double apart, double side, unsigned seed) {
  std::mt19937 random(seed);
  const auto part = [&] { return side * static_cast<double>(random()) / 4294967296.0; };
  std::vector<std::pair<double, double>> places;
  for (int tries = 0; places.size() < count && tries < 200000; ++tries) {
    const std::pair<double, double> place{part(), part()};
    bool free = true;
    for (const auto& [x, y] : places) free = free && std::hypot(x - place.first, y - place.second) > apart;
    if (free) places.push_back(place);
  }
  return places;
}

std::vector<std::pair<double, double>> triangular(double apart, int columns, int rows) {
  std::vector<std::pair<double, double>> places;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      places.emplace_back(apart * (column + 0.5 * (row % 2)), apart * std::sqrt(0.75) * row);
  return places;
}

TEST(BedDoubts, HardDisksAtRandomHaveTheContactsExpected) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    const Contacts contacts = contacts_of({findings(strewn(400, diameter, 800, seed))}, radius);
    EXPECT_GT(contacts.expected, 10);
    EXPECT_NEAR(contacts.seen, contacts.expected, 4 * std::sqrt(contacts.expected) + 0.5 * contacts.expected);
    EXPECT_FALSE(contacts.missing());
  }
}

TEST(BedDoubts, TouchingBeadsOfAPackingGiveNoDoubt) {
  const Contacts contacts = contacts_of({findings(triangular(1.01 * diameter, 12, 10))}, radius);
  EXPECT_FALSE(contacts.missing());
  EXPECT_NEAR(contacts.nearest_px, 1.01 * diameter, 1e-9);
}

TEST(BedDoubts, HolesAndOutlinesThatAreTooSmallNeverTouch) {
  const Contacts lattice = contacts_of({findings(triangular(1.28 * diameter, 20, 16))}, radius);
  EXPECT_TRUE(lattice.missing());
  EXPECT_EQ(lattice.seen, 0);
  EXPECT_NEAR(lattice.nearest_px, 1.28 * diameter, 1e-9);
  EXPECT_FALSE(lattice.far_apart(diameter));
  EXPECT_TRUE(contacts_of({findings(triangular(1.6 * diameter, 20, 16))}, radius).far_apart(diameter));
  EXPECT_TRUE(contacts_of({findings(strewn(600, 1.25 * diameter, 800, 4))}, radius).missing());
  // By the scale that the warning proposes, the same disks touch.
  EXPECT_FALSE(contacts_of({findings(triangular(1.28 * diameter, 20, 16))}, 0.5 * lattice.nearest_px).missing());
}

TEST(BedDoubts, FewDisksTellNothingOfContacts) {
  EXPECT_FALSE(contacts_of({findings(strewn(20, 1.5 * diameter, 600, 5))}, radius).missing());
  EXPECT_FALSE(contacts_of({}, radius).missing());
}

TEST(BedDoubts, CirclesTooLargeForTheirDistancesOverlap) {
  const std::vector<FrameFindings> frames = {findings(triangular(0.94 * diameter, 12, 10))};
  EXPECT_TRUE(contacts_of(frames, radius).overlapping(diameter));
  EXPECT_FALSE(contacts_of(frames, 0.94 * radius).overlapping(0.94 * diameter));
}

TEST(BedDoubts, OfTwoDisksThatOverlapOneIsTooMany) {
  std::vector<FoundDisk> disks = findings(triangular(1.01 * diameter, 6, 5)).disks;
  EXPECT_EQ(overlapping_too_many(disks, diameter), 0);
  FoundDisk& other = disks.emplace_back(disks.front());
  other.x_px -= 0.85 * diameter;
  EXPECT_EQ(overlapping_too_many(disks, diameter), 1);
  EXPECT_EQ(overlapping_too_many(disks, 0.9 * diameter), 0) << "the outline is larger than the bead";
  disks.back().other_size = true;
  EXPECT_EQ(overlapping_too_many(disks, diameter), 0);
}

// Disks drawn over others: however sure each of the circles is, the measurement counts one of two as wrong.
TEST(BedDoubts, DisksThatOverlapAreCountedAsWrongByAMeasurement) {
  const auto wrong_with = [](int overlapping) {
    std::vector<RenderedDisk> disks;
    for (int row = 0; row < 5; ++row)
      for (int column = 0; column < 10; ++column) disks.push_back({30 + 24.0 * column, 220 - 45.0 * row, radius, 0, 0});
    for (int k = 0; k < overlapping; ++k) disks.push_back({30 + 48.0 * k, 220 - 45 - 17, radius, 0, 0});
    const GrayFrame frame = render_frame(disks, {.width = 280, .height = 240, .blur_px = 0.8, .read_noise = 2});
    MeasureOptions options;
    options.bead_diameter_m = 2e-3;
    options.scale_m_per_px = 1e-4;
    options.find.seen = BeadsSeen{Polarity::dark_beads, radius};
    FrameSource source = FrameSource::from_generator(1, [&](std::size_t) { return frame; });
    std::vector<MeasuredDisk> seen;
    options.disk_sink = [&](const FrameReport&, const std::vector<MeasuredDisk>& all) { seen = all; };
    const Measurement found = measure_bed(source, options);
    EXPECT_EQ(seen.size(), disks.size());
    return found.expected_wrong * static_cast<double>(seen.size());
  };
  EXPECT_LT(wrong_with(0), 0.5);
  EXPECT_GE(wrong_with(4), 4);
}

TEST(BedDoubts, AFewDisksFarBesideTheBedAreNoPartOfIt) {
  std::vector<std::pair<double, double>> places = strewn(80, diameter, 400, 7);
  const auto all_beads = [](const BedEnds& ends) { return std::isinf(ends.left_px) && std::isinf(ends.right_px); };
  EXPECT_TRUE(all_beads(ends_of_bed({findings(places)}, radius)));
  places.emplace_back(540, 200), places.emplace_back(560, 230);
  const BedEnds ends = ends_of_bed({findings(places)}, radius);
  EXPECT_TRUE(std::isinf(ends.left_px));
  EXPECT_GT(ends.right_px, 400);
  EXPECT_LT(ends.right_px, 540);
  const PixelRectangle region = region_between(ends, 640, 480);
  EXPECT_EQ(region.left, 0);
  EXPECT_EQ(region.height, 480);
  EXPECT_NEAR(region.width, ends.right_px, 1);
  // A second bed of the same size is one.
  for (const auto& [x, y] : strewn(80, diameter, 400, 8)) places.emplace_back(x + 600, y);
  EXPECT_TRUE(all_beads(ends_of_bed({findings(places)}, radius)));
}

TEST(BedDoubts, TheLowestBeadsOfARoundPanLieOnAnArc) {
  std::vector<std::pair<double, double>> pan;
  const double of_pan = 14 * diameter;
  for (const auto& [x, y] : triangular(1.02 * diameter, 40, 40))
    if (std::hypot(x - 20 * diameter, y - 17 * diameter) < of_pan) pan.emplace_back(x, y);
  const std::vector<FrameFindings> frames = {findings(pan)};
  EXPECT_GT(sag_of_floor(lowest_points(frames, diameter, 900), diameter), 2 * diameter);
}

TEST(BedDoubts, AFloorThatIsLevelOrTiltedSagsByNothing) {
  for (const double slope : {0.0, 0.1}) {
    FloorPoints lowest;
    for (int k = 0; k < 20; ++k) lowest.emplace_back(30.0 * k, 400 + 30 * slope * k + (k % 3) * 0.3);
    EXPECT_EQ(sag_of_floor(lowest, diameter), 0);
  }
  // A dilute bed in a single photograph: the lowest beads lie at random heights.
  std::mt19937 random(6);
  for (int trial = 0; trial < 50; ++trial) {
    FloorPoints lowest;
    for (int k = 0; k < 20; ++k)
      lowest.emplace_back(30.0 * k,
                          400 + 2.5 * diameter * std::log(1e-9 + static_cast<double>(random()) / 4294967296.0));
    EXPECT_EQ(sag_of_floor(lowest, diameter), 0) << trial;
  }
}

TEST(BedDoubts, EachDoubtSaysWhatToDo) {
  Measurement found;
  found.calibration.scale_m_per_px = 1e-3 / diameter;
  EXPECT_TRUE(doubts_of_bed(found, 1e-3).empty());
  found.contacts = {.seen = 0, .expected = 40, .nearest_px = 25.8, .touching_px = 25};
  found.beside_bed = 2;
  found.bed_region = {0, 0, 470, 480};
  found.floor_sag = 6.2;
  const std::vector<std::string> doubts = doubts_of_bed(found, 1e-3);
  ASSERT_EQ(doubts.size(), 3U);
  EXPECT_NE(doubts[0].find("1.29 diameters apart"), std::string::npos) << doubts[0];
  EXPECT_NE(doubts[0].find("--scale \"0.04 mm/px\""), std::string::npos) << doubts[0];
  EXPECT_NE(doubts[1].find("--roi 0,0,470,480"), std::string::npos) << doubts[1];
  EXPECT_NE(doubts[2].find("6.2 diameters"), std::string::npos) << doubts[2];
}

}  // namespace
}  // namespace shakebed::ingest::bed_doubts_test
