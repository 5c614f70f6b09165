// The event loop. One class template, specialised by run_scene.cpp for what the
// scene names.
//
// Every disk has one next event, kept in its struct: with another disk, with a wall, or with the edge of its shell. It
// is predicted when something happens to the disk, and only then. A pair's contact is accepted when it is earlier than
// the partner's own next event. The partner's former partner is not changed: when its old time comes, it finds the
// event void and predicts anew. Between events disks fly freely: straight lines in pairs' relative coordinates, with or
// without gravity. A prediction is written down only when the next event has begun, unless that could change it
// (Pending, waits_for(), settle()).
//
// Time is counted from the last rebasing, so its resolution does not fade in long runs. At fixed moments (every
// `synchronisation interval`) the engine brings all disks to one time, rebases it by a whole number of floor periods
// and predicts everything from scratch. Its state there is nothing but positions, velocities, spins and contact clocks.
// So a run continued from a checkpoint taken there gives the same bytes as one that was never stopped.
//
// Large periodic beds go on tile by tile: engine_tiles.hpp. Beds that lie on the floor rest there: engine_rest.hpp.
// Beds that are pressed on it go on as soft disks: engine_press.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sim/engine/checkpoint_bytes.hpp"
#include "sim/engine/collision.hpp"
#include "sim/engine/contact_time.hpp"
#include "sim/engine/disk.hpp"
#include "sim/engine/event_queue.hpp"
#include "sim/engine/fetch.hpp"
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/large_vector.hpp"
#include "sim/engine/neighbour_lists.hpp"
#include "sim/engine/overlap.hpp"
#include "sim/engine/plate_slide.hpp"
#include "sim/engine/plate_spin.hpp"
#include "sim/engine/policies.hpp"
#include "sim/engine/pressed_bed.hpp"
#include "sim/engine/random.hpp"
#include "sim/engine/restitution.hpp"
#include "sim/engine/shell_grid.hpp"
#include "sim/engine/simulation.hpp"
#include "sim/engine/space_filling_curve.hpp"
#include "sim/engine/tiles.hpp"

namespace shakebed::sim {

// Bound on what rounding alone may do to a time or a distance, used in asserts [sqrt(D/g), D]. It is a thousand times
// what hard cases show (1e-12 at speeds of 1000 sqrt(g D)).
inline constexpr double asserted_rounding = 1e-9;
// Duration of the hop of a disk at rest on the floor: that of a contact, or this without a contact clock. A disk that
// hopped for longer would be thrown [sqrt(D/g)].
inline constexpr double rest_hop = 1e-4, longest_hop = 0.1;
// Of the velocity of such a hop: with this share a disk parts from a floor that falls away.
inline constexpr double parting = 1e-3;

// In which order events are taken: that of time, or tile by tile and then the rest in the order of time.
enum class Order { of_time, of_tiles, of_the_rest };

template <class Space, class Rule, class Sizes>
class Engine final : public Simulation {
 public:
  // Cold: for size, not for speed; two dozen engines are compiled.
  [[gnu::cold]] Engine(const Scene& scene, FloorMotion floor, const std::vector<Placed>& placed);

  bool advance_towards(double time, std::uint64_t most_events) override;
  double time() const override { return base_ + now_; }
  double next_synchronisation() const override { return base_ + synchronise_at_; }
  void snapshot(Snapshot& out) const override;
  [[gnu::cold]] DiskProperties properties() const override;
  EnergyLedger energy() const override;
  Counters counters() const override { return counters_; }
  [[gnu::cold]] double largest_overlap() const override;
  double allowed_overlap() const override;
  bool foresees_contacts() const override;
  [[gnu::cold]] std::size_t bytes() const override;
  [[gnu::cold]] std::vector<std::uint8_t> checkpoint() const override;
  [[gnu::cold]] void restore(const std::vector<std::uint8_t>& bytes) override;
  void watch(Watcher* watcher) override;
  void set_bath_temperature(double temperature) override;

