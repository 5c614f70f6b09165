// implements: ingest/find/find_disks.hpp
// The radius of the beads behind shading, blur and the camera's tone curve.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_profile.hpp"
#include "ingest/find/bed_light.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/learned_beads.hpp"
#include "ingest/find/rim_line.hpp"

namespace shakebed::ingest {

double radius_error(const FinderCalibration& calibration, double spread, double beads, double doubt) {
  // The rim of each disk, 2 pi R px long, sees its level change by 1/(2 sqrt(pi) edge) per px^2. The model is accurate
  // to 0.002 px.
  const double information = beads * 2 * 3.14159265 * calibration.rim_radius_px /
                             (2 * std::sqrt(3.14159265) * std::max(0.3, calibration.edge_width_px));
  return std::hypot(spread / std::sqrt(information), 0.002, doubt);
}

namespace {

// Recorded levels and light, of a camera that encodes for display; light is 1 at the brightest level of the field.
// Levels come in a few hundred values: a table is as good as the power.
class DisplayCurve {
 public:
  explicit DisplayCurve(const LightField& light) : light_(highest + 2), level_(4097) {
    for (std::size_t k = 0; k < light.background.size(); ++k)
      brightest_ = std::max({brightest_, static_cast<double>(light.background[k]),
                             static_cast<double>(light.background[k] + light.contrast[k])});
    for (std::size_t k = 0; k < light_.size(); ++k)
      light_[k] = static_cast<float>(to_light(brightest_ * static_cast<double>(k) / (highest / 2)));
    for (std::size_t k = 0; k < level_.size(); ++k)
      level_[k] = static_cast<float>(brightest_ * std::pow(static_cast<double>(k) / 2048, display_exponent));
    per_level_ = static_cast<float>(highest / 2 / brightest_);
  }
  [[nodiscard]] double to_light(double level) const {
    return std::pow(std::max(0.0, level) / brightest_, 1 / display_exponent);
  }
  [[nodiscard]] float quick_light(float level) const { return look_up(light_, level * per_level_); }
  [[nodiscard]] float quick_level(float light) const { return look_up(level_, light * 2048); }

 private:
  static constexpr int parts = 8, highest = 512 * parts;
  static float look_up(const std::vector<float>& table, float place) {
    const float inside = std::clamp(place, 0.0F, static_cast<float>(static_cast<int>(table.size()) - 2));
    const auto cell = static_cast<std::size_t>(inside);
    return table[cell] + (inside - static_cast<float>(static_cast<int>(cell))) * (table[cell + 1] - table[cell]);
  }
  double brightest_ = 1;
  float per_level_ = 1;
  std::vector<float> light_, level_;
};

GrayFrame in_light(const GrayFrame& frame, const DisplayCurve& curve) {
  GrayFrame lit = frame;
  for (float& level : lit.pixels)
    if (!unseen(level)) level = curve.quick_light(level);
  return lit;
}

LightField in_light(const LightField& light, const DisplayCurve& curve) {
  LightField field = light;
  for (std::size_t k = 0; k < light.background.size(); ++k) {
    const double background = curve.to_light(static_cast<double>(light.background[k]));
    field.background[k] = static_cast<float>(background);
    field.contrast[k] =
        static_cast<float>(curve.to_light(static_cast<double>(light.background[k] + light.contrast[k])) - background);
  }
  return field;
}

// The same frame read as one encoded for display: put back into light, where rims of touching beads add up, the bead
// learned there, and the frame it makes encoded again.
class ReadingInLight {
 public:
  ReadingInLight(const FinderCalibration& calibration, const LearnedBeads& beads)
      : beads_(beads),
        light_(calibration.light),
        curve_(calibration.light),
        frame_(in_light(beads.seen.front(), curve_)),
        field_(in_light(calibration.light, curve_)) {
    if (!start_profile(calibration.profile)) return;
    const GrayFrame flat = flatten(frame_, field_);
    JointFit fit(flat);
    learn(fit, flat, calibration);
    noise = residual_spread(fit);
    compare(fit, flat);
  }

  BeadProfile profile;  // of light
  double noise = 0;     // contrast units of light
  // What remains where rims are, in squares of grey levels: of this reading, and of the levels as recorded.
  double unexplained = 0, unexplained_as_recorded = 0;
  std::size_t pixels = 0;

