// The bed of the page that `shakebed live` writes, here as a part of the program: it is the bed that sim measures of
// the same scene, whatever pieces it advances by.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "fit/theory/hydrostatic_profile.hpp"
#include "pipelines/live/live_bed.hpp"

namespace shakebed::tests::live_bed {
namespace {

using pipelines::live::LiveBed;
using pipelines::live::Numbers;
using pipelines::live::Settings;

// 24 disks of 2 mm, 5.3 of them wide; a period is 40 ms, settled after five.
Settings settings() {
  Settings s;
  s.count = 24, s.diameter = 0.002, s.width = 0.0106, s.gamma = 6, s.frequency = 25, s.restitution = 0.9;
  s.friction = 0.2, s.seed = 5, s.settle = 0.19;
  return s;
}
const double time_unit = std::sqrt(0.002 / 9.81);

// The same bed by sim alone.
sim::Scene scene_of(const Settings& s) {
  sim::Scene scene;
  scene.gravity = sim::UniformGravity{};
  const sim::Surface contact{.restitution = s.restitution, .friction = s.friction};
  scene.disks = {.species = {{24, 1, 1}}, .contact = contact, .inertia_ratio = 0.4};
  scene.disks.contact_duration = s.restitution < 1 || s.friction > 0 ? 1e-4 : 0;
  scene.box.width = s.width / 0.002;
  if (s.periodic != 0)
    scene.box.sides = sim::PeriodicSides{};
  else
    scene.box.sides = sim::HardSides{{.restitution = s.restitution}};
  const double omega = 2 * M_PI * 25;
  scene.box.floor = sim::SinusoidalFloor{6 * 9.81 / (omega * omega) / 0.002, 25 * time_unit};
  scene.box.floor_surface = contact;
  if (s.hexagonal != 0) {
    scene.start = sim::HexagonalStart{};
    scene.start_temperature = 0.01;
  } else {
    scene.start = sim::RandomStart{};
    scene.start_temperature = 0;
  }
  scene.seed = 5;
  return scene;
}

class LiveBeds : public testing::Test {
 protected:
  // After eight periods have been measured, in bites of so many events.
  LiveBed& live(const Settings& s, std::uint64_t events = 1'000'000'000) {
    bed_.emplace(s);
    bites_ = 1;
    while (!bed_->advance_towards(end(), events)) ++bites_;
    bed_->snapshot();
    bed_->measure();
    return *bed_;
  }
  void expect_nearest(double gamma);
  static double end() { return 13 * 0.04 / time_unit * (1 + 1e-12); }
  std::optional<LiveBed> bed_;
  int bites_ = 0;
};

TEST_F(LiveBeds, AreTheBedsOfTheirScene) {
  for (const int kind : {0, 1, 2}) {
    Settings s = settings();
    if (kind == 1) s.periodic = 1, s.hexagonal = 1;
    if (kind == 2) s.restitution = 1, s.friction = 0, s.hexagonal = 1;
    const sim::Scene scene = scene_of(s);
    sim::MeasureOptions options;
    options.settle = 0.19 / time_unit, options.duration = 8 * 0.04 / time_unit * (1 + 1e-9);
    const sim::MeasuredBed measured = sim::measure(scene, options);
    ASSERT_TRUE(measured.ok()) << measured.message;
    ASSERT_EQ(measured.periods, 8U);
    LiveBed& bed = live(s);
    const Numbers numbers = bed.numbers();
    EXPECT_EQ(numbers.periods, 8);
    EXPECT_EQ(numbers.temperature_x, measured.temperature_x.value) << kind;
    EXPECT_EQ(numbers.temperature_x_error, measured.temperature_x.std_error);
    EXPECT_EQ(numbers.temperature_z, measured.temperature_z.value);
    EXPECT_EQ(numbers.temperature_z_error, measured.temperature_z.std_error);
    EXPECT_NEAR(numbers.rise, measured.centre_of_mass_rise.value, 1e-12);
    EXPECT_EQ(numbers.rise_error, measured.centre_of_mass_rise.std_error);
    const sim::FilledHeights filled = sim::filled_heights(measured.profile);
    const sim::Profile& profile = bed.profile();
    ASSERT_EQ(profile.height.size(), filled.last - filled.first);
    ASSERT_EQ(profile.std_error.size(), profile.height.size());
    for (std::size_t i = 0; i < profile.height.size(); ++i) {
      EXPECT_EQ(profile.height[i], measured.profile.height[filled.first + i]);
      EXPECT_EQ(profile.number_density[i], measured.profile.number_density[filled.first + i]);
      EXPECT_EQ(profile.std_error[i], measured.profile.std_error[filled.first + i]);
    }
  }
}

// Settling goes up to the next start of a period; before one is over nothing has been measured.
TEST_F(LiveBeds, SayWhereTheyAre) {
  LiveBed bed(settings());
  const double omega = 2 * M_PI * 25;
  EXPECT_NEAR(bed.numbers().time_unit, time_unit, 1e-15);
  EXPECT_NEAR(bed.numbers().period * time_unit, 0.04, 1e-12);
  EXPECT_NEAR(bed.numbers().settled * time_unit, 0.2, 1e-12);
  EXPECT_NEAR(bed.numbers().amplitude, 6 * 9.81 / (omega * omega) / 0.002, 1e-12);
  EXPECT_NEAR(bed.numbers().column_number, 24 / 5.3, 1e-12);
  EXPECT_EQ(bed.numbers().time, 0);
  const double time = 0.213 / time_unit;
  ASSERT_TRUE(bed.advance_towards(time, 1'000'000'000));
  EXPECT_NEAR(bed.snapshot().floor_position, bed.numbers().amplitude * std::sin(omega * 0.213), 1e-9);
  EXPECT_EQ(bed.numbers().floor, bed.snapshot().floor_position);
  EXPECT_EQ(bed.snapshot().x.size(), 24U);
  EXPECT_NEAR(bed.numbers().time, time, 1e-12);
  EXPECT_GT(bed.numbers().collisions, 24);
  EXPECT_EQ(bed.numbers().periods, 0);
  bed.measure();
  EXPECT_TRUE(bed.profile().height.empty() && bed.curve().empty());
  const Numbers none = bed.numbers();
  for (const double number : {none.temperature_x, none.temperature_x_error, none.temperature_z,
                              none.temperature_z_error, none.rise, none.rise_error, none.curve_temperature})
    EXPECT_EQ(number, 0);
  // A look at the very moment it was asked for counts: the last of a period ends it.
  ASSERT_TRUE(bed.advance_towards(none.settled + (0 + 31.0 / 32) * none.period, 1'000'000'000));
  EXPECT_EQ(bed.numbers().periods, 1);
}

// A page asks for a few events at a time: the same bed, in many bites.
TEST_F(LiveBeds, AreTheSameInBites) {
  const LiveBed& whole = live(settings());
  const std::vector<double> x = bed_->snapshot().x, density = whole.profile().number_density, curve = whole.curve();
  const Numbers numbers = bed_->numbers();
  live(settings(), 100);
  EXPECT_GT(bites_, 20);
  EXPECT_EQ(bed_->snapshot().x, x);
  EXPECT_EQ(bed_->profile().number_density, density);
  EXPECT_EQ(bed_->curve(), curve);
  EXPECT_EQ(bed_->numbers().temperature_z, numbers.temperature_z);
  EXPECT_EQ(bed_->numbers().collisions, numbers.collisions);
}

// Of the curves whose centre of mass is the bed's no other is nearer, be it a little or much colder or hotter.
void LiveBeds::expect_nearest(double gamma) {
  Settings of_gamma = settings();
  of_gamma.gamma = gamma;
  LiveBed& bed = live(of_gamma);
  const Numbers numbers = bed.numbers();
  const sim::Profile& profile = bed.profile();
  ASSERT_EQ(bed.curve().size(), profile.height.size());
  const double centre = numbers.rise + sim::ideal_centre_of_mass(24, 5.3, true);
  const auto curve = [&](double temperature) {
    const auto model =
        fit::HydrostaticProfile::of_column(fit::enskog(), temperature, fit::Column{numbers.column_number});
    std::vector<double> heights = profile.height, density(heights.size());
    for (double& height : heights) height -= centre - model.center_of_mass();
    model.sample(heights, sim::MeasureOptions{}.kernel, density);
    return density;
  };
  const auto misfit = [&](double temperature) {
    const std::vector<double> density = curve(temperature);
    double squares = 0;
    for (std::size_t i = 0; i < density.size(); ++i) squares += std::pow(profile.number_density[i] - density[i], 2);
    return std::sqrt(squares / static_cast<double>(density.size()));
  };
  const std::vector<double> nearest = curve(numbers.curve_temperature);
  for (std::size_t i = 0; i < nearest.size(); ++i) EXPECT_NEAR(bed.curve()[i], nearest[i], 1e-9) << i;
  EXPECT_NEAR(numbers.curve_misfit, misfit(numbers.curve_temperature), 1e-9);
  for (const double factor : {0.2, 0.5, 0.8, 0.99, 1.01, 1.25, 2.0, 10.0})
    EXPECT_GE(misfit(numbers.curve_temperature * factor), numbers.curve_misfit) << factor;
}
TEST_F(LiveBeds, HaveTheNearestCurve) {
  for (const double gamma : {6.0, 1.5}) expect_nearest(gamma);
}

TEST_F(LiveBeds, RefuseWhatIsNoBed) {
  const auto refused = [](const std::function<void(Settings&)>& change) -> std::string {
    Settings s = settings();
    change(s);
    try {
      const LiveBed bed(s);
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  const std::string number = "the number of disks must be 1 to 5000",
                    above = "diameter, width, Gamma and frequency must be above 0";
  EXPECT_EQ(refused([](Settings& s) { s.count = 0; }), number);
  EXPECT_EQ(refused([](Settings& s) { s.count = 5001; }), number);
  EXPECT_EQ(refused([](Settings& s) { s.count = NAN; }), number);
  EXPECT_EQ(refused([](Settings& s) { s.diameter = 0; }), above);
  EXPECT_EQ(refused([](Settings& s) { s.width = 0; }), above);
  EXPECT_EQ(refused([](Settings& s) { s.gamma = 0; }), above);
  EXPECT_EQ(refused([](Settings& s) { s.frequency = -1; }), above);
  EXPECT_EQ(refused([](Settings& s) { s.count = 1; }), "");
  EXPECT_EQ(refused([](Settings& s) { s.count = 5000, s.width = 0.2; }), "");
}

}  // namespace
}  // namespace shakebed::tests::live_bed
