#include "ingest/find/rim_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "ingest/find/nearby.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "statistics/ranks.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

constexpr std::size_t shape_rays = 48;
constexpr double shape_reach = 0.3;      // radii either way of the circle, in which its rim is looked for
constexpr double shape_ring_step = 0.5;  // px of the map
constexpr double radial_enough = 0.75;   // cosine between an edge's gradient and the ray
// Edges count from this share of the circle's median edge on.
constexpr double clear_edge = 0.5;
// px of the map, or of the frame where these are larger: so near to another disk, two rims are one edge.
constexpr double merged_px = 2.5;
// px likewise: how well a single edge is placed at best; and how many rays share an error, as edges are smoothed.
constexpr double best_edge_px = 0.15, rays_that_agree = 2.5;
constexpr std::size_t fewest_rays = 12;
// A rim departs from round by this much (a ratio of axes of 1.13) and so many errors. Of drawn round beads of eight
// sizes and looks (blur of 0.8 to 2.2 px, piles and strewn) 0 to 1.5 % do, of ends of capsules 97 % or more.
constexpr double least_second = 0.06, least_errors = 4;
// Share of round beads that depart by chance. What covers a part of a rim has edges of its own, which pass as the
// rim's. Drawn round beads whose rims are seen to 0.47 to 0.74 on average (heaps, crystals that touch; 8 to 20 px): 0
// to 0.087.
constexpr double seemingly_of_whole = 0.03, seemingly_of_covered = 0.085;
constexpr double whole_support = 0.8;  // mean share of the rims
constexpr std::size_t fewest_shared = 3, fewest_departing = 3;
constexpr std::size_t shape_terms = 5;  // 1, cos, sin, cos 2, sin 2

struct ShapeRay {
  double cosine, sine;
  std::array<double, shape_terms> basis;
};
const std::array<ShapeRay, shape_rays>& shape_ray_table() {
  static const std::array<ShapeRay, shape_rays> table = [] {
    std::array<ShapeRay, shape_rays> all{};
    for (std::size_t k = 0; k < all.size(); ++k) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(k) / shape_rays;
      const double c = std::cos(angle), s = std::sin(angle);
      all[k] = {c, s, {1, c, s, std::cos(2 * angle), std::sin(2 * angle)}};
    }
    return all;
  }();
  return table;
}

// The rim around one circle of a map.
class RimWalk {
 public:
  // `near`: the other disks, px of the map; `frame_px`: a px of the frame, or of the map if that is larger.
  RimWalk(const EdgeMap& edges, const Circle& circle, Polarity polarity, std::vector<Circle> near, double frame_px)
      : edges_(edges), circle_(circle), near_(std::move(near)), frame_px_(frame_px) {
    sign_ = polarity == Polarity::bright_beads ? -1 : polarity == Polarity::dark_beads ? 1 : sign_at_rim();
  }

  [[nodiscard]] RimShape shape() const {
    std::array<Met, shape_rays> met;
    std::vector<double> slopes;
    for (std::size_t k = 0; k < shape_rays; ++k) {
      met[k] = look_along(shape_ray_table()[k]);
      if (met[k].slope > 0) slopes.push_back(met[k].slope);
    }
    const double least = clear_edge * median_of(std::move(slopes));
    std::array<bool, shape_rays> counts{};
    for (std::size_t k = 0; k < shape_rays; ++k) counts[k] = met[k].inside && met[k].slope > least;
    return fitted(met, counts);
  }

 private:
  struct Met {
    double offset = 0, slope = 0;  // radii outwards, grey levels per px
    bool inside = false;           // the reach, and not at its ends
  };
  struct Slope {
    double along = 0, size = 0;
  };

