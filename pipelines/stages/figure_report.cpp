// What the page shows of a stage that draws (figure, chart): its pictures with their captions.
#include <fmt/format.h>

#include <algorithm>

#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/figure.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

// The SVG files, in the order of the recipe where there is one, else by name.
std::vector<fs::path> pictures_of(const FinishedStage& stage) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(stage.files.directory, error)) {
    if (entry.path().extension() == ".svg") files.push_back(entry.path());
  }
  const Json& result = stage.result;
  const auto place = [&](const fs::path& path) {
    const auto found = result.is_object() ? result.find(path.stem().string()) : result.end();
    return std::pair(std::distance(result.begin(), found), path);
  };
  std::sort(files.begin(), files.end(), [&](const auto& a, const auto& b) { return place(a) < place(b); });
  return files;
}

// What the recipe says, else the density profile.
bool leads(const FinishedStage& stage, const std::string& name) {
  if (stage.files.result_name == "figure.json") return name == "profile";
  const Json* lead = find_pointer(stage.result, "/" + escape_pointer_token(name) + "/lead");
  return lead != nullptr && lead->is_boolean() && lead->get<bool>();
}

std::string pictures_html(const FinishedStage& stage, int& pictures, bool leading) {
  std::string out;
  for (const fs::path& path : pictures_of(stage)) {
    const std::string name = path.stem().string();
    if (leads(stage, name) != leading) continue;
    const Json* own = find_pointer(stage.result, "/" + escape_pointer_token(name) + "/caption");
    const std::string caption =
        own != nullptr && own->is_string() ? own->get<std::string>()
        : name == "profile"
            ? "Density against height. Error bars: one standard error, including the correlation between frames."
        : name == "windows" ? "Fitted temperature against the lower edge of the window of the fit."
                            : words(name);
    out += figure_html(path, ++pictures, prose(caption));
  }
  return out;
}
std::string lead_html(const FinishedStage& stage, int& pictures) { return pictures_html(stage, pictures, true); }
std::string figures_html(const FinishedStage& stage, int& pictures) { return pictures_html(stage, pictures, false); }

}  // namespace

StagePages figure_pages() {
  return {.sections = {{ReportPlace::lead_picture, "", lead_html}, {ReportPlace::figures, "Figures", figures_html}}};
}

}  // namespace shakebed::pipelines
