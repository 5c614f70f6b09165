// Each message about a picture, followed literally, leads to success on the picture that caused it. The words of the
// message are taken apart as a user does: "give ...", "leave out ...", "instead of ... give ...".
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/painted_picture.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::Json;
using shakebed::pipelines::read_json;
using testing::HasSubstr;
using testing::Not;
namespace fs = std::filesystem;
using Words = std::vector<std::string>;

constexpr int width = 220, height = 180;

std::vector<Place> bed(double left = 10, double right = 210, double floor = 170) {
  return lattice(10, 5, left, right, floor, 0.15);
}
PaintedPicture beads_of(double bead, double background) {
  return PaintedPicture(width, height, background).disks(bed(), 10, bead).noise(3);
}
std::string dark_beads() { return beads_of(60, 200).pgm(); }

// Beads that are brighter than what is behind them in red, and darker in green and blue.
std::string red_beads() {
  const auto plane = [](double level, unsigned seed) {
    return PaintedPicture(width, height, 180).disks(bed(), 10, level).noise(3, seed);
  };
  return PaintedPicture::ppm(plane(225, 1), plane(60, 2), plane(60, 3));
}

// A page with lines of text as bars, a table, and a photograph of beads.
std::string page() {
  PaintedPicture paper(420, 400, 255);
  for (int k = 0; k < 6; ++k) paper.box(10, 8 + 5 * k, 400, 1, 0).box(10, 250 + 24 * k, 400, 1, 0);
  for (int k = 0; k < 5; ++k) paper.box(10 + 100 * k, 250, 1, 121, 0);
  return paper.put(beads_of(60, 200), 100, 45).pgm();
}

// Beads in a window of a striped wall.
std::vector<Place> beads_in_window() { return lattice(10, 4, 260, 400, 430, 0.15); }
std::string stripes() {
  PaintedPicture wall(700, 560, 130);
  for (int y = 0; y < 560; ++y)
    for (int x = 0; x < 700; ++x) wall.at(x, y) += (x * 3 + y * 5) / 17 % 2 == 0 ? 40 : 0;
  wall.box(240, 330, 180, 120, 200).disks(beads_in_window(), 10, 50);
  return wall.noise(3).pgm();
}

// Each turned another way.
std::string ovals() {
  PaintedPicture picture(270, 210);
  for (int column = 0; column < 7; ++column)
    for (int row = 0; row < 5; ++row) {
      const double turn = 0.7 * column + 1.9 * row, a = 14.8, b = 11.4, at_x = 34 + 34 * column, at_y = 36 + 34 * row;
      picture.paint(
          [&](double x, double y) {
            const double u = x - at_x, v = y - at_y, along = (u * std::cos(turn) + v * std::sin(turn)) / a,
                         across = (v * std::cos(turn) - u * std::sin(turn)) / b;
            return 0.5 - (std::hypot(along, across) - 1) * b;
          },
          50);
    }
  return picture.noise(2).pgm();
}

// Bright in the middle, hardly brighter than the background at the rim.
std::string bright_cores() {
  const auto places = lattice(10, 7, 10, 210, 170, 0);
  return PaintedPicture(width, height, 70).disks(places, 10, 85).disks(places, 7.5, 220).noise(3).pgm();
}

std::string specks() {
  return PaintedPicture(200, 160).disks(lattice(3, 12, 10, 190, 150, 0.15), 3, 60).noise(3).pgm();
}

std::string holes() {
  std::vector<Place> places;
  for (int column = 0; column < 9; ++column)
    for (int row = 0; row < 9; ++row)
      places.push_back({32.0 + 33 * column + (column * 7 + row * 3) % 3, 30.0 + 33 * row + (column + row * 5) % 3});
  return PaintedPicture(330, 330).disks(places, 10, 60).noise(3).pgm();
}

std::string out_of_focus() {
  return PaintedPicture(300, 240).disks(lattice(6, 15, 10, 290, 230, 0), 6, 60).blur(2.2).noise(10).pgm();
}

