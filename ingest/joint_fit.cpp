#include "ingest/joint_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "ingest/vector_lanes.hpp"

namespace shakebed::ingest {

namespace {

double interpolate(const std::vector<float>& samples, double step, double r) {
  const double place = r / step;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= samples.size()) return 0;
  const double part = place - static_cast<double>(cell);
  return static_cast<double>(samples[cell]) * (1 - part) + static_cast<double>(samples[cell + 1]) * part;
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
      const Floats dx = dx0 + (static_cast<float>(k) + lane_numbers);
      const Floats place = (dx * dx + dy_squared) * inverse;
      Ints cell = __builtin_convertvector(place, Ints);
      cell = cell < last ? cell : last;
      Floats base, slope, present;
      gather(level, cell, base);
      gather(rise, cell, slope);
      const Floats part = place - __builtin_convertvector(cell, Floats);
      Floats value = base + part * slope;
      if (table.fourth_) {
        gather(table.fourth_level_.data(), cell, base);
        gather(table.fourth_rise_.data(), cell, slope);
        const Floats a = dx * dx;
        value += (base + part * slope) * (a * a - 6 * a * dy_squared + dy_squared * dy_squared);
      }
      load(line + k, present);
      store(present - sign * value, line + k);
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
      const Floats column = static_cast<float>(k) + lane_numbers;
      const Floats a = old_dx0 + column, b = new_dx0 + column;
      const Floats old_place = (a * a + old_squared) * inverse, new_place = (b * b + new_squared) * inverse;
      Ints old_cell = __builtin_convertvector(old_place, Ints), new_cell = __builtin_convertvector(new_place, Ints);
      old_cell = old_cell < last ? old_cell : last;
      new_cell = new_cell < last ? new_cell : last;
      Floats old_base, old_slope, new_base, new_slope, present;
      gather(level, old_cell, old_base);
      gather(rise, old_cell, old_slope);
      gather(level, new_cell, new_base);
      gather(rise, new_cell, new_slope);
      const Floats before = old_base + (old_place - __builtin_convertvector(old_cell, Floats)) * old_slope;
      const Floats after = new_base + (new_place - __builtin_convertvector(new_cell, Floats)) * new_slope;
      load(line + k, present);
      store(present + (before - after), line + k);
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
        e = e < most ? e : most;
        e = e > -most ? e : -most;
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
        const Ints inside = lane_indices < count - k;
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
    double all_left = 0, all_contrast = 0, worst = 1;
    for (std::size_t k = 0; k < 4; ++k) {
      all_left += left_over[k];
      all_contrast += contrast[k];
      if (contrast[k] > 0) worst = std::min(worst, 1 - left_over[k] / contrast[k]);
    }
    disk.explained = all_contrast > 0 ? 1 - all_left / all_contrast : 0;
    disk.rim_explained = worst;
    disk.amplitude = all_contrast > 0 ? cross / all_contrast : 0;
  }
}

double JointFit::strong_pixels(float level) const {
  std::size_t count = 0;
  for (int row = 0; row + 1 < height_; row += 2) {
    const float* a = residual_row(row);
    const float* b = residual_row(row + 1);
    int strong = 0;
    for (int column = 0; column + 1 < width_; column += 2)
      strong += a[column] + a[column + 1] + b[column] + b[column + 1] > 4 * level;
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
