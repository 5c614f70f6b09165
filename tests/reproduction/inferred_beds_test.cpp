// Beds with parameters drawn from the prior are filmed, and what the film says of the parameters is compared with the
// truth: how often intervals hold it, and whether its rank in the posterior is evenly distributed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <random>
#include <vector>

#include "fit/inference/posterior.hpp"
#include "fit/profile_fit/chances.hpp"
#include "pipelines/formats/json.hpp"
#include "statistics/parallel.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::inferred_beds {
namespace {

using pipelines::Json;

constexpr std::size_t beds = 100;
constexpr int design_beds = 480, rank_bins = 10;

struct Range {
  const char* name;
  double low, high;
};
constexpr std::array<Range, 3> prior{{{"gamma", 2.5, 7}, {"restitution", 0.4, 0.95}, {"friction", 0, 0.8}}};
using Truth = std::array<double, 3>;

// 200 disks of 3 mm, ten layers, shaken at 20 Hz.
Json scene(const Truth& at) {
  const Json material{{"restitution", at[1]}, {"friction", at[2]}};
  Json disks = material, floor = material, sides = material;
  disks.update(Json{{"count", 200}, {"diameter", "3 mm"}, {"inertia", "sphere"}});
  floor.update(Json{{"motion", "sinusoidal"}, {"gamma", at[0]}, {"frequency", "20 Hz"}});
  sides.update(Json{{"kind", "hard"}});
  return Json{{"disks", disks}, {"floor", floor}, {"box", {{"width", "60.9 mm"}, {"sides", sides}, {"lid", "open"}}}};
}

// 480 pictures at 800 Hz: twelve periods.
Json film_stages(const Truth& truth, std::size_t number) {
  Json bed{{"stage", "simulate"},
           {"id", "bed"},
           {"seed", 1000 + number},
           {"replicas", 1},
           {"settle", "5 s"},
           {"measure", "0.6 s"},
           {"frames", {{"count", 480}, {"phases", 40}}}};
  bed.update(scene(truth));
  return Json::array({bed,
                      {{"stage", "render"},
                       {"id", "film"},
                       {"from", "bed"},
                       {"seed", 1000 + number},
                       {"scale", "0.3 mm/px"},
                       {"blur", 0.8},
                       {"noise", 4},
                       {"exposure", "0.2 ms"},
                       {"height", "75 mm"}},
                      {{"stage", "extract"},
                       {"id", "extract"},
                       {"from", "film"},
                       {"diameter", "3 mm"},
                       {"frequency", "20 Hz"},
                       {"frame_rate", "800 Hz"}}});
}

Json inference(const Json& extracted, const std::string& earlier) {
  Json stage{{"stage", "infer"},   {"id", "infer"},          {"from", "extract"},    {"seed", 7},   {"settle", "2.5 s"},
             {"measure", "0.6 s"}, {"frame_rate", "800 Hz"}, {"first", design_beds}, {"rounds", 0}, {"best", 0}};
  stage.update(scene({4, 0.8, 0.3}));
  stage["targets"]["profile"] = Json{{"from", "extract"}, {"low", 0.5}, {"high", 15.5}};
  if (extracted["velocities"]["usable"] == true) {
    for (const char* axis : {"x", "z"})
      stage["targets"][fmt::format("temperature_{}_without_flow_over_mg", axis)] =
          Json{{"at", fmt::format("/extract/velocities/temperature_{}_of_displacements_over_mg", axis)},
               {"includes_scatter", true}};
  }
  const auto set = [&](const Range& range, std::vector<std::string> pointers) {
    stage["parameters"][range.name] = Json{{"set", pointers}, {"low", range.low}, {"high", range.high}};
  };
  set(prior[0], {"/floor/gamma"});
  set(prior[1], {"/disks/restitution", "/floor/restitution", "/box/sides/restitution"});
  set(prior[2], {"/disks/friction", "/floor/friction", "/box/sides/friction"});
  if (!earlier.empty()) stage["beds"] = earlier;
  return stage;
}

struct Found {
  Truth truth{};
  Json parameters;
  bool velocities = false;
  std::map<std::string, double> rank;
};

Found infer(const std::filesystem::path& folder, std::size_t number, const std::string& earlier) {
  std::mt19937_64 generator(number);
  Found found;
  for (std::size_t k = 0; k < prior.size(); ++k)
    found.truth[k] = prior[k].low + (prior[k].high - prior[k].low) * fit::even_number(generator);
  const std::string recipe = fmt::format("r{}.json", number), out = fmt::format("o{}", number);
  Json stages = film_stages(found.truth, number);
  const auto run = [&] {
    write_text(folder / recipe, Json{{"name", "film"}, {"stages", stages}}.dump());
    const ProgramResult ran =
        run_shakebed({"run", recipe, "--out", out, "--jobs", earlier.empty() ? "2" : "1"}, folder);
    EXPECT_EQ(ran.exit_code, 0) << "bed " << number << ": " << ran.err;
    return ran.exit_code == 0;
  };
  if (!run()) return found;
  const Json extracted = Json::parse(read_text(folder / out / "extract/extract.json"));
  found.velocities = extracted["velocities"]["usable"] == true;
  stages.push_back(inference(extracted, earlier));
  if (!run()) return found;
  found.parameters = Json::parse(read_text(folder / out / "infer/infer.json"))["parameters"];
  const NumberTable draws(folder / out / "infer/posterior.csv");
  for (std::size_t k = 0; k < prior.size(); ++k) {
    double below = 0;
    for (std::size_t r = 0; r < draws.rows(); ++r) below += draws(prior[k].name, r) < found.truth[k];
    found.rank[prior[k].name] = below / static_cast<double>(draws.rows());
  }
  if (!earlier.empty()) std::filesystem::remove_all(folder / out);
  return found;
}

struct Coverage {
  double in_68 = 0, in_95 = 0, width = 0, rank_chance = 0;  // shares; the last by chi2
};

Coverage coverage_of(const std::vector<Found>& found, std::size_t k) {
  Coverage out;
  std::array<double, rank_bins> histogram{};
  for (const Found& one : found) {
    const Json& row = one.parameters[prior[k].name];
    const double truth = one.truth[k], rank = one.rank.at(prior[k].name);
    const auto within = [&](const char* low, const char* high) {
      return row[low].get<double>() <= truth && truth <= row[high].get<double>() ? 1.0 / beds : 0;
    };
    out.in_68 += within("low_68", "high_68"), out.in_95 += within("low_95", "high_95");
    out.width += row["width_over_prior"].get<double>() / beds;
    histogram[static_cast<std::size_t>(std::min(rank_bins - 1.0, std::floor(rank * rank_bins)))] += 1;
    std::printf("  %s %.4g: %.4g to %.4g (68 %%), %.4g to %.4g, rank %.3f%s\n", prior[k].name, truth,
                row["low_68"].get<double>(), row["high_68"].get<double>(), row["low_95"].get<double>(),
                row["high_95"].get<double>(), rank, one.velocities ? "" : ", no velocities");
  }
  double chi2 = 0;
  for (const double count : histogram) chi2 += std::pow(count - beds / 10.0, 2) / (beds / 10.0);
  out.rank_chance = fit::chance_of_chi2(chi2, rank_bins - 1);
  return out;
}

// The intervals of all parameters together hold the truth in 68 +- 9 % and 95 +- 4 %, those of each within three
// standard deviations of 100 counts. Ranks of each are even at 0.05/3, so that one of three fails by chance in one
// study of twenty.
TEST(InferredBeds, IntervalsHoldTheParametersOfFilmedBeds) {
  ScratchFolder folder;
  std::vector<Found> found(beds);
  found[0] = infer(folder.path(), 0, "");
  const std::string earlier = (folder / "o0/infer/beds.json").string();
  for_each_index(beds - 1, 2, [&](std::size_t i) { found[i + 1] = infer(folder.path(), i + 1, earlier); });
  double in_68 = 0, in_95 = 0;
  for (const Found& one : found) ASSERT_TRUE(one.parameters.is_object());
  for (std::size_t k = 0; k < prior.size(); ++k) {
    const Coverage of = coverage_of(found, k);
    std::printf("  %s: %.0f and %.0f of %zu hold it, ranks even with p = %.3f, width over the prior's %.3f\n",
                prior[k].name, beds * of.in_68, beds * of.in_95, beds, of.rank_chance, of.width);
    EXPECT_NEAR(of.in_68, 0.68, 0.14) << prior[k].name;
    EXPECT_NEAR(of.in_95, 0.95, 0.066) << prior[k].name;
    EXPECT_GT(of.rank_chance, 0.05 / 3) << prior[k].name;
    EXPECT_LT(of.width, 0.95) << prior[k].name << ": nothing was learnt";
    in_68 += of.in_68 / prior.size(), in_95 += of.in_95 / prior.size();
  }
  std::printf("  of all intervals %.3f and %.3f hold the truth\n", in_68, in_95);
  EXPECT_NEAR(in_68, 0.68, 0.09);
  EXPECT_NEAR(in_95, 0.95, 0.04);
}

// Three beds of other sizes and frequencies, inferred by infer-bed with its defaults.
struct Hidden {
  int count;
  double diameter, width;  // [mm]
  int frequency, phases;   // [Hz], pictures a period: 800 a second
  double scale;            // [mm/px]
};
constexpr std::array<Hidden, 3> hidden_beds{
    {{60, 3, 36.9, 20, 40, 0.2}, {120, 2, 30.6, 25, 32, 0.15}, {100, 4, 51.2, 16, 50, 0.3}}};

Json film_of(const Hidden& bed, const Truth& truth, std::size_t number) {
  Json stages = film_stages(truth, number);
  Json& simulate = stages[0];
  simulate["disks"]["count"] = bed.count;
  simulate["disks"]["diameter"] = fmt::format("{} mm", bed.diameter);
  simulate["box"]["width"] = fmt::format("{} mm", bed.width);
  simulate["floor"]["frequency"] = fmt::format("{} Hz", bed.frequency);
  simulate["measure"] = fmt::format("{} s", 12.0 / bed.frequency);
  simulate["frames"] = Json{{"count", 12 * bed.phases}, {"phases", bed.phases}};
  stages[1]["scale"] = fmt::format("{} mm/px", bed.scale);
  stages[1].erase("height");
  stages.erase(2);
  return Json{{"name", "hidden"}, {"stages", stages}};
}

// The nine parameters lie within their 95 % intervals; one may be outside: two or more are by chance in 7 % of studies.
TEST(InferredBeds, ThreeFilmsByInferBed) {
  ScratchFolder folder;
  std::mt19937_64 generator(20261127);
  int in_68 = 0, in_95 = 0;
  for (std::size_t k = 0; k < hidden_beds.size(); ++k) {
    const Hidden& bed = hidden_beds[k];
    Truth truth{};
    for (std::size_t j = 0; j < prior.size(); ++j)
      truth[j] = prior[j].low + (prior[j].high - prior[j].low) * fit::even_number(generator);
    write_text(folder / "hidden.json", film_of(bed, truth, 5000 + k).dump());
    const std::string out = fmt::format("o{}", k);
    ProgramResult ran = run_shakebed({"run", "hidden.json", "--out", "hidden" + out}, folder.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    ran = run_shakebed({"infer-bed", "hidden" + out + "/film/frames", "--diameter", fmt::format("{} mm", bed.diameter),
                        "--frequency", fmt::format("{} Hz", bed.frequency), "--frame-rate", "800 Hz", "--out", out},
                       folder.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    const Json found = Json::parse(read_text(folder / out / "infer/infer.json"))["parameters"];
    for (std::size_t j = 0; j < prior.size(); ++j) {
      const Json& row = found[prior[j].name];
      const auto within = [&](const char* low, const char* high) {
        return row[low].get<double>() <= truth[j] && truth[j] <= row[high].get<double>();
      };
      in_68 += within("low_68", "high_68"), in_95 += within("low_95", "high_95");
      std::printf("  bed %zu, %s %.4g: %.4g to %.4g (68 %%), %.4g to %.4g (95 %%)\n", k, prior[j].name, truth[j],
                  row["low_68"].get<double>(), row["high_68"].get<double>(), row["low_95"].get<double>(),
                  row["high_95"].get<double>());
    }
  }
  std::printf("  %d and %d of 9 within the 68 and 95 %% intervals\n", in_68, in_95);
  EXPECT_GE(in_68, 3);  // fewer by chance in 0.6 % of studies
  EXPECT_GE(in_95, 8);
}

}  // namespace
}  // namespace shakebed::tests::inferred_beds
