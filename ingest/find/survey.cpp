#include "ingest/find/survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/circle_census.hpp"
#include "ingest/find/drawing_signs.hpp"
#include "ingest/find/edge_map.hpp"
#include "ingest/find/lit_rim.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/find/packed_bed.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/settle_channel.hpp"
#include "ingest/frames/background_level.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// Two channels whose levels are this much alike show the same: one is enough.
constexpr double alike = 0.97;
constexpr std::size_t most_examined = 8;  // hypotheses of the census looked at in full
constexpr double cost_radius_px = 8;
constexpr double worth_a_look = 0.15;  // of the best hypothesis's gain
constexpr double few_wrong = 0.1;  // beyond it, beads whose radius is not given must make up a good part of the edges
constexpr double good_part = 0.15;
constexpr double least_explained =
    0.05;  // share of all edges on beads' rims; with beads 0.1 to 0.7, without up to 0.13
// Of beads' rims every side is seen in some; of a pattern that circles fit by chance, the same sides miss in all. So
// does the dark side of beads lit from the other. These are many, seen for the most part, and make up the picture.
constexpr double least_side = 0.15;
constexpr double one_sided_support = 0.6, one_sided_explained = 0.4, one_sided_by_chance = 0.02;
constexpr double fewest_one_sided = 20;
// So many of them are plausible where they make up this share of the edges.
constexpr double one_sided_plausible = 0.25;
constexpr const char* one_side_missing = "one side of the rim is missing from all circles";
// Radii, over which the level changes at a rim: beads up to 0.44, softly enlarged ones 0.73, noise smoothed over a
// length 1.4, blurred spots 1.6. Spots are beads where they, and little else, make up the picture.
constexpr double widest_rim = 1.1, spots_explained = 0.5;
constexpr double much_smaller = 0.7;  // radii
// px: below it a bead looks like a speck, a pore or a dot of text, and its radius has to be given.
constexpr double speck_px = 4;
// Share of the turn from which steep edges are no sign of light from one side.
constexpr double steep_all_round = 0.75;
constexpr double nearly_round = 0.02;    // radii, rms of these edges about their circle
constexpr double clearly_larger = 1.06;  // radii of the circles
constexpr std::size_t fewest_lit = 8, most_lit_starts = 2;
// Candidates whose rims are searched for a bright and a dark side: the first ones hold most circles. And by how much
// the radius found may differ from that of the circle on which both sides end: up to 4 % for drawn spheres found in the
// distance from the background, 14 to 28 % for circles through their bright sides alone.
constexpr std::size_t most_two_sided = 3;
constexpr double same_as_both_sides = 1.06;
// Of the picture's shorter side: larger radii are not proposed, since a bed shows more than two beads in a row.
constexpr double largest_proposed = 0.25;
// Circles that are not wide are believed where at least so many are seen nearly whole, and no harmonic of their
// outlines exceeds this, radii: of drawn disks of 5 to 10 px up to 0.005, with much noise 0.009; of hexagons of 8.5 px
// 0.020, and of other shapes 0.022 to 0.09.
constexpr std::ptrdiff_t fewest_whole = 3;
constexpr double nearly_whole = 0.9, clearly_round = 0.01;
// Small hexagons are as round as that, but the sixth harmonic of their outlines stands out: it is 0.0056 radii or more
// for 5.5 to 7.5 px, and 2.2 to 4.2 times the fifth. Noise makes both alike: at most 1.8 times in drawn disks.
constexpr double six_corners = 0.004, sixth_stands_out = 2;
// px, width: twice as wide, so that the shape of an outline shows in the reduced picture that circles are searched in.
constexpr double outline_tells_px = 2 * wide_enough_px;
// Few circles must be seen nearly whole: squares and ovals of a drawing are half seen as circles.
// Half as much is added where the radius is given: then something of this size is known to be there.
constexpr double least_mean_support = 0.42, support_for_few = 3.5, most_asked = 0.9;
// Of the circles: so many disks are as many.
constexpr double as_many = 0.98;
constexpr double most_of_few = 100;      // circles: of more, support_for_few asks for 4 % more at most
constexpr double least_open_rim = 0.35;  // share of the rim that others leave free, at least

// Radii: the rim of a circle is not asked for where another circle is so near.
constexpr double rim_of_another = 1.15;

// Radii: the side of the part that is looked at first, where the picture is larger; and the circles there that are
// enough to refuse a hypothesis.
constexpr double part_radii = 80;
constexpr std::ptrdiff_t fewest_in_part = 50;

// Beads that are believed in one part of a picture in which there seem to be none: so many at least, since more is
// tried.
constexpr std::size_t fewest_in_region = 10;
// Hypotheses looked at in full in each part of such a picture: most of these pictures show no beads anywhere.
constexpr std::size_t most_examined_in_parts = 2;

