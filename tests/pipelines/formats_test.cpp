// JSON, quantities, options, profiles, trajectories, fingerprints.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/config.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/profile_csv.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::pipelines;
using shakebed::tests::ScratchFolder;
using shakebed::tests::write_text;
using testing::HasSubstr;
using testing::Not;

// --- JSON

TEST(Json, RemembersWhereEachValueStood) {
  std::vector<Problem> problems;
  const auto node = parse_json("{\n  \"a\": [1,\n    {\"b\": true}]\n}", "f", problems);
  ASSERT_TRUE(node && problems.empty());
  const JsonNode* b = find_pointer(*node, "/a/1/b");
  ASSERT_NE(b, nullptr);
  EXPECT_EQ(b->at.line, 3);
  EXPECT_EQ(b->at.column, 11);
}

TEST(Json, EveryDoubleComesBackTheSame) {
  std::mt19937_64 random(3);
  for (int i = 0; i < 20000; ++i) {
    const double value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    std::vector<Problem> problems;
    const auto node = parse_json(number_text(value), "f", problems);
    ASSERT_TRUE(node && problems.empty()) << number_text(value);
    ASSERT_EQ(node->number, value);
    ASSERT_EQ(std::strtod(dump_17_digits(Json(value)).c_str(), nullptr), value);
  }
}

TEST(Json, UnicodeEscapesBecomeUtf8) {
  std::vector<Problem> problems;
  const auto node = parse_json(R"("\u00b5m \u03c6 \ud83d\ude00")", "f", problems);
  ASSERT_TRUE(node && problems.empty());
  EXPECT_EQ(node->text, "µm φ 😀");
  EXPECT_FALSE(parse_json(R"("\ud83d")", "f", problems));
}

TEST(Json, NoTextOfRandomBytesIsACrash) {
  std::mt19937 random(5);
  const std::string alphabet = "{}[]\",:0123456789.eE+-truefalsn\\u \n\xff";
  for (int i = 0; i < 20000; ++i) {
    std::string text(random() % 40, ' ');
    for (char& c : text) c = alphabet[random() % alphabet.size()];
    std::vector<Problem> problems;
    const auto node = parse_json(text, "f", problems);
    EXPECT_TRUE(node || !problems.empty()) << text;
  }
}

TEST(Json, PointersFollowRfc6901) {
  const Json json = Json::parse(R"({"a/b": {"m~n": [10, 20]}, "": 3})");
  ASSERT_NE(find_pointer(json, "/a~1b/m~0n/1"), nullptr);
  EXPECT_EQ(*find_pointer(json, "/a~1b/m~0n/1"), 20);
  EXPECT_EQ(*find_pointer(json, "/"), 3);
  EXPECT_EQ(find_pointer(json, "/a~1b/m~0n/2"), nullptr);
  EXPECT_THROW(split_pointer("a"), UsageError);
  EXPECT_THROW(split_pointer("/a~2"), UsageError);
}

TEST(Json, SetPointerReachesStagesByTheirId) {
  JsonNode root =
      to_node(Json::parse(R"({"stages": [{"stage": "simulate", "id": "bed"}, {"stage": "fit", "bath": "none"}]})"));
  set_pointer(root, "/stages/bed/floor/amplitude", to_node(Json("3 mm")));
  set_pointer(root, "/stages/fit/bath/kind", to_node(Json("langevin")));
  EXPECT_EQ(root.to_json()["stages"][0]["floor"]["amplitude"], "3 mm");
  EXPECT_EQ(root.to_json()["stages"][1]["bath"]["kind"], "langevin");
  EXPECT_THROW(set_pointer(root, "/stages/nobody/x", to_node(Json(1))), UsageError);
}

// --- quantities

