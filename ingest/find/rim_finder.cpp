#include "ingest/find/rim_finder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdint>
#include <numbers>
#include <utility>

#include "ingest/find/nearby.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/rim_gaps.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/rim_shape.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr double radius_window = 0.12;     // radii, either way: circles of one kind of bead
constexpr double nearest_centres = 0.8;    // diameters: two circles nearer than that are one
constexpr double least_probability = 0.8;  // of a disk that is reported: more than one circle alone in its class has
// Of the beads' contrast. Beads of 17 photographs: 0.40 or more; a shadow's corner that looked round: 0.10.
constexpr double faintest_contrast = 0.25;
constexpr double sure_probability = 0.9;  // probability from which a circle counts for the radius
// Where blurred beads touch, their steepest edges lie farther out than a lone one's: in a photograph of beads of 2.5 px
// at 1.4 times its radius. A circle so much smaller than the others must show most of its rim.
constexpr double lone_share = 0.75, lone_support = 0.6;
// A side is open where no other centre lies within this many radii and this angle of it (rad): beyond the void between
// three touching beads.
constexpr double open_reach = 3.2, open_angle = 0.9, same_circle = 0.1;
constexpr int fewest_open_directions = 5;  // of 48
constexpr std::size_t fewest_open_circles = 5;
// px of the map: over which the noise of edges is one and the same, 2 sqrt(pi) times the smoothing by 1 px.
constexpr double correlated_px = 3.5;
// px^2 of the map: variance of its smoothing (1), differences (1/3) and pixels (1/12). A disk blurred by sigma is
// steepest at R - sigma^2 / (2 R).
constexpr double blur_of_map_px2 = 1.42;
const RimRays fine_rays = {.count = 48, .reach = 0.15, .tolerance = 0.07, .faint = 0.65};

// Of the model's polarity.
std::vector<Circle> circles_of(const EdgeMap& edges, double radius, const RimModel& model) {
  std::vector<Circle> circles =
      find_circles(edges, {radius * 0.93, radius * 1.08, model.polarity, faintest_rim_support, model.search.votes});
  std::erase_if(circles, [&](const Circle& circle) { return std::abs(circle.radius / radius - 1) > radius_window; });
  return without_doubles(std::move(circles), nearest_centres);
}

// Edges fainter than the beads' rims count less.
double edge_length(const EdgeMap& edges, double contrast) {
  double sum = 0;
  for (const RidgePixel& pixel : edges.ridge) {
    const std::size_t at = edges.at(static_cast<int>(pixel.x), static_cast<int>(pixel.y));
    const double step = step_per_slope * static_cast<double>(edges.slope(at));
    sum += std::min(1.0, step / std::max(1e-6, contrast));
  }
  return sum;
}

// Radius, its spread and the contrast, of circles that are beads.
void measure_rims(const std::vector<Circle>& circles, double scale, RimModel& model) {
  std::vector<double> radii, contrasts, deviations;
  for (const Circle& circle : circles)
    if (model.probability_of(circle.support) >= std::min(sure_probability, model.probability.back())) {
      radii.push_back(circle.radius);
      contrasts.push_back(circle.contrast);
    }
  if (radii.empty()) return;
  const double middle = median_of(radii);
  for (const double radius : radii) deviations.push_back(std::abs(radius - middle));
  const double spread = 1.4826 * median_of(deviations);
  model.radius_px = middle * scale;
  model.radius_spread = spread / middle;
  constexpr double of_a_median = 1.2533;  // sqrt(pi / 2): its error over that of a mean
  model.radius_std_error_px = of_a_median * spread * scale / std::sqrt(static_cast<double>(radii.size()));
  model.contrast = median_of(contrasts);
}

RimDisk disk_of(const Circle& circle, const ScaledPicture& at, const RimModel& model) {
  RimDisk disk;
  disk.circle = in_the_frame(circle, at);
  disk.probability = model.probability_of(circle.support);
  const double apart = 2 * std::numbers::pi * circle.radius / correlated_px;
  const double met = std::max(3.0, circle.support * std::min(apart, static_cast<double>(circle.rays)));
  const double offset = circle.scatter * disk.circle.radius;
  disk.variance_px2 = 2 * offset * offset / met;
  return disk;
}

