#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/theory/equation_of_state.hpp"
#include "statistics/kernel.hpp"

// From a measured density profile to temperature, solid height and plateau density.
//
// The headline fit has the temperature T and the shift free and the plateau density phi_0 fixed (2/sqrt 3 in
// equilibrium, 1.10 for the published experiment). True disks are not an Enskog fluid, so T depends on the window of
// the fit. The result therefore holds the window, the rule that chose it, and the temperature against the window.
//
// Nothing here throws on data. Whatever is wrong with the profile comes back as a status and a sentence.
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

// A measured profile. Heights in D above the floor's mean position, densities n D^2.
struct Profile {
  std::vector<double> height;          // bin centres [D]
  std::vector<double> number_density;  // [1/D^2]
  std::vector<double> std_error;       // of the densities; empty: not known (see FitResult::errors_scaled)
  std::vector<double> covariance;      // of the densities, row-major n x n; empty: diagonal from std_error
  // Independent samples (frames) behind `covariance`, 0 if not known. The inverse of an estimated covariance is biased;
  // with this known it is corrected by (m - n - 2)/(m - 1) [Hartlap2007].
  int covariance_samples = 0;
};

// Which bins are used.
struct WindowOptions {
  // An explicit window, bin centres in [low, high]. Where absent, the rule:
  //   low:  the lowest height at which the profile averaged over one diameter reaches `plateau_fraction` of its
  //         maximum. It is not below base + floor_exclusion + the kernel's reach (at most 3 D of reach counts). So
  //         floor layering and the thinned region over a moving floor stay out.
  //   high: the last bin, going up, before the density first falls too low: below `lowest_fraction` of its maximum,
  //         or below `lowest_significance` standard errors.
  std::optional<double> low{};
  std::optional<double> high{};
  // The tail only: low is the first height, going up, above which the density averaged over one diameter stays below
  // this [1/D^2]. With 0.6 the Enskog curve has no bias on true disks in the local-density picture (the whole profile:
  // -15 %).
  std::optional<double> below_density{};
  double floor_exclusion = 1.5;  // [D]
  double plateau_fraction = 0.95;
  double lowest_fraction = 0.005;
  double lowest_significance = 4.0;
};

struct FitOptions {
  // "enskog-rectangle": the paper's curve: Enskog tail over a rectangle of phi_0;
  // "hydrostatic:<equation of state>": the whole column of that equation, N D/W conserved;
  // "fermi", "rectangle": for comparison.
  std::string model = "enskog-rectangle";

  double plateau_density = close_packing_density;  // phi_0, or where its search starts when free
  bool plateau_density_free = false;
  std::optional<double> fixed_temperature{};  // [m g D]
  std::optional<double> fixed_shift{};        // [D]

  // N D/W where it is known. It decides T_c and is checked against the area under the profile; with constrain_column
  // it also ties the shift to the temperature (sum rule). The hydrostatic models hold it fixed whenever it is given.
  std::optional<double> column_number{};
  bool constrain_column = false;
  double base = 0.0;  // lower edge of the bed [D]; 0.5 - sqrt(3)/4 = 0.067 for a hexagonal bed on a flat floor

  Kernel kernel{};  // what the profile was measured through
  WindowOptions window{};

  // Huber's loss: residuals beyond `robust_threshold` standard errors count linearly. [Huber1964] Bins then weigh by
  // their own errors even where there is a covariance, through which the error of T still comes.
  bool robust = false;
  double robust_threshold = 1.345;

  // The model may miss the data by more than their errors allow (chance below 0.1 %). A systematic error is then added,
  // equal for every bin and so large that chi2/dof = 1. Without it all errors are enlarged by one factor. The bins of a
  // crystal, whose errors are the smallest, then determine the temperature, although no equation of state describes
  // them. Example: at 0.4 T_c a whole Enskog column then gives T 42 % too high instead of 5 %.
  bool model_error = true;
  // Lower bound of that error, for profiles that the model is known to miss, even where the data are too poor to show
  // it. Without it poor data would weight the bins differently from good data, and T would have another bias. [1/D^2]
  double least_model_error = 0.0;

  // Beyond the fit itself (each costs some more fits).
  bool interval = true;      // profile-likelihood interval of T
  double confidence = 0.95;  // of that interval
  bool sweep = true;         // T against window
  bool compare = true;       // other models, and phi_0 free, beside this one
  int curve_points = 200;    // of the sampled model curve; 0: none
  int max_iterations = 100;

  // Why no profile can be fitted with these options, a sentence each; empty when one can.
  [[nodiscard]] std::vector<std::string> validate() const;
};

enum class FitStatus {
  ok,
  not_converged,           // the iteration stopped without a minimum
  bad_input,               // lengths differ, NaN, negative errors, unknown model, ...: see message
  too_few_bins,            // fewer bins in the window than free parameters + 1
  no_signal,               // no positive density
  no_tail,                 // the profile does not fall: the temperature is undetermined
  unresolved_temperature,  // the tail is sharper than bins and kernel can tell: only an upper bound (interval)
  undefined_model,         // the equation of state has a pole or no value at this phi_0
  unreadable,              // of an answer: something speaks against any temperature (answer.hpp)
};
std::string_view to_string(FitStatus status);

struct Estimate {
  double value = 0.0;
  double std_error = 0.0;  // 0 for a fixed number
  bool fixed = false;
};

struct Interval {
  FitStatus status = FitStatus::not_converged;  // ok when both ends were found
  double low = 0.0, high = 0.0;
  double confidence = 0.0;
  bool low_open = false, high_open = false;  // that end lies beyond what the data limit
};

struct WindowFit {  // a row of "temperature against window"
  double low = 0.0, high = 0.0;
  int bins = 0;
  FitStatus status = FitStatus::not_converged;
  Estimate temperature, shift;
  double chi2_per_dof = 0.0;
};

