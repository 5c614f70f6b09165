// When a falling point meets the shaken floor, against 60-digit arithmetic.
//
// The reference does not step: it cuts the flight where the gap's second derivative vanishes (known in closed form),
// finds the one root of the first derivative that each piece can hold, and so has intervals on which the gap is
// monotone. The first of these on which it falls through zero holds the crossing; nothing can be missed or invented.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <cmath>
#include <numbers>
#include <tuple>
#include <vector>

#include "sim/engine/contact_time.hpp"
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/random.hpp"
#include "tests/physics/law.hpp"

namespace shakebed::sim::floor_roots_law {
namespace {

using tests::expect_law;
using Digits60 = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<60>, boost::multiprecision::et_off>;

struct Flight {
  double bottom, vz, now;
};

template <class Real>
const Real& two_pi() {
  static const Real value = 2 * acos(Real(-1));
  return value;
}
template <>
const long double& two_pi<long double>() {
  static const long double value = 2 * std::numbers::pi_v<long double>;
  return value;
}

// A flight over a sinusoidal floor, g = 1. All numbers given are doubles, taken as exact.
template <class Real>
class Reference {
 public:
  Reference(const SinusoidalFloor& floor, const Flight& flight, double periods_before = 0)
      : a_(floor.amplitude),
        w_(two_pi<Real>() * floor.frequency),
        bottom_(flight.bottom),
        vz_(flight.vz),
        now_(Real(periods_before) / floor.frequency + flight.now) {}

  Real gap(const Real& t) const {
    using std::sin;
    return bottom_ + (vz_ - t / 2) * t - a_ * sin(w_ * (now_ + t));
  }
  Real rate(const Real& t) const {
    using std::cos;
    return vz_ - t - a_ * w_ * cos(w_ * (now_ + t));
  }
  Real bend(const Real& t) const {
    using std::sin;
    return -1 + a_ * w_ * w_ * sin(w_ * (now_ + t));
  }

  // The times between which the gap is monotone, from 0 to one after `until` where the point is below the floor.
  std::vector<Real> turning_points(const Real& until) const {
    using std::asin, std::ceil, std::sqrt;
    const Real end = vz_ + sqrt(vz_ * vz_ + 2 * (bottom_ + 2 * a_)) + 1;
    std::vector<Real> cuts{Real(0)};
    const Real peak = a_ * w_ * w_;
    if (peak > 1) {
      const Real first = asin(1 / peak), second = two_pi<Real>() / 2 - first;  // phases where the gap does not bend
      Real cycle = ceil((w_ * now_ - second) / two_pi<Real>());
      for (;; cycle += 1) {
        const Real t1 = (cycle * two_pi<Real>() + first) / w_ - now_,
                   t2 = (cycle * two_pi<Real>() + second) / w_ - now_;
        if (t1 > 0 && t1 < end) cuts.push_back(t1);
        if (t2 > 0 && t2 < end) cuts.push_back(t2);
        if (t1 >= end) break;
      }
    }
    cuts.push_back(end);
    std::vector<Real> turns{Real(0)};
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      const Real left = rate(cuts[i]), right = rate(cuts[i + 1]);
      if ((left < 0) == (right < 0)) continue;
      turns.push_back(root(
          cuts[i], cuts[i + 1], [&](const Real& t) { return rate(t); }, [&](const Real& t) { return bend(t); }));
      const Real here = gap(turns.back());
      if (turns.back() > until && here < 0 && here < gap(turns[turns.size() - 2])) return turns;
    }
    turns.push_back(end);
    return turns;
  }

  // The first time at which the gap falls through zero.
  Real first_crossing(const std::vector<Real>& turns) const {
    Real left = gap(turns[0]);
    for (std::size_t i = 0; i + 1 < turns.size(); ++i) {
      const Real right = gap(turns[i + 1]);
      if (right < left && right < 0) {
        if (left <= 0) return turns[i];
        return root(
            turns[i], turns[i + 1], [&](const Real& t) { return gap(t); }, [&](const Real& t) { return rate(t); });
      }
      left = right;
    }
    throw std::logic_error("a point that never falls");
  }

 private:
  // Of a function that changes sign once between left and right: Newton's steps kept between them.
  template <class F, class Slope>
  static Real root(Real left, Real right, F f, Slope slope) {
    using std::abs;
    const bool falls = f(left) > 0;
    const Real least = abs(right) * (4 * std::numeric_limits<Real>::epsilon());
    Real t = (left + right) / 2, last = right - left;
    for (int i = 0; i < 1000 && right - left > least; ++i) {
      const Real value = f(t);
      ((value > 0) == falls ? left : right) = t;
      const Real tangent = slope(t);
      Real next = tangent == 0 ? left : t - value / tangent;
      if (!(next > left && next < right) || 2 * abs(next - t) > last) next = (left + right) / 2;
      last = abs(next - t);
      t = next;
      if (last <= least) break;
    }
    return t;
  }

