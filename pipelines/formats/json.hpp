// Reading and writing JSON. Reading gives a tree that holds the place of each value in the file, so that a mistake can
// be shown there. Writing is ordered, with enough digits to restore the same double. The same values give the same
// bytes.
#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pipelines/formats/errors.hpp"

namespace shakebed::pipelines {

using Json = nlohmann::ordered_json;

struct JsonMember;

// A value and where it stood.
struct JsonNode {
  enum class Kind { null, boolean, number, string, array, object };
  Kind kind = Kind::null;
  Position at;
  bool from_command_line = false;  // put here by --set or by a sweep
  bool boolean = false;
  double number = 0;
  std::string text;  // of a string; of a number its literal
  std::vector<JsonNode> items;
  std::vector<JsonMember> members;

  bool is_object() const { return kind == Kind::object; }
  bool is_array() const { return kind == Kind::array; }
  bool is_string() const { return kind == Kind::string; }
  bool is_number() const { return kind == Kind::number; }
  const JsonNode* find(std::string_view key) const;
  JsonNode* find(std::string_view key);
  Json to_json() const;
  // "an object", "the string \"x\"", "the number 3": for messages.
  std::string described() const;
};
struct JsonMember {
  std::string key;
  Position at;
  JsonNode value;
};

inline constexpr int deepest_nesting = 64;

// Parses one JSON document (RFC 8259, UTF-8). Everything wrong is added to `problems`; nothing is returned when the
// text is no JSON at all. Duplicate keys, NaN, Infinity, numbers beyond a double, nesting beyond `deepest_nesting` and
// invalid UTF-8 are problems.
std::optional<JsonNode> parse_json(std::string_view text, const std::string& file, std::vector<Problem>& problems);

// Reads a result file, written by shakebed or by the user. Throws InputError.
Json read_json(const std::filesystem::path& path);

// A document that the program wrote or ships, without places. Throws Json::parse_error. Elsewhere Json::parse would be
// compiled once more in every unit.
Json parse_own_json(std::string_view text);

JsonNode to_node(const Json& json);

// JSON pointers (RFC 6901).
std::string escape_pointer_token(std::string_view token);
std::string pointer_join(std::string_view pointer, std::string_view token);
std::string pointer_join(std::string_view pointer, std::size_t index);
// Throws UsageError when it is not a pointer.
std::vector<std::string> split_pointer(std::string_view pointer);
// The value at a pointer, nullptr if none.
const JsonNode* find_pointer(const JsonNode& root, std::string_view pointer);
const Json* find_pointer(const Json& root, std::string_view pointer);
// Puts a value there, making objects on the way; an array index must exist or be one past the end. Within "stages" an
// element may be named by its id instead of its index ("/stages/bed/floor/amplitude"). Mistakes in the value are then
// shown as those of the command line, or where it stands in the file. Throws UsageError.
enum class ValueFrom { command_line, file };
void set_pointer(JsonNode& root, std::string_view pointer, JsonNode value, ValueFrom from = ValueFrom::command_line);

// Text of a document: two-space indent, short arrays and objects on one line, a final newline. Doubles: the fewest
// digits that give the same double back (at most 17). NaN and infinities become null.
std::string dump(const Json& json);
// The same with all doubles in 17 significant digits.
std::string dump_17_digits(const Json& json);
// One line, no spaces: for hashes.
std::string dump_canonical(const Json& json);
// A double alone.
std::string number_text(double value);

// {"value": v, "std_error": s, "unit": u}; std_error left out when absent.
Json quantity_json(double value, std::string_view unit, std::optional<double> std_error = std::nullopt);

// Standard error of a quantity, in its unit; 0 where none is stated or none could be had (null).
double stated_error(const Json& quantity);

}  // namespace shakebed::pipelines
