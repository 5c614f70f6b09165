// From one declaration: reading, JSON Schema, defaults and resolved.json.
//
// An options struct holds its defaults in place; a function `describe(Fields&, Options&)` names its fields once:
//
//   struct RenderOptions {
//     double scale = 0.15e-3;            // [m/px]
//     int noise = 5;
//     std::variant<Uniform, Gradient> light = Uniform{};
//   };
//   void describe(Fields& fields, RenderOptions& options) {
//     fields.quantity("scale", options.scale, dimension::length_per_pixel, {.help = "size of a pixel", .range =
//     positive}); fields.integer("noise", options.noise, {.help = "standard deviation of 255", .range = non_negative});
//     fields.variant("light", options.light, {.help = "..."},
//                    alternative<Uniform>("uniform", "the same everywhere"),
//                    alternative<Gradient>("gradient", "...", [](Fields& f, Gradient& g) { f.number("slope", g.slope);
//                    }));
//     fields.require(options.noise < 128, "noise", "noise above 127 leaves no image", "Choose less");
//   }
//
// The same function runs in three modes:
//   decode: each call reads its key, or leaves the default. Every mistake is added to the list of problems with file,
//           line, pointer, what was expected and what to do. Reading goes on.
//   schema: each call adds a property to a JSON Schema (draft-07).
//   encode: each call writes the value. So the output names every option (resolved.json, the cache key).
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"
#include "pipelines/formats/results.hpp"

namespace shakebed::pipelines {

// Bounds of a number, in SI for quantities.
struct Range {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool above_low = false, below_high = false;  // the bound itself is excluded
  bool contains(double value) const;
  std::string words() const;  // "above 0", "from 0 to 1"; "" without bounds
};
inline constexpr Range any_number{};
inline constexpr Range positive{.low = 0, .above_low = true};
inline constexpr Range non_negative{.low = 0};
inline constexpr Range zero_to_one{.low = 0, .high = 1};
inline constexpr Range from_to(double low, double high) { return {.low = low, .high = high}; }
inline constexpr Range at_least(double low) { return {.low = low}; }

// What is said of a field besides its name and type.
struct About {
  std::string_view help = {};
  bool required = false;
  Range range = {};
  std::string_view example = {};  // shown in messages and in the schema
};

// A file, or several (an array, wildcards * and ? in a path, all files of a folder), that the user
// names in a recipe. Paths are relative to the recipe.
struct InputFiles {
  std::vector<std::string> texts;  // as written
  std::vector<std::string> paths;  // what they name, in order; filled when a recipe is read
  bool empty() const { return texts.empty(); }
};

class Fields;
struct KnownBed;  // formats/bed.hpp

// One row of a tagged choice.
template <class T>
struct Alternative {
  std::string_view name, help;
  std::function<void(Fields&, T&)> describe;
};
template <class T>
Alternative<T> alternative(std::string_view name, std::string_view help,
                           std::function<void(Fields&, T&)> describe = {}) {
  return {name, help, std::move(describe)};
}
template <class E>
struct Choice {
  E value;
  std::string_view name;
};

class Fields {
 public:
  enum class Mode { decode, schema, encode };

  // Where reading happens: shared by all nested objects of one document.
  struct Source {
    std::string file;                      // for messages
    std::filesystem::path directory = {};  // relative paths are resolved against it
    std::vector<Problem>* problems = nullptr;
    std::size_t problems_before = 0;           // those of the document that are not of this stage
    std::vector<Warning>* warnings = nullptr;  // what is odd but not wrong; may be left out
    // Every input file that was named: pointer and file.
    std::vector<std::pair<std::string, std::string>>* input_files = nullptr;
    std::vector<std::string> upstream = {};  // kinds of the stages that a stage takes its input from
    std::vector<StatedStage> from = {};      // the same stages, and what each will give
    const KnownBed* bed = nullptr;           // what those stages know of the bed
  };

  // Reads an object. After describing, call finish(): it reports the keys that nobody asked for.
  static Fields decode(const JsonNode& object, std::string pointer, const Source& source);
  static Fields schema(Json& out);
  static Fields encode(Json& out);
  void finish();

  Mode mode() const { return mode_; }
  bool decoding() const { return mode_ == Mode::decode; }
  // Whether a key is to be described: always, but when writing only if `used`. For keys that exclude each other, so
  // that what is written can be read again.
  bool describes(bool used) const { return mode_ != Mode::encode || used; }
  const std::string& pointer() const { return pointer_; }
  const Source& source() const { return source_; }

