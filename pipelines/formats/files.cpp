#include "pipelines/formats/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>
#include <zstd.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <numbers>
#include <numeric>

#include "pipelines/formats/csv.hpp"
#include "pipelines/formats/errors.hpp"
#include "pipelines/formats/json.hpp"
#include "pipelines/formats/sha256_block.hpp"

namespace shakebed::pipelines {
namespace {

// A file's bytes, mapped.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) fail_to_read(path.string());
    struct stat status {};
    if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
      ::close(descriptor);
      throw InputError(path.string() + ": is not a regular file");
    }
    size_ = static_cast<std::size_t>(status.st_size);
    if (size_ > 0) {
      data_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
      if (data_ == MAP_FAILED) {
        ::close(descriptor);
        fail_to_read(path.string());
      }
    }
    ::close(descriptor);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  ~MappedFile() {
    if (size_ > 0) ::munmap(data_, size_);
  }
  std::string_view bytes() const { return {static_cast<const char*>(data_), size_}; }
  // The bytes a few at a time, each piece let go of before the next: a large file does not fill the memory.
  template <class Work>
  void in_pieces(const Work& work) const {
    constexpr std::size_t piece = std::size_t{4} << 20;  // a multiple of any page size
    for (std::size_t from = 0; from < size_; from += piece) {
      work(bytes().substr(from, piece));
      ::madvise(static_cast<char*>(data_) + from, std::min(piece, size_ - from), MADV_DONTNEED);
    }
  }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace

std::string read_file(const std::filesystem::path& path) { return std::string(MappedFile(path).bytes()); }

void write_file(const std::filesystem::path& path, std::string_view text) {
  const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) throw StageError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      const int error = errno;
      ::close(descriptor);
      throw StageError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(error)));
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  if (::close(descriptor) != 0)
    throw StageError(fmt::format("{}: cannot be written: {}", path.string(), std::strerror(errno)));
}

void write_file_atomically(const std::filesystem::path& path, std::string_view text) {
  const std::filesystem::path temporary =
      path.parent_path() / fmt::format(".{}.{}.part", path.filename().string(), ::getpid());
  try {
    write_file(temporary, text);
    std::filesystem::rename(temporary, path);
  } catch (const std::filesystem::filesystem_error& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw StageError(fmt::format("{}: cannot be written: {}", path.string(), error.code().message()));
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
}

// --- SHA-256

Sha256::Sha256()
    : state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a, 0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19} {}

void Sha256::block(const unsigned char* bytes) { sha256_blocks(state_.data(), bytes, 1); }

void Sha256::update(std::string_view bytes) {
  if (bytes.empty()) return;
  length_ += bytes.size();
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  std::size_t left = bytes.size();
  if (buffered_ > 0) {
    const std::size_t taken = std::min(left, 64 - buffered_);
    std::memcpy(buffer_.data() + buffered_, data, taken);
    buffered_ += taken, data += taken, left -= taken;
    if (buffered_ < 64) return;
    block(buffer_.data());
    buffered_ = 0;
  }
  sha256_blocks(state_.data(), data, left / 64);
  data += left - left % 64, left %= 64;
  if (left > 0) std::memcpy(buffer_.data(), data, left);
  buffered_ = left;
}

std::string Sha256::hex() {
  const std::uint64_t bits = length_ * 8;
  update(std::string_view("\x80", 1));
  while (buffered_ != 56) update(std::string_view("\0", 1));
  std::array<char, 8> tail;
  for (std::size_t i = 0; i < 8; ++i) tail[i] = static_cast<char>(bits >> (56 - 8 * i) & 0xff);
  update({tail.data(), tail.size()});
  std::string out;
  for (const std::uint32_t word : state_) out += fmt::format("{:08x}", word);
  return out;
}

std::string sha256(std::string_view bytes) {
  Sha256 hash;
  hash.update(bytes);
  return hash.hex();
}
std::string sha256_of_file(const std::filesystem::path& path) {
  Sha256 hash;
  MappedFile(path).in_pieces([&](std::string_view piece) { hash.update(piece); });
  return hash.hex();
}

namespace {
std::string hex(const XXH128_hash_t& hash) { return fmt::format("{:016x}{:016x}", hash.high64, hash.low64); }
}  // namespace

