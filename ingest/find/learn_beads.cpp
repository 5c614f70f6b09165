#include "ingest/find/learn_beads.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/find/learn_from_part.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/find/other_shade.hpp"
#include "ingest/find/packed_bed.hpp"
#include "ingest/find/rim_line.hpp"
#include "ingest/find/rim_shape.hpp"

namespace shakebed::ingest {

namespace {

constexpr double same_bead = 0.3;            // radii, between a face and a rim that are one bead
constexpr double surely_a_bead = 0.9;        // probability of a rim from which the faces must have it too
constexpr double most_missed_faces = 0.06;   // share of these that faces may miss
constexpr double support_without_rim = 0.2;  // support below which a face has no rim at all
constexpr double most_rimless = 0.35;        // share of the faces without a rim beyond which they are something else
// Radii: pixels so near to a face without a rim, and to none with one, are left out. A jammed tiling leaves voids of up
// to half a radius between its disks.
constexpr double left_out_reach = 1.5;
constexpr int most_left_out_rounds = 3;
// A face's radius over that of the rims, which hidden parts make smaller: black beads in a packed bed 1.05,
// photoelastic disks 1.04 to 1.06. A face smaller than the rims is a part of the bead.
constexpr double least_ratio = 0.97, most_ratio = 1.15;
constexpr double plainly_seen = 0.8;  // mean share of the rims
constexpr double well_explained =
    0.35;  // of the edges: where most beads were found by rims 0.35 to 0.85, else 0.10 to 0.34
// Radii: beads are looked for no farther from the region given.
constexpr double beyond_region = 4;
// Radii round a face without a rim in which its neighbours are counted; those with a rim are at least so many, and so
// many times those without. Two that are nearer than this may be faces of one bead.
constexpr double company_reach = 2.8, nearest_company = 1.75;
constexpr std::size_t fewest_company = 3, share_of_company = 2;
constexpr double whole_quality = 0.9;  // of a face that looks like all others: a bead though its rim is hidden

// Of the frame that is learned from, whose edges are asked for several times.
struct MapsOfFrame {
  const GrayFrame& frame;
  PictureMaps quick{frame, quick_search.wanted_px}, thorough{frame, thorough_search.wanted_px};
  Places beads{};  // that the quick search shows
};

// What a face is by its rim, or by that of its neighbours where it has none: blur, or a neighbour, hides the rims of
// small beads. Faces that tile something else have one another for neighbours.
enum class Standing { has_rim, among_beads, doubled_among_beads, alone };
// `rims` are those at the places of the faces.
std::vector<Standing> standing_of(const std::vector<Circle>& faces, const std::vector<Circle>& rims) {
  std::vector<Standing> standing(faces.size(), Standing::has_rim);
  if (faces.empty()) return standing;
  const auto rimless = [&](std::size_t i) { return rims[i].support < support_without_rim; };
  const double radius = faces.front().radius;
  const Nearby near(faces.size(), company_reach * radius,
                    [&](std::size_t i) { return std::pair(faces[i].x, faces[i].y); });
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (!rimless(k)) continue;
    std::size_t with = 0, without = 0;
    bool doubled = false;
    near.any_near(faces[k].x, faces[k].y, [&](std::size_t i) {
      if (i == k) return false;
      ++(rimless(i) ? without : with);
      doubled = doubled || std::hypot(faces[i].x - faces[k].x, faces[i].y - faces[k].y) < nearest_company * radius;
      return false;
    });
    const bool among = with >= fewest_company && with >= share_of_company * without;
    standing[k] = !among ? Standing::alone : doubled ? Standing::doubled_among_beads : Standing::among_beads;
  }
  return standing;
}

// A face whose rim is doubtful is a bead where beads are.
void drop_lonely_doubtful(FindResult& found, double radius) {
  constexpr double doubtful = 0.8, near = 3.5;  // probability, radii
  std::vector<FoundDisk> sure, kept;
  for (const FoundDisk& disk : found.disks)
    if (disk.probability >= doubtful) sure.push_back(disk);
  const Nearby near_sure(sure.size(), near * radius,
                         [&](std::size_t i) { return std::pair(sure[i].x_px, sure[i].y_px); });
  for (const FoundDisk& disk : found.disks)
    if (disk.probability >= doubtful || near_sure.any_near(disk.x_px, disk.y_px)) kept.push_back(disk);
  found.rejected += found.disks.size() - kept.size();
  found.disks = std::move(kept);
}

// Takes out faces without a rim, and gives the others their probability.
void check_by_rims(const GrayFrame& frame, const RimModel& rims, FindResult& found) {
  const std::vector<Circle> places = circles_of(found.disks);
  const std::vector<Circle> circles = rims_at(frame, rims, places);
  const std::vector<Standing> standing = standing_of(places, circles);
  std::vector<FoundDisk> kept;
  for (std::size_t k = 0; k < circles.size(); ++k) {
    FoundDisk disk = found.disks[k];
    // A cut bead may show too little of its rim: it is doubtful, and stays where beads are.
    const bool stands = standing[k] == Standing::has_rim || standing[k] == Standing::among_beads;
    if (!stands && !disk.cut) {
      ++found.rejected;
      continue;
    }
    const bool whole = stands && disk.quality >= whole_quality;
    disk.probability = std::max(rims.probability_of(circles[k].support), whole ? 0.95 : 0.5);
    kept.push_back(disk);
  }
  found.disks = std::move(kept);
  drop_lonely_doubtful(found, rims.radius_px);
  if (found.disks.empty() && found.why_nothing.empty()) found.why_nothing = "none of the disks has a visible rim";
}

// Of all beads: those that rims show and that are not reported, or those that seem to lie between the disks found,
// whichever are more.
double share_missed(PictureMaps& maps, const RimModel& rims, const std::vector<Circle>& found, double by_rims,
                    const std::optional<PixelRectangle>& region) {
  return share_of_missed(std::max(by_rims, expected_missed_beads(maps, rims, found, region)), found.size());
}

struct Agreement {
  double missed = 0;                  // share of the sure rims that no face has
  double missed_beads = 0;            // that rims show and faces do not
  double rimless = 0;                 // share of the faces
  std::vector<Circle> faces, no_rim;  // whole faces with a rim or among such, and others beside them
  std::vector<Circle> all;            // these and those that are cut
  bool not_round = false;             // more of the faces have rims that are plainly not round than errors make so
  [[nodiscard]] bool good() const { return missed <= most_missed_faces && rimless <= most_rimless && !not_round; }
};
Agreement compare(PictureMaps& maps, const LearnedRims& rims, const FindResult& faces) {
  Agreement agreement;
  const double near = same_bead * rims.model.radius_px;
  const Nearby by_face(faces.disks.size(), near,
                       [&](std::size_t i) { return std::pair(faces.disks[i].x_px, faces.disks[i].y_px); });
  const double face_radius = faces.disks.empty() ? 0 : faces.disks.front().radius_px;
  const Nearby on_a_face(faces.disks.size(), std::max(near, 0.8 * face_radius),
                         [&](std::size_t i) { return std::pair(faces.disks[i].x_px, faces.disks[i].y_px); });
  double sure = 0, missed = 0;
  for (const RimDisk& rim : rims.disks) {
    const bool has_no_face = !by_face.any_near(rim.circle.x, rim.circle.y);
    // A circle over a bead that was found is no other bead.
    if (has_no_face && !on_a_face.any_near(rim.circle.x, rim.circle.y)) agreement.missed_beads += rim.probability;
    if (rim.probability < surely_a_bead) continue;
    ++sure;
    missed += has_no_face;
  }
  agreement.missed = sure > 0 ? missed / sure : 1;
  std::vector<Circle> places;
  agreement.all = circles_of(faces.disks);
  for (std::size_t k = 0; k < faces.disks.size(); ++k)
    if (!faces.disks[k].cut) places.push_back(agreement.all[k]);
  const std::vector<Circle> circles = rims_at(maps, rims.model, places);
  const std::vector<Standing> standing = standing_of(places, circles);
  std::vector<Circle> seen_rims;  // of the faces
  double rimless = 0;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const bool stands = standing[k] == Standing::has_rim || standing[k] == Standing::among_beads;
    if (stands) agreement.faces.push_back(places[k]), seen_rims.push_back(circles[k]);
    if (standing[k] == Standing::alone) agreement.no_rim.push_back(places[k]);
    rimless += stands ? 0 : 1;
  }
  if (!places.empty()) agreement.rimless = rimless / static_cast<double>(places.size());
  const std::vector<RimShape> shapes = shapes_of_rims(maps, rims.model, agreement.faces, agreement.all);
  const Departing departing = departing_of(shapes, seen_rims, shared_second(shapes));
  agreement.not_round = departing.more_than_seem() && !departing.most();  // most: the survey has judged them
  return agreement;
}

