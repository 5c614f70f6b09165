#pragma once
// The density from covered area, independent of the density from centres, and what centres let one expect of it.

#include <optional>
#include <vector>

#include "ingest/profile/density.hpp"
#include "ingest/profile/frame_rows.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

// One frame's covered rows and the heights (D) of its centres.
struct FrameCoverage {
  const std::vector<float>& rows;  // px
  const std::vector<double>& heights;
};

class Coverage {
 public:
  // `counted_width_px`: the width over which rows were summed. `bead_radius_px`: as known by now; a bead's contrast
  // stands for the area of that radius.
  Coverage(const FinderCalibration& finder, const BedCalibration& bed, double diameter_px, double counted_width_px,
           double bead_radius_px);
  void add(const FrameCoverage& frame, const HeightBins& bins, std::size_t expected_frames);
  // The mean profile over the first bins.
  [[nodiscard]] DensityProfile profile(const HeightBins& bins) const;
  // rms in n D^2 of centres, seen through the bead, minus coverage, where there are beads.
  [[nodiscard]] double disagreement(const DensityProfile& profile) const;

 private:
  [[nodiscard]] double part_below(double height) const;
  const FinderCalibration& finder_;
  const BedCalibration& bed_;
  double diameter_px_, counted_width_px_, bead_radius_px_;
  // Part of a bead's own contrast below a height from its centre: a flat bead's is its chord's, a shaded one's is not.
  std::vector<double> rows_of_bead_;
  double rows_middle_;
  FrameRows covered_;
  std::vector<double> through_chord_;  // what the centres give, seen through the bead as covered area sees it
};

}  // namespace shakebed::ingest
