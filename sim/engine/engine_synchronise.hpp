// Synchronisation: all disks at one time, everything predicted anew, and the state from which a run goes on. Included
// by engine.hpp only.
#pragma once

namespace shakebed::sim {

inline constexpr std::uint64_t seldom = std::numeric_limits<std::uint64_t>::max() / 2;
inline constexpr double longest_interval = 64;  // between synchronisations, unless the floor's period is longer

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::synchronise() {
  ++counters_.synchronisations;
  const bool was_pressed = is_pressed_;
  if constexpr (press_applies) {
    if (was_pressed) write_down_pressed();
    chatters_ = was_pressed || pressed_in_interval_;
    pressed_in_interval_ = false;
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    bring_forward(i);
    disks_[i].own_time = 0;
  }
  for (double& time : last_contact_) time -= now_;
  for (double& time : withheld_at_) time -= now_;
  bath_at_ -= now_;
  rub_at_ -= now_;
  if constexpr (Space::is_cell) {
    bring_lid_forward();
    lid_.own_time = 0;
  }
  rest_at_ -= now_;
  look_at_ -= now_;
  pressed_to_ -= now_;
  assert(now_ == synchronise_at_ && pending_[0].disk == nothing_pending);
  const double elapsed = now_;
  intervals_done_ += intervals_;
  base_ = static_cast<double>(intervals_done_) * interval_;
  now_ = 0;
  tell_all();  // as a run that goes on from here will be: what the watcher sums up is then cut at the same moments
  // Often enough for the clock's resolution, seldom enough to cost nothing: 150
  // to 1000 events a disk apart.
  const std::uint64_t events = counters_.events() - events_at_synchronisation_;
  events_at_synchronisation_ = counters_.events();
  event_rate_ = std::max(static_cast<double>(events), 1.0) / elapsed;
  const double events_a_disk = static_cast<double>(events) / count_;
  if (events_a_disk < 150 && elapsed * 2 <= longest_interval) intervals_ *= 2;
  if (events_a_disk > 1000 && intervals_ > 1) intervals_ /= 2;
  begin_interval();
  if constexpr (press_applies) {
    if (was_pressed) go_on_pressed();
  }
}

// Puts values of all disks into the order of keys_along_curve().
template <class Values>
void permute_by_keys(Values& values, const std::vector<std::uint64_t>& keys) {
  const Values old = values;
  for (std::size_t i = 0; i < keys.size(); ++i) values[i] = old[static_cast<std::uint32_t>(keys[i])];
}

// Keys of the disks in the order of a space-filling curve; a key's lower half is the disk's number.
inline std::vector<std::uint64_t> keys_along_curve(std::span<const Disk> disks, const Period& across,
                                                   const Period& up) {
  std::vector<std::uint64_t> keys(disks.size());
  for (std::size_t i = 0; i < disks.size(); ++i) {
    const std::uint32_t column = hilbert_cell(across.wrapped(disks[i].x)), row = hilbert_cell(up.wrapped(disks[i].z));
    keys[i] = static_cast<std::uint64_t>(hilbert_place(column, row)) << 32 | i;
  }
  std::sort(keys.begin(), keys.end());
  return keys;
}

// Numbers the disks along a space-filling curve. Sorting what is sorted changes
// nothing, so a resumed run has the numbers of the one it continues.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::renumber() {
  const std::vector<std::uint64_t> keys = keys_along_curve({disks_.data(), count_}, period_x_, period_z_);
  const auto permute = [&keys](auto& values) { permute_by_keys(values, keys); };
  permute(disks_);
  permute(labels_);
  if constexpr (Rule::spins) permute(spins_);
  if constexpr (Rule::dissipates) {
    permute(last_contact_);
    permute(withheld_at_);
  }
  if constexpr (rests_apply) permute(rest_height_);
  if (!rubs_.empty()) permute(rubs_);
  if (!spin_rubs_.empty()) permute(spin_rubs_);
  if constexpr (!Sizes::equal) {
    permute(sizes_.radii);
    permute(sizes_.masses);
  }
}

// The density in layers across the box, mean over the disks: a bed under gravity is denser where its disks are than the
// space that it takes up.
inline double density_round(std::span<const Disk> disks, double width) {
  constexpr double usual_thickness = 3;  // some rows of a crystal
  constexpr std::size_t most_layers = 4096;
  double low = never, high = -never;
  for (const Disk& disk : disks) {
    low = std::min(low, disk.z);
    high = std::max(high, disk.z);
  }
  const double thickness = std::max(usual_thickness, (high - low) / (most_layers - 1));
  std::vector<double> layers(most_layers);
  for (const Disk& disk : disks) layers[static_cast<std::size_t>((disk.z - low) / thickness)] += 1;
  double squares = 0;
  for (const double in_layer : layers) squares += in_layer * in_layer;
  return squares / (static_cast<double>(disks.size()) * width * thickness);
}