void sort_by_place(std::vector<RimDisk>& disks) {
  std::sort(disks.begin(), disks.end(), [](const RimDisk& a, const RimDisk& b) {
    if (a.circle.y != b.circle.y) return a.circle.y < b.circle.y;
    return a.circle.x < b.circle.x;
  });
}

std::vector<RimDisk> likely_ones(const std::vector<Circle>& circles, const EdgeMap& edges, const ScaledPicture& at,
                                 const RimModel& model) {
  std::vector<RimDisk> disks;
  for (const Circle& circle : circles) {
    if (model.probability_of(circle.support) < least_probability) continue;
    const Circle fine = fit_circle(edges, circle, model.polarity, fine_rays);
    const bool better = fine.support > 0.7 * circle.support;
    disks.push_back(disk_of(better ? fine : circle, at, model));
    disks.back().probability = model.probability_of(circle.support);
  }
  sort_by_place(disks);
  return disks;
}

// Directions in which no other circle is near, a bit each.
std::uint64_t open_directions(const Circle& circle, const std::vector<Circle>& circles, const Nearby& near) {
  std::uint64_t open = ~std::uint64_t{0};
  near.any_near(circle.x, circle.y, [&](std::size_t i) {
    const double dx = circles[i].x - circle.x, dy = circles[i].y - circle.y, away = std::hypot(dx, dy);
    if (away < same_circle * circle.radius || away > open_reach * circle.radius) return false;
    for (int k = 0; k < circle.directions; ++k) {
      const double angle = 2 * std::numbers::pi * k / circle.directions;
      if (dx * std::cos(angle) + dy * std::sin(angle) > away * std::cos(open_angle))
        open &= ~(std::uint64_t{1} << static_cast<unsigned>(k));
    }
    return false;
  });
  return open;
}

// From the circles that have an open side.
void measure_open_rims(const std::vector<Circle>& circles, const EdgeMap& edges, double scale, RimModel& model) {
  model.open_radius_px = model.radius_px;
  double largest = 1;
  for (const Circle& circle : circles) largest = std::max(largest, circle.radius);
  const Nearby near(circles.size(), open_reach * largest,
                    [&](std::size_t i) { return std::pair(circles[i].x, circles[i].y); });
  std::vector<double> radii;
  for (const Circle& circle : circles)
    if (const double radius = radius_towards(edges, circle, model.polarity, open_directions(circle, circles, near),
                                             fewest_open_directions);
        radius > 0)
      radii.push_back(radius);
  if (radii.size() < fewest_open_circles) return;
  const double steepest = median_of(radii);
  model.open_radius_px = (steepest + blur_of_map_px2 / (2 * steepest)) * scale;
}

std::vector<Circle> on_the_map(const std::vector<RimDisk>& disks, const ScaledPicture& at) {
  std::vector<Circle> circles;
  for (const RimDisk& disk : disks) circles.push_back(on_the_map(disk.circle, at));
  return circles;
}

// Learns at the scale of this radius, on the copies too: in four directions, so that what is oval in one of them is
// round in another.
LearnedRims learn_rims_at(PictureMaps& maps, const RimModel& start, Known known) {
  LearnedRims learned;
  RimModel& model = learned.model;
  model = start;
  const auto& [at, all_edges, copies] = maps.with_copies(model.radius_px);
  const auto& edges = all_edges;  // a lambda may not name what a binding names
  const std::vector<const StretchedBand*> bands = bands_of(copies);
  model.threshold = edges.threshold;
  std::vector<Circle> circles;
  // Until the radius settles: with beads of several sizes it starts between two of them.
  constexpr int fewest_rounds = 2, most_rounds = 6;
  constexpr double settled = 0.02;
  double radius = 0;
  for (int round = 0;
       round < fewest_rounds || (round < most_rounds && std::abs(model.radius_px / at.scale / radius - 1) > settled);
       ++round) {
    radius = model.radius_px / at.scale;
    std::vector<std::vector<Circle>> in_bands(bands.size());
    for_each_piece(1 + bands.size(), [&](std::size_t piece) {
      if (piece == 0)
        circles = circles_of(edges, radius, model);
      else
        in_bands[piece - 1] = circles_of(bands[piece - 1]->edges, radius, model);
    });
    std::vector<std::vector<Circle>> by_chance;
    std::size_t which = 0;
    for (const StretchedCopy& copy : copies) {
      by_chance.emplace_back();
      for (const StretchedBand& band : copy)
        for (const Circle& circle : in_bands[which++])
          if (band.holds(circle.y)) by_chance.back().push_back(circle);
    }
    model.probability = probabilities_by_support(circles, by_chance, known);
    measure_rims(circles, at.scale, model);
  }
  learned.disks = likely_ones(circles, edges, at, model);
  learned.edge_length_px = edge_length(edges, model.contrast) * at.scale;
  measure_open_rims(on_the_map(learned.disks, at), edges, at.scale, model);
  return learned;
}

