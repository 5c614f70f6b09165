#include "pipelines/stages/map.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include <charconv>
#include <set>

#include "fit/map/empirical_map.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/bed_facts.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/study_table.hpp"
#include "pipelines/stages/theory.hpp"

namespace shakebed::pipelines {
namespace {

class Map : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.number("gamma", gamma_,
                  {.help = "peak acceleration of the floor over g, Gamma; left out, that of the simulated bed",
                   .range = positive});
    fields.number("gamma_std_error", gamma_std_error_,
                  {.help = "standard error of gamma; the results state it", .range = non_negative});
    fields.quantity("frequency", frequency_, dimension::frequency,
                    {.help = "frequency of the shaking; left out, that of the simulated bed", .range = positive});
    fields.quantity("diameter", diameter_, dimension::length,
                    {.help = "diameter of a disk; left out, that of the simulated bed", .range = positive});
    fields.quantity(
        "gravity", gravity_, dimension::acceleration,
        {.help = "acceleration of gravity; left out, that of the simulated bed, else 9.81 m/s^2", .range = positive});
    fields.number(
        "initial_height", initial_height_,
        {.help = "height mu of the bed at rest, in D; left out, N D/W of the bed or of the frames, divided by phi_0",
         .range = positive});
    fields.number("plateau_density", plateau_density_,
                  {.help = "density phi_0 of the solid, in 1/D^2; left out, that of the fit", .range = positive});
    fields.number(
        "restitution", restitution_,
        {.help = "coefficient of restitution of the single ball whose jump defines H_0; 0: one flight without rebound",
         .range = from_to(0, 0.99)});
    fields.text("equation", equation_, {.help = "equation of state: " + fit::equation_names()});
    fields.input_files(
        "table", table_,
        {.help = "table of simulated beds with known T, as written by a study (table.csv); T is interpolated in it, in "
                 "addition to the theory. Left out, that of the study in \"from\"",
         .example = "\"table.csv\""});
    fields.object<TableColumns>(
        "columns", columns_,
        [](Fields& f, TableColumns& c) {
          f.text("temperature", c.temperature, {.help = "column of the temperature T, in m g D"});
          f.texts(
              "axes", c.axes,
              {.help = "parameters of the table, among gamma, frequency (Hz), restitution, friction and initial_height "
                       "(D). Each is a column, or is named in the series (\"restitution=0.9 friction=0.2\")"});
        },
        {.help = "columns of the table of simulated beds"});
    fields.number("bead_restitution", bead_restitution_,
                  {.help = "coefficient of restitution of the beads, for the interpolation in the table; left out, "
                           "that of the simulated bed",
                   .range = zero_to_one});
    fields.number("bead_friction", bead_friction_,
                  {.help = "friction coefficient of the beads, for the interpolation in the table; left out, that of "
                           "the simulated bed",
                   .range = non_negative});
    if (!fields.decoding()) return;
    if (fit::find_equation_of_state(equation_) == nullptr) {
      try {
        equation_named(equation_);
      } catch (const UsageError& error) {
        fields.problem("/equation", error.what());
      }
    }
    fields.require(table_.paths.size() <= 1, "table",
                   fmt::format("this names {} files, but the stage reads one table", table_.paths.size()),
                   "Give the path of one CSV file");
    const std::vector<std::string> known{"gamma", "frequency", "restitution", "friction", "initial_height"};
    for (const std::string& axis : columns_.axes) {
      const std::string nearest = nearest_name(axis, known);
      fields.require(std::find(known.begin(), known.end(), axis) != known.end(), "columns/axes",
                     fmt::format("there is no axis \"{}\"", axis),
                     nearest.empty() ? fmt::format("Choose from: {}", fmt::join(known, ", "))
                                     : fmt::format("Did you mean \"{}\"?", nearest));
    }
    require_bed_facts(fields);
  }

  void results(ResultList& list) const override {
    const bool fitted = list.from("fit") != nullptr;
    list.quantity("/gamma", "1", "peak acceleration of the floor over g");
    list.quantity("/frequency", "Hz", "frequency of the shaking");
    list.quantity("/diameter", "m", "diameter of a disk");
    list.quantity("/gravity", "m/s^2", "acceleration g");
    list.quantity("/initial_height", "D", "height mu of the bed at rest");
    list.quantity("/plateau_density", "1/D^2", "density of the solid, phi_0");
    list.text("/equation_of_state", "equation of state");
    list.quantity("/critical_temperature", "m g D", "temperature at which the solid vanishes, T_c",
                  given_when("T_c is known"));
    const Given measured = both(given_if(fitted, "\"from\" names a fit stage"), given_when("the fit succeeds"));
    list.quantity("/measured_temperature", "m g D", "fitted temperature", measured);
    list.quantity("/measured_reduced_temperature", "1", "fitted T/T_c", measured);
    state_readings(list, measured);
    state_simulated(list);
  }

