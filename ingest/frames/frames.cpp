#include "ingest/frames/frames.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <utility>

#include "ingest/frames/atomic_file.hpp"
#include "ingest/frames/grey_levels.hpp"
#include "ingest/frames/picture_files.hpp"
#include "ingest/frames/repeated_pixels.hpp"

namespace shakebed::ingest {

namespace fs = std::filesystem;

InputError::InputError(std::string path, std::string problem, std::string why, std::string suggestion)
    : std::runtime_error(path + ": " + problem + " (" + why + "); " + suggestion),
      path_(std::move(path)),
      problem_(std::move(problem)),
      why_(std::move(why)),
      suggestion_(std::move(suggestion)) {}

namespace {

constexpr std::size_t most_kept_pixels = 4'000'000;  // of a picture that is kept for the next pass

// frame2 before frame10.
bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t i_end = i, j_end = j;
      while (i_end < a.size() && digit(a[i_end])) ++i_end;
      while (j_end < b.size() && digit(b[j_end])) ++j_end;
      while (i + 1 < i_end && a[i] == '0') ++i;
      while (j + 1 < j_end && b[j] == '0') ++j;
      if (i_end - i != j_end - j) return i_end - i < j_end - j;
      const int order = a.compare(i, i_end - i, b, j, j_end - j);
      if (order != 0) return order < 0;
      i = i_end;
      j = j_end;
    } else {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i;
      ++j;
    }
  }
  if (a.size() - i != b.size() - j) return a.size() - i < b.size() - j;
  return a < b;
}

bool has_wildcard(const std::string& text) { return text.find_first_of("*?[") != std::string::npos; }

