#include "pipelines/formats/json.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

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

double stated_error(const Json& quantity) {
  const auto error = quantity.find("std_error");
  return error != quantity.end() && error->is_number() ? error->get<double>() : 0;
}

Json quantity_json(double value, std::string_view unit, std::optional<double> std_error) {
  Json out;
  out["value"] = value;
  if (std_error) out["std_error"] = *std_error;
  out["unit"] = unit;
  return out;
}

}  // namespace shakebed::pipelines
