// A recipe, a profile or a picture from a stranger: it starts no program, writes nothing outside OUT, asks for no
// unbounded memory, and puts nothing into a report that a browser would run.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <set>

#include "pipelines/formats/files.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed::tests;
namespace fs = std::filesystem;

void replace(std::string& text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  ASSERT_NE(at, std::string::npos) << what;
  text.replace(at, what.size(), with);
}

// A figure for each title: "figure0", "figure1", ...
std::string with_figures(const std::vector<std::string>& titles) {
  std::string text = small_recipe(), figures;
  for (std::size_t k = 0; k < titles.size(); ++k)
    figures += R"({ "stage": "figure", "id": "figure)" + std::to_string(k) +
               R"(", "from": ["bed", "fit"], "title": ")" + titles[k] + "\" },\n    ";
  replace(text, "{ \"stage\": \"check\"", figures + "{ \"stage\": \"check\"");
  return text;
}

// Everything below a folder, but for one of its folders.
std::vector<std::string> listing(const fs::path& folder, const std::string& without) {
  std::vector<std::string> names;
  for (auto entry = fs::recursive_directory_iterator(folder); entry != fs::recursive_directory_iterator(); ++entry) {
    if (entry.depth() == 0 && entry->path().filename() == without) {
      entry.disable_recursion_pending();
      continue;
    }
    names.push_back(fs::relative(entry->path(), folder).string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(Safety, TitlesAndNamesStartNoProgram) {
  // What gnuplot, a shell or a format string would act on.
  const std::vector<std::string> titles = {"$(touch pwned)",
                                           "`touch pwned`",
                                           "\\\"; system(\\\"touch pwned\\\"); \\\"",
                                           "'; !touch pwned; '",
                                           "@system('touch pwned')",
                                           "%s%s%s%n",
                                           "\\n!touch pwned\\n",
                                           "| touch pwned",
                                           "<touch pwned",
                                           "\\\\\\\"\\nsystem 'touch pwned'\\n#"};
  const ScratchFolder folder;
  write_text(folder / "r.json", with_figures(titles));
  const auto before = listing(folder.path(), "o");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  EXPECT_EQ(result.exit_code, 0) << "a title is only a title; " << result.err;
  EXPECT_EQ(listing(folder.path(), "o"), before);
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "o"))
    EXPECT_NE(entry.path().filename(), "pwned") << entry.path() << ": the number of the folder is that of the title";
  for (std::size_t k = 0; k < titles.size(); ++k)
    EXPECT_TRUE(fs::exists(folder / ("o/figure" + std::to_string(k)) / "profile.svg")) << titles[k];
}

TEST(Safety, FileNamesOfTheUsersStartNoProgram) {
  for (const char* name : {"$(touch pwned).csv", "`touch pwned`.csv", "a'b\"c;touch pwned;.csv", "| touch pwned.csv",
                           "< touch pwned.csv"}) {
    ScratchFolder folder;
    write_text(folder / "r.json", with_figures({"t"}));
    write_text(folder / name, "height,number_density\n1,0.5\n2,0.4\n");
    const auto before = listing(folder.path(), "o");
    const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o", "--data", name}, folder.path());
    EXPECT_EQ(result.exit_code, 0) << name << ": " << result.err;
    EXPECT_EQ(listing(folder.path(), "o"), before) << name;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "o"))
      EXPECT_NE(entry.path().filename(), "pwned") << name;
  }
}

TEST(Safety, NoShellIsEverNeeded) {
  // With every shell of the machine replaced by an empty file, where the kernel lets us do that, figures are drawn
  // still.
  ScratchFolder folder;
  write_text(folder / "r.json", with_figures({"t"}));
  std::set<std::string> shells;
  for (const char* name : {"/bin/sh", "/bin/bash", "/bin/dash"}) {
    if (fs::exists(name)) shells.insert(fs::canonical(name).string());
  }
  std::string mounts;
  for (const std::string& shell : shells) mounts += "mount --bind /dev/null " + shell + " && ";
  const std::string enter = "cd '" + folder.path().string() + "' && unshare -rm sh -c '";
  if (std::system((enter + mounts + "true' 2> /dev/null").c_str()) != 0) GTEST_SKIP() << "nothing may be mounted here";
  EXPECT_NE(std::system((enter + mounts + "/bin/sh -c true' 2> /dev/null").c_str()), 0) << "the shell is still there";
  EXPECT_EQ(std::system(
                (enter + mounts + "exec " + SHAKEBED_PROGRAM + " run r.json --out o' > /dev/null 2> err.txt").c_str()),
            0)
      << read_text(folder / "err.txt");
  EXPECT_TRUE(fs::is_regular_file(folder / "o/figure0/profile.svg"));
}

