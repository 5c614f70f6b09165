#include "pipelines/stages/map.hpp"

#include <fmt/format.h>

#include "pipelines/bed.hpp"
#include "pipelines/files.hpp"
#include "pipelines/theory.hpp"

namespace shakebed::pipelines {
namespace {

class Map : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.number("gamma", gamma_,
                  {.help = "peak acceleration in g; left out, that of the simulated bed", .range = positive});
    fields.quantity("frequency", frequency_, dimension::frequency,
                    {.help = "of the shaking; left out, that of the simulated bed", .range = positive});
    fields.quantity("diameter", diameter_, dimension::length,
                    {.help = "of a disk; left out, that of the simulated bed", .range = positive});
    fields.quantity("gravity", gravity_, dimension::acceleration,
                    {.help = "left out, that of the simulated bed, else 9.81 m/s^2", .range = positive});
    fields.number("initial_height", initial_height_,
                  {.help = "height mu of the bed at rest in D; left out, N D/W of the bed or of the frames over phi_0",
                   .range = positive});
    fields.number("plateau_density", plateau_density_,
                  {.help = "phi_0 in 1/D^2; left out, that of the fit", .range = positive});
    fields.number("restitution", restitution_,
                  {.help = "of the single ball; 0: one flight of a dead ball", .range = from_to(0, 0.99)});
    fields.text("equation", equation_, {.help = "equation of state"});
    if (!fields.decoding()) return;
    if (fit::find_equation_of_state(equation_) == nullptr) {
      try {
        equation_named(equation_);
      } catch (const UsageError& error) {
        fields.problem("/equation", error.what());
      }
    }
    if (!fields.has_upstream("simulate")) {
      for (const std::string key : {"gamma", "frequency", "diameter", "initial_height"}) {
        const bool from_frames = key == "initial_height" && fields.has_upstream("extract");
        fields.require(fields.has(key) || from_frames, key,
                       fmt::format("\"{}\" is missing, and no simulate stage in \"from\" can say it", key));
      }
    }
  }

  void run(RunContext& context) const override {
    MapQuestion question;
    question.restitution = restitution_;
    question.equation = equation_;
    if (plateau_density_) question.plateau_density = *plateau_density_;
    if (const Input* fitted = context.find_input("fit")) {
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
    if (const Input* simulated = context.find_input("simulate")) {
      const BedDescription bed = BedDescription::read(simulated->file("bed.json"));
      if (bed.reduced && !(diameter_ && frequency_))
        throw InputError("the bed is in reduced units: give diameter and frequency here");
      question.gamma = bed.gamma();
      question.frequency = bed.frequency, question.diameter = bed.diameter;
      if (!bed.reduced) question.gravity = bed.gravity;
      question.initial_height = bed.column_number() / question.plateau_density;
    }
    if (const Input* frames = context.find_input("extract"); frames != nullptr && !initial_height_) {
      const Json extract = frames->result();
      const Json* column = find_pointer(extract, "/column_number/value");
      if (column == nullptr || !column->is_number())
        throw InputError(
            "the frames do not tell the height of the bed at rest (no walls were found): give initial_height");
      question.initial_height = column->get<double>() / question.plateau_density;
    }
    if (gamma_) question.gamma = *gamma_;
    if (frequency_) question.frequency = *frequency_;
    if (diameter_) question.diameter = *diameter_;
    if (gravity_) question.gravity = *gravity_;
    if (initial_height_) question.initial_height = *initial_height_;
    if (!(question.gamma > 0) || !(question.frequency > 0))
      throw InputError("the floor of this bed does not shake: there is no Gamma to map");
    const Json json = map_json(question);
    write_file(context.output("map.json"), dump(json));
    std::string csv = "name,jump_height,expansion,constants,jump,rise,reduced_temperature,in_range\n";
    std::size_t in_range = 0;
    for (const Json& row : json["readings"]) {
      const auto value = [&](const char* key) {
        return row[key].is_null() ? std::string() : number_text(row[key]["value"].get<double>());
      };
      csv += fmt::format("{},{},{},{},{},{},{},{}\n", row["name"].get<std::string>(),
                         row["jump_height"].get<std::string>(), row["expansion"].get<std::string>(),
                         row["constants"].get<std::string>(), value("jump"), value("rise"),
                         value("reduced_temperature"), row["in_range"].get<bool>() ? "true" : "false");
      in_range += row["in_range"].get<bool>();
    }
    write_file(context.output("map.csv"), csv);
    if (in_range < json["readings"].size()) {
      context.warning(fmt::format(
          "{} of {} readings of Gamma ask for a temperature outside the range of their formula (in_range: false)",
          json["readings"].size() - in_range, json["readings"].size()));
    }
  }

 private:
  std::optional<double> gamma_, frequency_, diameter_, gravity_, initial_height_, plateau_density_;
  double restitution_ = 0;
  std::string equation_ = "enskog";
};

}  // namespace

StageRow map_stage() {
  return {.name = "map",
          .version = 2,
          .summary = "maps Gamma to T/T_c by every named reading",
          .accepts = {"fit", "simulate", "extract"},
          .fewest_inputs = 0,
          .most_inputs = 3,
          .result = "map.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Map>(); }};
}

}  // namespace shakebed::pipelines
