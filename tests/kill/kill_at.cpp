#include "tests/kill/kill_at.hpp"

#include <dlfcn.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>

namespace {

std::atomic<long>& calls_left() {
  static std::atomic<long> left = [] {
    const char* given = ::getenv("WHEELHOP_TEST_KILL_AT");
    return given ? ::strtol(given, nullptr, 10) : 0;
  }();
  return left;
}

bool is_counting() { return calls_left() > 0; }

/// True for the call that ends this process.
bool is_the_one() { return is_counting() && calls_left()-- == 1; }

void end() { ::kill(::getpid(), SIGKILL); }

/// The function of this name behind ours.
template <class Function>
Function* behind(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

bool is_regular(int descriptor) {
  struct stat info {};
  return ::fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode);
}

}  // namespace

void wheelhop::test::kill_at_call(long n) { calls_left() = n; }

#pragma GCC visibility push(default)
extern "C" {

int rename(const char* from, const char* to) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(const char*, const char*)>("rename");
  return call(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return call(from_folder, from, to_folder, to, flags);
}

int remove(const char* name) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(const char*)>("remove");
  return call(name);
}

int unlink(const char* name) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(const char*)>("unlink");
  return call(name);
}

int unlinkat(int folder, const char* name, int flags) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(int, const char*, int)>("unlinkat");
  return call(folder, name, flags);
}

int rmdir(const char* name) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(const char*)>("rmdir");
  return call(name);
}

int mkdir(const char* name, mode_t mode) noexcept {
  if (is_the_one()) end();
  static auto* const call = behind<int(const char*, mode_t)>("mkdir");
  return call(name, mode);
}

ssize_t write(int descriptor, const void* bytes, size_t count) {
  static auto* const call = behind<ssize_t(int, const void*, size_t)>("write");
  if (is_counting() && is_regular(descriptor) && is_the_one()) {
    (void)call(descriptor, bytes, count / 2);
    end();
  }
  return call(descriptor, bytes, count);
}

int fsync(int descriptor) {
  static auto* const call = behind<int(int)>("fsync");
  return is_counting() ? 0 : call(descriptor);
}

}  // extern "C"
#pragma GCC visibility pop
