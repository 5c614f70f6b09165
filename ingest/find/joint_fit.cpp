#include "ingest/find/joint_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/nearby.hpp"
#include "ingest/find/vector_lanes.hpp"
#include "ingest/frames/smooth_field.hpp"
#include "ingest/frames/stop_question.hpp"

namespace shakebed::ingest {

namespace {

double interpolate(const std::vector<float>& samples, double step, double r) {
  const double place = r / step;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= samples.size()) return 0;
  const double part = place - static_cast<double>(cell);
  return static_cast<double>(samples[cell]) * (1 - part) + static_cast<double>(samples[cell + 1]) * part;
}

float dot(const float* one, const float* other, std::size_t count) {
  Floats sum{}, a, b;
  std::size_t k = 0;
  for (; k + lanes <= count; k += lanes) {
    load(one + k, a), load(other + k, b);
    sum += a * b;
  }
  float rest = ingest::sum_of(sum);
  for (; k < count; ++k) rest += one[k] * other[k];
  return rest;
}

}  // namespace

ProfileTable::ProfileTable(const BeadProfile& profile, double radius_px, double edge_px, double softening_px,
                           bool overlaps) {
  reach_ = profile.reach_px();
  asymmetry_ = profile.asymmetry;
  const double resolution = std::clamp(0.05 * edge_px, 0.01, 0.06);
  const double step = 2 * radius_px * resolution;
  inverse_step_ = static_cast<float>(1 / step);
  last_ = static_cast<int>(std::ceil(reach_ * reach_ / step));
  const std::size_t count = static_cast<std::size_t>(last_) + 1;
  level_.assign(count + 1, 0.0F);  // and one more, for gather_with_next()
  rise_.assign(count, 0.0F);
  for (std::size_t i = 0; i < count; ++i)
    level_[i] =
        static_cast<float>(interpolate(profile.level, profile.step_px, std::sqrt(static_cast<double>(i) * step)));
  level_[count - 1] = 0;
  for (std::size_t i = 0; i + 1 < count; ++i) rise_[i] = level_[i + 1] - level_[i];
  soft_rise_ = rise_;
  if (softening_px > 0) {
    std::vector<double> soft(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double r = std::sqrt(static_cast<double>(i) * step);
      double sum = 0, weights = 0;
      for (int k = -10; k <= 10; ++k) {
        const double offset = 0.25 * k;
        const double weight = std::exp(-0.5 * offset * offset);
        sum += weight * interpolate(profile.level, profile.step_px, std::abs(r + offset * softening_px));
        weights += weight;
      }
      soft[i] = sum / weights;
    }
    for (std::size_t i = 0; i + 1 < count; ++i) soft_rise_[i] = static_cast<float>(soft[i + 1] - soft[i]);
    // A small move changes the residual by the true gradient: sums over area of soft^2 against soft times true.
    double soft_soft = 0, soft_true = 0;
    for (std::size_t i = 0; i + 1 < count; ++i) {
      const double squared = (static_cast<double>(i) + 0.5) * step;
      soft_soft += squared * static_cast<double>(soft_rise_[i] * soft_rise_[i]);
      soft_true += squared * static_cast<double>(soft_rise_[i] * rise_[i]);
    }
    if (soft_true > soft_soft) relaxation_ = soft_soft / soft_true;
  }
  if (overlaps) prepare_overlaps(radius_px, edge_px);
  fourth_ = std::any_of(profile.fourth_harmonic.begin(), profile.fourth_harmonic.end(), [](float v) { return v != 0; });
  if (fourth_) {
    fourth_level_.assign(count + 1, 0.0F);
    for (std::size_t i = 1; i + 1 < count; ++i) {
      const double squared = static_cast<double>(i) * step;
      fourth_level_[i] = static_cast<float>(interpolate(profile.fourth_harmonic, profile.step_px, std::sqrt(squared)) /
                                            (squared * squared));
    }
  }
}

