#include "pipelines/stages/preview.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "ingest/profile/candidate_picture.hpp"
#include "pipelines/formats/files.hpp"
#include "pipelines/stages/picture_trial.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_shown = 3;  // candidates, or what was tried

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  }
  return out;
}

std::string quoted(const std::string& text) {
  if (text.find_first_of(" '\"\\$&;()*?<>|`") == std::string::npos) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// Do they look for the same beads?
bool same(const ingest::SurveyCandidate& one, const ingest::SurveyCandidate& other) {
  constexpr double another = 1.05;
  const double ratio = one.rims.radius_px / other.rims.radius_px;
  return one.rims.polarity == other.rims.polarity && one.channel == other.channel && ratio < another &&
         ratio * another > 1;
}

const char* name_of(ingest::Polarity polarity) {
  return polarity == ingest::Polarity::bright_beads ? "bright" : "dark";
}

bool needs_any_shape(const ingest::SurveyCandidate& candidate) {
  return candidate.not_round || !candidate.why_drawn.empty();
}

// What is given of where beads are and how they look, as on the command line.
std::string words_of(const ExtractOptions& options) {
  std::string text = fmt::format(" --diameter \"{:g} mm\"", 1e3 * options.diameter);
  if (options.second_diameter) text += fmt::format(" --second-diameter \"{:g} mm\"", 1e3 * *options.second_diameter);
  if (options.scale) text += fmt::format(" --scale \"{:.6g} mm/px\"", 1e3 * *options.scale);
  if (!options.roi.empty()) text += fmt::format(" --roi {:g}", fmt::join(options.roi, ","));
  if (options.floor) text += fmt::format(" --floor {:g}", *options.floor);
  if (options.left_wall) text += fmt::format(" --left-wall {:g}", *options.left_wall);
  if (options.right_wall) text += fmt::format(" --right-wall {:g}", *options.right_wall);
  if (options.pixel_aspect) text += fmt::format(" --pixel-aspect {:g}", *options.pixel_aspect);
  if (options.lens_radial) text += fmt::format(" --lens {:g}", *options.lens_radial);
  if (options.bead_number) text += fmt::format(" --bead-number {}", *options.bead_number);
  if (options.skip > 0) text += fmt::format(" --skip {}", options.skip);
  if (options.channel != BeadChannel::automatic)
    text += fmt::format(" --channel {}", ingest::name_of(channel_of(options.channel)));
  if (options.polarity != BeadPolarity::automatic)
    text += fmt::format(" --polarity {}", name_of(polarity_of(options.polarity)));
  if (options.radius) text += fmt::format(" --radius {:g}", *options.radius);
  if (options.shape == BeadShape::any) text += " --shape any";
  return text;
}

std::string picture_of(std::size_t number) {
  return fmt::format("<p><img src=\"preview_{}.png\" alt=\"the beads found\"></p>\n", number);
}

std::string section_of(const ingest::SurveyCandidate& candidate, std::size_t number, const std::string& command) {
  return fmt::format(
      "<h2>{}. {} beads of about {:.1f} px radius, channel {}</h2>\n<p>{} beads; expected share of false beads {:.1f} "
      "%; the beads' rims are {:.0f} % of the edges in the picture. {}</p>\n{}{}",
      number, name_of(candidate.rims.polarity), candidate.rims.radius_px, ingest::name_of(candidate.channel),
      candidate.disks.size(), 100 * candidate.expected_wrong, 100 * candidate.explained_share,
      candidate.credible ? "" : escaped(fmt::format("Not credible: {}.", candidate.why_not)),
      command.empty() ? "" : fmt::format("<pre>{}</pre>\n", escaped(command)), picture_of(number));
}

std::string section_of(const Proposal& proposal, std::size_t number, const std::string& command) {
  return fmt::format("<h2>{}. Tried: {}</h2>\n<pre>{}</pre>\n{}", number, proposal.seen, escaped(command),
                     picture_of(number));
}

}  // namespace

ingest::SurveyOptions survey_asked_for(const ExtractOptions& options) {
  ingest::SurveyOptions asked;
  asked.polarity = polarity_of(options.polarity);
  asked.radius_px = options.radius;
  asked.any_shape = options.shape == BeadShape::any;
  if (options.roi.size() == 4)
    asked.roi = ingest::PixelRectangle{static_cast<int>(options.roi[0]), static_cast<int>(options.roi[1]),
                                       static_cast<int>(options.roi[2]), static_cast<int>(options.roi[3])};
  return asked;
}

std::vector<ingest::FrameOrigin> first_pictures(const std::vector<std::string>& files,
                                                const ingest::FrameSourceOptions& source) {
  const auto pictures_of = [&](const ingest::FrameSourceOptions& options) {
    return ingest::FrameSource::open(files, options).first_origins(ingest::most_tried);
  };
  std::vector<ingest::FrameOrigin> pictures = pictures_of(source);
  if (!pictures.empty()) return pictures;
  ingest::FrameSourceOptions all = source;
  all.skip = 0;
  // A film that cannot be opened has no frame at all, and says so here.
  if (source.skip > 0 && ingest::FrameSource::open(files, all).next())
    throw StageError(
        fmt::format("{}: no frame is left, because skip leaves out {} frames at the beginning. Give a "
                    "smaller number",
                    files.front(), source.skip));
  return {{files.front(), 0}};
}

