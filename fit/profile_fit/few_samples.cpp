#include "fit/profile_fit/few_samples.hpp"

#include <gsl/gsl_cdf.h>

namespace shakebed::fit {

double student_over_normal(double probability, double degrees) {
  return gsl_cdf_tdist_Pinv(probability, degrees) / gsl_cdf_ugaussian_Pinv(probability);
}

}  // namespace shakebed::fit
