#include "fit/profile_fit/answer.hpp"

#include <gsl/gsl_cdf.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "fit/profile_fit/measured_profile.hpp"
#include "fit/profile_fit/objections.hpp"
#include "fit/profile_fit/row_blur.hpp"
#include "fit/profile_fit/side_walls.hpp"
#include "fit/profile_fit/thermometers.hpp"
#include "fit/theory/equation_of_state.hpp"
#include "statistics/rest.hpp"

namespace shakebed::fit {

namespace {

// Temperatures that differ by less than this part of the smaller are one.
constexpr double same_temperature = 0.20;
// A difference counts from so many standard errors on; between the kinetic T_x and T_z, whose own errors come from
// fewer samples, from two.
constexpr double significant = 3.0, significant_kinetic = 2.0;
// A reading checks the answer where its uncertainty is below this part of it.
constexpr double admissible_uncertainty = 0.15;
// A model fits that misses the densities by up to so many times what it misses on equilibrium beds.
constexpr double admissible_misfit = 2.0;
// What is known of the misfit is of beds whose windows hold this density and more. Where a window holds less, a model
// may miss less by the square of it: else a tail over a uniform background, as false disks make, or a sum of two
// exponentials passes for a hot gas. [1/D^2]
constexpr double usual_density = 0.5;
// The misfit that is known of beds without a crystal: none that matters. Below, a model misses the densities by so much
// more; weights hold it also where the data are too poor to show it, as they do in the beds from which the biases are
// known. Else 60 photographs gave T 2 % lower, between 1 and 2 T_c, than all of the same beds' densities. A thin gas is
// missed by less: the models' second virial coefficient is exact, so their error falls at least as the density squared.
// [1/D^2]
constexpr double misfit_of_fluids = 0.005;
// The root mean square modulation of the density by a crystal's rows, seen through no window: sqrt(2) 2/sqrt(3) for
// rows that are thin [1/D^2]. Where the window leaves some of it, a model without rows misses as much.
constexpr double row_modulation = 1.633;
// A thermometer is preferred to one before it in the list where its scatter is less than this part of the other's.
constexpr double clearly_less = 0.8;
// An interval whose ends differ by more than this factor does not determine T. One that reaches farther from T than
// this in ln T, a factor of twenty, does not even bound it.
constexpr double widest_factor = 2.0, widest_interval = 3.0;
// A profile alone does not tell a lower T from none at all: the surface of a bed at rest is uneven by a layer of disks.
// On 18 simulated beds at rest (240 and 500 disks, e 0.6 and 0.9, from rows and random fills) the whole column gave
// 0.04 to 0.10 [m g D].
constexpr double coldest_shown = 0.1;
// Of hard side walls, after what they take from the density was put back: one standard error of T, relative, times W/D.
// 56 beds in a bath, 10 to 40 D wide, beside the same beds with periodic sides: T of fluid ones was off by 0.09 to 0.16
// D/W (root mean square), that of beds denser than a fluid is by 0.6 to 0.9 D/W (walls keep a crystal from growing).
constexpr double wall_effect = 0.15, wall_effect_on_crystal = 0.8;
// Steps in which the known bias and the temperature at which it is looked up settle.
constexpr int bias_steps = 4;
// The tail on which the solid's height is read, given T: without bias on true disks (tests/fit/bias_test.cpp). [1/D^2]
constexpr double tail_density = 0.6;

std::string per_cent(double part) { return number(100.0 * part, 2) + " %"; }

// "37 %", "a factor of 8.4"; of the ratio of two temperatures less one.
std::string how_far(double ratio_less_one) {
  return ratio_less_one < 1 ? per_cent(ratio_less_one) : "a factor of " + number(1 + ratio_less_one, 2);
}

// Infinite where one of them is 0.
double ratio_above_one(double a, double b) { return std::max(a, b) / std::min(a, b) - 1.0; }

// The same profile by a diameter that is `factor` times as many pixels.
Profile scaled(Profile profile, double factor) {
  for (double& height : profile.height) height /= factor;
  for (double& density : profile.number_density) density *= factor * factor;
  for (double& error : profile.std_error) error *= factor * factor;
  for (double& covariance : profile.covariance) covariance *= std::pow(factor, 4);
  return profile;
}

// Without the part of the errors that all densities have in common by the scale (density.hpp): fits that take it for a
// part of the scatter around a curve prefer low densities.
Profile with_exact_scale(Profile profile, double scale_error) {
  const std::size_t n = profile.number_density.size();
  const auto common = [&](std::size_t a, std::size_t b) {
    return 4.0 * scale_error * scale_error * profile.number_density[a] * profile.number_density[b];
  };
  constexpr double least = 1e-4;  // of a variance, against rounding in a file
  if (profile.covariance.size() == n * n)
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b) {
        double& here = profile.covariance[a * n + b];
        here = a == b ? std::max(least * here, here - common(a, b)) : here - common(a, b);
      }
  for (std::size_t a = 0; a < std::min(n, profile.std_error.size()); ++a) {
    const double variance = profile.std_error[a] * profile.std_error[a];
    profile.std_error[a] = std::sqrt(std::max(least * variance, variance - common(a, a)));
  }
  return profile;
}

class AnswerFinder {
 public:
  explicit AnswerFinder(const AnswerInput& input)
      : input_(input), column_number_(input.column_number), seen_(blur_rows(input.profile, input.kernel, input.base)) {
    if (input.width_between_walls > 0.0) take_far_from_walls(seen_.profile, input.width_between_walls, column_number_);
  }

