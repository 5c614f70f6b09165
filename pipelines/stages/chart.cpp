#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "fit/profile_fit/chances.hpp"
#include "fit/profile_fit/straight_line.hpp"
#include "pipelines/formats/bed.hpp"
#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "pipelines/stages/chart_map.hpp"
#include "pipelines/stages/figure.hpp"
#include "pipelines/stages/stage.hpp"
#include "sim/measure/order.hpp"

namespace shakebed::pipelines {
namespace {

enum class Look { points, line, dashed, dotted, none };

struct PointsOptions {
  std::string name, from, file = "table.csv", label;
  std::vector<std::pair<std::string, std::string>> where;  // column → value
  std::string x, y, error;
  Look look = Look::points;
  int color = -1;
  double times = 1, plus = 0, x_times = 1, x_plus = 0, power_of_x = 0;
  bool logarithm = false;
  std::optional<double> x_least, x_most;  // of those drawn and used
  bool line_fit = false, power_fit = false;
  std::optional<double> fit_least, fit_most;
  std::uint32_t pool = 1;
  std::string against;         // name of a curve
  std::vector<double> levels;  // of y: where are they crossed
  bool residuals = false;
};
struct CurveOptions {
  std::string name, label;
  std::vector<double> polynomial;
  double exponent = 0;  // the polynomial is multiplied by x^exponent
  double from = 0, to = 1;
  Look look = Look::line;
  int color = 0;
};
struct ChartOptions {
  std::string name, caption, x_label, y_label, residual_label;
  std::optional<double> x_low, x_high, y_low, y_high;
  bool logarithmic_x = false, logarithmic_y = false, lead = false;
  std::vector<PointsOptions> points;
  std::vector<CurveOptions> curves;
};
struct SnapshotOptions {
  std::string name, from, caption;
};

Series::Style style_of(Look look) {
  return look == Look::points   ? Series::Style::points
         : look == Look::line   ? Series::Style::line
         : look == Look::dashed ? Series::Style::dashed
                                : Series::Style::dotted;
}
const std::vector<Choice<Look>> all_looks{{Look::points, "points"},
                                          {Look::line, "line"},
                                          {Look::dashed, "dashed"},
                                          {Look::dotted, "dotted"},
                                          {Look::none, "none"}};

double curve_at(const CurveOptions& curve, double x) {
  double y = 0;
  for (std::size_t k = curve.polynomial.size(); k-- > 0;) y = y * x + curve.polynomial[k];
  return curve.exponent == 0 ? y : y * std::pow(x, curve.exponent);
}

// Rows of a table that fulfil `where`, with x rising.
struct Data {
  std::vector<double> x, y, error;
  bool has_errors = true;
};
Data read_data(const std::filesystem::path& path, const PointsOptions& options) {
  std::vector<std::string> header;
  struct Row {
    double x, y, error;
  };
  std::vector<Row> rows;
  Data data;
  bool any = false;
  const auto column = [&](const std::string& name) { return csv_column(header, name, path.string()); };
  std::size_t x = 0, y = 0, error = 0;
  std::vector<std::size_t> conditions;
  each_csv_line(read_file(path), [&](const std::vector<std::string>& cells, std::size_t) {
    if (header.empty()) {
      header = cells;
      x = column(options.x), y = column(options.y);
      std::string of_error = options.error;
      if (of_error.empty()) {
        for (const std::string& name : {options.y + "_error", std::string("std_error")})
          if (of_error.empty() && std::find(header.begin(), header.end(), name) != header.end()) of_error = name;
      }
      data.has_errors = !of_error.empty() && of_error != "none";
      if (data.has_errors) error = column(of_error);
      for (const auto& [name, ignored] : options.where) conditions.push_back(column(name));
      return;
    }
    const auto cell = [&](std::size_t k) { return k < cells.size() ? cells[k] : std::string(); };
    bool wanted = true;
    for (std::size_t k = 0; k < conditions.size(); ++k)
      wanted = wanted && cell(conditions[k]) == options.where[k].second;
    any = any || wanted;
    const auto at = number_in(cell(x)), value = number_in(cell(y));
    if (!wanted || !at || !value) return;
    const double place = options.x_plus + options.x_times * *at;
    if (options.x_least && place < *options.x_least) return;
    if (options.x_most && place > *options.x_most) return;
    const auto spread = data.has_errors ? number_in(cell(error)) : std::nullopt;
    Row row{place, options.plus + options.times * *value, spread ? std::abs(options.times) * *spread : 0};
    if (options.power_of_x != 0) {
      const double factor = std::pow(place, options.power_of_x);
      if (!std::isfinite(factor)) return;
      row.y *= factor, row.error *= factor;
    }
    if (options.logarithm) {
      if (!(row.y > 0)) return;
      row.error /= row.y, row.y = std::log(row.y);
    }
    rows.push_back(row);
  });
  // What is only counted may be nothing: no prediction in range, say.
  if (!any && options.look != Look::none)
    throw InputError(
        fmt::format("{}: no row of this table belongs to the data set \"{}\"; check its \"where\" and its range of x",
                    path.string(), options.name));
  std::stable_sort(rows.begin(), rows.end(), [](const Row& l, const Row& r) { return l.x < r.x; });
  for (const Row& row : rows) data.x.push_back(row.x), data.y.push_back(row.y), data.error.push_back(row.error);
  return data;
}

// Errors from few replicas scatter themselves: each becomes the root mean square of those of the `pool` nearest points.
std::vector<double> pooled(const std::vector<double>& errors, std::size_t pool) {
  if (pool <= 1) return errors;
  std::vector<double> out;
  const std::size_t n = errors.size(), span = std::min(pool, n);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t first = std::min(i - std::min(i, span / 2), n - span);
    double squares = 0;
    for (std::size_t k = first; k < first + span; ++k) squares += errors[k] * errors[k];
    out.push_back(std::sqrt(squares / static_cast<double>(span)));
  }
  return out;
}

// Root mean square of ln(y/curve); none where a sign forbids it. 0.69: wrong by a factor of two.
std::optional<double> rms_log_ratio(const CurveOptions& curve, const std::vector<double>& x,
                                    const std::vector<double>& y) {
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double ratio = y[i] / curve_at(curve, x[i]);
    if (!(ratio > 0) || !std::isfinite(ratio)) return std::nullopt;
    squares += std::pow(std::log(ratio), 2);
  }
  return std::sqrt(squares / static_cast<double>(x.size()));
}

