#include "ingest/find/bead_set.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bed_light.hpp"
#include "ingest/find/candidates.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// Of the typical distance of nearest neighbours, where these do not overlap: two disks so near are not two beads.
constexpr double much_nearer = 0.75;

bool from_top(const ModelDisk& one, const ModelDisk& other) {
  if (one.y != other.y) return one.y < other.y;
  return one.x < other.x;
}

// Beads that leave much more unexplained than the others; those cut by the border are not judged.
std::vector<ModelDisk> take_out_suspects(JointFit& fit, std::vector<ModelDisk>& disks, double radius) {
  std::vector<double> unexplained;
  for (const ModelDisk& disk : disks) unexplained.push_back(1 - disk.explained);
  constexpr double suspicious_share = 1.5, always_tolerated = 0.03;
  const double limit = std::max(always_tolerated, suspicious_share * median_of(unexplained));
  std::vector<ModelDisk> suspects;
  std::erase_if(disks, [&](const ModelDisk& disk) {
    const bool cut =
        disk.x < radius || disk.y < radius || disk.x > fit.width() - 1 - radius || disk.y > fit.height() - 1 - radius;
    if (1 - disk.explained <= limit || cut) return false;
    suspects.push_back(disk);
    fit.subtract(disk.x, disk.y, -1.0F);
    return true;
  });
  return suspects;
}

// Beads that show in the residual and are not among those kept. One near a suspect is that suspect, moved.
std::vector<ModelDisk> seen_in_residual(const std::vector<DiskCandidate>& candidates,
                                        const std::vector<ModelDisk>& kept, const std::vector<ModelDisk>& suspects,
                                        double near) {
  std::vector<ModelDisk> fresh = disks_at(candidates), added;
  const Nearby near_kept = nearby(kept, near), near_suspects = nearby(suspects, near);
  for (ModelDisk& disk : fresh) {
    if (near_kept.any_near(disk.x, disk.y)) continue;
    double nearest = near;
    near_suspects.any_near(disk.x, disk.y, [&](std::size_t i) {
      const ModelDisk& suspect = suspects[i];
      const double distance = std::hypot(suspect.x - disk.x, suspect.y - disk.y);
      if (distance >= nearest) return false;
      nearest = distance;
      disk.former_x = suspect.x;
      disk.former_y = suspect.y;
      disk.former_unexplained = 1 - suspect.explained;
      return false;
    });
    added.push_back(disk);
  }
  return added;
}

// Suspects in whose place nothing better shows.
void put_back(const std::vector<ModelDisk>& suspects, double near, std::vector<ModelDisk>& added) {
  const Nearby near_fresh = nearby(added, near), near_suspects = nearby(suspects, near);
  std::vector<std::uint8_t> back(suspects.size(), 0);
  for (std::size_t i = 0; i < suspects.size(); ++i) {
    const ModelDisk& disk = suspects[i];
    back[i] = !near_fresh.any_near(disk.x, disk.y) &&
              !near_suspects.any_near(disk.x, disk.y, [&](std::size_t other) { return other < i && back[other]; });
    if (back[i]) added.push_back(disk);
  }
}

}  // namespace

std::vector<ModelDisk> disks_at(const std::vector<DiskCandidate>& candidates) {
  std::vector<ModelDisk> disks;
  disks.reserve(candidates.size());
  for (const DiskCandidate& candidate : candidates) {
    ModelDisk disk;
    disk.x = candidate.x;
    disk.y = candidate.y;
    disks.push_back(disk);
  }
  std::sort(disks.begin(), disks.end(), from_top);
  return disks;
}

Nearby nearby(const std::vector<ModelDisk>& disks, double distance) {
  return {disks.size(), distance, [&](std::size_t i) { return std::pair(disks[i].x, disks[i].y); }};
}

void wake(const Nearby& near, std::vector<ModelDisk>& disks, const ModelDisk& changed) {
  near.any_near(changed.x, changed.y, [&](std::size_t i) {
    disks[i].last_step = ModelDisk().last_step;
    return false;
  });
}

std::size_t prune(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double least) {
  std::vector<std::uint8_t> drop(disks.size(), 0);
  for (std::size_t i = 0; i < disks.size(); ++i) drop[i] = disks[i].explained < least;
  nearby(disks, 2 * radius * least_separation).pairs([&](std::size_t one, std::size_t other) {
    if (drop[one]) return true;
    if (drop[other]) return false;
    const bool first_worse = disks[one].explained < disks[other].explained;
    drop[first_worse ? one : other] = 1;
    return first_worse;
  });
  std::vector<ModelDisk> kept;
  kept.reserve(disks.size());
  for (std::size_t i = 0; i < disks.size(); ++i) {
    if (drop[i])
      fit.subtract(disks[i].x, disks[i].y, -1.0F);
    else
      kept.push_back(disks[i]);
  }
  const std::size_t dropped = disks.size() - kept.size();
  if (dropped > 0) {
    const Nearby near = nearby(kept, 2 * fit.reach());
    for (std::size_t i = 0; i < disks.size(); ++i)
      if (drop[i]) wake(near, kept, disks[i]);
  }
  disks = std::move(kept);
  return dropped;
}

