#pragma once
// A survey's candidates drawn into the picture they were seen in.

#include <filesystem>

#include "ingest/find/survey.hpp"

namespace shakebed::ingest {

// Writes a PNG of picture number `page` of `source` in its own colours, at most `most_px` wide and high. Magenta
// circles: beads of probability 0.9 or more. Yellow circles: the others. Atomic. Throws InputError, OutputError.
void write_candidate_picture(const std::filesystem::path& path, const std::filesystem::path& source, std::size_t page,
                             const SurveyCandidate* candidate, int most_px = 1400);

}  // namespace shakebed::ingest