// Share of a circle's rim that is seen, of that which no other circle touches or covers.
double support_beside_others(const std::vector<RimDisk>& disks, std::size_t which) {
  const Circle& circle = disks[which].circle;
  int open = 0, met = 0;
  for (int k = 0; k < circle.directions; ++k) {
    const double angle = 2 * std::numbers::pi * k / circle.directions;
    const double x = circle.x + circle.radius * std::cos(angle), y = circle.y + circle.radius * std::sin(angle);
    if (std::any_of(disks.begin(), disks.end(), [&](const RimDisk& other) {
          return &other != &disks[which] &&
                 std::hypot(other.circle.x - x, other.circle.y - y) < rim_of_another * other.circle.radius;
        }))
      continue;
    ++open;
    met += static_cast<int>(circle.met >> static_cast<unsigned>(k) & 1U);
  }
  const double share = open > 0 ? static_cast<double>(met) / open : 0;
  return open >= least_open_rim * circle.directions ? std::max(circle.support, share) : circle.support;
}

// Whether circles are so few, and so little of them is seen, that squares and ovals could look like them.
bool few_and_faint(const std::vector<RimDisk>& disks, double support, bool given) {
  const auto count = static_cast<double>(disks.size());
  const auto asked = std::min(most_asked, least_mean_support + (given ? 0.5 : 1) * support_for_few / count);
  if (support / count >= asked) return false;
  if (count > most_of_few) return true;
  double open = 0;
  for (std::size_t k = 0; k < disks.size(); ++k) open += support_beside_others(disks, k);
  return open / count < asked;
}

// Share of the rims seen in the eighth of all directions where least is seen.
double least_seen_side(const std::vector<RimDisk>& disks) {
  constexpr int sides = 8;
  std::array<double, sides> met{}, looked{};
  for (const RimDisk& disk : disks)
    for (int k = 0; k < disk.circle.directions; ++k) {
      const auto side = static_cast<std::size_t>(k * sides / disk.circle.directions);
      ++looked[side];
      met[side] += static_cast<double>(disk.circle.met >> static_cast<unsigned>(k) & 1U);
    }
  double least = 1;
  for (std::size_t side = 0; side < sides; ++side)
    if (looked[side] > 0) least = std::min(least, met[side] / looked[side]);
  return least;
}

double spread_of(const GrayFrame& frame) {
  double n = 0, sum = 0, squares = 0;
  const std::size_t step = std::max<std::size_t>(1, frame.pixels.size() / 50000);
  for (std::size_t k = 0; k < frame.pixels.size(); k += step) {
    const auto level = static_cast<double>(frame.pixels[k]);
    ++n, sum += level, squares += level * level;
  }
  return n > 0 ? squares / n - sum / n * sum / n : 0;
}

// Of channels that show the same, the one of the greatest contrast.
std::vector<const ChannelFrames::One*> different_channels(const ChannelFrames& frames) {
  std::vector<std::pair<double, const ChannelFrames::One*>> ranked;
  for (const ChannelFrames::One& one : frames.channels) ranked.emplace_back(spread_of(one.frame), &one);
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<const ChannelFrames::One*> chosen;
  for (const auto& [spread, one] : ranked)
    if (std::none_of(chosen.begin(), chosen.end(), [&, candidate = one](const auto* other) {
          return likeness(candidate->frame, other->frame) > alike;
        }))
      chosen.push_back(one);
  return chosen;
}

GrayFrame only_inside(GrayFrame frame, const PixelRectangle& roi, int reduction) {
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column) {
      const int x = column * reduction, y = row * reduction;
      if (x < roi.left || y < roi.top || x >= roi.left + roi.width || y >= roi.top + roi.height)
        frame.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width) +
                     static_cast<std::size_t>(column)] = unseen_level;
    }
  return frame;
}

DrawingSigns signs_inside(const ChannelFrames& frames, const std::optional<PixelRectangle>& roi) {
  const GrayFrame& frame = frames.channels.front().frame;
  if (!roi) return signs_of_drawing(frame);
  PicturePart part;
  part.left = std::clamp(roi->left / frames.reduction, 0, frame.width - 1);
  part.top = std::clamp(roi->top / frames.reduction, 0, frame.height - 1);
  part.width = std::clamp(roi->width / frames.reduction, 1, frame.width - part.left);
  part.height = std::clamp(roi->height / frames.reduction, 1, frame.height - part.top);
  return signs_of_drawing(cut_out(frame, part));
}

constexpr const char* spots = "spots without a rim are seen, as in any blurred pattern";

// Things that are not round are no beads, nor are spots without a rim among much else.
void judge_shape(SurveyCandidate& candidate, const Roundness& roundness, bool any_shape) {
  candidate.not_round = !roundness.round();
  candidate.why_not_round = roundness.why_not();
  if (roundness.rim_width > widest_rim && candidate.explained_share < spots_explained)
    candidate.why_not = spots;
  else if (!any_shape)
    candidate.why_not = candidate.why_not_round;
}

// Whether circles without one side may be parts of beads.
bool may_be_lit(const SurveyCandidate& candidate) {
  return static_cast<double>(candidate.disks.size()) >= fewest_one_sided &&
         candidate.explained_share >= one_sided_plausible;
}

