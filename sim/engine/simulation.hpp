// A running simulation, whatever its engine: the interface between the physics and those who watch it. Reduced units.
//
// A simulation owns its disks and keeps nothing of the scene it was made from; what it is given to fill belongs to the
// caller, and so does a watcher. One thread at a time may use one; different ones share nothing.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "sim/scene/scene.hpp"

namespace shakebed::sim {

// Where everything is at one moment; index = disk.
struct Snapshot {
  double time = 0;  // since the start
  double floor_position = 0, floor_velocity = 0;
  std::vector<double> x, z, vx, vz, spin;                       // spin empty for smooth disks
  double lid_height = std::numeric_limits<double>::infinity();  // of its lower face; infinite for an open box
  double lid_velocity = 0;                                      // of a free lid
};

// What never changes; index = disk.
struct DiskProperties {
  std::vector<double> radius, mass;
};

// Where the energy went since the start, in m g D (weightless: in T at the start).
// kinetic + potential + compressed + dissipated + step_error - floor_work - bath_work = initial.
struct EnergyLedger {
  double initial = 0;
  double kinetic = 0, potential = 0;  // now; kinetic includes spin
  double compressed = 0;              // now, in the springs of a bed that is pressed on the floor
  double dissipated = 0;              // in contacts, and on the plates
  double step_error = 0;              // lost by the time steps of such a bed (negative: won)
  double floor_work = 0;              // done by the floor's motion (and by a thermal floor, and by plates that move)
  double bath_work = 0;               // given by the reservoir
  double dissipated_on_plates = 0;    // of what was dissipated, by friction with the plates
  double imbalance() const {
    return kinetic + potential + compressed + dissipated + step_error - floor_work - bath_work - initial;
  }
};

struct Counters {
  std::uint64_t disk_collisions = 0;  // between two disks
  std::uint64_t wall_collisions = 0;  // with sides and lid
  std::uint64_t floor_collisions = 0;
  std::uint64_t elastic_contacts = 0;     // of the dissipative ones, those the contact clock made elastic
  std::uint64_t predictions_renewed = 0;  // a partner was hit by another disk first
  std::uint64_t shell_exits = 0;
  std::uint64_t synchronisations = 0;
  std::uint64_t locks_relieved = 0;  // endless chains of contacts at one instant that were ended
  // Energy that contacts made elastic would have dissipated, friction left aside: of every chain of such contacts the
  // first, since the others keep the same energy again.
  double withheld = 0;
  double virial = 0;  // sum over disk-disk contacts of r12.dp: P V = N T + virial / (2 time)
  std::uint64_t events() const {
    return disk_collisions + wall_collisions + floor_collisions + predictions_renewed + shell_exits;
  }
  std::uint64_t collisions() const { return disk_collisions + wall_collisions + floor_collisions; }
};

// Called with everything that happens between looks, as it happens. Disks by their place in the start, times since the
// start, in reduced units; under periodic sides positions may lie a little outside the box.
class Watcher {
 public:
  virtual ~Watcher() = default;
  // From this time on the disk flies freely from here, until it is named again. A flight that goes on may be repeated.
  virtual void flies(double time, std::uint32_t disk, double x, double z, double vx, double vz) = 0;
  // Two disks touched. (x, z): centre of the first, (dx, dz): from it to the second's; (px, pz): momentum given to the
  // second, taken from the first.
  virtual void touched(double time, double x, double z, double dx, double dz, double px, double pz) = 0;
  // Two disks of a pressed bed are in contact: the same for a step of time.
  virtual void pressed(double time, double x, double z, double dx, double dz, double px, double pz) = 0;
  // A disk, its centre at height z, touched the floor, or the lid or a side, and got this momentum.
  virtual void touched_wall(double time, std::uint32_t disk, bool floor, double z, double px, double pz) = 0;
};

// The largest overlap that rounding leaves of hard disks, and the largest of a bed pressed on the floor [D]. The beds
// of tests/bench/README.md have up to 9e-3, where rows lock.
inline constexpr double hard_overlap = 1e-9, soft_overlap = 0.01;

class Simulation {
 public:
  virtual ~Simulation() = default;
  // Runs to the given time since the start (never backwards). Its events do not depend on where one stops to look; in
  // beds that go on tile by tile (see engine_tiles.hpp) their rounding does.
  void advance_to(double time) { advance_towards(time, std::numeric_limits<std::uint64_t>::max()); }
  // The same, but returns after about so many events (at least 1) wherever it is then: whether it arrived. Called again
  // until it has, it makes the same bytes as advance_to(); between the calls nothing is to be asked of the run.
  virtual bool advance_towards(double time, std::uint64_t most_events) = 0;
  virtual double time() const = 0;
  virtual void snapshot(Snapshot& out) const = 0;
  virtual DiskProperties properties() const = 0;
  virtual EnergyLedger energy() const = 0;
  virtual Counters counters() const = 0;
  // Largest overlap of any two disks now, in D, 0 if none (brute force over cells, O(N)).
  virtual double largest_overlap() const = 0;
  // More of it is an error [D]: hard_overlap, and soft_overlap in a bed that is or has been pressed on the floor.
  virtual double allowed_overlap() const { return hard_overlap; }
  // Has every contact that the disks will make an event, no later than it? It always must; tests and builds with
  // assertions ask. O(N), between events; also where advance_towards() has returned early.
  virtual bool foresees_contacts() const = 0;
  virtual std::size_t bytes() const = 0;  // memory held
  // The engine canonicalises its state at moments that only the run itself decides (see engine.hpp). checkpoint() gives
  // everything that is needed to continue from there to the same bytes. It may be called only when time() is such a
  // moment, right after advance_to(next_synchronisation()). restore() throws std::invalid_argument if the bytes are not
  // of this scene.
  virtual double next_synchronisation() const = 0;
  virtual std::vector<std::uint8_t> checkpoint() const = 0;
  virtual void restore(const std::vector<std::uint8_t>& bytes) = 0;
  // From now on the watcher (nullptr: none) is called; first of all with how every disk flies now. It changes nothing
  // of the run, but that it then is one in the order of time; it must outlive the run, and is not part of a checkpoint.
  virtual void watch(Watcher* watcher) = 0;
  // Another temperature for the Langevin, Andersen or thermal-floor reservoir, from now on. Not part of a checkpoint.
  // Throws std::invalid_argument where the scene has none of them.
  virtual void set_bath_temperature(double temperature) = 0;
};

// The one place where a scene becomes a specialised engine. Throws std::invalid_argument with check()'s words.
std::unique_ptr<Simulation> simulate(const Scene& scene);
}  // namespace shakebed::sim
