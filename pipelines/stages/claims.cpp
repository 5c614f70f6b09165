#include "pipelines/stages/claims.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipelines/formats/files.hpp"
#include "pipelines/stages/published.hpp"

namespace shakebed::pipelines {
namespace {

// Half the 95 % interval of a normal distribution, in standard errors.
constexpr double interval_95 = 1.96;

struct Claim {
  std::string claim, place, pointer, over, note, measured_as, published;
  std::optional<double> value, least, most;
  double tolerance = 0;
  bool main = false;
  bool unread = false;  // the published number is from memory: it gives no verdict
};

// The interval of the measured number, by default of 95 %, against what is claimed. A claim of a number to some
// tolerance is an interval too.
enum class ClaimVerdict { holds, open, fails, missing, unread };
std::string_view verdict_name(ClaimVerdict verdict) {
  switch (verdict) {
    case ClaimVerdict::holds:
      return "holds";
    case ClaimVerdict::open:
      return "open";
    case ClaimVerdict::fails:
      return "does not hold";
    case ClaimVerdict::unread:
      return "no verdict";
    default:
      return "not measured";
  }
}

// The measured number that a claim points at; NaN: it was not measured.
struct Measured {
  double value = NAN, error = 0;
  std::string unit;
};
Measured read_number(const std::string& pointer, const std::vector<Input>& inputs) {
  const auto input = std::find_if(inputs.begin(), inputs.end(),
                                  [id = split_pointer(pointer).front()](const Input& one) { return one.id == id; });
  if (input == inputs.end()) throw InputError(fmt::format("{}: the stage of this pointer is not in \"from\"", pointer));
  const Json result = input->result();
  const Json* found =
      find_pointer(result, std::string_view(pointer).substr(1 + escape_pointer_token(input->id).size()));
  if (found == nullptr) throw InputError(fmt::format("{}: there is no such number in {}", pointer, input->result_name));
  Measured measured;
  if (found->is_object() && found->contains("value")) {
    if ((*found)["value"].is_number()) measured.value = (*found)["value"].get<double>();
    // null: the error is not known, as of the middle of a range. Such a claim stays open.
    if (found->contains("std_error"))
      measured.error = (*found)["std_error"].is_number() ? (*found)["std_error"].get<double>() : NAN;
    measured.unit = found->value("unit", "");
  } else if (found->is_number()) {
    measured.value = found->get<double>();
  } else if (found->is_boolean()) {
    measured.value = found->get<bool>() ? 1 : 0;
  }
  return measured;
}

// The number of a claim, over the one it is divided by; their errors are taken as independent.
Measured read_claimed(const Claim& claim, const std::vector<Input>& inputs) {
  Measured number = read_number(claim.pointer, inputs);
  if (claim.over.empty()) return number;
  const Measured over = read_number(claim.over, inputs);
  if (over.value == 0) return {NAN, 0, "1"};
  const double ratio = number.value / over.value;
  return {ratio, std::hypot(number.error, ratio * over.error) / std::abs(over.value), "1"};
}

ClaimVerdict verdict_of(const Claim& claim, const Measured& measured, double half_width) {
  if (!std::isfinite(measured.value)) return ClaimVerdict::missing;
  if (claim.unread) return ClaimVerdict::unread;
  const double low = claim.value ? *claim.value - claim.tolerance : claim.least.value_or(-INFINITY),
               high = claim.value ? *claim.value + claim.tolerance : claim.most.value_or(INFINITY);
  const double least = measured.value - half_width * measured.error,
               most = measured.value + half_width * measured.error;
  if (least >= low && most <= high) return ClaimVerdict::holds;
  return most < low || least > high ? ClaimVerdict::fails : ClaimVerdict::open;
}

std::string claimed_text(const Claim& claim) {
  std::string text = claim.value ? fmt::format("{:g}", *claim.value) : "";
  if (claim.value && claim.tolerance > 0) text += fmt::format(" ± {:g}", claim.tolerance);
  if (claim.least) text += fmt::format("at least {:g}", *claim.least);
  if (claim.most) text += fmt::format("{}at most {:g}", claim.least ? ", " : "", *claim.most);
  return text;
}

// Two digits of the error, and the value as far as they go.
std::string measured_text(const Claim& claim, const Measured& measured) {
  if (!std::isfinite(measured.value)) return "–";
  std::string text;
  if (measured.error > 0) {
    const int decimals = std::clamp(1 - static_cast<int>(std::floor(std::log10(measured.error))), 0, 9);
    text = fmt::format("{:.{}f} ± {:.{}f}", measured.value, decimals, measured.error, decimals);
  } else if (claim.pointer.ends_with("/p_value")) {
    text = measured.value < 1e-10 ? "below 1e-10" : fmt::format("{:.4g}", measured.value);
  } else {
    text = fmt::format("{:.4g} (no error bar)", measured.value);
  }
  if (!measured.unit.empty() && measured.unit != "1") text += " " + measured.unit;
  return text;
}

struct Judged {
  std::string claimed, measured;
  ClaimVerdict verdict;
};

Json claim_json(const Claim& c, const Measured& number, const Judged& judged) {
  Json row{{"claim", c.claim},
           {"claimed", judged.claimed},
           {"measured", judged.measured},
           {"verdict", verdict_name(judged.verdict)}};
  row["value"] = std::isfinite(number.value) ? Json(number.value) : Json();
  if (number.error > 0) row["std_error"] = number.error;
  if (!c.place.empty()) row["place"] = c.place;
  if (!c.measured_as.empty()) row["measured_as"] = c.measured_as;
  if (!c.note.empty()) row["note"] = c.note;
  row["number"] = c.pointer;
  if (!c.over.empty()) row["over"] = c.over;
  if (!c.published.empty()) row["published"] = c.published;
  if (c.main) row["main"] = true;
  return row;
}

std::string markdown_row(const Claim& c, const Judged& judged) {
  const auto cell = [](const std::string& text) {
    std::string out;
    for (const char letter : text) out += letter == '|' ? std::string("\\|") : std::string(1, letter);
    return out;
  };
  return fmt::format("| {}{} | {} | {} | {}{} | {} |\n", cell(c.claim),
                     c.measured_as.empty() ? "" : " (" + cell(c.measured_as) + ")", judged.claimed,
                     cell(judged.measured), verdict_name(judged.verdict), c.note.empty() ? "" : ": " + cell(c.note),
                     cell(c.place));
}

// The published number takes the place of what a recipe would say of it. A recipe with every option written out says it
// again, and must say the same.
void take_published(Fields& fields, Claim& claim) {
  const PublishedLookup found = find_published(claim.published);
  if (!found.number) return fields.problem("/published", found.problem, found.suggestion);
  const PublishedClaim& number = *found.number;
  const auto same = [](const std::optional<double>& given, const std::optional<double>& published) {
    return !given || given == published;
  };
  fields.require(same(claim.value, number.value) && same(claim.least, number.least) && same(claim.most, number.most) &&
                     (claim.tolerance == 0 || claim.tolerance == number.tolerance),
                 "published", "the value or the bounds in the recipe differ from the published ones",
                 "Leave them out: the published ones are then used");
  claim.value = number.value, claim.least = number.least, claim.most = number.most;
  claim.tolerance = number.tolerance, claim.unread = number.from_memory;
  if (claim.place.empty()) claim.place = number.place;
}

void describe_claim(Fields& f, Claim& c) {
  f.text("claim", c.claim, {.help = "statement of the paper", .required = true});
  f.text("place", c.place, {.help = "place in the paper"});
  f.text("number", c.pointer,
         {.help = "pointer to the measured number: /<stage id>/<name in its result>", .required = true});
  f.text("over", c.over,
         {.help = "pointer to a second number, by which the first is divided; its error must be independent"});
  f.text("measured_as", c.measured_as, {.help = "definition of the measured number, in words"});
  f.text("published", c.published,
         {.help = "claimed number, as <paper>/<name> of reference-data/<paper>/numbers.json, in place of value, least "
                  "and most"});
  f.number("value", c.value, {.help = "claimed value"});
  f.number("tolerance", c.tolerance, {.help = "tolerance of the claimed value, in its unit", .range = non_negative});
  f.number("least", c.least, {.help = "claimed lower bound"});
  f.number("most", c.most, {.help = "claimed upper bound"});
  f.text("note", c.note, {.help = "remarks on the claim"});
  f.boolean("main", c.main, {.help = "whether the report and the list of results begin with this claim"});
  if (!f.decoding()) return;
  if (!c.published.empty()) take_published(f, c);
  f.require(c.value || c.least || c.most || !c.published.empty(), "",
            "this claim has no number: give \"published\", \"value\", \"least\" or \"most\"");
  f.require(!c.value || (!c.least && !c.most), "value", "a claim has either a value or bounds, not both");
  if (f.has("number")) f.check_result("/number", c.pointer);
  if (!c.over.empty()) f.check_result("/over", c.over);
}

class Claims : public Stage {
 public:
  void describe(Fields& fields) override {
    fields.number("standard_errors", standard_errors_,
                  {.help = "half width of the interval that decides the verdict, in standard errors; 1.96: 95 %",
                   .range = positive});
    fields.array<Claim>("claims", claims_, describe_claim,
                        {.help = "claims of the paper, one by one", .required = true});
    if (fields.decoding())
      fields.require(!claims_.empty() || !fields.has("claims"), "claims",
                     "\"claims\" is empty: give at least one claim");
  }

