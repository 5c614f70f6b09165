// Inputs that break disk finders: each is drawn or written here, given to the finder with nothing but the diameter, and
// compared with what is known of it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "ingest/find/find_disks.hpp"
#include "ingest/profile/measure_bed.hpp"
#include "ingest/synthetic/random_stream.hpp"
#include "tests/bench/cases/finder_benchmark.hpp"

namespace shakebed::ingest {

namespace {

using Disks = std::vector<RenderedDisk>;

double cpu_milliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

Camera camera_of(int width, int height) {
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.blur_px = 0.8;
  camera.read_noise = 4;
  return camera;
}

Disks bed_of(double radius, int width, int height, int rows, int gas) {
  SyntheticBed bed;
  bed.left_wall_px = 6;
  bed.right_wall_px = width - 6.5;
  bed.floor_px = height - 7.3;
  bed.radius_px = radius;
  bed.rows = rows;
  bed.gas_count = gas;
  bed.gas_height_px = 0.25 * height;
  bed.jitter_px = 0.01 * radius;
  return make_synthetic_bed(bed);
}

// Found disks against the true ones with their centre in the frame, one to one within half a radius.
class Comparison {
 public:
  void add(const FindResult& result, const Disks& truth, int width, int height) {
    std::vector<bool> used(result.disks.size(), false);
    found_ += result.disks.size();
    for (const FoundDisk& disk : result.disks)
      sane_ = sane_ && std::isfinite(disk.x_px) && std::isfinite(disk.y_px) && std::isfinite(disk.variance_x) &&
              std::isfinite(disk.quality);
    sane_ = sane_ && result.disks.empty() != result.why_nothing.empty();
    for (const RenderedDisk& disk : truth) {
      if (disk.x_px < -0.5 || disk.y_px < -0.5 || disk.x_px >= width - 0.5 || disk.y_px >= height - 0.5) continue;
      ++truths_;
      double best = std::max(1.0, 0.5 * disk.radius_px);
      std::size_t winner = used.size();
      for (std::size_t k = 0; k < used.size(); ++k) {
        const double distance = std::hypot(result.disks[k].x_px - disk.x_px, result.disks[k].y_px - disk.y_px);
        if (!used[k] && distance < best) {
          best = distance;
          winner = k;
        }
      }
      if (winner == used.size()) continue;
      used[winner] = true;
      ++hits_;
      square_ += best * best;
    }
  }
  // Fills error, recall, precision and verdict.
  void judge(HardCaseRow& row, double limit_px, double least) const {
    const auto share = [](std::size_t part, std::size_t whole) {
      return whole ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
    };
    row.recall = share(hits_, truths_);
    row.precision = share(hits_, found_);
    row.error = hits_ ? std::sqrt(square_ / 2 / static_cast<double>(hits_)) : 0;
    row.error_unit = "px";
    row.limit = limit_px;
    row.pass = sane_ && hits_ > 0 && row.recall >= least && row.precision >= least && row.error <= limit_px;
    row.status = row.pass ? "found" : "wrong";
  }

 private:
  std::size_t truths_ = 0, found_ = 0, hits_ = 0;
  double square_ = 0;
  bool sane_ = true;
};

class HardCases {
 public:
  HardCases(std::filesystem::path folder, const std::function<void(const HardCaseRow&)>& progress)
      : folder_(std::move(folder)), progress_(progress) {}

  std::vector<HardCaseRow> run() {
    pairs_and_borders();
    RandomStream random(1);
    sizes(random);
    beds(random);
    floors();
    light();
    nothing();
    files();
    return std::move(rows_);
  }

