// implements: pipelines/formats/json.hpp
// Reading: nlohmann's parser gives the events, the bytes it has consumed give their places.
#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <unordered_map>

#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";
constexpr std::string_view finite_advice = "Every number must be finite; leave the key out for its default";

// Over the bytes of a text; counts what the parser has consumed.
struct CountingIterator {
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;
  const char* at;
  std::size_t* consumed;
  reference operator*() const { return *at; }
  CountingIterator& operator++() { return ++at, ++*consumed, *this; }
  CountingIterator operator++(int) { return {at++, &++*consumed}; }
  bool operator==(const CountingIterator& other) const { return at == other.at; }
};

// Builds the tree from the parser's events. On a syntax error the parser stops; a key that stands twice does not stop
// it.
class TreeBuilder {
 public:
  TreeBuilder(std::string_view text, const std::string& file, std::vector<Problem>& problems)
      : text_(text), file_(file), problems_(problems) {
    if (text_.starts_with(byte_order_mark)) last_end_ = byte_order_mark.size();
  }

  std::optional<JsonNode> build() {
    const CountingIterator begin{text_.data(), &consumed_}, end{text_.data() + text_.size(), &consumed_};
    if (!Json::sax_parse(begin, end, this)) return std::nullopt;
    return std::move(root_);
  }

  // --- events; each returns whether to go on
  bool null() { return scalar(JsonNode::Kind::null, 4) != nullptr; }
  bool boolean(bool value) {
    JsonNode* node = scalar(JsonNode::Kind::boolean, value ? 4 : 5);
    node->boolean = value;
    return true;
  }
  bool number_integer(std::int64_t) { return number(); }
  bool number_unsigned(std::uint64_t) { return number(); }
  bool number_float(double, const std::string&) { return number(); }
  bool string(std::string& value) {
    scalar(JsonNode::Kind::string, consumed_ - token_start())->text = std::move(value);
    return true;
  }
  bool binary(Json::binary_t&) { return false; }  // JSON has none
  bool start_object(std::size_t) { return open(JsonNode::Kind::object); }
  bool start_array(std::size_t) { return open(JsonNode::Kind::array); }
  bool end_object() { return close(); }
  bool end_array() { return close(); }
  bool key(std::string& name) {
    Level& level = levels_.back();
    const std::size_t start = token_start();
    level.key = name;
    level.awaits_value = true;
    last_end_ = consumed_;
    level.key_at = place(start);
    const auto [earlier, fresh] = level.seen.emplace(name, level.key_at);
    level.repeated = !fresh;
    if (!fresh)
      problem(start, fmt::format("the key \"{}\" is given twice, first in line {}", name, earlier->second.line),
              "Remove one of the two");
    return true;
  }

  bool parse_error(std::size_t, const std::string&, const Json::exception& error) {
    const std::string said = error.what();
    const std::size_t start = token_start();
    const char first = start < text_.size() ? text_[start] : '\0';
    if (said.find("number overflow") != std::string::npos)
      return problem(start, fmt::format("{} is beyond the largest possible number (1.8e308)", literal(start)),
                     "Check its exponent");
    if (said.find("invalid string") != std::string::npos) return string_problem(start, said);
    if (first == '-' && (text_.substr(start + 1, 8) == "Infinity" || text_.substr(start + 1, 3) == "NaN"))
      return problem(start, fmt::format("{} is not a number", word(start)), finite_advice);
    if (const std::size_t what = said.find("invalid number; "); what != std::string::npos)
      return problem(start, "an incomplete number: " + clause(said, what + 16), "");
    if (number_end_ == start && start > 0 && std::isdigit(static_cast<unsigned char>(first)))
      return problem(start, "a number with a leading zero", "Write it without the leading zero");
    if (first == '\'') return problem(start, "a string in single quotes", "Write strings in double quotes");
    if (first == '/' || first == '#')
      return problem(start, "a comment", "JSON has no comments; write \"$comment\": \"...\" inside an object instead");
    if (std::isalpha(static_cast<unsigned char>(first)) && value_may_stand_here(start)) return word_problem(start);
    return structure_problem(start);
  }

 private:
  struct Level {
    JsonNode* node;
    std::string key{};  // of the member that is read
    Position key_at{};
    bool awaits_value = false;  // its key has been read
    bool repeated = false;      // its key stands there twice: the first one counts
    std::unordered_map<std::string, Position> seen{};
  };

