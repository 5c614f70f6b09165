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

// The first readable picture of `paths`, surveyed as the options ask.
using ingest::FirstLook;
std::optional<FirstLook> look_at_first(const std::vector<std::string>& paths, const ExtractOptions& options);

// preview.html and preview_1.png .. preview_3.png in `folder`. `files` are those of the command line. The commands
// shown repeat what the options give.
void write_preview(const std::filesystem::path& folder, const FirstLook& look, const std::vector<std::string>& files,
                   const ExtractOptions& options);

// What is seen where radius, polarity and channel are not given, a sentence; empty where none of them is given, or
// nothing is seen either.
std::string seen_without_options(const std::vector<std::string>& paths, ExtractOptions options);

// The options that take this candidate: --channel red --polarity dark --radius 22.9
std::string options_for(const ingest::SurveyCandidate& candidate);
// Those of the plausible candidates that differ, at most two.
std::vector<std::string> proposed_options(const ingest::Survey& survey);

}  // namespace shakebed::pipelines
