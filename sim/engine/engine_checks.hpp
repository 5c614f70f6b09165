// What must hold of an engine between two events. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

// Bound on how much, by rounding, a new prediction may be earlier than the valid one [sqrt(D/g)]. Places are rounded by
// 1e-15 D. At the slowest approaches of a bed at rest (1e-6 sqrt(g D)) this is 1e-9. No event of 750 random stacks
// exceeded it.
inline constexpr double prediction_rounding = 1e-8;

// Is there an event of i or of its partner no later than each contact that i will make? Nothing is pending.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::foresees_contacts_of(std::uint32_t i) const {
  const Motion mine = motion_at(disks_[i], now_);
  bool foreseen = true;
  const auto meets = [&](double when, double next_event) {
    if (when < next_event - prediction_rounding) foreseen = false;
  };
  lists_.each_neighbour(i, [&](std::uint32_t k) {
    const Motion other = motion_at(disks_[k], now_);
    double dx = other.x() - mine.x(), dz = other.z() - mine.z();
    if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
    if constexpr (Space::wraps_z) dz = period_z_.nearest(dz);
    const double distance = sizes_.contact_distance(i, k);
    const double wait = time_to_disk(dx, dz, other.vx() - mine.vx(), other.vz() - mine.vz(), distance * distance);
    meets(now_ + wait, std::min(disks_[i].event_time, disks_[k].event_time));
  });
  if constexpr (Space::has_walls) {
    if (disks_[i].own_time == now_)
      meets(next_wall(i, {never, nobody}, disks_[i].event_time).time, disks_[i].event_time);
  }
  return foreseen;
}

template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::foresees_contacts() const {
  if (is_pressed_) return true;  // there are no events
  for (std::uint32_t i = 0; i < count_; ++i) {
    if (!foresees_contacts_of(i)) return false;
  }
  return true;
}

}  // namespace shakebed::sim
