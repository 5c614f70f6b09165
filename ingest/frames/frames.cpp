#include "ingest/frames/frames.hpp"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <limits>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <utility>

#include "ingest/frames/atomic_file.hpp"

namespace shakebed::ingest {

namespace fs = std::filesystem;

InputError::InputError(std::string path, std::string problem, std::string why, std::string suggestion)
    : std::runtime_error(path + ": " + problem + " (" + why + "); " + suggestion),
      path_(std::move(path)),
      problem_(std::move(problem)),
      why_(std::move(why)),
      suggestion_(std::move(suggestion)) {}

namespace {

enum class Kind { image, tiff, film, unknown };

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

// By the first bytes of the file.
Kind kind_of_contents(const fs::path& path) {
  std::array<char, 16> bytes{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), bytes.size())) return Kind::unknown;
  const std::string head(bytes.begin(), bytes.end());
  const auto starts = [&](std::string_view with) { return head.compare(0, with.size(), with) == 0; };
  if (starts(std::string_view("II*\0", 4)) || starts(std::string_view("MM\0*", 4))) return Kind::tiff;
  if (starts("\x89PNG") || starts("\xff\xd8\xff") || (starts("RIFF") && head.compare(8, 4, "WEBP") == 0))
    return Kind::image;
  if ((starts("RIFF") && head.compare(8, 4, "AVI ") == 0) || head.compare(4, 4, "ftyp") == 0 ||
      starts("\x1a\x45\xdf\xa3"))
    return Kind::film;
  return Kind::unknown;
}

Kind kind_of_name(const fs::path& path) {
  static const std::array<const char*, 12> images = {".png", ".jpg", ".jpeg", ".jpe", ".bmp",  ".dib",
                                                     ".pgm", ".ppm", ".pnm",  ".jp2", ".webp", ".exr"};
  static const std::array<const char*, 9> films = {".mp4", ".avi",  ".mov", ".mkv", ".m4v",
                                                   ".mpg", ".mpeg", ".wmv", ".webm"};
  const std::string extension = lower_extension(path);
  if (extension == ".tif" || extension == ".tiff") return Kind::tiff;
  if (std::find(images.begin(), images.end(), extension) != images.end()) return Kind::image;
  if (std::find(films.begin(), films.end(), extension) != films.end()) return Kind::film;
  return Kind::unknown;
}

Kind kind_of(const fs::path& path) {
  const Kind contents = kind_of_contents(path);
  return contents != Kind::unknown ? contents : kind_of_name(path);
}

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
      if (a[i] != b[j]) return a[i] < b[j];
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

void quiet_opencv() {
  static std::once_flag once;
  std::call_once(once, [] { cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT); });
}

// How pictures become grey levels: held for a whole stream once the first frame has been seen.
struct GreyRule {
  Channel channel = Channel::automatic;  // automatic: not decided
  double depth_scale = 0;                // factor to 0..255 for 16-bit and float files; 0 not decided
  std::optional<cv::Vec3f> background;   // blue, green, red: the most frequent colour
};

// The channel whose levels spread most: difference between the 95th and the 5th percentile over the step-to-step noise.
Channel best_channel(const cv::Mat& picture) {
  double best = -1;
  int winner = 1;
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<float> levels;
    double steps = 0;
    std::size_t step_count = 0;
    const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(picture.total()) / 40000.0)));
    for (int row = 0; row < picture.rows; row += stride) {
      float previous = 0;
      for (int column = 0; column < picture.cols; column += stride) {
        float level = 0;
        const int bgr = 2 - channel;
        switch (picture.depth()) {
          case CV_8U:
            level = picture.ptr<std::uint8_t>(row)[column * 3 + bgr];
            break;
          case CV_16U:
            level = picture.ptr<std::uint16_t>(row)[column * 3 + bgr];
            break;
          default:
            level = picture.ptr<float>(row)[column * 3 + bgr];
            break;
        }
        if (!std::isfinite(level)) level = 0;
        if (column > 0) {
          steps += std::abs(level - previous);
          ++step_count;
        }
        previous = level;
        levels.push_back(level);
      }
    }
    if (levels.empty()) continue;
    const std::size_t low = levels.size() / 20, high = levels.size() - 1 - low;
    std::nth_element(levels.begin(), levels.begin() + static_cast<std::ptrdiff_t>(low), levels.end());
    const double dark = levels[low];
    std::nth_element(levels.begin(), levels.begin() + static_cast<std::ptrdiff_t>(high), levels.end());
    const double spread = levels[high] - dark;
    const double roughness = step_count ? steps / static_cast<double>(step_count) : 0;
    const double score = spread / std::sqrt(1.0 + roughness);
    if (score > best * 1.02 + 1e-9) {  // grey pictures saved in colour: all equal, red is taken
      best = score;
      winner = channel;
    }
  }
  return static_cast<Channel>(winner);
}

