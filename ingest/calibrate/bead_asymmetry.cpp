#include "ingest/calibrate/bead_asymmetry.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::ingest {

BeadAsymmetry::BeadAsymmetry(Harmonics harmonics) : harmonics_(std::move(harmonics)) {
  const std::size_t count = harmonics_.cosine.front().size();
  reach_ = count < 2 ? 0.0 : harmonics_.step_px * static_cast<double>(count - 1);
  side_ = static_cast<int>(std::ceil(reach_)) + 1;
  for (std::size_t k = 0; k < count; ++k) {
    Ring& ring = rings_.emplace_back();
    for (std::size_t m = 0; m < orders; ++m)
      ring[2 * m] = harmonics_.cosine[m][k], ring[2 * m + 1] = harmonics_.sine[m][k];
  }
  constexpr double small = 16;  // px: finer samples are cheap
  finer_ = reach_ < small ? 8 : 4;
}

void BeadAsymmetry::sample() const {
  const int width = 2 * side_ + 1, rows = 2 * side_ * finer_ + 1;
  samples_.assign(
      static_cast<std::size_t>(rows) * static_cast<std::size_t>(finer_ + 1) * static_cast<std::size_t>(width), 0.0F);
  float* to = samples_.data();
  for (int j = 0; j < rows; ++j) {
    const float* first = to;
    for (int phase = 0; phase < finer_; ++phase)
      for (int k = 0; k < width; ++k)
        *to++ = static_cast<float>(
            at(k - side_ - static_cast<double>(phase) / finer_, static_cast<double>(j) / finer_ - side_));
    *to++ = 0;  // the last phase is the first one, a pixel farther: beyond the reach there is nothing
    to = std::copy_n(first, width - 1, to);
  }
}

double BeadAsymmetry::at(double dx, double dy) const {
  const double r = std::sqrt(dx * dx + dy * dy);
  if (r >= reach_ || r < 1e-9) return 0;
  const double place = r / harmonics_.step_px;
  const auto cell = static_cast<std::size_t>(place);
  if (cell + 1 >= rings_.size()) return 0;
  const double part = place - static_cast<double>(cell);
  const Ring &inner = rings_[cell], &outer = rings_[cell + 1];
  const double cosine = dx / r, sine = dy / r;
  Ring turned = {cosine, sine};  // cos and sin of m theta
  for (std::size_t m = 2; m < turned.size(); m += 2) {
    turned[m] = turned[m - 2] * cosine - turned[m - 1] * sine;
    turned[m + 1] = turned[m - 1] * cosine + turned[m - 2] * sine;
  }
  constexpr std::size_t lanes = 4;
  std::array<double, lanes> sum{};
  for (std::size_t k = 0; k < turned.size(); k += lanes)
    for (std::size_t lane = 0; lane < lanes; ++lane)
      sum[lane] += turned[k + lane] * (inner[k + lane] + part * (outer[k + lane] - inner[k + lane]));
  return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

double BeadAsymmetry::one_sidedness(double radius_px) const {
  double square = 0, area = 0;
  for (std::size_t k = 0; k < harmonics_.cosine.front().size(); ++k) {
    const double r = static_cast<double>(k) * harmonics_.step_px;
    if (r > radius_px) break;
    area += r;
    for (std::size_t m = 0; m < orders; m += 2)  // 1, 3, 5
      square += 0.5 * r * (std::pow(harmonics_.cosine[m][k], 2) + std::pow(harmonics_.sine[m][k], 2));
  }
  return area > 0 ? std::sqrt(square / area) : 0;
}

const float* BeadAsymmetry::line(int j, int phase) const {
  const auto width = static_cast<std::size_t>(2 * side_ + 1);
  return samples_.data() +
         (static_cast<std::size_t>(j) * static_cast<std::size_t>(finer_ + 1) + static_cast<std::size_t>(phase)) * width;
}

void BeadAsymmetry::add_to_row(float* row, int left, int count, double x_px, double dy_px, float sign) const {
  std::call_once(sampled_, [this] { sample(); });
  const double down = (dy_px + side_) * finer_;
  const int j = static_cast<int>(std::floor(down));
  if (j < 0 || j >= 2 * side_ * finer_) return;
  const float lower = static_cast<float>(down - j);
  const double whole = std::floor(x_px);
  const double across = (x_px - whole) * finer_;
  const int phase = std::min(finer_ - 1, static_cast<int>(across));
  const float later = static_cast<float>(across - phase);
  // Pixel `column` lies at dx = column - whole - (x_px - whole): place column - whole + side_.
  int first = left - static_cast<int>(whole) + side_, skip = 0;
  if (first < 0) skip = -first;
  const int last = std::min(count, 2 * side_ + 1 - first);  // past the last
  if (last <= skip) return;
  first += skip;
  const float *a = line(j, phase) + first, *b = line(j, phase + 1) + first, *c = line(j + 1, phase) + first,
              *d = line(j + 1, phase + 1) + first;
  const float wa = sign * (1 - lower) * (1 - later), wb = sign * (1 - lower) * later, wc = sign * lower * (1 - later),
              wd = sign * lower * later;
  row += skip;
  for (int k = 0; k < last - skip; ++k) row[k] += wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k];
}

}  // namespace shakebed::ingest
