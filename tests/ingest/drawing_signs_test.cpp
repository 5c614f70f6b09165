// Screen copies of plots, tables and drawings with round marks: without noise, and refused; beads drawn without noise,
// and found.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <vector>

#include "ingest/find/drawing_signs.hpp"
#include "ingest/find/survey.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest::drawing_signs_test {
namespace {

constexpr int wide = 640, high = 480;
const cv::Scalar black(20, 20, 20), grey(200, 200, 200), blue(180, 110, 40), red(40, 40, 200);

cv::Mat page(const cv::Scalar& colour = cv::Scalar(255, 255, 255)) { return cv::Mat(high, wide, CV_8UC3, colour); }

int within(std::mt19937& random, int from, int to) {
  return from + static_cast<int>(random() % static_cast<unsigned>(to - from));
}

void mark(cv::Mat& on, double x, double y, double radius, const cv::Scalar& colour) {
  const auto fixed = [](double value) { return static_cast<int>(std::lround(16 * value)); };
  cv::circle(on, {fixed(x), fixed(y)}, fixed(radius), colour, cv::FILLED, cv::LINE_AA, 4);
}

void words(cv::Mat& on, const std::string& text, int x, int y, double size = 0.5) {
  cv::putText(on, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, size, black, 1, cv::LINE_AA);
}

void axes(cv::Mat& on, bool box, bool grid) {
  if (grid)
    for (int k = 1; k < 6; ++k) {
      cv::line(on, {70, 430 - 65 * k}, {610, 430 - 65 * k}, grey);
      cv::line(on, {70 + 90 * k, 40}, {70 + 90 * k, 430}, grey);
    }
  cv::line(on, {70, 430}, {610, 430}, black);
  cv::line(on, {70, 40}, {70, 430}, black);
  if (box) cv::rectangle(on, cv::Point(70, 40), cv::Point(610, 430), black);
  for (int k = 0; k <= 6; ++k) words(on, std::to_string(10 * k), 60 + 88 * k, 450, 0.4);
  words(on, "time in seconds", 270, 472);
  for (int k = 0; k <= 5; ++k) {
    cv::line(on, {64, 430 - 75 * k}, {70, 430 - 75 * k}, black);
    words(on, std::to_string(5 * k), 36, 434 - 75 * k, 0.4);
  }
}

cv::Mat scatter(std::mt19937& random, bool box, bool grid, int marks, double radius) {
  cv::Mat on = page();
  axes(on, box, grid);
  for (int k = 0; k < marks; ++k)
    mark(on, within(random, 80, 600), within(random, 50, 420), radius, k % 3 ? blue : red);
  return on;
}

cv::Mat curve_with_marks(std::mt19937& random, bool box) {
  cv::Mat on = page();
  axes(on, box, false);
  const double phase = within(random, 0, 100) / 16.0;
  cv::Point last;
  for (int k = 0; k < 25; ++k) {
    const double x = 85 + 21 * k, y = 235 - 140 * std::sin(0.3 * k + phase);
    const cv::Point here(static_cast<int>(x), static_cast<int>(y));
    if (k > 0) cv::line(on, last, here, blue, 2, cv::LINE_AA);
    last = here;
    mark(on, x, y, 6, blue);
  }
  return on;
}

cv::Mat network(std::mt19937& random) {
  cv::Mat on = page();
  std::vector<cv::Point> knots;
  for (int row = 0; row < 5; ++row)
    for (int column = 0; column < 6; ++column)
      knots.emplace_back(70 + 100 * column + within(random, -15, 15), 50 + 95 * row + within(random, -15, 15));
  for (std::size_t a = 0; a < knots.size(); ++a)
    for (std::size_t b = a + 1; b < knots.size(); ++b)
      if (cv::norm(knots[a] - knots[b]) < 150) cv::line(on, knots[a], knots[b], black, 2, cv::LINE_AA);
  for (const cv::Point& knot : knots) mark(on, knot.x, knot.y, 14, blue);
  return on;
}

cv::Mat list_with_bullets(std::mt19937& random) {
  cv::Mat on = page();
  for (int row = 0; row < 14; ++row) {
    mark(on, 40, 40.5 + 30 * row, 6, black);
    std::string line;
    for (int k = 0; k < 38; ++k) line += static_cast<char>(random() % 6 ? 'a' + random() % 26 : ' ');
    words(on, line, 60, 46 + 30 * row);
  }
  return on;
}

cv::Mat table_of_ratings(std::mt19937& random) {
  cv::Mat on = page();
  for (int row = 0; row <= 12; ++row) cv::line(on, {20, 30 + 34 * row}, {620, 30 + 34 * row}, grey);
  for (int column = 0; column <= 6; ++column) cv::line(on, {20 + 100 * column, 30}, {20 + 100 * column, 438}, grey);
  for (int row = 0; row < 12; ++row) {
    words(on, "item " + std::to_string(row + 1), 30, 52 + 34 * row);
    for (int column = 1; column < 6; ++column)
      if (random() % 3) mark(on, 70 + 100 * column, 47 + 34 * row, 9, column % 2 ? blue : red);
  }
  return on;
}

cv::Mat board_of_a_game(std::mt19937& random) {
  cv::Mat on = page({120, 170, 220});
  for (int k = 0; k < 13; ++k) {
    cv::line(on, {110 + 34 * k, 36}, {110 + 34 * k, 444}, black);
    cv::line(on, {110, 36 + 34 * k}, {518, 36 + 34 * k}, black);
  }
  for (int k = 0; k < 60; ++k) {
    const int column = within(random, 0, 13), row = within(random, 0, 13);
    mark(on, 110 + 34 * column, 36 + 34 * row, 14, random() % 2 ? black : cv::Scalar(250, 250, 250));
  }
  return on;
}

cv::Mat lines_of_an_underground(std::mt19937& random) {
  cv::Mat on = page();
  const cv::Scalar colours[] = {blue, red, {60, 160, 60}, {30, 160, 230}};
  for (int line = 0; line < 4; ++line) {
    std::vector<cv::Point> stops;
    for (int k = 0; k < 9; ++k) stops.emplace_back(40 + 70 * k, 80 + 90 * line + within(random, -35, 35));
    for (std::size_t k = 1; k < stops.size(); ++k) cv::line(on, stops[k - 1], stops[k], colours[line], 5, cv::LINE_AA);
    for (const cv::Point& stop : stops) {
      mark(on, stop.x, stop.y, 9, black);
      mark(on, stop.x, stop.y, 6, {255, 255, 255});
      words(on, "stop " + std::to_string(within(random, 1, 99)), stop.x - 18, stop.y + 24, 0.35);
    }
  }
  return on;
}

using Draw = std::function<cv::Mat(std::mt19937&)>;
struct ScreenCopy {
  std::string name;
  Draw draw;
  bool ruled = true;  // then it is refused as a JPEG too
};
std::vector<ScreenCopy> screen_copies() {
  return {{"points between two axes", [](auto& r) { return scatter(r, false, false, 60, 5); }},
          {"large points between two axes", [](auto& r) { return scatter(r, false, false, 40, 11); }},
          {"points in a box", [](auto& r) { return scatter(r, true, false, 90, 6); }},
          {"points on a grid", [](auto& r) { return scatter(r, true, true, 120, 6); }},
          {"few points on a grid", [](auto& r) { return scatter(r, false, true, 18, 8); }},
          {"a curve with points", [](auto& r) { return curve_with_marks(r, false); }},
          {"a curve with points in a box", [](auto& r) { return curve_with_marks(r, true); }},
          {"a network", network, false},
          {"a list with bullets", list_with_bullets},
          {"a table of ratings", table_of_ratings},
          {"the board of a game", board_of_a_game},
          {"lines of an underground", lines_of_an_underground, false}};
}

Survey survey_of_file(const cv::Mat& picture, const std::string& ending, const SurveyOptions& options = {}) {
  const test::ScratchFolder folder;
  const std::string path = folder / ("screen" + ending);
  cv::imwrite(path, picture);
  constexpr std::size_t all_pixels = 6'000'000;
  return take_survey(read_channels(path, 0, all_pixels, {.channel = Channel::grey}), options);
}

// The first, and of those that follow every `step`-th.
void expect_screen_copies_refused(const std::string& ending, std::size_t step = 1) {
  const std::vector<ScreenCopy> copies = screen_copies();
  for (std::size_t k = 0; k < copies.size(); k += step) {
    const ScreenCopy& copy = copies[k];
    if (!copy.ruled && ending == ".jpg") continue;
    std::mt19937 random(1);
    const Survey survey = survey_of_file(copy.draw(random), ending);
    EXPECT_FALSE(survey.found) << copy.name << ending << ": " << survey.candidates.front().disks.size() << " disks";
  }
}
TEST(DrawingSigns, ScreenCopiesWithRoundMarksAreRefused) { expect_screen_copies_refused(".png", 10); }
TEST(DrawingSigns, ScreenCopiesOfEveryKindAreRefused) { expect_screen_copies_refused(".png"); }
TEST(DrawingSigns, ScreenCopiesSavedAsJpegAreRefused) { expect_screen_copies_refused(".jpg"); }

// With --shape any the marks of a plot are measured; a warning then says that it is a plot.
TEST(DrawingSigns, MarksAreMeasuredWhenAskedFor) {
  std::mt19937 random(1);
  SurveyOptions any;
  any.any_shape = true;
  const Survey survey = survey_of_file(scatter(random, true, true, 60, 11), ".png", any);
  ASSERT_TRUE(survey.found) << survey.why_not;
  EXPECT_FALSE(survey.candidates.front().why_drawn.empty());
}

// Black may be a camera's limit: what is between black and white tells whether there is noise.
TEST(DrawingSigns, ADarkPhotographIsNoDrawing) {
  std::mt19937 random(3);
  cv::Mat on(high, wide, CV_8U, cv::Scalar(0)), noise(high, wide, CV_16S);
  for (int k = 0; k < 20; ++k) mark(on, within(random, 30, 600), within(random, 30, 440), 14, cv::Scalar(90));
  cv::theRNG().state = 2;
  cv::randn(noise, 0, 3);
  cv::Mat noisy;
  cv::add(on, noise, noisy, on, CV_8U);
  const auto drawn = [](const cv::Mat& picture) {
    GrayFrame frame{picture.cols, picture.rows, {}};
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.cols; ++column)
        frame.pixels.push_back(picture.at<std::uint8_t>(row, column));
    return signs_of_drawing(frame).looks_drawn();
  };
  EXPECT_TRUE(drawn(on));
  EXPECT_FALSE(drawn(noisy));
}

