// What the extract stage writes of a measurement made by hand, in which no two numbers are alike: every number under
// its own name, with its error and unit.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "ingest/frames/stop_question.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/stages/disks_on_the_way.hpp"
#include "pipelines/stages/extract_files.hpp"
#include "pipelines/stages/picture_trial.hpp"
#include "pipelines/stages/proposals.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/painted_picture.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;

ingest::DensityProfile a_profile(double density) {
  ingest::DensityProfile profile;
  profile.bins = {-0.25, 0.5, 4};  // middles at 0, 0.5, 1 and 1.5
  profile.kernel = {KernelKind::top_hat, 0.5};
  profile.number_density = {density, 0.8, 0.4, 0};
  profile.std_error = {0.03, 0.02, 0.01, 0};
  profile.area_fraction = {0.7, 0.6, 0.3, 0};
  profile.covariance.assign(16, 0.0);
  for (std::size_t i = 0; i < 3; ++i) profile.covariance[5 * i] = std::pow(profile.std_error[i], 2);
  profile.covariance[1] = profile.covariance[4] = 2e-4;
  profile.samples = 4;
  profile.memory_frames = 1.7, profile.window_frames = 6, profile.independent_samples = 3;
  return profile;
}

ingest::Measurement a_measurement() {
  ingest::Measurement found;
  ingest::BedCalibration& bed = found.calibration;
  bed.lens.pixel_aspect = 1.02, bed.lens.radial = -0.03;
  bed.aspect_std_error = 0.002, bed.lens_radial_std_error = 0.004;
  bed.scale_m_per_px = 2e-4, bed.scale_relative_std_error = 0.05;
  bed.radius_px = 7.5, bed.radius_std_error_px = 0.06;
  bed.edge_width_px = 0.9, bed.noise_level = 3.5, bed.contrast_level = 120, bed.flicker = 0.07;
  bed.polarity = ingest::Polarity::bright_beads;
  bed.floor_px = 400, bed.floor_std_error_px = 0.37, bed.floor_reference = ingest::FloorReference::given;
  bed.floor_tilt_degrees = 1.5, bed.floor_tilt_std_error_degrees = 0.11;
  bed.shaking_frequency_hz = 21, bed.shaking_frequency_std_error_hz = 0.13, bed.frequency_false_alarm = 1e-5;
  bed.floor_amplitude_px = 12, bed.floor_amplitude_std_error_px = 0.3, bed.floor_phase = 0.3;
  bed.left_wall_px = 10, bed.right_wall_px = 310, bed.width = 20;
  bed.scale_given = false, bed.floor_given = true, bed.walls_given = false, bed.walls_are_frame_sides = true;
  found.profile = a_profile(1.1);
  found.second_profile = a_profile(0.9);
  found.coverage_profile = a_profile(1.2);
  found.phases = {{0.0625, a_profile(1.0)}, {0.5625, a_profile(0.95)}};
  found.coverage_disagreement = 0.015;
  found.disk_count_mean = 53, found.disk_count_std = 3;
  found.count_in_width_mean = 50, found.count_in_width_std = 2;
  found.finder.rims.emplace(), found.finder.expected_missed = 0.03, found.expected_wrong = 0.017;
  found.second_finder.emplace();
  found.second_finder->radius_px = 5.5, found.second_finder->radius_std_error_px = 0.08;
  found.finder.profile.step_px = 0.25;
  found.finder.profile.level = {1.0F, 0.5F}, found.finder.profile.fourth_harmonic = {0.0F, 0.125F};
  for (std::size_t k = 0; k < 5; ++k) {
    ingest::FrameReport frame;
    frame.index = k, frame.origin.path = "folder/picture" + std::to_string(k) + ".png", frame.origin.page = 2 * k;
    frame.disks = 48 + k, frame.second = k, frame.rejected = 7 + k,
    frame.residual_level = 3 + 0.5 * static_cast<double>(k);
    frame.light.gain = 1 + 0.25 * static_cast<double>(k);
    if (k == 0) frame.status = ingest::FrameStatus::unreadable, frame.disks = 0;
    found.frames.push_back(frame);
  }
  return found;
}

ExtractOptions some_options() {
  ExtractOptions options;
  options.diameter = 0.003;
  options.kernel = {KernelKind::top_hat, 0.5};
  options.bead_number = 51;
  return options;
}

struct Stated {
  const char* pointer;
  double value, std_error;
  const char* unit;
};

