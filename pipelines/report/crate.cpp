#include "pipelines/report/crate.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <set>
#include <string>
#include <utility>

#include "pipelines/formats/files.hpp"
#include "pipelines/runner/manifest.hpp"
#include "pipelines/version.hpp"

namespace shakebed::pipelines {
namespace {

namespace fs = std::filesystem;

// Files of the user's own that are named one by one; manifest.json names all.
constexpr std::size_t most_inputs = 100;

std::string format_of(const std::string& file) {
  constexpr std::array formats = {std::pair(".csv", "text/csv"),         std::pair(".json", "application/json"),
                                  std::pair(".svg", "image/svg+xml"),    std::pair(".pdf", "application/pdf"),
                                  std::pair(".png", "image/png"),        std::pair(".html", "text/html"),
                                  std::pair(".md", "text/markdown"),     std::pair(".xml", "application/xml"),
                                  std::pair(".zst", "application/zstd"), std::pair(".txt", "text/plain"),
                                  std::pair(".dat", "text/plain"),       std::pair(".gp", "text/plain"),
                                  std::pair(".extxyz", "chemical/x-xyz")};
  const std::string extension = fs::path(file).extension().string();
  for (const auto& [name, type] : formats) {
    if (extension == name) return type;
  }
  return "application/octet-stream";
}

Json reference(const std::string& id) { return Json{{"@id", id}}; }

// A file's place in the crate: blanks and signs as a URI writes them.
std::string uri_of(const std::string& path) {
  std::string out;
  for (const char c : path) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain =
        byte > 0x20 && byte < 0x7F && std::string_view("\"<>\\^`{|}%#?[]").find(c) == std::string_view::npos;
    out += plain ? std::string(1, c) : fmt::format("%{:02X}", byte);
  }
  return out;
}

Json descriptor() {
  return Json{{"@id", std::string(crate_name)},
              {"@type", "CreativeWork"},
              {"about", reference("./")},
              {"conformsTo", reference("https://w3id.org/ro/crate/1.1")}};
}

Json software() {
  return Json{{"@id", "#shakebed"},
              {"@type", "SoftwareApplication"},
              {"name", "shakebed"},
              {"version", program_version()},
              {"softwareVersion", source_revision()},
              {"description", "shaken beds of disks under gravity: simulate, photograph, measure, fit"}};
}

Json no_licence() {
  return Json{{"@id", "#licence"},
              {"@type", "CreativeWork"},
              {"name", "No licence is stated"},
              {"description", "The program states no licence for results. Whoever publishes them should state one."}};
}

Json root_of(const Plan& plan, Json parts, Json actions) {
  const std::string title = plan.report.title.empty() ? plan.name : plan.report.title;
  return Json{{"@id", "./"},
              {"@type", "Dataset"},
              {"name", title},
              {"description", plan.description.empty()
                                  ? fmt::format("Results of the shakebed recipe \"{}\": see report.html.", plan.name)
                                  : plan.description},
              {"datePublished", SHAKEBED_SOURCE_DATE},
              {"license", reference("#licence")},
              {"hasPart", std::move(parts)},
              {"mentions", std::move(actions)}};
}

Json file_json(const std::string& path, const Json& more) {
  Json file{{"@id", uri_of(path)}, {"@type", "File"}, {"name", path}, {"encodingFormat", format_of(path)}};
  file.update(more);
  return file;
}

Json document(Json graph) {
  return Json{{"@context",
               Json::array({"https://w3id.org/ro/crate/1.1/context", Json{{"sha256", "https://schema.org/sha256"}}})},
              {"@graph", std::move(graph)}};
}

class Crate {
 public:
  Crate(const Plan& plan, const RunOutcome& outcome) : plan_(plan), outcome_(outcome) {}

  Json operator()() {
    graph_.push_back(descriptor());
    graph_.push_back(Json::object());  // the root, once its parts are known
    add_pages();
    add_software();
    for (std::size_t i = 0; i < outcome_.stages.size() && i < plan_.stages.size(); ++i) add_stage(i);
    graph_[1] = root();
    return document(std::move(graph_));
  }

 private:
  Json root() const {
    Json out = root_of(plan_, parts_, actions_);
    if (fs::exists(outcome_.out / "report.html")) out["mainEntity"] = reference("report.html");
    return out;
  }

  void add_file(const std::string& path, const Json& more) { graph_.push_back(file_json(path, more)); }

  void add_pages() {
    const auto page = [&](const char* name, const char* description) {
      if (!fs::exists(outcome_.out / name)) return;
      add_file(name, Json{{"description", description}});
      parts_.push_back(reference(name));
    };
    page("report.html", "all results on one page, which needs no network");
    page("summary.md", "short summary of the results");
    page("summary.json", "numbers of every stage, beginning with the answer");
    page("resolved.json", "recipe with every option written out; it can be run itself");
    // It is written after this file.
    add_file("manifest.json",
             Json{{"description", "versions, seeds, times, and the SHA-256 of every input and output"}});
    parts_.push_back(reference("manifest.json"));
  }

