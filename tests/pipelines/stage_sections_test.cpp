// What each stage shows of its result: on the page, in the summary and on the terminal, of results made by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "fit/audit/audit.hpp"
#include "pipelines/stages/stage.hpp"
#include "pipelines/stages/theory.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class StageSections : public testing::Test {
 protected:
  std::string html(const char* kind, ReportPlace place, const std::string& result) {
    std::string out;
    for (const ReportSection& section : find_stage(kind)->pages.sections)
      if (section.place == place) out += section.html(finished(kind, result), pictures_);
    return out;
  }
  std::string terminal(const char* kind, const std::string& result) {
    return find_stage(kind)->pages.terminal(finished(kind, result));
  }
  std::string summary(const char* kind, const std::string& result) {
    return find_stage(kind)->pages.markdown(finished(kind, result));
  }
  FinishedStage finished(const char* kind, const std::string& result) {
    return {{"an<id>", kind, folder_.path(), std::string(find_stage(kind)->result)}, Json::parse(result)};
  }
  ScratchFolder folder_;
  int pictures_ = 0;
};

const std::string one_temperature =
    R"("verdict": "one temperature", "why": "all agree", "advice": "Quote it.", "model": "enskog",
    "temperature": {"value": 0.1, "std_error": 0.01}, "temperature_over_mg": {"value": 0.0003, "std_error": 0.00003},
    "interval": {"low": {"value": 0.08}, "high": {"value": 0.12}}, "temperature_x": {"value": 0.11, "std_error": 0.02},
    "solid_height": {"value": 4.25, "std_error": 0.5, "unit": "D"})";

TEST_F(StageSections, OfAFitBeginWithItsAnswer) {
  const std::string lead = html("fit", ReportPlace::lead, "{ \"answer\": {" + one_temperature + "} }");
  EXPECT_THAT(lead, HasSubstr("<section class=\"answer good-answer\" aria-label=\"the answer\">\n<p "
                              "class=\"headline\"><span class=\"number\">"
                              "T/(m g) = <data value=\"0.3\">0.3</data> ± 0.03 mm</span> <span class=\"verdict "
                              "good\">One temperature</span></p>\n"
                              "<p>All agree</p>\n"));
  EXPECT_THAT(lead, HasSubstr("<dt>95 % interval</dt><dd>0.24 to 0.36 mm</dd>"));
  EXPECT_THAT(lead, HasSubstr("<dt>kinetic T<sub>x</sub> /(m g)</dt><dd>0.33 ± 0.06 mm</dd>"));
  EXPECT_THAT(lead, Not(HasSubstr("T<sub>z</sub>")));
  EXPECT_THAT(lead, HasSubstr("<dt>height of the solid</dt><dd>4.25 ± 0.50 D</dd>"));
  EXPECT_THAT(lead, HasSubstr("<dt>model</dt><dd>enskog</dd>"));
  EXPECT_THAT(lead, HasSubstr("<p class=\"soft\">Quote it.</p>\n</section>\n"));
  const auto range = [&](const std::string& low, const std::string& high) {
    return html(
        "fit", ReportPlace::lead,
        R"({ "answer": { "verdict": "no single temperature", "temperature": {"value": 0.1}, "interval": {"low": {"value": )" +
            low + R"(}, "high": {"value": )" + high + "}} } }");
  };
  EXPECT_THAT(
      range("0.08", "0.12"),
      AllOf(HasSubstr("bad-answer"), Not(HasSubstr("95 %")),
            HasSubstr("T between <data value=\"0.08\">0.08</data> and <data value=\"0.12\">0.12</data> m g D")));
  EXPECT_THAT(range("0", "0.12"), HasSubstr("T below <data value=\"0.12\">0.12</data> m g D"));
  EXPECT_THAT(range("0", "0"), HasSubstr("<span class=\"number\">T = 0</span>"));
  EXPECT_THAT(
      html("fit", ReportPlace::lead, R"({ "answer": { "why": "too few" } })"),
      HasSubstr("<span class=\"number\"></span> <span class=\"verdict bad\">No temperature can be determined</span>"));
  EXPECT_EQ(html("fit", ReportPlace::lead, "{}"), "");
}

