// The fingerprint of a stage's code (pipelines/stage_code.cmake): what changes it and what does not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/house/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using shakebed::tests::text_of;
using testing::IsEmpty;

// stage_code.cmake, run on a tree: stage → fingerprint, stage → files.
struct StageCode {
  int exit_code = 0;
  std::string said;
  std::map<std::string, std::string> fingerprints;
  std::map<std::string, std::set<std::string>> files;
};
StageCode stage_code_of(const fs::path& tree, const fs::path& work) {
  const std::string command = std::string(SHAKEBED_CMAKE) + " -DSOURCE_DIR='" + tree.string() + "' -DOUTPUT='" +
                              (work / "out.cpp").string() + "' -DLIST='" + (work / "list.txt").string() + "' -P '" +
                              SHAKEBED_SOURCE_DIR "/pipelines/stage_code.cmake' > '" + (work / "said.txt").string() +
                              "' 2>&1";
  StageCode code;
  code.exit_code = std::system(command.c_str());
  code.said = text_of(work / "said.txt");
  if (code.exit_code != 0) return code;
  std::istringstream lines(text_of(work / "out.cpp"));
  for (std::string line; std::getline(lines, line);) {
    if (line.find("if (stage == ") == std::string::npos) continue;
    std::vector<std::string> quoted;
    for (std::size_t begin = line.find('"'); begin != std::string::npos; begin = line.find('"', begin)) {
      const std::size_t end = line.find('"', begin + 1);
      quoted.push_back(line.substr(begin + 1, end - begin - 1));
      begin = end + 1;
    }
    code.fingerprints[quoted.at(0)] = quoted.at(1);
  }
  std::ifstream list(work / "list.txt");
  for (std::string stage, file; list >> stage >> file;) code.files[stage].insert(file);
  return code;
}

// Two stages: "bed" with a simulator, "heat" with a fit that stands in two files.
class StageCodeOfATree : public testing::Test {
 protected:
  StageCodeOfATree() {
    fs::create_directories(work_);
    write("pipelines/stages/bed.cpp",
          "#include \"pipelines/stages/bed.hpp\"\n#include \"sim/engine/run.hpp\"\n"
          "StageRow bed_stage() { return {}; }\n");
    write("pipelines/stages/bed.hpp", "StageRow bed_stage();\n");
    write("pipelines/stages/bed_report.cpp", "#include \"pipelines/stages/bed.hpp\"\nint page = 1;\n");
    write("sim/engine/run.hpp", "void run();\n");
    write("sim/engine/run_scene.cpp", "// implements: sim/engine/run.hpp\nvoid run() {}\n");
    write("pipelines/stages/heat.cpp", "#include \"fit/line.hpp\"\nStageRow heat_stage() { return {}; }\n");
    write("fit/line.hpp", "double slope();\n");
    write("fit/line.cpp",
          "double slope() { return 2 * 10'000.0; }  // per second\n"
          "const char* place = \"http://x.org//a\";\n");
    write("pipelines/stages/helper.cpp", "int helper;\n");
    write("pipelines/runner/run.hpp", "int jobs;\n");
    before_ = stage_code_of(root_, work_);
  }

  void write(const std::string& file, const std::string& text) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text;
  }
  // The stages whose fingerprint is another one now.
  std::set<std::string> changed() {
    const StageCode after = stage_code_of(root_, work_);
    EXPECT_EQ(after.exit_code, 0) << after.said;
    std::set<std::string> stages;
    for (const auto& [stage, fingerprint] : after.fingerprints) {
      if (before_.fingerprints[stage] != fingerprint) stages.insert(stage);
    }
    return stages;
  }

  const shakebed::tests::TemporaryFolder folder_;
  const fs::path root_ = folder_.path() / "tree", work_ = folder_.path() / "work";
  StageCode before_;
};

TEST_F(StageCodeOfATree, HoldsWhatTheStageIsMadeOf) {
  ASSERT_EQ(before_.exit_code, 0) << before_.said;
  EXPECT_THAT(before_.files["bed"],
              testing::UnorderedElementsAre("pipelines/stages/bed.cpp", "pipelines/stages/bed.hpp",
                                            "sim/engine/run.hpp", "sim/engine/run_scene.cpp"));
  EXPECT_THAT(before_.files["heat"],
              testing::UnorderedElementsAre("pipelines/stages/heat.cpp", "fit/line.hpp", "fit/line.cpp"));
  EXPECT_EQ(before_.fingerprints.size(), 2u) << "a file without a row is no stage";
  EXPECT_NE(before_.fingerprints["bed"], before_.fingerprints["heat"]);
}

TEST_F(StageCodeOfATree, ChangesWithTheBehaviourOfThatStageAlone) {
  write("fit/line.cpp",
        "double slope() { return 3 * 10'000.0; }  // per second\n"
        "const char* place = \"http://x.org//a\";\n");
  EXPECT_THAT(changed(), testing::ElementsAre("heat"));
}

