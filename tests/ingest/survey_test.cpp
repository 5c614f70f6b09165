// Drawn imitations of strangers' photographs: beads are found whatever their faces look like, and where there are none
// none are found.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <initializer_list>
#include <numbers>
#include <optional>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "ingest/find/learn_beads.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "tests/ingest/drawn_pictures.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

struct Place {
  double x, y;
};

// Places at least `apart` from one another, in a frame of this size.
std::vector<Place> scattered(std::size_t count, double apart, int width, int height, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Place> places;
  for (int tries = 0; places.size() < count && tries < 100000; ++tries) {
    const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const Place place{apart + part() * (width - 2 * apart), apart + part() * (height - 2 * apart)};
    bool free = true;
    for (auto other = places.begin(); free && other != places.end(); ++other)
      free = std::hypot(other->x - place.x, other->y - place.y) > apart;
    if (free) places.push_back(place);
  }
  return places;
}

using Paint = std::function<double(double x, double y)>;

// Averages over 3 x 3 points a pixel, and noise of 2 grey levels.
GrayFrame painted(int width, int height, const Paint& paint, unsigned seed = 1) {
  std::mt19937 random(seed);
  GrayFrame frame;
  frame.width = width;
  frame.height = height;
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      double sum = 0;
      for (int i = -1; i <= 1; ++i)
        for (int j = -1; j <= 1; ++j) sum += paint(column + i / 3.0, row + j / 3.0) / 9;
      double noise = -6;
      for (int k = 0; k < 12; ++k) noise += static_cast<double>(random()) / 4294967296.0;
      frame.pixels.push_back(static_cast<float>(sum + 2 * noise));
    }
  return frame;
}

// The bead at a point, of beads that do not overlap; asked for at every point of a picture, so each bead is looked for
// only where it is.
class BeadAt {
 public:
  BeadAt(const std::vector<Place>& places, double radius) : radius_(radius) {
    for (const Place& place : places)
      for (const double x : {place.x - radius, place.x + radius})
        for (const double y : {place.y - radius, place.y + radius}) {
          const std::size_t cell = cell_of(x, y);
          if (cells_.size() <= cell) cells_.resize(cell + 1);
          cells_[cell].push_back(&place);
        }
  }
  const Place* operator()(double x, double y) const {
    const std::size_t cell = cell_of(x, y);
    if (cell >= cells_.size()) return nullptr;
    for (const Place* place : cells_[cell])
      if (std::hypot(place->x - x, place->y - y) < radius_) return place;
    return nullptr;
  }

 private:
  // Squares a diameter wide, from a diameter outside of the picture on: the corners of the square around a bead lie in
  // all that it reaches into.
  [[nodiscard]] std::size_t cell_of(double x, double y) const {
    constexpr std::size_t across = 1000;
    return static_cast<std::size_t>(y / (2 * radius_) + 1) * across + static_cast<std::size_t>(x / (2 * radius_) + 1);
  }
  double radius_;
  std::vector<std::vector<const Place*>> cells_;
};

Survey survey_of(const std::vector<ChannelFrames::One>& channels, const SurveyOptions& options = {}) {
  ChannelFrames frames;
  frames.channels = channels;
  frames.width = channels.front().frame.width;
  frames.height = channels.front().frame.height;
  return take_survey(frames, options);
}

struct Score {
  std::size_t hits = 0, found = 0;
};
template <class Disks, class PlaceOf>
Score score(const Disks& disks, const std::vector<Place>& truth, double radius, const PlaceOf& place_of) {
  Score score;
  score.found = disks.size();
  for (const Place& place : truth)
    for (const auto& disk : disks) {
      const Place at = place_of(disk);
      if (std::hypot(at.x - place.x, at.y - place.y) < 0.25 * radius) {
        ++score.hits;
        break;
      }
    }
  return score;
}

// All of them, or at least `least`, and nothing else.
void expect_all(const Survey& survey, const std::vector<Place>& truth, double radius, double least = 1) {
  ASSERT_TRUE(survey.found) << survey.why_not << ", radius " << radius << ", " << survey.candidates.size();
  const SurveyCandidate& best = survey.candidates.front();
  EXPECT_NEAR(best.rims.radius_px, radius, 0.06 * radius);
  const Score found = score(best.disks, truth, radius, [](const RimDisk& d) { return Place{d.circle.x, d.circle.y}; });
  EXPECT_GE(static_cast<double>(found.hits), least * static_cast<double>(truth.size()));
  EXPECT_EQ(found.found, found.hits);
}

TEST(Survey, FindsPhotoelasticDisksByTheirRims) {
  const double radius = 19;
  const std::vector<Place> truth = scattered(40, 2.1 * radius, 520, 460, 3);
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(520, 460, [&](double x, double y) {
    const Place* bead = bead_at(x, y);
    if (bead == nullptr) return 210.0;
    const double u = (x - bead->x) / radius, v = (y - bead->y) / radius;
    return 95 + 55 * std::sin(9 * u * v + bead->x) * std::cos(4 * u + bead->y);  // fringes, another set in each
  });
  // Fringes that end at the rim hide parts of it: some disks stay below a probability of 0.8 and are not reported.
  expect_all(survey_of({{Channel::automatic, frame}}), truth, radius, 0.9);
}

