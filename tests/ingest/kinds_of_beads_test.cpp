// Beads of two sizes, of two shades, in two colours and beside those found, in small drawn pictures; and what a film's
// first frames give. The parts that large pictures go through, each with its numbers known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/rim_gaps.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/settle_channel.hpp"
#include "ingest/find/two_kinds.hpp"
#include "ingest/profile/film_calibration.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// `columns` x `rows` disks `apart` px from one another, off the lattice by up to 1 px.
std::vector<RenderedDisk> strewn_disks(int columns, int rows, double apart, double radius) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < columns * rows; ++k) {
    const int column = k % columns, row = k / columns;
    disks.push_back({(column + 0.75) * apart + test::scattered(column, row),
                     (row + 0.75) * apart + test::scattered(row + 9, column), radius, 0, 0});
  }
  return disks;
}
GrayFrame strewn_frame(const std::vector<RenderedDisk>& disks, int width, int height, double bead = 70,
                       double noise = 2) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.background_level = 150, camera.bead_level = bead;
  camera.blur_px = 0.8, camera.read_noise = noise;
  return render_frame(disks, camera);
}
std::vector<Circle> circles_of(const std::vector<RenderedDisk>& disks) {
  std::vector<Circle> circles;
  for (const RenderedDisk& disk : disks) circles.push_back({disk.x_px, disk.y_px, disk.radius_px});
  return circles;
}
// The farthest of the places from the nearest of the disks found.
template <class Places, class PlaceOf>
double farthest_of(const std::vector<RenderedDisk>& disks, const Places& places, const PlaceOf& place_of) {
  double farthest = 0;
  for (const auto& one : places) {
    const auto [x, y] = place_of(one);
    double nearest = HUGE_VAL;
    for (const RenderedDisk& disk : disks) nearest = std::min(nearest, std::hypot(disk.x_px - x, disk.y_px - y));
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}
double farthest_found(const std::vector<RenderedDisk>& truth, const std::vector<FoundDisk>& found) {
  return farthest_of(truth, found, [](const FoundDisk& disk) { return std::pair(disk.x_px, disk.y_px); });
}

// --- rim_gaps.hpp ----------------------------------------------------------------------------------------------------

TEST(Gaps, HoldTheBeadThatWasLeftOut) {
  const std::vector<RenderedDisk> truth = strewn_disks(5, 4, 24, 9);
  const GrayFrame frame = strewn_frame(truth, 132, 108);
  RimModel model = learn_rims(frame, Polarity::dark_beads, 9).model;
  PictureMaps maps(frame, model.search.wanted_px);
  std::vector<Circle> known = circles_of(truth);
  for (Circle& circle : known) circle.support = 1;
  const Circle missing = known[7];
  known.erase(known.begin() + 7);
  model.gaps = chances_in_gaps(maps, known, model, true);
  EXPECT_TRUE(model.gaps->other_sizes.empty());
  // One circle of full support, none by chance: 1 - 0.05.
  ASSERT_EQ(model.gaps->same_size.size(), 21U);
  EXPECT_NEAR(model.gaps->same_size.back(), 0.95, 1e-2);
  const GapCircles gaps = circles_in_gaps(maps, known, model);
  ASSERT_EQ(gaps.circles.size(), 1U);
  EXPECT_NEAR(gaps.circles[0].circle.x, missing.x, 0.15);
  EXPECT_NEAR(gaps.circles[0].circle.y, missing.y, 0.15);
  EXPECT_NEAR(gaps.circles[0].circle.radius, model.radius_px, 0.15);
  EXPECT_NEAR(gaps.circles[0].probability, model.gaps->same_size.back(), 1e-2);
  EXPECT_EQ(gaps.circles[0].size, nullptr);
  EXPECT_TRUE(gaps.displaced.empty());
  EXPECT_LT(gaps.expected_missed, 0.05);
  known.insert(known.begin(), missing);
  EXPECT_TRUE(circles_in_gaps(maps, known, model).circles.empty()) << "none is left";
}

// Chance makes up no circle beside beads: those farther than two radii from a rim are none of the gaps.
TEST(Gaps, ReachTwoRadiiFromABead) {
  const auto found_at = [](double away) {
    std::vector<RenderedDisk> truth = strewn_disks(3, 3, 24, 9);
    truth.push_back({truth[5].x_px + away, truth[5].y_px, 9, 0, 0});
    const GrayFrame frame = strewn_frame(truth, 190, 84);
    RimModel model = learn_rims(frame, Polarity::dark_beads, 9).model;
    PictureMaps maps(frame, model.search.wanted_px);
    std::vector<Circle> known = circles_of(truth);
    known.pop_back();
    model.gaps = chances_in_gaps(maps, known, model, true);
    return circles_in_gaps(maps, known, model).circles.size();
  };
  EXPECT_EQ(found_at(30), 1U) << "its rim is 12 px from the next";
  EXPECT_EQ(found_at(42), 0U) << "24 px";
}

TEST(Gaps, HoldBeadsOfAnotherSize) {
  std::vector<RenderedDisk> truth = strewn_disks(6, 4, 30, 9);
  for (std::size_t k = 0; k < truth.size(); k += 3) truth[k].radius_px = 13;
  const GrayFrame frame = strewn_frame(truth, 200, 140);
  LearnedRims learned = learn_rims(frame, Polarity::dark_beads, 9, Known::beads);
  EXPECT_EQ(learned.disks.size(), 16U);
  learn_gaps(frame, learned, false);
  ASSERT_EQ(learned.model.gaps->other_sizes.size(), 1U);
  const SizeBand& other = learned.model.gaps->other_sizes[0];
  // The blurred edge moves rims in by half its variance over the radius (FinderParts): 0.12 px at 9, 0.09 px at 13.
  EXPECT_NEAR(other.radius_px, 13 - 0.09, 0.2);
  // 12 % either way of the radius, so that beads of later frames, whose radii scatter, lie in it, too.
  EXPECT_NEAR(other.from_px / other.radius_px, 0.88, 0.01);
  EXPECT_NEAR(other.to_px / other.radius_px, 1.12, 0.01);
  const RimsFound found = find_rims(frame, learned.model);
  ASSERT_EQ(found.disks.size(), truth.size());
  EXPECT_LT(found.expected_missed, 0.1);
  std::size_t others = 0;
  for (const RimDisk& disk : found.disks) {
    const auto its = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return std::hypot(a.x_px - disk.circle.x, a.y_px - disk.circle.y) <
             std::hypot(b.x_px - disk.circle.x, b.y_px - disk.circle.y);
    });
    EXPECT_LT(std::hypot(its->x_px - disk.circle.x, its->y_px - disk.circle.y), 0.2);
    EXPECT_EQ(disk.other_size, its->radius_px == 13);
    EXPECT_NEAR(disk.circle.radius, its->radius_px, 0.4);
    others += disk.other_size ? 1 : 0;
  }
  EXPECT_EQ(others, 8U);
  for (std::size_t k = 1; k < found.disks.size(); ++k) EXPECT_LE(found.disks[k - 1].circle.y, found.disks[k].circle.y);
}

