#include "pipelines/stages/published.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "pipelines/formats/embedded.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/quantity.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::string_view published_folder = "reference-data/", published_file = "/numbers.json";

PublishedLookup not_found(const std::string& what, const std::string& wanted, const std::vector<std::string>& names) {
  const std::string nearest = nearest_name(wanted, names);
  return {
      {},
      fmt::format("there is no {} \"{}\"", what, wanted),
      nearest.empty() ? fmt::format("Choose from: {}", fmt::join(names, ", ")) : "Did you mean \"" + nearest + "\"?"};
}

std::optional<double> number_at(const Json& object, const char* key) {
  return object.contains(key) ? std::optional(object[key].get<double>()) : std::nullopt;
}

}  // namespace

PublishedLookup find_published(const std::string& name) {
  const std::string paper = name.substr(0, name.find('/')), own = name.substr(std::min(name.size(), paper.size() + 1));
  std::vector<std::string> names;
  const EmbeddedFile* file = nullptr;
  for (const EmbeddedFile& one : embedded_files()) {
    if (!one.name.starts_with(published_folder) || !one.name.ends_with(published_file)) continue;
    names.emplace_back(
        one.name.substr(published_folder.size(), one.name.size() - published_folder.size() - published_file.size()));
    if (names.back() == paper) file = &one;
  }
  if (file == nullptr) return not_found("paper", paper, names);
  try {
    const Json document = parse_own_json(file->text);
    const Json& numbers = document.at("numbers");
    if (!numbers.contains(own)) {
      names.clear();
      for (const auto& [key, ignored] : numbers.items()) names.push_back(key);
      return not_found("number of " + paper, own, names);
    }
    const Json& number = numbers[own];
    PublishedClaim claim;
    claim.value = number_at(number, "value"), claim.least = number_at(number, "least");
    claim.most = number_at(number, "most"), claim.tolerance = number_at(number, "tolerance").value_or(0);
    claim.from_memory = number.at("read").get<std::string>() == "from memory";
    claim.place = fmt::format("{}; {}", document.at("cite").get<std::string>(), number["read"].get<std::string>());
    if (!claim.value && !claim.least && !claim.most)
      throw InputError(std::string(file->name) + ": " + own + " has no value");
    return {claim, "", ""};
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: {}", file->name, error.what()));
  }
}

}  // namespace shakebed::pipelines
