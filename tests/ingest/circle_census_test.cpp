// Which circles a picture is made of: the score of each radius, polarity and channel worked out once more.

#include "ingest/find/circle_census.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/circle_search.hpp"
#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// A picture and two copies stretched by 1.8 along the rows and along the diagonal: their circles of 5 to 10.4 px.
struct CensusLevel {
  double scale = 1, left = 0, top = 0;
  std::array<EdgeMap, 3> maps;
  int shorter = 0;

  CensusLevel(const GrayFrame& frame, double scale_of_frame, int window, bool twice) : scale(scale_of_frame) {
    const PicturePart part = busiest_part(frame, window, {.block = 16, .reach = 2, .stride = 2});
    left = part.left * scale, top = part.top * scale;
    GrayFrame picture = cut_out(frame, part);
    if (twice) picture = doubled(picture), scale *= 0.5;
    shorter = std::min(picture.width, picture.height);
    maps[0] = find_edges(picture, 0, twice ? Pixels::doubled : Pixels::own);
    maps[1] = find_edges(stretched(picture, 1.8, 0), maps[0].threshold);
    maps[2] = find_edges(stretched(picture, 1.8, std::numbers::pi / 4), maps[0].threshold);
  }
};

std::vector<CensusLevel> census_levels(const GrayFrame& frame, const CensusOptions& options) {
  // A radius that is given holds within a factor of 1.25; smaller ones than the smallest are not looked for.
  const auto wanted = [&](double scale) {
    const double from = options.radius_px ? *options.radius_px / 1.25 / scale : 5,
                 to = options.radius_px ? *options.radius_px * 1.25 / scale : 10.4;
    return std::max(5.0, from) < std::min(10.4, to) && 10.4 * scale > options.smallest_radius_px;
  };
  std::vector<CensusLevel> levels;
  if (wanted(0.5)) levels.emplace_back(frame, 1, 320, true);
  GrayFrame picture = frame;
  for (double scale = 1; std::min(picture.width, picture.height) >= 12; scale *= 2, picture = halved(picture))
    if (wanted(scale)) levels.emplace_back(picture, scale, 640, false);
  return levels;
}

double levels_apart(const GrayFrame& frame) {
  std::vector<float> levels = frame.pixels;
  std::erase_if(levels, [](float level) { return level > 1e5F; });
  std::sort(levels.begin(), levels.end());
  const auto rank = [&](double part) {
    return static_cast<double>(levels[static_cast<std::size_t>(part * static_cast<double>(levels.size() - 1))]);
  };
  return std::max(1.0, rank(0.998) - rank(0.002));
}

// Length of rims that are seen less 8 px for each circle; faint ones, below 0.3 of the picture's range, count in part.
struct CensusSum {
  double circles = 0, gain = 0;
  CensusSum(const std::vector<Circle>& all, double least, double range) {
    for (const Circle& one : all)
      if (one.support >= least)
        ++circles,
            gain += std::min(1.0, one.contrast / (0.3 * range)) * (2 * std::numbers::pi * one.radius * one.support - 8);
  }
};

struct CensusByHand {
  std::vector<CircleHypothesis> all;
  double by_chance = 0;

  void add(std::size_t channel, const GrayFrame& frame, const CensusOptions& options) {
    const double range = levels_apart(frame);
    for (const CensusLevel& level : census_levels(frame, options))
      for (const Polarity polarity : {Polarity::dark_beads, Polarity::bright_beads}) {
        if (options.polarity != Polarity::automatic && options.polarity != polarity) continue;
        std::array<std::vector<Circle>, 3> circles;
        for (std::size_t k = 0; k < 3; ++k) circles[k] = find_circles(level.maps[k], {5, 10.4, polarity, 0.35});
        const double from = options.radius_px ? std::max(5.0, *options.radius_px / 1.25 / level.scale) : 5,
                     to = options.radius_px ? std::min(10.4, *options.radius_px * 1.25 / level.scale) : 10.4;
        for (double radius = from; radius < to; radius *= 1.05) {
          CircleHypothesis one = weighed(circles, radius, range, level);
          if (!(one.gain_px > 0)) continue;
          one.channel = channel, one.polarity = polarity;
          all.push_back(one);
        }
      }
  }

