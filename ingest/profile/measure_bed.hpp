#pragma once
// A film of a bed in, its density profile out.
//
// The result owns all it holds; the stream belongs to the caller and is at its end afterwards. Any number of threads
// may measure, each its own stream; `threads` more are used within.

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"
#include "ingest/profile/density.hpp"
#include "ingest/profile/lens.hpp"

namespace shakebed::ingest {

struct MeasuredDisk {
  std::size_t frame = 0;
  double x_px = 0, y_px = 0, radius_px = 0;
  double x = 0, z = 0;  // D, from the left wall and from the floor
  double quality = 0;
  double probability = 1;                                    // that it is a bead
  double std_error_px = 0;                                   // rms of the two below
  double variance_x = 0, variance_y = 0, covariance_xy = 0;  // px^2
  double contrast = 0;                                       // 1 for a typical bead
  bool cut = false, half_hidden = false;
  int species = 1;  // 2: of the second diameter; x and z are in D of the first all the same
};

enum class FrameStatus { good, nothing_found, unreadable, size_changed };
struct FrameReport {
  std::size_t index = 0;
  FrameOrigin origin;
  FrameStatus status = FrameStatus::good;
  std::string why;  // a sentence unless good
  std::size_t disks = 0;
  std::size_t second = 0;  // disks of the second species
  std::size_t rejected = 0;
  double residual_level = 0;  // grey levels
  FrameLight light;           // against the film's
};

// Only the diameter is needed; each other member overrides something that is otherwise found. Places are those of the
// recorded frame.
class SearchedFrame;  // survey.hpp

struct MeasureOptions {
  double bead_diameter_m = 0;              // required, > 0
  std::optional<double> scale_m_per_px{};  // else bead_diameter_m / (2 radius_px)
  std::optional<double> floor_px{};        // y_px of the floor's surface at the left edge of the frame
  std::optional<double> floor_slope{};     // px down per px right; 0 when floor_px is given without it
  // Of the shaken floor [m]. Where no film shows its motion, its mean is taken to be half of this above the lowest
  // position seen, with an error of the same size.
  std::optional<double> floor_amplitude_m{};
  std::optional<double> left_wall_px{};  // x_px of the walls' inner faces
  std::optional<double> right_wall_px{};
  // Beads of another size that are to be found too, filled like the first or in a shade of their own. They come with
  // the disks as species 2 and have a profile of their own; the first's is that of the first alone.
  std::optional<double> second_diameter_m{};
  // Found on the beads' rims unless given (1 and 0: taken for plain); scale_m_per_px is that of rows.
  std::optional<double> pixel_aspect{};
  std::optional<double> lens_radial{};
  // From which on the aspect is found: near the true one, where that is far from 1. Of a film, what it states if this
  // is 1.
  double first_pixel_aspect = 1;
  FindOptions find{};                            // polarity, radius, roi, ...
  std::shared_ptr<SearchedFrame> searched{};     // what a survey has learned of the first frame
  Kernel kernel = measuring_kernel;              // widths in D
  double bin_width = measuring_spacing;          // D
  std::optional<double> highest{};               // D; else just above the highest centre
  std::optional<double> lowest{};                // D; else 0
  std::optional<double> shaking_frequency_hz{};  // needs frame_rate_hz; found from the film if left out and it shakes
  std::optional<double> frame_rate_hz{};         // of the stream: then profiles by the phase of the shaking
  std::size_t phase_bins = 8;
  // The source's frames are reduced by this factor (FrameSourceOptions::reduction). All places and lengths, in and out,
  // are px of the frames as recorded.
  int reduction = 1;
  std::size_t calibration_frames = 3;                       // taken evenly from the first calibration_window frames
  bool profile_from_coverage = true;                        // also measure covered area, independently
  unsigned threads = 1;                                     // results do not depend on it
  std::function<void(std::size_t frames_done)> progress{};  // called from one thread at a time
  // Receives each frame's disks, frames in order, from one thread at a time; Measurement::disks then stays empty, so
  // that memory hardly grows with the film. Floor and walls, unless given, then follow from the first geometry_frames
  // frames of the film (rim_frames at least, which tell the radius) instead of from all.
  std::function<void(const FrameReport& frame, const std::vector<MeasuredDisk>& disks)> disk_sink{};
  std::size_t geometry_frames = 100;
  bool periodic_sides = false;  // beads stand out beyond the walls given: the covered area there counts, too

