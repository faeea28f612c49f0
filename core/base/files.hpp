/// \file
/// Files as users meet them: whole reads, all-or-nothing writes, clear messages.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/json.hpp"

namespace wheelhop {

/// What reading a file may cost where the size of the file does not say it. Judgements, far above what records of
/// measurements need; infinite values lift them.
struct ReadLimits {
  double stream_bytes = 64.0 * (1 << 20);    ///< most that is taken from a pipe or device, which tells no size
  double silence_s = 60;                     ///< longest wait for the next bytes of a pipe, or for who writes it
  double unpacked_ratio = 16;                ///< most bytes that a packed byte may stand for (CSV files: 2 to 10) ...
  double unpacked_bytes = 64.0 * (1 << 20);  ///< ... beyond so many

  /// Most bytes that a packed file or variable of so many bytes may hold.
  double unpacked_from(std::size_t packed) const {
    return unpacked_bytes + unpacked_ratio * static_cast<double>(packed);
  }
};

/// Those of this program; to be changed before anything is read.
ReadLimits& read_limits();

/// What messages add where a limit is met: how to lift it.
inline constexpr const char* how_to_lift = "if it is meant to be so, start again with --no-limits";

/// UserError if there is nothing of that name, or a folder; it tells what the folder holds.
void require_file(const std::filesystem::path& file);

/// Whole content of a file. UserError naming the file if it does not exist, is a folder, or is a pipe or device that
/// meets a limit; MachineError if it cannot be read, or is larger than the memory.
std::string read_file(const std::filesystem::path& file);

/// Writes beside the target, fsyncs, renames: readers see the old file or the new one, never a part. The new one has
/// the mode and, as far as that is permitted, the owner of the old one. The leftover is removed on failure (disk full,
/// not writable), which throws MachineError naming file and reason.
void write_file(const std::filesystem::path& file, const std::string& content);

/// Takes away a file of an earlier run by which others are found, before those are replaced one by one: so whoever
/// finds it finds what belongs to it. A link or device stays. MachineError if it cannot be removed.
void withdraw(const std::filesystem::path& file);

/// `write_file` of the JSON with two-space indent and a final newline. Doubles carry 17 significant digits at most.
void write_json(const std::filesystem::path& file, const Json& value);

/// A name beside `target` that no other process or thread uses, hidden and ending in `.part`, for what is not whole
/// yet.
std::filesystem::path temporary_beside(const std::filesystem::path& target);

/// Removes from a folder what has such a name and belonged to a process of this machine that has ended.
void remove_leftovers(const std::filesystem::path& folder);

/// Files that appear in a folder together or not at all, whenever the process ends. They are written aside and put into
/// place by publish(): a folder that was not there or was empty by one renaming, one that held files with its index,
/// the file by which the set is found, taken away first and put back last. So who finds the index finds one set whole.
class StagedSet {
 public:
  /// Makes what is above the folder if needed. MachineError if it cannot be written to.
  StagedSet(std::filesystem::path folder, std::string index);
  ~StagedSet();  ///< removes what was not published
  StagedSet(const StagedSet&) = delete;
  StagedSet& operator=(const StagedSet&) = delete;

  const std::filesystem::path& path() const { return aside_; }  ///< where to write, an empty folder

  /// @param replaced files of an earlier set, relative to the folder, to be removed. Others that stand there stay.
  /// @param first file that is put into place before the others: the one that tells the next call what to replace
  void publish(const std::vector<std::string>& replaced = {}, const std::string& first = "");

 private:
  std::filesystem::path folder_, aside_;
  std::string index_;
  bool fresh_;  ///< one renaming puts the whole folder into place
};

/// Proves that files can be made in a folder that exists, by one that is there for a moment. UserError with the reason.
void prove_writable(const std::filesystem::path& folder);

/// Makes the folder (and its parents) if needed and proves it writable before any computation starts.
/// UserError if a parent is a file, or writing is not permitted.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace wheelhop
