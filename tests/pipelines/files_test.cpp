// Files as bytes: read, hashed and compressed in pieces, written whole or not at all; JSON as it is written into them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/json.hpp"
#include "tests/pipelines/program.hpp"

namespace shakebed::tests::files {
namespace {

using namespace pipelines;

// What an action throws, with the scratch folder as HERE.
template <class Act>
std::string refusal(const ScratchFolder& folder, const Act& act) {
  try {
    act();
  } catch (const std::exception& error) {
    std::string what = error.what();
    const std::string here = folder.path().string();
    if (const std::size_t at = what.find(here); at != std::string::npos) what.replace(at, here.size(), "HERE");
    return what;
  }
  return "none";
}

// Pieces of 4 MB: just one, one and a byte, two and a bit.
TEST(FilesInPieces, HaveTheHashOfTheirBytes) {
  const ScratchFolder folder;
  for (const std::size_t size : {0U, 4U << 20U, (4U << 20U) + 1U, 9U << 20U}) {
    std::string bytes(size, 'a');
    for (std::size_t i = 0; i < size; i += 1000) bytes[i] = static_cast<char>('a' + i % 23);
    write_file(folder / "f", bytes);
    EXPECT_EQ(fast_hash_of_file(folder / "f"), fast_hash(bytes)) << size;
    EXPECT_EQ(read_file(folder / "f").size(), size);
  }
  const std::string bytes((4U << 20U) + 1U, 'b');
  write_file(folder / "f", bytes);
  EXPECT_EQ(sha256_of_file(folder / "f"), sha256(bytes));
  EXPECT_EQ(fast_hash("").size(), 32U);
  EXPECT_NE(fast_hash("a"), fast_hash("b"));
  EXPECT_EQ(fast_hash(""), "99aa06d3014798d86001c324468d497f")
      << "of XXH3 with 128 bits [its reference implementation]";
}

TEST(FilesThatCannotBeRead, SayWhy) {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder / "d");
  EXPECT_EQ(refusal(folder, [&] { read_file(folder / "none"); }),
            "HERE/none: cannot be read: No such file or directory");
  EXPECT_EQ(refusal(folder, [&] { read_file(folder / "d"); }), "HERE/d: is not a regular file");
  EXPECT_EQ(refusal(folder, [&] { read_json(folder / "d"); }), "HERE/d: this is a directory; give a file");
  EXPECT_EQ(refusal(folder, [&] { read_json(folder / "none"); }),
            "HERE/none: cannot be read: No such file or directory");
}

// A file is named as it was asked for, and nothing is left beside it.
TEST(FilesThatCannotBeWritten, AreNamedAndLeaveNothing) {
  const ScratchFolder folder;
  std::filesystem::create_directories(folder / "d/e");
  write_text(folder / "d/e/f", "x");
  EXPECT_EQ(refusal(folder, [&] { write_file(folder / "no/f", "x"); }),
            "HERE/no/f: cannot be written: No such file or directory");
  EXPECT_EQ(refusal(folder, [&] { write_file_atomically(folder / "no/f", "x"); }),
            "HERE/no/f: cannot be written: No such file or directory");
  EXPECT_EQ(refusal(folder, [&] { write_file_atomically(folder / "d/e", "x"); }),
            "HERE/d/e: cannot be written: Is a directory");
  std::size_t entries = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "d")) entries += !entry.path().empty();
  EXPECT_EQ(entries, 1U);
  write_file_atomically(folder / "g", "one"), write_file_atomically(folder / "g", "two");
  EXPECT_EQ(read_file(folder / "g"), "two");
}

TEST(CompressedBytes, SayThatTheyAreDamaged) {
  const ScratchFolder folder;
  const std::string bytes(300'000, 'z'), packed = compress(bytes, 3);
  EXPECT_EQ(decompress(packed, "p"), bytes);
  EXPECT_EQ(decompress(compress("", 3), "p"), "");
  EXPECT_EQ(refusal(folder, [&] { decompress(packed.substr(0, packed.size() - 1), "p"); }),
            "p: the compressed data are truncated");
  EXPECT_EQ(refusal(folder, [&] { decompress("", "p"); }), "p: the compressed data are truncated");
  EXPECT_THAT(refusal(folder, [&] { decompress("nothing", "p"); }),
              testing::StartsWith("p: this is not a file compressed with zstd: "));
}

// --- JSON

// As much on a line as has 118 characters with its indent.
TEST(JsonText, IsBrokenWhereALineIsFull) {
  const auto list = [](std::size_t letters) { return Json{{"a", {std::string(letters, 'x'), "y"}}}; };
  const auto of = [](std::size_t letters) { return std::string(letters, 'x'); };
  EXPECT_EQ(dump(list(101)), "{\"a\": [\"" + of(101) + "\", \"y\"]}\n");
  EXPECT_EQ(dump(list(102)), "{\"a\": [\"" + of(102) + "\", \"y\"]}\n") << "118 characters";
  EXPECT_EQ(dump(list(103)), "{\n  \"a\": [\"" + of(103) + "\", \"y\"]\n}\n");
  EXPECT_EQ(dump(list(107)), "{\n  \"a\": [\"" + of(107) + "\", \"y\"]\n}\n") << "with an indent of 2, without the key";
  EXPECT_EQ(dump(list(108)), "{\n  \"a\": [\n    \"" + of(108) + "\",\n    \"y\"\n  ]\n}\n");
  EXPECT_EQ(dump(Json::object()), "{}\n");
  EXPECT_EQ(dump(Json{{"b", 1}, {"a", {1.5, true, nullptr, "q\"\\\n"}}}),
            "{\"b\": 1, \"a\": [1.5, true, null, \"q\\\"\\\\\\n\"]}\n");
  EXPECT_EQ(dump_canonical(Json{{"b", 1}, {"a", {1.5, "x y"}}}), "{\"b\":1,\"a\":[1.5,\"x y\"]}");
  EXPECT_EQ(dump_17_digits(Json{{"a", 0.1}, {"b", 1}}), "{\"a\": 0.10000000000000001, \"b\": 1}\n");
  EXPECT_EQ(dump(Json(std::string("a\xff") + "b\u00e9")), "\"a\ufffdb\u00e9\"\n") << "a file name need not be UTF-8";
  EXPECT_EQ(number_text(-0.0), "0");
  EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "null");
  EXPECT_EQ(number_text(1e22), "1e+22");
}

