// What rims tell of pixels and lens: the least squares over all pixels written down once more, bead by bead.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/profile/lens.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// One pixel: what it gains by a common growth, the aspect, the radial term by sizes and by shapes; what is left there.
struct RimPixel {
  std::array<double, 4> gain{};
  double left = 0;
  std::size_t bead = 0;
};

void add_rim_pixels(const GrayFrame& frame, const std::vector<FoundDisk>& disks, const FinderCalibration& finder,
                    std::size_t first_bead, std::vector<RimPixel>& pixels) {
  FindResult found;
  found.disks = disks;
  const GrayFrame left = residual_frame(frame, found, finder);
  const std::vector<float>& level = finder.profile.level;
  const double half = 0.5 * std::hypot(frame.width, frame.height);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      RimPixel pixel;
      double nearest = HUGE_VAL;
      for (std::size_t k = 0; k < disks.size(); ++k) {
        const double dx = column - disks[k].x_px, dy = row - disks[k].y_px, r = std::hypot(dx, dy);
        const auto cell = static_cast<std::size_t>(r / finder.profile.step_px);
        if (r > finder.profile.reach_px() || cell + 1 >= level.size() || r < 1e-9) continue;
        const double slope = static_cast<double>(level[cell + 1] - level[cell]) / finder.profile.step_px;
        // From the middle of the frame, in half diagonals; along the radius and altogether.
        const double u = (disks[k].x_px - 0.5 * (frame.width - 1)) / half,
                     v = (disks[k].y_px - 0.5 * (frame.height - 1)) / half;
        const double along = (dx * u + dy * v) / r, away = u * u + v * v, radius = finder.rim_radius_px;
        pixel.gain[0] -= slope;
        pixel.gain[1] += slope * radius * std::pow(dx / r, 2);
        pixel.gain[2] += slope * radius * 2 * away;
        pixel.gain[3] += slope * radius * (2 * along * along - away);
        if (r < nearest) nearest = r, pixel.bead = first_bead + k;
      }
      pixel.left = static_cast<double>(left.at(column, row)) / finder.contrast_level;
      if (pixel.gain[0] != 0 && std::abs(pixel.left) <= 0.5) pixels.push_back(pixel);
    }
}

// The terms that explain the pixels best, those of one bead left out. `together`: sizes and shapes tell the same term.
std::array<double, 4> terms_of(const std::vector<RimPixel>& pixels, bool together, std::size_t without) {
  const std::size_t count = together ? 3 : 4;
  std::vector<std::vector<double>> normal(count, std::vector<double>(count, 0.0));
  std::vector<double> right(count, 0.0);
  for (const RimPixel& pixel : pixels) {
    if (pixel.bead == without) continue;
    std::array<double, 4> row = pixel.gain;
    if (together) row[2] += row[3];
    for (std::size_t a = 0; a < count; ++a) {
      right[a] += row[a] * pixel.left;
      for (std::size_t b = 0; b < count; ++b) normal[a][b] += row[a] * row[b];
    }
  }
  const auto inverse = test::inverse_of(normal);
  std::array<double, 4> terms{};
  for (std::size_t a = 0; a < count; ++a)
    for (std::size_t b = 0; b < count; ++b) terms[a] += inverse[a][b] * right[b];
  if (together) terms[3] = terms[2];
  return terms;
}

std::vector<RenderedDisk> beads_of_lens(int columns, int rows) {
  std::vector<RenderedDisk> disks;
  for (int k = 0; k < columns * rows; ++k)
    disks.push_back({9.5 + 14.2 * (k % columns) + test::scattered(k, 4),
                     9.5 + 13.4 * (k / columns) + test::scattered(4, k), 5.5 + 0.12 * std::abs(k % columns - 2.5), 0,
                     0});
  return disks;
}
GrayFrame seen_through(const std::vector<RenderedDisk>& disks, std::uint64_t seed) {
  Camera camera;
  camera.width = 92, camera.height = 72;
  camera.blur_px = 0.8, camera.read_noise = 3, camera.seed = seed;
  return render_frame(disks, camera);
}

