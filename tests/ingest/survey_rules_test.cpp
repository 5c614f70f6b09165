// What a survey thinks of the circles that it sees: gains, shares, doubts and reasons, worked out once more.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "ingest/find/circle_census.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// Of the part of a rim that no other circle touches, within 1.15 of its radius, the share that is seen; where that part
// is a third or more.
double open_support(const std::vector<RimDisk>& disks, std::size_t which) {
  const Circle& one = disks[which].circle;
  double open = 0, met = 0;
  for (int k = 0; k < one.directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / one.directions;
    const double x = one.x + one.radius * std::cos(angle), y = one.y + one.radius * std::sin(angle);
    bool free = true;
    for (std::size_t i = 0; i < disks.size(); ++i)
      free = free &&
             (i == which || std::hypot(disks[i].circle.x - x, disks[i].circle.y - y) >= 1.15 * disks[i].circle.radius);
    open += free, met += free && (one.met >> static_cast<unsigned>(k) & 1U) != 0;
  }
  return open >= 0.35 * one.directions ? std::max(one.support, met / std::max(1.0, open)) : one.support;
}

struct Thought {
  double gain = 0, explained = 0, wrong = 0;
  bool one_sided = false;
  std::string why_not;
};
Thought thought_of(const LearnedRims& rims, bool given) {
  Thought out;
  const auto count = static_cast<double>(rims.disks.size());
  double support = 0, doubts = 0, open = 0;
  std::array<double, 8> looked{}, met{};  // by eighths of all directions
  for (std::size_t k = 0; k < rims.disks.size(); ++k) {
    const RimDisk& disk = rims.disks[k];
    const double seen = disk.probability * 2 * std::numbers::pi * disk.circle.radius * disk.circle.support;
    out.gain += seen - disk.circle.radius;  // a circle of 8 px costs 8 px
    out.explained += seen / std::max(1.0, rims.edge_length_px);
    support += disk.circle.support, doubts += 1 - disk.probability, open += open_support(rims.disks, k);
    for (int way = 0; way < disk.circle.directions; ++way) {
      const auto eighth = static_cast<std::size_t>(8 * way / disk.circle.directions);
      ++looked[eighth], met[eighth] += static_cast<double>(disk.circle.met >> static_cast<unsigned>(way) & 1U);
    }
  }
  double least = 1;
  for (std::size_t k = 0; k < 8; ++k)
    if (looked[k] > 0) least = std::min(least, met[k] / looked[k]);
  out.one_sided = least < 0.15;
  out.wrong = count > 0 ? doubts / count : 1;
  const double at_worst = (doubts + std::sqrt(doubts)) / std::max(1.0, count);
  const double asked = std::min(0.9, 0.42 + (given ? 0.5 : 1) * 3.5 / std::max(1.0, count));
  const bool lit = count >= 20 && support >= 0.6 * count && out.explained >= 0.4 && at_worst <= 0.02;
  if (count == 0)
    out.why_not = "no circles are seen";
  else if (at_worst > 0.2 || (!given && at_worst > 0.1 && out.explained < 0.15))
    out.why_not = "may be due to chance";
  else if (support / count < asked && (count > 100 || open / count < asked))
    out.why_not = "of their rims is visible";
  else if (out.one_sided && !lit)
    out.why_not = "one side of the rim is missing";
  else if (out.explained < 0.05)
    out.why_not = "of the edges in the picture";
  return out;
}

