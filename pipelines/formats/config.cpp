#include "pipelines/formats/config.hpp"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <iterator>

namespace shakebed::pipelines {

bool Range::contains(double value) const {
  return (above_low ? value > low : value >= low) && (below_high ? value < high : value <= high);
}

std::string Range::words() const {
  const bool has_low = std::isfinite(low), has_high = std::isfinite(high);
  if (has_low && has_high) {
    return fmt::format("{} {} {} {}", above_low ? "above" : "from", number_text(low), below_high ? "and below" : "to",
                       number_text(high));
  }
  if (has_low) return above_low ? "above " + number_text(low) : number_text(low) + " or more";
  if (has_high) return below_high ? "below " + number_text(high) : number_text(high) + " or less";
  return "";
}

Fields Fields::decode(const JsonNode& object, std::string pointer, const Source& source) {
  return Fields(Mode::decode, &object, nullptr, std::move(pointer), source);
}
Fields Fields::schema(Json& out) {
  out["type"] = "object";
  return Fields(Mode::schema, nullptr, &out, "", {});
}
Fields Fields::encode(Json& out) { return Fields(Mode::encode, nullptr, &out, "", {}); }

Fields Fields::below(const JsonNode* node, Json* out, const std::string& token) const {
  Fields fields(mode_, node, out, pointer_ + "/" + token, source_);
  fields.reduced_ = reduced_;
  return fields;
}

void Fields::finish() {
  if (mode_ == Mode::schema) {
    (*out_)["properties"]["$comment"]["type"] = "string";
    (*out_)["additionalProperties"] = false;
    return;
  }
  if (mode_ != Mode::decode || !unknown_keys_matter_) return;
  for (const JsonMember& member : node_->members) {
    if (member.key == "$comment" || std::find(known_.begin(), known_.end(), member.key) != known_.end()) continue;
    const std::string nearest = nearest_name(member.key, known_);
    std::string suggestion, meant;
    if (const auto elsewhere = keys_elsewhere_.find(member.key); elsewhere != keys_elsewhere_.end()) {
      suggestion = "It belongs to " + elsewhere->second + ".";
    } else if (!nearest.empty()) {
      suggestion = fmt::format("Did you mean \"{}\"?", nearest);
      meant = pointer_join(pointer_, nearest);
    } else {
      for (const std::string& name : known_) suggestion += (suggestion.empty() ? "Choose from: " : ", ") + name;
    }
    source_.problems->push_back({member.value.from_command_line ? "--set" : source_.file,
                                 member.value.from_command_line ? Position{} : member.at,
                                 pointer_join(pointer_, member.key), fmt::format("unknown key \"{}\"", member.key),
                                 suggestion, false, std::move(meant)});
  }
}

void Fields::note_keys_of(std::string_view tag, std::string_view name, const std::function<void(Fields&)>& describe) {
  Json inner = Json::object();
  Fields fields = schema(inner);
  describe(fields);
  for (const auto& property : inner["properties"].items()) {
    std::string& places = keys_elsewhere_[property.key()];
    places += fmt::format("{}\"{}\": \"{}\"", places.empty() ? "" : " or ", tag, name);
  }
}

bool Fields::has(std::string_view key) const { return node_ != nullptr && node_->find(key) != nullptr; }

bool Fields::has_upstream(std::string_view kind) const {
  return std::find(source_.upstream.begin(), source_.upstream.end(), kind) != source_.upstream.end();
}

const StatedResult* Fields::check_result(std::string_view pointer_below, const std::string& pointer) {
  if (mode_ != Mode::decode) return nullptr;
  if (const auto misfit = misfit_of_pointer(source_.from, pointer, "\"from\"")) {
    problem(pointer_below, misfit->what, misfit->suggestion);
    return nullptr;
  }
  return find_result(source_.from, pointer);
}

void Fields::either(std::string_view one, std::string_view other, const std::string& suggestion) {
  if (mode_ == Mode::schema) {
    const auto needs = [](std::string_view key) { return Json{{"required", Json::array({key})}}; };
    (*out_)["oneOf"] = Json::array({needs(one), needs(other)});
  }
  if (mode_ != Mode::decode || has(one) != has(other)) return;
  const bool both = has(one);
  problem("/" + std::string(both ? other : one),
          both ? fmt::format("both \"{}\" and \"{}\" are given, but each follows from the other", one, other)
               : fmt::format("neither \"{}\" nor \"{}\" is given: one of them is needed", one, other),
          suggestion);
}

void Fields::comment(const std::string& text) {
  if (mode_ == Mode::encode) (*out_)["$comment"] = text;
}

const JsonNode* Fields::take(std::string_view key, const About& about, std::string_view expected) {
  known_.emplace_back(key);
  const JsonNode* node = node_->find(key);
  if (node == nullptr && about.required) {
    source_.problems->push_back({source_.file, node_->at, pointer_join(pointer_, key),
                                 fmt::format("\"{}\" is missing: {} is needed", key, expected),
                                 about.example.empty()
                                     ? std::string(about.help)
                                     : fmt::format("Add \"{}\": {} ({})", key, about.example, about.help)});
  }
  if (node != nullptr && node->kind == JsonNode::Kind::null && !about.required) return nullptr;  // null: the default
  return node;
}

void Fields::complain(const JsonNode& node, std::string_view key, const std::string& what,
                      const std::string& suggestion, bool is_input) {
  source_.problems->push_back({node.from_command_line ? "--set" : source_.file,
                               node.from_command_line ? Position{} : node.at,
                               key.empty() ? pointer_ : pointer_ + "/" + std::string(key), what, suggestion, is_input});
}

void Fields::wrong_type(const JsonNode& node, std::string_view key, std::string_view expected, const About& about) {
  complain(node, key, fmt::format("expected {}, got {}", expected, node.described()),
           about.example.empty() ? "" : fmt::format("Write for example {}", about.example));
}

bool Fields::in_range(const JsonNode& node, std::string_view key, double value, const About& about,
                      const Dimension& dimension) {
  if (about.range.contains(value)) return true;
  const std::string unit = reduced_ ? "" : si_unit(dimension);
  complain(node, key,
           fmt::format("must be {}{}{}, got {}", about.range.words(), unit.empty() ? "" : " ", unit,
                       node.is_string() ? "\"" + node.text + "\"" : node.text),
           about.help.empty() ? "" : fmt::format("Meaning of \"{}\": {}", key, about.help));
  return false;
}

bool Fields::read_number(const JsonNode& node, std::string_view key, const About& about, double& value) {
  if (!node.is_number()) return wrong_type(node, key, "a number", about), false;
  if (!in_range(node, key, node.number, about, dimension::none)) return false;
  value = node.number;
  return true;
}

bool Fields::read_quantity(const JsonNode& node, std::string_view key, const Dimension& wanted, const About& about,
                           double& value) {
  const std::string expected = reduced_ ? "a plain number (this stage has \"units\": \"reduced\")"
                                        : fmt::format("{}, a string with a unit such as \"{}\" or a number in {}",
                                                      name_of(wanted), example_of(wanted), si_unit(wanted));
  double read = 0;
  if (node.is_number()) {
    read = node.number;
  } else if (node.is_string()) {
    try {
      const Quantity quantity = parse_quantity(node.text, &wanted);
      if (reduced_ && quantity.has_unit && quantity.dimension != dimension::none) {
        complain(node, key, fmt::format("expected {}, got {}", expected, node.described()),
                 "In reduced units lengths are in D, masses in m, and g or the starting T is 1");
        return false;
      }
      if (!reduced_ && !quantity.has_unit) {
        complain(node, key, fmt::format("\"{}\" has no unit: expected {}", node.text, expected),
                 fmt::format("Write \"{}\"", likely_quantity(node.text, quantity.value, wanted)));
        return false;
      }
      if (!reduced_ && quantity.dimension != wanted) {
        complain(node, key, fmt::format("\"{}\" is {}: expected {}", node.text, name_of(quantity.dimension), expected));
        return false;
      }
      read = quantity.value;
    } catch (const std::invalid_argument& problem) {
      complain(node, key, fmt::format("{}: expected {}", problem.what(), expected));
      return false;
    }
  } else {
    return wrong_type(node, key, expected, about), false;
  }
  if (!in_range(node, key, read, about, wanted)) return false;
  value = read;
  return true;
}

bool Fields::read_integer(const JsonNode& node, std::string_view key, const About& about, std::int64_t low,
                          std::uint64_t high, std::int64_t& value, std::uint64_t& large) {
  if (!node.is_number()) return wrong_type(node, key, "a whole number", about), false;
  const char* begin = node.text.data();
  const char* end = begin + node.text.size();
  bool whole = false;
  if (std::from_chars(begin, end, value).ptr == end && std::from_chars(begin, end, value).ec == std::errc()) {
    whole = true;
    large = static_cast<std::uint64_t>(value);
  } else if (std::from_chars(begin, end, large).ptr == end && std::from_chars(begin, end, large).ec == std::errc()) {
    whole = true;
    value = std::numeric_limits<std::int64_t>::max();
  } else if (std::abs(node.number) <= 9007199254740992.0 && node.number == std::floor(node.number)) {  // 1e3, 20.0
    whole = true;
    value = static_cast<std::int64_t>(node.number);
    large = static_cast<std::uint64_t>(value);
  }
  if (!whole) return wrong_type(node, key, "a whole number", about), false;
  if (!in_range(node, key, node.number, about, dimension::none)) return false;
  const bool too_low = node.number < 0 && value < low;
  const bool too_high = node.number > 0 && large > high;
  if (too_low || too_high) {
    complain(node, key,
             fmt::format("must lie from {} to {}, got {}",
                         about.range.low > static_cast<double>(low) ? fmt::format("{:g}", about.range.low)
                                                                    : fmt::to_string(low),
                         high, node.text));
    return false;
  }
  return true;
}

std::optional<std::size_t> Fields::read_choice(const JsonNode& node, std::string_view key,
                                               const std::vector<std::string_view>& names) {
  std::string list;
  for (const std::string_view name : names) list += fmt::format("{}\"{}\"", list.empty() ? "" : ", ", name);
  if (!node.is_string()) {
    complain(node, key, fmt::format("expected one of {}, got {}", list, node.described()));
    return std::nullopt;
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == node.text) return i;
  }
  const std::string nearest = nearest_name(node.text, {names.begin(), names.end()});
  complain(node, key, fmt::format("expected one of {}, got \"{}\"", list, node.text),
           nearest.empty() ? "" : fmt::format("Did you mean \"{}\"?", nearest));
  return std::nullopt;
}

