#include "pipelines/stages/theory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/audit/audit.hpp"
#include "fit/theory/expansion.hpp"
#include "pipelines/formats/config.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {

namespace {
// Largest relative misfit (rms inside the window over the greatest density there) at which a model is said to describe
// a profile: a convention of this program, not a test of significance.
constexpr double tolerable_misfit = 0.05;
}  // namespace

const fit::EquationOfState& equation_named(const std::string& name) {
  if (const fit::EquationOfState* found = fit::find_equation_of_state(name)) return *found;
  std::vector<std::string> names;
  for (const fit::EquationOfState* row : fit::equations_of_state()) names.emplace_back(row->name());
  const std::string nearest = nearest_name(name, names);
  throw UsageError(fmt::format("there is no equation of state \"{}\"; {}", name,
                               nearest.empty() ? fmt::format("choose from: {}", fmt::join(names, ", "))
                                               : fmt::format("did you mean \"{}\"?", nearest)));
}

Json theory_json(const TheoryQuestion& question) {
  if (question.equation == "all") {
    Json rows = Json::array();
    TheoryQuestion one = question;
    for (const fit::EquationOfState* row : fit::equations_of_state()) {
      one.equation = row->name();
      rows.push_back(theory_json(one));
    }
    return rows;
  }
  const fit::EquationOfState& equation = equation_named(question.equation);
  const fit::ExpansionConstants constants = fit::expansion_constants(equation, question.plateau_density);
  Json out, status = Json::object(), units = Json::object();
  const auto put = [&](const char* name, double value, fit::ValueStatus state, const char* unit) {
    out[name] = state == fit::ValueStatus::ok ? Json(value) : Json(nullptr);
    if (state != fit::ValueStatus::ok) status[name] = fit::to_string(state);
    units[name] = unit;
  };
  out["equation_of_state"] = equation.name();
  put("plateau_density", question.plateau_density, fit::ValueStatus::ok, "1/D^2");
  put("mu_0", constants.mu_0, constants.status, "1");
  put("lambda_1", constants.lambda_1, constants.status, "1");
  put("k", constants.k, constants.status, "1");
  put("f_plateau", constants.f_plateau, constants.status, "1");
  put("contact_value", constants.contact_value, constants.status, "1");
  if (question.diameter) put("diameter", *question.diameter, fit::ValueStatus::ok, "m");
  if (question.initial_height) {
    const fit::Column column = fit::column_from_initial_height(*question.initial_height, question.plateau_density);
    put("initial_height", *question.initial_height, fit::ValueStatus::ok, "D");
    put("column_number", column.column_number, fit::ValueStatus::ok, "1");
    const fit::Value critical = fit::critical_temperature(equation, column);
    put("critical_temperature", critical.value, critical.status, "m g D");
    if (question.diameter)
      put("critical_temperature_over_mg", critical.value * *question.diameter, critical.status, "m");
    if (question.temperature) {
      put("temperature", *question.temperature, fit::ValueStatus::ok, "m g D");
      if (question.diameter)
        put("temperature_over_mg", *question.temperature * *question.diameter, fit::ValueStatus::ok, "m");
      put("reduced_temperature", critical.ok() ? *question.temperature / critical.value : 0, critical.status, "1");
      const fit::Value solid = fit::solid_height(equation, column, *question.temperature);
      put("solid_height", solid.value, solid.status, "D");
      const fit::Value rise = fit::center_of_mass_rise(equation, column, *question.temperature);
      put("center_of_mass_rise", rise.value, rise.status, "D");
    }
  }
  out["status"] = std::move(status);
  out["units"] = std::move(units);
  return out;
}