void ProfileTable::prepare_overlaps(double radius_px, double edge_px) {
  // Sums over the lens that two beads share, one at (0, 0), the other at (distance, 0): by symmetry the blocks are
  // diagonal. Beads nearer than overlap_from_px are on their way out; what they get need only be roughly right.
  // Distances are whole cells of one grid, so each bead's gradients are looked up once.
  const double cell = edge_px < 1 ? 0.25 : 0.5;  // px: a part of the edge, in which the gradients lie
  const int from = static_cast<int>(1.4 * radius_px / cell), by = std::max(1, static_cast<int>(0.2 * edge_px / cell));
  overlap_from_px_ = from * cell, overlap_step_px_ = by * cell;
  const int rows = static_cast<int>(std::ceil(reach_ / cell)), columns = 2 * rows;
  struct Gradient {
    std::vector<float> x, y;
  };
  const auto gradient_of = [&](const std::vector<float>& rise) {
    const auto size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
    Gradient gradient{std::vector<float>(size), std::vector<float>(size)};
    for (int row = 0, at = 0; row < rows; ++row)  // and its mirror image
      for (int column = 0; column < columns; ++column, ++at) {
        const double x = cell * (column - rows + 0.5), y = cell * (row + 0.5);
        const double place = (x * x + y * y) * static_cast<double>(inverse_step_);
        const float slope = place < last_ ? rise[static_cast<std::size_t>(place)] : 0.0F;
        const auto to = static_cast<std::size_t>(at);
        gradient.x[to] = slope * static_cast<float>(x), gradient.y[to] = slope * static_cast<float>(y);
      }
    return gradient;
  };
  const Gradient soft = gradient_of(soft_rise_), sharp = gradient_of(rise_);
  const auto sums = [&](int distance) {
    float along = 0, across = 0;
    for (int row = 0; row < rows; ++row) {
      const auto line = static_cast<std::size_t>(row) * static_cast<std::size_t>(columns);
      const auto shift = static_cast<std::size_t>(distance);
      const auto common = static_cast<std::size_t>(columns - distance);
      along += dot(&soft.x[line + shift], &sharp.x[line], common);
      across += dot(&soft.y[line + shift], &sharp.y[line], common);
    }
    return Overlap{static_cast<double>(along), static_cast<double>(across)};
  };
  const Overlap own = sums(0);
  if (!(own.along > 0)) return;
  for (int distance = from; distance < columns; distance += by) {
    const Overlap overlap = sums(distance);
    overlaps_.push_back({overlap.along / own.along, overlap.across / own.along});
  }
  overlaps_.push_back({0, 0});
}

ProfileTable::Overlap ProfileTable::overlap(double distance_px) const {
  const double place = std::max(0.0, distance_px - overlap_from_px_) / overlap_step_px_;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= overlaps_.size()) return {};
  const double part = place - static_cast<double>(cell);
  const Overlap &a = overlaps_[cell], &b = overlaps_[cell + 1];
  return {a.along + part * (b.along - a.along), a.across + part * (b.across - a.across)};
}

double ProfileTable::at(double squared_distance) const {
  const double place = squared_distance * static_cast<double>(inverse_step_);
  if (place >= last_) return 0;
  const auto cell = static_cast<std::size_t>(place);
  return static_cast<double>(level_[cell]) + (place - static_cast<double>(cell)) * static_cast<double>(rise_[cell]);
}

JointFit::JointFit(const GrayFrame& flat)
    : width_(flat.width),
      height_(flat.height),
      stride_(static_cast<std::size_t>(flat.width) + 2 * lanes),
      residual_(stride_ * static_cast<std::size_t>(flat.height), 0.0F) {
  reset(flat, {});
}

void JointFit::reset(const GrayFrame& flat, const std::vector<ModelDisk>& disks) {
  for (int row = 0; row < height_; ++row) {
    const float* from = flat.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_);
    std::copy(from, from + width_, residual_row(row));
  }
  for (const ModelDisk& disk : disks) subtract(disk.x, disk.y, 1.0F);
}

