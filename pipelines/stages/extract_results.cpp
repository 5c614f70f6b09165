#include "pipelines/stages/extract_results.hpp"

#include "pipelines/stages/bed_results.hpp"

namespace shakebed::pipelines {
namespace {

// What heights are above, in the descriptions of tables.
constexpr const char* floor_of_heights = "the floor (/floor_reference states which position of it)";

void state_frames(ResultList& list, const ExtractOptions& options) {
  list.number("/frames", "1", "number of frames read");
  list.number("/frames_used", "1", "number of frames in which disks were found");
  list.quantity("/disks_per_frame", "1", "mean number of disks found per frame");
  list.number("/disks_per_frame_scatter", "1", "standard deviation of the number of disks between frames");
  list.number("/bead_number", "1", "number of beads in view, as given in the option",
              given_if(options.bead_number.has_value(), "\"bead_number\" is given"));
  list.number("/reduction", "px", "side of the squares of pixels over which the frames were averaged");
  list.number("/cut_disks", "1", "number of disks cut by the edge of the frame");
  list.number("/half_hidden_disks", "1", "number of disks partly covered by others");
  list.number("/quality/lowest_percent", "1", "quality below which 1 % of the disks lie");
  list.number("/quality/median", "1", "median quality of the disks");
  const Given surveyed = given_when("the frames are photographs and the beads' rims were examined");
  list.number("/expected_wrong", "1", "expected share of the disks found that are not beads, from their rims",
              surveyed);
  list.number("/expected_missed", "1",
              "expected share of beads that are missed in the first frames: beads that are hard to see, and places "
              "with edges where a bead fits",
              surveyed);
  const Given against = given_when("there are reasons against a temperature from the frames");
  list.text("/objections/#/why", "reason against a temperature from the frames", against);
  list.text("/objections/#/advice", "advice: what to do about this reason", against);
  const Given rendered = given_when("the frames were rendered and the true centres are known");
  list.number("/truth/recall", "1", "share of the true disks that were found", rendered);
  list.number("/truth/precision", "1", "share of the disks found that are true", rendered);
  list.quantity("/truth/center_rms_error", "px", "rms error of the centres", rendered);
}

void state_calibration(ResultList& list) {
  list.quantity("/diameter", "m", "diameter of a bead, as given");
  list.quantity("/scale", "m/px", "length of a pixel");
  list.truth("/scale_given", "whether the scale was given");
  list.quantity("/pixel_aspect", "1", "ratio of the width of a pixel to its height");
  list.quantity(
      "/lens", "1",
      "distortion of the lens: true outward shift of the corners of the frame, in half diagonals (barrel: positive)");
  list.quantity("/radius", "px", "radius of a bead");
  list.quantity("/edge_width", "px", "width of a bead's edge");
  list.quantity("/noise", "grey levels", "noise of a pixel");
  list.quantity("/contrast", "grey levels", "contrast of a bead");
  list.quantity(
      "/flicker", "1",
      "relative standard deviation of the beads' contrast between frames; it shows how much the light varies");
  list.text("/polarity", "whether the beads are bright or dark");
  list.quantity(
      "/floor", "px",
      "row of the floor at the left edge of the frame; its standard error is that of the mean position of the floor");
  list.text("/floor_reference",
            "position of the floor from which heights are measured: given; mean of its motion (in a film); mean by its "
            "amplitude (given); lowest seen");
  list.truth("/shaken", "whether the floor moves: known, or concluded from the motion of the lowest beads");
  list.truth("/floor_given", "whether the floor was given");
  list.quantity("/floor_tilt", "deg", "tilt of the floor");
  list.quantity("/left_wall", "px", "column of the left wall");
  list.quantity("/right_wall", "px", "column of the right wall");
  list.truth("/walls_given", "whether the walls were given");
  list.truth("/walls_are_frame_sides", "whether the sides of the frame are used as walls");
  list.quantity("/width", "D", "distance of the walls");
}

void state_shaking(ResultList& list) {
  const Given shaking = given_when("the shaking is seen in the film or its frequency is given");
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
                  "kinetic temperature as T/(m g), without the mean motion at each height in each frame (as "
                  "temperature_*_without_flow of a simulation)",
                  timed, true);
    list.number(pointer + "/localisation_bias", "m", "part of the temperature that comes from errors of the centres",
                timed, true);
    list.number(pointer + "/finite_time_factor", "1",
                "factor that corrects the temperature for the finite time between frames", timed, true);
  }
  for (const char* axis : {"x", "z"})
    list.quantity(std::string("/velocities/temperature_") + axis + "_of_displacements_over_mg", "m",
                  "the same from the displacements between frames, without the correction for the time between them",
                  timed, true);
  list.quantity("/velocities/frame_rate", "Hz",
                "rate of the frames between which disks are followed: \"frame_rate\" over \"stride\"", timed, true);
  list.truth("/velocities/usable",
             "whether the velocities are reliable: enough disks were followed, and few collided between frames", timed,
             true);
  list.number("/velocities/linked_share", "1", "share of the disks found again in the next frame", timed, true);
  list.quantity("/velocities/mean_step", "D", "mean displacement of a disk between two frames", timed, true);
}