// 4 of 20 by chance are 4 +- 2, so 6 at worst.
TEST(RimProbability, AtWorstIsAStandardDeviationMore) {
  EXPECT_DOUBLE_EQ(share_by_chance_at_worst(4, 20), 0.3);
  EXPECT_EQ(share_by_chance_at_worst(0, 20), 0);
  EXPECT_DOUBLE_EQ(share_by_chance_at_worst(0.25, 0), 0.75);
  EXPECT_DOUBLE_EQ(share_by_chance_at_worst(-1, 10), -0.1);
}

// --- two_kinds.hpp ---------------------------------------------------------------------------------------------------

// Twelve beads of 12 px and twelve of 8 px, in turns.
std::vector<RenderedDisk> two_sizes() {
  std::vector<RenderedDisk> disks = strewn_disks(6, 4, 28, 12);
  for (std::size_t k = 0; k < disks.size(); ++k)
    if ((k + k / 6) % 2 == 1) disks[k].radius_px = 8;
  return disks;
}
KindsAsked kinds_asked(double ratio) {
  KindsAsked asked;
  asked.ratio = ratio, asked.from_px = 11.4, asked.to_px = 12.6, asked.polarity = Polarity::dark_beads;
  return asked;
}

TEST(TwoKinds, AreFoundEachInItsPlaces) {
  const std::vector<RenderedDisk> truth = two_sizes();
  const GrayFrame frame = strewn_frame(truth, 184, 128);
  const LearnedKinds learned = learn_two_kinds({&frame}, kinds_asked(1.5), {});
  ASSERT_TRUE(learned.kinds) << learned.why_not;
  EXPECT_EQ(learned.why_not, "");
  EXPECT_NEAR(learned.kinds->large.radius_px, 12, 0.05);
  EXPECT_NEAR(learned.kinds->small.radius_px, 8, 0.05);
  EXPECT_EQ(learned.kinds->small.radius_std_error_px, learned.kinds->large.radius_std_error_px) << "of one camera";
  const KindsFound found = find_two_kinds(frame, *learned.kinds, {});
  EXPECT_EQ(found.large.disks.size(), 12U);
  EXPECT_EQ(found.small.disks.size(), 12U);
  std::vector<RenderedDisk> large, small;
  for (const RenderedDisk& disk : truth) (disk.radius_px > 10 ? large : small).push_back(disk);
  EXPECT_LT(farthest_found(large, found.large.disks), 0.15);
  EXPECT_LT(farthest_found(small, found.small.disks), 0.15);
  EXPECT_EQ(found.undecided, 0);
  EXPECT_LT(found.unexplained, 0.01);
}

