#include "fit/profile_fit/window.hpp"

#include <algorithm>
#include <cmath>

namespace shakebed::fit {

namespace {

// Of the kernel's reach, this much is kept off the floor's layers: a wider kernel has blurred them away. [D]
constexpr double longest_reach = 3.0;
// A profile that still has this part of its greatest density one and a half diameters below its last bin ends in a
// cliff; the empty bins of one diameter above it are then used, too.
constexpr double cliff_density = 0.75, cliff_depth = 1.5, cliff_margin = 1.0;

class WindowRule {
 public:
  WindowRule(MeasuredProfile& measured, const FitOptions& options)
      : measured_(measured), mean_(measured.one_diameter_mean), options_(options.window) {
    excluded_ = options.base + options_.floor_exclusion + std::min(kernel_reach(options.kernel), longest_reach);
    find_peak();
  }

  Window operator()() {
    choose_low();
    choose_high();
    return window_;
  }

 private:
  // The greatest density above the floor's layers, or anywhere if nothing lies above them.
  void find_peak() {
    const std::size_t n = measured_.size();
    while (first_ < n && measured_.height[first_] < excluded_) ++first_;
    if (first_ == n) first_ = 0;
    peak_ = first_;
    for (std::size_t i = first_; i < n; ++i) {
      if (mean_[i] > mean_[peak_]) peak_ = i;
    }
    measured_.greatest_mean = mean_[peak_];
  }

  void choose_low() {
    if (options_.low) {
      window_.low = *options_.low;
      window_.rule = "from the given height " + number(window_.low, 4) + " D";
    } else if (options_.below_density) {
      std::size_t start = measured_.size() - 1;
      while (start > peak_ && mean_[start - 1] < *options_.below_density) --start;
      window_.low = measured_.height[start];
      window_.rule = "from " + number(window_.low, 4) +
                     " D, above which the density averaged over one diameter stays below " +
                     number(*options_.below_density);
    } else {
      std::size_t start = first_;
      while (start < peak_ && mean_[start] < options_.plateau_fraction * measured_.greatest_mean) ++start;
      window_.low = measured_.height[start];
      window_.rule = "from " + number(window_.low, 4) + " D, the lowest height above " + number(excluded_, 4) +
                     " D (without the floor layers and the reach of the kernel) where the density averaged over one "
                     "diameter reaches " +
                     number(100.0 * options_.plateau_fraction) + " % of its greatest value";
    }
  }

  void choose_high() {
    if (options_.high) {
      window_.high = *options_.high;
      window_.rule += ", up to the given height " + number(window_.high, 4) + " D";
      return;
    }
    std::size_t last = peak_;
    while (last + 1 < measured_.size()) {
      const double mean = mean_[last + 1];
      const bool above_noise =
          !measured_.errors_known || mean >= options_.lowest_significance * measured_.error[last + 1];
      if (mean < options_.lowest_fraction * measured_.greatest_mean || !above_noise) break;
      ++last;
    }
    window_.high = measured_.height[last];
    look_over_the_cliff(last);
    window_.rule += ", up to " + number(window_.high, 4) + " D, the last before the density falls below " +
                    number(100.0 * options_.lowest_fraction) + " % of its greatest value" +
                    (measured_.errors_known ? " or " + number(options_.lowest_significance) + " standard errors" : "");
  }

  void look_over_the_cliff(std::size_t last) {
    const std::size_t n = measured_.size();
    std::size_t beyond = last;
    while (beyond > 0 && measured_.height[last] - measured_.height[beyond] < cliff_depth) --beyond;
    if (last + 1 >= n || !(measured_.density[beyond] > cliff_density * measured_.greatest_mean)) return;
    // Means over a diameter reach half of one beyond the cliff.
    for (std::size_t empty = last; empty > beyond && measured_.density[empty] == 0.0; --empty)
      measured_.usable[empty] = true;
    while (last + 1 < n && measured_.height[last + 1] <= window_.high + cliff_margin) measured_.usable[++last] = true;
    if (last + 1 < n && measured_.height[last] == window_.high) measured_.usable[++last] = true;
    window_.high = measured_.height[last];
  }

  MeasuredProfile& measured_;
  const std::vector<double>& mean_;
  const WindowOptions& options_;
  double excluded_ = 0.0;  // nothing below this height [D]
  std::size_t first_ = 0;  // the first bin above it
  std::size_t peak_ = 0;   // where the mean density is greatest
  Window window_;
};

}  // namespace

Window choose_window(MeasuredProfile& measured, const FitOptions& options) { return WindowRule(measured, options)(); }

std::size_t count_bins(const MeasuredProfile& measured, const Window& window) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    if (measured.usable[i] && measured.height[i] >= window.low && measured.height[i] <= window.high) ++count;
  }
  return count;
}

}  // namespace shakebed::fit
