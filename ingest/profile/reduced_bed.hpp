#pragma once
// measure_bed() on frames that were reduced while they were read: what is asked and found is in px as recorded.

#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

// `options.reduction` > 1 says by how much. Called by measure_bed().
Measurement measure_reduced_bed(FrameSource& source, const MeasureOptions& options);

}  // namespace shakebed::ingest