// The mean of the pixels in the fullest of 16 x 16 x 16 cells of colour.
cv::Vec3f most_frequent_colour(const cv::Mat& picture) {
  constexpr int cells = 16;
  double least = 0, most = 1;
  cv::minMaxLoc(picture.reshape(1), &least, &most);
  const float per_cell = static_cast<float>(std::max(1.0, most - least) * 1.0001 / cells);
  std::vector<std::size_t> counts(cells * cells * cells, 0);
  std::vector<cv::Vec3d> sums(counts.size(), cv::Vec3d(0, 0, 0));
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(picture.total()) / 40000.0)));
  for (int row = 0; row < picture.rows; row += stride)
    for (int column = 0; column < picture.cols; column += stride) {
      const cv::Vec3f colour = picture.at<cv::Vec3f>(row, column);
      std::size_t cell = 0;
      for (int k = 0; k < 3; ++k)
        cell = cell * cells + static_cast<std::size_t>(
                                  std::clamp((colour[k] - static_cast<float>(least)) / per_cell, 0.0F, cells - 1.0F));
      ++counts[cell];
      sums[cell] += cv::Vec3d(colour);
    }
  const auto fullest = static_cast<std::size_t>(std::max_element(counts.begin(), counts.end()) - counts.begin());
  const cv::Vec3d mean = sums[fullest] / static_cast<double>(std::max<std::size_t>(1, counts[fullest]));
  return cv::Vec3f(static_cast<float>(mean[0]), static_cast<float>(mean[1]), static_cast<float>(mean[2]));
}

// One level a pixel from three (blue, green, red), float.
cv::Mat mixed(const cv::Mat& picture, GreyRule& rule) {
  cv::Mat colours;
  picture.convertTo(colours, CV_32F);
  if (rule.channel == Channel::background_distance && !rule.background) rule.background = most_frequent_colour(colours);
  cv::Mat level(colours.rows, colours.cols, CV_32F);
  for (int row = 0; row < colours.rows; ++row) {
    const cv::Vec3f* from = colours.ptr<cv::Vec3f>(row);
    float* to = level.ptr<float>(row);
    for (int column = 0; column < colours.cols; ++column) {
      const cv::Vec3f& c = from[column];
      if (rule.channel == Channel::grey) {
        to[column] = 0.114F * c[0] + 0.587F * c[1] + 0.299F * c[2];  // ITU-R BT.601
      } else if (rule.channel == Channel::saturation) {
        to[column] = std::max({c[0], c[1], c[2]}) - std::min({c[0], c[1], c[2]});
      } else {
        const cv::Vec3f away = c - *rule.background;
        to[column] = std::sqrt((away[0] * away[0] + away[1] * away[1] + away[2] * away[2]) / 3);
      }
    }
  }
  return level;
}

// Averages over factor x factor pixels.
cv::Mat averaged(const cv::Mat& picture, int factor) {
  if (factor == 1) return picture;
  cv::Mat small;
  const cv::Rect whole(0, 0, picture.cols / factor * factor, picture.rows / factor * factor);
  cv::resize(picture(whole), small, cv::Size(picture.cols / factor, picture.rows / factor), 0, 0, cv::INTER_AREA);
  return small;
}

