#include "sim/measure/measured_bed.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <string_view>

#include "statistics/text.hpp"

namespace shakebed::sim {

namespace {

// A still bed: looks a unit of time sqrt(D/g), and the fewest and the most of them.
constexpr double looks_a_time = 4, fewest_looks = 100, most_looks = 20'000;
constexpr double most_periods = 1e12;    // more are a mistake in the units
constexpr double rounding = 1e-12;       // a duration of n periods holds n of them, whatever the division rounds to
constexpr double longest_profile = 2e5;  // heights
constexpr double empty_density = 1e-12;  // [1/D^2], below it a height is left out

double floor_amplitude(const Floor& floor) {
  double amplitude = 0;
  if (const auto* sine = std::get_if<SinusoidalFloor>(&floor)) amplitude = sine->amplitude;
  if (const auto* table = std::get_if<TabulatedFloor>(&floor))
    for (const double height : table->heights) amplitude = std::max(amplitude, std::abs(height));
  return amplitude;
}

double bath_temperature(const Bath& bath) {
  if (const auto* b = std::get_if<LangevinBath>(&bath)) return b->temperature;
  if (const auto* b = std::get_if<AndersenBath>(&bath)) return b->temperature;
  if (const auto* b = std::get_if<ThermalFloor>(&bath)) return b->temperature;
  return 0;
}

// The bed's means, the virial of each period, and the frames.
class Observer final : public RunObserver {
 public:
  Observer(const Scene& scene, const MeasureOptions& options, const LookPlan& plan, MeasuredBed& out)
      : scene_(scene), options_(options), plan_(plan), out_(out) {}

  void begin(Simulation& simulation) override {
    out_.disks = simulation.properties();
    bed_.emplace(scene_, out_.disks, plan_.schedule.phases, profile_heights(scene_, options_), options_.kernel);
    virial_ = simulation.counters().virial;
  }
  void look(Simulation& simulation, const Snapshot& at, std::uint64_t look, std::uint32_t phase) override {
    if (phase == 0 && bed_->periods() > 0) end_period(simulation);
    bed_->observe(at, phase);
    if (!plan_.takes_frame(look)) return;
    const double turn = plan_.shaken ? static_cast<double>(phase) / plan_.schedule.phases : 0;
    if (options_.frame_sink) return options_.frame_sink(at, turn);
    out_.frames.push_back(at);
    out_.frame_phases.push_back(turn);
  }
  void end(Simulation& simulation) override { end_period(simulation); }
  void save(ArchiveWriter&) override { throw std::logic_error("this run keeps no states"); }
  void load(ArchiveReader&) override { throw std::logic_error("this run keeps no states"); }

  void results() const {
    out_.periods = bed_->periods();
    out_.profile = bed_->density(false);
    out_.floor_frame_profile = bed_->density(true);
    covariance();
    out_.temperature_x = bed_->temperature_x();
    out_.temperature_z = bed_->temperature_z();
    out_.temperature_z_local = bed_->temperature_z_local();
    out_.spin_temperature = bed_->spin_temperature();
    if (std::holds_alternative<UniformGravity>(scene_.gravity)) {
      out_.centre_of_mass = bed_->centre_of_mass();
      out_.centre_of_mass_rise = {out_.centre_of_mass.value - ideal_centre_of_mass(scene_),
                                  out_.centre_of_mass.std_error};
    }
    if (std::holds_alternative<PeriodicTop>(scene_.box.top))
      out_.compressibility_factor = bed_->compressibility_factor({virial_rate_.mean(), virial_rate_.std_error()});
  }

 private:
  void end_period(const Simulation& simulation) {
    const double virial = simulation.counters().virial;
    virial_rate_.add((virial - virial_) / plan_.schedule.period);
    virial_ = virial;
  }
  void covariance() const {
    const FilledHeights filled = filled_heights(out_.profile);
    if (filled.first == filled.last) return;
    out_.covariance_first = filled.first;
    out_.covariance_last = filled.last;
    out_.covariance = bed_->density_covariance(out_.covariance_first, out_.covariance_last);
    out_.covariance_samples = bed_->covariance_blocks();
  }