// The largest shell: where it is as dense as round the disks, it has so many neighbours on the average that few have
// more than eight. In a gas the number of neighbours varies most. Many a bed is denser than that for a part of its
// period.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::bound_shells(double density, double height, double top) {
  const double neighbours = Space::falls ? 7.5 : std::min(8.3, 5.1 + 4.6 * std::numbers::pi / 4 * density);
  largest_skin_ = std::clamp(0.5 * (std::sqrt(neighbours / (std::numbers::pi * density)) - 1), 0.25, 1.5);
  // Two disks that stay in their shells must not come near a second image of each other.
  if constexpr (Space::wraps_x) {
    if (period_x_.length > 0) largest_skin_ = std::min(largest_skin_, (period_x_.length / 2 - largest_contact_) / 4);
  }
  if constexpr (Space::wraps_z) largest_skin_ = std::min(largest_skin_, (period_z_.length / 2 - largest_contact_) / 4);
  largest_skin_ = std::floor(largest_skin_ / skin_unit) * skin_unit;  // as records hold it
  // Distances of shells' centres are taken in single precision.
  const double extent = std::max(width_, std::max(height, top));
  shell_slack_ = static_cast<float>(shell_slack + 1e-6 * (extent + 8));
}

// How far ahead of its disk a shell is centred: a mean free path of hard disks, where that is a good part of the shell.
// So a disk that is not hit crosses almost the whole shell. A disk that is hit many times on its way stays longest in a
// shell round the place where it is. So it is in tiles, where a disk may have to go back.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::choose_ahead(double density) {
  constexpr double least = 0.25, most = 0.75;  // of the shell's radius
  ahead_ = 0;
  if (Space::falls || !tiles_.empty()) return;
  const double packing = std::min(std::numbers::pi / 4 * density, 0.9);
  const double at_contact = (1 - 7 * packing / 16) / ((1 - packing) * (1 - packing));  // pair correlation (Henderson)
  const double free_path = 1 / (2 * std::numbers::sqrt2 * density * at_contact);
  if (free_path > least * largest_skin_) ahead_ = std::min(free_path, most * largest_skin_);
}

// From positions, velocities, spins and clocks at now_ = 0 alone.
template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::begin_interval() {
  renumber();
  synchronise_at_ = static_cast<double>(intervals_) * interval_;
  checked_at_ = -1;
  crawls_ = 0;
  events_to_check_ = events_between_checks();
  asked_at_ = now_;
  contacts_when_asked_ = counters_.collisions();
  floor_contacts_when_asked_ = counters_.floor_collisions;
  counted_since_ = now_;
  contacts_when_counted_ = counters_.collisions();
  events_to_ask_ = presses_ ? events_between_presses * count_ : seldom;
  if constexpr (!Sizes::equal) largest_contact_ = 2 * *std::max_element(sizes_.radii.begin(), sizes_.radii.end() - 1);
  double top = 0;
  for (std::uint32_t i = 0; i < count_; ++i) top = std::max(top, disks_[i].z);
  const double height = Space::wraps_z ? period_z_.length : std::min(top, 4.0 * count_ / width_) + 2;
  const double density = Space::wraps_z ? count_ / (width_ * height) : density_round({disks_.data(), count_}, width_);
  bound_shells(density, height, top);
  lists_.reset(disks_.data(), count_);
  if constexpr (Space::is_cell) draw_lid_bound();
  choose_tiles();
  choose_ahead(density);
  file_shells(height);
  const auto look = [this](std::uint32_t i) {
    std::visit([&](auto& grid) { this->look_round<true>(grid, i); }, grid_);
  };
  for (std::uint32_t i = 0; i < count_; ++i) {
    look(i);
    choose_skin(i);
    std::visit([&](auto& grid) { grid.set_reach(i, reach(i)); }, grid_);
  }
  for (std::uint32_t i = 0; i < count_; ++i) {
    mark_near_bounds(i);
    look(i);
    lists_.list(i, find_neighbours(i));
  }
  predict_all();
}

// ------------------------------------------------------------------------------------------------
// checkpoints