std::optional<FirstLook> look_at_first(const std::vector<ingest::FrameOrigin>& pictures, const ExtractOptions& options,
                                       LookFor purpose, std::optional<double> pixel_aspect) {
  if (options.pixel_aspect) pixel_aspect = options.pixel_aspect;
  if (!pixel_aspect) pixel_aspect = ingest::stated_pixel_aspect(pictures.front().path);
  ingest::SurveyOptions asked = survey_asked_for(options);
  asked.channel_alone = purpose == LookFor::preview;
  if (purpose == LookFor::search && !options.reduction) asked.search = ingest::search_after_survey(asked_for(options));
  ingest::FrameSourceOptions source;
  source.channel = channel_of(options.channel);
  return ingest::look_at_first(pictures, asked, source, *pixel_aspect);
}

std::string options_for(const ingest::SurveyCandidate& candidate) {
  std::string text;
  if (candidate.channel != ingest::Channel::automatic)
    text = fmt::format("--channel {} ", ingest::name_of(candidate.channel));
  return text +
         fmt::format("--polarity {} --radius {:.2f}", name_of(candidate.rims.polarity), candidate.rims.radius_px) +
         (needs_any_shape(candidate) ? " --shape any" : "") +
         (candidate.region ? fmt::format(" --roi {},{},{},{}", candidate.region->left, candidate.region->top,
                                         candidate.region->width, candidate.region->height)
                           : "");
}

void take_candidate(const ingest::SurveyCandidate& candidate, ExtractOptions& options) {
  constexpr double digits = 100;  // as options_for() writes the radius
  if (candidate.channel != ingest::Channel::automatic)
    options.channel = static_cast<BeadChannel>(static_cast<int>(candidate.channel) + 1);
  options.polarity =
      candidate.rims.polarity == ingest::Polarity::bright_beads ? BeadPolarity::bright : BeadPolarity::dark;
  options.radius = std::round(digits * candidate.rims.radius_px) / digits;
  options.shape = needs_any_shape(candidate) ? BeadShape::any : options.shape;
  if (const auto& region = candidate.region)
    options.roi = {static_cast<double>(region->left), static_cast<double>(region->top),
                   static_cast<double>(region->width), static_cast<double>(region->height)};
}

std::vector<const ingest::SurveyCandidate*> different_candidates(const ingest::Survey& survey) {
  std::vector<const ingest::SurveyCandidate*> out;
  for (const ingest::SurveyCandidate& candidate : survey.candidates) {
    if (out.size() == most_shown) break;
    if (std::none_of(out.begin(), out.end(), [&](const auto* one) { return same(candidate, *one); }))
      out.push_back(&candidate);
  }
  return out;
}

void write_preview(const std::filesystem::path& folder, const FirstLook& look, const std::vector<std::string>& files,
                   const ExtractOptions& options, const std::vector<Proposal>& proposals) {
  std::string program = "shakebed fit-images";
  for (const std::string& file : files) program += " " + quoted(file);
  std::string body;
  const ingest::Survey& survey = look.survey;
  body +=
      survey.found
          ? "<p>The first candidate is used unless options choose another. This is a first look, without a fit of "
            "each bead. The run may find more beads, and it states their radius with its error. It compares channels "
            "more thoroughly, so it may choose another one. The commands were not tried.</p>\n"
          : fmt::format("<p><b>No beads are found: {}.</b></p>\n", escaped(survey.why_not));
  const std::shared_ptr<const ingest::CandidatePictures> drawn =
      look.picture ? look.picture
                   : std::make_shared<const ingest::CandidatePictures>(look.path, look.page, look.pixel_aspect);
  const ingest::CandidatePictures& pictures = *drawn;
  std::size_t number = 0;
  for (const Proposal& proposal : proposals) {
    pictures.write(folder / fmt::format("preview_{}.png", ++number), &proposal.found, proposal.bead_aspect);
    body += section_of(proposal, number, program + words_of(proposal.options));
  }
  for (const auto* candidate : different_candidates(survey)) {
    if (number == most_shown) break;
    pictures.write(folder / fmt::format("preview_{}.png", ++number), candidate);
    ExtractOptions taken = options;
    take_candidate(*candidate, taken);
    const bool possible = survey.found && proposals.empty() && (candidate->plausible || candidate->credible);
    body += section_of(*candidate, number, possible ? program + words_of(taken) : "");
  }
  if (number == 0) {
    pictures.write(folder / "preview_1.png", nullptr);
    body += "<p><img src=\"preview_1.png\" alt=\"the picture\"></p>\n";
  }
  write_file_atomically(
      folder / "preview.html",
      fmt::format(
          "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
          "content=\"width=device-width,initial-scale=1\"><title>Beads in {0}</title>\n"
          "<style>body{{font-family:sans-serif;line-height:1.5;max-width:1060px;margin:1em auto;padding:0 "
          "1em;overflow-wrap:anywhere}}img{{max-width:100%}}"
          "pre{{background:#eee;padding:.6em;white-space:pre-wrap}}</style></head><body>\n<h1>Beads in {0}</h1>\n"
          "<p>{1} x {2} px. Magenta circles: probability 0.9 or more; yellow: less.</p>\n{3}</body></html>\n",
          escaped(look.path), look.width, look.height, body));
}

}  // namespace shakebed::pipelines
