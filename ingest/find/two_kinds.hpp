#pragma once
// Beads of two diameters, whose ratio is known, by their faces.
//
// Each kind is learned and found in the frame without the other: pixels of the other's beads are unseen. Where these
// are follows at first from ideal disks of both radii. The radii are those for which such disks look most like the
// frame. Then the kinds are searched for in turns. A disk stays when its own kind describes its surroundings better
// than the other does.

#include <optional>
#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"

namespace shakebed::ingest {

struct TwoKinds {
  FinderCalibration large, small;
};

// What is asked for beside FindOptions. Frames show beads of `polarity`.
struct KindsAsked {
  double ratio = 1;               // of the diameters, above 1
  double from_px = 0, to_px = 0;  // the large radius lies between
  Polarity polarity = Polarity::automatic;
};
struct LearnedKinds {
  std::optional<TwoKinds> kinds;
  std::string why_not;  // half a sentence, unless learned
};
LearnedKinds learn_two_kinds(const std::vector<const GrayFrame*>& frames, const KindsAsked& asked,
                             const FindOptions& options);

struct KindsFound {
  FindResult large, small;
  double undecided = 0;    // share of the disks that the other kind describes as well; they are not reported
  double unexplained = 0;  // share of what looks like a bead that lies in none of these disks
};
KindsFound find_two_kinds(const GrayFrame& frame, const TwoKinds& kinds, const FindOptions& options);

}  // namespace shakebed::ingest
