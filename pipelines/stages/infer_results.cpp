// implements: pipelines/stages/infer.hpp
// infer.json and its tables.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fit/profile_fit/chances.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/stages/infer.hpp"

namespace shakebed::pipelines {

namespace {

constexpr int marginal_bins = 24;  // of a marginal distribution
constexpr int rank_bins = 10;      // of the ranks of a calibration
// "No bed" is said from three standard deviations on.
constexpr double enough_deviations = 3;

std::string unit_of(const UnknownParameter& parameter) { return parameter.unit.empty() ? "1" : parameter.unit; }
std::string column_of(const InferOptions& options, const Observable& observable) {
  return std::string(observable.name) + (observable.is_length && !options.bed.reduced ? "_m" : "");
}
std::string column_of(const std::string& name, const UnknownParameter& parameter) {
  return name + (parameter.unit.empty() ? "" : "_" + parameter.unit);
}

std::vector<StatedColumn> parameter_columns(const InferOptions& options) {
  std::vector<StatedColumn> out;
  for (const auto& [name, parameter] : options.parameters)
    out.push_back({column_of(name, parameter), unit_of(parameter),
                   parameter.is_choice() ? "number of the value in its list, from 0" : "parameter of the bed"});
  return out;
}
std::vector<StatedColumn> observable_columns(const InferOptions& options) {
  std::vector<StatedColumn> out;
  for (const Observable& observable : observables())
    out.push_back({column_of(options, observable), unit_of(options, observable), std::string(observable.meaning)});
  return out;
}

// Mean and standard deviation.
sim::Measured moments_of(const std::vector<double>& values, const std::vector<double>& weights) {
  double mean = 0, square = 0;
  for (std::size_t i = 0; i < values.size(); ++i) mean += weights[i] * values[i];
  for (std::size_t i = 0; i < values.size(); ++i) square += weights[i] * std::pow(values[i] - mean, 2);
  return {mean, std::sqrt(square)};
}

class ResultsOfInference {
 public:
  ResultsOfInference(RunContext& context, const InferOptions& options, const KnownParameters& known,
                     const Inference& found)
      : context_(context), options_(options), known_(known), surrogate_(*known.near), found_(found) {
    const fit::Posterior& posterior = found.posterior;
    values_.resize(options.dimensions());
    for (std::size_t i = 0; i < posterior.size(); ++i) {
      for (std::size_t k = 0; k < options.dimensions(); ++k)
        values_[k].push_back(options.parameters[k].second.value(std::clamp(posterior.point(i)[k], 0.0, 1.0)));
    }
  }

  void write() {
    Json out;
    out["beds"] = found_.beds.size();
    out["effective_samples"] = found_.posterior.effective;
    out["log_evidence"] = {
        {"value", found_.posterior.log_evidence}, {"std_error", found_.posterior.log_evidence_error}, {"unit", "1"}};
    out["parameters"] = parameters();
    out["photographs"] = photographs();
    const Json best_beds = best();
    out["agreement"] = agreement(best_beds);
    out["assumed"] = assumed();
    out["best"] = best_beds;
    out["narrowing"] = narrowing();
    out["surrogate"] = surrogates();
    if (options_.calibration > 0) out["calibration"] = calibration();
    write_beds(), write_posterior(), write_marginals();
    if (options_.profile) write_profile();
    write_file(context_.output("infer.json"), dump(out));
  }

 private:
  const std::vector<double>& weight() const { return found_.posterior.weight; }

  Json parameters() const {
    Json out = Json::object();
    for (std::size_t k = 0; k < options_.dimensions(); ++k) {
      const auto& [name, parameter] = options_.parameters[k];
      const auto quantile = [&](double chance) { return fit::weighted_quantile(values_[k], weight(), chance); };
      const sim::Measured mean = moments_of(values_[k], weight());
      Json row = quantity_json(mean.value, unit_of(parameter), mean.std_error);
      row["median"] = quantile(0.5);
      row["low_68"] = quantile(0.16), row["high_68"] = quantile(0.84);
      row["low_95"] = quantile(0.025), row["high_95"] = quantile(0.975);
      row["prior_low"] = parameter.is_choice() ? 0 : parameter.low;
      row["prior_high"] = parameter.is_choice() ? static_cast<double>(parameter.values.size() - 1) : parameter.high;
      // Over the prior's: 1 where nothing was learnt.
      std::vector<double> prior;
      for (int i = 0; i < 1000; ++i) prior.push_back(parameter.value((i + 0.5) / 1000));
      row["width_over_prior"] = mean.std_error / moments_of(prior, std::vector<double>(1000, 1e-3)).std_error;
      row["why"] = parameter.why;
      out[name] = std::move(row);
    }
    return out;
  }

