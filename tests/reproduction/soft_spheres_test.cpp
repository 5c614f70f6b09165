// The study of record: beds of hard disks with a contact duration, or a restitution that depends on speed, beside soft
// spheres of a real contact time (tests/physics/reference). Prints the table of docs/soft-spheres.md and checks the
// numbers by which `simulate` says what hard disks are worth.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/hard_disk_trust.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
using shakebed::pipelines::HardDiskBed;
using shakebed::pipelines::Json;

constexpr double width = 20.6, diameter = 2e-3, frequency = 30, gravity = 9.81;  // D, m, Hz, m/s^2
constexpr int seeds = 6, settle_periods = 20;

struct Number {
  double value = 0, error = 0;
};
Number ratio(const Number& a, const Number& b) {
  const double r = a.value / b.value;
  return {r, std::abs(r) * std::hypot(a.error / a.value, b.error / b.value)};
}

// A bed, or the mean of several.
struct Bed {
  Number x, z, centre;
  double fitted = 0, cpu_seconds = 0, elastic_share = 0;
};

struct SoftScene {
  double restitution = 0, friction = 0;
  int layers = 0, gamma = 0, periods = 0;
  [[nodiscard]] int count() const { return 20 * layers; }
  auto operator<=>(const SoftScene&) const = default;
};

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

// The heights from 0 up with their densities alone, so that both profiles are weighed alike: the errors of hard and
// soft beds come from different samples, and T of a shaken bed depends on the weights.
double fitted_temperature(const std::filesystem::path& profile, const std::filesystem::path& folder) {
  constexpr double least_density = 1e-3;
  std::ifstream in(profile);
  std::string line, densities = "height,number_density\n";
  std::getline(in, line);
  while (std::getline(in, line)) {
    const std::vector<std::string> cells = cells_of(line);
    if (std::stod(cells.at(0)) >= 0 && std::stod(cells.at(1)) > least_density)
      densities += cells[0] + "," + cells[1] + "\n";
  }
  write_text(folder / "densities.csv", densities);
  const ProgramResult ran = run_shakebed({"fit-profile", "densities.csv", "--model", "hydrostatic:best-of", "--kernel",
                                          "gaussian:0.5", "--quiet", "--json", "--out", "f"},
                                         folder);
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  return Json::parse(read_text(folder / "f/fit.json"))["temperature"]["value"].get<double>();
}

// The reference by scene and contact time [us]: means over starts.
std::map<SoftScene, std::map<int, Bed>> reference(const std::filesystem::path& folder) {
  const std::filesystem::path home = SHAKEBED_SOFT_SPHERES;
  std::ifstream file(home / "soft_spheres.csv");
  std::string line;
  std::getline(file, line);
  std::map<SoftScene, std::map<int, std::vector<Bed>>> beds;
  while (std::getline(file, line)) {
    const std::vector<std::string> cells = cells_of(line);
    const auto number = [&](std::size_t i) { return std::stod(cells.at(i)); };
    const SoftScene scene{number(1), number(2), static_cast<int>(number(3)), static_cast<int>(number(4)),
                          static_cast<int>(number(9))};
    beds[scene][static_cast<int>(number(5))].push_back(
        {{number(10), number(11)},
         {number(12), number(13)},
         {number(14), number(15)},
         fitted_temperature(home / "profiles" / (cells[0] + ".csv"), folder),
         number(16)});
  }
  std::map<SoftScene, std::map<int, Bed>> means;
  for (const auto& [scene, by_time] : beds) {
    for (const auto& [time, all] : by_time) {
      Bed& mean = means[scene][time];
      const auto n = static_cast<double>(all.size());
      const auto join = [&](Number Bed::*part) {
        Number sum;
        for (const Bed& bed : all)
          sum.value += (bed.*part).value / n, sum.error = std::hypot(sum.error, (bed.*part).error / n);
        return sum;
      };
      mean.x = join(&Bed::x), mean.z = join(&Bed::z), mean.centre = join(&Bed::centre);
      for (const Bed& bed : all) mean.fitted += bed.fitted / n, mean.cpu_seconds += bed.cpu_seconds / n;
    }
  }
  return means;
}

// The tangential restitution of a sphere on a spring of 2/7 of the normal stiffness and half of its damping: its
// tangential oscillation takes as long as the normal one and is damped 7/4 times as much.
double tangential(const SoftScene& scene) { return scene.friction > 0 ? std::pow(scene.restitution, 1.75) : 0; }

