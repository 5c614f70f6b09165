// Reservoirs: Langevin, Andersen, white noise. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_bath() {
  const auto kinetic = [&](const Disk& disk, std::uint32_t i) {
    return 0.5 * sizes_.mass(i) * (disk.vx * disk.vx + disk.vz * disk.vz);
  };
  if (const auto* bath = std::get_if<AndersenBath>(&bath_)) {
    const std::uint32_t i = random_.below(count_);
    Disk& disk = disks_[i];
    bring_forward(i);
    const double before = kinetic(disk, i), speed = std::sqrt(bath->temperature / sizes_.mass(i));
    const Random::Pair draw = random_.normal_pair();
    disk.vx = speed * draw.first;
    disk.vz = speed * draw.second;
    bath_work_ += kinetic(disk, i) - before;
    predict(i, motion_at(disk, now_));
    settle();
    tell(i);
    bath_at_ = now_ - std::log(random_.uniform_positive()) / (bath->rate * count_);
    return;
  }
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  if (const auto* bath = std::get_if<LangevinBath>(&bath_)) {
    const double keep = std::exp(-bath->rate * bath->interval);
    const double given = std::sqrt(bath->temperature * -std::expm1(-2 * bath->rate * bath->interval));
    for (std::uint32_t i = 0; i < count_; ++i) {
      Disk& disk = disks_[i];
      const double before = kinetic(disk, i), kick = given / std::sqrt(sizes_.mass(i));
      const Random::Pair draw = random_.normal_pair();
      disk.vx = keep * disk.vx + kick * draw.first;
      disk.vz = keep * disk.vz + kick * draw.second;
      bath_work_ += kinetic(disk, i) - before;
    }
    bath_at_ = now_ + bath->interval;
  } else if (const auto* noise = std::get_if<WhiteNoiseBath>(&bath_)) {
    std::vector<Random::Pair> kicks(count_);
    Random::Pair mean{0, 0};
    double total_mass = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const double mass = sizes_.mass(i), kick = std::sqrt(noise->heating * noise->interval / mass);
      const Random::Pair draw = random_.normal_pair();
      kicks[i] = {kick * draw.first, kick * draw.second};
      mean.first += mass * kicks[i].first;
      mean.second += mass * kicks[i].second;
      total_mass += mass;
    }
    if (!noise->conserve_momentum) mean = {0, 0};
    for (std::uint32_t i = 0; i < count_; ++i) {
      Disk& disk = disks_[i];
      const double before = kinetic(disk, i);
      disk.vx += kicks[i].first - mean.first / total_mass;
      disk.vz += kicks[i].second - mean.second / total_mass;
      bath_work_ += kinetic(disk, i) - before;
    }
    bath_at_ = now_ + noise->interval;
  }
  predict_all();
  tell_all();
}

}  // namespace shakebed::sim
