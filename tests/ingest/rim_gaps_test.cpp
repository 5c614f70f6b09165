// Beads beside beads: circles in gaps and their sizes, worked out once more from the circles of a picture's maps.

#include "ingest/find/rim_gaps.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using Circles = std::vector<Circle>;
double away(const Circle& one, const Circle& other) { return std::hypot(one.x - other.x, one.y - other.y); }
double ranked_middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Sizes from one to another.
struct Sizes {
  double from = 0, to = 0;
  [[nodiscard]] bool hold(double radius) const { return radius >= from && radius <= to; }
  static Sizes around(double radius) { return {0.88 * radius, 1.12 * radius}; }
};

class GapsByHand {
 public:
  GapsByHand(const GrayFrame& frame, const RimModel& model)
      : model_(model), radius_(model.radius_px), maps_(frame, model.search.wanted_px) {}

  // Circles of these sizes in the picture, then in its four copies; px of the frame.
  std::array<Circles, 5> seen(const Sizes& sizes, const Circles& beads) {
    const PictureMap& map = maps_.with_copies(std::sqrt(sizes.from * sizes.to), model_.threshold);
    std::array<Circles, 5> all;
    all[0] = circles_in(map.edges, map, sizes, beads, {});
    for (std::size_t k = 0; k < 4; ++k) all[k + 1] = circles_in(map.copies[k].front().edges, map, sizes, beads, k);
    return all;
  }

  // Those that lie within two radii of the beads' rims, and overlap none by more than a fifth.
  [[nodiscard]] Circles beside(const Circles& circles, const Circles& beads) const {
    Circles free;
    for (const Circle& one : circles) {
      bool near = false, overlaps = false;
      for (const Circle& bead : beads) {
        near = near || away(one, bead) < one.radius + bead.radius + 2 * radius_;
        overlaps = overlaps || away(one, bead) < 0.8 * (one.radius + bead.radius);
      }
      if (near && !overlaps) free.push_back(one);
    }
    return without_doubles(free, 0.8);
  }

  [[nodiscard]] std::vector<double> chances(const std::array<Circles, 5>& all, const Circles& beads) const {
    std::vector<Circles> copies;
    for (std::size_t k = 1; k < 5; ++k) copies.push_back(beside(all[k], beads));
    return probabilities_by_support(beside(all[0], beads), copies, Known::beads);
  }

  // Likely ones, those beside these, and so on; nine times at most.
  std::vector<GapCircle> take(const Circles& circles, const std::vector<double>& chance, Circles& beads,
                              double least = 0.5) const {
    std::vector<GapCircle> taken;
    for (int round = 0; round < 9; ++round) {
      const std::size_t before = taken.size();
      for (const Circle& one : beside(circles, beads)) {
        const double its = probability_at(chance, one.support);
        if (its >= least) taken.push_back({one, its});
      }
      for (std::size_t k = before; k < taken.size(); ++k) beads.push_back(taken[k].circle);
      if (taken.size() == before) break;
    }
    return taken;
  }

  // Sizes that many beads share, three at most, each by itself; then what is left, smaller and larger ones.
  std::vector<SizeBand> other_sizes(Circles& known) {
    const auto beads = static_cast<double>(known.size());
    constexpr std::array<double, 5> limits = {0.36, 0.6, 1, 1.67, 2.8};
    groups_.clear(), tried_.clear();
    for (std::size_t k = 0; k < 4; ++k) {
      groups_.push_back({{limits[k] * radius_, limits[k + 1] * radius_}, {}});
      groups_.back().circles = seen({0.88 * limits[k] * radius_, 1.12 * limits[k + 1] * radius_}, known);
      leave_out(groups_.back(), Sizes::around(radius_));
    }
    std::vector<SizeBand> found;
    for (int k = 0; k < 3; ++k) {
      const std::optional<double> next = next_size(known);
      if (!next) break;
      const Sizes sizes = Sizes::around(*next);
      tried_.push_back(sizes);
      const auto group =
          std::find_if(groups_.begin(), groups_.end(), [&](const auto& one) { return one.sizes.hold(*next); });
      if (group == groups_.end()) continue;
      auto circles = group->circles;
      for (Circles& some : circles) std::erase_if(some, [&](const Circle& one) { return !sizes.hold(one.radius); });
      Circles with = known;
      auto band = believed(sizes, circles, with, beads);
      const bool in_spread = sizes.from >= 0.6 * radius_ && sizes.to <= 1.67 * radius_;
      if (!band || (band->radius_px == 0 && in_spread)) continue;
      known = with, found.push_back(*band);
      for (Group& each : groups_) leave_out(each, sizes);
    }
    for (const std::size_t k : {1U, 2U})
      if (const auto band = believed(groups_[k].sizes, groups_[k].circles, known, beads)) found.push_back(*band);
    return found;
  }

