#include "pipelines/stages/infer_bed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/inference/posterior.hpp"
#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "sim/measure/flow_free.hpp"
#include "sim/measure/measure.hpp"
#include "sim/measure/observables.hpp"

namespace shakebed::pipelines {

namespace {

constexpr double profile_spacing = 0.25;  // of the heights [D]; half the kernel's usual width

// A bed that makes more events a disk and period than this is given up: it chatters, frozen between two blows. Beds
// that are fluid make 30 to 400 contacts (10 layers, e = 0.4 to 0.9); at Gamma = 2 and 15 Hz one went on for ever.
constexpr double most_events = 1000;
constexpr std::uint64_t events_between_questions = 200'000;

enum Number : std::size_t {
  fitted,
  shift,
  solid,
  density,
  kinetic_x,
  kinetic_z,
  kinetic_z_local,
  rise,
  flow_free_x,
  flow_free_z,
  number_count
};

// What is measured of a bed, with so many looks a period.
struct Observers {
  Observers(const sim::Scene& scene, std::uint32_t looks, const HeightGrid& grid, const Kernel& kernel, bool of_film)
      : bed([&scene, looks, grid, kernel](const sim::DiskProperties& disks) {
          return sim::BedObserver(scene, disks, looks, grid, kernel);
        }),
        flow_free([looks](const sim::DiskProperties& disks) { return sim::FlowFreeTemperature(disks, looks); }),
        filmed([&scene, looks](const sim::DiskProperties& disks) {
          return sim::FlowFreeDisplacement(scene, disks, looks);
        }),
        film(of_film) {}
  sim::Observing<sim::BedObserver> bed;
  sim::Observing<sim::FlowFreeTemperature> flow_free;
  sim::Observing<sim::FlowFreeDisplacement> filmed;
  bool film;  // whether `filmed` looks
};

// Passes on the samples of one phase only, as if it were the single phase of a period; or all of them.
class AtPhase final : public sim::RunObserver {
 public:
  AtPhase(Observers observers, std::optional<std::uint32_t> phase) : observers_(std::move(observers)), phase_(phase) {}
  const Observers& observers() const { return observers_; }
  void prepare(sim::Simulation& simulation) override {
    observers_.bed.prepare(simulation), observers_.flow_free.prepare(simulation);
    observers_.filmed.prepare(simulation);
  }
  void look(sim::Simulation& simulation, const sim::Snapshot& at, std::uint64_t look, std::uint32_t phase) override {
    if (phase_ && phase != *phase_) return;
    const std::uint32_t own = phase_ ? 0 : phase;
    observers_.bed.look(simulation, at, look, own), observers_.flow_free.look(simulation, at, look, own);
    if (observers_.film) observers_.filmed.look(simulation, at, look, own);
  }
  void save(sim::ArchiveWriter& out) override {
    observers_.bed.save(out), observers_.flow_free.save(out), observers_.filmed.save(out);
  }
  void load(sim::ArchiveReader& in) override {
    observers_.bed.load(in), observers_.flow_free.load(in), observers_.filmed.load(in);
  }

