// End to end: a bed whose temperature is known (a reservoir holds it) is simulated, photographed, found again and
// fitted; the error of T against the CPU seconds of the whole, by what can be dialled, and where the error comes from.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>

#include "pipelines/bench/recipe_run.hpp"
#include "pipelines/files.hpp"
#include "pipelines/process.hpp"

namespace shakebed::pipelines::bench {
namespace {

namespace fs = std::filesystem;

// The bed: D = 3 mm, 4 disks a diameter of width, T = m g D by a Langevin bath: a fluid throughout, far above T_c.
constexpr double diameter = 3e-3, temperature = 1;  // m; m g D
constexpr int column = 4;                           // N D/W
constexpr const char* best_model = "hydrostatic:best-of";

struct Settings {
  int pixels_a_diameter = 12, frames = 60, width = 30;  // width in D
  double interval = 0.05;                               // between frames [s]
  bool camera_faults = true;                            // noise, exposure, uneven light
};

Json simulate_json(const Settings& s, std::uint64_t seed, double measure, int frames) {
  return Json{
      {"stage", "simulate"},
      {"id", "bed"},
      {"seed", seed},
      {"disks", {{"count", column * s.width}, {"diameter", diameter}}},
      {"gravity", 9.81},
      {"box", {{"width", s.width * diameter}, {"sides", "periodic"}}},
      {"floor", {{"motion", "still"}}},
      {"bath", {{"kind", "langevin"}, {"temperature", temperature * diameter}, {"rate", 20}, {"interval", 2e-3}}},
      {"settle", 2},
      {"measure", measure},
      {"frames", {{"count", frames}}}};
}

Json fit_json_of(const char* id, const char* from, const char* model) {
  return Json{{"stage", "fit"}, {"id", id}, {"from", from}, {"model", model}, {"sweep", false}, {"compare", false}};
}

Json recipe_of(const Settings& s, std::uint64_t seed) {
  Json render{{"stage", "render"}, {"from", "bed"}, {"seed", seed}, {"scale", diameter / s.pixels_a_diameter}};
  if (s.camera_faults)
    render["noise"] = 5, render["exposure"] = 0.5e-3, render["blur"] = 0.8;
  else
    render["noise"] = 0, render["exposure"] = 0, render["blur"] = 0.5, render["gradient_x"] = 0,
    render["gradient_y"] = 0;
  return Json{
      {"name", "bench"},
      {"stages", Json::array({simulate_json(s, seed, s.interval * s.frames, s.frames), render,
                              Json{{"stage", "extract"}, {"from", "render"}, {"diameter", diameter}, {"overlays", 0}},
                              fit_json_of("fit", "extract", best_model),
                              fit_json_of("fit-enskog", "extract", "enskog-rectangle")})}};
}

struct Outcome {
  double best = 0, enskog = 0;  // T/(m g D) by the two models; 0: no fit
  double cpu = 0, cpu_simulate = 0, cpu_render = 0, cpu_extract = 0, cpu_fit = 0;
};

double temperature_of(const RecipeRun& run, const char* id) {
  const Json json = read_json(run.out / id / "fit.json");
  const Json* found = find_pointer(json, "/temperature/value");
  return found != nullptr && found->is_number() ? found->get<double>() : 0;
}

Outcome run_once(const Settings& s, std::uint64_t seed, const Effort& effort) {
  effort.check_interrupted();
  const RecipeRun run = run_recipe(recipe_of(s, seed), fs::path(effort.scratch) / "pipeline");
  Outcome o;
  o.cpu_simulate = run.cpu("bed"), o.cpu_render = run.cpu("render"), o.cpu_extract = run.cpu("extract"),
  o.cpu_fit = run.cpu("fit");
  o.cpu = o.cpu_simulate + o.cpu_render + o.cpu_extract + o.cpu_fit;
  o.best = temperature_of(run, "fit"), o.enskog = temperature_of(run, "fit-enskog");
  return o;
}

// Root mean square and mean of relative differences.
struct Spread {
  double squares = 0, sum = 0;
  int count = 0, failed = 0;
  void add(double value, double reference) {
    if (!(value > 0) || !(reference > 0)) {
      ++failed;
      return;
    }
    const double d = value / reference - 1;
    squares += d * d, sum += d, ++count;
  }
  double rms() const { return count > 0 ? std::sqrt(squares / count) : std::numeric_limits<double>::quiet_NaN(); }
  double mean() const { return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN(); }
  double mean_error() const {
    return count > 1 ? std::sqrt(std::max(0.0, squares / count - mean() * mean()) / (count - 1))
                     : std::numeric_limits<double>::quiet_NaN();
  }
};
Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(); }

std::string settings_text(const Settings& s) {
  return fmt::format("{} px a diameter, {} frames, {} disks, {:.1f} s of bed", s.pixels_a_diameter, s.frames,
                     column * s.width, s.interval * s.frames);
}

void dials(const Effort& effort, StageResult& result) {
  const int seeds = effort.quick ? 4 : 16;
  Table table{
      "Error of T by what can be dialled",
      fmt::format("{} beds a row, each with a seed of its own; T is held at m g D by the reservoir; models: {} and "
                  "enskog-rectangle; seconds: simulate + render + extract + one fit",
                  seeds, best_model),
      {"dial", "px/D", "frames", "disks", "bed s", "CPU s", "simulate", "render", "extract", "fit", "error, rms",
       "bias", "+-", "enskog, rms", "no fit"},
      {}};
  struct Dial {
    std::string name;
    std::vector<Settings> values;
  };
  const auto with = [](auto member, const auto& values) {
    std::vector<Settings> all;
    for (const auto value : values) {
      Settings s;
      s.*member = value;
      all.push_back(s);
    }
    return all;
  };
  using Ints = std::vector<int>;
  const std::vector<Dial> all = {
      {"resolution", with(&Settings::pixels_a_diameter, effort.quick ? Ints{5, 12, 20} : Ints{4, 6, 8, 12, 16, 24})},
      {"frames", with(&Settings::frames, effort.quick ? Ints{15, 60, 240} : Ints{4, 15, 60, 240, 960})},
      {"disks", with(&Settings::width, effort.quick ? Ints{10, 30, 90} : Ints{5, 10, 30, 90, 270})},
      {"time between frames",
       with(&Settings::interval, effort.quick ? std::vector<double>{0.01, 0.05, 0.25}
                                              : std::vector<double>{0.002, 0.01, 0.05, 0.25, 1.25})}};
  Figure figure{"pipeline-error",
                "From bed to temperature: error of T against the CPU time of the whole",
                "CPU seconds",
                "relative error of T, rms",
                {}};
  Curve enskog{"enskog-rectangle, all dials", {}, {}};
  struct Candidate {
    double cpu, error;
    Settings settings;
  };
  std::vector<Candidate> candidates;
  std::optional<std::pair<Outcome, Spread>> standard;  // the default settings, measured once
  Spread standard_enskog;
  const auto measure = [&](const Settings& s, Outcome& mean, Spread& best, Spread& other) {
    for (int seed = 1; seed <= seeds; ++seed) {
      const Outcome one = run_once(s, static_cast<std::uint64_t>(seed), effort);
      mean.cpu += one.cpu / seeds, mean.cpu_simulate += one.cpu_simulate / seeds,
          mean.cpu_render += one.cpu_render / seeds;
      mean.cpu_extract += one.cpu_extract / seeds, mean.cpu_fit += one.cpu_fit / seeds;
      best.add(one.best, temperature), other.add(one.enskog, temperature);
    }
  };
  for (const Dial& dial : all) {
    Curve curve{dial.name, {}, {}};
    for (const Settings& s : dial.values) {
      const Settings usual;
      const bool is_default = s.pixels_a_diameter == usual.pixels_a_diameter && s.frames == usual.frames &&
                              s.width == usual.width && s.interval == usual.interval;
      Outcome mean;
      Spread best, other;
      if (is_default && standard) {
        mean = standard->first, best = standard->second, other = standard_enskog;
      } else {
        effort.step(fmt::format("pipeline: {}: {}", dial.name, settings_text(s)));
        measure(s, mean, best, other);
        if (is_default) standard = {mean, best}, standard_enskog = other;
      }
      table.rows.push_back({dial.name, s.pixels_a_diameter, s.frames, column * s.width, s.interval * s.frames, mean.cpu,
                            mean.cpu_simulate, mean.cpu_render, mean.cpu_extract, mean.cpu_fit,
                            number_or_null(best.rms()), number_or_null(best.mean()), number_or_null(best.mean_error()),
                            number_or_null(other.rms()), best.failed});
      if (is_default) curve.standard = curve.cost.size();
      curve.cost.push_back(mean.cpu), curve.error.push_back(best.rms());
      enskog.cost.push_back(mean.cpu), enskog.error.push_back(other.rms());
      if (best.count == seeds) candidates.push_back({mean.cpu, best.rms(), s});
    }
    figure.curves.push_back(std::move(curve));
  }
  result.metrics.push_back({"default settings, CPU", "s", standard->first.cpu, false});
  result.metrics.push_back({"default settings, error of T", "relative", standard->second.rms(), false});

  // What one per cent costs: the cheapest settings that reach it; where none does, the dials' best course prolonged as
  // 1/sqrt(cost) from the point that is nearest to it in that sense, and said to be that.
  for (const double goal : {0.05, 0.02, 0.01}) {
    const Candidate* cheapest = nullptr;
    for (const Candidate& c : candidates) {
      if (c.error <= goal && (cheapest == nullptr || c.cpu < cheapest->cpu)) cheapest = &c;
    }
    if (cheapest != nullptr) {
      result.sentences.push_back(
          fmt::format("For {:g} % in T use {}: {:.1f} CPU seconds (measured: {:.2g} % rms over {} beds).", 100 * goal,
                      settings_text(cheapest->settings), cheapest->cpu, 100 * cheapest->error, seeds));
    } else {
      result.sentences.push_back(
          fmt::format("For {:g} % in T: none of the settings measured here reaches it.", 100 * goal));
    }
  }
  figure.curves.push_back(std::move(enskog));
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(table));
}