TEST(Quantity, DecimalPrefixesAreRoundedOnce) {
  EXPECT_EQ(parse_quantity("2.99 mm", dimension::length), 0.00299);
  EXPECT_EQ(parse_quantity("0.15 mm/px", dimension::length_per_pixel), 0.00015);
  EXPECT_EQ(parse_quantity("1 us", dimension::time), 1e-6);
  EXPECT_EQ(parse_quantity("0.7 um", dimension::length), 0.7e-6);
  EXPECT_EQ(parse_quantity("2.7 g/cm^3", dimension::density), 2700);
  EXPECT_EQ(parse_quantity("9.81 m/s^2", dimension::acceleration), 9.81);
  EXPECT_EQ(parse_quantity("9.81 m/s²", dimension::acceleration), 9.81);
  EXPECT_EQ(parse_quantity("981 cm*s^-2", dimension::acceleration), 9.81);
  EXPECT_EQ(parse_quantity("1e3 mm", dimension::length), 1);
  EXPECT_EQ(parse_quantity("20Hz", dimension::frequency), 20);
  EXPECT_EQ(parse_quantity("20 1/s", dimension::frequency), 20);
  EXPECT_DOUBLE_EQ(parse_quantity("180 deg", dimension::angle), std::numbers::pi);
  EXPECT_EQ(parse_quantity("5", dimension::length), 5) << "plain numbers are SI";
}

TEST(Quantity, GarbageIsRefusedWithASentence) {
  for (const char* text : {"", "mm", "3 mm mm mm^", "3 parsec", "nan", "inf", "infinity m", "1e999 m", "1e400", "3 m/",
                           "3 m^x", "--3 m", "0x10 m", "1e99999999999 m", "3 mm extra"}) {
    EXPECT_THROW(parse_quantity(text, dimension::length), std::invalid_argument) << text;
  }
  try {
    parse_quantity("3 mn", dimension::length);
    FAIL();
  } catch (const std::invalid_argument& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("did you mean \"m"));
  }
}

TEST(Quantity, AUnitIsSuggestedOnlyWhereItIsOfTheKindWanted) {
  const auto told = [](const char* text, const Dimension& wanted) -> std::string {
    try {
      parse_quantity(text, wanted);
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
    return "accepted";
  };
  EXPECT_THAT(told("20 rpm", dimension::frequency), Not(HasSubstr("did you mean")));
  EXPECT_THAT(told("20 hz", dimension::frequency), HasSubstr("did you mean \"Hz\"?"));
  EXPECT_THAT(told("3 mn", dimension::length), HasSubstr("did you mean \"m"));
  EXPECT_THAT(told("3 mn", dimension::time), HasSubstr("did you mean \"m")) << "ms or min";
  EXPECT_THAT(told("3 mn", dimension::time), Not(HasSubstr("\"mm\"")));
  EXPECT_THAT(told("3 m/sc", dimension::velocity), HasSubstr("did you mean \"s\"?"));
}

TEST(Quantity, TextComesBackTheSame) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> exponent(-12, 12);
  for (int i = 0; i < 2000; ++i) {
    const double value = std::pow(10, exponent(random));
    for (const Dimension& d : {dimension::length, dimension::acceleration, dimension::density,
                               dimension::length_per_pixel, dimension::energy, dimension::frequency}) {
      EXPECT_EQ(parse_quantity(quantity_text(value, d), d), value);
    }
  }
}

// --- options from one declaration