void paint(std::vector<std::uint8_t>& pixels, const GrayFrame& frame, const Circle& circle, std::uint8_t value) {
  const double reach = left_out_reach * circle.radius;
  const int top = std::max(0, static_cast<int>(std::ceil(circle.y - reach)));
  const int bottom = std::min(frame.height - 1, static_cast<int>(std::floor(circle.y + reach)));
  for (int row = top; row <= bottom; ++row) {
    const double half = std::sqrt(std::max(0.0, reach * reach - (row - circle.y) * (row - circle.y)));
    const int left = std::max(0, static_cast<int>(std::ceil(circle.x - half)));
    const int right = std::min(frame.width - 1, static_cast<int>(std::floor(circle.x + half)));
    const auto line = pixels.begin() + static_cast<std::ptrdiff_t>(row) * frame.width;
    if (left <= right) std::fill(line + left, line + right + 1, value);
  }
}

// Faces without rims where none with a rim is near: surroundings as bright as the beads, which faces tile. Beads, light
// and profile are learned again without them.
class FacesAndRims {
 public:
  FacesAndRims(const std::vector<const GrayFrame*>& frames, MapsOfFrame& maps, const FindOptions& asked,
               const LearnedRims& rims)
      : frames_(frames), maps_(maps), asked_(asked), rims_(rims) {}

