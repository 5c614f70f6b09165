// The answer of a fit and the judgement of a bed from facts written by hand: what each is taken from, each verdict on
// both sides of its limit, and every form of their sentences.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/stages/answer.hpp"
#include "pipelines/stages/bed_judgement.hpp"
#include "pipelines/stages/hard_disk_trust.hpp"
#include "tests/pipelines/decoded_scene.hpp"
#include "tests/pipelines/lone_stage.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::StartsWith;

// A stage in "from" with this result and, if any, this bed.
class FactsOfAnInput {
 public:
  explicit FactsOfAnInput(const std::string& result, const std::optional<BedDescription>& bed = {}) {
    stage_.add_input("e", *find_stage("extract"));
    write_text(stage_.file("extract.json"), result);
    if (bed) write_text(stage_.file("bed.json"), dump(bed->to_json()));
  }
  const Input& operator*() const { return stage_.inputs()[0]; }

 private:
  LoneStage stage_{*find_stage("fit")};
};
BedDescription bed_seen_by_hand() {
  BedDescription bed;
  bed.count = 50, bed.diameter = 0.004, bed.width = 0.06, bed.gravity = 9.81, bed.mass = 1e-4;
  return bed;
}

TEST(FactsForAnAnswer, AreThoseOfItsInput) {
  // 0.5 px of 0.2 mm are 0.1 mm: 0.025 of 4 mm.
  const FactsOfAnInput full(R"({ "diameter": {"value": 0.004}, "scale": {"value": 2e-4, "std_error": 4e-6},
      "floor": {"value": 300, "std_error": 0.5}, "contact_duration_effect": {"value": 0.03}, "shaken": true,
      "objections": [{"why": "Dark.", "advice": "Light it."}, {"why": "Blurred."}] })",
                            bed_seen_by_hand()),
      empty("{}");
  EXPECT_DOUBLE_EQ(origin_error(*full), 0.025);
  EXPECT_DOUBLE_EQ(scale_error(*full), 0.02);
  EXPECT_DOUBLE_EQ(contact_duration_effect(*full), 0.03);
  EXPECT_DOUBLE_EQ(width_between_walls(*full), 15);
  EXPECT_TRUE(is_shaken(*full));
  const std::vector<fit::Objection> objections = objections_of(*full);
  ASSERT_EQ(objections.size(), 2U);
  EXPECT_EQ(objections[0].why + objections[0].advice, "Dark.Light it.");
  EXPECT_EQ(objections[1].why + objections[1].advice, "Blurred.");
  EXPECT_EQ(origin_error(*empty), 0);
  EXPECT_EQ(scale_error(*empty), 0);
  EXPECT_EQ(contact_duration_effect(*empty), 0);
  EXPECT_EQ(width_between_walls(*empty), 0);
  EXPECT_FALSE(is_shaken(*empty));
  EXPECT_TRUE(objections_of(*empty).empty());
}

TEST(FactsForAnAnswer, MayBeMissingOrFalse) {
  BedDescription bed = bed_seen_by_hand();
  bed.periodic = true;
  EXPECT_EQ(width_between_walls(*FactsOfAnInput("{}", bed)), 0);
  EXPECT_EQ(width_between_walls(*FactsOfAnInput(R"({"walls_are_frame_sides": true})", bed_seen_by_hand())), 0);
  EXPECT_EQ(width_between_walls(*FactsOfAnInput(R"({"walls_are_frame_sides": false})", bed_seen_by_hand())), 15);
  EXPECT_FALSE(is_shaken(*FactsOfAnInput(R"({"shaken": false})", bed_seen_by_hand())));
  bed.amplitude = 0.001;
  EXPECT_TRUE(is_shaken(*FactsOfAnInput(R"({"shaken": false})", bed)));
  bed.amplitude = 0;
  EXPECT_FALSE(is_shaken(*FactsOfAnInput("{}", bed)));
  EXPECT_EQ(scale_error(*FactsOfAnInput(R"({"scale": {"value": 0, "std_error": 1}})")), 0);
  EXPECT_EQ(scale_error(*FactsOfAnInput(R"({"scale": {"value": 2e-4, "std_error": null}})")), 0);
  EXPECT_EQ(scale_error(*FactsOfAnInput(R"({"scale": {"value": null, "std_error": 1}})")), 0);
  EXPECT_EQ(origin_error(*FactsOfAnInput(R"({"diameter": {"value": 0}, "floor": {"std_error": 1},
      "scale": {"value": 1}})")),
            0);
}

