// implements: ingest/find/find_disks.hpp
// Learning from a film's first frames all that finding needs.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "ingest/calibrate/solid_borders.hpp"
#include "ingest/find/bead_profile.hpp"
#include "ingest/find/bead_set.hpp"
#include "ingest/find/bed_light.hpp"
#include "ingest/find/candidates.hpp"
#include "ingest/find/learned_beads.hpp"
#include "statistics/ranks.hpp"

namespace shakebed::ingest {

namespace {

// px: what the edge of a floor or wall is blurred by before that of beads is known.
constexpr double usual_edge = 0.75;
// Light and profile are learned in turns at least this often, and no more often than the second.
constexpr int least_rounds = 5, most_learning_rounds = 12;
// Contrast units: what is left is larger than the beads, so light and bead run away from the frame.
constexpr double runs_away = 3;
// Contrast units beyond the noise: where more is left than that, the frame shows something else.
constexpr double most_left_over = 0.2;
// Of the radius a start begins with: how far the radius may go from it.
constexpr double farthest_radius = 0.12;
// px: the outline no longer moves the centres.
constexpr double still = 0.01;

// How far inside a border its blurred edge reaches.
double border_margin(double edge) { return 0.5 + 2 * edge; }

// The level of an even area in contrast units: 0 is the background there, 1 the beads.
double level_in(const LightField& light, const SolidBorder& border, const GrayFrame& frame) {
  const double place = 0.5 * (border.from + border.to), depth = 0.5 * (border.depth_px + border.slope * place);
  const double x = border.side == FrameSide::left    ? depth
                   : border.side == FrameSide::right ? frame.width - 1 - depth
                                                     : place;
  const double y = border.side == FrameSide::top      ? depth
                   : border.side == FrameSide::bottom ? frame.height - 1 - depth
                                                      : place;
  const auto node = [&](double at, int nodes) {
    return static_cast<std::size_t>(std::clamp(at / light.spacing_px + 0.5, 0.0, nodes - 1.0));
  };
  const std::size_t at = node(y, light.rows) * static_cast<std::size_t>(light.columns) + node(x, light.columns);
  return (border.level - static_cast<double>(light.background[at])) / static_cast<double>(light.contrast[at]);
}

bool is_background(const SolidBorder& border, const LightField& light, const GrayFrame& frame) {
  constexpr double same = 0.15;
  return std::abs(level_in(light, border, frame)) < same;
}

// Takes out what has the level of the background already at first sight.
void drop_plain_background(std::vector<SolidBorder>& borders, const GrayFrame& frame, Polarity polarity) {
  if (borders.empty()) return;
  const GrayFrame open = without_borders(frame, borders, 0);
  std::vector<float> levels;
  const std::size_t step = std::max<std::size_t>(1, open.pixels.size() / 40000);
  for (std::size_t k = 0; k < open.pixels.size(); k += step)
    if (!unseen(open.pixels[k])) levels.push_back(open.pixels[k]);
  if (levels.empty()) return;
  const auto level_of = [&](double part) { return static_cast<double>(quantile_of(levels, part)); };
  constexpr double outermost = 0.05, same = 0.25;
  const bool dark = polarity != Polarity::bright_beads;
  const double background = level_of(dark ? 1 - outermost : outermost),
               bead = level_of(dark ? outermost : 1 - outermost);
  std::erase_if(borders, [&](const SolidBorder& border) {
    return std::abs(border.level - background) < same * std::abs(background - bead);
  });
}

class BeadLearner;

// What was learned, from one start.
struct Learned {
  CalibrationResult result;
  double typical = 0;      // share of the contrast that a good bead explains
  bool one_sided = false;  // light from one side was allowed for
  bool background_corrected = false;
  double unexplained = 0;  // of the first frame, grey levels squared
  bool astray = false;     // the radius went as far from the estimate as it may
  // Where learning paused, since it cannot become complete any more: what goes on with it.
  std::shared_ptr<BeadLearner> paused;
};

// How long beads are learned: to the end, or until it shows that a frame will not be explained down to its noise.
enum class LearnUntil { settled, hopeless };

// What learning may take into account.
struct Allowed {
  bool one_sided = true;             // light from one side
  bool corrected_background = true;  // see correct_background()
};

// Where learning begins.
struct Start {
  double radius_px = 0;
  Polarity polarity = Polarity::automatic;
  const FinderCalibration* before = nullptr;  // what was learned of nearly the same frames
};

// Learns all there is to learn but the radius behind the tone curve (see tell_radius).
// Light and profile are learned in turns. In a crystal one can imitate the other: too much light between the beads
// looks like a wider rim. So the rounds go on until the light settles within the noise, or does not settle. In the
// latter case the frame holds more than beads and light.
class BeadLearner {
 public:
  BeadLearner(const std::vector<const GrayFrame*>& frames, const FindOptions& options, const Start& start,
              Allowed allowed)
      : options_(options), start_(start), allowed_(allowed), radius_(start.radius_px) {
    FinderCalibration& calibration = all_.result.calibration;
    calibration.width = frames.front()->width;
    calibration.height = frames.front()->height;
    calibration.polarity = start.polarity;
    calibration.recorded_px = options.recorded_px;
    for (const GrayFrame* frame : frames)
      if (frame->width == calibration.width && frame->height == calibration.height) recorded_.push_back(frame);
    edge_ = start.before ? start.before->edge_width_px : std::clamp(0.08 * radius_, 0.6, 1.5);
    beads_->hold_radius = options.hold_radius;
    beads_->learn_profile = options.learn_profile;
  }

