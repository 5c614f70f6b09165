#pragma once
// The shaker's motion, as far as a film of known frame rate shows it in its lowest beads.

#include <optional>
#include <string>
#include <vector>

#include "ingest/profile/floor.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

class Shaking {
 public:
  explicit Shaking(const MeasureOptions& options) : options_(options) {}

  // From the frames that give the geometry; fills what they show of frequency and floor. `bed` has scale and floor.
  void begin(const std::vector<FrameFindings>& frames, double diameter_px, int width, BedCalibration& bed);
  // One frame after the other.
  void add(const FrameFindings& frame, const BedCalibration& bed);
  // The frequency from the whole film.
  void finish(BedCalibration& bed);

  [[nodiscard]] std::optional<double> turns_per_frame() const { return turns_per_frame_; }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  void require_film(const std::vector<FrameFindings>& frames);
  void choose_period();
  void find_floor_in_motion(BedCalibration& bed);
  void take_found(BedCalibration& bed);
  void compare_with_given();

  const MeasureOptions& options_;
  double diameter_px_ = 1;
  int width_ = 0;
  std::optional<double> turns_per_frame_;
  FoundFrequency in_film_;                    // of the bed's bottom
  double bed_repeats_every_ = 1;              // periods of the shaker
  std::vector<LowestBottoms> first_bottoms_;  // of the frames that give the geometry
  std::vector<PlaceInFrame> all_bottoms_;
  std::vector<std::string> warnings_;
};

}  // namespace shakebed::ingest