  Json photographs() const {
    Json out = Json::array();
    for (std::size_t v = 0; v < options_.bed.views.size(); ++v)
      out.push_back(Json{{"show", options_.bed.views[v].name},
                         {"prior", surrogate_.view_prior(v)},
                         {"posterior", found_.view_weight[v]}});
    return out;
  }

  // Whether any bed gives what was measured.
  Json agreement(const Json& best_beds) const {
    const std::size_t dof = found_.targets.size(), views = options_.bed.views.size();
    double least = INFINITY, predictive = 0;
    for (std::size_t i = 0; i < weight().size(); ++i) {
      if (!(weight()[i] > 0)) continue;
      for (std::size_t v = 0; v < views; ++v) {
        const double chi2 = found_.fit.chi2[i * views + v];
        least = std::min(least, chi2);
        const double share = surrogate_.view_prior(v) *
                             std::exp(found_.fit.log_likelihood[i * views + v] - found_.posterior.log_likelihood[i]);
        if (share > 0) predictive += weight()[i] * share * fit::chance_of_chi2(chi2, static_cast<int>(dof));
      }
    }
    const double chance = fit::chance_of_chi2(least, static_cast<int>(dof)), deviations = fit::as_deviations(chance);
    const bool some = deviations < enough_deviations;
    Json out{{"least_chi2", least}, {"numbers", dof}, {"chance", chance}, {"deviations", deviations}};
    out["predictive_p"] = predictive;
    out["some_bed_agrees"] = some;
    out["statement"] = "";
    const auto agree = std::count_if(best_beds.begin(), best_beds.end(), [](const Json& bed) {
      const Json& most = bed.at("largest_difference_in_errors");
      return most.is_number() && most.get<double>() < enough_deviations;
    });
    out["beds_run_again_that_agree"] = agree;
    std::string& statement = out["statement"].get_ref<std::string&>();
    statement = some ? fmt::format(
                           "According to the surrogate, some beds within these ranges agree with all {} numbers: the "
                           "nearest has chi2 = {:.2g}, p = {:.2g} (chance of a larger chi2).",
                           dof, least, chance)
                     : fmt::format(
                           "According to the surrogate, no bed within these ranges agrees with all {} numbers: the "
                           "nearest has chi2 = {:.3g}, which is {:.1f} standard deviations off.",
                           dof, least, deviations);
    if (!best_beds.empty())
      statement += fmt::format(
          " Of the {} most probable beds, which were run again, {} agree with every number within {:g} standard "
          "errors.",
          best_beds.size(), agree, enough_deviations);
    return out;
  }

  // Of one further bed: how far it is from the target, in errors of both.
  static double difference(const ScaledTarget& target, const sim::Measured& at) {
    return (at.value - target.value) / std::hypot(std::max(at.std_error, target.least_scatter), target.further_error);
  }

  // `at`: on the scale of comparison, target by target.
  Json target_rows(const std::vector<sim::Measured>& at) const {
    Json out = Json::object();
    double largest = 0;
    for (std::size_t t = 0; t < found_.targets.size(); ++t) {
      const ScaledTarget& target = found_.targets[t];
      const double off = difference(target, at[t]);
      if (target.number >= observables().size()) {
        largest = std::isfinite(off) ? std::max(largest, std::abs(off)) : INFINITY;
        continue;
      }
      const Observable& observable = observables()[target.number];
      const double value = from_scale(target.number, at[t].value), measured = from_scale(target.number, target.value);
      Json row =
          quantity_json(value, unit_of(options_, observable), at[t].std_error / slope_of_scale(target.number, value));
      row["measured"] = measured;
      row["measured_error"] = target.error / slope_of_scale(target.number, measured);
      row["difference_in_errors"] = off;
      out[std::string(observable.name)] = std::move(row);
    }
    if (options_.profile)
      out["profile"] = Json{{"heights", options_.bed.heights.size()}, {"largest_difference_in_errors", largest}};
    return out;
  }

