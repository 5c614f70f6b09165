#include "pipelines/stages/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "fit/profile_fit/simulated_profiles.hpp"
#include "fit/theory/expansion.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/bed_facts.hpp"
#include "pipelines/stages/fit_results.hpp"
#include "pipelines/stages/kernel_options.hpp"
#include "pipelines/stages/measured_profile.hpp"
#include "pipelines/stages/theory.hpp"
#include "statistics/kernel.hpp"

namespace shakebed::pipelines {
namespace {

enum class ErrorSource { automatic, diagonal, covariance };

struct WindowChoice {
  std::optional<double> low, high;
  double floor_exclusion = fit::WindowOptions{}.floor_exclusion;
  double plateau_fraction = fit::WindowOptions{}.plateau_fraction;
  double lowest_fraction = fit::WindowOptions{}.lowest_fraction;
  double lowest_significance = fit::WindowOptions{}.lowest_significance;
};

const std::string simulation_model = "simulation";

// The tail of a bed: densities below this one, in 1/D^2, about half that of the solid.
constexpr double tail_density = 0.6;

void describe_window(Fields& f, WindowChoice& w) {
  f.number("low", w.low,
           {.help = "lowest height that is used, in D; default: found from floor_exclusion and plateau_fraction"});
  f.number("high", w.high,
           {.help = "highest height that is used, in D; default: found from lowest_fraction and lowest_significance"});
  f.number("floor_exclusion", w.floor_exclusion,
           {.help = "smallest distance of a used height from the base (lower edge of the bed), in D",
            .range = non_negative});
  f.number(
      "plateau_fraction", w.plateau_fraction,
      {.help = "fraction of the maximum of the smoothed density at which the window begins", .range = zero_to_one});
  f.number("lowest_fraction", w.lowest_fraction,
           {.help = "fraction of the maximum density below which the window ends", .range = zero_to_one});
  f.number(
      "lowest_significance", w.lowest_significance,
      {.help = "number of standard errors of the density below which the window ends, too", .range = non_negative});
  f.require(!w.low || !w.high || *w.low < *w.high, "low",
            "the highest height of the window, \"high\", must be above the lowest, \"low\"");
}

// What goes into a fit.
struct FitTask {
  const Input* source = nullptr;  // the first stage of "from"
  std::filesystem::path path;     // of the profile
  MeasuredProfile measured;
  fit::FitOptions options;  // with what the inputs say in place of what was left out
  std::optional<double> diameter;
};

// A bed of the library: its temperature is that of its reservoir, or else its kinetic one.
struct LibraryBed {
  std::string id;
  fit::SimulatedProfile profile;
  Kernel kernel;
};

class Fit : public Stage {
 public:
  void describe(Fields& fields) override {
    describe_model(fields);
    describe_data(fields);
    describe_results(fields);
    if (!fields.decoding()) return;
    check_bed(fields);
    check_bootstrap(fields);
    check_inputs(fields);
    check_model(fields);
  }

  void results(ResultList& list) const override {
    state_fit_results(list, {.matched = options_.model == simulation_model,
                             .bootstrap = bootstrap_ > 0,
                             .answer = answer_ && options_.model != simulation_model});
  }
  void run(RunContext& context) const override;

