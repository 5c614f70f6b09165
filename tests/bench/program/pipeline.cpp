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
constexpr double bed_diameter = 3e-3, temperature = 1;  // m; m g D
constexpr int bed_column = 4;                           // N D/W

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
      {"disks", {{"count", bed_column * s.width}, {"diameter", bed_diameter}}},
      {"gravity", 9.81},
      {"box", {{"width", s.width * bed_diameter}, {"sides", "periodic"}}},
      {"floor", {{"motion", "still"}}},
      {"bath", {{"kind", "langevin"}, {"temperature", temperature * bed_diameter}, {"rate", 20}, {"interval", 2e-3}}},
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
  Json render{{"stage", "render"}, {"from", "bed"}, {"seed", seed}, {"scale", bed_diameter / s.pixels_a_diameter}};
  if (s.camera_faults)
    render["noise"] = 5, render["exposure"] = 0.5e-3, render["blur"] = 0.8;
  else
    render["noise"] = 0, render["exposure"] = 0, render["blur"] = 0.5, render["gradient_x"] = 0,
    render["gradient_y"] = 0;
  Json stages =
      Json::array({simulate_json(s, seed, s.interval * s.frames, s.frames), render,
                   Json{{"stage", "extract"}, {"from", "render"}, {"diameter", bed_diameter}, {"overlays", 0}}});
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
                     bed_column * s.width, s.interval * s.frames);
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
  return {s.pixels_a_diameter, s.frames, bed_column * s.width, s.interval * s.frames};
}
Json percent_or_null(double value) { return number_or_null(100 * value); }

// What an accuracy costs. Of so many settings some did well by luck: the cheapest that did well are measured again,
// with beds that no choice has seen, and the first that keeps the goal by these is named.
class GoalSearch {
 public:
  GoalSearch(const std::vector<Trial>& trials, const Effort& effort, StageResult& result)
      : trials_(trials), effort_(effort), result_(result) {
    if (effort.quick) rules_.budget = 12;
    for (const Trial& trial : trials) known_.push_back(trial.measured(trial.best_way()));
    table_.title = "Settings for an accuracy of T, measured again";
    table_.note = fmt::format(
        "settings that did well at first, the cheapest first, each measured again with beds of new "
        "seeds; with the confidence given their rms lies below the bound. All tries for a goal "
        "together name a setting that does not keep it with a chance of {:g} % at most",
        100 * rules_.chance);
    table_.header = {"goal %",      "px/D", "frames", "disks",  "bed s",   "fit",          "CPU s",
                     "first rms %", "beds", "rms %",  "bias %", "bound %", "confidence %", "verdict"};
    again_.line = false;
  }

  // The points that were measured again, as a curve.
  Curve run() {
    for (const double goal : {0.05, 0.02, 0.01}) {
      if (effort_.quick && goal < 0.02) {
        result_.sentences.push_back(fmt::format(
            "For {:g} % in T: what keeps it takes longer than a quick run; `shakebed bench pipeline` tells.",
            100 * goal));
        continue;
      }
      const Choice choice = choose_setting(
          known_, goal, [&](std::size_t setting) { return measure_again(setting, goal); }, rules_);
      for (const Confirmation& one : choice.tried) table_.rows.push_back(row_of(one, goal));
      if (choice.setting)
        name_setting(*choice.setting, choice.tried.back(), goal);
      else
        result_.sentences.push_back(nothing_found(choice, goal));
    }
    if (!table_.rows.empty()) result_.tables.push_back(std::move(table_));
    return std::move(again_);
  }

 private:
  // Cheap settings are measured with more beds.
  int beds_for(double cost) const {
    return effort_.quick ? std::clamp(static_cast<int>(10 / cost), 12, 30)
                         : std::clamp(static_cast<int>(150 / cost), 20, 40);
  }

  Measured measure_again(std::size_t setting, double goal) {
    auto found = measured_again_.find(setting);
    if (found == measured_again_.end()) {
      const Settings& s = trials_[setting].settings;
      effort_.step(fmt::format("pipeline: for {:g} %: {}, measured again", 100 * goal, settings_text(s)));
      found = measured_again_
                  .emplace(setting, try_settings(s, 1000 * (setting + 1), beds_for(known_[setting].cost), effort_))
                  .first;
      again_.cost.push_back(found->second.cost.all());
      again_.error.push_back(found->second.error[trials_[setting].best_way()].rms());
    }
    return found->second.measured(trials_[setting].best_way());
  }

