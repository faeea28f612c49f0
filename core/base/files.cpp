#include "core/base/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <limits>
#include <new>
#include <regex>
#include <system_error>
#include <vector>

#include "core/base/status.hpp"

namespace wheelhop {
namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const fs::path& file, const char* action, int error) {
  throw MachineError(fmt::format("{}: cannot {}: {}", file.string(), action, std::generic_category().message(error)));
}

/// What is not there, or of another kind, is a matter of the name that was given.
[[noreturn]] void fail_to_read(const fs::path& file, int error) {
  for (const int of_the_name : {ENOENT, ENOTDIR, ELOOP, ENAMETOOLONG})
    if (error == of_the_name)
      throw UserError(fmt::format("{}: cannot read: {}", file.string(), std::generic_category().message(error)));
  fail(file, "read", error);
}

/// MachineError for a file larger than the whole memory: filling it would end other programs first.
void require_memory(const fs::path& file, off_t size) {
  const double memory = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGESIZE));
  if (memory > 0 && static_cast<double>(size) > memory)
    throw MachineError(fmt::format("{}: cannot read: not enough memory, it has {} bytes and this machine {:.0f}",
                                   file.string(), size, memory));
}

/// Waits until a pipe has bytes or its end. UserError after too long a silence.
void wait_for_bytes(const fs::path& file, int descriptor) {
  const double silence_s = read_limits().silence_s;
  const int wait_ms = silence_s < 1e6 ? static_cast<int>(1000 * silence_s) : -1;
  struct pollfd bytes = {descriptor, POLLIN, 0};
  int outcome = 0;
  while ((outcome = ::poll(&bytes, 1, wait_ms)) < 0 && errno == EINTR) {
  }
  if (outcome < 0) fail_to_read(file, errno);
  if (outcome == 0)
    throw UserError(fmt::format("{}: expected somebody to write into this pipe, found {:g} s of silence; {}",
                                file.string(), silence_s, how_to_lift));
}

/// An open file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor(const fs::path& file, int flags) : number_(::open(file.c_str(), flags | O_CLOEXEC, 0666)) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;

  bool is_open() const { return number_ >= 0; }
  int number() const { return number_; }
  /// 0 or the error of close, which on a network disk is where "disk full" appears.
  int close() {
    const int result = ::close(number_) == 0 ? 0 : errno;
    number_ = -1;
    return result;
  }

 private:
  int number_;
};

/// 0 or errno.
int write_all(int descriptor, const std::string& content) {
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t count = ::write(descriptor, content.data() + done, content.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    if (count == 0) return EIO;
    done += static_cast<std::size_t>(count);
  }
  return 0;
}

/// A new name survives a power cut only once its folder is on disk; a file system that cannot sync folders is left be.
void sync_folder(const fs::path& folder) {
  const Descriptor open(folder.empty() ? fs::path(".") : folder, O_RDONLY | O_DIRECTORY);
  if (open.is_open()) ::fsync(open.number());
}

void rename_or_fail(const fs::path& from, const fs::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) fail(to, "write", errno);
}

/// The machine's name without dots, since numbers of processes mean something on their own machine only.
std::string machine() {
  char name[256] = "";
  if (::gethostname(name, sizeof name - 1) != 0) return "unknown";
  std::string result = name;
  for (char& c : result)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '-';
  return result.empty() ? "unknown" : result;
}

/// True for a name that temporary_beside() gave in a process of this machine that has ended.
bool is_leftover(const std::string& name) {
  static const std::regex pattern(R"(\..*\.([^.]+)\.([0-9]{1,9})\.[0-9]+\.part)");
  std::smatch found;
  if (!std::regex_match(name, found, pattern) || found[1] != machine()) return false;
  const auto process = static_cast<pid_t>(std::stol(found[2]));
  return process > 0 && ::kill(process, 0) != 0 && errno == ESRCH;
}

