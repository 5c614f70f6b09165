#include "ingest/find/drawing_signs.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shakebed::ingest {

namespace {

constexpr float faint_step = 4;                            // grey levels: up to it noise, beyond it an edge
constexpr std::size_t shortest_run = 12;                   // px of one level on both sides of an edge
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
  void take(std::size_t line, bool goes_on) {
    if (!goes_on) {
      run_[line] = 0;
      return;
    }
    ++run_[line];
    if (run_[line] == shortest_run)
      total_[line] += shortest_run;
    else if (run_[line] > shortest_run)
      ++total_[line];
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
  std::vector<std::size_t> run_, total_;
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
  for (std::size_t row = 1; row < height; ++row) {
    const float* above = frame.pixels.data() + (row - 1) * width;
    const float* here = above + width;
    const float* below = row + 1 < height ? here + width : here;
    for (std::size_t k = 0; k < width; ++k) {
      lowest[k] = std::min(std::min(above[k], here[k]), below[k]);
      highest[k] = std::max(std::max(above[k], here[k]), below[k]);
    }
    for (std::size_t k = 1; k < width; ++k) {
      const bool same_above = above[k] == above[k - 1], same_here = here[k] == here[k - 1];
      rows.take(row - 1, same_above && same_here && std::abs(here[k] - above[k]) >= faint_step);
      columns.take(k - 1,
                   above[k] == here[k] && above[k - 1] == here[k - 1] && std::abs(here[k] - here[k - 1]) >= faint_step);
      if (row + 1 == height || k + 1 == width) continue;
      const float low = std::min(std::min(lowest[k - 1], lowest[k]), lowest[k + 1]);
      const float high = std::max(std::max(highest[k - 1], highest[k]), highest[k + 1]);
      flat += high == low;
      if (here[k] < darkest_level || here[k] > brightest_level) continue;
      shaded_flat += high == low;
      faint += high > low && high - low <= faint_step;
    }
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
