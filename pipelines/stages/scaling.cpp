// scaling: products of powers through the points of studies, y = amplitude x_1^a_1 x_2^a_2 ..., with their errors. The
// amplitude is one number, or free at every value of other columns ("each"): then y may depend on these in any way.
//
// Files: scaling.json (exponents) and, for every fit, NAME.csv: its points, the fit at them and their ratio, from which
// a chart draws the fitted line, or all points against the fit.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "fit/profile_fit/power_product.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/stage.hpp"
#include "pipelines/stages/study_table.hpp"

namespace shakebed::pipelines {
namespace {

struct ColumnLimits {
  std::optional<double> least, most;
};
struct ScalingFit {
  std::string name, from, y;
  std::vector<std::string> powers, each, series;
  std::vector<std::pair<std::string, ColumnLimits>> within;
  bool common_error = false;
};

// The points of a fit, in the order of the study.
struct ScalingPoints {
  std::vector<std::string> series;
  std::vector<std::vector<double>> x;  // of each power, at the points
  std::vector<double> y, error;
  std::vector<std::vector<double>> places;  // group → its values of "each"
  std::vector<std::size_t> group;           // of the points; empty without "each"

  void join_group(const std::vector<double>& place) {
    const auto found = std::find(places.begin(), places.end(), place);
    group.push_back(static_cast<std::size_t>(found - places.begin()));
    if (found == places.end()) places.push_back(place);
  }
};

bool lies_within(const ScalingFit& fit, const StudyTable& table, std::size_t row) {
  for (const auto& [column, limits] : fit.within) {
    const std::optional<double> value = table.number(row, table.column(column));
    if (!value || *value < limits.least.value_or(-INFINITY) || *value > limits.most.value_or(INFINITY)) return false;
  }
  return fit.series.empty() || std::find(fit.series.begin(), fit.series.end(), table.series(row)) != fit.series.end();
}

ScalingPoints points_of(const ScalingFit& fit, const StudyTable& table) {
  ScalingPoints points;
  points.x.resize(fit.powers.size());
  for (std::size_t row = 0; row < table.rows.size(); ++row) {
    const std::optional<double> y = table.number(row, table.column(fit.y)), error = table.error(row, fit.y);
    std::vector<double> x;
    for (const std::string& power : fit.powers) {
      if (const auto value = table.number(row, table.column(power))) x.push_back(*value);
    }
    std::vector<double> place;
    for (const std::string& column : fit.each) {
      if (const auto value = table.number(row, table.column(column))) place.push_back(*value);
    }
    if (!y || !error || x.size() < fit.powers.size() || place.size() < fit.each.size()) continue;
    if (!lies_within(fit, table, row)) continue;
    for (std::size_t k = 0; k < x.size(); ++k) points.x[k].push_back(x[k]);
    if (!fit.each.empty()) points.join_group(place);
    points.y.push_back(*y), points.error.push_back(*error), points.series.push_back(table.series(row));
  }
  return points;
}

// Errors from few replicas are uncertain themselves: each becomes the same part of its number, the root mean square.
void share_error(ScalingPoints& points) {
  double squares = 0;
  for (std::size_t i = 0; i < points.y.size(); ++i) squares += std::pow(points.error[i] / points.y[i], 2);
  const double part = std::sqrt(squares / static_cast<double>(points.y.size()));
  for (std::size_t i = 0; i < points.y.size(); ++i) points.error[i] = part * std::abs(points.y[i]);
}

Json scaling_json(const ScalingFit& options, const fit::PowerProduct& found, std::size_t points) {
  Json out{{"points", points}};
  out["status"] = found.ok ? "ok"
                           : "not fitted: the fit needs more points than unknowns, positive numbers and errors, and "
                             "columns that vary independently";
  for (std::size_t k = 0; k < options.powers.size(); ++k)
    out["exponents"][options.powers[k]] =
        found.ok ? quantity_json(found.exponents[k], "1", found.exponent_errors[k]) : Json();
  if (!found.ok) return out;
  const double amplitude = std::exp(found.log_amplitude);
  if (options.each.empty()) out["amplitude"] = quantity_json(amplitude, "1", amplitude * found.log_amplitude_error);
  out["chi2"] = found.chi2, out["dof"] = found.dof, out["p_value"] = found.p_value;
  out["rms_log_ratio"] = found.rms_log_ratio;
  return out;
}

void describe_fit(Fields& fields, ScalingFit& fit) {
  fields.text("name", fit.name, {.help = "name of the fit in scaling.json and of its CSV file", .required = true});
  fields.text("from", fit.from, {.help = "id of the study; may be left out where \"from\" names one study"});
  fields.text(
      "y", fit.y,
      {.help = "column y that is fitted; its standard errors are in the column of the same name with _error at the end",
       .required = true});
  fields.texts("powers", fit.powers, {.help = "columns x_1, x_2, ... whose exponents are fitted", .required = true});
  fields.texts("each", fit.each,
               {.help = "columns that divide the points into groups; each group has its own amplitude, and all groups "
                        "share the exponents"});
  fields.texts("series", fit.series, {.help = "series of the study that are used; left out, all"});
  fields.map<ColumnLimits>("within", fit.within,
                           [](Fields& f, ColumnLimits& limits) {
                             f.number("least", limits.least, {.help = "smallest value that is used"});
                             f.number("most", limits.most, {.help = "largest value that is used"});
                           },
                           {.help = "ranges of the points that are used: column → smallest and largest value"});
  fields.boolean(
      "common_error", fit.common_error,
      {.help =
           "whether all points get the same relative error, the rms of their own errors; useful with few replicas"});
}

// The study, its columns and series must be there.
void check_fit(Fields& fields, const ScalingFit& fit) {
  fields.require(!fit.name.empty() && fit.name.find_first_of("/\\ .") == std::string::npos, "name",
                 "\"" + fit.name + "\" cannot be the name of a file: use no spaces, dots and slashes");
  fields.require(!fit.powers.empty(), "powers", "\"powers\" is empty: give at least one column");
  const std::vector<StatedStage>& from = fields.from();
  const auto study = std::find_if(from.begin(), from.end(), [&](const StatedStage& one) {
    return one.id == fit.from || (fit.from.empty() && from.size() == 1);
  });
  if (study == from.end())
    return fields.problem(
        "/from", fit.from.empty()
                     ? "\"from\" of the stage names several studies: give here the id of the study that is fitted"
                     : "\"" + fit.from + "\" is not in the \"from\" of this stage");
  const StatedTable* table = study->results != nullptr ? study->results->find_table("table.csv") : nullptr;
  if (table == nullptr) return;
  const auto check = [&](const std::string& where, const std::string& column) {
    if (const auto misfit = misfit_of_column(*table, column)) fields.problem(where, misfit->what, misfit->suggestion);
  };
  check("/y", fit.y);
  if (!misfit_of_column(*table, fit.y)) check("/y", fit.y + "_error");
  for (std::size_t k = 0; k < fit.powers.size(); ++k) check("/powers/" + std::to_string(k), fit.powers[k]);
  for (std::size_t k = 0; k < fit.each.size(); ++k) check("/each/" + std::to_string(k), fit.each[k]);
  for (const auto& [column, limits] : fit.within) check("/within/" + escape_pointer_token(column), column);
  const std::vector<std::string>& names = table->columns.front().values;
  for (std::size_t k = 0; k < fit.series.size(); ++k) {
    if (names.empty() || std::find(names.begin(), names.end(), fit.series[k]) != names.end()) continue;
    const std::string nearest = nearest_name(fit.series[k], names);
    fields.problem(
        "/series/" + std::to_string(k), "the study has no series \"" + fit.series[k] + "\"",
        nearest.empty() ? fmt::format("Choose from: {}", fmt::join(names, ", ")) : "Did you mean \"" + nearest + "\"?");
  }
}

class Scaling : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.array<ScalingFit>("fits", fits_,
                             [](Fields& f, ScalingFit& fit) {
                               describe_fit(f, fit);
                               if (f.decoding() && f.has("name") && f.has("y") && f.has("powers")) check_fit(f, fit);
                             },
                             {.help = "fits of y = amplitude x_1^a_1 x_2^a_2 ... to the points", .required = true});
    if (!fields.decoding()) return;
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      for (std::size_t k = 0; k < i; ++k)
        fields.require(fits_[i].name != fits_[k].name, "fits/" + std::to_string(i) + "/name",
                       "two fits are named \"" + fits_[i].name + "\"");
    }
  }

  void results(ResultList& list) const override {
    for (const ScalingFit& fit : fits_) {
      const std::string at = pointer_join("", fit.name);
      const Given found = given_when("the fit succeeds");
      list.number(at + "/points", "1", "number of points that are used");
      list.text(at + "/status", "ok, or why there is no fit");
      for (const std::string& power : fit.powers)
        list.quantity(pointer_join(at + "/exponents", power), "1", "exponent of " + power, {}, true);
      list.quantity(at + "/amplitude", "1", "factor of the powers, in the units of the columns",
                    both(found, given_if(fit.each.empty(), "\"each\" names no column")));
      list.number(at + "/chi2", "1", "chi-square: sum of squared residuals of ln y over their squared errors", found);
      list.number(at + "/dof", "1", "degrees of freedom", found);
      list.number(at + "/p_value", "1", "probability of a chi-square at least this large, if the model is right",
                  found);
      list.number(at + "/rms_log_ratio", "1", "rms of ln(y/fit)", found);
      std::vector<StatedColumn> columns{{"series", "", "kind of bed"}};
      for (const std::vector<std::string>* names : {&fit.powers, &fit.each}) {
        for (const std::string& name : *names) columns.push_back({name, "1", "value in the study"});
      }
      for (const char* name : {"y", "y_error", "fitted", "ratio", "ratio_error"}) columns.push_back(column_named(name));
      list.table({fit.name + ".csv", "the points of " + fit.name + ", with the values of the fit", columns, found});
    }
  }

  void run(RunContext& context) const override {
    Json out = Json::object();
    for (const ScalingFit& options : fits_) {
      const auto& inputs = context.inputs();
      const auto input = std::find_if(inputs.begin(), inputs.end(), [&](const Input& one) {
        return one.id == options.from || (options.from.empty() && inputs.size() == 1);
      });
      ScalingPoints points = points_of(options, read_study_table(input->file("table.csv")));
      if (options.common_error) share_error(points);
      const fit::PowerProduct found = fit::fit_power_product(points.x, points.y, points.error, points.group);
      out[options.name] = scaling_json(options, found, points.y.size());
      if (found.ok)
        write_points(context, options, points, found);
      else
        context.warning(options.name + ": " + out[options.name]["status"].get<std::string>());
    }
    write_file(context.output("scaling.json"), dump(out));
  }

 private:
  static StatedColumn column_named(const std::string& name) {
    if (name == "y") return {name, "1", "value in the study"};
    if (name == "y_error") return {name, "1", "standard error of y that the fit uses"};
    if (name == "fitted") return {name, "1", "value of the fit at this point"};
    if (name == "ratio") return {name, "1", "ratio of y to the fit"};
    return {name, "1", "standard error of the ratio, from that of y"};
  }

  static void write_points(RunContext& context, const ScalingFit& options, const ScalingPoints& points,
                           const fit::PowerProduct& found) {
    Table table = context.table(options.name + ".csv");
    for (std::size_t i = 0; i < points.y.size(); ++i) {
      std::vector<double> place;
      for (const std::vector<double>& column : points.x) place.push_back(column[i]);
      std::vector<Cell> row{points.series[i]};
      row.insert(row.end(), place.begin(), place.end());
      if (!points.group.empty()) {
        const std::vector<double>& own = points.places[points.group[i]];
        row.insert(row.end(), own.begin(), own.end());
      }
      const double fitted = found.at(place, points.group.empty() ? 0 : points.group[i]);
      for (const double number : {points.y[i], points.error[i], fitted, points.y[i] / fitted, points.error[i] / fitted})
        row.emplace_back(number);
      table.add(row);
    }
    table.write(context.output(options.name + ".csv"));
  }

  std::vector<ScalingFit> fits_;
};

}  // namespace

StageRow scaling_stage() {
  return {.name = "scaling",
          .summary = "fits products of powers to the points of studies: exponents with their errors",
          .accepts = {"study"},
          .fewest_inputs = 1,
          .most_inputs = 64,
          .result = "scaling.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Scaling>(); }};
}

}  // namespace shakebed::pipelines