TEST_F(StageCodeOfATree, ChangesWithAFileThatImplementsAHeaderOfAnotherName) {
  write("sim/engine/run_scene.cpp", "// implements: sim/engine/run.hpp\nvoid run() { throw 1; }\n");
  EXPECT_THAT(changed(), testing::ElementsAre("bed"));
}

TEST_F(StageCodeOfATree, SeesWhatLooksLikeACommentInsideALiteral) {
  write("fit/line.cpp",
        "double slope() { return 2 * 10'000.0; }  // per second\n"
        "const char* place = \"http://x.org//b\";\n");
  EXPECT_THAT(changed(), testing::ElementsAre("heat"));
  write("fit/line.cpp",
        "double slope() { return 2 * 10'000.0; }  // per second\n"
        "const char* place = \"http://x.org// a\";\n");
  EXPECT_THAT(changed(), testing::ElementsAre("heat"));
}

TEST_F(StageCodeOfATree, StaysWhenOnlyCommentsAndLayoutChange) {
  write("fit/line.cpp",
        "// Anew: \"what\" it's for.\n\ndouble slope() {\n  return 2 *\n         10'000.0;  // each second\n}\n"
        "const char* place = \"http://x.org//a\";  // 'home'\n");
  write("sim/engine/run.hpp", "// Runs it.\nvoid run();\n");
  EXPECT_THAT(changed(), IsEmpty());
}

TEST_F(StageCodeOfATree, StaysWhenWhatShowsOrRunsTheStageChanges) {
  write("pipelines/stages/bed_report.cpp", "#include \"pipelines/stages/bed.hpp\"\nint page = 2;\n");
  write("pipelines/runner/run.hpp", "int jobs = 2;\n");
  EXPECT_THAT(changed(), IsEmpty());
}

TEST_F(StageCodeOfATree, MayNotReachWhatRunsIt) {
  write("pipelines/stages/heat.cpp", "#include \"pipelines/runner/run.hpp\"\nStageRow heat_stage() { return {}; }\n");
  const StageCode code = stage_code_of(root_, work_);
  EXPECT_NE(code.exit_code, 0);
  EXPECT_THAT(code.said, testing::HasSubstr("pipelines/runner/run.hpp"));
}

TEST_F(StageCodeOfATree, AHeaderThatIsNotThereCannotBeImplemented) {
  write("sim/engine/run_scene.cpp", "// implements: sim/engine/ran.hpp\nvoid run() {}\n");
  EXPECT_NE(stage_code_of(root_, work_).exit_code, 0);
}

TEST_F(StageCodeOfATree, IsWrittenOnlyWhenItChanged) {
  const auto written = fs::last_write_time(work_ / "out.cpp");
  fs::last_write_time(work_ / "out.cpp", written - std::chrono::hours(1));
  EXPECT_THAT(changed(), IsEmpty());
  EXPECT_EQ(fs::last_write_time(work_ / "out.cpp"), written - std::chrono::hours(1));
  write("fit/line.hpp", "float slope();\n");
  EXPECT_THAT(changed(), testing::ElementsAre("heat"));
  EXPECT_NE(fs::last_write_time(work_ / "out.cpp"), written - std::chrono::hours(1));
}

// The project itself: no code that computes stands outside of every fingerprint.
TEST(StageCodeOfTheProject, HoldsEveryFileThatComputes) {
  const fs::path root = SHAKEBED_SOURCE_DIR;
  const shakebed::tests::TemporaryFolder work;
  const StageCode code = stage_code_of(root, work.path());
  ASSERT_EQ(code.exit_code, 0) << code.said;
  std::set<std::string> held;
  for (const auto& [stage, files] : code.files) held.insert(files.begin(), files.end());
  std::vector<std::string> outside;
  for (const char* room : {"statistics", "sim", "ingest", "fit"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room)) {
      const std::string file = entry.path().lexically_relative(root).generic_string();
      if (entry.path().extension() == ".cpp" && !held.contains(file)) outside.push_back(file);
    }
  }
  // For those who use the library: no stage measures by it.
  for (const char* file : {"sim/measure/measured_bed.cpp", "ingest/profile/photographs.cpp"}) std::erase(outside, file);
  EXPECT_THAT(outside, IsEmpty()) << "name the header that it implements: // implements: <header>";
  // A change in fit/ is none of the bed's, nor of its photographs'. Several beds together have errors by Student's t.
  for (const char* stage : {"simulate", "render", "extract"}) {
    for (const std::string& file : code.files.at(stage))
      EXPECT_FALSE(file.starts_with("fit/") && !file.starts_with("fit/profile_fit/chances.")) << stage << ": " << file;
  }
  EXPECT_TRUE(code.files.at("fit").contains("fit/profile_fit/fit_profile.cpp"));
  EXPECT_TRUE(code.files.at("simulate").contains("sim/engine/engine_contacts.hpp"));
  EXPECT_TRUE(code.files.at("extract").contains("ingest/find/find_disks.cpp"));
}

}  // namespace
