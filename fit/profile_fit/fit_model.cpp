#include "fit/profile_fit/fit_model.hpp"

#include <algorithm>
#include <cmath>

#include "fit/theory/fermi_profile.hpp"

namespace shakebed::fit {

namespace {

// The paper's curve: an Enskog tail over a rectangle, parameters (T, shift, phi_0).
class RectangleWithTail final : public FitModel {
 public:
  using FitModel::FitModel;

  bool set(const Parameters& p) override {
    if (!(p[temperature] > 0.0) || !std::isfinite(p[place]) || !(p[plateau] > 0.0) || p[plateau] > largest_plateau()) {
      return false;
    }
    const EquationOfState& eos = enskog();
    if (p[plateau] != known_plateau_) {
      known_plateau_ = p[plateau];
      local_ = eos.local(p[plateau]);
      f_plateau_ = std::log(p[plateau]) + eos.excess(p[plateau]);
    }
    tail_.table = &eos.inverse_table();
    tail_.temperature = p[temperature];
    tail_.base = base_;
    tail_.reference = p[place];
    tail_.f_reference = f_plateau_;
    tail_.rectangle_density = p[plateau];
    tail_.d_temperature = {1.0, 0.0, 0.0};
    tail_.d_reference = {0.0, 1.0, 0.0};
    tail_.d_f_reference = {0.0, 0.0, local_.stiffness / p[plateau]};
    tail_.d_rectangle = {0.0, 0.0, 1.0};
    tail_.prepare(eos);
    return true;
  }
  double density(double height) const override { return tail_.density(height); }
  double smoothed(double height, const KernelRule& rule) const override { return tail_.smoothed(height, rule); }
  std::array<double, 4> smoothed_with_gradient(double height, const KernelRule& rule) const override {
    return tail_.smoothed_with_gradient(height, rule);
  }
  void smoothed_with_gradient(std::span<const double> heights, const KernelRule& rule,
                              std::span<std::array<double, 4>> out) const override {
    tail_.smoothed_with_gradient(heights, rule, out);
  }
  double shift() const override { return tail_.reference; }
  double solid_height() const override { return std::max(0.0, tail_.reference - base_); }
  double column_number() const override {
    if (tail_.reference >= base_) {
      return tail_.rectangle_density * (tail_.reference - base_ + tail_.temperature * local_.compressibility_factor);
    }
    const double bottom = tail_.table->density(tail_.f_at(base_));
    return tail_.temperature * bottom * enskog().local(bottom).compressibility_factor;
  }
  double place_through(const Parameters& p, double height, double density) const override {
    const double at = std::min(density, 0.97 * p[plateau]);
    const double f_plateau = std::log(p[plateau]) + enskog().excess(p[plateau]);
    const double f = std::log(at) + enskog().excess(at);
    return height - p[temperature] * (f_plateau - f);
  }

 private:
  double known_plateau_ = 0.0;
  double f_plateau_ = 0.0;
  EquationOfState::Local local_{};
  Tail tail_;
};

// A whole column in hydrostatic balance, parameters (T, N D/W, phi_0): a rectangle of phi_0 below T_c where the
// equation of state reaches phi_0, and the bottom density from T phi Z = N D/W above it.
class WholeColumn final : public FitModel {
 public:
  WholeColumn(double base, const EquationOfState& equation) : FitModel(base), equation_(equation) {}

  std::string_view place_name() const override { return "column_number"; }
  bool place_is_column() const override { return true; }
  double largest_plateau() const override { return equation_.largest_invertible_density(); }
  const EquationOfState& equation() const override { return equation_; }