void JointFit::subtract(double x, double y, float sign) {
  const ProfileTable& table = *table_;
  const double reach = table.reach_;
  const int top = std::max(0, static_cast<int>(std::ceil(y - reach)));
  const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(y + reach)));
  const float inverse = table.inverse_step_;
  const int last = table.last_;
  const float* level = table.level_.data();
  for (int row = top; row <= bottom; ++row) {
    const double dy = row - y;
    const double half = std::sqrt(std::max(0.0, reach * reach - dy * dy));
    const int left = std::max(0, static_cast<int>(std::ceil(x - half)));
    const int right = std::min(width_ - 1, static_cast<int>(std::floor(x + half)));
    const int count = right - left + 1;
    if (count <= 0) continue;
    const float dy_squared = static_cast<float>(dy * dy);
    const float dx0 = static_cast<float>(left - x);
    float* line = residual_row(row) + left;
    for (int k = 0; k < count; k += lanes) {
      const Floats dx = dx0 + (static_cast<float>(k) + lane_numbers);
      const Floats place = (dx * dx + dy_squared) * inverse;
      Ints cell = __builtin_convertvector(place, Ints);
      cell = cell < last ? cell : last;
      Floats base, next, present;
      gather_with_next(level, cell, base, next);
      const Floats part = place - __builtin_convertvector(cell, Floats);
      Floats value = base + part * (next - base);
      if (table.fourth_) {
        gather_with_next(table.fourth_level_.data(), cell, base, next);
        const Floats a = dx * dx;
        value += (base + part * (next - base)) * (a * a - 6 * a * dy_squared + dy_squared * dy_squared);
      }
      load(line + k, present);
      store(present - sign * value, line + k);
    }
    if (table.asymmetry_) table.asymmetry_->add_to_row(line, left, count, x, dy, -sign);
  }
}

void JointFit::move(double old_x, double old_y, double new_x, double new_y) {
  const ProfileTable& table = *table_;
  if (table.fourth_ || table.asymmetry_ || std::abs(new_x - old_x) > 2 || std::abs(new_y - old_y) > 2) {
    subtract(old_x, old_y, -1.0F);
    subtract(new_x, new_y, 1.0F);
    return;
  }
  const double reach = table.reach_;
  const int top = std::max(0, static_cast<int>(std::ceil(std::min(old_y, new_y) - reach)));
  const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(std::max(old_y, new_y) + reach)));
  const float inverse = table.inverse_step_;
  const int last = table.last_;
  const float* level = table.level_.data();
  for (int row = top; row <= bottom; ++row) {
    const double old_dy = row - old_y, new_dy = row - new_y;
    const double half = std::sqrt(std::max(0.0, reach * reach - std::min(old_dy * old_dy, new_dy * new_dy)));
    const int left = std::max(0, static_cast<int>(std::ceil(std::min(old_x, new_x) - half)));
    const int right = std::min(width_ - 1, static_cast<int>(std::floor(std::max(old_x, new_x) + half)));
    const int count = right - left + 1;
    if (count <= 0) continue;
    const float old_squared = static_cast<float>(old_dy * old_dy), new_squared = static_cast<float>(new_dy * new_dy);
    const float old_dx0 = static_cast<float>(left - old_x), new_dx0 = static_cast<float>(left - new_x);
    float* line = residual_row(row) + left;
    for (int k = 0; k < count; k += lanes) {
      const Floats column = static_cast<float>(k) + lane_numbers;
      const Floats a = old_dx0 + column, b = new_dx0 + column;
      const Floats old_place = (a * a + old_squared) * inverse, new_place = (b * b + new_squared) * inverse;
      Ints old_cell = __builtin_convertvector(old_place, Ints), new_cell = __builtin_convertvector(new_place, Ints);
      old_cell = old_cell < last ? old_cell : last;
      new_cell = new_cell < last ? new_cell : last;
      Floats old_base, old_next, new_base, new_next, present;
      gather_with_next(level, old_cell, old_base, old_next);
      gather_with_next(level, new_cell, new_base, new_next);
      const Floats before = old_base + (old_place - __builtin_convertvector(old_cell, Floats)) * (old_next - old_base);
      const Floats after = new_base + (new_place - __builtin_convertvector(new_cell, Floats)) * (new_next - new_base);
      load(line + k, present);
      store(present + (before - after), line + k);
    }
  }
}

