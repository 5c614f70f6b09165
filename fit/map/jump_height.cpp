#include "fit/map/jump_height.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace shakebed::fit {

namespace {

constexpr double two_pi = 2.0 * std::numbers::pi;

// Below this velocity relative to the floor [g/w] the remaining bounces take no time worth keeping: the ball is put to
// rest where the geometric series of its bounces ends, but no later than after the next time [radians of phase].
constexpr double rest_velocity = 1e-9;
constexpr double longest_settle = 1e-3;
// Phase [radians] by which a launch that rounding error has turned into a rest is stepped over.
constexpr double step_past_rest = 1e-6;

// The greatest value of a smooth periodic function: a fine scan, then golden-section search about the best point.
template <class Function>
double greatest_over_period(Function&& function) {
  constexpr int points = 4096;
  int best = 0;
  double best_value = function(0.0);
  for (int i = 1; i < points; ++i) {
    const double value = function(two_pi * i / points);
    if (value > best_value) {
      best = i;
      best_value = value;
    }
  }
  constexpr double golden = 0.6180339887498949;
  double low = two_pi * (best - 1) / points;
  double high = two_pi * (best + 1) / points;
  for (int i = 0; i < 60; ++i) {
    const double a = high - golden * (high - low);
    const double b = low + golden * (high - low);
    if (function(a) > function(b)) {
      high = b;
    } else {
      low = a;
    }
  }
  return std::max(best_value, function(0.5 * (low + high)));
}

// How far a function of this value >= 0 and slope, with a second derivative of at most `curvature` in size, certainly
// stays above zero: the root of value + slope s - curvature s^2/2. Repeated steps never pass a zero and converge on it
// quadratically where it is crossed.
double safe_step(double value, double slope, double curvature) {
  const double root = std::sqrt(slope * slope + 2.0 * curvature * std::max(0.0, value));
  return slope > 0.0 ? (slope + root) / curvature : 2.0 * std::max(0.0, value) / (root - slope);
}

// t - sin t and t^2/2 - (1 - cos t), to full relative accuracy.
double sine_defect(double t) {
  if (std::abs(t) > 2.0) return t - std::sin(t);
  const double t2 = t * t;
  double sum = 0.0;
  for (int n = 27; n >= 3; n -= 2) sum = (1.0 - t2 * sum) / (n * (n - 1));
  return t * t2 * sum;
}
double cosine_defect(double t) {
  if (std::abs(t) > 2.0) return 0.5 * t * t - 2.0 * std::sin(0.5 * t) * std::sin(0.5 * t);
  const double t2 = t * t;
  double sum = 0.0;
  for (int n = 28; n >= 4; n -= 2) sum = (1.0 - t2 * sum) / (n * (n - 1));
  return t2 * t2 * 0.5 * sum;
}

struct Flight {
  double time = 0.0;             // until the floor is met again
  double launch_position = 0.0;  // of ball and floor
  double apex = 0.0;             // greatest height of the ball above the floor's mean position
  double relative_max = 0.0;     // greatest height above the moving floor
  double impact_velocity = 0.0;  // relative to the floor, negative
};

// A flight from the floor at `phase`, `velocity` relative to the floor. With velocity 0 the floor must be falling away.
// Its greatest gap costs most of the work, and is 0 where its heights are not wanted.
enum class Wanted { meeting, heights };
Flight fly(double gamma, const WaveForm& wave, double phase, double velocity, Wanted wanted) {
  Flight flight;
  flight.launch_position = gamma * wave.position(phase);
  const double launch_velocity = gamma * wave.velocity(phase) + velocity;
  flight.apex = flight.launch_position + (launch_velocity > 0.0 ? 0.5 * launch_velocity * launch_velocity : 0.0);
  // Early in the flight as an expansion about the launch, so that a jump much lower than the floor's stroke keeps its
  // digits. A ball that leaves from rest does so where nothing holds it any more.
  double hold = 1.0 + gamma * wave.acceleration(phase);
  if (velocity == 0.0) hold = std::min(hold, 0.0);
  const double early = 1.0 / wave.highest_order();
  const auto gap = [&](double t) {
    if (t < early) return (velocity - 0.5 * hold * t) * t - gamma * wave.deviation(phase, t);
    return flight.launch_position + launch_velocity * t - 0.5 * t * t - gamma * wave.position(phase + t);
  };
  const auto gap_rate = [&](double t) {
    if (t < early) return velocity - hold * t - gamma * wave.deviation_rate(phase, t);
    return launch_velocity - t - gamma * wave.velocity(phase + t);
  };
  const double curvature = 1.0 + gamma;  // bound on |gap''|
  // The first stretch, where the ball is certainly above the floor although the gap starts from 0: with
  //   gap'' = c >= 0 and |gap'''| <= J: gap >= c t^2/2 - J t^3/6, and with
  //   gap''' = j > 0 and |gap''''| <= S: gap >= j t^3/6 - S t^4/24.
  double t = 0.0;
  const double falling = -1.0 - gamma * wave.acceleration(phase);
  const double falling_rate = -gamma * wave.jerk(phase);
  if (falling >= -1e-9 && gamma > 0.0) {
    t = std::max(0.0, 1.5 * falling / (gamma * wave.largest_jerk()));
    if (falling_rate > 0.0) t = std::max(t, 2.0 * falling_rate / (gamma * wave.largest_snap()));
  }
  // From any time the ball stays up at least until the root of gap + rate s - curvature s^2/2: steps that never pass
  // the floor, and converge on the meeting quadratically.
  for (int step = 0; step < 100000; ++step) {
    const double height = gap(t);
    const double rate = gap_rate(t);
    if (height <= 0.0 && t > 0.0) break;
    const double safe = safe_step(height, rate, curvature);
    if (!(t + safe > t) || safe < 1e-15) break;
    t += safe;
  }
  flight.time = t;
  flight.impact_velocity = std::min(0.0, gap_rate(flight.time));
  if (wanted == Wanted::meeting) return flight;
  // Greatest gap: the zeros of its rate where it turns down. There the gap is level: an error of 1e-9 in time is none.
  constexpr int halvings = 27;
  const int steps = std::max(16, static_cast<int>(flight.time / 0.1));
  double previous_rate = gap_rate(flight.time * 1e-9);
  for (int i = 1; i <= steps; ++i) {
    const double t1 = flight.time * i / steps;
    const double rate = gap_rate(t1);
    if (previous_rate >= 0.0 && rate < 0.0) {
      double low = flight.time * (i - 1) / steps;
      double high = t1;
      for (int k = 0; k < halvings; ++k) {
        const double middle = 0.5 * (low + high);
        (gap_rate(middle) >= 0.0 ? low : high) = middle;
      }
      flight.relative_max = std::max(flight.relative_max, gap(low));
    }
    previous_rate = rate;
  }
  return flight;
}

double height_of(JumpHeight kind, const Flight& flight, double highest_floor) {
  switch (kind) {
    case JumpHeight::relative_max:
      return flight.relative_max;
    case JumpHeight::above_launch:
      return flight.apex - flight.launch_position;
    case JumpHeight::above_mean_floor:
      return flight.apex;
    case JumpHeight::above_highest_floor:
      return flight.apex - highest_floor;
  }
  return 0.0;
}

// The next time after `phase` at which a ball resting on the floor lifts off (the floor's acceleration passes -g going
// down), negative when there is none within a period. The ball is held at `phase`.
double time_to_lift_off(double gamma, const WaveForm& wave, double phase) {
  const double curvature = gamma * wave.largest_snap();
  double t = 0.0;
  for (int step = 0; step < 100000 && t < two_pi; ++step) {
    const double hold = 1.0 + gamma * wave.acceleration(phase + t);
    if (hold <= 0.0) return t;
    const double safe = safe_step(hold, gamma * wave.jerk(phase + t), curvature);
    if (!(t + safe > t) || safe < 1e-15) return t;
    t += safe;
  }
  return -1.0;
}

// On a sine the ball leaves with s = sqrt(Gamma^2 - 1), and its gap to the floor is s (t - sin t) - (t^2/2 - 1 + cos
// t): the greatest gap before it lands, as {height, its derivative by s}. The gap's rate s (1 - cos t) - (t - sin t)
// rises from each multiple of 2 pi to 2 atan(s) behind it and falls from there to the next, so that each period holds
// at most one least and one greatest gap; those about t = s are the highest, and where the ball clears the first
// periods it clears all up to there.
struct GreatestGap {
  double height = 0.0;
  double slope = 0.0;
};
GreatestGap greatest_gap_on_sine(double s) {
  const double bend = 2.0 * std::atan(s);
  const auto rate = [&](double before, double u) {
    const double half = std::sin(0.5 * u);
    return 2.0 * s * half * half - before - sine_defect(u);
  };
  // The zero between low and high, where the rate rises (falls).
  const auto zero = [&](double before, double low, double high, bool rises) {
    double u = rises ? 0.5 * (low + high) : high;
    for (int step = 0; step < 200; ++step) {
      const double value = rate(before, u);
      if (value == 0.0) break;
      ((value > 0.0) == rises ? high : low) = u;
      const double half = std::sin(0.5 * u);
      double next = u - value / (s * std::sin(u) - 2.0 * half * half);
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      if (std::abs(next - u) <= 4e-16 * u) break;
      u = next;
    }
    return u;
  };
  const auto gap = [&](double before, double u) {
    if (before == 0.0) return s * sine_defect(u) - cosine_defect(u);
    const double t = before + u, half = std::sin(0.5 * u);
    return s * (t - std::sin(u)) - 0.5 * t * t + 2.0 * half * half;
  };
  GreatestGap greatest;
  const double middle = std::floor(s / two_pi);
  for (double period = 0.0; period <= middle + 2.0; ++period) {
    if (period == 4.0 && middle > 6.0) period = middle - 1.0;
    const double before = period * two_pi;
    if (period > 0.0) {
      if (rate(before, bend) <= 0.0) break;
      if (gap(before, zero(before, 0.0, bend, true)) <= 0.0) break;
    }
    const double u = zero(before, bend, period == 0.0 ? std::min(two_pi, 3.0 * s) : two_pi, false);
    const double height = gap(before, u);
    if (height > greatest.height) greatest = {height, before + sine_defect(u)};
  }
  return greatest;
}

double jump_of_sine(JumpHeight kind, double gamma) {
  const double excess = gamma - 1.0;
  switch (kind) {
    case JumpHeight::relative_max:
      return greatest_gap_on_sine(std::sqrt(excess) * std::sqrt(gamma + 1.0)).height;
    case JumpHeight::above_launch:
      return 0.5 * excess * (gamma + 1.0);
    case JumpHeight::above_mean_floor:
      return 0.5 * (gamma * gamma + 1.0);
    case JumpHeight::above_highest_floor:
      return 0.5 * excess * excess;
  }
  return 0.0;
}

Value gamma_of_sine(JumpHeight kind, double height) {
  constexpr double largest = 1e6;
  double gamma = 1.0;
  switch (kind) {
    case JumpHeight::relative_max: {
      // In s; Newton's steps kept between what is too low and what is not. The height leaps where the ball clears one
      // more crest: there it ends on the upper side.
      double low = 0.0, high = largest;
      if (greatest_gap_on_sine(high).height < height) return no_value(ValueStatus::outside_range);
      double s = std::min(high, std::max(std::sqrt(std::sqrt(height * (8.0 / 9.0))), std::sqrt(2.0 * height)));
      for (int step = 0; step < 200 && high > low; ++step) {
        const GreatestGap at = greatest_gap_on_sine(s);
        (at.height < height ? low : high) = s;
        double next = at.slope > 0.0 ? s - (at.height - height) / at.slope : 0.5 * (low + high);
        if (std::abs(next - s) <= 2e-16 * s) return {std::sqrt(1.0 + s * s)};
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (!(next > low && next < high)) break;
        s = next;
      }
      gamma = std::sqrt(1.0 + high * high);
      break;
    }
    case JumpHeight::above_launch:
      gamma = std::sqrt(1.0 + 2.0 * height);
      break;
    case JumpHeight::above_mean_floor:
      if (height < 1.0) return no_value(ValueStatus::outside_range);
      gamma = std::sqrt(2.0 * height - 1.0);
      break;
    case JumpHeight::above_highest_floor:
      gamma = 1.0 + std::sqrt(2.0 * height);
      break;
  }
  if (gamma > largest) return no_value(ValueStatus::outside_range);
  return {gamma};
}

double wrapped(double phase) {
  const double inside = std::fmod(phase, two_pi);
  return inside < 0.0 ? inside + two_pi : inside;
}

}  // namespace