void state_density(ResultList& list, const ExtractOptions& options) {
  list.quantity("/column_number", "1", "column number N D/W: disks per diameter of width",
                given_when("the upper border of the frame cuts no beads"));
  list.text("/kernel/kind", "kind of the kernel through which the density was measured");
  list.number("/kernel/width", "D", "width of the kernel");
  list.quantity("/profile/greatest_density", "1/D^2", "greatest density of the profile");
  list.number("/profile/frames", "1", "number of frames in the profile");
  list.number("/profile/memory_frames", "1", "correlation time of the profile in frames", {}, true);
  list.number("/profile/window_frames", "1", "number of frames over which correlations were summed", {}, true);
  list.number("/profile/independent_samples", "1", "number of independent samples in the profile", {}, true);
  list.quantity("/coverage_disagreement", "1/D^2",
                "rms difference between the density from centres and the density from covered area",
                given_when("the covered area could be measured"));
  const Given second = given_if(options.second_diameter.has_value(), "\"second_diameter\" is given");
  const Given found = both(second, given_when("beads of the second diameter are found"));
  list.quantity("/second_species/radius", "px", "radius of the second species", found);
  list.number("/second_species/disks_per_frame", "1", "mean number of disks of the second species per frame", found);
}

void state_tables(ResultList& list, const ExtractOptions& options) {
  list.table({"profile.csv", "density profile", profile_columns(floor_of_heights)});
  list.table({"second_profile.csv", "density profile of the second species", profile_columns(floor_of_heights),
              given_if(options.second_diameter.has_value(), "\"second_diameter\" is given")});
  list.table({"coverage_profile.csv", "density profile from the covered area", profile_columns(floor_of_heights),
              given_when("the covered area could be measured")});
  list.table({"profile_phase_*.csv", "density profile at one phase of the floor's motion",
              profile_columns(floor_of_heights), given_when("the phase of the frames is known")});
  list.table({"covariance.csv", "covariance of the densities of profile.csv", covariance_columns()});
  const std::vector<StatedColumn> place{
      {"frame", "1", "number of the frame, from 0"},
      {"x_px", "px", "position of the centre, counted from the centre of the top-left pixel to the right"},
      {"y_px", "px", "position of the centre, counted from the centre of the top-left pixel downwards"}};
  std::vector<StatedColumn> disks = place, details = place;
  disks.insert(
      disks.end(),
      {{"radius_px", "px", "radius of the disk"},
       {"x", "D", "distance of the centre from the left wall"},
       {"z", "D", "height of the centre above the floor (/floor_reference states which position of it)"},
       {"quality", "1", "quality of the disk: 1 if it looks like all the other beads, 0 if it is not a bead"}});
  details.insert(details.end(),
                 {{"std_error_x_px", "px", "standard error of x_px"},
                  {"std_error_y_px", "px", "standard error of y_px"},
                  {"correlation", "1", "correlation of the errors of x_px and y_px"},
                  {"contrast", "1", "contrast relative to that of the mean bead"},
                  {"cut", "1", "1 if the border of the frame cuts the bead, else 0"},
                  {"half_hidden", "1", "1 if part of the bead is covered, else 0"},
                  {"species", "1", "kind of the bead: 1 for the first diameter, 2 for the second"},
                  {"probability", "1", "probability that the disk is a bead; 1 if its rim was not examined"}});
  list.table({"disks.csv", "disks found in each frame", disks});
  list.table({"disk_details.csv", "errors and properties of the disks found, in the row order of disks.csv", details});
  list.table({"frames.csv",
              "what was found in each frame",
              {{"frame", "1", "number of the frame, from 0"},
               {"image", "", "file that contains the frame"},
               {"page", "1", "page of the file or frame of the film, from 0"},
               {"status", "", "state of the frame: good, nothing_found, unreadable or size_changed"},
               {"disks", "1", "number of disks found"},
               {"second", "1", "number of disks found that have the second diameter"},
               {"rejected", "1", "number of candidates that were rejected"},
               {"residual_level_grey_levels", "grey levels", "rms difference of the frame and its model"},
               {"contrast_gain", "1", "contrast relative to that of all frames"}}});
  list.table({"quality.csv",
              "number of disks by quality (1: a bead that looks like all the others)",
              {{"from", "1", "lowest quality of the class"},
               {"to", "1", "highest quality of the class"},
               {"disks", "1", "number of disks in all frames"}}});
  list.table({"bead.csv",
              "mean bead, learned from the frames, against the distance from its centre",
              {{"radius_px", "px", "distance from the centre"},
               {"contrast", "1", "contrast of the mean bead: 1 inside a flat bead, 0 far outside"},
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
