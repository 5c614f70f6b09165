#include "tests/ingest/drawn_beds.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "ingest/find/nearby.hpp"

namespace shakebed::ingest::test {

namespace {

double uniform(std::mt19937& random, double from, double to) {
  return from + (to - from) * static_cast<double>(random()) / 4294967296.0;
}
double gaussian(std::mt19937& random) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += uniform(random, 0, 1);
  return sum;
}

using RadiusOf = std::function<double(std::mt19937& random)>;
// The level of a bead at (u, v) radii from its centre.
using FaceOf = std::function<double(const DrawnBead& bead, double u, double v)>;

struct Scene {
  int width = 480, height = 400;
  double background = 200;
  double blur_px = 0.8, noise = 2;
  double slope_x = 0, slope_y = 0;  // of the light, relative, over the frame
  FaceOf face;
  double shadow = 0;    // radii: a copy of each bead lies so far below it, behind all beads, ...
  double shade = 0.75;  // ... and takes this share of the light
  bool container = false;
};

// Each bead lies as low as it can, touching two others, a wall or the floor.
class Packing {
 public:
  Packing(double left, double right, double floor) : left_(left), right_(right), floor_(floor) {}

  void add(double radius, std::mt19937& random) {
    DrawnBead best{0, -HUGE_VAL, radius, false};
    const auto offer = [&](double x, double y) {
      if (x < left_ + radius - 1e-9 || x > right_ - radius + 1e-9 || y > floor_ - radius + 1e-9 || y <= best.y) return;
      for (auto other = beads_.rbegin(); other != beads_.rend(); ++other)
        if (std::hypot(other->x - x, other->y - y) < other->radius + radius - 1e-7) return;
      best.x = x, best.y = y;
    };
    for (int k = 0; k < 30; ++k) offer(uniform(random, left_ + radius, right_ - radius), floor_ - radius);
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      const double to_one = beads_[i].radius + radius;
      for (const double x : {left_ + radius, right_ - radius}) {
        const double off = x - beads_[i].x;
        if (std::abs(off) <= to_one) offer(x, beads_[i].y - std::sqrt(to_one * to_one - off * off));
      }
      for (std::size_t j = 0; j < beads_.size(); ++j) {
        const double dx = beads_[j].x - beads_[i].x, dy = beads_[j].y - beads_[i].y, away = std::hypot(dx, dy);
        const double to_other = beads_[j].radius + radius;
        if (i == j || away >= to_one + to_other) continue;
        const double along = (away * away + to_one * to_one - to_other * to_other) / (2 * away);
        const double across = std::sqrt(std::max(0.0, to_one * to_one - along * along));
        const double x = beads_[i].x + (along * dx + across * dy) / away;
        const double y = beads_[i].y + (along * dy - across * dx) / away;
        if (y < std::max(beads_[i].y, beads_[j].y)) offer(x, y);
      }
    }
    if (best.y > -HUGE_VAL) beads_.push_back(best);
  }
  [[nodiscard]] double top() const {
    double top = floor_;
    for (const DrawnBead& bead : beads_) top = std::min(top, bead.y);
    return top;
  }
  std::vector<DrawnBead> beads_;

 private:
  double left_, right_, floor_;
};

// A pile that ends at this height.
std::vector<DrawnBead> piled(std::mt19937& random, const Scene& scene, double left, double right, double floor,
                             double top, const RadiusOf& radius_of) {
  Packing packing(left, right, floor);
  const auto most = static_cast<std::size_t>(scene.width * scene.height / 100);
  while (packing.beads_.size() < most) {
    const std::size_t before = packing.beads_.size();
    packing.add(radius_of(random), random);
    if (packing.beads_.size() == before || packing.beads_.back().y < top) break;
  }
  return packing.beads_;
}

