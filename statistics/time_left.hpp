// How long work in several parts still takes, on several threads.
//
//   TimeLeft time(parts, threads);
//   time.expect(i, seconds);    // of each part, as far as it is known: from a short trial, say
//   time.begin(i); time.reached(i, 0.3); time.end(i);
//   time.seconds();
//
// Expected times need not be true, only their ratios: what begun parts took gives the pace. Parts are begun in their
// order, each by the first thread that is free. May be used from any thread.
#pragma once

#include <cstddef>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

namespace shakebed {

class TimeLeft {
 public:
  using Clock = std::function<double()>;  // [s]
  // No clock: a steady one.
  TimeLeft(std::size_t parts, int threads, Clock clock = {});

  void expect(std::size_t part, double seconds);  // of one thread; 0: none, or unknown where all are 0
  void begin(std::size_t part);
  // So much of the part is over, 0 to 1. The first call states where it begins: at 0, or later where an interrupted
  // part continues.
  void reached(std::size_t part, double fraction);
  void end(std::size_t part);
  void drop(std::size_t part);  // it failed, or need not run: it says nothing of the other parts

  // The time left; nothing while nothing is known.
  std::optional<double> seconds() const;
  // The share of the whole time that is over, 0 to 1; 0 while nothing is known. As a stage's progress it makes the
  // stated time left that of seconds().
  double fraction() const;

 private:
  struct Part {
    enum class State { waiting, runs, over, dropped } state = State::waiting;
    double expected = 0;
    // The first report, and what was reached last: time and fraction.
    bool reported = false;
    double from_time = 0, from = 0, reached_time = 0, reached = 0;
    // Two earlier reports: the pace of late counts, for a part may become slower. The second one moves on whenever the
    // part's time has doubled since, the first follows it: it lies in the first half of the part's time.
    double earlier_time = 0, earlier = 0, later_time = 0, later = 0;
    double ended = 0;
  };
  struct Scale {
    bool equal;   // no part's time is known beforehand: all count the same
    double pace;  // seconds for an expected second; not positive: unknown
  };
  double expected(const Part& part, const Scale& scale) const { return scale.equal ? 1 : part.expected; }
  Scale scale() const;
  double left_of(const Part& part, const Scale& scale, double now) const;
  std::optional<double> seconds_at(double now) const;

  Clock clock_;
  int threads_;
  double start_;
  mutable std::mutex mutex_;
  std::vector<Part> parts_;
};

}  // namespace shakebed
