#include "ingest/profile/measure_bed.hpp"

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <map>
#include <mutex>
#include <numbers>
#include <stdexcept>
#include <thread>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/frames/atomic_file.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "ingest/profile/reduced_bed.hpp"
#include "ingest/profile/shaking_frequency.hpp"

namespace shakebed::ingest {

namespace {

// What one frame gave, before heights are known.
struct FrameFindings {
  FrameReport report;
  std::vector<FoundDisk> disks, second;
  FindResult rim;                      // of the first frames: their beads' profile
  std::vector<float> coverage_of_row;  // covered px of each row
};

// A row of numbers a frame, all equally long, in one piece of memory: a long film has many.
class FrameRows {
 public:
  // `expected` rows, if known.
  void add(const std::vector<double>& row, std::size_t expected) {
    if (count_ == 0) {
      length_ = row.size();
      values_.reserve(length_ * expected);
    }
    ++count_;
    for (const double value : row) values_.push_back(static_cast<float>(value));
  }
  [[nodiscard]] std::size_t size() const { return count_; }
  // The first `length` numbers of the k-th row, or of all.
  [[nodiscard]] std::vector<double> row(std::size_t k, std::size_t length) const {
    const auto from = values_.begin() + static_cast<std::ptrdiff_t>(k * length_);
    return {from, from + static_cast<std::ptrdiff_t>(std::min(length, length_))};
  }
  [[nodiscard]] std::vector<std::vector<double>> rows(std::size_t length) const {
    std::vector<std::vector<double>> all;
    all.reserve(count_);
    for (std::size_t k = 0; k < count_; ++k) all.push_back(row(k, length));
    return all;
  }

