#include "pipelines/stages/check.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"

namespace shakebed::pipelines {

namespace {

struct Expectation {
  Json value;                        // number, quantity, string, true or false
  std::optional<double> relative;    // of the expected value
  Json absolute;                     // in the value's unit
  std::optional<double> std_errors;  // of the result
  Json least, most;                  // instead of a value
  std::string note;
};

// Nothing where it is no text, or one of something else.
std::optional<Quantity> quantity_in(const Json& json) {
  if (!json.is_string()) return std::nullopt;
  try {
    return parse_quantity(json.get<std::string>());
  } catch (const std::invalid_argument&) {
    return std::nullopt;
  }
}

bool has_unit(const Json& json) {
  const auto quantity = quantity_in(json);
  return quantity && quantity->has_unit;
}

void describe_expectation(Fields& fields, Expectation& e) {
  fields.any("value", e.value, {.help = "expected value: a number, a quantity with its unit, a string, true or false"});
  fields.number("relative", e.relative,
                {.help = "tolerance as a fraction of the expected value", .range = non_negative});
  fields.any("absolute", e.absolute,
             {.help = "tolerance: with its unit where the value has one, else in the unit of the result"});
  fields.number("std_errors", e.std_errors,
                {.help = "tolerance in standard errors of the result", .range = non_negative});
  fields.any("least", e.least, {.help = "lower bound of the result, in place of or together with a value"});
  fields.any("most", e.most, {.help = "upper bound of the result, in place of or together with a value"});
  fields.text("note", e.note, {.help = "source of the expected value"});
  if (!fields.decoding()) return;
  const auto quantity = [&](const char* key, const Json& json) {
    if (json.is_null() || json.is_number() || !json.is_string()) {
      fields.require(json.is_null() || json.is_number(), key, "expected a number or a quantity with its unit");
      return;
    }
    try {
      parse_quantity(json.get<std::string>());
    } catch (const std::invalid_argument& problem) {
      fields.problem(std::string("/") + key, problem.what());
    }
  };
  quantity("absolute", e.absolute), quantity("least", e.least), quantity("most", e.most);
  fields.require(!e.value.is_null() || !e.least.is_null() || !e.most.is_null(), "",
                 "this expectation is empty: it has neither \"value\" nor \"least\" nor \"most\"",
                 "Write {\"value\": \"0.36 mm\", \"relative\": 0.1}");
  fields.require(!e.value.is_object() && !e.value.is_array(), "value",
                 "expected a number, a quantity, a string, true or false");
  const bool tolerance = e.relative || !e.absolute.is_null() || e.std_errors;
  const bool is_quantity = e.value.is_number() || has_unit(e.value);
  const bool plain = e.absolute.is_number() || (quantity_in(e.absolute) && !has_unit(e.absolute));
  fields.require(!plain || !has_unit(e.value), "absolute", "the expected value has a unit, and this tolerance has none",
                 "Write it with its unit, as the value: \"0.1 mm\"");
  fields.require(!tolerance || is_quantity, "value", "a tolerance is given, but the expected value is not a number");
  fields.require(!e.value.is_number_float() || tolerance, "value", "a number needs a tolerance",
                 "Add \"relative\", \"absolute\" or \"std_errors\"");
}

// One comparison.
struct Verdict {
  std::string pointer{}, expected{}, found{}, note{};
  bool passed = false;
  std::string why{};
};

// A result in the unit it is in: a number, or {"value", "std_error", "unit"}.
struct Found {
  const Json* json = nullptr;
  double value = 0;
  std::optional<double> std_error{};
  std::string unit{};
  bool is_number = false;
};

Found unpack(const Json& json) {
  Found found{.json = &json};
  const Json* value = &json;
  if (json.is_object() && json.contains("value")) {
    value = &json["value"];
    if (json.contains("std_error") && json["std_error"].is_number()) found.std_error = json["std_error"].get<double>();
    found.unit = json.value("unit", "");
  }
  found.is_number = value->is_number();
  if (found.is_number)
    found.value = value->get<double>();
  else
    found.json = value;
  return found;
}

// An expected quantity in the unit of the result. Throws std::invalid_argument.
double in_unit_of(const Json& expected, const Found& found, const std::string& what) {
  if (expected.is_number()) return expected.get<double>();
  return in_unit_of_result(parse_quantity(expected.get<std::string>()), found.unit, what);
}

std::string text_of(const Json& json) { return json.is_string() ? json.get<std::string>() : dump_canonical(json); }

Verdict judge(const std::string& pointer, const Expectation& e, const Json* json) {
  Verdict verdict{.pointer = pointer, .note = e.note};
  if (!e.value.is_null()) verdict.expected = text_of(e.value);
  if (e.relative) verdict.expected += fmt::format(" +- {:g} %", 100 * *e.relative);
  if (!e.absolute.is_null()) verdict.expected += fmt::format(" +- {}", text_of(e.absolute));
  if (e.std_errors) verdict.expected += fmt::format(" +- {:g} standard errors", *e.std_errors);
  if (!e.least.is_null())
    verdict.expected += fmt::format("{}at least {}", verdict.expected.empty() ? "" : ", ", text_of(e.least));
  if (!e.most.is_null())
    verdict.expected += fmt::format("{}at most {}", verdict.expected.empty() ? "" : ", ", text_of(e.most));
  if (json == nullptr || json->is_null()) {
    verdict.found = "nothing";
    verdict.why = "there is no such result";
    return verdict;
  }
  const Found found = unpack(*json);
  if (!found.is_number) {
    verdict.found = text_of(*found.json);
    const bool bounds = !e.least.is_null() || !e.most.is_null();
    verdict.passed = !bounds && *found.json == e.value;
    if (!verdict.passed)
      verdict.why = bounds ? "the result is not a number and cannot be compared with bounds"
                           : "the result differs from the expected one";
    return verdict;
  }
  verdict.found =
      fmt::format("{:.6g}{}{}", found.value, found.std_error ? fmt::format(" +- {:.2g}", *found.std_error) : "",
                  found.unit.empty() || found.unit == "1" ? "" : " " + found.unit);
  try {
    verdict.passed = std::isfinite(found.value);
    if (!e.value.is_null()) {
      if (e.value.is_boolean()) throw std::invalid_argument("the result is a number, but true or false is expected");
      const double expected = in_unit_of(e.value, found, "the expected value");
      double tolerance = 0;
      if (e.relative) tolerance = std::max(tolerance, *e.relative * std::abs(expected));
      if (!e.absolute.is_null()) tolerance = std::max(tolerance, in_unit_of(e.absolute, found, "the tolerance"));
      if (e.std_errors) {
        if (!found.std_error) throw std::invalid_argument("the result has no standard error");
        tolerance = std::max(tolerance, *e.std_errors * *found.std_error);
      }
      const double difference = std::abs(found.value - expected);
      if (!(difference <= tolerance)) {
        verdict.passed = false;
        verdict.why = fmt::format("the difference of {:.4g} is above the tolerance of {:.4g}", difference, tolerance);
        if (expected != 0)
          verdict.why +=
              fmt::format(". The difference is {:.3g} % of the expected value", 100 * difference / std::abs(expected));
      }
    }
    if (!e.least.is_null() && !(found.value >= in_unit_of(e.least, found, "the lower bound")))
      verdict.passed = false, verdict.why = "the result is below the lower bound";
    if (!e.most.is_null() && !(found.value <= in_unit_of(e.most, found, "the upper bound")))
      verdict.passed = false, verdict.why = "the result is above the upper bound";
  } catch (const std::invalid_argument& problem) {
    verdict.passed = false;
    verdict.why = problem.what();
  }
  return verdict;
}

class Check : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.map<Expectation>(
        "expect", expect_, describe_expectation,
        {.help = "expectations: /<stage id>/<name in its result> → value or bounds", .required = true});
    if (!fields.decoding()) return;
    for (const auto& [pointer, expectation] : expect_) {
      const std::string where = "/expect/" + escape_pointer_token(pointer);
      if (const StatedResult* stated = fields.check_result(where, pointer))
        check_unit(fields, where, expectation, *stated);
    }
    fields.require(!expect_.empty() || !fields.has("expect"), "expect",
                   "\"expect\" is empty: give at least one expectation");
  }

