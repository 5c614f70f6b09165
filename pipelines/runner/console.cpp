#include "pipelines/runner/console.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace shakebed::pipelines {

Console::Console(Level level, std::function<Clock::time_point()> now)
    : level_(level), now_(std::move(now)), terminal_(::isatty(STDERR_FILENO) == 1) {}
Console::~Console() { end_progress(); }

void Console::write(std::string_view prefix, std::string_view line) {
  const std::lock_guard lock(mutex_);
  std::string text;
  if (line_open_) text += "\r\033[K";
  line_open_ = false;
  text += prefix;
  text += line;
  text += '\n';
  std::fwrite(text.data(), 1, text.size(), stderr);
}

void Console::message(std::string_view line) {
  if (level_ != Level::quiet) write("", line);
}
void Console::detail(std::string_view line) {
  if (level_ == Level::verbose) write("", line);
}
void Console::warning(std::string_view line) {
  {
    const std::lock_guard lock(mutex_);
    if (!warned_.emplace(line).second) return;
  }
  write("warning: ", line);
}
void Console::error(std::string_view line) { write("error: ", line); }

namespace {
// Work that reports progress above 0 this early continues an earlier run.
constexpr double taken_up_again = 1;  // [s]
}  // namespace

void Console::progress(std::string_view what, double fraction, std::string_view note,
                       std::optional<double> seconds_left) {
  if (level_ == Level::quiet) return;
  const std::lock_guard lock(mutex_);
  const auto now = now_();
  if (what != progress_of_) {
    progress_of_ = what;
    progress_since_ = progress_shown_ = now;
    shown_fraction_ = first_fraction_ = 0;
    return;
  }
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (first_fraction_ <= 0 && fraction > 0 &&
      std::chrono::duration<double>(now - progress_since_).count() < taken_up_again) {
    progress_since_ = now;
    first_fraction_ = fraction;
  }
  const double since_shown = std::chrono::duration<double>(now - progress_shown_).count();
  const double elapsed = std::chrono::duration<double>(now - progress_since_).count();
  const bool show =
      terminal_ ? since_shown >= 0.1 : since_shown >= 20 || (fraction >= shown_fraction_ + 0.1 && since_shown >= 2);
  if (!show) return;
  progress_shown_ = now;
  shown_fraction_ = fraction;
  std::string left;
  const double done = fraction - first_fraction_;
  if (seconds_left)
    left = fmt::format(", {} left", duration_text(*seconds_left));
  else if (fraction <= 0)
    left = fmt::format(", for {}", duration_text(elapsed));
  else if (done > 0.02 && elapsed > 0.5)
    left = fmt::format(", {} left", duration_text(elapsed * (1 - fraction) / done));
  std::string line = fmt::format("  {}:", what);
  if (fraction > 0) line += fmt::format(" {:3.0f} %", 100 * fraction);
  if (!note.empty()) line += fmt::format(" {}", note);
  line += fraction > 0 || !note.empty() ? left : left.substr(1);
  if (terminal_) {
    std::fputs(("\r\033[K" + line.substr(0, 118)).c_str(), stderr);
    std::fflush(stderr);
    line_open_ = true;
  } else {
    std::fputs((line + "\n").c_str(), stderr);
  }
}

void Console::end_progress() {
  const std::lock_guard lock(mutex_);
  if (line_open_) std::fputs("\r\033[K", stderr);
  line_open_ = false;
  progress_of_.clear();
}

}  // namespace shakebed::pipelines