JointFit::Descent JointFit::descent_of(ModelDisk& disk, float bound) {
  ++steps_;
  const ProfileTable& table = *table_;
  const double reach = table.reach_;
  const float inverse = table.inverse_step_;
  const int last = table.last_;
  const float* rise = table.soft_rise_.data();
  const int top = std::max(0, static_cast<int>(std::ceil(disk.y - reach)));
  const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(disk.y + reach)));
  double xx = 0, xy = 0, yy = 0, bx = 0, by = 0;
  for (int row = top; row <= bottom; ++row) {
    const double dy = row - disk.y;
    const double half = std::sqrt(std::max(0.0, reach * reach - dy * dy));
    const int left = std::max(0, static_cast<int>(std::ceil(disk.x - half)));
    const int right = std::min(width_ - 1, static_cast<int>(std::floor(disk.x + half)));
    const int count = right - left + 1;
    if (count <= 0) continue;
    const float dy_squared = static_cast<float>(dy * dy);
    const float dx0 = static_cast<float>(left - disk.x);
    const float* line = residual_row(row) + left;
    Floats s_dd = {}, s_ddx = {}, s_ddxx = {}, s_e = {}, s_ex = {};
    for (int k = 0; k < count; k += lanes) {
      const Floats dx = dx0 + (static_cast<float>(k) + lane_numbers);
      const Floats place = (dx * dx + dy_squared) * inverse;
      Ints cell = __builtin_convertvector(place, Ints);
      cell = cell < last ? cell : last;
      cell = lane_indices < count - k ? cell : last;  // beyond the chord or the frame
      Floats d, e;
      gather(rise, cell, d);
      load(line + k, e);
      const Floats nothing = {};
      d = e < brightest_seen ? d : nothing;
      e = e < bound ? e : bound;
      e = e > -bound ? e : -bound;
      const Floats d_dx = d * dx;
      s_dd += d * d;
      s_ddx += d * d_dx;
      s_ddxx += d_dx * d_dx;
      s_e += e * d;
      s_ex += e * d_dx;
    }
    const float dd = sum_of(s_dd), ddx = sum_of(s_ddx), ddxx = sum_of(s_ddxx), e = sum_of(s_e), ex = sum_of(s_ex);
    xx += static_cast<double>(ddxx);
    xy += dy * static_cast<double>(ddx);
    yy += dy * dy * static_cast<double>(dd);
    bx += static_cast<double>(ex);
    by += dy * static_cast<double>(e);
  }
  // d model/d x0 = -2 P'(u) dx, P' = rise/step
  const double slope = -2 * static_cast<double>(inverse);
  disk.hessian_xx = xx * slope * slope;
  disk.hessian_xy = xy * slope * slope;
  disk.hessian_yy = yy * slope * slope;
  return {bx * slope, by * slope};
}

namespace {

// (H + damping) step = descent; false when H is not positive.
bool solve_own(const ModelDisk& disk, double bx, double by, double& step_x, double& step_y) {
  const double damping = 1e-9 + 1e-4 * (disk.hessian_xx + disk.hessian_yy);
  const double xx = disk.hessian_xx + damping, yy = disk.hessian_yy + damping, xy = disk.hessian_xy;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0)) return false;
  step_x = (yy * bx - xy * by) / determinant;
  step_y = (xx * by - xy * bx) / determinant;
  return true;
}