TEST_F(StageSections, OfAFitHaveItsNumbersAndModels) {
  const std::string own =
      R"("model": "m", "solid_height": {"value": 4, "unit": "D"}, "window": {"low": {"value": 1, "unit": "D"}, "high": {"value": 2, "unit": "D"},
      "bins": 7, "rule": "by rule"})";
  EXPECT_EQ(html("fit", ReportPlace::facts, "{" + own + "}"),
            "<div><dt>height of the solid, by m alone</dt><dd>4 D</dd></div>\n");
  EXPECT_EQ(html("fit", ReportPlace::facts, "{" + own + R"(, "describes_data": false})"), "");
  EXPECT_EQ(html("fit", ReportPlace::facts, "{" + own + ", \"answer\": {" + one_temperature + "}}"), "")
      << "the answer has one";
  EXPECT_EQ(html("fit", ReportPlace::facts, "{}"), "");
  const std::string banner =
      html("fit", ReportPlace::banner, R"({ "describes_data": false, "model": "m", "why_not": "off" })");
  EXPECT_THAT(banner, HasSubstr("</strong>an&lt;id&gt; (m): off. Do not quote a temperature from this fit.</div>"));
  EXPECT_EQ(html("fit", ReportPlace::banner, R"({ "describes_data": false, "answer": {} })"), "");
  EXPECT_EQ(html("fit", ReportPlace::banner, "{}"), "");
  const std::string fit =
      html("fit", ReportPlace::fits,
           "{" + own + R"(, "describes_data": false, "why_not": "off", "temperature": {"value": 0.25, "unit": "m g D"},
      "chi2_per_dof": 1.5, "models": [ {"model": "a", "status": "ok", "temperature": {"value": 1}}, {"model": "b", "plateau_density_free": true, "status": "bad"} ]})");
  EXPECT_THAT(fit, HasSubstr("<h2>Fit (an&lt;id&gt;)</h2>\n<p>The model alone does not describe this profile: off. "));
  EXPECT_THAT(fit, HasSubstr("<p class=\"soft\">m; window 1 D to 2 D, 7 bins: by rule.</p>"));
  EXPECT_THAT(fit, HasSubstr("<tr><td>temperature</td><td class=\"number\">0.25 m g D</td></tr>\n<tr><td>solid "
                             "height</td><td class=\"number\">4 D</td></tr>"));
  EXPECT_THAT(fit, HasSubstr("<tr><td>chi2 per dof</td><td class=\"number\">1.5</td></tr>"));
  EXPECT_THAT(fit, HasSubstr("<tr><td>a</td><td class=\"number\">–</td><td class=\"number\">1</td>"));
  EXPECT_THAT(fit, HasSubstr("<tr><td>b, φ₀ free</td><td class=\"number\">–</td>"));
  EXPECT_THAT(html("fit", ReportPlace::fits, "{" + own + "}"), Not(HasSubstr("<table>"))) << "no temperature";
  EXPECT_THAT(html("fit", ReportPlace::fits, "{" + own + R"(, "temperature": {"value": 0.25}, "models": [{}]})"),
              Not(HasSubstr("Fits of other models")));
}

TEST_F(StageSections, OfAFitAreALineOnTheTerminal) {
  const std::string own =
      R"("model": "m", "temperature": {"value": 0.1, "std_error": 0.02, "unit": "m g D"}, "reduced_temperature": {"value": 0.5, "std_error": 0.1})";
  EXPECT_EQ(terminal("fit", "{" + own + R"(, "solid_height": {"value": 4, "std_error": 0.5}})"),
            "an<id> (m alone): T = 0.1 ± 0.02 m g D, T/T_c = 0.5 ± 0.1, solid = 4 ± 0.5 D high\n");
  EXPECT_EQ(
      terminal(
          "fit",
          "{" + own +
              R"(, "temperature_over_mg": {"value": 0.0003, "std_error": 0, "unit": "m"}, "solid_height": {"value": 0}})"),
      "an<id> (m alone): T/(m g) = 0.3 mm, T/T_c = 0.5 ± 0.1, no solid\n");
  EXPECT_EQ(terminal("fit", "{" + own + R"(, "answer": {"why": "too few", "advice": "More."}})"),
            "an<id>: No temperature can be determined: too few More.\n");
  EXPECT_THAT(terminal("fit", "{" + own + ", \"answer\": {" + one_temperature + "}}"),
              HasSubstr("\nan<id> (m alone): T = 0.1"));
  EXPECT_EQ(terminal("fit", "{}"), "");
  EXPECT_EQ(summary("fit", R"({"answer": {"why": "too few", "advice": "More."}})"),
            "**an<id>**: No temperature can be determined: too few More.\n\n");
  EXPECT_EQ(summary("fit", "{}"), "");
}