  const Scene& scene_;
  const MeasureOptions& options_;
  const LookPlan& plan_;
  MeasuredBed& out_;
  std::optional<BedObserver> bed_;
  CorrelatedMeans virial_rate_;
  double virial_ = 0;
};

MeasuredBed bad_input(std::string message) {
  MeasuredBed out;
  out.message = std::move(message);
  return out;
}

std::string sentence_of(MeasureOptions::Problem problem, const MeasureOptions& options, double floor_period) {
  using Problem = MeasureOptions::Problem;
  switch (problem) {
    case Problem::settle:
      return formatted("settle is %g; it must be 0 or more", options.settle);
    case Problem::duration:
      return formatted("duration is %g; it must be above 0", options.duration);
    case Problem::phases:
      return "phases is 0; the bed must be sampled at least once per period";
    case Problem::spacing:
      return formatted("spacing is %g; it must be above 0", options.spacing);
    case Problem::kernel:
      return "the density is measured through a kernel: give a kernel other than none, with a finite width above 0";
    case Problem::shorter_than_a_period:
      return formatted("duration is %g, shorter than one period of the floor, %g; measure at least one period",
                       options.duration, floor_period);
    case Problem::too_many_periods:
      return formatted("duration is %g periods of the floor; at most %g periods can be measured",
                       options.duration / floor_period, most_periods);
    case Problem::too_many_frames:
      return formatted(
          "%llu frames are to be stored, but the bed is sampled only %llu times; measure longer or store fewer frames",
          static_cast<unsigned long long>(options.frames),
          static_cast<unsigned long long>(plan_looks(floor_period, options).possible_frames()));
    case Problem::frame_phases:
      return formatted(
          "frames are wanted at phases at which the bed is not sampled; give different multiples of 1/%u, from 0 to "
          "below 1, and a floor that shakes",
          options.phases);
  }
  return "";
}

}  // namespace

std::string_view to_string(MeasureStatus status) {
  switch (status) {
    case MeasureStatus::ok:
      return "ok";
    case MeasureStatus::stopped:
      return "stopped";
    case MeasureStatus::bad_input:
      return "bad input";
    case MeasureStatus::precision_lost:
      return "precision lost";
  }
  return "";
}

double floor_period(const Scene& scene) {
  if (const auto* sine = std::get_if<SinusoidalFloor>(&scene.box.floor)) return 1 / sine->frequency;
  if (const auto* table = std::get_if<TabulatedFloor>(&scene.box.floor)) return table->period;
  return 0;
}

LookPlan plan_looks(const Scene& scene, const MeasureOptions& options) {
  return plan_looks(floor_period(scene), options);
}

LookPlan plan_looks(double period, const MeasureOptions& options) {
  LookPlan plan;
  MeasurementSchedule& schedule = plan.schedule;
  schedule.settle = options.settle;
  schedule.period = period;
  plan.shaken = period > 0;
  if (plan.shaken) {
    schedule.phases = options.phases;
    schedule.periods = static_cast<std::uint64_t>(options.duration / period * (1 + rounding));
    schedule.settle = std::ceil(schedule.settle / period * (1 - rounding)) * period;  // at phase 0
  } else {
    schedule.phases = 1;
    const double wanted = std::clamp(options.duration * looks_a_time, fewest_looks, most_looks);
    schedule.periods = std::max(static_cast<std::uint64_t>(wanted), options.frames);
    schedule.period = options.duration / static_cast<double>(schedule.periods);
  }
  for (const double phase : options.frame_phases)
    plan.frame_phases.push_back(static_cast<std::uint32_t>(std::lround(phase * schedule.phases)));
  std::sort(plan.frame_phases.begin(), plan.frame_phases.end());
  if (options.frames > 0) {
    const std::uint64_t phases = plan.frame_phases.empty() ? schedule.phases : plan.frame_phases.size();
    plan.frames = options.frames;
    plan.frame_stride = plan.possible_frames() / options.frames;
    while (plan.frame_stride > 1 && std::gcd(plan.frame_stride, phases) > 1) --plan.frame_stride;
  }
  return plan;
}

bool LookPlan::takes_frame(std::uint64_t look) const {
  if (frames == 0) return false;
  std::uint64_t number = look;  // among the looks at which frames may be taken
  if (!frame_phases.empty()) {
    const auto phase = static_cast<std::uint32_t>(look % schedule.phases);
    const auto place = std::lower_bound(frame_phases.begin(), frame_phases.end(), phase);
    if (place == frame_phases.end() || *place != phase) return false;
    number = look / schedule.phases * frame_phases.size() + static_cast<std::uint64_t>(place - frame_phases.begin());
  }
  return number % frame_stride == 0 && number / frame_stride < frames;
}

namespace {

// Whether the samples have these phases, each once.
bool phases_are_sampled(const std::vector<double>& wanted, std::uint32_t phases) {
  std::vector<double> samples;
  for (const double phase : wanted) {
    const double sample = phase * phases;
    if (!(phase >= 0 && phase < 1) || std::abs(sample - std::round(sample)) > rounding * phases) return false;
    samples.push_back(std::round(sample));
  }
  std::sort(samples.begin(), samples.end());
  return std::adjacent_find(samples.begin(), samples.end()) == samples.end();
}

}  // namespace

HeightGrid profile_heights(const Scene& scene, const MeasureOptions& options, double hottest_bath) {
  HeightGrid grid;
  grid.spacing = options.spacing;
  const double below = floor_amplitude(scene.box.floor) + 6 * options.kernel.width + 1;
  grid.lowest = -std::ceil(below / grid.spacing) * grid.spacing;
  const double temperature = std::max(bath_temperature(scene.bath), hottest_bath);
  const double loose_height = 6 * scene.count() / scene.box.width + 30 + 25 * temperature;
  grid.points = static_cast<std::size_t>(std::min((loose_height - grid.lowest) / grid.spacing, longest_profile));
  return grid;
}

std::vector<MeasureOptions::Problem> MeasureOptions::problems(double floor_period) const {
  std::vector<Problem> out;
  const auto require = [&](bool holds, Problem problem) {
    if (!holds) out.push_back(problem);
  };
  require(settle >= 0 && std::isfinite(settle), Problem::settle);
  require(duration > 0 && std::isfinite(duration), Problem::duration);
  require(phases >= 1, Problem::phases);
  require(spacing > 0 && std::isfinite(spacing), Problem::spacing);
  require(kernel_is_valid(kernel) && kernel.kind != KernelKind::none, Problem::kernel);
  if (floor_period > 0) {
    require(duration / floor_period * (1 + rounding) >= 1, Problem::shorter_than_a_period);
    require(duration / floor_period <= most_periods, Problem::too_many_periods);
  }
  require(frame_phases.empty() || (floor_period > 0 && phases_are_sampled(frame_phases, phases)),
          Problem::frame_phases);
  if (out.empty() && frames > 0) require(plan_looks(floor_period, *this).frame_stride > 0, Problem::too_many_frames);
  return out;
}

std::vector<std::string> MeasureOptions::validate(const Scene& scene) const {
  const double period = floor_period(scene);
  std::vector<std::string> out;
  for (const Problem problem : problems(period)) out.push_back(sentence_of(problem, *this, period));
  return out;
}

FilledHeights filled_heights(const Profile& profile) {
  FilledHeights filled{0, profile.height.size()};
  while (filled.first < filled.last && profile.number_density[filled.first] < empty_density) ++filled.first;
  while (filled.last > filled.first && profile.number_density[filled.last - 1] < empty_density) --filled.last;
  return filled;
}

MeasuredBed measure(const Scene& scene, const MeasureOptions& options) {
  if (const auto problems = check(scene); !problems.empty())
    return bad_input(problems.front().where + ": " + problems.front().what);
  if (const auto problems = options.validate(scene); !problems.empty()) return bad_input(problems.front());
  MeasuredBed out;
  const LookPlan plan = plan_looks(scene, options);
  Observer observer(scene, options, plan, out);
  RunControl control;
  control.stop = options.stop;
  if (options.progress) control.progress = [&](double fraction, RunPart) { options.progress(fraction); };
  const RunResult run = measure(scene, plan.schedule, {&observer}, control);
  if (!run.finished) {
    out.status = MeasureStatus::stopped;
    out.message = "the run was stopped before its end";
    return out;
  }
  observer.results();
  out.energy = run.simulation->energy();
  out.counters = run.simulation->counters();
  out.largest_overlap = run.simulation->largest_overlap();
  out.message = precision_lost(*run.simulation);
  out.status = out.message.empty() ? MeasureStatus::ok : MeasureStatus::precision_lost;
  return out;
}

std::string MeasuredBed::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  const char* const energy_unit = centre_of_mass.value != 0 ? "m g D" : "T0";
  return formatted(
      "%llu disks, %llu periods: T_x = %.4g +- %.2g %s, T_z = %.4g +- %.2g %s, centre of mass %.5g +- %.2g D",
      static_cast<unsigned long long>(disks.mass.size()), static_cast<unsigned long long>(periods), temperature_x.value,
      temperature_x.std_error, energy_unit, temperature_z.value, temperature_z.std_error, energy_unit,
      centre_of_mass.value, centre_of_mass.std_error);
}

