#include "ingest/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "ingest/atomic_file.hpp"

namespace shakebed::ingest {

void write_overlay(const std::filesystem::path& path, const GrayFrame& frame, const std::vector<FoundDisk>& disks,
                   const OverlayOptions& options) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw InputError(path.string(), "no frame to draw on", "it is empty or its size is wrong", "check the frame");
  int magnification = std::clamp(options.magnification, 1, 8);
  while (magnification > 1 && static_cast<double>(frame.width) * frame.height * magnification * magnification > 3e7)
    --magnification;
  cv::Mat gray(frame.height, frame.width, CV_8U);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      gray.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::min(255.0F, std::max(0.0F, frame.at(column, row))) + 0.5F);
  cv::Mat large, picture;
  cv::resize(gray, large, cv::Size(), magnification, magnification, cv::INTER_NEAREST);
  cv::cvtColor(large, picture, cv::COLOR_GRAY2BGR);
  constexpr int shift = 6;  // sub-pixel drawing: 1/64 px
  const auto place = [&](double px) {
    return static_cast<int>(std::lround(((px + 0.5) * magnification - 0.5) * (1 << shift)));
  };
  for (const FoundDisk& disk : disks) {
    const cv::Scalar colour = disk.cut || disk.half_hidden ? cv::Scalar(0, 140, 255) : cv::Scalar(60, 220, 60);
    cv::circle(picture, {place(disk.x_px), place(disk.y_px)},
               static_cast<int>(std::lround(disk.radius_px * magnification * (1 << shift))), colour, 1, cv::LINE_AA,
               shift);
    cv::circle(picture, {place(disk.x_px), place(disk.y_px)}, 1 << shift, colour, cv::FILLED, cv::LINE_AA, shift);
  }
  const cv::Scalar blue(255, 140, 40);
  if (options.floor_px)
    cv::line(picture, {place(0), place(*options.floor_px)},
             {place(frame.width - 1), place(*options.floor_px + options.floor_slope * (frame.width - 1))}, blue, 1,
             cv::LINE_AA, shift);
  for (const auto& wall : {options.left_wall_px, options.right_wall_px})
    if (wall)
      cv::line(picture, {place(*wall), place(0)}, {place(*wall), place(frame.height - 1)}, blue, 1, cv::LINE_AA, shift);
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  write_file_atomically(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace shakebed::ingest