  Answer run() {
    answer_.temperature_x = input_.temperature_x;
    answer_.temperature_z = input_.temperature_z;
    if (!is_readable() || !read_thermometers()) return answer_;
    choose();
    compare_readings();
    judge();
    combine();
    advise();
    judge_interval();
    judge_surface();
    judge_shaking();
    find_next_bed_interval();
    find_solid_height();
    return answer_;
  }

 private:
  // False when something speaks against any temperature; the answer then says what.
  bool is_readable() {
    std::vector<Objection> all = input_.objections;
    const bool velocities = input_.temperature_x || input_.temperature_z;
    for (Objection& one : objections_to(seen_, column_number_, velocities)) all.push_back(std::move(one));
    if (all.empty()) return true;
    answer_.status = FitStatus::unreadable;
    for (const Objection& one : all) {
      answer_.why += (answer_.why.empty() ? "" : " ") + one.why;
      if (answer_.advice.find(one.advice) != std::string::npos) continue;  // two reasons, one cure
      answer_.advice += (answer_.advice.empty() ? "" : " ") + one.advice;
    }
    return false;
  }

  [[nodiscard]] FitOptions options_of(const Thermometer& thermometer) const {
    FitOptions options;
    options.model = thermometer.model;
    options.kernel = seen_.kernel;
    options.base = input_.base;
    if (thermometer.column_known) options.column_number = column_number_;
    options.window.floor_exclusion = thermometer.floor_exclusion;
    if (thermometer.below_density > 0.0) options.window.below_density = thermometer.below_density;
    options.confidence = input_.confidence;
    options.least_model_error = least_misfit_;
    options.interval = options.sweep = options.compare = false;
    options.curve_points = 0;
    return options;
  }

  // False when none gives a temperature; the answer then says why.
  bool read_thermometers() {
    if (const FitResult first = fit_profile(seen_.profile, options_of(thermometers().front())); first.ok()) {
      const double part = part_of_usual_density(first.window_low, first.window_high);
      least_misfit_ = std::max(0.0, part * part * (known_misfit(first.temperature.value) - misfit_of_fluids));
    }
    for (const Thermometer& thermometer : thermometers()) {
      if (thermometer.column_known && !column_number_) continue;
      const FitResult fit = fit_profile(seen_.profile, options_of(thermometer));
      ThermometerReading reading;
      reading.thermometer = thermometer.name;
      reading.model = thermometer.model;
      reading.status = fit.status;
      if (fit.ok()) {
        fill(reading, thermometer, fit);
        reading.admissible = thermometer.votes && reading.std_error <= admissible_uncertainty * reading.temperature;
      } else if (answer_.why.empty()) {
        answer_.status = fit.status;
        answer_.why = fit.message + (fit.message.ends_with('.') ? "" : ".");
      }
      answer_.readings.push_back(std::move(reading));
      votes_.push_back(&thermometer);
      if (fit.status == FitStatus::bad_input) {
        answer_.advice = "Correct the profile and fit it again.";
        return false;
      }
    }
    for (std::size_t i = 0; i < votes_.size(); ++i) {
      if (!votes_[i]->votes || answer_.readings[i].status != FitStatus::ok) continue;
      answer_.status = FitStatus::ok;
      answer_.why.clear();
      return true;
    }
    answer_.advice =
        "Check the profile: the density must fall from a plateau to zero over several heights. In a bed photographed "
        "from above it does not.";
    return false;
  }

