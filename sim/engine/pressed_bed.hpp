// A bed under load as soft disks: a spring and a dashpot in every contact, small steps of time. What hard disks do by
// ever more and ever smaller contacts, a bed that lies on the floor does here in contacts that last. Equal disks,
// smooth or rough; the engine decides when (engine_press.hpp).
//
// The spring's force is linear in (1 - r^2)/2, r being the distance of the centres: in the overlap, but for its square.
// So no root is taken. Disks stand along their rows, and four pairs are computed at a time (pressed_rows.hpp).
//
// Rough disks have a tangential spring and dashpot in every contact, too, which give way to Coulomb friction
// [CundallStrack1979]. The spring is stretched by the slip while the contact lasts.
//
// A value owns its disks; one thread at a time may use one. Reduced units.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "sim/engine/disk.hpp"
#include "sim/engine/floor_motion.hpp"
#include "sim/engine/lanes.hpp"
#include "sim/engine/pressed_rows.hpp"
#include "sim/scene/surface.hpp"

namespace shakebed::sim {

// Velocity Verlet with steps of a fraction of the contact time. Each dashpot is such that contacts of two disks which
// begin at any moment within a step lose 1 - e^2 of their energy in the mean.
class PressedBed {
 public:
  struct Box {
    double width = 0, period = 0, lid = never;  // period 0: hard sides
  };
  struct Surfaces {
    Surface disks, sides, floor, lid;
  };
  enum Wall : std::uint32_t { at_left, at_right, at_floor, at_lid, walls };
  // Stretch of the tangential spring of two disks, or of a disk and a wall: then `other` is count + wall.
  struct Stretch {
    std::uint32_t disk, other;
    double stretch;
  };
  struct alignas(32) State {
    double x, z, vx, vz;
  };
  // Steps a contact time. The mean loss is right with any; with 4 a packed bed was unstable. Spins against one another
  // swing faster than disks do: by 1.2 for spheres.
  static constexpr double steps_a_contact = 6, steps_of_rough = 8;
  // Smooth disks whose contacts last longer than this keep the dashpots of contacts that do not, so that what the bed
  // still does dies out as soon. Unless the dashpot of a contact time of 1 were more than the most: steps follow no
  // more.
  static constexpr double dashpot_time = 1.2e-3, most_damping = 0.4;
  static constexpr std::uint32_t steps_a_check = 8;  // of who may touch whom, and of the contact time

  // inverse_inertia_ratio: 1/q of disks that spin, 0 of smooth ones.
  void set_up(const Box& box, const Surfaces& surfaces, double inverse_inertia_ratio = 0);
  void begin(std::vector<State> disks, const FloorMotion::Motion& floor, double contact_time,
             const std::vector<double>& spins = {}, const std::vector<Stretch>& stretches = {});
  double steps() const { return rough_ ? steps_of_rough : steps_a_contact; }
  // One step of dt, from a floor that moves so to one that moves so.
  void step(const FloorMotion::Motion& before, const FloorMotion::Motion& after, double dt);
  // Springs and dashpots as of another contact time, from now on.
  void soften(double contact_time);
  bool check_due() const { return until_check_ == steps_a_check; }  // in step with the checks of neighbours

  // At rest against the floor, and on with it; awake again.
  void lie(const FloorMotion::Motion& floor);
  void carry(const FloorMotion::Motion& before, const FloorMotion::Motion& after);
  void wake(const FloorMotion::Motion& floor);

  // Against the floor, at the last check.
  double fastest() const { return fastest_; }
  double mean_square_speed() const { return mean_square_speed_; }
  double side_temperature() const { return side_temperature_; }  // mean v_x^2

