// implements: pipelines/stages/infer.hpp
// The surrogates of an inference: a model for each number that is compared, of the average over the shaking and of its
// single moments.
#include <algorithm>
#include <cmath>
#include <map>

#include "pipelines/stages/infer.hpp"
#include "statistics/parallel.hpp"

namespace shakebed::pipelines {

namespace {

// A moment of the shaking at which more of the fits than this fail is left out.
constexpr double most_missing = 0.05;

double number_of(const RunBed& bed, std::size_t view, std::size_t observable) {
  return to_scale(observable, bed.numbers[view * observables().size() + observable]);
}

// Beds and what the views gave; beds where one is missing are left out.
fit::Surrogate trained(const InferOptions& options, const std::vector<RunBed>& beds, std::size_t observable,
                       const std::vector<std::size_t>& views, std::vector<std::size_t>& rows) {
  fit::TrainingSet set;
  set.parameters = options.dimensions(), set.outputs = views.size();
  rows.clear();
  for (std::size_t i = 0; i < beds.size(); ++i) {
    std::vector<double> numbers;
    for (const std::size_t view : views) numbers.push_back(number_of(beds[i], view, observable));
    if (!std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); })) continue;
    rows.push_back(i);
    set.values.insert(set.values.end(), numbers.begin(), numbers.end());
    for (std::size_t k = 0; k < set.parameters; ++k)
      set.points.push_back(options.parameters[k].second.coordinate(beds[i].values[k]));
  }
  try {
    return fit::Surrogate::train(set);
  } catch (const std::invalid_argument& error) {
    throw StageError(std::string(observables()[observable].name) + ": " + error.what() +
                     " (beds whose fit failed are not counted)");
  }
}

}  // namespace

double to_scale(std::size_t observable, double value) {
  if (!observables()[observable].logarithmic) return value;
  return value > 0 ? std::log(value) : NAN;
}
double from_scale(std::size_t observable, double value) {
  return observables()[observable].logarithmic ? std::exp(value) : value;
}

std::vector<double> values_at(const InferOptions& options, std::span<const double> places) {
  std::vector<double> out;
  for (std::size_t k = 0; k < options.dimensions(); ++k) out.push_back(options.parameters[k].second.value(places[k]));
  return out;
}

