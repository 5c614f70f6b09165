#include "fit/map/gamma_temperature.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "fit/theory/fermi_profile.hpp"
#include "fit/theory/printed.hpp"

namespace shakebed::fit {

namespace {

constexpr std::array<ExpansionReading, 2> expansions{ExpansionReading::mu, ExpansionReading::mu_squared};
constexpr std::array<ExpansionConstantsSource, 3> sources{
    ExpansionConstantsSource::computed, ExpansionConstantsSource::close_packed, ExpansionConstantsSource::printed};

// A reading before any number is put in.
struct ReadingKey {
  ExpansionReading expansion;
  JumpHeight jump;
  ExpansionConstantsSource constants;
};

std::vector<ReadingKey> all_readings() {
  std::vector<ReadingKey> keys;
  for (const ExpansionReading expansion : expansions) {
    for (const ExpansionConstantsSource source : sources) {
      for (const JumpHeight jump : jump_heights) keys.push_back({expansion, jump, source});
    }
  }
  for (const JumpHeight jump : jump_heights) {
    keys.push_back({ExpansionReading::fermi, jump, ExpansionConstantsSource::computed});
  }
  return keys;
}

// What a bed lends to every reading.
struct BedNumbers {
  ValueStatus status = ValueStatus::ok;
  double initial_height = 0.0;
  double critical_temperature = 0.0;
  std::array<double, 3> k{};  // in the order of sources
  std::array<ValueStatus, 3> k_status{};
};

BedNumbers bed_numbers(const ShakenBed& bed, const EquationOfState& equation) {
  BedNumbers numbers;
  numbers.initial_height = bed.column.initial_height();
  const Value critical = critical_temperature(equation, bed.column);
  numbers.status = critical.status;
  if (!std::isfinite(bed.acceleration_length) || bed.acceleration_length <= 0.0) {
    numbers.status = ValueStatus::invalid_argument;
  }
  numbers.critical_temperature = critical.value;
  const ExpansionConstants computed = expansion_constants(equation, bed.column.plateau_density);
  const ExpansionConstants packed = expansion_constants(equation, close_packing_density);
  numbers.k = {computed.k, packed.k, expansion_coefficient(printed::lambda_1, printed::mu_0, close_packing_density)};
  numbers.k_status = {computed.status, packed.status, ValueStatus::ok};
  return numbers;
}

// Mean jump heights of a bouncing ball against Gamma, for the way back. The mean is not monotone where the bounces are
// chaotic: the answer is the lowest Gamma of the table's reach (1 to 30) at which it passes the height asked for. The
// table grows as far as it is read.
class BounceTable {
 public:
  BounceTable(double restitution, const WaveForm& wave) : restitution_(restitution), wave_(wave) {}
  [[nodiscard]] Value gamma(JumpHeight jump, double height) {
    const auto kind = static_cast<std::size_t>(jump);
    for (std::size_t i = 1; reaches(i); ++i) {
      const double low = means_[i - 1][kind];
      const double high = means_[i][kind];
      if (low <= height && high >= height) {
        return {gammas_[i - 1] + (gammas_[i] - gammas_[i - 1]) * (high > low ? (height - low) / (high - low) : 0.0)};
      }
    }
    return no_value(ValueStatus::outside_range);
  }

 private:
  bool reaches(std::size_t place) {
    for (; gammas_.size() <= place && next_ < 30.0; next_ *= 1.02) {
      gammas_.push_back(next_);
      means_.push_back(
          bounce(next_, {.restitution = restitution_, .transient = 200, .flights = 400}, wave_).mean_height);
    }
    return place < gammas_.size();
  }

