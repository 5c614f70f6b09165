// The compiled half of the Python module that touches images: it alone loads OpenCV, when it is first used.
#include <array>
#include <atomic>
#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>

#include "ingest/frames/stop_question.hpp"
#include "ingest/profile/photographs.hpp"
#include "python/module.hpp"

namespace shakebed::python {

namespace {

constexpr std::chrono::milliseconds time_between_questions{50};

ingest::Polarity polarity_named(const std::string& name) {
  if (name == "automatic") return ingest::Polarity::automatic;
  if (name == "dark") return ingest::Polarity::dark_beads;
  if (name == "bright") return ingest::Polarity::bright_beads;
  throw Mistake("polarity is \"" + name + "\"; it must be automatic, dark or bright");
}

// A view of a grey numpy image (rows x columns). What cannot be viewed is refused.
ingest::ImageView view_of(const py::array& image) {
  if (image.ndim() != 2)
    throw Mistake("the image has " + std::to_string(image.ndim()) +
                  " dimensions; pass a grey image (rows x columns), or one channel of a colour image");
  if (image.size() == 0) throw Mistake("the image is empty");
  if (py::hasattr(image, "mask")) throw Mistake("the image is a masked array; pass image.filled(level), or image.data");
  ingest::ImageView view;
  view.height = static_cast<int>(image.shape(0));
  view.width = static_cast<int>(image.shape(1));
  view.pixels = image.data();
  if (py::isinstance<py::array_t<std::uint8_t>>(image))
    view.type = ingest::PixelType::u8;
  else if (py::isinstance<py::array_t<std::uint16_t>>(image))
    view.type = ingest::PixelType::u16;
  else if (py::isinstance<py::array_t<float>>(image))
    view.type = ingest::PixelType::f32;
  else if (py::isinstance<py::array_t<double>>(image))
    view.type = ingest::PixelType::f64;
  else
    throw Mistake("levels must be uint8, uint16, float32 or float64");
  if (view.width > 1 && image.strides(1) != image.itemsize())
    throw Mistake("the pixels of a row are not side by side in memory: pass numpy.ascontiguousarray(image)");
  if (view.height > 1 && image.strides(0) < 0)
    throw Mistake("the rows are in reverse order in memory: pass numpy.ascontiguousarray(image)");
  view.row_bytes = static_cast<std::size_t>(view.height > 1 ? image.strides(0) : 0);
  return view;
}

// Fills what the key names; `key` is what the caller gave, its value is not None.
void take_find_option(const std::string& key, py::handle value, ingest::FindOptions& out) {
  if (key == "polarity") out.polarity = polarity_named(option_as<std::string>(value, "polarity"));
  if (key == "radius") take_option(value, "radius", out.radius_px);
  if (key == "keep_half_hidden") take_option(value, "keep_half_hidden", out.keep_half_hidden);
  if (key == "roi") {
    const auto roi = option_as<std::array<int, 4>>(value, "roi");
    out.roi = ingest::PixelRectangle{roi[0], roi[1], roi[2], roi[3]};
  }
}

ingest::FindOptions find_options(const py::dict& wanted) {
  ingest::FindOptions out;
  for (const auto& [key, value] : wanted) take_find_option(key.cast<std::string>(), value, out);
  return out;
}

void take_measure_option(const std::string& key, py::handle value, ingest::MeasureOptions& out) {
  const auto take = [&](const char* name, auto& target) {
    if (key == name) take_option(value, name, target);
  };
  take_find_option(key, value, out.find);
  take("diameter", out.bead_diameter_m);
  take("scale", out.scale_m_per_px);
  take("floor", out.floor_px);
  take("floor_slope", out.floor_slope);
  take("floor_amplitude", out.floor_amplitude_m);
  take("left_wall", out.left_wall_px);
  take("right_wall", out.right_wall_px);
  take("pixel_aspect", out.pixel_aspect);
  take("lens_radial", out.lens_radial);
  take("spacing", out.bin_width);
  take("lowest", out.lowest);
  take("highest", out.highest);
  take("frame_rate", out.frame_rate_hz);
  take("frequency", out.shaking_frequency_hz);
  take("threads", out.threads);
  if (key == "kernel") {
    const auto text = option_as<std::string>(value, "kernel");
    const auto kernel = kernel_from(text);
    if (!kernel)
      throw Mistake("there is no kernel \"" + text + "\"; write gaussian:0.5, top_hat:1 or disk_chord:1 (widths in D)");
    out.kernel = *kernel;
  }
}

ingest::MeasureOptions measure_options(const py::dict& wanted) {
  ingest::MeasureOptions out;
  for (const auto& [key, value] : wanted) take_measure_option(key.cast<std::string>(), value, out);
  return out;
}

// One array a member of a list of structures.
template <class Row, class Member>
py::array_t<double> column(const std::vector<Row>& rows, Member member) {
  std::vector<double> values;
  values.reserve(rows.size());
  for (const Row& row : rows) values.push_back(static_cast<double>(row.*member));
  return array_of(std::move(values));
}

py::dict disks_of(const ingest::DisksFound& found) {
  using Disk = ingest::FoundDisk;
  py::dict out;
  out["x"] = column(found.disks, &Disk::x_px);
  out["y"] = column(found.disks, &Disk::y_px);
  out["variance_x"] = column(found.disks, &Disk::variance_x);
  out["variance_y"] = column(found.disks, &Disk::variance_y);
  out["quality"] = column(found.disks, &Disk::quality);
  out["contrast"] = column(found.disks, &Disk::contrast);
  out["probability"] = column(found.disks, &Disk::probability);
  return out;
}

py::dict profile_of(const ingest::DensityProfile& profile) {
  std::vector<double> heights;
  for (std::size_t bin = 0; bin < profile.bins.count; ++bin) heights.push_back(profile.bins.middle(bin));
  py::dict out;
  out["height"] = array_of(std::move(heights));
  out["number_density"] = array_of(profile.number_density);
  out["std_error"] = array_of(profile.std_error);
  out["covariance"] = profile.covariance;
  out["covariance_samples"] = profile.independent_samples;
  out["samples"] = profile.samples;
  out["kernel"] = to_string(profile.kernel);
  return out;
}

py::dict table_of(const std::vector<ingest::MeasuredDisk>& disks) {
  using Disk = ingest::MeasuredDisk;
  py::dict out;
  out["frame"] = column(disks, &Disk::frame);
  out["x_px"] = column(disks, &Disk::x_px);
  out["y_px"] = column(disks, &Disk::y_px);
  out["radius_px"] = column(disks, &Disk::radius_px);
  out["x"] = column(disks, &Disk::x);
  out["z"] = column(disks, &Disk::z);
  out["quality"] = column(disks, &Disk::quality);
  return out;
}

// Runs `work` on a thread of its own while this one waits: signals and the caller's progress function belong to the
// thread that called. Ctrl-C and exceptions of that function end the work within half a second. `done`: share of the
// work.
struct Stopped : std::exception {};
template <class Work>
auto stoppable(const Work& work, py::object progress, const std::atomic<double>& done) {
  std::atomic<bool> stop{false};
  Caller caller(std::move(progress));
  const auto under_question = [&] {
    const ingest::StopQuestion question([&] {
      if (stop) throw Stopped();
    });
    return work();
  };
  decltype(work()) found;
  {
    const py::gil_scoped_release release;
    auto future = std::async(std::launch::async, under_question);
    double shown = 0;
    const auto show = [&] {
      if (const double now = done; now != shown) caller.progress(shown = now);
    };
    while (future.wait_for(time_between_questions) != std::future_status::ready) {
      show();
      if (caller.stop()) stop = true;
    }
    try {
      found = future.get();
      show();
    } catch (const Stopped&) {}
  }
  caller.raise_if_stopped();
  return found;
}

ingest::BedFound measured(const std::function<ingest::BedFound(const ingest::MeasureOptions&)>& work,
                          const py::dict& wanted, py::object progress, std::size_t frames) {
  ingest::MeasureOptions options = measure_options(wanted);
  std::atomic<double> share{0};
  options.progress = [&](std::size_t done) {
    if (frames > 0) share = static_cast<double>(done) / static_cast<double>(frames);
    ingest::StopQuestion::ask();
  };
  return stoppable([&] { return work(options); }, std::move(progress), share);
}

// The arrays are read where they lie; `images` keeps them alive.
ingest::BedFound measure_arrays(const std::vector<py::array>& images, const py::dict& wanted, py::object progress) {
  std::vector<ingest::ImageView> frames;
  for (const py::array& image : images) frames.push_back(view_of(image));
  return measured([&](const ingest::MeasureOptions& options) { return ingest::measure_bed(frames, options); }, wanted,
                  std::move(progress), frames.size());
}

ingest::BedFound measure_files(const std::vector<std::string>& paths, const py::dict& wanted, py::object progress) {
  const std::size_t count = ingest::FrameSource::open(paths).count_if_known().value_or(0);
  return measured([&](const ingest::MeasureOptions& options) { return ingest::measure_bed(paths, options); }, wanted,
                  std::move(progress), count);
}

// errors.py holds the exceptions; a file that cannot be read is an InputError there, too.
void translate_errors() {
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const ingest::InputError& error) {
      const py::object raised = py::module_::import("shakebed.errors").attr("input_error")(error.what(), error.path());
      PyErr_SetObject(py::type::of(raised).ptr(), raised.ptr());
    }
  });
}

}  // namespace

}  // namespace shakebed::python

