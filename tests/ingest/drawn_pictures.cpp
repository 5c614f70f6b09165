#include "tests/ingest/drawn_pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/ingest/drawing.hpp"

namespace shakebed::ingest::test {

namespace {

using namespace drawing;

// Levels of what is drawn and of what is behind it, either of which may be the brighter.
struct Tones {
  double paper = 0, ink = 0;
};
Tones tones(std::mt19937& random) {
  const double dark = between(random, 20, 90), light = between(random, 150, 240);
  return coin(random) ? Tones{light, dark} : Tones{dark, light};
}

std::vector<Point> lattice(std::mt19937& random, double step_x, double step_y) {
  std::vector<Point> places;
  const bool staggered = coin(random);
  const double left = between(random, 0, step_x), top = between(random, 0, step_y);
  for (int row = -1; top + row * step_y < height + step_y; ++row)
    for (int column = -1; left + column * step_x < width + step_x; ++column)
      places.push_back({left + step_x * (column + (staggered && row % 2 != 0 ? 0.5 : 0.0)), top + row * step_y});
  return places;
}

std::vector<Point> at_random(std::mt19937& random, double apart, std::size_t count) {
  std::vector<Point> places;
  for (int tries = 0; tries < 6000 && places.size() < count; ++tries) {
    const Point place{between(random, 0, width), between(random, 0, height)};
    if (std::none_of(places.begin(), places.end(),
                     [&](const Point& other) { return std::hypot(other.x - place.x, other.y - place.y) < apart; }))
      places.push_back(place);
  }
  return places;
}

// One outline many times: on a lattice or at random, all turned alike or each by itself.
GrayFrame many_of(std::mt19937& random, const Outline& outline, bool on_lattice, bool turned_alike) {
  double reach = 0, wide = 0, high = 0;
  const double common = between(random, 0, 2 * pi);
  for (const Point& point : moved(outline, {}, turned_alike ? common : 0)) {
    reach = std::max(reach, std::hypot(point.x, point.y));
    wide = std::max(wide, std::abs(point.x));
    high = std::max(high, std::abs(point.y));
  }
  if (!turned_alike) wide = high = reach;
  const double gap = between(random, 1.02, 1.5);
  const std::vector<Point> places = on_lattice ? lattice(random, 2 * wide * gap, 2 * high * gap)
                                               : at_random(random, 2 * reach * gap, 20 + random() % 100);
  const Tones level = tones(random);
  Canvas canvas(level.paper);
  for (const Point& place : places)
    canvas.fill(moved(outline, place, turned_alike ? common : between(random, 0, 2 * pi)), level.ink);
  return canvas.seen(random);
}

Outline some_oval(std::mt19937& random) {
  const double a = between(random, 8, 22);
  return oval(a, a / between(random, 1.25, 2.4));
}
double some_size(std::mt19937& random) { return between(random, 7, 20); }

// Random numbers are drawn in this order: compilers evaluate arguments of a call in different orders.
GrayFrame many_somehow(std::mt19937& random, const std::function<Outline()>& outline) {
  const bool turned_alike = coin(random), on_lattice = coin(random);
  return many_of(random, outline(), on_lattice, turned_alike);
}

// Noise with a power spectrum that falls as k^-exponent, or within a band of wavelengths; mean 0, rms 1.
cv::Mat coloured_noise(std::mt19937& random, double exponent, double shortest_px, double longest_px) {
  const int side = 512;
  cv::Mat spectrum(side, side, CV_32FC2);
  for (int row = 0; row < side; ++row)
    for (int column = 0; column < side; ++column) {
      const double ky = row < side / 2 ? row : row - side, kx = column < side / 2 ? column : column - side;
      const double k = std::hypot(kx, ky), wavelength = k > 0 ? side / k : 1e9;
      const bool inside = wavelength >= shortest_px && wavelength <= longest_px;
      const double size = inside ? std::pow(k, -0.5 * exponent) : 0;
      spectrum.at<cv::Vec2f>(row, column) = {static_cast<float>(size * normal(random)),
                                             static_cast<float>(size * normal(random))};
    }
  cv::Mat noise;
  cv::dft(spectrum, noise, cv::DFT_INVERSE | cv::DFT_REAL_OUTPUT | cv::DFT_SCALE);
  cv::Scalar mean, rms;
  cv::meanStdDev(noise, mean, rms);
  return (noise - mean) / std::max(1e-30, rms[0]);
}
double level_in(const cv::Mat& field, double x, double y) {
  const double u = std::clamp(x, 0.0, field.cols - 1.001), v = std::clamp(y, 0.0, field.rows - 1.001);
  const int column = static_cast<int>(u), row = static_cast<int>(v);
  const double right = u - column, down = v - row;
  return (1 - down) * ((1 - right) * static_cast<double>(field.at<float>(row, column)) +
                       right * static_cast<double>(field.at<float>(row, column + 1))) +
         down * ((1 - right) * static_cast<double>(field.at<float>(row + 1, column)) +
                 right * static_cast<double>(field.at<float>(row + 1, column + 1)));
}

GrayFrame cloudy(std::mt19937& random, double exponent) {
  const cv::Mat noise = coloured_noise(random, exponent, 2, 1e6);
  const double depth = between(random, 25, 55);
  Canvas canvas(0);
  canvas.paint([&](double x, double y) { return 128 + depth * level_in(noise, x, y); });
  return canvas.seen(random);
}

// Two levels, where a field lies above and below a threshold.
GrayFrame cut_at(std::mt19937& random, const cv::Mat& field, double threshold) {
  const Tones level = tones(random);
  Canvas canvas(0);
  canvas.paint([&](double x, double y) { return level_in(field, x, y) > threshold ? level.ink : level.paper; });
  return canvas.seen(random);
}

// Nearest and second nearest of the seeds.
struct Nearest {
  std::size_t which = 0;
  double first = 1e9, second = 1e9;
};
Nearest nearest_of(const std::vector<Point>& seeds, double x, double y) {
  Nearest nearest;
  for (std::size_t k = 0; k < seeds.size(); ++k) {
    const double away = std::hypot(seeds[k].x - x, seeds[k].y - y);
    if (away < nearest.first) {
      nearest.second = nearest.first;
      nearest.first = away;
      nearest.which = k;
    } else {
      nearest.second = std::min(nearest.second, away);
    }
  }
  return nearest;
}
std::vector<Point> cell_seeds(std::mt19937& random) {
  const double apart = between(random, 14, 34);
  return at_random(random, apart, 400);
}

// A curve that wanders.
Outline wandering(std::mt19937& random, double length, double bend) {
  Outline path = {{between(random, 0, width), between(random, 0, height)}};
  double angle = between(random, 0, 2 * pi), turn = 0;
  for (double gone = 0; gone < length; gone += 2) {
    turn = 0.9 * turn + bend * normal(random);
    angle += turn;
    path.push_back({path.back().x + 2 * std::cos(angle), path.back().y + 2 * std::sin(angle)});
  }
  return path;
}

std::string words(std::mt19937& random, const std::string& letters, std::size_t count) {
  std::string text;
  for (std::size_t k = 0; k < count; ++k) text += random() % 6 == 0 ? ' ' : letters[random() % letters.size()];
  return text;
}

GrayFrame printed(std::mt19937& random, const std::string& letters) {
  const Tones level = tones(random);
  Canvas canvas(level.paper);
  const double size = between(random, 7, 26);
  constexpr std::array<int, 4> fonts = {cv::FONT_HERSHEY_SIMPLEX, cv::FONT_HERSHEY_DUPLEX, cv::FONT_HERSHEY_TRIPLEX,
                                        cv::FONT_HERSHEY_COMPLEX};
  const int font = fonts[random() % fonts.size()], thickness = 1 + static_cast<int>(random() % 3);
  for (double y = 1.5 * size; y < height; y += 1.7 * size)
    canvas.text(words(random, letters, 60), {10, y}, size, level.ink, thickness, font);
  return canvas.seen(random);
}

// Axes, ticks, numbers, and curves or marks.
GrayFrame plotted(std::mt19937& random, int marks) {
  Canvas canvas(250);
  const Outline frame = {{45, 20}, {400, 20}, {400, 320}, {45, 320}};
  canvas.stroke(frame, 1.5, 20, true);
  for (int k = 0; k < 8; ++k) {
    canvas.stroke({{45 + 45.0 * k, 320}, {45 + 45.0 * k, 313}}, 1, 20, false);
    canvas.text(std::to_string(k), {42 + 45.0 * k, 336}, 9, 20, 1, cv::FONT_HERSHEY_SIMPLEX);
    if (coin(random)) canvas.stroke({{45, 30 + 40.0 * k}, {400, 30 + 40.0 * k}}, 0.7, 200, false);
  }
  const int curves = 2 + static_cast<int>(random() % 4);
  for (int c = 0; c < curves; ++c) {
    const double wave = between(random, 20, 70), high = between(random, 20, 110), middle = between(random, 120, 220);
    const double level = between(random, 10, 150), size = between(random, 3, 8);
    Outline curve;
    for (double x = 50; x<398; x += marks> 0 ? 14 : 2)
      curve.push_back({x, middle - high * std::sin(x / wave) + (marks > 0 ? 6 * normal(random) : 0)});
    if (marks == 0 || coin(random)) canvas.stroke(curve, between(random, 1, 2.5), level, false);
    for (const Point& point : curve) {
      if (marks == 1) canvas.fill(moved(box(size, size), point), level);
      if (marks == 2) canvas.fill(moved(polygon(3, 1.3 * size), point, -pi / 2), level);
      if (marks == 3) canvas.fill(moved(cross(1.2 * size, 0.25 * size), point, pi / 4), level);
    }
  }
  return canvas.seen(random);
}

GrayFrame landscape(std::mt19937& random) {
  const cv::Mat noise = coloured_noise(random, between(random, 2, 3.2), 2, 1e6);
  const cv::Mat ridge = coloured_noise(random, 2.4, 4, 1e6);
  const double horizon = between(random, 100, 220), rough = between(random, 10, 40);
  Canvas canvas(0);
  canvas.paint([&](double x, double y) {
    const double line = horizon + rough * level_in(ridge, x, 10);
    return y < line ? 215 - 0.15 * y + 8 * level_in(noise, x, y) : 90 + 40 * level_in(noise, x, 1.6 * y - line);
  });
  return canvas.seen(random);
}

GrayFrame houses(std::mt19937& random) {
  Canvas canvas(between(random, 170, 230));
  for (double left = -10; left < width;) {
    const double wide = between(random, 40, 110), top = between(random, 30, 200), wall = between(random, 40, 130);
    canvas.fill({{left, top}, {left + wide, top}, {left + wide, height + 5.0}, {left, height + 5.0}}, wall);
    const double pane = between(random, 5, 11), step = pane * between(random, 2.2, 3);
    for (double y = top + step; y < height; y += 1.3 * step)
      for (double x = left + step; x + step < left + wide; x += step)
        canvas.fill(moved(box(pane * 0.8, pane), {x, y}), random() % 4 == 0 ? 240 : 20);
    left += wide;
  }
  return canvas.seen(random);
}

GrayFrame bricks(std::mt19937& random) {
  Canvas canvas(between(random, 150, 220));
  const double wide = between(random, 20, 50), high = wide / between(random, 1.6, 3), joint = between(random, 1, 3);
  for (int row = 0; row * high < height + high; ++row)
    for (int column = -1; column * wide < width + wide; ++column)
      canvas.fill(
          moved(box(0.5 * wide - joint, 0.5 * high - joint), {wide * (column + (row % 2 ? 0.5 : 0.0)), high * row}),
          between(random, 50, 120));
  return canvas.seen(random);
}

GrayFrame branches(std::mt19937& random) {
  Canvas canvas(between(random, 180, 230));
  struct Twig {
    Point at;
    double angle, length, thick;
  };
  std::vector<Twig> twigs = {{{width / 2.0, height - 5.0}, -pi / 2, 80, 14}, {{60, height - 5.0}, -pi / 2.2, 70, 10}};
  while (!twigs.empty()) {
    const Twig twig = twigs.back();
    twigs.pop_back();
    const Point end{twig.at.x + twig.length * std::cos(twig.angle), twig.at.y + twig.length * std::sin(twig.angle)};
    canvas.stroke({twig.at, end}, twig.thick, 40, false);
    if (twig.length < 9) continue;
    for (int k = 0; k < 3; ++k)
      twigs.push_back({end, twig.angle + between(random, -0.8, 0.8), twig.length * between(random, 0.55, 0.8),
                       std::max(1.0, 0.6 * twig.thick)});
  }
  return canvas.seen(random);
}

GrayFrame circuit(std::mt19937& random) {
  Canvas canvas(between(random, 50, 90));
  for (int k = 0; k < 60; ++k) {
    const Point from{between(random, 0, width), between(random, 0, height)};
    const double run = between(random, -150, 150), rise = between(random, -100, 100);
    canvas.stroke({from, {from.x + run, from.y}, {from.x + run, from.y + rise}}, between(random, 1, 4), 170, false);
  }
  for (int k = 0; k < 25; ++k) {
    const Point at{between(random, 0, width), between(random, 0, height)};
    const double a = between(random, 8, 30), b = between(random, 6, 20);
    for (double x = -a + 3; x < a; x += 6) canvas.fill(moved(box(1.5, b + 4), {at.x + x, at.y}), 220);
    canvas.fill(moved(box(a, b), at), 20);
  }
  return canvas.seen(random);
}

GrayFrame honeycomb(std::mt19937& random) {
  const double radius = between(random, 8, 22), wall = between(random, 0.82, 0.95);
  const Tones level = tones(random);
  Canvas canvas(level.paper);
  const double step = std::sqrt(3.0) * radius;
  for (int row = -1; 1.5 * radius * row < height + radius; ++row)
    for (int column = -1; step * column < width + step; ++column)
      canvas.fill(
          moved(polygon(6, wall * radius), {step * (column + (row & 1 ? 0.5 : 0.0)), 1.5 * radius * row}, pi / 6),
          level.ink);
  return canvas.seen(random);
}

GrayFrame pieces_of_glass(std::mt19937& random, bool outlines_only) {
  const std::vector<Point> seeds = cell_seeds(random);
  std::vector<double> levels;
  for (std::size_t k = 0; k < seeds.size(); ++k) levels.push_back(between(random, 30, 230));
  const Tones level = tones(random);
  const double wall = between(random, 1.5, 4);
  Canvas canvas(0);
  canvas.paint([&](double x, double y) {
    const Nearest nearest = nearest_of(seeds, x, y);
    if (outlines_only) return nearest.second - nearest.first < wall ? level.ink : level.paper;
    return levels[nearest.which];
  });
  return canvas.seen(random);
}

GrayFrame worms(std::mt19937& random, int count, double length, double bend) {
  const Tones level = tones(random);
  Canvas canvas(level.paper);
  const double thick = between(random, 5, 16);
  for (int k = 0; k < count; ++k) canvas.stroke(wandering(random, length, bend), thick, level.ink, false);
  return canvas.seen(random);
}

GrayFrame mixed_polygons(std::mt19937& random) {
  const Tones level = tones(random);
  Canvas canvas(level.paper);
  const double size = between(random, 9, 20);
  for (const Point& place : at_random(random, 2.1 * size, 80)) {
    Outline outline;
    double angle = between(random, 0, 2 * pi);
    const int corners = 3 + static_cast<int>(random() % 3);
    for (int k = 0; k < corners; ++k) {
      angle += 2 * pi / corners * between(random, 0.7, 1.3);
      outline.push_back({size * std::cos(angle), size * std::sin(angle)});
    }
    canvas.fill(moved(outline, place), level.ink);
  }
  return canvas.seen(random);
}

GrayFrame waves(std::mt19937& random, int count) {
  std::vector<std::array<double, 3>> all;
  for (int k = 0; k < count; ++k)
    all.push_back({between(random, -0.5, 0.5), between(random, -0.5, 0.5), between(random, 0, 2 * pi)});
  Canvas canvas(0);
  canvas.paint([&](double x, double y) {
    double sum = 0;
    for (const auto& [kx, ky, phase] : all) sum += std::sin(kx * x + ky * y + phase);
    return 128 + 60 * sum / std::sqrt(static_cast<double>(count));
  });
  return canvas.seen(random);
}

// Places of beads: scattered, or a crystal whose disks nearly touch with some scattered around it.
std::vector<Point> places_of_beads(std::mt19937& random, double radius) {
  std::vector<Point> places;
  const double gap = between(random, 1.005, 1.05), turn = between(random, 0, pi);
  if (coin(random)) {
    for (int row = -4; row <= 4; ++row)
      for (int column = -4; column <= 4; ++column) {
        const double x = 2 * gap * radius * (column + (row & 1 ? 0.5 : 0.0)), y = std::sqrt(3.0) * gap * radius * row;
        const Point place{210 + std::cos(turn) * x - std::sin(turn) * y, 180 + std::sin(turn) * x + std::cos(turn) * y};
        if (place.x > radius && place.y > radius && place.x < width - radius && place.y < height - radius)
          places.push_back(place);
      }
  }
  for (const Point& place : at_random(random, 2 * gap * radius, 400)) {
    const bool inside = place.x > 1.2 * radius && place.y > 1.2 * radius && place.x < width - 1.2 * radius &&
                        place.y < height - 1.2 * radius;
    if (inside && places.size() < 120 && std::none_of(places.begin(), places.end(), [&](const Point& other) {
          return std::hypot(other.x - place.x, other.y - place.y) < 2 * gap * radius;
        }))
      places.push_back(place);
  }
  return places;
}

// `level_at(rho, angle, bead)` is the share of the ink at a place of a bead, rho in radii; aspect stretches the picture
// along x.
template <class InkAt>
DrawnBeads beads_of(std::mt19937& random, double radius, const InkAt& ink_at, double aspect = 1) {
  DrawnBeads drawn;
  drawn.radius_px = radius;
  const std::vector<Point> places = places_of_beads(random, radius * aspect);
  const Tones level = tones(random);
  cv::Mat ink(fine * height, fine * width, CV_32F, cv::Scalar(level.paper));
  for (std::size_t k = 0; k < places.size(); ++k) {
    const Point& place = places[k];
    drawn.centres_px.push_back({place.x, place.y});
    const int reach = static_cast<int>(fine * (radius * aspect + 2));
    const int middle_x = static_cast<int>(fine * place.x), middle_y = static_cast<int>(fine * place.y);
    for (int row = std::max(0, middle_y - reach); row < std::min(ink.rows, middle_y + reach); ++row)
      for (int column = std::max(0, middle_x - reach); column < std::min(ink.cols, middle_x + reach); ++column) {
        const double u = ((column + 0.5) / fine - 0.5 - place.x) / (radius * aspect);
        const double v = ((row + 0.5) / fine - 0.5 - place.y) / radius, rho = std::hypot(u, v);
        if (rho < 1)
          ink.at<float>(row, column) =
              static_cast<float>(level.paper + (level.ink - level.paper) * ink_at(rho, std::atan2(v, u), k));
      }
  }
  Canvas canvas(0);
  canvas.show(ink);
  drawn.frame = canvas.seen(random);
  return drawn;
}

}  // namespace

const std::vector<BeadLook>& pictures_with_beads() {
  using Random = std::mt19937;
  static const std::vector<BeadLook> looks = {
      {"flat",
       [](Random& r) { return beads_of(r, between(r, 5, 18), [](double, double, std::size_t) { return 1.0; }); }},
      {"stretched",
       [](Random& r) {
         const double aspect = between(r, 0.96, 1.04);
         return beads_of(
             r, between(r, 5, 18), [](double, double, std::size_t) { return 1.0; }, aspect);
       }},
      {"shaded",
       [](Random& r) {
         const double depth = between(r, 0.2, 0.6);
         return beads_of(r, between(r, 6, 18),
                         [=](double rho, double, std::size_t) { return 1 - depth * std::sqrt(1 - rho * rho); });
       }},
      {"with a highlight",
       [](Random& r) {
         const double size = between(r, 0.2, 0.4);
         return beads_of(r, between(r, 7, 18), [=](double rho, double angle, std::size_t) {
           return std::hypot(rho * std::cos(angle) + 0.3, rho * std::sin(angle) + 0.3) < size ? 0.1 : 1.0;
         });
       }},
      {"fringed",
       [](Random& r) {
         const double wave = between(r, 4, 9);
         return beads_of(r, between(r, 12, 20), [=](double rho, double angle, std::size_t bead) {
           const double u = rho * std::cos(angle), v = rho * std::sin(angle), phase = static_cast<double>(bead);
           return 0.65 + 0.35 * std::sin(wave * u * v + phase) * std::cos(0.5 * wave * u + 2 * phase);
         });
       }},
      {"glass: a dark rim and a bright core",
       [](Random& r) {
         const double inner = between(r, 0.55, 0.75);
         return beads_of(r, between(r, 8, 18),
                         [=](double rho, double, std::size_t) { return rho < inner ? 0.1 : 1.0; });
       }},
      {"of uneven brightness",
       [](Random& r) {
         return beads_of(r, between(r, 6, 16), [](double, double, std::size_t bead) {
           return 0.6 + 0.4 * std::sin(12.9 * static_cast<double>(bead) + 1);
         });
       }},
      {"lit from one side",
       [](Random& r) {
         const double from = between(r, 0, 2 * pi), depth = between(r, 0.2, 0.45);
         return beads_of(r, between(r, 7, 18), [=](double rho, double angle, std::size_t) {
           return 1 - depth + depth * rho * std::cos(angle - from);
         });
       }},
  };
  return looks;
}

const std::vector<DrawnKind>& pictures_without_beads() {
  using Random = std::mt19937;
  static const std::vector<DrawnKind> kinds = {
      {"ovals on a lattice, turned alike", [](Random& r) { return many_of(r, some_oval(r), true, true); }},
      {"ovals on a lattice, turned at random", [](Random& r) { return many_of(r, some_oval(r), true, false); }},
      {"ovals at random, turned alike", [](Random& r) { return many_of(r, some_oval(r), false, true); }},
      {"ovals at random, turned at random", [](Random& r) { return many_of(r, some_oval(r), false, false); }},
      {"squares on a lattice",
       [](Random& r) {
         const double a = some_size(r);
         return many_of(r, box(a, a), true, true);
       }},
      {"squares at random",
       [](Random& r) {
         const double a = some_size(r);
         return many_of(r, box(a, a), false, false);
       }},
      {"rectangles",
       [](Random& r) {
         const double a = some_size(r);
         return many_somehow(r, [&] { return box(a, a / between(r, 1.3, 2.5)); });
       }},
      {"triangles on a lattice", [](Random& r) { return many_of(r, polygon(3, 1.3 * some_size(r)), true, true); }},
      {"triangles at random", [](Random& r) { return many_of(r, polygon(3, 1.3 * some_size(r)), false, false); }},
      {"pentagons", [](Random& r) { return many_somehow(r, [&] { return polygon(5, some_size(r)); }); }},
      {"hexagons", [](Random& r) { return many_somehow(r, [&] { return polygon(6, some_size(r)); }); }},
      {"a honeycomb", honeycomb},
      {"half disks", [](Random& r) { return many_somehow(r, [&] { return half_disk(1.2 * some_size(r)); }); }},
      {"crescents", [](Random& r) { return many_somehow(r, [&] { return crescent(1.2 * some_size(r)); }); }},
      {"crosses",
       [](Random& r) {
         const double a = 1.2 * some_size(r);
         return many_somehow(r, [&] { return cross(a, a * between(r, 0.2, 0.5)); });
       }},
      {"stars",
       [](Random& r) {
         const double a = 1.2 * some_size(r);
         return many_somehow(r, [&] {
           const double inner = a * between(r, 0.4, 0.6);
           return star(4 + static_cast<int>(r() % 4), a, inner);
         });
       }},
      {"rods with round ends",
       [](Random& r) {
         const double a = between(r, 4, 10);
         return many_somehow(r, [&] { return capsule(a * between(r, 0.6, 3), a); });
       }},
      {"leaves",
       [](Random& r) {
         const double a = between(r, 12, 26);
         return many_somehow(r, [&] { return leaf(a, a * between(r, 0.3, 0.6)); });
       }},
      {"voids between disks",
       [](Random& r) { return many_somehow(r, [&] { return void_of_three(between(r, 12, 40)); }); }},
      {"rings that are ovals",
       [](Random& r) {
         const double a = between(r, 10, 24), b = a / between(r, 1.3, 2);
         const Tones level = tones(r);
         Canvas canvas(level.paper);
         const double thick = between(r, 1.5, 4), turn = between(r, 0, pi);
         for (const Point& place : lattice(r, 2.3 * a, 2.3 * a))
           canvas.stroke(moved(oval(a, b), place, turn), thick, level.ink, true);
         return canvas.seen(r);
       }},
      {"gravel",
       [](Random& r) {
         const Tones level = tones(r);
         Canvas canvas(level.paper);
         const double size = some_size(r), rough = between(r, 0.12, 0.25);
         for (const Point& place : at_random(r, 2.3 * size, 150))
           canvas.fill(moved(irregular(r, size * between(r, 0.7, 1.2), rough), place), level.ink);
         return canvas.seen(r);
       }},
      {"one irregular shape many times",
       [](Random& r) {
         return many_somehow(r, [&] {
           const double rough = between(r, 0.12, 0.25), size = some_size(r);
           return irregular(r, size, rough);
         });
       }},
      {"splinters", mixed_polygons},
      {"long worms", [](Random& r) { return worms(r, 12, 300, 0.03); }},
      {"short worms", [](Random& r) { return worms(r, 60, 50, 0.06); }},
      {"print in capitals", [](Random& r) { return printed(r, "ABCDEFGHIJKLMNPRSTUVWXYZ"); }},
      {"print", [](Random& r) { return printed(r, "abcdefghijklmnopqrstuvwxyz.,"); }},
      {"numbers", [](Random& r) { return printed(r, "0123456789.-"); }},
      {"a plot of curves", [](Random& r) { return plotted(r, 0); }},
      {"a plot of squares", [](Random& r) { return plotted(r, 1); }},
      {"a plot of triangles", [](Random& r) { return plotted(r, 2); }},
      {"a plot of crosses", [](Random& r) { return plotted(r, 3); }},
      {"1/f noise", [](Random& r) { return cloudy(r, between(r, 1, 2)); }},
      {"clouds", [](Random& r) { return cloudy(r, between(r, 2, 3.5)); }},
      {"speckle",
       [](Random& r) {
         const double wave = between(r, 8, 40);
         const cv::Mat noise = coloured_noise(r, 0, wave, 4 * wave);
         Canvas canvas(0);
         canvas.paint([&](double x, double y) { return 128 + 45 * level_in(noise, x, y); });
         return canvas.seen(r);
       }},
      {"islands",
       [](Random& r) {
         const double threshold = between(r, -0.5, 1);
         return cut_at(r, coloured_noise(r, between(r, 2, 3), 4, 1e6), threshold);
       }},
      {"a labyrinth",
       [](Random& r) {
         const double wave = between(r, 14, 50), threshold = between(r, -0.4, 0.4);
         return cut_at(r, coloured_noise(r, 0, wave, 1.4 * wave), threshold);
       }},
      {"a relief map",
       [](Random& r) {
         const cv::Mat field = coloured_noise(r, 3, 10, 1e6);
         const double step = between(r, 0.2, 0.5);
         Canvas canvas(0);
         canvas.paint([&](double x, double y) {
           const double level = level_in(field, x, y) / step;
           return level - std::floor(level) < 0.15 ? 40.0 : 220.0;
         });
         return canvas.seen(r);
       }},
      {"cells with walls", [](Random& r) { return pieces_of_glass(r, true); }},
      {"stained glass", [](Random& r) { return pieces_of_glass(r, false); }},
      {"a landscape", landscape},
      {"houses", houses},
      {"bricks", bricks},
      {"branches", branches},
      {"a circuit", circuit},
      {"a chessboard",
       [](Random& r) {
         const Tones level = tones(r);
         const double side = between(r, 10, 40), turn = between(r, 0, pi);
         Canvas canvas(0);
         canvas.paint([&](double x, double y) {
           const double u = std::cos(turn) * x - std::sin(turn) * y, v = std::sin(turn) * x + std::cos(turn) * y;
           return (static_cast<int>(std::floor(u / side)) + static_cast<int>(std::floor(v / side))) % 2 == 0
                      ? level.ink
                      : level.paper;
         });
         return canvas.seen(r);
       }},
      {"a fingerprint",
       [](Random& r) {
         const cv::Mat bend = coloured_noise(r, 3, 60, 1e6);
         const double wave = between(r, 6, 18), much = between(r, 5, 25);
         Canvas canvas(0);
         canvas.paint([&](double x, double y) {
           const double away = std::hypot(x - 200, y - 180) + much * level_in(bend, x, y);
           return 128 + 90 * std::sin(2 * pi * away / wave);
         });
         return canvas.seen(r);
       }},
      {"waves that meet", [](Random& r) { return waves(r, 3 + static_cast<int>(r() % 20)); }},
      {"an empty tray",
       [](Random& r) {
         const double floor = between(r, 250, 330), slope = between(r, -0.2, 0.2);
         Canvas canvas(0);
         canvas.paint(
             [&](double x, double y) { return y > floor || x < 20 || x > 395 ? 40.0 : 190 + slope * x - 0.1 * y; });
         return canvas.seen(r);
       }},
  };
  return kinds;
}

}  // namespace shakebed::ingest::test