WaveForm WaveForm::sine() { return series("sine", {{1, 1.0, 0.0}}); }

WaveForm WaveForm::series(std::string name, std::vector<Harmonic> harmonics) {
  WaveForm wave;
  wave.name_ = std::move(name);
  wave.harmonics_ = std::move(harmonics);
  double size = 0.0;
  for (const Harmonic& harmonic : wave.harmonics_) {
    if (harmonic.order < 1 || !std::isfinite(harmonic.sine) || !std::isfinite(harmonic.cosine)) {
      wave.status_ = ValueStatus::invalid_argument;
      return wave;
    }
    size += std::hypot(harmonic.sine, harmonic.cosine);
  }
  if (!(size > 0.0)) {
    wave.status_ = ValueStatus::invalid_argument;
    return wave;
  }
  wave.pure_sine_ = wave.harmonics_.size() == 1 && wave.harmonics_[0].order == 1;
  const double largest = wave.pure_sine_
                             ? std::hypot(wave.harmonics_[0].sine, wave.harmonics_[0].cosine)
                             : greatest_over_period([&](double phase) { return std::abs(wave.acceleration(phase)); });
  for (Harmonic& harmonic : wave.harmonics_) {
    harmonic.sine /= largest;
    harmonic.cosine /= largest;
    const double k = harmonic.order;
    wave.highest_order_ = std::max(wave.highest_order_, harmonic.order);
    wave.largest_jerk_ += k * k * k * std::hypot(harmonic.sine, harmonic.cosine);
    wave.largest_snap_ += k * k * k * k * std::hypot(harmonic.sine, harmonic.cosine);
  }
  wave.highest_ = wave.pure_sine_ ? 1.0 : greatest_over_period([&](double phase) { return wave.position(phase); });
  return wave;
}

