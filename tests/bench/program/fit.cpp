// Fits: the inverse of f, the constants, fits by kernel and number of bins, statistics against the Cramer-Rao bound,
// hard cases.
#include "tests/bench/cases/fit_benchmark.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <numbers>

#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/expansion.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "sim/engine/random.hpp"
#include "tests/bench/program/results.hpp"

namespace shakebed::pipelines::bench {
namespace {

constexpr double true_temperature = 0.12, plateau = 1.10, column = 11.22;

fit::Profile exact_profile(int bins, const Kernel& kernel, double highest = 13) {
  const auto truth = fit::HydrostaticProfile::of_column(fit::enskog(), true_temperature, {column, plateau});
  fit::Profile data;
  for (int i = 0; i < bins; ++i) data.height.push_back(highest * (i + 0.5) / bins);
  data.number_density.resize(data.height.size());
  truth.sample(data.height, kernel, data.number_density);
  data.std_error.assign(data.height.size(), 1e-3);
  return data;
}

fit::FitOptions plain_options(const Kernel& kernel) {
  fit::FitOptions options;
  options.plateau_density = plateau;
  options.kernel = kernel;
  options.interval = options.sweep = options.compare = false;
  options.curve_points = 0;
  return options;
}

Curve& curve_of(Figure& figure, const std::string& label) {
  for (Curve& curve : figure.curves) {
    if (curve.label == label) return curve;
  }
  figure.curves.push_back({label, {}, {}});
  return figure.curves.back();
}

// Density from f, with the least error that a double can have.
Figure inverse_figure(const std::vector<fit::FitBenchmarkRow>& rows) {
  Figure figure{"fit-inverse",
                "Density from f: error against cost, by equation of state",
                "CPU seconds a value",
                "relative error, worst",
                {}};
  double fastest = 1, slowest = 0;
  for (const fit::FitBenchmarkRow& row : rows) {
    if (row.what != "inverse") continue;
    const double seconds = 1e-9 * row.nanoseconds;
    Curve& curve = curve_of(figure, row.setting);
    curve.cost.push_back(seconds), curve.error.push_back(std::max(row.error, 1e-17));
    if (row.setting.starts_with("enskog, batch")) curve.standard = curve.cost.size() - 1;
    fastest = std::min(fastest, seconds), slowest = std::max(slowest, seconds);
  }
  if (figure.curves.empty()) return figure;
  constexpr double half_unit = std::numeric_limits<double>::epsilon() / 2;
  Curve epsilon{"half a unit in the last place", {fastest / 1.5, slowest * 1.5}, {half_unit, half_unit}};
  epsilon.limit = true;
  figure.curves.push_back(std::move(epsilon));
  return figure;
}

Figure kernel_figure(const std::vector<fit::FitBenchmarkRow>& rows) {
  Figure figure{"fit-kernel",
                "A fit without noise: error of T against cost, by kernel (30 to 10,000 bins, left to right)",
                "CPU seconds a fit",
                "relative error of T",
                {}};
  for (const fit::FitBenchmarkRow& row : rows) {
    if (row.what != "fit") continue;
    Curve& curve = curve_of(figure, row.setting);
    curve.cost.push_back(1e-9 * row.nanoseconds), curve.error.push_back(std::max(row.error, 1e-17));
  }
  return figure;
}

Table growth_table(const std::vector<fit::FitBenchmarkRow>& rows) {
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> growth;  // setting → bins, seconds
  for (const fit::FitBenchmarkRow& row : rows) {
    if (row.what != "fit") continue;
    growth[row.setting].first.push_back(row.size), growth[row.setting].second.push_back(1e-9 * row.nanoseconds);
  }
  Table exponents{"Growth of a fit with the number of bins",
                  "cost ~ bins^p, by least squares in the logarithms",
                  {"setting", "from bins", "to bins", "p"},
                  {}};
  for (const auto& [setting, xy] : growth) {
    if (const auto p = exponent(xy.first, xy.second)) {
      const auto [low, high] = std::minmax_element(xy.first.begin(), xy.first.end());
      exponents.rows.push_back({setting, *low, *high, *p});
    }
  }
  return exponents;
}

void room_benchmark(const Effort& effort, StageResult& result) {
  effort.step("fit: inverse, constants, fits without noise");
  const auto rows = fit::benchmark_fit(effort.quick ? 0.3 : 3);
  Table table{"The kernels of the fit, without noise",
              "error: relative, against the truth the input was made from; cost a value (inverse, constants) or a fit",
              {"what", "setting", "values or bins", "us", "error"},
              {}};
  for (const fit::FitBenchmarkRow& row : rows) {
    table.rows.push_back({row.what, row.setting, row.size, 1e-3 * row.nanoseconds, row.error});
    result.metrics.push_back(
        {fmt::format("{}, {}, {}", row.what, row.setting, row.size), "s", 1e-9 * row.nanoseconds, false});
  }
  for (Figure figure : {inverse_figure(rows), kernel_figure(rows)}) {
    if (!figure.curves.empty()) result.figures.push_back(std::move(figure));
  }
  result.tables.push_back(std::move(table));
  if (Table exponents = growth_table(rows); !exponents.rows.empty()) result.tables.push_back(std::move(exponents));
}

// What a fit keeps, by its bins.
void memory_growth(const Effort& effort, StageResult& result) {
  effort.step("fit: memory by bins");
  const Kernel kernel{KernelKind::gaussian, 0.5};
  Table table{"Memory of a fit by the number of bins",
              "resident, at its peak, the profile included; 0: no new page of memory was needed",
              {"bins", "memory [MB]"},
              {}};
  std::vector<double> bins, memory;
  for (const int count : {100, 1'000, 10'000, 100'000}) {
    effort.check_interrupted();
    const auto peak = peak_memory_of([&] { fit::fit_profile(exact_profile(count, kernel), plain_options(kernel)); });
    table.rows.push_back({count, peak ? Json(*peak / 1e6) : Json()});
    if (peak) bins.push_back(count), memory.push_back(*peak);
  }
  if (const auto p = exponent(bins, memory)) table.note += fmt::format("; memory grows as bins^{:.2f}", *p);
  result.tables.push_back(std::move(table));
}

// Knobs turned one at a time: error against time, the default marked.
void trade_offs(const Effort& effort, StageResult& result) {
  effort.step("fit: iterations, size of the table, bins");
  const auto rows = fit::benchmark_fit_trade_offs(effort.quick ? 0.3 : 3);
  struct Knob {
    std::string name, title, note, cost_label, error_label;
  };
  const Knob knobs[] = {{"iterations", "Error of T against time, by the fit's iterations",
                         "error: of T, relative, against the converged fit's; cost: a fit of 100 bins",
                         "CPU seconds a fit", "relative error of T"},
                        {"table size", "Error of the inverse of f against time, by the size of its table",
                         "error: relative, the worst over the table's range; cost: a value", "CPU seconds a value",
                         "relative error, worst"},
                        {"bins", "Statistical error of T against time, by the number of bins",
                         "error: the standard error of T, relative, for one and the same measurement; cost: a fit",
                         "CPU seconds a fit", "relative standard error of T"}};
  for (const Knob& knob : knobs) {
    Table table{knob.title, knob.note, {"setting", knob.name, "us", "error", "default"}, {}};
    std::string name = "fit-by-" + knob.name;
    std::replace(name.begin(), name.end(), ' ', '-');
    Figure figure{name, knob.title, knob.cost_label, knob.error_label, {}};
    for (const fit::FitTradeOff& row : rows) {
      if (row.knob != knob.name) continue;
      table.rows.push_back({row.setting, row.value, 1e-3 * row.nanoseconds, row.error, row.standard ? "yes" : ""});
      if (figure.curves.empty() || figure.curves.back().label != row.setting)
        figure.curves.push_back({row.setting, {}, {}});
      Curve& curve = figure.curves.back();
      if (row.standard) curve.standard = curve.cost.size();
      curve.cost.push_back(1e-9 * row.nanoseconds), curve.error.push_back(std::max(row.error, 1e-17));
    }
    result.tables.push_back(std::move(table));
    result.figures.push_back(std::move(figure));
  }
}

// The Cramer-Rao bound of T, T and shift free: from the derivatives of the model in the window that was used.
double bound_of_temperature(const fit::FitOptions& options, const fit::Profile& data, double shift, double low,
                            double high) {
  std::vector<double> heights, errors;
  for (std::size_t i = 0; i < data.height.size(); ++i) {
    if (data.height[i] < low - 1e-9 || data.height[i] > high + 1e-9) continue;
    heights.push_back(data.height[i]), errors.push_back(data.std_error[i]);
  }
  const auto at = [&](double t, double s) {
    return fit::evaluate_model(options, t, s, plateau, column, heights).densities;
  };
  const double dt = 1e-4 * true_temperature, ds = 1e-4;
  const auto tp = at(true_temperature + dt, shift), tm = at(true_temperature - dt, shift),
             sp = at(true_temperature, shift + ds), sm = at(true_temperature, shift - ds);
  double tt = 0, ts = 0, ss = 0;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const double a = (tp[i] - tm[i]) / (2 * dt) / errors[i], b = (sp[i] - sm[i]) / (2 * ds) / errors[i];
    tt += a * a, ts += a * b, ss += b * b;
  }
  return std::sqrt(ss / (tt * ss - ts * ts));
}

void statistics(const Effort& effort, StageResult& result) {
  effort.step("fit: noise and the Cramer-Rao bound");
  const Kernel kernel{KernelKind::gaussian, 0.5};
  const int replicas = effort.quick ? 60 : 1000;
  Table table{"Fits of noisy profiles, 52 bins of 0.25 D",
              fmt::format("{} noisy profiles a row; noise: of the density of a bin, 0.05/sqrt(frames); bound: "
                          "Cramer-Rao, T and shift free, in the window used",
                          replicas),
              {"frames", "noise", "error of T, rms", "bound", "rms/bound", "reported error/rms", "failed"},
              {}};
  Figure figure{"fit-noise",
                "Error of T against the number of frames",
                "frames that are independent",
                "relative error of T, rms",
                {}};
  Curve curve{"fit (default window)", {}, {}}, bound_curve{"Cramer-Rao", {}, {}};
  bound_curve.limit = true;
  sim::Random random(11);
  for (const double frames : {1.0, 10.0, 100.0, 1e3, 1e4}) {
    effort.check_interrupted();
    const double noise = 0.05 / std::sqrt(frames);
    fit::Profile data = exact_profile(52, kernel);
    data.std_error.assign(data.height.size(), noise);
    const std::vector<double> truth = data.number_density;
    const fit::FitOptions options = plain_options(kernel);
    double squares = 0, reported = 0, bound = 0;
    int failed = 0, good = 0;
    for (int r = 0; r < replicas; ++r) {
      for (std::size_t i = 0; i < truth.size(); ++i)
        data.number_density[i] = truth[i] + noise * random.normal_pair().first;
      const fit::FitResult fitted = fit::fit_profile(data, options);
      if (!fitted.ok()) {
        ++failed;
        continue;
      }
      ++good;
      squares += std::pow(fitted.temperature.value / true_temperature - 1, 2);
      reported += std::pow(fitted.temperature.std_error / true_temperature, 2);
      const double shift =
          fit::HydrostaticProfile::of_column(fit::enskog(), true_temperature, {column, plateau}).top_of_solid();
      bound += std::pow(
          bound_of_temperature(options, data, shift, fitted.window_low, fitted.window_high) / true_temperature, 2);
    }
    if (good == 0) {
      table.rows.push_back({frames, noise, Json(), Json(), Json(), Json(), failed});
      continue;
    }
    const double rms = std::sqrt(squares / good), limit = std::sqrt(bound / good);
    table.rows.push_back({frames, noise, rms, limit, rms / limit, std::sqrt(reported / good) / rms, failed});
    curve.cost.push_back(frames), curve.error.push_back(rms);
    bound_curve.cost.push_back(frames), bound_curve.error.push_back(limit);
  }
  figure.curves = {std::move(curve), std::move(bound_curve)};
  figure.pareto = false;
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(table));
}

// A fit whose answer is known: the error is that of T.
void fit_case(HardCase& one, const fit::Profile& data, const fit::FitOptions& options, double truth) {
  const fit::FitResult found = fit::fit_profile(data, options);
  one.status = std::string(fit::to_string(found.status));
  if (!found.ok()) {
    one.pass = false, one.note = found.message;
    return;
  }
  one.error = std::abs(found.temperature.value / truth - 1);
}

// Input that has no answer: it must be refused with a sentence, and no number may be a NaN.
void refusal_case(HardCase& one, const fit::Profile& data, const fit::FitOptions& options) {
  const fit::FitResult found = fit::fit_profile(data, options);
  one.status = std::string(fit::to_string(found.status));
  one.note = found.message;
  one.pass = !found.ok() && !found.message.empty() && !std::isnan(found.temperature.value) &&
             !std::isnan(found.temperature.std_error);
}

class HardCases {
 public:
  HardCases(const Effort& effort, StageResult& result) : effort_(effort), result_(result) {}

