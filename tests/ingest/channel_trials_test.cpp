// The channel in which beads are looked for, where the frame is reduced, larger than a trial looks at, or cut down to a
// region.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/settle_channel.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

std::vector<RenderedDisk> beads_of_trial() {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 20; ++k)
    disks.push_back({17 + 28.0 * (k % 5) + 5 * test::scattered(k % 5, k / 5),
                     17 + 28.0 * (k / 5) + 5 * test::scattered(k / 5 + 9, k % 5), 9, 0, 0});
  return disks;
}

// A frame that was reduced by `by`, in whose red channel these beads were seen, dark.
struct TrialFrames {
  ChannelFrames frames;
  SurveyCandidate best;

  TrialFrames(const std::vector<RenderedDisk>& in_red, const std::vector<RenderedDisk>& in_green, double green,
              int by = 1) {
    frames.reduction = by, frames.width = 150 * by, frames.height = 122 * by;
    frames.channels = {{Channel::red, test::beads_of_level(in_red, 70)},
                       {Channel::green, test::beads_of_level(in_green, green)}};
    best.channel = Channel::red, best.rims.radius_px = 9 * by, best.rims.polarity = Polarity::dark_beads;
    for (const RenderedDisk& disk : in_red) {
      RimDisk rim;
      rim.circle.x = by * (disk.x_px + 0.5) - 0.5, rim.circle.y = by * (disk.y_px + 0.5) - 0.5;
      rim.circle.radius = 9 * by;
      rim.probability = 1;
      best.disks.push_back(rim);
    }
  }
  [[nodiscard]] SurveyCandidate settled(const SurveyOptions& options = {}) const {
    return settle_channel(frames, best, options);
  }
};

TEST(ChannelTrials, KeepAChannelThatShowsAsManyBeads) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  EXPECT_EQ(TrialFrames(all, all, 230).settled().channel, Channel::red);
  EXPECT_EQ(TrialFrames({all.begin(), all.end() - 3}, all, 230).settled().channel, Channel::green);
}

// Of a frame that was reduced by three the candidate's places and lengths are three times those of the channels.
TEST(ChannelTrials, OfAReducedFrameLookWhereItsBeadsAre) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  const TrialFrames reduced({all.begin(), all.end() - 5}, all, 230, 3);
  const SurveyCandidate settled = reduced.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_EQ(settled.rims.polarity, Polarity::bright_beads);
  EXPECT_EQ(settled.rims.radius_px, 27);
  EXPECT_EQ(settled.disks.size(), 15U) << "those of the survey";
}

// At four times the columns, 70 and 154, there is nothing: a channel has no contrast there.
TEST(ChannelTrials, OfAReducedFrameMeasureTheContrastOnItsBeads) {
  std::vector<RenderedDisk> in_green;
  for (const double column : {17.0, 38.0, 115.0})
    for (int row = 0; row < 4; ++row) in_green.push_back({column, 17 + 28.0 * row, 9, 0, 0});
  EXPECT_EQ(TrialFrames({in_green.begin(), in_green.begin() + 8}, in_green, 230, 4).settled().channel, Channel::green);
}

// In the upper half both channels show the same ten beads.
TEST(ChannelTrials, CountBeadsInTheRegionAlone) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  const TrialFrames half({all.begin(), all.begin() + 10}, all, 230, 2);
  EXPECT_EQ(half.settled().channel, Channel::green);
  SurveyOptions upper;
  upper.roi = PixelRectangle{0, 0, 300, 122};
  EXPECT_EQ(half.settled(upper).channel, Channel::red);
}

GrayFrame sum_of(GrayFrame frame, const GrayFrame& more) {
  for (std::size_t k = 0; k < frame.pixels.size(); ++k) frame.pixels[k] += more.pixels[k] - 150;
  return frame;
}

