// Where hard disks stand for real beads: the study of record as data [docs/soft-spheres.md].
#pragma once

#include <span>
#include <string>

namespace shakebed::pipelines {

// A bed of the study: T_x and T_z of hard disks with the default t_c over those of soft spheres that touch for 10 us,
// with standard errors.
struct HardDiskBed {
  double restitution, friction, column_number, gamma;
  double ratio_x, error_x, ratio_z, error_z;
};
std::span<const HardDiskBed> hard_disk_study();
// Their t_c [sqrt(D/g)].
inline constexpr double contact_duration_of_study = 1e-4;

struct HardDiskScene {
  double restitution = 1, friction = 0, tangential_restitution = 0, gamma = 0, column_number = 0;
};
struct HardDiskTrust {
  bool covered = false;  // by a bed of the study that is near enough and decides
  bool agrees = true;    // nothing is known against it
  std::string why, advice;
};
// By the nearest bed of the study with friction, or without.
HardDiskTrust trust_in_hard_disks(const HardDiskScene& scene);

}  // namespace shakebed::pipelines
