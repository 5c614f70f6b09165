#include "ingest/profile/shaking_frequency.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

constexpr double whole_turn = 2 * std::numbers::pi;
constexpr std::size_t fewest_frames = 24;
constexpr double oversampling = 5;  // of the frequencies tried
constexpr double fewest_cycles = 3;
// A bed's bottom does not repeat exactly, which few cycles do not show. In 646 films of 3.5 to 40 cycles of 40
// simulated beds the frequency was off by hypot(1.3, 12/cycles) errors of the residuals (root mean square).
constexpr double unlike_noise = 1.3, few_cycles = 12;
// A line that noise makes as often as that is not worth naming.
constexpr double clearly_chance = 0.5;

// Time from the middle of the film [frames] and place; without the straight line through them.
struct Series {
  std::vector<double> time, place;
  double middle = 0;  // of the film [frames]
  double length = 0;  // of the film [frames]
};

Series without_trend(const std::vector<PlaceInFrame>& places, std::size_t count) {
  Series series;
  if (count == 0) return series;
  const double first = static_cast<double>(places.front().frame), last = static_cast<double>(places[count - 1].frame);
  series.middle = 0.5 * (first + last);
  series.length = last - first + 1;
  double mean_t = 0, mean = 0;
  for (std::size_t k = 0; k < count; ++k) {
    series.time.push_back(static_cast<double>(places[k].frame) - series.middle);
    series.place.push_back(places[k].place);
    mean_t += series.time[k] / static_cast<double>(count);
    mean += series.place[k] / static_cast<double>(count);
  }
  double tt = 0, tp = 0;
  for (std::size_t k = 0; k < count; ++k) {
    tt += (series.time[k] - mean_t) * (series.time[k] - mean_t);
    tp += (series.time[k] - mean_t) * (series.place[k] - mean);
  }
  const double slope = tt > 0 ? tp / tt : 0;
  for (std::size_t k = 0; k < count; ++k) series.place[k] -= mean + slope * (series.time[k] - mean_t);
  return series;
}

// Half of what a sinusoid takes from the sum of squares: for white noise its variance, on average [Lomb].
double power_at(const Series& series, double frequency) {
  double cc = 0, ss = 0, cs = 0, pc = 0, ps = 0;
  // The angle goes on by equal steps where no frame is missing.
  const double turn = whole_turn * frequency, step_c = std::cos(turn), step_s = std::sin(turn);
  double c = 1, s = 0, at = 0;
  constexpr std::size_t afresh = 64;
  for (std::size_t k = 0; k < series.time.size(); ++k) {
    if (k % afresh != 0 && series.time[k] == at + 1) {
      const double next = c * step_c - s * step_s;
      s = s * step_c + c * step_s;
      c = next;
    } else {
      c = std::cos(turn * series.time[k]);
      s = std::sin(turn * series.time[k]);
    }
    at = series.time[k];
    cc += c * c, ss += s * s, cs += c * s;
    pc += series.place[k] * c, ps += series.place[k] * s;
  }
  const double determinant = cc * ss - cs * cs;
  if (!(determinant > 1e-9 * (cc + ss) * (cc + ss))) return 0;
  return 0.5 * (pc * pc * ss - 2 * pc * ps * cs + ps * ps * cc) / determinant;
}

// The power that noise would have at a line's place, from what lies beside it at whole numbers of 1/length, where the
// line itself leaks nothing: powers are taken to go as a power of the frequency there, which what wanders does.
struct Neighbourhood {
  bool known = false;
  double level = 0;
  double count = 0;  // of neighbours that would tell as much of an even noise
};
Neighbourhood beside(const Series& series, double frequency) {
  constexpr int nearest = 2, farthest = 11, fewest = 5;
  // The logarithm of an exponential deviate of mean 1.
  constexpr double its_mean = -0.5772156649, its_variance = std::numbers::pi * std::numbers::pi / 6;
  double n = 0, x1 = 0, x2 = 0, y1 = 0, xy = 0;
  for (int k = nearest; k <= farthest; ++k)
    for (const double side : {-1.0, 1.0}) {
      const double place = frequency + side * k / series.length;
      if (place < 0.9 / series.length || place > 0.5 - 0.9 / series.length) continue;
      const double x = std::log(place / frequency), y = std::log(std::max(power_at(series, place), 1e-290)) - its_mean;
      n += 1, x1 += x, x2 += x * x, y1 += y, xy += x * y;
    }
  Neighbourhood found;
  const double determinant = n * x2 - x1 * x1;
  if (n < fewest || !(determinant > 0)) return found;
  found.known = true;
  found.level = std::exp((x2 * y1 - x1 * xy) / determinant);
  found.count = determinant / (x2 * its_variance);
  return found;
}

