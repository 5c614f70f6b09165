// Profiles as people write them: every spelling of a column, every separator, either kind of density, missing errors,
// and the covariance beside them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "pipelines/formats/errors.hpp"
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
  const ProfileTable gap = read("z,phi,samples\n1,0.8,7\n2,0.4,\n");
  EXPECT_EQ(gap.samples[0], 7);
  EXPECT_EQ(gap.samples[1], 0) << "of an empty cell";
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

// What is wrong with a file, behind its path.
std::string mistake_of(const std::string& text, const std::string& metadata = "") {
  const ScratchFolder folder;
  write_text(folder / "p.csv", text);
  if (!metadata.empty()) write_text(metadata_path(folder / "p.csv"), metadata);
  try {
    read_profile_csv(folder / "p.csv");
  } catch (const shakebed::pipelines::InputError& error) {
    return std::string(error.what()).substr((folder / "p.csv").string().size());
  }
  return "none";
}

TEST(ProfileFile, NamesItsMistakes) {
  EXPECT_EQ(mistake_of("x,y\n1,2\n"),
            ":1: the header must name at least \"height\" (in D) and \"number_density\" (n D^2), or \"area_fraction\"; "
            "found \"x,y\"");
  EXPECT_THAT(mistake_of("height\n1\n"), testing::StartsWith(":1: the header must name"));
  EXPECT_THAT(mistake_of("phi,nu\n1,1\n"), testing::StartsWith(":1: the header must name"));
  EXPECT_EQ(mistake_of("# a comment\n"),
            ": there is no header line. Write the names of the columns in the first line, "
            "for example height,number_density");
  EXPECT_EQ(mistake_of("z,phi\n# 1,1\n"), ": there are no rows below the header line");
  EXPECT_EQ(mistake_of("z,phi\n\n1,1,1\n"), ":3: this row has 3 cells, but the header has 2");
  EXPECT_EQ(mistake_of("z,phi\n1,1e999\n"), ":2: \"1e999\" in column \"phi\" is not a finite number");
  EXPECT_EQ(mistake_of("z,phi,error\n1,1,x\n"), ":2: \"x\" in column \"error\" is not a finite number");
  EXPECT_EQ(mistake_of("z,phi,error\n1,1,-0.5\n"), ":2: the standard error -0.5 is negative");
  EXPECT_EQ(mistake_of("z,phi\n1,-0.5\n"),
            ":2: the density -0.5 is negative. Set negative densities to 0, or leave their rows out");
  EXPECT_EQ(mistake_of("z,nu\n1,1.7e308\n"), ":2: the density is beyond the largest possible number");
  EXPECT_EQ(
      mistake_of("# kernel: square\n# kernel_width: 2\nz,phi\n1,1\n"),
      ":1: there is no kernel \"square:2\"; write gaussian:WIDTH, top_hat:WIDTH, disk_chord:WIDTH (in D) or none");
  EXPECT_EQ(mistake_of("z,phi\n# column_number: 0\n1,1\n"), ":2: column_number: expected a number above 0, got \"0\"");
  EXPECT_EQ(mistake_of("z,phi\n1,1\n", R"({ "notes": [ { "kernel": { "kind": "square", "width": 1 } } ] })"),
            "-metadata.json: /notes/0/kernel: expected a kind and a width");
}

// Of eight rows without an error all are named, of nine the first eight.
TEST(ProfileFile, NamesTheRowsWithoutAnError) {
  const auto note = [](int rows) {
    std::string text = "z,phi,error\n0,1,0.1\n";
    for (int k = 1; k <= rows; ++k) text += std::to_string(k) + ",1,\n";
    const ProfileTable found = read(text);
    EXPECT_EQ(found.notes.size(), 1U);
    return found.notes.at(0).substr(found.notes.at(0).find(": ") + 2);
  };
  const std::string used = " The error of the nearest height that has one is used for each.";
  EXPECT_EQ(note(1), "1 of 2 rows have no standard error or one of 0 (line 3)." + used);
  EXPECT_EQ(note(8), "8 of 9 rows have no standard error or one of 0 (lines 3, 4, 5, 6, 7, 8, 9, 10)." + used);
  EXPECT_EQ(note(9), "9 of 10 rows have no standard error or one of 0 (lines 3, 4, 5, 6, 7, 8, 9, 10, ...)." + used);
  EXPECT_TRUE(read("z,phi\n0,1\n1,1\n").notes.empty());
  EXPECT_TRUE(read("z,phi,error\n0,1,0.1\n1,1,0.1\n").notes.empty());
}

// Of several columns of one name the first is read, and the others are named.
TEST(ProfileFile, ReadsTheFirstOfSeveralColumns) {
  const ProfileTable densities = read("z,PHI_a,phi_b,phi_c,nu_a\n1,0.5,0.6,0.7,0.1\n");
  EXPECT_EQ(densities.number_density[0], 0.5);
  ASSERT_EQ(densities.notes.size(), 1U);
  EXPECT_THAT(
      densities.notes[0],
      testing::EndsWith("p.csv: the density is read from column \"PHI_a\", and these columns are ignored: phi_b, "
                        "phi_c. To use another column, name it \"number_density\"."));
  const ProfileTable areas = read("nu_a,nu_b,z\n0.5,0.6,1\n");
  EXPECT_EQ(areas.area_fraction[0], 0.5);
  EXPECT_THAT(areas.notes.at(0), testing::EndsWith("p.csv: the area fraction is read from column \"nu_a\", and these "
                                                   "columns are ignored: nu_b. To use another column, name it "
                                                   "\"area_fraction\"."));
  EXPECT_TRUE(read("z,phi_a\n1,0.5\n").notes.empty());
}

// Heights that differ by less than 1e-9 are one; pairs of others are left out. Rows must be three numbers.
TEST(ProfileFile, HasACovarianceOfItsHeights) {
  const ScratchFolder folder;
  ProfileTable profile;
  profile.height = {1, 2}, profile.number_density = {1, 1}, profile.std_error = {0.5, 0.25};
  const auto read_back = [&](const std::string& rows) {
    write_text(folder / "c.csv", "height_i,height_j,covariance\n" + rows);
    return read_covariance_csv(folder / "c.csv", profile).values;
  };
  EXPECT_EQ(read_back(""), (std::vector<double>{0.25, 0, 0, 0.0625}));
  EXPECT_EQ(read_back("1.0000000009,1.9999999991,0.125\n"), (std::vector<double>{0.25, 0.125, 0.125, 0.0625}));
  EXPECT_EQ(read_back("1.000000002,2,0.125\n3,1,0.5\n2,2,0.75\n"), (std::vector<double>{0.25, 0, 0, 0.75}));
  for (const char* wrong : {"1,2\n", "1,2,3,4\n", "1,x,3\n", "1,2,\n"}) {
    try {
      read_back(std::string("1,1,1\n") + wrong);
      ADD_FAILURE() << wrong;
    } catch (const shakebed::pipelines::InputError& error) {
      EXPECT_EQ(std::string(error.what()),
                (folder / "c.csv").string() + ":3: expected three numbers: height_i,height_j,covariance");
    }
  }
}

}  // namespace