 private:
  friend EventQueue;  // settle(), waits_for()
  struct Candidate {
    double time;
    std::int32_t partner;
  };
  // What a disk of the latest event will do next, foreseen but not written down: that waits until the next event has
  // begun, so that both overlap in the processor.
  static constexpr std::uint32_t nothing_pending = 0xffffffff;
  struct Pending {
    std::uint32_t disk = nothing_pending;
    std::int32_t partner = nobody;
    double time = never, exit = never;
    // Number by number: what has been written in parts cannot be read at once before it has reached the cache.
    void is(std::uint32_t i, const Candidate& next, double exit_of_i) {
      disk = i;
      partner = next.partner;
      time = next.time;
      exit = exit_of_i;
    }
  };

  // A disk's state at one moment, in registers: what is predicted from it must
  // not wait for the record to be written.
  struct Motion {
    TwoLanes place, velocity;  // {x, z} each
    double x() const { return place[0]; }
    double z() const { return place[1]; }
    double vx() const { return velocity[0]; }
    double vz() const { return velocity[1]; }
  };

  // --- beginning
  [[gnu::cold]] void set_bounds(const Box& box);
  [[gnu::cold]] void set_disks(const Scene& scene, const std::vector<Placed>& placed);

  // --- flight
  Motion motion_at(const Disk& disk, double time) const;
  void write_down(std::uint32_t i, const Motion& motion);
  void bring_forward(std::uint32_t i) { write_down(i, motion_at(disks_[i], now_)); }

  // --- prediction
  // `images`: whether to tell which images of the others are the nearest.
  template <bool images, bool others_ahead, class Number>
  Number meetings(const SeenDisks<Number>& others, const Disk& me) const;
  template <bool others_ahead>
  LaneMask may_meet(const SeenDisks<Lanes>& others, const Disk& me) const;
  template <bool images, bool others_ahead = false>
  Lanes contact_times(const std::uint32_t* ids, std::size_t beyond, const Disk& me, double radius) const;
  template <bool images, bool others_ahead = false>
  Candidate earliest_in(const NeighbourBlock& block, const Disk& me, double radius) const;
  Candidate next_of_many(std::uint32_t i, Candidate best) const;
  template <bool images>
  Candidate next_contact(std::uint32_t i) const;
  Candidate next_wall(std::uint32_t i, Candidate best, double exit) const;
  // Could a neighbour of any of both be on the other side of a periodic box's edge?
  bool is_near_edge(std::uint32_t i, std::uint32_t j) const {
    return (Space::wraps_x || Space::wraps_z) && ((disks_[i].near | disks_[j].near) & near_edge) != 0;
  }
  template <bool images, bool others_ahead>
  Candidate next_event_by(std::uint32_t i, double exit) const;
  template <bool others_ahead = false>
  Candidate next_event(std::uint32_t i, double exit) const;
  double shell_exit_of(std::uint32_t i, const Motion& motion) const;
  TwoLanes shell_exits_of(std::uint32_t i, std::uint32_t j, const Motion& first, const Motion& second) const;
  void commit(std::uint32_t i, Candidate next, double exit);
  void settle();
  // Must what is pending be written down before the event of disks i and k at `time` is known? Not if all of it
  // comes later and is that of other disks: one that it claims has nothing to do until then, or it would not be
  // claimed.
  bool waits_for(double time, std::uint32_t i, std::uint32_t k) const {
    bool waits = false;
    for (const Pending& one : pending_)
      waits = waits || i == one.disk || k == one.disk || !(time < one.time) || !(time < one.exit);
    return waits;
  }
  void fly_on(std::uint32_t i, const Motion& motion);
  // The same where the record says `motion` already. It is pending then.
  void predict(std::uint32_t i, const Motion& motion) {
    const double exit = shell_exit_of(i, motion);
    settle();
    pending_[0].is(i, next_event(i, exit), exit);
  }
  void predict_all();
  bool foresees_contacts_of(std::uint32_t i) const;

