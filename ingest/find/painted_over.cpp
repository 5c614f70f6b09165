#include "ingest/find/painted_over.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/disk_pixels.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// What is behind the beads: the level of this rank among the pixels that no bead found covers, the darkest being 0, in
// cells so wide [radii]. Beads of the other shade, which are brighter or darker, may be most of these pixels.
constexpr double rank_behind_bright = 0.15, rank_behind_dark = 0.85, cell_radii = 4;
constexpr std::size_t fewest_in_cell = 40, most_in_cell = 600;

}  // namespace

LevelsBehind::LevelsBehind(const GrayFrame& frame, const std::vector<std::uint8_t>& hidden, double cell_px, double rank)
    : cell_(std::max(4, static_cast<int>(cell_px))),
      columns_((frame.width + cell_ - 1) / cell_),
      rows_((frame.height + cell_ - 1) / cell_) {
  std::vector<std::optional<float>> known;
  for (int row = 0; row < rows_; ++row)
    for (int column = 0; column < columns_; ++column) known.push_back(level_in(frame, hidden, column, row, rank));
  if (std::any_of(known.begin(), known.end(), [](const auto& one) { return one.has_value(); })) fill(std::move(known));
}

float LevelsBehind::at(int x, int y) const {
  const double u = std::clamp((x + 0.5) / cell_ - 0.5, 0.0, columns_ - 1.0);
  const double v = std::clamp((y + 0.5) / cell_ - 0.5, 0.0, rows_ - 1.0);
  const int left = static_cast<int>(u), top = static_cast<int>(v);
  const int right = std::min(left + 1, columns_ - 1), below = std::min(top + 1, rows_ - 1);
  const auto across = static_cast<float>(u - left), down = static_cast<float>(v - top);
  return (1 - down) * ((1 - across) * level(left, top) + across * level(right, top)) +
         down * ((1 - across) * level(left, below) + across * level(right, below));
}

std::optional<float> LevelsBehind::level_in(const GrayFrame& frame, const std::vector<std::uint8_t>& hidden, int column,
                                            int row, double rank) const {
  const int step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(cell_) * cell_ / most_in_cell)));
  std::vector<float> levels;
  const int bottom = std::min(frame.height, (row + 1) * cell_), right = std::min(frame.width, (column + 1) * cell_);
  for (int y = row * cell_; y < bottom; y += step)
    for (int x = column * cell_; x < right; x += step) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(x);
      if (hidden[at] == 0 && !unseen(frame.pixels[at])) levels.push_back(frame.pixels[at]);
    }
  if (levels.size() < fewest_in_cell) return std::nullopt;
  return quantile_of(std::move(levels), rank);
}

// From the known cells outwards.
void LevelsBehind::fill(std::vector<std::optional<float>> known) {
  for (bool all = false; !all;) {
    all = true;
    const auto before = known;
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        if (before[index(column, row)]) continue;
        float sum = 0, count = 0;
        for (int y = std::max(0, row - 1); y <= std::min(rows_ - 1, row + 1); ++y)
          for (int x = std::max(0, column - 1); x <= std::min(columns_ - 1, column + 1); ++x)
            if (const auto& one = before[index(x, y)]) sum += *one, ++count;
        if (count > 0)
          known[index(column, row)] = sum / count;
        else
          all = false;
      }
  }
  for (const auto& one : known) levels_.push_back(*one);
}

std::vector<std::uint8_t> covered_by(const GrayFrame& frame, const std::vector<FoundDisk>& disks, double margin) {
  std::vector<std::uint8_t> hidden(frame.pixels.size(), 0);
  for (const FoundDisk& disk : disks)
    for_pixels_within(frame, disk.x_px, disk.y_px, disk.radius_px + margin,
                      [&](std::size_t pixel, double, double) { hidden[pixel] = 1; });
  return hidden;
}

std::optional<GrayFrame> painted_over(const GrayFrame& frame, const std::vector<FoundDisk>& disks, double margin,
                                      Polarity left) {
  double radius = 1;
  for (const FoundDisk& disk : disks) radius = std::max(radius, disk.radius_px);
  const std::vector<std::uint8_t> hidden = covered_by(frame, disks, margin);
  const LevelsBehind behind(frame, hidden, cell_radii * radius,
                            left == Polarity::bright_beads ? rank_behind_bright : rank_behind_dark);
  if (!behind.known()) return std::nullopt;
  GrayFrame painted = frame;
  const auto noise = static_cast<float>(noise_of(frame));
  std::minstd_rand random(1);
  const auto part = [&] { return static_cast<float>(random()) / static_cast<float>(std::minstd_rand::max()); };
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const auto at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) + static_cast<std::size_t>(column);
      if (hidden[at] == 0 || unseen(frame.pixels[at])) continue;
      const float normal = 1.7320508F * ((part() + part() + part() + part()) - 2.0F);  // of variance 1
      painted.pixels[at] = behind.at(column, row) + noise * normal;
    }
  return painted;
}

}  // namespace shakebed::ingest