// A pile with its floor, its walls and its surface in the frame.
std::vector<DrawnBead> pile(std::mt19937& random, const Scene& scene, const RadiusOf& radius_of) {
  return piled(random, scene, 20, scene.width - 20, scene.height - 15, uniform(random, 60, 160), radius_of);
}
// A packing that fills the frame and is cut by it.
std::vector<DrawnBead> packed_beyond(std::mt19937& random, const Scene& scene, const RadiusOf& radius_of) {
  return piled(random, scene, -40, scene.width + 40, scene.height + 40, -30, radius_of);
}
// Beads that do not touch.
std::vector<DrawnBead> strewn(std::mt19937& random, const Scene& scene, const RadiusOf& radius_of, double gap,
                              std::size_t count) {
  std::vector<DrawnBead> beads;
  double radius = radius_of(random);
  for (int tries = 0; tries < 4000 && beads.size() < count; ++tries) {
    const DrawnBead one{uniform(random, radius + 3, scene.width - radius - 4),
                        uniform(random, radius + 3, scene.height - radius - 4), radius, true};
    if (std::any_of(beads.begin(), beads.end(), [&](const DrawnBead& other) {
          return std::hypot(other.x - one.x, other.y - one.y) < gap * (other.radius + one.radius);
        }))
      continue;
    beads.push_back(one);
    radius = radius_of(random);
  }
  return beads;
}
// A lattice with jitter and holes.
std::vector<DrawnBead> crystal(std::mt19937& random, const Scene& scene, double radius) {
  std::vector<DrawnBead> beads;
  const double step = 2 * radius * uniform(random, 1.02, 1.08), rise = step * std::sqrt(0.75);
  for (int row = 0; row * rise < scene.height + radius; ++row)
    for (int column = -1; column * step < scene.width + step; ++column) {
      const double x = step * (column + (row % 2 ? 0.5 : 0.0)), y = rise * row + 5;
      if (random() % 20 == 0) continue;
      beads.push_back({x + 0.01 * radius * gaussian(random), y + 0.01 * radius * gaussian(random), radius, false});
    }
  return beads;
}

void smear(std::vector<float>& pixels, int width, int height, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  std::vector<float> weights;
  float sum = 0;
  for (int k = -reach; k <= reach; ++k) {
    weights.push_back(static_cast<float>(std::exp(-0.5 * k * k / (sigma * sigma))));
    sum += weights.back();
  }
  for (const bool along : {true, false}) {
    std::vector<float> to(pixels.size());
    for (int row = 0; row < height; ++row)
      for (int column = 0; column < width; ++column) {
        float level = 0;
        for (int k = -reach; k <= reach; ++k) {
          const int x = along ? std::clamp(column + k, 0, width - 1) : column;
          const int y = along ? row : std::clamp(row + k, 0, height - 1);
          level += weights[static_cast<std::size_t>(k + reach)] * pixels[static_cast<std::size_t>(y * width + x)];
        }
        to[static_cast<std::size_t>(row * width + column)] = level / sum;
      }
    pixels = std::move(to);
  }
}

