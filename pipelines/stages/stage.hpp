// The stages: a table with one row each. Command line, schema, defaults, order, cache and report derive from the row.
// The folders that use this one (runner, report, command line) know no stage by name.
//
// How to add a stage
//   1. pipelines/stages/<name>.cpp holds a class derived from Stage and the function that fills the row. The members
//      of the class are the options with their defaults. Its describe() names every option once (see config.hpp). Its
//      run() does the work.
//
//        namespace shakebed::pipelines {
//        namespace {
//        class Shake : public Stage {
//         public:
//          void describe(Fields& fields) override {
//            fields.quantity("amplitude", amplitude_, dimension::length, {.help = "amplitude", .required = true,
//                                                                         .range = positive, .example = "\"2.5 mm\""});
//          }
//          void results(ResultList& list) const override {            // every number and table that run() writes
//            list.quantity("/rise", "D", "rise of the centre of mass");
//          }
//          void run(RunContext& context) const override {
//            const Input& bed = context.input("simulate");                    // by the kind of the stage it comes from
//            const auto lines = read_profile_csv(bed.file("profile.csv"));    // InputError when it is not one
//            for (int i = 0; i < n; ++i) {
//              context.check_interrupted();                                   // throws Interrupted after Ctrl-C
//              context.progress(double(i) / n, "shaking");
//            }
//            write_file(context.output("shake.json"), dump(result));          // output() is inside a temporary folder
//          }
//         private:
//          double amplitude_ = 0;  // [m]
//        };
//        }  // namespace
//        StageRow shake_stage() {
//          return {.name = "shake", .summary = "shakes the bed", .accepts = {"simulate"}, .fewest_inputs = 1,
//                  .most_inputs = 1, .result = "shake.json",
//                  .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Shake>(); }};
//        }
//        }
//
//   2. one line in stage_table.cpp puts the row into the table.
//   3. what its pages and the terminal show stands in pipelines/stages/<name>_report.cpp (StagePages, below).
//
// A stage is a pure function: options + the inputs' files → files in its output folder. It reads no clock, no
// environment and no other file; its random numbers come from seed(). The same options, inputs and seed give the same
// bytes. Results of other code are not used again: the build takes a fingerprint of the files a stage is made of
// (pipelines/stage_code.cmake), without its *_report.cpp.
//
// The output folder is a temporary one, renamed to OUT/<id> when run() returns: whoever looks sees either all of a
// stage's files or none. On an exception or Ctrl-C it is removed.
//
// Errors: throw InputError for a file that is not what it should be (exit 4), StageError for work that cannot be done
// (exit 5). Mistakes in options belong into describe(): fields.require(...) (exit 3). What is odd but not wrong:
// context.warning(); it stands first in the report. A result that is not what was expected: context.check_failed().
//
// Common keys of every stage, read by the plan: "stage", "id", "from", "units", and "seed" where `uses_seed` is set.
//
// Result files are JSON with quantities as {"value", "std_error", "unit"} (quantity_json). `result` in the row names
// one of them. summary.json repeats that file under the stage's id, and "/<id>/..." pointers of a check refer to it.
// Times, speeds and the host are no result: they are in OUT/<id>/cost.json (context.timing() adds a number there).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/config.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/results.hpp"
#include "pipelines/formats/table.hpp"

namespace shakebed::pipelines {

// A finished stage whose files another one reads.
struct Input {
  std::string id;     // of the stage in this recipe
  std::string stage;  // its kind: "simulate"
  std::filesystem::path directory;
  std::string result_name;  // "fit.json"

  // A file of it that must be there: throws InputError.
  std::filesystem::path file(std::string_view name) const;
  bool has(std::string_view name) const;
  // Its result file. Throws InputError.
  Json result() const;
};

// What a running stage sees of the world.
class RunContext {
 public:
  virtual ~RunContext() = default;