  // After the last step, and `later` than that.
  State at(std::uint32_t i, double later) const;
  double spin_at(std::uint32_t i, double later) const {
    const std::uint32_t place = place_of_[i];
    return (rim_halfway_[place] + (0.5 * last_step_ + later) * rim_force_[place]) / 0.5;
  }
  std::vector<Stretch> stretches() const;
  void let_go();  // of all tangential springs; their energy counts as damped
  double floor_force() const { return floor_force_; }
  double floor_work() const { return floor_work_; }                           // since begin()
  double damped() const { return damped_ + 0.5 * last_step_ * loss_rate(); }  // in dashpots, since begin()
  double loss_rate() const;                                                   // of the dashpots now
  double compressed() const;                                                  // energy of the springs
  double approach() const;  // of disks in contact, root of the mean square
  std::uint32_t touching() const { return static_cast<std::uint32_t>(touching_); }  // pairs
  // Calls visit(centre of the first, from there to the second, force on the second) for each pair in contact.
  template <class Visit>
  void each_contact(Visit visit) const {
    each_neighbour([&](std::uint32_t i, std::uint32_t k, std::size_t lane) {
      const TwoLanes d = gap_of(i, k);
      const double u = 1 - (d[0] * d[0] + d[1] * d[1]);
      if (!(u > 0)) return;
      const TwoLanes flow = (velocity_of(k) - velocity_of(i)) * d;
      const double force = 0.5 * pair_.stiffness * u - pair_.damping * (flow[0] + flow[1]);
      TwoLanes on_second = both(force) * d;
      if (rough_) {
        const TwoLanes tangent = {-d[1], d[0]};
        const TwoLanes slip = (velocity_of(i) - velocity_of(k)) * tangent;
        on_second -= both(pair_.grip.force(stretch_[lane], slip[0] + slip[1] + rim_[i] + rim_[k], force)) * tangent;
      }
      visit(TwoLanes{x_[i], z_[i]}, d, on_second);
    });
  }
  // Calls visit(disk, whether it is on the floor, force on it) for each disk in contact with a wall.
  template <class Visit>
  void each_wall_contact(Visit visit) const {
    const auto all = [&](const std::vector<std::uint32_t>& near, Wall wall, TwoLanes inward, double place, double speed,
                         const Spring& spring) {
      for (const std::uint32_t i : near) {
        const double force = wall_force(i, inward, place, speed, spring).force;
        if (force == 0) continue;
        TwoLanes on_disk = both(force) * inward;
        if (rough_) {
          const TwoLanes tangent = {inward[1], -inward[0]}, slip = velocity_of(i) * tangent;
          const double stretch = wall_stretch_[walls * disk_of_[i] + wall];
          on_disk += both(spring.grip.force(stretch, slip[0] + slip[1] + rim_[i], force)) * tangent;
        }
        visit(disk_of_[i], wall == at_floor, on_disk);
      }
    };
    all(near_left_, at_left, TwoLanes{1, 0}, 0, 0, side_);
    all(near_right_, at_right, TwoLanes{-1, 0}, -box_.width, 0, side_);
    all(near_lid_, at_lid, TwoLanes{0, -1}, -box_.lid, 0, lid_);
    all(near_floor_, at_floor, TwoLanes{0, 1}, floor_at_.position, floor_at_.velocity, floor_);
  }
  // Moves apart what overlaps, half of it each, until all do by no more than `most` or for so many sweeps.
  void separate(double floor, double most, int sweeps);