  static void fill(ThermometerReading& reading, const Thermometer& thermometer, const FitResult& fit) {
    reading.fitted = fit.temperature;
    reading.statistical_error = fit.statistical_error;
    reading.chi2_per_dof = fit.chi2_per_dof;
    reading.model_error = fit.model_error;
    reading.window_low = fit.window_low;
    reading.window_high = fit.window_high;
    KnownBias bias;
    reading.temperature = fit.temperature.value;
    for (int step = 0; step < bias_steps; ++step) {
      bias = known_bias(thermometer, reading.temperature);
      reading.temperature = fit.temperature.value * std::exp(-bias.mean);
    }
    reading.bias = std::expm1(bias.mean);
    reading.bias_uncertainty = bias.scatter;
    reading.std_error =
        reading.temperature * std::hypot(fit.temperature.std_error / fit.temperature.value, bias.scatter);
  }

  // The one whose bias scatters least from bed to bed at the temperature that the first says.
  void choose() {
    double least = 0.0, temperature = 0.0;
    for (std::size_t i = 0; i < votes_.size(); ++i) {
      const ThermometerReading& reading = answer_.readings[i];
      if (!votes_[i]->votes || reading.status != FitStatus::ok) continue;
      if (temperature == 0.0) temperature = reading.temperature;
      const double scatter = known_bias(*votes_[i], temperature).scatter;
      if (chosen_ == nullptr || scatter < clearly_less * least) {
        chosen_ = &reading;
        least = scatter;
      }
    }
    answer_.thermometer = chosen_->thermometer;
    answer_.model = chosen_->model;
    answer_.temperature = chosen_->temperature;
    answer_.bias = chosen_->bias;
    const double all = chosen_->temperature * fit_error(*chosen_);
    answer_.statistical_error = chosen_->temperature * chosen_->statistical_error / chosen_->fitted.value;
    answer_.misfit_error = std::sqrt(std::max(0.0, all * all - answer_.statistical_error * answer_.statistical_error));
    answer_.bias_uncertainty = chosen_->temperature * chosen_->bias_uncertainty;
    without_scale_ = answer_.statistical_error;
    scale_uncertainty_ = chosen_->temperature * effect_of_scale();
    answer_.statistical_error = std::hypot(without_scale_, scale_uncertainty_);
  }

  // Relative: the larger of what T changes by with a scale that is an error smaller, and one that is an error larger.
  // Where the profile cannot be fitted with one of them, T is uncertain by a factor of e.
  [[nodiscard]] double effect_of_scale() const {
    if (!(input_.scale_error > 0.0)) return 0.0;
    const auto chosen = std::find_if(votes_.begin(), votes_.end(),
                                     [&](const Thermometer* one) { return one->name == answer_.thermometer; });
    double largest = 0.0;
    for (const double factor : {1.0 - input_.scale_error, 1.0 + input_.scale_error}) {  // of D in px
      FitOptions options = options_of(**chosen);
      if (options.column_number) *options.column_number *= factor;
      const FitResult fit = fit_profile(scaled(seen_.profile, factor), options);
      if (!fit.ok()) return 1.0;
      largest = std::max(largest, std::abs(std::log(fit.temperature.value / chosen_->fitted.value)));
    }
    return largest;
  }

  // Statistical and of the misfit, relative.
  static double fit_error(const ThermometerReading& reading) { return reading.fitted.std_error / reading.fitted.value; }

