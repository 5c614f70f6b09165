#include "pipelines/formats/trajectory.hpp"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <string_view>

#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"

namespace shakebed::pipelines {

// Both far above what any trajectory holds; a damaged or compressed file may claim gigabytes.
constexpr std::size_t longest_line = 1 << 20;      // [bytes]
constexpr std::size_t most_disks = 1'000'000'000;  // of a frame

// --- writing

struct TrajectoryWriter::Compressor {
  ZSTD_CCtx* context = ZSTD_createCCtx();
  std::vector<char> out = std::vector<char>(ZSTD_CStreamOutSize());
  ~Compressor() { ZSTD_freeCCtx(context); }
};

TrajectoryWriter::TrajectoryWriter(const std::filesystem::path& path) : path_(path.string()) {
  file_ = std::fopen(path_.c_str(), "wbe");
  if (file_ == nullptr) throw StageError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  if (path.extension() == ".zst") compressor_ = std::make_unique<Compressor>();
}

TrajectoryWriter::~TrajectoryWriter() {
  if (file_ != nullptr) std::fclose(file_);
}

void TrajectoryWriter::write(const TrajectoryFrame& frame) {
  double height = frame.height;
  if (height <= 0) {
    for (const double z : frame.z) height = std::max(height, z + 1);
    height = std::max(height, 1.0);
  }
  const auto number = [&](double value) {
    char text[32];
    const auto end = std::to_chars(text, text + sizeof text, value == 0 ? 0.0 : value).ptr;  // no "-0"
    buffer_.append(text, end);
  };
  buffer_ += fmt::format("{}\nLattice=\"{} 0 0 0 1 0 0 0 {}\" Origin=\"0 -0.5 0\" pbc=\"{} F F\" ", frame.size(),
                         number_text(frame.width), number_text(height), frame.periodic ? 'T' : 'F');
  const bool spin = !frame.spin.empty();
  buffer_ += fmt::format(
      "Properties=species:S:1:pos:R:3:velo:R:3:radius:R:1{} Time={} Phase={} Floor={} FloorVelocity={} Width={} "
      "Units=reduced\n",
      spin ? ":spin:R:1" : "", number_text(frame.time), number_text(frame.phase), number_text(frame.floor_position),
      number_text(frame.floor_velocity), number_text(frame.width));
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const double radius = frame.radius.empty() ? 0.5 : frame.radius[i];
    buffer_ += radius == 0.5 ? "X " : "B ";
    number(frame.x[i]), buffer_ += " 0 ", number(frame.z[i]), buffer_ += ' ';
    number(frame.vx[i]), buffer_ += " 0 ", number(frame.vz[i]), buffer_ += ' ';
    number(radius);
    if (spin) buffer_ += ' ', number(frame.spin[i]);
    buffer_ += '\n';
  }
  if (buffer_.size() > (1u << 20)) flush(false);
}

void TrajectoryWriter::flush(bool last) {
  const auto put = [&](const char* data, std::size_t size) {
    if (std::fwrite(data, 1, size, file_) != size) {
      throw StageError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
    }
  };
  if (!compressor_) {
    put(buffer_.data(), buffer_.size());
  } else {
    ZSTD_inBuffer input{buffer_.data(), buffer_.size(), 0};
    bool more = true;
    while (more) {
      ZSTD_outBuffer output{compressor_->out.data(), compressor_->out.size(), 0};
      const std::size_t left =
          ZSTD_compressStream2(compressor_->context, &output, &input, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(left))
        throw StageError(fmt::format("{}: compression failed: {}", path_, ZSTD_getErrorName(left)));
      put(compressor_->out.data(), output.pos);
      more = last ? left != 0 : input.pos < input.size;
    }
  }
  buffer_.clear();
}

void TrajectoryWriter::close() {
  if (file_ == nullptr) return;
  flush(true);
  const int result = std::fclose(file_);
  file_ = nullptr;
  if (result != 0) throw StageError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
}

// --- reading

struct TrajectoryReader::Decompressor {
  ZSTD_DCtx* context = ZSTD_createDCtx();
  std::vector<char> in = std::vector<char>(ZSTD_DStreamInSize());
  std::vector<char> out = std::vector<char>(ZSTD_DStreamOutSize());
  ZSTD_inBuffer input{};
  std::size_t state = 0;
  ~Decompressor() { ZSTD_freeDCtx(context); }
};

TrajectoryReader::TrajectoryReader(const std::filesystem::path& path, UpAxis up) : path_(path.string()), up_(up) {
  file_ = std::fopen(path_.c_str(), "rbe");
  if (file_ == nullptr) fail_to_read(path_);
  if (path.extension() == ".zst") decompressor_ = std::make_unique<Decompressor>();
}

