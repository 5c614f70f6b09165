#include "ingest/profile/photographs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "ingest/find/learn_beads.hpp"

namespace shakebed::ingest {

namespace {

// Large frames are averaged down to a radius of 12 to 24 px, as the stage `extract` does (pipelines/stages). [px,
// pixels]
constexpr double enough_radius_px = 12, large_frame_pixels = 2e6;
constexpr std::size_t most_surveyed_pixels = 6'000'000;
constexpr std::size_t most_tried = 10;  // files that are tried for a first frame that can be read
// Shares of disks that may be wrong: above the first nothing is measured, above the second there is a warning, as in
// the stage `extract`.
constexpr double most_wrong = 0.2, worth_a_word = 0.02;
constexpr double levels_16_bit = 65535.0 / 255.0;

std::string text_of(const char* format, ...) {
  char buffer[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

template <class Level>
void copy_row(const std::byte* row, int width, double scale, float* out) {
  for (int column = 0; column < width; ++column) {
    Level level;
    std::memcpy(&level, row + static_cast<std::size_t>(column) * sizeof(Level), sizeof(Level));
    out[column] = static_cast<float>(static_cast<double>(level) * scale);
  }
}

std::size_t pixel_bytes(PixelType type) {
  switch (type) {
    case PixelType::u8:
      return 1;
    case PixelType::u16:
      return 2;
    case PixelType::f32:
      return 4;
    case PixelType::f64:
      return 8;
  }
  return 0;
}

ChannelFrames as_channels(const GrayFrame& frame) {
  ChannelFrames frames;
  frames.width = frame.width;
  frames.height = frame.height;
  frames.channels.push_back({Channel::automatic, frame});
  return frames;
}

double wrong_share(const std::vector<FoundDisk>& disks) {
  double wrong = 0;
  for (const FoundDisk& disk : disks) wrong += 1 - disk.probability;
  return disks.empty() ? 0 : wrong / static_cast<double>(disks.size());
}

// Measures with the disks kept, and judges them.
BedFound measured(FrameSource& source, MeasureOptions options) {
  BedFound out;
  std::vector<MeasuredDisk> kept;
  double wrong = 0;
  options.disk_sink = [&, sink = options.disk_sink](const FrameReport& frame, const std::vector<MeasuredDisk>& disks) {
    for (const MeasuredDisk& disk : disks) wrong += 1 - disk.probability;
    if (sink) return sink(frame, disks);
    kept.insert(kept.end(), disks.begin(), disks.end());
  };
  out.measurement = measure_bed(source, options);
  out.measurement.disks = std::move(kept);
  const std::size_t total = out.measurement.disk_total;
  out.expected_wrong = total > 0 ? wrong / static_cast<double>(total) : 0;
  out.status = out.expected_wrong > most_wrong ? FindStatus::doubtful : FindStatus::ok;
  if (out.expected_wrong > worth_a_word) {
    const std::string warning = text_of(
        "%.1f %% of the disks found may be wrong: look at them before the numbers are used", 100 * out.expected_wrong);
    if (!out.ok()) out.message = warning;
    out.measurement.warnings.insert(out.measurement.warnings.begin(), warning);
  }
  return out;
}

BedFound refused(FindStatus status, std::string message) {
  BedFound out;
  out.status = status;
  out.message = std::move(message);
  return out;
}

}  // namespace

std::vector<std::string> validate(const MeasureOptions& options) {
  std::vector<std::string> problems;
  if (!(options.bead_diameter_m > 0) || !std::isfinite(options.bead_diameter_m))
    problems.push_back(
        text_of("bead_diameter_m is %g; the diameter of a bead is needed, in m", options.bead_diameter_m));
  if (!(options.bin_width > 0) || !std::isfinite(options.bin_width))
    problems.push_back(text_of("bin_width is %g; it must be above 0", options.bin_width));
  if (!kernel_is_valid(options.kernel) || options.kernel.kind == KernelKind::none)
    problems.emplace_back("the kernel must have a shape and a finite width: density is measured through a window");
  return problems;
}

GrayFrame frame_of(const ImageView& image) {
  if (image.width <= 0 || image.height <= 0 || image.pixels == nullptr)
    throw std::invalid_argument("the image is empty");
  GrayFrame frame{image.width, image.height, {}};
  const auto width = static_cast<std::size_t>(image.width);
  frame.pixels.resize(width * static_cast<std::size_t>(image.height));
  const std::size_t step = image.row_bytes > 0 ? image.row_bytes : width * pixel_bytes(image.type);
  for (int row = 0; row < image.height; ++row) {
    const std::byte* from = static_cast<const std::byte*>(image.pixels) + static_cast<std::size_t>(row) * step;
    float* to = frame.pixels.data() + static_cast<std::size_t>(row) * width;
    switch (image.type) {
      case PixelType::u8:
        copy_row<std::uint8_t>(from, image.width, 1, to);
        break;
      case PixelType::u16:
        copy_row<std::uint16_t>(from, image.width, 1 / levels_16_bit, to);
        break;
      case PixelType::f32:
        copy_row<float>(from, image.width, 1, to);
        break;
      case PixelType::f64:
        copy_row<double>(from, image.width, 1, to);
        break;
    }
  }
  if (!std::all_of(frame.pixels.begin(), frame.pixels.end(), [](float level) { return std::isfinite(level); }))
    throw std::invalid_argument("the image holds levels that are not finite numbers");
  return frame;
}

std::string_view to_string(FindStatus status) {
  switch (status) {
    case FindStatus::ok:
      return "ok";
    case FindStatus::no_beads:
      return "no beads";
    case FindStatus::doubtful:
      return "doubtful";
    case FindStatus::bad_input:
      return "bad input";
  }
  return "";
}

FirstSurvey survey_first(const ChannelFrames& first, const FindOptions& options) {
  FirstSurvey out;
  if (options.seen) {
    out.found = true;
    out.seen = *options.seen;
    return out;
  }
  const Survey survey =
      take_survey(first, {.polarity = options.polarity, .radius_px = options.radius_px, .roi = options.roi});
  out.found = survey.found;
  out.why_not = survey.why_not;
  if (!survey.found) return out;
  const SurveyCandidate& best = survey.candidates.front();
  out.channel = best.channel;
  out.seen = {best.rims.polarity, best.rims.radius_px};
  if (static_cast<double>(first.width) * first.height > large_frame_pixels)
    out.reduction = std::max(1, static_cast<int>(best.rims.radius_px / enough_radius_px));
  return out;
}

DisksFound find_disks(const ImageView& image, const FindOptions& options) {
  DisksFound out;
  GrayFrame frame;
  try {
    frame = frame_of(image);
  } catch (const std::invalid_argument& error) {
    out.message = error.what();
    return out;
  }
  const FirstSurvey first = survey_first(as_channels(frame), options);
  out.status = FindStatus::no_beads;
  out.message = first.why_not;
  if (!first.found) return out;
  FindOptions find = options;
  find.seen = first.seen;
  CalibrationResult learned = learn_beads({&frame}, find);
  out.message = learned.why_not;
  if (!learned.found) return out;
  tell_radius(learned);
  out.calibration = std::move(learned.calibration);
  FindResult found = find_beads(frame, out.calibration, find);
  out.message = found.why_nothing;
  if (found.empty()) return out;
  out.status = FindStatus::ok;
  out.disks = std::move(found.disks);
  out.expected_wrong = wrong_share(out.disks);
  return out;
}

BedFound measure_bed(const std::vector<std::string>& paths, const MeasureOptions& options,
                     const FrameSourceOptions& source_options) {
  if (const auto problems = validate(options); !problems.empty())
    return refused(FindStatus::bad_input, problems.front());
  MeasureOptions measure = options;
  FrameSourceOptions source = source_options;
  FrameSource names = FrameSource::open(paths, source);
  for (std::size_t k = 0; k < most_tried; ++k) {
    const auto item = names.next_item();
    if (!item) break;
    ChannelFrames first;
    try {
      first = read_channels(item->origin.path, item->origin.page, most_surveyed_pixels, source);
    } catch (const InputError&) {
      continue;  // measure_bed() below names the files that cannot be read
    }
    const FirstSurvey survey = survey_first(first, options.find);
    if (!survey.found) return refused(FindStatus::no_beads, item->origin.path + ": no beads: " + survey.why_not);
    if (!options.find.seen) source.channel = survey.channel;
    measure.find.seen = survey.seen;
    source.reduction = measure.reduction = survey.reduction;
    break;
  }
  FrameSource frames = FrameSource::open(paths, source);
  if (!measure.frame_rate_hz) measure.frame_rate_hz = frames.film_rate_hz();
  return measured(frames, std::move(measure));
}

BedFound measure_bed(std::vector<GrayFrame> frames, const MeasureOptions& options) {
  if (frames.empty()) return refused(FindStatus::bad_input, "there are no frames");
  if (const auto problems = validate(options); !problems.empty())
    return refused(FindStatus::bad_input, problems.front());
  const FirstSurvey survey = survey_first(as_channels(frames.front()), options.find);
  if (!survey.found) return refused(FindStatus::no_beads, "no beads: " + survey.why_not);
  MeasureOptions measure = options;
  measure.find.seen = survey.seen;
  FrameSource source = FrameSource::from_frames(std::move(frames));
  return measured(source, std::move(measure));
}

std::string DisksFound::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  return text_of("%zu %s disks of radius %.3f +- %.3f px", disks.size(),
                 calibration.polarity == Polarity::bright_beads ? "bright" : "dark", calibration.radius_px,
                 calibration.radius_std_error_px);
}

std::string DisksFound::full() const {
  if (!ok()) return brief() + "\n";
  std::string out = brief() + "\n";
  out += text_of("edge width       %.3g px\n", calibration.edge_width_px);
  out += text_of("noise            %.3g grey levels\n", calibration.noise_level);
  out += text_of("contrast         %.4g grey levels\n", calibration.contrast_level);
  out += text_of("expected wrong   %.2g %% of the disks\n", 100 * expected_wrong);
  for (const std::string& warning : calibration.warnings) out += "warning          " + warning + "\n";
  return out;
}

std::string BedFound::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  return text_of("%zu disks in %zu frames (%.2f a frame), radius %.3f px, width %.2f D", measurement.disk_total,
                 measurement.frames.size(), measurement.disk_count_mean, measurement.calibration.radius_px,
                 measurement.calibration.width);
}

std::string BedFound::full() const {
  if (!ok()) return brief() + "\n";
  const BedCalibration& calibration = measurement.calibration;
  std::string out = brief() + "\n";
  out += text_of("scale            %.6g mm/px\n", 1e3 * calibration.scale_m_per_px);
  out += text_of("floor            row %.2f px, tilted by %.3g degrees\n", calibration.floor_px,
                 calibration.floor_tilt_degrees);
  out += text_of("walls            columns %.2f and %.2f px\n", calibration.left_wall_px, calibration.right_wall_px);
  out += text_of("profile          %zu heights, %zu independent frames\n", measurement.profile.number_density.size(),
                 measurement.profile.independent_samples);
  for (const std::string& warning : measurement.warnings) out += "warning          " + warning + "\n";
  return out;
}

}  // namespace shakebed::ingest
