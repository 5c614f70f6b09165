// End to end: a bed whose temperature is known (a reservoir holds it) is simulated, photographed, found again and
// fitted; the error of T against the CPU seconds of the whole, by what can be dialled, and where the error comes from.
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/process.hpp"
#include "tests/bench/program/choice.hpp"
#include "tests/bench/program/recipe_run.hpp"

namespace shakebed::pipelines::bench {
namespace {

namespace fs = std::filesystem;

// The bed: D = 3 mm, 4 disks a diameter of width, T = m g D by a Langevin bath: a fluid throughout, far above T_c.
constexpr double diameter = 3e-3, temperature = 1;  // m; m g D
constexpr int column = 4;                           // N D/W

// The fits that are compared. The default is what a recipe gets that asks for nothing. Near the floor the disks stand
// in layers, and where the bed is dense it changes over one diameter: no model of a local density has either. The other
// windows leave the lowest 3 D, or all but the dilute part above 6 D, out: less bias, more noise.
struct Way {
  const char* name;
  const char* brief;
  const char* id;
  const char* model;
  double low;  // of the window [D]; 0: by the rule
};
constexpr Way ways[] = {{"enskog-rectangle (the default)", "default", "fit", "enskog-rectangle", 0},
                        {"enskog-rectangle from 3 D up", "from 3 D", "fit-from-3", "enskog-rectangle", 3},
                        {"enskog-rectangle from 6 D up", "from 6 D", "fit-from-6", "enskog-rectangle", 6},
                        {"hydrostatic:best-of", "best-of", "fit-best-of", "hydrostatic:best-of", 0}};
constexpr std::size_t way_count = std::size(ways), default_way = 0, dial_way = 1;

struct Settings {
  int pixels_a_diameter = 12, frames = 60, width = 30;  // width in D
  double interval = 0.05;                               // between frames [s]
  bool camera_faults = true;                            // noise, exposure, uneven light
  friend bool operator==(const Settings&, const Settings&) = default;
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

Json fit_json_of(const Way& way, const char* from) {
  Json fit{{"stage", "fit"},     {"id", way.id},   {"from", from},
           {"model", way.model}, {"sweep", false}, {"compare", false}};
  if (way.low > 0) fit["window"] = {{"low", way.low}};
  return fit;
}

Json recipe_of(const Settings& s, std::uint64_t seed) {
  Json render{{"stage", "render"}, {"from", "bed"}, {"seed", seed}, {"scale", diameter / s.pixels_a_diameter}};
  if (s.camera_faults)
    render["noise"] = 5, render["exposure"] = 0.5e-3, render["blur"] = 0.8;
  else
    render["noise"] = 0, render["exposure"] = 0, render["blur"] = 0.5, render["gradient_x"] = 0,
    render["gradient_y"] = 0;
  Json stages = Json::array({simulate_json(s, seed, s.interval * s.frames, s.frames), render,
                             Json{{"stage", "extract"}, {"from", "render"}, {"diameter", diameter}, {"overlays", 0}}});
  for (const Way& way : ways) stages.push_back(fit_json_of(way, "extract"));
  return Json{{"name", "bench"}, {"stages", std::move(stages)}};
}

using Temperatures = std::array<double, way_count>;  // T/(m g D) by each way of fitting; 0: no fit

Temperatures temperatures_of(const RecipeRun& run) {
  Temperatures found{};
  for (std::size_t k = 0; k < way_count; ++k) {
    const Json json = read_json(run.out / ways[k].id / "fit.json");
    const Json* value = find_pointer(json, "/temperature/value");
    if (value != nullptr && value->is_number()) found[k] = value->get<double>();
  }
  return found;
}

struct Cost {
  double simulate = 0, render = 0, extract = 0, fit = 0;  // CPU seconds
  double all() const { return simulate + render + extract + fit; }
};

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

// One setting: cost and errors over several beds, each with a seed of its own.
struct Trial {
  Settings settings;
  Cost cost;
  std::array<Spread, way_count> error;
  Measured measured(std::size_t way) const {
    return {cost.all(), error[way].squares, error[way].count, error[way].failed};
  }
  // The way of fitting that did best.
  std::size_t best_way() const {
    std::size_t best = 0;
    for (std::size_t k = 1; k < way_count; ++k) {
      if (error[k].failed < error[best].failed ||
          (error[k].failed == error[best].failed && error[k].squares < error[best].squares))
        best = k;
    }
    return best;
  }
};

Trial try_settings(const Settings& s, std::uint64_t first_seed, int seeds, const Effort& effort) {
  Trial trial{s, {}, {}};
  for (int bed = 0; bed < seeds; ++bed) {
    effort.check_interrupted();
    const RecipeRun run =
        run_recipe(recipe_of(s, first_seed + static_cast<std::uint64_t>(bed)), fs::path(effort.scratch) / "run");
    trial.cost.simulate += run.cpu("bed") / seeds, trial.cost.render += run.cpu("render") / seeds;
    trial.cost.extract += run.cpu("extract") / seeds, trial.cost.fit += run.cpu(ways[default_way].id) / seeds;
    const Temperatures found = temperatures_of(run);
    for (std::size_t k = 0; k < way_count; ++k) trial.error[k].add(found[k], temperature);
  }
  return trial;
}

struct Dial {
  std::string name;
  std::vector<Settings> values;
};

std::vector<Dial> all_dials(bool quick) {
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
  using Numbers = std::vector<double>;
  std::vector<Dial> dials = {
      {"resolution", with(&Settings::pixels_a_diameter, quick ? Ints{5, 12, 20} : Ints{4, 6, 8, 12, 16, 24})},
      {"frames", with(&Settings::frames, quick ? Ints{15, 60, 240} : Ints{4, 15, 60, 240, 960})},
      {"disks", with(&Settings::width, quick ? Ints{10, 30, 90} : Ints{5, 10, 30, 90, 270})},
      {"time between frames",
       with(&Settings::interval, quick ? Numbers{0.01, 0.05, 0.25} : Numbers{0.002, 0.01, 0.05, 0.25, 1.25})},
      {"frames and disks", {}}};
  struct Bed {
    int frames, width;
    double interval;
  };
  const std::vector<Bed> few = {{15, 10, 0.05}, {240, 60, 0.05}};
  const std::vector<Bed> all = {{4, 5, 0.05},   {15, 10, 0.05}, {60, 30, 0.05}, {240, 60, 0.05},
                                {240, 90, 0.2}, {480, 90, 0.2}, {960, 90, 0.1}};
  for (const Bed& bed : quick ? few : all) {
    Settings s;
    s.frames = bed.frames, s.width = bed.width, s.interval = bed.interval, s.pixels_a_diameter = 8;
    dials.back().values.push_back(s);
  }
  return dials;
}

// Settings as the first cells of a row.
std::vector<Json> settings_cells(const Settings& s) {
  return {s.pixels_a_diameter, s.frames, column * s.width, s.interval * s.frames};
}
Json percent_or_null(double value) { return number_or_null(100 * value); }

// What an accuracy costs. Of so many settings some did well by luck: the cheapest that did well are measured again,
// with beds that no choice has seen, and the first that keeps the goal by these is named.
void settings_for_goals(const std::vector<Trial>& trials, const Effort& effort, StageResult& result, Curve& again) {
  ChoiceRules rules;
  if (effort.quick) rules.budget = 12;
  // Cheap settings are measured with more beds.
  const auto beds_for = [&](double cost) {
    return effort.quick ? std::clamp(static_cast<int>(10 / cost), 12, 30)
                        : std::clamp(static_cast<int>(150 / cost), 20, 40);
  };
  Table table{"Settings for an accuracy of T, measured again",
              fmt::format("settings that did well at first, the cheapest first, each measured again with beds of new "
                          "seeds; with the confidence given their rms lies below the bound. All tries for a goal "
                          "together name a setting that does not keep it with a chance of {:g} % at most",
                          100 * rules.chance),
              {"goal %", "px/D", "frames", "disks", "bed s", "fit", "CPU s", "first rms %", "beds", "rms %", "bias %",
               "bound %", "confidence %", "verdict"},
              {}};
  std::vector<Measured> known;
  for (const Trial& trial : trials) known.push_back(trial.measured(trial.best_way()));
  std::map<std::size_t, Trial> measured_again;
  for (const double goal : {0.05, 0.02, 0.01}) {
    if (effort.quick && goal < 0.02) {
      result.sentences.push_back(
          fmt::format("For {:g} % in T: what keeps it takes longer than a quick run; `shakebed bench pipeline` tells.",
                      100 * goal));
      continue;
    }
    const auto measure_again = [&](std::size_t setting) {
      auto found = measured_again.find(setting);
      if (found == measured_again.end()) {
        const Settings& s = trials[setting].settings;
        effort.step(fmt::format("pipeline: for {:g} %: {}, measured again", 100 * goal, settings_text(s)));
        found = measured_again
                    .emplace(setting, try_settings(s, 1000 * (setting + 1), beds_for(known[setting].cost), effort))
                    .first;
        again.cost.push_back(found->second.cost.all());
        again.error.push_back(found->second.error[trials[setting].best_way()].rms());
      }
      return found->second.measured(trials[setting].best_way());
    };
    const Choice choice = choose_setting(known, goal, measure_again, rules);
    for (const Confirmation& one : choice.tried) {
      const Trial& trial = trials[one.setting];
      const std::size_t way = trial.best_way();
      const Spread& fresh = measured_again.at(one.setting).error[way];
      std::vector<Json> row = settings_cells(trial.settings);
      row.insert(row.begin(), 100 * goal);
      for (Json cell :
           {Json(ways[way].brief), Json(one.again.cost), percent_or_null(trial.error[way].rms()), Json(fresh.count),
            percent_or_null(fresh.rms()), percent_or_null(fresh.mean()), percent_or_null(one.bound),
            Json(100 * (1 - one.level)), Json(one.holds ? "keeps it" : "not shown to")})
        row.push_back(std::move(cell));
      table.rows.push_back(std::move(row));
    }
    if (choice.setting) {
      const Confirmation& one = choice.tried.back();
      const Trial& trial = trials[*choice.setting];
      const std::size_t way = trial.best_way();
      result.sentences.push_back(fmt::format(
          "For {:g} % in T use {}, fitted with {}: {:.2g} CPU seconds (measured again with {} new beds: {:.2g} % rms, "
          "below {:.2g} % with {:.3g} % confidence).",
          100 * goal, settings_text(trial.settings), ways[way].name, one.again.cost, one.again.count,
          100 * measured_again.at(*choice.setting).error[way].rms(), 100 * one.bound, 100 * (1 - one.level)));
      result.metrics.push_back({fmt::format("{:g} % in T, CPU a bed", 100 * goal), "s", one.again.cost, false});
      continue;
    }
    std::string sentence = fmt::format("For {:g} % in T: no setting is shown to keep it", 100 * goal);
    if (std::any_of(choice.tried.begin(), choice.tried.end(),
                    [](const auto& one) { return std::isfinite(one.bound); })) {
      const auto nearest = std::min_element(choice.tried.begin(), choice.tried.end(), [](const auto& a, const auto& b) {
        return std::isfinite(a.bound) && !(a.bound >= b.bound);
      });
      sentence += fmt::format(" ({} did well at first and {} measured again{}; nearest come {}: {:.2g} CPU seconds, ",
                              choice.tried.size(), choice.tried.size() == 1 ? "was" : "were",
                              choice.out_of_budget ? ", others were left for want of time" : "",
                              settings_text(trials[nearest->setting].settings), nearest->again.cost);
      sentence += fmt::format("{:.2g} % rms, below {:.2g} % with {:.3g} % confidence)",
                              100 * std::sqrt(nearest->again.squares / nearest->again.count), 100 * nearest->bound,
                              100 * (1 - nearest->level));
    }
    sentence += effort.quick ? ". A quick run measures short beds and few: `shakebed bench pipeline` tells more." : ".";
    result.sentences.push_back(std::move(sentence));
  }
  if (!table.rows.empty()) result.tables.push_back(std::move(table));
}

void errors_by_dial(const Effort& effort, StageResult& result) {
  const int seeds = effort.quick ? 4 : 8;
  Table costs{"What a temperature costs",
              "CPU seconds of one bed, from the simulation to one fit",
              {"dial", "px/D", "frames", "disks", "bed s", "CPU s", "simulate", "render", "extract", "fit"},
              {}};
  Table errors{
      "Error of T by what can be dialled",
      fmt::format("{} beds a row, each with a seed of its own; T is held at m g D by the reservoir; rms and "
                  "bias of T/T_true - 1 in %, an rms being uncertain by {:.0f} % of itself. {}: {}; {}: {}; {}: "
                  "{}; {}: {}",
                  seeds, 100 / std::sqrt(2.0 * seeds), ways[0].brief, ways[0].name, ways[1].brief, ways[1].name,
                  ways[2].brief, ways[2].name, ways[3].brief, ways[3].name),
      {"dial", "px/D", "frames", "disks", "bed s"},
      {}};
  for (const Way& way : ways)
    errors.header.push_back(fmt::format("{}: rms", way.brief)), errors.header.push_back("bias");
  errors.header.push_back("no fit");
  Figure figure{"pipeline-error",
                "From bed to temperature: error of T against the CPU time of the whole",
                "CPU seconds",
                fmt::format("relative error of T, rms of {} beds", seeds),
                {}};
  std::array<Curve, way_count> by_way;
  for (std::size_t k = 0; k < way_count; ++k) by_way[k].label = ways[k].name, by_way[k].line = false;
  std::vector<Trial> trials;
  const Settings usual;
  std::optional<Trial> usual_trial;
  for (const Dial& dial : all_dials(effort.quick)) {
    Curve curve{fmt::format("{} (from {:g} D up)", dial.name, ways[dial_way].low), {}, {}};
    for (const Settings& s : dial.values) {
      const bool is_usual = s == usual;
      if (!is_usual || !usual_trial) {
        effort.step(fmt::format("pipeline: {}: {}", dial.name, settings_text(s)));
        trials.push_back(try_settings(s, 1, seeds, effort));
        if (is_usual) usual_trial = trials.back();
      }
      const Trial& trial = is_usual ? *usual_trial : trials.back();
      std::vector<Json> cells = settings_cells(s);
      cells.insert(cells.begin(), dial.name);
      std::vector<Json> cost = cells;
      for (const double seconds :
           {trial.cost.all(), trial.cost.simulate, trial.cost.render, trial.cost.extract, trial.cost.fit})
        cost.emplace_back(seconds);
      costs.rows.push_back(std::move(cost));
      int failed = 0;
      for (const Spread& spread : trial.error) {
        cells.push_back(percent_or_null(spread.rms())), cells.push_back(percent_or_null(spread.mean()));
        failed += spread.failed;
      }
      cells.emplace_back(failed);
      errors.rows.push_back(std::move(cells));
      curve.cost.push_back(trial.cost.all()), curve.error.push_back(trial.error[dial_way].rms());
      if (is_usual) by_way[default_way].standard = by_way[default_way].cost.size();
      for (std::size_t k = 0; k < way_count; ++k)
        by_way[k].cost.push_back(trial.cost.all()), by_way[k].error.push_back(trial.error[k].rms());
    }
    figure.curves.push_back(std::move(curve));
  }
  for (std::size_t k = 0; k < way_count; ++k) {
    if (k != dial_way) figure.curves.push_back(std::move(by_way[k]));
  }
  result.metrics.push_back({"usual settings, CPU", "s", usual_trial->cost.all(), false});
  result.metrics.push_back(
      {"usual settings, error of T by the default fit", "relative", usual_trial->error[default_way].rms(), false});
  Curve again{"measured again with new beds", {}, {}};
  again.line = false;
  settings_for_goals(trials, effort, result, again);
  figure.curves.push_back(std::move(again));
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(errors));
  result.tables.push_back(std::move(costs));
}

// Where the error comes from, at the usual settings.
void error_budget(const Effort& effort, StageResult& result) {
  effort.step("pipeline: where the error comes from");
  const fs::path scratch = effort.scratch;
  const int seeds = effort.quick ? 4 : 8;
  const double seconds = effort.quick ? 200 : 2000;
  const Settings usual;
  // One long bed without a camera.
  Json long_stages = Json::array({simulate_json(usual, 99, seconds, 0)});
  for (const Way& way : ways) long_stages.push_back(fit_json_of(way, "bed"));
  const RecipeRun truth = run_recipe(Json{{"name", "bench"}, {"stages", long_stages}}, scratch / "truth");
  const auto observed = [&](const char* axis, const char* what) {
    return truth.number("bed", "observables.json", fmt::format("/temperature_{}/{}", axis, what));
  };
  const double kinetic = (observed("x", "value") + observed("z", "value")) / 2,
               kinetic_error = std::hypot(observed("x", "std_error"), observed("z", "std_error")) / 2;
  const Temperatures fitted = temperatures_of(truth);
  std::array<Spread, way_count> statistics, extraction, image, whole;
  for (int seed = 1; seed <= seeds; ++seed) {
    effort.check_interrupted();
    const RecipeRun noisy = run_recipe(recipe_of(usual, static_cast<std::uint64_t>(seed)), scratch / "run");
    const Temperatures from_noisy = temperatures_of(noisy);
    Settings perfect = usual;
    perfect.camera_faults = false;
    const RecipeRun clean = run_recipe(recipe_of(perfect, static_cast<std::uint64_t>(seed)), scratch / "run");
    const Temperatures from_clean = temperatures_of(clean);
    Json stages = Json::array();
    for (const Way& way : ways) {
      Json fit = fit_json_of(way, "bed");
      fit.erase("from");
      fit["profile"] = fs::absolute(clean.out / "bed" / "profile_frames.csv").string();
      stages.push_back(std::move(fit));
    }
    const Temperatures from_positions =
        temperatures_of(run_recipe(Json{{"name", "bench"}, {"stages", std::move(stages)}}, scratch / "positions"));
    for (std::size_t k = 0; k < way_count; ++k) {
      statistics[k].add(from_positions[k], fitted[k]), extraction[k].add(from_clean[k], from_positions[k]);
      image[k].add(from_noisy[k], from_clean[k]), whole[k].add(from_noisy[k], temperature);
    }
  }
  for (std::size_t k = 0; k < way_count; ++k) {
    Table table{
        fmt::format("Where the error of T comes from: {}", ways[k].name),
        fmt::format("at {}; a part is the relative change of T that it brings; model: at a bed of {:g} s; "
                    "statistics: fits to the true positions in the frames against that bed; extraction: perfect "
                    "pictures against true positions; image: noise, blur, exposure and uneven light against "
                    "perfect pictures",
                    settings_text(usual), seconds),
        {"part", "rms", "mean", "+-"},
        {}};
    const double fit_error = truth.number(ways[k].id, "fit.json", "/temperature/std_error");
    table.rows.push_back({"simulation: kinetic T against the reservoir's", std::abs(kinetic / temperature - 1),
                          kinetic / temperature - 1, kinetic_error / temperature});
    table.rows.push_back({"model: fit to the long bed against its kinetic T", std::abs(fitted[k] / kinetic - 1),
                          fitted[k] / kinetic - 1, fit_error / kinetic});
    for (const auto& [name, spread] :
         {std::pair<const char*, const Spread*>{"statistics: so few frames", &statistics[k]},
          {"extraction: finding the disks", &extraction[k]},
          {"image: noise, blur, exposure, light", &image[k]},
          {"all together", &whole[k]}})
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
              {"points", "CPU s", "ms a point", "ms a point, all up to date", "memory [MB]"},
              {}};
  std::vector<double> points, cost, kept, memory;
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
                      fit_json_of(ways[default_way], "bed")})}};
    recipe["sweep"] =
        Json{{"over", {{"/stages/bed/disks/restitution", {{"from", 0.5}, {"to", 0.95}, {"count", count}}}}}};
    write_file(folder / "sweep.json", dump(recipe));
    double peak = 0;
    const auto run = [&] {
      const double start = children_cpu();
      const ProcessResult done = run_process(
          {fs::read_symlink("/proc/self/exe").string(), "run", "sweep.json", "--out", "o", "--quiet"}, folder);
      // A point whose little bed cannot be fitted is an honest end of that point.
      if (done.exit_code != exit_ok && done.exit_code != exit_stage_failed && done.exit_code != exit_check_failed)
        throw StageError(
            fmt::format("bench: a sweep of {} points ended with {}: {}", count, done.exit_code, done.output));
      peak = std::max(peak, done.peak_bytes);
      return children_cpu() - start;
    };
    const double first = run(), second = run();
    table.rows.push_back({count, first, 1e3 * first / count, 1e3 * second / count, peak / 1e6});
    points.push_back(count), cost.push_back(first), kept.push_back(second), memory.push_back(peak / 1e9);
  }
  table.note += fmt::format(
      "; cost grows as points^{:.2f}, when all is up to date as points^{:.2f}, "
      "memory as points^{:.2f}",
      exponent(points, cost).value_or(0), exponent(points, kept).value_or(0), exponent(points, memory).value_or(0));
  result.metrics.push_back({"a sweep's point", "s", cost.back() / points.back(), false});
  result.figures.push_back(
      {"growth-sweep",
       "Cost and memory of a sweep against its points",
       "points",
       "CPU seconds; GB",
       {{"first run", points, cost}, {"all up to date", points, kept}, {"memory [GB]", points, memory}},
       false});
  result.tables.push_back(std::move(table));
}

}  // namespace

StageResult bench_pipeline(const Effort& effort) {
  StageResult result;
  result.name = "pipeline", result.title = "pipeline: from a bed to its temperature";
  result.cpu_seconds = cpu_seconds_of([&] {
    errors_by_dial(effort, result);
    error_budget(effort, result);
    sweep_growth(effort, result);
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
