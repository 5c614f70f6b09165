#include "pipelines/stages/extract_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>

#include "ingest/frames/png_text.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/overlay.hpp"
#include "ingest/profile/photographs.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/stages/disks_on_the_way.hpp"
#include "pipelines/stages/extract_files.hpp"
#include "pipelines/stages/film.hpp"
#include "pipelines/stages/preview.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_bad_frames_named = 5;
constexpr double most_off_scale = 0.1;  // of a scale and a diameter that are both given, by the radius found

namespace fs = std::filesystem;

// Where the pictures of a refusal stay: beside the folders of the stages, since this stage leaves none.
fs::path refusal_folder(const RunContext& context) { return context.output_directory().parent_path() / "no-beads"; }

// Says what the first frame shows instead of beads.
[[noreturn]] void refuse(const ExtractOptions& options, RunContext& context, const FirstLook& look,
                         const std::vector<std::string>& paths) {
  const ingest::Survey& survey = look.survey;
  const fs::path folder = refusal_folder(context);
  fs::create_directories(folder);
  write_preview(folder, look, options.images.texts, options);
  std::string message =
      fmt::format("{}: no beads: {}. See {}", look.path, survey.why_not, (folder / "preview.html").string());
  if (const std::string without = seen_without_options(paths, options); !without.empty())
    throw StageError(message + ". " + without);
  const std::vector<std::string> proposals = proposed_options(survey);
  message +=
      proposals.empty()
          ? ". No circles stand out, so no radius can be proposed. The program needs sharp photographs of round beads, "
            "taken from the side. Each bead must be at least 10 pixels wide and brighter or darker than the "
            "background. "
            "If this is such a photograph, give the region of the beads (--roi) and their radius in pixels (--radius)"
          : fmt::format(
                ". If one of the pictures in preview.html marks your beads, limit the search to them with --roi, or "
                "give {}",
                fmt::join(proposals, " or "));
  throw StageError(message);
}

// The most credible beads; where their number is given, of what may be beads, the kind that is as numerous.
const ingest::SurveyCandidate& chosen_of(const ingest::Survey& survey, const ExtractOptions& options) {
  const ingest::SurveyCandidate* chosen = &survey.candidates.front();
  if (options.bead_number) {  // of what may be beads, the kind whose number is nearest to the one given
    const auto off = [&](const ingest::SurveyCandidate& one) {
      return std::abs(std::log(static_cast<double>(std::max<std::size_t>(1, one.disks.size())) /
                               static_cast<double>(*options.bead_number)));
    };
    constexpr double clearly = 0.1;
    for (const ingest::SurveyCandidate& other : survey.candidates)
      if (other.credible && off(other) + clearly < off(*chosen)) chosen = &other;
  }
  return *chosen;
}

// The beads the first frame shows: channel, radius and polarity to go on with. Refuses when it shows none. Whether
// their outlines are those of disks.
bool use_first_look(const ExtractOptions& options, RunContext& context, FilmFiles& film,
                    ingest::MeasureOptions& measure) {
  const std::optional<FirstLook> look = look_at_first(film.paths, options);
  std::error_code error;
  fs::remove_all(refusal_folder(context), error);
  if (!look) return true;  // measure_bed() says which files cannot be read
  if (!look->survey.found) refuse(options, context, *look, film.paths);
  const ingest::SurveyCandidate* chosen = &chosen_of(look->survey, options);
  if (options.scale)
    if (const std::string why = ingest::why_not_scale(options.diameter, *options.scale, chosen->rims.radius_px);
        !why.empty())
      throw StageError(fmt::format("{}: {}", look->path, why));
  if (chosen->not_round)
    context.warning(fmt::format(
        "{}: the outlines are not those of disks ({}). They are measured because shape is \"any\". If these are your "
        "beads, their positions are valid, but radii and densities are not: these hold for disks only",
        look->path, chosen->why_not_round));
  if (!chosen->why_drawn.empty())
    context.warning(
        fmt::format("{}: {}. The circles are measured because shape is \"any\".", look->path, chosen->why_drawn));
  ingest::FrameSourceOptions& source = film.source;
  source.channel = chosen->channel;
  measure.find.seen = ingest::BeadsSeen{chosen->rims.polarity, chosen->rims.radius_px, chosen->one_sided};
  source.reduction = measure.reduction =
      ingest::reduction_for(look->width, look->height, chosen->rims.radius_px, chosen->by_rims);
  if (const std::string why = ingest::why_reduced(look->width, look->height, source.reduction); !why.empty())
    context.warning(why);
  context.log(fmt::format("beads of {:.2f} px radius ({}): {} in the first frame", chosen->rims.radius_px,
                          options_for(*chosen), chosen->disks.size()));
  return !chosen->not_round;
}