DrawnBed photographed(std::mt19937& random, const Scene& scene, std::vector<DrawnBead> beads) {
  std::erase_if(beads, [&](const DrawnBead& bead) {
    return bead.x < -bead.radius || bead.y < -bead.radius || bead.x > scene.width + bead.radius ||
           bead.y > scene.height + bead.radius;
  });
  double largest = 1;
  for (DrawnBead& bead : beads) {
    bead.whole = bead.x - bead.radius >= -0.5 && bead.y - bead.radius >= -0.5 &&
                 bead.x + bead.radius <= scene.width - 0.5 && bead.y + bead.radius <= scene.height - 0.5;
    largest = std::max(largest, bead.radius);
  }
  const Nearby near(beads.size(), largest, [&](std::size_t i) { return std::pair(beads[i].x, beads[i].y); });
  const auto bead_at = [&](double x, double y) {
    const DrawnBead* at = nullptr;
    near.any_near(x, y, [&](std::size_t i) {
      if (std::hypot(beads[i].x - x, beads[i].y - y) < beads[i].radius) at = &beads[i];
      return at != nullptr;
    });
    return at;
  };
  DrawnBed drawn;
  drawn.frame = {scene.width, scene.height, {}};
  constexpr int points = 3;
  for (int row = 0; row < scene.height; ++row)
    for (int column = 0; column < scene.width; ++column) {
      double level = 0;
      for (int i = 0; i < points * points; ++i) {
        const double x = column + (i % points - 1) / 3.0, y = row + (i / points - 1) / 3.0;
        if (const DrawnBead* bead = bead_at(x, y)) {
          level += scene.face(*bead, (x - bead->x) / bead->radius, (y - bead->y) / bead->radius);
          continue;
        }
        const bool wall = scene.container && (x < 20 || x > scene.width - 20 || y > scene.height - 15);
        const double off = scene.shadow * largest;
        const bool shaded = off > 0 && bead_at(x - off, y - 0.5 * off) != nullptr;
        level += wall ? 30 : scene.background * (shaded ? scene.shade : 1.0);
      }
      level /= points * points;
      const double light = 1 + scene.slope_x * (static_cast<double>(column) / scene.width - 0.5) +
                           scene.slope_y * (static_cast<double>(row) / scene.height - 0.5);
      drawn.frame.pixels.push_back(static_cast<float>(level * light));
    }
  smear(drawn.frame.pixels, scene.width, scene.height, scene.blur_px);
  for (float& level : drawn.frame.pixels)
    level = static_cast<float>(
        std::clamp(std::round(static_cast<double>(level) + scene.noise * gaussian(random)), 0.0, 255.0));
  drawn.beads = std::move(beads);
  return drawn;
}

// A number of the bead alone, from 0 to 1.
double own(const DrawnBead& bead, int which) {
  const double wild = std::sin(12.9898 * bead.x + 78.233 * bead.y + 37.7 * which) * 43758.5453;
  return wild - std::floor(wild);
}

FaceOf flat(double level) {
  return [=](const DrawnBead&, double, double) { return level; };
}
// Fringes, another set in each bead, of this depth around a level.
FaceOf fringed(double level, double depth) {
  return [=](const DrawnBead& bead, double u, double v) {
    return level + depth * std::sin((6 + 8 * own(bead, 1)) * u * v + 6 * own(bead, 2)) *
                       std::cos(6 * own(bead, 3) * u + 6 * own(bead, 4));
  };
}
// Clear disks of various greys, a dark line at the rim, some with fringes.
FaceOf clear_disks(double level, double spread, double line) {
  return [=, fringes = fringed(0, 60)](const DrawnBead& bead, double u, double v) {
    const double rho = std::hypot(u, v), body = level + spread * (2 * own(bead, 5) - 1);
    const double seen = own(bead, 6) < 0.3 ? body + fringes(bead, u, v) : body;
    return rho > 1 - 1.5 / bead.radius ? seen - line : seen;
  };
}

Scene some_scene(std::mt19937& random) {
  Scene scene;
  scene.background = uniform(random, 170, 230);
  scene.blur_px = uniform(random, 0.5, 1.3);
  scene.noise = uniform(random, 0.7, 4);
  return scene;
}
RadiusOf one_size(std::mt19937& random) {
  const double radius = uniform(random, 8, 19);
  return [=](std::mt19937&) { return radius; };
}
RadiusOf two_sizes(double large, double ratio, double share) {
  return [=](std::mt19937& random) { return uniform(random, 0, 1) < share ? large / ratio : large; };
}

}  // namespace

DrawnBed bed_of_two_sizes(std::mt19937& random, double ratio, double share_of_small, double large_radius_px) {
  Scene scene = some_scene(random);
  const double depth = uniform(random, 0, 25), level = uniform(random, 60, 90);
  scene.face = fringed(level, depth);
  return photographed(random, scene, pile(random, scene, two_sizes(large_radius_px, ratio, share_of_small)));
}

