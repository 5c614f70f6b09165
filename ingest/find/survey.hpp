#pragma once
// What a picture shows, before anything is measured: beads of which radius, polarity and channel, or none.
//
// Any number of threads may call; values own what they hold.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "ingest/find/find_disks.hpp"
#include "ingest/find/rim_finder.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// px, width from which blur does not make the outlines of touching beads look not round. Measured on drawn crystals
// with blur of up to 1.2 px and noise of up to 10 grey levels.
inline constexpr double wide_enough_px = 24;

// What was learned of a frame, for whoever searches the same frame in the same way.
class SearchedFrame {
 public:
  // `reduction`: of the frame.
  SearchedFrame(GrayFrame frame, int reduction, FindOptions options, CalibrationResult learned);
  [[nodiscard]] int reduction() const { return reduction_; }
  // What learn_beads() would find in this frame with these options; nothing where either differs. It can be asked for
  // once, and is released then.
  std::optional<CalibrationResult> take(const GrayFrame& frame, const FindOptions& options);

 private:
  GrayFrame frame_;
  int reduction_ = 1;
  FindOptions options_;
  std::optional<CalibrationResult> learned_;
};

struct SurveyCandidate {
  Channel channel = Channel::automatic;
  RimModel rims;               // px of the full frame
  std::vector<RimDisk> disks;  // px of the full frame
  double gain_px = 0;          // length of rims that beads explain, less a cost for each bead
  double explained_share = 0;  // of all edges at this scale
  double expected_wrong = 0;   // share of the disks
  bool by_rims = false;        // beads will be found by their rims alone, as far as a trial showed
  // A large picture, reduced, was searched for their faces in vain: all of it, or a part half filled with beads.
  bool no_faces = false;
  bool thorough = false;      // by rims: a thorough search showed more in a trial
  bool packed = false;        // disks that touch, found by their faces, describe the picture
  bool one_sided = false;     // one side of the rim is hardly seen in any: light from the other side
  bool not_round = false;     // circles are seen, but on outlines that are not round ...
  std::string why_not_round;  // ... a sentence
  std::string why_drawn;      // marks of a plot or a drawing, a sentence; empty: they may be beads
  bool credible = false;      // "no beads here" does not explain the picture as well
  std::string why_not;        // a sentence, unless credible
  bool few_edges = false;     // they may be beads, but other things make up the picture
  // The circles are no chance, so they may be beads of another shape, smaller than those that are believed unasked, or
  // lit from one side.
  bool plausible = false;
  // Where the rest of the picture shows something else, the part in which the beads are; px of the full frame.
  std::optional<PixelRectangle> region;
  // By their faces, where a trial searched all of the frame (SurveyOptions::search).
  std::shared_ptr<SearchedFrame> searched;
};

struct Survey {
  bool found = false;
  std::string why_not;                      // a sentence unless found
  std::vector<SurveyCandidate> candidates;  // best first
};

// Frames of more pixels may be reduced (reduction_for() in profile/photographs.hpp).
inline constexpr double large_frame_pixels = 2e6;

struct SurveyOptions {
  Polarity polarity = Polarity::automatic;
  std::optional<double> radius_px;  // px of the full frame
  std::optional<PixelRectangle> roi;
  bool any_shape = false;  // outlines that are not round, and marks of a drawing, may be beads
  // SurveyCandidate::by_rims is of no interest: it costs a trial of large pictures. Channels are compared in a small
  // part.
  bool channel_alone = false;
  // What will be searched for in the picture after the survey: then a trial is this search where it can be
  // (SurveyCandidate::searched). Lengths are px of the full frame, `seen` and `recorded_px` are those of the survey.
  std::optional<FindOptions> search{};
};

Survey take_survey(const ChannelFrames& frames, const SurveyOptions& options = {});

}  // namespace shakebed::ingest