struct ModelFit {  // a row of the model comparison
  std::string model;
  bool plateau_density_free = false;
  FitStatus status = FitStatus::not_converged;
  Estimate temperature, shift, plateau_density;
  int parameters = 0;
  double chi2 = 0.0, chi2_per_dof = 0.0, aic = 0.0, bic = 0.0;
};

struct CurvePoint {
  double height = 0.0;
  double density = 0.0;           // the bare model
  double smoothed_density = 0.0;  // through the kernel: what is compared with the data
};

struct Residual {
  double height = 0.0, density = 0.0, std_error = 0.0, model = 0.0;
  bool used = false;  // inside the window
};

struct FitResult {
  FitStatus status = FitStatus::not_converged;
  std::string message;  // one sentence saying why, when not ok
  std::string model;

  Estimate temperature;           // T [m g D]
  Estimate shift;                 // where the tail reaches phi_0 [D above the floor]
  Estimate solid_height;          // zeta_F = shift - base, 0 when there is no solid [D]
  Estimate plateau_density;       // phi_0
  Estimate column_number;         // N D/W: the given one (fixed) or the area under the fitted curve
  Estimate critical_temperature;  // T_c [m g D] of column_number and phi_0; valid where critical_status is ok
  Estimate reduced_temperature;   // T/T_c
  ValueStatus critical_status = ValueStatus::outside_range;
  // The fit's zeta_F against the sum rule's: (N D/W - T mu_0)/phi_0 with this T. [D]
  double solid_height_by_sum_rule = 0.0;

  std::vector<std::string> parameters;  // names of the free parameters, the order of `covariance`
  std::vector<double> covariance;       // row-major
  // No errors were given, or the model does not describe the data: the errors below come from the scatter about the
  // curve, by model_error or else multiplied by sqrt(chi2/dof).
  bool errors_scaled = false;
  double model_error = 0.0;  // of every bin, beside its own error; 0 for none [1/D^2]
  // The part of temperature.std_error that the measured errors make: how far the same fit of another measurement would
  // be. The rest, in quadrature, is the model's misfit, which other measurements share. [m g D]
  double statistical_error = 0.0;

  double chi2 = 0.0;  // the least, by the measured errors alone; so are the numbers that follow
  int dof = 0;
  double chi2_per_dof = 0.0;
  double p_value = 0.0;  // chance of a chi2 at least as large, were the model true and the errors right
  bool misfit = false;   // the model does not describe the data: that chance is below 1e-3
  double aic = 0.0, bic = 0.0;
  int iterations = 0;
  int evaluations = 0;  // of the model

  double window_low = 0.0, window_high = 0.0;  // centres of the first and last bin used [D]
  int bins = 0;
  std::string window_rule;  // in words
  Kernel kernel{};

  Interval temperature_interval;
  // Of T by the statistical error alone: where the same fit of further beds lies, on average.
  Interval next_bed_interval;
  std::vector<WindowFit> window_sweep;
  std::vector<ModelFit> model_comparison;  // the first row is the fit itself
  std::vector<CurvePoint> curve;
  std::vector<Residual> residuals;    // every bin given, sorted by height
  double area = 0.0;                  // integral of the measured density [1/D]
  std::vector<std::string> warnings;  // plain sentences

  [[nodiscard]] bool ok() const { return status == FitStatus::ok; }
  [[nodiscard]] bool has_solid() const { return solid_height.value > 0.0; }
  [[nodiscard]] std::string brief() const;  // one line
  [[nodiscard]] std::string full() const;   // a line a number, then the warnings
};

FitResult fit_profile(const Profile& profile, const FitOptions& options = {});

// A model's curve for given numbers, as fit_profile would draw it (through options.kernel). `column_number` is used by
// the hydrostatic models, `shift` by the others. Status undefined_model or bad_input where there is no curve.
struct ModelCurve {
  FitStatus status = FitStatus::ok;
  std::vector<double> densities;
};
ModelCurve evaluate_model(const FitOptions& options, double temperature, double shift, double plateau_density,
                          double column_number, std::span<const double> heights);

// Many snapshots of one profile: frames x bins, row-major.
struct ProfileFrames {
  std::vector<double> height;
  std::vector<double> number_density;  // frame by frame
  [[nodiscard]] std::size_t frames() const { return height.empty() ? 0 : number_density.size() / height.size(); }
};
// Mean, errors and full covariance of the mean of frames that follow one another in time. By windows of three
// correlation times of the area-weighted height [Sokal1997], but short enough for six of them. The status is bad_input
// with fewer than 2 frames or when the sizes disagree.
struct FrameAverage {
  FitStatus status = FitStatus::ok;
  std::string message;
  int window = 1;  // frames
  Profile profile;
};
FrameAverage average_frames(const ProfileFrames& frames);

// Bootstrap over windows of frames [Shao2010]: refits the mean moved by normal multiples of what each window is from
// it, so that the resamples have the covariance of average_frames(). Bins are weighed by the scatter of single frames.
// Intervals are those of as few independent samples as there are (Student).
struct BootstrapOptions {
  int resamples = 200;
  std::uint64_t seed = 1;
  double confidence = 0.95;
};
struct BootstrapResult {
  FitStatus status = FitStatus::ok;
  std::string message;
  int window = 1;     // frames
  int succeeded = 0;  // of the resamples
  Estimate temperature, shift;
  Interval temperature_interval, shift_interval;  // from percentiles
  std::vector<double> temperatures;               // sorted
};
BootstrapResult bootstrap_fit(const ProfileFrames& frames, const FitOptions& options,
                              const BootstrapOptions& bootstrap);

}  // namespace shakebed::fit