TEST_F(StageSections, OfAMapHaveItsFormulas) {
  const std::string rows = R"("gamma": {"value": 4, "std_error": 0.5, "unit": "1"}, "readings": [
      {"name": "a", "in_range": true, "jump": {"value": 2}, "reduced_temperature": {"value": 0.5}},
      {"name": "b", "in_range": false, "jump": null, "reduced_temperature": {"value": 9}},
      {"name": "c", "in_range": true, "jump": {"value": 2}, "reduced_temperature": {"value": 0.25}}, {"name": "d", "in_range": true, "reduced_temperature": null}])";
  const std::string page =
      html("map", ReportPlace::maps,
           "{" + rows + R"(, "measured_reduced_temperature": {"value": 0.75}, "simulated": {"beds": 12, "inside": false,
      "at": {"frequency": 20, "initial_height": 10, "mu": 3}, "reduced_temperature": {"value": 0.5}, "temperature_over_mg": {"value": 0.001, "unit": "m"}}})");
  EXPECT_THAT(page, HasSubstr("Γ = 4.00 ± 0.50. The relation"));
  EXPECT_THAT(page, HasSubstr("<p>Measured T/T_c = <strong>0.75</strong></p>"));
  EXPECT_THAT(page, HasSubstr("<p>Interpolated between 12 simulated beds at frequency = 20 Hz, initial_height = 10 D, "
                              "mu = 3: T/T_c = <strong>0.5</strong>, "
                              "T/(m g) = 1 mm; this bed lies outside the table.</p>"));
  EXPECT_THAT(
      page,
      HasSubstr(
          "<tr><td>a</td><td class=\"number\">2</td><td class=\"number\">0.5</td><td class=\"good\">yes</td></tr>"));
  EXPECT_THAT(
      page,
      HasSubstr("<tr><td>b</td><td class=\"number\">–</td><td class=\"number\">9</td><td class=\"bad\">no</td></tr>"));
  EXPECT_THAT(html("map", ReportPlace::maps, "{" + rows + R"(, "simulated": {"beds": 3, "at": {}}})"),
              HasSubstr("<p>The 3 simulated beds give no temperature at .</p>"));
  EXPECT_EQ(terminal("map", "{" + rows + "}"),
            "an<id>: Gamma = 4.00 ± 0.50. From it 2 formulas give T/T_c from 0.25 to 0.5\n");
  EXPECT_EQ(
      terminal(
          "map",
          R"({"gamma": {"value": 4, "std_error": 0.5}, "readings": [{"in_range": true, "reduced_temperature": {"value": 0.5}}]})"),
      "an<id>: Gamma = 4.00 ± 0.50. From it 1 formula gives T/T_c = 0.5\n");
  EXPECT_EQ(terminal("map", R"({"gamma": {"value": 4, "std_error": 0.5}, "readings": []})"),
            "an<id>: Gamma = 4.00 ± 0.50, at which no formula for T applies\n");
  EXPECT_EQ(terminal("map", R"({"gamma": {"value": 4}, "readings": []})"), "");
}