std::string theory_text(const TheoryQuestion& question) {
  const Json json = theory_json(question);
  std::string out;
  if (json.is_array()) {
    TheoryQuestion one = question;
    for (const Json& row : json) {
      one.equation = row["equation_of_state"].get<std::string>();
      out += (out.empty() ? "" : "\n") + one.equation + "\n" + theory_text(one);
    }
    return out;
  }
  for (const auto& [name, unit] : json["units"].items()) {
    const Json& value = json[name];
    const std::string text =
        value.is_null() ? json["status"][name].get<std::string>() : fmt::format("{:.12g}", value.get<double>());
    const std::string shown = unit == "1" || value.is_null() ? "" : unit.get<std::string>();
    out += fmt::format("{:<30} {:>18} {}\n", name, text, shown);
  }
  return out;
}

Json map_json(const MapQuestion& question) {
  const fit::EquationOfState& equation = equation_named(question.equation);
  fit::ShakenBed bed;
  bed.gamma = question.gamma;
  bed.acceleration_length = fit::acceleration_length(question.gravity, question.frequency, question.diameter);
  bed.column = fit::column_from_initial_height(question.initial_height, question.plateau_density);
  bed.restitution = question.restitution;
  Json out;
  out["gamma"] = quantity_json(question.gamma, "1", question.gamma_std_error);
  out["frequency"] = quantity_json(question.frequency, "Hz");
  out["diameter"] = quantity_json(question.diameter, "m");
  out["gravity"] = quantity_json(question.gravity, "m/s^2");
  out["initial_height"] = quantity_json(question.initial_height, "D");
  out["plateau_density"] = quantity_json(question.plateau_density, "1/D^2");
  out["equation_of_state"] = equation.name();
  const fit::Value critical = fit::critical_temperature(equation, bed.column);
  if (critical.ok()) out["critical_temperature"] = quantity_json(critical.value, "m g D");
  if (question.measured_temperature) {
    out["measured_temperature"] = quantity_json(*question.measured_temperature, "m g D", question.measured_std_error);
    if (critical.ok()) {
      out["measured_reduced_temperature"] = quantity_json(
          *question.measured_temperature / critical.value, "1",
          question.measured_std_error ? std::optional<double>(*question.measured_std_error / critical.value)
                                      : std::nullopt);
    }
  }
  std::vector<fit::GammaReading> back;
  if (question.measured_temperature) back = fit::gammas_from_temperature(*question.measured_temperature, bed, equation);
  out["readings"] = Json::array();
  for (const fit::Reading& reading : fit::temperatures_from_gamma(bed, equation)) {
    Json row;
    row["name"] = reading.name;
    row["jump_height"] = fit::to_string(reading.jump_height);
    row["expansion"] = fit::to_string(reading.expansion);
    row["constants"] = fit::to_string(reading.constants);
    row["status"] = fit::to_string(reading.status);
    const bool ok = reading.status == fit::ValueStatus::ok;
    row["jump"] = ok ? quantity_json(reading.jump, "D") : Json(nullptr);
    row["rise"] = ok ? quantity_json(reading.rise, "D") : Json(nullptr);
    row["temperature"] = ok ? quantity_json(reading.temperature, "m g D") : Json(nullptr);
    row["temperature_over_mg"] = ok ? quantity_json(reading.temperature * question.diameter, "m") : Json(nullptr);
    row["reduced_temperature"] = ok ? quantity_json(reading.reduced_temperature, "1") : Json(nullptr);
    row["in_range"] = reading.in_range;
    const auto gamma =
        std::find_if(back.begin(), back.end(), [&](const fit::GammaReading& g) { return g.name == reading.name; });
    if (gamma != back.end()) {
      row["gamma_of_measured_temperature"] =
          gamma->status == fit::ValueStatus::ok ? quantity_json(gamma->gamma, "1") : Json(nullptr);
    }
    out["readings"].push_back(std::move(row));
  }
  return out;
}

