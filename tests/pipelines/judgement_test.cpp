// What a bed's numbers are worth, in its first line: each way in which a temperature of a shaken bed can mislead.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "pipelines/formats/json.hpp"
#include "pipelines/stages/hard_disk_trust.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::pipelines {
namespace {

using namespace shakebed::tests;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

struct Shaken {
  int count = 60;
  double width = 10.3;  // D
  double restitution = 0.9, friction = 0, gamma = 4;
  std::string contact_duration = "0.1 us", more{}, stages_after{};
};

// 2 mm beads at 30 Hz; settles for 0.5 s.
std::string recipe(const Shaken& bed, const std::string& measure = "1 s") {
  return fmt::format(
      R"({{ "name": "bed", "stages": [ {{ "stage": "simulate", "id": "bed", "seed": 1, "gravity": "9.81 m/s^2",
      "disks": {{ "count": {}, "diameter": "2 mm", "restitution": {:g}, "friction": {:g}, "contact_duration": "{}" }},
      "box": {{ "width": "{:.6g} mm" }},
      "floor": {{ "motion": "sinusoidal", "frequency": "30 Hz", "gamma": {:g}, "restitution": {:g} }},
      "settle": "0.5 s", "measure": "{}"{} }}{} ] }})",
      bed.count, bed.restitution, bed.friction, bed.contact_duration, 2 * bed.width, bed.gamma, bed.restitution,
      measure, bed.more, bed.stages_after);
}

struct Judged {
  std::string first_line;
  Json observed;
};
Judged judged(const Shaken& bed, const std::string& measure = "1 s") {
  const ScratchFolder folder;
  write_text(folder / "r.json", recipe(bed, measure));
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  return {ran.out.substr(0, ran.out.find('\n')), Json::parse(read_text(folder / "o/bed/observables.json"))};
}

TEST(FirstLine, OfBedsThatAgreeSaysThatTheNumbersHold) {
  const Judged bed = judged({}, "3 s");
  EXPECT_THAT(bed.first_line, AllOf(StartsWith("bed: T_x = "), HasSubstr(" ± "), HasSubstr("Holds: 4 beds agree")));
  EXPECT_EQ(bed.observed["judgement"]["verdict"], "holds");
}

TEST(FirstLine, OfABedThatLiesStillSaysSo) {
  const Judged bed = judged({.gamma = 0.7});
  EXPECT_EQ(bed.observed["judgement"]["verdict"], "at rest");
  EXPECT_THAT(bed.first_line, HasSubstr("At rest: The disks hardly move"));
}

// A bed that was never pressed does not.
TEST(FirstLine, OfABedThatWasPressedSaysThatItsDisksWereSoft) {
  const std::string soft = "The disks were simulated as soft disks while the bed was pressed on the floor.";
  const Judged bed = judged({.friction = 0, .gamma = 0.7, .contact_duration = "10 us"});
  EXPECT_THAT(bed.first_line, HasSubstr(soft));
  EXPECT_NE(bed.observed["energy_ledger"]["step_error"], 0);
  EXPECT_THAT(judged({.friction = 0.3}).first_line, Not(HasSubstr(soft)));
}

TEST(FirstLine, OfOneBedSaysThatItsErrorIsNotTheNextBeds) {
  const Judged bed = judged({.more = R"(, "replicas": 1)"});
  EXPECT_THAT(bed.first_line, HasSubstr("One bed: The errors are those of a single bed. Another seed"));
  EXPECT_EQ(bed.observed["judgement"]["verdict"], "one bed");
}

TEST(FirstLine, OfALongContactDurationSaysByHowMuchTIsTooHigh) {
  const Judged bed = judged({.contact_duration = "50 us"});
  EXPECT_THAT(bed.first_line,
              AllOf(HasSubstr("Contact duration too long: T may be too high by about "), HasSubstr("t_c makes ")));
}

