// Queries of an engine: snapshots, energies, overlaps, memory. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::watch(Watcher* watcher) {
  watcher_ = watcher;
  if constexpr (tiles_apply) {  // a watcher is given everything in the order of time
    if (watcher != nullptr && !tiles_.empty()) leave_tiles();
  }
  if constexpr (press_applies) {
    if (is_pressed_ && watcher != nullptr) {
      tell_pressed(0);
      return;
    }
  }
  tell_all();
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::set_bath_temperature(double temperature) {
  if (!(temperature > 0) || !std::isfinite(temperature))
    throw std::invalid_argument("the temperature of a bath must be above 0");
  if (auto* langevin = std::get_if<LangevinBath>(&bath_)) {
    langevin->temperature = temperature;
  } else if (auto* andersen = std::get_if<AndersenBath>(&bath_)) {
    andersen->temperature = temperature;
  } else if (auto* thermal = std::get_if<ThermalFloor>(&bath_)) {
    thermal->temperature = temperature;
  } else {
    throw std::invalid_argument("the scene has no bath with a temperature");
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::snapshot(Snapshot& out) const {
  out.time = time();
  out.floor_position = floor_.position(now_);
  out.floor_velocity = floor_.velocity(now_);
  out.lid_height = lid_height();
  out.lid_velocity = lid_velocity();
  out.x.resize(count_);
  out.z.resize(count_);
  out.vx.resize(count_);
  out.vz.resize(count_);
  out.spin.resize(spins_.size());
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_now(i);
    const std::uint32_t label = labels_[i];
    out.x[label] = Space::wraps_x ? period_x_.wrapped(motion.x()) : motion.x();
    out.z[label] = Space::wraps_z ? period_z_.wrapped(motion.z()) : motion.z();
    out.vx[label] = motion.vx();
    out.vz[label] = motion.vz();
    if (!rubs_.empty()) [[unlikely]] {
      const TwoLanes velocity = velocity_with_friction(i, motion);
      out.vx[label] = velocity[0];
      out.vz[label] = velocity[1];
    }
    if constexpr (Rule::spins) {
      out.spin[label] = spin_now(i);
      if (!spin_rubs_.empty()) [[unlikely]]
        out.spin[label] = spin_with_friction(i, motion);
    }
    if constexpr (rests_apply) {
      if (!is_at_rest(i)) continue;
      out.vz[label] = out.floor_velocity;  // the mean over its hop
      if (resting_ == count_) out.z[label] = out.floor_position + rest_height_[i];
    }
  }
}

template <class Space, class Rule, class Sizes>
DiskProperties Engine<Space, Rule, Sizes>::properties() const {
  DiskProperties properties;
  properties.radius.resize(count_);
  properties.mass.resize(count_);
  for (std::uint32_t i = 0; i < count_; ++i) {
    properties.radius[labels_[i]] = sizes_.radius(i);
    properties.mass[labels_[i]] = sizes_.mass(i);
  }
  return properties;
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::kinetic_energy() const {
  long double sum = 0;
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Motion motion = motion_now(i);
    const long double vx = motion.vx(), vz = motion.vz();
    sum += 0.5L * sizes_.mass(i) * (vx * vx + vz * vz);
    if constexpr (Rule::spins) {
      const long double surface_speed = sizes_.radius(i) * spin_now(i);
      sum += 0.5L * sizes_.mass(i) / inverse_inertia_ratio_ * surface_speed * surface_speed;
    }
  }
  if (lid_.is_free()) sum += 0.5L * lid_.mass * lid_velocity() * lid_velocity();
  return static_cast<double>(sum);
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::potential_energy() const {
  long double sum = 0;
  for (std::uint32_t i = 0; i < count_; ++i) sum += gravity_ * sizes_.mass(i) * motion_now(i).z();
  if (lid_.is_free()) sum += gravity_ * lid_.mass * lid_height();
  return static_cast<double>(sum);
}

template <class Space, class Rule, class Sizes>
EnergyLedger Engine<Space, Rule, Sizes>::energy() const {
  EnergyLedger ledger{initial_energy_, kinetic_energy(), potential_energy(), 0,      dissipated_,
                      step_error_,     floor_work_,      bath_work_,         rubbed_};
  if (!is_pressed_) return ledger;
  const double later = now_ - pressed_to_;
  const double work =
      pressed_.floor_work() + pressed_.floor_force() * (floor_.position(now_) - floor_.position(pressed_to_));
  const double damped = pressed_.damped() + pressed_.loss_rate() * later;
  ledger.compressed = pressed_.compressed();
  ledger.floor_work += work;
  ledger.dissipated += damped;
  ledger.step_error += energy_when_pressed_ + work - damped - (ledger.kinetic + ledger.potential + ledger.compressed);
  return ledger;
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::largest_overlap() const {
  Snapshot here;
  snapshot(here);
  return sim::largest_overlap(here, properties().radius, period_x_.length, period_z_.length);
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::allowed_overlap() const {
  return is_pressed_ || step_error_ != 0 ? soft_overlap : hard_overlap;
}

template <class Space, class Rule, class Sizes>
std::size_t Engine<Space, Rule, Sizes>::bytes() const {
  return disks_.capacity() * sizeof(Disk) + labels_.capacity() * sizeof(std::uint32_t) +
         (spins_.capacity() + last_contact_.capacity() + withheld_at_.capacity()) * sizeof(double) +
         std::visit([](const auto& grid) { return grid.bytes(); }, grid_) + lists_.bytes() + queue_.bytes() +
         log_.bytes() + (deferred_.capacity() + rest_.capacity()) * sizeof(EventEntry);
}

}  // namespace shakebed::sim