  // --- shells
  void bound_shells(double density, double height, double top);
  void choose_ahead(double density);
  TwoLanes shell_centre(const Motion& motion, double ahead) const;
  void centre_shell(std::uint32_t i, double ahead = 0);
  template <class Grid>
  void file_shells(Grid& grid, double height);
  void file_shells(double height);
  template <bool how_near, class Grid>
  void look_round(const Grid& grid, std::uint32_t i);
  // Radius of the disk and of its shell together [D].
  float reach(std::uint32_t i) const {
    return static_cast<float>(disks_[i].skin) * static_cast<float>(skin_unit) + static_cast<float>(sizes_.radius(i));
  }
  void choose_skin(std::uint32_t i);
  std::span<const std::uint32_t> find_neighbours(std::uint32_t i);
  void mark_near_bounds(std::uint32_t i);
  void leave_shell(std::uint32_t i);
  template <class Grid>
  void draw_shell(Grid& grid, std::uint32_t i);

  // --- contacts
  template <bool watched>
  bool process_until(double until);
  bool go_on(double until);
  template <Order order>
  void process(std::uint32_t i, std::uint32_t k);
  void process_and_tell(std::uint32_t i, std::uint32_t k);
  void tell(std::uint32_t i) const;
  void tell_all() const;
  bool is_mutual(std::uint32_t i, std::uint32_t j) const {
    return disks_[j].event_time == now_ && disks_[j].partner == static_cast<std::int32_t>(i);
  }
  void fetch_lists(std::size_t ahead) const;
  void fetch_for_upcoming() const;
  template <Order order>
  void collide(std::uint32_t i, std::uint32_t j);
  void exchange(std::uint32_t i, std::uint32_t j, Motion& first, Motion& second);
  void hit_wall(std::uint32_t i);
  void hit_floor(std::uint32_t i, Motion& motion);
  double hop_velocity(double floor_acceleration, double slope_sine = 1) const;
  // --- a cell's sloped sides and free lid: engine_cell.hpp
  struct FreeLid {
    double mass = never;  // never: it stands still
    double z = 0, vz = 0, own_time = 0;
    double lowest = 0;         // where it is taken to be by those that could touch it
    double leaves_at = never;  // when it may be lower
    bool is_free() const { return mass < never; }
  };
  void hit_slope(std::uint32_t i, Motion& motion, bool left);
  template <class Stop>
  void relieve_in_cell(std::uint32_t i, double touching, const Stop& stop);
  void hit_free_lid(std::uint32_t i, Motion& motion);
  void bring_lid_forward();
  void draw_lid_bound();
  void act_lid();
  void predict_below_lid(std::uint32_t but);
  double lid_height() const {
    const double later = now_ - lid_.own_time;
    return lid_.is_free() ? lid_.z + (lid_.vz - 0.5 * gravity_ * later) * later : lid_height_;
  }
  double lid_velocity() const { return lid_.is_free() ? lid_.vz - gravity_ * (now_ - lid_.own_time) : 0; }
  double time_to_slope(const Disk& disk, double radius, bool left, double horizon) const;
  // Free distance from a sloped side that belongs to a floor at that height.
  double gap_to_slope(double x, double z, double radius, bool left, double floor) const {
    return slope_cosine_ * (left ? x : width_ - x) + slope_sine_ * (z - floor) - radius;
  }
  void bounce(std::uint32_t i, Motion& motion, double nx, double nz, double wall_vz, const Contact& surface);
  bool too_soon(std::uint32_t i, std::uint32_t j);
  [[gnu::cold]] void withhold(std::uint32_t i, std::uint32_t j, double reduced_mass, double approach,
                              const Contact& surface);
  std::optional<double> unusual_restitution(std::uint32_t i, std::uint32_t j, TwoLanes d, TwoLanes dv);
  bool locked();
  void relieve();
  std::uint64_t events_between_checks() const { return 4096 + 200 * static_cast<std::uint64_t>(count_); }