TEST(Safety, ChartsStartNoProgramAndStayInTheirFolder) {
  const auto with_chart = [](const std::string& name, const std::string& label, const std::string& file) {
    std::string text = small_recipe();
    replace(text, "{ \"stage\": \"check\"",
            "{ \"stage\": \"chart\", \"id\": \"c\", \"from\": [\"bed\"], \"charts\": [{ \"name\": \"" + name +
                "\", \"x_label\": \"" + label + "\", \"y_label\": \"" + label + "\", \"caption\": \"" + label +
                "\", \"points\": [{ \"name\": \"p\", \"file\": \"" + file +
                "\", \"x\": \"height\", \"y\": \"number_density\", \"label\": \"" + label +
                "\" }] }] },\n    { \"stage\": \"check\"");
    return text;
  };
  const auto run = [&](const std::string& recipe, std::set<int> codes) {
    ScratchFolder folder;
    fs::create_directory(folder / "inner");
    write_text(folder / "inner/r.json", recipe);
    const auto before = listing(folder / "inner", "o");
    const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder / "inner");
    EXPECT_TRUE(codes.contains(result.exit_code)) << recipe << result.exit_code << " " << result.err;
    EXPECT_EQ(listing(folder / "inner", "o"), before) << recipe;
    EXPECT_EQ(listing(folder.path(), "inner"), std::vector<std::string>{}) << recipe;
    if (fs::exists(folder / "inner/o")) {
      for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "inner/o"))
        EXPECT_NE(entry.path().filename().stem(), "pwned") << recipe;
    }
  };
  for (const char* name : {"../pwned", "../../pwned", "/tmp/shakebed-pwned", "..", "a/pwned", "", ".record"})
    run(with_chart(name, "x", "profile.csv"), {3});
  EXPECT_FALSE(fs::exists("/tmp/shakebed-pwned.svg"));
  for (const char* label :
       {"`touch pwned`", "'; system('touch pwned'); '", "$(touch pwned)", "@x {/Symbol", "\\n!touch pwned"})
    run(with_chart("a", label, "profile.csv"), {0});
  // Only results of the stage it names are read.
  for (const char* file : {"../../r.json", "/etc/passwd", "../fit/fit.json"}) run(with_chart("a", "x", file), {3, 4});
}

TEST(Safety, ResultsStayBelowOut) {
  for (const char* id : {"../bed", "..", ".", "/tmp/shakebed-escaped", "a/b", "a\\u0000b", "", "o/../../x", ".hidden",
                         ".lock", "manifest.json", "report.html"}) {
    ScratchFolder folder;
    fs::create_directory(folder / "inner");
    std::string text = small_recipe();
    replace(text, "\"id\": \"bed\"", std::string("\"id\": \"") + id + "\"");
    replace(text, "\"from\": \"bed\"", std::string("\"from\": \"") + id + "\"");
    write_text(folder / "inner/r.json", text);
    const auto before = listing(folder.path(), "");
    const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder / "inner");
    EXPECT_EQ(result.exit_code, 3) << "id \"" << id << "\" " << result.err;
    EXPECT_EQ(listing(folder.path(), ""), before) << id;
  }
  EXPECT_FALSE(fs::exists("/tmp/shakebed-escaped"));
}

TEST(Safety, LinksBelowOutDoNotLeadResultsElsewhere) {
  ScratchFolder folder;
  write_text(folder / "r.json", small_recipe());
  fs::create_directories(folder / "o");
  fs::create_directories(folder / "precious");
  write_text(folder / "precious/keep.txt", "kept");
  fs::create_directory_symlink(folder / "precious", folder / "o/bed");
  write_text(folder / "target.json", "kept");
  fs::create_symlink(folder / "target.json", folder / "o/manifest.json");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o"}, folder.path());
  EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 5) << result.exit_code << result.err;
  EXPECT_EQ(read_text(folder / "precious/keep.txt"), "kept");
  EXPECT_EQ(listing(folder / "precious", ""), (std::vector<std::string>{"keep.txt"}));
  EXPECT_EQ(read_text(folder / "target.json"), "kept");
}

