#pragma once

#include "fit/profile_fit/fit_setup.hpp"

// What is odd about a profile or a fit, in plain sentences. Internal to fit.
namespace shakebed::fit {

// Five heights or more that span less than a disk.
bool heights_look_like_metres(const MeasuredProfile& measured);
// Of a density averaged over a diameter [1/D^2].
bool is_denser_than_close_packing(double density);
// Too far from N D/W for a measurement of the same bed in the same unit.
bool area_is_of_another_unit(double area, double column_number);

// Heights in metres, densities above close packing, an area that is not N D/W.
void warn_about_units(const MeasuredProfile& measured, const FitOptions& options, FitResult& result);

// No solid, a model that does not fit, an outlier, a T that depends on the window, a broken sum rule, a plateau density
// that is not determined. `result` holds everything else.
void warn_about_fit(const MeasuredProfile& measured, const FitOptions& options, const FitSetup& setup,
                    FitResult& result);

}  // namespace shakebed::fit