/// Writes and syncs the whole content into a new file; 0 or errno. @param like file whose mode and, where this is
/// permitted, owner the new one gets, if it is there
int write_new_file(const fs::path& file, const std::string& content, const fs::path& like = {}) {
  Descriptor out(file, O_WRONLY | O_CREAT | O_TRUNC);
  if (!out.is_open()) return errno;
  int error = write_all(out.number(), content);
  struct stat old {};
  if (!like.empty() && ::stat(like.c_str(), &old) == 0) {
    const bool owned = ::fchown(out.number(), old.st_uid, old.st_gid) == 0;
    // Whose group could not be kept must not read by its rights.
    if (::fchmod(out.number(), old.st_mode & (owned ? 07777 : 0707)) != 0 && error == 0) error = errno;
  }
  if (error == 0 && ::fsync(out.number()) != 0) error = errno;
  const int closing = out.close();
  return error != 0 ? error : closing;
}

}  // namespace

fs::path temporary_beside(const fs::path& target) {
  static std::atomic<unsigned> counter{0};
  // A name may have 255 bytes, whatever is put behind it.
  const std::string name = target.filename().string().substr(0, 100);
  fs::path result = target;
  result.replace_filename(fmt::format(".{}.{}.{}.{}.part", name, machine(), ::getpid(), counter++));
  return result;
}

void remove_leftovers(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? fs::path(".") : folder, ignored))
    if (is_leftover(entry.path().filename().string())) found.push_back(entry.path());
  for (const fs::path& leftover : found) fs::remove_all(leftover, ignored);
}

ReadLimits& read_limits() {
  static ReadLimits limits;
  return limits;
}

