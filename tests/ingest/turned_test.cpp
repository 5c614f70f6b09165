// What searches must not see: which way a picture is turned, and whether it is a negative.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "ingest/calibrate/radius_vote.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_profile.hpp"
#include "ingest/find/bead_set.hpp"
#include "ingest/find/circle_search.hpp"
#include "ingest/find/drawing_signs.hpp"
#include "ingest/find/outline.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"
#include "tests/ingest/turned.hpp"

namespace shakebed::ingest {
namespace {

using test::Turn;
using test::turns;

constexpr int turned_width = 150, turned_height = 126;

// Beads of 9 px cut at each border and at a corner, beads that touch, lone ones, and a void in a row; noise of 2.
std::vector<RenderedDisk> turned_beads() {
  std::vector<RenderedDisk> all;
  for (const auto& [x, y] : {std::pair{4.3, 41.2},
                             {146.1, 47.9},
                             {43.5, 3.6},
                             {52.7, 122.8},
                             {148.0, 2.5},
                             {60.3, 60.7},
                             {78.1, 61.9},
                             {69.6, 77.1},
                             {110.4, 70.6},
                             {30.9, 95.2},
                             {91.3, 108.8},
                             {109.5, 110.2},
                             {24.2, 60.1},
                             {98.8, 25.4},
                             {72.4, 31.3},
                             {127.3, 98.1},
                             {17.1, 22.8}})
    all.push_back({x, y, 9, 0, 0});
  return all;
}
GrayFrame turned_frame(double bead_level = 70) {
  Camera camera;
  camera.width = turned_width, camera.height = turned_height;
  camera.background_level = 165, camera.bead_level = bead_level;
  camera.blur_px = 0.8, camera.read_noise = 2;
  return render_frame(turned_beads(), camera);
}

Polarity turned_polarity(const Turn& turn) { return turn.negative ? Polarity::bright_beads : Polarity::dark_beads; }

// The same circles, each where the turn puts it. Fits begin at whole pixels, which a turn moves.
void expect_circles(const std::vector<Circle>& found, const std::vector<Circle>& plain, const GrayFrame& frame,
                    const Turn& turn, double within) {
  ASSERT_EQ(found.size(), plain.size()) << turn.what;
  for (const Circle& circle : plain) {
    const auto [x, y] = turn.place(frame, circle.x, circle.y);
    const auto same = std::min_element(found.begin(), found.end(), [&, x = x, y = y](const Circle& a, const Circle& b) {
      return std::hypot(a.x - x, a.y - y) < std::hypot(b.x - x, b.y - y);
    });
    EXPECT_LT(std::hypot(same->x - x, same->y - y), within) << turn.what << ' ' << x << ' ' << y;
    EXPECT_NEAR(same->radius, circle.radius, within) << turn.what;
    EXPECT_NEAR(same->support, circle.support, 1e-6) << turn.what;
    EXPECT_NEAR(same->scatter, circle.scatter, 5e-3) << turn.what;
    EXPECT_NEAR(same->contrast, circle.contrast, 0.02 * circle.contrast) << turn.what;
    EXPECT_EQ(same->rays, circle.rays) << turn.what;
  }
}

TEST(Turned, EdgesAreTheSame) {
  GrayFrame frame = turned_frame();
  for (int row = 70; row < 80; ++row) test::set(frame, 20, row, unseen_level);
  const EdgeMap plain = find_edges(frame);
  EXPECT_GT(plain.ridge.size(), 400U);
  for (const Turn& turn : turns()) {
    const EdgeMap edges = find_edges(turn.of(frame));
    EXPECT_NEAR(edges.threshold, plain.threshold, 2e-3F) << turn.what;
    for (int row = 3; row + 3 < plain.height; ++row)  // the outermost rows are smoothed otherwise than columns are
      for (int column = 3; column + 3 < plain.width; ++column) {
        const auto [x, y] = turn.pixel(frame, column, row);
        const auto [slope_x, slope_y] = turn.vector(static_cast<double>(plain.x[plain.at(column, row)]),
                                                    static_cast<double>(plain.y[plain.at(column, row)]));
        ASSERT_NEAR(edges.x[edges.at(x, y)], slope_x, 1e-3) << turn.what << ' ' << column << ' ' << row;
        ASSERT_NEAR(edges.y[edges.at(x, y)], slope_y, 1e-3) << turn.what << ' ' << column << ' ' << row;
      }
    for (const RidgePixel& pixel : plain.ridge) {
      if (pixel.x < 4 || pixel.y < 4 || pixel.x > turned_width - 5 || pixel.y > turned_height - 5) continue;
      const auto [x, y] = turn.place(frame, static_cast<double>(pixel.x), static_cast<double>(pixel.y));
      const auto [unit_x, unit_y] = turn.vector(static_cast<double>(pixel.unit_x), static_cast<double>(pixel.unit_y));
      EXPECT_TRUE(std::any_of(edges.ridge.begin(), edges.ridge.end(),
                              [&, x = x, y = y, unit_x = unit_x, unit_y = unit_y](const RidgePixel& one) {
                                return std::hypot(static_cast<double>(one.x) - x, static_cast<double>(one.y) - y) <
                                           1e-2 &&
                                       std::hypot(static_cast<double>(one.unit_x) - unit_x,
                                                  static_cast<double>(one.unit_y) - unit_y) < 1e-3;
                              }))
          << turn.what << ' ' << pixel.x << ' ' << pixel.y;
    }
  }
}

TEST(Turned, CirclesAreTheSame) {
  const GrayFrame frame = turned_frame();
  const auto circles_of = [](const GrayFrame& picture, Polarity polarity) {
    return without_doubles(find_circles(find_edges(picture), {7, 11, polarity, 0.4}), 0.8);
  };
  const std::vector<Circle> plain = circles_of(frame, Polarity::dark_beads);
  EXPECT_GE(plain.size(), 16U);
  for (const Turn& turn : turns())
    expect_circles(circles_of(turn.of(frame), turned_polarity(turn)), plain, frame, turn, 0.12);
}

TEST(Turned, VotesAreTheSame) {
  const GrayFrame frame = turned_frame();
  const std::vector<RadiusCandidate> plain = vote_for_radii(frame, 1, {4, 20});
  ASSERT_FALSE(plain.empty());
  for (const Turn& turn : turns()) {
    const std::vector<RadiusCandidate> votes = vote_for_radii(turn.of(frame), 1, {4, 20});
    ASSERT_EQ(votes.size(), plain.size()) << turn.what;
    for (std::size_t k = 0; k < votes.size(); ++k) {
      EXPECT_NEAR(votes[k].radius, plain[k].radius, 1e-3) << turn.what;
      EXPECT_EQ(votes[k].sign, turn.negative ? -plain[k].sign : plain[k].sign) << turn.what;
      EXPECT_NEAR(votes[k].explained, plain[k].explained, 2e-3) << turn.what;
      EXPECT_NEAR(votes[k].support, plain[k].support, 2e-3) << turn.what;
      EXPECT_EQ(votes[k].count, plain[k].count) << turn.what;
      EXPECT_NEAR(votes[k].spacing.median, plain[k].spacing.median, 1e-2) << turn.what;
    }
  }
}

TEST(Turned, RimsAreTheSame) {
  const GrayFrame frame = turned_frame();
  const auto look_at = [](const GrayFrame& picture, Polarity polarity) {
    LearnedRims rims = learn_rims(picture, polarity, 9.2);
    learn_gaps(picture, rims, false);
    return rims;
  };
  const LearnedRims plain = look_at(frame, Polarity::dark_beads);
  const RimsFound beads = find_rims(frame, plain.model);
  EXPECT_GE(beads.disks.size(), 15U);
  for (const Turn& turn : turns()) {
    const GrayFrame turned = turn.of(frame);
    const LearnedRims rims = look_at(turned, turned_polarity(turn));
    EXPECT_NEAR(rims.model.radius_px, plain.model.radius_px, 0.01) << turn.what;
    EXPECT_NEAR(rims.model.open_radius_px, plain.model.open_radius_px, 0.01) << turn.what;
    EXPECT_NEAR(rims.model.radius_spread, plain.model.radius_spread, 3e-3) << turn.what;
    EXPECT_NEAR(rims.model.contrast, plain.model.contrast, 0.5) << turn.what;
    EXPECT_NEAR(rims.edge_length_px, plain.edge_length_px, 5) << turn.what;
    const RimsFound found = find_rims(turned, rims.model);
    std::vector<Circle> here, there;
    for (const RimDisk& disk : found.disks) here.push_back(disk.circle);
    for (const RimDisk& disk : beads.disks) there.push_back(disk.circle);
    expect_circles(here, there, frame, turn, 0.12);
    EXPECT_NEAR(found.expected_missed, beads.expected_missed, 0.2) << turn.what;
    const Roundness round = roundness_of(turned, rims.model, rims.disks),
                    plainly = roundness_of(frame, plain.model, plain.disks);
    EXPECT_EQ(round.outlines, plainly.outlines) << turn.what;
    EXPECT_NEAR(round.on_circle, plainly.on_circle, 0.02) << turn.what;
    EXPECT_NEAR(round.deviation, plainly.deviation, 2e-3) << turn.what;
    EXPECT_NEAR(round.rim_width, plainly.rim_width, 2e-3) << turn.what;
  }
}

// Beads of contrast 1, as fits see them: the same bead at all places above, brighter on one side, and something in each
// pixel that repeats nowhere.
constexpr double fitted_radius = 9.03, fitted_edge = 1.1, fitted_reach = 13;
const BeadProfile& fitted_profile() {
  static const BeadProfile profile = test::blurred_profile(fitted_radius, fitted_edge, fitted_reach, 0.05);
  return profile;
}
std::vector<ModelDisk> fitted_beads() {
  std::vector<ModelDisk> disks;
  for (const RenderedDisk& bead : turned_beads()) {  // no pixel on the border of an eighth of a turn
    const auto k = static_cast<int>(disks.size());
    ModelDisk& disk = disks.emplace_back();
    disk.x = bead.x_px + 0.02 * test::scattered(k, 1), disk.y = bead.y_px + 0.02 * test::scattered(1, k);
  }
  return disks;
}
std::vector<ModelDisk> turned_places(const std::vector<ModelDisk>& disks, const GrayFrame& frame, const Turn& turn) {
  std::vector<ModelDisk> turned = disks;
  for (ModelDisk& disk : turned) std::tie(disk.x, disk.y) = turn.place(frame, disk.x, disk.y);
  return turned;
}
GrayFrame flat_frame() {
  const std::vector<ModelDisk> disks = fitted_beads();
  return test::frame_by(turned_width, turned_height, [&](int column, int row) {
    double level = 0.1 * test::scattered(column, row) - 0.05;
    for (const ModelDisk& disk : disks) {
      const double dx = column - disk.x, dy = row - disk.y, r = std::hypot(dx, dy);
      const auto cell = static_cast<std::size_t>(r / fitted_profile().step_px);
      if (cell < fitted_profile().level.size())
        level += static_cast<double>(fitted_profile().level[cell]) * (1 + 0.02 * dx - 0.012 * dy);
    }
    return level;
  });
}

// Beads that a border cuts have the same share in what is learned, whichever border it is.
TEST(Turned, LearnedBeadsAreTheSame) {
  const GrayFrame flat = flat_frame();
  const std::vector<ModelDisk> disks = fitted_beads();
  const ProfileTable table(fitted_profile(), fitted_radius, fitted_edge, 0);
  struct Learned {
    BeadProfile profile;
    std::shared_ptr<const BeadAsymmetry> asymmetry;
    FreeRim open;
  };
  const auto learned_of = [&](const GrayFrame& frame, const std::vector<ModelDisk>& beads) {
    JointFit fit(frame);
    fit.set_table(&table);
    fit.reset(frame, beads);
    return Learned{
        learn_profile({&fit}, {&beads}, fitted_profile(),
                      {.reach_px = fitted_reach, .knot_px = 0.6, .radius_px = fitted_radius, .fourth_harmonic = true}),
        learn_asymmetry({&fit}, {&beads}, fitted_profile(), {.radius_px = fitted_radius, .noise = 0.02}),
        learn_free_rim({frame}, {&beads}, fitted_radius, 0.4)};
  };
  const Learned plain = learned_of(flat, disks);
  ASSERT_TRUE(plain.asymmetry);
  EXPECT_GT(plain.open.sectors, 10U);
  const auto expect_same = [](const std::vector<float>& one, const std::vector<float>& other, const char* what) {
    ASSERT_EQ(one.size(), other.size()) << what;
    for (std::size_t k = 0; k < one.size(); ++k) ASSERT_NEAR(one[k], other[k], 1e-4F) << what << ' ' << k;
  };
  for (const Turn& turn : turns()) {
    if (turn.negative) continue;  // contrasts are those of beads
    const Learned learned = learned_of(turn.of(flat), turned_places(disks, flat, turn));
    expect_same(learned.profile.level, plain.profile.level, turn.what);
    expect_same(learned.profile.fourth_harmonic, plain.profile.fourth_harmonic, turn.what);
    EXPECT_EQ(learned.open.sectors, plain.open.sectors) << turn.what;
    expect_same(learned.open.profile.level, plain.open.profile.level, turn.what);
    ASSERT_TRUE(learned.asymmetry) << turn.what;
    for (double y = -8.5; y < 9; y += 1.7)
      for (double x = -8.3; x < 9; x += 1.7) {
        const auto [u, v] = turn.vector(x, y);
        ASSERT_NEAR(learned.asymmetry->at(u, v), plain.asymmetry->at(x, y), 1e-6) << turn.what << ' ' << x << ' ' << y;
      }
  }
}

// What is said of each bead, where it moves to, and its error.
TEST(Turned, FitsAreTheSame) {
  const GrayFrame flat = flat_frame();
  std::vector<ModelDisk> disks = fitted_beads();
  for (std::size_t k = 0; k < disks.size(); ++k) {
    disks[k].x += 0.6 * test::scattered(static_cast<int>(k), 3) - 0.3;
    disks[k].y += 0.6 * test::scattered(3, static_cast<int>(k)) - 0.3;
  }
  const ProfileTable table(fitted_profile(), fitted_radius, fitted_edge, 0.7);
  const auto fitted = [&](const GrayFrame& frame, std::vector<ModelDisk>& beads) {
    JointFit fit(frame);
    fit.set_table(&table);
    fit.reset(frame, beads);
    fit.sweep(beads, 0.2, 1e-5, 0.3);
    fit.step_together(frame, beads, 0.1, 0.3);
    fit.judge(beads, fitted_radius + 1);
    return fit.covariances(beads);
  };
  std::vector<ModelDisk> plain = disks;
  const std::vector<CentreCovariance> errors = fitted(flat, plain);
  for (const Turn& turn : turns()) {
    if (turn.negative) continue;
    const GrayFrame turned = turn.of(flat);
    std::vector<ModelDisk> beads = turned_places(disks, flat, turn);
    const std::vector<CentreCovariance> covariances = fitted(turned, beads);
    for (std::size_t k = 0; k < beads.size(); ++k) {
      const auto [x, y] = turn.place(flat, plain[k].x, plain[k].y);
      EXPECT_NEAR(beads[k].x, x, 1e-4) << turn.what << ' ' << k;
      EXPECT_NEAR(beads[k].y, y, 1e-4) << turn.what << ' ' << k;
      EXPECT_NEAR(beads[k].explained, plain[k].explained, 1e-4) << turn.what << ' ' << k;
      EXPECT_NEAR(beads[k].amplitude, plain[k].amplitude, 1e-4) << turn.what << ' ' << k;
      EXPECT_NEAR(beads[k].rim_explained, plain[k].rim_explained, 1e-4) << turn.what << ' ' << k;
      EXPECT_NEAR(beads[k].best_explained, plain[k].best_explained, 1e-4) << turn.what << ' ' << k;
      const CentreCovariance &one = covariances[k], &other = errors[k];
      EXPECT_NEAR(one.xx, turn.transpose ? other.yy : other.xx, 1e-3 * other.xx) << turn.what << ' ' << k;
      EXPECT_NEAR(one.yy, turn.transpose ? other.xx : other.yy, 1e-3 * other.yy) << turn.what << ' ' << k;
      EXPECT_NEAR(one.xy, turn.transpose ? other.xy : -other.xy, 1e-3 * other.xx) << turn.what << ' ' << k;
    }
  }
}

// A floor of even grey along one side, and a wall that slopes along another.
TEST(Turned, BordersAreTheSame) {
  GrayFrame frame = turned_frame();
  for (int row = 0; row < turned_height; ++row)
    for (int column = 0; column < turned_width; ++column) {
      const double noise = 3 * test::scattered(column, row);
      if (row > 112) test::set(frame, column, row, 30 + noise);
      if (column < 11 + 0.04 * row) test::set(frame, column, row, 110 + noise);
    }
  const std::vector<SolidBorder> plain = find_solid_borders(frame);
  EXPECT_GE(plain.size(), 2U);
  const GrayFrame rest = without_borders(frame, plain, 1.5);
  for (const Turn& turn : turns()) {
    const GrayFrame turned = turn.of(frame);
    const std::vector<SolidBorder> borders = find_solid_borders(turned);
    EXPECT_EQ(borders.size(), plain.size()) << turn.what;
    const GrayFrame open = without_borders(turned, borders, 1.5), expected = turn.of(rest);
    int other = 0;  // along the sloping end, where lines are counted from the other side
    for (std::size_t k = 0; k < open.pixels.size(); ++k) other += unseen(open.pixels[k]) != unseen(expected.pixels[k]);
    EXPECT_LT(other, 20) << turn.what;
  }
}

TEST(Turned, SignsOfADrawingAreTheSame) {
  const GrayFrame frame = test::frame_by(60, 44, [](int column, int row) {
    if (row == 12 || column == 40) return 20.0;
    return column > 20 && row > 20 ? 100 : 150 + std::floor(3 * test::scattered(column, row));
  });
  const DrawingSigns plain = signs_of_drawing(frame);
  EXPECT_GT(plain.flat_share, 0.05);
  EXPECT_GE(plain.ruled_lines, 1U);
  for (const Turn& turn : turns()) {
    const DrawingSigns signs = signs_of_drawing(turn.of(frame));
    EXPECT_NEAR(signs.flat_share, plain.flat_share, 1e-12) << turn.what;
    EXPECT_NEAR(signs.faint_share, plain.faint_share, 1e-12) << turn.what;
    EXPECT_EQ(signs.ruled_lines, plain.ruled_lines) << turn.what;
  }
}

}  // namespace
}  // namespace shakebed::ingest
