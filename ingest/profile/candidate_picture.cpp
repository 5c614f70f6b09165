#include "ingest/profile/candidate_picture.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "ingest/frames/atomic_file.hpp"

namespace shakebed::ingest {

namespace {

// Twice the pixels drawn: enough for a second reduction without streaks.
constexpr std::size_t pixels_to_draw = 4'000'000;

// Red, green and blue, or grey three times, reduced for drawing.
cv::Mat colours_of(const ChannelFrames& frames, int most_px, double& scale) {
  std::vector<cv::Mat> planes;
  for (const Channel channel : {Channel::blue, Channel::green, Channel::red}) {
    const auto its = std::find_if(frames.channels.begin(), frames.channels.end(),
                                  [&](const ChannelFrames::One& one) { return one.channel == channel; });
    const GrayFrame& frame = (its != frames.channels.end() ? *its : frames.channels.front()).frame;
    const cv::Mat plane(frame.height, frame.width, CV_32F, const_cast<float*>(frame.pixels.data()));
    const double smaller = std::min(1.0, static_cast<double>(most_px) / std::max(frame.width, frame.height));
    scale = smaller / frames.reduction;
    cv::Mat small, rounded;
    cv::resize(plane, small, cv::Size(), smaller, smaller, cv::INTER_AREA);
    small.convertTo(rounded, CV_8U);
    planes.push_back(rounded);
  }
  cv::Mat picture;
  cv::merge(planes, picture);
  return picture;
}

}  // namespace

struct CandidatePictures::State {
  double scale = 1;
  cv::Mat picture;
};

CandidatePictures::CandidatePictures(const ChannelFrames& frames, int most_px) : state_(std::make_unique<State>()) {
  state_->picture = colours_of(frames, most_px, state_->scale);
}
CandidatePictures::CandidatePictures(const std::filesystem::path& source, std::size_t page, double pixel_aspect,
                                     int most_px)
    : CandidatePictures(read_channels(source, page, pixels_to_draw), most_px) {
  if (pixel_aspect != 1) cv::resize(state_->picture, state_->picture, {}, pixel_aspect, 1, cv::INTER_LINEAR);
}
CandidatePictures::~CandidatePictures() = default;

void CandidatePictures::write(const std::filesystem::path& path, const SurveyCandidate* candidate,
                              double bead_aspect) const {
  const double scale = state_->scale;
  const cv::Mat picture = state_->picture.clone();
  constexpr int shift = 4;  // sub-pixel drawing: 1/16 px
  const auto fixed = [&](double px) { return static_cast<int>(std::lround(px * (1 << shift))); };
  if (candidate != nullptr)
    for (const RimDisk& disk : candidate->disks) {
      constexpr double sure = 0.9;
      const cv::Scalar colour = disk.probability >= sure ? cv::Scalar(255, 0, 255) : cv::Scalar(0, 230, 255);
      const double radius = disk.circle.radius * scale;
      cv::ellipse(picture, {fixed((disk.circle.x + 0.5) * scale - 0.5), fixed((disk.circle.y + 0.5) * scale - 0.5)},
                  {fixed(bead_aspect * radius), fixed(radius)}, 0, 0, 360, colour, radius > 12 ? 2 : 1, cv::LINE_AA,
                  shift);
    }
  std::vector<std::uint8_t> bytes;
  cv::imencode(".png", picture, bytes);
  write_file_atomically(path, std::string(bytes.begin(), bytes.end()));
}

}  // namespace shakebed::ingest