TEST(ExtractNumbers, StandUnderTheirNamesWithErrorsAndUnits) {
  const Json json = bed_numbers(some_options(), a_measurement());
  for (const Stated& one : {Stated{"/disks_per_frame", 53, -1, "1"},
                            {"/diameter", 0.003, -1, "m"},
                            {"/scale", 2e-4, 1e-5, "m/px"},
                            {"/pixel_aspect", 1.02, 0.002, "1"},
                            {"/lens", -0.03, 0.004, "1"},
                            {"/radius", 7.5, 0.06, "px"},
                            {"/edge_width", 0.9, -1, "px"},
                            {"/noise", 3.5, -1, "grey levels"},
                            {"/contrast", 120, -1, "grey levels"},
                            {"/flicker", 0.07, -1, "1"},
                            {"/floor", 400, 0.37, "px"},
                            {"/floor_tilt", 1.5, 0.11, "deg"},
                            {"/frequency", 21, 0.13, "Hz"},
                            {"/floor_amplitude", 0.0024, std::hypot(6e-5, 0.05 * 0.0024), "m"},
                            {"/left_wall", 10, -1, "px"},
                            {"/right_wall", 310, -1, "px"},
                            {"/width", 20, -1, "D"},
                            {"/column_number", 2.5, 0.05, "1"},
                            {"/profile/greatest_density", 1.1, -1, "1/D^2"},
                            {"/coverage_disagreement", 0.015, -1, "1/D^2"},
                            {"/second_species/radius", 5.5, 0.08, "px"}}) {
    const Json* found = find_pointer(json, one.pointer);
    ASSERT_NE(found, nullptr) << one.pointer;
    EXPECT_DOUBLE_EQ(value(*found), one.value) << one.pointer;
    EXPECT_EQ((*found)["unit"], one.unit) << one.pointer;
    EXPECT_EQ(found->contains("std_error"), one.std_error >= 0) << one.pointer;
    if (one.std_error >= 0) {
      EXPECT_DOUBLE_EQ(error(*found), one.std_error) << one.pointer;
    }
  }
  for (const auto& [pointer, number] : {std::pair{"/frames", 5.0},
                                        {"/frames_used", 4},
                                        {"/disks_per_frame_scatter", 3},
                                        {"/bead_number", 51},
                                        {"/expected_wrong", 0.017},
                                        {"/expected_missed", 0.03},
                                        {"/frequency_false_alarm", 1e-5},
                                        {"/floor_phase", 0.3},
                                        {"/kernel/width", 0.5},
                                        {"/profile/frames", 4},
                                        {"/profile/memory_frames", 1.7},
                                        {"/profile/window_frames", 6},
                                        {"/profile/independent_samples", 3},
                                        {"/second_species/disks_per_frame", 2.5}}) {
    const Json* found = find_pointer(json, pointer);
    ASSERT_NE(found, nullptr) << pointer;
    EXPECT_DOUBLE_EQ(found->get<double>(), number) << pointer;
  }
  EXPECT_EQ(json["polarity"], "bright");
  EXPECT_EQ(json["floor_reference"], "given");
  EXPECT_EQ(json["shaken"], true);
  EXPECT_EQ(json["kernel"]["kind"], "top_hat");
  for (const auto& [name, truth] : {std::pair{"scale_given", false},
                                    {"floor_given", true},
                                    {"walls_given", false},
                                    {"walls_are_frame_sides", true},
                                    {"frequency_given", false}})
    EXPECT_EQ(json[name], truth) << name;
}

TEST(ExtractNumbers, OfVelocitiesStandUnderTheirNames) {
  ingest::VelocityMeasurement velocities;
  velocities.horizontal = {1e-3, 2e-4, 3e-5, 1.1, 0.1, 7e-4, 8e-5};
  velocities.vertical = {4e-3, 5e-4, 6e-5, 1.2, 0.1, 9e-4, 2e-5};
  velocities.linked_share = 0.97, velocities.mean_step = 0.14;
  const Json json = velocity_numbers(velocities, 250);
  const Json &x = json["temperature_x_over_mg"], &z = json["temperature_z_over_mg"];
  EXPECT_EQ(value(x), 1e-3);
  EXPECT_EQ(error(x), 2e-4);
  EXPECT_EQ(x["unit"], "m");
  EXPECT_EQ(x["localisation_bias"], 3e-5);
  EXPECT_EQ(x["finite_time_factor"], 1.1);
  EXPECT_EQ(value(z), 4e-3);
  EXPECT_EQ(error(z), 5e-4);
  EXPECT_EQ(z["localisation_bias"], 6e-5);
  EXPECT_EQ(z["finite_time_factor"], 1.2);
  const Json& moved_x = json["temperature_x_of_displacements_over_mg"];
  const Json& moved_z = json["temperature_z_of_displacements_over_mg"];
  EXPECT_EQ(value(moved_x), 7e-4);
  EXPECT_EQ(error(moved_x), 8e-5);
  EXPECT_EQ(moved_x["unit"], "m");
  EXPECT_EQ(value(moved_z), 9e-4);
  EXPECT_EQ(error(moved_z), 2e-5);
  EXPECT_EQ(json["linked_share"], 0.97);
  EXPECT_EQ(json["usable"], true);
  velocities.horizontal.finite_time_factor = 2.1;
  EXPECT_EQ(velocity_numbers(velocities, 250)["usable"], false);
  velocities.horizontal.finite_time_factor = 1.1, velocities.linked_share = 0.65;
  EXPECT_EQ(velocity_numbers(velocities, 250)["usable"], false);
  EXPECT_EQ(value(json["mean_step"]), 0.14);
  EXPECT_EQ(json["mean_step"]["unit"], "D");
  EXPECT_EQ(value(json["frame_rate"]), 250);
  EXPECT_EQ(json["frame_rate"]["unit"], "Hz");
}