GrayFrame to_gray(cv::Mat picture, const std::string& path, const FrameSourceOptions& options, GreyRule& rule) {
  if (picture.empty()) throw InputError(path, "no picture", "it decodes to nothing", "save it again");
  if (picture.total() > options.largest_frame_pixels)
    throw InputError(
        path, "frame of " + std::to_string(picture.cols) + " x " + std::to_string(picture.rows) + " px is too large",
        "more than " + std::to_string(options.largest_frame_pixels) + " pixels are refused to bound memory",
        "crop it or reduce it");
  picture = averaged(picture, options.reduction);
  if (picture.depth() != CV_8U && picture.depth() != CV_16U && picture.depth() != CV_32F) {
    cv::Mat converted;
    picture.convertTo(converted, CV_32F);
    picture = converted;
  }
  if (picture.channels() == 2) {
    cv::Mat single;
    cv::extractChannel(picture, single, 0);
    picture = single;
  } else if (picture.channels() == 4) {
    cv::Mat three(picture.rows, picture.cols, CV_MAKETYPE(picture.depth(), 3));
    cv::mixChannels(std::vector<cv::Mat>{picture}, std::vector<cv::Mat>{three}, {0, 0, 1, 1, 2, 2});
    picture = three;
  }
  if (picture.channels() == 3) {
    if (rule.channel == Channel::automatic)
      rule.channel = options.channel != Channel::automatic ? options.channel : best_channel(picture);
    cv::Mat single;
    if (rule.channel <= Channel::blue) {
      cv::extractChannel(picture, single, 2 - static_cast<int>(rule.channel));
    } else {
      if (picture.depth() == CV_8U) rule.depth_scale = 1;
      single = mixed(picture, rule);
    }
    picture = single;
  }

  GrayFrame frame;
  frame.width = picture.cols;
  frame.height = picture.rows;
  frame.pixels.resize(picture.total());
  const std::size_t width = static_cast<std::size_t>(picture.cols);
  if (picture.depth() == CV_8U) {
    for (int row = 0; row < picture.rows; ++row) {
      const std::uint8_t* from = picture.ptr<std::uint8_t>(row);
      float* to = frame.pixels.data() + static_cast<std::size_t>(row) * width;
      for (std::size_t column = 0; column < width; ++column) to[column] = static_cast<float>(from[column]);
    }
    return frame;
  }
  if (picture.depth() == CV_16U) {
    if (rule.depth_scale == 0) {
      std::uint16_t highest = 0;
      for (int row = 0; row < picture.rows; ++row) {
        const std::uint16_t* from = picture.ptr<std::uint16_t>(row);
        for (std::size_t column = 0; column < width; ++column) highest = std::max(highest, from[column]);
      }
      double full = 65535;
      for (const double bits : {255.0, 1023.0, 4095.0, 16383.0})
        if (highest <= bits) {
          full = bits;
          break;
        }
      rule.depth_scale = 255.0 / full;
    }
    const float scale = static_cast<float>(rule.depth_scale);
    for (int row = 0; row < picture.rows; ++row) {
      const std::uint16_t* from = picture.ptr<std::uint16_t>(row);
      float* to = frame.pixels.data() + static_cast<std::size_t>(row) * width;
      for (std::size_t column = 0; column < width; ++column) to[column] = scale * static_cast<float>(from[column]);
    }
    return frame;
  }
  float lowest = std::numeric_limits<float>::max(), highest = std::numeric_limits<float>::lowest();
  double sum = 0;
  std::size_t finite = 0;
  for (int row = 0; row < picture.rows; ++row) {
    const float* from = picture.ptr<float>(row);
    float* to = frame.pixels.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t column = 0; column < width; ++column) {
      to[column] = from[column];
      if (!std::isfinite(from[column])) continue;
      lowest = std::min(lowest, from[column]);
      highest = std::max(highest, from[column]);
      sum += from[column];
      ++finite;
    }
  }
  if (finite == 0)
    throw InputError(path, "no finite level in the picture", "every pixel is NaN or infinite", "export it again");
  if (rule.depth_scale == 0) {
    const double reach = std::max(std::abs(static_cast<double>(lowest)), std::abs(static_cast<double>(highest)));
    if (reach <= 1.0 && reach > 0)
      rule.depth_scale = 255.0;
    else if (reach <= 255.0)
      rule.depth_scale = 1.0;
    else
      rule.depth_scale = 255.0 / reach;
  }
  const float scale = static_cast<float>(rule.depth_scale);
  const float filler = static_cast<float>(sum / static_cast<double>(finite));
  for (float& level : frame.pixels) level = scale * (std::isfinite(level) ? level : filler);
  return frame;
}

