#include "ingest/find/missed_beads.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <numbers>

#include "ingest/find/edge_map.hpp"
#include "ingest/find/picture_maps.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Radii of the beads: the sizes of places that are looked for, the largest first.
constexpr std::array<double, 3> tried_sizes = {1.0, 0.8, 0.6};
constexpr double radii_covered = 0.2;  // radii of the beads: so near to a disk found, an edge is its own
constexpr double most_overlap = 0.12;  // of a place's radius, with a disk found
// Of a place's radius: between these its edges are looked for, in as many directions.
constexpr double nearest_edge = 0.35, farthest_edge = 1.15;
constexpr int tried_directions = 24;
// Of the directions that no disk covers: a straight line is met in 0.3, two that are parallel in 0.6.
constexpr double least_met = 0.65;
constexpr int fewest_open = 6;
// Of the beads' contrast.
constexpr double faintest_edge = 0.25;
// Of a disk's radius: its rim is looked for from here to farthest_edge.
constexpr double nearest_own_edge = 0.8;
// Cosine of the angle between the slope of a rim and the direction in which it is met: a place may lie beside the
// centre.
constexpr double least_across = 0.7;
// Of the rim that the median bead found shows: in photographs beads left out show 0.7 to 1, edges of other things that
// fill a place by chance 0.2 to 0.4. From here on a place counts in part, and from there on as a bead.
constexpr double counts_from = 0.25, counts_fully_from = 0.75;
constexpr double places_per_radius = 6;
constexpr double farthest_gap = 1.5;  // radii of the beads, from a place to the nearest disk found
// An edge is that of a wall or a floor where the tangent through it meets edges of the same direction on so much of the
// way, to one side or to both together, as far as no disk hides it. The tops of touching beads in a row are met on a
// third of it. Radii of the beads; cosine.
constexpr double tangent_from = 0.5, tangent_to = 3, same_direction = 0.95;
constexpr double least_to_one_side = 0.6, least_to_both = 0.45;

// Between beads that touch a wall or the floor only short pieces of its edge are seen. Radii of the beads, from the
// straight line that the outermost disks touch; so many must touch it.
constexpr double beside_wall = 0.3;
constexpr std::size_t fewest_at_wall = 4;

// Lines that the outermost disks touch: columns left and right, the row below.
struct OuterLines {
  double left = -HUGE_VAL, right = HUGE_VAL, below = HUGE_VAL;

  OuterLines(const std::vector<Circle>& disks, double radius) {
    std::vector<double> lefts, rights, bottoms;
    for (const Circle& disk : disks) {
      lefts.push_back(-(disk.x - disk.radius));
      rights.push_back(disk.x + disk.radius);
      bottoms.push_back(disk.y + disk.radius);
    }
    left = -touched_by_several(lefts, radius, HUGE_VAL);
    right = touched_by_several(rights, radius, HUGE_VAL);
    below = touched_by_several(bottoms, radius, HUGE_VAL);
  }

  [[nodiscard]] bool has(double x, double y, double radius) const {
    const double near = beside_wall * radius;
    return std::abs(x - left) < near || std::abs(x - right) < near || std::abs(y - below) < near;
  }

 private:
  // The largest of these; `none` unless several are nearly as large.
  static double touched_by_several(std::vector<double> ends, double radius, double none) {
    if (ends.size() < fewest_at_wall) return none;
    std::sort(ends.begin(), ends.end(), std::greater<>());
    return ends[0] - ends[fewest_at_wall - 1] < beside_wall * radius ? ends[0] : none;
  }
};