struct Flat {};
struct Steep {
  double slope = 0.25;
};
struct Options {
  double length = 0.003;
  std::optional<double> rate;
  int count = 5;
  bool flag = false;
  std::string word = "x";
  std::vector<double> numbers{1, 2};
  std::vector<std::string> words;
  std::variant<Flat, Steep> shape;
};
void describe(Fields& fields, Options& o) {
  fields.quantity("length", o.length, dimension::length, {.help = "a length", .range = positive});
  fields.quantity("rate", o.rate, dimension::frequency);
  fields.integer("count", o.count, {.range = from_to(1, 10)});
  fields.boolean("flag", o.flag);
  fields.text("word", o.word);
  fields.numbers("numbers", o.numbers);
  fields.texts("words", o.words);
  fields.variant("shape", o.shape, {.help = "the shape"}, alternative<Flat>("flat", "level"),
                 alternative<Steep>("steep", "a slope",
                                    [](Fields& f, Steep& s) { f.number("slope", s.slope, {.range = zero_to_one}); }));
}
Options decode(const std::string& text, std::vector<Problem>& problems, bool reduced = false) {
  const auto node = parse_json(text, "f.json", problems);
  Options options;
  Fields::Source source{.file = "f.json"};
  source.problems = &problems;
  Fields fields = Fields::decode(*node, "/here", source);
  fields.set_reduced(reduced);
  describe(fields, options);
  fields.finish();
  return options;
}
Json encode(Options options) {
  Json out;
  Fields fields = Fields::encode(out);
  describe(fields, options);
  return out;
}

TEST(Options, KeepTheirDefaultsAndReadTheRest) {
  std::vector<Problem> problems;
  const Options o =
      decode(R"({"length": "5 mm", "shape": {"kind": "steep", "slope": 0.5}, "$comment": "ignored"})", problems);
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(o.length, 0.005);
  EXPECT_FALSE(o.rate);
  EXPECT_EQ(o.count, 5);
  EXPECT_EQ(std::get<Steep>(o.shape).slope, 0.5);
}

TEST(Options, AWordMayStandForAListOfOne) {
  std::vector<Problem> problems;
  EXPECT_EQ(decode(R"({"words": "one"})", problems).words, std::vector<std::string>{"one"});
  EXPECT_EQ(decode(R"({"words": ["one", "two"]})", problems).words, (std::vector<std::string>{"one", "two"}));
  EXPECT_TRUE(problems.empty());
  decode(R"({"words": 3})", problems);
  EXPECT_EQ(problems.size(), 1U);
}

TEST(Options, WhatIsWrittenOutReadsBackTheSame) {
  std::vector<Problem> problems;
  const Json first =
      encode(decode(R"({"length": "5.3 mm", "rate": "20 Hz", "shape": "steep", "numbers": [0.1]})", problems));
  const Json second = encode(decode(dump(first), problems));
  EXPECT_TRUE(problems.empty());
  EXPECT_EQ(dump(first), dump(second));
  EXPECT_EQ(first["shape"]["slope"], 0.25) << "defaults are written out";
}

TEST(Options, AllMistakesAreReportedAtOnce) {
  std::vector<Problem> problems;
  decode(
      R"({"length": "-5 mm", "rate": "20 mm", "count": 11, "flag": 1, "word": 2, "numbers": [1, "a"], "shape": "stepe", "colour": 3})",
      problems);
  std::vector<std::string> pointers;
  for (const Problem& problem : problems) pointers.push_back(problem.pointer);
  EXPECT_THAT(pointers,
              testing::UnorderedElementsAre("/here/length", "/here/rate", "/here/count", "/here/flag", "/here/word",
                                            "/here/numbers/1", "/here/shape/kind", "/here/colour"));
}

TEST(Options, ReducedUnitsArePlainNumbers) {
  std::vector<Problem> problems;
  EXPECT_EQ(decode(R"({"length": 1.5})", problems, true).length, 1.5);
  EXPECT_TRUE(problems.empty());
  decode(R"({"length": "1.5 mm"})", problems, true);
  ASSERT_EQ(problems.size(), 1u);
  EXPECT_THAT(problems[0].what, HasSubstr("reduced"));
}

TEST(Options, TheSchemaNamesEveryFieldAndItsDefault) {
  Json schema;
  Fields fields = Fields::schema(schema);
  Options options;
  describe(fields, options);
  fields.finish();
  const Json encoded = encode(options);
  for (const auto& [key, value] : encoded.items()) EXPECT_TRUE(schema["properties"].contains(key)) << key;
  EXPECT_EQ(schema["properties"]["count"]["default"], 5);
  EXPECT_EQ(schema["properties"]["count"]["maximum"], 10);
  EXPECT_EQ(schema["additionalProperties"], false);
}

