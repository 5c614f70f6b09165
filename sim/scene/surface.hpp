// What two bodies are to each other when they touch.
#pragma once

namespace shakebed::sim {

// Restitution and friction of one kind of contact (disk-disk, disk-wall, disk-floor).
struct Surface {
  double restitution = 1;             // e, normal
  double friction = 0;                // mu_f, Coulomb
  double tangential_restitution = 0;  // b0, largest tangential restitution [-1, 1], reached by sticking contacts
};

}  // namespace shakebed::sim