// Places of a map of edges that no disk covers.
class FreePlaces {
 public:
  FreePlaces(const EdgeMap& edges, const std::vector<Circle>& found, double radius, double contrast)
      : edges_(edges),
        radius_(radius),
        contrast_(contrast),
        clearance_(edges.x.size(), static_cast<float>(4 * radius)),
        edge_(edges.x.size(), 0) {
    for (const Circle& disk : found) cover(disk.x, disk.y, disk.radius);
    to_disk_ = clearance_;
    const OuterLines outer(found, radius);
    for (const RidgePixel& pixel : edges.ridge) {
      const int column = static_cast<int>(pixel.x), row = static_cast<int>(pixel.y);
      const std::size_t at = edges.at(column, row);
      const double step = step_per_slope * static_cast<double>(edges.slope(at));
      if (static_cast<double>(clearance_[at]) < radii_covered * radius || step < faintest_edge * contrast) continue;
      if (outer.has(pixel.x, pixel.y, radius) || is_straight(pixel)) continue;
      for (int y = std::max(0, row - 1); y <= std::min(edges.height - 1, row + 1); ++y)
        for (int x = std::max(0, column - 1); x <= std::min(edges.width - 1, column + 1); ++x)
          edge_[edges.at(x, y)] = 1;
    }
    sum_edges();
    std::vector<double> shown;
    for (const Circle& disk : found) shown.push_back(rim_shown(disk.x, disk.y, disk.radius, Edges::all));
    shown_by_beads_ = median_of(std::move(shown));
  }

