#include "pipelines/formats/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
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
  } catch (const StageError& error) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    std::string what = error.what();  // of the file asked for, not of the one that is renamed
    if (const std::size_t at = what.find(temporary.string()); at != std::string::npos)
      what.replace(at, temporary.string().size(), path.string());
    throw StageError(what);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(temporary, ignored);
    throw;
  }
}

// --- SHA-256

namespace {
void require(bool done) {
  if (!done) throw StageError("SHA-256 cannot be computed: the cryptography library reports an error");
}
}  // namespace

void Sha256::Free::operator()(EVP_MD_CTX* context) const { ::EVP_MD_CTX_free(context); }

Sha256::Sha256() : context_(::EVP_MD_CTX_new()) {
  require(context_ != nullptr && ::EVP_DigestInit_ex(context_.get(), ::EVP_sha256(), nullptr) == 1);
}

void Sha256::update(std::string_view bytes) {
  require(::EVP_DigestUpdate(context_.get(), bytes.data(), bytes.size()) == 1);
}

std::string Sha256::hex() {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest;
  unsigned size = 0;
  require(::EVP_DigestFinal_ex(context_.get(), digest.data(), &size) == 1);
  std::string out;
  for (unsigned i = 0; i < size; ++i) out += fmt::format("{:02x}", digest[i]);
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
    if (ZSTD_isError(state))
      throw InputError(fmt::format("{}: this is not a file compressed with zstd: {}", name, ZSTD_getErrorName(state)));
    out.append(chunk.data(), output.pos);
  }
  if (state != 0) throw InputError(name + ": the compressed data are truncated");
  return out;
}

}  // namespace shakebed::pipelines