// Offset + amplitude x^exponent with the exponent fitted, and with 1 and 2 given.
Json power_json(const std::vector<double>& x, const std::vector<double>& y, const std::vector<double>& error) {
  Json out;
  const auto described = [](const fit::PowerLaw& law) {
    return Json{{"amplitude", law.amplitude},
                {"offset", law.offset},
                {"chi2", law.chi2},
                {"dof", law.dof},
                {"p_value", law.p_value}};
  };
  const fit::PowerLaw law = error.empty() ? fit::PowerLaw{} : fit::fit_power_law(x, y, error, true);
  out["status"] =
      law.ok ? "ok"
             : "not fitted: the fit needs four points with x > 0 and with errors, and an exponent between 0.1 and 6";
  out["exponent"] = law.ok ? quantity_json(law.exponent, "1", law.exponent_error) : Json();
  if (law.ok) out["law"] = described(law);
  for (const int exponent : {1, 2}) {
    const fit::PowerLaw given = error.empty() ? fit::PowerLaw{} : fit::fit_given_power(x, y, error, exponent, true);
    out["given"][std::to_string(exponent)] = given.ok ? described(given) : Json();
  }
  return out;
}

// The points that fits and comparisons use.
struct Used {
  std::vector<double> x, y, error;
  bool weighted = false;  // every point has an error
};
Used used_points(const Data& data, const PointsOptions& options) {
  Used used;
  for (std::size_t i = 0; i < data.x.size(); ++i) {
    if ((options.fit_least && data.x[i] < *options.fit_least) || (options.fit_most && data.x[i] > *options.fit_most))
      continue;
    used.x.push_back(data.x[i]), used.y.push_back(data.y[i]), used.error.push_back(data.error[i]);
  }
  used.weighted = data.has_errors && !used.error.empty() &&
                  std::all_of(used.error.begin(), used.error.end(), [](double e) { return e > 0; });
  return used;
}