  bool set(const Parameters& p) override {
    const double t = p[temperature];
    const double n = p[place];
    const double phi = p[plateau];
    if (!(t > 0.0) || !(n > 0.0) || !(phi > 0.0)) return false;
    column_number_ = n;
    tail_.table = &equation_.inverse_table();
    tail_.temperature = t;
    tail_.base = base_;
    const bool reachable = !equation_.has_pole() && phi <= equation_.largest_invertible_density();
    if (reachable && phi != known_plateau_) {
      known_plateau_ = phi;
      local_ = equation_.local(phi);
      f_plateau_ = std::log(phi) + equation_.excess(phi);
    }
    has_rectangle_ = reachable && t * phi * local_.compressibility_factor <= n;
    reachable_ = reachable;
    if (has_rectangle_) {
      const double mu_0 = phi * local_.compressibility_factor;
      tail_.reference = base_ + (n - t * mu_0) / phi;
      tail_.f_reference = f_plateau_;
      tail_.rectangle_density = phi;
      tail_.d_temperature = {1.0, 0.0, 0.0};
      tail_.d_reference = {-local_.compressibility_factor, 1.0 / phi,
                           -(n - t * mu_0) / (phi * phi) - t * local_.stiffness / phi};
      tail_.d_f_reference = {0.0, 0.0, local_.stiffness / phi};
      tail_.d_rectangle = {0.0, 0.0, 1.0};
    } else {
      const Value bottom = equation_.density_from_scaled_pressure(n / t);
      if (!bottom.ok()) return false;
      tail_.reference = base_;
      tail_.f_reference = std::log(bottom.value) + equation_.excess(bottom.value);
      tail_.rectangle_density = bottom.value;
      tail_.d_temperature = {1.0, 0.0, 0.0};
      tail_.d_reference = {};
      // dF = d(phi Z)/phi along the equation of state, and phi Z = N/T.
      tail_.d_f_reference = {-n / (t * t * bottom.value), 1.0 / (t * bottom.value), 0.0};
      tail_.d_rectangle = {};
    }
    tail_.prepare(equation_);
    return true;
  }
  double density(double height) const override { return tail_.density(height); }
  double smoothed(double height, const KernelRule& rule) const override { return tail_.smoothed(height, rule); }
  std::array<double, 4> smoothed_with_gradient(double height, const KernelRule& rule) const override {
    return tail_.smoothed_with_gradient(height, rule);
  }
  void smoothed_with_gradient(std::span<const double> heights, const KernelRule& rule,
                              std::span<std::array<double, 4>> out) const override {
    tail_.smoothed_with_gradient(heights, rule, out);
  }
  // Above T_c the shift is where the curve would reach phi_0 below the floor; the floor itself when it never would.
  double shift() const override {
    if (has_rectangle_ || !reachable_) return tail_.reference;
    return tail_.reference - tail_.temperature * (f_plateau_ - tail_.f_reference);
  }
  // Of the rectangle; for an equation with a pole, of what is denser than freezing.
  double solid_height() const override {
    if (has_rectangle_) return tail_.reference - base_;
    if (!equation_.has_pole()) return 0.0;
    const double freezing = number_density(freezing_area_fraction);
    const double f = std::log(freezing) + equation_.excess(freezing);
    return std::max(0.0, tail_.height_of_f(f) - base_);
  }
  double column_number() const override { return column_number_; }
  double place_through(const Parameters& p, double height, double density) const override {
    // The column whose curve passes there: P at the bottom = P there + weight between.
    const double at = std::min(density, 0.97 * largest_plateau());
    const double f = std::log(at) + equation_.excess(at) + std::max(0.0, height - base_) / p[temperature];
    const bool reachable = !equation_.has_pole() && p[plateau] <= largest_plateau();
    if (reachable) {
      const double f_plateau = std::log(p[plateau]) + equation_.excess(p[plateau]);
      if (f > f_plateau) {
        const double z = equation_.local(p[plateau]).compressibility_factor;
        return p[plateau] * (p[temperature] * (f - f_plateau) + p[temperature] * z);
      }
    }
    const double bottom = equation_.inverse_table().density(std::min(f, equation_.inverse_table().largest_f()));
    return p[temperature] * bottom * equation_.local(bottom).compressibility_factor;
  }

 private:
  const EquationOfState& equation_;
  double known_plateau_ = 0.0;
  double f_plateau_ = 0.0;
  EquationOfState::Local local_{};
  bool has_rectangle_ = false;
  bool reachable_ = false;
  double column_number_ = 0.0;
  Tail tail_;
};

// phi_0/(1 + exp((h - edge)/theta)), parameters (theta, edge, phi_0). [HayakawaHong1997]
class Fermi final : public FitModel {
 public:
  using FitModel::FitModel;
  using FitModel::smoothed_with_gradient;