void judge(SurveyCandidate& candidate, double edge_length_px, bool given) {
  double support = 0;
  for (const RimDisk& disk : candidate.disks) {
    const double rim = 2 * std::numbers::pi * disk.circle.radius;
    const double cost = circle_cost_px * disk.circle.radius / cost_radius_px;
    candidate.gain_px += disk.probability * rim * disk.circle.support - cost;
    candidate.explained_share += disk.probability * rim * disk.circle.support / std::max(1.0, edge_length_px);
    support += disk.circle.support;
  }
  candidate.expected_wrong = expected_wrong_share(candidate.disks);
  const auto count = static_cast<double>(candidate.disks.size());
  const double wrong = candidate.expected_wrong * count;
  const double at_worst = share_by_chance_at_worst(wrong, count);
  candidate.one_sided = least_seen_side(candidate.disks) < least_side;
  const bool plainly_lit = count >= fewest_one_sided && support >= one_sided_support * count &&
                           candidate.explained_share >= one_sided_explained && at_worst <= one_sided_by_chance;
  if (candidate.disks.empty())
    candidate.why_not = "no circles are seen beyond what chance gives";
  else if (at_worst > most_by_chance || (!given && at_worst > few_wrong && candidate.explained_share < good_part))
    candidate.why_not = formatted("up to %.0f %% of the %.0f circles may be due to chance", 100 * at_worst, count);
  else if (few_and_faint(candidate.disks, support, given))
    candidate.why_not = formatted("only %.0f circles are seen, and only %.0f %% of their rims is visible", count,
                                  100 * support / count);
  else if (candidate.one_sided && !plainly_lit)
    candidate.why_not = one_side_missing;
  else if (candidate.explained_share < least_explained) {
    candidate.few_edges = true;
    candidate.why_not = formatted("the rims of the circles make up only %.1f %% of the edges in the picture",
                                  100 * candidate.explained_share);
  }
}

// Where smaller things that are not round make up more of the picture, a circle only surrounds several of them.
void compare_with_smaller(std::vector<SurveyCandidate>& candidates) {
  for (SurveyCandidate& candidate : candidates) {
    if (!candidate.credible || candidate.region) continue;
    for (const SurveyCandidate& other : candidates) {
      if (!other.not_round || other.rims.radius_px > much_smaller * candidate.rims.radius_px ||
          other.explained_share <= candidate.explained_share)
        continue;
      candidate.credible = false;
      candidate.why_not = formatted(
          "objects of %.1f px radius that are not round explain more of the edges than circles of %.1f px radius",
          other.rims.radius_px, candidate.rims.radius_px);
    }
  }
}

bool is_the_given_one(double radius, double given) {
  return radius < given_radius_factor * given && given < given_radius_factor * radius;
}

void enlarge(SurveyCandidate& candidate, int factor) {
  const double scale = factor, shift = 0.5 * (scale - 1);
  candidate.rims.radius_px *= scale;
  candidate.rims.open_radius_px *= scale;
  candidate.rims.radius_std_error_px *= scale;
  if (auto& region = candidate.region; region)
    region =
        PixelRectangle{region->left * factor, region->top * factor, region->width * factor, region->height * factor};
  for (RimDisk& disk : candidate.disks) {
    disk.circle.x = scale * disk.circle.x + shift;
    disk.circle.y = scale * disk.circle.y + shift;
    disk.circle.radius *= scale;
    disk.variance_px2 *= scale * scale;
  }
}

// Share of the edges that are gone once the beads are taken out, and their length.
void explain_edges(SurveyCandidate& candidate, const GrayFrame& frame, const PackedBed& bed) {
  FindResult found;
  found.disks = bed.disks;
  const EdgeMap edges = find_edges(frame);
  const EdgeMap left = find_edges(residual_frame(frame, found, bed.faces.calibration), edges.threshold);
  const auto all = static_cast<double>(edges.ridge.size()), rest = static_cast<double>(left.ridge.size());
  candidate.explained_share = std::max(0.0, 1 - rest / std::max(1.0, all));
  const double cost = circle_cost_px * candidate.rims.radius_px / cost_radius_px;
  candidate.gain_px = std::max(0.0, all - rest - cost * static_cast<double>(bed.disks.size()));
}

SurveyCandidate candidate_of(const PackedBed& bed, const GrayFrame& frame) {
  SurveyCandidate candidate;
  candidate.rims = rims_of(bed.faces.calibration);
  for (const FoundDisk& disk : bed.disks) {
    RimDisk rim;
    rim.circle.x = disk.x_px;
    rim.circle.y = disk.y_px;
    rim.circle.radius = candidate.rims.radius_px;
    rim.circle.support = 1;
    rim.circle.contrast = candidate.rims.contrast;
    rim.probability = disk.quality;
    rim.variance_px2 = 0.5 * (disk.variance_x + disk.variance_y);
    candidate.disks.push_back(rim);
  }
  candidate.expected_wrong = expected_wrong_share(candidate.disks);
  explain_edges(candidate, frame, bed);
  return candidate;
}

// Circles that are beads leave no room between nearest neighbours where beads touch. Circles through what blur leaves
// of rims in a packed bed do, unless the beads that would touch are too large for that.
bool leaves_room(const SurveyCandidate& candidate, int reduction) {
  constexpr double room = 1.03;
  const auto touching = touching_radius(circles_of(candidate.disks));
  return touching && *touching > room * candidate.rims.open_radius_px && *touching <= largest_packed_px * reduction;
}

