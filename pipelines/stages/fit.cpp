#include "pipelines/stages/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "fit/fit_profile.hpp"
#include "pipelines/bed.hpp"
#include "pipelines/files.hpp"
#include "pipelines/theory.hpp"

namespace shakebed::pipelines {
namespace {

enum class ErrorSource { diagonal, covariance };
enum class KernelChoice { measured, none, gaussian, top_hat, disk_chord };

struct WindowChoice {
  std::optional<double> low, high;
  double floor_exclusion = fit::WindowOptions{}.floor_exclusion;
  double plateau_fraction = fit::WindowOptions{}.plateau_fraction;
  double lowest_fraction = fit::WindowOptions{}.lowest_fraction;
  double lowest_significance = fit::WindowOptions{}.lowest_significance;
};
struct KernelOptions {
  KernelChoice kind = KernelChoice::measured;
  double width = 0.5;
};

class Fit : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.input_files(
        "profile", profile_,
        {.help = "a profile of your own (CSV with height and number_density); left out, that of the stage in \"from\"",
         .example = "\"profile.csv\""});
    fields.text("model", options_.model,
                {.help = "enskog-rectangle, hydrostatic:<equation of state>, fermi or rectangle",
                 .example = "\"enskog-rectangle\""});
    fields.number(
        "plateau_density", options_.plateau_density,
        {.help = "density phi_0 of the solid in 1/D^2: 2/sqrt(3) in equilibrium, 1.10 for the published experiment",
         .range = {.low = 0, .high = fit::close_packing_density * (1 + 1e-12), .above_low = true}});
    fields.boolean("plateau_density_free", options_.plateau_density_free,
                   {.help = "fit it too (its T is biased low; printed beside the headline anyway)"});
    fields.number("temperature", options_.fixed_temperature,
                  {.help = "hold T at this value in m g D", .range = positive});
    fields.boolean("temperature_measured", temperature_measured_,
                   {.help = "hold T at the kinetic temperature of the simulated bed in \"from\", (T_x + T_z)/2"});
    fields.number("shift", options_.fixed_shift, {.help = "hold the shift at this height in D"});
    fields.number("column_number", options_.column_number,
                  {.help = "N D/W; left out, what the measurement says", .range = positive});
    fields.boolean("constrain_column", options_.constrain_column, {.help = "tie the shift to T by the sum rule"});
    fields.number("base", options_.base, {.help = "lower edge of the bed in D"});
    fields.quantity("diameter", diameter_, dimension::length,
                    {.help = "D, for T/(m g) as a length; left out, what the measurement says", .range = positive});
    fields.object<KernelOptions>(
        "kernel", kernel_,
        [](Fields& f, KernelOptions& k) {
          f.choice("kind", k.kind,
                   {{KernelChoice::measured, "measured"},
                    {KernelChoice::none, "none"},
                    {KernelChoice::gaussian, "gaussian"},
                    {KernelChoice::top_hat, "top_hat"},
                    {KernelChoice::disk_chord, "disk_chord"}},
                   {.help = "what the profile was measured through; measured: as the profile itself says"});
          f.number("width", k.width, {.help = "in D; not for measured and none", .range = from_to(0, 100)});
        },
        {.help = "the model is put through it before it is compared"});
    fields.object<WindowChoice>(
        "window", window_,
        [](Fields& f, WindowChoice& w) {
          f.number("low", w.low, {.help = "lowest height used in D; found by the rule if left out"});
          f.number("high", w.high, {.help = "highest height used in D; found by the rule if left out"});
          f.number("floor_exclusion", w.floor_exclusion,
                   {.help = "rule: nothing below this height above the base, in D", .range = non_negative});
          f.number("plateau_fraction", w.plateau_fraction,
                   {.help = "rule: begin where the smoothed profile first reaches this part of its greatest value",
                    .range = zero_to_one});
          f.number("lowest_fraction", w.lowest_fraction,
                   {.help = "rule: end where the density falls below this part of its greatest value",
                    .range = zero_to_one});
          f.number("lowest_significance", w.lowest_significance,
                   {.help = "rule: or below so many standard errors", .range = non_negative});
          f.require(!w.low || !w.high || *w.low < *w.high, "low", "the window ends below where it begins");
        },
        {.help = "which part of the profile is fitted"});
    fields.choice("errors", errors_, {{ErrorSource::diagonal, "diagonal"}, {ErrorSource::covariance, "covariance"}},
                  {.help = "covariance: use the covariance between heights that extract measured"});
    fields.boolean("robust", options_.robust, {.help = "Huber's loss: outliers count linearly"});
    fields.boolean("sweep", options_.sweep, {.help = "also T against window"});
    fields.boolean("compare", options_.compare, {.help = "also other models, and phi_0 free"});
    if (!fields.decoding()) return;
    const bool upstream = !fields.upstream().empty();
    fields.require(!temperature_measured_ || fields.has_upstream("simulate"), "temperature_measured",
                   "no simulate stage in \"from\" has measured a temperature");
    fields.require(!temperature_measured_ || !options_.fixed_temperature, "temperature_measured",
                   "T is held at \"temperature\" already");
    fields.require(upstream || fields.has("profile"), "",
                   "there is no profile: neither \"profile\" nor a stage in \"from\"", "Give one of the two");
    fields.require(profile_.paths.size() <= 1, "profile",
                   fmt::format("names {} files, one profile is fitted at a time", profile_.paths.size()));
    const std::string& model = options_.model;
    bool known = model == "enskog-rectangle" || model == "fermi" || model == "rectangle";
    std::vector<std::string> names{"enskog-rectangle", "fermi", "rectangle"};
    for (const fit::EquationOfState* row : fit::equations_of_state()) {
      names.push_back("hydrostatic:" + std::string(row->name()));
      known = known || names.back() == model;
    }
    const std::string nearest = nearest_name(model, names);
    fields.require(known, "model", fmt::format("there is no model \"{}\"", model),
                   nearest.empty() ? fmt::format("There are {}", fmt::join(names, ", "))
                                   : fmt::format("Did you mean \"{}\"?", nearest));
  }