  // Goes on where it paused.
  Learned learn(LearnUntil until) {
    if (seen_by_)
      go_on_plainly();
    else if (beads_->flats.empty())
      begin();
    for (;; ++round_) {
      paused_ = until == LearnUntil::hopeless && cannot_complete();
      if (paused_) return so_far();
      fit_beads(round_);
      if (beads_->total() == 0) return refused("no model of a filled disk fits them");
      if (round_ == 0 && !background_looked_at_ && corrects_background()) {
        --round_;
        continue;
      }
      keep_good_beads(round_);
      if (!(beads_->spread < runs_away)) return refused("no model of the bead and the light describes the frame");
      const bool enough = round_ + 1 >= first_round() + least_rounds && settled_;
      if (round_ + 1 == most_rounds() || enough) break;
      if (options_.learn_profile || round_ < 2) learn_bead(round_);
      outline_moved_px_ = 0;
      const bool may_be_one_sided = allowed_.one_sided && options_.learn_profile && round_ >= 1;
      const bool renewed = may_be_one_sided && (round_ <= 2 || profile_.asymmetry) && !learn_one_sidedness();
      if (round_ >= 1) learn_light(renewed);
      past_.push_back({beads_->spread, radius_, all_.astray});
    }
    return concluded();
  }
  [[nodiscard]] bool paused() const { return paused_; }
  // As it was before light from one side was allowed for: what learns without. None where there is no such light.
  [[nodiscard]] std::shared_ptr<BeadLearner> plain() const { return plain_; }

 private:
  void begin() {
    set_borders_aside();
    profile_ = start_.before ? start_.before->profile : ideal_profile(radius_, edge_, reach_of(radius_, edge_));
    beads_->flats.resize(recorded_.size());
    beads_->fits.resize(recorded_.size());
    beads_->disks.resize(recorded_.size());
    if (!options_.hold_radius && !options_.radius_px && !start_.before) choose_first_radius();
    background_looked_at_ = !allowed_.corrected_background;
    round_ = first_round();
  }

  void keep_plain() {
    plain_ = std::make_shared<BeadLearner>(*this);
    plain_->allowed_.one_sided = false;
    plain_->seen_by_ = beads_;
    plain_->beads_ = std::make_shared<LearnedBeads>();
    plain_->beads_->disks = beads_->disks;
    plain_->beads_->knot = beads_->knot, plain_->beads_->spread = beads_->spread;
    plain_->beads_->hold_radius = beads_->hold_radius, plain_->beads_->learn_profile = beads_->learn_profile;
  }

