// The engine's beginning, and the flight of disks between events. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

template <class Space, class Rule, class Sizes>
Engine<Space, Rule, Sizes>::Engine(const Scene& scene, FloorMotion floor, const std::vector<Placed>& placed)
    : count_(static_cast<std::uint32_t>(placed.size())),
      width_(scene.box.width),
      floor_(std::move(floor)),
      disk_surface_(scene.disks.contact),
      floor_surface_(scene.box.floor_surface),
      contact_duration_(scene.disks.contact_duration),
      inverse_inertia_ratio_(1 / scene.disks.inertia_ratio),
      bath_(scene.bath),
      random_(scene.seed ^ 0x6261746800000000) {
  if constexpr (Space::falls) gravity_ = 1;
  set_bounds(scene.box);
  set_disks(scene, placed);
  if (const auto* bath = std::get_if<LangevinBath>(&bath_)) bath_at_ = bath->interval;
  if (const auto* bath = std::get_if<WhiteNoiseBath>(&bath_)) bath_at_ = bath->interval;
  if (const auto* bath = std::get_if<AndersenBath>(&bath_))
    bath_at_ = -std::log(random_.uniform_positive()) / (bath->rate * count_);
  interval_ = floor_.period();
  if (!floor_.moves()) intervals_ = 16;
  event_rate_ = 8.0 * count_;
  initial_energy_ = kinetic_energy() + potential_energy();
  unusual_ = disk_surface_.varies();
  const auto* plates = std::get_if<RubbingPlates>(&scene.box.plates);
  plan_rest(scene.rests && plates == nullptr);
  plan_press(scene.presses && plates == nullptr);
  if (plates != nullptr) {
    plates_ = *plates;
    rubs_.resize(count_);
    if (Rule::spins && plates_.contact_radius > 0) spin_rubs_.resize(count_);
    begin_rub();
  }
  begin_interval();
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::set_bounds(const Box& box) {
  if (const auto* sides = std::get_if<HardSides>(&box.sides)) {
    hard_sides_ = Space::has_walls;
    side_surface_ = Contact(sides->surface);
    slope_sine_ = std::sin(sides->slope);
    slope_cosine_ = std::cos(sides->slope);
  } else {
    period_x_ = Period(width_);
  }
  if (const auto* lid = std::get_if<Lid>(&box.top)) {
    lid_height_ = lid->height;
    if (lid->is_free()) {
      lid_.mass = lid->mass;
      lid_.z = lid->height;
    }
    lid_surface_ = Contact(lid->surface);
  }
  if (const auto* top = std::get_if<PeriodicTop>(&box.top)) period_z_ = Period(top->height);
}

// With their event "never": what happens first is predicted later.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::set_disks(const Scene& scene, const std::vector<Placed>& placed) {
  beyond_cache_ = count_ > fits_cache;
  disks_.resize(count_ + 1);
  labels_.resize(count_);
  std::iota(labels_.begin(), labels_.end(), 0);
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Placed& p = placed[i];
    disks_[i] = {p.x, p.z, p.vx, p.vz, 0, never, nobody, 0, 0, 0, 0, 0};
  }
  disks_[count_] = {0,      0, 0, 0, 0, -never,
                    nobody, 0, 0, 0, 0, 0};  // the sentinel: nothing can be earlier than its event
  if constexpr (Rule::spins) {
    for (const Placed& p : placed) spins_.push_back(p.spin);
  }
  if constexpr (Rule::dissipates) {
    last_contact_.assign(count_, -never);
    withheld_at_.assign(count_, never);
  }
  if constexpr (!Sizes::equal) {
    for (const Placed& p : placed) {
      sizes_.radii.push_back(scene.disks.species[p.species].diameter / 2);
      sizes_.masses.push_back(scene.disks.species[p.species].mass);
    }
    sizes_.radii.push_back(0.5);
    sizes_.masses.push_back(1);
  }
}

template <class Space, class Rule, class Sizes>
auto Engine<Space, Rule, Sizes>::motion_at(const Disk& disk, double time) const -> Motion {
  const TwoLanes place = pair_at(&disk.x), velocity = pair_at(&disk.vx);
  const TwoLanes dt = both(time - disk.own_time);
  if constexpr (Space::falls) {
    const TwoLanes fall = TwoLanes{0, gravity_} * dt;
    return {fused(fused(both(-0.5), fall, velocity), dt, place), velocity - fall};
  } else {
    return {fused(velocity, dt, place), velocity};
  }
}

// The disk's state from now on; what comes next is not known yet. In pairs, as it is read: what has been written in
// parts cannot be read at once before it has reached the cache.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::write_down(std::uint32_t i, const Motion& motion) {
  Disk& disk = disks_[i];
  put_pair(&disk.x, motion.place);
  put_pair(&disk.vx, motion.velocity);
  put_pair(&disk.own_time, both(now_));
}

}  // namespace shakebed::sim
