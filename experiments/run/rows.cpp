#include "experiments/run/rows.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <fstream>
#include <mutex>
#include <optional>
#include <regex>
#include <thread>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/run/progress.hpp"
#include "experiments/run/stop.hpp"

namespace wheelhop {
namespace fs = std::filesystem;
namespace {

std::string file_name(const char* what, Shard shard) {
  return shard.of == 1 ? fmt::format("{}.jsonl", what) : fmt::format("{}.{}-of-{}.jsonl", what, shard.number, shard.of);
}

fs::path lock_file(const fs::path& folder) { return folder / ".lock"; }

/// The key of a line, if it is one of an object with `cell` and `realisation`.
std::optional<RowKey> key_of(const Json& row) {
  if (!row.is_object() || !row.contains("cell") || !row["cell"].is_number_unsigned() || !row.contains("realisation") ||
      !row["realisation"].is_number_unsigned())
    return {};
  return RowKey{row["cell"].get<std::size_t>(), row["realisation"].get<Index>()};
}

/// Reads parts of files, with few of them open at once: a folder may have more shards than a process may have files.
class PartReader {
 public:
  std::string read(const fs::path& file, std::size_t begin, std::size_t length) {
    if (!streams_.contains(file) && streams_.size() >= kMostOpen) streams_.clear();
    std::ifstream& stream = streams_.try_emplace(file, file, std::ios::binary).first->second;
    std::string part(length, '\0');
    stream.clear();
    stream.seekg(static_cast<std::streamoff>(begin));
    stream.read(part.data(), static_cast<std::streamsize>(length));
    // Rows are put together from these parts and their files removed: none may be made up.
    if (stream.gcount() != static_cast<std::streamsize>(length))
      throw UserError(file.string() + ": a row cannot be read again; nothing was removed, start again to go on");
    return part;
  }

 private:
  static constexpr std::size_t kMostOpen = 100;
  std::map<fs::path, std::ifstream> streams_;
};

/// UserError if the file did not reach the disk.
void sync_file(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced) throw UserError(file.string() + ": cannot be written; the rows are kept, start again to go on");
}

}  // namespace

std::vector<fs::path> row_files(const fs::path& folder, const std::string& what) {
  const std::regex pattern(what + R"((\.[0-9]+-of-[0-9]+)?\.jsonl)");
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && std::regex_match(entry.path().filename().string(), pattern))
      files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

FileLock hold_rows(const fs::path& folder) { return FileLock(lock_file(folder), FileLock::Kind::shared); }

RowIndex::RowIndex(fs::path folder, std::function<bool(const Json&)> is_own)
    : folder_(std::move(folder)), is_own_(std::move(is_own)) {
  scan();
}

void RowIndex::scan() {
  files_ = row_files(folder_, "rows");
  places_.clear();
  for (std::size_t f = 0; f < files_.size(); ++f)
    for_each_line(files_[f], [&](const std::string& line, std::size_t begin) {
      if (const std::optional<RowKey> key = is_row(line)) places_.try_emplace(*key, Place{f, begin, line.size()});
    });
}

std::optional<RowKey> RowIndex::is_row(const std::string& line) const {
  const Json row = Json::parse(line, nullptr, false);
  const std::optional<RowKey> key = key_of(row);
  return key && is_own_(row) ? key : std::nullopt;
}

RowStore::RowStore(fs::path folder, Shard shard, std::function<bool(const Json&)> is_own)
    : RowIndex(folder, std::move(is_own)) {
  const FileLock lock(lock_file(folder));  // a merge may be moving the rows
  rows_ = std::make_unique<Journal>(folder / file_name("rows", shard));
  timing_ = std::make_unique<Journal>(folder / file_name("timing", shard));
  scan();
  own_file_ = static_cast<std::size_t>(std::find(files_.begin(), files_.end(), rows_->file()) - files_.begin());
}

void RowStore::add(const RowKey& key, const std::string& row, double seconds) {
  places_[key] = {own_file_, rows_->append(row), row.size()};
  timing_->append(
      fmt::format("{{\"cell\":{},\"realisation\":{},\"seconds\":{:.6g}}}", key.cell, key.realisation, seconds));
}

void RowIndex::for_each(const std::function<void(const RowKey&, const std::string&)>& visit) const {
  PartReader reader;
  for (const auto& [key, at] : places_) visit(key, reader.read(files_[at.file], at.begin, at.length));
}

bool RowStore::merge(std::size_t total, const std::function<void()>& finish) {
  const FileLock lock(lock_file(folder_));
  rows_->sync();
  scan();
  if (places_.size() < total) return false;
  const fs::path sorted = folder_ / "rows.jsonl", beside = temporary_beside(sorted);
  {
    std::ofstream stream(beside, std::ios::binary | std::ios::trunc);
    for_each([&](const RowKey&, const std::string& line) { stream << line << '\n'; });
    if (!stream.flush()) {
      fs::remove(beside);
      throw UserError(sorted.string() + ": cannot be written; the rows are kept, start again to go on");
    }
  }
  sync_file(beside);
  std::size_t written = 0;
  for_each_line(beside, [&](const std::string& line, std::size_t) { written += is_row(line).has_value(); });
  if (written != places_.size())
    throw UserError(beside.string() + ": holds other rows than were written; nothing was removed, start again");
  fs::rename(beside, sorted);
  for (const fs::path& file : files_)
    if (file != sorted) fs::remove(file);
  scan();
  finish();
  rows_.reset();  // lets others write only now: its file is no longer the one of that name
  timing_.reset();
  return true;
}