// The bed that photographs show, in metres.
TEST(ExtractNumbers, DescribeTheBedInSi) {
  ExtractOptions options = some_options();
  options.gravity = 9.5, options.second_diameter = 0.002;
  const BedDescription bed = bed_seen(options, a_measurement());
  EXPECT_EQ(bed.count, 50);
  EXPECT_EQ(bed.diameter, 0.003);
  EXPECT_EQ(*bed.second_diameter, 0.002);
  EXPECT_EQ(*bed.gravity, 9.5);
  EXPECT_DOUBLE_EQ(bed.width, 0.06);
  EXPECT_EQ(*bed.frequency, 21);
  EXPECT_DOUBLE_EQ(*bed.amplitude, 0.0024);
  EXPECT_FALSE(bed.mass);
}

class ExtractTables : public testing::Test {
 protected:
  ExtractTables() {
    write_text(extract_.file("a.png"), "");
    extract_.read(R"({ "images": ")" + extract_.file("a.png").string() +
                  R"(", "diameter": "3 mm", "second_diameter": "2 mm" })");
  }
  NumberTable table(const std::string& name) const { return NumberTable(extract_.output(name)); }
  LoneStage extract_{*find_stage("extract")};
};

TEST_F(ExtractTables, HoldTheProfilesOfEverySource) {
  write_profiles(extract_, a_measurement());
  for (const auto& [name, density] : {std::pair{"profile.csv", 1.1},
                                      {"second_profile.csv", 0.9},
                                      {"coverage_profile.csv", 1.2},
                                      {"profile_phase_00.csv", 1.0},
                                      {"profile_phase_01.csv", 0.95}}) {
    const NumberTable profile = table(name);
    ASSERT_EQ(profile.rows(), 3U) << name << ": without the empty rows";
    const double densities[] = {density, 0.8, 0.4}, errors[] = {0.03, 0.02, 0.01}, areas[] = {0.7, 0.6, 0.3};
    for (std::size_t r = 0; r < 3; ++r) {
      EXPECT_DOUBLE_EQ(profile("height", r), 0.5 * static_cast<double>(r)) << name;
      EXPECT_DOUBLE_EQ(profile("number_density", r), densities[r]) << name;
      EXPECT_DOUBLE_EQ(profile("std_error", r), errors[r]) << name;
      EXPECT_NEAR(profile("area_fraction", r), areas[r], 1e-15) << name;
      EXPECT_EQ(profile("samples", r), std::round(densities[r] * 20 * 0.5 * 4)) << name;
    }
  }
  EXPECT_EQ(table_notes(extract_.output("profile.csv"))["column_number"], 2.5);
  EXPECT_EQ(table_notes(extract_.output("profile_phase_01.csv"))["phase"], 0.5625);
  EXPECT_EQ(table_notes(extract_.output("covariance.csv"))["independent_samples"], 3);
  const NumberTable covariance = table("covariance.csv");
  ASSERT_EQ(covariance.rows(), 4U);
  const double expected[][3] = {{0, 0, 9e-4}, {0, 0.5, 2e-4}, {0.5, 0.5, 4e-4}, {1, 1, 1e-4}};
  for (std::size_t r = 0; r < 4; ++r) {
    EXPECT_NEAR(covariance("height_i", r), expected[r][0], 1e-12);
    EXPECT_NEAR(covariance("height_j", r), expected[r][1], 1e-12);
    EXPECT_NEAR(covariance("covariance", r), expected[r][2], 1e-15);
  }
}

