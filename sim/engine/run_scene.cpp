// The engines of the libraries and the program: all of them.
// implements: sim/engine/simulation.hpp
#include "sim/engine/choose_engine.hpp"

namespace shakebed::sim {

std::unique_ptr<Simulation> simulate(const Scene& scene) { return simulate_with<EveryEngine>(scene); }

}  // namespace shakebed::sim
