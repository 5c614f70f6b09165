#include "ingest/profile/reduced_bed.hpp"

#include <cmath>

namespace shakebed::ingest {

namespace {

// Places and lengths of reduced frames and of recorded ones: pixel k of the first covers pixels k * factor and on.
class Enlargement {
 public:
  explicit Enlargement(int factor) : factor_(factor), shift_(0.5 * (factor - 1)) {}
  [[nodiscard]] double place(double reduced) const { return factor_ * reduced + shift_; }
  [[nodiscard]] double length(double reduced) const { return factor_ * reduced; }
  [[nodiscard]] double reduced_place(double recorded) const { return (recorded - shift_) / factor_; }
  [[nodiscard]] double reduced_length(double recorded) const { return recorded / factor_; }

 private:
  double factor_, shift_;
};

PixelRectangle reduced_rectangle(const PixelRectangle& recorded, const Enlargement& by) {
  const auto edge = [&](int px) { return static_cast<int>(std::lround(by.reduced_length(px))); };
  const int left = edge(recorded.left), top = edge(recorded.top);
  return {left, top, edge(recorded.left + recorded.width) - left, edge(recorded.top + recorded.height) - top};
}

MeasureOptions reduced_options(const MeasureOptions& recorded, const Enlargement& by) {
  MeasureOptions options = recorded;
  options.reduction = 1;
  options.find.recorded_px = by.length(1);
  if (options.scale_m_per_px) options.scale_m_per_px = by.length(*options.scale_m_per_px);
  for (std::optional<double>* place : {&options.left_wall_px, &options.right_wall_px})
    if (*place) *place = by.reduced_place(**place);
  if (options.floor_px) {  // at column 0 of the recorded frame, which lies left of the reduced frame's
    const double slope = options.floor_slope.value_or(0.0);
    options.floor_px = by.reduced_place(*options.floor_px + slope * by.place(0));
  }
  if (options.find.radius_px) options.find.radius_px = by.reduced_length(*options.find.radius_px);
  if (options.find.seen) options.find.seen->radius_px = by.reduced_length(options.find.seen->radius_px);
  if (options.find.roi) options.find.roi = reduced_rectangle(*options.find.roi, by);
  return options;
}

void enlarge(MeasuredDisk& disk, const Enlargement& by) {
  disk.x_px = by.place(disk.x_px);
  disk.y_px = by.place(disk.y_px);
  disk.radius_px = by.length(disk.radius_px);
  disk.std_error_px = by.length(disk.std_error_px);
  for (double* variance : {&disk.variance_x, &disk.variance_y, &disk.covariance_xy})
    *variance = by.length(by.length(*variance));
}

void enlarge(PixelRectangle& region, int factor) {
  for (int* length : {&region.left, &region.top, &region.width, &region.height}) *length *= factor;
}

void enlarge(BedCalibration& bed, const Enlargement& by) {
  bed.scale_m_per_px = by.reduced_length(bed.scale_m_per_px);
  for (double* length : {&bed.radius_px, &bed.radius_std_error_px, &bed.edge_width_px, &bed.floor_amplitude_px,
                         &bed.floor_amplitude_std_error_px, &bed.floor_std_error_px})
    *length = by.length(*length);
  bed.floor_px = by.place(bed.floor_px) - bed.floor_slope * by.place(0);
  bed.left_wall_px = by.place(bed.left_wall_px);
  bed.right_wall_px = by.place(bed.right_wall_px);
}

}  // namespace

Measurement measure_reduced_bed(FrameSource& source, const MeasureOptions& asked) {
  const Enlargement by(asked.reduction);
  MeasureOptions options = reduced_options(asked, by);
  if (asked.disk_sink)
    options.disk_sink = [&](const FrameReport& frame, const std::vector<MeasuredDisk>& disks) {
      std::vector<MeasuredDisk> recorded = disks;
      for (MeasuredDisk& disk : recorded) enlarge(disk, by);
      asked.disk_sink(frame, recorded);
    };
  Measurement measurement = measure_bed(source, options);
  for (MeasuredDisk& disk : measurement.disks) enlarge(disk, by);
  enlarge(measurement.calibration, by);
  enlarge(measurement.bed_region, asked.reduction);
  if (measurement.above_mirror_image) enlarge(*measurement.above_mirror_image, asked.reduction);
  for (double* length : {&measurement.contacts.nearest_px, &measurement.contacts.touching_px})
    *length = by.length(*length);
  return measurement;
}

}  // namespace shakebed::ingest
