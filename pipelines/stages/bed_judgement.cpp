#include "pipelines/stages/bed_judgement.hpp"

#include <fmt/format.h>

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/hard_disk_trust.hpp"

#include "statistics/rest.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::string_view verdict_holds = "holds";

struct Objection {
  std::string verdict, why, advice;
};

std::optional<double> number_at(const Json& json, const std::string& pointer) {
  const Json* found = find_pointer(json, pointer);
  return found != nullptr && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
}

std::string sentence(std::string text) {
  text = capitalized(std::move(text));
  if (!text.empty() && text.back() != '.') text += '.';
  return text;
}

void append(Json& text, const std::string& more) {
  const std::string before = text.get<std::string>();
  text = before + (before.empty() ? "" : " ") + sentence(more);
}

class Judge {
 public:
  Judge(const SceneOptions& bed, const Json& joined, std::size_t beds)
      : bed_(bed),
        joined_(joined),
        beds_(beds),
        trust_(trust_in_hard_disks({bed.restitution(), bed.friction(), bed.tangential_restitution(), bed.gamma(),
                                    bed.description().column_number()})) {}

  Json run() {
    if (!at_rest()) look_for_objections();
    if (objections_.empty()) return without_objection();
    Json out{{"verdict", objections_.front().verdict}, {"why", ""}, {"advice", ""}};
    for (const Objection& one : objections_) {
      append(out["why"], one.why);
      append(out["advice"], one.advice);
    }
    if (as_real_contacts()) append(out["why"], trust_.why);
    say_pressed(out);
    return out;
  }

 private:
  // Its time steps leave an error in the ledger, which hard disks do not have.
  void say_pressed(Json& out) const {
    if (number_at(joined_, "/energy_ledger/step_error").value_or(0) == 0) return;
    append(out["why"], "the disks were simulated as soft disks while the bed was pressed on the floor");
  }

  [[nodiscard]] Json without_objection() const {
    Json out{{"verdict", verdict_holds}, {"why", ""}, {"advice", "Quote the numbers with their errors."}};
    append(out["why"], beds_ > 1 ? fmt::format("{} beds agree, and none of them changed while it was measured", beds_)
                                 : "the bed did not change while it was measured");
    if (as_real_contacts()) append(out["why"], trust_.why);
    say_pressed(out);
    return out;
  }

  // Of a bed that lies still nothing else matters.
  bool at_rest() {
    if (!lies_still(joined_)) return false;
    object("at rest", fmt::format("the disks hardly move: T_x and T_z are below {:g} m g D", temperature_at_rest),
           "Use a larger Gamma: below Gamma = 1 the bed never leaves the floor");
    return true;
  }

  void look_for_objections() {
    rows();
    contact_duration();
    drift();
    between_beds();
    one_bed();
    real_contacts();
  }

  void object(std::string verdict, std::string why, std::string advice) {
    objections_.push_back({std::move(verdict), std::move(why), std::move(advice)});
  }

  void rows() {
    if (const auto odd = bed_.locking()) object("rows lock", odd->what, odd->suggestion);
  }

  void contact_duration() {
    const auto effect = number_at(joined_, "/contact_duration_effect/value");
    if (!effect || !(*effect > allowed_contact_effect) || as_real_contacts()) return;
    object("contact duration too long",
           fmt::format("T may be too high by about {} or more, because the contact duration t_c makes {} of the "
                       "contacts elastic",
                       per_cent(*effect), per_cent(number_at(joined_, "/elastic_share/value").value_or(0))),
           "Give a shorter \"contact_duration\"; the warning proposes a value");
  }

  void drift() {
    const auto found = notable_drift_of(joined_);
    if (!found) return;
    object(
        "still changing",
        fmt::format("the bed still changes while it is measured: {} is {} by {:.0f} % in the second half of the time",
                    found->what, found->change > 0 ? "higher" : "lower", 100 * found->part),
        "Give a longer \"settle\"");
  }

  void between_beds() {
    const auto found = notable_spread(joined_, beds_);
    if (!found) return;
    object("beds differ",
           fmt::format("the {} beds differ by more than chance: the standard deviation of {} between beds is {:.2g}, "
                       "and the stated error of each bed is {:.2g}. The result depends on how the bed was filled; the "
                       "stated error includes this",
                       beds_, found->what, found->spread, found->within),
           "More \"replicas\" reduce the error");
  }

  void one_bed() {
    if (beds_ > 1 || !bed_.dissipates()) return;
    object("one bed",
           "the errors are those of a single bed. Another seed or another start may differ by more, because a dense "
           "bed keeps the effect of its filling for a long time",
           "Run several \"replicas\" (4 by default)");
  }

  // The study covers such a bed, and its hard disks, with no longer a contact duration, do as soft spheres do.
  [[nodiscard]] bool as_real_contacts() const {
    constexpr double rounding = 1e-3;
    return trust_.covered && trust_.agrees && !bed_.locking() &&
           bed_.contact_duration() <= contact_duration_of_study * (1 + rounding);
  }

  void real_contacts() {
    if (!trust_.agrees) object("real contacts may matter", trust_.why, trust_.advice);
  }

  const SceneOptions& bed_;
  const Json& joined_;
  std::size_t beds_;
  HardDiskTrust trust_;
  std::vector<Objection> objections_;
};

}  // namespace

Json judgement_of(const SceneOptions& bed, const Json& joined, std::size_t beds) {
  return Judge(bed, joined, beds).run();
}

bool speaks_against(const Json& judgement) {
  return judgement.is_object() && judgement.contains("verdict") && judgement.at("verdict") != verdict_holds;
}

std::string judgement_text(const Json& observables) {
  const Json* judgement = find_pointer(observables, "/judgement");
  if (judgement == nullptr || !judgement->is_object()) return "";
  std::string numbers;
  const auto add = [&](const char* key, const char* name, const char* unit) {
    const std::string pointer = "/" + std::string(key);
    const auto value = number_at(observables, pointer + "/value"),
               error = number_at(observables, pointer + "/std_error");
    if (!value) return;
    numbers += fmt::format("{}{} = {:.4g}", numbers.empty() ? "" : ", ", name, *value);
    if (error && *error > 0) numbers += fmt::format(" ± {:.2g}", *error);
    numbers += unit;
  };
  add("temperature_x", "T_x", "");
  add("temperature_z", "T_z", " m g D");
  add("center_of_mass_rise", "rise", " D");
  std::string verdict = sentence(judgement->value("verdict", ""));
  if (!verdict.empty()) verdict.back() = ':';
  return fmt::format("{}. {} {} {}", numbers, verdict, judgement->value("why", ""), judgement->value("advice", ""));
}

}  // namespace shakebed::pipelines
