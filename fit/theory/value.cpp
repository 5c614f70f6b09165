#include "fit/theory/value.hpp"

namespace shakebed::fit {

std::string_view to_string(ValueStatus status) {
  switch (status) {
    case ValueStatus::ok:
      return "ok";
    case ValueStatus::pole:
      return "undefined (pole)";
    case ValueStatus::outside_range:
      return "outside range";
    case ValueStatus::invalid_argument:
      return "invalid argument";
    case ValueStatus::not_converged:
      return "not converged";
  }
  return "unknown";
}

}  // namespace shakebed::fit
