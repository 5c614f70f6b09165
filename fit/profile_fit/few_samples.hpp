#pragma once

// Errors that come from few samples.
namespace shakebed::fit {

// Student's quantile over the normal one at a probability above 1/2 (0.975 for two sides of 95 %): by how much an
// interval of a mean widens where its error comes from so many degrees of freedom.
double student_over_normal(double probability, double degrees);

}  // namespace shakebed::fit
