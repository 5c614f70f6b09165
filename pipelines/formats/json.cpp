#include "pipelines/formats/json.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <unordered_map>

namespace shakebed::pipelines {

const JsonNode* JsonNode::find(std::string_view key) const {
  for (const JsonMember& member : members) {
    if (member.key == key) return &member.value;
  }
  return nullptr;
}
JsonNode* JsonNode::find(std::string_view key) { return const_cast<JsonNode*>(std::as_const(*this).find(key)); }

Json JsonNode::to_json() const {
  switch (kind) {
    case Kind::null:
      return nullptr;
    case Kind::boolean:
      return boolean;
    case Kind::string:
      return text;
    case Kind::number: {
      if (text.find_first_of(".eE") == std::string::npos) {
        std::int64_t integer = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), integer);
        if (error == std::errc() && end == text.data() + text.size()) return integer;
      }
      return number;
    }
    case Kind::array: {
      Json out = Json::array();
      for (const JsonNode& item : items) out.push_back(item.to_json());
      return out;
    }
    case Kind::object: {
      Json out = Json::object();
      for (const JsonMember& member : members) out[member.key] = member.value.to_json();
      return out;
    }
  }
  return nullptr;
}

std::string JsonNode::described() const {
  switch (kind) {
    case Kind::null:
      return "null";
    case Kind::boolean:
      return boolean ? "true" : "false";
    case Kind::string:
      return fmt::format("the string \"{}\"", text.size() <= 60 ? text : text.substr(0, 57) + "...");
    case Kind::number:
      return "the number " + text;
    case Kind::array:
      return items.empty() ? "an empty array" : "an array";
    case Kind::object:
      return "an object";
  }
  return "";
}

namespace {

// A recursive-descent parser. On a syntax error it stops; on a mistake that leaves the text readable it goes on.
class Parser {
 public:
  Parser(std::string_view text, const std::string& file, std::vector<Problem>& problems)
      : text_(text), file_(file), problems_(problems) {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") position_ = line_start_ = 3;
  }

  std::optional<JsonNode> document() {
    JsonNode root;
    skip_space();
    if (at_end()) {
      problem("the document is empty", "A recipe is a JSON object with \"name\" and \"stages\"");
      return std::nullopt;
    }
    if (!value(root, 0)) return std::nullopt;
    skip_space();
    if (!at_end()) {
      problem(fmt::format("more text after the end of the document: {}", here()), "One file holds one JSON value");
      return std::nullopt;
    }
    return root;
  }

 private:
  bool at_end() const { return position_ >= text_.size(); }
  char peek() const { return at_end() ? '\0' : text_[position_]; }
  Position now() const { return {line_, static_cast<int>(position_ - line_start_) + 1}; }

  std::string here() const {
    if (at_end()) return "the end of the file";
    const unsigned char c = static_cast<unsigned char>(peek());
    if (c < 0x20 || c >= 0x7f) return fmt::format("byte 0x{:02x}", c);
    return fmt::format("'{}'", peek());
  }

  bool problem(std::string what, std::string suggestion = {}) {
    return problem_at(now(), std::move(what), std::move(suggestion));
  }
  bool problem_at(Position at, std::string what, std::string suggestion) {
    problems_.push_back({file_, at, pointer_, std::move(what), std::move(suggestion)});
    return false;
  }

  void skip_space() {
    while (!at_end()) {
      const char c = text_[position_];
      if (c == '\n') {
        ++position_;
        ++line_;
        line_start_ = position_;
      } else if (c == ' ' || c == '\t' || c == '\r') {
        ++position_;
      } else {
        break;
      }
    }
  }

