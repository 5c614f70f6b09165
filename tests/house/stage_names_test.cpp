// What runs and shows stages knows none of them by name: it asks the stage's row (pipelines/stages/stage.hpp).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <string>
#include <vector>

#include "tests/house/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using shakebed::tests::text_of;

// Of every pipelines/stages/<name>.cpp with a row.
std::vector<std::string> stage_names(const fs::path& root) {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(root / "pipelines/stages")) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() == ".cpp" &&
        text_of(entry.path()).find("\nStageRow " + name + "_stage(") != std::string::npos)
      names.push_back(name);
  }
  return names;
}

TEST(StageNames, StandInTheStagesAlone) {
  const fs::path root = SHAKEBED_SOURCE_DIR;
  const std::vector<std::string> names = stage_names(root);
  ASSERT_GE(names.size(), 12u);
  std::string any;
  for (const std::string& name : names) any += (any.empty() ? "" : "|") + name;
  const std::regex literal("[^\\\\]\"(" + any + ")\"");  // but not the \"simulate\" of an example in a message
  std::vector<std::string> found;
  for (const char* folder : {"pipelines/runner", "pipelines/report"}) {
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder)) {
      if (!entry.is_regular_file()) continue;
      const std::string text = text_of(entry.path());
      for (std::sregex_iterator hit(text.begin(), text.end(), literal), end; hit != end; ++hit) {
        if (entry.path().extension() == ".js" && hit->str(1) == "figure") continue;  // the element of HTML
        found.push_back(entry.path().filename().string() + ": " + hit->str(1));
      }
    }
  }
  EXPECT_THAT(found, testing::IsEmpty());
}

}  // namespace
