#pragma once
// Pictures and films as files: what kind they are, and their pixels as OpenCV decodes them. For ingest/frames alone.

#include <cstddef>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>

#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

enum class Kind { image, tiff, film, unknown };

// By the file's contents, and by its name where they say nothing.
Kind kind_of(const std::filesystem::path& path);

void quiet_opencv();

// The page-th picture of an image file. Throws InputError.
cv::Mat decode_image(const std::string& path, Kind kind, std::size_t page, const FrameSourceOptions& options);

// The page-th picture of an image file, or the page-th frame of a film. Throws InputError.
cv::Mat decode_picture(const std::filesystem::path& path, std::size_t page, const FrameSourceOptions& options);

// A film decoded forward; seeking backwards starts again from the first frame, so that frame k is always the k-th.
class Film {
 public:
  Film(std::string path, const FrameSourceOptions& options) : path_(std::move(path)), options_(options) { reopen(); }

  // Frames a second, as stated in the film.
  double rate_hz() const { return capture_.get(cv::CAP_PROP_FPS); }
  // Width over height of a pixel, as stated in the film; 0 where it is not.
  double pixel_aspect() const {
    const double height = capture_.get(cv::CAP_PROP_SAR_DEN);
    return height > 0 ? capture_.get(cv::CAP_PROP_SAR_NUM) / height : 0;
  }

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
        throw InputError(path_, "the film contains no frame", "none could be decoded", "export it as mp4 or avi");
      return std::nullopt;
    }
    ++next_;
    return picture.clone();
  }

 private:
  void reopen() {
    quiet_opencv();
    std::error_code error;
    if (!std::filesystem::exists(path_, error))
      throw InputError(path_, "no such file", "it does not exist", "check the path");
    if (std::filesystem::file_size(path_, error) == 0)
      throw InputError(path_, "the file is empty", "it has 0 bytes", "copy it again from the camera");
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

}  // namespace shakebed::ingest
