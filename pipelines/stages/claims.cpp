#include "pipelines/stages/claims.hpp"

#include <fmt/format.h>

#include <cmath>

#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {
namespace {

struct Claim {
  std::string claim, place, pointer, note, measured_as;
  std::optional<double> value, least, most;
  double tolerance = 0;
};

// The interval of 95 % against what is claimed. A claim of a number to some tolerance is an interval too.
enum class Verdict { holds, open, fails, missing };
std::string_view name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::holds:
      return "holds";
    case Verdict::open:
      return "open";
    case Verdict::fails:
      return "does not hold";
    default:
      return "not measured";
  }
}

class Claims : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.array<Claim>(
        "claims", claims_,
        [](Fields& f, Claim& c) {
          f.text("claim", c.claim, {.help = "what is said", .required = true});
          f.text("place", c.place, {.help = "where it stands"});
          f.text("number", c.pointer, {.help = "/<stage id>/<name in its result>", .required = true});
          f.text("measured_as", c.measured_as, {.help = "what the number is, in words"});
          f.number("value", c.value, {.help = "claimed"});
          f.number("tolerance", c.tolerance, {.help = "of the claimed value", .range = non_negative});
          f.number("least", c.least, {.help = "claimed lower bound"});
          f.number("most", c.most, {.help = "claimed upper bound"});
          f.text("note", c.note, {.help = "what else there is to say"});
          if (!f.decoding()) return;
          f.require(c.value || c.least || c.most, "", "nothing is claimed: neither value nor least nor most");
          f.require(!c.value || (!c.least && !c.most), "value", "a value and bounds exclude one another");
          if (f.has("number")) f.check_result("/number", c.pointer);
        },
        {.help = "sentence by sentence", .required = true});
    if (fields.decoding()) fields.require(!claims_.empty() || !fields.has("claims"), "claims", "there are none");
  }

  void results(ResultList& list) const override {
    const std::string row = "/claims/#/";
    list.text("/verdict_is", "what the verdicts mean");
    list.text(row + "claim", "what is claimed");
    list.text(row + "claimed", "the claim as a number or an interval");
    list.text(row + "measured", "the measured number with its error");
    list.text(row + "verdict", "holds, open, does not hold, or not measured");
    list.number(row + "value", "1", "the measured number, in its own unit", {}, true);
    list.number(row + "std_error", "1", "its standard error", given_when("the number has an error"));
    list.text(row + "number", "where the number is");
    const Given written = given_when("the claim says so");
    list.text(row + "place", "where the claim stands", written);
    list.text(row + "measured_as", "what the number is", written);
    list.text(row + "note", "what else there is to say", written);
    list.table({"claims.csv",
                "the claims and what was measured",
                {{"claim", "", "what is claimed"},
                 {"measured_as", "", "what the number is"},
                 {"claimed", "", "the claim as a number or an interval"},
                 {"measured", "1", "the measured number, in its own unit"},
                 {"std_error", "1", "its standard error, in that unit"},
                 {"verdict", "", "holds, open, does not hold, or not measured"},
                 {"place", "", "where the claim stands"}}});
  }

  void run(RunContext& context) const override {
    Json rows = Json::array();
    Table verdicts = context.table("claims.csv");
    std::string table = "| claim | claimed | measured | verdict | where |\n|---|---|---|---|---|\n";
    const auto cell = [](const std::string& text) {
      std::string out;
      for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
      return out;
    };
    for (const Claim& c : claims_) {
      const auto tokens = split_pointer(c.pointer);
      const Json* found = nullptr;
      Json result;
      for (const Input& input : context.inputs()) {
        if (input.id != tokens.front()) continue;
        result = input.result();
        found = find_pointer(result, std::string_view(c.pointer).substr(1 + escape_pointer_token(input.id).size()));
        if (found == nullptr)
          throw InputError(fmt::format("{}: there is no such number in {}", c.pointer, input.result_name));
      }
      if (found == nullptr) throw InputError(fmt::format("{}: \"from\" names no such stage", c.pointer));
      double value = NAN, error = 0;
      std::string unit;
      if (found->is_object() && found->contains("value")) {
        if ((*found)["value"].is_number()) value = (*found)["value"].get<double>();
        if (found->contains("std_error") && (*found)["std_error"].is_number())
          error = (*found)["std_error"].get<double>();
        unit = found->value("unit", "");
      } else if (found->is_number()) {
        value = found->get<double>();
      } else if (found->is_boolean()) {
        value = found->get<bool>() ? 1 : 0;
      }
      const double low = c.value ? *c.value - c.tolerance : c.least.value_or(-INFINITY),
                   high = c.value ? *c.value + c.tolerance : c.most.value_or(INFINITY);
      const double reach = 1.96 * error;
      const Verdict verdict = !std::isfinite(value)                           ? Verdict::missing
                              : value - reach >= low && value + reach <= high ? Verdict::holds
                              : value + reach < low || value - reach > high   ? Verdict::fails
                                                                              : Verdict::open;
      std::string claimed = c.value ? fmt::format("{:g}", *c.value) : "";
      if (c.value && c.tolerance > 0) claimed += fmt::format(" ± {:g}", c.tolerance);
      if (c.least) claimed += fmt::format("at least {:g}", *c.least);
      if (c.most) claimed += fmt::format("{}at most {:g}", c.least ? ", " : "", *c.most);
      std::string measured = "–";
      if (std::isfinite(value)) {
        if (error > 0) {
          const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 9);
          measured = fmt::format("{:.{}f} ± {:.{}f}", value, decimals, error, decimals);
        } else {
          const bool chance = c.pointer.ends_with("/p_value");
          measured = chance && value < 1e-10 ? "below 1e-10" : fmt::format("{:.4g}", value);
          if (!chance) measured += " (no error bar)";
        }
        if (!unit.empty() && unit != "1") measured += " " + unit;
      }
      Json row{{"claim", c.claim}, {"claimed", claimed}, {"measured", measured}, {"verdict", name_of(verdict)}};
      row["value"] = std::isfinite(value) ? Json(value) : Json();
      if (error > 0) row["std_error"] = error;
      if (!c.place.empty()) row["place"] = c.place;
      if (!c.measured_as.empty()) row["measured_as"] = c.measured_as;
      if (!c.note.empty()) row["note"] = c.note;
      row["number"] = c.pointer;
      rows.push_back(std::move(row));
      verdicts.add({c.claim, c.measured_as, claimed, value, error > 0 ? error : no_number, name_of(verdict), c.place});
      table += fmt::format("| {}{} | {} | {} | {}{} | {} |\n", cell(c.claim),
                           c.measured_as.empty() ? "" : " (" + cell(c.measured_as) + ")", claimed, cell(measured),
                           name_of(verdict), c.note.empty() ? "" : ": " + cell(c.note), cell(c.place));
    }
    write_file(context.output("claims.json"),
               dump(Json{{"verdict_is",
                          "the interval of 95 % of the measured number (1.96 standard errors) lies within "
                          "what is claimed (holds), outside of it (does not hold), or in both (open)"},
                         {"claims", std::move(rows)}}));
    verdicts.write(context.output("claims.csv"));
    write_file(context.output("claims.md"), table);
  }

 private:
  std::vector<Claim> claims_;
};

}  // namespace

StageRow claims_stage() {
  return {.name = "claims",
          .summary = "sets a paper's claims beside what was measured, with verdicts",
          .accepts = {"chart", "critical", "study", "simulate", "fit", "map", "extract"},
          .fewest_inputs = 1,
          .most_inputs = 64,
          .result = "claims.json",
          .pages = claims_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Claims>(); }};
}

}  // namespace shakebed::pipelines
