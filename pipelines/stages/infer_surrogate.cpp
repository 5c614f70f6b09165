// implements: pipelines/stages/infer.hpp
// The surrogates of an inference: a model for each number that is compared, of the average over the shaking and of its
// single moments.
#include <algorithm>
#include <cmath>

#include "pipelines/stages/infer.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace {

// A moment of the shaking at which more of the fits than this fail is left out.
constexpr double most_missing = 0.05;
// Densities are compared as sqrt(n D^2 + this): where no disk is, the root's slope stays finite.
constexpr double least_density = 0.01;

bool is_density(std::size_t number) { return number >= observables().size(); }

double number_of(const InferOptions& options, const RunBed& bed, std::size_t view, std::size_t number) {
  return to_scale(number, bed.numbers[view * options.bed.numbers() + number]);
}

std::string name_of_numbers(const std::vector<std::size_t>& numbers) {
  return is_density(numbers.front()) ? "profile" : std::string(observables()[numbers.front()].name);
}

// Of the difference between a target and the prediction, but for the target's further error.
double variance_of(double variance, double scatter, const ScaledTarget& target) {
  return variance - scatter + std::max(scatter, target.least_scatter * target.least_scatter);
}

// Beds at points of the unit cube of their region.
struct PlacedBeds {
  const std::vector<RunBed>& beds;
  std::vector<std::vector<double>> points;
};

// Beds and what the views gave; beds where one is missing are left out.
fit::Surrogate trained(const InferOptions& options, const PlacedBeds& placed, const std::vector<std::size_t>& numbers,
                       const std::vector<std::size_t>& views, std::vector<std::size_t>& rows) {
  const std::vector<RunBed>& beds = placed.beds;
  fit::TrainingSet set;
  set.parameters = options.dimensions(), set.outputs = views.size() * numbers.size();
  rows.clear();
  for (std::size_t i = 0; i < beds.size(); ++i) {
    std::vector<double> row;
    for (const std::size_t view : views)
      for (const std::size_t number : numbers) row.push_back(number_of(options, beds[i], view, number));
    if (!std::all_of(row.begin(), row.end(), [](double x) { return std::isfinite(x); })) continue;
    rows.push_back(i);
    set.values.insert(set.values.end(), row.begin(), row.end());
    set.points.insert(set.points.end(), placed.points[i].begin(), placed.points[i].end());
  }
  try {
    return fit::Surrogate::train(set);
  } catch (const std::invalid_argument& error) {
    throw StageError(name_of_numbers(numbers) + ": " + error.what() + " (beds whose fit failed are not counted)");
  }
}

}  // namespace

double to_scale(std::size_t number, double value) {
  if (is_density(number)) return std::sqrt(std::max(value, 0.0) + least_density);  // NaN stays NaN: a bed without one
  if (!observables()[number].logarithmic) return value;
  return value > 0 ? std::log(value) : NAN;
}
double from_scale(std::size_t number, double value) {
  if (is_density(number)) return value * value - least_density;
  return observables()[number].logarithmic ? std::exp(value) : value;
}
double slope_of_scale(std::size_t number, double value) {
  if (is_density(number)) return 0.5 / std::sqrt(std::max(0.0, value) + least_density);
  return observables()[number].logarithmic ? 1 / value : 1;
}

std::vector<double> values_at(const InferOptions& options, std::span<const double> places) {
  std::vector<double> out;
  for (std::size_t k = 0; k < options.dimensions(); ++k) out.push_back(options.parameters[k].second.value(places[k]));
  return out;
}

bool Region::holds(std::span<const double> place) const {
  for (std::size_t k = 0; k < low.size(); ++k)
    if (place[k] < low[k] || place[k] > high[k]) return false;
  return true;
}
std::vector<double> Region::place(std::span<const double> of_region) const {
  std::vector<double> out(of_region.begin(), of_region.end());
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = low[i % low.size()] + out[i] * (high[i % low.size()] - low[i % low.size()]);
  return out;
}
double Region::volume() const {
  double out = 1;
  for (std::size_t k = 0; k < low.size(); ++k) out *= high[k] - low[k];
  return out;
}