struct Kind {
  const char *id, *name;
  const char* contact_duration;
  bool viscoelastic = false;
};
constexpr Kind kinds[] = {{"tc", "t_c 1.4 us", "1.42784 us"},
                          {"tc3", "t_c 4.3 us", "4.28353 us"},
                          {"tc10us", "t_c 10 us", "10 us"},
                          {"visc", "viscoelastic, no t_c", "0 s", true}};

// Without a contact clock, dense beds that lose little have no end of contacts.
bool can_run(const SoftScene& scene, const Kind& kind) {
  return !kind.viscoelastic || scene.layers == 5 || scene.restitution < 0.9;
}

std::string stage_of(const SoftScene& scene, const Kind& kind) {
  const double floor_speed = scene.gamma * gravity / (2 * std::numbers::pi * frequency);
  std::string law = fmt::format(R"("restitution": {:g})", scene.restitution);
  if (kind.viscoelastic)
    law += fmt::format(R"(, "restitution_law": "viscoelastic", "restitution_speed": "{:.6g} m/s")", floor_speed);
  const std::string rough =
      law + fmt::format(R"(, "friction": {:g}, "tangential_restitution": {:.6f})", scene.friction, tangential(scene));
  // Without a contact clock a dense bed costs ten times as much: two of them.
  const int replicas = kind.viscoelastic && scene.layers > 5 ? 2 : seeds;
  return fmt::format(
      R"({{ "stage": "simulate", "id": "{}", "seed": 7000, "replicas": {}, "gravity": "9.81 m/s^2",
            "disks": {{ "count": {}, "diameter": "2 mm", "inertia": "sphere", "contact_duration": "{}", {} }},
            "box": {{ "width": "41.2 mm", "sides": {{ "kind": "hard", {} }} }},
            "floor": {{ "motion": "sinusoidal", "frequency": "30 Hz", "gamma": {}, {} }},
            "settle": "{:.9f} s", "measure": "{:.7f} s" }})",
      kind.id, replicas, scene.count(), kind.contact_duration, rough, law, scene.gamma, rough,
      settle_periods / frequency + 1e-9, scene.periods / frequency + 1e-6);
}

// Of the replicas that begin from the packing, as the soft spheres do: every second one. The error is that of the mean,
// by their scatter or by what each states.
Number from_the_packing(const std::filesystem::path& table, const std::string& name, double within) {
  std::ifstream file(table);
  std::string line;
  std::getline(file, line);
  const std::vector<std::string> header = cells_of(line);
  const auto column = static_cast<std::size_t>(std::find(header.begin(), header.end(), name) - header.begin());
  EXPECT_LT(column, header.size()) << name;
  std::vector<double> values;
  for (int row = 0; std::getline(file, line); ++row)
    if (row % 2 == 0) values.push_back(std::stod(cells_of(line).at(column)));
  const auto n = static_cast<double>(values.size());
  double mean = 0, square = 0;
  for (const double v : values) mean += v / n;
  for (const double v : values) square += (v - mean) * (v - mean) / std::max(1.0, n - 1);
  return {mean, std::max(std::sqrt(square), within) / std::sqrt(n)};
}

std::map<std::string, Bed> hard_disks(const SoftScene& scene, const ScratchFolder& folder) {
  std::string stages;
  for (const Kind& kind : kinds)
    if (can_run(scene, kind)) stages += (stages.empty() ? "" : ",\n") + stage_of(scene, kind);
  write_text(folder / "r.json", R"({ "name": "study", "stages": [ )" + stages + " ] }");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--quiet", "--out", "o"}, folder.path());
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  std::map<std::string, Bed> beds;
  for (const Kind& kind : kinds) {
    if (!can_run(scene, kind)) continue;
    const std::filesystem::path out = folder / "o" / kind.id;
    const Json observed = Json::parse(read_text(out / "observables.json")),
               cost = Json::parse(read_text(out / "cost.json"));
    const auto number = [&](const char* name) {
      return from_the_packing(out / "replicas.csv", name, observed[name]["within"].get<double>());
    };
    Bed& bed = beds[kind.id];
    bed.x = number("temperature_x"), bed.z = number("temperature_z"), bed.centre = number("center_of_mass_rise");
    bed.fitted = fitted_temperature(out / "profile.csv", folder.path());
    bed.cpu_seconds = cost["simulation_cpu_seconds"].get<double>() / observed["replicas"].get<double>();
    if (observed.contains("elastic_share")) bed.elastic_share = observed["elastic_share"]["value"].get<double>();
  }
  return beds;
}