  // --- places
  // The next token begins where the last one ended, behind spaces and separators.
  std::size_t token_start() const {
    const std::size_t start = text_.find_first_not_of(" \t\r\n,:", last_end_);
    return start == std::string_view::npos ? text_.size() : start;
  }
  std::string_view between(std::size_t start) const { return text_.substr(last_end_, start - last_end_); }
  // Offsets come in order: lines are counted on from the last one.
  Position place(std::size_t offset) {
    for (; counted_ < offset; ++counted_)
      if (text_[counted_] == '\n') ++line_, line_start_ = counted_ + 1;
    const std::size_t line_start = line_ == 1 && text_.starts_with(byte_order_mark) ? 3 : line_start_;
    return {line_, static_cast<int>(offset - line_start) + 1};
  }
  // Of what is read: of the innermost level its next value, if that has begun.
  std::string pointer() const {
    std::string out;
    for (const Level& level : levels_) {
      const bool innermost = &level == &levels_.back();
      if (innermost && !(level.awaits_value || (level.node->is_array() && value_may_stand_here(token_start())))) break;
      if (level.node->is_array())
        out += '/' + std::to_string(level.node->items.size() - (innermost ? 0 : 1));
      else
        out += '/' + escape_pointer_token(level.key);
    }
    return out;
  }
  bool problem(std::size_t offset, std::string what, std::string_view suggestion) {
    problems_.push_back({file_, place(offset), pointer(), std::move(what), std::string(suggestion)});
    return false;
  }

  // --- the tree
  JsonNode* add(JsonNode::Kind kind, std::size_t start, std::size_t length) {
    JsonNode node;
    node.kind = kind;
    node.at = place(start);
    last_end_ = start + length;
    if (levels_.empty()) return &root_.emplace(std::move(node));
    Level& level = levels_.back();
    if (level.node->is_array()) return &level.node->items.emplace_back(std::move(node));
    level.awaits_value = false;
    if (level.repeated) return dropped_.emplace_back(std::make_unique<JsonNode>(std::move(node))).get();
    level.node->members.push_back({level.key, level.key_at, std::move(node)});
    return &level.node->members.back().value;
  }
  JsonNode* scalar(JsonNode::Kind kind, std::size_t length) { return add(kind, token_start(), length); }
  bool number() {
    const std::size_t start = token_start();
    std::string_view text = literal(start);
    const std::size_t first = text.starts_with('-') ? 1 : 0;
    if (text.size() > first + 1 && text[first] == '0' && std::isdigit(static_cast<unsigned char>(text[first + 1])))
      text = text.substr(0, first + 1);  // 012: the parser ends the number behind its 0, and then complains
    JsonNode* node = add(JsonNode::Kind::number, start, text.size());
    node->text = text;
    number_end_ = last_end_;
    const auto read = std::from_chars(text.data(), text.data() + text.size(), node->number);
    // from_chars says the same for too large, which the parser refuses, and too small, which is 0 for every purpose.
    if (read.ec == std::errc::result_out_of_range) node->number = std::strtod(node->text.c_str(), nullptr);
    return true;
  }
  bool open(JsonNode::Kind kind) {
    const std::size_t start = token_start();
    if (levels_.size() >= deepest_nesting)
      return problem(start, fmt::format("nested deeper than {} levels", deepest_nesting),
                     "Look for a bracket that is not closed; no recipe needs so many levels");
    levels_.push_back({add(kind, start, 1)});
    return true;
  }
  bool close() {
    last_end_ = token_start() + 1;
    levels_.pop_back();
    return true;
  }

