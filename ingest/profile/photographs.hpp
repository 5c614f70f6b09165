#pragma once
// Photographs of a bed in one call: what the beads are is found first (survey.hpp), then they are found and measured.
//
//   DisksFound found = find_disks(ImageView{.width = w, .height = h, .pixels = levels, .type = PixelType::u8});
//   BedFound bed = measure_bed({"photographs/"}, {.bead_diameter_m = 2.99e-3});
//
// Lengths in px in the pixel-centre convention (frames.hpp), or in D where it is said. Nothing is printed and no global
// state is kept; any number of threads may call. The results own all they hold; a view's pixels are read during the
// call only. Method: [ShattuckChiSquared] and find_disks.hpp.

#include <cstddef>
#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/frames/frames.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

enum class PixelType { u8, u16, f32, f64 };

// A grey image that somebody else holds: row by row, levels of 0 .. 255 (u8, floating point) or 0 .. 65535 (u16).
struct ImageView {
  int width = 0, height = 0;
  const void* pixels = nullptr;
  PixelType type = PixelType::u8;
  std::size_t row_bytes = 0;  // from one row to the next; 0: rows follow one another
};
// Its levels scaled to 0 .. 255. Throws std::invalid_argument for an empty image and for levels that are not finite.
GrayFrame frame_of(const ImageView& image);

enum class FindStatus {
  ok,
  no_beads,   // nothing that is a bead by the survey, or by the finder
  doubtful,   // more than a fifth of the disks found may be wrong
  bad_input,  // the image is empty, or the options make no sense
};
std::string_view to_string(FindStatus status);

struct DisksFound {
  FindStatus status = FindStatus::bad_input;
  std::string message;  // one sentence, unless ok
  std::vector<FoundDisk> disks;
  FinderCalibration calibration;
  double expected_wrong = 0;  // share of the disks that are no beads, by their probabilities
  [[nodiscard]] bool ok() const { return status == FindStatus::ok; }
  [[nodiscard]] std::string brief() const;  // one line
  [[nodiscard]] std::string full() const;   // a line a number, then the warnings
};
// Does not throw for what is wrong with the image: see the status.
DisksFound find_disks(const ImageView& image, const FindOptions& options = {});

// The kind of beads in a first frame that `options` does not contradict; options.seen, if given, is taken as it is.
struct FirstSurvey {
  bool found = false;
  std::string why_not;  // a sentence unless found
  Channel channel = Channel::automatic;
  BeadsSeen seen;
  int reduction = 1;  // by which frames of this size may be averaged: a radius of 12 to 24 px is enough
};
FirstSurvey survey_first(const ChannelFrames& first, const FindOptions& options);

// Why nothing can be measured with these options, one sentence each; empty when it can.
std::vector<std::string> validate(const MeasureOptions& options);

struct BedFound {
  FindStatus status = FindStatus::bad_input;
  std::string message;  // one sentence, unless ok
  Measurement measurement;
  double expected_wrong = 0;  // share of the disks that are no beads, by their probabilities
  [[nodiscard]] bool ok() const { return status == FindStatus::ok; }
  [[nodiscard]] std::string brief() const;
  [[nodiscard]] std::string full() const;
};
// The disks come back in measurement.disks unless options.disk_sink takes them. Floor and walls follow from the first
// options.geometry_frames frames, as in the stage `extract`.
// Files, folders, wildcards or one film, as FrameSource::open() takes them. Throws InputError where files cannot be
// read.
BedFound measure_bed(const std::vector<std::string>& paths, const MeasureOptions& options,
                     const FrameSourceOptions& source_options = {});
// Frames in memory, all of one size.
BedFound measure_bed(std::vector<GrayFrame> frames, const MeasureOptions& options);

}  // namespace shakebed::ingest
