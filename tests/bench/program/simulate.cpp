// The simulator: collisions a second, error of the compressibility against collisions, the contact clock as a dial,
// growth with the number of disks, hard cases.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <utility>

#include "sim/engine/checkpoint_bytes.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"
#include "tests/bench/program/results.hpp"

namespace shakebed::pipelines::bench {
namespace {

// Elastic, weightless and periodic: rows x rows disks (rows even) at an area fraction.
sim::Scene fluid(std::uint32_t rows, double area_fraction, std::uint64_t seed = 1) {
  const double spacing = std::sqrt(std::numbers::pi / 4 / area_fraction * 2 / std::numbers::sqrt3);
  sim::Scene scene;
  scene.gravity = sim::Weightless{};
  scene.disks.species = {{rows * rows, 1, 1}};
  scene.box.width = rows * spacing;
  scene.box.sides = sim::PeriodicSides{};
  scene.box.top = sim::PeriodicTop{rows * spacing * std::numbers::sqrt3 / 2};
  scene.start = sim::HexagonalStart{rows, 0};
  scene.seed = seed;
  return scene;
}

// Until every disk has suffered so many collisions on average.
void equilibrate(sim::Simulation& simulation, double collisions_a_disk, const Effort& effort) {
  const auto count = static_cast<double>(simulation.properties().radius.size());
  while (2 * static_cast<double>(simulation.counters().disk_collisions) < collisions_a_disk * count) {
    effort.check_interrupted();
    simulation.advance_to(simulation.time() + 0.25);
  }
}

// The bed that an independent soft-sphere simulation also did: 306 disks 2.99 mm wide, restitution 0.92, 20 Hz.
struct Bed {
  static constexpr double diameter = 2.99e-3, gravity = 9.81, frequency = 20, amplitude = 2.5e-3;  // SI
  static double time_unit() { return std::sqrt(diameter / gravity); }
  static sim::Scene scene(double contact_duration_s, double restitution = 0.92, std::uint64_t seed = 1) {
    sim::Scene scene;
    scene.gravity = sim::UniformGravity{};
    scene.disks.species = {{306, 1, 1}};
    scene.disks.contact = {restitution, 0, 0};
    scene.disks.contact_duration = contact_duration_s / time_unit();
    scene.box.width = 30;
    scene.box.sides = sim::HardSides{{restitution, 0, 0}};
    scene.box.floor = sim::SinusoidalFloor{amplitude / diameter, frequency * time_unit()};
    scene.box.floor_surface = {restitution, 0, 0};
    scene.start_temperature = 0.01;
    scene.seed = seed;
    return scene;
  }
};

struct BedRun {
  sim::Measured rise, temperature_x;  // D; m g D
  double cpu_per_period = 0, collisions_per_second = 0;
  double elastic_share = 0;  // of the contacts, made elastic by the clock
  double energy_error = 0, overlap = 0;
};

// Processor time and collisions of a run from its first look on, without the time that observers take: `starts` is the
// last of them, `stops` the first.
struct RunCost {
  class Part final : public sim::RunObserver {
   public:
    using Do = std::function<void(sim::Simulation&)>;
    explicit Part(Do at_look) : at_look_(std::move(at_look)) {}
    void look(sim::Simulation& simulation, const sim::Snapshot&, std::uint64_t, std::uint32_t) override {
      at_look_(simulation);
    }
    void end(sim::Simulation& simulation) override { at_look_(simulation); }
    void save(sim::ArchiveWriter&) override {}  // these runs are never kept
    void load(sim::ArchiveReader&) override {}