// A matrix of 2 x 2 blocks, one for each bead of a group; the lower triangle is filled.
class BlockMatrix {
 public:
  explicit BlockMatrix(std::size_t beads) : size_(2 * beads), values_(size_ * size_, 0.0) {}
  void add(std::size_t row, std::size_t column, double xx, double xy, double yy) {
    values_[2 * row * size_ + 2 * column] += xx;
    values_[2 * row * size_ + 2 * column + 1] += xy;
    values_[(2 * row + 1) * size_ + 2 * column] += xy;
    values_[(2 * row + 1) * size_ + 2 * column + 1] += yy;
  }
  // The first bead's block of the inverse, times `factor`; 0 where the matrix is not positive definite.
  [[nodiscard]] CentreCovariance covariance_of_first(double factor) const {
    std::array<std::array<double, 2>, 2> inverse{};
    for (std::size_t k = 0; k < 2; ++k) {
      std::vector<double> left = values_, right(size_, 0.0);
      right[k] = 1;
      if (!solve_symmetric(left, right, size_)) return {};
      inverse[k] = {right[0], right[1]};
    }
    return {factor * inverse[0][0], factor * inverse[0][1], factor * inverse[1][1]};
  }

 private:
  std::size_t size_;
  std::vector<double> values_;
};

}  // namespace

double JointFit::sweep(std::vector<ModelDisk>& disks, double largest_step, double tolerance, double bound) {
  const float most = static_cast<float>(bound);
  double largest = 0;
  for (ModelDisk& disk : disks) {
    if (disk.quiet_sweeps >= 2) continue;
    const Descent descent = descent_of(disk, most);
    double step_x = 0, step_y = 0;
    if (!solve_own(disk, descent.x, descent.y, step_x, step_y)) {
      disk.last_step = 0;
      ++disk.quiet_sweeps;
      continue;
    }
    step_x *= table_->relaxation_;
    step_y *= table_->relaxation_;
    const double length = std::hypot(step_x, step_y);
    if (length > largest_step) {
      step_x *= largest_step / length;
      step_y *= largest_step / length;
    }
    disk.last_step = std::min(length, largest_step);
    largest = std::max(largest, disk.last_step);
    disk.quiet_sweeps = disk.last_step < tolerance ? disk.quiet_sweeps + 1 : 0;
    if (disk.last_step < 1e-6) continue;
    move(disk.x, disk.y, disk.x + step_x, disk.y + step_y);
    disk.x += step_x;
    disk.y += step_y;
  }
  return largest;
}

JointFit::Coupling JointFit::coupling_of(const ModelDisk& one, const ModelDisk& other) const {
  const double dx = other.x - one.x, dy = other.y - one.y, squared = dx * dx + dy * dy;
  if (squared < 1e-6) return {};
  const auto [along, across] = table_->overlap(std::sqrt(squared));
  // Of a bead cut by the border only a part is there to be shared.
  const double scale = 0.5 * std::sqrt((one.hessian_xx + one.hessian_yy) * (other.hessian_xx + other.hessian_yy));
  const double along_more = scale * (along - across) / squared;
  return {scale * across + along_more * dx * dx, along_more * dx * dy, scale * across + along_more * dy * dy};
}

JointFit::Coupling JointFit::eliminated(const ModelDisk& disk, const Coupling& pair) {
  const double damping = 1e-9 + 1e-4 * (disk.hessian_xx + disk.hessian_yy);
  const double xx = disk.hessian_xx + damping, yy = disk.hessian_yy + damping, xy = disk.hessian_xy;
  const double determinant = xx * yy - xy * xy;
  if (!(determinant > 0)) return {};
  const double a = (pair.xx * yy - pair.xy * xy) / determinant, b = (pair.xy * xx - pair.xx * xy) / determinant;
  const double c = (pair.xy * yy - pair.yy * xy) / determinant, d = (pair.yy * xx - pair.xy * xy) / determinant;
  return {a * pair.xx + b * pair.xy, a * pair.xy + b * pair.yy, c * pair.xy + d * pair.yy};
}

