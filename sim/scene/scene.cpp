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
            "a restitution lies between 0 and 1, not " + number(s.restitution));
    require(s.law_speed > 0 && std::isfinite(s.law_speed), where + "/restitution_speed",
            "the speed at which the restitution holds is positive, not " + number(s.law_speed));
    require(s.law != RestitutionLaw::viscoelastic || s.restitution > 0, where + "/restitution",
            "viscoelastic bodies have a restitution above 0 at every speed");
    require(s.friction >= 0 && std::isfinite(s.friction), where + "/friction",
            "a friction coefficient is not negative, but this one is " + number(s.friction));
    require(s.tangential_restitution >= -1 && s.tangential_restitution <= 1, where + "/tangential_restitution",
            "a tangential restitution lies between -1 and 1, not " + number(s.tangential_restitution));
  }
  bool falls() const { return std::holds_alternative<UniformGravity>(scene_.gravity); }
  bool periodic_upwards() const { return std::holds_alternative<PeriodicTop>(scene_.box.top); }
  double height() const {
    if (const auto* lid = std::get_if<Lid>(&scene_.box.top)) return lid->height;
    if (const auto* top = std::get_if<PeriodicTop>(&scene_.box.top)) return top->height;
    return INFINITY;
  }

  void disks() {
    const Disks& d = scene_.disks;
    require(d.species.size() == 1 || d.species.size() == 2, "/disks",
            "there are one or two species, not " + std::to_string(d.species.size()));
    for (const Species& s : d.species) {
      require(s.diameter > 0 && std::isfinite(s.diameter), "/disks/diameter",
              "a diameter is positive, not " + number(s.diameter));
      require(s.mass > 0 && std::isfinite(s.mass), "/disks/mass", "a mass is positive, not " + number(s.mass));
    }
    require(scene_.count() < 1u << 28, "/disks/count", "more than 268,435,455 disks cannot be numbered");
    surface(d.contact, "/disks");
    require(
        d.inertia_ratio > 0 && d.inertia_ratio <= 1, "/disks/inertia",
        "I/(m R^2) lies above 0 and not above 1 (1/2 for a disk, 2/5 for a sphere), not " + number(d.inertia_ratio));
    require(d.contact_duration >= 0 && std::isfinite(d.contact_duration), "/disks/contact_duration",
            "a contact's duration is not negative, but this one is " + number(d.contact_duration));
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
                " D is too narrow: a disk could meet two images of the same one; at least " + number(least) +
                " D are needed");
    require(!periodic_upwards() || height() >= least, "/box/height",
            "a periodic box of " + number(height()) + " D is too low: at least " + number(least) + " D are needed");
    require(!periodic_upwards() || periodic, "/box/sides", "a box that is periodic upwards has periodic sides too");
    require(!(periodic_upwards() && falls()), "/box/height",
            "a box that is periodic upwards has no gravity: a disk would fall for ever");
    require(falls() || !std::holds_alternative<OpenTop>(b.top), "/box/lid",
            "without gravity an open box loses its disks: give it a lid, or make it periodic");
    if (const auto* sides = std::get_if<HardSides>(&b.sides)) {
      surface(sides->surface, "/box/sides");
      constexpr double least_slope = 1e-3,
                       most_slope = 1.2;  // 0.06 and 69 deg: beyond, a wall is another or hardly leans
      require(sides->slope == 0 || (sides->slope >= least_slope && sides->slope <= most_slope), "/box/sides/slope",
              "sides slope outwards by 0.001 to 1.2 rad, or not at all (0), not by " + number(sides->slope) + " rad");
      require(!(sides->slope > 0) || falls(), "/box/sides/slope", "sloped sides need gravity");
    }
    if (const auto* lid = std::get_if<Lid>(&b.top)) {
      surface(lid->surface, "/box/lid");
      require(lid->mass > 0, "/box/lid/mass", "a lid that moves has a mass above 0, not " + number(lid->mass));
      require(!lid->is_free() || falls(), "/box/lid/mass", "a lid that moves needs gravity");
      require(!lid->is_free() || lid->surface.friction == 0, "/box/lid/friction",
              "a lid that moves is smooth: friction is known with walls of infinite mass only");
    }
    surface(b.floor_surface, "/floor");
  }

  void floor() {
    double amplitude = 0;
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene_.box.floor)) {
      amplitude = sine->amplitude;
      require(sine->amplitude > 0 && std::isfinite(sine->amplitude), "/floor/amplitude",
              "an amplitude is positive, not " + number(sine->amplitude) + "; a floor that stands still is \"still\"");
      require(sine->frequency > 0 && std::isfinite(sine->frequency), "/floor/frequency",
              "a frequency is positive, not " + number(sine->frequency));
    } else if (const auto* table = std::get_if<TabulatedFloor>(&scene_.box.floor)) {
      require(table->period > 0 && std::isfinite(table->period), "/floor/period",
              "a period is positive, not " + number(table->period));
      require(table->heights.size() >= 4, "/floor/heights",
              "a period of the floor needs at least 4 positions, not " + std::to_string(table->heights.size()));
      for (double h : table->heights) {
        require(std::isfinite(h), "/floor/heights", "a position of the floor is not a number");
        amplitude = std::max(amplitude, std::abs(h));
      }
      if (!table->heights.empty()) {
        const auto [low, high] = std::minmax_element(table->heights.begin(), table->heights.end());
        require(*high > *low, "/floor/heights",
                "the floor's positions are all the same; a floor that stands still is \"still\"");
      }
    } else {
      return;
    }
    require(!(amplitude > 1e9), "/floor", "the floor moves farther than 1e9 D");
    require(!periodic_upwards(), "/floor/motion", "a box that is periodic upwards has no floor that could move");
    double largest = 0;
    for (const Species& s : scene_.disks.species) largest = std::max(largest, s.diameter);
    require(height() > amplitude + largest, "/box/lid",
            "the lid at " + number(height()) + " D leaves no room for a disk above the floor, which rises to " +
                number(amplitude) + " D");
  }

  void plates() {
    const auto* plates = std::get_if<RubbingPlates>(&scene_.box.plates);
    if (plates == nullptr) return;
    require(plates->deceleration > 0 && std::isfinite(plates->deceleration), "/box/plates",
            "the friction with the plates slows a disk down by more than 0, not by " + number(plates->deceleration));
    require(plates->interval > 0 && std::isfinite(plates->interval), "/box/plates/interval",
            "the interval at which friction with the plates acts is positive, not " + number(plates->interval));
    double smallest = std::numeric_limits<double>::infinity();
    for (const Species& s : scene_.disks.species) smallest = std::min(smallest, s.diameter / 2);
    require(plates->contact_radius >= 0 && plates->contact_radius <= smallest, "/box/plates/contact_radius",
            "the contact of a disk with the plate has a radius from 0 to that of the smallest disk, " +
                number(smallest) + " D, not " + number(plates->contact_radius));
    if (const auto* sine = std::get_if<SinusoidalFloor>(&scene_.box.floor)) interval_of(*plates, 1 / sine->frequency);
    if (const auto* table = std::get_if<TabulatedFloor>(&scene_.box.floor)) interval_of(*plates, table->period);
  }
  void interval_of(const RubbingPlates& plates, double period) {
    constexpr double least_a_period = 20;
    require(plates.interval * least_a_period <= period, "/box/plates/interval",
            "friction with the plates acts every " + number(plates.interval) + " sqrt(D/g), which is more than a " +
                number(least_a_period) + "th of the floor's period of " + number(period) + " sqrt(D/g)");
  }

  void bath() {
    const auto positive = [&](double value, const char* name) {
      require(value > 0 && std::isfinite(value), std::string("/bath/") + name,
              std::string("must be positive, not ") + number(value));
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
              "white noise heats a bed without dissipation without limit: with restitution 1 there is no steady "
              "temperature");
    } else if (const auto* t = std::get_if<ThermalFloor>(&scene_.bath)) {
      positive(t->temperature, "temperature");
      require(!periodic_upwards(), "/bath", "a thermal floor needs a floor, but the box is periodic upwards");
    }
  }

  // Is there room for all the disks?
  void room() {
    if (std::isinf(height())) return;
    double area = 0;
    for (const Species& s : scene_.disks.species) area += s.count * std::numbers::pi / 4 * s.diameter * s.diameter;
    const double fraction = area / (scene_.box.width * height());
    require(
        fraction <= std::numbers::pi / (2 * std::numbers::sqrt3), "/box",
        "the disks would cover " + number(fraction) + " of the box; no packing of equal disks covers more than 0.9069");
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