  // The rest of the round in which light from one side was seen.
  void go_on_plainly() {
    beads_->seen = std::exchange(seen_by_, nullptr)->seen;
    for (const GrayFrame& seen : beads_->seen) {
      beads_->flats.push_back(flatten(seen, light_));
      beads_->fits.push_back(std::make_unique<JointFit>(beads_->flats.back()));
    }
    learn_light(false);
    past_.push_back({beads_->spread, radius_, all_.astray});
    ++round_;
  }

  [[nodiscard]] int first_round() const { return start_.before ? 1 : 0; }
  [[nodiscard]] int most_rounds() const { return (profile_.asymmetry ? 2 : 1) * most_learning_rounds; }

  // What is left may not exceed this, in contrast units, where the frame is explained completely; and where beads are
  // believed at all.
  [[nodiscard]] static double left_if_complete(double noise) { return 1.5 * noise + 0.03; }
  [[nodiscard]] static double left_at_most(double noise) { return std::hypot(noise, most_left_over); }

  // Whether beads lit from one side will not explain the frame completely, even if what is left goes on to fall as it
  // did lately: it falls ever more slowly. The radius must not be on its way to where it may go no farther.
  [[nodiscard]] bool cannot_complete() const {
    constexpr std::size_t lately = 4;
    constexpr double clearly = 1.1;
    if (past_.size() <= lately || !profile_.asymmetry || all_.background_corrected) return false;
    const Past &now = past_.back(), &before = past_[past_.size() - 1 - lately];
    for (std::size_t k = past_.size() - lately; k < past_.size(); ++k)
      if (past_[k].astray != now.astray || (now.astray && past_[k].radius_px != now.radius_px)) return false;
    const double to_come = static_cast<double>(most_rounds() - round_) / static_cast<double>(lately);
    const double moved =
        std::abs(now.radius_px - start_.radius_px) + to_come * std::abs(now.radius_px - before.radius_px);
    if (!now.astray && moved >= farthest_radius * start_.radius_px) return false;
    const double noise = noise_of(beads_->flats.front());
    const double left = now.spread - to_come * std::max(0.0, before.spread - now.spread);
    return now.spread < left_at_most(noise) && left > clearly * left_if_complete(noise);
  }

  [[nodiscard]] Learned so_far() const {
    Learned learned = all_;
    learned.result.found = true;
    learned.result.calibration.radius_px = learned.result.calibration.rim_radius_px = radius_;
    learned.one_sided = true;
    return learned;
  }

  [[nodiscard]] std::string suspected(const std::string& circles) const {
    return circles + " of " + std::to_string(radius_ * options_.recorded_px) + " px radius were examined, but ";
  }

  Learned refused(const std::string& why) {
    all_.result.why_not = "no disks seen: " + suspected("circles") + why;
    return std::move(all_);
  }

  // What is even and ends in a straight line at the border is floor, wall or lid, unless it is background.
  void set_borders_aside() {
    FinderCalibration& calibration = all_.result.calibration;
    for (const GrayFrame* frame : recorded_) {
      borders_.push_back(find_solid_borders(*frame));
      drop_plain_background(borders_.back(), *frame, calibration.polarity);
      beads_->seen.push_back(without_borders(*frame, borders_.back(), -border_margin(usual_edge)));
    }
    light_ = estimate_light(beads_->seen.front(), radius_, calibration.polarity);
    for (std::size_t f = 0; f < recorded_.size(); ++f) {
      std::erase_if(borders_[f],
                    [&](const SolidBorder& border) { return is_background(border, light_, *recorded_[f]); });
      complete_corners(borders_[f], *recorded_[f]);
      beads_->seen[f] = without_borders(*recorded_[f], borders_[f], border_margin(usual_edge));
      calibration.solid_borders = calibration.solid_borders || !borders_[f].empty();
    }
  }