namespace {

/// What a user may have meant who named a folder: some of the files that it holds, by name.
std::string files_in(const fs::path& folder) {
  constexpr std::size_t most = 6;
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (const std::string name = entry->path().filename().string(); name[0] != '.' && entry->is_regular_file(error))
      names.push_back(name);
  if (names.empty()) return "";
  std::sort(names.begin(), names.end());
  const std::size_t more = names.size() - std::min(names.size(), most);
  names.resize(names.size() - more);
  return fmt::format(" with {}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

[[noreturn]] void refuse_folder(const fs::path& file) {
  throw UserError(fmt::format("{}: expected a file, found a folder{}", file.string(), files_in(file)));
}

/// True of an empty folder whose place another one may take by one renaming. It has to belong to this user and to stand
/// in a folder that this user may change; a link, a mount point, and the names "." and ".." cannot be replaced.
bool is_replaceable(const fs::path& folder) {
  const std::string name = folder.filename().string();
  const fs::path above = folder.has_parent_path() ? folder.parent_path() : fs::path(".");
  struct stat own {
  }, parent{};
  if (name == "." || name == ".." || ::lstat(folder.c_str(), &own) != 0 || ::stat(above.c_str(), &parent) != 0)
    return false;
  std::error_code error;
  return S_ISDIR(own.st_mode) && own.st_dev == parent.st_dev && own.st_uid == ::geteuid() &&
         ::access(above.c_str(), W_OK | X_OK) == 0 && fs::is_empty(folder, error) && !error;
}

}  // namespace

void require_file(const fs::path& file) {
  struct stat info {};
  if (::stat(file.c_str(), &info) != 0) fail_to_read(file, errno);
  if (S_ISDIR(info.st_mode)) refuse_folder(file);
}

std::string read_file(const fs::path& file) {
  // Without O_NONBLOCK the call would wait for ever for who writes a pipe.
  const Descriptor in(file, O_RDONLY | O_NONBLOCK);
  if (!in.is_open()) fail_to_read(file, errno);
  struct stat info {};
  if (::fstat(in.number(), &info) != 0) fail_to_read(file, errno);
  if (S_ISDIR(info.st_mode)) refuse_folder(file);
  const bool pipe = S_ISFIFO(info.st_mode);
  if (!pipe) ::fcntl(in.number(), F_SETFL, 0);
  require_memory(file, info.st_size);
  // The size is a hint only: pipes, devices and /proc files report 0, and then a limit holds.
  const double most = info.st_size > 0 ? std::numeric_limits<double>::infinity() : read_limits().stream_bytes;
  std::string content;
  std::size_t used = 0;
  try {
    content.resize(static_cast<std::size_t>(info.st_size) + 1);
    for (;;) {
      if (used == content.size()) content.resize(2 * content.size() + 4096);
      if (pipe) wait_for_bytes(file, in.number());
      const ssize_t count = ::read(in.number(), content.data() + used, content.size() - used);
      if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
      if (count < 0) fail_to_read(file, errno);
      if (count == 0) break;
      used += static_cast<std::size_t>(count);
      if (static_cast<double>(used) > most)
        throw UserError(fmt::format("{}: expected at most {:.0f} bytes from a pipe or device, found more; {}",
                                    file.string(), most, how_to_lift));
    }
  } catch (const std::bad_alloc&) {
    throw MachineError(fmt::format("{}: cannot read: not enough memory after {} bytes", file.string(), used));
  }
  content.resize(used);
  return content;
}

void write_file(const fs::path& file, const std::string& content) {
  std::error_code ignored;
  if (file.filename().empty() || fs::is_directory(file, ignored)) fail(file, "write", EISDIR);
  fs::path target = file;
  if (fs::is_symlink(file, ignored) && fs::exists(file, ignored)) target = fs::canonical(file, ignored);
  if (fs::exists(target, ignored) && !fs::is_regular_file(target, ignored)) {
    // A device or pipe (/dev/stdout) must be written to, not replaced by a file.
    Descriptor out(target, O_WRONLY);
    if (!out.is_open()) fail(file, "write", errno);
    if (const int error = write_all(out.number(), content)) fail(file, "write", error);
    return;
  }
  const fs::path part = temporary_beside(target);
  int error = write_new_file(part, content, target);
  if (error == 0 && ::rename(part.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) {
    ::unlink(part.c_str());
    fail(file, "write", error);
  }
  sync_folder(target.parent_path());
}

void withdraw(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(fs::symlink_status(file, error))) return;
  fs::remove(file, error);
  if (error) fail(file, "remove", error.value());
  sync_folder(file.parent_path());
}

void write_json(const fs::path& file, const Json& value) {
  write_file(file, value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

StagedSet::StagedSet(fs::path folder, std::string index) : folder_(std::move(folder)), index_(std::move(index)) {
  std::error_code ignored;
  if (!folder_.has_filename()) folder_ = folder_.parent_path();
  fresh_ = !fs::exists(folder_, ignored) || is_replaceable(folder_);
  require_writable_folder(fresh_ ? folder_.parent_path() : folder_);
  aside_ = temporary_beside(fresh_ ? folder_ : folder_ / index_);
  std::error_code error;
  fs::create_directory(aside_, error);
  if (error) fail(aside_, "make the folder", error.value());
}

StagedSet::~StagedSet() {
  std::error_code ignored;
  fs::remove_all(aside_, ignored);
}

void StagedSet::publish(const std::vector<std::string>& replaced, const std::string& first) {
  if (fresh_) {
    std::error_code ignored;
    if (const auto old = fs::status(folder_, ignored); fs::exists(old))
      fs::permissions(aside_, old.permissions(), ignored);
    if (::rename(aside_.c_str(), folder_.c_str()) == 0) return sync_folder(folder_.parent_path());
    if (errno != EEXIST && errno != ENOTEMPTY) fail(folder_, "write", errno);  // else it has been made meanwhile
  }
  std::error_code error;
  fs::remove(folder_ / index_, error);
  if (error) fail(folder_ / index_, "remove", error.value());
  sync_folder(folder_);
  for (const std::string& name : replaced) fs::remove(folder_ / name, error);
  if (!first.empty()) rename_or_fail(aside_ / first, folder_ / first);
  std::vector<fs::path> names;
  for (const auto& entry : fs::directory_iterator(aside_)) names.push_back(entry.path().filename());
  for (const fs::path& name : names)
    if (name != index_) rename_or_fail(aside_ / name, folder_ / name);
  sync_folder(folder_);
  rename_or_fail(aside_ / index_, folder_ / index_);
  sync_folder(folder_);
}

void prove_writable(const fs::path& folder) {
  const fs::path wanted = folder.empty() ? fs::path(".") : folder;
  const fs::path probe = temporary_beside(wanted / "probe");
  const int outcome = write_new_file(probe, "");
  ::unlink(probe.c_str());
  if (outcome != 0) fail(wanted, "write into the folder", outcome);
}

void require_writable_folder(const fs::path& folder) {
  const fs::path wanted = folder.empty() ? fs::path(".") : folder;
  std::error_code error;
  fs::create_directories(wanted, error);
  if (error) fail(wanted, "make the folder", error.value());
  if (!fs::is_directory(wanted, error)) fail(wanted, "make the folder", ENOTDIR);
  prove_writable(wanted);
}

}  // namespace wheelhop