std::map<RowKey, double> RowIndex::seconds() const {
  std::map<RowKey, double> all;
  for (const fs::path& file : row_files(folder_, "timing"))
    for_each_line(file, [&](const std::string& line, std::size_t) {
      const Json entry = Json::parse(line, nullptr, false);
      const std::optional<RowKey> key = key_of(entry);
      if (key && entry.contains("seconds") && entry["seconds"].is_number()) all[*key] = entry["seconds"].get<double>();
    });
  return all;
}

namespace {

/// After a power failure the rows of about so long are lost.
constexpr std::chrono::milliseconds kSyncAfter{1000};

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::int64_t packed(const RowKey& key) {
  return (static_cast<std::int64_t>(key.cell) << 32) | static_cast<std::int64_t>(key.realisation);
}

RowKey unpacked(std::int64_t work) {
  return {static_cast<std::size_t>(work >> 32), static_cast<Index>(work & 0xffffffff)};
}

/// Rank 0 of several: one thread computes, this one speaks with the other ranks.
void compute_over_ranks(RowStore& store, const std::vector<RowKey>& open, Ranks& ranks, const JobOptions& options,
                        const std::function<std::string(const RowKey&)>& compute) {
  const StopSignals signals;
  Progress progress(options.what, static_cast<long>(open.size()), options.quiet);
  std::mutex mutex;
  std::exception_ptr failure;
  std::size_t next = 0, done = 0;
  const auto take = [&]() -> const RowKey* {
    const std::lock_guard lock(mutex);
    return next < open.size() && !failure ? &open[next++] : nullptr;
  };
  const auto keep = [&](const RowKey& key, const std::string& row, double seconds) {
    const std::lock_guard lock(mutex);
    store.add(key, row, seconds);
    ++done;
    progress.advance();
  };
  const std::jthread own([&] {
    try {
      while (const RowKey* const key = take()) {
        const auto start = std::chrono::steady_clock::now();
        const std::string row = compute(*key);
        keep(*key, row, since(start));
      }
    } catch (...) {
      const std::lock_guard lock(mutex);
      failure = std::current_exception();
    }
  });
  std::vector<const RowKey*> given(static_cast<std::size_t>(ranks.size()), nullptr);
  std::vector<int> idle = ranks.waiting;
  const auto all_done = [&] {
    const std::lock_guard lock(mutex);
    if (failure) std::rethrow_exception(failure);
    return done == open.size();
  };
  while (!all_done()) {
    {
      const std::lock_guard lock(mutex);
      try {
        store.sync(kSyncAfter);
      } catch (...) {
        failure = std::current_exception();
      }
    }
    if (const int signal = StopSignals::received(); signal != 0) {
      const std::lock_guard lock(mutex);
      stop_program(signal, options.go_on);
    }
    while (!idle.empty()) {
      given[static_cast<std::size_t>(idle.back())] = take();
      if (!given[static_cast<std::size_t>(idle.back())]) break;
      ranks.assign(idle.back(), packed(*given[static_cast<std::size_t>(idle.back())]));
      idle.pop_back();
    }
    ranks.waiting = idle;
    if (const std::optional<Delivery> delivery = ranks.poll()) {
      const auto from = static_cast<std::size_t>(delivery->from);
      idle.push_back(delivery->from);
      ranks.waiting = idle;  // whatever happens below, end_rows() knows who waits
      if (delivery->has_result) {
        const std::size_t space = delivery->result.find(' ');
        try {
          keep(*given[from], delivery->result.substr(space + 1), std::stod(delivery->result.substr(0, space)));
        } catch (...) {
          const std::lock_guard guard(mutex);
          failure = std::current_exception();
        }
      }
    } else {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  }
}

}  // namespace

void compute_rows(RowStore& store, const std::vector<RowKey>& open, Ranks& ranks, const JobOptions& options,
                  const std::function<std::string(const RowKey&)>& compute) {
  if (open.empty()) return;
  if (ranks.size() > 1) return compute_over_ranks(store, open, ranks, options, compute);
  JobOptions with_sync = options;
  with_sync.meanwhile = [&store] { store.sync(kSyncAfter); };
  run_jobs(open.size(), with_sync, [&](std::size_t i) -> std::function<void()> {
    const auto start = std::chrono::steady_clock::now();
    std::string row = compute(open[i]);
    const double seconds = since(start);
    return [&store, &key = open[i], row = std::move(row), seconds] { store.add(key, row, seconds); };
  });
}

void serve_rows(Ranks& ranks, const std::function<std::string(const RowKey&)>& compute) {
  std::optional<std::string> result;
  for (std::int64_t work; (work = ranks.ask(result)) >= 0;) {
    const auto start = std::chrono::steady_clock::now();
    const std::string row = compute(unpacked(work));
    result = fmt::format("{} {}", since(start), row);
  }
}

void end_rows(Ranks& ranks) {
  for (int left = ranks.size() - 1; left > 0;) {
    if (ranks.waiting.empty()) {
      if (const std::optional<Delivery> delivery = ranks.poll())
        ranks.waiting.push_back(delivery->from);
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      continue;
    }
    ranks.assign(ranks.waiting.back(), -1);
    ranks.waiting.pop_back();
    --left;
  }
}

}  // namespace wheelhop