  double restitution_, next_ = 1.0;
  const WaveForm& wave_;
  std::vector<double> gammas_;
  std::vector<std::array<double, 4>> means_;
};

// The largest theta/mu for which the low-temperature rise of the Fermi profile is meant: exp(-mu/theta) = 0.01.
const double fermi_limit = 1.0 / std::log(100.0);

}  // namespace

std::string_view to_string(ExpansionReading reading) {
  switch (reading) {
    case ExpansionReading::mu:
      return "mu";
    case ExpansionReading::mu_squared:
      return "mu_squared";
    case ExpansionReading::fermi:
      return "fermi";
  }
  return "unknown";
}

std::string_view to_string(ExpansionConstantsSource source) {
  switch (source) {
    case ExpansionConstantsSource::computed:
      return "computed";
    case ExpansionConstantsSource::close_packed:
      return "close_packed";
    case ExpansionConstantsSource::printed:
      return "printed";
  }
  return "unknown";
}

double acceleration_length(double gravity, double frequency, double diameter) {
  const double w = 2.0 * std::numbers::pi * frequency;
  return gravity / (w * w * diameter);
}

std::string reading_name(ExpansionReading expansion, JumpHeight jump, ExpansionConstantsSource constants) {
  std::string name = expansion == ExpansionReading::mu           ? "eq5/"
                     : expansion == ExpansionReading::mu_squared ? "eq6/"
                                                                 : "fermi/";
  name += to_string(jump);
  if (expansion != ExpansionReading::fermi && constants != ExpansionConstantsSource::computed) {
    name += '/';
    name += to_string(constants);
  }
  return name;
}

std::vector<Reading> temperatures_from_gamma(const ShakenBed& bed, const EquationOfState& equation,
                                             const WaveForm& wave) {
  const BedNumbers numbers = bed_numbers(bed, equation);
  std::array<Value, 4> jumps;
  if (bed.restitution > 0.0 && bed.gamma > 1.0) {
    const BounceStatistics statistics = bounce(bed.gamma, {.restitution = bed.restitution}, wave);
    for (std::size_t i = 0; i < jumps.size(); ++i) jumps[i] = {statistics.mean_height[i], statistics.status};
  } else {
    for (std::size_t i = 0; i < jumps.size(); ++i) jumps[i] = fit::jump_height(jump_heights[i], bed.gamma, wave);
  }
  std::vector<Reading> readings;
  const double mu = numbers.initial_height;
  for (const ReadingKey& key : all_readings()) {
    Reading reading;
    reading.name = reading_name(key.expansion, key.jump, key.constants);
    reading.jump_height = key.jump;
    reading.expansion = key.expansion;
    reading.constants = key.constants;
    const Value jump = jumps[static_cast<std::size_t>(key.jump)];
    const auto source = static_cast<std::size_t>(key.constants);
    reading.status = !jump.ok() ? jump.status
                     : numbers.status != ValueStatus::ok
                         ? numbers.status
                         : (key.expansion == ExpansionReading::fermi ? ValueStatus::ok : numbers.k_status[source]);
    if (jump.ok() && jump.value < 0.0) reading.status = ValueStatus::outside_range;
    if (reading.status == ValueStatus::ok) {
      reading.jump = jump.value * bed.acceleration_length;
      reading.rise = key.expansion == ExpansionReading::mu_squared ? reading.jump / mu : reading.jump;
      if (key.expansion == ExpansionReading::fermi) {
        // pi^2 theta^2/(6 mu) = rise
        reading.temperature = std::sqrt(6.0 * mu * reading.rise) / std::numbers::pi;
        reading.reduced_temperature = reading.temperature / numbers.critical_temperature;
        reading.in_range = reading.temperature <= fermi_limit * mu;
      } else {
        // (mu/2) k (T/T_c)^2 = rise
        reading.reduced_temperature = std::sqrt(2.0 * reading.rise / (mu * numbers.k[source]));
        reading.temperature = reading.reduced_temperature * numbers.critical_temperature;
        reading.in_range = reading.reduced_temperature <= 1.0;
      }
    }
    readings.push_back(std::move(reading));
  }
  return readings;
}

std::vector<GammaReading> gammas_from_temperature(double temperature, const ShakenBed& bed,
                                                  const EquationOfState& equation, const WaveForm& wave) {
  const BedNumbers numbers = bed_numbers(bed, equation);
  std::vector<GammaReading> readings;
  std::optional<BounceTable> table;
  if (bed.restitution > 0.0) table.emplace(bed.restitution, wave);
  const double mu = numbers.initial_height;
  for (const ReadingKey& key : all_readings()) {
    GammaReading reading;
    reading.name = reading_name(key.expansion, key.jump, key.constants);
    const auto source = static_cast<std::size_t>(key.constants);
    reading.status = !std::isfinite(temperature) || temperature < 0.0 ? ValueStatus::invalid_argument
                     : numbers.status != ValueStatus::ok              ? numbers.status
                     : key.expansion == ExpansionReading::fermi       ? ValueStatus::ok
                                                                      : numbers.k_status[source];
    if (reading.status == ValueStatus::ok) {
      double rise = 0.0;
      if (key.expansion == ExpansionReading::fermi) {
        rise = fermi_center_of_mass_rise(temperature, mu);
        reading.in_range = temperature <= fermi_limit * mu;
      } else {
        const double reduced = temperature / numbers.critical_temperature;
        rise = 0.5 * mu * numbers.k[source] * reduced * reduced;
        reading.in_range = reduced <= 1.0;
      }
      const double jump = key.expansion == ExpansionReading::mu_squared ? rise * mu : rise;
      const double height = jump / bed.acceleration_length;
      const Value gamma = table ? table->gamma(key.jump, height) : gamma_for_jump_height(key.jump, height, wave);
      reading.status = gamma.status;
      reading.gamma = gamma.value;
      reading.in_range = reading.in_range && gamma.ok();
    }
    readings.push_back(std::move(reading));
  }
  return readings;
}

}  // namespace shakebed::fit
