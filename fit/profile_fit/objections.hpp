#pragma once

#include <optional>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/row_blur.hpp"

// What a profile shows, before any model, against reading a temperature from it. Internal to fit.
namespace shakebed::fit {

// Nothing for a profile that fit_profile() would refuse. `column_number`: N D/W, where it is known. `velocities`: those
// of the disks are known, so that the heights are not in doubt.
std::vector<Objection> objections_to(const BlurredProfile& seen, std::optional<double> column_number, bool velocities);

}  // namespace shakebed::fit