  // The scene as it is written in the recipe, by the surrogate; nothing where it lies outside of the prior.
  Json assumed() const {
    std::vector<double> place;
    Json values = Json::object();
    for (const auto& [name, parameter] : options_.parameters) {
      const std::optional<double> value = parameter.in_scene(options_.bed.scene);
      if (!value) return nullptr;
      values[name] = *value;
      place.push_back(parameter.place(*value));
    }
    const BedSurrogate& surrogate = known_.region.holds(place) ? *known_.near : *known_.all;
    const BedSurrogate::Fit fit = surrogate.fit(place, found_.targets);
    std::vector<sim::Measured> at;
    for (const ScaledTarget& target : found_.targets) at.push_back(surrogate.predicted(place, 0, target.number));
    Json out{{"values", std::move(values)}, {"targets", target_rows(at)}};
    if (surrogate.view_prior(0) > 0) {
      const double chance = fit::chance_of_chi2(fit.chi2[0], static_cast<int>(found_.targets.size()));
      out["chi2"] = fit.chi2[0], out["deviations"] = fit::as_deviations(chance);
    }
    return out;
  }

  // The best beds run again: their numbers against the targets, with the scatter of one bed as the error.
  Json best() {
    std::vector<Cell> cells;
    Table table = context_.table("best.csv");
    Json out = Json::array();
    const std::size_t count = options_.bed.numbers();
    for (std::size_t b = 0; b < found_.best.size(); ++b) {
      const BestBed& bed = found_.best[b];
      const View& view = options_.bed.views[bed.view];
      Json row;
      row["photographs"] = view.name;
      for (std::size_t k = 0; k < options_.dimensions(); ++k)
        row["values"][options_.parameters[k].first] = bed.values[k];
      std::vector<sim::Measured> at;
      double most = 0;
      for (const ScaledTarget& target : found_.targets) {
        std::vector<double> runs;
        for (const std::vector<double>& run : bed.runs)
          runs.push_back(to_scale(target.number, run[bed.view * count + target.number]));
        const auto n = static_cast<double>(runs.size());
        const sim::Measured own = moments_of(runs, std::vector<double>(runs.size(), 1 / n));
        at.push_back({own.value, own.std_error * std::sqrt(n / (n - 1))});
        const double off = std::abs(difference(target, at.back()));
        most = std::isfinite(off) ? std::max(most, off) : INFINITY;
      }
      row["targets"] = target_rows(at);
      row["largest_difference_in_errors"] = most;
      for (std::size_t r = 0; r < bed.runs.size(); ++r) {
        cells = {count_cell(b + 1), count_cell(r), view.name};
        cells.insert(cells.end(), bed.values.begin(), bed.values.end());
        for (std::size_t o = 0; o < observables().size(); ++o) cells.emplace_back(bed.runs[r][bed.view * count + o]);
        table.add(cells);
      }
      out.push_back(std::move(row));
    }
    table.write(context_.output("best.csv"));
    return out;
  }

