// What the scripts of the pages are given, against the files it comes from; the metadata for repositories.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/film_viewer.hpp"
#include "pipelines/stages/frame_profiles.hpp"
#include "pipelines/stages/plot_data.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using namespace shakebed::pipelines;
using testing::HasSubstr;
using testing::Not;

std::vector<unsigned> bytes_of(const std::string& base64_text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<unsigned> bytes;
  unsigned held = 0;
  int bits = 0;
  for (const char c : base64_text) {
    if (c == '=') break;
    held = (held << 6U) | static_cast<unsigned>(digits.find(c));
    bits += 6;
    if (bits >= 8) bits -= 8, bytes.push_back((held >> static_cast<unsigned>(bits)) & 0xFFU);
  }
  return bytes;
}

TEST(PlotData, HoldsAxesBandsAndSeriesOfThePicture) {
  Picture picture{.x_label = "height z/D", .y_label = "φ", .x_low = 0.0, .bands = {{2, 5}}, .logarithmic_y = true};
  picture.series.push_back({"T_c", Series::Style::points, 2, {1, 2.5}, {3, 4}, {0.5, 0.25}, false, true});
  picture.series.push_back({"curve", Series::Style::dashed, 1, {0, 1}, {1, NAN}, {}});
  picture.lower.push_back({"T_c", Series::Style::points, 2, {1}, {-0.125}, {}});
  const Json data = plot_data(picture);
  EXPECT_EQ(data["xlim"], Json::parse("[0.0, null]"));
  EXPECT_EQ(data["ylim"], Json::parse("[null, null]"));
  EXPECT_EQ(data["log"], Json::parse("[false, true]"));
  EXPECT_EQ(data["bands"], Json::parse("[[2.0, 5.0]]"));
  ASSERT_EQ(data["series"].size(), 2U);
  EXPECT_EQ(data["series"][0]["e"], Json::parse("[0.5, 0.25]"));
  EXPECT_EQ(data["series"][0]["markup"], true);
  EXPECT_EQ(data["series"][1]["style"], "dashed");
  EXPECT_EQ(data["series"][1]["y"], Json::parse("[1.0, null]")) << "what is no number is none in JSON";
  EXPECT_FALSE(data["series"][1].contains("e"));
  EXPECT_EQ(data["lower"][0]["y"], Json::parse("[-0.125]"));
}

// The integral of a density over the height, times the width, is the number of disks.
TEST(FrameProfiles, HoldEveryDiskOfEachFrame) {
  const std::vector<std::vector<double>> heights{{5, 6, 7.3}, {8, 8.1}, {}};
  const Json profile = frame_profiles(heights, 4, 0, 14);
  const auto n = profile["n"].get<std::size_t>();
  const double step = profile["step"], largest = profile["largest"];
  const std::vector<unsigned> now = bytes_of(profile["now"]);
  ASSERT_EQ(now.size(), 3 * n);
  double mean = 0;
  for (std::size_t frame = 0; frame < 3; ++frame) {
    double disks = 0;
    for (std::size_t i = 0; i < n; ++i) disks += now[frame * n + i] / 255.0 * largest * step * 4;
    EXPECT_NEAR(disks, static_cast<double>(heights[frame].size()), 0.06) << "frame " << frame;  // bytes round
  }
  for (const Json& value : profile["mean"]) mean += value.get<double>() * step * 4;
  EXPECT_NEAR(mean, 5.0 / 3, 1e-3);
  EXPECT_TRUE(frame_profiles({}, 4, 0, 14).is_null());
  EXPECT_TRUE(frame_profiles(heights, 0, 0, 14).is_null());
}

// A stage's folder with a film of two frames: a hexagon about a disk, and a lone disk.
class FilmPage : public testing::Test {
 protected:
  FilmPage() {
    std::filesystem::create_directories(folder_ / "extract");
    std::string rows = "frame,x_px,y_px,radius_px,x,z,quality\n3,100,120,10,5,5,0.5\n";
    for (int k = 0; k < 6; ++k) {
      const double x = 5 + std::cos(M_PI / 3 * k), z = 5 + std::sin(M_PI / 3 * k);
      rows += "3," + std::to_string(20 * x) + "," + std::to_string(220 - 20 * z) + ",10," + std::to_string(x) + "," +
              std::to_string(z) + ",1\n";
    }
    rows += "4,0,0,5,5.1,5,0\n5,400,220,8,1,2,0.25\n";
    write_text(folder_ / "extract/disks.csv", rows);
    stage_.files = {"extract", "extract", folder_ / "extract", "extract.json"};
    stage_.result = Json{{"width", {{"value", 20.0}}}};
  }
  void film(const std::string& more = "") {
    write_text(folder_ / "extract/film.json",
               R"({"kind": "webp", "width": 400, "height": 220, "picture_width": 200, "every": 2, "of": 5, "floor": 210,
                   "frames": [3, 5], "pictures": ["AA==", "AAAA"])" +
                   more + "}");
  }
  Json data() const {
    const std::string page = film_viewer(stage_);
    const std::string open = "class=\"film-data\">";
    const std::size_t begin = page.find(open) + open.size();
    return Json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  }
  ScratchFolder folder_;
  FinishedStage stage_;
};

