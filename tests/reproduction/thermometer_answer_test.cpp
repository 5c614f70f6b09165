// find_answer() against beds whose temperature is known: the table of known biases measured anew, then other beds
// (other numbers of disks, widths, lengths, seeds) fitted with no option, and shaken beds, of which most have no
// temperature.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/reproduction/thermometer_beds.hpp"
#include "tests/reproduction/thermometer_calibration.hpp"
#include "tests/reproduction/thermometer_coverage.hpp"

namespace shakebed::fit::simulated {
namespace {

// Without what a camera does not see.
AnswerInput profile_alone(AnswerInput input, bool column_known) {
  input.temperature_x.reset();
  input.temperature_z.reset();
  if (!column_known) input.column_number.reset();
  return input;
}

// --- the table

TEST(ThermometerTable, IsWhatBedsOfKnownTemperatureSay) {
  std::vector<Known> known;
  for (const EquilibriumBed& bed : calibration_beds()) {
    const Measured measured = measure(bed);
    add_readings(find_answer(profile_alone(measured.input, true)), measured.truth,
                 measured.input.profile.covariance_samples, known);
  }
  std::printf("| T [m g D] |");
  for (const Thermometer& thermometer : thermometers()) std::printf(" %s |", std::string(thermometer.name).c_str());
  std::printf(" misfit |\n");
  ASSERT_EQ(known_biases().size(), std::size(calibration_temperatures));
  for (std::size_t row = 0; row < known_biases().size(); ++row) {
    const KnownBiases& table = known_biases()[row];
    ASSERT_EQ(table.temperature, calibration_temperatures[row]);
    std::printf("| %g |", table.temperature);
    double misfit = 0;
    for (std::size_t t = 0; t < thermometer_count; ++t) {
      const Calibration found = calibrate(beds_near(known, t, row), beds_near(known, 0, row).size());
      std::printf(" %+.1f ± %.1f (%d) |", 100 * found.bias.mean, 100 * found.bias.scatter, found.beds);
      // The table is rounded to 0.1 %; another compiler's beds differ by their statistics.
      EXPECT_NEAR(found.bias.mean, table.of[t].mean, 4 * found.mean_error + 0.001) << table.temperature << " " << t;
      if (found.beds < fewest_beds) {
        EXPECT_EQ(table.of[t].scatter, scatter_of_unknown) << table.temperature << " " << t;
      }
    }
    for (const Known& k : beds_near(known, 0, row)) misfit = std::max(misfit, k.model_error);
    std::printf(" %.3f |\n", misfit);
  }
}

// --- known temperatures

TEST(ThermometerAnswer, HoldsTheTemperatureOf200Beds) {
  Coverage profile("the profile"), number("and N"), velocities("and velocities");
  for (const EquilibriumBed& bed : verification_beds()) {
    const Measured measured = measure(bed);
    const auto judge = [&](Coverage& coverage, const AnswerInput& input) {
      const Answer answer = find_answer(input);
      ASSERT_TRUE(answer.ok()) << bed.reduced << ": " << answer.why;
      coverage.add({answer.temperature, answer.std_error, answer.interval.low, answer.interval.high,
                    answer.verdict == Verdict::one_temperature},
                   bed.reduced, measured.truth);
    };
    judge(profile, profile_alone(measured.input, false));
    judge(number, profile_alone(measured.input, true));
    judge(velocities, measured.input);
  }
  std::printf("| known: | T | beds | 95 %% intervals that hold T | one temperature | off by more than 3 errors |\n");
  for (const Coverage* coverage : {&profile, &number, &velocities}) coverage->expect_as_stated();
}

// --- shaken beds

TEST(ThermometerAnswer, TellsShakenBedsWithoutOneTemperature) {
  int apart = 0, named = 0, named_alone = 0, named_without_number = 0;
  for (const ShakenBed& bed : shaken_beds()) {
    const Measured measured = measure(bed);
    const double x = measured.input.temperature_x->value, z = measured.input.temperature_z->value;
    const bool differ = std::max(x, z) > 1.2 * std::min(x, z);
    const Answer answer = find_answer(measured.input);
    ASSERT_TRUE(answer.ok()) << answer.why;
    const Answer alone = find_answer(profile_alone(measured.input, true));
    const Answer without_number = find_answer(profile_alone(measured.input, false));
    std::printf("| %g | %g | %g | %u | %.3f | %.3f | %.3f to %.3f | %s | %s | %s |\n", bed.restitution, bed.friction,
                bed.gamma, bed.count, x, z, answer.interval.low, answer.interval.high,
                std::string(to_string(answer.verdict)).c_str(), std::string(to_string(alone.verdict)).c_str(),
                std::string(to_string(without_number.verdict)).c_str());
    if (!differ) continue;
    ++apart;
    named += answer.verdict == Verdict::no_single_temperature;
    named_alone += alone.verdict != Verdict::one_temperature;
    named_without_number += without_number.verdict != Verdict::one_temperature;
    EXPECT_EQ(answer.verdict, Verdict::no_single_temperature) << x << " " << z;
    EXPECT_LE(answer.interval.low, std::min(x, z));
    EXPECT_GE(answer.interval.high, std::max(x, z));
  }
  std::printf(
      "T_x and T_z more than 20 %% apart in %d beds: named in %d; from the profile and N in %d, without N in %d\n",
      apart, named, named_alone, named_without_number);
  EXPECT_GE(apart, 30);
}

}  // namespace
}  // namespace shakebed::fit::simulated
