#include "ingest/find/picture_maps.hpp"

#include <numbers>
#include <utility>

#include "ingest/find/circle_search.hpp"

namespace shakebed::ingest {

double copy_angle(std::size_t copy) {
  return static_cast<double>(copy) * std::numbers::pi / static_cast<double>(stretched_copies);
}

EdgeMap edges_of(const ScaledPicture& at, float threshold) {
  return find_edges(at.picture, threshold, at.scale < 1 ? Pixels::doubled : Pixels::own);
}

EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold) {
  StretchedLines lines(picture, ratio, angle);
  return find_edges(
      picture.width, picture.height, [&](int row) { return lines.line(row); }, threshold);
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
  for (std::size_t k = map.copies.size(); k < stretched_copies; ++k)
    map.copies.push_back(edges_of_stretched(map.at.picture, decoy_stretch, copy_angle(k), map.edges.threshold));
  return map;
}

}  // namespace shakebed::ingest