  void run(RunContext& context) const override {
    MapQuestion question;
    question.restitution = restitution_;
    question.equation = equation_;
    if (plateau_density_) question.plateau_density = *plateau_density_;
    take_fit(context, question);
    const Beads beads = take_bed(context, question);
    take_options(question);
    if (const auto odd = gamma_ ? odd_gamma(*gamma_) : std::nullopt)
      context.warning(
          fmt::format("Gamma = {:.3g}. {}. Check the amplitude, which is half the way between the floor's lowest and "
                      "highest position, the frequency, and the units of both",
                      *gamma_, *odd));
    Json json = map_json(question);
    if (const Input* study = context.find_input("study"); study != nullptr || !table_.empty()) {
      const StudyTable table =
          read_study_table(table_.empty() ? study->file("table.csv") : std::filesystem::path(table_.paths.front()));
      json["simulated"] = simulated(context, table, question, beads, json);
    }
    write_file(context.output("map.json"), dump(json));
    write_readings(context, json["readings"]);
  }

 private:
  // Of the beads, for a table of simulated beds.
  struct Beads {
    std::optional<double> restitution, friction;
  };

  // Its temperature, and its plateau density where none is given.
  void take_fit(const RunContext& context, MapQuestion& question) const {
    const Input* fitted = context.find_input("fit");
    if (fitted == nullptr) return;
    const Json fit = fitted->result();
    const auto number = [&](const char* pointer) -> std::optional<double> {
      const Json* found = find_pointer(fit, pointer);
      return found != nullptr && found->is_number() ? std::optional<double>(found->get<double>()) : std::nullopt;
    };
    if (!plateau_density_)
      question.plateau_density = number("/plateau_density/value").value_or(question.plateau_density);
    question.measured_temperature = number("/temperature/value");
    question.measured_std_error = number("/temperature/std_error");
  }

  // What the first input that describes a bed says of it.
  Beads take_bed(const RunContext& context, MapQuestion& question) const {
    Beads beads{bead_restitution_, bead_friction_};
    const auto source = std::find_if(context.inputs().begin(), context.inputs().end(),
                                     [](const Input& input) { return input.has("bed.json"); });
    if (source == context.inputs().end()) return beads;
    const BedDescription bed = BedDescription::read(source->file("bed.json"));
    if (!beads.restitution) beads.restitution = bed.restitution;
    if (!beads.friction) beads.friction = bed.friction;
    question.gamma = bed.gamma();
    question.frequency = bed.frequency.value_or(0), question.diameter = bed.diameter;
    if (!bed.reduced && bed.gravity) question.gravity = *bed.gravity;
    question.initial_height = bed.column_number() / question.plateau_density;
    return beads;
  }

  void take_options(MapQuestion& question) const {
    if (gamma_) question.gamma = *gamma_, question.gamma_std_error = gamma_std_error_;
    if (frequency_) question.frequency = *frequency_;
    if (diameter_) question.diameter = *diameter_;
    if (gravity_) question.gravity = *gravity_;
    if (initial_height_) question.initial_height = *initial_height_;
  }

  static void write_readings(RunContext& context, const Json& rows) {
    Table readings = context.table("map.csv");
    std::size_t in_range = 0;
    for (const Json& row : rows) {
      const auto value = [&](const char* key) {
        return row[key].is_null() ? no_number : row[key]["value"].get<double>();
      };
      readings.add({row["name"].get<std::string>(), row["jump_height"].get<std::string>(),
                    row["expansion"].get<std::string>(), row["constants"].get<std::string>(), value("jump"),
                    value("rise"), value("reduced_temperature"), count_cell(row["in_range"].get<bool>() ? 1 : 0)});
      in_range += row["in_range"].get<bool>();
    }
    readings.write(context.output("map.csv"));
    if (in_range < rows.size()) {
      context.warning(fmt::format(
          "{} of the {} formulas that predict T from Gamma do not apply at this Gamma (see map.csv, column in_range).",
          rows.size() - in_range, rows.size()));
    }
  }

