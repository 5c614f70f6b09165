#include "sim/measure/flow_free.hpp"

#include <algorithm>
#include <cmath>
#include <variant>

namespace shakebed::sim {

namespace {
constexpr double fewest_disks = 3;  // of a layer
}

void FlowFreeTemperature::observe(const Snapshot& at, std::uint32_t phase) {
  const double lowest = std::floor(*std::min_element(at.z.begin(), at.z.end()));
  const double highest = std::floor(*std::max_element(at.z.begin(), at.z.end()));
  layers_.assign(static_cast<std::size_t>(highest - lowest) + 1, Layer{});
  for (std::size_t i = 0; i < at.z.size(); ++i) {
    Layer& layer = layers_[static_cast<std::size_t>(std::floor(at.z[i]) - lowest)];
    layer.disks += 1, layer.mass += mass_[i];
    const std::array<double, 2> v{at.vx[i], at.vz[i]};
    for (std::size_t k = 0; k < 2; ++k) layer.momentum[k] += mass_[i] * v[k], layer.energy[k] += mass_[i] * v[k] * v[k];
  }
  double disks = 0;
  std::array<double, 2> sum{};
  for (const Layer& layer : layers_) {
    if (layer.disks < fewest_disks) continue;
    disks += layer.disks;
    for (std::size_t k = 0; k < 2; ++k)
      sum[k] += layer.disks / (layer.disks - 1) *
                std::max(0.0, layer.energy[k] - layer.momentum[k] * layer.momentum[k] / layer.mass);
  }
  for (std::size_t k = 0; k < 2; ++k) period_sum_[k] += disks > 0 ? sum[k] / disks : 0;
  ++period_looks_;
  if (phase + 1 < phases_) return;
  for (double& one : period_sum_) one /= period_looks_;
  mean_.add(period_sum_);
  period_sum_ = {}, period_looks_ = 0;
}

FlowFreeDisplacement::FlowFreeDisplacement(const Scene& scene, const DiskProperties& disks, std::uint32_t phases)
    : temperature_(disks, phases) {
  if (std::holds_alternative<PeriodicSides>(scene.box.sides)) period_x_ = scene.box.width;
}

void FlowFreeDisplacement::observe(const Snapshot& at, std::uint32_t phase) {
  const std::size_t count = before_.x.size();
  if (count > 0) {
    const double time = at.time - before_.time;
    before_.vx.resize(count), before_.vz.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      const double dx = at.x[i] - before_.x[i];
      before_.vx[i] = (period_x_ > 0 ? std::remainder(dx, period_x_) : dx) / time;
      before_.vz[i] = (at.z[i] - before_.z[i]) / time;
    }
    temperature_.observe(before_, phase);
  }
  before_.time = at.time, before_.x = at.x, before_.z = at.z;
}

}  // namespace shakebed::sim
