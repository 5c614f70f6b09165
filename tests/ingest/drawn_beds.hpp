#pragma once
// Drawn photographs of beds whose beads are known: touching beads, beads of two sizes, fringes, poor contrast, shading,
// beads cut by the border, walls. What is varied within a kind is drawn at random.

#include <array>
#include <random>
#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest::test {

struct DrawnBead {
  double x = 0, y = 0, radius = 0;  // px
  bool whole = false;               // all of it is in the frame
};

struct DrawnBed {
  GrayFrame frame;
  std::vector<DrawnBead> beads;
};

struct BedKind {
  std::string name;
  DrawnBed (*draw)(std::mt19937& random);
};
const std::vector<BedKind>& drawn_beds();

// Two sizes: the smaller radius is the larger over `ratio`, and this share of the beads has it.
DrawnBed bed_of_two_sizes(std::mt19937& random, double ratio, double share_of_small, double large_radius_px);

// The same beads, of which few touch.
DrawnBed strewn_of_two_sizes(std::mt19937& random, double ratio, double share_of_small, double large_radius_px);

// Beads of two shades, or a part of them out of focus or clear, or uneven light.
struct Shaded {
  enum class Layout { pile, loose, strewn };
  Layout layout = Layout::pile;
  std::size_t count = 63;
  double radius_px = 14;
  double background = 30, common = 210, other = 210;  // grey levels: behind the beads, of most beads, of the others
  double share_of_others = 0.4;
  double size_of_others = 1;     // of the radius
  double second_size = 1;        // of the radius, of every second bead of either shade
  double defocus_of_others = 0;  // radii: standard deviation of their blur
  double light_ratio = 1;        // from the left side of the frame to the right
  double blur_px = 0.8, noise = 2;
};
DrawnBed bed_of_shades(std::mt19937& random, const Shaded& shaded);

// The same in colour: red, green and blue.
struct ColouredBed {
  std::array<GrayFrame, 3> channels;
  std::vector<DrawnBead> beads;
};
struct ColouredKind {
  std::string name;
  ColouredBed (*draw)(std::mt19937& random);
};
const std::vector<ColouredKind>& coloured_beds();

// Found disks beside the truth. A disk is right when its centre lies within a quarter of the radius of a bead's. Beads
// that the border cuts count neither as missed nor, when they are found, as wrong.
struct BedScore {
  double beads = 0, found = 0, hits = 0;
  double worst_radius = 0;  // largest relative error of a radius among the hits
  [[nodiscard]] double missed() const { return beads - hits; }
  [[nodiscard]] double wrong() const { return found - hits; }
  [[nodiscard]] double f1() const { return beads + found > 0 ? 2 * hits / (beads + found) : 1; }
};
BedScore score_of(const std::vector<FoundDisk>& disks, const std::vector<DrawnBead>& beads);

}  // namespace shakebed::ingest::test