  static void state_readings(ResultList& list, const Given& measured) {
    const std::string row = "/readings/#/";
    list.text(row + "name", "name of the formula");
    list.text(row + "jump_height", "definition of the jump height H_0");
    list.text(row + "expansion", "relation between the rise of the bed and T");
    list.text(row + "constants", "constants of the theory that are used");
    list.text(row + "status", "ok, or why the formula gives no temperature");
    list.quantity(row + "jump", "D", "jump height of a single ball", {}, true);
    list.quantity(row + "rise", "D", "rise of the centre of mass", {}, true);
    list.quantity(row + "temperature", "m g D", "temperature", {}, true);
    list.quantity(row + "temperature_over_mg", "m", "temperature as T/(m g)", {}, true);
    list.quantity(row + "reduced_temperature", "1", "T/T_c", {}, true);
    list.truth(row + "in_range", "whether the formula applies at this Gamma");
    list.quantity(row + "gamma_of_measured_temperature", "1", "Gamma at which the formula gives the fitted temperature",
                  measured, true);
    list.table({"map.csv",
                "formulas that predict T/T_c from Gamma",
                {{"name", "", "name of the formula"},
                 {"jump_height", "", "definition of the jump height of a single ball"},
                 {"expansion", "", "relation between the rise of the bed and T"},
                 {"constants", "", "constants of the theory that it uses"},
                 {"jump", "D", "jump height of a single ball"},
                 {"rise", "D", "rise of the centre of mass"},
                 {"reduced_temperature", "1", "T/T_c"},
                 {"in_range", "1", "1 where the formula applies at this Gamma, else 0", {"0", "1"}}}});
  }

  void state_simulated(ResultList& list) const {
    const Given asked = given_if(list.from("study") != nullptr || !table_.texts.empty(),
                                 "\"from\" names a study or \"table\" is given");
    const Given found = both(asked, given_when("the table of simulated beds gives a temperature"));
    list.text("/simulated/status", "ok, or why the table of simulated beds gives no temperature", asked);
    list.text("/simulated/message", "reason why the table gives no temperature",
              both(asked, given_when("the table gives no temperature")));
    list.number("/simulated/beds", "1", "number of beds in the table", asked);
    for (const std::string& axis : columns_.axes)
      list.number("/simulated/at/" + axis, axis == "frequency" ? "Hz" : "1", "value of this parameter for the bed",
                  asked);
    list.truth("/simulated/inside", "whether the bed lies within the range of the table", found);
    list.number("/simulated/interpolation_error", "1", "relative error of the interpolation", found, true);
    list.quantity("/simulated/temperature", "m g D", "temperature from the table", found);
    list.quantity("/simulated/temperature_over_mg", "m", "temperature from the table, as T/(m g)", found);
    list.quantity("/simulated/reduced_temperature", "1", "temperature from the table, as T/T_c", found);
  }

  // What the bed knows need not be stated again, and may not be stated otherwise.
  void require_bed_facts(Fields& fields) const {
    const KnownBed* known = fields.known_bed();
    if (known != nullptr) {
      const BedDescription& bed = known->bed;
      const bool shakes = bed.frequency.value_or(0) > 0;
      require_same_as_bed(fields, "diameter", diameter_, bed.diameter, dimension::length);
      require_same_as_bed(fields, "gravity", gravity_, bed.gravity, dimension::acceleration);
      if (shakes) require_same_as_bed(fields, "frequency", frequency_, bed.frequency, dimension::frequency);
      if (shakes) require_same_as_bed(fields, "gamma", gamma_, bed.gamma(), dimension::none);
    }
    const bool simulated = known != nullptr && known->bed.mass.has_value();
    if (simulated) {
      fields.require((gamma_ || known->bed.gamma() > 0) && (frequency_ || known->bed.frequency.value_or(0) > 0),
                     "gamma", "the floor of this bed does not shake, so there is no Gamma",
                     "Give \"gamma\" and \"frequency\"");
      fields.require(!known->bed.reduced || frequency_, "frequency",
                     "the bed is in reduced units, so its frequency is not known in Hz", "Give \"frequency\"");
      fields.require(!known->bed.reduced || diameter_, "diameter",
                     "the bed is in reduced units, so its diameter is not known in m", "Give \"diameter\"");
    }
    const auto need = [&](const char* key, bool there) {
      fields.require(there, key,
                     fmt::format("\"{}\" is missing, and no stage in \"from\" states it; give it here", key));
    };
    need("gamma", gamma_ || simulated);
    need("frequency", frequency_ || simulated);
    need("diameter", diameter_ || known != nullptr);
    need("initial_height", initial_height_ || known != nullptr);
  }

  struct TableColumns {
    std::string temperature = "T";
    std::vector<std::string> axes{"gamma"};
  };

  // "restitution=0.9 friction=0.2": the number behind `name`.
  static std::optional<double> in_series(const std::string& series, const std::string& name) {
    for (std::size_t at = series.find(name + "="); at != std::string::npos; at = series.find(name + "=", at + 1)) {
      if (at > 0 && series[at - 1] != ' ' && series[at - 1] != ',') continue;
      double value = 0;
      const char *begin = series.data() + at + name.size() + 1, *last = series.data() + series.size();
      const auto [end, error] = std::from_chars(begin, last, value);
      if (error == std::errc() && (end == last || *end == ' ' || *end == ',')) return value;
    }
    return std::nullopt;
  }

