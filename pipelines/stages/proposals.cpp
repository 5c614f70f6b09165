#include "pipelines/stages/proposals.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "ingest/find/nearby.hpp"
#include "ingest/find/round_aspect.hpp"
#include "ingest/profile/photographs.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_proposed = 2, most_tries = 6;
// Searches of the picture as it is; those of reduced copies take a few per cent of one. 1,400 shells that do not touch
// are refused after twice the time in which they are found.
constexpr std::size_t most_searches = 3;
// Shares of wrong disks and missed beads, three quarters and half of what a run accepts: a quick search by rims that
// finds no more of them stands for that of the run, which takes several times as long. Beads of any shape may be
// missed.
constexpr double few_wrong = 0.15, few_missed = 0.2;
constexpr std::size_t most_other_pictures = 3;  // a survey takes seconds where pictures are large
constexpr std::size_t fewest_of_region = 3;     // circles that a region of their own is proposed for
constexpr double sure = 0.5;                    // probability of a circle that the region must hold
constexpr double neighbours_radii = 20;         // between the centres of circles of one region
constexpr double margin_radii = 2.5;            // around the centres: a bead and the light beside it

// Rounds in which outlines correct an aspect of pixels, and corrections of it that are small.
constexpr int rounds_of_aspect = 2;
constexpr double near_aspect = 0.01;

// The options that restrict what is found.
void leave_out(const std::string& name, ExtractOptions& options) {
  if (name == "--polarity") options.polarity = BeadPolarity::automatic;
  if (name == "--channel") options.channel = BeadChannel::automatic;
  if (name == "--radius") options.radius.reset();
  if (name == "--roi") options.roi.clear();
  if (name == "--scale") options.scale.reset();
  if (name == "--bead-number") options.bead_number.reset();
  if (name == "--shape") options.shape = BeadShape::round;
}

std::vector<std::string> given_of(const ExtractOptions& options) {
  std::vector<std::string> given;
  if (options.polarity != BeadPolarity::automatic) given.emplace_back("--polarity");
  if (options.channel != BeadChannel::automatic) given.emplace_back("--channel");
  if (options.radius) given.emplace_back("--radius");
  if (!options.roi.empty()) given.emplace_back("--roi");
  if (options.scale) given.emplace_back("--scale");
  if (options.bead_number) given.emplace_back("--bead-number");
  if (options.shape != BeadShape::round) given.emplace_back("--shape");
  return given;
}

// The largest group of circles that lie near one another, with a margin.
std::optional<ingest::PixelRectangle> region_of(const ingest::SurveyCandidate& candidate, const FirstLook& look) {
  std::vector<ingest::Circle> circles;
  for (const ingest::RimDisk& disk : candidate.disks)
    if (disk.probability > sure) circles.push_back(disk.circle);
  std::vector<std::size_t> group(circles.size());
  for (std::size_t k = 0; k < group.size(); ++k) group[k] = k;
  const auto root = [&](std::size_t k) {
    while (group[k] != k) k = group[k] = group[group[k]];
    return k;
  };
  const double near = neighbours_radii * candidate.rims.radius_px;
  ingest::Nearby(circles.size(), near, [&](std::size_t k) {
    return std::pair(circles[k].x, circles[k].y);
  }).pairs([&](std::size_t i, std::size_t j) {
    if (std::hypot(circles[i].x - circles[j].x, circles[i].y - circles[j].y) < near) group[root(i)] = root(j);
    return false;
  });
  std::vector<std::size_t> size(circles.size(), 0);
  for (std::size_t k = 0; k < circles.size(); ++k) ++size[root(k)];
  const auto largest = std::max_element(size.begin(), size.end());
  if (largest == size.end() || *largest < fewest_of_region) return std::nullopt;
  const auto of_region = static_cast<std::size_t>(largest - size.begin());
  double left = look.width, top = look.height, right = 0, bottom = 0;  // with square pixels
  const double margin = margin_radii * candidate.rims.radius_px;
  for (std::size_t k = 0; k < circles.size(); ++k) {
    if (root(k) != of_region) continue;
    left = std::min(left, circles[k].x - margin), right = std::max(right, circles[k].x + margin);
    top = std::min(top, circles[k].y - margin), bottom = std::max(bottom, circles[k].y + margin);
  }
  ingest::PixelRectangle region;
  region.left = static_cast<int>(std::max(0.0, std::floor(left)));
  region.top = static_cast<int>(std::max(0.0, std::floor(top)));
  region.width = static_cast<int>(std::min<double>(look.width, std::ceil(right))) - region.left;
  region.height = static_cast<int>(std::min<double>(look.height, std::ceil(bottom))) - region.top;
  return ingest::widened(region, 1 / look.pixel_aspect);
}

