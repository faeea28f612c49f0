/// \file
/// What a command reads and writes, checked before it computes anything.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wheelhop {

/// The files of one call of a command. Each is given with the word that the user knows it by ("--out"), for messages.
class FileUses {
 public:
  /// A file or folder that is read.
  FileUses& reads(const std::string& word, const std::filesystem::path& path);

  /// A JSON file that is read, and the files that it names: the members `file`, `plant` and `base` anywhere in it,
  /// relative to its folder, and what those name in turn. A file that does not read is left to its reader.
  FileUses& reads_named(const std::string& word, const std::filesystem::path& json);

  /// A file that will be written.
  FileUses& writes(const std::string& word, const std::filesystem::path& file);

  /// A folder that will be made, with its parents, where it is not there. @param files what will be written inside,
  /// relative to it
  FileUses& writes_folder(const std::string& word, const std::filesystem::path& folder,
                          const std::vector<std::filesystem::path>& files = {});

  /// UserError naming word and path if a file to write is one that is read or another one to write (also by a link or
  /// by another way to the same place), is a folder, or stands in a folder that is not there or cannot be written to;
  /// if a folder to write is one that is read, is no folder, or cannot be made or written to. Makes nothing, but
  /// clears the folders of what processes that were killed left half written. Devices and pipes may be written to more
  /// than once.
  void check() const;

 private:
  struct Use {
    std::string word;
    std::filesystem::path path;
  };
  void check_file(const Use& use) const;
  void check_folder(const Use& use) const;

  std::vector<Use> reads_, writes_, folders_;
};

}  // namespace wheelhop
