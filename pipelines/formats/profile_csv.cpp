#include "pipelines/formats/profile_csv.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/table.hpp"

namespace shakebed::pipelines {
namespace {

constexpr double same_height = 1e-9;     // heights of a profile and of its covariance [D]
constexpr std::size_t rows_to_name = 8;  // in a note on rows without an error

std::vector<std::string> split_blanks(std::string_view line) {
  std::vector<std::string> cells;
  std::size_t i = 0;
  while (true) {
    i = line.find_first_not_of(" \t\r", i);
    if (i == std::string_view::npos) return cells;
    const std::size_t end = std::min(line.find_first_of(" \t\r", i), line.size());
    cells.emplace_back(line.substr(i, end - i));
    i = end;
  }
}

std::string in_small_letters(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

bool is_any_of(std::string name, std::initializer_list<std::string_view> names) {
  name = in_small_letters(std::move(name));
  return std::find(names.begin(), names.end(), name) != names.end();
}

// Reads the file line by line; then rows are sorted and what is missing is completed.
class Reader {
 public:
  explicit Reader(const std::filesystem::path& path) : path_(path) {}

  ProfileTable read() {
    const std::string text = read_file(path_);
    std::size_t begin = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
    while (begin < text.size()) {
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      const std::string line = trimmed(std::string_view(text).substr(begin, end - begin));
      begin = end + 1;
      ++line_number_;
      if (line.empty()) continue;
      if (line[0] == '#')
        read_comment(trimmed(std::string_view(line).substr(1)));
      else if (header_.empty())
        read_header(line);
      else
        read_row(line);
    }
    if (header_.empty())
      throw InputError(path_.string() +
                       ": there is no header line. Write the names of the columns in the first line, for example "
                       "height,number_density");
    if (rows_.empty()) throw InputError(path_.string() + ": there are no rows below the header line");
    std::stable_sort(rows_.begin(), rows_.end(), [](const Row& a, const Row& b) { return a.height < b.height; });
    complete_errors();
    read_notes();
    for (const Row& row : rows_) {
      profile_.height.push_back(row.height), profile_.number_density.push_back(row.density);
      profile_.area_fraction.push_back(row.area), profile_.samples.push_back(row.samples);
      if (has_errors_) profile_.std_error.push_back(row.error);
    }
    return std::move(profile_);
  }

 private:
  struct Row {
    double height = 0, density = 0, error = 0, area = 0, samples = 0;  // error 0: none in the file
    std::size_t line = 0;
  };

  [[nodiscard]] InputError fail(const std::string& what) const {
    return InputError(fmt::format("{}:{}: {}", path_.string(), line_number_, what));
  }

  // "key: value" lines of files without metadata.
  void read_comment(const std::string& comment) {
    if (const std::size_t colon = comment.find(':'); colon != std::string::npos)
      comments_.try_emplace(trimmed(std::string_view(comment).substr(0, colon)),
                            trimmed(std::string_view(comment).substr(colon + 1)), line_number_);
  }

  [[nodiscard]] std::vector<std::string> split(std::string_view line) const {
    return separator_ == ' ' ? split_blanks(line) : split_csv_line(line, separator_);
  }

  void read_header(const std::string& line) {
    for (const char candidate : {',', ';', '\t', ' '}) {
      separator_ = candidate;
      if (split(line).size() >= 2) break;
    }
    header_ = split(line);
    for (std::size_t i = 0; i < header_.size(); ++i) {
      const auto at = static_cast<std::ptrdiff_t>(i);
      if (is_any_of(header_[i], {"height", "zeta", "z", "z/d"}))
        height_ = at;
      else if (is_any_of(header_[i], {"number_density", "density", "phi"}))
        density_ = at;
      else if (is_any_of(header_[i], {"std_error", "error", "sigma", "stderr"}))
        error_ = at;
      else if (is_any_of(header_[i], {"area_fraction", "nu"}))
        area_ = at;
      else if (is_any_of(header_[i], {"samples", "count"}))
        samples_ = at;
    }
    if (density_ < 0 && area_ < 0) density_ = column_of_several("phi");
    if (density_ < 0 && area_ < 0) area_ = column_of_several("nu");
    if (height_ >= 0 && (density_ >= 0 || area_ >= 0)) return;
    throw fail(
        fmt::format("the header must name at least \"height\" (in D) and \"number_density\" (n D^2), or "
                    "\"area_fraction\"; found \"{}\"",
                    line));
  }

  // The first column called NAME_something, as programs write that keep several windows beside one another; -1 for
  // none.
  std::ptrdiff_t column_of_several(std::string_view name) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < header_.size(); ++i)
      if (in_small_letters(header_[i]).starts_with(std::string(name) + "_")) found.push_back(i);
    if (found.empty()) return -1;
    std::vector<std::string> others;
    for (std::size_t k = 1; k < found.size(); ++k) others.push_back(header_[found[k]]);
    if (!others.empty())
      profile_.notes.push_back(
          fmt::format("{}: the {} is read from column \"{}\", and these columns are ignored: {}. To use another "
                      "column, name it \"{}\".",
                      path_.string(), name == "nu" ? "area fraction" : "density", header_[found[0]],
                      fmt::join(others, ", "), name == "nu" ? "area_fraction" : "number_density"));
    return static_cast<std::ptrdiff_t>(found[0]);
  }

