// How far a sweep is and how long it still takes. Points may be uneven by orders of magnitude.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"
#include "pipelines/runner/sweep_points.hpp"
#include "pipelines/runner/sweep_record.hpp"
#include "statistics/time_left.hpp"

namespace shakebed::pipelines {

// A point that is to be run.
struct PointToRun {
  const SweepPoint* point = nullptr;
  const PointKeys* keys = nullptr;
};

// Trials of its stages say what a point takes beside the others. What no trial knows (a fit, say) is learned from the
// points that are done. May be used from any thread once trials() has returned.
class SweepProgress {
 public:
  SweepProgress(const Plan& plan, std::vector<PointToRun> points, int threads);

  // Makes the trials, on the sweep's threads; true from `stop` ends them. A stage that several points share is counted
  // for the first of them.
  void trials(const std::function<bool()>& stop);
  // Learns from a point that is done what its stages took.
  void learn(const std::filesystem::path& directory);
  // The points that will take much longer than the others, a sentence each.
  std::vector<std::string> long_points() const;

  void begin(std::size_t point) { time_.begin(point); }
  void reached(std::size_t point, const std::string& stage, double fraction);
  void end(std::size_t point, const std::filesystem::path& directory);
  void drop(std::size_t point) { time_.drop(point); }

  std::optional<double> seconds_left() const { return time_.seconds(); }
  double fraction() const { return time_.fraction(); }

 private:
  std::vector<double> expected_of(std::size_t point) const;
  void expect_all();

  const Plan& plan_;
  const std::vector<PointToRun> points_;
  const int threads_;
  TimeLeft time_;
  mutable std::mutex mutex_;
  std::vector<std::vector<double>> trials_;  // by point and stage [s]
  std::vector<bool> tried_;                  // by stage: a trial says something of it at some point
  struct Learned {
    double seconds = 0;
    std::size_t points = 0;
  };
  std::vector<Learned> learned_;  // by stage
  std::vector<bool> over_;
  std::size_t ended_ = 0;
};

}  // namespace shakebed::pipelines