  CircleHypothesis weighed(const std::array<std::vector<Circle>, 3>& circles, double radius, double range,
                           const CensusLevel& level) {
    std::array<std::vector<Circle>, 3> near;
    for (std::size_t k = 0; k < 3; ++k) {
      for (const Circle& one : circles[k])
        if (std::abs(one.radius - radius) < 0.1 * radius) near[k].push_back(one);
      near[k] = without_doubles(near[k], 0.8);
    }
    CircleHypothesis best;
    // In a picture below 20 px two circles do not tell a pattern: they must be seen nearly whole.
    for (double least = level.shorter < 20 ? 0.8 : 0.4; least < 0.99; least += 0.05) {
      const CensusSum here(near[0], least, range), one(near[1], least, range), other(near[2], least, range);
      by_chance = std::max({by_chance, (one.gain - 0.5 * (here.gain + other.gain)) * level.scale,
                            (other.gain - 0.5 * (here.gain + one.gain)) * level.scale});
      const double gain = here.gain - 0.5 * (one.gain + other.gain);
      if (gain <= best.gain_px) continue;
      best.gain_px = gain, best.least_support = least, best.circles = here.circles;
      best.by_chance = 0.5 * (one.circles + other.circles);
    }
    best.radius_px = radius * level.scale;
    best.explained_share = best.gain_px / static_cast<double>(std::max<std::size_t>(1, level.maps[0].ridge.size()));
    best.gain_px *= level.scale;
    std::vector<double> contrasts;
    for (Circle one : near[0])
      if (one.support >= best.least_support) {
        best.scatter += one.scatter / best.circles;
        contrasts.push_back(one.contrast);
        one.x = level.left + level.scale * (one.x + 0.5) - 0.5, one.y = level.top + level.scale * (one.y + 0.5) - 0.5;
        one.radius *= level.scale;
        best.seen.push_back(one);
      }
    std::sort(contrasts.begin(), contrasts.end());
    if (!contrasts.empty()) best.contrast = contrasts[contrasts.size() / 2];
    return best;
  }

  // Best first, each another channel, polarity or radius; a dozen of them.
  [[nodiscard]] std::vector<CircleHypothesis> different() const {
    std::vector<CircleHypothesis> ranked = all, chosen;
    std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.gain_px > b.gain_px; });
    for (const CircleHypothesis& one : ranked)
      if (chosen.size() < 12 && std::none_of(chosen.begin(), chosen.end(), [&](const CircleHypothesis& other) {
            return one.channel == other.channel && one.polarity == other.polarity &&
                   std::abs(std::log(one.radius_px / other.radius_px)) < std::log(1.15);
          }))
        chosen.push_back(one);
    return chosen;
  }
};

void expect_same_census(const std::vector<const GrayFrame*>& frames, const CensusOptions& options,
                        const std::string& name) {
  CensusByHand expected;
  for (std::size_t k = 0; k < frames.size(); ++k) expected.add(k, *frames[k], options);
  const CircleCensus census = take_census(frames, options);
  EXPECT_NEAR(census.best_by_chance_px, expected.by_chance, 1e-9) << name;
  const auto hypotheses = expected.different();
  ASSERT_EQ(census.hypotheses.size(), hypotheses.size()) << name;
  for (std::size_t k = 0; k < hypotheses.size(); ++k) {
    const CircleHypothesis &one = census.hypotheses[k], &other = hypotheses[k];
    EXPECT_EQ(one.channel, other.channel) << name << ' ' << k;
    EXPECT_EQ(one.polarity, other.polarity) << name << ' ' << k;
    EXPECT_NEAR(one.radius_px, other.radius_px, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(one.gain_px, other.gain_px, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(one.least_support, other.least_support, 1e-12) << name << ' ' << k;
    EXPECT_EQ(one.circles, other.circles) << name << ' ' << k;
    EXPECT_EQ(one.by_chance, other.by_chance) << name << ' ' << k;
    EXPECT_NEAR(one.explained_share, other.explained_share, 1e-12) << name << ' ' << k;
    EXPECT_NEAR(one.scatter, other.scatter, 1e-12) << name << ' ' << k;
    EXPECT_NEAR(one.contrast, other.contrast, 1e-9) << name << ' ' << k;
    ASSERT_EQ(one.seen.size(), other.seen.size()) << name << ' ' << k;
    for (std::size_t i = 0; i < one.seen.size(); ++i) {
      EXPECT_NEAR(one.seen[i].x, other.seen[i].x, 1e-9) << name << ' ' << k;
      EXPECT_NEAR(one.seen[i].y, other.seen[i].y, 1e-9) << name << ' ' << k;
      EXPECT_NEAR(one.seen[i].radius, other.seen[i].radius, 1e-9) << name << ' ' << k;
    }
  }
}

// Dark disks of 6 px, some of them faint or half hidden, on a noisy ground.
GrayFrame counted_picture(double bead, double noise, std::uint64_t seed) {
  Camera camera;
  camera.width = 78, camera.height = 62;
  camera.background_level = 140, camera.bead_level = bead;
  camera.blur_px = 0.8, camera.read_noise = noise, camera.seed = seed;
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 12; ++k) disks.push_back({9 + 18.5 * (k % 4), 9 + 19.0 * (k / 4), k % 3 == 2 ? 4.2 : 6.0, 0, 0});
  GrayFrame frame = render_frame(disks, camera);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 40; column < frame.width; ++column)  // fainter on one side
      test::set(frame, column, row, 140 + 0.25 * static_cast<double>(frame.at(column, row) - 140.0F));
  return frame;
}

