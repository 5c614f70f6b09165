// The arrows of the house: what includes what, between rooms and between the folders of a room.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "tests/house/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

// The declared order, from the bottom to the top: a file includes files of its own folder and of folders further up in
// this table, in rooms that its room may use.
struct Room {
  std::string name;
  std::vector<std::string> uses;     // rooms below
  std::vector<std::string> folders;  // from the bottom to the top; "" is the room itself
};
const std::vector<Room> house = {
    {"statistics", {}, {""}},
    {"sim", {"statistics"}, {"scene", "engine", "measure"}},
    {"ingest", {"statistics"}, {"frames", "calibrate", "find", "profile", "synthetic"}},
    {"fit", {"statistics"}, {"theory", "profile_fit", "map", "audit", "inference"}},
    {"pipelines", {"statistics", "sim", "ingest", "fit"}, {"formats", "live", "stages", "runner", "report", "cli"}},
};

// Libraries of others, and the rooms that may include them.
struct Library {
  std::string name, header;  // a regular expression
  std::vector<std::string> rooms;
};
const std::vector<Library> libraries = {
    {"OpenCV", "opencv.*", {"ingest"}},
    {"GSL and Eigen", "(gsl|Eigen)/.*", {"fit"}},
    {"nlohmann-json, CLI11 and spdlog", "(nlohmann|CLI|spdlog)/.*", {"pipelines"}},
};

// Headers that the build writes.
const std::set<std::string> generated = {"pipelines/version.hpp"};

struct Include {
  std::string file, header;
  bool of_project = false;  // "header" rather than <header>
};

std::vector<Include> includes_of(const fs::path& root) {
  static const std::regex line(R"(\s*#\s*include\s*([<"])([^>"]+)[>"].*)");
  std::vector<Include> found;
  for (const Room& room : house) {
    if (!fs::is_directory(root / room.name)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room.name)) {
      const std::string extension = entry.path().extension().string();
      if (extension != ".hpp" && extension != ".cpp") continue;
      std::ifstream stream(entry.path());
      std::smatch match;
      for (std::string text; std::getline(stream, text);) {
        if (std::regex_match(text, match, line))
          found.push_back({entry.path().lexically_relative(root).generic_string(), match[2], match[1] == "\""});
      }
    }
  }
  return found;
}

const Room* room_of(const std::string& path) {
  const std::string name = path.substr(0, path.find('/'));
  const auto found = std::find_if(house.begin(), house.end(), [&](const Room& room) { return room.name == name; });
  return found == house.end() ? nullptr : &*found;
}

// "sim/engine" of "sim/engine/start.hpp".
std::string folder_of(const std::string& path) { return fs::path(path).parent_path().generic_string(); }

// Its height within its room; -1: the table does not name it.
std::ptrdiff_t height(const Room& room, const std::string& folder) {
  const std::string name = folder == room.name ? "" : folder.substr(room.name.size() + 1);
  const auto found = std::find(room.folders.begin(), room.folders.end(), name);
  return found == room.folders.end() ? -1 : found - room.folders.begin();
}

std::string problem_of(const Include& include) {
  const auto says = [&](const std::string& why) { return include.file + " includes " + include.header + ": " + why; };
  const Room& own = *room_of(include.file);
  for (const Library& library : libraries) {
    if (std::regex_match(include.header, std::regex(library.header)) &&
        std::find(library.rooms.begin(), library.rooms.end(), own.name) == library.rooms.end())
      return says(library.name + " belongs to " + library.rooms.front());
  }
  if (!include.of_project || generated.contains(include.header)) return "";
  const Room* other = room_of(include.header);
  if (other == nullptr) return says("no room may include what is outside of the rooms");
  if (other != &own)
    return std::find(own.uses.begin(), own.uses.end(), other->name) == own.uses.end()
               ? says(own.name + " may not use " + other->name)
               : "";
  const std::ptrdiff_t from = height(own, folder_of(include.file)), to = height(own, folder_of(include.header));
  if (from < 0 || to < 0) return says("a folder that the table of this test does not name");
  return to > from ? says("an arrow up") : "";
}

std::vector<std::string> problems_of(const std::vector<Include>& includes) {
  std::vector<std::string> problems;
  for (const Include& include : includes) {
    if (std::string problem = problem_of(include); !problem.empty()) problems.push_back(std::move(problem));
  }
  return problems;
}