  // --- what goes in
  virtual const std::vector<Input>& inputs() const = 0;  // in the order of "from"
  virtual std::uint64_t seed() const = 0;
  virtual const ResultList& stated() const = 0;  // what results() stated of this stage
  virtual int jobs() const = 0;                  // threads it may use; the result must not depend on it
  // The only input of one of these kinds. Throws InputError if there is none or more than one.
  const Input& input(std::string_view kind) const;
  const Input* find_input(std::string_view kind) const;  // nullptr if none
  std::vector<const Input*> inputs_of(std::string_view kind) const;
  // The input of this stage; with an empty id, the only input. Throws InputError.
  const Input& input_from(const std::string& id) const;

  // --- what comes out
  virtual const std::filesystem::path& output_directory() const = 0;
  std::filesystem::path output(std::string_view name) const { return output_directory() / name; }
  // An empty table with the columns that results() states for this file.
  Table table(std::string_view file) const;
  // A folder for what must outlive a kill -9, Ctrl-C or an error: checkpoints. The same work (code, options, seed,
  // inputs' bytes) started again under the same OUT finds the same folder with what was left in it;
  // other work never does. It is made on the first call, may be read from any thread, and is removed when the stage has
  // finished. Write files there atomically (write_file_atomically): whoever comes next sees whole ones only.
  virtual const std::filesystem::path& scratch() = 0;

  // --- on the way. May be called from any thread.
  // The share of the run's time that is over: the time left is stated by it (statistics/time_left.hpp makes it of work
  // in parts). Cheap: call as often as you like.
  virtual void progress(double fraction, std::string_view what = {}) = 0;
  virtual bool interrupted() const = 0;  // cheap: an atomic flag
  void check_interrupted() const {
    if (interrupted()) throw Interrupted();
  }
  virtual void log(std::string_view line) = 0;           // into OUT/<id>/log.txt, and to stderr with --verbose
  virtual void warning(std::string_view sentence) = 0;   // shown at once, kept in the manifest and first in the report
  virtual void notice(std::string_view /*sentence*/) {}  // shown at once as a warning, kept nowhere: of times, say
  virtual void timing(std::string_view name, double value) = 0;  // a measured speed or time: into cost.json only
  virtual void check_failed(std::string_view sentence) = 0;      // the stage is done, but the run ends with exit 6

  // --- stages inside of a stage. May be called from several threads, with a folder each.
  // Runs a recipe in a folder, on one thread; what is up to date there is kept. Its stages, finished, in the order of
  // the work. `progress`, if any, is called with the share of the chain's time that has passed. Throws ConfigError,
  // StageError with the words of the stage that failed, Interrupted. A failed check is no failure.
  using Progress = std::function<void(double)>;
  virtual std::vector<Input> run_chain(const JsonNode& recipe, const std::filesystem::path& folder,
                                       const Progress& progress) = 0;
  // About how many seconds of a processor the chain takes: Stage::trial_seconds() of its stages. Throws ConfigError.
  virtual double trial_of_chain(const JsonNode& /*recipe*/) const { return 0; }
};

// A chain of stages inside of a stage, as far as the stage that holds it must know it.
struct ChainStage {
  std::string id, stage;  // its kind
  bool reads_files = false;
  std::unique_ptr<ResultList> results;  // what it will give
};
struct Chain {
  std::vector<ChainStage> stages;
  std::vector<Warning> warnings;