Json& Fields::property(std::string_view key, const About& about, Json schema) {
  if (!about.help.empty()) schema["description"] = about.help;
  if (!about.example.empty()) {
    const Json example = Json::parse(about.example, nullptr, false);
    if (!example.is_discarded()) schema["examples"] = Json::array({example});
  }
  if (about.required) (*out_)["required"].push_back(key);
  return (*out_)["properties"][std::string(key)] = std::move(schema);
}

Json Fields::number_schema(const About& about, const char* type) const {
  Json schema;
  schema["type"] = type;
  const Range& range = about.range;
  if (std::isfinite(range.low)) schema[range.above_low ? "exclusiveMinimum" : "minimum"] = range.low;
  if (std::isfinite(range.high)) schema[range.below_high ? "exclusiveMaximum" : "maximum"] = range.high;
  return schema;
}

Json Fields::quantity_schema(const Dimension& wanted, const About& about) const {
  if (reduced_) return number_schema(about, "number");
  Json with_unit;
  with_unit["type"] = "string";
  with_unit["pattern"] = "^\\s*[+-]?[0-9.]+([eE][+-]?[0-9]+)?\\s*\\S+";
  Json schema;
  schema["anyOf"] = Json::array({std::move(with_unit), number_schema(about, "number")});
  schema["examples"] = Json::array({example_of(wanted)});
  return schema;
}

