// Commands with options in place of a recipe: which recipe or question they stand for, and what is said of each option.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/process.hpp"
#include "tests/pipelines/painted_picture.hpp"
#include "tests/pipelines/program.hpp"
#include "tests/pipelines/read_table.hpp"

namespace shakebed::tests::option_commands {
namespace {

using pipelines::Json;
using testing::HasSubstr;
using testing::Not;

class OptionCommands : public testing::Test {
 protected:
  ProgramResult run(const std::vector<std::string>& arguments) { return run_shakebed(arguments, folder_.path()); }
  // What is wrong with the options, without "error: " and the end of the line.
  std::string refused(const std::vector<std::string>& arguments, int code = 2) {
    const ProgramResult ran = run(arguments);
    EXPECT_EQ(ran.exit_code, code) << ran.err;
    EXPECT_EQ(ran.err.substr(0, 7), "error: ");
    return ran.err.substr(7, ran.err.find('\n') - 7);
  }
  ScratchFolder folder_;
};

// A file that is no picture: the recipe is written, and its first stage fails.
class ImageCommands : public OptionCommands {
 protected:
  ImageCommands() { write_text(folder_ / "p.png", "no picture"); }
  std::vector<std::string> with(const std::vector<std::string>& more, const char* diameter = "3 mm") {
    std::vector<std::string> arguments{"fit-images", "p.png", "--out", "o", "--diameter", diameter};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  Json recipe(const std::vector<std::string>& more) {
    EXPECT_EQ(run(with(more)).exit_code, 4);
    return Json::parse(read_text(folder_ / "o/resolved.json"));
  }
};

TEST_F(ImageCommands, StandForARecipe) {
  const Json plain = recipe({"--frequency", "20 Hz"});
  EXPECT_EQ(plain["name"], "fit-images");
  ASSERT_EQ(plain["stages"].size(), 3U) << "no map without an amplitude";
  const Json& stage = plain["stages"][0];
  EXPECT_EQ(stage["images"], (folder_ / "p.png").string());
  EXPECT_EQ(stage["diameter"], "0.003 m");
  EXPECT_EQ(stage["overlays"], 2);
  for (const char* key : {"scale", "floor", "radius", "bead_number", "second_diameter", "frame_rate", "lens"})
    EXPECT_FALSE(stage.contains(key)) << key;
  EXPECT_FALSE(stage.contains("frequency")) << "of photographs";
  EXPECT_NEAR(plain["stages"][1]["plateau_density"].get<double>(), 2 / std::sqrt(3), 1e-12);
  EXPECT_EQ(plain["stages"][2]["from"], Json::parse(R"(["extract", "fit"])"));
}

// Gamma = a (2 pi f)^2/g. Digits that were written are rounded ones: of 2.5 mm +-0.1/sqrt(12), of 20 Hz +-1/sqrt(12),
// which counts twice.
TEST_F(ImageCommands, StandForARecipeWithEveryOption) {
  const Json full = recipe({"--scale",
                            "0.2 mm/px",
                            "--floor",
                            "100",
                            "--left-wall",
                            "3",
                            "--right-wall",
                            "90",
                            "--roi",
                            "1,2,30,40",
                            "--polarity",
                            "dark",
                            "--radius",
                            "7",
                            "--channel",
                            "red",
                            "--shape",
                            "any",
                            "--second-diameter",
                            "4 mm",
                            "--gravity",
                            "9.7 m/s^2",
                            "--pixel-aspect",
                            "1.1",
                            "--lens",
                            "0.01",
                            "--bead-number",
                            "50",
                            "--kernel",
                            "top_hat:1.5",
                            "--model",
                            "fermi",
                            "--plateau-density",
                            "1.1",
                            "--amplitude",
                            "2.5 mm",
                            "--frequency",
                            "20 Hz",
                            "--frame-rate",
                            "500 Hz",
                            "--initial-height",
                            "30 mm"})["stages"];
  ASSERT_EQ(full.size(), 4U);
  const Json expected = Json::parse(R"({ "scale": "2e-04 m/px", "floor": 100, "left_wall": 3, "right_wall": 90,
      "roi": [1, 2, 30, 40], "polarity": "dark", "radius": 7, "channel": "red", "shape": "any",
      "second_diameter": "0.004 m", "gravity": "9.7 m/s^2", "pixel_aspect": 1.1, "lens": 0.01, "bead_number": 50,
      "floor_amplitude": "0.0025 m", "kernel": { "kind": "top_hat", "width": 1.5 }, "frame_rate": "500 Hz",
      "frequency": "20 Hz" })");
  for (const auto& [key, given] : expected.items()) EXPECT_EQ(full[0][key], given) << key;
  EXPECT_EQ(full[1]["model"], "fermi");
  EXPECT_EQ(full[1]["plateau_density"], 1.1);
  const double omega = 2 * M_PI * 20, gamma = 0.0025 * omega * omega / 9.7;
  EXPECT_NEAR(full[3]["gamma"].get<double>(), gamma, 1e-12);
  EXPECT_NEAR(full[3]["gamma_std_error"].get<double>(), gamma * std::hypot(0.1 / 2.5, 2 / 20.0) / std::sqrt(12), 1e-12);
  EXPECT_EQ(full[3]["frequency"], "20 Hz");
  EXPECT_NEAR(full[3]["initial_height"].get<double>(), 10, 1e-12);
  EXPECT_EQ(full[3]["from"], Json::parse(R"(["fit", "extract"])"));
}

TEST_F(ImageCommands, HaveTheDigitsOfTheirShaking) {
  const Json map = recipe({"--amplitude", "2.50 mm", "--frequency", "20.0 Hz"})["stages"][3];
  const double omega = 2 * M_PI * 20;
  EXPECT_NEAR(map["gamma"].get<double>(), 0.0025 * omega * omega / 9.81, 1e-12);
  EXPECT_NEAR(map["gamma_std_error"].get<double>() / map["gamma"].get<double>(),
              std::hypot(0.01 / 2.5, 2 * 0.1 / 20) / std::sqrt(12), 1e-12);
  EXPECT_FALSE(map.contains("initial_height"));
}

TEST_F(ImageCommands, NameTheirOptions) {
  EXPECT_EQ(refused(with({}, "3")), "--diameter: \"3\" has no unit. Write \"3 mm\"");
  EXPECT_EQ(refused(with({}, "1 m")),
            "--diameter: the bead has a diameter of 1 m, but beads of experiments are 50 um to a "
            "few cm. Did you mean \"1 mm\"? A plain number is in metres");
  const auto warned = [&](const char* diameter) { return run({"fit-images", "none.png", "--diameter", diameter}).err; };
  EXPECT_THAT(warned("0.2 m"), HasSubstr("warning: --diameter: the bead has a diameter of 200 mm"));
  EXPECT_THAT(warned("3 mm"), Not(HasSubstr("--diameter")));
  const std::string said = run(with({}, "0.2 m")).err;
  EXPECT_THAT(said, HasSubstr("a diameter of 200 mm"));
  EXPECT_EQ(said.find("a diameter of 200 mm"), said.rfind("a diameter of 200 mm")) << "once";
  EXPECT_EQ(refused(with({"--scale", "3"})), "--scale: \"3\" has no unit. Write \"3 mm/px\"");
  EXPECT_EQ(refused(with({"--scale", "0 mm/px"})), "--scale: must be above 0, got 0");
  EXPECT_THAT(refused(with({"--second-diameter", "4"})), HasSubstr("--second-diameter: \"4\" has no unit"));
  EXPECT_THAT(refused(with({"--amplitude", "2 s"})), HasSubstr("--amplitude: \"2 s\" is a time"));
  EXPECT_THAT(refused(with({"--gravity", "9 m"})), HasSubstr("--gravity: "));
  EXPECT_THAT(refused(with({"--frame-rate", "-5 Hz"})), HasSubstr("--frame-rate: must be above 0, got -5"));
  EXPECT_EQ(refused(with({"--kernel", "none"})),
            "--kernel: expected gaussian:WIDTH, top_hat:WIDTH or disk_chord:WIDTH (in D), got \"none\"");
  EXPECT_THAT(refused(with({"--bead-number", "0"}), 3),
              testing::StartsWith("--bead-number: must be 1 or more, got 0."));
  EXPECT_EQ(refused(with({"--bead-number=-1"})), "--bead-number: must not be negative, got -1; see --help");
  EXPECT_EQ(refused(with({"--skip=-2"})), "--skip: must not be negative, got -2; see --help");
  EXPECT_EQ(refused(with({"--roi", "1,2,0,4"}), 3), "--roi: width and height must be at least 8 pixels");
  EXPECT_EQ(refused(with({"--plateau-density", "1.1548"})),
            "--plateau-density: must be above 0 and at most 1.1547005383792515 (close packing), got 1.1548");
  EXPECT_EQ(refused(with({"--amplitude", "2 mm", "--frequency", "20 Hz", "--initial-height", "0"})),
            "--initial-height: must be above 0, got 0");
  for (const bool preview : {false, true}) {  // which refuses what the run after it would
    const auto budget = [&](std::vector<std::string> more) {
      if (preview) more.emplace_back("--preview");
      return refused(with(more));
    };
    EXPECT_EQ(budget({"--budget", "5 %", "--frame-rate", "100 Hz"}),
              "--budget: velocities need successive frames, so it cannot be combined with --frame-rate");
    EXPECT_THAT(budget({"--budget", "5 m"}), testing::StartsWith("--budget: "));
  }
  EXPECT_EQ(refused({"fit-images", "none.png", "--diameter", "3 mm"}, 4), "there is no file or folder \"none.png\"");
}

TEST_F(ImageCommands, OfAnInferenceNameTheirOptions) {
  const auto infer = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"infer-bed", "p.png", "--diameter", "3 mm", "--frequency", "20 Hz"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return refused(arguments);
  };
  const std::string range = ": expected LOW,HIGH with LOW below HIGH, both from ";
  EXPECT_EQ(infer({"--gamma", "0.09,5"}), "--gamma" + range + "0.1 to 1000; got 0.09,5");
  EXPECT_EQ(infer({"--gamma", "5,1001"}), "--gamma" + range + "0.1 to 1000; got 5,1001");
  EXPECT_EQ(infer({"--restitution", "0.5,0.5"}), "--restitution" + range + "0 to 1; got 0.5,0.5");
  EXPECT_EQ(infer({"--friction", "-0.1,1"}), "--friction" + range + "0 to 10; got -0.1,1");
  EXPECT_EQ(infer({"--friction", "0,11"}), "--friction" + range + "0 to 10; got 0,11");
  EXPECT_THAT(infer({"--phase", "0.5", "--frame-rate", "100 Hz"}),
              HasSubstr("--phase: a film (--frame-rate) shows all phases of the shaking"));
  EXPECT_THAT(infer({"--kernel", "disk_chord:1"}), HasSubstr("are measured through a Gaussian. Write gaussian:WIDTH"));
  EXPECT_THAT(infer({"--beds", "19"}), HasSubstr("--beds"));
}

// Nothing can be read: the first pilot of the budget, every fourth of 17 pictures, says so.
TEST_F(ImageCommands, SayWhyTheirPilotFailed) {
  std::vector<std::string> arguments{"fit-images", "--diameter", "3 mm", "--budget", "5 %", "--out", "o"};
  for (int k = 0; k < 17; ++k) {
    arguments.push_back("p" + std::to_string(10 + k) + ".png");
    write_text(folder_ / arguments.back(), "no picture");
  }
  EXPECT_THAT(refused(arguments, 5), testing::StartsWith("the pilot run of --budget, with 5 of 17 frames, failed: "
                                                         "extract (extract): the frames: none could be read (" +
                                                         (folder_ / "p10.png").string() + ": "));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "o/extract"));
}

