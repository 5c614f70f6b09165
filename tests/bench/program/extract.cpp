// Disks in pictures: error of the centres against cost with the Cramer-Rao bound, HoughCircles beside it, hard cases,
// growth with frames and pixels.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "tests/bench/cases/finder_benchmark.hpp"
#include "tests/bench/program/recipe_run.hpp"

namespace shakebed::pipelines::bench {
namespace {

namespace fs = std::filesystem;

std::string look_of(const ingest::FinderBenchmarkRow& row) {
  return fmt::format("{}, blur {:g} px, noise {:g}", row.shading == ingest::BeadShading::flat ? "flat" : "shaded",
                     row.blur_px, row.noise);
}

// The limits of error and time that the finder is held to.
HardCase limits_case(const ingest::FinderBenchmarkRow& row) {
  HardCase one;
  one.name = "the finder as users get it: " + look_of(row), one.status = "found", one.unit = "px rms";
  one.error = row.rms_px, one.limit = row.rms_limit_px, one.seconds = 1e-3 * row.cpu_ms,
  one.time_limit = 1e-3 * row.cpu_limit_ms;
  one.pass = row.within_limits, one.note = row.beyond;
  return one;
}

// Of a look; its curves are the bound, ours and HoughCircles.
Figure centres_figure(const ingest::FinderBenchmarkRow& row) {
  Figure figure;
  figure.name = fmt::format("extract-{}-blur-{:g}-noise-{:g}",
                            row.shading == ingest::BeadShading::flat ? "flat" : "shaded", row.blur_px, row.noise);
  figure.title = "Centres of disks, " + look_of(row);
  figure.cost_label = "CPU seconds a frame", figure.error_label = "error of a centre [px], rms per axis";
  Curve bound{"Cramer-Rao bound", {}, {}};
  bound.limit = true;
  figure.curves = {std::move(bound), {"shakebed (map, 1, 2, 3 sweeps, joint fit)", {}, {}}, {"HoughCircles", {}, {}}};
  return figure;
}

void add_to_figure(const ingest::FinderBenchmarkRow& row, Figure& figure) {
  Curve& curve = figure.curves[row.method == "hough" ? 2 : 1];
  curve.cost.push_back(1e-3 * row.cpu_ms), curve.error.push_back(row.rms_px);
  if (row.method == "joint fit") curve.standard = curve.cost.size() - 1;
  if (row.bound_px > 0) {
    Curve& bound = figure.curves[0];
    bound.cost.push_back(1e-3 * row.cpu_ms), bound.error.push_back(row.bound_px);
  }
}

void finder(const Effort& effort, StageResult& result) {
  ingest::FinderBenchmarkOptions options;
  options.frames = 20;  // the limit of the time a frame holds for so many: the calibration is shared by them
  if (effort.quick) options.blurs = {1}, options.noises = {5};
  effort.step("extract: the finder, look by look");
  const auto rows = ingest::benchmark_finder(options, [&](const ingest::FinderBenchmarkRow& row) {
    effort.check_interrupted();
    if (effort.console != nullptr)
      effort.console->detail(fmt::format("bench: extract: {}, {}", look_of(row), row.method));
  });
  Table table{
      "Disks found in frames of 826 x 1000 pixels, 1,000 disks of radius 10 px",
      fmt::format("{} frames a look; rms: per axis, of the disks found; bound: Cramer-Rao, per axis; hough: OpenCV's "
                  "HoughCircles, given the radius and tuned with the truth",
                  options.frames),
      {"look", "method", "recall", "precision", "rms [px]", "bound [px]", "rms/bound", "radius error [px]",
       "density error", "CPU ms/frame", "within limits"},
      {}};
  std::map<std::string, Figure> figures;
  for (const ingest::FinderBenchmarkRow& row : rows) {
    const std::string look = look_of(row);
    table.rows.push_back(
        {look, row.method, row.recall, row.precision, row.rms_px, row.bound_px > 0 ? Json(row.bound_px) : Json(),
         row.bound_px > 0 ? Json(row.rms_px / row.bound_px) : Json(), row.radius_error_px, row.density_error,
         row.cpu_ms, row.has_limits ? Json(row.within_limits ? "pass" : "FAIL") : Json()});
    if (row.method == "joint fit")
      result.metrics.push_back({"joint fit, " + look, "s/frame", 1e-3 * row.cpu_ms, false});
    if (row.has_limits) result.hard_cases.push_back(limits_case(row));
    if (!(row.noise > 0)) continue;
    add_to_figure(row, figures.try_emplace(look, centres_figure(row)).first->second);
  }
  for (auto& [look, figure] : figures) {
    std::sort(figure.curves[0].cost.begin(), figure.curves[0].cost.end());  // a level line
    result.figures.push_back(std::move(figure));
  }
  result.tables.push_back(std::move(table));
}

void extract_hard_cases(const Effort& effort, StageResult& result) {
  effort.step("extract: hard cases");
  const fs::path scratch = fs::path(effort.scratch) / "hard-cases";
  fs::create_directories(scratch);
  ingest::benchmark_hard_cases(scratch, [&](const ingest::HardCaseRow& row) {
    effort.check_interrupted();
    HardCase one;
    one.name = row.name, one.status = row.status, one.unit = row.error_unit, one.limit = row.limit;
    if (!row.error_unit.empty()) one.error = row.error;
    one.seconds = 1e-3 * row.cpu_ms, one.time_limit = 1e-3 * row.cpu_limit_ms;
    one.pass = row.pass, one.note = row.note;
    if (row.recall >= 0)
      one.note = fmt::format("recall {:.4g}, precision {:.4g}{}{}", row.recall, row.precision,
                             row.note.empty() ? "" : "; ", row.note);
    result.hard_cases.push_back(std::move(one));
  });
}

// A hexagonal bed at rest, photographed within `seconds`: width and height in D, 12 pixels a diameter. Disks at rest
// have a contact each contact duration: a large bed must not rest for long.
Json photographs(int width, int rows, int frames, double seconds) {
  constexpr double diameter = 3e-3;
  return Json{
      {"name", "bench"},
      {"stages",
       Json::array(
           {Json{{"stage", "simulate"},
                 {"id", "bed"},
                 {"disks",
                  {{"count", width * rows}, {"diameter", diameter}, {"restitution", 0.9}, {"contact_duration", 1e-6}}},
                 {"gravity", 9.81},
                 {"box", {{"width", (width + 0.5) * diameter}, {"sides", "periodic"}}},
                 {"floor", {{"motion", "still"}}},
                 {"start", {{"kind", "hexagonal"}, {"disks_a_row", width}}},
                 {"measure", seconds},
                 {"frames", {{"count", frames}}}},
            Json{{"stage", "render"}, {"from", "bed"}, {"scale", diameter / 12}},
            Json{{"stage", "extract"}, {"from", "render"}, {"diameter", diameter}, {"overlays", 0}}})}};
}

void growth(const Effort& effort, StageResult& result) {
  const auto measure = [&](const std::vector<int>& values, const std::string& what, const auto& recipe_of,
                           const auto& x_of) {
    Table table{"Growth with " + what, "", {what, "render CPU s", "extract CPU s", "memory [MB]"}, {}};
    std::vector<double> x, render, extract, memory;
    for (const int value : values) {
      effort.step(fmt::format("extract: growth with {}, {}", what, value));
      std::optional<RecipeRun> run;
      const auto peak =
          peak_memory_of([&] { run = run_recipe(recipe_of(value), fs::path(effort.scratch) / "growth"); });
      x.push_back(x_of(value, *run)), render.push_back(run->cpu("render")), extract.push_back(run->cpu("extract"));
      table.rows.push_back({x.back(), render.back(), extract.back(), peak ? Json(*peak / 1e6) : Json()});
      if (peak) memory.push_back(*peak / 1e9);
    }
    table.note = fmt::format("simulate, render and extract together for the memory; extract's cost grows as {}^{:.2f}",
                             what, exponent(x, extract).value_or(0));
    if (memory.size() == x.size())
      table.note += fmt::format(", memory as {}^{:.2f}", what, exponent(x, memory).value_or(0));
    Figure figure{"growth-extract-" + what,
                  "Cost and memory against " + what,
                  what,
                  "CPU seconds; GB",
                  {{"extract", x, extract}, {"render", x, render}},
                  false};
    if (memory.size() == x.size()) figure.curves.push_back({"memory [GB]", x, memory});
    result.metrics.push_back({fmt::format("extract, {:g} {}", x.back(), what), "s", extract.back(), false});
    result.figures.push_back(std::move(figure));
    result.tables.push_back(std::move(table));
  };
  measure(
      effort.quick ? std::vector<int>{1, 10, 100} : std::vector<int>{1, 10, 100, 1000, 5000}, "frames",
      [](int frames) { return photographs(12, 8, frames, 1e-3); },
      [](int frames, const RecipeRun&) { return static_cast<double>(frames); });
  measure(
      effort.quick ? std::vector<int>{24, 48, 96} : std::vector<int>{24, 60, 120, 240, 480, 880}, "pixels",
      [](int width) { return photographs(width, width, 1, 1e-6); },
      [](int, const RecipeRun& run) {
        return run.number("render", "render.json", "/width/value") *
               run.number("render", "render.json", "/height/value");
      });
}

}  // namespace

StageResult bench_extract(const Effort& effort) {
  StageResult result;
  result.name = "extract", result.title = "extract: disks in pictures";
  result.cpu_seconds = cpu_seconds_of([&] {
    finder(effort, result);
    extract_hard_cases(effort, result);
    growth(effort, result);
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
