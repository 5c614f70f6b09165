// The figures of Quinn and Hong (2000): what their quick recipes find against laws that hold whatever the paper says.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "fit/profile_fit/chances.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests {
namespace {

// A table of a study: (series, value of the parameter) → column → number.
using Table = std::map<std::pair<std::string, std::string>, std::map<std::string, double>>;
Table read_table(const std::filesystem::path& path) {
  std::ifstream file(path);
  Table table;
  std::vector<std::string> header;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    const auto cells = pipelines::split_csv_line(line);
    if (header.empty()) {
      header = cells;
      continue;
    }
    for (std::size_t i = 2; i < cells.size(); ++i)
      if (!cells[i].empty()) table[{cells[0], cells[1]}][header[i]] = std::stod(cells[i]);
  }
  return table;
}

// Few replicas do not determine an error: that of a series, relative to the number itself, is the root mean square over
// its points.
double pooled_error(const Table& table, const std::string& series, const std::string& column) {
  double squares = 0, n = 0;
  for (const auto& [key, row] : table) {
    if (key.first != series || !row.contains(column + "_error")) continue;
    squares += std::pow(row.at(column + "_error") / row.at(column), 2), n += 1;
  }
  return n > 0 ? std::sqrt(squares / n) : 0;
}

// One study of a recipe's quick preset with seeds of its own and the values given, run alone.
Table run_quick(const std::string& recipe, const std::string& study, const std::string& values) {
  ScratchFolder folder;
  const ProgramResult result =
      run_shakebed({"reproduce", recipe, "--preset", "quick", "--out", "out", "--jobs", "2", "--only", study, "--set",
                    "/stages/" + study + "/seed=20001", "--set", "/stages/" + study + "/parameter/values=" + values},
                   folder.path());
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return result.exit_code == 0 ? read_table(folder / ("out/" + study + "/table.csv")) : Table{};
}

// Replicas were two at each of `points` parameters: a pooled error has one degree of freedom a point. How many errors
// may the largest of `comparisons` differences have, if one test in a thousand may fail?
double allowed_errors(int points, int comparisons) { return fit::student_quantile(1 - 1e-3 / 2 / comparisons, points); }

// Equipartition: elastic disks in a reservoir have its temperature. Disks that lose energy in collisions are colder.
TEST(QuinnHongFigure2, BathsSetTheTemperatureOfElasticBeds) {
  const Table found = run_quick("quinn-hong-fig2", "beds", "[0.2,0.5,0.8,1.1]");
  ASSERT_EQ(found.size(), 12u);
  const double error = pooled_error(found, "elastic", "T");
  ASSERT_GT(error, 0);
  ASSERT_LT(error, 0.01) << "a comparison that tells nothing";
  for (const auto& [key, row] : found) {
    const double bath = std::stod(key.second);
    if (key.first == "elastic")
      EXPECT_NEAR(row.at("T"), bath, allowed_errors(4, 4) * error * bath) << "at " << key.second;
    else
      EXPECT_LT(row.at("T"), bath) << key.first << " at " << key.second;
  }
}

// Hard disks freeze at the pressure 9.185 T/D^2 [Bernard2011]. The pressure at the floor is N m g/W = 23.09 m g/D: the
// last crystal goes at T = 2.514 m g D, which is 12.12 T_c; below, it fills 1 - T/(12.12 T_c) of the disks. A tenth is
// allowed: the interface is about two of the twenty rows wide.
TEST(QuinnHongFigure2, CrystalMeltsAtThePressureAtWhichHardDisksFreeze) {
  constexpr double column = 1000 / 43.30127019, critical = 0.2074723010161296;
  constexpr double melting = column / 9.185 / critical;
  const Table found = run_quick("quinn-hong-fig2", "melting", "[6,10,14]");
  ASSERT_EQ(found.size(), 3u);
  for (const auto& [key, row] : found) {
    const double t = std::stod(key.second);
    EXPECT_NEAR(row.at("crystal_70"), std::max(0.0, 1 - t / melting), 0.1) << "at " << key.second;
  }
}