// Its page repeats them in the command of the run.
TEST_F(ImageCommands, APreviewReadsEveryLength) {
  write_text(folder_ / "a.pgm",
             PaintedPicture(150, 130).disks(lattice(10, 5, 20, 122, 118, 0.02), 10, 60).blur(0.7).noise(2).pgm());
  const ProgramResult ran = run({"fit-images", "a.pgm", "--diameter", "4 mm", "--second-diameter", "2.5 mm", "--scale",
                                 "0.2 mm/px", "--preview", "--out", "v"});
  EXPECT_EQ(ran.exit_code, 0) << ran.err;
  EXPECT_THAT(read_text(folder_ / "v/preview.html"),
              HasSubstr("a.pgm --diameter &quot;4 mm&quot; --second-diameter &quot;2.5 mm&quot; --scale &quot;0.2 "
                        "mm/px&quot; "));
}

// --- shipped recipes, points of your own, clusters

TEST_F(OptionCommands, ReproduceNamesItsRecipes) {
  EXPECT_EQ(refused({"reproduce", "lee-1996"}), "there is no recipe \"lee-1996\"; did you mean \"lee-1995\"?");
  EXPECT_EQ(refused({"reproduce", "al"}), "there is no recipe \"al\"; did you mean \"all\"?");
  EXPECT_EQ(refused({"reproduce", "zzzzzzzzzzz"}),
            "there is no recipe \"zzzzzzzzzzz\"; `shakebed reproduce --list` shows the names");
}

