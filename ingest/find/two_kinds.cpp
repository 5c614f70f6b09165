#include "ingest/find/two_kinds.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/disk_pixels.hpp"
#include "ingest/find/joint_fit.hpp"
#include "ingest/find/laid_disks.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/find/nearby.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {

namespace {

// From one radius tried to the next: learning finds a radius that is off by 10 %.
constexpr double radius_step = 1.025, same_kind = 0.1;
// Beyond the rim of a bead of the other kind its blurred edge is unseen, too [edge widths; px while only laid]. With
// 1 px at an edge of 1.3 px, small beads between large ones came out 0.6 % too large; so 0.1 %.
constexpr double margin_edges = 2, laid_margin_px = 1.5;
constexpr int looks_at_kinds = 2;            // of learning, and of finding where disks were undecided
constexpr double same_ratio = 0.04;          // of the radii found and of the diameters
constexpr std::size_t fewest_of_a_kind = 5;  // beads of either kind in the last frame
// A disk is decided when the other kind leaves more than its own by this share of the squares in which they differ.
constexpr double clearly_decided = 0.25;
constexpr double like_a_bead = 0.5;  // contrast units
// Drawn beds of ratios 1.25 to 2 in which all beads were found: 0 of both; with 5 % missed, up to 0.01 and 0.03.
constexpr double most_left_unexplained = 0.1, most_undecided = 0.05;

KnownPlaces places_of(const FindResult& found) {
  KnownPlaces places;
  for (const FoundDisk& disk : found.disks) places.push_back({disk.x_px, disk.y_px, disk.radius_px});
  return places;
}

double margin_of(const FinderCalibration& large, const FinderCalibration& small) {
  return margin_edges * std::max(large.edge_width_px, small.edge_width_px);
}

// The beads of one kind in a frame without the other, from where they are thought to be. A search would take what is
// left of several beads between unseen ones for one bead.
FindResult find_from(const KnownPlaces& start, const GrayFrame& rest, const FinderCalibration& finder,
                     const FindOptions& options) {
  std::vector<DiskCandidate> places;
  for (const KnownPlace& place : start) places.push_back({place.x, place.y, 1});
  return find_disks_from(places, rest, finder, options);
}

// The kinds are learned in turns.
class KindsLearner {
 public:
  KindsLearner(const std::vector<const GrayFrame*>& frames, const KindsAsked& asked, const FindOptions& options)
      : asked_(asked), find_(options) {
    find_.polarity = asked.polarity;
    find_.seen.reset();
    find_.hold_radius = find_.learn_rim = false;
    for (const GrayFrame* frame : frames) frames_.push_back(without_walls(*frame, asked.polarity, asked.from_px));
  }

  LearnedKinds learn() {
    lay();
    CalibrationResult large, small;
    for (int round = 0; round < looks_at_kinds; ++round) {
      large = learned(large_px_, smalls_);
      if (!large.found) return refused("large", large);
      larges_ = found_from(larges_, large.calibration, smalls_);
      small = learned(large.calibration.rim_radius_px / asked_.ratio, larges_);
      if (!small.found) return refused("small", small);
      smalls_ = found_from(smalls_, small.calibration, larges_);
      margin_px_ = margin_of(large.calibration, small.calibration);
      large_px_ = large.calibration.rim_radius_px;
    }
    tell_radius(large);
    tell_radius(small);
    share_camera(large.calibration, small.calibration);
    const double ratio = large.calibration.radius_px / small.calibration.radius_px;
    if (std::abs(ratio / asked_.ratio - 1) > same_ratio)
      return {{}, formatted("the ratio of the radii found is %.3g, not that of the two diameters given", ratio)};
    return {TwoKinds{std::move(large.calibration), std::move(small.calibration)}, {}};
  }

