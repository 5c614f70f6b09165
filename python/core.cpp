// The compiled half of the Python module without images: simulation, fits, theory, recipes. What is for users is in
// shakebed/*.py; names here begin with a word of what they do and take plain values.
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <optional>
#include <tuple>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/read_recipe.hpp"
#include "pipelines/stages/measure_options.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/theory.hpp"
#include "python/module.hpp"
#include "sim/measure/measured_bed.hpp"

namespace shakebed::python {

namespace {

using pipelines::Json;

constexpr std::size_t columns = 5;                           // of a trajectory: x, z, vx, vz, spin
constexpr std::uint64_t events_between_questions = 200'000;  // 0.03 to 0.1 s of processor time, as in sim/measure

py::object from_json(const Json& json) {
  return py::module_::import("json").attr("loads")(pipelines::dump_17_digits(json));
}

Kernel kernel_named(const std::string& text) {
  if (const auto kernel = kernel_from(text)) return *kernel;
  throw Mistake(fmt::format(
      "there is no kernel \"{}\"; write none, gaussian:0.5, top_hat:1 or disk_chord:1 (widths in D)", text));
}

py::dict problem_dict(const pipelines::Problem& problem) {
  py::dict out;
  out["file"] = problem.file;
  out["line"] = problem.at.line;
  out["column"] = problem.at.column;
  out["pointer"] = problem.pointer;
  out["problem"] = problem.what;
  out["suggestion"] = problem.suggestion;
  return out;
}

py::list problem_list(const std::vector<pipelines::Problem>& problems) {
  py::list out;
  for (const pipelines::Problem& problem : problems) out.append(problem_dict(problem));
  return out;
}

// ------------------------------------------------------------------------------------------------ scenes

// A recipe's stage `simulate`, read and checked.
struct SceneOfRecipe {
  std::vector<pipelines::Problem> warnings;  // what is odd about it, though it can be simulated
  pipelines::SceneOptions bed;
  sim::Scene scene;
  sim::MeasureOptions options;
};

// What the stage `simulate` offers beyond one bed that is measured in memory.
void refuse_more(const pipelines::PlannedStage& stage, const std::string& file) {
  const auto refuse = [&](const char* key) {
    throw pipelines::ConfigError(
        {{.file = file,
          .at = {},
          .pointer = stage.pointer + "/" + key,
          .what = fmt::format("\"{}\" cannot be used for a bed that is simulated in memory", key),
          .suggestion = "Use shakebed.run() with a recipe"}});
  };
  if (stage.options.value("replicas", 1) != 1) refuse("replicas");
  if (stage.options.contains("schedule") && !stage.options["schedule"].empty()) refuse("schedule");
  if (stage.options.contains("observe") && !stage.options["observe"].empty()) refuse("observe");
  if (!stage.from.empty()) refuse("from");
}

const pipelines::PlannedStage& simulate_stage_of(const pipelines::Plan& plan) {
  const pipelines::PlannedStage* found = nullptr;
  for (const pipelines::PlannedStage& stage : plan.stages) {
    if (stage.row->name != "simulate") continue;
    if (found != nullptr)
      throw pipelines::UsageError("the recipe has more than one stage \"simulate\"; pass one of them");
    found = &stage;
  }
  if (found == nullptr) throw pipelines::UsageError("the recipe has no stage \"simulate\"");
  return *found;
}

SceneOfRecipe read_scene(const std::string& text, const std::string& file, const std::string& directory) {
  const pipelines::Plan plan = pipelines::read_recipe_text(text, file, directory);
  const pipelines::PlannedStage& stage = simulate_stage_of(plan);
  refuse_more(stage, file);
  // The plan has checked every key: what is read here once more cannot be wrong.
  std::vector<pipelines::Problem> problems;
  const pipelines::Fields::Source source{.file = file, .directory = directory, .problems = &problems};
  const pipelines::JsonNode* node = pipelines::find_pointer(plan.document, stage.pointer);
  SceneOfRecipe out;
  for (const pipelines::Warning& warning : plan.warnings)
    if (warning.problem.pointer.starts_with(stage.pointer)) out.warnings.push_back(warning.problem);
  pipelines::Fields fields = pipelines::Fields::decode(*node, stage.pointer, source);
  fields.set_reduced(stage.reduced);
  out.bed.describe(fields);
  pipelines::BedMeasureOptions measure;
  measure.describe(fields);
  if (!problems.empty()) throw pipelines::ConfigError(problems);
  out.scene = out.bed.scene(stage.seed);
  out.options = measure.reduced(out.bed.time_unit());
  return out;
}

// ------------------------------------------------------------------------------------------------ a measured bed

struct Bed {
  SceneOfRecipe input;
  sim::MeasuredBed measured;
  std::vector<double> trajectory;  // frames x disks x columns
  std::vector<double> times, phases, floor, floor_velocities;
};

void put_frame(Bed& bed, const sim::Snapshot& at, double phase) {
  for (std::size_t i = 0; i < at.x.size(); ++i)
    for (const double value : {at.x[i], at.z[i], at.vx[i], at.vz[i], at.spin.empty() ? 0.0 : at.spin[i]})
      bed.trajectory.push_back(value);
  bed.times.push_back(at.time);
  bed.phases.push_back(phase);
  bed.floor.push_back(at.floor_position);
  bed.floor_velocities.push_back(at.floor_velocity);
}

std::shared_ptr<Bed> simulate(const std::string& text, const std::string& file, const std::string& directory,
                              py::object progress) {
  auto bed = std::make_shared<Bed>();
  bed->input = read_scene(text, file, directory);
  Caller caller(std::move(progress));
  sim::MeasureOptions options = bed->input.options;
  options.stop = [&] { return caller.stop(); };
  options.progress = [&](double fraction) { caller.progress(fraction); };
  options.frame_sink = [&](const sim::Snapshot& at, double phase) { put_frame(*bed, at, phase); };
  {
    const py::gil_scoped_release release;
    bed->trajectory.reserve(options.frames * bed->input.scene.count() * columns);
    bed->measured = sim::measure(bed->input.scene, options);
  }
  caller.raise_if_stopped();
  if (!bed->measured.ok()) throw pipelines::StageError(bed->measured.brief());
  return bed;
}

py::tuple measured(const sim::Measured& value) { return py::make_tuple(value.value, value.std_error); }

py::dict observables(const Bed& bed) {
  const sim::MeasuredBed& m = bed.measured;
  py::dict out;
  if (!bed.input.bed.weightless()) {
    out["center_of_mass"] = measured(m.centre_of_mass);
    out["center_of_mass_rise"] = measured(m.centre_of_mass_rise);
  }
  out["temperature_x"] = measured(m.temperature_x);
  out["temperature_z"] = measured(m.temperature_z);
  out["temperature_z_local"] = measured(m.temperature_z_local);
  out["spin_temperature"] = measured(m.spin_temperature);
  if (bed.input.bed.periodic_upwards()) out["compressibility_factor"] = measured(m.compressibility_factor);
  return out;
}

py::dict counts(const sim::Counters& counters) {
  py::dict out;
  out["collisions"] = counters.collisions();
  out["disk_collisions"] = counters.disk_collisions;
  out["wall_collisions"] = counters.wall_collisions;
  out["floor_collisions"] = counters.floor_collisions;
  out["elastic_contacts"] = counters.elastic_contacts;
  out["events"] = counters.events();
  return out;
}

py::dict ledger(const sim::EnergyLedger& energy) {
  py::dict out;
  out["initial"] = energy.initial;
  out["kinetic"] = energy.kinetic;
  out["potential"] = energy.potential;
  out["compressed"] = energy.compressed;
  out["dissipated"] = energy.dissipated;
  out["dissipated_on_plates"] = energy.dissipated_on_plates;
  out["step_error"] = energy.step_error;
  out["floor_work"] = energy.floor_work;
  out["bath_work"] = energy.bath_work;
  out["imbalance"] = energy.imbalance();
  return out;
}

py::dict profile(const Bed& bed, bool floor_frame) {
  const sim::MeasuredBed& m = bed.measured;
  const sim::Profile& all = floor_frame ? m.floor_frame_profile : m.profile;
  const sim::FilledHeights filled = sim::filled_heights(all);  // as in profile.csv
  const auto cut = [&](const std::vector<double>& values) {
    return array_of({values.begin() + static_cast<std::ptrdiff_t>(filled.first),
                     values.begin() + static_cast<std::ptrdiff_t>(filled.last)});
  };
  py::dict out;
  out["height"] = cut(all.height);
  out["number_density"] = cut(all.number_density);
  out["std_error"] = cut(all.std_error);
  out["samples"] = all.samples;
  if (!floor_frame) {
    out["covariance"] = m.covariance;
    out["covariance_samples"] = m.covariance_samples;
  }
  out["kernel"] = to_string(bed.input.options.kernel);
  return out;
}

// A view of the trajectory itself: the array keeps the bed alive.
py::array trajectory(const std::shared_ptr<Bed>& bed) {
  const std::size_t disks = bed->measured.disks.mass.size();
  const std::size_t row = columns * sizeof(double);
  py::array out(
      py::dtype::of<double>(),
      {static_cast<py::ssize_t>(bed->times.size()), static_cast<py::ssize_t>(disks), static_cast<py::ssize_t>(columns)},
      {static_cast<py::ssize_t>(row * disks), static_cast<py::ssize_t>(row), static_cast<py::ssize_t>(sizeof(double))},
      bed->trajectory.data(), py::cast(bed));
  out.attr("flags").attr("writeable") = false;
  return out;
}

// ------------------------------------------------------------------------------------------------ stepping by hand

// A simulation that is stepped from Python. One thread at a time may use it.
class Stepper {
 public:
  explicit Stepper(SceneOfRecipe input) : input_(std::move(input)), simulation_(sim::simulate(input_.scene)) {}

