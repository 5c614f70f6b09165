// What stages read: tables of a floor's motion, the disks of a start, where things are in frames, tables of studies,
// profiles; each with the mistakes that are named. And the smaller facts of scenes and replicas.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "pipelines/formats/duration.hpp"
#include "pipelines/formats/frame_geometry.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/annealing.hpp"
#include "pipelines/stages/frame_store.hpp"
#include "pipelines/stages/measured_profile.hpp"
#include "pipelines/stages/replica_seed.hpp"
#include "pipelines/stages/scene_options.hpp"
#include "pipelines/stages/study_numbers.hpp"
#include "pipelines/stages/study_table.hpp"
#include "tests/pipelines/decoded_scene.hpp"
#include "tests/pipelines/lone_stage.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;

// What an InputError says.
template <class Work>
std::string mistake_of(const Work& work) {
  try {
    work();
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

// --- stages in "from"

TEST(StagesInFrom, AreFoundByKindOrId) {
  LoneStage fit(*find_stage("fit"));
  fit.add_input("one", *find_stage("simulate"), "1");
  EXPECT_EQ(fit.input("simulate").id, "one");
  EXPECT_EQ(fit.input_from("").id, "one") << "the only one needs no name";
  EXPECT_EQ(mistake_of([&] { fit.input("extract"); }),
            "this stage needs the result of a stage of kind \"extract\": name one in \"from\"");
  fit.add_input("two", *find_stage("simulate"), "2"), fit.add_input("film", *find_stage("extract"), "3");
  EXPECT_EQ(fit.input("extract").id, "film");
  EXPECT_EQ(fit.input_from("two").id, "two");
  EXPECT_EQ(mistake_of([&] { fit.input("simulate"); }),
            "\"from\" names 2 stages of kind \"simulate\", but this stage reads only one");
  EXPECT_EQ(mistake_of([&] { fit.input_from("tow"); }), "\"tow\" is not in the \"from\" of this stage");
  EXPECT_EQ(mistake_of([&] { fit.input_from(""); }), "\"\" is not in the \"from\" of this stage");
  write_text(fit.file("2/bed.json"), "{}");
  EXPECT_EQ(fit.input_from("two").file("bed.json"), fit.file("2/bed.json"));
  EXPECT_EQ(mistake_of([&] { fit.input_from("one").file("bed.json"); }),
            "the stage \"one\" (simulate) has not written the file bed.json");
}

TEST(FloorTableMistakes, AreNamedWithTheirLine) {
  const ScratchFolder folder;
  const auto mistake = [&](const std::string& text) {
    write_text(folder / "f.csv", text);
    const std::string what = mistake_of([&] { read_floor_table(folder / "f.csv"); });
    return what.substr(std::min(what.size(), what.find("f.csv")));
  };
  EXPECT_EQ(mistake("time,z\n0,1\n"), "f.csv:1: expected a header with the columns time,height or height");
  EXPECT_EQ(mistake("time,height\n0,1\n1\n"), "f.csv:3: expected 2 columns, found 1");
  EXPECT_EQ(mistake("# mm\nheight\n0\n1 mm\n"), "f.csv:4: \"1 mm\" is not a number");
  EXPECT_EQ(mistake("height\ninf\n"), "f.csv:2: \"inf\" is not a number");
  EXPECT_EQ(mistake("height,\n0,\n,\n"), "f.csv:3: \"\" is not a number");
  EXPECT_EQ(mistake("time,height\n0,1\n0,2\n"), "f.csv:3: the times must increase from row to row");
  EXPECT_EQ(mistake("time,height\n0,1\n1,2\n2.0022,1\n"), "f.csv:4: the times are not equally spaced");
  EXPECT_EQ(mistake("time,height\n0,1\n1,2\n2.0019,1\n3,2\n"), "") << "to a thousandth of the mean step";
  EXPECT_EQ(mistake("height\n0\n1\n0\n"), "f.csv: a period of the floor needs at least 4 positions, found 3");
  EXPECT_EQ(mistake("height\n0\n1\n0\n-1\n"), "");
}

TEST(FloorTable, OfHeightsAloneHasNoDuration) {
  const ScratchFolder folder;
  write_text(folder / "f.csv", "step,height,time\n9,1,0.5\n9,2,1\n9,3,1.5\n9,4,2\n9,5,2.5\n");
  const FloorTable named = read_floor_table(folder / "f.csv");
  EXPECT_THAT(named.heights, ElementsAre(1, 2, 3, 4, 5)) << "columns go by their names";
  EXPECT_DOUBLE_EQ(*named.duration, 2.5);
  write_text(folder / "f.csv", "height\n1\n2\n3\n4\n");
  EXPECT_FALSE(read_floor_table(folder / "f.csv").duration);
}

// --- starts

TrajectoryFrame three_disks(double first = 0) {
  TrajectoryFrame frame;
  frame.width = 9;
  for (int k = 0; k < 3; ++k) {
    frame.x.push_back(first + 1 + 2 * k), frame.z.push_back(0.5 + k);
    frame.vx.push_back(0.1 * k), frame.vz.push_back(-0.2 * k), frame.spin.push_back(0.3 * k);
    frame.radius.push_back(k == 1 ? 0.75 : 0.5);
  }
  return frame;
}
void write_frames(const std::filesystem::path& path, const std::vector<TrajectoryFrame>& frames) {
  TrajectoryWriter writer(path);
  for (const TrajectoryFrame& frame : frames) writer.write(frame);
  writer.close();
}

TEST(StartFromAFile, IsItsLastFrame) {
  const ScratchFolder folder;
  write_frames(folder / "t.xyz", {three_disks(2), three_disks(0)});
  sim::Disks disks;
  disks.species = {{2, 1, 1}, {1, 1.5, 2}};
  const sim::PlacedStart start = read_start(folder / "t.xyz", disks);
  ASSERT_EQ(start.disks.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto i = static_cast<double>(k);
    EXPECT_NEAR(start.disks[k].x, 1 + 2 * i, 1e-12);
    EXPECT_NEAR(start.disks[k].z, 0.5 + i, 1e-12);
    EXPECT_NEAR(start.disks[k].vx, 0.1 * i, 1e-12);
    EXPECT_NEAR(start.disks[k].vz, -0.2 * i, 1e-12);
    EXPECT_NEAR(start.disks[k].spin, 0.3 * i, 1e-12);
    EXPECT_EQ(start.disks[k].species, k == 1 ? 1U : 0U);
  }
}

TEST(StartFromAFile, MustHoldTheDisksOfTheBed) {
  const ScratchFolder folder;
  write_frames(folder / "t.xyz", {three_disks()});
  const auto mistake = [&](std::vector<sim::Species> species) {
    sim::Disks disks;
    disks.species = std::move(species);
    return mistake_of([&] { read_start(folder / "t.xyz", disks); });
  };
  EXPECT_THAT(mistake({{4, 1, 1}}), EndsWith("t.xyz: the last frame has 3 disks, but the bed has 4"));
  EXPECT_THAT(mistake({{3, 1, 1}}), EndsWith("disk 1 has the diameter 1.5 D, but no species has this diameter"));
  EXPECT_THAT(mistake({{1, 1, 1}, {2, 1.5, 2}}),
              EndsWith("the last frame has 2 disks of species 1, but the bed has 1"));
  EXPECT_THAT(mistake({{2, 1, 1}, {1, 1, 2}}), HasSubstr("both species have the same diameter"));
  EXPECT_EQ(mistake({{2, 1, 1}, {1, 1.5, 2}}), "none");
}

// --- scenes

SceneOptions scene_with(const std::string& disks, const std::string& rest, bool reduced = false) {
  std::vector<Problem> problems;
  SceneOptions options =
      tests::decoded_scene(fmt::format(R"({{ "disks": {{ "count": 40{} }}, "box": {{ "width": {} {} }})", disks,
                                       reduced ? "12.3" : "\"49.2 mm\"", rest),
                           problems, reduced);
  for (const Problem& problem : problems) ADD_FAILURE() << problem.pointer << ": " << problem.what;
  return options;
}

// At the floor's greatest speed; without a floor that moves at the thermal speed of the bath, else at that of a fall
// from D: sqrt(10 m/s^2 4 mm) = 0.2 m/s, in a bath of T = D/4 half of it.
TEST(RealContacts, LastByTheSpeedOfTheBed) {
  const std::string steel = R"(, "diameter": "4 mm", "material": "steel")", g = R"( }, "gravity": "10 m/s^2")";
  const auto at_speed = [](double speed) { return hertz_contact_time(constants_of(Material::steel), 0.004, speed); };
  const auto time = [&](const std::string& more) { return scene_with(steel, g + more).hertz_contact_time().value(); };
  EXPECT_DOUBLE_EQ(time(""), at_speed(0.2));
  EXPECT_DOUBLE_EQ(time(R"(, "bath": { "kind": "andersen", "temperature": "1 mm", "rate": "5 Hz" })"), at_speed(0.1));
  EXPECT_DOUBLE_EQ(time(R"(, "floor": { "motion": "sinusoidal", "amplitude": "3 mm", "frequency": "20 Hz" })"),
                   at_speed(2 * std::numbers::pi * 20 * 0.003));
  EXPECT_FALSE(scene_with(R"(, "diameter": "4 mm")", g).hertz_contact_time()) << "of no material";
  // A lighter bead of the same stiffness: t goes with the mass to the power 2/5.
  const SceneOptions light = scene_with(steel + R"(, "density": "3930 kg/m^3")", g);
  EXPECT_NEAR(*light.hertz_contact_time() / at_speed(0.2), std::pow(0.5, 0.4), 1e-12);
}

TEST(ScenesThatDissipate, LoseEnergySomewhere) {
  const auto loses = [](const std::string& disks, const std::string& rest) {
    return scene_with(disks, rest, true).dissipates();
  };
  EXPECT_FALSE(loses("", R"(, "lid": { "kind": "free", "height": 30, "mass": 9 } })"));
  EXPECT_TRUE(loses("", R"(, "lid": { "kind": "free", "height": 30, "mass": 9, "restitution": 0.9 } })"));
  EXPECT_FALSE(loses("", R"(, "lid": { "kind": "fixed", "height": 30 } })"));
  EXPECT_FALSE(loses("", " }"));
  EXPECT_TRUE(loses(R"(, "restitution": 0.99)", " }"));
}

TEST(ScenesThatMayBeginAtRandom, AreOpenAndHaveNoPlacesGiven) {
  const auto may = [](const std::string& rest) { return scene_with("", rest, true).may_be_filled_at_random(); };
  EXPECT_TRUE(may(" }"));
  EXPECT_FALSE(may(R"(, "lid": { "kind": "fixed", "height": 30 } })"));
  EXPECT_FALSE(may(R"( }, "start": "random")"));
  EXPECT_FALSE(may(R"(, "lid": { "kind": "periodic", "height": 30 }, "sides": "periodic" }, "gravity": 0)"));
}

TEST(TwoSpeciesOfAScene, DifferInSizeOrMass) {
  const auto two = [](const std::string& second) {
    return scene_with(second.empty() ? "" : R"(, "second": { "count": 3, )" + second + " }", " }", true).two_species();
  };
  EXPECT_FALSE(two(""));
  EXPECT_FALSE(two(R"("diameter": 1)"));
  EXPECT_TRUE(two(R"("diameter": 1.1)"));
  EXPECT_TRUE(two(R"("diameter": 1, "density": 2)"));
  EXPECT_FALSE(two(R"("diameter": 1, "density": 1)"));
}

// SplitMix64 as published: the first numbers of the seeds 0 and 1234567.
TEST(SeedsOfReplicas, AreOfSplitMix64) {
  EXPECT_EQ(mixed(0), 0xe220a8397b1dcdafULL);
  EXPECT_EQ(mixed(1234567), 6457827717110365317ULL);
  EXPECT_EQ(replica_seed(1234567, 0), 1234567U);
  EXPECT_EQ(replica_seed(1234567, 2), mixed(6457827717110365317ULL ^ 2) >> 11);
  EXPECT_LT(replica_seed(3, 1), std::uint64_t{1} << 53);
}

// A ramp of 20 units is cut in 20 pieces, each at the temperature of its middle; one of 4 in 16; a hold in 64.
TEST(BathOfAnAnnealing, FollowsItsRampsAndHolds) {
  const std::vector<sim::BathStep> bath = Annealing({{3, 20, 0}, {1, 4, 32}}, 1).bath();
  ASSERT_EQ(bath.size(), 20U + 16 + 64);
  EXPECT_DOUBLE_EQ(bath[0].until, 1);
  EXPECT_DOUBLE_EQ(bath[0].temperature, 1.05);
  EXPECT_DOUBLE_EQ(bath[19].until, 20);
  EXPECT_DOUBLE_EQ(bath[19].temperature, 2.95);
  EXPECT_DOUBLE_EQ(bath[20].until, 20.25);
  EXPECT_DOUBLE_EQ(bath[20].temperature, 3 - 2.0 / 32);
  EXPECT_DOUBLE_EQ(bath[35].until, 24);
  EXPECT_DOUBLE_EQ(bath[36].until, 24.5);
  EXPECT_DOUBLE_EQ(bath[36].temperature, 1);
  EXPECT_DOUBLE_EQ(bath[99].until, 56);
}

// --- frames

TEST(GeometryOfFrames, ComesBack) {
  const ScratchFolder folder;
  const FrameGeometry geometry{1.5e-4, 301.5, 12.25, 412.75, 0.5, 425, 320, true};
  write_text(folder / "g.json", dump(geometry.to_json()));
  const FrameGeometry read = FrameGeometry::read(folder / "g.json");
  EXPECT_DOUBLE_EQ(read.scale, 1.5e-4);
  EXPECT_EQ(read.floor, 301.5);
  EXPECT_EQ(read.left_wall, 12.25);
  EXPECT_EQ(read.right_wall, 412.75);
  EXPECT_EQ(read.lowest, 0.5);
  EXPECT_EQ(read.width, 425);
  EXPECT_EQ(read.height, 320);
  EXPECT_TRUE(read.periodic);
  EXPECT_EQ(geometry.to_json()["scale"]["unit"], "m/px");
  EXPECT_EQ(geometry.to_json()["lowest"]["unit"], "D");
  write_text(folder / "g.json", R"({"scale": {"value": 1}})");
  EXPECT_THAT(mistake_of([&] { FrameGeometry::read(folder / "g.json"); }),
              EndsWith("g.json: /floor: a quantity is missing here"));
}

TEST(GeometryOfFrames, OfPeriodicSidesIsASentence) {
  const FrameGeometry geometry{0, 0, 12.25, 412.75, 0, 425, 320, true};
  EXPECT_EQ(geometry.sides_text(), "periodic sides at columns 12.25 and 412.75 of 425 x 320 px");
  const auto read = FrameGeometry::from_sides_text(geometry.sides_text());
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->periodic);
  EXPECT_EQ(read->left_wall, 12.25);
  EXPECT_EQ(read->right_wall, 412.75);
  EXPECT_EQ(read->width, 425);
  EXPECT_EQ(read->height, 320);
  for (const char* text :
       {"", "periodic sides", "periodic sides at columns 5 and 5 of 9 x 9 px",
        "periodic sides at columns 1 and 5 of 0 x 9 px", "periodic sides at columns 1 and 5 of 9 x 0 px",
        "periodic sides at columns 7 and 5 of 9 x 9 px"})
    EXPECT_FALSE(FrameGeometry::from_sides_text(text)) << text;
}

// Of 100,000 disks two frames are a group. A run that goes on from a checkpoint ends with the same bytes.
TEST(StoreOfFrames, GoesOnFromItsCheckpoint) {
  const ScratchFolder folder;
  const auto frame = [](double time) {
    TrajectoryFrame one = three_disks();
    one.time = time;
    return one;
  };
  FrameStore whole(folder / "a.part", 100'000);
  whole.start();
  for (const double time : {1.0, 2.0, 3.0, 4.0, 5.0}) whole.add(frame(time));
  whole.finish(folder / "a.xyz");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.part"));
  EXPECT_EQ(count_frames(folder / "a.xyz"), 5U);
  FrameStore killed(folder / "b.part", 100'000);
  killed.start();
  for (const double time : {1.0, 2.0, 3.0}) killed.add(frame(time));
  FrameStore again = killed;  // its state at a checkpoint: one frame waits
  killed.add(frame(7));       // written, and then lost
  again.go_on();
  for (const double time : {4.0, 5.0}) again.add(frame(time));
  again.finish(folder / "b.xyz");
  EXPECT_EQ(read_text(folder / "b.xyz"), read_text(folder / "a.xyz"));
  FrameStore lost = killed;
  std::filesystem::remove(folder / "b.part");
  EXPECT_THROW(lost.go_on(), StageError);
}

// --- tables

TEST(TableOfAStudy, HasItsCellsByName) {
  const ScratchFolder folder;
  const auto table = [&](const std::string& text) {
    write_text(folder / "t.csv", text);
    return read_study_table(folder / "t.csv");
  };
  const StudyTable read = table("# of a study\nseries,gamma,T,T_error\na,4,0.5,0.01\nb,5,,-1\nc,6,x,\nd,7,1,0\n");
  EXPECT_TRUE(read.has("T_error"));
  EXPECT_FALSE(read.has("gamma_error"));
  EXPECT_EQ(read.column("T"), 2U);
  EXPECT_THAT(mistake_of([&] { read.column("gama"); }), HasSubstr("gamma"));
  EXPECT_EQ(read.series(1), "b");
  EXPECT_EQ(read.number(0, 1), 4);
  EXPECT_FALSE(read.number(1, 2));
  EXPECT_THAT(mistake_of([&] { return read.number(2, 2); }), EndsWith("t.csv: \"x\" in column \"T\" is not a number"));
  EXPECT_EQ(read.error(0, "T"), 0.01);
  EXPECT_EQ(read.error(3, "T"), 0);
  EXPECT_FALSE(read.error(0, "gamma"));
  EXPECT_FALSE(read.error(2, "T"));
  EXPECT_THAT(mistake_of([&] { return read.error(1, "T"); }), EndsWith("a standard error of \"T\" is negative"));
  EXPECT_EQ(table("gamma\n4\n").series(0), "");
  EXPECT_THAT(mistake_of([&] { table("a,b\n1,2\n3\n"); }),
              EndsWith("t.csv:3: expected 2 columns, as in the header, found 1"));
  EXPECT_THAT(mistake_of([&] { table("a,b\n"); }), EndsWith("t.csv: the table has no rows below its header"));
}

// 1, 2 and 6: mean 3, squares 4 + 1 + 9 = 14, error sqrt(14/2/3).
TEST(MeansOfRuns, AreOfThoseThatHaveTheNumber) {
  const MeanOfRuns three({{1, 0.1}, {NAN, NAN}, {2, 0.1}, {6, 0.1}});
  EXPECT_EQ(three.n, 3);
  EXPECT_DOUBLE_EQ(three.mean, 3);
  EXPECT_DOUBLE_EQ(three.error, std::sqrt(7.0 / 3));
  const MeanOfRuns one({{NAN, 9}, {5, 0.25}, {NAN, 8}});
  EXPECT_EQ(one.mean, 5);
  EXPECT_EQ(one.error, 0.25);
  const MeanOfRuns none({{NAN, 1}});
  EXPECT_EQ(none.n, 0);
  EXPECT_TRUE(std::isnan(none.mean) && std::isnan(none.error));
}

TEST(ProfileOfAStage, SaysWhatItDoesNotState) {
  const ScratchFolder folder;
  write_text(folder / "p.csv", "height,number_density\n0,1\n0.5,0.8\n1,0.4\n");
  MeasuredProfile read = read_measured_profile(folder / "p.csv", std::nullopt, std::nullopt);
  EXPECT_THAT(read.profile.height, ElementsAre(0, 0.5, 1));
  EXPECT_THAT(read.profile.number_density, ElementsAre(1, 0.8, 0.4));
  EXPECT_EQ(read.kernel.kind, KernelKind::none);
  ASSERT_EQ(read.warnings.size(), 2U);
  EXPECT_THAT(read.warnings[0], HasSubstr("p.csv: the profile has no standard errors"));
  EXPECT_THAT(read.warnings[1], HasSubstr("does not state through which kernel"));
  read = read_measured_profile(folder / "p.csv", std::nullopt, Kernel{KernelKind::gaussian, 0.5});
  EXPECT_EQ(read.kernel.kind, KernelKind::gaussian);
  EXPECT_EQ(read.kernel.width, 0.5);
  EXPECT_EQ(read.warnings.size(), 1U);
  write_text(folder / "p.csv", "height,number_density,std_error\n0,1,0.1\n0.5,0.8,0.2\n1,0.4,0.3\n");
  read = read_measured_profile(folder / "p.csv", std::nullopt, Kernel{KernelKind::gaussian, 0.5});
  EXPECT_THAT(read.profile.std_error, ElementsAre(0.1, 0.2, 0.3));
  EXPECT_TRUE(read.warnings.empty());
}

// Two digits below ten seconds and below a tenth of one; rounding does not make "60 s" of a minute, nor "1000 ms".
TEST(DurationsForPeople, HaveTwoDigits) {
  for (const auto& [seconds, text] : {std::pair{0.0, "0 ms"},
                                      {0.0994, "99 ms"},
                                      {0.0996, "0.1 s"},
                                      {3.24, "3.2 s"},
                                      {9.94, "9.9 s"},
                                      {9.96, "10 s"},
                                      {99.4, "99 s"},
                                      {100, "1 min 40 s"},
                                      {250.4, "4 min 10 s"},
                                      {3599.4, "59 min 59 s"},
                                      {3599.6, "1 h 0 min"},
                                      {7384, "2 h 3 min"}})
    EXPECT_EQ(duration_text(seconds), text);
  EXPECT_EQ(long_part_text({3, 180, 4.5}), "will take about 3 min 0 s, 40 times the median of 4.5 s");
}

}  // namespace
