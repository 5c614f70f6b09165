// The animation of a page against the trajectory it was made from: which frames, in which order, and where every disk
// is in them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/animation.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using namespace shakebed::pipelines;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double width = 8;

// Disks anywhere; the floor a sin(2 pi phase).
TrajectoryFrame frame_at(double time, double phase, std::size_t disks, std::mt19937_64& random) {
  std::uniform_real_distribution<double> across(0.5, width - 0.5), up(0.5, 6);
  TrajectoryFrame frame;
  frame.time = time, frame.phase = phase, frame.width = width;
  frame.floor_position = 0.25 * std::sin(2 * M_PI * phase);
  for (std::size_t i = 0; i < disks; ++i) frame.x.push_back(across(random)), frame.z.push_back(up(random));
  frame.vx.assign(disks, 0), frame.vz.assign(disks, 0);
  return frame;
}

// What the player is given.
struct Played {
  Json scene;
  std::vector<double> x, z;  // [D], frame by frame, disk by disk
  double resolution_x = 0, resolution_z = 0;
};

std::string attribute(const std::string& html, const std::string& name) {
  const std::size_t begin = html.find(name + "=\"") + name.size() + 2;
  std::string text = html.substr(begin, html.find('"', begin) - begin);
  for (std::size_t at; (at = text.find("&quot;")) != std::string::npos;) text.replace(at, 6, "\"");
  return text;
}

std::vector<unsigned> decoded_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned> bytes;
  unsigned held = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    held = (held << 6U) | static_cast<unsigned>(digits.find(c));
    bits += 6;
    if (bits >= 8) bits -= 8, bytes.push_back((held >> static_cast<unsigned>(bits)) & 0xFFU);
  }
  return bytes;
}

class Animation : public testing::Test {
 protected:
  std::string html(const std::vector<TrajectoryFrame>& frames, double period) {
    TrajectoryWriter writer(folder_ / "t.extxyz");
    for (const TrajectoryFrame& frame : frames) writer.write(frame);
    writer.close();
    return animation_html(folder_ / "t.extxyz", period);
  }
  Played played(const std::vector<TrajectoryFrame>& frames, double period) {
    const std::string page = html(frames, period);
    Played out;
    out.scene = Json::parse(attribute(page, "data-scene"));
    const double low = out.scene["low"], high = out.scene["high"];
    out.resolution_x = 0.51 * width / 65535, out.resolution_z = 0.51 * (high - low) / 65535;
    const std::vector<unsigned> bytes = decoded_base64(attribute(page, "data-positions"));
    for (std::size_t i = 0; i + 3 < bytes.size(); i += 4) {
      out.x.push_back((bytes[i] + 256 * bytes[i + 1]) / 65535.0 * width);
      out.z.push_back(low + (bytes[i + 2] + 256 * bytes[i + 3]) / 65535.0 * (high - low));
    }
    return out;
  }
  // Every disk of every frame where the trajectory has it, the frames being played in this order.
  void expect_places(const Played& found, const std::vector<TrajectoryFrame>& frames,
                     const std::vector<std::size_t>& order) {
    std::size_t k = 0;
    ASSERT_EQ(found.x.size(), order.size() * frames[0].size());
    ASSERT_EQ(found.scene["floor"].size(), order.size());
    for (std::size_t f = 0; f < order.size(); ++f) {
      const TrajectoryFrame& frame = frames[order[f]];
      for (std::size_t i = 0; i < frame.size(); ++i, ++k) {
        EXPECT_NEAR(found.x[k], frame.x[i], found.resolution_x) << "frame " << f << " disk " << i;
        EXPECT_NEAR(found.z[k], frame.z[i], found.resolution_z) << "frame " << f << " disk " << i;
      }
      EXPECT_NEAR(found.scene["floor"][f].get<double>(), frame.floor_position, 1e-4);
    }
  }
  ScratchFolder folder_;
  std::mt19937_64 random_{7};
};

TEST_F(Animation, PlaysWhatTheTrajectoryHoldsAsTimeWent) {
  std::vector<TrajectoryFrame> frames;
  for (int k = 0; k < 5; ++k) frames.push_back(frame_at(0.1 * k, 0.1 * k, 12, random_));
  const Played found = played(frames, 1);  // a tenth of a period apart
  expect_places(found, frames, {0, 1, 2, 3, 4});
  EXPECT_EQ(found.scene["label"][3], "phase 0.30, t = 0.3 √(D/g)");
  EXPECT_EQ(found.scene["width"], width);
  EXPECT_EQ(found.scene["walls"], true);
  EXPECT_THAT(html(frames, 1), HasSubstr("12 disks, 5 frames of the trajectory in the order of time."));
  EXPECT_EQ(played(frames, 0).scene["label"][3], "t = 0.3 √(D/g)") << "a still floor has no phase";
}

