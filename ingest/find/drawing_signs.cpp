#include "ingest/find/drawing_signs.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace shakebed::ingest {

namespace {

constexpr float faint_step = 4;                            // grey levels: up to it noise, beyond it an edge
constexpr std::uint32_t shortest_run = 12;                 // px of one level on both sides of an edge
constexpr float darkest_level = 3, brightest_level = 252;  // grey levels: beyond, a camera may be at its limits ...
constexpr double least_shaded = 0.005;                     // ... and so much of the picture must be between
constexpr double ruled_share = 0.25;                       // of the frame's width or height
constexpr std::size_t one_line = 12;                       // px: edges so near to one another are one line's

// Limits. 24 photographs of beads by 6 authors: flat up to 0.57, not one ruled line; screen copies of plots, figures
// and drawings: flat 0.43 to 0.96, with plots' axes and grids 3 to 40 lines.
constexpr double flat_of_plots = 0.4, flat_of_drawings = 0.6, faint_of_drawings = 0.15;
constexpr std::size_t fewest_lines = 3, lines_of_axes = 2;
// A box with floor, two walls and lid has 4: with more, circles are marks, however few words are beside them.
constexpr std::size_t lines_of_a_box = 4;
// A drawing of nothing but beads, walls and floor: their rims are this share of its edges or more.
constexpr double share_of_beads = 0.5;

// Counts lengths of edges between neighbouring rows (or columns) whose two sides keep their levels.
class RuledEdges {
 public:
  RuledEdges(std::size_t lines, std::size_t length) : run_(lines, 0), total_(lines, 0), length_(length) {}
  // Whether the edges go on, of one line a time ...
  void take(std::size_t line, bool goes_on) { take(goes_on, run_[line], total_[line]); }
  // ... or of all lines, one by one in `goes_on`: 1 or 0.
  void take(const std::vector<std::uint32_t>& goes_on) {
    std::uint32_t *run = run_.data(), *total = total_.data();
    for (std::size_t line = 0; line < run_.size(); ++line) take(goes_on[line], run[line], total[line]);
  }
  [[nodiscard]] std::size_t count() const {
    std::size_t lines = 0, last = 0;
    for (std::size_t line = 0; line < total_.size(); ++line) {
      if (static_cast<double>(total_[line]) < ruled_share * static_cast<double>(length_)) continue;
      if (lines == 0 || line - last >= one_line) ++lines;
      last = line;
    }
    return lines;
  }

 private:
  static void take(std::uint32_t goes_on, std::uint32_t& run, std::uint32_t& total) {
    run = (run + 1) * goes_on;
    total += run == shortest_run ? shortest_run : run > shortest_run ? 1 : 0;
  }

  std::vector<std::uint32_t> run_, total_;
  std::size_t length_;
};

}  // namespace

bool DrawingSigns::looks_ruled() const {
  return (ruled_lines >= fewest_lines && flat_share >= flat_of_plots) ||
         (ruled_lines >= lines_of_axes && flat_share >= flat_of_drawings);
}

bool DrawingSigns::looks_drawn() const { return flat_share >= flat_of_drawings && faint_share < faint_of_drawings; }

DrawingSigns signs_of_drawing(const GrayFrame& frame) {
  DrawingSigns signs;
  if (frame.width < 3 || frame.height < 3) return signs;
  const auto width = static_cast<std::size_t>(frame.width), height = static_cast<std::size_t>(frame.height);
  RuledEdges rows(height - 1, width), columns(width - 1, height);
  std::size_t flat = 0, shaded_flat = 0, faint = 0;
  std::vector<float> lowest(width), highest(width);  // of three rows
  std::vector<std::uint32_t> goes_on(width - 1);
  for (std::size_t row = 1; row < height; ++row) {
    const float* above = frame.pixels.data() + (row - 1) * width;
    const float* here = above + width;
    const float* below = row + 1 < height ? here + width : here;
    std::uint32_t any = 0;  // edges between this row and the one above
    for (std::size_t k = 1; k < width; ++k) {
      const bool same_above = above[k] == above[k - 1], same_here = here[k] == here[k - 1];
      goes_on[k - 1] = same_above & same_here & (std::abs(here[k] - above[k]) >= faint_step);
      any |= goes_on[k - 1];
    }
    for (std::size_t k = 0; any != 0 && k < goes_on.size(); ++k) rows.take(row - 1, goes_on[k] != 0);
    for (std::size_t k = 1; k < width; ++k)
      goes_on[k - 1] =
          (above[k] == here[k]) & (above[k - 1] == here[k - 1]) & (std::abs(here[k] - here[k - 1]) >= faint_step);
    columns.take(goes_on);
    if (row + 1 == height) break;
    for (std::size_t k = 0; k < width; ++k) {
      lowest[k] = std::min(std::min(above[k], here[k]), below[k]);
      highest[k] = std::max(std::max(above[k], here[k]), below[k]);
    }
    std::uint32_t flat_here = 0, shaded_here = 0, faint_here = 0;
    for (std::size_t k = 1; k + 1 < width; ++k) {
      const float low = std::min(std::min(lowest[k - 1], lowest[k]), lowest[k + 1]);
      const float high = std::max(std::max(highest[k - 1], highest[k]), highest[k + 1]);
      const bool shaded = (here[k] >= darkest_level) & (here[k] <= brightest_level);
      flat_here += high == low;
      shaded_here += shaded & (high == low);
      faint_here += shaded & (high > low) & (high - low <= faint_step);
    }
    flat += flat_here, shaded_flat += shaded_here, faint += faint_here;
  }
  const auto inner = static_cast<double>((width - 2) * (height - 2));
  signs.flat_share = static_cast<double>(flat) / inner;
  const auto even = static_cast<double>(shaded_flat + faint);
  if (even > least_shaded * inner) signs.faint_share = static_cast<double>(faint) / even;
  signs.ruled_lines = rows.count() + columns.count();
  return signs;
}

const char* why_drawn(const DrawingSigns& signs, double explained_share) {
  if (signs.looks_ruled() && (signs.ruled_lines > lines_of_a_box || explained_share < share_of_beads))
    return "straight ruled lines and areas of one grey level are seen, as in a plot or a page";
  if (signs.looks_drawn() && explained_share < share_of_beads)
    return "areas of one grey level without noise are seen, as in a drawing, and the circles are only a small part of "
           "it";
  return nullptr;
}

}  // namespace shakebed::ingest