// Refuses holes and printed dots.
void judge_contacts(const ExtractOptions& options, const ingest::Measurement& found) {
  const double diameter_px = options.diameter / found.calibration.scale_m_per_px;
  if (options.shape == BeadShape::round && found.contacts.far_apart(diameter_px))
    throw StageError(fmt::format(
        "Hardly any of the {} disks found touch: nearest centres are typically {:.1f} diameters apart. They may be "
        "holes or printed dots, because beads of a bed touch. Look at the pictures of fit-images --preview. If they "
        "are your beads, give --shape any, or --radius if a bead is larger than its circle",
        found.disk_total, found.contacts.nearest_px / diameter_px));
}

// Refuses, or warns, when many beads seem to be missed.
void judge_missed(const ExtractOptions& options, RunContext& context, double missed) {
  const ingest::Doubt doubt = ingest::doubt_of_missed(missed);
  if (doubt == ingest::Doubt::little) return;
  if (doubt == ingest::Doubt::too_many && options.shape == BeadShape::round)
    throw StageError(
        fmt::format("About {:.0f} % of the beads may be missed: between the disks found there are edges in places "
                    "where a bead fits. Look at the pictures of fit-images --preview, and give --radius, --polarity, "
                    "--channel or --roi. Beads that touch and are narrower than 24 px need more pixels. To measure the "
                    "disks found nevertheless, give --shape any",
                    100 * missed));
  context.warning(
      fmt::format("About {:.0f} % of the beads may be missed: between the disks found there are edges in places where "
                  "a bead fits. Look at the overlays (pictures with the disks found) before you use the density.",
                  100 * missed));
}

// Refuses, or warns first of all, when many disks may be wrong or the number given is contradicted.
void judge_disks(const ExtractOptions& options, RunContext& context, const ingest::Measurement& found) {
  const double wrong = found.expected_wrong, missed = found.finder.expected_missed;
  const ingest::Doubt doubt = ingest::doubt_of(wrong);
  if (doubt == ingest::Doubt::too_many)
    throw StageError(
        fmt::format("{:.0f} % of the {} disks found may be wrong: too many for a measurement. Look at the pictures of "
                    "fit-images --preview, and give --radius, --polarity, --channel or --roi",
                    100 * wrong, found.disk_total));
  if (doubt == ingest::Doubt::some)
    context.warning(
        fmt::format("{:.1f} % of the disks found may be wrong. Look at the overlays (pictures with the disks found) "
                    "before you use the numbers.",
                    100 * wrong));
  judge_contacts(options, found);
  judge_missed(options, context, missed);
  for (const std::string& one : ingest::doubts_of_bed(found, options.diameter)) context.warning(one);
  if (options.bead_number) judge_bead_number(*options.bead_number, found.disk_count_mean, context);
}

// What the options ask of the measurement.
ingest::MeasureOptions asked_for(const ExtractOptions& options) {
  ingest::MeasureOptions measure;
  measure.bead_diameter_m = options.diameter;
  measure.scale_m_per_px = options.scale;
  measure.floor_px = options.floor, measure.floor_slope = options.floor_slope;
  measure.floor_amplitude_m = options.floor_amplitude;
  measure.left_wall_px = options.left_wall, measure.right_wall_px = options.right_wall;
  measure.second_diameter_m = options.second_diameter;
  measure.pixel_aspect = options.pixel_aspect, measure.lens_radial = options.lens_radial;
  measure.find.polarity = polarity_of(options.polarity);
  measure.find.radius_px = options.radius;
  measure.find.keep_half_hidden = options.keep_half_hidden;
  if (options.roi.size() == 4) {
    measure.find.roi = ingest::PixelRectangle{static_cast<int>(options.roi[0]), static_cast<int>(options.roi[1]),
                                              static_cast<int>(options.roi[2]), static_cast<int>(options.roi[3])};
  }
  measure.kernel = options.kernel;
  measure.bin_width = options.spacing;
  measure.lowest = options.lowest, measure.highest = options.highest;
  measure.shaking_frequency_hz = options.frequency;
  return measure;
}