  bool value(JsonNode& node, int depth) {
    if (depth > deepest_nesting) {
      return problem(fmt::format("nested deeper than {} levels", deepest_nesting),
                     "No recipe needs that; look for a bracket that is never closed");
    }
    node.at = now();
    switch (peek()) {
      case '{':
        return object(node, depth);
      case '[':
        return array(node, depth);
      case '"':
        node.kind = JsonNode::Kind::string;
        return string(node.text);
      case '\'':
        return problem("a string in single quotes", "JSON strings stand in double quotes");
      case '/':
      case '#':
        return problem("a comment", "JSON has none; write \"$comment\": \"...\" inside an object instead");
      default:
        break;
    }
    if (peek() == '-' || (peek() >= '0' && peek() <= '9')) return number(node);
    return word(node);
  }

  bool word(JsonNode& node) {
    std::size_t end = position_;
    while (end < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[end])) || text_[end] == '_')) ++end;
    const std::string_view found = text_.substr(position_, end - position_);
    if (found == "true" || found == "false") {
      node.kind = JsonNode::Kind::boolean;
      node.boolean = found == "true";
    } else if (found == "null") {
      node.kind = JsonNode::Kind::null;
    } else if (found == "NaN" || found == "nan" || found == "Infinity" || found == "inf" || found == "Inf") {
      problem(fmt::format("{} is not a number", found),
              "Every number must be finite; leave the key out for its default");
    } else if (found.empty()) {
      return problem(fmt::format("expected a value, found {}", here()),
                     peek() == ']' || peek() == '}' ? "Remove the comma before it" : "");
    } else {
      return problem(fmt::format("'{}' is not a JSON value", found), "Put strings in double quotes");
    }
    position_ = end;
    return true;
  }

  bool number(JsonNode& node) {
    const std::size_t begin = position_;
    const Position at = now();
    if (peek() == '-') ++position_;
    if (text_.substr(position_, 8) == "Infinity" || text_.substr(position_, 3) == "NaN") {
      problem_at(at, "-" + std::string(peek() == 'I' ? "Infinity" : "NaN") + " is not a number",
                 "Every number must be finite; leave the key out for its default");
      position_ += peek() == 'I' ? 8 : 3;
      return true;
    }
    const auto digits = [&] {
      const std::size_t first = position_;
      while (std::isdigit(static_cast<unsigned char>(peek()))) ++position_;
      return position_ > first;
    };
    const std::size_t first_digit = position_;
    if (!digits()) return problem(fmt::format("expected a digit, found {}", here()));
    if (text_[first_digit] == '0' && position_ - first_digit > 1) {
      return problem_at(at, "a number with a leading zero", "Write it without");
    }
    if (peek() == '.') {
      ++position_;
      if (!digits()) return problem("a number that ends with its decimal point", "Write 1.0 or 1");
    }
    if (peek() == 'e' || peek() == 'E') {
      ++position_;
      if (peek() == '+' || peek() == '-') ++position_;
      if (!digits()) return problem("a number whose exponent has no digits");
    }
    node.kind = JsonNode::Kind::number;
    node.text = std::string(text_.substr(begin, position_ - begin));
    const auto result = std::from_chars(node.text.data(), node.text.data() + node.text.size(), node.number);
    if (result.ec == std::errc::result_out_of_range) {
      // from_chars says the same for too large and too small; too small is 0 for every purpose here.
      node.number = std::strtod(node.text.c_str(), nullptr);
      if (std::isinf(node.number)) {
        problem_at(at, fmt::format("{} is beyond the largest double (1.8e308)", node.text), "Check its exponent");
        node.number = 0;
      }
    }
    return true;
  }

  bool hex4(unsigned& code) {
    code = 0;
    for (int i = 0; i < 4; ++i, ++position_) {
      const char c = peek();
      const int digit = c >= '0' && c <= '9'   ? c - '0'
                        : c >= 'a' && c <= 'f' ? c - 'a' + 10
                        : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                               : -1;
      if (digit < 0) return problem("\\u needs four hexadecimal digits");
      code = code * 16 + static_cast<unsigned>(digit);
    }
    return true;
  }

  static void append_utf8(std::string& out, unsigned code) {
    const auto push = [&](unsigned byte) { out.push_back(static_cast<char>(byte)); };
    if (code < 0x80) {
      push(code);
    } else if (code < 0x800) {
      push(0xC0 | code >> 6), push(0x80 | (code & 0x3F));
    } else if (code < 0x10000) {
      push(0xE0 | code >> 12), push(0x80 | (code >> 6 & 0x3F)), push(0x80 | (code & 0x3F));
    } else {
      push(0xF0 | code >> 18), push(0x80 | (code >> 12 & 0x3F)), push(0x80 | (code >> 6 & 0x3F)),
          push(0x80 | (code & 0x3F));
    }
  }

  // One multi-byte character, checked (no overlong forms, no surrogates).
  bool utf8(std::string& out) {
    const auto byte = [&](std::size_t i) -> unsigned {
      return position_ + i < text_.size() ? static_cast<unsigned char>(text_[position_ + i]) : 0u;
    };
    const unsigned lead = byte(0);
    const std::size_t length = lead >= 0xF0 && lead <= 0xF4  ? 4
                               : lead >= 0xE0 && lead < 0xF0 ? 3
                               : lead >= 0xC2 && lead < 0xE0 ? 2
                                                             : 0;
    bool good = length > 0;
    for (std::size_t i = 1; i < length; ++i) good = good && (byte(i) & 0xC0) == 0x80;
    if (good && length == 3) good = !(lead == 0xE0 && byte(1) < 0xA0) && !(lead == 0xED && byte(1) >= 0xA0);
    if (good && length == 4) good = !(lead == 0xF0 && byte(1) < 0x90) && !(lead == 0xF4 && byte(1) >= 0x90);
    if (!good) return problem(fmt::format("byte 0x{:02x} is not UTF-8", lead), "Save the file as UTF-8");
    out.append(text_.substr(position_, length));
    position_ += length;
    return true;
  }

  bool string(std::string& out) {
    const Position at = now();
    ++position_;
    out.clear();
    while (true) {
      if (at_end()) return problem_at(at, "a string that is never closed", "");
      const char c = peek();
      if (c == '"') break;
      if (static_cast<unsigned char>(c) >= 0x80) {
        if (!utf8(out)) return false;
        continue;
      }
      if (static_cast<unsigned char>(c) < 0x20) {
        return problem(c == '\n' ? "a line break inside a string" : "a control character inside a string",
                       c == '\n' ? "Close the string or write \\n" : "Write it as \\u00..");
      }
      if (c != '\\') {
        out.push_back(c);
        ++position_;
        continue;
      }
      ++position_;
      const char escaped = peek();
      ++position_;
      switch (escaped) {
        case '"':
          out += '"';
          break;
        case '\\':
          out += '\\';
          break;
        case '/':
          out += '/';
          break;
        case 'b':
          out += '\b';
          break;
        case 'f':
          out += '\f';
          break;
        case 'n':
          out += '\n';
          break;
        case 'r':
          out += '\r';
          break;
        case 't':
          out += '\t';
          break;
        case 'u': {
          unsigned code = 0;
          if (!hex4(code)) return false;
          if (code >= 0xD800 && code < 0xDC00 && text_.substr(position_, 2) == "\\u") {
            position_ += 2;
            unsigned low = 0;
            if (!hex4(low)) return false;
            if (low < 0xDC00 || low > 0xDFFF) return problem("half of a surrogate pair");
            code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
          } else if (code >= 0xD800 && code < 0xE000) {
            return problem("half of a surrogate pair");
          }
          append_utf8(out, code);
          break;
        }
        default:
          --position_;
          return problem(fmt::format("\\ before {} means nothing", here()), "Write \\\\ for a backslash");
      }
    }
    ++position_;
    return true;
  }

  bool array(JsonNode& node, int depth) {
    node.kind = JsonNode::Kind::array;
    ++position_;
    skip_space();
    if (peek() == ']') return ++position_, true;
    const std::size_t length = pointer_.size();
    while (true) {
      pointer_ += '/' + std::to_string(node.items.size());
      node.items.emplace_back();
      if (!value(node.items.back(), depth + 1)) return false;
      pointer_.resize(length);
      skip_space();
      if (peek() == ']') return ++position_, true;
      if (peek() != ',') return problem(fmt::format("expected ',' or ']' in the array, found {}", here()));
      ++position_;
      skip_space();
    }
  }

  bool object(JsonNode& node, int depth) {
    node.kind = JsonNode::Kind::object;
    ++position_;
    skip_space();
    if (peek() == '}') return ++position_, true;
    std::unordered_map<std::string, Position> seen;
    const std::size_t length = pointer_.size();
    while (true) {
      const Position at = now();
      if (peek() != '"') {
        return problem(fmt::format("expected a key in double quotes, found {}", here()),
                       peek() == '}' ? "Remove the comma before it" : "");
      }
      std::string key;
      if (!string(key)) return false;
      pointer_ += '/' + escape_pointer_token(key);
      const auto [earlier, fresh] = seen.emplace(key, at);
      if (!fresh) {
        problem_at(at, fmt::format("the key \"{}\" stands here twice, first in line {}", key, earlier->second.line),
                   "Remove one of the two");
      }
      skip_space();
      if (peek() != ':') return problem(fmt::format("expected ':' after the key \"{}\", found {}", key, here()));
      ++position_;
      skip_space();
      JsonNode member;
      if (!value(member, depth + 1)) return false;
      pointer_.resize(length);
      if (fresh) node.members.push_back({std::move(key), at, std::move(member)});
      skip_space();
      if (peek() == '}') return ++position_, true;
      if (peek() != ',') return problem(fmt::format("expected ',' or '}}' in the object, found {}", here()));
      ++position_;
      skip_space();
    }
  }

  std::string_view text_;
  const std::string& file_;
  std::vector<Problem>& problems_;
  std::string pointer_;
  std::size_t position_ = 0, line_start_ = 0;
  int line_ = 1;
};

}  // namespace

