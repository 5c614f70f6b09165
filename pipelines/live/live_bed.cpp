#include "pipelines/live/live_bed.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/reduced_scales.hpp"

namespace shakebed::pipelines::live {

namespace {

constexpr double start_temperature = 0.01;  // of a bed that begins in rows [m g D]: what a recipe has by itself
constexpr double most_disks = 5000;         // beyond, a page would stand still
// The curve's temperatures [m g D], and how closely the best is sought: far closer than the profile knows it.
constexpr double coldest = 0.02, hottest = 500, closeness = 1e-3;

// Where a function of one variable is least, by golden sections. It is taken at some places first: it may have more
// than one valley.
template <class Function>
double least(double low, double high, const Function& value) {
  constexpr int places = 16;
  const double step = (high - low) / places;
  int best = 0;
  double lowest = std::numeric_limits<double>::infinity();
  for (int k = 0; k <= places; ++k) {
    const double here = value(low + k * step);
    if (here < lowest) lowest = here, best = k;
  }
  double from = low + std::max(best - 1, 0) * step, to = low + std::min(best + 1, places) * step;
  constexpr double golden = 0.6180339887498949;
  double left = to - golden * (to - from), right = from + golden * (to - from);
  double at_left = value(left), at_right = value(right);
  while (to - from > closeness) {
    if (at_left < at_right) {
      to = right, right = left, at_right = at_left;
      at_left = value(left = to - golden * (to - from));
    } else {
      from = left, left = right, at_left = at_right;
      at_right = value(right = from + golden * (to - from));
    }
  }
  return (from + to) / 2;
}

sim::Scene scene_of(const Settings& s) {
  if (!(s.count >= 1 && s.count <= most_disks)) throw std::invalid_argument("the number of disks must be 1 to 5000");
  if (!(s.diameter > 0 && s.width > 0 && s.gamma > 0 && s.frequency > 0))
    throw std::invalid_argument("diameter, width, Gamma and frequency must be above 0");
  const ReducedScales unit = ReducedScales::of(s.diameter, usual_gravity);
  const sim::Surface contact{.restitution = s.restitution, .friction = s.friction};
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  scene.disks.species = {{static_cast<std::uint32_t>(s.count), 1, 1}};
  scene.disks.contact = contact;
  scene.disks.inertia_ratio = 0.4;  // spheres
  scene.disks.contact_duration = s.restitution < 1 || s.friction > 0 ? usual_contact_duration : 0;
  scene.box.width = s.width / unit.length;
  if (s.periodic != 0) {
    scene.box.sides = sim::PeriodicSides{};
  } else {
    scene.box.sides = sim::HardSides{{.restitution = s.restitution}};
  }
  scene.box.floor =
      sim::SinusoidalFloor{amplitude_of(s.gamma, usual_gravity, s.frequency) / unit.length, s.frequency * unit.time};
  scene.box.floor_surface = contact;
  if (s.hexagonal != 0) {
    scene.start = sim::HexagonalStart{};
    scene.start_temperature = start_temperature;
  } else {
    scene.start = sim::RandomStart{};
    scene.start_temperature = 0;
  }
  scene.seed = static_cast<std::uint64_t>(s.seed);
  return scene;
}

}  // namespace

LiveBed::LiveBed(const Settings& settings) : scene_(scene_of(settings)) {
  const ReducedScales unit = ReducedScales::of(settings.diameter, usual_gravity);
  options_.settle = settings.settle / unit.time;
  plan_ = sim::plan_looks(scene_, options_);
  simulation_ = sim::simulate(scene_);
  observer_.emplace(scene_, simulation_->properties(), plan_.schedule.phases, sim::profile_heights(scene_, options_),
                    options_.kernel);
  const auto& floor = std::get<sim::SinusoidalFloor>(scene_.box.floor);
  numbers_.time_unit = unit.time;
  numbers_.period = plan_.schedule.period;
  numbers_.settled = plan_.schedule.settle;
  numbers_.amplitude = floor.amplitude;
  numbers_.column_number = scene_.count() / scene_.box.width;
}

void LiveBed::look() {
  simulation_->snapshot(at_);
  observer_->observe(at_, static_cast<std::uint32_t>(next_look_ % plan_.schedule.phases));
  ++next_look_;
}

bool LiveBed::advance_towards(double time, std::uint64_t events) {
  const std::uint64_t end = simulation_->counters().events() + events;
  for (;;) {
    const double moment = plan_.schedule.moment(next_look_), stop = std::min(moment, time);
    const std::uint64_t now = simulation_->counters().events();
    if (now >= end || !simulation_->advance_towards(stop, end - now)) return false;
    if (moment > time) return true;
    look();
  }
}

const sim::Snapshot& LiveBed::snapshot() {
  simulation_->snapshot(at_);
  return at_;
}

const Numbers& LiveBed::numbers() {
  numbers_.time = simulation_->time();
  numbers_.collisions = static_cast<double>(simulation_->counters().collisions());
  numbers_.periods = static_cast<double>(observer_->periods());
  numbers_.floor = at_.floor_position;
  return numbers_;
}

void LiveBed::measure() {
  if (observer_->periods() == 0) return;
  const auto put = [](const sim::Measured& measured, double& value, double& error) {
    value = measured.value;
    error = measured.std_error;
  };
  put(observer_->temperature_x(), numbers_.temperature_x, numbers_.temperature_x_error);
  put(observer_->temperature_z(), numbers_.temperature_z, numbers_.temperature_z_error);
  put(observer_->centre_of_mass(), numbers_.rise, numbers_.rise_error);
  const bool hard = std::holds_alternative<sim::HardSides>(scene_.box.sides);
  numbers_.rise -= sim::ideal_centre_of_mass(scene_.count(), scene_.box.width, hard);
  profile_ = observer_->density(false);
  const sim::FilledHeights filled = sim::filled_heights(profile_);
  for (auto* column : {&profile_.height, &profile_.number_density, &profile_.std_error}) {
    column->resize(filled.last);
    column->erase(column->begin(), column->begin() + static_cast<std::ptrdiff_t>(filled.first));
  }
  fit_curve();
}

// The curve at this temperature, its centre of mass put where the bed's is; the rms of what the density is off it. A
// curve of no such temperature is infinitely far off.
double LiveBed::sample_curve(double temperature, double centre, std::vector<double>& out) const {
  const fit::Column column{numbers_.column_number};
  const auto model = fit::HydrostaticProfile::of_column(fit::enskog(), temperature, column);
  if (!model.ok()) return std::numeric_limits<double>::infinity();
  std::vector<double> heights = profile_.height;
  for (double& height : heights) height -= centre - model.center_of_mass();
  out.resize(heights.size());
  model.sample(heights, options_.kernel, out);
  double squares = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const double off = profile_.number_density[i] - out[i];
    squares += off * off;
  }
  return std::sqrt(squares / static_cast<double>(out.size()));
}

void LiveBed::fit_curve() {
  const double centre = observer_->centre_of_mass().value;
  const double log_temperature = least(std::log(coldest), std::log(hottest), [&](double logarithm) {
    return sample_curve(std::exp(logarithm), centre, curve_);
  });
  numbers_.curve_temperature = std::exp(log_temperature);
  numbers_.curve_misfit = sample_curve(numbers_.curve_temperature, centre, curve_);
}

}  // namespace shakebed::pipelines::live
