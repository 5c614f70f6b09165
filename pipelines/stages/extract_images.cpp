#include "pipelines/stages/extract_images.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <optional>
#include <set>

#include "ingest/frames/picture_threads.hpp"
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
#include "pipelines/stages/picture_trial.hpp"
#include "pipelines/stages/preview.hpp"
#include "pipelines/stages/proposals.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_bad_frames_named = 5;
constexpr double most_off_scale = 0.1;  // of a scale and a diameter that are both given, by the radius found

namespace fs = std::filesystem;

// Where the pictures of a refusal stay: beside the folders of the stages, since this stage leaves none.
fs::path refusal_folder(const RunContext& context) { return context.output_directory().parent_path() / "no-beads"; }

// What was tried on the picture, or on those after it, with the page that shows it.
std::string advice(const ExtractOptions& options, RunContext& context, const FirstLook& look,
                   const std::vector<Proposal>& proposals, const std::vector<ingest::FrameOrigin>& pictures = {}) {
  const fs::path folder = refusal_folder(context);
  fs::create_directories(folder);
  write_preview(folder, look, options.images.texts, options, proposals);
  return fmt::format("See {}. {}", (folder / "preview.html").string(), advice_for(proposals, pictures, options));
}

// Says what the first frame shows instead of beads, or instead of those described.
[[noreturn]] void refuse(const ExtractOptions& options, RunContext& context, const FirstLook& look,
                         const std::vector<ingest::FrameOrigin>& pictures, const std::string& why) {
  context.progress(0, "trying other options");
  const std::vector<Proposal> proposals = proposals_for(look, options, RefusedBy::first_look);
  throw StageError(fmt::format("{}: {}. {}", look.path, why, advice(options, context, look, proposals, pictures)));
}

// Throws StageError where frames reduced so far show too little of a bead.
void require_visible(std::uint64_t reduction, double radius_px, const std::string& path) {
  const double left = radius_px / static_cast<double>(reduction);
  if (left >= ingest::least_reduced_radius_px) return;
  throw StageError(fmt::format(
      "{}: averaged over squares of {} px (reduction), a bead of {:.3g} px radius is left with {:.3g} px; {:g} px are "
      "needed. Give at most {}",
      path, reduction, radius_px, left, ingest::least_reduced_radius_px,
      std::max(1, static_cast<int>(radius_px / ingest::least_reduced_radius_px))));
}

