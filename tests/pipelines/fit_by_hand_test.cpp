// The fit stage on files made by hand: a library of beds as its model, what it takes of the beds before it, which
// errors it uses, and what it cannot resample.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/fit_profile.hpp"
#include "fit/theory/expansion.hpp"
#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::fit_by_hand {
namespace {

using pipelines::BedDescription;
using pipelines::dump;
using pipelines::find_stage;
using pipelines::Json;
using pipelines::number_text;
using testing::HasSubstr;
using testing::Not;

const std::string smoothed = "# kernel: gaussian:0.5\n";

// A solid that ends at 8 below a tail; it moves with ln T, so that beds at other temperatures give it exactly,
// if they state no errors.
std::string profile_at(double temperature, const std::string& head = smoothed, double error = 0.01) {
  std::string text = head + "height,number_density" + (error > 0 ? ",std_error\n" : "\n");
  for (int i = 0; i < 60; ++i) {
    const double z = 4 + 0.125 * i;
    const double density = (z < 8 ? 1.1 : 1.1 * std::exp(-(z - 8) / 0.8)) +
                           0.1 * std::exp(-(z - 9) * (z - 9)) * std::log(temperature / 0.12);
    text += number_text(z) + "," + number_text(density) + (error > 0 ? "," + number_text(error) : "") + "\n";
  }
  return text;
}
Json bed_json(double bath, const std::function<void(BedDescription&)>& change = {}) {
  BedDescription bed;
  bed.reduced = true, bed.count = 118, bed.width = 10, bed.bath_temperature = bath;
  if (change) change(bed);
  return bed.to_json();
}

class FitByHand : public testing::Test {
 protected:
  // A simulate stage with its profile, its bed, and the kinetic temperatures it measured; none: {}.
  void add_bed(const std::string& id, const std::string& profile, const Json& bed,
               const std::string& observables = "{}") {
    fit_.add_input(id, *find_stage("simulate"), id);
    write_text(fit_.file(id + "/profile.csv"), profile);
    write_text(fit_.file(id + "/bed.json"), dump(bed));
    write_text(fit_.file(id + "/observables.json"), observables);
  }
  Json run(const std::string& keys) {
    return fit_.run(R"({ "sweep": false, "compare": false, "answer": false )" + keys + " }");
  }
  std::string refused(const std::string& keys) {
    try {
      run(keys);
    } catch (const pipelines::Error& error) {
      return error.what();
    }
    return "";
  }
  LoneStage fit_{*find_stage("fit")};
};

const std::string matching = R"(, "model": "simulation", "plateau_density": 1.1)";

// A bed at 0.12 between ones at 0.04, 0.08, 0.16 and 0.32. One of them has no bath: its temperature is the mean of its
// two.
TEST_F(FitByHand, MatchesALibrary) {
  add_bed("measured", profile_at(0.12), bed_json(0.7));
  add_bed("coldest", profile_at(0.04, smoothed, 0), bed_json(0.04));
  add_bed("cold", profile_at(0.08, smoothed, 0), bed_json(0),
          R"({ "temperature_x": { "value": 0.06 }, "temperature_z": { "value": 0.1 } })");
  add_bed("warm", profile_at(0.16, smoothed, 0), bed_json(0.16));
  add_bed("hot", profile_at(0.32, smoothed, 0), bed_json(0.32));
  const Json found = run(matching);
  EXPECT_EQ(found["status"], "ok");
  EXPECT_EQ(found["model"], "simulation");
  EXPECT_NEAR(value(found["temperature"]), 0.12, 1e-6);
  EXPECT_NEAR(found["chi2"].get<double>(), 0, 1e-6);
  EXPECT_EQ(found["window"]["bins"], 60);
  EXPECT_EQ(found["dof"], 59);
  EXPECT_EQ(found["window"]["low"]["value"], 4);
  EXPECT_EQ(found["window"]["high"]["value"], 11.375);
  EXPECT_EQ(found["window"]["rule"], "every bin from 1.5 D up");
  EXPECT_NEAR(value(found["interpolation_error"]), 0, 1e-6);
  // Two beds can be tested against the others, fewer than three: nothing is said of the scatter.
  EXPECT_TRUE(found["library_scatter"].is_null());
  std::string library;
  for (const Json& bed : found["library"])
    library += bed["stage"].get<std::string>() + " " + number_text(value(bed["temperature"])) + " ";
  EXPECT_EQ(library, "coldest 0.04 cold 0.08 warm 0.16 hot 0.32 ");
  // N D/W = 11.8 of the bed before it, and Enskog's T_c of that.
  const double critical = fit::critical_temperature(fit::enskog(), {11.8, 1.1}).value;
  EXPECT_NEAR(value(found["critical_temperature"]), critical, 1e-12);
  EXPECT_NEAR(value(found["reduced_temperature"]), 0.12 / critical, 1e-5);
  EXPECT_NEAR(error(found["reduced_temperature"]), error(found["temperature"]) / critical, 1e-12);
  EXPECT_EQ(value(found["column_number"]), 11.8);
  EXPECT_EQ(value(found["plateau_density"]), 1.1);
  EXPECT_NEAR(found["p_value"].get<double>(), 1, 1e-9);
  EXPECT_NEAR(found["aic"].get<double>(), 2, 1e-6);
  EXPECT_NEAR(found["bic"].get<double>(), std::log(60), 1e-6);
  EXPECT_EQ(value(found["statistical_error"]), error(found["temperature"]));
  // Of the tail at T and, for their errors, at T and its error.
  EXPECT_GT(value(found["solid_height"]), 1);
  EXPECT_LT(value(found["solid_height"]), 9);
  EXPECT_GT(error(found["solid_height"]), 0.05);
  EXPECT_GT(error(found["shift"]), 0.05);
  const NumberTable residuals(fit_.output("residuals.csv")), curve(fit_.output("curve.csv"));
  ASSERT_EQ(residuals.rows(), 60U);
  ASSERT_EQ(curve.rows(), 60U);
  for (std::size_t r = 0; r < 60; ++r) {
    EXPECT_NEAR(residuals("model", r), residuals("number_density", r), 1e-5);
    EXPECT_EQ(residuals("used", r), 1);
    EXPECT_EQ(residuals("std_error", r), 0.01);
    EXPECT_EQ(curve("number_density", r), residuals("model", r));
    EXPECT_EQ(curve("smoothed_density", r), residuals("model", r));
  }
}

// Within the limits of the window, both included. What lies outside has no model.
TEST_F(FitByHand, MatchesALibraryInItsWindow) {
  add_bed("measured", profile_at(0.12), bed_json(0.7));
  for (const double t : {0.08, 0.1, 0.14, 0.16, 0.2})
    add_bed("t" + number_text(t), profile_at(t, smoothed, 0), bed_json(t));
  const Json found = run(matching + R"(, "window": { "low": 8, "high": 10 })");
  EXPECT_NEAR(value(found["temperature"]), 0.12, 1e-6);
  EXPECT_EQ(found["window"]["low"]["value"], 8);
  EXPECT_EQ(found["window"]["high"]["value"], 10);
  EXPECT_EQ(found["window"]["bins"], 17);
  EXPECT_EQ(found["window"]["rule"], "every bin from 8 D up");
  EXPECT_NEAR(found["library_scatter"].get<double>(), 0, 1e-6) << "three beds give one another exactly";
  const NumberTable residuals(fit_.output("residuals.csv"));
  double used = 0, modelled = 0;
  for (std::size_t r = 0; r < 60; ++r) used += residuals("used", r), modelled += residuals("model", r) > 0;
  EXPECT_EQ(used, 17);
  EXPECT_EQ(modelled, 17);
  EXPECT_EQ(NumberTable(fit_.output("curve.csv")).rows(), 17U);
  // A profile of the user's own is matched with all beds, the first one too.
  write_text(fit_.file("own.csv"), profile_at(0.12, "# kernel: gaussian:0.5\n# column_number: 5\n"));
  const Json own = run(matching + R"(, "profile": ")" + fit_.file("own.csv").string() + "\"");
  EXPECT_EQ(own["library"].size(), 6U);
  EXPECT_EQ(own["library"][0]["stage"], "measured");
}