TEST_F(FilmPage, HasEveryDiskOfItsFrames) {
  film();
  const Json found = data();
  EXPECT_EQ(found["counts"], Json::parse("[7, 1]")) << "frame 4 is not among those shown";
  const std::vector<unsigned> disks = bytes_of(found["disks"]);
  ASSERT_EQ(disks.size(), 8U * 10U);
  const auto x = [&](std::size_t i) { return (disks[10 * i] + 256 * disks[10 * i + 1]) / 65535.0 * 400; };
  const auto y = [&](std::size_t i) { return (disks[10 * i + 2] + 256 * disks[10 * i + 3]) / 65535.0 * 220; };
  EXPECT_NEAR(x(0), 100, 0.01);
  EXPECT_NEAR(y(0), 120, 0.01);
  EXPECT_NEAR(x(7), 400, 0.01);
  EXPECT_DOUBLE_EQ(found["radius"].get<double>(), 10);
  EXPECT_NEAR(disks[10 * 7 + 4] / 255.0 * 10, 8, 0.03);
  EXPECT_NEAR(disks[5] / 254.0, 0.5, 0.003);
  EXPECT_EQ(disks[6], 254U) << "the middle of a hexagon: |psi_6| = 1";
  EXPECT_EQ(disks[10 * 7 + 6], 0U) << "a disk without neighbours: |psi_6| = 0";
  EXPECT_EQ(disks[7], 255U) << "no probabilities without disk_details.csv";
  EXPECT_EQ(disks[8], 255U) << "no steps without velocities";
  EXPECT_EQ(disks[9], 255U);
  EXPECT_THAT(film_viewer(stage_), HasSubstr("2 of 5 good frames (one in 2)"));
}

TEST_F(FilmPage, HasTheStepsOfDisksThatWereFollowed) {
  film();
  stage_.result["velocities"] = Json{{"linked_share", 0.9}};
  const std::vector<unsigned> disks = bytes_of(data()["disks"]);
  EXPECT_NEAR((disks[8] / 127.0 - 1) * 0.5, 0.1, 0.004) << "from (5, 5) to (5.1, 5)";
  EXPECT_NEAR((disks[9] / 127.0 - 1) * 0.5, 0.0, 0.004);
  EXPECT_EQ(disks[10 + 8], 255U) << "a disk with none near it in the next frame";
  stage_.result["velocities"] = Json{{"linked_share", 0.2}};
  EXPECT_EQ(bytes_of(data()["disks"])[8], 255U) << "most of such steps would be those of other disks";
}

TEST_F(FilmPage, HasTheProbabilityOfEveryDisk) {
  film();
  std::string rows = "frame,probability\n";
  for (int k = 0; k < 7; ++k) rows += "3," + std::to_string(0.125 * k) + "\n";
  write_text(folder_ / "extract/disk_details.csv", rows + "4,1\n5,0.5\n");
  const std::vector<unsigned> disks = bytes_of(data()["disks"]);
  for (std::size_t k = 0; k < 7; ++k)
    EXPECT_NEAR(disks[10 * k + 7] / 254.0, 0.125 * static_cast<double>(k), 0.002) << k;
  EXPECT_EQ(disks[10 * 7 + 7], 127U);
  write_text(folder_ / "extract/disk_details.csv", "frame,probability\n3,1\n");
  EXPECT_THROW(film_viewer(stage_), InputError) << "a row for every disk";
}

TEST_F(FilmPage, OffersTheTruthWhereItIsKnown) {
  film();
  EXPECT_THAT(film_viewer(stage_), Not(HasSubstr("missed and false")));
  film(R"(, "marks": [{"missed": [1.5, 2.5], "false": [3]}, {"missed": [], "false": []}])");
  EXPECT_THAT(film_viewer(stage_), HasSubstr("missed and false"));
  EXPECT_EQ(data()["marks"][0]["missed"], Json::parse("[1.5, 2.5]"));
}

