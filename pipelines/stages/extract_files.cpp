#include "pipelines/stages/extract_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "ingest/profile/overlay.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"

namespace shakebed::pipelines {
namespace {

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

}  // namespace

Json profile_numbers(const ingest::DensityProfile& profile) {
  double greatest = 0;
  for (const double density : profile.number_density) greatest = std::max(greatest, density);
  return Json{{"greatest_density", quantity_json(greatest, "1/D^2")},
              {"frames", profile.samples},
              {"memory_frames", profile.memory_frames},
              {"window_frames", profile.window_frames},
              {"independent_samples", profile.independent_samples}};
}

Table bead_table(Table table, const ingest::FinderCalibration& finder) {
  for (std::size_t k = 0; k < finder.profile.level.size(); ++k)
    table.add(
        {static_cast<double>(k) * finder.profile.step_px, finder.profile.level[k], finder.profile.fourth_harmonic[k]});
  return table;
}

Table frames_table(Table table, const std::vector<ingest::FrameReport>& frames) {
  constexpr const char* names[] = {"good", "nothing_found", "unreadable", "size_changed"};
  for (const ingest::FrameReport& frame : frames)
    table.add({count_cell(frame.index), std::filesystem::path(frame.origin.path).filename().string(),
               count_cell(frame.origin.page), std::string(names[static_cast<std::size_t>(frame.status)]),
               count_cell(frame.disks), count_cell(frame.second), count_cell(frame.rejected), frame.residual_level,
               frame.light.gain});
  return table;
}

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

void draw_overlays(RunContext& context, const FilmFiles& film, const ingest::Measurement& found,
                   const DisksOnTheWay& on_the_way) {
  const auto to_draw = on_the_way.to_draw();
  if (to_draw.empty()) return;
  const ingest::BedCalibration& bed = found.calibration;
  ingest::FrameSourceOptions whole = film.source;
  whole.reduction = 1;
  ingest::FrameSource again = ingest::FrameSource::open(film.paths, whole);
  bool first = film.source.reduction == 1 && !found.finder.by_rims;  // then there is a model of the frame
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

}  // namespace shakebed::pipelines