// Temperatures that are not there, or below 0, are none; one without an error has the error 0.
TEST(FactsForAnAnswer, AreTemperaturesThatCanBe) {
  const auto x_of = [](const std::string& text) { return kinetic_temperatures(*FactsOfAnInput(text), std::nullopt).x; };
  EXPECT_FALSE(x_of("{}"));
  EXPECT_FALSE(x_of(R"({"temperature_x": {"value": null}})"));
  EXPECT_FALSE(x_of(R"({"temperature_x": {"value": -0.1}})"));
  ASSERT_TRUE(x_of(R"({"temperature_x": {"value": 0}})"));
  const auto plain = x_of(R"({"temperature_x": {"value": 0.3, "std_error": null}})");
  ASSERT_TRUE(plain);
  EXPECT_EQ(plain->value, 0.3);
  EXPECT_EQ(plain->std_error, 0);
}

// --- sentences

fit::Answer a_range(double low, double high) {
  fit::Answer answer;
  answer.status = fit::FitStatus::ok, answer.verdict = fit::Verdict::no_single_temperature, answer.why = "it varies";
  answer.temperature = 0.5 * (low + high), answer.std_error = 0.3;
  answer.interval = {fit::FitStatus::ok, low, high, 0};
  return answer;
}

TEST(AnswerOfARange, HasNoErrorAndNoConfidence) {
  const Json json = answer_json(a_range(0.1, 0.3), 0.002);
  for (const char* key : {"temperature", "temperature_over_mg"}) {
    EXPECT_TRUE(json[key]["std_error"].is_null()) << key;
    EXPECT_FALSE(json[key]["value"].is_null()) << key;
  }
  EXPECT_TRUE(json["interval"]["confidence"].is_null());
  EXPECT_FALSE(json.contains("temperature_x"));
  EXPECT_TRUE(is_range(json));
  EXPECT_FALSE(is_one_temperature(json["verdict"].get<std::string>()));
  EXPECT_TRUE(is_one_temperature("one temperature"));
  EXPECT_FALSE(is_range(Json{{"verdict", "one temperature"}}));
}

TEST(AnswerOfARange, IsReadFromItsEnds) {
  EXPECT_EQ(answer_text(answer_json(a_range(0, 0.3), std::nullopt)),
            "T below 0.3 m g D. No single temperature: it varies");
  EXPECT_EQ(answer_text(answer_json(a_range(0, 0.3), 0.002)), "T/(m g) below 0.6 mm. No single temperature: it varies");
  EXPECT_EQ(answer_text(answer_json(a_range(0, 0), std::nullopt)), "T = 0. No single temperature: it varies");
  EXPECT_EQ(answer_text(answer_json(a_range(0.1, 0.3), std::nullopt)),
            "T between 0.1 and 0.3 m g D. No single temperature: it varies");
}

TEST(AnswerWithoutANumber, SaysWhy) {
  fit::Answer answer;
  answer.status = fit::FitStatus::not_converged, answer.why = "too few heights", answer.advice = "measure more";
  const Json json = answer_json(answer, 0.002);
  EXPECT_EQ(json.size(), 4U);
  EXPECT_EQ(json["advice"], "measure more");
  EXPECT_EQ(verdict_text(json), "no temperature can be determined");
  EXPECT_EQ(answer_text(json), "No temperature can be determined: too few heights");
}

