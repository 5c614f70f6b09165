#pragma once

#include "fit/profile_fit/fit_profile.hpp"

// A crystal's rows show in a profile that is measured through a narrow window, and no equation of state has rows. A
// Gaussian of 0.5 D wipes them out to 0.14 %; what was measured through less is blurred on to that. Internal to fit.
namespace shakebed::fit {

struct BlurredProfile {
  Profile profile;
  Kernel kernel;           // of the blurred profile: a Gaussian with the variance of both windows
  double rows_seen = 0.0;  // part of the rows' modulation that is left, 0 to 1
};

// The profile unchanged in four cases: the window is wide enough; the densities have no errors; the heights are farther
// apart than the blur allows; fit_profile() would refuse the profile. `base`: nothing lies below it [D].
BlurredProfile blur_rows(const Profile& profile, const Kernel& kernel, double base);

}  // namespace shakebed::fit
