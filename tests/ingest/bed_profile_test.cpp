// Density, lens, velocities and tables of beds whose disks are put down by hand.
#include "ingest/profile/measure_bed.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "ingest/profile/coverage.hpp"
#include "ingest/profile/density.hpp"
#include "ingest/profile/frame_findings.hpp"
#include "ingest/profile/frame_rows.hpp"
#include "ingest/profile/lens.hpp"
#include "ingest/profile/mirror_image.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/profile/velocities.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "tests/ingest/by_hand.hpp"

namespace shakebed::ingest {
namespace {

using test::any_holds;
using test::found_at;
using test::holds;

// --- mirror_image.hpp ------------------------------------------------------------------------------------------------

// Seven beads above a row and their images, by each condition.
TEST(BedProfile, MirrorRowIsHalfWayBetweenBeadsAndTheirImages) {
  const auto row_of = [](double contrast, double off, std::size_t images, double lone_below = 0) {
    FrameFindings frame;
    for (std::size_t k = 0; k < 9; ++k) {
      const double x = 30 + 40.0 * static_cast<double>(k), height = 12 + 3.3 * static_cast<double>(k * k % 7);
      frame.disks.push_back(found_at(x, 200 - height));
      frame.disks.back().contrast = 1;
      if (k >= images) continue;
      frame.disks.push_back(found_at(x + off, 200 + height));
      frame.disks.back().contrast = contrast;
    }
    for (int k = 0; k < static_cast<int>(lone_below); ++k) frame.disks.push_back(found_at(50 + 40 * k, 255));
    return find_mirror_row({frame, frame, frame}, 20);
  };
  ASSERT_TRUE(row_of(0.8, 0, 9));
  EXPECT_NEAR(*row_of(0.8, 0, 9), 200, 1e-9);
  EXPECT_TRUE(row_of(0.92, 0, 9));
  EXPECT_FALSE(row_of(0.94, 0, 9)) << "as bright as the beads";
  EXPECT_TRUE(row_of(0.8, 2.8, 9));
  EXPECT_FALSE(row_of(0.8, 3.2, 9)) << "beside their places";
  EXPECT_TRUE(row_of(0.8, 0, 5));
  EXPECT_FALSE(row_of(0.8, 0, 4)) << "too few";
  EXPECT_TRUE(row_of(0.8, 0, 9, 2));
  EXPECT_FALSE(row_of(0.8, 0, 9, 3)) << "three of twelve are none";
  // A centre on the row is no bead above a floor; most frames must show it.
  FrameFindings frame;
  for (int k = 0; k < 9; ++k)
    for (const double side : {-1.0, 1.0}) {
      frame.disks.push_back(found_at(30 + 40 * k, 200 + 14 * side));
      frame.disks.back().contrast = side > 0 ? 0.8 : 1;
    }
  EXPECT_TRUE(find_mirror_row({frame}, 20));
  EXPECT_TRUE(find_mirror_row({frame, frame, frame, {}, {}}, 20));
  EXPECT_FALSE(find_mirror_row({frame, frame, {}, {}}, 20));
  FrameFindings crossed = frame;
  crossed.disks.push_back(found_at(400, 206));
  EXPECT_FALSE(find_mirror_row({crossed}, 20));
  crossed.disks.back().y_px = 207.5;
  EXPECT_TRUE(find_mirror_row({crossed}, 20));
  crossed.disks.back().y_px = 206, crossed.disks.back().cut = true;
  EXPECT_TRUE(find_mirror_row({crossed}, 20));
}

// --- density.hpp, coverage.hpp ---------------------------------------------------------------------------------------

TEST(BedProfile, ADensityIsBeadsAWidthAndABin) {
  const HeightBins bins{0.5, 0.5, 4};
  EXPECT_EQ(bins.middle(0), 0.75);
  EXPECT_EQ(bins.middle(3), 2.25);
  const std::vector<double> heights = {0.6, 0.9, 1.6, HUGE_VAL};
  const auto density = density_of_frame(heights, 5, bins, {KernelKind::top_hat, 0.5});
  EXPECT_NEAR(density[0], 2 / (5 * 0.5), 1e-12);
  EXPECT_EQ(density[1], 0);
  EXPECT_NEAR(density[2], 1 / (5 * 0.5), 1e-12);
  EXPECT_EQ(density[3], 0);
  EXPECT_THROW(density_of_frame(heights, 0, bins, {KernelKind::top_hat, 0.5}), std::invalid_argument);
  EXPECT_THROW(density_of_frame(heights, 5, {0, 0, 2}, {KernelKind::top_hat, 0.5}), std::invalid_argument);
  EXPECT_THROW(density_of_frame(heights, 5, bins, {KernelKind::top_hat, 0}), std::invalid_argument);
  EXPECT_THROW(average_profile({{1, 2}, {1}}, {0, 1, 2}, {}), std::invalid_argument);
  EXPECT_EQ(average_profile({}, {0, 1, 2}, {}).samples, 0U);
  // One frame: the variance is the density times the kernel's own, 1/width for a top hat; of an empty bin nothing.
  const DensityProfile one = average_profile({{0.8, 0}}, {0, 1, 2}, {KernelKind::top_hat, 0.5});
  EXPECT_NEAR(one.std_error[0], std::sqrt(std::max(0.8 * 2, 0.64)), 1e-9);
  EXPECT_EQ(one.std_error[1], 0);
  EXPECT_EQ(one.samples, 1U);
  // A bin in which one of four frames had a bead, of 0.4: it is uncertain by 0.1 at least.
  const DensityProfile rare =
      average_profile({{1, 0}, {1.1, 0.4}, {0.9, 0}, {1, 0}}, {0, 1, 2}, {KernelKind::top_hat, 0.5});
  EXPECT_GE(rare.std_error[1], 0.1);
  EXPECT_NEAR(rare.number_density[1], 0.1, 1e-12);
  EXPECT_NEAR(rare.area_fraction[0], std::numbers::pi / 4, 1e-12);
}

TEST(BedProfile, RowsOfFramesComeBack) {
  FrameRows rows;
  rows.add({1, 2, 3}, 5);
  rows.add({4, 5, 6}, 5);
  EXPECT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows.row(1, 2), (std::vector<double>{4, 5}));
  EXPECT_EQ(rows.row(0, 9), (std::vector<double>{1, 2, 3}));
  EXPECT_EQ(rows.rows(2), (std::vector<std::vector<double>>{{1, 2}, {4, 5}}));
}

// A flat bead of 10 px in a bed of width 5 D: its rows, as a chord, give the density of its area; its centre, seen
// through the same chord, the same.
TEST(BedProfile, CoveredAreaIsTheDensityOfWholeBeads) {
  FinderCalibration finder;
  finder.width = 100, finder.height = 80, finder.radius_px = 10;
  finder.profile = test::blurred_profile(10, 0.4, 12, 0.05);
  BedCalibration bed;
  bed.floor_px = 70, bed.width = 5, bed.scale_relative_std_error = 0;
  const HeightBins bins{0, 0.25, 12};
  Coverage coverage(finder, bed, 20, 100, 10);
  const double height = 1.3;  // D above the floor: at y = 44
  std::vector<float> rows(80, 0.0F);
  for (int row = 0; row < 80; ++row) {
    double chord = 0;
    for (int part = 0; part < 50; ++part) {
      const double dy = row - 0.5 + (part + 0.5) / 50 - 44;
      chord += 2 * std::sqrt(std::max(0.0, 100 - dy * dy)) / 50;
    }
    rows[static_cast<std::size_t>(row)] = static_cast<float>(chord);
  }
  coverage.add({rows, {height}}, bins, 1);
  const DensityProfile profile = coverage.profile(bins);
  EXPECT_EQ(profile.kernel.kind, KernelKind::disk_chord);
  double sum = 0;
  for (std::size_t bin = 0; bin < bins.count; ++bin) {
    // The part of the disk's area in the bin.
    const auto below = [&](double z) {
      const double u = std::clamp(2 * (z - height), -1.0, 1.0);
      return 0.5 + (u * std::sqrt(1 - u * u) + std::asin(u)) / std::numbers::pi;
    };
    const double low = static_cast<double>(bin) * 0.25, share = below(low + 0.25) - below(low);
    EXPECT_NEAR(profile.number_density[bin], share / (0.25 * 5), 3e-3) << bin;
    sum += profile.number_density[bin] * 0.25 * 5;
  }
  EXPECT_NEAR(sum, 1, 1e-3);
  EXPECT_LT(coverage.disagreement(profile), 0.012);
  // Half as much covered as there are beads: bins of n D^2 above 0.1 differ by half of it.
  DensityProfile half = profile;
  double square = 0, count = 0;
  for (double& density : half.number_density) {
    if (density >= 0.1) square += 0.25 * density * density, ++count;
    density *= 0.5;
  }
  EXPECT_NEAR(coverage.disagreement(half), std::sqrt(square / count), 0.012);
  // A larger radius, as is known later, takes the same contrast for more area.
  Coverage larger(finder, bed, 20, 100, 11);
  larger.add({rows, {height}}, bins, 1);
  EXPECT_NEAR(larger.profile(bins).number_density[5] / profile.number_density[5], 1.21, 1e-6);
  // Over a floor that falls to the right heights are those at the middle of the frame.
  BedCalibration sloped = bed;
  sloped.floor_px = 68, sloped.floor_slope = 0.04;
  Coverage tilted(finder, sloped, 20, 100, 10);
  tilted.add({rows, {height}}, bins, 1);
  for (std::size_t bin = 0; bin < bins.count; ++bin)
    EXPECT_NEAR(tilted.profile(bins).number_density[bin], profile.number_density[bin], 1e-6);
}

// --- lens.hpp --------------------------------------------------------------------------------------------------------

TEST(BedProfile, ALensMovesThePlacesByItsFormula) {
  for (const auto& [aspect, radial] : {std::pair{1.0, 0.1}, {1.25, 0.0}, {0.8, -0.06}, {1.1, 0.08}}) {
    const LensMap map({aspect, radial}, 120, 80);
    const double wide = 120 * aspect, half = 0.5 * std::hypot(wide, 80);
    const double margin_x = radial > 0 ? std::ceil(0.5 * wide * radial) : 0,
                 margin_y = radial > 0 ? std::ceil(40 * radial) : 0;
    EXPECT_EQ(map.width(), std::lround(wide + 2 * margin_x));
    EXPECT_EQ(map.height(), 80 + 2 * margin_y);
    for (const auto& [x, y] : {std::array{0.0, 0.0}, {119.0, 79.0}, {30.5, 60.25}, {59.5, 39.5}}) {
      const double u = (x + 0.5) * aspect - 0.5 * wide, v = y + 0.5 - 40;
      const double stretch = 1 + radial * (u * u + v * v) / (half * half);
      const PixelPlace place = map.to_true({x, y});
      EXPECT_NEAR(place.x, 0.5 * wide + u * stretch - 0.5 + margin_x, 1e-9);
      EXPECT_NEAR(place.y, 40 + v * stretch - 0.5 + margin_y, 1e-9);
      EXPECT_NEAR(map.to_recorded(place).x, x, 1e-6);
      EXPECT_NEAR(map.to_recorded(place).y, y, 1e-6);
    }
    // A picture of a smooth wave is that wave at the recorded places.
    const auto wave = [](double x, double y) { return 100 + 50 * std::sin(0.15 * x + 0.4) * std::cos(0.12 * y); };
    const GrayFrame corrected = map.corrected(test::frame_by(120, 80, wave));
    ASSERT_EQ(corrected.width, map.width());
    for (int row = 0; row < map.height(); row += 3)
      for (int column = 0; column < map.width(); column += 3) {
        const PixelPlace from = map.to_recorded({static_cast<double>(column), static_cast<double>(row)});
        if (from.x < 1 || from.y < 1 || from.x > 117 || from.y > 77) continue;
        ASSERT_NEAR(corrected.at(column, row), wave(from.x, from.y), 0.08) << column << ' ' << row;
      }
    // Beyond the border are its outermost pixels.
    if (radial > 0) {
      GrayFrame bright = test::even_frame(120, 80, 10);
      test::set(bright, 0, 0, 200);
      EXPECT_GT(map.corrected(bright).at(0, 0), 150);
    }
  }
  EXPECT_THROW(LensMap({0.49, 0}, 10, 10), std::invalid_argument);
  EXPECT_NO_THROW(LensMap({0.5, 0.3}, 10, 10));
  EXPECT_THROW(LensMap({2.01, 0}, 10, 10), std::invalid_argument);
  EXPECT_THROW(LensMap({1, -0.31}, 10, 10), std::invalid_argument);
  EXPECT_THROW(LensMap({1, 0}, 10, 10).corrected(test::even_frame(11, 10, 0)), std::invalid_argument);
  EXPECT_THROW(LensMap({1, 0}, 10, 10).corrected(test::even_frame(10, 11, 0)), std::invalid_argument);
  EXPECT_FALSE((Lens{1.1, 0}).plain());
  EXPECT_FALSE((Lens{1, 0.1}).plain());
}

// --- velocities.hpp --------------------------------------------------------------------------------------------------

MeasuredDisk measured_at(std::size_t frame, double x, double z) {
  MeasuredDisk disk;
  disk.frame = frame, disk.x = x, disk.z = z, disk.radius_px = 10;
  return disk;
}

// Linked are the two that are nearest to one another, in either sense, and nearer than the longest step.
TEST(BedProfile, DisksAreLinkedToTheirOnlyNeighbour) {
  Measurement film;
  film.disks = {measured_at(0, 0, 0),   measured_at(0, 2, 0),    measured_at(0, 2.3, 0), measured_at(0, 5, 5),
                measured_at(1, 0.1, 0), measured_at(1, 2.25, 0), measured_at(1, 5, 5.5), measured_at(3, 0.1, 0)};
  const auto links = link_disks(film, 0.45);
  ASSERT_EQ(links.size(), 2U);
  EXPECT_EQ(links[0].frame, 0U);
  EXPECT_EQ(links[0].from, 0U);
  EXPECT_EQ(links[0].to, 4U);
  EXPECT_EQ(links[1].from, 2U);
  EXPECT_EQ(links[1].to, 5U);
  EXPECT_EQ(link_disks(film, 0.55).size(), 3U);
  std::vector<FrameFindings> frames(3);
  frames[0].disks = {found_at(0, 0), found_at(50, 0), found_at(100, 0), found_at(150, 0)};
  frames[1].report.index = 1;
  frames[1].disks = {found_at(4, 0), found_at(50, 8.9), found_at(100, 9.1)};
  frames[1].second = {found_at(150, -5)};
  frames[2].report.index = 3;
  frames[2].disks = {found_at(4, 0)};
  EXPECT_NEAR(followed_share(frames, 20), 0.75, 1e-12);
}

// Six disks that move by +-0.1 D along x and +-0.2 D along z about a common step of 0.3 D/frame: the flow is taken out
// with one degree of freedom. T = <v^2>/g.
TEST(BedProfile, TemperatureIsTheSquareOfTheStepsLessTheFlow) {
  Measurement film;
  film.calibration.radius_px = 10, film.calibration.scale_m_per_px = 1e-4;  // D = 2 mm
  for (int k = 0; k < 6; ++k) {
    film.disks.push_back(measured_at(0, 3.0 * k, 0.5));
    film.disks.back().std_error_px = 0.3;
  }
  for (int k = 0; k < 6; ++k) {
    film.disks.push_back(measured_at(1, 3.0 * k + 0.3 + (k % 2 ? 0.1 : -0.1), 0.5 + (k < 3 ? 0.2 : -0.2)));
    film.disks.back().std_error_px = 0.4;
  }
  VelocityOptions options;
  options.frame_rate_hz = 100;
  const VelocityMeasurement found = measure_velocities(film, options);
  EXPECT_EQ(found.links, 6U);
  EXPECT_EQ(found.linked_share, 1);
  EXPECT_NEAR(found.mean_step, 0.5 * (std::hypot(0.4, 0.2) + std::hypot(0.2, 0.2)), 1e-9);
  const double noise = (0.09 + 0.16) / 400, unit = 4e-6 * 1e4 / 9.81;
  EXPECT_NEAR(found.horizontal.displacement_m, (6.0 / 5 * 0.01 - noise) * unit, 1e-12);
  EXPECT_NEAR(found.vertical.displacement_m, (6.0 / 5 * 0.04 - noise) * unit, 1e-12);
  EXPECT_NEAR(found.horizontal.localisation_bias_m, noise * unit, 1e-12);
  EXPECT_EQ(found.horizontal.finite_time_factor, 1);
  EXPECT_EQ(found.horizontal.over_mg_m, found.horizontal.displacement_m);
  EXPECT_TRUE(found.usable());
  // Two in a bin have no flow: they stay out.
  Measurement two = film;
  two.disks = {film.disks[0], film.disks[1], film.disks[6], film.disks[7]};
  EXPECT_EQ(measure_velocities(two, options).horizontal.displacement_m, 0);
  options.frame_rate_hz = 0;
  EXPECT_THROW(measure_velocities(film, options), std::invalid_argument);
  EXPECT_TRUE(
      any_holds(measure_velocities(Measurement{}, {.frame_rate_hz = 10}).warnings, "No disk could be followed"));
  VelocityMeasurement poor = found;
  poor.linked_share = 0.89;
  EXPECT_FALSE(poor.enough_are_followed());
  poor.linked_share = 0.9;
  EXPECT_TRUE(poor.usable());
  poor.vertical.finite_time_factor = 2.01;
  EXPECT_FALSE(poor.usable());
}

// Stretches of four frames, each with the last of the one before: the mean of their temperatures.
TEST(BedProfile, AMeterAveragesItsStretches) {
  RandomStream random(8);
  std::vector<std::vector<MeasuredDisk>> frames(10);
  std::vector<double> x(12, 0.0);
  for (std::size_t f = 0; f < 10; ++f)
    for (std::size_t k = 0; k < 12; ++k) {
      x[k] += 0.1 * random.normal();
      frames[f].push_back(measured_at(f, 3.0 * static_cast<double>(k) + x[k], 0.5));
    }
  VelocityMeter meter(2e-3, {.frame_rate_hz = 100}, 4);
  for (const auto& frame : frames) meter.add(frame);
  const VelocityMeasurement mean = meter.result();
  double sum = 0, links = 0, factor = 0, bias = 0, error = 0;
  for (std::size_t first = 0; first + 3 < 10; first += 3) {
    Measurement stretch;
    for (std::size_t f = first; f < first + 4; ++f)
      for (MeasuredDisk disk : frames[f]) disk.frame = f - first, stretch.disks.push_back(disk);
    stretch.calibration.radius_px = 10, stretch.calibration.scale_m_per_px = 1e-4;
    const VelocityMeasurement one = measure_velocities(stretch, {.frame_rate_hz = 100});
    sum += one.horizontal.displacement_m / 3, links += static_cast<double>(one.links);
    factor += one.vertical.finite_time_factor / 3, bias += one.vertical.localisation_bias_m / 3;
    error += one.vertical.finite_time_error / 3;
  }
  EXPECT_GE(factor, 1);
  EXPECT_NEAR(mean.vertical.finite_time_factor, factor, 1e-12);
  EXPECT_NEAR(mean.vertical.localisation_bias_m, bias, 1e-15);
  EXPECT_NEAR(mean.vertical.finite_time_error, error, 1e-12);
  EXPECT_NEAR(mean.horizontal.displacement_m, sum, 1e-12);
  EXPECT_EQ(static_cast<double>(mean.links), links);
  EXPECT_NEAR(mean.linked_share, 1, 0.05);
  EXPECT_TRUE(any_holds(VelocityMeter(2e-3, {.frame_rate_hz = 100}).result().warnings, "No two successive frames"));
  // Of five stretches in which hardly a disk is followed three say so.
  VelocityMeter poor(2e-3, {.frame_rate_hz = 100}, 3);
  for (std::size_t f = 0; f < 11; ++f) {
    std::vector<MeasuredDisk> disks = {measured_at(f, 1, 1)};
    for (int k = 0; k < 8; ++k) disks.push_back(measured_at(f, 3.0 * k + (f % 2 == 0 ? 0 : 1.2), 5));
    poor.add(disks);
  }
  EXPECT_EQ(poor.result().warnings.size(), 3U);
  VelocityMeter once(2e-3, {.frame_rate_hz = 100});
  once.add(frames[0]), once.add(frames[1]);
  EXPECT_GT(once.result().horizontal.displacement_m, 0) << "a few frames count if they are all";
}

// --- tables and limits -----------------------------------------------------------------------------------------------

TEST(BedProfile, DisksAreRowsOfTheirTables) {
  MeasuredDisk disk = measured_at(3, 1.25, 0.5);
  disk.x_px = 12.34567, disk.y_px = 7.5, disk.quality = 0.875, disk.probability = 0.75, disk.contrast = 1.5;
  disk.variance_x = 0.04, disk.variance_y = 0.09, disk.covariance_xy = 0.03, disk.species = 2, disk.half_hidden = true;
  EXPECT_EQ(disks_csv_rows({disk}), "3,12.3457,7.5000,10.0000,1.250000,0.500000,0.8750\n");
  EXPECT_EQ(disk_details_csv_rows({disk}), "3,12.3457,7.5000,0.20000,0.30000,0.5000,1.5000,0,1,2,0.7500\n");
  disk.variance_x = -1, disk.cut = true, disk.half_hidden = false;
  EXPECT_EQ(disk_details_csv_rows({disk, disk}).substr(0, 63),
            "3,12.3457,7.5000,0.00000,0.30000,0.0000,1.5000,1,0,2,0.7500\n3,1");
  EXPECT_EQ(to_string(FloorReference::given), "given");
  EXPECT_EQ(to_string(FloorReference::mean_of_motion), "mean of its motion");
  EXPECT_EQ(to_string(FloorReference::mean_by_amplitude), "mean by its amplitude");
  EXPECT_EQ(to_string(FloorReference::lowest_seen), "lowest seen");
  Measurement measurement;
  measurement.count_in_width_mean = 30, measurement.calibration.width = 12;
  EXPECT_EQ(measurement.column_number(), 2.5);
  measurement.column_known = false;
  EXPECT_FALSE(measurement.column_number());
}

TEST(BedProfile, OptionsThatMakeNoSenseAreNamed) {
  const auto problem = [](const auto& change) {
    MeasureOptions options;
    options.bead_diameter_m = 2e-3;
    change(options);
    const auto problems = options.validate();
    return problems.empty() ? std::string() : problems.front();
  };
  EXPECT_EQ(problem([](MeasureOptions&) {}), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.bead_diameter_m = 0; }), "bead_diameter_m is 0"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.bead_diameter_m = HUGE_VAL; }), "bead_diameter_m is inf"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.scale_m_per_px = 0; }), "scale_m_per_px is 0"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.scale_m_per_px = 2e-3; }), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.scale_m_per_px = 2.1e-3; }), "a bead is 0.952 px wide"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.scale_m_per_px = 2.1e-8; }), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.scale_m_per_px = 1.9e-8; }), "px wide: check its unit"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.second_diameter_m = -1; }), "second_diameter_m is -1"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.bin_width = 0; }), "bin_width is 0"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.kernel.kind = KernelKind::none; }), "kernel"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.kernel.width = 0; }), "kernel"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.left_wall_px = 5, o.right_wall_px = 5; }), "left of the right"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.left_wall_px = 5, o.right_wall_px = 5.1; }), "");
  EXPECT_EQ(problem([](MeasureOptions& o) { o.left_wall_px = 5; }), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.floor_amplitude_m = 0; }), "floor_amplitude_m is 0"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.shaking_frequency_hz = 10; }), "frame_rate_hz"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.shaking_frequency_hz = 10, o.frame_rate_hz = 100; }), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.geometry_frames = 0; }), "geometry_frames"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.phase_bins = 0; }), "phase_bins"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.find.radius_px = 0; }), "radius_px is 0"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.find.hold_radius = true; }), "hold_radius"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) {
                      o.find.roi = PixelRectangle{0, 0, 0, 5};
                    }),
                    "roi is 0 px wide and 5"));
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) {
                      o.find.roi = PixelRectangle{0, 0, 5, 0};
                    }),
                    "roi is 5 px wide and 0"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.find.roi = PixelRectangle{0, 0, 1, 1}; }), "");
  EXPECT_TRUE(holds(problem([](MeasureOptions& o) { o.find.joint_fit_sweeps = -1; }), "joint_fit_sweeps is -1"));
  EXPECT_EQ(problem([](MeasureOptions& o) { o.find.joint_fit_sweeps = 0; }), "");
}