  // How far the admissible readings are from the chosen one, in ln T.
  void compare_readings() {
    double all = 0.0, beyond = 0.0;
    int count = 0;
    for (const ThermometerReading& reading : answer_.readings) {
      if (!reading.admissible || &reading == chosen_) continue;
      const double apart = std::log(reading.temperature / chosen_->temperature);
      const double expected =
          std::pow(reading.std_error / reading.temperature, 2) + std::pow(chosen_->std_error / chosen_->temperature, 2);
      all += apart * apart;
      beyond += std::max(0.0, apart * apart - expected);
      ++count;
      if (std::abs(apart) > std::log1p(same_temperature) && apart * apart > significant * significant * expected &&
          (farthest_ == nullptr || std::abs(apart) > std::abs(std::log(farthest_->temperature / chosen_->temperature))))
        farthest_ = &reading;
    }
    if (count == 0) return;
    spread_of_all_ = std::sqrt(all / count);
    spread_beyond_ = std::sqrt(beyond / count);
    compared_ = distinct_fits() - 1;
  }

  // Thermometers with the same model on the same heights are one fit.
  [[nodiscard]] int distinct_fits() const {
    const auto same = [](const ThermometerReading& a, const ThermometerReading& b) {
      return a.model == b.model && a.window_low == b.window_low && a.window_high == b.window_high &&
             a.fitted.value == b.fitted.value;
    };
    std::vector<const ThermometerReading*> distinct{chosen_};
    for (const ThermometerReading& reading : answer_.readings)
      if (reading.admissible &&
          std::none_of(distinct.begin(), distinct.end(), [&](const auto* one) { return same(*one, reading); }))
        distinct.push_back(&reading);
    return static_cast<int>(distinct.size());
  }

  // Whether two temperatures are more than the same_temperature apart, significantly.
  static bool differ(const Estimate& a, const Estimate& b, double errors) {
    return ratio_above_one(a.value, b.value) > same_temperature &&
           std::abs(a.value - b.value) >= errors * std::hypot(a.std_error, b.std_error);
  }

  void judge() {
    const std::optional<Estimate>&x = input_.temperature_x, &z = input_.temperature_z;
    answer_.verdict = Verdict::no_single_temperature;
    if (is_at_rest()) {
      answer_.why = "The bed is at rest: T_x = " + amount(x->value, 2) + " and T_z = " + amount(z->value, 2) + unit() +
                    ". Its profile shows only how the disks are packed, not a temperature.";
      answer_.advice = "Do not quote a T of this bed. To measure one, shake the bed harder.";
      return;
    }
    if (x && z && differ(*x, *z, significant_kinetic)) {
      const double apart = ratio_above_one(x->value, z->value);
      answer_.why = "The disks' velocities have two temperatures: T_x = " + amount(x->value) +
                    " and T_z = " + amount(z->value) + unit() +
                    (std::isfinite(apart) ? ", " + how_far(apart) + " apart." : ".");
      answer_.advice =
          "Quote T_x (horizontal motion) and T_z (vertical motion) separately, or quote the range of T. The density "
          "profile of a bed in equilibrium does not describe this bed.";
      return;
    }
    const Estimate profile{chosen_->temperature, chosen_->std_error, false};
    for (const std::optional<Estimate>& kinetic : {x, z}) {
      if (!kinetic || !differ(profile, *kinetic, significant)) continue;
      const double apart = ratio_above_one(profile.value, kinetic->value);
      answer_.why = "The profile gives T = " + amount(profile.value) + unit() + ", but the disks' velocities give " +
                    amount(kinetic->value) + unit() + (std::isfinite(apart) ? ", " + how_far(apart) + " apart." : ".");
      answer_.advice = "Quote the range of T. Check that the floor, the diameter and gravity are those of this bed.";
      return;
    }
    if (farthest_ != nullptr) {
      answer_.why = "T depends on the range of heights that is fitted: " + amount(chosen_->temperature) + unit() +
                    " (" + chosen_->thermometer + ") or " + amount(farthest_->temperature) + unit() + " (" +
                    farthest_->thermometer + ").";
      answer_.advice =
          "Quote the range of T. In a bed that is shaken or loses energy in contacts, T differs from height to height.";
      return;
    }
    const ThermometerReading& whole = whole_column();
    const double part = part_of_usual_density(whole.window_low, whole.window_high);
    const double misfit = part * (part * known_misfit(whole.temperature) + row_modulation * seen_.rows_seen);
    answer_.verdict = Verdict::model_does_not_fit;
    if (whole.model_error > std::max(least_misfit_, admissible_misfit * misfit)) {
      answer_.why = "The best model deviates from the densities by " + number(whole.model_error, 2) + " per D^2, " +
                    number(whole.model_error / misfit, 2) +
                    " times as much as for beds in equilibrium at this temperature.";
      answer_.advice =
          "Look at the residuals of the fit. Check the diameter, the origin of the heights and the kernel.";
      return;
    }
    answer_.verdict = Verdict::one_temperature;
    answer_.why = compared_ == 0
                      ? "Only one model and window can be trusted for this profile, and this model fits."
                      : (compared_ == 1 ? "Both" : "All " + std::to_string(compared_ + 1)) +
                            " fits (models and windows) agree within 20 % or their errors, and the model fits.";
    if (!x && !z && !input_.shaken)
      answer_.why +=
          " This is the T of the profile. Only velocities show whether T_x (horizontal motion) differs from it, as in "
          "shaken beds.";
  }

