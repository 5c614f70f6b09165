// find_answer() against beds whose temperature is known: the table of known biases measured anew, then other beds
// (other numbers of disks, widths, lengths, seeds) fitted with no option, and shaken beds, of which most have no
// temperature.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "tests/reproduction/thermometer_beds.hpp"
#include "tests/reproduction/thermometer_calibration.hpp"

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
      const Calibration found = calibrate(beds_near(known, t, row));
      std::printf(" %+.1f ± %.1f |", 100 * found.bias.mean, 100 * found.bias.scatter);
      // The table is rounded to 0.1 %; another compiler's beds differ by their statistics.
      EXPECT_NEAR(found.bias.mean, table.of[t].mean, 4 * found.mean_error + 0.001) << table.temperature << " " << t;
    }
    for (const Known& k : beds_near(known, 0, row)) misfit = std::max(misfit, k.model_error);
    std::printf(" %.3f |\n", misfit);
  }
}

// --- known temperatures

struct Count {
  int beds = 0, held = 0, one = 0, far = 0;
};

// 200 beds, 95 % intervals: 190 +- 3.1 hold T if all is as stated; the band of the issue is 92 to 98 %. Of 200 normal
// numbers 0.54 lie beyond three standard errors; of Student's with some ten degrees of freedom, as these errors have,
// 2.7 (1.3 %): more than 7 by chance in 1 %.
void expect_coverage(const char* what, bool column_known, bool kinetic) {
  Count all, quarter[4];
  for (const EquilibriumBed& bed : verification_beds()) {
    const Measured measured = measure(bed);
    AnswerInput input = measured.input;
    if (!kinetic) input = profile_alone(input, column_known);
    const Answer answer = find_answer(input);
    ASSERT_TRUE(answer.ok()) << answer.why;
    Count& part = quarter[bed.reduced < 1 ? 0 : bed.reduced < 4 ? 1 : bed.reduced < 12 ? 2 : 3];
    for (Count* count : {&all, &part}) {
      ++count->beds;
      count->held += answer.interval.low <= measured.truth && measured.truth <= answer.interval.high;
      if (answer.verdict != Verdict::one_temperature) continue;
      ++count->one;
      count->far += std::abs(answer.temperature - measured.truth) > 3 * answer.std_error;
    }
  }
  const char* const names[] = {"0.4 to 1 T_c", "1 to 4 T_c", "4 to 12 T_c", "12 to 40 T_c"};
  for (int i = 0; i < 4; ++i)
    std::printf("| %s | %s | %d | %d | %d | %d |\n", what, names[i], quarter[i].beds, quarter[i].held, quarter[i].one,
                quarter[i].far);
  std::printf("| %s | all | %d | %d (%.1f %%) | %d | %d |\n", what, all.beds, all.held, 100.0 * all.held / all.beds,
              all.one, all.far);
  EXPECT_GE(all.held, 184);
  EXPECT_LE(all.held, 196);
  EXPECT_LE(all.far, 7);
  EXPECT_GE(all.one, 184) << "beds in equilibrium have one temperature";
}

TEST(Answer, HoldsTheTemperatureOf200Beds) { expect_coverage("N known", true, false); }
TEST(Answer, HoldsTheTemperatureOf200BedsWithoutTheirNumber) { expect_coverage("N not known", false, false); }
TEST(Answer, HoldsTheTemperatureOf200BedsWithVelocities) { expect_coverage("N and velocities known", true, true); }

// --- shaken beds

TEST(Answer, TellsShakenBedsWithoutOneTemperature) {
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