WaveForm WaveForm::samples(std::string name, std::span<const double> positions, int orders) {
  const auto count = positions.size();
  std::vector<Harmonic> harmonics;
  if (count >= 3) {
    const int largest_order = std::min(orders, static_cast<int>((count - 1) / 2));
    for (int k = 1; k <= largest_order; ++k) {
      Harmonic harmonic{k, 0.0, 0.0};
      for (std::size_t i = 0; i < count; ++i) {
        const double phase = two_pi * k * static_cast<double>(i) / static_cast<double>(count);
        harmonic.sine += positions[i] * std::sin(phase);
        harmonic.cosine += positions[i] * std::cos(phase);
      }
      harmonic.sine *= 2.0 / static_cast<double>(count);
      harmonic.cosine *= 2.0 / static_cast<double>(count);
      harmonics.push_back(harmonic);
    }
  }
  return series(std::move(name), std::move(harmonics));
}

double WaveForm::position(double phase) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) sum += h.sine * std::sin(h.order * phase) + h.cosine * std::cos(h.order * phase);
  return sum;
}

double WaveForm::velocity(double phase) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) {
    sum += h.order * (h.sine * std::cos(h.order * phase) - h.cosine * std::sin(h.order * phase));
  }
  return sum;
}

double WaveForm::acceleration(double phase) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) {
    const double k2 = static_cast<double>(h.order) * h.order;
    sum -= k2 * (h.sine * std::sin(h.order * phase) + h.cosine * std::cos(h.order * phase));
  }
  return sum;
}

