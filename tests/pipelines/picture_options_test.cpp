// What is asked of a picture, chosen in it and said of it, done by hand: options, candidates, the page of a preview,
// advice, limits of what is accepted.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "ingest/profile/candidate_picture.hpp"
#include "pipelines/stages/picture_trial.hpp"
#include "pipelines/stages/preview.hpp"
#include "pipelines/stages/proposals.hpp"
#include "tests/pipelines/painted_picture.hpp"
#include "tests/pipelines/program.hpp"

namespace {

using namespace shakebed;
using namespace shakebed::pipelines;
using namespace shakebed::tests;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::Not;
using testing::StartsWith;

// An option of every kind, no two numbers alike.
ExtractOptions all_options() {
  ExtractOptions options;
  options.diameter = 0.003, options.second_diameter = 0.002, options.scale = 1.5e-4;
  options.roi = {11, 12, 130, 140};
  options.floor = 90, options.floor_slope = 0.01, options.floor_amplitude = 0.0025;
  options.left_wall = 7, options.right_wall = 133;
  options.pixel_aspect = 1.03, options.lens_radial = -0.02;
  options.polarity = BeadPolarity::bright, options.channel = BeadChannel::green, options.shape = BeadShape::any;
  options.radius = 9.5, options.keep_half_hidden = true;
  options.kernel = {KernelKind::top_hat, 0.75}, options.spacing = 0.125;
  options.lowest = 0.25, options.highest = 8;
  options.frequency = 21, options.frame_rate = 500, options.bead_number = 61;
  return options;
}

TEST(PictureOptions, AreWhatASurveyIsAsked) {
  const ingest::SurveyOptions asked = survey_asked_for(all_options());
  EXPECT_EQ(asked.polarity, ingest::Polarity::bright_beads);
  EXPECT_EQ(asked.radius_px, 9.5);
  EXPECT_TRUE(asked.any_shape);
  ASSERT_TRUE(asked.roi);
  EXPECT_THAT((std::vector<int>{asked.roi->left, asked.roi->top, asked.roi->width, asked.roi->height}),
              ElementsAre(11, 12, 130, 140));
  const ingest::SurveyOptions nothing = survey_asked_for({});
  EXPECT_EQ(nothing.polarity, ingest::Polarity::automatic);
  EXPECT_FALSE(nothing.radius_px || nothing.roi || nothing.any_shape || nothing.channel_alone);
  ExtractOptions dark;
  dark.polarity = BeadPolarity::dark;
  EXPECT_EQ(survey_asked_for(dark).polarity, ingest::Polarity::dark_beads);
}

TEST(PictureOptions, AreWhatAMeasurementIsAsked) {
  const ingest::MeasureOptions asked = asked_for(all_options());
  EXPECT_EQ(asked.bead_diameter_m, 0.003);
  EXPECT_EQ(asked.second_diameter_m, 0.002);
  EXPECT_EQ(asked.scale_m_per_px, 1.5e-4);
  EXPECT_EQ(asked.floor_px, 90);
  EXPECT_EQ(asked.floor_slope, 0.01);
  EXPECT_EQ(asked.floor_amplitude_m, 0.0025);
  EXPECT_EQ(asked.left_wall_px, 7);
  EXPECT_EQ(asked.right_wall_px, 133);
  EXPECT_EQ(asked.pixel_aspect, 1.03);
  EXPECT_EQ(asked.lens_radial, -0.02);
  EXPECT_EQ(asked.find.polarity, ingest::Polarity::bright_beads);
  EXPECT_EQ(asked.find.radius_px, 9.5);
  EXPECT_TRUE(asked.find.keep_half_hidden);
  ASSERT_TRUE(asked.find.roi);
  EXPECT_THAT(
      (std::vector<int>{asked.find.roi->left, asked.find.roi->top, asked.find.roi->width, asked.find.roi->height}),
      ElementsAre(11, 12, 130, 140));
  EXPECT_EQ(asked.kernel.kind, KernelKind::top_hat);
  EXPECT_EQ(asked.kernel.width, 0.75);
  EXPECT_EQ(asked.bin_width, 0.125);
  EXPECT_EQ(asked.lowest, 0.25);
  EXPECT_EQ(asked.highest, 8);
  EXPECT_EQ(asked.shaking_frequency_hz, 21);
  EXPECT_FALSE(asked_for({}).find.roi);
}

// A region or walls that hold one column or row of the picture are inside it.
TEST(PictureOptions, MustMeetThePicture) {
  const FirstLook look{"a.png", 200, 100, {}, nullptr};
  const auto inside = [&](const std::vector<double>& roi, std::optional<double> left, std::optional<double> right) {
    ExtractOptions options;
    options.roi = roi, options.left_wall = left, options.right_wall = right;
    try {
      require_inside(options, look);
    } catch (const StageError& error) {
      EXPECT_THAT(error.what(), StartsWith("a.png: the "));
      return false;
    }
    return true;
  };
  EXPECT_TRUE(inside({}, {}, {}));
  EXPECT_TRUE(inside({199, 99, 50, 50}, {}, {}));
  EXPECT_TRUE(inside({-40, -30, 41, 31}, {}, {}));
  EXPECT_FALSE(inside({200, 0, 50, 50}, {}, {}));
  EXPECT_FALSE(inside({0, 100, 50, 50}, {}, {}));
  EXPECT_FALSE(inside({-50, 0, 50, 50}, {}, {}));
  EXPECT_FALSE(inside({0, -50, 50, 50}, {}, {}));
  EXPECT_TRUE(inside({}, 199, 300));
  EXPECT_TRUE(inside({}, -20, 1));
  EXPECT_FALSE(inside({}, 200, 300));
  EXPECT_FALSE(inside({}, -20, 0));
  EXPECT_TRUE(inside({}, 250, {})) << "the other wall is found";
  EXPECT_TRUE(inside({}, {}, -5));
}

// --- candidates

ingest::SurveyCandidate candidate(double radius, ingest::Polarity polarity, ingest::Channel channel,
                                  std::size_t disks = 20) {
  ingest::SurveyCandidate one;
  one.rims.radius_px = radius, one.rims.polarity = polarity, one.channel = channel;
  one.disks.resize(disks);
  for (std::size_t k = 0; k < disks; ++k)
    one.disks[k].circle.x = 10.0 * static_cast<double>(k % 10), one.disks[k].circle.y = 30,
    one.disks[k].probability = 1, one.disks[k].circle.radius = radius;
  one.credible = one.plausible = true;
  one.expected_wrong = 0.034, one.explained_share = 0.87;
  return one;
}
constexpr auto dark = ingest::Polarity::dark_beads, bright = ingest::Polarity::bright_beads;
constexpr auto red = ingest::Channel::red, grey = ingest::Channel::grey;

TEST(CandidatesOfAPicture, DifferFromFivePercentOfTheRadiusOn) {
  const auto chosen = [](const std::vector<ingest::SurveyCandidate>& all) {
    ingest::Survey survey;
    survey.candidates = all;
    std::vector<std::size_t> numbers;
    for (const auto* one : different_candidates(survey))
      numbers.push_back(static_cast<std::size_t>(one - survey.candidates.data()));
    return numbers;
  };
  EXPECT_THAT(chosen({}), IsEmpty());
  EXPECT_THAT(chosen({candidate(10, dark, red), candidate(10.49, dark, red), candidate(9.53, dark, red),
                      candidate(10.51, dark, red), candidate(9.51, dark, red)}),
              ElementsAre(0, 3, 4));
  EXPECT_THAT(chosen({candidate(10, dark, red), candidate(10, dark, grey), candidate(10, bright, red),
                      candidate(20, dark, red)}),
              ElementsAre(0, 1, 2))
      << "three at most";
}

TEST(CandidatesOfAPicture, AreOptionsOfTheCommand) {
  ingest::SurveyCandidate one = candidate(9.876, bright, ingest::Channel::blue);
  EXPECT_EQ(options_for(one), "--channel blue --polarity bright --radius 9.88");
  ExtractOptions options;
  take_candidate(one, options);
  EXPECT_EQ(options.channel, BeadChannel::blue);
  EXPECT_EQ(options.polarity, BeadPolarity::bright);
  EXPECT_DOUBLE_EQ(*options.radius, 9.88);
  EXPECT_EQ(options.shape, BeadShape::round);
  one = candidate(22.304, dark, ingest::Channel::automatic);
  EXPECT_EQ(options_for(one), "--polarity dark --radius 22.30");
  take_candidate(one, options);
  EXPECT_EQ(options.channel, BeadChannel::blue) << "as it was";
  EXPECT_EQ(options.polarity, BeadPolarity::dark);
  EXPECT_DOUBLE_EQ(*options.radius, 22.3);
  one.not_round = true;
  EXPECT_EQ(options_for(one), "--polarity dark --radius 22.30 --shape any");
  take_candidate(one, options);
  EXPECT_EQ(options.shape, BeadShape::any);
  one.not_round = false, one.why_drawn = "a plot";
  EXPECT_EQ(options_for(one), "--polarity dark --radius 22.30 --shape any");
  one.why_drawn.clear(), one.region = {11, 12, 130, 140};
  EXPECT_EQ(options_for(one), "--polarity dark --radius 22.30 --roi 11,12,130,140");
  EXPECT_THAT(options.roi, IsEmpty());
  take_candidate(one, options);
  EXPECT_THAT(options.roi, ElementsAre(11, 12, 130, 140));
  for (const auto& [channel, same] : {std::pair{BeadChannel::red, ingest::Channel::red},
                                      {BeadChannel::saturation, ingest::Channel::saturation},
                                      {BeadChannel::background_distance, ingest::Channel::background_distance},
                                      {BeadChannel::grey_distance, ingest::Channel::grey_distance},
                                      {BeadChannel::automatic, ingest::Channel::automatic}})
    EXPECT_EQ(channel_of(channel), same);
}

// Of credible candidates the one whose number is nearest, if it is nearer by more than a tenth.
TEST(CandidatesOfAPicture, AreChosenByTheNumberOfBeads) {
  ingest::Survey survey;
  survey.candidates = {candidate(10, dark, red, 100), candidate(5, dark, red, 40), candidate(7, dark, red, 60)};
  const auto chosen = [&](std::optional<std::uint64_t> number) {
    ExtractOptions options;
    options.bead_number = number;
    return &chosen_of(survey, options) - survey.candidates.data();
  };
  EXPECT_EQ(chosen({}), 0);
  EXPECT_EQ(chosen(100), 0);
  EXPECT_EQ(chosen(40), 1);
  EXPECT_EQ(chosen(61), 2);
  EXPECT_EQ(chosen(1000), 0);
  EXPECT_EQ(chosen(1), 1);
  EXPECT_EQ(chosen(75), 0) << "ln(75/60) = 0.22 is hardly nearer than ln(100/75) = 0.29";
  EXPECT_EQ(chosen(73), 2) << "ln(73/60) = 0.20 is nearer than ln(100/73) = 0.31 by a tenth";
  survey.candidates[2].credible = false;
  EXPECT_EQ(chosen(61), 0) << "ln(61/40) = 0.42 is hardly nearer than ln(100/61) = 0.49";
}

TEST(CandidatesOfAPicture, AreWhatARunGoesOnWith) {
  ingest::SurveyCandidate one = candidate(60, bright, grey);
  one.one_sided = true;
  ingest::FrameSourceOptions source;
  ingest::MeasureOptions measure;
  go_on_with(one, {"a.png", 2000, 1500, {}, nullptr}, source, measure);
  EXPECT_EQ(source.channel, grey);
  ASSERT_TRUE(measure.find.seen);
  EXPECT_EQ(measure.find.seen->polarity, bright);
  EXPECT_EQ(measure.find.seen->radius_px, 60);
  EXPECT_TRUE(measure.find.seen->one_sided);
  EXPECT_EQ(source.reduction, 5) << "three million pixels, of which a radius of 12 is enough";
  EXPECT_EQ(measure.reduction, 5);
  one.by_rims = true;
  go_on_with(one, {"a.png", 2000, 1500, {}, nullptr}, source, measure);
  EXPECT_EQ(source.reduction, 2) << "of 24, where rims alone are seen";
  go_on_with(one, {"a.png", 1000, 1500, {}, nullptr}, source, measure);
  EXPECT_EQ(measure.reduction, 1) << "small enough";
}

// --- the page

std::string preview_of(const FirstLook& look, const ExtractOptions& options, const std::vector<Proposal>& proposals,
                       const ScratchFolder& folder) {
  write_preview(folder.path(), look, {"my bed's.png", "b.png"}, options, proposals);
  return read_text(folder / "preview.html");
}
FirstLook look_with(const ScratchFolder& folder, const std::vector<ingest::SurveyCandidate>& candidates) {
  write_text(folder / "x&y.pgm", PaintedPicture(120, 60).pgm());
  FirstLook look{(folder / "x&y.pgm").string(), 120, 60, {}, nullptr};
  look.survey.found = true;
  look.survey.candidates = candidates;
  return look;
}

TEST(PreviewPage, HasTheCommandOfEachCandidate) {
  const ScratchFolder folder;
  FirstLook look = look_with(folder, {candidate(9.876, dark, red, 17), candidate(20, bright, red, 5)});
  look.survey.candidates[1].credible = false, look.survey.candidates[1].why_not = "too <few>";
  const std::string page = preview_of(look, all_options(), {}, folder);
  const std::string files =
      "<pre>shakebed fit-images 'my bed'\\''s.png' b.png --diameter &quot;3 mm&quot; "
      "--second-diameter &quot;2 mm&quot; --scale &quot;0.15 mm/px&quot; --roi 11,12,130,140 "
      "--floor 90 --left-wall 7 --right-wall 133 --pixel-aspect 1.03 --lens -0.02 "
      "--bead-number 61 --channel red --polarity ";
  EXPECT_THAT(page, HasSubstr(files + "dark --radius 9.88 --shape any</pre>"));
  EXPECT_THAT(page, HasSubstr(files + "bright --radius 20 --shape any</pre>"));
  EXPECT_THAT(page, HasSubstr("<h2>1. dark beads of about 9.9 px radius, channel red</h2>\n<p>17 beads; expected share "
                              "of false beads 3.4 %; the beads' rims are 87 % of the edges in the picture. </p>"));
  EXPECT_THAT(page, HasSubstr("<h2>2. bright beads of about 20.0 px radius"));
  EXPECT_THAT(page, HasSubstr("Not credible: too &lt;few&gt;."));
  EXPECT_THAT(page, HasSubstr("x&amp;y.pgm</title>"));
  EXPECT_THAT(page, HasSubstr("<p>120 x 60 px. "));
  EXPECT_THAT(page, HasSubstr("The first candidate is used unless options choose another."));
  EXPECT_THAT(page, HasSubstr("It compares channels more thoroughly, so it may choose another one."));
  for (const char* name : {"preview_1.png", "preview_2.png"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / name));
    EXPECT_THAT(page, HasSubstr(std::string("<img src=\"") + name + "\""));
  }
  EXPECT_FALSE(std::filesystem::exists(folder / "preview_3.png"));
}