  void read_row(const std::string& line) {
    const std::vector<std::string> cells = split(line);
    if (cells.size() != header_.size())
      throw fail(fmt::format("this row has {} cells, but the header has {}", cells.size(), header_.size()));
    const auto given = [&](std::ptrdiff_t column) {
      return column >= 0 && !cells[static_cast<std::size_t>(column)].empty();
    };
    const auto number = [&](std::ptrdiff_t column) {
      const std::string& cell = cells[static_cast<std::size_t>(column)];
      const auto value = number_in(cell);
      if (!value)
        throw fail(fmt::format("\"{}\" in column \"{}\" is not a finite number", cell,
                               header_[static_cast<std::size_t>(column)]));
      return *value;
    };
    Row row;
    row.line = line_number_;
    row.height = number(height_);
    row.area = given(area_) || density_ < 0 ? number(area_) : std::numbers::pi / 4 * number(density_);
    row.density = density_ >= 0 ? number(density_) : row.area * 4 / std::numbers::pi;
    row.error = given(error_) ? number(error_) : 0;
    row.samples = given(samples_) ? number(samples_) : 0;
    if (row.density < 0)
      throw fail(fmt::format("the density {} is negative. Set negative densities to 0, or leave their rows out",
                             number_text(row.density)));
    if (!std::isfinite(row.density)) throw fail("the density is beyond the largest possible number");
    if (row.error < 0) throw fail(fmt::format("the standard error {} is negative", number_text(row.error)));
    rows_.push_back(row);
  }

  // Rows without an error take that of the nearest height that has one.
  void complete_errors() {
    std::vector<Row> known;
    std::vector<std::string> missing;
    for (const Row& row : rows_) {
      if (row.error > 0)
        known.push_back(row);
      else
        missing.push_back(std::to_string(row.line));
    }
    has_errors_ = !known.empty();
    if (known.empty() || missing.empty()) return;
    for (Row& row : rows_) {
      if (row.error > 0) continue;
      double nearest = std::numeric_limits<double>::infinity();
      for (const Row& other : known) {
        const double distance = std::abs(other.height - row.height);
        if (distance < nearest)
          nearest = distance, row.error = other.error;
        else if (distance == nearest)
          row.error = std::max(row.error, other.error);
      }
    }
    const std::size_t count = missing.size();
    if (count > rows_to_name) missing.resize(rows_to_name);
    profile_.notes.push_back(
        fmt::format("{}: {} of {} rows have no standard error or one of 0 (line{} {}{}). The error of the nearest "
                    "height that has one is used for each.",
                    path_.string(), count, rows_.size(), count == 1 ? "" : "s", fmt::join(missing, ", "),
                    count > rows_to_name ? ", ..." : ""));
  }

  // Kernel, column number, phase: from the metadata beside the file, else from comments.
  void read_notes() {
    const Json notes = table_notes(path_);
    const auto metadata = metadata_path(path_).string();
    if (const Json* kernel = find_pointer(notes, "/kernel")) {
      const Json *kind = find_pointer(*kernel, "/kind"), *width = find_pointer(*kernel, "/width");
      const auto known =
          kind != nullptr && kind->is_string() ? kernel_kind_from(kind->get<std::string>()) : std::nullopt;
      if (!known || width == nullptr || !width->is_number())
        throw InputError(metadata + ": /notes/0/kernel: expected a kind and a width");
      profile_.kernel = Kernel{*known, width->get<double>()};
    }
    const auto number = [&](const char* key) -> std::optional<double> {
      const Json* found = find_pointer(notes, std::string("/") + key);
      return found != nullptr && found->is_number() ? std::optional(found->get<double>()) : std::nullopt;
    };
    profile_.column_number = number("column_number"), profile_.phase = number("phase");
    if (const Json* origin = find_pointer(notes, "/origin"); origin != nullptr && origin->is_string())
      profile_.origin = origin->get<std::string>();
    if (!profile_.kernel) kernel_from_comments();
    if (const auto found = comments_.find("column_number"); !profile_.column_number && found != comments_.end()) {
      profile_.column_number = number_in(found->second.text);
      if (!profile_.column_number || !(*profile_.column_number > 0))
        throw InputError(fmt::format("{}:{}: column_number: expected a number above 0, got \"{}\"", path_.string(),
                                     found->second.line, found->second.text));
    }
  }