  std::vector<StatedStage> stated() const;
  const ChainStage* find(std::string_view id) const;  // nullptr if there is none
};
// Reads the recipe of a chain without running it. Throws ConfigError.
using ChainReader = std::function<Chain(const JsonNode& recipe)>;

// Options, and the work. One object for each stage of a recipe.
class Scalable;  // effort.hpp
class Stage {
 public:
  virtual ~Stage() = default;
  // Names every option: reads, writes or describes them (see config.hpp). Called once when decoding.
  virtual void describe(Fields& fields) = 0;
  // States every number of the result file and every table (see results.hpp). Called when the options are right, before
  // anything runs; list.from() are the stages that it reads.
  virtual void results(ResultList& list) const = 0;
  // Quantities that follow from the options and help to check a recipe before a run: {"gamma": {...}}.
  virtual Json facts() const { return Json::object(); }
  // Whether the stage keeps frames of its bed. Called after describe.
  virtual bool keeps_frames() const { return true; }
  virtual void run(RunContext& context) const = 0;
  // About how many seconds of a processor run() takes, by a short trial of its work, 0.1 s or less; 0: little, or
  // unknown. The trial leaves no trace: it is for the time left alone. May throw what run() throws.
  virtual double trial_seconds() const { return 0; }
  // How it is measured for longer or shorter, for --budget; nullptr where it cannot be. Called after describe.
  virtual const Scalable* scalable() const { return nullptr; }
  // The bed that the stage makes or measures, from its options; empty if it only reads one. Later stages need not
  // state it again, and must not contradict it.
  virtual std::optional<BedDescription> bed() const { return std::nullopt; }

  // For a stage that runs others. Called once after decoding: whether its chains are valid recipes.
  virtual void check_chains(Fields& /*fields*/, const ChainReader& /*read*/) {}
  // The kinds of stages that it runs: their code is part of what its result is made from.
  virtual std::vector<std::string> chain_kinds() const { return {}; }
};

// --- what a stage adds to report, summary and terminal

// A finished stage, with its result file read: an empty object where it has none.
struct FinishedStage {
  Input files;
  Json result;
};
// Where on the page; in this order, with the sections of the page itself between them. `facts` are pairs
// <div><dt>name</dt> <dd>value</dd></div> beside the answer.
enum class ReportPlace { lead, facts, lead_picture, banner, motion, film, claims, figures, checks, fits, maps, frames };
struct ReportSection {
  ReportPlace place;
  std::string_view heading = {};  // once above all sections of this place; none: the section has its own
  // "": nothing to show. `pictures` counts the SVG pictures of the page.
  std::string (*html)(const FinishedStage& stage, int& pictures) = nullptr;
  bool once = false;  // of all sections of this place only the first is shown
};
// What a stage's warning does to the answer of the run, and what to do about it. `recipe`: the bed may not be the one
// that is meant.
enum class WarningEffect { answer, measurement, recipe, rest };
struct WarningAdvice {
  std::string_view about;  // words of the warning; "": of every one
  WarningEffect effect = WarningEffect::rest;
  std::string_view todo{};
};
struct StagePages {
  std::vector<ReportSection> sections{};                          // of report.html
  std::vector<WarningAdvice> warnings{};                          // the first whose words are in a warning counts
  std::string (*markdown)(const FinishedStage& stage) = nullptr;  // of summary.md
  std::string (*terminal)(const FinishedStage& stage) = nullptr;  // a line on stdout
  // Its banner and these texts are left out where another stage gives the answer, which then holds what they say.
  bool yields_to_answer = false;
};

struct StageRow {
  std::string_view name;
  std::string_view summary;                 // for `shakebed schema`, `--help` and the report
  std::vector<std::string_view> accepts{};  // kinds of stages that "from" may name
  int fewest_inputs = 0, most_inputs = 0;
  bool uses_seed = false;
  bool uses_images = false;                  // loads the images module when it runs
  std::string_view result = {};              // the JSON file with its numbers
  std::vector<std::string_view> headline{};  // the numbers in it that a sweep gathers where its recipe names none
  std::string_view answer = {};              // where in it the answer is that summary.json begins with: "/answer"
  std::string_view data_option = {};         // the option that takes the user's points (--data)
  StagePages pages{};
  std::unique_ptr<Stage> (*make)() = nullptr;
};

// The table, in the order of a pipeline.
const std::vector<StageRow>& stage_table();
// nullptr if there is none of this name.
const StageRow* find_stage(std::string_view name);

}  // namespace shakebed::pipelines
