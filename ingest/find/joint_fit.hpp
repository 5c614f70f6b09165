#pragma once
// The model of a frame (a sum of identical beads) and the joint least squares of all their centres.

#include <cstddef>
#include <vector>

#include "ingest/calibrate/calibration.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// One bead of the model.
struct ModelDisk {
  double x = 0, y = 0;                                    // centre, px of the frame
  double last_step = 1e9;                                 // px, length of its last move
  int quiet_sweeps = 0;                                   // sweeps in a row in which it did not move
  double hessian_xx = 0, hessian_xy = 0, hessian_yy = 0;  // of half the sum of squares, contrast^2/px^2
  double explained = 0;                                   // share of the contrast around it that it explains, 1 at best
  double amplitude = 1;                                   // its own contrast over the typical one
  double former_x = 0, former_y = 0;                      // where it was before it was moved elsewhere on suspicion ...
  double former_unexplained = -1;  // ... and what it left unexplained there; negative: was not moved
  double rim_explained = 1;        // the worst quarter of it, likewise
  double best_explained = 1;       // and the best
};

struct CentreCovariance {
  double xx = 0, xy = 0, yy = 0;  // px^2; 0 where it is unknown
};

// A bead's profile tabulated against the squared distance, so that no square root is taken per pixel.
class ProfileTable {
 public:
  ProfileTable() = default;
  // `softening_px` > 0 widens the gradient used for the steps (not the model): beads further off are then drawn in.
  // `overlaps`: false for residuals alone, without steps or covariances.
  ProfileTable(const BeadProfile& profile, double radius_px, double edge_px, double softening_px, bool overlaps = true);
  [[nodiscard]] double reach() const { return reach_; }
  [[nodiscard]] double at(double squared_distance) const;
  // Overlap of the gradients of two beads `distance_px` apart, along the line of centres and across it, as a share of
  // one bead's own, of each component.
  struct Overlap {
    double along = 0, across = 0;
  };
  [[nodiscard]] Overlap overlap(double distance_px) const;

 private:
  friend class JointFit;
  double reach_ = 0;
  double relaxation_ = 1;  // Newton steps along the widened gradient are this much too long near the solution
  double overlap_from_px_ = 0, overlap_step_px_ = 0;
  std::vector<Overlap> overlaps_;
  void prepare_overlaps(double radius_px, double edge_px);
  float inverse_step_ = 0;
  int last_ = 0;
  std::vector<float> level_, rise_, soft_rise_;
  std::shared_ptr<const BeadAsymmetry> asymmetry_;
  bool fourth_ = false;
  std::vector<float> fourth_level_;  // p4(r)/r^4
};

// Residual image of one frame and the beads that explain it.
class JointFit {
 public:
  // `flat`: flattened frame, 0 background, 1 bead.
  explicit JointFit(const GrayFrame& flat);
  void set_table(const ProfileTable* table) { table_ = table; }
  [[nodiscard]] double reach() const { return table_->reach(); }

  // Adds or takes out one bead's contrast (sign +1 takes the model's part out of the residual).
  void subtract(double x, double y, float sign);
  // Residual := flat frame minus all beads.
  void reset(const GrayFrame& flat, const std::vector<ModelDisk>& disks);
  // One Gauss-Seidel sweep of Newton steps, each at most `largest_step` px. Beads that moved less than `tolerance`
  // twice are left alone. Residuals count at most `bound` in size (contrast
  // units), so that what is no bead at all, a dark base say, hardly pulls. Returns the largest move.
  double sweep(std::vector<ModelDisk>& disks, double largest_step, double tolerance, double bound);
  // One Newton step of all beads at once: where blur makes touching beads share pixels, sweeps creep and this does
  // not. The coupling of two beads is that of two whole beads; what it leaves is taken up by the next step. `flat` as
  // in reset(). Beads whose last move was below `still`, as were those of all that share pixels with them, stay where
  // they are. Returns the largest move, at most `largest_step` px.
  double step_together(const GrayFrame& flat, std::vector<ModelDisk>& disks, double largest_step, double bound,
                       double still = 0);
  // Covariances of the centres under white noise of one contrast unit per pixel, with the neighbours' places unknown as
  // well. Blur makes touching beads share pixels: with known neighbours the errors would be too small. From the
  // curvatures of the last step. (Neighbours of neighbours are eliminated one by one.)
  [[nodiscard]] std::vector<CentreCovariance> covariances(const std::vector<ModelDisk>& disks) const;
  // Fills explained, amplitude, rim_explained of each bead, within `radius` px of its centre.
  void judge(std::vector<ModelDisk>& disks, double radius) const;
  // Residual (flat frame minus model) at a pixel.
  [[nodiscard]] float residual(int column, int row) const {
    return residual_[static_cast<std::size_t>(row) * stride_ + static_cast<std::size_t>(column)];
  }
  [[nodiscard]] float* residual_row(int row) { return residual_.data() + static_cast<std::size_t>(row) * stride_; }
  [[nodiscard]] const float* residual_row(int row) const {
    return residual_.data() + static_cast<std::size_t>(row) * stride_;
  }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] GrayFrame residual_image() const;
  // How often a bead's pull was worked out: what fitting costs, on any machine.
  [[nodiscard]] std::size_t steps() const { return steps_; }
  // Number of pixels whose residual, averaged over 2 x 2, exceeds `level`.
  [[nodiscard]] double strong_pixels(float level) const;

 private:
  // Half the sum of squares around a bead: its curvature (into `disk`) and its descent, per px.
  struct Descent {
    double x = 0, y = 0;
  };
  Descent descent_of(ModelDisk& disk, float bound);
  // Of two beads that share pixels, the off-diagonal block of the Hessian: symmetric.
  struct Coupling {
    double xx = 0, xy = 0, yy = 0;
  };
  // What eliminating a bead takes from the block of one that is coupled to it: C H^-1 C.
  [[nodiscard]] static Coupling eliminated(const ModelDisk& disk, const Coupling& pair);
  [[nodiscard]] Coupling coupling_of(const ModelDisk& one, const ModelDisk& other) const;
  void move(double old_x, double old_y, double new_x, double new_y);
  int width_, height_;
  std::size_t stride_;
  std::vector<float> residual_;
  std::size_t steps_ = 0;
  const ProfileTable* table_ = nullptr;
};

}  // namespace shakebed::ingest
