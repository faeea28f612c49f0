#include "experiments/run/file_uses.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include "core/base/files.hpp"
#include "core/base/json.hpp"
#include "core/base/status.hpp"

namespace wheelhop {
namespace {

namespace fs = std::filesystem;

/// A path as it stands for one place: absolute, links followed as far as they lead, without dots or a slash at the end.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  fs::path plain = fs::weakly_canonical(fs::absolute(path, error), error);
  if (error) plain = fs::absolute(path, error).lexically_normal();
  return plain.has_filename() ? plain : plain.parent_path();
}

/// Folders may be the same under two paths that no link joins (a mount); files under two names (hard links) are not,
/// since a new file takes the place of one name only.
bool same_place(const fs::path& a, const fs::path& b) {
  const fs::path one = resolved(a), other = resolved(b);
  if (one == other) return true;
  std::error_code error;
  return one.filename() == other.filename() && fs::equivalent(one.parent_path(), other.parent_path(), error) && !error;
}

/// There, and neither file nor folder: a device or pipe, to which content is added.
bool is_stream(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status);
}

/// The folder itself, or the nearest one above it that is there.
fs::path nearest_existing(fs::path folder) {
  std::error_code error;
  folder = resolved(folder);
  while (!fs::exists(fs::status(folder, error)) && folder.has_relative_path()) folder = folder.parent_path();
  return folder;
}

/// Strings that members `file`, `plant` and `base` hold anywhere in a value.
void collect_names(const Json& value, std::vector<std::string>& names) {
  if (!value.is_structured()) return;
  for (const auto& [key, member] : value.items()) {
    if (member.is_string() && value.is_object() && (key == "file" || key == "plant" || key == "base"))
      names.push_back(member.get<std::string>());
    collect_names(member, names);
  }
}

[[noreturn]] void refuse_use(const std::string& word, const fs::path& path, const std::string& why) {
  throw UserError(fmt::format("{}: {}: {}", word, path.string(), why));
}

}  // namespace

FileUses& FileUses::reads(const std::string& word, const fs::path& path) {
  if (!path.empty()) reads_.push_back({word, path});
  return *this;
}

FileUses& FileUses::reads_named(const std::string& word, const fs::path& json) {
  reads(word, json);
  std::error_code error;
  if (!fs::is_regular_file(json, error)) return *this;
  std::vector<std::string> names;
  try {
    collect_names(parse_json(read_file(json), json.string()), names);
  } catch (const UserError&) {
    return *this;
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  for (const std::string& name : names) {
    const fs::path named = json.parent_path() / name;
    const bool known = std::any_of(reads_.begin(), reads_.end(), [&](const Use& use) { return use.path == named; });
    if (known || !fs::is_regular_file(named, error)) continue;
    const std::string said = fmt::format("a file that {} names", json.string());
    if (named.extension() == ".json")
      reads_named(said, named);
    else
      reads(said, named);
  }
  return *this;
}

FileUses& FileUses::writes(const std::string& word, const fs::path& file) {
  writes_.push_back({word, file});
  return *this;
}

FileUses& FileUses::writes_folder(const std::string& word, const fs::path& folder, const std::vector<fs::path>& files) {
  folders_.push_back({word, folder});
  for (const fs::path& file : files) writes_.push_back({word, folder / file});
  return *this;
}

void FileUses::check_file(const Use& use) const {
  if (use.path.empty()) refuse_use(use.word, use.path, "expected the name of a file, found an empty one");
  std::error_code error;
  const fs::file_status status = fs::status(use.path, error);
  if (error && status.type() == fs::file_type::none)
    refuse_use(use.word, use.path, fmt::format("cannot be written: {}", error.message()));
  if (!use.path.has_filename() || fs::is_directory(status))
    refuse_use(use.word, use.path, "expected the name of a file, found a folder");
  if (is_stream(use.path)) {
    if (::access(use.path.c_str(), W_OK) != 0)
      refuse_use(use.word, use.path, fmt::format("cannot be written: {}", std::generic_category().message(errno)));
    return;
  }
  for (const Use& other : reads_)
    if (same_place(use.path, other.path))
      refuse_use(use.word, use.path,
                 fmt::format("expected a file that is not read, found {}{}, which would be lost; choose another name",
                             other.word, other.path == use.path ? "" : fmt::format(" ({})", other.path.string())));
  for (const Use& other : writes_)
    if (&other != &use && same_place(use.path, other.path))
      refuse_use(use.word, use.path,
                 fmt::format("expected a file of its own, found {}, which is written as well; choose another name",
                             other.word));
  const fs::path parent = resolved(use.path).parent_path();
  for (const Use& folder : folders_) {
    const fs::path outer = resolved(folder.path);
    if (std::mismatch(outer.begin(), outer.end(), parent.begin(), parent.end()).first == outer.end()) return;
  }
  if (!fs::exists(fs::status(parent, error)))
    refuse_use(use.word, use.path,
               fmt::format("expected a folder {} to write it into, found none; make it first", parent.string()));
  if (!fs::is_directory(parent, error))
    refuse_use(use.word, use.path, fmt::format("expected {} to be a folder, found a file", parent.string()));
  prove_writable(parent);
}

void FileUses::check_folder(const Use& use) const {
  if (use.path.empty()) refuse_use(use.word, use.path, "expected the name of a folder, found an empty one");
  for (const Use& other : reads_)
    if (same_place(use.path, other.path))
      refuse_use(use.word, use.path, fmt::format("expected a folder that is not read, found {}", other.word));
  for (const Use& other : folders_)
    if (&other != &use && same_place(use.path, other.path))
      refuse_use(use.word, use.path, fmt::format("expected a folder of its own, found {}", other.word));
  const fs::path existing = nearest_existing(use.path);
  std::error_code error;
  if (!fs::is_directory(existing, error))
    refuse_use(use.word, use.path, fmt::format("expected {} to be a folder, found a file", existing.string()));
  prove_writable(existing);
}

void FileUses::check() const {
  for (const Use& folder : folders_) check_folder(folder);
  for (const Use& file : writes_) check_file(file);
  for (const Use& folder : folders_) {
    remove_leftovers(folder.path);
    remove_leftovers(resolved(folder.path).parent_path());  // of the folder itself
  }
  for (const Use& file : writes_)
    if (!file.path.empty() && !is_stream(file.path)) remove_leftovers(resolved(file.path).parent_path());
}

}  // namespace wheelhop