 private:
  Observers observers_;
  std::optional<std::uint32_t> phase_;
};

}  // namespace

// --- parameters

void UnknownParameter::describe(Fields& f) {
  f.texts("set", set,
          {.help = "JSON pointers of the options of this stage that are set: [\"/floor/gamma\"]", .required = true});
  f.text("unit", unit, {.help = "unit of the value that is set; empty: a plain number", .example = "\"Hz\""});
  std::optional<double> from = low == high ? std::nullopt : std::optional(low),
                        to = low == high ? std::nullopt : std::optional(high);
  f.number("low", from, {.help = "smallest possible value"});
  f.number("high", to, {.help = "largest possible value"});
  f.any("values", values, {.help = "list of values, all equally likely, in place of low and high"});
  f.choice("scale", logarithmic, {{false, "linear"}, {true, "logarithmic"}},
           {.help = "whether the prior is uniform in the value (linear) or in its logarithm"});
  f.number("mean", mean, {.help = "mean of a normal prior, cut off at low and high"});
  f.number("std_error", std_error, {.help = "standard deviation of the normal prior", .range = positive});
  f.text("why", why, {.help = "reason for this range, shown in the report"});
  if (!f.decoding()) return;
  low = from.value_or(0), high = to.value_or(0);
  f.require(!set.empty(), "set", "a parameter needs a pointer into the scene");
  if (is_choice()) {
    f.require(values.size() >= 2 && !from && !to && !mean, "values",
              "\"values\" needs two values or more, and excludes \"low\", \"high\" and \"mean\"");
    return;
  }
  f.require(from && to && low < high, "low", "a parameter needs \"low\" below \"high\", or \"values\"");
  f.require(!logarithmic || low > 0, "low", "a logarithmic scale needs \"low\" above 0");
  f.require(mean.has_value() == std_error.has_value() && !(mean && logarithmic), "mean",
            "a normal prior needs both \"mean\" and \"std_error\", and a linear scale");
}

double UnknownParameter::value(double place) const {
  if (is_choice()) {
    const auto n = static_cast<double>(values.size());
    return std::min(std::floor(place * n), n - 1);
  }
  if (mean) {
    const double below = fit::normal_chance((low - *mean) / *std_error);
    const double above = fit::normal_chance((high - *mean) / *std_error);
    return std::clamp(*mean + *std_error * fit::normal_quantile(below + place * (above - below)), low, high);
  }
  return logarithmic ? low * std::pow(high / low, place) : low + place * (high - low);
}

double UnknownParameter::place(double value) const {
  if (is_choice()) return (value + 0.5) / static_cast<double>(values.size());
  if (mean) {
    const double below = fit::normal_chance((low - *mean) / *std_error);
    const double above = fit::normal_chance((high - *mean) / *std_error);
    return (fit::normal_chance((value - *mean) / *std_error) - below) / (above - below);
  }
  return logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
}

double UnknownParameter::coordinate(double value) const {
  if (is_choice()) return value / static_cast<double>(values.size() - 1);
  return logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
}

Json UnknownParameter::written(double value) const {
  if (is_choice()) return values[static_cast<std::size_t>(value)];
  return unit.empty() ? Json(value) : Json(number_text(value) + " " + unit);
}

std::optional<double> UnknownParameter::in_scene(const JsonNode& scene) const {
  const JsonNode* node = find_pointer(scene, set.front());
  if (node == nullptr) return std::nullopt;
  if (is_choice()) {
    const Json own = node->to_json();
    const auto found = std::find(values.begin(), values.end(), own);
    return found == values.end() ? std::nullopt : std::optional(static_cast<double>(found - values.begin()));
  }
  double value = node->number;
  if (!unit.empty()) {
    if (!node->is_string()) return std::nullopt;
    try {
      value = parse_quantity(node->text).value / parse_quantity("1 " + unit).value;
    } catch (const std::invalid_argument&) {
      return std::nullopt;
    }
  } else if (!node->is_number()) {
    return std::nullopt;
  }
  return value >= low && value <= high ? std::optional(value) : std::nullopt;
}

// --- what is compared

const std::vector<Observable>& observables() {
  static const std::vector<Observable> all = {
      {"temperature_over_mg", true, "m", "temperature of the fitted profile, T/(m g)", true},
      {"shift", false, "D", "height at which the fitted curve of the fluid reaches the plateau density", false},
      {"solid_height_by_sum_rule", false, "D",
       "height of the solid that follows from the fitted T and the column number N D/W", false},
      {"density", false, "1/D^2", "greatest density of the profile", true},
      {"temperature_x_over_mg", true, "m", "kinetic temperature T_x/(m g), horizontal", true},
      {"temperature_z_over_mg", true, "m", "kinetic temperature T_z/(m g), vertical, without the bed's mean velocity",
       true},
      {"temperature_z_local_over_mg", true, "m",
       "kinetic temperature T_z/(m g), vertical, without the mean velocity of each layer of 1 D", true},
      {"center_of_mass_rise", false, "D", "rise of the centre of mass above ideal hexagonal packing", false},
      {"temperature_x_without_flow_over_mg", true, "m",
       "kinetic temperature T_x/(m g), horizontal, without the mean motion of each layer of 1 D at each moment, as "
       "from a film; with \"frame_rate\" that of displacements",
       true},
      {"temperature_z_without_flow_over_mg", true, "m",
       "kinetic temperature T_z/(m g), vertical, without the mean motion of each layer of 1 D at each moment, as from "
       "a film; with \"frame_rate\" that of displacements",
       true},
  };
  return all;
}

std::size_t observable_number(std::string_view name) {
  const auto& all = observables();
  return static_cast<std::size_t>(
      std::find_if(all.begin(), all.end(), [&](const Observable& o) { return o.name == name; }) - all.begin());
}

double value_at(const std::vector<double>& places, const std::vector<double>& values, double place) {
  const auto above = std::lower_bound(places.begin(), places.end(), place);
  if (above == places.begin()) return values.front();
  if (above == places.end()) return values.back();
  const auto i = static_cast<std::size_t>(above - places.begin());
  const double part = (place - places[i - 1]) / (places[i] - places[i - 1]);
  return values[i - 1] + part * (values[i] - values[i - 1]);
}

std::vector<View> views_of(std::uint32_t moments, double average, std::optional<double> phase) {
  if (phase) return {{"average", -1, 0}, {number_text(*phase), *phase, 1}};
  std::vector<View> views{{"average", -1, moments == 0 ? 1 : average}};
  for (std::uint32_t k = 0; k < moments; ++k) {
    const double at = static_cast<double>(k) / moments;
    views.push_back({number_text(at), at, (1 - average) / moments});
  }
  return views;
}

// --- the bed

SceneOptions BedOfInference::at(const Parameters& parameters, const std::vector<double>& values,
                                std::vector<Problem>& problems) const {
  JsonNode node = scene;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    for (const std::string& pointer : parameters[k].second.set)
      set_pointer(node, pointer, to_node(parameters[k].second.written(values[k])), ValueFrom::file);
  }
  return read(node, problems);
}

