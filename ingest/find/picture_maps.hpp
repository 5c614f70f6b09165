#pragma once
// Maps of a picture's edges, each scaled for the beads that are searched in it; each is made once, whoever asks for it.

#include <cstddef>
#include <list>
#include <vector>

#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_scale.hpp"

namespace shakebed::ingest {

// Rows of a stretched copy of a picture.
struct StretchedBand {
  double angle = 0;      // in which the copy is stretched
  int first_row = 0;     // of the copy
  int from = 0, to = 0;  // rows of the band in which the centres of its circles are, without its margins
  EdgeMap edges;         // of the band with its margins
  [[nodiscard]] bool holds(double row) const { return row >= from - 0.5 && row < to - 0.5; }
};
// All rows, in one band or in several that are stretched in different directions.
using StretchedCopy = std::vector<StretchedBand>;

struct PictureMap {
  ScaledPicture at;
  EdgeMap edges;
  std::vector<StretchedCopy> copies;  // once asked for
};

// Directions in which the copies are stretched: four, so that what is oval in one of them is round in another.
inline constexpr std::size_t stretching_directions = 4;
double copy_angle(std::size_t copy);

// Of all bands of all copies.
std::vector<const StretchedBand*> bands_of(const std::vector<StretchedCopy>& copies);

// Of a map of so many pixels there are four copies, one in each direction. Of a larger one, which shows many more
// circles, there is one: bands in all four directions by turns.
inline constexpr std::size_t copied_in_bands_px = 2'000'000;

// At any scale; `threshold` as in find_edges().
EdgeMap edges_of(const ScaledPicture& at, float threshold = 0);

// Of a copy, or of some of its rows.
EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold);
EdgeMap edges_of_stretched(const GrayFrame& picture, double ratio, double angle, float threshold, int first_row,
                           int rows);

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