 private:
  // The recorded profile in light. False when light hardly differs between bead and background.
  bool start_profile(const BeadProfile& recorded) {
    profile = recorded;
    profile.fourth_harmonic.assign(recorded.fourth_harmonic.size(), 0.0F);
    profile.asymmetry = nullptr;
    const double background = mean_background(light_), contrast = mean_contrast(light_);
    const double from = curve_.to_light(background), span = curve_.to_light(background + contrast) - from;
    if (!(std::abs(span) > 0.02)) return false;
    for (float& level : profile.level)
      level = static_cast<float>((curve_.to_light(background + contrast * static_cast<double>(level)) - from) / span);
    return true;
  }

  void learn(JointFit& fit, const GrayFrame& flat, const FinderCalibration& calibration) {
    constexpr int rounds = 3;
    const std::vector<ModelDisk>& disks = beads_.disks.front();
    for (int round = 0;; ++round) {
      const ProfileTable table(profile, calibration.rim_radius_px, calibration.edge_width_px, 0, false);
      fit.set_table(&table);
      fit.reset(flat, disks);
      if (round == rounds) break;
      profile = learn_profile({&fit}, {&disks}, profile,
                              {.reach_px = profile.reach_px(),
                               .knot_px = beads_.knot,
                               .radius_px = calibration.rim_radius_px,
                               .row_step = round + 1 == rounds ? 1 : 2});
    }
  }

  void compare(const JointFit& fit, const GrayFrame& flat) {
    constexpr float no_rim = 0.02F, no_bead = 0.4F;
    const GrayFrame& recorded = beads_.seen.front();
    for (int row = 0; row < recorded.height; ++row) {
      const float* left_in_light = fit.residual_row(row);
      const float* left = beads_.fits.front()->residual_row(row);
      for (int column = 0; column < recorded.width; ++column) {
        const std::size_t at =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(recorded.width) + static_cast<std::size_t>(column);
        if (unseen(left[column]) || std::abs(left[column]) > no_bead) continue;
        const float model = flat.pixels[at] - left_in_light[column];
        if (model < no_rim || model > 1 - no_rim || std::abs(left_in_light[column]) > no_bead) continue;
        const double here = field_at(field_, field_.contrast, column, row);
        const float expected = curve_.quick_level(frame_.pixels[at] - left_in_light[column] * static_cast<float>(here));
        const double gap = static_cast<double>(recorded.pixels[at] - expected);
        const double as_seen = static_cast<double>(left[column]) * field_at(light_, light_.contrast, column, row);
        ++pixels;
        unexplained += gap * gap;
        unexplained_as_recorded += as_seen * as_seen;
      }
    }
  }

  const LearnedBeads& beads_;
  const LightField& light_;
  const DisplayCurve curve_;
  const GrayFrame frame_;
  const LightField field_;
};

// The radius from all rims and, where nothing explains those (the camera's tone curve bends, or what lies between
// packed beads is neither bead nor background), from those that face open background.
class RadiusFromRims {
 public:
  RadiusFromRims(FinderCalibration& calibration, const LearnedBeads& beads)
      : calibration_(calibration),
        beads_(beads),
        spread_(beads.spread),
        total_(static_cast<double>(beads.total())),
        background_(mean_background(calibration.light)),
        contrast_(mean_contrast(calibration.light)) {}

  void find() {
    packed_ = choose_rim(calibration_.profile, conditions());
    if (!beads_.hold_radius && beads_.learn_profile && (!packed_.rim.good || packed_.exponent != 1)) read_in_light();
    const bool as_packed = packed_.rim.good && !encoded_ && !(linear_ && packed_.exponent != 1);
    if (!beads_.hold_radius && as_packed) {
      take(packed_);
      calibration_.radius_of_all_rims = true;
    }
    if (!as_packed && !encoded_) {  // nothing explains the rim
      constexpr double poorly_known = 0.002;
      doubt_ = std::hypot(0.5 * (packed_.rim.radius_px - rim_radius_), poorly_known * rim_radius_);
    }
    if (!beads_.hold_radius && !as_packed && !encoded_) use_open_rims();
    lie_between_readings(as_packed);
    if (calibration_.tone_exponent != 1)
      calibration_.warnings.push_back(
          "The rims are steeper on their dark side, as in pictures encoded for display. The radius was therefore "
          "measured in levels converted to light intensity: " +
          std::to_string(calibration_.radius_px * calibration_.recorded_px) +
          " px. From the recorded levels it would be " + std::to_string(rim_radius_ * calibration_.recorded_px) +
          " px.");
    calibration_.radius_std_error_px = radius_error(calibration_, spread_, total_, doubt_);
  }

