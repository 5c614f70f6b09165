// Every public header of ingest; disks that were drawn are found.
#include <cstdio>
#include <shakebed/ingest/density.hpp>
#include <shakebed/ingest/find_disks.hpp>
#include <shakebed/ingest/frames.hpp>
#include <shakebed/ingest/lens.hpp>
#include <shakebed/ingest/measure_bed.hpp>
#include <shakebed/ingest/photographs.hpp>
#include <shakebed/ingest/survey.hpp>
#include <shakebed/ingest/synthetic_frames.hpp>

int main() {
  namespace ingest = shakebed::ingest;
  const auto drawn = ingest::make_synthetic_bed(
      {.left_wall_px = 20, .right_wall_px = 280, .floor_px = 220, .radius_px = 10, .rows = 6});
  const auto frame = ingest::render_frame(drawn, {.width = 300, .height = 240, .blur_px = 0.8, .read_noise = 4});
  const auto found = ingest::find_disks(ingest::ImageView{
      .width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = ingest::PixelType::f32});
  std::printf("%s\n", found.brief().c_str());
  return found.ok() && found.disks.size() == drawn.size() ? 0 : 1;
}