// A stage that no recipe has: each recipe is refused, one does not keep the others from being tried.
TEST_F(OptionCommands, ReproduceTriesAllRecipes) {
  const ProgramResult ran = run({"reproduce", "all", "--preset", "quick", "--only", "nobody", "--out", "o"});
  EXPECT_EQ(ran.exit_code, 2) << "the code of the first";
  const Json listed = Json::parse(run({"reproduce", "--list", "--json"}).out);
  ASSERT_GE(listed.size(), 12U);
  std::size_t at = 0, of_table = ran.out.find("== all figures\n");
  ASSERT_NE(of_table, std::string::npos);
  for (const Json& recipe : listed) {
    const auto name = recipe["name"].get<std::string>();
    at = ran.out.find("== " + name + "\n", at);
    ASSERT_LT(at, of_table) << name;
    EXPECT_THAT(ran.err, HasSubstr("error: " + name + ": there is no stage \"nobody\"")) << name;
    const std::size_t row = ran.out.find("\n" + name + " ", of_table);
    ASSERT_NE(row, std::string::npos) << name;
    const std::string line = ran.out.substr(row + 1, ran.out.find('\n', row + 1) - row - 1);
    EXPECT_THAT(line, HasSubstr(" exit code 2 ")) << name;
    EXPECT_THAT(line, testing::EndsWith("  o/" + name + "/report.html")) << name;
  }
}

