// The page of a run, of stages whose records are made by hand: its parts, their order, numbers and drawings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/report/crate.hpp"
#include "pipelines/report/report.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;
using testing::Not;

class ReportPage : public testing::Test {
 protected:
  void read(const std::string& top = "") {
    read_recipe(R"({ "name": "a_bed", )" + top + R"( "stages": [
        { "stage": "map", "id": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 },
        { "stage": "simulate", "id": "a-bed-of-14-xx", "seed": 7, "disks": { "count": 50, "diameter": "3 mm" },
          "box": { "width": "19 mm" }, "settle": "0.5 s", "measure": "0.5 s",
          "floor": { "motion": "sinusoidal", "amplitude": "2 mm", "frequency": "20 Hz" } },
        { "stage": "fit", "id": "a-fit-of-15-xxx", "from": "a-bed-of-14-xx" },
        { "stage": "figure", "from": ["a-bed-of-14-xx", "a-fit-of-15-xxx"] } ] })",
                "folder/r.json");
  }
  // A recipe of which no stage has run.
  void read_recipe(const std::string& recipe, const std::string& file = "r.json") {
    std::vector<Problem> problems;
    plan_ = make_plan(*parse_json(recipe, file, problems), file, folder_.path());
    outcome_ = {};
    outcome_.out = folder_.path();
    for (const PlannedStage& stage : plan_.stages) {
      outcome_.stages.emplace_back().id = stage.id;
      outcome_.stages.back().kind = stage.row->name;
    }
  }
  void write() {
    report_pages().write(plan_, outcome_);
    page_ = read_text(folder_ / "report.html");
    summary_ = read_text(folder_ / "summary.md");
  }
  std::string between(const std::string& from, const std::string& to) const {
    const std::size_t begin = page_.find(from);
    return begin == std::string::npos ? "" : page_.substr(begin, page_.find(to, begin) - begin);
  }
  ScratchFolder folder_;
  Plan plan_;
  RunOutcome outcome_;
  std::string page_, summary_;
};

// A stage stands one column right of the last that it reads from, below the others of its column. Boxes of 124 x 54, a
// column every 166, a row every 74, 8 from the border: three columns and two rows are 472 x 144.
TEST_F(ReportPage, DrawsItsStages) {
  read();
  outcome_.stages[0].state = StageState::kept;
  outcome_.stages[1].state = StageState::ran;
  outcome_.stages[1].cost.emplace().wall_seconds = 2.5;
  outcome_.stages[2].state = StageState::failed;
  write();
  const std::string graph = between("<svg class=\"graph\"", "</svg>");
  EXPECT_THAT(graph, HasSubstr("viewBox=\"0 0 472 144\" width=\"472\" height=\"144\""));
  EXPECT_THAT(
      graph, HasSubstr("<rect class=\"\" x=\"8\" y=\"8\" width=\"124\" height=\"54\" rx=\"6\"/><text x=\"18\" y=\"31\">"
                       "map</text><text class=\"small\" x=\"18\" y=\"50\">kept</text>"));
  EXPECT_THAT(
      graph,
      HasSubstr("<rect class=\"\" x=\"8\" y=\"82\" width=\"124\" height=\"54\" rx=\"6\"/><text x=\"18\" y=\"105\">"
                "a-bed-of-14-xx</text><text class=\"small\" x=\"18\" y=\"124\">ran<!-- times -->, 2.5 s<!-- "
                "/times --></text>"));
  EXPECT_THAT(
      graph, HasSubstr("<rect class=\"failed\" x=\"174\" y=\"8\" width=\"124\" height=\"54\" rx=\"6\"/><text x=\"184\" "
                       "y=\"31\">a-fit-of-15-x…</text>"));
  EXPECT_THAT(graph, HasSubstr("<rect class=\"\" x=\"340\" y=\"8\" width=\"124\""));
  // From the middle of the right side of one box to that of the left side of the next.
  EXPECT_THAT(graph, HasSubstr("<path d=\"M132 109C156 109 150 35 174 35\"/>"));
  EXPECT_THAT(graph, HasSubstr("<path d=\"M132 109C156 109 316 35 340 35\"/>"));
  EXPECT_THAT(graph, HasSubstr("<path d=\"M298 35C322 35 316 35 340 35\"/>"));
}