// Folders, each after all it includes. What is left in `circle` includes itself by way of others.
struct Order {
  std::vector<std::string> folders, circle;
};
Order order_of(const std::vector<Include>& includes) {
  std::map<std::string, std::set<std::string>> below;
  for (const Include& include : includes) {
    auto& own = below[folder_of(include.file)];
    if (!include.of_project || room_of(include.header) == nullptr || generated.contains(include.header)) continue;
    const std::string folder = folder_of(include.header);
    below.try_emplace(folder);
    if (folder != folder_of(include.file)) own.insert(folder);
  }
  Order order;
  while (!below.empty()) {
    const auto lowest =
        std::find_if(below.begin(), below.end(), [](const auto& entry) { return entry.second.empty(); });
    if (lowest == below.end()) break;
    const std::string folder = lowest->first;
    order.folders.push_back(folder);
    below.erase(lowest);
    for (auto& [name, rest] : below) rest.erase(folder);
  }
  for (const auto& [name, rest] : below) order.circle.push_back(name);
  return order;
}

TEST(Arrows, GoDownOnly) {
  const std::vector<Include> includes = includes_of(SHAKEBED_SOURCE_DIR);
  ASSERT_GT(includes.size(), 500u) << "the sources are not where they should be";
  EXPECT_THAT(problems_of(includes), IsEmpty());
  const Order order = order_of(includes);
  EXPECT_THAT(order.circle, IsEmpty()) << "these folders include one another";
  std::printf("from the bottom to the top:");
  for (const std::string& folder : order.folders) std::printf(" %s", folder.c_str());
  std::printf("\n");
}

// A tree of files made for one test.
class FakeTree : public testing::Test {
 protected:
  void write(const std::string& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  std::vector<std::string> problems() { return problems_of(includes_of(root_)); }
  std::string only_problem() {
    const auto all = problems();
    return all.size() == 1 ? all.front() : std::to_string(all.size()) + " problems";
  }

  const shakebed::tests::TemporaryFolder folder_;
  const fs::path& root_ = folder_.path();
};

TEST_F(FakeTree, ArrowsDownAreGood) {
  write("sim/engine/a.hpp", "#include \"sim/scene/b.hpp\"\n#include \"statistics/c.hpp\"\n#include <vector>\n");
  write("pipelines/cli/d.cpp", "#include \"pipelines/version.hpp\"\n#include \"sim/engine/a.hpp\"\n");
  EXPECT_THAT(problems(), IsEmpty());
}

TEST_F(FakeTree, AnArrowUpWithinARoomIsFound) {
  write("pipelines/runner/run.cpp", "#  include \"pipelines/report/report.hpp\"\n");
  EXPECT_EQ(only_problem(), "pipelines/runner/run.cpp includes pipelines/report/report.hpp: an arrow up");
}

TEST_F(FakeTree, RoomsBesideEachOtherAreFound) {
  write("sim/engine/a.cpp", "#include \"fit/theory/value.hpp\"\n");
  EXPECT_EQ(only_problem(), "sim/engine/a.cpp includes fit/theory/value.hpp: sim may not use fit");
}

TEST_F(FakeTree, TestsAreNoPartOfARoom) {
  write("fit/map/a.cpp", "#include \"tests/fit/b.hpp\"\n");
  EXPECT_EQ(only_problem(), "fit/map/a.cpp includes tests/fit/b.hpp: no room may include what is outside of the rooms");
}

TEST_F(FakeTree, AFolderThatNobodyDeclaredIsFound) {
  write("sim/new/a.cpp", "#include \"sim/scene/b.hpp\"\n");
  EXPECT_EQ(only_problem(),
            "sim/new/a.cpp includes sim/scene/b.hpp: a folder that the table of this test does not name");
}

TEST_F(FakeTree, LibrariesStayInTheirRooms) {
  write("sim/engine/a.cpp", "#include <opencv2/core.hpp>\n");
  EXPECT_EQ(only_problem(), "sim/engine/a.cpp includes opencv2/core.hpp: OpenCV belongs to ingest");
}

TEST_F(FakeTree, ACircleOfFoldersIsFound) {
  write("sim/scene/a.hpp", "#include \"sim/engine/b.hpp\"\n");
  write("sim/engine/b.hpp", "#include \"sim/scene/a.hpp\"\n");
  write("sim/measure/c.hpp", "#include \"statistics/d.hpp\"\n");
  const Order order = order_of(includes_of(root_));
  EXPECT_THAT(order.circle, testing::ElementsAre("sim/engine", "sim/scene"));
  EXPECT_THAT(order.folders, testing::ElementsAre("statistics", "sim/measure"));
}

}  // namespace
