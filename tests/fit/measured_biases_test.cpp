// The biases that the program takes off against the table that users read, and which thermometer gives the answer.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "fit/profile_fit/answer.hpp"
#include "fit/profile_fit/thermometers.hpp"
#include "tests/fit/synthetic.hpp"

namespace shakebed::fit {
namespace {

// The cells of a row of a table in Markdown.
std::vector<std::string> cells_of_row(const std::string& line) {
  std::vector<std::string> cells;
  for (std::size_t begin = line.find('|'), end; begin != std::string::npos; begin = end) {
    end = line.find('|', begin + 1);
    if (end != std::string::npos) cells.push_back(line.substr(begin + 1, end - begin - 1));
  }
  return cells;
}

// Rows of "| T | +bias ± scatter | ... | misfit |" in per cent, to 0.1 %. A dash: the thermometer has no weight, by a
// scatter of 2.
TEST(KnownBiases, AreThoseOfTheManual) {
  std::ifstream manual(SHAKEBED_THERMOMETER_PAGE);
  ASSERT_TRUE(manual);
  std::string line;
  while (std::getline(manual, line) && line.rfind("| T [m g D] | whole column (best-of)", 0) != 0) {}
  std::getline(manual, line);        // below the head
  constexpr double rounding = 1e-9;  // the same digits are in both
  std::size_t row = 0, compared = 0;
  for (; std::getline(manual, line) && !line.empty(); ++row) {
    const std::vector<std::string> cells = cells_of_row(line);
    ASSERT_EQ(cells.size(), 2 + thermometer_count) << line;
    ASSERT_LT(row, known_biases().size());
    const KnownBiases& known = known_biases()[row];
    EXPECT_NEAR(std::stod(cells[0]), known.temperature, 1e-12) << line;
    EXPECT_NEAR(std::stod(cells.back()), known.misfit, 1e-12) << line;
    for (std::size_t t = 0; t < thermometer_count; ++t) {
      double mean = 0, scatter = 0;
      if (cells[t + 1] == " \u2013 ") {
        EXPECT_EQ(known.of[t].mean, 0) << line;
        EXPECT_EQ(known.of[t].scatter, 2) << line;
        continue;
      }
      ASSERT_EQ(std::sscanf(cells[t + 1].c_str(), " %lf \u00b1 %lf", &mean, &scatter), 2) << cells[t + 1];
      EXPECT_NEAR(100 * known.of[t].mean, mean, rounding) << line;
      EXPECT_NEAR(100 * known.of[t].scatter, scatter, rounding) << line;
      ++compared;
    }
  }
  EXPECT_EQ(row, known_biases().size());
  EXPECT_EQ(compared, 14 * thermometer_count - 3) << "three have fewer than five readings";
}

// What a thermometer reads is in its name: from which height up (1.5 D otherwise), below which density, N known, the
// curve of the paper, which is shown beside the others.
TEST(Thermometers, ReadWhatTheirNamesSay) {
  for (const Thermometer& one : thermometers()) {
    const std::string name(one.name);
    const auto number_after = [&](const std::string& word, double otherwise) {
      const std::size_t at = name.find(word);
      return at == std::string::npos ? otherwise : std::stod(name.substr(at + word.size()));
    };
    const bool of_the_paper = name.rfind("Enskog", 0) == 0;
    EXPECT_EQ(one.floor_exclusion, number_after(" from ", 1.5)) << name;
    EXPECT_EQ(one.below_density, number_after(" below ", 0)) << name;
    EXPECT_EQ(one.column_known, name.find("N known") != std::string::npos) << name;
    EXPECT_EQ(one.model, of_the_paper ? "enskog-rectangle" : "hydrostatic:best-of") << name;
    EXPECT_NE(one.votes, of_the_paper) << name;
  }
}

// Of the thermometers that vote, the first in the list, unless a later one scatters by less than 0.8 of it. From 0.2 to
// 0.203 m g D densities below 0.8 do: at 0.2015 by 0.70 % and 0.89 %. At 1 m g D none does.
TEST(Answer, IsThatOfTheThermometerThatScattersLeast) {
  for (const auto& [temperature, name] :
       {std::pair{0.2023, "whole column, densities below 0.8"}, {1.0, "whole column"}}) {
    const auto truth = HydrostaticProfile::of_column(best_of(), temperature, {20.0, close_packing_density});
    AnswerInput input;
    input.kernel = {KernelKind::gaussian, 0.5};
    input.base = 0.0;
    const double top = synthetic::top_of(truth);
    input.profile = synthetic::profile_of(truth, input.kernel, static_cast<int>(4 * top), top, 3e-4, 5);
    const Answer answer = find_answer(input);
    ASSERT_TRUE(answer.ok()) << answer.why;
    // Its known bias is taken off: 0.4 % at 0.2 m g D.
    EXPECT_NEAR(answer.readings[0].temperature / temperature, temperature < 0.5 ? 0.996 : 0.998, 1.5e-3);
    EXPECT_EQ(answer.thermometer, name);
  }
}

// It grows less the hotter the bed, and lies between the rows.
TEST(KnownMisfit, IsLinearInTheLogarithmOfTheTemperature) {
  const auto rows = known_biases();
  for (std::size_t k = 0; k + 1 < rows.size(); ++k) {
    EXPECT_NEAR(known_misfit(rows[k].temperature), rows[k].misfit, 1e-12);
    const double third = std::cbrt(rows[k].temperature * rows[k].temperature * rows[k + 1].temperature);
    EXPECT_NEAR(known_misfit(third), (2 * rows[k].misfit + rows[k + 1].misfit) / 3, 1e-12);
  }
  EXPECT_EQ(known_misfit(1e-3), rows.front().misfit);
  EXPECT_EQ(known_misfit(1e3), rows.back().misfit);
}

}  // namespace
}  // namespace shakebed::fit
