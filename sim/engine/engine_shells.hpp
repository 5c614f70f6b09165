// Shells and neighbour lists: who can meet whom. Included by engine.hpp only.
#pragma once

namespace shakebed::sim {

inline constexpr double shell_slack = 1e-9;    // covers the rounding of shells' centres and exit times [D]
inline constexpr double most_crowding = 0.01;  // further cells a cell of four shells; above, seven are quicker

// Files every disk's shell, round where it is now, in a grid of that height.
template <class Space, class Rule, class Sizes>
template <class Grid>
void Engine<Space, Rule, Sizes>::file_shells(Grid& grid, double height) {
  grid.reset(disks_.data(), largest_contact_ + 2 * largest_skin_ + shell_slack_, width_, height);
  for (std::uint32_t i = 0; i < count_; ++i) {
    centre_shell(i);
    disks_[i].skin = static_cast<std::uint8_t>(std::min(largest_skin_, 0.36) / skin_unit);
    grid.file(i, reach(i));
  }
}
// The same in the kind of cells that suits it: a bed is denser at times than it may be now.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::file_shells(double height) {
  if constexpr (!Space::falls) {
    auto& narrow = grid_.template emplace<ShellGrid<NarrowCell>>();
    file_shells(narrow, height);
    if (narrow.crowding() < most_crowding) return;
  }
  file_shells(grid_.template emplace<ShellGrid<WideCell>>(), height);
}

// Where the disk is, or will be when it has gone so far ahead without gravity.
template <class Space, class Rule, class Sizes>
TwoLanes Engine<Space, Rule, Sizes>::shell_centre(const Motion& motion, [[maybe_unused]] double ahead) const {
  if constexpr (!Space::falls) {
    const double squared = motion.vx() * motion.vx() + motion.vz() * motion.vz();
    if (squared > 0) return fused(motion.velocity, both(ahead / std::sqrt(squared)), motion.place);
  }
  return motion.place;
}

// Centres the disk's shell there, and takes the image of the disk that has the centre in the box.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::centre_shell(std::uint32_t i, double ahead) {
  Disk& disk = disks_[i];
  TwoLanes here = shell_centre(motion_at(disk, now_), ahead);
  if constexpr (Space::wraps_x) {
    const double off = period_x_.beyond(here[0]);
    disk.x -= off;
    here[0] -= off;
  }
  if constexpr (Space::wraps_z) {
    const double off = period_z_.beyond(here[1]);
    disk.z -= off;
    here[1] -= off;
  }
  disk.shell_x = static_cast<float>(here[0]);
  disk.shell_z = static_cast<float>(here[1]);
}

// Fills nearby_ with the disks whose shells overlap the largest shell that disk i may have. With `how_near` it also
// fills reached_by_: the size of i's shell that would just touch theirs.
template <class Space, class Rule, class Sizes>
template <bool how_near, class Grid>
void Engine<Space, Rule, Sizes>::look_round(const Grid& grid, std::uint32_t i) {
  const std::size_t most = inline_neighbours * (grid.most_eights_round() + 1);
  if (nearby_.size() < most) [[unlikely]] {
    nearby_.resize(2 * most);
    reached_by_.resize(2 * most);
  }
  const FloatLanes x = all_floats(disks_[i].shell_x), z = all_floats(disks_[i].shell_z);
  const FloatLanes mine = all_floats(static_cast<float>(sizes_.radius(i)) + shell_slack_);
  const FloatLanes largest = all_floats(static_cast<float>(largest_skin_));
  const WordLanes me = all_words(i);
  const Period across = period_x_, up = period_z_;
  std::uint32_t* const nearby = nearby_.data();
  [[maybe_unused]] float* const reached = reached_by_.data();
  std::size_t count = 0;
  grid.each_eight_round(i, [&](FloatLanes cx, FloatLanes cz, FloatLanes reach, WordLanes ids) {
    FloatLanes dx = cx - x, dz = cz - z;
    if constexpr (Space::wraps_x) dx = across.nearest(dx);
    if constexpr (Space::wraps_z) dz = up.nearest(dz);
    const FloatLanes contact = reach + mine, far = contact + largest, squared = fused(dx, dx, dz * dz);
    const WordLanes near = (squared < far * far) & (ids != me);
    if constexpr (how_near) {
      count += compress(near, ids, sqrt_floats(squared) - contact, nearby + count, reached + count);
    } else {
      count += compress(near, ids, nearby + count);
    }
  });
  nearby_count_ = count;
}