   private:
    Do at_look_;
  };
  double cpu = 0;  // [s]
  std::uint64_t collisions = 0;
  double started = 0;  // 0: not yet
  std::uint64_t collisions_before = 0;
  Part stops{[this](sim::Simulation& simulation) {
    if (started > 0) cpu += cpu_seconds() - started;
    collisions = simulation.counters().collisions() - collisions_before;
  }};
  Part starts{[this](sim::Simulation& simulation) {
    if (started == 0) collisions_before = simulation.counters().collisions();
    started = cpu_seconds();
  }};
};

BedRun run_bed(const sim::Scene& scene, std::uint64_t periods, const Effort& effort) {
  constexpr double settling = 100;  // periods
  const double period = 1 / std::get<sim::SinusoidalFloor>(scene.box.floor).frequency;
  sim::Observing<sim::BedObserver> bed([&](const sim::DiskProperties& disks) {
    return sim::BedObserver(scene, disks, 32, {-2, 0.25, 240}, measuring_kernel);
  });
  RunCost cost;
  sim::RunControl control;
  control.stop = [&] { return effort.check_interrupted(), false; };
  const sim::RunResult done =
      sim::measure(scene, {.bath = {}, .settle = settling * period, .period = period, .periods = periods, .phases = 32},
                   {&cost.stops, &bed, &cost.starts}, control);
  BedRun run;
  run.rise = bed->centre_of_mass();
  run.rise.value -= sim::ideal_centre_of_mass(scene.count(), scene.box.width, true);
  run.temperature_x = bed->temperature_x();
  const sim::Counters counters = done.simulation->counters();
  const sim::EnergyLedger energy = done.simulation->energy();
  run.cpu_per_period = cost.cpu / static_cast<double>(periods);
  run.collisions_per_second = static_cast<double>(cost.collisions) / cost.cpu;
  run.elastic_share = static_cast<double>(counters.elastic_contacts) / static_cast<double>(counters.collisions());
  run.energy_error = std::abs(energy.imbalance()) / energy.dissipated;
  run.overlap = done.simulation->largest_overlap();
  return run;
}

void speed_and_growth(const Effort& effort, StageResult& result) {
  Table table{"The fluid at area fraction 0.70, after at least 100 collisions a disk",
              "energy drift: relative, over all collisions so far; overlap: the largest of any two disks at the end",
              {"N", "collisions/s", "events/s", "bytes/disk", "energy drift", "overlap [D]", "us/collision"},
              {}};
  std::vector<double> counts, memory, cost;
  for (const std::uint32_t rows : effort.quick ? std::vector<std::uint32_t>{10, 32, 100, 316}
                                               : std::vector<std::uint32_t>{10, 32, 100, 316, 1000}) {
    effort.step(fmt::format("simulate: {} disks", rows * rows));
    const auto simulation = sim::simulate(fluid(rows, 0.70));
    const double n = static_cast<double>(rows) * rows, energy = simulation->energy().kinetic;
    equilibrate(*simulation, 100, effort);
    const sim::Counters before = simulation->counters();
    const double wanted = effort.quick ? 2e6 : 2e7;
    double cpu = 0;
    while (static_cast<double>(simulation->counters().collisions() - before.collisions()) < wanted) {
      effort.check_interrupted();
      cpu += cpu_seconds_of([&] { simulation->advance_to(simulation->time() + std::max(0.25, 1e5 / (8 * n))); });
    }
    const sim::Counters after = simulation->counters();
    const auto collisions = static_cast<double>(after.collisions() - before.collisions());
    const double rate = collisions / cpu, bytes = static_cast<double>(simulation->bytes()) / n;
    table.rows.push_back({rows * rows, rate, static_cast<double>(after.events() - before.events()) / cpu, bytes,
                          std::abs(simulation->energy().kinetic / energy - 1), simulation->largest_overlap(),
                          1e6 / rate});
    counts.push_back(n), memory.push_back(bytes * n), cost.push_back(n / rate);
    result.metrics.push_back({fmt::format("collisions/s, {} disks", rows * rows), "1/s", rate, true});
    result.metrics.push_back({fmt::format("bytes a disk, {} disks", rows * rows), "B", bytes, false});
  }
  const double time_exponent = exponent(counts, cost).value_or(0),
               memory_exponent = exponent(counts, memory).value_or(0);
  table.note +=
      fmt::format("; cost of a collision a disk grows as N^{:.2f}, memory as N^{:.2f}", time_exponent, memory_exponent);
  result.tables.push_back(std::move(table));
  result.figures.push_back({"growth-simulate",
                            "One collision a disk, and memory, against the number of disks",
                            "disks",
                            "CPU s (collision a disk); GB (memory)",
                            {{"CPU seconds", counts, cost},
                             {"memory [GB]", counts,
                              [&] {
                                std::vector<double> gb;
                                for (double b : memory) gb.push_back(b / 1e9);
                                return gb;
                              }()}},
                            false});
}

// A stretch of a run: its collisions, what they add to the virial, its time.
struct Stretch {
  double collisions = 0, virial = 0, time = 0;
};

struct LongRun {
  std::vector<Stretch> stretches;
  double disks = 0, temperature = 0, collisions = 0, cpu = 0;
};

LongRun run_fluid(std::uint32_t rows, double density, const Effort& effort) {
  const auto simulation = sim::simulate(fluid(rows, std::numbers::pi / 4 * density, 7 + rows));
  equilibrate(*simulation, 200, effort);
  LongRun run;
  run.disks = static_cast<double>(rows) * rows, run.temperature = simulation->energy().kinetic / (run.disks - 1);
  const double total = effort.quick ? 1.2e7 : 2e8, step = 1000 / (4 * run.disks);
  sim::Counters before = simulation->counters();
  double then = simulation->time();
  run.cpu = cpu_seconds_of([&] {
    while (run.collisions < total) {
      effort.check_interrupted();
      simulation->advance_to(simulation->time() + step);
      const sim::Counters now = simulation->counters();
      run.stretches.push_back({static_cast<double>(now.disk_collisions - before.disk_collisions),
                               now.virial - before.virial, simulation->time() - then});
      run.collisions += run.stretches.back().collisions;
      before = now, then = simulation->time();
    }
  });
  return run;
}

std::vector<Stretch> joined_by_four(const std::vector<Stretch>& stretches) {
  std::vector<Stretch> joined;
  for (std::size_t i = 0; i + 3 < stretches.size(); i += 4) {
    Stretch sum;
    for (std::size_t k = i; k < i + 4; ++k)
      sum.collisions += stretches[k].collisions, sum.virial += stretches[k].virial, sum.time += stretches[k].time;
    joined.push_back(sum);
  }
  return joined;
}

// Of Z, relative, of a stretch.
double rms_error(const LongRun& run, const std::vector<Stretch>& stretches, double reference) {
  double squares = 0;
  for (const Stretch& s : stretches) {
    const double z = 1 + s.virial / s.time / (2 * run.disks * run.temperature);
    squares += (z / reference - 1) * (z / reference - 1);
  }
  return std::sqrt(squares / static_cast<double>(stretches.size()));
}

// Error of Z in stretches of C collisions, over the many stretches of one long run, against the simulated value of
// Kolafa and Rottner [KolafaRottner2006].
void error_against_collisions(const Effort& effort, StageResult& result) {
  constexpr double density = 0.50, reference = 2.7601235;  // n D^2; Z
  Figure figure{"simulate-error",
                "Compressibility at number density 0.50: error against cost",
                "CPU seconds",
                "relative error of Z, rms",
                {}};
  Table table{"Error of Z at number density n D^2 = 0.50",
              "rms over the stretches of a run, against 2.7601235; limit: collisions independent of one another, "
              "(Z-1)/Z sqrt(4/pi)/sqrt(C); a curve levels off where the finite number of disks is felt",
              {"N", "collisions", "CPU s", "rms error", "limit", "stretches"},
              {}};
  const double limit = (reference - 1) / reference * std::sqrt(4 / std::numbers::pi);
  double rate_best = 0;
  for (const std::uint32_t rows : {16U, 32U, 64U}) {
    effort.step(fmt::format("simulate: error of Z, {} disks", rows * rows));
    const LongRun run = run_fluid(rows, density, effort);
    rate_best = std::max(rate_best, run.collisions / run.cpu);
    Curve curve{fmt::format("{} disks", rows * rows), {}, {}};
    for (std::vector<Stretch> stretches = run.stretches; stretches.size() >= 4; stretches = joined_by_four(stretches)) {
      double collisions = 0;
      for (const Stretch& s : stretches) collisions += s.collisions / static_cast<double>(stretches.size());
      curve.cost.push_back(run.cpu * collisions / run.collisions);
      curve.error.push_back(rms_error(run, stretches, reference));
      table.rows.push_back({rows * rows, std::round(collisions), curve.cost.back(), curve.error.back(),
                            limit / std::sqrt(collisions), stretches.size()});
    }
    figure.curves.push_back(std::move(curve));
  }
  Curve bound{"independent collisions", {}, {}};
  bound.limit = true;
  for (double c = 300; c < 1e9; c *= 10) {
    if (c > figure.curves.front().cost.back() * rate_best * 10) break;
    bound.cost.push_back(c / rate_best), bound.error.push_back(limit / std::sqrt(c));
  }
  figure.curves.push_back(std::move(bound));
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(table));
}

void contact_clock(const Effort& effort, StageResult& result) {
  const std::uint64_t periods = effort.quick ? 300 : 4000;
  Table table{
      "The shaken bed (306 disks, restitution 0.92, Gamma = 4.02, 20 Hz), by contact duration",
      fmt::format("{} periods each; an independent soft-sphere simulation of this bed has a rise of 2.867 D and "
                  "T_x/(m g) = 3.076 mm, 2.850 D and 3.028 mm with the stiffest contacts; 1 us is what recipes use",
                  periods),
      {"contact duration [s]", "rise [D]", "+-", "T_x/(m g) [mm]", "+-", "elastic contacts", "ms/period",
       "collisions/s", "energy error", "overlap [D]"},
      {}};
  Figure figure{"simulate-contact-clock",
                "Contact duration as a dial: change of the rise against the shortest, and cost",
                "CPU seconds a period",
                "change of the rise [D]",
                {}};
  Curve curve{"contact duration 1 ms (left or top) to 10 ns", {}, {}}, noise{"two standard errors, at 1 us", {}, {}};
  noise.limit = true;
  std::optional<sim::Measured> shortest;
  for (const double duration : {1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3}) {
    effort.step(fmt::format("simulate: shaken bed, contact duration {:g} s", duration));
    const BedRun run = run_bed(Bed::scene(duration), periods, effort);
    table.rows.push_back({duration, run.rise.value, run.rise.std_error, run.temperature_x.value * Bed::diameter * 1e3,
                          run.temperature_x.std_error * Bed::diameter * 1e3, run.elastic_share,
                          run.cpu_per_period * 1e3, run.collisions_per_second, run.energy_error, run.overlap});
    if (!shortest) {
      shortest = run.rise;
    } else {
      curve.cost.push_back(run.cpu_per_period), curve.error.push_back(std::abs(run.rise.value - shortest->value));
    }
    if (duration == 1e-6) {
      noise.error.assign(2, 2 * std::hypot(run.rise.std_error, shortest->std_error));
      curve.standard = curve.cost.size() - 1;
      result.metrics.push_back({"shaken bed, CPU a period", "s", run.cpu_per_period, false});
      result.metrics.push_back({"shaken bed, collisions/s", "1/s", run.collisions_per_second, true});
      result.sentences.push_back(fmt::format(
          "The shaken bed of 306 disks costs {:.2f} ms of CPU a period; a run of 10 minutes of shaking at 20 Hz takes "
          "{:.0f} s.",
          1e3 * run.cpu_per_period, 12000 * run.cpu_per_period));
    }
  }
  const auto [cheapest, dearest] = std::minmax_element(curve.cost.begin(), curve.cost.end());
  noise.cost = {*cheapest, *dearest};
  figure.curves = {std::move(curve), std::move(noise)};
  figure.pareto = false;
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(table));
}

