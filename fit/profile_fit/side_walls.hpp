#pragma once

#include "fit/profile_fit/fit_profile.hpp"

// Between hard side walls the centres keep half a diameter away from each wall, while densities count per whole width.
// Theories are about the density far from walls. Internal to fit.
namespace shakebed::fit {

// Number density far from two walls `width` apart [D], from that averaged over the whole width [1/D^2]. By the
// scaled-particle theory of hard disks [Helfand1961] the pressure is n T/(1 - eta)^2, with the packing
// eta = pi n D^2/4. The line tension of a wall is n D T/(2 (1 - eta)). So a wall lowers the number of disks per length
// by n D (1 - eta)/(2 (1 + eta)). A close-packed bed has no such depletion.
double density_far_from_walls(double averaged, double width);

// The profile far from the walls, with its errors and covariance. `column_number`, N D/W, becomes that of this profile.
void take_far_from_walls(Profile& profile, double width, std::optional<double>& column_number);

}  // namespace shakebed::fit
