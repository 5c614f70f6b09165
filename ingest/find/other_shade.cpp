#include "ingest/find/other_shade.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/beside_beads.hpp"
#include "ingest/find/circle_census.hpp"
#include "ingest/find/learn_beads.hpp"
#include "ingest/find/missed_beads.hpp"
#include "ingest/find/painted_over.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/rim_shape.hpp"
#include "statistics/ranks.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// Beyond the rim of a bead found its blurred edge is painted over, too [edge widths of faces; radii, px of rims].
constexpr double shade_margin_edges = 2, margin_radii = 0.06, shade_margin_px = 1;
// Beads of another shade are accepted when at least this number is expected, and this share of the beads found.
constexpr double fewest_of_a_shade = 3, least_share_of_a_shade = 0.03;
// Radii of the beads found: sizes of the others, and how many are looked for.
constexpr double smallest_other = 0.4, largest_other = 2.5;
constexpr double same_size = 0.06;  // of the radius: drawn beds of one size differ by up to 0.03 between their shades
constexpr std::size_t most_other_sizes = 2;
// Of a rim, the share in which edges are met, at least; and of one that is worth a longer search, of which straight
// edges make up an eighth each. And of the weakest edges, those that noise does not make.
constexpr double least_rim = 0.5, faintest_rim = 0.35;
constexpr float plain_edge = 1.5F;

double margin_of(const FinderCalibration& finder) {
  return finder.by_rims ? shade_margin_px + margin_radii * finder.radius_px : shade_margin_edges * finder.edge_width_px;
}

// Of the beads found in the painted frame, those that are beads of the frame.
void keep_own(const GrayFrame& painted, const FinderCalibration& other, const std::vector<FoundDisk>& found,
              FindResult& more) {
  const BesideBeads free(found);
  const std::vector<Circle> rims = rims_at(painted, *other.rims, circles_of(more.disks));
  std::size_t at = 0;
  more.rejected += std::erase_if(more.disks, [&](const FoundDisk& disk) {
    const Circle& rim = rims[at++];
    return free.overlapped(disk.x_px, disk.y_px, disk.radius_px) || !free.has_own_rim(rim);
  });
}

double expected_of(const std::vector<FoundDisk>& disks) {
  double sum = 0;
  for (const FoundDisk& disk : disks) sum += disk.probability;
  return sum;
}

// Beads brighter, or darker, than what is behind the beads found.
struct SeenShade {
  GrayFrame painted;
  BeadsSeen beads;
  double expected = 0;
};

// Whether chance may have made them up: of mottled ground each circle alone is likely to be a bead, and all of them are
// none.
bool by_chance(const std::vector<FoundDisk>& others) {
  const auto count = static_cast<double>(others.size());
  return share_by_chance_at_worst(count - expected_of(others), count) > most_by_chance;
}

bool enough(double expected, const std::vector<FoundDisk>& found) {
  return expected >= std::max(fewest_of_a_shade, least_share_of_a_shade * static_cast<double>(found.size()));
}

// With this radius, to begin with.
void look_with(double radius_px, const std::vector<FoundDisk>& found, PictureMaps& maps, SeenShade& seen) {
  const LearnedRims rims = learn_rims(maps, seen.beads.polarity, radius_px, Known::radius);
  const BesideBeads free(found);
  double expected = 0;
  for (const RimDisk& disk : rims.disks)
    if (!free.overlapped(disk.circle.x, disk.circle.y, disk.circle.radius) && free.has_own_rim(disk.circle))
      expected += disk.probability;
  if (expected > seen.expected) seen.expected = expected, seen.beads.radius_px = rims.model.radius_px;
}

// Whether edges that belong to none of the beads found are as long as the rims of a few beads, and make up as many
// circles: those of walls do not. Beads of all sizes that are looked for are asked for at one scale, so that this is
// quick.
bool leaves_rims(const GrayFrame& painted, double radius_px, Polarity polarity, const std::vector<FoundDisk>& found) {
  const ScaledPicture at = scaled_for(painted, radius_px);
  EdgeMap edges = edges_of(at);
  const float plain = plain_edge * edges.threshold;
  const BesideBeads free(found);
  std::erase_if(edges.ridge, [&](const RidgePixel& pixel) {
    return edges.slope(edges.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y))) < plain ||
           !free.beside_rims(at.to_frame_x(static_cast<double>(pixel.x)), at.to_frame_y(static_cast<double>(pixel.y)));
  });
  const double beads = std::max(fewest_of_a_shade, least_share_of_a_shade * static_cast<double>(found.size()));
  const double length = at.scale * static_cast<double>(edges.ridge.size());
  if (length <= least_rim * 2 * std::numbers::pi * smallest_other * radius_px * beads) return false;
  CirclesAsked asked{smallest_other * radius_px / at.scale, largest_other * radius_px / at.scale, polarity,
                     faintest_rim};
  std::vector<Circle> circles = find_circles(edges, asked);
  for (Circle& circle : circles) circle = in_the_frame(circle, at);
  std::erase_if(circles, [&](const Circle& circle) {
    return free.overlapped(circle.x, circle.y, circle.radius) || !free.has_own_rim(circle);
  });
  return static_cast<double>(without_doubles(std::move(circles), nearest_free_centres).size()) >= beads;
}