double WaveForm::jerk(double phase) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) {
    const double k3 = static_cast<double>(h.order) * h.order * h.order;
    sum -= k3 * (h.sine * std::cos(h.order * phase) - h.cosine * std::sin(h.order * phase));
  }
  return sum;
}

double WaveForm::deviation(double phase, double t) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) {
    const double sine = std::sin(h.order * phase), cosine = std::cos(h.order * phase);
    sum += (h.sine * sine + h.cosine * cosine) * cosine_defect(h.order * t) -
           (h.sine * cosine - h.cosine * sine) * sine_defect(h.order * t);
  }
  return sum;
}

double WaveForm::deviation_rate(double phase, double t) const {
  double sum = 0.0;
  for (const Harmonic& h : harmonics_) {
    const double sine = std::sin(h.order * phase), cosine = std::cos(h.order * phase);
    const double half = std::sin(0.5 * h.order * t);
    sum += h.order * ((h.sine * sine + h.cosine * cosine) * sine_defect(h.order * t) -
                      (h.sine * cosine - h.cosine * sine) * 2.0 * half * half);
  }
  return sum;
}

std::string_view to_string(JumpHeight kind) {
  switch (kind) {
    case JumpHeight::relative_max:
      return "relative_max";
    case JumpHeight::above_launch:
      return "above_launch";
    case JumpHeight::above_mean_floor:
      return "above_mean_floor";
    case JumpHeight::above_highest_floor:
      return "above_highest_floor";
  }
  return "unknown";
}

