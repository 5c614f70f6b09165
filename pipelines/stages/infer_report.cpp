// What the pages show of an inference: pairs of parameters, and tables.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/map/gamma_temperature.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/formats/markup.hpp"
#include "pipelines/stages/figure.hpp"
#include "pipelines/stages/infer.hpp"

namespace shakebed::pipelines {

namespace {

std::string percent(double share) { return fmt::format("{:.0f} %", 100 * share); }

const std::vector<std::string> columns_of_posterior{"parameter", "prior", "median",
                                                    "68 %",      "95 %",  "reason for this prior"};

std::string parameter_rows(const Json& parameters) {
  std::string out;
  for (const auto& [name, p] : parameters.items()) {
    const auto number = [&p = p](const char* key) { return fmt::format("{:.3g}", p.at(key).get<double>()); };
    const std::string unit = p.at("unit") == "1" ? "" : " " + p.at("unit").get<std::string>();
    const auto range = [&](const char* low, const char* high) {
      return fmt::format("{} to {}{}", number(low), number(high), unit);
    };
    out += table_row(columns_of_posterior, {{escape_markup(words(name))},
                                            {range("prior_low", "prior_high")},
                                            {number("median") + unit},
                                            {range("low_68", "high_68")},
                                            {range("low_95", "high_95")},
                                            {prose(p.at("why").get<std::string>())}});
  }
  return out;
}

std::string bed_row(const std::string& name, const Json& values, const Json& targets, const std::string& view) {
  std::string text;
  for (const auto& [parameter, value] : values.items())
    text += fmt::format("{}{} {:.3g}", text.empty() ? "" : ", ", words(parameter), value.get<double>());
  std::string cells;
  for (const auto& [name_of_target, target] : targets.items()) {
    if (name_of_target == "profile") {
      const Json& most = target.at("largest_difference_in_errors");
      cells += fmt::format("<td>{}</td>", most.is_number() ? fmt::format("({:.1f} at most)", most.get<double>()) : "");
      continue;
    }
    const Json& off = target.at("difference_in_errors");
    cells += fmt::format("<td>{} ({})</td>", shown(target),
                         off.is_number() ? fmt::format("{:+.1f}", off.get<double>()) : "no fit");
  }
  return fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td>{}</tr>\n", name, escape_markup(text),
                     view == "average" ? "average" : "phase " + view, cells);
}

std::string beds_table(const Json& result) {
  if (result.at("best").empty()) return "";
  std::string head, measured;
  for (const auto& [name, target] : result.at("best")[0].at("targets").items()) {
    head += "<th>" + escape_markup(words(name)) + "</th>";
    if (name == "profile") {
      measured += fmt::format("<td>{} heights</td>", target.at("heights").get<int>());
      continue;
    }
    measured += "<td>" +
                shown(quantity_json(target.at("measured").get<double>(), target.at("unit").get<std::string>(),
                                    target.at("measured_error").get<double>())) +
                "</td>";
  }
  std::string out = "<div class=\"scroll\"><table><tr><th></th><th>parameters</th><th>photographs show</th>" + head +
                    "</tr>\n<tr><td>measured</td><td></td><td></td>" + measured + "</tr>\n";
  int number = 0;
  for (const Json& bed : result.at("best"))
    out += bed_row(fmt::format("bed {}, run again", ++number), bed.at("values"), bed.at("targets"),
                   bed.at("photographs").get<std::string>());
  if (result.at("assumed").is_object())
    out += bed_row("scene as written in the recipe", result.at("assumed").at("values"),
                   result.at("assumed").at("targets"), "average");
  return out +
         "</table></div>\n<p>In brackets: the difference from the measured number, in standard errors. The error "
         "includes the scatter of one bed and that of the measurement.</p>\n";
}

std::string inference_html(const FinishedStage& stage, int& pictures) {
  const Json& result = stage.result;
  if (!result.is_object() || !result.contains("agreement")) return "";
  std::string out =
      fmt::format("<p>{}</p>\n", escape_markup(result.at("agreement").at("statement").get<std::string>()));
  out += "<div class=\"scroll\"><table class=\"stack\">" + table_head(columns_of_posterior) +
         parameter_rows(result.at("parameters")) + "</table></div>\n";
  std::string views;
  for (const Json& view : result.at("photographs"))
    if (view.at("prior").get<double>() > 0)
      views += fmt::format("{}{}: {} (prior: {})", views.empty() ? "" : "; ",
                           view.at("show") == "average" ? "the average" : "phase " + view.at("show").get<std::string>(),
                           percent(view.at("posterior").get<double>()), percent(view.at("prior").get<double>()));
  out += "<p>Probability that the photographs show: " + views + ".</p>\n" + beds_table(result);
  const Json& first = result.at("narrowing")[0];
  out += fmt::format(
      "<p>Of all further measurements, that of {} would narrow the parameters most: it would remove {} of their "
      "variance on average.</p>\n",
      escape_markup(words(first.at("measurement").get<std::string>())), percent(first.at("reduction").get<double>()));
  return out +
         figure_html(stage.files.directory / "pairs.svg", ++pictures,
                     "The posterior of each parameter and of each pair of parameters. Points: draws from the "
                     "posterior. Crosses: the most probable beds, which were run again. Circle: the scene as written.");
}

// "restitution = 0.778 (68 %: 0.737 to 0.802)".
std::string interval_text(const std::string& name, const Json& p) {
  const auto number = [&](const char* key) { return p.at(key).get<double>(); };
  const std::string unit = p.at("unit") == "1" ? "" : " " + p.at("unit").get<std::string>();
  return fmt::format("{} = {:.3g}{} (68 %: {:.3g} to {:.3g})", words(name), number("median"), unit, number("low_68"),
                     number("high_68"));
}

std::string inference_terminal(const FinishedStage& stage) {
  const Json* statement = find_pointer(stage.result, "/agreement/statement");
  if (statement == nullptr) return "";
  std::string out;
  for (const auto& [name, p] : stage.result.at("parameters").items())
    out += fmt::format("{}: {}\n", stage.files.id, interval_text(name, p));
  return out + statement->get<std::string>() + "\n";
}

std::string inference_markdown(const FinishedStage& stage) {
  const Json* statement = find_pointer(stage.result, "/agreement/statement");
  if (statement == nullptr) return "";
  std::string out = "\n## Parameters of the bed\n\n";
  for (const auto& [name, p] : stage.result.at("parameters").items()) out += "- " + interval_text(name, p) + "\n";
  return out + "\n" + statement->get<std::string>() + "\n";
}

// Gamma against frequency where the reading gives the reduced temperature; rows "frequency gamma".
std::string map_curve(const InferOptions& options, const UnknownParameter& frequency) {
  const BedDescription bed = options.written.description();
  std::string rows;
  for (int i = 0; i <= 40; ++i) {
    const double f = frequency.low + (frequency.high - frequency.low) * i / 40;
    fit::ShakenBed shaken;
    shaken.acceleration_length = fit::acceleration_length(bed.gravity.value_or(9.81), f, bed.diameter);
    shaken.column = {bed.column_number(), options.bed.plateau_density};
    // T/T_c is what is given; T in m g D by the T_c of this column.
    const double temperature = fit::critical_temperature(fit::enskog(), shaken.column).value;
    for (const fit::GammaReading& reading :
         fit::gammas_from_temperature(options.curve->reduced_temperature * temperature, shaken)) {
      if (reading.name == options.curve->reading && reading.status == fit::ValueStatus::ok)
        rows += fmt::format("{} {}\n", f, reading.gamma);
    }
  }
  return rows;
}

// A round step of which three to six make up the range.
double tic_step(double range) {
  const double power = std::pow(10.0, std::floor(std::log10(range / 3)));
  for (const double step : {5.0, 2.0})
    if (step * power <= range / 3) return step * power;
  return power;
}

}  // namespace

