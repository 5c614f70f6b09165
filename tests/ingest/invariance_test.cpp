// What the finder must not see: which way a frame is turned, how bright and how strong in contrast it is, and at which
// of the four borders a bead is cut.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest {
namespace {

constexpr int frame_width = 150, frame_height = 120;
constexpr double bead_radius = 9;

Camera camera() {
  Camera camera;
  camera.width = frame_width, camera.height = frame_height;
  camera.blur_px = 0.8, camera.read_noise = 3;
  return camera;
}

// Beads cut at each border by a third of their bead_radius, whole ones that just touch each border, and some inside.
std::vector<RenderedDisk> beads() {
  const double cut = 2 * bead_radius / 3 - 0.5, whole = bead_radius - 0.5 + 0.6;
  std::vector<RenderedDisk> all;
  for (const auto& [x, y] : {std::pair{cut, 40.0},
                             {frame_width - 1 - cut, 44.0},
                             {40.0, cut},
                             {46.0, frame_height - 1 - cut},
                             {whole, 75.0},
                             {frame_width - 1 - whole, 79.0},
                             {85.0, whole},
                             {91.0, frame_height - 1 - whole},
                             {60.3, 60.7},
                             {80.2, 55.1},
                             {110.4, 70.6},
                             {30.9, 95.2}})
    all.push_back({x, y, bead_radius, 0, 0});
  return all;
}

const FoundDisk* nearest(const FindResult& found, double x, double y) {
  const FoundDisk* best = nullptr;
  double distance = 2;  // px
  for (const FoundDisk& disk : found.disks) {
    if (std::hypot(disk.x_px - x, disk.y_px - y) < distance)
      distance = std::hypot(disk.x_px - x, disk.y_px - y), best = &disk;
  }
  return best;
}

TEST(FourBorders, CutTheirBeadsAndNoOthers) {
  const FindResult found = find_disks(render_frame(beads(), camera()));
  const std::vector<RenderedDisk> truth = beads();
  ASSERT_EQ(found.disks.size(), truth.size());
  const char* border[] = {"left", "right", "top", "bottom"};
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const FoundDisk* disk = nearest(found, truth[k].x_px, truth[k].y_px);
    ASSERT_NE(disk, nullptr) << k;
    EXPECT_EQ(disk->cut, k < 4) << (k < 8 ? border[k % 4] : "inside") << " " << truth[k].x_px << " " << truth[k].y_px;
  }
}

// A region of interest cuts as a border does.
TEST(FourBorders, OfARegionCutToo) {
  FindOptions options;
  options.roi = PixelRectangle{20, 15, 80, 70};  // to column 99 and row 84
  const double cut = 2 * bead_radius / 3 - 0.5, whole = bead_radius - 0.5 + 0.6;
  std::vector<RenderedDisk> all;
  for (const auto& [x, y] : {std::pair{20 + cut, 50.0},
                             {99 - cut, 45.0},
                             {60.0, 15 + cut},
                             {50.0, 84 - cut},
                             {20 + whole, 72.0},
                             {99 - whole, 66.0},
                             {82.0, 15 + whole},
                             {72.0, 84 - whole},
                             {60.0, 48.0}})
    all.push_back({x, y, bead_radius, 0, 0});
  const FindResult found = find_disks(render_frame(all, camera()), options);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const FoundDisk* disk = nearest(found, all[k].x_px, all[k].y_px);
    ASSERT_NE(disk, nullptr) << k;
    EXPECT_EQ(disk->cut, k < 4) << k;
  }
}

