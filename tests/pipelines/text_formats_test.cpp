// Texts that are read and written: cells of tables, JSON with its mistakes, trajectories, quantities, pages; each
// against its text by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/formats/process.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/formats/table.hpp"
#include "pipelines/formats/trajectory.hpp"

namespace {

using namespace shakebed::pipelines;
using testing::HasSubstr;

TEST(TableCells, QuoteWhatWouldBreakALine) {
  EXPECT_EQ(Cell("two words").text(), "two words");
  EXPECT_EQ(Cell("a,b").text(), "\"a,b\"");
  EXPECT_EQ(Cell("say \"a\"").text(), "\"say \"\"a\"\"\"");
  EXPECT_EQ(Cell("a\nb").text(), "\"a\nb\"");
  EXPECT_EQ(Cell("# no comment").text(), "\"# no comment\"");
  EXPECT_EQ(Cell(std::numeric_limits<double>::quiet_NaN()).text(), "");
  EXPECT_EQ(Cell(0.25).text(), "0.25");
  EXPECT_EQ(Cell(std::int64_t{-3}).text(), "-3");
}

TEST(JsonWords, AreNamedWhole) {
  for (const std::string word : {"yes", "not_a_number", "a_"}) {
    std::vector<Problem> problems;
    parse_json("{\"a\": " + word + "}", "f.json", problems);
    ASSERT_EQ(problems.size(), 1U) << word;
    EXPECT_EQ(problems.front().what, "'" + word + "' is not a JSON value");
  }
}

struct Mistake {
  const char* text;
  int line, column;
  const char* pointer;
  const char* says;
};

// Each kind of mistake: where it stands, what is there, and what to do.
TEST(JsonMistakes, AreNamedWhereTheyStand) {
  const Mistake mistakes[] = {
      {"", 1, 1, "", "the document is empty; A recipe is a JSON object with \"name\" and \"stages\""},
      {"{\"a\": 1}\n x", 2, 2, "", "more text after the end of the document: 'x'; A file must contain one JSON value"},
      {"{\"a\": [1,\n  2 3]}", 2, 5, "/a", "expected ',' or ']' in the array, found '3'"},
      {"{\"a\": [1, 2,]}", 1, 13, "/a/2", "expected a value, found ']'; Remove the comma before it"},
      {"{\"a\": 1,}", 1, 9, "", "expected a key in double quotes, found '}'; Remove the comma before it"},
      {"{\"a\" 1}", 1, 6, "/a", "expected ':' after the key \"a\", found '1'"},
      {"{\"a\": 1 \"b\": 2}", 1, 9, "", "expected ',' or '}' in the object, found '\"'"},
      {"{1: 2}", 1, 2, "", "expected a key in double quotes, found '1'"},
      {"{\"a\": ", 1, 7, "/a", "expected a value, found the end of the file"},
      {"{\"a\": 1e999}", 1, 7, "/a", "1e999 is beyond the largest possible number (1.8e308); Check its exponent"},
      {"{\"a\": -1e999}", 1, 7, "/a", "-1e999 is beyond the largest possible number"},
      {"{\"a\": NaN}", 1, 7, "/a", "NaN is not a number; Every number must be finite"},
      {"{\"a\": Infinity}", 1, 7, "/a", "Infinity is not a number"},
      {"{\"a\": -Infinity}", 1, 7, "/a", "-Infinity is not a number"},
      {"{\"a\": -NaN}", 1, 7, "/a", "-NaN is not a number"},
      {"{\"a\": 1.}", 1, 7, "/a", "an incomplete number: expected digit after '.'"},
      {"{\"a\": -}", 1, 7, "/a", "an incomplete number: expected digit after '-'"},
      {"{\"a\": [0, 012]}", 1, 12, "/a", "a number with a leading zero; Write it without the leading zero"},
      {"{\"a\": 'x'}", 1, 7, "/a", "a string in single quotes; Write strings in double quotes"},
      {"{\"a\": /* x */ 1}", 1, 7, "/a",
       "a comment; JSON has no comments; write \"$comment\": \"...\" inside an object instead"},
      {"{\"a\": 1 # x\n}", 1, 9, "", "a comment"},
      {"{\"a\": yes}", 1, 7, "/a", "'yes' is not a JSON value; Put strings in double quotes"},
      {"{\"a\": \"x}", 1, 7, "/a", "a string that is never closed"},
      {"{\"a\": \"x\ny\"}", 1, 9, "/a", "a line break inside a string; Close the string or write \\n"},
      {"{\"a\": \"x\ty\"}", 1, 9, "/a", "a control character inside a string; Write it as \\u00.."},
      {"{\"a\": \"x\xff\"}", 1, 9, "/a", "byte 0xff is not UTF-8; Save the file as UTF-8"},
      {"{\"a\": \"\\ud800\"}", 1, 14, "/a", "half of a surrogate pair"},
      {"{\"a\": \"\\u12x\"}", 1, 12, "/a", "\\u needs four hexadecimal digits"},
      {"{\"a\": \"\\q\"}", 1, 9, "/a", "\\ before 'q' is not a valid escape sequence; Write \\\\ for a backslash"},
      {"{\"b\": 0,\n \"a\": 1,\n  \"a\": 2}", 3, 3, "/a",
       "the key \"a\" is given twice, first in line 2; Remove one of the two"},
      {"\xEF\xBB\xBF{\"a\": yes}", 1, 7, "/a", "'yes' is not a JSON value"},
      {"{\"x/y\": {\"b\": [{}, {\"c\": yes}]}}", 1, 26, "/x~1y/b/1/c", "'yes'"},
  };
  for (const Mistake& one : mistakes) {
    std::vector<Problem> problems;
    parse_json(one.text, "f.json", problems);
    ASSERT_EQ(problems.size(), 1U) << one.text;
    const Problem& problem = problems.front();
    EXPECT_EQ(problem.at.line, one.line) << one.text;
    EXPECT_EQ(problem.at.column, one.column) << one.text;
    EXPECT_EQ(problem.pointer, one.pointer) << one.text;
    EXPECT_THAT(problem.what + "; " + problem.suggestion, HasSubstr(one.says)) << one.text;
    EXPECT_EQ(problem.file, "f.json");
  }
}

TEST(JsonMistakes, NestingIsLimited) {
  const auto nested = [](std::size_t levels) {
    std::vector<Problem> problems;
    parse_json(std::string(levels, '[') + std::string(levels, ']'), "f", problems);
    return problems.size();
  };
  EXPECT_EQ(nested(64), 0U);
  EXPECT_EQ(nested(65), 1U);
  std::vector<Problem> problems;
  parse_json(std::string(65, '['), "f", problems);
  EXPECT_EQ(problems.at(0).what, "nested deeper than 64 levels");
  EXPECT_EQ(problems.at(0).suggestion, "Look for a bracket that is not closed; no recipe needs so many levels");
  EXPECT_EQ(problems.at(0).at.column, 65);
}

// Of a key that stands twice the first counts; numbers keep their literals, and what is too small is 0.
TEST(JsonMistakes, LeaveTheRestAsItIs) {
  std::vector<Problem> problems;
  const auto node = parse_json("{\"a\": 1, \"a\": [5, {\"z\": 0}], \"b\": [true, null, -0.5e-3, 1e-999], \"c\": false}",
                               "f", problems);
  ASSERT_TRUE(node);
  EXPECT_EQ(problems.size(), 1U);
  EXPECT_EQ(node->members.size(), 3U);
  EXPECT_EQ(node->find("a")->number, 1);
  const JsonNode& list = *node->find("b");
  ASSERT_EQ(list.items.size(), 4U);
  EXPECT_TRUE(list.items[0].boolean);
  EXPECT_EQ(list.items[1].kind, JsonNode::Kind::null);
  EXPECT_EQ(list.items[2].number, -0.5e-3);
  EXPECT_EQ(list.items[2].text, "-0.5e-3");
  EXPECT_EQ(list.items[3].number, 0);
  EXPECT_FALSE(node->find("c")->boolean);
  EXPECT_EQ(node->find("c")->at.column, 71);
  EXPECT_EQ(node->find("d"), nullptr);
}

// --- pages

TEST(Markup, TextIsEscaped) {
  EXPECT_EQ(escape_markup("a<b>&\"c\"'d'\x01\n\t"), "a&lt;b&gt;&amp;&quot;c&quot;&#39;d&#39; \n\t");
  EXPECT_EQ(markdown("a|b`c*d_e[f]g\\h#i<j&k\nl\rm"), "a\\|b\\`c\\*d\\_e\\[f\\]g\\\\h\\#i&lt;j&amp;k l m");
  EXPECT_EQ(script_text("</script><!--"), "\\u003c/script>\\u003c!--");
  EXPECT_EQ(capitalized("abc"), "Abc");
  EXPECT_EQ(capitalized(""), "");
  EXPECT_EQ(words("a_b_c"), "a b c");
}

TEST(Markup, SymbolsHaveTheirIndices) {
  EXPECT_EQ(prose("T_c and a_2"), "T<sub>c</sub> and a<sub>2</sub>");
  EXPECT_EQ(prose("\u03b6_F"), "\u03b6<sub>F</sub>");
  EXPECT_EQ(prose("above_launch, xT_c, 2_a"), "above_launch, xT_c, 2_a");
  EXPECT_EQ(prose("(T_c)"), "(T<sub>c</sub>)");
  EXPECT_EQ(prose("T_, xy_z"), "T_, xy_z");
  EXPECT_EQ(prose("T^2, D^-2, \u03b6^3, 10^12"), "T<sup>2</sup>, D<sup>-2</sup>, \u03b6<sup>3</sup>, 10<sup>12</sup>");
  EXPECT_EQ(prose("^2 (^3"), "^2 (^3");
}

TEST(Markup, QuantitiesAreShownWithTheirErrors) {
  EXPECT_EQ(shown(nullptr), "–");
  EXPECT_EQ(shown(true), "yes");
  EXPECT_EQ(shown(false), "no");
  EXPECT_EQ(shown("a<b"), "a&lt;b");
  EXPECT_EQ(shown(1.23456789), "1.2346");
  EXPECT_EQ(shown(quantity_json(0.00123456, "m", 0.0000234)), "1.235 ± 0.023 mm");
  EXPECT_EQ(shown(quantity_json(0.00015, "m/px")), "0.15 mm/px");
  EXPECT_EQ(shown(quantity_json(1234.5, "Hz", 12.3)), "1234 ± 12 Hz");
  EXPECT_EQ(shown(quantity_json(1234.5, "Hz", 123.0)), "1234 ± 123 Hz");
  EXPECT_EQ(shown(quantity_json(0.5, "1", 0.01)), "0.500 ± 0.010");
  EXPECT_EQ(shown(quantity_json(0, "s", 0.01)), "0 s");
  Json fixed = quantity_json(2, "s");
  fixed["fixed"] = true;
  EXPECT_EQ(shown(fixed), "2 s (fixed)");
  EXPECT_EQ(shown(Json::parse(R"({"a": "<"})")), "{&quot;a&quot;:&quot;&lt;&quot;}");
  EXPECT_EQ(size_text(999), "999 bytes");
  EXPECT_EQ(size_text(1000), "1 kB");
  EXPECT_EQ(size_text(999'999), "1000 kB");
  EXPECT_EQ(size_text(1'234'567), "1.2 MB");
}

// The examples of RFC 4648.
TEST(Markup, BytesAreWrittenInBase64) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xfb\xff\xfe"), "+//+");
}

TEST(Markup, TablesNameTheirColumns) {
  EXPECT_EQ(table_head({"a", "b"}), "<tr><th scope=\"col\">a</th><th scope=\"col\">b</th></tr>\n");
  EXPECT_EQ(table_row({"a"}, {{"1", "n"}, {"2"}}),
            "<tr><td data-label=\"a\" class=\"n\">1</td><td data-label=\"\">2</td></tr>\n");
}

TEST(Markup, FiguresHaveTheirOwnIdsAndFiles) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "shakebed_markup_test";
  std::filesystem::create_directories(folder);
  const auto svg = folder / "a&b.svg";
  std::ofstream(svg) << "<?xml?>\n<svg w='1'><path id='p'/><g id=\"q\"/><use href='#p'/><use xlink:href=\"#q\" "
                        "fill='url(#p)'/></svg>";
  const std::string drawing =
      "<svg class=\"plot\" w='1'><path id='f3-p'/><g id=\"f3-q\"/><use href='#f3-p'/><use xlink:href=\"#f3-q\" "
      "fill='url(#f3-p)'/></svg>";
  EXPECT_EQ(inline_svg(svg, 3), drawing);
  EXPECT_EQ(figure_html(svg, 3, "Caption"),
            "<figure class=\"plot\" data-name=\"a&amp;b\">\n<div class=\"drawn small\">" + drawing +
                "</div>\n<div class=\"tools always\"></div>\n<figcaption>Caption</figcaption>\n</figure>\n");
  std::ofstream(folder / "a&b.pdf") << "foobar";
  std::ofstream(folder / "a&b.plot.json") << "{\"a\": \"<\"}";
  const std::string whole = figure_html(svg, 3, "");
  EXPECT_THAT(whole, HasSubstr("<div class=\"drawn\">"));
  EXPECT_THAT(whole, HasSubstr("class=\"plot-data\">{\"a\": \"\\u003c\"}</script>"));
  EXPECT_THAT(whole, HasSubstr("<div class=\"tools\"><a download=\"a&amp;b.pdf\" "
                               "href=\"data:application/pdf;base64,Zm9vYmFy\">PDF</a></div>"));
  EXPECT_EQ(whole.find("figcaption"), std::string::npos);
  std::ofstream(svg) << "no picture";
  EXPECT_EQ(inline_svg(svg, 3), "");
  EXPECT_EQ(figure_html(svg, 3, "Caption"), "");
  std::filesystem::remove_all(folder);
}

// --- trajectories

std::filesystem::path scratch_file(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("shakebed_text_" + name);
}

TEST(TrajectoryText, IsExtendedXyz) {
  TrajectoryFrame frame;
  frame.time = 12.5, frame.phase = 0.25, frame.floor_position = -0.5, frame.floor_velocity = 2, frame.width = 30;
  frame.periodic = true;
  frame.x = {0.5, 3}, frame.z = {0.5, 7.25}, frame.vx = {0.1, -0.0}, frame.vz = {-0.2, 1};
  frame.radius = {0.5, 0.75}, frame.spin = {0, 1.5};
  const auto path = scratch_file("a.xyz");
  const auto text_of = [&] {
    TrajectoryWriter writer(path);
    writer.write(frame);
    writer.close();
    std::ifstream in(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_EQ(text_of(),
            "2\nLattice=\"30 0 0 0 1 0 0 0 8.25\" Origin=\"0 -0.5 0\" pbc=\"T F F\" "
            "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1:spin:R:1 Time=12.5 Phase=0.25 Floor=-0.5 "
            "FloorVelocity=2 Width=30 Units=reduced\n"
            "X 0.5 0 0.5 0.1 0 -0.2 0.5 0\nB 3 0 7.25 0 0 1 0.75 1.5\n");
  frame.spin.clear(), frame.radius.clear(), frame.periodic = false, frame.height = 40;
  const std::string plain = text_of();
  EXPECT_THAT(plain, HasSubstr("0 0 0 40\" Origin=\"0 -0.5 0\" pbc=\"F F F\" "));
  EXPECT_THAT(plain, HasSubstr("radius:R:1 Time"));
  EXPECT_THAT(plain, HasSubstr("\nX 3 0 7.25 0 0 1 0.5\n"));
  frame = {};
  EXPECT_THAT(text_of(), HasSubstr("Lattice=\"0 0 0 0 1 0 0 0 1\"")) << "no disks: as high as one";
  std::filesystem::remove(path);
}

TEST(TrajectoryText, IsReadWithItsColumnsAndMistakes) {
  const auto path = scratch_file("b.xyz");
  const auto read = [&](const std::string& text, UpAxis up = UpAxis::z) {
    std::ofstream(path) << text;
    TrajectoryReader reader(path, up);
    TrajectoryFrame frame;
    EXPECT_TRUE(reader.read(frame));
    return frame;
  };
  const std::string columns = "Properties=species:S:1:pos:R:3:mass:R:1:velo:R:3:radius:R:1:spin:R:1";
  const TrajectoryFrame frame =
      read("\n \n1\r\nLattice=\"20 0 0 0 1 0 0 0 9\" pbc=\"T F F\" " + columns +
           " MyTime=7 Time=1.5 Phase=0.75 Floor=-1 FloorVelocity=3\nX 1 2 3 what 4 5 6 0.75 9\n");
  EXPECT_EQ(frame.time, 1.5);
  EXPECT_EQ(frame.phase, 0.75);
  EXPECT_EQ(frame.floor_position, -1);
  EXPECT_EQ(frame.floor_velocity, 3);
  EXPECT_EQ(frame.width, 20);
  EXPECT_EQ(frame.height, 9);
  EXPECT_TRUE(frame.periodic);
  EXPECT_EQ(frame.x, std::vector<double>{1});
  EXPECT_EQ(frame.z, std::vector<double>{3});
  EXPECT_EQ(frame.vx, std::vector<double>{4});
  EXPECT_EQ(frame.vz, std::vector<double>{6});
  EXPECT_EQ(frame.radius, std::vector<double>{0.75});
  EXPECT_EQ(frame.spin, std::vector<double>{9});
  const TrajectoryFrame up = read("1\n" + columns + " Width=8\nX 1 2 3 0 4 5 6 0.75 9\n", UpAxis::y);
  EXPECT_EQ(up.z, std::vector<double>{2});
  EXPECT_EQ(up.vz, std::vector<double>{5});
  EXPECT_EQ(up.width, 8);
  EXPECT_FALSE(up.periodic);
  const TrajectoryFrame flat = read("1\nProperties=pos:R:2\n1 2", UpAxis::y);
  EXPECT_EQ(flat.z, std::vector<double>{2});
  EXPECT_EQ(flat.vx, std::vector<double>{0});
  EXPECT_EQ(flat.radius, std::vector<double>{0.5});
  EXPECT_TRUE(flat.spin.empty());
  const auto mistake = [&](const std::string& text) {
    try {
      read(text);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  const std::string at = path.string() + ":";
  EXPECT_EQ(mistake("two\n"), at + "1: expected the number of disks, found \"two\"");
  EXPECT_EQ(mistake("2x\n"), at + "1: expected the number of disks, found \"2x\"");
  EXPECT_THAT(mistake("1000000001\n\n"), HasSubstr("1000000001 disks in one frame"));
  EXPECT_EQ(mistake("1\n"), at + "1: the file ends before the comment line");
  EXPECT_EQ(mistake("1\nProperties=pos:R\n"), at + "2: Properties must be triples name:type:count");
  EXPECT_THAT(mistake("1\nProperties=pos:R:0\n"), HasSubstr("gives \"0\" columns for \"pos\""));
  EXPECT_THAT(mistake("1\nProperties=pos:R:3:a:R:101\n"), HasSubstr("gives \"101\" columns for \"a\""));
  EXPECT_EQ(mistake("1\nProperties=pos:R:1\n1"), at + "2: Properties must contain pos:R:2 or pos:R:3");
  EXPECT_EQ(mistake("1\nProperties=pos:R:4\n1"), at + "2: Properties must contain pos:R:2 or pos:R:3");
  EXPECT_EQ(mistake("1\nno columns\n1"), at + "2: Properties must contain pos:R:2 or pos:R:3");
  EXPECT_EQ(mistake("1\nProperties=pos:R:2 Time=x\n1 2"), at + "2: Time=x is not a number");
  EXPECT_EQ(mistake("1\nLattice=\"1 2 3\" Properties=pos:R:2\n1 2"), at + "2: Lattice must contain nine numbers");
  EXPECT_EQ(mistake("2\nProperties=pos:R:2\n1 2\n"), at + "3: the file ends after 1 of 2 disks");
  EXPECT_EQ(mistake("1\nProperties=pos:R:3\n1 2\n"), at + "3: this line has 2 columns, but Properties announces 3");
  EXPECT_EQ(mistake("1\nProperties=pos:R:2\n1 b\n"), at + "3: \"b\" is not a number");
  EXPECT_THAT(mistake(std::string(1100000, '1')), HasSubstr("a line of more than 1048576 bytes"));
  std::ofstream(path) << "1\nProperties=pos:R:2\n1 2\n1\nProperties=pos:R:2\n3 4\n";
  EXPECT_EQ(count_frames(path), 2U);
  std::filesystem::remove(path);
}

// --- quantities, beds, programs

// Quotes hold separators and doubled quotes, and a line ends where it ends, whatever follows in memory.
TEST(CsvText, UnderstandsQuotes) {
  using Cells = std::vector<std::string>;
  EXPECT_EQ(split_csv_line("a, b ,,c"), (Cells{"a", "b", "", "c"}));
  EXPECT_EQ(split_csv_line("\"a,b\",c"), (Cells{"a,b", "c"}));
  EXPECT_EQ(split_csv_line("\"say \"\"no\"\"\";x", ';'), (Cells{"say \"no\"", "x"}));
  EXPECT_EQ(split_csv_line(""), Cells{""});
  const std::string text = "x,\"a\"\"b\"";
  EXPECT_EQ(split_csv_line(std::string_view(text).substr(0, 5)), (Cells{"x", "a"}));
  std::vector<std::size_t> numbers;
  each_csv_line("h\r\n\r\n# c\n1,2\r\n3", [&](const Cells& cells, std::size_t line) {
    numbers.push_back(line);
    EXPECT_EQ(cells, line == 1 ? Cells{"h"} : line == 4 ? (Cells{"1", "2"}) : Cells{"3"});
  });
  EXPECT_EQ(numbers, (std::vector<std::size_t>{1, 4, 5}));
  EXPECT_EQ(number_in("-1.5e2"), -150);
  for (const char* wrong : {"", "1 ", "x", "1x", "nan", "inf", "+1"}) EXPECT_FALSE(number_in(wrong)) << wrong;
}

TEST(QuantityText, NamesItsDimension) {
  EXPECT_EQ(si_unit(dimension::none), "");
  EXPECT_EQ(si_unit(dimension::velocity), "m/s");
  EXPECT_EQ(si_unit(dimension::acceleration), "m/s^2");
  EXPECT_EQ(si_unit(dimension::density), "kg/m^3");
  EXPECT_EQ(si_unit({.length = 1, .mass = 1, .time = -2}), "N");
  EXPECT_EQ(si_unit({.length = -1, .mass = 1, .time = -2}), "Pa");
  EXPECT_EQ(si_unit({.length = 2, .mass = 1, .time = -1}), "kg*m^2/s");
  EXPECT_EQ(si_unit({.length = -2}), "1/m^2");
  EXPECT_EQ(si_unit({.length = -1, .mass = 0, .time = -1}), "1/m/s");
  EXPECT_EQ(name_of(dimension::none), "a plain number");
  EXPECT_EQ(name_of(dimension::area), "an area");
  EXPECT_EQ(name_of(dimension::power), "a power");
  EXPECT_EQ(name_of({.length = -2}), "a quantity in 1/m^2");
  for (const auto& [d, example] : {std::pair{dimension::length, "2.99 mm"},
                                   {dimension::time, "10 s"},
                                   {dimension::frequency, "20 Hz"},
                                   {dimension::velocity, "0.3 m/s"},
                                   {dimension::acceleration, "9.81 m/s^2"},
                                   {dimension::mass, "37.8 mg"},
                                   {dimension::density, "2700 kg/m^3"},
                                   {dimension::length_per_pixel, "0.15 mm/px"},
                                   {dimension::angle, "1.5 deg"},
                                   {dimension::pixels, "20 px"},
                                   {dimension::energy, "1 J"}}) {
    EXPECT_EQ(example_of(d), example);
    EXPECT_NO_THROW(parse_quantity(example, d));
  }
}

TEST(QuantityText, PowersSignsAndSpacesCount) {
  EXPECT_EQ(parse_quantity("+2 cm^2", dimension::area), 2e-4);
  EXPECT_EQ(parse_quantity("2 cm\u00b2", dimension::area), 2e-4);
  EXPECT_EQ(parse_quantity(" 3 g\u00b7cm\u00b2/s^2 ", dimension::energy), 3e-7);
  EXPECT_EQ(parse_quantity("3 kg m / s / s", {.length = 1, .mass = 1, .time = -2}), 3);
  EXPECT_EQ(parse_quantity("2 m^2/m", dimension::length), 2);
  EXPECT_EQ(parse_quantity("4 cm\u00b3/cm^2", dimension::length), 0.04);
  EXPECT_EQ(parse_quantity("30 1/min", dimension::frequency), 0.5);
  EXPECT_EQ(parse_quantity("50 %", dimension::none), 0.5);
  EXPECT_EQ(parse_quantity("1.5e+2 mm", dimension::length), 0.15);
  EXPECT_EQ(parse_quantity("5. mm", dimension::length), 0.005);
  EXPECT_NEAR(parse_quantity("90 deg", dimension::angle), std::numbers::pi / 2, 1e-15);
  EXPECT_EQ(parse_quantity("2 m^9/m^8", dimension::length), 2);
  const auto refused = [](const std::string& text) {
    try {
      parse_quantity(text, dimension::length);
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_EQ(refused("2 m^10/m^9"), "\"2 m^10/m^9\": ^ needs a whole number after it");
  EXPECT_EQ(refused("2 m^x"), "\"2 m^x\": ^ needs a whole number after it");
  EXPECT_EQ(refused("1e100001 m"), "\"1e100001 m\": its exponent is too large");
  EXPECT_EQ(refused("2 m/"), "\"2 m/\": a unit is missing");
  EXPECT_THAT(refused("2 qwertz"), testing::StartsWith("\"2 qwertz\": there is no unit \"qwertz\""));
  EXPECT_THROW(parse_quantity("2 mm", dimension::time), std::invalid_argument);
  EXPECT_EQ(likely_quantity(" 3 ", 3, dimension::length), "3 mm");
  EXPECT_EQ(likely_quantity("0.1", 0.1, dimension::length), "0.1 mm");
  EXPECT_EQ(likely_quantity("0.09", 0.09, dimension::length), "0.09 m");
  EXPECT_EQ(likely_quantity("0.001", 0.001, dimension::length_per_pixel), "0.001 mm/px");
  EXPECT_EQ(likely_quantity("0.0009", 0.0009, dimension::length_per_pixel), "0.0009 m/px");
  EXPECT_EQ(likely_quantity("1", 1, dimension::angle), "1 deg");
  EXPECT_EQ(likely_quantity("1", 1, dimension::time), "1 s");
}

TEST(QuantityText, ForPeopleIsOfAHandyUnit) {
  EXPECT_EQ(handy_text(0.999, dimension::length), "0.999 m");
  EXPECT_EQ(handy_text(0.998, dimension::length), "998 mm");
  EXPECT_EQ(handy_text(0.000998, dimension::length), "998 um");
  EXPECT_EQ(handy_text(0, dimension::length), "0 m");
  EXPECT_EQ(handy_text(-2e-9, dimension::length), "-0.002 um");
  EXPECT_EQ(handy_text(0.0999, dimension::time), "0.0999 s");
  EXPECT_EQ(handy_text(0.09, dimension::time), "90 ms");
  EXPECT_EQ(handy_text(5e-5, dimension::mass), "50 mg");
  EXPECT_EQ(handy_text(1.5e-4, dimension::length_per_pixel), "0.15 mm/px");
  EXPECT_EQ(handy_text(0.25, dimension::none), "0.25");
  EXPECT_EQ(handy_text(3, dimension::energy), "3 J");
}

TEST(NearestName, IsNearOrBeginsAlike) {
  const std::vector<std::string> names = {"frequency", "amplitude", "gravity", "tilt"};
  EXPECT_EQ(nearest_name("freq", names), "frequency");
  EXPECT_EQ(nearest_name("fr", names), "");
  EXPECT_EQ(nearest_name("tilted", names), "tilt");
  EXPECT_EQ(nearest_name("amplitdue", names), "amplitude");
  EXPECT_EQ(nearest_name("gravitas", names), "gravity");
  EXPECT_EQ(nearest_name("phase", names), "");
}

TEST(BedText, HasItsShakingStrengthAndNames) {
  BedDescription bed;
  bed.count = 100, bed.diameter = 2e-3, bed.width = 0.05, bed.gravity = 9.81;
  bed.frequency = 20, bed.amplitude = 2.5e-3;
  EXPECT_NEAR(bed.gamma(), 2.5e-3 * std::pow(40 * std::numbers::pi, 2) / 9.81, 1e-12);
  const Json json = bed.to_json();
  EXPECT_EQ(json["units"], "SI");
  EXPECT_EQ(json["amplitude"]["unit"], "m");
  EXPECT_EQ(json["frequency"]["unit"], "Hz");
  EXPECT_NEAR(json["gamma"].get<double>(), bed.gamma(), 1e-12);
  EXPECT_NEAR(json["column_number"].get<double>(), 100 * 2e-3 / 0.05, 1e-12);
  EXPECT_TRUE(json["restitution"].is_null());
  bed.reduced = true;
  EXPECT_EQ(bed.to_json()["amplitude"]["unit"], "D");
  EXPECT_EQ(bed.to_json()["frequency"]["unit"], "sqrt(g/D)");
  bed.gravity.reset();
  EXPECT_EQ(bed.gamma(), 0);
  const auto mistake = [&](const char* key, const Json& value) {
    Json changed = bed.to_json();
    changed[key] = value;
    try {
      BedDescription::from_json(changed, "bed.json");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(mistake("tilt", quantity_json(0.1, "rad")), "");
  EXPECT_EQ(mistake("count", nullptr), "bed.json: /count: a number is missing here");
  EXPECT_EQ(mistake("count", "many"), "bed.json: /count: expected a number");
  EXPECT_EQ(mistake("width", 0), "bed.json: diameter and width must be above 0");
  EXPECT_EQ(mistake("diameter", 0), "bed.json: diameter and width must be above 0");
  EXPECT_TRUE(same_fact(1, 1 + 0.9e-9));
  EXPECT_FALSE(same_fact(1, 1 + 1.1e-9));
  EXPECT_FALSE(same_fact(-1, 1));
  EXPECT_TRUE(same_fact(0, 0));
}

TEST(Program, EndsWithItsCodeOrItsSignal) {
  const ProcessResult both = run_process({"sh", "-c", "echo out; echo err >&2; pwd; exit 3"}, "/");
  EXPECT_EQ(both.exit_code, 3);
  EXPECT_EQ(both.output, "out\nerr\n/\n");
  EXPECT_GT(both.peak_bytes, 1e5);
  EXPECT_LT(both.peak_bytes, 1e9);
  EXPECT_EQ(run_process({"sh", "-c", "kill -9 $$"}, "/").exit_code, 137);
  EXPECT_EQ(run_process({"cat"}, "/").output, "") << "nothing to read";
  EXPECT_THROW(run_process({"shakebed_no_such_program"}, "/"), StageError);
}

}  // namespace