// The beads the first frame shows: channel, radius and polarity to go on with. Refuses when it shows none. Whether
// their outlines are those of disks.
struct UsedLook {
  std::optional<FirstLook> look;  // without its picture; none where no file can be read
  bool round = true;
};
UsedLook use_first_look(const ExtractOptions& options, RunContext& context,
                        const std::vector<ingest::FrameOrigin>& pictures, FilmFiles& film,
                        ingest::MeasureOptions& measure) {
  std::optional<FirstLook> look = look_at_first(pictures, options, LookFor::search);
  std::error_code error;
  fs::remove_all(refusal_folder(context), error);
  if (!look) return {};  // measure_bed() says which files cannot be read
  require_inside(options, *look);
  if (look->pixel_aspect != 1 && !options.pixel_aspect)
    context.warning(
        fmt::format("{}: the film states that a pixel is {:.4g} times as wide as high. The search for the true ratio "
                    "begins there. If the film is wrong, give --pixel-aspect 1",
                    look->path, look->pixel_aspect));
  if (!look->survey.found) refuse(options, context, *look, pictures, "no beads: " + look->survey.why_not);
  const ingest::SurveyCandidate* chosen = &chosen_of(look->survey, options);
  if (options.scale)
    if (const std::string why = ingest::why_not_scale(options.diameter, *options.scale, chosen->rims.radius_px);
        !why.empty())
      refuse(options, context, *look, pictures, why);
  if (chosen->not_round)
    context.warning(fmt::format(
        "{}: the outlines are not those of disks ({}). They are measured because shape is \"any\". If these are your "
        "beads, their positions are valid, but radii and densities are not: these hold for disks only",
        look->path, chosen->why_not_round));
  if (!chosen->why_drawn.empty())
    context.warning(
        fmt::format("{}: {}. The circles are measured because shape is \"any\".", look->path, chosen->why_drawn));
  if (chosen->region && !measure.find.roi) context.warning(ingest::why_only_a_part(*chosen->region));
  go_on_with(*chosen, *look, film.source, measure);
  if (options.reduction) require_visible(*options.reduction, chosen->rims.radius_px, look->path);
  if (const std::string why = ingest::why_reduced(look->width, look->height, film.source.reduction); !why.empty())
    context.warning(why);
  context.log(fmt::format("beads of {:.2f} px radius ({}): {} in the first frame", chosen->rims.radius_px,
                          options_for(*chosen), chosen->disks.size()));
  const bool round = !chosen->not_round;
  look->picture.reset();
  return {std::move(look), round};
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
    const ingest::PictureThreads threads(context_.jobs());
    film_.source.skip = options_.skip, film_.source.stride = options_.stride;
    film_.source.channel = channel_of(options_.channel);
    if (rendered_ != nullptr) {
      use_rendered();
      first_pictures(film_.paths, film_.source);  // refuses where none is left
    } else {
      film_.paths = named_pictures(options_.images);
      const std::vector<ingest::FrameOrigin> pictures = first_pictures(film_.paths, film_.source);
      read_sides(pictures.front().path);
      first_look_ = use_first_look(options_, context_, pictures, film_, measure_);
    }
    if (options_.reduction) film_.source.reduction = measure_.reduction = static_cast<int>(*options_.reduction);
    std::optional<std::ifstream> truth_file;
    if (rendered_ != nullptr && rendered_->has("truth.csv")) truth_file.emplace(rendered_->file("truth.csv"));
    DisksOnTheWay on_the_way(context_, options_, truth_file ? &*truth_file : nullptr);
    const ingest::Measurement found = measure(on_the_way);
    if (rendered_ == nullptr) {
      judge(found);
    } else if (options_.bead_number) {
      Judgement judgement;
      judge_bead_number(*options_.bead_number, found.disk_count_mean, judgement);
      for (const std::string& one : judgement.warnings) context_.warning(one);
    }
    warn(found);
    write(found, on_the_way);
  }

 private:
  void judge(const ingest::Measurement& found) {
    try {
      for (const std::string& one : judge_disks(options_, found).warnings) context_.warning(one);
    } catch (const StageError& error) {
      ingest::Measurement refused = found;
      refused.disks = first_disks_;
      refuse_measured(error.what(), &refused);
    }
  }

  // With options that were tried on the first picture.
  [[noreturn]] void refuse_measured(const std::string& what, const ingest::Measurement* found) {
    const std::optional<FirstLook>& look = first_look_.look;
    if (!look) throw StageError(what);
    context_.progress(done_, "trying other options");
    const std::vector<Proposal> proposals = proposals_for(*look, options_, RefusedBy::measurement, found);
    throw StageError(fmt::format("{}. {}", what, advice(options_, context_, *look, proposals)));
  }

  // Scale, floor and walls of a render stage, unless they are to be found.
  void use_rendered() {
    const FrameGeometry geometry = FrameGeometry::read(rendered_->file("geometry.json"));
    if (options_.reduction)
      require_visible(*options_.reduction, options_.diameter / geometry.scale / 2, rendered_->directory.string());
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
  void read_sides(const std::string& first) {
    if (measure_.left_wall_px || measure_.find.roi) return;
    const auto said = ingest::png_text(first, FrameGeometry::keyword);
    const auto geometry = said ? FrameGeometry::from_sides_text(said->text) : std::nullopt;
    if (!geometry) return;
    if (geometry->width != said->width || geometry->height != said->height) {
      context_.warning(
          fmt::format("{}: this is a simulated bed with periodic sides, in a picture that was cut or scaled, so the "
                      "positions of the sides are unknown. The width found may be up to 1 D too large, and the density "
                      "too low by the same factor. Give the sides (--left-wall, --right-wall)",
                      first));
      return;
    }
    use_periodic_sides(*geometry);
    context_.warning(
        fmt::format("{}: this is a simulated bed with periodic sides. The width used is that of its box, from column "
                    "{:g} to {:g}, as stated in the file. Beads that extend beyond it are counted",
                    first, geometry->left_wall, geometry->right_wall));
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
      if (frame.index == 0) first_disks_ = disks;
      on_the_way.take(frame, disks);
    };
    time_.begin(finding);
    ingest::Measurement found = measured(source);
    time_.end(finding);
    context_.check_interrupted();
    on_the_way.close();
    return found;
  }

  ingest::Measurement measured(ingest::FrameSource& source) {
    try {
      return ingest::measure_bed(source, measure_);
    } catch (const ingest::NoDisksError& error) {
      const std::string what = fmt::format("{}: {}", error.problem(), error.why());
      if (rendered_ == nullptr) refuse_measured(what, nullptr);
      throw StageError(what + ". Give the render stage less noise, or a finer scale");
    }
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
    if (!first_look_.round)
      all.push_back({"The outlines are not those of disks, but the theory describes disks.",
                     "Use only the positions and the number of the beads."});
    const double seen = 2 * found.calibration.radius_px, given = options_.diameter / found.calibration.scale_m_per_px;
    if (found.calibration.scale_given && !found.calibration.scale_of_contacts &&
        std::max(seen / given, given / seen) > 1 + most_off_scale)
      all.push_back({fmt::format("By the scale and the diameter given, a bead is {:.4g} px wide, but the beads found "
                                 "are {:.4g} px wide. The scale or the diameter is wrong, and with it every length.",
                                 given, seen),
                     "Leave the scale out (it then follows from the diameter), or correct the wrong one of the two."});
    if (measure_.second_diameter_m && !found.second_finder) {
      const double ratio = *measure_.second_diameter_m / measure_.bead_diameter_m;
      all.push_back({fmt::format("A second diameter was given, but beads of only one size were found. It is unknown "
                                 "which of the two they are, so every length may be wrong by up to {:.0f} %.",
                                 100 * (std::max(ratio, 1 / ratio) - 1)),
                     options_.radius ? "Leave the second diameter out if all beads are alike. Else take photographs in "
                                       "which both kinds are at least 12 px wide."
                                     : "Leave the second diameter out if all beads are alike, or give the radius of "
                                       "the first kind (--radius)."});
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
    result["reduction"] = measure_.reduction;
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
    // Beads found by their rims alone have no profile, and one frame has no course of time.
    if (found.finder.profile.level.size() > 1)
      ingest::write_png(context_.output("bead.png"), ingest::bead_picture(found.finder, 8));
    if (found.frames.size() > 1) write_file(context_.output("count.svg"), count_figure(found.frames));
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
    result["velocities"] = velocity_numbers(*velocities, *measure_.frame_rate_hz);
  }

  const ExtractOptions& options_;
  RunContext& context_;
  const Input* rendered_;  // the render stage, if the frames are its
  ingest::MeasureOptions measure_;
  FilmFiles film_;
  UsedLook first_look_;
  std::vector<ingest::MeasuredDisk> first_disks_;  // of the first frame
  std::atomic<double> done_ = 0;                   // share of the frames
  enum Part : std::size_t { finding, drawing };
  TimeLeft time_;
};

}  // namespace

void extract_disks(const ExtractOptions& options, RunContext& context) { Extraction(options, context).run(); }

}  // namespace shakebed::pipelines