// Beads that are found by their rims alone are cut by the same borders, and by those of a region.
TEST(FourBorders, CutWhatIsFoundByRimsToo) {
  const GrayFrame frame = render_frame(beads(), camera());
  const CalibrationResult learned = learn_by_rims(frame, {Polarity::dark_beads, bead_radius});
  ASSERT_TRUE(learned.found && learned.calibration.by_rims) << learned.why_not;
  const FindResult found = find_beads(frame, learned.calibration, {});
  const std::vector<RenderedDisk> truth = beads();
  std::size_t seen[2] = {0, 0};
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const FoundDisk* disk = nearest(found, truth[k].x_px, truth[k].y_px);
    if (disk == nullptr) continue;
    EXPECT_EQ(disk->cut, k < 4) << k;
    ++seen[k < 4 ? 0 : 1];
  }
  EXPECT_EQ(seen[0], 4U) << "of the four that are cut";
  EXPECT_EQ(seen[1], 8U) << "of the whole ones";
  // A region whose borders go through the middle of what was whole: left, right, top and bottom each cut their bead.
  FindOptions options;
  const double inside = bead_radius - 3;
  for (const auto& [bead, roi] : {std::pair{8U, PixelRectangle{static_cast<int>(60.3 - inside), 0, 60, frame_height}},
                                  {10U, PixelRectangle{60, 0, static_cast<int>(110.4 + inside) - 60, frame_height}},
                                  {9U, PixelRectangle{0, static_cast<int>(55.1 - inside), frame_width, 60}},
                                  {11U, PixelRectangle{0, 50, frame_width, static_cast<int>(95.2 + inside) - 50}}}) {
    options.roi = roi;
    const FindResult of_region = find_beads(frame, learned.calibration, options);
    const FoundDisk* disk = nearest(of_region, truth[bead].x_px, truth[bead].y_px);
    ASSERT_NE(disk, nullptr) << bead;
    EXPECT_TRUE(disk->cut) << bead;
  }
}

// The same beads, each where the change of the frame puts it.
void expect_the_same(const FindResult& found, const FindResult& plain,
                     const std::function<std::pair<double, double>(double, double)>& place, double within,
                     const char* what) {
  ASSERT_EQ(found.disks.size(), plain.disks.size()) << what;
  for (const FoundDisk& disk : plain.disks) {
    const auto [x, y] = place(disk.x_px, disk.y_px);
    const FoundDisk* same = nearest(found, x, y);
    ASSERT_NE(same, nullptr) << what << " " << x << " " << y;
    EXPECT_LT(std::hypot(same->x_px - x, same->y_px - y), within) << what;
    EXPECT_NEAR(same->radius_px, disk.radius_px, within) << what;
    EXPECT_NEAR(same->quality, disk.quality, 0.1) << what;
    EXPECT_EQ(same->cut, disk.cut) << what;
    EXPECT_NEAR(std::sqrt(same->variance_x + same->variance_y) / std::sqrt(disk.variance_x + disk.variance_y), 1, 0.1)
        << what;
  }
}

GrayFrame changed(const GrayFrame& frame, bool transpose, bool flip_x, bool flip_y) {
  GrayFrame out = frame;
  if (transpose) std::swap(out.width, out.height);
  for (int y = 0; y < out.height; ++y) {
    for (int x = 0; x < out.width; ++x) {
      const int from_x = transpose ? y : x, from_y = transpose ? x : y;
      const int column = flip_x ? frame.width - 1 - from_x : from_x, row = flip_y ? frame.height - 1 - from_y : from_y;
      out.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x)] =
          frame.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                       static_cast<std::size_t>(column)];
    }
  }
  return out;
}

TEST(Finder, DoesNotSeeWhichWayAFrameIsTurned) {
  const GrayFrame frame = render_frame(beads(), camera());
  const FindResult plain = find_disks(frame);
  expect_the_same(
      find_disks(changed(frame, false, true, false)), plain,
      [](double x, double y) {
        return std::pair{frame_width - 1 - x, y};
      },
      0.02, "left and right exchanged");
  expect_the_same(
      find_disks(changed(frame, false, false, true)), plain,
      [](double x, double y) {
        return std::pair{x, frame_height - 1 - y};
      },
      0.02, "upside down");
  expect_the_same(
      find_disks(changed(frame, true, false, false)), plain,
      [](double x, double y) {
        return std::pair{y, x};
      },
      0.02, "rows and columns exchanged");
}

TEST(Finder, DoesNotSeeBrightnessAndContrast) {
  const GrayFrame frame = render_frame(beads(), camera());
  const FindResult plain = find_disks(frame);
  const auto same = [](double x, double y) { return std::pair{x, y}; };
  for (const auto& [gain, offset, what] :
       {std::tuple{0.5F, 0.0F, "half as bright"}, {1.0F, 40.0F, "brighter"}, {0.4F, 90.0F, "flat"}}) {
    GrayFrame other = frame;
    for (float& level : other.pixels) level = gain * level + offset;
    expect_the_same(find_disks(other), plain, same, 0.02, what);
  }
  GrayFrame negative = frame;
  for (float& level : negative.pixels) level = 255 - level;
  expect_the_same(find_disks(negative), plain, same, 0.02, "negative");
}

}  // namespace
}  // namespace shakebed::ingest
