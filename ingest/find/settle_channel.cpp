#include "ingest/find/settle_channel.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/packed_bed.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Of the part of a frame that trials look at, to compare channels and to see whether faces are alike. In 400 px a
// packed bed may hide all background, and is then found by its rims.
constexpr int trial_side_px = 480;
// Of the part where only the channel is asked for, and where channels are chosen for a trial: a quarter of the time.
constexpr int glance_side_px = 320;
constexpr double clearly_more = 1.03;  // times as many beads, for a change of channel
// The same, for a change from faces to rims: their centres may be wrong by a tenth of a radius, so that they have to
// show another tenth of the beads. From rims to faces more is enough.
constexpr double far_more = 1.1, any_more = 1;
constexpr double inside = 0.8, outside = 1.15,
                 farthest_behind = 1.3;  // radii: where a face and what is behind it are seen
constexpr double least_contrast = 4;     // grey levels between the two

// Shares of disks that are wrong or beads that are missed, below which another channel is not tried. At 0.02 a
// photograph of 65 photoelastic disks, all of which are found by their faces, is searched in a channel that shows 63.
constexpr double hardly = 0.05;

// A rim that another channel shows, and that lies on no disk found in this one: its probability, and the distance from
// the centres of disks in radii. A bead may have no contrast in one channel, as a dark one in the saturation.
constexpr double sure_rim = 0.9, nearest_of_another = 1.6;

// Of a radius: beads that are plainly seen here, and are of another radius there, are not the same.
constexpr double another_size = 0.12;

// Two channels of which one tells this share of the other's variance show the same beads.
constexpr double the_same = 0.998;

// Rims of the sign that most beads have not; fewer say nothing about a channel.
constexpr double fewest_of_other_sign = 3;

// Of the other channels, those in which a quick search by rims shows most of the beads are searched as thoroughly as
// this one.
constexpr std::size_t most_channels = 2;

// Beads that are so many, so much of all edges and so sure are expected to be found by their faces.
constexpr std::size_t many = 50;
constexpr double most_of_the_edges = 0.5, almost_none_wrong = 0.02;

// Whether beads of another shade count, which a run finds, too: this takes a tenth of a trial's time or more.
enum class Shades { common, where_doubtful, all };

struct Trial {
  std::vector<FoundDisk> disks;
  double radius_px = 0, expected = 0;  // beads found, each by its probability
  bool by_rims = true;
  bool thorough = false;         // rims were searched thoroughly, which showed more
  double wrong = 1, missed = 1;  // shares that are expected, of the disks and of the beads
  std::shared_ptr<SearchedFrame> searched;
  // Radius at which most neighbours would touch, over the radius seen. A channel may show no more of shaded spheres
  // than their bright middle.
  double apart = 1;
  [[nodiscard]] bool complete() const { return wrong <= hardly && missed <= hardly; }
  [[nodiscard]] bool doubtful() const { return !complete() || apart > 1; }
  [[nodiscard]] bool plain() const { return !by_rims && !doubtful(); }
  // Beads found, each by the share of its radius that is seen.
  [[nodiscard]] double shown() const { return expected / apart; }
  // The same, less the disks that are none: a wrong disk is as bad as a bead that is missed.
  [[nodiscard]] double worth() const { return (expected - wrong * static_cast<double>(disks.size())) / apart; }
};

// Whether another channel shows more of the beads, and so well that this one is left for it.
bool better_there(const Trial& here, const Trial& there) {
  const double faces_or_rims = there.by_rims ? far_more : any_more;
  const double more = there.by_rims == here.by_rims ? clearly_more : faces_or_rims;
  if (there.shown() <= std::min(more, clearly_more) * here.shown() || there.worth() <= more * here.worth())
    return false;
  if (!here.plain()) return true;
  // More disks are found where other things pass as beads, too: these then are less sure. And rims of one sign may be
  // those of the bright middle of some beads.
  return there.wrong < hardly && std::abs(there.radius_px / here.radius_px - 1) < another_size;
}

Trial trial_of(const FinderCalibration& learned, const FindResult& found) {
  Trial trial;
  trial.by_rims = learned.by_rims;
  trial.thorough = learned.by_rims && learned.rims->thorough();
  trial.radius_px = learned.radius_px;
  for (const FoundDisk& disk : found.disks) trial.expected += disk.probability;
  trial.missed = learned.expected_missed;
  if (!found.disks.empty()) trial.wrong = 1 - trial.expected / static_cast<double>(found.disks.size());
  trial.disks = found.disks;
  trial.apart = radius_beyond(circles_of(trial.disks), trial.radius_px).value_or(trial.radius_px) / trial.radius_px;
  return trial;
}

