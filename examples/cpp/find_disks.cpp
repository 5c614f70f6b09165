// Disks in a picture: the file named, or else one that is drawn here with centres that are known.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <shakebed/ingest/photographs.hpp>
#include <shakebed/ingest/synthetic_frames.hpp>

int main(int argc, char** argv) {
  namespace ingest = shakebed::ingest;

  std::vector<ingest::RenderedDisk> drawn;
  ingest::GrayFrame frame;
  if (argc > 1) {
    frame = ingest::read_frame(argv[1]);
  } else {
    const ingest::SyntheticBed bed{.left_wall_px = 20,
                                   .right_wall_px = 380,
                                   .floor_px = 390,
                                   .radius_px = 9,
                                   .rows = 8,
                                   .gas_count = 12,
                                   .gas_height_px = 30};
    drawn = ingest::make_synthetic_bed(bed);
    frame = ingest::render_frame(drawn, {.width = 400, .height = 400, .blur_px = 0.8, .read_noise = 4});
  }
  const ingest::ImageView view{
      .width = frame.width, .height = frame.height, .pixels = frame.pixels.data(), .type = ingest::PixelType::f32};
  const ingest::DisksFound found = ingest::find_disks(view);
  std::printf("%s", found.full().c_str());
  if (!found.ok()) return 1;

  double sum = 0;
  for (const ingest::RenderedDisk& truth : drawn) {
    double nearest = 1e9;
    for (const ingest::FoundDisk& disk : found.disks)
      nearest = std::min(nearest, std::hypot(disk.x_px - truth.x_px, disk.y_px - truth.y_px));
    sum += nearest * nearest;
  }
  if (!drawn.empty())
    std::printf("%zu disks were drawn; rms error of their centres %.3f px\n", drawn.size(),
                std::sqrt(sum / static_cast<double>(drawn.size())));
}