  // Votes fall a little outside the rim of a shaded bead: of two radii, the one whose disks fit better.
  void choose_first_radius() {
    const GrayFrame flat = flatten(beads_->seen.front(), light_);
    const double noise = noise_of(flat), estimated = radius_;
    constexpr double clear_score = 0.5;
    double best_sum = -1;
    for (const double share : {1.0, 0.95}) {
      const double trial = share * estimated;
      double sum = 0;
      for (const DiskCandidate& candidate : candidates_in(flat, trial, noise, clear_score)) sum += candidate.score;
      if (sum <= best_sum) continue;
      best_sum = sum;
      radius_ = trial;
    }
  }

  // Beads are searched for in the first rounds, and fitted in every one.
  void fit_beads(int round) {
    const bool search = round <= 1 || (round == 2 && edge_ > strong_blur * radius_);
    table_ = {profile_, radius_, edge_, round <= 2 ? softening_for(edge_) : softening_for(edge_) * 0.6, round > 0};
    for (std::size_t f = 0; f < recorded_.size(); ++f) {
      GrayFrame& flat = beads_->flats[f];
      std::vector<ModelDisk>& disks = beads_->disks[f];
      flat = flatten(beads_->seen[f], light_);
      if (!beads_->fits[f]) beads_->fits[f] = std::make_unique<JointFit>(flat);
      JointFit& fit = *beads_->fits[f];
      fit.set_table(&table_);
      if (search) {
        const double noise = noise_of(flat);
        disks = disks_at(round == 0 ? candidates_in(flat, radius_, noise, least_candidate_score)
                                    : candidates_by({profile_, radius_, edge_}, flat, noise, least_candidate_score));
      }
      for (ModelDisk& disk : disks) disk.quiet_sweeps = 0;
      fit.reset(flat, disks);
      if (round > 0) {
        if (search) fit.sweep(disks, 0.3 * radius_, 1e-5, residual_bound);
        for (int step = 0; step < 2; ++step) fit.step_together(flat, disks, 0.5, residual_bound);
      }
      fit.judge(disks, radius_ + 1);
      if ((round == 1 || round == 2) && repair(fit, disks, radius_, noise_of(flat)) > 0) {
        for (int sweep = 0; sweep < 2; ++sweep) fit.sweep(disks, 0.2 * radius_, 1e-5, residual_bound);
        settle(fit, disks, radius_);
        fit.step_together(flat, disks, 0.5, residual_bound);
        fit.judge(disks, radius_ + 1);
      }
    }
  }

  // Whether open background lies elsewhere than was thought, and the light was put right.
  bool corrects_background() {
    background_looked_at_ = true;
    const double clear = 1.15 * radius_ + 2;
    std::vector<GrayFrame>& flats = beads_->flats;
    std::vector<TileSums> open = open_background(flats.front(), beads_->disks.front(), clear);
    if (open.size() < fewest_open_tiles && !borders_.front().empty()) {
      // No background is seen between the beads: what was taken for a wall, but lies beyond the background, is it.
      for (std::size_t f = 0; f < recorded_.size(); ++f) {
        const auto removed = std::erase_if(borders_[f], [&](const SolidBorder& border) {
          return level_in(light_, border, beads_->seen[f]) < well_beyond_background;
        });
        if (removed == 0) continue;
        beads_->seen[f] = without_borders(*recorded_[f], borders_[f], border_margin(usual_edge));
        flats[f] = flatten(beads_->seen[f], light_);
      }
      open = open_background(flats.front(), beads_->disks.front(), clear);
    }
    if (!correct_background(light_, flats.front(), open, beads_->disks.front())) return false;
    all_.background_corrected = true;
    return true;
  }

  // The better half stands for the bead: in a mixed bed the rest may be something else.
  void keep_good_beads(int round) {
    std::vector<double> explained;
    for (const auto& one : beads_->disks)
      for (const ModelDisk& disk : one) explained.push_back(disk.explained);
    std::sort(explained.begin(), explained.end());
    all_.typical = explained[explained.size() * 3 / 4];
    for (std::size_t f = 0; f < recorded_.size(); ++f)
      prune(*beads_->fits[f], beads_->disks[f], radius_, (round == 0 ? 0.3 : least_explained) * all_.typical);
    beads_->spread = std::max(1e-3, residual_spread(*beads_->fits.front()));
  }