TEST(Survey, FindsBeadsOfTwoColoursInOneChannel) {
  const double radius = 12;
  const std::vector<Place> truth = scattered(45, 2.3 * radius, 400, 380, 5);
  const BeadAt bead_at(truth, radius);
  // In grey every second bead is as bright as the background.
  const auto level = [&](bool grey) {
    return painted(400, 380, [&, grey](double x, double y) {
      const Place* bead = bead_at(x, y);
      if (bead == nullptr) return grey ? 150.0 : 10.0;
      const bool first = (bead - truth.data()) % 2 == 0;
      return grey ? (first ? 70.0 : 150.0) : (first ? 120.0 : 140.0);
    });
  };
  const Survey survey = survey_of({{Channel::grey, level(true)}, {Channel::saturation, level(false)}});
  expect_all(survey, truth, radius);
  EXPECT_EQ(survey.candidates.front().channel, Channel::saturation);
}

double mean_support(const std::vector<RimDisk>& disks) {
  double sum = 0;
  for (const RimDisk& disk : disks) sum += disk.circle.support / static_cast<double>(disks.size());
  return sum;
}

// Where coins touch no rim is seen. Of their free rims all is.
TEST(Survey, FewCoinsThatTouchAreFound) {
  const double radius = 30;
  std::vector<Place> truth;
  for (int k = 0; k < 9; ++k) truth.push_back({60 + 60.0 * (k % 3), 60 + 60.0 * std::floor(k / 3)});
  const BeadAt bead_at(truth, 1.04 * radius);
  const GrayFrame frame =
      painted(240, 240, [&](double x, double y) { return bead_at(x, y) != nullptr ? 80.0 : 240.0; });
  const Survey survey = survey_of({{Channel::automatic, frame}});
  ASSERT_FALSE(survey.candidates.empty());
  const std::vector<RimDisk>& disks = survey.candidates.front().disks;
  EXPECT_EQ(disks.size(), 9U);
  EXPECT_LT(mean_support(disks), 0.42 + 3.5 / 9) << "as much was asked for of nine circles";
  EXPECT_TRUE(survey.found) << survey.why_not;
}

// Three in a row, nearly as large as the picture is high.
TEST(Survey, CoinsNearlyAsHighAsThePictureAreFound) {
  const double radius = 115;
  const std::vector<Place> truth = {{130, 128}, {420, 130}, {705, 127}};
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(840, 290, [&](double x, double y) {
    const Place* bead = bead_at(x, y);
    if (bead == nullptr) return 250.0;
    const double away = std::hypot(x - bead->x, y - bead->y), turn = std::atan2(y - bead->y, x - bead->x);
    if (away > 0.9 * radius) return 120.0;
    return 150 + 40 * std::sin(0.11 * x + 5 * turn) * std::sin(0.13 * y);
  });
  expect_all(survey_of({{Channel::automatic, frame}}), truth, radius);
}

// Five plain outlines around marks of all kinds. In the stretched copies some marks look like poor circles of this
// size, which says nothing against whole ones.
TEST(Survey, OrnateCoinsOnAPlainGroundAreFound) {
  const double radius = 90;
  const std::vector<Place> truth = {{110, 110}, {460, 112}, {284, 280}, {110, 452}, {462, 450}};
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(570, 560, [&](double x, double y) {
    const Place* bead = bead_at(x, y);
    if (bead == nullptr) return 254.0;
    const double u = x - bead->x, v = y - bead->y, away = std::hypot(u, v) / radius, turn = std::atan2(v, u);
    if (away > 0.96) return 70.0;
    if (away > 0.84) return std::sin(40 * turn) > 0 ? 60.0 : 190.0;
    if (away > 0.8) return 70.0;
    if (away > 0.55) return std::sin(13 * turn + 0.3 * std::sin(0.4 * u)) * std::sin(0.45 * v) > 0.1 ? 50.0 : 160.0;
    if (away > 0.5) return 60.0;
    return std::sin(0.21 * u + 0.1 * v) * std::sin(0.17 * v) > 0.2 ? 200.0 : 120.0;
  });
  expect_all(survey_of({{Channel::automatic, frame}}), truth, radius);
}