[[noreturn]] void throw_unreadable(const std::string& path, const std::string& why) {
  throw InputError(path, "the picture cannot be read", why, "check that the file is complete, or export it again");
}

// Size from the header of a PNG or BMP, so that an enormous picture is refused before it is decoded.
void refuse_if_enormous(const std::string& path, std::ifstream& file, const FrameSourceOptions& options) {
  std::array<unsigned char, 32> head{};
  file.seekg(0);
  file.read(reinterpret_cast<char*>(head.data()), static_cast<std::streamsize>(head.size()));
  if (file.gcount() < 26) {
    file.clear();
    return;
  }
  std::uint64_t width = 0, height = 0;
  if (head[0] == 0x89 && head[1] == 'P' && head[2] == 'N' && head[3] == 'G') {
    for (std::size_t i = 0; i < 4; ++i) {
      width = width << 8U | head[16 + i];
      height = height << 8U | head[20 + i];
    }
  } else if (head[0] == 'B' && head[1] == 'M') {
    for (std::size_t i = 4; i-- > 0;) {
      width = width << 8U | head[18 + i];
      height = height << 8U | head[22 + i];
    }
    if (height > 0x7fffffffU) height = 0x100000000U - height;
  }
  if (width * height > options.largest_frame_pixels)
    throw InputError(
        path, "frame of " + std::to_string(width) + " x " + std::to_string(height) + " px is too large",
        "more than " + std::to_string(options.largest_frame_pixels) + " pixels are refused to bound memory",
        "crop it or reduce it");
}

cv::Mat decode_image(const std::string& path, Kind kind, std::size_t page, const FrameSourceOptions& options) {
  quiet_opencv();
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error) throw InputError(path, "no such file", error.message(), "check the path");
  if (bytes == 0) throw InputError(path, "the file is empty", "it holds 0 bytes", "copy it again from the camera");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path, "the file cannot be opened", "no permission to read it", "check its permissions");
  refuse_if_enormous(path, file, options);
  char head[2] = {};
  file.clear();
  file.seekg(0);
  file.read(head, 2);
  if (head[0] == '\xff' && head[1] == '\xd8') {
    // libjpeg paints the missing part of a truncated picture grey: look for the end-of-image marker in the last bytes.
    const auto tail_size = static_cast<std::streamoff>(std::min<std::uintmax_t>(bytes, 4096));
    std::string tail(static_cast<std::size_t>(tail_size), '\0');
    file.clear();
    file.seekg(-tail_size, std::ios::end);
    file.read(tail.data(), tail_size);
    if (tail.find("\xff\xd9") == std::string::npos)
      throw_unreadable(path, "its end-of-image mark is missing: truncated");
  }
  cv::Mat picture;
  constexpr int flags = cv::IMREAD_ANYDEPTH | cv::IMREAD_ANYCOLOR;
  try {
    if (kind == Kind::tiff) {
      std::vector<cv::Mat> pages;
      cv::imreadmulti(path, pages, static_cast<int>(page), 1, flags);
      if (!pages.empty()) picture = pages.front();
    } else {
      picture = cv::imread(path, flags);
    }
  } catch (const cv::Exception& exception) {
    throw_unreadable(path, "its contents are damaged: " + exception.err);
  } catch (const std::bad_alloc&) {
    throw InputError(path, "not enough memory for the picture", "it is too large", "crop or reduce it");
  }
  if (picture.empty()) throw_unreadable(path, "it is truncated, damaged or not a picture of the kind its name says");
  return picture;
}

