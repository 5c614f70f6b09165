// The shakebed program as users start it, for tests.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace shakebed::tests {

struct ProgramResult {
  int exit_code = -1;  // 128 + signal when killed by one
  std::string out, err;
  double seconds = 0;       // wall
  double cpu_seconds = 0;   // user and system
  long peak_kilobytes = 0;  // of resident memory
};
// Runs it in `directory` with these arguments.
ProgramResult run_shakebed(const std::vector<std::string>& arguments, const std::filesystem::path& directory);
// Its file.
std::filesystem::path program_file();
// Starts it and returns its process id; what it says on standard error goes into a file.
int start_shakebed(const std::vector<std::string>& arguments, const std::filesystem::path& directory,
                   const std::filesystem::path& err = "/dev/null");
// Waits for it; the exit code, 128 + signal when killed by one.
int wait_for(int process);

// A folder of its own for a test, removed at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

void write_text(const std::filesystem::path& path, const std::string& text);
std::string read_text(const std::filesystem::path& path);

// A recipe without images that runs in a few ms: a small shaken bed, a fit, a check. `sweep` is put in as it is.
std::string small_recipe(const std::string& sweep = "");

}  // namespace shakebed::tests