class Proposer {
 public:
  Proposer(const FirstLook& look, const ExtractOptions& options, RefusedBy refused, const ingest::Measurement* measured)
      : look_(look), options_(options), refused_(refused), measured_(measured), given_(given_of(options)) {}

  std::vector<Proposal> find() {
    leave_out_what_excludes_beads();
    if (proposals_.empty()) give_shape_of_pixels();
    if (proposals_.empty()) give_what_candidates_need();
    if (refused_ == RefusedBy::measurement && (proposals_.empty() || apart())) accept_what_was_found();
    return std::move(proposals_);
  }

 private:
  // The one option given that excludes the beads, else all of them.
  void leave_out_what_excludes_beads() {
    std::vector<std::string> restricting;
    for (const std::string& name : given_)
      if (name != "--bead-number" && name != "--shape") restricting.push_back(name);
    if (refused_ == RefusedBy::measurement || restricting.empty()) return;
    for (const std::string& name : restricting)
      if (propose({name}, "", [&](ExtractOptions& o) { leave_out(name, o); })) return;
    if (restricting.size() == 1) return;
    propose(restricting, "", [&](ExtractOptions& o) {
      for (const std::string& name : restricting) leave_out(name, o);
    });
  }

  // Disks look oval where pixels are not square. First all edges tell the aspect, then the outlines of the disks found,
  // and then the search finds what is left, where it goes by faces.
  void give_shape_of_pixels() {
    if (refused_ == RefusedBy::measurement) return;
    const std::optional<double> aspect = other_aspect_seen();
    if (!aspect) return;
    ExtractOptions options = options_;
    options.pixel_aspect.reset();
    const auto look_with = [&](double one) { return look_at_first({origin()}, options, LookFor::run, one); };
    std::optional<FirstLook> look = look_with(*aspect);
    if (look && !look->survey.found)  // of small beads that touch, blur hides half of the deviation
      if (const double twice = *aspect * *aspect / look_.pixel_aspect; is_possible(twice)) look = look_with(twice);
    for (int round = 0; round < rounds_of_aspect && look && look->survey.found; ++round) {
      const std::optional<double> better = ingest::aspect_by_outlines(*look);
      if (!better || std::abs(std::log(*better / look->pixel_aspect)) < near_aspect || !is_possible(*better)) break;
      look = look_with(*better);
    }
    if (!look || !look->survey.found) return;
    ++searches_;
    const std::optional<Trial> trial = try_after_look(*look, options, TrialSearch::as_the_run);
    if (!trial) return;
    constexpr double digits = 1e4;  // as they are proposed
    options.pixel_aspect = std::round(digits * trial->pixel_aspect) / digits;
    std::string give = fmt::format("--pixel-aspect {:g}", *options.pixel_aspect);
    std::vector<std::string> instead_of;
    if (options_.pixel_aspect) instead_of.emplace_back("--pixel-aspect");
    add(std::move(options), *trial, std::move(instead_of), std::move(give));
  }

  static bool is_possible(double aspect) { return aspect >= ingest::narrowest_pixel && aspect <= ingest::widest_pixel; }

  // If it is clearly not that of the first look.
  [[nodiscard]] std::optional<double> other_aspect_seen() const {
    constexpr double clearly = 0.06;
    constexpr std::size_t enough_pixels = 2'000'000;
    try {
      ingest::FrameSourceOptions source;
      source.channel = ingest::Channel::grey;
      const ingest::ChannelFrames frames = ingest::read_channels(look_.path, look_.page, enough_pixels, source);
      const std::optional<double> aspect = ingest::aspect_for_round_outlines(frames.channels.front().frame);
      const bool clear = aspect && std::abs(std::log(*aspect / look_.pixel_aspect)) > clearly;
      return clear && is_possible(*aspect) ? aspect : std::nullopt;
    } catch (const ingest::InputError&) {
      return std::nullopt;
    }
  }

  void give_what_candidates_need() {
    for (const ingest::SurveyCandidate* candidate : different_candidates(look_.survey)) {
      if (options_.roi.empty() && (candidate->few_edges || !candidate->why_drawn.empty())) give_region(*candidate);
      if (was_refused(*candidate)) continue;
      if (candidate->plausible || candidate->credible) give_beads(*candidate);
    }
  }

  // Given the radius and polarity that it found, a run finds the same.
  [[nodiscard]] bool was_refused(const ingest::SurveyCandidate& candidate) const {
    return measured_ != nullptr && look_.survey.found && &candidate == &chosen_of(look_.survey, options_);
  }