std::string fast_hash(std::string_view bytes) { return hex(XXH3_128bits(bytes.data(), bytes.size())); }
std::string fast_hash_of_file(const std::filesystem::path& path) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  MappedFile(path).in_pieces(
      [&](std::string_view piece) { XXH3_128bits_update(state.get(), piece.data(), piece.size()); });
  return hex(XXH3_128bits_digest(state.get()));
}

// --- zstd

std::string compress(std::string_view bytes, int level) {
  std::string out(ZSTD_compressBound(bytes.size()), '\0');
  const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  if (ZSTD_isError(size)) throw StageError(fmt::format("compression failed: {}", ZSTD_getErrorName(size)));
  out.resize(size);
  return out;
}

std::string decompress(std::string_view bytes, const std::string& name) {
  const auto free_context = [](ZSTD_DCtx* context) { ZSTD_freeDCtx(context); };
  const std::unique_ptr<ZSTD_DCtx, decltype(free_context)> context(ZSTD_createDCtx(), free_context);
  std::string out;
  std::vector<char> chunk(ZSTD_DStreamOutSize());
  ZSTD_inBuffer input{bytes.data(), bytes.size(), 0};
  std::size_t state = 1;
  while (input.pos < input.size) {
    ZSTD_outBuffer output{chunk.data(), chunk.size(), 0};
    state = ZSTD_decompressStream(context.get(), &output, &input);
    if (ZSTD_isError(state)) throw InputError(fmt::format("{}: is not zstd: {}", name, ZSTD_getErrorName(state)));
    out.append(chunk.data(), output.pos);
  }
  if (state != 0) throw InputError(name + ": ends in the middle of its compressed data");
  return out;
}

// --- profiles

std::string ProfileTable::comment(std::string_view key) const {
  for (const std::string& line : comments) {
    const std::size_t colon = line.find(':');
    if (colon != std::string::npos && trimmed(std::string_view(line).substr(0, colon)) == key) {
      return trimmed(std::string_view(line).substr(colon + 1));
    }
  }
  return "";
}

std::string profile_text(const ProfileTable& profile) {
  std::string out;
  for (const std::string& comment : profile.comments) out += "# " + comment + '\n';
  out += "height,number_density,std_error,area_fraction,samples\n";
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const bool has_error = i < profile.std_error.size() && profile.std_error[i] >= 0;
    const double area =
        i < profile.area_fraction.size() ? profile.area_fraction[i] : std::numbers::pi / 4 * profile.number_density[i];
    out += fmt::format("{},{},{},{},{}\n", number_text(profile.height[i]), number_text(profile.number_density[i]),
                       has_error ? number_text(profile.std_error[i]) : "", number_text(area),
                       i < profile.samples.size() ? number_text(profile.samples[i]) : "0");
  }
  return out;
}

void write_profile_csv(const std::filesystem::path& path, const ProfileTable& profile) {
  write_file(path, profile_text(profile));
}

namespace {
// Cells separated by blanks, however many.
std::vector<std::string> split_blanks(std::string_view line) {
  std::vector<std::string> cells;
  std::size_t i = 0;
  while (true) {
    i = line.find_first_not_of(" \t\r", i);
    if (i == std::string_view::npos) return cells;
    const std::size_t end = std::min(line.find_first_of(" \t\r", i), line.size());
    cells.emplace_back(line.substr(i, end - i));
    i = end;
  }
}

std::string in_small_letters(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return name;
}

// The first column called NAME_something, as programs write that keep several windows beside one another; -1 for none.
std::ptrdiff_t column_of_several(const std::vector<std::string>& header, std::string_view name, std::string& note) {
  std::ptrdiff_t first = -1;
  std::string others;
  for (std::size_t i = 0; i < header.size(); ++i) {
    if (!in_small_letters(header[i]).starts_with(std::string(name) + "_")) continue;
    if (first < 0)
      first = static_cast<std::ptrdiff_t>(i);
    else
      others += (others.empty() ? "" : ", ") + header[i];
  }
  if (first >= 0 && !others.empty())
    note = fmt::format("the density is column \"{}\"; {} is not read", header[static_cast<std::size_t>(first)], others);
  return first;
}

bool is_any_of(std::string name, std::initializer_list<std::string_view> names) {
  name = in_small_letters(std::move(name));
  return std::find(names.begin(), names.end(), name) != names.end();
}
}  // namespace