// A page needs neither a trajectory nor a result that can be read: it is shown without them.
TEST_F(ReportPage, LeavesOutWhatIsDamaged) {
  read();
  outcome_.stages[1].record.emplace();
  const std::filesystem::path bed = folder_ / "a-bed-of-14-xx";
  std::filesystem::create_directories(bed);
  BedDescription description;
  description.count = 2, description.diameter = 0.003, description.width = 0.019, description.gravity = 9.81;
  description.frequency = 20, description.amplitude = 0.002;
  write_text(bed / "bed.json", dump(description.to_json()));
  write_text(bed / "observables.json", R"({ "temperature_x": { "value": 0.5, "std_error": 0.01, "unit": "m g D" } })");
  TrajectoryFrame frame;
  frame.width = 6;
  for (const double x : {1.0, 4.0}) frame.x.push_back(x), frame.z.push_back(1), frame.vx.push_back(0);
  frame.vz = frame.vx;
  TrajectoryWriter writer(bed / "trajectory.extxyz");
  for (int k = 0; k < 3; ++k) frame.time = k, writer.write(frame);
  writer.close();
  const std::string motion = "data-positions=", temperature = "kinetic T<sub>x</sub> of the simulated disks";
  write();
  EXPECT_THAT(page_, HasSubstr(motion));
  EXPECT_THAT(page_, HasSubstr(temperature));
  const std::string whole = read_text(bed / "trajectory.extxyz");
  write_text(bed / "trajectory.extxyz", whole.substr(0, whole.size() / 2));
  write();
  EXPECT_THAT(page_, Not(HasSubstr(motion)));
  EXPECT_THAT(page_, HasSubstr(temperature));
  write_text(bed / "observables.json", "{");
  write();
  EXPECT_THAT(page_, Not(HasSubstr(temperature)));
  EXPECT_THAT(page_, HasSubstr("a-bed-of-14-xx</text>")) << "the stage itself is on the page";
}

// 24 files of a stage are named; text of up to 120 kB is inside the page as long as this holds 600 kB.
TEST_F(ReportPage, OffersItsFiles) {
  read();
  const auto add = [&](std::size_t stage, const std::string& name, std::size_t bytes) {
    if (!outcome_.stages[stage].record) outcome_.stages[stage].record.emplace();
    const auto path = folder_ / (outcome_.stages[stage].id + "/" + name);
    std::filesystem::create_directories(path.parent_path());
    write_text(path, std::string(bytes, 'x'));
    outcome_.stages[stage].record->outputs.push_back(
        {.file = name, .bytes = bytes, .fast = "", .sha256 = "sha-" + name});
  };
  add(0, "sub/t.csv", 3), add(0, "u.svg", 4), add(0, "v.json", 5), add(0, "w.gp", 6), add(0, "x.png", 7);
  add(0, "y.plot.json", 8);
  add(1, "a.csv", 120'000), add(1, "b.csv", 120'001), add(1, "c.csv", 120'000), add(1, "d.csv", 120'000);
  add(1, "e.csv", 120'000), add(1, "f.csv", 120'000), add(1, "g.dat", 1000);
  for (int k = 0; k < 26; ++k) add(2, std::string(1, static_cast<char>('a' + k)) + ".png", 1);
  write();
  const std::string inside = between("inside this page</summary>", "</ul>");
  EXPECT_THAT(inside, HasSubstr("<a download=\"a_bed-recipe.json\" href=\"data:application/json;base64,"));
  EXPECT_THAT(inside,
              HasSubstr("<li><a download=\"map-sub-t.csv\" href=\"data:text/csv;base64,eHh4\">map-sub-t.csv</a> "
                        "<span class=\"soft\">3 bytes</span></li>"));
  EXPECT_THAT(inside, HasSubstr("<a download=\"map-u.svg\" href=\"data:image/svg+xml;base64,eHh4eA==\">"));
  EXPECT_THAT(inside, HasSubstr("<a download=\"map-v.json\" href=\"data:application/json;"));
  EXPECT_THAT(inside, HasSubstr("<a download=\"map-w.gp\" href=\"data:text/plain;"));
  EXPECT_THAT(inside, HasSubstr("a-bed-of-14-xx-a.csv</a> <span class=\"soft\">120 kB<"));
  EXPECT_THAT(inside, HasSubstr("a-bed-of-14-xx-e.csv"));
  EXPECT_THAT(inside, Not(HasSubstr("a-bed-of-14-xx-b.csv"))) << "too large";
  EXPECT_THAT(inside, Not(HasSubstr("a-bed-of-14-xx-f.csv"))) << "the recipe and four times 120 kB are there already";
  EXPECT_THAT(inside, HasSubstr("a-bed-of-14-xx-g.dat"));
  const std::string beside = between("in the folder of this page</summary>", "</ul>");
  EXPECT_THAT(beside, HasSubstr("<li><a href=\"map/x.png\">map/x.png</a> <span class=\"soft\">7 bytes</span></li>"));
  EXPECT_THAT(beside, HasSubstr("<a href=\"a-bed-of-14-xx/b.csv\">"));
  EXPECT_THAT(beside, HasSubstr("<a href=\"a-bed-of-14-xx/f.csv\">"));
  EXPECT_THAT(beside, HasSubstr("a-fit-of-15-xxx/x.png"));
  EXPECT_THAT(beside, Not(HasSubstr("a-fit-of-15-xxx/y.png")));
  EXPECT_THAT(page_, Not(HasSubstr("map/y.plot.json\">"))) << "it is inside the figure";
  const std::string files = between("Files with their SHA-256", "</table>");
  EXPECT_THAT(
      files,
      HasSubstr("<tr><td>map/sub/t.csv</td><td class=\"number\">3</td><td><code>sha-sub/t.csv</code></td></tr>"));
  EXPECT_THAT(files, HasSubstr("a-fit-of-15-xxx/x.png"));
  EXPECT_THAT(files, Not(HasSubstr("a-fit-of-15-xxx/y.png")));
  EXPECT_THAT(files, HasSubstr("<td>a-fit-of-15-xxx: 2 more files, listed in manifest.json</td>"));
  EXPECT_THAT(files, Not(HasSubstr("a-bed-of-14-xx: ")));
  const std::string provenance = between("<h2>Provenance</h2>", "</table>");
  EXPECT_THAT(provenance, HasSubstr("<td>recipe</td><td><code>r.json</code>"));
  EXPECT_THAT(provenance, HasSubstr("<td>seed of a-bed-of-14-xx</td><td><code>7</code>"));
  EXPECT_THAT(provenance, Not(HasSubstr("seed of map")));
}

