#include "ingest/find/circle_census.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ingest/calibrate/picture_parts.hpp"
#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/picture_maps.hpp"
#include "ingest/find/picture_scale.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr double smallest_at_level = 5, largest_at_level = 10.4;  // px, radii searched at each level of the pyramid
constexpr int smallest_picture = 12;  // px, side: the smallest circle fits in, with a margin
// px, side: in a smaller picture two circles fit beside one another at most. So few are asked for this share of rim.
constexpr int room_for_two = 20;
constexpr double few_asked = 0.8;
constexpr int census_window = 640;  // px, of the busiest part searched at each level
constexpr double mode_width = 0.1;  // radii of one hypothesis, either way
constexpr double faintest_census_support = 0.35, least_asked = 0.4;
constexpr std::size_t most_hypotheses = 12;
constexpr double full_contrast_share = 0.3;  // of the picture's range of levels: such an edge counts in full

ScaledPicture windowed(const GrayFrame& picture, double scale, int side) {
  ScaledPicture level;
  const PicturePart part = busiest_part(picture, side, {.block = 16, .reach = 2, .stride = 2});
  level.picture = cut_out(picture, part);
  level.scale = scale;
  level.left = part.left * scale;
  level.top = part.top * scale;
  return level;
}

struct RadiusRange {
  double from, to;  // px of the level
};
RadiusRange radii_at(double scale, const CensusOptions& options) {
  if (!options.radius_px) return {smallest_at_level, largest_at_level};
  return {std::max(smallest_at_level, *options.radius_px / given_radius_factor / scale),
          std::min(largest_at_level, *options.radius_px * given_radius_factor / scale)};
}

// From twice the resolution down, until no circle fits in any more.
std::vector<ScaledPicture> pyramid_of(const GrayFrame& frame, const CensusOptions& options) {
  std::vector<ScaledPicture> levels;
  const auto wanted = [&](double scale) {
    const RadiusRange range = radii_at(scale, options);
    return range.from < range.to && largest_at_level * scale > options.smallest_radius_px;
  };
  if (wanted(0.5)) {
    ScaledPicture half = windowed(frame, 1, census_window / 2);
    half.picture = doubled(half.picture);
    half.scale = 0.5;
    levels.push_back(std::move(half));
  }
  GrayFrame picture = frame;
  for (double scale = 1; std::min(picture.width, picture.height) >= smallest_picture; scale *= 2) {
    if (wanted(scale)) levels.push_back(windowed(picture, scale, census_window));
    picture = halved(picture);
  }
  return levels;
}

double range_of(const GrayFrame& frame) {
  std::vector<float> levels;
  const std::size_t step = std::max<std::size_t>(1, frame.pixels.size() / 100000);
  for (std::size_t k = 0; k < frame.pixels.size(); k += step)
    if (!unseen(frame.pixels[k])) levels.push_back(frame.pixels[k]);
  if (levels.empty()) return 1;
  return std::max(1.0,
                  static_cast<double>(quantile_of(levels, 0.998)) - static_cast<double>(quantile_of(levels, 0.002)));
}

// What one circle explains, px of its level.
double gain_of(const Circle& circle, double range) {
  const double weight = std::min(1.0, circle.contrast / (full_contrast_share * range));
  return weight * (2 * std::numbers::pi * circle.radius * circle.support - circle_cost_px);
}

std::vector<Circle> near_radius(const std::vector<Circle>& circles, double radius) {
  std::vector<Circle> near;
  for (const Circle& circle : circles)
    if (std::abs(circle.radius / radius - 1) < mode_width) near.push_back(circle);
  return without_doubles(std::move(near), 0.8);
}

struct Found {
  std::vector<Circle> picture;
  std::array<std::vector<Circle>, 2> copies;
};

struct Sum {
  double count = 0, gain = 0;
};
Sum sum_of(const std::vector<Circle>& circles, double least_support, double range) {
  Sum sum;
  for (const Circle& circle : circles)
    if (circle.support >= least_support) {
      ++sum.count;
      sum.gain += gain_of(circle, range);
    }
  return sum;
}

// The hypothesis of this radius at the threshold of support that serves it best.
CircleHypothesis weigh(const Found& found, double radius, double range, double from_support, double* by_chance) {
  CircleHypothesis best;
  const std::vector<Circle> seen = near_radius(found.picture, radius);
  const std::array<std::vector<Circle>, 2> copies = {near_radius(found.copies[0], radius),
                                                     near_radius(found.copies[1], radius)};
  for (double least = from_support; least < 0.99; least += 0.05) {
    const Sum here = sum_of(seen, least, range);
    const Sum one = sum_of(copies[0], least, range), other = sum_of(copies[1], least, range);
    const double gain = here.gain - 0.5 * (one.gain + other.gain);
    *by_chance =
        std::max({*by_chance, one.gain - 0.5 * (here.gain + other.gain), other.gain - 0.5 * (here.gain + one.gain)});
    if (!(gain > best.gain_px)) continue;
    best.gain_px = gain;
    best.least_support = least;
    best.circles = here.count;
    best.by_chance = 0.5 * (one.count + other.count);
    best.radius_px = radius;
  }
  std::vector<double> contrasts;
  for (const Circle& circle : seen)
    if (circle.support >= best.least_support) {
      best.seen.push_back(circle);
      best.scatter += circle.scatter / best.circles;
      contrasts.push_back(circle.contrast);
    }
  if (!contrasts.empty()) best.contrast = median_of(std::move(contrasts));
  return best;
}

