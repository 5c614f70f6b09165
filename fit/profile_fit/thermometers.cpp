#include "fit/profile_fit/thermometers.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace shakebed::fit {

namespace {

constexpr std::array<Thermometer, thermometer_count> table{{
    {"whole column", "hydrostatic:best-of", false, 1.5, 0.0, true},
    {"whole column, N known", "hydrostatic:best-of", true, 1.5, 0.0, true},
    {"whole column from 5 D up", "hydrostatic:best-of", false, 5.0, 0.0, true},
    {"whole column, densities below 0.8", "hydrostatic:best-of", false, 1.5, 0.8, true},
    {"whole column, densities below 0.4", "hydrostatic:best-of", false, 1.5, 0.4, true},
    {"Enskog curve of Quinn and Hong (2000)", "enskog-rectangle", false, 1.5, 0.0, false},
    {"Enskog curve, densities below 0.6", "enskog-rectangle", false, 1.5, 0.6, false},
}};

// From 480 beds of elastic disks held at T by a bath: 16 widths not chosen for it and 8 into which a crystal fits, 8 to
// 24 rows, 0.3 to 45 T_c (tests/reproduction/thermometer_beds.hpp), measured as the program does, through a Gaussian of
// 0.5 D. A row holds the values of the beds nearest to its T: the greatest error of the model of the first thermometer;
// then, of each thermometer, the mean of ln(T fitted/T) and its scatter from bed to bed beyond the stated errors, the
// mean's own uncertainty included, and no less than 0.4 %, the resolution of some 40 beds a row. The scatter is 2 where
// fewer than 5 beds of a row have a reading: the thermometer then has no weight. It is no less than the mean where
// fewer than two thirds have one. Measured again by `ctest -L study -R ThermometerTable -V`.
// clang-format off
constexpr std::array<KnownBiases, 14> biases{{
    {0.03, 0.020, {{{0.036, 0.396}, {0.189, 0.349}, {0.079, 0.338}, {0.044, 0.547}, {0.000, 2.000}, {-0.084, 0.329}, {0.000, 2.000}}}},
    {0.045, 0.020, {{{0.034, 0.226}, {0.132, 0.240}, {-0.036, 0.295}, {0.026, 0.584}, {0.000, 2.000}, {-0.131, 0.171}, {-0.183, 0.879}}}},
    {0.065, 0.024, {{{0.014, 0.098}, {0.121, 0.161}, {-0.004, 0.103}, {-0.048, 0.357}, {0.530, 0.530}, {-0.173, 0.083}, {-0.187, 0.723}}}},
    {0.09, 0.022, {{{0.009, 0.045}, {0.090, 0.126}, {-0.002, 0.052}, {-0.136, 0.208}, {0.164, 0.164}, {-0.182, 0.052}, {-0.315, 0.641}}}},
    {0.13, 0.022, {{{0.010, 0.016}, {0.063, 0.099}, {0.001, 0.017}, {-0.102, 0.058}, {-0.184, 0.295}, {-0.173, 0.053}, {-0.151, 0.256}}}},
    {0.2, 0.019, {{{0.004, 0.009}, {0.032, 0.064}, {-0.007, 0.024}, {-0.072, 0.007}, {-0.100, 0.095}, {-0.172, 0.029}, {-0.105, 0.065}}}},
    {0.3, 0.017, {{{0.005, 0.004}, {0.013, 0.029}, {-0.005, 0.012}, {-0.041, 0.008}, {-0.050, 0.019}, {-0.167, 0.025}, {-0.060, 0.011}}}},
    {0.45, 0.015, {{{0.002, 0.004}, {0.002, 0.015}, {-0.005, 0.007}, {-0.021, 0.006}, {-0.021, 0.006}, {-0.139, 0.044}, {-0.028, 0.004}}}},
    {0.7, 0.013, {{{-0.002, 0.004}, {0.000, 0.008}, {-0.002, 0.004}, {-0.009, 0.004}, {-0.016, 0.004}, {-0.104, 0.052}, {-0.015, 0.006}}}},
    {1, 0.011, {{{0.002, 0.005}, {0.002, 0.004}, {0.001, 0.006}, {-0.004, 0.004}, {-0.011, 0.004}, {-0.051, 0.042}, {-0.008, 0.004}}}},
    {1.5, 0.008, {{{-0.002, 0.004}, {-0.001, 0.004}, {-0.004, 0.005}, {-0.003, 0.004}, {-0.009, 0.004}, {-0.024, 0.023}, {-0.007, 0.004}}}},
    {2.5, 0.005, {{{-0.003, 0.004}, {-0.001, 0.004}, {-0.003, 0.004}, {-0.002, 0.004}, {-0.005, 0.004}, {-0.003, 0.004}, {-0.003, 0.004}}}},
    {4.5, 0.005, {{{-0.001, 0.004}, {0.000, 0.004}, {-0.001, 0.004}, {-0.001, 0.004}, {0.002, 0.006}, {-0.001, 0.004}, {-0.001, 0.004}}}},
    {9, 0.005, {{{0.002, 0.004}, {0.003, 0.004}, {0.002, 0.004}, {0.002, 0.004}, {-0.001, 0.004}, {0.002, 0.004}, {0.001, 0.004}}}},
}};
// clang-format on

// The rows beside a temperature and how far it lies between them, 0 to 1.
struct Place {
  const KnownBiases *below, *above;
  double part;
};
Place place_of(double temperature) {
  const auto above =
      std::find_if(biases.begin(), biases.end(), [&](const KnownBiases& row) { return row.temperature > temperature; });
  if (above == biases.begin()) return {&biases.front(), &biases.front(), 0.0};
  if (above == biases.end()) return {&biases.back(), &biases.back(), 0.0};
  const auto below = above - 1;
  return {&*below, &*above,
          std::log(temperature / below->temperature) / std::log(above->temperature / below->temperature)};
}

}  // namespace

std::span<const Thermometer> thermometers() { return table; }
std::span<const KnownBiases> known_biases() { return biases; }

KnownBias known_bias(const Thermometer& thermometer, double temperature) {
  const auto index = static_cast<std::size_t>(&thermometer - table.data());
  const Place place = place_of(temperature);
  const KnownBias &a = place.below->of[index], &b = place.above->of[index];
  KnownBias bias{a.mean + place.part * (b.mean - a.mean), a.scatter + place.part * (b.scatter - a.scatter)};
  if (temperature < biases.front().temperature) bias.scatter *= biases.front().temperature / temperature;
  return bias;
}

double known_misfit(double temperature) {
  const Place place = place_of(temperature);
  return place.below->misfit + place.part * (place.above->misfit - place.below->misfit);
}

}  // namespace shakebed::fit