// The area that a disk of radius r has more than small ones, less what it lacks of large ones, is (2 r^2 - 208)/80 of
// the difference: a disk of 10.2 px is as near to one kind as to the other, and is none of either.
TEST(TwoKinds, ADiskHalfWayBetweenThemIsUndecided) {
  std::vector<RenderedDisk> truth = two_sizes();
  const GrayFrame clear = strewn_frame(truth, 184, 128);
  const LearnedKinds learned = learn_two_kinds({&clear}, kinds_asked(1.5), {});
  ASSERT_TRUE(learned.kinds) << learned.why_not;
  for (const double radius : {9.2, 10.2, 11.2}) {
    truth[8].radius_px = radius;
    const KindsFound found = find_two_kinds(strewn_frame(truth, 184, 128), *learned.kinds, {});
    const auto has_it = [&](const FindResult& kind) {
      return std::any_of(kind.disks.begin(), kind.disks.end(), [&](const FoundDisk& disk) {
        return std::hypot(disk.x_px - truth[8].x_px, disk.y_px - truth[8].y_px) < 3;
      });
    };
    EXPECT_EQ(has_it(found.small), radius == 9.2) << radius;
    EXPECT_EQ(has_it(found.large), radius == 11.2) << radius;
    EXPECT_EQ(found.undecided > 0, radius == 10.2) << radius << ": " << found.undecided;
  }
}

// Whichever of the two the film names first.
TEST(TwoKinds, AreTheFirstAndTheSecondOfTheirFilm) {
  const GrayFrame frame = strewn_frame(two_sizes(), 184, 128);
  const LearnedKinds learned = learn_two_kinds({&frame}, kinds_asked(1.5), {});
  ASSERT_TRUE(learned.kinds) << learned.why_not;
  for (const bool first_is_large : {true, false}) {
    FilmCalibration film;
    film.finder = first_is_large ? learned.kinds->large : learned.kinds->small;
    film.second = first_is_large ? learned.kinds->small : learned.kinds->large;
    const BothKinds both = find_both_kinds(frame, film, {});
    ASSERT_EQ(both.first.disks.size() + both.second.disks.size(), 24U);
    EXPECT_NEAR(both.first.disks[0].radius_px, first_is_large ? 12 : 8, 0.05);
    EXPECT_NEAR(both.second.disks[0].radius_px, first_is_large ? 8 : 12, 0.05);
  }
}

