// 300 recipes damaged at random places, with fixed seeds: each is refused by `validate` and `run` alike, with exit code
// 3 or 4 and the file, the line and the pointer; or accepted by both.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <regex>
#include <sstream>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
namespace fs = std::filesystem;

constexpr int damaged_recipes = 300;
constexpr int shards = 20;  // the first is a quick test, the others are long ones
constexpr int real_runs_a_shard = 2;

std::vector<std::string> sound_recipes() {
  std::vector<std::string> texts{small_recipe(),
                                 small_recipe(R"({ "over": { "/stages/bed/floor/amplitude": ["1.5 mm", "2 mm"],
                                                             "/stages/bed/seed": [1, 2] },
                                                   "collect": ["/fit/temperature", "/bed/center_of_mass_rise"] })")};
  const fs::path folder = SHAKEBED_RECIPES;
  for (const char* name :
       {"starter.json", "starter.json", "starter.json", "clement-rajchenbach/figure.json",
        "clement-rajchenbach/infer.json", "quinn-hong-fig1/figure.json", "quinn-hong-fig2/figure.json",
        "quinn-hong-tc/figure.json", "quinn-hong-eq6/figure.json", "quinn-hong-beyond/figure.json",
        "scenes/langevin.json", "scenes/two-species.json", "scenes/shaker-table.json", "scenes/thermal-floor.json"})
    texts.push_back(read_text(folder / name));
  return texts;
}

using Random = std::mt19937_64;
std::size_t below(Random& random, std::size_t n) { return static_cast<std::size_t>(random() % n); }

// The pointers of all values, with those whose last token is a key of an object.
void collect(const Json& json, const std::string& pointer, std::vector<std::string>& all) {
  if (!pointer.empty() && pointer.find("$comment") == std::string::npos) all.push_back(pointer);
  std::size_t i = 0;
  if (json.is_array()) {
    for (const Json& item : json) collect(item, pointer_join(pointer, i++), all);
  } else if (json.is_object()) {
    for (const auto& [key, value] : json.items()) collect(value, pointer_join(pointer, key), all);
  }
}

Json* at(Json& root, const std::string& pointer) { return const_cast<Json*>(find_pointer(root, pointer)); }

std::string misspelled(Random& random, std::string text) {
  if (text.empty()) return "x";
  const std::size_t place = below(random, text.size());
  const char letter = static_cast<char>('a' + below(random, 26));
  switch (below(random, 4)) {
    case 0:
      text.erase(place, 1);
      break;
    case 1:
      text.insert(place, 1, letter);
      break;
    case 2:
      text[place] = letter;
      break;
    default:
      if (place + 1 < text.size()) std::swap(text[place], text[place + 1]);
  }
  return text;
}

Json other_type(Random& random, const Json& value) {
  const Json all[] = {Json("text"), Json(3.5), Json(true), Json::array({1, "two"}), Json{{"key", 1}}, Json()};
  for (;;) {
    const Json& one = all[below(random, std::size(all))];
    if (one.type() != value.type()) return one;
  }
}

// Another unit, another sign, another size; of plain text another spelling.
Json other_value(Random& random, const Json& value) {
  if (value.is_boolean()) return !value.get<bool>();
  if (value.is_number()) {
    const double number = value.get<double>();
    const Json all[] = {Json(-number),       Json(0),
                        Json(number + 0.5),  Json(1e300),
                        Json(number * 1e-9), Json(number_text(number) + " mm")};
    return all[below(random, std::size(all))];
  }
  if (!value.is_string()) return other_type(random, value);
  const std::string text = value.get<std::string>();
  if (text.empty() || std::isdigit(static_cast<unsigned char>(text[0])) == 0) return misspelled(random, text);
  const std::string number = text.substr(0, text.find(' '));
  const std::string all[] = {number,         "-" + text,    number + " Hz",
                             number + " kg", number + " m", misspelled(random, text)};
  return all[below(random, std::size(all))];
}