  std::vector<Json> row_of(const Confirmation& one, double goal) const {
    const Trial& trial = trials_[one.setting];
    const std::size_t way = trial.best_way();
    const Spread& fresh = measured_again_.at(one.setting).error[way];
    std::vector<Json> row = settings_cells(trial.settings);
    row.insert(row.begin(), 100 * goal);
    for (Json cell :
         {Json(ways[way].brief), Json(one.again.cost), percent_or_null(trial.error[way].rms()), Json(fresh.count),
          percent_or_null(fresh.rms()), percent_or_null(fresh.mean()), percent_or_null(one.bound),
          Json(100 * (1 - one.level)), Json(one.holds ? "keeps it" : "not shown to")})
      row.push_back(std::move(cell));
    return row;
  }

  void name_setting(std::size_t setting, const Confirmation& one, double goal) {
    const Trial& trial = trials_[setting];
    const std::size_t way = trial.best_way();
    result_.sentences.push_back(fmt::format(
        "For {:g} % in T use {}, fitted with {}: {:.2g} CPU seconds (measured again with {} new beds: {:.2g} % rms, "
        "below {:.2g} % with {:.3g} % confidence).",
        100 * goal, settings_text(trial.settings), ways[way].name, one.again.cost, one.again.count,
        100 * measured_again_.at(setting).error[way].rms(), 100 * one.bound, 100 * (1 - one.level)));
    result_.metrics.push_back({fmt::format("{:g} % in T, CPU a bed", 100 * goal), "s", one.again.cost, false});
  }

  std::string nothing_found(const Choice& choice, double goal) const {
    std::string sentence = fmt::format("For {:g} % in T: no setting is shown to keep it", 100 * goal);
    if (std::any_of(choice.tried.begin(), choice.tried.end(),
                    [](const auto& one) { return std::isfinite(one.bound); })) {
      const auto nearest = std::min_element(choice.tried.begin(), choice.tried.end(), [](const auto& a, const auto& b) {
        return std::isfinite(a.bound) && !(a.bound >= b.bound);
      });
      sentence += fmt::format(" ({} did well at first and {} measured again{}; nearest come {}: {:.2g} CPU seconds, ",
                              choice.tried.size(), choice.tried.size() == 1 ? "was" : "were",
                              choice.out_of_budget ? ", others were left for want of time" : "",
                              settings_text(trials_[nearest->setting].settings), nearest->again.cost);
      sentence += fmt::format("{:.2g} % rms, below {:.2g} % with {:.3g} % confidence)",
                              100 * std::sqrt(nearest->again.squares / nearest->again.count), 100 * nearest->bound,
                              100 * (1 - nearest->level));
    }
    return sentence +
           (effort_.quick ? ". A quick run measures short beds and few: `shakebed bench pipeline` tells more." : ".");
  }

  const std::vector<Trial>& trials_;
  const Effort& effort_;
  StageResult& result_;
  ChoiceRules rules_;
  std::vector<Measured> known_;
  std::map<std::size_t, Trial> measured_again_;
  Table table_;
  Curve again_{"measured again with new beds", {}, {}};
};

// Costs and errors of T, dial by dial.
class Dials {
 public:
  Dials(const Effort& effort, StageResult& result) : effort_(effort), result_(result) {
    for (const Way& way : ways)
      errors_.header.push_back(fmt::format("{}: rms", way.brief)), errors_.header.push_back("bias");
    errors_.header.push_back("no fit");
    for (std::size_t k = 0; k < way_count; ++k) by_way_[k].label = ways[k].name, by_way_[k].line = false;
  }

  void run() {
    for (const Dial& dial : all_dials(effort_.quick)) turn(dial);
    for (std::size_t k = 0; k < way_count; ++k) {
      if (k != dial_way) figure_.curves.push_back(std::move(by_way_[k]));
    }
    result_.metrics.push_back({"usual settings, CPU", "s", usual_trial_->cost.all(), false});
    result_.metrics.push_back(
        {"usual settings, error of T by the default fit", "relative", usual_trial_->error[default_way].rms(), false});
    figure_.curves.push_back(GoalSearch(trials_, effort_, result_).run());
    result_.figures.push_back(std::move(figure_));
    result_.tables.push_back(std::move(errors_));
    result_.tables.push_back(std::move(costs_));
  }

