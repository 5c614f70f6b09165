#include "pipelines/stages/extract_objections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <utility>

namespace shakebed::pipelines {
namespace {

// Disks in all frames together: fewer do not even show their own scatter.
constexpr std::size_t least_disks = 30;
// Share of disks that are wrong or missed from which on the density is off by as much.
constexpr double most_doubtful = 0.1;
// Heights are measured across the floor; farther tilted, gravity is another direction than theirs [degrees].
constexpr double most_tilted = 10;

}  // namespace

Json objections_json(const ingest::Measurement& found, bool not_round) {
  Json out = Json::array();
  const auto object = [&out](std::string why, std::string advice) {
    out.push_back(Json{{"why", std::move(why)}, {"advice", std::move(advice)}});
  };
  const double wrong = found.expected_wrong, missed = found.finder.expected_missed,
               tilt = std::abs(found.calibration.floor_tilt_degrees);
  if (found.floor_out_of_view && found.surface_out_of_view)
    object(
        "Beads extend beyond the lower and the upper border: neither floor nor surface is in view, as in a photograph "
        "from above.",
        "Photograph the bed from the side, with its floor and its surface.");
  else if (found.floor_out_of_view)
    object("The lower border cuts beads: the floor is not in view, so heights have no origin.",
           "Show the floor in the picture, or give its row (\"floor\", --floor).");
  if (found.disk_total < least_disks)
    object(fmt::format("Only {} beads were found in all frames together.", found.disk_total), "Take more photographs.");
  if (found.finder.rims && wrong + missed > most_doubtful)
    object(fmt::format("About {:.0f} % of the disks found may be wrong, and {:.0f} % of the beads may be missed.",
                       100 * wrong, 100 * missed),
           "Look at the circles in the film, and give --radius, --polarity, --channel or --roi.");
  if (not_round)
    object("The outlines are not those of disks, and the theory is one of disks.",
           "Use positions and numbers of beads only.");
  if (tilt > most_tilted)
    object(fmt::format("The floor found is tilted by {:.0f} degrees.", tilt),
           "Level the camera, or give the floor (\"floor\", --floor) if another line was taken for it.");
  return out;
}

}  // namespace shakebed::pipelines