// A part of each rim is not seen. So few could be parts of other shapes, unless their radius is given.
TEST(Survey, FewPartsOfRimsAreBeadsOfAGivenRadius) {
  const double radius = 20;
  const std::vector<Place> truth = scattered(7, 2.6 * radius, 320, 300, 12);
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(320, 300, [&](double x, double y) {
    const Place* bead = bead_at(x, y);
    if (bead == nullptr) return 200.0;
    const double side = 2.4 * static_cast<double>(bead - truth.data());
    const double along = (x - bead->x) * std::cos(side) + (y - bead->y) * std::sin(side);
    return along > 0.6 * std::hypot(x - bead->x, y - bead->y) ? 200.0 : 90.0;
  });
  const Survey unasked = survey_of({{Channel::automatic, frame}});
  EXPECT_FALSE(unasked.found);
  SurveyOptions given;
  given.any_shape = true;
  EXPECT_FALSE(survey_of({{Channel::automatic, frame}}, given).found);
  given.radius_px = radius;
  expect_all(survey_of({{Channel::automatic, frame}}, given), truth, radius, 0.8);
}

TEST(Survey, ALargerOutlineWinsOverTheHighlightInIt) {
  const double radius = 16;
  const std::vector<Place> truth = scattered(30, 2.2 * radius, 420, 400, 9);
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(420, 400, [&](double x, double y) {
    const Place* bead = bead_at(x, y);
    if (bead == nullptr) return 180.0;
    return std::hypot(x - bead->x + 3, y - bead->y + 3) < 6 ? 240.0 : 70.0;
  });
  expect_all(survey_of({{Channel::automatic, frame}}), truth, radius);
}

// In a second channel the same beads are faint. They are searched for there, too, where the first shows other things
// as well: a ruled ground.
TEST(Survey, OneChannelIsEnoughWhereItShowsBeadsPlainly) {
  const double radius = 9;
  const std::vector<Place> truth = scattered(60, 2.3 * radius, 380, 340, 12);
  const BeadAt bead_at(truth, radius);
  const auto surveyed = [&](bool ruled) {
    const GrayFrame plain = painted(380, 340, [&](double x, double y) {
      if (bead_at(x, y) != nullptr) return 60.0;
      return ruled && std::fmod(x + 0.3 * y, 14) < 5 ? 220.0 : 180.0;
    });
    const GrayFrame faint = painted(
        380, 340, [&](double x, double y) { return bead_at(x, y) == nullptr ? 100.0 : 116.0; }, 2);
    return survey_of({{Channel::red, plain}, {Channel::blue, faint}});
  };
  const auto in_blue = [](const Survey& survey) {
    return std::count_if(survey.candidates.begin(), survey.candidates.end(),
                         [](const SurveyCandidate& one) { return one.channel == Channel::blue; });
  };
  const Survey plainly = surveyed(false);
  expect_all(plainly, truth, radius);
  EXPECT_EQ(in_blue(plainly), 0);
  EXPECT_GE(in_blue(surveyed(true)), 1);
}

// Rings of 0.75 radii in the beads are seen as well as the beads.
TEST(Survey, RingsInBeadsAreNoFurtherCandidates) {
  const double radius = 16;
  const std::vector<Place> truth = scattered(60, 2.2 * radius, 560, 480, 14);
  const BeadAt bead_at(truth, radius);
  const Survey survey = survey_of({{Channel::automatic, painted(560, 480, [&](double x, double y) {
                                      const Place* bead = bead_at(x, y);
                                      if (bead == nullptr) return 180.0;
                                      return std::hypot(x - bead->x, y - bead->y) < 0.75 * radius ? 60.0 : 110.0;
                                    })}});
  expect_all(survey, truth, radius);
  EXPECT_EQ(survey.candidates.size(), 1U);
}

// Beads of 10 and of 20 px. The radius that is given decides which are meant; one that no bead has finds none.
// With corners on a circle of this radius.
bool in_polygon(const Place& place, int corners, double radius, double x, double y) {
  const double right = x - place.x, down = y - place.y, part = 2 * std::numbers::pi / corners;
  const double angle = std::atan2(down, right), from_middle = angle - part * (std::floor(angle / part) + 0.5);
  return std::hypot(right, down) * std::cos(from_middle) < radius * std::cos(part / 2);
}

// Disks in a clean picture are seen whole, all of them: poorer circles, of which its stretched copies are full,
// say nothing against them. Small hexagons are not so round.
TEST(Survey, SmallDisksInACleanPictureAreFound) {
  const auto lattice = [](double radius) {
    std::vector<Place> places;
    for (int row = 0; row < 9; ++row)
      for (int k = 0; k < 9; ++k) places.push_back({(3 + 4 * k + 2 * (row % 2)) * radius, (3 + 3.5 * row) * radius});
    return places;
  };
  const auto seen = [](double radius, const Paint& paint) {
    const int side = static_cast<int>(40 * radius);
    return survey_of({{Channel::grey, painted(side, side, paint)}});
  };
  for (const double radius : {5.5, 8.0}) {
    const std::vector<Place> places = lattice(radius);
    const BeadAt disk_at(places, radius);
    const Paint disks = [&](double x, double y) { return disk_at(x, y) == nullptr ? 200.0 : 60.0; };
    expect_all(seen(radius, disks), places, radius);
  }
  const std::vector<Place> few = scattered(4, 45, 260, 220, 3);
  const BeadAt one_of(few, 17);
  expect_all(
      survey_of({{Channel::grey,
                  painted(260, 220, [&](double x, double y) { return one_of(x, y) == nullptr ? 200.0 : 60.0; })}}),
      few, 17);
  const std::vector<Place> places = lattice(8);
  const BeadAt around(places, 8.8);
  const Paint hexagons = [&](double x, double y) {
    const Place* one = around(x, y);
    return one != nullptr && in_polygon(*one, 6, 8.8, x, y) ? 60.0 : 200.0;
  };
  EXPECT_FALSE(seen(8, hexagons).found);
}