  // A temperature as the reasons state it, and its unit.
  [[nodiscard]] std::string amount(double temperature, int digits = 4) const {
    return number(temperature * (input_.diameter ? 1e3 * *input_.diameter : 1.0), digits);
  }
  [[nodiscard]] const char* unit() const { return input_.diameter ? " mm" : " m g D"; }

  [[nodiscard]] bool is_at_rest() const {
    const std::optional<Estimate>&x = input_.temperature_x, &z = input_.temperature_z;
    return x && z && x->value < temperature_at_rest && z->value < temperature_at_rest;
  }

  // A profile alone does not show what shaking always does.
  void judge_shaking() {
    if (!answer_.ok() || !input_.shaken || input_.temperature_x || input_.temperature_z) return;
    const std::string shaken =
        "The bed is shaken, and its velocities are unknown: T_x (horizontal) and T_z (vertical) may lie outside this "
        "range.";
    if (answer_.verdict == Verdict::one_temperature) {
      answer_.verdict = Verdict::no_single_temperature;
      answer_.why = shaken + " The profile alone: " + answer_.why;
      answer_.advice =
          "Quote this range as the T of the profile. To measure velocities, record a film and give its frame rate.";
    } else {
      answer_.why += " " + shaken;
    }
  }

  // The greatest density from `low` to `high` [D] over the usual one, at most 1.
  [[nodiscard]] double part_of_usual_density(double low, double high) const {
    double greatest = 0.0;
    for (std::size_t i = 0; i < seen_.profile.height.size(); ++i) {
      const double z = seen_.profile.height[i];
      if (z >= low && z <= high) greatest = std::max(greatest, seen_.profile.number_density[i]);
    }
    return std::min(1.0, greatest / usual_density);
  }

  [[nodiscard]] bool is_frozen() const {
    const std::vector<double>& density = seen_.profile.number_density;
    return *std::max_element(density.begin(), density.end()) > number_density(freezing_area_fraction);
  }

  // The fit of the whole column, whose misfit is known.
  [[nodiscard]] const ThermometerReading& whole_column() const {
    for (const ThermometerReading& reading : answer_.readings) {
      if (reading.thermometer == "whole column" && reading.status == FitStatus::ok) return reading;
    }
    return *chosen_;
  }