// Where the error comes from, at the default settings.
void budget(const Effort& effort, StageResult& result) {
  effort.step("pipeline: where the error comes from");
  const fs::path scratch = effort.scratch;
  const int seeds = effort.quick ? 4 : 16;
  const Settings usual;
  for (const char* model : {best_model, "enskog-rectangle"}) {
    // One long simulation without a camera.
    const double seconds = effort.quick ? 200 : 2000;
    const RecipeRun truth = run_recipe(
        Json{{"name", "bench"},
             {"stages", Json::array({simulate_json(usual, 99, seconds, 0), fit_json_of("fit", "bed", model)})}},
        scratch / "truth");
    const double kinetic = (truth.number("bed", "observables.json", "/temperature_x/value") +
                            truth.number("bed", "observables.json", "/temperature_z/value")) /
                           2;
    const double kinetic_error = std::hypot(truth.number("bed", "observables.json", "/temperature_x/std_error"),
                                            truth.number("bed", "observables.json", "/temperature_z/std_error")) /
                                 2;
    const double fitted = truth.number("fit", "fit.json", "/temperature/value"),
                 fitted_error = truth.number("fit", "fit.json", "/temperature/std_error");
    Spread statistics, extraction, image, whole;
    for (int seed = 1; seed <= seeds; ++seed) {
      effort.check_interrupted();
      Settings perfect = usual;
      perfect.camera_faults = false;
      const auto t_of = [&](const Settings& s) {
        Json recipe = recipe_of(s, static_cast<std::uint64_t>(seed));
        recipe["stages"][3]["model"] = model;
        recipe["stages"].erase(4);
        return run_recipe(recipe, scratch / "pipeline");
      };
      const RecipeRun clean = t_of(perfect);
      const double from_clean = temperature_of(clean, "fit");
      Json again = fit_json_of("fit", "", model);
      again.erase("from");
      again["profile"] = fs::absolute(clean.out / "bed" / "profile_frames.csv").string();
      const RecipeRun positions =
          run_recipe(Json{{"name", "bench"}, {"stages", Json::array({again})}}, scratch / "positions");
      const double from_positions = temperature_of(positions, "fit");
      const double from_noisy = temperature_of(t_of(usual), "fit");
      statistics.add(from_positions, fitted), extraction.add(from_clean, from_positions);
      image.add(from_noisy, from_clean), whole.add(from_noisy, temperature);
    }
    Table table{
        fmt::format("Where the error of T comes from: {}", model),
        fmt::format("at {}; a part is the relative change of T that it brings; statistics: fits to the true "
                    "positions in the frames against a bed of {:g} s; extraction: perfect pictures against true "
                    "positions; image: noise, blur, exposure and uneven light against perfect pictures",
                    settings_text(usual), seconds),
        {"part", "rms", "mean", "+-"},
        {}};
    table.rows.push_back({"simulation: kinetic T against the reservoir's", std::abs(kinetic / temperature - 1),
                          kinetic / temperature - 1, kinetic_error / temperature});
    table.rows.push_back({"model: fit to the long bed against its kinetic T", std::abs(fitted / kinetic - 1),
                          fitted / kinetic - 1, fitted_error / kinetic});
    for (const auto& [name, spread] : {std::pair<const char*, const Spread*>{"statistics: so few frames", &statistics},
                                       {"extraction: finding the disks", &extraction},
                                       {"image: noise, blur, exposure, light", &image},
                                       {"all together", &whole}})
      table.rows.push_back(
          {name, number_or_null(spread->rms()), number_or_null(spread->mean()), number_or_null(spread->mean_error())});
    result.tables.push_back(std::move(table));
  }
}

