/// \file
/// Result rows of a grid in a folder: computed by threads, shards or MPI ranks, kept through every kind of end.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/json.hpp"
#include "experiments/run/jobs.hpp"
#include "experiments/run/journal.hpp"
#include "experiments/run/ranks.hpp"

namespace wheelhop {

struct RowKey {
  std::size_t cell = 0;
  Index realisation = 0;
  auto operator<=>(const RowKey&) const = default;
};

/// One part of `of` equal ones of a grid, counted from 1.
struct Shard {
  Index number = 1, of = 1;
};

/// `WHAT.jsonl` and the `WHAT.I-of-N.jsonl` of shards in a folder, by name.
std::vector<std::filesystem::path> row_files(const std::filesystem::path& folder, const std::string& what);

/// As long as it lives, no process moves the rows of the folder into another file. Lines may be added.
FileLock hold_rows(const std::filesystem::path& folder);

/// Where the rows of a folder stand: lines of JSON with the members `cell` and `realisation`, in `rows.jsonl` and, by
/// the processes of other shards, `rows.I-of-N.jsonl`. Memory holds a few numbers a row, never the rows. Who reads a
/// folder that other processes may write holds hold_rows().
class RowIndex {
 public:
  /// Lines that are no whole row of this grid are passed over. @param is_own whether a row belongs to the grid
  RowIndex(std::filesystem::path folder, std::function<bool(const Json& row)> is_own);

  bool has(const RowKey& key) const { return places_.contains(key); }
  std::size_t size() const { return places_.size(); }

  /// Calls visit(key, line) for every row in ascending order of the keys.
  void for_each(const std::function<void(const RowKey&, const std::string& line)>& visit) const;

  /// Seconds that rows took, by key, as far as they are known.
  std::map<RowKey, double> seconds() const;

 protected:
  struct Place {
    std::size_t file, begin, length;
  };
  void scan();
  std::optional<RowKey> is_row(const std::string& line) const;  ///< of this grid

  std::filesystem::path folder_;
  std::function<bool(const Json& row)> is_own_;
  std::vector<std::filesystem::path> files_;
  std::map<RowKey, Place> places_;
};

/// The same, with rows added by this process.
class RowStore : public RowIndex {
 public:
  /// UserError if another process writes this shard's file.
  RowStore(std::filesystem::path folder, Shard shard, std::function<bool(const Json& row)> is_own);

  void add(const RowKey& key, const std::string& row, double seconds);

  /// Forces the rows to the disk if the last time is more than `after` ago (Journal::sync()).
  void sync(std::chrono::milliseconds after = {}) { rows_->sync(after); }

  /// Under a lock that other processes heed, reads again where rows stand. If there are `total`, puts all, sorted, into
  /// rows.jsonl, takes the files of the shards away once that file is found to hold all of them, and calls finish()
  /// under the lock. Nothing can be added afterwards. Where the file system knows no locks, one process at a time may
  /// merge.
  /// @return whether there are `total`
  bool merge(std::size_t total, const std::function<void()>& finish);

 private:
  std::size_t own_file_ = 0;
  std::unique_ptr<Journal> rows_, timing_;
};

/// Computes the rows `open` into the store, on threads and, if the program was started by mpirun or srun, on all ranks:
/// rank 0 hands rows out one at a time and writes, and computes as well. Which rank, thread or start makes a row does
/// not change it. @param compute pure; called from several threads
/// Ranks other than 0 call serve_rows() instead.
void compute_rows(RowStore& store, const std::vector<RowKey>& open, Ranks& ranks, const JobOptions& options,
                  const std::function<std::string(const RowKey&)>& compute);

/// Ranks other than 0: computes what rank 0 asks for until end_rows().
void serve_rows(Ranks& ranks, const std::function<std::string(const RowKey&)>& compute);

/// Rank 0: lets the other ranks go.
void end_rows(Ranks& ranks);

}  // namespace wheelhop