 private:
  [[nodiscard]] RimConditions conditions() const {
    return {.radius_px = rim_radius_,
            .edge_px = calibration_.edge_width_px,
            .knot_px = beads_.knot,
            .noise = spread_,
            .beads = total_,
            .background_level = background_,
            .bead_level = std::max(0.0, background_ + contrast_)};
  }

  void take(const RimChoice& choice) {
    calibration_.radius_px = choice.rim.radius_px;
    calibration_.tone_exponent = choice.exponent;
    doubt_ = choice.rim.std_error_px;
  }

  // Rims add up where beads touch: in light, or in recorded levels. The camera's is the one that explains the frame.
  void read_in_light() {
    const ReadingInLight reading(calibration_, beads_);
    constexpr double clearly_less = 0.9, clearly_more = 1.03, fair = 2;
    const double noise = fair * spread_ * contrast_, pixels = static_cast<double>(reading.pixels);
    linear_ = pixels > 0 && reading.unexplained > clearly_more * reading.unexplained_as_recorded &&
              reading.unexplained_as_recorded < noise * noise * pixels;
    if (!(pixels > 0 && reading.unexplained < clearly_more * reading.unexplained_as_recorded)) return;
    RimConditions lit = conditions();
    lit.noise = reading.noise;
    lit.background_level = 0;
    lit.bead_level = 1;
    lit.linear_only = true;
    const RimChoice choice = choose_rim(reading.profile, lit);
    if (choice.rim.std_error_px > 0) in_light_ = choice.rim;
    encoded_ = in_light_ && reading.unexplained < clearly_less * reading.unexplained_as_recorded;
    if (encoded_) take({choice.rim, display_exponent});
  }

  [[nodiscard]] RimChoice choose_open(const FreeRim& free_rim, bool linear_only) const {
    RimConditions open = conditions();
    open.knot_px = free_rim.profile.step_px;
    open.beads = static_cast<double>(free_rim.sectors) / sectors_of_bead;
    open.from_px = free_rim.inner_px;
    open.linear_only = linear_only;
    return choose_rim(free_rim.profile, open);
  }

  void use_open_rims() {
    const double edge = calibration_.edge_width_px;
    const FreeRim free_rim = learn_free_rim(beads_.flats, beads_.disk_pointers(), rim_radius_, edge);
    constexpr std::size_t fewest_sectors = 20;
    if (free_rim.sectors < fewest_sectors) return;
    constexpr double poor_misfit = 0.012;
    RimChoice open = choose_open(free_rim, linear_);
    if (open.rim.good && open.exponent != 1 && packed_.exponent == 1) {  // a tone curve is every rim's
      const double curved = open.rim.radius_px;
      open = choose_open(free_rim, true);
      open.rim.std_error_px = std::hypot(open.rim.std_error_px, 0.25 * (curved - open.rim.radius_px));
    }
    const ToneFit tone =
        fit_tone_exponent(free_rim.profile, background_, std::max(0.0, background_ + contrast_), rim_radius_, edge);
    if (open.rim.good) {
      const double doubt = doubt_;
      take(open);
      // Rims that face background and all rims should give the same.
      const double apart = open.exponent == packed_.exponent ? 0.5 * (open.rim.radius_px - packed_.rim.radius_px) : 0;
      doubt_ = std::hypot(doubt, doubt_, apart);
    } else if (tone.linear.good &&
               ((tone.open && !linear_) || fit_rim(calibration_.profile, rim_radius_, edge).misfit > poor_misfit)) {
      take_by_tone(tone);
    }
  }

  void take_by_tone(const ToneFit& tone) {
    constexpr double believed = 0.9;
    const double weight = linear_ ? 0 : tone.encoded_weight;
    calibration_.tone_exponent = weight > believed ? display_exponent : 1;
    calibration_.radius_px = linear_ ? tone.linear.radius_px : tone.radius_px;
    doubt_ = linear_ ? std::hypot(doubt_, 0.5 * (tone.linear.radius_px - packed_.rim.radius_px))
                     : std::hypot(doubt_, tone.std_error_px);
    between_readings_ = tone.open && !linear_;
    if (weight <= 1 - believed || weight >= believed) return;
    char text[400];
    std::snprintf(text, sizeof text,
                  "The rims do not show whether grey levels are proportional to light (radius %.2f px) or encoded for "
                  "display (%.2f px). The radius lies between the two, and its error covers both. Give the length of a "
                  "pixel to remove this doubt.",
                  tone.linear.radius_px * calibration_.recorded_px, tone.encoded.radius_px * calibration_.recorded_px);
    calibration_.warnings.emplace_back(text);
  }

