#include "pipelines/stages/frame_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <system_error>
#include <utility>
#include <variant>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

// Numbers a group holds before it is written [disks times frames]: a group of 200,000 is 5 to 10 MB of text.
constexpr std::size_t disks_a_group = 200'000;

FrameStore::FrameStore(fs::path path, std::size_t disks)
    : path_(std::move(path)),
      frames_a_group_(std::max<std::size_t>(1, disks_a_group / std::max<std::size_t>(disks, 1))) {}

void FrameStore::start() {
  std::ofstream(path_, std::ios::binary | std::ios::trunc).flush();
  bytes_ = 0;
}

void FrameStore::go_on() {
  if (bytes_ == 0) return start();
  std::error_code error;
  if (fs::file_size(path_, error) < bytes_ || error)
    throw StageError(
        fmt::format("{}: the part of the trajectory that was written before the restart is missing", path_.string()));
  fs::resize_file(path_, bytes_);
}

void FrameStore::add(TrajectoryFrame frame) {
  waiting_.push_back(std::move(frame));
  if (waiting_.size() == frames_a_group_) write_group();
}

void FrameStore::finish(const fs::path& destination) {
  if (!waiting_.empty()) write_group();
  fs::rename(path_, destination);
}

void FrameStore::write_group() {
  const fs::path group = path_.parent_path() / ("group-" + path_.filename().string());
  TrajectoryWriter writer(group);
  for (const TrajectoryFrame& frame : waiting_) writer.write(frame);
  writer.close();
  const std::string text = read_file(group);
  fs::remove(group);
  std::ofstream out(path_, std::ios::binary | std::ios::app);
  out.write(text.data(), static_cast<std::streamsize>(text.size()));
  if (!out.flush()) throw StageError(fmt::format("{}: cannot be written", path_.string()));
  bytes_ += text.size();
  waiting_.clear();
}

TrajectoryFrame frame_of(const sim::Snapshot& at, const sim::Scene& scene, const sim::DiskProperties& properties,
                         double phase) {
  TrajectoryFrame frame;
  frame.time = at.time;
  frame.phase = phase;
  frame.floor_position = at.floor_position;
  frame.floor_velocity = at.floor_velocity;
  frame.width = scene.box.width;
  frame.periodic = std::holds_alternative<sim::PeriodicSides>(scene.box.sides);
  frame.x = at.x;
  frame.z = at.z;
  frame.vx = at.vx;
  frame.vz = at.vz;
  frame.spin = at.spin;
  frame.radius = properties.radius;
  return frame;
}

}  // namespace shakebed::pipelines
