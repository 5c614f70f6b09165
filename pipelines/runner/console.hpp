// What people see while a pipeline runs: messages and a progress line, all on stderr (results go to stdout).
#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <string_view>

namespace shakebed::pipelines {

// May be used from any thread.
class Console {
 public:
  enum class Level { quiet, normal, verbose };
  explicit Console(Level level = Level::normal);
  ~Console();

  void message(std::string_view line);  // not when quiet
  void detail(std::string_view line);   // only when verbose
  void warning(std::string_view line);  // always
  void error(std::string_view line);    // always
  // One line that is overwritten on a terminal; elsewhere a plain line every 10 %, or 20 s at most.
  void progress(std::string_view what, double fraction, std::string_view note = {});
  void end_progress();
  Level level() const { return level_; }

 private:
  void write(std::string_view prefix, std::string_view line);
  using Clock = std::chrono::steady_clock;
  Level level_;
  bool terminal_;
  std::mutex mutex_;
  bool line_open_ = false;
  std::string progress_of_;
  Clock::time_point progress_since_{}, progress_shown_{};
  double shown_fraction_ = -1;
};

// "3.2 s", "4 min 10 s", "120 ms".
std::string duration_text(double seconds);

}  // namespace shakebed::pipelines