 private:
  void turn(const Dial& dial) {
    Curve curve{fmt::format("{} (from {:g} D up)", dial.name, ways[dial_way].low), {}, {}};
    for (const Settings& s : dial.values) {
      const bool is_usual = s == Settings{};
      if (!is_usual || !usual_trial_) {
        effort_.step(fmt::format("pipeline: {}: {}", dial.name, settings_text(s)));
        trials_.push_back(try_settings(s, 1, seeds_, effort_));
        if (is_usual) usual_trial_ = trials_.back();
      }
      const Trial& trial = is_usual ? *usual_trial_ : trials_.back();
      add_rows(dial, trial);
      curve.cost.push_back(trial.cost.all()), curve.error.push_back(trial.error[dial_way].rms());
      if (is_usual) by_way_[default_way].standard = by_way_[default_way].cost.size();
      for (std::size_t k = 0; k < way_count; ++k)
        by_way_[k].cost.push_back(trial.cost.all()), by_way_[k].error.push_back(trial.error[k].rms());
    }
    figure_.curves.push_back(std::move(curve));
  }

  void add_rows(const Dial& dial, const Trial& trial) {
    std::vector<Json> cells = settings_cells(trial.settings);
    cells.insert(cells.begin(), dial.name);
    std::vector<Json> cost = cells;
    for (const double seconds :
         {trial.cost.all(), trial.cost.simulate, trial.cost.render, trial.cost.extract, trial.cost.fit})
      cost.emplace_back(seconds);
    costs_.rows.push_back(std::move(cost));
    int failed = 0;
    for (const Spread& spread : trial.error) {
      cells.push_back(percent_or_null(spread.rms())), cells.push_back(percent_or_null(spread.mean()));
      failed += spread.failed;
    }
    cells.emplace_back(failed);
    errors_.rows.push_back(std::move(cells));
  }

  const Effort& effort_;
  StageResult& result_;
  int seeds_ = effort_.quick ? 4 : 8;
  Table costs_{"What a temperature costs",
               "CPU seconds of one bed, from the simulation to one fit",
               {"dial", "px/D", "frames", "disks", "bed s", "CPU s", "simulate", "render", "extract", "fit"},
               {}};
  Table errors_{
      "Error of T by what can be dialled",
      fmt::format("{} beds a row, each with a seed of its own; T is held at m g D by the reservoir; rms and "
                  "bias of T/T_true - 1 in %, an rms being uncertain by {:.0f} % of itself. {}: {}; {}: {}; {}: "
                  "{}; {}: {}",
                  seeds_, 100 / std::sqrt(2.0 * seeds_), ways[0].brief, ways[0].name, ways[1].brief, ways[1].name,
                  ways[2].brief, ways[2].name, ways[3].brief, ways[3].name),
      {"dial", "px/D", "frames", "disks", "bed s"},
      {}};
  Figure figure_{"pipeline-error",
                 "From bed to temperature: error of T against the CPU time of the whole",
                 "CPU seconds",
                 fmt::format("relative error of T, rms of {} beds", seeds_),
                 {}};
  std::array<Curve, way_count> by_way_;
  std::vector<Trial> trials_;
  std::optional<Trial> usual_trial_;
};

// One long bed without a camera: its kinetic temperature, and what each fit makes of its profile.
struct LongBed {
  double kinetic = 0, kinetic_error = 0;
  Temperatures fitted{}, fit_error{};
};
LongBed measure_long_bed(const Settings& settings, double seconds, const fs::path& folder) {
  Json stages = Json::array({simulate_json(settings, 99, seconds, 0)});
  for (const Way& way : ways) stages.push_back(fit_json_of(way, "bed"));
  const RecipeRun run = run_recipe(Json{{"name", "bench"}, {"stages", stages}}, folder);
  const auto observed = [&](const char* axis, const char* what) {
    return run.number("bed", "observables.json", fmt::format("/temperature_{}/{}", axis, what));
  };
  LongBed bed;
  bed.kinetic = (observed("x", "value") + observed("z", "value")) / 2;
  bed.kinetic_error = std::hypot(observed("x", "std_error"), observed("z", "std_error")) / 2;
  bed.fitted = temperatures_of(run);
  for (std::size_t k = 0; k < way_count; ++k)
    bed.fit_error[k] = run.number(ways[k].id, "fit.json", "/temperature/std_error");
  return bed;
}