// Beads in a box, drawn without noise: walls and floor are ruled lines, but the beads make up the picture.
TEST(DrawingSigns, BeadsDrawnWithoutNoiseAreFound) {
  std::mt19937 random(5);
  cv::Mat on = page();
  cv::line(on, {40, 20}, {40, 460}, black, 3);
  cv::line(on, {600, 20}, {600, 460}, black, 3);
  cv::line(on, {40, 460}, {600, 460}, black, 3);
  std::size_t beads = 0;
  for (int row = 0; row < 14; ++row)
    for (int column = 0; column < 26; ++column)
      if (random() % 5) {
        mark(on, 55 + 21 * column + within(random, -1, 1), 446 - 21 * row, 9.5, blue);
        ++beads;
      }
  const Survey survey = survey_of_file(on, ".png");
  ASSERT_TRUE(survey.found) << survey.why_not;
  EXPECT_NEAR(static_cast<double>(survey.candidates.front().disks.size()), static_cast<double>(beads),
              0.1 * static_cast<double>(beads));
}

// Shares are those of the pixels inside: of 3 x 3 px there is one, of fewer none.
TEST(DrawingSigns, AreThoseOfInnerPixels) {
  const auto even = [](int width, int height) {
    GrayFrame frame{width, height, {}};
    frame.pixels.assign(static_cast<std::size_t>(width * height), 100.0F);
    return signs_of_drawing(frame);
  };
  EXPECT_EQ(even(3, 3).flat_share, 1);
  EXPECT_EQ(even(2, 3).flat_share, 0);
  EXPECT_EQ(even(3, 2).flat_share, 0);
}