  void results(ResultList& list) const override {
    list.truth("/passed", "whether every result is as expected");
    list.number("/failures", "1", "number of results that are not as expected");
    list.text("/checks/#/pointer", "pointer to the result");
    list.text("/checks/#/expected", "expected value");
    list.text("/checks/#/found", "value of the result");
    list.truth("/checks/#/passed", "whether the result agrees with the expected value");
    list.text("/checks/#/why", "reason why the result does not agree", given_when("the result does not agree"));
    list.text("/checks/#/note", "source of the expected value", given_when("the expectation has a \"note\""));
  }

  void run(RunContext& context) const override {
    std::vector<std::pair<std::string, Json>> results;
    for (const Input& input : context.inputs()) results.emplace_back(input.id, input.result());
    Json rows = Json::array();
    std::string cases, table;
    std::size_t failures = 0;
    for (const auto& [pointer, expectation] : expect_) {
      const Json* found = nullptr;
      const std::vector<std::string> tokens = split_pointer(pointer);
      std::string known;
      for (const auto& [id, json] : results) {
        known += known.empty() ? id : ", " + id;
        if (tokens.front() == id) found = find_pointer(json, pointer.substr(1 + escape_pointer_token(id).size()));
      }
      Verdict verdict = judge(pointer, expectation, found);
      if (found == nullptr) verdict.why = fmt::format("there is no such result (\"from\" names {})", known);
      failures += !verdict.passed;
      if (!verdict.passed)
        context.check_failed(
            fmt::format("{}: expected {}, found {}: {}", pointer, verdict.expected, verdict.found, verdict.why));
      Json row{
          {"pointer", pointer}, {"expected", verdict.expected}, {"found", verdict.found}, {"passed", verdict.passed}};
      if (!verdict.why.empty()) row["why"] = verdict.why;
      if (!verdict.note.empty()) row["note"] = verdict.note;
      rows.push_back(std::move(row));
      cases += fmt::format("  <testcase classname=\"shakebed\" name=\"{}\">", escape_markup(pointer));
      if (!verdict.passed) {
        cases += fmt::format("\n    <failure message=\"{}\">expected {}, found {}</failure>\n  ",
                             escape_markup(verdict.why), escape_markup(verdict.expected), escape_markup(verdict.found));
      }
      cases += "</testcase>\n";
      table += fmt::format("| {} | {} | {} | {} |\n", verdict.passed ? "passed" : "**failed**", pointer,
                           verdict.expected, verdict.found);
    }
    Json out;
    out["passed"] = failures == 0;
    out["failures"] = failures;
    out["checks"] = std::move(rows);
    write_file(context.output("check.json"), dump(out));
    write_file(context.output("junit.xml"),
               fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites tests=\"{0}\" "
                           "failures=\"{1}\">\n<testsuite name=\"shakebed\" tests=\"{0}\" "
                           "failures=\"{1}\" errors=\"0\">\n{2}</testsuite>\n</testsuites>\n",
                           expect_.size(), failures, cases));
    write_file(context.output("summary.md"),
               fmt::format("# {} of {} checks passed\n\n| verdict | result | expected | found |\n|---|---|---|---|\n{}",
                           expect_.size() - failures, expect_.size(), table));
  }

 private:
  // An expectation in a unit that the result cannot have. That a tolerance or bound is no quantity has been said.
  static void check_unit(Fields& fields, const std::string& where, const Expectation& expectation,
                         const StatedResult& stated) {
    if (stated.kind != ResultKind::quantity && stated.kind != ResultKind::number) return;
    const std::pair<const char*, const Json*> all[] = {{"value", &expectation.value},
                                                       {"absolute", &expectation.absolute},
                                                       {"least", &expectation.least},
                                                       {"most", &expectation.most}};
    for (const auto& [key, json] : all) {
      if (!json->is_string() || (json != &expectation.value && !quantity_in(*json))) continue;
      try {
        in_unit_of(*json, {.json = json, .unit = stated.unit}, "the expected value");
      } catch (const std::invalid_argument& problem) {
        fields.problem(where + "/" + key, problem.what());
      }
    }
  }

  std::vector<std::pair<std::string, Expectation>> expect_;
};

}  // namespace

StageRow check_stage() {
  return {.name = "check",
          .summary = "compares results with expected values; exit code 6 when one does not agree",
          .accepts = {"simulate", "infer", "study", "render", "extract", "fit", "map", "figure", "chart", "claims"},
          .fewest_inputs = 1,
          .most_inputs = 64,
          .result = "check.json",
          .pages = check_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Check>(); }};
}

}  // namespace shakebed::pipelines
