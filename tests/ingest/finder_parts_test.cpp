// Parts of the finder on small drawn pictures: rims, packed beds, missed beads, what is reported, and what is painted.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/calibrate/radius_vote.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/circle_census.hpp"
#include "ingest/find/find_disks.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/packed_bed.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/profile/overlay.hpp"
#include "ingest/profile/shaking.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

// 5 x 4 disks of 9 px, 24 px apart, dark by 80 levels.
std::vector<RenderedDisk> twenty_disks() {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 20; ++k) disks.push_back({22.3 + 24.1 * (k % 5), 20.7 + 24.3 * (k / 5), 9, 0, 0});
  return disks;
}
GrayFrame drawn(const std::vector<RenderedDisk>& disks, double bead = 70, int width = 140, int height = 116) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.background_level = 150, camera.bead_level = bead;
  camera.blur_px = 0.8, camera.read_noise = 2;
  return render_frame(disks, camera);
}

TEST(FinderParts, RimsAreLearnedFromTheirFrame) {
  const GrayFrame frame = drawn(twenty_disks());
  LearnedRims learned = learn_rims(frame, Polarity::dark_beads, 8.7);
  const RimModel& model = learned.model;
  EXPECT_EQ(learned.disks.size(), 20U);
  // The variance of the edge, 0.64 + 1/12 + 1 + 1/3 + 1/6, moves the rim in by half of it over the radius; towards open
  // sides that is put right.
  EXPECT_NEAR(model.radius_px, 9 - 2.22 / 18, 0.06);
  EXPECT_NEAR(model.open_radius_px, 9, 0.08);
  EXPECT_LT(model.radius_spread, 0.01);
  EXPECT_GT(model.radius_std_error_px, 1e-4);
  EXPECT_LT(model.radius_std_error_px, 0.02);
  EXPECT_NEAR(model.contrast, 2.5 * 80 / std::sqrt(2 * std::numbers::pi * 2.22), 2.5);
  ASSERT_EQ(model.probability.size(), 21U);
  // Twenty circles of full support, none by chance: 1 - 0.05/20.
  EXPECT_NEAR(model.probability.back(), 1 - 0.05 / 20, 2e-3);
  EXPECT_GT(learned.edge_length_px, 0.8 * 20 * 2 * std::numbers::pi * 9);
  EXPECT_LT(learned.edge_length_px, 1.5 * 20 * 2 * std::numbers::pi * 9);
  EXPECT_NEAR(expected_wrong_share(learned.disks), 1 - model.probability.back(), 2e-3);
  EXPECT_EQ(expected_wrong_share({}), 1);
  EXPECT_TRUE(roundness_of(frame, model, learned.disks).round());
  for (std::size_t k = 0; k < 20; ++k) {  // from the top, then from the left
    const RimDisk& disk = learned.disks[k];
    const auto truth = twenty_disks();
    const auto nearest = std::min_element(truth.begin(), truth.end(), [&](const auto& a, const auto& b) {
      return std::hypot(a.x_px - disk.circle.x, a.y_px - disk.circle.y) <
             std::hypot(b.x_px - disk.circle.x, b.y_px - disk.circle.y);
    });
    const double off = std::hypot(nearest->x_px - disk.circle.x, nearest->y_px - disk.circle.y);
    EXPECT_LT(off, 0.1) << k;
    EXPECT_GT(disk.variance_px2, 0);
    EXPECT_LT(disk.variance_px2, 0.02);
    EXPECT_FALSE(disk.other_size);
    if (k > 0) {
      EXPECT_GE(disk.circle.y, learned.disks[k - 1].circle.y);
    }
  }
  learn_gaps(frame, learned, true);
  ASSERT_TRUE(learned.model.gaps);
  const RimsFound again = find_rims(frame, learned.model);
  EXPECT_EQ(again.disks.size(), 20U);
  EXPECT_LT(again.expected_missed, 0.5);
  // Places 2 px off lead to their circles; one where no bead is has no support.
  const auto fitted = rims_at(frame, learned.model, {{24.2, 20.9, 9}, {34.4, 33, 9}});
  EXPECT_NEAR(fitted[0].x, 22.3, 0.1);
  EXPECT_NEAR(fitted[0].y, 20.7, 0.1);
  EXPECT_GT(fitted[0].support, 0.95);
  EXPECT_LT(fitted[1].support, 0.3);
}