  // Why nothing can be measured with these options, one sentence each; empty when it can.
  [[nodiscard]] std::vector<std::string> validate() const;
};

// The position of the floor that heights are above: as given, or the mean of a motion that a film shows. Else the
// lowest position of the beads' bottoms, raised by half of the amplitude if that is given. The lowest is the mean only
// where the floor rests.
enum class FloorReference { given, mean_of_motion, mean_by_amplitude, lowest_seen };
std::string_view to_string(FloorReference reference);  // "given", "mean of its motion", "mean by its amplitude", ...

// Places are those of the true frame (see lens.hpp), which is the recorded one unless pixels or lens say otherwise.
struct BedCalibration {
  Lens lens;
  bool lens_given = false;                                 // both terms
  double aspect_std_error = 0, lens_radial_std_error = 0;  // of what was found
  double scale_m_per_px = 0;
  double scale_relative_std_error = 0;
  double radius_px = 0;
  double radius_std_error_px = 0;
  double edge_width_px = 0;
  double noise_level = 0;     // grey levels
  double contrast_level = 0;  // grey levels
  double flicker = 0;         // scatter of the frames' contrast
  Polarity polarity = Polarity::automatic;
  double floor_px = 0;  // at x_px = 0; heights are above it
  FloorReference floor_reference = FloorReference::lowest_seen;
  double floor_std_error_px = 0;            // of its mean position; 0 when given
  double floor_slope = 0;                   // px down per px right
  double floor_tilt_degrees = 0;            // 0 unless beyond its error
  double floor_tilt_std_error_degrees = 0;  // 0 when given
  // Of the shaking: given, or found in the motion of the lowest beads; 0 when neither. What is found is the slowest
  // shaking that looks so: f frame rates - this, f = 1, 2, ... or + this, would look the same.
  double shaking_frequency_hz = 0, shaking_frequency_std_error_hz = 0;
  bool frequency_given = false;
  double frequency_false_alarm = 0;  // of what was found
  std::string why_no_frequency;      // when a frame rate was given
  // The floor moves in the frame as floor_px - floor_amplitude_px sin(2 pi (t f + floor_phase)), t from the first
  // frame, upwards positive. Fitted when the shaking's frequency is known and the floor is not given; 0 when it
  // rests.
  double floor_amplitude_px = 0;
  double floor_amplitude_std_error_px = 0;
  double floor_phase = 0;  // turns, 0 .. 1
  double left_wall_px = 0, right_wall_px = 0;
  double width = 0;  // D, between the walls
  bool floor_given = false, walls_given = false, scale_given = false;
  bool scale_of_contacts = false;      // the scale given is that of beads that touch, not of the circles seen
  bool outline_in_doubt = false;       // beads lit from one side, and too few touch to show their diameter
  bool walls_are_frame_sides = false;  // no walls seen: the profile is that of the part of the bed in view
};

// Pairs of disks of the most frequent size that are nearer than 1.1 diameters: seen, and expected. The expected number
// follows from the pairs that are up to two diameters apart, for disks that keep no distance but a diameter.
struct Contacts {
  double seen = 0, expected = 0;
  double nearest_px = 0;               // the median over the disks of the distance to their nearest neighbour
  double touching_px = 0;              // where these distances begin (touching_distance.hpp), or their median
  [[nodiscard]] bool missing() const;  // so few that these are no touching beads
  [[nodiscard]] bool overlapping(double diameter_px) const;  // the outline seen is too large
  [[nodiscard]] bool far_apart(double diameter_px) const;    // so far that these are holes or marks
};
struct PhaseProfile {
  double phase = 0;  // middle of the phase bin, 0 .. 1
  DensityProfile profile;
};

struct Measurement {
  FinderCalibration finder;
  std::optional<FinderCalibration> second_finder;  // when a second species was asked for and seen
  std::optional<DensityProfile> second_profile;    // n D^2, D of the first
  BedCalibration calibration;
  std::vector<MeasuredDisk> disks;   // frame after frame; empty with a disk_sink
  std::size_t disk_total = 0;        // over all frames, with a disk_sink or without
  double expected_wrong = 0;         // share of these disks that are no beads, by their probabilities
  std::size_t most_frames_held = 0;  // frames whose disks were in memory at once, at most
  std::vector<FrameReport> frames;   // one a frame of the stream
  DensityProfile profile;            // from centres
  std::optional<DensityProfile>
      coverage_profile;              // from covered area; same bins; kernel disk_chord with the bin's top hat
  double coverage_disagreement = 0;  // rms in n D^2: centres, seen through the bead, minus coverage
  std::vector<PhaseProfile> phases;
  double disk_count_mean = 0;
  double disk_count_std = 0;       // scatter of the bead number from frame to frame
  double count_in_width_mean = 0;  // of the disks whose centres lie between the walls ...
  double count_in_width_std = 0;   // ... and its scatter
  // N D/W, where it is known.
  std::optional<double> column_number() const {
    return column_known ? std::optional(count_in_width_mean / calibration.width) : std::nullopt;
  }
  bool floor_out_of_view = false;    // the lower border cuts beads, and no floor was given
  bool surface_out_of_view = false;  // the upper border cuts beads, more than one a frame
  bool column_known = true;          // no more beads are above the upper border than the column number's error allows
  Contacts contacts;                 // in the frames that geometry is found from
  std::size_t beside_bed = 0;        // disks left out, a few beyond an empty stretch beside the bed
  PixelRectangle bed_region;         // what lies between them, px of the recorded frame
  // The picture above the mirror image of the bed in its floor, px of the recorded frame; nothing where none is seen.
  std::optional<PixelRectangle> above_mirror_image;
  double floor_sag = 0;               // D: the lowest disks lie on an arc of this height, none on a straight floor
  std::vector<std::string> warnings;  // plain sentences
};

// Frames could be read, but none of the first ones shows a disk.
class NoDisksError : public InputError {
 public:
  using InputError::InputError;
};

// Reads the stream once (its first frames twice). Throws std::invalid_argument for options that make no sense,
// InputError when no frame at all could be read, and NoDisksError when none shows a disk. Single bad frames are
// reported in `frames` instead.
Measurement measure_bed(FrameSource& source, const MeasureOptions& options);

// What the frames show against reading a temperature from their profile: why, and what to do; a sentence or more each.
struct Objection {
  std::string why, advice;
};
std::vector<Objection> objections_to(const Measurement& found);
// Whether the floor is known to move, or the lowest beads move so much that it must: the bed is shaken.
bool is_shaken(const Measurement& found);

// Rows of that table, to be written while frames come in: heads and lines end with a newline.
inline constexpr const char* disks_csv_head = "frame,x_px,y_px,radius_px,x,z,quality\n";
std::string disks_csv_rows(const std::vector<MeasuredDisk>& disks);
// What else is known of each disk: errors of its centre, contrast, flags.
inline constexpr const char* disk_details_csv_head =
    "frame,x_px,y_px,std_error_x_px,std_error_y_px,correlation,contrast,cut,half_hidden,species,probability\n";
std::string disk_details_csv_rows(const std::vector<MeasuredDisk>& disks);

// CSV: frame,x_px,y_px,radius_px,x,z,quality. Atomic.
void write_disks_csv(const std::filesystem::path& path, const Measurement& measurement,
                     const std::vector<std::string>& comments = {});

}  // namespace shakebed::ingest
