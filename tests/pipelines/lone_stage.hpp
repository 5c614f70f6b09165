// One stage run by itself, on files made by hand.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/stage.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {

class LoneStage : public pipelines::RunContext {
 public:
  explicit LoneStage(const pipelines::StageRow& row) : row_(row) { std::filesystem::create_directory(output_); }

  // A stage in "from": its folder is the scratch folder, or one below it, where the test writes its files.
  void add_input(const std::string& id, const pipelines::StageRow& row, const std::string& below = "") {
    std::filesystem::create_directories(folder_ / below);
    inputs_.push_back({id, std::string(row.name), folder_ / below, std::string(row.result)});
    kinds_.push_back(row.name);
  }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

  // Runs it with these options; its result file. Throws what the stage throws, and runtime_error for bad options.
  pipelines::Json run(const std::string& options) {
    read(options)->run(*this);
    return pipelines::read_json(output(row_.result));
  }
  // The stage with these options, after it has stated its results.
  std::unique_ptr<pipelines::Stage> read(const std::string& options) {
    std::vector<pipelines::Problem> problems;
    const auto node = pipelines::parse_json(options, "options", problems);
    pipelines::Fields::Source source{.file = "options", .problems = &problems};
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      source.upstream.push_back(inputs_[i].stage);
      source.from.push_back({inputs_[i].id, kinds_[i], nullptr});
    }
    std::unique_ptr<pipelines::Stage> stage = row_.make();
    if (node) {
      pipelines::Fields fields = pipelines::Fields::decode(*node, "", source);
      fields.set_reduced(reduced);
      stage->describe(fields);
      fields.finish();
    }
    for (const pipelines::Problem& problem : problems) throw std::runtime_error(problem.pointer + ": " + problem.what);
    stated_ = pipelines::ResultList(source.from);
    stage->results(stated_);
    return stage;
  }

  const std::vector<pipelines::Input>& inputs() const override { return inputs_; }
  std::uint64_t seed() const override { return 1; }
  const pipelines::ResultList& stated() const override { return stated_; }
  int jobs() const override { return 1; }
  const std::filesystem::path& output_directory() const override { return output_; }
  const std::filesystem::path& scratch() override { return output_; }
  void progress(double /*fraction*/, std::string_view /*what*/) override {}
  bool interrupted() const override { return false; }
  void log(std::string_view /*line*/) override {}
  void warning(std::string_view sentence) override { warnings.emplace_back(sentence); }
  void timing(std::string_view /*name*/, double /*value*/) override {}
  void check_failed(std::string_view sentence) override { warnings.emplace_back(sentence); }
  std::vector<pipelines::Input> run_chain(const pipelines::JsonNode& /*recipe*/,
                                          const std::filesystem::path& /*folder*/,
                                          const Progress& /*progress*/) override {
    throw std::runtime_error("a lone stage runs no others");
  }

  std::vector<std::string> warnings;
  bool reduced = false;  // "units": "reduced", which the plan reads

 private:
  const pipelines::StageRow& row_;
  ScratchFolder folder_;
  std::filesystem::path output_ = folder_ / "out";
  std::vector<pipelines::Input> inputs_;
  std::vector<std::string_view> kinds_;
  pipelines::ResultList stated_;
};

}  // namespace shakebed::tests