  // --- what is wrong, in words
  std::string_view literal(std::size_t start) const {
    return text_.substr(start, text_.find_first_not_of("+-.0123456789eE", start) - start);
  }
  std::string_view word(std::size_t start) const {
    std::size_t end = start + 1;
    while (end < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[end])) || text_[end] == '_')) ++end;
    return text_.substr(start, end - start);
  }
  // "expected digit after '.'" out of nlohmann's "...: syntax error ... - invalid number; expected ...; last read:
  // ...".
  static std::string clause(const std::string& said, std::size_t from) {
    return said.substr(from, said.find(';', from) - from);
  }
  std::string found(std::size_t start) const {
    if (start >= text_.size()) return "the end of the file";
    const auto c = static_cast<unsigned char>(text_[start]);
    return c < 0x20 || c >= 0x7f ? fmt::format("byte 0x{:02x}", c) : fmt::format("'{}'", text_[start]);
  }

  bool string_problem(std::size_t start, const std::string& said) {
    const std::size_t fault = consumed_ > 0 ? consumed_ - 1 : 0;  // the byte that was refused
    const auto says = [&](const char* words) { return said.find(words) != std::string::npos; };
    if (says("missing closing quote")) return problem(start, "a string that is never closed", "");
    if (says("(LF)")) return problem(fault, "a line break inside a string", "Close the string or write \\n");
    if (says("control character")) return problem(fault, "a control character inside a string", "Write it as \\u00..");
    if (says("ill-formed UTF-8"))
      return problem(fault, fmt::format("{} is not UTF-8", found(fault)), "Save the file as UTF-8");
    if (says("surrogate")) return problem(fault, "half of a surrogate pair", "");
    if (says("4 hex digits")) return problem(fault, "\\u needs four hexadecimal digits", "");
    return problem(fault, fmt::format("\\ before {} is not a valid escape sequence", found(fault)),
                   "Write \\\\ for a backslash");
  }
  bool word_problem(std::size_t start) {
    const std::string_view text = word(start);
    for (const char* name : {"NaN", "nan", "Infinity", "inf", "Inf"})
      if (text == name) return problem(start, fmt::format("{} is not a number", text), finite_advice);
    return problem(start, fmt::format("'{}' is not a JSON value", text), "Put strings in double quotes");
  }
  bool value_may_stand_here(std::size_t start) const {
    if (levels_.empty()) return !root_;
    const Level& level = levels_.back();
    if (level.node->is_object()) return level.awaits_value && between(start).find(':') != std::string_view::npos;
    return level.node->items.empty() || between(start).find(',') != std::string_view::npos;
  }
  bool structure_problem(std::size_t start) {
    const std::string what = found(start);
    const bool closes = what == "']'" || what == "'}'";
    const bool comma = between(start).find(',') != std::string_view::npos;
    const std::string_view advice = closes && comma ? "Remove the comma before it" : "";
    if (levels_.empty() && root_)
      return problem(start, "more text after the end of the document: " + what, "A file must contain one JSON value");
    if (levels_.empty() && start >= text_.size())
      return problem(start, "the document is empty", "A recipe is a JSON object with \"name\" and \"stages\"");
    if (value_may_stand_here(start)) return problem(start, "expected a value, found " + what, advice);
    const Level& level = levels_.back();
    if (level.node->is_array()) return problem(start, "expected ',' or ']' in the array, found " + what, "");
    if (level.awaits_value)
      return problem(start, fmt::format("expected ':' after the key \"{}\", found {}", level.key, what), "");
    if (level.node->members.empty() || comma)
      return problem(start, "expected a key in double quotes, found " + what, advice);
    return problem(start, "expected ',' or '}' in the object, found " + what, "");
  }

  std::string_view text_;
  const std::string& file_;
  std::vector<Problem>& problems_;
  std::optional<JsonNode> root_;
  std::vector<Level> levels_;
  std::vector<std::unique_ptr<JsonNode>> dropped_;  // values of keys that stand there twice
  std::size_t consumed_ = 0, last_end_ = 0, number_end_ = 0;
  std::size_t counted_ = 0, line_start_ = 0;
  int line_ = 1;
};

}  // namespace

Json parse_own_json(std::string_view text) { return Json::parse(text); }

std::optional<JsonNode> parse_json(std::string_view text, const std::string& file, std::vector<Problem>& problems) {
  return TreeBuilder(text, file, problems).build();
}

namespace {
// From a pipe as well as from a file.
std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw InputError(path.string() + ": this is a directory; give a file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail_to_read(path.string());
  std::string text;
  for (std::array<char, 1 << 16> part; stream.read(part.data(), part.size()) || stream.gcount() > 0;)
    text.append(part.data(), static_cast<std::size_t>(stream.gcount()));
  return text;
}
}  // namespace

Json read_json(const std::filesystem::path& path) {
  std::vector<Problem> problems;
  const auto node = parse_json(read_text(path), path.string(), problems);
  if (!problems.empty()) throw InputError(to_string(problems.front()));
  return node->to_json();
}

}  // namespace shakebed::pipelines