  void run() {
    effort_.step("fit: hard cases");
    equations_of_state();
    fits();
    refusals();
  }

 private:
  void add(const std::string& name, const std::string& unit, double limit, const std::function<void(HardCase&)>& work) {
    effort_.check_interrupted();
    result_.hard_cases.push_back(run_hard_case(name, unit, limit, 2, work));
  }

  void equations_of_state() {
    for (const double phi : {1e-300, 1e-8, 0.5, fit::close_packing_density}) {
      add(fmt::format("f and back at phi = {:.4g}", phi), "relative", 2e-14, [&](HardCase& one) {
        const fit::Value f = fit::enskog().f(phi), back = fit::enskog().density_from_f(f.value);
        // One rounding of f moves phi by |f| eps/kappa: that part is the input's.
        const double input = 1.2e-16 * std::abs(f.value) / fit::enskog().stiffness(phi).value;
        one.error = std::max(0.0, std::abs(back.value / phi - 1) - input);
        one.note = fmt::format("f = {:.6g}", f.value);
      });
    }
    add("k at phi_0 = 1e-8, where the printed formula cancels", "relative", 1e-12, [&](HardCase& one) {
      // k = integral of (Z/Z_0)^2: 1 - (pi/2) phi_0 to first order.
      const double phi = 1e-8, k = fit::expansion_constants(fit::enskog(), phi).k;
      one.error = std::abs(k / (1 - std::numbers::pi / 2 * phi) - 1);
    });
    for (const auto& equation : fit::equations_of_state()) {
      if (!equation->has_pole()) continue;
      add(fmt::format("{}: T_c at close packing, where it has a pole", equation->name()), "", 0, [&](HardCase& one) {
        const fit::Value value = fit::critical_temperature(*equation, {column, fit::close_packing_density});
        one.status = value.status == fit::ValueStatus::ok ? "a number" : "refused";
        one.pass = value.status != fit::ValueStatus::ok && !std::isnan(value.value);
      });
    }
  }