std::optional<JsonNode> parse_json(std::string_view text, const std::string& file, std::vector<Problem>& problems) {
  return Parser(text, file, problems).document();
}

static std::string read_text(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error))
    throw InputError(path.string() + ": is a directory, a file is needed");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail_to_read(path.string());
  std::ostringstream text;
  text << stream.rdbuf();
  return text.str();
}

JsonNode read_json_node(const std::filesystem::path& path) {
  std::vector<Problem> problems;
  auto node = parse_json(read_text(path), path.string(), problems);
  if (!problems.empty()) throw ConfigError(std::move(problems));
  return std::move(*node);
}

Json read_json(const std::filesystem::path& path) {
  std::vector<Problem> problems;
  const auto node = parse_json(read_text(path), path.string(), problems);
  if (!problems.empty()) throw InputError(to_string(problems.front()));
  return node->to_json();
}

JsonNode to_node(const Json& json) {
  JsonNode node;
  using Kind = JsonNode::Kind;
  if (json.is_object()) {
    node.kind = Kind::object;
    for (const auto& [key, value] : json.items()) node.members.push_back({key, {}, to_node(value)});
  } else if (json.is_array()) {
    node.kind = Kind::array;
    for (const Json& item : json) node.items.push_back(to_node(item));
  } else if (json.is_string()) {
    node.kind = Kind::string;
    node.text = json.get<std::string>();
  } else if (json.is_boolean()) {
    node.kind = Kind::boolean;
    node.boolean = json.get<bool>();
  } else if (json.is_number()) {
    node.kind = Kind::number;
    node.number = json.get<double>();
    node.text = json.is_number_float() ? number_text(node.number) : json.dump();
  }
  return node;
}

