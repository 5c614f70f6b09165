// Edges, circles through them, and the copies of a picture in which they are looked for.
#include "ingest/find/edge_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/circle_search.hpp"
#include "ingest/find/outline.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::even_frame;
using test::frame_by;

// --- edge_map.hpp ----------------------------------------------------------------------------------------------------

// The difference of the two neighbours of the picture smoothed by 1 4 6 4 1 along both axes.
TEST(Edges, AreDifferencesOfTheSmoothedPicture) {
  const GrayFrame frame = frame_by(17, 15, [](int column, int row) { return 100 * test::scattered(column, row); });
  const EdgeMap edges = find_edges(frame);
  constexpr std::array<double, 5> weight = {1, 4, 6, 4, 1};
  const auto smooth = [&](int column, int row) {
    double sum = 0;
    for (int dy = -2; dy <= 2; ++dy)
      for (int dx = -2; dx <= 2; ++dx)
        sum += weight[static_cast<std::size_t>(dx + 2)] * weight[static_cast<std::size_t>(dy + 2)] / 256 *
               static_cast<double>(frame.at(column + dx, row + dy));
    return sum;
  };
  for (int row = 4; row < 11; ++row)
    for (int column = 4; column < 13; ++column) {
      const double x = 0.5 * (smooth(column + 1, row) - smooth(column - 1, row)),
                   y = 0.5 * (smooth(column, row + 1) - smooth(column, row - 1));
      EXPECT_NEAR(edges.x[edges.at(column, row)], x, 1e-4);
      EXPECT_NEAR(edges.y[edges.at(column, row)], y, 1e-4);
      EXPECT_NEAR(edges.slope(edges.at(column, row)), std::hypot(x, y), 1e-4);
    }
  EXPECT_EQ(edges.width, 17);
  EXPECT_EQ(edges.height, 15);
  // A ramp keeps its slope up to the second pixel from each side; the outermost pixels have none.
  const EdgeMap ramp = find_edges(frame_by(9, 8, [](int column, int row) { return 3 * column - 2 * row; }));
  for (int row = 0; row < 8; ++row)
    for (int column = 0; column < 9; ++column) {
      const bool inside = column > 0 && row > 0 && column < 8 && row < 7;
      EXPECT_NEAR(ramp.x[ramp.at(column, row)], inside ? 3 : 0, 1e-5) << column << ' ' << row;
      EXPECT_NEAR(ramp.y[ramp.at(column, row)], inside ? -2 : 0, 1e-5) << column << ' ' << row;
    }
  for (const RidgePixel& pixel : ramp.ridge)  // no slope is steeper than its neighbours but at the sides
    EXPECT_TRUE(pixel.x == 1 || pixel.x == 7 || pixel.y == 1 || pixel.y == 6) << pixel.x << ' ' << pixel.y;
  for (const GrayFrame& small : {even_frame(4, 9, 1), even_frame(9, 4, 1)}) {
    const EdgeMap none = find_edges(small);
    EXPECT_EQ(none.x, std::vector<float>(36, 0.0F));
    EXPECT_EQ(none.y, std::vector<float>(36, 0.0F));
  }
  EXPECT_EQ(find_edges(frame_by(5, 5, [](int column, int) { return 10 * column; })).x[12], 10);
}

// The largest of four times the gradient's noise, a tenth of the strong edges, and 0.3.
TEST(Edges, CountFromAThresholdOn) {
  EXPECT_EQ(find_edges(even_frame(50, 40, 90)).threshold, 0.3F);
  EXPECT_EQ(find_edges(even_frame(50, 40, 90), 7).threshold, 7);
  // Slopes of 12 in a tenth of the picture.
  const GrayFrame ramp = frame_by(100, 40, [](int column, int) { return 12 * std::clamp(column - 40, 0, 14); });
  EXPECT_NEAR(find_edges(ramp).threshold, 1.2, 1e-4);
  RandomStream random(5);
  GrayFrame noise = frame_by(300, 200, [&](int, int) { return 100 + 10 * random.normal(); });
  const float threshold = find_edges(noise).threshold;
  EXPECT_NEAR(threshold, 4 * 1.5, 0.1);
  // The gradient's own standard deviation is what it is said to be: 1.5 of 10.
  const EdgeMap edges = find_edges(noise);
  double square = 0;
  for (const float x : edges.x) square += static_cast<double>(x * x) / static_cast<double>(edges.x.size());
  EXPECT_NEAR(std::sqrt(square), 1.5, 0.05);
  for (int row = 50; row < 150; ++row)
    for (int column = 100; column < 200; ++column) test::set(noise, column, row, unseen_level);
  const EdgeMap hidden = find_edges(noise);
  EXPECT_NEAR(hidden.threshold, threshold, 0.2);
  for (int row = 50; row < 150; ++row)
    for (int column = 100; column < 200; ++column) ASSERT_EQ(hidden.slope(hidden.at(column, row)), 0);
  EXPECT_EQ(hidden.slope(hidden.at(98, 100)), 0) << "beside what is unseen";
  EXPECT_GT(hidden.slope(hidden.at(96, 100)), 0);
}

// Column and row of each pixel decide alone, at the borders of the frame, too.
TEST(Edges, AreNotSoughtFarFromARegion) {
  const GrayFrame frame = frame_by(9, 8, [](int column, int row) { return 10 * row + column; });
  for (const auto& [region, margin] :
       {std::pair(PixelRectangle{3, 2, 3, 4}, 0.0), std::pair(PixelRectangle{3, 2, 3, 4}, 1.2),
        std::pair(PixelRectangle{-2, 6, 4, 9}, 1.0)}) {
    const int more = margin > 0 ? static_cast<int>(std::ceil(margin)) : 0;
    const GrayFrame seen = seen_inside(frame, region, margin);
    for (int row = 0; row < 8; ++row)
      for (int column = 0; column < 9; ++column) {
        const bool inside = column >= region.left - more && column < region.left + region.width + more &&
                            row >= region.top - more && row < region.top + region.height + more;
        EXPECT_EQ(unseen(seen.at(column, row)), !inside) << column << ", " << row;
        if (inside) {
          EXPECT_EQ(seen.at(column, row), frame.at(column, row));
        }
      }
  }
}

