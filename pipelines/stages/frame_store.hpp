// The frames of a run that may be killed and go on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "pipelines/formats/trajectory.hpp"
#include "sim/engine/simulation.hpp"

namespace shakebed::pipelines {

// The trajectory while it grows. Frames are joined into groups of a fixed number. Each group is written (and
// compressed) separately, so that a run that continues from a checkpoint ends with the same bytes.
class FrameStore {
 public:
  FrameStore(std::filesystem::path path, std::size_t disks);

  void start();  // an empty file
  // After the state has been read from a checkpoint: what was written later is cut off. Throws StageError where the
  // file is not there.
  void go_on();
  void add(TrajectoryFrame frame);
  void finish(const std::filesystem::path& destination);

  template <class Archive>
  void visit(Archive& archive) {
    std::uint64_t count = waiting_.size();
    archive(bytes_, count);
    waiting_.resize(count);
    for (TrajectoryFrame& f : waiting_)
      archive(f.time, f.phase, f.floor_position, f.floor_velocity, f.width, f.height, f.periodic, f.x, f.z, f.vx, f.vz,
              f.spin, f.radius);
  }

 private:
  void write_group();
  std::filesystem::path path_;
  std::size_t frames_a_group_;
  std::uint64_t bytes_ = 0;
  std::vector<TrajectoryFrame> waiting_;
};

TrajectoryFrame frame_of(const sim::Snapshot& at, const sim::Scene& scene, const sim::DiskProperties& properties,
                         double phase);

}  // namespace shakebed::pipelines