PYBIND11_MODULE(_images, m) {
  using namespace shakebed::python;
  namespace ingest = shakebed::ingest;
  translate_errors();
  translate_mistakes();
  py::class_<ingest::DisksFound>(m, "Disks")
      .def_property_readonly("status", [](const ingest::DisksFound& f) { return std::string(to_string(f.status)); })
      .def_property_readonly("ok", [](const ingest::DisksFound& f) { return f.ok(); })
      .def_property_readonly("message", [](const ingest::DisksFound& f) { return f.message; })
      .def_property_readonly("radius", [](const ingest::DisksFound& f) { return f.calibration.radius_px; })
      .def_property_readonly("radius_std_error",
                             [](const ingest::DisksFound& f) { return f.calibration.radius_std_error_px; })
      .def_property_readonly(
          "bright",
          [](const ingest::DisksFound& f) { return f.calibration.polarity == ingest::Polarity::bright_beads; })
      .def_property_readonly("expected_wrong", [](const ingest::DisksFound& f) { return f.expected_wrong; })
      .def_property_readonly("warnings", [](const ingest::DisksFound& f) { return f.calibration.warnings; })
      .def("columns", &disks_of)
      .def("brief", &ingest::DisksFound::brief)
      .def("full", &ingest::DisksFound::full);
  m.def("find_disks", [](const py::array& image, const py::dict& options) {
    const ingest::ImageView view = view_of(image);
    const ingest::FindOptions wanted = find_options(options);
    const std::atomic<double> nothing_shown{0};
    return stoppable([&] { return ingest::find_disks(view, wanted); }, py::none(), nothing_shown);
  });
  py::class_<ingest::BedFound>(m, "Bed")
      .def_property_readonly("status", [](const ingest::BedFound& f) { return std::string(to_string(f.status)); })
      .def_property_readonly("ok", [](const ingest::BedFound& f) { return f.ok(); })
      .def_property_readonly("message", [](const ingest::BedFound& f) { return f.message; })
      .def_property_readonly("width", [](const ingest::BedFound& f) { return f.measurement.calibration.width; })
      .def_property_readonly(
          "scale_error", [](const ingest::BedFound& f) { return f.measurement.calibration.scale_relative_std_error; })
      .def_property_readonly("scale",
                             [](const ingest::BedFound& f) { return f.measurement.calibration.scale_m_per_px; })
      .def_property_readonly("radius", [](const ingest::BedFound& f) { return f.measurement.calibration.radius_px; })
      .def_property_readonly("floor", [](const ingest::BedFound& f) { return f.measurement.calibration.floor_px; })
      .def_property_readonly("shaken", [](const ingest::BedFound& f) { return ingest::is_shaken(f.measurement); })
      .def_property_readonly("walls_seen",
                             [](const ingest::BedFound& f) { return !f.measurement.calibration.walls_are_frame_sides; })
      .def_property_readonly("column_number", [](const ingest::BedFound& f) { return f.measurement.column_number(); })
      .def_property_readonly("floor_std_error",
                             [](const ingest::BedFound& f) { return f.measurement.calibration.floor_std_error_px; })
      .def_property_readonly(
          "floor_reference",
          [](const ingest::BedFound& f) { return std::string(to_string(f.measurement.calibration.floor_reference)); })
      .def_property_readonly("frames", [](const ingest::BedFound& f) { return f.measurement.frames.size(); })
      .def_property_readonly("disks_a_frame", [](const ingest::BedFound& f) { return f.measurement.disk_count_mean; })
      .def_property_readonly("warnings", [](const ingest::BedFound& f) { return f.measurement.warnings; })
      .def("objections",
           [](const ingest::BedFound& f) {
             std::vector<std::pair<std::string, std::string>> all;
             for (const ingest::Objection& one : ingest::objections_to(f.measurement))
               all.emplace_back(one.why, one.advice);
             return all;
           })
      .def("profile", [](const ingest::BedFound& f) { return profile_of(f.measurement.profile); })
      .def("disks", [](const ingest::BedFound& f) { return table_of(f.measurement.disks); })
      .def("brief", &ingest::BedFound::brief)
      .def("full", &ingest::BedFound::full);
  m.def("measure_arrays", &measure_arrays);
  m.def("measure_files", &measure_files);
}
