// Draws pictures of kinds that the tests of ingest draw: beds, beads of many looks, and things that are no beads.
// usage: draw_pictures FOLDER NAME...
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "ingest/frames/frames.hpp"
#include "ingest/profile/lens.hpp"
#include "tests/ingest/drawn_beds.hpp"
#include "tests/ingest/drawn_pictures.hpp"

namespace {

using namespace shakebed::ingest;

void write_colours(const std::filesystem::path& file, const std::array<GrayFrame, 3>& channels) {
  cv::Mat picture(channels[0].height, channels[0].width, CV_8UC3);
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.cols; ++column)
      for (std::size_t c = 0; c < 3; ++c)  // OpenCV begins with blue
        picture.at<cv::Vec3b>(row, column)[static_cast<int>(2 - c)] =
            static_cast<unsigned char>(channels[c].at(column, row));
  if (!cv::imwrite(file.string(), picture)) throw std::runtime_error(file.string() + " cannot be written");
}

// "bed-3" is a picture of the fourth kind, and "bed-3-2" another one. "wide-3" is "look-3" with its columns 1.4 times
// as wide. "hue-3" is in colour.
void draw(const std::filesystem::path& folder, const std::string& name) {
  std::istringstream words(name);
  std::string of;
  std::size_t kind = 0;
  long which = 0;  // the dash before it makes it negative
  std::getline(words, of, '-') >> kind >> which;
  std::mt19937 random(static_cast<std::mt19937::result_type>(60'000 - 1'000 * which + static_cast<long>(kind)));
  const std::filesystem::path file = folder / (name + ".png");
  if (of == "bed") return write_png(file, test::drawn_beds().at(kind).draw(random).frame);
  if (of == "look") return write_png(file, test::pictures_with_beads().at(kind).draw(random).frame);
  if (of == "wide") {
    const GrayFrame square = test::pictures_with_beads().at(kind).draw(random).frame;
    return write_png(file, LensMap({1.4, 0}, square.width, square.height).corrected(square));
  }
  if (of == "none") return write_png(file, test::pictures_without_beads().at(kind).draw(random));
  if (of == "hue") return write_colours(file, test::coloured_beds().at(kind).draw(random).channels);
  throw std::invalid_argument(name + ": pictures are called bed-, look-, wide-, none- or hue- and a number");
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: draw_pictures FOLDER NAME...\n";
    return EXIT_FAILURE;
  }
  const std::filesystem::path folder = arguments[1];
  for (const std::string& name : std::vector<std::string>(arguments + 2, arguments + count)) draw(folder, name);
}