Json Fields::encoded_quantity(double value, const Dimension& wanted) const {
  if (reduced_ || wanted == dimension::none) return value;
  return quantity_text(value, wanted);
}

void Fields::number(std::string_view key, double& value, const About& about) {
  std::optional<double> held = value;
  number(key, held, about);
  if (held) value = *held;
}
void Fields::number(std::string_view key, std::optional<double>& value, const About& about) {
  if (mode_ == Mode::schema) {
    Json& out = property(key, about, number_schema(about, "number"));
    if (value && !about.required) out["default"] = *value;
  } else if (mode_ == Mode::encode) {
    if (value) (*out_)[std::string(key)] = *value;
  } else if (const JsonNode* node = take(key, about, "a number")) {
    double read = 0;
    if (read_number(*node, key, about, read)) value = read;
  }
}

void Fields::boolean(std::string_view key, bool& value, const About& about) {
  if (mode_ == Mode::schema) {
    Json& out = property(key, about, Json{{"type", "boolean"}});
    if (!about.required) out["default"] = value;
  } else if (mode_ == Mode::encode) {
    (*out_)[std::string(key)] = value;
  } else if (const JsonNode* node = take(key, about, "true or false")) {
    if (node->kind != JsonNode::Kind::boolean) return wrong_type(*node, key, "true or false", about);
    value = node->boolean;
  }
}

