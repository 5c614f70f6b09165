// The program behind `shakebed bench`: which stages are measured, and where the results go.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "pipelines/cli/exit_code.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/runner/run.hpp"
#include "tests/bench/program/digits.hpp"
#include "tests/bench/program/document.hpp"

namespace shakebed::pipelines {

namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string stage = "all";
  std::optional<std::string> out, against;
  bool quick = false, json = false, quiet = false, verbose = false;
};

struct Row {
  std::string_view name;
  bench::StageResult (*measure)(const bench::Effort&);
};
constexpr Row rows[] = {{"simulate", bench::bench_simulate},
                        {"extract", bench::bench_extract},
                        {"fit", bench::bench_fit},
                        {"map", bench::bench_map},
                        {"pipeline", bench::bench_pipeline}};

// A folder that is removed at the end.
struct Scratch {
  explicit Scratch(fs::path where) : path(std::move(where)) { fs::create_directories(path); }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path, ignored);
  }
  fs::path path;
};

// Nothing is measured yet; the mistakes of an earlier run are found now rather than after the work.
bench::Document empty_document(const Arguments& arguments) {
  bench::Document document;
  document.quick = arguments.quick;
  if (arguments.against) {
    document.against = read_json(*arguments.against), document.against_name = *arguments.against;
    bench::comparison({}, document.against, document.against_name);
  }
  document.digits = Json::parse(bench::digits_kept);
  document.machine = bench::machine_json();
  document.when = utc_now();
  return document;
}

void write_results(const Arguments& arguments, const bench::Document& document, const fs::path& out) {
  const std::string page = bench::document_html(document, out);
  const Json json = bench::document_json(document);
  write_file_atomically(out / "bench.html", page);
  const std::string text = arguments.json ? dump(json)
                                          : bench::document_text(document) + fmt::format("\nresults: {}\nreport:  {}\n",
                                                                                         (out / "bench.json").string(),
                                                                                         (out / "bench.html").string());
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw StageError("stdout cannot be written");
}

int run_bench(const Arguments& arguments) {
  bench::Document document = empty_document(arguments);
  const fs::path out = arguments.out ? fs::path(*arguments.out) : fs::path("results") / "bench";
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw StageError(fmt::format("--out {}: cannot be made: {}", out.string(), error.message()));
  const FolderLock lock(out);
  install_interrupt_handler();
  Console console(arguments.quiet     ? Console::Level::quiet
                  : arguments.verbose ? Console::Level::verbose
                                      : Console::Level::normal);
  const Scratch scratch(out / "scratch");
  const bench::Effort effort{.quick = document.quick, .scratch = scratch.path.string(), .console = &console};
  for (const Row& row : rows) {
    if (arguments.stage != "all" && arguments.stage != row.name) continue;
    document.stages.push_back(row.measure(effort));
    // After each stage, so that what took an hour is not lost by what comes after it.
    write_file_atomically(out / "bench.json", dump(bench::document_json(document)));
  }
  write_results(arguments, document, out);
  const std::vector<std::string> failed = bench::failed_cases(document);
  for (const std::string& sentence : failed) console.error(sentence);
  return failed.empty() ? exit_ok : exit_check_failed;
}

int run_program(int argc, char** argv) {
  CLI::App app{"Speed against error, stage by stage, on this machine.", "shakebed bench"};
  Arguments arguments;
  app.add_option("stage", arguments.stage, "all (the default), simulate, extract, fit, map, pipeline")
      ->check(CLI::IsMember({"all", "simulate", "extract", "fit", "map", "pipeline"}));
  app.add_flag("--quick", arguments.quick, "minutes instead of an hour: fewer repeats, smaller beds");
  app.add_option("--against", arguments.against, "an earlier bench.json to compare with")->type_name("FILE.json");
  app.add_option("--out", arguments.out, "folder for the results")->type_name("DIR");
  app.add_flag("--json", arguments.json, "machine-readable result on stdout, messages on stderr");
  app.add_flag("--quiet,-q", arguments.quiet, "warnings and errors only");
  app.add_flag("--verbose,-v", arguments.verbose, "details of each measurement");
  app.footer(
      "Examples:\n  shakebed bench --quick\n  shakebed bench simulate --out o\n  shakebed bench --json > now.json\n"
      "  shakebed bench --against now.json\n"
      "Exit codes: 0 ok, 2 usage, 4 input, 5 stage failed, 6 a hard case failed, 130 interrupted.");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error) == 0 ? exit_ok : exit_usage;  // --help
    throw UsageError(std::string(error.what()) + "; see --help");
  }
  return run_bench(arguments);
}

}  // namespace
}  // namespace shakebed::pipelines

int main(int argc, char** argv) {
  return shakebed::pipelines::exit_code_of([&] { return shakebed::pipelines::run_program(argc, argv); });
}
