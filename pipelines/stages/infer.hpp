// infer: what measured numbers say of a bed's parameters. Beds all over the prior give a surrogate (fit/inference), the
// surrogate a posterior; where the posterior is, further beds are run and the surrogate is made again.
//
// Files: infer.json, beds.csv (every bed), posterior.csv (draws), marginals.csv, best.csv and, where asked for,
// calibration.csv; pairs.svg; beds.json, from which the stage goes on without running its beds again ("stored").
#pragma once

#include <array>
#include <memory>

#include "fit/inference/posterior.hpp"
#include "fit/inference/surrogate.hpp"
#include "pipelines/stages/infer_bed.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/statistics.hpp"

namespace shakebed::pipelines {

struct InferTarget {
  double value = 0, std_error = 0;  // as written: lengths in m, reduced in D
  std::string at;                   // or where a stage in "from" has it
  bool includes_scatter = false;    // whether the error has the scatter of a bed's numbers
};

// A measured profile as a target: its density at heights that are equally far apart.
struct ProfileTarget {
  std::string from;                       // a stage in "from"; or
  InputFiles file;                        // a table of a profile
  std::string table = "profile.csv";      // of the stage
  double low = 0, high = 0, spacing = 1;  // heights [D]
  bool includes_scatter = true;
  std::vector<double> heights() const;
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
  std::optional<ProfileTarget> profile;
  std::uint32_t moments = 0;
  double average = 0.5;
  std::optional<double> phase;
  std::uint32_t first = 160, rounds = 2, each = 60;
  std::uint32_t part = 1, parts = 1;  // of the first round, which other runs share
  std::uint32_t best = 3, replicas = 4;
  double best_measure = 0;  // as written; 0: as the others
  std::uint32_t draws = 1000, calibration = 0;
  std::optional<MapCurve> curve;
  std::string stored;
  InputFiles beds;  // beds.json of earlier runs
  bool uses_earlier_beds() const { return !stored.empty() || !beds.empty(); }
  std::size_t dimensions() const { return parameters.size(); }
  // Of the beds of the first round, the number of the first of part k, and so one past the last of part k - 1.
  std::uint32_t begin_of(std::uint32_t k) const {
    return static_cast<std::uint32_t>(std::uint64_t{first} * (k - 1) / parts);
  }
};

// A bed that was run: where, in which round, and its numbers, view by view.
struct RunBed {
  std::uint32_t round = 0;
  std::vector<double> values, numbers;
};

// A target on the scale on which it is compared, see to_scale(). Its difference from a bed's number scatters as beds
// do, at least by `least_scatter`, and has a further error.
struct ScaledTarget {
  std::size_t number = 0;  // of those of a view
  double value = 0, error = 0;
  double least_scatter = 0, further_error = 0;
};

std::string unit_of(const InferOptions& options, const Observable& observable);
void describe_targets(Fields& fields, InferOptions& options);
// Throws InputError where a stage or a file does not give what is asked for.
std::vector<ScaledTarget> scaled_targets(const RunContext& context, const InferOptions& options);

// A box in the unit cube of the parameters.
struct Region {
  std::vector<double> low, high;
  bool holds(std::span<const double> place) const;
  std::vector<double> place(std::span<const double> of_region) const;  // of points of the region's own unit cube
  double volume() const;
};

// The surrogates of all numbers that targets and proposals need. Densities at all heights share one.
class BedSurrogate {
 public:
  // `region`: where the beds are, the unit of its lengths; `every_number`: also those that no target has, for
  // proposals.
  struct Training {
    Region region;
    bool every_number = false;
    int threads = 1;
  };
  BedSurrogate(const InferOptions& options, const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets,
               const Training& training);

  // Means of an observable, averaged over the shaking, at points of the unit cube, on its scale.
  std::vector<double> average(std::size_t observable, std::span<const double> places) const;
  // Natural logarithm of the probability of the targets at each point and view, without the prior of the view; and
  // chi2.
  struct Fit {
    std::vector<double> log_likelihood, chi2;  // point by point, view by view
  };
  Fit fit(std::span<const double> places, const std::vector<ScaledTarget>& targets) const;
  // Mean and standard deviation of a number of one further bed, at one point and view.
  sim::Measured predicted(std::span<const double> place, std::size_t view, std::size_t number) const;
  // The same of the densities at all heights of the profile.
  std::vector<sim::Measured> profile(std::span<const double> place, std::size_t view) const;
  double view_prior(std::size_t view) const { return prior_[view]; }  // 0 where too few fits succeed
  // Between beds with the same parameters.
  double scatter(std::size_t number) const { return model_of(number).average->scatter(offset_of(number)); }
  // Shares of the beds that lie within one and two standard deviations of what the others say.
  std::array<double, 2> within(std::size_t number) const;
  std::size_t beds(std::size_t number) const { return model_of(number).rows.size(); }

 private:
  // Of one observable, or of the densities at all heights.
  struct Model {
    std::vector<std::size_t> numbers;
    std::optional<fit::Surrogate> average, moments;
    std::vector<std::size_t> rows, moment_rows, views;  // the beds that each is made from; views of `moments`
  };
  // What one model predicts at several points.
  struct Prediction {
    fit::Surrogate::Prediction average, moments;
  };
  const Model& model_of(std::size_t number) const { return models_[std::min(number, observables().size())]; }
  static std::size_t offset_of(std::size_t number) { return number - std::min(number, observables().size()); }
  // The place of a number among the outputs of its model; nothing where the view was left out.
  std::optional<std::size_t> output_of(std::size_t number, std::size_t view) const;
  std::vector<double> scaled(std::vector<double> coordinates) const;
  std::vector<double> coordinates(std::span<const double> places) const;
  void leave_out_views(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets);
  void train(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets, const Training& training);
  void correlate(const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets);

  const InferOptions& options_;
  std::vector<double> low_, range_;                // of the region, by parameter, in coordinates
  std::vector<Model> models_;                      // by observable; then that of the profile
  std::vector<double> prior_;                      // by view
  std::vector<fit::CorrelatedErrors> correlated_;  // by view
  std::vector<std::size_t> correlated_beds_;       // behind each
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

// A posterior and the surrogates that give it: of all beds, and of those where the posterior is (every number).
struct KnownParameters {
  std::shared_ptr<const BedSurrogate> all, near;
  Region region;  // of `near`
  std::size_t beds_near = 0;
  fit::Posterior posterior;  // in the unit cube of the whole prior
};
// `of_all`: the surrogate of all beds for targets of the same numbers, where there is one.
KnownParameters known_parameters(const RunContext& context, const InferOptions& options,
                                 const std::vector<RunBed>& beds, const std::vector<ScaledTarget>& targets,
                                 std::shared_ptr<const BedSurrogate> of_all = nullptr);

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
void write_inference(RunContext& context, const InferOptions& options, const KnownParameters& known,
                     const Inference& found);
void draw_pairs(RunContext& context, const InferOptions& options, const Inference& found);
StagePages infer_pages();

// The scale on which numbers are compared, and its slope. It is the logarithm where the scatter is a part of the value.
// Densities have a root, since the scatter of a count grows as its root.
double to_scale(std::size_t number, double value);
double from_scale(std::size_t number, double value);
double slope_of_scale(std::size_t number, double value);
// The parameters at a point of the unit cube.
std::vector<double> values_at(const InferOptions& options, std::span<const double> places);

}  // namespace shakebed::pipelines
