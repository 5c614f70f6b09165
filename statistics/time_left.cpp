#include "statistics/time_left.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace shakebed {

namespace {

// Expected times count like work that is done at the expected pace, of this share of the whole.
constexpr double trust_in_expected = 0.01;
// From this fraction of a part on, what the part itself took counts as much as what was expected of it.
constexpr double trust_in_part = 0.1;
// A part that takes longer than expected and says nothing takes this share longer still.
constexpr double share_of_late = 0.2;

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

TimeLeft::TimeLeft(std::size_t parts, int threads, Clock clock)
    : clock_(clock ? std::move(clock) : Clock(steady_seconds)),
      threads_(std::max(1, threads)),
      start_(clock_()),
      parts_(parts) {}

void TimeLeft::expect(std::size_t part, double seconds) {
  const std::lock_guard lock(mutex_);
  parts_[part].expected = std::max(seconds, 0.0);
}

void TimeLeft::begin(std::size_t part) {
  const std::lock_guard lock(mutex_);
  Part& one = parts_[part];
  one.state = Part::State::runs;
  one.from_time = clock_();
  one.reported = false;
  one.from = one.reached = 0;
}

void TimeLeft::reached(std::size_t part, double fraction) {
  const std::lock_guard lock(mutex_);
  Part& one = parts_[part];
  if (one.state != Part::State::runs) return;
  fraction = std::clamp(fraction, 0.0, 1.0);
  if (!one.reported) {
    one.reported = true;
    one.from = one.reached = one.earlier = one.later = fraction;
    one.from_time = one.reached_time = one.earlier_time = one.later_time = clock_();
  }
  if (fraction <= one.reached) return;
  one.reached = fraction;
  one.reached_time = clock_();
  if (one.reached_time - one.from_time < 2 * (one.later_time - one.from_time)) return;
  one.earlier = one.later, one.earlier_time = one.later_time;
  one.later = one.reached, one.later_time = one.reached_time;
}

void TimeLeft::end(std::size_t part) {
  const std::lock_guard lock(mutex_);
  Part& one = parts_[part];
  if (one.state != Part::State::runs) return;
  one.state = Part::State::over;
  one.ended = clock_();
}

void TimeLeft::drop(std::size_t part) {
  const std::lock_guard lock(mutex_);
  parts_[part].state = Part::State::dropped;
}

TimeLeft::Scale TimeLeft::scale() const {
  const bool equal = std::none_of(parts_.begin(), parts_.end(), [](const Part& p) { return p.expected > 0; });
  Scale scale{equal, 0};
  double took = 0, for_expected = 0, all = 0;
  for (const Part& part : parts_) {
    const double whole = expected(part, scale);
    all += whole;
    if (part.state == Part::State::over) {
      took += part.ended - part.from_time;
      for_expected += whole * (1 - part.from);
    } else if (part.state == Part::State::runs && part.reached > part.from) {
      took += part.reached_time - part.from_time;
      for_expected += whole * (part.reached - part.from);
    }
  }
  if (!equal) {
    took += trust_in_expected * all;
    for_expected += trust_in_expected * all;
  }
  if (for_expected > 0) scale.pace = took / for_expected;
  return scale;
}

double TimeLeft::left_of(const Part& part, const Scale& scale, double now) const {
  const double whole = scale.pace * expected(part, scale);
  if (part.state == Part::State::waiting) return whole;
  const double took = now - part.from_time, done = part.reached - part.from;
  double left = whole * (1 - part.reached);  // at its last report
  if (done > 0) {
    const double of_late = (part.reached_time - part.earlier_time) / (part.reached - part.earlier);
    const double by_itself = of_late * (1 - part.reached);
    const double trust = done / (done + trust_in_part);
    left = trust * by_itself + (1 - trust) * left;
  }
  const double since = done > 0 ? now - part.reached_time : took;
  return std::max(left - since, share_of_late * since);
}

// When the last thread is done.
std::optional<double> TimeLeft::seconds_at(double now) const {
  const Scale scale = this->scale();
  if (!(scale.pace > 0)) return std::nullopt;
  std::vector<double> busy;  // each thread's time until it is free; a heap, the earliest first
  for (const Part& part : parts_)
    if (part.state == Part::State::runs) busy.push_back(left_of(part, scale, now));
  if (busy.size() < static_cast<std::size_t>(threads_)) busy.resize(static_cast<std::size_t>(threads_), 0);
  std::make_heap(busy.begin(), busy.end(), std::greater<>());
  for (const Part& part : parts_) {
    if (part.state != Part::State::waiting) continue;
    std::pop_heap(busy.begin(), busy.end(), std::greater<>());
    busy.back() += left_of(part, scale, now);
    std::push_heap(busy.begin(), busy.end(), std::greater<>());
  }
  return *std::max_element(busy.begin(), busy.end());
}

std::optional<double> TimeLeft::seconds() const {
  const std::lock_guard lock(mutex_);
  return seconds_at(clock_());
}

double TimeLeft::fraction() const {
  const std::lock_guard lock(mutex_);
  const double now = clock_(), elapsed = now - start_;
  const std::optional<double> left = seconds_at(now);
  return !left || elapsed <= 0 ? 0 : elapsed / (elapsed + *left);
}

}  // namespace shakebed
