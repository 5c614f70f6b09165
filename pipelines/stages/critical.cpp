#include <fmt/format.h>

#include <cmath>

#include "fit/profile_fit/critical_temperature.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/stages/stage.hpp"
#include "pipelines/stages/study_table.hpp"

namespace shakebed::pipelines {
namespace {

class Critical : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.text("temperature", temperature_,
                {.help = "column of the study that contains the temperature, in any unit"});
    fields.text("unit", unit_, {.help = "unit of the temperature, for messages and tables"});
    fields.text("density", density_, {.help = "column of the density at the bottom, in 1/D^2; empty: not used"});
    fields.numbers(
        "densities", densities_,
        {.help = "thresholds: T_c is the temperature at which the density at the bottom falls below each [1/D^2]"});
    fields.text("order", order_, {.help = "column of the bond order psi_6; empty: not used"});
    fields.numbers("orders", orders_,
                   {.help = "thresholds: T_c' is the temperature at which the bond order falls below each"});
    if (!fields.decoding()) return;
    fields.require(!density_.empty() || !order_.empty(), "density",
                   "neither \"density\" nor \"order\" names a column: give one of them");
    for (const double d : densities_)
      fields.require(d > 0 && d <= fit::close_packing_density * (1 + 1e-12), "densities",
                     fmt::format("a threshold must be above 0 and at most 1.1547 (close packing), got {}", d));
    for (const double p : orders_)
      fields.require(p > 0 && p < 1, "orders", fmt::format("a threshold of psi_6 must be between 0 and 1, got {}", p));
  }

  void results(ResultList& list) const override {
    // The series are those of the study.
    std::vector<std::string> series{"*"};
    const StatedStage* study = list.from("study");
    const StatedTable* table =
        study != nullptr && study->results != nullptr ? study->results->find_table("table.csv") : nullptr;
    if (table != nullptr && !table->columns.empty() && !table->columns.front().values.empty())
      series = table->columns.front().values;
    const auto state = [&](const std::string& name, const std::string& column, const std::string& meaning) {
      const Given looked = given_if(!column.empty(), "the option names a column");
      list.text("/" + name + "/column", "column of the study that is used", looked);
      for (const std::string& one : series) {
        const std::string row = pointer_join("/" + name + "/series", one) + "/#/";
        list.number(row + "threshold", "1", "threshold of the column", looked);
        list.text(row + "status", "ok, or why there is no crossing", looked);
        list.quantity(row + "temperature", unit_, meaning, looked, true);
      }
    };
    state("T_c", density_, "temperature at which the density at the bottom falls below the threshold");
    state("T_c_prime", order_, "temperature at which the bond order falls below the threshold");
    list.table({"critical.csv",
                "temperatures at which a quantity crosses thresholds",
                {{"series", "", "series of the study"},
                 {"quantity",
                  "",
                  "quantity: T_c (from the density at the bottom) or T_c_prime (from the bond order)",
                  {"T_c", "T_c_prime"}},
                 {"threshold", "1", "threshold of the quantity"},
                 {"temperature", unit_, "temperature of the crossing"},
                 {"std_error", unit_, "standard error of the temperature"},
                 {"status", "", "ok, or why there is no crossing"}}});
  }

  void run(RunContext& context) const override {
    const StudyTable table = read_study_table(context.input("study").file("table.csv"));
    std::vector<std::string> series;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      const std::string name = table.series(r);
      if (std::find(series.begin(), series.end(), name) == series.end()) series.push_back(name);
    }
    Table crossings = context.table("critical.csv");
    Json out;
    std::size_t found = 0, asked = 0;
    const auto look = [&](const char* name, const std::string& column, const std::vector<double>& thresholds) {
      if (column.empty()) return;
      Json& quantity = out[name];
      quantity["column"] = column;
      for (const std::string& one : series) {
        Json rows = Json::array();
        for (const fit::ThresholdCrossing& c : fit::threshold_temperatures(points_of(table, one, column), thresholds)) {
          const bool ok = c.status == fit::ValueStatus::ok;
          ++asked, found += ok;
          Json row{{"threshold", c.threshold}, {"status", fit::to_string(c.status)}};
          row["temperature"] = ok ? c.temperature.std_error > 0
                                        ? quantity_json(c.temperature.value, unit_, c.temperature.std_error)
                                        : quantity_json(c.temperature.value, unit_)
                                  : Json();
          rows.push_back(std::move(row));
          crossings.add({one, std::string(name), c.threshold, ok ? c.temperature.value : no_number,
                         ok && c.temperature.std_error > 0 ? c.temperature.std_error : no_number,
                         std::string(fit::to_string(c.status))});
        }
        quantity["series"][one.empty() ? "all" : one] = std::move(rows);
      }
    };
    look("T_c", density_, densities_);
    look("T_c_prime", order_, orders_);
    if (found < asked)
      context.warning(
          fmt::format("{} of {} thresholds are not crossed within the study's temperatures, and their T_c is missing. "
                      "Add lower or higher temperatures to the study",
                      asked - found, asked));
    write_file(context.output("critical.json"), dump(out));
    crossings.write(context.output("critical.csv"));
  }

 private:
  std::vector<fit::TemperaturePoint> points_of(const StudyTable& table, const std::string& series,
                                               const std::string& column) const {
    const std::size_t x = table.column(temperature_), y = table.column(column);
    std::vector<fit::TemperaturePoint> points;
    for (std::size_t r = 0; r < table.rows.size(); ++r) {
      if (table.series(r) != series) continue;
      const auto t = table.number(r, x), value = table.number(r, y);
      if (t && value) points.push_back({*t, *value, table.error(r, column).value_or(0)});
    }
    return points;
  }

  std::string temperature_ = "T", unit_ = "T_c", density_ = "bottom_density", order_ = "psi6";
  std::vector<double> densities_{1.10, 1.11, 1.12, 1.13, 1.14, 1.15, 1.154}, orders_{0.95, 0.9, 0.85, 0.8, 0.7};
};

}  // namespace

StageRow critical_stage() {
  return {.name = "critical",
          .summary = "measures T_c and T_c' from a study over temperature, for several thresholds",
          .accepts = {"study"},
          .fewest_inputs = 1,
          .most_inputs = 1,
          .result = "critical.json",
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Critical>(); }};
}

}  // namespace shakebed::pipelines
