#include "ingest/joint_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace shakebed::ingest {

namespace {

constexpr int lanes = 8;

double interpolate(const std::vector<float>& samples, double step, double r) {
  const double place = r / step;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= samples.size()) return 0;
  const double part = place - static_cast<double>(cell);
  return static_cast<double>(samples[cell]) * (1 - part) + static_cast<double>(samples[cell + 1]) * part;
}

// cos(4 theta) r^4
float fourth_shape(float dx, float dy) {
  const float a = dx * dx, b = dy * dy;
  return a * a - 6 * a * b + b * b;
}

}  // namespace

ProfileTable::ProfileTable(const BeadProfile& profile, double radius_px, double edge_px, double softening_px) {
  reach_ = profile.reach_px();
  const double resolution = std::clamp(0.05 * edge_px, 0.01, 0.06);
  const double step = 2 * radius_px * resolution;
  inverse_step_ = static_cast<float>(1 / step);
  last_ = static_cast<int>(std::ceil(reach_ * reach_ / step));
  const std::size_t count = static_cast<std::size_t>(last_) + 1;
  level_.resize(count);
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
  }
  fourth_ = std::any_of(profile.fourth_harmonic.begin(), profile.fourth_harmonic.end(), [](float v) { return v != 0; });
  if (fourth_) {
    fourth_level_.assign(count, 0.0F);
    fourth_rise_.assign(count, 0.0F);
    for (std::size_t i = 1; i + 1 < count; ++i) {
      const double squared = static_cast<double>(i) * step;
      fourth_level_[i] = static_cast<float>(interpolate(profile.fourth_harmonic, profile.step_px, std::sqrt(squared)) /
                                            (squared * squared));
    }
    for (std::size_t i = 0; i + 1 < count; ++i) fourth_rise_[i] = fourth_level_[i + 1] - fourth_level_[i];
  }
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
  const float* rise = table.rise_.data();
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
      std::array<float, lanes> value;
      for (int l = 0; l < lanes; ++l) {
        const float dx = dx0 + static_cast<float>(k + l);
        const float place = (dx * dx + dy_squared) * inverse;
        const int cell = std::min(static_cast<int>(place), last);
        value[static_cast<std::size_t>(l)] = level[cell] + (place - static_cast<float>(cell)) * rise[cell];
      }
      if (table.fourth_)
        for (int l = 0; l < lanes; ++l) {
          const float dx = dx0 + static_cast<float>(k + l);
          const float place = (dx * dx + dy_squared) * inverse;
          const int cell = std::min(static_cast<int>(place), last);
          value[static_cast<std::size_t>(l)] +=
              (table.fourth_level_[static_cast<std::size_t>(cell)] +
               (place - static_cast<float>(cell)) * table.fourth_rise_[static_cast<std::size_t>(cell)]) *
              fourth_shape(dx, static_cast<float>(dy));
        }
      for (int l = 0; l < lanes; ++l) line[k + l] -= sign * value[static_cast<std::size_t>(l)];
    }
  }
}

void JointFit::move(double old_x, double old_y, double new_x, double new_y) {
  const ProfileTable& table = *table_;
  if (table.fourth_ || std::abs(new_x - old_x) > 2 || std::abs(new_y - old_y) > 2) {
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
  const float* rise = table.rise_.data();
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
      std::array<float, lanes> change;
      for (int l = 0; l < lanes; ++l) {
        const float a = old_dx0 + static_cast<float>(k + l), b = new_dx0 + static_cast<float>(k + l);
        const float old_place = (a * a + old_squared) * inverse, new_place = (b * b + new_squared) * inverse;
        const int old_cell = std::min(static_cast<int>(old_place), last);
        const int new_cell = std::min(static_cast<int>(new_place), last);
        const float before = level[old_cell] + (old_place - static_cast<float>(old_cell)) * rise[old_cell];
        const float after = level[new_cell] + (new_place - static_cast<float>(new_cell)) * rise[new_cell];
        change[static_cast<std::size_t>(l)] = before - after;
      }
      for (int l = 0; l < lanes; ++l) line[k + l] += change[static_cast<std::size_t>(l)];
    }
  }
}