  void run(RunContext& context) const override;

 private:
  InputFiles profile_;
  fit::FitOptions options_;
  std::optional<double> diameter_;
  KernelOptions kernel_;
  WindowChoice window_;
  ErrorSource errors_ = ErrorSource::diagonal;
  bool temperature_measured_ = false;
};

// Covariance between the heights of a profile, from covariance.csv.
std::vector<double> read_covariance(const std::filesystem::path& path, const std::vector<double>& heights) {
  const std::size_t n = heights.size();
  std::vector<double> covariance(n * n, 0.0);
  const std::string text = read_file(path);
  const auto index_of = [&](double height) -> std::optional<std::size_t> {
    const auto at = std::lower_bound(heights.begin(), heights.end(), height - 1e-9);
    if (at == heights.end() || std::abs(*at - height) > 1e-9) return std::nullopt;
    return static_cast<std::size_t>(at - heights.begin());
  };
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = std::string_view(text).substr(begin, end - begin);
    begin = end + 1;
    if (line.empty() || line.front() == '#' || line.front() == 'h') continue;
    const auto cells = split_csv_line(line);
    if (cells.size() != 3) throw InputError(path.string() + ": expected height_i,height_j,covariance");
    const auto i = index_of(std::strtod(cells[0].c_str(), nullptr)),
               j = index_of(std::strtod(cells[1].c_str(), nullptr));
    if (!i || !j) continue;
    covariance[*i * n + *j] = covariance[*j * n + *i] = std::strtod(cells[2].c_str(), nullptr);
  }
  return covariance;
}

