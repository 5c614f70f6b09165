#include "ingest/find/rim_gaps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <optional>

#include "ingest/find/nearby.hpp"
#include "ingest/find/rim_probability.hpp"
#include "ingest/find/rim_shape.hpp"
#include "ingest/frames/picture_threads.hpp"
#include "ingest/frames/stop_question.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

constexpr double gap_reach = 2;  // radii: so far from a bead's rim a circle's rim may be
// Radii: a fit moves a circle no farther from where votes placed it, and makes it no larger.
constexpr double farthest_fitted = 0.5, largest_fitted = 1.4;
constexpr double nearest_rims = 0.8;       // sums of radii: two circles nearer than that overlap
constexpr double same_bead_radius = 0.12;  // of the radius that beads share, either way
// In radii of the beads. At half of it, fringes in photoelastic disks are mistaken for beads, unless there is a size
// that many share.
constexpr double smallest_spread = 0.6, largest_spread = 1.67;
constexpr double smallest_shared = 0.36, largest_shared = 2.8;
constexpr double least_gap_radius_px = 4;      // of the map: a smaller circle looks like dust
constexpr double least_gap_probability = 0.5;  // of a circle that is reported
constexpr int most_gap_rounds = 8;             // of circles beside circles
// Other sizes are accepted when at least this number is expected, and this share of the beads.
constexpr double fewest_others = 3, least_share_of_others = 0.05;
// Smaller ones than of a spread: specks outside a container passed as beads of 0.35 radii, 4 beside 65.
constexpr double fewest_small = 6, least_share_of_small = 0.1;
// Mean probability of sizes outside a spread: drawn beads 0.95 or more, fringes in disks that were missed 0.78 at most.
constexpr double least_sure_far_off = 0.9;
constexpr int most_sizes_tried = 3;
// A bead gives its place to a larger one for which at least this speaks, where less than this share of it speaks for
// the bead. Beads found inside coins: a fifth to a third.
constexpr double sure_rival = 0.9, small_share_of_evidence = 0.5;
// Radii are tried in steps of this ratio. A circle speaks for a size by what its support exceeds this.
constexpr double size_step = 1.04, worthless_support = 0.4;

// Where a place of the map is in the picture that the beads were found in.
using ToFrame = std::function<FramePlace(double x, double y)>;

struct GapMap {
  const EdgeMap& edges;
  double scale = 1;  // px of the frame a px of the map
  ToFrame to_frame;
  const StretchedBand* band = nullptr;  // of a copy
};

bool within(double radius, const SizeBand& band) { return radius >= band.from_px && radius <= band.to_px; }