 private:
  std::size_t length_ = 0, count_ = 0;
  std::vector<float> values_;
};

void check(const MeasureOptions& options) {
  const auto require = [](bool condition, const std::string& what) {
    if (!condition) throw std::invalid_argument("measure_bed: " + what);
  };
  require(std::isfinite(options.bead_diameter_m) && options.bead_diameter_m > 0, "bead_diameter_m must be positive");
  require(!options.scale_m_per_px || *options.scale_m_per_px > 0, "scale_m_per_px must be positive");
  require(!options.second_diameter_m || (std::isfinite(*options.second_diameter_m) && *options.second_diameter_m > 0),
          "second_diameter_m must be positive");
  require(options.bin_width > 0 && options.kernel.width > 0, "bin_width and kernel.width must be positive");
  require(!options.left_wall_px || !options.right_wall_px || *options.left_wall_px < *options.right_wall_px,
          "the left wall must lie left of the right wall");
  require(options.shaking_frequency_hz.has_value() <= options.frame_rate_hz.has_value(),
          "phases need the frame rate beside the shaking frequency");
  require(options.geometry_frames > 0, "geometry_frames must be positive");
  require(options.phase_bins > 0, "phase_bins must be positive");
}

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto place = static_cast<std::ptrdiff_t>(std::lround(fraction * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

// Area under a bead's profile over the area of its disk: what turns summed contrast into covered area.
double contrast_per_area(const FinderCalibration& finder) {
  double sum = 0;
  for (std::size_t i = 0; i < finder.profile.level.size(); ++i) {
    const double r = static_cast<double>(i) * finder.profile.step_px;
    sum += 2 * std::numbers::pi * r * finder.profile.step_px * static_cast<double>(finder.profile.level[i]);
  }
  return sum / (std::numbers::pi * finder.radius_px * finder.radius_px);
}

// The bead's profile summed along rows: the share of its contrast below each height, heights row_step_px apart from
// -reach to reach, 0 at the first and 1 at the last.
constexpr double row_step_px = 0.25;
std::vector<double> contrast_by_row(const FinderCalibration& finder) {
  const double reach = finder.profile.reach_px();
  const auto half = static_cast<std::size_t>(std::ceil(reach / row_step_px));
  const auto level_at = [&](double r) {
    const auto cell = static_cast<std::size_t>(r / finder.profile.step_px);
    return cell < finder.profile.level.size() ? static_cast<double>(finder.profile.level[cell]) : 0.0;
  };
  std::vector<double> below(2 * half + 1, 0.0);
  for (std::size_t k = 1; k < below.size(); ++k) {
    const double y = (static_cast<double>(k) - 0.5 - static_cast<double>(half)) * row_step_px;
    double row = 0;
    for (double x = 0.5 * row_step_px; x < reach; x += row_step_px) {
      row += 2 * level_at(std::hypot(x, y));
      if (finder.profile.asymmetry)  // y_px grows downwards
        row += finder.profile.asymmetry->at(x, -y) + finder.profile.asymmetry->at(-x, -y);
    }
    below[k] = below[k - 1] + row;
  }
  const double all = below.back();
  for (double& value : below) value = all > 0 ? value / all : 0;
  return below;
}

// The frame with the disks found painted over by the background behind them.
GrayFrame without_disks(const GrayFrame& frame, const FindResult& found, const FinderCalibration& finder) {
  GrayFrame left = residual_frame(frame, found, finder);
  const LightField& light = finder.light;
  const float background =
      light.background[static_cast<std::size_t>(light.rows / 2) * static_cast<std::size_t>(light.columns) +
                       static_cast<std::size_t>(light.columns / 2)];
  for (float& level : left.pixels) level += background;
  return left;
}

// Beads of the second diameter by their rims, if they are seen.
std::optional<FinderCalibration> learn_second_by_rims(const GrayFrame& frame, const FinderCalibration& first,
                                                      const MeasureOptions& options) {
  FindOptions find = options.find;
  const double expected = first.radius_px * *options.second_diameter_m / options.bead_diameter_m;
  find.seen = BeadsSeen{first.polarity, expected};
  find.radius_px.reset();
  constexpr double nearly = 0.1;
  CalibrationResult result = learn_by_rims(frame, *find.seen);
  if (!result.found || std::abs(result.calibration.radius_px / expected - 1) > nearly) return std::nullopt;
  return std::move(result.calibration);
}

// Disks of the second species, none where the first has one.
std::vector<FoundDisk> find_second(const GrayFrame& frame, const FindResult& found, const FinderCalibration& finder,
                                   const FinderCalibration& second, const FindOptions& options) {
  std::vector<FoundDisk> disks = second.by_rims
                                     ? find_beads(frame, second, options).disks
                                     : find_disks(without_disks(frame, found, finder), second, options).disks;
  const double near = 0.72 * (finder.radius_px + second.radius_px);
  const Nearby taken(found.disks.size(), near,
                     [&](std::size_t i) { return std::pair(found.disks[i].x_px, found.disks[i].y_px); });
  std::erase_if(disks, [&](const FoundDisk& disk) { return taken.any_near(disk.x_px, disk.y_px); });
  return disks;
}

FrameFindings examine(FrameSource::Item& item, const FinderCalibration& finder, const FinderCalibration* second,
                      const MeasureOptions& options, const LensMap& lens, int recorded_width, int recorded_height,
                      double per_area) {
  FrameFindings findings;
  findings.report.index = item.index;
  findings.report.origin = item.origin;
  GrayFrame frame;
  try {
    frame = item.decode();
  } catch (const InputError& error) {
    findings.report.status = FrameStatus::unreadable;
    findings.report.why = error.what();
    return findings;
  }
  if (frame.width != recorded_width || frame.height != recorded_height) {
    findings.report.status = FrameStatus::size_changed;
    findings.report.why = "the frame is " + std::to_string(frame.width) + " x " + std::to_string(frame.height) +
                          " px, the frames before it " + std::to_string(recorded_width) + " x " +
                          std::to_string(recorded_height);
    return findings;
  }
  if (!lens.lens().plain()) frame = lens.corrected(frame);
  FindOptions find = options.find;
  find.learn_rim = item.index < rim_frames;
  FindResult found = find_beads(frame, finder, find);
  findings.rim.profile = std::move(found.profile);
  findings.rim.profile_beads = found.profile_beads;
  if (second) {
    findings.second = find_second(frame, found, finder, *second, options.find);
    findings.report.second = findings.second.size();
  }
  if (!lens.lens().plain())  // what a margin repeats is no disk
    std::erase_if(found.disks, [&](const FoundDisk& disk) {
      const PixelPlace place = lens.to_recorded({disk.x_px, disk.y_px});
      return place.x < -0.5 || place.y < -0.5 || place.x >= recorded_width - 0.5 || place.y >= recorded_height - 0.5;
    });
  findings.report.disks = found.disks.size();
  findings.report.rejected = found.rejected;
  findings.report.residual_level = found.residual_level;
  findings.report.light = found.light;
  if (found.empty()) {
    findings.report.status = FrameStatus::nothing_found;
    findings.report.why = found.why_nothing;
  }
  if (options.profile_from_coverage) {
    const GrayFrame flat = flatten(seen_part(frame, finder), finder.light, found.light);
    int left = 0, right = frame.width;
    if (options.left_wall_px)
      left = std::clamp(static_cast<int>(std::lround(*options.left_wall_px + 0.5)), 0, frame.width);
    if (options.right_wall_px)
      right = std::clamp(static_cast<int>(std::lround(*options.right_wall_px + 0.5)), left, frame.width);
    findings.coverage_of_row.resize(static_cast<std::size_t>(frame.height));
    for (int row = 0; row < frame.height; ++row) {
      double sum = 0;
      const float* line = flat.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width);
      for (int column = left; column < right; ++column)
        sum += unseen(line[column]) ? 0.0 : static_cast<double>(line[column]);
      findings.coverage_of_row[static_cast<std::size_t>(row)] = static_cast<float>(sum / per_area);
    }
  }
  findings.disks = std::move(found.disks);
  return findings;
}

// Straight line y = a + b x through the bottoms of the lowest disks, by Huber's weights.
struct Line {
  double offset = 0, slope = 0;
  double slope_std_error = 0;
  std::pair<double, double> middle;  // of the points
};
Line robust_line(const std::vector<std::pair<double, double>>& points) {
  Line line;
  if (points.empty()) return line;
  std::vector<double> heights;
  for (const auto& point : points) heights.push_back(point.second);
  line.offset = quantile(heights, 0.5);
  if (points.size() < 4) return line;
  for (int round = 0; round < 30; ++round) {
    std::vector<double> sizes;
    for (const auto& [x, y] : points) sizes.push_back(std::abs(y - line.offset - line.slope * x));
    const double spread = std::max(0.02, 1.4826 * quantile(sizes, 0.5));
    double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0;
    for (const auto& [x, y] : points) {
      const double size = std::abs(y - line.offset - line.slope * x) / spread;
      const double weight = size < 1.5 ? 1 : size > 6 ? 0 : 1.5 / size;
      w += weight;
      wx += weight * x;
      wy += weight * y;
      wxx += weight * x * x;
      wxy += weight * x * y;
    }
    const double determinant = w * wxx - wx * wx;
    if (!(determinant > 1e-9 * w * wxx)) break;
    line.slope = (w * wxy - wx * wy) / determinant;
    line.offset = (wy - line.slope * wx) / w;
    double square = 0;
    for (const auto& [x, y] : points)
      square += std::min(std::pow(y - line.offset - line.slope * x, 2), 36 * spread * spread);
    const double variance = std::max(spread * spread, square / (static_cast<double>(points.size()) - 2));
    line.slope_std_error = std::sqrt(variance * w / determinant);
    line.middle = {wx / w, wy / w};
  }
  return line;
}

// The floor as the disks tell it: per column of the frame, the lowest bottom seen in nearly all frames.
Line find_floor(const std::vector<FrameFindings>& frames, double diameter_px, int width) {
  const std::size_t columns = std::max<std::size_t>(1, static_cast<std::size_t>(width / (1.5 * diameter_px)));
  std::vector<std::vector<std::pair<double, double>>> lowest(columns);  // (bottom, x) per frame
  for (const FrameFindings& frame : frames) {
    std::vector<std::pair<double, double>> best(columns, {-1, 0});
    for (const FoundDisk& disk : frame.disks) {
      const double bottom = disk.y_px + disk.radius_px;
      const auto column = std::min(
          columns - 1, static_cast<std::size_t>(std::max(0.0, disk.x_px) / width * static_cast<double>(columns)));
      if (bottom > best[column].first) best[column] = {bottom, disk.x_px};
    }
    for (std::size_t c = 0; c < columns; ++c)
      if (best[c].first > 0) lowest[c].push_back(best[c]);
  }
  std::vector<std::pair<double, double>> points;
  for (auto& column : lowest) {
    if (column.empty()) continue;
    std::sort(column.begin(), column.end());
    const auto& chosen = column[static_cast<std::size_t>(0.95 * static_cast<double>(column.size() - 1))];
    points.emplace_back(chosen.second, chosen.first);
  }
  // Columns without beads at the floor would pull the line up: start from the lower half.
  std::vector<double> heights;
  for (const auto& point : points) heights.push_back(point.second);
  const double typical = quantile(heights, 0.6);
  std::vector<std::pair<double, double>> low;
  for (const auto& point : points)
    if (point.second > typical - 0.6 * diameter_px) low.push_back(point);
  Line line = robust_line(low);
  // Some ten columns of a bed that flies do not lie on a line: a tilt is believed beyond its error only (1 in 200 for
  // Student's t of 8 degrees of freedom).
  constexpr double believed = 4;
  if (std::abs(line.slope) < believed * line.slope_std_error) {
    line.slope = 0;
    line.offset = line.middle.second;
  }
  return line;
}

// The floor's motion, y = middle - rise sin(2 pi turns) - rise_late cos(2 pi turns), from what no bead ever passes.
struct FloorMotion {
  bool known = false;
  double middle = 0, amplitude = 0, phase = 0;
  std::size_t touching = 0;  // beads
};
// The lowest bottom in each column of a frame, a tilt taken out; columns without a bead are left out.
struct LowestBottoms {
  std::size_t frame = 0;
  std::vector<double> y;
};
LowestBottoms lowest_bottoms(const FrameFindings& frame, double slope, double diameter_px, int width) {
  const std::size_t columns = std::max<std::size_t>(1, static_cast<std::size_t>(width / (1.5 * diameter_px)));
  LowestBottoms bottoms{frame.report.index, std::vector<double>(columns, -1e9)};
  for (const FoundDisk& disk : frame.disks) {
    const auto column = std::min(
        columns - 1, static_cast<std::size_t>(std::max(0.0, disk.x_px) / width * static_cast<double>(columns)));
    bottoms.y[column] = std::max(bottoms.y[column], disk.y_px + disk.radius_px - slope * disk.x_px);
  }
  std::erase_if(bottoms.y, [](double y) { return y < -1e8; });
  return bottoms;
}

// Where the bed's bottom is in a frame: what lies lowest follows the floor, or at least its period.
std::optional<PlaceInFrame> bottom_of(const LowestBottoms& bottoms) {
  constexpr double low = 0.75;
  if (bottoms.y.empty()) return std::nullopt;
  return PlaceInFrame{bottoms.frame, quantile(bottoms.y, low)};
}

// A bottom counts in full while it is below the floor or no more than a tolerance above; the tolerance shrinks, so that
// what is left in the end are the beads that touch. Known only if such beads are seen all around the period.
FloorMotion find_floor_motion(const std::vector<LowestBottoms>& frames, double diameter_px, double turns_per_frame) {
  struct Bottom {
    double y, sine, cosine;
    std::size_t part;  // of the period
  };
  constexpr std::size_t parts = 12;
  std::vector<Bottom> bottoms;
  for (const LowestBottoms& frame : frames) {
    const double turns = static_cast<double>(frame.frame) * turns_per_frame;
    const double phase = turns - std::floor(turns);
    for (const double y : frame.y)
      bottoms.push_back({y, std::sin(2 * std::numbers::pi * phase), std::cos(2 * std::numbers::pi * phase),
                         std::min(parts - 1, static_cast<std::size_t>((phase + 1e-9) * parts))});
  }
  FloorMotion motion;
  if (bottoms.size() < 30) return motion;
  std::vector<double> heights;
  for (const Bottom& bottom : bottoms) heights.push_back(bottom.y);
  std::vector<double> fit = {quantile(heights, 0.9), 0, 0};
  const auto gap = [&](const Bottom& bottom) {
    return fit[0] - fit[1] * bottom.sine - fit[2] * bottom.cosine - bottom.y;
  };
  double tolerance = diameter_px;
  for (int round = 0; round < 60; ++round) {
    tolerance = std::max(0.02 * diameter_px, 0.85 * tolerance);
    std::vector<double> matrix(9, 0.0), right(3, 0.0);
    for (const Bottom& bottom : bottoms) {
      const double above = std::max(0.0, gap(bottom)) / tolerance;
      const double weight = std::exp(-above * above);
      const double row[3] = {1, -bottom.sine, -bottom.cosine};
      for (std::size_t a = 0; a < 3; ++a) {
        right[a] += weight * row[a] * bottom.y;
        for (std::size_t b = 0; b < 3; ++b) matrix[a * 3 + b] += weight * row[a] * row[b];
      }
    }
    for (std::size_t a = 0; a < 3; ++a) matrix[a * 4] += 1e-6 * matrix[0];
    if (!solve_symmetric(matrix, right, 3)) return motion;
    fit = right;
  }
  std::vector<std::size_t> touching(parts, 0);
  for (const Bottom& bottom : bottoms) {
    const bool touches = gap(bottom) < 2 * tolerance;
    touching[bottom.part] += touches;
    motion.touching += touches;
  }
  // The longest stretch of the period without a touching bead: beyond half a period nothing bounds the fit there.
  std::size_t longest = 0, empty = 0;
  for (std::size_t k = 0; k < 2 * parts; ++k) {
    empty = touching[k % parts] ? 0 : empty + 1;
    longest = std::max(longest, empty);
  }
  motion.middle = fit[0];
  motion.amplitude = std::hypot(fit[1], fit[2]);
  const double turns = std::atan2(fit[2], fit[1]) / (2 * std::numbers::pi);
  motion.phase = turns - std::floor(turns);
  motion.known = longest <= parts / 2;
  return motion;
}

}  // namespace

Measurement measure_bed(FrameSource& source, const MeasureOptions& asked) {
  check(asked);
  if (asked.reduction > 1) return measure_reduced_bed(source, asked);
  MeasureOptions options = asked;  // its places become those of true frames
  Measurement measurement;
  FindOptions find = options.find;
  Lens lens{options.pixel_aspect.value_or(1.0), options.lens_radial.value_or(0.0)};
  const auto straightened = [&](const GrayFrame& frame) {
    return lens.plain() ? frame : LensMap(lens, frame.width, frame.height).corrected(frame);
  };
  if (options.scale_m_per_px && !find.radius_px) {
    find.radius_px =
        0.5 * options.bead_diameter_m / *options.scale_m_per_px;  // a good first value; refined all the same
  }

  // Learn the bead from the first frames that show any; one full frame is enough, sparse ones are taken together.
  constexpr std::size_t enough_disks = 150;
  constexpr std::size_t most_tried = 40;
  std::vector<GrayFrame> learned_from, recorded;  // true and as recorded
  CalibrationResult calibrated;
  std::string first_reason, first_error;
  std::size_t read = 0;
  source.rewind();
  for (std::size_t tried = 0; tried < most_tried; ++tried) {
    auto item = source.next_item();
    if (!item) break;
    GrayFrame frame;
    try {
      frame = item->decode();
    } catch (const InputError& error) {
      if (first_error.empty()) first_error = error.what();
      continue;
    }
    ++read;
    learned_from.push_back(straightened(frame));
    recorded.push_back(std::move(frame));
    std::vector<const GrayFrame*> pointers;
    if (calibrated.found)
      for (const GrayFrame& one : learned_from) pointers.push_back(&one);
    else
      pointers = {&learned_from.back()};
    CalibrationResult attempt = learn_beads(pointers, find);
    if (!attempt.found) {
      if (first_reason.empty()) first_reason = attempt.why_not;
      learned_from.pop_back();
      recorded.pop_back();
      continue;
    }
    calibrated = std::move(attempt);
    if (calibrated.calibration.disks_used >= enough_disks || learned_from.size() >= options.calibration_frames) break;
  }
  if (!calibrated.found) {
    if (read == 0)
      throw InputError("(frames)", "no frame could be read", first_error.empty() ? "the stream is empty" : first_error,
                       "check the files");
    throw InputError("(frames)", "no disks in any of the first " + std::to_string(read) + " frames", first_reason,
                     "check that the beads are in view, or give their radius and polarity");
  }
  // Pixels and lens from the rims of the beads: what is clearly there is taken out, and all is learned again.
  const int recorded_width = recorded.front().width, recorded_height = recorded.front().height;
  std::erase_if(recorded, [&](const GrayFrame& frame) {
    return frame.width != recorded_width || frame.height != recorded_height;
  });
  constexpr int lens_rounds = 5;
  // Rims alone are too coarse for it, and where other things pass for beads, a lens would fit those.
  const bool rims_alone = calibrated.calibration.by_rims || calibrated.calibration.rims_to_be_checked;
  for (int round = 0; round < lens_rounds && !rims_alone && !(options.pixel_aspect && options.lens_radial); ++round) {
    std::vector<const GrayFrame*> pointers;
    std::vector<FindResult> found;
    learned_from.clear();
    for (const GrayFrame& frame : recorded) learned_from.push_back(straightened(frame));
    for (const GrayFrame& frame : learned_from) {
      pointers.push_back(&frame);
      found.push_back(find_disks(frame, calibrated.calibration, find));
    }
    const LensEstimate left = estimate_lens(pointers, found, calibrated.calibration);
    BedCalibration& bed = measurement.calibration;
    bed.aspect_std_error = options.pixel_aspect ? 0 : left.aspect_std_error;
    bed.lens_radial_std_error = options.lens_radial ? 0 : left.radial_std_error;
    if (!left.known) break;
    // Below a few thousandths it may as well be streaks or shading, and does no harm.
    constexpr double worth_it = 0.004, settled = 3e-4, most = 0.25;
    const auto clear = [&](double value, double std_error, bool in_use) {
      return std::abs(value) > std::max(in_use ? settled : worth_it, 5 * std_error);
    };
    Lens better = lens;
    if (!options.pixel_aspect && clear(left.lens.pixel_aspect - 1, left.aspect_std_error, lens.pixel_aspect != 1))
      better.pixel_aspect = std::clamp(lens.pixel_aspect * left.lens.pixel_aspect, 1 - most, 1 + most);
    if (!options.lens_radial && clear(left.lens.radial, left.radial_std_error, lens.radial != 0))
      better.radial = std::clamp(lens.radial + left.lens.radial, -most, most);
    if (better.pixel_aspect == lens.pixel_aspect && better.radial == lens.radial) break;
    const Lens before = lens;
    lens = better;
    learned_from.clear();
    pointers.clear();
    for (const GrayFrame& frame : recorded) learned_from.push_back(straightened(frame));
    for (const GrayFrame& frame : learned_from) pointers.push_back(&frame);
    constexpr double small = 0.01;
    const bool little =
        std::abs(lens.pixel_aspect / before.pixel_aspect - 1) < small && std::abs(lens.radial - before.radial) < small;
    CalibrationResult again =
        little ? learn_again(pointers, find, calibrated.calibration) : learn_beads(pointers, find);
    if (!again.found || again.calibration.by_rims) {
      lens = before;
      break;
    }
    if (little) {
      again.calibration.rims = calibrated.calibration.rims;
      again.calibration.rims_to_be_checked = calibrated.calibration.rims_to_be_checked;
    }
    calibrated = std::move(again);
    // What a small correction leaves is its square and a share of its own: less than what would be worth it.
    if (little) break;
  }
  tell_radius(calibrated);
  if (calibrated.calibration.by_rims) options.profile_from_coverage = false;
  calibrated.beads.reset();
  if (options.second_diameter_m && find.seen) {
    measurement.second_finder = learn_second_by_rims(learned_from.back(), calibrated.calibration, options);
    if (!measurement.second_finder)
      measurement.warnings.push_back("No beads of the second diameter were found: no rims of that radius are seen.");
  } else if (options.second_diameter_m) {
    const double expected = calibrated.calibration.radius_px * *options.second_diameter_m / options.bead_diameter_m;
    FindOptions find_second_kind = find;
    find_second_kind.polarity = Polarity::automatic;
    find_second_kind.radius_px = expected;
    std::vector<GrayFrame> painted;
    std::vector<const GrayFrame*> pointers;
    for (const GrayFrame& frame : recorded) {
      const GrayFrame straight = straightened(frame);
      painted.push_back(
          without_disks(straight, find_disks(straight, calibrated.calibration, find), calibrated.calibration));
    }
    for (const GrayFrame& frame : painted) pointers.push_back(&frame);
    CalibrationResult result = calibrate_finder(pointers, find_second_kind);
    constexpr double nearly = 0.08;
    const auto as_expected = [&](const CalibrationResult& one) {
      return one.found && std::abs(one.calibration.radius_px / expected - 1) < nearly;
    };
    // Several small disks can stand in for a large one: what is found with nothing asked for must not do better.
    const auto left_by = [&](const FinderCalibration& calibration) {
      double square = 0;
      for (const GrayFrame& frame : painted)
        for (const float level :
             residual_frame(frame, find_disks(frame, calibration, find_second_kind), calibration).pixels)
          square += static_cast<double>(level * level);
      return square;
    };
    if (as_expected(result)) {
      find_second_kind.radius_px.reset();
      CalibrationResult free = calibrate_finder(pointers, find_second_kind);
      if (free.found && !as_expected(free) && left_by(free.calibration) < left_by(result.calibration))
        result = std::move(free);
    }
    if (as_expected(result))
      measurement.second_finder = std::move(result.calibration);
    else
      measurement.warnings.push_back("No beads of the second diameter were found: " +
                                     (result.found ? "what there is has a radius of " +
                                                         std::to_string(result.calibration.radius_px) +
                                                         " px instead of " + std::to_string(expected) + " px."
                                                   : result.why_not + "."));
  }
  learned_from.clear();
  learned_from.shrink_to_fit();
  recorded.clear();
  recorded.shrink_to_fit();
  const LensMap lens_map(lens, recorded_width, recorded_height);
  measurement.calibration.lens = lens;
  measurement.calibration.lens_given = options.pixel_aspect && options.lens_radial;
  if (!lens.plain()) {
    if (!measurement.calibration.lens_given) {
      char text[200];
      std::snprintf(text, sizeof text,
                    "Beads are no circles of one size in these frames: pixels are taken to be %.4f times as wide as "
                    "high, and the lens to bend by %+.4f at the corners.",
                    lens.pixel_aspect, lens.radial);
      measurement.warnings.emplace_back(text);
    }
    const auto place_of = [&](double x, double y) { return lens_map.to_true({x, y}); };
    if (options.floor_px) {
      const double slope = options.floor_slope.value_or(0.0), right = recorded_width - 1;
      const PixelPlace a = place_of(0, *options.floor_px), b = place_of(right, *options.floor_px + slope * right);
      options.floor_slope = (b.y - a.y) / (b.x - a.x);
      options.floor_px = a.y - *options.floor_slope * a.x;
    }
    const double half_way = 0.5 * (recorded_height - 1);
    if (options.left_wall_px) options.left_wall_px = place_of(*options.left_wall_px, half_way).x;
    if (options.right_wall_px) options.right_wall_px = place_of(*options.right_wall_px, half_way).x;
    if (options.find.roi) {
      const PixelRectangle& roi = *options.find.roi;
      const PixelPlace a = place_of(roi.left, roi.top), b = place_of(roi.left + roi.width, roi.top + roi.height);
      options.find.roi =
          PixelRectangle{static_cast<int>(std::lround(a.x)), static_cast<int>(std::lround(a.y)),
                         static_cast<int>(std::lround(b.x - a.x)), static_cast<int>(std::lround(b.y - a.y))};
    }
  }
  measurement.finder = calibrated.calibration;
  const FinderCalibration& finder = measurement.finder;
  const FinderCalibration* second = measurement.second_finder ? &*measurement.second_finder : nullptr;

  // Every frame on its own: what a frame gives depends on nothing but the calibration, so threads change nothing.
  const double per_area = contrast_per_area(finder);
  source.rewind();
  std::vector<FrameFindings> held;  // found, not yet placed: their floor and walls are not known
  BedCalibration& bed = measurement.calibration;
  double diameter_px = 0;
  const double frame_left = options.find.roi ? options.find.roi->left - 0.5 : -0.5;
  const double frame_right =
      options.find.roi ? options.find.roi->left + options.find.roi->width - 0.5 : finder.width - 0.5;
  HeightBins bins;  // up to the top of the frame; cut at the highest disk in the end
  bins.lowest = options.lowest.value_or(0.0);
  bins.width = options.bin_width;
  const auto bins_up_to = [&](double top) {
    if (!(top > bins.lowest)) return std::size_t{0};
    return static_cast<std::size_t>(std::clamp(std::ceil((top - bins.lowest) / bins.width - 1e-9), 1.0, 1e5));
  };
  // The shaker's motion, as far as a film of known frame rate shows it.
  constexpr double resting = 0.02;           // D: what touching beads scatter
  std::optional<double> turns_per_frame;     // of the shaker
  FoundFrequency in_film;                    // of the bed's bottom
  double bed_repeats_every = 1;              // periods of the shaker
  std::vector<LowestBottoms> first_bottoms;  // of the frames that tell the geometry
  std::vector<PlaceInFrame> all_bottoms;
  FinderCalibration refined = finder;
  const auto settle_geometry = [&] {
    RadiusFromFrames radius;
    for (const FrameFindings& frame : held) radius.add(frame.rim);
    radius.refine(refined);
    for (FrameFindings& frame : held)
      for (FoundDisk& disk : frame.disks) disk.radius_px = refined.radius_px;
    bed.radius_px = refined.radius_px;
    bed.radius_std_error_px = refined.radius_std_error_px;
    bed.edge_width_px = finder.edge_width_px;
    bed.noise_level = finder.noise_level;
    bed.contrast_level = finder.contrast_level;
    bed.polarity = finder.polarity;
    bed.scale_given = options.scale_m_per_px.has_value();
    bed.scale_m_per_px = bed.scale_given ? *options.scale_m_per_px : options.bead_diameter_m / (2 * refined.radius_px);
    bed.scale_relative_std_error = bed.scale_given ? 0 : refined.radius_std_error_px / refined.radius_px;
    diameter_px = options.bead_diameter_m / bed.scale_m_per_px;
    if (bed.scale_given && std::abs(2 * refined.radius_px / diameter_px - 1) > 0.02)
      measurement.warnings.push_back("The scale given makes a bead " + std::to_string(diameter_px) +
                                     " px wide, but the frames show " + std::to_string(2 * refined.radius_px) + " px.");
    bed.floor_given = options.floor_px.has_value();
    if (bed.floor_given) {
      bed.floor_px = *options.floor_px;
      bed.floor_slope = options.floor_slope.value_or(0.0);
    } else {
      const Line floor = find_floor(held, diameter_px, finder.width);
      bed.floor_px = floor.offset;
      bed.floor_slope = options.floor_slope.value_or(floor.slope);
      if (!options.floor_slope) bed.floor_tilt_std_error_degrees = floor.slope_std_error * 180 / std::numbers::pi;
      if (options.floor_slope) {  // keep the line through the middle of the frame
        bed.floor_px = floor.offset + (floor.slope - bed.floor_slope) * 0.5 * finder.width;
      }
    }
    if (options.frame_rate_hz) {
      std::vector<PlaceInFrame> bottoms;
      for (const FrameFindings& frame : held) {
        first_bottoms.push_back(lowest_bottoms(frame, bed.floor_slope, diameter_px, finder.width));
        if (const auto bottom = bottom_of(first_bottoms.back())) bottoms.push_back(*bottom);
      }
      in_film = find_frequency(bottoms);
      if (in_film.known && in_film.amplitude < resting * diameter_px) {
        in_film.known = false;
        in_film.why_not = "the lowest beads move by less than two hundredths of a diameter";
      }
      bed.frequency_given = options.shaking_frequency_hz.has_value();
      if (bed.frequency_given) {
        turns_per_frame = *options.shaking_frequency_hz / *options.frame_rate_hz;
      } else if (in_film.known) {
        // A bed that is thrown up in every second period repeats at half the floor's frequency, but does not lie on a
        // floor that moves so.
        const double twice = 2 * in_film.cycles_per_frame;
        constexpr double clearly_more = 1.5;
        if (twice < 0.5) {
          const FloorMotion once = find_floor_motion(first_bottoms, diameter_px, in_film.cycles_per_frame);
          const FloorMotion as_twice = find_floor_motion(first_bottoms, diameter_px, twice);
          bed_repeats_every = as_twice.known && static_cast<double>(as_twice.touching) >
                                                    clearly_more * static_cast<double>(once.touching)
                                  ? 2
                                  : 1;
        }
        turns_per_frame = bed_repeats_every * in_film.cycles_per_frame;
      }
      if (!bed.floor_given && turns_per_frame) {
        const FloorMotion motion = find_floor_motion(first_bottoms, diameter_px, *turns_per_frame);
        if (!motion.known) {
          measurement.warnings.push_back(
              "The floor's motion could not be told: beads touch it in too small a part of the shaker's period. "
              "Heights "
              "are measured from its lowest position.");
        } else if (motion.amplitude > resting * diameter_px) {
          bed.floor_px = motion.middle;
          bed.floor_amplitude_px = motion.amplitude;
          bed.floor_phase = motion.phase;
          if (!options.lowest)  // beads follow the floor below its mean position
            bins.lowest = -std::ceil(motion.amplitude / diameter_px / bins.width) * bins.width;
        }
      }
    }
    bed.floor_tilt_degrees = std::atan(bed.floor_slope) * 180 / std::numbers::pi;

    bed.walls_given = options.left_wall_px && options.right_wall_px;
    std::vector<double> leftmost, rightmost;
    for (const FrameFindings& frame : held) {
      double low = 1e9, high = -1e9;
      for (const FoundDisk& disk : frame.disks) {
        low = std::min(low, disk.x_px - refined.radius_px);
        high = std::max(high, disk.x_px + refined.radius_px);
      }
      if (frame.disks.empty()) continue;
      leftmost.push_back(low);
      rightmost.push_back(high);
    }
    const auto side = [&](const std::optional<double>& given, std::vector<double>& seen, double frame_side, bool left) {
      if (given) return *given;
      const double extreme = quantile(seen, left ? 0.1 : 0.9);
      const bool cut = left ? extreme < frame_side - 0.02 * diameter_px : extreme > frame_side + 0.02 * diameter_px;
      if (!cut) return extreme;
      // Beads go on beyond the frame: only centres a radius inside are counted, so that each of them is seen whole.
      bed.walls_are_frame_sides = true;
      return left ? frame_side + refined.radius_px : frame_side - refined.radius_px;
    };
    bed.left_wall_px = side(options.left_wall_px, leftmost, frame_left, true);
    bed.right_wall_px = side(options.right_wall_px, rightmost, frame_right, false);
    bed.width = (bed.right_wall_px - bed.left_wall_px) / diameter_px;
    if (!(bed.width > 0)) {
      bed.left_wall_px = frame_left;
      bed.right_wall_px = frame_right;
      bed.width = (frame_right - frame_left) / diameter_px;
      measurement.warnings.push_back(
          "The side walls could not be told from the disks: the whole frame's width is used.");
    }
    if (bed.walls_are_frame_sides)
      measurement.warnings.push_back("The bed goes on beyond the frame: the profile is that of the part in view.");
    bins.count = bins_up_to(options.highest.value_or(
        (bed.floor_px + std::max(0.0, bed.floor_slope * finder.width) + refined.radius_px) / diameter_px + 1));
  };

  // The frequency from the whole film.
  const auto tell_shaking = [&] {
    const double rate = *options.frame_rate_hz;
    in_film = refine_frequency(all_bottoms, in_film);
    const double frequency = bed_repeats_every * in_film.cycles_per_frame,
                 std_error = bed_repeats_every * in_film.std_error;
    char text[400];
    if (!bed.frequency_given) {
      bed.why_no_frequency = in_film.why_not;
      if (!in_film.known) return;
      turns_per_frame = frequency;
      bed.shaking_frequency_hz = frequency * rate;
      bed.shaking_frequency_std_error_hz = std_error * rate;
      bed.frequency_false_alarm = in_film.false_alarm;
      if (bed.floor_amplitude_px > 0) {  // its phase goes with the frequency
        const FloorMotion motion = find_floor_motion(first_bottoms, diameter_px, frequency);
        if (motion.known) bed.floor_amplitude_px = motion.amplitude, bed.floor_phase = motion.phase;
      }
      std::snprintf(text, sizeof text,
                    "The shaking's frequency was not given; the lowest beads move at %.6g +- %.2g Hz, taken for it. A "
                    "shaker faster than half the frame rate would look slower: %.6g Hz would look the same.",
                    bed.shaking_frequency_hz, bed.shaking_frequency_std_error_hz, rate - bed.shaking_frequency_hz);
      measurement.warnings.emplace_back(text);
      return;
    }
    bed.shaking_frequency_hz = *options.shaking_frequency_hz;
    if (!in_film.known || all_bottoms.empty()) return;
    // As the film shows them, and a bed may need several periods.
    const auto seen_as = [](double turns) { return std::abs(turns - std::round(turns)); };
    constexpr double doubted = 5, smeared = 0.1;  // standard errors; turns over the film
    const double length = static_cast<double>(all_bottoms.back().frame - all_bottoms.front().frame) + 1;
    double nearest = 1;
    for (const int periods : {1, 2, 3})
      nearest = std::min(nearest,
                         std::abs(seen_as(periods * in_film.cycles_per_frame) - seen_as(*turns_per_frame)) / periods);
    if (nearest < doubted * in_film.std_error || nearest * length < smeared) return;
    std::snprintf(
        text, sizeof text,
        "The lowest beads move at %.6g +- %.2g Hz, not at the %.6g Hz given, which are used all the same: are "
        "frequency and frame rate right?",
        in_film.cycles_per_frame * rate, in_film.std_error * rate, *options.shaking_frequency_hz);
    measurement.warnings.emplace_back(text);
  };

  // A frame's disks in heights, its densities.
  double highest = 0;
  std::vector<double> counts;
  std::size_t good = 0, cut_below = 0;
  FrameRows densities, second_densities, covered;
  constexpr std::size_t most_expected = 100000;
  const std::size_t expected_frames = std::min(most_expected, source.count_if_known().value_or(0));
  measurement.frames.reserve(expected_frames);
  std::vector<std::size_t> frame_of;
  std::vector<double> through_chord;  // what the centres say, seen through the bead as covered area sees it
  // Part of a bead's own contrast below a height (D) from its centre: a flat bead's is its chord's, a shaded one's is
  // not.
  const std::vector<double> rows_of_bead = contrast_by_row(finder);
  const double rows_middle = 0.5 * static_cast<double>(rows_of_bead.size() - 1);
  const auto part_below = [&](double t) {
    const double place = t * diameter_px / row_step_px + rows_middle;
    if (place <= 0) return 0.0;
    if (place >= static_cast<double>(rows_of_bead.size() - 1)) return 1.0;
    const auto cell = static_cast<std::size_t>(place);
    const double part = place - static_cast<double>(cell);
    return rows_of_bead[cell] * (1 - part) + rows_of_bead[cell + 1] * part;
  };
  const auto add_coverage = [&](const std::vector<float>& rows, const std::vector<double>& heights) {
    const double counted_width = options.left_wall_px && options.right_wall_px
                                     ? *options.right_wall_px - *options.left_wall_px
                                 : bed.walls_are_frame_sides ? frame_right - frame_left
                                                             : bed.right_wall_px - bed.left_wall_px;
    const double middle_floor = bed.floor_px + bed.floor_slope * 0.5 * finder.width;
    const double bead_reach = rows_middle * row_step_px / diameter_px;
    std::vector<double> area(bins.count, 0.0);
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const double upper = (middle_floor - static_cast<double>(row) + 0.5) / diameter_px;
      const double lower = upper - 1 / diameter_px;
      const double first = std::floor((lower - bins.lowest) / bins.width);
      for (double bin = std::max(0.0, first); bin < static_cast<double>(bins.count); ++bin) {
        const double bin_low = bins.lowest + bin * bins.width, bin_high = bin_low + bins.width;
        if (bin_low >= upper) break;
        const double overlap = std::min(upper, bin_high) - std::max(lower, bin_low);
        if (overlap > 0) area[static_cast<std::size_t>(bin)] += static_cast<double>(rows[row]) * overlap * diameter_px;
      }
    }
    // A bead's contrast stands for the area of the radius known by now.
    const double bead_area = std::pow(refined.radius_px / finder.radius_px, 2);
    for (double& value : area) value *= bead_area * 4 / std::numbers::pi / (bins.width * diameter_px * counted_width);
    covered.add(area, expected_frames);
    through_chord.resize(bins.count, 0.0);
    for (const double height : heights) {
      const double from = std::floor((height - bead_reach - bins.lowest) / bins.width) - 1;
      for (auto bin = static_cast<std::size_t>(std::max(0.0, from)); bin < bins.count; ++bin) {
        const double low = bins.lowest + static_cast<double>(bin) * bins.width - height;
        if (low > bead_reach) break;
        through_chord[bin] += (part_below(low + bins.width) - part_below(low)) / (bins.width * bed.width);
      }
    }
  };
  const auto place = [&](FrameFindings& frame) {
    const double cosine = std::cos(std::atan(bed.floor_slope));
    if (frame.report.status == FrameStatus::good || frame.report.status == FrameStatus::nothing_found) {
      ++good;
      counts.push_back(static_cast<double>(frame.disks.size()));
    }
    if (options.frame_rate_hz)
      if (const auto bottom = bottom_of(lowest_bottoms(frame, bed.floor_slope, diameter_px, finder.width)))
        all_bottoms.push_back(*bottom);
    std::vector<double> heights, second_heights;
    std::vector<MeasuredDisk> disks;
    const auto add = [&](const FoundDisk& disk, int species) {
      MeasuredDisk measured;
      measured.species = species;
      measured.frame = frame.report.index;
      const PixelPlace seen_at =
          lens.plain() ? PixelPlace{disk.x_px, disk.y_px} : lens_map.to_recorded({disk.x_px, disk.y_px});
      measured.x_px = seen_at.x;
      measured.y_px = seen_at.y;
      measured.radius_px = species == 1 ? refined.radius_px : disk.radius_px;
      measured.z = (bed.floor_px + bed.floor_slope * disk.x_px - disk.y_px) * cosine / diameter_px;
      measured.x = ((disk.x_px - bed.left_wall_px) * cosine +
                    (disk.y_px - bed.floor_px - bed.floor_slope * disk.x_px) * cosine * bed.floor_slope) /
                   diameter_px;
      measured.quality = disk.quality;
      measured.probability = disk.probability;
      measured.variance_x = disk.variance_x;
      measured.variance_y = disk.variance_y;
      measured.covariance_xy = disk.covariance_xy;
      measured.contrast = disk.contrast;
      measured.std_error_px = std::sqrt(std::max(0.0, 0.5 * (disk.variance_x + disk.variance_y)));
      measured.cut = disk.cut;
      measured.half_hidden = disk.half_hidden;
      disks.push_back(measured);
      const bool in_width = disk.x_px >= bed.left_wall_px && disk.x_px < bed.right_wall_px;
      if (in_width) (species == 1 ? heights : second_heights).push_back(measured.z);
      highest = std::max(highest, measured.z);
      cut_below += species == 1 && disk.cut && disk.y_px > finder.height - refined.radius_px;
    };
    for (const FoundDisk& disk : frame.disks) add(disk, 1);
    for (const FoundDisk& disk : frame.second) add(disk, 2);
    measurement.disk_total += disks.size();
    if (frame.report.status != FrameStatus::unreadable && frame.report.status != FrameStatus::size_changed) {
      densities.add(density_of_frame(heights, bed.width, bins, options.kernel), expected_frames);
      if (second)
        second_densities.add(density_of_frame(second_heights, bed.width, bins, options.kernel), expected_frames);
      frame_of.push_back(frame.report.index);
      if (options.profile_from_coverage) add_coverage(frame.coverage_of_row, heights);
    }
    if (options.disk_sink)
      options.disk_sink(frame.report, disks);
    else
      measurement.disks.insert(measurement.disks.end(), disks.begin(), disks.end());
    measurement.frames.push_back(std::move(frame.report));
    frame = FrameFindings();
  };
  bool geometry_known = false;
  const auto place_held = [&] {
    if (!geometry_known) settle_geometry();
    geometry_known = true;
    for (FrameFindings& frame : held) place(frame);
    held.clear();
  };