std::vector<CentreCovariance> JointFit::covariances(const std::vector<ModelDisk>& disks) const {
  const Nearby near(disks.size(), 2 * table_->reach_, [&](std::size_t i) { return std::pair(disks[i].x, disks[i].y); });
  std::vector<std::vector<std::size_t>> groups(disks.size());  // each bead, then those that share pixels with it
  for (std::size_t i = 0; i < disks.size(); ++i) groups[i].push_back(i);
  near.pairs([&](std::size_t a, std::size_t b) {
    groups[a].push_back(b);
    groups[b].push_back(a);
    return false;
  });
  std::vector<CentreCovariance> all;
  for (const auto& group : groups) {
    BlockMatrix matrix(group.size());
    for (std::size_t a = 0; a < group.size(); ++a) {
      const ModelDisk& one = disks[group[a]];
      const double damping = 1e-9 + 1e-4 * (one.hessian_xx + one.hessian_yy);
      matrix.add(a, a, one.hessian_xx + damping, one.hessian_xy, one.hessian_yy + damping);
      for (std::size_t b = 0; b < a; ++b) {
        const Coupling pair = coupling_of(one, disks[group[b]]);
        matrix.add(a, b, pair.xx, pair.xy, pair.yy);
      }
      // What lies beyond the group is eliminated bead by bead: its own block's Schur complement.
      for (const std::size_t beyond : groups[group[a]]) {
        if (std::find(group.begin(), group.end(), beyond) != group.end()) continue;
        const Coupling lost = eliminated(disks[beyond], coupling_of(one, disks[beyond]));
        matrix.add(a, a, -lost.xx, -lost.xy, -lost.yy);
      }
    }
    const double factor = table_->relaxation_ * table_->relaxation_;
    all.push_back(matrix.covariance_of_first(factor));
    if (all.back().xx > 0 && all.back().yy > 0) continue;
    const ModelDisk& own = disks[group.front()];  // couplings are approximate: beads nearly on top of one another
    BlockMatrix alone(1);
    alone.add(0, 0, own.hessian_xx, own.hessian_xy, own.hessian_yy);
    all.back() = alone.covariance_of_first(factor);
  }
  return all;
}

namespace {

constexpr std::size_t stays = static_cast<std::size_t>(-1);

// Two beads that share pixels, by their places among those that move, with the off-diagonal block of the Hessian:
// symmetric.
struct CoupledPair {
  std::size_t one, other;
  double xx, xy, yy;
};

double product(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

// The beads that take part in a step: those whose last one was `still` or more, and their neighbours.
std::vector<std::size_t> moving_beads(const std::vector<ModelDisk>& disks, const Nearby& near, double still) {
  std::vector<char> moves(disks.size());
  for (std::size_t i = 0; i < disks.size(); ++i) moves[i] = disks[i].last_step >= still;
  if (still > 0) {
    std::vector<std::size_t> woken;
    near.pairs([&](std::size_t a, std::size_t b) {
      if (moves[a] != moves[b]) woken.push_back(moves[a] ? b : a);
      return false;
    });
    for (const std::size_t i : woken) moves[i] = 1;
  }
  std::vector<std::size_t> moving;
  for (std::size_t i = 0; i < disks.size(); ++i)
    if (moves[i]) moving.push_back(i);
  return moving;
}

// Newton's step of all beads at once, two numbers a bead: by conjugate gradients, each bead's own 2 x 2 block taken out
// beforehand.
class NewtonStep {
 public:
  NewtonStep(const std::vector<ModelDisk>& disks, const std::vector<std::size_t>& moving,
             const std::vector<CoupledPair>& pairs)
      : disks_(disks), moving_(moving), pairs_(pairs) {}

  std::vector<double> operator()(const std::vector<double>& descent) const {
    const std::size_t size = descent.size();
    std::vector<double> step(size, 0.0), left = descent, towards(size), image(size);
    own_solution(left, towards);
    std::vector<double> direction = towards;
    double norm = product(left, towards);
    const double enough = 1e-6 * norm;  // a thousandth of the step
    constexpr int most_rounds = 60;
    for (int round = 0; round < most_rounds && norm > enough; ++round) {
      apply(direction, image);
      const double curvature = product(direction, image);
      if (!(curvature > 0)) break;  // not a minimum that way: what was found so far is a descent all the same
      const double length = norm / curvature;
      for (std::size_t k = 0; k < size; ++k) {
        step[k] += length * direction[k];
        left[k] -= length * image[k];
      }
      own_solution(left, towards);
      const double next = product(left, towards);
      for (std::size_t k = 0; k < size; ++k) direction[k] = towards[k] + next / norm * direction[k];
      norm = next;
    }
    return step;
  }

 private:
  void own_solution(const std::vector<double>& from, std::vector<double>& to) const {
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      to[2 * i] = to[2 * i + 1] = 0;
      solve_own(disks_[moving_[i]], from[2 * i], from[2 * i + 1], to[2 * i], to[2 * i + 1]);
    }
  }

  // The damped Hessian times a direction.
  void apply(const std::vector<double>& direction, std::vector<double>& image) const {
    for (std::size_t i = 0; i < moving_.size(); ++i) {
      const ModelDisk& disk = disks_[moving_[i]];
      const double damping = 1e-9 + 1e-4 * (disk.hessian_xx + disk.hessian_yy);
      const double x = direction[2 * i], y = direction[2 * i + 1];
      image[2 * i] = (disk.hessian_xx + damping) * x + disk.hessian_xy * y;
      image[2 * i + 1] = disk.hessian_xy * x + (disk.hessian_yy + damping) * y;
    }
    for (const CoupledPair& pair : pairs_) {
      const std::size_t a = 2 * pair.one, b = 2 * pair.other;
      const double xx = pair.xx, xy = pair.xy, yy = pair.yy;
      image[a] += xx * direction[b] + xy * direction[b + 1];
      image[a + 1] += xy * direction[b] + yy * direction[b + 1];
      image[b] += xx * direction[a] + xy * direction[a + 1];
      image[b + 1] += xy * direction[a] + yy * direction[a + 1];
    }
  }

  const std::vector<ModelDisk>& disks_;
  const std::vector<std::size_t>& moving_;
  const std::vector<CoupledPair>& pairs_;
};

}  // namespace

