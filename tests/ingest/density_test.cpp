#include "ingest/profile/density.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>

#include "ingest/synthetic/random_stream.hpp"
#include "tests/ingest/test_files.hpp"

namespace shakebed::ingest {
namespace {

TEST(Density, EveryKernelKeepsTheNumberOfBeads) {
  const std::vector<double> heights = {3.1, 4.26, 4.9, 6.0, 6.25};
  const HeightBins bins{0, 0.05, 200};
  for (const Kernel kernel : {Kernel{KernelKind::top_hat, 0.05}, Kernel{KernelKind::top_hat, 1.0},
                              Kernel{KernelKind::gaussian, 0.25}, Kernel{KernelKind::disk_chord, 1.0}}) {
    const auto density = density_of_frame(heights, 7.0, bins, kernel);
    double sum = 0;
    for (const double value : density) sum += value * bins.width;
    // A wide top hat covers a whole number of bin middles: up to half a bin is lost or won.
    EXPECT_NEAR(sum, 5.0 / 7.0, 0.5 * bins.width / 7.0) << static_cast<int>(kernel.kind) << " " << kernel.width;
  }
}

TEST(Density, ChordKernelIsTheChordOfADisk) {
  const HeightBins bins{4.995, 0.01, 1};
  const auto density = density_of_frame(std::vector<double>{5.2}, 1.0, bins, {KernelKind::disk_chord, 1.0});
  EXPECT_NEAR(density[0], 2 * std::sqrt(0.25 - 0.04) / (std::numbers::pi / 4), 1e-12);
}

TEST(AverageProfile, CovarianceIsThatOfTheMeanAndHoldsTheScaleError) {
  RandomStream random(9);
  const HeightBins bins{0, 1, 3};
  std::vector<std::vector<double>> frames;
  for (int k = 0; k < 4000; ++k) {
    const double a = random.normal(), b = random.normal(), c = random.normal();
    frames.push_back({1 + 0.1 * a, 2 + 0.1 * (0.6 * a + 0.8 * b), 3 + 0.2 * c});
  }
  const DensityProfile profile = average_profile(frames, bins, {}, 0.0);
  EXPECT_NEAR(profile.number_density[1], 2, 5 * 0.1 / std::sqrt(4000.0));
  EXPECT_NEAR(profile.std_error[0], 0.1 / std::sqrt(4000.0), 0.15 * 0.1 / std::sqrt(4000.0));
  EXPECT_NEAR(profile.covariance[1] / std::sqrt(profile.covariance[0] * profile.covariance[4]), 0.6, 0.1);
  EXPECT_NEAR(profile.area_fraction[2], profile.number_density[2] * std::numbers::pi / 4, 1e-12);
  const DensityProfile scaled = average_profile(frames, bins, {}, 0.01);  // 1 % in D is 2 % in n D^2
  EXPECT_NEAR(scaled.std_error[2], std::hypot(profile.std_error[2], 0.02 * 3), 1e-3);
}

// A bed that breathes: every bin is mostly noise of its own, which forgets at once, and a little of the height, which
// remembers for four frames. 400 films of 150 frames know the true variance of the mean height to 7 %.
TEST(AverageProfile, KnowsHowLongTheHeightRemembers) {
  RandomStream random(10);
  const HeightBins bins{0, 0.5, 40};
  const int films = 400;
  double stated = 0, sum = 0, squares = 0;
  for (int film = 0; film < films; ++film) {
    std::vector<std::vector<double>> frames;
    double breath = random.normal();
    for (int f = 0; f < 150; ++f) {
      std::vector<double> frame;
      for (std::size_t bin = 0; bin < bins.count; ++bin)
        frame.push_back(1 + 0.005 * breath * (bins.middle(bin) - 10) + 0.1 * random.normal());
      frames.push_back(frame);
      breath = 0.6 * breath + 0.8 * random.normal();
    }
    const DensityProfile profile = average_profile(frames, bins, {});
    double height = 0;
    for (std::size_t a = 0; a < bins.count; ++a) {
      height += bins.middle(a) * profile.number_density[a];
      for (std::size_t b = 0; b < bins.count; ++b)
        stated += bins.middle(a) * bins.middle(b) * profile.covariance[a * bins.count + b] / films;
    }
    sum += height, squares += height * height;
  }
  const double true_variance = (squares - sum * sum / films) / (films - 1);
  std::printf("  stated over true variance of the height: %.2f\n", stated / true_variance);
  EXPECT_NEAR(stated / true_variance, 1, 0.25);
}

TEST(ProfileCsv, HasTheFixedHeader) {
  const test::ScratchFolder folder;
  const DensityProfile profile = average_profile({{1, 2}, {2, 3}}, {0.5, 0.25, 2}, {});
  write_profile_csv(folder / "p.csv", profile, {"kernel top_hat 0.25"});
  std::ifstream in(folder / "p.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_EQ(line, "# kernel top_hat 0.25");
  std::getline(in, line);
  EXPECT_EQ(line, "height,number_density,std_error,area_fraction,samples");
  std::getline(in, line);
  EXPECT_EQ(line.substr(0, 10), "0.625,1.5,");
}

}  // namespace
}  // namespace shakebed::ingest