  // Frames are examined as threads come by them, and taken up in their order; nobody runs far ahead of the slowest.
  std::mutex source_mutex, result_mutex;
  std::condition_variable taken_up;
  std::map<std::size_t, FrameFindings> early;  // examined before one that precedes them
  std::size_t done = 0;                        // frames taken up, also the index of the next
  const std::size_t run_ahead = 2 * static_cast<std::size_t>(std::max(1U, options.threads));
  std::exception_ptr failure;
  const auto fail = [&] {
    const std::lock_guard<std::mutex> lock(result_mutex);
    if (!failure) failure = std::current_exception();
    taken_up.notify_all();
  };
  const auto work = [&] {
    try {
      for (;;) {
        std::optional<FrameSource::Item> item;
        {
          const std::lock_guard<std::mutex> lock(source_mutex);
          item = source.next_item();
        }
        if (!item) return;
        {
          std::unique_lock<std::mutex> lock(result_mutex);
          taken_up.wait(lock, [&] { return failure || item->index < done + run_ahead; });
          if (failure) return;
        }
        FrameFindings one =
            examine(*item, finder, second, options, lens_map, recorded_width, recorded_height, per_area);
        const std::lock_guard<std::mutex> lock(result_mutex);
        if (failure) return;
        early.emplace(one.report.index, std::move(one));
        for (auto next = early.find(done); next != early.end(); next = early.find(done)) {
          held.push_back(std::move(next->second));
          early.erase(next);
          measurement.most_frames_held = std::max(measurement.most_frames_held, held.size() + early.size());
          if (options.disk_sink && (geometry_known || held.size() >= std::max(options.geometry_frames, rim_frames)))
            place_held();
          ++done;
          if (options.progress) options.progress(done);
        }
        taken_up.notify_all();
      }
    } catch (...) {
      fail();
    }
  };
  if (options.threads <= 1) {
    work();
  } else {
    std::vector<std::thread> threads;
    for (unsigned k = 0; k < options.threads; ++k) threads.emplace_back(work);
    for (std::thread& thread : threads) thread.join();
  }
  if (failure) std::rethrow_exception(failure);
  place_held();
  measurement.finder.radius_px = refined.radius_px;
  measurement.finder.radius_std_error_px = refined.radius_std_error_px;
  if (options.frame_rate_hz) tell_shaking();