  // In a stage with "units": "reduced" every quantity is a plain number: lengths in D, masses in m, g or the starting T
  // equal to 1. A string with a unit is then a mistake. Options structs then hold reduced numbers instead of SI.
  bool reduced() const { return reduced_; }
  void set_reduced(bool reduced) { reduced_ = reduced; }

  // Kinds of the stages that "from" names, in its order (decoding only).
  const std::vector<std::string>& upstream() const { return source_.upstream; }
  bool has_upstream(std::string_view kind) const;
  // What the stages in "from" will give (decoding only).
  const std::vector<StatedStage>& from() const { return source_.from; }
  // Checks a pointer into the results of the stages in "from", "/fit/temperature"; what is wrong is a problem at
  // `pointer_below`. Returns what is stated of the result, where that is known.
  const StatedResult* check_result(std::string_view pointer_below, const std::string& pointer);
  // What the stages that "from" names know of the bed; nullptr where they know none (decoding only).
  const KnownBed* known_bed() const { return source_.bed; }

  // --- one method a type. `value` holds the default before and what was read after.
  void number(std::string_view key, double& value, const About& about = {});
  void boolean(std::string_view key, bool& value, const About& about = {});
  void text(std::string_view key, std::string& value, const About& about = {});
  void quantity(std::string_view key, double& value, const Dimension& dimension, const About& about = {});
  template <class Integer>
  void integer(std::string_view key, Integer& value, const About& about = {});
  template <class E>
  void choice(std::string_view key, E& value, const std::vector<Choice<E>>& choices, const About& about = {});

  // Absent, or null in the file: stays or becomes empty.
  void number(std::string_view key, std::optional<double>& value, const About& about = {});
  void quantity(std::string_view key, std::optional<double>& value, const Dimension& dimension,
                const About& about = {});
  void text(std::string_view key, std::optional<std::string>& value, const About& about = {});
  template <class Integer>
  void integer(std::string_view key, std::optional<Integer>& value, const About& about = {});

  // Exactly one of two keys that were read must be written.
  void either(std::string_view one, std::string_view other, const std::string& suggestion);
  // When writing: "$comment", which says what follows from the options. Reading ignores it.
  void comment(const std::string& text);

  void numbers(std::string_view key, std::vector<double>& values, const About& about = {});
  void quantities(std::string_view key, std::vector<double>& values, const Dimension& dimension,
                  const About& about = {});
  // An array of strings; one string alone counts as an array of one.
  void texts(std::string_view key, std::vector<std::string>& values, const About& about = {});
  // Files that must exist (a missing one is a problem of input: exit 4).
  void input_files(std::string_view key, InputFiles& files, const About& about = {});
  // Any JSON at all, kept as it is.
  void any(std::string_view key, Json& value, const About& about = {});

  // --- nested
  template <class T>
  void object(std::string_view key, T& value, const std::function<void(Fields&, T&)>& describe,
              const About& about = {});
  template <class T>
  void object(std::string_view key, std::optional<T>& value, const std::function<void(Fields&, T&)>& describe,
              const About& about = {});
  template <class T>
  void array(std::string_view key, std::vector<T>& values, const std::function<void(Fields&, T&)>& describe,
             const About& about = {});
  // An object whose keys the user chooses.
  template <class T>
  void map(std::string_view key, std::vector<std::pair<std::string, T>>& values,
           const std::function<void(Fields&, T&)>& describe, const About& about = {});

  // A std::variant as {"kind": "langevin", ...}; a string alone ("none") is short for {"kind": "none"}. The default is
  // the alternative that the variant holds.
  template <class... T>
  void variant(std::string_view key, std::variant<T...>& value, const About& about,
               const std::type_identity_t<Alternative<T>>&... alternatives);
  // The same with the tag and the alternative's fields in this object, beside others: "motion": "sinusoidal".
  template <class... T>
  void tagged(std::string_view tag, std::variant<T...>& value, const About& about,
              const std::type_identity_t<Alternative<T>>&... alternatives);

  // --- when decoding: a rule between fields. The key is below this object ("" for the object itself; "a/b" goes
  // deeper).
  void require(bool holds, std::string_view key, const std::string& what, const std::string& suggestion = {});
  // The same for whoever knows the pointer below this object ("/disks/diameter").
  void problem(std::string_view pointer_below, const std::string& what, const std::string& suggestion = {});
  // The same for what is odd but not wrong; warnings of one kind are counted together in a sweep.
  void warn(std::string_view kind, std::string_view pointer_below, const std::string& what,
            const std::string& suggestion = {});
  // What was written under a key, nullptr where nothing was (decoding only).
  const JsonNode* written(std::string_view key) const { return node_ != nullptr ? node_->find(key) : nullptr; }
  // Whether the key was written (decoding only).
  bool has(std::string_view key) const;
  // Number of problems so far in this stage.
  std::size_t problem_count() const {
    return source_.problems != nullptr ? source_.problems->size() - source_.problems_before : 0;
  }

