// The map Gamma <-> T: jump heights against extended precision, the bounce map's statistics, there and back, hard
// cases.
#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "fit/map/gamma_temperature.hpp"
#include "fit/map/jump_height.hpp"
#include "tests/bench/program/results.hpp"

namespace shakebed::pipelines::bench {
namespace {

// The greatest height above the moving floor of a flight that begins where the floor's deceleration reaches g, in
// extended precision: every maximum up to the landing, each by bisection.
long double reference_relative_max(long double gamma) {
  const long double start = std::asin(1 / gamma);
  const auto rate = [&](long double t) { return gamma * (std::cos(start) - std::cos(start + t)) - t; };
  const auto height = [&](long double u) {
    return gamma * (std::sin(start) - std::sin(start + u)) + gamma * std::cos(start) * u - u * u / 2;
  };
  // The rate grows from 0 until the floor's deceleration is back at g; maxima lie after that, and none beyond 2 Gamma.
  constexpr long double step = 0.02L;
  long double best = 0, left = std::numbers::pi_v<long double> - 2 * start;
  for (; left <= 2 * gamma + 1; left += step) {
    if (!(rate(left) > 0) || rate(left + step) > 0) continue;
    long double low = left, high = left + step;
    for (int i = 0; i < 80; ++i) {
      const long double middle = (low + high) / 2;
      (rate(middle) > 0 ? low : high) = middle;
    }
    best = std::max(best, height((low + high) / 2));
    if (height(left + step) < 0) break;
  }
  return best;
}

fit::ShakenBed published_bed(double gamma) {
  fit::ShakenBed bed;
  bed.gamma = gamma;
  bed.acceleration_length = fit::acceleration_length(9.81, 20, 2.99e-3);
  bed.column = {11.22, 1.10};
  return bed;
}

void jump_heights(const Effort& effort, StageResult& result) {
  effort.step("map: jump heights");
  Table table{"Height of a dead ball's jump",
              "error: relative, over 100 values of Gamma from 1.001 to 1000; relative_max against extended precision, "
              "the others against their closed forms; inverse: Gamma -> height -> Gamma",
              {"height", "us a value", "worst error", "at Gamma", "us inverse", "worst error of the inverse"},
              {}};
  Figure figure{"map-jump-height",
                "Jump height and its inverse: error against cost",
                "CPU seconds a value",
                "relative error, worst",
                {}};
  for (const fit::JumpHeight kind : fit::jump_heights) {
    effort.check_interrupted();
    double worst = 0, at = 0, worst_inverse = 0;
    std::vector<double> gammas, heights;
    for (int i = 0; i < 100; ++i) {
      const double gamma = 1 + 1e-3 * std::pow(999e3, i / 99.0);
      const long double g = gamma;
      const double value = fit::jump_height(kind, gamma).value;
      const long double truth = kind == fit::JumpHeight::relative_max       ? reference_relative_max(g)
                                : kind == fit::JumpHeight::above_launch     ? (g - 1) * (g + 1) / 2
                                : kind == fit::JumpHeight::above_mean_floor ? (g * g + 1) / 2
                                                                            : (g - 1) * (g - 1) / 2;
      const auto error = static_cast<double>(std::abs(value / truth - 1));
      if (error > worst) worst = error, at = gamma;
      const double back = fit::gamma_for_jump_height(kind, value).value;
      worst_inverse = std::max(worst_inverse, std::abs(back / gamma - 1));
      gammas.push_back(gamma), heights.push_back(value);
    }
    const double forward = least_cpu_seconds([&] {
                             for (const double gamma : gammas) fit::jump_height(kind, gamma);
                           }) /
                           100;
    const double inverse = least_cpu_seconds([&] {
                             for (const double height : heights) fit::gamma_for_jump_height(kind, height);
                           }) /
                           100;
    const std::string name(fit::to_string(kind));
    table.rows.push_back({name, 1e6 * forward, worst, at, 1e6 * inverse, worst_inverse});
    figure.curves.push_back({name, {forward}, {std::max(worst, 1e-17)}});
    figure.curves.push_back({name + ", inverse", {inverse}, {std::max(worst_inverse, 1e-17)}});
    if (kind == fit::JumpHeight::relative_max) figure.curves[figure.curves.size() - 2].standard = 0;
    result.metrics.push_back({"jump height " + name, "s", forward, false});
    result.metrics.push_back({"Gamma from jump height " + name, "s", inverse, false});
  }
  Curve epsilon{"half a unit in the last place", {1e-9, 1e-3}, {1.1e-16, 1.1e-16}};
  epsilon.limit = true;
  figure.curves.push_back(std::move(epsilon));
  result.tables.push_back(std::move(table));
  result.figures.push_back(std::move(figure));
}

void bounce_statistics(const Effort& effort, StageResult& result) {
  effort.step("map: the bounce map");
  constexpr double gamma = 4.0, restitution = 0.5;
  const int longest = effort.quick ? 200'000 : 4'000'000, replicas = effort.quick ? 8 : 32;
  const auto mean = [&](int flights, int replica) {
    fit::BounceOptions options;
    options.restitution = restitution, options.flights = flights, options.initial_phase = 0.1 + 0.17 * replica;
    return fit::bounce(gamma, options).mean_height[0];
  };
  const double truth = [&] {
    double sum = 0;
    for (int i = 0; i < 4; ++i) sum += mean(longest, 1000 + i);
    return sum / 4;
  }();
  Figure figure{"map-bounce",
                "Mean jump of a bouncing ball (restitution 0.5, Gamma = 4): error against cost",
                "CPU seconds",
                "relative error, rms",
                {}};
  Curve curve{"bounce map", {}, {}}, limit{"1/sqrt(flights)", {}, {}};
  limit.limit = true;
  Table table{"The bounce map's mean height",
              fmt::format("against the mean of four orbits of {} flights, {:.6g} g/w^2; {} starts a row", longest,
                          truth, replicas),
              {"flights", "CPU ms", "error, rms", "error sqrt(flights)"},
              {}};
  for (int flights = 100; flights <= longest / 20; flights *= 10) {
    effort.check_interrupted();
    double squares = 0;
    const double cpu = cpu_seconds_of([&] {
                         for (int i = 0; i < replicas; ++i) squares += std::pow(mean(flights, i) / truth - 1, 2);
                       }) /
                       replicas;
    const double rms = std::sqrt(squares / replicas);
    table.rows.push_back({flights, 1e3 * cpu, rms, rms * std::sqrt(flights)});
    curve.cost.push_back(cpu), curve.error.push_back(rms);
    if (flights == 1000) curve.standard = curve.cost.size() - 1;
    limit.cost.push_back(cpu), limit.error.push_back(1 / std::sqrt(flights));
  }
  figure.curves = {std::move(curve), std::move(limit)};
  figure.curves.back().label = "1/sqrt(flights), for comparison";
  figure.pareto = false;
  result.figures.push_back(std::move(figure));
  result.tables.push_back(std::move(table));
}

void there_and_back(const Effort& effort, StageResult& result) {
  effort.step("map: Gamma to T and back");
  const fit::ShakenBed bed = published_bed(4);
  const auto readings = fit::temperatures_from_gamma(bed);
  Table table{"Gamma = 4 to T and back, by every reading",
              "the published bed: D = 2.99 mm, 20 Hz, mu = 10.2, phi_0 = 1.10",
              {"reading", "T/(m g D)", "T/T_c", "in range", "error of Gamma, there and back"},
              {}};
  for (const fit::Reading& reading : readings) {
    if (reading.status != fit::ValueStatus::ok) {
      table.rows.push_back({reading.name, Json(), Json(), false, Json()});
      continue;
    }
    double error = std::numeric_limits<double>::quiet_NaN();
    for (const fit::GammaReading& back : fit::gammas_from_temperature(reading.temperature, bed)) {
      if (back.name == reading.name && back.status == fit::ValueStatus::ok) error = std::abs(back.gamma / 4 - 1);
    }
    table.rows.push_back({reading.name, reading.temperature, reading.reduced_temperature, reading.in_range,
                          std::isnan(error) ? Json() : Json(error)});
  }
  result.tables.push_back(std::move(table));
  const double all = least_cpu_seconds([&] { fit::temperatures_from_gamma(bed); });
  const double back = least_cpu_seconds([&] { fit::gammas_from_temperature(0.12, bed); });
  result.metrics.push_back({"Gamma to T, all readings", "s", all, false});
  result.metrics.push_back({"T to Gamma, all readings", "s", back, false});
  result.sentences.push_back(
      fmt::format("All {} readings of one Gamma cost {:.0f} us, all Gammas of one temperature {:.0f} us.",
                  readings.size(), 1e6 * all, 1e6 * back));
}

void map_hard_cases(const Effort& effort, StageResult& result) {
  effort.step("map: hard cases");
  const auto add = [&](const std::string& name, double limit, const std::function<void(HardCase&)>& work) {
    effort.check_interrupted();
    result.hard_cases.push_back(run_hard_case(name, "relative", limit, 2, work));
  };
  for (const double excess : {1e-12, 1e-9, 1e-6, 1e-3}) {
    add(fmt::format("relative_max at Gamma = 1 + {:g}", excess), 1e-3, [&](HardCase& one) {
      // Near 1: with s = sqrt(2 excess), the flight over the floor is excess at first order s^2: the relative height
      // is Gamma (s t^2/2 - t^3 s0/6 ...); its leading term at the turning point t = 3 s is (9/8) s^4.
      const double gamma = 1 + excess, s2 = 2 * (gamma - 1),
                   value = fit::jump_height(fit::JumpHeight::relative_max, gamma).value;
      one.note = fmt::format("height {:.4g}", value);
      one.error = std::abs(value / (9.0 / 8 * s2 * s2) - 1);
      one.limit = std::max(1e-3, 10 * excess);  // what the next order adds
    });
  }
  add("Gamma = 1 and below: the ball never leaves", 0, [&](HardCase& one) {
    double worst = 0;
    for (const double gamma : {0.0, 0.5, 1.0})
      worst = std::max(worst, std::abs(fit::jump_height(fit::JumpHeight::relative_max, gamma).value));
    one.error = worst;
  });
  add("Gamma = 1e6", 1e-9, [&](HardCase& one) {
    const double gamma = 1e6, value = fit::jump_height(fit::JumpHeight::relative_max, gamma).value;
    // The apex lies within a of (Gamma^2 + 1)/2, the floor within Gamma of its mean: bounds, not a value.
    const double low = (gamma * gamma + 1) / 2 - gamma, high = (gamma * gamma + 1) / 2 + gamma;
    one.pass = value >= low && value <= high;
    one.note = fmt::format("{:.10g} within [{:.10g}, {:.10g}]", value, low, high);
  });
  for (const double bad : {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    add(fmt::format("Gamma = {}", bad), 0, [&](HardCase& one) {
      const fit::Value value = fit::jump_height(fit::JumpHeight::relative_max, bad);
      one.status = value.status == fit::ValueStatus::ok ? "a number" : "refused";
      one.pass = value.status != fit::ValueStatus::ok;
    });
  }
  add("chattering ball: restitution 0.99, 1000 flights", 0, [&](HardCase& one) {
    fit::BounceOptions options;
    options.restitution = 0.99;
    const fit::BounceStatistics found = fit::bounce(1.2, options);
    one.pass = found.status == fit::ValueStatus::ok && std::isfinite(found.mean_height[0]);
    one.note = fmt::format("mean jump {:.4g} g/w^2", found.mean_height[0]);
  });
  add("bed far hotter than the formula's range says so", 0, [&](HardCase& one) {
    int wrong = 0;
    for (const fit::Reading& reading : fit::temperatures_from_gamma(published_bed(1000)))
      wrong += reading.status == fit::ValueStatus::ok && reading.expansion != fit::ExpansionReading::fermi &&
               reading.in_range != (reading.reduced_temperature <= 1);
    one.error = wrong;
  });
}

}  // namespace

StageResult bench_map(const Effort& effort) {
  StageResult result;
  result.name = "map", result.title = "map: Gamma and temperature";
  result.cpu_seconds = cpu_seconds_of([&] {
    jump_heights(effort, result);
    bounce_statistics(effort, result);
    there_and_back(effort, result);
    map_hard_cases(effort, result);
  });
  return result;
}

}  // namespace shakebed::pipelines::bench