  [[nodiscard]] Slope slope_at(double x, double y, const ShapeRay& ray) const {
    if (x < 1 || y < 1 || x >= edges_.width - 2 || y >= edges_.height - 2) return {};
    const int column = static_cast<int>(x), row = static_cast<int>(y);
    const double right = x - column, lower = y - row;
    const std::size_t at = edges_.at(column, row), below = at + static_cast<std::size_t>(edges_.width);
    const auto mix = [&](const std::vector<float>& field) {
      return (1 - lower) * ((1 - right) * static_cast<double>(field[at]) + right * static_cast<double>(field[at + 1])) +
             lower * ((1 - right) * static_cast<double>(field[below]) + right * static_cast<double>(field[below + 1]));
    };
    const double along_x = mix(edges_.x), along_y = mix(edges_.y);
    return {along_x * ray.cosine + along_y * ray.sine, std::sqrt(along_x * along_x + along_y * along_y)};
  }

  // Of the step outwards, where either is looked for.
  [[nodiscard]] double sign_at_rim() const {
    double sum = 0;
    for (const ShapeRay& ray : shape_ray_table())
      sum += slope_at(circle_.x + circle_.radius * ray.cosine, circle_.y + circle_.radius * ray.sine, ray).along;
    return sum < 0 ? -1 : 1;
  }

  [[nodiscard]] bool beside_another(double x, double y) const {
    return std::any_of(near_.begin(), near_.end(), [&](const Circle& other) {
      const double dx = x - other.x, dy = y - other.y, reach = other.radius + merged_px * frame_px_;
      return dx * dx + dy * dy < reach * reach;
    });
  }

  [[nodiscard]] Met look_along(const ShapeRay& ray) const {
    const int rings = static_cast<int>(shape_reach * circle_.radius / shape_ring_step);
    std::vector<double> slopes;
    int best = -1;
    for (int ring = -rings; ring <= rings; ++ring) {
      const double r = circle_.radius + ring * shape_ring_step;
      const double x = circle_.x + r * ray.cosine, y = circle_.y + r * ray.sine;
      const Slope slope = slope_at(x, y, ray);
      const double outwards = sign_ * slope.along;
      const bool edge = outwards > radial_enough * slope.size && slope.size > static_cast<double>(edges_.threshold) &&
                        !beside_another(x, y);
      slopes.push_back(edge ? outwards : 0);
      if (edge && (best < 0 || outwards > slopes[static_cast<std::size_t>(best)])) best = ring + rings;
    }
    if (best < 0) return {};
    Met met;
    const auto at = static_cast<std::size_t>(best);
    met.slope = slopes[at];
    met.inside = best > 0 && best < 2 * rings;
    double part = 0;
    if (met.inside)
      if (const double bend = slopes[at - 1] - 2 * slopes[at] + slopes[at + 1]; bend < 0)
        part = std::clamp(0.5 * (slopes[at - 1] - slopes[at + 1]) / bend, -0.5, 0.5);
    met.offset = (best - rings + part) * shape_ring_step / circle_.radius;
    return met;
  }

  // Least squares of the offsets; the errors by what is left.
  [[nodiscard]] RimShape fitted(const std::array<Met, shape_rays>& met,
                                const std::array<bool, shape_rays>& counts) const {
    const auto seen = static_cast<std::size_t>(std::count(counts.begin(), counts.end(), true));
    if (seen < fewest_rays) return {};
    std::vector<double> matrix(shape_terms * shape_terms, 0.0), right(shape_terms, 0.0);
    for (std::size_t k = 0; k < shape_rays; ++k) {
      if (!counts[k]) continue;
      const auto& basis = shape_ray_table()[k].basis;
      for (std::size_t a = 0; a < shape_terms; ++a) {
        right[a] += basis[a] * met[k].offset;
        for (std::size_t b = 0; b < shape_terms; ++b) matrix[a * shape_terms + b] += basis[a] * basis[b];
      }
    }
    std::vector<double> system = matrix;
    if (!solve_symmetric(system, right, shape_terms)) return {};
    double squares = 0;
    for (std::size_t k = 0; k < shape_rays; ++k) {
      if (!counts[k]) continue;
      double left = met[k].offset;
      for (std::size_t a = 0; a < shape_terms; ++a) left -= right[a] * shape_ray_table()[k].basis[a];
      squares += left * left;
    }
    const double placed = best_edge_px * frame_px_ / circle_.radius;
    const double variance =
        rays_that_agree * std::max(squares / static_cast<double>(seen - shape_terms), placed * placed);
    double inverse = 0;  // of the matrix, the mean of the last two on its diagonal
    for (std::size_t a = shape_terms - 2; a < shape_terms; ++a) {
      std::vector<double> unit(shape_terms, 0.0);
      unit[a] = 1;
      system = matrix;
      if (!solve_symmetric(system, unit, shape_terms)) return {};
      inverse += 0.5 * unit[a];
    }
    return {{right[3], right[4]}, std::sqrt(variance * inverse)};
  }

