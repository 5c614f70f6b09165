// Every number that a stage declares, in its result file or in a table, has a test that asserts it against something
// independent, and so has its standard error: witnesses.csv names them. Faults in both were put in to see that the
// tests named fail (tests/robustness/mutants).
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/results.hpp"
#include "pipelines/stages/stage.hpp"
#include "tests/house/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace shakebed::pipelines;
using shakebed::tests::text_of;

// "fit /temperature", "fit curve.csv height": what each stage declares with its options left at their defaults.
std::set<std::string> declared_numbers() {
  std::set<std::string> all;
  for (const StageRow& row : stage_table()) {
    ResultList results;
    row.make()->results(results);
    const std::string stage(row.name);
    for (const StatedResult& one : results.all())
      if (one.kind == ResultKind::quantity || one.kind == ResultKind::number) all.insert(stage + " " + one.pointer);
    for (const StatedTable& table : results.tables())
      for (const StatedColumn& column : table.columns)
        if (!column.unit.empty()) all.insert(stage + " " + table.file + " " + column.name);
  }
  return all;
}

struct Witness {
  std::string value, error;  // "Suite.Test", the error "-" where the number has none
};
std::map<std::string, Witness> witnesses(const fs::path& root) {
  std::map<std::string, Witness> all;
  const fs::path file = root / "tests/house/witnesses.csv";
  each_csv_line(text_of(file), [&](const std::vector<std::string>& cells, std::size_t line) {
    if (line == 1) return;
    ASSERT_EQ(cells.size(), 4U) << file << ":" << line;
    EXPECT_TRUE(all.emplace(cells[0] + " " + cells[1], Witness{cells[2], cells[3]}).second)
        << file << ":" << line << ": stands there twice";
  });
  return all;
}

// All tests in the source, "Suite.Test"; of parameterised ones the name without its parameters.
std::set<std::string> tests_in(const fs::path& root) {
  const std::regex declaration(R"(\bTEST(?:_F|_P)?\((\w+), (\w+)\))");
  std::set<std::string> all;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / "tests")) {
    if (entry.path().extension() != ".cpp") continue;
    const std::string text = text_of(entry.path());
    for (std::sregex_iterator found(text.begin(), text.end(), declaration), end; found != end; ++found)
      all.insert(found->str(1) + "." + found->str(2));
  }
  return all;
}

TEST(Witnesses, StandForEveryNumberThatIsDeclared) {
  const std::map<std::string, Witness> known = witnesses(SHAKEBED_SOURCE_DIR);
  const std::set<std::string> declared = declared_numbers();
  EXPECT_GE(declared.size(), 400U);
  for (const std::string& number : declared)
    EXPECT_TRUE(known.contains(number)) << number
                                        << ": is declared, and no test asserts it (tests/house/witnesses.csv)";
  for (const auto& [number, witness] : known)
    EXPECT_TRUE(declared.contains(number)) << number << ": has a witness, but no stage declares it";
}

TEST(Witnesses, AreTestsThatThereAre) {
  const std::set<std::string> tests = tests_in(SHAKEBED_SOURCE_DIR);
  for (const auto& [number, witness] : witnesses(SHAKEBED_SOURCE_DIR)) {
    EXPECT_TRUE(tests.contains(witness.value)) << number << ": there is no test " << witness.value;
    EXPECT_TRUE(witness.error == "-" || tests.contains(witness.error))
        << number << ": there is no test " << witness.error;
  }
}

// An error is a number of its own: columns that are errors say so in their names and have a witness as values.
TEST(Witnesses, AssertErrorsToo) {
  std::size_t errors = 0;
  for (const auto& [number, witness] : witnesses(SHAKEBED_SOURCE_DIR)) {
    errors += witness.error != "-";
    const bool is_error = number.ends_with("std_error") || number.ends_with("_error");
    errors += is_error;
  }
  EXPECT_GE(errors, 90U);
}

}  // namespace