double JointFit::step_together(const GrayFrame& flat, std::vector<ModelDisk>& disks, double largest_step, double bound,
                               double still) {
  StopQuestion::ask();
  const Nearby near(disks.size(), 2 * table_->reach_, [&](std::size_t i) { return std::pair(disks[i].x, disks[i].y); });
  const std::vector<std::size_t> moving = moving_beads(disks, near, still);
  const std::size_t n = moving.size();
  if (n == 0) return 0;
  std::vector<std::size_t> place(disks.size(), stays);
  std::vector<double> descent(2 * n);
  for (std::size_t i = 0; i < n; ++i) {
    place[moving[i]] = i;
    const Descent one = descent_of(disks[moving[i]], static_cast<float>(bound));
    descent[2 * i] = table_->relaxation_ * one.x;
    descent[2 * i + 1] = table_->relaxation_ * one.y;
  }
  std::vector<CoupledPair> pairs;
  near.pairs([&](std::size_t a, std::size_t b) {
    if (place[a] == stays || place[b] == stays) return false;
    const Coupling block = coupling_of(disks[a], disks[b]);
    pairs.push_back({place[a], place[b], block.xx, block.xy, block.yy});
    return false;
  });
  const std::vector<double> step = NewtonStep(disks, moving, pairs)(descent);
  double largest = 0;
  const bool few = 4 * n < disks.size();  // then each is taken from the residual and put back on its own
  for (std::size_t i = 0; i < n; ++i) {
    ModelDisk& disk = disks[moving[i]];
    const double length = std::hypot(step[2 * i], step[2 * i + 1]);
    const double share = length > largest_step ? largest_step / length : 1.0;
    const double x = disk.x + share * step[2 * i], y = disk.y + share * step[2 * i + 1];
    if (few) move(disk.x, disk.y, x, y);
    disk.x = x;
    disk.y = y;
    disk.last_step = share * length;
    largest = std::max(largest, disk.last_step);
  }
  if (!few) reset(flat, disks);
  return largest;
}

