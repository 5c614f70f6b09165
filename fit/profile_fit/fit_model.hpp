#pragma once

#include <array>
#include <memory>
#include <string_view>
#include <vector>

#include "fit/theory/equation_of_state.hpp"
#include "fit/theory/tail.hpp"
#include "statistics/kernel.hpp"

// The models of a profile, with their derivatives. Internal to fit.
//
// Every model has the same three parameters: a temperature, a place (the shift, or for whole columns N D/W), and the
// plateau density. A model says which of them it uses.
namespace shakebed::fit {

class FitModel {
 public:
  using Parameters = std::array<double, 3>;
  static constexpr std::size_t temperature = 0, place = 1, plateau = 2;

  explicit FitModel(double base) : base_(base) {}
  virtual ~FitModel() = default;
  FitModel(const FitModel&) = delete;
  FitModel& operator=(const FitModel&) = delete;

  [[nodiscard]] virtual std::string_view place_name() const { return "shift"; }
  [[nodiscard]] virtual bool place_is_column() const { return false; }
  [[nodiscard]] virtual bool uses_temperature() const { return true; }
  [[nodiscard]] virtual double largest_plateau() const { return close_packing_density; }
  // The equation of state that gives T_c for the model.
  [[nodiscard]] virtual const EquationOfState& equation() const { return enskog(); }

  // Sets the parameters; false if the model has no curve for them.
  virtual bool set(const Parameters& parameters) = 0;
  // Of the curve set last.
  [[nodiscard]] virtual double density(double height) const = 0;
  [[nodiscard]] virtual double smoothed(double height, const KernelRule& rule) const = 0;
  [[nodiscard]] virtual std::array<double, 4> smoothed_with_gradient(double height, const KernelRule& rule) const = 0;
  // The same of many heights, ascending: faster where one bin's kernel overlaps another's.
  virtual void smoothed_with_gradient(std::span<const double> heights, const KernelRule& rule,
                                      std::span<std::array<double, 4>> out) const {
    for (std::size_t i = 0; i < heights.size(); ++i) out[i] = smoothed_with_gradient(heights[i], rule);
  }
  [[nodiscard]] virtual double shift() const = 0;          // where the tail reaches phi_0 [D]
  [[nodiscard]] virtual double solid_height() const = 0;   // [D]
  [[nodiscard]] virtual double column_number() const = 0;  // N D/W under the curve
  // The place that gives the curve of this temperature and plateau a density at a height: for starts.
  [[nodiscard]] virtual double place_through(const Parameters& parameters, double height, double density) const = 0;

 protected:
  double base_;
};

// nullptr for an unknown model name. `whole_column`: enskog-rectangle with the shift tied by the sum rule.
// `resolution`: a length that stands in for the kernel where a step would have no derivative.
std::unique_ptr<FitModel> make_fit_model(std::string_view name, double base, bool whole_column, double resolution);

}  // namespace shakebed::fit