TEST_F(ExtractTables, HoldFramesAndTheBead) {
  const ingest::Measurement found = a_measurement();
  frames_table(extract_.table("frames.csv"), found.frames).write(extract_.output("frames.csv"));
  const NumberTable frames = table("frames.csv");
  ASSERT_EQ(frames.rows(), 5U);
  for (std::size_t r = 0; r < 5; ++r) {
    const auto k = static_cast<double>(r);
    EXPECT_EQ(frames("frame", r), k);
    EXPECT_EQ(frames.text("image", r), "picture" + std::to_string(r) + ".png");
    EXPECT_EQ(frames("page", r), 2 * k);
    EXPECT_EQ(frames.text("status", r), r == 0 ? "unreadable" : "good");
    EXPECT_EQ(frames("disks", r), r == 0 ? 0 : 48 + k);
    EXPECT_EQ(frames("second", r), k);
    EXPECT_EQ(frames("rejected", r), 7 + k);
    EXPECT_EQ(frames("residual_level_grey_levels", r), 3 + 0.5 * k);
    EXPECT_EQ(frames("contrast_gain", r), 1 + 0.25 * k);
  }
  bead_table(extract_.table("bead.csv"), found.finder).write(extract_.output("bead.csv"));
  const NumberTable bead = table("bead.csv");
  EXPECT_EQ(bead("radius_px", 1), 0.25);
  EXPECT_EQ(bead("contrast", 1), 0.5);
  EXPECT_EQ(bead("fourth_harmonic", 1), 0.125);
}

// What is drawn beside the disks of a frame: where one was missed, and which are none. Frames in which all agrees have
// no marks.
TEST_F(ExtractTables, MarkWhatWasMissedAndWhatIsNone) {
  ExtractOptions options = some_options();
  options.stride = 1, options.overlays = 0;
  std::istringstream truth("frame,disk,x_px,y_px,radius_px\n0,0,10,20,5\n0,1,40,20,5\n0,2,70,20,5\n1,0,10,20,5\n");
  DisksOnTheWay on_the_way(extract_, options, &truth);
  const auto at = [](double x) {
    ingest::MeasuredDisk one;
    one.x_px = x, one.y_px = 20, one.radius_px = 5;
    return one;
  };
  ingest::FrameReport frame;
  on_the_way.take(frame, {at(25), at(41), at(39.5), at(100)});  // two at the second: the one that comes first counts
  frame.index = 1;
  on_the_way.take(frame, {at(10)});
  ASSERT_NE(on_the_way.marks(0), nullptr);
  EXPECT_EQ(on_the_way.marks(0)->missed, (std::vector<std::pair<double, double>>{{10, 20}, {70, 20}}));
  EXPECT_EQ(on_the_way.marks(0)->wrong, (std::vector<std::size_t>{0, 2, 3}));
  EXPECT_EQ(on_the_way.marks(1), nullptr);
}