std::string escape_pointer_token(std::string_view token) {
  std::string out;
  for (const char c : token) {
    if (c == '~')
      out += "~0";
    else if (c == '/')
      out += "~1";
    else
      out += c;
  }
  return out;
}
std::string pointer_join(std::string_view pointer, std::string_view token) {
  return std::string(pointer) + '/' + escape_pointer_token(token);
}
std::string pointer_join(std::string_view pointer, std::size_t index) {
  return std::string(pointer) + '/' + std::to_string(index);
}

std::vector<std::string> split_pointer(std::string_view pointer) {
  std::vector<std::string> tokens;
  if (pointer.empty()) return tokens;
  if (pointer.front() != '/') {
    throw UsageError(
        fmt::format("\"{}\" is not a JSON pointer: it must begin with '/', as in /stages/0/seed", pointer));
  }
  for (std::size_t i = 0; i < pointer.size(); ++i) {
    if (pointer[i] == '/') {
      tokens.emplace_back();
    } else if (pointer[i] == '~') {
      const char next = i + 1 < pointer.size() ? pointer[i + 1] : '\0';
      if (next != '0' && next != '1')
        throw UsageError(fmt::format("\"{}\" is not a JSON pointer: '~' must be ~0 or ~1", pointer));
      tokens.back() += next == '0' ? '~' : '/';
      ++i;
    } else {
      tokens.back() += pointer[i];
    }
  }
  return tokens;
}

