// Every unit against a table of the SI written by hand (The International System of Units, 9th edition, tables 2, 4, 7
// and 8), into SI and back, and what is shown to people.
#include <gtest/gtest.h>

#include <filesystem>
#include <numbers>
#include <regex>
#include <set>
#include <string>
#include <string_view>

#include "pipelines/formats/quantity.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;

struct SiUnit {
  const char* name;
  double factor;  // SI units in one
  Dimension dimension;
};

constexpr Dimension newton{.length = 1, .mass = 1, .time = -2};
constexpr Dimension pascal{.length = -1, .mass = 1, .time = -2};
const SiUnit si_units[] = {
    {"m", 1, dimension::length},
    {"km", 1000, dimension::length},
    {"dm", 0.1, dimension::length},
    {"cm", 0.01, dimension::length},
    {"mm", 0.001, dimension::length},
    {"um", 0.000001, dimension::length},
    {"\u00b5m", 0.000001, dimension::length},  // the micro sign
    {"\u03bcm", 0.000001, dimension::length},  // the Greek letter
    {"nm", 0.000000001, dimension::length},
    {"s", 1, dimension::time},
    {"ms", 0.001, dimension::time},
    {"us", 0.000001, dimension::time},
    {"\u00b5s", 0.000001, dimension::time},
    {"\u03bcs", 0.000001, dimension::time},
    {"ns", 0.000000001, dimension::time},
    {"min", 60, dimension::time},
    {"h", 3600, dimension::time},
    {"Hz", 1, dimension::frequency},
    {"kHz", 1000, dimension::frequency},
    {"mHz", 0.001, dimension::frequency},
    {"kg", 1, dimension::mass},
    {"g", 0.001, dimension::mass},
    {"mg", 0.000001, dimension::mass},
    {"ug", 0.000000001, dimension::mass},
    {"\u00b5g", 0.000000001, dimension::mass},
    {"t", 1000, dimension::mass},
    {"N", 1, newton},
    {"mN", 0.001, newton},
    {"Pa", 1, pascal},
    {"kPa", 1000, pascal},
    {"J", 1, dimension::energy},
    {"mJ", 0.001, dimension::energy},
    {"uJ", 0.000001, dimension::energy},
    {"nJ", 0.000000001, dimension::energy},
    {"W", 1, dimension::power},
    {"mW", 0.001, dimension::power},
    {"px", 1, dimension::pixels},
    {"pixel", 1, dimension::pixels},
    {"pixels", 1, dimension::pixels},
    {"rad", 1, dimension::angle},
    {"deg", std::numbers::pi / 180, dimension::angle},
    {"degrees", std::numbers::pi / 180, dimension::angle},
    {"\u00b0", std::numbers::pi / 180, dimension::angle},
    {"%", 0.01, dimension::none},
    {"1", 1, dimension::none},
};

Dimension power_of(const Dimension& d, int n) {
  return {.length = n * d.length, .mass = n * d.mass, .time = n * d.time, .pixel = n * d.pixel, .angle = n * d.angle};
}

TEST(Units, AreThoseOfTheSi) {
  for (const SiUnit& unit : si_units) {
    const std::string name = unit.name;
    const Quantity one = parse_quantity("1 " + name), less = parse_quantity("-0.25 " + name + " ");
    EXPECT_TRUE(one.has_unit) << name;
    EXPECT_EQ(one.dimension, unit.dimension) << name;
    EXPECT_DOUBLE_EQ(one.value, unit.factor) << name;
    EXPECT_DOUBLE_EQ(less.value, -0.25 * unit.factor) << name;
  }
}

// A number may be a part of a longer text, and have a sign.
TEST(Units, FollowANumberThatEndsWithItsText) {
  const std::string_view whole = "7+2.5 mm and 123 m";
  EXPECT_EQ(parse_quantity(whole.substr(1, 7)).value, 0.0025);
  EXPECT_EQ(parse_quantity(whole.substr(13, 2)).value, 12);
  EXPECT_EQ(parse_quantity(whole.substr(13)).value, 123);
}

