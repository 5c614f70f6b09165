#pragma once
// What the finder learns from the frames before it looks for disks: polarity, radius, edge and the bead's own profile.

#include <memory>
#include <string>
#include <vector>

#include "ingest/calibrate/bead_asymmetry.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

enum class Polarity { automatic, dark_beads, bright_beads };

// The bead as seen by the camera, shared by all beads of a film. Its contrast p(r) is in units of the bead's own
// contrast (1 inside a flat bead, 0 far outside). Square pixels cause a fourth harmonic p4(r) cos(4 theta) at sharp
// edges. Both are sampled at r = 0, step_px, 2 step_px, ...
struct BeadProfile {
  double step_px = 0;
  std::vector<float> level;                        // p(r)
  std::vector<float> fourth_harmonic;              // p4(r)
  std::shared_ptr<const BeadAsymmetry> asymmetry;  // none for beads that look the same from all sides
  [[nodiscard]] double reach_px() const {
    return level.empty() ? 0.0 : step_px * static_cast<double>(level.size() - 1);
  }
};

// The radius and edge found from a frame alone, with no prior guess.
struct RadiusEstimate {
  bool found = false;
  double radius_px = 0;
  Polarity polarity = Polarity::automatic;  // dark_beads or bright_beads when found
  double score = 0;                         // how much of a typical disk's rim votes for its centre, 0 .. 1
  // A packed bed's rims are explained as well by the small voids between its beads. When there are such voids and the
  // beads around them would have another radius than the one above: that radius and polarity, else 0.
  double packed_radius_px = 0;
  Polarity packed_polarity = Polarity::automatic;
  bool packed_likely = false;  // the voids are evenly spaced
  // What else circles were seen of, likeliest first, should the above explain little; also when nothing was found.
  struct Other {
    double radius_px = 0;
    Polarity polarity = Polarity::automatic;
  };
  std::vector<Other> others;
  std::string why_not;  // when not found: a sentence
};

inline constexpr double smallest_voted_px = 1.2;  // radius

// Radius and polarity by gradient voting over all radii from `smallest_radius_px` to `largest_radius_px` (0: a third of
// the frame). Accuracy about 3 %; find_disks refines it. Never throws for a well-formed frame.
RadiusEstimate estimate_radius(const GrayFrame& frame, Polarity polarity = Polarity::automatic,
                               double smallest_radius_px = smallest_voted_px, double largest_radius_px = 0);

}  // namespace shakebed::ingest
