// The stages `render` and `extract` in the test's own process, on a bed of a few disks: the camera's view in pencil and
// paper, the truth beside it, and what is found of it again.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"
#include "ingest/frames/png_text.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/frame_geometry.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/extract_files.hpp"
#include "pipelines/stages/extract_images.hpp"
#include "pipelines/stages/render_images.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/painted_picture.hpp"
#include "tests/pipelines/read_table.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

BedDescription bed_of_camera() {
  BedDescription bed;
  bed.count = 25, bed.diameter = 0.004, bed.width = 0.0252, bed.gravity = 10, bed.mass = 1e-4;
  bed.amplitude = 0.001, bed.frequency = 20;
  return bed;
}

// Five rows of five disks, 1.26 D apart across and 1.2 D upwards, in a box of 6.3 D.
TrajectoryFrame rows_of_five(double shift = 0) {
  TrajectoryFrame frame;
  frame.width = 6.3;
  for (int k = 0; k < 25; ++k) {
    frame.x.push_back(0.63 + 1.26 * (k % 5) + shift), frame.z.push_back(0.6 + 1.2 * (k / 5) + 0.01 * (k % 3));
    frame.vx.push_back(0.02 * k), frame.vz.push_back(-0.03 * k), frame.spin.push_back(0), frame.radius.push_back(0.5);
  }
  return frame;
}

RenderOptions plain_camera() {
  RenderOptions options;
  options.scale = 2e-4;  // 20 px a diameter
  options.noise = 2, options.exposure = 0, options.gradient_x = options.gradient_y = 0;
  return options;
}

class BedOfCamera {
 public:
  explicit BedOfCamera(const BedDescription& bed, const std::vector<TrajectoryFrame>& frames) {
    stage.add_input("bed", *find_stage("simulate"), "s");
    write_text(stage.file("s/bed.json"), dump(bed.to_json()));
    TrajectoryWriter writer(stage.file("s/trajectory.extxyz"));
    for (const TrajectoryFrame& frame : frames) writer.write(frame);
    writer.close();
    stage.read("{}");
  }
  LoneStage stage{*find_stage("render")};
};

// 6.3 D are 126 px between margins of 12 px. The highest disk ends at 0.6 + 4.8 + 0.01 + 0.5 = 5.91 D, 118.2 px above
// the floor's mean, below which a quarter of a diameter and the margin are left: 5 + 12 px.
TEST(RenderedBed, HasItsPlacesInPixels) {
  BedOfCamera bed(bed_of_camera(), {rows_of_five(), rows_of_five(0.05), rows_of_five(0.1)});
  RenderOptions options = plain_camera();
  options.frames = 2;
  render_frames(options, bed.stage);
  EXPECT_THAT(bed.stage.warnings, IsEmpty());
  const int width = 126 + 24, height = 119 + 17 + 12;
  const Json result = read_json(bed.stage.output("render.json"));
  EXPECT_EQ(result["frames"], 2);
  EXPECT_EQ(result["width"]["value"], width);
  EXPECT_EQ(result["height"]["value"], height);
  EXPECT_EQ(result["radius"]["value"], 10);
  EXPECT_EQ(result["scale"]["value"], 2e-4);
  const FrameGeometry geometry = FrameGeometry::read(bed.stage.output("geometry.json"));
  EXPECT_EQ(geometry.left_wall, 11.5);
  EXPECT_DOUBLE_EQ(geometry.right_wall, 137.5);
  EXPECT_EQ(geometry.floor, height - 0.5 - 17);
  EXPECT_EQ(geometry.lowest, 0) << "no centre lies below the floor's mean";
  EXPECT_EQ(geometry.width, width);
  EXPECT_EQ(geometry.height, height);
  EXPECT_FALSE(geometry.periodic);
  EXPECT_EQ(BedDescription::read(bed.stage.output("bed.json")).count, 25);
  const NumberTable truth(bed.stage.output("truth.csv"));
  ASSERT_EQ(truth.rows(), 50U);
  for (std::size_t r = 0; r < 50; ++r) {
    const TrajectoryFrame frame = rows_of_five(r < 25 ? 0 : 0.05);
    EXPECT_EQ(truth("frame", r), static_cast<double>(r / 25));
    EXPECT_EQ(truth("disk", r), static_cast<double>(r % 25));
    EXPECT_NEAR(truth("x_px", r), 11.5 + 20 * frame.x[r % 25], 1e-5);
    EXPECT_NEAR(truth("y_px", r), height - 17.5 - 20 * frame.z[r % 25], 1e-5);
    EXPECT_NEAR(truth("radius_px", r), 10, 1e-5);
  }
  const ingest::GrayFrame first = ingest::read_frame(bed.stage.output("frames") / "000000.png");
  EXPECT_EQ(first.width, width);
  EXPECT_EQ(first.height, height);
  EXPECT_NEAR(
      first.at(static_cast<int>(std::lround(truth("x_px", 7))), static_cast<int>(std::lround(truth("y_px", 7)))), 60,
      9);
  EXPECT_NEAR(first.at(2, 2), 200, 9);
  EXPECT_TRUE(std::filesystem::exists(bed.stage.output("frames") / "000001.png"));
  EXPECT_FALSE(std::filesystem::exists(bed.stage.output("frames") / "000002.png"));
}

