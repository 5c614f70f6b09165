#include "pipelines/stages/extract_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "ingest/frames/small_picture.hpp"
#include "ingest/profile/overlay.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"

namespace shakebed::pipelines {
namespace {

// Of the picture of what the model leaves, for the page: marks of a pixel's width are still seen.
constexpr int residual_width = 620, residual_quality = 50;

// What heights are above.
const char* origin_of_heights(const ingest::BedCalibration& bed) {
  switch (bed.floor_reference) {
    case ingest::FloorReference::given:
      return "the given row of the floor";
    case ingest::FloorReference::mean_of_motion:
    case ingest::FloorReference::mean_by_amplitude:
      return "the floor's mean position";
    case ingest::FloorReference::lowest_seen:
      return "the lowest position of the floor that the beads show";
  }
  return "the floor";
}

ProfileTable table_of(const ingest::DensityProfile& profile, const ingest::BedCalibration& bed,
                      std::string description) {
  const double width = bed.width;
  ProfileTable table;
  table.description = std::move(description);
  table.origin = origin_of_heights(bed);
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

Json profile_numbers(const ingest::DensityProfile& profile) {
  double greatest = 0;
  for (const double density : profile.number_density) greatest = std::max(greatest, density);
  return Json{{"greatest_density", quantity_json(greatest, "1/D^2")},
              {"frames", profile.samples},
              {"memory_frames", profile.memory_frames},
              {"window_frames", profile.window_frames},
              {"independent_samples", profile.independent_samples}};
}

void add_beads(const ExtractOptions& options, const ingest::Measurement& found, Json& result) {
  const ingest::BedCalibration& bed = found.calibration;
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
}

void add_geometry(const ingest::Measurement& found, Json& result) {
  const ingest::BedCalibration& bed = found.calibration;
  result["floor"] = quantity_json(bed.floor_px, "px", bed.floor_std_error_px);
  result["shaken"] = ingest::is_shaken(found);
  result["floor_reference"] = ingest::to_string(bed.floor_reference);
  result["floor_given"] = bed.floor_given;
  result["floor_tilt"] = quantity_json(bed.floor_tilt_degrees, "deg", bed.floor_tilt_std_error_degrees);
  if (bed.shaking_frequency_hz > 0) {
    result["frequency"] = quantity_json(bed.shaking_frequency_hz, "Hz", bed.shaking_frequency_std_error_hz);
    result["frequency_given"] = bed.frequency_given;
    if (!bed.frequency_given) result["frequency_false_alarm"] = bed.frequency_false_alarm;
    const double amplitude = bed.floor_amplitude_px * bed.scale_m_per_px;
    result["floor_amplitude"] = amplitude > 0
                                    ? quantity_json(amplitude, "m",
                                                    std::hypot(bed.floor_amplitude_std_error_px * bed.scale_m_per_px,
                                                               amplitude * bed.scale_relative_std_error))
                                    : quantity_json(amplitude, "m");
    result["floor_phase"] = bed.floor_phase;
  }
  result["left_wall"] = quantity_json(bed.left_wall_px, "px");
  result["right_wall"] = quantity_json(bed.right_wall_px, "px");
  result["walls_given"] = bed.walls_given;
  result["walls_are_frame_sides"] = bed.walls_are_frame_sides;
  result["width"] = quantity_json(bed.width, "D");
}

void add_density(const ExtractOptions& options, const ingest::Measurement& found, Json& result) {
  const double width = found.calibration.width;
  const double samples = std::max<double>(1, static_cast<double>(found.profile.samples));
  if (const auto column = found.column_number())
    result["column_number"] = quantity_json(*column, "1", found.count_in_width_std / width / std::sqrt(samples));
  result["kernel"] = Json{{"kind", to_string(options.kernel.kind)}, {"width", options.kernel.width}};
  result["profile"] = profile_numbers(found.profile);
  if (found.coverage_profile) result["coverage_disagreement"] = quantity_json(found.coverage_disagreement, "1/D^2");
  if (found.second_finder) {
    const ingest::FinderCalibration& finder = *found.second_finder;
    const double px = found.finder.recorded_px;
    double second = 0;  // in the frames used, as disks_per_frame
    for (const ingest::FrameReport& frame : found.frames) second += static_cast<double>(frame.second);
    result["second_species"] =
        Json{{"radius", quantity_json(finder.radius_px * px, "px", finder.radius_std_error_px * px)},
             {"disks_per_frame", second / samples}};
  }
}

}  // namespace

Json bed_numbers(const ExtractOptions& options, const ingest::Measurement& found) {
  Json result;
  add_beads(options, found, result);
  add_geometry(found, result);
  add_density(options, found, result);
  if (found.finder.rims)
    result["expected_wrong"] = found.expected_wrong, result["expected_missed"] = found.finder.expected_missed;
  return result;
}

Json velocity_numbers(const ingest::VelocityMeasurement& velocities, double frame_rate_hz) {
  const auto temperature = [](const ingest::KineticTemperature& t) {
    Json json = quantity_json(t.over_mg_m, "m", t.std_error_m);
    json["localisation_bias"] = t.localisation_bias_m, json["finite_time_factor"] = t.finite_time_factor;
    return json;
  };
  const auto of_displacements = [](const ingest::KineticTemperature& t) {
    return quantity_json(t.displacement_m, "m", t.displacement_error_m);
  };
  return Json{{"temperature_x_over_mg", temperature(velocities.horizontal)},
              {"temperature_z_over_mg", temperature(velocities.vertical)},
              {"temperature_x_of_displacements_over_mg", of_displacements(velocities.horizontal)},
              {"temperature_z_of_displacements_over_mg", of_displacements(velocities.vertical)},
              {"frame_rate", quantity_json(frame_rate_hz, "Hz")},
              {"usable", velocities.usable()},
              {"linked_share", velocities.linked_share},
              {"mean_step", quantity_json(velocities.mean_step, "D")}};
}

Table bead_table(Table table, const ingest::FinderCalibration& finder) {
  for (std::size_t k = 0; k < finder.profile.level.size(); ++k)
    table.add({static_cast<double>(k) * finder.profile.step_px * finder.recorded_px, finder.profile.level[k],
               finder.profile.fourth_harmonic[k]});
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
  bed.count = found.count_in_width_mean;
  bed.diameter = options.diameter, bed.second_diameter = options.second_diameter;
  bed.gravity = options.gravity;
  bed.width = seen.width * options.diameter;
  bed.height_origin = origin_of_heights(seen);
  if (seen.shaking_frequency_hz > 0) {
    bed.frequency = seen.shaking_frequency_hz;
    bed.amplitude = seen.floor_amplitude_px * seen.scale_m_per_px;
  }
  return bed;
}

void write_profiles(RunContext& context, const ingest::Measurement& found) {
  const ingest::BedCalibration& bed = found.calibration;
  ProfileTable profile = table_of(found.profile, bed, "density profile of the disks found, mean over the frames");
  profile.column_number = found.column_number();
  write_profile_csv(context.output("profile.csv"), profile);
  if (found.second_profile)
    write_profile_csv(context.output("second_profile.csv"),
                      table_of(*found.second_profile, bed,
                               "density profile of the beads of the second diameter; D is the first diameter"));
  if (found.coverage_profile)
    write_profile_csv(context.output("coverage_profile.csv"),
                      table_of(*found.coverage_profile, bed, "density profile from the covered area"));
  for (std::size_t i = 0; i < found.phases.size(); ++i) {
    ProfileTable phase = table_of(found.phases[i].profile, bed, "density profile at one phase of the shaking");
    phase.phase = found.phases[i].phase;
    write_profile_csv(context.output(fmt::format("profile_phase_{:02d}.csv", i)), phase);
  }
  std::vector<double> heights, covariance = found.profile.covariance;
  for (std::size_t i = 0; i < found.profile.number_density.size(); ++i) heights.push_back(found.profile.bins.middle(i));
  if (covariance.size() != heights.size() * heights.size()) heights.clear();
  write_covariance_csv(context.output("covariance.csv"), heights, covariance, found.profile.independent_samples);
}

int FilmFiles::reduction_shown(double wanted) const {
  return std::clamp(static_cast<int>(std::ceil(wanted)), 1, source.reduction);
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
  ingest::FrameSourceOptions shown_source = film.source;
  const double pixels = static_cast<double>(found.finder.width) * found.finder.height;
  const int reduction = shown_source.reduction =
      film.reduction_shown(std::sqrt(pixels / ingest::most_overlay_pixels) * film.source.reduction);
  const auto place = [&](double px) { return (px + 0.5) / reduction - 0.5; };  // in the reduced frame
  ingest::FrameSource again = ingest::FrameSource::open(film.paths, shown_source);
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
      const ingest::PixelPlace at_true = lens.to_true({place(disk.x_px), place(disk.y_px)});
      circle.x_px = at_true.x, circle.y_px = at_true.y, circle.radius_px = disk.radius_px / reduction;
      circle.quality = disk.quality, circle.cut = disk.cut, circle.half_hidden = disk.half_hidden;
      shown.disks.push_back(circle);
    }
    ingest::OverlayOptions overlay;
    overlay.magnification = frame.width <= 700 ? 2 : 1;
    overlay.floor_px = place(bed.floor_px + bed.floor_slope * 0.5 * (reduction - 1));
    overlay.floor_slope = bed.floor_slope;
    if (!bed.walls_are_frame_sides)
      overlay.left_wall_px = place(bed.left_wall_px), overlay.right_wall_px = place(bed.right_wall_px);
    ingest::write_overlay(context.output(fmt::format("overlay_{:06d}.png", item->index)), frame, shown.disks, overlay);
    if (first) {
      ingest::GrayFrame residual = ingest::residual_frame(frame, shown, found.finder);
      for (float& level : residual.pixels) level += 128;  // grey where the model explains all
      ingest::write_png(context.output(fmt::format("residual_{:06d}.png", item->index)), residual);
      write_file(context.output("residual.webp"), ingest::small_webp(residual, residual_width, residual_quality));
    }
    first = false;
  }
}

}  // namespace shakebed::pipelines
