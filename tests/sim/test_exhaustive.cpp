// Small beds of every engine beside a run that knows nothing of cells, shells, lists or queues: at each event it asks
// every pair and every wall which contact comes first, and applies the collision rule as the papers print it.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "sim/engine/random.hpp"
#include "sim/engine/simulation.hpp"

namespace shakebed::sim {
namespace {

using Real = long double;
constexpr Real no_time = std::numeric_limits<Real>::infinity();

struct Body {
  Real x, z, vx, vz, spin, radius, mass;
  Real last_contact = -no_time, withheld_at = no_time;  // moments of its latest contact, of one that withheld energy
  Real floor_time = 0, side_times[2] = {0, 0};
};

class ExhaustiveRun {
 public:
  explicit ExhaustiveRun(const Scene& scene) : scene_(scene) {
    falls_ = std::holds_alternative<UniformGravity>(scene.gravity) ? 1 : 0;
    periodic_x_ = std::holds_alternative<PeriodicSides>(scene.box.sides);
    if (const auto* top = std::get_if<PeriodicTop>(&scene.box.top)) period_z_ = top->height;
    if (const auto* sides = std::get_if<HardSides>(&scene.box.sides)) {
      side_ = sides->surface;
      sine_ = std::sin(static_cast<Real>(sides->slope)), cosine_ = std::cos(static_cast<Real>(sides->slope));
    }
    if (const auto* lid = std::get_if<Lid>(&scene.box.top)) {
      lid_ = lid->surface, lid_z_ = lid->height;
      if (lid->is_free()) lid_mass_ = lid->mass;
    }
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene.box.floor))
      amplitude_ = sine->amplitude, omega_ = 2 * std::numbers::pi_v<Real> * static_cast<Real>(sine->frequency);
    for (const Placed& p : std::get<PlacedStart>(scene.start).disks) {
      const Species& s = scene.disks.species[p.species];
      bodies.push_back({p.x, p.z, p.vx, p.vz, p.spin, static_cast<Real>(s.diameter) / 2, s.mass});
    }
  }

  // To this time; what has come to pass is in the counters.
  void advance_to(Real end) {
    end_ = end;
    for (Body& body : bodies) look_for_moving_walls(body);
    for (;;) {
      const Next next = earliest();
      const Real step = std::min(next.wait, end - time_);
      for (Body& b : bodies) {
        b.x += b.vx * step, b.z += b.vz * step - falls_ * step * step / 2, b.vz -= falls_ * step;
      }
      if (lid_mass_ < no_time) lid_z_ += lid_v_ * step - step * step / 2, lid_v_ -= step;
      time_ += step;
      if (!(next.wait <= step)) return;
      happen(next);
    }
  }

  std::vector<Body> bodies;
  Real lid_height() const { return lid_z_; }
  Real lid_velocity() const { return lid_v_; }
  Real dissipated = 0, floor_work = 0, virial = 0, withheld = 0;
  std::uint64_t pairs = 0, walls = 0, floors = 0, elastic = 0;

 private:
  enum class What { nothing, pair, left, right, floor, lid };
  struct Next {
    Real wait = no_time;
    What what = What::nothing;
    std::size_t i = 0, j = 0;
  };

  Real floor_at(Real t) const { return amplitude_ * std::sin(omega_ * t); }
  Real floor_velocity() const { return amplitude_ * omega_ * std::cos(omega_ * time_); }
  Real image(Real d, Real period) const { return period > 0 ? d - period * std::round(d / period) : d; }