// The weighted straight line and where it crosses zero.
void add_line_fit(const Used& used, Json& found) {
  const fit::StraightLine line =
      used.weighted ? fit::fit_straight_line(used.x, used.y, used.error) : fit::StraightLine{};
  found["line_fit"] = line.ok ? "ok" : "not fitted: the line needs two points with errors";
  if (!line.ok) return;
  found["slope"] = quantity_json(line.slope, "1", line.slope_error);
  found["intercept"] = quantity_json(line.intercept, "1", line.intercept_error);
  found["chi2"] = line.chi2, found["dof"] = line.dof, found["p_value"] = line.p_value;
  if (line.slope == 0) return;
  const double zero = -line.intercept / line.slope;
  const double variance = line.intercept_error * line.intercept_error + 2 * zero * line.covariance +
                          zero * zero * line.slope_error * line.slope_error;
  found["zero"] = quantity_json(zero, "1", std::sqrt(std::max(0.0, variance)) / std::abs(line.slope));
}

// How far the points are from a curve.
Json against_json(const CurveOptions& curve, const Used& used, bool has_errors) {
  Json against{{"curve", curve.name}, {"points", used.x.size()}};
  if (used.x.empty()) {
    for (const char* key : {"chi2", "p_value", "mean_difference", "rms_difference", "largest_difference"})
      against[key] = nullptr;
    return against;
  }
  double chi2 = 0, sum = 0, squares = 0, propagated = 0, largest = 0;
  for (std::size_t i = 0; i < used.x.size(); ++i) {
    const double difference = used.y[i] - curve_at(curve, used.x[i]);
    if (used.weighted) chi2 += std::pow(difference / used.error[i], 2);
    propagated += std::pow(difference * used.error[i], 2);
    sum += difference, squares += difference * difference, largest = std::max(largest, std::abs(difference));
  }
  const auto n = static_cast<double>(used.x.size());
  if (used.weighted) {
    const int dof = static_cast<int>(used.x.size());
    against["chi2"] = chi2, against["dof"] = dof;
    against["chi2_per_dof"] = chi2 / n, against["p_value"] = fit::chance_of_chi2(chi2, dof);
  }
  const double mean = sum / n;
  // Of several points the error follows from their scatter, of one it is its own.
  const double own = used.weighted ? used.error.front() : 0;
  const double spread = used.x.size() > 1 ? std::sqrt(std::max(0.0, squares / n - mean * mean) / (n - 1)) : own;
  against["mean_difference"] =
      used.x.size() > 1 || own > 0 ? quantity_json(mean, "1", spread) : quantity_json(mean, "1");
  // d rms = sum d_i delta_i/(n rms); rms is never less than the errors make it.
  const double rms = std::sqrt(squares / n);
  against["rms_difference"] =
      has_errors && rms > 0 ? quantity_json(rms, "1", std::sqrt(propagated) / (n * rms)) : quantity_json(rms, "1");
  against["largest_difference"] = largest;
  if (const std::optional<double> ratio = rms_log_ratio(curve, used.x, used.y)) against["rms_log_ratio"] = *ratio;
  return against;
}

// For each level of y the x at which the points, joined by straight lines, first cross it.
Json crossings_json(const Data& data, const std::vector<double>& levels) {
  Json crossings = Json::object();
  for (const double level : levels) {
    Json at = Json::object();
    at["value"] = nullptr;
    for (std::size_t i = 1; i < data.x.size(); ++i) {
      const double a = data.y[i - 1] - level, b = data.y[i] - level;
      if ((a > 0) == (b > 0)) continue;
      const double u = a / (a - b), slope = (b - a) / (data.x[i] - data.x[i - 1]);
      at = quantity_json(data.x[i - 1] + u * (data.x[i] - data.x[i - 1]), "1",
                         std::hypot((1 - u) * data.error[i - 1], u * data.error[i]) / std::abs(slope));
      break;
    }
    crossings[fmt::format("{:g}", level)] = std::move(at);
  }
  return crossings;
}

const CurveOptions& curve_named(const ChartOptions& chart, const std::string& name) {
  return *std::find_if(chart.curves.begin(), chart.curves.end(),
                       [&](const CurveOptions& curve) { return curve.name == name; });
}

