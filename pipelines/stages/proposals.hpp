// Options that lead to beads where a run refuses a picture. Each was tried on the picture before it is named. Part of
// the images module.
#pragma once

#include <string>
#include <vector>

#include "pipelines/stages/picture_trial.hpp"
#include "pipelines/stages/preview.hpp"

namespace shakebed::pipelines {

// At most two, the best first. `measured`: what was found and refused, with the disks of its first frame; none where
// the first look was refused, or where nothing was found. What was found is not searched for again, and the picture is
// searched a few times at most.
enum class RefusedBy { first_look, measurement };
std::vector<Proposal> proposals_for(const FirstLook& look, const ExtractOptions& options, RefusedBy refused,
                                    const ingest::Measurement* measured = nullptr);

// "give --roi 1,2,3,4 (tried: 63 dark beads of 9.9 px radius)", each of them; without any, what is needed.
std::string advice_of(const std::vector<Proposal>& proposals, const ExtractOptions& options);

// Of several pictures, the first that shows beads after those that do not: a sentence, empty where none does.
std::string advice_of_other_pictures(const std::vector<ingest::FrameOrigin>& pictures, const ExtractOptions& options);
// That of the proposals; where there are none, that of the other pictures, if it helps.
std::string advice_for(const std::vector<Proposal>& proposals, const std::vector<ingest::FrameOrigin>& pictures,
                       const ExtractOptions& options);

}  // namespace shakebed::pipelines