TEST(TwoKinds, AreRefusedWithTheirReason) {
  const GrayFrame frame = strewn_frame(two_sizes(), 184, 128);
  const LearnedKinds other = learn_two_kinds({&frame}, kinds_asked(1.8), {});
  EXPECT_FALSE(other.kinds);
  EXPECT_NE(other.why_not, "");
  std::vector<RenderedDisk> few = strewn_disks(6, 4, 28, 12);
  for (const std::size_t k : {3U, 8U, 13U, 22U}) few[k].radius_px = 8;
  const GrayFrame four = strewn_frame(few, 184, 128);
  const LearnedKinds fewer = learn_two_kinds({&four}, kinds_asked(1.5), {});
  EXPECT_FALSE(fewer.kinds);
  EXPECT_NE(fewer.why_not, "");
}

// --- other_shade.hpp -------------------------------------------------------------------------------------------------

// Of thirty beads every third is brighter than the background by half of what the others are darker.
TEST(TwoShades, HaveTheContrastOfEach) {
  const std::vector<RenderedDisk> all = strewn_disks(6, 5, 24, 9);
  std::vector<RenderedDisk> dark, bright;
  for (std::size_t k = 0; k < all.size(); ++k) (k % 3 == 1 ? bright : dark).push_back(all[k]);
  GrayFrame frame = strewn_frame(dark, 156, 132, 70);
  const GrayFrame others = strewn_frame(bright, 156, 132, 190), none = strewn_frame({}, 156, 132);
  for (std::size_t k = 0; k < frame.pixels.size(); ++k) frame.pixels[k] += others.pixels[k] - none.pixels[k];
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 9, false};
  CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  FindResult found = find_beads(frame, learned.calibration, options);
  ASSERT_EQ(found.disks.size(), 20U);
  const FindResult first = found;
  tell_radius(learned);
  learn_other_shade(frame, {}, learned.calibration, found);
  ASSERT_TRUE(learned.calibration.other_shade);
  EXPECT_EQ(learned.calibration.other_shade->polarity, Polarity::bright_beads);
  ASSERT_EQ(found.disks.size(), 30U);
  EXPECT_LT(farthest_found(all, found.disks), 0.2);
  std::size_t opposite = 0;
  for (const FoundDisk& disk : found.disks) {
    const bool of_bright = farthest_found(bright, {disk}) < 1;
    EXPECT_NEAR(disk.contrast, of_bright ? -0.5 : 1, 0.06);
    EXPECT_FALSE(disk.other_size);
    EXPECT_EQ(disk.radius_px, learned.calibration.radius_px) << "of one size";
    opposite += of_bright ? 1 : 0;
  }
  EXPECT_EQ(opposite, 10U);
  EXPECT_TRUE(std::is_sorted(found.disks.begin(), found.disks.end(),
                             [](const FoundDisk& a, const FoundDisk& b) { return a.y_px < b.y_px; }));
  EXPECT_TRUE(test::any_holds(learned.calibration.warnings,
                              "In the first frame 10 of 30 beads differ from the background by 0.5"));
  EXPECT_TRUE(test::any_holds(learned.calibration.warnings, "of what the others do, in the opposite direction."));
  EXPECT_LT(learned.calibration.expected_missed, 0.01);
  // A later frame: the same beads are added to those of the first shade.
  FindResult again = first;
  add_other_shade(frame, learned.calibration, {}, again);
  EXPECT_EQ(again.disks.size(), 30U);
  EXPECT_LT(farthest_found(all, again.disks), 0.2);
}

// --- settle_channel.hpp ----------------------------------------------------------------------------------------------

struct TwoChannels {
  std::vector<RenderedDisk> all = strewn_disks(5, 4, 24, 9);
  ChannelFrames frames;
  SurveyCandidate best;
  // Red shows every second bead, dark; green all of them, of this level.
  explicit TwoChannels(double green_level, double noise = 2) {
    std::vector<RenderedDisk> half;
    for (std::size_t k = 0; k < all.size(); k += 2) half.push_back(all[k]);
    frames.width = 132, frames.height = 108;
    frames.channels = {{Channel::red, strewn_frame(half, 132, 108)},
                       {Channel::green, strewn_frame(all, 132, 108, green_level, noise)}};
    best.channel = Channel::red, best.rims.radius_px = 9, best.rims.polarity = Polarity::dark_beads;
    for (const Circle& circle : circles_of(half)) best.disks.push_back({circle, 1, 0.01, false});
  }
};