// Three disks in each of two frames, of which every second one of the film was read: frames 0 and 2. Of the six true
// ones one is missed, and one disk is none. Centres are off by (0.3, 0.4) px.
TEST_F(ExtractTables, HoldTheDisksAndCompareThemWithTheTruth) {
  ExtractOptions options = some_options();
  options.stride = 2, options.overlays = 0;
  std::istringstream truth(
      "frame,disk,x_px,y_px,radius_px\n0,0,10,20,5\n0,1,40,20,5\n0,2,70,20,5\n1,0,500,500,5\n2,0,10,80,5\n"
      "2,1,40,80,5\n2,2,70,80,5\n2,3,150,150,5\n");  // seven, of which five are among the six found
  DisksOnTheWay on_the_way(extract_, options, &truth);
  const auto disk = [](std::size_t frame, double x, double y, double quality) {
    ingest::MeasuredDisk one;
    one.frame = frame, one.x_px = x + 0.3, one.y_px = y + 0.4, one.radius_px = 5, one.x = x / 10, one.z = y / 10;
    one.quality = quality, one.variance_x = 0.04, one.variance_y = 0.09, one.covariance_xy = 0.03;
    one.contrast = 1.25, one.probability = 0.9;
    return one;
  };
  std::vector<ingest::MeasuredDisk> first{disk(0, 10, 20, 0.99), disk(0, 40, 20, 0.95), disk(0, 70, 20, 0.95)},
      second{disk(1, 10, 80, 0.95), disk(1, 40, 80, 0.31), disk(1, 90, 80, 0.11)};
  first[0].cut = true, second[1].half_hidden = true, second[2].half_hidden = true, second[2].species = 2;
  second[1].probability = 0.875;
  ingest::FrameReport frame;
  on_the_way.take(frame, first);
  frame.index = 1;
  on_the_way.take(frame, second);
  on_the_way.close();
  const Json found = *on_the_way.truth();
  EXPECT_DOUBLE_EQ(found["recall"].get<double>(), 5.0 / 7);
  EXPECT_DOUBLE_EQ(found["precision"].get<double>(), 5.0 / 6);
  EXPECT_NEAR(value(found["center_rms_error"]), 0.5, 1e-12);
  EXPECT_EQ(found["center_rms_error"]["unit"], "px");
  EXPECT_EQ(on_the_way.cut(), 1U);
  EXPECT_EQ(on_the_way.half_hidden(), 2U);
  EXPECT_DOUBLE_EQ(on_the_way.quality()["lowest_percent"].get<double>(), 0.12) << "the class from 0.10 to 0.12";
  EXPECT_DOUBLE_EQ(on_the_way.quality()["median"].get<double>(), 0.96);
  // Bars 560/50 px apart; that of three disks is 200 px high, that of one log 2/log 4 of it.
  const std::string figure = on_the_way.quality_figure();
  EXPECT_NE(
      figure.find("<rect x=\"586.4\" y=\"20.0\" width=\"10.2\" height=\"200.0\" fill=\"#1f6fb4\"><title>3</title>"),
      std::string::npos);
  EXPECT_NE(
      figure.find("<rect x=\"116.0\" y=\"120.0\" width=\"10.2\" height=\"100.0\" fill=\"#1f6fb4\"><title>1</title>"),
      std::string::npos);
  EXPECT_NE(
      figure.find("<text x=\"60\" y=\"240\">0</text>\n<text x=\"620\" y=\"240\" text-anchor=\"end\">1</text>\n<text "
                  "x=\"340\" y=\"262\""),
      std::string::npos);
  on_the_way.quality_table(extract_.table("quality.csv")).write(extract_.output("quality.csv"));
  const NumberTable quality = table("quality.csv"), disks = table("disks.csv"), details = table("disk_details.csv");
  ASSERT_EQ(quality.rows(), 50U);
  for (std::size_t r = 0; r < 50; ++r) {
    EXPECT_NEAR(quality("from", r), 0.02 * static_cast<double>(r), 1e-12);
    EXPECT_NEAR(quality("to", r), 0.02 * static_cast<double>(r + 1), 1e-12);
    EXPECT_EQ(quality("disks", r), r == 5 || r == 15 || r == 49 ? 1 : r == 47 ? 3 : 0) << r;
  }
  ASSERT_EQ(disks.rows(), 6U);
  EXPECT_EQ(disks("frame", 4), 1);
  EXPECT_NEAR(disks("x_px", 4), 40.3, 1e-3);
  EXPECT_NEAR(disks("y_px", 4), 80.4, 1e-3);
  EXPECT_NEAR(disks("radius_px", 4), 5, 1e-3);
  EXPECT_NEAR(disks("x", 4), 4, 1e-5);
  EXPECT_NEAR(disks("z", 4), 8, 1e-5);
  EXPECT_NEAR(disks("quality", 4), 0.31, 1e-3);
  EXPECT_EQ(details("frame", 4), 1);
  EXPECT_NEAR(details("x_px", 4), 40.3, 1e-3);
  EXPECT_NEAR(details("y_px", 4), 80.4, 1e-3);
  EXPECT_NEAR(details("std_error_x_px", 4), 0.2, 1e-6);
  EXPECT_NEAR(details("std_error_y_px", 4), 0.3, 1e-6);
  EXPECT_NEAR(details("correlation", 4), 0.5, 1e-6);
  EXPECT_NEAR(details("contrast", 4), 1.25, 1e-6);
  EXPECT_EQ(details("cut", 0), 1);
  EXPECT_EQ(details("cut", 4), 0);
  EXPECT_EQ(details("half_hidden", 4), 1);
  EXPECT_EQ(details("species", 5), 2);
  EXPECT_NEAR(details("probability", 4), 0.875, 1e-6);
  EXPECT_NEAR(details("probability", 0), 0.9, 1e-6);
}

// 100 beads: refused below 80 and above 120; from 0.1 bead on there is a warning, which says on which side.
TEST(BeadNumber, IsHeldAgainstTheBeadsFound) {
  Judgement judgement;
  for (const double found : {79.0, 121.0}) EXPECT_THROW(judge_bead_number(100, found, judgement), StageError) << found;
  for (const double found : {99.95, 100.0, 100.05}) judge_bead_number(100, found, judgement);
  EXPECT_TRUE(judgement.warnings.empty());
  for (const auto& [found, says] : {std::pair{81.0, "some beads are missed"},
                                    {99.8, "some beads are missed"},
                                    {100.2, "another object is taken for a bead"},
                                    {119.0, "another object is taken for a bead"}}) {
    judgement.warnings.clear();
    judge_bead_number(100, found, judgement);
    ASSERT_EQ(judgement.warnings.size(), 1U) << found;
    EXPECT_NE(judgement.warnings[0].find(says), std::string::npos) << judgement.warnings[0];
  }
}