  // Beads in places of this radius, the fullest first; each covers what it lies on.
  double take(double radius, const PixelRectangle& region, PlacesCount count) {
    struct Place {
      double met, x, y;
    };
    std::vector<Place> places;
    const double step = std::max(1.0, radius / places_per_radius);
    for (double y = region.top + radius; y <= region.top + region.height - radius; y += step)
      for (double x = region.left + radius; x <= region.left + region.width - radius; x += step)
        if (is_free(x, y, radius) && is_beside_a_disk(x, y, radius))
          if (const double met = share_met(x, y, radius); met >= least_met) places.push_back({met, x, y});
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.met > b.met; });
    double taken = 0;
    for (const Place& place : places) {
      if (!is_free(place.x, place.y, radius)) continue;
      const bool fully = count == PlacesCount::fully;
      taken += fully ? 1 : like_a_bead(rim_shown(place.x, place.y, radius, Edges::of_no_disk));
      cover(place.x, place.y, radius);
    }
    return taken;
  }

 private:
  [[nodiscard]] bool is_straight(const RidgePixel& pixel) const {
    const double one = straight_share(pixel, 1), other = straight_share(pixel, -1);
    return std::max(one, other) >= least_to_one_side || (one + other) / 2 >= least_to_both;
  }

  // edges_before_: pixels of edges above a row and left of a column.
  void sum_edges() {
    const auto width = static_cast<std::size_t>(edges_.width) + 1;
    edges_before_.assign(width * (static_cast<std::size_t>(edges_.height) + 1), 0);
    for (int row = 0; row < edges_.height; ++row) {
      std::uint32_t along = 0;
      std::uint32_t* above = edges_before_.data() + static_cast<std::size_t>(row) * width;
      for (int column = 0; column < edges_.width; ++column) {
        along += edge_[edges_.at(column, row)];
        above[width + static_cast<std::size_t>(column) + 1] = above[static_cast<std::size_t>(column) + 1] + along;
      }
    }
  }

  // Whether there are edges in the square around a place of this radius in which they are looked for.
  [[nodiscard]] bool has_edges_near(double x, double y, double radius) const {
    const double reach = farthest_edge * radius + 1;
    const auto column = [&](double at) { return static_cast<std::size_t>(std::clamp(at, 0.0, 1.0 * edges_.width)); };
    const auto row = [&](double at) { return static_cast<std::size_t>(std::clamp(at, 0.0, 1.0 * edges_.height)); };
    const std::size_t left = column(x - reach), right = column(x + reach + 1);
    const std::size_t width = static_cast<std::size_t>(edges_.width) + 1;
    const std::size_t above = row(y - reach) * width, below = row(y + reach + 1) * width;
    return edges_before_[below + right] + edges_before_[above + left] !=
           edges_before_[below + left] + edges_before_[above + right];
  }

  // Along the tangent, to the side of this sign; 0 where the picture ends.
  [[nodiscard]] double straight_share(const RidgePixel& pixel, int side) const {
    int seen = 0, met = 0;
    for (double away = tangent_from * radius_; away <= tangent_to * radius_; away += 1) {
      const double x = static_cast<double>(pixel.x) - side * away * static_cast<double>(pixel.unit_y),
                   y = static_cast<double>(pixel.y) + side * away * static_cast<double>(pixel.unit_x);
      if (x < 0 || y < 0 || x >= edges_.width || y >= edges_.height) break;
      const std::size_t at = edges_.at(static_cast<int>(x), static_cast<int>(y));
      if (static_cast<double>(clearance_[at]) < radii_covered * radius_) continue;  // a disk hides it
      ++seen;
      const float size = edges_.slope(at);
      const float along = edges_.x[at] * pixel.unit_x + edges_.y[at] * pixel.unit_y;
      met += size >= edges_.threshold && along >= static_cast<float>(same_direction) * size;
    }
    return seen > tangent_from * radius_ ? static_cast<double>(met) / seen : 0;
  }

  [[nodiscard]] bool is_free(double x, double y, double radius) const {
    return static_cast<double>(clearance_[edges_.at(static_cast<int>(x), static_cast<int>(y))]) >=
           (1 - most_overlap) * radius;
  }

  [[nodiscard]] bool is_beside_a_disk(double x, double y, double radius) const {
    return static_cast<double>(to_disk_[edges_.at(static_cast<int>(x), static_cast<int>(y))]) <
           radius + farthest_gap * radius_;
  }

  void cover(double x, double y, double radius) {
    const double far = radius + 3 * radius_;
    const int left = std::max(0, static_cast<int>(x - far)), top = std::max(0, static_cast<int>(y - far));
    const int right = std::min(edges_.width - 1, static_cast<int>(x + far));
    const int bottom = std::min(edges_.height - 1, static_cast<int>(y + far));
    for (int row = top; row <= bottom; ++row)
      for (int column = left; column <= right; ++column) {
        float& clearance = clearance_[edges_.at(column, row)];
        const double dx = column - x, dy = row - y;
        clearance = std::min(clearance, static_cast<float>(std::sqrt(dx * dx + dy * dy) - radius));
      }
  }

  // Of the directions from a place that are not covered, the share in which an edge is met.
  [[nodiscard]] double share_met(double x, double y, double radius) const {
    if (!has_edges_near(x, y, radius)) return 0;  // most places
    int open = 0, met = 0;
    for (const Direction& direction : directions()) {
      bool edge = false, uncovered = false;
      along(x, y, direction, {nearest_edge * radius, farthest_edge * radius}, [&](double away, std::size_t at) {
        uncovered = uncovered || (away > 0.8 * radius && static_cast<double>(clearance_[at]) > radii_covered * radius_);
        edge = edge || edge_[at] != 0;
      });
      open += uncovered;
      met += uncovered && edge;
    }
    return open < fewest_open ? 0 : static_cast<double>(met) / open;
  }

  // How far a place counts that shows so much of a rim.
  [[nodiscard]] double like_a_bead(double shown) const {
    const double most = counts_fully_from * shown_by_beads_, least = counts_from * shown_by_beads_;
    return shown >= most ? 1 : std::max(0.0, (shown - least) / (most - least));
  }

  enum class Edges { all, of_no_disk };

  // How much of a rim is seen: how steeply the level changes across it, in units of the beads' contrast and at most 1,
  // in the mean of the directions in which no disk is near. Edges along a direction are none of a rim.
  [[nodiscard]] double rim_shown(double x, double y, double radius, Edges edges) const {
    const bool of_place = edges == Edges::of_no_disk;
    const double nearest = (of_place ? nearest_edge : nearest_own_edge) * radius;
    int open = 0;
    double shown = 0;
    for (const Direction& direction : directions()) {
      bool uncovered = false;
      along(x, y, direction, {radius, radius}, [&](double, std::size_t at) {
        uncovered = !of_place || static_cast<double>(clearance_[at]) > radii_covered * radius_;
      });
      if (!uncovered) continue;
      double steepest = 0;
      along(x, y, direction, {nearest, farthest_edge * radius}, [&](double, std::size_t at) {
        if (of_place && edge_[at] == 0) return;
        const double steep = static_cast<double>(edges_.slope(at));
        const double across =
            static_cast<double>(edges_.x[at]) * direction[0] + static_cast<double>(edges_.y[at]) * direction[1];
        if (std::abs(across) > least_across * steep) steepest = std::max(steepest, step_per_slope * steep);
      });
      ++open;
      shown += std::min(1.0, steepest / contrast_);
    }
    return open > 0 ? shown / open : 0;
  }

  using Direction = std::array<double, 2>;
  static const std::array<Direction, tried_directions>& directions() {
    static const std::array<Direction, tried_directions> units = [] {
      std::array<Direction, tried_directions> all{};
      for (std::size_t k = 0; k < tried_directions; ++k) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(k) / tried_directions;
        all[k] = {std::cos(angle), std::sin(angle)};
      }
      return all;
    }();
    return units;
  }

  // Calls look(distance, pixel) for each pixel in view in this direction.
  struct Span {
    double from = 0, to = 0;  // px
  };
  template <class Look>
  void along(double x, double y, const Direction& direction, const Span& span, const Look& look) const {
    for (double away = span.from; away <= span.to; away += 1) {
      const int column = static_cast<int>(x + away * direction[0] + 0.5),
                row = static_cast<int>(y + away * direction[1] + 0.5);
      if (column < 0 || row < 0 || column >= edges_.width || row >= edges_.height) continue;
      look(away, edges_.at(column, row));
    }
  }

  const EdgeMap& edges_;
  double radius_, contrast_;
  double shown_by_beads_ = 1;       // rim_shown() of the median disk found
  std::vector<float> clearance_;    // px to the nearest disk or place taken, below 0 inside
  std::vector<float> to_disk_;      // the same, to disks alone
  std::vector<std::uint8_t> edge_;  // 1 within a pixel of an edge that is no disk's
  std::vector<std::uint32_t> edges_before_;
};

}  // namespace