void Fields::text(std::string_view key, std::string& value, const About& about) {
  std::optional<std::string> held = value;
  text(key, held, about);
  if (held) value = *held;
}
void Fields::text(std::string_view key, std::optional<std::string>& value, const About& about) {
  if (mode_ == Mode::schema) {
    Json& out = property(key, about, Json{{"type", "string"}});
    if (value && !about.required) out["default"] = *value;
  } else if (mode_ == Mode::encode) {
    if (value) (*out_)[std::string(key)] = *value;
  } else if (const JsonNode* node = take(key, about, "a string")) {
    if (!node->is_string()) return wrong_type(*node, key, "a string", about);
    value = node->text;
  }
}

void Fields::quantity(std::string_view key, double& value, const Dimension& wanted, const About& about) {
  std::optional<double> held = value;
  quantity(key, held, wanted, about);
  if (held) value = *held;
}
void Fields::quantity(std::string_view key, std::optional<double>& value, const Dimension& wanted, const About& about) {
  if (mode_ == Mode::schema) {
    Json& out = property(key, about, quantity_schema(wanted, about));
    if (value && !about.required) out["default"] = encoded_quantity(*value, wanted);
  } else if (mode_ == Mode::encode) {
    if (value) (*out_)[std::string(key)] = encoded_quantity(*value, wanted);
  } else if (const JsonNode* node = take(key, about, name_of(wanted))) {
    double read = 0;
    if (read_quantity(*node, key, wanted, about, read)) value = read;
  }
}

void Fields::numbers(std::string_view key, std::vector<double>& values, const About& about) {
  if (mode_ == Mode::schema) {
    Json list;
    list["type"] = "array";
    list["items"] = number_schema(about, "number");
    property(key, about, std::move(list))["default"] = values;
  } else if (mode_ == Mode::encode) {
    (*out_)[std::string(key)] = values;
  } else if (const JsonNode* node = take(key, about, "an array of numbers")) {
    if (!node->is_array()) return wrong_type(*node, key, "an array of numbers", about);
    values.clear();
    for (std::size_t i = 0; i < node->items.size(); ++i) {
      double read = 0;
      if (read_number(node->items[i], fmt::format("{}/{}", key, i), about, read)) values.push_back(read);
    }
  }
}

void Fields::quantities(std::string_view key, std::vector<double>& values, const Dimension& wanted,
                        const About& about) {
  if (mode_ == Mode::schema) {
    Json list;
    list["type"] = "array";
    list["items"] = quantity_schema(wanted, about);
    property(key, about, std::move(list));
  } else if (mode_ == Mode::encode) {
    Json list = Json::array();
    for (const double value : values) list.push_back(encoded_quantity(value, wanted));
    (*out_)[std::string(key)] = std::move(list);
  } else if (const JsonNode* node = take(key, about, "an array of quantities")) {
    if (!node->is_array()) return wrong_type(*node, key, "an array of quantities", about);
    values.clear();
    for (std::size_t i = 0; i < node->items.size(); ++i) {
      double read = 0;
      if (read_quantity(node->items[i], fmt::format("{}/{}", key, i), wanted, about, read)) values.push_back(read);
    }
  }
}