  // Profile, radius and edge.
  void learn_bead(int round) {
    const double reach = std::max(reach_of(radius_, edge_), round == 0 ? 1.12 * radius_ + 2 : 0.0);
    beads_->knot = round == 0 ? std::clamp(0.05 * radius_, 0.2, std::max(0.25, radius_ / 8)) : knot_for(radius_, edge_);
    const BeadProfile learned = learn_profile(beads_->fit_pointers(), beads_->disk_pointers(), profile_,
                                              {.reach_px = reach,
                                               .knot_px = beads_->knot,
                                               .radius_px = radius_,
                                               .fourth_harmonic = edge_ < 0.6 && round >= 2,
                                               .row_step = round < 2 ? 3 : 1});
    const RimFit rim = fit_rim(learned, radius_, edge_);
    if (rim.good) {  // the first estimate is good to some 5 %: a fit far from it has gone astray
      const double bound = round == 0 ? 0.05 : farthest_radius;
      if (!options_.hold_radius)
        radius_ = std::clamp(rim.radius_px, (1 - bound) * start_.radius_px, (1 + bound) * start_.radius_px);
      all_.astray = !options_.hold_radius && radius_ != rim.radius_px;
      edge_ = std::clamp(rim.edge_px, 0.29, std::max(0.5, 0.3 * radius_));
    }
    profile_ = options_.learn_profile ? learned : ideal_profile(radius_, edge_, reach_of(radius_, edge_));
  }

  // The residuals with the profile as it is now.
  void renew_residuals() {
    table_ = {profile_, radius_, edge_, 0, false};
    for (std::size_t f = 0; f < recorded_.size(); ++f) {
      beads_->fits[f]->set_table(&table_);
      beads_->fits[f]->reset(beads_->flats[f], beads_->disks[f]);
    }
  }

  // Light from one side: the lit side pulls at the centres of radial beads. The outline shows where they are. Whether
  // the profile changed.
  bool learn_one_sidedness() {
    renew_residuals();
    std::shared_ptr<const BeadAsymmetry> asymmetry =
        learn_asymmetry(beads_->fit_pointers(), beads_->disk_pointers(), profile_,
                        {.radius_px = radius_, .noise = beads_->spread, .row_step = profile_.asymmetry ? 1 : 2});
    if (!asymmetry) return false;
    if (!profile_.asymmetry) keep_plain();
    profile_.asymmetry = std::move(asymmetry);
    const Outline outline = outline_of(profile_, radius_, edge_);
    if (!outline.good) return true;
    outline_moved_px_ = std::hypot(outline.x_px, outline.y_px);
    profile_ = recentred(profile_, outline.x_px, outline.y_px);
    for (auto& one : beads_->disks)
      for (ModelDisk& disk : one) {
        disk.x += outline.x_px;
        disk.y += outline.y_px;
      }
    return true;
  }

  void learn_light(bool renewed) {
    if (!renewed) renew_residuals();
    std::vector<TileSums> tiles;
    for (std::size_t f = 0; f < recorded_.size(); ++f)
      add_tile_sums(beads_->flats[f], *beads_->fits[f], beads_->spread, tiles);
    const FinderCalibration& calibration = all_.result.calibration;
    const double change = refine_light(light_, tiles, calibration.width, calibration.height);
    settled_ =
        (change < std::max(3e-4, 0.02 * beads_->spread) || change > 0.7 * last_change_) && outline_moved_px_ < still;
    last_change_ = change;
  }