// What cannot be read is named later, by whoever reads it; only `skip` can leave out all frames.
TEST(FirstPictures, AreThoseAfterTheSkippedOnes) {
  const std::filesystem::path folder = testing::TempDir();
  const std::string one = (folder / "one.pgm").string(), two = (folder / "two.pgm").string();
  const std::string damaged = (folder / "damaged.mp4").string();
  for (const std::string& path : {one, two}) write_text(path, PaintedPicture(20, 10).pgm());
  write_text(damaged, std::string(1'000, 'x'));
  const auto first = [](const std::vector<std::string>& files, std::size_t skip) {
    shakebed::ingest::FrameSourceOptions source;
    source.skip = skip;
    std::vector<std::string> paths;
    for (const auto& picture : first_pictures(files, source)) paths.push_back(picture.path);
    return paths;
  };
  using Paths = std::vector<std::string>;
  EXPECT_EQ(first({one, two}, 0), (Paths{one, two}));
  EXPECT_EQ(first({one, two}, 1), (Paths{two}));
  EXPECT_THROW(first({one, two}, 2), StageError);
  EXPECT_EQ(first({damaged}, 0), (Paths{damaged}));
  EXPECT_THROW(first({damaged}, 2), shakebed::ingest::InputError) << "it has no frame at all";
}

// Large beads are tried on a reduced copy: as many, and as large, as in the picture itself.
TEST(PictureTrial, OnAReducedPictureFindsTheSameBeads) {
  constexpr double radius = 25;
  const std::vector<Place> places = lattice(radius, 4, 20, 480, 370, 0.03);
  const std::string path = (std::filesystem::path(testing::TempDir()) / "large_beads.pgm").string();
  write_text(path, PaintedPicture(500, 400).disks(places, radius, 60).noise(2).pgm());
  ExtractOptions options = some_options();
  options.bead_number.reset();
  const std::optional<FirstLook> look = look_at_first({{path}}, options);
  ASSERT_TRUE(look);
  const auto reduced = reduced_for_trials(*look, radius);
  ASSERT_TRUE(reduced);
  EXPECT_EQ(reduced->reduction, 2);
  const std::optional<Trial> trial = try_options({path}, options, &*reduced);
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->beads, places.size());
  EXPECT_NEAR(trial->radius_px, radius, 0.5);
  EXPECT_FALSE(reduced_for_trials(*look, 19)) << "such beads would be too small";
  options.roi = {0, 0, 500, 60};
  EXPECT_FALSE(try_options({path}, options, &*reduced)) << "no bead lies there";
}

// Disks that a film for wide screens shows as ovals, half as high again as wide: what is proposed is the aspect of its
// pixels, and leads to all of them. Of beads that touch and are 13 px wide, blur makes it wrong by up to 2 %.
TEST(PictureTrial, FindsTheShapeOfPixels) {
  constexpr double radius = 10, aspect = 1.5;  // true px
  const std::vector<Place> places = lattice(radius, 7, 12, 470, 270, 0.05);
  const auto cover = [&](double x, double y) {
    double farthest_in = 0;
    for (const Place& place : places) {
      const double dx = (x + 0.5) * aspect - 0.5 - place.x, dy = y - place.y, away = std::hypot(dx, dy);
      if (away > radius + 2) continue;
      const double px = away > 0 ? std::hypot(dx / aspect, dy) / away : 1;  // recorded px a true one, this way
      farthest_in = std::max(farthest_in, (radius - away) * px + 0.5);
    }
    return farthest_in;
  };
  const std::string path = (std::filesystem::path(testing::TempDir()) / "wide_screen.pgm").string();
  write_text(path, PaintedPicture(320, 300).paint(cover, 60).blur(0.7).noise(2).pgm());
  ExtractOptions options = some_options();
  options.bead_number.reset();
  const std::optional<FirstLook> look = look_at_first({{path}}, options);
  ASSERT_TRUE(look);
  EXPECT_FALSE(look->survey.found);
  const std::vector<Proposal> proposals = proposals_for(*look, options, RefusedBy::first_look);
  ASSERT_EQ(proposals.size(), 1U);
  ASSERT_TRUE(proposals[0].options.pixel_aspect);
  EXPECT_NEAR(*proposals[0].options.pixel_aspect / aspect, 1, 0.02);
  ASSERT_EQ(proposals[0].give.rfind("--pixel-aspect ", 0), 0U);
  EXPECT_EQ(std::stod(proposals[0].give.substr(15)), *proposals[0].options.pixel_aspect);
  EXPECT_NEAR(proposals[0].bead_aspect * aspect, 1, 0.02);
  const std::optional<FirstLook> square = look_at_first({{path}}, proposals[0].options);
  ASSERT_TRUE(square && square->survey.found);
  EXPECT_EQ(square->width, std::lround(320 * *proposals[0].options.pixel_aspect));
  EXPECT_NEAR(*ingest::aspect_by_outlines(*square) / aspect, 1, 0.02);
  ExtractOptions wrong = options;
  wrong.pixel_aspect = 0.9;
  const std::vector<Proposal> instead = proposals_for(*look_at_first({{path}}, wrong), wrong, RefusedBy::first_look);
  ASSERT_EQ(instead.size(), 1U);
  EXPECT_EQ(instead[0].leave_out, std::vector<std::string>{"--pixel-aspect"});
  EXPECT_NEAR(*instead[0].options.pixel_aspect / aspect, 1, 0.02);
  const std::optional<Trial> trial = try_options({path}, proposals[0].options);
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->beads, places.size());
  EXPECT_NEAR(trial->radius_px, radius, 0.2);
}