// Height of the centre of mass of the packing from which the rise is measured: rows of 20 disks.
double packed(const SoftScene& scene) { return 0.5 + 0.5 * (scene.layers - 1) * std::numbers::sqrt3 / 2; }

std::string per_cent(const Number& r) { return fmt::format("{:+.0f} ± {:.0f}", 100 * (r.value - 1), 100 * r.error); }

void print_row(const SoftScene& scene, const char* name, const Bed& bed, const Bed& soft) {
  const Number rise{soft.centre.value - packed(scene), soft.centre.error};
  std::printf("| %g | %g | %d | %d | %s | %s | %s | %s | %+.0f | %.2f | %.1f |\n", scene.restitution, scene.friction,
              scene.layers, scene.gamma, name, per_cent(ratio(bed.x, soft.x)).c_str(),
              per_cent(ratio(bed.z, soft.z)).c_str(), per_cent(ratio(bed.centre, rise)).c_str(),
              100 * (bed.fitted / soft.fitted - 1), bed.elastic_share, bed.cpu_seconds);
}

const HardDiskBed* stored_bed(const SoftScene& scene) {
  for (const HardDiskBed& bed : shakebed::pipelines::hard_disk_study()) {
    if (bed.restitution == scene.restitution && bed.friction == scene.friction && bed.gamma == scene.gamma &&
        std::abs(bed.column_number - scene.count() / width) < 0.1)
      return &bed;
  }
  return nullptr;
}

TEST(SoftSpheres, StandBesideHardDisks) {
  const ScratchFolder profiles;
  const auto soft = reference(profiles.path());
  std::printf(
      "| e | friction | layers | Gamma | hard disks with | T_x, %% | T_z, %% | rise, %% | fitted T, %% | elastic share "
      "| "
      "CPU s a bed |\n");
  std::size_t stored = 0;
  int differing = 0;
  for (const auto& [scene, by_time] : soft) {
    const auto real = by_time.find(10);
    if (real == by_time.end()) continue;
    const ScratchFolder folder;
    const auto beds = hard_disks(scene, folder);
    for (const Kind& kind : kinds)
      if (can_run(scene, kind)) print_row(scene, kind.name, beds.at(kind.id), real->second);
    std::printf("|  |  |  |  | soft, 10 us: T_x %.4f ± %.4f, T_z %.4f, fitted T %.4f |  |  |  |  |  | %.0f |\n",
                real->second.x.value, real->second.x.error, real->second.z.value, real->second.fitted,
                real->second.cpu_seconds);
    for (const auto& [time, other] : by_time) {
      if (time != 10)
        print_row(scene, fmt::format("soft, {} us", time).c_str(),
                  {other.x,
                   other.z,
                   {other.centre.value - packed(scene), other.centre.error},
                   other.fitted,
                   other.cpu_seconds},
                  real->second);
    }
    // What the program says of such a scene is what was measured: the same seeds, three digits.
    const HardDiskBed* bed = stored_bed(scene);
    ASSERT_NE(bed, nullptr) << scene.restitution << " " << scene.friction << " " << scene.layers << " " << scene.gamma;
    ++stored;
    const Number x = ratio(beds.at("tc").x, real->second.x), z = ratio(beds.at("tc").z, real->second.z);
    EXPECT_NEAR(bed->ratio_x, x.value, 6e-4);
    EXPECT_NEAR(bed->error_x, x.error, 6e-4);
    EXPECT_NEAR(bed->ratio_z, z.value, 6e-4);
    EXPECT_NEAR(bed->error_z, z.error, 6e-4);
    differing += std::abs(x.value - 1) > 0.05 + 2 * x.error || std::abs(z.value - 1) > 0.05 + 2 * z.error;
  }
  // No bed with the default t_c differs from soft spheres of 10 us by more than 5 % and two errors.
  EXPECT_EQ(differing, 0);
  EXPECT_EQ(stored, shakebed::pipelines::hard_disk_study().size());
}

}  // namespace
