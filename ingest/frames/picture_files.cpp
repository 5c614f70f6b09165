#include "ingest/frames/picture_files.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <mutex>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgcodecs.hpp>

namespace shakebed::ingest {

namespace fs = std::filesystem;

namespace {

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

[[noreturn]] void throw_unreadable(const std::string& path, const std::string& why) {
  throw InputError(path, "the picture cannot be read", why, "check that the file is complete, or export it again");
}

// zlib packs at most 1032 bytes into one, and a pixel of a PNG or BMP may be a bit: more are not in the file.
constexpr std::uint64_t most_pixels_per_byte = 8256;

// Size from the header of a PNG or BMP, so that an enormous picture is refused before it is decoded, and so is one
// that only claims to be large.
void refuse_if_enormous(const std::string& path, std::ifstream& file, std::uintmax_t bytes,
                        const FrameSourceOptions& options) {
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
  if (width * height > options.largest_decoded_pixels)
    throw InputError(
        path, "frame of " + std::to_string(width) + " x " + std::to_string(height) + " px is too large",
        "more than " + std::to_string(options.largest_decoded_pixels) + " pixels are refused to limit the memory used",
        "crop it or reduce it");
  if (width * height > options.largest_frame_pixels && width * height / most_pixels_per_byte > bytes)
    throw_unreadable(path, "it states " + std::to_string(width) + " x " + std::to_string(height) +
                               " px, too many for a file of " + std::to_string(bytes) +
                               " bytes: it is damaged or truncated");
}

bool is_jpeg(std::ifstream& file) {
  std::array<char, 2> head{};
  file.clear();
  file.seekg(0);
  return file.read(head.data(), head.size()) && head[0] == '\xff' && head[1] == '\xd8';
}

// Whether the segments and scans of a JPEG file lead to an end-of-image marker. Behind it there may be more: cameras of
// telephones append notes, pictures and films. (ITU-T T.81, annex B)
bool has_end_of_image(std::ifstream& file) {
  constexpr int end_of_image = 0xd9, first_restart = 0xd0, last_restart = 0xd7, stuffed = 0x00, none = EOF;
  file.clear();
  file.seekg(2);
  for (;;) {
    // The next marker: levels of a scan are skipped, and zeros and restarts between them.
    int marker = none;
    do {
      file.ignore(std::numeric_limits<std::streamsize>::max(), 0xff);
      while ((marker = file.get()) == 0xff) {}
    } while (marker == stuffed || (marker >= first_restart && marker <= last_restart));
    if (marker == none || marker == end_of_image) return marker == end_of_image;
    const int high = file.get(), low = file.get();
    if (low == none) return false;
    file.seekg((high << 8) + low - 2, std::ios::cur);
  }
}

}  // namespace

Kind kind_of(const fs::path& path) {
  const Kind contents = kind_of_contents(path);
  return contents != Kind::unknown ? contents : kind_of_name(path);
}

void quiet_opencv() {
  static std::once_flag once;
  std::call_once(once, [] { cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT); });
}

namespace {

// The large picture that was decoded last: the first look, both passes over the frames and the drawings each want it.
class LastPicture {
 public:
  struct Key {
    std::string path;
    std::size_t page = 0;
    std::uintmax_t bytes = 0;
    fs::file_time_type written;
    bool operator==(const Key&) const = default;
  };

  // Empty where it is another one.
  cv::Mat find(const Key& key) const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return key == key_ ? picture_.clone() : cv::Mat();
  }
  void keep(const Key& key, const cv::Mat& picture) {
    if (picture.total() < least_pixels) return;
    const std::lock_guard<std::mutex> lock(mutex_);
    key_ = key, picture_ = picture.clone();
  }

 private:
  static constexpr std::size_t least_pixels = 4'000'000;  // a PNG takes some 30 ms to decode, a copy of it 1 ms

  mutable std::mutex mutex_;
  Key key_;
  cv::Mat picture_;
};

}  // namespace

cv::Mat decode_image(const std::string& path, Kind kind, std::size_t page, const FrameSourceOptions& options) {
  quiet_opencv();
  std::error_code error;
  const auto bytes = fs::file_size(path, error);
  if (error) throw InputError(path, "no such file", error.message(), "check the path");
  if (bytes == 0) throw InputError(path, "the file is empty", "it has 0 bytes", "copy it again from the camera");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path, "the file cannot be opened", "no permission to read it", "check its permissions");
  refuse_if_enormous(path, file, bytes, options);
  static LastPicture last;
  const LastPicture::Key key{path, page, bytes, fs::last_write_time(path, error)};
  if (cv::Mat again = last.find(key); !again.empty()) return again;
  // libjpeg paints the missing part of a truncated picture grey.
  if (is_jpeg(file) && !has_end_of_image(file))
    throw_unreadable(path, "it is truncated: its end-of-image marker is missing");
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
  if (picture.empty())
    throw_unreadable(path, "it is truncated, damaged or not a picture of the type that its name states");
  last.keep(key, picture);
  return picture;
}

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
    throw InputError(path.string(), "no frame " + std::to_string(page), "the film ends before this frame",
                     "choose an earlier frame");
  return *picture;
}

}  // namespace shakebed::ingest