  void add_software() { graph_.push_back(software()), graph_.push_back(no_licence()); }

  void add_stage(std::size_t i) {
    const StageOutcome& stage = outcome_.stages[i];
    const PlannedStage& planned = plan_.stages[i];
    if (!stage.record) return;
    const std::string folder = uri_of(stage.id) + "/";
    Json files = Json::array();
    for (const Fingerprint& file : stage.record->outputs) {
      const std::string path = stage.id + "/" + file.file;
      add_file(path, Json{{"contentSize", std::to_string(file.bytes)}, {"sha256", file.sha256}});
      files.push_back(reference(uri_of(path)));
    }
    graph_.push_back(Json{{"@id", folder},
                          {"@type", "Dataset"},
                          {"name", stage.id},
                          {"description", fmt::format("results of the stage \"{}\" ({}: {})", stage.id, stage.kind,
                                                      planned.row->summary)},
                          {"hasPart", files}});
    parts_.push_back(reference(folder));
    Json action{{"@id", "#run-" + uri_of(stage.id)},
                {"@type", "CreateAction"},
                {"name", fmt::format("{} ({})", stage.id, stage.kind)},
                {"instrument", reference("#shakebed")},
                {"object", objects_of(planned)},
                {"result", reference(folder)}};
    if (planned.row->uses_seed) action["description"] = fmt::format("seed {}", planned.seed);
    actions_.push_back(reference(action["@id"].get<std::string>()));
    graph_.push_back(std::move(action));
  }

  // What a stage was made from: the recipe, the stages before it, files of the user's own.
  Json objects_of(const PlannedStage& planned) {
    Json objects = Json::array({reference("resolved.json")});
    for (const std::size_t k : planned.from) objects.push_back(reference(uri_of(plan_.stages[k].id) + "/"));
    std::size_t named = 0;
    for (const auto& [pointer, path] : planned.input_files) {
      if (++named > most_inputs) break;
      const auto [known, fresh] = inputs_.emplace(
          path, fmt::format("#input-{}-{}", inputs_.size() + 1, uri_of(fs::path(path).filename().string())));
      const std::string& id = known->second;
      if (fresh)
        graph_.push_back(
            Json{{"@id", id},
                 {"@type", "CreativeWork"},
                 {"name", fs::path(path).filename().string()},
                 {"description", "input file from another folder; its path and SHA-256 are in manifest.json"}});
      objects.push_back(reference(id));
    }
    return objects;
  }

  const Plan& plan_;
  const RunOutcome& outcome_;
  Json graph_ = Json::array(), parts_ = Json::array(), actions_ = Json::array();
  std::map<std::string, std::string> inputs_;  // path, its name here
};

}  // namespace

Json crate_json(const Plan& plan, const RunOutcome& outcome) { return Crate(plan, outcome)(); }

Json crate_json(const Plan& plan, const SweepOutcome& sweep) {
  Json parts = Json::array(), graph = Json::array({descriptor(), Json::object(), software(), no_licence()});
  const auto add = [&](Json entity) {
    parts.push_back(reference(entity["@id"].get<std::string>()));
    graph.push_back(std::move(entity));
  };
  for (const auto& [name, description] :
       {std::pair("sweep.csv", "one row per point: its values and the collected numbers, in SI units"),
        std::pair("sweep.csv-metadata.json", "description of the columns of sweep.csv (CSV on the Web)"),
        std::pair("resolved.json", "the recipe with every option written out"),
        std::pair("report.html", "figures, maps and the table of points on one page"),
        std::pair("summary.md", "short summary of the results")}) {
    if (fs::exists(sweep.out / name)) add(file_json(name, Json{{"description", description}}));
  }
  if (fs::is_directory(sweep.out / "figures")) {
    std::set<std::string> figures;  // in the order of their names
    for (const fs::directory_entry& entry : fs::directory_iterator(sweep.out / "figures"))
      figures.insert("figures/" + entry.path().filename().string());
    for (const std::string& path : figures) add(file_json(path, Json::object()));
  }
  for (const SweepPoint& point : sweep.points) {
    if (!fs::is_directory(sweep.out / "points" / point.name)) continue;
    add(Json{{"@id", "points/" + point.name + "/"},
             {"@type", "Dataset"},
             {"name", "point " + point.name},
             {"description", "results of one point; its stages are described in the metadata of its own folder"}});
  }
  const Json action{{"@id", "#run"},
                    {"@type", "CreateAction"},
                    {"name", plan.name},
                    {"instrument", reference("#shakebed")},
                    {"object", Json::array({reference("resolved.json")})},
                    {"result", reference("./")}};
  graph.push_back(action);
  graph[1] = root_of(plan, std::move(parts), Json::array({reference("#run")}));
  return document(std::move(graph));
}

}  // namespace shakebed::pipelines
