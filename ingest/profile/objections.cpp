// implements: ingest/profile/measure_bed.hpp
#include <cmath>
#include <utility>

#include "ingest/profile/measure_bed.hpp"
#include "statistics/text.hpp"

namespace shakebed::ingest {
namespace {

// Disks in all frames together: fewer do not even show their own scatter.
constexpr std::size_t least_disks = 30;
// Share of disks that are wrong or missed from which on the density is off by as much.
constexpr double most_doubtful = 0.1;
// Heights are measured across the floor; farther tilted, gravity is another direction than theirs [degrees].
constexpr double most_tilted = 10;
// An error of the floor that only lowest beads in motion cause, half of their way [D].
constexpr double unquiet_floor = 0.25;
// Difference of the densities by centres and by covered area, rms [1/D^2]: a fifth of the bed is not what is found.
constexpr double most_area_off = 0.2;

}  // namespace

std::vector<Objection> objections_to(const Measurement& found) {
  std::vector<Objection> out;
  const auto object = [&out](std::string why, std::string advice) {
    out.push_back({std::move(why), std::move(advice)});
  };
  const double wrong = found.expected_wrong, missed = found.finder.expected_missed,
               tilt = std::abs(found.calibration.floor_tilt_degrees);
  if (found.floor_out_of_view && found.surface_out_of_view)
    object(
        "Beads extend beyond the lower and the upper border of the frame: neither the floor nor the surface of the bed "
        "is visible, as in a photograph from above.",
        "Photograph the bed from the side, with its floor and its surface.");
  else if (found.floor_out_of_view)
    object("The lower border of the frame cuts beads: the floor is not visible, so heights have no origin.",
           "Show the floor in the picture, or give its row (\"floor\", --floor).");
  if (const auto& above = found.above_mirror_image)
    object(formatted("The lowest disks found mirror those above row %d: they are the image of the bed in a polished "
                     "floor, but were counted as beads.",
                     above->top + above->height),
           formatted("To leave this image out, give --roi %d,%d,%d,%d.", above->left, above->top, above->width,
                     above->height));
  if (found.calibration.outline_in_doubt)
    object(
        "The beads are lit from one side, and hardly any rim is seen on the other: the outline seen may be smaller "
        "than the bead, and every length wrong.",
        "Give the scale (--scale), light the beads from the front, or take more photographs of touching beads.");
  if (found.disk_total < least_disks)
    object(formatted("Only %zu beads were found in all frames together.", found.disk_total),
           "Take more photographs of the bed from the side, or measure longer.");
  if (found.finder.rims && wrong + missed > most_doubtful)
    object(formatted("About %.0f %% of the disks found may be wrong, and %.0f %% of the beads may be missed.",
                     100 * wrong, 100 * missed),
           "Look at the circles in the film, and give --radius, --polarity, --channel or --roi.");
  if (found.coverage_profile && found.coverage_disagreement > most_area_off)
    object(formatted("The density of the disks found differs from that of the covered area by %.2f per D^2: beads are "
                     "missed, or the diameter is wrong.",
                     found.coverage_disagreement),
           "Look at the circles in the film. Check the diameter, give --radius, or take photographs with less noise.");
  if (tilt > most_tilted)
    object(formatted("The floor found is tilted by %.0f degrees.", tilt),
           "Level the camera, or give the floor (\"floor\", --floor) if the program found a wrong line.");
  return out;
}

bool is_shaken(const Measurement& found) {
  const BedCalibration& bed = found.calibration;
  const double diameter_px = 2 * bed.radius_px;
  return bed.floor_amplitude_px > 0 || bed.floor_reference == FloorReference::mean_by_amplitude ||
         bed.floor_std_error_px > unquiet_floor * diameter_px;
}

}  // namespace shakebed::ingest
