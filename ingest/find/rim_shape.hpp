#pragma once
// Whether the rim to which a circle was fitted is round, or that of an oval or of a capsule's end.
//
// Along rays from the centre the steepest edge is met up to three tenths of a radius from the circle. The second
// harmonic of its distance is that of an ellipse. At the end of a capsule its straight sides give a tenth of the
// radius, whatever its length. The error follows from the scatter of the edges about such a shape. What lies in another
// disk or beside it is left out, so that a neighbour's rim does not count. So a rim departs from a circle when it does
// by several of its own errors: small and blurred beads have large ones.

#include <complex>
#include <string>
#include <vector>

#include "ingest/find/rim_finder.hpp"

namespace shakebed::ingest {

struct RimShape {
  std::complex<double> second;  // amplitude of the second harmonic, radii
  double std_error = 0;         // of either part, radii; 0: too little of the rim is seen
};

// Of circles that the model's search found; `disks`: all that are known, with or without these. Px of the frame.
std::vector<RimShape> shapes_of_rims(PictureMaps& maps, const RimModel& model, const std::vector<Circle>& circles,
                                     const std::vector<Circle>& disks);

// What the rims have in common (light from one side, pixels that are not square): the median. 0 of fewer than three.
std::complex<double> shared_second(const std::vector<RimShape>& shapes);

// Width over height of ovals whose outlines have this second harmonic.
double axes_of(std::complex<double> second);

// Whether the rim is plainly that of something else than what has the shared harmonic.
bool departs_from_round(const RimShape& shape, std::complex<double> shared);

// How many of the shapes that could be measured depart.
struct Departing {
  std::size_t measured = 0, departing = 0;
  double seemingly = 0;  // share of round ones that depart by chance
  [[nodiscard]] bool most() const { return 2 * departing > measured; }
  // More than errors make of round ones, at least twice as many, and a few.
  [[nodiscard]] bool more_than_seem() const;
  // The probability that one of those that depart is round nevertheless.
  [[nodiscard]] double round_nevertheless() const;
};
// `circles`: those of the shapes. Where little of the round ones' rims is seen, other things cover them.
Departing departing_of(const std::vector<RimShape>& shapes, const std::vector<Circle>& circles,
                       std::complex<double> shared);

// Of circles that were left out: a warning. `recorded_px`: as in FindOptions.
std::string left_out_as_not_round(const std::vector<Circle>& circles, double recorded_px);

}  // namespace shakebed::ingest