 private:
  Fields(Mode mode, const JsonNode* node, Json* out, std::string pointer, Source source)
      : mode_(mode), node_(node), out_(out), pointer_(std::move(pointer)), source_(std::move(source)) {}

  struct RowText {  // an alternative's name and help, without its type
    std::string_view name, help;
  };

  const JsonNode* take(std::string_view key, const About& about, std::string_view expected);
  // The keys of an alternative that was not chosen: finish() names it where one of them was written all the same.
  void note_keys_of(std::string_view tag, std::string_view name, const std::function<void(Fields&)>& describe);
  Problem located(std::string_view pointer_below, const std::string& what, const std::string& suggestion) const;
  void complain(const JsonNode& node, std::string_view key, const std::string& what, const std::string& suggestion = {},
                bool is_input = false);
  void wrong_type(const JsonNode& node, std::string_view key, std::string_view expected, const About& about);
  bool read_number(const JsonNode& node, std::string_view key, const About& about, double& value);
  bool read_quantity(const JsonNode& node, std::string_view key, const Dimension& dimension, const About& about,
                     double& value);
  bool read_integer(const JsonNode& node, std::string_view key, const About& about, std::int64_t low,
                    std::uint64_t high, std::int64_t& value, std::uint64_t& large);
  bool in_range(const JsonNode& node, std::string_view key, double value, const About& about,
                const Dimension& dimension);
  std::optional<std::size_t> read_choice(const JsonNode& node, std::string_view key,
                                         const std::vector<std::string_view>& names);
  Json& property(std::string_view key, const About& about, Json schema);
  Json number_schema(const About& about, const char* type) const;
  Json quantity_schema(const Dimension& dimension, const About& about) const;
  Json encoded_quantity(double value, const Dimension& dimension) const;
  Fields below(const JsonNode* node, Json* out, const std::string& token) const;
  std::optional<std::size_t> read_tag(const std::string& tag, const std::vector<RowText>& rows, std::size_t current,
                                      const About& about);
  static void schema_of_variant(Json& out, std::string_view tag, const std::vector<RowText>& rows,
                                const std::vector<Json>& bodies, std::size_t current, bool shorthand);
  template <class Variant, std::size_t... I, class... T>
  void tagged_alternatives(std::string_view tag, Variant& value, const About& about, std::index_sequence<I...>,
                           const Alternative<T>&... alternatives);

  Mode mode_;
  const JsonNode* node_;
  Json* out_;
  std::string pointer_;
  Source source_;
  bool reduced_ = false;
  bool unknown_keys_matter_ = true;
  std::vector<std::string> known_;
  std::map<std::string, std::string> keys_elsewhere_;  // key to the alternatives it belongs to, as text
};

// ---------------------------------------------------------------------------------------------------------------------

template <class Integer>
void Fields::integer(std::string_view key, Integer& value, const About& about) {
  static_assert(std::is_integral_v<Integer>);
  std::optional<Integer> held = value;
  integer(key, held, about);
  if (held) value = *held;
}

template <class Integer>
void Fields::integer(std::string_view key, std::optional<Integer>& value, const About& about) {
  if (mode_ == Mode::schema) {
    Json& out = property(key, about, number_schema(about, "integer"));
    if (value && !about.required) out["default"] = *value;
  } else if (mode_ == Mode::encode) {
    if (value) (*out_)[std::string(key)] = *value;
  } else if (const JsonNode* node = take(key, about, "a whole number")) {
    std::int64_t signed_value = 0;
    std::uint64_t unsigned_value = 0;
    const auto low = static_cast<std::int64_t>(std::numeric_limits<Integer>::lowest());
    if (read_integer(*node, key, about, low, static_cast<std::uint64_t>(std::numeric_limits<Integer>::max()),
                     signed_value, unsigned_value)) {
      value = std::is_signed_v<Integer> ? static_cast<Integer>(signed_value) : static_cast<Integer>(unsigned_value);
    }
  }
}

template <class E>
void Fields::choice(std::string_view key, E& value, const std::vector<Choice<E>>& choices, const About& about) {
  std::vector<std::string_view> names;
  std::size_t current = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    names.push_back(choices[i].name);
    if (choices[i].value == value) current = i;
  }
  if (mode_ == Mode::schema) {
    Json schema;
    schema["enum"] = Json::array();
    for (const std::string_view name : names) schema["enum"].push_back(name);
    Json& out = property(key, about, std::move(schema));
    if (!about.required) out["default"] = names[current];
  } else if (mode_ == Mode::encode) {
    (*out_)[std::string(key)] = names[current];
  } else if (const JsonNode* node = take(key, about, "a name")) {
    if (const auto chosen = read_choice(*node, key, names)) value = choices[*chosen].value;
  }
}