// Where circles show parts of spheres lit from one side: the radius at which their lit rims lie or, where these show
// none, at which the circles would touch. Their faces tell whether they are beads.
std::optional<PackedStart> lit_start(const SurveyCandidate& candidate, const GrayFrame& frame, int reduction) {
  if (candidate.disks.size() < fewest_lit) return std::nullopt;
  std::vector<Circle> circles = circles_of(candidate.disks);
  for (Circle& circle : circles) circle = in_reduced_frame(circle, reduction);
  const auto rim = lit_rim_of(frame, circles, candidate.rims.polarity);
  const bool lit = rim && rim->steep < steep_all_round && rim->rms_radii < nearly_round;
  const bool one_sided = candidate.plausible && candidate.why_not == one_side_missing;
  const bool a_part =
      !candidate.credible || (rim && rim->radius_px > clearly_larger * candidate.rims.radius_px / reduction);
  if (!(lit || one_sided) || !a_part) return std::nullopt;
  const auto radius = rim ? std::optional(rim->radius_px) : touching_radius(circles);
  if (!radius) return std::nullopt;
  return PackedStart{candidate.rims.polarity, *radius, places_of(circles)};
}

// Of the candidate that was found, or else of all.
std::vector<PackedStart> lit_starts(const Survey& survey, const GrayFrame& frame, Channel channel, int reduction) {
  std::vector<PackedStart> starts;
  for (const SurveyCandidate& candidate : survey.candidates) {
    if (candidate.channel != channel || starts.size() == most_lit_starts) continue;
    if (auto start = lit_start(candidate, frame, reduction)) starts.push_back(std::move(*start));
    if (survey.found) break;
  }
  return starts;
}

// Radii at which the circles of the census would touch, those of the best hypotheses first.
std::vector<PackedStart> starts_from(const CircleCensus& census, const SurveyOptions& options, int reduction) {
  constexpr std::size_t most_starts = 2;
  constexpr double another = 1.08;
  if (options.radius_px) return {{options.polarity, *options.radius_px / reduction}};
  std::vector<PackedStart> starts;
  for (const CircleHypothesis& hypothesis : census.hypotheses) {
    const auto radius = touching_radius(hypothesis.seen);
    if (!radius || starts.size() >= most_starts) continue;
    if (std::none_of(starts.begin(), starts.end(), [&](const PackedStart& one) {
          return one.polarity == hypothesis.polarity &&
                 std::max(*radius / *one.radius_px, *one.radius_px / *radius) < another;
        }))
      starts.push_back({hypothesis.polarity, radius});
  }
  return starts;
}

struct SurveyedPicture {
  const GrayFrame& frame;
  Channel channel = Channel::automatic;
  int reduction = 1;
  const DrawingSigns& signs;
  const std::optional<PackedStart>& both_sides;  // spheres of which both sides were seen in another channel
};

// Beads that lie close, or are lit from one side, by their faces. They come first where they explain more than circles
// do, or are as many: of circles that leave room, or show a part of a bead, and beads, only these describe the picture.
void consider_packed_bed(Survey& survey, const SurveyedPicture& picture, const CircleCensus& census,
                         const SurveyOptions& options) {
  std::vector<PackedStart> starts = lit_starts(survey, picture.frame, picture.channel, picture.reduction);
  if (picture.both_sides) starts.insert(starts.begin(), *picture.both_sides);
  for (PackedStart& start : starts) start.distances = picture.channel == Channel::grey_distance;
  if (!survey.found || leaves_room(survey.candidates.front(), picture.reduction)) {
    const std::vector<PackedStart> others = starts_from(census, options, picture.reduction);
    starts.insert(starts.end(), others.begin(), others.end());
  }
  if (!survey.found && !options.radius_px) starts.push_back({options.polarity, std::nullopt});
  if (starts.empty()) return;
  const std::optional<PackedBed> bed = look_for_packed_bed(picture.frame, starts);
  if (!bed) return;
  SurveyCandidate candidate = candidate_of(*bed, bed->reduction > 1 ? bed->reduced_frame : picture.frame);
  candidate.channel = picture.channel;
  if (const char* why = why_drawn(picture.signs, candidate.explained_share)) candidate.why_drawn = why;
  const int reduction = picture.reduction * bed->reduction;
  enlarge(candidate, reduction);
  candidate.gain_px *= reduction;
  const bool given = !options.radius_px || is_the_given_one(candidate.rims.radius_px, *options.radius_px);
  candidate.plausible = candidate.packed = true;
  candidate.credible =
      given && candidate.explained_share >= least_explained && (candidate.why_drawn.empty() || options.any_shape);
  if (!candidate.credible) return;
  if (survey.found && survey.candidates.front().gain_px > candidate.gain_px &&
      static_cast<double>(candidate.disks.size()) <
          as_many * static_cast<double>(survey.candidates.front().disks.size()))
    return;
  survey.candidates.insert(survey.candidates.begin(), std::move(candidate));
  survey.found = true;
}

// Why no beads are found and, where what is seen is small, what helps.
std::string why_none(const Survey& survey) {
  if (survey.candidates.empty()) return "no circles are seen beyond what chance gives";
  const SurveyCandidate& best = survey.candidates.front();
  if (!best.not_round || best.rims.radius_px > coarse_px) return best.why_not;
  return best.why_not + formatted(
                            ". At a radius of %.1f px, blur alone can cause this for beads that touch: if these are "
                            "beads, photograph them at least %.0f px wide",
                            best.rims.radius_px, wide_enough_px);
}