// White noise of 10 levels, enlarged twice: its gradients are as small as is said, and the threshold is four of them.
TEST(Edges, KnowTheNoiseOfADoubledPicture) {
  RandomStream random(7);
  const GrayFrame noise = doubled(frame_by(300, 200, [&](int, int) { return 100 + 10 * random.normal(); }));
  const EdgeMap edges = find_edges(noise, 0, Pixels::doubled);
  double square = 0;
  for (const float x : edges.x) square += static_cast<double>(x * x) / static_cast<double>(edges.x.size());
  EXPECT_NEAR(std::sqrt(square), 1.91, 0.04);
  EXPECT_NEAR(edges.threshold, 4 * 1.91, 0.15);
  EXPECT_LT(find_edges(noise).threshold, 0.5 * edges.threshold) << "taken for the picture's own pixels";
}

// A step of 100 in each of 16 directions: one pixel for each row or column it crosses, with the normal's direction.
TEST(Edges, AreOnePixelThick) {
  for (int k = 0; k < 16; ++k) {
    const double angle = k * std::numbers::pi / 8, c = std::cos(angle), s = std::sin(angle);
    const GrayFrame frame = frame_by(41, 41, [&](int column, int row) {
      return 100 * std::clamp(0.5 + (column - 20) * c + (row - 20) * s - 0.13, 0.0, 1.0);
    });
    const EdgeMap edges = find_edges(frame);
    std::vector<int> crossed(41, 0);
    const bool by_rows = std::abs(c) > std::abs(s);
    for (const RidgePixel& pixel : edges.ridge) {
      if (pixel.x < 3 || pixel.y < 3 || pixel.x > 37 || pixel.y > 37) continue;
      EXPECT_NEAR(pixel.unit_x, c, 0.08);
      EXPECT_NEAR(pixel.unit_y, s, 0.08);
      EXPECT_NEAR((static_cast<double>(pixel.x) - 20) * c + (static_cast<double>(pixel.y) - 20) * s, 0.13, 0.8);
      ++crossed[static_cast<std::size_t>(by_rows ? pixel.y : pixel.x)];
    }
    for (std::size_t at = 13; at < 28; ++at) {
      EXPECT_GE(crossed[at], 1) << k << ' ' << at;
      EXPECT_LE(crossed[at], 2) << k << ' ' << at;
    }
  }
  // Steps up and down three pixels apart are two ridges; of two equal neighbours only one is on it.
  const EdgeMap step = find_edges(frame_by(20, 9, [](int column, int) { return column < 10 ? 0 : 100; }));
  int rows = 0;
  for (const RidgePixel& pixel : step.ridge) {
    if (pixel.y < 3 || pixel.y > 5) continue;
    ++rows;
    EXPECT_EQ(pixel.x, 9);
    EXPECT_EQ(pixel.unit_x, 1);
    EXPECT_EQ(pixel.unit_y, 0);
  }
  EXPECT_EQ(rows, 3);
}

// --- picture_scale.hpp, picture_parts.hpp, smooth_field.hpp ----------------------------------------------------------

// A row or a column that is alone is its own neighbour: nothing beyond it is read.
TEST(PictureScale, OfALineIsALine) {
  const GrayFrame line{1, 3, {10, 20, 40}}, twice = doubled(line);
  ASSERT_EQ(twice.width, 2);
  ASSERT_EQ(twice.height, 6);
  const double down[] = {10, 12.5, 17.5, 25, 35, 40};
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 2; ++column)
      EXPECT_NEAR(static_cast<double>(twice.at(column, row)), down[row], 0.03) << row;
  const GrayFrame across = doubled(GrayFrame{3, 1, {10, 20, 40}});
  for (int column = 0; column < 6; ++column)
    for (int row = 0; row < 2; ++row)
      EXPECT_NEAR(static_cast<double>(across.at(column, row)), down[column], 0.03) << column;
}

TEST(PictureScale, OfARampIsARamp) {
  const auto ramp = [](double x, double y) { return 20 + 3 * x - 2 * y; };
  const GrayFrame frame = frame_by(12, 9, ramp);
  const GrayFrame twice = doubled(frame);
  ASSERT_EQ(twice.width, 24);
  ASSERT_EQ(twice.height, 18);
  for (int row = 0; row < 18; ++row)
    for (int column = 0; column < 24; ++column)
      EXPECT_NEAR(twice.at(column, row),
                  ramp(std::clamp((column + 0.5) / 2 - 0.5, 0.0, 11.0), std::clamp((row + 0.5) / 2 - 0.5, 0.0, 8.0)),
                  4e-3);
  for (const double angle : {0.0, 0.5, std::numbers::pi / 2, 2.2}) {
    const double ratio = 1.44, c = std::cos(angle), s = std::sin(angle);
    const GrayFrame copy = stretched(frame, ratio, angle);
    for (int row = 0; row < 9; ++row)
      for (int column = 0; column < 12; ++column) {
        // Along the axis a place comes from 1.2 times as far, across it from 1/1.2; beyond a border it is mirrored.
        const double u = column - 5.5, v = row - 4, along = 1.2 * (u * c + v * s), across = (v * c - u * s) / 1.2;
        double x = std::abs(5.5 + along * c - across * s), y = std::abs(4 + along * s + across * c);
        if (x > 11) x = 22 - x;
        if (y > 8) y = 16 - y;
        const FramePlace place = place_before_stretching(frame, ratio, angle, column, row);
        EXPECT_NEAR(place.x, x, 2e-3);
        EXPECT_NEAR(place.y, y, 2e-3);
        EXPECT_NEAR(copy.at(column, row), ramp(x, y), 0.02);
      }
  }
}