  void act_bath();

  // --- plates: engine_plates.hpp.
  // The flight's velocity at the end of an interval in which the disk meets nothing. Then by how much it is wrong at
  // the beginning, and what is added to it at the end.
  struct Rub {
    double flown_x = 0, flown_z = 0, before_x = 0, before_z = 0, after_x = 0, after_z = 0;
  };
  // The same of the spin, where plates brake it.
  struct SpinRub {
    double before = 0, after = 0;
  };
  [[gnu::cold]] void act_plates();
  [[gnu::cold]] void begin_rub();
  [[gnu::noinline]] Slide slide_and_spin(std::uint32_t i, double vx, double vz, double pull, double duration,
                                         double& spin) const;
  FloorMotion::Motion plate_motion(double later) const;
  void push_from_plate(std::uint32_t i, double vx, double vz, double plate_velocity);
  [[gnu::noinline]] void turn_by_plate(std::uint32_t i, double spin);
  bool slides_on(std::uint32_t i, const Motion& motion) const;
  [[gnu::cold]] TwoLanes velocity_with_friction(std::uint32_t i, const Motion& motion) const;
  [[gnu::cold]] double spin_with_friction(std::uint32_t i, const Motion& motion) const;

  // --- rest: engine_rest.hpp
  static constexpr bool rests_apply = Space::falls && Rule::dissipates && !Space::is_cell;
  void plan_rest(bool wanted);
  void look_again();
  void act_rest();
  bool is_calm(const FloorMotion::Motion& floor);
  void lay_down(const FloorMotion::Motion& floor);
  void stop(std::uint32_t i, const FloorMotion::Motion& floor);
  void wake(std::uint32_t i);
  void wake_unsupported(const FloorMotion::Motion& floor);
  void wake_all();
  void hop(double length, const FloorMotion::Motion& floor);
  void push_from_floor(std::uint32_t i, double vz, double floor);
  void tell_push(std::uint32_t i, double floor, double given) const;
  bool push_off_rest(std::uint32_t i, std::uint32_t j, Motion& first, Motion& second, TwoLanes d);
  double time_pressed(double horizon) const;
  bool is_supported(std::uint32_t i, double floor);
  bool is_at_rest(std::uint32_t i) const { return rest_height_[i] < never; }
  double energy_of(std::uint32_t i, TwoLanes velocity) const;

  // --- press: engine_press.hpp
  static constexpr bool press_applies = rests_apply && Sizes::equal;
  void plan_press(bool wanted);
  void ask_press();
  std::optional<double> approach_of_neighbours() const;
  void begin_press();
  void go_on_pressed();
  void write_down_pressed();
  void end_press();
  void soften_pressed();
  void harden_pressed(double contact_time, double most);
  void adapt_contact_time(bool stays);
  void check_press(const FloorMotion::Motion& floor);
  bool press_until(double until);
  FloorMotion::Motion press_on(const FloorMotion::Motion& before, double next);
  void tell_pressed(double step) const;
  bool chatters();
  bool is_cold() const;
  bool lands_soft() const { return Rule::spins && floor_falls_; }  // a cold bed
  void keep_stretches();
  std::vector<PressedBed::Stretch> stretches_by_place() const;
  double spin_now(std::uint32_t i) const { return is_pressed_ ? pressed_.spin_at(i, now_ - pressed_to_) : spins_[i]; }
  Motion motion_now(std::uint32_t i) const {
    if (!is_pressed_) return motion_at(disks_[i], now_);
    const PressedBed::State state = pressed_.at(i, now_ - pressed_to_);
    return {TwoLanes{state.x, state.z}, TwoLanes{state.vx, state.vz}};
  }