  void give_region(const ingest::SurveyCandidate& candidate) {
    const auto region = region_of(candidate, look_);
    if (!region) return;
    propose({}, fmt::format("--roi {},{},{},{}", region->left, region->top, region->width, region->height),
            [&](ExtractOptions& o) {
              o.roi = {static_cast<double>(region->left), static_cast<double>(region->top),
                       static_cast<double>(region->width), static_cast<double>(region->height)};
            });
  }

  // Candidates of the same beads lead to the same, which is proposed once.
  void give_beads(const ingest::SurveyCandidate& candidate) {
    std::vector<std::string> instead;
    for (const std::string& name : given_)
      if (name == "--polarity" || name == "--radius" || name == "--shape" ||
          (name == "--channel" && candidate.channel != ingest::Channel::automatic))
        instead.push_back(name);
    if (propose(instead, options_for(candidate), [&](ExtractOptions& o) { take_candidate(candidate, o); }) &&
        !beads_given_.insert(proposals_.back().seen).second)
      proposals_.pop_back();
  }

  // Whether the beads measured do not touch: a scale, or any shape, then helps as well as other options.
  [[nodiscard]] bool apart() const { return measured_ == nullptr || measured_->contacts.missing(); }

  // What was measured may be right all the same.
  void accept_what_was_found() {
    ExtractOptions open = options_;
    open.shape = BeadShape::any, open.bead_number.reset();
    const std::optional<Trial> trial = found_with(open);
    if (!trial) return;
    if (options_.bead_number) {
      propose({"--bead-number"}, fmt::format("--bead-number {}", trial->beads),
              [&](ExtractOptions& o) { o.bead_number = trial->beads; });
      return;
    }
    if (trial->contacts.missing() && !options_.scale) {
      const double scale = options_.diameter / trial->contacts.touching_px;
      const std::string text = fmt::format("{:.4g} mm/px", 1e3 * scale);
      if (propose({}, fmt::format("--scale \"{}\"", text),
                  [&](ExtractOptions& o) { o.scale = 1e-3 * std::stod(text); }))
        proposals_.back().when = " where neighbouring beads touch";
    }
    if (options_.shape == BeadShape::round && proposals_.size() < most_proposed)
      add(std::move(open), *trial, {}, "--shape any");
  }

  // What was measured, if these options choose the same beads in the picture.
  std::optional<Trial> found_with(const ExtractOptions& open) {
    const std::optional<FirstLook> look = look_at_first({origin()}, open);
    if (!look || !look->survey.found) return std::nullopt;
    if (measured_ != nullptr && measured_->frames.size() == 1 && look_.survey.found &&
        same_start(chosen_of(look->survey, open), chosen_of(look_.survey, options_)))
      return judged(open, *measured_, measured_->disks);
    return searched(*look, open);
  }

  // What a search of the picture finds that the run accepts. The quick one is enough where it finds nothing, or leaves
  // little doubt.
  std::optional<Trial> searched(const FirstLook& look, const ExtractOptions& options) {
    if (searches_++ >= most_searches || !look.survey.found) return std::nullopt;
    std::optional<Trial> quick = try_after_look(look, options, TrialSearch::by_rims_alone);
    const bool complete = options.shape == BeadShape::any || (quick && quick->missed <= few_missed);
    if (!quick || (quick->wrong <= few_wrong && complete)) return quick;
    return try_after_look(look, options, TrialSearch::as_the_run);
  }

  static bool same_start(const ingest::SurveyCandidate& one, const ingest::SurveyCandidate& other) {
    return one.channel == other.channel && one.rims.polarity == other.rims.polarity &&
           one.rims.radius_px == other.rims.radius_px && one.one_sided == other.one_sided &&
           one.by_rims == other.by_rims;
  }

  // Whether the run accepts the picture once the options are changed so.
  template <class Change>
  bool propose(std::vector<std::string> without, std::string give, const Change& change) {
    if (proposals_.size() >= most_proposed || tries_ >= most_tries) return false;
    ++tries_;
    ExtractOptions options = options_;
    change(options);
    if (excluded_at_a_glance(options)) return false;
    if (searches_ >= most_searches) return false;
    const std::optional<FirstLook> look = look_at_first({origin()}, options);
    const std::optional<Trial> trial = look ? searched(*look, options) : std::nullopt;
    if (!trial) return false;
    add(std::move(options), *trial, std::move(without), std::move(give));
    return true;
  }