TEST(SettledChannel, IsThatOfMostBeads) {
  const TwoChannels bright(230);
  const SurveyCandidate settled = settle_channel(bright.frames, bright.best, {});
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_EQ(settled.rims.polarity, Polarity::bright_beads);
  EXPECT_FALSE(settled.by_rims);
  EXPECT_EQ(settled.rims.radius_px, 9);
  SurveyOptions dark_alone;
  dark_alone.polarity = Polarity::dark_beads;
  EXPECT_EQ(settle_channel(bright.frames, bright.best, dark_alone).channel, Channel::red);
  const TwoChannels dark(80);
  EXPECT_EQ(settle_channel(dark.frames, dark.best, {}).rims.polarity, Polarity::dark_beads);
  EXPECT_EQ(settle_channel(dark.frames, dark.best, {}).channel, Channel::green);
}

TEST(SettledChannel, IsLeftForNothingElse) {
  // Less than four grey levels are hardly seen, be the noise ever so small.
  const TwoChannels faint(153.5, 0.2), plain(155, 0.2);
  EXPECT_EQ(settle_channel(faint.frames, faint.best, {}).channel, Channel::red);
  EXPECT_EQ(settle_channel(plain.frames, plain.best, {}).channel, Channel::green);
  TwoChannels one(230);
  one.frames.channels.resize(1);
  EXPECT_EQ(settle_channel(one.frames, one.best, {}).channel, Channel::red);
  one.best.channel = Channel::blue;
  EXPECT_EQ(settle_channel(one.frames, one.best, {}).channel, Channel::blue) << "a channel that is not there";
}

// --- radius from several frames
// ----------------------------------------------------------------------------------------

FindResult with_profile(double radius_px, std::size_t beads) {
  FindResult found;
  found.profile = test::blurred_profile(radius_px, 0.9, 14);
  found.profile_beads = beads;
  return found;
}
FinderCalibration of_all_rims() {
  FinderCalibration calibration;
  calibration.radius_px = calibration.rim_radius_px = 9, calibration.edge_width_px = 0.9;
  calibration.radius_std_error_px = 0.5;
  calibration.noise_level = calibration.residual_level = 2, calibration.contrast_level = -80;
  calibration.radius_of_all_rims = true;
  calibration.light = {50, 2, 2, std::vector<float>(4, 150.0F), std::vector<float>(4, -80.0F)};
  return calibration;
}
FinderCalibration refined(const std::vector<FindResult>& frames) {
  RadiusFromFrames radius;
  for (const FindResult& frame : frames) radius.add(frame);
  FinderCalibration calibration = of_all_rims();
  radius.refine(calibration);
  return calibration;
}

// Ten beads of 8.9 px and thirty of 9.1 px are forty of 9.05 px.
TEST(RadiusFromSeveralFrames, IsThatOfTheMeanOfAllBeads) {
  const FinderCalibration mixed = refined({with_profile(8.9, 10), with_profile(9.1, 30)});
  EXPECT_NEAR(mixed.radius_px, 9.05, 0.01);
  EXPECT_LT(mixed.radius_std_error_px, 0.1);
  EXPECT_GT(mixed.radius_std_error_px, 1e-3);
  const FinderCalibration other =
      refined({with_profile(9.1, 30), with_profile(8.9, 10), FindResult(), with_profile(20, 0)});
  EXPECT_NEAR(other.radius_px, mixed.radius_px, 1e-6) << "in any order, and without frames that show none";
  FindResult longer = with_profile(9, 99);
  longer.profile = test::blurred_profile(12, 0.9, 18);
  EXPECT_EQ(refined({with_profile(8.9, 10), with_profile(9.1, 30), longer}).radius_px, mixed.radius_px);
  EXPECT_LT(refined({with_profile(9, 1000), with_profile(9, 3000)}).radius_std_error_px, mixed.radius_std_error_px);
}

