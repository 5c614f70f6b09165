#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "fit/theory/value.hpp"

// How high a single ball jumps on a vibrated floor: the length that the Gamma -> temperature map equates to the rise of
// the bed. Lengths are in g/w^2, velocities in g/w, phases in radians. The paper does not say which height it means, so
// all candidates are offered by name.
//
// Any number of threads may call; values own what they hold.
namespace shakebed::fit {

// A periodic floor motion z(theta) = Gamma s(theta) [g/w^2], as a Fourier series. The scale of s makes the largest
// |s''| equal to 1. So Gamma is the peak acceleration in units of g for any shape.
class WaveForm {
 public:
  struct Harmonic {
    int order;      // k >= 1
    double sine;    // coefficient of sin(k theta)
    double cosine;  // of cos(k theta)
  };
  // z = a sin(theta), the experiment's.
  static WaveForm sine();
  // Any series; scaled. invalid_argument status when it is empty, flat or not finite.
  static WaveForm series(std::string name, std::vector<Harmonic> harmonics);
  // One period sampled evenly (at least 3 points); its Fourier series up to `orders`.
  static WaveForm samples(std::string name, std::span<const double> positions, int orders);

  [[nodiscard]] ValueStatus status() const { return status_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] double position(double phase) const;      // s
  [[nodiscard]] double velocity(double phase) const;      // s'
  [[nodiscard]] double acceleration(double phase) const;  // s''
  [[nodiscard]] double jerk(double phase) const;          // s'''
  // s(phase + t) - s - s' t - s'' t^2/2, of full relative accuracy for short times, and its derivative by t.
  [[nodiscard]] double deviation(double phase, double t) const;
  [[nodiscard]] double deviation_rate(double phase, double t) const;
  [[nodiscard]] double highest() const { return highest_; }            // max of s over a period
  [[nodiscard]] double largest_jerk() const { return largest_jerk_; }  // a bound on |s'''|
  [[nodiscard]] double largest_snap() const { return largest_snap_; }  // a bound on |s''''|
  [[nodiscard]] int highest_order() const { return highest_order_; }
  [[nodiscard]] bool pure_sine() const { return pure_sine_; }  // one harmonic of order 1, of any phase

 private:
  WaveForm() = default;
  std::string name_;
  std::vector<Harmonic> harmonics_;
  double highest_ = 0.0;
  double largest_jerk_ = 0.0;
  double largest_snap_ = 0.0;
  int highest_order_ = 1;
  bool pure_sine_ = false;
  ValueStatus status_ = ValueStatus::ok;
};

enum class JumpHeight {
  relative_max,         // greatest height above the moving floor during the flight
  above_launch,         // apex above the point of launch:         (Gamma^2 - 1)/2 for a sine
  above_mean_floor,     // apex above the floor's mean position:   (Gamma^2 + 1)/2
  above_highest_floor,  // apex above the floor's highest point:   (Gamma - 1)^2/2
};
inline constexpr std::array<JumpHeight, 4> jump_heights{JumpHeight::relative_max, JumpHeight::above_launch,
                                                        JumpHeight::above_mean_floor, JumpHeight::above_highest_floor};
std::string_view to_string(JumpHeight kind);  // the names as in the enum

// H_0 [g/w^2] of a ball without rebound (restitution 0), in a single flight. It rests on the floor until the floor
// falls faster than g. 0 with status ok for Gamma <= 1 (the ball never leaves). For a wave with several launches in a
// period, the highest.
Value jump_height(JumpHeight kind, double gamma, const WaveForm& wave = WaveForm::sine());
// The inverse: the Gamma >= 1 whose H_0 is `height` [g/w^2].
Value gamma_for_jump_height(JumpHeight kind, double height, const WaveForm& wave = WaveForm::sine());

// The exact bounce map of a ball with restitution e in [0, 0.99], after `transient` impacts, over `flights` flights.
struct BounceOptions {
  double restitution = 0.0;
  int transient = 1000;
  int flights = 1000;
  double initial_phase = 0.0;     // the ball starts on the floor here ...
  double initial_velocity = 0.0;  // ... with this velocity relative to it [g/w]; 0: at rest
};
struct BounceStatistics {
  ValueStatus status = ValueStatus::ok;
  // Over flights, weighted by their length (so a chattering landing does not drown the jumps), in the order of
  // jump_heights [g/w^2].
  std::array<double, 4> mean_height{};
  std::array<double, 4> greatest_height{};
  double mean_flight = 0.0;           // in periods
  double resting_fraction = 0.0;      // of the time, on the floor
  int period = 0;                     // the orbit repeats after so many flights (0: not within 64: chaotic)
  std::vector<double> launch_phases;  // of the measured flights, in [0, 2 pi)
  std::vector<double> flight_times;   // in radians of phase
};
BounceStatistics bounce(double gamma, const BounceOptions& options, const WaveForm& wave = WaveForm::sine());

// Stability of the period-1 mode n of a bouncing ball on a sine floor, e < 1. It exists from
//   Gamma_n = n pi (1-e)/(1+e)
// and is stable up to
//   sqrt(Gamma_n^2 + [2 (1+e^2)/(1+e)^2]^2).
struct ModeRange {
  double exists_from = 0.0;
  double stable_to = 0.0;
};
ModeRange period_one_mode(int mode, double restitution);

}  // namespace shakebed::fit