  void advance_to(double time) {
    if (!(time >= simulation_->time()) || !std::isfinite(time))
      throw Mistake(fmt::format("the bed is at time {} and cannot advance to {}; give a later, finite time",
                                simulation_->time(), time));
    Caller caller(py::none{});
    {
      const py::gil_scoped_release release;
      while (!simulation_->advance_towards(time, events_between_questions))
        if (caller.stop()) break;
    }
    caller.raise_if_stopped();
  }
  double time() const { return simulation_->time(); }
  const SceneOfRecipe& input() const { return input_; }
  py::dict energy() const { return ledger(simulation_->energy()); }
  py::dict counters() const { return counts(simulation_->counters()); }
  double largest_overlap() const { return simulation_->largest_overlap(); }
  void set_bath_temperature(double temperature) { simulation_->set_bath_temperature(temperature); }
  py::dict snapshot() const {
    sim::Snapshot at;
    simulation_->snapshot(at);
    py::dict out;
    out["time"] = at.time;
    out["floor_position"] = at.floor_position;
    out["floor_velocity"] = at.floor_velocity;
    if (at.spin.empty()) at.spin.resize(at.x.size());
    out["x"] = array_of(std::move(at.x));
    out["z"] = array_of(std::move(at.z));
    out["vx"] = array_of(std::move(at.vx));
    out["vz"] = array_of(std::move(at.vz));
    out["spin"] = array_of(std::move(at.spin));
    return out;
  }
  py::array_t<double> radius() const { return array_of(simulation_->properties().radius); }