double expected_missed_beads(const GrayFrame& frame, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region) {
  PictureMaps maps(frame, quick_search.wanted_px);
  return expected_missed_beads(maps, model, found, region);
}

double expected_missed_beads(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& found,
                             const std::optional<PixelRectangle>& region, PlacesCount count) {
  // A threshold that was learned at another scale says nothing here.
  const bool of_this_scale = model.search.wanted_px == quick_search.wanted_px;
  const auto& [at, edges, copies] = maps.scaled_for(model.radius_px, of_this_scale ? model.threshold : 0);
  std::vector<Circle> disks = found;
  for (Circle& disk : disks) {
    disk.x = at.from_frame_x(disk.x);
    disk.y = at.from_frame_y(disk.y);
    disk.radius /= at.scale;
  }
  PixelRectangle searched{1, 1, edges.width - 2, edges.height - 2};
  if (region) {
    searched.left = std::max(1, static_cast<int>(region->left / at.scale));
    searched.top = std::max(1, static_cast<int>(region->top / at.scale));
    searched.width =
        std::min(edges.width - 1, static_cast<int>((region->left + region->width) / at.scale)) - searched.left;
    searched.height =
        std::min(edges.height - 1, static_cast<int>((region->top + region->height) / at.scale)) - searched.top;
  }
  const double radius = model.radius_px / at.scale;
  FreePlaces places(edges, disks, radius, model.contrast);
  double missed = 0;
  for (const double size : tried_sizes) missed += size * size * places.take(size * radius, searched, count);
  return missed;
}

double share_of_missed(double missed, std::size_t found) {
  return missed / std::max(1.0, static_cast<double>(found) + missed);
}

}  // namespace shakebed::ingest