// Of twenty beads so many are not among those found: so many are missed.
TEST(FinderParts, MissedBeadsAreCounted) {
  const auto truth = twenty_disks();
  const GrayFrame frame = drawn(truth);
  const LearnedRims learned = learn_rims(frame, Polarity::dark_beads, 9);
  for (const std::size_t missing : {0U, 1U, 3U}) {
    std::vector<Circle> found;
    for (std::size_t k = 0; k < 20; ++k)
      if (k != 7 && !(missing > 1 && (k == 2 || k == 16))) found.push_back({truth[k].x_px, truth[k].y_px, 9});
    if (missing == 0) found.push_back({truth[7].x_px, truth[7].y_px, 9});
    EXPECT_NEAR(expected_missed_beads(frame, learned.model, found, std::nullopt), static_cast<double>(missing), 0.01);
    // In the upper half alone.
    const double upper = expected_missed_beads(frame, learned.model, found, PixelRectangle{0, 0, 140, 58});
    EXPECT_NEAR(upper, missing == 0 ? 0 : missing == 1 ? 1 : 2, 0.01);
  }
}

// As many of a picture twice as large, which is looked at on a reduced one.
TEST(FinderParts, MissedBeadsAreCountedInLargePicturesToo) {
  std::vector<RenderedDisk> truth = twenty_disks();
  for (RenderedDisk& disk : truth) disk.x_px *= 2, disk.y_px *= 2, disk.radius_px *= 2;
  const GrayFrame frame = drawn(truth, 70, 280, 232);
  const LearnedRims learned = learn_rims(frame, Polarity::dark_beads, 18);
  for (const std::size_t missing : {0U, 1U, 3U}) {
    std::vector<Circle> found;
    for (std::size_t k = 0; k < 20; ++k)
      if (k % 7 != 2 || k / 7 >= missing) found.push_back({truth[k].x_px, truth[k].y_px, 18});
    EXPECT_NEAR(expected_missed_beads(frame, learned.model, found, std::nullopt), static_cast<double>(missing), 0.01);
    const double upper = expected_missed_beads(frame, learned.model, found, PixelRectangle{0, 0, 280, 116});
    EXPECT_NEAR(upper, std::min(static_cast<double>(missing), 2.0), 0.01);  // of 2, 9 and 16
  }
}

TEST(FinderParts, CensusFindsTheRadiusThatExplainsMost) {
  const GrayFrame frame = drawn(twenty_disks()), bright = drawn(twenty_disks(), 230);
  const CircleCensus census = take_census({&frame});
  ASSERT_FALSE(census.hypotheses.empty());
  const CircleHypothesis& best = census.hypotheses.front();
  EXPECT_EQ(best.channel, 0U);
  EXPECT_EQ(best.polarity, Polarity::dark_beads);
  EXPECT_NEAR(best.radius_px, 9, 0.9);
  EXPECT_EQ(best.circles, 20);
  EXPECT_EQ(best.by_chance, 0);
  EXPECT_EQ(best.seen.size(), 20U);
  EXPECT_GT(best.explained_share, 0.6);
  EXPECT_LT(best.scatter, 0.03);
  // 2 pi R support - 8 px for each circle.
  double gain = 0;
  for (const Circle& circle : best.seen) gain += 2 * std::numbers::pi * circle.radius * circle.support - 8;
  EXPECT_NEAR(best.gain_px / gain, 1, 0.05);
  const CircleCensus two = take_census({&frame, &bright}, {Polarity::bright_beads, std::nullopt});
  ASSERT_FALSE(two.hypotheses.empty());
  EXPECT_EQ(two.hypotheses.front().channel, 1U);
  EXPECT_EQ(two.hypotheses.front().polarity, Polarity::bright_beads);
  // Best first, each another radius or polarity.
  EXPECT_GE(census.hypotheses.size(), 2U);
  for (std::size_t k = 1; k < census.hypotheses.size(); ++k) {
    const CircleHypothesis& one = census.hypotheses[k];
    EXPECT_LE(one.gain_px, census.hypotheses[k - 1].gain_px);
    for (std::size_t i = 0; i < k; ++i) {
      const CircleHypothesis& other = census.hypotheses[i];
      const double ratio = one.radius_px / other.radius_px;
      EXPECT_TRUE(one.polarity != other.polarity || std::max(ratio, 1 / ratio) >= 1.15) << i << ' ' << k;
    }
  }
}