// A warning of a stage is folded at the end of its first sentence of at least 25 letters.
TEST_F(ReportPage, GroupsItsWarnings) {
  read();
  outcome_.warnings = {"nobody: short. Said of the recipe",
                       "figure: This is a sentence of many words. And more follow; here",
                       "figure: twenty-four letters here; the rest", "figure: 23 letters are one less: the rest",
                       "figure: ends with a stop, but nothing follows it. "};
  write();
  const std::string own = between("<section class=\"warnings\"", "</section>");
  EXPECT_THAT(
      own,
      HasSubstr("<h2>5 warnings</h2>\n<h3>Warnings about the recipe: the bed may not be the one that you want</h3>\n"
                "<p>nobody: short. Said of the recipe</p>\n<h3>Warnings that do not concern the answer</h3>\n"));
  EXPECT_THAT(
      own, HasSubstr("<details><summary><span class=\"soft\">figure:</span> This is a sentence of many words.</summary>"
                     "<p>And more follow; here</p></details>\n"));
  EXPECT_THAT(own, HasSubstr("<details><summary><span class=\"soft\">figure:</span> twenty-four letters here</summary>"
                             "<p>the rest</p></details>\n"));
  EXPECT_THAT(own, HasSubstr("<p><span class=\"soft\">figure:</span> 23 letters are one less: the rest</p>\n"));
  EXPECT_THAT(own,
              HasSubstr("<p><span class=\"soft\">figure:</span> ends with a stop, but nothing follows it. </p>\n"));
  outcome_.warnings = {"one"};
  write();
  EXPECT_THAT(page_, HasSubstr("<h2>1 warning</h2>"));
  outcome_.warnings.clear();
  write();
  EXPECT_THAT(page_, Not(HasSubstr("<section class=\"warnings\"")));
}