DrawnBed strewn_of_two_sizes(std::mt19937& random, double ratio, double share_of_small, double large_radius_px) {
  Scene scene = some_scene(random);
  const double depth = uniform(random, 0, 25), level = uniform(random, 60, 90);
  scene.face = fringed(level, depth);
  const RadiusOf radius_of = two_sizes(large_radius_px, ratio, share_of_small);
  return photographed(random, scene, strewn(random, scene, radius_of, 1.03, 150));
}

namespace {

// As an atmosphere: most touch none, some touch one.
std::vector<DrawnBead> loose(std::mt19937& random, const Scene& scene, const RadiusOf& radius_of, std::size_t count) {
  constexpr double side = 20, floor = 15, height = 0.3, at_floor = 0.2, at_another = 0.3;
  std::vector<DrawnBead> beads;
  double radius = radius_of(random);
  for (int tries = 0; tries < 100000 && beads.size() < count; ++tries) {
    const double lowest = scene.height - floor - radius, kind = uniform(random, 0, 1);
    double x = uniform(random, side + radius, scene.width - side - radius);
    double y = lowest + height * scene.height * std::log(1 - uniform(random, 0, 1));
    if (kind < at_floor) y = lowest;
    if (kind > 1 - at_another && !beads.empty()) {
      const DrawnBead& other = beads[random() % beads.size()];
      const double angle = uniform(random, 0, 2 * std::numbers::pi), away = other.radius + radius + 0.05;
      x = other.x + away * std::cos(angle), y = other.y + away * std::sin(angle);
    }
    if (x < side + radius || x > scene.width - side - radius || y > lowest || y < radius + 6) continue;
    if (std::any_of(beads.begin(), beads.end(), [&](const DrawnBead& other) {
          return std::hypot(other.x - x, other.y - y) < other.radius + radius;
        }))
      continue;
    beads.push_back({x, y, radius, true});
    radius = radius_of(random);
  }
  return beads;
}

std::vector<DrawnBead> laid_out(std::mt19937& random, const Scene& scene, const Shaded& shaded,
                                const RadiusOf& radius_of) {
  if (shaded.layout == Shaded::Layout::strewn) return strewn(random, scene, radius_of, 1.03, shaded.count);
  if (shaded.layout == Shaded::Layout::loose) return loose(random, scene, radius_of, shaded.count);
  Packing packing(20, scene.width - 20, scene.height - 15);
  for (std::size_t k = 0; k < shaded.count && packing.beads_.size() == k; ++k) packing.add(radius_of(random), random);
  return packing.beads_;
}

// The sharp beads, and behind them those that are out of focus.
DrawnBed with_defocused(std::mt19937& random, const Scene& scene, const Shaded& shaded,
                        const std::vector<DrawnBead>& beads, const std::function<bool(const DrawnBead&)>& is_other) {
  Scene quiet = scene;
  quiet.noise = 0, quiet.blur_px = shaded.defocus_of_others * shaded.radius_px;
  std::vector<DrawnBead> sharp, soft;
  for (const DrawnBead& bead : beads) (is_other(bead) ? soft : sharp).push_back(bead);
  const DrawnBed behind = photographed(random, quiet, soft);
  quiet.blur_px = scene.blur_px;
  const DrawnBed before = photographed(random, quiet, sharp);
  DrawnBed drawn = before;
  for (std::size_t k = 0; k < drawn.frame.pixels.size(); ++k) {
    const double seen = static_cast<double>(before.frame.pixels[k] + behind.frame.pixels[k]) - scene.background;
    drawn.frame.pixels[k] =
        static_cast<float>(std::clamp(std::round(seen + scene.noise * gaussian(random)), 0.0, 255.0));
  }
  drawn.beads.insert(drawn.beads.end(), behind.beads.begin(), behind.beads.end());
  return drawn;
}

}  // namespace

