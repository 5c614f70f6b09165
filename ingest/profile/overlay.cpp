#include "ingest/profile/overlay.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "ingest/frames/atomic_file.hpp"

namespace shakebed::ingest {

namespace {

// As asked for, or less; a large frame is reduced by a whole number.
double magnification_for(const GrayFrame& frame, int wanted) {
  const double pixels = static_cast<double>(frame.width) * frame.height;
  if (pixels > most_overlay_pixels) return 1 / std::ceil(std::sqrt(pixels / most_overlay_pixels));
  int magnification = std::clamp(wanted, 1, 8);
  while (magnification > 1 && pixels * magnification * magnification > most_overlay_pixels) --magnification;
  return magnification;
}

}  // namespace

void write_overlay(const std::filesystem::path& path, const GrayFrame& frame, const std::vector<FoundDisk>& disks,
                   const OverlayOptions& options) {
  if (frame.width <= 0 || frame.height <= 0 ||
      frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
    throw InputError(path.string(), "no frame to draw on", "it is empty or its size is wrong", "check the frame");
  const double magnification = magnification_for(frame, options.magnification);
  cv::Mat gray(frame.height, frame.width, CV_8U);
  for (int row = 0; row < frame.height; ++row)
    for (int column = 0; column < frame.width; ++column)
      gray.at<std::uint8_t>(row, column) =
          static_cast<std::uint8_t>(std::min(255.0F, std::max(0.0F, frame.at(column, row))) + 0.5F);
  cv::Mat large, picture;
  cv::resize(gray, large, cv::Size(), magnification, magnification,
             magnification < 1 ? cv::INTER_AREA : cv::INTER_NEAREST);
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

GrayFrame bead_picture(const FinderCalibration& calibration, int magnification) {
  const BeadProfile& profile = calibration.profile;
  const double reach = profile.reach_px();
  const int wanted = std::max(1, magnification);
  const double scale = std::min<double>(wanted, std::max(1.0, 400 / std::max(1.0, reach)));
  GrayFrame picture;
  picture.width = picture.height = 2 * static_cast<int>(std::ceil(reach * scale)) + 1;
  const double middle = 0.5 * (picture.width - 1);
  const std::size_t node =
      static_cast<std::size_t>(calibration.light.rows / 2) * static_cast<std::size_t>(calibration.light.columns) +
      static_cast<std::size_t>(calibration.light.columns / 2);
  const float background = node < calibration.light.background.size() ? calibration.light.background[node] : 0.0F;
  for (int row = 0; row < picture.height; ++row)
    for (int column = 0; column < picture.width; ++column) {
      const double x = (column - middle) / scale, y = (row - middle) / scale, r = std::hypot(x, y);
      const auto cell = static_cast<std::size_t>(r / profile.step_px);
      float level = 0;
      if (cell < profile.level.size()) {
        const double cosine = r > 0 ? std::cos(4 * std::atan2(y, x)) : 0;
        level = profile.level[cell] + profile.fourth_harmonic[cell] * static_cast<float>(cosine);
        if (profile.asymmetry) level += static_cast<float>(profile.asymmetry->at(x, y));
      }
      picture.pixels.push_back(background + static_cast<float>(calibration.contrast_level) * level);
    }
  return picture;
}

}  // namespace shakebed::ingest