// Calls visit(value) for everything that the future depends on besides the
// disks, in a fixed order.
template <class Space, class Rule, class Sizes>
template <class Self, class Visit>
void Engine<Space, Rule, Sizes>::visit_state(Self& self, Visit visit) {
  visit(self.intervals_);
  visit(self.intervals_done_);
  visit(self.event_rate_);
  visit(self.events_at_synchronisation_);
  visit(self.bath_at_);
  visit(self.counters_);
  visit(self.initial_energy_);
  visit(self.dissipated_);
  visit(self.floor_work_);
  visit(self.bath_work_);
  if (self.lid_.is_free()) {
    visit(self.lid_.z);
    visit(self.lid_.vz);
  }
  if (!self.rubs_.empty()) {
    visit(self.rub_at_);
    visit(self.rubbed_);
    for (auto& rub : self.rubs_) visit(rub);
    for (auto& rub : self.spin_rubs_) visit(rub);
  }
  if constexpr (!Sizes::equal) {
    for (std::uint32_t i = 0; i < self.count_; ++i) {
      visit(self.sizes_.radii[i]);
      visit(self.sizes_.masses[i]);
    }
  }
  for (std::uint32_t i = 0; i < self.count_; ++i) {
    visit(self.labels_[i]);
    visit(self.disks_[i].x);
    visit(self.disks_[i].z);
    visit(self.disks_[i].vx);
    visit(self.disks_[i].vz);
  }
  for (auto& spin : self.spins_) visit(spin);
  for (auto& clock : self.last_contact_) visit(clock);
  for (auto& time : self.withheld_at_) visit(time);
  if constexpr (rests_apply) {
    for (auto& height : self.rest_height_) visit(height);
    visit(self.resting_);
    visit(self.woken_);
    visit(self.rest_at_);
    visit(self.look_at_);
    visit(self.contacts_at_look_);
    visit(self.is_pressed_);
    visit(self.is_asleep_);
    visit(self.press_contact_time_);
    visit(self.released_at_);
    visit(self.step_error_);
  }
  if constexpr (press_applies && Rule::spins) {
    visit(self.chatters_);
    std::uint64_t stretches = self.stretches_.size();
    visit(stretches);
    if constexpr (!std::is_const_v<Self>) self.stretches_.resize(std::min<std::uint64_t>(stretches, 16 * self.count_));
    for (auto& stretch : self.stretches_) visit(stretch);
  }
}

template <class Space, class Rule, class Sizes>
std::vector<std::uint8_t> Engine<Space, Rule, Sizes>::checkpoint() const {
  if (now_ != 0) throw std::logic_error("a checkpoint can be taken only at a synchronisation");
  std::vector<std::uint8_t> out;
  checkpoint_bytes::put(out, checkpoint_bytes::magic);
  checkpoint_bytes::put(out, count_);
  visit_state(*this, [&](const auto& value) { checkpoint_bytes::put(out, value); });
  checkpoint_bytes::put(out, random_.state());
  checkpoint_bytes::put(out, checkpoint_bytes::checksum(out.data(), out.data() + out.size()));
  return out;
}

template <class Space, class Rule, class Sizes>
void Engine<Space, Rule, Sizes>::restore(const std::vector<std::uint8_t>& bytes) {
  const std::uint8_t *at = bytes.data(), *end = at + bytes.size();
  std::uint64_t magic = 0;
  std::uint32_t count = 0;
  checkpoint_bytes::take(at, end, magic);
  checkpoint_bytes::take(at, end, count);
  if (magic != checkpoint_bytes::magic) throw std::invalid_argument("these bytes are not a checkpoint");
  std::uint64_t written = 0;
  end -= std::min<std::ptrdiff_t>(end - at, sizeof written);
  std::memcpy(&written, end, static_cast<std::size_t>(bytes.data() + bytes.size() - end));
  if (written != checkpoint_bytes::checksum(bytes.data(), end))
    throw std::invalid_argument("the checkpoint is damaged: its checksum does not match its content");
  if (count != count_)
    throw std::invalid_argument("the checkpoint belongs to another scene: it has " + std::to_string(count) +
                                " disks, this scene has " + std::to_string(count_));
  visit_state(*this, [&](auto& value) { checkpoint_bytes::take(at, end, value); });
  std::array<std::uint64_t, 4> random_state{};
  checkpoint_bytes::take(at, end, random_state);
  if (at != end)
    throw std::invalid_argument("the checkpoint belongs to another scene: it contains more data than this scene needs");
  const auto missing = [this](std::uint32_t label) { return label >= count_; };
  const auto hangs_on_nothing = [&](const PressedBed::Stretch& one) {
    return missing(one.disk) || one.other >= count_ + PressedBed::walls;
  };
  if (std::any_of(labels_.begin(), labels_.end(), missing) ||
      std::any_of(stretches_.begin(), stretches_.end(), hangs_on_nothing))
    throw std::invalid_argument("the checkpoint is damaged: it refers to disks that do not exist");
  random_.set_state(random_state);
  unusual_ = disk_surface_.varies() || resting_ > 0;
  for (std::uint32_t i = 0; i < count_; ++i) disks_[i].own_time = 0;
  lid_.own_time = 0;
  base_ = static_cast<double>(intervals_done_) * interval_;
  now_ = 0;
  const bool was_pressed = std::exchange(is_pressed_, false);
  pressed_in_interval_ = false;
  begin_interval();
  if constexpr (press_applies) {
    if (was_pressed) go_on_pressed();
  }
}

}  // namespace shakebed::sim
