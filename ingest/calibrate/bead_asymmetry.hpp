#pragma once
// What a bead lit from one side adds to its radial profile: lit and dark side, a highlight beside the middle.

#include <array>
#include <cstddef>
#include <mutex>
#include <vector>

namespace shakebed::ingest {

// a(r, theta) = sum over m = 1 .. 6 of c_m(r) cos(m theta) + s_m(r) sin(m theta), in units of the bead's contrast,
// theta from x towards y. Fixed once made; any number of beads can be drawn with it.
class BeadAsymmetry {
 public:
  static constexpr int orders = 6;
  struct Harmonics {
    double step_px = 0;
    std::array<std::vector<double>, orders> cosine, sine;  // m - 1; at r = 0, step_px, ...; 0 beyond
  };
  explicit BeadAsymmetry(Harmonics harmonics);
  [[nodiscard]] const Harmonics& harmonics() const { return harmonics_; }
  [[nodiscard]] double at(double dx, double dy) const;
  // Rms over the disk of that radius of what differs from one side to the opposite one (odd m).
  [[nodiscard]] double one_sidedness(double radius_px) const;

  // Adds `sign` times the asymmetry of a bead at x_px to `count` pixels of one row from column `left` on; `dy_px` is
  // the row less the bead's y.
  void add_to_row(float* row, int left, int count, double x_px, double dy_px, float sign) const;

 private:
  // The same harmonics, all of one distance beside one another, for at(): c_1, s_1, c_2, s_2 ...
  using Ring = std::array<double, 2 * std::size_t{orders}>;
  Harmonics harmonics_;
  std::vector<Ring> rings_;
  double reach_ = 0;
  // Sampled `finer_` times as finely as pixels, columns of one phase beside one another. Row j, phase p, place k hold
  // the value at dx = k - side_ - p/finer_, dy = j/finer_ - side_.
  // Taken when the first bead is drawn: of large beads they are a million values, and many that are learned are not
  // used.
  int finer_ = 4, side_ = 0;
  mutable std::once_flag sampled_;
  mutable std::vector<float> samples_;
  void sample() const;
  [[nodiscard]] const float* line(int j, int phase) const;
};

}  // namespace shakebed::ingest