// What chart.json says about some points.
Json numbers_of(const ChartOptions& chart, const PointsOptions& options, const Data& data) {
  const Used used = used_points(data, options);
  Json found = Json::object();
  found["points"] = data.x.size();
  if (options.line_fit) add_line_fit(used, found);
  if (options.power_fit)
    found["power"] = power_json(used.x, used.y, used.weighted ? used.error : std::vector<double>{});
  if (!options.against.empty())
    found["against"] = against_json(curve_named(chart, options.against), used, data.has_errors);
  if (!options.levels.empty()) found["crossings"] = crossings_json(data, options.levels);
  return found;
}

Picture empty_picture(const ChartOptions& chart) {
  return {.x_label = chart.x_label,
          .y_label = chart.y_label,
          .x_low = chart.x_low,
          .x_high = chart.x_high,
          .y_low = chart.y_low,
          .y_high = chart.y_high,
          .lower_label = chart.residual_label.empty() ? "difference" : chart.residual_label,
          .logarithmic_x = chart.logarithmic_x,
          .logarithmic_y = chart.logarithmic_y};
}

// In the panel below: the differences of a drawn series from a curve, where the curve is given.
void add_residuals(const CurveOptions& curve, const Series& series, Picture& picture) {
  Series below{series.label, series.style, series.color, {}, {}, {}};
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    if (series.x[i] < curve.from || series.x[i] > curve.to) continue;
    below.x.push_back(series.x[i]), below.y.push_back(series.y[i] - curve_at(curve, series.x[i]));
    if (!series.error.empty()) below.error.push_back(series.error[i]);
  }
  if (below.x.empty()) return;
  if (picture.lower.empty())
    picture.lower.push_back({"zero", Series::Style::line, curve.color, {curve.from, curve.to}, {0, 0}, {}});
  picture.lower.push_back(std::move(below));
}

void add_curve(const CurveOptions& curve, Picture& picture) {
  Series series{
      .label = curve.label, .style = style_of(curve.look), .color = curve.color, .x = {}, .y = {}, .error = {}};
  series.markup = true;
  for (int i = 0; i <= 200; ++i) {
    const double x = curve.from + (curve.to - curve.from) * i / 200;
    series.x.push_back(x), series.y.push_back(curve_at(curve, x));
  }
  picture.series.push_back(std::move(series));
}

class Chart : public Stage {
 public:
  void describe(Fields& fields) override;
  void results(ResultList& list) const override;
  void run(RunContext& context) const override;

 private:
  Json draw(const RunContext& context, const ChartOptions& chart, Drawings& drawings) const;
  Json snapshot(const RunContext& context, const SnapshotOptions& snapshot, Drawings& drawings) const;
  std::vector<ChartOptions> charts_;
  std::vector<MapOptions> maps_;
  std::vector<SnapshotOptions> snapshots_;
};

// The table, its columns and the rows wanted must be what the stage writes.
void check_points(Fields& fields, const PointsOptions& p) {
  const std::vector<StatedStage>& from = fields.from();
  const auto stage = std::find_if(from.begin(), from.end(), [&](const StatedStage& one) {
    return one.id == p.from || (p.from.empty() && from.size() == 1);
  });
  if (stage == from.end()) {
    std::vector<std::string> ids;
    for (const StatedStage& one : from) ids.push_back(one.id);
    const std::string nearest = nearest_name(p.from, ids);
    fields.problem(
        "/from",
        p.from.empty()
            ? "\"from\" of the stage names several stages: give here the id of the stage whose table is drawn"
            : fmt::format("\"{}\" is not in the \"from\" of this stage", p.from),
        nearest.empty() ? fmt::format("Choose from: {}", fmt::join(ids, ", "))
                        : fmt::format("Did you mean \"{}\"?", nearest));
    return;
  }
  if (stage->results == nullptr) return;
  if (const auto misfit = misfit_of_table(*stage, p.file))
    return fields.problem("/file", misfit->what, misfit->suggestion);
  const StatedTable& table = *stage->results->find_table(p.file);
  const auto check = [&](const std::string& where, const std::string& column) {
    const auto misfit = misfit_of_column(table, column);
    if (misfit) fields.problem(where, misfit->what, misfit->suggestion);
  };
  if (fields.has("x")) check("/x", p.x);
  if (fields.has("y")) check("/y", p.y);
  if (!p.error.empty() && p.error != "none") check("/error", p.error);
  for (const auto& [column, value] : p.where) {
    const std::string where = "/where/" + escape_pointer_token(column);
    check(where, column);
    const auto found = std::find_if(table.columns.begin(), table.columns.end(),
                                    [&, name = column](const StatedColumn& c) { return c.name == name; });
    if (found == table.columns.end() || found->values.empty()) continue;
    if (std::find(found->values.begin(), found->values.end(), value) != found->values.end()) continue;
    const std::string nearest = nearest_name(value, found->values);
    fields.problem(where, fmt::format("no row of {} has \"{}\" in the column {}", p.file, value, column),
                   nearest.empty() ? fmt::format("Choose from: {}", fmt::join(found->values, ", "))
                                   : fmt::format("Did you mean \"{}\"?", nearest));
  }
}