// Of two fits the first gives the answer and the solid's height beside it; each has its section, in the order of the
// recipe.
TEST_F(ReportPage, BeginsWithTheFirstAnswer) {
  write_text(folder_ / "p.csv", "height,number_density\n1,1\n2,0.5\n3,0.2\n");
  read_recipe(R"({ "name": "two", "stages": [ { "stage": "fit", "id": "f", "profile": "p.csv" },
      { "stage": "fit", "id": "g", "profile": "p.csv" }, { "stage": "map", "gamma": 4, "frequency": "20 Hz", "diameter": "3 mm", "initial_height": 10 } ] })");
  for (StageOutcome& stage : outcome_.stages) stage.record.emplace();
  for (const PlannedStage& stage : plan_.stages) {
    std::filesystem::create_directories(folder_ / stage.id);
    write_text(folder_ / (stage.id + "/" + std::string(stage.row->result)),
               stage.id == "map"
                   ? R"({"gamma": {"value": 4}, "readings": []})"
                   : R"({"model": "m", "solid_height": {"value": 4, "unit": "D"}, "answer": {"why": "of )" + stage.id +
                         R"("}, "window": {"low": 1, "high": 2}})");
  }
  write();
  const auto count = [&](const std::string& words) {
    std::size_t found = 0;
    for (std::size_t at = page_.find(words); at != std::string::npos; at = page_.find(words, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("aria-label=\"the answer\""), 1U);
  EXPECT_THAT(between("aria-label=\"the answer\"", "</section>"), HasSubstr("<p>Of f</p>"));
  EXPECT_EQ(count("<dt>height of the solid, by m alone</dt>"), 1U);
  EXPECT_EQ(count("<h2>Fit (f)</h2>"), 1U);
  EXPECT_EQ(count("<h2>Fit (g)</h2>"), 1U);
  EXPECT_EQ(count("<h2>Γ → T/T_c (map)</h2>"), 1U);
  EXPECT_LT(page_.find("the answer"), page_.find("<h2>Fit (f)</h2>"));
  EXPECT_LT(page_.find("<h2>Fit (f)</h2>"), page_.find("<h2>Fit (g)</h2>"));
  EXPECT_LT(page_.find("<h2>Fit (g)</h2>"), page_.find("<h2>Γ → T/T_c (map)</h2>"));
  EXPECT_LT(page_.find("<h2>Γ → T/T_c (map)</h2>"), page_.find("<h2>Stages</h2>"));
  EXPECT_THAT(summary_, HasSubstr("**f**: No temperature can be determined: of f \n\n**g**: "));
  EXPECT_EQ(terminal_text(plan_, outcome_),
            "f: No temperature can be determined: of f \ng: No temperature can be determined: of g \n");
}

TEST_F(ReportPage, SaysHowTheRunEnded) {
  for (const auto& [code, line, word] :
       {std::tuple(exit_ok, "<p class=\"soft\">finished</p>", "**Finished**"),
        {exit_check_failed, "<p class=\"bad\">finished, but a check failed</p>", "**A check failed**"},
        {exit_interrupted, "<p class=\"bad\">interrupted</p>", "**Interrupted**"},
        {exit_stage_failed, "<p class=\"bad\">stopped</p>", "**Stopped**"}}) {
    read();
    outcome_.code = code;
    if (code == exit_stage_failed) outcome_.error = "no <disk>";
    write();
    EXPECT_THAT(page_, HasSubstr(line));
    EXPECT_THAT(summary_, HasSubstr(std::string("# a\\_bed\n\n") + word + "\n\n"));
    EXPECT_EQ(page_.find("Why the run stopped</strong>no &lt;disk&gt;") != std::string::npos,
              code == exit_stage_failed);
    EXPECT_EQ(summary_.find("> no &lt;disk>\n") != std::string::npos, code == exit_stage_failed);
  }
}

// Without results of its stages: published numbers are not measured, and the table of the terminal has columns that are
// as wide as its longest label, 24 and 14 letters.
TEST_F(ReportPage, HasPublishedAndAssumedNumbers) {
  read(R"("description": "why & what", "report": { "title": "T_c", "published": [
      { "number": "/map/diameter", "label": "a long label", "value": "1.5 mm", "place": "Fig. 2" },
      { "number": "/map/gamma", "label": "b", "value": "2", "beside_answer": true },
      { "number": "/map/gamma", "label": "c", "value": "3" } ],
    "assumed": [ { "input": "/stages/map/frequency", "why": "not printed" },
                 { "input": "/stages/map/restitution", "why": "none" }, { "input": "/stages/map/gamma", "why": "a guess" } ] },)");
  outcome_.wall_seconds = 100;
  outcome_.stages[1].state = StageState::ran;
  outcome_.stages[1].cost.emplace().wall_seconds = 2.5;
  outcome_.warnings = {"one"};
  write();
  EXPECT_EQ(terminal_text(plan_, outcome_),
            "\nnumber       ours                     published      verdict\n"
            "a long label –                        1.5 mm         not measured\n"
            "b            –                        2              not measured\n"
            "c            –                        3              not measured\n\n");
  const std::string beside = between("numbers beside the answer", "</section>");
  EXPECT_THAT(beside,
              HasSubstr("<dt>a long label</dt><dd>– <span class=\"tag computed\">computed</span></dd></div>\n<div><dt>"
                        "published value</dt><dd>1.5 mm <span class=\"tag published\">published</span> <span class=\""
                        "verdict bad\">not measured</span></dd>"));
  EXPECT_THAT(beside, HasSubstr("<dt>b</dt>"));
  EXPECT_THAT(beside, Not(HasSubstr("<dt>c</dt>")));
  EXPECT_THAT(between("<h2>Comparison with published numbers</h2>", "</table>"), HasSubstr(">Fig. 2</td>"));
  const std::string assumed = between("<h2>Assumed inputs</h2>", "</table>");
  EXPECT_THAT(assumed,
              HasSubstr("<code>/stages/map/frequency</code></td><td data-label=\"value\" class=\"number\">20 Hz "));
  EXPECT_THAT(assumed,
              HasSubstr("<code>/stages/map/restitution</code></td><td data-label=\"value\" class=\"number\">– "));
  EXPECT_THAT(assumed, HasSubstr("<code>/stages/map/gamma</code></td><td data-label=\"value\" class=\"number\">4 "));
  EXPECT_THAT(page_, HasSubstr("<h2>What was done</h2>\n<p>why &amp; what</p>\n"));
  EXPECT_THAT(page_, HasSubstr("<title>T_c</title>"));
  EXPECT_THAT(page_, HasSubstr("<h1>T<sub>c</sub></h1>"));
  EXPECT_THAT(summary_, HasSubstr("# T\\_c\n\n**Finished**\n\n\n## Comparison with published numbers\n\n"
                                  "| number | ours | published | verdict |\n|---|---|---|---|\n"
                                  "| a long label | – | 1.5 mm | not measured |\n"));
  EXPECT_THAT(summary_,
              HasSubstr("\n## Warnings\n\n- one\n\n## Stages\n\n| stage | kind | |\n|---|---|---|\n| map | map | "));
  EXPECT_THAT(summary_, HasSubstr("\n<!-- times -->\nTime: 1 min 40 s; a-bed-of-14-xx 2.5 s\n<!-- /times -->\n"));
}