std::string map_text(const Json& map) {
  const bool measured = map.contains("measured_reduced_temperature");
  bool at_pole = false;
  std::string out = fmt::format("Gamma = {:.6g}\n{:<40} {:>10} {:>12} {:>9}{}\n", map["gamma"]["value"].get<double>(),
                                "formula", "H_0 / D", "T/T_c", "in range", measured ? "  Gamma of measured T" : "");
  for (const Json& row : map["readings"]) {
    if (row["jump"].is_null()) {
      out += fmt::format("{:<40} {}\n", row["name"].get<std::string>(), row["status"].get<std::string>());
      at_pole = at_pole || row["status"].get<std::string>() == to_string(fit::ValueStatus::pole);
      continue;
    }
    out += fmt::format("{:<40} {:>10.4f} {:>12.4f} {:>9}", row["name"].get<std::string>(),
                       row["jump"]["value"].get<double>(), row["reduced_temperature"]["value"].get<double>(),
                       row["in_range"].get<bool>() ? "yes" : "no");
    const Json* gamma = find_pointer(row, "/gamma_of_measured_temperature/value");
    if (measured)
      out += fmt::format(" {:>20}",
                         gamma != nullptr && gamma->is_number() ? fmt::format("{:.4f}", gamma->get<double>()) : "none");
    out += '\n';
  }
  if (measured) {
    out += fmt::format("measured T/T_c = {:.4f}\n", map["measured_reduced_temperature"]["value"].get<double>());
  }
  if (at_pole)
    out += "undefined (pole): the equation of state diverges at the density phi_0 of the solid in this row.\n";
  return out;
}

Json audit_json() {
  Json out;
  out["paper"] = "P. V. Quinn and D. C. Hong, Phys. Rev. E 62, 8295 (2000)";
  out["rows"] = Json::array();
  for (const fit::AuditRow& row : fit::audit()) {
    Json entry;
    entry["quantity"] = row.quantity;
    entry["place"] = row.place;
    entry["status"] = fit::to_string(row.status);
    if (row.is_numeric) {
      entry["printed"] = row.printed;
      entry["recomputed"] = row.recomputed;
      entry["unit"] = row.unit;
      entry["difference"] = row.difference;
      entry["relative_difference"] = row.relative_difference;
    }
    entry["printed_text"] = row.printed_text;
    entry["recomputed_text"] = row.recomputed_text;
    entry["explanation"] = row.explanation;
    out["rows"].push_back(std::move(entry));
  }
  return out;
}

std::string audit_text() {
  std::string out;
  for (const fit::AuditRow& row : fit::audit()) {
    out += fmt::format("{} [{}]\n  printed:    {}\n  recomputed: {}\n", row.quantity, fit::to_string(row.status),
                       row.printed_text, row.recomputed_text);
    if (row.is_numeric && row.difference != 0)
      out += fmt::format("  difference: {:+.7g} ({:+.3g} %)\n", row.difference, 100 * row.relative_difference);
    if (!row.explanation.empty()) out += fmt::format("  {}\n", row.explanation);
  }
  return out;
}