// Things as wide as disks of this radius, with corners.
bool in_square(const Place& place, double half, double x, double y) {
  return std::abs(x - place.x) < half && std::abs(y - place.y) < half;
}

TEST(Survey, SmallSquaresAreRefusedWithWhatWouldHelpIfTheyWereBeads) {
  const std::vector<Place> places = scattered(60, 19, 260, 220, 5);
  const Survey survey = survey_of({{Channel::grey, painted(260, 220, [&](double x, double y) {
                                      for (const Place& place : places)
                                        if (in_square(place, 6, x, y)) return 60.0;
                                      return 190.0;
                                    })}});
  ASSERT_FALSE(survey.found);
  EXPECT_THAT(survey.why_not,
              testing::AllOf(testing::HasSubstr("they have 4 corners"),
                             testing::HasSubstr("blur alone can cause this for beads that touch: if these are beads, "
                                                "photograph them at least 24 px wide")));
}

// Disks to the left, pentagons of about their size to the right.
TEST(Survey, DisksAreFoundInThePartWhereThingsAreRound) {
  const std::vector<Place> places = scattered(50, 46, 640, 300, 6);
  std::vector<Place> disks, others;
  for (const Place& place : places)
    if (std::abs(place.x - 320) > 40) (place.x < 320 ? disks : others).push_back(place);
  const BeadAt disk_at(disks, 20);
  const Survey survey = survey_of({{Channel::grey, painted(640, 300, [&](double x, double y) {
                                      if (disk_at(x, y) != nullptr) return 60.0;
                                      for (const Place& place : others)
                                        if (in_polygon(place, 5, 23, x, y)) return 60.0;
                                      return 190.0;
                                    })}});
  expect_all(survey, disks, 20);
  const std::optional<PixelRectangle>& region = survey.candidates.front().region;
  ASSERT_TRUE(region);
  EXPECT_EQ(region->left, 0);
  EXPECT_EQ(region->top, 0);
  EXPECT_EQ(region->height, 300);
  EXPECT_NEAR(region->width, 320, 40);
}

// Bright hexagons everywhere, also on the dark plates whose rims are circles: most edges are those of the hexagons.
TEST(Survey, PlatesAmongSmallerThingsThatAreNotRoundAreNoBeads) {
  const std::vector<Place> plates = scattered(6, 110, 420, 360, 7);
  std::vector<Place> hexagons = scattered(125, 19, 420, 360, 8);
  std::erase_if(hexagons, [&](const Place& one) {
    return std::any_of(plates.begin(), plates.end(), [&](const Place& plate) {
      return std::abs(std::hypot(plate.x - one.x, plate.y - one.y) - 50) < 12;
    });
  });
  const BeadAt plate_at(plates, 50), around(hexagons, 9);
  const Survey survey = survey_of({{Channel::grey, painted(420, 360, [&](double x, double y) {
                                      const Place* one = around(x, y);
                                      if (one != nullptr && in_polygon(*one, 6, 9, x, y)) return 230.0;
                                      return plate_at(x, y) != nullptr ? 60.0 : 150.0;
                                    })}});
  EXPECT_FALSE(survey.found);
  EXPECT_TRUE(std::any_of(survey.candidates.begin(), survey.candidates.end(), [](const SurveyCandidate& one) {
    return std::abs(one.rims.radius_px - 50) < 2 &&
           one.why_not.starts_with(
               "objects of 8.1 px radius that are not round explain more of the edges than circles "
               "of 50.");
  }));
}

// Spots that fade over their whole width, among bars.
TEST(Survey, SpotsWithoutARimAmongOtherThingsAreNoBeads) {
  const std::vector<Place> places = scattered(20, 40, 300, 220, 9);
  const Survey survey = survey_of({{Channel::grey, painted(300, 220, [&](double x, double y) {
                                      double level = 190;
                                      for (const Place& place : places) {
                                        const double dx = x - place.x, dy = y - place.y;
                                        level -= 110 * std::exp(-(dx * dx + dy * dy) / (2 * 8 * 8));
                                      }
                                      return y > 200 || y < 20 ? level + 40 * (static_cast<int>(x / 6) % 2) : level;
                                    })}});
  EXPECT_FALSE(survey.found);
  EXPECT_TRUE(std::any_of(survey.candidates.begin(), survey.candidates.end(), [](const SurveyCandidate& one) {
    return one.disks.size() >= 10 && !one.plausible &&
           one.why_not == "spots without a rim are seen, as in any blurred pattern";
  }));
}