TEST(DidYouMean, FindsTheNearNameAndNoFarOne) {
  EXPECT_EQ(nearest_name("freqency", {"frequency", "amplitude"}), "frequency");
  EXPECT_EQ(nearest_name("ampltiude", {"frequency", "amplitude"}), "amplitude");
  EXPECT_EQ(nearest_name("zzz", {"frequency", "amplitude"}), "");
  EXPECT_EQ(edit_distance("ab", "ba"), 1);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3);
}

// --- fingerprints

TEST(Sha256, AgreesWithThePublishedVectors) {  // FIPS 180-4 examples
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(sha256(std::string(1000000, 'a')), "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST(Sha256, DoesNotDependOnHowTheBytesArrive) {
  const std::string bytes(1000, 'q');
  for (const std::size_t piece : {1u, 3u, 63u, 64u, 65u, 200u}) {
    Sha256 hash;
    for (std::size_t i = 0; i < bytes.size(); i += piece) hash.update(std::string_view(bytes).substr(i, piece));
    EXPECT_EQ(hash.hex(), sha256(bytes));
  }
}

TEST(Zstd, GivesTheSameBytesBackAndRefusesDamage) {
  std::string text;
  for (int i = 0; i < 20000; ++i) text += std::to_string(i * i);
  const std::string packed = compress(text);
  EXPECT_LT(packed.size(), text.size());
  EXPECT_EQ(decompress(packed, "f"), text);
  EXPECT_THROW(decompress(packed.substr(0, packed.size() / 2), "f"), InputError);
  EXPECT_THROW(decompress("no zstd at all", "f"), InputError);
}

// --- profiles

TEST(ProfileCsv, ComesBackTheSame) {
  ScratchFolder folder;
  ProfileTable table;
  table.kernel = shakebed::Kernel{shakebed::KernelKind::gaussian, 0.5};
  table.column_number = 10.2;
  for (int i = 0; i < 20; ++i) {
    table.height.push_back(0.25 * i), table.number_density.push_back(1.0 / (1 + i)),
        table.std_error.push_back(0.01 / 3);
    table.area_fraction.push_back(std::numbers::pi / 4 / (1 + i)), table.samples.push_back(i);
  }
  write_profile_csv(folder / "p.csv", table);
  const ProfileTable back = read_profile_csv(folder / "p.csv");
  EXPECT_EQ(back.height, table.height);
  EXPECT_EQ(back.number_density, table.number_density);
  EXPECT_EQ(back.std_error, table.std_error);
  EXPECT_EQ(back.area_fraction, table.area_fraction);
  EXPECT_EQ(back.samples, table.samples);
  EXPECT_EQ(back.kernel, table.kernel);
  EXPECT_EQ(back.column_number, table.column_number);
  EXPECT_TRUE(back.notes.empty());
}

TEST(ProfileCsv, ReadsWhatPeopleHave) {
  ScratchFolder folder;
  for (const char* text :
       {"z,phi\n2,0.5\n1,0.75\n", "z;phi\r\n2;0.5\r\n1;0.75\r\n", "# mine\nheight\tdensity\n2\t0.5\n1\t0.75",
        "  height   number_density\n 2  0.5\n 1    0.75\n", "\xEF\xBB\xBFheight,number_density\n2,0.5\n1,0.75\n"}) {
    write_text(folder / "p.csv", text);
    const ProfileTable table = read_profile_csv(folder / "p.csv");
    EXPECT_EQ(table.height, (std::vector<double>{1, 2})) << text;
    EXPECT_EQ(table.number_density, (std::vector<double>{0.75, 0.5})) << text;
    EXPECT_TRUE(table.std_error.empty()) << "unknown errors are not 0";
  }
}

TEST(ProfileCsv, RowsWithoutAnErrorTakeThatOfTheNearestHeight) {
  ScratchFolder folder;
  write_text(folder / "p.csv", "height,phi,sigma\n0,1,0\n1,1,0.1\n2,1,\n3,1,0.3\n5,1,0\n");
  const ProfileTable table = read_profile_csv(folder / "p.csv");
  EXPECT_EQ(table.std_error, (std::vector<double>{0.1, 0.1, 0.3, 0.3, 0.3})) << "half way: the larger one";
  ASSERT_EQ(table.notes.size(), 1U);
  EXPECT_THAT(table.notes[0], HasSubstr("3 of 5 rows have no standard error or one of 0 (lines 2, 4, 6)"));
}

TEST(ProfileCsv, CommentsOfUsersNameKernelAndColumnNumber) {
  ScratchFolder folder;
  using shakebed::Kernel;
  using shakebed::KernelKind;
  const auto read = [&](const std::string& comments) {
    write_text(folder / "p.csv", comments + "z,phi\n1,1\n");
    return read_profile_csv(folder / "p.csv");
  };
  EXPECT_EQ(read("").kernel, std::nullopt);
  EXPECT_EQ(read("# kernel: top_hat:0.25\n").kernel, (Kernel{KernelKind::top_hat, 0.25}));
  EXPECT_EQ(read("# kernel: disk_chord\n# kernel_width: 1\n").kernel, (Kernel{KernelKind::disk_chord, 1}));
  EXPECT_EQ(read("# kernel: none\n").kernel, (Kernel{KernelKind::none, 0}));
  EXPECT_EQ(read("# column_number: 10.2\n").column_number, 10.2);
  EXPECT_THROW(read("# kernel: top-hat\n"), InputError);
  EXPECT_THROW(read("# column_number: many\n"), InputError);
}

TEST(ProfileCsv, DamageIsNamedWithItsLine) {
  ScratchFolder folder;
  const auto problem = [&](const char* text) -> std::string {
    write_text(folder / "p.csv", text);
    try {
      read_profile_csv(folder / "p.csv");
    } catch (const InputError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_THAT(problem("height,number_density\n1,0.5\n2,abc\n"), HasSubstr("p.csv:3"));
  EXPECT_THAT(problem("height,number_density\n1,nan\n"), HasSubstr("p.csv:2"));
  EXPECT_THAT(problem("height,number_density\n1\n"), HasSubstr("p.csv:2"));
  EXPECT_THAT(problem("height,number_density\n1,-0.5\n"), HasSubstr("negative"));
  EXPECT_THAT(problem("x,y\n1,2\n"), HasSubstr("header"));
  EXPECT_THAT(problem("height,number_density\n"), HasSubstr("no row"));
  EXPECT_THAT(problem(""), HasSubstr("no header"));
}

// --- trajectories

TrajectoryFrame some_frame(std::size_t disks, double time) {
  std::mt19937_64 random(17 + static_cast<std::uint64_t>(time));
  std::uniform_real_distribution<double> uniform(-1, 40);
  TrajectoryFrame frame;
  frame.time = time, frame.phase = 0.25, frame.floor_position = -0.1 / 3, frame.floor_velocity = 0.7, frame.width = 30;
  for (std::size_t i = 0; i < disks; ++i) {
    frame.x.push_back(uniform(random)), frame.z.push_back(uniform(random)), frame.vx.push_back(uniform(random)),
        frame.vz.push_back(uniform(random));
    frame.radius.push_back(i % 3 == 0 ? 0.4 : 0.5);
    frame.spin.push_back(uniform(random));
  }
  return frame;
}

TEST(Trajectory, ComesBackBitForBit) {
  ScratchFolder folder;
  for (const char* name : {"t.extxyz", "t.extxyz.zst"}) {
    std::vector<TrajectoryFrame> frames;
    {
      TrajectoryWriter writer(folder / name);
      for (int i = 0; i < 40; ++i) frames.push_back(some_frame(500, i)), writer.write(frames.back());
      writer.close();
    }
    TrajectoryReader reader(folder / name);
    TrajectoryFrame frame;
    for (const TrajectoryFrame& expected : frames) {
      ASSERT_TRUE(reader.read(frame));
      EXPECT_EQ(frame.x, expected.x);
      EXPECT_EQ(frame.z, expected.z);
      EXPECT_EQ(frame.vx, expected.vx);
      EXPECT_EQ(frame.vz, expected.vz);
      EXPECT_EQ(frame.radius, expected.radius);
      EXPECT_EQ(frame.spin, expected.spin);
      EXPECT_EQ(frame.time, expected.time);
      EXPECT_EQ(frame.floor_position, expected.floor_position);
      EXPECT_EQ(frame.width, 30);
    }
    EXPECT_FALSE(reader.read(frame));
  }
}

TEST(Trajectory, EveryTruncationIsAnErrorOrFewerFrames) {
  ScratchFolder folder;
  TrajectoryWriter writer(folder / "t.extxyz.zst");
  for (int i = 0; i < 3; ++i) writer.write(some_frame(20, i));
  writer.close();
  const std::string whole = shakebed::tests::read_text(folder / "t.extxyz.zst");
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    write_text(folder / "cut.extxyz.zst", whole.substr(0, size));
    try {
      EXPECT_LT(count_frames(folder / "cut.extxyz.zst"), 3u);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("cut.extxyz.zst:"));
    }
  }
}

TEST(Trajectory, OfPlainTextIsNotACompressedOne) {
  ScratchFolder folder;
  write_text(folder / "t.extxyz.zst", "1\nProperties=pos:R:2 Time=3\n0.5 0.7\n");
  try {
    count_frames(folder / "t.extxyz.zst");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::StartsWith((folder / "t.extxyz.zst").string() +
                                                  ":0: this is not a file compressed with zstd: "));
  }
}

