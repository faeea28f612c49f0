/// \file
/// Files as users meet them: whole reads, all-or-nothing writes, clear messages.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/json.hpp"

namespace wheelhop {

/// Whole content of a file. UserError naming the file if it does not exist or is a folder, MachineError if it cannot be
/// read.
std::string read_file(const std::filesystem::path& file);

/// Writes beside the target, fsyncs, renames: readers see the old file or the new one, never a part. The leftover is
/// removed on failure (disk full, not writable), which throws MachineError naming file and reason.
void write_file(const std::filesystem::path& file, const std::string& content);

/// `write_file` of the JSON with two-space indent and a final newline. Doubles carry 17 significant digits at most.
void write_json(const std::filesystem::path& file, const Json& value);

/// A name beside `target` that no other process or thread uses, hidden and ending in `.part`, for what is not whole
/// yet.
std::filesystem::path temporary_beside(const std::filesystem::path& target);

/// Removes from a folder what has such a name and belonged to a process of this machine that has ended.
void remove_leftovers(const std::filesystem::path& folder);

/// Proves that files can be made in a folder that exists, by one that is there for a moment. UserError with the reason.
void prove_writable(const std::filesystem::path& folder);

/// Makes the folder (and its parents) if needed and proves it writable before any computation starts.
/// UserError if a parent is a file, or writing is not permitted.
void require_writable_folder(const std::filesystem::path& folder);

}  // namespace wheelhop
