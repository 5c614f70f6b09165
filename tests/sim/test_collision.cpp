#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "sim/engine/collision.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/restitution.hpp"

namespace shakebed::sim {
namespace {

struct Body {
  double vx, vz, spin, mass, radius;
};
double energy(const Body& b, double q) {
  return 0.5 * b.mass * (b.vx * b.vx + b.vz * b.vz + q * b.radius * b.radius * b.spin * b.spin);
}

// Two viscoelastic spheres by their equation of motion, x'' + beta x' sqrt(x) + x^(3/2) = 0 from x = 0, x' = 1 until
// the force is 0 [MuellerPoeschel2011, scaled]: -x' then.
double restitution_by_integration(double beta) {
  const auto force = [beta](double x, double v) {
    const double root = std::sqrt(std::max(x, 0.0));
    return -(beta * v * root + root * root * root);
  };
  double x = 1e-12, v = 1;
  for (constexpr double h = 2e-4;;) {
    const double a1 = force(x, v), a2 = force(x + h / 2 * v, v + h / 2 * a1),
                 a3 = force(x + h / 2 * (v + h / 2 * a1), v + h / 2 * a2),
                 a4 = force(x + h * (v + h / 2 * a2), v + h * a3);
    x += h * v + h * h / 6 * (a1 + a2 + a3);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    if (v < 0 && force(x, v) >= 0) return -v;
  }
}

TEST(Restitution, OfViscoelasticSpheresFollowsTheirEquationOfMotion) {
  for (const double beta : {0.01, 0.05, 0.1, 0.3})
    EXPECT_NEAR(viscoelastic_restitution(std::sqrt(beta)), restitution_by_integration(beta), 1e-3) << beta;
  EXPECT_NEAR(viscoelastic_restitution(1), restitution_by_integration(1), 6e-3);
}

// beta grows as v^(1/5): a surface that has e at v0 has at 3 v0 what the equation of motion gives with beta 3^(1/5).
TEST(Restitution, DependsOnSpeedAsItsLawSays) {
  const Contact viscoelastic(Surface{restitution_by_integration(0.1), 0, 0, RestitutionLaw::viscoelastic, 0.5});
  EXPECT_NEAR(viscoelastic.restitution_at(0.5), restitution_by_integration(0.1), 1e-12);
  EXPECT_NEAR(viscoelastic.restitution_at(1.5), restitution_by_integration(0.1 * std::pow(3, 0.2)), 1e-3);
  EXPECT_NEAR(viscoelastic.restitution_at(0.005), restitution_by_integration(0.1 * std::pow(0.01, 0.2)), 1e-3);
  const Contact power(Surface{0.8, 0, 0, RestitutionLaw::power, 0.5});
  EXPECT_DOUBLE_EQ(power.restitution_at(0.5), 0.8);
  EXPECT_DOUBLE_EQ(power.restitution_at(5), 0.8);
  EXPECT_NEAR(power.restitution_at(0.05), 1 - 0.2 * std::pow(0.1, 0.75), 1e-15);
  EXPECT_EQ(Contact(Surface{0.8}).restitution_at(1e-6), 0.8);
}

TEST(SmoothImpulse, KeepsMomentumAndLosesTheEnergyItSays) {
  Random random(31);
  for (int trial = 0; trial < 100'000; ++trial) {
    const double angle = 6.283185307179586 * random.uniform(), nx = std::cos(angle), nz = std::sin(angle);
    const Random::Pair v1 = random.normal_pair(), v2 = random.normal_pair();
    const double e = random.uniform(), m1 = std::exp(random.normal_pair().first), m2 = 1;
    const double dvx = v2.first - v1.first, dvz = v2.second - v1.second;
    if (nx * dvx + nz * dvz >= 0) continue;
    const NormalImpulse j = smooth_impulse(TwoLanes{nx, nz}, TwoLanes{dvx, dvz}, 1, e);
    const double m12 = m1 * m2 / (m1 + m2);
    const Body a{v1.first, v1.second, 0, m1, 0.5}, b{v2.first, v2.second, 0, m2, 0.5};
    const double jx = -(1 + e) * j.normal[0] * j.approach, jz = -(1 + e) * j.normal[1] * j.approach;
    const Body a2{a.vx - m12 / m1 * jx, a.vz - m12 / m1 * jz, 0, m1, 0.5};
    const Body b2{b.vx + m12 / m2 * jx, b.vz + m12 / m2 * jz, 0, m2, 0.5};
    const double before = energy(a, 0.5) + energy(b, 0.5), after = energy(a2, 0.5) + energy(b2, 0.5);
    EXPECT_NEAR(after + m12 * j.dissipated, before, 1e-14 * before);
    EXPECT_NEAR(m1 * a2.vx + m2 * b2.vx, m1 * a.vx + m2 * b.vx, 1e-14 * (m1 + m2) * 4);
    EXPECT_NEAR(m1 * a2.vz + m2 * b2.vz, m1 * a.vz + m2 * b.vz, 1e-14 * (m1 + m2) * 4);
    // The normal approach is reversed and multiplied by e.
    EXPECT_NEAR(nx * (b2.vx - a2.vx) + nz * (b2.vz - a2.vz), -e * (nx * dvx + nz * dvz), 1e-13);
  }
}

TEST(WaltonImpulse, KeepsMomentumAndLosesTheEnergyItSays) {
  Random random(32);
  int sticking = 0, sliding = 0;
  for (int trial = 0; trial < 100'000; ++trial) {
    const double angle = 6.283185307179586 * random.uniform(), nx = std::cos(angle), nz = std::sin(angle);
    const Random::Pair v1 = random.normal_pair(), v2 = random.normal_pair(), w = random.normal_pair();
    const double q = trial % 2 ? 0.5 : 0.4;
    const Surface surface{random.uniform(), 2 * random.uniform(), -1 + 2 * random.uniform()};
    Body a{v1.first, v1.second, 2 * w.first, std::exp(random.normal_pair().first), 0.5};
    Body b{v2.first, v2.second, 2 * w.second, 1, 0.3};
    const double gn = (a.vx - b.vx) * nx + (a.vz - b.vz) * nz;
    if (gn <= 0) continue;
    const auto slip = [&] { return -(a.vx - b.vx) * nz + (a.vz - b.vz) * nx + a.radius * a.spin + b.radius * b.spin; };
    const double gt = slip(), m12 = a.mass * b.mass / (a.mass + b.mass);
    const RoughImpulse p = walton_impulse(nx, nz, gn, gt, m12, surface, 1 / q);
    const double before = energy(a, q) + energy(b, q);
    a.vx += p.px / a.mass;
    a.vz += p.pz / a.mass;
    b.vx -= p.px / b.mass;
    b.vz -= p.pz / b.mass;
    a.spin += p.tangential / (q * a.mass * a.radius);
    b.spin += p.tangential / (q * b.mass * b.radius);
    EXPECT_NEAR(energy(a, q) + energy(b, q) + p.dissipated, before, 1e-13 * before);
    EXPECT_NEAR((a.vx - b.vx) * nx + (a.vz - b.vz) * nz, -surface.restitution * gn, 1e-12);
    // Coulomb: the tangential impulse is at most mu_f times the normal one, or less where the contact sticks.
    const double normal = m12 * (1 + surface.restitution) * gn;
    if (std::abs(p.tangential) < surface.friction * normal * (1 - 1e-9)) {
      EXPECT_NEAR(slip(), -surface.tangential_restitution * gt, 1e-12);
      ++sticking;
    } else {
      EXPECT_NEAR(std::abs(p.tangential), surface.friction * normal, 1e-9 * normal);
      ++sliding;
    }
    EXPECT_GE(p.dissipated, -1e-15);
  }
  EXPECT_GT(sticking, 1000);
  EXPECT_GT(sliding, 1000);
}

}  // namespace
}  // namespace shakebed::sim