void describe_points(Fields& fields, PointsOptions& p) {
  fields.text("name", p.name, {.help = "name of this data set in chart.json", .required = true});
  fields.text("from", p.from,
              {.help = "id of the stage whose table is drawn; may be left out where \"from\" names one stage"});
  fields.text("file", p.file, {.help = "CSV file in that stage's folder"});
  fields.text("label", p.label, {.help = "label in the key; subscripts and powers as in T_c and D^2; empty: no label"});
  Json where = Json::object();
  for (const auto& [name, value] : p.where) where[name] = value;
  fields.any("where", where, {.help = "rows that are used: column → required content of its cell"});
  fields.text("x", p.x, {.help = "column of the x values", .required = true});
  fields.text("y", p.y, {.help = "column of the y values", .required = true});
  fields.text("error", p.error,
              {.help = "column of the standard errors of y; left out, y_error or std_error; \"none\": no errors"});
  fields.choice("look", p.look, all_looks,
                {.help = "how the points are drawn; none: not drawn, only fitted and compared"});
  fields.integer("color", p.color, {.help = "number of the colour in the palette, 0 to 6; -1: the next colour"});
  fields.number("times", p.times, {.help = "factor of y"});
  fields.number("plus", p.plus, {.help = "constant that is added to y after the factor"});
  fields.number("power_of_x", p.power_of_x, {.help = "exponent: y is multiplied by x to this power"});
  fields.boolean("logarithm", p.logarithm,
                 {.help = "whether the natural logarithm of y is drawn, after factor and sum; points with y of 0 or "
                          "less are left out"});
  fields.number("x_times", p.x_times, {.help = "factor of x"});
  fields.number("x_plus", p.x_plus, {.help = "constant that is added to x after the factor"});
  fields.number("x_least", p.x_least, {.help = "smallest x that is used"});
  fields.number("x_most", p.x_most, {.help = "largest x that is used"});
  fields.boolean("line_fit", p.line_fit, {.help = "whether a straight line is fitted, weighted by the errors"});
  fields.boolean(
      "power_fit", p.power_fit,
      {.help =
           "whether offset + amplitude x^exponent is fitted: with a free exponent, and with the exponents 1 and 2"});
  fields.number("fit_least", p.fit_least, {.help = "smallest x that fits and comparisons use"});
  fields.number("fit_most", p.fit_most, {.help = "largest x that fits and comparisons use"});
  fields.integer("pool", p.pool,
                 {.help = "number of neighbouring points over which the errors are averaged (root mean square); useful "
                          "where few replicas make the errors uncertain",
                  .range = from_to(1, 1000)});
  fields.text(
      "against", p.against,
      {.help = "name of a curve of this chart with which the points are compared: chi2 and differences are computed"});
  fields.numbers(
      "levels", p.levels,
      {.help = "values of y; for each, the first x at which the points cross it is found (linear between points)"});
  fields.boolean("residuals", p.residuals,
                 {.help = "whether a panel below shows the differences from the curve in \"against\""});
  if (!fields.decoding()) return;
  p.where.clear();
  if (where.is_object()) {
    for (const auto& [name, value] : where.items())
      p.where.emplace_back(name, value.is_string() ? value.get<std::string>() : dump_canonical(value));
  } else {
    fields.problem("/where", "expected an object: column → text");
  }
  fields.require(!p.residuals || p.look != Look::none, "residuals",
                 "residuals are drawn only of points that are drawn, and \"look\" is \"none\"");
  fields.require(!p.residuals || !p.against.empty(), "residuals", "residuals need a curve, and \"against\" names none");
  check_points(fields, p);
}

