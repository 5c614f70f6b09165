#pragma once
// Which channel of a colour picture to measure in, once a survey knows what the beads are.
//
// The survey judges channels by rims. Where beads are found by rims alone, another channel may show their faces
// clearly, and nearly all beads are found there. Example: photoelastic disks have fringes in one colour and are plain
// in another. So the finder itself is tried in each channel.

#include "ingest/find/survey.hpp"

namespace shakebed::ingest {

// The candidate in the channel in which most beads are expected to be found; `best` itself unless another is clearly
// better, or when its faces are found already.
SurveyCandidate settle_channel(const ChannelFrames& frames, const SurveyCandidate& best, const SurveyOptions& options);

}  // namespace shakebed::ingest