DrawnBed bed_of_shades(std::mt19937& random, const Shaded& shaded) {
  Scene scene;
  const double filled = shaded.layout == Shaded::Layout::strewn ? 0.3 : 0.45;
  const double side = std::sqrt(static_cast<double>(shaded.count) * 4 * shaded.radius_px * shaded.radius_px / filled);
  scene.width = static_cast<int>(side) + 40, scene.height = static_cast<int>(side) + 40;
  scene.background = shaded.background, scene.blur_px = shaded.blur_px, scene.noise = shaded.noise;
  scene.slope_x = 2 * (shaded.light_ratio - 1) / (shaded.light_ratio + 1);
  // Sizes are drawn before places: which bead is of which kind follows from its size, told apart by a millionth.
  const double tag = 1e-6;
  const RadiusOf radius_of = [&](std::mt19937& r) {
    const bool other = uniform(r, 0, 1) < shaded.share_of_others, second = r() % 2 == 0;
    return shaded.radius_px * (other ? shaded.size_of_others * (1 + tag) : 1) * (second ? shaded.second_size : 1);
  };
  const auto is_other = [&](const DrawnBead& bead) {
    for (const double size : {1.0, shaded.second_size})
      if (std::abs(bead.radius / (shaded.radius_px * size * shaded.size_of_others * (1 + tag)) - 1) < 0.1 * tag)
        return true;
    return false;
  };
  scene.face = [&](const DrawnBead& bead, double, double) { return is_other(bead) ? shaded.other : shaded.common; };
  const std::vector<DrawnBead> beads = laid_out(random, scene, shaded, radius_of);
  if (shaded.defocus_of_others > 0) return with_defocused(random, scene, shaded, beads, is_other);
  return photographed(random, scene, beads);
}