TEST_F(StageSections, OfChecksAndClaimsHaveTheirVerdicts) {
  const std::string checks =
      R"({"checks": [{"passed": true, "pointer": "/a", "expected": "1", "found": "1.1", "note": "n"}, {"passed": false, "pointer": "/b_c", "why": "w", "note": "n"}]})";
  const std::string page = html("check", ReportPlace::checks, checks);
  EXPECT_THAT(page, HasSubstr("<td data-label=\"verdict\" class=\"good\">passed</td><td "
                              "data-label=\"result\"><code>/a</code></td><td data-label=\"expected\">1</td>"
                              "<td data-label=\"found\" class=\"number\">1.1</td><td data-label=\"\">n</td>"));
  EXPECT_THAT(page, HasSubstr("class=\"bad\">failed</td>"));
  EXPECT_THAT(page, HasSubstr("<td data-label=\"\">w</td>"));
  EXPECT_EQ(summary("check", checks),
            "\n## Checks (an&lt;id>)\n\n| | result | expected | found | |\n|---|---|---|---|---|\n| passed | /a | 1 | "
            "1.1 | n |\n"
            "| **failed** | /b\\_c |  |  | w |\n");
  const std::string claims = R"({"verdict_is": "by errors", "claims": [
      {"claim": "T_c grows", "main": true, "verdict": "holds", "claimed": "2", "measured": "2.1", "measured_as": "a way", "place": "Fig. 1"},
      {"claim": "it falls", "verdict": "does not hold", "note": "far off"}, {"claim": "maybe", "main": true, "verdict": "open"}]})";
  const std::string lead = html("claims", ReportPlace::lead, claims);
  EXPECT_THAT(lead, HasSubstr("<section class=\"answer good-answer\" aria-label=\"the claim\">\n<p "
                              "class=\"headline\"><strong>Claim:</strong> T<sub>c</sub> grows <span "
                              "class=\"verdict good\">holds</span>"));
  EXPECT_THAT(lead, HasSubstr("<dd>2.1<br><span class=\"soft\">a way</span></dd>"));
  EXPECT_THAT(lead, HasSubstr("<section class=\"answer \" aria-label=\"the claim\">"));
  EXPECT_THAT(lead, Not(HasSubstr("it falls")));
  const std::string all = html("claims", ReportPlace::claims, claims);
  EXPECT_THAT(all, HasSubstr("<span class=\"bad\">does not hold</span><br><span class=\"soft\">far off</span>"));
  EXPECT_THAT(all, HasSubstr("<span class=\"soft\">open</span></td>"));
  EXPECT_THAT(all, HasSubstr("<td data-label=\"where\">Fig. 1</td>"));
  EXPECT_THAT(all, HasSubstr("<p class=\"soft\">by errors.</p>"));
}

TEST_F(StageSections, OfABedHaveItsTemperaturesAndJudgement) {
  EXPECT_EQ(
      html(
          "simulate", ReportPlace::facts,
          R"({"temperature_x": {"value": 2}, "temperature_x_over_mg": {"value": 0.001, "unit": "m"}, "temperature_z": {"value": 3, "unit": "m g D"}})"),
      "<div><dt>kinetic T<sub>x</sub>/(m g) of the simulated disks (an&lt;id&gt;)</dt><dd>1 mm</dd></div>\n"
      "<div><dt>kinetic T<sub>z</sub> of the simulated disks (an&lt;id&gt;)</dt><dd>3 m g D</dd></div>\n");
  const std::string judged =
      R"({"temperature_x": {"value": 2, "std_error": 0.1}, "temperature_z": {"value": 3}, "center_of_mass_rise": {"value": 1.5, "std_error": 0},
      "judgement": {"verdict": "one bed", "why": "Why.", "advice": "Do."}})";
  EXPECT_EQ(terminal("simulate", judged), "an<id>: T_x = 2 ± 0.1, T_z = 3 m g D, rise = 1.5 D. One bed: Why. Do.\n");
  EXPECT_EQ(summary("simulate", judged),
            "**an<id>**: T_x = 2 ± 0.1, T_z = 3 m g D, rise = 1.5 D. One bed: Why. Do.\n\n");
  EXPECT_THAT(html("simulate", ReportPlace::banner, judged), HasSubstr("<strong>an&lt;id&gt;</strong>: T_x = 2"));
  EXPECT_EQ(terminal("simulate", "{}") + summary("simulate", "{}") + html("simulate", ReportPlace::banner, "{}"), "");
}