// What is named is used; of folders and patterns, what is a picture or a film.
std::vector<std::string> named_pictures(const InputFiles& images) {
  const auto name_of = [](std::string_view path) { return path.substr(path.find_last_of('/') + 1); };
  std::set<std::string_view> named;
  for (const std::string& text : images.texts) named.insert(name_of(text));
  std::vector<std::string> paths;
  for (const std::string& path : images.paths)
    if (named.contains(name_of(path)) || ingest::FrameSource::is_frame_file(path)) paths.push_back(path);
  if (paths.empty())
    throw InputError(
        fmt::format("{}: no picture or film was found. Give files that end in .png, .tif, .jpg, .bmp, "
                    ".pgm, .mp4, .avi, .mov or .mkv",
                    images.texts.front()));
  return paths;
}

// The film of the viewer is drawn by one thread, in about this share of the time in which one thread finds the disks
// (640 frames of 240 disks: 8 to 11 s and 4.5 to 5 s).
constexpr double share_of_film = 0.5;

class Extraction {
 public:
  Extraction(const ExtractOptions& options, RunContext& context)
      : options_(options),
        context_(context),
        rendered_(context.find_input("render")),
        measure_(asked_for(options)),
        time_(2, 1) {
    time_.expect(finding, 1);
    if (options.overlays > 0) time_.expect(drawing, share_of_film * context.jobs());
  }

  void run() {
    const ingest::StopQuestion question([this] {
      context_.check_interrupted();
      const double done = done_;
      time_.reached(finding, done);
      context_.progress(done > 0 ? time_.fraction() : 0, done > 0 ? "finding disks" : "searching for beads");
    });
    measure_.threads = static_cast<unsigned>(context_.jobs());
    film_.source.stride = options_.stride;
    film_.source.channel = channel_of(options_.channel);
    if (rendered_ != nullptr) {
      use_rendered();
    } else {
      film_.paths = named_pictures(options_.images);
      read_sides();
      round_ = use_first_look(options_, context_, film_, measure_);
    }
    std::optional<std::ifstream> truth_file;
    if (rendered_ != nullptr && rendered_->has("truth.csv")) truth_file.emplace(rendered_->file("truth.csv"));
    DisksOnTheWay on_the_way(context_, options_, truth_file ? &*truth_file : nullptr);
    const ingest::Measurement found = measure(on_the_way);
    if (rendered_ == nullptr) judge_disks(options_, context_, found);
    warn(found);
    write(found, on_the_way);
  }

 private:
  // Scale, floor and walls of a render stage, unless they are to be found.
  void use_rendered() {
    const FrameGeometry geometry = FrameGeometry::read(rendered_->file("geometry.json"));
    if (geometry.periodic && (!measure_.left_wall_px || *measure_.left_wall_px == geometry.left_wall))
      use_periodic_sides(geometry);
    if (options_.use_geometry) {
      if (!measure_.pixel_aspect) measure_.pixel_aspect = 1;
      if (!measure_.lens_radial) measure_.lens_radial = 0;
      if (!measure_.scale_m_per_px) measure_.scale_m_per_px = geometry.scale;
      if (!measure_.floor_px) measure_.floor_px = geometry.floor;
      if (!measure_.left_wall_px)
        measure_.left_wall_px = geometry.left_wall, measure_.right_wall_px = geometry.right_wall;
    }
    if (!measure_.lowest) {
      // Heights at multiples of the spacing, low enough for what lies below the floor's mean while it is down.
      const double reach = kernel_reach(options_.kernel), spacing = options_.spacing;
      measure_.lowest = (std::floor((std::min(0.0, geometry.lowest) - reach) / spacing) - 0.5) * spacing;
    }
    film_.paths.push_back((rendered_->directory / "frames").string());
  }

  // Periodic sides cannot be found: no bead stops there.
  void use_periodic_sides(const FrameGeometry& geometry) {
    measure_.periodic_sides = true;
    measure_.left_wall_px = geometry.left_wall, measure_.right_wall_px = geometry.right_wall;
  }

