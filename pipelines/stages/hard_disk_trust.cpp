#include "pipelines/stages/hard_disk_trust.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace shakebed::pipelines {
namespace {

// Measured by `ctest -L study -R SoftSpheres -V` against tests/physics/reference/soft_spheres.csv. With friction, the
// disks have the tangential restitution e^1.75 of the spheres' spring.
// clang-format off
constexpr std::array studied_beds{
    HardDiskBed{0.6, 0, 4.85, 2, 0.981, 0.076, 0.965, 0.085},
    HardDiskBed{0.6, 0, 15.5, 3, 0.962, 0.033, 1.048, 0.049},
    HardDiskBed{0.6, 0.5, 4.85, 6, 1.149, 0.172, 0.945, 0.076},
    HardDiskBed{0.6, 0.5, 15.5, 4, 1.063, 0.080, 0.954, 0.057},
    HardDiskBed{0.8, 0, 4.85, 3, 0.995, 0.017, 1.018, 0.009},
    HardDiskBed{0.8, 0, 15.5, 2, 0.949, 0.047, 0.959, 0.043},
    HardDiskBed{0.8, 0.5, 4.85, 4, 1.048, 0.023, 0.993, 0.013},
    HardDiskBed{0.8, 0.5, 15.5, 6, 1.019, 0.067, 0.975, 0.013},
    HardDiskBed{0.9, 0, 4.85, 4, 1.020, 0.012, 1.012, 0.017},
    HardDiskBed{0.9, 0.5, 4.85, 3, 0.989, 0.013, 0.995, 0.009},
    HardDiskBed{0.9, 0.5, 15.5, 2, 0.937, 0.095, 0.956, 0.098},
    HardDiskBed{0.95, 0, 4.85, 6, 1.012, 0.035, 1.048, 0.034},
    HardDiskBed{0.95, 0.5, 4.85, 2, 1.017, 0.042, 1.010, 0.041},
};
// clang-format on

// Soft and hard differ where T_x or T_z do by more than this and so many errors; they agree where the errors are
// smaller than this and they do not. Else the study has not decided.
constexpr double agreement = 0.05, significant = 2.0;
// Distances between two beds, of 1 each: a factor of two in 1 - e, of 1.5 in Gamma, of two in N D/W. A bed stands for
// those nearer than this.
constexpr double dissipation_factor = 2, gamma_factor = 1.5, column_factor = 2, farthest = 1.2;
// From this friction on a bed is one with friction.
constexpr double least_friction = 0.05;
// With friction, T falls by up to a quarter where the tangential restitution is 0 and not that of an elastic bead,
// e^1.75 (e = 0.9, 0.95; docs/soft-spheres.md).
constexpr double rough_restitution = 0.85;

double steps(double a, double b, double factor) { return std::log(a / b) / std::log(factor); }

double distance(const HardDiskScene& scene, const HardDiskBed& bed) {
  return std::hypot(steps(1 - scene.restitution, 1 - bed.restitution, dissipation_factor),
                    steps(scene.gamma, bed.gamma, gamma_factor),
                    steps(scene.column_number, bed.column_number, column_factor));
}

const HardDiskBed* nearest(const HardDiskScene& scene) {
  const HardDiskBed* best = nullptr;
  for (const HardDiskBed& bed : studied_beds) {
    if ((scene.friction >= least_friction) != (bed.friction > 0)) continue;
    if (best == nullptr || distance(scene, bed) < distance(scene, *best)) best = &bed;
  }
  return best != nullptr && distance(scene, *best) <= farthest ? best : nullptr;
}

bool differs(double ratio, double error) { return std::abs(ratio - 1) > agreement + significant * error; }
bool differs(const HardDiskBed& bed) { return differs(bed.ratio_x, bed.error_x) || differs(bed.ratio_z, bed.error_z); }
bool agrees(const HardDiskBed& bed) { return !differs(bed) && std::max(bed.error_x, bed.error_z) <= agreement; }

std::string of_bed(const HardDiskBed& bed) {
  return fmt::format(
      "e = {:g}, friction {:g}, Gamma = {:g}, N D/W = {:.3g}: T_x {:+.2g} ± {:.2g} %, T_z {:+.2g} ± {:.2g} %",
      bed.restitution, bed.friction, bed.gamma, bed.column_number, 100 * (bed.ratio_x - 1), 100 * bed.error_x,
      100 * (bed.ratio_z - 1), 100 * bed.error_z);
}

}  // namespace

std::span<const HardDiskBed> hard_disk_study() { return studied_beds; }

HardDiskTrust trust_in_hard_disks(const HardDiskScene& scene) {
  HardDiskTrust trust;
  if (scene.restitution >= 1 || !(scene.gamma > 0) || !(scene.column_number > 0)) return trust;
  if (const HardDiskBed* bed = nearest(scene); bed != nullptr && (differs(*bed) || agrees(*bed))) {
    trust.covered = true;
    trust.agrees = agrees(*bed);
    trust.why = fmt::format("{} soft spheres that touch for 10 us in the nearest bed of the study ({})",
                            trust.agrees ? "hard disks agree with" : "hard disks differ from", of_bed(*bed));
    if (!trust.agrees)
      trust.advice = "Add this difference to the stated errors, or use soft spheres (docs/soft-spheres.md)";
  }
  if (scene.friction >= least_friction && scene.restitution >= rough_restitution &&
      scene.tangential_restitution < 0.5) {
    trust.agrees = false;
    trust.why = fmt::format(
        "with friction {:g} and no tangential restitution T is 10 to 25 % lower than that of elastic beads, whose "
        "contacts give back tangential energy",
        scene.friction);
    trust.advice = fmt::format(
        "Give \"tangential_restitution\" of the disks and of the floor: {:.2f} is the value of a linear spring at this "
        "e",
        std::pow(scene.restitution, 1.75));
  }
  return trust;
}

}  // namespace shakebed::pipelines