namespace {
Json estimate_json(const fit::Estimate& estimate, std::string_view unit, double factor = 1) {
  Json out = quantity_json(estimate.value * factor, unit, estimate.std_error * factor);
  if (estimate.fixed) out["fixed"] = true;
  return out;
}
Json interval_json(const fit::Interval& interval, double factor = 1) {
  return Json{
      {"status", fit::to_string(interval.status)}, {"low", interval.low * factor},  {"high", interval.high * factor},
      {"confidence", interval.confidence},         {"low_open", interval.low_open}, {"high_open", interval.high_open}};
}

// The fitted parameters, what follows from them, and how good the fit is.
void add_parameters(const fit::FitResult& result, std::optional<double> diameter, Json& out) {
  out["temperature"] = estimate_json(result.temperature, "m g D");
  out["statistical_error"] = quantity_json(result.statistical_error, "m g D");
  if (diameter) out["temperature_over_mg"] = estimate_json(result.temperature, "m", *diameter);
  out["shift"] = estimate_json(result.shift, "D");
  out["solid_height"] = estimate_json(result.solid_height, "D");
  out["plateau_density"] = estimate_json(result.plateau_density, "1/D^2");
  out["column_number"] = estimate_json(result.column_number, "1");
  if (result.critical_status == fit::ValueStatus::ok) {
    out["critical_temperature"] = estimate_json(result.critical_temperature, "m g D");
    if (diameter) out["critical_temperature_over_mg"] = estimate_json(result.critical_temperature, "m", *diameter);
    out["reduced_temperature"] = estimate_json(result.reduced_temperature, "1");
    out["solid_height_by_sum_rule"] = quantity_json(result.solid_height_by_sum_rule, "D");
  } else {
    out["critical_temperature_status"] = fit::to_string(result.critical_status);
  }
  out["temperature_interval"] = interval_json(result.temperature_interval);
  out["next_bed_interval"] = interval_json(result.next_bed_interval);
  out["chi2"] = result.chi2;
  out["dof"] = result.dof;
  out["chi2_per_dof"] = result.chi2_per_dof;
  out["p_value"] = result.p_value;
  out["aic"] = result.aic;
  out["bic"] = result.bic;
  out["errors_scaled"] = result.errors_scaled;
}

// Row by row, in the order of "parameters".
Json covariance_json(const fit::FitResult& result) {
  Json rows = Json::array();
  const std::size_t n = result.parameters.size();
  for (std::size_t i = 0; i < n; ++i) {
    Json row = Json::array();
    for (std::size_t j = 0; j < n; ++j) row.push_back(result.covariance[i * n + j]);
    rows.push_back(std::move(row));
  }
  return rows;
}

Json models_json(const std::vector<fit::ModelFit>& fits) {
  Json models = Json::array();
  for (const fit::ModelFit& model : fits) {
    Json row;
    row["model"] = model.model;
    row["plateau_density_free"] = model.plateau_density_free;
    row["status"] = fit::to_string(model.status);
    if (model.status == fit::FitStatus::ok) {
      row["temperature"] = estimate_json(model.temperature, "m g D");
      row["shift"] = estimate_json(model.shift, "D");
      row["plateau_density"] = estimate_json(model.plateau_density, "1/D^2");
      row["chi2_per_dof"] = model.chi2_per_dof;
      row["aic"] = model.aic;
      row["bic"] = model.bic;
    }
    models.push_back(std::move(row));
  }
  return models;
}

Json windows_json(const std::vector<fit::WindowFit>& fits) {
  Json sweep = Json::array();
  for (const fit::WindowFit& window : fits) {
    Json row{
        {"low", window.low}, {"high", window.high}, {"bins", window.bins}, {"status", fit::to_string(window.status)}};
    if (window.status == fit::FitStatus::ok) {
      row["temperature"] = window.temperature.value;
      row["temperature_std_error"] = window.temperature.std_error;
      row["shift"] = window.shift.value;
      row["chi2_per_dof"] = window.chi2_per_dof;
    }
    sweep.push_back(std::move(row));
  }
  return sweep;
}

// The rms misfit inside the window over the greatest density there. It is no test of significance: with many frames any
// model is off by more than the errors.
double relative_misfit(const std::vector<fit::Residual>& residuals) {
  double squares = 0, greatest = 0;
  std::size_t used = 0;
  for (const fit::Residual& residual : residuals) {
    if (!residual.used) continue;
    squares += (residual.density - residual.model) * (residual.density - residual.model);
    greatest = std::max(greatest, residual.density);
    ++used;
  }
  return used > 0 && greatest > 0 ? std::sqrt(squares / static_cast<double>(used)) / greatest : 0;
}

// Why the model does not describe the data; "": it does.
std::string why_not_described(const fit::FitResult& result, double misfit) {
  if (!result.ok()) return result.message.empty() ? std::string(fit::to_string(result.status)) : result.message;
  if (misfit > tolerable_misfit)
    return fmt::format(
        "inside the window, the rms difference between model and data is {:.1f} % of the greatest density",
        100 * misfit);
  if (result.model != "simulation" && result.critical_status == fit::ValueStatus::ok &&
      result.reduced_temperature.value > 1)
    return fmt::format(
        "T/T_c = {:.2f} is above 1: in this model there is no solid, and the fitted rectangle has no meaning",
        result.reduced_temperature.value);
  return "";
}
}  // namespace

