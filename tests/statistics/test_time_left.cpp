// Work of made-up durations by a made-up clock: what is said of the time left beside the truth.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "statistics/time_left.hpp"

namespace shakebed {
namespace {

struct Part {
  double takes;              // seconds of its thread, also what it took before it was interrupted
  double expected = 0;       // by a trial
  double reports_every = 0;  // seconds; 0: it says nothing until it is over
  double from = 0;           // it is taken up again at this fraction
  bool fails = false;        // at its end
};

// Runs the parts in their order on threads of a made-up clock, and asks at every step of it.
class MadeUpWork {
 public:
  MadeUpWork(std::vector<Part> parts, int threads)
      : parts_(std::move(parts)),
        time_(parts_.size(), threads, [this] { return now_; }),
        runs_(static_cast<std::size_t>(threads)),
        began_(parts_.size()),
        reported_(parts_.size(), -std::numeric_limits<double>::infinity()) {
    for (std::size_t i = 0; i < parts_.size(); ++i) time_.expect(i, parts_[i].expected);
    while (over_ < parts_.size()) {
      for (auto& thread : runs_) go_on(thread);
      if (over_ == parts_.size()) break;
      if (const auto left = time_.seconds()) said_.emplace_back(now_ - start, *left);
      now_ += 0.05;
    }
    end_ = now_ - start;
  }
  double fraction_at_the_end() const { return time_.fraction(); }

  // The largest factor by which what was said differs from the truth, from a tenth of the run to `last` of it.
  double worst_factor(double last = 0.95) const {
    double worst = said_.empty() || said_.front().first > 0.1 * end_ ? std::numeric_limits<double>::infinity() : 1;
    for (const auto& [at, left] : said_) {
      if (at < 0.1 * end_ || at > last * end_) continue;
      const double truth = end_ - at;
      worst = std::max({worst, left / truth, truth / std::max(left, 1e-9)});
    }
    return worst;
  }

 private:
  void go_on(std::optional<std::size_t>& thread) {
    if (thread && now_ - began_[*thread] >= parts_[*thread].takes * (1 - parts_[*thread].from) - 1e-9) {
      if (parts_[*thread].fails)
        time_.drop(*thread);
      else
        time_.end(*thread);
      ++over_;
      thread.reset();
    }
    if (!thread && next_ < parts_.size()) {
      thread = next_++;
      began_[*thread] = now_;
      time_.begin(*thread);
    }
    if (!thread) return;
    const Part& part = parts_[*thread];
    if (part.reports_every <= 0 || now_ < reported_[*thread] + part.reports_every) return;
    time_.reached(*thread, part.from + (now_ - began_[*thread]) / part.takes);
    reported_[*thread] = now_;
  }

