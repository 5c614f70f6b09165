#include "pipelines/stages/film_viewer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/frame_profiles.hpp"
#include "sim/measure/order.hpp"

namespace shakebed::pipelines {
namespace {

// Farther than that two centres of following frames are not taken for one disk [D].
constexpr double longest_step = 0.5;
// Of the disks that could be followed, as extract.json states; below, steps are those of other disks.
constexpr double least_linked = 0.5;

struct FilmDisks {
  std::vector<double> x_px, y_px, radius_px, x, z, quality, probability;
};
struct DiskColumn {
  const char* name;
  std::vector<double> FilmDisks::*to;
};

// Columns of a table of disks, of the frames wanted alone.
void read_columns(const std::filesystem::path& path, const std::set<std::size_t>& wanted,
                  const std::vector<DiskColumn>& read, std::map<std::size_t, FilmDisks>& frames) {
  const std::string text = read_file(path);
  std::vector<std::size_t> columns;
  for (std::size_t begin = 0, end; begin < text.size(); begin = end + 1) {
    end = std::min(text.find('\n', begin), text.size());
    const std::string_view line(text.data() + begin, end - begin);
    if (columns.empty()) {
      const std::vector<std::string> header = split_csv_line(line);
      for (const DiskColumn& column : read) columns.push_back(csv_column(header, column.name, path.string()));
      continue;
    }
    // Most lines are of other frames: their first cell alone is looked at.
    std::size_t frame = 0;
    std::from_chars(line.data(), line.data() + line.size(), frame);
    if (line.empty() || !wanted.contains(frame)) continue;
    const std::vector<std::string> cells = split_csv_line(line);
    FilmDisks& disks = frames[frame];
    for (std::size_t k = 0; k < read.size(); ++k) {
      const std::optional<double> value = columns[k] < cells.size() ? number_in(cells[columns[k]]) : std::nullopt;
      if (!value)
        throw InputError(fmt::format("{}: a row of frame {} has a cell that is not a number", path.string(), frame));
      (disks.*read[k].to).push_back(*value);
    }
  }
}

// disks.csv, and row by row beside it disk_details.csv, where there is one.
std::map<std::size_t, FilmDisks> read_disks(const Input& files, const std::set<std::size_t>& wanted) {
  std::map<std::size_t, FilmDisks> frames;
  read_columns(files.file("disks.csv"), wanted,
               {{"x_px", &FilmDisks::x_px},
                {"y_px", &FilmDisks::y_px},
                {"radius_px", &FilmDisks::radius_px},
                {"x", &FilmDisks::x},
                {"z", &FilmDisks::z},
                {"quality", &FilmDisks::quality}},
               frames);
  if (files.has("disk_details.csv"))
    read_columns(files.file("disk_details.csv"), wanted, {{"probability", &FilmDisks::probability}}, frames);
  for (auto& [frame, disks] : frames) {
    if (!disks.probability.empty() && disks.probability.size() != disks.x.size())
      throw InputError(fmt::format("{}: disks.csv and disk_details.csv do not list the same disks in frame {}",
                                   files.directory.string(), frame));
  }
  return frames;
}

// |psi_6| of every disk.
std::vector<double> order_of(const FilmDisks& disks) {
  sim::Snapshot at;
  at.x = disks.x, at.z = disks.z;
  sim::DiskProperties properties;
  properties.radius.assign(disks.x.size(), 0.5), properties.mass.assign(disks.x.size(), 1);
  const sim::BondOrder order = sim::bond_order(at, properties, 0, 0);
  std::vector<double> out;
  for (std::size_t i = 0; i < disks.x.size(); ++i) out.push_back(std::hypot(order.psi6_re[i], order.psi6_im[i]));
  return out;
}

// The nearest of `to` for every disk of `from`, by its number; none beyond longest_step.
std::vector<std::optional<std::size_t>> nearest_disks(const FilmDisks& from, const FilmDisks& to) {
  std::vector<std::size_t> by_x(to.x.size());
  for (std::size_t i = 0; i < by_x.size(); ++i) by_x[i] = i;
  std::sort(by_x.begin(), by_x.end(), [&](std::size_t a, std::size_t b) { return to.x[a] < to.x[b]; });
  std::vector<std::optional<std::size_t>> out(from.x.size());
  for (std::size_t i = 0; i < from.x.size(); ++i) {
    double closest = longest_step * longest_step;
    auto at = std::lower_bound(by_x.begin(), by_x.end(), from.x[i] - longest_step,
                               [&](std::size_t k, double x) { return to.x[k] < x; });
    for (; at != by_x.end() && to.x[*at] <= from.x[i] + longest_step; ++at) {
      const double dx = to.x[*at] - from.x[i], dz = to.z[*at] - from.z[i];
      if (dx * dx + dz * dz < closest) closest = dx * dx + dz * dz, out[i] = *at;
    }
  }
  return out;
}

struct Step {
  double x = 0, z = 0;  // [D]
};
// Where each disk is in the next frame, as seen from where it is; nothing where it was not followed, or others are as
// near.
std::vector<std::optional<Step>> steps_of(const FilmDisks& now, const FilmDisks& next) {
  const auto forward = nearest_disks(now, next), back = nearest_disks(next, now);
  std::vector<std::optional<Step>> out(now.x.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (forward[i] && back[*forward[i]] == i)
      out[i] = Step{next.x[*forward[i]] - now.x[i], next.z[*forward[i]] - now.z[i]};
  }
  return out;
}

// The first frame with its disks, where scripts do not run.
std::string still_html(const Json& film, const FilmDisks& disks) {
  std::string out = fmt::format(
      "<svg viewBox=\"-0.5 -0.5 {0} {1}\" role=\"img\" aria-label=\"disks found in frame {2}\" "
      "style=\"width:100%;max-width:720px\"><image href=\"data:image/{3};base64,{4}\" x=\"-0.5\" y=\"-0.5\" "
      "width=\"{0}\" "
      "height=\"{1}\"/><g fill=\"none\" stroke=\"#00c853\" stroke-width=\"1.5\">",
      film.at("width").get<int>(), film.at("height").get<int>(), film.at("frames")[0].get<std::size_t>(),
      film.at("kind").get<std::string>(), film.at("pictures")[0].get<std::string>());
  for (std::size_t i = 0; i < disks.x_px.size(); ++i)
    out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>", disks.x_px[i], disks.y_px[i],
                       disks.radius_px[i]);
  return out + "</g></svg>";
}

// What the viewer reads, frame by frame.
class FilmData {
 public:
  FilmData(const FinishedStage& stage, Json film) : film_(std::move(film)) {
    const Json* linked = find_pointer(stage.result, "/velocities/linked_share");
    follows_ = linked != nullptr && linked->is_number() && linked->get<double>() >= least_linked;
    std::set<std::size_t> wanted;
    for (const Json& frame : film_.at("frames")) {
      wanted.insert(frame.get<std::size_t>());
      if (follows_) wanted.insert(frame.get<std::size_t>() + 1);
    }
    frames_ = read_disks(stage.files, wanted);
    if (const Json* diameter = find_pointer(stage.result, "/diameter/value");
        diameter != nullptr && diameter->is_number())
      film_["diameter"] = *diameter;
    if (const Json* width = find_pointer(stage.result, "/width/value"); width != nullptr && width->is_number())
      width_ = width->get<double>();
  }

