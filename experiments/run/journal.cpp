#include "experiments/run/journal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "core/base/status.hpp"

namespace wheelhop {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const char* what) {
  throw UserError(fmt::format("{}: {} ({})", file.string(), what, std::strerror(errno)));
}

/// Bytes up to and with the last line break.
std::size_t whole_lines(int descriptor, std::size_t size) {
  std::string block(1 << 16, '\0');
  for (std::size_t end = size; end > 0;) {
    const std::size_t count = std::min(end, block.size());
    if (::pread(descriptor, block.data(), count, static_cast<off_t>(end - count)) != static_cast<ssize_t>(count))
      return size;
    const std::size_t at = std::string_view(block.data(), count).rfind('\n');
    if (at != std::string_view::npos) return end - count + at + 1;
    end -= count;
  }
  return 0;
}

}  // namespace

Journal::Journal(std::filesystem::path file) : file_(std::move(file)) {
  for (bool opened = false; !opened;) {
    descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666);
    if (descriptor_ < 0) refuse(file_, "cannot be written");
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      ::close(descriptor_);
      throw UserError(file_.string() +
                      ": another process is writing it; wait for its end, or take another folder or shard");
    }
    // Between the two calls another process may have put another file into its place, or taken it away.
    struct stat own = {}, named = {};
    opened = ::fstat(descriptor_, &own) == 0 && ::stat(file_.c_str(), &named) == 0 && own.st_dev == named.st_dev &&
             own.st_ino == named.st_ino;
    if (!opened) ::close(descriptor_);
  }
  const off_t end = ::lseek(descriptor_, 0, SEEK_END);
  size_ = synced_size_ = whole_lines(descriptor_, static_cast<std::size_t>(std::max<off_t>(end, 0)));
  dropped_part_ = static_cast<off_t>(size_) < end;
  if (dropped_part_ && ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) {
    const int reason = errno;
    ::close(descriptor_);
    errno = reason;
    refuse(file_, "the part of a line at its end cannot be cut off");
  }
}

Journal::~Journal() {
  if (synced_size_ != size_) static_cast<void>(::fdatasync(descriptor_));
  ::close(descriptor_);
}

std::size_t Journal::append(std::string_view line) {
  constexpr const char* kept = "cannot be written; what stands there is kept, start again to go on";
  if (broken_) {
    errno = EIO;
    refuse(file_, kept);
  }
  std::string whole(line);
  whole += '\n';
  for (std::size_t done = 0; done < whole.size();) {
    const ssize_t count = ::write(descriptor_, whole.data() + done, whole.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) {
      const int reason = errno;
      // Should the cut fail as well, the next start makes it; a line behind the part would be lost with it.
      broken_ = ::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0;
      errno = reason;
      refuse(file_, kept);
    }
    done += static_cast<std::size_t>(count);
  }
  const std::size_t begin = size_;
  size_ += whole.size();
  return begin;
}

void Journal::sync(std::chrono::milliseconds after) {
  const auto now = std::chrono::steady_clock::now();
  if (synced_size_ == size_ || now - synced_ < after) return;
  // Some file systems cannot sync; that is no loss of what was written.
  if (::fdatasync(descriptor_) != 0 && errno != EINVAL && errno != ENOTSUP)
    refuse(file_, "the disk does not take its lines; what stands there is kept, start again to go on");
  synced_size_ = size_;
  synced_ = now;
}

void for_each_line(const std::filesystem::path& file,
                   const std::function<void(const std::string& line, std::size_t begin)>& visit) {
  std::ifstream stream(file, std::ios::binary);
  std::size_t begin = 0;
  for (std::string line; std::getline(stream, line); begin += line.size() + 1) {
    if (stream.eof()) return;  // the last line has no break: a process was killed while it wrote it
    visit(line, begin);
  }
}

FileLock::FileLock(const std::filesystem::path& file, Kind kind)
    : descriptor_(kind == Kind::alone ? ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)
                                      : ::open(file.c_str(), O_RDONLY | O_CLOEXEC)) {
  if (descriptor_ < 0) {
    if (kind == Kind::shared) return;
    refuse(file, "cannot be written");
  }
  while (::flock(descriptor_, kind == Kind::alone ? LOCK_EX : LOCK_SH) != 0 && errno == EINTR) {
  }
}

FileLock::~FileLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

}  // namespace wheelhop
