// What people see while a pipeline runs: messages and a progress line, all on stderr (results go to stdout).
#pragma once

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "pipelines/formats/duration.hpp"

namespace shakebed::pipelines {

// May be used from any thread.
class Console {
 public:
  enum class Level { quiet, normal, verbose };
  using Clock = std::chrono::steady_clock;
  // `now`: the time, for tests.
  explicit Console(Level level = Level::normal, std::function<Clock::time_point()> now = Clock::now);
  ~Console();

  void message(std::string_view line);  // not when quiet
  void detail(std::string_view line);   // only when verbose
  void warning(std::string_view line);  // always, the same one once
  void error(std::string_view line);    // always
  // One line that is overwritten on a terminal; elsewhere a plain line every 10 %, or 20 s at most. The fraction is the
  // share of the time that is over, from which the time left follows where it is not given. Call it with 0 at the
  // start: work that is taken up again says soon afterwards how much is done.
  void progress(std::string_view what, double fraction, std::string_view note = {},
                std::optional<double> seconds_left = {});
  void end_progress();
  Level level() const { return level_; }

 private:
  void write(std::string_view prefix, std::string_view line);
  Level level_;
  std::function<Clock::time_point()> now_;
  bool terminal_;
  std::mutex mutex_;
  bool line_open_ = false;
  std::set<std::string, std::less<>> warned_;
  std::string progress_of_;
  Clock::time_point progress_since_{}, progress_shown_{};
  double shown_fraction_ = -1;
  double first_fraction_ = 0;  // at progress_since_
};

}  // namespace shakebed::pipelines