// Without scripts: the first frame shown with its disks. Colours are offered where they are known.
TEST_F(FilmPage, HasAStillPictureAndItsWords) {
  film();
  const std::string page = film_viewer(stage_);
  EXPECT_THAT(page,
              HasSubstr("<svg viewBox=\"-0.5 -0.5 400 220\" role=\"img\" aria-label=\"disks found in frame 3\" "));
  EXPECT_THAT(page, HasSubstr("<image href=\"data:image/webp;base64,AA==\" x=\"-0.5\" y=\"-0.5\" width=\"400\" "
                              "height=\"220\"/>"));
  EXPECT_THAT(page, HasSubstr("<circle cx=\"100.0\" cy=\"120.0\" r=\"10.0\"/><circle cx=\"120.0\" cy=\"120.0\""));
  EXPECT_THAT(page, HasSubstr("pictures 200 px wide, compressed."));
  EXPECT_THAT(page, Not(HasSubstr("<option value=\"speed\">")));
  stage_.result["velocities"] = Json{{"linked_share", 0.5}};
  EXPECT_THAT(film_viewer(stage_), HasSubstr("<option value=\"speed\">speed</option><option value=\"none\">"));
  stage_.result["velocities"] = Json{{"linked_share", 0.49}};
  EXPECT_EQ(data()["follows"], false);
  film();
  std::string text = read_text(folder_ / "extract/film.json");
  text.replace(text.find("\"of\": 5"), 7, "\"of\": 2");
  write_text(folder_ / "extract/film.json", text);
  EXPECT_THAT(film_viewer(stage_), HasSubstr("<figcaption>All 2 good frames; pictures"));
  text.replace(text.find("\"of\": 2"), 7, "\"of\": 1");
  write_text(folder_ / "extract/film.json", text);
  EXPECT_THAT(film_viewer(stage_), HasSubstr("<figcaption>The only good frame; pictures"));
}

// Heights from the floor, or the lowest disk, to one diameter above the highest, 5 + sin 60 degrees: 0 to 7.
TEST_F(FilmPage, HasItsProfileAndScales) {
  film();
  stage_.result["diameter"] = Json{{"value", 0.003}};
  Json found = data();
  EXPECT_EQ(found["profile"]["low"], 0);
  EXPECT_EQ(found["profile"]["n"], 7 * 4 + 1);
  EXPECT_EQ(found["diameter"], 0.003);
  EXPECT_EQ(found["step"], 0.5);
  EXPECT_EQ(found["follows"], false);
  double disks = 0;
  for (const Json& density : found["profile"]["mean"]) disks += density.get<double>() * 0.25 * 20;
  EXPECT_NEAR(disks, 4, 0.02) << "7 and 1 in a bed of 20 D";
  write_text(folder_ / "extract/disks.csv",
             "frame,x_px,y_px,radius_px,x,z,quality\n3,100,120,10,5,-0.25,1\n5,100,120,12.5,5,3.5,1\n");
  found = data();
  EXPECT_EQ(found["profile"]["low"], -1);
  EXPECT_EQ(found["profile"]["n"], 6 * 4 + 1);
  EXPECT_EQ(found["radius"], 12.5);
  EXPECT_EQ(bytes_of(found["disks"])[4], 204U) << "10 of 12.5";
  stage_.result.erase("width");
  EXPECT_TRUE(data()["profile"].is_null());
  write_text(folder_ / "extract/disks.csv", "frame,x_px,y_px,radius_px,x,z,quality\n3,100,120,10,5,none,1\n");
  EXPECT_THROW(data(), InputError);
}

// A disk is followed to the nearest of the next frame where each is the other's nearest, less than 0.5 D away. Bytes
// are 127 for no step, 0 and 254 for 0.5 D.
TEST_F(FilmPage, FollowsDisksThatAreNearestToEachOther) {
  film();
  stage_.result["velocities"] = Json{{"linked_share", 1}};
  std::string rows = "frame,x_px,y_px,radius_px,x,z,quality\n";
  const auto add = [&](int frame, double x, double z) {
    rows += std::to_string(frame) + ",10,10,10," + std::to_string(x) + "," + std::to_string(z) + ",1\n";
  };
  add(3, 1, 1), add(3, 3, 1), add(3, 3.4, 1), add(3, 8, 1), add(3, 11, 1), add(3, 14, 1), add(3, 20, 1);
  // To the left and upwards; one for two, nearer to the second; one 0.49 and one 0.51 away; none; one 0.6 above, and
  // one as far to the side.
  add(4, 0.75, 1.25), add(4, 3.25, 1), add(4, 8, 0.51), add(4, 11.51, 1), add(4, 17, 1), add(4, 20, 1.6),
      add(4, 19.6, 0.8);
  add(5, 1, 1);
  write_text(folder_ / "extract/disks.csv", rows);
  const std::vector<unsigned> disks = bytes_of(data()["disks"]);
  const auto step = [&](std::size_t i) { return std::pair(disks[10 * i + 8], disks[10 * i + 9]); };
  const std::pair<unsigned, unsigned> none(255, 255);
  EXPECT_EQ(step(0), std::pair(64U, 191U));
  EXPECT_EQ(step(1), none);
  EXPECT_EQ(step(2), std::pair(89U, 127U));
  EXPECT_EQ(step(3), std::pair(127U, 3U));
  EXPECT_EQ(step(4), none);
  EXPECT_EQ(step(5), none);
  EXPECT_EQ(step(6), std::pair(25U, 76U)) << "the nearest is not the one straight above";
  EXPECT_EQ(step(7), none) << "frame 6 has no disks";
  add(6, 1.25, 1);
  write_text(folder_ / "extract/disks.csv", rows);
  EXPECT_EQ(bytes_of(data()["disks"])[10 * 7 + 8], 191U) << "half of 0.5 D to the right, although frame 7 has no disks";
}

