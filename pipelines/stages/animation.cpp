#include "pipelines/stages/animation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <vector>

#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/frame_profiles.hpp"

namespace shakebed::pipelines {

namespace {

// What a page can carry: 200,000 positions are 0.8 MB, 1.1 MB in base64.
// The player is pipelines/report/page/bed.js.
constexpr std::size_t most_disks = 5000, most_frames = 96, most_positions = 200'000;

std::string numbers(const std::vector<double>& values) {
  std::string out = "[";
  for (std::size_t i = 0; i < values.size(); ++i) out += fmt::format("{}{:.4g}", i == 0 ? "" : ",", values[i]);
  return out + "]";
}

// One frame without a script.
std::string still_picture(const TrajectoryFrame& frame, double low, double high) {
  std::string svg = fmt::format(
      "<svg viewBox=\"-0.6 {:.3f} {:.3f} {:.3f}\" style=\"max-height:70vh;width:100%\" role=\"img\" "
      "aria-label=\"the bed at one moment\">\n<g fill=\"var(--disk-a)\">\n",
      -high, frame.width + 1.2, high - low);
  for (std::size_t i = 0; i < frame.size(); ++i)
    svg += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\"/>", frame.x[i], -frame.z[i],
                       frame.radius.empty() ? 0.5 : frame.radius[i]);
  return svg + fmt::format(
                   "</g>\n<path d=\"M0 {:.3f}V{:.3f}H{:.3f}V{:.3f}\" fill=\"none\" stroke=\"currentColor\" "
                   "stroke-width=\"0.12\"/></svg>",
                   -high, -frame.floor_position, frame.width, -high);
}

// The first frames, as many as a page can carry, all with the same disks. None: too many disks in one.
std::vector<TrajectoryFrame> first_frames(const std::filesystem::path& trajectory) {
  std::vector<TrajectoryFrame> frames;
  TrajectoryReader reader(trajectory);
  TrajectoryFrame frame;
  std::size_t most = most_frames;
  while (frames.size() < most && reader.read(frame)) {
    if (frame.size() == 0 || frame.size() > most_disks) return {};
    most = std::clamp<std::size_t>(most_positions / frame.size(), 1, most_frames);
    if (!frames.empty() && frame.size() != frames.front().size()) break;
    frames.push_back(frame);
  }
  return frames;
}

// Frames so far apart that the floor's motion between them is not seen.
bool is_stroboscopic(const std::vector<TrajectoryFrame>& frames, double period) {
  return period > 0 && frames.size() > 1 && frames[1].time - frames[0].time > period / 8;
}

// By the floor's phase: cycle after cycle, each made of one frame of every phase.
std::vector<TrajectoryFrame> by_phase(const std::vector<TrajectoryFrame>& frames) {
  std::vector<std::size_t> order(frames.size()), times_seen(frames.size(), 0);
  std::iota(order.begin(), order.end(), 0u);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) times_seen[i] += frames[k].phase == frames[i].phase;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(times_seen[a], frames[a].phase) < std::pair(times_seen[b], frames[b].phase);
  });
  std::vector<TrajectoryFrame> sorted;
  for (const std::size_t i : order) sorted.push_back(frames[i]);
  return sorted;
}

// Heights that are drawn [D].
struct Extent {
  double low = 0, high = 1;
};
Extent extent_of(const std::vector<TrajectoryFrame>& frames) {
  Extent extent;
  for (const TrajectoryFrame& frame : frames) {
    extent.low = std::min(extent.low, frame.floor_position);
    for (std::size_t i = 0; i < frame.size(); ++i)
      extent.high = std::max(extent.high, frame.z[i] + (frame.radius.empty() ? 0.5 : frame.radius[i]));
  }
  extent.high += 0.3, extent.low -= 0.3;
  // Not taller than twice its width: of a disk thrown far up only the bed below is worth a page.
  extent.high = std::min(extent.high, extent.low + std::max(2 * frames.front().width, 10.0));
  return extent;
}