  // Faces that are larger than the rims, if learn() found such and nothing else.
  std::optional<CalibrationResult> larger() { return std::exchange(larger_, std::nullopt); }

  // The calibration by faces, if faces and rims agree.
  std::optional<CalibrationResult> learn() {
    CalibrationResult faces = learn_finder_from_part(frames_, asked_, maps_.beads);
    for (int round = 0;; ++round) {
      faces.calibration.left_out = left_out_;
      const double ratio = faces.found ? faces.calibration.radius_px / rims_.model.radius_px : 0;
      if (!(ratio > least_ratio && ratio < most_ratio)) {
        if (ratio >= most_ratio && !left_out_) larger_ = std::move(faces);
        return std::nullopt;
      }
      const GrayFrame& frame = *frames_.back();
      const FindResult found = find_disks(frame, faces.calibration, asked_);
      const Agreement agreement = compare(maps_.quick, rims_, found);
      if (agreement.good()) {
        faces.calibration.rims = rims_.model;
        faces.calibration.expected_missed =
            share_missed(maps_.quick, rims_.model, agreement.all, agreement.missed_beads, asked_.roi);
        faces.calibration.rims_to_be_checked = agreement.rimless > 0 || left_out_;
        // Rims of a packed bed that blur has closed say nothing against its faces.
        if (agreement.rimless > 0 && !left_out_) use_packing(faces, found, agreement.all);
        if (!faces.calibration.rims_to_be_checked) faces.in_last_frame = found;
        return faces;
      }
      if (round == most_left_out_rounds || agreement.rimless <= most_rimless) return std::nullopt;
      leave_out(agreement);
      faces = learn_without();
    }
  }

 private:
  void use_packing(CalibrationResult& faces, const FindResult& found, const std::vector<Circle>& all) const {
    tell_radius(faces);
    FinderCalibration& calibration = faces.calibration;
    const GrayFrame& frame = *frames_.back();
    if (!packing_of(frame, found, calibration).convinces()) return;
    calibration.rims = rims_of(calibration);
    calibration.rims_to_be_checked = false;
    calibration.expected_missed = share_missed(maps_.quick, *calibration.rims, all, 0, asked_.roi);
  }