double JointFit::sweep(std::vector<ModelDisk>& disks, double largest_step, double tolerance, double bound) {
  const float most = static_cast<float>(bound);
  const ProfileTable& table = *table_;
  const double reach = table.reach_;
  const float inverse = table.inverse_step_;
  const int last = table.last_;
  const float* rise = table.soft_rise_.data();
  double largest = 0;
  for (ModelDisk& disk : disks) {
    if (disk.quiet_sweeps >= 2) continue;
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
      std::array<float, lanes> s_dd{}, s_ddx{}, s_ddxx{}, s_e{}, s_ex{};
      for (int k = 0; k < count; k += lanes)
        for (int l = 0; l < lanes; ++l) {
          const auto lane = static_cast<std::size_t>(l);
          const float dx = dx0 + static_cast<float>(k + l);
          const float place = (dx * dx + dy_squared) * inverse;
          const int cell = k + l < count ? std::min(static_cast<int>(place), last) : last;
          const float d = rise[cell];
          const float ddx = d * dx;
          const float e = std::min(most, std::max(-most, line[k + l]));
          s_dd[lane] += d * d;
          s_ddx[lane] += d * ddx;
          s_ddxx[lane] += ddx * ddx;
          s_e[lane] += e * d;
          s_ex[lane] += e * ddx;
        }
      float dd = 0, ddx = 0, ddxx = 0, e = 0, ex = 0;
      for (std::size_t lane = 0; lane < lanes; ++lane) {
        dd += s_dd[lane];
        ddx += s_ddx[lane];
        ddxx += s_ddxx[lane];
        e += s_e[lane];
        ex += s_ex[lane];
      }
      xx += static_cast<double>(ddxx);
      xy += dy * static_cast<double>(ddx);
      yy += dy * dy * static_cast<double>(dd);
      bx += static_cast<double>(ex);
      by += dy * static_cast<double>(e);
    }
    // d model/d x0 = -2 P'(u) dx, P' = rise/step
    const double slope = -2 * static_cast<double>(inverse);
    xx *= slope * slope;
    xy *= slope * slope;
    yy *= slope * slope;
    bx *= slope;
    by *= slope;
    disk.hessian_xx = xx;
    disk.hessian_xy = xy;
    disk.hessian_yy = yy;
    const double damping = 1e-9 + 1e-4 * (xx + yy);
    const double determinant = (xx + damping) * (yy + damping) - xy * xy;
    if (!(determinant > 0)) {
      disk.last_step = 0;
      ++disk.quiet_sweeps;
      continue;
    }
    double step_x = ((yy + damping) * bx - xy * by) / determinant;
    double step_y = ((xx + damping) * by - xy * bx) / determinant;
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

void JointFit::judge(std::vector<ModelDisk>& disks, double radius) const {
  const ProfileTable& table = *table_;
  const double limit = radius * radius;
  for (ModelDisk& disk : disks) {
    const int top = std::max(0, static_cast<int>(std::ceil(disk.y - radius)));
    const int bottom = std::min(height_ - 1, static_cast<int>(std::floor(disk.y + radius)));
    std::array<double, 8> left_over{}, contrast{};
    double cross = 0, square = 0;
    for (int row = top; row <= bottom; ++row) {
      const double dy = row - disk.y;
      const double half = std::sqrt(std::max(0.0, limit - dy * dy));
      const int left = std::max(0, static_cast<int>(std::ceil(disk.x - half)));
      const int right = std::min(width_ - 1, static_cast<int>(std::floor(disk.x + half)));
      const float* line = residual_row(row);
      std::array<float, 4> row_left{}, row_contrast{};
      float row_cross = 0, row_square = 0;
      const float dy_squared = static_cast<float>(dy * dy);
      for (int column = left; column <= right; ++column) {
        const float dx = static_cast<float>(column - disk.x);
        const float place = (dx * dx + dy_squared) * table.inverse_step_;
        const int cell = std::min(static_cast<int>(place), table.last_);
        const float own = table.level_[static_cast<std::size_t>(cell)];
        const float e = line[column];
        const std::size_t octant = (dx < 0 ? 1U : 0U) + (dx * dx > dy_squared ? 2U : 0U);
        row_left[octant] += e * e;
        row_contrast[octant] += own * own;
        row_cross += (e + own) * own;
        row_square += own * own;
      }
      for (std::size_t k = 0; k < 4; ++k) {
        left_over[k + (dy < 0 ? 4U : 0U)] += static_cast<double>(row_left[k]);
        contrast[k + (dy < 0 ? 4U : 0U)] += static_cast<double>(row_contrast[k]);
      }
      cross += static_cast<double>(row_cross);
      square += static_cast<double>(row_square);
    }
    double all_left = 0, all_contrast = 0, worst = 1;
    for (std::size_t k = 0; k < 8; ++k) {
      all_left += left_over[k];
      all_contrast += contrast[k];
      if (contrast[k] > 0) worst = std::min(worst, 1 - left_over[k] / contrast[k]);
    }
    disk.explained = all_contrast > 0 ? 1 - all_left / all_contrast : 0;
    disk.rim_explained = worst;
    disk.amplitude = square > 0 ? cross / square : 0;
  }
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