  static constexpr double start = 1000;
  std::vector<Part> parts_;
  double now_ = start, end_ = 0;
  TimeLeft time_;
  std::vector<std::optional<std::size_t>> runs_;
  std::vector<double> began_, reported_;
  std::vector<std::pair<double, double>> said_;  // at which second, seconds left
  std::size_t next_ = 0, over_ = 0;
};

TEST(TimeLeft, IsUnknownWhileNothingIsKnown) {
  double now = 0;
  TimeLeft time(3, 1, [&] { return now; });
  EXPECT_FALSE(time.seconds());
  EXPECT_EQ(time.fraction(), 0);
  time.begin(0);
  now = 5;
  EXPECT_FALSE(time.seconds());
  time.end(0);
  ASSERT_TRUE(time.seconds());
  EXPECT_NEAR(*time.seconds(), 10, 1e-12);  // two more of 5 s
  EXPECT_NEAR(time.fraction(), 5.0 / 15, 1e-12);
}

TEST(TimeLeft, OfEvenPartsIsTheTruth) {
  EXPECT_LT(MadeUpWork(std::vector<Part>(20, {3, 0, 0.1}), 1).worst_factor(), 1.02);
  EXPECT_LT(MadeUpWork(std::vector<Part>(20, {3, 0, 0.1}), 2).worst_factor(), 1.02);
}

// Three threads have four replicas: at three quarters of the work, half of the time is left.
TEST(TimeLeft, KnowsThatThreadsStandIdle) {
  EXPECT_LT(MadeUpWork(std::vector<Part>(4, {10, 0, 0.1}), 3).worst_factor(), 1.02);
  EXPECT_LT(MadeUpWork(std::vector<Part>(1, {10, 0, 0.1}), 8).worst_factor(), 1.02);
}

TEST(TimeLeft, OfUnevenPartsIsWithinAFactorOfTwo) {
  // The expensive points stand first, last, or in the middle; the trial is off by up to 1.5 and the machine is three
  // times as slow as when the trial ran.
  const std::vector<std::vector<double>> orders{
      {60, 8, 4, 2, 1, 1, 1, 1}, {1, 1, 1, 1, 2, 4, 8, 60}, {1, 2, 60, 1, 1, 4, 8, 1}, {10, 20, 30, 5, 40, 5, 20, 15}};
  for (const auto& order : orders) {
    for (const int threads : {1, 2, 4}) {
      std::vector<Part> parts;
      for (std::size_t i = 0; i < order.size(); ++i)
        parts.push_back({order[i], order[i] / 3 * (i % 2 == 0 ? 1.25 : 0.8), 0.1});
      EXPECT_LT(MadeUpWork(parts, threads).worst_factor(), 2) << order[0] << " on " << threads;
    }
  }
}

TEST(TimeLeft, OfUnevenPartsThatSayNothingIsWithinAFactorOfTwo) {
  const std::vector<double> takes{12, 4, 9, 2, 1, 6, 30, 5, 8, 3};
  std::vector<Part> parts;
  for (std::size_t i = 0; i < takes.size(); ++i) parts.push_back({takes[i], takes[i] * (i % 2 == 0 ? 1.2 : 0.85), 0});
  // The last of them is known as well as its trial, not better: so until three quarters of the run.
  EXPECT_LT(MadeUpWork(parts, 1).worst_factor(0.75), 2);
  EXPECT_LT(MadeUpWork(parts, 2).worst_factor(0.75), 2);
}

// What was done before the interruption took no time now.
TEST(TimeLeft, OfWorkThatIsTakenUpAgainCountsWhatIsLeft) {
  EXPECT_LT(MadeUpWork({{100, 0, 0.1, 0.6}}, 1).worst_factor(), 1.05);
  std::vector<Part> parts(6, {20, 10, 0.1});
  parts[0].from = 0.9, parts[1].from = 0.3;
  EXPECT_LT(MadeUpWork(parts, 2).worst_factor(), 1.5);
}

TEST(TimeLeft, IgnoresHowLongAFailureTook) {
  std::vector<Part> parts(12, {10, 0, 0.1});
  for (std::size_t i = 0; i < 3; ++i) parts[4 * i] = {0.1, 0, 0, 0, true};
  EXPECT_LT(MadeUpWork(parts, 1).worst_factor(), 2);
  for (Part& part : parts) part.expected = 5;
  EXPECT_LT(MadeUpWork(parts, 2).worst_factor(), 2);
}

TEST(TimeLeft, OfDroppedPartsIsNothing) {
  double now = 0;
  TimeLeft time(4, 1, [&] { return now; });
  for (std::size_t i = 0; i < 4; ++i) time.expect(i, 7);
  EXPECT_NEAR(*time.seconds(), 28, 1e-12);
  time.drop(1);
  time.drop(2);
  EXPECT_NEAR(*time.seconds(), 14, 1e-12);
}

TEST(TimeLeft, EndsAtNothing) { EXPECT_NEAR(MadeUpWork({{3, 1, 0.1}, {5, 2, 0.1}}, 1).fraction_at_the_end(), 1, 1e-9); }

// Half of the work in 10 s, then ten times as slow: soon afterwards the new pace is believed.
TEST(TimeLeft, FollowsAPartThatBecomesSlower) {
  double now = 0;
  TimeLeft time(1, 1, [&] { return now; });
  time.begin(0);
  double reached = 0;
  for (int i = 0; i <= 1000; ++i, now += 0.1) {
    time.reached(0, reached);
    reached += now < 10 ? 0.005 : 0.0005;
    if (now > 35 && reached < 0.95) {
      const double truth = (1 - reached) / 0.0005 * 0.1;
      EXPECT_GT(*time.seconds(), truth / 2) << now;
      EXPECT_LT(*time.seconds(), truth * 2) << now;
    }
  }
}

// The first part took 20 s instead of 10 s. A hundredth of the whole, 0.2 s, counts as done at the expected pace.
TEST(TimeLeft, TrustsWhatIsExpectedLikeAHundredthOfTheWhole) {
  double now = 0;
  TimeLeft time(2, 1, [&] { return now; });
  time.expect(0, 10);
  time.expect(1, 10);
  time.begin(0);
  now = 20;
  time.end(0);
  EXPECT_NEAR(*time.seconds(), 10 * (20 + 0.2) / (10 + 0.2), 1e-12);
}

// Two equal parts on one thread, by pencil: the pace since the last report but one (reports count from twice the time
// on), weighed against the pace so far as ten hundredths of a part are against what is done of it.
TEST(TimeLeft, OfAPartThatReportsIsDoneByHand) {
  double now = 100;
  TimeLeft time(2, 1, [&] { return now; });
  time.begin(0);
  const auto reaches = [&](double seconds, double fraction) {
    now = 100 + seconds;
    time.reached(0, fraction);
  };
  reaches(0, 0);
  reaches(2, 0.2);
  reaches(5, 0.4);  // 12.5 s a part so far, 15 s of late
  now = 106;
  EXPECT_NEAR(*time.seconds(), 0.8 * 15 * 0.6 + 0.2 * 12.5 * 0.6 - 1 + 12.5, 1e-12);
  reaches(9, 0.5);  // 18 s a part so far; 9 s are not twice 5 s: of late is from 2 s on
  EXPECT_NEAR(*time.seconds(), 5.0 / 6 * 7 / 0.3 * 0.5 + 1.0 / 6 * 18 * 0.5 + 18, 1e-12);
  EXPECT_NEAR(time.fraction(), 9 / (9 + *time.seconds()), 1e-12);
  reaches(10, 1.5);  // no more than all of it
  EXPECT_NEAR(*time.seconds(), 10, 1e-12);
}

// Expected 10 s, and it goes on and on without a word: the time left never becomes zero.
TEST(TimeLeft, OfALatePartGrowsWithItsDelay) {
  double now = 0;
  TimeLeft time(1, 1, [&] { return now; });
  time.expect(0, 10);
  time.begin(0);
  now = 4;
  EXPECT_NEAR(*time.seconds(), 6, 1e-12);
  now = 50;
  EXPECT_NEAR(*time.seconds(), 10, 1e-12);
}

// A part that says again how far it is has not gone on.
TEST(TimeLeft, OfAPartThatRepeatsItsReportIsThatOfTheFirst) {
  double now = 0;
  TimeLeft once(1, 1, [&] { return now; }), twice(1, 1, [&] { return now; });
  for (TimeLeft* time : {&once, &twice}) {
    time->expect(0, 10);
    time->begin(0);
    time->reached(0, 0.0);
  }
  now = 5;
  once.reached(0, 0.5);
  twice.reached(0, 0.5);
  now = 7;
  twice.reached(0, 0.5);
  now = 8;
  EXPECT_EQ(*twice.seconds(), *once.seconds());
}

// A part that was complete when it was taken up says nothing of the pace.
TEST(TimeLeft, OfAPartThatWasCompleteIsUnknown) {
  double now = 0;
  TimeLeft time(2, 1, [&] { return now; });
  time.begin(0);
  time.reached(0, 1.0);
  now = 1;
  time.end(0);
  EXPECT_FALSE(time.seconds().has_value());
  EXPECT_EQ(time.fraction(), 0);
}

// Three parts of 10, 20 and 30 s on two threads, by pencil: what runs is done after 6 and 12 s, the third begins on the
// thread that is free first.
TEST(TimeLeft, OfTwoThreadsIsThatOfTheLastOne) {
  double now = 0;
  TimeLeft time(4, 2, [&] { return now; });
  time.expect(0, 10);
  time.expect(1, 20);
  time.expect(2, 30);
  time.expect(3, -5);  // takes no time
  EXPECT_NEAR(*time.seconds(), 40, 1e-12) << "10 and 30 on one thread, 20 on the other";
  EXPECT_EQ(time.fraction(), 0) << "it has not begun";
  time.begin(0);
  time.begin(1);
  now = 4;
  EXPECT_NEAR(*time.seconds(), 6 + 30, 1e-12);
  EXPECT_NEAR(time.fraction(), 4.0 / 40, 1e-12);
  time.end(0);
  // 4 s for 10 expected ones; the whole, 60 s, counts as 0.6 s at the pace expected. The second part has taken 4 s.
  const double pace = (4 + 0.6) / (10 + 0.6);
  EXPECT_NEAR(*time.seconds(), 30 * pace, 1e-12);
  EXPECT_GT(30 * pace, 20 * pace - 4);
  time.begin(2);
  time.drop(2);
  now = 5;
  EXPECT_NEAR(*time.seconds(), 20 * pace - 5, 1e-12);
}

// Taken up again at 0.6, it reaches 0.8 in 10 s: half of what was left. What was there before took no time now.
TEST(TimeLeft, CountsFromWhereAPartIsTakenUp) {
  double now = 50;
  TimeLeft time(2, 1, [&] { return now; });
  time.begin(0);
  time.reached(0, -1);  // no less than nothing
  now = 60;
  time.begin(0);
  time.reached(0, 0.6);
  now = 70;
  time.reached(0, 0.8);
  now = 72;
  // 10 s for 0.2: 50 s a part by itself and by the pace of all. 10 s were left two seconds ago; the second part
  // takes 50.
  EXPECT_NEAR(*time.seconds(), 8 + 50, 1e-12);
  time.reached(0, 0.7);  // never back
  EXPECT_NEAR(*time.seconds(), 8 + 50, 1e-12);
  time.end(1);  // it does not run
  EXPECT_NEAR(*time.seconds(), 8 + 50, 1e-12);
  now = 80;
  time.end(0);
  EXPECT_NEAR(*time.seconds(), 20 / 0.4, 1e-12) << "0.4 of a part in 20 s";
  time.reached(0, 0.9);  // too late
  EXPECT_NEAR(*time.seconds(), 20 / 0.4, 1e-12);
}

// After a part of 10 s the second one, taken up at 0.6, needs 10 s for 0.2. By itself it has 10 s left. At the pace of
// both, 20 s for 1.2 parts, it has a third of that. Its 0.2 done count as twice the 0.1 at which both count alike.
TEST(TimeLeft, TrustsAPartByWhatItHasDoneSinceItWasTakenUp) {
  double now = 0;
  TimeLeft time(2, 1, [&] { return now; });
  time.begin(0);
  now = 10;
  time.end(0);
  time.begin(1);
  time.reached(1, 0.6);
  now = 20;
  time.reached(1, 0.8);
  EXPECT_NEAR(*time.seconds(), (2 * 10 + 20 / 1.2 * 0.2) / 3, 1e-12);
}

// In its first second, too: half a second of four. Where nothing is known of its parts, it has none.
TEST(TimeLeft, HasAFractionFromItsBeginningOn) {
  double now = 10;
  TimeLeft time(2, 1, [&] { return now; });
  time.expect(0, 2);
  time.expect(1, 2);
  time.begin(0);
  EXPECT_EQ(time.fraction(), 0);
  now = 10.5;
  EXPECT_NEAR(time.fraction(), 0.5 / 4, 1e-12);
  TimeLeft at_once(1, 1, [&] { return now; });  // done before any time has passed
  at_once.expect(0, 2);
  at_once.begin(0);
  at_once.end(0);
  EXPECT_EQ(at_once.fraction(), 0);
  TimeLeft unknown(1, 1, [&] { return now; });
  now = 20;
  ASSERT_FALSE(unknown.seconds());
  EXPECT_EQ(unknown.fraction(), 0);
}

}  // namespace
}  // namespace shakebed
