#include "sim/measure/contact_duration.hpp"

#include <cmath>

namespace shakebed::sim {

namespace {

// How much T is raised by the share of the energy that is withheld. Measured on shaken beds at t_c = 3e-5 to 7e-4
// sqrt(D/g) against 1e-5: 0.7 at e = 0.9, Gamma = 3; 0.4 at e = 0.8, Gamma = 2; 1.0 at e = 0.95, Gamma = 4.
constexpr double heating = 0.7;
// The share withheld grows as t_c to a power of 0.55 (dense, Gamma = 2) to 0.95 (Gamma = 3): the smaller is safe.
constexpr double growth = 0.55;

}  // namespace

ContactDurationEffect contact_duration_effect(const Counters& before, const Counters& after, double dissipated) {
  ContactDurationEffect effect;
  const auto contacts = static_cast<double>(after.collisions() - before.collisions());
  if (contacts > 0)
    effect.elastic_share = static_cast<double>(after.elastic_contacts - before.elastic_contacts) / contacts;
  if (dissipated > 0) effect.withheld_share = (after.withheld - before.withheld) / dissipated;
  effect.temperature = heating * effect.withheld_share;
  return effect;
}

double contact_duration_for(double effect, double contact_duration, double wanted) {
  if (effect <= wanted) return contact_duration;
  return contact_duration * std::pow(wanted / effect, 1 / growth);
}

}  // namespace shakebed::sim