void check_snapshot(Fields& fields, const SnapshotOptions& s) {
  std::vector<std::string> ids;
  for (const StatedStage& one : fields.from()) {
    if (one.kind == "simulate") ids.push_back(one.id);
  }
  const std::string nearest = nearest_name(s.from, ids);
  fields.require(std::find(ids.begin(), ids.end(), s.from) != ids.end(), "from",
                 fmt::format("\"{}\" is not a simulate stage in the \"from\" of this stage", s.from),
                 nearest.empty() ? fmt::format("Choose from: {}", fmt::join(ids, ", "))
                                 : fmt::format("Did you mean \"{}\"?", nearest));
}

// What is found about some points, under /<chart>/<points>/.
class PointsStatement {
 public:
  PointsStatement(ResultList& list, std::string pointer, const PointsOptions& points)
      : list_(list), at_(std::move(pointer)), points_(points) {}

  void state() {
    list_.number(at_ + "/points", "1", "number of points that are drawn or used");
    line();
    power();
    against();
    for (const double level : points_.levels)
      list_.quantity(at_ + "/crossings/" + fmt::format("{:g}", level), "1", "x at which y first crosses this level", {},
                     true);
  }

 private:
  void line() {
    const Given asked = given_if(points_.line_fit, "\"line_fit\" is true");
    const Given found = both(asked, given_when("two or more points have errors"));
    list_.text(at_ + "/line_fit", "whether the line could be fitted", asked);
    list_.quantity(at_ + "/slope", "1", "slope of the fitted line, in the units of the axes", found);
    list_.quantity(at_ + "/intercept", "1", "y of the fitted line at x = 0", found);
    list_.quantity(at_ + "/zero", "1", "x at which the fitted line crosses zero", found);
    list_.number(at_ + "/chi2", "1", "chi-square: sum of squared residuals over their squared errors", found);
    list_.number(at_ + "/dof", "1", "degrees of freedom", found);
    list_.number(at_ + "/p_value", "1", "probability of a chi-square at least this large, if the model is right", found,
                 true);
  }

  void power() {
    const Given asked = given_if(points_.power_fit, "\"power_fit\" is true");
    const Given found = both(asked, given_when("the power law could be fitted"));
    list_.text(at_ + "/power/status", "whether the power law could be fitted", asked);
    list_.quantity(at_ + "/power/exponent", "1", "fitted exponent", asked, true);
    for (const std::string law : {"/power/law", "/power/given/1", "/power/given/2"}) {
      for (const char* key : {"amplitude", "offset", "chi2", "dof", "p_value"})
        list_.number(at_ + law + "/" + key, "1", std::string(key) + " of the fit of offset + amplitude x^exponent",
                     found, true);
    }
  }

  void against() {
    const Given asked = given_if(!points_.against.empty(), "\"against\" names a curve");
    const Given weighted = both(asked, given_when("the points have errors"));
    const std::string at = at_ + "/against/";
    list_.text(at + "curve", "name of the curve", asked);
    list_.number(at + "points", "1", "number of compared points", asked);
    list_.number(at + "chi2", "1", "chi-square: sum of squared differences over their squared errors", weighted, true);
    list_.number(at + "dof", "1", "degrees of freedom", weighted);
    list_.number(at + "chi2_per_dof", "1", "chi-square per degree of freedom", weighted);
    list_.number(at + "p_value", "1", "probability of a chi-square at least this large, if the model is right",
                 weighted, true);
    list_.quantity(at + "mean_difference", "1", "mean difference, in the unit of y", asked, true);
    list_.quantity(at + "rms_difference", "1", "rms difference, in the unit of y", asked, true);
    list_.number(at + "largest_difference", "1", "largest difference, in the unit of y", asked, true);
    list_.number(at + "rms_log_ratio", "1", "rms of ln(y/curve)", both(asked, given_when("all ratios are positive")));
  }

  ResultList& list_;
  std::string at_;
  const PointsOptions& points_;
};