// What is given plainly is repeated plainly; a candidate that may be beads needs no more.
TEST(PreviewPage, RepeatsNoMoreThanWasGiven) {
  const ScratchFolder folder;
  FirstLook look = look_with(folder, {candidate(9, dark, ingest::Channel::automatic)});
  ExtractOptions plain;
  plain.diameter = 0.0025;
  EXPECT_THAT(preview_of(look, plain, {}, folder),
              HasSubstr("b.png --diameter &quot;2.5 mm&quot; --polarity dark --radius 9</pre>"));
  look.survey.candidates[0].credible = look.survey.candidates[0].plausible = false;
  EXPECT_THAT(preview_of(look, plain, {}, folder), Not(HasSubstr("<pre>")));
  look.survey.candidates[0].plausible = true;
  EXPECT_THAT(preview_of(look, plain, {}, folder), HasSubstr("<pre>"));
}

TEST(PreviewPage, OfARefusedPictureHasTheProposalsAlone) {
  const ScratchFolder folder;
  FirstLook look = look_with(folder, {candidate(9, dark, red), candidate(12, dark, red), candidate(15, dark, red)});
  Proposal proposal;
  proposal.options.diameter = 0.002, proposal.options.polarity = BeadPolarity::dark;
  proposal.seen = "63 dark beads of 9.9 px radius";
  std::string page = preview_of(look, {}, {proposal, proposal}, folder);
  EXPECT_THAT(page, HasSubstr("<h2>1. Tried: 63 dark beads of 9.9 px radius</h2>\n<pre>shakebed fit-images "
                              "'my bed'\\''s.png' b.png --diameter &quot;2 mm&quot; --polarity dark</pre>"));
  EXPECT_THAT(page, HasSubstr("<h2>2. Tried: "));
  EXPECT_THAT(page, HasSubstr("<h2>3. dark beads of about 9.0 px"));
  EXPECT_THAT(page, Not(HasSubstr("<h2>4.")));
  EXPECT_THAT(page, Not(HasSubstr("--radius")));
  look.survey.candidates.clear(), look.survey.found = false, look.survey.why_not = "no <edges>";
  page = preview_of(look, {}, {}, folder);
  EXPECT_THAT(page, HasSubstr("<b>No beads are found: no &lt;edges&gt;.</b>"));
  EXPECT_THAT(page, HasSubstr("alt=\"the picture\""));
}