TEST(Survey, AGivenRadiusIsObeyedOrContradicted) {
  const std::vector<Place> places = scattered(50, 44, 520, 500, 4);
  std::vector<Place> small, large;
  for (std::size_t k = 0; k < places.size(); ++k) (k % 2 == 0 ? small : large).push_back(places[k]);
  const BeadAt small_at(small, 10), large_at(large, 20);
  const GrayFrame frame = painted(520, 500, [&](double x, double y) {
    return small_at(x, y) != nullptr || large_at(x, y) != nullptr ? 60.0 : 190.0;
  });
  const auto given = [&](double radius) {
    SurveyOptions options;
    options.radius_px = radius;
    return survey_of({{Channel::automatic, frame}}, options);
  };
  for (const double radius : {8.5, 10.0, 12.0}) expect_all(given(radius), small, 10);
  for (const double radius : {17.0, 20.0, 24.0}) expect_all(given(radius), large, 20);
  for (const double radius : {5.0, 14.2, 40.0}) {
    const Survey survey = given(radius);
    EXPECT_FALSE(survey.found) << radius;
    EXPECT_FALSE(survey.why_not.empty());
  }
}

// The first picture, and of those that follow every `step`-th; noise of this many seeds.
void expect_nothing_found(std::size_t step, unsigned noises) {
  const int width = 360, height = 300;
  std::mt19937 random(11);
  std::vector<Place> waves;
  for (int k = 0; k < 40; ++k)
    waves.push_back(
        {static_cast<double>(random() % 1000) / 1000 - 0.5, static_cast<double>(random() % 1000) / 1000 - 0.5});
  const std::vector<std::pair<std::string, Paint>> pictures = {
      {"nothing", [](double, double) { return 128.0; }},
      {"a slope of light", [](double x, double y) { return 60 + 0.2 * x + 0.1 * y; }},
      {"a texture of waves",
       [&](double x, double y) {
         double sum = 128;
         for (const Place& wave : waves) sum += 8 * std::sin(wave.x * x + wave.y * y + 40 * wave.x);
         return sum;
       }},
      {"stripes", [](double x, double y) { return std::sin(0.3 * x + 0.2 * y) > 0 ? 200.0 : 60.0; }},
      {"a chessboard",
       [](double x, double y) {
         return (static_cast<int>(x / 20 + 50) + static_cast<int>(y / 20 + 50)) % 2 ? 220.0 : 40.0;
       }},
      {"a plot",
       [](double x, double y) {
         const bool frame = std::abs(x - 40) < 1 || std::abs(y - 260) < 1;
         const bool curve = std::abs(y - 150 - 80 * std::sin(x / 40)) < 1.5 && x > 40;
         const bool grid = std::fmod(x + 20, 60) < 1 || std::fmod(y + 20, 50) < 1;
         return frame || curve ? 20.0 : grid ? 200.0 : 250.0;
       }},
      {"bars of a histogram", [](double x, double y) {
         return y > 280 - 200 * std::exp(-std::pow(std::floor(x / 24) - 7, 2) / 8) ? 60.0 : 250.0;
       }}};
  for (std::size_t k = 0; k < pictures.size(); k += step) {
    const auto& [name, paint] = pictures[k];
    const Survey survey = survey_of({{Channel::automatic, painted(width, height, paint)}});
    EXPECT_FALSE(survey.found) << name << ": " << survey.candidates.front().disks.size() << " disks";
    EXPECT_FALSE(survey.why_not.empty()) << name;
  }
  // Noise alone.
  for (unsigned seed = 1; seed <= noises; ++seed) {
    std::mt19937 more(seed);
    GrayFrame noise = painted(width, height, [](double, double) { return 120.0; });
    for (float& level : noise.pixels) level += static_cast<float>(more() % 61) - 30.0F;
    EXPECT_FALSE(survey_of({{Channel::automatic, noise}}).found) << seed;
  }
}
// Tiles, seen as circles of 7 px: a part of a large picture is enough to refuse them. By how often it asks whether to
// stop.
TEST(Survey, ALargePictureOfSmallThingsIsRefusedByAPart) {
  const auto asked_for = [](int side) {
    ChannelFrames frames;
    frames.width = frames.height = side;
    frames.channels = {{Channel::automatic, painted(side, side, [](double x, double y) {
                          const double u = std::fmod(x, 22.0) - 11, v = std::fmod(y, 22.0) - 11;
                          return std::max(std::abs(u), std::abs(v)) < 6.5 ? 90.0 : 190.0;
                        })}};
    std::size_t asked = 0;
    const StopQuestion counted([&] { ++asked; });
    EXPECT_FALSE(take_survey(frames).found);
    return asked;
  };
  EXPECT_LT(asked_for(1000), 2 * asked_for(640)) << "2.4 times as large";
}

TEST(Survey, RefusesPicturesWithoutBeads) { expect_nothing_found(5, 1); }
TEST(Survey, RefusesEveryPictureWithoutBeads) { expect_nothing_found(1, 3); }