std::string lit_from_one_side() {
  PaintedPicture picture(width, height, 40);
  for (const Place& place : bed())
    picture.paint(
        [&](double x, double y) {
          const double light = std::clamp((place.x - x + place.y - y) / 14, 0.0, 1.0);
          return light * std::clamp(10.5 - std::hypot(x - place.x, y - place.y), 0.0, 1.0);
        },
        210);
  return picture.noise(3).pgm();
}

// Between the nearest of beads that are believed by their faces, and of those that are not, in diameters.
constexpr double close = 0.02, far_apart = 0.3;
std::vector<Place> beads_under_lamp(double gap) { return lattice(20, 10, 20, 620, 500, gap); }
// Spheres under a lamp so many radians high, whose dark side is a little brighter than the background.
std::string under_a_low_lamp(double gap, double dark, double lamp) {
  PaintedPicture picture(640, 520, 40);
  picture.disks(beads_under_lamp(gap), 20, dark);
  const double low = std::cos(lamp), high = std::sin(lamp);
  for (const Place& place : beads_under_lamp(gap))
    picture.paint(
        [&](double x, double y) {
          const double u = (x - place.x) / 20, v = (y - place.y) / 20, square = u * u + v * v;
          const double light = low * (-0.6 * u - 0.8 * v) + high * std::sqrt(std::max(0.0, 1 - square));
          return std::clamp(light, 0.0, 1.0) * std::clamp(20.5 - 20 * std::sqrt(square), 0.0, 1.0);
        },
        210);
  return picture.blur(0.9).noise(3).pgm();
}

std::string nothing() { return PaintedPicture(width, height, 128).noise(3).pgm(); }

// Words as a shell takes them apart, double quotes alone.
Words split(const std::string& text) {
  Words words;
  std::string word;
  bool quoted = false;
  for (const char c : text + " ") {
    const bool space = c == ' ' || c == '\n';
    if (c == '"')
      quoted = !quoted;
    else if (!space || quoted)
      word += c;
    else if (!word.empty())
      words.push_back(std::move(word)), word.clear();
  }
  return words;
}

Words without(Words arguments, const std::string& option) {
  const auto at = std::find(arguments.begin(), arguments.end(), option);
  if (at != arguments.end()) arguments.erase(at, at + 2);
  return arguments;
}

struct Advice {
  std::string words;
  Words arguments;  // that follow from it
};

// Every advice of a message that ends with "(tried: ...)", applied to the arguments that caused it.
std::vector<Advice> advice_in(const std::string& message, const Words& arguments) {
  std::vector<Advice> all;
  const std::size_t begin = message.find("If a picture of preview.html marks your beads, ");
  if (begin == std::string::npos) return all;
  std::istringstream rest(message.substr(begin));
  for (std::string one; std::getline(rest, one, ';');) {
    const std::size_t end = one.find(" (tried: ");
    if (end == std::string::npos) continue;
    one.resize(end);
    Advice advice{one, arguments};
    const std::size_t leave = one.find("leave out "), instead = one.find("instead of "), give = one.find("give ");
    for (const std::string& option : split(leave != std::string::npos     ? one.substr(leave)
                                           : instead != std::string::npos ? one.substr(instead, give - instead)
                                                                          : ""))
      if (option.starts_with("--")) advice.arguments = without(advice.arguments, option);
    if (give != std::string::npos)
      for (const std::string& word : split(one.substr(give + 5))) advice.arguments.push_back(word);
    all.push_back(std::move(advice));
  }
  return all;
}

