#pragma once

#include <random>

// Chances and quantiles of the normal distribution, of Student's t and of chi2, by GSL; random numbers.
namespace shakebed::fit {

// Chance of a chi2 at least as large, were the model true and the errors right. 1 for dof <= 0.
[[nodiscard]] double chance_of_chi2(double chi2, int dof);
// The chi2 that is exceeded with this chance; dof >= 1.
[[nodiscard]] double chi2_exceeded(double chance, int dof);

// Student's t of `dof` degrees of freedom that a chance lies below.
[[nodiscard]] double student_quantile(double chance, double dof);

// The normal distribution: chance of a value below, and the value that a chance lies below.
[[nodiscard]] double normal_chance(double value);
[[nodiscard]] double normal_quantile(double chance);
// A two-sided chance as a number of standard deviations; at most 38, where a double ends.
[[nodiscard]] double as_deviations(double chance);

// Random numbers, the same on every platform: even in (0, 1), and of the normal distribution.
[[nodiscard]] double even_number(std::mt19937_64& generator);
[[nodiscard]] double normal_number(std::mt19937_64& generator);

}  // namespace shakebed::fit