// Rims that are plainly not round are hardly those of beads, unless chance makes so many seem so.
void doubt_departing(PictureMaps& maps, const RimModel& model, RimsFound& found) {
  const std::vector<Circle> circles = circles_of(found.disks);
  const std::vector<RimShape> shapes = shapes_of_rims(maps, model, circles, circles);
  std::vector<RimShape> of_one_size;
  for (std::size_t k = 0; k < shapes.size(); ++k)
    if (!found.disks[k].other_size) of_one_size.push_back(shapes[k]);
  const std::complex<double> shared = shared_second(of_one_size);
  const Departing departing = departing_of(shapes, circles, shared);
  if (departing.most()) return;  // the survey has judged them
  const bool left_out = departing.more_than_seem();
  std::vector<RimDisk> kept;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    RimDisk& disk = found.disks[k];
    const bool departs = departs_from_round(shapes[k], shared);
    if (departs && left_out) {
      found.not_round.push_back(disk.circle);
      continue;
    }
    if (departs) disk.probability *= departing.round_nevertheless();
    kept.push_back(disk);
  }
  found.disks = std::move(kept);
}

}  // namespace

std::vector<Circle> circles_of(const std::vector<RimDisk>& disks) {
  std::vector<Circle> circles;
  circles.reserve(disks.size());
  for (const RimDisk& disk : disks) circles.push_back(disk.circle);
  return circles;
}

double RimModel::probability_of(double support) const { return probability_at(probability, support); }

LearnedRims learn_rims(const GrayFrame& frame, Polarity polarity, double radius_px, Known known,
                       const RimSearch& search) {
  PictureMaps maps(frame, search.wanted_px);
  return learn_rims(maps, polarity, radius_px, known, search);
}

LearnedRims learn_rims(PictureMaps& maps, Polarity polarity, double radius_px, Known known, const RimSearch& search) {
  RimModel start;
  start.polarity = polarity;
  start.radius_px = radius_px;
  start.search = search;
  LearnedRims learned = learn_rims_at(maps, start, known);
  // Frames are searched at the scale of the radius that was learned: what was learned must be of that scale, too.
  start.radius_px = learned.model.radius_px;
  if (scale_for(start.radius_px, search.wanted_px) != scale_for(radius_px, search.wanted_px))
    learned = learn_rims_at(maps, start, known);
  return learned;
}

std::vector<Circle> circles_seen(PictureMaps& maps, Polarity polarity, double radius_px) {
  RimModel model;
  model.polarity = polarity;
  const auto& [at, edges, copies] = maps.scaled_for(radius_px);
  std::vector<Circle> circles = circles_of(edges, radius_px / at.scale, model);
  for (Circle& circle : circles) circle = in_the_frame(circle, at);
  return circles;
}

void learn_gaps(const GrayFrame& frame, LearnedRims& learned, bool one_size) {
  PictureMaps maps(frame, learned.model.search.wanted_px);
  learn_gaps(maps, learned, one_size);
}

void learn_gaps(PictureMaps& maps, LearnedRims& learned, bool one_size) {
  learned.model.gaps = chances_in_gaps(maps, circles_of(learned.disks), learned.model, one_size);
}

