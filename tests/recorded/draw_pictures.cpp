// Draws pictures of kinds that the tests of ingest draw: beds, beads of many looks, and things that are no beads.
// usage: draw_pictures FOLDER NAME...
#include <cstdlib>
#include <filesystem>
#include <iostream>
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

// "bed-3" is a picture of the fourth kind, and "bed-3-2" another one. "wide-3" is "look-3" with its columns 1.4 times as
// wide.
GrayFrame drawn(const std::string& name) {
  std::istringstream words(name);
  std::string of;
  std::size_t kind = 0;
  long which = 0;  // the dash before it makes it negative
  std::getline(words, of, '-') >> kind >> which;
  std::mt19937 random(static_cast<std::mt19937::result_type>(60'000 - 1'000 * which + static_cast<long>(kind)));
  if (of == "bed") return test::drawn_beds().at(kind).draw(random).frame;
  if (of == "look") return test::pictures_with_beads().at(kind).draw(random).frame;
  if (of == "wide") {
    const GrayFrame square = test::pictures_with_beads().at(kind).draw(random).frame;
    return LensMap({1.4, 0}, square.width, square.height).corrected(square);
  }
  if (of == "none") return test::pictures_without_beads().at(kind).draw(random);
  throw std::invalid_argument(name + ": pictures are called bed-, look-, wide- or none- and a number");
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) {
    std::cerr << "usage: draw_pictures FOLDER NAME...\n";
    return EXIT_FAILURE;
  }
  const std::filesystem::path folder = arguments[1];
  for (const std::string& name : std::vector<std::string>(arguments + 2, arguments + count))
    write_png(folder / (name + ".png"), drawn(name));
}