  void leave_out(const Agreement& agreement) {
    const GrayFrame& frame = *frames_.back();
    std::vector<std::uint8_t> pixels = left_out_ ? *left_out_ : std::vector<std::uint8_t>(frame.pixels.size(), 0);
    for (const Circle& circle : agreement.no_rim) paint(pixels, frame, circle, 1);
    for (const Circle& circle : agreement.faces) paint(pixels, frame, circle, 0);
    left_out_ = std::make_shared<const std::vector<std::uint8_t>>(std::move(pixels));
  }

  CalibrationResult learn_without() {
    FinderCalibration parts;
    parts.left_out = left_out_;
    std::vector<GrayFrame> seen;
    for (const GrayFrame* frame : frames_)
      if (frame->pixels.size() == left_out_->size()) seen.push_back(seen_part(*frame, parts));
    std::vector<const GrayFrame*> pointers;
    for (const GrayFrame& frame : seen) pointers.push_back(&frame);
    return learn_finder(pointers, asked_);
  }

  const std::vector<const GrayFrame*>& frames_;
  MapsOfFrame& maps_;  // of the last of them
  const FindOptions& asked_;
  const LearnedRims& rims_;
  std::shared_ptr<const std::vector<std::uint8_t>> left_out_;
  std::optional<CalibrationResult> larger_;
};

// Beads that lie close and whose rims mislead, by their faces.
std::optional<CalibrationResult> as_packed(PackedBed bed, MapsOfFrame& maps, const FindOptions& options) {
  if (!bed.faces.found) return std::nullopt;
  FinderCalibration& calibration = bed.faces.calibration;
  calibration.rims = rims_of(calibration);
  calibration.expected_missed = share_missed(maps.quick, *calibration.rims, circles_of(bed.disks), 0, options.roi);
  bed.faces.in_last_frame.emplace().disks = std::move(bed.disks);
  bed.faces.packed = true;
  return std::move(bed.faces);
}

// The same, learned from each of these radii in turn.
std::optional<CalibrationResult> learn_packed(const std::vector<const GrayFrame*>& frames, MapsOfFrame& maps,
                                              const FindOptions& options, const std::vector<double>& radii_px) {
  FindOptions find = options;
  find.polarity = options.seen->polarity;
  for (const double radius : radii_px) {
    find.radius_px = radius;
    if (auto packed = as_packed(learn_packed_bed(frames, find, maps.beads), maps, options)) return packed;
  }
  return std::nullopt;
}

// The radius that is given or was seen, and, of circles that are too small, half the distance between their centres.
std::vector<double> packed_radii(const FindOptions& options, const LearnedRims& rims) {
  std::vector<double> radii = {options.radius_px.value_or(options.seen->radius_px)};
  if (const auto touching = touching_radius(circles_of(rims.disks)); touching && !options.radius_px)
    radii.push_back(*touching);
  return radii;
}

// Disks that agree with the rims and lie apart, all equally far, may be the bright part of shaded spheres that touch:
// these describe the frame as well, then.
std::optional<CalibrationResult> learn_touching(const std::vector<const GrayFrame*>& frames, MapsOfFrame& maps,
                                                const FindOptions& options, const CalibrationResult& faces) {
  if (options.radius_px || !faces.in_last_frame) return std::nullopt;
  const auto touching = radius_beyond(circles_of(faces.in_last_frame->disks), faces.calibration.radius_px);
  return touching ? learn_packed(frames, maps, options, {*touching}) : std::nullopt;
}

// Circles that were not counted; what both searches found once.
std::vector<Circle> not_round_of(const RimModel& model, const RimsFound& seen) {
  std::vector<Circle> circles = seen.not_round;
  if (model.gaps) circles.insert(circles.end(), model.gaps->not_round.begin(), model.gaps->not_round.end());
  constexpr double one_thing = 0.8;  // sums of radii
  return without_doubles(std::move(circles), one_thing);
}