void Chart::results(ResultList& list) const {
  for (const ChartOptions& chart : charts_) {
    const std::string at = pointer_join("", chart.name);
    list.text(at + "/caption", "text below the chart", given_if(!chart.caption.empty(), "there is a \"caption\""));
    list.truth(at + "/lead", "whether the report begins with this chart", given_if(chart.lead, "\"lead\" is true"));
    for (const PointsOptions& points : chart.points)
      PointsStatement(list, pointer_join(at, points.name), points).state();
  }
  for (const MapOptions& map : maps_) state_map(list, map);
  for (const SnapshotOptions& one : snapshots_) {
    const std::string at = pointer_join("", one.name);
    list.text(at + "/caption", "text below the picture", given_if(!one.caption.empty(), "there is a \"caption\""));
    list.number(at + "/disks", "1", "number of disks");
    list.number(at + "/empty_sites", "1", "number of empty sites of the crystal");
    list.number(at + "/disks_with_psi6_above_0.8", "1", "number of disks whose |psi_6| is 0.8 or more");
  }
}

void Chart::describe(Fields& fields) {
  fields.array<ChartOptions>(
      "charts", charts_,
      [](Fields& f, ChartOptions& chart) {
        f.text("name", chart.name, {.help = "name of the picture and of its files", .required = true});
        f.text("caption", chart.caption, {.help = "caption below the picture in the report"});
        f.text("x_label", chart.x_label, {.help = "label of the x axis, with its unit", .required = true});
        f.text("y_label", chart.y_label, {.help = "label of the y axis, with its unit", .required = true});
        f.text("residual_label", chart.residual_label, {.help = "label of the panel of residuals"});
        f.number("x_low", chart.x_low, {.help = "lower end of the x axis; left out, from the data"});
        f.number("x_high", chart.x_high, {.help = "upper end of the x axis; left out, from the data"});
        f.number("y_low", chart.y_low, {.help = "lower end of the y axis; left out, from the data"});
        f.number("y_high", chart.y_high, {.help = "upper end of the y axis; left out, from the data"});
        f.boolean("logarithmic_x", chart.logarithmic_x, {.help = "whether the x axis is logarithmic"});
        f.boolean("logarithmic_y", chart.logarithmic_y, {.help = "whether the y axis is logarithmic"});
        f.boolean("lead", chart.lead, {.help = "whether the report begins with this picture"});
        f.array<PointsOptions>("points", chart.points, describe_points,
                               {.help = "data sets that are drawn", .required = true});
        f.array<CurveOptions>(
            "curves", chart.curves,
            [](Fields& g, CurveOptions& c) {
              g.text("name", c.name, {.help = "name of the curve, for \"against\"", .required = true});
              g.text("label", c.label, {.help = "label in the key"});
              g.numbers("polynomial", c.polynomial, {.help = "coefficients, constant first", .required = true});
              g.number("exponent", c.exponent, {.help = "the polynomial is multiplied by x to this power"});
              g.number("from", c.from, {.help = "smallest x of the curve"});
              g.number("to", c.to, {.help = "largest x of the curve"});
              g.choice("look", c.look, all_looks, {.help = "how the curve is drawn; none: not drawn, only compared"});
              g.integer("color", c.color, {.help = "number of the colour in the palette, 0 to 6"});
            },
            {.help = "curves with which the points are compared: polynomials times a power of x"});
        if (!f.decoding()) return;
        f.require(!chart.name.empty() && chart.name.find_first_of("/\\ ") == std::string::npos && chart.name[0] != '.',
                  "name", fmt::format("\"{}\" cannot be the name of a file", chart.name),
                  "Use no spaces and slashes, and no dot at the beginning");
        f.require(!chart.points.empty(), "points", "\"points\" is empty: give at least one data set");
        for (std::size_t i = 0; i < chart.points.size(); ++i) {
          const std::string& against = chart.points[i].against;
          f.require(against.empty() || std::any_of(chart.curves.begin(), chart.curves.end(),
                                                   [&](const CurveOptions& c) { return c.name == against; }),
                    "points/" + std::to_string(i) + "/against", "this chart has no curve \"" + against + "\"");
        }
      },
      {.help = "charts of columns of tables"});
  fields.array<MapOptions>("maps", maps_, describe_map,
                           {.help = "maps: a column of a table as colour in the plane of two parameters"});
  fields.array<SnapshotOptions>(
      "snapshots", snapshots_,
      [](Fields& f, SnapshotOptions& s) {
        f.text("name", s.name, {.help = "name of the picture and of its files", .required = true});
        f.text("from", s.from, {.help = "id of the simulate stage whose last state is drawn", .required = true});
        f.text("caption", s.caption, {.help = "caption below the picture in the report"});
        if (f.decoding() && f.has("from")) check_snapshot(f, s);
      },
      {.help = "pictures of the disks, coloured by |psi_6|, with empty sites marked"});
  if (fields.decoding())
    fields.require(!charts_.empty() || !maps_.empty() || !snapshots_.empty(), "",
                   "there is nothing to draw: no charts, no maps, no snapshots");
}