 private:
  // Where the beads are, and their radius.
  void lay() {
    std::vector<GrayFrame> flats;
    for (const GrayFrame& frame : frames_)
      flats.push_back(flatten(frame, estimate_light(frame, asked_.from_px, asked_.polarity)));
    double least = HUGE_VAL;
    for (double radius = asked_.from_px; radius < asked_.to_px * radius_step; radius *= radius_step) {
      const double left = squares_left(flats.back(), lay_disks(flats.back(), radius, radius / asked_.ratio));
      if (left >= least) continue;
      least = left;
      large_px_ = radius;
    }
    for (const GrayFrame& flat : flats) {
      LaidDisks laid = lay_disks(flat, large_px_, large_px_ / asked_.ratio);
      larges_.push_back(std::move(laid.large));
      smalls_.push_back(std::move(laid.small));
    }
  }

  [[nodiscard]] std::vector<GrayFrame> frames_without(const std::vector<KnownPlaces>& others) const {
    std::vector<GrayFrame> rest;
    for (std::size_t k = 0; k < frames_.size(); ++k) rest.push_back(without_beads(frames_[k], others[k], margin_px_));
    return rest;
  }

  CalibrationResult learned(double radius_px, const std::vector<KnownPlaces>& others) {
    const std::vector<GrayFrame> rest = frames_without(others);
    std::vector<const GrayFrame*> pointers;
    for (const GrayFrame& frame : rest) pointers.push_back(&frame);
    find_.radius_px = radius_px;
    CalibrationResult result = learn_finder(pointers, find_);
    if (result.found && std::abs(result.calibration.rim_radius_px / radius_px - 1) > same_kind) {
      result.found = false;
      result.why_not = formatted("the beads found have a radius of %.3g px, not %.3g px",
                                 result.calibration.rim_radius_px * find_.recorded_px, radius_px * find_.recorded_px);
    }
    return result;
  }

  [[nodiscard]] std::vector<KnownPlaces> found_from(const std::vector<KnownPlaces>& start,
                                                    const FinderCalibration& finder,
                                                    const std::vector<KnownPlaces>& others) const {
    const std::vector<GrayFrame> rest = frames_without(others);
    std::vector<KnownPlaces> places;
    for (std::size_t k = 0; k < rest.size(); ++k)
      places.push_back(places_of(find_from(start[k], rest[k], finder, find_)));
    return places;
  }

  static LearnedKinds refused(const char* which, const CalibrationResult& result) {
    return {{}, formatted("of the %s beads: %s", which, result.why_not.c_str())};
  }

  const KindsAsked asked_;
  FindOptions find_;
  std::vector<GrayFrame> frames_;
  double large_px_ = 0, margin_px_ = laid_margin_px;
  std::vector<KnownPlaces> larges_, smalls_;  // of each frame
};

// Both kinds in one frame.
class KindsFinder {
 public:
  KindsFinder(const GrayFrame& frame, const TwoKinds& kinds, const FindOptions& options)
      : kinds_(kinds),
        options_(options),
        open_(without_walls(frame, kinds.large.polarity, kinds.large.rim_radius_px)),
        large_(kinds.large.profile, kinds.large.rim_radius_px, kinds.large.edge_width_px, 0),
        small_(kinds.small.profile, kinds.small.rim_radius_px, kinds.small.edge_width_px, 0),
        margin_px_(margin_of(kinds.large, kinds.small)) {}

  KindsFound find() {
    const GrayFrame flat = flatten(open_, kinds_.large.light);
    const LaidDisks laid = lay_disks(flat, kinds_.large.rim_radius_px, kinds_.small.rim_radius_px);
    KnownPlaces smalls = laid.small;
    double margin = laid_margin_px;
    std::size_t undecided = 0;
    for (int round = 0; round < looks_at_kinds; ++round) {
      found_.large = find_from(laid.large, without_beads(open_, smalls, margin), kinds_.large, options_);
      margin = margin_px_;
      found_.small =
          find_from(laid.small, without_beads(open_, places_of(found_.large), margin), kinds_.small, options_);
      undecided = drop_undecided();
      if (undecided == 0) break;
      smalls = places_of(found_.small);
    }
    const double all = static_cast<double>(found_.large.disks.size() + found_.small.disks.size() + undecided);
    found_.undecided = static_cast<double>(undecided) / std::max(1.0, all);
    found_.large.rejected += undecided;
    found_.unexplained = unexplained();
    return std::move(found_);
  }