void Fields::texts(std::string_view key, std::vector<std::string>& values, const About& about) {
  if (mode_ == Mode::schema) {
    Json list;
    list["type"] = "array";
    list["items"]["type"] = "string";
    Json either;
    either["anyOf"] = Json::array({Json{{"type", "string"}}, std::move(list)});
    property(key, about, std::move(either));
  } else if (mode_ == Mode::encode) {
    (*out_)[std::string(key)] = values;
  } else if (const JsonNode* node = take(key, about, "a string or an array of strings")) {
    values.clear();
    if (node->is_string()) {
      values.push_back(node->text);
      return;
    }
    if (!node->is_array()) return wrong_type(*node, key, "a string or an array of strings", about);
    for (std::size_t i = 0; i < node->items.size(); ++i) {
      if (node->items[i].is_string())
        values.push_back(node->items[i].text);
      else
        wrong_type(node->items[i], fmt::format("{}/{}", key, i), "a string", {});
    }
  }
}

namespace {
bool has_wildcards(const std::filesystem::path& path) { return path.string().find_first_of("*?") != std::string::npos; }

// All that a path with wildcards, also in names of folders, fits.
std::vector<std::filesystem::path> matching(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::vector<fs::path> found{path.root_path()};
  for (const fs::path& part : path.relative_path()) {
    std::vector<fs::path> next;
    for (const fs::path& before : found) {
      if (!has_wildcards(part)) {
        next.push_back(before / part);
        continue;
      }
      std::error_code error;
      for (const fs::directory_entry& entry : fs::directory_iterator(before.empty() ? "." : before, error))
        if (fnmatch(part.c_str(), entry.path().filename().c_str(), FNM_PERIOD) == 0)
          next.push_back(before / entry.path().filename());
    }
    found = std::move(next);
  }
  return found;
}

// The file of this name, the files in the folder of this name, or those that fit a name with wildcards; in the order of
// the numbers in their names: frame2 before frame10.
std::vector<std::string> files_named(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::is_regular_file(path, error)) return {path.string()};
  const bool folder = fs::is_directory(path, error);
  if (!folder && !has_wildcards(path)) return {};
  std::vector<std::string> found;
  for (const fs::path& file : matching(folder ? path / "*" : path))
    if (fs::is_regular_file(file, error)) found.push_back(file.string());
  std::sort(found.begin(), found.end(),
            [](const std::string& a, const std::string& b) { return strverscmp(a.c_str(), b.c_str()) < 0; });
  return found;
}
}  // namespace

void Fields::input_files(std::string_view key, InputFiles& files, const About& about) {
  namespace fs = std::filesystem;
  if (mode_ == Mode::schema) {
    Json list;
    list["type"] = "array";
    list["items"]["type"] = "string";
    Json either;
    either["anyOf"] = Json::array({Json{{"type", "string"}}, std::move(list)});
    property(key, about, std::move(either));
    return;
  }
  if (mode_ == Mode::encode) {
    if (files.texts.size() == 1) (*out_)[std::string(key)] = files.texts.front();
    if (files.texts.size() > 1) (*out_)[std::string(key)] = files.texts;
    return;
  }
  const JsonNode* node = take(key, about, "a file");
  if (node == nullptr) return;
  files.texts.clear();
  files.paths.clear();
  const auto expand = [&](const JsonNode& item, const std::string& where) {
    if (!item.is_string() || item.text.empty()) return wrong_type(item, where, "the path of a file", about);
    files.texts.push_back(item.text);
    const fs::path path = source_.directory / item.text;  // an absolute path replaces the directory
    std::vector<std::string> found = files_named(path);
    if (found.empty()) {
      std::error_code error;
      complain(item, where,
               fs::is_directory(path, error) ? fmt::format("the folder \"{}\" contains no file", item.text)
               : has_wildcards(path)         ? fmt::format("no file matches \"{}\"", item.text)
                                             : fmt::format("there is no file \"{}\"", item.text),
               fs::is_directory(path, error)       ? "Put the files into it, or name another folder"
               : fs::path(item.text).is_absolute() ? ""
                                                   : "Paths are relative to the recipe's folder",
               true);
    }
    files.paths.insert(files.paths.end(), std::make_move_iterator(found.begin()), std::make_move_iterator(found.end()));
  };
  if (node->is_array()) {
    for (std::size_t i = 0; i < node->items.size(); ++i) expand(node->items[i], fmt::format("{}/{}", key, i));
  } else {
    expand(*node, std::string(key));
  }
  if (source_.input_files != nullptr) {
    source_.input_files->reserve(source_.input_files->size() + files.paths.size());
    for (const std::string& found : files.paths) source_.input_files->emplace_back(pointer_join(pointer_, key), found);
  }
}

