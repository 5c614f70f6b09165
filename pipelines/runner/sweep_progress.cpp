#include "pipelines/runner/sweep_progress.hpp"

#include <fmt/format.h>

#include <bit>
#include <numeric>
#include <utility>

#include "pipelines/formats/duration.hpp"
#include "pipelines/runner/cache.hpp"
#include "pipelines/runner/expected_time.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

namespace {
double sum_of(const std::vector<double>& seconds) { return std::accumulate(seconds.begin(), seconds.end(), 0.0); }
}  // namespace

SweepProgress::SweepProgress(const Plan& plan, std::vector<PointToRun> points, int threads)
    : plan_(plan),
      points_(std::move(points)),
      threads_(threads),
      time_(points_.size(), threads),
      trials_(points_.size(), std::vector<double>(plan.stages.size(), 0)),
      tried_(plan.stages.size(), false),
      learned_(plan.stages.size()),
      over_(points_.size(), false) {}

void SweepProgress::trials(const std::function<bool()>& stop) {
  const auto one = [&](std::size_t i) {
    if (!stop()) trials_[i] = trial_seconds(plan_at(plan_, *points_[i].point));
  };
  if (points_.size() > 1) {
    one(0);
    if (sum_of(trials_[0]) > 0) for_each_index(points_.size() - 1, threads_, [&](std::size_t i) { one(i + 1); });
  }
  std::map<std::string, std::size_t> first;  // key of a stage → point
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::size_t s = 0; s < trials_[i].size(); ++s) {
      if (trials_[i][s] > 0) tried_[s] = true;
      if (first.emplace(points_[i].keys->stages[s], i).first->second != i) trials_[i][s] = 0;
    }
  }
  const std::lock_guard lock(mutex_);
  expect_all();
}

// A stage that has a trial anywhere is known by its trials alone.
std::vector<double> SweepProgress::expected_of(std::size_t point) const {
  std::vector<double> seconds = trials_[point];
  for (std::size_t s = 0; s < seconds.size(); ++s) {
    if (!tried_[s] && learned_[s].points > 0)
      seconds[s] = learned_[s].seconds / static_cast<double>(learned_[s].points);
  }
  return seconds;
}

void SweepProgress::expect_all() {
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (!over_[i]) time_.expect(i, sum_of(expected_of(i)));
}

void SweepProgress::learn(const fs::path& directory) {
  const std::lock_guard lock(mutex_);
  for (std::size_t s = 0; s < plan_.stages.size(); ++s) {
    if (const auto cost = read_cost(directory / plan_.stages[s].id)) {
      learned_[s].seconds += cost->wall_seconds;
      ++learned_[s].points;
    }
  }
}

std::vector<std::string> SweepProgress::long_points() const {
  const std::lock_guard lock(mutex_);
  std::vector<double> seconds;
  for (std::size_t i = 0; i < points_.size(); ++i) seconds.push_back(sum_of(expected_of(i)));
  std::vector<std::string> out;
  for (const LongPart& part : long_parts(seconds)) {
    const SweepPoint& point = *points_[part.part].point;
    std::string values;
    for (std::size_t a = 0; a < plan_.sweep->axes.size(); ++a)
      values += fmt::format("{}{} = {}", a > 0 ? ", " : "", plan_.sweep->axes[a].pointer, value_text(point.values[a]));
    out.push_back(
        fmt::format("point {} ({}) {}. To save this time, stop with Ctrl-C. Then remove the value from the sweep, or "
                    "measure for a shorter time",
                    point.name, values, long_part_text(part)));
  }
  return out;
}

void SweepProgress::reached(std::size_t point, const std::string& stage, double fraction) {
  std::vector<double> seconds;
  {
    const std::lock_guard lock(mutex_);
    seconds = expected_of(point);
  }
  time_.reached(point, fraction_of_plan(plan_, seconds, plan_.index_of(stage), fraction));
}

void SweepProgress::end(std::size_t point, const fs::path& directory) {
  learn(directory);
  const std::lock_guard lock(mutex_);
  over_[point] = true;
  if (std::has_single_bit(++ended_)) expect_all();  // a mean over so many points changes slowly
  time_.end(point);
}

}  // namespace shakebed::pipelines