 private:
  // `work` fills the row; drawing inside it is counted in the time (a few ms).
  template <class Work>
  void add(const std::string& name, double limit_ms, const Work& work) {
    HardCaseRow row;
    row.name = name;
    row.cpu_limit_ms = limit_ms;
    const double start = cpu_milliseconds();
    try {
      work(row);
    } catch (const std::exception& error) {
      row.status = "wrong";
      row.pass = false;
      row.note = error.what();
    }
    row.cpu_ms = cpu_milliseconds() - start;
    if (row.cpu_ms > limit_ms) row.pass = false;
    rows_.push_back(row);
    if (progress_) progress_(rows_.back());
  }
  void picture(const std::string& name, const Disks& truth, const Camera& camera, double limit_px, double least = 0.99,
               double limit_ms = 1000) {
    add(name, limit_ms, [&](HardCaseRow& row) {
      Comparison comparison;
      const FindResult result = find_disks(render_frame(truth, camera));
      comparison.add(result, truth, camera.width, camera.height);
      comparison.judge(row, limit_px, least);
      row.note = result.why_nothing;
    });
  }
  // A picture without disks: none found, and a word why.
  void empty_picture(const std::string& name, const GrayFrame& frame) {
    add(name, 1000, [&](HardCaseRow& row) {
      const FindResult result = find_disks(frame);
      row.pass = result.disks.empty() && !result.why_nothing.empty();
      row.status = row.pass ? "nothing found" : "wrong";
      row.note = result.disks.empty() ? result.why_nothing
                                      : std::to_string(result.disks.size()) + " disks where there is none";
    });
  }
  void refused_file(const std::string& name, const std::filesystem::path& path) {
    add(name, 1000, [&](HardCaseRow& row) {
      row.status = "wrong";
      row.note = "was read";
      try {
        read_frame(path);
      } catch (const InputError& error) {
        row.status = "refused";
        row.pass = std::string(error.what()).find(path.filename().string()) != std::string::npos;
        row.note = error.problem() + ": " + error.why();
      }
    });
  }
  std::string written(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }

  void pairs_and_borders() {
    add("touching pair, 12 angles", 1000, [](HardCaseRow& row) {
      Comparison comparison;
      for (int k = 0; k < 12; ++k) {
        const double angle = std::numbers::pi * k / 12 + 0.05;
        const double dx = 12 * std::cos(angle), dy = 12 * std::sin(angle);
        const Disks pair = {{64.2 - dx, 63.6 - dy, 12, 0, 0}, {64.2 + dx, 63.6 + dy, 12, 0, 0}};
        comparison.add(find_disks(render_frame(pair, camera_of(128, 128))), pair, 128, 128);
      }
      comparison.judge(row, 0.05, 1);
    });
    add("disks cut by the border", 1000, [](HardCaseRow& row) {
      const Disks truth = {{2.5, 60, 12, 0, 0}, {64, 124.5, 12, 0, 0}, {60, 60, 12, 0, 0}, {100, 40, 12, 0, 0}};
      const FindResult result = find_disks(render_frame(truth, camera_of(128, 128)));
      Comparison comparison;
      comparison.add(result, truth, 128, 128);
      comparison.judge(row, 0.1, 1);
      for (const FoundDisk& disk : result.disks)
        if (disk.cut != (disk.x_px < 11.5 || disk.y_px > 115.5)) {
          row.pass = false;
          row.note = "a cut disk is not flagged, or a whole one is";
        }
    });
  }

  void sizes(RandomStream& random) {
    Disks small;
    for (int k = 0; k < 400; ++k)
      small.push_back({12 + 10 * (k % 20) + random.uniform(), 12 + 10 * (k / 20) + random.uniform(), 1.5, 0, 0});
    Camera camera = camera_of(224, 224);
    camera.blur_px = 0.5;
    picture("disks 3 px wide", small, camera, 0.1);
    picture(
        "disks 150 px wide",
        {{90, 90, 75, 0, 0}, {240, 92, 75, 0, 0}, {420, 120, 75, 0, 0}, {165.5, 221, 75, 0, 0}, {400, 300, 75, 0, 0}},
        camera_of(520, 400), 0.05, 1, 2000);
    picture("disks 300 px wide",
            {{200, 200, 150, 0, 0},
             {520, 240, 150, 0, 0},
             {820, 180, 150, 0, 0},
             {350, 600, 150, 0, 0},
             {760, 580, 150, 0, 0}},
            camera_of(1000, 800), 0.05, 1, 5000);
  }

  void beds(RandomStream& random) {
    picture("a packed bed, hardly any gas", bed_of(10, 420, 420, 18, 5), camera_of(420, 420), 0.02, 1);
    Disks flying = bed_of(10, 400, 400, 0, 90);
    for (RenderedDisk& disk : flying) {
      const double angle = 2 * std::numbers::pi * random.uniform();
      disk.velocity_x_px_per_s = 1e4 * std::cos(angle);
      disk.velocity_y_px_per_s = 1e4 * std::sin(angle);
    }
    Camera camera = camera_of(400, 400);
    camera.exposure_s = 1e-3;
    picture("streaks of half a diameter", flying, camera, 0.5, 0.97);
    camera = camera_of(400, 400);
    camera.dust_fraction = 0.05;
    picture("5 % dust", bed_of(10, 400, 400, 6, 60), camera, 0.2);
    camera = camera_of(400, 400);
    camera.jpeg_quality = 60;
    picture("JPEG of quality 60", bed_of(10, 400, 400, 6, 60), camera, 0.1);
  }

