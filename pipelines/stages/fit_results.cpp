#include "pipelines/stages/fit_results.hpp"

namespace shakebed::pipelines {
namespace {

class FitStatement {
 public:
  FitStatement(ResultList& list, const FitOutput& fit) : list_(list), fit_(fit) {}

  void state() {
    list_.text("/status", "whether the fit succeeded");
    list_.text("/message", "reason for which the fit failed", given_when("the fit fails"));
    list_.text("/model", "model that was fitted");
    estimates();
    quality();
    window();
    comparisons();
    list_.truth("/describes_data", "whether the model fits");
    list_.text("/why_not", "why the model does not fit", given_when("the model does not fit"));
    list_.text("/warnings/#", "warning about the fit", given_when("the fit has a warning"));
    answer();
    extras();
    tables();
  }

 private:
  void estimates() {
    const Given known = both(fitted_, given_when("the diameter is known"));
    list_.quantity("/temperature", "m g D", "fitted temperature", fitted_);
    list_.quantity("/temperature_over_mg", "m", "fitted temperature as T/(m g)", known);
    list_.quantity("/statistical_error", "m g D",
                   "standard error of T from the measured errors alone, without the misfit of the model", fitted_);
    list_.quantity("/shift", "D", "shift: height at which the fluid begins, above the lower edge of the bed", fitted_);
    list_.quantity("/solid_height", "D", "height of the solid, zeta_F", fitted_);
    list_.quantity("/plateau_density", "1/D^2", "density of the solid, phi_0", fitted_);
    list_.quantity("/column_number", "1", "column number N D/W: disks per diameter of width", fitted_);
    const Given critical = both(fitted_, given_when("T_c is known from N D/W"));
    list_.quantity("/critical_temperature", "m g D", "temperature at which the solid vanishes, T_c", critical);
    list_.quantity("/critical_temperature_over_mg", "m", "T_c as a length, T_c/(m g)", both(critical, known));
    list_.quantity("/reduced_temperature", "1", "reduced temperature T/T_c", critical);
    list_.quantity("/solid_height_by_sum_rule", "D", "height of the solid from the number of disks (sum rule)",
                   critical);
    list_.text("/critical_temperature_status", "why T_c is not known", given_when("T_c is not known"));
    interval("/temperature_interval", fitted_);
    interval("/next_bed_interval", fitted_);
    list_.text("/parameters/#", "name of a parameter of the fit", fitted_);
    list_.number("/covariance/#/#", "1", "covariance of the fitted parameters, in the order of /parameters", fitted_);
  }

  void interval(const std::string& pointer, const Given& given) {
    list_.text(pointer + "/status", "ok, or which end of the interval was not found", given);
    list_.number(pointer + "/low", "m g D", "lower end of the interval of T", given, true);
    list_.number(pointer + "/high", "m g D", "upper end of the interval of T", given, true);
    list_.number(pointer + "/confidence", "1", "confidence level of the interval", given);
    list_.truth(pointer + "/low_open", "true if the lower end lies below the searched range", given);
    list_.truth(pointer + "/high_open", "true if the upper end lies above the searched range", given);
  }

  void quality() {
    list_.number("/chi2", "1", "chi-square: sum of squared residuals over their squared errors", fitted_);
    list_.number("/dof", "1", "degrees of freedom", fitted_);
    list_.number("/chi2_per_dof", "1", "chi-square per degree of freedom", fitted_, true);
    list_.number("/p_value", "1", "probability of a chi-square at least this large, if the model is right", fitted_,
                 true);
    list_.number("/aic", "1", "information criterion of Akaike", fitted_, true);
    list_.number("/bic", "1", "Bayesian information criterion", fitted_, true);
    list_.truth("/errors_scaled", "true if the errors were scaled so that chi-square per degree of freedom is 1",
                fitted_);
    list_.number("/relative_misfit", "1", "rms residual over the largest density");
    list_.quantity("/area", "1", "column number N D/W from the area under the profile");
  }