TEST(FinderParts, SurveyWeighsItsCandidates) {
  ChannelFrames frames;
  frames.width = 140, frames.height = 116;
  frames.channels.push_back({Channel::grey, drawn(twenty_disks())});
  const Survey survey = take_survey(frames);
  ASSERT_TRUE(survey.found) << survey.why_not;
  const SurveyCandidate& best = survey.candidates.front();
  EXPECT_EQ(best.channel, Channel::grey);
  EXPECT_EQ(best.disks.size(), 20U);
  EXPECT_TRUE(best.credible && best.plausible);
  EXPECT_FALSE(best.one_sided || best.not_round || best.few_edges);
  EXPECT_EQ(best.why_not, "");
  double gain = 0, length = 0;
  for (const RimDisk& disk : best.disks) {
    const double rim = 2 * std::numbers::pi * disk.circle.radius * disk.circle.support * disk.probability;
    gain += rim - disk.circle.radius, length += rim;  // a circle costs 8 px at a radius of 8
  }
  EXPECT_NEAR(best.gain_px, gain, 1e-6);
  EXPECT_GT(best.explained_share, 0.6);
  EXPECT_LT(best.explained_share, 1.2);
  EXPECT_NEAR(best.expected_wrong, expected_wrong_share(best.disks), 1e-12);
  // Reduced frames: lengths of the recorded one. Another radius than the one given is none.
  frames.reduction = 3, frames.width = 420, frames.height = 348;
  SurveyOptions given;
  given.radius_px = 27;
  const Survey enlarged = take_survey(frames, given);
  ASSERT_TRUE(enlarged.found);
  const SurveyCandidate& same = enlarged.candidates.front();
  EXPECT_NEAR(same.rims.radius_px, 3 * best.rims.radius_px, 0.05);
  EXPECT_NEAR(same.rims.open_radius_px, 3 * best.rims.open_radius_px, 0.05);
  EXPECT_NEAR(same.gain_px / best.gain_px, 3, 0.05);
  EXPECT_NEAR(same.disks[4].circle.x, 3 * best.disks[4].circle.x + 1, 0.1);
  EXPECT_NEAR(same.disks[4].circle.y, 3 * best.disks[4].circle.y + 1, 0.1);
  EXPECT_NEAR(same.disks[4].variance_px2 / best.disks[4].variance_px2, 9, 2);
  given.radius_px = 40;
  EXPECT_FALSE(take_survey(frames, given).found);
}

// --- packed_bed.hpp --------------------------------------------------------------------------------------------------

TEST(FinderParts, PackingConvincesWithinItsLimits) {
  const auto convinces = [](const auto& change) {
    Packing packing;
    packing.disks = 20, packing.touching = 0.5, packing.overlapping = 0.02, packing.unexplained = 0.003;
    packing.misfit = 1.2, packing.filled = 0.2;
    change(packing);
    return packing.convinces();
  };
  EXPECT_TRUE(convinces([](Packing&) {}));
  EXPECT_FALSE(convinces([](Packing& p) { p.disks = 19; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.touching = 0.49; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.overlapping = 0.021; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.unexplained = 0.0031; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.misfit = 1.21; }));
  EXPECT_TRUE(convinces([](Packing& p) { p.misfit = 2, p.lit = true; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.misfit = 2.01, p.lit = true; }));
  EXPECT_FALSE(convinces([](Packing& p) { p.filled = 0.19; }));
}

