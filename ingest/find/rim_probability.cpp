#include "ingest/find/rim_probability.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::ingest {

namespace {

constexpr std::size_t support_steps = 20;  // of the table of probabilities
// Before any is seen: circles that chance makes up in a class of support, fewer the better the support.
constexpr double prior_at_full = 0.05, prior_per_missing = 0.4;
// Classes of support in which the picture has no circle: so many below one that has count for it. What chance makes up
// of much poorer rims says nothing of it: ovals of large beads pass as half of a small circle.
constexpr std::size_t near_classes = 4;
// Share of their rims from which circles are seen whole. Clutter that leaves gaps does not close them.
constexpr double seen_whole = 0.9;
// Where a class has n whole circles in the picture and none in c copies, chance makes up less than 3/c of the n (at
// 95 %, by Poisson's law). This share is small where n c is 80 or more, whatever the classes below hold.
constexpr double many_whole = 80, share_of_few = 0.05;

// Circles of one class of support, in the frame and (the mean) in its copies.
struct SupportClass {
  double here = 0, chance = 0, support_sum = 0;
  std::size_t classes = 1;   // that were put together
  bool joined_near = false;  // the classes just below it that have no circle
  [[nodiscard]] bool whole() const { return here > 0 && support_sum >= seen_whole * here; }
  [[nodiscard]] bool many(std::size_t copies) const {
    return whole() && here * static_cast<double>(copies) >= many_whole && chance <= share_of_few * here;
  }
  [[nodiscard]] double doubt() const { return here > 0 ? chance / here : chance > 0 ? HUGE_VAL : 0; }
};

std::size_t class_of(double support) {
  return std::min(support_steps, static_cast<std::size_t>(std::lround(support * support_steps)));
}

// Of classes without a circle only those just below `above`, which begins at `end`.
void join_near(const std::vector<SupportClass>& classes, std::size_t end, SupportClass& below, SupportClass& above) {
  for (std::size_t near = end - near_classes; near < end; ++near) above.chance += classes[near].chance;
  above.classes += near_classes;
  below.classes -= near_classes;
  above.joined_near = true;
}

}  // namespace

std::vector<double> probabilities_by_support(const std::vector<Circle>& seen,
                                             const std::vector<std::vector<Circle>>& copies, Known known) {
  std::vector<SupportClass> classes(support_steps + 1);
  for (const Circle& circle : seen) {
    SupportClass& its = classes[class_of(circle.support)];
    ++its.here;
    its.support_sum += circle.support;
  }
  for (const auto& copy : copies)
    for (const Circle& circle : copy)
      classes[class_of(circle.support)].chance += 1 / static_cast<double>(copies.size());
  std::vector<SupportClass> pooled;
  for (std::size_t k = 0; k < classes.size(); ++k) {
    pooled.push_back(classes[k]);
    while (pooled.size() > 1) {
      SupportClass& below = pooled[pooled.size() - 2];
      SupportClass& above = pooled.back();
      const bool below_says_something = below.here > 0 || (known == Known::beads && below.chance > 0);
      if (below_says_something && above.here > 0 && below.doubt() >= above.doubt()) break;
      if ((known == Known::radius || (known == Known::wide && above.whole()) ||
           (known == Known::fairly_wide && above.many(copies.size()))) &&
          below.here == 0 && below.chance > 0 && above.here > 0 && below.classes > near_classes) {
        if (!above.joined_near) join_near(classes, k + 1 - above.classes, below, above);
        break;
      }
      below = {below.here + above.here, below.chance + above.chance, below.support_sum + above.support_sum,
               below.classes + above.classes, below.joined_near || above.joined_near};
      pooled.pop_back();
    }
  }
  std::vector<double> probability;
  for (const SupportClass& pool : pooled) {
    const double missing = pool.here > 0 ? 1 - pool.support_sum / pool.here : 1;
    const double chance = pool.chance + prior_at_full + prior_per_missing * missing;
    const double sure = pool.here > 0 ? std::max(0.0, 1 - chance / pool.here) : 0;
    const double before = probability.empty() ? 0 : probability.back();
    probability.insert(probability.end(), pool.classes, std::max(before, sure));
  }
  return probability;
}

double share_by_chance_at_worst(double wrong, double count) {
  return (wrong + std::sqrt(std::max(0.0, wrong))) / std::max(1.0, count);
}

double probability_at(const std::vector<double>& by_support, double support) {
  if (by_support.empty()) return 0;
  const double place = std::clamp(support, 0.0, 1.0) * static_cast<double>(by_support.size() - 1);
  const auto cell = std::min(by_support.size() - 2, static_cast<std::size_t>(place));
  const double part = place - static_cast<double>(cell);
  return (1 - part) * by_support[cell] + part * by_support[cell + 1];
}

}  // namespace shakebed::ingest