  // Rims as recorded and in light may do as well, or as badly, where hardly any touch: the radius lies between the two.
  void lie_between_readings(bool as_packed) {
    if (beads_.hold_radius || encoded_ || !in_light_ || between_readings_) return;
    if (!(as_packed ? packed_.exponent != 1 : calibration_.tone_exponent == 1)) return;
    const double half = 0.5 * (in_light_->radius_px - calibration_.radius_px);
    calibration_.radius_px += half;
    doubt_ = std::hypot(doubt_, half, 0.5 * in_light_->std_error_px);
  }

  FinderCalibration& calibration_;
  const LearnedBeads& beads_;
  const double spread_, total_, background_, contrast_;
  const double rim_radius_ = calibration_.rim_radius_px;
  RimChoice packed_;                       // of all rims
  double doubt_ = 0;                       // px
  bool encoded_ = false, linear_ = false;  // the camera's levels, where clear
  bool between_readings_ = false;
  std::optional<RimFit> in_light_;  // the radius if the camera encodes, while that is not settled
};

// A face may end at the inner edge of a line along the rim. A radius that is known, and hardly differs, stays.
void take_outer_edge(FinderCalibration& calibration, const LearnedBeads& beads) {
  constexpr double hardly_known = 0.03, far_from_known = 0.05;
  std::vector<Circle> circles;
  for (const ModelDisk& disk : beads.disks.front()) circles.push_back({disk.x, disk.y, calibration.radius_px});
  const auto line = line_at_rim(beads.seen.front(), circles, circles, calibration.radius_px, calibration.polarity);
  if (!line || (calibration.radius_std_error_px < hardly_known * calibration.radius_px &&
                std::abs(line->outer_px / calibration.radius_px - 1) < far_from_known))
    return;
  calibration.radius_px = line->outer_px;
  calibration.radius_std_error_px = line->std_error_px;
  calibration.radius_of_all_rims = false;
}

}  // namespace

void tell_radius(CalibrationResult& result) {
  if (!result.found || !result.beads || result.beads->noted) return;
  result.beads->noted = true;
  FinderCalibration& calibration = result.calibration;
  RadiusFromRims(calibration, *result.beads).find();
  if (!result.beads->hold_radius) take_outer_edge(calibration, *result.beads);
}

void RadiusFromFrames::add(const FindResult& found) {
  if (found.profile_beads == 0) return;
  if (sums_.empty()) {
    step_px_ = found.profile.step_px;
    sums_.assign(found.profile.level.size(), 0.0);
  }
  if (found.profile.level.size() != sums_.size()) return;
  for (std::size_t k = 0; k < sums_.size(); ++k)
    sums_[k] += static_cast<double>(found.profile_beads) * static_cast<double>(found.profile.level[k]);
  beads_ += found.profile_beads;
  ++frames_;
}

void RadiusFromFrames::refine(FinderCalibration& calibration) const {
  if (frames_ < 2 || !calibration.radius_of_all_rims) return;
  BeadProfile mean;
  mean.step_px = step_px_;
  for (const double sum : sums_) mean.level.push_back(static_cast<float>(sum / static_cast<double>(beads_)));
  const double contrast = calibration.contrast_level, background = mean_background(calibration.light);
  const double spread = calibration.residual_level / std::max(1e-6, std::abs(contrast));
  const double beads = static_cast<double>(beads_);
  const RimChoice choice = choose_rim(mean, {.radius_px = calibration.rim_radius_px,
                                             .edge_px = calibration.edge_width_px,
                                             .knot_px = knot_for(calibration.rim_radius_px, calibration.edge_width_px),
                                             .noise = spread,
                                             .beads = beads,
                                             .background_level = background,
                                             .bead_level = std::max(0.0, background + contrast)});
  if (!choice.rim.good || choice.exponent != calibration.tone_exponent) return;
  calibration.radius_px = choice.rim.radius_px;
  calibration.radius_std_error_px = radius_error(calibration, spread, beads, choice.rim.std_error_px);
}

}  // namespace shakebed::ingest