// The region alone is judged, so a photograph on a page can be cut out.
TEST(DrawingSigns, APhotographOnAPageIsFoundInItsRegion) {
  std::mt19937 random(8);
  cv::Mat on = page();
  for (int row = 0; row < 6; ++row) cv::line(on, {20, 40 + 18 * row}, {620, 40 + 18 * row}, black);
  cv::Mat photograph(260, 420, CV_8UC3, cv::Scalar(190, 190, 190));
  for (int row = 0; row < 9; ++row)
    for (int column = 0; column < 15; ++column)
      mark(photograph, 25 + 26 * column + within(random, -2, 3), 24 + 26 * row + within(random, -2, 3), 10, black);
  cv::GaussianBlur(photograph, photograph, {}, 0.8);
  cv::Mat noise(photograph.size(), CV_16SC3);
  cv::theRNG().state = 4;
  cv::randn(noise, 0, 4);
  cv::add(photograph, noise, photograph, cv::noArray(), CV_8UC3);
  photograph.copyTo(on(cv::Rect(110, 170, 420, 260)));
  SurveyOptions inside;
  inside.roi = PixelRectangle{110, 170, 420, 260};
  const Survey survey = survey_of_file(on, ".png", inside);
  ASSERT_TRUE(survey.found) << survey.why_not;
  EXPECT_EQ(survey.candidates.front().disks.size(), 135U);
}

}  // namespace
}  // namespace shakebed::ingest::drawing_signs_test