std::string MeasuredBed::full() const {
  std::string out = formatted("status                  %s\n", std::string(to_string(status)).c_str());
  if (!message.empty()) out += "message                 " + message + "\n";
  if (periods == 0) return out;
  const auto line = [&](const char* name, const Measured& m, const char* unit) {
    out += formatted("%-23s %.6g +- %.2g %s\n", name, m.value, m.std_error, unit);
  };
  out += formatted("disks                   %zu\n", disks.mass.size());
  out += formatted("periods                 %llu\n", static_cast<unsigned long long>(periods));
  const bool weight = centre_of_mass.value != 0;
  const char* const energy_unit = weight ? "m g D" : "T0";
  line("temperature_x", temperature_x, energy_unit);
  line("temperature_z", temperature_z, energy_unit);
  line("spin_temperature", spin_temperature, energy_unit);
  if (weight) {
    line("centre_of_mass", centre_of_mass, "D");
    line("centre_of_mass_rise", centre_of_mass_rise, "D");
  }
  if (compressibility_factor.value != 0) line("compressibility_factor", compressibility_factor, "");
  out += formatted("collisions              %llu\n", static_cast<unsigned long long>(counters.collisions()));
  out += formatted("energy imbalance        %.2g\n", energy.imbalance());
  out += formatted("largest overlap         %.2g D\n", largest_overlap);
  out += formatted("frames                  %zu\n", frames.size());
  return out;
}

}  // namespace shakebed::sim
