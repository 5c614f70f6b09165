// Friction with the plates of a flat cell. Included by engine.hpp only.
//
// A disk that slides on a plate is slowed down by a constant deceleration, against its velocity relative to the plate.
// Contacts are found for disks in free flight, so friction acts at equal intervals h. A disk is given the flight that
// takes it in h where sliding would take it, and at the end of h the velocity that it would then have. Without contacts
// the disk so is at the ends of all intervals where plate_slide.hpp says, whatever h. A disk in rest on its plate hops,
// as engine_rest.hpp has it: back to the same place, by g h^2/8 at most.
//
// Between, its velocity is the mean of the interval, which is wrong by half the deceleration times h at most. A disk
// that meets something in the interval meets it with this error, which has no mean, and is then slowed down for half of
// h at the end. The plates must not be felt by the loop over events, and are not: like the reservoirs they act between.
//
// Where the plates brake the spin, too, it has the mean of the interval between, as the velocity (plate_spin.hpp).
#pragma once

namespace shakebed::sim {

// A velocity that differs by less than that from the one foreseen is that of a disk that nothing has met [sqrt(g D)].
inline constexpr double unmet = 1e-9;

template <class Space, class Rule, class Sizes>
FloorMotion::Motion Engine<Space, Rule, Sizes>::plate_motion(double later) const {
  return plates_.follow_floor ? floor_.motion(now_, later) : FloorMotion::Motion{0, 0, 0};
}

// Gives the disk, whose record is that of now_, a velocity; the plates do it.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::push_from_plate(std::uint32_t i, double vx, double vz, double plate_velocity) {
  Disk& disk = disks_[i];
  const double mass = sizes_.mass(i);
  const double given = 0.5 * mass * ((vx - disk.vx) * (vx + disk.vx) + (vz - disk.vz) * (vz + disk.vz));
  const double work = mass * (vz - disk.vz) * plate_velocity;
  floor_work_ += work;
  dissipated_ += work - given;
  rubbed_ += work - given;
  disk.vx = vx;
  disk.vz = vz;
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::turn_by_plate(std::uint32_t i, double spin) {
  const double radius = sizes_.radius(i), inertia = sizes_.mass(i) * radius * radius / inverse_inertia_ratio_;
  const double lost = 0.5 * inertia * (spins_[i] - spin) * (spins_[i] + spin);
  dissipated_ += lost;
  rubbed_ += lost;
  spins_[i] = spin;
}

// As slide(), of a disk whose spin the plates brake; `spin` becomes that after it.
template <class Space, class Rule, class Sizes>
Slide Engine<Space, Rule, Sizes>::slide_and_spin(std::uint32_t i, double vx, double vz, double pull, double duration,
                                                 double& spin) const {
  const double share = plates_.contact_radius / sizes_.radius(i);
  const SpinningSlide end =
      slide_spinning(vx, vz, plates_.contact_radius * spins_[i], share * share * inverse_inertia_ratio_, pull,
                     plates_.deceleration, duration);
  spin = end.rim / plates_.contact_radius;
  return end.way;
}

// The flights of the next interval, from records that are those of now_.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::begin_rub() {
  const double h = plates_.interval;
  const FloorMotion::Motion plate = plate_motion(0), later = plate_motion(h);
  const double pull = -gravity_ - (later.velocity - plate.velocity) / h, hop = 0.5 * gravity_ * h;
  const bool turns = !spin_rubs_.empty();
  for (std::uint32_t i = 0; i < count_; ++i) {
    const Disk& disk = disks_[i];
    const double vx = disk.vx, vz = disk.vz;
    double spin = 0;
    const Slide way = turns ? slide_and_spin(i, vx, vz - plate.velocity, pull, h, spin)
                            : slide(vx, vz - plate.velocity, pull, plates_.deceleration, h);
    const double flown_x = way.x / h, flown_z = (way.z + (later.position - plate.position)) / h;
    Rub& rub = rubs_[i];
    rub.flown_x = flown_x, rub.flown_z = flown_z - hop;
    rub.before_x = flown_x - vx, rub.before_z = flown_z + hop - vz;
    rub.after_x = way.vx - flown_x, rub.after_z = way.vz + later.velocity - (flown_z - hop);
    push_from_plate(i, flown_x, flown_z + hop, plate.velocity);
    if (!turns) continue;
    const double mean = 0.5 * (spins_[i] + spin);
    spin_rubs_[i] = {mean - spins_[i], spin - mean};
    turn_by_plate(i, mean);
  }
  rub_at_ = now_ + h;
}

// Has the disk met nothing since begin_rub()? Its motion is that of now_.
template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::slides_on(std::uint32_t i, const Motion& motion) const {
  const Rub& rub = rubs_[i];
  return std::abs(motion.vx() - rub.flown_x) < unmet &&
         std::abs(motion.vz() - gravity_ * (rub_at_ - now_) - rub.flown_z) < unmet;
}

// The velocity that the disk has with its friction up to now: for those who look.
template <class Space, class Rule, class Sizes>
TwoLanes Engine<Space, Rule, Sizes>::velocity_with_friction(std::uint32_t i, const Motion& motion) const {
  if (!slides_on(i, motion)) return motion.velocity;
  const Rub& rub = rubs_[i];
  const double left = (rub_at_ - now_) / plates_.interval, past = 1 - left;
  return motion.velocity + TwoLanes{past * rub.after_x - left * rub.before_x, past * rub.after_z - left * rub.before_z};
}

template <class Space, class Rule, class Sizes>
double Engine<Space, Rule, Sizes>::spin_with_friction(std::uint32_t i, const Motion& motion) const {
  if (!slides_on(i, motion)) return spins_[i];
  const double left = (rub_at_ - now_) / plates_.interval;
  return spins_[i] + (1 - left) * spin_rubs_[i].after - left * spin_rubs_[i].before;
}

// The end of an interval, and the next one.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::act_plates() {
  const double plate = plate_motion(0).velocity;
  const bool turns = !spin_rubs_.empty();
  for (std::uint32_t i = 0; i < count_; ++i) {
    bring_forward(i);
    const Disk& disk = disks_[i];
    const Rub& rub = rubs_[i];
    if (slides_on(i, motion_at(disk, now_))) {
      push_from_plate(i, disk.vx + rub.after_x, disk.vz + rub.after_z, plate);
      if (turns) turn_by_plate(i, spins_[i] + spin_rubs_[i].after);
    } else {
      double spin = 0;
      const double h = plates_.interval / 2;
      const Slide end = turns ? slide_and_spin(i, disk.vx, disk.vz - plate, 0, h, spin)
                              : slide(disk.vx, disk.vz - plate, 0, plates_.deceleration, h);
      push_from_plate(i, end.vx, end.vz + plate, plate);
      if (turns) turn_by_plate(i, spin);
    }
  }
  begin_rub();
  predict_all();
  tell_all();
}

}  // namespace shakebed::sim
