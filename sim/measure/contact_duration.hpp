// Effect of the contact duration t_c of the TC model on a measured bed.
//
// A contact is made elastic where one of its partners was hit less than t_c before. The energy that the first of each
// chain of such contacts would have dissipated stays in the bed and may heat it. Its share of what is dissipated is
// counted as the run goes on; the temperature follows it (tests/physics/test_contact_duration.cpp).
//
// Any number of threads may call; values own what they hold.
#pragma once

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {

struct ContactDurationEffect {
  static constexpr double known_up_to = 0.1;
  double elastic_share = 0;   // of the contacts
  double withheld_share = 0;  // energy withheld over energy dissipated; 1 where every contact was elastic
  // The approximate relative excess of T_x and T_z. Smooth disks: right within a factor of two up to 0.05. Rough,
  // strongly dissipating beds: too large, because most of their contacts are those of the bed's landing. Above
  // `known_up_to`: a lower bound, and T may be several times as high.
  double temperature = 0;
};

// Of the part of a run between two moments: the counters at both, and the energy dissipated between them.
ContactDurationEffect contact_duration_effect(const Counters& before, const Counters& after, double dissipated);

// The contact duration at which the effect on T would be `wanted` or less, where it is `effect` now.
double contact_duration_for(double effect, double contact_duration, double wanted);

}  // namespace shakebed::sim
