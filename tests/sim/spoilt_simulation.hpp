#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "sim/engine/simulation.hpp"

namespace shakebed::sim {

// A sound run whose ledger and overlap are told otherwise.
class Spoilt : public Simulation {
 public:
  explicit Spoilt(std::unique_ptr<Simulation> sound) : sound_(std::move(sound)), ledger(sound_->energy()) {}

 private:
  std::unique_ptr<Simulation> sound_;

 public:
  EnergyLedger ledger;
  double overlap = 0;

  bool advance_towards(double time, std::uint64_t most_events) override {
    return sound_->advance_towards(time, most_events);
  }
  double time() const override { return sound_->time(); }
  void snapshot(Snapshot& out) const override { sound_->snapshot(out); }
  DiskProperties properties() const override { return sound_->properties(); }
  EnergyLedger energy() const override { return ledger; }
  Counters counters() const override { return sound_->counters(); }
  double largest_overlap() const override { return overlap; }
  bool foresees_contacts() const override { return sound_->foresees_contacts(); }
  std::size_t bytes() const override { return sound_->bytes(); }
  double next_synchronisation() const override { return sound_->next_synchronisation(); }
  std::vector<std::uint8_t> checkpoint() const override { return sound_->checkpoint(); }
  void restore(const std::vector<std::uint8_t>& bytes) override { sound_->restore(bytes); }
  void watch(Watcher* watcher) override { sound_->watch(watcher); }
  void set_bath_temperature(double temperature) override { sound_->set_bath_temperature(temperature); }
};

}  // namespace shakebed::sim