// --- crate.hpp

std::map<std::string, Json> entities_of(const Json& crate) {
  std::map<std::string, Json> found;
  for (const Json& entity : crate["@graph"]) found.emplace(entity["@id"].get<std::string>(), entity);
  return found;
}
std::string names_of(const Json& references) {
  std::string all;
  for (const Json& one : references) all += (all.empty() ? "" : " ") + one["@id"].get<std::string>();
  return all;
}

// Which entity is made from which, by name; files with their size, hash and kind.
TEST_F(ReportPage, HasItsCrate) {
  read();
  const auto add = [&](std::size_t stage, const std::string& name, std::uint64_t bytes) {
    if (!outcome_.stages[stage].record) outcome_.stages[stage].record.emplace();
    outcome_.stages[stage].record->outputs.push_back({.file = name, .bytes = bytes, .fast = "", .sha256 = "s" + name});
  };
  add(0, "a b#c%.csv", 12), add(1, "t.extxyz.zst", 5), add(2, "fit.json", 6);
  for (const char* page : {"report.html", "summary.json"}) write_text(folder_ / page, "x");
  std::map<std::string, Json> found = entities_of(crate_json(plan_, outcome_));
  EXPECT_EQ(found.at("map/a%20b%23c%25.csv"),
            Json::parse(R"({"@id": "map/a%20b%23c%25.csv", "@type": "File", "name": "map/a b#c%.csv",
                            "encodingFormat": "text/csv", "contentSize": "12", "sha256": "sa b#c%.csv"})"));
  EXPECT_EQ(found.at("a-bed-of-14-xx/t.extxyz.zst")["encodingFormat"], "application/zstd");
  EXPECT_EQ(names_of(found.at("map/")["hasPart"]), "map/a%20b%23c%25.csv");
  EXPECT_EQ(found.at("map/")["description"],
            "results of the stage \"map\" (map: " + std::string(plan_.stages[0].row->summary) + ")");
  EXPECT_EQ(found.at("#run-map"), Json::parse(R"x({"@id": "#run-map", "@type": "CreateAction", "name": "map (map)",
                             "instrument": {"@id": "#shakebed"}, "object": [{"@id": "resolved.json"}],
                             "result": {"@id": "map/"}})x"));
  EXPECT_EQ(found.at("#run-a-bed-of-14-xx")["description"], "seed 7");
  EXPECT_EQ(found.at("#run-a-bed-of-14-xx")["name"], "a-bed-of-14-xx (simulate)");
  EXPECT_EQ(names_of(found.at("#run-a-fit-of-15-xxx")["object"]), "resolved.json a-bed-of-14-xx/");
  EXPECT_FALSE(found.contains("figure/")) << "it has not run";
  const Json root = found.at("./");
  EXPECT_EQ(root["name"], "a_bed");
  EXPECT_EQ(root["description"], "Results of the shakebed recipe \"a_bed\": see report.html.");
  EXPECT_EQ(root["mainEntity"]["@id"], "report.html");
  EXPECT_EQ(root["license"]["@id"], "#licence");
  EXPECT_EQ(names_of(root["hasPart"]), "report.html summary.json manifest.json map/ a-bed-of-14-xx/ a-fit-of-15-xxx/");
  EXPECT_EQ(names_of(root["mentions"]), "#run-map #run-a-bed-of-14-xx #run-a-fit-of-15-xxx");
  EXPECT_EQ(found.at("report.html")["description"], "all results on one page, which needs no network");
  EXPECT_FALSE(found.at("report.html").contains("sha256")) << "it holds times";
  EXPECT_FALSE(found.contains("resolved.json")) << "there is none";
  EXPECT_EQ(found.size(), 2 + 2 + 3 + 3 * 3U);  // descriptor, root; program, licence; pages; file, folder, action
  // What each ending means.
  for (const auto& [name, type] : {std::pair("x.json", "application/json"),
                                   {"x.svg", "image/svg+xml"},
                                   {"x.pdf", "application/pdf"},
                                   {"x.png", "image/png"},
                                   {"x.html", "text/html"},
                                   {"x.md", "text/markdown"},
                                   {"x.xml", "application/xml"},
                                   {"x.txt", "text/plain"},
                                   {"x.dat", "text/plain"},
                                   {"x.gp", "text/plain"},
                                   {"x.extxyz", "chemical/x-xyz"},
                                   {"x", "application/octet-stream"}}) {
    outcome_.stages[0].record->outputs = {{.file = name, .bytes = 1, .fast = "", .sha256 = ""}};
    EXPECT_EQ(entities_of(crate_json(plan_, outcome_)).at(std::string("map/") + name)["encodingFormat"], type) << name;
  }
  read(R"("description": "why it was done", "report": { "title": "A title" }, )");
  std::filesystem::remove(folder_ / "report.html");
  const Json titled = entities_of(crate_json(plan_, outcome_)).at("./");
  EXPECT_EQ(titled["name"], "A title");
  EXPECT_EQ(titled["description"], "why it was done");
  EXPECT_FALSE(titled.contains("mainEntity"));
}