GrayFrame read_image(const std::string& path, Kind kind, std::size_t page, const FrameSourceOptions& options,
                     GreyRule& rule) {
  return to_gray(decode_image(path, kind, page, options),
                 page == 0 ? path : path + " (page " + std::to_string(page) + ")", options, rule);
}

// A film decoded forward; seeking backwards starts again from the first frame, so that frame k is always the k-th.
class Film {
 public:
  Film(std::string path, const FrameSourceOptions& options) : path_(std::move(path)), options_(options) { reopen(); }

  // As the film tells it.
  double rate_hz() const { return capture_.get(cv::CAP_PROP_FPS); }

  // Goes past the picture at `index` without decoding it into memory; false when the film ends before.
  bool step_over(std::size_t index) {
    for (; next_ <= index; ++next_)
      if (!capture_.grab()) return false;
    return true;
  }

  // The picture at `index`, or nothing past the end.
  std::optional<cv::Mat> picture(std::size_t index) {
    if (index < next_) reopen();
    if (index > 0 && !step_over(index - 1)) return std::nullopt;
    cv::Mat picture;
    if (!capture_.read(picture) || picture.empty()) {
      if (next_ == 0)
        throw InputError(path_, "the film holds no frame", "none could be decoded", "export it as mp4 or avi");
      return std::nullopt;
    }
    ++next_;
    return picture.clone();
  }

