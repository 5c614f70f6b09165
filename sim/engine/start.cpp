
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "sim/engine/floor_motion.hpp"
#include "sim/engine/overlap.hpp"
#include "sim/engine/pressed_bed.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/start.hpp"
#include "sim/scene/scene.hpp"

namespace shakebed::sim {

namespace {

struct Point {
  double x, z;
};

// What the starts need to know of the scene, in plain numbers.
struct Room {
  double width, height;  // height infinite for an open box
  bool periodic_x, periodic_z;
  double diameter;  // of the largest disk
  double floor;     // position of the floor at time 0
  double slope;     // of the sides outwards [rad]
  std::uint32_t count;
};

Room room_of(const Scene& scene) {
  Room room{scene.box.width, INFINITY, false, false, 0, 0, 0, scene.count()};
  if (const auto* sides = std::get_if<HardSides>(&scene.box.sides)) room.slope = sides->slope;
  room.periodic_x = std::holds_alternative<PeriodicSides>(scene.box.sides);
  if (const auto* lid = std::get_if<Lid>(&scene.box.top)) room.height = lid->height;
  if (const auto* top = std::get_if<PeriodicTop>(&scene.box.top)) {
    room.height = top->height;
    room.periodic_z = true;
  }
  for (const Species& s : scene.disks.species) room.diameter = std::max(room.diameter, s.diameter);
  std::visit(
      [&](const auto& floor) {
        const FloorMotion motion(floor);
        room.floor = motion.position(0);
      },
      scene.box.floor);
  return room;
}

[[noreturn]] void no_room(const Room& room) {
  std::ostringstream out;
  out << room.count << " disks of up to " << room.diameter << " D do not fit into a box " << room.width << " D wide";
  if (!std::isinf(room.height)) out << " and " << room.height << " D high";
  out << ". Give fewer disks or a larger box";
  throw std::runtime_error(out.str());
}

[[noreturn]] void row_overlaps(std::uint32_t a_row, double spacing, double diameter) {
  std::ostringstream out;
  out << a_row << " disks a row are " << spacing << " D apart, but their diameter is up to " << diameter
      << " D. Give fewer disks a row and a spacing of at least " << diameter << ", or 0 for both: as many as fit";
  throw std::runtime_error(out.str());
}

// Staggered rows. A hard box: a row's disks and the next row's, shifted by half a spacing, use the whole width, and
// nothing touches. A row that exactly fills the width of a hard box would collide without end at the first instant.
std::vector<Point> hexagonal(const Room& room, const HexagonalStart& start) {
  const double d = room.diameter;
  constexpr double margin = 1e-9;  // the lowest row does not quite touch the floor, nor the highest the lid
  const double usable = room.periodic_x ? room.width : room.width - d;  // for centres
  std::uint32_t a_row = start.disks_a_row;
  std::uint32_t rows = 0;
  // Of a box as wide as one likes, so many are more than any row needs.
  const auto whole = [](double n) { return n >= 1 ? static_cast<std::uint32_t>(std::min(n, 1e9)) : 0U; };
  const auto spacing_of = [&](std::uint32_t n) { return usable / (room.periodic_x ? n : n - (n > 1 ? 0.5 : 0.0)); };
  const auto most_a_row = [&] {
    std::uint32_t n = std::max(1u, whole(usable / d + (room.periodic_x ? 0 : 0.5)));
    while (n > 1 && spacing_of(n) < d * (1 + 1e-4)) --n;
    return n;
  };
  if (std::isinf(room.height)) {
    if (a_row == 0) a_row = start.spacing > 0 ? whole(usable / (start.spacing * d)) : most_a_row();
    rows = (room.count + a_row - 1) / std::max(a_row, 1u);
  } else {
    // Fill the box evenly: the number a row for which the cells come out closest to regular hexagons.
    const double height = room.periodic_z ? room.height : room.height - d * (1 + margin) - room.floor;
    if (a_row == 0) {
      const double side = std::sqrt(usable * height / room.count * 2 / std::numbers::sqrt3);
      a_row = std::max(1u, whole(std::round(usable / side)));
      if (spacing_of(a_row) < d) a_row = most_a_row();
    }
    rows = (room.count + a_row - 1) / a_row;
    if (room.periodic_z && rows % 2 == 1) ++rows;
  }
  if (a_row == 0) no_room(room);
  const double a = start.spacing > 0 && std::isinf(room.height) ? start.spacing * d : spacing_of(a_row);
  const double touching = d * d * (1 + 1e-6) - a * a / 4;  // squared distance of rows that just do not touch
  double row_height = std::max(std::sqrt(std::max(touching, 0.0)), d / 2 * (1 + 1e-6));  // of every other row: d
  if (!std::isinf(room.height)) {
    const double height = room.periodic_z ? room.height : room.height - d * (1 + margin) - room.floor;
    const double even = room.periodic_z ? height / rows : (rows > 1 ? height / (rows - 1) : height);
    if (even * even < d * d - a * a / 4 || (rows > 2 && even < d / 2)) no_room(room);
    row_height = even;
  }
  if (a_row > 1 && a < d) row_overlaps(a_row, a, d);
  std::vector<Point> points;
  for (std::uint32_t k = 0; k < room.count; ++k) {
    const std::uint32_t row = k / a_row, place = k % a_row;
    const double x0 = room.periodic_x ? 0.25 * a : d / 2;
    const double z0 = room.periodic_z ? row_height / 2 : room.floor + d / 2 * (1 + margin);
    points.push_back({x0 + (place + 0.5 * (row % 2)) * a, z0 + row * row_height});
  }
  return points;
}

// Random sequential insertion of the species in order of size, largest first.
std::vector<Point> random_insertion(const Room& room, const RandomStart& start, const std::vector<double>& diameters,
                                    Random& random) {
  double area = 0;
  for (double d : diameters) area += std::numbers::pi / 4 * d * d;
  const double low = room.periodic_z ? 0 : room.floor;
  double high = start.height > 0 ? start.height : low + area / (0.3 * room.width) + room.diameter;
  if (!std::isinf(room.height)) high = start.height > 0 ? std::min(start.height, room.height) : room.height;
  std::vector<std::size_t> order(diameters.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t l, std::size_t r) { return diameters[l] > diameters[r]; });