TEST(RenderedBed, EndsWhereItsViewIsTold) {
  BedOfCamera bed(bed_of_camera(), {rows_of_five()});
  RenderOptions options = plain_camera();
  options.height = 0.01, options.margin = 5;  // 2.5 D are 50 px
  render_frames(options, bed.stage);
  const FrameGeometry geometry = FrameGeometry::read(bed.stage.output("geometry.json"));
  EXPECT_EQ(geometry.height, 50 + 5 + 5 + 5);
  EXPECT_EQ(geometry.left_wall, 4.5);
  EXPECT_EQ(geometry.floor, 65 - 0.5 - 10);
}

// It goes right and up at sqrt(g D) = 0.2 m/s, in the middle of the box.
TrajectoryFrame rising_disk(double height, double radius) {
  TrajectoryFrame frame;
  frame.width = 6.3;
  frame.x = {3.15}, frame.z = {height}, frame.vx = {1}, frame.vz = {1}, frame.spin = {0}, frame.radius = {radius};
  return frame;
}

// At 0.2 m/s sqrt(2) a disk moves by 298 px, the sum of the frame's sides, in 0.2107 s.
TEST(RenderedBed, HasNoStreaksLongerThanItsFrames) {
  BedOfCamera bed(bed_of_camera(), {rising_disk(4, 0.5)});
  RenderOptions options = plain_camera();
  options.exposure = 30;
  EXPECT_THAT([&] { render_frames(options, bed.stage); },
              ThrowsMessage<StageError>(HasSubstr("within the exposure time of 30 s a disk moves by 4.24e+04 px, "
                                                  "farther than the frame of 150 x ")));
  options.exposure = 0.1;
  EXPECT_NO_THROW(render_frames(options, bed.stage));
}

// A disk that goes right and up at sqrt(g D) = 0.2 m/s moves by 12 px each way in 12 ms: a streak from lower left to
// upper right, seen 7 px from its middle on that diagonal and not on the other.
TEST(RenderedBed, HasStreaksOfMovingDisks) {
  BedOfCamera bed(bed_of_camera(), {rising_disk(3, 0.3)});
  RenderOptions options = plain_camera();
  options.exposure = 0.012;
  render_frames(options, bed.stage);
  const ingest::GrayFrame streak = ingest::read_frame(bed.stage.output("frames") / "000000.png");
  const int x = static_cast<int>(std::lround(11.5 + 20 * 3.15)), y = static_cast<int>(streak.height - 17.5 - 20 * 3);
  EXPECT_LT(streak.at(x + 5, y - 5) + streak.at(x - 5, y + 5), 2 * 185);
  EXPECT_GT(streak.at(x + 5, y + 5) + streak.at(x - 5, y - 5), 2 * 190);
}