std::optional<double> number_in(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

void Fit::run(RunContext& context) const {
  fit::FitOptions options = options_;
  std::optional<double> diameter = diameter_;
  // What goes into the fit: our own file, else the first stage of "from".
  const Input* source = context.inputs().empty() ? nullptr : &context.inputs().front();
  const std::filesystem::path path = !profile_.empty() ? profile_.paths.front() : source->file("profile.csv");
  const ProfileTable table = read_profile_csv(path);
  if (!table.note.empty()) context.warning(table.note);
  for (const Input& input : context.inputs()) {
    if (input.has("bed.json")) {
      const BedDescription bed = BedDescription::read(input.file("bed.json"));
      if (!diameter && !bed.reduced) diameter = bed.diameter;
      if (!options.column_number && input.stage == "simulate") options.column_number = bed.column_number();
      write_file(context.output("bed.json"), dump(bed.to_json()));
    }
    if (!diameter && input.stage == "extract") {
      const Json extracted = input.result();
      if (const Json* found = find_pointer(extracted, "/diameter/value"); found != nullptr && found->is_number())
        diameter = found->get<double>();
    }
  }
  if (!options.column_number) options.column_number = number_in(table.comment("column_number"));
  if (temperature_measured_) {
    const Json bed = context.input("simulate").result();
    const Json *x = find_pointer(bed, "/temperature_x/value"), *z = find_pointer(bed, "/temperature_z/value");
    if (x == nullptr || z == nullptr || !(x->get<double>() + z->get<double>() > 0))
      throw InputError("the simulated bed has no kinetic temperature at which T could be held");
    options.fixed_temperature = (x->get<double>() + z->get<double>()) / 2;
  }
  fit::Profile profile;
  profile.height = table.height;
  profile.number_density = table.number_density;
  // Errors where every bin has one; a bin without samples has an error of 0, which says nothing about it.
  bool has_errors = true;
  double smallest = 0;
  for (const double error : table.std_error) {
    has_errors = has_errors && error >= 0;
    if (error > 0) smallest = smallest == 0 ? error : std::min(smallest, error);
  }
  if (has_errors && smallest > 0) {
    for (const double error : table.std_error) profile.std_error.push_back(error > 0 ? error : smallest);
  } else {
    context.warning("the profile has no standard errors: those of the fit follow from the scatter about it");
  }
  if (errors_ == ErrorSource::covariance) {
    if (source == nullptr || !source->has("covariance.csv"))
      throw InputError("\"errors\": \"covariance\" needs the profile of an extract stage");
    profile.covariance = read_covariance(source->file("covariance.csv"), profile.height);
    if (const Json extracted = source->result(); extracted.contains("profile")) {
      const double frames = extracted["profile"].value("frames", 0.0),
                   together = extracted["profile"].value("correlation_frames", 1.0);
      profile.covariance_samples = static_cast<int>(frames / std::max(1.0, together));
    }
  }
  switch (kernel_.kind) {
    case KernelChoice::none:
      options.kernel = {fit::KernelKind::none, 0};
      break;
    case KernelChoice::gaussian:
      options.kernel = {fit::KernelKind::gaussian, kernel_.width};
      break;
    case KernelChoice::top_hat:
      options.kernel = {fit::KernelKind::top_hat, kernel_.width};
      break;
    case KernelChoice::disk_chord:
      options.kernel = {fit::KernelKind::disk_chord, kernel_.width};
      break;
    case KernelChoice::measured: {
      std::string name = table.comment("kernel");
      std::replace(name.begin(), name.end(), '_', '-');
      if (name.empty()) {
        options.kernel = {fit::KernelKind::none, 0};
        context.warning("the profile does not say through which kernel it was measured: taken as densities at points");
      } else if (!fit::kernel_kind_from_string(name, options.kernel.kind)) {
        throw InputError(fmt::format("{}: there is no kernel \"{}\"", path.string(), name));
      } else {
        options.kernel.width = number_in(table.comment("kernel_width")).value_or(0);
      }
      break;
    }
  }
  options.window.low = window_.low, options.window.high = window_.high;
  options.window.floor_exclusion = window_.floor_exclusion, options.window.plateau_fraction = window_.plateau_fraction;
  options.window.lowest_fraction = window_.lowest_fraction,
  options.window.lowest_significance = window_.lowest_significance;

  context.progress(0.1, "fitting");
  const fit::FitResult result = fit::fit_profile(profile, options);
  if (result.status == fit::FitStatus::bad_input)
    throw InputError(fmt::format("{}: {}", path.string(), result.message));
  for (const std::string& warning : result.warnings) context.warning(warning);
  const Json json = fit_json(result, diameter);
  if (!json["describes_data"].get<bool>()) {
    context.warning(
        fmt::format("{} does not describe this profile: {}", result.model, json["why_not"].get<std::string>()));
  }
  write_file(context.output("fit.json"), dump(json));
  std::string curve = "# " + result.model +
                      "; smoothed: through the kernel of the measurement\nheight,number_density,smoothed_density\n";
  for (const fit::CurvePoint& point : result.curve) {
    curve += fmt::format("{},{},{}\n", number_text(point.height), number_text(point.density),
                         number_text(point.smoothed_density));
  }
  write_file(context.output("curve.csv"), curve);
  std::string residuals = "height,number_density,std_error,model,used\n";
  for (const fit::Residual& r : result.residuals) {
    residuals += fmt::format("{},{},{},{},{}\n", number_text(r.height), number_text(r.density),
                             number_text(r.std_error), number_text(r.model), r.used ? 1 : 0);
  }
  write_file(context.output("residuals.csv"), residuals);
  std::string windows = "low,high,bins,temperature,std_error,shift,chi2_per_dof,status\n";
  for (const fit::WindowFit& w : result.window_sweep) {
    windows += fmt::format("{},{},{},{},{},{},{},{}\n", number_text(w.low), number_text(w.high), w.bins,
                           number_text(w.temperature.value), number_text(w.temperature.std_error),
                           number_text(w.shift.value), number_text(w.chi2_per_dof), fit::to_string(w.status));
  }
  write_file(context.output("windows.csv"), windows);
}

}  // namespace

StageRow fit_stage() {
  return {.name = "fit",
          .version = 2,
          .summary = "fits temperature and solid height to a density profile",
          .accepts = {"extract", "simulate"},
          .fewest_inputs = 0,
          .most_inputs = 2,
          .result = "fit.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Fit>(); }};
}

}  // namespace shakebed::pipelines