TrajectoryReader::~TrajectoryReader() {
  if (file_ != nullptr) std::fclose(file_);
}

void TrajectoryReader::fail(const std::string& what) const {
  throw InputError(fmt::format("{}:{}: {}", path_, line_number_, what));
}

// Reads on; false at the end of the file.
bool TrajectoryReader::more() {
  if (at_end_) return false;
  buffer_.erase(0, position_);
  position_ = 0;
  if (!decompressor_) {
    char chunk[1 << 16];
    const std::size_t size = std::fread(chunk, 1, sizeof chunk, file_);
    if (size == 0 && std::ferror(file_) != 0) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
    buffer_.append(chunk, size);
    at_end_ = size == 0;
    return size > 0;
  }
  Decompressor& d = *decompressor_;
  while (true) {
    if (d.input.pos == d.input.size) {
      const std::size_t size = std::fread(d.in.data(), 1, d.in.size(), file_);
      if (size == 0) {
        if (std::ferror(file_) != 0) fail(fmt::format("cannot be read: {}", std::strerror(errno)));
        at_end_ = true;
        if (d.state != 0) fail("the compressed data are truncated");
        return false;
      }
      d.input = {d.in.data(), size, 0};
    }
    ZSTD_outBuffer output{d.out.data(), d.out.size(), 0};
    d.state = ZSTD_decompressStream(d.context, &output, &d.input);
    if (ZSTD_isError(d.state))
      fail(fmt::format("this is not a file compressed with zstd: {}", ZSTD_getErrorName(d.state)));
    if (output.pos > 0) {
      buffer_.append(d.out.data(), output.pos);
      return true;
    }
  }
}

bool TrajectoryReader::line(std::string_view& out) {
  std::size_t searched = position_;
  while (true) {
    const std::size_t end = buffer_.find('\n', searched);
    if (end != std::string::npos) {
      out = std::string_view(buffer_).substr(position_, end - position_);
      if (!out.empty() && out.back() == '\r') out.remove_suffix(1);
      position_ = end + 1;
      ++line_number_;
      return true;
    }
    const std::size_t held = buffer_.size() - position_;
    if (held > longest_line) fail(fmt::format("a line of more than {} bytes: this is not a trajectory", longest_line));
    if (!more()) {
      if (buffer_.size() == position_) return false;
      out = std::string_view(buffer_).substr(position_);
      position_ = buffer_.size();
      ++line_number_;
      return true;
    }
    searched = held;
  }
}

namespace {
// The value of key=value or key="value ..." in a comment line.
std::string_view comment_value(std::string_view comment, std::string_view key) {
  std::size_t at = 0;
  while ((at = comment.find(key, at)) != std::string_view::npos) {
    const std::size_t equals = at + key.size();
    const bool whole = (at == 0 || comment[at - 1] == ' ') && equals < comment.size() && comment[equals] == '=';
    if (!whole) {
      at = equals;
      continue;
    }
    const std::size_t begin = equals + 1;
    if (begin < comment.size() && comment[begin] == '"') {
      const std::size_t end = comment.find('"', begin + 1);
      return comment.substr(begin + 1, end == std::string_view::npos ? end : end - begin - 1);
    }
    return comment.substr(begin, comment.find(' ', begin) - begin);
  }
  return {};
}

bool to_double(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::string_view next_word(std::string_view& line) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  const std::size_t end = std::min(line.find_first_of(" \t", begin), line.size());
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}
}  // namespace

// Where in a line of a disk its numbers stand; -1: they are not there.
struct TrajectoryReader::Columns {
  int all = 0, position = -1, position_size = 0, velocity = -1, velocity_size = 0, radius = -1, spin = -1;

  bool hold_number(int column) const {
    return (column >= position && column < position + position_size) ||
           (velocity >= 0 && column >= velocity && column < velocity + velocity_size) || column == radius ||
           column == spin;
  }
};

bool TrajectoryReader::read(TrajectoryFrame& frame) {
  std::size_t count = 0;
  if (!read_count(count)) return false;
  std::string_view text;
  if (!line(text)) fail("the file ends before the comment line");
  const std::string comment(text);
  read_moment(comment, frame);
  read_disks(count, read_columns(comment), frame);
  return true;
}

// The first line of a frame that is not empty; false at the end of the file.
bool TrajectoryReader::read_count(std::size_t& count) {
  std::string_view text;
  do {
    if (!line(text)) return false;
  } while (text.find_first_not_of(" \t") == std::string_view::npos);
  std::string_view rest = text;
  const std::string_view word = next_word(rest);
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), count);
  if (error != std::errc() || end != word.data() + word.size())
    fail(fmt::format("expected the number of disks, found \"{}\"", text));
  if (count > most_disks)
    fail(fmt::format("{} disks in one frame, but at most {} can be read. Check the number of disks in this line.",
                     count, most_disks));
  return true;
}