  // Cells of a diameter at least; a box with much room must not make many more of them than there are disks.
  const double cell = room.diameter, most = 16.0 * static_cast<double>(diameters.size()) + 64;
  const auto columns = static_cast<std::int64_t>(std::clamp(std::floor(room.width / cell), 1.0, most));
  const auto rows = static_cast<std::int64_t>(
      std::clamp(std::floor((high - low) / cell), 1.0, std::max(1.0, most / static_cast<double>(columns))));
  std::vector<std::vector<std::size_t>> cells(static_cast<std::size_t>(columns * rows));
  std::vector<Point> points(diameters.size());
  const auto cell_index = [](double value, double range, std::int64_t n) {
    return std::clamp(static_cast<std::int64_t>(value / range * static_cast<double>(n)), std::int64_t{0}, n - 1);
  };
  for (std::size_t i : order) {
    const double r = diameters[i] / 2;
    bool placed = false;
    for (int attempt = 0; attempt < 20'000 && !placed; ++attempt) {
      const double x = room.periodic_x ? room.width * random.uniform() : r + (room.width - 2 * r) * random.uniform();
      const double z =
          room.periodic_z ? room.height * random.uniform() : low + r + (high - low - 2 * r) * random.uniform();
      const std::int64_t column = cell_index(x, room.width, columns), row = cell_index(z - low, high - low, rows);
      bool free = true;
      for (std::int64_t dr = -2; dr <= 2 && free; ++dr) {
        for (std::int64_t dc = -2; dc <= 2 && free; ++dc) {
          const std::int64_t c = (column + dc + 2 * columns) % columns, w = (row + dr + 2 * rows) % rows;
          for (std::size_t k : cells[static_cast<std::size_t>(w * columns + c)]) {
            double dx = points[k].x - x, dz = points[k].z - z;
            if (room.periodic_x) dx -= room.width * std::nearbyint(dx / room.width);
            if (room.periodic_z) dz -= room.height * std::nearbyint(dz / room.height);
            const double reach = (diameters[k] + diameters[i]) / 2;
            if (dx * dx + dz * dz < reach * reach * (1 + 1e-9)) free = false;
          }
        }
      }
      if (!free) continue;
      points[i] = {x, z};
      cells[static_cast<std::size_t>(row * columns + column)].push_back(i);
      placed = true;
    }
    if (!placed)
      throw std::runtime_error(
          "random insertion found no place for a disk after 20,000 attempts; choose the hexagonal start, or give a "
          "larger box");
  }
  return points;
}

void check_placed(const Scene& scene, const std::vector<Placed>& disks) {
  const Room room = room_of(scene);
  Snapshot at;
  std::vector<double> radii;
  for (std::size_t i = 0; i < disks.size(); ++i) {
    const Placed& p = disks[i];
    if (p.species >= scene.disks.species.size())
      throw std::runtime_error("disk " + std::to_string(i) + " of the start has a species that is not defined");
    const double r = scene.disks.species[p.species].diameter / 2;
    const double spread = room.slope > 0 ? (p.z - room.floor) * std::tan(room.slope) : 0;
    const double from_wall = r / std::cos(room.slope) - spread;
    const bool outside = (!room.periodic_x && (p.x < from_wall - 1e-12 * room.width ||
                                               p.x > room.width - from_wall + 1e-12 * room.width)) ||
                         (!room.periodic_z && (p.z < room.floor + r - 1e-12 || p.z > room.height - r + 1e-12));
    if (outside || !std::isfinite(p.x) || !std::isfinite(p.z) || !std::isfinite(p.vx) || !std::isfinite(p.vz)) {
      std::ostringstream out;
      out << "disk " << i << " of the start, at (" << p.x << ", " << p.z << ") D, is not inside the box";
      throw std::runtime_error(out.str());
    }
    at.x.push_back(p.x);
    at.z.push_back(p.z);
    radii.push_back(scene.disks.species[p.species].diameter / 2);
  }
  const double overlap =
      largest_overlap(at, radii, room.periodic_x ? room.width : 0, room.periodic_z ? room.height : 0);
  if (overlap > 1e-10) {
    std::ostringstream out;
    out << "two disks of the start overlap by " << overlap << " D";
    throw std::runtime_error(out.str());
  }
}

// A start may be the frame of a bed that was pressed on the floor, whose disks overlap by less than soft_overlap. They
// are moved apart. Where more overlaps nothing is changed, and check_placed() says so. Beds between sloped sides are
// never pressed: their disks may lie where vertical sides would not let them.
void move_apart(const Scene& scene, std::vector<Placed>& disks) {
  constexpr double most = 1e-13;
  constexpr int sweeps = 100'000;
  const Room room = room_of(scene);
  if (!scene.presses || room.periodic_z || room.slope > 0 || scene.disks.species.size() != 1) return;
  Snapshot at;
  std::vector<PressedBed::State> states;
  double deepest = 0;
  for (const Placed& p : disks) {
    if (!std::isfinite(p.x) || !std::isfinite(p.z)) return;
    at.x.push_back(p.x);
    at.z.push_back(p.z);
    states.push_back({p.x, p.z, 0, 0});
    deepest = std::max({deepest, room.floor + 0.5 - p.z, p.z + 0.5 - room.height});
    if (!room.periodic_x) deepest = std::max({deepest, 0.5 - p.x, p.x + 0.5 - room.width});
  }
  const std::vector<double> radii(disks.size(), 0.5);
  deepest = std::max(deepest, largest_overlap(at, radii, room.periodic_x ? room.width : 0, 0));
  if (deepest <= most || deepest > soft_overlap) return;
  PressedBed bed;
  bed.set_up({room.width, room.periodic_x ? room.width : 0, room.height}, {});
  bed.begin(states, {room.floor, 0, 0}, 1);
  bed.separate(room.floor, most, sweeps);
  for (std::size_t i = 0; i < disks.size(); ++i) {
    const PressedBed::State state = bed.at(static_cast<std::uint32_t>(i), 0);
    disks[i].x = state.x;
    disks[i].z = state.z;
  }
}

// Maxwellian velocities at T; in a weightless box with no net momentum and exactly this T.
void give_velocities(const Scene& scene, std::vector<Placed>& disks, Random& random) {
  const double t = scene.start_temperature;
  const auto mass = [&](const Placed& p) { return scene.disks.species[p.species].mass; };
  for (Placed& p : disks) {
    const Random::Pair draw = random.normal_pair();
    const double speed = std::sqrt(t / mass(p));
    p.vx = speed * draw.first;
    p.vz = speed * draw.second;
  }
  if (!std::holds_alternative<Weightless>(scene.gravity) || disks.size() < 2) return;
  double px = 0, pz = 0, total = 0, energy = 0;
  for (const Placed& p : disks) {
    px += mass(p) * p.vx;
    pz += mass(p) * p.vz;
    total += mass(p);
  }
  for (Placed& p : disks) {
    p.vx -= px / total;
    p.vz -= pz / total;
    energy += mass(p) * (p.vx * p.vx + p.vz * p.vz) / 2;
  }
  const double factor = energy > 0 ? std::sqrt(t * static_cast<double>(disks.size()) / energy) : 0;
  for (Placed& p : disks) {
    p.vx *= factor;
    p.vz *= factor;
  }
}

}  // namespace