BedSurrogate::BedSurrogate(const InferOptions& options, const std::vector<RunBed>& beds,
                           const std::vector<ScaledTarget>& targets, int threads)
    : options_(options), models_(observables().size()) {
  const std::vector<View>& views = options.bed.views;
  for (const View& view : views) prior_.push_back(view.prior);
  for (const ScaledTarget& target : targets) {
    for (std::size_t v = 1; v < views.size(); ++v) {
      const auto missing = std::count_if(beds.begin(), beds.end(), [&](const RunBed& bed) {
        return !std::isfinite(number_of(bed, v, target.observable));
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
  std::vector<std::size_t> moments;
  for (std::size_t v = 1; v < views.size(); ++v)
    if (prior_[v] > 0) moments.push_back(v);
  for_each_index(2 * models_.size(), threads, [&](std::size_t i) {
    const std::size_t observable = i / 2;
    Model& model = models_[observable];
    const bool wanted =
        std::any_of(targets.begin(), targets.end(), [&](const ScaledTarget& t) { return t.observable == observable; });
    if (i % 2 == 0) {
      model.average.emplace(trained(options, beds, observable, {0}, model.rows));
    } else if (wanted && !moments.empty()) {
      model.views = moments;
      model.moments.emplace(trained(options, beds, observable, moments, model.moment_rows));
    }
  });
  correlate(beds, targets);
}

// How the scatter of the targets goes together, view by view: what is left of each bed when the others predict it.
void BedSurrogate::correlate(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets) {
  for (std::size_t v = 0; v < options_.bed.views.size(); ++v) {
    std::vector<double> table(beds.size() * targets.size(), NAN);
    for (std::size_t t = 0; t < targets.size(); ++t) {
      const Model& model = models_[targets[t].observable];
      const auto place = std::find(model.views.begin(), model.views.end(), v);
      if (v > 0 && place == model.views.end()) continue;
      const fit::Surrogate& surrogate = v == 0 ? *model.average : *model.moments;
      const std::vector<std::size_t>& rows = v == 0 ? model.rows : model.moment_rows;
      const std::size_t column = v == 0 ? 0 : static_cast<std::size_t>(place - model.views.begin());
      for (std::size_t r = 0; r < rows.size(); ++r)
        table[rows[r] * targets.size() + t] = surrogate.left_out()[r * surrogate.outputs() + column];
    }
    std::vector<double> complete;
    for (std::size_t i = 0; i < beds.size(); ++i) {
      const auto row = table.begin() + static_cast<std::ptrdiff_t>(i * targets.size());
      const auto end = row + static_cast<std::ptrdiff_t>(targets.size());
      if (std::all_of(row, end, [](double x) { return std::isfinite(x); })) complete.insert(complete.end(), row, end);
    }
    correlated_.emplace_back(targets.size(), fit::correlation_of(targets.size(), complete));
  }
}

std::vector<double> BedSurrogate::coordinates(std::span<const double> places) const {
  const std::size_t d = options_.dimensions();
  std::vector<double> out(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    const UnknownParameter& parameter = options_.parameters[i % d].second;
    out[i] = parameter.coordinate(parameter.value(places[i]));
  }
  return out;
}

fit::Surrogate::Prediction BedSurrogate::average(std::size_t observable, std::span<const double> places) const {
  return models_[observable].average->predict(coordinates(places));
}

BedSurrogate::Fit BedSurrogate::fit(std::span<const double> places, const std::vector<ScaledTarget>& targets) const {
  const std::size_t points = places.size() / options_.dimensions(), views = prior_.size(), n = targets.size();
  const std::vector<double> at = coordinates(places);
  std::vector<fit::Surrogate::Prediction> average, moments;
  for (const ScaledTarget& target : targets) {
    const Model& model = models_[target.observable];
    average.push_back(prior_[0] > 0 ? model.average->predict(at) : fit::Surrogate::Prediction{});
    moments.push_back(model.moments ? model.moments->predict(at) : fit::Surrogate::Prediction{});
  }
  Fit out{std::vector<double>(points * views, -INFINITY), std::vector<double>(points * views, INFINITY)};
  std::vector<double> off(n), deviation(n), error(n);
  for (std::size_t v = 0; v < views; ++v) {
    if (!(prior_[v] > 0)) continue;
    for (std::size_t i = 0; i < points; ++i) {
      for (std::size_t t = 0; t < n; ++t) {
        const Model& model = models_[targets[t].observable];
        const auto column =
            static_cast<std::size_t>(std::find(model.views.begin(), model.views.end(), v) - model.views.begin());
        const fit::Surrogate::Prediction& prediction = v == 0 ? average[t] : moments[t];
        const std::size_t cell = v == 0 ? i : i * model.views.size() + column;
        off[t] = targets[t].value - prediction.mean[cell];
        deviation[t] = std::sqrt(prediction.variance[cell]), error[t] = targets[t].error;
      }
      const fit::Discrepancy found = correlated_[v](off, deviation, error);
      out.chi2[i * views + v] = found.chi2;
      out.log_likelihood[i * views + v] = -0.5 * (found.chi2 + found.log_determinant);
    }
  }
  return out;
}

sim::Measured BedSurrogate::predicted(std::span<const double> place, std::size_t view, std::size_t observable) const {
  const Model& model = models_[observable];
  const auto found = std::find(model.views.begin(), model.views.end(), view);
  if (view == 0 || found == model.views.end()) {
    if (view != 0) return {NAN, NAN};
    const auto one = average(observable, place);
    return {one.mean[0], std::sqrt(one.variance[0])};
  }
  const auto all = model.moments->predict(coordinates(place));
  const auto column = static_cast<std::size_t>(found - model.views.begin());
  return {all.mean[column], std::sqrt(all.variance[column])};
}

std::array<double, 2> BedSurrogate::within(std::size_t observable) const {
  const std::vector<double>& left_out = models_[observable].average->left_out();
  std::array<double, 2> out{};
  for (std::size_t k = 0; k < 2; ++k)
    out[k] = static_cast<double>(std::count_if(left_out.begin(), left_out.end(),
                                               [&](double e) { return std::abs(e) < static_cast<double>(k + 1); })) /
             static_cast<double>(left_out.size());
  return out;
}

}  // namespace shakebed::pipelines