Json Chart::draw(const RunContext& context, const ChartOptions& chart, Drawings& drawings) const {
  Picture picture = empty_picture(chart);
  Json out = Json::object();
  if (!chart.caption.empty()) out["caption"] = chart.caption;
  if (chart.lead) out["lead"] = true;
  int color = 1;
  for (const PointsOptions& options : chart.points) {
    Data data = read_data(context.input_from(options.from).file(options.file), options);
    if (data.has_errors) data.error = pooled(data.error, options.pool);
    if (options.look != Look::none) {
      const bool bars = data.has_errors && options.look == Look::points;
      const Series series{.label = options.label,
                          .style = style_of(options.look),
                          .color = options.color >= 0 ? options.color : color++,
                          .x = data.x,
                          .y = data.y,
                          .error = bars ? data.error : std::vector<double>{},
                          .markup = true};
      picture.series.push_back(series);
      if (options.residuals) add_residuals(curve_named(chart, options.against), series, picture);
    }
    out[options.name] = numbers_of(chart, options, data);
  }
  for (const CurveOptions& curve : chart.curves) {
    if (!curve.label.empty() && curve.look != Look::none) add_curve(curve, picture);
  }
  drawings.add(picture, chart.name);
  return out;
}

Json Chart::snapshot(const RunContext& context, const SnapshotOptions& options, Drawings& drawings) const {
  TrajectoryReader reader(context.input_from(options.from).file("final.extxyz"));
  TrajectoryFrame frame;
  if (!reader.read(frame))
    throw InputError(options.from + "/final.extxyz contains no frame; run the simulate stage again");
  sim::Snapshot at;
  at.x = frame.x, at.z = frame.z;
  sim::DiskProperties disks;
  disks.radius = frame.radius.empty() ? std::vector<double>(frame.size(), 0.5) : frame.radius;
  disks.mass.assign(frame.size(), 1);
  const sim::BondOrder order = sim::bond_order(at, disks, frame.periodic ? frame.width : 0, 0);
  DiskPicture picture{.width = frame.width,
                      .x = frame.x,
                      .y = frame.z,
                      .radius = disks.radius,
                      .cross_x = order.vacancy_x,
                      .cross_y = order.vacancy_z,
                      .x_label = "x/D",
                      .y_label = "z/D",
                      .color_label = "|ψ_6|",
                      .cross_label = "empty site"};
  std::size_t crystal = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    picture.color.push_back(std::hypot(order.psi6_re[i], order.psi6_im[i]));
    crystal += picture.color.back() >= 0.8;
  }
  drawings.add(picture, options.name);
  Json out{{"disks", frame.size()}, {"empty_sites", order.vacancy_x.size()}, {"disks_with_psi6_above_0.8", crystal}};
  if (!options.caption.empty()) out["caption"] = options.caption;
  return out;
}

void Chart::run(RunContext& context) const {
  Json out = Json::object();
  Drawings drawings(context.output_directory());
  for (const ChartOptions& chart : charts_) out[chart.name] = draw(context, chart, drawings);
  for (const MapOptions& map : maps_) out[map.name] = draw_map(context, map, drawings);
  for (const SnapshotOptions& one : snapshots_) out[one.name] = snapshot(context, one, drawings);
  drawings.draw();
  write_file(context.output("chart.json"), dump(out));
}

}  // namespace

StageRow chart_stage() {
  return {.name = "chart",
          .summary =
              "draws tables with fitted lines, residuals and comparisons, maps of two parameters, and snapshots of the "
              "disks",
          .accepts = {"study", "scaling", "simulate", "fit", "extract", "map"},
          .fewest_inputs = 1,
          .most_inputs = 64,
          .result = "chart.json",
          .pages = figure_pages(),
          .make = []() -> std::unique_ptr<Stage> { return std::make_unique<Chart>(); }};
}

}  // namespace shakebed::pipelines
