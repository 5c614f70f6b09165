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

// Do they look for the same beads?
bool same(const ingest::SurveyCandidate& one, const ingest::SurveyCandidate& other) {
  constexpr double another = 1.05;
  const double ratio = one.rims.radius_px / other.rims.radius_px;
  return one.rims.polarity == other.rims.polarity && one.channel == other.channel && ratio < another &&
         ratio * another > 1;
}

// The candidates that differ, and of which the condition holds; the best of each first.
template <class Condition>
std::vector<const ingest::SurveyCandidate*> different(const ingest::Survey& survey, std::size_t most,
                                                      const Condition& holds) {
  std::vector<const ingest::SurveyCandidate*> out;
  for (const ingest::SurveyCandidate& candidate : survey.candidates) {
    if (out.size() == most) break;
    if (holds(candidate) &&
        std::none_of(out.begin(), out.end(), [&](const auto* one) { return same(candidate, *one); }))
      out.push_back(&candidate);
  }
  return out;
}

// What is given besides the option of a candidate, as on the command line.
std::string given_besides(const ExtractOptions& options) {
  std::string text = fmt::format(" --diameter \"{:g} mm\"", 1e3 * options.diameter);
  if (options.second_diameter) text += fmt::format(" --second-diameter \"{:g} mm\"", 1e3 * *options.second_diameter);
  if (options.scale) text += fmt::format(" --scale \"{:.6g} mm/px\"", 1e3 * *options.scale);
  if (!options.roi.empty()) text += fmt::format(" --roi {:g}", fmt::join(options.roi, ","));
  if (options.floor) text += fmt::format(" --floor {:g}", *options.floor);
  if (options.left_wall) text += fmt::format(" --left-wall {:g}", *options.left_wall);
  if (options.right_wall) text += fmt::format(" --right-wall {:g}", *options.right_wall);
  return text;
}

std::string section_of(const ingest::SurveyCandidate& candidate, std::size_t number, const std::string& command) {
  return fmt::format(
      "<h2>{}. {} beads of about {:.1f} px radius, channel {}</h2>\n<p>{} beads; expected share of false beads {:.1f} "
      "%; the beads' rims are {:.0f} % of the edges in the picture. {}</p>\n{}<p><img src=\"preview_{}.png\" alt=\"the "
      "beads found\"></p>\n",
      number, candidate.rims.polarity == ingest::Polarity::bright_beads ? "bright" : "dark", candidate.rims.radius_px,
      ingest::name_of(candidate.channel), candidate.disks.size(), 100 * candidate.expected_wrong,
      100 * candidate.explained_share,
      candidate.credible ? "" : escaped(fmt::format("Not credible: {}.", candidate.why_not)),
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
  return fmt::format("Without the given {}, {} {} beads of {:.1f} px radius are found", fmt::join(given, " and "),
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
  std::vector<std::string> options;
  for (const auto* candidate : different(survey, most, [](const auto& one) { return one.plausible; }))
    options.push_back(options_for(*candidate));
  return options;
}

void write_preview(const std::filesystem::path& folder, const FirstLook& look, const std::vector<std::string>& files,
                   const ExtractOptions& options) {
  std::string command = "shakebed fit-images";
  for (const std::string& file : files) command += " " + quoted(file);
  command += given_besides(options);
  std::string body;
  const ingest::Survey& survey = look.survey;
  body += survey.found
              ? "<p>The first candidate is used unless options choose another. This is a first look, without a fit of "
                "each bead. The run may find more beads, and it states their radius with its error.</p>\n"
              : fmt::format("<p><b>No beads are found: {}.</b></p>\n", escaped(survey.why_not));
  const ingest::CandidatePictures pictures(look.path);
  std::size_t number = 0;
  for (const auto* candidate : different(survey, most_shown, [](const auto&) { return true; })) {
    ++number;
    pictures.write(folder / fmt::format("preview_{}.png", number), candidate);
    body += section_of(*candidate, number, command);
  }
  if (survey.candidates.empty()) {
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