const std::vector<BedKind>& drawn_beds() {
  using Random = std::mt19937;
  static const std::vector<BedKind> kinds = {
      {"strewn, flat",
       [](Random& r) {
         Scene s = some_scene(r);
         s.face = flat(uniform(r, 30, 110));
         return photographed(r, s, strewn(r, s, one_size(r), 1.1, 80));
       }},
      {"a pile, flat",
       [](Random& r) {
         Scene s = some_scene(r);
         s.face = flat(uniform(r, 30, 110));
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"a bright pile in a container",
       [](Random& r) {
         Scene s = some_scene(r);
         s.background = uniform(r, 20, 60), s.container = true;
         s.face = fringed(uniform(r, 150, 200), 20);
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"a crystal with holes",
       [](Random& r) {
         Scene s = some_scene(r);
         s.face = fringed(90, uniform(r, 0, 40));
         return photographed(r, s, crystal(r, s, uniform(r, 8, 18)));
       }},
      {"strewn, fringes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 30, 90), level = uniform(r, 80, 120);
         s.face = fringed(level, depth);
         return photographed(r, s, strewn(r, s, one_size(r), 1.05, 90));
       }},
      {"a pile, fringes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 30, 90), level = uniform(r, 80, 120);
         s.face = fringed(level, depth);
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"packed beyond the frame, fringes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 30, 90), level = uniform(r, 80, 120);
         s.face = fringed(level, depth);
         return photographed(r, s, packed_beyond(r, s, one_size(r)));
       }},
      {"strewn, poor contrast",
       [](Random& r) {
         Scene s = some_scene(r);
         s.noise = uniform(r, 3, 9);
         s.face = flat(s.background - uniform(r, 8, 35));
         return photographed(r, s, strewn(r, s, one_size(r), 1.1, 80));
       }},
      {"a pile, poor contrast",
       [](Random& r) {
         Scene s = some_scene(r);
         s.noise = uniform(r, 3, 9);
         s.face = flat(s.background - uniform(r, 8, 35));
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"a pile, each bead of its own grey",
       [](Random& r) {
         Scene s = some_scene(r);
         const double darkest = uniform(r, 40, 90), span = uniform(r, 0.6, 1.05) * (s.background - darkest);
         s.face = [=](const DrawnBead& bead, double, double) { return darkest + span * own(bead, 1); };
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"a pile, uneven light",
       [](Random& r) {
         Scene s = some_scene(r);
         s.slope_x = uniform(r, -1.2, 1.2), s.slope_y = uniform(r, -0.6, 0.6);
         s.face = fringed(100, uniform(r, 10, 50));
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"clear disks, packed beyond the frame, with shadows",
       [](Random& r) {
         Scene s = some_scene(r);
         s.shadow = uniform(r, 0.1, 0.3);
         const double line = uniform(r, 20, 60), spread = uniform(r, 10, 40), level = uniform(r, 110, 140);
         s.face = clear_disks(level, spread, line);
         return photographed(r, s, packed_beyond(r, s, one_size(r)));
       }},
      {"a pile of balls lit from above",
       [](Random& r) {
         Scene s = some_scene(r);
         s.background = uniform(r, 20, 60);
         const double high = uniform(r, 140, 220);
         s.face = [=](const DrawnBead&, double u, double v) {
           return std::max(30.0, high * (0.75 - 0.5 * v) * std::sqrt(std::max(0.0, 1 - u * u - v * v) + 0.15));
         };
         return photographed(r, s, pile(r, s, one_size(r)));
       }},
      {"a pile of two sizes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 0, 30), level = uniform(r, 60, 100);
         s.face = fringed(level, depth);
         const double share = uniform(r, 0.1, 0.9), ratio = uniform(r, 1.2, 2), large = uniform(r, 14, 22);
         return photographed(r, s, pile(r, s, two_sizes(large, ratio, share)));
       }},
      {"two sizes, packed beyond the frame, fringes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 30, 70), level = uniform(r, 80, 110);
         s.face = fringed(level, depth);
         const double share = uniform(r, 0.2, 0.8), ratio = uniform(r, 1.2, 1.8), large = uniform(r, 14, 22);
         return photographed(r, s, packed_beyond(r, s, two_sizes(large, ratio, share)));
       }},
      {"two sizes, clear disks with shadows",
       [](Random& r) {
         Scene s = some_scene(r);
         s.shadow = uniform(r, 0.1, 0.3);
         const double line = uniform(r, 20, 60), spread = uniform(r, 10, 40), level = uniform(r, 110, 140);
         s.face = clear_disks(level, spread, line);
         const double share = uniform(r, 0.2, 0.8), ratio = uniform(r, 1.25, 1.6), large = uniform(r, 14, 22);
         return photographed(r, s, packed_beyond(r, s, two_sizes(large, ratio, share)));
       }},
      {"a spread of sizes",
       [](Random& r) {
         Scene s = some_scene(r);
         const double depth = uniform(r, 0, 40), level = uniform(r, 60, 100);
         s.face = fringed(level, depth);
         const double middle = uniform(r, 11, 17), spread = uniform(r, 0.03, 0.2);
         return photographed(
             r, s, pile(r, s, [=](Random& q) { return middle * std::clamp(1 + spread * gaussian(q), 0.6, 1.5); }));
       }},
  };
  return kinds;
}

BedScore score_of(const std::vector<FoundDisk>& disks, const std::vector<DrawnBead>& beads) {
  BedScore score;
  std::vector<bool> taken(disks.size(), false);
  const auto nearest = [&](const DrawnBead& bead, double within) {
    std::size_t best = disks.size();
    double least = within * bead.radius;
    for (std::size_t k = 0; k < disks.size(); ++k)
      if (const double away = std::hypot(disks[k].x_px - bead.x, disks[k].y_px - bead.y); !taken[k] && away < least)
        best = k, least = away;
    return best;
  };
  for (const DrawnBead& bead : beads) {
    if (!bead.whole) continue;
    ++score.beads;
    const std::size_t k = nearest(bead, 0.25);
    if (k == disks.size()) continue;
    taken[k] = true;
    ++score.hits;
    score.worst_radius = std::max(score.worst_radius, std::abs(disks[k].radius_px / bead.radius - 1));
  }
  double ignored = 0;
  for (const DrawnBead& bead : beads)
    if (!bead.whole)
      if (const std::size_t k = nearest(bead, 1); k < disks.size()) taken[k] = true, ++ignored;
  score.found = static_cast<double>(disks.size()) - ignored;
  return score;
}

namespace {

using Colour = std::array<double, 3>;  // red, green, blue

// Hue from 0 to 1, saturation from 0 to 1, and the largest of the three levels.
Colour coloured(double hue, double saturation, double value) {
  Colour colour{};
  for (std::size_t c = 0; c < 3; ++c) {
    const double turned = hue + (3.0 - static_cast<double>(c)) / 3, from = 6 * (turned - std::floor(turned));
    colour[c] = value * (1 - saturation * std::clamp(std::min(from, 6 - from) - 1, 0.0, 1.0));
  }
  return colour;
}
Colour times(Colour colour, double factor) {
  for (double& level : colour) level *= factor;
  return colour;
}
double brightness(const Colour& colour) { return 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2]; }

struct ColouredScene {
  Scene scene;
  Colour background{}, slope{};  // slope: of the light from left to right, relative, over the frame
  std::function<Colour(const DrawnBead& bead, double u, double v)> face;
};

ColouredBed photographed_in_colour(std::mt19937& random, const ColouredScene& coloured,
                                   const std::vector<DrawnBead>& beads) {
  ColouredBed drawn;
  for (std::size_t c = 0; c < 3; ++c) {
    Scene scene = coloured.scene;
    scene.background = coloured.background[c], scene.slope_x = coloured.slope[c];
    scene.face = [&](const DrawnBead& bead, double u, double v) { return coloured.face(bead, u, v)[c]; };
    DrawnBed seen = photographed(random, scene, beads);
    drawn.channels[c] = std::move(seen.frame), drawn.beads = std::move(seen.beads);
  }
  return drawn;
}

std::vector<DrawnBead> piled_or_strewn(std::mt19937& random, const Scene& scene) {
  const RadiusOf radius_of = one_size(random);
  return random() % 2 == 0 ? pile(random, scene, radius_of) : strewn(random, scene, radius_of, 1.1, 70);
}

ColouredBed on_another_colour(std::mt19937& random, bool as_bright) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const double hue = uniform(random, 0, 1), further = uniform(random, 0.25, 0.75);
  const double saturation = uniform(random, 0.5, 0.9), value = uniform(random, 110, 160);
  drawn.background = coloured(hue, uniform(random, 0.2, 0.6), uniform(random, 130, 220));
  Colour bead = coloured(hue + further, saturation, value);
  if (as_bright) bead = times(bead, brightness(drawn.background) / brightness(bead));
  drawn.face = [=](const DrawnBead&, double, double) { return bead; };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

ColouredBed of_many_colours(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const double grey = random() % 2 == 0 ? uniform(random, 20, 60) : uniform(random, 190, 235);
  drawn.background = {grey, grey, grey};
  drawn.face = [](const DrawnBead& bead, double, double) { return coloured(own(bead, 7), 0.8, 190); };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

ColouredBed of_two_halves(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const double hue = uniform(random, 0, 1), further = uniform(random, 0.3, 0.5), grey = uniform(random, 200, 240);
  drawn.background = {grey, grey, grey};
  drawn.face = [=](const DrawnBead& bead, double u, double v) {
    const double angle = 2 * std::numbers::pi * own(bead, 8);
    return coloured(u * std::cos(angle) + v * std::sin(angle) > 0 ? hue : hue + further, 0.8, 180);
  };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

// Spheres with a highlight, darker towards their rims, of one colour or many.
ColouredBed of_glossy_spheres(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const bool many = random() % 2 == 0, bright = random() % 2 == 0;
  const double hue = uniform(random, 0, 1), grey = bright ? uniform(random, 215, 245) : uniform(random, 5, 25);
  drawn.background = {grey, grey, grey};
  drawn.face = [=](const DrawnBead& bead, double u, double v) {
    if (std::hypot(u + 0.3, v + 0.35) < 0.18) return Colour{250, 250, 250};
    const double facing = std::sqrt(std::max(0.0, 1 - u * u - v * v));
    return times(coloured(many ? own(bead, 7) : hue, 0.75, 210), 0.45 + 0.55 * facing);
  };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

// Faces of nearly the colour behind them, with a dark line at the rim.
ColouredBed of_outlines(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const double hue = uniform(random, 0, 1), line = uniform(random, 1.5, 3);
  drawn.background = coloured(hue, 0.25, 215);
  const Colour face = coloured(hue, 0.3, 205), rim = coloured(hue + 0.5, 0.5, 60);
  drawn.face = [=](const DrawnBead& bead, double u, double v) {
    return std::hypot(u, v) > 1 - line / bead.radius ? rim : face;
  };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

// Grey beads in light that is warm at one side and cold at the other.
ColouredBed in_coloured_light(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  const double turn = uniform(random, 0.3, 0.7);
  drawn.background = {150, 150, 150}, drawn.slope = {turn, 0, -turn};
  drawn.face = [](const DrawnBead&, double, double) { return Colour{60, 60, 60}; };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

// Photoelastic disks of two sizes: fringes in green, outlines in red.
ColouredBed of_photoelastic_disks(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  drawn.background = {150, 25, 15};
  const FaceOf fringes = fringed(70, 60), clear = clear_disks(140, 15, 70);
  drawn.face = [=](const DrawnBead& bead, double u, double v) {
    const double green = own(bead, 6) < 0.6 ? fringes(bead, u, v) : 30;
    return Colour{clear(bead, u, v), green, 0.5 * green};
  };
  const RadiusOf radius_of = two_sizes(uniform(random, 14, 20), 1.3, 0.4);
  return photographed_in_colour(random, drawn, pile(random, drawn.scene, radius_of));
}

// As balls of a billiard: a white patch in the middle, with a dark stroke.
ColouredBed with_labels(std::mt19937& random) {
  ColouredScene drawn{some_scene(random), {}, {}, {}};
  drawn.background = coloured(uniform(random, 0.3, 0.6), 0.7, uniform(random, 80, 150));
  drawn.face = [](const DrawnBead& bead, double u, double v) {
    const double rho = std::hypot(u - 0.2 * own(bead, 9), v - 0.2 * own(bead, 10));
    if (rho < 0.4) return std::abs(u - 0.2 * own(bead, 9)) < 0.1 ? Colour{30, 30, 30} : Colour{235, 235, 225};
    return coloured(own(bead, 7) < 0.8 ? 0.9 * own(bead, 7) : 0.1, 0.85, 60 + 170 * own(bead, 11));
  };
  return photographed_in_colour(random, drawn, piled_or_strewn(random, drawn.scene));
}

}  // namespace

const std::vector<ColouredKind>& coloured_beds() {
  using Random = std::mt19937;
  static const std::vector<ColouredKind> kinds = {
      {"one colour on another", [](Random& r) { return on_another_colour(r, false); }},
      {"as bright as what is behind", [](Random& r) { return on_another_colour(r, true); }},
      {"many colours", of_many_colours},
      {"two halves", of_two_halves},
      {"glossy spheres", of_glossy_spheres},
      {"outlines", of_outlines},
      {"coloured light", in_coloured_light},
      {"photoelastic disks of two sizes", of_photoelastic_disks},
      {"labels", with_labels},
  };
  return kinds;
}

}  // namespace shakebed::ingest::test