  // Profiles.
  bins.count = std::min(bins.count, bins_up_to(options.highest.value_or(highest + 1)));
  if (second) {
    measurement.second_profile =
        average_profile(second_densities.rows(bins.count), bins, options.kernel, bed.scale_relative_std_error);
    for (std::size_t bin = 0; bin < bins.count; ++bin)
      measurement.second_profile->area_fraction[bin] *=
          std::pow(second->radius_px / refined.radius_px, 2);  // of their own size
  }
  measurement.profile = average_profile(densities.rows(bins.count), bins, options.kernel, bed.scale_relative_std_error);

  if (options.profile_from_coverage) {
    through_chord.resize(bins.count, 0.0);
    for (double& value : through_chord) value /= static_cast<double>(std::max<std::size_t>(1, frame_of.size()));
    DensityProfile coverage =
        average_profile(covered.rows(bins.count), bins, {KernelKind::disk_chord, 1.0}, bed.scale_relative_std_error);
    double square = 0;
    std::size_t compared = 0;
    for (std::size_t bin = 0; bin < bins.count; ++bin) {
      if (through_chord[bin] < 0.1) continue;
      const double difference = through_chord[bin] - coverage.number_density[bin];
      square += difference * difference;
      ++compared;
    }
    measurement.coverage_disagreement = compared ? std::sqrt(square / static_cast<double>(compared)) : 0;
    if (measurement.coverage_disagreement > 0.03) {
      char text[200];
      std::snprintf(
          text, sizeof text,
          "Density from covered area differs from density from centres by %.3f in n D^2 (rms where it exceeds 0.1): "
          "beads of another kind, walls, dirt or missed beads.",
          measurement.coverage_disagreement);
      measurement.warnings.emplace_back(text);
    }
    measurement.coverage_profile = std::move(coverage);
  }

