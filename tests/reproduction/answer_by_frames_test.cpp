// The answer from photographs: 200 beds that a bath holds at 0.4 to 40 T_c, simulated, photographed, found again and
// fitted by the program with no option but the diameter.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/reproduction/thermometer_beds.hpp"
#include "tests/reproduction/thermometer_coverage.hpp"

namespace shakebed::fit::simulated {
namespace {

using namespace shakebed::tests;
using pipelines::Json;

// 60 photographs, 8 sqrt(D/g) apart, of beads of 6 px radius.
std::string stages_of(const EquilibriumBed& what, std::size_t k) {
  return fmt::format(
      R"({{ "stage": "simulate", "id": "bed{0}", "seed": {1}, "disks": {{ "count": {2}, "diameter": "3 mm" }},
            "gravity": "9.81 m/s^2", "box": {{ "width": "{3:.9g} mm", "sides": "periodic" }},
            "bath": {{ "kind": "andersen", "temperature": "{4:.9g} mm", "rate": "17.155 Hz" }},
            "start_temperature": "{4:.9g} mm", "settle": "3.5 s", "measure": "8.4 s", "frames": {{ "count": 60 }} }},
          {{ "stage": "render", "id": "photographs{0}", "from": "bed{0}", "scale": "0.25 mm/px", "noise": 5,
             "blur": 0.8 }},
          {{ "stage": "extract", "id": "found{0}", "from": "photographs{0}", "diameter": "3 mm" }},
          {{ "stage": "fit", "id": "fit{0}", "from": "found{0}" }})",
      k, what.seed + 10'000, what.bed.count, 3 * what.bed.width, 3 * what.temperature());
}

TEST(AnswerByFrames, HoldsTheTemperatureOf200Beds) {
  Coverage photographs("photographs");
  const std::vector<EquilibriumBed> beds = verification_beds();
  constexpr std::size_t at_once = 20;  // so that the photographs of all need not be kept
  std::size_t refused = 0;
  for (std::size_t first = 0; first < beds.size(); first += at_once) {
    std::string stages;
    for (std::size_t k = first; k < first + at_once; ++k) stages += (k > first ? ",\n" : "") + stages_of(beds[k], k);
    const ScratchFolder folder;
    write_text(folder / "r.json", R"({ "name": "answers", "stages": [ )" + stages + " ] }");
    const ProgramResult ran = run_shakebed({"run", "r.json", "--quiet", "--out", "o"}, folder.path());
    ASSERT_EQ(ran.exit_code, 0) << ran.err;
    for (std::size_t k = first; k < first + at_once; ++k) {
      const Json answer = Json::parse(read_text(folder / "o" / fmt::format("fit{}", k) / "fit.json"))["answer"];
      if (answer["status"] != "ok") {
        ++refused;
        std::printf("  bed %zu, %.2f T_c: %s\n", k, beds[k].reduced, answer["why"].get<std::string>().c_str());
        continue;
      }
      const Json& error = answer["temperature"]["std_error"];  // null: a range
      const StatedAnswer stated{
          answer["temperature"]["value"].get<double>(), error.is_number() ? error.get<double>() : 0,
          answer["interval"]["low"]["value"].get<double>(), answer["interval"]["high"]["value"].get<double>(),
          answer["verdict"] == "one temperature"};
      const double truth = beds[k].temperature();
      if (!(stated.low <= truth && truth <= stated.high))
        std::printf("  bed %zu, %.2f T_c, %u disks on %.1f D: %.4f to %.4f for %.4f\n", k, beds[k].reduced,
                    beds[k].bed.count, beds[k].bed.width, stated.low, stated.high, truth);
      photographs.add(stated, beds[k].reduced, truth);
    }
  }
  std::printf("| known: | T | beds | 95 %% intervals that hold T | one temperature | off by more than 3 errors |\n");
  EXPECT_EQ(refused, 0u);
  photographs.expect_as_stated();
}

}  // namespace
}  // namespace shakebed::fit::simulated