  // --- tiles
  static constexpr bool tiles_apply = Space::wraps_x && Space::wraps_z && !Rule::dissipates;
  void choose_tiles();
  void leave_tiles();
  bool process_tiles_until(double until);
  bool process_window(double until);
  void queue_tile(const Tile& tile, double until);
  template <Order order>
  bool process_queued(const Tile* tile, double until);
  bool is_for_tile(const Tile& tile, std::uint32_t i, double time) const {
    return tile.holds(disks_[i], margin_ + margin_growth_ * (time - log_.start()));
  }
  void defer(double time, std::uint32_t a, std::uint32_t b) { deferred_.push_back({time, pair_of(a, b)}); }
  template <Order order>
  void predict_in_window(std::uint32_t i);
  template <bool others_ahead>
  Candidate next_contact_of(std::uint32_t i, const Disk& me) const;
  Candidate contact_with_past(std::uint32_t i, std::uint32_t k) const;
  bool kept_near(std::uint32_t i) const;
  void go_back(std::uint32_t i, std::uint32_t j);
  void take_back(std::uint32_t i);
  void take_back_last(std::uint32_t i);

  // --- synchronisation
  void synchronise();
  void begin_interval();
  void renumber();
  template <class Self, class Visit>
  [[gnu::cold]] static void visit_state(Self& self, Visit visit);

  double kinetic_energy() const;
  double potential_energy() const;

  // --- what the scene says
  std::uint32_t count_;
  double gravity_ = 0;
  double width_ = 0;
  double lid_height_ = never;
  Period period_x_, period_z_;
  FloorMotion floor_;
  bool hard_sides_ = false;
  Contact disk_surface_, side_surface_, floor_surface_, lid_surface_;
  bool unusual_ = false;  // contacts of disks may be more than their surface's: it varies, or one of them rests
  double contact_duration_ = 0;
  double inverse_inertia_ratio_ = 2;  // 1/q
  [[no_unique_address]] Sizes sizes_;
  Bath bath_;
  double slope_sine_ = 0, slope_cosine_ = 1;
  FreeLid lid_;
  RubbingPlates plates_;  // without deceleration: smooth

  // --- the state
  LargeVector<Disk> disks_;            // and a sentinel after the last
  std::vector<std::uint32_t> labels_;  // what a disk is called outside: its place in the start
  std::vector<double> spins_;          // rough disks only
  std::vector<double> last_contact_;   // contact clocks, dissipative disks only
  // When its latest contact was that the clock made elastic and that belongs to a chain whose energy has been counted.
  std::vector<double> withheld_at_;
  bool chain_counted_ = false;   // of the contact at hand, where the clock made it elastic
  double now_ = 0;               // since base_
  double base_ = 0;              // of the present count, since the start
  double interval_ = 1;          // the floor's period
  std::uint64_t intervals_ = 1;  // that many of them between synchronisations now
  std::uint64_t intervals_done_ = 0;
  double synchronise_at_ = 1;
  double event_rate_ = 1;
  std::uint64_t events_at_synchronisation_ = 0;
  double bath_at_ = never;          // next action of the reservoir
  double rub_at_ = never;           // next action of the plates
  std::vector<Rub> rubs_;           // empty for smooth plates
  std::vector<SpinRub> spin_rubs_;  // empty unless plates brake the spin
  double checked_at_ = -1;          // for rows that lock, see locked()
  // Events until that check, and until advance_towards() returns; in process_until() those beyond the next pause, which
  // is after events_to_pause_ - 1 more.
  std::uint64_t events_to_check_ = 1, events_to_return_ = 1, events_to_pause_ = 1;
  std::uint32_t crawls_ = 0;
  Random random_;
  Counters counters_;
  Watcher* watcher_ = nullptr;
  double initial_energy_ = 0, dissipated_ = 0, floor_work_ = 0, bath_work_ = 0, rubbed_ = 0;

