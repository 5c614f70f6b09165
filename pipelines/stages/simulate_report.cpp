// What the pages show of a simulate stage: its numbers with what speaks against them, and the bed in motion.
#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/animation.hpp"
#include "pipelines/stages/bed_judgement.hpp"
#include "pipelines/stages/simulate.hpp"

namespace shakebed::pipelines {
namespace {

std::string motion_html(const FinishedStage& stage, int&) {
  const char* name = stage.files.has("trajectory.extxyz.zst") ? "trajectory.extxyz.zst" : "trajectory.extxyz";
  if (!stage.files.has(name)) return "";
  try {
    const BedDescription bed = BedDescription::read(stage.files.file("bed.json"));
    const double gravity = bed.gravity.value_or(0), frequency = bed.frequency.value_or(0);
    const double unit = bed.reduced || !(gravity > 0) ? 1 : std::sqrt(bed.diameter / gravity);
    return animation_html(stage.files.file(name), frequency > 0 ? 1 / (frequency * unit) : 0);
  } catch (const InputError&) {
    return "";  // a damaged trajectory: the page is shown without it
  }
}

// What the disks' own motion says, whatever a fit of the profile does.
std::string kinetic_facts_html(const FinishedStage& stage, int&) {
  std::string out;
  for (const auto& [key, name] : {std::pair("temperature_x", "T_x"), std::pair("temperature_z", "T_z")}) {
    const std::string length = std::string(key) + "_over_mg";
    const bool has_length = stage.result.contains(length);
    if (!has_length && !stage.result.contains(key)) continue;
    out += fmt::format("<div><dt>kinetic {}{} of the simulated disks ({})</dt><dd>{}</dd></div>\n", prose(name),
                       has_length ? "/(m g)" : "", escape_markup(stage.files.id),
                       shown(stage.result[has_length ? length : key]));
  }
  return out;
}

std::string judgement_html(const FinishedStage& stage, int&) {
  const std::string text = judgement_text(stage.result);
  if (text.empty()) return "";
  return fmt::format("<div class=\"answer\"><strong>{}</strong>: {}</div>\n", escape_markup(stage.files.id),
                     escape_markup(text));
}

std::string judgement_markdown(const FinishedStage& stage) {
  const std::string text = judgement_text(stage.result);
  return text.empty() ? "" : fmt::format("**{}**: {}\n\n", stage.files.id, text);
}

std::string judgement_line(const FinishedStage& stage) {
  const std::string text = judgement_text(stage.result);
  return text.empty() ? "" : fmt::format("{}: {}\n", stage.files.id, text);
}

}  // namespace

StagePages simulate_pages() {
  return {.sections = {{.place = ReportPlace::banner, .html = judgement_html},
                       {.place = ReportPlace::facts, .html = kinetic_facts_html, .once = true},
                       {.place = ReportPlace::motion, .heading = "The bed", .html = motion_html, .once = true}},
          .warnings = {{"contact duration", WarningEffect::measurement,
                        "Give a shorter \"contact_duration\", and compare T."},
                       {"above the highest bin", WarningEffect::measurement,
                        "The top of the profile is incomplete: leave its highest heights out of a fit."},
                       {"checkpoint", WarningEffect::rest, "Nothing: the simulation started again from the beginning."},
                       {"", WarningEffect::measurement, "Measure longer, or simulate more beds (\"replicas\")."}},
          .markdown = judgement_markdown,
          .terminal = judgement_line,
          .yields_to_answer = true};
}

}  // namespace shakebed::pipelines
