// The record of a finished stage, and whether its results are up to date: by content, never by time stamps.
//
// OUT/<id>/.record says what the stage was made from (kind, code, options, seed, fingerprints of all inputs) and what
// it made (fingerprints of all outputs). A stage is up to date when what it would be made from now is the same and its
// outputs are still what it made. OUT/<id>/cost.json says what the work cost on this machine: it is no result, so it
// has no fingerprint and no later stage reads it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipelines/runner/plan.hpp"

namespace shakebed::pipelines {

inline constexpr std::string_view record_name = ".record", cost_name = "cost.json";

// A file and the hashes of its content.
struct Fingerprint {
  std::string file;  // relative to the stage's folder; an external input: its pointer and name
  std::uint64_t bytes = 0;
  std::string fast;    // XXH3, 128 bits
  std::string sha256;  // may be empty for inputs that are another stage's outputs
};

struct StageRecord {
  std::string stage, id;
  std::string code;  // fingerprint of the code that made it
  std::uint64_t seed = 0;
  bool reduced = false;
  Json options;
  std::vector<Fingerprint> inputs;  // of other stages as "<id>/<file>", of external files as "<pointer>=<name>"
  std::vector<Fingerprint> outputs;
  std::vector<std::string> warnings, failed_checks;

  Json to_json() const;
  static StageRecord from_json(const Json& json, const std::string& file);  // throws InputError
};

// The record in a stage's folder; nothing when there is none or it cannot be read.
std::optional<StageRecord> read_record(const std::filesystem::path& stage_directory);

// What a stage cost, where and when.
struct StageCost {
  double wall_seconds = 0, cpu_seconds = 0;
  int threads = 0;  // that it was allowed
  std::string host, finished;
  Json timings = Json::object();  // what the stage gave to RunContext::timing()

  Json to_json() const;
};
// The cost in a stage's folder; nothing when there is none or it cannot be read.
std::optional<StageCost> read_cost(const std::filesystem::path& stage_directory);

// What a stage would be made from now; `upstream` are the records of the stages it reads from, in order.
StageRecord fresh_record(const PlannedStage& stage, const std::vector<const StageRecord*>& upstream);

// One hash of all that decides what a stage makes: kind, code, options, seed, inputs. `record` from fresh_record().
std::string work_key(const StageRecord& record);

// Reasons why the stage must run again, one sentence each; empty if `found` is up to date. `upstream_ids` name the
// stages of fresh's inputs.
std::vector<std::string> reasons_to_run(const StageRecord& fresh, const std::optional<StageRecord>& found,
                                        const std::filesystem::path& stage_directory);

// Fingerprints of all files below a folder (sorted by name; the record, the cost and the log left out).
std::vector<Fingerprint> fingerprint_directory(const std::filesystem::path& directory, bool with_sha256);

// "seed", "floor/amplitude changed \"2.5 mm\" → \"3 mm\"" for every leaf that differs.
std::vector<std::string> differences(const Json& before, const Json& after);

}  // namespace shakebed::pipelines
