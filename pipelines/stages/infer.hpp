// infer: what measured numbers say of a bed's parameters. Beds all over the prior give a surrogate (fit/inference), the
// surrogate a posterior; where the posterior is, further beds are run and the surrogate is made again.
//
// Files: infer.json, beds.csv (every bed), posterior.csv (draws), marginals.csv, best.csv and, where asked for,
// calibration.csv; pairs.svg; beds.json, from which the stage goes on without running its beds again ("stored").
#pragma once

#include <array>

#include "fit/inference/posterior.hpp"
#include "fit/inference/surrogate.hpp"
#include "pipelines/stages/infer_bed.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::pipelines {

struct InferTarget {
  double value = 0, std_error = 0;  // as written: lengths in m, reduced in D
  std::string at;                   // or where a stage in "from" has it
};

// A curve Gamma(f) in the picture: where a formula of the stage map gives a reduced temperature.
struct MapCurve {
  double reduced_temperature = 0;
  std::string reading, label;
};

struct InferOptions {
  BedOfInference bed;
  SceneOptions written;  // the scene as it stands in the recipe
  Parameters parameters;
  std::vector<std::optional<InferTarget>> targets;  // by observable
  std::uint32_t moments = 0;
  double average = 0.5;
  std::optional<double> phase;
  std::uint32_t first = 160, rounds = 2, each = 60;
  std::uint32_t best = 3, replicas = 4;
  double best_measure = 0;  // as written; 0: as the others
  std::uint32_t draws = 1000, calibration = 0;
  std::optional<MapCurve> curve;
  std::string stored;
  std::size_t dimensions() const { return parameters.size(); }
};

// A bed that was run: where, in which round, and its numbers, view by view.
struct RunBed {
  std::uint32_t round = 0;
  std::vector<double> values, numbers;
};

// A target on the scale on which it is compared: the logarithm where the scatter is a part of the value.
struct ScaledTarget {
  std::size_t observable = 0;
  double value = 0, error = 0;
};

// The surrogates of all observables that targets and proposals need.
class BedSurrogate {
 public:
  BedSurrogate(const InferOptions& options, const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets,
               int threads);

  // Of a number at points of the unit cube, on its scale.
  fit::Surrogate::Prediction average(std::size_t observable, std::span<const double> places) const;
  // Natural logarithm of the probability of the targets at each point and view, without the prior of the view; and
  // chi2.
  struct Fit {
    std::vector<double> log_likelihood, chi2;  // point by point, view by view
  };
  Fit fit(std::span<const double> places, const std::vector<ScaledTarget>& targets) const;
  // Mean and standard deviation of a target at one point and view.
  sim::Measured predicted(std::span<const double> place, std::size_t view, std::size_t observable) const;
  double view_prior(std::size_t view) const { return prior_[view]; }  // 0 where too few fits succeed
  double scatter(std::size_t observable) const { return models_.at(observable).average->scatter(0); }
  // Shares of the beds that lie within one and two standard deviations of what the others say.
  std::array<double, 2> within(std::size_t observable) const;
  std::size_t beds(std::size_t observable) const { return models_.at(observable).rows.size(); }

 private:
  struct Model {
    std::optional<fit::Surrogate> average, moments;
    std::vector<std::size_t> rows, moment_rows, views;  // the beds that each is made from; views of `moments`
  };
  std::vector<double> coordinates(std::span<const double> places) const;
  void correlate(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets);

  const InferOptions& options_;
  std::vector<Model> models_;                      // by observable
  std::vector<double> prior_;                      // by view
  std::vector<fit::CorrelatedErrors> correlated_;  // by view
};

struct BestBed {
  std::vector<double> values;
  std::size_t view = 0;
  std::vector<std::vector<double>> runs;  // numbers, view by view
};
struct CalibrationRow {
  std::size_t bed = 0, parameter = 0;
  double truth = 0, low_68 = 0, high_68 = 0, low_95 = 0, high_95 = 0, rank = 0;
};

// All that was found, for infer_results.cpp.
struct Inference {
  std::vector<ScaledTarget> targets;
  std::vector<RunBed> beds;
  fit::Posterior posterior;
  BedSurrogate::Fit fit;            // at the posterior's points
  std::vector<double> view_weight;  // by view
  std::vector<std::size_t> draws, draw_views;
  std::vector<BestBed> best;
  std::vector<CalibrationRow> calibration;
};
void state_inference(ResultList& list, const InferOptions& options);
void write_inference(RunContext& context, const InferOptions& options, const BedSurrogate& surrogate,
                     const Inference& found);
void draw_pairs(RunContext& context, const InferOptions& options, const Inference& found);
StagePages infer_pages();

// On the scale of comparison.
double to_scale(std::size_t observable, double value);
double from_scale(std::size_t observable, double value);
// The parameters at a point of the unit cube.
std::vector<double> values_at(const InferOptions& options, std::span<const double> places);

}  // namespace shakebed::pipelines
