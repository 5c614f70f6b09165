#include "pipelines/stages/picture_trial.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "ingest/find/survey.hpp"
#include "ingest/frames/background_level.hpp"
#include "ingest/profile/bed_doubts.hpp"
#include "ingest/profile/photographs.hpp"

namespace shakebed::pipelines {
namespace {

// px: the radius of beads in a picture that is reduced for trials. At 10 px drawn beads are found as in the picture.
constexpr double enough_radius_px = 10;

// Holes and printed dots.
void judge_contacts(const ExtractOptions& options, const ingest::Measurement& found) {
  const double diameter_px = options.diameter / found.calibration.scale_m_per_px;
  if (options.shape == BeadShape::round && found.contacts.far_apart(diameter_px))
    throw StageError(fmt::format(
        "Hardly any of the {} disks found touch: nearest centres are typically {:.1f} diameters apart. They may be "
        "holes or printed dots, because beads of a bed touch",
        found.disk_total, found.contacts.nearest_px / diameter_px));
}

void judge_missed(const ExtractOptions& options, const ingest::Measurement& found, Judgement& judgement) {
  const double missed = found.finder.expected_missed, wrong = found.expected_wrong;
  const ingest::Doubt doubt = ingest::doubt_of_missed(missed, wrong);
  if (doubt == ingest::Doubt::little) return;
  if (doubt == ingest::Doubt::too_many && options.shape == BeadShape::round) {
    std::string more;
    if (ingest::doubt_of(wrong) != ingest::Doubt::little)
      more += fmt::format(". {:.0f} % of the disks found may be wrong", 100 * wrong);
    if (2 * found.calibration.radius_px < ingest::wide_enough_px)
      more +=
          fmt::format(". Beads that touch and are narrower than {:.0f} px need more pixels", ingest::wide_enough_px);
    throw StageError(
        fmt::format("About {:.0f} % of the beads may be missed: between the disks found there are edges in places "
                    "where a bead fits{}",
                    100 * missed, more));
  }
  judgement.warning(
      fmt::format("About {:.0f} % of the beads may be missed: between the disks found there are edges in places where "
                  "a bead fits. Look at the overlays (pictures with the disks found) before you use the density.",
                  100 * missed));
}

// Of the channel, or of the only one.
ingest::GrayFrame frame_in(const ingest::ChannelFrames& frames, ingest::Channel channel) {
  if (channel == ingest::Channel::grey_distance) return ingest::grey_distance_of(frames);
  const auto its = std::find_if(frames.channels.begin(), frames.channels.end(),
                                [&](const auto& one) { return one.channel == channel; });
  return (its != frames.channels.end() ? *its : frames.channels.front()).frame;
}

FirstLook look_at_reduced(const ingest::FrameOrigin& picture, const ExtractOptions& options,
                          const ingest::ChannelFrames& reduced) {
  FirstLook look{.path = picture.path,
                 .width = reduced.width,
                 .height = reduced.height,
                 .survey = {},
                 .picture = nullptr,
                 .page = picture.page,
                 .pixel_aspect = options.pixel_aspect.value_or(ingest::stated_pixel_aspect(picture.path))};
  ingest::ChannelFrames frames = reduced;
  if (options.channel != BeadChannel::automatic) {
    const ingest::Channel channel = channel_of(options.channel);
    frames.channels = {{channel, frame_in(reduced, channel)}};
  }
  look.survey = ingest::survey_with_square_pixels(frames, survey_asked_for(options), look.pixel_aspect);
  look.width = frames.width;
  return look;
}

ingest::SurveyCandidate circles_of(const std::vector<ingest::MeasuredDisk>& disks) {
  ingest::SurveyCandidate circles;
  for (const ingest::MeasuredDisk& disk : disks) {
    ingest::RimDisk& one = circles.disks.emplace_back();
    one.circle.x = disk.x_px, one.circle.y = disk.y_px, one.circle.radius = disk.radius_px;
    one.probability = disk.probability;
  }
  return circles;
}

}  // namespace

void judge_bead_number(std::uint64_t given, double mean_found, Judgement& judgement) {
  constexpr double far_off = 0.2, close = 1e-3;  // of the number given
  const double ratio = mean_found / static_cast<double>(given);
  const std::string text = fmt::format("On average {:.2f} beads were found, but bead_number is {}", mean_found, given);
  if (std::abs(ratio - 1) > far_off)
    throw StageError(text + ". Other objects were found instead of the beads, or the number is wrong");
  if (std::abs(ratio - 1) > close)
    judgement.warning(
        text + (ratio < 1 ? ": some beads are missed or out of view (see the overlays)."
                          : ": another object is taken for a bead (see the overlays), or there are more beads."));
}

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
  measure.find.any_shape = options.shape == BeadShape::any;
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

void require_inside(const ExtractOptions& options, const FirstLook& look) {
  const int width = static_cast<int>(std::lround(look.width / look.pixel_aspect));  // of the picture as recorded
  if (options.roi.size() == 4) {
    const double left = options.roi[0], top = options.roi[1], right = left + options.roi[2],
                 bottom = top + options.roi[3];
    if (left >= width || top >= look.height || right <= 0 || bottom <= 0)
      throw StageError(fmt::format(
          "{}: the region of interest (--roi, \"roi\") lies outside the picture of {} x {} px. Give LEFT,TOP,WIDTH,"
          "HEIGHT inside it, or leave --roi out to search the whole picture",
          look.path, width, look.height));
  }
  if (!options.left_wall || !options.right_wall) return;
  if (*options.left_wall >= width || *options.right_wall <= 0)
    throw StageError(fmt::format(
        "{}: the walls given at columns {:g} and {:g} enclose nothing of the picture, which is {} px wide. Correct "
        "--left-wall and --right-wall, or leave both out: they are then found",
        look.path, *options.left_wall, *options.right_wall, width));
}

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

void go_on_with(const ingest::SurveyCandidate& chosen, const FirstLook& look, ingest::FrameSourceOptions& source,
                ingest::MeasureOptions& measure) {
  source.channel = chosen.channel;
  ingest::look_for(chosen, measure.find);
  measure.first_pixel_aspect = look.pixel_aspect;
  source.reduction = measure.reduction = ingest::reduction_after(look, chosen);
  measure.searched = chosen.searched;
}

Judgement judge_disks(const ExtractOptions& options, const ingest::Measurement& found) {
  Judgement judgement;
  const double wrong = found.expected_wrong;
  const ingest::Doubt doubt = ingest::doubt_of(wrong);
  if (doubt == ingest::Doubt::too_many)
    throw StageError(fmt::format("{:.0f} % of the {} disks found may be wrong: too many for a measurement", 100 * wrong,
                                 found.disk_total));
  if (doubt == ingest::Doubt::some)
    judgement.warning(
        fmt::format("{:.1f} % of the disks found may be wrong. Look at the overlays (pictures with the disks found) "
                    "before you use the numbers.",
                    100 * wrong));
  judge_contacts(options, found);
  judge_missed(options, found, judgement);
  for (std::string& one : ingest::doubts_of_bed(found, options.diameter)) judgement.warning(std::move(one));
  if (options.bead_number) judge_bead_number(*options.bead_number, found.disk_count_mean, judgement);
  return judgement;
}

std::optional<ingest::ChannelFrames> reduced_for_trials(const FirstLook& look, double radius_px) {
  const int factor = static_cast<int>(radius_px / enough_radius_px);
  if (factor < 2) return std::nullopt;
  try {
    const std::size_t pixels = static_cast<std::size_t>(look.width) * static_cast<std::size_t>(look.height);
    return ingest::read_channels(look.path, look.page, pixels / static_cast<std::size_t>(factor * factor));
  } catch (const ingest::InputError&) {
    return std::nullopt;
  }
}

std::optional<Trial> judged(const ExtractOptions& options, const ingest::Measurement& found,
                            const std::vector<ingest::MeasuredDisk>& disks) {
  try {
    judge_disks(options, found);
  } catch (const StageError&) {
    return std::nullopt;
  }
  if (found.disk_total == 0) return std::nullopt;
  return Trial{found.disk_total,
               found.calibration.radius_px,
               found.calibration.polarity == ingest::Polarity::bright_beads,
               found.expected_wrong,
               found.finder.expected_missed,
               found.contacts,
               circles_of(disks),
               found.calibration.lens.pixel_aspect};
}

namespace {

// `reduced`: read instead of the picture.
std::optional<Trial> tried_after(const FirstLook& look, const ExtractOptions& options, TrialSearch search,
                                 const ingest::ChannelFrames* reduced) {
  if (!look.survey.found) return std::nullopt;
  require_inside(options, look);
  const ingest::SurveyCandidate& chosen = chosen_of(look.survey, options);
  if (options.scale && !ingest::why_not_scale(options.diameter, *options.scale, chosen.rims.radius_px).empty())
    return std::nullopt;
  ingest::MeasureOptions measure = asked_for(options);
  measure.shaking_frequency_hz.reset();  // of one frame there is none
  measure.find.quick_rims_only = search == TrialSearch::by_rims_alone;
  ingest::FrameSourceOptions source;
  source.channel = channel_of(options.channel);
  go_on_with(chosen, look, source, measure);
  if (reduced != nullptr) measure.reduction = reduced->reduction;
  ingest::FrameSource one = ingest::FrameSource::from_generator(1, [&](std::size_t) {
    return reduced != nullptr ? frame_in(*reduced, source.channel) : ingest::read_frame(look.path, look.page, source);
  });
  const ingest::Measurement found = ingest::measure_bed(one, measure);
  return judged(options, found, found.disks);
}

// Nothing where the trial is refused.
template <class Try>
std::optional<Trial> unless_refused(const Try& attempt) {
  try {
    return attempt();
  } catch (const StageError&) {
    return std::nullopt;
  } catch (const ingest::InputError&) {
    return std::nullopt;
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

}  // namespace

std::optional<Trial> try_options(const ingest::FrameOrigin& picture, const ExtractOptions& options,
                                 const ingest::ChannelFrames* reduced) {
  return unless_refused([&]() -> std::optional<Trial> {
    const std::optional<FirstLook> look =
        reduced != nullptr ? look_at_reduced(picture, options, *reduced) : look_at_first({picture}, options);
    return look ? tried_after(*look, options, TrialSearch::as_the_run, reduced) : std::nullopt;
  });
}

std::optional<Trial> try_after_look(const FirstLook& look, const ExtractOptions& options, TrialSearch search) {
  return unless_refused([&] { return tried_after(look, options, search, nullptr); });
}

}  // namespace shakebed::pipelines