// --- advice

TEST(AdviceOfProposals, NamesWhatIsChanged) {
  const auto with = [](std::vector<std::string> without, std::string give, std::string when = "") {
    Proposal one;
    one.leave_out = std::move(without), one.give = std::move(give), one.when = std::move(when);
    one.seen = "9 beads";
    return one;
  };
  EXPECT_EQ(advice_of({with({}, "--roi 1,2,3,4")}, {}),
            "If a picture of preview.html marks your beads, give --roi 1,2,3,4 (tried: 9 beads)");
  EXPECT_EQ(advice_of({with({"--radius", "--channel"}, ""), with({"--scale"}, "--scale 2", " where they touch")}, {}),
            "If a picture of preview.html marks your beads, leave out --radius and --channel (tried: 9 beads); or "
            "instead of --scale give --scale 2 (tried: 9 beads) where they touch");
  ExtractOptions options;
  EXPECT_THAT(advice_of({}, options), HasSubstr("give the region of the beads (--roi) and their radius in pixels"));
  options.radius = 9;
  EXPECT_THAT(advice_of({}, options), testing::EndsWith("give the region of the beads (--roi)"));
  options.roi = {1, 2, 3, 4};
  EXPECT_THAT(advice_of({}, options), testing::EndsWith("The region and the radius given do not help: take such a "
                                                        "photograph"));
}