SceneOptions BedOfInference::read(const JsonNode& node, std::vector<Problem>& problems) const {
  Fields::Source own = source;
  own.problems = &problems, own.warnings = nullptr, own.input_files = nullptr;
  Fields fields = Fields::decode(node, "", own);
  fields.set_reduced(reduced);
  SceneOptions bed;
  bed.describe(fields);
  fields.finish();
  return bed;
}

Json BedOfInference::written_out(const JsonNode& node) const {
  std::vector<Problem> problems;
  SceneOptions bed = read(node, problems);
  Json out = Json::object();
  Fields fields = Fields::encode(out);
  fields.set_reduced(reduced);
  bed.describe(fields);
  return out;
}

namespace {

std::vector<double> numbers_of(const Observers& observers, const sim::Scene& scene, const BedOfInference& options,
                               double length) {
  std::vector<double> out(number_count, NAN);
  const sim::BedObserver& bed = *observers.bed;
  const sim::Profile profile = bed.density(false);
  fit::FitOptions fit;
  fit.plateau_density = options.plateau_density;
  fit.column_number = scene.count() / scene.box.width;
  fit.kernel = {KernelKind::gaussian, options.kernel_width};
  fit.interval = fit.sweep = fit.compare = false;
  fit.curve_points = 0;
  const fit::FitResult result =
      fit::fit_profile({profile.height, profile.number_density, profile.std_error, {}, 0}, fit);
  if (result.status == fit::FitStatus::ok) {
    out[fitted] = result.temperature.value * length;
    out[shift] = result.shift.value;
    out[solid] = result.solid_height_by_sum_rule;
  }
  out[density] = *std::max_element(profile.number_density.begin(), profile.number_density.end());
  out[kinetic_x] = bed.temperature_x().value * length;
  out[kinetic_z] = bed.temperature_z().value * length;
  out[kinetic_z_local] = bed.temperature_z_local().value * length;
  const sim::FlowFreeTemperature& now = *observers.flow_free;
  const sim::FlowFreeDisplacement& filmed = *observers.filmed;
  out[flow_free_x] = (options.frame_rate ? filmed.x() : now.x()).value * length;
  out[flow_free_z] = (options.frame_rate ? filmed.z() : now.z()).value * length;
  out[rise] = bed.centre_of_mass().value - sim::ideal_centre_of_mass(scene);
  for (const double height : options.heights) out.push_back(value_at(profile.height, profile.number_density, height));
  return out;
}

}  // namespace