 private:
  struct Grip {
    double stiffness = 0, damping = 0, friction = 0;
    double most(double normal_force) const { return friction * std::max(normal_force, 0.0); }
    // Against the slip, of a spring that is stretched no farther than friction allows.
    double force(double stretch, double slip, double normal_force) const {
      return std::clamp(-stiffness * stretch - damping * slip, -most(normal_force), most(normal_force));
    }
  };
  struct Spring {
    double stiffness = 0, damping = 0;  // of mass 1
    Grip grip{};
  };
  struct WallContacts {
    double force = 0, lost = 0;
  };
  struct Pulled {
    double force, lost;
  };
  struct LaneGrip;
  // Where the numbers below stand, for loops: the compiler knows that no store changes these pointers.
  struct Numbers {
    double *x, *z, *vx, *vz, *halfway_x, *halfway_z, *force_x, *force_z, *dashpot_x, *dashpot_z, *rim, *rim_halfway,
        *rim_force;
  };
  Numbers numbers();
  Spring spring_of(const Surface& surface) const;
  Grip grip_of(const Surface& surface) const;
  Pulled pull(double& stretch, const Grip& grip, double slip, double slipped, double normal_force) const;
  double stretched() const;
  std::vector<Stretch> pair_stretches() const;
  void place_stretches(std::vector<Stretch> stretches);
  void list_neighbours();
  void list_walls(double floor, double margin);
  void check(const FloorMotion::Motion& floor, double dt);
  void move(double dt);
  void add_forces(const FloorMotion::Motion& floor);
  template <bool periodic>
  void add_all_pair_forces();
  template <bool periodic, bool in_row>
  void add_pair_forces(const PairBlock* pair, const PairBlock* end);
  template <bool periodic, bool in_row>
  void add_rough_pair_forces(const PairBlock* pair, const PairBlock* end);
  WallContacts wall_force(std::uint32_t i, TwoLanes inward, double place, double speed, const Spring& spring) const;
  WallContacts add_wall_forces(const std::vector<std::uint32_t>& near, Wall wall, TwoLanes inward, double place,
                               double speed, const Spring& spring);
  TwoLanes velocity_of(std::uint32_t i) const { return TwoLanes{vx_[i], vz_[i]}; }
  TwoLanes gap_of(std::uint32_t i, std::uint32_t k) const;
  // Calls visit(place, place of the other, lane) for each two that may touch.
  template <class Visit>
  void each_neighbour(Visit visit) const {
    const std::vector<PairBlock>& blocks = rows_.blocks();
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      for (std::uint32_t q = 0; q < PressedRows::lanes; ++q) {
        const std::uint32_t i = blocks[b].first + q, k = blocks[b].second + q;
        if (k < count_) visit(i, k, PressedRows::lanes * b + q);
      }
    }
  }

  Box box_;
  std::array<Spring, 4> of_unit_time_;  // of a contact time of 1
  Spring pair_, side_, floor_, lid_;
  std::uint32_t count_ = 0;
  PressedRows rows_;
  std::vector<std::uint32_t> disk_of_, place_of_;  // of a place, and of a disk
  // By place; behind the last stand some that touch nothing. Velocities: those foreseen for the end of the step, and
  // those half a step before. Forces but for the weight, and what of them is that of the dashpots of pairs.
  std::vector<double> x_, z_, vx_, vz_, halfway_x_, halfway_z_, force_x_, force_z_, dashpot_x_, dashpot_z_;
  std::vector<double> listed_x_, listed_z_;  // when the neighbours were listed
  std::vector<double> permuted_;             // while they are
  double last_step_ = 0;
  // --- of rough disks
  bool rough_ = false;
  double inverse_inertia_ratio_ = 0;
  // R times the spin, foreseen and half a step before, and how it is accelerated. By place.
  std::vector<double> rim_, rim_halfway_, rim_force_;
  // Of the lanes of the blocks; {left, right, floor, lid} of each disk.
  std::vector<double> stretch_, wall_stretch_;
  double slip_time_ = 0;                                                       // the step whose forces are added
  double rubbed_ = 0;                                                          // lost by tangential forces in this step
  std::vector<std::uint32_t> near_left_, near_right_, near_floor_, near_lid_;  // places
  std::uint32_t until_check_ = steps_a_check;
  double touching_ = 0, pair_squares_ = 0;  // at the last check
  double wall_loss_rate_ = 0, floor_force_ = 0, floor_work_ = 0, damped_ = 0;
  double fastest_ = never, mean_square_speed_ = never, side_temperature_ = never;
  FloorMotion::Motion floor_at_{};  // that of the latest forces
};

}  // namespace shakebed::sim