// --- hard cases

double relative_imbalance(const sim::Simulation& simulation) {
  const sim::EnergyLedger e = simulation.energy();
  const double scale =
      std::max({std::abs(e.initial), e.kinetic + std::abs(e.potential), e.dissipated, std::abs(e.floor_work)});
  return std::abs(e.imbalance()) / scale;
}

// Largest overlap [D]: of hard disks by rounding, of a bed that is pressed on the floor by its springs.
constexpr double hard_overlap = 1e-9, pressed_overlap = 2.5e-3;

// Runs to a time; the error is the energy that does not close, the overlap is judged with it.
void run_scene(HardCase& one, const sim::Scene& scene, double until, const Effort& effort,
               double most_overlap = hard_overlap) {
  const auto problems = sim::check(scene);
  if (!problems.empty()) {
    one.status = "refused", one.note = problems.front().where + ": " + problems.front().what;
    one.pass = false;
    return;
  }
  const auto simulation = sim::simulate(scene);
  const double start = cpu_seconds();
  while (simulation->time() < until && cpu_seconds() - start < one.time_limit) {
    effort.check_interrupted();
    simulation->advance_to(std::min(until, simulation->time() + until / 20000));
  }
  if (simulation->time() < until) {
    one.status = "stopped", one.pass = false,
    one.note = fmt::format("at time {:.4g} of {:g}", simulation->time(), until);
    return;
  }
  one.error = relative_imbalance(*simulation);
  const double overlap = simulation->largest_overlap();
  one.note += fmt::format("{}{} contacts, overlap {:.1e} D", one.note.empty() ? "" : "; ",
                          simulation->counters().collisions(), overlap);
  if (!(overlap <= most_overlap)) one.pass = false;
}

