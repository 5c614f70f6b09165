#pragma once
// Speed against error of the disk finder, beside OpenCV's HoughCircles on the same frames, with the Cramer-Rao bound.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "ingest/synthetic/synthetic_frames.hpp"

namespace shakebed::ingest {

struct FinderBenchmarkOptions {
  int width = 826, height = 1000;  // px
  double radius_px = 10;
  int rows = 15;  // touching rows of the bed: 600 disks at the default width
  int gas_count = 400;
  std::size_t frames = 4;  // of each look
  std::vector<double> blurs = {0, 1, 2};
  std::vector<double> noises = {0, 5, 15};
  bool with_hough = true;
  bool with_bound = true;
};

// One method on one look.
struct FinderBenchmarkRow {
  std::string method;  // "hough", "map", "1 sweep", ..., "joint fit"
  BeadShading shading = BeadShading::flat;
  double blur_px = 0, noise = 0;
  double recall = 0, precision = 0;
  double rms_px = 0;           // per axis, of the disks found
  double bound_px = 0;         // Cramer-Rao, per axis, all neighbours; 0 without noise or when not asked for
  double radius_error_px = 0;  // found minus true; 0 for methods that are given the radius
  double density_error = 0;    // rms of n D^2 in strips of one diameter, D as found
  double cpu_ms = 0;           // per frame, calibration spread over the frames of the look, drawing not counted
  // What the finder promises, on its own rows ("joint fit") of frames as in the defaults above: recall and precision
  // at least .999, rms at most 1.3 bounds (noise-free: .006 px), and the rest.
  bool has_limits = false;
  double rms_limit_px = 0, radius_limit_px = 0, density_limit = 0, cpu_limit_ms = 0;
  bool within_limits = false;
  std::string beyond;  // which of them are broken, empty when none is
};

// Runs all methods on all looks; `progress`, if given, is called with each row as it is done. HoughCircles is given the
// true radius and tuned with the truth over a small grid.
std::vector<FinderBenchmarkRow> benchmark_finder(const FinderBenchmarkOptions& options,
                                                 const std::function<void(const FinderBenchmarkRow&)>& progress = {});

// Cramer-Rao bound, px per axis (rms over the disks whole within the frame), of the centres in this frame under white
// noise: every centre unknown together with its neighbours', and the radius and the bead's contrast common to all.
double centre_bound_px(const std::vector<RenderedDisk>& disks, const Camera& camera);

// The rows as an aligned table with a header line.
std::string finder_benchmark_table(const std::vector<FinderBenchmarkRow>& rows);

// One input that breaks disk finders, and what came of it.
struct HardCaseRow {
  std::string name;                    // "touching pair, any angle"
  std::string status;                  // "found", "refused", "nothing found", "wrong"
  double error = 0;                    // in error_unit; none to tell when that is empty
  std::string error_unit;              // "px" (rms per axis), "deg", "D"
  double limit = 0;                    // of error, same unit
  double recall = -1, precision = -1;  // -1 where there is no truth
  double cpu_ms = 0, cpu_limit_ms = 0;
  bool pass = false;
  std::string note;  // the sentence a user would read, or what is wrong
};

// Runs all hard cases; files are written into `scratch_folder`, which must exist. A case that throws anything but a
// located InputError is "wrong".
std::vector<HardCaseRow> benchmark_hard_cases(const std::filesystem::path& scratch_folder,
                                              const std::function<void(const HardCaseRow&)>& progress = {});
std::string hard_case_table(const std::vector<HardCaseRow>& rows);

}  // namespace shakebed::ingest
