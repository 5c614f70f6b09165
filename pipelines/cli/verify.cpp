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
    throw InputError(fmt::format("{}: is a file. Give the folder that --out named", out.string()));
  if (!std::filesystem::is_directory(out, error))
    throw InputError(fmt::format("{}: there is no such folder", out.string()));
  if (!std::filesystem::exists(out / "manifest.json", error))
    throw InputError(fmt::format(
        "{}: holds no manifest.json, so no run has ended here. Give the folder that --out named", out.string()));
  const VerifyResult result = verify_output(out);
  if (call.json) {
    print(dump(Json{{"files", result.files}, {"problems", result.problems}}));
  } else {
    for (const std::string& problem : result.problems) std::fputs(fmt::format("{}\n", problem).c_str(), stderr);
    print(result.problems.empty()
              ? fmt::format("{}: all {} files are as the manifest says\n", out.string(), result.files)
              : fmt::format("{}: {} of {} files are not as the manifest says\n", out.string(), result.problems.size(),
                            result.files));
  }
  return result.problems.empty() ? exit_ok : exit_check_failed;
}

}  // namespace

void add_verify(Program& program) {
  const auto folder = std::make_shared<std::string>();
  CLI::App& command =
      program.add({"verify", "recompute the fingerprints of a results folder", "  shakebed verify results/bed", false},
                  [folder](const Call& call) { return verify(call, *folder); });
  command.add_option("folder", *folder, "the results folder")->required()->type_name("DIR");
}

}  // namespace shakebed::pipelines
