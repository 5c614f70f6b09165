// Beads of several sizes, beads whose rims are hidden by their neighbours, and colours that show faces where another
// shows fringes; drawn.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/settle_channel.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/photographs.hpp"
#include "statistics/text.hpp"
#include "tests/ingest/drawn_beds.hpp"

namespace shakebed::ingest {
namespace {

struct Bead {
  double x, y, radius;
};

// Beads that do not touch, the k-th of radius radii[k % radii.size()].
std::vector<Bead> scattered(std::size_t count, const std::vector<double>& radii, int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Bead> beads;
  for (int tries = 0; beads.size() < count && tries < 200000; ++tries) {
    const double radius = radii[beads.size() % radii.size()];
    const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const Bead one{radius + 4 + part() * (width - 2 * radius - 8), radius + 4 + part() * (height - 2 * radius - 8),
                   radius};
    if (std::none_of(beads.begin(), beads.end(), [&](const Bead& other) {
          return std::hypot(other.x - one.x, other.y - one.y) < 1.06 * (other.radius + one.radius);
        }))
      beads.push_back(one);
  }
  return beads;
}

// Level inside a bead at (u, v) radii from its centre.
using Face = double (*)(const Bead& bead, double u, double v);

GrayFrame drawn(const std::vector<Bead>& beads, int width, int height, double background, Face face, unsigned seed) {
  std::mt19937 random(seed);
  GrayFrame frame{width, height, {}};
  for (int row = 0; row < height; ++row) {
    std::vector<Bead> near;
    std::copy_if(beads.begin(), beads.end(), std::back_inserter(near),
                 [&](const Bead& one) { return std::abs(one.y - row) < one.radius + 1; });
    for (int column = 0; column < width; ++column) {
      double level = 0;
      for (const double dx : {-0.25, 0.25})
        for (const double dy : {-0.25, 0.25}) {
          const double x = column + dx, y = row + dy;
          const auto bead = std::find_if(near.begin(), near.end(), [&](const Bead& one) {
            const double across = one.x - x, down = one.y - y;
            return std::abs(across) < one.radius && std::hypot(across, down) < one.radius;
          });
          level += bead == near.end() ? background / 4
                                      : face(*bead, (x - bead->x) / bead->radius, (y - bead->y) / bead->radius) / 4;
        }
      double noise = -6;
      for (int k = 0; k < 12; ++k) noise += static_cast<double>(random()) / 4294967296.0;
      frame.pixels.push_back(static_cast<float>(level + 2 * noise));
    }
  }
  return frame;
}

double plain_face(const Bead&, double, double) { return 80; }
double fringed_face(const Bead& bead, double u, double v) {
  return 100 + 80 * std::sin(9 * u * v + bead.x) * std::cos(4 * u + bead.y);
}

std::size_t found_beads(const std::vector<FoundDisk>& disks, const std::vector<Bead>& beads) {
  return static_cast<std::size_t>(std::count_if(beads.begin(), beads.end(), [&](const Bead& bead) {
    return std::any_of(disks.begin(), disks.end(), [&](const FoundDisk& disk) {
      return std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 0.25 * bead.radius;
    });
  }));
}

TEST(Sizes, BeadsOfTwoSizesAreFoundEachWithItsRadius) {
  const std::vector<Bead> beads = scattered(60, {22, 15.5}, 540, 460, 11);
  ASSERT_EQ(beads.size(), 60U);
  const GrayFrame frame = drawn(beads, 540, 460, 190, plain_face, 5);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 22};
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  const FindResult result = find_beads(frame, learned.calibration, options);
  EXPECT_EQ(found_beads(result.disks, beads), 60U);
  EXPECT_EQ(result.disks.size(), 60U);
  for (const FoundDisk& disk : result.disks)
    for (const Bead& bead : beads)
      if (std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 0.25 * bead.radius) {
        EXPECT_NEAR(disk.radius_px, bead.radius, 0.06 * bead.radius);
        EXPECT_EQ(disk.other_size, bead.radius < 20);
      }
  const auto& warnings = learned.calibration.warnings;
  EXPECT_TRUE(std::any_of(warnings.begin(), warnings.end(), [](const std::string& one) {
    return one.find("several sizes") != std::string::npos &&
           one.find("In the first frame 30 of 60 beads") != std::string::npos;
  }));
  EXPECT_LT(learned.calibration.expected_missed, 0.02);
}

// Disks in polarised light, close together: a thin dark outline, and fringes that are brighter or darker than what is
// behind them.
struct Fringed {
  std::vector<Bead> beads;
  GrayFrame frame;
};
Fringed fringed_bed(double radius, unsigned seed) {
  std::mt19937 random(seed);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
  Fringed bed;
  const int lines = 9, a_line = 12;
  for (int row = 0; row < lines; ++row)
    for (int column = 0; column < a_line - row % 2; ++column) {
      Bead bead{radius * (1.3 + 2.06 * column + 1.03 * (row % 2)), radius * (1.3 + 1.8 * row), radius};
      bead.x += 0.05 * radius * (part() - 0.5), bead.y += 0.05 * radius * (part() - 0.5);
      if (part() < 0.9) bed.beads.push_back(bead);
    }
  const auto face = [](const Bead& bead, double u, double v) {
    if (std::hypot(u, v) > 1 - 2.2 / bead.radius) return 70.0;
    return 150 + 70 * std::sin(4 * u * v + bead.x) * std::cos(2.5 * u + bead.y);
  };
  bed.frame = drawn(bed.beads, static_cast<int>(radius * (2.06 * a_line + 0.8)),
                    static_cast<int>(radius * (1.8 * lines + 1)), 150, face, seed);
  return bed;
}

TEST(Sizes, DisksWithFringesBrighterAndDarkerThanTheBackgroundAreFound) {
  const Fringed bed = fringed_bed(26, 4);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 26};
  const CalibrationResult learned = learn_beads({&bed.frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  const FindResult result = find_beads(bed.frame, learned.calibration, options);
  const auto hits = static_cast<double>(found_beads(result.disks, bed.beads));
  EXPECT_GE(2 * hits / static_cast<double>(result.disks.size() + bed.beads.size()), 0.98);
}

// Large beads of 13 px, of which the diameter is given first or second.
struct GivenDiameters {
  double ratio = 1;
  bool bright = false, large_first = false;
};
constexpr double large_px = 13, large_m = 3e-3;

BedFound measured_with(test::DrawnBed& bed, const GivenDiameters& given) {
  if (given.bright)
    for (float& level : bed.frame.pixels) level = 255 - level;
  const ImageView view{
      .width = bed.frame.width, .height = bed.frame.height, .pixels = bed.frame.pixels.data(), .type = PixelType::f32};
  MeasureOptions options;
  options.bead_diameter_m = given.large_first ? large_m : large_m / given.ratio;
  options.second_diameter_m = given.large_first ? large_m / given.ratio : large_m;
  return measure_bed(std::vector<ImageView>{view}, options);
}

void expect_both_kinds(test::DrawnBed bed, const GivenDiameters& given) {
  constexpr double least_recall = 0.98, least_told = 0.98, most_wrong = 0.02;
  const BedFound found = measured_with(bed, given);
  const Measurement& measured = found.measurement;
  const std::string about = formatted("ratio %g, bright %d, the large ones first: %d. %s", given.ratio, given.bright,
                                      given.large_first, found.message.c_str());
  ASSERT_TRUE(found.ok() && measured.second_finder) << about;
  double told = 0;
  std::vector<FoundDisk> disks;
  for (const MeasuredDisk& disk : measured.disks) {
    disks.emplace_back();
    disks.back().x_px = disk.x_px, disks.back().y_px = disk.y_px, disks.back().radius_px = disk.radius_px;
    for (const test::DrawnBead& bead : bed.beads)
      if (bead.whole && std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 0.25 * bead.radius)
        told += (disk.species == 1) == (given.large_first == (bead.radius > 0.99 * large_px));
  }
  const test::BedScore score = test::score_of(disks, bed.beads);
  EXPECT_GE(score.hits, least_recall * score.beads) << about;
  EXPECT_GE(told, least_told * score.hits) << about;
  EXPECT_LE(score.wrong(), most_wrong * score.beads) << about;
  const FinderCalibration &first = measured.finder, &second = *measured.second_finder;
  const FinderCalibration &large = given.large_first ? first : second, &small = given.large_first ? second : first;
  EXPECT_NEAR(large.radius_px, large_px, 2.5 * large.radius_std_error_px) << about;
  EXPECT_NEAR(small.radius_px, large_px / given.ratio, 2.5 * small.radius_std_error_px) << about;
  EXPECT_LT(first.radius_std_error_px, 0.03 * first.radius_px) << about;  // loose beds show little of the tone curve
}

// The first look sees one of the two kinds, which may be either.
TEST(Sizes, BeadsOfTwoGivenDiametersAreFoundAndToldApart) {
  std::mt19937 random(1);
  expect_both_kinds(test::bed_of_two_sizes(random, 1.4, 0.5, large_px), {.ratio = 1.4});
}

TEST(Sizes, BeadsOfTwoGivenDiametersAreFoundAtEveryRatio) {
  unsigned seed = 101;
  for (const double ratio : {1.25, 1.6, 2.0})
    for (const bool bright : {false, true})
      for (const bool large_first : {false, true}) {
        std::mt19937 random(seed++);
        // Every pair of two of the three choices, not every three.
        if (large_first == (bright != (ratio == 1.6))) continue;
        expect_both_kinds(test::bed_of_two_sizes(random, ratio, 0.5, large_px), {ratio, bright, large_first});
        expect_both_kinds(test::strewn_of_two_sizes(random, ratio, 0.5, large_px), {ratio, bright, large_first});
      }
}

// All beads are large ones, and a second diameter is given all the same.
TEST(Sizes, ASecondDiameterThatNoBeadHasIsNotFound) {
  for (const bool large_first : {true, false}) {
    std::mt19937 random(3);
    test::DrawnBed bed = test::bed_of_two_sizes(random, 1.4, 0, large_px);
    EXPECT_FALSE(measured_with(bed, {.ratio = 1.4, .large_first = large_first}).measurement.second_finder);
  }
}

// Beads with fringes, whose faces tell no kind: those of the second diameter are found by their rims.
TEST(Sizes, BeadsOfTheSecondDiameterAreFoundByTheirRims) {
  const std::vector<Bead> beads = scattered(27, {18, 18, 26}, 420, 360, 31);
  ASSERT_EQ(beads.size(), 27U);
  const GrayFrame frame = drawn(beads, 420, 360, 190, fringed_face, 7);
  const ImageView view{.width = 420, .height = 360, .pixels = frame.pixels.data(), .type = PixelType::f32};
  const auto measured = [&](double second_px) {
    MeasureOptions options;
    options.bead_diameter_m = 3e-3, options.second_diameter_m = 3e-3 * second_px / 18;
    return measure_bed(std::vector<ImageView>{view}, options);
  };
  const BedFound found = measured(26);
  ASSERT_TRUE(found.ok()) << found.message;
  ASSERT_TRUE(found.measurement.second_finder);
  EXPECT_NEAR(found.measurement.second_finder->radius_px, 26, 0.3);
  EXPECT_EQ(found.measurement.disks.size(), 27U);
  EXPECT_EQ(found.measurement.frames[0].second, 9U);
  for (const MeasuredDisk& disk : found.measurement.disks)
    EXPECT_TRUE(std::any_of(beads.begin(), beads.end(),
                            [&](const Bead& bead) {
                              return std::hypot(disk.x_px - bead.x, disk.y_px - bead.y) < 1 &&
                                     (disk.species == 2) == (bead.radius > 20);
                            }))
        << disk.x_px << " " << disk.y_px << " " << disk.species;
  const BedFound none = measured(38);
  EXPECT_FALSE(none.measurement.second_finder);
  EXPECT_THAT(none.measurement.warnings,
              testing::Contains(testing::HasSubstr(
                  "No beads of the second diameter were found: no rims of this radius were found. The search for both "
                  "kinds together failed, too: ")));
}

// Coins: in the pictures of larger ones there are arcs of the radius that most have. A bead of that size is found there
// at first, and gives its place to the larger one.
TEST(Sizes, ABeadInsideALargerOneGivesItsPlace) {
  std::vector<double> radii(36, 20.0);
  for (std::size_t k = 0; k < 36; k += 3) radii[k] = k % 9 == 0 ? 29.5 : 29.0;
  const std::vector<Bead> beads = scattered(36, radii, 520, 440, 3);
  ASSERT_EQ(beads.size(), 36U);
  const auto face = [](const Bead& bead, double u, double v) {
    if (bead.radius > 29.2) return std::hypot(u - 0.32, v) < 0.68 || v > 0.2 ? 80.0 : 140.0;
    return bead.radius > 25 ? 80 : 80 + 210 * std::max(0.0, std::sin(2 * std::atan2(v, u) + bead.x) - 0.3);
  };
  const GrayFrame frame = drawn(beads, 520, 440, 190, face, 5);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 20};
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  ASSERT_TRUE(learned.calibration.rims);
  const RimsFound found = find_rims(frame, *learned.calibration.rims);
  EXPECT_EQ(found.disks.size(), 36U);
  for (const Bead& bead : beads)
    EXPECT_TRUE(std::any_of(found.disks.begin(), found.disks.end(),
                            [&](const RimDisk& disk) {
                              return std::hypot(disk.circle.x - bead.x, disk.circle.y - bead.y) < 0.1 * bead.radius &&
                                     std::abs(disk.circle.radius - bead.radius) < 0.1 * bead.radius;
                            }))
        << bead.x << " " << bead.y << " " << bead.radius;
}

TEST(Sizes, BeadsOfOneSizeHaveNoOthers) {
  const std::vector<Bead> beads = scattered(50, {18}, 520, 460, 12);
  const GrayFrame frame = drawn(beads, 520, 460, 190, fringed_face, 6);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 18};
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  for (const FoundDisk& disk : find_beads(frame, learned.calibration, options).disks) EXPECT_FALSE(disk.other_size);
  options.one_size = true;
  EXPECT_TRUE(learn_beads({&frame}, options).calibration.rims->gaps->other_sizes.empty());
}