// Of the same size as the beads found, else of the size of which most circles are seen.
std::optional<SeenShade> seen_of(const GrayFrame& frame, const FinderCalibration& calibration,
                                 const std::optional<PixelRectangle>& roi, const std::vector<FoundDisk>& found,
                                 Polarity polarity) {
  std::optional<GrayFrame> painted = painted_over(frame, found, margin_of(calibration), polarity);
  // What lies elsewhere, as text does, would be searched in vain, and so would its chance circles.
  if (painted && roi) painted = seen_inside(std::move(*painted), *roi);
  if (!painted || !leaves_rims(*painted, calibration.radius_px, polarity, found)) return std::nullopt;
  SeenShade seen{std::move(*painted), {polarity, calibration.radius_px}};
  PictureMaps maps(seen.painted, quick_search.wanted_px);
  look_with(calibration.radius_px, found, maps, seen);
  if (enough(seen.expected, found)) return seen;
  CensusOptions asked;
  asked.polarity = polarity;
  asked.smallest_radius_px = std::max(asked.smallest_radius_px, smallest_other * calibration.radius_px);
  std::size_t tried = 0;
  for (const CircleHypothesis& hypothesis : take_census({&seen.painted}, asked).hypotheses) {
    const double ratio = hypothesis.radius_px / calibration.radius_px;
    if (ratio < smallest_other || ratio > largest_other || hypothesis.hopeless()) continue;
    look_with(hypothesis.radius_px, found, maps, seen);
    if (++tried == most_other_sizes || enough(seen.expected, found)) break;
  }
  return seen;
}

FindResult others_in(const GrayFrame& painted, const FinderCalibration& other, const FindOptions& options,
                     const std::vector<FoundDisk>& found) {
  FindResult more = find_beads(painted, other, options);
  keep_own(painted, other, found, more);
  return more;
}

// Whether most of their rims are plainly not round, unlike those of the beads found.
bool mostly_not_round(const GrayFrame& frame, const RimModel& first, const RimModel& other,
                      const std::vector<FoundDisk>& found, const std::vector<FoundDisk>& others) {
  const std::vector<Circle> beads = circles_of(found), more = circles_of(others);
  std::vector<Circle> all = beads;
  all.insert(all.end(), more.begin(), more.end());
  PictureMaps maps(frame, quick_search.wanted_px);
  const std::complex<double> shared = shared_second(shapes_of_rims(maps, first, beads, all));
  return departing_of(shapes_of_rims(maps, other, more, all), more, shared).most();
}

// Median over the disks of the mean level inside, by level_at(column, row) of pixels that are seen.
template <class LevelAt>
double median_inside(const GrayFrame& frame, const std::vector<FoundDisk>& disks, const LevelAt& level_at) {
  constexpr double inside = 0.7;  // radii
  std::vector<double> levels;
  for (const FoundDisk& disk : disks) {
    const int reach = static_cast<int>(inside * disk.radius_px);
    const int x = static_cast<int>(std::lround(disk.x_px)), y = static_cast<int>(std::lround(disk.y_px));
    double sum = 0, count = 0;
    for (int row = std::max(0, y - reach); row <= std::min(frame.height - 1, y + reach); ++row)
      for (int column = std::max(0, x - reach); column <= std::min(frame.width - 1, x + reach); ++column) {
        if (std::hypot(column - x, row - y) > reach || unseen(frame.at(column, row))) continue;
        sum += static_cast<double>(level_at(column, row));
        ++count;
      }
    if (count > 0) levels.push_back(sum / count);
  }
  return median_of(std::move(levels));
}

// Level inside less that behind, where the disks are painted over.
double step_of(const GrayFrame& frame, const GrayFrame& behind, const std::vector<FoundDisk>& disks) {
  return median_inside(frame, disks,
                       [&](int column, int row) { return frame.at(column, row) - behind.at(column, row); });
}

// Beads found and others, as they stand out against what is behind all of them.
struct TwoShades {
  double ratio = 1;  // the contrast of the others, that of the beads found being 1
  bool same_ground =
      true;  // what is behind the others differs by less from what is behind the beads found than they do
};
TwoShades shades_of(const GrayFrame& frame, double margin, Polarity polarity, const std::vector<FoundDisk>& found,
                    const std::vector<FoundDisk>& others) {
  TwoShades out;
  std::vector<FoundDisk> all = found;
  all.insert(all.end(), others.begin(), others.end());
  const std::optional<GrayFrame> behind = painted_over(frame, all, margin, polarity);
  const double first = behind ? step_of(frame, *behind, found) : 0;
  if (first == 0) return out;
  out.ratio = step_of(frame, *behind, others) / first;
  const auto ground_of = [&](const std::vector<FoundDisk>& disks) {
    return median_inside(*behind, disks, [&](int column, int row) { return behind->at(column, row); });
  };
  out.same_ground = std::abs(ground_of(others) - ground_of(found)) <= std::abs(first);
  return out;
}

