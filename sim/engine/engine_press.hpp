// prototype
#pragma once
#include <cstdlib>
#include <cstdio>
namespace shakebed::sim {

inline double env_or(const char* name, double value) {
  const char* s = std::getenv(name);
  return s ? std::atof(s) : value;
}
struct PressParameters {
  double tau = env_or("TAU", 100e-6 / 0.014278), steps = env_or("SPC", 12), rate = env_or("RATE", 300),
         every = env_or("EVERY", 4), trace = env_or("TRACE", 0), spc2 = env_or("SPC", 6), c = env_or("C", 3e-4), tmax = env_or("TMAX", 0.007), grow = env_or("GROW", 1.05), on = env_or("PRESS", 1), still = env_or("STILL", 1),
         most_touching = env_or("TOUCH", 0.1), speed = env_or("SPEED", 1e9);
};
inline const PressParameters press_parameters;

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::plan_press(const Scene&) {
  if constexpr (rests_apply) {
    const auto& p = press_parameters;
    PressedBed::Box box{width_, Space::wraps_x ? width_ : 0, lid_height_};
    pressed_.set_up(box, disk_surface_, side_surface_, floor_surface_, lid_surface_, p.tau, p.tau / p.steps);
    press_step_ = p.tau / p.steps;
    presses_ = p.on > 0 && contact_duration_ > 0;
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::check_press() {
  events_to_press_ = static_cast<std::uint64_t>(press_parameters.every * count_);
  if constexpr (rests_apply) {
    const double passed = now_ - press_checked_at_;
    const std::uint64_t contacts = counters_.collisions() - contacts_at_press_check_;
    press_checked_at_ = now_;
    contacts_at_press_check_ = counters_.collisions();
    if (!presses_ || press_checked_at_ < 0) return;
    if (!(static_cast<double>(contacts) > press_parameters.rate * count_ * passed)) return;
    // relative speeds of neighbours
    double squares = 0;
    std::uint64_t pairs = 0;
    for (std::uint32_t i = 0; i < count_; ++i) {
      const Motion a = motion_at(disks_[i], now_);
      lists_.each_neighbour(i, [&](std::uint32_t k) {
        if (k < i) return;
        const Motion b = motion_at(disks_[k], now_);
        double dx = b.x() - a.x();
        const double dz = b.z() - a.z();
        if constexpr (Space::wraps_x) dx = period_x_.nearest(dx);
        const double s = dx * dx + dz * dz;
        if (s > 1.02) return;
        const double v = (dx * (b.vx() - a.vx()) + dz * (b.vz() - a.vz()));
        squares += v * v;
        ++pairs;
      });
    }
    const double rms = std::sqrt(squares / std::max<double>(1, static_cast<double>(pairs)));
    if (press_parameters.trace > 1)
      std::printf("  check %.4f rate %.0f rms %.3g pairs %lu\n", (base_ + now_) / interval_,
                  static_cast<double>(contacts) / count_ / passed, rms, pairs);
    if (rms > press_parameters.speed) return;
    press_wanted_ = true;
    press_speed_ = rms;
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::set_press_time(double tau) {
  press_tau_ = tau;
  press_step_ = tau / press_parameters.spc2;
  pressed_.soften(tau);
}
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::begin_press() {
  std::vector<PressedDisk> all(count_);
  for (std::uint32_t i = 0; i < count_; ++i) all[i] = {disks_[i].x, disks_[i].z, disks_[i].vx, disks_[i].vz};
  set_press_time(press_tau_);
  pressed_.begin(std::move(all), floor_, now_);
  pressed_to_ = now_;
  is_pressed_ = true;
}
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::write_pressed() {
  for (std::uint32_t i = 0; i < count_; ++i) {
    const PressedDisk& d = pressed_.disks()[i];
    write_down(i, Motion{TwoLanes{d.x, d.z}, TwoLanes{d.vx, d.vz}});
  }
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::start_press() {
  if constexpr (rests_apply) {
    if (resting_ > 0) wake_all();
    for (std::uint32_t i = 0; i < count_; ++i) bring_forward(i);
    press_tau_ = std::min(press_parameters.c / press_speed_, press_parameters.tmax);
    begin_press();
    rest_at_ = look_at_ = never;
    press_energy_ = kinetic_energy() + potential_energy();
    pressed_.floor_work = pressed_.damped = 0;
    pressed_.steps = 0;
    press_began_ = base_ + now_;
    quiet_since_ = never;
    if (press_parameters.trace > 0)
      std::printf("start %.4f touching %u\n", (base_ + now_) / interval_, pressed_.touching());
  }
}
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::stop_press() {
  if constexpr (rests_apply) {
    if (press_parameters.trace > 0)
      std::printf("stop  %.4f contacts %lu touching %u overlap %.2g stored %.3g steps %lu\n", (base_ + now_) / interval_, counters_.collisions(),
                  pressed_.touching(), pressed_.largest_overlap(), pressed_.stored(), pressed_.steps);
    const double before = kinetic_energy() + potential_energy() + pressed_.stored();
    pressed_.separate(floor_.position(now_));
    write_pressed();
    is_pressed_ = false;
    const double after = kinetic_energy() + potential_energy();
    if (press_parameters.trace > 0)
      std::printf("   lost %.4g damped %.4g step error %.4g, to separate %.3g\n",
                  press_energy_ + pressed_.floor_work - after, pressed_.damped,
                  press_energy_ + pressed_.floor_work - pressed_.damped - before, before - after);
    floor_work_ += pressed_.floor_work;
    dissipated_ += press_energy_ + pressed_.floor_work - after;
    press_steps_ += pressed_.steps;
    rest_at_ = look_at_ = now_ + rest_period_ / looks_a_period;
    contacts_at_look_ = counters_.collisions();
    begin_interval();
    press_checked_at_ = now_;
    contacts_at_press_check_ = counters_.collisions();
  }
}

template <class Space, class Rule, class Sizes>
bool Engine<Space, Rule, Sizes>::press_until(double until) {
  for (;;) {
    if (!(pressed_to_ < until)) return true;
    double next = pressed_to_ + press_step_;
    if (next > synchronise_at_ - 1e-3 * press_step_) next = synchronise_at_;
    if (next > until) {
      now_ = until;
      return true;
    }
    pressed_.step(floor_, pressed_to_, next - pressed_to_);
    pressed_to_ = now_ = next;
    if (pressed_.steps % 16 == 0) {
      const FloorMotion::Motion f = floor_.motion(now_);
      const double want = std::min(press_parameters.c / std::max(pressed_.approach(), 1e-9), press_parameters.tmax);
      if (press_parameters.trace > 2)
        std::printf("tau %.5f v %.4f     %.4f load %.2f force %.1f touching %u overlap %.2g\n", press_tau_, pressed_.approach(), (base_ + now_) / interval_,
                    f.acceleration + 1, pressed_.floor_force, pressed_.touching(), pressed_.largest_overlap());
      if (want > press_tau_) set_press_time(std::min(want, press_tau_ * press_parameters.grow));
      const bool light = f.acceleration + gravity_ < 0 && pressed_.floor_force == 0;
      if (!light) quiet_since_ = never;
      if (light && quiet_since_ == never) quiet_since_ = base_ + now_;
      if (light && (pressed_.touching() < press_parameters.most_touching * count_)) {
        stop_press();
        return true;
      }
    }
  }
}

}  // namespace shakebed::sim