 private:
  struct Group {
    Sizes sizes;
    std::array<Circles, 5> circles;
  };
  static void leave_out(Group& group, const Sizes& sizes) {
    for (Circles& some : group.circles) std::erase_if(some, [&](const Circle& one) { return sizes.hold(one.radius); });
  }

  Circles circles_in(const EdgeMap& edges, const PictureMap& map, const Sizes& sizes, const Circles& beads,
                     std::optional<std::size_t> copy) const {
    const double scale = map.at.scale, tolerated = 1 + 0.4 * 0.12;
    CirclesAsked asked;
    asked.from_px = std::max(4.0, sizes.from * tolerated / scale), asked.to_px = sizes.to / tolerated / scale;
    const bool small = sizes.to < 0.6 * 1.24 * radius_;
    if (asked.from_px >= asked.to_px || (small && model_.polarity == Polarity::automatic)) return {};
    asked.polarity = model_.polarity, asked.least_support = 0.3;
    if (!small) asked.votes = model_.search.votes;
    if (sizes.hold(radius_)) asked.votes.least = model_.search.least_votes_in_gaps;
    const auto place = [&](Circle one) {
      if (copy) {
        const FramePlace from =
            place_before_stretching(map.at.picture, 1.8, static_cast<double>(*copy) * M_PI / 4, one.x, one.y);
        one.x = from.x, one.y = from.y;
      }
      one.x = map.at.to_frame_x(one.x), one.y = map.at.to_frame_y(one.y), one.radius *= scale;
      return one;
    };
    // A fit moves a circle by half a radius at most.
    asked.leave_out = [&](const Circle& voted) {
      const Circle one = place(voted);
      return std::any_of(beads.begin(), beads.end(), [&](const Circle& bead) {
        return away(one, bead) < 0.8 * (one.radius + bead.radius) - 0.5 * one.radius;
      });
    };
    Circles found;
    for (const Circle& one : find_circles(edges, asked))
      if (sizes.hold(place(one).radius)) found.push_back(place(one));
    return found;
  }

  // What circles speak for a size: by what their support exceeds 0.4, unless one near it was tried.
  [[nodiscard]] double speaks(const Circle& one, const Sizes& sizes) const {
    const bool was_tried =
        std::any_of(tried_.begin(), tried_.end(), [&](const Sizes& t) { return t.hold(one.radius); });
    return sizes.hold(one.radius) && !was_tried ? one.radius * std::max(0.0, one.support - 0.4) : 0;
  }
  [[nodiscard]] std::optional<double> next_size(const Circles& known) const {
    double most = 0, radius = 0;
    for (const Group& group : groups_) {
      std::array<Circles, 5> near;
      for (std::size_t k = 0; k < 5; ++k) near[k] = beside(group.circles[k], known);
      for (double tried = group.sizes.from; tried < group.sizes.to; tried *= 1.04) {
        const Sizes sizes = Sizes::around(tried);
        double gain = 0;
        for (std::size_t k = 0; k < 5; ++k)
          for (const Circle& one : near[k]) gain += speaks(one, sizes) * (k == 0 ? 1 : -0.25);
        if (gain <= most) continue;
        std::vector<double> radii;
        for (const Circle& one : near[0])
          if (speaks(one, sizes) > 0) radii.push_back(one.radius);
        most = gain, radius = ranked_middle(radii);
      }
    }
    return most > 0 ? std::optional(radius) : std::nullopt;
  }

  // Three at least, a twentieth of the beads; of those below 0.6 radii six and a tenth. Sizes beyond a spread must be
  // sure. Radii that scatter by less than 3 % are one.
  std::optional<SizeBand> believed(const Sizes& sizes, const std::array<Circles, 5>& circles, Circles& known,
                                   double beads) const {
    SizeBand band;
    band.from_px = sizes.from, band.to_px = sizes.to;
    band.probability = chances(circles, known);
    Circles with = known;
    const std::vector<GapCircle> taken = take(circles[0], band.probability, with);
    double expected = 0;
    for (const GapCircle& one : taken) expected += one.probability;
    const double middle = 0.5 * (sizes.from + sizes.to) / radius_;
    if ((middle < 0.6 || middle > 1.67) && expected < 0.9 * static_cast<double>(taken.size())) return std::nullopt;
    if (expected < (middle < 0.6 ? std::max(6.0, 0.1 * beads) : std::max(3.0, 0.05 * beads))) return std::nullopt;
    std::vector<double> radii, off;
    for (const GapCircle& one : taken) radii.push_back(one.circle.radius);
    for (const double one : radii) off.push_back(std::abs(one - ranked_middle(radii)));
    if (1.4826 * ranked_middle(off) < 0.03 * ranked_middle(radii)) band.radius_px = ranked_middle(radii);
    known = with;
    return band;
  }