// Whether circles are so many, and so much of all edges, that finer levels show but parts of them.
bool makes_up_the_picture(const CircleHypothesis& one) {
  constexpr double most_of_the_edges = 0.4, hardly_by_chance = 0.02, many = 50;
  return one.explained_share >= most_of_the_edges && one.circles >= many &&
         one.by_chance <= hardly_by_chance * one.circles;
}

class Census {
 public:
  explicit Census(const CensusOptions& options) : options_(options) {}

  // From the coarsest level on, until one of them shows what makes up the picture.
  void search(std::size_t channel, const GrayFrame& frame) {
    const double range = range_of(frame);
    const std::vector<ScaledPicture> levels = pyramid_of(frame, options_);
    for (auto level = levels.rbegin(); level != levels.rend(); ++level) {
      const std::size_t before = all_.size();
      search_level(channel, *level, range);
      if (std::any_of(all_.begin() + static_cast<std::ptrdiff_t>(before), all_.end(), makes_up_the_picture)) return;
    }
  }

  CircleCensus result() {
    std::sort(all_.begin(), all_.end(),
              [](const CircleHypothesis& a, const CircleHypothesis& b) { return a.gain_px > b.gain_px; });
    for (CircleHypothesis& one : all_) {
      constexpr double another = 1.15;
      const bool known = std::any_of(census_.hypotheses.begin(), census_.hypotheses.end(), [&](const auto& other) {
        return other.channel == one.channel && other.polarity == one.polarity &&
               std::max(other.radius_px / one.radius_px, one.radius_px / other.radius_px) < another;
      });
      if (!known && census_.hypotheses.size() < most_hypotheses) census_.hypotheses.push_back(std::move(one));
    }
    return std::move(census_);
  }

 private:
  void search_level(std::size_t channel, const ScaledPicture& level, double range) {
    const EdgeMap edges = edges_of(level);
    std::array<EdgeMap, 2> of_copies;
    for_each_piece(of_copies.size(), [&](std::size_t copy) {
      const double angle = static_cast<double>(copy) * std::numbers::pi / 4;
      of_copies[copy] = edges_of_stretched(level.picture, decoy_stretch, angle, edges.threshold);
    });
    const RadiusRange range_of_radii = radii_at(level.scale, options_);
    const bool tiny = std::min(level.picture.width, level.picture.height) < room_for_two;
    for (const Polarity polarity : {Polarity::dark_beads, Polarity::bright_beads}) {
      if (options_.polarity != Polarity::automatic && options_.polarity != polarity) continue;
      Found found;
      for_each_piece(1 + of_copies.size(), [&](std::size_t piece) {
        (piece == 0 ? found.picture : found.copies[piece - 1]) =
            find_circles(piece == 0 ? edges : of_copies[piece - 1],
                         {smallest_at_level, largest_at_level, polarity, faintest_census_support});
      });
      for (double radius = range_of_radii.from; radius < range_of_radii.to; radius *= 1.05) {
        double by_chance = 0;
        CircleHypothesis hypothesis = weigh(found, radius, range, tiny ? few_asked : least_asked, &by_chance);
        census_.best_by_chance_px = std::max(census_.best_by_chance_px, by_chance * level.scale);
        if (!(hypothesis.gain_px > 0)) continue;
        hypothesis.channel = channel;
        hypothesis.polarity = polarity;
        hypothesis.explained_share =
            hypothesis.gain_px / static_cast<double>(std::max<std::size_t>(1, edges.ridge.size()));
        hypothesis.radius_px *= level.scale;
        hypothesis.gain_px *= level.scale;
        for (Circle& circle : hypothesis.seen) circle = in_the_frame(circle, level);
        all_.push_back(std::move(hypothesis));
      }
    }
  }

  CensusOptions options_;
  CircleCensus census_;
  std::vector<CircleHypothesis> all_;
};

}  // namespace

CircleCensus census_of(const GrayFrame& frame, std::size_t channel, const CensusOptions& options) {
  Census census(options);
  census.search(channel, frame);
  return census.result();
}

void add_census(const CircleCensus& other, CircleCensus& census) {
  std::vector<CircleHypothesis>& all = census.hypotheses;
  all.insert(all.end(), other.hypotheses.begin(), other.hypotheses.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const CircleHypothesis& a, const CircleHypothesis& b) { return a.gain_px > b.gain_px; });
  if (all.size() > most_hypotheses) all.resize(most_hypotheses);
  census.best_by_chance_px = std::max(census.best_by_chance_px, other.best_by_chance_px);
}

CircleCensus take_census(const std::vector<const GrayFrame*>& channels, const CensusOptions& options) {
  CircleCensus census;
  for (std::size_t channel = 0; channel < channels.size(); ++channel)
    add_census(census_of(*channels[channel], channel, options), census);
  return census;
}

}  // namespace shakebed::ingest