  // Pictures of a simulated bed with periodic sides say so.
  void read_sides() {
    if (measure_.left_wall_px || measure_.find.roi) return;
    const auto first = ingest::FrameSource::open(film_.paths, film_.source).first_origins(1);
    const auto said = first.empty() ? std::nullopt : ingest::png_text(first.front().path, FrameGeometry::keyword);
    const auto geometry = said ? FrameGeometry::from_sides_text(said->text) : std::nullopt;
    if (!geometry) return;
    if (geometry->width != said->width || geometry->height != said->height) {
      context_.warning(
          fmt::format("{}: this is a simulated bed with periodic sides, in a picture that was cut or scaled, so the "
                      "positions of the sides are unknown. The width found may be up to 1 D too large, and the density "
                      "too low by the same factor. Give the sides (--left-wall, --right-wall)",
                      first.front().path));
      return;
    }
    use_periodic_sides(*geometry);
    context_.warning(
        fmt::format("{}: this is a simulated bed with periodic sides. The width used is that of its box, from column "
                    "{:g} to {:g}, as stated in the file. Beads that extend beyond it are counted",
                    first.front().path, geometry->left_wall, geometry->right_wall));
  }

  ingest::Measurement measure(DisksOnTheWay& on_the_way) {
    ingest::FrameSource source = ingest::FrameSource::open(film_.paths, film_.source);
    // A film's own frame rate serves for the shaker's phase only: fast cameras write films to be watched slowly.
    measure_.frame_rate_hz =
        options_.frame_rate ? *options_.frame_rate / static_cast<double>(options_.stride) : source.film_rate_hz();
    const std::optional<std::size_t> total = source.count_if_known();
    measure_.progress = [&](std::size_t done) {
      if (total && *total > 0) done_ = static_cast<double>(done) / static_cast<double>(*total);
      ingest::StopQuestion::ask();
    };
    measure_.disk_sink = [&](const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks) {
      on_the_way.take(frame, disks);
    };
    time_.begin(finding);
    ingest::Measurement found = ingest::measure_bed(source, measure_);
    time_.end(finding);
    context_.check_interrupted();
    on_the_way.close();
    return found;
  }

  void warn(const ingest::Measurement& found) {
    const ingest::BedCalibration& bed = found.calibration;
    for (const std::string& warning : found.warnings) context_.warning(warning);
    std::size_t bad = 0;
    for (const ingest::FrameReport& frame : found.frames) {
      if (frame.status == ingest::FrameStatus::good) continue;
      if (++bad <= most_bad_frames_named)
        context_.warning(fmt::format("frame {} ({}): {}", frame.index,
                                     std::filesystem::path(frame.origin.path).filename().string(), frame.why));
    }
    if (bad > most_bad_frames_named)
      context_.warning(
          fmt::format("{} more frames could not be used; frames.csv lists them", bad - most_bad_frames_named));
    if (options_.frame_rate && !(bed.shaking_frequency_hz > 0))
      context_.warning(
          "No frequency of the shaking was found (" + bed.why_no_frequency +
          "), so there are no profiles by phase. Give frequency (--frequency) if this is a film of a shaken bed.");
    if (bed.shaking_frequency_hz > 0 && !options_.frame_rate)
      context_.warning(fmt::format(
          "Times follow from the frame rate of the film file, {:g} frames/s. If the film was recorded faster, give "
          "frame_rate (--frame-rate): the frequency of the shaking is then higher, and its phases stay the same.",
          *measure_.frame_rate_hz * static_cast<double>(options_.stride)));
  }