  if (turns_per_frame) {
    std::vector<std::vector<std::vector<double>>> by_phase(options.phase_bins);
    for (std::size_t k = 0; k < densities.size(); ++k) {
      const double turns = static_cast<double>(frame_of[k]) * *turns_per_frame;
      const double phase = turns - std::floor(turns);
      const auto bin = std::min(options.phase_bins - 1,
                                static_cast<std::size_t>((phase + 1e-9) * static_cast<double>(options.phase_bins)));
      by_phase[bin].push_back(densities.row(k, bins.count));
    }
    for (std::size_t bin = 0; bin < options.phase_bins; ++bin) {
      if (by_phase[bin].empty()) continue;
      PhaseProfile phase;
      phase.phase = (static_cast<double>(bin) + 0.5) / static_cast<double>(options.phase_bins);
      phase.profile = average_profile(by_phase[bin], bins, options.kernel, bed.scale_relative_std_error);
      measurement.phases.push_back(std::move(phase));
    }
  }

  double gain = 0, gain_squares = 0, lit = 0;
  for (const FrameReport& report : measurement.frames) {
    if (report.status != FrameStatus::good) continue;
    gain += report.light.gain, gain_squares += report.light.gain * report.light.gain, ++lit;
  }
  if (lit > 0) bed.flicker = std::sqrt(std::max(0.0, gain_squares / lit - gain / lit * gain / lit));
  constexpr double plain_to_see = 0.02;
  if (bed.flicker > plain_to_see) {
    char text[160];
    std::snprintf(
        text, sizeof text,
        "The light flickers: contrast varies by %.1f %% from frame to frame, which is taken out frame by frame.",
        100 * bed.flicker);
    measurement.warnings.emplace_back(text);
  }