TEST(LensEstimate, IsTheLeastSquaresOfTheRims) {
  const std::vector<RenderedDisk> truth = beads_of_lens(6, 5);
  const std::vector<GrayFrame> frames = {seen_through(truth, 1), seen_through(truth, 2)};
  FinderCalibration finder;
  std::vector<FindResult> found = {find_disks(frames[0], {}, &finder)};
  found.push_back(find_disks(frames[1], finder));
  found[1].disks.resize(12);
  found[1].disks[3].x_px += 0.4;  // and what is wrong there counts for this bead
  ASSERT_EQ(found[0].disks.size(), 30U);
  std::vector<RimPixel> pixels;
  add_rim_pixels(frames[0], found[0].disks, finder, 0, pixels);
  add_rim_pixels(frames[1], found[1].disks, finder, 30, pixels);
  const LensEstimate lens = estimate_lens({frames.data(), &frames[1]}, found, finder);
  ASSERT_TRUE(lens.known);
  constexpr std::size_t nobody = 1000;
  const auto all = terms_of(pixels, true, nobody), apart = terms_of(pixels, false, nobody);
  EXPECT_NEAR(lens.lens.pixel_aspect, 1 + all[1], 1e-5);
  EXPECT_NEAR(lens.lens.radial, all[2], 1e-5);
  EXPECT_NEAR(lens.radial_by_size, apart[2], 1e-5);
  EXPECT_NEAR(lens.radial_by_shape, apart[3], 1e-5);
  EXPECT_GT(std::abs(all[2]), 1e-3) << "there is something to see";
  // The jackknife: how much each bead changes.
  double aspect = 0, radial = 0, difference = 0;
  for (std::size_t bead = 0; bead < 42; ++bead) {
    const auto without = terms_of(pixels, true, bead), both = terms_of(pixels, false, bead);
    aspect += std::pow(without[1] - all[1], 2), radial += std::pow(without[2] - all[2], 2);
    difference += std::pow(both[2] - both[3] - apart[2] + apart[3], 2);
  }
  EXPECT_NEAR(lens.aspect_std_error / std::sqrt(aspect), 1, 1e-3);
  EXPECT_NEAR(lens.radial_std_error / std::sqrt(radial), 1, 1e-3);
  EXPECT_NEAR(lens.difference_std_error / std::sqrt(difference), 1, 1e-3);
}

// Twenty whole beads are enough; those that are cut or half hidden are none.
TEST(LensEstimate, NeedsTwentyWholeBeads) {
  const GrayFrame frame = seen_through(beads_of_lens(6, 5), 3);
  FinderCalibration finder;
  FindResult found = find_disks(frame, {}, &finder);
  const auto known = [&](std::size_t whole, bool half_hidden) {
    FindResult some = found;
    for (std::size_t k = whole; k < some.disks.size(); ++k)
      (half_hidden ? some.disks[k].half_hidden : some.disks[k].cut) = true;
    return estimate_lens({&frame}, {some}, finder).known;
  };
  for (FoundDisk& disk : found.disks) disk.cut = disk.half_hidden = false;
  for (const bool half_hidden : {true, false}) {
    EXPECT_TRUE(known(20, half_hidden));
    EXPECT_FALSE(known(19, half_hidden));
  }
  EXPECT_EQ(estimate_lens({&frame}, {FindResult()}, finder).lens.radial, 0);
}

// Sizes and shapes agree within three of their errors, or within a quarter of the term.
TEST(LensEstimate, IsALensBySizeAndShape) {
  LensEstimate lens;
  lens.lens.radial = -0.1;
  const auto agrees = [&](double apart, double error) {
    lens.radial_by_size = -0.09, lens.radial_by_shape = -0.09 - apart, lens.difference_std_error = error;
    return lens.by_size_and_shape();
  };
  EXPECT_TRUE(agrees(0.0249, 0.001));
  EXPECT_FALSE(agrees(0.0251, 0.001));
  EXPECT_TRUE(agrees(-0.0249, 0.001));
  EXPECT_FALSE(agrees(-0.0251, 0.001));
  EXPECT_TRUE(agrees(0.059, 0.02));
  EXPECT_FALSE(agrees(0.061, 0.02));
}

}  // namespace
}  // namespace shakebed::ingest