  void combine() {
    Answer& a = answer_;
    a.spread = a.temperature * (a.verdict == Verdict::one_temperature ? spread_beyond_ : spread_of_all_);
    a.contact_duration_uncertainty = a.temperature * input_.contact_duration_effect;
    if (input_.width_between_walls > 0.0)
      a.wall_uncertainty =
          a.temperature * (is_frozen() ? wall_effect_on_crystal : wall_effect) / input_.width_between_walls;
    a.std_error = std::hypot(std::hypot(a.statistical_error, a.misfit_error, a.contact_duration_uncertainty),
                             std::hypot(a.bias_uncertainty, a.spread), a.wall_uncertainty);
    a.interval.confidence = input_.confidence;
    a.interval.status = FitStatus::ok;
    if (a.verdict == Verdict::no_single_temperature) {
      take_the_range();
      return;
    }
    const double far = std::min(quantile() * a.std_error / a.temperature, widest_interval);
    a.interval.low = a.temperature * std::exp(-far);
    a.interval.high = a.temperature * std::exp(far);
  }

  // Of one temperature: what its uncertainty comes from.
  void advise() {
    if (answer_.verdict != Verdict::one_temperature) return;
    const std::pair<double, const char*> parts[] = {
        {scale_uncertainty_,
         "Most of the uncertainty comes from the scale: give the length of a pixel, as a ruler in a photograph "
         "shows it."},
        {without_scale_, "Most of the uncertainty is statistical: a longer measurement reduces it."},
        {std::hypot(answer_.bias_uncertainty, answer_.misfit_error, answer_.spread),
         "Most of the uncertainty comes from the model: a longer measurement does not reduce it."},
        {answer_.wall_uncertainty, "Most of the uncertainty comes from the side walls: a wider bed reduces it."},
        {answer_.contact_duration_uncertainty,
         "Most of the uncertainty comes from the contact duration: a shorter one reduces it."}};
    const auto smaller = [](const auto& a, const auto& b) { return a.first < b.first; };
    answer_.advice = std::max_element(std::begin(parts), std::end(parts), smaller)->second;
  }

  // An interval that is too wide leaves T open, however well the model fits.
  void judge_interval() {
    const Interval& at = answer_.interval;
    if (answer_.verdict == Verdict::no_single_temperature || at.high < widest_factor * at.low) return;
    const std::string misfit = answer_.verdict == Verdict::model_does_not_fit ? answer_.why + " " : "";
    answer_.verdict = Verdict::no_single_temperature;
    const double factor = at.high / at.low;
    if (std::log(at.high / answer_.temperature) >= widest_interval) {
      answer_.status = FitStatus::unreadable;
      answer_.why = misfit + "The profile does not determine T within a factor of 20.";
      answer_.advice = "Measure longer, or at more closely spaced heights where the density falls.";
      return;
    }
    answer_.why =
        misfit + "The " + per_cent(at.confidence) + " interval of T spans a factor of " + number(factor, 2) + ".";
    answer_.advice = "Quote this range, not one T. " + answer_.advice;
    for (const std::optional<Estimate>& kinetic : {input_.temperature_x, input_.temperature_z}) {
      if (!kinetic || (at.low <= kinetic->value && kinetic->value <= at.high)) continue;
      answer_.interval.low = std::min(at.low, kinetic->value);
      answer_.interval.high = std::max(at.high, kinetic->value);
      answer_.interval.confidence = 0.0;
    }
  }

  // Without velocities the surface of a cold bed gives only an upper limit of T.
  void judge_surface() {
    if (!answer_.ok() || input_.temperature_x || input_.temperature_z || chosen_->temperature >= coldest_shown) return;
    const std::string before = answer_.verdict == Verdict::one_temperature ? "" : answer_.why + " ";
    answer_.verdict = Verdict::no_single_temperature;
    answer_.why = before + "T is below " + amount(answer_.interval.high, 2) + unit() +
                  ": the density falls within about one layer of disks, as it also does in a bed at rest.";
    answer_.advice = "Quote the upper limit, or measure velocities (a film with its frame rate).";
    answer_.interval.low = 0.0;
    answer_.temperature = answer_.std_error = 0.5 * answer_.interval.high;
  }

  // Student's, with the degrees of freedom that the statistical part leaves the whole uncertainty [Welch1947].
  [[nodiscard]] double quantile() const {
    const double upper = 0.5 + 0.5 * input_.confidence;
    const double statistical_part = std::hypot(answer_.statistical_error, answer_.misfit_error) / answer_.std_error;
    const int samples = covariance_samples();
    if (samples < 2 || !(statistical_part > 0.0)) return gsl_cdf_ugaussian_Pinv(upper);
    return gsl_cdf_tdist_Pinv(upper, (samples - 1.0) / std::pow(statistical_part, 4));
  }