// x and z of every disk of every frame, as the player reads them.
std::string position_bytes(const std::vector<TrajectoryFrame>& frames, const Extent& extent) {
  const double width = frames.front().width;
  std::string bytes;
  bytes.reserve(frames.size() * frames.front().size() * 4);
  const auto put = [&](double fraction) {
    const auto value = static_cast<std::uint16_t>(std::lround(65535 * std::clamp(fraction, 0.0, 1.0)));
    bytes += static_cast<char>(value & 0xFF);
    bytes += static_cast<char>(value >> 8);
  };
  for (const TrajectoryFrame& frame : frames) {
    for (std::size_t k = 0; k < frame.size(); ++k) {
      double x = frame.x[k];
      if (frame.periodic) x -= std::floor(x / width) * width;
      put(x / width), put((frame.z[k] - extent.low) / (extent.high - extent.low));
    }
  }
  return bytes;
}

// The density of every frame shown, up to where the picture ends.
std::string densities_json(const std::vector<TrajectoryFrame>& frames, const Extent& extent) {
  std::vector<std::vector<double>> heights;
  for (const TrajectoryFrame& frame : frames) heights.push_back(frame.z);
  return dump_canonical(frame_profiles(heights, frames.front().width, extent.low, extent.high));
}

// What the player must know besides the positions.
std::string scene_json(const std::vector<TrajectoryFrame>& frames, const Extent& extent, bool has_phase) {
  const TrajectoryFrame& first = frames.front();
  std::vector<double> floor;
  std::string labels, tones;
  for (const TrajectoryFrame& frame : frames) {
    labels += fmt::format("{}\"{}t = {:.1f} √(D/g)\"", floor.empty() ? "" : ",",
                          has_phase ? fmt::format("phase {:.2f}, ", frame.phase) : "", frame.time);
    floor.push_back(frame.floor_position);
  }
  // Two tones by the height in the first frame show how the bed mixes.
  for (std::size_t k = 0; k < first.size(); ++k)
    tones += fmt::format("{}{}", k == 0 ? "" : ",", static_cast<long>(std::floor(std::max(0.0, first.z[k]) / 2)) % 2);
  return fmt::format(
      "{{\"width\":{:.6g},\"low\":{:.6g},\"high\":{:.6g},\"walls\":{},\"radius\":{},\"floor\":{},\"tone\":[{}],"
      "\"label\":[{}],\"profile\":{}}}",
      first.width, extent.low, extent.high, first.periodic ? "false" : "true",
      numbers(first.radius.empty() ? std::vector<double>(first.size(), 0.5) : first.radius), numbers(floor), tones,
      labels, densities_json(frames, extent));
}

std::string attribute_text(std::string_view text) {
  std::string out;
  for (const char c : text) out += c == '"' ? std::string("&quot;") : std::string(1, c);
  return out;
}

}  // namespace

std::string animation_html(const std::filesystem::path& trajectory, double period) {
  std::vector<TrajectoryFrame> frames = first_frames(trajectory);
  if (frames.empty()) return "";
  const bool strobe = is_stroboscopic(frames, period);
  if (strobe) frames = by_phase(frames);
  const Extent extent = extent_of(frames);
  return fmt::format(
      "<figure id=\"bed-in-motion\" class=\"bed\" data-scene=\"{}\" data-positions=\"{}\">\n<div class=\"stage\"><div "
      "class=\"views\"><div class=\"picture\"><canvas role=\"img\" aria-label=\"the bed in motion\"></canvas>\n<div "
      "class=\"controls\"><button type=\"button\">Play</button><input type=\"range\" min=\"0\" value=\"0\" "
      "aria-label=\"frame of the bed\"><output></output></div></div>\n<div class=\"side\"></div></div></div>\n<div "
      "class=\"still\">{}</div>\n<figcaption>{} disks, {} frames of the trajectory{}. The two tones mark the height of "
      "a disk at the beginning and show how the bed mixes. Profile: this frame (orange) beside the mean of all frames "
      "(blue). Dashed line: the floor.</figcaption></figure>\n",
      attribute_text(scene_json(frames, extent, period > 0)), base64(position_bytes(frames, extent)),
      still_picture(frames.front(), extent.low, extent.high), frames.front().size(), frames.size(),
      strobe ? ", in the order of the floor's phase. Each frame is from a different period of the floor, as under a "
               "stroboscope"
             : " in the order of time");
}

}  // namespace shakebed::pipelines