TEST(Safety, CleanRemovesOnlyResultsOfOurs) {
  ScratchFolder folder;
  write_text(folder / "r.json", small_recipe());
  ASSERT_EQ(run_shakebed({"run", "r.json", "--out", "results/a"}, folder.path()).exit_code, 0);
  fs::create_directories(folder / "results/mine");
  write_text(folder / "results/mine/notes.txt", "kept");
  fs::create_directories(folder / "elsewhere");
  write_text(folder / "elsewhere/manifest.json", "{}");
  fs::create_directory_symlink(folder / "elsewhere", folder / "results/link");
  ASSERT_EQ(run_shakebed({"clean", "results"}, folder.path()).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder / "results/a"));
  EXPECT_EQ(read_text(folder / "results/mine/notes.txt"), "kept");
  EXPECT_TRUE(fs::exists(folder / "elsewhere/manifest.json"));
}

// By the time of its manifest, in each unit: what is a little older goes, what is a little younger stays.
TEST(Safety, CleanRemovesOnlyWhatIsOlderThanAsked) {
  const ScratchFolder folder;
  const auto put = [&](const std::string& name, std::chrono::minutes age) {
    fs::create_directories(folder / ("results/" + name));
    write_text(folder / ("results/" + name + "/manifest.json"), "{}");
    fs::last_write_time(folder / ("results/" + name + "/manifest.json"), fs::file_time_type::clock::now() - age);
  };
  using std::chrono::minutes;
  for (const auto& [asked, age] :
       {std::pair{"90min", minutes(90)}, {"36h", minutes(36 * 60)}, {"1.5d", minutes(36 * 60)}}) {
    put("older", age + minutes(10));
    put("younger", age - minutes(10));
    put("new", minutes(0));
    const ProgramResult said = run_shakebed({"clean", "results", "--older-than", asked, "--dry-run"}, folder.path());
    EXPECT_EQ(said.out, "would remove results/older\n") << asked;
    EXPECT_TRUE(fs::exists(folder / "results/older")) << asked;
    ASSERT_EQ(run_shakebed({"clean", "results", "--older-than", asked}, folder.path()).exit_code, 0) << asked;
    EXPECT_EQ(listing(folder / "results", ""),
              (std::vector<std::string>{"new", "new/manifest.json", "younger", "younger/manifest.json"}))
        << asked;
  }
  EXPECT_NE(run_shakebed({"clean", "results", "--older-than", "90"}, folder.path()).exit_code, 0) << "of what?";
  EXPECT_TRUE(fs::exists(folder / "results/younger"));
}