TEST(RadiusFromSeveralFrames, StaysWhereTheyTellNothingNew) {
  EXPECT_EQ(refined({}).radius_px, 9);
  EXPECT_EQ(refined({with_profile(8.8, 30)}).radius_px, 9) << "one frame is what was learned from";
  RadiusFromFrames radius;
  radius.add(with_profile(8.8, 30)), radius.add(with_profile(8.8, 30));
  FinderCalibration calibration = of_all_rims();
  calibration.radius_of_all_rims = false;
  radius.refine(calibration);
  EXPECT_EQ(calibration.radius_px, 9);
  calibration.radius_of_all_rims = true, calibration.tone_exponent = 0.45;
  radius.refine(calibration);
  EXPECT_EQ(calibration.radius_px, 9);
  EXPECT_EQ(calibration.radius_std_error_px, 0.5);
}

// --- film_calibration.hpp --------------------------------------------------------------------------------------------

// Places given in a frame whose pixels are 1.1 times as wide as high are those of the true frame, which is stretched
// from its left edge: column x is at 1.1 (x + 1/2) - 1/2 without the margin, rows stay.
TEST(FilmCalibrated, TakesPlacesThroughItsLens) {
  const GrayFrame frame = strewn_frame(strewn_disks(5, 4, 24, 9), 132, 108);
  MeasureOptions options;
  options.bead_diameter_m = 0.002;
  options.pixel_aspect = 1.1, options.lens_radial = 0;
  options.floor_px = 100, options.floor_slope = 0.11;
  options.left_wall_px = 4, options.right_wall_px = 128;
  options.find.roi = PixelRectangle{2, 3, 120, 100};
  options.find.radius_px = 9;
  FrameSource source = FrameSource::from_frames({frame});
  const FilmCalibration film = calibrate_film(source, options);
  const LensMap map({1.1, 0}, 132, 108);
  const double margin_x = map.to_true({0, 0}).x - (1.1 * 0.5 - 0.5), margin_y = map.to_true({0, 0}).y;
  EXPECT_NEAR(*film.options.left_wall_px - margin_x, 1.1 * 4.5 - 0.5, 1e-9);
  EXPECT_NEAR(*film.options.right_wall_px - margin_x, 1.1 * 128.5 - 0.5, 1e-9);
  EXPECT_NEAR(*film.options.floor_slope, 0.1, 1e-9) << "0.11 px down per px of 1.1";
  const double left_edge = map.to_true({0, 100}).x;
  EXPECT_NEAR(*film.options.floor_px + 0.1 * left_edge, 100 + margin_y, 1e-9);
  const PixelRectangle& roi = *film.options.find.roi;
  EXPECT_EQ(roi.left, std::lround(1.1 * 2.5 - 0.5 + margin_x));
  EXPECT_EQ(roi.width, 132);
  EXPECT_EQ(roi.height, 100);
  EXPECT_EQ(roi.top, std::lround(3 + margin_y));
  EXPECT_EQ(film.recorded_width, 132);
  EXPECT_EQ(film.recorded_height, 108);
  EXPECT_EQ(film.lens.pixel_aspect, 1.1);
  EXPECT_EQ(film.aspect_std_error, 0) << "it was given";
}