TEST(FirstLine, OfABoxOfWholeBeadsSaysThatRowsLock) {
  const Judged bed = judged({.width = 10.0}, "0.2 s");
  EXPECT_THAT(bed.first_line, AllOf(HasSubstr("Rows lock: The box is 10 diameters wide, exactly 10"),
                                    HasSubstr("use 19.4 mm (9.7 D) or 20.6 mm (10.3 D)")));
}

TEST(FirstLine, OfRoughBeadsWithoutTangentialRestitutionSaysSo) {
  const Judged bed = judged({.friction = 0.5});
  EXPECT_THAT(bed.first_line,
              HasSubstr("Real contacts may matter: With friction 0.5 and no tangential restitution T is "
                        "10 to 25 % lower"));
}

TEST(FirstLine, OfAFitIsItsAnswerWithWhatSpeaksAgainstTheBed) {
  const ScratchFolder folder;
  write_text(folder / "r.json",
             recipe({.more = R"(, "replicas": 1)",
                     .stages_after = R"(, { "stage": "fit", "from": "bed", "sweep": false, "compare": false })"}));
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const std::string first = ran.out.substr(0, ran.out.find('\n'));
  EXPECT_THAT(first, AllOf(StartsWith("fit: T/(m g) between "), HasSubstr("No single temperature: "),
                           HasSubstr("The simulated bed: The errors are those of a single bed")));
  EXPECT_THAT(ran.out, Not(HasSubstr("bed: T_x"))) << "said once";
}

TEST(FirstLine, OfABedInABathIsNotJudged) {
  const ScratchFolder folder;
  write_text(folder / "r.json", R"({ "name": "bath", "stages": [ { "stage": "simulate", "id": "bed", "units": "reduced",
    "disks": { "count": 40 }, "box": { "width": 10.3, "sides": "periodic" }, "start_temperature": 1,
    "bath": { "kind": "andersen", "temperature": 1, "rate": 0.3 }, "settle": 10, "measure": 40 } ] })");
  const ProgramResult ran = run_shakebed({"run", "r.json", "--out", "o", "--quiet"}, folder.path());
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_FALSE(Json::parse(read_text(folder / "o/bed/observables.json")).contains("judgement"));
  EXPECT_THAT(ran.out, StartsWith("results: "));
}

// The nearest bed of the study speaks, friction apart; a bed that none is near to is not spoken of.
TEST(HardDiskTrust, IsThatOfTheNearestBedOfTheStudy) {
  for (const HardDiskBed& bed : hard_disk_study()) {
    const HardDiskTrust trust = trust_in_hard_disks(
        {bed.restitution, bed.friction, std::pow(bed.restitution, 1.75), bed.gamma, bed.column_number});
    constexpr double part = 0.05;
    const bool differs =
        std::abs(bed.ratio_x - 1) > part + 2 * bed.error_x || std::abs(bed.ratio_z - 1) > part + 2 * bed.error_z;
    EXPECT_EQ(trust.covered, differs || std::max(bed.error_x, bed.error_z) <= part);
    EXPECT_EQ(trust.agrees, !differs);
    if (!trust.covered) continue;
    EXPECT_THAT(trust.why, HasSubstr(fmt::format("e = {:g}, friction {:g}, Gamma = {:g}", bed.restitution, bed.friction,
                                                 bed.gamma)));
    const auto percent = [](double ratio, double error) {
      return fmt::format("{:+.2g} ± {:.2g} %", 100 * ratio - 100, 100 * error);
    };
    EXPECT_THAT(trust.why, HasSubstr("T_x " + percent(bed.ratio_x, bed.error_x)));
    EXPECT_THAT(trust.why, HasSubstr("T_z " + percent(bed.ratio_z, bed.error_z)));
  }
  const HardDiskTrust far = trust_in_hard_disks({0.3, 0, 0, 20, 100});
  EXPECT_FALSE(far.covered);
  EXPECT_TRUE(far.agrees);
  EXPECT_THAT(far.why, IsEmpty());
}

}  // namespace
}  // namespace shakebed::pipelines
