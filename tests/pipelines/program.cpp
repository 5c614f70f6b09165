#include "tests/pipelines/program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>

extern char** environ;

namespace shakebed::tests {

namespace fs = std::filesystem;

namespace {
int spawn(const std::vector<std::string>& arguments, const fs::path& directory, const fs::path& out,
          const fs::path& err) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 1, out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addopen(&actions, 2, err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
  std::vector<std::string> all{SHAKEBED_PROGRAM};
  all.insert(all.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  argv.reserve(all.size() + 1);
  for (std::string& argument : all) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t child = 0;
  const int error = posix_spawn(&child, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("the program cannot be started");
  return child;
}
}  // namespace

fs::path program_file() { return SHAKEBED_PROGRAM; }

int wait_for(int process) {
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) {}
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

int start_shakebed(const std::vector<std::string>& arguments, const fs::path& directory, const fs::path& err) {
  return spawn(arguments, directory, "/dev/null", err);
}

ProgramResult run_shakebed(const std::vector<std::string>& arguments, const fs::path& directory) {
  ScratchFolder scratch;
  const auto start = std::chrono::steady_clock::now();
  ProgramResult result;
  const int process = spawn(arguments, directory, scratch / "out", scratch / "err");
  int status = 0;
  rusage usage{};
  while (::wait4(process, &status, 0, &usage) < 0 && errno == EINTR) {}
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  result.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  result.peak_kilobytes = usage.ru_maxrss;
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.out = read_text(scratch / "out");
  result.err = read_text(scratch / "err");
  return result;
}

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "shakebed-test-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = name;
}
ScratchFolder::~ScratchFolder() {
  std::error_code error;
  fs::remove_all(path_, error);
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream stream(path, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + path.string());
}

std::string read_text(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string small_recipe(const std::string& sweep) {
  return R"({
  "name": "small",
  "stages": [
    { "stage": "simulate", "id": "bed", "seed": 7, "replicas": 1,
      "disks": { "count": 40, "diameter": "3 mm", "restitution": 0.9 },
      "gravity": "9.81 m/s^2",
      "box": { "width": "30 mm", "sides": { "kind": "hard", "restitution": 0.9 } },
      "floor": { "motion": "sinusoidal", "amplitude": "1.5 mm", "frequency": "20 Hz", "restitution": 0.9 },
      "settle": "0.2 s", "measure": "0.5 s", "frames": { "count": 8, "phases": 8 } },
    { "stage": "fit", "from": "bed", "plateau_density": 1.1 },
    { "stage": "check", "from": ["bed", "fit"],
      "expect": { "/bed/column_number": { "value": 4, "relative": 1e-12 } } }
  ])" + (sweep.empty() ? std::string() : ",\n  \"sweep\": " + sweep) +
         "\n}\n";
}

}  // namespace shakebed::tests
