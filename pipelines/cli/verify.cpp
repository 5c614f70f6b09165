// implements: pipelines/cli/commands.hpp
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>

#include "pipelines/cli/arguments.hpp"
#include "pipelines/cli/commands.hpp"
#include "pipelines/cli/program.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/manifest.hpp"

namespace shakebed::pipelines {
namespace {

int verify(const Call& call, const std::filesystem::path& out) {
  std::error_code error;
  if (std::filesystem::is_regular_file(out, error))
    throw InputError(
        fmt::format("{}: this is a file. Give the results folder (the one that --out named)", out.string()));
  if (!std::filesystem::is_directory(out, error))
    throw InputError(fmt::format("{}: there is no such folder", out.string()));
  if (!std::filesystem::exists(out / "manifest.json", error))
    throw InputError(
        fmt::format("{}: this folder contains no manifest.json, so no run has ended in it. Give the results folder "
                    "(the one that --out named)",
                    out.string()));
  const VerifyResult result = verify_output(out);
  if (call.json) {
    print(dump(Json{{"files", result.files}, {"problems", result.problems}}));
  } else {
    for (const std::string& problem : result.problems) std::fputs(fmt::format("{}\n", problem).c_str(), stderr);
    print(result.problems.empty()
              ? fmt::format("{}: all {} files agree with the manifest\n", out.string(), result.files)
              : fmt::format("{}: {} of {} files differ from the manifest\n", out.string(), result.problems.size(),
                            result.files));
  }
  return result.problems.empty() ? exit_ok : exit_check_failed;
}

}  // namespace

void add_verify(Program& program) {
  const auto folder = std::make_shared<std::string>();
  CLI::App& command = program.add({"verify", "check the files of a results folder against their recorded fingerprints",
                                   "  shakebed verify results/bed", false},
                                  [folder](const Call& call) { return verify(call, *folder); });
  command.add_option("folder", *folder, "results folder of a run or sweep")->required()->type_name("DIR");
}

}  // namespace shakebed::pipelines