// A file of the user's that two stages read is named once, and both were made from it.
TEST_F(ReportPage, CrateNamesFilesOfTheUserOnce) {
  write_text(folder_ / "p q.csv", "height,number_density\n1,1\n2,0.5\n");
  write_text(folder_ / "r.csv", "height,number_density\n1,1\n2,0.5\n");
  read_recipe(R"({ "name": "three", "stages": [ { "stage": "fit", "id": "f", "profile": "p q.csv" },
      { "stage": "fit", "id": "g", "profile": "r.csv" }, { "stage": "fit", "id": "h", "profile": "p q.csv" } ] })");
  for (StageOutcome& stage : outcome_.stages) stage.record.emplace();
  const auto found = entities_of(crate_json(plan_, outcome_));
  EXPECT_EQ(names_of(found.at("#run-f")["object"]), "resolved.json #input-1-p%20q.csv");
  EXPECT_EQ(names_of(found.at("#run-g")["object"]), "resolved.json #input-2-r.csv");
  EXPECT_EQ(names_of(found.at("#run-h")["object"]), "resolved.json #input-1-p%20q.csv");
  EXPECT_EQ(found.at("#input-1-p%20q.csv")["name"], "p q.csv");
  EXPECT_EQ(found.at("#input-2-r.csv")["name"], "r.csv");
  EXPECT_EQ(found.size(), crate_json(plan_, outcome_)["@graph"].size()) << "each once";
}

}  // namespace