// Disks two diameters apart are refused. Searching is counted by how often it asks whether to stop: what was found is
// not searched for again, and the whole takes less than two searches of the picture. It took three and more.
TEST(PictureTrial, OfWhatWasMeasuredIsNoSearch) {
  std::vector<Place> places;
  for (int column = 0; column < 9; ++column)
    for (int row = 0; row < 9; ++row)
      places.push_back({32.0 + 33 * column + (column * 7 + row * 3) % 3, 30.0 + 33 * row + (column + row * 5) % 3});
  const std::string path = (std::filesystem::path(testing::TempDir()) / "holes.pgm").string();
  write_text(path, PaintedPicture(330, 330).disks(places, 10, 60).noise(3).pgm());
  ExtractOptions options = some_options(), any = options;
  options.bead_number.reset(), any.bead_number.reset();
  any.shape = BeadShape::any;
  std::size_t asked = 0;
  const ingest::StopQuestion counted([&] { ++asked; });
  const std::optional<FirstLook> look = look_at_first({{path}}, options);
  ASSERT_TRUE(look && look->survey.found);
  ingest::MeasureOptions measure = asked_for(options);
  ingest::FrameSourceOptions source;
  go_on_with(chosen_of(look->survey, options), *look, source, measure);
  ingest::FrameSource picture = ingest::FrameSource::open({path}, source);
  const ingest::Measurement measured = ingest::measure_bed(picture, measure);
  const std::size_t once = asked;
  EXPECT_THROW(judge_disks(options, measured), StageError);
  const std::vector<Proposal> proposals = proposals_for(*look, options, RefusedBy::measurement, &measured);
  EXPECT_LT(asked - once, 2 * once);
  ASSERT_EQ(proposals.size(), 2U);  // a scale is one of them, and was tried
  EXPECT_EQ(proposals[1].give, "--shape any");
  EXPECT_EQ(proposals[1].found.disks.size(), places.size());
  const std::optional<Trial> trial = try_options({path}, any);
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->beads, places.size());
}

// Every second of 81 disks has another face. What stands for the search of the run finds the same beads.
TEST(PictureTrial, ByRimsAloneFindsTheBeadsOfTheRun) {
  std::vector<Place> places;
  for (int column = 0; column < 9; ++column)
    for (int row = 0; row < 9; ++row) places.push_back({32.0 + 28 * column, 30.0 + 28 * row});
  PaintedPicture picture(290, 290);
  picture.disks(places, 12, 60);
  for (std::size_t k = 0; k < places.size(); k += 2) picture.disks({places[k]}, 8, 160);
  const std::string path = (std::filesystem::path(testing::TempDir()) / "rings.pgm").string();
  write_text(path, picture.noise(3).pgm());
  ExtractOptions options = some_options();
  options.bead_number.reset();
  options.shape = BeadShape::any;
  const std::optional<FirstLook> look = look_at_first({{path}}, options);
  ASSERT_TRUE(look && look->survey.found);
  const std::optional<Trial> quick = try_after_look(*look, options, TrialSearch::by_rims_alone);
  const std::optional<Trial> whole = try_after_look(*look, options, TrialSearch::as_the_run);
  ASSERT_TRUE(quick && whole);
  EXPECT_EQ(quick->beads, places.size());
  EXPECT_EQ(whole->beads, places.size());
  EXPECT_LT(quick->missed, 0.1);
  EXPECT_LT(quick->wrong, 0.1);
  EXPECT_NEAR(quick->radius_px, whole->radius_px, 0.05 * whole->radius_px);
}