// A packed bed. Red shows the faces of two thirds of it and the highlights of the others alone, as of blue balls on
// black: there are edges in places where a bead fits. Green shows each third with its own level, and of the last so
// many.
SurveyCandidate settled_of_packed(const std::array<double, 3>& levels, std::size_t of_last = 16) {
  std::array<std::vector<RenderedDisk>, 3> thirds;
  for (int row = 0; row < 7; ++row)
    for (int column = 0; column < 7; ++column)
      thirds[static_cast<std::size_t>((column + 2 * row) % 3)].push_back(
          {12 + 18.2 * column + 9.1 * (row % 2), 12 + 15.8 * row, 9, 0, 0});
  std::vector<RenderedDisk> in_red = thirds[0], highlights = thirds[2];
  in_red.insert(in_red.end(), thirds[1].begin(), thirds[1].end());
  for (RenderedDisk& disk : highlights) disk.x_px -= 3, disk.y_px -= 3, disk.radius_px = 2;
  thirds[2].resize(of_last);
  TrialFrames packed(in_red, {}, 230);
  packed.frames.channels[0].frame = sum_of(test::beads_of_level(in_red, 70), test::beads_of_level(highlights, 70, 0));
  packed.frames.channels[1].frame =
      sum_of(sum_of(test::beads_of_level(thirds[0], levels[0]), test::beads_of_level(thirds[1], levels[1], 0)),
             test::beads_of_level(thirds[2], levels[2], 0));
  return packed.settled();
}

TEST(ChannelTrials, LeaveFacesThatMissManyForAChannelThatIsAsSure) {
  const SurveyCandidate settled = settled_of_packed({230, 230, 230});
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_FALSE(settled.by_rims);
}

// 33 faces are found. In the last case rims of 35 beads are seen: not a tenth more.
TEST(ChannelTrials, LeaveFacesThatMissManyForRimsOfFarMore) {
  const SurveyCandidate settled = settled_of_packed({240, 200, 185});
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_TRUE(settled.by_rims);
  EXPECT_EQ(settled_of_packed({250, 210, 178}, 2).channel, Channel::red);
}

std::vector<RenderedDisk> ten_beads() {
  const std::vector<RenderedDisk> all = beads_of_trial();
  return {all.begin(), all.begin() + 10};
}

// Rims of 2 px alone.
GrayFrame rings_of(const std::vector<RenderedDisk>& disks) {
  std::vector<RenderedDisk> inside = disks;
  for (RenderedDisk& disk : inside) disk.radius_px -= 2;
  return sum_of(test::beads_of_level(disks, 70), test::beads_of_level(inside, 230));
}

// Of each bead the left is brighter than the background and the right darker; in between, in `hidden` of all
// directions, it does not show.
GrayFrame two_shades(const std::vector<RenderedDisk>& disks, double hidden) {
  GrayFrame frame = test::beads_of_level(disks, 230), dark = test::beads_of_level(disks, 90);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const auto nearest = std::min_element(disks.begin(), disks.end(), [&](const auto& one, const auto& other) {
        return std::hypot(one.x_px - column, one.y_px - row) < std::hypot(other.x_px - column, other.y_px - row);
      });
      const double x = column - nearest->x_px, y = row - nearest->y_px,
                   steep = std::tan(std::numbers::pi / 2 * (1 - hidden));
      const auto at = static_cast<std::size_t>(row * frame.width + column);
      if (std::abs(y) > steep * std::abs(x))
        frame.pixels[at] = 150;
      else if (x > 0)
        frame.pixels[at] = dark.pixels[at];
    }
  return frame;
}

// Red shows the rims of 14 of 20 beads, and of the others a quarter. Green shows all of them, with edges up and down: a
// quick search finds fewer there than in red, and a thorough one finds all.
TEST(ChannelTrials, LeaveRimsThatMissManyForThoseOfAThoroughSearch) {
  const std::vector<RenderedDisk> all = beads_of_trial(), seen(all.begin(), all.begin() + 14);
  TrialFrames frames(seen, {}, 230);
  GrayFrame quarters = rings_of({all.begin() + 14, all.end()});
  for (int row = 0; row < quarters.height; ++row)
    for (int column = 0; column < quarters.width; ++column)
      if (std::none_of(all.begin() + 14, all.end(), [&](const RenderedDisk& disk) {
            return column > disk.x_px && row > disk.y_px && std::hypot(disk.x_px - column, disk.y_px - row) < 12;
          }))
        quarters.pixels[static_cast<std::size_t>(row * quarters.width + column)] = 150;
  frames.frames.channels[0].frame = sum_of(rings_of(seen), quarters);
  frames.frames.channels[1].frame = two_shades(all, 0.4);
  const SurveyCandidate settled = frames.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_TRUE(settled.thorough);
  frames.frames.channels[0].frame = rings_of(all);
  EXPECT_EQ(frames.settled().channel, Channel::red) << "none is missed";
}

