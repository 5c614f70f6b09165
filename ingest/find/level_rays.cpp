#include "ingest/find/level_rays.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "ingest/calibrate/solid_borders.hpp"

namespace shakebed::ingest {

cv::Mat levels_along_rays(const GrayFrame& frame, double x_px, double y_px, const RayGrid& grid) {
  const cv::Mat all(frame.height, frame.width, CV_32F, const_cast<float*>(frame.pixels.data()));
  const int left = static_cast<int>(std::floor(x_px - grid.reach_px)) - 1,
            top = static_cast<int>(std::floor(y_px - grid.reach_px)) - 1,
            side = static_cast<int>(2 * grid.reach_px) + 4;
  if (left < 0 || top < 0 || left + side > frame.width || top + side > frame.height) return {};
  const cv::Mat around = all(cv::Rect(left, top, side, side));
  double most = 0;
  cv::minMaxLoc(around, nullptr, &most);
  if (unseen(static_cast<float>(most))) return {};
  cv::Mat levels;
  cv::warpPolar(around, levels, {grid.steps, grid.rays},
                {static_cast<float>(x_px - left), static_cast<float>(y_px - top)}, grid.reach_px, cv::INTER_LINEAR);
  return levels;
}

}  // namespace shakebed::ingest