TEST(PictureScale, MakesARadiusEightToSixteenPixels) {
  EXPECT_EQ(scale_for(4.9), 0.5);
  EXPECT_EQ(scale_for(5), 1);
  EXPECT_EQ(scale_for(15.9), 1);
  EXPECT_EQ(scale_for(16), 2);
  EXPECT_EQ(scale_for(47.9, 16), 2);
  const GrayFrame frame = frame_by(33, 26, [](int column, int row) { return column + 100 * row; });
  const ScaledPicture third = scaled_for(frame, 25);
  EXPECT_EQ(third.scale, 3);
  EXPECT_EQ(third.picture.width, 11);
  EXPECT_EQ(third.picture.height, 8);
  EXPECT_NEAR(third.picture.at(2, 1), 7 + 100 * 4, 1e-3);
  EXPECT_NEAR(third.to_frame_x(2), 7, 1e-12);
  EXPECT_NEAR(third.to_frame_y(1), 4, 1e-12);
  EXPECT_NEAR(third.from_frame_x(7), 2, 1e-12);
  EXPECT_NEAR(third.from_frame_y(4), 1, 1e-12);
  ScaledPicture part = third;
  part.left = 9, part.top = 6;
  EXPECT_NEAR(part.to_frame_x(2), 16, 1e-12);
  EXPECT_NEAR(part.to_frame_y(1), 10, 1e-12);
  EXPECT_NEAR(part.from_frame_x(16), 2, 1e-12);
  EXPECT_NEAR(part.from_frame_y(10), 1, 1e-12);
  EXPECT_EQ(scaled_for(frame, 4).picture.width, 66);
  EXPECT_EQ(scaled_for(frame, 4).scale, 0.5);
}

// Each map is made once for a scale and a threshold; its copies are the picture stretched in four directions.
TEST(PictureScale, MapsAreMadeOnce) {
  const GrayFrame frame = frame_by(60, 50, [](int column, int row) { return 200 * test::scattered(column, row); });
  PictureMaps maps(frame, 8);
  const PictureMap& one = maps.scaled_for(9);
  EXPECT_EQ(&one, &maps.scaled_for(15));
  EXPECT_NE(&one, &maps.scaled_for(17));
  EXPECT_NE(&one, &maps.scaled_for(9, 5));
  EXPECT_EQ(maps.scaled_for(9, 5).edges.threshold, 5);
  EXPECT_EQ(one.copies.size(), 0U);
  const PictureMap& with = maps.with_copies(9);
  EXPECT_EQ(&one, &with);
  ASSERT_EQ(with.copies.size(), 4U);
  EXPECT_EQ(maps.with_copies(9).copies.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(copy_angle(k), static_cast<double>(k) * std::numbers::pi / 4, 1e-12);
    const EdgeMap edges = find_edges(stretched(frame, 1.8, copy_angle(k)), one.edges.threshold);
    ASSERT_EQ(with.copies[k].size(), 1U);
    EXPECT_EQ(with.copies[k].front().edges.x, edges.x);
    EXPECT_EQ(with.copies[k].front().edges.threshold, one.edges.threshold);
  }
}

TEST(PictureParts, AreAveragesAndPieces) {
  const GrayFrame frame = frame_by(7, 5, [](int column, int row) { return column * column + 10 * row; });
  const GrayFrame half = halved(frame);
  ASSERT_EQ(half.width, 3);
  ASSERT_EQ(half.height, 2);
  for (int row = 0; row < 2; ++row)
    for (int column = 0; column < 3; ++column) {
      const int c = 2 * column;
      EXPECT_NEAR(half.at(column, row), 0.5 * (c * c + (c + 1) * (c + 1)) + 10 * (2 * row + 0.5), 1e-5);
    }
  for (const int factor : {2, 3}) {
    const GrayFrame small = reduced(frame, factor);
    ASSERT_EQ(small.width, 7 / factor);
    ASSERT_EQ(small.height, 5 / factor);
    for (int row = 0; row < small.height; ++row)
      for (int column = 0; column < small.width; ++column) {
        double sum = 0;
        for (int j = 0; j < factor; ++j)
          for (int i = 0; i < factor; ++i)
            sum += static_cast<double>(frame.at(factor * column + i, factor * row + j)) / (factor * factor);
        EXPECT_NEAR(small.at(column, row), sum, 1e-5);
      }
  }
  EXPECT_EQ(reduced(frame, 1).pixels, frame.pixels);
  const GrayFrame cut = cut_out(frame, {2, 1, 3, 2});
  EXPECT_EQ(cut.width, 3);
  EXPECT_EQ(cut.height, 2);
  EXPECT_EQ(cut.pixels, (std::vector<float>{14, 19, 26, 24, 29, 36}));
  const GrayFrame smooth = smoothed(frame);
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 7; ++column) {
      const bool inside = column > 0 && row > 0 && column < 6 && row < 4;
      EXPECT_NEAR(smooth.at(column, row), static_cast<double>(frame.at(column, row)) + (inside ? 0.5 : 0), 1e-5);
    }
}