// The chance that noise has such a power at one place.
double chance_of(const Series& series, double frequency, double power) {
  const Neighbourhood near = beside(series, frequency);
  return near.known ? std::pow(1 + power / near.level / near.count, -near.count) : 1.0;
}

// A line that was fitted, and what is left of the series without it.
struct LineFit {
  bool good = false;
  double frequency = 0, variance = 0;  // the latter per unit of the noise's variance
  double amplitude = 0, phase = 0;     // at the middle of the film
  Series left;                         // what the fit leaves
};

// Terms of a model of a line: a constant, a drift, up to three tones, and the derivative of the first tone by
// frequency.
struct LineTerms {
  static constexpr std::size_t most = 9;
  double frequency, length;     // [cycles per frame, frames]
  double sine = 0, cosine = 0;  // amplitudes of the first tone
  std::size_t tones = 1 + (2 * frequency < 0.5 - 1 / length) + (3 * frequency < 0.5 - 1 / length);
  std::size_t count = 3 + 2 * tones;

  void at(double t, double* row) const {
    row[0] = 1;
    row[1] = t / length;
    for (std::size_t k = 0; k < tones; ++k) {
      const double angle = whole_turn * static_cast<double>(k + 1) * frequency * t;
      row[2 + 2 * k] = std::sin(angle);
      row[3 + 2 * k] = std::cos(angle);
    }
    row[count - 1] = whole_turn * t * (sine * row[3] - cosine * row[2]);
  }
};

// The fit's normal equations with the first `used` terms.
void sum_up(const Series& series, const LineTerms& terms, std::size_t used, std::vector<double>& square,
            std::vector<double>& right) {
  double row[LineTerms::most];
  square.assign(used * used, 0.0), right.assign(used, 0.0);
  for (std::size_t k = 0; k < series.time.size(); ++k) {
    terms.at(series.time[k], row);
    for (std::size_t a = 0; a < used; ++a) {
      right[a] += row[a] * series.place[k];
      for (std::size_t b = 0; b < used; ++b) square[a * used + b] += row[a] * row[b];
    }
  }
  for (std::size_t a = 0; a < used; ++a) square[a * used + a] *= 1 + 1e-12;
}

// Least squares of middle, trend, a line at `frequency` with its overtones and, by the line's slope, its frequency.
LineFit fit_line(const Series& series, double frequency) {
  LineFit fit;
  LineTerms terms{frequency, series.length};
  std::vector<double> square, right, factor;
  fit.left = series;
  for (int round = 0; round < 12; ++round) {
    const bool with_frequency = round > 0;  // the first round tells sine and cosine
    const std::size_t used = with_frequency ? terms.count : terms.count - 1;
    sum_up(series, terms, used, square, right);
    factor = square;
    if (!solve_symmetric(factor, right, used)) return fit;
    terms.sine = right[2], terms.cosine = right[3];
    double change = 0;
    if (with_frequency) {
      change = std::clamp(right[used - 1], -0.3 / series.length, 0.3 / series.length);
      terms.frequency += change;
      std::vector<double> unit(used, 0.0);
      unit[used - 1] = 1;
      if (!solve_symmetric(square, unit, used)) return fit;
      fit.variance = unit[used - 1];
      for (std::size_t k = 0; k < series.time.size(); ++k) {
        double row[LineTerms::most], model = 0;
        terms.at(series.time[k], row);
        for (std::size_t a = 0; a + 1 < used; ++a) model += right[a] * row[a];
        fit.left.place[k] = series.place[k] - model;
      }
    }
    if (round > 1 && std::abs(change) < 1e-7 / series.length) break;
  }
  if (!(terms.frequency > 0 && terms.frequency < 0.5)) return fit;
  fit.good = true;
  fit.frequency = terms.frequency;
  fit.amplitude = std::hypot(terms.sine, terms.cosine);
  fit.phase = std::atan2(terms.cosine, terms.sine) / whole_turn;
  return fit;
}

