#include "sim/scene/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

namespace shakebed::sim {

namespace {

// "12.5", "0.92": enough digits to recognise what one wrote.
std::string number(double value) {
  std::ostringstream out;
  out.precision(10);
  out << value;
  return out.str();
}

class Check {
 public:
  explicit Check(const Scene& scene) : scene_(scene) {}

  std::vector<SceneProblem> operator()() {
    disks();
    box();
    floor();
    plates();
    bath();
    if (problems_.empty()) room();
    return problems_;
  }

 private:
  void require(bool holds, const std::string& where, const std::string& what) {
    if (!holds) problems_.push_back({where, what});
  }
  template <class Value>
  void surface(const Value& s, const std::string& where) {
    require(s.restitution >= 0 && s.restitution <= 1, where + "/restitution",
            "the restitution is " + number(s.restitution) + "; it must lie between 0 and 1");
    require(s.law_speed > 0 && std::isfinite(s.law_speed), where + "/restitution_speed",
            "the speed for which the restitution is given is " + number(s.law_speed) + "; it must be above 0");
    require(s.law != RestitutionLaw::viscoelastic || s.restitution > 0, where + "/restitution",
            "the restitution is 0, but that of viscoelastic bodies is above 0 at every speed");
    require(s.friction >= 0 && std::isfinite(s.friction), where + "/friction",
            "the coefficient of friction is " + number(s.friction) + "; it must be 0 or more");
    require(s.tangential_restitution >= -1 && s.tangential_restitution <= 1, where + "/tangential_restitution",
            "the tangential restitution is " + number(s.tangential_restitution) + "; it must lie between -1 and 1");
  }
  bool falls() const { return std::holds_alternative<UniformGravity>(scene_.gravity); }
  bool periodic_upwards() const { return std::holds_alternative<PeriodicTop>(scene_.box.top); }
  double height() const {
    if (const auto* lid = std::get_if<Lid>(&scene_.box.top)) return lid->height;
    if (const auto* top = std::get_if<PeriodicTop>(&scene_.box.top)) return top->height;
    return INFINITY;
  }

  double highest_floor() const {
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene_.box.floor)) return sine->amplitude;
    const auto* table = std::get_if<TabulatedFloor>(&scene_.box.floor);
    return table == nullptr || table->heights.empty() ? 0 : *std::ranges::max_element(table->heights);
  }

  void disks() {
    const Disks& d = scene_.disks;
    require(d.species.size() == 1 || d.species.size() == 2, "/disks",
            std::to_string(d.species.size()) + " species of disks are given; there must be one or two");
    for (const Species& s : d.species) {
      require(s.diameter > 0 && std::isfinite(s.diameter), "/disks/diameter",
              "the diameter is " + number(s.diameter) + "; it must be above 0");
      require(s.mass > 0 && std::isfinite(s.mass), "/disks/mass",
              "the mass is " + number(s.mass) + "; it must be above 0");
    }
    require(scene_.count() < 1u << 28, "/disks/count",
            "there are " + std::to_string(scene_.count()) + " disks; at most 268435455 can be simulated");
    surface(d.contact, "/disks");
    require(d.inertia_ratio > 0 && d.inertia_ratio <= 1, "/disks/inertia",
            "the moment of inertia over m R^2 (R: radius) is " + number(d.inertia_ratio) +
                "; it must be above 0 and at most 1 (1/2 for a disk, 2/5 for a sphere)");
    require(d.contact_duration >= 0 && std::isfinite(d.contact_duration), "/disks/contact_duration",
            "the contact duration is " + number(d.contact_duration) + "; it must be 0 or more");
  }