  // From now on until the gap above a floor at a height closes: a fine scan, then halving. Where it is open above the
  // highest place of the floor it is open.
  template <class Gap>
  Real first_closing(const Gap& gap) const {
    constexpr Real step = 1 / 512.0L;
    const auto now = [&](Real t) { return gap(t, floor_at(time_ + t)); };
    Real before = 0;
    for (Real t = step; t < end_ - time_ + step; before = t, t += step) {
      if (gap(t, amplitude_) > 0 || now(t) > 0) continue;
      Real low = before, high = t;
      for (int k = 0; k < 70; ++k) (now((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
      return high;
    }
    return no_time;
  }
  void look_for_moving_walls(Body& b) {
    b.floor_time = b.side_times[0] = b.side_times[1] = no_time;
    if (period_z_ > 0) return;
    const auto height = [&](Real t) { return b.z + b.vz * t - falls_ * t * t / 2; };
    if (falls_ == 0) {
      if (b.vz < 0) b.floor_time = time_ + std::max<Real>(0, (b.z - b.radius) / -b.vz);
    } else {
      b.floor_time = time_ + first_closing([&](Real t, Real floor) { return height(t) - floor - b.radius; });
    }
    for (const bool left : {true, false}) {
      if (sine_ == 0) continue;
      b.side_times[left ? 0 : 1] = time_ + first_closing([&](Real t, Real floor) {
                                     const Real x = b.x + b.vx * t;
                                     return cosine_ * (left ? x : static_cast<Real>(scene_.box.width) - x) +
                                            sine_ * (height(t) - floor) - b.radius;
                                   });
    }
  }

  Next earliest() const {
    Next next;
    const auto offer = [&](Real wait, What what, std::size_t i, std::size_t j) {
      if (wait < next.wait) next = {wait, what, i, j};
    };
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Body& a = bodies[i];
      for (std::size_t j = i + 1; j < bodies.size(); ++j) {
        const Body& b = bodies[j];
        const Real dx = image(b.x - a.x, periodic_x_ ? scene_.box.width : 0), dz = image(b.z - a.z, period_z_);
        const Real dvx = b.vx - a.vx, dvz = b.vz - a.vz, reach = a.radius + b.radius;
        const Real product = dx * dvx + dz * dvz, speed = dvx * dvx + dvz * dvz,
                   beyond = dx * dx + dz * dz - reach * reach, root = product * product - speed * beyond;
        if (product < 0 && root > 0) offer(std::max<Real>(0, (-product - std::sqrt(root)) / speed), What::pair, i, j);
      }
      if (period_z_ > 0) continue;
      offer(a.floor_time - time_, What::floor, i, i);
      offer(a.side_times[0] - time_, What::left, i, i), offer(a.side_times[1] - time_, What::right, i, i);
      if (!periodic_x_ && sine_ == 0) {
        if (a.vx < 0) offer(std::max<Real>(0, (a.x - a.radius) / -a.vx), What::left, i, i);
        if (a.vx > 0) offer(std::max<Real>(0, (scene_.box.width - a.radius - a.x) / a.vx), What::right, i, i);
      }
      if (!(lid_z_ < no_time)) continue;
      const Real gap = lid_z_ - a.radius - a.z;
      if (lid_mass_ < no_time) {  // both fall: they approach at a constant speed
        if (a.vz > lid_v_) offer(std::max<Real>(0, gap / (a.vz - lid_v_)), What::lid, i, i);
      } else if (falls_ == 0) {
        if (a.vz > 0) offer(std::max<Real>(0, gap / a.vz), What::lid, i, i);
      } else if (a.vz > 0 && a.vz * a.vz >= 2 * gap) {
        offer(std::max<Real>(0, a.vz - std::sqrt(a.vz * a.vz - 2 * gap)), What::lid, i, i);
      }
    }
    return next;
  }

  // The Walton rule [Walton1993] with the restitution law, elastic and smooth by the contact clock. The normal points
  // from the first body to the second.
  struct Exchange {
    Real px, pz, tangential;
  };
  Exchange exchange(Real nx, Real nz, Real gn, Real gt, Real mass, Surface s, bool soon, bool rough) {
    Real e = s.restitution;
    if (s.law == RestitutionLaw::power && gn < s.law_speed) e = 1 - (1 - e) * std::pow(gn / s.law_speed, 0.75L);
    if (soon) {
      // Of a chain of such contacts the first that would have lost energy counts.
      ++elastic;
      if (!of_chain_) withheld += mass * (1 - e * e) * gn * gn / 2;
      if (of_chain_ || e < 1) *noted_[0] = *noted_[1] = time_;
      e = 1, rough = false;
    }
    const Real normal = mass * (1 + e) * gn;
    Real tangential = 0;
    dissipated += mass * (1 - e * e) * gn * gn / 2;
    if (rough && gt != 0 && s.friction > 0) {
      const Real q = scene_.disks.inertia_ratio, lever = 1 + 1 / q;
      // A sticking contact turns gt into -b0 gt; Coulomb allows no more than mu times the normal momentum.
      const Real sticking = mass * (1 + s.tangential_restitution) / lever * std::abs(gt), most = s.friction * normal;
      tangential = std::copysign(std::min(sticking, most), gt);
      const Real left = gt - lever * tangential / mass;  // what gt becomes
      dissipated += mass / lever * (gt * gt - left * left) / 2;
    }
    return {normal * nx - tangential * nz, normal * nz + tangential * nx, tangential};
  }
  bool too_soon(Body& a, Body& b) {
    const Real t_c = scene_.disks.contact_duration;
    const bool soon = t_c > 0 && (time_ - a.last_contact < t_c || time_ - b.last_contact < t_c);
    of_chain_ = a.withheld_at == a.last_contact || b.withheld_at == b.last_contact;
    noted_ = {&a.withheld_at, &b.withheld_at};
    a.last_contact = b.last_contact = time_;
    return soon;
  }
  // Momentum taken from a body; its spin.
  void take(Body& b, const Exchange& p, Real sign) {
    b.vx -= sign * p.px / b.mass, b.vz -= sign * p.pz / b.mass;
    b.spin -= p.tangential / (static_cast<Real>(scene_.disks.inertia_ratio) * b.mass * b.radius);
  }

  void happen(const Next& next) {
    Body& a = bodies[next.i];
    if (next.what == What::pair) {
      ++pairs;
      Body& b = bodies[next.j];
      const Real dx = image(b.x - a.x, periodic_x_ ? scene_.box.width : 0), dz = image(b.z - a.z, period_z_);
      const Real r = std::hypot(dx, dz), nx = dx / r, nz = dz / r, gx = a.vx - b.vx, gz = a.vz - b.vz;
      const Exchange p = exchange(nx, nz, gx * nx + gz * nz, -gx * nz + gz * nx + a.radius * a.spin + b.radius * b.spin,
                                  a.mass * b.mass / (a.mass + b.mass), scene_.disks.contact, too_soon(a, b), true);
      virial += p.px * dx + p.pz * dz;
      take(a, p, 1), take(b, p, -1);
      look_for_moving_walls(b);
    } else {
      ++(next.what == What::floor ? floors : walls);
      hit_wall(a, next.what);
    }
    look_for_moving_walls(a);
  }

  void hit_wall(Body& a, What what) {
    if (what == What::lid && lid_mass_ < no_time) {
      const Real approach = a.vz - lid_v_, mass = a.mass * lid_mass_ / (a.mass + lid_mass_);
      const Exchange p = exchange(0, 1, approach, 0, mass, lid_, too_soon(a, a), false);
      a.vz -= p.pz / a.mass, lid_v_ += p.pz / lid_mass_;
      return;
    }
    const Surface& s = what == What::floor ? scene_.box.floor_surface : what == What::lid ? lid_ : side_;
    const Real nx = what == What::left ? -cosine_ : what == What::right ? cosine_ : 0;
    const Real nz = what == What::lid ? 1 : what == What::floor ? -1 : -sine_;
    const bool moves = what == What::floor || (what != What::lid && sine_ > 0);
    const Real wall = moves ? floor_velocity() : 0, gx = a.vx, gz = a.vz - wall;
    const Exchange p =
        exchange(nx, nz, gx * nx + gz * nz, -gx * nz + gz * nx + a.radius * a.spin, a.mass, s, too_soon(a, a), true);
    take(a, p, 1);
    floor_work -= p.pz * wall;
  }

  const Scene& scene_;
  Real falls_ = 0, period_z_ = 0, amplitude_ = 0, omega_ = 0, sine_ = 0, cosine_ = 1;
  Real lid_z_ = no_time, lid_v_ = 0, lid_mass_ = no_time, time_ = 0, end_ = 0;
  bool periodic_x_ = false, of_chain_ = false;
  std::array<Real*, 2> noted_{};
  Surface side_, lid_;
};

enum class Space { periodic, weightless_sides, weightless_round, hard, round, lid, slopes, free_lid };
enum class Rule { elastic, dissipative, rough };
struct Case {
  Space space;
  Rule rule;
  bool two;
};

// `a_row` x `rows` disks on a lattice, none touching, with random velocities; of two species every second is small, and
// the restitution varies.
Scene scene_of(const Case& of, int a_row, int rows, double speed) {
  Scene scene;
  const auto count = static_cast<std::uint32_t>(a_row * rows);
  scene.disks.species = {{of.two ? count - count / 2 : count, 1, 1}};
  if (of.two) scene.disks.species.push_back({count / 2, 0.7, 0.4});
  const bool loses = of.rule != Rule::elastic, rough = of.rule == Rule::rough;
  const auto surface = [&](double e, double friction, double tangential) {
    const RestitutionLaw law = of.two ? RestitutionLaw::power : RestitutionLaw::constant;
    return loses ? Surface{e, rough ? friction : 0, rough ? tangential : 0, law, 1.5} : Surface{};
  };
  scene.disks.contact = surface(0.85, 0.3, 0.4);
  scene.disks.inertia_ratio = 0.4;
  if (loses) scene.disks.contact_duration = 0.02;
  scene.box.floor_surface = surface(0.75, 0.5, -0.2);
  scene.rests = scene.presses = false;
  const double step = 1.3;
  scene.box.width = a_row * step + 0.4;
  const Surface side = surface(0.8, 0.2, 0.1);
  const bool slopes = of.space == Space::slopes, falls = of.space >= Space::hard;
  if (of.space == Space::periodic || of.space == Space::weightless_round || of.space == Space::round)
    scene.box.sides = PeriodicSides{};
  else
    scene.box.sides = HardSides{side, slopes ? 0.3 : 0};
  if (falls) scene.gravity = UniformGravity{}, scene.box.floor = SinusoidalFloor{0.4, 0.35};
  const double height = rows * step + 1.2;
  const Surface lid = surface(0.9, of.space == Space::free_lid ? 0 : 0.4, 0);
  if (of.space == Space::periodic) scene.box.top = PeriodicTop{height};
  if (of.space == Space::weightless_sides || of.space == Space::weightless_round || of.space == Space::lid || slopes)
    scene.box.top = Lid{height, lid};
  if (of.space == Space::free_lid) scene.box.top = Lid{height, lid, 3.5};
  Random random(20261127 + static_cast<std::uint64_t>(of.space) + 10 * static_cast<std::uint64_t>(of.rule) + of.two);
  const auto between = [&](double low, double high) { return low + (high - low) * random.uniform(); };
  PlacedStart start;
  for (int k = 0; k < a_row * rows; ++k) {
    const double x = 0.85 + step * (k % a_row), z = 1.05 + step * (k / a_row);
    start.disks.push_back({x + between(-0.1, 0.1), z + between(-0.1, 0.1), between(-speed, speed),
                           between(-speed, speed), rough ? between(-2, 2) : 0, of.two && k % 2 == 1 ? 1U : 0U});
  }
  scene.start = start;
  return scene;
}

void expect_exhaustive(const Scene& scene, double end, double tolerance) {
  ASSERT_TRUE(check(scene).empty()) << check(scene).front().what;
  const auto simulation = simulate(scene);
  ExhaustiveRun run(scene);
  for (const double part : {0.4, 1.0}) {
    simulation->advance_to(part * end);
    run.advance_to(part * end);
    Snapshot at;
    simulation->snapshot(at);
    const Counters counters = simulation->counters();
    const EnergyLedger energy = simulation->energy();
    ASSERT_EQ(counters.disk_collisions, run.pairs);
    ASSERT_EQ(counters.wall_collisions, run.walls);
    ASSERT_EQ(counters.floor_collisions, run.floors);
    EXPECT_EQ(counters.elastic_contacts, run.elastic);
    const auto near = [&](double found, Real expected, const char* what) {
      EXPECT_NEAR(found, static_cast<double>(expected), tolerance) << what;
    };
    const bool round = std::holds_alternative<PeriodicSides>(scene.box.sides);
    const auto* top = std::get_if<PeriodicTop>(&scene.box.top);
    Real kinetic = 0, potential = 0;
    for (std::size_t i = 0; i < run.bodies.size(); ++i) {
      const Body& b = run.bodies[i];
      near(round ? std::remainder(at.x[i] - static_cast<double>(b.x), scene.box.width)
                 : at.x[i] - static_cast<double>(b.x),
           0, "x");
      near(top != nullptr ? std::remainder(at.z[i] - static_cast<double>(b.z), top->height)
                          : at.z[i] - static_cast<double>(b.z),
           0, "z");
      EXPECT_TRUE(!round || (at.x[i] >= 0 && at.x[i] < scene.box.width)) << at.x[i];
      near(at.vx[i], b.vx, "vx"), near(at.vz[i], b.vz, "vz");
      if (!at.spin.empty()) near(at.spin[i], b.spin, "spin");
      kinetic += b.mass * (b.vx * b.vx + b.vz * b.vz) / 2;
      if (!at.spin.empty())
        kinetic += static_cast<Real>(scene.disks.inertia_ratio) * b.mass * b.radius * b.radius * b.spin * b.spin / 2;
      potential += b.mass * b.z;
    }
    const auto* lid = std::get_if<Lid>(&scene.box.top);
    if (lid != nullptr) near(at.lid_height, run.lid_height(), "lid");
    if (lid != nullptr && lid->is_free()) {
      near(at.lid_velocity, run.lid_velocity(), "lid");
      kinetic += lid->mass * run.lid_velocity() * run.lid_velocity() / 2, potential += lid->mass * run.lid_height();
    }
    const double many = tolerance * static_cast<double>(run.bodies.size());
    EXPECT_NEAR(energy.kinetic, static_cast<double>(kinetic), many);
    if (std::holds_alternative<Weightless>(scene.gravity)) potential = 0;
    EXPECT_NEAR(energy.potential, static_cast<double>(potential), many);
    EXPECT_NEAR(energy.dissipated, static_cast<double>(run.dissipated), many);
    EXPECT_NEAR(energy.floor_work, static_cast<double>(run.floor_work), many);
    EXPECT_NEAR(counters.virial, static_cast<double>(run.virial), many);
    EXPECT_NEAR(counters.withheld, static_cast<double>(run.withheld), many);
    EXPECT_LE(std::abs(energy.imbalance()), 1e-11);
    EXPECT_TRUE(simulation->foresees_contacts());
    EXPECT_LE(simulation->largest_overlap(), 1e-13);
  }
  EXPECT_GE(run.pairs, run.bodies.size());
}

class Exhaustive : public testing::TestWithParam<Space> {};

// Of few disks, which see one another across periodic sides, and of more, with cells beyond cells.
TEST_P(Exhaustive, SearchFindsTheSameHistory) {
  for (const Rule rule : {Rule::elastic, Rule::dissipative, Rule::rough}) {
    for (const bool two : {false, true}) {
      SCOPED_TRACE("rule " + std::to_string(static_cast<int>(rule)) + (two ? ", two species" : ", one species"));
      expect_exhaustive(scene_of({GetParam(), rule, two}, 4, 4, 1), 2.4, 1e-7);
      expect_exhaustive(scene_of({GetParam(), rule, two}, 9, 8, 1.5), 1.2, 1e-7);
    }
  }
}

std::string name_of_space(const testing::TestParamInfo<Space>& given) {
  constexpr std::array names = {"Periodic", "WeightlessSides", "WeightlessRound", "Hard", "Round",
                                "Lid",      "Slopes",          "FreeLid"};
  return names[static_cast<std::size_t>(given.param)];
}
INSTANTIATE_TEST_SUITE_P(Spaces, Exhaustive,
                         testing::Values(Space::periodic, Space::weightless_sides, Space::weightless_round, Space::hard,
                                         Space::round, Space::lid, Space::slopes, Space::free_lid),
                         name_of_space);

}  // namespace
}  // namespace shakebed::sim