TEST(BedProfile, AScaleIsRefusedBeyondThreeTimesTheCircles) {
  EXPECT_EQ(why_not_scale(2e-3, 2e-3 / 59.9, 10), "");
  EXPECT_EQ(why_not_scale(2e-3, 2e-3 / 6.7, 10), "");
  EXPECT_TRUE(
      holds(why_not_scale(2e-3, 2e-3 / 60.1, 10), "a bead of 2 mm is 60.1 px wide, but the circles found are 20 px"));
  EXPECT_TRUE(holds(why_not_scale(2e-3, 2e-3 / 6.6, 10), "a pixel is about 0.1 mm"));
  EXPECT_EQ(reduction_for(2000, 1000, 100), 1);
  EXPECT_EQ(reduction_for(2001, 1000, 47.9), 3);
  EXPECT_EQ(reduction_for(2001, 1000, 48), 4);
  EXPECT_EQ(reduction_for(2001, 1000, 48, true), 2);
  EXPECT_EQ(reduction_for(2001, 1000, 5), 1);
  EXPECT_EQ(reduction_for(20000, 15000, 10), 2);
  EXPECT_EQ(why_reduced(15000, 10000, 1), "");
  EXPECT_TRUE(holds(why_reduced(15001, 10000, 2), "15001 x 10000 px. It was averaged over squares of 2 x 2 px"));
  EXPECT_EQ(doubt_of(0.02), Doubt::little);
  EXPECT_EQ(doubt_of(0.021), Doubt::some);
  EXPECT_EQ(doubt_of(0.2), Doubt::some);
  EXPECT_EQ(doubt_of(0.21), Doubt::too_many);
  EXPECT_EQ(doubt_of_missed(0.02), Doubt::little);
  EXPECT_EQ(doubt_of_missed(0.4), Doubt::some);
  EXPECT_EQ(doubt_of_missed(0.41), Doubt::too_many);
  EXPECT_EQ(to_string(FindStatus::ok), "ok");
  EXPECT_EQ(to_string(FindStatus::no_beads), "no beads");
  EXPECT_EQ(to_string(FindStatus::doubtful), "doubtful");
  EXPECT_EQ(to_string(FindStatus::bad_input), "bad input");
}

}  // namespace
}  // namespace shakebed::ingest