 private:
  void describe_model(Fields& fields) {
    fields.input_files("profile", profile_,
                       {.help = "CSV file of your own profile, with columns height [D] and number_density [1/D^2]; "
                                "default: the profile of the stage in \"from\"",
                        .example = "\"profile.csv\""});
    fields.text("table", table_,
                {.help = "table of the stage in \"from\" whose profile is fitted: profile.csv, or profile_phase_00.csv "
                         "for one phase of the shaking"});
    fields.text("model", options_.model,
                {.help = "model: enskog-rectangle, hydrostatic:<equation of state>, fermi, rectangle or simulation. "
                         "Simulation compares the profile of the first stage in \"from\" (or of \"profile\") with "
                         "those of all other simulate stages there, whose temperatures are known",
                 .example = "\"enskog-rectangle\""});
    fields.number(
        "plateau_density", options_.plateau_density,
        {.help = "density phi_0 of the solid in 1/D^2: 2/sqrt(3) in equilibrium, 1.10 for the published experiment",
         .range = {.low = 0, .high = fit::close_packing_density * (1 + 1e-12), .above_low = true}});
    fields.boolean("plateau_density_free", options_.plateau_density_free,
                   {.help = "whether phi_0 is fitted too. T is then too low. By default \"models\" of fit.json "
                            "contains this fit, too"});
    fields.number("temperature", options_.fixed_temperature,
                  {.help = "fixed value of T, in m g D; default: T is fitted", .range = positive});
    fields.boolean(
        "temperature_measured", temperature_measured_,
        {.help = "whether T is fixed at the kinetic temperature (T_x + T_z)/2 of the simulated bed in \"from\""});
    fields.number(
        "shift", options_.fixed_shift,
        {.help = "fixed value of the shift (height at which the fluid begins), in D; default: the shift is fitted"});
    fields.number("column_number", options_.column_number,
                  {.help = "column number N D/W; default: that of the measurement", .range = positive});
    fields.boolean("constrain_column", options_.constrain_column,
                   {.help = "whether the shift follows from T by the sum rule: the area under the model is N D/W"});
    fields.number("base", options_.base, {.help = "height of the lower edge of the bed, in D"});
    fields.quantity(
        "diameter", diameter_, dimension::length,
        {.help = "diameter D, for T/(m g) as a length; default: that of the measurement", .range = positive});
  }

  // The window and the errors of the data.
  void describe_data(Fields& fields) {
    fields.object<Kernel>("kernel", kernel_, describe_kernel,
                          {.help = "kernel through which the profile was measured; the model is smoothed with it "
                                   "before the comparison. Default: the kernel named in the profile"});
    fields.object<WindowChoice>("window", window_, describe_window, {.help = "range of heights that is fitted"});
    fields.choice(
        "errors", errors_,
        {{ErrorSource::automatic, "automatic"},
         {ErrorSource::diagonal, "diagonal"},
         {ErrorSource::covariance, "covariance"}},
        {.help = "errors that the fit uses. Covariance: with the correlations between heights, which simulate and "
                 "extract measure. Diagonal: standard errors alone; the error of T is then too small. "
                 "Automatic: covariance where there is one"});
  }