TEST(Units, HavePowersAndInverses) {
  for (const SiUnit& unit : si_units) {
    const std::string name = unit.name;
    const double f = unit.factor;
    for (const auto& [text, n, factor] : {std::tuple{"1/" + name, -1, 1 / f},
                                          {name + "^2", 2, f * f},
                                          {name + "²", 2, f * f},
                                          {name + "³", 3, f * f * f},
                                          {name + "^-2", -2, 1 / (f * f)},
                                          {"m·" + name, 0, f},
                                          {"m/" + name, 0, 1 / f}}) {
      const Quantity quantity = parse_quantity("1 " + text);
      EXPECT_NEAR(quantity.value / factor, 1, 1e-14) << text;
      if (n != 0) {
        EXPECT_EQ(quantity.dimension, power_of(unit.dimension, n)) << text;
      }
    }
    Dimension product = unit.dimension, quotient = power_of(unit.dimension, -1);
    ++product.length, ++quotient.length;
    EXPECT_EQ(parse_quantity("1 m·" + name).dimension, product) << name;
    EXPECT_EQ(parse_quantity("1 m/" + name).dimension, quotient) << name;
  }
}

// No unit is read that the table above does not hold.
TEST(Units, HaveNoOthersBesideThem) {
  const std::string source =
      shakebed::tests::read_text(std::filesystem::path(SHAKEBED_SOURCE_DIR) / "pipelines/formats/quantity.cpp");
  const std::string begin = "constexpr std::array units";
  const std::string table = source.substr(source.find(begin), source.find("});") - source.find(begin));
  const std::regex row(R"re(\{"([^"]+)", (dimension::|newton|pascal))re");
  std::set<std::string> read, tested;
  for (std::sregex_iterator found(table.begin(), table.end(), row), end; found != end; ++found)
    read.insert((*found)[1].str());
  for (const SiUnit& unit : si_units) tested.insert(unit.name);
  EXPECT_EQ(read, tested);
}

TEST(Units, OfOneDimensionAgree) {
  for (const auto& [one, other] : {std::pair{"3 N/m^2", "3 Pa"},
                                   {"3 kg*m^2/s^2", "3 J"},
                                   {"3 J/s", "3 W"},
                                   {"3 kg m/s²", "3 N"},
                                   {"3 mN m", "3 mJ"},
                                   {"90 km/h", "25 m/s"},
                                   {"3 1/ms", "3 kHz"},
                                   {"1 m³", "1e9 mm^3"},
                                   {"2.7 t/m^3", "2700 mg/cm^3"},
                                   {"150 µm/px", "0.15 mm/pixel"}}) {
    const Quantity left = parse_quantity(one), right = parse_quantity(other);
    EXPECT_DOUBLE_EQ(left.value, right.value) << one;
    EXPECT_EQ(left.dimension, right.dimension) << one;
  }
}

struct Named {
  Dimension dimension;
  const char *si, *words, *example;
};
const Named named[] = {
    {dimension::none, "", "a plain number", "1 "},
    {dimension::length, "m", "a length", "2.99 mm"},
    {dimension::area, "m^2", "an area", "1 m^2"},
    {dimension::time, "s", "a time", "10 s"},
    {dimension::frequency, "Hz", "a frequency", "20 Hz"},
    {dimension::velocity, "m/s", "a velocity", "0.3 m/s"},
    {dimension::acceleration, "m/s^2", "an acceleration", "9.81 m/s^2"},
    {dimension::mass, "kg", "a mass", "37.8 mg"},
    {dimension::density, "kg/m^3", "a mass density", "2700 kg/m^3"},
    {dimension::energy, "J", "an energy", "1 J"},
    {dimension::power, "W", "a power", "1 W"},
    {dimension::pixels, "px", "a length in pixels", "20 px"},
    {dimension::length_per_pixel, "m/px", "a scale (length per pixel)", "0.15 mm/px"},
    {dimension::angle, "rad", "an angle", "1.5 deg"},
    {newton, "N", "a quantity in N", "1 N"},
    {pascal, "Pa", "a quantity in Pa", "1 Pa"},
    {{.length = 2, .time = -3}, "m^2/s^3", "a quantity in m^2/s^3", "1 m^2/s^3"},
    {{.mass = 1, .pixel = -2}, "kg/px^2", "a quantity in kg/px^2", "1 kg/px^2"},
};

// The SI unit of a dimension, and the value in it, lead back to the same.
TEST(Units, OfADimensionLeadBackToIt) {
  for (const Named& one : named) {
    EXPECT_EQ(si_unit(one.dimension), one.si);
    EXPECT_EQ(name_of(one.dimension), one.words);
    EXPECT_EQ(example_of(one.dimension), one.example);
    const Quantity back = parse_quantity(quantity_text(0.7, one.dimension));
    EXPECT_EQ(back.value, 0.7) << one.si;
    EXPECT_EQ(back.dimension, one.dimension) << one.si;
    if (*one.si != '\0') {
      EXPECT_EQ(parse_quantity(one.example).dimension, one.dimension) << one.example;
    }
  }
}

TEST(Units, AreRefusedForAnotherDimension) {
  for (const Named& one : named) {
    for (const Named& other : named) {
      const std::string text = quantity_text(2, one.dimension);
      if (one.dimension == other.dimension || *one.si == '\0')
        EXPECT_EQ(parse_quantity(text, other.dimension), 2) << text;
      else
        EXPECT_THROW(parse_quantity(text, other.dimension), std::invalid_argument) << text << " as " << other.words;
    }
  }
}

TEST(Units, ForPeopleAreHandy) {
  for (const auto& [value, of, text] : {std::tuple{2.0, dimension::length, "2 m"},
                                        {0.00299, dimension::length, "2.99 mm"},
                                        {0.0897, dimension::length, "89.7 mm"},
                                        {7e-7, dimension::length, "0.7 um"},
                                        {12.0, dimension::time, "12 s"},
                                        {0.05, dimension::time, "50 ms"},
                                        {0.0005, dimension::time, "0.5 ms"},
                                        {2e-5, dimension::time, "20 us"},
                                        {2.0, dimension::mass, "2 kg"},
                                        {0.025, dimension::mass, "25 g"},
                                        {3.78e-5, dimension::mass, "37.8 mg"},
                                        {1.5e-4, dimension::length_per_pixel, "0.15 mm/px"},
                                        {20.0, dimension::frequency, "20 Hz"},
                                        {0.0, dimension::length, "0 m"},
                                        {9.81, dimension::acceleration, "9.81 m/s^2"},
                                        {0.25, dimension::none, "0.25"}})
    EXPECT_EQ(handy_text(value, of), text);
}

TEST(Units, ThatWereForgottenAreGuessed) {
  EXPECT_EQ(likely_quantity("3", 3, dimension::length), "3 mm");
  EXPECT_EQ(likely_quantity("0.1", 0.1, dimension::length), "0.1 mm");
  EXPECT_EQ(likely_quantity("0.06", 0.06, dimension::length), "0.06 m");
  EXPECT_EQ(likely_quantity("0.15", 0.15, dimension::length_per_pixel), "0.15 mm/px");
  EXPECT_EQ(likely_quantity("0.0005", 0.0005, dimension::length_per_pixel), "0.0005 m/px");
  EXPECT_EQ(likely_quantity("2", 2, dimension::angle), "2 deg");
  EXPECT_EQ(likely_quantity("20", 20, dimension::frequency), "20 Hz");
}

TEST(EditDistance, CountsChangesAndSwapsAsOne) {
  EXPECT_EQ(edit_distance("", "abc"), 3);
  EXPECT_EQ(edit_distance("abc", "abc"), 0);
  EXPECT_EQ(edit_distance("abc", "abd"), 1);
  EXPECT_EQ(edit_distance("abc", "ac"), 1);
  EXPECT_EQ(edit_distance("abc", "acb"), 1) << "a swap of neighbours";
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
}

// What stands beside a word in a longer text is no part of it.
TEST(EditDistance, IsThatOfTheWordsAlone) {
  const std::string_view text = "xay";
  EXPECT_EQ(edit_distance(text.substr(1, 1), "zzax"), 3);
  EXPECT_EQ(edit_distance(text.substr(1, 1), "zzay"), 3);
  EXPECT_EQ(edit_distance("zzax", text.substr(1, 1)), 3);
}

}  // namespace
