// A first look at photographs or a film: which beads are seen, drawn and with the command for each alternative. Part of
// the images module.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ingest/profile/photographs.hpp"
#include "pipelines/stages/images_module.hpp"

namespace shakebed::pipelines {

inline ingest::Polarity polarity_of(BeadPolarity polarity) {
  return polarity == BeadPolarity::dark     ? ingest::Polarity::dark_beads
         : polarity == BeadPolarity::bright ? ingest::Polarity::bright_beads
                                            : ingest::Polarity::automatic;
}
// BeadChannel lists ingest's channels in their order, `automatic` first.
inline ingest::Channel channel_of(BeadChannel channel) {
  return static_cast<ingest::Channel>(static_cast<int>(channel) - 1);
}

// What the options ask of a survey.
ingest::SurveyOptions survey_asked_for(const ExtractOptions& options);

// The first frames, at most as many as a first look tries; the first file where no frame of it can be read. Throws
// StageError where `skip` leaves none.
std::vector<ingest::FrameOrigin> first_pictures(const std::vector<std::string>& files,
                                                const ingest::FrameSourceOptions& source);

// The first readable one of the pictures, surveyed as the options ask. What only a run needs to know takes time.
// `search`: the search of these pictures follows, and may begin with what the survey learns. `pixel_aspect`: a pixel's
// width over its height where the options do not give it; else what a film states.
using ingest::FirstLook;
enum class LookFor { run, search, preview };
std::optional<FirstLook> look_at_first(const std::vector<ingest::FrameOrigin>& pictures, const ExtractOptions& options,
                                       LookFor purpose = LookFor::run, std::optional<double> pixel_aspect = {});

// A change of the options with which the picture was measured, and not refused (proposals.hpp).
struct Proposal {
  std::vector<std::string> leave_out;  // options as on the command line: --radius
  std::string give;                    // --polarity dark --radius 9.87; may be empty
  std::string when;                    // condition of it, " where neighbouring beads touch"; may be empty
  std::string seen;                    // "63 dark beads of 9.9 px radius"
  ExtractOptions options;              // all that were tried
  ingest::SurveyCandidate found;       // the disks, to be drawn into the picture of the first look
  double bead_aspect = 1;              // width over height of a bead in that picture
};

// preview.html and preview_1.png .. preview_3.png in `folder`. `files` are those of the command line. The commands
// shown repeat what the options give. Of a picture that is refused, only the commands of the proposals are shown.
void write_preview(const std::filesystem::path& folder, const FirstLook& look, const std::vector<std::string>& files,
                   const ExtractOptions& options, const std::vector<Proposal>& proposals = {});

// The options that take this candidate: --channel red --polarity dark --radius 22.9
std::string options_for(const ingest::SurveyCandidate& candidate);
void take_candidate(const ingest::SurveyCandidate& candidate, ExtractOptions& options);
// Those that look for different beads, the best first, at most three.
std::vector<const ingest::SurveyCandidate*> different_candidates(const ingest::Survey& survey);

}  // namespace shakebed::pipelines
