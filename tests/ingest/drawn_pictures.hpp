#pragma once
// Drawings of things that are no beads, and of beads, each kind with its sizes, places, directions, levels and noise
// varied at random.

#include <array>
#include <random>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest::test {

struct DrawnKind {
  std::string name;
  GrayFrame (*draw)(std::mt19937& random);
};

const std::vector<DrawnKind>& pictures_without_beads();

// Beads of many looks, to see that they are still found.
struct DrawnBeads {
  GrayFrame frame;
  double radius_px = 0;
  std::vector<std::array<double, 2>> centres_px;
};
struct BeadLook {
  std::string name;
  DrawnBeads (*draw)(std::mt19937& random);
};
const std::vector<BeadLook>& pictures_with_beads();

}  // namespace shakebed::ingest::test
