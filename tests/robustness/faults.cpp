// A shim for LD_PRELOAD that lets system calls fail as they do on a bad day, by environment variables:
//   SHAKEBED_FAULT_WRITE=N       from the N-th write on the disk is full (ENOSPC); terminals, pipes and sockets
//   excepted SHAKEBED_FAULT_READONLY=DIR  nothing in this folder may be made, changed or removed (EROFS)
//   SHAKEBED_FAULT_SHORT=1       every write of more than one byte to a file writes only about half
//   SHAKEBED_FAULT_EINTR=N       every N-th read and write is interrupted before it does anything (EINTR)
//   SHAKEBED_FAULT_CLOCK=1       the wall clock jumps by hours, forwards and backwards
//   SHAKEBED_FAULT_CLOCK_AHEAD=S the wall clock is S seconds ahead: files that were just written look older
// Only calls that go through the dynamic linker are seen: those of the C library's own stdio are not, so disk-full is
// also tested with a real small disk.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

// Is this place, which need not exist yet, in the folder that may only be read?
bool read_only(const char* path) {
  static const char* const folder = getenv("SHAKEBED_FAULT_READONLY");
  if (folder == nullptr) return false;
  char whole[PATH_MAX] = "";
  if (path[0] != '/') {
    if (getcwd(whole, sizeof whole - 1) == nullptr) return false;
    strncat(whole, "/", sizeof whole - strlen(whole) - 1);
  }
  strncat(whole, path, sizeof whole - strlen(whole) - 1);
  const size_t length = strlen(folder);
  if (strncmp(whole, folder, length) != 0 || (whole[length] != '/' && whole[length] != '\0')) return false;
  errno = EROFS;
  return true;
}
// What differs between open() and its like.
template <class Open>
int open_unless_read_only(Open* real, const char* path, int flags, mode_t mode) {
  const bool writes_to_it = (flags & O_ACCMODE) != O_RDONLY || (flags & (O_CREAT | O_TRUNC)) != 0;
  return writes_to_it && read_only(path) ? -1 : real(path, flags, mode);
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  static auto* const real = next<int(const char*, int, ...)>("open");
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  return open_unless_read_only(real, path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  static auto* const real = next<int(const char*, int, ...)>("open64");
  va_list more;
  va_start(more, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(more, mode_t) : 0;
  va_end(more);
  return open_unless_read_only(real, path, flags, mode);
}

int mkdir(const char* path, mode_t mode) {
  static auto* const real = next<int(const char*, mode_t)>("mkdir");
  return read_only(path) ? -1 : real(path, mode);
}

int rename(const char* from, const char* to) {
  static auto* const real = next<int(const char*, const char*)>("rename");
  return read_only(from) || read_only(to) ? -1 : real(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  static auto* const real = next<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return read_only(from) || read_only(to) ? -1 : real(from_folder, from, to_folder, to, flags);
}

int unlink(const char* path) {
  static auto* const real = next<int(const char*)>("unlink");
  return read_only(path) ? -1 : real(path);
}

int remove(const char* path) {
  static auto* const real = next<int(const char*)>("remove");
  return read_only(path) ? -1 : real(path);
}

int rmdir(const char* path) {
  static auto* const real = next<int(const char*)>("rmdir");
  return read_only(path) ? -1 : real(path);
}

// remove_all goes down by these: names are relative to a folder that is open.
int unlinkat(int folder, const char* name, int flags) {
  static auto* const real = next<int(int, const char*, int)>("unlinkat");
  char link[64], place[PATH_MAX] = "";
  snprintf(link, sizeof link, "/proc/self/fd/%d", folder);
  if (folder >= 0 && readlink(link, place, sizeof place - 1) > 0 && read_only(place)) return -1;
  return folder < 0 && read_only(name) ? -1 : real(folder, name, flags);
}

int symlink(const char* target, const char* path) {
  static auto* const real = next<int(const char*, const char*)>("symlink");
  return read_only(path) ? -1 : real(target, path);
}

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
  static const long ahead = setting("SHAKEBED_FAULT_CLOCK_AHEAD");
  const int result = real(clock, now);
  if (result != 0 || clock != CLOCK_REALTIME) return result;
  now->tv_sec += ahead;
  if (jump) now->tv_sec += (++looks % 2 == 0 ? 7200 : -7200);
  return result;
}

time_t time(time_t* out) {
  struct timespec now {};
  clock_gettime(CLOCK_REALTIME, &now);
  if (out != nullptr) *out = now.tv_sec;
  return now.tv_sec;
}

}  // extern "C"