class Runner {
 public:
  // "PICTURE", the bytes of a picture, is given to the program as photo.pgm.
  explicit Runner(const std::string& picture) { write_text(folder_ / "photo.pgm", picture); }
  Words arguments(const Words& options) const {
    Words all{"fit-images", "photo.pgm", "--diameter", "3 mm"};
    all.insert(all.end(), options.begin(), options.end());
    return all;
  }
  ProgramResult run(Words arguments) {
    out_ = "out" + std::to_string(++runs_);
    arguments.insert(arguments.end(), {"--out", out_});
    return run_shakebed(arguments, folder_.path());
  }
  // Of the last run.
  double beads() const {
    const Json number = read_json(folder_ / (out_ + "/extract/extract.json"))["disks_per_frame"];
    return (number.is_object() ? number["value"] : number).get<double>();
  }
  std::string answer() const { return read_json(folder_ / (out_ + "/fit/fit.json"))["answer"].dump(); }
  const ScratchFolder& folder() const { return folder_; }
  fs::path out() const { return folder_ / out_; }

 private:
  ScratchFolder folder_;
  std::string out_;
  int runs_ = 0;
};

struct Refusal {
  const char* name;
  std::string (*picture)();
  Words options;
  const char* message;
  double beads;
  double off;          // of this number, by which it may be off
  std::size_t advice;  // how many are given, at least
};

void expect_followed(const Refusal& refusal) {
  SCOPED_TRACE(refusal.name);
  Runner runner(refusal.picture());
  const Words arguments = runner.arguments(refusal.options);
  const ProgramResult refused = runner.run(arguments);
  ASSERT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr(refusal.message));
  const std::vector<Advice> all = advice_in(refused.err, arguments);
  ASSERT_GE(all.size(), refusal.advice) << refused.err;
  const std::string page = read_text(runner.out() / "no-beads/preview.html");
  for (const Advice& advice : all) {
    SCOPED_TRACE(advice.words);
    const ProgramResult followed = runner.run(advice.arguments);
    ASSERT_EQ(followed.exit_code, 0) << followed.err;
    EXPECT_NEAR(runner.beads(), refusal.beads, refusal.off);
  }
  // The page shows as many commands.
  std::size_t commands = 0;
  for (std::size_t at = 0; (at = page.find("<pre>shakebed fit-images", at)) != std::string::npos; ++at) ++commands;
  EXPECT_EQ(commands, all.size());
}

const auto number_of_beads = [] { return static_cast<double>(bed().size()); };

TEST(FollowedAdvice, LeadsToTheBeads) {
  expect_followed({"another polarity", dark_beads, {"--polarity", "bright"}, "no beads", number_of_beads(), 0, 1});
}

// The nearest of these centres are up to 0.02 diameters farther apart than beads that touch, which they are taken for.
TEST(FollowedAdvice, IsNotNeededUnderALowLampWhereBeadsTouch) {
  Runner runner(under_a_low_lamp(close, 73, 0.7));
  const ProgramResult result = runner.run(runner.arguments({}));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(runner.beads(), static_cast<double>(beads_under_lamp(close).size()));
  const Json scale = read_json(runner.out() / "extract/extract.json")["scale"];
  EXPECT_EQ(scale["unit"], "m/px");
  EXPECT_NEAR(3e-3 / scale["value"].get<double>(), 40, 0.02 * 40);
}

TEST(FollowedAdvice, IsNotNeededUnderALowLampWhereBeadsLieApart) {
  for (const double lamp : {0.5, 0.2}) {
    Runner runner(under_a_low_lamp(far_apart, 55, lamp));
    const ProgramResult result = runner.run(runner.arguments({}));
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(runner.beads(), static_cast<double>(beads_under_lamp(far_apart).size()));
    EXPECT_NEAR(3e-3 / read_json(runner.out() / "extract/extract.json")["scale"]["value"].get<double>(), 40, 0.02 * 40);
  }
}