// --- proposals

// 25 dark beads of 10 px in rows on a floor, at the left of an empty field.
struct BedInAPicture {
  ScratchFolder folder;
  std::vector<Place> places = lattice(10, 5, 20, 122, 118, 0.02);
  std::string path = (folder / "bed.pgm").string();
  FirstLook look{path, 260, 140, {}, nullptr};
  ExtractOptions options;
  BedInAPicture() {
    write_text(path, PaintedPicture(260, 140).disks(places, 10, 60).blur(0.7).noise(2).pgm());
    look.survey.candidates = {candidate(10, dark, ingest::Channel::automatic, 0)};
    for (const Place& place : places) add(place.x, place.y, 1);
    options.diameter = 0.004;
  }
  void add(double x, double y, double probability) {
    ingest::RimDisk disk;
    disk.circle.x = x, disk.circle.y = y, disk.circle.radius = 10, disk.circle.support = 1;
    disk.probability = probability;
    look.survey.candidates[0].disks.push_back(disk);
  }
};

TEST(ProposalsForAPicture, LeaveOutTheOptionThatExcludesBeads) {
  BedInAPicture bed;
  bed.options.polarity = BeadPolarity::bright, bed.options.radius = 10;
  const std::vector<Proposal> proposals = proposals_for(bed.look, bed.options, RefusedBy::first_look);
  ASSERT_EQ(proposals.size(), 1U);
  EXPECT_THAT(proposals[0].leave_out, ElementsAre("--polarity"));
  EXPECT_EQ(proposals[0].give, "");
  EXPECT_EQ(proposals[0].options.polarity, BeadPolarity::automatic);
  EXPECT_EQ(proposals[0].options.radius, 10) << "it excludes none";
  // The radius of a quick search by rims, within a thirtieth of that drawn.
  EXPECT_THAT(proposals[0].seen,
              MatchesRegex(std::to_string(bed.places.size()) + " dark beads of (9\\.[789]|10\\.[0123]) px radius"));
  EXPECT_EQ(proposals[0].found.disks.size(), bed.places.size());
}