TEST(FilmCalibrated, SaysWhyNoFrameShowsABead) {
  MeasureOptions options;
  options.bead_diameter_m = 0.002;
  const auto why = [&](std::vector<GrayFrame> frames) {
    FrameSource source = FrameSource::from_frames(std::move(frames));
    try {
      calibrate_film(source, options);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string blank = why({test::even_frame(60, 50, 100), test::even_frame(60, 50, 100)});
  EXPECT_TRUE(test::holds(blank, "no disks in any of the first 2 frames")) << blank;
  EXPECT_TRUE(test::holds(why({}), "none could be read")) << why({});
}

// --- learn_beads.hpp -------------------------------------------------------------------------------------------------

// Eight of 24 beads are of another size: by rims alone each has its radius, and a sentence says so.
TEST(BeadsByRims, OfTwoSizesSayHowMany) {
  std::vector<RenderedDisk> truth = strewn_disks(6, 4, 30, 9);
  for (std::size_t k = 0; k < truth.size(); k += 3) truth[k].radius_px = 13;
  const GrayFrame frame = strewn_frame(truth, 200, 140);
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 9, false};
  options.quick_rims_only = true, options.recorded_px = 2;
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found && learned.calibration.by_rims) << learned.why_not;
  const FinderCalibration& finder = learned.calibration;
  ASSERT_EQ(finder.warnings.size(), 1U);
  EXPECT_TRUE(test::holds(finder.warnings[0], "In the first frame 8 of 24 beads do not have the most frequent size"));
  EXPECT_TRUE(test::holds(finder.warnings[0], "with radii from 17.") || test::holds(finder.warnings[0], "from 18."))
      << finder.warnings[0] << ": px as recorded, two of which are one here";
  EXPECT_TRUE(test::holds(finder.warnings[0], "to 25.") || test::holds(finder.warnings[0], "to 26."));
  ASSERT_TRUE(learned.in_last_frame);
  for (const FoundDisk& disk : learned.in_last_frame->disks) {
    std::vector<RenderedDisk> same;
    for (const RenderedDisk& one : truth)
      if (std::hypot(one.x_px - disk.x_px, one.y_px - disk.y_px) < 3) same.push_back(one);
    ASSERT_EQ(same.size(), 1U);
    EXPECT_EQ(disk.other_size, same[0].radius_px == 13);
    EXPECT_NEAR(disk.radius_px, same[0].radius_px, 0.4);
    EXPECT_NEAR(disk.contrast, 1, 0.2);
    EXPECT_GT(disk.variance_x, 0);
    EXPECT_EQ(disk.variance_x, disk.variance_y);
    EXPECT_EQ(disk.quality, disk.probability);
    EXPECT_FALSE(disk.half_hidden || disk.cut);
  }
  options.roi = PixelRectangle{60, 30, 70, 70};  // centres from 59.5 and 29.5 to 129.5 and 99.5
  const FindResult inside = find_beads(frame, finder, options);
  std::size_t expected = 0;
  for (const RenderedDisk& one : truth)
    expected += one.x_px > 59.5 && one.x_px < 129.5 && one.y_px > 29.5 && one.y_px < 99.5 ? 1 : 0;
  EXPECT_EQ(inside.disks.size(), expected);
  for (const FoundDisk& disk : inside.disks)
    EXPECT_EQ(disk.cut, disk.x_px - disk.radius_px < 59.5 || disk.x_px + disk.radius_px > 129.5 ||
                            disk.y_px - disk.radius_px < 29.5 || disk.y_px + disk.radius_px > 99.5);
}

// Half of each rim is as dark as the bead: of what is left of it 70 % at most are met.
TEST(BeadsByRims, OfWhichHalfIsSeenAreDoubted) {
  const std::vector<RenderedDisk> truth = strewn_disks(5, 4, 26, 9);
  GrayFrame frame = strewn_frame(truth, 140, 116);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      for (const RenderedDisk& disk : truth) {
        const double dx = column - disk.x_px, dy = row - disk.y_px;
        if (dy > 3.5 && std::hypot(dx, dy) < 15)  // the lower part fades out
          test::set(frame, column, row, 150 + 2 * (test::scattered(column, row) - 0.5));
      }
  FindOptions options;
  options.seen = BeadsSeen{Polarity::dark_beads, 9, false};
  options.quick_rims_only = true, options.one_size = true;
  const CalibrationResult learned = learn_beads({&frame}, options);
  ASSERT_TRUE(learned.found) << learned.why_not;
  EXPECT_TRUE(test::any_holds(learned.calibration.warnings, "Beads were found by their rims alone. On average only"));
}

// Faces are beads where a rim of theirs is seen: of rims of the other sign none is.
TEST(FacesWithoutARim, AreNoBeads) {
  const GrayFrame frame = strewn_frame(strewn_disks(5, 4, 24, 9), 132, 108);
  FinderCalibration finder;
  const FindResult faces = find_disks(frame, {.radius_px = 9}, &finder);
  ASSERT_EQ(faces.disks.size(), 20U);
  finder.rims = learn_rims(frame, Polarity::dark_beads, 9).model;
  finder.rims_to_be_checked = true;
  const FindResult checked = find_beads(frame, finder, {});
  EXPECT_EQ(checked.disks.size(), 20U);
  EXPECT_EQ(checked.rejected, faces.rejected);
  for (const FoundDisk& disk : checked.disks) EXPECT_GE(disk.probability, 0.95);
  // A face like all others is a bead where a rim is seen at all, however likely chance makes up such rims.
  const std::vector<double> learned = finder.rims->probability;
  finder.rims->probability.assign(21, 0.6);
  const FindResult doubtful = find_beads(frame, finder, {});
  ASSERT_EQ(doubtful.disks.size(), 20U);
  for (const FoundDisk& disk : doubtful.disks) EXPECT_EQ(disk.probability, 0.95);
  finder.rims->probability = learned;
  finder.rims->polarity = Polarity::bright_beads;
  const FindResult none = find_beads(frame, finder, {});
  EXPECT_TRUE(none.disks.empty());
  EXPECT_EQ(none.rejected, faces.rejected + 20);
  EXPECT_EQ(none.why_nothing, "none of the disks has a visible rim");
  finder.rims_to_be_checked = false;
  EXPECT_EQ(find_beads(frame, finder, {}).disks.size(), 20U);
}

