// Facts of the bed that a stage may leave out, because an earlier one has stated them.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <string_view>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/config.hpp"

namespace shakebed::pipelines {

// While decoding: what is stated here must be what the earlier stage knows; both places are named otherwise. Beds in
// reduced units have no sizes to compare.
inline void require_same_as_bed(Fields& fields, std::string_view key, std::optional<double> stated,
                                std::optional<double> known, const Dimension& dimension) {
  const KnownBed* bed = fields.known_bed();
  if (bed == nullptr || bed->bed.reduced || !stated || !known) return;
  fields.require(same_fact(*stated, *known), key,
                 fmt::format("is {} here, but {} in {}", quantity_text(*stated, dimension),
                             quantity_text(*known, dimension), bed->place),
                 "Remove it here (the value of that stage is then used), or correct one of the two values");
}

}  // namespace shakebed::pipelines
