// A gas of hard disks in a periodic box, and its pressure beside two equations of state.
#include <cmath>
#include <cstdio>
#include <shakebed/fit/equation_of_state.hpp>
#include <shakebed/sim/measured_bed.hpp>

int main() {
  namespace sim = shakebed::sim;
  namespace fit = shakebed::fit;

  std::puts("number density  P V/(N T) measured  Enskog  Kolafa-Rottner");
  for (const double density : {0.2, 0.4, 0.6}) {
    sim::Scene scene;
    scene.gravity = sim::Weightless{};
    scene.disks.species = {{.count = 256}};
    const double side = std::sqrt(256 / density);  // [D]
    scene.box = {.width = side, .sides = sim::PeriodicSides{}, .top = sim::PeriodicTop{side}};
    scene.start = sim::HexagonalStart{};
    scene.seed = 7;

    const sim::MeasuredBed gas = sim::measure(scene, {.settle = 20, .duration = 200});
    if (!gas.ok()) return std::fprintf(stderr, "%s\n", gas.brief().c_str()), 1;
    std::printf("%14.1f  %8.4f +- %.4f  %6.4f  %14.4f\n", density, gas.compressibility_factor.value,
                gas.compressibility_factor.std_error, fit::enskog().compressibility_factor(density).value,
                fit::find_equation_of_state("kolafa-rottner")->compressibility_factor(density).value);
  }
}