  // After json().
  std::string still() const { return still_html(film_, frames_.at(film_.at("frames")[0].get<std::size_t>())); }

  Json json() {
    for (const auto& [ignored, disks] : frames_)
      for (const double radius : disks.radius_px) largest_radius_ = std::max(largest_radius_, radius);
    Json out = film_;
    std::string bytes;
    std::vector<std::vector<double>> heights;
    double highest = 1, lowest = 0;
    for (const Json& number : film_.at("frames")) {
      const std::size_t frame = number.get<std::size_t>();
      const FilmDisks& disks = frames_[frame];
      out["counts"].push_back(disks.x.size());
      add_disks(disks,
                follows_ && frames_.contains(frame + 1) ? steps_of(disks, frames_[frame + 1])
                                                        : std::vector<std::optional<Step>>(disks.x.size()),
                bytes);
      heights.push_back(disks.z);
      for (const double z : disks.z) highest = std::max(highest, z), lowest = std::min(lowest, z);
    }
    out["disks"] = base64(bytes);
    out["radius"] = largest_radius_, out["step"] = longest_step, out["follows"] = follows_;
    out["profile"] = frame_profiles(heights, width_, std::floor(lowest), std::ceil(highest + 1));
    return out;
  }

 private:
  // 10 bytes a disk: place (two 16-bit fractions of the frame), radius, quality, order, probability, step to the right
  // and upwards; 255: not known.
  void add_disks(const FilmDisks& disks, const std::vector<std::optional<Step>>& steps, std::string& bytes) const {
    const double width = film_.at("width"), height = film_.at("height");
    const std::vector<double> order = order_of(disks);
    const auto byte = [&](double share, double most) {
      bytes += static_cast<char>(std::lround(most * std::clamp(share, 0.0, 1.0)));
    };
    const auto two = [&](double share) {
      const auto value = static_cast<std::uint16_t>(std::lround(65535 * std::clamp(share, 0.0, 1.0)));
      bytes += static_cast<char>(value & 0xFF), bytes += static_cast<char>(value >> 8);
    };
    for (std::size_t i = 0; i < disks.x.size(); ++i) {
      two(disks.x_px[i] / width), two(disks.y_px[i] / height);
      byte(disks.radius_px[i] / largest_radius_, 255), byte(disks.quality[i], 254), byte(order[i], 254);
      if (disks.probability.empty())
        bytes += static_cast<char>(255);
      else
        byte(disks.probability[i], 254);
      if (steps[i])
        byte(0.5 + 0.5 * steps[i]->x / longest_step, 254), byte(0.5 + 0.5 * steps[i]->z / longest_step, 254);
      else
        bytes += "\xFF\xFF";
    }
  }