  Learned concluded() {
    const std::size_t total = beads_->total();
    if (total == 0) return refused("none looks like a filled bead");
    const double spread = beads_->spread, noise = noise_of(beads_->flats.front());
    CalibrationResult& result = all_.result;
    if (spread > left_at_most(noise)) {
      result.why_not =
          "no disks seen: " + suspected(std::to_string(total) + " circles") + "they do not explain the frame";
      return std::move(all_);
    }
    FinderCalibration& calibration = result.calibration;
    calibration.radius_px = calibration.rim_radius_px = radius_;
    calibration.edge_width_px = edge_;
    calibration.profile = profile_;
    calibration.light = light_;
    calibration.contrast_level = mean_contrast(light_);
    calibration.noise_level = residual_noise(*beads_->fits.front()) * std::abs(calibration.contrast_level);
    calibration.residual_level = spread * std::abs(calibration.contrast_level);
    calibration.radius_std_error_px = radius_error(calibration, spread, static_cast<double>(total), 0);
    calibration.level_deciles = level_deciles(beads_->seen.front());
    calibration.frames_used = recorded_.size();
    calibration.disks_used = total;
    result.beads = beads_;
    constexpr std::size_t few = 5;
    if (total < few)
      calibration.warnings.push_back("The shape of a bead was learned from only " + std::to_string(total) +
                                     " disks, so its radius is uncertain. Use more frames.");
    all_.unexplained = unexplained_of(*beads_->fits.front(), light_);
    all_.one_sided = profile_.asymmetry != nullptr;
    result.complete = spread < left_if_complete(noise);
    result.found = true;
    return std::move(all_);
  }

  const FindOptions& options_;
  const Start start_;
  Allowed allowed_;
  Learned all_;
  std::vector<const GrayFrame*> recorded_;
  std::vector<std::vector<SolidBorder>> borders_;  // of each frame
  std::shared_ptr<LearnedBeads> beads_ = std::make_shared<LearnedBeads>();
  double radius_ = 0, edge_ = 0;  // px
  LightField light_;
  BeadProfile profile_;
  ProfileTable table_;  // of the profile; the fits refer to it
  bool background_looked_at_ = false, settled_ = false;
  double last_change_ = 0, outline_moved_px_ = 0;
  int round_ = 0;
  bool paused_ = false;
  std::shared_ptr<BeadLearner> plain_;
  std::shared_ptr<const LearnedBeads> seen_by_;  // of what was kept before light from one side: where its frames are
  // After each round: what is left of the frame, contrast units, and the radius.
  struct Past {
    double spread, radius_px;
    bool astray;
  };
  std::vector<Past> past_;
};

// Which of several starts explains the frames: as estimated, as a packed bed seen from its voids, or any of the other
// circles that were seen.
class StartChooser {
 public:
  StartChooser(const std::vector<const GrayFrame*>& frames, const FindOptions& options)
      : frames_(frames), options_(options) {}

  CalibrationResult choose() {
    estimate();
    if (ends_too_small()) {
      CalibrationResult nothing;
      nothing.why_not = "no disks seen: the circles seen are too small";
      return nothing;
    }
    if (!estimate_.found) {
      Learned nothing;
      nothing.result.why_not = "no disks seen: " + estimate_.why_not;
      return or_another(std::move(nothing));
    }
    if (!(estimate_.packed_radius_px > 0)) return or_another(learn(as_seen()));
    return packed_or_as_seen();
  }

 private:
  [[nodiscard]] Start as_seen() const { return {estimate_.radius_px, estimate_.polarity}; }

  // A first radius and the polarity.
  void estimate() {
    const auto open_part = [](const GrayFrame& frame) { return without_borders(frame, find_solid_borders(frame), 0); };
    if (!options_.radius_px || *options_.radius_px <= 0) {
      for (const GrayFrame* frame : frames_) {
        estimate_ = estimate_radius(open_part(*frame), options_.polarity, smallest_voted_px,
                                    options_.largest_radius_px.value_or(0));
        if (estimate_.packed_radius_px > options_.largest_radius_px.value_or(HUGE_VAL)) estimate_.packed_radius_px = 0;
        if (estimate_.found) return;
      }
      return;
    }
    if (options_.polarity != Polarity::automatic) {
      estimate_.found = true;
      estimate_.polarity = options_.polarity;
    } else {
      estimate_ = estimate_radius(open_part(*frames_.front()), options_.polarity,
                                  std::max(1.0, 0.8 * *options_.radius_px), 1.25 * *options_.radius_px);
    }
    if (estimate_.found) estimate_.radius_px = *options_.radius_px;
    estimate_.packed_radius_px = 0;
  }

