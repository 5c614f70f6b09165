// The command: which stages are measured, and where the results go.
#include <fmt/format.h>

#include <filesystem>

#include "pipelines/bench/document.hpp"
#include "pipelines/commands.hpp"
#include "pipelines/embedded.hpp"
#include "pipelines/files.hpp"
#include "pipelines/manifest.hpp"
#include "pipelines/run.hpp"

namespace shakebed::pipelines {

namespace fs = std::filesystem;

int command_bench(const Arguments& arguments) {
  struct Row {
    std::string_view name;
    bench::StageResult (*measure)(const bench::Effort&);
  };
  constexpr Row rows[] = {{"simulate", bench::bench_simulate},
                          {"extract", bench::bench_extract},
                          {"fit", bench::bench_fit},
                          {"map", bench::bench_map},
                          {"pipeline", bench::bench_pipeline}};
  const std::string wanted = arguments.bench.stage.empty() ? "all" : arguments.bench.stage;
  bench::Document document;
  document.quick = arguments.bench.quick;
  if (arguments.bench.against) {
    document.against = read_json(*arguments.bench.against), document.against_name = *arguments.bench.against;
    bench::comparison({}, document.against, document.against_name);  // its mistakes now rather than after the work
  }
  if (const EmbeddedFile* digits = find_embedded("bench/digits.json"); digits != nullptr)
    document.digits = Json::parse(digits->text);
  const fs::path out = arguments.common.out ? fs::path(*arguments.common.out) : fs::path("results") / "bench";
  std::error_code error;
  fs::create_directories(out, error);
  if (error) throw StageError(fmt::format("--out {}: cannot be made: {}", out.string(), error.message()));
  const FolderLock lock(out);
  install_interrupt_handler();
  Console console(arguments.common.quiet     ? Console::Level::quiet
                  : arguments.common.verbose ? Console::Level::verbose
                                             : Console::Level::normal);
  bench::Effort effort{.quick = document.quick, .scratch = (out / "scratch").string(), .console = &console};
  struct Scratch {
    fs::path path;
    ~Scratch() {
      std::error_code ignored;
      fs::remove_all(path, ignored);
    }
  } const scratch{effort.scratch};
  fs::create_directories(scratch.path);
  document.machine = bench::machine_json();
  document.when = utc_now();
  for (const Row& row : rows) {
    if (wanted != "all" && wanted != row.name) continue;
    document.stages.push_back(row.measure(effort));
    // After each stage, so that what took an hour is not lost by what comes after it.
    write_file_atomically(out / "bench.json", dump(bench::document_json(document)));
  }
  const std::string page = bench::document_html(document, out);
  const Json json = bench::document_json(document);
  write_file_atomically(out / "bench.html", page);
  const std::string text =
      arguments.common.json
          ? dump(json)
          : bench::document_text(document) + fmt::format("\nresults: {}\nreport:  {}\n", (out / "bench.json").string(),
                                                         (out / "bench.html").string());
  if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
    throw StageError("stdout cannot be written");
  int failed = 0;
  for (const bench::StageResult& stage : document.stages) {
    for (const bench::HardCase& one : stage.hard_cases) {
      if (one.pass) continue;
      ++failed;
      console.error(fmt::format("hard case failed: {}: {}: {}", stage.name, one.name, one.note));
    }
  }
  return failed == 0 ? exit_ok : exit_check_failed;
}

}  // namespace shakebed::pipelines