// Five restitutions in one bath: elastic disks have its temperature, and the more energy a collision loses, the colder
// the bed. The paper's profile describes them better than a Fermi function.
TEST(QuinnHongBeyond, DissipationCoolsABedInABath) {
  const Table found = run_quick("quinn-hong-beyond", "dissipation", "[0.2,0.6,1]");
  ASSERT_EQ(found.size(), 15u);
  const double error = pooled_error(found, "1", "T");
  ASSERT_GT(error, 0);
  ASSERT_LT(error, 0.01) << "a comparison that tells nothing";
  for (const std::string bath : {"0.2", "0.6", "1"}) {
    const double expected = std::stod(bath);
    EXPECT_NEAR(found.at({"1", bath}).at("T"), expected, allowed_errors(3, 3) * error * expected) << "at " << bath;
    double warmer = found.at({"1", bath}).at("T");
    for (const std::string e : {"0.99", "0.95", "0.9", "0.8"}) {
      const double t = found.at({e, bath}).at("T");
      EXPECT_LT(t, warmer) << "restitution " << e << " at " << bath;
      warmer = t;
    }
  }
  for (const auto& [key, row] : found)
    EXPECT_GT(row.at("misfit_fermi"), row.at("misfit_enskog")) << key.first << " at " << key.second;
}

// A CSV of the chain, averaged row by row: with two replicas the mean is as far from the first as its error says.
TEST(Study, AveragesTablesOverReplicas) {
  ScratchFolder folder;
  const auto table = [&](int replicas) {
    write_text(folder / "study.json",
               R"({ "name": "s", "stages": [ { "stage": "study", "id": "s", "seed": 4, "replicas": )" +
                   std::to_string(replicas) + R"(,
      "parameter": { "name": "T", "values": [0.5], "set": ["/stages/bed/bath/temperature"] },
      "series": { "a, b": { "set": {} } }, "collect": { "rise": { "at": "/bed/center_of_mass_rise" } },
      "tables": { "layers": { "at": "/bed/layers.csv", "key": "height" } },
      "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced", "disks": { "count": 40 },
        "box": { "width": 8, "sides": "periodic" }, "bath": { "kind": "langevin", "temperature": 0.5, "rate": 1, "interval": 0.1 },
        "start_temperature": 0.5, "settle": 2, "measure": 5 } ] } ] })");
    const ProgramResult result = run_shakebed({"run", "study.json", "--out", "out"}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_text(folder / "out/s/layers.csv");
  };
  const auto rows = [](const std::string& text) {
    std::vector<std::vector<std::string>> out;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);)
      if (line[0] != '#') out.push_back(pipelines::split_csv_line(line));
    return out;
  };
  const auto one = rows(table(1)), two = rows(table(2));
  ASSERT_GT(two.size(), 5u);
  EXPECT_EQ(one[0], two[0]);
  ASSERT_EQ(two[0][2], "height");
  ASSERT_EQ(two[0][3], "temperature_x");
  ASSERT_EQ(two[0][4], "temperature_x_error");
  EXPECT_EQ(two[1][0], "a, b");
  for (std::size_t i = 1; i < 5; ++i) {  // the lowest layers are never empty
    EXPECT_EQ(one[i][2], two[i][2]);
    EXPECT_EQ(two[i].back(), "2");
    EXPECT_TRUE(one[i][4].empty());
    const double first = std::stod(one[i][3]), mean = std::stod(two[i][3]), error = std::stod(two[i][4]);
    EXPECT_GT(error, 0);
    EXPECT_NEAR(std::abs(mean - first), error, 1e-12);
  }
}

// A mistake in a chain is reported before anything runs, with its place.
TEST(Study, NamesAMistakeInItsChain) {
  ScratchFolder folder;
  const ProgramResult result = run_shakebed(
      {"reproduce", "quinn-hong-fig2", "--dry-run", "--set", "/stages/beds/stages/0/measure=-1"}, folder.path());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find("/stages/0/measure"), std::string::npos) << result.err;
  const ProgramResult table = run_shakebed(
      {"reproduce", "quinn-hong-fig1", "--dry-run", "--set", "/stages/widths/tables/rows/at=/bad/rows.csv"},
      folder.path());
  EXPECT_EQ(table.exit_code, 3);
  EXPECT_NE(table.err.find("/tables/rows/at"), std::string::npos) << table.err;
}

}  // namespace
}  // namespace shakebed::tests