TEST_F(OptionCommands, PointsNeedAStageThatDrawsThem) {
  write_text(folder_ / "mine.csv", "height,number_density\n0,1\n1,0.5\n");
  write_text(folder_ / "r.json", small_recipe());
  EXPECT_EQ(refused({"run", "r.json", "--data", "mine.csv"}),
            "--data: no stage of this recipe draws the points. Leave --data out, or add a figure stage to the recipe");
  EXPECT_THAT(refused({"run", "r.json", "--data", "none.csv"}, 4), HasSubstr("--data none.csv: there is no such file"));
}

// Three points in two tasks: the scripts are written, and what would be submitted is shown.
TEST_F(OptionCommands, SubmitShowsItsJobs) {
  write_text(folder_ / "r.json", small_recipe(R"({ "over": { "/stages/bed/seed": [1, 2, 3] } })"));
  const ProgramResult ran = run({"submit", "slurm", "r.json", "--shards", "2", "--sbatch=--time=1:00:00", "--set",
                                 "/stages/bed/measure=0.4 s", "--out", "o", "--dry-run"});
  ASSERT_EQ(ran.exit_code, 0) << ran.err;
  const std::string folder = std::filesystem::canonical(folder_ / "o/slurm").string();
  EXPECT_EQ(ran.out, "sbatch --parsable --array=1-2 --output=" + folder + "/%x-%A-%a.log --time=1:00:00 " + folder +
                         "/array.sh\nsbatch --parsable --output=" + folder +
                         "/%x-%j-gather.log --time=1:00:00 --dependency=afterany:JOB " + folder + "/gather.sh\n");
  EXPECT_THAT(read_text(folder_ / "o/slurm/array.sh"), HasSubstr(" --set '/stages/bed/measure=0.4 s' "));
  EXPECT_THAT(read_text(folder_ / "o/slurm/array.sh"), HasSubstr("--shard \"$SLURM_ARRAY_TASK_ID/2\"\n"));
  write_text(folder_ / "r.json", small_recipe());
  EXPECT_THAT(refused({"submit", "slurm", "r.json", "--dry-run"}), HasSubstr("this recipe has no \"sweep\""));
}