  void kernel_from_comments() {
    const auto kind = comments_.find("kernel");
    if (kind == comments_.end()) return;
    const auto width = comments_.find("kernel_width");
    const std::string text =
        width == comments_.end() ? kind->second.text : kind->second.text + ":" + width->second.text;
    profile_.kernel = kernel_from(text);
    if (!profile_.kernel)
      throw InputError(fmt::format(
          "{}:{}: there is no kernel \"{}\"; write gaussian:WIDTH, top_hat:WIDTH, disk_chord:WIDTH (in D) or none",
          path_.string(), kind->second.line, text));
  }

  struct Comment {
    std::string text;
    std::size_t line;
    Comment(std::string words, std::size_t number) : text(std::move(words)), line(number) {}
  };
  std::filesystem::path path_;
  std::size_t line_number_ = 0;
  std::vector<std::string> header_;
  char separator_ = ',';
  std::ptrdiff_t height_ = -1, density_ = -1, error_ = -1, area_ = -1, samples_ = -1;
  std::vector<Row> rows_;
  bool has_errors_ = false;
  std::map<std::string, Comment> comments_;
  ProfileTable profile_;
};

}  // namespace

std::vector<StatedColumn> profile_columns(const std::string& origin) {
  return {{"height", "D", "height above " + origin},
          {"number_density", "1/D^2", "number density: disks per area, in units of 1/D^2"},
          {"std_error", "1/D^2", "standard error of number_density"},
          {"area_fraction", "1", "fraction of the area covered by disks"},
          {"samples", "1", "number of disk positions at this height"}};
}

std::vector<StatedColumn> covariance_columns() {
  return {{"height_i", "D", "first of the two heights"},
          {"height_j", "D", "second of the two heights, not below the first"},
          {"covariance", "1/D^4", "covariance of the densities at the two heights"}};
}

void write_profile_csv(const std::filesystem::path& path, const ProfileTable& profile) {
  Table table(profile.description, profile_columns(profile.origin));
  table.note("origin", profile.origin);
  if (profile.kernel)
    table.note("kernel", Json{{"kind", to_string(profile.kernel->kind)}, {"width", profile.kernel->width}});
  if (profile.column_number) table.note("column_number", *profile.column_number);
  if (profile.phase) table.note("phase", *profile.phase);
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const bool has_error = i < profile.std_error.size() && profile.std_error[i] >= 0;
    const double area =
        i < profile.area_fraction.size() ? profile.area_fraction[i] : std::numbers::pi / 4 * profile.number_density[i];
    table.add({profile.height[i], profile.number_density[i], has_error ? Cell(profile.std_error[i]) : Cell(""), area,
               i < profile.samples.size() ? profile.samples[i] : 0.0});
  }
  table.write(path);
}

ProfileTable read_profile_csv(const std::filesystem::path& path) { return Reader(path).read(); }

ProfileCovariance read_covariance_csv(const std::filesystem::path& path, const ProfileTable& profile) {
  const std::vector<double>& heights = profile.height;
  const std::size_t n = heights.size();
  ProfileCovariance out{std::vector<double>(n * n, 0.0), 0};
  for (std::size_t i = 0; i < profile.std_error.size(); ++i)
    out.values[i * n + i] = profile.std_error[i] * profile.std_error[i];
  const auto index_of = [&](double height) -> std::optional<std::size_t> {
    const auto at = std::lower_bound(heights.begin(), heights.end(), height - same_height);
    if (at == heights.end() || std::abs(*at - height) > same_height) return std::nullopt;
    return static_cast<std::size_t>(at - heights.begin());
  };
  each_csv_line(read_file(path), [&](const std::vector<std::string>& cells, std::size_t line) {
    if (line == 1) return;  // the header
    std::optional<double> numbers[3];
    for (std::size_t k = 0; k < 3 && k < cells.size(); ++k) numbers[k] = number_in(cells[k]);
    if (cells.size() != 3 || !numbers[0] || !numbers[1] || !numbers[2])
      throw InputError(fmt::format("{}:{}: expected three numbers: height_i,height_j,covariance", path.string(), line));
    const auto i = index_of(*numbers[0]), j = index_of(*numbers[1]);
    if (i && j) out.values[*i * n + *j] = out.values[*j * n + *i] = *numbers[2];
  });
  const Json notes = table_notes(path);
  if (const Json* samples = find_pointer(notes, "/independent_samples"); samples != nullptr && samples->is_number())
    out.independent_samples = samples->get<int>();
  return out;
}

void write_covariance_csv(const std::filesystem::path& path, const std::vector<double>& heights,
                          const std::vector<double>& covariance, std::size_t independent_samples) {
  Table table("covariance of number_density in profile.csv; it is 0 for pairs that are not listed",
              covariance_columns());
  table.note("independent_samples", independent_samples);
  const std::size_t n = heights.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i; j < n; ++j)
      if (covariance[i * n + j] != 0) table.add({heights[i], heights[j], covariance[i * n + j]});
  table.write(path);
}

}  // namespace shakebed::pipelines