Roundness roundness_of(const GrayFrame& frame, const RimModel& model, const std::vector<RimDisk>& disks) {
  PictureMaps maps(frame, quick_search.wanted_px);
  return roundness_of(maps, model, disks);
}

Roundness roundness_of(PictureMaps& maps, const RimModel& model, const std::vector<RimDisk>& disks) {
  if (disks.empty()) return {};
  // Corners show at twice the resolution that circles are searched at.
  const double radius = scale_for(model.radius_px) < 2 ? model.radius_px : 0.5 * model.radius_px;
  const auto& [at, edges, copies] = maps.scaled_for(radius);
  Roundness roundness = roundness_of(edges, on_the_map(disks, at), model.polarity);
  if (auto& side = roundness.round_side; side)
    side->at = side->left_or_right ? at.to_frame_x(side->at) : at.to_frame_y(side->at);
  return roundness;
}

RimsFound find_rims(const GrayFrame& frame, const RimModel& model) {
  PictureMaps maps(frame, model.search.wanted_px);
  return find_rims(maps, model);
}

RimsFound find_rims(PictureMaps& maps, const RimModel& model) {
  const auto& [at, edges, copies] = maps.scaled_for(model.radius_px, model.threshold);
  RimsFound found;
  found.disks = likely_ones(circles_of(edges, model.radius_px / at.scale, model), edges, at, model);
  const auto drop_faint = [&] {
    std::erase_if(found.disks,
                  [&](const RimDisk& disk) { return disk.circle.contrast < faintest_contrast * model.contrast; });
  };
  drop_faint();
  if (!model.gaps) {
    doubt_departing(maps, model, found);
    return found;
  }
  const std::vector<Circle> beads = circles_of(found.disks);
  const GapCircles more = circles_in_gaps(maps, beads, model);
  found.expected_missed = more.expected_missed;
  for (auto gone = more.displaced.rbegin(); gone != more.displaced.rend(); ++gone)
    found.disks.erase(found.disks.begin() + static_cast<std::ptrdiff_t>(*gone));
  for (const GapCircle& one : more.circles) {
    const PictureMap& map = maps.scaled_for(one.circle.radius, model.threshold);
    const Circle coarse = on_the_map(one.circle, map.at);
    const Circle fine = fit_circle(map.edges, coarse, model.polarity, fine_rays);
    const bool better = fine.support > 0.7 * one.circle.support;
    found.disks.push_back(disk_of(better ? fine : coarse, map.at, model));
    RimDisk& disk = found.disks.back();
    disk.probability = one.probability;
    disk.other_size = one.size != nullptr;
    if (disk.other_size && one.size->radius_px > 0) disk.circle.radius = one.size->radius_px;
  }
  drop_faint();
  sort_by_place(found.disks);
  doubt_departing(maps, model, found);
  return found;
}

std::vector<Circle> rims_at(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& places) {
  PictureMaps maps(frame, model.search.wanted_px);
  return rims_at(maps, model, places);
}

std::vector<Circle> rims_at(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& places) {
  const auto& [at, edges, copies] = maps.scaled_for(model.radius_px, model.threshold);
  std::vector<Circle> circles;
  for (const Circle& place : places) {
    Circle start = place;
    start.x = at.from_frame_x(place.x);
    start.y = at.from_frame_y(place.y);
    start.radius = model.radius_px / at.scale;
    Circle fitted = fit_circle(edges, start, model.polarity);
    if (fitted.support < faintest_rim_support) {
      Circle smaller = start;
      smaller.radius *= lone_share;
      smaller = fit_circle(edges, smaller, model.polarity);
      if (smaller.support >= lone_support) fitted = smaller;
    }
    circles.push_back(in_the_frame(fitted, at));
  }
  return circles;
}

double expected_wrong_share(const std::vector<RimDisk>& disks) {
  if (disks.empty()) return 1;
  double wrong = 0;
  for (const RimDisk& disk : disks) wrong += 1 - disk.probability;
  return wrong / static_cast<double>(disks.size());
}

}  // namespace shakebed::ingest