// A small patch of texture in an even frame is in the part, wherever it is.
TEST(PictureParts, TheBusiestHoldsWhatChanges) {
  for (const auto& [left, top] : {std::array{0, 0}, {84, 4}, {4, 64}, {84, 64}, {36, 36}}) {
    GrayFrame frame = even_frame(100, 80, 50);
    for (int row = top; row < top + 12; ++row)
      for (int column = left; column < left + 12; ++column)
        test::set(frame, column, row, 100 * test::scattered(column, row));
    const PicturePart part = busiest_part(frame, 40, {.block = 4, .reach = 1, .stride = 1});
    EXPECT_EQ(part.width, 40);
    EXPECT_EQ(part.height, 40);
    EXPECT_GE(part.left, 0);
    EXPECT_GE(part.top, 0);
    EXPECT_LE(part.left + part.width, 100);
    EXPECT_LE(part.top + part.height, 80);
    EXPECT_LE(part.left, left);
    EXPECT_LE(part.top, top);
    EXPECT_GE(part.left + 40, left + 12);
    EXPECT_GE(part.top + 40, top + 12);
  }
  // Of two patches the one of more change; a step beside what is unseen is none.
  GrayFrame frame = even_frame(100, 40, 50);
  for (int row = 8; row < 20; ++row)
    for (int column = 8; column < 20; ++column) {
      test::set(frame, column, row, 40 * test::scattered(column, row));
      test::set(frame, column + 72, row, 60 * test::scattered(column, row));
      test::set(frame, column + 36, row, column % 2 ? unseen_level : 0);
    }
  EXPECT_GE(busiest_part(frame, 24, {.block = 4, .reach = 2, .stride = 2}).left, 60);
  const PicturePart whole = busiest_part(frame, 200, {.block = 16, .reach = 2, .stride = 2});
  EXPECT_EQ(whole.left, 0);
  EXPECT_EQ(whole.top, 0);
  EXPECT_EQ(whole.width, 100);
  EXPECT_EQ(whole.height, 40);
}

TEST(PictureParts, HoldMostOfThePlacesGiven) {
  const std::vector<std::pair<double, double>> places = {{10, 10}, {300, 250}, {330, 240}, {310, 280}, {390, 290}};
  const PicturePart part = part_with_most(places, 120, 400, 300);
  EXPECT_EQ(part.width, 120);
  EXPECT_EQ(part.height, 120);
  for (std::size_t k = 1; k < places.size(); ++k) {
    EXPECT_TRUE(places[k].first >= part.left && places[k].first < part.left + part.width) << k;
    EXPECT_TRUE(places[k].second >= part.top && places[k].second < part.top + part.height) << k;
  }
  const PicturePart wide = part_with_most({}, 120, 400, 90);
  EXPECT_EQ(wide.width, 120);
  EXPECT_EQ(wide.height, 90);
}

// A bed in the left half of a picture: its edge, at 200 px, runs through the middle of the part.
TEST(PictureParts, AreHalfFilledAtTheEdgeOfABed) {
  const auto bed = [](double right) {
    Places places;
    for (double x = 5; x < right; x += 10)
      for (double y = 5; y < 300; y += 10) places.emplace_back(x, y);
    return places;
  };
  const auto part = part_half_filled(bed(200), 120, 400, 300);
  ASSERT_TRUE(part);
  EXPECT_NEAR(part->left + 60, 200, 8);
  EXPECT_EQ(part->width, 120);
  EXPECT_EQ(part->height, 120);
  EXPECT_FALSE(part_half_filled(bed(400), 120, 400, 300)) << "all is filled";
  EXPECT_FALSE(part_half_filled(bed(200), 500, 400, 300)) << "all of the picture is one part";
}

TEST(SmoothField, HasChebyshevsPolynomials) {
  EXPECT_EQ(polynomial_terms(0), 1U);
  EXPECT_EQ(polynomial_terms(2), 6U);
  EXPECT_EQ(polynomial_terms(4), 15U);
  std::vector<double> values(15);
  for (const auto& [a, b] : {std::array{0.3, 1.1}, {2.0, 0.7}}) {  // T_k(cos a) = cos(k a)
    polynomial_values(std::cos(a), std::cos(b), 4, values.data());
    std::size_t term = 0;
    for (int total = 0; total <= 4; ++total)
      for (int i = total; i >= 0; --i) EXPECT_NEAR(values[term++], std::cos(i * a) * std::cos((total - i) * b), 1e-12);
  }
}

TEST(SmoothField, SolvesSymmetricSystems) {
  // B B^T + 1 for a B of small whole numbers, times a known x.
  constexpr std::size_t size = 4;
  const std::array<std::array<double, size>, size> b = {{{1, 2, 0, -1}, {0, 3, 1, 2}, {2, -1, 1, 0}, {1, 1, -2, 3}}};
  std::vector<double> matrix(size * size, 0.0), right(size, 0.0);
  const std::array<double, size> x = {2, -1, 3, 0.5};
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j < size; ++j) {
      double sum = i == j ? 1 : 0;
      for (std::size_t k = 0; k < size; ++k) sum += b[i][k] * b[j][k];
      right[i] += sum * x[j];
      matrix[i * size + j] = j <= i ? sum : 1e9;  // the lower triangle alone is read
    }
  const std::vector<double> whole = matrix;
  ASSERT_TRUE(solve_symmetric(matrix, right, size));
  for (std::size_t i = 0; i < size; ++i) EXPECT_NEAR(right[i], x[i], 1e-12);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      double sum = 0;  // L L^T
      for (std::size_t k = 0; k <= j; ++k) sum += matrix[i * size + k] * matrix[j * size + k];
      EXPECT_NEAR(sum, whole[i * size + j], 1e-12);
    }
  std::vector<double> singular = {1, 0, 2, 4}, two = {1, 2};
  EXPECT_FALSE(solve_symmetric(singular, two, 2));
  std::vector<double> nothing = {0}, one = {1};
  EXPECT_FALSE(solve_symmetric(nothing, one, 1));
}