// Twenty disks that go straight on, each at its own speed. Half of the frame rate makes a quarter of the temperature,
// every second frame of the film as well; half of g makes twice the length T/(m g).
// Of a film of unknown length the first four good frames, then every second, then every fourth; two of them, the first
// among them, are drawn.
TEST_F(ExtractTables, ChooseTheFramesThatAreDrawn) {
  ExtractOptions options = some_options();
  options.overlays = 2;
  DisksOnTheWay on_the_way(extract_, options, nullptr);
  const auto drawn = [&] {
    std::vector<std::size_t> found;
    for (const auto& [index, disks] : on_the_way.to_draw()) found.push_back(index);
    return found;
  };
  ingest::FrameReport frame;
  const auto take = [&](std::size_t index, bool good) {
    frame.index = index, frame.status = good ? ingest::FrameStatus::good : ingest::FrameStatus::unreadable;
    on_the_way.take(frame, {});
  };
  using Chosen = std::vector<std::size_t>;
  EXPECT_EQ(drawn(), Chosen{});
  take(0, true);
  EXPECT_EQ(drawn(), Chosen{0});
  for (std::size_t index = 1; index < 4; ++index) take(index, true);
  EXPECT_EQ(drawn(), (Chosen{0, 2}));
  for (std::size_t index = 4; index < 8; ++index) take(index, index != 6);  // kept: 0, 2, 4
  EXPECT_EQ(drawn(), (Chosen{0, 4}));
  for (std::size_t index = 8; index < 11; ++index) take(index, true);  // 0, 2, 4, 8; with 10 those of every fourth
  EXPECT_EQ(drawn(), (Chosen{0, 8}));
  EXPECT_FALSE(on_the_way.truth());
  EXPECT_EQ(on_the_way.marks(0), nullptr);
}

TEST_F(ExtractTables, HoldTemperaturesByTheFramesReadAndByGravity) {
  const auto temperature = [&](double rate, std::uint32_t stride, double gravity) {
    ExtractOptions options = some_options();
    options.frame_rate = rate, options.stride = stride, options.gravity = gravity, options.overlays = 0;
    DisksOnTheWay on_the_way(extract_, options, nullptr);
    for (std::size_t frame = 0; frame < 6; ++frame) {
      std::vector<ingest::MeasuredDisk> disks;
      for (int k = 0; k < 20; ++k) {
        ingest::MeasuredDisk disk;
        disk.frame = frame, disk.radius_px = 5, disk.quality = 1;
        disk.x = 2 + 3 * (k % 5) + 0.02 * std::sin(3.0 * k) * static_cast<double>(frame);
        disk.z = 2 + 0.01 * k + 3 * (k / 5) + 0.02 * std::cos(5.0 * k) * static_cast<double>(frame);
        disk.x_px = 10 * disk.x, disk.y_px = 10 * disk.z;
        disks.push_back(disk);
      }
      ingest::FrameReport report;
      report.index = frame;
      on_the_way.take(report, disks);
    }
    on_the_way.close();
    return on_the_way.velocities()->horizontal.over_mg_m;
  };
  const double plain = temperature(1000, 1, 9.81);
  ASSERT_GT(plain, 0);
  EXPECT_NEAR(temperature(500, 1, 9.81) / plain, 0.25, 1e-9);
  EXPECT_NEAR(temperature(1000, 2, 9.81) / plain, 0.25, 1e-9);
  EXPECT_NEAR(temperature(1000, 1, 4.905) / plain, 2, 1e-9);
}

// What speaks against a temperature, one by one: of a measurement in which nothing else does.
TEST(ExtractObjections, NameWhatThePhotographsShow) {
  ingest::Measurement good = a_measurement();
  good.disk_total = 200;
  EXPECT_TRUE(objections_to(good).empty());
  const auto only = [](const ingest::Measurement& found) {
    const std::vector<ingest::Objection> all = objections_to(found);
    EXPECT_EQ(all.size(), 1U);
    EXPECT_FALSE(all[0].advice.empty());
    return all[0].why;
  };
  const auto has = [](const std::string& text, const char* words) { return text.find(words) != std::string::npos; };
  ingest::Measurement found = good;
  found.floor_out_of_view = true;
  EXPECT_TRUE(has(only(found), "the floor is not visible"));
  found.surface_out_of_view = true;
  EXPECT_TRUE(has(only(found), "neither the floor nor the surface of the bed is visible"));
  found = good, found.surface_out_of_view = true;
  EXPECT_TRUE(objections_to(found).empty()) << "disks may fly out of the picture";
  found = good, found.disk_total = 29;
  EXPECT_TRUE(has(only(found), "Only 29 beads"));
  found = good, found.finder.expected_missed = 0.09;
  EXPECT_TRUE(has(only(found), "2 % of the disks found may be wrong, and 9 % of the beads may be missed"));
  found = good, found.calibration.floor_tilt_degrees = -12;
  EXPECT_TRUE(has(only(found), "tilted by 12 degrees"));
}

}  // namespace