bool of_same_size(const FinderCalibration& other, const FinderCalibration& first) {
  return std::abs(other.radius_px / first.radius_px - 1) < same_size;
}

// Beads of one size share the radius of the beads found at first.
void merge(FindResult more, double contrast, const FinderCalibration& first, FindResult& found) {
  const bool same = of_same_size(*first.other_shade, first);
  for (FoundDisk& disk : more.disks) {
    disk.contrast *= contrast;
    if (!same)
      disk.other_size = true;
    else if (!disk.other_size)
      disk.radius_px = first.radius_px;
    found.disks.push_back(disk);
  }
  found.rejected += more.rejected;
  std::sort(found.disks.begin(), found.disks.end(), [](const FoundDisk& a, const FoundDisk& b) {
    if (a.y_px != b.y_px) return a.y_px < b.y_px;
    return a.x_px < b.x_px;
  });
}

void count_missed(const GrayFrame& frame, const FindOptions& options, FinderCalibration& calibration,
                  const FindResult& found) {
  const std::vector<Circle> circles = circles_of(found.disks);
  calibration.expected_missed =
      share_of_missed(expected_missed_beads(frame, *calibration.rims, circles, options.roi), circles.size());
}

}  // namespace

void learn_other_shade(const GrayFrame& frame, const FindOptions& options, FinderCalibration& calibration,
                       FindResult& found) {
  if (found.disks.empty() || !calibration.rims || calibration.other_shade) return;
  // The noise of an enlarged picture is smooth, and what is painted is not: beads would be seen in it.
  if (frame.enlargement > 1) return;
  std::optional<SeenShade> best;
  for (const Polarity polarity : {Polarity::bright_beads, Polarity::dark_beads}) {
    if (options.polarity != Polarity::automatic && options.polarity != polarity) continue;
    std::optional<SeenShade> seen = seen_of(frame, calibration, options.roi, found.disks, polarity);
    if (seen && (!best || seen->expected > best->expected)) best = std::move(seen);
  }
  if (!best || !enough(best->expected, found.disks)) return;
  FindOptions find = options;
  find.polarity = best->beads.polarity;
  find.seen = best->beads;
  find.radius_px.reset();
  find.hold_radius = false;
  // Where faces did not show the one shade, they took most of the time and did not show the other. So did the thorough
  // search by rims, of text beside a bed two thirds.
  find.quick_rims = true;
  find.quick_rims_only = calibration.by_rims;
  CalibrationResult learned = learn_beads({&best->painted}, find);
  if (!learned.found || !learned.calibration.rims) return;
  tell_radius(learned);
  FindResult more = others_in(best->painted, learned.calibration, find, found.disks);
  if (!enough(expected_of(more.disks), found.disks) || by_chance(more.disks)) return;
  if (mostly_not_round(frame, *calibration.rims, *learned.calibration.rims, found.disks, more.disks)) {
    const bool said = calibration.rims->gaps && !calibration.rims->gaps->not_round.empty();
    if (!said) calibration.warnings.push_back(left_out_as_not_round(circles_of(more.disks), calibration.recorded_px));
    return;
  }
  // Marks on other ground, as letters beside the bed, are no beads of the bed.
  const auto [ratio, same_ground] = shades_of(frame, margin_of(calibration), find.polarity, found.disks, more.disks);
  if (!same_ground) return;
  calibration.warnings.push_back(formatted(
      "Beads of two shades were found. In the first frame %zu of %zu beads differ from the background by %.2f of what "
      "the others do%s.",
      more.disks.size(), more.disks.size() + found.disks.size(), std::abs(ratio),
      ratio < 0 ? ", in the opposite direction" : ""));
  if (!of_same_size(learned.calibration, calibration))
    calibration.warnings.back() += formatted(
        " Their radius is %.1f px. The diameter refers to the others, whose radius is %.1f px.",
        learned.calibration.radius_px * calibration.recorded_px, calibration.radius_px * calibration.recorded_px);
  calibration.other_shade = std::make_shared<const FinderCalibration>(std::move(learned.calibration));
  merge(std::move(more), ratio, calibration, found);
  count_missed(frame, options, calibration, found);
}

void add_other_shade(const GrayFrame& frame, const FinderCalibration& calibration, const FindOptions& options,
                     FindResult& found) {
  if (!calibration.other_shade) return;
  const FinderCalibration& other = *calibration.other_shade;
  auto painted = painted_over(frame, found.disks, margin_of(calibration), other.polarity);
  if (!painted) return;
  if (options.roi) painted = seen_inside(std::move(*painted), *options.roi);
  FindOptions find = options;
  find.learn_rim = false;
  FindResult more = others_in(*painted, other, find, found.disks);
  const double contrast = shades_of(frame, margin_of(calibration), other.polarity, found.disks, more.disks).ratio;
  merge(std::move(more), contrast, calibration, found);
}

}  // namespace shakebed::ingest