// 2 mm of 4 mm: T/(m g) = 0.5 D; where T is 0 there is no ratio.
TEST(ScaleOfAnAnswer, IsTheLengthOverTheNumber) {
  const AnswerScale scale =
      answer_scale(Json::parse(R"({"temperature": {"value": 0.5}, "temperature_over_mg": {"value": 0.002}})"));
  EXPECT_STREQ(scale.name, "T/(m g)");
  EXPECT_STREQ(scale.unit, "mm");
  EXPECT_DOUBLE_EQ(scale.factor, 4);
  for (const char* text : {R"({"temperature": {"value": 0}, "temperature_over_mg": {"value": 0}})",
                           R"({"temperature": {"value": 0.5}})", "{}"}) {
    EXPECT_STREQ(answer_scale(Json::parse(text)).unit, "m g D") << text;
    EXPECT_EQ(answer_scale(Json::parse(text)).factor, 1) << text;
  }
}

TEST(AnswerOfASimulatedBed, HasTheBedsJudgement) {
  Json answer{{"why", "So."}, {"advice", "Go on."}};
  const Json before = answer;
  add_judgement(Json::parse(R"({"judgement": {"verdict": "holds", "why": "W.", "advice": "A."}})"), answer);
  add_judgement(Json::parse("{}"), answer);
  EXPECT_EQ(answer, before);
  add_judgement(Json::parse(R"({"judgement": {"verdict": "beds differ", "why": "W.", "advice": "A."}})"), answer);
  EXPECT_EQ(answer["why"], "So. The simulated bed: W.");
  EXPECT_EQ(answer["advice"], "Go on. The simulated bed: A.");
  EXPECT_FALSE(speaks_against(Json()));
  EXPECT_FALSE(speaks_against(Json::object()));
}

// --- the judgement of a bed

struct JudgedBed {
  double width = 10.3, restitution = 0.9, friction = 0, tangential = 0, gamma = 4, contact_duration = 1e-4;
};
SceneOptions judged_scene(const JudgedBed& bed) {
  std::vector<Problem> problems;
  SceneOptions options = tests::decoded_scene(
      fmt::format(R"({{ "disks": {{ "count": 61, "restitution": {}, "friction": {}, "tangential_restitution": {},
      "contact_duration": {} }}, "box": {{ "width": {} }},
      "floor": {{ "motion": "sinusoidal", "gamma": {}, "frequency": 0.5 }} }})",
                  bed.restitution, bed.friction, bed.tangential, bed.contact_duration, bed.width, bed.gamma),
      problems, true);
  EXPECT_TRUE(problems.empty());
  return options;
}
// Of a bed whose numbers all hold.
Json good_numbers() {
  return Json::parse(R"({ "temperature_x": {"value": 0.2, "std_error": 0.003, "spread": 0.004, "within": 0.004},
      "temperature_z": {"value": 0.4, "std_error": 0.01, "spread": 0.01, "within": 0.01},
      "center_of_mass_rise": {"value": 1.5, "std_error": 0.02, "spread": 0.02, "within": 0.02},
      "drift_temperature_x": {"value": 0.001, "std_error": 0.004},
      "contact_duration_effect": {"value": 0.01}, "elastic_share": {"value": 0.04} })");
}
Json judgement_on(const JudgedBed& bed, const std::string& changes = "{}", std::size_t beds = 4) {
  Json numbers = good_numbers();
  numbers.merge_patch(Json::parse(changes));
  return judgement_of(judged_scene(bed), numbers, beds);
}
std::string verdict_on(const JudgedBed& bed, const std::string& changes = "{}", std::size_t beds = 4) {
  return judgement_on(bed, changes, beds)["verdict"].get<std::string>();
}