Trial tried(const GrayFrame& frame, const FindOptions& find, const CalibrationResult& learned, Shades shades) {
  if (!learned.found) return {};
  FindResult found = learned.in_last_frame ? *learned.in_last_frame : find_beads(frame, learned.calibration, find);
  Trial trial = trial_of(learned.calibration, found);
  if (shades == Shades::common || (shades == Shades::where_doubtful && trial.plain())) return trial;
  if (find.quick_rims && trial.by_rims) return trial;  // there are no faces, which were asked for
  FinderCalibration of_both = learned.calibration;
  learn_other_shade(frame, find, of_both, found);
  return trial_of(of_both, found);
}

Polarity opposite(Polarity polarity) {
  return polarity == Polarity::dark_beads ? Polarity::bright_beads : Polarity::dark_beads;
}

// Median over the disks of the level inside less that around them.
double contrast_of(const GrayFrame& frame, const std::vector<RimDisk>& disks, double scale) {
  std::vector<double> contrasts;
  for (const RimDisk& disk : disks) {
    const double x = (disk.circle.x + 0.5) / scale - 0.5, y = (disk.circle.y + 0.5) / scale - 0.5;
    const double radius = disk.circle.radius / scale;
    const int reach = static_cast<int>(std::ceil(farthest_behind * radius));
    const double inner = std::pow(inside * radius, 2), outer = std::pow(outside * radius, 2),
                 farthest = std::pow(farthest_behind * radius, 2);
    double in = 0, in_count = 0, out = 0, out_count = 0;
    for (int row = std::max(0, static_cast<int>(y) - reach);
         row <= std::min(frame.height - 1, static_cast<int>(y) + reach); ++row)
      for (int column = std::max(0, static_cast<int>(x) - reach);
           column <= std::min(frame.width - 1, static_cast<int>(x) + reach); ++column) {
        const double away = (column - x) * (column - x) + (row - y) * (row - y);
        const float level = frame.at(column, row);
        if (unseen(level)) continue;
        if (away < inner) in += static_cast<double>(level), ++in_count;
        if (away > outer && away < farthest) out += static_cast<double>(level), ++out_count;
      }
    if (in_count > 0 && out_count > 0) contrasts.push_back(in / in_count - out / out_count);
  }
  return median_of(std::move(contrasts));
}

// Whether a run reduces such frames.
bool large(const ChannelFrames& frames) {
  return static_cast<double>(frames.width) * frames.height > large_frame_pixels;
}

class ChannelTrials {
 public:
  // `side_px`: of the part of a frame that trials look at.
  ChannelTrials(const ChannelFrames& frames, const SurveyCandidate& best, const SurveyOptions& options, int side_px)
      : frames_(frames), best_(best) {
    const double radius = best.rims.radius_px / frames.reduction;
    factor_ = std::max(1, static_cast<int>(radius / trial_radius_px));
    const int all = factor_ * frames.reduction;
    places_ = places_of(circles_of(best.disks), all);
    const GrayFrame& frame = frames.channels.front().frame;
    part_ = part_with_most(places_, side_px, frame.width / factor_, frame.height / factor_);
    if (!options.roi) return;
    roi_ = PixelRectangle{options.roi->left / all - part_.left, options.roi->top / all - part_.top,
                          options.roi->width / all, options.roi->height / all};
  }

  // `faces_alone`: rims are searched quickly.
  [[nodiscard]] Trial trial_in(const GrayFrame& picture, Polarity polarity, Shades shades,
                               bool faces_alone = false) const {
    FindOptions find;
    find.seen = BeadsSeen{polarity, radius_px()};
    find.roi = roi_;
    find.rims_of_one_size = true;
    find.quick_rims = faces_alone;
    const GrayFrame part = small(picture);
    return tried(part, find, learn_beads({&part}, find), shades);
  }

  // In the channel in which the beads were seen: the search itself where it can be. Its disks are those in the part.
  [[nodiscard]] Trial first_trial(const GrayFrame& picture, const SurveyOptions& options) const {
    // Of a single channel it is only asked whether its faces are alike.
    const Shades shades = frames_.channels.size() > 1 ? Shades::where_doubtful : Shades::common;
    if (!options.search || !searches_all(picture, options)) return trial_in(picture, best_.rims.polarity, shades);
    GrayFrame all = factor_ > 1 ? reduced(picture, factor_) : picture;
    FindOptions asked = asked_of_run(best_.rims.polarity, options);
    FindOptions find = asked;
    find.rims_of_one_size = true;  // which faces do not depend on
    CalibrationResult learned = learn_beads({&all}, find);
    Trial trial = tried(all, find, learned, shades);
    keep_to_part(trial);
    if (learned.found && !learned.calibration.by_rims && (factor_ == 1 || large(frames_)))
      trial.searched =
          std::make_shared<SearchedFrame>(std::move(all), frames_.reduction * factor_, asked, std::move(learned));
    return trial;
  }

