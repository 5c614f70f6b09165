#include "pipelines/stages/extract_results.hpp"

#include "pipelines/stages/bed_results.hpp"

namespace shakebed::pipelines {
namespace {

void state_frames(ResultList& list, const ExtractOptions& options) {
  list.number("/frames", "1", "frames read");
  list.number("/frames_used", "1", "frames in which disks were found");
  list.quantity("/disks_per_frame", "1", "disks found in a frame");
  list.number("/disks_per_frame_scatter", "1", "standard deviation of that number");
  list.number("/bead_number", "1", "beads that there are, as given",
              given_if(options.bead_number.has_value(), "\"bead_number\" is given"));
  list.number("/cut_disks", "1", "disks cut by the edge of the frame");
  list.number("/half_hidden_disks", "1", "disks partly covered by others");
  list.number("/quality/lowest_percent", "1", "quality below which 1 % of the disks lie");
  list.number("/quality/median", "1", "median quality of the disks");
  const Given rendered = given_when("the frames were rendered and the true centres are known");
  list.number("/truth/recall", "1", "share of the true disks that were found", rendered);
  list.number("/truth/precision", "1", "share of the disks found that are true", rendered);
  list.quantity("/truth/center_rms_error", "px", "rms error of the centres", rendered);
}

void state_calibration(ResultList& list) {
  list.quantity("/diameter", "m", "diameter of a bead, as given");
  list.quantity("/scale", "m/px", "length of a pixel");
  list.truth("/scale_given", "whether the scale was given");
  list.quantity("/pixel_aspect", "1", "width of a pixel over its height");
  list.quantity("/lens", "1", "distortion of the lens");
  list.quantity("/radius", "px", "radius of a bead");
  list.quantity("/edge_width", "px", "width of a bead's edge");
  list.quantity("/noise", "grey levels", "noise of a pixel");
  list.quantity("/contrast", "grey levels", "contrast of a bead");
  list.quantity("/flicker", "1", "relative change of the light from frame to frame");
  list.text("/polarity", "whether the beads are bright or dark");
  list.quantity("/floor", "px", "row of the floor");
  list.truth("/floor_given", "whether the floor was given");
  list.quantity("/floor_tilt", "deg", "tilt of the floor");
  list.quantity("/left_wall", "px", "column of the left wall");
  list.quantity("/right_wall", "px", "column of the right wall");
  list.truth("/walls_given", "whether the walls were given");
  list.truth("/walls_are_frame_sides", "whether the walls are the frame's sides");
  list.quantity("/width", "D", "distance of the walls");
}

void state_shaking(ResultList& list) {
  const Given shaking = given_when("shaking is seen or its frequency is given");
  list.quantity("/frequency", "Hz", "frequency of the shaking", shaking);
  list.truth("/frequency_given", "whether the frequency was given", shaking);
  list.number("/frequency_false_alarm", "1", "chance that the frequency is one of the noise",
              both(shaking, given_when("the frequency was found")), true);
  list.quantity("/floor_amplitude", "m", "amplitude of the floor", shaking);
  list.number("/floor_phase", "1", "phase of the floor in the first frame", shaking, true);
}

void state_velocities(ResultList& list, const ExtractOptions& options) {
  const Given timed = given_if(options.frame_rate.has_value(), "\"frame_rate\" is given");
  for (const char* axis : {"temperature_x_over_mg", "temperature_z_over_mg"}) {
    const std::string pointer = std::string("/velocities/") + axis;
    list.quantity(pointer, "m", "kinetic temperature as T/(m g)", timed, true);
    list.number(pointer + "/localisation_bias", "m", "part of it that comes from errors of the centres", timed, true);
    list.number(pointer + "/finite_time_factor", "1", "correction for the time between frames", timed, true);
  }
  list.number("/velocities/linked_share", "1", "share of the disks found again in the next frame", timed, true);
  list.quantity("/velocities/mean_step", "D", "mean way between two frames", timed, true);
}

void state_density(ResultList& list, const ExtractOptions& options) {
  list.quantity("/column_number", "1", "disks a diameter of width: N D/W");
  list.text("/kernel/kind", "the window through which density was measured");
  list.number("/kernel/width", "D", "its width");
  list.quantity("/profile/greatest_density", "1/D^2", "greatest density of the profile");
  list.number("/profile/frames", "1", "frames of the profile");
  list.number("/profile/memory_frames", "1", "correlation time of the profile in frames", {}, true);
  list.number("/profile/window_frames", "1", "frames over which correlations were summed", {}, true);
  list.number("/profile/independent_samples", "1", "independent samples of the profile", {}, true);
  list.quantity("/coverage_disagreement", "1/D^2", "difference from the profile by covered area",
                given_when("the covered area could be measured"));
  const Given second = given_if(options.second_diameter.has_value(), "\"second_diameter\" is given");
  const Given found = both(second, given_when("beads of the second diameter are found"));
  list.quantity("/second_species/radius", "px", "radius of the second species", found);
  list.number("/second_species/disks_per_frame", "1", "disks of the second species in a frame", found);
}

void state_tables(ResultList& list, const ExtractOptions& options) {
  list.table({"profile.csv", "density profile above the floor's mean position", profile_columns()});
  list.table({"second_profile.csv", "density profile of the second species", profile_columns(),
              given_if(options.second_diameter.has_value(), "\"second_diameter\" is given")});
  list.table({"coverage_profile.csv", "density profile by covered area", profile_columns(),
              given_when("the covered area could be measured")});
  list.table({"profile_phase_*.csv", "density profile at a phase of the floor", profile_columns(),
              given_when("the phase of the frames is known")});
  list.table({"covariance.csv", "covariance of the densities of profile.csv", covariance_columns()});
  const StatedColumn frame{"frame", "1", "number of the frame"}, x{"x_px", "px", "column of the centre"},
      y{"y_px", "px", "row of the centre"};
  list.table({"disks.csv",
              "the disks found",
              {frame,
               x,
               y,
               {"radius_px", "px", "radius"},
               {"x", "D", "distance from the left wall"},
               {"z", "D", "height above the floor's mean position"},
               {"quality", "1", "1 for a bead like all the others"}}});
  list.table({"disk_details.csv",
              "more about the disks found",
              {frame,
               x,
               y,
               {"std_error_x_px", "px", "standard error of the column"},
               {"std_error_y_px", "px", "standard error of the row"},
               {"correlation", "1", "correlation of the two"},
               {"contrast", "1", "contrast of the bead over that of all"},
               {"cut", "1", "1 at the frame's edge"},
               {"half_hidden", "1", "1 when partly covered"},
               {"species", "1", "1 or 2"}}});
  list.table({"frames.csv",
              "the frames read",
              {frame,
               {"image", "", "file that holds the frame"},
               {"page", "1", "page of the file"},
               {"status", "", "whether it was used"},
               {"disks", "1", "disks found"},
               {"second", "1", "disks of the second species"},
               {"rejected", "1", "places rejected"},
               {"residual_level_grey_levels", "grey levels", "rms difference of the frame and its model"},
               {"contrast_gain", "1", "light of the frame over that of the first"}}});
  list.table({"quality.csv",
              "number of disks by quality",
              {{"from", "1", "lower bound"}, {"to", "1", "upper bound"}, {"disks", "1", "disks"}}});
  list.table({"bead.csv",
              "the bead as learned from the frames",
              {{"radius_px", "px", "distance from the centre"},
               {"contrast", "1", "level: 1 inside, 0 outside"},
               {"fourth_harmonic", "1", "fourth harmonic of the rim"}}});
}

}  // namespace

void state_extract_results(ResultList& list, const ExtractOptions& options) {
  state_frames(list, options);
  state_calibration(list);
  state_shaking(list);
  state_velocities(list, options);
  state_density(list, options);
  state_tables(list, options);
}

}  // namespace shakebed::pipelines