// All bins miss by two of their errors: their chance, and the larger error of T.
TEST_F(FitByHand, SaysThatNoBedOfItsLibraryIsLikeIt) {
  add_bed("measured", profile_at(0.12), bed_json(0.7));
  add_bed("cold", profile_at(0.08, smoothed, 0), bed_json(0.08));
  add_bed("warm", profile_at(0.16, smoothed, 0), bed_json(0.16));
  const double good = error(run(matching)["temperature"]);
  std::string text = smoothed + "height,number_density,std_error\n";
  for (int i = 0; i < 49; ++i) {
    const double z = 4 + 0.125 * i;
    text += number_text(z) + "," +
            number_text((z < 8 ? 1.1 : 1.1 * std::exp(-(z - 8) / 0.8)) + (i % 2 ? 0.02 : -0.02)) + ",0.01\n";
  }
  write_text(fit_.file("measured/profile.csv"), text);
  const Json poor = run(matching);
  const double chi2 = poor["chi2"].get<double>();
  EXPECT_NEAR(chi2, 4 * 49, 5);
  EXPECT_NEAR(poor["p_value"].get<double>(), fit::chance_of_chi2(chi2, 48), 1e-15);
  EXPECT_LT(poor["p_value"].get<double>(), 1e-10);
  EXPECT_NEAR(poor["aic"].get<double>(), chi2 + 2, 1e-9);
  EXPECT_NEAR(poor["bic"].get<double>(), chi2 + std::log(49), 1e-9);
  EXPECT_NEAR(error(poor["temperature"]) / good, 2, 0.2);
  EXPECT_THAT(fit_.warnings, testing::Contains(HasSubstr("no bed of the library describes the data")));
}