  Json film_;
  std::map<std::size_t, FilmDisks> frames_;
  double width_ = 0, largest_radius_ = 1;
  bool follows_ = false;
};

}  // namespace

std::string film_viewer(const FinishedStage& stage) {
  if (!stage.files.has("film.json") || !stage.files.has("disks.csv")) return "";
  FilmData data(stage, read_json(stage.files.file("film.json")));
  const Json film = data.json();
  const std::size_t shown = film.at("frames").size(), of = film.at("of");
  std::string choices =
      "<option value=\"outline\">outlines</option><option value=\"quality\">quality</option><option "
      "value=\"order\">crystalline order |ψ6|</option>";
  if (film.at("follows").get<bool>()) choices += "<option value=\"speed\">speed</option>";
  if (film.contains("marks")) choices += "<option value=\"truth\">missed and false</option>";
  choices += "<option value=\"none\">picture alone</option>";
  const std::string thinned = of == 1 ? std::string("The only good frame")
                              : shown == of
                                  ? fmt::format("All {} good frames", of)
                                  : fmt::format("{} of {} good frames (one in {}), so that the page stays small", shown,
                                                of, film.at("every").get<int>());
  return fmt::format(
      "<figure class=\"film\">\n<script type=\"application/json\" class=\"film-data\">{}</script>\n<div "
      "class=\"stage\"><div "
      "class=\"views\"><div class=\"picture\"><canvas tabindex=\"0\" role=\"application\" aria-roledescription=\"film "
      "frame\" "
      "aria-label=\"frame with the disks found: arrow keys go from disk to disk\"></canvas><div class=\"says\" "
      "role=\"status\" "
      "hidden></div>\n<div class=\"controls\"><button "
      "type=\"button\">Play</button><input type=\"range\" min=\"0\" value=\"0\" aria-label=\"frame of the "
      "film\"><output></output>"
      "<label>colour <select>{}</select></label><span class=\"legend\"></span></div></div>\n<div "
      "class=\"side\"></div></div></div>\n<div class=\"still\">{}</div>\n"
      "<figcaption>{}; pictures {} px wide, compressed. Profile: this frame (orange) beside the mean of those shown "
      "(blue). "
      "Blue dashes: the floor.</figcaption></figure>\n",
      script_text(dump_canonical(film)), choices, data.still(), thinned, film.at("picture_width").get<int>());
}

}  // namespace shakebed::pipelines
