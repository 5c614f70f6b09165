#include "ingest/profile/photographs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/rim_shape.hpp"
#include "ingest/frames/background_level.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/candidate_picture.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// px, radius in a reduced frame. Of a photograph with 190 photoelastic disks of two sizes, rims show 64 at 12 px, 176
// at 16 px and 210 at 24 px (sums of probabilities; disks cut by the border included).
constexpr double enough_radius_px = 12, enough_for_rims_px = 24;
// px: of wider beads in a smaller frame. Two coins of 340 px were searched for 33 s; the centre of a rim of 100 px is
// known to far less than a hundredth of its radius.
constexpr double wide_radius_px = 100;
constexpr double most_wrong = 0.2, most_missed = 0.4, share_worth_a_word = 0.02;  // shares that may be wrong, or missed
constexpr double levels_16_bit = 65535.0 / 255.0;

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

const std::byte* row_of(const ImageView& image, int row) {
  const std::size_t next =
      image.row_bytes > 0 ? image.row_bytes : static_cast<std::size_t>(image.width) * pixel_bytes(image.type);
  return static_cast<const std::byte*>(image.pixels) + static_cast<std::size_t>(row) * next;
}

template <class Level>
Level level_at(const std::byte* row, int column) {
  Level level;
  std::memcpy(&level, row + static_cast<std::size_t>(column) * sizeof(Level), sizeof(Level));
  return level;
}

template <class Level>
void copy_image(const ImageView& image, double scale, float* out) {
  for (int row = 0; row < image.height; ++row) {
    const std::byte* from = row_of(image, row);
    for (int column = 0; column < image.width; ++column)
      *out++ = static_cast<float>(static_cast<double>(level_at<Level>(from, column)) * scale);
  }
}

template <class Level>
bool all_finite(const ImageView& image) {
  for (int row = 0; row < image.height; ++row) {
    const std::byte* from = row_of(image, row);
    for (int column = 0; column < image.width; ++column)
      if (!std::isfinite(static_cast<float>(level_at<Level>(from, column)))) return false;
  }
  return true;
}

// Why the image cannot be measured; nothing when it can.
const char* unusable(const ImageView& image) {
  if (image.width <= 0 || image.height <= 0 || image.pixels == nullptr) return "the image is empty";
  const bool finite = image.type == PixelType::f32   ? all_finite<float>(image)
                      : image.type == PixelType::f64 ? all_finite<double>(image)
                                                     : true;
  return finite ? nullptr : "the image contains levels that are not finite numbers; replace them";
}

SurveyOptions survey_options(const FindOptions& options) {
  return {.polarity = options.polarity, .radius_px = options.radius_px, .roi = options.roi};
}

double aspect_assumed(const MeasureOptions& options) {
  return options.pixel_aspect.value_or(options.first_pixel_aspect);
}

// The frame lends its levels to the survey and has them back afterwards.
Survey survey_of(GrayFrame& frame, const FindOptions& options, double pixel_aspect = 1) {
  ChannelFrames frames;
  frames.width = frame.width;
  frames.height = frame.height;
  frames.channels.push_back({Channel::automatic, std::move(frame)});
  ChannelFrames square;
  if (pixel_aspect != 1) square = frames;
  Survey survey = survey_with_square_pixels(pixel_aspect == 1 ? frames : square, survey_options(options), pixel_aspect);
  frame = std::move(frames.channels.front().frame);
  return survey;
}

void warn_of_part(const std::optional<PixelRectangle>& region, std::vector<std::string>& warnings) {
  if (region) warnings.insert(warnings.begin(), why_only_a_part(*region));
}