TEST_F(FitByHand, NamesTheBedThatIsNotOfTheLibrary) {
  add_bed("measured", profile_at(0.12), bed_json(0.7));
  add_bed("cold", profile_at(0.08), bed_json(0.08));
  add_bed("warm", profile_at(0.16), bed_json(0), R"({ "temperature_x": { "value": 0.4 } })");
  const std::string none = "warm: this bed has no temperature, so it cannot be used in a library of beds";
  EXPECT_EQ(refused(matching), none);
  write_text(fit_.file("warm/observables.json"), R"({ "temperature_z": { "value": 0.4 } })");
  EXPECT_EQ(refused(matching), none);
  write_text(fit_.file("warm/observables.json"),
             R"({ "temperature_x": { "value": 0 }, "temperature_z": { "value": 0 } })");
  EXPECT_EQ(refused(matching), none);
  write_text(fit_.file("warm/bed.json"), dump(bed_json(0.16)));
  EXPECT_EQ(refused(matching), "");
  write_text(fit_.file("warm/profile.csv"), profile_at(0.16, "# kernel: top_hat:1\n"));
  EXPECT_THAT(refused(matching), HasSubstr("warm: its profile was measured through the kernel top_hat:1, but the "
                                           "profile to be fitted through gaussian:0.5"));
}

// T is fixed at the mean of both directions; of a bed that states one of them, or none above 0, there is none.
TEST_F(FitByHand, HoldsAMeasuredTemperatureWhereThereIsOne) {
  add_bed("bed", profile_at(0.12), bed_json(0),
          R"({ "temperature_x": { "value": 0.25 }, "temperature_z": { "value": 0.45 } })");
  EXPECT_DOUBLE_EQ(value(run(R"(, "temperature_measured": true)")["temperature"]), 0.35);
  for (const char* observables :
       {R"({ "temperature_x": { "value": 0.3 } })", R"({ "temperature_z": { "value": 0.3 } })",
        R"({ "temperature_x": { "value": 0 }, "temperature_z": { "value": 0 } })"}) {
    write_text(fit_.file("bed/observables.json"), observables);
    EXPECT_EQ(refused(R"(, "temperature_measured": true)"),
              "the simulated bed has no kinetic temperature to which T could be fixed");
  }
}