// pairs.gp: marginals on the diagonal, draws below it.
namespace {

// The gnuplot commands of the plot of pairs: the draws of each parameter in the diagonal, of each two below it.
class PairPlot {
 public:
  PairPlot(RunContext& context, const InferOptions& options, std::size_t draws)
      : context_(context),
        options_(options),
        every_(std::max<std::size_t>(1, (draws + most_points - 1) / most_points)) {}

  std::string commands() {
    const std::size_t d = options_.dimensions();
    body_ = fmt::format(
        "set multiplot layout {0},{0} margins 0.1,0.98,0.1,0.98 spacing 0.03\nunset key\nset tics nomirror font "
        "tic_font\n",
        d);
    for (std::size_t row = 0; row < d; ++row) {
      for (std::size_t column = 0; column < d; ++column) {
        if (column > row) {
          body_ += "set multiplot next\n";
          continue;
        }
        set_axes(row, column);
        row == column ? add_bars(column) : add_points(row, column);
      }
    }
    return body_ + "unset multiplot\nunset output\n";
  }

 private:
  // The bars are of all draws; as points more hide one another and make the page large.
  static constexpr std::size_t most_points = 400;

  const UnknownParameter& parameter(std::size_t k) const { return options_.parameters[k].second; }
  std::string label(std::size_t k) const {
    const std::string& unit = parameter(k).unit;
    return words(options_.parameters[k].first) + (unit.empty() ? "" : " (" + unit + ")");
  }
  std::pair<double, double> ends(std::size_t k) const {
    const UnknownParameter& p = parameter(k);
    return p.is_choice() ? std::pair(-0.5, static_cast<double>(p.values.size()) - 0.5) : std::pair(p.low, p.high);
  }

