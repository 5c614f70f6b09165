// A picture from anywhere: decoded or refused; some of what is decoded goes through the finder.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/core/utils/logger.hpp>

#include "ingest/find/find_disks.hpp"
#include "ingest/frames/frames.hpp"
#include "sim/engine/checkpoint_bytes.hpp"
#include "tests/robustness/fuzz/fuzz.hpp"

using namespace shakebed::ingest;

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first bytes name the format, as they do to a decoder.
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const char* extension = bytes.starts_with("\x89PNG")                                                ? ".png"
                          : bytes.starts_with("\xFF\xD8")                                             ? ".jpg"
                          : bytes.starts_with("BM")                                                   ? ".bmp"
                          : bytes.starts_with("II*") || bytes.starts_with("MM")                       ? ".tif"
                          : bytes.size() > 1 && bytes[0] == 'P' && bytes[1] >= '1' && bytes[1] <= '6' ? ".pgm"
                                                                                                      : ".png";
  FrameSourceOptions options;
  options.largest_frame_pixels = options.largest_decoded_pixels = 1'000'000;
  try {
    const GrayFrame frame = read_frame(shakebed::fuzz::as_file(bytes, extension), 0, options);
    if (frame.width < 1 || frame.height < 1 ||
        frame.pixels.size() != static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height))
      shakebed::fuzz::fail("a frame whose pixels do not fit its size");
    if (frame.pixels.size() > options.largest_frame_pixels) shakebed::fuzz::fail("a frame above the limit");
    // The finder costs a thousand times what decoding does: every 32nd input, or every FUZZ_FINDER_EVERY-th.
    static const std::size_t every = [] {
      const char* text = std::getenv("FUZZ_FINDER_EVERY");
      return text == nullptr ? std::size_t{32} : std::max<std::size_t>(1, std::strtoull(text, nullptr, 10));
    }();
    // Chosen by a hash of all bytes: what is made of a chosen picture is not chosen for that.
    const std::uint64_t hash = shakebed::sim::checkpoint_bytes::checksum(data, data + size);
    if (frame.pixels.size() > 20'000 || (hash >> 32U) % every != 0) return 0;
    for (const FoundDisk& disk : find_disks(frame).disks) {
      if (!std::isfinite(disk.x_px) || !std::isfinite(disk.y_px) || !(disk.radius_px > 0))
        shakebed::fuzz::fail("a disk that is nowhere");
    }
  } catch (const InputError& error) {
    if (std::string_view(error.what()).empty()) shakebed::fuzz::fail("an error without words");
  }
  return 0;
}
