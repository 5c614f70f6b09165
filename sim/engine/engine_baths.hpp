// Reservoirs: Langevin, Andersen, white noise. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

// The disks that a reservoir acts on, and the sum of the work that it does.
struct DisksInBath {
  std::span<Disk> disks;
  const double* masses;  // null where all are 1
  Random& random;
  double& work;

  double mass(std::size_t i) const { return masses == nullptr ? 1 : masses[i]; }
  void set_velocity(std::size_t i, double vx, double vz) const {
    Disk& disk = disks[i];
    const auto kinetic = [&] { return 0.5 * mass(i) * (disk.vx * disk.vx + disk.vz * disk.vz); };
    const double before = kinetic();
    disk.vx = vx;
    disk.vz = vz;
    work += kinetic() - before;
  }
};

// Each returns the time to its next action.
inline double act(const LangevinBath& bath, const DisksInBath& in) {
  const double keep = std::exp(-bath.rate * bath.interval);
  const double given = std::sqrt(bath.temperature * -std::expm1(-2 * bath.rate * bath.interval));
  for (std::size_t i = 0; i < in.disks.size(); ++i) {
    const double kick = given / std::sqrt(in.mass(i));
    const Random::Pair draw = in.random.normal_pair();
    in.set_velocity(i, keep * in.disks[i].vx + kick * draw.first, keep * in.disks[i].vz + kick * draw.second);
  }
  return bath.interval;
}

inline double act(const WhiteNoiseBath& noise, const DisksInBath& in) {
  std::vector<Random::Pair> kicks(in.disks.size());
  Random::Pair mean{0, 0};
  double total_mass = 0;
  for (std::size_t i = 0; i < kicks.size(); ++i) {
    const double mass = in.mass(i), kick = std::sqrt(noise.heating * noise.interval / mass);
    const Random::Pair draw = in.random.normal_pair();
    kicks[i] = {kick * draw.first, kick * draw.second};
    mean.first += mass * kicks[i].first;
    mean.second += mass * kicks[i].second;
    total_mass += mass;
  }
  if (!noise.conserve_momentum) mean = {0, 0};
  for (std::size_t i = 0; i < kicks.size(); ++i) {
    const Disk& disk = in.disks[i];
    in.set_velocity(i, disk.vx + (kicks[i].first - mean.first / total_mass),
                    disk.vz + (kicks[i].second - mean.second / total_mass));
  }
  return noise.interval;
}

// One disk's velocity is drawn anew.
inline double act(const AndersenBath& bath, std::uint32_t i, const DisksInBath& in) {
  const double speed = std::sqrt(bath.temperature / in.mass(i));
  const Random::Pair draw = in.random.normal_pair();
  in.set_velocity(i, speed * draw.first, speed * draw.second);
  return -std::log(in.random.uniform_positive()) / (bath.rate * static_cast<double>(in.disks.size()));
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_bath() {
  const DisksInBath in{{disks_.data(), count_}, sizes_.mass_table(), random_, bath_work_};
  if (const auto* bath = std::get_if<AndersenBath>(&bath_)) {
    const std::uint32_t i = random_.below(count_);
    bring_forward(i);
    bath_at_ = now_ + act(*bath, i, in);
    predict(i, motion_at(disks_[i], now_));
    settle();
    tell(i);
    return;
  }
  for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
  if (const auto* bath = std::get_if<LangevinBath>(&bath_)) bath_at_ = now_ + act(*bath, in);
  if (const auto* noise = std::get_if<WhiteNoiseBath>(&bath_)) bath_at_ = now_ + act(*noise, in);
  predict_all();
  tell_all();
}

}  // namespace shakebed::sim