  // Whether no start leads to beads of the smallest radius asked for.
  [[nodiscard]] bool ends_too_small() const {
    if (!options_.smallest_radius_px || options_.radius_px) return false;
    constexpr double most_growth = 2;  // three times by 1.12, and what the tone curve adds
    double largest = std::max(estimate_.packed_radius_px, estimate_.found ? estimate_.radius_px : 0.0);
    for (const auto& other : estimate_.others) largest = std::max(largest, other.radius_px);
    return largest > 0 && largest * most_growth < *options_.smallest_radius_px;
  }

  using Learner = std::shared_ptr<BeadLearner>;
  [[nodiscard]] Learner learner_of(const Start& from, const Allowed& allowed) const {
    return std::make_shared<BeadLearner>(frames_, options_, from, allowed);
  }
  static Learned learned_by(const Learner& learner, LearnUntil until) {
    Learned learned = learner->learn(until);
    if (learner->paused()) learned.paused = learner;
    return learned;
  }

  static void finish(Learned& learned) {
    if (learned.paused) learned = learned.paused->learn(LearnUntil::settled);
  }

  // Again from the radius found while that went as far as it may, and with the background as it was if its correction
  // explains less.
  Learned learn(const Learner& first, Start from, Allowed allowed) const {
    constexpr int most_starts = 3;
    constexpr double as_good = 1.02;
    // Beads lit from one side must explain the frame completely, and so must what is learned again.
    Learned best = learned_by(first, allowed.one_sided ? LearnUntil::hopeless : LearnUntil::settled);
    if (best.background_corrected && !best.result.complete) {
      allowed.corrected_background = false;
      Learned as_it_was = learned_by(learner_of(from, allowed), LearnUntil::settled);
      if (as_it_was.result.found && (!best.result.found || as_it_was.unexplained < best.unexplained))
        best = std::move(as_it_was);
      else
        allowed.corrected_background = true;
    }
    for (int start = 1; start < most_starts && best.result.found && best.astray; ++start) {
      from.radius_px = best.result.calibration.rim_radius_px;
      Learned again = learned_by(learner_of(from, allowed), LearnUntil::hopeless);
      if (!again.result.found || !again.result.complete) break;
      finish(best);
      if (again.unexplained > as_good * best.unexplained) break;
      best = std::move(again);
    }
    return best;
  }

  // Shadows beside the beads, say, are not the beads' own light.
  [[nodiscard]] Learned learn(const Start& from) const {
    const Learner first = learner_of(from, {});
    Learned best = learn(first, from, {});
    if (!best.one_sided || (best.result.complete && !best.astray)) return best;
    const Allowed plainly{.one_sided = false};
    Learned plain = learn(first->plain() ? first->plain() : learner_of(from, plainly), from, plainly);
    if (plain.result.found) return plain;
    finish(best);
    return best;
  }

  // What explains the frame little gives way to what explains it better: the bright middle of a glass bead to the
  // whole of it, say. Of what was not seen at first, many beads must be seen clearly.
  CalibrationResult or_another(Learned best) const {
    constexpr double clearly_less = 0.5, mostly_explained = 0.75;
    constexpr std::size_t fewest = 20;
    const bool seen = best.result.found;
    if (options_.radius_px || (best.result.found && best.result.complete)) return best.result;
    for (const auto& other : estimate_.others) {
      const bool known =
          estimate_.found && other.radius_px == estimate_.radius_px && other.polarity == estimate_.polarity;
      if (known) continue;  // learned as seen
      Learned another = learn(Start{other.radius_px, other.polarity});
      if (!another.result.found || another.typical < mostly_explained || another.result.calibration.disks_used < fewest)
        continue;
      if (seen ? another.unexplained < clearly_less * best.unexplained : another.result.complete)
        best = std::move(another);
      if (best.result.found && best.result.complete) break;
    }
    return best.result;
  }