// Paths that match a pattern with wildcards in any of its components, in natural order.
std::vector<fs::path> expand_glob(const std::string& pattern) {
  const fs::path whole(pattern);
  std::vector<fs::path> bases = {whole.is_absolute() ? whole.root_path() : fs::path()};
  for (const fs::path& component : whole.relative_path()) {
    std::vector<fs::path> grown;
    for (const fs::path& base : bases) {
      if (!has_wildcard(component.string())) {
        if (fs::exists(base / component)) grown.push_back(base / component);
        continue;
      }
      std::error_code error;
      for (const auto& entry : fs::directory_iterator(base.empty() ? fs::path(".") : base, error)) {
        const std::string name = entry.path().filename().string();
        if (fnmatch(component.c_str(), name.c_str(), FNM_PERIOD) == 0) grown.push_back(base / name);
      }
    }
    bases = std::move(grown);
  }
  std::sort(bases.begin(), bases.end(),
            [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
  return bases;
}

// Of a picture that is no frame of a film: those are never enlarged by repeating pixels.
GrayFrame grey_of_still(cv::Mat picture, const std::string& path, const FrameSourceOptions& options, GreyRule& rule) {
  const double enlargement = smooth_repeated_pixels(picture);
  GrayFrame frame = to_gray(picture, path, options, rule);
  frame.enlargement = std::max(1.0, enlargement / options.reduction);
  return frame;
}

GrayFrame read_image(const std::string& path, Kind kind, std::size_t page, const FrameSourceOptions& options,
                     GreyRule& rule) {
  return grey_of_still(decode_image(path, kind, page, options),
                       page == 0 ? path : path + " (page " + std::to_string(page) + ")", options, rule);
}

}  // namespace

struct FrameSource::State {
  FrameSourceOptions options;
  // Files ...
  struct Entry {
    std::string path;
    Kind kind;
  };
  std::vector<Entry> entries;
  std::size_t entry = 0, page = 0;
  std::vector<std::optional<std::size_t>> pages;  // of each TIFF, once counted
  std::unique_ptr<Film> film;
  std::shared_ptr<GreyRule> rule = std::make_shared<GreyRule>();
  bool rule_decided = false;
  // ... or frames made on demand.
  std::function<GrayFrame(std::size_t)> make;
  std::size_t made_count = 0;

  std::size_t index = 0;  // of the next item of the unstrided stream

  // The picture that settled the rule, unless it is large: after a rewind it is not decoded again.
  std::shared_ptr<const GrayFrame> first_picture;
  std::size_t first_index = 0;

  std::size_t page_count(std::size_t which) {
    if (!pages[which]) {
      quiet_opencv();
      std::size_t count = 1;
      try {
        count = cv::imcount(entries[which].path, cv::IMREAD_ANYDEPTH | cv::IMREAD_ANYCOLOR);
      } catch (const cv::Exception&) {
        count = 1;
      }
      pages[which] = std::max<std::size_t>(1, count);  // an unreadable file still is one item, whose decoding says why
    }
    return *pages[which];
  }

  // Whether the frame is one of those asked for, and how many such come before it.
  [[nodiscard]] bool wanted(std::size_t frame) const {
    return frame >= options.skip && (frame - options.skip) % options.stride == 0;
  }
  [[nodiscard]] std::size_t wanted_before(std::size_t frame) const {
    return frame <= options.skip ? 0 : (frame - options.skip + options.stride - 1) / options.stride;
  }

  // The next item, wanted or not. `skip`: step over it without decoding.
  std::optional<FrameSource::Item> step(bool skip) {
    Item item;
    item.index = index;
    if (make) {
      if (index >= made_count) return std::nullopt;
      item.origin = {"frame " + std::to_string(index), 0};
      item.decode = [this_make = make, k = index] { return this_make(k); };
      ++index;
      return item;
    }
    while (entry < entries.size()) {
      const Entry current = entries[entry];
      const std::size_t current_page = page;
      item.origin = {current.path, current_page};
      if (current.kind == Kind::film) {
        if (step_in_film(current, skip, item)) return item;
        continue;
      }
      if (current.kind == Kind::tiff) {
        if (current_page >= page_count(entry)) {
          advance_entry();
          continue;
        }
        ++page;
      } else {
        advance_entry();
      }
      ++index;
      if (skip) return item;
      if (first_picture && item.index == first_index)
        item.decode = [frame = first_picture] { return *frame; };
      else
        prepare_decoding(current, current_page, item);
      return item;
    }
    return std::nullopt;
  }

  // The next frame of a film, or the error that it gives instead. False at its end.
  bool step_in_film(const Entry& current, bool skip, Item& item) {
    const auto failed = [&](const InputError& error) {
      advance_entry();
      ++index;
      item.decode = [error]() -> GrayFrame { throw error; };
      return true;
    };
    std::optional<cv::Mat> picture;
    try {
      if (!film) film = std::make_unique<Film>(current.path, options);
      if (!skip) picture = film->picture(page);
    } catch (const InputError& error) {
      return failed(error);
    }
    if (skip ? !film->step_over(page) : !picture) {
      advance_entry();
      return false;
    }
    if (!skip) {
      auto frame = std::make_shared<GrayFrame>(to_gray(*picture, current.path, options, *rule));
      rule_decided = true;
      item.decode = [frame] { return std::move(*frame); };
    }
    ++page;
    ++index;
    return true;
  }

  // The first readable frame settles channel and depth for all, whoever decodes later.
  void prepare_decoding(const Entry& current, std::size_t current_page, Item& item) {
    if (rule_decided) {
      item.decode = [current, current_page, this_options = options, settled = *rule]() mutable {
        return read_image(current.path, current.kind, current_page, this_options, settled);
      };
      return;
    }
    try {
      auto frame = std::make_shared<GrayFrame>(read_image(current.path, current.kind, current_page, options, *rule));
      rule_decided = true;
      if (frame->pixels.size() <= most_kept_pixels)
        first_picture = std::make_shared<const GrayFrame>(*frame), first_index = item.index;
      item.decode = [frame] { return std::move(*frame); };
    } catch (const InputError& error) {
      item.decode = [error]() -> GrayFrame { throw error; };
    }
  }

  void advance_entry() {
    ++entry;
    page = 0;
    film.reset();
  }
};

FrameSource::FrameSource(std::unique_ptr<State> state) : state_(std::move(state)) {}
FrameSource::FrameSource(FrameSource&&) noexcept = default;
FrameSource& FrameSource::operator=(FrameSource&&) noexcept = default;
FrameSource::~FrameSource() = default;

bool FrameSource::is_frame_file(const fs::path& path) { return kind_of(path) != Kind::unknown; }

FrameSource FrameSource::open(const std::vector<std::string>& paths, const FrameSourceOptions& options) {
  auto state = std::make_unique<State>();
  state->options = options;
  state->options.stride = std::max<std::size_t>(1, options.stride);
  if (paths.empty())
    throw InputError("(no path)", "no frames given", "the list of paths is empty", "give files or a folder");
  for (const std::string& given : paths) {
    std::vector<fs::path> found;
    std::error_code error;
    if (fs::is_directory(given, error)) {
      for (const auto& entry : fs::directory_iterator(given, error))
        if (entry.is_regular_file(error) && kind_of(entry.path()) != Kind::unknown) found.push_back(entry.path());
      std::sort(found.begin(), found.end(),
                [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
      if (found.empty())
        throw InputError(given, "no picture or film in this folder", "it contains no file with a known ending",
                         "known endings: .png .tif .tiff .jpg .bmp .pgm .mp4 .avi .mov .mkv");
    } else if (fs::exists(given, error)) {
      if (kind_of(given) == Kind::unknown)
        throw InputError(given, "neither a picture nor a film", "its ending is not known",
                         "known endings: .png .tif .tiff .jpg .bmp .pgm .mp4 .avi .mov .mkv");
      found.emplace_back(given);
    } else if (has_wildcard(given)) {
      for (const fs::path& match : expand_glob(given))
        if (kind_of(match) != Kind::unknown && fs::is_regular_file(match, error)) found.push_back(match);
      if (found.empty())
        throw InputError(given, "nothing matches", "no picture or film has such a name", "check the pattern");
    } else {
      throw InputError(given, "no such file or folder", "it does not exist", "check the path");
    }
    for (const fs::path& path : found) state->entries.push_back({path.string(), kind_of(path)});
  }
  state->pages.resize(state->entries.size());
  return FrameSource(std::move(state));
}

FrameSource FrameSource::from_generator(std::size_t count, std::function<GrayFrame(std::size_t)> make) {
  auto state = std::make_unique<State>();
  state->make = std::move(make);
  state->made_count = count;
  return FrameSource(std::move(state));
}

FrameSource FrameSource::from_frames(std::vector<GrayFrame> frames) {
  const std::size_t count = frames.size();
  auto shared = std::make_shared<std::vector<GrayFrame>>(std::move(frames));
  return from_generator(count, [shared](std::size_t k) { return (*shared)[k]; });
}

std::optional<FrameSource::Item> FrameSource::next_item() {
  while (!state_->wanted(state_->index))
    if (!state_->step(true)) return std::nullopt;
  auto item = state_->step(false);
  if (item) item->index = state_->wanted_before(item->index);
  return item;
}

std::optional<GrayFrame> FrameSource::next(FrameOrigin* origin) {
  auto item = next_item();
  if (!item) return std::nullopt;
  if (origin) *origin = item->origin;
  return item->decode();
}

void FrameSource::rewind() {
  state_->entry = 0;
  state_->page = 0;
  state_->index = 0;
  state_->film.reset();
}

std::vector<FrameOrigin> FrameSource::first_origins(std::size_t most) {
  rewind();
  std::vector<FrameOrigin> origins;
  while (origins.size() < most) {
    const auto item = state_->step(true);
    if (!item) break;
    if (state_->wanted(item->index)) origins.push_back(item->origin);
  }
  rewind();
  return origins;
}

std::optional<double> FrameSource::film_rate_hz() const {
  if (state_->entries.size() != 1 || state_->entries.front().kind != Kind::film) return std::nullopt;
  try {
    const double rate = Film(state_->entries.front().path, state_->options).rate_hz();
    if (std::isfinite(rate) && rate > 0) return rate / static_cast<double>(state_->options.stride);
  } catch (const InputError&) {
    // Reading the film says why.
  }
  return std::nullopt;
}

double stated_pixel_aspect(const std::string& path) {
  if (kind_of(path) != Kind::film) return 1;
  try {
    const double aspect = Film(path, {}).pixel_aspect();
    if (aspect >= narrowest_pixel && aspect <= widest_pixel) return aspect;
  } catch (const InputError&) {
    // Reading the film says why.
  }
  return 1;
}

std::optional<std::size_t> FrameSource::count_if_known() const {
  if (state_->make) return state_->wanted_before(state_->made_count);
  std::size_t count = 0;
  for (std::size_t which = 0; which < state_->entries.size(); ++which) {
    if (state_->entries[which].kind == Kind::film) return std::nullopt;
    count += state_->entries[which].kind == Kind::tiff ? state_->page_count(which) : 1;
  }
  return state_->wanted_before(count);
}

const char* name_of(Channel channel) {
  switch (channel) {
    case Channel::automatic:
      return "automatic";
    case Channel::red:
      return "red";
    case Channel::green:
      return "green";
    case Channel::blue:
      return "blue";
    case Channel::grey:
      return "grey";
    case Channel::saturation:
      return "saturation";
    case Channel::background_distance:
      return "background_distance";
    case Channel::grey_distance:
      return "grey_distance";
  }
  return "automatic";
}

GrayFrame read_frame(const fs::path& path, std::size_t page, const FrameSourceOptions& options) {
  GreyRule rule;
  return grey_of_still(decode_picture(path, page, options), path.string(), options, rule);
}

int reduction_to(std::size_t most, std::size_t pixels) {
  int reduction = 1;
  while (pixels / static_cast<std::size_t>(reduction * reduction) > most) ++reduction;
  return reduction;
}

ChannelFrames read_channels(const fs::path& path, std::size_t page, std::size_t most_pixels,
                            const FrameSourceOptions& options) {
  ChannelFrames frames;
  cv::Mat picture = decode_picture(path, page, options);
  frames.width = picture.cols;
  frames.height = picture.rows;
  const double enlargement = smooth_repeated_pixels(picture);
  frames.reduction = reduction_to(most_pixels, picture.total());
  picture = averaged(picture, frames.reduction);
  std::vector<Channel> wanted = {options.channel};
  if (options.channel == Channel::automatic && has_colour(picture))
    wanted = {Channel::grey,       Channel::red,  Channel::background_distance,
              Channel::saturation, Channel::blue, Channel::green};
  for (const Channel channel : wanted) {
    GreyRule rule;
    FrameSourceOptions of_channel = options;
    of_channel.channel = channel;
    frames.channels.push_back({channel, to_gray(picture, path.string(), of_channel, rule)});
    frames.channels.back().frame.enlargement = enlargement;
  }
  return frames;
}

void write_png(const fs::path& path, const GrayFrame& frame, int compression) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw InputError(path.string(), "no picture to write", "the frame is empty or its size is wrong",
                     "check the frame");
  cv::Mat picture(frame.height, frame.width, CV_8U);
  for (int row = 0; row < frame.height; ++row) {
    const float* from = frame.pixels.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(frame.width);
    std::uint8_t* to = picture.ptr<std::uint8_t>(row);
    for (int column = 0; column < frame.width; ++column) {
      const float level = std::min(255.0F, std::max(0.0F, from[column]));  // NaN becomes 0
      to[column] = static_cast<std::uint8_t>(level + 0.5F);
    }
  }
  std::vector<std::uint8_t> bytes;
  std::vector<int> parameters = {cv::IMWRITE_PNG_COMPRESSION, std::clamp(compression, 0, 9)};
  if (compression <= 1) {
    parameters.push_back(cv::IMWRITE_PNG_STRATEGY);
    parameters.push_back(cv::IMWRITE_PNG_STRATEGY_RLE);
  }
  cv::imencode(".png", picture, bytes, parameters);
  write_file_atomically(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace shakebed::ingest
