// Every public header of fit; the sum rule of the paper's own fit [QuinnHong2000].
#include <cmath>
#include <cstdio>
#include <shakebed/fit/answer.hpp>
#include <shakebed/fit/empirical_map.hpp>
#include <shakebed/fit/equation_of_state.hpp>
#include <shakebed/fit/expansion.hpp>
#include <shakebed/fit/fermi_profile.hpp>
#include <shakebed/fit/fit_profile.hpp>
#include <shakebed/fit/gamma_temperature.hpp>
#include <shakebed/fit/hydrostatic_profile.hpp>
#include <shakebed/fit/jump_height.hpp>
#include <shakebed/fit/value.hpp>
#include <shakebed/statistics/correlated_series.hpp>
#include <shakebed/statistics/kernel.hpp>

int main() {
  namespace fit = shakebed::fit;
  const fit::Column column = fit::column_from_initial_height(10.2, 1.10);
  const auto profile = fit::HydrostaticProfile::of_column(fit::enskog(), 0.12, column);
  std::printf("%.6f\n", profile.column_number());
  const bool closed = std::abs(profile.column_number() - column.column_number) < 1e-6;
  const bool refused = fit::fit_profile({}).status == fit::FitStatus::bad_input;
  const bool checked = fit::FitOptions{.model = "no such model"}.validate().size() == 1;
  return closed && refused && checked ? 0 : 1;
}
