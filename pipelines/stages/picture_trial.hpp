// What a run makes of pictures: what it asks of the measurement, and whether it accepts the result. The same for one
// picture, to try options on it. Part of the images module.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ingest/profile/measure_bed.hpp"
#include "pipelines/stages/preview.hpp"

namespace shakebed::pipelines {

// What the options ask of the measurement.
ingest::MeasureOptions asked_for(const ExtractOptions& options);

// Throws StageError where a region or a wall lies outside the picture.
void require_inside(const ExtractOptions& options, const FirstLook& look);

// The most credible beads; where their number is given, of what may be beads, the kind that is as numerous.
const ingest::SurveyCandidate& chosen_of(const ingest::Survey& survey, const ExtractOptions& options);

// Channel, radius and polarity to go on with.
void go_on_with(const ingest::SurveyCandidate& chosen, const FirstLook& look, ingest::FrameSourceOptions& source,
                ingest::MeasureOptions& measure);

// Sentences, the most important first.
struct Judgement {
  std::vector<std::string> warnings;
  void warning(std::string text) { warnings.push_back(std::move(text)); }
};
// Refuses where the mean number of beads found is more than a fifth from the number given; warns where it is more than
// a thousandth from it.
void judge_bead_number(std::uint64_t given, double mean_found, Judgement& judgement);
// Throws StageError where the disks found are no bed of beads, or not the one described. The message says what is
// wrong, not what helps (proposals.hpp).
Judgement judge_disks(const ExtractOptions& options, const ingest::Measurement& found);

// The picture of a first look, measured by a run with these options.
struct Trial {
  std::size_t beads = 0;
  double radius_px = 0;
  bool bright = false;
  double wrong = 0, missed = 0;  // shares that are expected, of the disks and of the beads
  ingest::Contacts contacts;
  ingest::SurveyCandidate found;  // the disks, to be drawn
  double pixel_aspect = 1;        // as found, or as given
};
// Nothing where the run refuses it. `reduced`: the picture for a quick trial, which may be wrong.
std::optional<Trial> try_options(const ingest::FrameOrigin& picture, const ExtractOptions& options,
                                 const ingest::ChannelFrames* reduced = nullptr);
// The same after a first look at the picture with these options. Beads are searched as quickly as by_rims_alone says.
enum class TrialSearch { as_the_run, by_rims_alone };
std::optional<Trial> try_after_look(const FirstLook& look, const ExtractOptions& options, TrialSearch search);
// The same of what is measured already. `disks`: of its first frame.
std::optional<Trial> judged(const ExtractOptions& options, const ingest::Measurement& found,
                            const std::vector<ingest::MeasuredDisk>& disks);
// The picture, averaged until beads of this radius are just large enough; nothing where they hardly are.
std::optional<ingest::ChannelFrames> reduced_for_trials(const FirstLook& look, double radius_px);

}  // namespace shakebed::pipelines