  // The fit takes them into its answer.
  void add_objections(const ingest::Measurement& found, Json& result) const {
    std::vector<ingest::Objection> all = ingest::objections_to(found);
    if (!round_)
      all.push_back({"The outlines are not those of disks, but the theory describes disks.",
                     "Use only the positions and the number of the beads."});
    const double seen = 2 * found.calibration.radius_px, given = options_.diameter / found.calibration.scale_m_per_px;
    if (found.calibration.scale_given && std::max(seen / given, given / seen) > 1 + most_off_scale)
      all.push_back({fmt::format("By the scale and the diameter given, a bead is {:.4g} px wide, but the beads found "
                                 "are {:.4g} px wide. The scale or the diameter is wrong, and with it every length.",
                                 given, seen),
                     "Leave the scale out (it then follows from the diameter), or correct the wrong one of the two."});
    if (measure_.second_diameter_m && !found.second_finder) {
      const double ratio = *measure_.second_diameter_m / measure_.bead_diameter_m;
      all.push_back({fmt::format("A second diameter was given, but beads of only one size were found. It is unknown "
                                 "which of the two they are, so every length may be wrong by up to {:.0f} %.",
                                 100 * (std::max(ratio, 1 / ratio) - 1)),
                     "Leave the second diameter out if all beads are alike, or give the region (--roi) and the radius "
                     "of the first kind (--radius)."});
    }
    if (found.second_finder)
      all.push_back({"The bed contains beads of two diameters, but the theory describes equal disks.",
                     "Use the profiles and numbers of both kinds."});
    for (const ingest::Objection& one : all)
      result["objections"].push_back(Json{{"why", one.why}, {"advice", one.advice}});
  }

  void write(const ingest::Measurement& found, DisksOnTheWay& on_the_way) {
    write_profiles(context_, found);
    frames_table(context_.table("frames.csv"), found.frames).write(context_.output("frames.csv"));
    Json result = bed_numbers(options_, found);
    result["quality"] = on_the_way.quality();
    result["cut_disks"] = on_the_way.cut(), result["half_hidden_disks"] = on_the_way.half_hidden();
    add_velocities(on_the_way, result);
    add_objections(found, result);
    if (const auto truth = on_the_way.truth()) result["truth"] = *truth;
    write_file(context_.output("extract.json"), dump(result));
    BedDescription bed =
        rendered_ != nullptr ? BedDescription::read(rendered_->file("bed.json")) : bed_seen(options_, found);
    bed.periodic = bed.periodic || measure_.periodic_sides;
    write_file(context_.output("bed.json"), dump(bed.to_json()));
    on_the_way.quality_table(context_.table("quality.csv")).write(context_.output("quality.csv"));
    write_file(context_.output("quality.svg"), on_the_way.quality_figure());
    bead_table(context_.table("bead.csv"), found.finder).write(context_.output("bead.csv"));
    ingest::write_png(context_.output("bead.png"), ingest::bead_picture(found.finder, 8));
    write_file(context_.output("count.svg"), count_figure(found.frames));
    if (options_.overlays == 0) return;
    draw_overlays(context_, film_, found, on_the_way);
    time_.begin(drawing);
    write_film(context_, film_, found, on_the_way, options_.frame_rate ? measure_.frame_rate_hz : std::nullopt,
               [this](double fraction) {
                 time_.reached(drawing, fraction);
                 context_.progress(time_.fraction(), "pictures of the film");
               });
    time_.end(drawing);
  }

  void add_velocities(DisksOnTheWay& on_the_way, Json& result) {
    const auto velocities = on_the_way.velocities();
    if (!velocities) return;
    for (const std::string& warning : velocities->warnings) context_.warning(warning);
    result["velocities"] = velocity_numbers(*velocities);
  }

  const ExtractOptions& options_;
  RunContext& context_;
  const Input* rendered_;  // the render stage, if the frames are its
  ingest::MeasureOptions measure_;
  FilmFiles film_;
  bool round_ = true;             // the outlines are those of disks
  std::atomic<double> done_ = 0;  // share of the frames
  enum Part : std::size_t { finding, drawing };
  TimeLeft time_;
};

}  // namespace

void judge_bead_number(std::uint64_t given, double mean_found, RunContext& context) {
  constexpr double far_off = 0.2, close = 1e-3;  // of the number given
  const double ratio = mean_found / static_cast<double>(given);
  const std::string text = fmt::format("On average {:.2f} beads were found, but bead_number is {}", mean_found, given);
  if (std::abs(ratio - 1) > far_off)
    throw StageError(text +
                     ". Other objects were probably found instead of the beads. Look at the pictures of fit-images "
                     "--preview, and give --radius, --polarity, --channel or --roi; or correct --bead-number");
  if (std::abs(ratio - 1) > close)
    context.warning(text + (ratio < 1
                                ? ": some beads are missed or out of view (see count.svg and the overlays)."
                                : ": another object is taken for a bead (see the overlays), or there are more beads."));
}

void extract_disks(const ExtractOptions& options, RunContext& context) { Extraction(options, context).run(); }

}  // namespace shakebed::pipelines