// --- circle_search.hpp -----------------------------------------------------------------------------------------------

GrayFrame disks_on_grey(int width, int height, const std::vector<RenderedDisk>& disks, double bead = 60) {
  Camera camera;
  camera.width = width, camera.height = height;
  camera.background_level = 140, camera.bead_level = bead;
  camera.blur_px = 0.8;
  return render_frame(disks, camera);
}

// What widens a sharp edge along a ray, as a variance: the picture's blur and pixels, the binomial filter, the
// difference over two pixels, and the linear interpolation between them. It moves a rim in by half of itself over the
// radius.
constexpr double variance_of_edge = 0.8 * 0.8 + 1.0 / 12 + 1 + 1.0 / 3 + 1.0 / 6;

// A whole rim, either polarity: all 32 directions meet it, and its contrast is that of the disk. The place is good to a
// twentieth of a pixel.
TEST(CircleSearch, FitsTheRimOfADisk) {
  for (const double bead : {60.0, 220.0}) {
    const EdgeMap edges = find_edges(disks_on_grey(60, 56, {{28.3, 26.8, 10, 0, 0}}, bead));
    const Polarity polarity = bead < 140 ? Polarity::dark_beads : Polarity::bright_beads,
                   other = bead < 140 ? Polarity::bright_beads : Polarity::dark_beads;
    for (const Polarity asked : {polarity, Polarity::automatic}) {
      const Circle circle = fit_circle(edges, {29, 26, 9.2}, asked);
      EXPECT_NEAR(circle.x, 28.3, 0.05);
      EXPECT_NEAR(circle.y, 26.8, 0.05);
      EXPECT_NEAR(circle.radius, 10 - variance_of_edge / 20, 0.04);
      EXPECT_EQ(circle.support, 1);
      EXPECT_EQ(circle.rays, 32);
      EXPECT_EQ(circle.directions, 32);
      EXPECT_EQ(circle.met, 0xffffffffU);
      EXPECT_LT(circle.scatter, 0.01);
      EXPECT_NEAR(circle.contrast, 2.5 * 80 / std::sqrt(2 * std::numbers::pi * variance_of_edge), 1.2);
      EXPECT_NEAR(radius_towards(edges, circle, asked, 0xffU, 8), circle.radius, 0.05);
      EXPECT_EQ(radius_towards(edges, circle, asked, 0xffU, 9), 0);
    }
    EXPECT_LT(fit_circle(edges, {29, 26, 9.2}, other).support, 0.2);
    EXPECT_EQ(fit_circle(edges, {29, 26, 9.2}, other).x, 29) << "not worth fitting";
    EXPECT_EQ(radius_towards(edges, {28.3, 26.8, 10, 1, 0, 0, 32, 32, 0}, other, 0xffffffffU, 1), 0);
  }
}

// Half of the rim is gone: half of the directions, those that point there, meet none; the place stays.
TEST(CircleSearch, KnowsWhichDirectionsMeetTheRim) {
  for (int quarter = 0; quarter < 4; ++quarter) {
    GrayFrame frame = disks_on_grey(60, 56, {{28, 27, 10, 0, 0}});
    for (int row = 0; row < 56; ++row)
      for (int column = 0; column < 60; ++column) {
        const double c = std::cos(quarter * std::numbers::pi / 2), s = std::sin(quarter * std::numbers::pi / 2);
        if ((column - 28) * c + (row - 27) * s > 2) test::set(frame, column, row, 140);
      }
    const EdgeMap edges = find_edges(frame);
    const Circle circle = fit_circle(edges, {28, 27, 10}, Polarity::dark_beads);
    EXPECT_NEAR(circle.x, 28, 0.35);
    EXPECT_NEAR(circle.y, 27, 0.35);
    for (int k = 0; k < 32; ++k) {
      const double away = std::abs(
          std::remainder(2 * std::numbers::pi * k / 32 - quarter * std::numbers::pi / 2, 2 * std::numbers::pi));
      const bool met = (circle.met >> static_cast<unsigned>(k) & 1U) != 0;
      EXPECT_TRUE(met || away < 1.7) << quarter << ' ' << k;
      EXPECT_FALSE(met && away < 1.0) << quarter << ' ' << k;
    }
    EXPECT_NEAR(circle.support, 19.0 / 32, 3.0 / 32);
  }
}

// Cut by each side: the support is the share of what is in view, and none where less than half is.
TEST(CircleSearch, CountsTheRimInViewAlone) {
  for (const auto& [x, y] : {std::array{3.0, 28.0}, {56.0, 28.0}, {30.0, 3.0}, {30.0, 52.0}}) {
    const EdgeMap edges = find_edges(disks_on_grey(60, 56, {{x, y, 10, 0, 0}}));
    const Circle circle = fit_circle(edges, {x + 0.3, y - 0.3, 9.8}, Polarity::dark_beads);
    EXPECT_GE(circle.rays, 17) << x << ' ' << y;
    EXPECT_LE(circle.rays, 21) << x << ' ' << y;
    EXPECT_GE(circle.support, 0.95);
    EXPECT_NEAR(circle.x, x, 0.15);
    EXPECT_NEAR(circle.y, y, 0.15);
    const double out_x = x < 10 ? x - 5 : x > 50 ? x + 5 : x, out_y = y < 10 ? y - 5 : y > 46 ? y + 5 : y;
    const EdgeMap outside = find_edges(disks_on_grey(60, 56, {{out_x, out_y, 10, 0, 0}}));
    EXPECT_EQ(fit_circle(outside, {out_x, out_y, 10}, Polarity::dark_beads).support, 0);
  }
}