// What a search of the frame finds is taken once, by whoever searches the same levels with the same options.
TEST(ChannelTrials, KeepASearchOfAllTheFrame) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  const TrialFrames frames(all, {all.begin(), all.end() - 3}, 230);
  EXPECT_EQ(frames.settled().searched, nullptr);
  SurveyOptions asked;
  asked.search.emplace();
  const GrayFrame& red = frames.frames.channels.front().frame;
  FindOptions find;
  find.seen = BeadsSeen{Polarity::dark_beads, 9};
  const CalibrationResult known = learn_beads({&red}, find);
  const auto learned = [&](const GrayFrame& frame, const FindOptions& options) {
    const SurveyCandidate settled = frames.settled(asked);
    const auto first = settled.searched->take(frame, options);
    EXPECT_FALSE(settled.searched->take(red, find)) << "only once";
    return first;
  };
  const auto kept = learned(red, find);
  ASSERT_TRUE(kept && kept->in_last_frame && known.in_last_frame);
  EXPECT_EQ(kept->calibration.radius_px, known.calibration.radius_px);
  EXPECT_EQ(kept->in_last_frame->disks.size(), 20U);
  GrayFrame other = red;
  other.pixels.back() += 1;
  EXPECT_FALSE(learned(other, find));
  find.one_size = true;
  EXPECT_FALSE(learned(red, find));
}

// Of a candidate's frames, reduced by two, and of the region or the frames' other channel nothing is kept.
TEST(ChannelTrials, KeepNoSearchThatIsNotTheOneToCome) {
  const std::vector<RenderedDisk> all = beads_of_trial(), fewer(all.begin(), all.end() - 3);
  SurveyOptions asked;
  asked.search.emplace();
  EXPECT_EQ(TrialFrames(fewer, all, 230).settled(asked).searched, nullptr) << "another channel";
  const auto reduced = TrialFrames(all, fewer, 230, 2).settled(asked).searched;
  ASSERT_NE(reduced, nullptr);
  EXPECT_EQ(reduced->reduction(), 2);
  TrialFrames small(all, fewer, 230, 2);
  small.best.rims.radius_px = 17;
  EXPECT_EQ(small.settled(asked).searched, nullptr) << "too small to be searched in a reduced frame";
  asked.roi = PixelRectangle{0, 0, 150, 122};
  EXPECT_EQ(TrialFrames(all, fewer, 230).settled(asked).searched, nullptr);
}

// Two rows of beads, wider than the part that channels are compared in. Red misses four of those in the part.
TEST(ChannelTrials, CountOfASearchInAllTheFrameTheBeadsOfThePart) {
  std::vector<RenderedDisk> all, in_red;
  for (int k = 0; k < 64; ++k) all.push_back({16 + 28.0 * (k / 2), 16 + 28.0 * (k % 2), 9, 0, 0});
  for (int k = 0; k < 64; ++k)
    if (k < 28 || k >= 32) in_red.push_back(all[static_cast<std::size_t>(k)]);
  TrialFrames wide(in_red, {}, 230);
  const auto drawn = [](const std::vector<RenderedDisk>& disks, double level) {
    return render_frame(
        disks,
        {.width = 900, .height = 60, .background_level = 150, .bead_level = level, .blur_px = 0.8, .read_noise = 2});
  };
  wide.frames.width = 900, wide.frames.height = 60;
  wide.frames.channels[0].frame = drawn(in_red, 70), wide.frames.channels[1].frame = drawn(all, 230);
  wide.best.explained_share = 0.9;
  SurveyOptions asked;
  asked.search.emplace();
  EXPECT_EQ(wide.settled(asked).channel, Channel::green);
  wide.frames.channels[1].frame = drawn(in_red, 230);
  EXPECT_NE(wide.settled(asked).searched, nullptr);
  wide.best.explained_share = 0.4;
  EXPECT_EQ(wide.settled(asked).searched, nullptr) << "they may have to be found by their rims";
}