// FNV-1a: the same pictures everywhere.
unsigned seed_of(const std::string& name, unsigned series) {
  unsigned hash = 2166136261U;
  for (const char letter : name) hash = (hash ^ static_cast<unsigned char>(letter)) * 16777619U;
  return hash + series;
}

// Each kind with its sizes, places, directions, levels and noise at random. (Limits were chosen on series 0.)
TEST(Survey, RefusesFiftyKindsOfPicturesWithoutBeads) {
  constexpr unsigned series = 20;
  EXPECT_GE(test::pictures_without_beads().size(), 45U);
  for (const test::DrawnKind& kind : test::pictures_without_beads()) {
    std::mt19937 random(seed_of(kind.name, series));
    const Survey survey = survey_of({{Channel::automatic, kind.draw(random)}});
    EXPECT_FALSE(survey.found) << kind.name << ": " << survey.candidates.front().disks.size() << " disks of "
                               << survey.candidates.front().rims.radius_px << " px";
    EXPECT_FALSE(survey.why_not.empty()) << kind.name;
  }
}

// Beads of every look are still seen: none is refused for its shape, and what is found are beads. The first look, and
// of those that follow every `step`-th.
void expect_drawn_beads_found(std::size_t step) {
  constexpr unsigned series = 20;
  const std::vector<test::BeadLook>& looks = test::pictures_with_beads();
  for (std::size_t k = 0; k < looks.size(); k += step) {
    const test::BeadLook& look = looks[k];
    std::mt19937 random(seed_of(look.name, series));
    const test::DrawnBeads drawn = look.draw(random);
    std::vector<Place> truth;
    for (const auto& [x, y] : drawn.centres_px) truth.push_back({x, y});
    const Survey survey = survey_of({{Channel::automatic, drawn.frame}});
    ASSERT_TRUE(survey.found) << look.name << ": " << survey.why_not;
    const Score found = score(survey.candidates.front().disks, truth, drawn.radius_px, [](const RimDisk& disk) {
      return Place{disk.circle.x, disk.circle.y};
    });
    // The survey leaves out what is uncertain, up to a third; the finder takes it up (learn_beads.hpp).
    EXPECT_GE(3 * found.hits, 2 * truth.size()) << look.name;
    EXPECT_EQ(found.found, found.hits) << look.name;
  }
}
TEST(Survey, FindsDrawnBeads) { expect_drawn_beads_found(3); }
TEST(Survey, FindsDrawnBeadsOfEveryLook) { expect_drawn_beads_found(1); }

// Where beads touch, blur moves the steepest edge inwards, by up to 8 % of these radii.
TEST(Survey, RimsOfTouchingBeadsGiveTheRadiusOfTheirOpenSides) {
  for (const test::BeadLook& look : test::pictures_with_beads()) {
    if (look.name != "flat" && look.name != "of uneven brightness") continue;
    for (unsigned series = 70; series < 72; ++series) {
      std::mt19937 random(seed_of(look.name, series));
      const test::DrawnBeads drawn = look.draw(random);
      const LearnedRims dark = learn_rims(drawn.frame, Polarity::dark_beads, drawn.radius_px);
      const LearnedRims bright = learn_rims(drawn.frame, Polarity::bright_beads, drawn.radius_px);
      const LearnedRims& rims = dark.disks.size() > bright.disks.size() ? dark : bright;
      EXPECT_NEAR(rims.model.open_radius_px / drawn.radius_px, 1, 0.03) << look.name << ' ' << series;
    }
  }
}

TEST(Survey, DarkSurroundingsHoldNoBeads) {
  const double radius = 11;
  std::vector<Place> truth;
  for (const Place& place : scattered(45, 2.1 * radius, 300, 300, 21)) truth.push_back({place.x + 80, place.y + 20});
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame = painted(460, 340, [&](double x, double y) {
    const bool inside = x > 78 && x < 382 && y > 18 && y < 322;
    if (!inside) return 35.0;  // as dark as the beads
    return bead_at(x, y) != nullptr ? 40.0 : 200.0;
  });
  const Survey survey = survey_of({{Channel::automatic, frame}});
  ASSERT_TRUE(survey.found) << survey.why_not << ", radius " << radius << ", " << survey.candidates.size();
  MeasureOptions options;
  options.bead_diameter_m = 0.006;
  options.find.seen = BeadsSeen{survey.candidates.front().rims.polarity, survey.candidates.front().rims.radius_px};
  FrameSource source = FrameSource::from_frames({frame});
  const Measurement measured = measure_bed(source, options);
  const Score found = score(measured.disks, truth, radius, [](const MeasuredDisk& d) { return Place{d.x_px, d.y_px}; });
  EXPECT_EQ(found.hits, truth.size());
  EXPECT_EQ(found.found, truth.size());
}