// Circles of a map, px of the frame, and which of them lie beside beads and overlap none.
class GapSearch {
 public:
  // Of a map, where `scale` px of the frame are one. `model`: of the beads found at first. Circles on those of `beads`
  // are not looked for. Those far from all beads are not fitted before there are beads near them.
  GapSearch(GapMap map, const SizeBand& band, const RimModel& model, const std::vector<Circle>& beads)
      : map_(std::move(map)), band_(band), radius_(model.radius_px), polarity_(model.polarity) {
    const double tolerated = 1 + 0.4 * same_bead_radius;
    CirclesAsked asked;
    asked.from_px = std::max(least_gap_radius_px, band.from_px * tolerated / map_.scale);
    asked.to_px = band.to_px / tolerated / map_.scale;
    if (!(asked.from_px < asked.to_px)) return;
    // Fringes of a disk that is missed look like small beads where edges of either sign count.
    const bool small = band.to_px < smallest_spread * (1 + 2 * same_bead_radius) * model.radius_px;
    if (small && model.polarity == Polarity::automatic) return;
    asked.polarity = model.polarity;
    asked.least_support = faintest_rim_support;
    if (!small) asked.votes = model.search.votes;
    if (within(model.radius_px, band)) asked.votes.least = model.search.least_votes_in_gaps;
    const double largest = largest_of(beads);
    const Nearby near(beads.size(), nearest_rims * (largest + band.to_px),
                      [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    const NearBeads reached(beads, radius_, band.to_px);
    asked.leave_out = [&](const Circle& peak) {
      const FramePlace place = map_.to_frame(peak.x, peak.y);
      const double radius = peak.radius * map_.scale;
      if (near.any_near(place.x, place.y, [&](std::size_t i) {
            return std::hypot(beads[i].x - place.x, beads[i].y - place.y) <
                   nearest_rims * (beads[i].radius + radius) - farthest_fitted * radius;
          }))
        return true;
      const Peak one{peak, place, radius};
      if (beads.empty() || reached.by(one)) return false;
      far_.push_back(one);
      return true;
    };
    for (const Circle& circle : find_circles(map_.edges, asked)) add(circle);
  }

  [[nodiscard]] std::vector<Circle> beside(const std::vector<Circle>& beads) {
    fit_near(beads);
    const Nearby near(beads.size(), std::max(radius_, largest_of(beads)) + largest_ + gap_reach * radius_,
                      [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    std::vector<Circle> free;
    for (const Circle& circle : circles_) {
      bool beside = false;
      const bool overlaps = near.any_near(circle.x, circle.y, [&](std::size_t i) {
        const double away = std::hypot(beads[i].x - circle.x, beads[i].y - circle.y);
        const double touching = beads[i].radius + circle.radius;
        beside = beside || away < touching + gap_reach * radius_;
        return away < nearest_rims * touching;
      });
      if (beside && !overlaps) free.push_back(circle);
    }
    return without_doubles(std::move(free), nearest_rims);
  }

  // Of a search beside no beads.
  [[nodiscard]] const std::vector<Circle>& all() const { return circles_; }

  void leave_out(double from_px, double to_px) {
    wanted_.push_back({from_px, to_px, false});
    drop_unwanted();
  }
  void keep_only(double from_px, double to_px) {
    wanted_.push_back({from_px, to_px, true});
    drop_unwanted();
  }

 private:
  // Where votes place a circle: px of the map, and of the frame.
  struct Peak {
    Circle on_map;
    FramePlace place;
    double radius = 0;
  };
  // Whether the circle that is fitted there may lie beside one of these beads.
  class NearBeads {
   public:
    NearBeads(const std::vector<Circle>& beads, double radius, double largest_peak)
        : beads_(beads),
          gap_(gap_reach * radius),
          near_(beads.size(), largest_of(beads) + gap_ + (farthest_fitted + largest_fitted) * largest_peak,
                [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); }) {}
    [[nodiscard]] bool by(const Peak& peak) const {
      const double reach = gap_ + (farthest_fitted + largest_fitted) * peak.radius;
      return near_.any_near(peak.place.x, peak.place.y, [&](std::size_t i) {
        return std::hypot(beads_[i].x - peak.place.x, beads_[i].y - peak.place.y) < beads_[i].radius + reach;
      });
    }

   private:
    const std::vector<Circle>& beads_;
    double gap_;
    Nearby near_;
  };
  struct Wanted {
    double from_px, to_px;
    bool inside;
    [[nodiscard]] bool holds(double radius) const { return (radius >= from_px && radius <= to_px) == inside; }
  };

  static double largest_of(const std::vector<Circle>& beads) {
    double largest = 1;
    for (const Circle& bead : beads) largest = std::max(largest, bead.radius);
    return largest;
  }

  [[nodiscard]] bool is_wanted(double radius) const {
    return std::all_of(wanted_.begin(), wanted_.end(), [&](const Wanted& one) { return one.holds(radius); });
  }
  void drop_unwanted() {
    std::erase_if(circles_, [&](const Circle& one) { return !is_wanted(one.radius); });
  }

  void add(Circle circle) {
    if (map_.band != nullptr && !map_.band->holds(circle.y)) return;
    circle.radius *= map_.scale;
    if (!within(circle.radius, band_) || !is_wanted(circle.radius)) return;
    const auto [x, y] = map_.to_frame(circle.x, circle.y);
    circle.x = x, circle.y = y;
    circles_.push_back(circle);
    largest_ = std::max(largest_, circle.radius);
  }

  void fit_near(const std::vector<Circle>& beads) {
    if (far_.empty()) return;
    const NearBeads reached(beads, radius_, band_.to_px);
    std::erase_if(far_, [&](const Peak& peak) {
      if (!reached.by(peak)) return false;
      StopQuestion::ask();
      const Circle circle = fit_circle(map_.edges, peak.on_map, polarity_);
      if (circle.support >= faintest_rim_support) add(circle);
      return true;
    });
  }

  GapMap map_;
  SizeBand band_;
  double radius_, largest_ = 1;
  Polarity polarity_;
  std::vector<Circle> circles_;
  std::vector<Peak> far_;  // not fitted
  std::vector<Wanted> wanted_;
};

// Adds those of at least the `least` probability to the beads, then those beside these, until there are no more.
// Returns the sum of the probabilities of what is left.
double take_likely(GapSearch& search, const std::vector<double>& probability, const SizeBand* size,
                   std::vector<Circle>& beads, std::vector<GapCircle>& taken, double least = least_gap_probability) {
  for (int round = 0;; ++round) {
    double left = 0;
    const std::size_t before = taken.size();
    for (const Circle& circle : search.beside(beads)) {
      const double its = probability_at(probability, circle.support);
      if (its < least)
        left += its;
      else
        taken.push_back({circle, its, size});
    }
    for (std::size_t k = before; k < taken.size(); ++k) beads.push_back(taken[k].circle);
    if (taken.size() == before || round == most_gap_rounds) return left;
  }
}

SizeBand around(double radius_px) {
  SizeBand band;
  band.from_px = (1 - same_bead_radius) * radius_px;
  band.to_px = (1 + same_bead_radius) * radius_px;
  return band;
}

GapMap map_of(const PictureMap& map) {
  return {map.edges, map.at.scale,
          [&map](double x, double y) {
            return FramePlace{map.at.to_frame_x(x), map.at.to_frame_y(y)};
          },
          nullptr};
}

GapMap map_of(const PictureMap& map, const StretchedBand& rows) {
  return {rows.edges, map.at.scale,
          [&map, &rows](double x, double y) {
            const auto [u, v] =
                place_before_stretching(map.at.picture, decoy_stretch, rows.angle, x, y + rows.first_row);
            return FramePlace{map.at.to_frame_x(u), map.at.to_frame_y(v)};
          },
          &rows};
}

// A search in the picture and the same in its copies.
struct WithCopies {
  GapSearch picture;
  std::vector<std::vector<GapSearch>> copies;  // of each its bands

  WithCopies(PictureMaps& maps, const SizeBand& band, const RimModel& model, const std::vector<Circle>& beads)
      : WithCopies(maps.with_copies(std::sqrt(band.from_px * band.to_px), model.threshold), band, model, beads) {}

  // Of each copy.
  [[nodiscard]] std::vector<std::vector<Circle>> by_chance_beside(const std::vector<Circle>& beads) {
    std::vector<std::vector<Circle>> by_chance;
    for (std::vector<GapSearch>& copy : copies) {
      by_chance.emplace_back();
      for (GapSearch& band : copy)
        for (const Circle& circle : band.beside(beads)) by_chance.back().push_back(circle);
    }
    return by_chance;
  }
  [[nodiscard]] std::vector<double> probabilities(const std::vector<Circle>& beads) {
    return probabilities_by_support(picture.beside(beads), by_chance_beside(beads), Known::beads);
  }
  template <class Change>
  void change(const Change& change) {
    change(picture);
    for (std::vector<GapSearch>& copy : copies)
      for (GapSearch& one : copy) change(one);
  }

 private:
  WithCopies(const PictureMap& map, const SizeBand& band, const RimModel& model, const std::vector<Circle>& beads)
      : WithCopies(map, searches_of(map, band, model, beads)) {}

  // The first of the searches is that of the picture, the others are those of the bands.
  WithCopies(const PictureMap& map, std::vector<std::optional<GapSearch>> searches)
      : picture(std::move(*searches.front())) {
    std::size_t which = 1;
    for (const StretchedCopy& copy : map.copies) {
      copies.emplace_back();
      for (std::size_t band = 0; band < copy.size(); ++band) copies.back().push_back(std::move(*searches[which++]));
    }
  }

  static std::vector<std::optional<GapSearch>> searches_of(const PictureMap& map, const SizeBand& band,
                                                           const RimModel& model, const std::vector<Circle>& beads) {
    const std::vector<const StretchedBand*> bands = bands_of(map.copies);
    std::vector<std::optional<GapSearch>> searches(1 + bands.size());
    for_each_piece(searches.size(), [&](std::size_t piece) {
      searches[piece].emplace(piece == 0 ? map_of(map) : map_of(map, *bands[piece - 1]), band, model, beads);
    });
    return searches;
  }
};

// The other sizes of beads in a picture.
class OtherSizes {
 public:
  OtherSizes(PictureMaps& maps, const RimModel& model, std::vector<Circle>& known)
      : maps_(maps), model_(model), known_(known), of_one_size_(static_cast<double>(known.size())) {
    const double radius = model.radius_px;
    constexpr std::array<double, 5> limits = {smallest_shared, smallest_spread, 1, largest_spread, largest_shared};
    for (std::size_t k = 0; k + 1 < limits.size(); ++k) {
      SizeBand band;
      band.from_px = limits[k] * radius, band.to_px = limits[k + 1] * radius;
      SizeBand searched = band;
      searched.from_px *= 1 - same_bead_radius, searched.to_px *= 1 + same_bead_radius;
      groups_.push_back({band, WithCopies(maps, searched, model, known)});
    }
    leave_out(around(radius));
  }

  // Of sizes that were left out; what two sizes share once.
  [[nodiscard]] std::vector<Circle> not_round() const { return without_doubles(not_round_, nearest_rims); }

  std::vector<SizeBand> find() {
    std::vector<SizeBand> found;
    for (int tried = 0; tried < most_sizes_tried; ++tried) {
      const std::optional<double> radius = next_radius();
      if (!radius) break;
      tried_.push_back(around(*radius));
      if (const std::optional<SizeBand> shared = taken_near(*radius)) {
        found.push_back(*shared);
        leave_out(tried_.back());
      }
    }
    for (Group& group : groups_) {
      if (group.band.from_px < smallest_spread * model_.radius_px ||
          group.band.to_px > largest_spread * model_.radius_px)
        continue;
      if (const std::optional<SizeBand> spread = taken_from(group.band, group.search)) found.push_back(*spread);
    }
    return found;
  }

 private:
  struct Group {
    SizeBand band;
    WithCopies search;
  };

  void leave_out(const SizeBand& band) {
    for (Group& group : groups_) group.search.change([&](GapSearch& one) { one.leave_out(band.from_px, band.to_px); });
  }

  // What circles near this radius say for a size of their own, px of rims.
  [[nodiscard]] double gain_near(const std::vector<Circle>& circles, const SizeBand& band) const {
    const auto was_tried = [&](double radius) {
      return std::any_of(tried_.begin(), tried_.end(), [&](const SizeBand& one) { return within(radius, one); });
    };
    double gain = 0;
    for (const Circle& circle : circles)
      if (within(circle.radius, band) && !was_tried(circle.radius))
        gain += circle.radius * std::max(0.0, circle.support - worthless_support);
    return gain;
  }

  // The radius that most speaks for. Several in a row may hold the same circles: theirs is in the middle of the band.
  [[nodiscard]] std::optional<double> next_radius() {
    struct Seen {
      std::vector<Circle> picture;
      std::vector<std::vector<Circle>> copies;
    };
    double best_gain = 0, best_radius = 0;
    for (Group& group : groups_) {
      Seen seen;
      seen.picture = group.search.picture.beside(known_);
      seen.copies = group.search.by_chance_beside(known_);
      for (double radius = group.band.from_px; radius < group.band.to_px; radius *= size_step) {
        const SizeBand band = around(radius);
        double gain = gain_near(seen.picture, band);
        for (const auto& copy : seen.copies) gain -= gain_near(copy, band) / static_cast<double>(seen.copies.size());
        if (gain > best_gain) best_gain = gain, best_radius = middle_radius(seen.picture, band);
      }
    }
    return best_gain > 0 ? std::optional<double>(best_radius) : std::nullopt;
  }

  // Of the circles that say something for the band.
  [[nodiscard]] double middle_radius(const std::vector<Circle>& circles, const SizeBand& band) const {
    std::vector<double> radii;
    for (const Circle& circle : circles)
      if (gain_near({circle}, band) > 0) radii.push_back(circle.radius);
    return median_of(std::move(radii));
  }

  std::optional<SizeBand> taken_near(double radius) {
    const SizeBand band = around(radius);
    for (const Group& group : groups_)
      if (within(radius, group.band)) {
        WithCopies search = group.search;
        search.change([&](GapSearch& one) { one.keep_only(band.from_px, band.to_px); });
        std::vector<Circle> before = known_;
        std::optional<SizeBand> taken = taken_from(band, search);
        // Sizes that differ are left to the spread, which may hold more of them.
        if (taken && taken->radius_px == 0 && in_the_spread(band)) known_ = std::move(before), taken.reset();
        return taken;
      }
    return std::nullopt;
  }

  [[nodiscard]] bool in_the_spread(const SizeBand& band) const {
    return band.from_px >= smallest_spread * model_.radius_px && band.to_px <= largest_spread * model_.radius_px;
  }

  // Adds to the known beads what is likely in this band, if that is enough to believe in it.
  std::optional<SizeBand> taken_from(SizeBand band, WithCopies& search) {
    band.probability = search.probabilities(known_);
    std::vector<Circle> with_these = known_;
    std::vector<GapCircle> taken;
    take_likely(search.picture, band.probability, nullptr, with_these, taken);
    double expected = 0;
    for (const GapCircle& one : taken) expected += one.probability;
    if (!believed(band, expected, static_cast<double>(taken.size()))) return std::nullopt;
    if (mostly_not_round(taken, with_these)) {
      for (const GapCircle& one : taken) not_round_.push_back(one.circle);
      return std::nullopt;
    }
    band.radius_px = shared_radius(taken);
    known_ = std::move(with_these);
    return band;
  }

  [[nodiscard]] bool believed(const SizeBand& band, double expected, double taken) const {
    const double middle = 0.5 * (band.from_px + band.to_px) / model_.radius_px;
    const bool small = middle < smallest_spread, far_off = small || middle > largest_spread;
    if (far_off && expected < least_sure_far_off * taken) return false;
    if (small) return expected >= std::max(fewest_small, least_share_of_small * of_one_size_);
    return expected >= std::max(fewest_others, least_share_of_others * of_one_size_);
  }

  // The beads found at first are round: light and pixels shape the rims of all alike.
  [[nodiscard]] bool mostly_not_round(const std::vector<GapCircle>& taken, const std::vector<Circle>& disks) {
    if (!shared_) shared_ = shared_second(shapes_of_rims(maps_, model_, some_of(known_), known_));
    std::vector<Circle> circles;
    for (const GapCircle& one : taken) circles.push_back(one.circle);
    return departing_of(shapes_of_rims(maps_, model_, circles, disks), circles, *shared_).most();
  }

  static std::vector<Circle> some_of(const std::vector<Circle>& circles) {
    constexpr std::size_t enough = 120;
    std::vector<Circle> some;
    for (std::size_t k = 0; k < circles.size(); k += 1 + circles.size() / enough) some.push_back(circles[k]);
    return some;
  }

  // The median radius where the radii hardly differ.
  static double shared_radius(const std::vector<GapCircle>& taken) {
    constexpr double hardly = 0.03;  // standard deviation over the mean
    std::vector<double> radii, deviations;
    for (const GapCircle& one : taken) radii.push_back(one.circle.radius);
    const double middle = median_of(radii);
    for (const double radius : radii) deviations.push_back(std::abs(radius - middle));
    return 1.4826 * median_of(deviations) < hardly * middle ? middle : 0;
  }

  PictureMaps& maps_;
  const RimModel& model_;
  std::vector<Circle>& known_;
  double of_one_size_;
  std::optional<std::complex<double>> shared_;  // second harmonic of the beads found at first
  std::vector<Circle> not_round_;
  std::vector<Group> groups_;
  std::vector<SizeBand> tried_;  // sizes of their own; where one is not believed, its circles may be of a spread
};

double evidence_of(const Circle& circle) { return circle.radius * std::max(0.0, circle.support - worthless_support); }

// Larger circles of a size that is believed in, each far better seen than the beads found inside it, whose place it
// takes. Smaller ones displace none: fringes inside a photoelastic disk are often better seen than its rim.
GapCircles displacing_circles(PictureMaps& maps, const std::vector<Circle>& beads, const RimModel& model) {
  GapCircles out;
  const auto overlap = [](const Circle& one, const Circle& other) {
    return std::hypot(one.x - other.x, one.y - other.y) < nearest_rims * (one.radius + other.radius);
  };
  const Nearby near(beads.size(), 2 * largest_shared * model.radius_px,
                    [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
  for (const SizeBand& size : model.gaps->other_sizes) {
    SizeBand larger = size;
    larger.from_px = std::max(size.from_px, (1 + same_bead_radius) * model.radius_px);
    if (larger.from_px >= larger.to_px) continue;
    const PictureMap& map = maps.scaled_for(std::sqrt(larger.from_px * larger.to_px), model.threshold);
    for (const Circle& rival : without_doubles(GapSearch(map_of(map), larger, model, {}).all(), nearest_rims)) {
      const double its = probability_at(size.probability, rival.support);
      if (its < sure_rival) continue;
      std::vector<std::size_t> inside;
      double against = 0;
      near.any_near(rival.x, rival.y, [&](std::size_t i) {
        if (overlap(beads[i], rival)) inside.push_back(i), against += evidence_of(beads[i]);
        return false;
      });
      if (inside.empty() || against > small_share_of_evidence * evidence_of(rival)) continue;
      if (std::any_of(out.circles.begin(), out.circles.end(),
                      [&](const GapCircle& one) { return overlap(one.circle, rival); }))
        continue;
      out.circles.push_back({rival, its, &size});
      out.displaced.insert(out.displaced.end(), inside.begin(), inside.end());
    }
  }
  std::sort(out.displaced.begin(), out.displaced.end());
  out.displaced.erase(std::unique(out.displaced.begin(), out.displaced.end()), out.displaced.end());
  return out;
}

}  // namespace

GapCircles circles_in_gaps(PictureMaps& maps, const std::vector<Circle>& beads, const RimModel& model) {
  GapCircles out = displacing_circles(maps, beads, model);
  std::vector<Circle> known;
  for (const GapCircle& one : out.circles) known.push_back(one.circle);
  for (std::size_t i = 0; i < beads.size(); ++i)
    if (!std::binary_search(out.displaced.begin(), out.displaced.end(), i)) known.push_back(beads[i]);
  struct Searched {
    GapSearch search;
    const std::vector<double>& probability;
    const SizeBand* size;
  };
  std::vector<Searched> bands;
  std::vector<SizeBand> before;
  const auto search = [&](const SizeBand& band, const std::vector<double>& probability, const SizeBand* size) {
    const PictureMap& map = maps.scaled_for(std::sqrt(band.from_px * band.to_px), model.threshold);
    bands.push_back({GapSearch(map_of(map), band, model, known), probability, size});
    for (const SizeBand& other : before) bands.back().search.leave_out(other.from_px, other.to_px);
    before.push_back(band);
  };
  search(around(model.radius_px), model.gaps->same_size, nullptr);
  for (const SizeBand& size : model.gaps->other_sizes) search(size, size.probability, &size);
  // A doubtful circle of one size is not to take the place of a sure one of another.
  if (bands.size() > 1)
    for (Searched& band : bands) take_likely(band.search, band.probability, band.size, known, out.circles, sure_rival);
  for (Searched& band : bands)
    out.expected_missed += take_likely(band.search, band.probability, band.size, known, out.circles);
  return out;
}

GapModel chances_in_gaps(PictureMaps& maps, const std::vector<Circle>& beads, const RimModel& model, bool one_size) {
  GapModel gaps;
  std::vector<Circle> known = beads;
  WithCopies same(maps, around(model.radius_px), model, known);
  gaps.same_size = same.probabilities(known);
  std::vector<GapCircle> taken;
  take_likely(same.picture, gaps.same_size, nullptr, known, taken);
  if (!one_size) {
    OtherSizes others(maps, model, known);
    gaps.other_sizes = others.find();
    gaps.not_round = others.not_round();
  }
  return gaps;
}

}  // namespace shakebed::ingest
