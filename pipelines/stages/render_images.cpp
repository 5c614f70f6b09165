#include "pipelines/stages/render_images.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <map>
#include <mutex>

#include "ingest/frames/png_text.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {
namespace {

constexpr double largest_view_pixels = 100e6;

std::filesystem::path trajectory_of(const Input& bed) {
  return bed.has("trajectory.extxyz.zst") ? bed.file("trajectory.extxyz.zst") : bed.file("trajectory.extxyz");
}

BedDescription bed_for_camera(const Input& input) {
  BedDescription bed = BedDescription::read(input.file("bed.json"));
  if (bed.reduced)
    throw InputError(
        "the bed is in reduced units, but the pictures need its size in metres. Give the disks of the simulate stage a "
        "diameter in SI units");
  if (!(bed.gravity.value_or(0) > 0))
    throw InputError(
        "the bed has no gravity, but the pictures need it for the floor and the unit of time. Give the bed gravity");
  return bed;
}

// What the view must hold, D.
struct Extent {
  std::size_t frames = 0;
  double highest = 0, lowest = 0, width = 0;
};

class FrameDrawer {
 public:
  FrameDrawer(const RenderOptions& options, RunContext& context)
      : options_(options),
        context_(context),
        bed_(bed_for_camera(context.input("simulate"))),
        trajectory_(trajectory_of(context.input("simulate"))),
        pixels_per_diameter_(bed_.diameter / options.scale),
        velocity_px_(std::sqrt(*bed_.gravity * bed_.diameter) / options.scale),
        extent_(extent()),
        camera_(camera()),
        geometry_(geometry()) {}

  void draw() {
    if (geometry_.periodic)
      context_.warning(fmt::format(
          "the bed has periodic sides, so the pictures show no walls. Beads extend beyond the box by up to half a "
          "diameter on either side. If walls were assumed, the width would be up to 1 D too large, and the density up "
          "to {:.1f} % too low. The picture files state the sides, and extract and fit-images use them. In pictures of "
          "another format or size this information is lost: then give the sides, --left-wall {:g} --right-wall "
          "{:g}",
          100 / (extent_.width + 1), geometry_.left_wall, geometry_.right_wall));
    std::filesystem::create_directory(context_.output("frames"));
    begin_truth();
    draw_on_all_threads();
    truth_.close();
    if (!truth_) throw StageError("truth.csv could not be written. Check that the disk is not full");
    write_file(context_.output("geometry.json"), dump(geometry_.to_json()));
    write_file(context_.output("bed.json"), dump(bed_.to_json()));
    Json result;
    result["frames"] = extent_.frames;
    result["width"] = quantity_json(camera_.width, "px");
    result["height"] = quantity_json(camera_.height, "px");
    result["scale"] = quantity_json(options_.scale, "m/px");
    result["radius"] = quantity_json(pixels_per_diameter_ / 2, "px");
    write_file(context_.output("render.json"), dump(result));
  }

 private:
  // A first pass through the trajectory.
  [[nodiscard]] Extent extent() const {
    Extent extent;
    TrajectoryReader reader(trajectory_);
    TrajectoryFrame frame;
    while ((options_.frames == 0 || extent.frames < options_.frames) && reader.read(frame)) {
      context_.check_interrupted();
      for (std::size_t i = 0; i < frame.size(); ++i) {
        extent.highest = std::max(extent.highest, frame.z[i] + frame.radius[i]);
        extent.lowest = std::min(extent.lowest, frame.z[i]);
      }
      extent.width = frame.width;
      ++extent.frames;
    }
    if (extent.frames == 0)
      throw InputError(trajectory_.string() +
                       ": contains no frame. Add \"frames\": {\"count\": 640} to the simulate stage");
    if (options_.height) extent.highest = *options_.height / bed_.diameter;
    return extent;
  }

  // px from the floor's mean to the lower border.
  [[nodiscard]] double floor_depth() const {
    const double below = std::max(0.0, bed_.amplitude.value_or(0) / bed_.diameter);
    return std::ceil(below * pixels_per_diameter_) + options_.margin;
  }

  [[nodiscard]] ingest::Camera camera() const {
    ingest::Camera camera;
    const double columns = std::ceil(extent_.width * pixels_per_diameter_) + 2 * options_.margin;
    const double rows = std::ceil(extent_.highest * pixels_per_diameter_) + floor_depth() + options_.margin;
    if (!(columns * rows <= largest_view_pixels))
      throw StageError(fmt::format(
          "frames of {:.0f} x {:.0f} pixels are too large; choose a coarser scale or a lower height", columns, rows));
    camera.width = static_cast<int>(columns), camera.height = static_cast<int>(rows);
    camera.background_level = options_.background_level, camera.bead_level = options_.bead_level;
    camera.shading = options_.shading == Shading::flat     ? ingest::BeadShading::flat
                     : options_.shading == Shading::shaded ? ingest::BeadShading::shaded
                                                           : ingest::BeadShading::highlight;
    camera.shading_depth = options_.shading_depth;
    camera.blur_px = options_.blur, camera.exposure_s = options_.exposure, camera.read_noise = options_.noise;
    camera.gradient_x = options_.gradient_x, camera.gradient_y = options_.gradient_y;
    camera.vignette = options_.vignette;
    camera.seed = context_.seed();
    return camera;
  }