TEST(Survey, ReducedFramesGiveThePlacesOfTheRecordedOnes) {
  const double radius = 40;
  const std::vector<Place> truth = scattered(30, 2.1 * radius, 900, 800, 31);
  const BeadAt bead_at(truth, radius);
  const GrayFrame frame =
      painted(900, 800, [&](double x, double y) { return bead_at(x, y) != nullptr ? 60.0 : 200.0; });
  GrayFrame small;
  constexpr int factor = 3;
  small.width = frame.width / factor;
  small.height = frame.height / factor;
  for (int row = 0; row < small.height; ++row)
    for (int column = 0; column < small.width; ++column) {
      float sum = 0;
      for (int i = 0; i < factor; ++i)
        for (int j = 0; j < factor; ++j) sum += frame.at(factor * column + i, factor * row + j);
      small.pixels.push_back(sum / (factor * factor));
    }
  MeasureOptions options;
  options.bead_diameter_m = 0.006;
  options.reduction = factor;
  options.find.seen = BeadsSeen{Polarity::dark_beads, radius};
  FrameSource source = FrameSource::from_frames({small});
  const Measurement measured = measure_bed(source, options);
  EXPECT_NEAR(measured.calibration.radius_px, radius, 0.1);
  EXPECT_NEAR(measured.calibration.scale_m_per_px, 0.006 / (2 * radius), 0.006 / (2 * radius) * 0.003);
  ASSERT_EQ(measured.disks.size(), truth.size());
  for (const MeasuredDisk& disk : measured.disks) {
    double nearest = 1e9;
    for (const Place& place : truth) nearest = std::min(nearest, std::hypot(disk.x_px - place.x, disk.y_px - place.y));
    EXPECT_LT(nearest, 0.15);
  }
}

// A frame with every pixel repeated `factor` times along both sides, as programs enlarge that take the nearest pixel.
GrayFrame repeated(const GrayFrame& frame, double factor) {
  GrayFrame large;
  large.width = static_cast<int>(frame.width * factor);
  large.height = static_cast<int>(frame.height * factor);
  for (int row = 0; row < large.height; ++row)
    for (int column = 0; column < large.width; ++column)
      large.pixels.push_back(frame.at(std::min(frame.width - 1, static_cast<int>(column / factor)),
                                      std::min(frame.height - 1, static_cast<int>(row / factor))));
  return large;
}

Measurement measured_as_found(const std::string& path) {
  const Survey survey = take_survey(read_channels(path));
  if (!survey.found) return {};
  MeasureOptions options;
  options.bead_diameter_m = 0.006;
  options.find.seen = BeadsSeen{survey.candidates.front().rims.polarity, survey.candidates.front().rims.radius_px};
  FrameSource source = FrameSource::open({path});
  return measure_bed(source, options);
}

void expect_enlarged_beads_found(unsigned pictures) {
  const test::ScratchFolder folder;
  std::mt19937 random(41);
  std::size_t beads = 0, hits = 0, found = 0;
  for (unsigned k = 0; k < pictures; ++k) {
    const auto part = [&] { return static_cast<double>(random()) / 4294967296.0; };
    const double radius = 2.6 + 3 * part(), factor = 2 + 2 * part();
    const std::vector<Place> places = scattered(60, 2.15 * radius, 180, 160, 100 + k);
    const BeadAt bead_at(places, radius);
    const bool bright = k % 2 == 0;
    const GrayFrame frame = painted(
        180, 160,
        [&](double x, double y) {
          const double level = bead_at(x, y) != nullptr ? 60.0 : 190.0;
          return bright ? 250 - level : level;
        },
        200 + k);
    const std::string path = folder / ("enlarged_" + std::to_string(k) + ".png");
    write_png(path, repeated(frame, factor));
    EXPECT_NEAR(read_frame(path).enlargement, factor, 0.01 * factor) << k;
    std::vector<Place> truth;
    for (const Place& place : places) truth.push_back({factor * (place.x + 0.5) - 0.5, factor * (place.y + 0.5) - 0.5});
    const Score score_here = score(measured_as_found(path).disks, truth, factor * radius, [](const MeasuredDisk& d) {
      return Place{d.x_px, d.y_px};
    });
    beads += truth.size(), hits += score_here.hits, found += score_here.found;
  }
  EXPECT_GE(static_cast<double>(hits), 0.98 * static_cast<double>(beads));
  EXPECT_LE(static_cast<double>(found - hits), 0.02 * static_cast<double>(beads));
}
TEST(Survey, FindsBeadsInPicturesEnlargedByRepeatingPixels) { expect_enlarged_beads_found(2); }
TEST(Survey, FindsBeadsInEightEnlargedPictures) { expect_enlarged_beads_found(8); }