// One damage; what was done, for messages.
std::string damage(Random& random, Json& root) {
  std::vector<std::string> all;
  collect(root, "", all);
  std::string pointer = all[below(random, all.size())];
  // Presets and sweeps are small and would hardly ever be hit.
  if (below(random, 4) == 0) {
    std::vector<std::string> rare;
    for (const std::string& one : all)
      if (one.starts_with("/presets/") || one.starts_with("/sweep/") || one.starts_with("/report/"))
        rare.push_back(one);
    if (!rare.empty()) pointer = rare[below(random, rare.size())];
  }
  const std::size_t slash = pointer.rfind('/');
  Json& parent = *at(root, pointer.substr(0, slash));
  Json& value = *at(root, pointer);
  const std::string token = split_pointer(pointer).back();
  switch (below(random, 5)) {
    case 0:
      value = other_type(random, value);
      return pointer + " of another type";
    case 1:
      if (!parent.is_object()) break;
      parent.erase(token);
      return pointer + " left out";
    case 2: {
      if (!parent.is_object()) break;
      Json renamed = Json::object();
      for (const auto& [key, kept] : parent.items()) renamed[key == token ? misspelled(random, key) : key] = kept;
      parent = std::move(renamed);
      return pointer + " renamed";
    }
    default:
      break;
  }
  value = other_value(random, value);
  return pointer + " of another value";
}

// Messages name the file, a line of it, and a pointer.
void expect_located(const std::string& message, std::size_t lines) {
  std::istringstream stream(message);
  std::string line;
  while (std::getline(stream, line)) {
    if (line.starts_with("warning: ")) continue;
    const std::regex form(R"(error: r\.json:(\d+):\d+: (.*))");
    std::smatch match;
    if (!std::regex_match(line, match, form)) {
      ADD_FAILURE() << "no file and line: " << line;
      continue;
    }
    EXPECT_LE(std::stoul(match[1]), lines) << line;
    EXPECT_TRUE(match[2].str().starts_with("/")) << "no pointer: " << line;
  }
}

class DamagedRecipes : public testing::TestWithParam<int> {};

TEST_P(DamagedRecipes, AreRefusedAtTheirPlaceOrAccepted) {
  const std::vector<std::string> sound = sound_recipes();
  int real_runs = 0, refused = 0;
  for (int k = GetParam(); k < damaged_recipes; k += shards) {
    Random random(static_cast<std::uint64_t>(k));
    const std::size_t which = below(random, sound.size());
    Json document = Json::parse(sound[which]);
    const std::string what = damage(random, document);
    const std::string text = dump(document);
    SCOPED_TRACE(testing::Message() << "recipe " << k << " (" << document.value("name", Json()) << "): " << what);
    ScratchFolder folder;
    write_text(folder / "r.json", text);
    const ProgramResult checked = run_shakebed({"validate", "r.json"}, folder.path());
    const ProgramResult planned = run_shakebed({"run", "r.json", "--dry-run"}, folder.path());
    EXPECT_EQ(checked.exit_code, planned.exit_code) << checked.err << planned.err;
    if (checked.exit_code == 0) {
      // Small beds are run, too, unless the damage made them large.
      const bool small = which < 2 && text.find("e+") == std::string::npos;
      if (!small || real_runs == real_runs_a_shard) continue;
      ++real_runs;
      const ProgramResult run = run_shakebed({"run", "r.json", "--quiet", "--out", "o"}, folder.path());
      EXPECT_TRUE(run.exit_code == 0 || run.exit_code >= 4) << run.exit_code << run.err;
      EXPECT_LT(run.exit_code, 128) << run.err;
      continue;
    }
    ++refused;
    EXPECT_TRUE(checked.exit_code == 3 || checked.exit_code == 4) << checked.exit_code << checked.err;
    expect_located(checked.err, static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1);
    EXPECT_FALSE(fs::exists(folder / "results")) << "a dry run makes nothing";
  }
  EXPECT_GE(refused, damaged_recipes / shards / 3) << "most damages must be found";
}
INSTANTIATE_TEST_SUITE_P(Of300, DamagedRecipes, testing::Range(0, shards));

}  // namespace
