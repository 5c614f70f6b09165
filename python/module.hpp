// What the parts of the compiled module share.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace shakebed::python {

namespace py = pybind11;

// A one-dimensional array of doubles that owns its values.
inline py::array_t<double> array_of(std::vector<double> values) {
  auto* owned = new std::vector<double>(std::move(values));
  const py::capsule owner(owned, [](void* held) { delete static_cast<std::vector<double>*>(held); });
  return py::array_t<double>({static_cast<py::ssize_t>(owned->size())}, {sizeof(double)}, owned->data(), owner);
}

// Asked from a thread that does not hold the GIL: true once Ctrl-C was pressed or the caller's function raised. The
// exception that is then pending is raised by raise_if_stopped().
class Caller {
 public:
  explicit Caller(py::object progress) : progress_(std::move(progress)) {}
  bool stop() {
    const py::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) pending_ = std::make_unique<py::error_already_set>();
    return pending_ != nullptr;
  }
  void progress(double fraction) {
    if (progress_.is_none()) return;
    const py::gil_scoped_acquire gil;
    if (pending_) return;
    try {
      progress_(fraction);
    } catch (py::error_already_set& error) {
      pending_ = std::make_unique<py::error_already_set>(error);
    }
  }
  void raise_if_stopped() const {
    if (pending_) throw py::error_already_set(*pending_);
  }

 private:
  py::object progress_;
  std::unique_ptr<py::error_already_set> pending_;
};

}  // namespace shakebed::python
