// The inferred restitution and friction of the Clement-Rajchenbach beads: a coarse grid finds the pair of the full one.
#include <gtest/gtest.h>

#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <fstream>
#include <sstream>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

const std::string source = SHAKEBED_SOURCE_DIR;

struct Row {
  double restitution = 0, friction = 0, side_friction = 0, temperature = 0, temperature_error = 0, density = 0,
         distance = INFINITY;
};
// The committed result of the full search.
std::vector<Row> full_search() {
  std::ifstream file(source + "/reference-data/quinn-hong-2000/measured/restitution-and-friction.csv");
  std::vector<Row> rows;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#' || line[0] == 'r') continue;
    const auto cells = pipelines::split_csv_line(line);
    Row row;
    row.restitution = std::stod(cells.at(0));
    row.friction = std::stod(cells.at(1));
    row.side_friction = std::stod(cells.at(2));
    row.temperature = std::stod(cells.at(4));
    row.temperature_error = std::stod(cells.at(5));
    row.density = std::stod(cells.at(7));
    if (!cells.at(13).empty()) row.distance = std::stod(cells.at(13));
    rows.push_back(row);
  }
  return rows;
}

// The errors of two means of three beds each come from their own spread, two degrees of freedom a mean: how far apart
// may they lie (Welch) if one test in 1 / chance may fail?
double allowed_difference(double error_1, double error_2, double chance) {
  const double sum = error_1 * error_1 + error_2 * error_2;
  const double freedom = sum * sum / (std::pow(error_1, 4) / 2 + std::pow(error_2, 4) / 2);
  return boost::math::quantile(boost::math::students_t(freedom), 1 - chance / 2) * std::sqrt(sum);
}

// The nearest pairs lie closer together than the scatter between beds, so which of them wins is not asked: only that
// the full search's pair is among those that the coarse one cannot tell from its nearest, that every bed's temperature
// is the full search's (one false alarm in 30 over the 12 points), and that all of them together are within 1.5 %,
// three standard errors of the mean of 12 ratios that scatter by 1.6 % (1.1 % is the spread of the full search's
// means).
TEST(Inference, FindsOnACoarseGridThePairOfTheFullOne) {
  const std::vector<Row> full = full_search();
  ASSERT_EQ(full.size(), 88u);
  Row nearest;
  for (const Row& row : full) {
    if (row.distance < nearest.distance) nearest = row;
  }
  ScratchFolder folder;
  const ProgramResult result = run_shakebed(
      {"run", source + "/pipelines/recipes/clement-rajchenbach/infer.json", "--out", "out", "--jobs", "2", "--set",
       "/stages/search/grid/restitution=[0.6,0.8,0.95]", "--set", "/stages/search/grid/friction=[0.2,0.8]"},
      folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const pipelines::Json found = pipelines::read_json(folder / "out/search/infer.json");
  ASSERT_EQ(found["points"].size(), 12u);
  bool is_as_near = false;
  for (const auto& point : found["as_near"]) {
    is_as_near = is_as_near || (point["restitution"] == nearest.restitution && point["friction"] == nearest.friction &&
                                point["side_friction"] == nearest.side_friction);
  }
  EXPECT_TRUE(is_as_near) << found["as_near"].dump(1);
  double ratios = 0;
  for (const auto& point : found["points"]) {
    for (const Row& row : full) {
      if (row.restitution != point["restitution"] || row.friction != point["friction"] ||
          row.side_friction != point["side_friction"])
        continue;
      const double temperature = point["temperature_over_mg"]["value"].get<double>() / 2.99e-3;
      const double error = point["temperature_over_mg"]["std_error"].get<double>() / 2.99e-3;
      EXPECT_NEAR(temperature, row.temperature, allowed_difference(error, row.temperature_error, 1.0 / 30 / 12))
          << row.restitution << " " << row.friction;
      ratios += temperature / row.temperature;
    }
  }
  EXPECT_NEAR(ratios / 12, 1, 0.015);
}

}  // namespace
}  // namespace shakebed::tests
