// Stages that several points of a sweep have in common.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "pipelines/runner/run.hpp"
#include "pipelines/runner/sweep_record.hpp"

namespace shakebed::pipelines {

// Stages that several points have in common (one simulation under a sweep of fits, say) are run once, in
// OUT/shared/<key>/<id>; the points hold links to them. May be used by several threads once all points are counted.
class SharedStages {
 public:
  SharedStages(const std::filesystem::path& out, bool force) : root_(out / "shared"), force_(force) {}

  void count(const PointKeys& keys);
  // Makes the shared stages of a point and links them into its folder. What fails here is left to the point itself,
  // which then fails in the same way and says so.
  void prepare(const Plan& at, const PointKeys& keys, const std::filesystem::path& directory);

 private:
  struct Entry {
    std::mutex mutex;
    bool tried = false, good = false;
  };

  bool is_shared(const std::string& key) const;
  std::shared_ptr<Entry> entry_of(const std::string& key);
  bool make(const Plan& at, const PointKeys& keys, std::size_t i);
  bool run(const Plan& at, const PointKeys& keys, std::size_t i, Entry& entry);

  std::filesystem::path root_;
  bool force_;
  std::map<std::string, std::size_t> uses_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Entry>> entries_;
};

}  // namespace shakebed::pipelines