  // Of a candidate whose beads were found by their rims in the part: whether all of the frame shows faces. In the part
  // beads may hide all background.
  void try_faces_in_all(SurveyCandidate& settled, const SurveyOptions& options) const {
    const auto chosen = std::find_if(frames_.channels.begin(), frames_.channels.end(),
                                     [&](const ChannelFrames::One& one) { return one.channel == settled.channel; });
    GrayFrame all = factor_ > 1 ? reduced(chosen->frame, factor_) : chosen->frame;
    FindOptions asked = asked_of_run(settled.rims.polarity, options);
    FindOptions find = asked;
    find.quick_rims = true;  // which faces do not depend on
    if (shows_none_at_the_edge(all, find)) {
      settled.no_faces = true;
      return;
    }
    CalibrationResult learned = learn_beads({&all}, find);
    settled.by_rims = settled.no_faces = !learned.found || learned.calibration.by_rims;
    settled.thorough = settled.thorough && settled.by_rims;
    if (!settled.by_rims && options.search)
      settled.searched =
          std::make_shared<SearchedFrame>(std::move(all), frames_.reduction * factor_, asked, std::move(learned));
  }

  // What a quick search by rims finds.
  [[nodiscard]] Trial found_by_rims(const GrayFrame& picture, Polarity polarity) const {
    FindOptions find;
    find.seen = BeadsSeen{polarity, radius_px()};
    find.roi = roi_;
    find.quick_rims_only = true;
    const GrayFrame part = small(picture);
    const CalibrationResult learned = learn_beads({&part}, find);
    return learned.found && learned.in_last_frame ? trial_of(learned.calibration, *learned.in_last_frame) : Trial{};
  }

  // The other polarity, if its rims have the radius of the beads found more nearly and are no fewer than half of those
  // of this one. Of beads brighter and darker than the background each sign shows a part.
  [[nodiscard]] Polarity polarity_of_radius(const GrayFrame& picture, Polarity polarity, double radius) const {
    const Trial by_this = found_by_rims(picture, polarity), by_other = found_by_rims(picture, opposite(polarity));
    const auto off = [&](const Trial& trial) { return std::abs(std::log(trial.radius_px / radius)); };
    return 2 * by_other.expected > by_this.expected && off(by_other) < off(by_this) ? opposite(polarity) : polarity;
  }

  // Sure rims of this polarity, or of both, that lie on no disk found. Where there are no more circles than are wanted,
  // these are not judged: 0.
  [[nodiscard]] double rims_beside(const std::vector<FoundDisk>& disks, const GrayFrame& picture, Polarity polarity,
                                   double wanted) const {
    const GrayFrame part = small(picture);
    PictureMaps maps(part, quick_search.wanted_px);
    const auto beside = [&](const Circle& circle) {
      return std::none_of(disks.begin(), disks.end(), [&](const FoundDisk& disk) {
        return std::hypot(disk.x_px - circle.x, disk.y_px - circle.y) < nearest_of_another * radius_px();
      });
    };
    const std::vector<Circle> circles = circles_seen(maps, polarity, radius_px());
    if (static_cast<double>(std::count_if(circles.begin(), circles.end(), beside)) <= wanted) return 0;
    double sure = 0;
    for (const Polarity sign : {Polarity::dark_beads, Polarity::bright_beads}) {
      if (polarity != Polarity::automatic && polarity != sign) continue;
      for (const RimDisk& rim : learn_rims(maps, sign, radius_px(), Known::beads).disks)
        sure += rim.probability >= sure_rim && beside(rim.circle);
    }
    return sure;
  }

  // Of the beads in this channel; none where they hardly stand out.
  [[nodiscard]] std::optional<Polarity> polarity_in(const ChannelFrames::One& one) const {
    if (one.channel == best_.channel) return best_.rims.polarity;
    const double contrast = contrast_of(one.frame, best_.disks, frames_.reduction);
    if (std::abs(contrast) < least_contrast) return std::nullopt;
    return contrast > 0 ? Polarity::bright_beads : Polarity::dark_beads;
  }