// Where each option alone excludes the beads, both are left out; the number of beads is none of them.
TEST(ProposalsForAPicture, LeaveOutAllOptionsThatExcludeBeads) {
  BedInAPicture bed;
  bed.options.polarity = BeadPolarity::bright, bed.options.radius = 30;
  bed.options.bead_number = bed.places.size();
  const std::vector<Proposal> proposals = proposals_for(bed.look, bed.options, RefusedBy::first_look);
  ASSERT_EQ(proposals.size(), 1U);
  EXPECT_THAT(proposals[0].leave_out, ElementsAre("--polarity", "--radius"));
  EXPECT_EQ(proposals[0].give, "");
  EXPECT_FALSE(proposals[0].options.radius);
  EXPECT_EQ(proposals[0].options.bead_number, bed.places.size());
  EXPECT_EQ(proposals[0].found.disks.size(), bed.places.size());
}

// A wrong number of beads is replaced by that which is found.
TEST(ProposalsForAPicture, GiveTheNumberOfBeads) {
  BedInAPicture bed;
  bed.options.bead_number = 100;
  const std::vector<Proposal> proposals = proposals_for(bed.look, bed.options, RefusedBy::measurement);
  ASSERT_EQ(proposals.size(), 1U);
  EXPECT_THAT(proposals[0].leave_out, ElementsAre("--bead-number"));
  EXPECT_EQ(proposals[0].give, "--bead-number " + std::to_string(bed.places.size()));
  EXPECT_EQ(proposals[0].options.bead_number, bed.places.size());
}

