#pragma once
// Velocities and kinetic temperatures from disks linked between frames that follow closely.

#include <cstddef>
#include <string>
#include <vector>

#include "ingest/profile/measure_bed.hpp"

namespace shakebed::ingest {

struct FrameFindings;

// Share of the disks found again in the next frame below which frames are no film: links themselves are in doubt.
constexpr double enough_followed = 0.9;
// Factor of the finite-time correction beyond which velocities are no measure of T. Of eleven simulated beds, filmed at
// 100 to 3,500 pictures a second (D = 2 mm), T was wrong by a factor of up to 13 beyond it. Below it T was wrong by up
// to a quarter, and within two of its errors.
constexpr double largest_correction = 2;
// D between two frames; beyond it neighbours could be mistaken for one another.
constexpr double longest_step = 0.45;

struct VelocityOptions {
  double frame_rate_hz = 0;  // required, > 0
  double gravity_m_per_s2 = 9.81;
  double largest_step = longest_step;
  double flow_bin_width = 1.0;  // D: the mean flow is that of each height bin and each pair of frames
};

// One disk followed from frame to the next.
struct Link {
  std::size_t frame = 0;         // the earlier of the two
  std::size_t from = 0, to = 0;  // places in Measurement::disks
};

struct KineticTemperature {
  double over_mg_m = 0;            // T/(m g), m: <(v - flow)^2>/g of one component
  double std_error_m = 0;          // by windows of frames, and finite_time_error
  double localisation_bias_m = 0;  // what was taken off: 2 sigma^2/(g dt^2)
  double finite_time_factor = 1;   // what it was multiplied by: 1 + the loss of speed over dt by collisions
  double finite_time_error = 0;    // share of T that this correction may be wrong by
  // The same of displacements over the time between frames, before the correction.
  double displacement_m = 0, displacement_error_m = 0;
};

struct VelocityMeasurement {
  KineticTemperature horizontal, vertical;
  std::size_t links = 0;
  double linked_share = 0;            // of the disks that could have been linked
  double mean_step = 0;               // D between frames
  std::vector<std::string> warnings;  // plain sentences, e.g. that the frames follow too slowly
  // Enough disks are found again in the next frame.
  [[nodiscard]] bool enough_are_followed() const { return linked_share >= enough_followed; }
  // The same, and they have hardly collided meanwhile: there is a temperature.
  [[nodiscard]] bool usable() const {
    return enough_are_followed() && horizontal.finite_time_factor <= largest_correction &&
           vertical.finite_time_factor <= largest_correction;
  }
};

// Links each disk to the only one nearer than largest_step in the next frame, if both agree that they are nearest.
std::vector<Link> link_disks(const Measurement& measurement, double largest_step);

// Share of the disks of these frames that are found again in the frame after theirs, in those of the frames that have
// one. Of pictures at unrelated times it is up to 0.6 in a dense bed.
double followed_share(const std::vector<FrameFindings>& frames, double diameter_px);

// T_x and T_z of the linked disks. The flow of each height bin in each pair of frames is subtracted; the lost degree of
// freedom per bin is restored. The localisation error's share, by the stated variances, is subtracted. The finite-time
// loss follows from the velocity's own correlation between successive steps, C(dt)/C(0) = exp(-dt/tau). The mean over
// dt of such a velocity has 2 (x - 1 + exp(-x))/x^2 of the variance, x = dt/tau. Each height bin of each pair of frames
// has its own tau, together with its neighbours, as far as it can be distinguished from that of all. Throws
// std::invalid_argument without a frame rate.
VelocityMeasurement measure_velocities(const Measurement& measurement, const VelocityOptions& options);

// The same while frames arrive, in bounded memory. Stretches of `stretch_frames` frames are measured one after another,
// each beginning with the last frame of the one before. T is their mean; its error is by windows of them.
class VelocityMeter {
 public:
  // `bead_diameter_m`: D in metres.
  VelocityMeter(double bead_diameter_m, const VelocityOptions& options, std::size_t stretch_frames = 50);
  void add(const std::vector<MeasuredDisk>& disks_of_frame);
  VelocityMeasurement result();

 private:
  void measure_stretch();
  double bead_diameter_m_;
  VelocityOptions options_;
  std::size_t stretch_frames_;
  Measurement stretch_;
  std::size_t frames_ = 0;  // in the stretch
  std::vector<VelocityMeasurement> measured_;
};

}  // namespace shakebed::ingest