// --- what is installed beside the program

// A program of its own, in bin/, with what an installation holds made by hand.
class InstalledProgram : public OptionCommands {
 protected:
  InstalledProgram() {
    for (const char* part : {"bin", "share/shakebed", "libexec/shakebed", "work"})
      std::filesystem::create_directories(folder_ / part);
    std::filesystem::copy_file(program_file(), folder_ / "bin/shakebed");
  }
  pipelines::ProcessResult installed(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), (folder_ / "bin/shakebed").string());
    return pipelines::run_process(arguments, folder_ / "work");
  }
};

TEST_F(InstalledProgram, WritesItsLivePage) {
  const std::string page = "<!doctype html>\n<!-- shakebed live: test -->\n<p>one</p>\n";
  write_text(folder_ / "share/shakebed/live-bed.html", page);
  EXPECT_EQ(installed({"live"}).output, "wrote bed.html: open it in a browser\n");
  EXPECT_EQ(read_text(folder_ / "work/bed.html"), page);
  // Its own page is replaced, and no other file.
  write_text(folder_ / "share/shakebed/live-bed.html", page + "two");
  std::filesystem::create_directory(folder_ / "work/d");
  EXPECT_EQ(installed({"live", "--out", "bed.html"}).exit_code, 0);
  EXPECT_EQ(read_text(folder_ / "work/bed.html"), page + "two");
  EXPECT_EQ(Json::parse(installed({"live", "--out", "d", "--json"}).output)["file"], "d/bed.html");
  EXPECT_EQ(read_text(folder_ / "work/d/bed.html"), page + "two");
  write_text(folder_ / "work/thesis.html", "<!doctype html><p>mine</p>" + std::string(200, ' ') + page);
  const pipelines::ProcessResult refused = installed({"live", "--out", "thesis.html"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_EQ(refused.output,
            "error: thesis.html exists and was not written by shakebed live; name another file with --out\n");
  EXPECT_THAT(read_text(folder_ / "work/thesis.html"), testing::StartsWith("<!doctype html><p>mine"));
}

// The program of the benchmarks takes the place of this one, with all that follows "bench".
TEST_F(InstalledProgram, BecomesItsBenchmarks) {
  const std::filesystem::path bench = folder_ / "libexec/shakebed/shakebed-bench";
  write_text(bench, "#!/bin/sh\nprintf '%s,' \"$@\"\nexit 7\n");
  std::filesystem::permissions(bench, std::filesystem::perms::owner_all);
  const pipelines::ProcessResult ran = installed({"bench", "--quick", "a b", "--help"});
  EXPECT_EQ(ran.exit_code, 7);
  EXPECT_EQ(ran.output, "--quick,a b,--help,");
  std::filesystem::permissions(bench, std::filesystem::perms::owner_read);
  EXPECT_THAT(
      installed({"bench"}).output,
      testing::MatchesRegex("error: .*/libexec/shakebed/shakebed-bench: cannot be started: Permission denied\n"));
}

// Manual pages and completions, written at installation.
class CommandPages : public OptionCommands {
 protected:
  CommandPages() { EXPECT_EQ(run({"--write-command-pages", "p"}).exit_code, 0); }
  std::string page(const std::string& name) { return read_text(folder_ / ("p/man/man1/" + name + ".1")); }
  // What bash offers behind these words, in their order.
  std::vector<std::string> offered(const std::vector<std::string>& words) {
    std::vector<std::string> arguments{
        "bash", "-c",
        ". p/bash-completion/completions/shakebed\nCOMP_WORDS=(\"$@\") COMP_CWORD=$(($# - 1))\n_shakebed\n"
        "printf '%s\\n' \"${COMPREPLY[@]}\"",
        "bash", "shakebed"};
    arguments.insert(arguments.end(), words.begin(), words.end());
    std::istringstream lines(pipelines::run_process(arguments, folder_.path()).output);
    std::vector<std::string> all;
    for (std::string line; std::getline(lines, line);)
      if (!line.empty()) all.push_back(line);
    return all;
  }
};

TEST_F(CommandPages, AreOneForEachCommand) {
  const std::string all = page("shakebed");
  std::size_t pages = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "p/man/man1")) {
    std::string name = entry.path().stem().string();
    ++pages;
    if (name == "shakebed") continue;
    for (std::size_t i = 0; (i = name.find('-', i)) != std::string::npos; i += 2) name.replace(i, 1, "\\-");
    EXPECT_THAT(all, HasSubstr("\n.BR " + name + " (1)\n")) << name;
  }
  std::size_t named = 0;
  for (std::size_t at = 0; (at = all.find("\n.BR shakebed\\-", at)) != std::string::npos; ++at) ++named;
  EXPECT_EQ(named, pages - 1);
  EXPECT_THAT(all, HasSubstr("\n.BR shakebed\\-submit\\-slurm (1)\n"));
  EXPECT_THAT(all, testing::StartsWith(".TH shakebed 1 \"\" \"shakebed "));
  EXPECT_THAT(all, HasSubstr("\n.SH EXIT STATUS\n"));
}