// What is known before the hypotheses of a survey are looked at.
struct SurveyAsked {
  const SurveyOptions& options;
  const DrawingSigns& signs;
  double largest_px = 0;  // largest radius that is proposed, px of the picture
  int reduction = 1;      // of the picture
};

void move_by(SurveyCandidate& candidate, int right, int down) {
  for (RimDisk& disk : candidate.disks) disk.circle.x += right, disk.circle.y += down;
}

// A picture with its maps, which serve all hypotheses about it.
struct ExaminedPicture {
  explicit ExaminedPicture(const GrayFrame& frame) : picture(frame), maps(frame, quick_search.wanted_px) {}
  const GrayFrame& picture;
  PictureMaps maps;
};

// What a picture shows of a hypothesis, of which something is known before. `region`: where all outlines are round, if
// those elsewhere are not.
struct Examined {
  SurveyCandidate candidate;
  Roundness roundness;  // not measured where the candidate is refused for another reason
};
Examined examined_as(ExaminedPicture& of, const CircleHypothesis& hypothesis, const SurveyAsked& asked, Known known) {
  const GrayFrame& picture = of.picture;
  const bool given = asked.options.radius_px.has_value();
  LearnedRims learned = learn_rims(of.maps, hypothesis.polarity, hypothesis.radius_px, known);
  Examined out;
  SurveyCandidate& candidate = out.candidate;
  candidate.rims = std::move(learned.model);
  candidate.disks = std::move(learned.disks);
  judge(candidate, learned.edge_length_px, given);
  const bool lit = candidate.why_not == one_side_missing && may_be_lit(candidate);
  candidate.plausible = (candidate.why_not.empty() || lit) && candidate.rims.radius_px <= asked.largest_px;
  if (const char* why = why_drawn(asked.signs, candidate.explained_share)) candidate.why_drawn = why;
  if (candidate.why_not.empty() && !asked.options.any_shape) candidate.why_not = candidate.why_drawn;
  if (candidate.why_not.empty()) {
    out.roundness = roundness_of(of.maps, candidate.rims, candidate.disks);
    judge_shape(candidate, out.roundness, asked.options.any_shape);
    const bool outlines_tell = candidate.rims.radius_px > coarse_px && !asked.options.any_shape && !asked.options.roi;
    if (out.roundness.round_side && outlines_tell)
      candidate.region = part_on(*out.roundness.round_side, picture.width, picture.height);
  }
  candidate.plausible = candidate.plausible && candidate.why_not != spots;
  return out;
}

bool is_clearly_round(const Roundness& roundness) {
  const auto& harmonic = roundness.harmonic;
  return roundness.outlines > 0 && *std::max_element(harmonic.begin() + 3, harmonic.end()) <= clearly_round &&
         harmonic[6] <= std::max(six_corners, sixth_stands_out * harmonic[5]);
}

// Of a hypothesis whose circles are seen whole and are clearly rounder than small hexagons: what is seen of it.
// Stretched copies of such disks pass as parts of circles, and say nothing against them.
std::optional<SurveyCandidate> examined_as_closed(ExaminedPicture& of, const CircleHypothesis& hypothesis,
                                                  const SurveyAsked& asked) {
  const auto whole = std::count_if(hypothesis.seen.begin(), hypothesis.seen.end(),
                                   [](const Circle& circle) { return circle.support >= nearly_whole; });
  if (whole < fewest_whole) return std::nullopt;
  Examined out = examined_as(of, hypothesis, asked, Known::wide);
  if (!out.candidate.why_not.empty() || !is_clearly_round(out.roundness)) return std::nullopt;
  return std::move(out.candidate);
}

SurveyCandidate examined(ExaminedPicture& of, const CircleHypothesis& hypothesis, const SurveyAsked& asked) {
  const bool given = asked.options.radius_px.has_value();
  const double width = 2 * hypothesis.radius_px;
  const Known unasked = width >= outline_tells_px ? Known::wide
                        : width >= wide_enough_px ? Known::fairly_wide
                                                  : Known::nothing;
  SurveyCandidate candidate = examined_as(of, hypothesis, asked, given ? Known::radius : unasked).candidate;
  if (given || unasked == Known::wide || candidate.why_not.empty() || candidate.not_round) return candidate;
  return examined_as_closed(of, hypothesis, asked).value_or(std::move(candidate));
}

// Of a picture in which the circles are small, the part in which most of them were seen. None where the part would be
// the picture.
std::optional<PicturePart> part_of(const GrayFrame& picture, const CircleHypothesis& hypothesis) {
  const int side = static_cast<int>(part_radii * hypothesis.radius_px);
  if (std::min(picture.width, picture.height) <= side) return std::nullopt;
  return part_with_most(places_of(hypothesis.seen), side, picture.width, picture.height);
}