// One bed by pictures with the faults of a camera, by perfect ones, and by its true positions.
struct SameBed {
  Temperatures from_noisy, from_clean, from_positions;
};
SameBed measure_three_times(const Settings& usual, std::uint64_t seed, const fs::path& scratch) {
  SameBed bed;
  bed.from_noisy = temperatures_of(run_recipe(recipe_of(usual, seed), scratch / "run"));
  Settings perfect = usual;
  perfect.camera_faults = false;
  const RecipeRun clean = run_recipe(recipe_of(perfect, seed), scratch / "run");
  bed.from_clean = temperatures_of(clean);
  Json stages = Json::array();
  for (const Way& way : ways) {
    Json fit = fit_json_of(way, "bed");
    fit.erase("from");
    fit["profile"] = fs::absolute(clean.out / "bed" / "profile_frames.csv").string();
    stages.push_back(std::move(fit));
  }
  bed.from_positions =
      temperatures_of(run_recipe(Json{{"name", "bench"}, {"stages", std::move(stages)}}, scratch / "positions"));
  return bed;
}

// Where the error comes from, at the usual settings.
void error_budget(const Effort& effort, StageResult& result) {
  effort.step("pipeline: where the error comes from");
  const fs::path scratch = effort.scratch;
  const int seeds = effort.quick ? 4 : 8;
  const double seconds = effort.quick ? 200 : 2000;
  const Settings usual;
  const LongBed truth = measure_long_bed(usual, seconds, scratch / "truth");
  std::array<Spread, way_count> statistics, extraction, image, whole;
  for (int seed = 1; seed <= seeds; ++seed) {
    effort.check_interrupted();
    const SameBed bed = measure_three_times(usual, static_cast<std::uint64_t>(seed), scratch);
    for (std::size_t k = 0; k < way_count; ++k) {
      statistics[k].add(bed.from_positions[k], truth.fitted[k]);
      extraction[k].add(bed.from_clean[k], bed.from_positions[k]);
      image[k].add(bed.from_noisy[k], bed.from_clean[k]), whole[k].add(bed.from_noisy[k], temperature);
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
    const auto add = [&](const char* part, double change, double error) {
      table.rows.push_back({part, std::abs(change), change, error});
    };
    add("simulation: kinetic T against the reservoir's", truth.kinetic / temperature - 1,
        truth.kinetic_error / temperature);
    add("model: fit to the long bed against its kinetic T", truth.fitted[k] / truth.kinetic - 1,
        truth.fit_error[k] / truth.kinetic);
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

// The program shakebed: beside this one, where both are installed, or in the build.
std::string shakebed_program() {
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  for (const char* place : {"shakebed", "../../bin/shakebed", "../../../pipelines/shakebed"}) {
    std::error_code error;
    if (fs::is_regular_file(here / place, error)) return (here / place).lexically_normal().string();
  }
  throw StageError(fmt::format("the program shakebed is not to be found from {}", here.string()));
}

// A small bed and its fit at each of `points` restitutions.
Json sweep_recipe(int points) {
  Json recipe{
      {"name", "bench"},
      {"stages",
       Json::array(
           {Json{{"stage", "simulate"},
                 {"id", "bed"},
                 {"replicas", 1},
                 {"disks", {{"count", 40}, {"diameter", 3e-3}, {"restitution", 0.9}}},
                 {"gravity", 9.81},
                 {"box", {{"width", 30e-3}, {"sides", "periodic"}}},
                 {"floor", {{"motion", "sinusoidal"}, {"amplitude", 1.5e-3}, {"frequency", 20}, {"restitution", 0.9}}},
                 {"settle", 0.1},
                 {"measure", 0.1}},
            fit_json_of(ways[default_way], "bed")})}};
  recipe["sweep"] =
      Json{{"over", {{"/stages/bed/disks/restitution", {{"from", 0.5}, {"to", 0.95}, {"count", points}}}}}};
  return recipe;
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
    write_file(folder / "sweep.json", dump(sweep_recipe(count)));
    double peak = 0;
    const auto run = [&] {
      const double start = children_cpu();
      const ProcessResult done =
          run_process({shakebed_program(), "run", "sweep.json", "--out", "o", "--quiet"}, folder);
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
    Dials(effort, result).run();
    error_budget(effort, result);
    sweep_growth(effort, result);
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
