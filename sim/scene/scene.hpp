// What can be simulated: a plain description, every physical choice a variant. Reduced units: lengths in D (the
// diameter of species 0), masses in m (its mass), accelerations in g; a weightless scene has T = 1 at the start
// instead.
//
// Plain data: a scene owns what it holds, and copies are independent. Any number of threads may read one.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "sim/scene/floor.hpp"
#include "sim/scene/surface.hpp"

namespace shakebed::sim {

// --- gravity
struct Weightless {};
struct UniformGravity {};  // 1, downwards
using Gravity = std::variant<Weightless, UniformGravity>;

// --- disks
struct Species {
  std::uint32_t count = 0;
  double diameter = 1;
  double mass = 1;
};
struct Disks {
  std::vector<Species> species{};  // one or two; the first has diameter 1 and mass 1
  Surface contact{};               // disk against disk
  double inertia_ratio = 0.5;      // q = I/(m R^2): 1/2 disk, 2/5 sphere
  double contact_duration = 0;     // t_c of the TC model [LudingMcNamara1998], 0 for none
};

// --- the box: x from 0 to width; the floor's mean position is z = 0
struct HardSides {
  Surface surface;
  // Angle from the vertical by which the sides lean outwards [rad]; the box is `width` wide at the floor. Sloped sides
  // move with the floor, vertical ones stand still.
  double slope = 0;
};
struct PeriodicSides {};
using Sides = std::variant<HardSides, PeriodicSides>;

struct OpenTop {};
// A wall at rest, or one of finite mass that falls and flies freely up and down, from rest at that height.
struct Lid {
  double height = 0;  // of its lower face above the floor's mean; of a free lid at the start
  Surface surface;
  double mass = std::numeric_limits<double>::infinity();
  bool is_free() const { return mass < std::numeric_limits<double>::infinity(); }
};
struct PeriodicTop {  // periodic upwards too: no floor at all
  double height = 0;
};
using Top = std::variant<OpenTop, Lid, PeriodicTop>;

// The plates between which the disks are.
struct SmoothPlates {};
// A disk that moves against a plate is slowed down by `deceleration`, the friction coefficient times the acceleration
// that presses it on the plate. One that rests on it stays there while nothing pulls more. Where its contact with the
// plate has a radius, the plate also brakes its spin: the contact is pressed evenly [FarkasEtAl2003].
struct RubbingPlates {
  double deceleration = 0;
  double interval = 0.01;     // at which the friction acts
  bool follow_floor = true;   // the plates move with the floor; else they stand still
  double contact_radius = 0;  // of each disk with the plate; 0: the spin is not braked
};
using Plates = std::variant<SmoothPlates, RubbingPlates>;

using Floor = std::variant<StillFloor, SinusoidalFloor, TabulatedFloor>;

struct Box {
  double width = 0;
  Sides sides{};
  Top top{};
  Floor floor{};
  Surface floor_surface{};
  Plates plates{};
};

// --- reservoirs
struct NoBath {};
// Every `interval`: v -> v exp(-rate interval) + sqrt(T (1 - exp(-2 rate interval)) / m) xi.
struct LangevinBath {
  double temperature = 0, rate = 0, interval = 0;
};
// Each disk's velocity is drawn anew from the Maxwellian at T at random moments, `rate` a disk and unit of time.
struct AndersenBath {
  double temperature = 0, rate = 0;
};
// Every `interval`: v -> v + sqrt(heating interval / m) xi, H = heating [WilliamsMacKintosh1996].
struct WhiteNoiseBath {
  double heating = 0, interval = 0;
  bool conserve_momentum = true;  // the mean kick is taken away
};
// A disk leaves the floor with a velocity drawn from the flux of a gas at T.
struct ThermalFloor {
  double temperature = 0;
};
using Bath = std::variant<NoBath, LangevinBath, AndersenBath, WhiteNoiseBath, ThermalFloor>;

// --- start
// Rows of a hexagonal packing from the floor up (or filling a periodic box). Each gap is `spacing` diameters. With 0 it
// is chosen so that every row holds as many disks as fit, alternately n and n or n and n-1.
struct HexagonalStart {
  std::uint32_t disks_a_row = 0;  // 0: as many as fit
  double spacing = 0;
};
struct RandomStart {  // sequential random insertion
  double height = 0;  // up to here (0: chosen for area fraction 0.3, or the lid)
};
struct Placed {
  double x, z, vx, vz, spin;
  std::uint32_t species;
};
struct PlacedStart {
  std::vector<Placed> disks;
};
using Start = std::variant<HexagonalStart, RandomStart, PlacedStart>;

struct Scene {
  Gravity gravity{};
  Disks disks{};
  Box box{};
  Bath bath{};
  Start start{};
  // A dissipative bed with contact clocks that has come to rest on the floor lies there (engine_rest.hpp).
  bool rests = true;
  // One of equal disks that is pressed on the floor goes on as one of soft disks (engine_press.hpp).
  bool presses = true;
  double start_temperature = 1;  // of the Maxwellian velocities at the start (placed disks keep their own)
  std::uint64_t seed = 1;

  std::uint32_t count() const;
};

// Why the scene cannot be simulated, one sentence each with its numbers, the part of the scene it speaks of first
// ("/box/width: ..."); empty when it can.
struct SceneProblem {
  std::string where;  // like a JSON pointer into Scene
  std::string what;
};
std::vector<SceneProblem> check(const Scene& scene);

}  // namespace shakebed::sim
