#pragma once
// From decoded pictures to grey levels. For ingest/frames alone.

#include <opencv2/core.hpp>
#include <optional>
#include <string>

#include "ingest/frames/background_level.hpp"
#include "ingest/frames/frames.hpp"

namespace shakebed::ingest {

// How pictures become grey levels: held for a whole stream once the first frame has been seen.
struct GreyRule {
  Channel channel = Channel::automatic;  // automatic: not decided
  double depth_scale = 0;                // factor to 0..255 for 16-bit and float files; 0 not decided
  std::optional<cv::Vec3f> background;   // blue, green, red: the most frequent colour
  std::optional<BackgroundLevel> level;  // of grey_distance
};

// Averages over factor x factor pixels.
cv::Mat averaged(const cv::Mat& picture, int factor);

// Whether more than compression makes its three components differ.
bool has_colour(const cv::Mat& picture);

// `path` is for messages. Throws InputError.
GrayFrame to_gray(const cv::Mat& picture, const std::string& path, const FrameSourceOptions& options, GreyRule& rule);

}  // namespace shakebed::ingest
