// What a call from Python costs beyond the same call in C++. Both are made in turn in one process on the same input;
// the processor time of each pair gives a ratio, and the median over the pairs is printed with its quartiles.
//
//   python_boundary FOLDER_OF_THE_MODULE [PAIRS]
#include <pybind11/embed.h>
#include <pybind11/numpy.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "ingest/profile/photographs.hpp"
#include "ingest/synthetic/synthetic_frames.hpp"

namespace py = pybind11;

namespace {

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double seconds_of(const std::function<void()>& work) {
  const double before = cpu_seconds();
  work();
  return cpu_seconds() - before;
}

void compare(const char* name, std::size_t pairs, const std::function<void()>& cpp,
             const std::function<void()>& python) {
  cpp(), python();  // what is made once
  std::vector<double> ratios, times;
  for (std::size_t k = 0; k < pairs; ++k) {
    const bool python_first = k % 2 == 1;
    const double first = seconds_of(python_first ? python : cpp), second = seconds_of(python_first ? cpp : python);
    ratios.push_back(python_first ? first / second : second / first);
    times.push_back(python_first ? second : first);
  }
  std::sort(ratios.begin(), ratios.end());
  std::sort(times.begin(), times.end());
  std::printf("%-28s %8.3f ms in C++; from Python %+.2f %% (quartiles %+.2f to %+.2f %%), %zu pairs\n", name,
              1e3 * times[pairs / 2], 100 * (ratios[pairs / 2] - 1), 100 * (ratios[pairs / 4] - 1),
              100 * (ratios[3 * pairs / 4] - 1), pairs);
}

template <class Level>
void compare_find_disks(const char* name, const shakebed::ingest::GrayFrame& frame, shakebed::ingest::PixelType type,
                        std::size_t pairs, const py::object& module) {
  const std::vector<Level> levels(frame.pixels.begin(), frame.pixels.end());
  const py::array_t<Level> array({frame.height, frame.width}, levels.data());
  const shakebed::ingest::ImageView view{
      .width = frame.width, .height = frame.height, .pixels = levels.data(), .type = type};
  compare(
      name, pairs, [&] { shakebed::ingest::find_disks(view); }, [&] { module.attr("find_disks")(array); });
}

void compare_fits(std::size_t pairs, const py::object& module) {
  namespace fit = shakebed::fit;
  const auto truth = fit::HydrostaticProfile::of_column(fit::enskog(), 0.5, fit::column_from_initial_height(10.2, 1.1));
  fit::Profile profile;
  for (int k = 0; k < 80; ++k) {
    profile.height.push_back(0.25 * k);
    profile.number_density.push_back(truth.density(0.25 * k) * (1 + 0.01 * std::sin(7.0 * k)));
    profile.std_error.push_back(0.01);
  }
  const auto array = [](const std::vector<double>& values) {
    return py::array_t<double>(static_cast<py::ssize_t>(values.size()), values.data());
  };
  const py::array_t<double> height = array(profile.height), density = array(profile.number_density),
                            error = array(profile.std_error);
  compare(
      "fit_profile", pairs, [&] { fit::fit_profile(profile); },
      [&] { module.attr("fit_profile")(height, density, error); });
  const fit::FitOptions quick{.sweep = false, .compare = false};
  const auto python = [&] {
    module.attr("fit_profile")(height, density, error, py::arg("sweep") = false, py::arg("compare") = false);
  };
  compare(
      "fit_profile, the fit alone", 20 * pairs, [&] { fit::fit_profile(profile, quick); }, python);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::fprintf(stderr, "usage: python_boundary FOLDER_OF_THE_MODULE [PAIRS]\n");
    return 2;
  }
  const std::size_t pairs = count > 2 ? std::strtoul(arguments[2], nullptr, 10) : 31;
  const py::scoped_interpreter interpreter;
  py::module_::import("sys").attr("path").attr("insert")(0, arguments[1]);
  const py::object module = py::module_::import("shakebed");

  namespace ingest = shakebed::ingest;
  const auto disks = ingest::make_synthetic_bed(
      {.left_wall_px = 20, .right_wall_px = 620, .floor_px = 500, .radius_px = 10, .rows = 12});
  ingest::GrayFrame frame = ingest::render_frame(disks, {.width = 640, .height = 520, .blur_px = 0.8, .read_noise = 5});
  for (float& level : frame.pixels) level = std::round(std::clamp(level, 0.0F, 255.0F));
  compare_fits(pairs, module);
  compare_find_disks<std::uint8_t>("find_disks, 8 bits", frame, ingest::PixelType::u8, pairs, module);
  compare_find_disks<float>("find_disks, float", frame, ingest::PixelType::f32, pairs, module);
}