TEST_F(CommandPages, HoldTheOptionsAndExamplesOfACommand) {
  const std::string theory = page("shakebed-theory");
  EXPECT_THAT(theory, testing::StartsWith(".TH shakebed-theory 1 \"\" \"shakebed "));
  EXPECT_THAT(theory, HasSubstr("\n.SH NAME\nshakebed\\-theory \\- compute the constants of the theory, T_c and the "
                                "solid height\n.SH SYNOPSIS\n.B shakebed theory\n[\\fIoptions\\fR]\n.SH OPTIONS\n"));
  EXPECT_THAT(theory, HasSubstr("\n.TP\n\\fB\\-q, \\-\\-quiet\\fR\nshow the result"));
  EXPECT_THAT(theory, HasSubstr("\n.TP\n\\fB\\-\\-plateau\\-density\\fR \\fIFLOAT\\fR\ndensity phi_0 of the solid"));
  EXPECT_THAT(theory, HasSubstr("\n.SH EXAMPLES\n.nf\n  shakebed theory \\-\\-plateau\\-density 1.10\n"));
  EXPECT_THAT(theory, testing::EndsWith("\n.TP\n130\ninterrupted\n.SH SEE ALSO\n.BR shakebed (1)\n"));
  // What has no dashes belongs to the synopsis; words to choose from are an argument.
  EXPECT_THAT(page("shakebed-status"), HasSubstr("\n.B shakebed status\n.I folder\n[\\fIoptions\\fR]\n"));
  EXPECT_THAT(page("shakebed-status"), HasSubstr("\n.TP\n\\fBfolder\\fR \\fIDIR\\fR\nresults folder"));
  EXPECT_THAT(page("shakebed-graph"), HasSubstr("\\-\\-format\\fR \\fI{dot,mermaid}\\fR\n"));
  EXPECT_THAT(page("shakebed-submit-slurm"), HasSubstr("\n.B shakebed submit slurm\n.I recipe\n"));
}

TEST_F(CommandPages, CompleteInBash) {
  using testing::Contains;
  using testing::ElementsAre;
  write_text(folder_ / "slope.csv", "");
  EXPECT_THAT(offered({"rep"}), ElementsAre("reproduce"));
  EXPECT_THAT(offered({"--vers"}), ElementsAre("--version"));
  EXPECT_THAT(offered({"theory", "--col"}), ElementsAre("--column-number"));
  EXPECT_THAT(offered({"fit-images", "--polarity", ""}), ElementsAre("automatic", "dark", "bright"));
  EXPECT_THAT(offered({"fit-images", "--polarity", "b"}), ElementsAre("bright"));
  EXPECT_THAT(offered({"fit-profile", "slo"}), ElementsAre("slope.csv"));
  EXPECT_THAT(offered({"submit", "sl"}), ElementsAre("slurm", "slope.csv"));
  EXPECT_THAT(offered({"submit", "slurm", "--sha"}), ElementsAre("--shards"));
  EXPECT_THAT(offered({"run", "--shards"}), testing::IsEmpty());
}

