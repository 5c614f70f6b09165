// A simulation's checkpoint: damaged bytes are refused; what is accepted goes on for a while.
#include <stdexcept>

#include "sim/engine/simulation.hpp"
#include "tests/robustness/fuzz/fuzz.hpp"

using namespace shakebed::sim;

namespace {
Scene scene() {
  Scene s;
  s.gravity = UniformGravity{};
  s.disks.species = {{4, 1, 1}};
  s.disks.contact = {0.9, 0, 0};
  s.disks.contact_duration = 1e-5;
  s.box.width = 6;
  s.box.sides = HardSides{{0.9, 0, 0}};
  s.box.floor = SinusoidalFloor{0.8, 0.35};
  s.box.floor_surface = {0.9, 0, 0};
  return s;
}
}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto simulation = simulate(scene());
  try {
    simulation->restore({data, data + size});
  } catch (const std::invalid_argument& error) {
    if (std::string_view(error.what()).empty()) shakebed::fuzz::fail("an error without words");
    return 0;
  }
  const double until = simulation->time() + 0.5;
  simulation->advance_to(until);
  Snapshot at;
  simulation->snapshot(at);
  for (std::size_t i = 0; i < at.x.size(); ++i) {
    if (at.x[i] != at.x[i] || at.z[i] != at.z[i] || at.vx[i] != at.vx[i] || at.vz[i] != at.vz[i])
      shakebed::fuzz::fail("a disk is nowhere");
  }
  return 0;
}