  // How it is fitted, and what else is to be found.
  void describe_results(Fields& fields) {
    fields.boolean("robust", options_.robust,
                   {.help = "whether outliers count linearly instead of quadratically (Huber's loss)"});
    fields.boolean("sweep", options_.sweep, {.help = "whether the fit is repeated in other windows (windows.csv)"});
    fields.boolean("compare", options_.compare,
                   {.help = "whether other models, and a free phi_0, are fitted too (\"models\" of fit.json)"});
    fields.boolean("answer", answer_,
                   {.help = "whether one answer is given from several models and windows: T with its whole "
                            "uncertainty, and whether the bed has one temperature"});
    fields.integer("bootstrap", bootstrap_,
                   {.help = "number of bootstrap resamples of the frames, for the error of T from the frames alone; it "
                            "needs an extract stage, or a simulate stage with \"frames\". 0: none",
                    .range = from_to(0, 100'000)});
  }

  // What the bed knows may not be stated otherwise.
  void check_bed(Fields& fields) const {
    if (const KnownBed* known = fields.known_bed()) {
      require_same_as_bed(fields, "diameter", diameter_, known->bed.diameter, dimension::length);
      if (fields.has_upstream("simulate") && !known->bed.reduced)
        require_same_as_bed(fields, "column_number", options_.column_number, known->bed.column_number(),
                            dimension::none);
    }
  }

  void check_bootstrap(Fields& fields) const {
    fields.require(bootstrap_ == 0 || fields.has_upstream("extract") || fields.has_upstream("simulate"), "bootstrap",
                   "there are no frames to resample: no extract or simulate stage in \"from\"");
    fields.require(bootstrap_ == 0 || options_.model != simulation_model, "bootstrap",
                   "the error of the model simulation comes from its library, not from resampled frames",
                   "Leave \"bootstrap\" out or choose another model");
  }

  void check_inputs(Fields& fields) const {
    fields.require(options_.model != simulation_model || fields.has_upstream("simulate"), "model",
                   "the model simulation needs simulate stages in \"from\" as its library");
    fields.require(options_.model == simulation_model || fields.upstream().size() <= 2, "from",
                   "only the model simulation reads more than two stages");
    const bool upstream = !fields.upstream().empty();
    fields.require(!temperature_measured_ || fields.has_upstream("simulate"), "temperature_measured",
                   "no simulate stage in \"from\" gives a measured temperature");
    fields.require(!temperature_measured_ || !options_.fixed_temperature, "temperature_measured",
                   "T is already fixed by \"temperature\"; give one of the two");
    fields.require(upstream || fields.has("profile"), "",
                   "there is no profile: neither \"profile\" nor a stage in \"from\"", "Give one of the two");
    fields.require(profile_.empty() || !fields.has("table"), "table",
                   "\"table\" is one of the stage in \"from\", but \"profile\" names a file", "Give one of the two");
    fields.require(profile_.paths.size() <= 1, "profile",
                   fmt::format("this names {} files, but the stage fits one profile", profile_.paths.size()),
                   "Give the path of one CSV file");
  }

  void check_model(Fields& fields) const {
    const std::string& model = options_.model;
    bool known = model == "enskog-rectangle" || model == "fermi" || model == "rectangle" || model == simulation_model;
    std::vector<std::string> names{"enskog-rectangle", "fermi", "rectangle", simulation_model};
    for (const fit::EquationOfState* row : fit::equations_of_state()) {
      names.push_back("hydrostatic:" + std::string(row->name()));
      known = known || names.back() == model;
    }
    const std::string nearest = nearest_name(model, names);
    fields.require(known, "model", fmt::format("there is no model \"{}\"", model),
                   nearest.empty() ? fmt::format("Choose from: {}", fmt::join(names, ", "))
                                   : fmt::format("Did you mean \"{}\"?", nearest));
  }

  FitTask read_profile(RunContext& context) const;
  void take_bed_facts(const RunContext& context, FitTask& task) const;
  void set_options(FitTask& task) const;
  std::vector<LibraryBed> read_library(const RunContext& context, const FitTask& task) const;
  Json bootstrap(const FitTask& task, RunContext& context) const;

  InputFiles profile_;
  std::string table_ = "profile.csv";  // of the stage, in place of our own file
  fit::FitOptions options_;
  std::optional<double> diameter_;
  std::optional<Kernel> kernel_;
  WindowChoice window_;
  ErrorSource errors_ = ErrorSource::automatic;
  bool temperature_measured_ = false;
  bool answer_ = true;
  std::uint32_t bootstrap_ = 0;
};

LibraryBed library_bed(const Input& input) {
  const MeasuredProfile measured = read_measured_profile(input.file("profile.csv"));
  LibraryBed bed{input.id, {0, measured.profile, 0}, measured.kernel};
  bed.profile.temperature = BedDescription::read(input.file("bed.json")).bath_temperature;
  if (!(bed.profile.temperature > 0)) {
    const Json observed = input.result();
    const Json *x = find_pointer(observed, "/temperature_x/value"), *z = find_pointer(observed, "/temperature_z/value");
    if (x == nullptr || z == nullptr || !(x->get<double>() + z->get<double>() > 0))
      throw InputError(input.id + ": this bed has no temperature, so it cannot be used in a library of beds");
    bed.profile.temperature = (x->get<double>() + z->get<double>()) / 2;
  }
  return bed;
}

// The simulation as the model, in the form of every other fit.
struct Matched {
  fit::FitResult fit;
  Json library = Json::array();
  double interpolation_error = 0;
  std::optional<double> scatter;  // relative, of the library's own beds matched against one another
};

// T_c by Enskog's equation, where the column number is known.
void add_critical_temperature(const fit::FitOptions& options, fit::FitResult& fit) {
  fit.plateau_density = {options.plateau_density, 0, true};
  if (!options.column_number) return;
  fit.column_number = {*options.column_number, 0, true};
  const fit::Value critical =
      fit::critical_temperature(fit::enskog(), {*options.column_number, options.plateau_density});
  fit.critical_status = critical.status;
  if (!critical.ok()) return;
  fit.critical_temperature = {critical.value, 0, true};
  fit.reduced_temperature = {fit.temperature.value / critical.value, fit.temperature.std_error / critical.value};
}

// With T known the tail says where the solid ends.
void add_solid_height(const fit::Profile& measured, const fit::FitOptions& options, fit::FitResult& fit) {
  fit::FitOptions tail = options;
  tail.model = "enskog-rectangle";
  tail.window = {};
  tail.window.below_density = tail_density;
  tail.interval = tail.sweep = tail.compare = false;
  tail.curve_points = 0;
  const auto at = [&](double temperature) {
    tail.fixed_temperature = temperature;
    return fit::fit_profile(measured, tail);
  };
  const fit::FitResult best = at(fit.temperature.value), warmer = at(fit.temperature.value + fit.temperature.std_error);
  if (best.ok() && warmer.ok()) {
    fit.shift = best.shift, fit.solid_height = best.solid_height;
    fit.shift.std_error = std::hypot(best.shift.std_error, warmer.shift.value - best.shift.value);
    fit.solid_height.std_error =
        std::hypot(best.solid_height.std_error, warmer.solid_height.value - best.solid_height.value);
    fit.solid_height_by_sum_rule = best.solid_height_by_sum_rule;
  }
  fit.area = best.area;
}

// The matched profile beside the measured one, height by height.
void add_curve(const fit::Profile& measured, const fit::MatchResult& found, fit::FitResult& fit) {
  for (std::size_t i = 0; i < measured.height.size(); ++i) {
    fit::Residual r{measured.height[i], measured.number_density[i],
                    measured.std_error.empty() ? 0 : measured.std_error[i], 0, false};
    for (std::size_t k = 0; k < found.height.size(); ++k) {
      if (found.height[k] == r.height) r.model = found.density[k], r.used = true;
    }
    if (r.used) fit.curve.push_back({r.height, r.model, r.model});
    fit.residuals.push_back(r);
  }
}

Matched match(const FitTask& task, const std::vector<LibraryBed>& beds, const WindowChoice& window) {
  const fit::Profile& measured = task.measured.profile;
  Matched out;
  std::vector<fit::SimulatedProfile> library;
  for (const LibraryBed& bed : beds) {
    library.push_back(bed.profile);
    out.library.push_back(Json{{"stage", bed.id}, {"temperature", quantity_json(bed.profile.temperature, "m g D")}});
  }
  fit::MatchOptions how;
  if (window.low) how.low = *window.low;
  if (window.high) how.high = *window.high;
  const fit::MatchResult found = fit::match_simulated(measured, library, how);
  fit::FitResult& fit = out.fit;
  fit.status = found.status, fit.message = found.message, fit.model = simulation_model;
  fit.kernel = task.options.kernel;
  fit.temperature = found.temperature, fit.temperature_interval = found.interval;
  fit.warnings = found.warnings;
  fit.chi2 = found.chi2, fit.dof = found.dof, fit.chi2_per_dof = found.chi2_per_dof, fit.bins = found.bins;
  fit.statistical_error = found.temperature.std_error;  // without the scatter of the library, which follows
  if (found.dof > 0) {                                  // the temperature is the one parameter
    fit.p_value = fit::chance_of_chi2(found.chi2, found.dof);
    fit.aic = found.chi2 + 2, fit.bic = found.chi2 + std::log(found.bins);
  }
  out.interpolation_error = found.interpolation_error;
  const fit::Value scatter = fit::library_scatter(fit::test_library(library, how), found.temperature.value);
  if (found.status == fit::FitStatus::ok && scatter.ok()) {
    out.scatter = scatter.value;
    fit.temperature.std_error = std::max(fit.temperature.std_error, scatter.value * found.temperature.value);
  }
  if (!found.height.empty()) fit.window_low = found.height.front(), fit.window_high = found.height.back();
  fit.window_rule = "every bin from " + number_text(how.low) + " D up";
  add_critical_temperature(task.options, fit);
  if (found.status == fit::FitStatus::ok) add_solid_height(measured, task.options, fit);
  add_curve(measured, found, fit);
  return out;
}

// The profile of each frame by itself, in the order of time: from disks.csv or from a trajectory.
fit::ProfileFrames frames_of(const Input& source, const std::vector<double>& heights, const Kernel& kernel) {
  if (kernel.kind == KernelKind::none)
    throw InputError("\"bootstrap\": the profile was measured without a kernel, but the bootstrap needs a kernel");
  if (heights.size() < 3) throw InputError("\"bootstrap\": the profile has fewer than three heights");
  const double spacing = (heights.back() - heights.front()) / static_cast<double>(heights.size() - 1);
  const HeightGrid grid{heights.front(), spacing, heights.size()};
  fit::ProfileFrames frames;
  frames.height = heights;
  std::vector<double> density(heights.size());
  const auto add = [&](const std::vector<double>& z, double width) {
    std::fill(density.begin(), density.end(), 0.0);
    add_density(grid, kernel, width, z, 0.0, density);
    frames.number_density.insert(frames.number_density.end(), density.begin(), density.end());
  };
  if (source.stage == "simulate") {
    const std::string name = source.has("trajectory.extxyz") ? "trajectory.extxyz" : "trajectory.extxyz.zst";
    if (!source.has(name))
      throw InputError("\"bootstrap\": " + source.id + " stored no frames; add \"frames\": {\"count\": 640} to it");
    TrajectoryReader reader(source.file(name));
    TrajectoryFrame frame;
    while (reader.read(frame)) add(frame.z, frame.width);
    return frames;
  }
  const Json extracted = source.result();
  const Json* width = find_pointer(extracted, "/width/value");
  if (width == nullptr || !width->is_number())
    throw InputError(
        "\"bootstrap\": the frames do not give the width of the bed; give \"left_wall\" and \"right_wall\" to the "
        "extract stage");
  const std::filesystem::path path = source.file("disks.csv");
  std::vector<double> z;
  std::string current;
  each_csv_line(read_file(path), [&](const std::vector<std::string>& cells, std::size_t) {
    if (cells[0] == "frame") return;
    if (cells.size() < 6) throw InputError(path.string() + ": expected frame,x_px,y_px,radius_px,x,z,quality");
    if (cells[0] != current) {
      if (!current.empty()) add(z, width->get<double>());
      z.clear();
      current = cells[0];
    }
    z.push_back(std::strtod(cells[5].c_str(), nullptr));
  });
  if (!current.empty()) add(z, width->get<double>());
  return frames;
}

Json bootstrap_json(const fit::BootstrapResult& result, std::uint32_t resamples) {
  Json out{{"status", fit::to_string(result.status)},
           {"resamples", resamples},
           {"succeeded", result.succeeded},
           {"window_frames", result.window}};
  if (!result.message.empty()) out["message"] = result.message;
  if (result.status != fit::FitStatus::ok) return out;
  out["temperature"] = quantity_json(result.temperature.value, "m g D", result.temperature.std_error);
  out["shift"] = quantity_json(result.shift.value, "D", result.shift.std_error);
  out["temperature_interval"] = Json{{"low", result.temperature_interval.low},
                                     {"high", result.temperature_interval.high},
                                     {"confidence", result.temperature_interval.confidence}};
  return out;
}

// curve.csv (the model), residuals.csv (every height of the profile), windows.csv (temperature against window).
void write_tables(RunContext& context, const fit::FitResult& result) {
  Table curve = context.table("curve.csv");
  curve.note("model", result.model);
  for (const fit::CurvePoint& point : result.curve) curve.add({point.height, point.density, point.smoothed_density});
  curve.write(context.output("curve.csv"));
  Table residuals = context.table("residuals.csv");
  for (const fit::Residual& r : result.residuals)
    residuals.add({r.height, r.density, r.std_error, r.model, count_cell(r.used ? 1 : 0)});
  residuals.write(context.output("residuals.csv"));
  Table windows = context.table("windows.csv");
  for (const fit::WindowFit& w : result.window_sweep)
    windows.add({w.low, w.high, count_cell(w.bins), w.temperature.value, w.temperature.std_error, w.shift.value,
                 w.chi2_per_dof, std::string(fit::to_string(w.status))});
  windows.write(context.output("windows.csv"));
}

// From the profile alone, whatever model the stage fits, and the kinetic temperatures of the first input that has some.
Json answer_of(const FitTask& task, const RunContext& context) {
  const fit::FitOptions& options = task.options;
  fit::AnswerInput input;
  input.profile = task.measured.profile, input.kernel = options.kernel;
  input.diameter = task.diameter;
  if (options.base != fit::FitOptions{}.base) input.base = options.base;  // else that of a hexagonal bed
  input.column_number = options.column_number;
  for (const Input& upstream : context.inputs()) {
    const KineticTemperatures kinetic = kinetic_temperatures(upstream, task.diameter);
    if (!input.temperature_x) input.temperature_x = kinetic.x, input.temperature_z = kinetic.z;
    input.contact_duration_effect = std::max(input.contact_duration_effect, contact_duration_effect(upstream));
  }
  // Of the profile's own stage alone: a profile of the user's is not what it measured.
  if (task.source != nullptr && task.path == task.source->directory / "profile.csv")
    input.objections = objections_of(*task.source), input.origin_error = origin_error(*task.source),
    input.scale_error = scale_error(*task.source), input.shaken = is_shaken(*task.source),
    input.width_between_walls = width_between_walls(*task.source);
  Json answer = answer_json(fit::find_answer(input), task.diameter);
  for (const Input& upstream : context.inputs()) add_judgement(upstream.result(), answer);
  return answer;
}

// Our own file, else the profile of the first stage of "from", with its covariance where that is asked for.
FitTask Fit::read_profile(RunContext& context) const {
  FitTask task;
  task.options = options_;
  task.diameter = diameter_;
  task.source = context.inputs().empty() ? nullptr : &context.inputs().front();
  task.path = !profile_.empty() ? std::filesystem::path(profile_.paths.front()) : task.source->file(table_);
  const bool has_covariance =
      task.source != nullptr && profile_.empty() && table_ == "profile.csv" && task.source->has("covariance.csv");
  if (errors_ == ErrorSource::covariance && !has_covariance)
    throw InputError("\"errors\": \"covariance\" needs the profile of a simulate or extract stage");
  const bool use_covariance = errors_ != ErrorSource::diagonal && has_covariance && options_.model != simulation_model;
  task.measured = read_measured_profile(
      task.path, use_covariance ? std::optional(task.source->file("covariance.csv")) : std::nullopt, kernel_);
  for (const std::string& warning : task.measured.warnings) context.warning(warning);
  return task;
}

// What the options leave out: diameter, column number, temperature. The description of the bed goes on with the fit.
void Fit::take_bed_facts(const RunContext& context, FitTask& task) const {
  fit::FitOptions& options = task.options;
  for (const Input& input : context.inputs()) {
    if (!input.has("bed.json")) continue;
    const BedDescription bed = BedDescription::read(input.file("bed.json"));
    if (!task.diameter && !bed.reduced) task.diameter = bed.diameter;
    if (!options.column_number && input.stage == "simulate") options.column_number = bed.column_number();
    write_file(context.output("bed.json"), dump(bed.to_json()));
  }
  if (!options.column_number) options.column_number = task.measured.column_number;
  if (!temperature_measured_) return;
  const Json bed = context.input("simulate").result();
  const Json *x = find_pointer(bed, "/temperature_x/value"), *z = find_pointer(bed, "/temperature_z/value");
  if (x == nullptr || z == nullptr || !(x->get<double>() + z->get<double>() > 0))
    throw InputError("the simulated bed has no kinetic temperature to which T could be fixed");
  options.fixed_temperature = (x->get<double>() + z->get<double>()) / 2;
}

void Fit::set_options(FitTask& task) const {
  task.options.kernel = task.measured.kernel;
  fit::WindowOptions& window = task.options.window;
  window.low = window_.low, window.high = window_.high;
  window.floor_exclusion = window_.floor_exclusion, window.plateau_fraction = window_.plateau_fraction;
  window.lowest_fraction = window_.lowest_fraction, window.lowest_significance = window_.lowest_significance;
}

// All simulated beds but the one that is fitted.
std::vector<LibraryBed> Fit::read_library(const RunContext& context, const FitTask& task) const {
  std::vector<LibraryBed> beds;
  for (const Input& input : context.inputs()) {
    if (input.stage != "simulate" || (profile_.empty() && &input == task.source)) continue;
    beds.push_back(library_bed(input));
    if (beds.back().kernel != task.options.kernel)
      throw InputError(
          fmt::format("{}: its profile was measured through the kernel {}, but the profile to be fitted through {}. "
                      "Measure both through the same kernel.",
                      input.id, to_string(beds.back().kernel), to_string(task.options.kernel)));
  }
  return beds;
}

Json Fit::bootstrap(const FitTask& task, RunContext& context) const {
  context.progress(0.3, "resampling");
  fit::BootstrapOptions how;
  how.resamples = static_cast<int>(bootstrap_);
  const fit::ProfileFrames frames = frames_of(*task.source, task.measured.profile.height, task.options.kernel);
  const fit::BootstrapResult found = fit::bootstrap_fit(frames, task.options, how);
  if (found.status != fit::FitStatus::ok) context.warning("bootstrap: " + found.message);
  return bootstrap_json(found, bootstrap_);
}

void Fit::run(RunContext& context) const {
  FitTask task = read_profile(context);
  take_bed_facts(context, task);
  set_options(task);
  context.progress(0.1, "fitting");
  const bool matching = options_.model == simulation_model;
  const Matched matched = matching ? match(task, read_library(context, task), window_) : Matched{};
  const fit::FitResult result = matching ? matched.fit : fit::fit_profile(task.measured.profile, task.options);
  if (result.status == fit::FitStatus::bad_input)
    throw InputError(fmt::format("{}: {}", task.path.string(), result.message));
  for (const std::string& warning : result.warnings) context.warning(warning);
  Json json = fit_json(result, task.diameter);
  if (matching) {
    json["library"] = matched.library;
    json["interpolation_error"] = quantity_json(matched.interpolation_error, "m g D");
    json["library_scatter"] = matched.scatter ? Json(*matched.scatter) : Json();
  }
  if (answer_ && !matching) json["answer"] = answer_of(task, context);
  if (bootstrap_ > 0) json["bootstrap"] = bootstrap(task, context);
  if (!json["describes_data"].get<bool>()) {
    context.warning(fmt::format("{}{} does not describe this profile: {}", result.model,
                                json.contains("answer") ? " alone" : "", json["why_not"].get<std::string>()));
  }
  write_file(context.output("fit.json"), dump(json));
  write_tables(context, result);
}

}  // namespace

StageRow fit_stage() {
  return {.name = "fit",
          .summary = "fits temperature and solid height to a density profile",
          .accepts = {"extract", "simulate"},
          .fewest_inputs = 0,
          .most_inputs = 64,
          .result = "fit.json",
          .headline = {"temperature", "temperature_over_mg", "solid_height", "reduced_temperature", "chi2_per_dof"},
          .answer = "/answer",
          .pages = fit_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Fit>(); }};
}

}  // namespace shakebed::pipelines
