#include "pipelines/stages/preview.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "ingest/profile/candidate_picture.hpp"
#include "pipelines/formats/files.hpp"

namespace shakebed::pipelines {
namespace {

constexpr std::size_t most_shown = 3;  // candidates

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

std::string section_of(const ingest::SurveyCandidate& candidate, std::size_t number, const std::string& command) {
  return fmt::format(
      "<h2>{}. {} beads of about {:.1f} px radius, channel {}</h2>\n<p>{} beads; expected share of wrong ones {:.1f} "
      "%; the "
      "beads' rims are {:.0f} % of the edges in the picture. {}</p>\n{}<p><img src=\"preview_{}.png\" "
      "alt=\"the beads found\"></p>\n",
      number, candidate.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark", candidate.rims.radius_px,
      ingest::name_of(candidate.channel), candidate.disks.size(), 100 * candidate.expected_wrong,
      100 * candidate.explained_share,
      candidate.credible ? "" : escaped(fmt::format("Not believed: {}.", candidate.why_not)),
      candidate.plausible || candidate.credible
          ? fmt::format("<pre>{}</pre>\n", escaped(fmt::format("{} {}", command, options_for(candidate))))
          : "",
      number);
}

}  // namespace

std::optional<FirstLook> look_at_first(const std::vector<std::string>& paths, const ExtractOptions& options) {
  ingest::SurveyOptions asked;
  asked.polarity = polarity_of(options.polarity);
  asked.radius_px = options.radius;
  asked.any_shape = options.shape == BeadShape::any;
  if (options.roi.size() == 4)
    asked.roi = ingest::PixelRectangle{static_cast<int>(options.roi[0]), static_cast<int>(options.roi[1]),
                                       static_cast<int>(options.roi[2]), static_cast<int>(options.roi[3])};
  ingest::FrameSourceOptions source;
  source.channel = channel_of(options.channel);
  std::vector<ingest::FrameOrigin> pictures;
  for (const std::string& path : paths) pictures.push_back({path, 0});
  return ingest::look_at_first(pictures, asked, source);
}

std::string seen_without_options(const std::vector<std::string>& paths, ExtractOptions options) {
  std::vector<std::string> given;
  if (options.polarity != BeadPolarity::automatic) given.emplace_back("polarity");
  if (options.radius) given.emplace_back("radius");
  if (options.channel != BeadChannel::automatic) given.emplace_back("channel");
  if (given.empty()) return "";
  options.polarity = BeadPolarity::automatic, options.channel = BeadChannel::automatic;
  options.radius.reset();
  const std::optional<FirstLook> look = look_at_first(paths, options);
  if (!look || !look->survey.found) return "";
  const ingest::SurveyCandidate& best = look->survey.candidates.front();
  return fmt::format("Without the {} given, {} {} beads of {:.1f} px radius are seen", fmt::join(given, " and "),
                     best.disks.size(), best.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark",
                     best.rims.radius_px);
}

std::string options_for(const ingest::SurveyCandidate& candidate) {
  std::string text;
  if (candidate.channel != ingest::Channel::automatic)
    text = fmt::format("--channel {} ", ingest::name_of(candidate.channel));
  return text +
         fmt::format("--polarity {} --radius {:.2f}",
                     candidate.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark",
                     candidate.rims.radius_px) +
         (candidate.not_round || !candidate.why_drawn.empty() ? " --shape any" : "");
}

std::vector<std::string> proposed_options(const ingest::Survey& survey) {
  constexpr std::size_t most = 2;
  constexpr double another = 1.05;
  std::vector<std::string> options;
  std::vector<const ingest::SurveyCandidate*> proposed;
  for (const ingest::SurveyCandidate& candidate : survey.candidates) {
    const auto same = [&](const ingest::SurveyCandidate* other) {
      const double ratio = candidate.rims.radius_px / other->rims.radius_px;
      return candidate.rims.polarity == other->rims.polarity && candidate.channel == other->channel &&
             ratio < another && ratio * another > 1;
    };
    if (options.size() == most || !candidate.plausible || std::any_of(proposed.begin(), proposed.end(), same)) continue;
    proposed.push_back(&candidate);
    options.push_back(options_for(candidate));
  }
  return options;
}

void write_preview(const std::filesystem::path& folder, const FirstLook& look, const std::vector<std::string>& files,
                   const std::string& diameter) {
  std::string command = "shakebed fit-images";
  for (const std::string& file : files) command += " " + quoted(file);
  command += fmt::format(" --diameter {}", quoted(diameter));
  std::string body;
  const ingest::Survey& survey = look.survey;
  body += survey.found
              ? "<p>The first candidate is used unless options say otherwise. This is a first look, without the fit of "
                "each bead: the run may find more of them, and states their radius with its error.</p>\n"
              : fmt::format("<p><b>No beads are found: {}.</b></p>\n", escaped(survey.why_not));
  const ingest::CandidatePictures pictures(look.path);
  for (std::size_t k = 0; k < std::min(most_shown, survey.candidates.size()); ++k) {
    pictures.write(folder / fmt::format("preview_{}.png", k + 1), &survey.candidates[k]);
    body += section_of(survey.candidates[k], k + 1, command);
  }
  if (survey.candidates.empty()) {
    pictures.write(folder / "preview_1.png", nullptr);
    body += "<p><img src=\"preview_1.png\" alt=\"the picture\"></p>\n";
  }
  write_file_atomically(
      folder / "preview.html",
      fmt::format(
          "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Beads in {0}</title>\n"
          "<style>body{{font-family:sans-serif;max-width:1400px;margin:2em auto}}img{{max-width:100%}}"
          "pre{{background:#eee;padding:.6em;white-space:pre-wrap}}</style></head><body>\n<h1>Beads in {0}</h1>\n"
          "<p>{1} x {2} px. Magenta circles: probability 0.9 or more; yellow: less.</p>\n{3}</body></html>\n",
          escaped(look.path), look.width, look.height, body));
}

}  // namespace shakebed::pipelines