// What a part shows where it is enough to refuse a hypothesis: chance, other edges and outlines are no better in the
// rest of the picture, and the circles that the census saw there are so many that their number does not matter.
std::optional<SurveyCandidate> refused_by_part(const GrayFrame& picture, const CircleHypothesis& hypothesis,
                                               const SurveyAsked& asked) {
  const std::optional<PicturePart> part = part_of(picture, hypothesis);
  if (!part) return std::nullopt;
  const auto seen = std::count_if(hypothesis.seen.begin(), hypothesis.seen.end(),
                                  [&](const Circle& circle) { return part->holds(circle.x, circle.y); });
  if (seen < fewest_in_part) return std::nullopt;
  const GrayFrame cut = cut_out(picture, *part);
  ExaminedPicture alone(cut);
  SurveyCandidate candidate = examined(alone, hypothesis, asked);
  if (candidate.why_not.empty() || candidate.region) return std::nullopt;
  move_by(candidate, part->left, part->top);
  return candidate;
}

// In all of the picture, or where the things seen are round.
SurveyCandidate examined_where_round(ExaminedPicture& of, const CircleHypothesis& hypothesis,
                                     const SurveyAsked& asked) {
  const GrayFrame& picture = of.picture;
  if (std::optional<SurveyCandidate> refused = refused_by_part(picture, hypothesis, asked)) return std::move(*refused);
  SurveyCandidate all = examined(of, hypothesis, asked);
  const std::optional<PixelRectangle> region = std::exchange(all.region, std::nullopt);
  if (!region) return all;
  const GrayFrame cut = cut_out(picture, {region->left, region->top, region->width, region->height});
  ExaminedPicture alone(cut);
  SurveyCandidate there = examined(alone, hypothesis, asked);
  if (!there.why_not.empty()) return all;
  move_by(there, region->left, region->top);
  there.region = region;
  return there;
}

// Of a candidate in the frames that were read, which becomes one of the full frame.
void settle_credibility(SurveyCandidate& candidate, int reduction, const SurveyOptions& options) {
  enlarge(candidate, reduction);
  candidate.gain_px *= reduction;
  if (options.radius_px && !is_the_given_one(candidate.rims.radius_px, *options.radius_px))
    candidate.why_not =
        formatted("the circles seen have a radius of %.1f px, which is not within 25 %% of the given %.1f px",
                  candidate.rims.radius_px, *options.radius_px);
  candidate.credible = candidate.why_not.empty();
  if (candidate.credible && !options.radius_px && candidate.rims.radius_px < speck_px) {
    candidate.credible = false;
    candidate.why_not = formatted(
        "circles of %.1f px radius are seen, too small to be distinguished from specks (at least %.0f px is needed). "
        "Photograph the beads with more pixels, or give their radius",
        candidate.rims.radius_px, speck_px);
  }
}

// Share of the circles of a hypothesis that lie on or in the disks of a candidate, about the same centres: the same
// beads, their highlights or rings in them.
double share_within(const std::vector<RimDisk>& disks, const CircleHypothesis& hypothesis, int reduction) {
  constexpr double same_place = 0.3, most_of_its_radius = 1.12;  // radii; as in a search for beads of one kind
  const double radius = hypothesis.radius_px * reduction;
  const Nearby near(disks.size(), same_place * radius,
                    [&](std::size_t i) { return std::pair(disks[i].circle.x, disks[i].circle.y); });
  double among = 0;
  for (const Circle& circle : hypothesis.seen) {
    const double shift = 0.5 * (reduction - 1);
    const double x = reduction * circle.x + shift, y = reduction * circle.y + shift, its = reduction * circle.radius;
    among += near.any_near(x, y, [&](std::size_t i) {
      const Circle& disk = disks[i].circle;
      return its < most_of_its_radius * disk.radius;
    });
  }
  return among / std::max(1.0, static_cast<double>(hypothesis.seen.size()));
}

// Whether a candidate is the beads of a hypothesis: credible, and of a radius from which the search would end there, or
// with its circles on those disks. Of few circles, or of several sizes, the search may end elsewhere.
bool is_known(const Survey& survey, const CircleHypothesis& hypothesis, Channel channel, int reduction) {
  constexpr double searched_around = 1.07, nearly_all = 0.9;
  return std::any_of(survey.candidates.begin(), survey.candidates.end(), [&](const SurveyCandidate& known) {
    const double ratio = hypothesis.radius_px * reduction / known.rims.radius_px;
    return known.credible && !known.region && std::ssize(known.disks) >= fewest_in_part && known.channel == channel &&
           known.rims.polarity == hypothesis.polarity &&
           (std::max(ratio, 1 / ratio) < searched_around ||
            share_within(known.disks, hypothesis, reduction) >= nearly_all);
  });
}

// Whether beads make up the picture, so that other channels would show the same. Where one shows more of them, or
// shows them better, settle_channel() finds out.
bool shows_beads_plainly(const Survey& survey) {
  constexpr double most_of_all_edges = 0.5, hardly_wrong = 0.02;
  return std::any_of(survey.candidates.begin(), survey.candidates.end(), [&](const SurveyCandidate& one) {
    return one.credible && !one.region && std::ssize(one.disks) >= fewest_in_part &&
           one.explained_share >= most_of_all_edges && one.expected_wrong <= hardly_wrong;
  });
}
bool may_show_beads_plainly(const CircleCensus& census) {
  constexpr double hardly_by_chance = 0.02;
  return !census.hypotheses.empty() && census.hypotheses.front().circles >= static_cast<double>(fewest_in_part) &&
         census.hypotheses.front().by_chance <= hardly_by_chance * census.hypotheses.front().circles;
}

