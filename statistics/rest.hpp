#pragma once
// When a bed counts as one at rest.

namespace shakebed {

// Kinetic temperatures below this are those of a bed at rest [m g D]: its disks rise by a ten-thousandth of D.
inline constexpr double temperature_at_rest = 1e-4;

}  // namespace shakebed
