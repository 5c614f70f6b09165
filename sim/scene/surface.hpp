// What two bodies are to each other when they touch.
//
// Plain data, without pointers: copies are independent. Any number of threads may read one.
#pragma once

namespace shakebed::sim {

// How the restitution depends on the approach v of a contact.
enum class RestitutionLaw {
  constant,
  power,        // 1 - (1 - e) (v/v0)^(3/4) below v0, e above [Bizon1998]
  viscoelastic  // of viscoelastic spheres [MuellerPoeschel2011], e at v0
};

// Restitution and friction of one kind of contact (disk-disk, disk-wall, disk-floor).
struct Surface {
  double restitution = 1;             // e, normal; by a law that varies it is that at v0
  double friction = 0;                // mu_f, Coulomb
  double tangential_restitution = 0;  // b0, largest tangential restitution [-1, 1], reached by sticking contacts
  RestitutionLaw law = RestitutionLaw::constant;
  double law_speed = 1;  // v0
};

}  // namespace shakebed::sim
