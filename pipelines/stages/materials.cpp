#include "pipelines/stages/materials.hpp"

#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

namespace shakebed::pipelines {
namespace {

constexpr std::array<MaterialConstants, 6> known_materials{{
    {Material::aluminium, "aluminium", 2700, 70.3e9, 0.345},
    {Material::steel, "steel", 7860, 212e9, 0.291},
    {Material::glass, "glass", 2500, 71.3e9, 0.22},
    {Material::brass, "brass", 8500, 100.6e9, 0.35},
    {Material::polystyrene, "polystyrene", 1050, 3.3e9, 0.34},
    {Material::acetate, "acetate", 1300, 2.0e9, 0.4},
}};

}  // namespace

const MaterialConstants& constants_of(Material material) {
  assert(material != Material::unnamed);
  return known_materials[static_cast<std::size_t>(material) - 1];
}

double hertz_contact_time(const MaterialConstants& material, double diameter, double speed) {
  const double mass = material.density * std::numbers::pi / 6 * std::pow(diameter, 3);
  const double modulus = material.young_modulus / (2 * (1 - material.poisson_ratio * material.poisson_ratio));
  return 2.868 * std::pow(std::pow(mass / 2, 2) / (diameter / 4 * modulus * modulus * speed), 0.2);
}

}  // namespace shakebed::pipelines