  void box() {
    const Box& b = scene_.box;
    double largest = 0;
    for (const Species& s : scene_.disks.species) largest = std::max(largest, s.diameter);
    require(b.width >= largest && std::isfinite(b.width), "/box/width",
            "the box is " + number(b.width) + " D wide, narrower than a disk of " + number(largest) + " D");
    // Beyond it a place is known to no better than 1e-7 D, and cells are more than can be counted.
    constexpr double most = 1e9;
    require(!(b.width > most) && !(std::isfinite(height()) && height() > most), "/box",
            "the box is larger than 1e9 D: double precision does not resolve 1e-7 D at such distances");
    const bool periodic = std::holds_alternative<PeriodicSides>(b.sides);
    const double least = 2 * largest + 3;  // a disk must never meet two images of one neighbour
    require(!periodic || b.width >= least, "/box/width",
            "a periodic box of " + number(b.width) +
                " D is too narrow, because a disk could touch two images of the same neighbour: give at least " +
                number(least) + " D");
    require(!periodic_upwards() || height() >= least, "/box/height",
            "a periodic box of " + number(height()) + " D is too low: give at least " + number(least) + " D");
    require(!periodic_upwards() || periodic, "/box/sides",
            "a box that is periodic upwards must have periodic sides, too");
    require(!(periodic_upwards() && falls()), "/box/height",
            "a box that is periodic upwards must be without gravity, because a disk would fall for ever");
    require(falls() || !std::holds_alternative<OpenTop>(b.top), "/box/lid",
            "without gravity an open box loses its disks: give it a lid, or make it periodic");
    if (const auto* sides = std::get_if<HardSides>(&b.sides)) {
      surface(sides->surface, "/box/sides");
      constexpr double least_slope = 1e-3,
                       most_slope = 1.2;  // 0.06 and 69 deg: beyond, a wall is another or hardly leans
      require(sides->slope == 0 || (sides->slope >= least_slope && sides->slope <= most_slope), "/box/sides/slope",
              "the slope of the sides is " + number(sides->slope) + " rad; it must be 0, or 0.001 to 1.2 rad outwards");
      require(!(sides->slope > 0) || falls(), "/box/sides/slope", "sloped sides need gravity");
    }
    if (const auto* lid = std::get_if<Lid>(&b.top)) {
      surface(lid->surface, "/box/lid");
      require(lid->mass > 0, "/box/lid/mass", "the mass of the lid is " + number(lid->mass) + "; it must be above 0");
      require(!lid->is_free() || falls(), "/box/lid/mass", "a lid that moves needs gravity");
      require(!lid->is_free() || lid->surface.friction == 0, "/box/lid/friction",
              "a lid that moves must be smooth: the program has friction only with walls of infinite mass. Give it "
              "friction 0");
    }
    surface(b.floor_surface, "/floor");
  }