ProfileTable read_profile_csv(const std::filesystem::path& path) {
  const std::string text = read_file(path);
  ProfileTable profile;
  std::vector<std::string> header;
  char separator = ',';
  std::ptrdiff_t height = -1, density = -1, error = -1, area = -1, samples = -1;
  std::size_t line_number = 0, begin = text.starts_with("\xEF\xBB\xBF") ? 3 : 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = trimmed(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    ++line_number;
    const auto fail = [&](const std::string& what) -> InputError {
      return InputError(fmt::format("{}:{}: {}", path.string(), line_number, what));
    };
    if (line.empty()) continue;
    if (line[0] == '#') {
      profile.comments.push_back(trimmed(std::string_view(line).substr(1)));
      continue;
    }
    const auto split = [&](std::string_view whole) {
      return separator == ' ' ? split_blanks(whole) : split_csv_line(whole, separator);
    };
    if (header.empty()) {
      for (const char candidate : {',', ';', '\t', ' '}) {
        separator = candidate;
        if (split(line).size() >= 2) break;
      }
      header = split(line);
      for (std::size_t i = 0; i < header.size(); ++i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        if (is_any_of(header[i], {"height", "zeta", "z", "z/d"}))
          height = at;
        else if (is_any_of(header[i], {"number_density", "density", "phi"}))
          density = at;
        else if (is_any_of(header[i], {"std_error", "error", "sigma", "stderr"}))
          error = at;
        else if (is_any_of(header[i], {"area_fraction", "nu"}))
          area = at;
        else if (is_any_of(header[i], {"samples", "count"}))
          samples = at;
      }
      if (density < 0 && area < 0) density = column_of_several(header, "phi", profile.note);
      if (density < 0 && area < 0) area = column_of_several(header, "nu", profile.note);
      if (height < 0 || (density < 0 && area < 0)) {
        throw fail(fmt::format(
            "the header must name at least \"height\" (in D) and \"number_density\" (n D^2), or \"area_fraction\"; "
            "found \"{}\"",
            line));
      }
      continue;
    }
    const auto cells = split(line);
    if (cells.size() != header.size())
      throw fail(fmt::format("{} cells, the header has {}", cells.size(), header.size()));
    const auto number = [&](std::ptrdiff_t column) {
      const std::string& cell = cells[static_cast<std::size_t>(column)];
      double value = 0;
      const auto [stop, problem] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (problem != std::errc() || stop != cell.data() + cell.size() || !std::isfinite(value)) {
        throw fail(fmt::format("\"{}\" in column \"{}\" is not a finite number", cell,
                               header[static_cast<std::size_t>(column)]));
      }
      return value;
    };
    const auto given = [&](std::ptrdiff_t column) {
      return column >= 0 && !cells[static_cast<std::size_t>(column)].empty();
    };
    profile.height.push_back(number(height));
    const double covered = given(area) || density < 0 ? number(area) : std::numbers::pi / 4 * number(density);
    profile.number_density.push_back(density >= 0 ? number(density) : covered * 4 / std::numbers::pi);
    profile.area_fraction.push_back(covered);
    profile.std_error.push_back(given(error) ? number(error) : -1);
    profile.samples.push_back(given(samples) ? number(samples) : 0);
    if (profile.number_density.back() < 0) throw fail("a negative density");
    if (!std::isfinite(profile.number_density.back())) throw fail("a density beyond a double");
    if (given(error) && profile.std_error.back() < 0) throw fail("a negative standard error");
  }
  if (header.empty()) throw InputError(path.string() + ": holds no header line");
  if (profile.height.empty()) throw InputError(path.string() + ": holds no row below its header");
  std::vector<std::size_t> order(profile.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return profile.height[a] < profile.height[b]; });
  const auto sorted = [&](const std::vector<double>& values) {
    std::vector<double> out;
    for (const std::size_t i : order) out.push_back(values[i]);
    return out;
  };
  profile.height = sorted(profile.height), profile.number_density = sorted(profile.number_density);
  profile.std_error = sorted(profile.std_error), profile.area_fraction = sorted(profile.area_fraction);
  profile.samples = sorted(profile.samples);
  return profile;
}

}  // namespace shakebed::pipelines
