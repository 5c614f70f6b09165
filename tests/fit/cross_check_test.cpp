#include <gsl/gsl_blas.h>
#include <gsl/gsl_multifit_nlinear.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/fit/synthetic.hpp"

// The fitter against another one: the GNU Scientific Library's, with numerical derivatives, on the printed form of f
// inverted by bisection. Nothing of the library's tables, kernels, derivatives or iteration is shared.
namespace shakebed::fit {
namespace {

double printed_f(double phi) {
  const double half_pi = std::acos(-1.0) / 2.0;
  const double a = 0.489351 * half_pi;
  const double a1 = 0.196703 * half_pi;
  const double a2 = 0.006519 * half_pi * half_pi;
  const double c1 = 2.0 * half_pi * a2 / (a * a);
  const double c2 = -half_pi * (a1 - 2.0 * a2 / a) / (a * a);
  const double c4 = half_pi * (1.0 - a1 / a + a2 / (a * a)) / a;
  const double d = 1.0 - a * phi;
  return std::log(phi) + c1 * phi + c2 * std::log(d) - c2 / d + c4 / (d * d);
}

double bisected_density(double height, double temperature, double shift, double plateau) {
  if (height <= shift) return plateau;
  const double f = printed_f(plateau) - (height - shift) / temperature;
  double low = 1e-300;
  double high = plateau;
  for (int i = 0; i < 2200 && high - low > 1e-16 * high; ++i) {
    const double middle = low < 1e-3 * high ? std::sqrt(low * high) : 0.5 * (low + high);
    (printed_f(middle) < f ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

struct Data {
  const Profile* profile;
  double low, high, plateau;
};

int residuals(const gsl_vector* x, void* params, gsl_vector* out) {
  const auto& data = *static_cast<const Data*>(params);
  std::size_t row = 0;
  for (std::size_t i = 0; i < data.profile->height.size(); ++i) {
    const double height = data.profile->height[i];
    if (height < data.low || height > data.high) continue;
    const double model = bisected_density(height, std::exp(gsl_vector_get(x, 0)), gsl_vector_get(x, 1), data.plateau);
    gsl_vector_set(out, row++, (model - data.profile->number_density[i]) / data.profile->std_error[i]);
  }
  return GSL_SUCCESS;
}

TEST(CrossCheck, AnotherFitterFindsTheSameTemperatureTo1e8) {
  for (const double t : {0.05, 0.12, 0.5, 3.0}) {
    const auto truth = HydrostaticProfile::of_column(enskog(), t, {11.22, 1.10});
    const Profile profile = synthetic::profile_of(truth, {}, 100, synthetic::top_of(truth), 0.01, 21);
    FitOptions options;
    options.plateau_density = 1.10;
    options.interval = options.sweep = options.compare = false;
    options.curve_points = 0;
    const FitResult fit = fit_profile(profile, options);
    ASSERT_TRUE(fit.ok());
    // Above T_c the curve has no rectangle inside the window either, so the same formula serves.
    Data data{&profile, fit.window_low, fit.window_high, 1.10};
    const auto bins = static_cast<std::size_t>(fit.bins);
    gsl_multifit_nlinear_parameters parameters = gsl_multifit_nlinear_default_parameters();
    parameters.fdtype = GSL_MULTIFIT_NLINEAR_CTRDIFF;
    parameters.h_df = 1e-5;
    gsl_multifit_nlinear_workspace* workspace =
        gsl_multifit_nlinear_alloc(gsl_multifit_nlinear_trust, &parameters, bins, 2);
    gsl_multifit_nlinear_fdf function{};
    function.f = residuals;
    function.n = bins;
    function.p = 2;
    function.params = &data;
    double start[2] = {std::log(1.1 * fit.temperature.value), fit.shift.value - 0.1 * fit.temperature.value};
    const gsl_vector_view x = gsl_vector_view_array(start, 2);
    gsl_multifit_nlinear_init(&x.vector, &function, workspace);
    int info = 0;
    gsl_multifit_nlinear_driver(200, 1e-14, 1e-14, 0.0, nullptr, nullptr, &info, workspace);
    const gsl_vector* found = gsl_multifit_nlinear_position(workspace);
    const double temperature = std::exp(gsl_vector_get(found, 0));
    const double shift = gsl_vector_get(found, 1);
    double chi2 = 0.0;
    gsl_blas_ddot(gsl_multifit_nlinear_residual(workspace), gsl_multifit_nlinear_residual(workspace), &chi2);
    EXPECT_NEAR(fit.temperature.value / temperature, 1.0, 1e-8) << t;
    EXPECT_NEAR(fit.shift.value, shift, 1e-8 * std::max(1.0, std::abs(shift))) << t;
    EXPECT_NEAR(fit.chi2 / chi2, 1.0, 1e-10) << t;
    // Errors too: (J^T J)^-1.
    gsl_matrix* covariance = gsl_matrix_alloc(2, 2);
    gsl_multifit_nlinear_covar(gsl_multifit_nlinear_jac(workspace), 0.0, covariance);
    EXPECT_NEAR(fit.temperature.std_error / (temperature * std::sqrt(gsl_matrix_get(covariance, 0, 0))), 1.0, 1e-4)
        << t;
    gsl_matrix_free(covariance);
    gsl_multifit_nlinear_free(workspace);
  }
}

}  // namespace
}  // namespace shakebed::fit