void JointFit::judge(std::vector<ModelDisk>& disks, double radius) const {
  const ProfileTable& table = *table_;
  const double limit = radius * radius;
  for (ModelDisk& disk : disks) {
    const int top = std::max(0, static_cast<int>(std::ceil(disk.y - radius)));
    const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(disk.y + radius)));
    std::array<double, 4> left_over{}, contrast{};  // by quarters of the disk
    double cross = 0;
    for (int row = top; row <= bottom; ++row) {
      const double dy = row - disk.y;
      const double half = std::sqrt(std::max(0.0, limit - dy * dy));
      const int left = std::max(0, static_cast<int>(std::ceil(disk.x - half)));
      const int right = std::min(width_ - 1, static_cast<int>(std::floor(disk.x + half)));
      const int count = right - left + 1;
      if (count <= 0) continue;
      const float dy_squared = static_cast<float>(dy * dy);
      const float dx0 = static_cast<float>(left - disk.x);
      const float* line = residual_row(row) + left;
      Floats left_side = {}, right_side = {}, own_left = {}, own_right = {}, both = {};
      for (int k = 0; k < count; k += lanes) {
        const Floats dx = dx0 + (static_cast<float>(k) + lane_numbers);
        const Floats place = (dx * dx + dy_squared) * table.inverse_step_;
        Ints cell = __builtin_convertvector(place, Ints);
        cell = cell < table.last_ ? cell : table.last_;
        Floats own, e;
        gather(table.level_.data(), cell, own);
        load(line + k, e);
        const Ints inside = (lane_indices < count - k) & (e < brightest_seen);
        const Floats nothing = {};
        own = inside ? own : nothing;
        e = inside ? e : nothing;
        const Ints on_left = dx < 0.0F;
        const Floats e_squared = e * e, own_squared = own * own;
        left_side += on_left ? e_squared : nothing;
        right_side += on_left ? nothing : e_squared;
        own_left += on_left ? own_squared : nothing;
        own_right += on_left ? nothing : own_squared;
        both += (e + own) * own;
      }
      const std::size_t quarter = dy < 0 ? 2 : 0;
      left_over[quarter] += static_cast<double>(sum_of(left_side));
      left_over[quarter + 1] += static_cast<double>(sum_of(right_side));
      contrast[quarter] += static_cast<double>(sum_of(own_left));
      contrast[quarter + 1] += static_cast<double>(sum_of(own_right));
      cross += static_cast<double>(sum_of(both));
    }
    double all_left = 0, all_contrast = 0, worst = 1, best = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      all_left += left_over[k];
      all_contrast += contrast[k];
      if (!(contrast[k] > 0)) continue;
      worst = std::min(worst, 1 - left_over[k] / contrast[k]);
      best = std::max(best, 1 - left_over[k] / contrast[k]);
    }
    disk.explained = all_contrast > 0 ? 1 - all_left / all_contrast : 0;
    disk.rim_explained = worst;
    disk.best_explained = best;
    disk.amplitude = all_contrast > 0 ? cross / all_contrast : 0;
  }
}

double JointFit::strong_pixels(float level) const {
  std::size_t count = 0;
  for (int row = 0; row + 1 < height_; row += 2) {
    const float* a = residual_row(row);
    const float* b = residual_row(row + 1);
    int strong = 0;
    for (int column = 0; column + 1 < width_; column += 2) {
      const float sum = a[column] + a[column + 1] + b[column] + b[column + 1];
      strong += sum > 4 * level && sum < brightest_seen;
    }
    count += static_cast<std::size_t>(strong);
  }
  return 4.0 * static_cast<double>(count);
}

GrayFrame JointFit::residual_image() const {
  GrayFrame image;
  image.width = width_;
  image.height = height_;
  image.pixels.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int row = 0; row < height_; ++row) {
    const float* from = residual_row(row);
    std::copy(from, from + width_, image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * width_);
  }
  return image;
}

}  // namespace shakebed::ingest