TEST(JudgementOfABed, HoldsWhereNothingSpeaksAgainstIt) {
  const Json four = judgement_on({});
  EXPECT_EQ(four["verdict"], "holds");
  EXPECT_FALSE(speaks_against(four));
  EXPECT_THAT(four["why"].get<std::string>(),
              StartsWith("4 beds agree, and none of them changed while it was measured. Hard disks agree with soft "
                         "spheres that touch for 10 us in the nearest bed of the study (e = 0.9, friction 0, Gamma = "
                         "4, N D/W = 4.85"));
  EXPECT_EQ(four["advice"], "Quote the numbers with their errors.");
  const JudgedBed elastic{.restitution = 1};
  EXPECT_EQ(judgement_on(elastic, "{}", 1)["why"], "The bed did not change while it was measured.");
  EXPECT_EQ(judgement_on(elastic, R"({"energy_ledger": {"step_error": 1e-9}})", 1)["why"],
            "The bed did not change while it was measured. The disks were simulated as soft disks while the bed was "
            "pressed on the floor.");
}

TEST(JudgementOfABed, NamesEachObjection) {
  const Json one = judgement_on({}, "{}", 1);
  EXPECT_EQ(one["verdict"], "one bed");
  EXPECT_TRUE(speaks_against(one));
  EXPECT_THAT(one["why"].get<std::string>(), StartsWith("The errors are those of a single bed. "));
  EXPECT_THAT(one["why"].get<std::string>(), HasSubstr("Hard disks agree with"));
  EXPECT_EQ(one["advice"], "Run several \"replicas\" (4 by default).");
  EXPECT_EQ(verdict_on({.restitution = 1}, "{}", 1), "holds") << "a bed that dissipates nothing keeps no memory";
  EXPECT_EQ(verdict_on({.width = 10}), "rows lock");
  const Json drifts = judgement_on({}, R"({"drift_temperature_x": {"value": -0.05, "std_error": 0.01}})");
  EXPECT_EQ(drifts["verdict"], "still changing");
  EXPECT_THAT(drifts["why"].get<std::string>(), StartsWith("The bed still changes while it is measured: T_x is lower "
                                                           "by 25 % in the second half of the time. "));
  EXPECT_EQ(drifts["advice"], "Give a longer \"settle\".");
  const Json differ = judgement_on({}, R"({"temperature_z": {"spread": 0.05}})");
  EXPECT_EQ(differ["verdict"], "beds differ");
  EXPECT_THAT(differ["why"].get<std::string>(),
              StartsWith("The 4 beds differ by more than chance: the standard deviation of T_z between beds is 0.05, "
                         "and the stated error of each bed is 0.01. "));
  EXPECT_EQ(verdict_on({.friction = 0.3}), "real contacts may matter");
  EXPECT_EQ(verdict_on({.friction = 0.3, .tangential = 0.8}), "holds");
}

// The study covers the bed with its own contact duration, 1e-4, and no longer one.
TEST(JudgementOfABed, AllowsTwoPercentForTheContactDuration) {
  const JudgedBed slow{.contact_duration = 2e-3};
  EXPECT_EQ(verdict_on(slow), "holds");
  EXPECT_EQ(verdict_on(slow, R"({"contact_duration_effect": {"value": 0.02}})"), "holds");
  const Json long_one = judgement_on(slow, R"({"contact_duration_effect": {"value": 0.025}})");
  EXPECT_EQ(long_one["verdict"], "contact duration too long");
  EXPECT_EQ(long_one["why"],
            "T may be too high by about 2.5 % or more, because the contact duration t_c makes 4 % of the contacts "
            "elastic.");
  EXPECT_EQ(verdict_on({}, R"({"contact_duration_effect": {"value": 0.025}})"), "holds");
  EXPECT_EQ(verdict_on({.contact_duration = 1.0005e-4}, R"({"contact_duration_effect": {"value": 0.025}})"), "holds");
  EXPECT_EQ(verdict_on({.contact_duration = 1.0011e-4}, R"({"contact_duration_effect": {"value": 0.025}})"),
            "contact duration too long");
}