// What rims cannot show: that more beads are there.
void warn_of_poor_rims(const LearnedRims& rims, const RimsFound& seen, FinderCalibration& calibration) {
  double support = 0, others = 0, smallest = HUGE_VAL, largest = 0, explained = 0;
  for (const RimDisk& disk : seen.disks) {
    support += disk.circle.support / static_cast<double>(seen.disks.size());
    others += disk.other_size;
    smallest = std::min(smallest, disk.circle.radius), largest = std::max(largest, disk.circle.radius);
    explained += disk.probability * 2 * std::numbers::pi * disk.circle.radius * disk.circle.support;
  }
  char text[300];
  if (support < plainly_seen) {
    std::snprintf(text, sizeof text,
                  "Beads were found by their rims alone. On average only %.0f %% of a rim is visible: beads may be "
                  "missed, and centres may be wrong by a tenth of a radius. Look at the overlays.",
                  100 * support);
    calibration.warnings.emplace_back(text);
  }
  const double share = explained / std::max(1.0, rims.edge_length_px);
  if (share < well_explained) {
    std::snprintf(text, sizeof text,
                  "The rims of the beads found explain only %.0f %% of the edges in the picture. More beads, or beads "
                  "of other sizes, may be present. Look at the overlays.",
                  100 * share);
    calibration.warnings.emplace_back(text);
  }
  if (const std::vector<Circle> left_out = not_round_of(*calibration.rims, seen); !left_out.empty())
    calibration.warnings.push_back(left_out_as_not_round(left_out, calibration.recorded_px));
  if (others > 0) {
    std::snprintf(text, sizeof text,
                  "Beads of several sizes were found, with radii from %.1f to %.1f px. In the first frame %.0f of %zu "
                  "beads do not have the most frequent size, to which the diameter refers.",
                  smallest * calibration.recorded_px, largest * calibration.recorded_px, others, seen.disks.size());
    calibration.warnings.emplace_back(text);
  }
}

double share_missed_of(PictureMaps& maps, const RimModel& model, const RimsFound& seen,
                       const std::optional<PixelRectangle>& region, PlacesCount count = PlacesCount::like_beads) {
  // Where things lie that are no beads, none are missed.
  std::vector<Circle> taken = not_round_of(model, seen);
  for (const Circle& circle : circles_of(seen.disks)) taken.push_back(circle);
  return share_of_missed(std::max(seen.expected_missed, expected_missed_beads(maps, model, taken, region, count)),
                         seen.disks.size());
}

FoundDisk found_disk(const RimDisk& rim, const FinderCalibration& calibration, const FindOptions& options) {
  FoundDisk disk;
  disk.x_px = rim.circle.x;
  disk.y_px = rim.circle.y;
  const RimModel& rims = *calibration.rims;
  disk.radius_px = rim.other_size ? rim.circle.radius * calibration.radius_px / rims.radius_px : calibration.radius_px;
  disk.other_size = rim.other_size;
  disk.variance_x = disk.variance_y = rim.variance_px2;
  disk.quality = disk.probability = rim.probability;
  disk.contrast = rim.circle.contrast / std::max(1e-6, calibration.rims->contrast);
  const double left = options.roi ? options.roi->left : 0, top = options.roi ? options.roi->top : 0;
  const double right = options.roi ? left + options.roi->width : calibration.width;
  const double bottom = options.roi ? top + options.roi->height : calibration.height;
  disk.cut = disk.x_px - disk.radius_px < left - 0.5 || disk.y_px - disk.radius_px < top - 0.5 ||
             disk.x_px + disk.radius_px > right - 0.5 || disk.y_px + disk.radius_px > bottom - 0.5;
  constexpr double half = 0.5;
  disk.half_hidden = rim.circle.support < half;
  return disk;
}