// The diameter of a bed in SI units; N D/W of a simulated bed, else of the profile. What is given goes before.
TEST_F(FitByHand, TakesItsFactsFromTheBed) {
  const auto in_si = [](BedDescription& bed) {
    bed.reduced = false, bed.diameter = 0.004, bed.width = 0.04, bed.mass = 1;
  };
  add_bed("bed", profile_at(0.12, "# kernel: gaussian:0.5\n# column_number: 9\n"), bed_json(0, in_si));
  const auto length = [](const Json& found) {
    return value(found["temperature_over_mg"]) / value(found["temperature"]);
  };
  const Json own = run("");
  EXPECT_NEAR(length(own), 0.004, 1e-12);
  EXPECT_NEAR(value(own["column_number"]), 11.8, 1e-12);
  const Json given = run(R"(, "diameter": "5 mm", "column_number": 7)");
  EXPECT_NEAR(length(given), 0.005, 1e-12);
  EXPECT_EQ(value(given["column_number"]), 7);
  EXPECT_EQ(BedDescription::read(fit_.output("bed.json")).diameter, 0.004) << "it goes on with the fit";
  write_text(fit_.file("bed/bed.json"), dump(bed_json(0)));
  EXPECT_FALSE(run("").contains("temperature_over_mg")) << "in diameters";
  std::filesystem::remove(fit_.file("bed/bed.json"));
  EXPECT_EQ(value(run("")["column_number"]), 9);
}

// Without a base the answer is that of a hexagonal bed; a base that is given is the answer's, too.
TEST_F(FitByHand, AnswersForABedOnItsBase) {
  const auto answer = [&](const std::string& base) {
    return fit_.run(R"({ "sweep": false, "compare": false, "answer": true)" + base + " }")["answer"].dump();
  };
  const double base = 0.5 - std::sqrt(3) / 4;
  std::string whole = smoothed + "height,number_density,std_error\n";  // a column at 0.5 m g D, to its tail
  const auto column = fit::HydrostaticProfile::of_column(fit::best_of(), 0.5, {9.3, fit::close_packing_density});
  std::vector<double> above, densities(60);
  for (int i = 0; i < 60; ++i) above.push_back(0.25 * (i + 0.5));
  column.sample(above, {KernelKind::gaussian, 0.5}, densities);
  for (std::size_t i = 0; i < above.size(); ++i)
    whole += number_text(above[i] + base) + "," + number_text(densities[i]) + ",0.01\n";
  add_bed("bed", whole, bed_json(0, [](BedDescription& bed) { bed.count = 93; }));
  const std::string plain = answer("");
  EXPECT_THAT(plain, HasSubstr("\"temperature\""));
  EXPECT_EQ(answer(", \"base\": " + number_text(base)), plain);
  EXPECT_NE(answer(", \"base\": 0.5"), plain);
}

TEST_F(FitByHand, TakesNoNumberOfDisksFromPhotographs) {
  fit_.add_input("film", *find_stage("extract"));
  write_text(fit_.file("profile.csv"), profile_at(0.12, "# kernel: gaussian:0.5\n# column_number: 9\n"));
  write_text(fit_.file("bed.json"), dump(bed_json(0)));
  write_text(fit_.file("extract.json"), "{}");
  EXPECT_EQ(value(run("")["column_number"]), 9);
}

// Correlations between heights where the stage has them, unless the errors alone are asked for. Those of profile.csv
// are of no other table and of no file of the user's.
TEST_F(FitByHand, UsesTheErrorsThatAreAskedFor) {
  add_bed("bed", profile_at(0.12), bed_json(0));
  const std::string window = R"(, "window": { "low": 8.5, "high": 11 })", none = R"(, "errors": "diagonal")",
                    asked = R"(, "errors": "covariance")";
  const std::string lacks = "\"errors\": \"covariance\" needs the profile of a simulate or extract stage";
  EXPECT_EQ(refused(window + asked), lacks);
  const auto statistical = [&](const std::string& keys) { return value(run(keys)["statistical_error"]); };
  const double plain = statistical(window);
  std::vector<double> heights, covariance;
  for (int i = 0; i < 60; ++i) {
    heights.push_back(4 + 0.125 * i);
    for (int k = 0; k < 60; ++k) covariance.push_back(1e-4 * std::exp(-0.3 * std::abs(i - k)));
  }
  pipelines::write_covariance_csv(fit_.file("bed/covariance.csv"), heights, covariance, 1000);
  const double with = statistical(window);
  EXPECT_GT(with, 1.2 * plain);
  EXPECT_DOUBLE_EQ(statistical(window + none), plain);
  EXPECT_DOUBLE_EQ(statistical(window + asked), with);
  write_text(fit_.file("bed/profile_phase_00.csv"), profile_at(0.12));
  const std::string phase = window + R"(, "table": "profile_phase_00.csv")";
  EXPECT_DOUBLE_EQ(statistical(phase), plain);
  EXPECT_EQ(refused(phase + asked), lacks);
  const std::string own = window + R"(, "profile": ")" + fit_.file("bed/profile_phase_00.csv").string() + "\"";
  EXPECT_DOUBLE_EQ(statistical(own), plain);
  EXPECT_EQ(refused(own + asked), lacks);
}