void Fields::any(std::string_view key, Json& value, const About& about) {
  if (mode_ == Mode::schema) {
    property(key, about, Json::object());
  } else if (mode_ == Mode::encode) {
    if (!value.is_null()) (*out_)[std::string(key)] = value;
  } else if (const JsonNode* node = take(key, about, "a value")) {
    value = node->to_json();
  }
}

void Fields::require(bool holds, std::string_view key, const std::string& what, const std::string& suggestion) {
  if (holds || mode_ != Mode::decode) return;
  problem(key.empty() ? std::string() : "/" + std::string(key), what, suggestion);
}

void Fields::problem(std::string_view pointer_below, const std::string& what, const std::string& suggestion) {
  if (mode_ != Mode::decode) return;
  source_.problems->push_back(located(pointer_below, what, suggestion));
  source_.problems->back().is_rule = true;
}

void Fields::warn(std::string_view kind, std::string_view pointer_below, const std::string& what,
                  const std::string& suggestion) {
  if (mode_ == Mode::decode && source_.warnings != nullptr)
    source_.warnings->push_back({std::string(kind), located(pointer_below, what, suggestion)});
}

Problem Fields::located(std::string_view pointer_below, const std::string& what, const std::string& suggestion) const {
  // The place of the nearest thing that was written.
  const JsonNode* node = node_;
  for (const std::string& token : split_pointer(pointer_below)) {
    const JsonNode* next = node->is_object() ? node->find(token) : nullptr;
    if (node->is_array()) {
      std::size_t index = 0;
      const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), index);
      (void)end;
      if (error == std::errc() && index < node->items.size()) next = &node->items[index];
    }
    if (next == nullptr) break;
    node = next;
  }
  return {node->from_command_line ? "--set" : source_.file, node->from_command_line ? Position{} : node->at,
          pointer_ + std::string(pointer_below), what, suggestion};
}

std::optional<std::size_t> Fields::read_tag(const std::string& tag, const std::vector<RowText>& rows,
                                            std::size_t current, const About& about) {
  std::string list;
  std::vector<std::string_view> names;
  for (const RowText& row : rows) {
    names.push_back(row.name);
    list += fmt::format("{}\"{}\"", list.empty() ? "one of " : ", ", row.name);
  }
  const JsonNode* node = take(tag, about, list);
  if (node == nullptr) {
    if (about.required) return std::nullopt;
    return current;
  }
  return read_choice(*node, tag, names);
}

// An option that means one thing in one alternative and another in the next.
static Json either_of(const Json& one, const Json& other) {
  Json schema{{"anyOf", Json::array({one, other})}};
  const std::string first = one.value("description", std::string()), second = other.value("description", std::string());
  if (!first.empty() && !second.empty() && first != second) schema["description"] = first + "; or " + second;
  return schema;
}

void Fields::schema_of_variant(Json& out, std::string_view tag, const std::vector<RowText>& rows,
                               const std::vector<Json>& bodies, std::size_t current, bool) {
  Json names = Json::array();
  std::string help;
  for (const RowText& row : rows) {
    names.push_back(row.name);
    if (!row.help.empty()) help += fmt::format("{}{}: {}", help.empty() ? "" : "; ", row.name, row.help);
  }
  Json& property = out["properties"][std::string(tag)];
  property["enum"] = std::move(names);
  property["default"] = rows[current].name;
  if (!help.empty()) property["description"] = help;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (bodies[i].contains("properties")) {
      for (const auto& [key, schema] : bodies[i]["properties"].items()) {
        Json& known = out["properties"][key];
        if (known.is_null() || known == schema)
          known = schema;
        else
          known = either_of(known, schema);
      }
    }
    if (bodies[i].contains("required") || bodies[i].contains("oneOf")) {
      Json condition;
      condition["if"]["properties"][std::string(tag)]["const"] = rows[i].name;
      condition["if"]["required"] = Json::array({tag});
      for (const char* key : {"required", "oneOf"})
        if (bodies[i].contains(key)) condition["then"][key] = bodies[i][key];
      out["allOf"].push_back(std::move(condition));
    }
  }
}

}  // namespace shakebed::pipelines
