// Profiles as people write them: every spelling of a column, every separator, either kind of density, missing errors,
// and the covariance beside them.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/table.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using shakebed::Kernel;
using shakebed::KernelKind;
using shakebed::tests::ScratchFolder;
using shakebed::tests::write_text;

ProfileTable read(const std::string& text) {
  const ScratchFolder folder;
  write_text(folder / "p.csv", text);
  return read_profile_csv(folder / "p.csv");
}
constexpr double quarter_pi = std::numbers::pi / 4;

TEST(ProfileFile, KnowsEverySpellingOfItsColumns) {
  for (const std::string height : {"height", "zeta", "z", "z/D", "Height"}) {
    for (const std::string density : {"number_density", "density", "phi", "PHI"}) {
      for (const std::string error : {"std_error", "error", "sigma", "stderr"}) {
        const ProfileTable found =
            read("samples," + error + "," + density + "," + height + "\n7,0.01,0.5,2\n9,0.02,1,1\n");
        ASSERT_EQ(found.size(), 2U);
        EXPECT_EQ(found.height[0], 1) << "sorted by height";
        EXPECT_EQ(found.number_density[0], 1) << density;
        EXPECT_EQ(found.std_error[0], 0.02) << error;
        EXPECT_EQ(found.samples[0], 9);
        EXPECT_DOUBLE_EQ(found.area_fraction[0], quarter_pi);
        EXPECT_EQ(found.std_error[1], 0.01);
      }
    }
  }
  for (const std::string area : {"area_fraction", "nu"}) {
    const ProfileTable found = read("z,count," + area + "\n1,5,0.5\n");
    EXPECT_EQ(found.area_fraction[0], 0.5) << area;
    EXPECT_DOUBLE_EQ(found.number_density[0], 0.5 / quarter_pi) << area;
    EXPECT_EQ(found.samples[0], 5);
    EXPECT_TRUE(found.std_error.empty());
  }
  const ProfileTable both = read("z,phi,nu\n1,0.8,0.6\n2,0.8,\n");
  EXPECT_EQ(both.number_density[0], 0.8);
  EXPECT_EQ(both.area_fraction[0], 0.6) << "as it is written, where both are";
  EXPECT_DOUBLE_EQ(both.area_fraction[1], 0.8 * quarter_pi);
}

TEST(ProfileFile, KnowsEverySeparator) {
  for (const char separator : {',', ';', '\t', ' '}) {
    std::string text = "height number_density std_error\n1 0.9 0.01\n2 0.5 0.02\n";
    for (char& c : text)
      if (c == ' ') c = separator;
    const ProfileTable found = read(text);
    ASSERT_EQ(found.size(), 2U) << separator;
    EXPECT_EQ(found.number_density[1], 0.5) << separator;
    EXPECT_EQ(found.std_error[1], 0.02) << separator;
  }
}

// Of two heights that are as near, the larger error.
TEST(ProfileFile, GivesARowWithoutAnErrorThatOfItsNearest) {
  const ProfileTable found = read("height,phi,error\n0,1,0.05\n1,1,0\n2,1,0.03\n3,1,0.02\n4,1,\n6,1,0.07\n6.5,1,\n");
  const double expected[] = {0.05, 0.05, 0.03, 0.02, 0.02, 0.07, 0.07};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(found.std_error[i], expected[i]) << i;
}

TEST(ProfileFile, ComesBackWithItsNotesAndCovariance) {
  const ScratchFolder folder;
  ProfileTable profile;
  profile.height = {1, 2, 3}, profile.number_density = {0.9, 0.8, 0.4}, profile.std_error = {0.1, 0.2, 0.3};
  profile.kernel = Kernel{KernelKind::disk_chord, 1.25};
  profile.column_number = 12.5, profile.phase = 0.375, profile.origin = "somewhere";
  write_profile_csv(folder / "profile.csv", profile);
  write_covariance_csv(folder / "covariance.csv", profile.height, {0.01, 0.002, 0, 0.002, 0.05, 0.006, 0, 0.006, 0.09},
                       17);
  const ProfileTable back = read_profile_csv(folder / "profile.csv");
  EXPECT_EQ(back.kernel->kind, KernelKind::disk_chord);
  EXPECT_EQ(back.kernel->width, 1.25);
  EXPECT_EQ(*back.column_number, 12.5);
  EXPECT_EQ(*back.phase, 0.375);
  EXPECT_EQ(back.origin, "somewhere");
  EXPECT_DOUBLE_EQ(back.area_fraction[1], 0.8 * quarter_pi);
  const ProfileCovariance covariance = read_covariance_csv(folder / "covariance.csv", back);
  EXPECT_EQ(covariance.independent_samples, 17);
  const double expected[] = {0.01, 0.002, 0, 0.002, 0.05, 0.006, 0, 0.006, 0.09};
  for (std::size_t i = 0; i < 9; ++i) EXPECT_EQ(covariance.values[i], expected[i]) << i;
  // What the file does not list: the squares of the profile's errors, and no correlation.
  write_covariance_csv(folder / "other.csv", {2, 3}, {0.06, 0.001, 0.001, 0.07}, 3);
  const ProfileCovariance part = read_covariance_csv(folder / "other.csv", back);
  EXPECT_DOUBLE_EQ(part.values[0], 0.01);
  EXPECT_EQ(part.values[1], 0);
  EXPECT_EQ(part.values[4], 0.06);
  EXPECT_EQ(part.values[7], 0.001);
}

}  // namespace