  void floors() {
    add("a dark floor in view", 1000, [](HardCaseRow& row) {
      SyntheticBed bed;
      bed.left_wall_px = 6, bed.right_wall_px = 393.5, bed.floor_px = 385.7;
      bed.rows = 6, bed.gas_count = 60, bed.jitter_px = 0.1;
      GrayFrame frame = render_frame(make_synthetic_bed(bed), camera_of(400, 400));
      std::fill(frame.pixels.begin() + static_cast<std::ptrdiff_t>(386) * 400, frame.pixels.end(), 90.0F);
      FrameSource source = FrameSource::from_frames({frame});
      MeasureOptions options;
      options.bead_diameter_m = 1e-3;
      const Measurement measured = measure_bed(source, options);
      row.error = std::abs(measured.calibration.floor_px - bed.floor_px) / 20;
      row.error_unit = "D";
      row.limit = 0.05;
      row.pass = row.error <= row.limit;
      row.status = row.pass ? "found" : "wrong";
    });
    add("bed turned by 3 degrees", 1000, [](HardCaseRow& row) {
      Disks truth = bed_of(10, 500, 400, 7, 60);
      const double angle = 3 * std::numbers::pi / 180;
      for (RenderedDisk& disk : truth) {
        const double x = disk.x_px - 250, y = disk.y_px - 230;
        disk.x_px = 260 + x * std::cos(angle) - y * std::sin(angle);
        disk.y_px = 215 + x * std::sin(angle) + y * std::cos(angle);
      }
      FrameSource source = FrameSource::from_frames({render_frame(truth, camera_of(520, 430))});
      MeasureOptions options;
      options.bead_diameter_m = 3e-3;
      const Measurement measured = measure_bed(source, options);
      row.error = std::abs(measured.calibration.floor_tilt_degrees - 3);
      row.error_unit = "deg";
      row.limit = 0.1;
      row.pass = row.error <= row.limit;
      row.status = row.pass ? "found" : "wrong";
    });
  }

  void light() {
    const Disks truth = bed_of(10, 360, 360, 6, 50);
    const auto levels = [&](const std::string& name, double background, double bead) {
      Camera camera = camera_of(360, 360);
      camera.background_level = background;
      camera.bead_level = bead;
      camera.read_noise = 1.5;
      picture(name, truth, camera, 0.1);
    };
    levels("saturated", 330, 90);
    levels("under-exposed", 26, 4);
    levels("contrast of 10 %", 140, 126);
    Camera camera = camera_of(500, 400);
    camera.gradient_x = 0.8;
    camera.vignette = 0.3;
    picture("light falling by 80 %", bed_of(10, 500, 400, 7, 80), camera, 0.1);
  }

  void nothing() {
    GrayFrame frame;
    frame.width = 300;
    frame.height = 200;
    frame.pixels.assign(60000, 128.0F);
    empty_picture("a blank frame", frame);
    Camera camera = camera_of(300, 200);
    camera.read_noise = 20;
    empty_picture("a frame of noise", render_frame({}, camera));
    for (int row = 0; row < 200; ++row)
      for (int column = 0; column < 300; ++column)
        frame.pixels[static_cast<std::size_t>(row * 300 + column)] =
            static_cast<float>(128 + 60 * std::sin(0.15 * column + 0.002 * row * row));
    empty_picture("something else: curved stripes", frame);
    RandomStream random(3);
    for (float& level : frame.pixels) level = 200.0F;
    for (int k = 0; k < 60; ++k) {  // something else: houses, roofs cut by one another
      const int left = static_cast<int>(300 * random.uniform()), top = static_cast<int>(200 * random.uniform());
      const int right = std::min(300, left + 10 + static_cast<int>(50 * random.uniform()));
      const int bottom = std::min(200, top + 10 + static_cast<int>(50 * random.uniform()));
      const float level = static_cast<float>(40 + 180 * random.uniform());
      for (int row = top; row < bottom; ++row)
        for (int column = left; column < right; ++column)
          frame.pixels[static_cast<std::size_t>(row * 300 + column)] = level;
    }
    empty_picture("something else: rectangles", frame);
    frame.width = frame.height = 1;
    frame.pixels.assign(1, 77.0F);
    empty_picture("a frame of 1 x 1 px", frame);
  }

