#include "pipelines/stages/replicas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "fit/profile_fit/chances.hpp"
#include "statistics/rest.hpp"

namespace shakebed::pipelines {

namespace {

// Beds differ where their spread is so many times what each states, at this significance.
constexpr double notable_ratio = 2, spread_significance = 0.01;
// A drift counts from so many of its standard errors on; they come from few samples, each run being cut in halves.
constexpr double notable_drift = 4;
constexpr double two_sided_95 = 0.975;

// Mean and spread of a number over the replicas.
struct Spread {
  double mean = 0, deviation = 0;
  explicit Spread(const std::vector<double>& values) {
    const auto n = static_cast<double>(values.size());
    for (const double v : values) mean += v / n;
    for (const double v : values) deviation += (v - mean) * (v - mean) / (n - 1);
    deviation = std::sqrt(deviation);
  }
};

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

// Of the mean of the replicas.
double error_of_mean(double spread, double within, std::size_t n) {
  const double between = few_beds_factor(n) * spread;
  return std::max(between, std::isfinite(within) ? within : 0) / std::sqrt(static_cast<double>(n));
}

std::vector<double> numbers_of(const std::vector<Json>& results, const std::string& key, const char* part) {
  std::vector<double> values;
  for (const Json& r : results) {
    const Json& v = r.at(key);
    if (v.is_object() && v.contains(part) && v.at(part).is_number()) values.push_back(v.at(part).get<double>());
  }
  return values;
}

void join_quantity(Json& value, const std::vector<double>& values, const std::vector<double>& errors) {
  const Spread spread(values);
  const double within = errors.size() == values.size() ? root_mean_square(errors) : 0;
  value["value"] = spread.mean;
  value["std_error"] = error_of_mean(spread.deviation, within, values.size());
  value["spread"] = spread.deviation;
  if (!errors.empty()) value["within"] = within;
}

const char* const drifting[][2] = {{"drift_temperature_x", "temperature_x"},
                                   {"drift_center_of_mass", "center_of_mass_rise"}};

const char* spoken(std::string_view key) {
  return key == "temperature_x" ? "T_x" : key == "temperature_z" ? "T_z" : "the rise of the centre of mass";
}

double part_of(const Json& results, const char* key, const char* part) {
  const Json* found = find_pointer(results, std::string("/") + key + "/" + part);
  return found != nullptr && found->is_number() ? found->get<double>() : std::nan("");
}

// The means of the two kinds of start that alternate.
std::string by_start(const std::vector<Json>& results, const char* key) {
  double sum[2] = {};
  int count[2] = {};
  for (std::size_t k = 0; k < results.size(); ++k) {
    sum[k % 2] += part_of(results[k], key, "value");
    ++count[k % 2];
  }
  return fmt::format(
      "mean {:.3g} of the beds that start as in the recipe, {:.3g} of those that start from a random fill",
      sum[0] / count[0], sum[1] / count[1]);
}

bool differ(double spread, double within, std::size_t n) {
  if (!(within > 0) || !(spread > notable_ratio * within)) return false;
  const auto freedom = static_cast<int>(n - 1);
  return fit::chance_of_chi2(freedom * spread * spread / (within * within), freedom) < spread_significance;
}

}  // namespace

double few_beds_factor(std::size_t n) {
  if (n < 2) return 1;
  return fit::student_quantile(two_sided_95, static_cast<int>(n - 1)) / fit::normal_quantile(two_sided_95);
}

// A quantity that some beds do not have has no mean; one without an error that is the same in all of them stays as it
// is.
Json joined_results(const std::vector<Json>& results) {
  Json out = results.front();
  for (auto& [key, value] : out.items()) {
    std::vector<double> values;
    for (const Json& r : results) {
      const Json& v = r.at(key);
      const Json& number = v.is_object() && v.contains("value") ? v.at("value") : v;
      if (number.is_number()) values.push_back(number.get<double>());
    }
    const bool quantity = value.is_object() && value.contains("value");
    if (values.size() != results.size()) {
      if (quantity) value = Json();
      continue;
    }
    if (value.is_number_unsigned()) {
      std::uint64_t sum = 0;
      for (const Json& r : results) sum += r.at(key).get<std::uint64_t>();
      value = sum;
    } else if (key == "max_overlap") {
      value["value"] = *std::max_element(values.begin(), values.end());
    } else if (quantity) {
      const bool same = std::equal(values.begin() + 1, values.end(), values.begin());
      if (same && !value.contains("std_error")) continue;
      join_quantity(value, values, numbers_of(results, key, "std_error"));
    }
  }
  out["replicas"] = results.size();
  return out;
}

bool lies_still(const Json& joined) {
  const Json *x = find_pointer(joined, "/temperature_x/value"), *z = find_pointer(joined, "/temperature_z/value");
  return x != nullptr && x->is_number() && *x < temperature_at_rest && z != nullptr && z->is_number() &&
         *z < temperature_at_rest;
}

std::optional<NotableSpread> notable_spread(const Json& joined, std::size_t n) {
  if (lies_still(joined)) return std::nullopt;
  for (const char* key : {"temperature_x", "temperature_z", "center_of_mass_rise"}) {
    const double spread = part_of(joined, key, "spread"), within = part_of(joined, key, "within");
    if (n >= 2 && differ(spread, within, n)) return NotableSpread{key, spoken(key), spread, within};
  }
  return std::nullopt;
}

std::optional<NotableDrift> notable_drift_of(const Json& joined) {
  if (lies_still(joined)) return std::nullopt;
  for (const auto& [drift, key] : drifting) {
    const double change = part_of(joined, drift, "value"), error = part_of(joined, drift, "std_error");
    if (error > 0 && std::abs(change) > notable_drift * error)
      return NotableDrift{spoken(key), change, error, std::abs(change / part_of(joined, key, "value"))};
  }
  return std::nullopt;
}

std::vector<std::string> replica_warnings(const std::vector<Json>& results, const Json& joined, ReplicaStarts starts) {
  std::vector<std::string> warnings;
  const std::size_t n = results.size();
  if (const auto found = notable_spread(joined, n))
    warnings.push_back(fmt::format(
        "the {} beds differ by more than chance: the standard deviation of {} between beds is {:.2g}, but the stated "
        "error of each bed is {:.2g}{}. The result depends on how the bed was filled; the stated error includes this. "
        "A longer \"settle\" may reduce the difference; more \"replicas\" reduce the error",
        n, found->what, found->spread, found->within,
        starts == ReplicaStarts::alternate ? " (" + by_start(results, found->key) + ")" : ""));
  if (const auto found = notable_drift_of(joined))
    warnings.push_back(
        fmt::format("the bed still changes while it is measured: {} is {} by {:.2g} ({:.0f} %) in the second half of "
                    "the time, which is {:.1f} times the error of this difference. Give a longer \"settle\"",
                    found->what, found->change > 0 ? "higher" : "lower", std::abs(found->change), 100 * found->part,
                    std::abs(found->change) / found->error));
  return warnings;
}

Table replicas_table(const std::vector<Json>& results) {
  // Every quantity that some bed has, in the order of the first that has it.
  std::vector<std::pair<std::string, std::string>> quantities;  // name, unit
  for (const Json& one : results) {
    for (const auto& [key, value] : one.items()) {
      const std::string& name = key;
      const bool known =
          std::any_of(quantities.begin(), quantities.end(), [&](const auto& q) { return q.first == name; });
      if (!known && value.is_object() && value.contains("value"))
        quantities.emplace_back(name, value.value("unit", std::string("1")));
    }
  }
  std::vector<StatedColumn> columns{{"replica", "1", "number of the replica, from 0"}};
  for (const auto& [name, unit] : quantities) columns.push_back({name, unit, name + " of the replica"});
  Table table("results of each replica", columns);
  for (std::size_t k = 0; k < results.size(); ++k) {
    std::vector<Cell> cells{count_cell(k)};
    for (const auto& [name, unit] : quantities) {
      const Json* number = find_pointer(results[k], "/" + name + "/value");
      cells.emplace_back(number != nullptr && number->is_number() ? number->get<double>() : no_number);
    }
    table.add(std::move(cells));
  }
  return table;
}

// The same file of every replica's measurement: mean densities, errors from their spread.
sim::Profile joined_density(const std::vector<const BedMeasurement*>& measurements, bool floor_frame) {
  std::vector<sim::Profile> profiles;
  for (const BedMeasurement* m : measurements) profiles.push_back(m->bed().density(floor_frame));
  sim::Profile out = profiles.front();
  for (std::size_t i = 0; i < out.height.size(); ++i) {
    std::vector<double> values;
    for (const sim::Profile& p : profiles) values.push_back(p.number_density[i]);
    const Spread spread(values);
    std::vector<double> errors;
    for (const sim::Profile& p : profiles) errors.push_back(p.std_error[i]);
    out.number_density[i] = spread.mean;
    out.std_error[i] = error_of_mean(spread.deviation, root_mean_square(errors), values.size());
  }
  out.samples *= profiles.size();
  return out;
}

// Of the filled rows of the mean of the replicas' densities: what each shows of it by itself, together, and where the
// replicas differ by more than that (beds are not all built alike), so much more of it.
std::vector<double> joined_covariance(const std::vector<const BedMeasurement*>& measurements,
                                      const sim::Profile& joined, std::size_t& independent_blocks) {
  const sim::FilledHeights rows = sim::filled_heights(joined);
  const std::size_t n = rows.last - rows.first;
  const auto replicas = static_cast<double>(measurements.size());
  std::vector<double> covariance(n * n, 0.0);
  independent_blocks = 0;
  for (const BedMeasurement* m : measurements) {
    const std::vector<double> own = m->bed().density_covariance(rows.first, rows.last);
    for (std::size_t i = 0; i < n * n; ++i) covariance[i] += own[i] / (replicas * replicas);
    independent_blocks += m->bed().covariance_blocks();
  }
  double seen = 0, own = 0;
  for (std::size_t i = 0; i < n; ++i) {
    seen += joined.std_error[rows.first + i] * joined.std_error[rows.first + i];
    own += covariance[i * n + i];
  }
  if (seen > own && own > 0)
    for (double& value : covariance) value *= seen / own;
  return covariance;
}

}  // namespace shakebed::pipelines
