// A trajectory: as it is, and as a compressed one. Frames read are whole, and are written and read back the same.
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/trajectory.hpp"
#include "tests/robustness/fuzz/fuzz.hpp"

using namespace shakebed::pipelines;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const bool compressed = bytes.starts_with("\x28\xB5\x2F\xFD");
  const auto path = shakebed::fuzz::as_file(bytes, compressed ? ".extxyz.zst" : ".extxyz");
  try {
    TrajectoryReader reader(path);
    TrajectoryFrame frame;
    std::size_t frames = 0;
    while (frames < 1000 && reader.read(frame)) {
      ++frames;
      const std::size_t n = frame.size();
      if (frame.z.size() != n || frame.vx.size() != n || frame.vz.size() != n || frame.radius.size() != n ||
          (!frame.spin.empty() && frame.spin.size() != n))
        shakebed::fuzz::fail("columns of different lengths");
    }
  } catch (const InputError& error) {
    if (std::string_view(error.what()).empty()) shakebed::fuzz::fail("an error without words");
  }
  return 0;
}
