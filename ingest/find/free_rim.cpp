// implements: ingest/find/bead_profile.hpp
// The profile averaged over the parts of rims that face open background.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "ingest/find/bead_profile.hpp"
#include "ingest/find/nearby.hpp"

namespace shakebed::ingest {

namespace {

constexpr double spacing_px = 0.2;  // of the profile

// Parts of the way from a bead's middle outwards.
struct FreeRimZones {
  FreeRimZones(double radius, double edge)
      : inner(std::max(0.0, radius - std::max(5 * edge, 0.35 * radius))),
        open_from(radius + 2.5 * edge + 0.7),
        open_to(radius + 5.5 * edge + 2),
        core_to(inner + std::max(1.0, 0.12 * radius)) {}
  double inner, open_from, open_to, core_to;  // px
};

struct FreeRimSample {
  double r;
  float level;
};
using Sectors = std::array<bool, sectors_of_bead>;

// The sectors of a bead towards which no other lies.
Sectors open_sectors(const std::vector<ModelDisk>& beads, std::size_t i, const Nearby& near, double reach) {
  Sectors open;
  open.fill(true);
  const ModelDisk& bead = beads[i];
  near.any_near(bead.x, bead.y, [&](std::size_t j) {
    if (j == i) return false;
    const double dx = beads[j].x - bead.x, dy = beads[j].y - bead.y;
    const double distance = std::sqrt(dx * dx + dy * dy);
    const double half = std::asin(std::min(1.0, reach / distance)) + 2 * std::numbers::pi / sectors_of_bead / 2;
    const double direction = std::atan2(dy, dx);
    for (int s = 0; s < sectors_of_bead; ++s) {
      const double middle = (s + 0.5) * 2 * std::numbers::pi / sectors_of_bead - std::numbers::pi;
      if (std::abs(std::remainder(direction - middle, 2 * std::numbers::pi)) < half)
        open[static_cast<std::size_t>(s)] = false;
    }
    return false;
  });
  return open;
}

std::array<std::vector<FreeRimSample>, sectors_of_bead> samples_around(const GrayFrame& flat, const ModelDisk& bead,
                                                                       const Sectors& open, const FreeRimZones& zones) {
  std::array<std::vector<FreeRimSample>, sectors_of_bead> samples;
  const int top = static_cast<int>(std::ceil(bead.y - zones.open_to)),
            bottom = static_cast<int>(std::floor(bead.y + zones.open_to));
  const int left = static_cast<int>(std::ceil(bead.x - zones.open_to)),
            right = static_cast<int>(std::floor(bead.x + zones.open_to));
  for (int row = top; row <= bottom; ++row)
    for (int column = left; column <= right; ++column) {
      const double dx = column - bead.x, dy = row - bead.y;
      const double r = std::sqrt(dx * dx + dy * dy);
      if (r < zones.inner || r > zones.open_to) continue;
      const int s = std::clamp(static_cast<int>((std::atan2(dy, dx) / (2 * std::numbers::pi) + 0.5) * sectors_of_bead),
                               0, sectors_of_bead - 1);
      if (open[static_cast<std::size_t>(s)]) samples[static_cast<std::size_t>(s)].push_back({r, flat.at(column, row)});
    }
  return samples;
}

// Sums of levels by distance, shared between the two nearest steps.
class FreeRimSums {
 public:
  explicit FreeRimSums(const FreeRimZones& zones)
      : zones_(zones),
        sums_(static_cast<std::size_t>(std::ceil(zones.open_to / spacing_px)) + 1, 0.0),
        weights_(sums_.size(), 0.0) {}

  // A sector counts when its outside is even background and its inside a bead. Whether it did.
  bool add(const std::vector<FreeRimSample>& sector) {
    double outside = 0, inside = 0, outside_count = 0, inside_count = 0, square = 0;
    for (const FreeRimSample& sample : sector) {
      const double level = static_cast<double>(sample.level);
      if (sample.r > zones_.open_from) {
        outside += level;
        square += level * level;
        ++outside_count;
      } else if (sample.r < zones_.core_to) {
        inside += level;
        ++inside_count;
      }
    }
    if (outside_count < 4 || inside_count < 2) return false;
    outside /= outside_count;
    inside /= inside_count;
    const double scatter = std::sqrt(std::max(0.0, square / outside_count - outside * outside));
    if (std::abs(outside) > 0.2 || scatter > 0.2 || inside - outside < 0.4 || inside > 10) return false;
    for (const FreeRimSample& sample : sector) {
      const double level = static_cast<double>(sample.level) - outside;
      const double place = sample.r / spacing_px;
      const auto bin = static_cast<std::size_t>(place);
      const double part = place - static_cast<double>(bin);
      if (bin + 1 >= sums_.size()) continue;
      sums_[bin] += (1 - part) * level;
      weights_[bin] += 1 - part;
      sums_[bin + 1] += part * level;
      weights_[bin + 1] += part;
    }
    return true;
  }

  [[nodiscard]] BeadProfile profile() const {
    BeadProfile profile;
    profile.step_px = spacing_px;
    profile.level.assign(sums_.size(), 0.0F);
    profile.fourth_harmonic.assign(sums_.size(), 0.0F);
    float first = 1;
    bool seen = false;
    for (std::size_t k = 0; k < sums_.size(); ++k)
      if (weights_[k] > 0) {
        profile.level[k] = static_cast<float>(sums_[k] / weights_[k]);
        if (!seen) first = profile.level[k];
        seen = true;
      }
    for (std::size_t k = 0; k < sums_.size() && weights_[k] <= 0; ++k) profile.level[k] = first;
    return profile;
  }

 private:
  const FreeRimZones zones_;
  std::vector<double> sums_, weights_;
};

}  // namespace

FreeRim learn_free_rim(const std::vector<GrayFrame>& flats, const std::vector<const std::vector<ModelDisk>*>& disks,
                       double radius_px, double edge_px) {
  const FreeRimZones zones(radius_px, edge_px);
  FreeRimSums sums(zones);
  FreeRim rim;
  rim.inner_px = zones.inner;
  const double open_to = zones.open_to, reach = radius_px + 3 * edge_px + 1;
  for (std::size_t f = 0; f < flats.size(); ++f) {
    const GrayFrame& flat = flats[f];
    std::vector<ModelDisk> beads = *disks[f];
    std::sort(beads.begin(), beads.end(), [](const ModelDisk& a, const ModelDisk& b) { return a.y < b.y; });
    const double far = open_to + radius_px + 3 * edge_px;
    const Nearby near(beads.size(), far, [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
    for (std::size_t i = 0; i < beads.size(); ++i) {
      const ModelDisk& bead = beads[i];
      if (bead.x < open_to || bead.y < open_to || bead.x > flat.width - 1 - open_to ||
          bead.y > flat.height - 1 - open_to)
        continue;
      const Sectors open = open_sectors(beads, i, near, reach);
      if (std::none_of(open.begin(), open.end(), [](bool free) { return free; })) continue;
      for (const auto& sector : samples_around(flat, bead, open, zones)) rim.sectors += sums.add(sector);
    }
  }
  rim.profile = sums.profile();
  return rim;
}

}  // namespace shakebed::ingest
