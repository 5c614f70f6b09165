// The stored beds behind the posterior of the bed of Clement and Rajchenbach are those of the program.
#include <gtest/gtest.h>

#include <cmath>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

using pipelines::Json;
using pipelines::read_json;

const std::string project = SHAKEBED_SOURCE_DIR;

// The first beds of the design, run again: to the six digits that are stored (another machine's chaos would show).
TEST(Inference, RunsTheStoredBedsAgain) {
  ScratchFolder folder;
  const std::string recipe = project + "/pipelines/recipes/clement-rajchenbach/infer.json";
  const ProgramResult result = run_shakebed(
      {"run", recipe, "--out", "out", "--jobs", "2", "--set", "/stages/posterior/stored=\"\"", "--set",
       "/stages/posterior/first=24", "--set", "/stages/posterior/rounds=0", "--set", "/stages/posterior/best=0"},
      folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const Json again = read_json(folder / "out/posterior/beds.json")["beds"];
  const Json stored =
      read_json(project + "/reference-data/quinn-hong-2000/measured/clement-rajchenbach-beds.json")["beds"];
  ASSERT_EQ(again.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i) {
    EXPECT_EQ(again[i]["values"], stored[i]["values"]);
    ASSERT_EQ(again[i]["numbers"].size(), stored[i]["numbers"].size());
    for (std::size_t k = 0; k < again[i]["numbers"].size(); ++k) {
      const Json &one = again[i]["numbers"][k], &other = stored[i]["numbers"][k];
      ASSERT_EQ(one.is_null(), other.is_null());
      if (one.is_number()) {
        EXPECT_NEAR(one.get<double>(), other.get<double>(), 1e-5 * std::abs(other.get<double>()) + 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace shakebed::tests