  [[nodiscard]] FrameGeometry geometry() const {
    FrameGeometry geometry{.scale = options_.scale};
    geometry.left_wall = options_.margin - 0.5;
    geometry.right_wall = geometry.left_wall + extent_.width * pixels_per_diameter_;
    geometry.floor = camera_.height - 0.5 - floor_depth();
    geometry.lowest = extent_.lowest;
    geometry.width = camera_.width, geometry.height = camera_.height;
    geometry.periodic = bed_.periodic;
    return geometry;
  }

  void begin_truth() {
    truth_.open(context_.output("truth.csv"), std::ios::binary);
    const Table head = context_.table("truth.csv");
    truth_ << head.csv();
    write_file(metadata_path(context_.output("truth.csv")), dump(head.metadata("truth.csv")));
  }

  // Read in order, drawn on all threads, the truth written in order. After an interrupt, which the runner asks for
  // where a stage ends, what is there remains incomplete.
  void draw_on_all_threads() {
    const ingest::FrameRenderer renderer(camera_);
    TrajectoryReader reader(trajectory_);
    const auto threads = static_cast<std::size_t>(std::max(1, context_.jobs()));
    for_each_index(threads, context_.jobs(), [&](std::size_t) {
      try {
        draw_frames(reader, renderer);
      } catch (...) {
        stop_ = true;
        throw;
      }
    });
  }

  void draw_frames(TrajectoryReader& reader, const ingest::FrameRenderer& renderer) {
    TrajectoryFrame frame;
    while (!stop_ && !context_.interrupted()) {
      std::size_t index = 0;
      {
        const std::lock_guard lock(reading_);
        if (next_ == extent_.frames || !reader.read(frame)) return;
        index = next_++;
      }
      std::vector<ingest::RenderedDisk> disks(frame.size());
      std::string text;
      for (std::size_t i = 0; i < frame.size(); ++i) {
        disks[i] = {.x_px = geometry_.left_wall + frame.x[i] * pixels_per_diameter_,
                    .y_px = geometry_.floor - frame.z[i] * pixels_per_diameter_,
                    .radius_px = frame.radius[i] * pixels_per_diameter_,
                    .velocity_x_px_per_s = frame.vx[i] * velocity_px_,
                    .velocity_y_px_per_s = -frame.vz[i] * velocity_px_};
        require_short_streak(disks[i]);
        text += fmt::format("{},{},{:.6f},{:.6f},{:.6f}\n", index, i, disks[i].x_px, disks[i].y_px, disks[i].radius_px);
      }
      write(context_.output("frames") / fmt::format("{:06d}.png", index), renderer.render(disks, index));
      add_truth(index, std::move(text));
      context_.progress(static_cast<double>(++done_) / static_cast<double>(extent_.frames), "drawing");
    }
  }

  void require_short_streak(const ingest::RenderedDisk& disk) const {
    const double streak = std::hypot(disk.velocity_x_px_per_s, disk.velocity_y_px_per_s) * options_.exposure;
    if (streak > camera_.width + camera_.height)
      throw StageError(
          fmt::format("within the exposure time of {} a disk moves by {:.3g} px, farther than the frame of "
                      "{} x {} px: check the unit of \"exposure\", or give a shorter one",
                      handy_text(options_.exposure, dimension::time), streak, camera_.width, camera_.height));
  }

  void write(const std::filesystem::path& path, const ingest::GrayFrame& frame) const {
    ingest::write_png(path, frame);
    if (geometry_.periodic) ingest::add_png_text(path, FrameGeometry::keyword, geometry_.sides_text());
  }

  void add_truth(std::size_t index, std::string text) {
    const std::lock_guard lock(reading_);
    waiting_.emplace(index, std::move(text));
    for (auto at = waiting_.find(written_); at != waiting_.end(); at = waiting_.find(++written_)) {
      truth_ << at->second;
      waiting_.erase(at);
    }
  }

  const RenderOptions& options_;
  RunContext& context_;
  const BedDescription bed_;
  const std::filesystem::path trajectory_;
  const double pixels_per_diameter_, velocity_px_;
  const Extent extent_;
  const ingest::Camera camera_;
  const FrameGeometry geometry_;
  std::ofstream truth_;
  std::mutex reading_;
  std::size_t next_ = 0, written_ = 0;
  std::map<std::size_t, std::string> waiting_;  // truth of frames that wait for one before them
  std::atomic<bool> stop_{false};
  std::atomic<std::size_t> done_{0};
};

}  // namespace

void render_frames(const RenderOptions& options, RunContext& context) { FrameDrawer(options, context).draw(); }

}  // namespace shakebed::pipelines
