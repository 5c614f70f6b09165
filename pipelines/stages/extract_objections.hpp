// What photographs show against reading a temperature from their profile.
#pragma once

#include "ingest/profile/measure_bed.hpp"
#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// [{"why", "advice"}] for extract.json; the fit takes it from there into the answer [fit::Objection]. `not_round`: the
// outlines are not those of disks, and shape "any" was asked for.
Json objections_json(const ingest::Measurement& found, bool not_round);

}  // namespace shakebed::pipelines