// Two rows of beads, wider than the part that trials look at. Of the 34 beads there three are hollow, so that rims are
// taken; of all 64 that is less than one in twenty. A large frame is searched in full, and what is found is kept.
TEST(ChannelTrials, OfALargeFrameTryFacesInAllOfIt) {
  std::vector<RenderedDisk> all, seen;
  for (int k = 0; k < 64; ++k) all.push_back({16 + 28.0 * (k / 2), 16 + 28.0 * (k % 2), 9, 0, 0});
  seen.assign(all.begin(), all.begin() + 34);
  GrayFrame frame = render_frame(
      all, {.width = 900, .height = 60, .background_level = 150, .bead_level = 70, .blur_px = 0.8, .read_noise = 2});
  std::vector<RenderedDisk> hollow = {all[6], all[15], all[24]};
  const auto settled = [&](int by, const SurveyOptions& options) {
    for (const RenderedDisk& disk : hollow)
      for (int row = 0; row < frame.height; ++row)
        for (int column = 0; column < frame.width; ++column)
          if (std::hypot(column - disk.x_px, row - disk.y_px) < 6.5) test::set(frame, column, row, 150);
    TrialFrames wide(seen, {}, 230, by);
    wide.frames.width = 900 * by, wide.frames.height = 60 * by;
    wide.frames.channels[0].frame = wide.frames.channels[1].frame = frame;
    return wide.settled(options);
  };
  SurveyOptions asked;
  const SurveyCandidate smaller = settled(6, asked), unasked = settled(7, asked);
  EXPECT_TRUE(smaller.by_rims) << "1.9 million pixels";
  EXPECT_FALSE(smaller.no_faces) << "of the part alone";
  EXPECT_FALSE(unasked.by_rims || unasked.no_faces);
  EXPECT_EQ(unasked.searched, nullptr);
  asked.search.emplace();
  asked.search->radius_px = 63;
  const SurveyCandidate large = settled(7, asked);
  EXPECT_FALSE(large.by_rims);
  ASSERT_NE(large.searched, nullptr);
  EXPECT_EQ(large.searched->reduction(), 7);
  FindOptions find;
  find.seen = BeadsSeen{Polarity::dark_beads, 9};
  find.radius_px = 9, find.recorded_px = 7;
  const auto learned = large.searched->take(frame, find);
  ASSERT_TRUE(learned && learned->in_last_frame);
  EXPECT_EQ(learned->in_last_frame->disks.size(), 61U);
  asked.roi = PixelRectangle{0, 0, 7 * 476, 7 * 60};
  const SurveyCandidate in_part = settled(7, asked);
  EXPECT_TRUE(in_part.by_rims && !in_part.no_faces) << "all of the frame is not asked for";
  asked.roi.reset();
  for (std::size_t k = 40; k < all.size(); k += 4) hollow.push_back(all[k]);
  const SurveyCandidate without = settled(7, asked);
  EXPECT_TRUE(without.by_rims && without.no_faces) << "9 of 64 are hollow";
  EXPECT_EQ(without.searched, nullptr);
}

// Blue shows one bead more than green does, but by its rim alone.
TEST(ChannelTrials, CompareEachChannelWithTheBestSoFar) {
  const std::vector<RenderedDisk> all = ten_beads();
  TrialFrames beads({all.begin(), all.end() - 3}, {all.begin(), all.end() - 1}, 70);
  beads.frames.channels[0].frame = rings_of({all.begin(), all.end() - 3});
  beads.frames.channels.push_back({Channel::blue, rings_of(all)});
  for (const int count : {1, 3}) {
    const PictureThreads threads(count);
    const SurveyCandidate settled = beads.settled();
    EXPECT_EQ(settled.channel, Channel::green);
    EXPECT_FALSE(settled.by_rims);
  }
}

