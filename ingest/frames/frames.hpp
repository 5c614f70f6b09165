#pragma once
// Frames: grey images in memory, and a stream of them from files, folders, globs and films.
//
// Pixel-centre convention, everywhere in ingest: the centre of the top-left pixel is (0, 0). x_px grows to the right,
// y_px grows downwards. The frame covers -0.5 .. width - 0.5 by -0.5 .. height - 0.5.
//
// A frame owns its levels. A stream belongs to one thread at a time; what decode() does of its items may run in
// several.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace shakebed::ingest {

// One grey image. `pixels` holds width * height levels row by row, scaled to 0 .. 255 (not clamped, not rounded).
struct GrayFrame {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;
  // Pixels of this frame to one that the camera took, along a side: more than 1 where the picture was enlarged by
  // repeating pixels. Its noise is then as much wider.
  double enlargement = 1;

  [[nodiscard]] bool empty() const { return pixels.empty(); }
  [[nodiscard]] float at(int column, int row) const {
    return pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column)];
  }
};

// A rectangle of pixels: columns left .. left + width - 1, rows top .. top + height - 1.
struct PixelRectangle {
  int left = 0, top = 0, width = 0, height = 0;
  bool operator==(const PixelRectangle&) const = default;
};

// What went wrong with an input, where, why, and what to do about it. what() is the whole sentence.
class InputError : public std::runtime_error {
 public:
  InputError(std::string path, std::string problem, std::string why, std::string suggestion);
  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  [[nodiscard]] const std::string& why() const { return why_; }
  [[nodiscard]] const std::string& suggestion() const { return suggestion_; }

 private:
  std::string path_, problem_, why_, suggestion_;
};

// Where a frame comes from: a file, and the page (TIFF) or the frame (film) in it, counted from 0.
struct FrameOrigin {
  std::string path;
  std::size_t page = 0;
};

// The level computed from a colour pixel. `automatic`: red, green or blue, whichever has the best contrast in the first
// colour frame, for the whole stream. `background_distance`: the distance from the most frequent colour of the first
// colour frame. `saturation`: the largest component less the smallest. `grey_distance`: the distance of the grey level
// from that of the background of the first frame, which follows the light (background_level.hpp).
enum class Channel {
  automatic = -1,
  red = 0,
  green = 1,
  blue = 2,
  grey = 3,
  saturation = 4,
  background_distance = 5,
  grey_distance = 6
};
const char* name_of(Channel channel);

struct FrameSourceOptions {
  Channel channel = Channel::automatic;
  // Pixels beyond which a frame is refused (a located error), so that memory stays bounded. They are counted once the
  // frame is reduced.
  std::size_t largest_frame_pixels = 150'000'000;
  // Pixels beyond which a picture is not decoded at all.
  std::size_t largest_decoded_pixels = 1'000'000'000;
  // Frames are averaged over squares of so many pixels; pixels left over at the right and at the bottom are dropped.
  // The colours are averaged as far as read_channels() averages them, and the levels computed from them by the rest.
  // Where that is no whole factor, the colours are averaged over the whole squares.
  int reduction = 1;
  // Leave out so many frames at the beginning of the stream, and keep every `stride`-th of the others, the first
  // included.
  std::size_t skip = 0, stride = 1;
};

// A stream of frames, one in memory at a time. Files are read in the order given; folders and globs (`*`, `?`, `[..]`)
// are expanded in natural order (frame2 before frame10). A file's kind follows from its contents, and from its name
// where they say nothing. Readable: PNG, TIFF (8, 16 bit, float; multi-page), JPEG, BMP, PGM/PPM, and films (mp4, avi,
// mov, mkv, ...). Films are decoded forward from their first frame, so frame k is exactly the k-th picture of the film.
// 16-bit files that use 10, 12 or 14 bits are scaled by the bits used, found on the first.
class FrameSource {
 public:
  // Throws InputError when nothing matches, a path does not exist, or is of no known kind. Opens no file's contents.
  static FrameSource open(const std::vector<std::string>& paths, const FrameSourceOptions& options = {});
  // Whether the file, or else its name's ending, is that of a picture or a film.
  static bool is_frame_file(const std::filesystem::path& path);
  // Frames made on demand, e.g. by a renderer: `make(index)` for index 0 .. count - 1, called from several threads.
  static FrameSource from_generator(std::size_t count, std::function<GrayFrame(std::size_t)> make);
  static FrameSource from_frames(std::vector<GrayFrame> frames);

  FrameSource(FrameSource&&) noexcept;
  FrameSource& operator=(FrameSource&&) noexcept;
  ~FrameSource();

  // One item of the stream. decode() may be called once, from any thread; for image files the decoding is done then.
  struct Item {
    std::size_t index = 0;  // position in the stream
    FrameOrigin origin;
    std::function<GrayFrame()> decode;  // throws InputError: unreadable, truncated, empty, too large
  };
  // The next item, or nothing at the end. Throws InputError for a film that cannot be opened. Not thread-safe.
  std::optional<Item> next_item();
  // The next frame decoded, or nothing at the end; throws as above. After a throw the stream goes on with the next
  // frame.
  std::optional<GrayFrame> next(FrameOrigin* origin = nullptr);
  // Back to the first frame.
  void rewind();
  // Where the first frames come from, at most `most`. Nothing is decoded into memory; the stream is rewound.
  std::vector<FrameOrigin> first_origins(std::size_t most);
  // Frames in the stream if known without decoding films; TIFF files are counted by page.
  [[nodiscard]] std::optional<std::size_t> count_if_known() const;
  // Frames a second of the stream as stated in the film; nothing unless the stream is one film that does.
  [[nodiscard]] std::optional<double> film_rate_hz() const;

 private:
  struct State;
  explicit FrameSource(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

// Width over height of a pixel, at the limits of what is corrected.
inline constexpr double narrowest_pixel = 0.5, widest_pixel = 2;
// As a film states it. 1 where it states none, or one beyond these limits, and for image files.
double stated_pixel_aspect(const std::string& path);

// The page-th picture of an image file, or the page-th frame of a film. Throws InputError.
GrayFrame read_frame(const std::filesystem::path& path, std::size_t page = 0, const FrameSourceOptions& options = {});

// Pixels to which a picture is reduced before beads are searched in its channels.
inline constexpr std::size_t surveyed_pixels = 6'000'000;
// The side of the squares over which a picture of so many pixels is averaged, so that at most `most` are left.
int reduction_to(std::size_t most, std::size_t pixels);

// One frame in every channel it has: grey alone when it has no colour. Frames of more than `most_pixels` are reduced by
// averaging over `reduction` x `reduction` pixels.
struct ChannelFrames {
  struct One {
    Channel channel = Channel::automatic;
    GrayFrame frame;
  };
  int reduction = 1;
  int width = 0, height = 0;  // of the frame itself
  std::vector<One> channels;
};
ChannelFrames read_channels(const std::filesystem::path& path, std::size_t page = 0,
                            std::size_t most_pixels = surveyed_pixels, const FrameSourceOptions& options = {});

// Writes 8-bit grey PNG, levels rounded to nearest and clamped to 0 .. 255, into a temporary file beside `path` that is
// then renamed, so that a half-written PNG is never seen. `compression` 0 (fast) .. 9 (small). Throws InputError for an
// empty frame, OutputError (atomic_file.hpp) when it cannot be written.
void write_png(const std::filesystem::path& path, const GrayFrame& frame, int compression = 1);

}  // namespace shakebed::ingest