// Every candidate of the survey beside what the rims of its hypothesis tell. Returns the reasons.
std::vector<std::string> expect_same_thoughts(const GrayFrame& frame, std::optional<double> radius,
                                              const std::string& name) {
  ChannelFrames frames;
  frames.width = frame.width, frames.height = frame.height;
  frames.channels.push_back({Channel::grey, frame});
  SurveyOptions options;
  options.radius_px = radius;
  const Survey survey = take_survey(frames, options);
  CensusOptions asked;
  asked.radius_px = radius;
  const CircleCensus census = take_census({&frame}, asked);
  std::vector<std::string> reasons;
  std::size_t examined = 0;
  for (const CircleHypothesis& one : census.hypotheses) {
    if (examined == 8 || one.by_chance > 0.5 * one.circles || one.gain_px < 0.15 * census.hypotheses[0].gain_px)
      continue;
    ++examined;
    // From a width of 48 px on outlines tell beads from clutter.
    const LearnedRims rims = learn_rims(frame, one.polarity, one.radius_px,
                                        radius                ? Known::radius
                                        : one.radius_px >= 24 ? Known::wide
                                                              : Known::nothing);
    const Thought expected = thought_of(rims, radius.has_value());
    const auto its = std::find_if(survey.candidates.begin(), survey.candidates.end(), [&](const SurveyCandidate& c) {
      return c.rims.polarity == one.polarity && std::abs(c.rims.radius_px - rims.model.radius_px) < 1e-9 &&
             c.disks.size() == rims.disks.size();
    });
    if (its == survey.candidates.end()) {
      ADD_FAILURE() << name << ": no candidate of " << one.radius_px << " px";
      continue;
    }
    EXPECT_NEAR(its->gain_px, expected.gain, 1e-6) << name;
    EXPECT_NEAR(its->explained_share, expected.explained, 1e-9) << name;
    EXPECT_NEAR(its->expected_wrong, expected.wrong, 1e-9) << name;
    EXPECT_EQ(its->one_sided, expected.one_sided) << name;
    EXPECT_EQ(its->few_edges, test::holds(expected.why_not, "of the edges")) << name;
    if (!expected.why_not.empty()) {
      EXPECT_TRUE(test::holds(its->why_not, expected.why_not) || test::holds(its->why_not, "not within 25 %"))
          << name << ": " << its->why_not;
    }
    EXPECT_EQ(its->credible, its->why_not.empty()) << name;
    // Where outlines and levels were looked at, a reason is one of these.
    if (expected.why_not.empty() && !its->why_not.empty()) {
      EXPECT_TRUE(its->not_round || !its->why_drawn.empty() || test::holds(its->why_not, "spots") ||
                  test::holds(its->why_not, "px radius"))
          << name << ": " << its->why_not;
    }
    reasons.push_back(its->why_not);
  }
  for (std::size_t k = 1; k < survey.candidates.size(); ++k) {
    const SurveyCandidate &one = survey.candidates[k - 1], &other = survey.candidates[k];
    EXPECT_TRUE(one.credible || !other.credible) << name;
    EXPECT_TRUE(one.credible != other.credible || one.gain_px >= other.gain_px) << name;
  }
  return reasons;
}

// Disks of 9 px, of which a part of the rim fades on one side, with other edges around them.
struct SurveyedDisks {
  int count = 20;
  double faded = 20;   // px from the middle along the rows, from which on a disk fades out
  double clutter = 0;  // grey levels
  double noise = 2, radius = 9;
};
GrayFrame surveyed_frame(const SurveyedDisks& drawn) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < drawn.count; ++k)
    disks.push_back({20.3 + 27 * (k % 5) + 2 * test::scattered(k, 1), 18.7 + 26 * (k / 5) + 2 * test::scattered(1, k),
                     drawn.radius, 0, 0});
  Camera camera;
  camera.width = 150, camera.height = 124, camera.background_level = 150, camera.bead_level = 70;
  camera.blur_px = 0.8, camera.read_noise = drawn.noise;
  GrayFrame frame = render_frame(disks, camera);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      bool inside = false;
      for (const RenderedDisk& disk : disks) {
        const double dx = column - disk.x_px, away = std::hypot(dx, row - disk.y_px);
        inside = inside || away < 13;
        if (away < 13 && dx > drawn.faded)
          test::set(frame, column, row, 150 + 2 * (test::scattered(column, row) - 0.5));
      }
      // Bars as broad as the beads.
      if (!inside && drawn.clutter > 0)
        test::set(frame, column, row,
                  150 + drawn.clutter * ((column / 7 + row / 9) % 2) + 2 * test::scattered(column, row));
    }
  return frame;
}

TEST(SurveyRules, CandidatesAreWeighedByThem) {
  const auto plain = expect_same_thoughts(surveyed_frame({}), std::nullopt, "plain");
  ASSERT_FALSE(plain.empty());
  EXPECT_EQ(plain.front(), "");
  expect_same_thoughts(surveyed_frame({.count = 10, .noise = 12}), std::nullopt, "noisy");
  expect_same_thoughts(surveyed_frame({.count = 5}), std::nullopt, "few");
}

TEST(SurveyRules, OneSidedRimsAreWeighedByThem) {
  expect_same_thoughts(surveyed_frame({.count = 9, .faded = 0}), std::nullopt, "halves");
  expect_same_thoughts(surveyed_frame({.faded = 3}), 9, "one-sided");
  expect_same_thoughts(surveyed_frame({.count = 15, .faded = 4}), 9, "fifteen of one side");
  expect_same_thoughts(surveyed_frame({.faded = 1}), 11, "of another radius");
}

TEST(SurveyRules, AGivenRadiusIsWeighedByThem) {
  const auto given = expect_same_thoughts(surveyed_frame({.noise = 8}), 9, "given");
  ASSERT_FALSE(given.empty());
  EXPECT_EQ(given.front(), "");
  expect_same_thoughts(surveyed_frame({.count = 6, .faded = 2, .clutter = 25}), 9, "among clutter");
  expect_same_thoughts(surveyed_frame({.count = 8, .clutter = 60}), 9, "among much clutter");
}

}  // namespace
}  // namespace shakebed::ingest
