// What long commands owe: whole lines through every end, one writer, each job once, errors that come out.
#include <fmt/format.h>
#include <sys/resource.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <fstream>
#include <set>
#include <thread>

#include "core/base/files.hpp"
#include "core/base/status.hpp"
#include "experiments/run/journal.hpp"
#include "experiments/run/rows.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using namespace wheelhop::test;
using Catch::Contains;

namespace {

std::string line_of(std::size_t cell, Index realisation) {
  return Json{{"cell", cell}, {"realisation", realisation}, {"value", 0.1 * static_cast<double>(cell)}}.dump();
}

bool any(const Json&) { return true; }

}  // namespace

TEST_CASE("a journal cuts off the part of a line that a kill left, wherever it was torn") {
  const std::string first = line_of(0, 0), second = line_of(1, 0);
  const std::string whole = first + "\n" + second + "\n";
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    const Folder folder;
    const auto file = folder / "lines";
    std::ofstream(file) << whole.substr(0, cut);
    {
      Journal journal(file);
      CHECK(journal.dropped_part() == (cut > 0 && whole[cut - 1] != '\n'));
      journal.append("third");
      CHECK_THROWS_AS(Journal(file), UserError);  // one writer
    }
    std::string expected;
    if (cut > first.size()) expected += first + "\n";
    if (cut == whole.size()) expected += second + "\n";
    CHECK(read_file(file) == expected + "third\n");
  }
}

TEST_CASE("rows: kept over processes and shards, sorted and each once after the merge") {
  const Folder folder;
  {
    RowStore one({folder.path()}, {1, 2}, any);
    one.add({1, 0}, line_of(1, 0), 1);
    one.add({0, 1}, line_of(0, 1), 2);
    RowStore two({folder.path()}, {2, 2}, any);
    CHECK(two.has({1, 0}));
    two.add({0, 0}, line_of(0, 0), 3);
    two.add({1, 0}, line_of(1, 0), 3);  // a second time, as after a late start
    CHECK_FALSE(two.merge(4, [] { FAIL("not all rows are there"); }));
  }
  RowStore all({folder.path()}, {}, any);
  CHECK(all.size() == 3);
  all.add({1, 1}, line_of(1, 1), 4);
  bool finished = false;
  CHECK(all.merge(4, [&] { finished = true; }));
  CHECK(finished);
  CHECK(read_file(folder / "rows.jsonl") ==
        line_of(0, 0) + "\n" + line_of(0, 1) + "\n" + line_of(1, 0) + "\n" + line_of(1, 1) + "\n");
  CHECK_FALSE(std::filesystem::exists(folder / "rows.1-of-2.jsonl"));
  CHECK(all.seconds().at({0, 1}) == 2);
}

TEST_CASE("a journal that could not take a line, nor cut off its part, takes no other") {
  if (!std::filesystem::exists("/dev/full")) {
    WARN("no /dev/full here: a full disk is not tested");
    return;
  }
  Journal journal("/dev/full");
  for (int attempt = 0; attempt < 2; ++attempt)
    CHECK_THROWS_WITH(journal.append("a line"), Contains("/dev/full") && Contains("start again"));
}

