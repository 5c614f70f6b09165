#include "fit/quadrature.hpp"

#include <gsl/gsl_integration.h>

namespace shakebed::fit {

void fill_gauss_legendre(std::size_t points, double* nodes, double* weights) {
  gsl_integration_glfixed_table* table = gsl_integration_glfixed_table_alloc(points);
  for (std::size_t i = 0; i < points; ++i) gsl_integration_glfixed_point(-1.0, 1.0, i, nodes + i, weights + i, table);
  gsl_integration_glfixed_table_free(table);
}

}  // namespace shakebed::fit