// Of hard disks, pressed or not: what is hard to follow by events.
sim::Scene pile(std::uint32_t count, double width, double restitution, double contact_duration) {
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{count, 1, 1}};
  scene.disks.contact = {restitution, 0, 0};
  scene.disks.contact_duration = contact_duration;
  scene.box.width = width;
  scene.box.sides = sim::HardSides{{restitution, 0, 0}};
  scene.box.floor_surface = {restitution, 0, 0};
  scene.start_temperature = 1;
  scene.presses = false;
  return scene;
}

sim::Scene pressed(sim::Scene scene) {
  scene.presses = true;
  return scene;
}

// Of any disk's place.
double largest_difference(const sim::Simulation& one, const sim::Simulation& other) {
  sim::Snapshot a, b;
  one.snapshot(a), other.snapshot(b);
  double difference = 0;
  for (std::size_t i = 0; i < a.x.size(); ++i)
    difference = std::max({difference, std::abs(a.x[i] - b.x[i]), std::abs(a.z[i] - b.z[i])});
  return difference;
}

// A disk that rests has a contact each contact duration: that, not a time step, is what piles cost here.
class HardScenes {
 public:
  HardScenes(const Effort& effort, StageResult& result) : effort_(effort), result_(result) {}

  void run() {
    effort_.step("simulate: hard cases");
    beds_at_rest();
    shaken_disks();
    lattices();
    contacts_at_one_instant();
    two_species();
    few_disks();
    late_clock();
    checkpoint();
  }