// A line near `frequency`, fitted, with the error that what lies beside it allows.
FoundFrequency line_near(const Series& series, double frequency) {
  FoundFrequency found;
  const LineFit fit = fit_line(series, frequency);
  if (!fit.good || std::abs(fit.frequency - frequency) > 1.5 / series.length) {
    found.why_not = "a fit does not confirm the strongest line of the periodogram";
    return found;
  }
  found.known = true;
  found.cycles_per_frame = fit.frequency;
  found.amplitude = fit.amplitude;
  // Of white noise that the grey levels' steps alone would leave, at least.
  const double noise = std::max(beside(fit.left, fit.frequency).level, 1e-8 * fit.amplitude * fit.amplitude);
  found.std_error =
      std::sqrt(fit.variance * noise) * std::hypot(unlike_noise, few_cycles / (fit.frequency * series.length));
  const double turns = fit.phase - fit.frequency * series.middle;
  found.phase = turns - std::floor(turns);
  return found;
}

}  // namespace

FoundFrequency find_frequency(const std::vector<PlaceInFrame>& places) {
  FoundFrequency found;
  if (places.size() < fewest_frames) {
    found.why_not = "there are only " + std::to_string(places.size()) + " usable frames, but at least " +
                    std::to_string(fewest_frames) + " are needed";
    return found;
  }
  constexpr std::size_t most_frames = 2048;  // the rest refines it
  const std::size_t count = std::min(places.size(), most_frames);
  const Series series = without_trend(places, count);
  double best = 0, highest = -1;
  const double step = 1 / (oversampling * series.length), from = fewest_cycles / series.length,
               to = 0.5 - 1.5 / series.length;
  std::vector<double> powers;
  for (double frequency = from; frequency < to; frequency += step) powers.push_back(power_at(series, frequency));
  // Each line is compared with its own neighbourhood. The strongest line that is significant is the first tone.
  double likeliest = 1, likeliest_at = 0, false_alarm = 1;
  for (std::size_t k = 0; k < powers.size(); ++k) {
    if ((k > 0 && powers[k - 1] > powers[k]) || (k + 1 < powers.size() && powers[k + 1] >= powers[k])) continue;
    const double frequency = from + static_cast<double>(k) * step;
    if (!(powers[k] > 0)) continue;
    const double once = chance_of(series, frequency, powers[k]);
    const double chance = std::min(1.0, once * static_cast<double>(powers.size()));
    if (chance < likeliest) likeliest = chance, likeliest_at = frequency;
    if (chance > most_false_alarm || powers[k] <= highest) continue;
    highest = powers[k];
    best = frequency;
    false_alarm = chance;
  }
  if (!(highest > 0)) {
    char text[200];
    std::snprintf(
        text, sizeof text,
        "noise alone gives a line as strong as the strongest one, at %.4f cycles per frame, with a probability of %.2g",
        likeliest_at, likeliest);
    found.why_not = likeliest < clearly_chance ? text : "the height of the lowest beads shows no period";
    found.false_alarm = likeliest;
    return found;
  }
  found = line_near(series, best);
  found.false_alarm = false_alarm;
  return found;
}

FoundFrequency refine_frequency(const std::vector<PlaceInFrame>& places, const FoundFrequency& from_beginning) {
  FoundFrequency found = from_beginning;
  if (!found.known || places.size() < fewest_frames) return found;
  // Stretches twice as long each time, so that no cycle is lost.
  for (std::size_t count = std::min<std::size_t>(places.size(), 2 * fewest_frames);;
       count = std::min(places.size(), 2 * count)) {
    const Series series = without_trend(places, count);
    const double reach = std::max(0.5 / series.length, 3 * found.std_error), step = 1 / (8 * series.length);
    double best = found.cycles_per_frame, highest = -1;
    for (double frequency = found.cycles_per_frame - reach; frequency <= found.cycles_per_frame + reach;
         frequency += step)
      if (const double here = power_at(series, frequency); here > highest) highest = here, best = frequency;
    FoundFrequency longer = line_near(series, best);
    if (longer.known) {
      longer.false_alarm = found.false_alarm;
      if (longer.std_error <= found.std_error || count == places.size()) found = longer;
    }
    if (count == places.size()) break;
  }
  return found;
}

}  // namespace shakebed::ingest
