#include "pipelines/stages/replicas.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace shakebed::pipelines {

namespace {

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

}  // namespace

// Quantities become means with their error and spread, counts become sums; what is neither is the first's. A quantity
// that some beds do not have has no mean; one without an error that is the same in all of them stays as it is.
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
      const Spread spread(values);
      value["value"] = spread.mean;
      value["std_error"] = spread.deviation / std::sqrt(static_cast<double>(values.size()));
      value["spread"] = spread.deviation;
    }
  }
  out["replicas"] = results.size();
  return out;
}

Table replicas_table(const std::vector<Json>& results) {
  // Every quantity that some bed has, in the order of the first that has it.
  std::vector<std::pair<std::string, std::string>> quantities;  // name, unit
  for (const Json& one : results) {
    for (const auto& [key, value] : one.items()) {
      const bool known =
          std::any_of(quantities.begin(), quantities.end(), [&](const auto& q) { return q.first == key; });
      if (!known && value.is_object() && value.contains("value"))
        quantities.emplace_back(key, value.value("unit", std::string("1")));
    }
  }
  std::vector<StatedColumn> columns{{"replica", "1", "number of the replica, from 0"}};
  for (const auto& [name, unit] : quantities) columns.push_back({name, unit, name + " of the replica"});
  Table table("each replica by itself", columns);
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
    out.number_density[i] = spread.mean;
    out.std_error[i] = spread.deviation / std::sqrt(static_cast<double>(values.size()));
  }
  out.samples *= profiles.size();
  return out;
}

// Of the filled rows of the mean of the replicas' densities: what each shows of it by itself, together, and where the
// replicas differ by more than that (beds are not all built alike), so much more of it.
std::vector<double> joined_covariance(const std::vector<const BedMeasurement*>& measurements,
                                      const sim::Profile& joined, std::size_t& independent_blocks) {
  const Rows rows = filled_rows(joined);
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
