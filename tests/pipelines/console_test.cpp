// What is said of the progress where stderr is no terminal, by a made-up clock.
#include "pipelines/runner/console.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace shakebed::pipelines;
using testing::ElementsAre;

class ConsoleProgress : public testing::Test {
 protected:
  ConsoleProgress() { testing::internal::CaptureStderr(); }
  ~ConsoleProgress() override {
    if (!read_) testing::internal::GetCapturedStderr();
  }
  // The fraction that is reached so many seconds after the start.
  void reaches(double seconds, double fraction, std::optional<double> left = {}) {
    seconds_ = seconds;
    console_.progress("bed", fraction, "", left);
  }
  std::vector<std::string> lines() {
    read_ = true;
    std::istringstream text(testing::internal::GetCapturedStderr());
    std::vector<std::string> all;
    for (std::string line; std::getline(text, line);) all.push_back(line);
    return all;
  }
  double seconds_ = 0;
  bool read_ = false;
  Console console_{Console::Level::normal, [this] {
                     return Console::Clock::time_point{} + std::chrono::duration_cast<Console::Clock::duration>(
                                                               std::chrono::duration<double>(1000 + seconds_));
                   }};
};

// A line every 10 % where two seconds have passed since the last one, else one every 20 s; the time left as time went.
TEST_F(ConsoleProgress, IsALineATenthOrEveryTwentySeconds) {
  reaches(0, 0);
  reaches(1.5, 0.15);  // too soon
  reaches(5, 0.25);
  reaches(8, 0.3);  // not a tenth more
  reaches(9, 0.36);
  reaches(10, 0.6);   // too soon after the last
  reaches(28, 0.42);  // not 20 s
  reaches(29, 0.42);
  EXPECT_THAT(lines(), ElementsAre("  bed:  25 %, 15 s left", "  bed:  36 %, 16 s left", "  bed:  42 %, 40 s left"));
}

// Work that goes on where it was stopped has done so much in no time: a quarter of the rest in 10 s leaves 30 s.
TEST_F(ConsoleProgress, OfWorkTakenUpAgainCountsWhatIsDoneNow) {
  reaches(0, 0);
  reaches(0.5, 0.6);
  reaches(10.5, 0.7);
  EXPECT_THAT(lines(), ElementsAre("  bed:  70 %, 30 s left"));
}

// The time left as it is given; before anything is done, how long it has taken.
TEST_F(ConsoleProgress, SaysTheTimeThatIsGiven) {
  reaches(0, 0);
  reaches(21, 0);
  reaches(30, 0.5, 7.0);
  EXPECT_THAT(lines(), ElementsAre("  bed: for 21 s", "  bed:  50 %, 7.0 s left"));
}

TEST(ConsoleMessages, AreThoseOfTheirLevel) {
  const auto said = [](Console::Level level) {
    testing::internal::CaptureStderr();
    {
      Console console(level);
      console.message("m");
      console.detail("d");
      console.warning("w");
      console.warning("w");
      console.error("e");
    }
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(said(Console::Level::quiet), "warning: w\nerror: e\n");
  EXPECT_EQ(said(Console::Level::normal), "m\nwarning: w\nerror: e\n");
  EXPECT_EQ(said(Console::Level::verbose), "m\nd\nwarning: w\nerror: e\n");
}

}  // namespace
