#pragma once

#include <array>
#include <cstddef>

// Gauss-Legendre rules on [-1, 1], computed once to the last digit. Internal to fit.
namespace shakebed::fit {

template <std::size_t Points>
struct GaussLegendre {
  std::array<double, Points> node{};
  std::array<double, Points> weight{};
};

void fill_gauss_legendre(std::size_t points, double* nodes, double* weights);

template <std::size_t Points>
const GaussLegendre<Points>& gauss_legendre() {
  static const GaussLegendre<Points> rule = [] {
    GaussLegendre<Points> built;
    fill_gauss_legendre(Points, built.node.data(), built.weight.data());
    return built;
  }();
  return rule;
}

// integral_a^b function, one panel.
template <std::size_t Points, class Function>
double integrate_panel(double a, double b, Function&& function) {
  const auto& rule = gauss_legendre<Points>();
  const double half = 0.5 * (b - a);
  const double middle = 0.5 * (b + a);
  double sum = 0.0;
  for (std::size_t i = 0; i < Points; ++i) sum += rule.weight[i] * function(middle + half * rule.node[i]);
  return half * sum;
}

}  // namespace shakebed::fit