// Of rims nearly all are surely beads, of faces all.
TEST(ChannelTrials, LeaveRimsForFacesOfAsManyBeads) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  TrialFrames beads(all, all, 230);
  beads.frames.channels[0].frame = rings_of(all);
  const SurveyCandidate settled = beads.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_FALSE(settled.by_rims);
  beads.frames.channels[1].frame = test::beads_of_level({all.begin(), all.end() - 1}, 230);
  EXPECT_EQ(beads.settled().channel, Channel::red) << "one bead fewer";
}

// Red shows rings, so the other channels are tried. Of these, blue and saturation show most dark beads; green shows
// all, half of them bright.
TEST(ChannelTrials, CountBeadsOfBothSigns) {
  const std::vector<RenderedDisk> all = ten_beads(), fewer(all.begin(), all.end() - 3),
                                  most(all.begin(), all.end() - 2);
  const std::vector<RenderedDisk> dark(all.begin(), all.begin() + 5), bright(all.begin() + 5, all.end());
  TrialFrames beads(fewer, {}, 230);
  beads.frames.channels[0].frame = rings_of(fewer);
  beads.frames.channels[1].frame = sum_of(test::beads_of_level(dark, 70), test::beads_of_level(bright, 230, 0));
  for (const Channel channel : {Channel::blue, Channel::saturation})
    beads.frames.channels.push_back({channel, test::beads_of_level(most, 70)});
  EXPECT_EQ(beads.settled().channel, Channel::green);
  SurveyOptions dark_alone;
  dark_alone.polarity = Polarity::dark_beads;
  EXPECT_EQ(beads.settled(dark_alone).channel, Channel::blue);
}

// Red shows a part of the beads plainly; green shows all, by their rims alone.
TEST(ChannelTrials, LeavePlainFacesForSureRimsOfFarMore) {
  const std::vector<RenderedDisk> all = beads_of_trial(), half(all.begin(), all.begin() + 10);
  TrialFrames beads(half, {}, 230);
  beads.frames.channels[1].frame = rings_of(all);
  const SurveyCandidate settled = beads.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_TRUE(settled.by_rims);
  std::vector<RenderedDisk> smaller = all;
  for (RenderedDisk& disk : smaller) disk.radius_px = 7.3;
  beads.frames.channels[1].frame = rings_of(smaller);
  EXPECT_EQ(beads.settled().channel, Channel::red) << "they are of another size";
}

// Green shows the bright middle of the beads that red shows, and other beads, which are dark, in full.
TEST(ChannelTrials, TakeTheSignWhoseRimsHaveTheRadiusSeen) {
  const std::vector<RenderedDisk> all = beads_of_trial(), half(all.begin(), all.begin() + 10);
  std::vector<RenderedDisk> middles = half;
  for (RenderedDisk& disk : middles) disk.radius_px = 7.2;
  TrialFrames beads(half, {}, 230);
  beads.frames.channels[1].frame =
      sum_of(test::beads_of_level(middles, 230), test::beads_of_level({all.begin() + 10, all.end()}, 70, 0));
  const SurveyCandidate settled = beads.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_EQ(settled.rims.polarity, Polarity::dark_beads);
}

// 25 beads at these distances, of which channels show circles of these radii.
SurveyCandidate settled_of_radii(double distance, const std::vector<std::pair<Channel, double>>& radii) {
  TrialFrames beads({}, {}, 230);
  beads.frames.channels.clear();
  for (const auto& [channel, radius] : radii) {
    std::vector<RenderedDisk> disks;
    for (int k = 0; k < 25; ++k)
      disks.push_back({20 + distance * (k % 5) + (k / 5 % 2) * distance / 2, 16 + 0.87 * distance * (k / 5), radius});
    beads.frames.channels.push_back({channel, test::beads_of_level(disks, 70)});
    if (channel != Channel::red) continue;
    for (const RenderedDisk& disk : disks) {
      beads.best.disks.emplace_back();
      beads.best.disks.back().circle.x = disk.x_px, beads.best.disks.back().circle.y = disk.y_px;
      beads.best.disks.back().circle.radius = radius;
    }
    beads.best.rims.radius_px = radius;
  }
  return beads.settled();
}