TEST(Trajectory, ReadsTwoDimensionalPositionsAndUnknownColumns) {
  ScratchFolder folder;
  write_text(folder / "t.extxyz",
             "2\nProperties=id:I:1:species:S:1:pos:R:2:charge:R:1 Time=3\n1 A 0.5 0.7 x\n2 A 1.5 0.8 y\n");
  TrajectoryReader reader(folder / "t.extxyz");
  TrajectoryFrame frame;
  ASSERT_TRUE(reader.read(frame));
  EXPECT_EQ(frame.x, (std::vector<double>{0.5, 1.5}));
  EXPECT_EQ(frame.z, (std::vector<double>{0.7, 0.8}));
  EXPECT_EQ(frame.radius, (std::vector<double>{0.5, 0.5}));
}

TEST(Trajectory, OfAProgramWithYUpwardsKeepsItsHeights) {
  ScratchFolder folder;
  write_text(folder / "t.extxyz", "1\nProperties=species:S:1:pos:R:3:velo:R:3 Time=3\nAr 0.5 0.7 0 1 2 0\n");
  TrajectoryReader reader(folder / "t.extxyz", UpAxis::y);
  TrajectoryFrame frame;
  ASSERT_TRUE(reader.read(frame));
  EXPECT_EQ(frame.x, std::vector<double>{0.5});
  EXPECT_EQ(frame.z, std::vector<double>{0.7});
  EXPECT_EQ(frame.vx, std::vector<double>{1});
  EXPECT_EQ(frame.vz, std::vector<double>{2});
}

TEST(Bed, DescriptionComesBackTheSame) {
  BedDescription bed;
  bed.count = 337, bed.diameter = 2.99e-3, bed.gravity = 9.81, bed.width = 89.7e-3, bed.amplitude = 2.5e-3,
  bed.frequency = 20;
  const BedDescription back = BedDescription::from_json(Json::parse(dump(bed.to_json())), "f");
  EXPECT_EQ(dump(back.to_json()), dump(bed.to_json()));
  EXPECT_NEAR(bed.gamma(), 4.0243, 1e-4);
  EXPECT_NEAR(bed.column_number(), 337.0 / 30, 1e-12);
}

}  // namespace
