#pragma once

#include <string_view>

// A number that may not exist. Poles, ranges and failed iterations are ordinary answers in this room: they come back
// as a status beside the number, never as an exception, a NaN or a silent value.
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

enum class ValueStatus {
  ok,                // the number is good
  pole,              // the formula diverges here (close packing, for most equations of state)
  outside_range,     // the formula has a number here, but not one that means anything
  invalid_argument,  // not a finite or not a positive argument
  not_converged,     // an iteration gave up
};

// `value` may be read only when ok(); it is 0 otherwise.
struct Value {
  double value = 0.0;
  ValueStatus status = ValueStatus::ok;
  [[nodiscard]] constexpr bool ok() const { return status == ValueStatus::ok; }
};

constexpr Value no_value(ValueStatus status) { return {0.0, status}; }

// "ok", "undefined (pole)", "outside range", "invalid argument", "not converged".
std::string_view to_string(ValueStatus status);

}  // namespace shakebed::fit