BedSurrogate::BedSurrogate(const InferOptions& options, const std::vector<RunBed>& beds,
                           const std::vector<ScaledTarget>& targets, const Training& training)
    : options_(options) {
  for (std::size_t k = 0; k < options.dimensions(); ++k) {
    const UnknownParameter& parameter = options.parameters[k].second;
    low_.push_back(parameter.coordinate(parameter.value(training.region.low[k])));
    range_.push_back(std::max(1e-9, parameter.coordinate(parameter.value(training.region.high[k])) - low_.back()));
  }
  for (std::size_t o = 0; o < observables().size(); ++o) models_.emplace_back().numbers = {o};
  if (!options.bed.heights.empty()) {
    std::vector<std::size_t>& heights = models_.emplace_back().numbers;
    for (std::size_t h = observables().size(); h < options.bed.numbers(); ++h) heights.push_back(h);
  }
  leave_out_views(beds, targets);
  train(beds, targets, training);
  correlate(beds, targets);
}

// Views at which too few beds gave the targets have no prior.
void BedSurrogate::leave_out_views(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets) {
  for (const View& view : options_.bed.views) prior_.push_back(view.prior);
  for (const ScaledTarget& target : targets) {
    for (std::size_t v = 1; v < prior_.size(); ++v) {
      const auto missing = std::count_if(beds.begin(), beds.end(), [&](const RunBed& bed) {
        return !std::isfinite(number_of(options_, bed, v, target.number));
      });
      if (static_cast<double>(missing) > most_missing * static_cast<double>(beds.size())) prior_[v] = 0;
    }
  }
  double sum = 0;
  for (const double one : prior_) sum += one;
  if (!(sum > 0))
    throw StageError(
        "at the phase of the photographs the fit of the profile fails for too many simulated beds. Measure longer "
        "(\"measure\"), or give another \"phase\"");
  for (double& one : prior_) one /= sum;
}

void BedSurrogate::train(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets,
                         const Training& training) {
  std::vector<std::size_t> moments;
  for (std::size_t v = 1; v < prior_.size(); ++v)
    if (prior_[v] > 0) moments.push_back(v);
  PlacedBeds placed{beds, {}};
  for (const RunBed& bed : beds) {
    std::vector<double> point;
    for (std::size_t k = 0; k < options_.dimensions(); ++k)
      point.push_back(options_.parameters[k].second.coordinate(bed.values[k]));
    placed.points.push_back(scaled(std::move(point)));
  }
  for_each_index(2 * models_.size(), training.threads, [&](std::size_t i) {
    Model& model = models_[i / 2];
    const bool wanted = std::any_of(targets.begin(), targets.end(),
                                    [&](const ScaledTarget& t) { return &model_of(t.number) == &model; });
    if (i % 2 == 0) {
      if (wanted || training.every_number)
        model.average.emplace(trained(options_, placed, model.numbers, {0}, model.rows));
    } else if (wanted && !moments.empty()) {
      model.views = moments;
      model.moments.emplace(trained(options_, placed, model.numbers, moments, model.moment_rows));
    }
  });
}

std::optional<std::size_t> BedSurrogate::output_of(std::size_t number, std::size_t view) const {
  if (view == 0) return offset_of(number);
  const Model& model = model_of(number);
  const auto place = std::find(model.views.begin(), model.views.end(), view);
  if (place == model.views.end()) return std::nullopt;
  return static_cast<std::size_t>(place - model.views.begin()) * model.numbers.size() + offset_of(number);
}

// How the scatter of the targets goes together, view by view: what is left of each bed when the others predict it.
void BedSurrogate::correlate(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets) {
  for (std::size_t v = 0; v < prior_.size(); ++v) {
    std::vector<double> table(beds.size() * targets.size(), NAN);
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const auto output = output_of(targets[t].number, v);
      if (!output) continue;
      const Model& model = model_of(targets[t].number);
      const fit::Surrogate& surrogate = v == 0 ? *model.average : *model.moments;
      const std::vector<std::size_t>& rows = v == 0 ? model.rows : model.moment_rows;
      for (std::size_t r = 0; r < rows.size(); ++r)
        table[rows[r] * targets.size() + t] = surrogate.left_out()[r * surrogate.outputs() + *output];
    }
    std::vector<double> complete;
    for (std::size_t i = 0; i < beds.size(); ++i) {
      const auto row = table.begin() + static_cast<std::ptrdiff_t>(i * targets.size());
      const auto end = row + static_cast<std::ptrdiff_t>(targets.size());
      if (std::all_of(row, end, [](double x) { return std::isfinite(x); })) complete.insert(complete.end(), row, end);
    }
    correlated_.emplace_back(targets.size(), fit::correlation_of(targets.size(), complete));
    correlated_beds_.push_back(complete.size() / targets.size());
  }
}