Value jump_height(JumpHeight kind, double gamma, const WaveForm& wave) {
  if (!std::isfinite(gamma) || gamma < 0.0 || wave.status() != ValueStatus::ok) {
    return no_value(ValueStatus::invalid_argument);
  }
  if (gamma <= 1.0) return {0.0};
  if (wave.pure_sine()) return {jump_of_sine(kind, gamma)};
  const double highest_floor = gamma * wave.highest();
  double best = 0.0;
  // Every launch of one period, from phases at which the floor still holds the ball.
  double phase = 0.0;
  while (phase < two_pi && 1.0 + gamma * wave.acceleration(phase) <= 0.0) phase += two_pi / 4096;
  const double first = phase;
  for (int launch = 0; launch < 64 && phase < first + two_pi; ++launch) {
    const double wait = time_to_lift_off(gamma, wave, phase);
    if (wait < 0.0 || phase + wait >= first + two_pi) break;
    phase += wait;
    best = std::max(best, height_of(kind, fly(gamma, wave, phase, 0.0, Wanted::heights), highest_floor));
    do {
      phase += two_pi / 4096;
    } while (1.0 + gamma * wave.acceleration(phase) <= 0.0 && phase < first + 2.0 * two_pi);
  }
  return {best};
}

Value gamma_for_jump_height(JumpHeight kind, double height, const WaveForm& wave) {
  if (!std::isfinite(height) || height < 0.0 || wave.status() != ValueStatus::ok) {
    return no_value(ValueStatus::invalid_argument);
  }
  if (wave.pure_sine()) return gamma_of_sine(kind, height);
  if (height == 0.0 && kind != JumpHeight::above_mean_floor) return {1.0};  // it hardly leaves the floor
  double low = 1.0;
  double high = 2.0;
  while (jump_height(kind, high, wave).value < height) {
    low = high;
    high *= 2.0;
    if (high > 1e6) return no_value(ValueStatus::outside_range);
  }
  if (jump_height(kind, std::nextafter(1.0, 2.0), wave).value > height) return no_value(ValueStatus::outside_range);
  while (true) {
    const double middle = 0.5 * (low + high);
    if (!(middle > low && middle < high)) return {high};
    (jump_height(kind, middle, wave).value < height ? low : high) = middle;
  }
}

namespace {

bool is_bouncing_ball(double gamma, const BounceOptions& options, const WaveForm& wave) {
  const double e = options.restitution;
  return std::isfinite(gamma) && gamma >= 0.0 && e >= 0.0 && e <= 0.99 && options.flights >= 1 &&
         options.transient >= 0 && wave.status() == ValueStatus::ok && std::isfinite(options.initial_phase) &&
         options.initial_velocity >= 0.0;
}

// A ball on the floor, flight after flight. Between them it stands at `phase_` with `velocity_` relative to the floor.
class BouncingBall {
 public:
  BouncingBall(double gamma, const BounceOptions& options, const WaveForm& wave)
      : gamma_(gamma),
        options_(options),
        wave_(wave),
        highest_floor_(gamma * wave.highest()),
        phase_(wrapped(options.initial_phase)),
        velocity_(options.initial_velocity) {}

  BounceStatistics run() {
    for (int flight = -options_.transient; flight < options_.flights; ++flight) {
      const bool counted = flight >= 0;
      if (!rest_until_lift_off(counted)) {
        statistics_.resting_fraction = 1.0;
        statistics_.period = 0;
        return std::move(statistics_);
      }
      fly_once(counted);
    }
    if (statistics_.flight_times.empty()) {
      statistics_.status = ValueStatus::not_converged;
      return std::move(statistics_);
    }
    take_means();
    find_period();
    return std::move(statistics_);
  }

