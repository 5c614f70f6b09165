#pragma once
// What one frame gives, before heights are known.

#include <vector>

#include "ingest/profile/film_calibration.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

struct FrameFindings {
  FrameReport report;
  std::vector<FoundDisk> disks, second;
  FindResult rim;                      // of the first frames: their beads' profile
  std::vector<float> coverage_of_row;  // covered px of each row
  // visit(disk) for those of both kinds.
  template <class Visit>
  void for_each_disk(const Visit& visit) const {
    for (const std::vector<FoundDisk>* kind : {&disks, &second})
      for (const FoundDisk& disk : *kind) visit(disk);
  }
};

// Every frame on its own: what a frame gives depends on nothing but the film's calibration.
class FrameExaminer {
 public:
  explicit FrameExaminer(const FilmCalibration& film);
  [[nodiscard]] FrameFindings examine(FrameSource::Item& item) const;

 private:
  void find_disks_in(const GrayFrame& frame, FrameFindings& findings) const;
  [[nodiscard]] std::vector<FoundDisk> find_second(const GrayFrame& frame, const FindResult& found) const;
  [[nodiscard]] std::vector<float> coverage_of(const GrayFrame& frame, const FrameLight& light) const;
  const FilmCalibration& film_;
  const LensMap lens_;
  const double contrast_per_area_;  // turns summed contrast into covered area
};

}  // namespace shakebed::ingest