  // Bead number against time, and what else deserves a word.
  for (const double count : counts) measurement.disk_count_mean += count / static_cast<double>(counts.size());
  for (const double count : counts)
    measurement.disk_count_std += (count - measurement.disk_count_mean) * (count - measurement.disk_count_mean);
  measurement.disk_count_std =
      counts.size() > 1 ? std::sqrt(measurement.disk_count_std / static_cast<double>(counts.size() - 1)) : 0;
  for (const std::string& warning : finder.warnings) measurement.warnings.push_back(warning);
  std::size_t bad = 0;
  for (const FrameReport& report : measurement.frames) bad += report.status != FrameStatus::good;
  if (bad) {
    std::string example;
    for (const FrameReport& report : measurement.frames)
      if (report.status != FrameStatus::good) {
        example = report.why;
        break;
      }
    measurement.warnings.push_back(std::to_string(bad) + " of " + std::to_string(measurement.frames.size()) +
                                   " frames gave nothing; the first: " + example);
  }
  if (measurement.disk_count_mean > 0 && measurement.disk_count_std > 0.01 * measurement.disk_count_mean) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "The number of disks found varies by %.1f from frame to frame around %.1f: beads leave the view, or "
                  "are missed.",
                  measurement.disk_count_std, measurement.disk_count_mean);
    measurement.warnings.emplace_back(text);
  }
  if (good > 0 && cut_below > good && !bed.floor_given)
    measurement.warnings.push_back("Beads are cut by the lower border of the frame: the floor is not in view.");
  if (std::abs(bed.floor_tilt_degrees) > 0.5) {
    char text[160];
    std::snprintf(text, sizeof text, "The floor is tilted by %.2f +- %.2f degrees; heights are measured across it.",
                  bed.floor_tilt_degrees, bed.floor_tilt_std_error_degrees);
    measurement.warnings.emplace_back(text);
  }
  return measurement;
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
    std::snprintf(line, sizeof line, "%zu,%.4f,%.4f,%.5f,%.5f,%.4f,%.4f,%d,%d,%d\n", disk.frame, disk.x_px, disk.y_px,
                  x, y, x * y > 0 ? disk.covariance_xy / (x * y) : 0.0, disk.contrast, disk.cut ? 1 : 0,
                  disk.half_hidden ? 1 : 0, disk.species);
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