TEST_F(FilmPage, IsLeftOutWhereTheStageKeptNoPictures) { EXPECT_EQ(film_viewer(stage_), ""); }

TEST(FigureHtml, CannotBeEndedByWhatItHolds) {
  const ScratchFolder folder;
  write_text(folder / "a.svg", "<?xml version='1.0'?>\n<svg viewBox='0 0 1 1'></svg>");
  EXPECT_THAT(figure_html(folder / "a.svg", 1, "words"), Not(HasSubstr("plot-data")));
  write_text(folder / "a.plot.json", R"({"series": [{"label": "</script><b>"}]})");
  const std::string page = figure_html(folder / "a.svg", 1, "words");
  EXPECT_THAT(page, Not(HasSubstr("</script><b>")));
  EXPECT_THAT(page, HasSubstr(R"("\u003c/script>\u003cb>")"));
}

// RO-Crate 1.1: the descriptor, one root, every name resolved, every file there.
class Crate : public testing::Test {
 protected:
  Json crate(const std::string& out) {
    write_text(folder_ / "r.json", small_recipe());
    const ProgramResult ran = run_shakebed({"run", "r.json", "--out", out}, folder_.path());
    EXPECT_TRUE(ran.exit_code == 0 || ran.exit_code == 6) << ran.err;
    return Json::parse(read_text(folder_ / (out + "/ro-crate-metadata.json")));
  }
  static void references(const Json& node, std::set<std::string>& found) {
    if (node.is_object() && node.size() == 1 && node.contains("@id")) found.insert(node["@id"].get<std::string>());
    if (node.is_structured())
      for (const Json& child : node) references(child, found);
  }
  ScratchFolder folder_;
};

TEST_F(Crate, SaysWhatWasMadeFromWhat) {
  const Json found = crate("o");
  EXPECT_EQ(found["@context"][0], "https://w3id.org/ro/crate/1.1/context");
  std::map<std::string, Json> entities;
  for (const Json& entity : found["@graph"]) {
    EXPECT_TRUE(entity.contains("@type")) << entity;
    EXPECT_TRUE(entities.emplace(entity["@id"].get<std::string>(), entity).second) << "twice: " << entity["@id"];
  }
  const Json& descriptor = entities.at("ro-crate-metadata.json");
  EXPECT_EQ(descriptor["@type"], "CreativeWork");
  EXPECT_EQ(descriptor["about"]["@id"], "./");
  EXPECT_EQ(descriptor["conformsTo"]["@id"], "https://w3id.org/ro/crate/1.1");
  const Json& root = entities.at("./");
  EXPECT_EQ(root["@type"], "Dataset");
  for (const char* key : {"name", "description", "datePublished", "license", "hasPart"})
    EXPECT_TRUE(root.contains(key)) << key;
  EXPECT_THAT(root["datePublished"].get<std::string>(), testing::MatchesRegex("[0-9]{4}-[0-9]{2}-[0-9]{2}"));
  std::set<std::string> named;
  for (const auto& [id, entity] : entities)
    for (const auto& [key, value] : entity.items()) references(value, named);
  for (const std::string& id : named)
    EXPECT_TRUE(entities.contains(id) || id.starts_with("https://")) << id << " is named and not described";
  std::size_t files = 0, actions = 0;
  for (const auto& [id, entity] : entities) {
    actions += entity["@type"] == "CreateAction";
    if (entity["@type"] != "File") continue;
    ++files;
    ASSERT_TRUE(std::filesystem::is_regular_file(folder_ / ("o/" + id))) << id;
    if (entity.contains("contentSize")) {
      EXPECT_EQ(entity["contentSize"], std::to_string(std::filesystem::file_size(folder_ / ("o/" + id)))) << id;
    }
  }
  EXPECT_GE(files, 8U);
  EXPECT_EQ(actions, Json::parse(read_text(folder_ / "o/manifest.json"))["stages"].size());
}

TEST_F(Crate, HasTheSameBytesForTheSameRun) {
  crate("o"), crate("again");
  EXPECT_EQ(read_text(folder_ / "o/ro-crate-metadata.json"), read_text(folder_ / "again/ro-crate-metadata.json"));
}

}  // namespace