// A square of touching disks: each has two neighbours or more a diameter away; 2 of 25 overlap once one is moved.
TEST(FinderParts, PackingIsThatOfItsDisks) {
  std::vector<RenderedDisk> truth;
  for (int k = 0; k < 25; ++k) truth.push_back({20.0 + 20 * (k % 5), 20.0 + 20 * (k / 5), 10, 0, 0});
  const GrayFrame frame = drawn(truth, 70, 120, 120);
  FinderCalibration faces;
  FindResult found = find_disks(frame, {.radius_px = 10}, &faces);
  ASSERT_EQ(found.disks.size(), 25U);
  const Packing packing = packing_of(frame, found, faces);
  EXPECT_EQ(packing.disks, 25U);
  EXPECT_EQ(packing.touching, 1);
  EXPECT_EQ(packing.overlapping, 0);
  // The rectangle round the disks, counted in whole pixels.
  std::vector<double> across, down;
  for (const FoundDisk& disk : found.disks) across.push_back(disk.x_px), down.push_back(disk.y_px);
  const double radius = faces.radius_px;
  const auto pixels = [&](const std::vector<double>& places) {
    const auto [first, last] = std::minmax_element(places.begin(), places.end());
    return std::floor(*last + radius) - std::ceil(*first - radius) + 1;
  };
  EXPECT_NEAR(packing.filled, 25 * std::numbers::pi * radius * radius / (pixels(across) * pixels(down)), 1e-6);
  EXPECT_LT(packing.unexplained, 0.003);
  EXPECT_NEAR(packing.misfit, 1, 0.2);
  const double diameter = 2 * faces.radius_px;
  found.disks[6].x_px = found.disks[7].x_px - 0.88 * diameter;
  EXPECT_NEAR(packing_of(frame, found, faces).overlapping, 2.0 / 25, 1e-9);
  EXPECT_GT(packing_of(frame, found, faces).unexplained, 0.01);
  EXPECT_EQ(packing_of(frame, {}, faces).disks, 0U);
  const RimModel rims = rims_of(faces);
  EXPECT_EQ(rims.radius_px, faces.radius_px);
  EXPECT_EQ(rims.open_radius_px, faces.radius_px);
  EXPECT_EQ(rims.contrast, std::abs(faces.contrast_level));
  EXPECT_EQ(rims.probability, std::vector<double>(21, 1.0));
  EXPECT_EQ(rims.polarity, Polarity::dark_beads);
  // What is left of the frame is its noise, 2 levels; where a bead is not taken out, its contrast.
  const GrayFrame left = residual_frame(frame, find_disks(frame, faces), faces);
  double square = 0;
  for (const float level : left.pixels) square += static_cast<double>(level) * static_cast<double>(level) / 14400;
  EXPECT_NEAR(std::sqrt(square), 2, 0.25);
  EXPECT_NEAR(residual_frame(frame, {}, faces).at(60, 60), -80, 8);
}

// Nearest distances of 20, 20.4, 20.8 and so on: most lie within 5 % of one another.
TEST(FinderParts, TouchingRadiusIsHalfTheMostFrequentDistance) {
  const auto radius = [](const std::vector<double>& distances) {
    std::vector<Circle> circles;
    for (std::size_t k = 0; k < distances.size(); ++k) {
      circles.push_back({300.0 * static_cast<double>(k), 50, 9});
      circles.push_back({300.0 * static_cast<double>(k) + distances[k], 50, 9});
    }
    return touching_radius(circles);
  };
  ASSERT_TRUE(radius({20, 20.2, 20.4, 20.6, 26, 33}));
  EXPECT_NEAR(*radius({20, 20.2, 20.4, 20.6, 26, 33}), 0.5 * 20.4, 1e-9);
  EXPECT_FALSE(radius({20, 22, 25, 28, 32, 35})) << "at all distances";
  EXPECT_FALSE(radius({20, 20, 20}));
  EXPECT_TRUE(radius({20, 20, 20, 20}));
  EXPECT_FALSE(radius({37, 37, 37, 37})) << "beyond four radii";
}