FindResult disks_of(const RimsFound& rims, const FinderCalibration& calibration, const FindOptions& options) {
  FindResult result;
  for (const RimDisk& rim : rims.disks) {
    const FoundDisk disk = found_disk(rim, calibration, options);
    const bool outside = options.roi && (disk.x_px < options.roi->left - 0.5 || disk.y_px < options.roi->top - 0.5 ||
                                         disk.x_px >= options.roi->left + options.roi->width - 0.5 ||
                                         disk.y_px >= options.roi->top + options.roi->height - 0.5);
    if (!outside) result.disks.push_back(disk);
  }
  if (result.disks.empty())
    result.why_nothing =
        "no rim of radius " + std::to_string(calibration.radius_px * calibration.recorded_px) + " px is seen";
  return result;
}

// The rims of a frame, and the disks found by them.
struct RimsOfFrame {
  LearnedRims learned;
  RimsFound found;
};

// A line along the rims has two edges; its outer one is the outline.
void take_outer_edge(const GrayFrame& frame, const RimModel& model, const RimsFound& seen,
                     FinderCalibration& calibration) {
  std::vector<Circle> circles;
  for (const RimDisk& disk : seen.disks)
    if (!disk.other_size) circles.push_back(disk.circle);
  const std::optional<LineAtRim> line =
      line_at_rim(frame, circles, circles_of(seen.disks), model.open_radius_px, model.polarity);
  if (!line) return;
  calibration.radius_px = calibration.rim_radius_px = line->outer_px;
  calibration.radius_std_error_px = line->std_error_px;
}

CalibrationResult calibration_by_rims(MapsOfFrame& maps, const RimsOfFrame& of, const FindOptions& options) {
  const auto& [rims, seen] = of;
  CalibrationResult result;
  FinderCalibration& calibration = result.calibration;
  calibration.recorded_px = options.recorded_px;
  calibration.polarity = options.seen ? options.seen->polarity : rims.model.polarity;
  calibration.radius_px = calibration.rim_radius_px = rims.model.open_radius_px;
  // Rims of an unknown blur are known to a fifth of a pixel at best.
  constexpr double unknown_blur_px = 0.2;
  calibration.radius_std_error_px = std::hypot(rims.model.radius_std_error_px, unknown_blur_px);
  calibration.edge_width_px = 1;
  calibration.contrast_level = (rims.model.polarity == Polarity::dark_beads ? -1 : 1) * rims.model.contrast;
  calibration.width = maps.frame.width;
  calibration.height = maps.frame.height;
  calibration.profile.step_px = 1;
  calibration.frames_used = 1;
  calibration.disks_used = seen.disks.size();
  calibration.rims = rims.model;
  calibration.by_rims = true;
  calibration.expected_missed = share_missed_of(maps.quick, rims.model, seen, options.roi);
  take_outer_edge(maps.frame, rims.model, seen, calibration);
  warn_of_poor_rims(rims, seen, calibration);
  result.found = !rims.disks.empty();
  result.in_last_frame = disks_of(seen, calibration, options);
  if (!result.found)
    result.why_not = "no rim of radius " + std::to_string(rims.model.radius_px * options.recorded_px) + " px is seen";
  return result;
}

constexpr double worth_the_search = 1.03;  // times as many beads

double expected_beads(const std::vector<RimDisk>& disks) {
  double expected = 0;
  for (const RimDisk& disk : disks) expected += disk.probability;
  return expected;
}

LearnedRims learn_quickly(MapsOfFrame& of, const FindOptions& options) {
  const BeadsSeen& seen = *options.seen;
  const auto learned_in = [&](PictureMaps& maps) {
    LearnedRims rims = learn_rims(maps, seen.polarity, seen.radius_px, Known::beads);
    learn_gaps(maps, rims, options.one_size);
    return rims;
  };
  if (!options.roi) return learned_in(of.quick);
  const GrayFrame inside = seen_inside(of.frame, *options.roi, beyond_region * seen.radius_px);
  PictureMaps maps(inside, quick_search.wanted_px);
  return learned_in(maps);
}

RimsOfFrame with_disks(PictureMaps& maps, LearnedRims rims) {
  RimsFound found = find_rims(maps, rims.model);
  return {std::move(rims), std::move(found)};
}

