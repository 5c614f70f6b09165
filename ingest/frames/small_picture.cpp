#include "ingest/frames/small_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace shakebed::ingest {

std::string small_webp(const GrayFrame& frame, int width, int quality) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw InputError("small picture", "no picture to write", "the frame is empty or its size is wrong",
                     "check the frame");
  cv::Mat levels(frame.height, frame.width, CV_32F);
  std::copy(frame.pixels.begin(), frame.pixels.end(), levels.ptr<float>());
  if (frame.width > width) {
    const double scale = static_cast<double>(width) / frame.width;
    cv::Mat smaller;
    cv::resize(levels, smaller, cv::Size(width, std::max(1, static_cast<int>(std::lround(frame.height * scale)))), 0, 0,
               cv::INTER_AREA);
    levels = smaller;
  }
  cv::Mat picture;
  levels.convertTo(picture, CV_8U);  // rounds and clamps
  std::vector<std::uint8_t> bytes;
  cv::imencode(".webp", picture, bytes, {cv::IMWRITE_WEBP_QUALITY, std::clamp(quality, 1, 100)});
  return {bytes.begin(), bytes.end()};
}

}  // namespace shakebed::ingest