std::vector<double> BedSurrogate::scaled(std::vector<double> coordinates) const {
  for (std::size_t i = 0; i < coordinates.size(); ++i)
    coordinates[i] = (coordinates[i] - low_[i % low_.size()]) / range_[i % low_.size()];
  return coordinates;
}

std::vector<double> BedSurrogate::coordinates(std::span<const double> places) const {
  const std::size_t d = options_.dimensions();
  std::vector<double> out(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const UnknownParameter& parameter = options_.parameters[i % d].second;
    out[i] = parameter.coordinate(parameter.value(places[i]));
  }
  return scaled(std::move(out));
}

std::vector<double> BedSurrogate::average(std::size_t observable, std::span<const double> places) const {
  return models_[observable].average->predict(coordinates(places)).mean;
}

BedSurrogate::Fit BedSurrogate::fit(std::span<const double> places, const std::vector<ScaledTarget>& targets) const {
  const std::size_t points = places.size() / options_.dimensions(), views = prior_.size(), n = targets.size();
  const std::vector<double> at = coordinates(places);
  std::vector<Prediction> predictions(models_.size());
  for (const ScaledTarget& target : targets) {
    const Model& model = model_of(target.number);
    Prediction& own = predictions[static_cast<std::size_t>(&model - models_.data())];
    if (prior_[0] > 0 && own.average.mean.empty()) own.average = model.average->predict(at);
    if (model.moments && own.moments.mean.empty()) own.moments = model.moments->predict(at);
  }
  Fit out{std::vector<double>(points * views, -INFINITY), std::vector<double>(points * views, INFINITY)};
  std::vector<double> off(n), deviation(n), error(n);
  for (std::size_t v = 0; v < views; ++v) {
    if (!(prior_[v] > 0)) continue;
    for (std::size_t i = 0; i < points; ++i) {
      for (std::size_t t = 0; t < n; ++t) {
        const ScaledTarget& target = targets[t];
        const Model& model = model_of(target.number);
        const Prediction& own = predictions[static_cast<std::size_t>(&model - models_.data())];
        const fit::Surrogate::Prediction& prediction = v == 0 ? own.average : own.moments;
        const std::size_t outputs = prediction.mean.size() / points;
        const std::size_t cell = i * outputs + *output_of(target.number, v);
        off[t] = target.value - prediction.mean[cell];
        deviation[t] = std::sqrt(variance_of(prediction.variance[cell], prediction.scatter[cell], target));
        error[t] = target.further_error;
      }
      const fit::Discrepancy found = correlated_[v](off, deviation, error);
      out.chi2[i * views + v] = found.chi2;
      out.log_likelihood[i * views + v] = fit::log_likelihood(found, {correlated_beds_[v], n, options_.dimensions()});
    }
  }
  return out;
}

sim::Measured BedSurrogate::predicted(std::span<const double> place, std::size_t view, std::size_t number) const {
  const auto output = output_of(number, view);
  if (!output) return {NAN, NAN};
  const Model& model = model_of(number);
  const auto all = (view == 0 ? *model.average : *model.moments).predict(coordinates(place));
  return {all.mean[*output], std::sqrt(all.variance[*output])};
}

std::vector<sim::Measured> BedSurrogate::profile(std::span<const double> place, std::size_t view) const {
  const Model& model = models_.back();
  const auto all = (view == 0 ? *model.average : *model.moments).predict(coordinates(place));
  const std::size_t first = *output_of(model.numbers.front(), view);
  std::vector<sim::Measured> out;
  for (std::size_t i = first; i < first + model.numbers.size(); ++i)
    out.push_back({all.mean[i], std::sqrt(all.variance[i])});
  return out;
}

std::array<double, 2> BedSurrogate::within(std::size_t number) const {
  const fit::Surrogate& surrogate = *model_of(number).average;
  const std::vector<double>& left_out = surrogate.left_out();
  const std::size_t runs = left_out.size() / surrogate.outputs();
  std::array<double, 2> out{};
  for (std::size_t r = 0; r < runs; ++r) {
    const double off = std::abs(left_out[r * surrogate.outputs() + offset_of(number)]);
    for (std::size_t k = 0; k < 2; ++k) out[k] += (off < static_cast<double>(k + 1)) / static_cast<double>(runs);
  }
  return out;
}

}  // namespace shakebed::pipelines
