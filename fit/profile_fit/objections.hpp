#pragma once

#include <optional>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/row_blur.hpp"

// Reasons, visible in a profile before any model, why it gives no temperature. Internal to fit.
namespace shakebed::fit {

// Empty for a profile that fit_profile() refuses. `column_number`: N D/W, where it is known. `velocities`: those
// of the disks are known, so that the heights are not in doubt.
std::vector<Objection> objections_to(const BlurredProfile& seen, std::optional<double> column_number, bool velocities);

}  // namespace shakebed::fit