TEST(JsonNodes, AreDescribedAndConverted) {
  const auto described = [](const Json& json) { return to_node(json).described(); };
  EXPECT_EQ(described(nullptr), "null");
  EXPECT_EQ(described(true), "true");
  EXPECT_EQ(described(false), "false");
  EXPECT_EQ(described(std::string(60, 'a')), "the string \"" + std::string(60, 'a') + "\"");
  EXPECT_EQ(described(std::string(61, 'a')), "the string \"" + std::string(57, 'a') + "...\"");
  EXPECT_EQ(described(2.50), "the number 2.5");
  EXPECT_EQ(described(Json::array()), "an empty array");
  EXPECT_EQ(described({1}), "an array");
  EXPECT_EQ(described(Json::object()), "an object");
  const Json all = Json::parse(R"({ "a": [1, -2.5, true, null, "x"], "b": { "c": 18446744073709551615 }, "d": 1e3 })");
  const Json back = to_node(all).to_json();
  EXPECT_EQ(back["a"], all["a"]);
  EXPECT_TRUE(back["a"][0].is_number_integer());
  EXPECT_EQ(back["d"], 1000);
  EXPECT_EQ(back["b"]["c"].get<double>(), 18446744073709551616.0) << "no number of 64 bits with a sign";
}

TEST(JsonPointers, SetWhatTheyLeadTo) {
  const ScratchFolder folder;
  const auto set = [&](const std::string& document, const std::string& pointer) {
    JsonNode root = to_node(Json::parse(document));
    std::string said = refusal(folder, [&] { set_pointer(root, pointer, to_node(Json(7))); });
    return said == "none" ? dump_canonical(root.to_json()) : said;
  };
  EXPECT_EQ(set("{}", "/a/b"), R"({"a":{"b":7}})");
  EXPECT_EQ(set(R"({"a":[1,2]})", "/a/1"), R"({"a":[1,7]})");
  EXPECT_EQ(set(R"({"a":[1,2]})", "/a/2"), R"({"a":[1,2,7]})");
  EXPECT_EQ(set(R"({"a":[1,2]})", "/a/-"), R"({"a":[1,2,7]})");
  EXPECT_EQ(set(R"({"a":[1,2]})", "/a/3"), "/a/3: there is no element \"3\" in /a (it has 2)");
  EXPECT_EQ(set(R"({"a":[1,2]})", "/a/x"), "/a/x: there is no element \"x\" in /a (it has 2)");
  EXPECT_EQ(set("[1]", "/2"), "/2: there is no element \"2\" in the document (it has 1)");
  EXPECT_EQ(set(R"({"a":"none"})", "/a/kind"), R"({"a":{"kind":7}})") << "a word stands for an object";
  EXPECT_EQ(set(R"({"stages":[{"stage":"fit","id":"x"},{"stage":"fit"}]})", "/stages/fit/a"),
            R"({"stages":[{"stage":"fit","id":"x"},{"stage":"fit","a":7}]})");
  EXPECT_EQ(set("{}", "a"), "\"a\" is not a JSON pointer: it must begin with '/', as in /stages/0/seed");
  EXPECT_EQ(set("{}", "/a~2"), "\"/a~2\" is not a JSON pointer: '~' must be ~0 or ~1");
  EXPECT_EQ(set("{}", "/a~1b~0c"), R"({"a/b~c":7})");
  const Json json = Json::parse(R"({"a":[{"b":5}],"c":3})");
  EXPECT_EQ(*find_pointer(json, "/a/0/b"), 5);
  for (const char* none : {"/a/1", "/a/x", "/a/0/c", "/c/d", "/d"})
    EXPECT_EQ(find_pointer(json, none), nullptr) << none;
}

}  // namespace
}  // namespace shakebed::tests::files
