#pragma once
// Folders for tests: a scratch folder that vanishes, and the real images, which may be absent.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace shakebed::ingest::test {

// A fresh folder, removed with all it holds at the end of the test.
class ScratchFolder {
 public:
  ScratchFolder() {
    static int serial = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("shakebed_ingest_" + std::to_string(static_cast<long>(getpid())) + "_" + std::to_string(serial++));
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  [[nodiscard]] std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  [[nodiscard]] std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

// Makes an mp4 film of OpenCV state that its pixels are `width` : `height`. Its boxes (four bytes of length, four of
// name) are stored one in another; that of the pixels is put at the end of the one that describes the pictures.
inline void state_pixel_aspect(const std::string& film, unsigned width, unsigned height) {
  std::ostringstream whole;
  whole << std::ifstream(film, std::ios::binary).rdbuf();
  std::string bytes = whole.str();
  const auto put = [](unsigned number) {
    std::string four;
    for (const int shift : {24, 16, 8, 0}) four += static_cast<char>(number >> shift & 255U);
    return four;
  };
  const auto number_at = [&](std::size_t place) {
    unsigned number = 0;
    for (std::size_t k = 0; k < 4; ++k) number = number << 8 | static_cast<unsigned char>(bytes[place + k]);
    return number;
  };
  std::vector<std::size_t> around;
  std::size_t at = 0;
  for (const char* name : {"moov", "trak", "mdia", "minf", "stbl", "stsd"}) {
    while (bytes.compare(at + 4, 4, name) != 0) at += number_at(at);
    around.push_back(at);
    at += 8;
  }
  at += 8;  // version, and the number of descriptions
  around.push_back(at);
  bytes.insert(at + number_at(at), put(16) + "pasp" + put(width) + put(height));
  for (const std::size_t box : around) bytes.replace(box, 4, put(number_at(box) + 16));
  std::ofstream(film, std::ios::binary) << bytes;
}

// The folder of real images: SHAKEBED_IMAGES, else `shared/images` beside the checkout. Empty when absent.
inline std::filesystem::path real_images() {
  if (const char* given = std::getenv("SHAKEBED_IMAGES")) return given;
  const std::filesystem::path beside = std::filesystem::path(SHAKEBED_SOURCE_DIR) / ".." / "shared" / "images";
  return std::filesystem::exists(beside) ? beside : std::filesystem::path();
}

// The folder of the flume's eight frames with black beads of 6 mm; empty when absent.
inline std::filesystem::path flume_frames() {
  const std::filesystem::path images = real_images();
  if (images.empty() || !std::filesystem::exists(images / "beadtracking" / "truth.csv")) return {};
  return images / "beadtracking";
}

// One bead of one of the flume's frames, as its experimenters tell it. The truth stops at y = 305 px.
struct FlumeBead {
  std::size_t frame = 0;
  std::string bead;
  bool black = false;
  bool at_rest = false;  // told from the second frame on
  double x_px = 0, y_px = 0;
};
inline std::vector<FlumeBead> flume_truth() {
  std::ifstream in(flume_frames() / "truth.csv");
  std::vector<FlumeBead> truth;
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::stringstream fields(line);
    std::vector<std::string> field;
    for (std::string one; std::getline(fields, one, ',');) field.push_back(one);
    truth.push_back({std::stoul(field.at(1)), field.at(2), field.at(3) == "black", field.at(7) == "0",
                     std::stod(field.at(4)), std::stod(field.at(5))});
  }
  return truth;
}

}  // namespace shakebed::ingest::test
