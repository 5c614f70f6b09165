// What the page calls: plain functions of numbers and of places in memory. One bed at a time.
#include <memory>
#include <string>
#include <type_traits>

#include "pipelines/live/live_bed.hpp"
#include "sim/engine/choose_engine.hpp"

namespace shakebed::sim {

// The engines of the page: gravity, equal disks.
struct EnginesOfThePage {
  static constexpr bool weightless = false, two_sizes = false, cells = false;
};
std::unique_ptr<Simulation> simulate(const Scene& scene) { return simulate_with<EnginesOfThePage>(scene); }

}  // namespace shakebed::sim

namespace {

using namespace shakebed::pipelines::live;

static_assert(std::is_standard_layout_v<Settings> && sizeof(Settings) == 11 * sizeof(double));
static_assert(std::is_standard_layout_v<Numbers> && sizeof(Numbers) == 17 * sizeof(double));

Settings settings;
std::unique_ptr<LiveBed> bed;
std::string problem;

}  // namespace

extern "C" {

// Where the page writes the settings, a double each in the order of Settings.
double* live_settings() { return &settings.count; }

// A bed of these settings. Null, or what is wrong with them.
const char* live_begin() {
  bed.reset();
  try {
    bed = std::make_unique<LiveBed>(settings);
    return nullptr;
  } catch (const std::exception& error) {
    problem = error.what();
    return problem.c_str();
  }
}

int live_advance(double time, double events) {
  return bed->advance_towards(time, static_cast<std::uint64_t>(events)) ? 1 : 0;
}

// Positions and velocities now, as many numbers as disks; the floor goes into the numbers.
const double* live_x() { return bed->snapshot().x.data(); }
const double* live_z() { return bed->snapshot().z.data(); }
const double* live_vx() { return bed->snapshot().vx.data(); }
const double* live_vz() { return bed->snapshot().vz.data(); }

// A double each in the order of Numbers.
const double* live_numbers() { return &bed->numbers().time; }
void live_measure() { bed->measure(); }
int live_profile_points() { return static_cast<int>(bed->profile().height.size()); }
const double* live_heights() { return bed->profile().height.data(); }
const double* live_density() { return bed->profile().number_density.data(); }
const double* live_density_error() { return bed->profile().std_error.data(); }
const double* live_curve() { return bed->curve().data(); }

}  // extern "C"