  void window() {
    list_.quantity("/window/low", "D", "lowest height of the fit");
    list_.quantity("/window/high", "D", "highest height of the fit");
    list_.number("/window/bins", "1", "number of heights in the fit");
    list_.text("/window/rule", "rule that chose the window");
    list_.text("/kernel/kind", "kind of the kernel through which the density was measured");
    list_.number("/kernel/width", "D", "width of the kernel");
    const Given several = given_when("several windows are compared"),
                good = given_when("the fit of the window succeeds");
    const std::string row = "/temperature_by_window/#/";
    list_.number(row + "low", "D", "lowest height of the window", several);
    list_.number(row + "high", "D", "highest height of the window", several);
    list_.number(row + "bins", "1", "heights in the window", several);
    list_.text(row + "status", "whether the fit of the window succeeded", several);
    list_.number(row + "temperature", "m g D", "temperature of the window", good);
    list_.number(row + "temperature_std_error", "m g D", "standard error of the temperature of the window", good);
    list_.number(row + "shift", "D", "shift of the window", good);
    list_.number(row + "chi2_per_dof", "1", "chi-square per degree of freedom in the window", good, true);
  }

  void comparisons() {
    const Given several = given_when("several models are compared"), good = given_when("the fit of the model succeeds");
    const std::string row = "/models/#/";
    list_.text(row + "model", "name of another model", several);
    list_.truth(row + "plateau_density_free", "whether phi_0 was fitted too", several);
    list_.text(row + "status", "ok, or why the fit of the model failed", several);
    list_.quantity(row + "temperature", "m g D", "fitted temperature of this model", good);
    list_.quantity(row + "shift", "D", "fitted shift of this model", good);
    list_.quantity(row + "plateau_density", "1/D^2", "density of the solid of this model, phi_0", good);
    list_.number(row + "chi2_per_dof", "1", "chi-square per degree of freedom of this model", good, true);
    list_.number(row + "aic", "1", "information criterion of Akaike of this model", good, true);
    list_.number(row + "bic", "1", "Bayesian information criterion of this model", good, true);
  }

  void answer() {
    const Given asked = given_if(fit_.answer, "\"answer\" is true and the model is not \"simulation\""),
                found = both(asked, given_when("there is an answer"));
    list_.text("/answer/verdict", "one temperature, model does not fit, or no single temperature", asked);
    list_.text("/answer/why", "reason for the verdict", asked);
    list_.text("/answer/advice", "advice: what to do next", asked);
    list_.text("/answer/status", "ok, or why there is no answer", asked);
    const auto temperature = [&](const std::string& name, const std::string& meaning, const Given& given) {
      list_.quantity("/answer/" + name, "m g D", meaning, given);
      list_.quantity("/answer/" + name + "_over_mg", "m", meaning + ", as T/(m g)",
                     both(given, given_when("the diameter is known")));
    };
    const Given kinetic = both(found, given_when("a kinetic temperature is known"));
    temperature("temperature",
                "temperature with its whole uncertainty; without one temperature, the middle of the range, and no "
                "standard error",
                found);
    temperature("temperature_x", "kinetic temperature, horizontal", kinetic);
    temperature("temperature_z", "kinetic temperature, vertical", kinetic);
    list_.quantity("/answer/interval/low", "m g D", "lower end of the interval of T", found);
    list_.quantity("/answer/interval/high", "m g D", "upper end of the interval of T", found);
    list_.number("/answer/interval/confidence", "1",
                 "confidence level of the interval; null where it is the range of all fits and kinetic temperatures",
                 found, true);
    list_.quantity("/answer/next_bed_interval/low", "m g D",
                   "lower end of the interval in which the mean T of further beds lies, by the same model and window",
                   found);
    list_.quantity("/answer/next_bed_interval/high", "m g D",
                   "upper end of the interval in which the mean T of further beds lies", found);
    list_.number("/answer/next_bed_interval/confidence", "1", "confidence level of the interval for further beds",
                 found);
    list_.quantity("/answer/statistical_error", "m g D", "statistical error of T, from the measured errors alone",
                   found);
    list_.quantity("/answer/misfit_error", "m g D", "systematic error of T from the misfit of the model", found);
    list_.quantity("/answer/bias_uncertainty", "m g D", "uncertainty of T from the uncertainty of the known bias",
                   found);
    list_.quantity("/answer/wall_uncertainty", "m g D", "uncertainty of T from hard side walls", found);
    list_.quantity("/answer/contact_duration_uncertainty", "m g D",
                   "uncertainty of T from the contact duration t_c of the simulation", found);
    list_.quantity("/answer/spread", "m g D", "spread of T between models and windows", found);
    list_.number("/answer/bias", "1", "known relative bias of model and window, which was subtracted", found);
    list_.text("/answer/thermometer", "model and window that gave T", found);
    list_.text("/answer/model", "model that gave T", found);
    list_.quantity("/answer/solid_height", "D", "height of the solid at this T", found, true);
    const std::string row = "/answer/readings/#/";
    list_.text(row + "thermometer", "name of a model and window", found);
    list_.text(row + "model", "model of this fit", found);
    list_.text(row + "status", "ok, or why the fit of the model failed", found);
    list_.truth(row + "admissible", "whether this fit is used to check the answer", found);
    list_.quantity(row + "temperature", "m g D", "temperature of this fit, corrected for the known bias", found);
    list_.number(row + "bias", "1", "known relative bias of this model and window", found);
    list_.number(row + "bias_uncertainty", "1", "uncertainty of this relative bias", found);
    list_.number(row + "chi2_per_dof", "1", "chi-square per degree of freedom of this fit", found, true);
  }