 private:
  void reopen() {
    quiet_opencv();
    std::error_code error;
    if (!fs::exists(path_, error)) throw InputError(path_, "no such file", "it does not exist", "check the path");
    if (fs::file_size(path_, error) == 0)
      throw InputError(path_, "the file is empty", "it holds 0 bytes", "copy it again from the camera");
    try {
      capture_.open(path_, cv::CAP_FFMPEG);
    } catch (const cv::Exception&) {}
    if (!capture_.isOpened())
      throw InputError(path_, "the film cannot be opened", "damaged, or in a format that cannot be decoded",
                       "convert it to mp4 (H.264) or avi (MJPG)");
    next_ = 0;
  }
  std::string path_;
  FrameSourceOptions options_;
  cv::VideoCapture capture_;
  std::size_t next_ = 0;
};

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

  // The next item without regard to the stride. `skip`: step over it without decoding.
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
        if (!film) {
          try {
            film = std::make_unique<Film>(current.path, options);
          } catch (const InputError& error) {
            advance_entry();
            ++index;
            item.decode = [error]() -> GrayFrame { throw error; };
            return item;
          }
        }
        if (skip) {
          if (!film->step_over(current_page)) {
            advance_entry();
            continue;
          }
          ++page;
          ++index;
          return item;
        }
        std::optional<cv::Mat> picture;
        try {
          picture = film->picture(current_page);
        } catch (const InputError& error) {
          advance_entry();
          ++index;
          item.decode = [error]() -> GrayFrame { throw error; };
          return item;
        }
        if (!picture) {
          advance_entry();
          continue;
        }
        auto frame = std::make_shared<GrayFrame>(to_gray(*picture, current.path, options, *rule));
        rule_decided = true;
        item.decode = [frame] { return std::move(*frame); };
        ++page;
        ++index;
        return item;
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
      if (!rule_decided) {  // the first readable frame settles channel and depth for all, whoever decodes later
        try {
          auto frame =
              std::make_shared<GrayFrame>(read_image(current.path, current.kind, current_page, options, *rule));
          rule_decided = true;
          item.decode = [frame] { return std::move(*frame); };
        } catch (const InputError& error) {
          item.decode = [error]() -> GrayFrame { throw error; };
        }
        return item;
      }
      item.decode = [current, current_page, this_options = options, settled = *rule]() mutable {
        return read_image(current.path, current.kind, current_page, this_options, settled);
      };
      return item;
    }
    return std::nullopt;
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
    throw InputError("(no path)", "no frames given", "the list of paths is empty", "name files or a folder");
  for (const std::string& given : paths) {
    std::vector<fs::path> found;
    std::error_code error;
    if (fs::is_directory(given, error)) {
      for (const auto& entry : fs::directory_iterator(given, error))
        if (entry.is_regular_file(error) && kind_of(entry.path()) != Kind::unknown) found.push_back(entry.path());
      std::sort(found.begin(), found.end(),
                [](const fs::path& a, const fs::path& b) { return natural_less(a.string(), b.string()); });
      if (found.empty())
        throw InputError(given, "no picture or film in this folder", "no file with a known ending",
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
  const std::size_t stride = state_->options.stride;
  while (state_->index % stride != 0)
    if (!state_->step(true)) return std::nullopt;
  auto item = state_->step(false);
  if (item) item->index /= stride;
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

std::optional<double> FrameSource::film_rate_hz() const {
  if (state_->entries.size() != 1 || state_->entries.front().kind != Kind::film) return std::nullopt;
  try {
    const double rate = Film(state_->entries.front().path, state_->options).rate_hz();
    if (std::isfinite(rate) && rate > 0) return rate / static_cast<double>(state_->options.stride);
  } catch (const InputError&) {
    // Who reads the film is told.
  }
  return std::nullopt;
}

std::optional<std::size_t> FrameSource::count_if_known() const {
  const std::size_t stride = state_->options.stride;
  if (state_->make) return (state_->made_count + stride - 1) / stride;
  std::size_t count = 0;
  for (std::size_t which = 0; which < state_->entries.size(); ++which) {
    if (state_->entries[which].kind == Kind::film) return std::nullopt;
    count += state_->entries[which].kind == Kind::tiff ? state_->page_count(which) : 1;
  }
  return (count + stride - 1) / stride;
}

namespace {

cv::Mat decode_picture(const fs::path& path, std::size_t page, const FrameSourceOptions& options) {
  std::error_code error;
  if (!fs::exists(path, error)) throw InputError(path.string(), "no such file", "it does not exist", "check the path");
  const Kind kind = kind_of(path);
  if (kind == Kind::unknown)
    throw InputError(path.string(), "neither a picture nor a film", "its ending is not known",
                     "use PNG, TIFF, JPEG or BMP");
  if (kind != Kind::film) return decode_image(path.string(), kind, page, options);
  Film film(path.string(), options);
  auto picture = film.picture(page);
  if (!picture)
    throw InputError(path.string(), "no frame " + std::to_string(page), "the film ends before it",
                     "ask for an earlier one");
  return *picture;
}

bool has_colour(const cv::Mat& picture) {
  if (picture.channels() < 3) return false;
  constexpr double faint = 0.01;  // of the brightest level: what compression leaves of grey
  cv::Mat colours;
  picture.convertTo(colours, CV_32F);
  GreyRule rule;
  rule.channel = Channel::saturation;
  if (colours.channels() == 4) {
    cv::Mat three(colours.rows, colours.cols, CV_32FC3);
    cv::mixChannels(std::vector<cv::Mat>{colours}, std::vector<cv::Mat>{three}, {0, 0, 1, 1, 2, 2});
    colours = three;
  }
  double most = 0;
  cv::minMaxLoc(colours.reshape(1), nullptr, &most);
  return cv::mean(mixed(colours, rule))[0] > faint * most;
}

}  // namespace

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
  }
  return "automatic";
}

GrayFrame read_frame(const fs::path& path, std::size_t page, const FrameSourceOptions& options) {
  GreyRule rule;
  return to_gray(decode_picture(path, page, options), path.string(), options, rule);
}

ChannelFrames read_channels(const fs::path& path, std::size_t page, std::size_t most_pixels,
                            const FrameSourceOptions& options) {
  ChannelFrames frames;
  cv::Mat picture = decode_picture(path, page, options);
  frames.width = picture.cols;
  frames.height = picture.rows;
  while (picture.total() / static_cast<std::size_t>(frames.reduction * frames.reduction) > most_pixels)
    ++frames.reduction;
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
