#include "sim/measure/contact_duration.hpp"

#include <cmath>

namespace shakebed::sim {

namespace {

// T is raised by about the share of the energy that is withheld. Shaken beds, share and rise of T against t_c = 1e-5
// [sqrt(D/g)]: 0.053 and 6 %, 0.096 and 16 %, 0.15 and 50 % at e = 0.9, Gamma = 3, t_c = 1e-4, 3e-4, 7e-4; 0.015 and
// 2 %, 0.04 and 5 % at e = 0.95, Gamma = 4, t_c = 1.4e-3, 3.5e-3; 0.09 and 5 %, 0.15 and 13 % at e = 0.8, Gamma = 2,
// t_c = 3e-5, 1e-4; 0.066 and none at e = 0.6, friction 0.8, Gamma = 4, t_c = 1e-4.
constexpr double heating = 1.0;
// The share grows as t_c to a power of 0.3 (rough, dissipating), 0.4 (dense, Gamma = 2) to 0.8 (Gamma = 3). By the
// slowest, the advised t_c is short enough in each.
constexpr double growth = 0.3;

}  // namespace

ContactDurationEffect contact_duration_effect(const Counters& before, const Counters& after, double dissipated) {
  ContactDurationEffect effect;
  const auto contacts = static_cast<double>(after.collisions() - before.collisions());
  if (contacts > 0)
    effect.elastic_share = static_cast<double>(after.elastic_contacts - before.elastic_contacts) / contacts;
  if (dissipated > 0) effect.withheld_share = (after.withheld - before.withheld) / dissipated;
  // Every contact was elastic, and each withheld what an earlier one of its chain had withheld: the bed loses nothing.
  if (dissipated <= 0 && effect.elastic_share == 1) effect.withheld_share = 1;
  effect.temperature = heating * effect.withheld_share;
  return effect;
}

double contact_duration_for(double effect, double contact_duration, double wanted) {
  if (effect <= wanted) return contact_duration;
  return contact_duration * std::pow(wanted / effect, 1 / growth);
}

}  // namespace shakebed::sim