 private:
  // A ball too slow to bounce waits until the floor lets it go. False: it never does.
  bool rest_until_lift_off(bool counted) {
    const double hold = 1.0 + gamma_ * wave_.acceleration(phase_), e = options_.restitution;
    if (!(velocity_ <= rest_velocity && hold > 0.0)) return true;
    const double settle = std::min(e > 0.0 ? 2.0 * velocity_ / (hold * (1.0 - e)) : 0.0, longest_settle);
    const double wait = time_to_lift_off(gamma_, wave_, phase_ + settle);
    if (wait < 0.0) return false;
    if (counted) resting_ += wait;
    phase_ = wrapped(phase_ + wait + settle);
    velocity_ = 0.0;
    return true;
  }

  void fly_once(bool counted) {
    const Flight flight = fly(gamma_, wave_, phase_, velocity_, counted ? Wanted::heights : Wanted::meeting);
    if (!(flight.time > 0.0)) {  // a launch that rounding error has turned into a rest: step past it
      phase_ = wrapped(phase_ + step_past_rest);
      velocity_ = 0.0;
      return;
    }
    if (counted) count(flight);
    phase_ = wrapped(phase_ + flight.time);
    velocity_ = -options_.restitution * flight.impact_velocity;
  }

  void count(const Flight& flight) {
    statistics_.launch_phases.push_back(wrapped(phase_));
    statistics_.flight_times.push_back(flight.time);
    flying_ += flight.time;
    for (std::size_t i = 0; i < jump_heights.size(); ++i) {
      const double height = height_of(jump_heights[i], flight, highest_floor_);
      weighted_[i] += flight.time * height;
      statistics_.greatest_height[i] =
          statistics_.launch_phases.size() == 1 ? height : std::max(statistics_.greatest_height[i], height);
    }
  }

  void take_means() {
    for (std::size_t i = 0; i < jump_heights.size(); ++i) statistics_.mean_height[i] = weighted_[i] / flying_;
    statistics_.mean_flight = flying_ / static_cast<double>(statistics_.flight_times.size()) / two_pi;
    statistics_.resting_fraction = resting_ / (resting_ + flying_);
  }

  // The least number of flights after which the last ones repeat; 0: none up to 64.
  void find_period() {
    const std::size_t count = statistics_.flight_times.size();
    const auto same = [&](std::size_t i, std::size_t j) {
      const double turn = std::abs(std::remainder(statistics_.launch_phases[i] - statistics_.launch_phases[j], two_pi));
      return turn < 1e-6 && std::abs(statistics_.flight_times[i] - statistics_.flight_times[j]) < 1e-6;
    };
    for (std::size_t period = 1; period <= 64 && 2 * period <= count && statistics_.period == 0; ++period) {
      bool repeats = true;
      for (std::size_t i = count - period; i < count && repeats; ++i) repeats = same(i, i - period);
      if (repeats) statistics_.period = static_cast<int>(period);
    }
  }

  double gamma_;
  const BounceOptions& options_;
  const WaveForm& wave_;
  double highest_floor_, phase_, velocity_;
  double flying_ = 0.0, resting_ = 0.0;
  std::array<double, 4> weighted_{};  // jump heights by the time of their flights
  BounceStatistics statistics_;
};

}  // namespace

BounceStatistics bounce(double gamma, const BounceOptions& options, const WaveForm& wave) {
  if (!is_bouncing_ball(gamma, options, wave)) {
    BounceStatistics statistics;
    statistics.status = ValueStatus::invalid_argument;
    return statistics;
  }
  return BouncingBall(gamma, options, wave).run();
}

ModeRange period_one_mode(int mode, double restitution) {
  const double e = restitution;
  const double onset = mode * std::numbers::pi * (1.0 - e) / (1.0 + e);
  const double width = 2.0 * (1.0 + e * e) / ((1.0 + e) * (1.0 + e));
  return {onset, std::hypot(onset, width)};
}

}  // namespace shakebed::fit