  // It may also be a packed bed whose voids look like beads. The likelier case is tried first. Unless it explains the
  // frame nearly down to its noise, the other is tried, too. The second case is accepted only when it does explain it.
  [[nodiscard]] CalibrationResult packed_or_as_seen() const {
    const Start packed{estimate_.packed_radius_px, estimate_.packed_polarity};
    const auto convinces = [](const Learned& learned) {
      return learned.result.found && learned.result.complete && fills(learned.result.calibration);
    };
    if (estimate_.packed_likely) {
      Learned as_packed = learn(packed);
      return convinces(as_packed) ? as_packed.result : or_another(learn(as_seen()));
    }
    Learned seen = learn(as_seen());
    if (seen.result.found && seen.result.complete) return seen.result;
    Learned as_packed = learn(packed);
    const bool better = !seen.result.found || as_packed.unexplained < seen.unexplained;
    return better && convinces(as_packed) ? as_packed.result : or_another(std::move(seen));
  }

  // A packed bed fills a good part of what is in view.
  static bool fills(const FinderCalibration& found) {
    constexpr double fair_part = 0.25;
    const double disks =
        static_cast<double>(found.disks_used) / static_cast<double>(std::max<std::size_t>(1, found.frames_used));
    return disks * std::numbers::pi * found.radius_px * found.radius_px > fair_part * found.width * found.height;
  }

  const std::vector<const GrayFrame*>& frames_;
  const FindOptions& options_;
  RadiusEstimate estimate_;
};

}  // namespace

double softening_for(double edge) { return edge < 0.8 ? std::sqrt(0.8 * 0.8 - edge * edge) : 0.0; }

double knot_for(double radius, double edge) { return std::clamp(0.4 * edge, 0.2, std::max(0.25, radius / 8)); }

void require_consistent(const GrayFrame& frame) {
  if (frame.width < 0 || frame.height < 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw std::invalid_argument("find_disks: the frame's pixel count is not width x height");
}

GrayFrame without_walls(const GrayFrame& frame, Polarity polarity, double radius_px) {
  std::vector<SolidBorder> borders = find_solid_borders(frame);
  drop_plain_background(borders, frame, polarity);
  if (borders.empty()) return frame;
  const LightField light =
      estimate_light(without_borders(frame, borders, -border_margin(usual_edge)), radius_px, polarity);
  std::erase_if(borders, [&](const SolidBorder& border) { return is_background(border, light, frame); });
  complete_corners(borders, frame);
  return without_borders(frame, borders, border_margin(usual_edge));
}

GrayFrame seen_part(const GrayFrame& recorded, const FinderCalibration& calibration) {
  GrayFrame frame = recorded;
  if (calibration.left_out)
    for (std::size_t k = 0; k < frame.pixels.size(); ++k)
      if ((*calibration.left_out)[k] != 0) frame.pixels[k] = unseen_level;
  if (!calibration.solid_borders) return frame;
  std::vector<SolidBorder> borders = find_solid_borders(frame);
  std::erase_if(borders, [&](const SolidBorder& border) { return is_background(border, calibration.light, frame); });
  complete_corners(borders, frame);
  return without_borders(frame, borders, border_margin(calibration.edge_width_px));
}

CalibrationResult learn_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options) {
  CalibrationResult result;
  if (frames.empty()) {
    result.why_not = "there is no frame from which beads could be learned";
    return result;
  }
  for (const GrayFrame* frame : frames) require_consistent(*frame);
  return StartChooser(frames, options).choose();
}

CalibrationResult learn_again(const std::vector<const GrayFrame*>& frames, const FindOptions& options,
                              const FinderCalibration& before) {
  if (frames.empty()) throw std::invalid_argument("learn_again: there is no frame from which beads could be learned");
  for (const GrayFrame* frame : frames) require_consistent(*frame);
  const Start start{before.rim_radius_px, before.polarity, &before};
  const Allowed allowed{.one_sided = before.profile.asymmetry != nullptr};
  return BeadLearner(frames, options, start, allowed).learn(LearnUntil::settled).result;
}

CalibrationResult calibrate_finder(const std::vector<const GrayFrame*>& frames, const FindOptions& options) {
  CalibrationResult result = learn_finder(frames, options);
  tell_radius(result);
  return result;
}

}  // namespace shakebed::ingest