  void floor() {
    double amplitude = 0;
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene_.box.floor)) {
      amplitude = sine->amplitude;
      require(
          sine->amplitude > 0 && std::isfinite(sine->amplitude), "/floor/amplitude",
          "the amplitude is " + number(sine->amplitude) + "; it must be above 0. For a floor at rest, write \"still\"");
      require(sine->frequency > 0 && std::isfinite(sine->frequency), "/floor/frequency",
              "the frequency is " + number(sine->frequency) + "; it must be above 0");
    } else if (const auto* table = std::get_if<TabulatedFloor>(&scene_.box.floor)) {
      require(table->period > 0 && std::isfinite(table->period), "/floor/period",
              "the period is " + number(table->period) + "; it must be above 0");
      require(table->heights.size() >= 4, "/floor/heights",
              std::to_string(table->heights.size()) +
                  " positions of the floor are given for a period; at least 4 are needed");
      for (double h : table->heights) {
        require(std::isfinite(h), "/floor/heights", "a position of the floor is not a finite number");
        amplitude = std::max(amplitude, std::abs(h));
      }
      if (!table->heights.empty()) {
        const auto [low, high] = std::minmax_element(table->heights.begin(), table->heights.end());
        require(*high > *low, "/floor/heights",
                "all positions of the floor are equal. For a floor at rest, write \"still\"");
      }
    } else {
      return;
    }
    require(!(amplitude > 1e9), "/floor", "the amplitude of the floor is above 1e9 D; it must be smaller");
    require(!periodic_upwards(), "/floor/motion",
            "a box that is periodic upwards has no floor, so no motion of the floor can be given");
    double largest = 0;
    for (const Species& s : scene_.disks.species) largest = std::max(largest, s.diameter);
    require(height() > highest_floor() + largest, "/box/lid",
            "the lid at " + number(height()) + " D leaves no room for a disk above the floor, which rises to " +
                number(highest_floor()) + " D");
  }

  void plates() {
    const auto* plates = std::get_if<RubbingPlates>(&scene_.box.plates);
    if (plates == nullptr) return;
    require(plates->deceleration > 0 && std::isfinite(plates->deceleration), "/box/plates",
            "the deceleration of a disk by friction with the plates is " + number(plates->deceleration) +
                "; it must be above 0");
    require(
        plates->interval > 0 && std::isfinite(plates->interval), "/box/plates/interval",
        "the interval at which friction with the plates acts is " + number(plates->interval) + "; it must be above 0");
    double smallest = std::numeric_limits<double>::infinity();
    for (const Species& s : scene_.disks.species) smallest = std::min(smallest, s.diameter / 2);
    require(plates->contact_radius >= 0 && plates->contact_radius <= smallest, "/box/plates/contact_radius",
            "the radius of the contact with the plate is " + number(plates->contact_radius) +
                " D; it must lie between 0 and the radius of the smallest disk, " + number(smallest) + " D");
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene_.box.floor)) interval_of(*plates, 1 / sine->frequency);
    if (const auto* table = std::get_if<TabulatedFloor>(&scene_.box.floor)) interval_of(*plates, table->period);
  }
  void interval_of(const RubbingPlates& plates, double period) {
    constexpr double least_a_period = 20;
    require(plates.interval * least_a_period <= period, "/box/plates/interval",
            "friction with the plates acts every " + number(plates.interval) + " sqrt(D/g), but it must act at least " +
                number(least_a_period) + " times in a period of the floor: give at most " +
                number(period / least_a_period) + " sqrt(D/g)");
  }

  void bath() {
    const auto positive = [&](double value, const char* name) {
      require(value > 0 && std::isfinite(value), std::string("/bath/") + name,
              "this is " + number(value) + "; it must be above 0");
    };
    if (const auto* b = std::get_if<LangevinBath>(&scene_.bath)) {
      positive(b->temperature, "temperature");
      positive(b->rate, "rate");
      positive(b->interval, "interval");
    } else if (const auto* a = std::get_if<AndersenBath>(&scene_.bath)) {
      positive(a->temperature, "temperature");
      positive(a->rate, "rate");
    } else if (const auto* w = std::get_if<WhiteNoiseBath>(&scene_.bath)) {
      positive(w->heating, "heating");
      positive(w->interval, "interval");
      require(scene_.disks.contact.restitution < 1, "/bath",
              "white noise heats a bed without limit if contacts do not dissipate energy. Give a restitution below 1");
    } else if (const auto* t = std::get_if<ThermalFloor>(&scene_.bath)) {
      positive(t->temperature, "temperature");
      require(!periodic_upwards(), "/bath", "a thermal floor needs a floor, but the box is periodic upwards");
    }
  }

  // Is there room for all the disks, also when the floor is at its highest position?
  void room() {
    if (std::isinf(height())) return;
    const auto* lid = std::get_if<Lid>(&scene_.box.top);
    const bool squeezed = lid != nullptr && !lid->is_free() && highest_floor() > 0;
    double area = 0;
    for (const Species& s : scene_.disks.species) area += s.count * std::numbers::pi / 4 * s.diameter * s.diameter;
    const double fraction = area / (scene_.box.width * (height() - (squeezed ? highest_floor() : 0)));
    require(fraction <= std::numbers::pi / (2 * std::numbers::sqrt3), "/box",
            "the disks would cover the fraction " + number(fraction) + " of the box" +
                (squeezed ? " when the floor is at its highest position" : "") +
                ", but no packing of equal disks covers more than 0.9069. Give fewer disks or a larger box");
  }

  const Scene& scene_;
  std::vector<SceneProblem> problems_;
};

}  // namespace

std::uint32_t Scene::count() const {
  std::uint32_t sum = 0;
  for (const Species& s : disks.species) sum += s.count;
  if (const auto* placed = std::get_if<PlacedStart>(&start)) return static_cast<std::uint32_t>(placed->disks.size());
  return sum;
}

std::vector<SceneProblem> check(const Scene& scene) { return Check(scene)(); }

}  // namespace shakebed::sim