  const RimModel& model_;
  double radius_;
  PictureMaps maps_;
  std::vector<Group> groups_;
  std::vector<Sizes> tried_;
};

void expect_same_circles(std::vector<GapCircle> found, std::vector<GapCircle> expected, const std::string& name) {
  ASSERT_EQ(found.size(), expected.size()) << name;
  for (std::size_t k = 0; k < found.size(); ++k) {
    EXPECT_NEAR(found[k].circle.x, expected[k].circle.x, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(found[k].circle.radius, expected[k].circle.radius, 1e-9) << name << ' ' << k;
    EXPECT_NEAR(found[k].probability, expected[k].probability, 1e-12) << name << ' ' << k;
  }
}

// What is learned of the gaps of a picture and found in them is the same by hand.
std::size_t expect_same_gaps(const GrayFrame& frame, RimModel model, Circles beads, bool one_size,
                             const std::string& name) {
  PictureMaps maps(frame, model.search.wanted_px);
  const GapModel gaps = chances_in_gaps(maps, beads, model, one_size);
  GapsByHand by_hand(frame, model);
  Circles known = beads;
  const auto same = by_hand.seen(Sizes::around(model.radius_px), known);
  const auto chance = by_hand.chances(same, known);
  EXPECT_EQ(gaps.same_size.size(), chance.size());
  for (std::size_t k = 0; k < chance.size(); ++k) EXPECT_NEAR(gaps.same_size[k], chance[k], 1e-12) << name << ' ' << k;
  by_hand.take(same[0], chance, known);
  const auto others = one_size ? std::vector<SizeBand>() : by_hand.other_sizes(known);
  EXPECT_EQ(gaps.other_sizes.size(), others.size()) << name;
  if (gaps.other_sizes.size() != others.size()) return 0;
  for (std::size_t k = 0; k < others.size(); ++k) {
    EXPECT_NEAR(gaps.other_sizes[k].from_px, others[k].from_px, 1e-9) << name;
    EXPECT_NEAR(gaps.other_sizes[k].to_px, others[k].to_px, 1e-9) << name;
    EXPECT_NEAR(gaps.other_sizes[k].radius_px, others[k].radius_px, 1e-9) << name;
    for (std::size_t i = 0; i < others[k].probability.size(); ++i)
      EXPECT_NEAR(gaps.other_sizes[k].probability[i], others[k].probability[i], 1e-12) << name << ' ' << i;
  }
  model.gaps = gaps;
  // Then the sure ones are taken: of the beads' size, then of each other size but for the sizes before. Then the
  // others.
  const GapCircles found = circles_in_gaps(maps, beads, model);
  if (!found.displaced.empty()) return others.size();
  std::vector<Circles> seen = {by_hand.seen(Sizes::around(model.radius_px), beads)[0]};
  std::vector<std::vector<double>> chances = {gaps.same_size};
  std::vector<Sizes> before = {Sizes::around(model.radius_px)};
  for (const SizeBand& band : gaps.other_sizes) {
    seen.push_back(by_hand.seen({band.from_px, band.to_px}, beads)[0]);
    for (const Sizes& one : before) std::erase_if(seen.back(), [&](const Circle& c) { return one.hold(c.radius); });
    chances.push_back(band.probability);
    before.push_back({band.from_px, band.to_px});
  }
  std::vector<GapCircle> expected;
  for (const double least : {0.9, 0.5})
    for (std::size_t k = 0; k < seen.size(); ++k)
      for (const GapCircle& one : by_hand.take(seen[k], chances[k], beads, least)) expected.push_back(one);
  expect_same_circles(found.circles, expected, name);
  return others.size();
}

// Beads of 8 px, and others whose radii are given; a part of them is known.
struct MixedBed {
  GrayFrame frame;
  RimModel model;
  Circles known;
  std::vector<RenderedDisk> truth;
};
MixedBed mixed_bed(const std::vector<double>& others, int pattern, double scatter = 0, double bead = 60) {
  MixedBed bed;
  Camera camera;
  camera.width = 168, camera.height = 116, camera.background_level = 150, camera.bead_level = bead;
  camera.blur_px = 0.8, camera.read_noise = 4, camera.seed = static_cast<std::uint64_t>(pattern) + 3;
  for (int k = 0; k < 24; ++k) {
    double radius = 8;
    if (k % 3 == 1 && !others.empty())
      radius =
          others[static_cast<std::size_t>(k) % others.size()] * (1 + scatter * (test::scattered(k, pattern) - 0.5));
    bed.truth.push_back({17 + 26.5 * (k % 6), 17 + 26.5 * (k / 6) + 3 * test::scattered(pattern, k), radius, 0, 0});
    if (radius == 8 && k % 7 != 3) bed.known.push_back({bed.truth.back().x_px, bed.truth.back().y_px, 8, 1});
  }
  bed.frame = render_frame(bed.truth, camera);
  bed.model = learn_rims(bed.frame, bead < 150 ? Polarity::dark_beads : Polarity::bright_beads, 8, Known::beads).model;
  return bed;
}

TEST(RimGaps, OfOneSizeAreAsTheirRulesSay) {
  const MixedBed bed = mixed_bed({}, 1);
  expect_same_gaps(bed.frame, bed.model, bed.known, true, "known");
  expect_same_gaps(bed.frame, bed.model, {bed.known[0], bed.known[9]}, true, "few known");
  RimModel thorough = bed.model;
  thorough.search = thorough_search, thorough.threshold = 0;
  expect_same_gaps(bed.frame, thorough, bed.known, true, "thorough");
}

TEST(RimGaps, OfASharedSizeAreAsTheirRulesSay) {
  const MixedBed larger = mixed_bed({11.5}, 2), smaller = mixed_bed({4.6}, 3, 0, 230);
  EXPECT_EQ(expect_same_gaps(larger.frame, larger.model, larger.known, false, "larger"), 1U);
  expect_same_gaps(smaller.frame, smaller.model, smaller.known, false, "smaller");
}

TEST(RimGaps, OfSeveralSizesAreAsTheirRulesSay) {
  const MixedBed two = mixed_bed({6.3, 10.5}, 4), spread = mixed_bed({10.5}, 5, 0.4);
  expect_same_gaps(two.frame, two.model, two.known, false, "two sizes");
  expect_same_gaps(spread.frame, spread.model, spread.known, false, "a spread");
}

// Larger beads, each of its own size: those of one to 1.67 radii are taken together.
TEST(RimGaps, OfASpreadAreAsTheirRulesSay) {
  const MixedBed larger = mixed_bed({10.5}, 6, 0.3);
  EXPECT_EQ(expect_same_gaps(larger.frame, larger.model, larger.known, false, "a spread"), 1U);
}

// A bead found inside one of another size, that is far better seen, gives its place to it.
TEST(RimGaps, GiveThePlacesOfPoorCirclesToLargerBeads) {
  MixedBed bed = mixed_bed({11.5}, 6);
  PictureMaps maps(bed.frame, 8);
  bed.model.gaps = chances_in_gaps(maps, bed.known, bed.model, false);
  ASSERT_EQ(bed.model.gaps->other_sizes.size(), 1U);
  const auto with_inside = [&](double support) {
    Circles known = bed.known;
    known.insert(known.begin() + 4, {bed.truth[7].x_px + 2, bed.truth[7].y_px - 2, 7, support});
    return circles_in_gaps(maps, known, bed.model);
  };
  // The large one speaks with 11.5 (1 - 0.4); of that the small one may have half: 7 (s - 0.4) = 3.45 at s = 0.89.
  const GapCircles poor = with_inside(0.85), good = with_inside(0.95);
  EXPECT_EQ(poor.displaced, (std::vector<std::size_t>{4}));
  EXPECT_TRUE(good.displaced.empty());
  const auto has_large = [&](const GapCircles& found) {
    return std::any_of(found.circles.begin(), found.circles.end(), [&](const GapCircle& one) {
      return std::hypot(one.circle.x - bed.truth[7].x_px, one.circle.y - bed.truth[7].y_px) < 1;
    });
  };
  EXPECT_TRUE(has_large(poor));
  EXPECT_FALSE(has_large(good));
  EXPECT_EQ(poor.circles.size(), good.circles.size() + 1);
}

// Where all circles of the beads' size are doubtful, those of the other size that are sure keep their places.
TEST(RimGaps, GiveThePlacesOfDoubtfulCirclesToSureOnesOfAnotherSize) {
  MixedBed bed = mixed_bed({9.6}, 7);
  PictureMaps maps(bed.frame, 8);
  const auto large_found = [&](double same, double other) {
    GapModel gaps;
    gaps.same_size.assign(21, same);
    SizeBand band;
    band.from_px = 9.1, band.to_px = 10.5;
    band.probability.assign(21, other);
    gaps.other_sizes = {band};
    bed.model.gaps = gaps;
    std::size_t count = 0;
    for (const GapCircle& one : circles_in_gaps(maps, bed.known, bed.model).circles) count += one.circle.radius > 9.1;
    return count;
  };
  const std::size_t large = large_found(0, 0.95);
  EXPECT_GE(large, 6U);
  EXPECT_EQ(large_found(0.6, 0.95), large);
  EXPECT_LT(large_found(0.95, 0.95), large) << "circles of the beads' size are drawn round larger beads, too";
}

}  // namespace
}  // namespace shakebed::ingest