// A candidate's polarity and radius are given in place of those that are there, and of another shape: no more.
TEST(ProposalsForAPicture, GiveWhatACandidateNeeds) {
  BedInAPicture bed;
  bed.look.survey.candidates[0].plausible = true;
  const auto left_out = [&] {
    const std::vector<Proposal> proposals = proposals_for(bed.look, bed.options, RefusedBy::measurement);
    return proposals.empty() ? std::vector<std::string>{"no proposal"} : proposals[0].leave_out;
  };
  EXPECT_THAT(left_out(), IsEmpty());
  bed.options.shape = BeadShape::any;
  EXPECT_THAT(left_out(), ElementsAre("--shape"));
}

// The circles that lie near one another, 2.5 radii beyond their centres, in whole pixels and inside the picture. One
// that is hardly a bead counts for nothing, nor does one farther than 20 radii.
TEST(ProposalsForAPicture, GiveTheRegionOfTheBeads) {
  BedInAPicture bed;
  bed.look.survey.candidates[0].few_edges = true, bed.look.survey.candidates[0].plausible = false;
  bed.look.survey.candidates[0].credible = false;
  bed.add(200, 30, 0.4);
  bed.look.width = 900;  // so it is said
  // In the list the outermost on the right follows the one that lies far off, to the right and below.
  bed.add(800, 800, 1);
  bed.add(233, 60, 1);
  double left = 1e9, top = 1e9, right = 233 + 25, bottom = 0;
  for (const Place& place : bed.places) {
    left = std::min(left, place.x - 25), right = std::max(right, place.x + 25);
    top = std::min(top, place.y - 25), bottom = std::max(bottom, place.y + 25);
  }
  const int from_x = std::max(0, static_cast<int>(std::floor(left))),
            from_y = std::max(0, static_cast<int>(std::floor(top)));
  const int width = static_cast<int>(std::ceil(right)) - from_x,
            height = std::min(140, static_cast<int>(std::ceil(bottom))) - from_y;
  const std::vector<Proposal> proposals = proposals_for(bed.look, bed.options, RefusedBy::first_look);
  ASSERT_EQ(proposals.size(), 1U);
  EXPECT_EQ(proposals[0].give, "--roi " + std::to_string(from_x) + "," + std::to_string(from_y) + "," +
                                   std::to_string(width) + "," + std::to_string(height));
  EXPECT_THAT(proposals[0].options.roi, ElementsAre(from_x, from_y, width, height));
  EXPECT_THAT(proposals[0].leave_out, IsEmpty());
  bed.look.survey.candidates[0].disks.resize(2);
  EXPECT_THAT(proposals_for(bed.look, bed.options, RefusedBy::first_look), IsEmpty()) << "two are no region";
}

