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
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/find/survey.hpp"
#include "ingest/frames/frames.hpp"
#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

class CandidatePictures;  // candidate_picture.hpp

enum class PixelType { u8, u16, f32, f64 };

// A view of a grey image that the caller owns: row by row, levels of 0 .. 255 (u8, floating point) or 0 .. 65535 (u16).
struct ImageView {
  int width = 0, height = 0;
  const void* pixels = nullptr;
  PixelType type = PixelType::u8;
  std::size_t row_bytes = 0;  // from one row to the next; 0: rows follow one another
};
// Its levels scaled to 0 .. 255, in floating point as the finder needs them. Throws std::invalid_argument for an empty
// image and for levels that are not finite.
GrayFrame frame_of(const ImageView& image);

enum class FindStatus {
  ok,
  no_beads,   // nothing that is a bead by the survey, or by the finder
  doubtful,   // too many of the disks found may be wrong, or too many beads missed (doubt_of())
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
// Does not throw for what is wrong with the image or the options: see the status.
DisksFound find_disks(const ImageView& image, const FindOptions& options = {});

// The first picture that can be read, surveyed. Beads that are too small once it is reduced to six million pixels are
// too small for rims.
struct FirstLook {
  std::string path;
  int width = 0, height = 0;  // of the picture itself
  Survey survey;
  std::shared_ptr<const CandidatePictures> picture;  // to draw candidates into; none where one channel was asked for
  std::size_t page = 0;                              // of a file with several pictures
  // A pixel's width over its height, as assumed. The columns were made as many times as wide. So width, radii and
  // places are those of the picture with square pixels. Regions are those of the picture as recorded.
  double pixel_aspect = 1;
};
// What is searched for after a survey, for SurveyOptions::search. None where scale, second diameter or lens are given:
// the search then differs from a survey's trial.
std::optional<FindOptions> search_after_survey(const MeasureOptions& measure);
// The first `most_tried` of `pictures` are tried; nothing when none of them can be read.
inline constexpr std::size_t most_tried = 10;
std::optional<FirstLook> look_at_first(const std::vector<FrameOrigin>& pictures, const SurveyOptions& options,
                                       const FrameSourceOptions& source = {}, double pixel_aspect = 1);
// A survey of the picture with square pixels, which `frames` hold afterwards. Regions, asked for and found, are those
// of the picture as recorded.
Survey survey_with_square_pixels(ChannelFrames& frames, SurveyOptions options, double pixel_aspect);

// The pixel_aspect of a look in which beads were found, corrected by how oval their outlines still are. Nothing where
// they cannot be measured.
std::optional<double> aspect_by_outlines(const FirstLook& look);

// What a survey saw becomes what is searched for, and where.
void look_for(const SurveyCandidate& best, FindOptions& find);

// Why a length of a pixel cannot be that of a picture with circles of this radius; empty when it can. Within a factor
// of three the circles may be the bright middle of beads, or hold their shadow, and the scale is believed.
std::string why_not_scale(double bead_diameter_m, double scale_m_per_px, double radius_px);

// Says that only a part of a picture was searched, since the rest shows something else.
// `recorded_px`: px of the original picture that one px of the rectangle stands for.
std::string why_only_a_part(const PixelRectangle& part, double recorded_px = 1);

// px: the smallest radius of beads in reduced frames. In 48 rendered frames of 300 beads (radius 20 and 40 px) T was
// the same within 0.03 % down to 3.3 px. Its error was there 1.4 times as large.
constexpr double least_reduced_radius_px = 3;
// By which factor frames of this size may be averaged (FrameSourceOptions::reduction). Large beads need not be seen by
// every pixel: a radius of 12 to 24 px is enough. One of 9 px is enough where the frame would still have more than six
// million pixels. Where beads are found by their rims alone it is 24 to 48 px. 1 below two million pixels. Frames of
// more pixels than are held in memory (FrameSourceOptions::largest_frame_pixels) are always reduced.
int reduction_for(int width, int height, double radius_px, bool by_rims = false);
// The same for the beads of a survey: the reduction at which they have been searched, if they have.
int reduction_after(const FirstLook& look, const SurveyCandidate& chosen);
// The sentence that says so for the latter; empty for smaller frames.
std::string why_reduced(int width, int height, int reduction);

// What the share of disks that may be wrong means for a measurement: `some` above 2 %, worth a warning; `too_many`
// above 20 %, nothing is measured.
enum class Doubt { little, some, too_many };
Doubt doubt_of(double expected_wrong);
// The same of the share of beads that may be missed: `some` above 2 %, `too_many` above 40 %. With wrong disks as well
// it is fewer: the harmonic mean of the shares that are right counts. Disks that are found hold all the same, and the
// share is known less well.
Doubt doubt_of_missed(double expected_missed, double expected_wrong = 0);

struct BedFound {
  FindStatus status = FindStatus::bad_input;
  std::string message;  // one sentence, unless ok
  Measurement measurement;
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
// Images in memory, all of one size. They are read where they lie, one by one: no second copy of the film is made.
BedFound measure_bed(const std::vector<ImageView>& images, const MeasureOptions& options);

}  // namespace shakebed::ingest
