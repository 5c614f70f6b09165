// The files of an extract stage: profiles, tables, figures, pictures.
#pragma once

#include <string>
#include <vector>

#include "ingest/profile/measure_bed.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/disks_on_the_way.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

// What extract.json says of the bed and of its profile.
Json bed_numbers(const ExtractOptions& options, const ingest::Measurement& found);
// "/velocities" of extract.json.
Json velocity_numbers(const ingest::VelocityMeasurement& velocities, double frame_rate_hz);

// The bead as learned from the frames, by distance from its centre.
Table bead_table(Table table, const ingest::FinderCalibration& finder);

// What was found in each frame.
Table frames_table(Table table, const std::vector<ingest::FrameReport>& frames);

// What photographs show of their bed.
BedDescription bed_seen(const ExtractOptions& options, const ingest::Measurement& found);

// profile.csv with its covariance; profiles of a second species, from covered area and by phase where there are some.
void write_profiles(RunContext& context, const ingest::Measurement& found);

// Disks found and places rejected, frame by frame: missing and doubled beads show as dips and spikes.
std::string count_figure(const std::vector<ingest::FrameReport>& frames);

// The frames of a film and how they are read.
struct FilmFiles {
  std::vector<std::string> paths;
  ingest::FrameSourceOptions source;
  // The factor, at most that of the search, by which frames are reduced when they are only looked at.
  [[nodiscard]] int reduction_shown(double wanted) const;
};

// The frames kept with the disks found, and of the first of them what the model leaves.
void draw_overlays(RunContext& context, const FilmFiles& film, const ingest::Measurement& found,
                   const DisksOnTheWay& on_the_way);

}  // namespace shakebed::pipelines