TEST(Safety, ReportsEscapeWhatTheyShow) {
  const std::string attack = "<script>alert(1)</script><img src=x onerror=alert(2)>\\\" onload=alert(3) '&amp;";
  ScratchFolder folder;
  std::string text = with_figures({attack});
  replace(text, "\"name\": \"small\",",
          "\"name\": \"small\", \"description\": \"" + attack + "\", \"report\": { \"title\": \"" + attack +
              "\", \"text\": [\"" + attack + "\"], \"published\": [{ \"number\": \"/fit/temperature\", \"label\": \"" +
              attack + "\", \"value\": \"1\", \"place\": \"" + attack +
              "\" }], \"assumed\": [{ \"input\": \"/stages/bed/disks/count\", \"why\": \"" + attack + "\" }] },");
  write_text(folder / "r.json", text);
  const std::string data = "<script>alert(4)<&.csv";
  write_text(folder / data, "height,number_density\n1,0.5\n");
  const ProgramResult result = run_shakebed({"run", "r.json", "--out", "o", "--data", data}, folder.path());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string page = read_text(folder / "o/report.html");
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
  EXPECT_EQ(page.find("<img src=x"), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;"), std::string::npos) << "the text itself must be shown";
  EXPECT_EQ(read_text(folder / "o/figure0/profile.svg").find("<script>alert"), std::string::npos);
}

// Runs with an address space of so many bytes and 20 s of processor time at most: a program that wants more is killed.
ProgramResult within(rlim_t bytes, const std::vector<std::string>& arguments, const fs::path& folder) {
  rlimit space{}, time{};
  ::getrlimit(RLIMIT_AS, &space);
  ::getrlimit(RLIMIT_CPU, &time);
  const rlimit less_space{std::min(bytes, space.rlim_max), space.rlim_max}, less_time{20, time.rlim_max};
  ::setrlimit(RLIMIT_AS, &less_space);
  ::setrlimit(RLIMIT_CPU, &less_time);
  const ProgramResult result = run_shakebed(arguments, folder);
  ::setrlimit(RLIMIT_AS, &space);
  ::setrlimit(RLIMIT_CPU, &time);
  return result;
}

void put32(std::string& out, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out += static_cast<char>(value >> shift & 0xff);
}
std::uint32_t crc32(std::string_view bytes) {
  std::uint32_t crc = 0xffffffff;
  for (const char c : bytes) {
    crc ^= static_cast<unsigned char>(c);
    for (int k = 0; k < 8; ++k) crc = crc & 1 ? 0xedb88320u ^ crc >> 1 : crc >> 1;
  }
  return ~crc;
}
std::string png(std::uint32_t width, std::uint32_t height, const std::string& data) {
  std::string out = "\x89PNG\r\n\x1a\n";
  const auto chunk = [&](const std::string& kind, const std::string& body) {
    put32(out, static_cast<std::uint32_t>(body.size()));
    out += kind + body;
    put32(out, crc32(kind + body));
  };
  std::string header;
  put32(header, width), put32(header, height);
  header += std::string("\x08\x00\x00\x00\x00", 5);
  chunk("IHDR", header), chunk("IDAT", data), chunk("IEND", "");
  return out;
}

TEST(Safety, PicturesThatClaimToBeHugeAreRefused) {
  ScratchFolder folder;
  write_text(folder / "bomb.png", png(60'000, 60'000, std::string("\x78\x9c\x63\x60\x60\x00\x00\x00\x04\x00\x01", 11)));
  write_text(folder / "large.png",
             png(16'000, 16'000, std::string("\x78\x9c\x63\x60\x60\x00\x00\x00\x04\x00\x01", 11)));
  write_text(folder / "bomb.pgm", "P5\n60000 60000\n255\nx");
  std::string bmp("BM\0\0\0\0\0\0\0\0\x36\0\0\0\x28\0\0\0\x60\xea\0\0\x60\xea\0\0\x01\0\x08\0", 30);
  bmp += std::string(1100, '\0');
  write_text(folder / "bomb.bmp", bmp);
  for (const char* name : {"bomb.png", "large.png", "bomb.pgm", "bomb.bmp"}) {
    const ProgramResult result =
        within(4ull << 30, {"fit-images", name, "--diameter", "3 mm", "--out", "o"}, folder.path());
    EXPECT_EQ(result.exit_code, 4) << name << " " << result.err;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
  }
}

// A film of one picture, as its header and its data say.
std::string avi(std::uint32_t width, std::uint32_t height, const std::string& codec, const std::string& picture) {
  const auto little = [](std::uint32_t value) {
    std::string out;
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
    return out;
  };
  const auto chunk = [&](const std::string& kind, const std::string& body) {
    return kind + little(static_cast<std::uint32_t>(body.size())) + body + std::string(body.size() % 2, '\0');
  };
  std::string head;
  for (const std::uint32_t value : {40'000u, 0u, 0u, 16u, 1u, 0u, 1u, 0u, width, height, 0u, 0u, 0u, 0u})
    head += little(value);
  std::string stream = "vids" + codec;
  for (const std::uint32_t value : {0u, 0u, 0u, 1u, 25u, 0u, 1u, 0u, 0u, 0u, 0u, 0u}) stream += little(value);
  const std::string format = little(40) + little(width) + little(height) + std::string("\x01\0\x18\0", 4) + codec +
                             little(0) + std::string(16, '\0');
  const std::string headers = chunk(
      "LIST", "hdrl" + chunk("avih", head) + chunk("LIST", "strl" + chunk("strh", stream) + chunk("strf", format)));
  return chunk("RIFF", "AVI " + headers + chunk("LIST", "movi" + chunk("00dc", picture)));
}

TEST(Safety, FilmsThatClaimToBeHugeAreRefused) {
  ScratchFolder folder;
  const std::string small_data("\x78\x9c\x63\x60\x60\x00\x00\x00\x04\x00\x01", 11);
  write_text(folder / "claims.avi", avi(30'000, 30'000, std::string(4, '\0'), std::string(100, 'x')));
  write_text(folder / "picture.avi", avi(64, 64, "MPNG", png(16'000, 16'000, small_data)));  // the header is modest
  write_text(folder / "both.avi", avi(65'000, 65'000, "MPNG", png(65'000, 65'000, small_data)));
  write_text(folder / "jpeg.avi", avi(40'000, 40'000, "MJPG", "\xff\xd8\xff\xd9"));
  write_text(folder / "damage.mp4", std::string(1'000, 'x'));
  for (const char* name : {"claims.avi", "picture.avi", "both.avi", "jpeg.avi", "damage.mp4"}) {
    const ProgramResult result =
        within(3ull << 30, {"fit-images", name, "--diameter", "3 mm", "--out", "o"}, folder.path());
    EXPECT_EQ(result.exit_code, 4) << name << " " << result.err;
    EXPECT_NE(result.err.find(name), std::string::npos) << result.err;
    EXPECT_EQ(result.err.find("[mov"), std::string::npos) << "the decoder's own lines: " << result.err;
  }
}

TEST(Safety, CompressedTrajectoriesThatUnfoldToGigabytesAreRefused) {
  ScratchFolder folder;
  // One line of 2 GB of digits: some kB of zstd.
  const std::string zeros = shakebed::pipelines::compress(std::string(200'000'000, '1'), 19);
  std::string bomb;
  for (int i = 0; i < 20; ++i) bomb += zeros;
  write_text(folder / "bomb.extxyz.zst", bomb);
  std::string text = small_recipe();
  replace(text, "\"settle\"", "\"start\": {\"kind\": \"file\", \"file\": \"bomb.extxyz.zst\"}, \"settle\"");
  write_text(folder / "r.json", text);
  const ProgramResult result = within(1ull << 30, {"validate", "r.json"}, folder.path());
  EXPECT_TRUE(result.exit_code == 3 || result.exit_code == 4) << result.exit_code << " " << result.err;
  EXPECT_NE(result.err.find("bomb.extxyz.zst"), std::string::npos) << result.err;
}

TEST(Safety, LargeRecipesCostNoMoreThanTheyAre) {
  ScratchFolder folder;
  // 10 MB of each kind of repetition, in 1 GB of address space.
  const std::string shapes[] = {"[" +
                                    [] {
                                      std::string s;
                                      while (s.size() < 10'000'000) s += "[],";
                                      return s + "[]]";
                                    }(),
                                "{\"name\": \"x\", \"stages\": [" +
                                    [] {
                                      std::string s;
                                      while (s.size() < 10'000'000) s += "{},";
                                      return s + "{}]}";
                                    }(),
                                "{\"name\": \"" + std::string(10'000'000, 'x') + "\", \"stages\": []}",
                                "{\"name\": " + std::string(10'000'000, '1') + "}",
                                std::string(10'000'000, '\\'),
                                std::string(10'000'000, '{')};
  for (const std::string& shape : shapes) {
    write_text(folder / "large.json", shape);
    const ProgramResult result = within(1ull << 30, {"validate", "large.json"}, folder.path());
    EXPECT_EQ(result.exit_code, 3) << shape.substr(0, 40) << ": " << result.err.substr(0, 500);
    EXPECT_LT(result.err.size(), 20'000'000u);
  }
}

TEST(Safety, ASweepIsNotUnfoldedBeforeItsSizeIsKnown) {
  ScratchFolder folder;
  write_text(folder / "r.json",
             small_recipe(R"({ "over": { "/stages/bed/seed": { "from": 1, "to": 100000, "count": 100000 },
    "/stages/bed/disks/restitution": { "from": 0.1, "to": 0.9, "count": 100000 } } })"));
  const ProgramResult result = within(1ull << 30, {"validate", "r.json"}, folder.path());
  EXPECT_EQ(result.exit_code, 3) << result.err.substr(0, 500);
}

}  // namespace
