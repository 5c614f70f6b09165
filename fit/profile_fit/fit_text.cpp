// implements: fit/profile_fit/fit_profile.hpp
// What a fit's options and result say of themselves.
#include <string>

#include "fit/profile_fit/fit_setup.hpp"
#include "fit/profile_fit/measured_profile.hpp"

namespace shakebed::fit {

namespace {

constexpr std::size_t name_width = 22;  // of full(), characters

std::string estimate_text(const Estimate& estimate) {
  return number(estimate.value, 5) + (estimate.fixed ? " (fixed)" : " +- " + number(estimate.std_error, 2));
}

void add_line(std::string& out, std::string_view name, const std::string& value) {
  out += name;
  out.append(name.size() < name_width ? name_width - name.size() : 1, ' ');
  out += value + "\n";
}

}  // namespace

std::vector<std::string> FitOptions::validate() const {
  FitResult result;
  if (check_options(*this, result) == FitStatus::ok) return {};
  return {result.message};
}

std::string FitResult::brief() const {
  if (!ok()) return std::string(to_string(status)) + ": " + message;
  const std::size_t said = warnings.size();
  return model + ": T = " + estimate_text(temperature) + " m g D, " +
         (has_solid() ? "solid height " + estimate_text(solid_height) + " D" : "no solid") +
         ", chi2/dof = " + number(chi2_per_dof, 3) + " (" + std::to_string(bins) + " heights" +
         (misfit ? "; the model does not fit" : "") +
         (said == 0 ? "" : "; " + std::to_string(said) + (said == 1 ? " warning" : " warnings")) + ")";
}

std::string FitResult::full() const {
  std::string out;
  add_line(out, "status", std::string(to_string(status)));
  if (!message.empty()) add_line(out, "message", message);
  if (!ok()) return out;
  add_line(out, "model", model);
  add_line(out, "temperature", estimate_text(temperature) + " m g D");
  if (temperature_interval.status == FitStatus::ok)
    add_line(out, "temperature interval",
             number(temperature_interval.low, 5) + " to " + number(temperature_interval.high, 5) + " m g D (" +
                 number(100 * temperature_interval.confidence, 3) + " %)");
  add_line(out, "shift", estimate_text(shift) + " D");
  add_line(out, "solid height", has_solid() ? estimate_text(solid_height) + " D" : "none");
  add_line(out, "plateau density", estimate_text(plateau_density) + " 1/D^2");
  add_line(out, "column number", estimate_text(column_number));
  if (critical_status == ValueStatus::ok) {
    add_line(out, "critical temperature", estimate_text(critical_temperature) + " m g D");
    add_line(out, "T/T_c", estimate_text(reduced_temperature));
  }
  add_line(
      out, "chi2/dof",
      number(chi2_per_dof, 3) + " (" + std::to_string(dof) + " degrees of freedom, p = " + number(p_value, 2) + ")");
  add_line(out, "window",
           number(window_low, 4) + " to " + number(window_high, 4) + " D, " + std::to_string(bins) +
               " heights: " + window_rule);
  add_line(out, "kernel", to_string(kernel));
  for (const std::string& warning : warnings) add_line(out, "warning", warning);
  return out;
}

}  // namespace shakebed::fit
