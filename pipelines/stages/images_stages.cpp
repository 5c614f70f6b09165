// The images module: the bodies of the stages that touch images. Compiled into libshakebed_images.so, never into the
// program (see images_module.hpp).
// implements: pipelines/stages/images_module.hpp
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <mutex>
#include <set>
#include <thread>

#include "ingest/profile/measure_bed.hpp"
#include "ingest/profile/overlay.hpp"
#include "ingest/profile/velocities.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/images_module.hpp"
#include "pipelines/stages/preview.hpp"
#include "pipelines/version.hpp"

namespace shakebed::pipelines {
namespace {

constexpr double largest_view_pixels = 100e6;

std::filesystem::path trajectory_of(const Input& bed) {
  return bed.has("trajectory.extxyz.zst") ? bed.file("trajectory.extxyz.zst") : bed.file("trajectory.extxyz");
}

void render_frames(const RenderOptions& options, RunContext& context) {
  const Input& input = context.input("simulate");
  const BedDescription bed = BedDescription::read(input.file("bed.json"));
  if (bed.reduced) {
    throw InputError(
        "the bed is in reduced units and has no size: a camera needs metres. Give the simulate stage a diameter in SI "
        "units");
  }
  if (!(bed.gravity.value_or(0) > 0))
    throw InputError("the bed has no gravity, so no floor and no time scale for a camera");
  const std::filesystem::path path = trajectory_of(input);

  // First pass: what the view must hold.
  std::size_t count = 0;
  double highest = 0, lowest = 0, width = 0;
  {
    TrajectoryReader reader(path);
    TrajectoryFrame frame;
    while ((options.frames == 0 || count < options.frames) && reader.read(frame)) {
      context.check_interrupted();
      for (std::size_t i = 0; i < frame.size(); ++i) {
        highest = std::max(highest, frame.z[i] + frame.radius[i]);
        lowest = std::min(lowest, frame.z[i]);
      }
      width = frame.width;
      ++count;
    }
  }
  if (count == 0)
    throw InputError(path.string() + ": holds no frame. Ask the simulate stage for some: \"frames\": {\"count\": 640}");
  const double pixels_per_diameter = bed.diameter / options.scale;
  if (options.height) highest = *options.height / bed.diameter;
  const double below = std::max(0.0, bed.amplitude.value_or(0) / bed.diameter);
  const double floor_depth = std::ceil(below * pixels_per_diameter) + options.margin;
  ingest::Camera camera;
  const double columns = std::ceil(width * pixels_per_diameter) + 2 * options.margin;
  const double rows = std::ceil(highest * pixels_per_diameter) + floor_depth + options.margin;
  if (!(columns * rows <= largest_view_pixels)) {
    throw StageError(fmt::format(
        "frames of {:.0f} x {:.0f} pixels are too large; choose a coarser scale or a lower height", columns, rows));
  }
  camera.width = static_cast<int>(columns), camera.height = static_cast<int>(rows);
  camera.background_level = options.background_level, camera.bead_level = options.bead_level;
  camera.shading = options.shading == Shading::flat     ? ingest::BeadShading::flat
                   : options.shading == Shading::shaded ? ingest::BeadShading::shaded
                                                        : ingest::BeadShading::highlight;
  camera.shading_depth = options.shading_depth;
  camera.blur_px = options.blur, camera.exposure_s = options.exposure, camera.read_noise = options.noise;
  camera.gradient_x = options.gradient_x, camera.gradient_y = options.gradient_y, camera.vignette = options.vignette;
  camera.seed = context.seed();
  const ingest::FrameRenderer renderer(camera);
  FrameGeometry geometry{.scale = options.scale};
  geometry.left_wall = options.margin - 0.5;
  geometry.right_wall = geometry.left_wall + width * pixels_per_diameter;
  geometry.floor = camera.height - 0.5 - floor_depth;
  geometry.lowest = lowest;
  geometry.width = camera.width, geometry.height = camera.height;
  const double velocity_px = std::sqrt(*bed.gravity * bed.diameter) / options.scale;

  // Second pass: read in order, draw on all threads, write the truth in order.
  std::filesystem::create_directory(context.output("frames"));
  TrajectoryReader reader(path);
  std::mutex reading, failing;
  std::size_t next = 0;
  std::ofstream truth(context.output("truth.csv"), std::ios::binary);
  const Table truth_head("true centres at the middle of the exposure",
                         {{"frame", "1", "number of the frame, from 0"},
                          {"disk", "1", "number of the disk, from 0"},
                          {"x_px", "px", "centre, from the centre of the top-left pixel to the right"},
                          {"y_px", "px", "centre, from the centre of the top-left pixel downwards"},
                          {"radius_px", "px", "radius"}});
  truth << truth_head.csv();
  write_file(metadata_path(context.output("truth.csv")), dump(truth_head.metadata("truth.csv")));
  std::map<std::size_t, std::string> drawn;  // truth of frames that wait for one before them
  std::size_t written = 0;
  std::exception_ptr failure;
  std::atomic<bool> stop{false};
  std::atomic<std::size_t> done{0};
  const auto work = [&] {
    try {
      TrajectoryFrame frame;
      while (!stop && !context.interrupted()) {
        std::size_t index = 0;
        {
          const std::lock_guard lock(reading);
          if (next == count || !reader.read(frame)) return;
          index = next++;
        }
        std::vector<ingest::RenderedDisk> disks(frame.size());
        std::string text;
        for (std::size_t i = 0; i < frame.size(); ++i) {
          disks[i] = {.x_px = geometry.left_wall + frame.x[i] * pixels_per_diameter,
                      .y_px = geometry.floor - frame.z[i] * pixels_per_diameter,
                      .radius_px = frame.radius[i] * pixels_per_diameter,
                      .velocity_x_px_per_s = frame.vx[i] * velocity_px,
                      .velocity_y_px_per_s = -frame.vz[i] * velocity_px};
          text +=
              fmt::format("{},{},{:.6f},{:.6f},{:.6f}\n", index, i, disks[i].x_px, disks[i].y_px, disks[i].radius_px);
        }
        ingest::write_png(context.output("frames") / fmt::format("{:06d}.png", index), renderer.render(disks, index));
        {
          const std::lock_guard lock(reading);
          drawn.emplace(index, std::move(text));
          for (auto at = drawn.find(written); at != drawn.end(); at = drawn.find(++written)) {
            truth << at->second;
            drawn.erase(at);
          }
        }
        context.progress(static_cast<double>(++done) / static_cast<double>(count), "drawing");
      }
    } catch (...) {
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
      stop = true;
    }
  };
  std::vector<std::thread> threads;
  for (int i = 1; i < context.jobs(); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  context.check_interrupted();
  if (failure) std::rethrow_exception(failure);

  truth.close();
  if (!truth) throw StageError("truth.csv could not be written: is the disk full?");
  write_file(context.output("geometry.json"), dump(geometry.to_json()));
  write_file(context.output("bed.json"), dump(bed.to_json()));
  Json result;
  result["frames"] = count;
  result["width"] = quantity_json(camera.width, "px");
  result["height"] = quantity_json(camera.height, "px");
  result["scale"] = quantity_json(options.scale, "m/px");
  result["radius"] = quantity_json(pixels_per_diameter / 2, "px");
  write_file(context.output("render.json"), dump(result));
}

// --- extract

Json profile_numbers(const ingest::DensityProfile& profile) {
  double greatest = 0;
  for (const double density : profile.number_density) greatest = std::max(greatest, density);
  return Json{{"greatest_density", quantity_json(greatest, "1/D^2")},
              {"frames", profile.samples},
              {"memory_frames", profile.memory_frames},
              {"window_frames", profile.window_frames},
              {"independent_samples", profile.independent_samples}};
}

ProfileTable table_of(const ingest::DensityProfile& profile, double width, std::string description) {
  ProfileTable table;
  table.description = std::move(description);
  table.kernel = profile.kernel;
  // Without the empty rows at both ends.
  std::size_t first = 0, last = profile.number_density.size();
  while (first < last && profile.number_density[first] < 1e-12) ++first;
  while (last > first && profile.number_density[last - 1] < 1e-12) --last;
  for (std::size_t i = first; i < last; ++i) {
    const double height = profile.bins.middle(i);
    table.height.push_back(std::abs(height) < 1e-12 ? 0 : height);
    table.number_density.push_back(profile.number_density[i]);
    table.std_error.push_back(profile.std_error[i]);
    table.area_fraction.push_back(profile.area_fraction[i]);
    table.samples.push_back(
        std::round(profile.number_density[i] * width * profile.bins.width * static_cast<double>(profile.samples)));
  }
  return table;
}

// The columns of disks.csv and disk_details.csv, whose rows are written frame by frame.
void describe_tables(RunContext& context) {
  const std::vector<StatedColumn> place{{"frame", "1", "number of the frame, from 0"},
                                        {"x_px", "px", "centre, from the centre of the top-left pixel to the right"},
                                        {"y_px", "px", "centre, from the centre of the top-left pixel downwards"}};
  std::vector<StatedColumn> disks = place, details = place;
  disks.insert(disks.end(), {{"radius_px", "px", "radius"},
                             {"x", "D", "centre, from the left wall"},
                             {"z", "D", "height of the centre above the floor's mean position"},
                             {"quality", "1", "1 is a bead that looks like all the others, 0 is none"}});
  details.insert(details.end(), {{"std_error_x_px", "px", "standard error of x_px"},
                                 {"std_error_y_px", "px", "standard error of y_px"},
                                 {"correlation", "1", "correlation of the two errors"},
                                 {"contrast", "1", "contrast relative to that of the mean bead"},
                                 {"cut", "1", "1 where the border of the frame cuts the bead"},
                                 {"half_hidden", "1", "1 where something covers part of the bead"},
                                 {"species", "1", "1: the first diameter, 2: the second"}});
  write_file(metadata_path(context.output("disks.csv")),
             dump(Table("disks found in each frame", disks).metadata("disks.csv")));
  write_file(metadata_path(context.output("disk_details.csv")),
             dump(Table("errors and marks of the disks found, row by row as in disks.csv", details)
                      .metadata("disk_details.csv")));
}

// What is done with each frame's disks as they come, so that memory does not grow with the film.
class DisksOnTheWay {
 public:
  DisksOnTheWay(RunContext& context, const ExtractOptions& options, std::istream* truth)
      : options_(options),
        disks_(context.output("disks.csv"), std::ios::binary),
        details_(context.output("disk_details.csv"), std::ios::binary),
        truth_(truth) {
    disks_ << ingest::disks_csv_head;
    details_ << ingest::disk_details_csv_head;
    describe_tables(context);
    if (options.frame_rate) {
      ingest::VelocityOptions velocity;
      velocity.frame_rate_hz = *options.frame_rate / static_cast<double>(options.stride);
      velocity.gravity_m_per_s2 = options.gravity;
      meter_.emplace(options.diameter, velocity);
    }
  }

  void take(const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks) {
    disks_ << ingest::disks_csv_rows(disks);
    details_ << ingest::disk_details_csv_rows(disks);
    for (const ingest::MeasuredDisk& disk : disks) {
      ++quality_[std::min<std::size_t>(quality_.size() - 1,
                                       static_cast<std::size_t>(disk.quality * static_cast<double>(quality_.size())))];
      cut_ += disk.cut, half_hidden_ += disk.half_hidden;
      wrong_ += 1 - disk.probability, ++all_;
    }
    if (meter_) {
      std::vector<ingest::MeasuredDisk> first;
      std::copy_if(disks.begin(), disks.end(), std::back_inserter(first),
                   [](const ingest::MeasuredDisk& disk) { return disk.species == 1; });
      meter_->add(first);
    }
    if (truth_ != nullptr) compare(frame.index * options_.stride, disks);
    // Frames to be drawn in the end, spread over a film of unknown length: every so many, thinned out as it goes on.
    if (options_.overlays == 0 || frame.status != ingest::FrameStatus::good || frame.index % every_ != 0) return;
    to_draw_.emplace(frame.index, disks);
    if (to_draw_.size() <= 2 * options_.overlays) return;
    every_ *= 2;
    std::erase_if(to_draw_, [&](const auto& one) { return one.first % every_ != 0; });
  }

  void close() {
    for (std::ofstream* file : {&disks_, &details_}) {
      file->close();
      if (!*file) throw StageError("the tables of disks could not be written: is the disk full?");
    }
  }

  // `options.overlays` of the frames kept, spread evenly.
  [[nodiscard]] std::map<std::size_t, std::vector<ingest::MeasuredDisk>> to_draw() const {
    std::map<std::size_t, std::vector<ingest::MeasuredDisk>> chosen;
    std::size_t number = 0;
    const std::size_t wanted = std::min<std::size_t>(options_.overlays, to_draw_.size());
    for (const auto& [index, disks] : to_draw_) {
      if (chosen.size() < wanted && number * wanted >= chosen.size() * to_draw_.size()) chosen.emplace(index, disks);
      ++number;
    }
    return chosen;
  }
  [[nodiscard]] double expected_wrong_share() const { return all_ > 0 ? wrong_ / static_cast<double>(all_) : 0; }
  [[nodiscard]] std::size_t cut() const { return cut_; }
  [[nodiscard]] std::size_t half_hidden() const { return half_hidden_; }
  [[nodiscard]] std::optional<ingest::VelocityMeasurement> velocities() {
    if (!meter_) return std::nullopt;
    return meter_->result();
  }
  // Share of the disks below which quality is rare, and the table it is told from.
  [[nodiscard]] Json quality() const {
    std::size_t all = 0, below = 0;
    for (const std::size_t count : quality_) all += count;
    Json json;
    for (const double share : {0.01, 0.5}) {
      below = 0;
      std::size_t bin = 0;
      while (bin < quality_.size() && static_cast<double>(below + quality_[bin]) < share * static_cast<double>(all))
        below += quality_[bin++];
      json[share < 0.1 ? "lowest_percent" : "median"] =
          static_cast<double>(bin + 1) / static_cast<double>(quality_.size());
    }
    return json;
  }
  [[nodiscard]] Table quality_table() const {
    Table table("number of disks by quality; 1 is a bead that looks like all the others",
                {{"from", "1", "lowest quality of the class"},
                 {"to", "1", "highest quality of the class"},
                 {"disks", "1", "disks in all frames"}});
    for (std::size_t k = 0; k < quality_.size(); ++k)
      table.add({static_cast<double>(k) / 50, static_cast<double>(k + 1) / 50, count_cell(quality_[k])});
    return table;
  }
  // The same as a histogram; its height goes with the logarithm, so that a few odd disks among thousands show.
  [[nodiscard]] std::string quality_figure() const {
    constexpr double left = 60, top = 20, wide = 560, high = 200;
    const double most = std::log1p(static_cast<double>(*std::max_element(quality_.begin(), quality_.end())));
    const double step = wide / static_cast<double>(quality_.size());
    std::string bars;
    for (std::size_t k = 0; k < quality_.size(); ++k) {
      if (quality_[k] == 0) continue;
      const double tall = high * std::log1p(static_cast<double>(quality_[k])) / most;
      bars += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
          "fill=\"#1f6fb4\"><title>{}</title></rect>\n",
          left + step * static_cast<double>(k), top + high - tall, step - 1, tall, quality_[k]);
    }
    return fmt::format(
               "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 270\" width=\"640\" height=\"270\" "
               "font-family=\"sans-serif\" font-size=\"13\">\n<rect x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" "
               "fill=\"none\" stroke=\"#888\"/>\n<text x=\"{0}\" y=\"{4}\">0</text>\n<text x=\"{5}\" y=\"{4}\" "
               "text-anchor=\"end\">1</text>\n<text x=\"{6}\" y=\"{7}\" text-anchor=\"middle\">quality of the disks: 1 "
               "is a "
               "bead like all the others (heights: logarithm of the number)</text>\n",
               left, top, wide, high, top + high + 20, left + wide, left + wide / 2, top + high + 42) +
           bars + "</svg>\n";
  }
  // Where the truth is known, how near we came.
  [[nodiscard]] std::optional<Json> truth() const {
    if (real_ == 0 || matched_ == 0) return std::nullopt;
    return Json{{"recall", static_cast<double>(matched_) / static_cast<double>(real_)},
                {"precision", static_cast<double>(matched_) / static_cast<double>(std::max<std::size_t>(reported_, 1))},
                {"center_rms_error", quantity_json(std::sqrt(squares_ / static_cast<double>(matched_)), "px")}};
  }

 private:
  using Centres = std::vector<std::pair<double, double>>;

  // The true centres of a frame: the table is in the order of frames.
  Centres truth_of(std::size_t frame) {
    Centres centres;
    for (;;) {
      if (pending_.empty()) {
        if (!std::getline(*truth_, pending_)) return centres;
        if (pending_.empty() || std::isdigit(static_cast<unsigned char>(pending_.front())) == 0) {
          pending_.clear();
          continue;
        }
      }
      const auto cells = split_csv_line(pending_);
      const std::size_t of = cells.size() < 4 ? 0 : static_cast<std::size_t>(std::stoull(cells[0]));
      if (cells.size() >= 4 && of > frame) return centres;
      if (cells.size() >= 4 && of == frame) centres.emplace_back(std::stod(cells[2]), std::stod(cells[3]));
      pending_.clear();
    }
  }

  // Nearest true centre of each disk found, each true centre used once.
  void compare(std::size_t frame, const std::vector<ingest::MeasuredDisk>& disks) {
    Centres truth = truth_of(frame);
    std::sort(truth.begin(), truth.end());
    real_ += truth.size(), reported_ += disks.size();
    std::vector<bool> used(truth.size(), false);
    for (const ingest::MeasuredDisk& disk : disks) {
      const double reach = disk.radius_px / 2;
      auto at = std::lower_bound(truth.begin(), truth.end(), std::pair(disk.x_px - reach, -1e300));
      std::ptrdiff_t best = -1;
      double best_distance = reach * reach;
      for (; at != truth.end() && at->first <= disk.x_px + reach; ++at) {
        const double dx = at->first - disk.x_px, dy = at->second - disk.y_px;
        if (dx * dx + dy * dy < best_distance && !used[static_cast<std::size_t>(at - truth.begin())])
          best_distance = dx * dx + dy * dy, best = at - truth.begin();
      }
      if (best < 0) continue;
      used[static_cast<std::size_t>(best)] = true;
      ++matched_;
      squares_ += best_distance;
    }
  }

  const ExtractOptions& options_;
  std::ofstream disks_, details_;
  std::istream* truth_;
  std::string pending_;
  std::optional<ingest::VelocityMeter> meter_;
  std::array<std::size_t, 50> quality_{};
  std::size_t cut_ = 0, half_hidden_ = 0, matched_ = 0, reported_ = 0, real_ = 0;
  double squares_ = 0, wrong_ = 0;  // wrong_: the disks' doubts, summed
  std::size_t all_ = 0;
  std::size_t every_ = 1;
  std::map<std::size_t, std::vector<ingest::MeasuredDisk>> to_draw_;
};

Table bead_table(const ingest::FinderCalibration& finder) {
  Table table("the bead as learned from the frames, by distance from its centre",
              {{"radius_px", "px", "distance from the centre"},
               {"contrast", "1", "1 inside a flat bead, 0 far outside"},
               {"fourth_harmonic", "1", "amplitude of the dependence on direction with four-fold symmetry"}});
  for (std::size_t k = 0; k < finder.profile.level.size(); ++k)
    table.add(
        {static_cast<double>(k) * finder.profile.step_px, finder.profile.level[k], finder.profile.fourth_harmonic[k]});
  return table;
}

// What was found in each frame.
Table frames_table(const std::vector<ingest::FrameReport>& frames) {
  Table table("what was found in each frame",
              {{"frame", "1", "number of the frame, from 0"},
               {"image", "", "file that holds the frame"},
               {"page", "1", "page of the file or frame of the film, from 0"},
               {"status", "", "good, nothing_found, unreadable or size_changed"},
               {"disks", "1", "disks found"},
               {"second", "1", "disks of the second diameter among them"},
               {"rejected", "1", "places that were looked at and rejected"},
               {"residual_level_grey_levels", "grey levels", "rms difference of the frame and its model"},
               {"contrast_gain", "1", "contrast relative to that of all frames"}});
  constexpr const char* names[] = {"good", "nothing_found", "unreadable", "size_changed"};
  for (const ingest::FrameReport& frame : frames)
    table.add({count_cell(frame.index), std::filesystem::path(frame.origin.path).filename().string(),
               count_cell(frame.origin.page), std::string(names[static_cast<std::size_t>(frame.status)]),
               count_cell(frame.disks), count_cell(frame.second), count_cell(frame.rejected), frame.residual_level,
               frame.light.gain});
  return table;
}

// What photographs show of their bed.
BedDescription bed_seen(const ExtractOptions& options, const ingest::Measurement& found) {
  const ingest::BedCalibration& seen = found.calibration;
  BedDescription bed;
  bed.count = found.disk_count_mean;
  bed.diameter = options.diameter, bed.second_diameter = options.second_diameter;
  bed.gravity = options.gravity;
  bed.width = seen.width * options.diameter;
  if (seen.shaking_frequency_hz > 0) {
    bed.frequency = seen.shaking_frequency_hz;
    bed.amplitude = seen.floor_amplitude_px * seen.scale_m_per_px;
  }
  return bed;
}

// profile.csv with its covariance; profiles of a second species, from covered area and by phase where there are some.
void write_profiles(RunContext& context, const ingest::Measurement& found, double column_number) {
  const double width = found.calibration.width;
  ProfileTable profile = table_of(found.profile, width, "density profile of the disks found, mean over the frames");
  profile.column_number = column_number;
  write_profile_csv(context.output("profile.csv"), profile);
  if (found.second_profile)
    write_profile_csv(context.output("second_profile.csv"),
                      table_of(*found.second_profile, width,
                               "density profile of the beads of the second diameter; D is the first diameter"));
  if (found.coverage_profile)
    write_profile_csv(context.output("coverage_profile.csv"),
                      table_of(*found.coverage_profile, width, "density profile from the covered area"));
  for (std::size_t i = 0; i < found.phases.size(); ++i) {
    ProfileTable phase = table_of(found.phases[i].profile, width, "density profile at one phase of the shaking");
    phase.phase = found.phases[i].phase;
    write_profile_csv(context.output(fmt::format("profile_phase_{:02d}.csv", i)), phase);
  }
  std::vector<double> heights, covariance = found.profile.covariance;
  for (std::size_t i = 0; i < found.profile.number_density.size(); ++i) heights.push_back(found.profile.bins.middle(i));
  if (covariance.size() != heights.size() * heights.size()) heights.clear();
  write_covariance_csv(context.output("covariance.csv"), heights, covariance, found.profile.independent_samples);
}

// Disks found and places rejected, frame by frame: missing and doubled beads show as dips and spikes.
std::string count_figure(const std::vector<ingest::FrameReport>& frames) {
  constexpr double left = 60, top = 20, wide = 560, high = 200;
  std::size_t most = 1;
  for (const ingest::FrameReport& frame : frames) most = std::max({most, frame.disks, frame.rejected});
  const std::size_t stride = std::max<std::size_t>(1, frames.size() / 2000);
  const auto line = [&](auto member, const char* colour) {
    std::string points;
    for (std::size_t k = 0; k < frames.size(); k += stride)
      points += fmt::format("{:.1f},{:.1f} ",
                            left + wide * (static_cast<double>(k) + 0.5) / static_cast<double>(frames.size()),
                            top + high * (1 - static_cast<double>(frames[k].*member) / static_cast<double>(most)));
    return fmt::format("<polyline fill=\"none\" stroke=\"{}\" points=\"{}\"/>\n", colour, points);
  };
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 640 270\" width=\"640\" height=\"270\" "
             "font-family=\"sans-serif\" font-size=\"13\">\n<rect x=\"{0}\" y=\"{1}\" width=\"{2}\" height=\"{3}\" "
             "fill=\"none\" "
             "stroke=\"#888\"/>\n<text x=\"{4}\" y=\"{5}\" text-anchor=\"end\">{6}</text>\n<text x=\"{4}\" y=\"{7}\" "
             "text-anchor=\"end\">0</text>\n<text x=\"{0}\" y=\"{8}\">frame 0 to {9}: disks found (blue), places "
             "rejected (orange)</text>\n",
             left, top, wide, high, left - 6, top + 12, most, top + high, top + high + 25,
             frames.empty() ? 0 : frames.size() - 1) +
         line(&ingest::FrameReport::disks, "#1f6fb4") + line(&ingest::FrameReport::rejected, "#e08214") + "</svg>\n";
}

// The frames kept with the disks found, and of the first of them what the model leaves.
void draw_overlays(const ExtractOptions& options, RunContext& context, const std::vector<std::string>& paths,
                   const ingest::FrameSourceOptions& source_options, const ingest::Measurement& found,
                   const DisksOnTheWay& on_the_way) {
  const auto to_draw = on_the_way.to_draw();
  if (options.overlays == 0 || to_draw.empty()) return;
  const ingest::BedCalibration& bed = found.calibration;
  ingest::FrameSourceOptions whole = source_options;
  whole.reduction = 1;
  ingest::FrameSource again = ingest::FrameSource::open(paths, whole);
  bool first = source_options.reduction == 1 && !found.finder.by_rims;  // then there is a model of the frame
  for (auto item = again.next_item(); item && item->index <= to_draw.rbegin()->first; item = again.next_item()) {
    const auto at = to_draw.find(item->index);
    if (at == to_draw.end()) continue;
    context.check_interrupted();
    ingest::GrayFrame frame = item->decode();
    const ingest::LensMap lens(bed.lens, frame.width, frame.height);
    if (!bed.lens.plain()) frame = lens.corrected(frame);
    ingest::FindResult shown;
    shown.light = found.frames.at(item->index).light;
    for (const ingest::MeasuredDisk& disk : at->second) {
      ingest::FoundDisk circle;
      const ingest::PixelPlace place = lens.to_true({disk.x_px, disk.y_px});
      circle.x_px = place.x, circle.y_px = place.y, circle.radius_px = disk.radius_px;
      circle.quality = disk.quality, circle.cut = disk.cut, circle.half_hidden = disk.half_hidden;
      shown.disks.push_back(circle);
    }
    ingest::OverlayOptions overlay;
    overlay.magnification = frame.width <= 700 ? 2 : 1;
    overlay.floor_px = bed.floor_px, overlay.floor_slope = bed.floor_slope;
    if (!bed.walls_are_frame_sides) overlay.left_wall_px = bed.left_wall_px, overlay.right_wall_px = bed.right_wall_px;
    ingest::write_overlay(context.output(fmt::format("overlay_{:06d}.png", item->index)), frame, shown.disks, overlay);
    if (first) {
      ingest::GrayFrame residual = ingest::residual_frame(frame, shown, found.finder);
      for (float& level : residual.pixels) level += 128;  // grey where the model explains all
      ingest::write_png(context.output(fmt::format("residual_{:06d}.png", item->index)), residual);
    }
    first = false;
  }
}

// The beads the first frame shows: channel, radius and polarity to go on with. Refuses when it shows none.
void use_first_look(const ExtractOptions& options, RunContext& context, const std::vector<std::string>& paths,
                    ingest::FrameSourceOptions& source, ingest::MeasureOptions& measure) {
  context.progress(0, "looking for beads");
  const std::optional<FirstLook> look = look_at_first(paths, options);
  if (!look) return;  // measure_bed() says which files cannot be read
  const ingest::Survey& survey = look->survey;
  const std::string diameter = fmt::format("{:g} mm", 1e3 * options.diameter);
  if (!survey.found) {
    write_preview(context.scratch(), *look, options.images.texts, diameter);
    std::string message = fmt::format("{}: no beads: {}. See {}", look->path, survey.why_not,
                                      (context.scratch() / "preview.html").string());
    message += survey.candidates.empty()
                   ? ". If there are beads, give their radius in pixels (--radius) and a region (--roi)"
                   : ". If the beads are those of one of its pictures, crop to them with --roi, or try";
    for (std::size_t k = 0; k < std::min<std::size_t>(2, survey.candidates.size()); ++k)
      message += fmt::format("{} {}", k ? " or" : "", options_for(survey.candidates[k]));
    const bool any = std::any_of(survey.candidates.begin(), survey.candidates.end(),
                                 [](const ingest::SurveyCandidate& one) { return !one.disks.empty(); });
    if (any) throw StageError(message);
    throw InputError(message);
  }
  const ingest::SurveyCandidate* chosen = &survey.candidates.front();
  if (options.bead_number) {  // of what may be beads, the kind that is as numerous as told
    const auto off = [&](const ingest::SurveyCandidate& one) {
      return std::abs(std::log(static_cast<double>(std::max<std::size_t>(1, one.disks.size())) /
                               static_cast<double>(*options.bead_number)));
    };
    constexpr double clearly = 0.1;
    for (const ingest::SurveyCandidate& other : survey.candidates)
      if (other.credible && off(other) + clearly < off(*chosen)) chosen = &other;
  }
  source.channel = chosen->channel;
  measure.find.seen = ingest::BeadsSeen{chosen->rims.polarity, chosen->rims.radius_px};
  // Large beads need not be seen by every pixel: a radius of 12 to 24 px is enough.
  constexpr double enough_px = 12, large_frame = 2e6;
  if (static_cast<double>(look->width) * look->height > large_frame)
    source.reduction = measure.reduction = std::max(1, static_cast<int>(chosen->rims.radius_px / enough_px));
  context.log(fmt::format("beads of {:.2f} px radius ({}): {} in the first frame", chosen->rims.radius_px,
                          options_for(*chosen), chosen->disks.size()));
}

// Refuses, or warns first of all, when many disks may be wrong or the number given is contradicted.
void judge_disks(const ExtractOptions& options, RunContext& context, const ingest::Measurement& found,
                 const DisksOnTheWay& on_the_way) {
  constexpr double most_wrong = 0.2, worth_a_word = 0.02, far_off = 0.2;
  const double wrong = on_the_way.expected_wrong_share();
  if (wrong > most_wrong)
    throw StageError(
        fmt::format("{:.0f} % of the {} disks found may be wrong: too many to measure anything. Look at "
                    "fit-images --preview, and give --radius, --polarity, --channel or --roi",
                    100 * wrong, found.disk_total));
  if (wrong > worth_a_word)
    context.warning(
        fmt::format("{:.1f} % of the disks found may be wrong: look at the overlays before you use the "
                    "numbers.",
                    100 * wrong));
  if (!options.bead_number) return;
  const double ratio = found.disk_count_mean / static_cast<double>(*options.bead_number);
  const std::string text = fmt::format("On average {:.2f} beads were found, but bead_number is {}",
                                       found.disk_count_mean, *options.bead_number);
  if (std::abs(ratio - 1) > far_off)
    throw StageError(text +
                     ": something else was found. Look at fit-images --preview, and give --radius, --polarity, "
                     "--channel or --roi; or correct --bead-number");
  if (std::abs(ratio - 1) > 1e-3)
    context.warning(text + (ratio < 1 ? ": some are missed or out of view (count.svg, overlays)."
                                      : ": something else passes for a bead (overlays), or there are more."));
}

void extract_disks(const ExtractOptions& options, RunContext& context) {
  const Input* rendered = context.find_input("render");
  ingest::MeasureOptions measure;
  measure.bead_diameter_m = options.diameter;
  measure.scale_m_per_px = options.scale;
  measure.floor_px = options.floor, measure.floor_slope = options.floor_slope;
  measure.left_wall_px = options.left_wall, measure.right_wall_px = options.right_wall;
  measure.second_diameter_m = options.second_diameter;
  measure.pixel_aspect = options.pixel_aspect, measure.lens_radial = options.lens_radial;
  measure.find.polarity = polarity_of(options.polarity);
  measure.find.radius_px = options.radius;
  measure.find.keep_half_hidden = options.keep_half_hidden;
  if (options.roi.size() == 4) {
    measure.find.roi = ingest::PixelRectangle{static_cast<int>(options.roi[0]), static_cast<int>(options.roi[1]),
                                              static_cast<int>(options.roi[2]), static_cast<int>(options.roi[3])};
  }
  measure.kernel = options.kernel;
  measure.bin_width = options.spacing;
  measure.lowest = options.lowest, measure.highest = options.highest;
  measure.shaking_frequency_hz = options.frequency;
  measure.threads = static_cast<unsigned>(context.jobs());

  std::vector<std::string> paths;
  if (rendered != nullptr) {
    const FrameGeometry geometry = FrameGeometry::read(rendered->file("geometry.json"));
    if (options.use_geometry) {
      if (!measure.pixel_aspect) measure.pixel_aspect = 1;
      if (!measure.lens_radial) measure.lens_radial = 0;
      if (!measure.scale_m_per_px) measure.scale_m_per_px = geometry.scale;
      if (!measure.floor_px) measure.floor_px = geometry.floor;
      if (!measure.left_wall_px) measure.left_wall_px = geometry.left_wall, measure.right_wall_px = geometry.right_wall;
    }
    if (!measure.lowest) {
      // Heights at multiples of the spacing, low enough for what lies below the floor's mean while it is down.
      const double reach = kernel_reach(options.kernel);
      measure.lowest = (std::floor((std::min(0.0, geometry.lowest) - reach) / options.spacing) - 0.5) * options.spacing;
    }
    paths.push_back((rendered->directory / "frames").string());
  } else {
    // What is named is used; of folders and patterns, what is a picture or a film.
    const auto name_of = [](std::string_view path) { return path.substr(path.find_last_of('/') + 1); };
    std::set<std::string_view> named;
    for (const std::string& text : options.images.texts) named.insert(name_of(text));
    paths.reserve(options.images.paths.size());
    for (const std::string& path : options.images.paths)
      if (named.contains(name_of(path)) || ingest::FrameSource::is_frame_file(path)) paths.push_back(path);
    if (paths.empty())
      throw InputError(
          fmt::format("{}: holds neither a picture nor a film; name files ending in .png, .tif, .jpg, .bmp, "
                      ".pgm, .mp4, .avi, .mov or .mkv",
                      options.images.texts.front()));
  }
  ingest::FrameSourceOptions source_options;
  source_options.stride = options.stride;
  source_options.channel = channel_of(options.channel);
  if (rendered == nullptr) use_first_look(options, context, paths, source_options, measure);
  ingest::FrameSource source = ingest::FrameSource::open(paths, source_options);
  // A film's own frame rate serves for the shaker's phase only: fast cameras write films to be watched slowly.
  measure.frame_rate_hz =
      options.frame_rate ? *options.frame_rate / static_cast<double>(options.stride) : source.film_rate_hz();
  const std::optional<std::size_t> total = source.count_if_known();
  measure.progress = [&](std::size_t done) {
    context.check_interrupted();
    if (total && *total > 0) context.progress(static_cast<double>(done) / static_cast<double>(*total), "finding disks");
  };
  std::optional<std::ifstream> truth_file;
  if (rendered != nullptr && rendered->has("truth.csv")) truth_file.emplace(rendered->file("truth.csv"));
  DisksOnTheWay on_the_way(context, options, truth_file ? &*truth_file : nullptr);
  measure.disk_sink = [&](const ingest::FrameReport& frame, const std::vector<ingest::MeasuredDisk>& disks) {
    on_the_way.take(frame, disks);
  };
  const ingest::Measurement found = ingest::measure_bed(source, measure);
  context.check_interrupted();
  on_the_way.close();
  if (rendered == nullptr) judge_disks(options, context, found, on_the_way);

  const ingest::BedCalibration& bed = found.calibration;
  for (const std::string& warning : found.warnings) context.warning(warning);
  std::size_t bad = 0;
  for (const ingest::FrameReport& frame : found.frames) {
    if (frame.status == ingest::FrameStatus::good) continue;
    if (++bad <= 5)
      context.warning(fmt::format("frame {} ({}): {}", frame.index,
                                  std::filesystem::path(frame.origin.path).filename().string(), frame.why));
  }
  if (bad > 5) context.warning(fmt::format("and {} more frames that could not be used, listed in frames.csv", bad - 5));
  if (options.frame_rate && !(bed.shaking_frequency_hz > 0))
    context.warning("No shaking is seen in the film (" + bed.why_no_frequency +
                    "): there are no profiles by phase. Give frequency (--frequency) if the bed is shaken.");
  if (bed.shaking_frequency_hz > 0 && !options.frame_rate)
    context.warning(
        fmt::format("Times are by the film's own {:g} frames/s; if it was recorded faster, give frame_rate "
                    "(--frame-rate): the shaking's frequency grows with it, its phases stay.",
                    *measure.frame_rate_hz * static_cast<double>(options.stride)));
  const double column_number = found.disk_count_mean / bed.width;
  write_profiles(context, found, column_number);
  frames_table(found.frames).write(context.output("frames.csv"));

  Json result;
  result["frames"] = found.frames.size();
  result["frames_used"] = found.profile.samples;
  result["disks_per_frame"] = quantity_json(found.disk_count_mean, "1");
  result["disks_per_frame_scatter"] = found.disk_count_std;
  if (options.bead_number) result["bead_number"] = *options.bead_number;
  result["diameter"] = quantity_json(options.diameter, "m");
  result["scale"] = quantity_json(bed.scale_m_per_px, "m/px", bed.scale_m_per_px * bed.scale_relative_std_error);
  result["scale_given"] = bed.scale_given;
  result["pixel_aspect"] = quantity_json(bed.lens.pixel_aspect, "1", bed.aspect_std_error);
  result["lens"] = quantity_json(bed.lens.radial, "1", bed.lens_radial_std_error);
  result["radius"] = quantity_json(bed.radius_px, "px", bed.radius_std_error_px);
  result["edge_width"] = quantity_json(bed.edge_width_px, "px");
  result["noise"] = quantity_json(bed.noise_level, "grey levels");
  result["contrast"] = quantity_json(bed.contrast_level, "grey levels");
  result["flicker"] = quantity_json(bed.flicker, "1");
  result["polarity"] = bed.polarity == ingest::Polarity::bright_beads ? "bright" : "dark";
  result["floor"] = quantity_json(bed.floor_px, "px");
  result["floor_given"] = bed.floor_given;
  result["floor_tilt"] = quantity_json(bed.floor_tilt_degrees, "deg", bed.floor_tilt_std_error_degrees);
  if (bed.shaking_frequency_hz > 0) {
    result["frequency"] = quantity_json(bed.shaking_frequency_hz, "Hz", bed.shaking_frequency_std_error_hz);
    result["frequency_given"] = bed.frequency_given;
    if (!bed.frequency_given) result["frequency_false_alarm"] = bed.frequency_false_alarm;
    result["floor_amplitude"] = quantity_json(bed.floor_amplitude_px * bed.scale_m_per_px, "m");
    result["floor_phase"] = bed.floor_phase;
  }
  result["left_wall"] = quantity_json(bed.left_wall_px, "px");
  result["right_wall"] = quantity_json(bed.right_wall_px, "px");
  result["walls_given"] = bed.walls_given;
  result["walls_are_frame_sides"] = bed.walls_are_frame_sides;
  result["width"] = quantity_json(bed.width, "D");
  result["column_number"] = quantity_json(
      column_number, "1",
      found.disk_count_std / bed.width / std::sqrt(std::max<double>(1, static_cast<double>(found.profile.samples))));
  result["kernel"] = Json{{"kind", to_string(options.kernel.kind)}, {"width", options.kernel.width}};
  result["profile"] = profile_numbers(found.profile);
  if (found.coverage_profile) result["coverage_disagreement"] = quantity_json(found.coverage_disagreement, "1/D^2");

  result["quality"] = on_the_way.quality();
  if (found.second_finder) {
    std::size_t second = 0;
    for (const ingest::FrameReport& frame : found.frames) second += frame.second;
    result["second_species"] =
        Json{{"radius", quantity_json(found.second_finder->radius_px, "px", found.second_finder->radius_std_error_px)},
             {"disks_per_frame", static_cast<double>(second) / static_cast<double>(found.frames.size())}};
  }
  result["cut_disks"] = on_the_way.cut(), result["half_hidden_disks"] = on_the_way.half_hidden();
  if (const auto velocities = on_the_way.velocities()) {
    for (const std::string& warning : velocities->warnings) context.warning(warning);
    const auto temperature = [](const ingest::KineticTemperature& t) {
      Json json = quantity_json(t.over_mg_m, "m", t.std_error_m);
      json["localisation_bias"] = t.localisation_bias_m, json["finite_time_factor"] = t.finite_time_factor;
      return json;
    };
    result["velocities"] = Json{{"temperature_x_over_mg", temperature(velocities->horizontal)},
                                {"temperature_z_over_mg", temperature(velocities->vertical)},
                                {"linked_share", velocities->linked_share},
                                {"mean_step", quantity_json(velocities->mean_step, "D")}};
  }
  if (const auto truth = on_the_way.truth()) result["truth"] = *truth;
  write_file(context.output("extract.json"), dump(result));
  write_file(context.output("bed.json"),
             dump((rendered != nullptr ? BedDescription::read(rendered->file("bed.json")) : bed_seen(options, found))
                      .to_json()));

  on_the_way.quality_table().write(context.output("quality.csv"));
  write_file(context.output("quality.svg"), on_the_way.quality_figure());
  bead_table(found.finder).write(context.output("bead.csv"));
  ingest::write_png(context.output("bead.png"), ingest::bead_picture(found.finder, 8));
  write_file(context.output("count.svg"), count_figure(found.frames));
  draw_overlays(options, context, paths, source_options, found, on_the_way);
}

std::string preview_images(const PreviewRequest& request) {
  ingest::FrameSource source = ingest::FrameSource::open(request.files, {});
  std::vector<std::string> paths;
  constexpr std::size_t enough = 5;
  for (auto item = source.next_item(); item && paths.size() < enough; item = source.next_item())
    if (paths.empty() || paths.back() != item->origin.path) paths.push_back(item->origin.path);
  const std::optional<FirstLook> look = look_at_first(paths, request.options);
  if (!look) throw InputError(fmt::format("{}: none of the first pictures can be read", paths.front()));
  write_preview(request.folder, *look, request.files, request.diameter);
  if (!look->survey.found) return fmt::format("no beads: {}", look->survey.why_not);
  const ingest::SurveyCandidate& best = look->survey.candidates.front();
  return fmt::format("{} {} beads of {:.2f} px radius in channel {}; expected share of wrong ones {:.1f} %",
                     best.disks.size(), best.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark",
                     best.rims.radius_px, ingest::name_of(best.channel), 100 * best.expected_wrong);
}

// ingest's own errors become ours.
template <class Work>
void translated(const Work& work) {
  try {
    work();
  } catch (const ingest::InputError& error) {
    throw InputError(error.what());
  } catch (const std::invalid_argument& error) {
    throw StageError(error.what());
  }
}

class Module : public ImagesModule {
 public:
  void render(const RenderOptions& options, RunContext& context) const override {
    translated([&] { render_frames(options, context); });
  }
  void extract(const ExtractOptions& options, RunContext& context) const override {
    translated([&] { extract_disks(options, context); });
  }
  std::string preview(const PreviewRequest& request) const override {
    std::string sentence;
    translated([&] { sentence = preview_images(request); });
    return sentence;
  }
};

}  // namespace
}  // namespace shakebed::pipelines

extern "C" __attribute__((visibility("default"))) const shakebed::pipelines::ImagesModule* shakebed_images(
    const char* version) {
  static const shakebed::pipelines::Module module;
  return std::strcmp(version, SHAKEBED_VERSION) == 0 ? &module : nullptr;
}