TEST(CircleCensus, WeighsEachRadiusAsItsRulesSay) {
  const GrayFrame dark = counted_picture(60, 4, 1), bright = counted_picture(215, 9, 2);
  expect_same_census({&dark}, {}, "dark");
  expect_same_census({&bright, &dark}, {Polarity::bright_beads, std::nullopt, 2.5}, "of one polarity");
}

TEST(CircleCensus, LooksForTheRadiusThatIsGiven) {
  const GrayFrame frame = counted_picture(60, 4, 3);
  for (const double radius : {4.4, 6.0, 11.5})
    expect_same_census({&frame}, {Polarity::automatic, radius, 2.5}, "given " + std::to_string(radius));
  expect_same_census({&frame}, {Polarity::automatic, std::nullopt, 6}, "not below 6 px");
  CensusOptions options;
  options.radius_px = 6;
  for (const CircleHypothesis& one : take_census({&frame}, options).hypotheses) {
    EXPECT_GT(one.radius_px, 6 / 1.25 - 1e-9);
    EXPECT_LT(one.radius_px, 6 * 1.25);
  }
}

// Noise, a picture in which one circle fits, and one with a part that is unseen.
TEST(CircleCensus, SubtractsWhatChanceExplains) {
  RandomStream random(4);
  const GrayFrame noise = test::frame_by(60, 52, [&](int, int) { return 100 + 12 * random.normal(); });
  expect_same_census({&noise}, {}, "noise");
  Camera camera;
  camera.width = 19, camera.height = 24, camera.blur_px = 0.7;
  const GrayFrame tiny = render_frame({{9, 11, 6, 0, 0}}, camera);
  expect_same_census({&tiny}, {}, "tiny");
  GrayFrame hidden = counted_picture(60, 3, 5);
  for (int row = 0; row < hidden.height; ++row)
    for (int column = 0; column < 20; ++column) test::set(hidden, column, row, unseen_level);
  expect_same_census({&hidden}, {Polarity::dark_beads, std::nullopt, 4.5}, "hidden");
}

// Of a picture wider than 640 px the busiest part is looked at, in places of the whole.
TEST(CircleCensus, SeesTheBusiestPartOfALargePicture) {
  Camera camera;
  camera.width = 700, camera.height = 44, camera.blur_px = 0.8;
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < 8; ++k) disks.push_back({580 + 15.2 * k, 13 + 17.0 * (k % 2), 6, 0, 0});
  const GrayFrame frame = render_frame(disks, camera);
  expect_same_census({&frame}, {Polarity::dark_beads, 6.0, 2.5}, "wide");
}

// Disks of 17 px are searched for at half the resolution, smaller ones beside them in the picture itself: only where
// the large ones are not what makes it up.
TEST(CircleCensus, EndsAtTheLevelWhoseCirclesMakeUpThePicture) {
  const auto smallest_with = [](int large, int small) {
    Camera camera;
    camera.width = 560, camera.height = 420, camera.blur_px = 0.8;
    std::vector<RenderedDisk> disks;
    for (int k = 0; k < large; ++k) disks.push_back({25.3 + 42.1 * (k % 12), 25.2 + 42.3 * (k / 12), 17, 0, 0});
    for (int k = 0; k < small; ++k) disks.push_back({530 + 14.0 * (k % 2), 12 + 14.1 * (k / 2), 6, 0, 0});
    const GrayFrame frame = render_frame(disks, camera);
    double smallest = HUGE_VAL;
    for (const CircleHypothesis& one : take_census({&frame}).hypotheses)
      if (!one.hopeless()) smallest = std::min(smallest, one.radius_px);
    return smallest;
  };
  EXPECT_GT(smallest_with(96, 50), 10);
  EXPECT_LT(smallest_with(40, 50), 7) << "forty large ones are few";
}

}  // namespace
}  // namespace shakebed::ingest