  [[nodiscard]] bool alike(const GrayFrame& one, const GrayFrame& other) const {
    const double share = likeness(small(one), small(other));
    return share * share > the_same;
  }

 private:
  // What the run will ask of frames as they are reduced here.
  [[nodiscard]] FindOptions asked_of_run(Polarity polarity, const SurveyOptions& options) const {
    const int all = frames_.reduction * factor_;
    FindOptions asked = options.search.value_or(FindOptions{});
    asked.seen = BeadsSeen{polarity, radius_px(), best_.one_sided};
    if (asked.radius_px) *asked.radius_px /= all;
    asked.recorded_px = all;
    asked.distances = best_.channel == Channel::grey_distance;
    return asked;
  }

  // Whether beads will be searched in frames like this one, as the trial would search its part. In a frame that is
  // larger than the part this is worth its time if they are expected to be found by their faces.
  [[nodiscard]] bool searches_all(const GrayFrame& picture, const SurveyOptions& options) const {
    if (options.roi || best_.region || picture.enlargement > 1) return false;
    if (best_.packed) return true;  // a part may show no background, and beads cannot be learned without
    if (factor_ > 1) return false;
    if (frames_.reduction > 1 && radius_px() < trial_radius_px) return false;
    const bool plain = best_.disks.size() >= many && best_.explained_share >= most_of_the_edges &&
                       best_.expected_wrong <= almost_none_wrong;
    return plain || (part_.width == picture.width && part_.height == picture.height);
  }

  // Whether faces are searched in vain in a part that is half filled with beads, and so shows what is behind them.
  [[nodiscard]] bool shows_none_at_the_edge(const GrayFrame& all, const FindOptions& find) const {
    const std::optional<PicturePart> edge = part_half_filled(places_, part_.width, all.width, all.height);
    if (!edge) return false;
    const GrayFrame part = cut_out(all, *edge);
    const CalibrationResult learned = learn_beads({&part}, find);
    return learned.found && learned.calibration.by_rims;
  }

  // The same part of every channel, so that numbers of beads compare.
  [[nodiscard]] GrayFrame small(const GrayFrame& picture) const {
    GrayFrame part = cut_out(factor_ > 1 ? reduced(picture, factor_) : picture, part_);
    part.enlargement = picture.enlargement;
    return part;
  }
  [[nodiscard]] double radius_px() const { return best_.rims.radius_px / (frames_.reduction * factor_); }

  // Of disks in all of the frame.
  void keep_to_part(Trial& trial) const {
    std::vector<FoundDisk> all = std::move(trial.disks);
    trial.disks.clear(), trial.expected = 0;
    for (FoundDisk& disk : all) {
      disk.x_px -= part_.left, disk.y_px -= part_.top;
      if (disk.x_px < -0.5 || disk.y_px < -0.5 || disk.x_px >= part_.width - 0.5 || disk.y_px >= part_.height - 0.5)
        continue;
      trial.expected += disk.probability;
      trial.disks.push_back(disk);
    }
  }

  const ChannelFrames& frames_;
  const SurveyCandidate& best_;
  int factor_ = 1;
  Places places_;  // of the beads seen, px of the frames of trials
  PicturePart part_;
  std::optional<PixelRectangle> roi_;
};

// Beads that a quick search by rims shows: of one polarity, and of the other, too.
struct RimsSeen {
  double of_its_sign = 0, of_both_signs = 0;
};

// Another channel in which the beads stand out.
struct OtherChannel {
  Channel channel = Channel::automatic;
  const GrayFrame* frame = nullptr;
  Polarity polarity = Polarity::automatic;
  RimsSeen rims;
  bool shows_more = true;  // by rims, than the channel in which the beads were seen
};

// Those in which rims of one sign show most of the beads, and the one in which rims of both signs show clearly more.
void keep_most_telling(std::vector<OtherChannel>& others) {
  std::vector<double> ranked;
  ranked.reserve(others.size());
  for (const OtherChannel& other : others) ranked.push_back(other.rims.of_its_sign);
  std::sort(ranked.begin(), ranked.end(), std::greater<>());
  std::size_t kept = 0;
  double most = 0;
  const auto first_left = std::stable_partition(others.begin(), others.end(), [&](const OtherChannel& other) {
    return other.rims.of_its_sign >= ranked[most_channels - 1] && ++kept <= most_channels;
  });
  for (auto one = others.begin(); one != first_left; ++one) most = std::max(most, one->rims.of_both_signs);
  const auto of_both = std::max_element(first_left, others.end(), [](const auto& one, const auto& another) {
    return one.rims.of_both_signs < another.rims.of_both_signs;
  });
  const bool worth_it = of_both->rims.of_both_signs > clearly_more * most;
  if (worth_it) std::iter_swap(first_left, of_both);
  others.erase(first_left + (worth_it ? 1 : 0), others.end());
}