  const EdgeMap& edges_;
  const Circle& circle_;
  std::vector<Circle> near_;
  double frame_px_, sign_ = 1;
};

Circle on_map(Circle circle, const ScaledPicture& at) {
  circle.x = at.from_frame_x(circle.x), circle.y = at.from_frame_y(circle.y), circle.radius /= at.scale;
  return circle;
}

}  // namespace

std::vector<RimShape> shapes_of_rims(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& circles,
                                     const std::vector<Circle>& disks) {
  double largest = 1;
  for (const Circle& disk : disks) largest = std::max(largest, disk.radius);
  double reach = 1;
  for (const Circle& circle : circles)
    reach = std::max(reach, (1 + shape_reach) * circle.radius + largest + merged_px * std::max(1.0, circle.radius));
  const Nearby near(disks.size(), reach, [&](std::size_t i) { return std::pair(disks[i].x, disks[i].y); });
  std::vector<RimShape> shapes;
  for (const Circle& circle : circles) {
    const PictureMap& map = maps.scaled_for(circle.radius, model.threshold);
    const double frame_px = std::max(1.0, 1 / map.at.scale);
    std::vector<Circle> others;
    near.any_near(circle.x, circle.y, [&](std::size_t i) {
      constexpr double the_same = 0.3;  // radii
      const double away = std::hypot(disks[i].x - circle.x, disks[i].y - circle.y);
      if (away > the_same * circle.radius &&
          away < (1 + shape_reach) * circle.radius + disks[i].radius + merged_px * frame_px * map.at.scale)
        others.push_back(on_map(disks[i], map.at));
      return false;
    });
    const Circle here = on_map(circle, map.at);
    shapes.push_back(RimWalk(map.edges, here, model.polarity, std::move(others), frame_px).shape());
  }
  return shapes;
}

double axes_of(std::complex<double> second) { return (1 + second.real()) / (1 - second.real()); }

std::complex<double> shared_second(const std::vector<RimShape>& shapes) {
  std::vector<double> real, imaginary;
  for (const RimShape& shape : shapes)
    if (shape.std_error > 0) real.push_back(shape.second.real()), imaginary.push_back(shape.second.imag());
  if (real.size() < fewest_shared) return 0;
  return {median_of(std::move(real)), median_of(std::move(imaginary))};
}

bool departs_from_round(const RimShape& shape, std::complex<double> shared) {
  const double own = std::abs(shape.second - shared);
  return shape.std_error > 0 && own > least_second && own > least_errors * shape.std_error;
}

bool Departing::more_than_seem() const { return departing >= fewest_departing && round_nevertheless() < 0.5; }

double Departing::round_nevertheless() const {
  return departing == 0 ? 1 : std::min(1.0, seemingly * static_cast<double>(measured) / static_cast<double>(departing));
}

Departing departing_of(const std::vector<RimShape>& shapes, const std::vector<Circle>& circles,
                       std::complex<double> shared) {
  Departing out;
  double round = 0, support = 0;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const bool departs = departs_from_round(shapes[k], shared);
    out.measured += shapes[k].std_error > 0;
    out.departing += departs;
    if (!departs) ++round, support += circles[k].support;
  }
  out.seemingly = support < whole_support * round ? seemingly_of_covered : seemingly_of_whole;
  return out;
}

std::string left_out_as_not_round(const std::vector<Circle>& circles, double recorded_px) {
  std::vector<double> radii;
  for (const Circle& circle : circles) radii.push_back(circle.radius);
  return formatted(
      "%zu circles of about %.1f px radius were not counted: their rims are plainly not round, as those of ovals or of "
      "the ends of capsules.",
      circles.size(), median_of(std::move(radii)) * recorded_px);
}

}  // namespace shakebed::ingest