  void fits() {
    const Kernel none{}, gaussian{KernelKind::gaussian, 0.5};
    add("four bins", "relative", 1e-3, [&](HardCase& one) {
      fit::Profile data;
      const fit::Profile whole = exact_profile(130, none);
      for (std::size_t i : {105U, 107U, 109U, 111U})
        data.height.push_back(whole.height[i]), data.number_density.push_back(whole.number_density[i]),
            data.std_error.push_back(1e-3);
      fit::FitOptions options = plain_options(none);
      options.window.low = data.height.front(), options.window.high = data.height.back();
      fit_case(one, data, options, true_temperature);
    });
    add("T = 1e-4 m g D: the tail is far sharper than a bin", "", 0, [&](HardCase& one) {
      const auto truth = fit::HydrostaticProfile::of_column(fit::enskog(), 1e-4, {column, plateau});
      fit::Profile data = exact_profile(52, gaussian);
      truth.sample(data.height, gaussian, data.number_density);
      refusal_case(one, data, plain_options(gaussian));
    });
    add("wide kernel (2 D) over a tail of 0.12 D", "relative", 1e-3, [&](HardCase& one) {
      const Kernel wide{KernelKind::gaussian, 2};
      fit_case(one, exact_profile(100, wide, 20), plain_options(wide), true_temperature);
    });
    add("errors over nine decades", "relative", 1e-3, [&](HardCase& one) {
      fit::Profile data = exact_profile(100, gaussian);
      for (std::size_t i = 0; i < data.std_error.size(); ++i)
        data.std_error[i] = 1e-10 * std::pow(10, 9.0 * static_cast<double>(i) / 99);
      fit_case(one, data, plain_options(gaussian), true_temperature);
    });
    add("heights shifted by 1e6 D", "relative", 1e-3, [&](HardCase& one) {
      fit::Profile data = exact_profile(100, gaussian);
      for (double& height : data.height) height += 1e6;
      fit::FitOptions options = plain_options(gaussian);
      options.base = 1e6;
      fit_case(one, data, options, true_temperature);
    });
    add("bins in random order", "relative", 1e-4, [&](HardCase& one) {
      fit::Profile data = exact_profile(100, gaussian);
      sim::Random random(3);
      for (std::size_t i = data.height.size() - 1; i > 0; --i) {
        const auto j = random.below(static_cast<std::uint32_t>(i + 1));
        std::swap(data.height[i], data.height[j]), std::swap(data.number_density[i], data.number_density[j]);
      }
      fit_case(one, data, plain_options(gaussian), true_temperature);
    });
  }