 private:
  SceneOfRecipe input_;
  std::unique_ptr<sim::Simulation> simulation_;
};

// ------------------------------------------------------------------------------------------------ fits and theory

using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

// The numbers of an array or of what numpy makes one of. They are read here and not in Python: a fit is short.
Doubles numbers_of(const py::object& values, const char* name) {
  const bool plain_array = reinterpret_cast<PyObject*>(Py_TYPE(values.ptr())) ==
                           reinterpret_cast<PyObject*>(py::detail::npy_api::get().PyArray_Type_);
  if (plain_array && Doubles::check_(values)) return py::reinterpret_borrow<Doubles>(values);
  if (py::hasattr(values, "mask"))
    throw Mistake(std::string(name) + " is a masked array; pass the valid values, " + name + "[~" + name + ".mask]");
  Doubles array = Doubles::ensure(values);
  if (!array)
    throw Mistake(std::string(name) + " cannot be read as numbers; pass an array, or a list without gaps in it");
  return array;
}

std::string shape_of(const py::array& array) { return py::str(array.attr("shape")).cast<std::string>(); }

std::vector<double> values_of(const Doubles& array) { return {array.data(), array.data() + array.size()}; }

fit::FitOptions fit_options(const py::dict& wanted) {
  fit::FitOptions out;
  for (const auto& [key, value] : wanted) {
    if (value.is_none()) continue;
    const auto name = key.cast<std::string>();
    const auto take = [&, &given = value](const char* option, auto& target) {
      if (name == option) take_option(given, option, target);
    };
    take("model", out.model);
    take("plateau_density", out.plateau_density);
    take("plateau_density_free", out.plateau_density_free);
    take("fixed_temperature", out.fixed_temperature);
    take("fixed_shift", out.fixed_shift);
    take("column_number", out.column_number);
    take("constrain_column", out.constrain_column);
    take("base", out.base);
    take("robust", out.robust);
    take("model_error", out.model_error);
    take("interval", out.interval);
    take("sweep", out.sweep);
    take("compare", out.compare);
    take("confidence", out.confidence);
    if (name == "kernel") out.kernel = kernel_named(option_as<std::string>(value, "kernel"));
    if (name == "window") std::tie(out.window.low, out.window.high) = option_as<OpenInterval>(value, "window");
  }
  return out;
}

fit::Profile profile_of(const py::object& height, const py::object& density, const py::object& error,
                        const py::object& covariance, int covariance_samples) {
  const Doubles heights = numbers_of(height, "height"), densities = numbers_of(density, "density");
  if (heights.ndim() != 1 || densities.ndim() != 1 || heights.size() != densities.size())
    throw Mistake(fmt::format("height has shape {} and density has shape {}; both must have the same shape, (heights,)",
                              shape_of(heights), shape_of(densities)));
  fit::Profile profile;
  profile.height = values_of(heights);
  profile.number_density = values_of(densities);
  if (!error.is_none()) {
    const Doubles errors = numbers_of(error, "error");
    if (errors.ndim() > 1 || (errors.ndim() == 1 && errors.size() != heights.size()))
      throw Mistake(fmt::format("error has shape {}; it must be {}", shape_of(errors), shape_of(heights)));
    profile.std_error = errors.ndim() == 1 ? values_of(errors) : std::vector(profile.height.size(), *errors.data());
  }
  if (!covariance.is_none()) {
    const Doubles matrix = numbers_of(covariance, "covariance");
    const py::ssize_t size = heights.size();
    if (matrix.ndim() != 2 || matrix.shape(0) != size || matrix.shape(1) != size)
      throw Mistake(fmt::format("covariance has shape {}; it must be ({}, {})", shape_of(matrix), size, size));
    profile.covariance = values_of(matrix);
  }
  profile.covariance_samples = covariance_samples;
  return profile;
}

struct Fit {
  fit::FitResult result;
  std::optional<double> diameter;
};

py::dict curve_of(const fit::FitResult& result) {
  std::vector<double> height, density, smoothed;
  for (const fit::CurvePoint& point : result.curve) {
    height.push_back(point.height);
    density.push_back(point.density);
    smoothed.push_back(point.smoothed_density);
  }
  py::dict out;
  out["height"] = array_of(std::move(height));
  out["density"] = array_of(std::move(density));
  out["smoothed_density"] = array_of(std::move(smoothed));
  return out;
}

// Without an answer there are no numbers: None.
py::dict answer_of(const fit::Answer& answer) {
  py::dict out;
  const auto number = [&](const char* name, double value) {
    out[name] = answer.ok() ? py::object(py::float_(value)) : py::object(py::none());
  };
  out["status"] = std::string(to_string(answer.status));
  out["verdict"] = std::string(to_string(answer.verdict));
  out["why"] = answer.why;
  out["advice"] = answer.advice;
  number("temperature", answer.temperature);
  number("std_error", answer.std_error);
  if (answer.verdict == fit::Verdict::no_single_temperature) out["std_error"] = py::none();  // the middle of a range
  number("statistical_error", answer.statistical_error);
  number("bias_uncertainty", answer.bias_uncertainty);
  number("wall_uncertainty", answer.wall_uncertainty);
  number("contact_duration_uncertainty", answer.contact_duration_uncertainty);
  number("spread", answer.spread);
  number("low", answer.interval.low);
  number("high", answer.interval.high);
  out["confidence"] = answer.ok() && answer.interval.confidence > 0 ? py::object(py::float_(answer.interval.confidence))
                                                                    : py::object(py::none());
  number("solid_height", answer.solid_height.value);
  number("solid_height_std_error", answer.solid_height.std_error);
  out["thermometer"] = answer.thermometer;
  out["model"] = answer.model;
  return out;
}

void bind_fits(py::module_& m) {
  py::class_<Fit>(m, "Fit")
      .def_property_readonly("status", [](const Fit& f) { return std::string(to_string(f.result.status)); })
      .def_property_readonly("ok", [](const Fit& f) { return f.result.ok(); })
      .def_property_readonly("message", [](const Fit& f) { return f.result.message; })
      .def_property_readonly("warnings", [](const Fit& f) { return f.result.warnings; })
      .def("brief", [](const Fit& f) { return f.result.brief(); })
      .def("full", [](const Fit& f) { return f.result.full(); })
      .def("to_dict", [](const Fit& f) { return from_json(pipelines::fit_json(f.result, f.diameter)); })
      .def("curve", [](const Fit& f) { return curve_of(f.result); });
  m.def("fit_profile",
        [](const py::object& height, const py::object& density, const py::object& error, const py::object& covariance,
           int covariance_samples, const py::dict& options, std::optional<double> diameter) {
          const fit::Profile profile = profile_of(height, density, error, covariance, covariance_samples);
          const fit::FitOptions wanted = fit_options(options);
          const py::gil_scoped_release release;
          return Fit{fit::fit_profile(profile, wanted), diameter};
        });
  m.def(
      "find_answer",
      [](const py::object& height, const py::object& density, const py::object& error, const py::object& covariance,
         int covariance_samples, const std::string& kernel, std::optional<double> column_number,
         std::optional<std::pair<double, double>> temperature_x, std::optional<std::pair<double, double>> temperature_z,
         const std::vector<std::pair<std::string, std::string>>& objections, std::optional<double> diameter,
         double origin_error, bool shaken, double width, double scale_error) {
        fit::AnswerInput input{.profile = profile_of(height, density, error, covariance, covariance_samples),
                               .kernel = kernel_named(kernel),
                               .column_number = column_number};
        if (temperature_x) input.temperature_x = fit::Estimate{temperature_x->first, temperature_x->second};
        if (temperature_z) input.temperature_z = fit::Estimate{temperature_z->first, temperature_z->second};
        for (const auto& [why, advice] : objections) input.objections.push_back({why, advice});
        input.diameter = diameter, input.origin_error = origin_error;
        input.shaken = shaken, input.width_between_walls = width, input.scale_error = scale_error;
        fit::Answer answer;
        {
          const py::gil_scoped_release release;
          answer = fit::find_answer(input);
        }
        return answer_of(answer);
      });
  m.def("theory", [](const std::string& equation, double plateau_density, std::optional<double> diameter,
                     std::optional<double> initial_height, std::optional<double> temperature) {
    pipelines::TheoryQuestion question;
    question.equation = equation;
    question.plateau_density = plateau_density;
    question.diameter = diameter;
    question.initial_height = initial_height;
    question.temperature = temperature;
    return from_json(pipelines::theory_json(question));
  });
  m.def("gamma_to_temperature",
        [](double gamma, double frequency, double gravity, double diameter, double initial_height,
           double plateau_density, double restitution, const std::string& equation) {
          pipelines::MapQuestion question;
          question.gamma = gamma;
          question.frequency = frequency;
          question.gravity = gravity;
          question.diameter = diameter;
          question.initial_height = initial_height;
          question.plateau_density = plateau_density;
          question.restitution = restitution;
          question.equation = equation;
          return from_json(pipelines::map_json(question));
        });
}

// ------------------------------------------------------------------------------------------------ beds

void bind_beds(py::module_& m) {
  py::class_<Bed, std::shared_ptr<Bed>>(m, "Bed")
      .def_property_readonly("length_unit", [](const Bed& bed) { return bed.input.bed.length_unit(); })
      .def_property_readonly("time_unit", [](const Bed& bed) { return bed.input.bed.time_unit(); })
      .def_property_readonly("warnings", [](const Bed& bed) { return problem_list(bed.input.warnings); })
      .def_property_readonly("weightless", [](const Bed& bed) { return bed.input.bed.weightless(); })
      .def_property_readonly("gamma", [](const Bed& bed) { return bed.input.bed.gamma(); })
      .def_property_readonly("column_number",
                             [](const Bed& bed) { return bed.input.bed.description().column_number(); })
      .def_property_readonly("width", [](const Bed& bed) { return bed.input.scene.box.width; })
      .def_property_readonly("periods", [](const Bed& bed) { return bed.measured.periods; })
      .def_property_readonly("largest_overlap", [](const Bed& bed) { return bed.measured.largest_overlap; })
      .def_property_readonly("radius", [](const Bed& bed) { return array_of(bed.measured.disks.radius); })
      .def("observables", &observables)
      .def("counters", [](const Bed& bed) { return counts(bed.measured.counters); })
      .def("energy", [](const Bed& bed) { return ledger(bed.measured.energy); })
      .def("profile", &profile)
      .def("trajectory", &trajectory)
      .def("times", [](const Bed& bed) { return array_of(bed.times); })
      .def("phases", [](const Bed& bed) { return array_of(bed.phases); })
      .def_property_readonly("hard_sides", [](const Bed& bed) { return !bed.input.bed.description().periodic; })
      .def("floor", [](const Bed& bed) { return array_of(bed.floor); })
      .def("floor_velocities", [](const Bed& bed) { return array_of(bed.floor_velocities); })
      .def("brief", [](const Bed& bed) { return bed.measured.brief(); })
      .def("full", [](const Bed& bed) { return bed.measured.full(); });
  m.def("simulate", &simulate);

  py::class_<Stepper>(m, "Stepper")
      .def(py::init([](const std::string& text, const std::string& file, const std::string& directory) {
        return std::make_unique<Stepper>(read_scene(text, file, directory));
      }))
      .def("advance_to", &Stepper::advance_to)
      .def_property_readonly("time", &Stepper::time)
      .def_property_readonly("warnings", [](const Stepper& s) { return problem_list(s.input().warnings); })
      .def_property_readonly("length_unit", [](const Stepper& s) { return s.input().bed.length_unit(); })
      .def_property_readonly("time_unit", [](const Stepper& s) { return s.input().bed.time_unit(); })
      .def_property_readonly("width", [](const Stepper& s) { return s.input().scene.box.width; })
      .def_property_readonly("radius", &Stepper::radius)
      .def("energy", &Stepper::energy)
      .def("counters", &Stepper::counters)
      .def("largest_overlap", &Stepper::largest_overlap)
      .def("set_bath_temperature", &Stepper::set_bath_temperature)
      .def("snapshot", &Stepper::snapshot);
}

// Frames of a trajectory file as one array, which is filled while the file is read.
py::tuple read_trajectory(const std::string& path, bool y_is_up) {
  Bed bed;
  {
    const py::gil_scoped_release release;
    const std::size_t frames = pipelines::count_frames(path);
    pipelines::TrajectoryReader reader(path, y_is_up ? pipelines::UpAxis::y : pipelines::UpAxis::z);
    pipelines::TrajectoryFrame frame;
    while (reader.read(frame)) {
      if (bed.times.empty()) {
        bed.measured.disks.mass.resize(frame.size());
        bed.trajectory.reserve(frames * frame.size() * columns);
      }
      if (frame.size() != bed.measured.disks.mass.size())
        throw pipelines::InputError(fmt::format("{}: frame {} has {} disks, but the first frame has {}", path,
                                                bed.times.size(), frame.size(), bed.measured.disks.mass.size()));
      sim::Snapshot at;
      at.time = frame.time, at.floor_position = frame.floor_position, at.floor_velocity = frame.floor_velocity;
      at.x = frame.x, at.z = frame.z, at.vx = frame.vx, at.vz = frame.vz, at.spin = frame.spin;
      put_frame(bed, at, frame.phase);
    }
  }
  auto held = std::make_shared<Bed>(std::move(bed));
  return py::make_tuple(trajectory(held), array_of(held->times), array_of(held->phases), array_of(held->floor),
                        array_of(held->floor_velocities));
}

// Heights of centres, frame after frame, to a density with its errors and covariance. `ends`: of each frame, the place
// behind its last height.
py::dict density_profile(const Doubles& z, const std::vector<std::size_t>& ends, double width,
                         const std::string& kernel_text, const HeightGrid& grid) {
  const Kernel kernel = kernel_named(kernel_text);
  const std::size_t frames = ends.size();
  fit::ProfileFrames densities;
  for (std::size_t i = 0; i < grid.points; ++i) densities.height.push_back(grid.height(i));
  densities.number_density.resize(frames * grid.points);
  for (std::size_t k = 0, begin = 0; k < frames; begin = ends[k++])
    add_density(grid, kernel, width, {z.data() + begin, ends[k] - begin}, 0,
                std::span(densities.number_density).subspan(k * grid.points, grid.points));
  const fit::FrameAverage average = fit::average_frames(densities);
  if (average.status != fit::FitStatus::ok) throw Mistake(average.message);
  py::dict out;
  out["height"] = array_of(average.profile.height);
  out["number_density"] = array_of(average.profile.number_density);
  out["std_error"] = array_of(average.profile.std_error);
  out["covariance"] = average.profile.covariance;
  out["covariance_samples"] = average.profile.covariance_samples;
  out["samples"] = frames;
  out["kernel"] = to_string(kernel);
  return out;
}

// ------------------------------------------------------------------------------------------------ errors, recipes

// The exceptions themselves are classes of shakebed/errors.py: raised by their constructor there.
void translate_errors() {
  py::register_exception_translator([](std::exception_ptr pointer) {
    const auto raise = [](const char* function, const py::args& arguments) {
      const py::object error = py::module_::import("shakebed.errors").attr(function)(*arguments);
      PyErr_SetObject(py::type::of(error).ptr(), error.ptr());
    };
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const pipelines::ConfigError& error) {
      raise("recipe_error",
            py::make_tuple(std::string(error.what()), problem_list(error.problems()), static_cast<int>(error.code())));
    } catch (const pipelines::Error& error) {
      raise("error_of_code", py::make_tuple(std::string(error.what()), static_cast<int>(error.code())));
    }
  });
}

void check_recipe(const std::string& file, const std::vector<std::string>& settings,
                  const std::optional<std::string>& preset) {
  pipelines::RecipeChanges changes;
  changes.preset = preset;
  for (const std::string& setting : settings) changes.settings.push_back(pipelines::parse_setting(setting));
  pipelines::read_recipe(file, changes);
}

// What is odd about a bead of this diameter in m; "" where nothing is.
std::string odd_bead(double diameter) {
  const auto odd = pipelines::odd_bead(diameter);
  return odd ? odd->what + ". " + odd->suggestion : "";
}

std::string impossible_bead(double diameter) {
  const auto impossible = pipelines::impossible_bead(diameter);
  return impossible ? impossible->what + ". " + impossible->suggestion : "";
}

double quantity(const std::string& text, const std::string& kind) {
  namespace dimension = pipelines::dimension;
  const pipelines::Dimension wanted = kind == "length"      ? dimension::length
                                      : kind == "frequency" ? dimension::frequency
                                                            : dimension::acceleration;
  // std::invalid_argument becomes ValueError
  const pipelines::Quantity found = pipelines::parse_quantity(text, &wanted);
  if (!found.has_unit)
    throw std::invalid_argument("\"" + text + "\" has no unit: write \"" +
                                pipelines::likely_quantity(text, found.value, wanted) + "\"");
  return pipelines::parse_quantity(text, wanted);
}

}  // namespace

}  // namespace shakebed::python

PYBIND11_MODULE(_core, m) {
  using namespace shakebed::python;
  translate_errors();
  translate_mistakes();
  bind_beds(m);
  bind_fits(m);
  m.def("read_trajectory", &read_trajectory);
  m.def("density_profile", [](const Doubles& z, const std::vector<std::size_t>& ends, double width,
                              const std::string& kernel, double lowest, double spacing, std::size_t points) {
    return density_profile(z, ends, width, kernel, {.lowest = lowest, .spacing = spacing, .points = points});
  });
  m.def("check_recipe", &check_recipe);
  m.def("odd_bead", &odd_bead);
  m.def("impossible_bead", &impossible_bead);
  m.def("quantity", &quantity);
  m.attr("version") = shakebed::pipelines::program_version();
}
