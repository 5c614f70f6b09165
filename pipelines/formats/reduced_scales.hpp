// What a length and a time of a recipe are divided by to be reduced, and the amplitude that a Gamma stands for. The
// standard library only: the page of `shakebed live` uses it too.
#pragma once

#include <cmath>
#include <numbers>

namespace shakebed::pipelines {

inline constexpr double usual_gravity = 9.81;  // [m/s^2]

// D and sqrt(D/g).
struct ReducedScales {
  double length = 1, time = 1;
  static ReducedScales of(double diameter, double gravity) { return {diameter, std::sqrt(diameter / gravity)}; }
};

// a = Gamma g/(2 pi f)^2.
inline double amplitude_of(double gamma, double gravity, double frequency) {
  const double omega = 2 * std::numbers::pi * frequency;
  return gamma * gravity / (omega * omega);
}

// t_c of the contact clock where something dissipates and none is named [sqrt(D/g)]: 1.4 us for beads of 2 mm.
inline constexpr double usual_contact_duration = 1e-4;

}  // namespace shakebed::pipelines