// A start that lies too far from any circle, or whose circle has another size, has no support.
TEST(CircleSearch, DoesNotGoAstray) {
  const EdgeMap edges = find_edges(disks_on_grey(80, 70, {{38, 33, 12, 0, 0}}));
  EXPECT_EQ(fit_circle(edges, {38, 33, 8}, Polarity::dark_beads).support, 0);
  EXPECT_EQ(fit_circle(edges, {60, 50, 12}, Polarity::dark_beads).support, 0);
  EXPECT_GT(fit_circle(edges, {36.5, 34, 12.6}, Polarity::dark_beads).support, 0.99);
  EXPECT_GT(fit_circle(edges, {36.5, 34, 11}, Polarity::dark_beads).support, 0.99);
}

// Faint edges, where one half of the rim has a third of the contrast and another place: without them the circle is that
// of the clear half.
TEST(CircleSearch, LeavesFaintEdgesOut) {
  const GrayFrame clear = disks_on_grey(70, 66, {{32, 31, 12, 0, 0}}),
                  faint = disks_on_grey(70, 66, {{32, 31, 11, 0, 0}}, 125);
  const GrayFrame frame = frame_by(70, 66, [&](int column, int row) {
    return column < 36 ? clear.at(column, row) : std::min(faint.at(column, row), 140.0F);
  });
  const EdgeMap edges = find_edges(frame);
  RimRays rays;
  rays.tolerance = 0.15;
  const Circle all = fit_circle(edges, {32, 31, 12}, Polarity::dark_beads, rays);
  rays.faint = 0.5;
  const Circle some = fit_circle(edges, {32, 31, 12}, Polarity::dark_beads, rays);
  EXPECT_LT(all.radius, 11.85);
  EXPECT_NEAR(some.radius, 12 - variance_of_edge / 24, 0.06);
  EXPECT_NEAR(some.x, 32, 0.1);
  EXPECT_LT(some.scatter, 0.7 * all.scatter);
  EXPECT_GT(all.scatter, 0.005);
}

TEST(CircleSearch, FindsAllCirclesOfItsRadii) {
  std::vector<RenderedDisk> truth;
  for (int k = 0; k < 6; ++k) truth.push_back({20.3 + 32 * (k % 3), 19.8 + 31 * (k / 3), k < 3 ? 6.0 : 11.0, 0, 0});
  const EdgeMap edges = find_edges(disks_on_grey(105, 75, truth));
  const auto found_of = [&](double from, double to, Polarity polarity) {
    return without_doubles(find_circles(edges, {from, to, polarity, 0.8}), 0.5);
  };
  for (const Polarity polarity : {Polarity::dark_beads, Polarity::automatic}) {
    EXPECT_EQ(found_of(5.5, 12, polarity).size(), 6U);
    EXPECT_EQ(found_of(5.5, 6.6, polarity).size(), 3U);
    EXPECT_EQ(found_of(10, 12, polarity).size(), 3U);
  }
  EXPECT_EQ(found_of(5.5, 12, Polarity::bright_beads).size(), 0U);
  for (const Circle& circle : found_of(5.5, 12, Polarity::dark_beads)) {
    const bool is_one = std::any_of(truth.begin(), truth.end(), [&](const RenderedDisk& disk) {
      return std::hypot(disk.x_px - circle.x, disk.y_px - circle.y) < 0.1 &&
             std::abs(disk.radius_px - circle.radius) < 0.3;
    });
    EXPECT_TRUE(is_one) << circle.x << ' ' << circle.y << ' ' << circle.radius;
  }
  CirclesAsked asked{5.5, 12, Polarity::dark_beads, 0.8};
  asked.leave_out = [](const Circle& place) { return place.y > 35; };
  EXPECT_EQ(without_doubles(find_circles(edges, asked), 0.5).size(), 3U);
  asked.leave_out = {};
  asked.votes.least = 2;  // more votes than a rim has pixels
  EXPECT_EQ(find_circles(edges, asked).size(), 0U);
  EXPECT_EQ(find_circles(find_edges(even_frame(40, 40, 3)), {6, 9, Polarity::automatic, 0.2}).size(), 0U);
}

// The better of two by support less scatter, for all pairs by hand.
TEST(CircleSearch, KeepsTheBetterOfTwoCirclesInOnePlace) {
  std::vector<Circle> circles;
  for (int k = 0; k < 60; ++k) {
    Circle circle;
    circle.x = 100 * test::scattered(k, 3), circle.y = 70 * test::scattered(k, 17);
    circle.radius = 3 + 5 * test::scattered(k, 29);
    circle.support = test::scattered(k, 41), circle.scatter = 0.3 * test::scattered(k, 53);
    circles.push_back(circle);
  }
  for (const double share : {0.3, 0.8}) {
    std::vector<Circle> ranked = circles, kept;
    std::sort(ranked.begin(), ranked.end(),
              [](const Circle& a, const Circle& b) { return a.support - a.scatter > b.support - b.scatter; });
    for (const Circle& one : ranked)
      if (std::none_of(kept.begin(), kept.end(), [&](const Circle& other) {
            return std::hypot(one.x - other.x, one.y - other.y) < share * (one.radius + other.radius);
          }))
        kept.push_back(one);
    const auto found = without_doubles(circles, share);
    ASSERT_EQ(found.size(), kept.size());
    EXPECT_LT(found.size(), 58U);
    for (std::size_t k = 0; k < kept.size(); ++k) EXPECT_EQ(found[k].x, kept[k].x);
  }
  EXPECT_EQ(without_doubles({}, 0.5).size(), 0U);
}

// --- rim_probability.hpp ---------------------------------------------------------------------------------------------

std::vector<Circle> with_support(const std::vector<std::pair<double, int>>& counts) {
  std::vector<Circle> circles;
  for (const auto& [support, count] : counts)
    for (int k = 0; k < count; ++k) {
      Circle circle;
      circle.support = support;
      circles.push_back(circle);
    }
  return circles;
}

