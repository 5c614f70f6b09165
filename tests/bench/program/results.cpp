#include "tests/bench/program/results.hpp"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <limits>

#include "pipelines/formats/errors.hpp"
#include "pipelines/runner/run.hpp"

namespace shakebed::pipelines::bench {

void Effort::check_interrupted() const {
  if (interrupt_requested()) throw Interrupted();
}

void Effort::step(const std::string& what) const {
  check_interrupted();
  if (console != nullptr) console->message("bench: " + what);
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double least_cpu_seconds(const std::function<void()>& work, double least_total) {
  work();  // tables are built and pages touched at the first use
  double least = std::numeric_limits<double>::infinity(), total = 0;
  // So many calls at a time that the clock's own cost does not count.
  int calls = 1;
  while (total < least_total) {
    const double start = cpu_seconds();
    for (int i = 0; i < calls; ++i) work();
    const double took = cpu_seconds() - start;
    total += took;
    if (took < 2e-4) {
      calls *= 4;
      continue;
    }
    least = std::min(least, took / calls);
  }
  return least;
}

namespace {
// A line "VmHWM:   1234 kB" of /proc/self/status, in bytes.
std::optional<double> status_bytes(const std::string& key) {
  std::ifstream stream("/proc/self/status");
  std::string line;
  while (std::getline(stream, line)) {
    if (line.starts_with(key)) return 1024 * std::strtod(line.c_str() + key.size(), nullptr);
  }
  return std::nullopt;
}
}  // namespace

std::optional<double> peak_memory_of(const std::function<void()>& work) {
  ::malloc_trim(0);
  std::ofstream reset("/proc/self/clear_refs");
  reset << "5";  // the high-water mark starts anew
  const bool known = static_cast<bool>(reset.flush());
  const auto before = status_bytes("VmRSS:");
  work();
  const auto peak = status_bytes("VmHWM:");
  if (!known || !before || !peak) return std::nullopt;
  return std::max(0.0, *peak - *before);
}

std::optional<double> exponent(const std::vector<double>& x, const std::vector<double>& y) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (!(x[i] > 0) || !(y[i] > 0)) continue;
    const double u = std::log(x[i]), v = std::log(y[i]);
    n += 1, sx += u, sy += v, sxx += u * u, sxy += u * v;
  }
  const double spread = n * sxx - sx * sx;
  if (n < 2 || !(spread > 0)) return std::nullopt;
  return (n * sxy - sx * sy) / spread;
}

HardCase run_hard_case(const std::string& name, const std::string& unit, double limit, double time_limit,
                       const std::function<void(HardCase&)>& work) {
  HardCase result;
  result.name = name, result.unit = unit, result.limit = limit, result.time_limit = time_limit;
  result.pass = true;
  const double start = cpu_seconds();
  try {
    work(result);
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    result.status = "failed", result.note = error.what(), result.pass = false;
  }
  result.seconds = cpu_seconds() - start;
  if (result.status.empty()) result.status = "ok";
  if (result.error && !(*result.error <= limit)) result.pass = false;
  if (result.seconds > time_limit) {
    result.pass = false;
    result.note += fmt::format("{}took longer than {:g} s", result.note.empty() ? "" : "; ", time_limit);
  }
  return result;
}

}  // namespace shakebed::pipelines::bench