  // --- tiles; none: everything is done in the order of time
  std::vector<Tile> tiles_;
  ContactLog log_;
  std::vector<EventEntry> deferred_, rest_;
  std::vector<std::uint32_t> taken_back_;  // disks that have lost contacts
  double longest_window_ = 0;
  double rate_in_tiles_ = 1;               // events a time unit in the window before
  double margin_ = 0, margin_growth_ = 0;  // from a tile's border, when a window begins, and what is added a time unit
  std::uint64_t events_left_ = 0;          // so many more in a window, and something has locked

  // --- rest
  std::vector<double> rest_height_;  // above the floor's, of disks at rest; `never` of the others
  std::uint32_t resting_ = 0;
  bool woken_ = false;                        // a disk has lost its rest, and others perhaps their support
  double rest_at_ = never, look_at_ = never;  // the next hop or look; the next look
  bool rests_ = false;
  double rest_period_ = 1;
  std::uint64_t contacts_at_look_ = 0;

  // --- press
  PressedBed pressed_;  // while is_pressed_ the disks are there; their records are of no use
  bool presses_ = false, is_pressed_ = false, is_asleep_ = false;
  bool press_wanted_ = false;  // events end here
  double pressed_to_ = 0;      // the end of the last step
  double press_contact_time_ = 1;
  double released_at_ = never;      // since when the floor has fallen away, since the start
  double energy_when_pressed_ = 0;  // when pressed_ was begun, and its springs
  double step_error_ = 0;           // of the ledger, before that
  double asked_at_ = 0;
  std::uint64_t contacts_when_asked_ = 0, floor_contacts_when_asked_ = 0, events_to_ask_ = 1;
  // Rough disks: contacts are counted since then; and the tangential springs, by labels, from one interval to the next.
  double counted_since_ = 0;
  std::uint64_t contacts_when_counted_ = 0;
  bool chatters_ = false, pressed_in_interval_ = false;
  bool floor_falls_ = false;  // faster than disks do, once a period
  double floor_speed_ = 0;    // at most
  std::vector<PressedBed::Stretch> stretches_;

  // --- bookkeeping
  double smallest_skin_ = 0.15, largest_skin_ = 0.36;
  double ahead_ = 0;                 // how far ahead of its disk a shell of the largest size is centred
  bool beyond_cache_ = false;        // so many disks that it pays to fetch ahead
  ShellGridFor<Space::falls> grid_;  // where the shells are
  NeighbourLists lists_;
  EventQueue queue_;
  std::array<Pending, 2> pending_;
  // Of the disk that look_round() was called for: those nearby, and the radius
  // of a shell of its own that would just reach theirs. The arrays are longer
  // than their counts, see compress().
  LargeVector<std::uint32_t> nearby_, found_;
  LargeVector<float> reached_by_;
  std::size_t nearby_count_ = 0;
  double largest_contact_ = 1;  // the largest distance of two centres in contact
  float shell_slack_ = 0;       // covers the rounding of shells' centres, distances and exit times
};

}  // namespace shakebed::sim

// The member functions; none of these headers needs another one to come before it but for constants.
#include "sim/engine/engine_baths.hpp"
#include "sim/engine/engine_cell.hpp"
#include "sim/engine/engine_checks.hpp"
#include "sim/engine/engine_contacts.hpp"
#include "sim/engine/engine_flight.hpp"
#include "sim/engine/engine_loop.hpp"
#include "sim/engine/engine_plates.hpp"
#include "sim/engine/engine_prediction.hpp"
#include "sim/engine/engine_press.hpp"
#include "sim/engine/engine_rest.hpp"
#include "sim/engine/engine_shells.hpp"
#include "sim/engine/engine_state.hpp"
#include "sim/engine/engine_synchronise.hpp"
#include "sim/engine/engine_tiles.hpp"
