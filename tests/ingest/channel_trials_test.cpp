// The channel in which beads are looked for, where the frame is reduced, larger than a trial looks at, or cut down to a
// region.
#include <gtest/gtest.h>

#include <vector>

#include "ingest/find/settle_channel.hpp"
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

// In the upper half both channels show the same ten beads.
TEST(ChannelTrials, CountBeadsInTheRegionAlone) {
  const std::vector<RenderedDisk> all = beads_of_trial();
  const TrialFrames half({all.begin(), all.begin() + 10}, all, 230, 2);
  EXPECT_EQ(half.settled().channel, Channel::green);
  SurveyOptions upper;
  upper.roi = PixelRectangle{0, 0, 300, 122};
  EXPECT_EQ(half.settled(upper).channel, Channel::red);
}

}  // namespace
}  // namespace shakebed::ingest
