// What the parts of the compiled module share.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace shakebed::python {

namespace py = pybind11;

// A one-dimensional array of doubles that owns its values.
inline py::array_t<double> array_of(std::vector<double> values) {
  auto* owned = new std::vector<double>(std::move(values));
  const py::capsule owner(owned, [](void* held) { delete static_cast<std::vector<double>*>(held); });
  return py::array_t<double>({static_cast<py::ssize_t>(owned->size())}, {sizeof(double)}, owned->data(), owner);
}

// An argument that makes no sense: shakebed.UsageError, which is a ValueError.
struct Mistake : std::runtime_error {
  using std::runtime_error::runtime_error;
};
inline void translate_mistakes() {
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const Mistake& mistake) {
      PyErr_SetString(py::module_::import("shakebed.errors").attr("UsageError").ptr(), mistake.what());
    }
  });
}

using OpenInterval = std::pair<std::optional<double>, std::optional<double>>;
template <class Value>
constexpr const char* kind_of = "a number";
template <>
inline constexpr const char* kind_of<bool> = "True or False";
template <>
inline constexpr const char* kind_of<unsigned> = "a whole number, 0 or more";
template <>
inline constexpr const char* kind_of<std::string> = "a string";
template <>
inline constexpr const char* kind_of<OpenInterval> = "a pair of numbers; None leaves an end open";
template <>
inline constexpr const char* kind_of<std::array<int, 4>> = "four whole numbers";

// The value of the option `name`, or a mistake that says what it must be.
template <class Value>
Value option_as(py::handle given, const char* name) {
  try {
    return given.cast<Value>();
  } catch (const py::cast_error&) {
    throw Mistake(std::string(name) + " is " + py::repr(given).cast<std::string>() + "; it must be " + kind_of<Value>);
  }
}

// Puts it into `target`.
template <class Value>
void take_option(py::handle given, const char* name, Value& target) {
  target = option_as<Value>(given, name);
}
template <class Value>
void take_option(py::handle given, const char* name, std::optional<Value>& target) {
  target = option_as<Value>(given, name);
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
