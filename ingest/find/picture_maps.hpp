#pragma once
// Maps of a picture's edges, each scaled for the beads that are searched in it; each is made once, whoever asks for it.

#include <cstddef>
#include <list>
#include <vector>

#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"

namespace shakebed::ingest {

struct PictureMap {
  ScaledPicture at;
  EdgeMap edges;
  std::vector<EdgeMap> copies;  // stretched, once asked for; see copy_angle()
};

// Directions in which the copies are stretched: four, so that what is oval in one of them is round in another.
inline constexpr std::size_t stretched_copies = 4;
double copy_angle(std::size_t copy);

// At any scale; `threshold` as in find_edges().
EdgeMap edges_of(const ScaledPicture& at, float threshold = 0);

// Of a copy.
EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold);

// The frame must outlive it; not for several threads at once.
class PictureMaps {
 public:
  // `wanted_px` as in scale_for().
  PictureMaps(const GrayFrame& frame, double wanted_px) : frame_(frame), wanted_px_(wanted_px) {}
  // `threshold` as in find_edges(). Asked for by the threshold that it found, a map is the same one.
  const PictureMap& scaled_for(double radius_px, float threshold = 0);
  // The same, with its copies.
  const PictureMap& with_copies(double radius_px, float threshold = 0);

 private:
  struct One {
    double scale;
    bool own_threshold;  // found in the map itself
    PictureMap map;
  };
  One& made_for(double radius_px, float threshold);

  const GrayFrame& frame_;
  double wanted_px_;
  std::list<One> made_;
};

}  // namespace shakebed::ingest