std::size_t repair(JointFit& fit, std::vector<ModelDisk>& disks, double radius, double noise) {
  const std::vector<ModelDisk> suspects = take_out_suspects(fit, disks, radius);
  // A bead that was missed darkens the residual over its whole area: without such pixels there is nothing to search.
  constexpr double clear_score = 0.5;
  const double bead_area = 3.14159265358979 * radius * radius;
  if (suspects.empty() && !(fit.strong_pixels(0.5F) > 0.4 * bead_area)) return 0;
  const double near = 2 * radius * least_separation;
  std::vector<ModelDisk> added =
      seen_in_residual(candidates_in(fit.residual_image(), radius, noise, clear_score), disks, suspects, near);
  put_back(suspects, near, added);
  for (ModelDisk& disk : added) {
    disk.quiet_sweeps = 0;
    fit.subtract(disk.x, disk.y, 1.0F);
  }
  const Nearby all_kept = nearby(disks, 2 * fit.reach());
  for (const auto* changed_ones : {&std::as_const(added), &suspects})
    for (const ModelDisk& disk : *changed_ones) wake(all_kept, disks, disk);
  const std::size_t changed = std::max(suspects.size(), added.size());
  if (changed)
    for (ModelDisk& disk : disks) disk.quiet_sweeps = 0;
  disks.insert(disks.end(), added.begin(), added.end());
  std::sort(disks.begin(), disks.end(), from_top);
  return changed;
}

std::vector<DoubledDisks> doubled_disks(std::vector<ModelDisk>& disks, double radius) {
  const double far = 4 * radius;
  std::vector<double> nearest(disks.size(), far);
  std::vector<std::size_t> which(disks.size(), 0);
  nearby(disks, far).pairs([&](std::size_t a, std::size_t b) {
    const double away = std::hypot(disks[a].x - disks[b].x, disks[a].y - disks[b].y);
    if (away < nearest[a]) nearest[a] = away, which[a] = b;
    if (away < nearest[b]) nearest[b] = away, which[b] = a;
    return false;
  });
  std::vector<DoubledDisks> doubled;
  const double typical = median_of(nearest);
  if (typical < 2 * radius) return doubled;
  std::vector<std::uint8_t> out(disks.size(), 0);
  for (std::size_t a = 0; a < disks.size(); ++a) {
    const std::size_t b = which[a];
    if (nearest[a] > much_nearer * typical || which[b] != a || b < a) continue;
    const ModelDisk &one = disks[a], &other = disks[b];
    const double share = one.amplitude / std::max(1e-6, one.amplitude + other.amplitude);
    ModelDisk merged;
    merged.x = share * one.x + (1 - share) * other.x;
    merged.y = share * one.y + (1 - share) * other.y;
    doubled.push_back({one, other, merged});
    out[a] = out[b] = 1;
  }
  std::size_t at = 0;
  std::erase_if(disks, [&](const ModelDisk&) { return out[at++] != 0; });
  return doubled;
}

bool settle(JointFit& fit, std::vector<ModelDisk>& disks, double radius) {
  constexpr double must_fall_to = 0.7;
  const auto moved = [](const ModelDisk& disk) { return disk.former_unexplained >= 0; };
  if (std::none_of(disks.begin(), disks.end(), moved)) return false;
  fit.judge(disks, radius + 1);
  bool went_back = false;
  for (ModelDisk& disk : disks) {
    if (disk.former_unexplained >= 0 && 1 - disk.explained > must_fall_to * disk.former_unexplained) {
      fit.subtract(disk.x, disk.y, -1.0F);
      disk.x = disk.former_x;
      disk.y = disk.former_y;
      disk.quiet_sweeps = 0;
      disk.last_step = ModelDisk().last_step;
      fit.subtract(disk.x, disk.y, 1.0F);
      went_back = true;
    }
    disk.former_unexplained = -1;
  }
  if (went_back) fit.judge(disks, radius + 1);
  return went_back;
}

double unexplained_around(const JointFit& fit, const ModelDisk& disk, double radius, double edge, double noise) {
  const double from = radius + edge + 0.5, to = std::max(from + 1.5, 1.35 * radius);
  const float strong = static_cast<float>(std::max(0.3, 3 * noise));
  std::size_t count = 0, left = 0;
  for (int row = std::max(0, static_cast<int>(std::ceil(disk.y - to)));
       row <= std::min(fit.height() - 1, static_cast<int>(std::floor(disk.y + to))); ++row)
    for (int column = std::max(0, static_cast<int>(std::ceil(disk.x - to)));
         column <= std::min(fit.width() - 1, static_cast<int>(std::floor(disk.x + to))); ++column) {
      const double distance = std::hypot(column - disk.x, row - disk.y);
      if (distance < from || distance > to || unseen(fit.residual(column, row))) continue;
      ++count;
      left += fit.residual(column, row) > strong;
    }
  return count ? static_cast<double>(left) / static_cast<double>(count) : 0;
}

bool step_all(JointFit& fit, const GrayFrame& flat, std::vector<ModelDisk>& disks, const StepRules& rules) {
  constexpr double quadratic = 10;  // what a step together leaves is less than a tenth of it
  constexpr double longest_step = 0.5;
  const double still = quadratic * rules.tolerance;
  if (fit.step_together(flat, disks, longest_step, rules.bound, still) < still) return true;
  std::vector<std::size_t> far;
  for (std::size_t i = 0; i < disks.size(); ++i) {
    disks[i].quiet_sweeps = 2;
    if (disks[i].last_step >= longest_step) far.push_back(i);
  }
  const bool few = 50 * far.size() <= disks.size() && !far.empty();
  if (few) {
    const Nearby near = nearby(disks, 2 * fit.reach());
    for (const std::size_t i : far)
      near.any_near(disks[i].x, disks[i].y, [&](std::size_t other) {
        disks[other].quiet_sweeps = 0;
        return false;
      });
  }
  for (int sweep = 0; few && sweep < rules.sweeps; ++sweep)
    if (fit.sweep(disks, longest_step, rules.tolerance, rules.bound) < rules.tolerance) break;
  return false;
}

}  // namespace shakebed::ingest