// A shadow's round end, of a tenth of the beads' contrast.
TEST(Sizes, AFaintCircleIsNoBead) {
  std::vector<Bead> beads = scattered(40, {18}, 520, 460, 12);
  beads.back().radius = 18.01;
  const auto face = [](const Bead& bead, double u, double v) {
    return bead.radius > 18 ? 170.0 : fringed_face(bead, u, v);
  };
  const GrayFrame frame = drawn(beads, 520, 460, 190, face, 6);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 18};
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  const auto sees_faint = [&](const RimModel& rims) {
    const RimsFound found = find_rims(frame, rims);
    return std::any_of(found.disks.begin(), found.disks.end(), [&](const RimDisk& disk) {
      return std::hypot(disk.circle.x - beads.back().x, disk.circle.y - beads.back().y) < 5;
    });
  };
  RimModel without_contrast = *learned.calibration.rims;
  without_contrast.contrast = 0;
  EXPECT_TRUE(sees_faint(without_contrast));
  EXPECT_FALSE(sees_faint(*learned.calibration.rims));
}

TEST(Sizes, TheChannelIsSettledInWhichTheFacesAreSeen) {
  const std::vector<Bead> beads = scattered(50, {18}, 520, 460, 13);
  ChannelFrames frames;
  frames.width = 520, frames.height = 460;
  frames.channels = {{Channel::red, drawn(beads, 520, 460, 190, fringed_face, 7)},
                     {Channel::blue, drawn(beads, 520, 460, 118, plain_face, 8)}};
  const Survey survey = take_survey(frames);
  ASSERT_TRUE(survey.found) << survey.why_not;
  EXPECT_EQ(survey.candidates.front().channel, Channel::blue);
}