 private:
  // Takes out disks whose surroundings the other kind describes nearly as well.
  std::size_t drop_undecided() {
    std::vector<KnownPlace> all = places_of(found_.large);
    const std::size_t larges = all.size();
    for (const KnownPlace& place : places_of(found_.small)) all.push_back(place);
    const GrayFrame flats[] = {flatten(open_, kinds_.large.light, found_.large.light),
                               flatten(open_, kinds_.small.light, found_.small.light)};
    const double reach = kinds_.large.rim_radius_px + 1;
    const Nearby near(all.size(), reach + kinds_.large.rim_radius_px + margin_px_,
                      [&](std::size_t i) { return std::pair(all[i].x, all[i].y); });
    std::vector<char> drop(all.size(), 0);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const GrayFrame& flat = flats[i < larges ? 0 : 1];
      KnownPlaces others;
      near.any_near(all[i].x, all[i].y, [&](std::size_t k) {
        if (k != i) others.push_back(all[k]);
        return false;
      });
      double as_large = 0, as_small = 0, apart = 0;
      for_pixels_within(flat, all[i].x, all[i].y, reach, [&](std::size_t pixel, double dx, double dy) {
        if (unseen(flat.pixels[pixel])) return;
        for (const KnownPlace& other : others) {
          const double x = all[i].x + dx - other.x, y = all[i].y + dy - other.y, far = other.radius + margin_px_;
          if (x * x + y * y < far * far) return;
        }
        const double level = static_cast<double>(flat.pixels[pixel]), squared = dx * dx + dy * dy;
        as_large += std::pow(level - large_.at(squared), 2);
        as_small += std::pow(level - small_.at(squared), 2);
        apart += std::pow(large_.at(squared) - small_.at(squared), 2);
      });
      drop[i] = (i < larges ? as_small - as_large : as_large - as_small) <= clearly_decided * apart;
    }
    std::size_t at = 0, dropped = 0;
    for (std::vector<FoundDisk>* disks : {&found_.large.disks, &found_.small.disks})
      dropped += std::erase_if(*disks, [&](const FoundDisk&) { return drop[at++] != 0; });
    return dropped;
  }

  [[nodiscard]] double unexplained() const {
    GrayFrame flat = flatten(open_, kinds_.large.light, found_.large.light);
    const auto like_beads = [&] {
      return static_cast<double>(std::count_if(flat.pixels.begin(), flat.pixels.end(), [](float level) {
        return !unseen(level) && level > static_cast<float>(like_a_bead);
      }));
    };
    const double all = like_beads();
    for (const FindResult* found : {&found_.large, &found_.small})
      flat = without_beads(std::move(flat), places_of(*found), margin_px_);
    return like_beads() / std::max(1.0, all);
  }

  const TwoKinds& kinds_;
  const FindOptions& options_;
  const GrayFrame open_;
  const ProfileTable large_, small_;
  const double margin_px_;
  KindsFound found_;
};

}  // namespace

LearnedKinds learn_two_kinds(const std::vector<const GrayFrame*>& frames, const KindsAsked& asked,
                             const FindOptions& options) {
  LearnedKinds learned = KindsLearner(frames, asked, options).learn();
  if (!learned.kinds) return learned;
  const KindsFound found = find_two_kinds(*frames.back(), *learned.kinds, options);
  const std::size_t fewer = std::min(found.large.disks.size(), found.small.disks.size());
  if (fewer < fewest_of_a_kind)
    learned.why_not = formatted("only %zu beads of one kind were found", fewer);
  else if (found.undecided > most_undecided)
    learned.why_not = formatted("for %.0f %% of the beads the kind cannot be determined", 100 * found.undecided);
  else if (found.unexplained > most_left_unexplained)
    learned.why_not =
        formatted("beads of both kinds explain only %.0f %% of what looks like beads", 100 * (1 - found.unexplained));
  if (!learned.why_not.empty()) learned.kinds.reset();
  return learned;
}

KindsFound find_two_kinds(const GrayFrame& frame, const TwoKinds& kinds, const FindOptions& options) {
  return KindsFinder(frame, kinds, options).find();
}

}  // namespace shakebed::ingest