  // Options that a trial on the picture has accepted.
  void add(ExtractOptions options, const Trial& trial, std::vector<std::string> without, std::string give) {
    Proposal proposal;
    proposal.options = std::move(options);
    proposal.leave_out = std::move(without);
    proposal.give = std::move(give);
    proposal.found = trial.found;
    for (ingest::RimDisk& disk : proposal.found.disks)  // in the picture of the first look
      disk.circle.x = (disk.circle.x + 0.5) * look_.pixel_aspect - 0.5;
    proposal.bead_aspect = look_.pixel_aspect / trial.pixel_aspect;
    proposal.seen = fmt::format("{} {} bead{} of {:.1f} px radius", trial.beads, trial.bright ? "bright" : "dark",
                                trial.beads == 1 ? "" : "s", trial.radius_px);
    proposals_.push_back(std::move(proposal));
  }

  // By a trial on a reduced picture, where the beads looked for are large. What it accepts is tried on the picture.
  bool excluded_at_a_glance(const ExtractOptions& options) {
    double radius = options.radius.value_or(HUGE_VAL);
    if (!options.radius)
      for (const ingest::SurveyCandidate& one : look_.survey.candidates) radius = std::min(radius, one.rims.radius_px);
    if (std::isinf(radius)) return false;
    if (!reduced_ || radius != reduced_for_px_) {
      reduced_ = reduced_for_trials(look_, radius);
      reduced_for_px_ = radius;
    }
    return reduced_ && !try_options(origin(), options, &*reduced_);
  }

  [[nodiscard]] ingest::FrameOrigin origin() const { return {look_.path, look_.page}; }

  const FirstLook& look_;
  const ExtractOptions& options_;
  RefusedBy refused_;
  const ingest::Measurement* measured_;
  std::optional<ingest::ChannelFrames> reduced_;
  double reduced_for_px_ = 0;
  std::vector<std::string> given_;
  std::vector<Proposal> proposals_;
  std::set<std::string> beads_given_;  // what the proposals of candidates found
  std::size_t tries_ = 0, searches_ = 0;
};

std::string words_of(const Proposal& proposal) {
  const std::string without = fmt::format("{}", fmt::join(proposal.leave_out, " and "));
  const std::string change = without.empty()         ? "give " + proposal.give
                             : proposal.give.empty() ? "leave out " + without
                                                     : fmt::format("instead of {} give {}", without, proposal.give);
  return fmt::format("{} (tried: {}){}", change, proposal.seen, proposal.when);
}

}  // namespace

std::vector<Proposal> proposals_for(const FirstLook& look, const ExtractOptions& options, RefusedBy refused,
                                    const ingest::Measurement* measured) {
  return Proposer(look, options, refused, measured).find();
}

std::string advice_of(const std::vector<Proposal>& proposals, const ExtractOptions& options) {
  if (!proposals.empty()) {
    std::vector<std::string> each;
    for (const Proposal& one : proposals) each.push_back(words_of(one));
    return fmt::format("If a picture of preview.html marks your beads, {}", fmt::join(each, "; or "));
  }
  std::vector<std::string> left;
  if (options.roi.empty()) left.emplace_back("the region of the beads (--roi)");
  if (!options.radius) left.emplace_back("their radius in pixels (--radius)");
  return "No option that was tried leads to beads. The program needs sharp photographs of round beads, taken from the "
         "side and lit so that the whole rim of a bead is visible. Each bead must be at least 10 pixels wide and "
         "brighter or darker than the background. " +
         (left.empty() ? std::string("The region and the radius given do not help: take such a photograph")
                       : fmt::format("If this is such a photograph, give {}", fmt::join(left, " and ")));
}

std::string advice_of_other_pictures(const std::vector<ingest::FrameOrigin>& pictures, const ExtractOptions& options) {
  for (std::size_t k = 1; k < std::min(pictures.size(), 1 + most_other_pictures); ++k) {
    const std::optional<Trial> trial = try_options(pictures[k], options);
    if (!trial) continue;
    const bool same_file = pictures[k].path == pictures.front().path;
    return fmt::format("{} shows {} beads: give --skip {}, which leaves out the picture{} before it",
                       same_file ? fmt::format("Picture {} of it", 1 + pictures[k].page)
                                 : std::filesystem::path(pictures[k].path).filename().string(),
                       trial->beads, options.skip + k * options.stride, k == 1 ? "" : "s");
  }
  return "";
}

std::string advice_for(const std::vector<Proposal>& proposals, const std::vector<ingest::FrameOrigin>& pictures,
                       const ExtractOptions& options) {
  if (proposals.empty())
    if (std::string others = advice_of_other_pictures(pictures, options); !others.empty()) return others;
  return advice_of(proposals, options);
}

}  // namespace shakebed::pipelines