  void set_axes(std::size_t row, std::size_t column) {
    body_ += row + 1 == options_.dimensions()
                 ? fmt::format("set xlabel '{}' font label_font\nset format x '%g'\n", label(column))
                 : "unset xlabel\nset format x ''\n";
    body_ += column == 0 && row > 0 ? fmt::format("set ylabel '{}' font label_font\nset format y '%g'\n", label(row))
                                    : "unset ylabel\nset format y ''\n";
    const auto [low, high] = ends(column);
    body_ += fmt::format("set xrange [{}:{}]\nset xtics {}\n", low, high, tic_step(high - low));
  }

  void add_bars(std::size_t column) {
    const auto [low, high] = ends(column);
    body_ += fmt::format(
        "set yrange [0:*]\nset ytics autofreq\nplot 'pairs.dat' index 0 using "
        "({0}+{1}*(floor((${2}-({0}))/{1})+0.5)):(1) smooth "
        "frequency with boxes fillstyle solid 0.5 noborder lc rgb '#0072B2'\n",
        low, (high - low) / 24, column + 1);
  }

  void add_points(std::size_t row, std::size_t column) {
    const UnknownParameter &x = parameter(column), &y = parameter(row);
    const auto [low, high] = ends(row);
    body_ += fmt::format(
        "set yrange [{}:{}]\nset ytics {}\nplot 'pairs.dat' index 0 every {} using {}:{} with points pt 7 ps 0.2 lc "
        "rgb '#0072B2', "
        "'pairs.dat' index 1 using {}:{} with points pt 2 ps 0.8 lw 2 lc rgb '#D55E00'",
        low, high, tic_step(high - low), every_, column + 1, row + 1, column + 1, row + 1);
    const auto a = x.in_scene(options_.bed.scene), b = y.in_scene(options_.bed.scene);
    if (a && b)
      body_ += fmt::format(", '+' using ({}):({}) every ::0::0 with points pt 6 ps 1 lw 2 lc rgb '#000000'", *a, *b);
    const bool shaking = x.set.front() == "/floor/frequency" && y.set.front() == "/floor/gamma",
               turned = x.set.front() == "/floor/gamma" && y.set.front() == "/floor/frequency";
    if (options_.curve && (shaking || turned)) {
      write_file(context_.output("map-curve.dat"), map_curve(options_, shaking ? x : y));
      body_ += fmt::format(", 'map-curve.dat' using {} with lines lw 2 lc rgb '#009E73'", shaking ? "1:2" : "2:1");
    }
    body_ += "\n";
  }

  RunContext& context_;
  const InferOptions& options_;
  std::size_t every_;
  std::string body_;
};

}  // namespace

void draw_pairs(RunContext& context, const InferOptions& options, const Inference& found) {
  std::string draws, best;
  for (const std::size_t i : found.draws) {
    for (const double value : values_at(options, found.posterior.point(i))) draws += number_text(value) + " ";
    draws += "\n";
  }
  for (const BestBed& bed : found.best) {
    for (const double value : bed.values) best += number_text(value) + " ";
    best += "\n";
  }
  write_file(context.output("pairs.dat"), draws + "\n\n" + (best.empty() ? "NaN\n" : best));
  const std::string body = PairPlot(context, options, found.draws.size()).commands();
  Drawings drawings(context.output_directory());
  drawings.add_script(
      "pairs",
      "set encoding utf8\ntic_font = ',14'\nlabel_font = ',15'\nset terminal svg size 700,700 noenhanced font "
      "'Helvetica,14' background '#ffffff'\nset output 'pairs.svg'\n" +
          body +
          "reset\ntic_font = ',9'\nlabel_font = ',11'\nset terminal pdfcairo size 17.2cm,17.2cm noenhanced "
          "font 'Helvetica,9' background "
          "'#ffffff'\nset output 'pairs.pdf'\n" +
          body);
  drawings.draw();
}

StagePages infer_pages() {
  return {.sections = {{ReportPlace::claims, "What the measured numbers say about the bed", inference_html}},
          .markdown = inference_markdown,
          .terminal = inference_terminal};
}

}  // namespace shakebed::pipelines
