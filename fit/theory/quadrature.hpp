#pragma once

#include <array>
#include <cstddef>

// Gauss-Legendre rules on [-1, 1], computed once to the last digit. Internal to fit.
namespace shakebed::fit {

template <std::size_t Points, class Real = double>
struct GaussLegendre {
  std::array<Real, Points> node{};
  std::array<Real, Points> weight{};
};

// Nodes, ascending, and weights.
void fill_gauss_legendre(std::size_t points, long double* nodes, long double* weights);

template <std::size_t Points, class Real = double>
const GaussLegendre<Points, Real>& gauss_legendre() {
  static const GaussLegendre<Points, Real> rule = [] {
    GaussLegendre<Points, long double> exact;
    fill_gauss_legendre(Points, exact.node.data(), exact.weight.data());
    GaussLegendre<Points, Real> built;
    for (std::size_t i = 0; i < Points; ++i) {
      built.node[i] = static_cast<Real>(exact.node[i]);
      built.weight[i] = static_cast<Real>(exact.weight[i]);
    }
    return built;
  }();
  return rule;
}

// integral_a^b function, one panel.
template <std::size_t Points, class Real, class Function>
Real integrate_panel(Real a, Real b, Function&& function) {
  const auto& rule = gauss_legendre<Points, Real>();
  const Real half = (b - a) / 2;
  const Real middle = (b + a) / 2;
  Real sum = 0;
  for (std::size_t i = 0; i < Points; ++i) sum += rule.weight[i] * function(middle + half * rule.node[i]);
  return half * sum;
}

}  // namespace shakebed::fit