// From this radius: of the sign that was seen or, where they show clearly more, with edges of either sign.
RimsOfFrame learn_thoroughly(MapsOfFrame& maps, double radius_px, const FindOptions& options) {
  const auto learned = [&](Polarity polarity) {
    return learn_rims(maps.thorough, polarity, radius_px, Known::beads, thorough_search);
  };
  LearnedRims thorough = learned(options.seen->polarity), either = learned(Polarity::automatic);
  if (expected_beads(either.disks) > worth_the_search * expected_beads(thorough.disks)) thorough = std::move(either);
  learn_gaps(maps.thorough, thorough, options.one_size || options.rims_of_one_size);
  return with_disks(maps.thorough, std::move(thorough));
}

// Rims searched more thoroughly, and with edges of either sign, where the quick search leaves places that could be
// beads and this one shows clearly more of them. It takes several times as long, and where hardly any place is left it
// has little to add. (The share below which it is left out was set for its time, not by a measurement of what is
// found.)
RimsOfFrame most_telling(MapsOfFrame& maps, RimsOfFrame quick, const FindOptions& options) {
  constexpr double hardly_any = 0.05;
  if (share_missed_of(maps.quick, quick.learned.model, quick.found, options.roi, PlacesCount::fully) < hardly_any)
    return quick;
  RimsOfFrame thorough = learn_thoroughly(maps, quick.learned.model.radius_px, options);
  const bool more = expected_beads(thorough.found.disks) > worth_the_search * expected_beads(quick.found.disks);
  return more ? thorough : quick;
}

FindResult find_by_rims(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options) {
  return disks_of(find_rims(frame, *calibration.rims), calibration, options);
}

}  // namespace

CalibrationResult learn_beads(const std::vector<const GrayFrame*>& frames, const FindOptions& options) {
  if (!options.seen) return learn_finder(frames, options);
  MapsOfFrame maps{*frames.back()};
  if (options.seen->no_faces && options.seen->thorough)
    return calibration_by_rims(maps, learn_thoroughly(maps, options.seen->radius_px, options), options);
  LearnedRims rims = learn_quickly(maps, options);
  maps.beads = places_of(circles_of(rims.disks));
  if (options.quick_rims_only) return calibration_by_rims(maps, with_disks(maps.quick, std::move(rims)), options);
  FindOptions asked = options;
  asked.polarity = options.seen->polarity;
  if (!asked.radius_px) asked.radius_px = rims.model.radius_px;
  // Faces do not show whether things are round.
  const GapModel& gaps = *rims.model.gaps;
  const bool of_one_size = gaps.other_sizes.empty() && gaps.not_round.empty();
  if (!options.seen->no_faces) {
    FacesAndRims faces_and_rims(frames, maps, asked, rims);
    if (auto faces = of_one_size ? faces_and_rims.learn() : std::nullopt) {
      auto touching = learn_touching(frames, maps, options, *faces);
      return std::move(touching ? *touching : *faces);
    }
    if (auto larger = faces_and_rims.larger())
      if (auto packed = as_packed(packed_bed_of(std::move(*larger), frames, asked), maps, options))
        return std::move(*packed);
    if (auto packed = learn_packed(frames, maps, options, packed_radii(options, rims))) return std::move(*packed);
  }
  RimsOfFrame found = with_disks(maps.quick, std::move(rims));
  if (!options.quick_rims) found = most_telling(maps, std::move(found), options);
  return calibration_by_rims(maps, found, options);
}

CalibrationResult learn_by_rims(const GrayFrame& frame, const BeadsSeen& seen) {
  FindOptions options;
  options.seen = seen;
  options.one_size = true;
  MapsOfFrame maps{frame};
  return calibration_by_rims(maps, with_disks(maps.quick, learn_quickly(maps, options)), {});
}

FindResult find_beads(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options) {
  FindResult found =
      calibration.by_rims ? find_by_rims(frame, calibration, options) : find_disks(frame, calibration, options);
  if (!calibration.by_rims && calibration.rims && calibration.rims_to_be_checked)
    check_by_rims(frame, *calibration.rims, found);
  add_other_shade(frame, calibration, options, found);
  return found;
}

}  // namespace shakebed::ingest