// The largest shell with which i would have no more than eight neighbours,
// within bounds: it stops short of the ninth nearest. After look_round<true>().
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::choose_skin(std::uint32_t i) {
  constexpr std::size_t usual = std::size_t{2} * inline_neighbours;
  const auto most = static_cast<float>(largest_skin_);
  float skin = most;
  if (nearby_count_ > inline_neighbours) {
    float* const reached = reached_by_.data();
    const std::size_t blocks = (nearby_count_ + inline_neighbours - 1) / inline_neighbours;
    for (std::size_t k = nearby_count_; k < usual || k < blocks * inline_neighbours; ++k) reached[k] = most;
    // Of those before which fewer than eight stand none is the ninth; the nearest of the others is.
    FloatLanes ninth = all_floats(most);
    const auto nearest_but_eight = [&](std::size_t q, std::size_t count) {
      const FloatLanes mine = eight_floats(reached + q);
      WordLanes nearer{};
#pragma GCC unroll 16
      for (std::size_t k = 0; k < count; ++k) nearer -= all_floats(reached[k]) < mine;
      ninth = smaller(ninth, select(nearer < static_cast<std::int32_t>(inline_neighbours), ninth, mine));
    };
    if (blocks == 2) [[likely]] {
      nearest_but_eight(0, usual);
      nearest_but_eight(inline_neighbours, usual);
    } else {
      for (std::size_t q = 0; q < blocks; ++q) nearest_but_eight(q * inline_neighbours, blocks * inline_neighbours);
    }
    skin = std::max(smallest_of(ninth), static_cast<float>(smallest_skin_));
  }
  disks_[i].skin = static_cast<std::uint8_t>(skin * static_cast<float>(1 / skin_unit));
}

// Those of nearby_ that i's shell reaches. After look_round<true>().
template <class Space, class Rule, class Sizes>
std::span<const std::uint32_t> Engine<Space, Rule, Sizes>::find_neighbours(std::uint32_t i) {
  const FloatLanes skin = all_floats(static_cast<float>(disks_[i].skin * skin_unit));
  if (found_.size() < nearby_.size()) found_.resize(nearby_.size());
  const auto end = static_cast<std::int32_t>(nearby_count_);
  WordLanes place = {0, 1, 2, 3, 4, 5, 6, 7};
  std::size_t found = 0;
  for (std::size_t q = 0; q < nearby_count_; q += inline_neighbours, place += inline_neighbours) {
    const FloatLanes mine = eight_floats(&reached_by_[q]);
    const WordLanes near = (mine < skin) & (place < end);
    found += compress(near, eight_words(&nearby_[q]), mine, &found_[found], &reached_by_[found]);
  }
  return {found_.data(), found};
}

// Notes which walls the disk could touch from its shell, and whether a neighbour could stand beyond the box's edge.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::mark_near_bounds(std::uint32_t i) {
  Disk& disk = disks_[i];
  unsigned near = 0;
  const auto note = [&near](bool it_is, unsigned bit) { near |= bit & -static_cast<unsigned>(it_is); };
  if constexpr (Space::has_walls) {
    const double reach = sizes_.radius(i) + disk.skin * skin_unit + shell_slack;
    bool slopes = false;
    if constexpr (Space::is_cell) {
      slopes = slope_sine_ > 0;
      const double x = disk.shell_x, z = disk.shell_z, highest = floor_.highest();
      note(slopes && gap_to_slope(x, z, reach, true, highest) < 0, near_left_wall);
      note(slopes && gap_to_slope(x, z, reach, false, highest) < 0, near_right_wall);
    }
    note(!slopes & hard_sides_ & (disk.shell_x < reach), near_left_wall);
    note(!slopes & hard_sides_ & (disk.shell_x > width_ - reach), near_right_wall);
    bool meets_floor = disk.shell_z < floor_.highest() + reach;
    if constexpr (rests_apply) meets_floor = meets_floor && !is_at_rest(i);
    note(meets_floor, near_floor);
    double lid = lid_height_;
    if constexpr (Space::is_cell) lid = lid_.is_free() ? lid_.lowest : lid;
    note(disk.shell_z > lid - reach, near_lid);
  }
  const double reach = largest_contact_ + disk.skin * skin_unit + largest_skin_ + shell_slack_;
  const auto at_edge = [reach](double centre, const Period& period) {
    return (centre < reach) | (centre > period.length - reach);
  };
  if constexpr (Space::wraps_x) note(at_edge(disk.shell_x, period_x_), near_edge);
  if constexpr (Space::wraps_z) note(at_edge(disk.shell_z, period_z_), near_edge);
  disk.near = static_cast<std::uint8_t>(near);
}

// Draws a new shell round disk i, in all but the lists of the neighbours that it loses or wins: lists_.mend() is to
// follow.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::leave_shell(std::uint32_t i) {
  std::visit([this, i](auto& grid) { this->draw_shell(grid, i); }, grid_);
}
template <class Space, class Rule, class Sizes>
template <class Grid>
void Engine<Space, Rule, Sizes>::draw_shell(Grid& grid, std::uint32_t i) {
  grid.unfile(i);
  // Where no more than eight are near the largest shell will do, and nobody need be ranked. So it most often is where
  // it was so before.
  const auto largest = static_cast<std::uint8_t>(largest_skin_ / skin_unit);
  bool largest_will_do = disks_[i].skin == largest;
  centre_shell(i, largest_will_do ? ahead_ : 0);
  if (largest_will_do) [[likely]] {
    look_round<false>(grid, i);
    largest_will_do = nearby_count_ <= inline_neighbours;
  }
  std::span<const std::uint32_t> found(nearby_.data(), nearby_count_);
  if (!largest_will_do) [[unlikely]] {
    if (!Space::falls && ahead_ > 0) centre_shell(i);
    look_round<true>(grid, i);
    choose_skin(i);
    found = find_neighbours(i);
  }
  grid.file(i, reach(i));
  mark_near_bounds(i);
  lists_.relist(i, found);
}

}  // namespace shakebed::sim