std::vector<Placed> place_disks(const Scene& scene) {
  if (const auto* placed = std::get_if<PlacedStart>(&scene.start)) {
    std::vector<Placed> disks = placed->disks;
    move_apart(scene, disks);
    check_placed(scene, disks);
    return disks;
  }
  Random random(scene.seed);
  const Room room = room_of(scene);
  std::vector<std::uint32_t> species;
  for (std::uint32_t s = 0; s < scene.disks.species.size(); ++s)
    species.insert(species.end(), scene.disks.species[s].count, s);
  if (scene.disks.species.size() > 1) {
    for (std::size_t i = species.size(); i > 1; --i)
      std::swap(species[i - 1], species[random.below(static_cast<std::uint32_t>(i))]);
  }
  std::vector<Point> points;
  if (const auto* hex = std::get_if<HexagonalStart>(&scene.start)) {
    points = hexagonal(room, *hex);
  } else {
    std::vector<double> diameters;
    for (std::uint32_t s : species) diameters.push_back(scene.disks.species[s].diameter);
    points = random_insertion(room, std::get<RandomStart>(scene.start), diameters, random);
  }
  std::vector<Placed> disks;
  for (std::size_t i = 0; i < points.size(); ++i) disks.push_back({points[i].x, points[i].z, 0, 0, 0, species[i]});
  give_velocities(scene, disks, random);
  check_placed(scene, disks);
  return disks;
}

}  // namespace shakebed::sim