// 40 circles of full support and 10 of 0.8, of which the copies have (2 + 0 + 2 + 0)/4 = 1 and 2: 1 - (1 + 0.05)/40 and
// 1 - (2 + 0.05 + 0.4 * 0.2)/10; nothing below. What has no circle
// is joined to the class next to it.
TEST(RimProbability, IsTheShareThatChanceDoesNotMakeUp) {
  const std::vector<Circle> seen = with_support({{1.0, 40}, {0.8, 10}}), poor = with_support({{1.0, 2}, {0.8, 4}}),
                            none = with_support({});
  const auto table = probabilities_by_support(seen, {poor, none, poor, none}, Known::nothing);
  ASSERT_EQ(table.size(), 21U);
  EXPECT_NEAR(table[20], 1 - 1.05 / 40, 1e-12);
  for (std::size_t k = 0; k <= 19; ++k) EXPECT_NEAR(table[k], 1 - 2.13 / 10, 1e-12) << k;
  EXPECT_NEAR(probability_at(table, 0.975), 0.5 * (1 - 1.05 / 40 + 1 - 2.13 / 10), 1e-12);
  EXPECT_NEAR(probability_at(table, 1.2), 1 - 1.05 / 40, 1e-12);
  EXPECT_NEAR(probability_at(table, -0.2), 1 - 2.13 / 10, 1e-12);
  EXPECT_EQ(probability_at({}, 0.5), 0);
  // Worse above than below: both are one class, 1 - (15 + 0.05 + 0.4 * missing)/50, missing 0.2 * 10/50.
  const auto joined = probabilities_by_support(seen, {with_support({{1.0, 15}})}, Known::nothing);
  for (const double p : joined) EXPECT_NEAR(p, 1 - (15.05 + 0.4 * 0.04) / 50, 1e-12);
  EXPECT_EQ(probabilities_by_support({}, {poor}, Known::nothing).back(), 0);
}

// Circles of chance of support 0.3, of which the picture has none: they count against the better ones where nothing is
// known, not where the radius is (beyond 0.2) or where beads are.
TEST(RimProbability, OfPoorCirclesDependsOnWhatIsKnown) {
  const std::vector<Circle> seen = with_support({{0.9, 20}});
  const auto of = [&](Known known, double support) {
    return probabilities_by_support(seen, {with_support({{support, 6}})}, known);
  };
  EXPECT_NEAR(of(Known::nothing, 0.3).back(), 1 - (6 + 0.05 + 0.04) / 20, 1e-12);
  EXPECT_NEAR(of(Known::radius, 0.3).back(), 1 - (0.05 + 0.04) / 20, 1e-12);
  EXPECT_NEAR(of(Known::radius, 0.8).back(), 1 - (6 + 0.05 + 0.04) / 20, 1e-12);
  EXPECT_NEAR(of(Known::beads, 0.3).back(), 1 - (0.05 + 0.04) / 20, 1e-12);
  EXPECT_EQ(of(Known::beads, 0.3)[6], 0);
  EXPECT_NEAR(of(Known::beads, 0.9).back(), 1 - (6 + 0.05 + 0.04) / 20, 1e-12);
}

// --- outline.hpp -----------------------------------------------------------------------------------------------------

// Outlines r = R (1 + a cos q theta) of harmonic q: each has its amplitude in its place, less the 4 % by which
// harmonics are held at 0, and up to a sixth for the blur of the edges.
TEST(Outlines, HaveTheHarmonicsOfTheirShape) {
  for (int q = 2; q <= 6; ++q) {
    std::vector<Circle> circles;
    const auto level = [&](double column, double row) {
      double sum = 0;
      for (int k = 0; k < 4; ++k) {
        const double dx = column - (30 + 60 * (k % 2)), dy = row - (30 + 60 * (k / 2)), r = std::hypot(dx, dy);
        // Turned from one to the next, so that nothing is common to all.
        const double turn = k * std::numbers::pi / (2 * q);
        sum += 0.5 * std::erfc((r - 15 * (1 + 0.06 * std::cos(q * (std::atan2(dy, dx) - turn)))) / 1.2);
      }
      return 200 - 150 * sum;
    };
    for (int k = 0; k < 4; ++k) circles.push_back({30.0 + 60 * (k % 2), 30.0 + 60 * (k / 2), 15});
    const Roundness found = roundness_of(find_edges(frame_by(120, 120, level)), circles, Polarity::dark_beads);
    EXPECT_EQ(found.outlines, 4U);
    for (int p = 2; p <= 6; ++p)
      EXPECT_NEAR(found.harmonic[static_cast<std::size_t>(p)], p == q ? 0.0577 : 0, p == q ? 0.009 : 0.006)
          << q << ' ' << p;
    EXPECT_NEAR(found.deviation, 0.06 / std::sqrt(2.0), 0.012) << q;
    EXPECT_NEAR(found.on_circle, 1, 0.03);
    EXPECT_EQ(found.gap, 0);
    EXPECT_FALSE(found.round());
    EXPECT_NE(found.why_not().find(q == 2 ? "oval" : std::to_string(q) + " corners"), std::string::npos)
        << found.why_not();
  }
}

