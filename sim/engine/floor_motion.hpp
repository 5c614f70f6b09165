// How the floor moves, and when a disk in free flight next meets it. Reduced units.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/scene/floor.hpp"

namespace shakebed::sim {

class FloorMotion {
 public:
  explicit FloorMotion(const StillFloor& = {});
  explicit FloorMotion(const SinusoidalFloor& floor);
  explicit FloorMotion(const TabulatedFloor& floor);

  struct Motion {
    double position, velocity, acceleration;
  };
  // At now + later, counted from a whole number of periods; the rounding of that sum does not count.
  Motion motion(double now, double later = 0) const;
  double position(double time) const { return motion(time).position; }
  double velocity(double time) const { return motion(time).velocity; }

  bool moves() const { return kind_ != Kind::still; }
  double period() const { return period_; }    // 1 for a floor that stands still
  double highest() const { return highest_; }  // no position lies above
  double lowest() const { return lowest_; }    // none lies below
  double largest_upward_acceleration() const { return largest_acceleration_; }

  // The first time t in [0, horizon], from `now`, at which a freely flying point meets the floor from above; `never` if
  // there is none. The point starts at height `bottom` with upward velocity vz. A point at the floor or, by rounding,
  // just below it counts as touching. It meets the floor at 0 if it approaches, else at its next fall.
  //
  // Most points stay above parabolas that the floor does not reach (bounds_), until the horizon or for a while: no sine
  // is computed there. From there on the gap is F(t) = bottom + vz t - g t^2/2 - floor(t). It has F'' >= -M, with M = g
  // + max floor'' over the step. From any t with F >= 0 the parabola F + F' h - M h^2/2 lies below the gap. So its root
  // can never step over a crossing. Near a simple root the steps converge like Newton's or better, as M nears F''. Near
  // a tangent root they approach it slowly from the safe side. At the result the gap is 0 but for rounding. A touching
  // point leaves the floor where the floor falls faster than the point: that is no contact.
  double time_to_contact(double bottom, double vz, double gravity, double now, double horizon) const;

 private:
  enum class Kind { still, sinusoidal, tabulated };
  double growth(const Motion& floor, double later) const;
  void note_bounds();
  double time_above_bound(double bottom, double vz, double gravity, double now) const;

  Kind kind_ = Kind::still;
  double amplitude_ = 0, frequency_ = 0, angular_frequency_ = 0, period_ = 1;
  double highest_ = 0, lowest_ = 0, largest_acceleration_ = 0, largest_jerk_ = 0;
  std::vector<double> heights_, curvatures_;  // spline knots: value and second derivative
  double spacing_ = 0;
  // A period in parts: from anywhere in part k on the floor stays for bounded_for_ below the parabola bounds_[k], which
  // counts from the part's beginning.
  static constexpr std::int64_t parts = 64, bounded_parts = 8;
  std::vector<Motion> bounds_;
  double part_ = 0, parts_a_time_ = 0, bounded_for_ = 0;
};

}  // namespace shakebed::sim