// --- what is found ---------------------------------------------------------------------------------------------------

// Beads cut by sides, a region, and a frame of another size.
TEST(FinderParts, DisksAreReportedFromTheirRegion) {
  const auto truth = twenty_disks();
  const GrayFrame frame = drawn(truth);
  FinderCalibration faces;
  FindResult all = find_disks(frame, {}, &faces);
  ASSERT_EQ(all.disks.size(), 20U);
  for (std::size_t k = 1; k < 20; ++k) EXPECT_GE(all.disks[k].y_px, all.disks[k - 1].y_px) << "from the top";
  std::sort(all.disks.begin(), all.disks.end(), [](const FoundDisk& a, const FoundDisk& b) {
    const long one = std::lround(a.y_px), other = std::lround(b.y_px);
    return one != other ? one < other : a.x_px < b.x_px;
  });
  EXPECT_NEAR(faces.contrast_level, -80, 3);
  EXPECT_NEAR(faces.noise_level, 2, 0.3);
  EXPECT_NEAR(faces.residual_level, 2, 0.5);
  EXPECT_EQ(faces.disks_used, 20U);
  EXPECT_EQ(faces.frames_used, 1U);
  EXPECT_NEAR(faces.edge_width_px, std::hypot(0.8, 0.29), 0.1);
  double squares = 0, variances = 0;
  for (std::size_t k = 0; k < 20; ++k) {
    EXPECT_NEAR(all.disks[k].x_px, truth[k].x_px, 0.1);
    EXPECT_NEAR(all.disks[k].y_px, truth[k].y_px, 0.1);
    squares += std::pow(all.disks[k].x_px - truth[k].x_px, 2) + std::pow(all.disks[k].y_px - truth[k].y_px, 2);
    variances += all.disks[k].variance_x + all.disks[k].variance_y;
    EXPECT_EQ(all.disks[k].radius_px, faces.radius_px);
    EXPECT_NEAR(all.disks[k].contrast, 1, 0.03);
    EXPECT_GT(all.disks[k].quality, 0.97);
    EXPECT_FALSE(all.disks[k].cut || all.disks[k].half_hidden || all.disks[k].other_size);
  }
  EXPECT_NEAR(std::sqrt(squares / variances), 1, 0.45);  // of forty numbers, 4 standard errors
  FindOptions options;
  options.roi = PixelRectangle{20, 18, 50, 90};
  const FindResult inside = find_disks(frame, faces, options);
  for (const FoundDisk& disk : inside.disks) {
    EXPECT_GE(disk.x_px, 19.5);
    EXPECT_LT(disk.x_px, 69.5);
    EXPECT_GE(disk.y_px, 17.5);
    EXPECT_LT(disk.y_px, 107.5);
    const bool whole =
        disk.x_px - 9 >= 19.5 && disk.x_px + 9 <= 69.5 && disk.y_px - 9 >= 17.5 && disk.y_px + 9 <= 107.5;
    EXPECT_EQ(disk.cut, !whole);
  }
  EXPECT_EQ(inside.disks.size(), 8U);
  const FindResult other = find_disks(test::even_frame(139, 116, 150), faces);
  EXPECT_TRUE(other.empty());
  EXPECT_TRUE(test::holds(other.why_nothing, "139 x 116 px, but the beads were learned in frames of 140 x 116 px"));
  EXPECT_TRUE(test::holds(find_disks(test::even_frame(140, 116, 150), faces).why_nothing, "no place in the frame"));
  EXPECT_THROW(residual_frame(test::even_frame(139, 116, 150), all, faces), std::invalid_argument);
  // The bead as a picture has its levels in the middle and outside.
  const GrayFrame bead = bead_picture(faces, 3);
  EXPECT_EQ(bead.width, bead.height);
  EXPECT_EQ(bead.width, 2 * static_cast<int>(std::ceil(3 * faces.profile.reach_px())) + 1);
  EXPECT_NEAR(bead.at(bead.width / 2, bead.width / 2), 70, 3);
  EXPECT_NEAR(bead.at(0, 0), 150, 2);
  EXPECT_NEAR(bead.at(bead.width / 2 + 27, bead.width / 2), 110, 8) << "half of it at the rim";
  EXPECT_NEAR(bead.at(bead.width / 2, bead.width / 2 + 27), bead.at(bead.width / 2 + 27, bead.width / 2), 1e-3);
  // Outside it is the background in the middle of the frame.
  FinderCalibration lit = faces;
  lit.light.columns = 5, lit.light.rows = 3, lit.light.background.assign(15, 90.0F);
  lit.light.background[7] = 140;
  EXPECT_EQ(bead_picture(lit, 3).at(0, 0), 140);
}