static std::optional<std::size_t> as_index(const std::string& token) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), index);
  if (error != std::errc() || end != token.data() + token.size()) return std::nullopt;
  return index;
}

// A stage of "stages" by its id, or by its kind where no id is given.
static JsonNode* stage_named(JsonNode& stages, const std::string& name) {
  for (JsonNode& item : stages.items) {
    const JsonNode* id = item.find("id");
    if (id == nullptr) id = item.find("stage");
    if (id != nullptr && id->is_string() && id->text == name) return &item;
  }
  return nullptr;
}

const JsonNode* find_pointer(const JsonNode& root, std::string_view pointer) {
  const JsonNode* node = &root;
  std::string parent;
  for (const std::string& token : split_pointer(pointer)) {
    if (node->is_object()) {
      node = node->find(token);
    } else if (node->is_array()) {
      if (const auto index = as_index(token)) {
        node = *index < node->items.size() ? &node->items[*index] : nullptr;
      } else {
        node = parent == "stages" ? stage_named(const_cast<JsonNode&>(*node), token) : nullptr;
      }
    } else {
      node = nullptr;
    }
    if (node == nullptr) return nullptr;
    parent = token;
  }
  return node;
}

const Json* find_pointer(const Json& root, std::string_view pointer) {
  const Json* node = &root;
  for (const std::string& token : split_pointer(pointer)) {
    if (node->is_object()) {
      const auto found = node->find(token);
      if (found == node->end()) return nullptr;
      node = &*found;
    } else if (node->is_array()) {
      const auto index = as_index(token);
      if (!index || *index >= node->size()) return nullptr;
      node = &(*node)[*index];
    } else {
      return nullptr;
    }
  }
  return node;
}

void set_pointer(JsonNode& root, std::string_view pointer, JsonNode value, ValueFrom from) {
  const bool from_command_line = from == ValueFrom::command_line;
  const Position at = from_command_line ? Position{} : value.at;
  JsonNode* node = &root;
  std::string walked, parent;
  for (const std::string& token : split_pointer(pointer)) {
    if (node->is_array()) {
      const auto index = as_index(token);
      JsonNode* named = !index && parent == "stages" ? stage_named(*node, token) : nullptr;
      if (named != nullptr) {
        node = named;
      } else if (index && *index < node->items.size()) {
        node = &node->items[*index];
      } else if ((index && *index == node->items.size()) || token == "-") {
        node->items.emplace_back();
        node = &node->items.back();
      } else {
        throw UsageError(fmt::format("{}: there is no element \"{}\" in {} (it has {})", pointer, token,
                                     walked.empty() ? "the document" : walked, node->items.size()));
      }
    } else {
      if (node->kind == JsonNode::Kind::null || (!node->is_object() && !walked.empty())) {
        // A shorthand ("bath": "none") or nothing yet becomes an object that can hold the key.
        JsonNode fresh;
        fresh.kind = JsonNode::Kind::object;
        fresh.at = at;
        fresh.from_command_line = from_command_line;
        *node = fresh;
      }
      JsonNode* found = node->find(token);
      if (found == nullptr) {
        node->members.push_back({token, at, {}});
        found = &node->members.back().value;
        found->at = at;
        found->from_command_line = from_command_line;
      }
      node = found;
    }
    walked = pointer_join(walked, token);
    parent = token;
  }
  value.at = at;
  value.from_command_line = from_command_line;
  *node = std::move(value);
}