// Of the scale given, if any, to the beads seen.
std::string scale_objection(const MeasureOptions& measure) {
  if (!measure.scale_m_per_px) return {};
  return why_not_scale(measure.bead_diameter_m, *measure.scale_m_per_px, measure.find.seen->radius_px);
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
  if (!options.disk_sink)
    options.disk_sink = [&](const FrameReport&, const std::vector<MeasuredDisk>& disks) {
      kept.insert(kept.end(), disks.begin(), disks.end());
    };
  out.measurement = measure_bed(source, options);
  out.measurement.disks = std::move(kept);
  const std::vector<std::string> doubts = doubts_of_bed(out.measurement, options.bead_diameter_m);
  out.measurement.warnings.insert(out.measurement.warnings.begin(), doubts.begin(), doubts.end());
  out.status = FindStatus::ok;
  const auto judge = [&](Doubt doubt, const char* words, double share) {
    if (doubt == Doubt::little) return;
    const std::string warning = formatted(words, 100 * share);
    if (doubt == Doubt::too_many) out.status = FindStatus::doubtful, out.message = warning;
    out.measurement.warnings.insert(out.measurement.warnings.begin(), warning);
  };
  const double missed = out.measurement.finder.expected_missed, wrong = out.measurement.expected_wrong;
  judge(doubt_of_missed(missed, wrong),
        "%.0f %% of the beads may be missed: look at the picture before you use the numbers", missed);
  judge(doubt_of(wrong), "%.1f %% of the disks found may be wrong: look at them before you use the numbers", wrong);
  const double diameter_px = options.bead_diameter_m / out.measurement.calibration.scale_m_per_px;
  if (out.measurement.contacts.far_apart(diameter_px)) {
    out.status = FindStatus::doubtful;
    out.message = doubts.front();
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

GrayFrame frame_of(const ImageView& image) {
  if (const char* why = unusable(image)) throw std::invalid_argument(why);
  GrayFrame frame{image.width, image.height, {}};
  frame.pixels.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  float* out = frame.pixels.data();
  switch (image.type) {
    case PixelType::u8:
      copy_image<std::uint8_t>(image, 1, out);
      break;
    case PixelType::u16:
      copy_image<std::uint16_t>(image, 1 / levels_16_bit, out);
      break;
    case PixelType::f32:
      copy_image<float>(image, 1, out);
      break;
    case PixelType::f64:
      copy_image<double>(image, 1, out);
      break;
  }
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

std::optional<FindOptions> search_after_survey(const MeasureOptions& measure) {
  if (measure.scale_m_per_px || measure.second_diameter_m || measure.pixel_aspect || measure.lens_radial)
    return std::nullopt;
  return measure.find;
}

Survey survey_with_square_pixels(ChannelFrames& frames, SurveyOptions options, double pixel_aspect) {
  if (pixel_aspect == 1) return take_survey(frames, options);
  frames.width = static_cast<int>(std::lround(frames.width * pixel_aspect));
  for (ChannelFrames::One& one : frames.channels) {
    const double enlargement = one.frame.enlargement;
    one.frame = LensMap({pixel_aspect, 0}, one.frame.width, one.frame.height).corrected(one.frame);
    one.frame.enlargement = enlargement;
  }
  if (options.roi) options.roi = widened(*options.roi, pixel_aspect);
  options.search.reset();  // the search makes pixels square by itself
  Survey survey = take_survey(frames, options);
  for (SurveyCandidate& candidate : survey.candidates)
    if (candidate.region) candidate.region = widened(*candidate.region, 1 / pixel_aspect);
  return survey;
}

std::optional<FirstLook> look_at_first(const std::vector<FrameOrigin>& pictures, const SurveyOptions& options,
                                       const FrameSourceOptions& source, double pixel_aspect) {
  for (std::size_t k = 0; k < std::min(pictures.size(), most_tried); ++k) {
    try {
      ChannelFrames frames = read_channels(pictures[k].path, pictures[k].page, surveyed_pixels, source);
      const PictureThreads threads(threads_for(frames.width, frames.height));
      Survey survey = survey_with_square_pixels(frames, options, pixel_aspect);
      FirstLook look{.path = pictures[k].path,
                     .width = frames.width,
                     .height = frames.height,
                     .survey = std::move(survey),
                     .picture = nullptr,
                     .page = pictures[k].page,
                     .pixel_aspect = pixel_aspect};
      if (source.channel == Channel::automatic) look.picture = std::make_shared<const CandidatePictures>(frames);
      return look;
    } catch (const InputError&) {
      continue;  // measure_bed() names the files that cannot be read
    }
  }
  return std::nullopt;
}

std::optional<double> aspect_by_outlines(const FirstLook& look) {
  constexpr double most_pixels = 2e7;
  const SurveyCandidate& best = look.survey.candidates.front();
  if (best.channel == Channel::grey_distance || static_cast<double>(look.width) * look.height > most_pixels)
    return std::nullopt;
  try {
    FrameSourceOptions source;
    source.channel = best.channel;
    GrayFrame frame = read_frame(look.path, look.page, source);
    if (look.pixel_aspect != 1) frame = LensMap({look.pixel_aspect, 0}, frame.width, frame.height).corrected(frame);
    std::vector<Circle> circles;
    for (const RimDisk& disk : best.disks) circles.push_back(disk.circle);
    PictureMaps maps(frame, best.rims.search.wanted_px);
    return look.pixel_aspect / axes_of(shared_second(shapes_of_rims(maps, best.rims, circles, circles)));
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::string why_not_scale(double bead_diameter_m, double scale_m_per_px, double radius_px) {
  constexpr double most = 3;
  const double given = bead_diameter_m / scale_m_per_px, seen = 2 * radius_px;
  if (given <= most * seen && seen <= most * given) return {};
  return formatted(
      "with the length of a pixel given (scale), a bead of %g mm is %.3g px wide, but the circles found are %.3g px "
      "wide. If they are the beads, a pixel is about %.3g mm. Check the unit of scale and the diameter, or leave scale "
      "out: it is then found",
      1e3 * bead_diameter_m, given, seen, 1e3 * bead_diameter_m / seen);
}

void look_for(const SurveyCandidate& best, FindOptions& find) {
  find.seen = BeadsSeen{best.rims.polarity, best.rims.radius_px, best.one_sided, best.no_faces, best.thorough};
  find.distances = best.channel == Channel::grey_distance;
  if (!find.roi) find.roi = best.region;
}

int reduction_for(int width, int height, double radius_px, bool by_rims) {
  const double pixels = static_cast<double>(width) * height;
  if (pixels <= large_frame_pixels) return std::max(1, static_cast<int>(radius_px / wide_radius_px));
  const std::size_t most_pixels = FrameSourceOptions().largest_frame_pixels;
  const auto by_pixels = [&](std::size_t most) {
    return static_cast<int>(std::ceil(std::sqrt(pixels / static_cast<double>(most))));
  };
  int by = std::max(1, static_cast<int>(radius_px / (by_rims ? enough_for_rims_px : enough_radius_px)));
  if (!by_rims) by = std::max(by, std::min(static_cast<int>(radius_px / trial_radius_px), by_pixels(surveyed_pixels)));
  return std::max(by, by_pixels(most_pixels));
}

int reduction_after(const FirstLook& look, const SurveyCandidate& chosen) {
  if (chosen.searched) return chosen.searched->reduction();
  return reduction_for(look.width, look.height, chosen.rims.radius_px, chosen.by_rims);
}

std::string why_reduced(int width, int height, int reduction) {
  if (static_cast<double>(width) * height <= static_cast<double>(FrameSourceOptions().largest_frame_pixels)) return {};
  return formatted(
      "The picture has %d x %d px. It was averaged over squares of %d x %d px to limit the memory used. All lengths in "
      "pixels refer to the original picture.",
      width, height, reduction, reduction);
}

std::string why_only_a_part(const PixelRectangle& part, double recorded_px) {
  return formatted(
      "Only a part of the picture shows beads, from column %.0f to %.0f and from row %.0f to %.0f. The rest shows "
      "something else and was left out. If it contains beads, give the region of all beads (--roi).",
      part.left * recorded_px, (part.left + part.width) * recorded_px, part.top * recorded_px,
      (part.top + part.height) * recorded_px);
}

Doubt doubt_of(double expected_wrong) {
  if (expected_wrong > most_wrong) return Doubt::too_many;
  return expected_wrong > share_worth_a_word ? Doubt::some : Doubt::little;
}

Doubt doubt_of_missed(double expected_missed, double expected_wrong) {
  // The harmonic mean of the shares of beads found and of disks that are beads (F1 score).
  const auto right = [](double missed, double wrong) { return 2 / (1 / (1 - missed) + 1 / (1 - wrong)); };
  if (right(expected_missed, expected_wrong) < right(most_missed, 0)) return Doubt::too_many;
  return expected_missed > share_worth_a_word ? Doubt::some : Doubt::little;
}

DisksFound find_disks(const ImageView& image, const FindOptions& options) {
  DisksFound out;
  if (const auto problems = options.validate(); !problems.empty()) {
    out.message = problems.front();
    return out;
  }
  GrayFrame frame;
  try {
    frame = frame_of(image);
  } catch (const std::invalid_argument& error) {
    out.message = error.what();
    return out;
  }
  out.status = FindStatus::no_beads;
  FindOptions find = options;
  std::optional<PixelRectangle> region;
  if (!find.seen) {
    const Survey survey = survey_of(frame, options);
    out.message = survey.why_not;
    if (!survey.found) return out;
    look_for(survey.candidates.front(), find);
    region = survey.candidates.front().region;
    if (survey.candidates.front().channel == Channel::grey_distance) frame = BackgroundLevel(frame).distance_of(frame);
  }
  CalibrationResult learned = learn_beads({&frame}, find);
  out.message = learned.why_not;
  if (!learned.found) return out;
  tell_radius(learned);
  out.calibration = std::move(learned.calibration);
  FindResult found = find_beads(frame, out.calibration, find);
  learn_other_shade(frame, find, out.calibration, found);
  out.message = found.why_nothing;
  if (found.empty()) return out;
  out.status = FindStatus::ok;
  out.disks = std::move(found.disks);
  out.expected_wrong = wrong_share(out.disks);
  std::vector<std::string>& warnings = out.calibration.warnings;
  if (const double missed = out.calibration.expected_missed; doubt_of_missed(missed) != Doubt::little)
    warnings.insert(warnings.begin(), formatted("%.0f %% of the beads may be missed", 100 * missed));
  if (doubt_of(out.expected_wrong) != Doubt::little)
    warnings.insert(warnings.begin(), formatted("%.1f %% of the disks found may be wrong", 100 * out.expected_wrong));
  warn_of_part(region, warnings);
  return out;
}

BedFound measure_bed(const std::vector<std::string>& paths, const MeasureOptions& options,
                     const FrameSourceOptions& source_options) {
  if (const auto problems = options.validate(); !problems.empty())
    return refused(FindStatus::bad_input, problems.front());
  MeasureOptions measure = options;
  const PictureThreads threads(static_cast<int>(measure.threads));
  FrameSourceOptions source = source_options;
  std::string reduced_why;
  std::optional<PixelRectangle> region;
  if (!measure.find.seen) {
    FrameSource names = FrameSource::open(paths, source);
    SurveyOptions asked = survey_options(options.find);
    asked.search = search_after_survey(options);
    const std::vector<FrameOrigin> pictures = names.first_origins(most_tried);
    if (measure.first_pixel_aspect == 1 && !pictures.empty())
      measure.first_pixel_aspect = stated_pixel_aspect(pictures.front().path);
    const auto look = look_at_first(pictures, asked, source, aspect_assumed(measure));
    if (look && !look->survey.found)
      return refused(FindStatus::no_beads, look->path + ": no beads: " + look->survey.why_not);
    if (look) {
      look_for(look->survey.candidates.front(), measure.find);
      region = look->survey.candidates.front().region;
      if (const std::string why = scale_objection(measure); !why.empty())
        return refused(FindStatus::bad_input, look->path + ": " + why);
      source.channel = look->survey.candidates.front().channel;
      source.reduction = measure.reduction = reduction_after(*look, look->survey.candidates.front());
      measure.searched = look->survey.candidates.front().searched;
      reduced_why = why_reduced(look->width, look->height, source.reduction);
    }
  }
  FrameSource frames = FrameSource::open(paths, source);
  if (!measure.frame_rate_hz) measure.frame_rate_hz = frames.film_rate_hz();
  BedFound found = measured(frames, std::move(measure));
  if (!reduced_why.empty()) found.measurement.warnings.push_back(reduced_why);
  warn_of_part(region, found.measurement.warnings);
  return found;
}

BedFound measure_bed(const std::vector<ImageView>& images, const MeasureOptions& options) {
  if (images.empty()) return refused(FindStatus::bad_input, "no images were given; give at least one");
  if (const auto problems = options.validate(); !problems.empty())
    return refused(FindStatus::bad_input, problems.front());
  for (std::size_t k = 0; k < images.size(); ++k)
    if (const char* why = unusable(images[k]))
      return refused(FindStatus::bad_input, formatted("frame %zu: %s", k, why));
  MeasureOptions measure = options;
  std::optional<PixelRectangle> region;
  std::optional<BackgroundLevel> background;  // where the distance from it is searched
  if (!measure.find.seen) {
    GrayFrame first = frame_of(images.front());
    const Survey survey = survey_of(first, options.find, aspect_assumed(measure));
    if (!survey.found) return refused(FindStatus::no_beads, "no beads: " + survey.why_not);
    look_for(survey.candidates.front(), measure.find);
    region = survey.candidates.front().region;
    if (const std::string why = scale_objection(measure); !why.empty()) return refused(FindStatus::bad_input, why);
    if (survey.candidates.front().channel == Channel::grey_distance) background.emplace(first);
  }
  FrameSource source = FrameSource::from_generator(images.size(), [&](std::size_t index) {
    GrayFrame frame = frame_of(images[index]);
    return background ? background->distance_of(frame) : std::move(frame);
  });
  BedFound found = measured(source, std::move(measure));
  warn_of_part(region, found.measurement.warnings);
  return found;
}

std::string DisksFound::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  return formatted("%zu %s disks of radius %.3f +- %.3f px", disks.size(),
                   calibration.polarity == Polarity::bright_beads ? "bright" : "dark", calibration.radius_px,
                   calibration.radius_std_error_px);
}

std::string DisksFound::full() const {
  if (!ok()) return brief() + "\n";
  std::string out = brief() + "\n";
  out += formatted("edge width       %.3g px\n", calibration.edge_width_px);
  out += formatted("noise            %.3g grey levels\n", calibration.noise_level);
  out += formatted("contrast         %.4g grey levels\n", calibration.contrast_level);
  out += formatted("expected wrong   %.2g %% of the disks\n", 100 * expected_wrong);
  out += formatted("expected missed  %.2g %% of the beads\n", 100 * calibration.expected_missed);
  for (const std::string& warning : calibration.warnings) out += "warning          " + warning + "\n";
  return out;
}

std::string BedFound::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  return formatted("%zu disks in %zu frames (%.2f a frame), radius %.3f px, width %.2f D", measurement.disk_total,
                   measurement.frames.size(), measurement.disk_count_mean, measurement.calibration.radius_px,
                   measurement.calibration.width);
}

std::string BedFound::full() const {
  if (!ok()) return brief() + "\n";
  const BedCalibration& calibration = measurement.calibration;
  std::string out = brief() + "\n";
  out += formatted("scale            %.6g mm/px\n", 1e3 * calibration.scale_m_per_px);
  out += formatted("floor            row %.2f px, tilted by %.3g degrees\n", calibration.floor_px,
                   calibration.floor_tilt_degrees);
  out += formatted("walls            columns %.2f and %.2f px\n", calibration.left_wall_px, calibration.right_wall_px);
  out += formatted("profile          %zu heights, %zu independent frames\n", measurement.profile.number_density.size(),
                   measurement.profile.independent_samples);
  for (const std::string& warning : measurement.warnings) out += "warning          " + warning + "\n";
  return out;
}

}  // namespace shakebed::ingest