// Walls and a floor of the beads' own level are not seen; background is.
TEST(FinderParts, WallsAreNotSeen) {
  std::vector<RenderedDisk> truth;
  for (int k = 0; k < 12; ++k) truth.push_back({34.0 + 26 * (k % 4), 30.0 + 26 * (k / 4), 9, 0, 0});
  GrayFrame frame = drawn(truth, 70, 150, 120);
  for (int row = 0; row < 120; ++row)
    for (int column = 0; column < 150; ++column)
      if (row > 105) test::set(frame, column, row, 70 + column % 2);
  const GrayFrame open = without_walls(frame, Polarity::dark_beads, 9);
  EXPECT_TRUE(unseen(open.at(75, 115)));
  EXPECT_TRUE(unseen(open.at(10, 107)));
  EXPECT_FALSE(unseen(open.at(75, 60)));
  EXPECT_FALSE(unseen(open.at(3, 3))) << "background";
  EXPECT_EQ(without_walls(drawn(truth, 70, 150, 120), Polarity::dark_beads, 9).pixels,
            drawn(truth, 70, 150, 120).pixels);
  FinderCalibration faces;
  find_disks(frame, {}, &faces);
  EXPECT_TRUE(faces.solid_borders);
  EXPECT_TRUE(unseen(seen_part(frame, faces).at(75, 115)));
  faces.solid_borders = false;
  EXPECT_EQ(seen_part(frame, faces).pixels, frame.pixels);
  std::vector<std::uint8_t> left_out(frame.pixels.size(), 0);
  left_out[5] = 1;
  faces.left_out = std::make_shared<const std::vector<std::uint8_t>>(left_out);
  EXPECT_EQ(seen_part(frame, faces).pixels[5], unseen_level);
  EXPECT_EQ(seen_part(frame, faces).pixels[6], frame.pixels[6]);
}

// --- calibration.hpp, radius_vote.hpp --------------------------------------------------------------------------------