  // Which further measurement would take most of the parameters' variance away, on average over the parameters.
  Json narrowing() const {
    std::vector<std::pair<double, Json>> rows;
    const fit::Posterior& posterior = found_.posterior;
    std::vector<double> places = posterior.points;
    for (double& one : places) one = std::clamp(one, 0.0, 1.0);
    const std::size_t d = options_.dimensions();
    const auto add = [&](const std::string& name, const std::string& meaning, const std::vector<double>& prediction,
                         double variance, std::size_t but) {
      double sum = 0;
      Json each = Json::object();
      for (std::size_t k = 0; k < d; ++k) {
        if (k == but) continue;
        const double part = fit::expected_reduction(values_[k], prediction, weight(), variance);
        each[options_.parameters[k].first] = part;
        sum += part;
      }
      const double mean = d > 1 || but >= d ? sum / static_cast<double>(but < d ? d - 1 : d) : 1;
      rows.emplace_back(
          -mean,
          Json{{"measurement", name}, {"meaning", meaning}, {"reduction", mean}, {"parameters", std::move(each)}});
    };
    for (std::size_t o = 0; o < observables().size(); ++o) {
      add(std::string(observables()[o].name),
          std::string(observables()[o].meaning) + ", averaged over the shaking, of one bed",
          surrogate_.average(o, places), surrogate_.scatter(o) * surrogate_.scatter(o), d);
    }
    for (std::size_t k = 0; k < d; ++k)
      add(options_.parameters[k].first, "the parameter itself; given is its effect on the other parameters", values_[k],
          0, k);
    std::stable_sort(rows.begin(), rows.end(), [](const auto& l, const auto& r) { return l.first < r.first; });
    Json out = Json::array();
    for (auto& [ignored, row] : rows) out.push_back(std::move(row));
    return out;
  }

  Json surrogates() const {
    Json out = Json::object();
    for (std::size_t o = 0; o < observables().size(); ++o) {
      const auto [one, two] = surrogate_.within(o);
      out[std::string(observables()[o].name)] =
          Json{{"beds", surrogate_.beds(o)},
               {"scatter", surrogate_.scatter(o)},
               {"scatter_is", observables()[o].logarithmic ? "relative" : "in the number's unit"},
               {"within_1", one},
               {"within_2", two}};
    }
    return out;
  }

  Json calibration() const {
    Table table = context_.table("calibration.csv");
    Json out, each = Json::object();
    double all = 0, in_68 = 0, in_95 = 0;
    for (std::size_t k = 0; k < options_.dimensions(); ++k) {
      double n = 0, own_68 = 0, own_95 = 0;
      std::vector<double> histogram(rank_bins, 0);
      for (const CalibrationRow& row : found_.calibration) {
        if (row.parameter != k) continue;
        n += 1;
        own_68 += row.low_68 <= row.truth && row.truth <= row.high_68;
        own_95 += row.low_95 <= row.truth && row.truth <= row.high_95;
        histogram[static_cast<std::size_t>(std::min(rank_bins - 1, static_cast<int>(row.rank * rank_bins)))] += 1;
      }
      double chi2 = 0;
      for (const double count : histogram) chi2 += std::pow(count - n / rank_bins, 2) / (n / rank_bins);
      each[options_.parameters[k].first] = Json{{"within_68", own_68 / n},
                                                {"within_95", own_95 / n},
                                                {"rank_chi2_p", fit::chance_of_chi2(chi2, rank_bins - 1)}};
      all += n, in_68 += own_68, in_95 += own_95;
    }
    for (const CalibrationRow& row : found_.calibration)
      table.add({count_cell(row.bed), options_.parameters[row.parameter].first, row.truth, row.low_68, row.high_68,
                 row.low_95, row.high_95, row.rank});
    table.write(context_.output("calibration.csv"));
    out["beds"] = all / static_cast<double>(options_.dimensions());
    out["within_68"] = in_68 / all, out["within_95"] = in_95 / all;
    out["parameters"] = std::move(each);
    return out;
  }

  void write_beds() const {
    Table table = context_.table("beds.csv");
    const std::size_t count = options_.bed.numbers();
    for (std::size_t b = 0; b < found_.beds.size(); ++b) {
      const RunBed& bed = found_.beds[b];
      for (std::size_t v = 0; v < options_.bed.views.size(); ++v) {
        std::vector<Cell> cells{count_cell(b + 1), count_cell(bed.round), options_.bed.views[v].name};
        cells.insert(cells.end(), bed.values.begin(), bed.values.end());
        for (std::size_t o = 0; o < observables().size(); ++o) cells.emplace_back(bed.numbers[v * count + o]);
        table.add(cells);
      }
    }
    table.write(context_.output("beds.csv"));
  }