// Ovals that lie alike are the picture's aspect: that is common, and not a deviation of the outline.
TEST(Outlines, ThatAreAllOvalAlikeHaveACommonElongation) {
  std::vector<Circle> circles;
  const auto frame = [&](double aspect) {
    return frame_by(140, 120, [&](int column, int row) {
      double sum = 0;
      for (int k = 0; k < 4; ++k) {
        const double dx = (column - (32 + 66 * (k % 2))) / aspect, dy = (row - (30 + 60 * (k / 2))) * aspect;
        sum += 0.5 * std::erfc((std::hypot(dx, dy) - 15) / 1.2);
      }
      return 200 - 150 * sum;
    });
  };
  for (int k = 0; k < 4; ++k) circles.push_back({32.0 + 66 * (k % 2), 30.0 + 60 * (k / 2), 15});
  const Roundness slight = roundness_of(find_edges(frame(1.03)), circles, Polarity::dark_beads);
  EXPECT_NEAR(slight.common_elongation, 0.03, 0.006);
  EXPECT_NEAR(slight.harmonic[2], 0.03, 0.006);
  EXPECT_LT(slight.deviation, 0.01);
  EXPECT_TRUE(slight.round()) << slight.why_not();
  const Roundness clear = roundness_of(find_edges(frame(1.06)), circles, Polarity::dark_beads);
  EXPECT_NEAR(clear.common_elongation, 0.06, 0.008);
  EXPECT_NE(clear.why_not().find("the ratio of their axes is 1.1"), std::string::npos) << clear.why_not();
}

// A quarter of the circumference without an edge, and the same hidden by a neighbour; the width of the rim.
TEST(Outlines, AreOpenUnlessANeighbourHidesThem) {
  const auto frame_with = [](bool neighbour, double blur) {
    return frame_by(130, 90, [&](int column, int row) {
      const double dx = column - 45, dy = row - 45, r = std::hypot(dx, dy), other = std::hypot(dx - 33, dy);
      double level = 0.5 * std::erfc((r - 16) / (std::sqrt(2.0) * blur));
      if (dx > 0 && std::abs(dy) < 0.5 * dx && r > 10) level = r < 25 ? 1 : std::max(0.0, 1 - (r - 25) / 20);
      if (neighbour) level = std::max(level, 0.5 * std::erfc((other - 16) / (std::sqrt(2.0) * blur)));
      return 200 - 150 * level;
    });
  };
  const Circle circle{45, 45, 16}, beside{78, 45, 16};
  const Roundness open = roundness_of(find_edges(frame_with(false, 1)), {circle}, Polarity::dark_beads);
  EXPECT_NEAR(open.gap, 0.15, 0.05);
  const Roundness hidden = roundness_of(find_edges(frame_with(false, 1)), {circle, beside}, Polarity::dark_beads);
  EXPECT_EQ(hidden.outlines, 2U);
  Camera camera;
  camera.width = camera.height = 100;
  for (const double blur : {0.6, 2.0, 3.0}) {
    camera.blur_px = blur;
    const Roundness round =
        roundness_of(find_edges(render_frame({{50, 49, 18, 0, 0}}, camera)), {{50, 49, 18}}, Polarity::dark_beads);
    EXPECT_EQ(round.gap, 0);
    EXPECT_EQ(round.not_round, 0);
    EXPECT_EQ(round.on_circle, 1);
    // Full width at half maximum of the blur alone, in radii.
    EXPECT_NEAR(round.rim_width, 2.355 * blur / 18, 0.05) << blur;
    EXPECT_TRUE(round.round());
  }
  // Cut by the border: not followed.
  EXPECT_EQ(roundness_of(find_edges(render_frame({{14, 49, 18, 0, 0}}, camera)), {{14, 49, 18}}, Polarity::dark_beads)
                .outlines,
            0U);
}

// Each limit by itself, at its border.
TEST(Outlines, AreRefusedBeyondEachLimit) {
  const auto refused = [](const auto& change) {
    Roundness one;
    one.outlines = 3;
    change(one);
    EXPECT_EQ(one.round(), one.why_not().empty());
    return one.why_not();
  };
  const auto has = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(refused([](Roundness&) {}), "");
  EXPECT_EQ(refused([](Roundness& one) { one.on_circle = 0.97; }), "");
  EXPECT_TRUE(has(refused([](Roundness& one) { one.on_circle = 0.969; }), "only 96.9 %"));
  EXPECT_EQ(refused([](Roundness& one) { one.gap = 0.2; }), "");
  EXPECT_TRUE(has(refused([](Roundness& one) { one.gap = 0.21; }), "21 % of the circumference"));
  EXPECT_EQ(refused([](Roundness& one) { one.common_elongation = 0.04, one.harmonic[2] = 0.075; }), "");
  EXPECT_TRUE(
      has(refused([](Roundness& one) { one.common_elongation = one.harmonic[2] = 0.05; }), "is 1.11 (allowed: 1.08)"));
  EXPECT_TRUE(has(refused([](Roundness& one) { one.common_elongation = 0.03, one.harmonic[2] = 0.066; }),
                  "is 1.14 (allowed: 1.14)"));
  for (std::size_t q = 3; q <= 6; ++q) {
    EXPECT_EQ(refused([&](Roundness& one) { one.harmonic[q] = 0.02; }), "");
    EXPECT_TRUE(has(refused([&](Roundness& one) { one.harmonic[q] = 0.021; }),
                    std::to_string(q) + " corners or bulges, 2.1 % of the radius high (allowed: 2 %)"));
  }
  EXPECT_EQ(refused([](Roundness& one) { one.deviation = 0.03; }), "");
  EXPECT_TRUE(has(refused([](Roundness& one) { one.deviation = 0.031; }), "by 3.1 % of the radius (allowed: 3 %)"));
  EXPECT_EQ(refused([](Roundness& one) { one.not_round = 0.4; }), "");
  EXPECT_TRUE(has(refused([](Roundness& one) { one.not_round = 0.41; }), "41 % of the outlines are not round"));
  EXPECT_EQ(refused([](Roundness& one) { one.outlines = 0, one.gap = 1; }), "");
}

}  // namespace
}  // namespace shakebed::ingest