TEST(JudgementOfABed, BeginsWithTheGravest) {
  const Json all = judgement_on({.width = 10, .friction = 0.3, .contact_duration = 2e-3},
                                R"({"contact_duration_effect": {"value": 0.025}, "temperature_x": {"spread": 0.5},
                              "drift_temperature_x": {"value": 0.5}})");
  EXPECT_EQ(all["verdict"], "rows lock");
  const auto why = all["why"].get<std::string>();
  std::size_t at = 0;
  for (const char* part : {"rows of disks fit exactly", "T may be too high", "The bed still changes",
                           "The 4 beds differ", "With friction 0.3 and no tangential"}) {
    const std::size_t next = why.find(part, at);
    ASSERT_NE(next, std::string::npos) << part << " in " << why;
    at = next;
  }
  EXPECT_THAT(why, Not(HasSubstr("..")));
}

TEST(JudgementOfABed, OfOneAtRestSaysNothingElse) {
  const std::string still = R"({"temperature_x": {"value": 1e-9, "spread": 0.5}, "temperature_z": {"value": 1e-9}})";
  const Json rest = judgement_on({.width = 10, .friction = 0.3}, still, 1);
  EXPECT_EQ(rest["verdict"], "at rest");
  EXPECT_THAT(rest["why"].get<std::string>(), StartsWith("The disks hardly move: T_x and T_z are below "));
  EXPECT_THAT(rest["advice"].get<std::string>(), StartsWith("Use a larger Gamma: "));
  EXPECT_THAT(rest["why"].get<std::string>(), Not(HasSubstr("lock")));
}

TEST(JudgementOfABed, IsALineWithItsNumbers) {
  Json numbers = good_numbers();
  EXPECT_EQ(judgement_text(numbers), "");
  numbers["judgement"] = Json{{"verdict", "one bed"}, {"why", "Why."}, {"advice", "Do."}};
  EXPECT_EQ(judgement_text(numbers),
            "T_x = 0.2 ± 0.003, T_z = 0.4 ± 0.01 m g D, rise = 1.5 ± 0.02 D. One bed: Why. Do.");
  numbers["temperature_x"]["std_error"] = 0, numbers.erase("temperature_z");
  EXPECT_EQ(judgement_text(numbers), "T_x = 0.2, rise = 1.5 ± 0.02 D. One bed: Why. Do.");
}

// --- the study of record

// The numbers by which hard disks are trusted are those of the table that users read, in whole per cent.
TEST(StudyOfHardDisks, IsThatOfTheManual) {
  std::istringstream manual(read_text(SHAKEBED_SOFT_SPHERES_PAGE));
  std::string line;
  HardDiskScene of;
  int layers = 0;
  std::size_t compared = 0;
  while (std::getline(manual, line)) {
    double e = 0, friction = 0, gamma = 0, x = 0, x_error = 0, z = 0, z_error = 0;
    if (std::sscanf(line.c_str(), "| %lf | %lf | %d | %lf | soft, 10 us", &e, &friction, &layers, &gamma) == 4)
      of.restitution = e, of.friction = friction, of.gamma = gamma;
    if (std::sscanf(line.c_str(), "| | | | | t_c 1.4 us | %lf \u00b1 %lf | %lf \u00b1 %lf |", &x, &x_error, &z,
                    &z_error) != 4)
      continue;
    const auto study = hard_disk_study();
    const auto bed = std::find_if(study.begin(), study.end(), [&](const HardDiskBed& one) {
      return one.restitution == of.restitution && one.friction == of.friction && one.gamma == of.gamma &&
             std::abs(one.column_number - 0.97 * layers) < 0.1;  // a row of 20 disks in 20.6 D
    });
    ASSERT_NE(bed, study.end()) << line;
    constexpr double rounding = 0.51;
    EXPECT_NEAR(100 * (bed->ratio_x - 1), x, rounding) << line;
    EXPECT_NEAR(100 * bed->error_x, x_error, rounding) << line;
    EXPECT_NEAR(100 * (bed->ratio_z - 1), z, rounding) << line;
    EXPECT_NEAR(100 * bed->error_z, z_error, rounding) << line;
    ++compared;
  }
  EXPECT_EQ(compared, hard_disk_study().size());
}

}  // namespace