  void write_posterior() const {
    Table table = context_.table("posterior.csv");
    for (std::size_t r = 0; r < found_.draws.size(); ++r) {
      const std::size_t i = found_.draws[r], v = found_.draw_views[r];
      std::vector<Cell> cells;
      for (const std::vector<double>& of_parameter : values_) cells.emplace_back(of_parameter[i]);
      cells.emplace_back(options_.bed.views[v].name);
      cells.emplace_back(found_.fit.chi2[i * options_.bed.views.size() + v]);
      table.add(cells);
    }
    table.write(context_.output("posterior.csv"));
  }

  void write_marginals() const {
    Table table = context_.table("marginals.csv");
    for (std::size_t k = 0; k < options_.dimensions(); ++k) {
      const auto& [name, parameter] = options_.parameters[k];
      const int bins = parameter.is_choice() ? static_cast<int>(parameter.values.size()) : marginal_bins;
      const double low = parameter.is_choice() ? -0.5 : parameter.low;
      const double width = parameter.is_choice() ? 1 : (parameter.high - parameter.low) / bins;
      std::vector<double> density(static_cast<std::size_t>(bins), 0);
      for (std::size_t i = 0; i < weight().size(); ++i)
        density[static_cast<std::size_t>(std::clamp(static_cast<int>((values_[k][i] - low) / width), 0, bins - 1))] +=
            weight()[i] / width;
      for (int b = 0; b < bins; ++b) table.add({name, low + (b + 0.5) * width, density[static_cast<std::size_t>(b)]});
    }
    table.write(context_.output("marginals.csv"));
  }

  // The measured densities beside those of further beds, drawn from the posterior.
  void write_profile() const {
    const std::size_t first = observables().size(), count = options_.bed.heights.size();
    const auto n = static_cast<double>(found_.draws.size());
    std::vector<double> mean(count, 0), square(count, 0);
    for (std::size_t r = 0; r < found_.draws.size(); ++r) {
      const auto point = found_.posterior.point(found_.draws[r]);
      std::vector<double> place(point.begin(), point.end());
      for (double& one : place) one = std::clamp(one, 0.0, 1.0);
      const std::vector<sim::Measured> densities = surrogate_.profile(place, found_.draw_views[r]);
      for (std::size_t i = 0; i < count; ++i) {
        mean[i] += densities[i].value / n;
        square[i] += (std::pow(densities[i].value, 2) + std::pow(densities[i].std_error, 2)) / n;
      }
    }
    Table table = context_.table("profile.csv");
    for (const ScaledTarget& target : found_.targets) {
      if (target.number < first) continue;
      const std::size_t i = target.number - first;
      const double measured = from_scale(target.number, target.value), predicted = from_scale(target.number, mean[i]);
      table.add({options_.bed.heights[i], measured, target.error / slope_of_scale(target.number, measured), predicted,
                 std::sqrt(std::max(0.0, square[i] - mean[i] * mean[i])) / slope_of_scale(target.number, predicted)});
    }
    table.write(context_.output("profile.csv"));
  }

