#include "ingest/find/nearby.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

namespace shakebed::ingest {
namespace {

using Places = std::vector<std::pair<double, double>>;

Nearby nearby(const Places& places, double distance) {
  return {places.size(), distance, [&](std::size_t i) { return places[i]; }};
}

bool near(const std::pair<double, double>& a, double x, double y, double distance) {
  const double dx = a.first - x, dy = a.second - y;
  return dx * dx + dy * dy < distance * distance;
}

TEST(Nearby, FindsThePairsAndTheNeighboursThatAllAgainstAllFinds) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> across(-30, 70), down(-5, 12);
  for (const double distance : {0.3, 2.0, 9.0, 200.0}) {
    Places places;
    for (int k = 0; k < 300; ++k) places.emplace_back(across(random), down(random));
    const Nearby grid = nearby(places, distance);
    std::set<std::pair<std::size_t, std::size_t>> expected, seen;
    for (std::size_t i = 0; i < places.size(); ++i)
      for (std::size_t j = i + 1; j < places.size(); ++j)
        if (near(places[i], places[j].first, places[j].second, distance)) expected.emplace(i, j);
    grid.pairs([&](std::size_t i, std::size_t j) {
      EXPECT_LE(places[i].second, places[j].second);
      EXPECT_TRUE(seen.emplace(std::min(i, j), std::max(i, j)).second) << "a pair twice";
      return false;
    });
    EXPECT_EQ(seen, expected);
    for (int k = 0; k < 200; ++k) {
      const double x = 1.5 * across(random), y = 1.5 * down(random);
      std::vector<std::size_t> found;
      grid.any_near(x, y, [&](std::size_t i) {
        found.push_back(i);
        return false;
      });
      std::size_t count = 0;
      for (const auto& place : places) count += near(place, x, y, distance);
      EXPECT_EQ(found.size(), count);
      for (std::size_t n = 1; n < found.size(); ++n) EXPECT_LE(places[found[n - 1]].second, places[found[n]].second);
      EXPECT_EQ(grid.any_near(x, y), count > 0);
    }
  }
}

TEST(Nearby, StopsWhereTold) {
  const Places places = {{0, 0}, {1, 0.1}, {0, 0.2}, {1, 0.3}};
  const Nearby grid = nearby(places, 3);
  std::size_t visits = 0;
  grid.pairs([&](std::size_t i, std::size_t) {
    ++visits;
    return i == 0;
  });
  EXPECT_EQ(visits, 1U + 2 + 1);
  visits = 0;
  EXPECT_TRUE(grid.any_near(0, 0, [&](std::size_t i) {
    ++visits;
    return i == 1;
  }));
  EXPECT_EQ(visits, 2U);
}

TEST(Nearby, TakesNothingAndTheSamePlaceTwice) {
  EXPECT_FALSE(nearby({}, 1).any_near(0, 0));
  const Places places(5, {2.5, 2.5});
  std::size_t pairs = 0;
  nearby(places, 1e-3).pairs([&](std::size_t, std::size_t) { return ++pairs, false; });
  EXPECT_EQ(pairs, 10U);
}

}  // namespace
}  // namespace shakebed::ingest