TEST(FinderParts, RadiusIsThatOfTheVotes) {
  const GrayFrame frame = drawn(twenty_disks());
  const RadiusEstimate found = estimate_radius(frame);
  EXPECT_TRUE(found.found);
  EXPECT_NEAR(found.radius_px, 9, 0.5);
  EXPECT_EQ(found.polarity, Polarity::dark_beads);
  const auto votes = vote_for_radii(frame, 1, {7, 12});
  const auto best = std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) {
    return a.explained * a.support * a.support < b.explained * b.support * b.support;
  });
  EXPECT_GT(found.score, 0.8);
  EXPECT_LE(found.score, 1);
  EXPECT_EQ(best->sign, 1);
  EXPECT_EQ(best->count, 20U);
  // To the second nearest of its neighbours each is 24.1 or 24.3 px.
  EXPECT_NEAR(best->spacing.median, 24.3, 0.8);
  EXPECT_LT(best->spacing.scatter, 0.6);
  // Between the radii that are voted for, 4 % apart, a parabola leads to the one that is there.
  const auto voted = [](double radius) {
    std::vector<RenderedDisk> disks = twenty_disks();
    for (RenderedDisk& disk : disks) disk.radius_px = radius;
    return vote_for_radii(drawn(disks), 1, {7, 12}).front().radius;
  };
  for (const double radius : {9.1, 9.2, 9.3})
    EXPECT_NEAR(voted(radius) / voted(9), radius / 9, 0.015) << radius;  // without it: 0.02
  const auto twice = vote_for_radii(frame, 2, {7, 12});
  EXPECT_NEAR(twice.front().radius, 2 * votes.front().radius, 1e-9);
  EXPECT_NEAR(twice.front().spacing.median, 2 * votes.front().spacing.median, 1e-9);
  EXPECT_EQ(estimate_radius(drawn(twenty_disks(), 230)).polarity, Polarity::bright_beads);
  EXPECT_FALSE(estimate_radius(test::even_frame(80, 80, 9)).found);
  EXPECT_TRUE(test::holds(estimate_radius(test::even_frame(4, 80, 9)).why_not, "smaller than 5 x 5 px"));
  EXPECT_TRUE(vote_for_radii(test::even_frame(4, 9, 9), 1, {2, 3}).empty());
  for (const auto& other : found.others) EXPECT_GT(other.radius_px, 1);
  ASSERT_FALSE(found.others.empty());
  EXPECT_NEAR(found.others.front().radius_px, found.radius_px, 1e-9) << "the likeliest first";
}

// --- overlay.hpp -----------------------------------------------------------------------------------------------------

TEST(FinderParts, OverlaysShowDisksFloorAndWalls) {
  const test::ScratchFolder folder;
  const GrayFrame frame = test::even_frame(40, 30, 100);
  FoundDisk whole = test::found_at(12, 10, 6), cut = test::found_at(28, 10, 6);
  cut.cut = true;
  OverlayOptions options;
  options.magnification = 4;
  options.floor_px = 24, options.floor_slope = 0.1;
  options.left_wall_px = 2, options.right_wall_px = 37;
  write_overlay(folder / "o.png", frame, {whole, cut}, options);
  const cv::Mat picture = cv::imread(folder / "o.png");
  ASSERT_EQ(picture.cols, 160);
  ASSERT_EQ(picture.rows, 120);
  // Pixel (x, y) has its middle at 4 (x + 1/2) - 1/2.
  const auto strongest = [&](double x, double y, const cv::Vec3b& colour) {
    double least = 1e9;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) {
        const cv::Vec3b at = picture.at<cv::Vec3b>(static_cast<int>(std::lround(4 * (y + 0.5) - 0.5)) + dy,
                                                   static_cast<int>(std::lround(4 * (x + 0.5) - 0.5)) + dx);
        least = std::min(least, cv::norm(at, colour));
      }
    return least < 60;
  };
  const cv::Vec3b green(60, 220, 60), orange(0, 140, 255), blue(255, 140, 40);
  for (const double angle : {0.0, 1.0, 2.5, 4.0}) {
    EXPECT_TRUE(strongest(12 + 6 * std::cos(angle), 10 + 6 * std::sin(angle), green));
    EXPECT_TRUE(strongest(28 + 6 * std::cos(angle), 10 + 6 * std::sin(angle), orange));
  }
  EXPECT_TRUE(strongest(12, 10, green));
  EXPECT_FALSE(strongest(12, 13, green));
  EXPECT_TRUE(strongest(1, 24.1, blue));
  EXPECT_TRUE(strongest(36, 27.6, blue));
  EXPECT_TRUE(strongest(2, 5, blue));
  EXPECT_TRUE(strongest(37, 5, blue));
  EXPECT_FALSE(strongest(20, 5, blue));
  EXPECT_EQ(picture.at<cv::Vec3b>(2, 80), cv::Vec3b(100, 100, 100));
  EXPECT_THROW(write_overlay(folder / "o.png", {}, {}, options), InputError);
  // Enlarged by at most 8, and to at most ten million pixels.
  options.magnification = 20;
  write_overlay(folder / "o.png", frame, {}, options);
  EXPECT_EQ(cv::imread(folder / "o.png").cols, 320);
}