// One bead of twelve has no contrast in the channel that shows the others best: nothing there gives a doubt.
TEST(Sizes, AChannelIsLeftThatDoesNotShowABeadAtAll) {
  const std::vector<Bead> beads = scattered(12, {18}, 300, 260, 21);
  const std::vector<Bead> all_but_one(beads.begin(), beads.end() - 1);
  ChannelFrames frames;
  frames.width = 300, frames.height = 260;
  frames.channels = {{Channel::saturation, drawn(all_but_one, 300, 260, 190, plain_face, 7)},
                     {Channel::grey, drawn(beads, 300, 260, 160, plain_face, 8)}};
  SurveyCandidate best;
  best.channel = Channel::saturation;
  LearnedRims rims = learn_rims(frames.channels.front().frame, Polarity::dark_beads, 18, Known::beads);
  best.rims = rims.model;
  best.disks = rims.disks;
  ASSERT_EQ(best.disks.size(), 11U);
  EXPECT_EQ(settle_channel(frames, best, {}).channel, Channel::grey);
  frames.channels.back().frame = drawn(all_but_one, 300, 260, 160, plain_face, 8);
  EXPECT_EQ(settle_channel(frames, best, {}).channel, Channel::saturation) << "the other shows no more";
}

// By how often it asks whether to stop: channels are compared in one part of a large picture.
TEST(Sizes, AChannelIsSettledInAPartOfALargePicture) {
  const auto asked_for = [](int side, std::size_t count) {
    const std::vector<Bead> beads = scattered(count, {8}, side, side, 23);
    ChannelFrames frames;
    frames.width = frames.height = side;
    frames.channels = {{Channel::saturation, drawn(beads, side, side, 190, plain_face, 7)},
                       {Channel::grey, drawn(beads, side, side, 160, plain_face, 8)}};
    SurveyCandidate best;
    best.channel = Channel::saturation;
    LearnedRims rims = learn_rims(frames.channels.front().frame, Polarity::dark_beads, 8, Known::beads);
    best.rims = rims.model, best.disks = rims.disks;
    EXPECT_GT(best.disks.size(), count * 9 / 10);
    std::size_t asked = 0;
    const StopQuestion counted([&] { ++asked; });
    settle_channel(frames, best, {});
    return asked;
  };
  EXPECT_LT(2 * asked_for(1000, 260), 3 * asked_for(640, 106));
}