std::uint32_t BedOfInference::looks(const SceneOptions& bed) const {
  if (!frame_rate) return phases;
  return static_cast<std::uint32_t>(std::max(1L, std::lround(*frame_rate * bed.period() * bed.time_unit())));
}

sim::MeasurementSchedule BedOfInference::schedule(const SceneOptions& bed, double duration) const {
  sim::MeasurementSchedule times;
  times.period = bed.period();
  times.settle = std::ceil(settle / bed.time_unit() / times.period * (1 - 1e-12)) * times.period;
  times.periods =
      std::max<std::uint64_t>(1, static_cast<std::uint64_t>(duration / bed.time_unit() / times.period * (1 + 1e-12)));
  times.phases = looks(bed);
  return times;
}

std::vector<double> BedOfInference::run(const SceneOptions& bed, std::uint64_t seed, double duration,
                                        const RunContext& context, const std::function<void(double)>& progress) const {
  const sim::Scene scene_at = bed.scene(seed);
  const sim::MeasurementSchedule times = schedule(bed, duration);
  const double column = scene_at.count() / scene_at.box.width;
  const double lowest = -std::ceil((6 * kernel_width + 3) / profile_spacing) * profile_spacing;
  const HeightGrid grid{lowest, profile_spacing, static_cast<std::size_t>((5 * column + 30) / profile_spacing)};
  std::vector<std::unique_ptr<AtPhase>> of_views;
  std::vector<sim::RunObserver*> observers;
  for (const View& view : views) {
    const bool average = view.phase < 0;
    const std::uint32_t all = times.phases;
    const auto phase = static_cast<std::uint32_t>(std::lround(std::max(0.0, view.phase) * all)) % all;
    of_views.push_back(std::make_unique<AtPhase>(
        Observers(scene_at, average ? all : 1, grid, {KernelKind::gaussian, kernel_width}, frame_rate.has_value()),
        average ? std::nullopt : std::optional(phase)));
    observers.push_back(of_views.back().get());
  }
  sim::RunControl control;
  const double periods = times.settle / times.period + static_cast<double>(times.periods);
  // It is asked at every look, too.
  const double most_questions = most_events * scene_at.count() * periods / events_between_questions +
                                2 * static_cast<double>(times.looks()) + 1000;
  double questions = 0;
  control.events_between_questions = events_between_questions;
  control.progress = [&](double fraction, sim::RunPart) { progress(fraction); };
  control.stop = [&] { return context.interrupted() || ++questions > most_questions; };
  if (!sim::measure(scene_at, times, observers, control).finished) {
    context.check_interrupted();
    return std::vector<double>(numbers() * views.size(), NAN);
  }
  const double length = bed.length_unit();
  std::vector<double> out;
  for (const auto& view : of_views) {
    const std::vector<double> own = numbers_of(view->observers(), scene_at, *this, length);
    out.insert(out.end(), own.begin(), own.end());
  }
  return out;
}

}  // namespace shakebed::pipelines