  void files() {
    const Disks truth = bed_of(10, 300, 300, 5, 20);
    const GrayFrame frame = render_frame(truth, camera_of(300, 300));
    write_png(folder_ / "whole.png", frame);
    std::string bytes;
    {
      std::ifstream in(folder_ / "whole.png", std::ios::binary);
      bytes.assign(std::istreambuf_iterator<char>(in), {});
    }
    refused_file("a truncated file", written("truncated.png", bytes.substr(0, bytes.size() / 2)));
    refused_file("a file of 0 bytes", written("empty.png", ""));
    std::string enormous = bytes;  // the header says 20,000 x 20,000
    enormous.replace(16, 8, std::string("\0\0\x4e\x20\0\0\x4e\x20", 8));
    refused_file("20,000 x 20,000 px", written("enormous.png", enormous));
    add("16 bits of which 12 are used", 1000, [&](HardCaseRow& row) {
      cv::Mat deep(frame.height, frame.width, CV_16U);
      for (int y = 0; y < frame.height; ++y)
        for (int x = 0; x < frame.width; ++x)
          deep.at<std::uint16_t>(y, x) = static_cast<std::uint16_t>(
              std::lround(std::min(255.0, std::max(0.0, static_cast<double>(frame.at(x, y)))) * 4095 / 255));
      const std::string path = (folder_ / "deep.png").string();
      if (!cv::imwrite(path, deep)) throw InputError(path, "could not be written", "", "");
      Comparison comparison;
      comparison.add(find_disks(read_frame(path)), truth, frame.width, frame.height);
      comparison.judge(row, 0.05, 1);
    });
    add("a film whose size changes", 1000, [&](HardCaseRow& row) {
      FrameSource source = FrameSource::from_frames({frame, render_frame(truth, camera_of(310, 300)), frame});
      MeasureOptions options;
      options.bead_diameter_m = 1e-3;
      const Measurement measured = measure_bed(source, options);
      row.pass = measured.frames.size() == 3 && measured.frames[0].status == FrameStatus::good &&
                 measured.frames[1].status == FrameStatus::size_changed &&
                 measured.frames[2].status == FrameStatus::good;
      row.status = row.pass ? "refused" : "wrong";
      row.note = measured.frames.size() > 1 ? measured.frames[1].why : "";
    });
  }

  std::filesystem::path folder_;
  const std::function<void(const HardCaseRow&)>& progress_;
  std::vector<HardCaseRow> rows_;
};

}  // namespace

std::vector<HardCaseRow> benchmark_hard_cases(const std::filesystem::path& scratch_folder,
                                              const std::function<void(const HardCaseRow&)>& progress) {
  return HardCases(scratch_folder, progress).run();
}

std::string hard_case_table(const std::vector<HardCaseRow>& rows) {
  std::string text =
      "case                              status         recall  precision  error        limit        cpu_ms    "
      "limit_ms  verdict\n";
  char line[600];
  for (const HardCaseRow& row : rows) {
    char error[32] = "-", limit[32] = "-", recall[16] = "-", precision[16] = "-";
    if (!row.error_unit.empty()) {
      std::snprintf(error, sizeof error, "%.4f %s", row.error, row.error_unit.c_str());
      std::snprintf(limit, sizeof limit, "%.4f %s", row.limit, row.error_unit.c_str());
    }
    if (row.recall >= 0) {
      std::snprintf(recall, sizeof recall, "%.4f", row.recall);
      std::snprintf(precision, sizeof precision, "%.4f", row.precision);
    }
    std::snprintf(line, sizeof line, "%-33s %-14s %-7s %-10s %-12s %-12s %-9.1f %-9.0f %s%s%.200s\n", row.name.c_str(),
                  row.status.c_str(), recall, precision, error, limit, row.cpu_ms, row.cpu_limit_ms,
                  row.pass ? "pass" : "FAIL", row.note.empty() ? "" : "  ", row.note.c_str());
    text += line;
  }
  return text;
}

}  // namespace shakebed::ingest
