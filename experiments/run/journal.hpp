/// \file
/// A file of lines that survives being killed: lines are appended whole, one process writes at a time.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace wheelhop {

/// Appends lines to a file. What stands after the last line break when it is opened, the part of a line that a killed
/// process left, is cut off. After SIGKILL all lines are there; after a power failure those that sync() forced to the
/// disk.
class Journal {
 public:
  /// UserError if the file cannot be written, or another process has it open.
  explicit Journal(std::filesystem::path file);
  ~Journal();  ///< syncs; a failure there is not told
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// @param line without a line break
  /// @return where the line begins, in bytes. UserError if it cannot be written (disk full): the file then holds the
  /// lines before it, or, if not even the new part could be cut off, nothing can be appended any more.
  std::size_t append(std::string_view line);

  /// Forces the lines to the disk if there are new ones and the last time is more than `after` ago. UserError if the
  /// disk does not take them.
  void sync(std::chrono::milliseconds after = {});

  bool dropped_part() const { return dropped_part_; }  ///< the file ended in a part of a line
  const std::filesystem::path& file() const { return file_; }

 private:
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::size_t size_ = 0, synced_size_ = 0;
  bool dropped_part_ = false, broken_ = false;
  std::chrono::steady_clock::time_point synced_ = std::chrono::steady_clock::now();
};

/// Calls visit(line, where it begins in bytes) for every whole line of a file; none if there is no file.
void for_each_line(const std::filesystem::path& file,
                   const std::function<void(const std::string& line, std::size_t begin)>& visit);

/// Holds a lock on a file as long as it lives; waits for whoever has it. Where the file system knows no locks it holds
/// none.
class FileLock {
 public:
  enum class Kind {
    alone,   ///< one holder; the file is made if needed
    shared,  ///< any number of holders; a file that is not there is not locked
  };
  explicit FileLock(const std::filesystem::path& file, Kind kind = Kind::alone);
  ~FileLock();
  FileLock(const FileLock&) = delete;
  FileLock& operator=(const FileLock&) = delete;

 private:
  int descriptor_;
};

}  // namespace wheelhop