TEST(Sizes, DoubtsOfAFilmAreTheMeanOverItsDisks) {
  const std::vector<Bead> beads = scattered(40, {18}, 520, 460, 14);
  MeasureOptions options;
  options.bead_diameter_m = 1e-3;
  options.find.seen = BeadsSeen{Polarity::dark_beads, 18};
  std::vector<GrayFrame> film;
  film.push_back(drawn(beads, 520, 460, 190, fringed_face, 9));
  FrameSource source = FrameSource::from_frames(std::move(film));
  const Measurement found = measure_bed(source, options);
  ASSERT_FALSE(found.disks.empty());
  double doubts = 0;
  for (const MeasuredDisk& disk : found.disks) doubts += 1 - disk.probability;
  EXPECT_NEAR(found.expected_wrong, doubts / static_cast<double>(found.disks.size()), 1e-12);
}

// Four circles seen whole, and in each copy two that are hardly seen: nothing speaks against the four.
TEST(Sizes, FewWellSeenCirclesAreNotDoubtedForPoorOnesOfChance) {
  std::vector<Circle> seen(4), poor(2);
  for (Circle& circle : seen) circle.support = 1;
  for (Circle& circle : poor) circle.support = 0.35;
  EXPECT_GT(probability_at(probabilities_by_support(seen, {poor, poor}, Known::beads), 1), 0.95);
  EXPECT_LT(probability_at(probabilities_by_support(seen, {poor, poor}, Known::nothing), 1), 0.6);
  EXPECT_EQ(probability_at({}, 1), 0);
}

// Five wide circles seen whole. In each copy are three whose rims are seen in part: a third of the rim says nothing
// against the five, nine tenths do.
TEST(Sizes, OfWholeCirclesOnlyNearlyWholeOnesOfChanceRaiseDoubt) {
  std::vector<Circle> seen(5), poor(3), good(3);
  for (Circle& circle : seen) circle.support = 1;
  for (Circle& circle : poor) circle.support = 0.35;
  for (Circle& circle : good) circle.support = 0.9;
  EXPECT_GT(probability_at(probabilities_by_support(seen, {poor, poor}, Known::wide), 1), 0.95);
  EXPECT_LT(probability_at(probabilities_by_support(seen, {good, good}, Known::wide), 1), 0.5);
  for (Circle& circle : seen) circle.support = 0.7;
  EXPECT_LT(probability_at(probabilities_by_support(seen, {poor, poor}, Known::wide), 0.7), 0.5);
}

}  // namespace
}  // namespace shakebed::ingest