 private:
  void add(const std::string& name, double limit, double time_limit, const std::function<void(HardCase&)>& work) {
    effort_.check_interrupted();
    if (effort_.console != nullptr) effort_.console->detail("bench: simulate: " + name);
    result_.hard_cases.push_back(run_hard_case(name, "energy", limit, time_limit, work));
  }

  void beds_at_rest() {
    add("inelastic collapse: pile comes to rest, contact clock", 1e-10, 10,
        [&](HardCase& one) { run_scene(one, pile(200, 15, 0.5, 1e-3), 30, effort_); });
    add("the same, pressed on the floor as soft disks", 1e-10, 10,
        [&](HardCase& one) { run_scene(one, pressed(pile(200, 15, 0.5, 1e-3)), 30, effort_, pressed_overlap); });
    // Infinitely many contacts in a finite time, which no run can follow: it must stop and say why.
    add("inelastic collapse: the same without a contact clock", 0, 10, [&](HardCase& one) {
      try {
        run_scene(one, pile(200, 15, 0.5, 0), 5, effort_);
        one.pass = false, one.status = "ran on";
      } catch (const std::runtime_error& stopped) {
        one.note = stopped.what();
        one.pass = one.note.find("inelastic collapse") != std::string::npos;
        one.status = one.pass ? "refused" : "failed";
      }
    });
    add("restitution 0", 1e-10, 10, [&](HardCase& one) { run_scene(one, pile(100, 15, 0, 1e-3), 20, effort_); });
    add("a column of 300 disks, one wide", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(300, 1.2, 0.95, 1e-3);
      run_scene(one, scene, 10, effort_);
    });
  }

  void shaken_disks() {
    for (const double offset : {-1e-12, 1e-12}) {
      add(fmt::format("one disk on a floor at Gamma = 1 {} 1e-12", offset < 0 ? "-" : "+"), 1e-9, 10,
          [&](HardCase& one) {
            // At rest for half of every period: a contact each contact duration.
            sim::Scene scene = pile(1, 5, 0.5, 0.01);
            const double frequency = 0.5, w = 2 * std::numbers::pi * frequency;
            scene.box.floor = sim::SinusoidalFloor{(1 + offset) / (w * w), frequency};
            scene.start_temperature = 1e-4;
            run_scene(one, scene, 200, effort_);
          });
    }
    add("a disk between walls 1 + 1e-6 D apart", 1e-9, 10, [&](HardCase& one) {
      sim::Scene scene = pile(1, 1 + 1e-6, 1, 0);
      run_scene(one, scene, 1, effort_);
    });
    add("Gamma = 1000", 1e-9, 10, [&](HardCase& one) {
      sim::Scene scene = pile(50, 10, 0.9, 1e-6);
      const double frequency = 1, w = 2 * std::numbers::pi * frequency;
      scene.box.floor = sim::SinusoidalFloor{1000 / (w * w), frequency};
      run_scene(one, scene, 100, effort_);
    });
    // 1.75e8 contacts when not quick.
    add("1e6 periods of a floor with one disk", 1e-9, effort_.quick ? 20 : 180, [&](HardCase& one) {
      // Gamma below the first bouncing mode: the disk rests for a part of every period, with a contact each contact
      // duration.
      sim::Scene scene = pile(1, 5, 0.5, 0.02);
      const double frequency = 1, w = 2 * std::numbers::pi * frequency;
      scene.box.floor = sim::SinusoidalFloor{1.02 / (w * w), frequency};
      run_scene(one, scene, effort_.quick ? 1e4 : 1e6, effort_);
      if (effort_.quick) one.note += "; quick: 1e4";
    });
  }

  void lattices() {
    add("crystal at area fraction 0.9065 (0.9069 is close packing)", 1e-10, 10,
        [&](HardCase& one) { run_scene(one, fluid(32, 0.9065), 0.2, effort_); });
    add("close-packed start, phi = (1 - 1e-10) 2/sqrt 3", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene;
      scene.gravity = sim::Weightless{};
      scene.disks.species = {{900, 1, 1}};
      const double spacing = std::sqrt(1 / (1 - 1e-10));
      scene.box.width = 30 * spacing;
      scene.box.sides = sim::PeriodicSides{};
      scene.box.top = sim::PeriodicTop{30 * spacing * std::numbers::sqrt3 / 2};
      scene.start = sim::HexagonalStart{30, 0};
      run_scene(one, scene, 1e-9, effort_);
    });
  }

  void contacts_at_one_instant() {
    add("two disks hit a third at one instant, again and again", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(3, 12, 1, 0);
      constexpr double c = std::numbers::sqrt3 / 2;
      scene.start = sim::PlacedStart{
          {{6, 5, 0, 0, 0, 0}, {6 - 2, 5 + 4 * c, 1, -2 * c, 0, 0}, {6 + 2, 5 + 4 * c, -1, -2 * c, 0, 0}}};
      run_scene(one, scene, 50, effort_);
    });
    add("a lattice hit by its lowest row: triple contacts everywhere", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(80, 10.5, 0.6, 1e-3);
      scene.box.sides = sim::PeriodicSides{};
      sim::PlacedStart start;
      for (int k = 0; k < 80; ++k) {
        const int row = k / 10;
        start.disks.push_back({k % 10 + 0.25 + 0.5 * (row % 2), 0.51 + row * (std::numbers::sqrt3 / 2 + 0.01), 0,
                               row == 0 ? 2.0 : 0.0, 0, 0});
      }
      scene.start = start;
      run_scene(one, scene, 20, effort_);
    });
    for (const double duration : {0.0, 1e-4}) {
      add(fmt::format("a row of touching disks that fills the width, {} contact clock", duration > 0 ? "with" : "no"),
          1e-10, 10, [&](HardCase& one) {
            sim::Scene scene = pile(12, 12, 0.9, duration);
            sim::PlacedStart start;
            for (int k = 0; k < 12; ++k) start.disks.push_back({0.5 + k, 0.5, k == 3 ? 1.0 : 0.0, 1, 0, 0});
            scene.start = start;
            run_scene(one, scene, 20, effort_);
          });
    }
  }

  void two_species() {
    add("two sizes 1:0.2, masses 1:1e-3", 1e-9, 10, [&](HardCase& one) {
      sim::Scene scene = pile(60, 20, 1, 0);
      scene.disks.species.push_back({300, 0.2, 1e-3});
      scene.start = sim::RandomStart{0};
      run_scene(one, scene, 20, effort_);
    });
    add("masses 1:1e6", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(0, 10, 1, 0);
      scene.disks.species = {{30, 1, 1}, {30, 1, 1e6}};
      run_scene(one, scene, 3, effort_);
    });
    add("radii 1:5", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(0, 30, 0.9, 1e-3);
      scene.disks.species = {{200, 1, 1}, {10, 5, 25}};
      scene.start = sim::RandomStart{};
      run_scene(one, scene, 50, effort_);
    });
  }

  // Cold, resting, one or none.
  void few_disks() {
    add("T = 1e-12 m g D", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(100, 12, 1, 0);
      scene.start_temperature = 1e-12;
      run_scene(one, scene, 1e-3, effort_);
    });
    add("a disk at rest on the floor", 1e-10, 10, [&](HardCase& one) {
      sim::Scene scene = pile(1, 4, 0.5, 0);
      scene.start = sim::PlacedStart{{{2, 0.5, 0, 0, 0, 0}}};
      run_scene(one, scene, 10, effort_);
    });
    add("an empty scene", 0, 10, [&](HardCase& one) {
      const auto simulation = sim::simulate(pile(0, 4, 0.9, 0));
      simulation->advance_to(100);
      one.pass = simulation->time() == 100 && simulation->counters().collisions() == 0;
      one.note = fmt::format("{} contacts", simulation->counters().collisions());
    });
    add("one disk, elastic, for 1000 time units", 1e-10, 10,
        [&](HardCase& one) { run_scene(one, pile(1, 4, 1, 0), 1000, effort_); });
  }

  void late_clock() {
    // Time is counted from the last synchronisation: the same state put 2^33 intervals later, where a run would have
    // had more than 1e10 contacts, must go on to the same places.
    result_.hard_cases.push_back(
        run_hard_case("the clock after 1e10 contacts", "D, largest difference", 0, 10, [&](HardCase& one) {
          const sim::Scene scene = Bed::scene(1e-6);
          const auto early = sim::simulate(scene), late = sim::simulate(scene);
          for (int k = 0; k < 5; ++k) early->advance_to(early->next_synchronisation());
          late->restore(sim::checkpoint_bytes::put_later(early->checkpoint(), std::uint64_t{1} << 33U));
          for (int k = 0; k < 20; ++k) {
            early->advance_to(early->next_synchronisation());
            late->advance_to(late->next_synchronisation());
          }
          one.error = largest_difference(*early, *late);
          const double contacts = static_cast<double>(early->counters().collisions()) / early->time() * late->time();
          one.pass = contacts > 1e10;
          one.note = fmt::format("at time {:.4g}, {:.3g} contacts", late->time(), contacts);
        }));
  }

  void checkpoint() {
    result_.hard_cases.push_back(
        run_hard_case("stopped at a checkpoint and gone on", "D, largest difference", 0, 10, [&](HardCase& one) {
          const sim::Scene scene = Bed::scene(1e-6);
          const auto whole = sim::simulate(scene);
          const auto first = sim::simulate(scene);
          for (int k = 0; k < 20; ++k) first->advance_to(first->next_synchronisation());
          const auto second = sim::simulate(scene);
          second->restore(first->checkpoint());
          const double until = first->time() + 20;
          whole->advance_to(until), second->advance_to(until);
          one.error = largest_difference(*whole, *second);
          one.note = fmt::format("after {} contacts", whole->counters().collisions());
        }));
  }

  const Effort& effort_;
  StageResult& result_;
};

}  // namespace

StageResult bench_simulate(const Effort& effort) {
  StageResult result;
  result.name = "simulate", result.title = "simulate: the event-driven simulator";
  result.cpu_seconds = cpu_seconds_of([&] {
    error_against_collisions(effort, result);
    contact_clock(effort, result);
    speed_and_growth(effort, result);
    HardScenes(effort, result).run();
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