// Beads that stand out beyond the sides by half a diameter make the bed seem wider by 1 D of 7.3.
TEST(RenderedBed, SaysInItsPicturesWherePeriodicSidesAre) {
  BedDescription periodic = bed_of_camera();
  periodic.periodic = true;
  BedOfCamera bed(periodic, {rows_of_five()});
  render_frames(plain_camera(), bed.stage);
  ASSERT_EQ(bed.stage.warnings.size(), 1U);
  EXPECT_THAT(bed.stage.warnings[0], HasSubstr("the density up to 13.7 % too low"));
  EXPECT_THAT(bed.stage.warnings[0], HasSubstr("--left-wall 11.5 --right-wall 137.5"));
  const auto said = ingest::png_text(bed.stage.output("frames") / "000000.png", FrameGeometry::keyword);
  ASSERT_TRUE(said);
  EXPECT_EQ(said->text, "periodic sides at columns 11.5 and 137.5 of 150 x 148 px");
}

TEST(RenderedBed, IsRefusedWithItsReason) {
  const auto refusal = [](const BedDescription& bed, const std::vector<TrajectoryFrame>& frames,
                          const RenderOptions& options) {
    BedOfCamera of(bed, frames);
    try {
      render_frames(options, of.stage);
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  BedDescription bed = bed_of_camera();
  bed.gravity = 0;
  EXPECT_THAT(refusal(bed, {rows_of_five()}, plain_camera()), HasSubstr("the bed has no gravity"));
  bed.gravity = 10, bed.reduced = true;
  EXPECT_THAT(refusal(bed, {rows_of_five()}, plain_camera()), HasSubstr("the bed is in reduced units"));
  EXPECT_THAT(refusal(bed_of_camera(), {}, plain_camera()), HasSubstr("contains no frame"));
  RenderOptions fine = plain_camera();
  fine.scale = 4e-7;  // 63,024 px wide
  EXPECT_THAT(refusal(bed_of_camera(), {rows_of_five()}, fine), HasSubstr("frames of 63024 x "));
}

// --- extract

// Frames of the bed above, as a render stage leaves them.
class RenderedFrames {
 public:
  explicit RenderedFrames(const BedDescription& bed, std::size_t count = 3) {
    std::vector<TrajectoryFrame> frames;
    for (std::size_t k = 0; k < count; ++k) frames.push_back(rows_of_five(0.02 * static_cast<double>(k)));
    BedOfCamera camera(bed, frames);
    render_frames(plain_camera(), camera.stage);
    stage.add_input("pictures", *find_stage("render"), "r");
    std::filesystem::copy(camera.stage.output_directory(), stage.file("r"), std::filesystem::copy_options::recursive);
    options.diameter = 0.004, options.overlays = 0;
    stage.read(R"({ "diameter": "4 mm" })");
  }
  Json extracted() {
    extract_disks(options, stage);
    return read_json(stage.output("extract.json"));
  }
  LoneStage stage{*find_stage("extract")};
  ExtractOptions options;
};

TEST(ExtractedFrames, HaveTheGeometryOfTheirCamera) {
  RenderedFrames frames(bed_of_camera());
  const Json found = frames.extracted();
  EXPECT_EQ(found["frames"], 3);
  EXPECT_EQ(found["frames_used"], 3);
  EXPECT_EQ(found["disks_per_frame"]["value"], 25);
  EXPECT_EQ(found["scale_given"], true);
  EXPECT_EQ(found["scale"]["value"], 2e-4);
  EXPECT_EQ(found["floor_given"], true);
  EXPECT_EQ(found["floor"]["value"], 130.5);
  EXPECT_EQ(found["left_wall"]["value"], 11.5);
  EXPECT_EQ(found["right_wall"]["value"], 137.5);
  EXPECT_DOUBLE_EQ(found["width"]["value"].get<double>(), 6.3);
  EXPECT_EQ(found["pixel_aspect"]["value"], 1);
  EXPECT_EQ(found["lens"]["value"], 0);
  EXPECT_NEAR(found["radius"]["value"].get<double>(), 10, 0.05);
  EXPECT_EQ(found["truth"]["recall"], 1);
  EXPECT_EQ(found["truth"]["precision"], 1);
  EXPECT_LT(found["truth"]["center_rms_error"]["value"].get<double>(), 0.1);
  EXPECT_EQ(found["cut_disks"], 0);
  EXPECT_FALSE(found.contains("velocities"));
  EXPECT_FALSE(found.contains("objections")) << found["objections"];
  // Heights at multiples of the spacing, from where the kernel of a centre at 0 begins.
  const NumberTable profile(frames.stage.output("profile.csv"));
  const double spacing = frames.options.spacing;
  for (std::size_t r = 0; r < profile.rows(); ++r)
    EXPECT_NEAR(std::remainder(profile("height", r), spacing), 0, 1e-9) << profile("height", r);
  EXPECT_EQ(BedDescription::read(frames.stage.output("bed.json")).amplitude, 0.001) << "the bed of the simulation";
  for (const char* file : {"quality.svg", "bead.png", "count.svg", "bead.csv", "quality.csv", "frames.csv"})
    EXPECT_TRUE(std::filesystem::exists(frames.stage.output(file))) << file;
  EXPECT_FALSE(std::filesystem::exists(frames.stage.output("film.json")));
}

TEST(ExtractedFrames, OfOneHaveNoCourseOfTime) {
  RenderedFrames frames(bed_of_camera(), 1);
  EXPECT_EQ(frames.extracted()["frames"], 1);
  EXPECT_FALSE(std::filesystem::exists(frames.stage.output("count.svg")));
  EXPECT_TRUE(std::filesystem::exists(frames.stage.output("bead.png")));
}

TEST(ExtractedFrames, TakeWhatIsGivenBeforeTheGeometry) {
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.scale = 2.02e-4, frames.options.floor = 128, frames.options.left_wall = 12.5;
  frames.options.right_wall = 136.5, frames.options.lowest = 0.25;
  const Json found = frames.extracted();
  EXPECT_EQ(found["scale"]["value"], 2.02e-4);
  EXPECT_EQ(found["floor"]["value"], 128);
  EXPECT_EQ(found["left_wall"]["value"], 12.5);
  EXPECT_NEAR(found["width"]["value"].get<double>(), 124 * 2.02e-4 / 0.004, 1e-9);
}

TEST(ExtractedFrames, AreComparedWithTheNumberOfTheirBeads) {
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.bead_number = 25;
  frames.extracted();
  EXPECT_THAT(frames.stage.warnings, Not(Contains(HasSubstr("bead_number"))));
  frames.options.bead_number = 26;
  frames.extracted();
  EXPECT_THAT(frames.stage.warnings, Contains(HasSubstr("On average 25.00 beads were found, but bead_number is 26")));
  frames.options.bead_number = 40;
  EXPECT_THAT([&] { frames.extracted(); },
              ThrowsMessage<StageError>(HasSubstr("but bead_number is 40. Other objects")));
}

TEST(ExtractedFrames, HaveBeadsAtTheHeightsOfTheProfile) {
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.lowest = 6.5;  // the highest bead is at 5.4 D, and a profile ends 1 D above it
  EXPECT_THAT([&] { frames.extracted(); },
              ThrowsMessage<std::invalid_argument>(
                  HasSubstr("the profile holds no height: its lowest is 6.5 D, and its highest 6.4")));
}

// A bed of 6.4 D.
TEST(ExtractedFrames, HaveNoMoreHeightsThanCovariancesAllow) {
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.spacing = 0.001;
  EXPECT_THAT([&] { frames.extracted(); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("choose a larger spacing, or lower its highest height")));
  frames.options.lowest = 0, frames.options.highest = 4.9;
  EXPECT_NO_THROW(frames.extracted());
}

TEST(ExtractedFrames, HaveBeadsOfARadiusThatFits) {
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.radius = 80;
  EXPECT_THAT([&] { frames.extracted(); },
              ThrowsMessage<StageError>(HasSubstr("by the radius or the scale given, a bead is 160 px wide, but the "
                                                  "frame has 150 x 148 px")));
  frames.options.radius.reset();
  for (const double second : {0.03, 0.0003}) {  // 150 px and 1.5 px wide
    frames.options.second_diameter = second;
    frames.stage.warnings.clear();
    frames.extracted();
    EXPECT_THAT(frames.stage.warnings,
                Contains(HasSubstr("No beads of the second diameter were found: they would be")));
  }
}

TEST(ExtractedFrames, KnowThatTheirSidesArePeriodic) {
  BedDescription bed = bed_of_camera();
  bed.periodic = true;
  RenderedFrames frames(bed, 1);
  frames.options.use_geometry = false;
  const Json found = frames.extracted();
  EXPECT_EQ(found["left_wall"]["value"], 11.5) << "no bead stops there: they cannot be found";
  EXPECT_EQ(found["right_wall"]["value"], 137.5);
  EXPECT_EQ(found["scale_given"], false);
  EXPECT_TRUE(BedDescription::read(frames.stage.output("bed.json")).periodic);
}

TEST(ExtractedFrames, AreAFilmForThePage) {
  RenderedFrames frames(bed_of_camera());
  frames.options.overlays = 1, frames.options.frame_rate = 500;
  const Json found = frames.extracted();
  const Json film = read_json(frames.stage.output("film.json"));
  EXPECT_EQ(film["kind"], "webp");
  EXPECT_EQ(film["width"], 150);
  EXPECT_EQ(film["height"], 148);
  EXPECT_EQ(film["picture_width"], 150);
  EXPECT_EQ(film["every"], 1);
  EXPECT_EQ(film["of"], 3);
  EXPECT_EQ(film["floor"], 130.5);
  EXPECT_EQ(film["rate"], 500);
  EXPECT_EQ(film["frames"], (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(film["pictures"].size(), 3U);
  ASSERT_EQ(film["marks"].size(), 3U);
  EXPECT_TRUE(film["marks"][1]["missed"].empty() && film["marks"][1]["false"].empty());
  EXPECT_TRUE(found.contains("velocities"));
  EXPECT_THAT(frames.stage.warnings, Contains(HasSubstr("No frequency of the shaking was found")));
  // The first good frame is drawn, twice as large, and what the model leaves of it is grey.
  const ingest::GrayFrame overlay = ingest::read_frame(frames.stage.output("overlay_000000.png"));
  EXPECT_EQ(overlay.width, 300);
  EXPECT_EQ(overlay.height, 296);
  const ingest::GrayFrame residual = ingest::read_frame(frames.stage.output("residual_000000.png"));
  double sum = 0;
  for (const float level : residual.pixels) sum += static_cast<double>(level);
  EXPECT_NEAR(sum / static_cast<double>(residual.pixels.size()), 128, 1);
  EXPECT_TRUE(std::filesystem::exists(frames.stage.output("residual.webp")));
}

// A disk of the truth that is in no picture, to tenths of a pixel, and one found that is not in the truth.
TEST(ExtractedFrames, MarkWhatIsMissedAndWhatIsNone) {
  RenderedFrames frames(bed_of_camera(), 2);
  const std::string truth = read_text(frames.stage.file("r/truth.csv"));
  const std::size_t last = truth.rfind("\n1,24,");
  ASSERT_NE(last, std::string::npos);
  write_text(frames.stage.file("r/truth.csv"), truth.substr(0, last) + "\n1,24,75.123,16.46,10\n");
  frames.options.overlays = 1;
  const Json found = frames.extracted();
  EXPECT_DOUBLE_EQ(found["truth"]["recall"].get<double>(), 49.0 / 50);
  const Json marks = read_json(frames.stage.output("film.json"))["marks"];
  EXPECT_TRUE(marks[0]["missed"].empty() && marks[0]["false"].empty());
  EXPECT_EQ(marks[1]["missed"], Json::parse("[75.1, 16.5]"));
  ASSERT_EQ(marks[1]["false"].size(), 1U);
  // The disk that is none lies where the last one was.
  const NumberTable disks(frames.stage.output("disks.csv"));
  std::size_t first = 0;
  while (disks("frame", first) < 1) ++first;
  const std::size_t wrong = first + marks[1]["false"][0].get<std::size_t>();
  const TrajectoryFrame frame = rows_of_five(0.02);
  EXPECT_NEAR(disks("x_px", wrong), 11.5 + 20 * frame.x[24], 0.3);
  EXPECT_NEAR(disks("y_px", wrong), 130.5 - 20 * frame.z[24], 0.3);
}

// A photograph of 25 beads of 20 px that touch, on a floor.
class ExtractedPhotograph {
 public:
  ExtractedPhotograph() {
    write_text(stage.file("a.pgm"),
               PaintedPicture(150, 130).disks(lattice(10, 5, 20, 122, 118, 0.02), 10, 60).blur(0.7).noise(2).pgm());
    stage.read(R"({ "images": ")" + stage.file("a.pgm").string() + R"(", "diameter": "4 mm" })");
    options.images.texts = {stage.file("a.pgm").string()};
    options.images.paths = {stage.file("a.pgm").string()};
    options.diameter = 0.004, options.overlays = 0;
  }
  Json extracted() {
    extract_disks(options, stage);
    return read_json(stage.output("extract.json"));
  }
  LoneStage stage{*find_stage("extract")};
  ExtractOptions options;
};
std::vector<std::string> reasons_of(const Json& found) {
  std::vector<std::string> reasons;
  if (found.contains("objections"))
    for (const Json& one : found["objections"]) reasons.push_back(one["why"].get<std::string>());
  return reasons;
}

TEST(ExtractedPhotographs, ObjectToAScaleThatContradictsTheDiameter) {
  ExtractedPhotograph plain, scaled, nearly;
  const std::vector<std::string> usual = reasons_of(plain.extracted());
  EXPECT_THAT(usual, Not(Contains(HasSubstr("By the scale"))));
  EXPECT_THAT(plain.stage.warnings, Not(Contains(HasSubstr("frame rate")))) << "it is no film";
  scaled.options.scale = 2e-4 * 1.13;  // 17.7 px
  EXPECT_THAT(reasons_of(scaled.extracted()),
              Contains(HasSubstr("By the scale and the diameter given, a bead is 17.7 px wide")));
  nearly.options.scale = 2e-4 * 1.08;
  EXPECT_THAT(reasons_of(nearly.extracted()), Not(Contains(HasSubstr("By the scale"))));
}

TEST(ExtractedPhotographs, ObjectToASecondDiameterThatIsNotSeen) {
  ExtractedPhotograph with;
  with.options.second_diameter = 0.0032;
  const Json found = with.extracted();
  EXPECT_THAT(reasons_of(found), Contains(HasSubstr("every length may be wrong by up to 25 %")));
  EXPECT_THAT(found["objections"].dump(), HasSubstr("give the radius of the first kind (--radius)"));
}

// Of a film of pictures the first says where the sides are, here that they are not where they were.
TEST(ExtractedPhotographs, TakeTheirSidesFromTheFirst) {
  for (const bool first : {true, false}) {
    ExtractedPhotograph film;
    const std::vector<std::string> names = {film.stage.file("a.png").string(), film.stage.file("b.png").string()};
    for (const std::string& name : names)
      ingest::write_png(name, {.width = 12, .height = 10, .pixels = std::vector<float>(120, 90.0F)});
    ingest::add_png_text(names[first ? 0 : 1], FrameGeometry::keyword,
                         "periodic sides at columns 11.5 and 137.5 of 150 x 148 px");
    film.options.images.texts = film.options.images.paths = names;
    EXPECT_THROW(film.extracted(), StageError) << "no beads";
    const auto cut =
        HasSubstr("a.png: this is a simulated bed with periodic sides, in a picture that was cut or scaled");
    EXPECT_THAT(film.stage.warnings, first ? testing::Matcher<std::vector<std::string>>(Contains(cut))
                                           : testing::Matcher<std::vector<std::string>>(IsEmpty()));
  }
}

TEST(ExtractedPhotographs, AreThoseThatAreNamed) {
  ExtractedPhotograph named;
  named.options.images.paths.push_back(named.stage.file("notes.txt").string());
  write_text(named.stage.file("notes.txt"), "no picture");
  EXPECT_EQ(named.extracted()["frames"], 1) << "a folder may hold other files";
  named.options.images.paths = {named.stage.file("notes.txt").string()};
  named.options.images.texts = {"photos", "more"};
  try {
    named.extracted();
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith("photos: no picture or film was found"));
  }
}

template <class Photograph>
std::string refusal_of(Photograph& photograph) {
  try {
    photograph.extracted();
  } catch (const StageError& error) {
    return error.what();
  }
  return "none";
}

// Of a radius of 10 px 3 px are left by squares of 3 px, not by those of 4.
TEST(ExtractedPhotographs, AreReducedToThreePixelsAtMost) {
  ExtractedPhotograph photograph;
  photograph.options.radius = 10, photograph.options.reduction = 4;
  EXPECT_THAT(
      refusal_of(photograph),
      testing::MatchesRegex(".*a.pgm: averaged over squares of 4 px \\(reduction\\), a bead of (9.[6-9][0-9]*|10|"
                            "10.[0-4][0-9]*) px radius is left with 2.[45][0-9]* px; 3 px are needed. Give at most 3"));
  RenderedFrames frames(bed_of_camera(), 1);
  frames.options.reduction = 4;
  EXPECT_EQ(refusal_of(frames), frames.stage.file("r").string() +
                                    ": averaged over squares of 4 px (reduction), a bead of 10 px radius is left with "
                                    "2.5 px; 3 px are needed. Give at most 3");
  frames.options.reduction = 3;
  EXPECT_EQ(refusal_of(frames), "none");
}

// Circles below lines on even paper are those of a drawing: they are measured where any shape is asked for.
TEST(ExtractedPhotographs, OfADrawingAreMeasuredOnDemand) {
  ExtractedPhotograph drawn;
  PaintedPicture plot(150, 190);
  for (int row = 5; row <= 55; row += 10) plot.box(0, row, 150, 1, 0);
  write_text(drawn.stage.file("a.pgm"), plot.disks(lattice(10, 5, 20, 122, 178, 0.02), 10, 60).pgm());
  drawn.options.shape = BeadShape::any;
  EXPECT_EQ(drawn.extracted()["frames_used"], 1);
  EXPECT_THAT(drawn.stage.warnings,
              Contains(drawn.stage.file("a.pgm").string() +
                       ": areas of one grey level without noise are seen, as in a drawing, and the circles are only "
                       "a small part of it. The circles are measured because shape is \"any\"."));
}

TEST(ExtractedPhotographs, ObjectToTwoDiameters) {
  ExtractedPhotograph both;
  write_text(both.stage.file("a.pgm"), PaintedPicture(250, 130)
                                           .disks(lattice(10, 5, 20, 122, 118, 0.02), 10, 60)
                                           .disks(lattice(7, 6, 130, 232, 118, 0.02), 7, 60)
                                           .blur(0.7)
                                           .noise(2)
                                           .pgm());
  both.options.second_diameter = 0.0028, both.options.radius = 10;
  EXPECT_THAT(reasons_of(both.extracted()),
              Contains("The bed contains beads of two diameters, but the theory describes equal disks."));
}

// The number of beads is known after the measurement only: what was tried then is said, with a page that shows it.
TEST(ExtractedPhotographs, AreRefusedAfterTheirMeasurementWithAdvice) {
  ExtractedPhotograph photograph;
  photograph.options.bead_number = 100;
  const std::string said = refusal_of(photograph), count = std::to_string(lattice(10, 5, 20, 122, 118, 0.02).size());
  EXPECT_THAT(said, HasSubstr("bead_number is 100"));
  EXPECT_THAT(said, HasSubstr("instead of --bead-number give --bead-number " + count + " (tried: " + count +
                              " dark beads of "));
  const std::size_t see = said.find(". See "), end = said.find("preview.html. If a picture of preview.html marks");
  ASSERT_TRUE(see != std::string::npos && end != std::string::npos) << said;
  const std::string page = read_text(said.substr(see + 6, end - see - 6) + "preview.html");
  EXPECT_THAT(page, HasSubstr("<h2>1. Tried: " + count + " dark beads of "));
}

// The first five bad frames are named, the others counted.
TEST(ExtractedPhotographs, NameTheFirstOfManyBadFrames) {
  ExtractedPhotograph film;
  const std::string good = film.stage.file("a.pgm").string();
  std::vector<std::string> names{good};
  for (int k = 1; k <= 7; ++k) {
    names.push_back(film.stage.file("bad" + std::to_string(k) + ".pgm").string());
    write_text(names.back(), "no picture");
  }
  film.options.images.texts = film.options.images.paths = names;
  EXPECT_EQ(film.extracted()["frames_used"], 1);
  for (int k = 1; k <= 7; ++k) {
    const auto named =
        Contains(testing::StartsWith("frame " + std::to_string(k) + " (bad" + std::to_string(k) + ".pgm): "));
    if (k <= 5)
      EXPECT_THAT(film.stage.warnings, named);
    else
      EXPECT_THAT(film.stage.warnings, Not(named));
  }
  EXPECT_THAT(film.stage.warnings, Contains("2 more frames could not be used; frames.csv lists them"));
}

// Frames of 4, 0 and 2 disks and 1, 0 and 0 places rejected: a third of 560 px each, 4 being 200 px.
TEST(CountFigure, HasAPointAFrame) {
  std::vector<ingest::FrameReport> frames(3);
  frames[0].disks = 4, frames[2].disks = 2, frames[0].rejected = 1;
  const std::string figure = count_figure(frames);
  EXPECT_THAT(figure, HasSubstr("stroke=\"#1f6fb4\" points=\"153.3,20.0 340.0,220.0 526.7,120.0 \""));
  EXPECT_THAT(figure, HasSubstr("stroke=\"#e08214\" points=\"153.3,170.0 340.0,220.0 526.7,220.0 \""));
  EXPECT_THAT(figure, HasSubstr(">4</text>"));
  EXPECT_THAT(figure, HasSubstr("frame 0 to 2: "));
  EXPECT_THAT(count_figure({}), HasSubstr("frame 0 to 0: "));
}

TEST(FramesThatAreShown, AreReducedNoMoreThanTheSearch) {
  FilmFiles film;
  film.source.reduction = 4;
  EXPECT_EQ(film.reduction_shown(0.2), 1);
  EXPECT_EQ(film.reduction_shown(1), 1);
  EXPECT_EQ(film.reduction_shown(1.01), 2);
  EXPECT_EQ(film.reduction_shown(4), 4);
  EXPECT_EQ(film.reduction_shown(9), 4);
}

}  // namespace