// 300 rows of a study are shown.
TEST_F(StageSections, OfAStudyHaveItsTable) {
  const auto rows = [&](int count) {
    std::string csv = "a_b,text\n";
    for (int k = 0; k < count; ++k) csv += "1.23456789,\n";
    write_text(folder_ / "table.csv", csv);
    return html("study", ReportPlace::maps, "{}");
  };
  EXPECT_EQ(html("study", ReportPlace::maps, "{}"), "");
  EXPECT_EQ(rows(0), "");
  const std::string full = rows(300), more = rows(301);
  EXPECT_THAT(full, HasSubstr("<summary>an&lt;id&gt;: 300 rows, which"));
  EXPECT_THAT(full,
              HasSubstr("<tr><td data-label=\"a b\" class=\"number\">1.2346</td><td data-label=\"text\">–</td></tr>"));
  EXPECT_THAT(full, Not(HasSubstr("The first")));
  EXPECT_THAT(more, HasSubstr("<p>The first 300 of 301 rows; all are in table.csv.</p>"));
  EXPECT_EQ(more.find("The first"), more.rfind("The first"));
}

// Pictures in the order of the recipe; the leading one apart.
TEST_F(StageSections, OfADrawingStageHaveItsPictures) {
  for (const char* name : {"a", "b", "c"}) write_text(folder_ / (std::string(name) + ".svg"), "<svg></svg>");
  const std::string result = R"({"b": {"lead": true}, "c": {"caption": "C_1"}, "a": {}})";
  const std::string lead = html("chart", ReportPlace::lead_picture, result),
                    rest = html("chart", ReportPlace::figures, result);
  EXPECT_THAT(lead, AllOf(HasSubstr("data-name=\"b\""), Not(HasSubstr("data-name=\"a\"")),
                          HasSubstr("<figcaption>b</figcaption>")));
  EXPECT_THAT(rest, AllOf(Not(HasSubstr("data-name=\"b\"")), HasSubstr("<figcaption>C<sub>1</sub></figcaption>")));
  EXPECT_LT(rest.find("data-name=\"c\""), rest.find("data-name=\"a\""));
  EXPECT_EQ(pictures_, 3);
  write_text(folder_ / "profile.svg", "<svg></svg>");
  EXPECT_THAT(html("figure", ReportPlace::lead_picture, "{}"), HasSubstr("<figcaption>Density against height."));
}

TEST_F(StageSections, OfFramesHaveTheirNumbers) {
  const std::string page =
      html("extract", ReportPlace::frames,
           R"({"scale": {"value": 0.0002, "unit": "m/px"}, "noise": 2.5, "other": 1, "truth": {"recall": 0.5}})");
  EXPECT_THAT(page, HasSubstr("<tr><td>scale</td><td class=\"number\">0.2 mm/px</td></tr>\n<tr><td>noise</td><td "
                              "class=\"number\">2.5</td></tr>"));
  EXPECT_THAT(
      page,
      HasSubstr("<tr><td>recall (compared with the rendered true positions)</td><td class=\"number\">0.5</td></tr>"));
  EXPECT_THAT(page, Not(HasSubstr("other")));
  for (const char* name : {"overlay_4.png", "overlay_1.png", "overlay_3.png", "overlay_2.png", "bead.png"})
    write_text(folder_ / name, "abc");
  const std::string pictures = html("extract", ReportPlace::frames, "{}");
  EXPECT_THAT(pictures, AllOf(HasSubstr("Disks found in frame 1. "), HasSubstr("Disks found in frame 3. "),
                              Not(HasSubstr("Disks found in frame 4. "))));
  EXPECT_THAT(pictures, HasSubstr("src=\"data:image/png;base64,YWJj\"><figcaption>Mean picture of a bead"));
  write_text(folder_ / "film.json", "{}");
  EXPECT_THAT(html("extract", ReportPlace::frames, "{}"), Not(HasSubstr("Disks found in frame")));
}