// Where circles of another channel come nearer to touching, they show more of each bead.
TEST(ChannelTrials, TakeTheOutlinesThatTouch) {
  EXPECT_EQ(settled_of_radii(18, {{Channel::red, 7.6}, {Channel::green, 8.8}}).channel, Channel::green);
  EXPECT_EQ(settled_of_radii(18, {{Channel::red, 8.8}, {Channel::green, 7.6}}).channel, Channel::red);
  EXPECT_EQ(settled_of_radii(18, {{Channel::red, 8.6}, {Channel::green, 8.8}}).channel, Channel::red)
      << "a difference that channels of one picture have";
  EXPECT_EQ(settled_of_radii(
                18, {{Channel::red, 7.6}, {Channel::green, 7.6}, {Channel::blue, 7.6}, {Channel::saturation, 8.8}})
                .channel,
            Channel::saturation)
      << "of the others two are tried";
  EXPECT_EQ(settled_of_radii(24, {{Channel::red, 7.6}, {Channel::green, 8.8}}).channel, Channel::red)
      << "neighbours are too far apart to say anything";
}

// How often a call asks whether to stop: as often as it fits a circle.
template <class Call>
std::size_t circles_fitted_in(const Call& call) {
  std::size_t asked = 0;
  const StopQuestion question([&] { ++asked; });
  call();
  return asked;
}

// Red shows all faces, which look small. Green shows them as small: it is not searched for them.
TEST(ChannelTrials, TryNoFacesWhereOutlinesAreAsSmall) {
  const auto fitted = [](double in_green) {
    return circles_fitted_in([&] { settled_of_radii(18, {{Channel::red, 7.6}, {Channel::green, in_green}}); });
  };
  EXPECT_LT(fitted(7.6), fitted(8.8)) << fitted(7.6) << " " << fitted(8.8);
}

// Of 18 beads one is hollow in red. Its rim is seen there, so that rims show no more in green, but one face does.
TEST(ChannelTrials, TryFacesWhereSomeAreMissed) {
  std::vector<RenderedDisk> beads = beads_of_trial();
  beads.resize(18);
  TrialFrames frames(beads, beads, 230);
  GrayFrame& red = frames.frames.channels[0].frame;
  for (int row = 0; row < red.height; ++row)
    for (int column = 0; column < red.width; ++column)
      if (std::hypot(column - beads[7].x_px, row - beads[7].y_px) < 6.5) test::set(red, column, row, 150);
  const SurveyCandidate settled = frames.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_FALSE(settled.by_rims);
}

// Rings, half of them darker than the background and half brighter.
GrayFrame rings_of_both_signs(const std::vector<RenderedDisk>& disks) {
  std::vector<RenderedDisk> dark, bright;
  for (const RenderedDisk& disk : disks) (dark.size() > bright.size() ? bright : dark).push_back(disk);
  std::vector<RenderedDisk> inside = bright;
  for (RenderedDisk& disk : inside) disk.radius_px -= 2;
  return sum_of(rings_of(dark), sum_of(test::beads_of_level(bright, 230, 0), test::beads_of_level(inside, 70, 0)));
}

TEST(ChannelTrials, SayThatAThoroughSearchShowsMore) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  TrialFrames beads(all, {}, 230);
  EXPECT_FALSE(beads.settled().thorough) << "faces";
  beads.frames.channels[0].frame = rings_of(all);
  EXPECT_TRUE(beads.settled().by_rims);
  EXPECT_FALSE(beads.settled().thorough) << "all rims are seen at once";
  beads.frames.channels[0].frame = rings_of_both_signs(all);
  EXPECT_TRUE(beads.settled().thorough);
  std::vector<RenderedDisk> half;
  for (std::size_t k = 0; k < all.size(); k += 2) half.push_back(all[k]);
  TrialFrames other(half, {}, 230);
  other.frames.channels[0].frame = rings_of(half);
  other.frames.channels[1].frame = rings_of_both_signs(all);
  const SurveyCandidate settled = other.settled();
  EXPECT_EQ(settled.channel, Channel::green);
  EXPECT_TRUE(settled.by_rims && settled.thorough) << settled.by_rims << settled.thorough;
}

}  // namespace
}  // namespace shakebed::ingest
