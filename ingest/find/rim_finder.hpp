#pragma once
// Beads by their rims alone, whatever their faces look like: fringes, highlights, two colours, shade.
//
// The frame is reduced until a bead is 8 to 16 px in radius. Circles of the beads' radius are searched in its edges.
// Each circle gets a probability that it is a bead, from the visible share of its rim. The same search on copies of the
// frame stretched along one axis, where no bead is round, counts the chance circles of each share (target and decoy
// [EliasGygi]).

#include <optional>
#include <vector>

#include "ingest/find/circle_search.hpp"
#include "ingest/find/outline.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/find/rim_probability.hpp"

namespace shakebed::ingest {

// What a second look beside the beads already found may add (rim_gaps.hpp): probabilities by support, as below, of
// circles that overlap none of them.
// Circles of `from_px` to `to_px` but for those of the sizes known before.
struct SizeBand {
  double from_px = 0, to_px = 0;
  double radius_px = 0;  // that its beads share; 0: each has its own
  std::vector<double> probability;
};
struct GapModel {
  std::vector<double> same_size;
  std::vector<SizeBand> other_sizes;  // empty: all beads are of one size
  // Of the picture learned from: those of sizes that were left out, since most of their rims are plainly not round
  // (rim_shape.hpp).
  std::vector<Circle> not_round;
};

// At which scale rims are searched, and how.
struct RimSearch {
  double wanted_px = quick_radius_px;  // a bead's radius on the map is this to twice this
  CircleVotes votes{};
  double least_votes_in_gaps = votes.least;  // beside beads that are found
};
inline constexpr RimSearch quick_search{};
// Chosen on a photograph with more than 1,200 photoelastic disks of 33 px radius, by circles of which 60 % or more is
// seen. At 8 px and 0.3 of the votes these are 398, of which chance makes up 54. At 16 px they are 677, with 0.2 by
// chance; with a least share of 0.2, 1,006 and 28 by chance. Beside beads that are found chance makes up fewer.
inline constexpr RimSearch thorough_search{16, {1.05, 0.2}, 0.15};

struct RimModel {
  // `automatic`: the edge may be a step up or down, another in each direction, as with disks that are partly brighter
  // and partly darker than what is behind them.
  Polarity polarity = Polarity::automatic;
  RimSearch search;
  double radius_px = 0;
  double radius_std_error_px = 0;
  // The radius towards sides without a near neighbour, if enough such sides are seen; else radius_px. Where beads
  // touch, blur moves the rims inwards (by 2 to 8 % at radii of 7 to 13 px).
  double open_radius_px = 0;
  double radius_spread = 0;         // standard deviation of single radii over their mean
  double contrast = 0;              // median step across a rim, grey levels
  float threshold = 0;              // weakest edge, grey levels per px of the reduced frame
  std::vector<double> probability;  // of a circle with support 0, 1/20, 2/20 .. 1
  std::optional<GapModel> gaps;     // once learn_gaps() has looked
  [[nodiscard]] double probability_of(double support) const;
  [[nodiscard]] bool thorough() const { return search.wanted_px == thorough_search.wanted_px; }
};

struct RimDisk {
  Circle circle;            // px of the frame
  double probability = 0;   // that it is a bead
  double variance_px2 = 0;  // of the centre along each axis
  bool other_size = false;  // its radius is not that of the others
};

// Their circles alone.
std::vector<Circle> circles_of(const std::vector<RimDisk>& disks);

struct LearnedRims {
  RimModel model;
  std::vector<RimDisk> disks;  // of the frame learned from
  double edge_length_px = 0;   // of all edges, faint ones in part, px of the frame
};

// Learns from one frame, starting from a radius good to a tenth. Where beads are known to be there, poor circles of
// chance, as the copies of beads of another size make, say nothing against circles that are seen well.
LearnedRims learn_rims(const GrayFrame& frame, Polarity polarity, double radius_px, Known known = Known::nothing,
                       const RimSearch& search = quick_search);
// The same with maps that were made before, or will be used again; they must be those of the search.
LearnedRims learn_rims(PictureMaps& maps, Polarity polarity, double radius_px, Known known = Known::nothing,
                       const RimSearch& search = quick_search);

// The circles from which learn_rims() starts, px of the frame, whatever chance makes of them.
std::vector<Circle> circles_seen(PictureMaps& maps, Polarity polarity, double radius_px);

// Whether the outlines of the disks are round.
Roundness roundness_of(const GrayFrame& frame, const RimModel& model, const std::vector<RimDisk>& disks);
Roundness roundness_of(PictureMaps& maps, const RimModel& model, const std::vector<RimDisk>& disks);

// Looks again beside the beads found: chance makes up few circles there, so poorer rims are enough. Beads of other
// sizes are looked for unless `one_size`.
void learn_gaps(const GrayFrame& frame, LearnedRims& learned, bool one_size);
void learn_gaps(PictureMaps& maps, LearnedRims& learned, bool one_size);

struct RimsFound {
  std::vector<RimDisk> disks;     // from top to bottom
  std::vector<Circle> not_round;  // that would be disks, but for rims that are plainly not round
  double expected_missed = 0;     // beads: sum of the probabilities of circles that are not reported (after learn_gaps)
};
// Disks that are beads with a probability of 0.8 or more, or of 0.5 in the gaps between them. Those whose rims are not
// round are left out where they are more than errors make so, but for those of a picture in which most are not round.
RimsFound find_rims(const GrayFrame& frame, const RimModel& model);
RimsFound find_rims(PictureMaps& maps, const RimModel& model);

// The support of circles of this radius at given places (after a fit that may move them by a third of the radius).
std::vector<Circle> rims_at(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& places);
std::vector<Circle> rims_at(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& places);

// Sum over the disks of their doubts, over their number; 1 when there are none.
double expected_wrong_share(const std::vector<RimDisk>& disks);

}  // namespace shakebed::ingest