TEST_F(CommandPages, CompleteInZsh) {
  const std::string text = read_text(folder_ / "p/zsh/site-functions/_shakebed");
  EXPECT_THAT(text, testing::StartsWith("#compdef shakebed\n_shakebed() {\n"));
  EXPECT_THAT(text, HasSubstr("\n    'reproduce:run a shipped recipe\\: a published result, end to end'\n"));
  EXPECT_THAT(text,
              HasSubstr("\n    theory)\n      _arguments \\\n        '-h[Print this help message and exit]' \\\n"));
  EXPECT_THAT(text, HasSubstr("\n        '--json[JSON result on stdout, messages on stderr]' \\\n"));
  EXPECT_THAT(text, HasSubstr("\n        '--polarity["));
  EXPECT_THAT(text, HasSubstr("]:{automatic,dark,bright}:(automatic dark bright)' \\\n"));
  EXPECT_THAT(text, HasSubstr("\n        '--initial-height[height mu of the bed at rest\\: in D, or a length with its "
                              "unit]:TEXT:_files' \\\n"));
  EXPECT_THAT(text, Not(HasSubstr("\n    submit slurm)")));
}

// --- theory and map

// 11 a diameter of width over a density of 1.1: 10 D high.
TEST_F(OptionCommands, TheoryTakesHeightsInDiametersAndLengths) {
  const auto theory = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"theory", "--json", "--plateau-density", "1.1"});
    return Json::parse(run(more).out);
  };
  for (const std::vector<std::string>& height : {std::vector<std::string>{"--initial-height", "10"},
                                                 {"--column-number", "11"},
                                                 {"--initial-height", "30 mm", "--diameter", "3 mm"}}) {
    const Json found = theory(height);
    EXPECT_NEAR(found["initial_height"].get<double>(), 10, 1e-12) << height[0];
    EXPECT_NEAR(found["column_number"].get<double>(), 11, 1e-12);
    EXPECT_EQ(found.contains("critical_temperature_over_mg"), height.size() == 4);
  }
  const Json warm = theory({"--initial-height", "10", "--temperature", "0.3 mm", "--diameter", "3 mm"});
  EXPECT_NEAR(warm["temperature"].get<double>(), 0.1, 1e-12);
  EXPECT_NEAR(warm["reduced_temperature"].get<double>(), 0.1 / warm["critical_temperature"].get<double>(), 1e-12);
  EXPECT_EQ(theory({"--eos", "luding"})["equation_of_state"], "luding");
  EXPECT_EQ(
      refused({"theory", "--initial-height", "30 mm"}),
      "--initial-height: a length needs --diameter as well; give --diameter, or write a plain number of diameters");
  EXPECT_EQ(refused({"theory", "--initial-height", "3 s", "--diameter", "3 mm"}),
            "--initial-height: \"3 s\" is not a length; write for example \"30 mm\", or a plain number of diameters");
  EXPECT_EQ(refused({"theory", "--initial-height", "3", "--column-number", "3"}),
            "--initial-height and --column-number are equivalent: give one");
  EXPECT_EQ(refused({"theory", "--temperature", "0.1"}),
            "--temperature: T/T_c needs the height of the bed as well; give --initial-height or --column-number");
  EXPECT_EQ(refused({"theory", "--initial-height", "3", "--temperature", "-1"}),
            "--temperature: must be above 0, got -1");
  EXPECT_EQ(refused({"theory", "--initial-height", "0"}), "--initial-height: must be above 0, got 0");
  EXPECT_EQ(refused({"theory", "--initial-height", "high"}), "--initial-height: \"high\" does not begin with a number");
}