  // Where the bed lies along the axes of a table of simulated beds.
  std::vector<double> place_of(const MapQuestion& question, const Beads& beads) const {
    std::vector<double> here;
    for (const std::string& axis : columns_.axes) {
      const std::optional<double> value = axis == "gamma"         ? std::optional(question.gamma)
                                          : axis == "frequency"   ? std::optional(question.frequency)
                                          : axis == "restitution" ? beads.restitution
                                          : axis == "friction"    ? beads.friction
                                                                  : std::optional(question.initial_height);
      if (!value)
        throw InputError(fmt::format(
            "the {} of the beads is an axis of the table, but no bed in \"from\" states it: give \"bead_{}\"", axis,
            axis));
      here.push_back(*value);
    }
    return here;
  }

  // Each row of the table with a temperature.
  std::vector<fit::MapPoint> points_of(const StudyTable& table) const {
    std::vector<fit::MapPoint> points;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      const auto t = table.number(r, table.column(columns_.temperature));
      if (!t || !(*t > 0)) continue;
      fit::MapPoint point{{}, *t, table.error(r, columns_.temperature).value_or(0)};
      for (const std::string& axis : columns_.axes) {
        const auto value = table.has(axis) ? table.number(r, table.column(axis)) : in_series(table.series(r), axis);
        if (!value)
          throw InputError(
              fmt::format("{}: row {} states no {}: there is no such column, and the series \"{}\" does not name it",
                          table.file, r + 1, axis, table.series(r)));
        point.position.push_back(*value);
      }
      points.push_back(std::move(point));
    }
    return points;
  }

  void warn_of_few_levels(RunContext& context, const std::vector<fit::MapPoint>& points,
                          const std::vector<double>& here) const {
    for (std::size_t a = 0; a < here.size(); ++a) {
      std::set<double> levels;
      for (const fit::MapPoint& point : points) levels.insert(point.position[a]);
      if (levels.size() < 3 && !levels.contains(here[a]))
        context.warning(
            fmt::format("the table has only {} values of {}, so the error of the interpolation does not include the "
                        "curvature of T between them. Add beds at other values",
                        levels.size(), columns_.axes[a]));
    }
  }

  // T of simulated beds, interpolated at the question.
  Json simulated(RunContext& context, const StudyTable& table, const MapQuestion& question, const Beads& beads,
                 const Json& map) const {
    const std::vector<double> here = place_of(question, beads);
    std::vector<fit::MapPoint> points = points_of(table);
    warn_of_few_levels(context, points, here);
    std::vector<fit::MapAxis> axes;
    Json asked = Json::object();
    for (std::size_t a = 0; a < here.size(); ++a) {
      axes.push_back({columns_.axes[a], false});
      asked[columns_.axes[a]] = here[a];
    }
    const std::size_t number = points.size();
    const fit::EmpiricalMap library(std::move(axes), std::move(points));
    const fit::EmpiricalMap::Prediction found = library.at(here);
    Json out{{"status", fit::to_string(found.status)}, {"beds", number}, {"at", std::move(asked)}};
    if (!library.message().empty()) out["message"] = library.message();
    if (found.status != fit::FitStatus::ok) {
      context.warning(fmt::format("the table of simulated beds gives no temperature: {}",
                                  library.message().empty() ? fit::to_string(found.status) : library.message()));
      return out;
    }
    out["inside"] = found.inside;
    out["interpolation_error"] = library.interpolation_error();
    const auto put = [&](const char* key, double factor, const char* unit) {
      out[key] = quantity_json(found.temperature.value * factor, unit, found.temperature.std_error * factor);
    };
    put("temperature", 1, "m g D");
    put("temperature_over_mg", question.diameter, "m");
    if (const Json* critical = find_pointer(map, "/critical_temperature/value"); critical != nullptr)
      put("reduced_temperature", 1 / critical->get<double>(), "1");
    if (!found.inside)
      context.warning("the bed lies outside the table of simulated beds: its temperature there is an extrapolation");
    return out;
  }

  InputFiles table_;
  TableColumns columns_;
  std::optional<double> bead_restitution_, bead_friction_;
  std::optional<double> gamma_, gamma_std_error_, frequency_, diameter_, gravity_, initial_height_, plateau_density_;
  double restitution_ = 0;
  std::string equation_ = "enskog";
};

}  // namespace

StageRow map_stage() {
  return {.name = "map",
          .summary = "maps Gamma to T/T_c by every formula that Quinn and Hong (2000) allow",
          .accepts = {"fit", "simulate", "extract", "study"},
          .fewest_inputs = 0,
          .most_inputs = 4,
          .result = "map.json",
          .pages = map_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Map>(); }};
}

}  // namespace shakebed::pipelines
