#include "ingest/find/rim_line.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ingest/find/level_rays.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

namespace {

constexpr int line_sectors = 8, rays_of_line_sector = 8, line_rays = line_sectors * rays_of_line_sector;
constexpr double line_step_px = 0.25;
constexpr std::size_t enough_lines = 400;
// Radii of the circles. A circle may follow either edge of the line.
constexpr double line_reach = 1.8, line_outside_from = 1.6, line_inside_from = 0.3, line_inside_to = 0.6,
                 line_from = 0.75;
constexpr double free_ray_from = 0.6, nearest_to_free_ray = 1.8;  // no bead's centre lies so near to a free ray
constexpr double of_the_same_bead = 0.5;                          // radii: nearer centres are those of one bead
constexpr double smallest_lined_px = 5;
// Of the line: rays, and sectors in which there are any.
constexpr double fewest_line_rays = 64;
constexpr int fewest_line_sectors = 2;
// Of the depth: what the inside may be of it (it is as dark as the line where it is 1), what each sector shows at
// least, and the scatter outside.
constexpr double least_inside = -0.45, most_inside = 0.65, least_of_sector = 0.5, most_line_scatter = 0.12;
// The circles' radius over that of the edge that they follow. On a reduced map those of outer edges are too large.
constexpr double least_of_outer = 0.9, most_of_outer = 1.2, least_of_inner = 0.8, most_of_inner = 1.1;

// px: where in a line the outline is.
constexpr double unknown_outline_px = 0.2;
// Blur of s px moves the steepest edges of a line of half the width w from w to about sqrt(w^2 + s^2), and leaves those
// of wide ones. Slope times half their distance, over the depth, is 0.61 to 0.68 where w is below 1.2 s, 0.73 at 1.5 s
// and 0.84 at 2 s, so that it tells no more than that a line is thin. Of that half distance edges are 0.55 too far out
// at w = s / 2, 0.34 at 0.8 s and 0.13 at 1.2 s.
constexpr double steepest_of_thin = 0.66, thin_too_far = 0.25, thin_error = 0.2;

// Sums along rays, of each sector.
class RaySums {
 public:
  explicit RaySums(double radius_px)
      : radius_(radius_px), steps_(static_cast<int>(std::ceil(line_reach * radius_px / line_step_px))) {
    for (Sector& sector : sectors_) sector.sum.assign(static_cast<std::size_t>(steps_), 0.0);
  }

  [[nodiscard]] RayGrid grid() const { return {line_rays, steps_, steps_ * line_step_px}; }

  // `rays`: levels, a row each, and which of them are free.
  void add(const cv::Mat& rays, const std::array<bool, line_rays>& free) {
    const int from = place_of(line_outside_from);
    for (int k = 0; k < line_rays; ++k) {
      if (!free[static_cast<std::size_t>(k)]) continue;
      const float* ray = rays.ptr<float>(k);
      double outside = 0;
      for (int i = from; i < steps_; ++i) outside += static_cast<double>(ray[i]) / (steps_ - from);
      Sector& sector = sectors_[static_cast<std::size_t>(k / rays_of_line_sector)];
      for (int i = 0; i < steps_; ++i) sector.sum[static_cast<std::size_t>(i)] += static_cast<double>(ray[i]) - outside;
      ++sector.rays;
    }
  }

  [[nodiscard]] std::optional<LineAtRim> line(Polarity polarity) const {
    double rays = 0;
    int seen = 0;
    for (const Sector& sector : sectors_) rays += sector.rays, seen += sector.rays > 0;
    if (rays < fewest_line_rays || seen < fewest_line_sectors) return {};
    std::vector<double> profile(static_cast<std::size_t>(steps_), 0.0);
    for (const Sector& sector : sectors_)
      for (std::size_t i = 0; i < profile.size(); ++i)
        if (sector.rays > 0) profile[i] += sector.sum[i] / sector.rays / seen;
    const double inside = mean_of(profile, line_inside_from, line_inside_to);
    const auto off = [&](std::size_t i) { return std::abs(profile[i] - 0.5 * inside); };
    const auto first = static_cast<std::size_t>(place_of(line_from)),
               last = static_cast<std::size_t>(place_of(line_outside_from));
    std::size_t middle = first;
    for (std::size_t i = first; i < last; ++i)
      if (off(i) > off(middle)) middle = i;
    const double depth = profile[middle];
    if (middle == first || inside / depth < least_inside || inside / depth > most_inside || !all_show(middle, depth) ||
        scatter_outside(profile) > most_line_scatter * std::abs(depth))
      return {};
    const std::optional<double> outer = steepest(profile, middle, 1), inner = steepest(profile, middle, -1);
    if (!outer || !inner || !followed(*outer, *inner, depth, polarity)) return {};
    const double half = 0.5 * (*outer - *inner);
    const bool thin = std::abs(slope_at(profile, *outer) * half / depth) < steepest_of_thin;
    return LineAtRim{*outer - (thin ? thin_too_far * half : 0),
                     std::hypot(unknown_outline_px, thin ? thin_error * half : 0)};
  }