enum class Effort { full, glance };

// Channels of a picture and the frames searched in them.
struct SearchedChannels {
  std::vector<const ChannelFrames::One*> channels;
  std::vector<GrayFrame> cropped;
  std::vector<const GrayFrame*> pictures;
};
SearchedChannels channels_to_search(const ChannelFrames& frames, const SurveyOptions& options, Effort effort) {
  SearchedChannels out;
  out.channels = different_channels(frames);
  if (effort == Effort::glance) out.channels.resize(1);
  if (options.roi)
    for (const auto* one : out.channels) out.cropped.push_back(only_inside(one->frame, *options.roi, frames.reduction));
  for (std::size_t k = 0; k < out.channels.size(); ++k)
    out.pictures.push_back(options.roi ? &out.cropped[k] : &out.channels[k]->frame);
  return out;
}

void examine(const CircleCensus& census, const SearchedChannels& in, const SurveyAsked& asked, std::size_t most,
             Survey& survey) {
  std::optional<ExaminedPicture> last;  // of one channel at a time: maps are large
  for (const CircleHypothesis& hypothesis : census.hypotheses) {
    if (survey.candidates.size() >= most) break;
    if (hypothesis.hopeless()) continue;
    if (hypothesis.gain_px < worth_a_look * census.hypotheses.front().gain_px) continue;
    const Channel channel = in.channels[hypothesis.channel]->channel;
    if (!asked.options.radius_px && is_known(survey, hypothesis, channel, asked.reduction)) continue;
    const GrayFrame& picture = *in.pictures[hypothesis.channel];
    if (!last || &last->picture != &picture) last.emplace(picture);
    survey.candidates.push_back(examined_where_round(*last, hypothesis, asked));
    survey.candidates.back().channel = channel;
    settle_credibility(survey.candidates.back(), asked.reduction, asked.options);
  }
}

// The census of the channels that were searched, and what its hypotheses came to: of the first channel, and of the
// others where that one does not show beads plainly.
CircleCensus examine_channels(const SearchedChannels& in, const CensusOptions& options, const SurveyAsked& asked,
                              std::size_t most, Survey& survey) {
  CircleCensus census = census_of(*in.pictures.front(), 0, options);
  const bool first_alone = in.pictures.size() == 1;
  if (first_alone || may_show_beads_plainly(census)) examine(census, in, asked, most, survey);
  if (first_alone || shows_beads_plainly(survey)) return census;
  survey.candidates.clear();
  std::vector<CircleCensus> others(in.pictures.size() - 1);
  for_each_piece(others.size(), [&](std::size_t k) { others[k] = census_of(*in.pictures[k + 1], k + 1, options); });
  for (const CircleCensus& other : others) add_census(other, census);
  examine(census, in, asked, most, survey);
  return census;
}

Survey survey_of_all(const ChannelFrames& frames, const SurveyOptions& options, Effort effort,
                     const std::optional<PackedStart>& both_sides = {}) {
  Survey survey;
  const SearchedChannels in = channels_to_search(frames, options, effort);
  const std::vector<const ChannelFrames::One*>& channels = in.channels;
  const std::vector<const GrayFrame*>& pictures = in.pictures;
  CensusOptions asked;
  asked.polarity = options.polarity;
  const DrawingSigns signs = signs_inside(frames, options.roi);
  if (options.radius_px) asked.radius_px = *options.radius_px / frames.reduction;
  const SurveyAsked asked_of_each{
      options, signs, largest_proposed * std::min(frames.width, frames.height) / frames.reduction, frames.reduction};
  const CircleCensus census = examine_channels(in, asked, asked_of_each,
                                               effort == Effort::full ? most_examined : most_examined_in_parts, survey);
  if (!options.any_shape) compare_with_smaller(survey.candidates);
  std::stable_sort(survey.candidates.begin(), survey.candidates.end(),
                   [](const SurveyCandidate& a, const SurveyCandidate& b) {
                     if (a.credible != b.credible) return a.credible;
                     return a.gain_px > b.gain_px;
                   });
  survey.found = !survey.candidates.empty() && survey.candidates.front().credible;
  if (effort == Effort::glance && !survey.found) return survey;
  if (both_sides || !survey.found || !survey.candidates.front().region) {
    const std::size_t channel = census.hypotheses.empty() ? 0 : census.hypotheses.front().channel;
    SurveyedPicture picture{*pictures[channel], channels[channel]->channel, frames.reduction, signs, both_sides};
    consider_packed_bed(survey, picture, census, options);
  }
  if (survey.found) {
    SurveyOptions in_region = options;
    if (!options.roi) in_region.roi = survey.candidates.front().region;
    SurveyCandidate settled = settle_channel(frames, survey.candidates.front(), in_region);
    if (settled.channel == survey.candidates.front().channel)
      survey.candidates.front() = std::move(settled);
    else
      survey.candidates.insert(survey.candidates.begin(), std::move(settled));
  }
  if (!survey.found) survey.why_not = why_none(survey);
  return survey;
}