std::string number_text(double value) {
  if (!std::isfinite(value)) return "null";
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value == 0 ? 0.0 : value);
  return {buffer, result.ptr};
}

namespace {
void write_string(std::string& out, const std::string& text) {
  const bool plain =
      std::all_of(text.begin(), text.end(), [](char c) { return c >= 32 && c < 127 && c != '"' && c != '\\'; });
  if (plain) {  // nearly all: ASCII with nothing to escape
    out += '"';
    out += text;
    out += '"';
    return;
  }
  // nlohmann's escaping; invalid UTF-8 (a file name, say) is replaced rather than thrown at.
  out += Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

using NumberText = std::string (*)(double);

void write_compact(std::string& out, const Json& json, bool spaces, NumberText number) {
  if (json.is_object()) {
    out += '{';
    bool first = true;
    for (const auto& [key, value] : json.items()) {
      if (!first) out += spaces ? ", " : ",";
      first = false;
      write_string(out, key);
      out += spaces ? ": " : ":";
      write_compact(out, value, spaces, number);
    }
    out += '}';
  } else if (json.is_array()) {
    out += '[';
    for (std::size_t i = 0; i < json.size(); ++i) {
      if (i > 0) out += spaces ? ", " : ",";
      write_compact(out, json[i], spaces, number);
    }
    out += ']';
  } else if (json.is_number_float()) {
    out += number(json.get<double>());
  } else if (json.is_string()) {
    write_string(out, json.get_ref<const std::string&>());
  } else {
    out += json.dump();
  }
}

void write_pretty(std::string& out, const Json& json, std::size_t indent, NumberText number) {
  constexpr std::size_t width = 118;
  if (!json.is_structured() || json.empty()) return write_compact(out, json, true, number);
  std::string line;
  write_compact(line, json, true, number);
  if (indent + line.size() <= width) {
    out += line;
    return;
  }
  const std::string inner(indent + 2, ' ');
  const bool object = json.is_object();
  out += object ? "{" : "[";
  bool first = true;
  for (auto item = json.begin(); item != json.end(); ++item) {
    out += first ? "\n" : ",\n";
    first = false;
    out += inner;
    if (object) {
      write_string(out, item.key());
      out += ": ";
    }
    write_pretty(out, *item, indent + 2, number);
  }
  out += '\n' + std::string(indent, ' ');
  out += object ? "}" : "]";
}
}  // namespace

std::string dump(const Json& json) {
  std::string out;
  write_pretty(out, json, 0, number_text);
  out += '\n';
  return out;
}

std::string dump_17_digits(const Json& json) {
  std::string out;
  write_pretty(out, json, 0,
               [](double value) { return std::isfinite(value) ? fmt::format("{:.17g}", value) : std::string("null"); });
  out += '\n';
  return out;
}

std::string dump_canonical(const Json& json) {
  std::string out;
  write_compact(out, json, false, number_text);
  return out;
}

Json quantity_json(double value, std::string_view unit, std::optional<double> std_error) {
  Json out;
  out["value"] = value;
  if (std_error) out["std_error"] = *std_error;
  out["unit"] = unit;
  return out;
}

}  // namespace shakebed::pipelines