double children_cpu() {
  rusage used{};
  getrusage(RUSAGE_CHILDREN, &used);
  return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
         1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

// Cost and memory of a sweep against its points: the program itself is run, as a user would.
void sweep_growth(const Effort& effort, StageResult& result) {
  Table table{"Growth of a sweep with its points",
              "a small bed and its fit at each point; the program's own process",
              {"points", "CPU s", "ms a point", "ms a point, all up to date"},
              {}};
  std::vector<double> points, cost, kept;
  for (const int count : effort.quick ? std::vector<int>{2, 20, 200} : std::vector<int>{2, 20, 200, 2000}) {
    effort.step(fmt::format("pipeline: a sweep of {} points", count));
    const fs::path folder = fs::path(effort.scratch) / "sweep";
    fs::remove_all(folder);
    fs::create_directories(folder);
    Json recipe{
        {"name", "bench"},
        {"stages",
         Json::array({Json{{"stage", "simulate"},
                           {"id", "bed"},
                           {"disks", {{"count", 40}, {"diameter", 3e-3}, {"restitution", 0.9}}},
                           {"gravity", 9.81},
                           {"box", {{"width", 30e-3}, {"sides", "periodic"}}},
                           {"floor",
                            {{"motion", "sinusoidal"}, {"amplitude", 1.5e-3}, {"frequency", 20}, {"restitution", 0.9}}},
                           {"settle", 0.1},
                           {"measure", 0.1}},
                      fit_json_of("fit", "bed", "enskog-rectangle")})}};
    recipe["sweep"] =
        Json{{"over", {{"/stages/bed/disks/restitution", {{"from", 0.5}, {"to", 0.95}, {"count", count}}}}}};
    write_file(folder / "sweep.json", dump(recipe));
    const auto run = [&] {
      const double start = children_cpu();
      const ProcessResult done = run_process(
          {fs::read_symlink("/proc/self/exe").string(), "run", "sweep.json", "--out", "o", "--quiet"}, folder);
      // A point whose little bed cannot be fitted is an honest end of that point.
      if (done.exit_code != exit_ok && done.exit_code != exit_stage_failed && done.exit_code != exit_check_failed)
        throw StageError(
            fmt::format("bench: a sweep of {} points ended with {}: {}", count, done.exit_code, done.output));
      return children_cpu() - start;
    };
    const double first = run(), second = run();
    table.rows.push_back({count, first, 1e3 * first / count, 1e3 * second / count});
    points.push_back(count), cost.push_back(first), kept.push_back(second);
  }
  table.note += fmt::format("; cost grows as points^{:.2f}, when all is up to date as points^{:.2f}",
                            exponent(points, cost).value_or(0), exponent(points, kept).value_or(0));
  result.metrics.push_back({"a sweep's point", "s", cost.back() / points.back(), false});
  result.figures.push_back({"growth-sweep",
                            "CPU seconds of a sweep against its points",
                            "points",
                            "CPU seconds",
                            {{"first run", points, cost}, {"all up to date", points, kept}},
                            false});
  result.tables.push_back(std::move(table));
}

}  // namespace

StageResult bench_pipeline(const Effort& effort) {
  StageResult result;
  result.name = "pipeline", result.title = "pipeline: from a bed to its temperature";
  result.cpu_seconds = cpu_seconds_of([&] {
    dials(effort, result);
    budget(effort, result);
    sweep_growth(effort, result);
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
