#pragma once
// What a film's first frames show: the beads, pixels and lens, a second species.

#include <optional>
#include <string>
#include <vector>

#include "ingest/profile/lens.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

// Beads by their rims, in the frame that they were learned from: what a search there finds again.
struct FoundByRims {
  std::size_t frame = 0;  // FrameSource::Item::index
  FindResult found;
};

struct FilmCalibration {
  MeasureOptions options;  // as asked for, but places are those of the true frame (see lens.hpp)
  FinderCalibration finder;
  std::optional<FinderCalibration> second;
  bool kinds_together = false;  // both are found by find_two_kinds()
  std::optional<FoundByRims> by_rims;
  Lens lens;
  double aspect_std_error = 0, lens_radial_std_error = 0;  // of what was found
  int recorded_width = 0, recorded_height = 0;
  std::vector<std::string> warnings;
};

// Reads the first frames. Throws InputError when none can be read, NoDisksError when none shows a disk.
FilmCalibration calibrate_film(FrameSource& source, const MeasureOptions& options);

// The beads of both diameters in a frame.
struct BothKinds {
  FindResult first, second;
};
BothKinds find_both_kinds(const GrayFrame& frame, const FilmCalibration& film, const FindOptions& options);

}  // namespace shakebed::ingest