bool are_the_same(double radius, double other) { return std::max(radius / other, other / radius) < same_as_both_sides; }

// Spheres lit from one side, whose other side is darker than the background: the circle on which both sides end, px of
// the frames that were read.
std::optional<PackedStart> both_sides_of(const SurveyCandidate& candidate, const GrayFrame& frame, int reduction) {
  std::vector<Circle> circles = circles_of(candidate.disks);
  for (Circle& circle : circles) circle = in_reduced_frame(circle, reduction);
  const auto rim = rim_of_both_sides(frame, circles);
  if (!rim) return std::nullopt;
  Places places = places_of(circles);
  for (auto& [x, y] : places) x += rim->right_px, y += rim->down_px;
  return PackedStart{Polarity::bright_beads, rim->radius_px, std::move(places)};
}

// Of the first candidates that show it, each with circles of its own.
std::optional<PackedStart> both_sides_seen(const Survey& survey, const ChannelFrames& frames) {
  std::vector<const SurveyCandidate*> looked;
  for (const SurveyCandidate& candidate : survey.candidates) {
    const bool known = std::any_of(looked.begin(), looked.end(), [&](const SurveyCandidate* one) {
      return one->channel == candidate.channel && one->rims.polarity == candidate.rims.polarity &&
             are_the_same(one->rims.radius_px, candidate.rims.radius_px);
    });
    if (known || candidate.disks.size() < fewest_lit || looked.size() == most_two_sided) continue;
    looked.push_back(&candidate);
    const auto its = std::find_if(frames.channels.begin(), frames.channels.end(),
                                  [&](const ChannelFrames::One& one) { return one.channel == candidate.channel; });
    if (its == frames.channels.end()) continue;
    if (auto start = both_sides_of(candidate, its->frame, frames.reduction)) return start;
  }
  return std::nullopt;
}

// Where a bright and a dark side are seen and the candidate, if any, shows one of them: the survey of what differs from
// the background, in which both sides are bright. It counts if it shows what both sides do.
std::optional<Survey> survey_of_both_sides(const ChannelFrames& frames, const Survey& survey,
                                           const SurveyOptions& options) {
  const bool any_channel = frames.channels.size() > 1 || frames.channels.front().channel == Channel::automatic;
  if (!any_channel || options.polarity == Polarity::dark_beads) return std::nullopt;
  const std::optional<PackedStart> seen = both_sides_seen(survey, frames);
  if (!seen) return std::nullopt;
  const auto shows_them = [&](const Survey& one) {
    return one.found && are_the_same(one.candidates.front().rims.radius_px, *seen->radius_px * frames.reduction);
  };
  if (shows_them(survey)) return std::nullopt;
  const ChannelFrames distance{
      frames.reduction, frames.width, frames.height, {{Channel::grey_distance, grey_distance_of(frames)}}};
  Survey of_both = survey_of_all(distance, options, Effort::full, seen);
  if (!shows_them(of_both)) return std::nullopt;
  return of_both;
}

// In one part of the frames. `part`: px of the frames that were read.
Survey survey_of_part(const ChannelFrames& frames, const PicturePart& part, const SurveyOptions& options) {
  ChannelFrames cut;
  cut.reduction = frames.reduction;
  cut.width = part.width * frames.reduction, cut.height = part.height * frames.reduction;
  for (const ChannelFrames::One& one : frames.channels) {
    cut.channels.push_back({one.channel, cut_out(one.frame, part)});
    cut.channels.back().frame.enlargement = one.frame.enlargement;
  }
  Survey survey = survey_of_all(cut, options, Effort::glance);
  const int left = part.left * frames.reduction, top = part.top * frames.reduction;
  for (SurveyCandidate& candidate : survey.candidates) {
    move_by(candidate, left, top);
    PixelRectangle region = candidate.region.value_or(PixelRectangle{0, 0, cut.width, cut.height});
    region.left += left, region.top += top;
    candidate.region = region;
  }
  return survey;
}

}  // namespace

SearchedFrame::SearchedFrame(GrayFrame frame, int reduction, FindOptions options, CalibrationResult learned)
    : frame_(std::move(frame)), reduction_(reduction), options_(std::move(options)), learned_(std::move(learned)) {}

std::optional<CalibrationResult> SearchedFrame::take(const GrayFrame& frame, const FindOptions& options) {
  const bool same = frame.width == frame_.width && options == options_ && frame.pixels == frame_.pixels;
  frame_ = {};
  std::optional<CalibrationResult> learned = std::exchange(learned_, std::nullopt);
  return same ? std::move(learned) : std::nullopt;
}

Survey take_survey(const ChannelFrames& frames, const SurveyOptions& options) {
  Survey survey = survey_of_all(frames, options, Effort::full);
  if (frames.channels.empty()) return survey;
  if (std::optional<Survey> of_both = survey_of_both_sides(frames, survey, options)) return std::move(*of_both);
  if (survey.found || options.roi) return survey;
  for (const PicturePart& part : parts_that_differ(frames.channels.front().frame)) {
    Survey there = survey_of_part(frames, part, options);
    if (there.found && there.candidates.front().disks.size() >= fewest_in_region) return there;
  }
  return survey;
}

}  // namespace shakebed::ingest