TEST(ProposalsForAPicture, MayBeInALaterOne) {
  const BedInAPicture bed;
  const std::string blank = (bed.folder / "blank.pgm").string();
  write_text(blank, PaintedPicture(260, 140).noise(2).pgm());
  const std::string count = std::to_string(bed.places.size());
  const auto advice = [&](const std::vector<std::string>& paths, const ExtractOptions& options) {
    std::vector<shakebed::ingest::FrameOrigin> pictures;
    for (const std::string& path : paths) pictures.push_back({path, 0});
    return advice_of_other_pictures(pictures, options);
  };
  EXPECT_EQ(advice({blank, bed.path}, bed.options),
            "bed.pgm shows " + count + " beads: give --skip 1, which leaves out the picture before it");
  EXPECT_EQ(advice({blank, blank, bed.path}, bed.options),
            "bed.pgm shows " + count + " beads: give --skip 2, which leaves out the pictures before it");
  ExtractOptions every_third = bed.options;
  every_third.skip = 4, every_third.stride = 3;
  EXPECT_THAT(advice({blank, blank, bed.path}, every_third), HasSubstr("give --skip 10, ")) << "4 + 2 x 3";
  EXPECT_EQ(advice({bed.path, blank}, bed.options), "") << "the first was refused";
  EXPECT_EQ(advice({blank, blank, blank, blank, bed.path}, bed.options), "") << "three are tried";
}

// --- what is accepted

ingest::Measurement beads_that_touch() {
  ingest::Measurement found;
  found.disk_total = 80, found.disk_count_mean = 80;
  found.calibration.scale_m_per_px = 1e-4, found.calibration.radius_px = 10;
  found.contacts = {100, 100, 20, 20};
  return found;
}

TEST(DisksOfAPicture, AreAcceptedWithinLimits) {
  ExtractOptions options;
  options.diameter = 0.002;
  const auto said = [&](const auto& change) {
    ingest::Measurement found = beads_that_touch();
    change(found);
    try {
      return judge_disks(options, found).warnings;
    } catch (const StageError& error) {
      return std::vector<std::string>{std::string("refused: ") + error.what()};
    }
  };
  EXPECT_THAT(said([](auto&) {}), IsEmpty());
  EXPECT_THAT(said([](auto& found) { found.expected_wrong = 0.02; }), IsEmpty());
  EXPECT_THAT(said([](auto& found) { found.expected_wrong = 0.021; }),
              ElementsAre(StartsWith("2.1 % of the disks found may be wrong.")));
  EXPECT_THAT(said([](auto& found) { found.expected_wrong = 0.2; }), ElementsAre(StartsWith("20.0 % of the disks")));
  EXPECT_THAT(said([](auto& found) { found.expected_wrong = 0.21; }),
              ElementsAre("refused: 21 % of the 80 disks found may be wrong: too many for a measurement"));
  EXPECT_THAT(said([](auto& found) { found.finder.expected_missed = 0.02; }), IsEmpty());
  EXPECT_THAT(said([](auto& found) { found.finder.expected_missed = 0.03; }),
              ElementsAre(StartsWith("About 3 % of the beads may be missed: ")));
  const auto many_missed = [](auto& found) { found.finder.expected_missed = 0.41; };
  EXPECT_THAT(said(many_missed), ElementsAre(StartsWith("refused: About 41 % of the beads may be missed: ")));
  const auto both = [](auto& found) {
    found.finder.expected_missed = 0.36, found.expected_wrong = 0.12;
    found.calibration.radius_px = 11;
  };
  EXPECT_THAT(said(both), ElementsAre("refused: About 36 % of the beads may be missed: between the disks found there "
                                      "are edges in places where a bead fits. 12 % of the disks found may be wrong. "
                                      "Beads that touch and are narrower than 24 px need more pixels"));
  const auto wide = [](auto& found) { found.finder.expected_missed = 0.41, found.calibration.radius_px = 13; };
  EXPECT_THAT(said(wide), ElementsAre(EndsWith("there are edges in places where a bead fits")));
  const auto holes = [](auto& found) { found.contacts = {0, 100, 44, 44}; };
  EXPECT_THAT(said(holes), ElementsAre(StartsWith("refused: Hardly any of the 80 disks found touch: nearest centres "
                                                  "are typically 2.2 diameters apart.")));
  options.shape = BeadShape::any;
  EXPECT_THAT(said(many_missed), ElementsAre(StartsWith("About 41 % of the beads may be missed: ")));
  EXPECT_THAT(said(holes), ElementsAre(StartsWith("Hardly any of the disks found touch: nearest centres are typically "
                                                  "2.20 diameters apart.")));
  options.bead_number = 70;
  EXPECT_THAT(said([](auto&) {}), ElementsAre(StartsWith("On average 80.00 beads were found, but bead_number is 70")));
}

