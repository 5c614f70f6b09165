// Trajectories as extended XYZ, the format OVITO and ASE read; whole files may be zstd-compressed (name ends in .zst).
//
// One frame:
//   337
//   Lattice="30 0 0 0 1 0 0 0 40" Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1 Time=12.5 Phase=0.25 ...
//   X 0.5 0 0.5 0.1 0 -0.2 0.5
// y is the direction across the slab (0), z is up. The species is X for disks of diameter 1 and B for others. ASE takes
// symbols of elements alone; X is its atom that is no element, of mass 1. Comment keys of ours: Time, Phase (of the
// floor's cycle, 0 to 1), Floor (height of the floor), FloorVelocity, Width, Units ("SI" or "reduced"), pbc.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace shakebed::pipelines {

// One moment. Lengths in D, velocities in sqrt(g D), times in sqrt(D/g) throughout; the bed's own D and g are in
// bed.json. Index = disk.
struct TrajectoryFrame {
  double time = 0;
  double phase = 0;  // of the floor's cycle, 0 to 1
  double floor_position = 0, floor_velocity = 0;
  double width = 0;   // x runs from 0 to here
  double height = 0;  // of the box drawn around it; 0: chosen by the writer from the highest disk
  bool periodic = false;
  std::vector<double> x, z, vx, vz, spin, radius;  // spin and radius may be empty (0, 1/2)
  std::size_t size() const { return x.size(); }
};

// Writes frame after frame; compresses when the path ends in .zst. Throws StageError.
class TrajectoryWriter {
 public:
  explicit TrajectoryWriter(const std::filesystem::path& path);
  ~TrajectoryWriter();
  void write(const TrajectoryFrame& frame);
  void close();  // flushes and checks; the destructor closes without checking

 private:
  void flush(bool last);
  struct Compressor;
  std::unique_ptr<Compressor> compressor_;
  std::FILE* file_ = nullptr;
  std::string path_, buffer_;
};

// The coordinate that becomes z where a file holds three. Programs that simulate in a plane have y upwards.
enum class UpAxis { y, z };

// Reads frame after frame. Throws InputError naming file and line.
class TrajectoryReader {
 public:
  explicit TrajectoryReader(const std::filesystem::path& path, UpAxis up = UpAxis::z);
  ~TrajectoryReader();
  // False at the end of the file.
  bool read(TrajectoryFrame& frame);

 private:
  struct Columns;
  bool read_count(std::size_t& count);
  void read_moment(std::string_view comment, TrajectoryFrame& frame) const;
  Columns read_columns(std::string_view comment) const;
  void read_disks(std::size_t count, const Columns& columns, TrajectoryFrame& frame);
  bool line(std::string_view& out);
  bool more();
  [[noreturn]] void fail(const std::string& what) const;
  struct Decompressor;
  std::unique_ptr<Decompressor> decompressor_;
  std::FILE* file_ = nullptr;
  std::string path_, buffer_;
  UpAxis up_;
  std::size_t position_ = 0;
  std::size_t line_number_ = 0;
  bool at_end_ = false;
};

// Only the number of frames (reads the whole file).
std::size_t count_frames(const std::filesystem::path& path);

}  // namespace shakebed::pipelines
