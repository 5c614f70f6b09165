// A shim for LD_PRELOAD that lets system calls fail as they do on a bad day, by environment variables:
//   SHAKEBED_FAULT_WRITE=N       from the N-th write on the disk is full (ENOSPC); terminals, pipes and sockets
//   excepted SHAKEBED_FAULT_SHORT=1       every write of more than one byte to a file writes only about half
//   SHAKEBED_FAULT_EINTR=N       every N-th read and write is interrupted before it does anything (EINTR)
//   SHAKEBED_FAULT_CLOCK=1       the wall clock jumps by hours, forwards and backwards
// Only calls that go through the dynamic linker are seen: those of the C library's own stdio are not, so disk-full is
// also tested with a real small disk.
#include <dlfcn.h>
#include <errno.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

#include <atomic>

namespace {

long setting(const char* name) {
  const char* text = getenv(name);
  return text == nullptr ? 0 : atol(text);
}
template <class Function>
Function* next(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}
bool is_file(int descriptor) {
  struct stat about {};
  return fstat(descriptor, &about) == 0 && S_ISREG(about.st_mode);
}
std::atomic<long> writes{0}, calls{0}, looks{0};

bool interrupted() {
  static const long every = setting("SHAKEBED_FAULT_EINTR");
  if (every <= 0 || ++calls % every != 0) return false;
  errno = EINTR;
  return true;
}
bool full() {
  static const long from = setting("SHAKEBED_FAULT_WRITE");
  if (from <= 0 || ++writes < from) return false;
  errno = ENOSPC;
  return true;
}

}  // namespace

extern "C" {

ssize_t write(int descriptor, const void* data, size_t size) {
  static auto* const real = next<ssize_t(int, const void*, size_t)>("write");
  static const bool cut = setting("SHAKEBED_FAULT_SHORT") != 0;
  if (is_file(descriptor)) {
    if (full() || interrupted()) return -1;
    if (cut && size > 1) size = (size + 1) / 2;
  }
  return real(descriptor, data, size);
}

ssize_t writev(int descriptor, const struct iovec* parts, int count) {
  static auto* const real = next<ssize_t(int, const struct iovec*, int)>("writev");
  static const bool cut = setting("SHAKEBED_FAULT_SHORT") != 0;
  if (is_file(descriptor)) {
    if (full() || interrupted()) return -1;
    if (cut && count > 0 && parts[0].iov_len > 0) return write(descriptor, parts[0].iov_base, parts[0].iov_len);
  }
  return real(descriptor, parts, count);
}

ssize_t read(int descriptor, void* data, size_t size) {
  static auto* const real = next<ssize_t(int, void*, size_t)>("read");
  if (is_file(descriptor) && interrupted()) return -1;
  return real(descriptor, data, size);
}

int clock_gettime(clockid_t clock, struct timespec* now) {
  static auto* const real = next<int(clockid_t, struct timespec*)>("clock_gettime");
  static const bool jump = setting("SHAKEBED_FAULT_CLOCK") != 0;
  const int result = real(clock, now);
  if (jump && result == 0 && clock == CLOCK_REALTIME) now->tv_sec += (++looks % 2 == 0 ? 7200 : -7200);
  return result;
}

time_t time(time_t* out) {
  struct timespec now {};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}

}  // extern "C"