  void extras() {
    const Given matched = given_if(fit_.matched, "the model is \"simulation\"");
    list_.text("/library/#/stage", "simulate stage of a bed in the library", matched);
    list_.quantity("/library/#/temperature", "m g D", "temperature of this bed of the library", matched);
    list_.quantity("/interpolation_error", "m g D", "error of the interpolation between the beds", matched);
    list_.number("/library_scatter", "1",
                 "relative scatter of T when each bed of the library is fitted with the others", matched, true);
    const Given asked = given_if(fit_.bootstrap, "\"bootstrap\" is above 0");
    const Given found = both(asked, given_when("the bootstrap succeeds"));
    list_.text("/bootstrap/status", "whether the bootstrap succeeded", asked);
    list_.text("/bootstrap/message", "reason for which the bootstrap failed",
               both(asked, given_when("the bootstrap fails")));
    list_.number("/bootstrap/resamples", "1", "number of resamples of the frames", asked);
    list_.number("/bootstrap/succeeded", "1", "number of resamples whose fit succeeded", asked);
    list_.number("/bootstrap/window_frames", "1", "number of successive frames in a resampled block", asked);
    list_.quantity("/bootstrap/temperature", "m g D",
                   "T of the fit to all frames, with the standard deviation over the resamples as its error", found);
    list_.quantity("/bootstrap/shift", "D",
                   "shift of the fit to all frames, with the standard deviation over the resamples as its error",
                   found);
    for (const char* end : {"low", "high"})
      list_.number(std::string("/bootstrap/temperature_interval/") + end, "m g D",
                   std::string(end) + " end of the interval of T, from the resamples", found);
    list_.number("/bootstrap/temperature_interval/confidence", "1", "confidence level of the interval", found);
  }

  void tables() {
    const StatedColumn height{"height", "D", "height above the floor's mean position"};
    list_.table({"curve.csv",
                 "the fitted model",
                 {height,
                  {"number_density", "1/D^2", "density of the model"},
                  {"smoothed_density", "1/D^2", "density of the model, smoothed with the kernel of the measurement"}}});
    list_.table({"residuals.csv",
                 "measured and fitted densities",
                 {height,
                  {"number_density", "1/D^2", "measured density"},
                  {"std_error", "1/D^2", "standard error of the measured density"},
                  {"model", "1/D^2", "fitted density, smoothed with the kernel"},
                  {"used", "1", "1 inside the window of the fit, else 0", {"0", "1"}}}});
    list_.table({"windows.csv",
                 "fits in other windows",
                 {{"low", "D", "lower end of the window"},
                  {"high", "D", "upper end of the window"},
                  {"bins", "1", "heights in the window"},
                  {"temperature", "m g D", "fitted temperature T"},
                  {"std_error", "m g D", "standard error of T"},
                  {"shift", "D", "fitted shift of the profile"},
                  {"chi2_per_dof", "1", "chi-square per degree of freedom"},
                  {"status", "", "ok, or why there is no fit"}}});
  }

  ResultList& list_;
  const FitOutput& fit_;
  Given fitted_ = given_when("the fit has numbers");
};

}  // namespace

void state_fit_results(ResultList& list, const FitOutput& fit) { FitStatement(list, fit).state(); }

}  // namespace shakebed::pipelines