TEST(FollowedAdvice, LeadsToTheBeadsFromEveryRefusal) {
  const double beads = number_of_beads();
  const std::vector<Refusal> refusals{
      {"another radius", dark_beads, {"--radius", "30"}, "no beads", beads, 0, 1},
      {"a small radius", dark_beads, {"--radius", "4"}, "no beads", beads, 0, 1},
      {"both", dark_beads, {"--radius", "30", "--polarity", "bright"}, "no beads", beads, 0, 1},
      {"polarity of another channel", red_beads, {"--channel", "red", "--polarity", "dark"}, "no beads", beads, 0, 1},
      {"a region without beads", dark_beads, {"--roi", "0,0,60,40"}, "no beads", beads, 0, 1},
      {"a scale of another unit", dark_beads, {"--scale", "0.15 m/px"}, "Check the unit of scale", beads, 0, 1},
      {"another number", dark_beads, {"--bead-number", "20"}, "bead_number is 20", beads, 0, 1},
      {"a page", page, {}, "straight ruled lines", beads, 0, 2},
      {"other edges", stripes, {}, "of the edges in the picture", static_cast<double>(beads_in_window().size()), 0, 1},
      {"ovals", ovals, {}, "the outlines are not round", 35, 1, 1},
      {"specks", specks, {}, "photograph them at least 24 px wide", 306, 6, 1},
      {"a part of the bead", bright_cores, {"--radius", "10"}, "within 25 % of the given", 67, 1, 1},
      {"holes", holes, {}, "Hardly any of the 81 disks found touch", 81, 0, 2},
  };
  for (const Refusal& refusal : refusals) expect_followed(refusal);
}

// Words without an option that was tried: what is left to give, and then what a photograph must be like.
TEST(FollowedAdvice, IsNoOptionWhereThereAreNoBeads) {
  Runner runner(nothing());
  const ProgramResult refused = runner.run(runner.arguments({}));
  ASSERT_EQ(refused.exit_code, 5);
  EXPECT_THAT(refused.err, HasSubstr("No option that was tried leads to beads"));
  EXPECT_THAT(refused.err, HasSubstr("give the region of the beads (--roi) and their radius in pixels (--radius)"));
  const ProgramResult again = runner.run(runner.arguments({"--roi", "5,5,210,170", "--radius", "10"}));
  ASSERT_EQ(again.exit_code, 5);
  EXPECT_THAT(again.err, Not(HasSubstr("--r"))) << "what was given is not asked for again";
  EXPECT_THAT(again.err, HasSubstr("The region and the radius given do not help"));
}

TEST(FollowedAdvice, ToGiveTheRadiusLeadsToBeadsOutOfFocus) {
  Runner runner(out_of_focus());
  const ProgramResult refused = runner.run(runner.arguments({}));
  ASSERT_EQ(refused.exit_code, 5);
  EXPECT_THAT(refused.err, HasSubstr("their radius in pixels (--radius)"));
  const ProgramResult followed = runner.run(runner.arguments({"--roi", "5,5,290,230", "--radius", "6"}));
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_NEAR(runner.beads(), static_cast<double>(lattice(6, 15, 10, 290, 230, 0).size()), 4);
}

// No option helps; another light does.
TEST(FollowedAdvice, ToLightTheWholeRimLeadsToTheBeads) {
  Runner runner(lit_from_one_side());
  for (const Words& options : {Words{}, Words{"--roi", "5,5,210,170", "--radius", "10"}}) {
    const ProgramResult refused = runner.run(runner.arguments(options));
    ASSERT_EQ(refused.exit_code, 5);
    EXPECT_THAT(refused.err, HasSubstr("lit so that the whole rim of a bead is visible"));
  }
  write_text(runner.folder() / "photo.pgm", beads_of(210, 40).pgm());
  EXPECT_EQ(runner.run(runner.arguments({})).exit_code, 0);
  EXPECT_NEAR(runner.beads(), number_of_beads(), 0);
}

// Places outside the picture: to leave them out is one of the advices.
TEST(FollowedAdvice, OnPlacesOutsideThePictureIsToLeaveThemOut) {
  struct Outside {
    Words options;
    const char* message;
  };
  Runner runner(dark_beads());
  for (const Outside& outside :
       {Outside{{"--roi", "1000,900,50,50"}, "(--roi, \"roi\") lies outside the picture of 220 x 180 px"},
        Outside{{"--left-wall", "500", "--right-wall", "900"}, "which is 220 px wide"},
        Outside{{"--floor", "5000"}, "the picture has 180 rows"}}) {
    SCOPED_TRACE(outside.message);
    const ProgramResult refused = runner.run(runner.arguments(outside.options));
    EXPECT_EQ(refused.exit_code, 5);
    EXPECT_THAT(refused.err, HasSubstr(outside.message));
    EXPECT_THAT(refused.err, testing::ContainsRegex("leave .*out"));
  }
  EXPECT_EQ(runner.run(runner.arguments({})).exit_code, 0);
}

