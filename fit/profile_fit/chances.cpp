#include "fit/profile_fit/chances.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>

namespace shakebed::fit {

double chance_of_chi2(double chi2, int dof) {
  if (dof <= 0) return 1.0;
  return std::isfinite(chi2) ? gsl_cdf_chisq_Q(chi2, dof) : 0.0;
}

double chi2_exceeded(double chance, int dof) { return gsl_cdf_chisq_Qinv(chance, dof); }

double student_quantile(double chance, double dof) { return gsl_cdf_tdist_Pinv(chance, dof); }

double normal_chance(double value) { return gsl_cdf_ugaussian_P(value); }
double normal_quantile(double chance) { return gsl_cdf_ugaussian_Pinv(chance); }

double as_deviations(double chance) { return chance >= 1 ? 0 : gsl_cdf_ugaussian_Qinv(std::max(chance, 1e-300) / 2); }

double even_number(std::mt19937_64& generator) { return (static_cast<double>(generator() >> 11) + 0.5) * 0x1p-53; }
double normal_number(std::mt19937_64& generator) { return normal_quantile(even_number(generator)); }

}  // namespace shakebed::fit