template <class T>
void Fields::object(std::string_view key, T& value, const std::function<void(Fields&, T&)>& describe,
                    const About& about) {
  if (mode_ == Mode::schema) {
    Json inner;
    Fields fields = below(nullptr, &inner, std::string(key));
    inner["type"] = "object";
    describe(fields, value);
    fields.finish();
    property(key, about, std::move(inner));
  } else if (mode_ == Mode::encode) {
    Json inner = Json::object();
    Fields fields = below(nullptr, &inner, std::string(key));
    describe(fields, value);
    (*out_)[std::string(key)] = std::move(inner);
  } else if (const JsonNode* node = take(key, about, "an object")) {
    if (!node->is_object()) return wrong_type(*node, key, "an object", about);
    Fields fields = below(node, nullptr, std::string(key));
    describe(fields, value);
    fields.finish();
  }
}

template <class T>
void Fields::object(std::string_view key, std::optional<T>& value, const std::function<void(Fields&, T&)>& describe,
                    const About& about) {
  if (mode_ == Mode::encode && !value) return;
  if (mode_ == Mode::decode) {
    const JsonNode* node = node_->find(key);
    if (node == nullptr || node->kind == JsonNode::Kind::null) {
      take(key, about, "an object");
      return;
    }
  }
  T held = value.value_or(T{});
  object<T>(key, held, describe, about);
  if (mode_ != Mode::schema) value = std::move(held);
}

template <class T>
void Fields::array(std::string_view key, std::vector<T>& values, const std::function<void(Fields&, T&)>& describe,
                   const About& about) {
  if (mode_ == Mode::schema) {
    Json inner;
    Fields fields = below(nullptr, &inner, std::string(key));
    inner["type"] = "object";
    T element{};
    describe(fields, element);
    fields.finish();
    Json list;
    list["type"] = "array";
    list["items"] = std::move(inner);
    property(key, about, std::move(list));
  } else if (mode_ == Mode::encode) {
    Json list = Json::array();
    for (std::size_t i = 0; i < values.size(); ++i) {
      Json inner = Json::object();
      Fields fields = below(nullptr, &inner, std::string(key));
      describe(fields, values[i]);
      list.push_back(std::move(inner));
    }
    (*out_)[std::string(key)] = std::move(list);
  } else if (const JsonNode* node = take(key, about, "an array of objects")) {
    if (!node->is_array()) return wrong_type(*node, key, "an array of objects", about);
    values.clear();
    for (std::size_t i = 0; i < node->items.size(); ++i) {
      const std::string token = std::string(key) + "/" + std::to_string(i);
      if (!node->items[i].is_object()) {
        wrong_type(node->items[i], token, "an object", {});
        continue;
      }
      Fields fields = below(&node->items[i], nullptr, token);
      values.emplace_back();
      describe(fields, values.back());
      fields.finish();
    }
  }
}

template <class T>
void Fields::map(std::string_view key, std::vector<std::pair<std::string, T>>& values,
                 const std::function<void(Fields&, T&)>& describe, const About& about) {
  if (mode_ == Mode::schema) {
    Json inner;
    Fields fields = below(nullptr, &inner, std::string(key));
    inner["type"] = "object";
    T element{};
    describe(fields, element);
    fields.finish();
    Json outer;
    outer["type"] = "object";
    outer["additionalProperties"] = std::move(inner);
    property(key, about, std::move(outer));
  } else if (mode_ == Mode::encode) {
    Json outer = Json::object();
    for (auto& [name, value] : values) {
      Json inner = Json::object();
      Fields fields = below(nullptr, &inner, std::string(key));
      describe(fields, value);
      outer[name] = std::move(inner);
    }
    (*out_)[std::string(key)] = std::move(outer);
  } else if (const JsonNode* node = take(key, about, "an object")) {
    if (!node->is_object()) return wrong_type(*node, key, "an object", about);
    values.clear();
    for (const JsonMember& member : node->members) {
      if (member.key == "$comment") continue;
      const std::string token = std::string(key) + "/" + escape_pointer_token(member.key);
      if (!member.value.is_object()) {
        wrong_type(member.value, token, "an object", {});
        continue;
      }
      Fields fields = below(&member.value, nullptr, token);
      values.emplace_back(member.key, T{});
      describe(fields, values.back().second);
      fields.finish();
    }
  }
}