TEST(FollowedAdvice, OnAPictureWithoutBeadsBeforeOthersIsToLeaveItOut) {
  Runner runner(nothing());
  write_text(runner.folder() / "second.pgm", dark_beads());
  Words arguments{"fit-images", "photo.pgm", "second.pgm", "--diameter", "3 mm"};
  const ProgramResult refused = runner.run(arguments);
  ASSERT_EQ(refused.exit_code, 5);
  EXPECT_THAT(refused.err, HasSubstr("second.pgm shows " + std::to_string(bed().size()) +
                                     " beads: give --skip 1, which leaves out the picture before it"));
  arguments.insert(arguments.end(), {"--skip", "1"});
  EXPECT_EQ(runner.run(arguments).exit_code, 0);
  EXPECT_NEAR(runner.beads(), number_of_beads(), 0);
}

// A TIFF of 8-bit grey pages, uncompressed, from binary PGM files of the same size.
std::string stack_of(const std::vector<std::string>& pages) {
  std::string tiff;
  const auto put = [&tiff](unsigned value, int bytes) {
    for (int k = 0; k < bytes; ++k) tiff += static_cast<char>(value >> (8 * k) & 0xFFU);
  };
  constexpr unsigned entries = 9, directory_bytes = 2 + 12 * entries + 4, pixels = width * height;
  tiff = "II*";
  tiff += '\0';
  put(8, 4);
  for (std::size_t k = 0; k < pages.size(); ++k) {
    const auto begin = static_cast<unsigned>(tiff.size()) + directory_bytes;
    put(entries, 2);
    // Width, height, bits, no compression, black is 0, place of the pixels, components, rows, bytes.
    for (const auto& [tag, value] : {std::pair(256U, unsigned{width}),
                                     {257U, unsigned{height}},
                                     {258U, 8U},
                                     {259U, 1U},
                                     {262U, 1U},
                                     {273U, begin},
                                     {277U, 1U},
                                     {278U, unsigned{height}},
                                     {279U, pixels}})
      put(tag, 2), put(4, 2), put(1, 4), put(value, 4);
    put(k + 1 < pages.size() ? begin + pixels : 0, 4);
    tiff += pages[k].substr(pages[k].size() - pixels);
  }
  return tiff;
}

TEST(FollowedAdvice, OnAStackThatBeginsWithoutBeadsIsToSkipItsFirstPictures) {
  Runner runner(nothing());
  write_text(runner.folder() / "stack.tif", stack_of({nothing(), nothing(), dark_beads(), dark_beads()}));
  Words arguments{"fit-images", "stack.tif", "--diameter", "3 mm"};
  const ProgramResult refused = runner.run(arguments);
  ASSERT_EQ(refused.exit_code, 5);
  EXPECT_THAT(refused.err, HasSubstr("Picture 3 of it shows " + std::to_string(bed().size()) +
                                     " beads: give --skip 2, which leaves out the pictures before it"));
  Words preview = arguments;
  preview.emplace_back("--preview");
  const ProgramResult seen = runner.run(preview);
  EXPECT_EQ(seen.exit_code, 5);
  EXPECT_THAT(seen.err, HasSubstr("give --skip 2, which"));
  arguments.insert(arguments.end(), {"--skip", "2"});
  preview.insert(preview.end(), {"--skip", "2"});
  EXPECT_EQ(runner.run(preview).exit_code, 0);
  EXPECT_EQ(runner.run(arguments).exit_code, 0);
  EXPECT_NEAR(runner.beads(), number_of_beads(), 0);
  arguments.back() = "4";
  const ProgramResult none = runner.run(arguments);
  EXPECT_EQ(none.exit_code, 5);
  EXPECT_THAT(none.err, HasSubstr("stack.tif: no frame is left, because skip leaves out 4 frames at the beginning"));
}

