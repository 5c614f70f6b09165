#include "ingest/frames/grey_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "ingest/frames/smooth_field.hpp"

namespace shakebed::ingest {

namespace {

float component_at(const cv::Mat& picture, int row, int column, int component) {
  const int at = column * 3 + component;
  if (picture.depth() == CV_8U) return picture.ptr<std::uint8_t>(row)[at];
  if (picture.depth() == CV_16U) return picture.ptr<std::uint16_t>(row)[at];
  return picture.ptr<float>(row)[at];
}

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
        float level = component_at(picture, row, column, 2 - channel);
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

// Blue, green and red of a pixel.
template <class Level>
cv::Vec3f colour_in(const Level* row, int column) {
  const Level* at = row + static_cast<std::ptrdiff_t>(3) * column;
  return cv::Vec3f(static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2]));
}

// The mean of the pixels in the fullest of 16 x 16 x 16 cells of colour.
template <class Level>
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
      const cv::Vec3f colour = colour_in(picture.ptr<Level>(row), column);
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

// One level a pixel from three (blue, green, red), float, into `level`.
template <class Level>
void mix(const cv::Mat& picture, GreyRule& rule, cv::Mat& level) {
  if (rule.channel == Channel::background_distance && !rule.background)
    rule.background = most_frequent_colour<Level>(picture);
  const auto fill_by = [&](const auto& level_of) {
    for (int row = 0; row < picture.rows; ++row) {
      const Level* from = picture.ptr<Level>(row);
      float* to = level.ptr<float>(row);
      for (int column = 0; column < picture.cols; ++column, from += 3)
        to[column] = level_of(static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2]));
    }
  };
  if (rule.channel == Channel::grey) {
    fill_by([](float blue, float green, float red) {
      return 0.114F * blue + 0.587F * green + 0.299F * red;  // ITU-R BT.601
    });
  } else if (rule.channel == Channel::saturation) {
    fill_by([](float blue, float green, float red) {
      return std::max(std::max(blue, green), red) - std::min(std::min(blue, green), red);
    });
  } else {
    const cv::Vec3f behind = *rule.background;
    fill_by([b = behind[0], g = behind[1], r = behind[2]](float blue, float green, float red) {
      return std::sqrt(((blue - b) * (blue - b) + (green - g) * (green - g) + (red - r) * (red - r)) / 3);
    });
  }
}
cv::Mat mixed(const cv::Mat& picture, GreyRule& rule) {
  cv::Mat level(picture.rows, picture.cols, CV_32F);
  if (picture.depth() == CV_8U)
    mix<std::uint8_t>(picture, rule, level);
  else if (picture.depth() == CV_16U)
    mix<std::uint16_t>(picture, rule, level);
  else
    mix<float>(picture, rule, level);
  return level;
}

// 8 bit, 16 bit or float, with one component or three (blue, green, red).
cv::Mat of_usual_kind(const cv::Mat& given) {
  cv::Mat picture = given;
  if (picture.depth() != CV_8U && picture.depth() != CV_16U && picture.depth() != CV_32F)
    given.convertTo(picture, CV_32F);
  if (picture.channels() == 2) {
    cv::Mat single;
    cv::extractChannel(picture, single, 0);
    return single;
  }
  if (picture.channels() == 4) {
    cv::Mat three(picture.rows, picture.cols, CV_MAKETYPE(picture.depth(), 3));
    cv::mixChannels(std::vector<cv::Mat>{picture}, std::vector<cv::Mat>{three}, {0, 0, 1, 1, 2, 2});
    return three;
  }
  return picture;
}

// Of three components; a mixture of theirs is float.
cv::Mat one_component(const cv::Mat& picture, GreyRule& rule) {
  if (rule.channel > Channel::blue) return mixed(picture, rule);
  cv::Mat single;
  cv::extractChannel(picture, single, 2 - static_cast<int>(rule.channel));
  return single;
}

template <class Level>
void copy_levels(const cv::Mat& picture, float scale, GrayFrame& frame) {
  const std::size_t width = static_cast<std::size_t>(picture.cols);
  for (int row = 0; row < picture.rows; ++row) {
    const Level* from = picture.ptr<Level>(row);
    float* to = frame.pixels.data() + static_cast<std::size_t>(row) * width;
    for (std::size_t column = 0; column < width; ++column) to[column] = scale * static_cast<float>(from[column]);
  }
}

// Files of 16 bits that use 10, 12 or 14 of them.
double scale_of_words(const cv::Mat& picture) {
  std::uint16_t highest = 0;
  for (int row = 0; row < picture.rows; ++row) {
    const std::uint16_t* from = picture.ptr<std::uint16_t>(row);
    for (int column = 0; column < picture.cols; ++column) highest = std::max(highest, from[column]);
  }
  for (const double bits : {255.0, 1023.0, 4095.0, 16383.0})
    if (highest <= bits) return 255.0 / bits;
  return 255.0 / 65535;
}