TEST(Survey, PicturesThatWereNotEnlargedStayAsTheyAre) {
  const test::ScratchFolder folder;
  const std::vector<std::pair<std::string, Paint>> pictures = {
      {"smooth", [](double x, double y) { return 60 + 0.2 * x + 0.1 * y + 20 * std::sin(x / 9); }},
      {"a plot",
       [](double x, double y) {
         const bool curve = std::abs(y - 150 - 80 * std::sin(x / 40)) < 1.5;
         const bool grid = std::fmod(x + 20, 60) < 1 || std::fmod(y + 20, 50) < 1;
         return curve ? 20.0 : grid ? 200.0 : 250.0;
       }},
      {"beads",
       [](double x, double y) { return std::hypot(std::fmod(x, 24) - 12, std::fmod(y, 24) - 12) < 9 ? 60. : 200.; }}};
  for (const auto& [name, paint] : pictures) {
    GrayFrame frame = painted(300, 260, paint);
    for (float& level : frame.pixels) level = std::min(255.0F, std::round(level));
    const std::string path = folder / (name + ".png");
    write_png(path, frame);
    const GrayFrame read = read_frame(path);
    EXPECT_EQ(read.enlargement, 1) << name;
    EXPECT_EQ(read.pixels, frame.pixels) << name;
  }
}

// White beads in a black pan on a table as bright as they are: faces tile the table, which has no rims.
void expect_beads_in_the_pan_alone(std::initializer_list<unsigned> seeds) {
  for (const unsigned seed : seeds) {
    std::mt19937 random(seed);
    const double radius = 6 + static_cast<double>(random() % 300) / 100, pan = 200, middle = 240;
    std::vector<Place> truth;
    // A crystal in the middle of the pan, lone beads around it.
    for (int row = -5; row <= 5; ++row)
      for (int column = -5; column <= 5; ++column)
        truth.push_back({middle + 2.05 * radius * (column + 0.5 * (row & 1)), middle + 1.78 * radius * row});
    const double crystal = 13 * radius;
    for (const Place& place : scattered(400, 2.6 * radius, 480, 480, seed)) {
      const double away = std::hypot(place.x - middle, place.y - middle);
      if (away > crystal + 2 * radius && away < pan - 2 * radius) truth.push_back(place);
    }
    const BeadAt bead_at(truth, radius);
    const GrayFrame frame = painted(
        480, 480,
        [&](double x, double y) {
          if (std::hypot(x - middle, y - middle) > pan) return 205.0 + 6 * std::sin(x / 31) + 6 * std::cos(y / 23);
          return bead_at(x, y) != nullptr ? 215.0 : 50.0;
        },
        seed);
    const test::ScratchFolder folder;
    write_png(folder / "pan.png", frame);
    const Score found = score(measured_as_found(folder / "pan.png").disks, truth, radius, [](const MeasuredDisk& d) {
      return Place{d.x_px, d.y_px};
    });
    EXPECT_GE(static_cast<double>(found.hits), 0.98 * static_cast<double>(truth.size())) << seed;
    EXPECT_LE(static_cast<double>(found.found - found.hits), 0.02 * static_cast<double>(truth.size())) << seed;
  }
}
TEST(Survey, SurroundingsAsBrightAsTheBeadsHoldNoBeads) { expect_beads_in_the_pan_alone({51}); }
TEST(Survey, BrightSurroundingsOfOtherBedsHoldNoBeads) { expect_beads_in_the_pan_alone({52}); }

// Strangers' photographs with truth checked by hand; SHAKEBED_PHOTOGRAPHS names their folder (index.csv, a CSV a
// picture).
TEST(StrangersPhotographs, AreSurveyed) {
  const char* folder = std::getenv("SHAKEBED_PHOTOGRAPHS");
  if (folder == nullptr) GTEST_SKIP() << "SHAKEBED_PHOTOGRAPHS names no folder of photographs: not tested";
  for (const char* name : {"mlund_N20-light_f000", "mlund_N20-light_f200", "mlund_N55-light_f000", "trackpy_bf_0025"}) {
    std::vector<Place> truth;
    double radius = 0;
    std::ifstream table(std::filesystem::path(folder) / (std::string(name) + ".csv"));
    ASSERT_TRUE(table) << name;
    for (std::string line; std::getline(table, line);) {
      std::stringstream cells(line);
      std::string file, x, y, r;
      std::getline(cells, file, ','), std::getline(cells, x, ','), std::getline(cells, y, ','),
          std::getline(cells, r, ',');
      if (file == "file") continue;
      truth.push_back({std::stod(x), std::stod(y)});
      radius = std::stod(r);
    }
    const Survey survey = take_survey(read_channels(std::filesystem::path(folder) / (std::string(name) + ".png")));
    ASSERT_TRUE(survey.found) << name << ": " << survey.why_not;
    const Score found = score(survey.candidates.front().disks, truth, radius, [](const RimDisk& d) {
      return Place{d.circle.x, d.circle.y};
    });
    EXPECT_EQ(found.hits, truth.size()) << name;
    EXPECT_EQ(found.found, truth.size()) << name;
  }
  for (const char* name : {"none_bells_beach.jpg", "none_mlund_experiment.png"})
    EXPECT_FALSE(take_survey(read_channels(std::filesystem::path(folder) / name)).found) << name;
}

}  // namespace
}  // namespace shakebed::ingest
