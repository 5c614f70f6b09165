// What the page shows of an extract stage: the disks in the frames, and the numbers of the measurement.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/extract.hpp"

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

std::string pictures_html(const fs::path& directory) {
  std::string out;
  const std::vector<fs::path> overlays = overlays_of(directory);
  for (const fs::path& path : overlays) {
    out += fmt::format(
        "<figure><img alt=\"disks found\" src=\"data:image/png;base64,{}\"><figcaption>Disks found in frame {}: "
        "green circles; orange, those cut or half hidden; blue, floor and walls.</figcaption></figure>\n",
        base64(read_file(path)), escape_markup(path.stem().string().substr(8)));
  }
  const auto picture = [&](const fs::path& path, const char* caption) {
    if (fs::exists(path))
      out += fmt::format(
          "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n", caption,
          base64(read_file(path)));
  };
  for (const fs::path& path : overlays) {
    picture(directory / ("residual_" + path.stem().string().substr(8) + ".png"),
            "What beads and light do not explain of that frame: grey where nothing is left.");
  }
  picture(directory / "bead.png", "The bead as learned from the frames.");
  return out;
}

std::string curves_html(const fs::path& directory, int& pictures) {
  std::string out;
  for (const auto& [name, caption] :
       {std::pair{"count.svg", "Disks against time: beads do not vanish, so a dip is a miss."},
        std::pair{"quality.svg", "Quality of the disks found."}}) {
    if (const fs::path path = directory / name; fs::exists(path))
      out += fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n", inline_svg(path, ++pictures), caption);
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
      out += fmt::format("<tr><td>{} (against the rendered truth)</td><td class=\"number\">{}</td></tr>\n", words(key),
                         shown(value));
  }
  return out + "</table></div>\n";
}

std::string frames_html(const FinishedStage& stage, int& pictures) {
  return pictures_html(stage.files.directory) + curves_html(stage.files.directory, pictures) +
         numbers_html(stage.result);
}

}  // namespace

StagePages extract_pages() { return {.sections = {{ReportPlace::frames, "Disks in the frames", frames_html}}}; }

}  // namespace shakebed::pipelines