// Three quarters of a period apart: phases 0, 0.75, 0.5, 0.25, 0, 0.75. The first of each phase in the order of the
// phase, then the second of each.
TEST_F(Animation, PlaysStroboscopicFramesByThePhaseOfTheFloor) {
  std::vector<TrajectoryFrame> frames;
  for (int k = 0; k < 6; ++k) frames.push_back(frame_at(0.75 * k, std::fmod(0.75 * k, 1), 9, random_));
  const Played found = played(frames, 1);
  expect_places(found, frames, {0, 3, 2, 1, 4, 5});
  EXPECT_EQ(found.scene["label"][1], "phase 0.25, t = 2.2 √(D/g)");
  EXPECT_THAT(html(frames, 1), HasSubstr("in the order of the floor's phase"));
}

TEST_F(Animation, TonesAreThoseOfTheHeightsAtFirstAndRadiiThoseOfTheDisks) {
  TrajectoryFrame frame = frame_at(0, 0, 4, random_);
  frame.z = {0.5, 2.5, 4.5, 6.1};
  frame.radius = {0.5, 0.5, 0.25, 0.5};
  const Json scene = played({frame}, 1).scene;
  EXPECT_THAT(scene["tone"].get<std::vector<int>>(), ElementsAre(0, 1, 0, 1));
  EXPECT_THAT(scene["radius"].get<std::vector<double>>(), ElementsAre(0.5, 0.5, 0.25, 0.5));
}

TEST_F(Animation, APeriodicBedIsDrawnWithinItsWidth) {
  TrajectoryFrame frame = frame_at(0, 0, 3, random_);
  frame.periodic = true;
  frame.x = {-0.25, 8.5, 17};
  const Played found = played({frame}, 1);
  EXPECT_NEAR(found.x[0], 7.75, found.resolution_x);
  EXPECT_NEAR(found.x[1], 0.5, found.resolution_x);
  EXPECT_NEAR(found.x[2], 1, found.resolution_x);
  EXPECT_EQ(found.scene["walls"], false);
}

// 16 D above the lowest floor less 0.3 D: twice the width. A disk at 40 D is at the upper edge.
TEST_F(Animation, IsNotTallerThanTwiceItsWidth) {
  TrajectoryFrame frame = frame_at(0, 0, 2, random_);
  frame.z = {0.5, 40};
  const Played found = played({frame}, 1);
  EXPECT_NEAR(found.scene["low"].get<double>(), -0.3, 1e-6);
  EXPECT_NEAR(found.scene["high"].get<double>(), 15.7, 1e-4);
  EXPECT_NEAR(found.z[0], 0.5, found.resolution_z);
  EXPECT_NEAR(found.z[1], 15.7, found.resolution_z);
}

TEST_F(Animation, HoldsNoMoreThanAPageCarries) {
  std::vector<TrajectoryFrame> frames;
  for (int k = 0; k < 100; ++k) frames.push_back(frame_at(0.01 * k, 0, 1, random_));
  EXPECT_EQ(played(frames, 0).x.size(), 96u);
  frames.clear();
  for (int k = 0; k < 60; ++k) frames.push_back(frame_at(0.01 * k, 0, 4000, random_));
  EXPECT_EQ(played(frames, 0).x.size(), 200'000u) << "50 frames of 4,000 disks";
  EXPECT_EQ(html({frame_at(0, 0, 5001, random_)}, 0), "") << "too many disks";
}

// Without a script: every disk of the first frame as a circle, upwards being negative in SVG.
TEST_F(Animation, HasAStillPicture) {
  TrajectoryFrame frame = frame_at(0, 0, 2, random_);
  frame.x = {1.25, 3.5}, frame.z = {0.5, 2.75};
  const std::string page = html({frame}, 0);
  EXPECT_THAT(page, HasSubstr("<circle cx=\"1.25\" cy=\"-0.50\" r=\"0.50\"/>"));
  EXPECT_THAT(page, HasSubstr("<circle cx=\"3.50\" cy=\"-2.75\" r=\"0.50\"/>"));
}

}  // namespace