TEST(DisksOfAPicture, AreATrialOfItsOptions) {
  ExtractOptions options;
  options.diameter = 0.002;
  ingest::Measurement found = beads_that_touch();
  ingest::MeasuredDisk disk;
  disk.x_px = 31, disk.y_px = 42, disk.radius_px = 10.5, disk.probability = 0.75;
  std::optional<Trial> trial = judged(options, found, {disk});
  ASSERT_TRUE(trial);
  EXPECT_EQ(trial->beads, 80U);
  EXPECT_EQ(trial->radius_px, 10);
  EXPECT_FALSE(trial->bright);
  EXPECT_EQ(trial->contacts.nearest_px, 20);
  ASSERT_EQ(trial->found.disks.size(), 1U);
  EXPECT_EQ(trial->found.disks[0].circle.x, 31);
  EXPECT_EQ(trial->found.disks[0].circle.y, 42);
  EXPECT_EQ(trial->found.disks[0].circle.radius, 10.5);
  EXPECT_EQ(trial->found.disks[0].probability, 0.75);
  found.calibration.polarity = ingest::Polarity::bright_beads;
  EXPECT_TRUE(judged(options, found, {})->bright);
  found.disk_total = 0;
  EXPECT_FALSE(judged(options, found, {}));
  found.disk_total = 80, found.expected_wrong = 0.3;
  EXPECT_FALSE(judged(options, found, {}));
}

// A reduced copy is tried in the channel that is given: here the beads are in blue alone.
TEST(ReducedPictures, AreTriedInTheirChannel) {
  const ScratchFolder folder;
  const std::string path = (folder / "bed.ppm").string();
  const std::vector<Place> places = lattice(30, 4, 60, 366, 290, 0.02);
  const PaintedPicture plain = PaintedPicture(440, 320).noise(2),
                       beads = PaintedPicture(440, 320).disks(places, 30, 60).blur(1).noise(2, 4);
  write_text(path, PaintedPicture::ppm(plain, plain, beads));
  const FirstLook look{path, 440, 320, {}, nullptr};
  const auto reduced = reduced_for_trials(look, 30);
  ASSERT_TRUE(reduced);
  ExtractOptions options;
  options.diameter = 0.004;
  const auto tried = [&](BeadChannel channel) {
    options.channel = channel;
    return try_options({path, 0}, options, &*reduced);
  };
  ASSERT_TRUE(tried(BeadChannel::blue));
  EXPECT_EQ(tried(BeadChannel::blue)->beads, places.size());
  EXPECT_FALSE(tried(BeadChannel::red));
  EXPECT_FALSE(reduced_for_trials({(folder / "none.ppm").string(), 440, 320, {}, nullptr}, 30));
}

}  // namespace
