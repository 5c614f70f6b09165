// implements: ingest/profile/measure_bed.hpp
// Disks as tables.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "ingest/frames/atomic_file.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

std::string_view to_string(FloorReference reference) {
  switch (reference) {
    case FloorReference::given:
      return "given";
    case FloorReference::mean_of_motion:
      return "mean of its motion";
    case FloorReference::mean_by_amplitude:
      return "mean by its amplitude";
    case FloorReference::lowest_seen:
      return "lowest seen";
  }
  return "unknown";
}

std::string disks_csv_rows(const std::vector<MeasuredDisk>& disks) {
  std::string text;
  text.reserve(90 * disks.size());
  char line[256];
  for (const MeasuredDisk& disk : disks) {
    std::snprintf(line, sizeof line, "%zu,%.4f,%.4f,%.4f,%.6f,%.6f,%.4f\n", disk.frame, disk.x_px, disk.y_px,
                  disk.radius_px, disk.x, disk.z, disk.quality);
    text += line;
  }
  return text;
}

std::string disk_details_csv_rows(const std::vector<MeasuredDisk>& disks) {
  std::string text;
  text.reserve(90 * disks.size());
  char line[256];
  for (const MeasuredDisk& disk : disks) {
    const double x = std::sqrt(std::max(0.0, disk.variance_x)), y = std::sqrt(std::max(0.0, disk.variance_y));
    std::snprintf(line, sizeof line, "%zu,%.4f,%.4f,%.5f,%.5f,%.4f,%.4f,%d,%d,%d,%.4f\n", disk.frame, disk.x_px,
                  disk.y_px, x, y, x * y > 0 ? disk.covariance_xy / (x * y) : 0.0, disk.contrast, disk.cut ? 1 : 0,
                  disk.half_hidden ? 1 : 0, disk.species, disk.probability);
    text += line;
  }
  return text;
}

void write_disks_csv(const std::filesystem::path& path, const Measurement& measurement,
                     const std::vector<std::string>& comments) {
  std::string text;
  for (const std::string& comment : comments) text += "# " + comment + "\n";
  text += disks_csv_head;
  text += disks_csv_rows(measurement.disks);
  write_file_atomically(path, text);
}

}  // namespace shakebed::ingest