TEST_F(OptionCommands, MapTakesGammaOrAnAmplitude) {
  const auto map = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"map", "--frequency", "20 Hz", "--diameter", "3 mm"});
    return more;
  };
  const auto json = [&](std::vector<std::string> more) {
    more.emplace_back("--json");
    return Json::parse(run(map(more)).out);
  };
  const double omega = 2 * M_PI * 20;
  const Json found = json({"--amplitude", "2.5 mm", "--initial-height", "30 mm", "--gravity", "9.7 m/s^2",
                           "--temperature", "0.36 mm", "--plateau-density", "1.1"});
  EXPECT_NEAR(value(found["gamma"]), 0.0025 * omega * omega / 9.7, 1e-12);
  EXPECT_NEAR(value(found["initial_height"]), 10, 1e-12);
  EXPECT_NEAR(value(found["measured_temperature"]), 0.12, 1e-12);
  EXPECT_EQ(value(found["gravity"]), 9.7);
  EXPECT_EQ(value(json({"--gamma", "4", "--initial-height", "10"})["gravity"]), 9.81);
  EXPECT_NE(json({"--gamma", "4", "--initial-height", "10", "--restitution", "0.99"})["readings"],
            json({"--gamma", "4", "--initial-height", "10"})["readings"]);
  EXPECT_EQ(refused(map({"--initial-height", "10"})), "neither --gamma nor --amplitude is given: give one of them");
  EXPECT_EQ(refused(map({"--initial-height", "10", "--gamma", "4", "--amplitude", "2 mm"})),
            "--gamma and --amplitude are equivalent: give one of them");
  EXPECT_EQ(refused(map({"--initial-height", "10", "--gamma", "4", "--restitution", "0.991"})),
            "--restitution: must be from 0 to 0.99, got 0.991");
  EXPECT_EQ(refused(map({"--initial-height", "10", "--gamma", "4", "--restitution", "-0.1"})),
            "--restitution: must be from 0 to 0.99, got -0.1");
  EXPECT_EQ(refused(map({"--initial-height", "10", "--gamma", "0"})), "--gamma: must be above 0, got 0");
  EXPECT_EQ(refused(map({"--initial-height", "0", "--gamma", "4"})), "--initial-height: must be above 0, got 0");
  EXPECT_EQ(refused(map({"--initial-height", "10", "--gamma", "4", "--gravity", "0 m/s^2"})),
            "--gravity: must be above 0, got 0");
  EXPECT_EQ(refused({"map", "--frequency", "20 s", "--diameter", "3 mm", "--initial-height", "10", "--gamma", "4"}),
            "--frequency: \"20 s\" is a time, but a frequency is needed: expected a frequency such as \"20 Hz\"");
}

// --- fit-profile

// A tail exp(-z/2) above z = 8: in the window asked for, as the file or the option says.
TEST_F(OptionCommands, FitProfileTakesItsWindowKernelAndColumn) {
  std::string text = "# kernel: gaussian:0.5\n# column_number: 11\nheight,number_density,std_error\n";
  for (int i = 0; i < 60; ++i) {
    const double z = 4 + 0.25 * i, density = z < 8 ? 1.1 : 1.1 * std::exp(-(z - 8) / 2);
    text += std::to_string(z) + "," + std::to_string(density) + ",0.01\n";
  }
  write_text(folder_ / "p.csv", text);
  const auto fit = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"fit-profile", "p.csv", "--json", "--plateau-density", "1.1"});
    const ProgramResult ran = run(more);
    EXPECT_EQ(ran.exit_code, 0) << ran.err;
    return Json::parse(ran.out);
  };
  const Json plain = fit({"--out", "o"});
  EXPECT_EQ(Json::parse(read_text(folder_ / "o/fit.json")), plain);
  EXPECT_EQ(value(plain["column_number"]), 11);
  EXPECT_EQ(value(plain["plateau_density"]), 1.1);
  EXPECT_EQ(plain["kernel"]["kind"], "gaussian");
  EXPECT_FALSE(plain.contains("temperature_over_mg"));
  const Json asked = fit({"--window", "9,15", "--column-number", "12", "--kernel", "top_hat:1", "--diameter", "2 mm",
                          "--model", "hydrostatic:luding"});
  EXPECT_EQ(value(asked["window"]["low"]), 9);
  EXPECT_EQ(value(asked["window"]["high"]), 15);
  EXPECT_EQ(value(asked["column_number"]), 12);
  EXPECT_EQ(asked["kernel"]["kind"], "top_hat");
  EXPECT_EQ(asked["model"], "hydrostatic:luding");
  EXPECT_NEAR(value(asked["temperature_over_mg"]), 0.002 * value(asked["temperature"]), 1e-12);
  EXPECT_THAT(refused({"fit-profile", "p.csv", "--kernel", "square:1"}), HasSubstr("there is no kernel \"square:1\""));
}

}  // namespace
}  // namespace shakebed::tests::option_commands
