#include "ingest/find/picture_maps.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

#include "ingest/find/circle_search.hpp"
#include "ingest/frames/picture_threads.hpp"

namespace shakebed::ingest {

namespace {

// Twice each direction, so that what lies at the bottom of a picture is stretched in all of them.
constexpr std::size_t bands_of_copy = 2 * stretching_directions;
// px: the largest radius on a map, 16 px times the largest of a group of sizes over its mean, and where its rim is
// looked for.
constexpr int band_margin = 32;

StretchedBand band_of(const PictureMap& map, double angle, int from, int to) {
  const int height = map.at.picture.height;
  StretchedBand band;
  band.angle = angle;
  band.first_row = std::max(0, from - band_margin);
  band.from = from - band.first_row, band.to = to - band.first_row;
  band.edges = edges_of_stretched(map.at.picture, decoy_stretch, angle, map.edges.threshold, band.first_row,
                                  std::min(height, to + band_margin) - band.first_row);
  return band;
}

std::vector<StretchedCopy> copies_of(const PictureMap& map) {
  const int height = map.at.picture.height;
  const bool large = map.at.picture.pixels.size() > copied_in_bands_px;
  std::vector<StretchedCopy> copies(large ? 1 : stretching_directions);
  const std::size_t bands = large ? bands_of_copy : 1;
  const auto row = [&](std::size_t band) { return static_cast<int>(static_cast<std::size_t>(height) * band / bands); };
  for (StretchedCopy& copy : copies) copy.resize(bands);
  for_each_piece(copies.size() * bands, [&](std::size_t piece) {
    const std::size_t copy = piece / bands, band = piece % bands;
    copies[copy][band] = band_of(map, copy_angle((copy + band) % stretching_directions), row(band), row(band + 1));
  });
  return copies;
}

}  // namespace

double copy_angle(std::size_t copy) {
  return static_cast<double>(copy) * std::numbers::pi / static_cast<double>(stretching_directions);
}

std::vector<const StretchedBand*> bands_of(const std::vector<StretchedCopy>& copies) {
  std::vector<const StretchedBand*> bands;
  for (const StretchedCopy& copy : copies)
    for (const StretchedBand& band : copy) bands.push_back(&band);
  return bands;
}

EdgeMap edges_of(const ScaledPicture& at, float threshold) {
  return find_edges(at.picture, threshold, at.scale < 1 ? Pixels::doubled : Pixels::own);
}

EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold, int first_row,
                           int rows) {
  StretchedLines lines(picture, ratio, angle);
  return find_edges(
      picture.width, rows, [&](int row) { return lines.line(first_row + row); }, threshold);
}
EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold) {
  return edges_of_stretched(picture, ratio, angle, threshold, 0, picture.height);
}

PictureMaps::One& PictureMaps::made_for(double radius_px, float threshold) {
  const double scale = scale_for(radius_px, wanted_px_);
  for (One& one : made_)
    if (one.scale == scale && (threshold > 0 ? one.map.edges.threshold == threshold : one.own_threshold)) return one;
  ScaledPicture at = ingest::scaled_for(frame_, radius_px, wanted_px_);
  EdgeMap edges = edges_of(at, threshold);
  made_.push_back({scale, !(threshold > 0), {std::move(at), std::move(edges), {}}});
  return made_.back();
}

const PictureMap& PictureMaps::scaled_for(double radius_px, float threshold) {
  return made_for(radius_px, threshold).map;
}

const PictureMap& PictureMaps::with_copies(double radius_px, float threshold) {
  PictureMap& map = made_for(radius_px, threshold).map;
  if (map.copies.empty()) map.copies = copies_of(map);
  return map;
}

}  // namespace shakebed::ingest
