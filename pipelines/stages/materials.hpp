// Materials of beads by name, and how long a contact of two of them lasts.
#pragma once

#include <string_view>

namespace shakebed::pipelines {

enum class Material { unnamed, aluminium, steel, glass, brass, polystyrene, acetate };

// Handbook values at room temperature [KayeLaby1995], rounded; glass is soda-lime, acetate cellulose acetate. Plastics
// differ by a fifth from grade to grade. The restitution depends on speed and surface: it is for the recipe to state.
struct MaterialConstants {
  Material material;
  std::string_view name;
  double density;        // [kg/m^3]
  double young_modulus;  // [Pa]
  double poisson_ratio;
};
const MaterialConstants& constants_of(Material material);

// The contact time of two equal elastic spheres that collide head on with `speed` [m/s] [Hertz1882]:
//   2.868 (m*^2/(R* E*^2 v))^(1/5), m* = m/2, R* = D/4, E* = E/(2 (1 - nu^2)).
// Diameter in m; result in s.
double hertz_contact_time(const MaterialConstants& material, double diameter, double speed);

}  // namespace shakebed::pipelines