// Levels of 0 to 1, of 0 to 255, or of any other range; what is not finite becomes the mean.
void copy_floats(const cv::Mat& picture, const std::string& path, GreyRule& rule, GrayFrame& frame) {
  copy_levels<float>(picture, 1, frame);
  float lowest = std::numeric_limits<float>::max(), highest = std::numeric_limits<float>::lowest();
  double sum = 0;
  std::size_t finite = 0;
  for (const float level : frame.pixels) {
    if (!std::isfinite(level)) continue;
    lowest = std::min(lowest, level);
    highest = std::max(highest, level);
    sum += level;
    ++finite;
  }
  if (finite == 0)
    throw InputError(path, "no finite grey level in the picture", "every pixel is NaN or infinite", "export it again");
  if (rule.depth_scale == 0) {
    const double reach = std::max(std::abs(static_cast<double>(lowest)), std::abs(static_cast<double>(highest)));
    rule.depth_scale = reach <= 1.0 && reach > 0 ? 255.0 : reach <= 255.0 ? 1.0 : 255.0 / reach;
  }
  const float scale = static_cast<float>(rule.depth_scale);
  const float filler = static_cast<float>(sum / static_cast<double>(finite));
  for (float& level : frame.pixels) level = scale * (std::isfinite(level) ? level : filler);
}

}  // namespace

cv::Mat averaged(const cv::Mat& picture, int factor) {
  if (factor == 1) return picture;
  cv::Mat small;
  const cv::Rect whole(0, 0, picture.cols / factor * factor, picture.rows / factor * factor);
  cv::resize(picture(whole), small, cv::Size(picture.cols / factor, picture.rows / factor), 0, 0, cv::INTER_AREA);
  return small;
}

bool has_colour(const cv::Mat& picture) {
  if (picture.channels() < 3) return false;
  constexpr double faint = 0.01;  // of the brightest level: what compression leaves of grey
  const cv::Mat colours = of_usual_kind(picture);
  GreyRule rule;
  rule.channel = Channel::saturation;
  double most = 0;
  cv::minMaxLoc(colours.reshape(1), nullptr, &most);
  return cv::mean(mixed(colours, rule))[0] > faint * most;
}

namespace {

// By which the colours of a picture are averaged, of a reduction in all: as a survey has done, so that its search
// serves a run, too.
int reduction_of_colours(const cv::Mat& picture, int reduction) {
  const int surveyed = reduction_to(surveyed_pixels, picture.total());
  return reduction % surveyed == 0 ? surveyed : reduction;
}

GrayFrame mixed_levels_of(cv::Mat picture, const std::string& path, const FrameSourceOptions& options, GreyRule& rule) {
  GrayFrame frame;
  frame.width = picture.cols;
  frame.height = picture.rows;
  frame.pixels.resize(picture.total());
  if (picture.channels() == 3) {
    if (rule.channel == Channel::automatic)
      rule.channel = options.channel != Channel::automatic ? options.channel : best_channel(picture);
    if (picture.depth() == CV_8U && rule.channel > Channel::blue) {  // all levels are finite, and from 0 to 255
      rule.depth_scale = 1;
      cv::Mat level(frame.height, frame.width, CV_32F, frame.pixels.data());
      mix<std::uint8_t>(picture, rule, level);
      return frame;
    }
    picture = one_component(picture, rule);
  }
  if (picture.depth() == CV_8U) {
    copy_levels<std::uint8_t>(picture, 1, frame);
  } else if (picture.depth() == CV_16U) {
    if (rule.depth_scale == 0) rule.depth_scale = scale_of_words(picture);
    copy_levels<std::uint16_t>(picture, static_cast<float>(rule.depth_scale), frame);
  } else {
    copy_floats(picture, path, rule, frame);
  }
  return frame;
}

GrayFrame levels_of(cv::Mat picture, const std::string& path, const FrameSourceOptions& options, GreyRule& rule) {
  if (options.channel != Channel::grey_distance) return mixed_levels_of(std::move(picture), path, options, rule);
  FrameSourceOptions of_grey = options;
  of_grey.channel = Channel::grey;
  const GrayFrame grey = mixed_levels_of(std::move(picture), path, of_grey, rule);
  if (!rule.level) rule.level.emplace(grey);
  return rule.level->distance_of(grey);
}

}  // namespace

GrayFrame to_gray(const cv::Mat& given, const std::string& path, const FrameSourceOptions& options, GreyRule& rule) {
  if (given.empty()) throw InputError(path, "no picture", "decoding gives no pixels", "save it again");
  const auto reduction = static_cast<std::size_t>(options.reduction);
  if (given.total() / (reduction * reduction) > options.largest_frame_pixels)
    throw InputError(
        path, "frame of " + std::to_string(given.cols) + " x " + std::to_string(given.rows) + " px is too large",
        "more than " + std::to_string(options.largest_frame_pixels) + " pixels are refused to limit the memory used",
        "crop it or reduce it");
  const int of_colours = reduction_of_colours(given, options.reduction);
  GrayFrame frame = levels_of(of_usual_kind(averaged(given, of_colours)), path, options, rule);
  const int of_levels = options.reduction / of_colours;
  return of_levels > 1 ? reduced(frame, of_levels) : std::move(frame);
}

}  // namespace shakebed::ingest