// A warning that proposes a scale: once it is given, neither the scale nor the diameter is doubted.
TEST(FollowedAdvice, ToGiveTheScaleOfTouchingBeadsEndsTheDoubt) {
  Runner runner(bright_cores());
  const Words arguments = runner.arguments({"--radius", "7.5"});
  const ProgramResult warned = runner.run(arguments);
  ASSERT_EQ(warned.exit_code, 0) << warned.err;
  const std::string words = "If neighbouring beads touch, give --scale \"";
  const std::size_t begin = warned.err.find(words);
  ASSERT_NE(begin, std::string::npos) << warned.err;
  const std::size_t from = begin + words.size(), to = warned.err.find('"', from);
  const std::string scale = warned.err.substr(from, to - from);
  EXPECT_NEAR(std::stod(scale), 3.0 / 20, 0.002) << "beads of 3 mm and 20 px";
  Words followed = arguments;
  followed.insert(followed.end(), {"--scale", scale});
  const ProgramResult result = runner.run(followed);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* doubt : {"give --scale", "Check the scale", "differs from the density"})
    EXPECT_THAT(result.err, Not(HasSubstr(doubt)));
  EXPECT_THAT(runner.answer(), Not(HasSubstr("scale")));
  // Another scale, which neither circles nor contacts confirm, is doubted.
  followed.back() = "0.12 mm/px";
  EXPECT_THAT(runner.run(followed).err, HasSubstr("Check the scale"));
}

TEST(FollowedAdvice, OnATruncatedPictureIsToCompleteIt) {
  const std::string whole = dark_beads();
  Runner runner(whole.substr(0, whole.size() / 3));
  const ProgramResult refused = runner.run(runner.arguments({}));
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.err, HasSubstr("photo.pgm: the picture cannot be read"));
  EXPECT_THAT(refused.err, HasSubstr("check that the file is complete"));
  write_text(runner.folder() / "photo.pgm", whole);
  EXPECT_EQ(runner.run(runner.arguments({})).exit_code, 0);
  EXPECT_NEAR(runner.beads(), number_of_beads(), 0);
}

TEST(FollowedAdvice, OnDisksLostInNoiseIsToRenderWithLess) {
  const ScratchFolder folder;
  write_text(folder / "bed.json", R"({ "name": "noisy", "stages": [
    { "stage": "simulate", "id": "bed", "seed": 3, "replicas": 1,
      "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.9 }, "gravity": "9.81 m/s^2",
      "box": { "width": "25 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.5 s", "measure": "0.5 s", "frames": { "count": 4 } },
    { "stage": "render", "from": "bed", "scale": "0.15 mm/px", "noise": 127 },
    { "stage": "extract", "from": "render", "diameter": "3 mm" }] })");
  const Words arguments{"run", "bed.json", "--out", "out"};
  const ProgramResult refused = run_shakebed(arguments, folder.path());
  ASSERT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("no disks in any of the first 4 frames"));
  EXPECT_THAT(refused.err, HasSubstr("Give the render stage less noise"));
  Words followed = arguments;
  followed.insert(followed.end(), {"--set", "/stages/1/noise=20"});
  const ProgramResult result = run_shakebed(followed, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NEAR(read_json(folder / "out/extract/extract.json")["truth"]["recall"].get<double>(), 1, 0.02);
}

// Beads at random heights, and their dimmer images below the floor.
std::vector<Place> loose_bed() {
  std::mt19937 random(5);
  const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
  std::vector<Place> places;
  while (places.size() < 90) {
    const Place one{10 + 300 * part(), 200 - 8 + 40 * std::log(1 - part())};
    if (std::none_of(places.begin(), places.end(), [&](const Place& other) {
          return one.y < 10 || std::hypot(one.x - other.x, one.y - other.y) < 16.5;
        }))
      places.push_back(one);
  }
  return places;
}
std::string polished_floor() {
  std::vector<Place> images;
  for (const Place& place : loose_bed())
    if (400 - place.y < 252) images.push_back({place.x, 400 - place.y});
  return PaintedPicture(320, 280).disks(loose_bed(), 8, 60).disks(images, 8, 120).noise(2).pgm();
}

