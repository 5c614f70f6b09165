// What the page shows of an extract stage: the disks in the frames, and the numbers of the measurement.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/extract.hpp"
#include "pipelines/stages/film_viewer.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t most_overlays = 3;

// Frames with what was found drawn into them.
std::vector<fs::path> overlays_of(const fs::path& directory) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("overlay_") && name.ends_with(".png")) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  if (files.size() > most_overlays) files.resize(most_overlays);
  return files;
}

std::string film_html(const FinishedStage& stage, int&) { return film_viewer(stage); }

// Of a stage without film its frames with what was found in them; what the model leaves of one frame; the bead.
std::string pictures_html(const fs::path& directory) {
  std::string out;
  const auto picture = [&](const fs::path& path, const char* kind, const std::string& caption) {
    if (fs::exists(path))
      out += fmt::format(
          "<figure><img alt=\"{0}\" src=\"data:image/{1};base64,{2}\"><figcaption>{0}</figcaption></figure>\n",
          escape_markup(caption), kind, base64(read_file(path)));
  };
  if (!fs::exists(directory / "film.json")) {
    for (const fs::path& path : overlays_of(directory))
      picture(path, "png",
              fmt::format("Disks found in frame {}. Green: disks found; orange: disks cut by the border or partly "
                          "covered; blue: floor and walls.",
                          path.stem().string().substr(8)));
  }
  picture(directory / "residual.webp", "webp",
          "Difference between the first drawn frame and the model of beads and light; grey: no difference.");
  picture(directory / "bead.png", "png", "Mean picture of a bead, learned from the frames.");
  return out;
}

std::string curves_html(const fs::path& directory, int& pictures) {
  std::string out;
  for (const auto& [name, caption] :
       {std::pair{"count.svg",
                  "Number of disks found against time. Beads do not disappear, so a dip means that some were missed."},
        std::pair{"quality.svg", "Quality of the disks found."}}) {
    if (const fs::path path = directory / name; fs::exists(path)) out += figure_html(path, ++pictures, caption);
  }
  return out;
}

std::string numbers_html(const Json& result) {
  std::string out = "<div class=\"scroll\"><table>\n<tr><th>from the frames</th><th></th></tr>\n";
  for (const char* key : {"frames_used", "disks_per_frame", "scale", "radius", "width", "column_number", "noise",
                          "contrast", "frequency", "floor_amplitude", "coverage_disagreement"}) {
    if (result.contains(key))
      out += fmt::format("<tr><td>{}</td><td class=\"number\">{}</td></tr>\n", words(key), shown(result[key]));
  }
  if (result.contains("truth")) {
    for (const auto& [key, value] : result["truth"].items())
      out +=
          fmt::format("<tr><td>{} (compared with the rendered true positions)</td><td class=\"number\">{}</td></tr>\n",
                      words(key), shown(value));
  }
  return out + "</table></div>\n";
}

std::string frames_html(const FinishedStage& stage, int& pictures) {
  return pictures_html(stage.files.directory) + curves_html(stage.files.directory, pictures) +
         numbers_html(stage.result);
}

}  // namespace

StagePages extract_pages() {
  using enum WarningEffect;
  return {
      .sections = {{ReportPlace::film, "The film", film_html},
                   {ReportPlace::frames, "Disks in the frames", frames_html}},
      .warnings = {
          {"that was cut or scaled", measurement,
           "Give both sides (\"left_wall\", \"right_wall\"), or use the pictures as they were rendered."},
          {"with periodic sides", rest, "Nothing: the width of the box is used."},
          {"may be wrong", measurement,
           "Look through the film with the colours by quality for marked objects that are not beads."},
          {"beads may be missed", measurement,
           "Look through the film for beads without a circle; give a region (\"roi\") that contains only the bed."},
          {"of the disks found touch", measurement,
           "Check in the film that the circles are as large as your beads. If not, give the length of a pixel "
           "(\"scale\")."},
          {"Touching beads are", measurement,
           "Nothing if your beads touch. If they do not, give the length of a pixel (\"scale\")."},
          {"the circles seen are", measurement,
           "Check in the film that the circles are as large as your beads. If not, give the length of a pixel "
           "(\"scale\")."},
          {"disks found overlap", measurement,
           "Check in the film that the circles are as large as your beads. If not, give the length of a pixel "
           "(\"scale\")."},
          {"Only a part of the picture", measurement,
           "Check in the film that all beads have circles; else give a region (\"roi\") that contains all of them."},
          {"beside the bed", measurement, "Check in the film that the proposed region contains all beads of the bed."},
          {"No level floor", measurement, "Photograph the bed from the side, or give the floor's row (\"floor\")."},
          {"missed or out of view", measurement,
           "Look through the film for beads without a circle; give a region (\"roi\") that contains only the bed, or "
           "use more uniform light."},
          {"is taken for a bead", measurement,
           "Look through the film for circles that are not beads; give a region (\"roi\") that contains only the bed."},
          {"plainly not round", measurement,
           "Check in the film that what has no circle is no bead. Densities are valid only for disks."},
          {"outlines are not those", measurement,
           "Check in the film that the circles are your beads. Densities are valid only for disks."},
          {"as in a plot", measurement, "Check in the film that the circles are your beads."},
          {"as in a drawing", measurement, "Check in the film that the circles are your beads."},
          {"covered area", measurement, "Look through the film for beads that were missed or found twice."},
          {"varies by", measurement, "Use a wider view, or a region (\"roi\") that beads do not leave."},
          {"lower border", measurement, "Give the row of the floor (\"floor\"): heights are measured from it."},
          {"tilted", measurement, "Level the camera. The heights are corrected for the tilt."},
          {"flickers", rest, "Nothing: it was corrected frame by frame. A steadier light gives smaller errors."},
          {"no profiles by phase", rest,
           "If the pictures are a film of a shaken bed, give \"frequency\", or record at a higher frame rate."},
          {"frame_rate", rest, "Give \"frame_rate\" if the film was recorded faster than it plays."},
          {"collide between frames", measurement,
           "Record at a higher frame rate, so that disks rarely collide between frames."},
          {"is too low", measurement, "Record at a higher frame rate, so that fast disks are followed too."},
          {"elocities", measurement,
           "Record at a higher frame rate: disks must move less than half a diameter between frames."},
          {"", measurement, "Look through the film and the figures of the frames below."}}};
}

}  // namespace shakebed::pipelines