  RunContext& context_;
  const InferOptions& options_;
  const KnownParameters& known_;
  const BedSurrogate& surrogate_;  // of the beds where the posterior is
  const Inference& found_;
  std::vector<std::vector<double>> values_;  // by parameter, of every point
};

}  // namespace

void write_inference(RunContext& context, const InferOptions& options, const KnownParameters& known,
                     const Inference& found) {
  ResultsOfInference(context, options, known, found).write();
}

namespace {

void state_targets(ResultList& list, const InferOptions& options, const std::string& below, const Given& given) {
  for (std::size_t o = 0; o < options.targets.size(); ++o) {
    if (!options.targets[o]) continue;
    const Observable& observable = observables()[o];
    const std::string unit = unit_of(options, observable), at = below + "/targets/" + std::string(observable.name);
    list.quantity(at, unit, std::string(observable.meaning) + "; the error is the scatter of one bed", given, true);
    list.number(at + "/measured", unit, "measured number (the target)", given);
    list.number(at + "/measured_error", unit, "standard error of the measured number", given);
    list.number(at + "/difference_in_errors", "1", "difference from the measured number, over the error of both", given,
                true);
  }
  if (!options.profile) return;
  list.number(below + "/targets/profile/heights", "1", "number of heights at which densities are compared", given);
  list.number(below + "/targets/profile/largest_difference_in_errors", "1",
              "largest difference from a measured density, over the error of both", given, true);
}

void state_tables(ResultList& list, const InferOptions& options) {
  const auto with = [](std::vector<StatedColumn> a, const std::vector<StatedColumn>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  const std::vector<StatedColumn> numbers = observable_columns(options), parameters = parameter_columns(options);
  const StatedColumn view{"photographs", "", "whether the photographs show the average over the shaking or one phase"};
  list.table({"beds.csv", "all beds that were run",
              with(with({{"bed", "1", "number of the bed"},
                         {"round", "1",
                          "number of the round; 0: spread over the prior, later: in the region of the posterior"},
                         view},
                        parameters),
                   numbers)});
  list.table({"posterior.csv", "draws from the posterior, with equal weights",
              with(parameters, {view, {"chi2", "1", "chi-square of the targets"}})});
  std::vector<std::string> names;
  for (const auto& [name, ignored] : options.parameters) names.push_back(name);
  list.table({"marginals.csv",
              "posterior density of each parameter",
              {{"parameter", "", "name of the parameter", names},
               {"value", "1", "middle of a bin, in the parameter's unit"},
               {"density", "1", "posterior density, over the parameter's unit"}}});
  list.table({"best.csv", "the runs of the most probable beds",
              with(with({{"bed", "1", "number of the bed"}, {"replica", "1", "number of the run"}, view}, parameters),
                   numbers)});
  list.table({"calibration.csv",
              "inference of beds with known parameters",
              {{"bed", "1", "number of the bed"},
               {"parameter", "", "name of the parameter", names},
               {"truth", "1", "true value, in the unit of the parameter"},
               {"low_68", "1", "lower end of the interval of 68 %"},
               {"high_68", "1", "upper end of the interval of 68 %"},
               {"low_95", "1", "lower end of the interval of 95 %"},
               {"high_95", "1", "upper end of the interval of 95 %"},
               {"rank", "1", "share of the posterior below the true value"}},
              given_if(options.calibration > 0, "\"calibration\" is above 0")});
  list.table({"profile.csv",
              "measured densities beside those of the posterior",
              {{"height", "D", "height above the floor"},
               {"measured", "1/D^2", "measured density (the target)"},
               {"measured_error", "1/D^2", "standard error of the measured density"},
               {"predicted", "1/D^2", "density of a further bed, mean over the posterior"},
               {"predicted_error", "1/D^2", "standard deviation of that density over the posterior and between beds"}},
              given_if(options.profile.has_value(), "a profile is a target")});
}

}  // namespace

namespace {

void state_parameters(ResultList& list, const InferOptions& options) {
  for (const auto& [name, parameter] : options.parameters) {
    const std::string at = pointer_join("/parameters", name), unit = unit_of(parameter);
    list.quantity(at, unit, "mean and standard deviation of the posterior");
    for (const auto& [key, meaning] : {std::pair{"/median", "median"},
                                       {"/low_68", "lower end of the interval of 68 %"},
                                       {"/high_68", "upper end of the interval of 68 %"},
                                       {"/low_95", "lower end of the interval of 95 %"},
                                       {"/high_95", "upper end of the interval of 95 %"},
                                       {"/prior_low", "least value of the prior"},
                                       {"/prior_high", "greatest value of the prior"}})
      list.number(at + key, unit, meaning);
    list.number(at + "/width_over_prior", "1", "standard deviation of the posterior over that of the prior");
    list.text(at + "/why", "reason for this prior");
  }
}

void state_agreement(ResultList& list) {
  list.number("/agreement/least_chi2", "1",
              "chi-square of the nearest bed; errors include that of the surrogate and the scatter between beds");
  list.number("/agreement/numbers", "1", "number of targets");
  list.number("/agreement/chance", "1",
              "probability of a chi-square at least this large, if the nearest bed is the true one");
  list.number("/agreement/deviations", "1", "probability of chi-square as a number of standard deviations");
  list.number("/agreement/predictive_p", "1", "probability of chi-square, averaged over the posterior");
  list.truth("/agreement/some_bed_agrees", "whether the nearest bed is within three standard deviations");
  list.number("/agreement/beds_run_again_that_agree", "1",
              "number of the beds run again that lie within three standard errors of every target");
  list.text("/agreement/statement", "agreement in words");
}

void state_beds(ResultList& list, const InferOptions& options) {
  const Given inside = given_when("the scene as written lies within the prior");
  for (const auto& [name, parameter] : options.parameters)
    list.number(pointer_join("/assumed/values", name), unit_of(parameter),
                "value of the parameter in the scene as written", inside);
  state_targets(list, options, "/assumed", inside);
  list.number("/assumed/chi2", "1", "chi-square of the targets, if the photographs show the average", inside);
  list.number("/assumed/deviations", "1", "probability of chi-square as a number of standard deviations", inside);
  const Given best = given_if(options.best > 0, "\"best\" is above 0");
  list.text("/best/#/photographs", "whether the photographs show the average over the shaking or one phase", best);
  for (const auto& [name, parameter] : options.parameters)
    list.number(pointer_join("/best/#/values", name), unit_of(parameter),
                "value of the parameter in a most probable bed", best);
  state_targets(list, options, "/best/#", best);
  list.number("/best/#/largest_difference_in_errors", "1", "largest difference from a target, in standard errors", best,
              true);
}

void state_narrowing(ResultList& list, const InferOptions& options) {
  list.text("/narrowing/#/measurement", "name of a further measurement");
  list.text("/narrowing/#/meaning", "meaning of the further measurement");
  list.number("/narrowing/#/reduction", "1",
              "mean share of the variance of the parameters that this measurement would remove");
  for (const auto& [name, ignored] : options.parameters)
    list.number(pointer_join("/narrowing/#/parameters", name), "1",
                "share of the variance of this parameter that the measurement would remove",
                given_when("the measurement is not the parameter itself"));
}

void state_surrogate(ResultList& list) {
  for (const Observable& observable : observables()) {
    const std::string at = "/surrogate/" + std::string(observable.name);
    list.number(at + "/beds", "1", "number of beds in which this number could be measured");
    list.number(at + "/scatter", "1", "standard deviation between beds with the same parameters");
    list.text(at + "/scatter_is", "whether the scatter is relative or in the unit of the number");
    list.number(at + "/within_1", "1",
                "share of the beds within one standard deviation of the prediction from the others");
    list.number(at + "/within_2", "1",
                "share of the beds within two standard deviations of the prediction from the others");
  }
}

void state_calibration(ResultList& list, const InferOptions& options) {
  const Given calibrated = given_if(options.calibration > 0, "\"calibration\" is above 0");
  list.number("/calibration/beds", "1", "number of beds with known parameters", calibrated);
  list.number("/calibration/within_68", "1", "share of the 68 % intervals that contain the true value", calibrated);
  list.number("/calibration/within_95", "1", "share of the 95 % intervals that contain the true value", calibrated);
  for (const auto& [name, ignored] : options.parameters) {
    const std::string at = pointer_join("/calibration/parameters", name);
    list.number(at + "/within_68", "1", "share of the 68 % intervals of this parameter that contain the true value",
                calibrated);
    list.number(at + "/within_95", "1", "share of the 95 % intervals of this parameter that contain the true value",
                calibrated);
    list.number(at + "/rank_chi2_p", "1", "probability that uniformly distributed ranks are at least as uneven",
                calibrated);
  }
}

}  // namespace

void state_inference(ResultList& list, const InferOptions& options) {
  list.number("/beds", "1", "number of beds on which the surrogate is based");
  list.number("/effective_samples", "1",
              "effective number of independent draws of the weighted points of the posterior");
  list.quantity("/log_evidence", "1", "natural logarithm of the mean likelihood over the prior");
  state_parameters(list, options);
  list.text("/photographs/#/show", "what the photographs show: the average over the shaking, or one phase of it");
  list.number("/photographs/#/prior", "1", "prior probability that the photographs show this");
  list.number("/photographs/#/posterior", "1", "posterior probability that the photographs show this");
  state_agreement(list);
  state_beds(list, options);
  state_narrowing(list, options);
  state_surrogate(list);
  state_calibration(list, options);
  state_tables(list, options);
}

}  // namespace shakebed::pipelines
