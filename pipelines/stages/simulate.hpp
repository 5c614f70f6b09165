// simulate: a scene → trajectory, profile, observables, by event-driven simulation.
//
// Files, always:
//   observables.json        numbers of the bed as a whole
//   bed.json                a BedDescription (see bed.hpp: what render, fit and map need to know of the bed)
//   profile.csv             density by height, with covariance.csv; profile_floor_frame.csv above the moving floor
//   layers.csv              temperatures by height
//   final.extxyz            the last state: what a simulate stage that names this one in "from" begins with
// With frames: trajectory.extxyz[.zst], profile_frames.csv. With "schedule": schedule.csv. With replicas: replicas.csv.
// With "observe":
//   order         psi6_local, psi6_global, neighbours_per_disk, vacancies; bottom_density of the three lowest rows.
//                 The part crystal_share_70, _80, _90 of the disks is in layers of 1 D with a mean |psi_6| of at least
//                 0.7, 0.8, 0.9. Files: order.csv by height, rows.csv row by row
//   velocities    a2, a2_local; velocities.csv by height, velocity_histogram.csv
//   displacement  displacement.csv: mean square displacement against time
//   pressure      floor_pressure; pressure.csv by height. All columns are exact averages over time along the
//                 trajectories; everything else is averaged over looks
//   phases        phases.csv, phases_floor_frame.csv: density, mean velocities, temperatures by phase and height
#pragma once

#include "pipelines/stages/stage.hpp"

namespace shakebed::pipelines {

StagePages simulate_pages();  // simulate_report.cpp

}  // namespace shakebed::pipelines