Json fit_json(const fit::FitResult& result, std::optional<double> diameter) {
  Json out;
  out["status"] = fit::to_string(result.status);
  if (!result.message.empty()) out["message"] = result.message;
  out["model"] = result.model;
  if (result.ok() || result.status == fit::FitStatus::not_converged) {
    add_parameters(result, diameter, out);
    out["parameters"] = result.parameters;
    out["covariance"] = covariance_json(result);
  }
  out["window"] = Json{{"low", quantity_json(result.window_low, "D")},
                       {"high", quantity_json(result.window_high, "D")},
                       {"bins", result.bins},
                       {"rule", result.window_rule}};
  out["kernel"] = Json{{"kind", to_string(result.kernel.kind)}, {"width", result.kernel.width}};
  out["area"] = quantity_json(result.area, "1");
  out["models"] = models_json(result.model_comparison);
  out["temperature_by_window"] = windows_json(result.window_sweep);
  const double misfit = relative_misfit(result.residuals);
  const std::string why_not = why_not_described(result, misfit);
  out["relative_misfit"] = misfit;
  out["describes_data"] = why_not.empty();
  if (!why_not.empty()) out["why_not"] = why_not;
  out["warnings"] = result.warnings;
  return out;
}

std::string fit_text(const Json& fit) {
  std::string out;
  const auto line = [&](const char* name, const char* label) {
    if (!fit.contains(name)) return;
    const Json& quantity = fit[name];
    const std::string unit = quantity.value("unit", "");
    double value = quantity["value"].get<double>(), error = stated_error(quantity);
    std::string shown = unit == "1" ? "" : unit;
    if (unit == "m") value *= 1e3, error *= 1e3, shown = "mm";
    const std::string known = quantity.value("fixed", false) ? "  (fixed)"
                              : error > 0                    ? fmt::format(" +- {:.2g}", error)
                                                             : "";
    out += fmt::format("{:<22} {:>12.6g}{} {}\n", label, value, known, shown);
  };
  if (!fit.value("describes_data", true)) {
    out += fmt::format("The model {} does not describe this profile: {}.\n", fit.value("model", ""),
                       fit.value("why_not", ""));
  }
  line("temperature", "T / (m g D)");
  line("temperature_over_mg", "T / (m g)");
  if (const Json* solid = find_pointer(fit, "/solid_height/value"); solid != nullptr && *solid == 0)
    out += fmt::format("{:<22} {:>12}\n", "solid height", "no solid");
  else
    line("solid_height", "solid height");
  line("shift", "shift");
  line("plateau_density", "plateau density");
  line("critical_temperature", "T_c / (m g D)");
  line("reduced_temperature", "T / T_c");
  if (fit.contains("chi2_per_dof"))
    out += fmt::format("{:<22} {:>12.4g}\n", "chi2 per dof", fit["chi2_per_dof"].get<double>());
  out += fmt::format("{:<22} {:.4g} to {:.4g} D, {} bins\n", "window", fit["window"]["low"]["value"].get<double>(),
                     fit["window"]["high"]["value"].get<double>(), fit["window"]["bins"].get<int>());
  for (const Json& model : fit["models"]) {
    if (model.value("plateau_density_free", false) && model.contains("temperature")) {
      out += fmt::format("fit with phi_0 free    T = {:.6g} m g D, phi_0 = {:.4g} ({})\n",
                         model["temperature"]["value"].get<double>(), model["plateau_density"]["value"].get<double>(),
                         model.value("model", ""));
    }
  }
  for (const Json& warning : fit["warnings"]) out += "warning: " + warning.get<std::string>() + "\n";
  return out;
}

}  // namespace shakebed::pipelines