RimsSeen rims_seen(const ChannelTrials& trials, const GrayFrame& picture, Polarity polarity, bool of_both) {
  const Trial rims = trials.found_by_rims(picture, polarity);
  const double others = of_both ? trials.rims_beside(rims.disks, picture, opposite(polarity), fewest_of_other_sign) : 0;
  return {rims.shown(), rims.shown() + others};
}

// Where this channel shows the beads plainly, a look at the rims excludes the others.
std::vector<OtherChannel> others_worth_a_trial(const ChannelFrames& frames, const GrayFrame& first,
                                               const SurveyCandidate& best, const SurveyOptions& options,
                                               const Trial& here) {
  const ChannelTrials trials(frames, best, options, glance_side_px);
  const bool of_both = options.polarity == Polarity::automatic;
  std::vector<OtherChannel> others;
  for (const ChannelFrames::One& one : frames.channels) {
    if (one.channel == best.channel) continue;
    const std::optional<Polarity> polarity = trials.polarity_in(one);
    if (!polarity || (!of_both && options.polarity != *polarity)) continue;
    others.push_back({one.channel, &one.frame, *polarity, {}});
  }
  if (here.plain() || others.empty()) return others;
  RimsSeen rims;
  for_each_piece(1 + others.size(), [&](std::size_t k) {
    if (k == others.size())
      rims = rims_seen(trials, first, best.rims.polarity, of_both);
    else
      others[k].rims = rims_seen(trials, *others[k].frame, others[k].polarity, of_both);
  });
  if (others.size() > most_channels) keep_most_telling(others);
  for (OtherChannel& other : others) other.shows_more = other.rims.of_both_signs > clearly_more * rims.of_both_signs;
  // All faces are found here, and look small: they do so there if their rims do.
  if (!here.by_rims && here.complete()) std::erase_if(others, [](const OtherChannel& one) { return !one.shows_more; });
  return others;
}

}  // namespace

SurveyCandidate settle_channel(const ChannelFrames& frames, const SurveyCandidate& best, const SurveyOptions& options) {
  const ChannelTrials trials(frames, best, options, options.channel_alone ? glance_side_px : trial_side_px);
  const auto first = std::find_if(frames.channels.begin(), frames.channels.end(),
                                  [&](const ChannelFrames::One& one) { return one.channel == best.channel; });
  const bool worth_it = !options.channel_alone && large(frames);
  if ((frames.channels.size() < 2 && !worth_it) || first == frames.channels.end()) return best;
  Trial most = trials.first_trial(first->frame, options);
  SurveyCandidate settled = best;
  settled.by_rims = most.by_rims;
  settled.thorough = most.thorough;
  settled.searched = most.searched;
  const bool plain = most.plain();
  std::vector<OtherChannel> others = others_worth_a_trial(frames, first->frame, best, options, most);
  // A quick search may show fewer rims there, and a thorough one more: where beads are missed here.
  const bool by_faces_alone = most.missed <= hardly;
  const auto tried_in = [&](const OtherChannel& other) {
    return trials.trial_in(*other.frame, other.polarity, Shades::all, by_faces_alone && !other.shows_more);
  };
  std::vector<Trial> of_others(others.size());  // unless this channel is plain: hardly another is tried then
  if (!plain) for_each_piece(others.size(), [&](std::size_t k) { of_others[k] = tried_in(others[k]); });
  for (std::size_t k = 0; k < others.size(); ++k) {
    OtherChannel& other = others[k];
    if (plain && trials.alike(first->frame, *other.frame)) continue;
    const double missing = (clearly_more - 1) * most.expected;
    if (plain && trials.rims_beside(most.disks, *other.frame, options.polarity, missing) <= missing) continue;
    if (plain && options.polarity == Polarity::automatic)
      other.polarity = trials.polarity_of_radius(*other.frame, other.polarity, most.radius_px);
    Trial there = plain ? tried_in(other) : std::move(of_others[k]);
    if (!better_there(most, there)) continue;
    settled.channel = other.channel;
    settled.rims.polarity = other.polarity;
    settled.by_rims = there.by_rims;
    settled.thorough = there.thorough;
    settled.searched.reset();
    most = std::move(there);
  }
  if (worth_it && settled.by_rims && !options.roi) trials.try_faces_in_all(settled, options);
  return settled;
}

}  // namespace shakebed::ingest