// Few beads far beside the bed.
std::string beads_beside() {
  return PaintedPicture(520, 180).disks(bed(), 10, 60).disks({{400, 40}, {450, 110}}, 10, 60).noise(3).pgm();
}

// A round pan from above.
std::string pan() {
  std::mt19937 random(2);
  const auto across = [&] { return 400 * (static_cast<double>(random()) / 4294967296.0); };
  std::vector<Place> places;
  for (int tries = 0; tries < 20000; ++tries) {
    const double x = across(), y = across();
    if (std::hypot(x - 200, y - 200) < 170 && std::none_of(places.begin(), places.end(), [&](const Place& other) {
          return std::hypot(x - other.x, y - other.y) < 20;
        }))
      places.push_back({x, y});
  }
  return PaintedPicture(400, 400).disks(places, 10, 60).noise(3).pgm();
}

// An option named by a warning or by the answer: once it is given, this is not said again.
void expect_ends(const char* said, const std::string& picture, const char* option, const std::string& value,
                 double beads) {
  SCOPED_TRACE(said);
  Runner runner(picture);
  const ProgramResult warned = runner.run(runner.arguments({}));
  ASSERT_EQ(warned.exit_code, 0) << warned.err;
  const std::string words = warned.err + runner.answer();
  ASSERT_THAT(words, HasSubstr(said));
  const std::size_t begin = words.find(std::string("give ") + option + " ");
  const std::string named = value.empty() && begin != std::string::npos ? split(words.substr(begin)).at(2) : value;
  ASSERT_FALSE(named.empty()) << words;
  const ProgramResult followed =
      runner.run(runner.arguments({option, named.back() == '.' ? named.substr(0, named.size() - 1) : named}));
  ASSERT_EQ(followed.exit_code, 0) << followed.err;
  EXPECT_THAT(followed.err + runner.answer(), Not(HasSubstr(said)));
  EXPECT_NEAR(runner.beads(), beads, 1);
}

TEST(FollowedAdvice, OfAWarningEndsIt) {
  expect_ends("beside the bed, separated", beads_beside(), "--roi", "", number_of_beads());
  expect_ends("mirror those above row", polished_floor(), "--roi", "", static_cast<double>(loose_bed().size()));
  Runner runner(pan());
  runner.run(runner.arguments({}));
  expect_ends("the lowest disks lie on an arc", pan(), "--floor", "380", runner.beads());
}

TEST(FollowedAdvice, OnALowProfileIsToGiveMorePhotographs) {
  Runner runner(dark_beads());
  Words arguments{"infer-bed", "photo.pgm", "--diameter", "3 mm", "--frequency", "20 Hz", "--beds", "20"};
  for (const char* brief : {"rounds=0", "best=0", "settle=0.5 s", "measure=0.5 s"})
    arguments.insert(arguments.end(), {"--set", std::string("/stages/infer/") + brief});
  const ProgramResult refused = runner.run(arguments);
  ASSERT_EQ(refused.exit_code, 5) << refused.err;
  EXPECT_THAT(refused.err, HasSubstr("Give more photographs of the bed (here 1)"));
  arguments[1] = "photographs";
  fs::create_directory(runner.folder() / "photographs");
  for (unsigned k = 1; k <= 12; ++k)
    write_text(runner.folder() / ("photographs/" + std::to_string(k) + ".pgm"),
               PaintedPicture(width, height).disks(lattice(10, 5, 10, 210, 170, 0.15, k), 10, 60).noise(3, k).pgm());
  const ProgramResult followed = runner.run(arguments);
  EXPECT_EQ(followed.exit_code, 0) << followed.err;
}

}  // namespace