  void results(ResultList& list) const override {
    const std::string row = "/claims/#/";
    list.text("/verdict_is", "what the verdicts mean");
    list.text(row + "claim", "statement of the paper");
    list.text(row + "claimed", "the claim as a number or an interval");
    list.text(row + "measured", "the measured number with its error");
    list.text(row + "verdict", "holds, open, does not hold, no verdict, or not measured");
    list.number(row + "value", "1", "the measured number, in its own unit", {}, true);
    list.number(row + "std_error", "1", "standard error of the measured number", given_when("the number has an error"));
    list.text(row + "number", "pointer to the measured number");
    const Given written = given_when("the claim states it");
    list.text(row + "place", "place of the claim in the paper", written);
    list.text(row + "measured_as", "definition of the measured number, in words", written);
    list.text(row + "over", "pointer to the number by which it is divided", written);
    list.text(row + "note", "remarks on the claim", written);
    list.text(row + "published", "published number, as <paper>/<name>", written);
    list.truth(row + "main", "whether the report begins with this claim", written);
    list.table({"claims.csv",
                "claims, measured numbers and verdicts",
                {{"claim", "", "statement of the paper"},
                 {"measured_as", "", "definition of the measured number, in words"},
                 {"claimed", "", "the claim as a number or an interval"},
                 {"measured", "1", "the measured number, in its own unit"},
                 {"std_error", "1", "standard error of the measured number, in the same unit"},
                 {"verdict", "", "holds, open, does not hold, no verdict, or not measured"},
                 {"place", "", "place of the claim in the paper"}}});
  }