 private:
  struct Sector {
    std::vector<double> sum;
    double rays = 0;
  };

  [[nodiscard]] int place_of(double radii) const {
    return std::min(steps_ - 1, static_cast<int>(radii * radius_ / line_step_px));
  }
  [[nodiscard]] double mean_of(const std::vector<double>& profile, double from, double to) const {
    double sum = 0;
    for (int i = place_of(from); i < place_of(to); ++i) sum += profile[static_cast<std::size_t>(i)];
    return sum / std::max(1, place_of(to) - place_of(from));
  }
  // Whether the circles may be those of one of the edges.
  [[nodiscard]] bool followed(double outer, double inner, double depth, Polarity polarity) const {
    const Polarity of_outer = depth < 0 ? Polarity::dark_beads : Polarity::bright_beads;
    const double to_outer = radius_ / outer, to_inner = radius_ / inner;
    const bool at_outer = to_outer > least_of_outer && to_outer < most_of_outer;
    const bool at_inner = to_inner > least_of_inner && to_inner < most_of_inner;
    return polarity == of_outer || polarity == Polarity::automatic ? at_outer : at_inner;
  }
  [[nodiscard]] bool all_show(std::size_t at, double depth) const {
    return std::all_of(sectors_.begin(), sectors_.end(), [&](const Sector& sector) {
      return sector.rays == 0 || sector.sum[at] / sector.rays / depth > least_of_sector;
    });
  }
  [[nodiscard]] double scatter_outside(const std::vector<double>& profile) const {
    double squares = 0;
    const int from = place_of(line_outside_from);
    for (int i = from; i < steps_; ++i) squares += std::pow(profile[static_cast<std::size_t>(i)], 2);
    return std::sqrt(squares / (steps_ - from));
  }
  [[nodiscard]] double slope_at(const std::vector<double>& profile, double px) const {
    const auto i =
        static_cast<std::size_t>(std::clamp(static_cast<int>(std::lround(px / line_step_px)), 1, steps_ - 2));
    return (profile[i + 1] - profile[i - 1]) / (2 * line_step_px);
  }
  // From the middle of the line on, in px: where the level changes most.
  [[nodiscard]] std::optional<double> steepest(const std::vector<double>& profile, std::size_t middle, int way) const {
    const auto level = [&](int i) { return profile[static_cast<std::size_t>(i)]; };
    const auto slope = [&](int i) { return std::abs(level(i + 1) - level(i - 1)); };
    const int from = static_cast<int>(middle);
    int best = -1;
    for (int i = from; i >= 2 && i < steps_ - 2; i += way)
      if (best < 0 || slope(i) > slope(best)) best = i;
    if (best < 3 || best > steps_ - 4 || best == from) return {};
    const double before = slope(best - 1), at = slope(best), after = slope(best + 1), bend = before - 2 * at + after;
    return line_step_px * (best + (bend < 0 ? 0.5 * (before - after) / bend : 0.0));
  }

  double radius_;
  int steps_;
  std::array<Sector, line_sectors> sectors_;
};

// Rays along which no other bead is near.
std::array<bool, line_rays> free_rays(const Circle& of, const std::vector<Circle>& beads, const Nearby& near,
                                      double radius_px) {
  std::array<bool, line_rays> free{};
  free.fill(true);
  near.any_near(of.x, of.y, [&](std::size_t i) {
    const double dx = beads[i].x - of.x, dy = beads[i].y - of.y;
    if (std::hypot(dx, dy) < of_the_same_bead * radius_px) return false;
    for (std::size_t ray = 0; ray < free.size(); ++ray) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(ray) / line_rays;
      const double x = std::cos(angle), y = std::sin(angle);
      const double along = std::clamp(dx * x + dy * y, free_ray_from * radius_px, line_reach * radius_px);
      if (std::hypot(dx - along * x, dy - along * y) < nearest_to_free_ray * radius_px) free[ray] = false;
    }
    return false;
  });
  return free;
}

}  // namespace

std::optional<LineAtRim> line_at_rim(const GrayFrame& frame, const std::vector<Circle>& circles,
                                     const std::vector<Circle>& beads, double radius_px, Polarity polarity) {
  if (radius_px < smallest_lined_px || circles.empty()) return {};
  const Nearby near(beads.size(), (line_reach + nearest_to_free_ray) * radius_px,
                    [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
  RaySums sums(radius_px);
  const RayGrid grid = sums.grid();
  for (std::size_t k = 0; k < circles.size(); k += 1 + circles.size() / enough_lines)
    if (const cv::Mat rays = levels_along_rays(frame, circles[k].x, circles[k].y, grid); !rays.empty())
      sums.add(rays, free_rays(circles[k], beads, near, radius_px));
  return sums.line(polarity);
}

}  // namespace shakebed::ingest