// One whose rim is too faint to be seen is a bead where its neighbours have rims, and none elsewhere.
TEST(FacesWithoutARim, AreBeadsAmongBeads) {
  for (const bool among : {true, false}) {
    std::vector<RenderedDisk> disks = strewn_disks(5, 4, 22, 9);
    if (!among) disks[7].x_px = 190, disks[7].y_px = 140;
    GrayFrame frame = strewn_frame(disks, 220, 170);
    FinderCalibration finder;
    ASSERT_EQ(find_disks(frame, {.radius_px = 9}, &finder).disks.size(), 20U);
    const double ground = 150;
    for (int row = 0; row < frame.height; ++row)
      for (int column = 0; column < frame.width; ++column)
        if (std::hypot(column - disks[7].x_px, row - disks[7].y_px) < 11)
          test::set(frame, column, row, ground + 0.65 * (static_cast<double>(frame.at(column, row)) - ground));
    finder.rims = learn_rims(frame, Polarity::dark_beads, 9).model;
    finder.rims_to_be_checked = true;
    std::vector<Circle> places;
    for (const RenderedDisk& disk : disks) places.push_back({disk.x_px, disk.y_px, 9});
    while (rims_at(frame, *finder.rims, places)[7].support >= 0.2) finder.rims->threshold *= 1.05F;
    const FindResult found = find_beads(frame, finder, {});
    EXPECT_EQ(found.disks.size(), among ? 20U : 19U);
  }
}

// --- missed_beads.hpp ------------------------------------------------------------------------------------------------

TEST(MissedBeads, AreAShareOfAllBeads) {
  EXPECT_DOUBLE_EQ(share_of_missed(3, 7), 0.3);
  EXPECT_DOUBLE_EQ(share_of_missed(1.1, 0), 1);
  EXPECT_DOUBLE_EQ(share_of_missed(0.4, 0), 0.4) << "less than one bead in all";
  EXPECT_EQ(share_of_missed(0, 0), 0);
}

// A place counts by the area of the largest of three sizes that fits: 1, 0.8 and 0.6 radii of the beads. Here four
// beads leave room for no more than the one between them. What little separates the rims hides a seventh of it at most.
TEST(MissedBeads, CountByTheirArea) {
  const auto missed = [](double radius) {
    std::vector<RenderedDisk> truth = strewn_disks(4, 4, 26, 9);
    const double away = radius + 9.4;
    for (const auto& [dx, dy] : {std::pair{-1, 0}, {1, 0}, {0, -1}, {0, 1}})
      truth.push_back({165 + away * dx, 60 + away * dy, 9, 0, 0});
    std::vector<Circle> found = circles_of(truth);
    truth.push_back({165, 60, radius, 0, 0});
    const GrayFrame frame = strewn_frame(truth, 220, 120);
    const RimModel model = learn_rims(frame, Polarity::dark_beads, 9).model;
    return expected_missed_beads(frame, model, found, std::nullopt);
  };
  for (const auto& [radius, area] : {std::pair{9.0, 1.0}, {7.2, 0.64}, {5.4, 0.36}}) {
    EXPECT_LE(missed(radius), area + 1e-9) << radius;
    EXPECT_GT(missed(radius), 6.0 / 7 * area) << radius;
  }
}

}  // namespace
}  // namespace shakebed::ingest