  bool set(const Parameters& p) override {
    if (!(p[temperature] > 0.0) || !std::isfinite(p[place]) || !(p[plateau] > 0.0) || p[plateau] > largest_plateau()) {
      return false;
    }
    profile_ = {p[plateau], p[place], p[temperature]};
    return true;
  }
  double density(double height) const override { return height < base_ ? 0.0 : at(height)[0]; }
  double smoothed(double height, const KernelRule& rule) const override {
    return smoothed_with_gradient(height, rule)[0];
  }
  std::array<double, 4> smoothed_with_gradient(double height, const KernelRule& rule) const override {
    if (rule.is_point()) {
      return height < base_ ? std::array<double, 4>{} : at(height);
    }
    std::array<double, 4> sum{};
    const auto panel_at = [this](double h) {
      return std::max(2.2 * profile_.temperature, 0.5 * std::abs(h - profile_.edge));
    };
    const CurveShape<decltype(panel_at)> shape{
        base_, std::max(base_, profile_.edge + 40.0 * profile_.temperature), {}, panel_at};
    add_convolution<4>(
        rule, height, shape, [&](double h) { return at(h); }, sum);
    return sum;
  }
  double shift() const override { return profile_.edge; }
  double solid_height() const override { return std::max(0.0, profile_.edge - base_); }
  double column_number() const override {
    return FermiProfile{profile_.plateau_density, profile_.edge - base_, profile_.temperature}.column_number();
  }
  double place_through(const Parameters& p, double height, double density) const override {
    const double ratio = p[plateau] / std::min(density, 0.97 * p[plateau]);
    return height - p[temperature] * std::log(ratio - 1.0);
  }

 private:
  std::array<double, 4> at(double height) const {
    const double x = (height - profile_.edge) / profile_.temperature;
    const double filled = x > 700.0 ? 0.0 : 1.0 / (1.0 + std::exp(x));
    const double phi = profile_.plateau_density * filled;
    const double slope = phi * (1.0 - filled) / profile_.temperature;  // -d phi/dh
    return {phi, slope * x, slope, filled};
  }
  FermiProfile profile_;
};

// A rectangle, parameters (-, top, phi_0).
class Rectangle final : public FitModel {
 public:
  using FitModel::smoothed_with_gradient;
  Rectangle(double base, double resolution) : FitModel(base), stand_in_{KernelKind::top_hat, resolution} {}
  bool uses_temperature() const override { return false; }
  bool set(const Parameters& p) override {
    if (!std::isfinite(p[place]) || !(p[plateau] > 0.0) || p[plateau] > largest_plateau()) return false;
    top_ = std::max(base_, p[place]);
    plateau_ = p[plateau];
    return true;
  }
  double density(double height) const override { return height >= base_ && height <= top_ ? plateau_ : 0.0; }
  double smoothed(double height, const KernelRule& rule) const override {
    return smoothed_with_gradient(height, rule)[0];
  }
  std::array<double, 4> smoothed_with_gradient(double height, const KernelRule& rule) const override {
    const Kernel& used = rule.is_point() ? stand_in_ : rule.kernel();
    const double cover = kernel_cumulative(used, height - base_) - kernel_cumulative(used, height - top_);
    return {plateau_ * cover, 0.0, plateau_ * kernel_density(used, height - top_), cover};
  }
  double shift() const override { return top_; }
  double solid_height() const override { return top_ - base_; }
  double column_number() const override { return plateau_ * (top_ - base_); }
  double place_through(const Parameters&, double height, double) const override { return height; }

 private:
  Kernel stand_in_;
  double top_ = 0.0;
  double plateau_ = 0.0;
};

}  // namespace

std::unique_ptr<FitModel> make_fit_model(std::string_view name, double base, bool whole_column, double resolution) {
  constexpr std::string_view hydrostatic = "hydrostatic:";
  if (name == "enskog-rectangle") {
    if (whole_column) return std::make_unique<WholeColumn>(base, enskog());
    return std::make_unique<RectangleWithTail>(base);
  }
  if (name.starts_with(hydrostatic)) {
    const EquationOfState* equation = find_equation_of_state(name.substr(hydrostatic.size()));
    return equation == nullptr ? nullptr : std::make_unique<WholeColumn>(base, *equation);
  }
  if (name == "fermi") return std::make_unique<Fermi>(base);
  if (name == "rectangle") return std::make_unique<Rectangle>(base, resolution);
  return nullptr;
}

}  // namespace shakebed::fit