void TrajectoryReader::read_moment(std::string_view comment, TrajectoryFrame& frame) const {
  const auto number = [&](std::string_view key) {
    const std::string_view found = comment_value(comment, key);
    double value = 0;
    if (!found.empty() && !to_double(found, value)) fail(fmt::format("{}={} is not a number", key, found));
    return value;
  };
  frame.time = number("Time"), frame.phase = number("Phase");
  frame.floor_position = number("Floor"), frame.floor_velocity = number("FloorVelocity");
  frame.width = number("Width"), frame.height = 0;
  const std::string_view pbc = comment_value(comment, "pbc");
  frame.periodic = !pbc.empty() && pbc.front() == 'T';
  std::string_view lattice = comment_value(comment, "Lattice");
  if (lattice.empty()) return;
  for (int i = 0; i < 9; ++i) {
    double value = 0;
    if (!to_double(next_word(lattice), value)) fail("Lattice must contain nine numbers");
    if (i == 0 && frame.width == 0) frame.width = value;
    if (i == 8) frame.height = value;
  }
}

// From Properties=name:type:count:name:type:count...
TrajectoryReader::Columns TrajectoryReader::read_columns(std::string_view comment) const {
  const std::string_view properties = comment_value(comment, "Properties");
  std::vector<std::string_view> parts;
  std::size_t begin = 0;
  while (begin <= properties.size() && !properties.empty()) {
    const std::size_t end = std::min(properties.find(':', begin), properties.size());
    parts.push_back(properties.substr(begin, end - begin));
    begin = end + 1;
  }
  if (parts.size() % 3 != 0) fail("Properties must be triples name:type:count");
  Columns columns;
  for (std::size_t i = 0; i + 2 < parts.size(); i += 3) {
    int size = 0;
    std::from_chars(parts[i + 2].data(), parts[i + 2].data() + parts[i + 2].size(), size);
    if (size < 1 || size > 100)
      fail(fmt::format("Properties gives \"{}\" columns for \"{}\"; their number must be 1 to 100", parts[i + 2],
                       parts[i]));
    if (parts[i] == "pos")
      columns.position = columns.all, columns.position_size = size;
    else if (parts[i] == "velo")
      columns.velocity = columns.all, columns.velocity_size = size;
    else if (parts[i] == "radius")
      columns.radius = columns.all;
    else if (parts[i] == "spin")
      columns.spin = columns.all;
    columns.all += size;
  }
  if (columns.position < 0 || columns.position_size < 2 || columns.position_size > 3)
    fail("Properties must contain pos:R:2 or pos:R:3");
  return columns;
}

void TrajectoryReader::read_disks(std::size_t count, const Columns& columns, TrajectoryFrame& frame) {
  // Grow with the lines that are really there: a count in a damaged header must not ask for gigabytes.
  for (std::vector<double>* values : {&frame.x, &frame.z, &frame.vx, &frame.vz, &frame.spin, &frame.radius})
    values->clear();
  std::vector<double> row(static_cast<std::size_t>(columns.all));
  const auto at = [&](int column) { return row[static_cast<std::size_t>(column)]; };
  const auto upwards = [&](int size) { return size == 3 && up_ == UpAxis::y ? 1 : size - 1; };
  const int height = columns.position + upwards(columns.position_size);
  const int velocity = columns.velocity + upwards(columns.velocity_size);
  for (std::size_t i = 0; i < count; ++i) {
    std::string_view text;
    if (!line(text)) fail(fmt::format("the file ends after {} of {} disks", i, count));
    for (int column = 0; column < columns.all; ++column) {
      const std::string_view word = next_word(text);
      if (word.empty()) fail(fmt::format("this line has {} columns, but Properties announces {}", column, columns.all));
      if (columns.hold_number(column) && !to_double(word, row[static_cast<std::size_t>(column)]))
        fail(fmt::format("\"{}\" is not a number", word));
    }
    frame.x.push_back(at(columns.position)), frame.z.push_back(at(height));
    frame.vx.push_back(columns.velocity >= 0 ? at(columns.velocity) : 0);
    frame.vz.push_back(columns.velocity >= 0 ? at(velocity) : 0);
    frame.radius.push_back(columns.radius >= 0 ? at(columns.radius) : 0.5);
    if (columns.spin >= 0) frame.spin.push_back(at(columns.spin));
  }
}

std::size_t count_frames(const std::filesystem::path& path) {
  TrajectoryReader reader(path);
  TrajectoryFrame frame;
  std::size_t frames = 0;
  while (reader.read(frame)) ++frames;
  return frames;
}

}  // namespace shakebed::pipelines
