// What a command may write: nothing that it reads, nothing twice, and only where it can.
#include "experiments/run/file_uses.hpp"

#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "core/base/files.hpp"
#include "core/base/random.hpp"
#include "core/base/status.hpp"
#include "tests/support/folder.hpp"

using namespace wheelhop;
using Catch::Contains;
namespace fs = std::filesystem;

namespace {

constexpr Index kPlaces = 6;

/// A folder with files f0 to f5, of which the last is in a folder of its own, and links to all of them.
void make_places(const test::Folder& folder) {
  fs::create_directory(folder / "in");
  fs::create_directory(folder / "links");
  fs::create_directory_symlink(folder / "in", folder / "way");
  for (Index i = 0; i < kPlaces; ++i) {
    write_file(folder / fmt::format("in/f{}", i), "kept");
    fs::create_symlink(folder / fmt::format("in/f{}", i), folder / fmt::format("links/l{}", i));
  }
}

/// One of several ways to the same file.
fs::path way_to(const test::Folder& folder, Index file, Random& random) {
  switch (random.integer(5)) {
    case 0: return folder / fmt::format("in/f{}", file);
    case 1: return folder / fmt::format("links/l{}", file);
    case 2: return folder / fmt::format("way/f{}", file);
    case 3: return folder / fmt::format("links/../in/./f{}", file);
    default: return fs::relative(folder / fmt::format("in/f{}", file));
  }
}

}  // namespace

TEST_CASE("files are refused exactly where one that is written is read or written as well, whatever the way to it") {
  const test::Folder folder;
  make_places(folder);
  Random random(11, Stream::parameters);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    FileUses uses;
    std::vector<Index> read, written;
    for (Index i = 1 + random.integer(2); i > 0; --i) {
      read.push_back(random.integer(kPlaces));
      uses.reads("an input", way_to(folder, read.back(), random));
    }
    for (Index i = 1 + random.integer(2); i > 0; --i) {
      written.push_back(random.integer(kPlaces));
      uses.writes("an output", way_to(folder, written.back(), random));
    }
    bool clash = written.size() == 2 && written[0] == written[1];
    for (const Index in : read)
      for (const Index out : written) clash = clash || in == out;
    CAPTURE(trial, clash);
    if (clash)
      CHECK_THROWS_WITH(uses.check(), Contains("an output") && Contains("choose another name"));
    else
      CHECK_NOTHROW(uses.check());
    refused += clash;
  }
  CHECK(refused > 50);
  CHECK(refused < 250);
  for (Index i = 0; i < kPlaces; ++i) CHECK(read_file(folder / fmt::format("in/f{}", i)) == "kept");
}

TEST_CASE("files that a JSON file names are read as well, at any depth and over several files") {
  const test::Folder folder;
  fs::create_directory(folder / "sub");
  write_json(folder / "sweep.json", {{"base", "sub/base.json"}, {"note", "free.csv"}});
  write_json(folder / "sub/base.json",
             {{"data", {{{"file", "a.csv"}}}}, {"plant", "plant.json"}, {"base", "../sweep.json"}});
  for (const char* name : {"sub/a.csv", "sub/plant.json", "free.csv"}) write_file(folder / name, "[");
  const auto refused = [&](const char* out) {
    try {
      FileUses().reads_named("CONFIG", folder / "sweep.json").writes("--out", folder / out).check();
    } catch (const UserError& error) {
      CHECK_THAT(error.what(), Contains(out));
      return true;
    }
    return false;
  };
  for (const char* name : {"sweep.json", "sub/base.json", "sub/a.csv", "sub/plant.json"}) CHECK(refused(name));
  for (const char* name : {"free.csv", "sub/new.csv", "a.csv"}) CHECK_FALSE(refused(name));
}

TEST_CASE("a place that cannot be written is told before, and nothing is made") {
  const test::Folder folder;
  write_file(folder / "file", "");
  fs::create_directory(folder / "there");
  const auto file = [](const fs::path& path) { FileUses().writes("--out", path).check(); };
  const auto into = [](const fs::path& path) { FileUses().writes_folder("--out", path, {"a", "b/c"}).check(); };
  CHECK_THROWS_WITH(file(folder / "there"), Contains("--out") && Contains("found a folder"));
  CHECK_THROWS_WITH(file(folder / "new/"), Contains("found a folder"));
  CHECK_THROWS_WITH(file(""), Contains("found an empty one"));
  CHECK_THROWS_WITH(file(folder / "absent/x.json"), Contains("absent") && Contains("make it first"));
  CHECK_THROWS_WITH(file(folder / "file/x.json"), Contains("found a file"));
  CHECK_THROWS_WITH(file("/proc/wheelhop_test"), Contains("cannot write into the folder"));
  CHECK_THROWS_WITH(file(folder / std::string(300, 'x')), Contains("File name too long"));
  CHECK_NOTHROW(file(folder / "there/x.json"));
  CHECK_NOTHROW(file("/dev/null"));
  CHECK_NOTHROW(FileUses().writes("--out", "/dev/null").writes("--report", "/dev/null").check());
  CHECK_THROWS_WITH(into(folder / "file"), Contains("found a file"));
  CHECK_THROWS_WITH(into(folder / "file/x"), Contains("found a file"));
  CHECK_THROWS_WITH(into(""), Contains("found an empty one"));
  CHECK_THROWS_WITH(into("/proc/wheelhop_test/x"), Contains("cannot write into the folder"));
  CHECK_NOTHROW(into(folder / "there"));
  CHECK_NOTHROW(into(folder / "new/folder"));
  fs::create_directory(folder / "there/a");
  CHECK_THROWS_WITH(into(folder / "there"), Contains("found a folder"));
  CHECK_THROWS_WITH(FileUses().reads("DIR", folder / "there").writes_folder("--out", folder / "new/../there").check(),
                    Contains("DIR"));
  CHECK(folder.names() == std::vector<std::string>{"file", "there"});
}

TEST_CASE("a hard link is a name of its own: a new file takes the place of one name only") {
  const test::Folder folder;
  write_file(folder / "a", "old");
  fs::create_hard_link(folder / "a", folder / "b");
  CHECK_NOTHROW(FileUses().reads("--plant", folder / "a").writes("--out", folder / "b").check());
  write_file(folder / "b", "new");
  CHECK(read_file(folder / "a") == "old");
}