  [[nodiscard]] int covariance_samples() const {
    return seen_.profile.covariance.empty() ? 0 : seen_.profile.covariance_samples;
  }

  void find_next_bed_interval() {
    const double upper = 0.5 + 0.5 * input_.confidence;
    const int samples = covariance_samples();
    const double quantile = samples < 2 ? gsl_cdf_ugaussian_Pinv(upper) : gsl_cdf_tdist_Pinv(upper, samples - 1.0);
    const double reach = quantile * answer_.statistical_error / chosen_->temperature;
    answer_.next_bed_interval = {FitStatus::ok, chosen_->temperature * std::exp(-reach),
                                 chosen_->temperature * std::exp(reach), input_.confidence};
  }

  // From the least to the greatest temperature that anything says.
  void take_the_range() {
    double low = answer_.temperature, high = low;
    const auto include = [&](double temperature) {
      low = std::min(low, temperature);
      high = std::max(high, temperature);
    };
    for (const ThermometerReading& reading : answer_.readings) {
      if (reading.admissible) include(reading.temperature);
    }
    if (is_at_rest()) low = high = input_.temperature_x->value;  // the profile shows no T
    if (input_.temperature_x) include(input_.temperature_x->value);
    if (input_.temperature_z) include(input_.temperature_z->value);
    answer_.interval.low = low;
    answer_.interval.high = high;
    answer_.interval.confidence = 0.0;
    answer_.temperature = 0.5 * (low + high);
    answer_.std_error = 0.5 * (high - low);
  }

  void find_solid_height() {
    FitOptions options;
    options.kernel = seen_.kernel;
    options.base = input_.base;
    options.window.below_density = tail_density;
    options.interval = options.sweep = options.compare = false;
    options.curve_points = 0;
    const double temperature = answer_.interval.low > 0.0 ? answer_.temperature : chosen_->temperature;
    options.fixed_temperature = temperature;
    const FitResult best = fit_profile(seen_.profile, options);
    options.fixed_temperature = temperature + answer_.std_error;
    const FitResult warmer = fit_profile(seen_.profile, options);
    if (!best.ok() || !warmer.ok()) return;
    answer_.solid_height = best.solid_height;
    answer_.solid_height.std_error =
        std::hypot(best.solid_height.std_error, warmer.solid_height.value - best.solid_height.value);
    if (best.solid_height.value > 0.0)
      answer_.solid_height.std_error = std::hypot(answer_.solid_height.std_error, input_.origin_error);
  }

  const AnswerInput& input_;
  double without_scale_ = 0.0, scale_uncertainty_ = 0.0;  // parts of the statistical error [m g D]
  std::optional<double> column_number_;                   // as input_, far from side walls
  BlurredProfile seen_;                                   // without the crystal's rows, far from side walls
  Answer answer_;
  std::vector<const Thermometer*> votes_;  // of the readings
  const ThermometerReading* chosen_ = nullptr;
  const ThermometerReading* farthest_ = nullptr;      // of those that contradict the chosen one
  double spread_of_all_ = 0.0, spread_beyond_ = 0.0;  // in ln T
  int compared_ = 0;
  double least_misfit_ = 0.0;  // of the densities, by what is known of such beds [1/D^2]
};

}  // namespace

std::string_view to_string(Verdict verdict) {
  switch (verdict) {
    case Verdict::one_temperature:
      return "one temperature";
    case Verdict::model_does_not_fit:
      return "model does not fit";
    case Verdict::no_single_temperature:
      return "no single temperature";
  }
  return "unknown";
}

Answer find_answer(const AnswerInput& input) {
  if (!(input.scale_error > 0.0)) return AnswerFinder(input).run();
  AnswerInput exact = input;
  exact.profile = with_exact_scale(input.profile, input.scale_error);
  return AnswerFinder(exact).run();
}

}  // namespace shakebed::fit