template <class Variant, std::size_t... I, class... T>
void Fields::tagged_alternatives(std::string_view tag, Variant& value, const About& about, std::index_sequence<I...>,
                                 const Alternative<T>&... alternatives) {
  const std::vector<RowText> rows{{alternatives.name, alternatives.help}...};
  if (mode_ == Mode::schema) {
    std::vector<Json> bodies;
    const auto body = [&]<std::size_t Index, class A>(const Alternative<A>& row) {
      Json inner;
      inner["type"] = "object";
      Fields fields = below(nullptr, &inner, std::string(tag));
      A held = value.index() == Index ? std::get<Index>(value) : A{};
      if (row.describe) row.describe(fields, held);
      bodies.push_back(std::move(inner));
    };
    (body.template operator()<I>(alternatives), ...);
    schema_of_variant(*out_, tag, rows, bodies, value.index(), false);
    return;
  }
  if (mode_ == Mode::encode) {
    (*out_)[std::string(tag)] = rows[value.index()].name;
    const auto body = [&]<std::size_t Index, class A>(const Alternative<A>& row) {
      if (value.index() == Index && row.describe) row.describe(*this, std::get<Index>(value));
    };
    (body.template operator()<I>(alternatives), ...);
    return;
  }
  const auto chosen = read_tag(std::string(tag), rows, value.index(), about);
  if (!chosen) {
    unknown_keys_matter_ = false;  // of which alternative they would be is not known
    return;
  }
  const auto body = [&]<std::size_t Index, class A>(const Alternative<A>& row) {
    if (*chosen != Index) {
      if (row.describe) {
        note_keys_of(tag, row.name, [&row](Fields& fields) {
          A scratch{};
          row.describe(fields, scratch);
        });
      }
      return;
    }
    if (value.index() != Index) value.template emplace<Index>();
    if (row.describe) row.describe(*this, std::get<Index>(value));
  };
  (body.template operator()<I>(alternatives), ...);
}

template <class... T>
void Fields::tagged(std::string_view tag, std::variant<T...>& value, const About& about,
                    const std::type_identity_t<Alternative<T>>&... alternatives) {
  tagged_alternatives(tag, value, about, std::index_sequence_for<T...>{}, alternatives...);
}

template <class... T>
void Fields::variant(std::string_view key, std::variant<T...>& value, const About& about,
                     const std::type_identity_t<Alternative<T>>&... alternatives) {
  if (mode_ == Mode::schema) {
    Json inner;
    Fields fields = below(nullptr, &inner, std::string(key));
    inner["type"] = "object";
    fields.tagged_alternatives("kind", value, {.required = true}, std::index_sequence_for<T...>{}, alternatives...);
    fields.finish();
    Json names = Json::array();
    for (const std::string_view name : {alternatives.name...}) names.push_back(name);
    Json either;
    either["anyOf"] = Json::array({Json{{"enum", std::move(names)}}, std::move(inner)});
    property(key, about, std::move(either));
  } else if (mode_ == Mode::encode) {
    Json inner = Json::object();
    Fields fields = below(nullptr, &inner, std::string(key));
    fields.tagged_alternatives("kind", value, about, std::index_sequence_for<T...>{}, alternatives...);
    (*out_)[std::string(key)] = std::move(inner);
  } else if (const JsonNode* node = take(key, about, "a name or an object with \"kind\"")) {
    JsonNode shorthand;
    if (node->is_string()) {
      shorthand.kind = JsonNode::Kind::object;
      shorthand.at = node->at;
      shorthand.from_command_line = node->from_command_line;
      shorthand.members.push_back({"kind", node->at, *node});
      node = &shorthand;
    }
    if (!node->is_object()) return wrong_type(*node, key, "a name or an object with \"kind\"", about);
    Fields fields = below(node, nullptr, std::string(key));
    fields.tagged_alternatives("kind", value, {.required = true}, std::index_sequence_for<T...>{}, alternatives...);
    fields.finish();
  }
}

}  // namespace shakebed::pipelines