TEST_F(StageSections, OfAnInferenceHaveItsParameters) {
  const std::string parameters =
      R"("parameters": {"restitution": {"unit": "1", "prior_low": 0.5, "prior_high": 1, "median": 0.778, "low_68": 0.737, "high_68": 0.802,
      "low_95": 0.7, "high_95": 0.85, "why": "T_c"}, "gamma_f": {"unit": "Hz", "prior_low": 1, "prior_high": 2, "median": 1.5, "low_68": 1.25, "high_68": 1.75, "low_95": 1.125, "high_95": 1.875, "why": ""}})";
  const std::string result = R"({"agreement": {"statement": "They agree."}, )" + parameters +
                             R"(, "photographs": [{"show": "average", "prior": 0.5, "posterior": 0.75},
      {"show": "0.25", "prior": 0.5, "posterior": 0.25}, {"show": "0.5", "prior": 0, "posterior": 0}],
      "best": [{"values": {"restitution": 0.8}, "photographs": "0.25", "targets": {"density": {"value": 2, "unit": "1", "difference_in_errors": 1.25, "measured": 1.5, "measured_error": 0.25},
                "profile": {"heights": 8, "largest_difference_in_errors": 2.5}, "shift": {"value": null, "unit": "D", "difference_in_errors": null, "measured": 3, "measured_error": 0}}}],
      "assumed": {"values": {"restitution": 0.9}, "targets": {}}, "narrowing": [{"measurement": "shift", "reduction": 0.4}]})";
  EXPECT_EQ(terminal("infer", result),
            "an<id>: restitution = 0.778 (68 %: 0.737 to 0.802)\nan<id>: gamma f = 1.5 Hz (68 %: 1.25 to 1.75)\nThey "
            "agree.\n");
  EXPECT_EQ(summary("infer", result),
            "\n## Parameters of the bed\n\n- restitution = 0.778 (68 %: 0.737 to 0.802)\n- gamma f = 1.5 Hz (68 %: "
            "1.25 to 1.75)\n\nThey agree.\n");
  EXPECT_EQ(terminal("infer", "{}") + summary("infer", "{}"), "");
  write_text(folder_ / "pairs.svg", "<svg></svg>");
  const std::string page = html("infer", ReportPlace::claims, result);
  EXPECT_THAT(page, HasSubstr(">0.5 to 1</td>"));
  EXPECT_THAT(page, HasSubstr(">1.5 Hz</td>"));
  EXPECT_THAT(page, HasSubstr(">1.12 to 1.88 Hz</td>"));
  EXPECT_THAT(page, HasSubstr(">T<sub>c</sub></td>"));
  EXPECT_THAT(page, HasSubstr("<td>bed 1, run again</td><td>restitution 0.8</td><td>phase 0.25</td><td>2 "
                              "(+1.2)</td><td>(2.5 at most)</td><td>– (no fit)</td>"));
  EXPECT_THAT(page, HasSubstr("<td>– (no fit)</td>"));
  EXPECT_THAT(page, HasSubstr("<td>measured</td><td></td><td></td><td>1.50 ± 0.25</td><td>8 heights</td><td>3 D</td>"));
  EXPECT_THAT(page, HasSubstr("<td>scene as written in the recipe</td><td>restitution 0.9</td><td>average</td>"));
  EXPECT_THAT(page,
              HasSubstr("photographs show: the average: 75 % (prior: 50 %); phase 0.25: 25 % (prior: 50 %).</p>"));
  EXPECT_THAT(page, HasSubstr("that of shift would narrow the parameters most: it would remove 40 % of their"));
  EXPECT_EQ(html("infer", ReportPlace::claims, "{}"), "");
}

// A line of the difference where the printed number is not the one recomputed.
TEST(AuditText, HasADifferenceWhereThereIsOne) {
  std::size_t different = 0, lines = 0, explained = 0;
  const std::string text = audit_text();
  const Json json = audit_json();
  const auto rows = shakebed::fit::audit();
  ASSERT_EQ(json["rows"].size(), rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    different += rows[k].is_numeric && rows[k].difference != 0;
    explained += !rows[k].explanation.empty();
    EXPECT_EQ(json["rows"][k].contains("difference"), rows[k].is_numeric);
    EXPECT_THAT(text, HasSubstr(rows[k].quantity + " ["));
    if (rows[k].is_numeric) {
      EXPECT_EQ(json["rows"][k]["difference"], rows[k].difference);
      EXPECT_EQ(json["rows"][k]["recomputed"], rows[k].recomputed);
      EXPECT_NEAR(rows[k].recomputed - rows[k].printed, rows[k].difference, 1e-12 * std::abs(rows[k].printed));
    }
  }
  for (std::size_t at = text.find("  difference: "); at != std::string::npos; at = text.find("  difference: ", at + 1))
    ++lines;
  EXPECT_EQ(lines, different);
  EXPECT_GT(different, 0U);
  EXPECT_GT(explained, 0U);
  EXPECT_EQ(static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')),
            3 * rows.size() + different + explained);
}

}  // namespace