  // Input without an answer.
  void refusals() {
    const Kernel gaussian{KernelKind::gaussian, 0.5};
    const auto spoil = [&](const std::function<void(fit::Profile&)>& how) {
      fit::Profile data = exact_profile(52, gaussian);
      how(data);
      return data;
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::pair<const char*, fit::Profile> refused[] = {
        {"no bins", {}},
        {"a NaN among the densities", spoil([&](fit::Profile& d) { d.number_density[7] = nan; })},
        {"an infinite height", spoil([&](fit::Profile& d) { d.height[7] = 1 / 0.0; })},
        {"a negative error", spoil([&](fit::Profile& d) { d.std_error[7] = -1; })},
        {"densities all 0", spoil([&](fit::Profile& d) { d.number_density.assign(d.height.size(), 0); })},
        {"a profile that does not fall",
         spoil([&](fit::Profile& d) { d.number_density.assign(d.height.size(), 0.5); })},
        {"lengths that differ", spoil([&](fit::Profile& d) { d.number_density.pop_back(); })},
        {"a covariance that is not positive",
         spoil([&](fit::Profile& d) { d.covariance.assign(d.height.size() * d.height.size(), -1); })},
    };
    for (const auto& [name, data] : refused)
      add(name, "", 0, [&, &profile = data](HardCase& one) { refusal_case(one, profile, plain_options(gaussian)); });
  }

  const Effort& effort_;
  StageResult& result_;
};

}  // namespace

StageResult bench_fit(const Effort& effort) {
  StageResult result;
  result.name = "fit", result.title = "fit: equations of state and fits of profiles";
  result.cpu_seconds = cpu_seconds_of([&] {
    room_benchmark(effort, result);
    memory_growth(effort, result);
    trade_offs(effort, result);
    statistics(effort, result);
    HardCases(effort, result).run();
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
