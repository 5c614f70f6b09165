#include "pipelines/stages/extract_results.hpp"

#include "pipelines/stages/bed_results.hpp"

namespace shakebed::pipelines {
namespace {

// What heights are above, in the descriptions of tables.
constexpr const char* floor_of_heights = "the floor (/floor_reference: which position of it)";

void state_frames(ResultList& list, const ExtractOptions& options) {
  list.number("/frames", "1", "number of frames read");
  list.number("/frames_used", "1", "number of frames in which disks were found");
  list.quantity("/disks_per_frame", "1", "mean number of disks found per frame");
  list.number("/disks_per_frame_scatter", "1", "standard deviation of that number between frames");
  list.number("/bead_number", "1", "number of beads in view, as given in the option",
              given_if(options.bead_number.has_value(), "\"bead_number\" is given"));
  list.number("/cut_disks", "1", "disks cut by the edge of the frame");
  list.number("/half_hidden_disks", "1", "disks partly covered by others");
  list.number("/quality/lowest_percent", "1", "quality below which 1 % of the disks lie");
  list.number("/quality/median", "1", "median quality of the disks");
  const Given surveyed = given_when("the frames are photographs and the beads' rims were examined");
  list.number("/expected_wrong", "1", "expected share of found disks that are no beads, from their rims", surveyed);
  list.number(
      "/expected_missed", "1",
      "expected share of beads that are not reported, in the first frames: beads seen too poorly, and places that "
      "edges fill",
      surveyed);
  const Given against = given_when("there are reasons against a temperature from the frames");
  list.text("/objections/#/why", "reason against a temperature from the frames", against);
  list.text("/objections/#/advice", "what to do", against);
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
  list.quantity("/floor", "px",
                "row of the floor at the left edge of the frame; its error is that of the mean position");
  list.text("/floor_reference",
            "position of the floor that heights are above: given; mean of its motion (in a film); mean by its "
            "amplitude (given); "
            "lowest seen");
  list.truth("/shaken", "whether the floor is known to move, or the lowest beads move so much that it must");
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
  list.number("/frequency_false_alarm", "1", "probability that noise alone gives such a frequency",
              both(shaking, given_when("the frequency was found")), true);
  list.quantity("/floor_amplitude", "m", "amplitude of the floor", shaking);
  list.number("/floor_phase", "1", "phase of the floor in the first frame", shaking, true);
}

void state_velocities(ResultList& list, const ExtractOptions& options) {
  const Given timed = given_if(options.frame_rate.has_value(), "\"frame_rate\" is given");
  for (const char* axis : {"temperature_x_over_mg", "temperature_z_over_mg"}) {
    const std::string pointer = std::string("/velocities/") + axis;
    list.quantity(pointer, "m",
                  "kinetic temperature as T/(m g), the mean motion of each height in each frame taken off (as "
                  "temperature_*_local of a simulation)",
                  timed, true);
    list.number(pointer + "/localisation_bias", "m", "part of the temperature that comes from errors of the centres",
                timed, true);
    list.number(pointer + "/finite_time_factor", "1", "correction for the time between frames", timed, true);
  }
  list.truth("/velocities/usable", "whether enough disks were followed, and hardly collided between frames, for a temperature", timed, true);
  list.number("/velocities/linked_share", "1", "share of the disks found again in the next frame", timed, true);
  list.quantity("/velocities/mean_step", "D", "mean displacement of a disk between two frames", timed, true);
}

void state_density(ResultList& list, const ExtractOptions& options) {
  list.quantity("/column_number", "1", "column number N D/W: disks per diameter of width",
                given_when("the upper border of the frame cuts no beads"));
  list.text("/kernel/kind", "kernel through which the density was measured");
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
  list.table({"profile.csv", "density profile", profile_columns(floor_of_heights)});
  list.table({"second_profile.csv", "density profile of the second species", profile_columns(floor_of_heights),
              given_if(options.second_diameter.has_value(), "\"second_diameter\" is given")});
  list.table({"coverage_profile.csv", "density profile by covered area", profile_columns(floor_of_heights),
              given_when("the covered area could be measured")});
  list.table({"profile_phase_*.csv", "density profile at a phase of the floor", profile_columns(floor_of_heights),
              given_when("the phase of the frames is known")});
  list.table({"covariance.csv", "covariance of the densities of profile.csv", covariance_columns()});
  const std::vector<StatedColumn> place{{"frame", "1", "number of the frame, from 0"},
                                        {"x_px", "px", "centre, from the centre of the top-left pixel to the right"},
                                        {"y_px", "px", "centre, from the centre of the top-left pixel downwards"}};
  std::vector<StatedColumn> disks = place, details = place;
  disks.insert(disks.end(),
               {{"radius_px", "px", "radius"},
                {"x", "D", "centre, from the left wall"},
                {"z", "D", "height of the centre above the floor (/floor_reference: which position of it)"},
                {"quality", "1", "1 is a bead that looks like all the others, 0 is none"}});
  details.insert(details.end(),
                 {{"std_error_x_px", "px", "standard error of x_px"},
                  {"std_error_y_px", "px", "standard error of y_px"},
                  {"correlation", "1", "correlation of the two errors"},
                  {"contrast", "1", "contrast relative to that of the mean bead"},
                  {"cut", "1", "1 where the border of the frame cuts the bead"},
                  {"half_hidden", "1", "1 where something covers part of the bead"},
                  {"species", "1", "1: the first diameter, 2: the second"},
                  {"probability", "1", "probability that it is a bead; 1 where the rim was not examined"}});
  list.table({"disks.csv", "disks found in each frame", disks});
  list.table({"disk_details.csv", "errors and marks of the disks found, row by row as in disks.csv", details});
  list.table({"frames.csv",
              "what was found in each frame",
              {{"frame", "1", "number of the frame, from 0"},
               {"image", "", "file that holds the frame"},
               {"page", "1", "page of the file or frame of the film, from 0"},
               {"status", "", "good, nothing_found, unreadable or size_changed"},
               {"disks", "1", "disks found"},
               {"second", "1", "disks of the second diameter among them"},
               {"rejected", "1", "candidates that were rejected"},
               {"residual_level_grey_levels", "grey levels", "rms difference of the frame and its model"},
               {"contrast_gain", "1", "contrast relative to that of all frames"}}});
  list.table({"quality.csv",
              "number of disks by quality; 1 is a bead that looks like all the others",
              {{"from", "1", "lowest quality of the class"},
               {"to", "1", "highest quality of the class"},
               {"disks", "1", "disks in all frames"}}});
  list.table({"bead.csv",
              "the bead as learned from the frames, by distance from its centre",
              {{"radius_px", "px", "distance from the centre"},
               {"contrast", "1", "1 inside a flat bead, 0 far outside"},
               {"fourth_harmonic", "1", "amplitude of the dependence on direction with four-fold symmetry"}}});
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
