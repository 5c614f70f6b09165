#pragma once
// Which channel of a colour picture to measure in, once a survey knows what the beads are.
//
// The survey judges channels by rims. Where rims alone find beads, their faces may stand out in another channel, in
// which nearly all beads are found: photoelastic disks are crossed by fringes in one colour and plain in the next. So
// the finder itself is tried in each channel.

#include "ingest/find/survey.hpp"

namespace shakebed::ingest {

// The candidate in the channel in which most beads are expected to be found; `best` itself unless another is clearly
// better, or when its faces are found already.
SurveyCandidate settle_channel(const ChannelFrames& frames, const SurveyCandidate& best, const SurveyOptions& options);

}  // namespace shakebed::ingest