  Real a_, w_, bottom_, vz_, now_;
};

// What is found in many flights, worst first.
struct Verdict {
  double gap = 0;         // at the time returned, of its terms
  double dip = 0;         // below the floor before that time, of the terms: a crossing missed
  double time_error = 0;  // in periods, of crossings that are not tangent
  int tangent = 0, flights = 0;
  int referred = 0;  // from extended precision to 60 digits
};

constexpr double gap_limit = 1e-15, time_limit = 1e-14;

template <class Real>
void judge(Verdict& verdict, const SinusoidalFloor& floor, const FloorMotion& motion, const Flight& flight,
           double periods_before = 0) {
  const double t = motion.time_to_contact(flight.bottom, flight.vz, 1, flight.now, never);
  ASSERT_TRUE(std::isfinite(t) && t >= 0) << "bottom " << flight.bottom << " vz " << flight.vz << " now " << flight.now;
  const Reference<Real> exact(floor, flight, periods_before);
  const std::vector<Real> turns = exact.turning_points(Real(t));
  const double terms = std::abs(flight.bottom) + std::abs(flight.vz * t) + 0.5 * t * t + floor.amplitude;
  const double gap = std::abs(static_cast<double>(exact.gap(Real(t)))) / terms;
  double dip = 0;
  for (const Real& turn : turns) {
    if (turn > 0 && turn < t) dip = std::max(dip, -static_cast<double>(exact.gap(turn)) / terms);
  }
  const Real truth = exact.first_crossing(turns);
  const double rate = std::abs(static_cast<double>(exact.rate(truth)));
  const bool tangent = rate * 1e-14 / floor.frequency < 2e-15 * terms;
  // One that only grazes, within rounding, before the crossing is on the safe side.
  const bool grazes_before = t < truth && std::abs(static_cast<double>(exact.rate(Real(t)))) < 1e-6;
  const double error = static_cast<double>(Real(t) - truth) * floor.frequency;
  const bool compared = !tangent && !grazes_before;
  if constexpr (std::is_same_v<Real, long double>) {
    // Extended precision knows gaps to 1e-19 of their terms. Whatever comes within a factor of 2 of a limit goes to 60
    // digits, and so does a time that it finds wrong because it cannot tell a graze from a hit.
    if (gap > gap_limit / 2 || dip > gap_limit / 2 || (compared && std::abs(error) > time_limit / 2)) {
      ++verdict.referred;
      judge<Digits60>(verdict, floor, motion, flight, periods_before);
      return;
    }
  }
  ++verdict.flights;
  verdict.tangent += !compared;
  verdict.gap = std::max(verdict.gap, gap);
  verdict.dip = std::max(verdict.dip, dip);
  if (compared) verdict.time_error = std::max(verdict.time_error, std::abs(error));
  if (gap > gap_limit || dip > gap_limit || (compared && std::abs(error) > time_limit)) {
    static int shown = 0;
    if (++shown <= 5)
      std::printf(
          "  a = %.17g f = %.17g bottom %.17g vz %.17g now %.17g: t = %.17g, true %.17g, gap %.3g dip %.3g rate %.3g\n",
          floor.amplitude, floor.frequency, flight.bottom, flight.vz, flight.now, t, static_cast<double>(truth), gap,
          dip, rate);
  }
}

void expect_no_fault(const char* name, const Verdict& verdict) {
  std::printf("  %s: %d flights, %d tangent", name, verdict.flights, verdict.tangent);
  std::printf(verdict.referred > 0 ? ", %d judged by 60 digits\n" : "\n", verdict.referred);
  expect_law("gap at the time returned, of its terms", verdict.gap, 0, 0, gap_limit);
  expect_law("dip below the floor before, of the terms (missed)", verdict.dip, 0, 0, gap_limit);
  expect_law("time, not tangent [periods]", verdict.time_error, 0, 0, time_limit);
}

SinusoidalFloor floor_of(double gamma, double frequency) {
  const double w = 2 * std::numbers::pi * frequency;
  return {gamma / (w * w), frequency};
}

template <class Real>
Verdict judge_random(int flights, std::uint64_t seed) {
  Random random(seed);
  Verdict verdict;
  for (int k = 0; k < flights; ++k) {
    // Gamma from 0.1 to 30, frequencies in sqrt(g/D) from 0.1 to 3: a from 1e-4 to 80 D.
    const SinusoidalFloor floor = floor_of(0.1 * std::pow(300, random.uniform()), 0.1 * std::pow(30, random.uniform()));
    const FloorMotion motion(floor);
    Flight flight{0, 0, random.uniform() / floor.frequency};
    flight.bottom = motion.position(flight.now) + 2 * floor.amplitude * random.uniform();
    flight.vz = floor.amplitude * 2 * std::numbers::pi * floor.frequency * random.normal_pair().first;
    judge<Real>(verdict, floor, motion, flight);
  }
  return verdict;
}

// Each kind of hard flight in turn.
template <class Real>
Verdict judge_adversarial(int flights, std::uint64_t seed, int only = -1) {
  Random random(seed);
  Verdict verdict;
  const double offsets[] = {0, 1e-16, -1e-16, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6};
  const auto offset = [&] { return offsets[random.below(11)]; };
  for (int k = 0; k < flights; ++k) {
    const int kind = only >= 0 ? only : k % 7;
    const double frequency = 0.1 * std::pow(30, random.uniform());
    double gamma = 1.05 + 10 * random.uniform();
    if (kind == 5) gamma = 1 + (random.below(2) == 0 ? -1e-12 : 1e-12);
    const SinusoidalFloor floor = floor_of(gamma, frequency);
    const FloorMotion motion(floor);
    const double w = 2 * std::numbers::pi * frequency, period = 1 / frequency;
    Flight flight{0, 0, random.uniform() * period};
    double periods_before = 0;
    switch (kind) {
      case 0:    // grazes the crest: gap and its rate vanish together at `at`, from above (the gap bends upwards) ...
      case 1:    // ... the same to within a little: a miss, or two crossings close together
      case 2: {  // ... where the bend vanishes too: three crossings in one
        const double first = std::asin(1 / gamma), second = std::numbers::pi - first;
        const double phase =
            kind == 2 ? (random.below(2) ? first : second) : first + (second - first) * random.uniform();
        const double ahead = 0.3 * period * random.uniform(), at = phase / w;
        flight.now = at - ahead + period;
        flight.vz = motion.velocity(at) + ahead;
        flight.bottom = motion.position(at) - (flight.vz - 0.5 * ahead) * ahead;
        if (kind == 1) flight.bottom += offset() * floor.amplitude;
        if (motion.position(flight.now) > flight.bottom) continue;
        break;
      }
      case 3:  // at rest on the floor, to within a little
        flight.bottom = motion.position(flight.now);
        flight.vz = motion.velocity(flight.now) + offset() * floor.amplitude * w;
        break;
      case 4:  // just bounced: leaves the floor slowly
        flight.bottom = motion.position(flight.now);
        flight.vz = motion.velocity(flight.now) + std::pow(10, -12 * random.uniform()) * floor.amplitude * w;
        break;
      case 5:  // Gamma = 1 +- 1e-12, at rest or lifting off near the phase where the floor falls as fast as the point
        flight.now = (0.25 + offset() + 1e-3 * (random.uniform() - 0.5)) * period;
        flight.bottom = motion.position(flight.now) + std::abs(offset()) * floor.amplitude;
        flight.vz = motion.velocity(flight.now) + offset() * floor.amplitude * w;
        break;
      default:  // after 2^40 periods: the engine counts its time from a whole number of them
        periods_before = 0x1p40;
        flight.bottom = motion.position(flight.now) + 2 * floor.amplitude * random.uniform();
        flight.vz = floor.amplitude * w * random.normal_pair().first;
        break;
    }
    judge<Real>(verdict, floor, motion, flight, periods_before);
  }
  return verdict;
}

TEST(FloorRoots, AgreeWith60DigitsOnRandomFlights) {
  expect_no_fault("random, 60 digits", judge_random<Digits60>(150, 31));
}
TEST(FloorRoots, AgreeWithExtendedPrecisionOnRandomFlights) {
  expect_no_fault("random, extended precision", judge_random<long double>(15'000, 32));
}
TEST(FloorRoots, AgreeWith60DigitsOnAdversarialFlights) {
  for (int k = 0; k < 7; ++k) expect_no_fault("adversarial, 60 digits", judge_adversarial<Digits60>(25, 33, k));
}

// 1e7 random flights and 1e5 adversarial ones, in parts of a quarter of a minute; those at Gamma = 1 +- 1e-12, whose
// turning points all but coincide, take 60 digits some minutes a part.
class ManyFloorRoots : public testing::TestWithParam<int> {};

TEST_P(ManyFloorRoots, AgreeWithExtendedPrecisionAnd60Digits) {
  expect_no_fault("random, extended precision and 60 digits",
                  judge_random<long double>(1'000'000, 34 + static_cast<std::uint64_t>(GetParam())));
}
INSTANTIATE_TEST_SUITE_P(Million, ManyFloorRoots, testing::Range(0, 10));

constexpr const char* kinds[] = {"grazes the crest",     "grazes within a little", "triple crossing",
                                 "at rest on the floor", "leaves it slowly",       "Gamma = 1 +- 1e-12",
                                 "after 2^40 periods"};
class AdversarialFloorRoots : public testing::TestWithParam<std::tuple<int, int> > {};

TEST_P(AdversarialFloorRoots, AgreeWith60Digits) {
  const auto [kind, part] = GetParam();
  expect_no_fault(kinds[kind],
                  judge_adversarial<Digits60>(5'200, 60 + static_cast<std::uint64_t>(7 * part + kind), kind));
}
INSTANTIATE_TEST_SUITE_P(KindAndPart, AdversarialFloorRoots,
                         testing::Combine(testing::Range(0, 7), testing::Range(0, 3)));
// Of the first three kinds some begin below the floor and are left out: one part more makes up for them.
INSTANTIATE_TEST_SUITE_P(KindAndOnePartMore, AdversarialFloorRoots,
                         testing::Combine(testing::Range(0, 3), testing::Values(3)));

}  // namespace
}  // namespace shakebed::sim::floor_roots_law
