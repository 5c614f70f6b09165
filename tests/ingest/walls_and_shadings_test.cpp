// Walls of a bed from many frames, whose disks are put down by hand; rims of beads with each shading.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "ingest/find/bead_profile.hpp"
#include "ingest/find/blurred_disk.hpp"
#include "ingest/profile/bed_geometry.hpp"
#include "ingest/profile/film_calibration.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

// In frame k of 14 the bed lies k/4 px farther to the right. The walls are where one of the frames reaches beyond: the
// second rank of 14 is the nearest to a tenth.
TEST(WallsOfFrames, AreReachedByATenthOfThem) {
  FilmCalibration film;
  film.finder.width = film.recorded_width = 300, film.finder.height = film.recorded_height = 200;
  film.finder.radius_px = film.finder.rim_radius_px = 10;
  film.finder.radius_std_error_px = 0.05;
  film.options.bead_diameter_m = 2e-3;
  std::vector<FrameFindings> frames(14);
  for (std::size_t k = 0; k < frames.size(); ++k)
    for (int row = 0; row < 3; ++row)
      for (int i = 0; i < 8; ++i)
        frames[k].disks.push_back(test::found_at(30 + 31.0 * i + 0.25 * static_cast<double>(k), 140 - 40.0 * row, 9));
  FinderCalibration refined = film.finder;
  BedCalibration bed;
  find_geometry(film, frames, refined, bed);
  EXPECT_NEAR(bed.left_wall_px, 20 + 0.25 * 1, 1e-9);
  EXPECT_NEAR(bed.right_wall_px, 257 + 0.25 * 12, 1e-9);
  EXPECT_FALSE(bed.walls_are_frame_sides);
}

// Beads that are lit as each of the shapes says, half of their contrast by it: known almost without noise, so that one
// shape alone explains the profile.
TEST(RimsOfShadings, AreAtTheRadiusForEachShape) {
  const std::vector<std::pair<std::string, RadialContrast>> shapes{
      {"flat", [](double) { return 1.0; }},
      {"sphere", [](double rho) { return std::sqrt(1 - rho * rho); }},
      {"parabola", [](double rho) { return 1 - rho * rho; }},
      {"cone", [](double rho) { return 1 - rho; }},
      {"quartic", [](double rho) { return (1 - rho * rho) * (1 - rho * rho); }}};
  for (const auto& [name, shape] : shapes) {
    BeadProfile profile;
    profile.step_px = 0.05;
    const RadialContrast lit = [&](double rho) { return 0.5 + 0.5 * shape(std::min(rho, 1.0)); };
    for (int k = 0; k <= 300; ++k)
      profile.level.push_back(static_cast<float>(blurred_disk_contrast(10, 1.1, lit, 0.05 * k)));
    const RimChoice choice = choose_rim(profile, {.radius_px = 10.1,
                                                  .edge_px = 1.2,
                                                  .knot_px = 0.4,
                                                  .noise = 1e-3,
                                                  .beads = 1e6,
                                                  .background_level = 200,
                                                  .bead_level = 60,
                                                  .linear_only = true});
    EXPECT_TRUE(choice.rim.good) << name;
    EXPECT_NEAR(choice.rim.radius_px, 10, 2e-3) << name;
    EXPECT_NEAR(choice.rim.edge_px, 1.1, 5e-3) << name;
    EXPECT_LT(choice.rim.misfit, 1e-4) << name;
  }
}

}  // namespace
}  // namespace shakebed::ingest