  void run(RunContext& context) const override {
    Json rows = Json::array();
    Table verdicts = context.table("claims.csv");
    std::string markdown = "| claim | claimed | measured | verdict | where |\n|---|---|---|---|---|\n";
    for (const Claim& claim : claims_) {
      const Measured number = read_claimed(claim, context.inputs());
      const Judged judged{claimed_text(claim), measured_text(claim, number),
                          verdict_of(claim, number, standard_errors_)};
      rows.push_back(claim_json(claim, number, judged));
      verdicts.add({claim.claim, claim.measured_as, judged.claimed, number.value,
                    number.error > 0 ? number.error : no_number, verdict_name(judged.verdict), claim.place});
      markdown += markdown_row(claim, judged);
    }
    write_file(context.output("claims.json"), dump(Json{{"verdict_is", rule()}, {"claims", std::move(rows)}}));
    verdicts.write(context.output("claims.csv"));
    write_file(context.output("claims.md"), markdown);
  }

 private:
  std::string rule() const {
    std::string rule =
        standard_errors_ == interval_95
            ? "the interval of 95 % of the measured number (1.96 standard errors)"
            : fmt::format("the interval of {:g} standard errors of the measured number", standard_errors_);
    rule += " lies within the claimed range (holds), outside of it (does not hold), or partly within it (open)";
    if (std::any_of(claims_.begin(), claims_.end(), [](const Claim& claim) { return claim.unread; }))
      rule += "; a published number that was not read in print gives no verdict";
    return rule;
  }

  double standard_errors_ = interval_95;
  std::vector<Claim> claims_;
};

}  // namespace

StageRow claims_stage() {
  return {.name = "claims",
          .summary = "compares the claims of a paper with measured numbers, and gives a verdict on each",
          .accepts = {"chart", "critical", "scaling", "study", "simulate", "fit", "map", "extract"},
          .fewest_inputs = 1,
          .most_inputs = 64,
          .result = "claims.json",
          .pages = claims_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Claims>(); }};
}

}  // namespace shakebed::pipelines
