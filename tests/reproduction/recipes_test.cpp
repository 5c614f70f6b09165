// The cheapest recipes of published results, with their quick presets and seeds of their own.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

pipelines::Json run_recipe(const ScratchFolder& folder, const std::string& name, std::vector<std::string> changes,
                           const std::string& result) {
  std::vector<std::string> arguments{"reproduce", name, "--preset", "quick", "--out", "out", "--jobs", "2"};
  for (std::string& change : changes) arguments.push_back("--set"), arguments.push_back(std::move(change));
  const ProgramResult ran = run_shakebed(arguments, folder.path());
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  return ran.exit_code == 0 ? pipelines::read_json(folder / ("out/" + result)) : pipelines::Json();
}

// The grid of Gamma is 0.0015 wide at the edge, from -0.001 to 0.0005.
TEST(BouncingBallRecipe, FindsTheEdgesToItsGrid) {
  ScratchFolder folder;
  const pipelines::Json chart =
      run_recipe(folder, "bouncing-ball", {"/stages/e0/seed=101", "/stages/e5/seed=102", "/stages/e10/seed=103"},
                 "chart/chart.json");
  ASSERT_FALSE(chart.is_null());
  for (const char* disk : {"e0", "e5", "e10"}) {
    const pipelines::Json& edge = chart["doubling"][disk]["crossings"]["5e-06"];
    ASSERT_TRUE(edge["value"].is_number()) << disk;
    EXPECT_GE(edge["value"].get<double>(), -0.001) << disk;
    EXPECT_LE(edge["value"].get<double>(), 0.0005) << disk;
  }
}

// A column on a fast floor: the energy a contact brings is that of U^2, so that the rise goes as V^2. Two replicas at
// four velocities determine the exponent to some 0.1; 4 standard errors and the 0.1 of the claim.
TEST(LudingRecipe, HasAColumnThatRisesWithTheSquare) {
  ScratchFolder folder;
  const pipelines::Json scaling =
      run_recipe(folder, "luding-1994", {"/stages/columns/seed=104", "/stages/beds/seed=105"}, "scaling/scaling.json");
  ASSERT_FALSE(scaling.is_null());
  const pipelines::Json& exponent = scaling["columns"]["exponents"]["V"];
  ASSERT_TRUE(exponent.is_object());
  const double error = exponent["std_error"].get<double>();
  EXPECT_LT(error, 0.2) << "a comparison that says nothing";
  EXPECT_NEAR(exponent["value"].get<double>(), 2, 0.1 + 4 * error);
}

// Nearly elastic disks have Maxwell's exponent 2 but for what heights of different T mixed do; inelastic ones have
// less.
TEST(RouyerMenonRecipe, HasBroaderVelocitiesTheMoreIsDissipated) {
  ScratchFolder folder;
  const pipelines::Json chart = run_recipe(
      folder, "rouyer-menon-2000", {"/stages/beds/seed=105", "/stages/nearly_elastic/seed=106"}, "chart/chart.json");
  ASSERT_FALSE(chart.is_null());
  const auto exponent = [&](const char* fit) {
    const pipelines::Json& found = chart["distribution"][fit]["power"]["exponent"];
    return std::pair(found["value"].get<double>(), found["std_error"].get<double>());
  };
  const auto elastic = exponent("fit_elastic"), inelastic = exponent("fit200"), dense = exponent("fit350");
  const auto apart = [](auto more, auto less) {
    return (more.first - less.first) / std::hypot(more.second, less.second);
  };
  EXPECT_GT(apart(elastic, inelastic), 4);
  EXPECT_GT(apart(inelastic, dense), 4);
  EXPECT_LT(elastic.first, 2.1);
}

}  // namespace
}  // namespace shakebed::tests