TEST_F(FitByHand, SaysWhatABootstrapLacks) {
  const std::string ten = R"(, "bootstrap": 10, "window": { "low": 8.5, "high": 11 })";
  add_bed("bed", profile_at(0.12), bed_json(0));
  EXPECT_EQ(refused(ten), "\"bootstrap\": bed stored no frames; add \"frames\": {\"count\": 640} to it");
  write_text(fit_.file("bed/profile.csv"), profile_at(0.12, "# kernel: none\n"));
  EXPECT_EQ(refused(ten), "\"bootstrap\": the profile was measured without a kernel, but the bootstrap needs a kernel");
}

TEST_F(FitByHand, SaysWhatABootstrapOfPhotographsLacks) {
  const std::string ten = R"(, "bootstrap": 10, "window": { "low": 8.5, "high": 11 }, "column_number": 12)";
  fit_.add_input("film", *find_stage("extract"));
  write_text(fit_.file("profile.csv"), profile_at(0.12));
  const std::string width =
      "\"bootstrap\": the frames do not give the width of the bed; give \"left_wall\" and \"right_wall\" to the "
      "extract "
      "stage";
  for (const char* result : {"{}", R"({ "width": { "value": null, "unit": "D" } })"}) {
    write_text(fit_.file("extract.json"), result);
    EXPECT_EQ(refused(ten), width);
  }
  write_text(fit_.file("extract.json"), R"({ "width": { "value": 10, "unit": "D" } })");
  write_text(fit_.file("disks.csv"), "frame,x_px,y_px,radius_px,x,z\n0,1,2,3,4\n");
  EXPECT_THAT(refused(ten), testing::EndsWith("disks.csv: expected frame,x_px,y_px,radius_px,x,z,quality"));
  // Six cells are enough; of one frame there is nothing to resample.
  write_text(fit_.file("disks.csv"), "frame,x_px,y_px,radius_px,x,z\n0,1,2,3,4,5\n");
  EXPECT_EQ(refused(ten), "");
  EXPECT_THAT(fit_.warnings, testing::Contains(testing::StartsWith("bootstrap: ")));
}

// A bed of two temperatures that no model describes: said once, by the model alone or by it beside the answer.
TEST_F(FitByHand, SaysThatItsModelDoesNotDescribeTheBed) {
  std::string text = "# kernel: gaussian:0.5\n# column_number: 12\nheight,number_density,std_error\n";
  for (int i = 0; i < 60; ++i) {
    const double z = 4 + 0.125 * i;
    text += number_text(z) + "," + number_text(0.6 + 0.5 * std::sin(3 * z)) + ",0.001\n";
  }
  add_bed("bed", text, bed_json(0));
  const std::string window = R"({ "sweep": false, "compare": false, "window": { "low": 5, "high": 11 })";
  fit_.run(window + R"(, "answer": false })");
  EXPECT_THAT(fit_.warnings, testing::Contains(HasSubstr("enskog-rectangle does not describe this profile: ")));
  fit_.warnings.clear();
  const Json both = fit_.run(window + " }");
  EXPECT_THAT(fit_.warnings, testing::Contains(HasSubstr("enskog-rectangle alone does not describe this profile: " +
                                                         both["why_not"].get<std::string>())));
}

}  // namespace
}  // namespace shakebed::tests::fit_by_hand