TEST_CASE("who starts while rows are merged waits, and finds all of them in the merged file") {
  const Folder folder;
  RowStore store(folder.path(), {1, 2}, any);
  store.add({1, 0}, line_of(1, 0), 1);
  store.add({0, 0}, line_of(0, 0), 1);
  std::atomic<bool> opened = false;
  std::thread other;
  CHECK(store.merge(2, [&] {
    other = std::thread([&] {
      const RowStore late(folder.path(), {}, any);
      opened = true;
      CHECK(late.size() == 2);
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    CHECK_FALSE(opened);
  }));
  other.join();
  CHECK(opened);
}

TEST_CASE("files of users that look like those of shards are neither read nor taken away") {
  const Folder folder;
  const std::string name = "rows.best-of-all.jsonl";
  std::ofstream(folder / name) << line_of(0, 0) << "\n";
  RowStore store(folder.path(), {}, any);
  CHECK(store.size() == 0);
  store.add({0, 0}, line_of(0, 0), 1);
  CHECK(store.merge(1, [] {}));
  CHECK(std::filesystem::exists(folder / name));
}

TEST_CASE("more shards than a process may have open files are read and merged") {
  const Folder folder;
  const Index shards = 300;
  for (Index i = 1; i <= shards; ++i)
    std::ofstream(folder / fmt::format("rows.{}-of-{}.jsonl", i, shards))
        << line_of(static_cast<std::size_t>(i), 0) << "\n";
  rlimit before = {}, few = {};
  REQUIRE(::getrlimit(RLIMIT_NOFILE, &before) == 0);
  few = before;
  few.rlim_cur = 200;
  REQUIRE(::setrlimit(RLIMIT_NOFILE, &few) == 0);
  RowStore store(folder.path(), {}, any);
  CHECK(store.merge(static_cast<std::size_t>(shards), [] {}));
  ::setrlimit(RLIMIT_NOFILE, &before);
  CHECK(row_files(folder.path(), "rows").size() == 1);
}

TEST_CASE("lines that are no rows are passed over: text, other JSON, keys that are no whole numbers") {
  const Folder folder;
  std::ofstream(folder / "rows.jsonl") << "words\n[1]\n{}\n"
                                       << R"({"cell": "a", "realisation": 0})"
                                       << "\n"
                                       << R"({"cell": -1, "realisation": 0})"
                                       << "\n"
                                       << R"({"cell": 0.5, "realisation": 0})"
                                       << "\n"
                                       << R"({"cell": 0, "realisation": null})"
                                       << "\n"
                                       << line_of(2, 1) << "\n";
  const RowIndex rows(folder.path(), any);
  CHECK(rows.size() == 1);
  CHECK(rows.has({2, 1}));
}

TEST_CASE("run_jobs does every job once, results one at a time, whatever the number of threads") {
  for (const Index jobs : {1, 2, 7}) {
    std::multiset<std::size_t> done;
    bool inside = false, overlapped = false;
    run_jobs(100, {jobs, "test", "", true}, [&](std::size_t i) -> std::function<void()> {
      return [&, i] {
        overlapped = overlapped || std::exchange(inside, true);
        done.insert(i);
        inside = false;
      };
    });
    CHECK_FALSE(overlapped);
    CHECK(done.size() == 100);
    for (std::size_t i = 0; i < 100; ++i) CHECK(done.count(i) == 1);
  }
}

TEST_CASE("what is done meanwhile is done while jobs run, and ends the loop by what it throws") {
  std::atomic<int> calls = 0;
  JobOptions options{1, "test", "", true};
  options.meanwhile = [&] { ++calls; };
  run_jobs(1, options, [&](std::size_t) -> std::function<void()> {
    while (calls < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return {};
  });
  options.meanwhile = [] { throw UserError("no"); };
  std::size_t started = 0;
  CHECK_THROWS_AS(run_jobs(1000, options,
                           [&](std::size_t) -> std::function<void()> {
                             ++started;
                             std::this_thread::sleep_for(std::chrono::milliseconds(20));
                             return {};
                           }),
                  UserError);
  CHECK(started < 1000);
}

TEST_CASE("what a job or its continuation throws ends the loop and comes out") {
  for (const bool in_job : {true, false}) {
    std::size_t started = 0;
    CHECK_THROWS_AS(run_jobs(1000, {1, "test", "", true},
                             [&](std::size_t i) -> std::function<void()> {
                               ++started;
                               if (in_job && i == 3) throw UserError("no");
                               return [&, i] {
                                 if (!in_job && i == 3) throw UserError("no");
                               };
                             }),
                    UserError);
    CHECK(started == 4);
  }
}