// --- shaking.hpp -----------------------------------------------------------------------------------------------------

// A bed that rides on a floor of 6 px and 0.13 cycles a frame: frequency, phase and middle follow; one that rests has
// none.
TEST(FinderParts, ShakingIsThatOfTheLowestBeads) {
  const auto film = [](double amplitude, double cycles) {
    std::vector<FrameFindings> frames(200);
    for (std::size_t f = 0; f < 200; ++f) {
      const double floor = 150 - amplitude * std::sin(2 * std::numbers::pi * (cycles * static_cast<double>(f) + 0.2));
      frames[f].report.index = f;
      for (int k = 0; k < 8; ++k)
        frames[f].disks.push_back(
            test::found_at(20 + 31 * k, floor - 10 + 0.05 * test::scattered(k, static_cast<int>(f))));
    }
    return frames;
  };
  MeasureOptions options;
  options.bead_diameter_m = 2e-3, options.frame_rate_hz = 100;
  const auto measured = [&](double amplitude, double cycles) {
    const auto frames = film(amplitude, cycles);
    BedCalibration bed;
    Shaking shaking(options);
    shaking.begin(frames, 20, 260, bed);
    for (const FrameFindings& frame : frames) shaking.add(frame, bed);
    shaking.finish(bed);
    return std::pair(bed, shaking.warnings());
  };
  const auto [bed, warnings] = measured(6, 0.13);
  EXPECT_NEAR(bed.shaking_frequency_hz, 13, 0.01);
  EXPECT_GT(bed.shaking_frequency_std_error_hz, 0);
  EXPECT_LT(bed.shaking_frequency_std_error_hz, 0.05);
  EXPECT_LT(bed.frequency_false_alarm, 1e-4);
  EXPECT_NEAR(bed.floor_px, 150, 0.1);
  EXPECT_NEAR(bed.floor_amplitude_px, 6, 0.1);
  EXPECT_NEAR(bed.floor_phase, 0.2, 5e-3);
  EXPECT_EQ(bed.floor_reference, FloorReference::mean_of_motion);
  EXPECT_FALSE(bed.frequency_given);
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_TRUE(test::holds(warnings[0], "The lowest beads move at 13")) << warnings[0];
  EXPECT_TRUE(test::holds(warnings[0], "87")) << "its alias";
  const auto rest = measured(0, 0.13).first;
  EXPECT_EQ(rest.shaking_frequency_hz, 0);
  EXPECT_FALSE(rest.why_no_frequency.empty());
  EXPECT_EQ(measured(0.3, 0.13).first.why_no_frequency, "the lowest beads move by less than 2 % of a diameter");
  options.shaking_frequency_hz = 13;
  const auto given = measured(6, 0.13);
  EXPECT_TRUE(given.first.frequency_given);
  EXPECT_EQ(given.first.shaking_frequency_hz, 13);
  EXPECT_TRUE(given.second.empty());
  options.shaking_frequency_hz = 17;
  EXPECT_TRUE(test::any_holds(measured(6, 0.13).second, "but 17 Hz was given"));
  options.shaking_frequency_hz = 26;
  EXPECT_FALSE(test::any_holds(measured(6, 0.13).second, "was given")) << "a bed may need two periods";
}

}  // namespace
}  // namespace shakebed::ingest
